"""Rows of the validation against CalculiX, where it is installed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps

import numpy as np

from femgear.case.sections import Case
from femgear.contact.bodies import RING_STATE
from femgear.fe.elasticity import Material
from femgear.gears.kinematics import orientations
from femgear.gears.planetary import GearSet
from validation import calculix, fixed_housing
from validation.cases import reference_case, reference_material, reference_static
from validation.fixed_housing import FEET_ANGLES, FOOT_WIDTH
from validation.rows import Row, information, within
from validation.whole_ring import whole_grid

SOURCE = "CalculiX"
EXTERNAL_POSITIONS = tuple(np.arange(8) / 8)
INTERNAL_POSITIONS = (20 / 64,)
STEP = 0.02
"""Change of the approach to either side, for the tangent."""
PENALTY = 1e17
"""Contact pressure over overclosure [Pa/m]: 1 GPa at 10 nm."""
FLANK_ELEMENTS = 96
NEAR = 40e-6
"""Distance [m] within which flanks may touch: twice the approach of the pairs."""
PLANE_STRAIN = {"tooth": "plane strain", "body": "plane strain"}
APPROACH, STIFFNESS, PRESSURE, ROOT_1, ROOT_2 = QUANTITIES = (
    "transmission error [um]", "tangent stiffness [N/um]", "contact pressure [MPa]",
    "largest stress in the root of gear 1 [MPa]", "largest stress in the root of gear 2 [MPa]",
)  # fmt: skip
MODES = 8
GATES = 0.002, 0.002, 0.02, 0.02, 0.02
CORNER = (
    "a tip corner carries, as femgear's edge_contact says: neither program resolves it, and which is nearer "
    "is not known"
)
TANGENT = (
    "cause not known: differences scatter by 0.3 % to either side over the positions; twice the elements of "
    "either program, or femgear's secant over the same 4 % of load, change them by 0.04 % at most; what is "
    "not tried is a convergence of CalculiX closer than its default, 1 % of an increment"
)
NODES = (
    "CalculiX's pressure is that of stresses at nodes of elements half as long as the contact's half width: "
    "at position 0.5 it is 4.5 % above femgear's with 96 elements along the flank, 0.4 % with 192, where "
    "transmission error and stiffness change by 0.03 %"
)
STATES = (
    "the plane state changes on the tooth base, which ends in the fillet, where CalculiX's stress at nodes "
    "has the jump; with all in plane strain CalculiX has 123.1 MPa"
)
DIFFERS = {
    **{("24/36", position, STIFFNESS): TANGENT for position in (0.125, 0.375, 0.75)},
    **{("24/36", position, PRESSURE): NODES for position in (0.375, 0.5, 0.625, 0.75)},
    ("24/-60", 20 / 64, STIFFNESS): TANGENT,
    ("24/-60", 20 / 64, PRESSURE): NODES,
    ("24/-60", 20 / 64, ROOT_2): STATES,
}

PAIR = """
format = 1
model = "pair"
title = "Pair for CalculiX"
material = { youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }
operation = { torque = "200 N m" }
"""
# the entries of cases/spur_pair.toml
EXTERNAL = """
set = { module = "3 mm", pressure_angle = "20 deg", face_width = "20 mm", centre_distance = "91.5 mm" }
gear_1 = { teeth = 24, profile_shift = 0.3, bore_radius = "15 mm", tip_diameter = "79.8 mm" }
gear_2 = { teeth = 36, tip_diameter = "115.3786 mm", bore_radius = "25 mm" }
"""
INTERNAL = """
set = { module = "3 mm", pressure_angle = "20 deg", face_width = "20 mm", centre_distance = "54 mm" }
gear_1 = { teeth = 24, profile_shift = 0.0, bore_radius = "15 mm" }
gear_2 = { teeth = 60, outer_radius = "100 mm", cutter_teeth = 30, tip_diameter = "175 mm" }
"""


def where_installed(rows: Callable[[], tuple[Row, ...]]) -> Callable[[], tuple[Row, ...]]:
    """Compute rows only where CalculiX is installed, else say that it is not."""

    @wraps(rows)
    def either() -> tuple[Row, ...]:
        if calculix.installed():
            return rows()
        name = rows.__name__.replace("_", " ")
        note = "needs the program ccx (Debian: calculix-ccx)"
        return (information("CalculiX", SOURCE, f"{name}: not computed", None, float("nan"), note=note),)

    return either


def pair_case(teeth: str, positions: int) -> Case:
    """Case of one of the pairs."""
    from femgear.trains.reading import parse_case

    return parse_case(f"{PAIR}{teeth}static = {{ positions = {positions} }}\n", name="pair")


@where_installed
def external_pair() -> tuple[Row, ...]:
    """Pair 24/36 of cases/spur_pair.toml: whole gears of CalculiX in contact, plane strain."""
    return pair_rows(EXTERNAL, "24/36", EXTERNAL_POSITIONS)


@where_installed
def internal_pair() -> tuple[Row, ...]:
    """Pair 24/60 with an internal gear, whose body is in plane stress as in femgear."""
    return pair_rows(INTERNAL, "24/-60", INTERNAL_POSITIONS)


def pair_rows(teeth: str, name: str, positions: Sequence[float]) -> tuple[Row, ...]:
    """Compare a pair at some of 64 positions: approach, tangent stiffness, pressure and roots."""
    from femgear.case.gear_set import gear_material
    from femgear.trains.static.stages import solve_static, solve_stress

    case = pair_case(teeth, 64)
    static = solve_static(case)
    cycle, stress = static.cycle, solve_stress(case, static)
    edge, rows = static.dataset()["edge_contact"].values[0], list[Row]()
    for position in positions:
        i = round(64 * position)
        ours = (
            1e6 * cycle.deflection[0, i], 1e-6 * cycle.stiffness[0, i], 1e-6 * cycle.max_pressure[0, i],
            *(1e-6 * root.stress[:, i, 0].max() for root in stress.roots),
        )  # fmt: skip
        expected = contact_of_gears(
            static.planetary_set, gear_material(case, "gear_1"), torque=static.sun_torque,
            position=position, approach=cycle.deflection[0, i],
        )  # fmt: skip
        rows += compared(name, position, expected, ours, edge=bool(edge[i]))
    return tuple(rows)


def compared(
    name: str, position: float, expected: Sequence[float], ours: Sequence[float], *, edge: bool
) -> list[Row]:
    """Compare the quantities of `QUANTITIES`; ``edge`` says that a tip corner carries."""
    rows = []
    for quantity, gate, theirs, value in zip(QUANTITIES, GATES, expected, ours, strict=True):
        reason = CORNER if edge else DIFFERS.get((name, position, quantity), "")
        text = f"{name}, position {position:g}: {quantity}"
        rows.append(within("CalculiX", SOURCE, text, theirs, float(value), gate, explanation=reason))
    return rows


def contact_of_gears(
    gears: GearSet, material: Material, *, torque: float, position: float, approach: float,
    penalty: float = PENALTY, flank_elements: int = FLANK_ELEMENTS,
) -> np.ndarray:  # fmt: skip
    """Compute the quantities of `QUANTITIES` of a pair by CalculiX.

    Parameters
    ----------
    gears : GearSet
        Of one pair.
    material : Material
    torque : float
        [N m]
    position : float
        [mesh periods]
    approach : float
        Where the contact is solved, a little to either side [m]; values are interpolated to the torque.
    penalty, flank_elements : float, int
        See `calculix.pair_contact` and `calculix.whole_gear`.
    """
    first, second = gears.kinds[0].gears
    angles = [of_gear[0] for of_gear in orientations(gears, position).gears]
    centre = gears.centre_distance * (-1.0 if second.internal else 1.0)
    teeth = calculix.near_teeth((first, second), angles, centre, within=NEAR)
    bodies = [
        calculix.whole_gear(
            gear, "right" if gear.internal else "left", [mates[number] for mates in teeth],
            flank_elements=flank_elements,
        ).turned(angles[number], (place, 0.0))
        for number, (gear, place) in enumerate(((first, 0.0), (second, centre)))
    ]  # fmt: skip
    contact = calculix.pair_contact(
        bodies, teeth, approach * np.array([1.0 - STEP, 1.0 + STEP]), base_radius=first.base_radius,
        width=first.face_width, material=material, penalty=penalty,
        states=(PLANE_STRAIN, RING_STATE if second.internal else PLANE_STRAIN),
    )  # fmt: skip
    stiffness = np.diff(contact.torque)[0] / first.base_radius / np.diff(contact.approach)[0]
    return np.array([
        1e6 * contact.at(torque, contact.approach), 1e-6 * stiffness,
        1e-6 * contact.at(torque, contact.pressure.mean(axis=0)),
        *(1e-6 * contact.at(torque, root) for root in contact.root),
    ])  # fmt: skip


@where_installed
def ring_on_feet() -> tuple[Row, ...]:
    """Ring of the reference set on its foundation and four feet, all its teeth in one plane grid."""
    case, rows = reference_case(), list[Row]()
    gear = reference_static().planetary_set.ring
    grid = whole_grid(gear)
    teeth = np.concatenate([own for name, own in grid.regions.items() if name.startswith("tooth")])
    body = calculix.PlaneBody(
        grid.points, grid.triangles, grid.boundaries, np.isin(np.arange(len(grid.triangles)), teeth)
    )
    around = 2.0 * np.pi * gear.rim_radius * case.ring.foundation_radial
    for stiffness, mass in ((4e8, 0.05), (4e9, 0.0)):
        springs = {node: around * share for node, share in calculix.over_arc(body, "rim").items()}
        masses: dict[int, float] = {}
        for angle in np.radians(FEET_ANGLES):
            foot = calculix.over_arc(body, "rim", angle, FOOT_WIDTH / gear.rim_radius)
            for node, share in foot.items():
                springs[node] += share * stiffness / gear.face_width
                masses[node] = share * mass / gear.face_width
        expected = calculix.natural_frequencies(
            body, reference_material(), RING_STATE, springs=springs, masses=masses if mass else {},
            count=MODES,
        )  # fmt: skip
        found = fixed_housing.ring_on_feet(stiffness, mass)
        for i, reference in enumerate(expected[:MODES]):
            words = f"four feet of {stiffness:.0e} N/m, {1e3 * mass:g} g: natural frequency {i + 1} [Hz]"
            rows.append(within("feet", SOURCE, words, reference, found[i], 0.002))
    return tuple(rows)
