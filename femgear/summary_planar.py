"""What a planar case is, and the numbers of its run."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from femgear.casefile.planar import output_member
from femgear.summary_block import Block

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case import Case
    from femgear.gears import PlanetarySet

_MANY = 8
# distance of a multiplier from 1 at a limit point beyond which harmonics are missing
_TRUNCATED = 0.2
# share of the energy in the upper half of the lines beyond which it is said, as in the spectral stage
_ENERGY = 1e-6
# smoothing over mean compression that is said: the force is then wrong by (0.05 / 2)^2, 0.06 %
_SMOOTH = 0.05
_STABLE = {1: "yes", 0: "no", -1: "not known"}


def describe_planar(case: Case, planetary: PlanetarySet) -> Block:
    """Mesh stiffness, supports, weight and ranges of a planar case."""
    planar = case.planar
    notes = [_stiffness(case), _play(case, planetary)]
    if planar.carrier_bearing is not None:
        one = planar.carrier_bearing
        notes.append(
            f"bearing between carrier and {one.on}: {one.stiffness:.6g} N/m, radial clearance "
            f"{one.clearance * 1e6:.6g} um"
        )
    held = "torsional supports" if planar.reaction == "supports" else f"the {output_member(case)}"
    notes.append(f"the torque on the {case.operation.input} is taken up by {held}")
    if planar.gravity is not None:
        notes.append(f"weight {planar.gravity.acceleration:.6g} m/s^2; {_sense(case)}")
    notes.append(_smoothing(case, planetary))
    return Block("Planar model", _BODIES, tuple(_bodies(case)), tuple(notes))


_BODIES = ("", "mass [kg]", "inertia [kg m^2]", "support [N/m]", "torsional support [N m/rad]")


def _bodies(case: Case) -> Iterator[tuple[str, ...]]:
    planar = case.planar
    for name, one in (("sun", case.sun), ("ring", planar.ring), ("carrier", case.carrier)):
        given = getattr(planar.torsion, name)
        held = "held" if name == case.operation.fixed else "0"
        torsion = held if given is None else f"{given:.6g}"
        yield name, f"{one.mass:.6g}", f"{one.inertia:.6g}", f"{one.support_stiffness:.6g}", torsion
    planet = case.planet
    bearing = f"{planet.bearing_stiffness:.6g} (bearing)"
    yield "planet", f"{planet.mass:.6g}", f"{planet.inertia:.6g}", bearing, "0"


def _stiffness(case: Case) -> str:
    given = case.planar.mesh_stiffness
    if given is None:
        return "mesh stiffness: of the static solution"
    values = f"sun-planet {given.sun_planet:.6g}, planet-ring {given.planet_ring:.6g} N/m"
    return f"mesh stiffness: {values}, as given"


def _play(case: Case, planetary: PlanetarySet) -> str:
    play = case.planar.line_backlash
    values = (planetary.backlash_sun_planet, planetary.backlash_planet_ring) if play is None else (play,)
    text = " and ".join(dict.fromkeys(f"{max(value, 0.0) * 1e6:.6g}" for value in values))
    own = "on lines of action of their own" if case.planar.back_flanks else "on those of the drive flanks"
    return f"play along the line of action {text} um, back flanks {own}"


def _smoothing(case: Case, planetary: PlanetarySet) -> str:
    """Length over which contact sets in, beside the mean compression where the stiffness is given."""
    from femgear.gears import torques

    given, smoothing = case.planar.mesh_stiffness, case.planar.smoothing
    text = f"contact sets in over {smoothing * 1e6:.6g} um"
    if given is None:
        return text
    torque = torques(planetary, member=case.operation.input, torque=case.operation.torque).sun
    force = abs(torque) / (planetary.n_planets * planetary.sun.base_radius)
    compression = force / max(given.sun_planet, given.planet_ring)
    text += f", {smoothing / compression:.2g} of the mean compression {compression * 1e6:.4g} um"
    if smoothing <= _SMOOTH * compression:
        return text
    return f"[W-SMOOTHING] {text}: lower planar.smoothing where teeth part or wedge"


def _sense(case: Case) -> str:
    """How torque and turning of the carrier belong together."""
    operation = case.operation
    if operation.fixed == "carrier":
        return "the carrier stands"
    # the output works against its turning, unless the torque itself brakes
    driven = (operation.input == "carrier") == (operation.torque > 0.0)
    return f"the torque on the carrier acts {'with' if driven else 'against'} its turning"


def describe_branch(data: xr.Dataset) -> Block:
    """Table of branch.nc: ends, folds and the largest responses."""
    from femgear.models.planar_response import merged_folds

    hertz, rms = data["weight_frequency"].values, data["rms"].values
    known = data.attrs["stability"] != "not computed"
    stable = data["stable"].values
    chosen = {0: "start", len(hertz) - 1: "end"}
    chosen |= {int(point): "fold" for point in merged_folds(hertz, data["fold"].values)}
    chosen[int(np.argmax(rms[:, 0, 0]))] = "largest carrier x"
    chosen[int(np.argmax(rms[:, 1, 0]))] = "largest ring x"
    rows = []
    for point in sorted(chosen):
        back = float(data["back_contact"].values[point].max())
        rows.append(
            (
                f"{hertz[point]:.4f}",
                chosen[point],
                *(f"{1e6 * rms[point, member, 0]:.3f}" for member in range(3)),
                f"{back:.3f}",
                _STABLE[int(stable[point])] if known else "-",
            )
        )
    header = (
        "weight [Hz]", "", "carrier x rms [um]", "ring x rms [um]", "sun x rms [um]", "back contact",
        "stable",
    )  # fmt: skip
    notes = [
        f"{len(hertz)} points; {data.attrs['message']!s}",
        "back contact: largest share of the cycle in which back flanks touch",
    ]
    notes += _verdicts(data) if known else ["stability was not computed"]
    notes += _truncation(data) if known else []
    notes += [_tails(data), *tail_warnings(data, "planar.branch.harmonics")]
    return Block("Response to the weight", header, tuple(rows), tuple(notes))


def _tails(data: xr.Dataset) -> str:
    tail, force = (float(data[name].max()) for name in ("tail", "force_tail"))
    return (
        f"tail, share of the amplitude in the upper half of the lines: up to {tail:.2g} of the deflections, "
        f"{force:.2g} of the mesh forces"
    )


def tail_warnings(data: xr.Dataset, key: str) -> tuple[str, ...]:
    """What truncation of the lines does to branch.nc or response.nc, in sentences.

    Parameters
    ----------
    data : xarray.Dataset
    key : str
        Entry of the case file to raise.
    """
    from femgear.models.planar_response import TAIL_LIMIT

    tail, force = data["tail"].values, data["force_tail"].values
    worst = np.maximum(tail, force)
    if (wrong := worst > TAIL_LIMIT).any():
        return (
            f"[W-TAIL] {_where(data, wrong)}: {worst.max():.2g} of the amplitude lies in the upper half of "
            f"the lines ({tail.max():.2g} of the deflections, {force.max():.2g} of the mesh forces): forces "
            f"and contact shares of this response are not to be trusted, raise {key}",
        )
    if (cut := worst**2 > _ENERGY).any():
        return (
            f"{_where(data, cut)}: {worst.max() ** 2:.2g} of the energy of deflections or mesh forces lies "
            f"in the upper half of the lines; {key} says how many there are",
        )
    return ()


def _where(data: xr.Dataset, bad: np.ndarray) -> str:
    """Points or speeds, in words."""
    if "weight_frequency" in data:
        hertz = data["weight_frequency"].values[bad]
        return f"{len(hertz)} of {len(bad)} points, {hertz.min():.4g} to {hertz.max():.4g} Hz"
    listed = ", ".join(f"{value:.6g}" for value in data["speed"].values[bad][:_MANY])
    return f"{np.count_nonzero(bad)} of {len(bad)} speeds, {listed} rpm"


def planar_verdicts(branch: xr.Dataset | None, response: xr.Dataset | None) -> Iterator[str]:
    """What speaks against results of a planar case, for the head of the report."""
    if branch is not None:
        if not bool(branch.attrs["complete"]):
            yield f"the branch of the response to the weight: {branch.attrs['message']!s}"
        yield from tail_warnings(branch, "planar.branch.harmonics")
    if response is not None:
        yield from tail_warnings(response, response_key(response))


def response_key(data: xr.Dataset) -> str:
    """Entries of the case file that hold the lines of response.nc."""
    if not data.attrs["mesh_lines"]:
        return "planar.response.carrier_harmonics"
    return "planar.response.carrier_harmonics, side_bands or dynamics.response_harmonics"


def _truncation(data: xr.Dataset) -> Iterator[str]:
    """Limit points that are none of the motion itself: there one multiplier would be 1."""
    from femgear.models.planar_response import merged_folds

    hertz, distance = data["weight_frequency"].values, data["multiplier_distance"].values
    for point in merged_folds(hertz, data["fold"].values):
        if distance[point] > _TRUNCATED:
            yield (
                f"at the fold at {hertz[point]:.3f} Hz the nearest multiplier lies {distance[point]:.2g} "
                "from 1: too few harmonics there, raise planar.branch.harmonics"
            )


def _verdicts(data: xr.Dataset) -> Iterator[str]:
    """Parts of the branch that are not stable, or not known to be, in words."""
    stable, hertz = data["stable"].values, data["weight_frequency"].values
    edges = np.flatnonzero(np.diff(stable, prepend=stable[0] + 5, append=stable[-1] + 5))
    for first, last in pairwise(edges):
        state, what = stable[first], data["stability_note" if stable[first] < 0 else "loss"]
        if state == 1:
            continue
        reasons = ", ".join(dict.fromkeys(str(text) for text in what.values[first:last]))
        span = f"{hertz[first]:.3f} to {hertz[last - 1]:.3f} Hz along the branch"
        yield f"not stable: {span} ({reasons})" if state == 0 else f"not determined: {span} ({reasons})"


def describe_response(data: xr.Dataset) -> Block:
    """Table of response.nc."""
    rows, count = [], data.sizes["speed"]
    force = np.hypot(data["mesh_force_real"].values, data["mesh_force_imag"].values)
    fluctuation = np.sqrt(0.5 * (force[:, :, 1:] ** 2).sum(axis=2)).max(axis=1)
    for i in range(count):
        if count > _MANY and _MANY // 2 <= i < count - _MANY // 2:
            continue
        one = data.isel(speed=i)
        rows.append(
            (
                f"{float(one.speed):.4g}",
                f"{float(one.mesh_frequency):.4f}",
                f"{1e6 * one.rms.values[0, 0]:.4f}",
                f"{1e-3 * fluctuation[i]:.4f}",
                f"{float(one.drive_contact.min()):.3f}",
                f"{float(one.back_contact.max()):.3f}",
                f"{float(one['tail']):.2g}",
                f"{float(one['force_tail']):.2g}",
            )
        )
    header = (
        "speed [rpm]", "mesh [Hz]", "carrier x rms [um]", "mesh force rms [kN]", "drive contact",
        "back contact", "tail", "force tail",
    )  # fmt: skip
    notes = [
        f"{data.sizes['line']} {_kind_of_lines(data)}; mesh force: the largest fluctuation of "
        "all meshes; contact: least share of the time of the drive flanks, largest of the back flanks",
        "the stability of these responses is not computed",
    ]
    hertz = np.sort(np.abs(data["frequency"].values), axis=1)
    if np.any(np.diff(hertz, axis=1) <= 1e-9 * hertz.max()):
        notes.append(
            "some lines have one frequency: planar.response.carrier_harmonics or side_bands reach from the "
            "weight to the mesh frequency; r.m.s. values count such lines apart"
        )
    notes += tail_warnings(data, response_key(data))
    return Block("Weight and mesh frequency", header, tuple(rows), tuple(notes))


def _kind_of_lines(data: xr.Dataset) -> str:
    if data.attrs["mesh_lines"]:
        return "lines of weight and mesh frequency"
    return "lines of the weight alone: a constant mesh stiffness leaves none of the mesh frequency"


def published_modes(case: Case, data: xr.Dataset) -> Block | None:
    """Natural frequencies that the case calls published, beside the nearest mode of the kind."""
    planar = case.planar
    entries = [one for one in planar.published if one.frequency is not None] if planar else []
    if not entries:
        return None
    kinds, found = np.array([str(kind) for kind in data["kind"].values]), data["frequency"].values
    rows = []
    for one in entries:
        same = found[kinds == one.kind]
        near = same[np.argmin(np.abs(same - one.frequency))] if len(same) else np.nan
        difference = f"{100 * (near / one.frequency - 1):+.2f}" if len(same) else "-"
        rows.append(
            (one.kind, f"{one.frequency:.6g}", f"{near:.6g}" if len(same) else "none", difference, one.source)
        )
    header = ("kind", "published [Hz]", "nearest here [Hz]", "difference [%]", "source")
    return Block("Published natural frequencies", header, tuple(rows))
