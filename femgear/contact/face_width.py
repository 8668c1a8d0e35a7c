"""Contact over the face width: what slices of the width change in the plane contact at some positions.

Leads, misalignments and tilts of the members part the flanks by different amounts along the width; the
tooth pairs of the plane solution become the springs of `femgear.contact.slices`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.contact.assembly import Candidates
from femgear.contact.batch import BatchState
from femgear.contact.bodies import Bodies
from femgear.contact.pair_laws import PairLaws, pair_laws
from femgear.contact.slices import SliceState, solve_slices
from femgear.contact.supports import MovingMembers, TiltingMembers
from femgear.contact.width_waves import WidthWaves
from femgear.errors import LESS_TORQUE, ContactError
from femgear.gears.deviations import SetDeviations, lead_separation

_FORCES, _LEAST, _MOST = 32, 1e-4, 4.0
"""Of the curves of tooth pairs: their number, and the shares of the torque at which they begin and end."""
_EVEN = (
    *("deflection", "sun_arc", "force", "stiffness", "member_motion", "held_stiffness"),
    *("friction_force", "friction_moment"),
)
"""What all slices of helical teeth have in common, and forces and stiffnesses that are sums over them."""
_OF_PAIRS = ("tooth_load", "slice_load")
"""Loads of tooth pairs, whose sum is the force of their mesh."""


@dataclass(frozen=True)
class FaceWidth:
    """What the contact in slices takes besides the plane contact.

    Parameters
    ----------
    waves : WidthWaves
        Of the bodies.
    slices : int
        Their number.
    tilting : TiltingMembers, optional
        Tilts and wind-up of members, which approach the flanks by a different amount in every slice.
    held : Bodies and WidthWaves, optional
        Other bodies with the same flanks, for whose tangents the contact is taken too.
    helical : bool
        Whether every slice is at a position of its own, or has flanks of its own there.
    """

    waves: WidthWaves
    slices: int
    tilting: TiltingMembers | None = None
    held: tuple[Bodies, WidthWaves] | None = None
    helical: bool = False


def contact_over_width(
    over: FaceWidth,
    candidates: Candidates,
    state: BatchState,
    load,
    plane: dict[str, object],
    members: MovingMembers,
    deviations: SetDeviations | None,
) -> dict[str, Any]:
    """Solve the contact in slices at some positions: what they change, by the names of `MeshCycle`.

    Parameters
    ----------
    candidates, state : Candidates, BatchState
        The plane contact at all positions, or, of helical teeth, in all slices at each of them.
    load : (m,) array
        External load on the motions [N].
    plane : dict
        What the plane contact has by these names; empty of helical teeth.
    members, deviations : MovingMembers, SetDeviations or None
        Of the whole set, and of the planets that are solved.

    Returns
    -------
    dict
        With ``pair_approach`` (meshes, rows, pairs) of all listed pairs in the slice that comes nearest [m],
        ``pair_force`` (rows, W) of the windows [N], and ``overflow``, whether a contact leaves its window.
    """
    W, driver, turns = len(candidates.mesh), candidates.setup.driver, candidates.setup.gears.rotation_approach
    S, rows, places = over.slices, len(candidates.position), candidates.setup.places
    P = rows // S if over.helical else rows
    lead, apart, every = lead_separations(candidates, deviations, S, P)
    laws, sliced = _solve(over, candidates, state, load, apart)
    force, sprung = sliced.of_meshes().mean(axis=1).T, ~members.free
    motion = np.zeros((len(members.names), P))
    motion[members.free] = sliced.motions.T[driver + 1 : len(load)] if candidates.setup.images == 1 else 0.0
    angles, turned, twisted = _by_tilts(over.tilting, sliced, sliced.motions.T[len(load) :])
    pulled = members.approach[:, sprung].T @ force[places[0]]
    if candidates.friction is not None:
        rubbing = np.repeat(candidates.friction.factor.reshape(P, -1, W), S // (rows // P), axis=1) * sliced.force
        of_meshes = replace(sliced, force=rubbing).of_meshes().mean(axis=1).T
        pulled = pulled + members.sliding[:, sprung].T @ of_meshes[places[0]]
    motion[sprung] = -pulled / members.stiffness[sprung, None]
    base = turns @ sliced.motions.T[: driver + 1] + members.approach[places[1] == 0] @ motion
    # of the least-squares lines through the slices, from one end of the width to the other
    place = 2.0 * (np.arange(S) + 0.5) / S - 1.0
    rise = 2.0 * np.einsum("s,msp->mp", place, twisted - lead[..., None]) / (place @ place)
    values = _of_pairs(candidates, state, laws, sliced) | {
        "deflection": base + turned.mean(axis=1),
        "sun_arc": sliced.motions[:, driver],
        "force": force,
        "member_motion": motion,
        "mesh_misalignment": rise,
        "lead_offset": _smallest(apart, candidates.candidate.any(axis=-1).reshape(P, -1, W), len(force)),
        "member_tilt": angles,
    }
    # the slice that comes nearest decides which pairs may touch; a row of helical teeth is a slice
    closer = np.repeat(np.moveaxis(twisted, 1, -1), rows // P, axis=1)[:, :, None] - every
    if over.helical:
        closer = closer[:, np.arange(rows), :, np.arange(rows) % S].swapaxes(0, 1)[..., None]
    values["pair_approach"] = np.repeat(base, rows // P, axis=1)[..., None] + closer.max(axis=-1)
    values["pair_force"] = sliced.force.reshape(rows, -1, W).mean(axis=1)
    for name, tangent in zip(("stiffness", "held_stiffness"), sliced.tangents, strict=False):
        # tangents of the springs change; what they begin at is that of the cells
        values[name] = plane.get(name, 0.0) + tangent.T
    if over.held is not None:
        values["held_tangents"] = plane.get("held_tangents", 0.0) + sliced.joint
    return values


def _smallest(apart: np.ndarray, near: np.ndarray, meshes: int) -> np.ndarray:
    """Smallest separation (meshes, P) of slices (P, S, W) in windows that may touch; zero where none."""
    smallest = np.where(near, apart, np.inf).reshape(len(apart), -1, meshes, apart.shape[2] // meshes)
    smallest = smallest.min(axis=(1, 3)).T
    return np.where(np.isfinite(smallest), smallest, 0.0)


def _solve(
    over: FaceWidth, candidates: Candidates, state: BatchState, load, apart: np.ndarray
) -> tuple[PairLaws, SliceState]:
    """Solve the slices that separations part (P, S, W) [m], with curves of pairs as far as their forces."""
    driven, held = load[candidates.setup.driver], None
    if over.held is not None:
        held = candidates.images_of(over.held[0]), over.held[1]
    whole = candidates.setup.images * driven
    curves = curve_forces(driven, candidates.setup.n_planets, whole)
    laws = pair_laws(candidates, state, curves)
    sliced = solve_slices(candidates, laws, load, over.waves, apart, held, over.tilting)
    if sliced.force.max() > curves[-1]:
        # by equilibrium no slice carries more than all of them
        step = np.log(curves[1] / curves[0])
        curves = np.exp(np.arange(np.log(curves[0]), np.log(over.slices * whole) + step, step))
        laws = pair_laws(candidates, state, curves)
        sliced = solve_slices(candidates, laws, load, over.waves, apart, held, over.tilting)
    return laws, sliced


def curve_forces(load: float, n_planets: int, whole: float) -> np.ndarray:
    """Choose forces (K,) of the curves of tooth pairs [N], by the load on planets and on the whole set."""
    return np.geomspace(_LEAST * load / n_planets, _MOST * whole, _FORCES)


def _by_tilts(tilting: TiltingMembers | None, sliced: SliceState, tilts: np.ndarray) -> tuple:
    """Angles (k, P) [rad], and approach of the meshes in all slices by tilts alone, and with twists [m].

    Approaches are (meshes, S, P), ``tilts`` the motions of `TiltingMembers` (k, P) [m].
    """
    force = sliced.of_meshes()
    if tilting is None:
        return tilts, *np.zeros((2, *force.T.shape))
    turned = tilting.approach @ tilts
    twisted = turned - np.einsum("vswt,ptw->vsp", tilting.coupling, force)
    return tilting.angle[:, None] * tilts, turned, twisted


def _of_pairs(candidates: Candidates, state: BatchState, laws: PairLaws, sliced: SliceState) -> dict[str, Any]:
    """Loads and pressures of tooth pairs in slices, by the names of `MeshCycle`."""
    (P, S, W), rows, width = sliced.force.shape, len(candidates.position), candidates.bodies.widths[0]
    contact, spur = sliced.contact_width(candidates, laws), P == rows
    _check_lines(sliced.force if spur else None, contact, width, S)
    # pressures are those of the laws, which fall between their forces beside the plane state
    pressure, before = candidates.equal_cell_pressure(state.loads).max(axis=2), state.loads.sum(axis=-1)
    by_law = laws.pressure_under(before)
    right = np.divide(pressure, by_law, out=np.ones(by_law.shape), where=by_law > 0)
    right *= candidates.bodies.normal_pressure(candidates.setup.kind(candidates.mesh))
    at_edge, of_rows = sliced.reaches_ends(candidates, laws), sliced.force.reshape(rows, -1, W)

    def pressed(force):
        return np.where(at_edge, 0.0, right * laws.pressure_under(force))

    def over_width(values):
        """Springs (rows, slices of each, W) stand for all slices of spur teeth, for one of helical."""
        by_pair = candidates.by_pairs(np.moveaxis(values, 1, 2))
        by_pair = by_pair.reshape(*by_pair.shape[:3], P, -1).swapaxes(3, 4)
        return by_pair.reshape(*by_pair.shape[:2], S, P)

    inner = candidates.by_pairs(pressed(sliced.largest() if spur else sliced.of_laws(laws))).max(axis=1)
    slice_load = over_width(of_rows)
    return {
        "tooth_load": slice_load.mean(axis=2),
        "slice_load": slice_load,
        "slice_pressure": over_width(pressed(of_rows.swapaxes(0, 1)).swapaxes(0, 1)),
        "max_pressure": inner.reshape(len(inner), P, -1).max(axis=-1),
        "edge_contact": candidates.by_pairs(at_edge).any(axis=1).reshape(len(inner), P, -1).any(axis=-1),
        "residual": np.maximum(state.residual.reshape(P, -1).max(axis=1), sliced.residual),
        "iterations": state.iterations.reshape(P, -1).sum(axis=1) + sliced.iterations,
        "overflow": sliced.overflows(candidates, laws),
    }


def lead_separations(
    candidates: Candidates, d: SetDeviations | None, S: int, P: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute separations by leads and misalignments [m].

    Of meshes (2N, S), of windows (P, S, W), and of all listed pairs in all slices (2N, rows, pairs, S), which
    may be the same for all rows and pairs.
    """
    rows, mesh, lead = (
        np.arange(len(candidates.position))[:, None],
        candidates.mesh,
        np.zeros((candidates.setup.meshes, S)),
    )
    if d is not None:
        lead = lead_separation(d, candidates.setup.gears, S)
    apart, every = np.broadcast_to(lead[mesh].T, (P, S, len(mesh))), lead[:, None, None]
    forms = () if d is None else (d.sun, d.planet_sun_side, d.planet_ring_side, d.ring)
    if d is not None and any(modification.varies_along_profile for form in forms for modification in form.lead):
        # a twist by the places of the pairs on the flanks, of helical teeth a row a slice
        listed = candidates.setup.listed
        every = lead_separation(d, candidates.setup.gears, S, listed.roll[:, : len(lead), candidates.position])
        of_windows = every[mesh, rows, candidates.pair + listed.first[mesh]]
        helical = len(rows) != P
        apart = of_windows[rows[:, 0], :, rows[:, 0] % S] if helical else of_windows.swapaxes(1, 2)
        apart = apart.reshape(P, S, len(mesh))
    return lead, apart, every


def slices_ahead(overlap: float, slices: int) -> np.ndarray:
    """Find by how much slices (S,) run ahead of mid-width at an overlap ratio [periods], positive where +z comes first.

    Of so many slices of helical teeth.
    """
    return overlap * ((np.arange(slices) + 0.5) / slices - 0.5)


def over_slices(record, ahead: np.ndarray, *, periods: int = 1) -> dict[str, np.ndarray]:
    """Compute what a record of helical teeth has where every slice stands for the places around its middle.

    Slices at single places come into contact one after the other, with a frequency of their own, which is
    none of the teeth: the mean over the mesh periods from one to the next takes it out. The record, with
    names of `MeshCycle`, is at equidistant positions of whole mesh periods; ``ahead`` (slices,) is that of
    its slices [mesh periods]. Tooth pairs share the mean force of their mesh as they did that of the place:
    they stay in equilibrium with it.
    """
    averaged = {}
    for name in _EVEN:
        values = getattr(record, name, None)
        if values is not None:
            averaged[name] = _mean_of_steps(values, ahead, periods)
    carried = np.asarray(record.force)
    share = np.divide(averaged["force"], carried, out=np.ones(carried.shape), where=carried > 0.0)
    for name in (name for name in _OF_PAIRS if getattr(record, name, None) is not None):
        values = getattr(record, name)
        averaged[name] = values * share.reshape(len(share), *np.ones(values.ndim - 2, int), -1)
    return averaged


def ripple_doubt(record: Any, ahead: np.ndarray, *, periods: int = 1) -> float:
    """Find by what share of its peak to peak half of the positions change the mesh stiffness of helical teeth.

    Where slices come into contact one after the other the stiffness jumps, and the error of equidistant positions goes
    down as their distance: what half of them change is about as large as what all of them still miss. Of a record and
    ``ahead`` (slices,) as for `over_slices`, by whose means the curves of all positions and of every other one differ
    at the same places. Peaks to peaks alone may agree by chance.
    """
    count, whole = len(record.position), _mean_of_steps(record.stiffness, ahead, periods)
    # of an odd number of positions every other one comes back after two rounds
    rounds, chosen = (2 * periods, [2 * np.arange(count) % count])
    if count % 2 == 0:
        rounds, chosen = periods, [np.arange(first, count, 2) for first in (0, 1)]
    apart = [_mean_of_steps(record.stiffness[:, half], ahead, rounds) - whole[:, half] for half in chosen]
    size = np.maximum(np.ptp(whole, axis=-1), 1e-3 * np.abs(record.stiffness).max(axis=-1, initial=0.0))
    largest = np.max([np.abs(change).max(axis=-1) for change in apart], axis=0)
    return float(np.divide(largest, size, out=np.zeros(len(size)), where=size > 0.0).max(initial=0.0))


def _mean_of_steps(values: np.ndarray, ahead: np.ndarray, periods: int) -> np.ndarray:
    """Average values (..., P) at equidistant positions over the mesh periods from one slice to the next."""
    count, step = values.shape[-1], np.ptp(ahead) / (len(ahead) - 1)
    mean = np.sinc(np.fft.rfftfreq(count, periods / count) * step)
    return np.fft.irfft(mean * np.fft.rfft(values), n=count)


def contacts_are_lines(
    load: np.ndarray, length: np.ndarray, at_end: np.ndarray, contact: np.ndarray, part: float
) -> np.ndarray:
    """Tell whether contacts of spur teeth are lines rather than points, (P, W, ...).

    All arrays are (P, W, ...): ``load`` [N], the ``length`` over the width on which it carries [m], ``at_end``, whether
    this reaches an end of it, and ``contact``, the width along the profile [m]. Slices are ``part`` [m] wide. One or
    two slices amid the width may carry less than their length.
    """
    amid = ~at_end & (length < 2.5 * part) & (load > 0.25 * load.max(axis=(0, 1)))
    return ~((contact > 0.4 * length) | amid)


def _check_lines(force: np.ndarray | None, contact: np.ndarray, width: float, slices: int) -> None:
    """Refuse (E-SLICES) contacts that are wider than slices, or of spur teeth points rather than lines.

    Forces are (P, S, W) [N], widths of the contacts along the profile (P, W) [m].
    """
    thinnest = float(contact.max(initial=0.0))
    if width / slices < thinnest:
        raise ContactError(
            f"contacts of {thinnest * 1e3:.3g} mm along the profile are wider than slices",
            code="E-SLICES",
            key="static.slices",
            value=slices,
            limit=f"at most {int(width / thinnest)}",
            remedy=("use fewer slices", LESS_TORQUE),
        )
    if force is None:
        return
    load, carries = force.mean(axis=1), force > 0.0
    length, at_end = carries.mean(axis=1) * width, carries[:, 0] | carries[:, -1]
    point = ~contacts_are_lines(load, length, at_end, contact, width / slices)
    if point.any():
        raise ContactError(
            f"a tooth pair touches over no more than {length[point].min() * 1e3:.3g} mm of the width and "
            f"{contact[point].max() * 1e3:.3g} mm along the profile: slices hold for lines, not for points",
            code="E-SLICES",
            key="static.slices",
            value=slices,
            limit="contacts over three slices, and longer than five half widths",
            remedy="reduce lead crowning and end relief, or take more slices",
        )
