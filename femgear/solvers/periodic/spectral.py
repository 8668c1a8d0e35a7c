"""Periodic response of the gear meshes in the frequency domain, all speeds together.

The harmonic equations of the mesh deflections, ``E + T G E = S``, are solved for many speeds at once, by a
fixed point or directly; meshes that repeat others later in time are solved once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import linalg as sparse_linalg

from femgear.errors import CaseError, ConvergenceError
from femgear.system.fourier import Product, pad, sample
from femgear.system.system import MeshExcitation, Modes, Response, mesh_harmonics

# Two signals or receptances closer than this (relative) are equal: identical planets.
_EQUAL = 1e-9
# Share of the energy in the upper half of the harmonics above which the message warns. Halving or doubling
# the harmonics of planetary sets shows a truncation error of the size of this share: 0.1 % of the amplitude.
_TAIL_ENERGY = 1e-3
# Fluctuation, relative to the mean, below which there is none.
_STILL = 1e-12
# Speeds treated together: their receptances and matrices stay in the cache.
_BATCH = 40
# Unknowns of one speed above which Krylov steps replace elimination, and the residual that they must reach.
_DENSE = 1500
_ROUNDING = 1e-13


def solve_spectral(
    modes: Modes,
    excitation: MeshExcitation,
    mesh_frequency,
    *,
    excitation_harmonics: int | np.ndarray = 6,
    response_harmonics: int | np.ndarray = 12,
    lines: int = 0,
    tolerance: float = 1e-6,
    method: str = "auto",
    max_iterations: int = 100,
) -> Response:
    """Solve for the periodic response of the gear meshes at all mesh frequencies.

    The force of mesh j is ``f_j = F_j + k_j (d_j - s_j)`` (see MeshExcitation) with k, s and F cut to
    `excitation_harmonics`. With ``k~ = k - mean`` and the receptance T of the system that has the mean
    stiffnesses, the mesh deflections satisfy for every harmonic h

        ``d_h + T_h (k~ d)_h = S_h = d_load delta_h0 - T_h [F - k s]_h``

    which are Eqs. (7) to (12) of "Vibratory response of planetary gear sets housing by a spectral iterative
    approach"; its iteration is ``E <- S - T G E`` from ``E = S``.

    Parameters
    ----------
    modes : Modes
        Basis with mesh stiffnesses near the mean of the excitation.
    excitation : MeshExcitation
    mesh_frequency : float or (n_speeds,) array
        [Hz], not negative; zero gives the static response.
    excitation_harmonics, response_harmonics : int or (n_speeds,) int array
        Mesh harmonics kept in the data and in the response, of all speeds or one a speed; products are formed
        without aliasing. The result has as many harmonics as the speed with the most, zeros beyond its own.
    lines : int
        Harmonics that the result has at least.
    tolerance : float
        Relative change at which the fixed point stops; the full equations of a converged solution then hold
        to ten times that.
    method : {"auto", "fixed point", "direct"}
        ``"auto"`` uses the fixed point where its spectral radius promises convergence within
        `max_iterations` and the direct solution of the same equations elsewhere.
    max_iterations : int
        Of the fixed point.

    Returns
    -------
    Response
        Where ``converged`` is False (only with ``method="fixed point"``) the harmonics are NaN.

    Raises
    ------
    CaseError
        Data that cannot be used: not finite, negative frequencies, too few positions.
    ConvergenceError
        An undamped resonance, or equations that even the direct solution does not satisfy.
    """
    frequency = _checked(modes, excitation, mesh_frequency, method, tolerance, max_iterations)
    kept = np.stack(np.broadcast_arrays(frequency, excitation_harmonics, response_harmonics)[1:]).astype(int)
    _check_harmonics(*kept)
    options = (method, tolerance, max_iterations)
    top = max(int(kept[1].max()), lines) * excitation.periods
    found: list = [None] * len(frequency)
    for harmonics, own in np.unique(kept, axis=1).T:
        data = _Data.build(modes, excitation, int(harmonics), int(own) * excitation.periods)
        chosen = np.flatnonzero((kept.T == (harmonics, own)).all(axis=1))
        for part in np.array_split(chosen, -(-len(chosen) // _BATCH)):
            solved = _solve_batch(modes, data, frequency[part] / excitation.periods, options, top)
            for i, *values in zip(part, *solved, strict=True):
                found[i] = values
    return _response(frequency, found, method, tolerance, excitation.periods)


@dataclass(frozen=True)
class HarmonicProblem:
    """``E_h + T_h (g E)_h = S_h`` for every harmonic h, mesh and speed.

    Receptance T (n, n, n_speeds, H + 1) [m/N]; multiplication by the stiffness fluctuation g (n, H + 1) of
    each mesh [N/m]; source S (n, n_speeds, H + 1) [m].
    """

    receptance: np.ndarray
    product: Product
    source: np.ndarray

    def take(self, speeds) -> HarmonicProblem:
        """Take the problem at some of the speeds, indices or a mask."""
        return HarmonicProblem(self.receptance[:, :, speeds], self.product, self.source[:, speeds])


@dataclass(frozen=True)
class Twins:
    """Meshes that repeat others later in time: ``x_j(t) = x_leader(j)(t - phase_j T)``.

    First mesh of every group (n_groups,), group of every mesh (n_meshes,), factors ``exp(-2 pi i h phase_j)``
    (n_meshes, H + 1).
    """

    leaders: np.ndarray
    group: np.ndarray
    shift: np.ndarray


def compliance(modes: Modes, omega: np.ndarray) -> np.ndarray:
    """Compute modal receptances ``1 / (w_k^2 - omega^2 + 2 i zeta w_k omega)`` (..., n_modes) [s^2].

    Zero for rigid modes, which no self-equilibrated force moves.

    Parameters
    ----------
    modes : Modes
    omega : (...) array
        Angular frequencies [rad/s].

    Raises
    ------
    ConvergenceError
        At an undamped resonance of a mode that a mesh moves.
    """
    natural = 2.0 * np.pi * modes.frequency
    elastic = natural > 0.0
    w = np.where(elastic, natural, 1.0)
    ratio = np.asarray(omega)[..., None] / w
    denominator = 1.0 - ratio * ratio + 2j * modes.damping_ratio * ratio
    moved = elastic & np.any(modes.mesh_deflection != 0.0, axis=0)
    infinite = (np.abs(denominator) < 1e-10) & moved
    if np.any(infinite):
        mode = int(np.argwhere(infinite)[0][-1])
        raise ConvergenceError(
            f"undamped resonance of mode {mode + 1} at {modes.frequency[mode]:.6g} Hz: infinite response",
            code="E-RESONANCE", key="damping_ratio", value=float(modes.damping_ratio[mode]), limit="> 0",
            remedy="give the mode some damping or move the speed",
        )  # fmt: skip
    safe = np.where(np.abs(denominator) < 1e-10, 1.0, denominator)
    return np.where(elastic, 1.0 / (safe * w * w), 0.0)


def _modal_receptance(modes: Modes, modal: np.ndarray) -> np.ndarray:
    """``T = sum r r^T H_k + residual`` (n, n, ...) from the modal receptances (..., n_modes) [m/N]."""
    rows = modes.mesh_deflection
    n, lower = len(rows), np.tril_indices(len(rows))
    pairs = (rows[lower[0]] * rows[lower[1]]).T
    flat = np.stack([np.real(modal) @ pairs, np.imag(modal) @ pairs], axis=-1).view(complex)[..., 0]
    flat += modes.residual[lower]
    out = np.empty((n, n, *modal.shape[:-1]), dtype=complex)
    for index, (i, j) in enumerate(zip(*lower)):
        out[i, j] = out[j, i] = flat[..., index]
    return out


def transfer(receptances: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Compute ``T_h f_h`` (n, n_speeds, H + 1) [m] of receptances (n, n, n_speeds, H + 1) and forces [N]."""
    out = np.empty((receptances.shape[0], *force.shape[1:]), dtype=complex)
    for i, row in enumerate(receptances):
        np.einsum("jsh,jsh->sh", row, force, out=out[i])
    return out


def _apply(problem: HarmonicProblem, deflection: np.ndarray) -> np.ndarray:
    """``T G E`` of (n, n_speeds, H + 1) harmonics."""
    return transfer(problem.receptance, problem.product(deflection))


def _harmonic_residual(problem: HarmonicProblem, deflection: np.ndarray) -> np.ndarray:
    """Size of ``E + T G E - S`` relative to that of E, per speed."""
    error = deflection + _apply(problem, deflection) - problem.source
    return _norm(error) / np.maximum(_norm(deflection), np.finfo(float).tiny)


def _norm(deflection: np.ndarray) -> np.ndarray:
    """Euclidean norm over meshes and harmonics, per speed."""
    return np.sqrt(np.einsum("jsh,jsh->s", deflection, deflection.conj()).real)


def matrices(problem: HarmonicProblem) -> np.ndarray:
    """Make ``T G`` as matrices (n_speeds, n L, n L) on real and imaginary parts in turn, L = 2 (H + 1)."""
    n, _, speeds, size = problem.receptance.shape
    product = problem.product.matrix.reshape(n, size, 2, 2 * size)
    columns = product[:, :, 0] + 1j * product[:, :, 1]
    out = np.empty((speeds, n, size, 2, n, 2 * size))
    for i in range(n):
        for j in range(n):
            block = problem.receptance[i, j][:, :, None] * columns[j]
            out[:, i, :, 0, j], out[:, i, :, 1, j] = np.real(block), np.imag(block)
    return out.reshape(speeds, 2 * n * size, 2 * n * size)


def solve_direct(problem: HarmonicProblem) -> np.ndarray:
    """Solve ``(I + T G) E = S`` for the harmonics (n, n_speeds, H + 1) of the mesh deflections [m].

    By Gaussian elimination; many unknowns by GMRES (Y. Saad and M. H. Schultz, SIAM J. Sci. Stat. Comput. 7,
    1986, pp. 856-869) with products in time, without ever forming the matrix, and by elimination where that
    does not reach rounding.

    Raises
    ------
    ConvergenceError
        When the equations are singular: an undamped parametric resonance.
    """
    n, speeds, size = problem.source.shape
    if 2 * n * size <= _DENSE:
        return _eliminated(problem)
    return np.concatenate([_krylov(problem.take(np.array([i]))) for i in range(speeds)], axis=1)


def _krylov(problem: HarmonicProblem) -> np.ndarray:
    """Harmonics (n, 1, H + 1) [m] of one speed by GMRES, or by elimination."""
    n, _, size = problem.source.shape

    def image(row: np.ndarray) -> np.ndarray:
        deflection = np.ascontiguousarray(row.reshape(n, 1, 2 * size)).view(complex)
        return row + _rows(_apply(problem, deflection))[0]

    right = _rows(problem.source)[0]
    operator = sparse_linalg.LinearOperator((len(right), len(right)), matvec=image, dtype=float)  # type: ignore[call-arg]
    row = None
    for _ in range(4):
        row, _ = sparse_linalg.gmres(
            operator, right, x0=row, rtol=0.1 * _ROUNDING, atol=0.0, restart=400, maxiter=1
        )
        found = np.ascontiguousarray(row.reshape(n, 1, 2 * size)).view(complex)
        if _harmonic_residual(problem, found)[0] <= _ROUNDING:
            return found
    return _eliminated(problem)


def _eliminated(problem: HarmonicProblem) -> np.ndarray:
    """Harmonics (n, n_speeds, H + 1) [m] by Gaussian elimination; refuses singular equations."""
    n, speeds, size = problem.source.shape
    operator = matrices(problem)
    diagonal = np.arange(operator.shape[-1])
    operator[:, diagonal, diagonal] += 1.0
    right = np.ascontiguousarray(problem.source.transpose(1, 0, 2)).view(float).reshape(speeds, -1, 1)
    try:
        solution = np.linalg.solve(operator, right)
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            "the harmonic equations are singular: there is no periodic response at a parametric resonance",
            code="E-RESONANCE", remedy="give the modes some damping or move the speed",
        ) from error  # fmt: skip
    rows = np.ascontiguousarray(solution[..., 0]).view(complex)
    return rows.reshape(speeds, n, size).transpose(1, 0, 2).copy()


def find_twins(signals: tuple[np.ndarray, ...]) -> Twins:
    """Group meshes whose signals, harmonics (n_meshes, H + 1), are all the same but for one time shift."""
    scales = [max(np.abs(signal).max(), np.finfo(float).tiny) for signal in signals]
    stacked = np.stack([signal / scale for signal, scale in zip(signals, scales)])
    n, size = stacked.shape[1:]
    h = np.arange(size)
    leaders, group, shift = [], np.zeros(n, dtype=int), np.ones((n, size), dtype=complex)
    for j in range(n):
        for index, leader in enumerate(leaders):
            factor = np.exp(-2j * np.pi * h * _phase(stacked[:, leader], stacked[:, j]))
            if np.abs(stacked[:, j] - factor * stacked[:, leader]).max() < _EQUAL:
                group[j], shift[j] = index, factor
                break
        else:
            group[j] = len(leaders)
            leaders.append(j)
    return Twins(np.array(leaders), group, shift)


def reduce_twins(problem: HarmonicProblem, twins: Twins) -> HarmonicProblem | None:
    """Reduce a problem to the group leaders; ``None`` when the receptances do not share the symmetry."""
    shifted = problem.receptance * twins.shift[None, :, None, :]
    folded = np.stack([shifted[:, twins.group == g].sum(axis=1) for g in range(len(twins.leaders))], axis=1)
    reduced = folded[twins.leaders]
    scale = np.abs(problem.receptance).max(axis=(0, 1))
    for j, g in enumerate(twins.group):
        if np.any(np.abs(folded[j] - twins.shift[j] * reduced[g]) > _EQUAL * scale):
            return None
    product = Product(problem.product.factor[twins.leaders])
    return HarmonicProblem(reduced, product, problem.source[twins.leaders])


def _expand_twins(deflection: np.ndarray, twins: Twins) -> np.ndarray:
    """Harmonics of all meshes from those of the group leaders."""
    return deflection[twins.group] * twins.shift[:, None, :]


def spectral_radius(problem: HarmonicProblem, *, exact_limit: int = 80) -> np.ndarray:
    """Compute the spectral radius (n_speeds,) of the fixed point, that of ``T G``, without unit.

    Eigenvalues of the full matrices of at most `exact_limit` rows; otherwise the largest Ritz value of 20
    Arnoldi steps from one random vector (Saad, Numerical Methods for Large Eigenvalue Problems, algorithm
    6.1), all speeds together; but for rounding none depends on the others.
    """
    n, speeds, size = problem.source.shape
    if 2 * n * size <= exact_limit:
        return np.abs(np.linalg.eigvals(matrices(problem))).max(axis=-1)
    steps = min(20, n * (2 * size - 1))
    start = np.random.default_rng(0).standard_normal((n, 1, size, 2)).view(np.complex128)[..., 0]
    start.imag[..., 0] = 0.0
    start = np.repeat(start, speeds, axis=1)
    basis = np.empty((speeds, steps + 1, 2 * n * size))
    hessenberg = np.zeros((speeds, steps + 1, steps))
    basis[:, 0] = _rows(start / _norm(start)[None, :, None])
    for k in range(steps):
        vector = basis[:, k].reshape(speeds, n, 2 * size).transpose(1, 0, 2)
        image = _rows(_apply(problem, np.ascontiguousarray(vector).view(complex)))[..., None]
        known = basis[:, : k + 1]
        for _ in range(2):
            share = np.matmul(known, image)
            image -= np.matmul(known.transpose(0, 2, 1), share)
            hessenberg[:, : k + 1, k] += share[..., 0]
        length = np.sqrt(np.einsum("sd,sd->s", image[..., 0], image[..., 0]))
        hessenberg[:, k + 1, k] = length
        basis[:, k + 1] = image[..., 0] / np.maximum(length, np.finfo(float).tiny)[:, None]
    return np.abs(np.linalg.eigvals(hessenberg[:, :-1])).max(axis=-1)


def _response(frequency, found, method: str, tolerance: float, periods: int) -> Response:
    """The batches together; refuses what even the direct solution does not satisfy."""
    deflection, force, modal, residual, iterations, radius, tail, direct = map(np.array, zip(*found))
    converged = residual <= 10.0 * tolerance
    if method != "fixed point" and not np.all(converged):
        worst = int(np.argmax(np.where(np.isfinite(residual), residual, np.inf)))
        raise ConvergenceError(
            f"residual {residual[worst]:.3e} of the harmonic equations at {frequency[worst]:.6g} Hz",
            code="E-RESONANCE", limit=f"{10.0 * tolerance:.1e}",
            remedy="the equations are nearly singular there: give the modes more damping or move the speed",
        )  # fmt: skip
    for array in (deflection, force, modal):
        array[~converged] = np.nan
    tail = np.where(converged, tail, np.nan)
    lowest = sample(force, 4 * force.shape[-1]).min(axis=(1, 2))
    response = Response(
        mesh_frequency=frequency, deflection=deflection, force=force, modal=modal, converged=converged,
        residual=residual, iterations=iterations, spectral_radius=radius, tail=tail,
        method=tuple("direct" if flag else "fixed point" for flag in direct),
        lowest_force=lowest, message="", periods=periods,
    )  # fmt: skip
    return replace(response, message=joint_message([response]))


def _check_harmonics(excitation_harmonics: np.ndarray, response_harmonics: np.ndarray) -> None:
    short = response_harmonics < excitation_harmonics
    if np.any(short):
        wanted, given = excitation_harmonics[short][0], response_harmonics[short][0]
        raise CaseError(
            f"{given} response harmonics cannot follow {wanted} of the excitation",
            code="E-HARMONICS", key="response_harmonics", value=int(given),
            limit=f">= {wanted}, better twice as many",
        )  # fmt: skip


def _checked(modes, excitation, mesh_frequency, method, tolerance, max_iterations) -> np.ndarray:
    frequency = np.atleast_1d(np.array(mesh_frequency, dtype=float))
    if frequency.ndim != 1 or not len(frequency):
        raise CaseError("mesh frequencies must be one list", code="E-SHAPE", key="mesh_frequency")
    bad = ~np.isfinite(frequency) | (frequency < 0.0)
    if np.any(bad):
        raise CaseError(
            "mesh frequencies must be finite and not negative",
            code="E-RANGE", key="mesh_frequency", value=float(frequency[bad][0]), limit=">= 0 Hz",
        )  # fmt: skip
    if len(modes.mesh_stiffness) != len(excitation.stiffness):
        raise CaseError(
            f"modes of {len(modes.mesh_stiffness)} meshes, excitation of {len(excitation.stiffness)}",
            code="E-SHAPE",
        )  # fmt: skip
    if method not in ("auto", "fixed point", "direct"):
        raise CaseError(
            f"unknown method {method!r}", code="E-CHOICE", key="method", value=method,
            limit="auto, fixed point, direct",
        )  # fmt: skip
    if not 1e-12 <= tolerance < 1.0 or max_iterations < 1:
        raise CaseError(
            f"tolerance {tolerance} and {max_iterations} iterations cannot be used",
            code="E-RANGE", limit="1e-12 <= tolerance < 1, at least one iteration",
        )  # fmt: skip
    return frequency


@dataclass(frozen=True)
class _Data:
    """What does not depend on speed: the fluctuation, the forcing ``F - k s`` and who repeats whom."""

    product: Product
    forcing: np.ndarray
    twins: Twins

    @classmethod
    def build(cls, modes: Modes, excitation: MeshExcitation, harmonics: int, count: int) -> _Data:
        stiffness, deflection, force = (
            pad(signal, count) for signal in mesh_harmonics(excitation, harmonics)
        )
        forcing = force - Product(stiffness)(deflection)
        stiffness[:, 0] -= modes.mesh_stiffness
        load = pad(modes.load_deflection[:, None], count)
        twins = find_twins((stiffness, forcing, load))
        return cls(Product(stiffness), forcing, twins)


def _solve_batch(modes, data: _Data, fundamental, options, top: int) -> tuple[np.ndarray, ...]:
    """Deflection, force, modal coordinates, residual, iterations, radius, tail, directness of some speeds.

    Harmonics are filled up with zeros to `top`.
    """
    method, tolerance, max_iterations = options
    lines = np.arange(data.forcing.shape[-1])
    modal = compliance(modes, 2.0 * np.pi * fundamental[:, None] * lines)
    receptance = _modal_receptance(modes, modal)
    forcing = np.repeat(data.forcing[:, None, :], len(fundamental), axis=1)
    source = -transfer(receptance, forcing)
    source[..., 0] += modes.load_deflection[:, None]
    problem = HarmonicProblem(receptance, data.product, source)
    radius = spectral_radius(problem)
    reduced = reduce_twins(problem, data.twins) if len(data.twins.leaders) < len(source) else None
    deflection, iterations, direct = _solve(reduced or problem, radius, method, tolerance, max_iterations)
    if reduced is not None:
        deflection = _expand_twins(deflection, data.twins)
    residual = _harmonic_residual(problem, deflection)
    # the full equations decide: planets equal to 1e-9 only, or a last iteration that grew again
    rough = np.flatnonzero(~(residual <= tolerance))
    if len(rough) and method != "fixed point":
        deflection[:, rough], direct[rough] = solve_direct(problem.take(rough)), True
        residual[rough] = _harmonic_residual(problem.take(rough), deflection[:, rough])
    total = forcing + data.product(deflection)
    force = total + modes.mesh_stiffness[:, None, None] * deflection
    work = -np.tensordot(modes.mesh_deflection, total, axes=(0, 0))
    if modes.modal_load is not None:
        work[..., 0] += modes.modal_load[:, None]
    coordinates = work.transpose(1, 0, 2) * modal.transpose(0, 2, 1)
    deflection, force = deflection.transpose(1, 0, 2), force.transpose(1, 0, 2)
    lines = (pad(values, top) for values in (deflection, force, coordinates))
    return (*lines, residual, iterations, radius, _tail(deflection), direct)


def _solve(problem: HarmonicProblem, radius, method: str, tolerance: float, max_iterations: int):
    """Deflections, iterations and where the direct solution was used."""
    speeds = len(radius)
    deflection, iterations = np.empty_like(problem.source), np.zeros(speeds, dtype=int)
    direct = np.full(speeds, method == "direct")
    if method == "auto":
        # the change shrinks by the radius a step: more steps than allowed means no fixed point
        direct = radius >= tolerance ** (1.0 / max_iterations)
    chosen = np.flatnonzero(~direct)
    if len(chosen):
        found, steps, done = _fixed_point(problem.take(chosen), tolerance, max_iterations)
        deflection[:, chosen], iterations[chosen] = found, steps
        if method == "auto":
            direct[chosen[~done]] = True
    chosen = np.flatnonzero(direct)
    if len(chosen):
        deflection[:, chosen] = solve_direct(problem.take(chosen))
    return deflection, iterations, direct


def _fixed_point(problem: HarmonicProblem, tolerance: float, max_iterations: int):
    """``E <- S - T G E`` until the relative change is below `tolerance`, at most `max_iterations` times."""
    value = problem.source.copy()
    iterations = np.zeros(value.shape[1], dtype=int)
    change = np.full(value.shape[1], np.inf)
    limit = 1e8 * np.maximum(_norm(value), np.finfo(float).tiny)
    active = np.arange(value.shape[1])
    for _ in range(max_iterations):
        old = value[:, active]
        new = problem.source[:, active] - _apply(problem.take(active), old)
        size = np.maximum(_norm(new), np.finfo(float).tiny)
        change[active] = _norm(new - old) / size
        value[:, active] = new
        iterations[active] += 1
        active = active[(change[active] > tolerance) & (size < limit[active])]
        if not len(active):
            break
    return value, iterations, change <= tolerance


def _tail(deflection: np.ndarray) -> np.ndarray:
    """Share of the fluctuating amplitude in the harmonics above H/2 (root of the energy ratio), per speed.

    Zero where the fluctuation is rounding of the mean.
    """
    energy = np.sum(np.abs(deflection) ** 2, axis=1)
    upper, total = energy[:, 1 + (deflection.shape[-1] - 1) // 2 :].sum(axis=1), energy[:, 1:].sum(axis=1)
    still = total <= _STILL**2 * energy[:, 0]
    return np.where(still, 0.0, np.sqrt(upper / np.where(still, 1.0, total)))


def joint_message(responses: Sequence[Response]) -> str:
    """Write what is to be said of responses, each at some speeds: the method, and everything doubtful."""
    names = ("mesh_frequency", "converged", "spectral_radius", "tail", "lowest_force")
    frequency, converged, radius, tail, lowest = (
        np.concatenate([getattr(one, name) for one in responses]) for name in names
    )
    direct = np.concatenate([np.array(one.method) == "direct" for one in responses])
    parts = [
        f"{len(frequency)} speeds: fixed point at {int(np.sum(~direct & converged))}, direct solution at "
        f"{int(np.sum(direct))}; largest spectral radius {np.max(radius):.3g} "
        f"at {frequency[int(np.argmax(radius))]:.6g} Hz."
    ]
    if not np.all(converged):
        first = int(np.argmin(converged))
        parts.append(
            f"The fixed point did not converge at {int(np.sum(~converged))} speeds, first at "
            f"{frequency[first]:.6g} Hz with spectral radius {radius[first]:.3g}: use the direct solution."
        )
    if not np.any(converged):
        return " ".join(parts)
    short = converged & (tail**2 > _TAIL_ENERGY)
    if np.any(short):
        worst = int(np.argmax(np.where(converged, tail, -1.0)))
        parts.append(
            f"Too few response harmonics at {int(np.sum(short))} speeds: the upper half holds "
            f"{tail[worst] ** 2:.2g} of the energy at {frequency[worst]:.6g} Hz (wanted: below "
            f"{_TAIL_ENERGY:g})."
        )
    if np.any(lowest < 0.0):
        worst = int(np.nanargmin(lowest))
        parts.append(
            f"A mesh force becomes negative at {int(np.sum(lowest < 0.0))} speeds, worst at "
            f"{frequency[worst]:.6g} Hz ({lowest[worst]:.4g} N): teeth would separate there, "
            "which this linear solution cannot follow."
        )
    return " ".join(parts)


def _phase(leader: np.ndarray, follower: np.ndarray) -> float:
    """Time shift, as a fraction of the period, from the first harmonic that is there."""
    present = np.abs(leader[:, 1:]) > 1e3 * _EQUAL
    if not np.any(present):
        return 0.0
    h = int(np.argmax(np.any(present, axis=0))) + 1
    signal = int(np.argmax(np.abs(leader[:, h])))
    return float(-np.angle(follower[signal, h] / leader[signal, h]) / (2.0 * np.pi * h))


def _rows(harmonics: np.ndarray) -> np.ndarray:
    """(n, n_speeds, H + 1) harmonics as one interleaved real row a speed."""
    flat = np.ascontiguousarray(harmonics.transpose(1, 0, 2))
    return flat.view(float).reshape(len(flat), -1)
