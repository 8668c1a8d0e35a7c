"""Are the deviations of a set plausible, do they fit its backlash: refusals with numbers, and warnings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.deviations import body_separation, common_period, profile_separation
from femgear.gears.gear import GeometryWarning
from femgear.gears.modifications import (
    LARGEST_DEVIATION,
    FlankForm,
    MeasuredProfile,
    check_form,
    form_deviation,
    modification_range,
)

if TYPE_CHECKING:
    from femgear.gears.deviations import SetDeviations
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet

LONGEST_SEARCH = 4096
"""Mesh periods that are searched for the least play."""
LEAST_COVERAGE = 0.5
"""Part of a flank that a measured profile should cover; beyond its ends it is constant."""


def check_deviations(deviations: SetDeviations, planetary_set: PlanetarySet) -> tuple[GeometryWarning, ...]:
    """Refuse deviations that do not belong to the set, and list what deserves a warning.

    Parameters
    ----------
    deviations : SetDeviations
    planetary_set : PlanetarySet

    Returns
    -------
    tuple of GeometryWarning
        W-WEDGING: the deviations may use up the play, so that both flanks carry. W-PROFILE: a measured
        profile covers less than half of its flank.

    Raises
    ------
    GeometryError
        E-DEVIATION (arrays of another length than the teeth or planets, numbers that are not finite or
        exceed 0.2 modules, modifications of a flank that do so together), E-MODIFICATION (see
        `modifications.check_form`).
    """
    d, s = deviations, planetary_set
    _check_lengths(d, s)
    _check_amounts(d, s.sun.module)
    found: list[GeometryWarning] = []
    for flank, form, gear in (
        ("sun", d.sun, s.sun),
        ("planet, sun side", d.planet_sun_side, s.planet),
        ("planet, ring side", d.planet_ring_side, s.planet),
        ("ring", d.ring, s.ring),
    ):
        check_form(form, gear)
        _check_sum(flank, form, gear)
        found += _short_profiles(flank, form, gear)
    return (*found, *_wedging(d, s))


def least_play(deviations: SetDeviations, planetary_set: PlanetarySet) -> tuple[float, float]:
    """Lower bounds of the play that the deviations leave, along the line of action [m].

    Positions are sampled over the common period; pitch deviations and profiles enter with their extremes, as
    if the worst teeth met.

    Returns
    -------
    single : float
        Of any one mesh, between the flanks of the two gears alone.
    whole : float
        Of the sun against the held ring: the loaded flanks of one planet and the back flanks of another
        stop it.
    """
    d, s = deviations, planetary_set
    N = s.n_planets
    periods, _ = common_period(d, s, limit=LONGEST_SEARCH)
    position = np.arange(4 * periods) / 4.0
    bodies = [body_separation(d, s, position, back=back) for back in (False, True)]
    drive = bodies[0] + _worst(d, s, back=False)[:, None]
    back = bodies[1] + _worst(d, s, back=True)[:, None]
    back = back + np.repeat([s.backlash_sun_planet, s.backlash_planet_ring], N)[:, None]
    single = float((drive + back).min())
    whole = float(((drive[:N] + drive[N:]).min(axis=0) + (back[:N] + back[N:]).min(axis=0)).min())
    return single, whole


def _worst(d: SetDeviations, s: PlanetarySet, *, back: bool) -> np.ndarray:
    """Smallest separation (2N,) of any teeth and any points of the flanks of every mesh."""
    N, side = s.n_planets, -1.0 if back else 1.0
    first, second = d.planet_pitch.min(axis=1), d.planet_ring_side_pitch.min(axis=1)
    sun_side, ring_side = (second, first) if back else (first, second)
    pitch = np.concatenate([(side * d.sun_pitch).min() + sun_side, ring_side + (side * d.ring_pitch).min()])
    profile = [_thickest(d, s, kind, back=back) for kind in (0, 1)]
    return pitch + np.repeat(profile, N)


def _thickest(d: SetDeviations, s: PlanetarySet, kind: int, *, back: bool) -> float:
    gears = (s.sun, s.planet) if kind == 0 else (s.planet, s.ring)
    rolls = [np.linspace(gear.form_roll, gear.tip_roll, 101) for gear in gears]
    return float(profile_separation(d, s, kind, rolls[0][:, None], rolls[1][None, :], back=back).min())


def _short_profiles(flank: str, form: FlankForm, gear: Gear):
    low, high = sorted((gear.form_roll, gear.tip_roll))
    for profile in form.modifications:
        if not isinstance(profile, MeasuredProfile):
            continue
        start, end = profile.roll[0], profile.roll[-1]
        covered = max(min(end, high) - max(start, low), 0.0) / (high - low)
        if covered < LEAST_COVERAGE:
            angles = [math.degrees(roll / gear.base_radius) for roll in (start, end, low, high)]
            yield GeometryWarning(
                "W-PROFILE",
                f"{gear.name}.modifications",
                "{}: a measured profile over roll angles {:.4g} to {:.4g} deg covers {:.0f} % of the flank, "
                "{:.4g} to {:.4g} deg; beyond its ends it is constant".format(
                    flank, *angles[:2], 100 * covered, *angles[2:]
                ),
                covered,
                f"{100 * LEAST_COVERAGE:.0f} % or more",
            )


def _wedging(d: SetDeviations, s: PlanetarySet):
    if d.ideal and not (d.planet_thickness.any() or d.sun_thickness or d.ring_thickness):
        return
    single, whole = least_play(d, s)
    least = min(single, whole)
    if least < -1e-12:
        nominal = min(s.backlash_sun_planet, s.backlash_planet_ring)
        where = "in one mesh" if single <= whole else "between different planets"
        yield GeometryWarning(
            "W-WEDGING",
            "set.backlash",
            f"pin errors and other deviations may exceed the backlash by {-least * 1e6:.3f} um {where} "
            f"(ideal gears have {nominal * 1e6:.3f} um): loaded and back flanks may touch at once",
            least,
            "play of 0 um or more",
        )


def _check_lengths(d: SetDeviations, s: PlanetarySet) -> None:
    N = s.n_planets
    wanted = {
        "sun_pitch": (s.sun.teeth,),
        "planet_pitch": (N, s.planet.teeth),
        "planet_ring_side_pitch": (N, s.planet.teeth),
        "ring_pitch": (s.ring.teeth,),
        "pin_errors": (N, 2),
        "planet_thickness": (N,),
    }
    for name, shape in wanted.items():
        if getattr(d, name).shape != shape:
            _refuse(f"{name} has the shape {getattr(d, name).shape}", name, str(shape))
    if len(d.planet_runout) != N:
        _refuse(f"{len(d.planet_runout)} runouts for {N} planets", "planet_runout", f"{N} runouts")
    n = d.ovality.nodal_diameter
    if n < 1 or n != int(n):
        _refuse(f"an ovality with {n} nodal diameters", "ovality", "1, 2, 3, ...")


def _check_amounts(d: SetDeviations, module: float) -> None:
    most = LARGEST_DEVIATION * module
    runouts = (d.sun_runout, d.ring_runout, d.carrier_runout, *d.planet_runout, d.ovality)
    phases = [runout.phase for runout in runouts]
    if not all(map(math.isfinite, phases)):
        _refuse("a phase of a runout or an ovality is not finite", "phase", "finite")
    amounts = {
        "sun_pitch": d.sun_pitch,
        "planet_pitch": d.planet_pitch,
        "planet_ring_side_pitch": d.planet_ring_side_pitch,
        "ring_pitch": d.ring_pitch,
        "pin_errors": d.pin_errors,
        "thickness": np.array([d.sun_thickness, d.ring_thickness, *d.planet_thickness]),
        "runout": np.array([runout.amplitude for runout in runouts]),
    }
    for name, values in amounts.items():
        largest = np.abs(values).max(initial=0.0)
        if not largest <= most:
            limit = f"at most {LARGEST_DEVIATION} modules, {most * 1e6:.1f} um"
            _refuse(f"{name} of {largest * 1e6:.6g} um is not plausible", name, limit)


def _check_sum(flank: str, form: FlankForm, gear: Gear) -> None:
    """Refuse modifications, each of them plausible, that together are not."""
    most = LARGEST_DEVIATION * gear.module
    rolls = [np.linspace(gear.form_roll, gear.tip_roll, 1001)]
    # laws are monotonic or parabolas between their ends, profiles straight between their points
    rolls += [
        m.roll if isinstance(m, MeasuredProfile) else modification_range(m, gear) for m in form.modifications
    ]
    roll = np.concatenate(rolls)
    removed = form_deviation(form, gear, roll)
    i = int(np.abs(removed).argmax())
    if abs(removed[i]) <= most * (1.0 + 1e-9):
        return
    low, high = sorted((gear.form_roll, gear.tip_roll))
    angle = math.degrees(min(max(roll[i], low), high) / gear.base_radius)
    found = f"{abs(removed[i]) * 1e6:.6g} um at a roll angle of {angle:.4g} deg"
    count, verb = len(form.modifications), "take off" if removed[i] > 0 else "add"
    message = f"{count} modifications together {verb} {found}"
    remedy = "check the units, and whether a section stands there twice"
    if count == 1:
        message = f"the modification goes on beyond its end and reaches {found}"
        remedy = "let it end nearer to the end of the flank"
    raise GeometryError(
        f"{flank}: {message}",
        code="E-DEVIATION",
        key=f"{gear.name}.modifications",
        value=f"{removed[i] * 1e6:.6g} um",
        limit=f"at most {LARGEST_DEVIATION} modules, {most * 1e6:.6g} um, at every place of the flank",
        remedy=remedy,
    )


def _refuse(message: str, key: str, limit: str):
    raise GeometryError(
        message, code="E-DEVIATION", key=key, limit=limit, remedy="lengths are in metres, angles in radians"
    )
