"""Rows of the validation against CalculiX, where it is installed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, wraps

import numpy as np

from femgear.case.planetary import Case
from femgear.contact.bodies import RING_STATE
from femgear.fe.elasticity import Material
from femgear.gears.kinematics import orientations
from femgear.gears.pair import GearSet
from femgear.stages.static_results import StaticResult
from validation import calculix, fixed_housing
from validation.cases import reference_case, reference_material, reference_static
from validation.fixed_housing import FEET_ANGLES, FOOT_WIDTH
from validation.rows import Row, at_most, information, within
from validation.whole_ring import whole_grid

SOURCE = "CalculiX"
POSITIONS = tuple(np.arange(8) / 8)
STEP = 0.02
"""Change of the approach to either side, for the tangent."""
PENALTY = 1e17
"""Contact pressure over overclosure [Pa/m]: 1 GPa at 10 nm."""
SIZE = 15e-6
"""Length of the elements at a contact [m], a sixth of its half width or less."""
NEAR = 1.2
"""Part of the approach within which flanks may touch."""
PLANE_STRAIN = {"tooth": "plane strain", "body": "plane strain"}
APPROACH, STIFFNESS, PRESSURE, ROOT_1, ROOT_2 = QUANTITIES = (
    "transmission error [um]",
    "tangent stiffness [N/um]",
    "contact pressure [MPa]",
    "largest stress in the root of gear 1 [MPa]",
    "largest stress in the root of gear 2 [MPa]",
)
MODES = 8
GATES = 0.002, 0.002, 0.02, 0.02, 0.02
CORNER = (
    "a tip corner carries. Its force is normal to the flank of the other gear, {tilt} degrees off the normal "
    "of its own. CalculiX has that direction, femgear takes the force as normal to both (docs/limits.md)"
)
"""Reason of differences where a corner carries.

At position 0.25 of 24/36 elements of 5 um at the contact change CalculiX's approach by 0.02 %, four times as
many elements along the flanks femgear's by 0.01 %: both have converged, 0.45 % apart. At 0.875 the lever arm
of the force on the corner of gear 1 is 2.7 % below the base radius. With that arm alone femgear has 18.27 um
and 391.3 N/um, CalculiX 18.17 and 392.3, femgear as it is 18.03 and 399.1. What is left, 0.5 % at both
positions, makes the tooth pair 1.4 % too soft at a tilt of 0.8 degrees and 4.9 % at 2.5: in proportion to the
tilt, as a force that pushes along the tooth too would be felt.
"""
STATES = (
    "the plane state changes on the tooth base, which ends in the fillet, and CalculiX's stress jumps there. "
    "femgear takes stresses in one plane state. So does the row of this pair that is all in plane strain"
)
TILT = {("24/36", 0.25): 0.8, ("24/36", 0.875): 2.5, ("24/-60", 0.0): 1.4}
"""Angle between the normals of both flanks where a corner carries at a position of a pair [deg]."""

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
PAIRS = {"24/36": EXTERNAL, "24/-60": INTERNAL}


def where_installed(rows: Callable[[], tuple[Row, ...]]) -> Callable[[], tuple[Row, ...]]:
    """Compute rows only where CalculiX is installed, else say that it is not; a run that fails is a row."""

    @wraps(rows)
    def either() -> tuple[Row, ...]:
        name = rows.__name__.replace("_", " ")
        if calculix.installed():
            try:
                return rows()
            except RuntimeError as error:
                note = " ".join(str(error).split()[-30:])
                return (at_most("CalculiX", SOURCE, f"{name} could not be computed", 0.0, np.nan, note=note),)
        note = "needs the program ccx (Debian: calculix-ccx)"
        return (information("CalculiX", SOURCE, f"{name}: not computed", None, float("nan"), note=note),)

    return either


def pair_case(teeth: str, positions: int) -> Case:
    """Case of one of the pairs."""
    from femgear.trains.reading import parse_case

    return parse_case(f"{PAIR}{teeth}static = {{ positions = {positions} }}\n", name="pair")


@cache
def femgear_pair(name: str) -> tuple[Case, StaticResult, np.ndarray]:
    """Case of a pair of `PAIRS`, its static stage and the quantities of `QUANTITIES` at 64 positions."""
    from femgear.stages.static import solve_static, solve_stress

    case = pair_case(PAIRS[name], 64)
    static = solve_static(case)
    cycle, stress = static.cycle, solve_stress(case, static)
    sharing = (
        1e6 * cycle.deflection[0],
        1e-6 * cycle.stiffness[0],
        1e-6 * cycle.max_pressure[0],
        *(1e-6 * root.stress[:, :, 0].max(axis=(0, 2)) for root in stress.roots),
    )
    return case, static, np.array(sharing)


@cache
def expected(
    name: str, position: float, *, penalty: float = PENALTY, size: float = SIZE, state: str = ""
) -> np.ndarray:
    """Compute the quantities of `QUANTITIES` by CalculiX; a state is that of both gears."""
    from femgear.case.gear_set import gear_material

    case, static, _ = femgear_pair(name)
    return contact_of_gears(
        static.planetary_set,
        gear_material(case, "gear_1"),
        torque=static.sun_torque,
        position=position,
        approach=static.cycle.deflection[0, round(64 * position)],
        penalty=penalty,
        size=size,
        states=({"tooth": state, "body": state},) * 2 if state else None,
    )


@where_installed
def external_pair() -> tuple[Row, ...]:
    """Pair 24/36 of cases/spur_pair.toml: whole gears of CalculiX in contact, plane strain."""
    return pair_rows("24/36")


@where_installed
def internal_pair() -> tuple[Row, ...]:
    """Pair 24/60 with an internal gear, whose body is in plane stress as in femgear."""
    return pair_rows("24/-60")


def pair_rows(name: str) -> tuple[Row, ...]:
    """Compare a pair at eight positions: approach, tangent stiffness, pressure and roots."""
    rows, ours = list[Row](), femgear_pair(name)[2]
    for position in POSITIONS:
        positions_of_ours = ours[:, round(64 * position)]
        for quantity, gate, theirs, value in zip(
            QUANTITIES, GATES, expected(name, position), positions_of_ours, strict=True
        ):
            tilt = TILT.get((name, position))
            reason = "" if tilt is None else CORNER.format(tilt=tilt)
            if name == "24/-60" and quantity == ROOT_2:
                reason = STATES
            text = f"{name}, position {position:g}: {quantity}"
            rows.append(within("CalculiX", SOURCE, text, theirs, float(value), gate, explanation=reason))
    return tuple(rows)


@where_installed
def stepped_set() -> tuple[Row, ...]:
    """Both meshes of a stepped planet of `femgear new stepped`, where one and where two pairs of teeth carry."""
    from femgear.case import text as case_text
    from femgear.case.gear_set import gear_material
    from femgear.stages.static import solve_static
    from femgear.trains.drafts import new_case
    from femgear.trains.gearbox.contact import loaded_tables
    from femgear.trains.gearbox.power import gearbox_flow
    from femgear.trains.reading import parse_case

    rows, gearbox = list[Row](), parse_case(new_case("stepped"))
    flow = gearbox_flow(gearbox)
    for stage in gearbox.pair[:2]:
        tables = loaded_tables(stage, abs(flow.first_torque(stage)), 1) | {"static": {"positions": 64}}
        case = parse_case(case_text.write(tables))
        static = solve_static(case)
        approach, stiffness = static.cycle.deflection[0], static.cycle.stiffness[0]
        for words, at in (("one pair of teeth", int(stiffness.argmin())), ("two", int(stiffness.argmax()))):
            theirs = contact_of_gears(
                static.planetary_set,
                gear_material(case, "gear_1"),
                torque=static.sun_torque,
                position=at / 64,
                approach=approach[at],
            )
            for quantity, value, reference in zip(QUANTITIES[:2], (1e6 * approach, 1e-6 * stiffness), theirs):
                teeth = "/".join(str(gear.teeth) for gear in static.planetary_set.gears)
                text = f"{stage.name} {teeth}, {words}: {quantity}"
                rows.append(within("stepped 24/57/27/108", SOURCE, text, float(reference), float(value[at]), 0.01))
    return tuple(rows)


@where_installed
def settings() -> tuple[Row, ...]:
    """What penalty and elements of CalculiX change, and the plane state that femgear does not take."""
    rows, name, position = list[Row](), "24/36", 0.5
    taken = expected(name, position)
    for words, changed in (
        ("penalty times ten", {"penalty": 10.0 * PENALTY}),
        ("elements at the contact half as long", {"size": 0.5 * SIZE}),
    ):
        refined = expected(name, position, **changed)
        for quantity, gate, theirs, value in zip(QUANTITIES, GATES, refined, taken, strict=True):
            text = f"{name}, position {position:g}, reference with {words}: {quantity}"
            note = "both are CalculiX's: the row shows what the reference is worth"
            rows.append(within("settings", SOURCE, text, theirs, value, 0.5 * gate, note=note))
    for name, position, state in (("24/36", 0.5, "plane stress"), ("24/-60", 0.375, "plane strain")):
        theirs, ours = expected(name, position, state=state), femgear_pair(name)[2][:, round(64 * position)]
        for i, quantity in enumerate((APPROACH, STIFFNESS)):
            text = f"{name}, position {position:g}, CalculiX all in {state}: {quantity}"
            rows.append(information("state", SOURCE, text, theirs[i], ours[i]))
        for i in (3, 4):
            text = f"{name}, position {position:g}, CalculiX all in {state}: {QUANTITIES[i]}"
            rows.append(within("state", SOURCE, text, theirs[i], ours[i], GATES[i]))
    return tuple(rows)


def contact_of_gears(
    gears: GearSet,
    material: Material,
    *,
    torque: float,
    position: float,
    approach: float,
    penalty: float = PENALTY,
    size: float = SIZE,
    states: Sequence[dict[str, str]] | None = None,
    crack: tuple[int, float] | None = None,
) -> np.ndarray:
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
    penalty, size : float
        See `calculix.pair_contact` and `calculix.whole_gear`.
    states : two dicts, optional
        Plane states of the gears as in `calculix.body_input`, left out those of femgear.
    crack : (int, float), optional
        Tooth of the first gear and depth, see `calculix.whole_gear`.
    """
    first, second = gears.kinds[0].gears
    angles = [of_gear[0] for of_gear in orientations(gears, position).gears]
    centre = gears.centre_distance * (-1.0 if second.internal else 1.0)
    mates = calculix.near_teeth((first, second), angles, centre, within=NEAR * approach)
    bodies = [
        calculix.whole_gear(
            gear,
            "right" if gear.internal else "left",
            {pair.teeth[number]: pair.rolls[number] for pair in mates},
            size=size,
            crack=None if number else crack,
        ).turned(angles[number], (place, 0.0))
        for number, (gear, place) in enumerate(((first, 0.0), (second, centre)))
    ]
    contact = calculix.pair_contact(
        bodies,
        mates,
        approach * np.array([1.0 - STEP, 1.0 + STEP]),
        base_radius=first.base_radius,
        width=first.face_width,
        material=material,
        penalty=penalty,
        states=states or (PLANE_STRAIN, RING_STATE if second.internal else PLANE_STRAIN),
    )
    stiffness = np.diff(contact.torque)[0] / first.base_radius / np.diff(contact.approach)[0]
    inside = [not any(pair.ends) for pair in mates]
    return np.array(
        [
            1e6 * contact.at(torque, contact.approach),
            1e-6 * stiffness,
            1e-6 * contact.at(torque, contact.pressure[:, inside].max(axis=1).mean(axis=0)),
            *(1e-6 * contact.at(torque, root) for root in contact.root),
        ]
    )


@where_installed
def ring_on_feet() -> tuple[Row, ...]:
    """Ring of the reference set on its foundation and four feet, all its teeth in one plane grid."""
    case, rows = reference_case(), list[Row]()
    gear = reference_static().planetary_set.ring
    grid = whole_grid(gear)
    teeth = np.concatenate(
        [tooth_elements for name, tooth_elements in grid.regions.items() if name.startswith("tooth")]
    )
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
            body,
            reference_material(),
            RING_STATE,
            springs=springs,
            masses=masses if mass else {},
            count=MODES,
        )
        casing = fixed_housing.ring_on_feet(stiffness, mass)
        for i, reference in enumerate(expected[:MODES]):
            words = f"four feet of {stiffness:.0e} N/m, {1e3 * mass:g} g: natural frequency {i + 1} [Hz]"
            rows.append(within("feet", SOURCE, words, reference, casing[i], 0.002))
    return tuple(rows)
