"""Load sharing of thousands of sets that differ by the positions of their planet pins, at one mesh position.

At one position the contact of a planet with sun and ring is a curve, path deflection over path force, as both
meshes of a planet carry the same force F_n. The contact problem gives it at a list of loads. With the linear
compliance C between different planets through their common bodies and supports,

    w_n = c_n(F_n) + (C F)_n + e_n - (G q)_n >= 0,   F_n >= 0,   F_n w_n = 0,   G^T F = load

with separations ``e`` from the pins, and the sun's rotation and free axis motions ``q``: the contact problem
again with one unknown a planet. What is lost is the change of C with the loads, see
`samples.SharingModel.coupling_change`; where all planets carry the same force nothing is lost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import assemble_contact, mesh_windows
from femgear.contact.mirror_image import mirrored_set
from femgear.contact.mirrored import walk_either_flank
from femgear.contact.solve import solve_contact
from femgear.contact.supports import RIGID, Supports, moving_members
from femgear.design.samples import SharingModel
from femgear.errors import CaseError, ContactError
from femgear.gears.deviations import SetDeviations, mesh_normals, no_deviations
from femgear.gears.mirrored_deviations import mirrored_deviations
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    from femgear.contact.assembly import Bodies
    from femgear.gears import PlanetarySet

MOST_SAMPLES = 1_000_000


def pin_samples(n_planets: int, *, samples: int, radial: float, tangential: float, seed: int) -> np.ndarray:
    """Normally distributed, independent pin errors (S, N, 2): radial and tangential [m].

    Parameters
    ----------
    n_planets, samples : int
    radial, tangential : float
        Standard deviations [m].
    seed : int
        Of NumPy's default generator; the same seed gives the same samples.

    Raises
    ------
    CaseError
        E-RANGE: no samples or more than a million, negative deviations.
    """
    if not 1 <= samples <= MOST_SAMPLES:
        raise CaseError(
            "the number of samples is not usable", code="E-RANGE", value=samples, limit=f"1 to {MOST_SAMPLES}"
        )
    scale = np.array([radial, tangential], float)
    if not (np.isfinite(scale).all() and (scale >= 0).all()):
        raise CaseError("a standard deviation is negative", code="E-RANGE", value=scale, limit="0 m or more")
    return np.random.default_rng(seed).standard_normal((samples, n_planets, 2)) * scale


@one_blas_thread()
def sharing_model(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    sun_torque: float,
    position: int = 0,
    positions: int = 8,
    contact: str = "profile",
    supports: Supports = RIGID,
    deviations: SetDeviations | None = None,
    loads: int = 40,
    progress: Callable[[int, int], None] | None = None,
) -> SharingModel:
    """Load-deflection curves of all planets at one position, from the contact problem at several loads.

    Parameters
    ----------
    planetary_set : PlanetarySet
    bodies : Bodies
    sun_torque : float
        [N m]; the curves reach to where one planet carries all of it.
    position, positions : int
        Number of the position among those of one mesh period.
    contact, supports, deviations
        As for `contact.cycle.walk_mesh_cycle`; samples add to the pin errors of the deviations.
    loads : int
        Points of a curve.
    progress : callable, optional
        Called with (loads done, loads).

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
    if not (np.isfinite(sun_torque) and sun_torque):
        raise CaseError("without torque there is nothing to share", code="E-TORQUE", value=sun_torque)
    if not 0 <= position < positions:
        raise CaseError("no such position", code="E-RANGE", value=position, limit=f"0 to {positions - 1}")
    if supports.planet_clearance:
        raise CaseError(
            "the load sharing of samples knows no clearance of the planet bearings",
            code="E-SUPPORT",
            key="planet.bearing_clearance",
            value=f"{supports.planet_clearance * 1e6:.6g} um",
            limit="0 um",
            remedy='set it to zero, or solve single cases with static.members = "elastic"',
        )
    solved, order = planetary_set, np.arange(planetary_set.n_planets)
    if sun_torque < 0:
        solved, order = mirrored_set(planetary_set)
        if deviations is not None:
            deviations = mirrored_deviations(deviations, planetary_set, solved, order)
        position = -position
    N = solved.n_planets
    load = abs(sun_torque) / solved.sun.base_radius
    # planets open and close at small loads, where a line contact changes most
    force = load * np.unique(np.append(np.linspace(0.0, 1.0, loads - 8) ** 1.5, [1 / N, 1e-4, 1e-3, 3e-3]))
    place = {"positions": np.array([position / positions]), "contact": contact, "deviations": deviations}
    deflection, coupling = np.zeros((N, len(force))), np.zeros((len(force), N, N))
    for k, one in enumerate(force):
        deflection[:, k], coupling[k] = _paths(solved, bodies, max(one, 1e-9 * load), place)
        if progress is not None:
            progress(k + 1, len(force))
    mean = int(np.abs(force - load / N).argmin())
    between = coupling[mean]
    change = np.abs(coupling[1:] - between).max() / (deflection[:, mean] / force[mean]).min()
    deflection -= np.outer(between.sum(axis=1), force)
    return _placed(
        solved, order, load, force, deflection, between, supports, float(change), mirrored=sun_torque < 0
    )


def _placed(s, order, load, force, deflection, between, supports, change, *, mirrored) -> SharingModel:
    """The model with supports and directions, its planets in the original order."""
    N = s.n_planets
    members = moving_members(s, supports)
    path = members.approach[:N] + members.approach[N:]
    sprung, free = path[:, ~members.free], path[:, members.free]
    coupling = between + (sprung / members.stiffness[~members.free]) @ sprung.T
    back = np.argsort(order)
    pin = pin_directions(s)
    return SharingModel(
        load=load,
        force=force,
        deflection=deflection[back],
        coupling=coupling[np.ix_(back, back)],
        approach=np.column_stack([np.ones(N), free])[back],
        pin=(pin * np.array([1.0, -1.0]) if mirrored else pin)[back],
        coupling_change=change,
    )


def pin_directions(planetary_set: PlanetarySet) -> np.ndarray:
    """Separation of every path per unit radial and tangential displacement of its pin, (N, 2).

    ``(n_sp - n_pr) . u`` with the normals of `gears.deviations.mesh_normals`.
    """
    s, N = planetary_set, planetary_set.n_planets
    normals = mesh_normals(s)
    psi = np.asarray(s.planet_angles)
    radial = np.stack([np.cos(psi), np.sin(psi)], axis=1)
    tangential = np.stack([-np.sin(psi), np.cos(psi)], axis=1)
    along = normals[:N] - normals[N:]
    return np.stack([(along * radial).sum(axis=1), (along * tangential).sum(axis=1)], axis=1)


def _paths(s: PlanetarySet, bodies: Bodies, force: float, place):
    """Path deflections (N,) and compliance between planets (N, N) with the same force in all meshes."""
    N = s.n_planets
    share, nearest = force, 3.0 * force / (10e9 * bodies.face_width)
    for _ in range(8):
        setup = mesh_windows(
            s,
            bodies,
            share=share,
            cells=36,
            nearest=nearest,
            **place,
        )
        # the record of the windows begins at the position
        problem = assemble_contact(setup, bodies, 0)
        mesh = problem.mesh[:, None] == np.arange(2 * N)
        state = solve_contact(problem.H, problem.gap, mesh.astype(float), np.full(2 * N, force))
        overflow = problem.touches_window_end(state.active, setup)
        gap = setup.smallest_gap[:, 0]
        outside = ~setup.near[:, 0] & (gap < state.motions[:, None])
        outside = outside.any() and place["contact"] == "profile"
        if not overflow and not outside:
            break
        share *= 4.0 if overflow else 1.0
        nearest *= 2.0 if outside else 1.0
    else:
        raise ContactError(
            "the contact windows do not contain the contact after seven enlargements",
            code="E-CONTACT-WINDOW",
            remedy="reduce operation.torque or the errors",
        )
    loads = mesh * state.loads[:, None]
    compliance = loads.T @ problem.H @ loads / force**2
    between = compliance.reshape(2, N, 2, N).sum(axis=(0, 2))
    np.fill_diagonal(between, 0.0)
    return state.motions[:N] + state.motions[N:], between


@one_blas_thread()
def walked_shares(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    pins,
    *,
    sun_torque: float,
    position: int = 0,
    positions: int = 8,
    contact: str = "profile",
    supports: Supports = RIGID,
    deviations: SetDeviations | None = None,
) -> np.ndarray:
    """Shares (S, N) of a few samples from the whole contact problem, to check `sharing_of_samples`.

    Parameters
    ----------
    pins : (S, N, 2) array
        See there.
    planetary_set, bodies, sun_torque, position, positions, contact, supports, deviations
        As for `sharing_model`.
    """
    base = no_deviations(planetary_set) if deviations is None else deviations
    shares = []
    for errors in np.asarray(pins, float):
        cycle = walk_either_flank(
            planetary_set,
            bodies,
            sun_torque=sun_torque,
            positions=positions,
            contact=contact,
            supports=supports,
            deviations=replace(base, pin_errors=base.pin_errors + errors),
        )
        shares.append(cycle.load_share[:, position])
    return np.array(shares)
