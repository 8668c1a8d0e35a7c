"""Modes of a system with mean mesh stiffnesses: real basis, complex modes, and damping by modal ratios.

The real modes come with what those left out leave behind: the static flexibility from mesh forces and load to
the meshes and to any output. Complex modes have natural frequencies, damping and whirl with gyroscopic terms
and any viscous damping,

``(lambda^2 M + lambda D + K') x = 0`` with ``D = C + speed G`` and ``K' = K + W diag(mesh_stiffness) W^T``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from femgear.errors import CaseError, ConvergenceError
from femgear.moved import former_names
from femgear.system.mode_kinds import fixed_basis
from femgear.system.system import MechanicalSystem, Modes, Response, check_matrices, damping_matrix, freeze

# Eigenvalues of two modes closer than this (relative) are one multiple eigenvalue: never cut through it.
_MULTIPLE = 1e-6
# Strain of a mesh, or work of the load, on a rigid mode relative to the sum of the absolute terms.
_RIGID_TOLERANCE = 1e-6
# Entries of a rigid mode this small relative to its largest one are rounding.
_RIGID_ROUNDING = 1e-9
# Eigenvalue relative to the largest one below which a motion has no stiffness.
_RIGID = 1e-12
# The same over the softest coordinate, where modes beside so many others are told apart.
_SOFT, _BESIDE = 1e-9, 8
# Pole relative to the largest one that counts as zero or as real.
_ZERO = 1e-11
# Condition of the eigenvectors above which the poles are taken for defective.
_DEFECTIVE = 1e10


@dataclass(frozen=True)
class ComplexModes:
    """Poles with their right and left vectors.

    Of two conjugate poles the one with positive imaginary part stands for both; real poles stand alone.
    Rigid motions enter by their velocity, so that free rotation makes a single pole at zero.

    Parameters
    ----------
    eigenvalue : (p,) complex array
        ``lambda`` [1/s], by size; exactly zero for rigid-body modes.
    shape, drift : (n, p) complex arrays
        Displacement of the elastic motions and velocity of the rigid ones; the right vector of a pole is
        ``shape + drift / lambda``.
    left : (n, p) complex array
        Left vectors ``y``: ``y^H (2 lambda M + D) x = 1``.
    paired : (p,) bool array
        Whether the conjugate pole belongs to it.
    speed : float
        That multiplies the gyroscopic matrix [rad/s].
    dofs : tuple of str
        Names of the n degrees of freedom, as in `MechanicalSystem`.
    """

    eigenvalue: NDArray[np.complex128]
    shape: NDArray[np.complex128]
    drift: NDArray[np.complex128]
    left: NDArray[np.complex128]
    paired: np.ndarray
    speed: float
    dofs: tuple[str, ...]

    def __post_init__(self):
        freeze(self)

    @property
    def rigid(self) -> np.ndarray:
        """Poles at zero (p,)."""
        return self.eigenvalue == 0.0

    @property
    def right(self) -> np.ndarray:
        """Right vectors (n, p) with ``x^H M x = 1``; of rigid modes their velocity."""
        return np.where(self.rigid, self.drift, self.shape + self.drift / np.where(self.rigid, 1.0, self.eigenvalue))

    @property
    def frequency(self) -> np.ndarray:
        """``|lambda| / 2 pi`` (p,) [Hz], the undamped natural frequency where damping is light."""
        return np.abs(self.eigenvalue) / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """``-Re lambda / |lambda|`` (p,): negative where motions grow, +-1 for real poles, 0 if rigid."""
        return np.where(self.rigid, 0.0, -self.eigenvalue.real / np.where(self.rigid, 1.0, np.abs(self.eigenvalue)))


def undamped_modes(
    system: MechanicalSystem,
    mesh_stiffness,
    *,
    damping_ratio=None,
    count: int | None = None,
    max_frequency: float | None = None,
) -> Modes:
    """Solve for the modes of ``K + W diag(k) W^T`` and ``M``, with the flexibility [m/N] of those left out.

    Parameters
    ----------
    system : MechanicalSystem
        Without gyroscopic terms; its ``C`` must be zero unless ``damping_ratio`` is ``None``.
    mesh_stiffness : (n_meshes,) array
        Mean mesh stiffnesses [N/m], not negative.
    damping_ratio : float or (n_modes,) array, optional
        Fraction of critical damping. ``None`` takes ``phi^T C phi / (2 omega)``, which needs a ``C`` that
        the modes make diagonal.
    count : int, optional
        Number of modes to keep, one or two more when the last belongs to a multiple eigenvalue.
    max_frequency : float, optional
        Keep the modes up to this frequency [Hz]. All modes when neither is given.

    Returns
    -------
    Modes
        With the signs of `fixed_basis`; ``kind`` is ``"rigid"`` or ``"elastic"``, ``nodal_diameter`` -1.

    Raises
    ------
    CaseError
        Matrices that do not fit, are not symmetric or not finite; a load that no support takes up.
    ConvergenceError
        A mass that is not positive definite, a stiffness that is negative, a rigid mode that strains a mesh.

    Notes
    -----
    Residual flexibility ``W^T K^+ W - sum r r^T / omega^2``, ``r = W^T phi`` (Geradin and Rixen, Mechanical
    Vibrations, 3rd ed., section 2.9); ``K^+`` is the inverse on the motions free of rigid modes.
    """
    stiffness = total_stiffness(system, mesh_stiffness)
    if system.gyroscopic is not None and np.any(system.gyroscopic):
        raise CaseError(
            "real modes cannot carry gyroscopic terms",
            code="E-CHOICE",
            key="gyroscopic",
            remedy="leave them out of the system that is reduced to modes",
        )
    values, shape, rigid = _eigen(system, stiffness, count, max_frequency)
    if np.any(rigid):
        shape[:, rigid] = _refined_rigid(system.M, stiffness, shape[:, rigid])
    springs = spring_directions(system, mesh_stiffness)
    rows, modal_load = springs.T @ shape, shape.T @ system.load
    _check_rigid(system, shape[:, rigid])
    rows[:, rigid] = modal_load[rigid] = 0.0
    omega = np.sqrt(np.where(rigid, 0.0, values))
    sources = np.zeros((len(shape), 0)) if system.sources is None else system.sources
    count, source_load = len(springs.T), shape.T @ sources
    loads = np.column_stack([springs, system.load, sources])
    static = springs.T @ pseudo_solve(system.M, stiffness, shape[:, rigid], loads)
    return Modes(
        frequency=omega / (2.0 * np.pi),
        damping_ratio=_damping_ratios(system, shape, omega, damping_ratio),
        shape=shape,
        mesh_stiffness=np.asarray(mesh_stiffness, dtype=float),
        mesh_deflection=rows,
        residual=_residual_flexibility(system, mesh_stiffness, static[:, :count], rows, omega),
        load_deflection=static[:, count],
        kind=tuple("rigid" if flag else "elastic" for flag in rigid),
        nodal_diameter=np.full(len(omega), -1),
        dofs=system.dofs,
        modal_load=modal_load,
        source_load=None if system.sources is None else source_load,
        source_residual=None
        if system.sources is None
        else static[:, count + 1 :] - _modal_flexibility(rows, source_load.T, omega),
    )


def _residual_flexibility(system, mesh_stiffness, static, rows, omega) -> np.ndarray:
    """Flexibility (n_meshes, n_meshes) [m/N] of the modes left out and of the meshes themselves."""
    residual = static - _modal_flexibility(rows, rows, omega)
    if system.flexibility is not None:
        residual += _spring_share(system, mesh_stiffness) @ system.flexibility
    return 0.5 * (residual + residual.T)


def residual_output(system: MechanicalSystem, modes: Modes, outputs) -> np.ndarray:
    """Compute the static flexibility [m/N] of the modes left out, from mesh forces to outputs ``L q``.

    ``L K^+ W - sum (L phi) r^T / omega^2`` (n_outputs, n_meshes) [m/N per unit of L] of the outputs ``L``
    (n_outputs, n) and the modes of the system.
    """
    outputs = np.atleast_2d(np.asarray(outputs, dtype=float))
    springs = spring_directions(system, modes.mesh_stiffness)
    static = outputs @ pseudo_solve(*rigid_basis(system, modes), springs)
    omega = 2.0 * np.pi * modes.frequency
    return static - _modal_flexibility(outputs @ modes.shape, modes.mesh_deflection, omega)


def output_load(system: MechanicalSystem, modes: Modes, outputs) -> np.ndarray:
    """Compute the static outputs ``L K^+ load`` (n_outputs,) [m per unit of L] under the constant load.

    All modes count, also those left out; ``outputs`` (n_outputs, n) are ``L``.
    """
    outputs = np.atleast_2d(np.asarray(outputs, dtype=float))
    return outputs @ pseudo_solve(*rigid_basis(system, modes), system.load[:, None])[:, 0]


def source_output(system: MechanicalSystem, modes: Modes, outputs) -> np.ndarray | None:
    """Compute static outputs ``L q`` (n_outputs, c) per source that the modes leave out, as `residual_output`.

    None of a system without sources.
    """
    if system.sources is None or modes.source_load is None:
        return None
    outputs = np.atleast_2d(np.asarray(outputs, dtype=float))
    static = outputs @ pseudo_solve(*rigid_basis(system, modes), system.sources)
    return static - _modal_flexibility(outputs @ modes.shape, modes.source_load.T, 2.0 * np.pi * modes.frequency)


def output_response(modes: Modes, response: Response, rows, *, residual, load, source=None) -> np.ndarray:
    """Compute the harmonics of the outputs ``L q`` [m per unit of L] of a periodic response.

    They are complex (n_speeds, n_outputs, H + 1); the response was computed with the modes.

    Parameters
    ----------
    rows : (n_outputs, n_modes) array
        ``L @ modes.shape`` [kg^-1/2].
    residual : (n_outputs, n_meshes) array
        From :func:`residual_output` [m/N].
    load : (n_outputs,) array
        From :func:`output_load` [m].
    source : (n_outputs, c) array, optional
        From :func:`source_output` [m/N], of a response with sources.
    """
    omega = 2.0 * np.pi * modes.frequency
    forcing = response.force - modes.mesh_stiffness[:, None] * response.deflection
    out = np.matmul(rows, response.modal) - np.matmul(residual, forcing)
    if source is not None and response.source is not None:
        out += np.matmul(source, response.source)
    modal_load = np.zeros(len(omega)) if modes.modal_load is None else modes.modal_load
    out[..., 0] += load - _modal_flexibility(rows, modal_load[None, :], omega)[:, 0]
    return out


def complex_modes(system: MechanicalSystem, mesh_stiffness, *, speed: float = 0.0) -> ComplexModes:
    """Solve for all poles [1/s] and complex modes of the damped, rotating system.

    Parameters
    ----------
    system : MechanicalSystem
        M positive definite, M and K symmetric. K may be negative on some motions (centripetal terms).
    mesh_stiffness : (n_meshes,) array
        [N/m], not negative.
    speed : float
        That multiplies ``system.gyroscopic`` [rad/s].

    Raises
    ------
    CaseError
        Matrices that do not fit, are not symmetric or not finite; a speed that is not finite (E-SPEED).
    ConvergenceError
        A mass that is not positive definite, or poles that share one vector (E-SOLVE).

    Notes
    -----
    State form of the real modes of ``K'`` and ``M`` (L. Meirovitch, Principles and Techniques of Vibrations,
    1997, sections 4.4 and 4.9); the left vectors are the rows of the inverse of the right ones, so that both
    are biorthonormal within multiple poles as well.
    """
    if not np.isfinite(speed):
        raise CaseError("the speed is not finite", code="E-SPEED", value=speed)
    stiffness = total_stiffness(system, mesh_stiffness)
    try:
        square, real = scipy.linalg.eigh(stiffness, system.M)
    except scipy.linalg.LinAlgError as error:
        raise mass_error() from error
    limit = max(_RIGID, 10.0 * len(square) * np.finfo(float).eps) * np.abs(square).max()
    rigid = np.abs(square) <= limit
    damping = real.T @ damping_matrix(system, speed) @ real
    m, elastic = int(np.count_nonzero(~rigid)), ~rigid
    order = np.concatenate([np.flatnonzero(elastic), np.flatnonzero(rigid)])
    scale = np.exp(0.5 * np.mean(np.log(np.abs(square[elastic])))) if m else 1.0
    state = state_matrix(np.diag(square[elastic]), damping[np.ix_(order, order)], scale)
    pairs = scipy.linalg.eig(state)
    value, vector = np.asarray(pairs[0], np.complex128), np.asarray(pairs[1])
    inverse = _inverse(vector)
    zero = max(_ZERO * np.abs(value).max(), 100.0 * np.finfo(float).eps * np.linalg.norm(state))
    value = np.where(np.abs(value) <= zero, 0.0, value)
    value = np.where(np.abs(np.imag(value)) <= _ZERO * np.abs(value), np.real(value), value)
    kept = np.flatnonzero(np.imag(value) >= 0.0)
    kept = kept[np.argsort(np.abs(value[kept]), kind="stable")]
    modes = ComplexModes(
        eigenvalue=value[kept],
        shape=real[:, elastic] @ vector[:m, kept],
        drift=real[:, rigid] @ vector[2 * m :, kept] * scale,
        left=(inverse[kept, m:] @ real[:, order].T).conj().T / scale,
        paired=np.imag(value[kept]) > 0.0,
        speed=float(speed),
        dofs=system.dofs,
    )
    return _normalised(modes, system.M)


def whirl(shape, mass, planes) -> np.ndarray:
    """Find the sense of the orbits of every mode (m,), from -1 (backward) over 0 (straight) to 1 (forward).

    An orbit ``Re((X, Y) exp(i omega t))`` covers area at the rate ``-omega Im(conj(X) Y)``, positive for a
    counter-clockwise one; the sum over the planes, weighted with their masses, is divided by its bound (G.
    Genta, Dynamics of Rotating Systems, 2005, section 2.5). In a rotating frame it is the sense seen there;
    zero where nothing moves in the planes.

    Of complex shapes (n, m), the diagonal of the mass matrix (n,) [kg, kg m^2] and planes (k, 2): rows of x
    and y, or of radial and tangential, of one body each.
    """
    shape, mass, planes = np.asarray(shape), np.asarray(mass, float), np.asarray(planes, int).reshape(-1, 2)
    x, y = shape[planes[:, 0]], shape[planes[:, 1]]
    weight = np.sqrt(mass[planes[:, 0]] * mass[planes[:, 1]])
    area = -2.0 * weight @ np.imag(x.conj() * y)
    bound = weight @ (np.abs(x) ** 2 + np.abs(y) ** 2)
    total = mass @ np.abs(shape) ** 2
    return np.where(bound > 1e-12 * total, area / np.where(bound > 0.0, bound, 1.0), 0.0)


def state_matrix(stiffness: np.ndarray, damping: np.ndarray, scale: float) -> np.ndarray:
    """Make ``A`` (..., 2 m + r, 2 m + r) [1/s] of the first-order form ``y' = A y``, ``y = (q, q' / scale)``.

    Stiffness (..., m, m) [1/s^2] and damping (m + r, m + r) [1/s] are over the masses; the last r motions are
    rigid and enter by their velocity alone, without a double zero. A mean frequency [1/s] as ``scale`` keeps
    the matrix balanced.
    """
    m = stiffness.shape[-1]
    state = np.zeros((*stiffness.shape[:-2], m + len(damping), m + len(damping)))
    state[..., :m, m : 2 * m] = scale * np.eye(m)
    state[..., m : 2 * m, :m] = -stiffness / scale
    state[..., m:, m:] = -damping
    return state


def modal_damping(system: MechanicalSystem, mesh_stiffness, ratio) -> np.ndarray:
    """Make viscous damping ``M Phi diag(2 zeta omega) Phi^T M`` (n, n) [N s/m, ...] of damping ratios.

    Geradin and Rixen, Mechanical Vibrations, 3rd ed., section 3.1: all modes of the system whose columns have
    stiffnesses ``mesh_stiffness`` (n_columns,) [N/m] get ``ratio``, a number or one a mode; rigid ones none.
    """
    modes = undamped_modes(system, mesh_stiffness, damping_ratio=ratio)
    carried = system.M @ modes.shape
    return (carried * (4.0 * np.pi * modes.damping_ratio * modes.frequency)) @ carried.T


def viscous_damping(still: MechanicalSystem, reference: np.ndarray, damping) -> np.ndarray:
    """Make the viscous damping (n, n) [N s/m, ...] of a system at rest: its ``C``, a matrix or modal ratios.

    ``reference`` (n_columns,) are the stiffnesses of the columns in the modes [N/m]; ``damping`` is None, a
    ratio, one ratio a mode or a matrix (n, n) [N s/m, ...].
    """
    if damping is None:
        return still.C
    array = np.asarray(damping, float)
    if array.ndim < 2:
        return modal_damping(still, reference, damping)
    if array.shape != still.M.shape or not np.all(np.isfinite(array)):
        raise CaseError(
            f"a damping matrix of shape {array.shape}",
            code="E-SHAPE",
            key="damping",
            limit=f"{still.M.shape} finite numbers",
        )
    return array


def total_stiffness(system: MechanicalSystem, mesh_stiffness) -> np.ndarray:
    """Add the meshes to the stiffness: ``K + W diag(mesh_stiffness) W^T`` (n, n) [N/m, ...], checked.

    ``mesh_stiffness`` (n_meshes,) [N/m]; the flexibility between the meshes stands in series with them.
    """
    meshes = np.asarray(mesh_stiffness, dtype=float)
    check_matrices(system, symmetric=("M", "K"), columns=len(meshes))
    if not np.all(np.isfinite(meshes)) or np.any(meshes < 0.0):
        raise CaseError(
            "mesh stiffnesses must be finite and not negative",
            code="E-STIFFNESS",
            value=meshes.tolist(),
            limit=">= 0 N/m",
        )
    carried = np.diag(meshes)
    if system.flexibility is not None:
        carried = meshes[:, None] * _spring_share(system, meshes)
    return 0.5 * (system.K + system.K.T) + system.W @ carried @ system.W.T


def spring_directions(system: MechanicalSystem, mesh_stiffness) -> np.ndarray:
    """Directions (n, n_meshes) of which ``directions^T q`` are the deflections of the mesh springs.

    With a flexibility C between the meshes, ``f = k d + g`` and ``d = W^T q - C f`` give
    ``d = S (W^T q - C g)`` and ``f = k S W^T q + S^T g`` with ``S = (I + C k)^-1``: springs k in the
    directions ``W S^T``, whose total stiffness is ``W (k^-1 + C)^-1 W^T``, and the flexibility ``S C`` beside
    that of the modes left out.
    """
    return system.W if system.flexibility is None else system.W @ _spring_share(system, mesh_stiffness).T


def rigid_basis(system: MechanicalSystem, modes: Modes):
    """Collect mass (n, n), total stiffness (n, n) and rigid modes (n, r), as `pseudo_solve` takes them."""
    return system.M, total_stiffness(system, modes.mesh_stiffness), modes.shape[:, modes.frequency == 0.0]


def pseudo_solve(mass, stiffness, rigid, loads) -> np.ndarray:
    """Solve for the elastic displacements ``K^+ loads`` (n, n_loads) [m] of self-equilibrated loads [N].

    Mass and stiffness (n, n), mass-normalised rigid modes (n, r), to which they are mass-orthogonal.
    ``K + a M R R^T M`` is positive definite and gives the same answer for loads without work on R.
    """
    carried = mass @ rigid
    loads = loads - carried @ (rigid.T @ loads)
    out = scipy.linalg.cho_solve(_held(mass, stiffness, rigid), loads)
    return out - rigid @ (carried.T @ out)


def mass_error() -> ConvergenceError:
    """Make the refusal of a mass matrix that is not positive definite (E-MASS)."""
    return ConvergenceError(
        "the mass matrix is not positive definite",
        code="E-MASS",
        remedy="give every degree of freedom some mass or condense it",
    )


def _spring_share(system: MechanicalSystem, mesh_stiffness) -> np.ndarray:
    """``(I + C k)^-1``: what the springs take of the mesh deflections, the bodies taking the rest."""
    flexibility = np.asarray(system.flexibility)
    return np.linalg.inv(np.eye(len(flexibility)) + flexibility * np.asarray(mesh_stiffness, float))


def _eigen(system: MechanicalSystem, stiffness, count, max_frequency):
    """Eigenvalues and mass-normalised shapes that are asked for, and which of them are rigid."""
    mass = system.M
    if count is not None and max_frequency is not None:
        raise CaseError("give the number of modes or the highest frequency, not both", code="E-MODES")
    n = len(mass)
    try:
        factor = np.linalg.cholesky(0.5 * (mass + mass.T))
    except np.linalg.LinAlgError as error:
        raise mass_error() from error
    standard = scipy.linalg.solve_triangular(factor, stiffness, lower=True)
    standard = scipy.linalg.solve_triangular(factor, standard.T, lower=True)
    standard = 0.5 * (standard + standard.T)
    scale = np.abs(standard).sum(axis=1).max()
    subset: dict[str, Any] = {"driver": "evd"}
    if count is not None:
        if count < 1 or int(count) != count:
            raise CaseError("at least one mode is needed", code="E-MODES", value=count)
        if count < n:
            subset = {"subset_by_index": (0, min(n, int(count) + 4) - 1)}
    if max_frequency is not None:
        if not max_frequency > 0.0:
            raise CaseError("the highest frequency must be positive", code="E-MODES", value=max_frequency)
        top = (2.0 * np.pi * max_frequency) ** 2 * (1.0 + 10.0 * _MULTIPLE)
        subset = {"subset_by_value": (-np.inf, top)}
    values, vectors = scipy.linalg.eigh(standard, **subset)
    if not np.all(np.isfinite(values)) or not len(values):
        raise ConvergenceError(
            f"no natural frequency below {max_frequency} Hz",
            code="E-MODES",
            remedy="raise the highest frequency",
        )
    if count is not None:
        kept = min(int(count), len(values))
        while kept < len(values) and values[kept] - values[kept - 1] < _MULTIPLE * abs(values[kept]):
            kept += 1
        values, vectors = values[:kept], vectors[:, :kept]
    rigid = _rigid(values, scale, n)
    if np.any(rigid) and _strains(
        system, scipy.linalg.solve_triangular(factor, vectors[:, rigid], lower=True, trans=1)
    ):
        values, vectors, rigid = _told_apart(factor, stiffness, values, vectors, rigid)
    vectors = fixed_basis(np.where(rigid, 0.0, values), vectors)
    return values, scipy.linalg.solve_triangular(factor, vectors, lower=True, trans=1), rigid


def _rigid(values: np.ndarray, scale: float, n: int) -> np.ndarray:
    """Which eigenvalues are zero up to rounding of the largest one; refuses negative ones."""
    threshold = max(_RIGID, 10.0 * n * np.finfo(float).eps) * scale
    if values[0] < -threshold:
        raise ConvergenceError(
            f"the stiffness matrix is negative on some motion: smallest eigenvalue {values[0]:.3e} 1/s^2",
            code="E-STIFFNESS",
            remedy="check the signs of supports, couplings and mesh directions",
        )
    return np.abs(values) <= threshold


def _told_apart(factor, stiffness, values, vectors, rigid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tell soft modes from rigid ones where rounding of the largest eigenvalue hides both, as light parts make it.

    The lowest modes are combined anew for ``(K + s M)^-1``, whose largest eigenvalues ``1/(omega^2 + s)`` are theirs
    (B. N. Parlett, The Symmetric Eigenvalue Problem, 1998, section 4.4); coordinates of one scale keep ``K + s M`` from
    drowning soft ones. ``factor`` is that of M, values and vectors are those of the standard problem.
    """
    few, mass = min(len(values), 2 * np.count_nonzero(rigid) + _BESIDE), factor @ factor.T
    shift = _softest(mass, stiffness)
    shifted = stiffness + shift * mass
    size = np.sqrt(np.abs(np.diag(shifted)))
    try:
        held = scipy.linalg.cho_factor(shifted / np.outer(size, size), lower=True)
    except scipy.linalg.LinAlgError:
        return values, vectors, rigid
    carried = factor @ vectors[:, :few] / size[:, None]
    inverse, mixed = scipy.linalg.eigh(carried.T @ scipy.linalg.cho_solve(held, carried))
    low = 1.0 / inverse[::-1] - shift
    if low.min() < -_SOFT * shift:  # rounding hides these too
        return values, vectors, rigid
    vectors = np.hstack([vectors[:, :few] @ mixed[:, ::-1], vectors[:, few:]])
    return (
        np.append(low, values[few:]),
        vectors,
        np.arange(len(values)) < np.count_nonzero(np.abs(low) <= _SOFT * shift),
    )


def _refined_rigid(mass, stiffness, shape) -> np.ndarray:
    """Rigid modes cleaned of elastic parts, mass-orthonormal: twice ``x - (K + a M x x^T M)^-1 K x``."""
    for _ in range(2):
        shape = shape - scipy.linalg.cho_solve(_held(mass, stiffness, shape), stiffness @ shape)
        lower = np.linalg.cholesky(shape.T @ mass @ shape)
        shape = scipy.linalg.solve_triangular(lower, shape.T, lower=True).T
    return shape


def _held(mass, stiffness, rigid):
    """Cholesky factor of ``K + a M R R^T M``: the elastic part as it is, rigid motions held by a spring a."""
    carried = mass @ rigid
    weight = _softest(mass, stiffness)
    try:
        return scipy.linalg.cho_factor(stiffness + weight * (carried @ carried.T), lower=True)
    except scipy.linalg.LinAlgError:
        raise ConvergenceError(
            "rounding of the largest stiffness hides the smallest",
            code="E-STIFFNESS",
            remedy="bring the stiffnesses closer together",
        ) from None


def _softest(mass, stiffness) -> float:
    """Ratio of stiffness to mass of the softest coordinate: of a stiff one rounding would drown soft couplings."""
    ratio_of_diagonals = np.diag(stiffness) / np.diag(mass)
    weight = ratio_of_diagonals[ratio_of_diagonals > 0.0].min(initial=np.inf)
    return weight if np.isfinite(weight) else 1.0


def _strains(system: MechanicalSystem, rigid: np.ndarray) -> bool:
    """Whether modes (n, r) strain an element beyond rounding."""
    return bool(np.any(np.abs(system.W.T @ rigid) > _allowed(system.W, rigid)))


def _check_rigid(system: MechanicalSystem, rigid: np.ndarray) -> None:
    """Refuse rigid modes that strain a mesh or on which the load does work."""
    strain, allowed = np.abs(system.W.T @ rigid), _allowed(system.W, rigid)
    if np.any(strain > allowed):
        mesh = int(np.argmax((strain - allowed).max(axis=1)))
        raise ConvergenceError(
            f"a motion without stiffness strains column {mesh + 1} of W: its mean stiffness is missing or too small",
            code="E-RIGID-MODE",
            remedy="give every mesh, bearing or spring a mean stiffness",
        )
    work, allowed = np.abs(system.load @ rigid), _allowed(system.load[:, None], rigid)[0]
    if np.any(work > allowed):
        mode = int(np.argmax(work - allowed))
        size = np.abs(system.load) @ np.abs(rigid[:, mode])
        dof = int(np.argmax(np.abs(rigid[:, mode])))
        name = system.dofs[dof] if system.dofs else str(dof)
        raise CaseError(
            f"the constant load does work on a rigid-body motion (largest at {name}): {work[mode]:.3e} of {size:.3e}",
            code="E-LOAD-BALANCE",
            limit="a load in equilibrium with itself",
            remedy="add the reaction torque of the output, hold that motion by a support, or check the unit "
            "of the spring that holds it: one far softer than the others counts as none",
        )


def _allowed(columns: np.ndarray, rigid: np.ndarray) -> np.ndarray:
    """Products (n_columns, n_rigid) of columns and rigid modes that count as zero."""
    # where a mode does not move a column, its terms there are rounding of its largest entry
    terms = _RIGID_TOLERANCE * np.abs(columns).T @ np.abs(rigid)
    largest = np.abs(columns).max(axis=0, initial=0.0)[:, None] * np.abs(rigid).max(axis=0, initial=0.0)
    return np.maximum(terms, _RIGID_ROUNDING * largest)


def _modal_flexibility(left: np.ndarray, right: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """``sum left right^T / omega^2`` over the modes that are not rigid."""
    elastic = omega > 0.0
    return (left[:, elastic] / omega[elastic] ** 2) @ right[:, elastic].T


def _damping_ratios(system: MechanicalSystem, shape, omega, damping_ratio) -> np.ndarray:
    if damping_ratio is None:
        modal = shape.T @ system.C @ shape
        off = np.abs(modal - np.diag(np.diag(modal))).max(initial=0.0)
        if off > 1e-6 * np.abs(modal).max(initial=0.0):
            raise CaseError(
                "the viscous damping couples the modes",
                code="E-DAMPING",
                key="damping_ratio",
                remedy="give a modal damping ratio, or a damping matrix proportional to mass and stiffness",
            )
        return np.where(omega > 0.0, np.diag(modal) / (2.0 * np.where(omega > 0.0, omega, 1.0)), 0.0)
    if np.any(system.C):
        raise CaseError(
            "a damping ratio and a damping matrix are given",
            code="E-DAMPING",
            key="damping_ratio",
            remedy="keep one of them",
        )
    ratio = np.asarray(damping_ratio, dtype=float)
    if ratio.ndim > 1 or (ratio.ndim == 1 and len(ratio) != len(omega)):
        raise CaseError(
            f"{ratio.size} damping ratios for {len(omega)} modes",
            code="E-DAMPING",
            key="damping_ratio",
            limit="one number, or one a mode",
        )
    if not np.all(np.isfinite(ratio)) or np.any(ratio < 0.0):
        raise CaseError(
            "damping ratios must be finite and not negative",
            code="E-DAMPING",
            key="damping_ratio",
            value=ratio.tolist(),
            limit=">= 0",
        )
    return np.where(omega > 0.0, ratio, 0.0)


def _inverse(vector: np.ndarray) -> np.ndarray:
    size = np.linalg.svd(vector, compute_uv=False)
    if not size[-1] * _DEFECTIVE > size[0]:
        raise ConvergenceError(
            f"two poles share one vector: condition {size[0] / max(size[-1], 1e-300):.1e} of the modes",
            code="E-SOLVE",
            limit=f"{_DEFECTIVE:.0e}",
            remedy="a mode is critically damped or a speed is critical: change damping or speed a little",
        )
    return np.linalg.inv(vector)


def _normalised(modes: ComplexModes, mass: np.ndarray) -> ComplexModes:
    """``x^H M x = 1`` with the phase that makes ``x^T M x`` real, so that real modes come out real."""
    right = modes.right
    size = np.sqrt(np.einsum("ip,ip->p", right.conj(), mass @ right).real)
    square = np.einsum("ip,ip->p", right, mass @ right)
    # circular orbits have x^T M x = 0 and any phase
    phase = np.where(np.abs(square) > 1e-9 * size**2, np.sqrt(square / np.abs(np.where(square == 0, 1, square))), 1.0)
    factor = 1.0 / (size * phase)
    return replace(modes, shape=modes.shape * factor, drift=modes.drift * factor, left=modes.left / factor.conj())


__getattr__ = former_names(__name__, {"solve_modes": undamped_modes})
