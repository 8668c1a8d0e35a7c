"""Complex modes: natural frequencies, damping and whirl with gyroscopic terms and any viscous damping.

``(lambda^2 M + lambda D + K') x = 0`` with ``D = C + speed G`` and ``K' = K + W diag(mesh_stiffness) W^T``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.modal import total_stiffness
from femgear.system import MechanicalSystem

# Eigenvalue of K' over M, relative to the largest, below which a motion has no stiffness.
_RIGID = 1e-12
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
    """

    eigenvalue: np.ndarray
    shape: np.ndarray
    drift: np.ndarray
    left: np.ndarray
    paired: np.ndarray
    speed: float
    dofs: tuple[str, ...]

    def __post_init__(self):
        for name in ("eigenvalue", "shape", "drift", "left", "paired"):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def rigid(self) -> np.ndarray:
        """Poles at zero (p,)."""
        return self.eigenvalue == 0.0

    @property
    def right(self) -> np.ndarray:
        """Right vectors (n, p) with ``x^H M x = 1``; of rigid modes their velocity."""
        return np.where(
            self.rigid, self.drift, self.shape + self.drift / np.where(self.rigid, 1.0, self.eigenvalue)
        )

    @property
    def frequency(self) -> np.ndarray:
        """``|lambda| / 2 pi`` (p,) [Hz], the undamped natural frequency where damping is light."""
        return np.abs(self.eigenvalue) / (2.0 * np.pi)

    @property
    def damped_frequency(self) -> np.ndarray:
        """``Im lambda / 2 pi`` (p,) [Hz]; zero for real poles."""
        return self.eigenvalue.imag / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """``-Re lambda / |lambda|`` (p,): negative where motions grow, +-1 for real poles, 0 if rigid."""
        return np.where(
            self.rigid, 0.0, -self.eigenvalue.real / np.where(self.rigid, 1.0, np.abs(self.eigenvalue))
        )


def complex_modes(system: MechanicalSystem, mesh_stiffness, *, speed: float = 0.0) -> ComplexModes:
    """All modes of the damped, rotating system.

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
        Matrices that do not fit, are not symmetric or not finite.
    ConvergenceError
        A mass that is not positive definite, or poles that share one vector (E-DEFECTIVE).

    Notes
    -----
    State form of the real modes of ``K'`` and ``M`` (L. Meirovitch, Principles and Techniques of Vibrations,
    1997, sections 4.4 and 4.9); the left vectors are the rows of the inverse of the right ones, so that both
    are biorthonormal within multiple poles as well.
    """
    from scipy import linalg

    square, real, rigid = _real_modes(system, mesh_stiffness)
    damping = real.T @ damping_matrix(system, speed) @ real
    m, elastic = int(np.count_nonzero(~rigid)), ~rigid
    order = np.concatenate([np.flatnonzero(elastic), np.flatnonzero(rigid)])
    # speeds scaled by a mean frequency keep the state matrix balanced
    scale = np.exp(0.5 * np.mean(np.log(np.abs(square[elastic])))) if m else 1.0
    state = np.zeros((m + len(square),) * 2)
    state[:m, m : 2 * m] = scale * np.eye(m)
    state[m : 2 * m, :m] = -np.diag(square[elastic]) / scale
    state[m:, m:] = -damping[np.ix_(order, order)]
    value, vector = linalg.eig(state)
    inverse = _inverse(vector)
    zero = max(_ZERO * np.abs(value).max(), 100.0 * np.finfo(float).eps * np.linalg.norm(state))
    value = np.where(np.abs(value) <= zero, 0.0, value)
    value = np.where(np.abs(value.imag) <= _ZERO * np.abs(value), value.real, value)
    kept = np.flatnonzero(value.imag >= 0.0)
    kept = kept[np.argsort(np.abs(value[kept]), kind="stable")]
    modes = ComplexModes(
        eigenvalue=value[kept], shape=real[:, elastic] @ vector[:m, kept],
        drift=real[:, rigid] @ vector[2 * m :, kept] * scale,
        left=(inverse[kept, m:] @ real[:, order].T).conj().T / scale,
        paired=value[kept].imag > 0.0, speed=float(speed), dofs=system.dofs,
    )  # fmt: skip
    return _normalised(modes, system.M)


def damping_matrix(system: MechanicalSystem, speed: float = 0.0) -> np.ndarray:
    """``C + speed G`` (n, n).

    Raises
    ------
    CaseError
        A speed that is not finite (E-SPEED), a gyroscopic matrix that is not skew-symmetric (E-SYMMETRY).
    """
    if not np.isfinite(speed):
        raise CaseError("the speed is not finite", code="E-SPEED", value=speed)
    if system.gyroscopic is None or not speed:
        return np.asarray(system.C)
    G = system.gyroscopic
    if G.shape != system.M.shape or np.abs(G + G.T).max() > 1e-9 * np.abs(G).max(initial=0.0):
        raise CaseError(
            "the gyroscopic matrix is not skew-symmetric", code="E-SYMMETRY", key="gyroscopic",
            remedy="put damping into C and springs into K",
        )  # fmt: skip
    return system.C + speed * G


def whirl(shape, mass, planes) -> np.ndarray:
    """Sense of the orbits of every mode, from -1 (backward) over 0 (straight) to 1 (forward).

    An orbit ``Re((X, Y) exp(i omega t))`` covers area at the rate ``-omega Im(conj(X) Y)``, positive for a
    counter-clockwise one; the sum over the planes, weighted with their masses, is divided by its bound (G.
    Genta, Dynamics of Rotating Systems, 2005, section 2.5). In a rotating frame it is the sense seen there.

    Parameters
    ----------
    shape : (n, m) complex array
    mass : (n,) array
        Diagonal of the mass matrix.
    planes : (k, 2) int array
        Rows of x and y, or of radial and tangential, of one body each.

    Returns
    -------
    (m,) array
        Zero where nothing moves in the planes.
    """
    shape, mass, planes = np.asarray(shape), np.asarray(mass, float), np.asarray(planes, int).reshape(-1, 2)
    x, y = shape[planes[:, 0]], shape[planes[:, 1]]
    weight = np.sqrt(mass[planes[:, 0]] * mass[planes[:, 1]])
    area = -2.0 * weight @ (x.conj() * y).imag
    bound = weight @ (np.abs(x) ** 2 + np.abs(y) ** 2)
    total = mass @ np.abs(shape) ** 2
    return np.where(bound > 1e-12 * total, area / np.where(bound > 0.0, bound, 1.0), 0.0)


def _real_modes(system: MechanicalSystem, mesh_stiffness):
    """``omega^2`` of any sign, mass-normalised shapes and which of them are rigid."""
    from scipy import linalg

    stiffness = total_stiffness(replace(system, gyroscopic=None), mesh_stiffness)
    try:
        square, shape = linalg.eigh(stiffness, system.M)
    except linalg.LinAlgError as error:
        raise ConvergenceError(
            "the mass matrix is not positive definite", code="E-MASS",
            remedy="give every degree of freedom some mass or condense it",
        ) from error  # fmt: skip
    limit = max(_RIGID, 10.0 * len(square) * np.finfo(float).eps) * np.abs(square).max()
    return square, shape, np.abs(square) <= limit


def _inverse(vector: np.ndarray) -> np.ndarray:
    size = np.linalg.svd(vector, compute_uv=False)
    if not size[-1] * _DEFECTIVE > size[0]:
        raise ConvergenceError(
            f"two poles share one vector: condition {size[0] / max(size[-1], 1e-300):.1e} of the modes",
            code="E-DEFECTIVE", limit=f"{_DEFECTIVE:.0e}",
            remedy="a mode is critically damped or a speed is critical: change damping or speed a little",
        )  # fmt: skip
    return np.linalg.inv(vector)


def _normalised(modes: ComplexModes, mass: np.ndarray) -> ComplexModes:
    """``x^H M x = 1`` with the phase that makes ``x^T M x`` real, so that real modes come out real."""
    right = modes.right
    size = np.sqrt(np.einsum("ip,ip->p", right.conj(), mass @ right).real)
    square = np.einsum("ip,ip->p", right, mass @ right)
    # circular orbits have x^T M x = 0 and any phase
    phase = np.where(
        np.abs(square) > 1e-9 * size**2, np.sqrt(square / np.abs(np.where(square == 0, 1, square))), 1.0
    )
    factor = 1.0 / (size * phase)
    return replace(
        modes, shape=modes.shape * factor, drift=modes.drift * factor, left=modes.left / factor.conj()
    )  # fmt: skip
