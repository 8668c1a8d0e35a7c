"""Stresses of teeth: a published report, roots against a finer whole gear, Hertz's pressure."""

from __future__ import annotations

import numpy as np

from femgear.contact.bodies import flank_stations, make_bodies, make_sectors, station_weights
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.root_stress import RootStresses, root_stress_cycle, root_stress_influence
from femgear.fe.compliance import node_dofs, symmetric_factor
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import copy_nodes, mirror, rotated_copies
from femgear.fe.meshing import mesh_outline
from femgear.gears.gear import Gear
from femgear.gears.iso6336 import (
    contact_helix_factor,
    contact_ratio_factor,
    helix_of,
    nominal_contact_stress,
    overlap_of,
    zone_factor,
)
from femgear.gears.iso6336_root import nominal_root_stress
from femgear.gears.pair import close_pair
from femgear.gears.planetary import PlanetarySet
from femgear.gears.profile import BasicRack, PinionCutter
from femgear.gears.tooth import half_sector
from validation.contact import HERTZ
from validation.planetary import ALPHA, KISSSOFT, nrel_set
from validation.reference.plane_elasticity import stress
from validation.rows import Row, printed, within
from validation.standard import helical_pair

STEEL = Material(206e9, 0.3, 7850.0)
REPORT_FORCE = 285900.438
PLACE = 0.625
ROOT_LOAD = 1000.0


def nominal_flanks() -> tuple[Row, ...]:
    """D6: contact stress of the published report."""
    s, rows = nrel_set(), []
    for name, first, two, values in (
        ("sun_planet", s.sun, s.planet, ("573.40", "2.25", "0.936")),
        ("planet_ring", s.planet, s.ring, ("312.44", "2.85", "0.891")),
    ):
        working, ratio = (getattr(s, f"{what}_{name}") for what in ("working_pressure_angle", "contact_ratio"))
        ours = nominal_contact_stress(
            first,
            two,
            working_angle=working,
            contact_ratio=ratio,
            tangential_force=REPORT_FORCE,
            youngs_modulus=206e9,
            poisson_ratio=0.3,
        )
        words = name.replace("_", "-")
        # the report prints to one unit of the last digit, see `nrel_report`
        quantity = f"nominal contact stress sigma_H0 of {words} [MPa]"
        rows.append(printed("D6", KISSSOFT, quantity, values[0], ours * 1e-6, digits=2))
        zone = zone_factor(first.pressure_angle, working)
        rows.append(printed("D6", KISSSOFT, f"zone factor Z_H of {words}", values[1], zone))
        quantity = f"contact ratio factor Z_eps of {words}"
        rows.append(printed("D6", KISSSOFT, quantity, values[2], contact_ratio_factor(ratio)))
    return tuple(rows)


def nominal_roots() -> tuple[Row, ...]:
    """D6: root stress of the published report."""
    s, rows = nrel_set(), []
    for name, mesh, form, correction, nominal in (
        ("sun", "sun_planet", "1.47", "2.04", "73.95"),
        ("planet", "sun_planet", "1.38", "2.18", "74.21"),
        ("planet", "planet_ring", "1.01", "2.48", "61.98"),
        ("ring", "planet_ring", "1.20", "2.34", "69.12"),
    ):
        ours = nominal_root_stress(
            getattr(s, name),
            contact_ratio=getattr(s, f"contact_ratio_{mesh}"),
            tangential_force=REPORT_FORCE,
            edition=2006,
        )
        words = f" of the {name} in {mesh.replace('_', '-')}"
        rows.append(printed("D6", KISSSOFT, "form factor Y_F" + words, form, ours.form))
        rows.append(printed("D6", KISSSOFT, "stress correction Y_S" + words, correction, ours.correction))
        quantity = f"nominal root stress sigma_F0{words} [MPa]"
        rows.append(printed("D6", KISSSOFT, quantity, nominal, 1e-6 * ours.stress))
    return tuple(rows)


def nominal_helical_flanks() -> tuple[Row, ...]:
    """Contact stress of helical teeth in the example to the standard."""
    source = "ISO/TR 6336-30:2017, worked example 1 (17/103, m_n 8, 15.8 deg)"
    pair = helical_pair(
        (17, 103),
        (0.145, 0.0),
        module=8,
        degrees=15.8,
        distance=500,
        rack=BasicRack(1.0, 1.4, 0.39),
        tips=(159.66, 872.35),
    )
    pinion, working = pair.gear_1, pair.working_pressure_angle
    helix, base = helix_of(pinion)
    ours = nominal_contact_stress(
        *pair.gears,
        working_angle=working,
        contact_ratio=pair.contact_ratio,
        tangential_force=9000.0 / pinion.reference_radius,
        youngs_modulus=206e9,
        poisson_ratio=0.3,
    )
    ratio = contact_ratio_factor(pair.contact_ratio, overlap_of(pinion, pair.face_width))
    zone, inclined = zone_factor(pinion.pressure_angle, working, base), contact_helix_factor(helix)
    return (
        printed("D6", source, "zone factor Z_H", "2.39533", zone),
        printed("D6", source, "contact ratio factor Z_eps", "0.803", ratio),
        printed("D6", source, "helix factor Z_beta", "1.01944", inclined),
        printed("D6", source, "nominal contact stress sigma_H0 [MPa]", "1206.58", 1e-6 * ours),
    )


def root_against_whole_gear() -> tuple[Row, ...]:
    """Root stress by superposition against principal stresses in a finer grid of the whole gear."""
    gears = (
        ("14 teeth, x 0.3", Gear(14, 3e-3, ALPHA, 0.3, 0.02, 0.009), {"flank_elements": 16, "refine": 1.5}),
        (
            "ring of 40 teeth",
            Gear(40, 3e-3, ALPHA, 0.0, 0.02, 0.072, internal=True),
            {"flank_elements": 16, "refine": 1.0},
        ),
    )
    rows = []
    for name, gear, sizes in gears:
        grid = mirror(mesh_outline(half_sector(gear)))
        root = root_stress_influence(grid, gear, STEEL)
        middle = round(PLACE * (len(root.roll) - 1))
        column = ROOT_LOAD * root.influence[0, :, middle]
        reference = whole_gear_roots(gear, root.roll[middle], **sizes)
        ours = column[: len(root.arc)].max(), column[len(root.arc) :].min()
        for what, expected, value in zip(("tension", "compression"), reference, ours, strict=True):
            quantity = f"{name}, 1 kN on the flank: largest {what} in the root [MPa]"
            source = "principal stress of elements, all teeth in one grid"
            rows.append(within("root", source, quantity, 1e-6 * expected, 1e-6 * value, 0.02))
    return tuple(rows)


def roots_of_high_contact_ratio() -> tuple[Row, ...]:
    """Roots of a pair with a contact ratio of 2.11 against ISO 6336-3:2019, whose f_eps is 0.7 there."""
    rack, force, rows = BasicRack(1.25, 1.5, 0.2), 200.0 / 0.06, []
    gears = (
        Gear(z, 3e-3, ALPHA, 0.0, 0.02, rim, rack=rack, name=name)
        for z, rim, name in ((40, 0.025, "gear_1"), (50, 0.035, "gear_2"))
    )
    pair = close_pair(*gears)
    sectors = make_sectors(pair, STEEL)
    cycle = walk_mesh_cycle(pair, make_bodies(sectors, STEEL), sun_torque=200.0, positions=32)
    influences = RootStresses(tuple(root_stress_influence(s.grid, s.gear, STEEL) for s in sectors.gears[:2]))
    roots = root_stress_cycle(pair, influences, cycle)
    for gear, root in zip(pair.gears, roots, strict=True):
        nominal = nominal_root_stress(gear, contact_ratio=pair.contact_ratio, tangential_force=force)
        quantity = f"{gear.teeth} teeth of 40/50, addendum 1.25, eps_alpha 2.11: sigma_F0 [MPa]"
        tension, source = 1e-6 * float(root.tension.max()), "ISO 6336-3:2019, method B"
        rows.append(within("root", source, quantity, 1e-6 * nominal.stress, tension, 0.1))
    return tuple(rows)


def sharp_root_over_grids() -> tuple[Row, ...]:
    """Root of a ring that a cutter without rounding made, over numbers of elements of the flank."""
    gear = sharp_ring()

    def largest(**sizes) -> float:
        root = root_stress_influence(mirror(mesh_outline(half_sector(gear, **sizes))), gear, STEEL)
        index, weight = station_weights(0.5 * (root.roll[0] + root.roll[-1]), root.roll)
        return ROOT_LOAD * float((root.influence[0, : len(root.arc)][:, index] @ weight).max())

    fine, rows = largest(flank_elements=24, refine=3.0), []
    for count in (12, 24, 48, 64, 96, 128):
        ours = largest(flank_elements=count)
        quantity = f"ring of 61 teeth, cutter of 45 without rounding, {count} flank elements: 1 kN [MPa]"
        source = "elements a third as large everywhere"
        rows.append(within("root", source, quantity, 1e-6 * fine, 1e-6 * ours, 0.025))
    return tuple(rows)


def sharp_ring() -> Gear:
    """Ring of a public REXS file whose fillets turn by 65 degrees with radii down to 0.018 modules."""
    return Gear(
        61,
        4e-3,
        ALPHA,
        0.0,
        0.05,
        0.14,
        internal=True,
        rack=BasicRack(0.9, 1.25, 0.0),
        cutter=PinionCutter(45),
    )


def whole_gear_roots(gear: Gear, roll: float, *, flank_elements: int, refine: float) -> tuple[float, float]:
    """Largest and smallest principal stress in both roots of the loaded tooth [Pa].

    Stresses are those of the elements, averaged at the nodes of the fillets; the force acts at the flank
    node nearest to the roll length, normal to the flank.
    """
    outline = mirror(mesh_outline(half_sector(gear, flank_elements=flank_elements, refine=refine)))
    whole = rotated_copies(outline, gear.teeth)
    matrix = stiffness(whole, STEEL, state="plane strain", thickness=gear.face_width)
    stations = flank_stations(outline, gear)
    i = int(np.abs(stations.roll - roll).argmin())
    first = copy_nodes(outline, gear.teeth)[0]
    force = np.zeros(2 * whole.n_nodes)
    force[2 * first[stations.nodes[i]] + np.array([0, 1])] = ROOT_LOAD * stations.normals[i]
    free = np.setdiff1d(np.arange(len(force)), node_dofs(np.unique(whole.boundaries["rim"])))
    u = np.zeros(len(force))
    u[free] = symmetric_factor(matrix[free][:, free]).solve(force[free])
    total, count = np.zeros((whole.n_nodes, 3)), np.zeros(whole.n_nodes)
    np.add.at(total, whole.triangles, stress(whole, STEEL, u, state="plane strain"))
    np.add.at(count, whole.triangles, 1)
    xx, yy, xy = (total / count[:, None]).T
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    left, right = (first[np.unique(outline.boundaries[f"fillet_{side}"])] for side in ("left", "right"))
    return float((middle + radius)[left].max()), float((middle - radius)[right].min())


def pitch_point_set() -> PlanetarySet:
    """C2 as the sun and the one planet of a set: 20/40, module 2 mm, unshifted, 20 degrees."""
    rack = BasicRack(root_radius=0.25)

    def gear(teeth, rim, internal=False):
        return Gear(teeth, 2e-3, ALPHA, 0.0, 0.02, rim, internal=internal, rack=rack)

    return PlanetarySet(gear(20, 8e-3), gear(40, 20e-3), gear(100, 0.12, True), 0.06, (0.0,))


def hertz_of_teeth() -> tuple[Row, ...]:
    """C2: pressure of one tooth pair at its pitch point, by the contact solution of a set."""
    gears, line_load = pitch_point_set(), 100e3
    bodies = make_bodies(make_sectors(gears, STEEL), STEEL)
    torque = line_load * gears.sun.face_width * gears.sun.base_radius
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=torque, positions=8)
    loaded = np.flatnonzero(cycle.tooth_load[0, :, 0])
    pressure = 1e-6 * cycle.max_pressure[0, 0]
    name = "20/40, m 2, 100 N/mm at the pitch point, teeth as finite elements: "
    return (
        within("C2", HERTZ, name + "peak pressure [MPa]", 888.848552, pressure, 1e-2),
        within(
            "C2",
            "one tooth pair carries",
            name + "load of the pair [N/mm]",
            100.0,
            1e-3 * float(cycle.tooth_load[0, loaded, 0].max()) / gears.sun.face_width,
            1e-9,
        ),
    )
