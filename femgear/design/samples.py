"""Load sharing of many samples at once from the load-deflection curves of the planets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.contact.solve import solve_contact
from femgear.errors import CaseError, ContactError
from femgear.threads import one_blas_thread

SOFTEST = 1e-10
"""Spring on every motion, over the stiffness of a planet: it holds motions that no loaded planet holds."""


@dataclass(frozen=True, eq=False)
class SharingModel:
    """Load over deflection of every planet at one position, for `sharing_of_samples`.

    Parameters
    ----------
    load : float
        Sum of the sun-planet mesh forces, sun torque over base radius [N].
    force : (K,) array
        Path forces from 0 to `load` [N].
    deflection : (N, K) array
        ``c_n``: sum of the approaches of both meshes of a planet [m], rising with the force.
    coupling : (N, N) array
        Compliance between planets through gears and sprung members [m/N].
    approach : (N, 1 + m) array
        G: approach of each path per unit rotation of the sun (as an arc) and per unit free motion.
    pin : (N, 2) array
        Separation of the path per unit radial and tangential displacement of the planet's axis.
    coupling_change : float
        Largest change of the coupling through the gears over the loads of `force`, over the compliance of a
        planet's path under the mean load.
    """

    load: float
    force: np.ndarray
    deflection: np.ndarray
    coupling: np.ndarray
    approach: np.ndarray
    pin: np.ndarray
    coupling_change: float = 0.0


@dataclass(frozen=True, eq=False)
class Sharing:
    """Load sharing of all samples.

    Parameters
    ----------
    share : (S, N) array
        Shares in the sun's torque.
    motions : (S, 1 + m) array
        Rotation of the sun as an arc, and free motions [m].
    residual : float
        Largest violation: separation of loaded planets over the largest deflection, imbalance and overlap
        likewise.
    one_by_one : int
        Samples that Newton's method left to the general contact solver.
    """

    share: np.ndarray
    motions: np.ndarray
    residual: float
    one_by_one: int

    @property
    def factor(self) -> np.ndarray:
        """Load sharing factor K_gamma = N max share (mesh load factor of ISO 6336-1), (S,)."""
        return self.share.shape[1] * self.share.max(axis=1)

    @property
    def open_planets(self) -> np.ndarray:
        """Planets without load, (S, N)."""
        return self.share <= 0.0


@one_blas_thread()
def sharing_of_samples(model: SharingModel, pins, *, max_steps: int = 40) -> Sharing:
    """Load sharing for many sets of pin errors at once.

    Newton's method on all samples together; a planet whose force turns negative opens, one that would
    overlap closes. Samples that have not settled go to `contact.solve.solve_contact` one by one.

    Parameters
    ----------
    model : SharingModel
    pins : (S, N, 2) array
        Radial (outwards) and tangential (counter-clockwise) displacements of the planet axes [m].
    max_steps : int
        Of Newton's method.

    Returns
    -------
    Sharing

    Raises
    ------
    CaseError
        E-RANGE: pin errors of another shape, or not finite.
    ContactError
        E-CONTACT-CONVERGENCE
    """
    pins = np.asarray(pins, float)
    N, m = model.approach.shape
    if pins.ndim != 3 or pins.shape[1:] != (N, 2) or not np.isfinite(pins).all():
        raise CaseError(
            f"pin errors of shape {pins.shape} or not finite", code="E-RANGE", limit=f"(samples, {N}, 2)"
        )
    separation = (pins * model.pin).sum(axis=2)
    curves, forces = _Curves.of(model), np.full((len(pins), N), model.load / N)
    motions, active = np.zeros((len(pins), m)), np.ones((len(pins), N), bool)
    left = np.arange(len(pins))
    for _ in range(max_steps):
        if not len(left):
            break
        new, moved, closed = _newton(model, curves, separation[left], forces[left], active[left])
        step = np.abs(new - forces[left]).max(axis=1)
        settled = (step < 1e-11 * model.load) & (closed == active[left]).all(axis=1)
        forces[left], motions[left], active[left] = new, moved, closed
        left = left[~settled]
    for sample in left:
        forces[sample], motions[sample] = _one(model, curves, separation[sample])
    residual = _residual(model, curves, separation, forces, motions)
    if not residual < 1e-6:
        raise ContactError(
            f"load sharing of {len(pins)} samples ends with a residual of {residual:.3g}",
            code="E-CONTACT-CONVERGENCE",
            limit="1e-6",
        )
    return Sharing(forces / model.load, motions, residual, len(left))


@dataclass(frozen=True)
class _Curves:
    """Monotone piecewise cubics through the curves, straight beyond their ends."""

    value: tuple
    slope: tuple
    last: float

    @classmethod
    def of(cls, model: SharingModel) -> _Curves:
        from scipy.interpolate import PchipInterpolator

        if not np.all(np.diff(model.deflection, axis=1) > 0):
            raise ContactError("the deflection of a planet falls with its load", code="E-CONTACT-COMPLIANCE")
        found = [PchipInterpolator(model.force, row) for row in model.deflection]
        return cls(tuple(found), tuple(f.derivative() for f in found), float(model.force[-1]))

    def at(self, forces):
        """Deflections and their slopes at (S, N) forces."""
        inside = np.clip(forces, 0.0, self.last)
        slope = np.stack([f(inside[:, n]) for n, f in enumerate(self.slope)], axis=1)
        value = np.stack([f(inside[:, n]) for n, f in enumerate(self.value)], axis=1)
        return value + slope * (forces - inside), slope


def _newton(model, curves, separation, forces, active):
    """One step of all samples: forces, motions, and the planets that then carry."""
    S, N = forces.shape
    G, m = model.approach, model.approach.shape[1]
    unit = float(model.deflection[:, -1].mean() / model.load)
    value, slope = curves.at(forces)
    matrix = np.zeros((S, N + m, N + m))
    matrix[:, :N, :N] = model.coupling / unit
    matrix[:, np.arange(N), np.arange(N)] += slope / unit
    matrix[:, :N, N:] = -G
    matrix[:, N:, :N] = G.T
    matrix[:, np.arange(N, N + m), np.arange(N, N + m)] = SOFTEST
    right = np.zeros((S, N + m))
    right[:, :N] = (slope * forces - value - separation) / unit
    right[:, N] = model.load
    sample, planet = np.nonzero(~active)
    matrix[sample, planet] = 0.0
    matrix[sample, planet, planet] = 1.0
    right[sample, planet] = 0.0
    found = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    new, motions = found[:, :N], found[:, N:] * unit
    gap = model.deflection[:, 0] + new @ model.coupling + separation - motions @ G.T
    closed = np.where(active, new > 0.0, gap < 0.0)
    return np.where(closed, new, 0.0), motions, closed


def _one(model, curves, separation):
    """Forces and motions of one sample: linear contact problems about the last forces until they settle."""
    N, m = model.approach.shape
    load = np.zeros(m)
    load[0] = model.load
    forces = np.full((1, N), model.load / N)
    for step in range(200):
        value, slope = curves.at(forces)
        gap = (value - slope * forces)[0] + separation
        state = solve_contact(model.coupling + np.diag(slope[0]), gap, model.approach, load)
        change = np.abs(state.loads - forces[0]).max()
        forces = forces + (state.loads - forces) * (1.0 if step < 30 else 0.5)
        if change < 1e-10 * model.load:
            return state.loads, state.motions
    raise ContactError("the load sharing of a sample does not settle", code="E-CONTACT-CONVERGENCE")


def _residual(model, curves, separation, forces, motions) -> float:
    """Largest violation of contact and equilibrium over all samples."""
    value, _ = curves.at(forces)
    gap = value + forces @ model.coupling + separation - motions @ model.approach.T
    gap = np.where(forces > 0, np.abs(gap), np.maximum(-gap, 0.0)).max() / model.deflection[:, -1].max()
    load = np.zeros(model.approach.shape[1])
    load[0] = model.load
    balance = np.abs(forces @ model.approach - load).max() / model.load
    return float(max(gap, balance))
