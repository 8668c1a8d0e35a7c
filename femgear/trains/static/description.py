"""A planetary set in tables, and what deserves a look: gears, meshes, phasing, operation, static solution.

The phases of the meshes decide which of their harmonics sun and ring hear, and which kinds of modes these
excite; neighbouring tooth numbers are listed with what they would change in that. The findings of
`set_warnings` hold for any planetary set, those of `static_warnings` for any static solution; `check_motions`
refuses one whose displacements are not small.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import planetary_set, set_deviations, shaft_lines
from femgear.case.quantities import RPM
from femgear.errors import ContactError, Finding
from femgear.gears.checks import check_set, tip_clearances
from femgear.gears.deviations import check_deviations
from femgear.gears.gear import tooth_thickness
from femgear.gears.kinematics import speeds, torques
from femgear.gears.phasing import KINDS, ZERO, neighbouring_teeth, phasing_of_set, phasing_table
from femgear.report.tables import Block, chosen, tabulate

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.sections import Case
    from femgear.contact.cycle import MeshCycle
    from femgear.gears.planetary import PlanetarySet

# harmonics whose phasing is listed
_HARMONICS = 6
# neighbouring sets: how far their teeth and ratio may lie away, and how many are listed
_DISTANCE, _TOLERANCE = 3, 0.02
_ROWS = 8
_SHORT = dict(zip(KINDS, ("in", "counter", "sequential", "unequal")))


def describe_set(case: Case) -> tuple[Block, ...]:
    """Tabulate geometry, phasing and operation of a planetary set."""
    planetary = planetary_set(case)
    return (
        _gears(planetary),
        _meshes(planetary),
        *describe_phasing(planetary),
        _operation(case, planetary),
    )


def set_warnings(case: Case) -> tuple[Finding, ...]:
    """What is allowed in any planetary set but deserves a look."""
    planetary = planetary_set(case)
    found = [*check_set(planetary), *case.notices, *check_deviations(set_deviations(case), planetary)]
    if case.operation.torque == 0:
        text = "without torque no tooth touches; only static results exist"
        found.append(Finding("W-TORQUE", "operation.torque", text))
    if case.operation.torque < 0:
        text = "a negative torque loads the other flanks"
        found.append(Finding("W-TORQUE", "operation.torque", text))
    return tuple(found)


def check_motions(cycle: MeshCycle, module: float) -> None:
    """Refuse a static result in which the gears have moved too far for small displacements.

    Raises
    ------
    ContactError
        E-MOTION: flanks that approach by more than half a module, members that move by more than two.
    """
    for name, motion, modules, remedy in (
        ("the flanks approach", cycle.deflection, 0.5, "reduce operation.torque or the errors"),
        (
            "a member moves",
            cycle.member_motion,
            2.0,
            "stiffen the supports and bearings, reduce the clearance or operation.torque",
        ),
    ):
        largest = float(np.abs(motion).max(initial=0.0))
        if largest > modules * module:
            raise ContactError(
                f"{name} by {largest * 1e3:.4g} mm: the model is one of small displacements",
                code="E-MOTION",
                value=f"{largest * 1e3:.4g} mm",
                limit=f"{modules:g} modules, {modules * module * 1e3:.4g} mm",
                remedy=remedy,
            )


def static_warnings(data: xr.Dataset, module: float) -> Iterator[Finding]:
    """What is wrong with the contents of static.nc in an engineer's eyes.

    Parameters
    ----------
    data : xarray.Dataset
    module : float
        Of the gears, of helical ones in their transverse section [m].
    """
    names = ("mesh_force", "back_force", "max_pressure", "member_motion", "ste")
    force, back, pressure, motion, approach = (data[name].values for name in names)
    if pressure.max(initial=0.0) > 4e9:
        text = (
            f"the contact pressure reaches {pressure.max() * 1e-6:.0f} MPa: no steel carries that, and the "
            "model stays elastic"
        )
        yield Finding("W-PRESSURE", "", text)
    moved = np.abs(motion).max(initial=0.0)
    if np.abs(approach).max(initial=0.0) > 0.05 * module:
        yield Finding("W-DEFLECTION", "", _deflection(approach, moved, members=len(motion)))
    if moved > 0.05 * module:
        text = (
            f"a member moves by {moved * 1e6:.0f} um, more than 5 % of the module: contact points and arms "
            "are those of the unmoved set"
        )
        yield Finding("W-MOTION", "", text)
    if ((force > 0) & (pressure <= 0)).any():
        text = (
            "at some positions every contact of a mesh lies at the end of a flank: its pressure has no limit "
            "and is not given"
        )
        yield Finding("W-EDGE", "", text)
    unloaded = (force + back)[: len(force) // 2] <= 0.0
    if unloaded.any() and force.any():
        planets = ", ".join(str(n + 1) for n in np.flatnonzero(unloaded.any(axis=1)))
        yield Finding("W-OPEN", "", f"planet {planets} carries nothing at some positions")
    if ((force > 0) & (back > 0)).any():
        yield Finding("W-WEDGED", "", "some meshes are loaded on both flanks at once")
    if ((back > 0) & ~(force > 0)).any():
        text = "some meshes carry on their back flanks alone: planets work against one another"
        yield Finding("W-BACK", "", text)


def _deflection(approach: np.ndarray, moved: float, *, members: int) -> str:
    """Approach of the flanks beyond 5 % of the module: of teeth and bodies, or of moving members as well."""
    sun, ring = (np.abs(half).max() * 1e6 for half in np.split(approach, 2))
    if not members:
        return (
            f"the teeth deflect by {max(sun, ring):.0f} um, more than 5 % of the module: small displacements "
            "no longer hold"
        )
    return (
        f"the flanks approach by {sun:.0f} um between sun and planets and by {ring:.0f} um "
        "between planets and ring, more than 5 % of the module: small displacements no longer hold. This is "
        "not the deflection of the teeth alone: it contains the motion of the members, up to "
        f"{moved * 1e6:.0f} um, and between planets and ring that of the ring on its foundation; "
        'static.members = "fixed" shows the teeth'
    )


def describe_phasing(planetary_set: PlanetarySet) -> tuple[Block, Block]:
    """Tabulate the phasing of the first harmonics of the mesh frequency, and neighbouring tooth numbers.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Of a case that `femgear.gears.checks.check_set` accepts.
    """
    return _harmonics(planetary_set), _neighbours(planetary_set)


def _gears(s: PlanetarySet) -> Block:
    """Tabulate diameters and teeth of the three gears."""
    rows = {
        "teeth": lambda g: str(g.teeth),
        "profile shift": lambda g: f"{g.profile_shift:.5f}",
        "reference diameter [mm]": lambda g: f"{2e3 * g.reference_radius:.4f}",
        "tip diameter [mm]": lambda g: f"{2e3 * g.tip_radius:.4f}",
        "root diameter [mm]": lambda g: f"{2e3 * g.root_radius:.4f}",
        "start of involute, diameter [mm]": lambda g: f"{2e3 * g.form_radius:.4f}",
        "tooth thickness at the tip [mm]": lambda g: f"{1e3 * float(tooth_thickness(g, g.tip_radius)):.4f}",
        "bore or outer diameter [mm]": lambda g: f"{2e3 * g.rim_radius:.4f}",
    }
    columns = {
        "": lambda name: name,
        "sun": lambda name: rows[name](s.sun),
        "planet": lambda name: rows[name](s.planet),
        "ring": lambda name: rows[name](s.ring),
    }
    angles = ", ".join(f"{math.degrees(angle):.6g}" for angle in s.planet_angles[:12])
    notes = (
        f"module {s.sun.module * 1e3:.6g} mm, pressure angle {math.degrees(s.sun.pressure_angle):.6g} deg, "
        f"face width {s.sun.face_width * 1e3:.6g} mm, centre distance {s.centre_distance * 1e3:.6g} mm",
        f"{s.n_planets} planets at {angles} deg",
        "profile shift of the ring: positive moves the flank outwards (the opposite of ISO 21771)",
    )
    return tabulate("Gears", rows, columns, notes)


def _meshes(s: PlanetarySet) -> Block:
    """Tabulate what the geometry says of both kinds of mesh."""
    n, phases = s.n_planets, [f"{phase:.4f}" for phase in s.mesh_phases]
    more = ", ..." if n > 6 else ""
    clearance = {name: f"{1e3 * value:.3f}" for name, value in tip_clearances(s).items()}
    angles = s.working_pressure_angle_sun_planet, s.working_pressure_angle_planet_ring
    backlashes = s.backlash_sun_planet, s.backlash_planet_ring
    rows = (
        ("working pressure angle [deg]", *(f"{math.degrees(angle):.4f}" for angle in angles)),
        ("contact ratio", f"{s.contact_ratio_sun_planet:.4f}", f"{s.contact_ratio_planet_ring:.4f}"),
        ("normal backlash [um]", *(f"{round(play * 1e6, 2) + 0.0:.2f}" for play in backlashes)),
        (
            "tip clearances [mm]",
            f"{clearance['sun tip to planet root']}, {clearance['planet tip to sun root']}",
            f"{clearance['planet tip to ring root']}, {clearance['ring tip to planet root']}",
        ),
        ("mesh phases [periods]", ", ".join(phases[:n][:6]) + more, ", ".join(phases[n:][:6]) + more),
    )
    return Block("Meshes", ("", "sun-planet", "planet-ring"), rows)


def _operation(case: Case, s: PlanetarySet) -> Block:
    """Tabulate the speeds of all members."""
    operation = case.operation
    found = [
        speeds(s, input=operation.input, fixed=operation.fixed, speed=operation.speeds[i])
        for i in chosen(len(operation.speeds))
    ]
    columns = {
        "sun [rpm]": lambda v: f"{v.sun / RPM:.4f}",
        "carrier [rpm]": lambda v: f"{v.carrier / RPM:.4f}",
        "ring [rpm]": lambda v: f"{v.ring / RPM:.4f}",
        "planet [rpm]": lambda v: f"{v.planet / RPM:.4f}",
        "mesh frequency [Hz]": lambda v: f"{v.mesh_frequency:.4f}",
    }
    load = torques(s, member=operation.input, torque=operation.torque)
    notes = [
        f"input {operation.input}, fixed {operation.fixed}; torque on sun {load.sun:.6g} N m, "
        f"carrier {load.carrier:.6g} N m, ring {load.ring:.6g} N m"
    ]
    if len(operation.speeds) > len(found):
        notes.append(f"{len(operation.speeds)} speeds, of which the first and the last are shown")
    return tabulate("Operation", found, columns, (*notes, *shaft_lines(case)))


def _harmonics(s: PlanetarySet) -> Block:
    """Tabulate how the phases of the meshes add up at the first harmonics."""
    phasing = phasing_of_set(s)
    table = phasing_table(phasing, range(1, _HARMONICS + 1))
    columns = {
        "harmonic": lambda i: str(table.harmonics[i]),
        "planets are": lambda i: table.kind[i],
        "k": lambda i: "-" if table.cyclic[i] < 0 else str(table.cyclic[i]),
        "torque": lambda i: _share(table.members[i][:, 0].max()),
        "lateral force": lambda i: _share(table.members[i][:, 1].max()),
        "can excite modes": lambda i: ", ".join(table.excited[i]),
    }
    common = math.gcd(s.sun.teeth, s.planet.teeth), math.gcd(s.planet.teeth, s.ring.teeth)
    notes = (
        "k = mod(h z_sun, N); torque, lateral force: what is left of equal mesh forces on sun, ring, carrier",
        f"a planet's ring mesh follows its sun mesh by {phasing.lag:.4f} periods",
        f"common divisors of the teeth: sun and planet {common[0]}, planet and ring {common[1]}",
    )
    return tabulate("Mesh phasing", range(_HARMONICS), columns, notes)


def _share(value: float) -> str:
    """Write what is left of a force."""
    return "cancelled" if value < ZERO else f"{100.0 * value:.1f} %"


def _neighbours(s: PlanetarySet) -> Block:
    """Tabulate tooth numbers near those of the set, and what they would change."""
    wanted = (s.sun.teeth, s.planet.teeth, s.ring.teeth)
    closure = max(1, abs(wanted[2] - wanted[0] - 2 * wanted[1]))
    found = neighbouring_teeth(
        *wanted, s.n_planets, distance=_DISTANCE, ratio_tolerance=_TOLERANCE, closure=min(closure, 10)
    )
    found = found.only(np.any(found.teeth != np.array(wanted), axis=1))
    # sets with equal spacing first, each group by its ratio
    found = found.only(np.argsort(~found.equally_spaced, kind="stable"))

    def spacing(i: int) -> str:
        off = math.degrees(found.spacing_error[i])
        return "equal" if found.equally_spaced[i] else f"off by {off:.2f} deg"

    columns = {
        "teeth": lambda i: "/".join(str(z) for z in found.teeth[i]),
        "ratio": lambda i: f"{found.ratio[i]:.4f}",
        "change": lambda i: f"{100.0 * found.ratio_change[i]:+.2f} %",
        "spacing": spacing,
        "harmonics 1 to 4": lambda i: _kinds([_SHORT[name] for name in found.kind_names[i]]),
        "hunting": lambda i: "yes" if found.hunting[i] else "no",
        "room [modules]": lambda i: f"{found.room[i]:.2f}",
    }
    near = f"{len(found)} within {_DISTANCE} teeth and {100 * _TOLERANCE:g} % of the ratio"
    notes = (f"{near}; room: unshifted tips",)
    return tabulate("Neighbouring tooth numbers", range(min(len(found), _ROWS)), columns, notes)


def _kinds(kinds: list[str]) -> str:
    """Write the phasing of some harmonics, once where they agree."""
    return kinds[0] if len(set(kinds)) == 1 else ", ".join(kinds)
