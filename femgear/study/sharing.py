"""Load sharing of thousands of sets that differ by the positions of their planet pins, at one mesh position.

At one position the contact of a planet with sun and ring is a curve, path deflection over path force, as both
meshes of a planet carry the same force F_n. The contact problem gives it at a list of loads. With the linear
compliance C between different planets through their common bodies and supports,

    w_n = c_n(F_n) + (C F)_n + e_n - (G q)_n >= 0,   F_n >= 0,   F_n w_n = 0,   G^T F = load

with separations ``e`` from the pins, and the sun's rotation and free axis motions ``q``: the contact problem
again with one unknown a planet. What is lost is the change of C with the loads, see
`SharingModel.coupling_change`; where all planets carry the same force nothing is lost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import ROUGH_STIFFNESS, assemble_contact, in_windows, mesh_windows
from femgear.contact.solve import solve_contact
from femgear.contact.supports import moving_members
from femgear.errors import CaseError, ContactError
from femgear.gears.deviations import no_deviations
from femgear.gears.kinematics import mesh_normals
from femgear.study.relief import DesignBasis
from femgear.trains.protocol import one_blas_thread

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

_SOFTEST = 1e-10
"""Spring on every motion, over the stiffness of a planet: it holds motions that no loaded planet holds."""
_MOST_SAMPLES = 1_000_000
"""Of one call."""


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
        G: approach of each path per unit rotation of the sun (as an arc) and per unit free motion [1].
    pin : (N, 2) array
        Separation of the path per unit radial and tangential displacement of the planet's axis [1].
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


@one_blas_thread()
def sharing_model(
    basis: DesignBasis,
    *,
    sun_torque: float,
    position: int = 0,
    loads: int = 40,
) -> SharingModel:
    """Compute load-deflection curves of all planets at one position, by contact problems at several loads.

    Parameters
    ----------
    basis : DesignBasis
        Samples add to the pin errors of its deviations.
    sun_torque : float
        [N m]; the curves reach to where one planet carries all of it.
    position : int
        Number of the position among those of the basis.
    loads : int
        Points of a curve.

    Returns
    -------
    SharingModel
        For a negative torque of the mirrored set, with planets and signs of the original.

    Raises
    ------
    CaseError
        E-TORQUE: no torque; E-RANGE: no such position; E-SUPPORT: bearings with clearance.
    ContactError
    """
    solved, order = basis.loaded(sun_torque)
    if not 0 <= position < basis.positions:
        last = basis.positions - 1
        raise CaseError("no such position", code="E-RANGE", value=position, limit=f"0 to {last}")
    N, load = solved.gears.n_planets, abs(sun_torque) / solved.gears.sun.base_radius
    # planets open and close at small loads, where a line contact changes most
    force = load * np.unique(np.append(np.linspace(0.0, 1.0, loads - 8) ** 1.5, [1 / N, 1e-4, 1e-3, 3e-3]))
    at = (-position if sun_torque < 0 else position) / basis.positions
    deflection, coupling = np.zeros((N, len(force))), np.zeros((len(force), N, N))
    for k, one in enumerate(force):
        deflection[:, k], coupling[k] = _paths(solved, max(one, 1e-9 * load), at)
    mean = int(np.abs(force - load / N).argmin())
    between = coupling[mean]
    change = np.abs(coupling[1:] - between).max() / (deflection[:, mean] / force[mean]).min()
    deflection -= np.outer(between.sum(axis=1), force)
    members = moving_members(solved.gears, solved.supports)
    path = members.approach[:N] + members.approach[N:]
    sprung, free = path[:, ~members.free], path[:, members.free]
    between = between + (sprung / members.stiffness[~members.free]) @ sprung.T
    back, mirror = np.argsort(order), np.array([1.0, -1.0 if sun_torque < 0 else 1.0])
    return SharingModel(
        load=load,
        force=force,
        deflection=deflection[back],
        coupling=between[np.ix_(back, back)],
        approach=np.column_stack([np.ones(N), free])[back],
        pin=(_pin_directions(solved.gears) * mirror)[back],
        coupling_change=float(change),
    )


def _paths(solved: DesignBasis, force: float, position: float):
    """Path deflections (N,) and compliance between planets (N, N) with the same force in all meshes."""
    gears, bodies, N = solved.gears, solved.bodies, solved.gears.n_planets
    place = {"positions": np.array([position]), "contact": solved.contact, "deviations": solved.deviations}

    def attempt(share: float, nearest: float):
        setup = mesh_windows(gears, bodies, share=share, cells=36, nearest=nearest, **place)
        # the record of the windows begins at the position
        problem = assemble_contact(setup, bodies, 0)
        mesh = problem.mesh[:, None] == np.arange(2 * N)
        state = solve_contact(problem.H, problem.gap, mesh.astype(float), np.full(2 * N, force))
        overflow = problem.touches_window_end(state.active, setup)
        missed = solved.contact == "profile" and setup.missed([0], state.motions[:, None]).any()
        wider = share * (4.0 if overflow else 1.0), nearest * (2.0 if missed else 1.0)
        return (problem, mesh, state), *wider

    first = 3.0 * force / (ROUGH_STIFFNESS * bodies.face_width)
    problem, mesh, state = in_windows(attempt, force, first)
    loads = mesh * state.loads[:, None]
    compliance = loads.T @ problem.H @ loads / force**2
    between = compliance.reshape(2, N, 2, N).sum(axis=(0, 2))
    np.fill_diagonal(between, 0.0)
    return state.motions[:N] + state.motions[N:], between


def _pin_directions(planetary_set: PlanetarySet) -> np.ndarray:
    """Separation of every path per unit radial and tangential displacement of its pin, (N, 2).

    ``(n_sp - n_pr) . u`` with the normals of `gears.kinematics.mesh_normals`.
    """
    s, N = planetary_set, planetary_set.n_planets
    normals = mesh_normals(s)
    psi = np.asarray(s.planet_angles)
    radial = np.stack([np.cos(psi), np.sin(psi)], axis=1)
    tangential = np.stack([-np.sin(psi), np.cos(psi)], axis=1)
    along = normals[:N] - normals[N:]
    return np.stack([(along * radial).sum(axis=1), (along * tangential).sum(axis=1)], axis=1)


def pin_samples(n_planets: int, *, samples: int, radial: float, tangential: float, seed: int) -> np.ndarray:
    """Draw normally distributed, independent pin errors (S, N, 2): radial and tangential [m].

    Parameters
    ----------
    n_planets, samples, seed : int
        The same seed of NumPy's default generator gives the same samples.
    radial, tangential : float
        Standard deviations [m].

    Raises
    ------
    CaseError
        E-RANGE: no samples or more than a million, negative deviations.
    """
    if not 1 <= samples <= _MOST_SAMPLES:
        raise CaseError(
            "the number of samples is not usable",
            code="E-RANGE",
            value=samples,
            limit=f"1 to {_MOST_SAMPLES}",
        )
    scale = np.array([radial, tangential], float)
    if not (np.isfinite(scale).all() and (scale >= 0).all()):
        raise CaseError("a standard deviation is negative", code="E-RANGE", value=scale, limit="0 m or more")
    return np.random.default_rng(seed).standard_normal((samples, n_planets, 2)) * scale


@dataclass(frozen=True, eq=False)
class Sharing:
    """Load sharing of all samples.

    Parameters
    ----------
    share : (S, N) array
        Shares in the sun's torque.
    residual : float
        Largest violation: separation of loaded planets over the largest deflection, imbalance and overlap
        likewise.
    """

    share: np.ndarray
    residual: float

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
    """Compute the load sharing for many sets of pin errors at once.

    Newton's method on all samples together; a planet whose force turns negative opens, one that would
    overlap closes. Samples that have not settled go to `contact.solve.solve_contact` one by one.

    Parameters
    ----------
    pins : (S, N, 2) array
        Radial (outwards) and tangential (counter-clockwise) displacements of the planet axes [m].
    max_steps : int
        Of Newton's method.

    Raises
    ------
    CaseError
        E-RANGE: pin errors of another shape, or not finite.
    ContactError
        E-CONTACT
    """
    pins = np.asarray(pins, float)
    N, m = model.approach.shape
    if pins.ndim != 3 or pins.shape[1:] != (N, 2) or not np.isfinite(pins).all():
        raise CaseError(
            f"pin errors of shape {pins.shape} or not finite", code="E-RANGE", limit=f"(samples, {N}, 2)"
        )
    separation = (pins * model.pin).sum(axis=2)
    curves, forces = _monotone_curves(model), np.full((len(pins), N), model.load / N)
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
            code="E-CONTACT",
            limit="1e-6",
        )
    return Sharing(forces / model.load, residual)


def _monotone_curves(model: SharingModel) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Deflections (S, N) and their slopes at forces (S, N): piecewise cubics, straight beyond their ends."""
    from scipy.interpolate import PchipInterpolator

    if not np.all(np.diff(model.deflection, axis=1) > 0):
        raise ContactError(
            "the deflection of a planet falls with its load", code="E-CONTACT-COMPLIANCE",
            remedy="refine the grid: more static.flank_elements",
        )  # fmt: skip
    values = [PchipInterpolator(model.force, row) for row in model.deflection]
    slopes = [one.derivative() for one in values]

    def at(forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        inside = np.clip(forces, 0.0, model.force[-1])
        value, slope = (
            np.stack([one(inside[:, n]) for n, one in enumerate(curves)], axis=1)
            for curves in (values, slopes)
        )
        return value + slope * (forces - inside), slope

    return at


def _newton(model, curves, separation, forces, active):
    """One step of all samples: forces, motions, and the planets that then carry."""
    S, N = forces.shape
    G, m = model.approach, model.approach.shape[1]
    unit = float(model.deflection[:, -1].mean() / model.load)
    value, slope = curves(forces)
    matrix = np.zeros((S, N + m, N + m))
    matrix[:, :N, :N] = model.coupling / unit
    matrix[:, np.arange(N), np.arange(N)] += slope / unit
    matrix[:, :N, N:] = -G
    matrix[:, N:, :N] = G.T
    matrix[:, np.arange(N, N + m), np.arange(N, N + m)] = _SOFTEST
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
        value, slope = curves(forces)
        gap = (value - slope * forces)[0] + separation
        state = solve_contact(model.coupling + np.diag(slope[0]), gap, model.approach, load)
        change = np.abs(state.loads - forces[0]).max()
        forces = forces + (state.loads - forces) * (1.0 if step < 30 else 0.5)
        if change < 1e-10 * model.load:
            return state.loads, state.motions
    remedy = "raise operation.torque, or reduce the errors"
    raise ContactError("the load sharing of a sample does not settle", code="E-CONTACT", remedy=remedy)


def _residual(model, curves, separation, forces, motions) -> float:
    """Largest violation of contact and equilibrium over all samples."""
    value, _ = curves(forces)
    gap = value + forces @ model.coupling + separation - motions @ model.approach.T
    gap = np.where(forces > 0, np.abs(gap), np.maximum(-gap, 0.0)).max() / model.deflection[:, -1].max()
    load = np.zeros(model.approach.shape[1])
    load[0] = model.load
    balance = np.abs(forces @ model.approach - load).max() / model.load
    return float(max(gap, balance))


@one_blas_thread()
def walked_shares(basis: DesignBasis, pins, *, sun_torque: float, position: int = 0) -> np.ndarray:
    """Compute shares (S, N) of a few samples by the whole contact problem, to check `sharing_of_samples`.

    Arguments as for `sharing_model`, with the pin errors ``pins`` (S, N, 2) [m].
    """
    base = no_deviations(basis.gears) if basis.deviations is None else basis.deviations
    shares = []
    for errors in np.asarray(pins, float):
        moved = replace(base, pin_errors=base.pin_errors + errors)
        cycle = replace(basis, deviations=moved).walk(sun_torque)
        shares.append(cycle.load_share[:, position])
    return np.array(shares)
