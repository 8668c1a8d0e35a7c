"""A planetary set in tables, and what deserves a look in it: gears, meshes, phasing, operation.

The phases of the meshes decide which of their harmonics sun and ring hear, and which kinds of modes these
excite; neighbouring tooth numbers are listed with what they would change in that. The findings of
`set_warnings` hold for any planetary set.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import planetary_set, set_deviations, shaft_lines
from femgear.case.quantities import RPM
from femgear.errors import Finding
from femgear.gears.checks import check_set, tip_clearances
from femgear.gears.deviations import check_deviations
from femgear.gears.gear import tooth_thickness
from femgear.gears.kinematics import speeds, torques
from femgear.gears.phasing import KINDS, ZERO, neighbouring_teeth, phasing_of_set, phasing_table
from femgear.report.tables import Block, chosen, tabulate

if TYPE_CHECKING:
    from femgear.case.sections import Case
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
        _harmonics(planetary),
        _neighbours(planetary),
        _operation(case, planetary),
    )


def set_warnings(case: Case) -> Iterator[Finding]:
    """List what is allowed in any planetary set but deserves a look."""
    planetary = planetary_set(case)
    yield from (*check_set(planetary), *case.notices)
    yield from check_deviations(set_deviations(case), planetary)
    if case.operation.torque <= 0:
        nothing = "without torque no tooth touches; only static results exist"
        text = "a negative torque loads the other flanks" if case.operation.torque < 0 else nothing
        yield Finding("W-TORQUE", "operation.torque", text)


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
