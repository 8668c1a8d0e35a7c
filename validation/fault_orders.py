"""Rows of the lines of faulty teeth: every route to a signal of a fixed sensor puts them where the teeth do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from femgear.case import text as case_text
from femgear.run import solve
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.response import accelerations, solve_gearbox_response
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import parse_case, with_values
from validation.rows import Row, at_most, within

SET = """
format = 1
title = "{sun}/{planet}/{ring}"
set = {{ planets = {planets}, face_width = "20 mm"{angles} }}
material = {{ youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }}
operation = {{ input = "sun", fixed = "ring", torque = "30 N m", speeds = ["900 rpm"] }}
static = {{ flank_elements = 4, positions = 8, stresses = false }}
dynamics = {{ damping_ratio = 0.05, mesh_harmonics = 2, response_harmonics = 4 }}
housing = {{ sensor_angle = "10 deg"{bolts} }}

[sun]
teeth = {sun}
module = "2 mm"
pressure_angle = "20 deg"
profile_shift = 0.0
bore_radius = "8 mm"
fault = [{of_sun}]

[planet]
teeth = {planet}
bore_radius = "8 mm"
bearing_stiffness = "3e8 N/m"
fault = [{of_planet}]

[ring]
teeth = {ring}
outer_radius = "{outer} mm"
foundation_radial = "1e10 N/m^3"
foundation_tangential = "1e10 N/m^3"
fault = [{of_ring}]
"""
_BOLT = (
    ', nodal_diameters = 2, support = [{ angle = "20 deg", radial_stiffness = "2e8 N/m", '
    'tangential_stiffness = "1e8 N/m" }]'
)
_WORN = '{{ kind = "wear", tooth = 2, flank = "{flank}", depth = "6 um" }}'
_FLANKS = {"sun": "left", "planet": "sun side", "ring": "left"}
FAINT, PRESENT = 1e-9, 1e-5
"""Line over the largest that counts as none, and from which on it counts as there."""
_SPEED = 900 * math.pi / 30


@dataclass(frozen=True)
class FaultySet:
    """A set with a worn tooth.

    Parameters
    ----------
    teeth : (sun, planet, ring)
    planets : int
    of : str
        Gear of the worn tooth.
    bolted : bool
        Whether the ring is held by one bolt beside its foundation.
    angles : tuple of float
        Of the planets [deg]; equal ones without it.
    rotations : int
        Turns by ``2 pi/rotations`` map the places of the planets on one another.
    """

    teeth: tuple[int, int, int]
    planets: int
    of: str
    bolted: bool = False
    angles: tuple[float, ...] = ()
    rotations: int = 0

    @property
    def step(self) -> float:
        """Carrier orders of whose multiples lines are: all ``g q + m (z_s + z_r)/z_s``, ``q + m z_r/z_p`` or ``g q``.

        Of a worn tooth of the sun, of one planet, of the ring; g are the rotations, q and m any whole numbers.
        """
        (sun, planet, ring), g = self.teeth, self.rotations or self.planets
        if self.of == "sun":
            return math.gcd(g * sun, sun + ring) / sun
        return math.gcd(planet, ring) / planet if self.of == "planet" else float(g)

    @property
    def words(self) -> str:
        """What it is."""
        places = f"{self.planets} planets" + (" at unequal angles" if self.angles else "")
        return f"{'/'.join(map(str, self.teeth))}, {places}{', bolted ring' if self.bolted else ''}, tooth of {self.of}"

    @property
    def case(self) -> Any:
        """The case."""
        (sun, planet, ring), worn = self.teeth, _WORN.format(flank=_FLANKS[self.of])
        angles = ", ".join(f'"{angle} deg"' for angle in self.angles)
        values = {"sun": sun, "planet": planet, "ring": ring, "planets": self.planets, "outer": ring + 8}
        values |= {f"of_{name}": worn if name == self.of else "" for name in _FLANKS}
        values |= {"angles": f", planet_angles = [{angles}]" if angles else "", "bolts": _BOLT if self.bolted else ""}
        return parse_case(SET.format(**values), name="set")


OF_SETS = (
    FaultySet((16, 20, 56), 3, "sun"),
    FaultySet((16, 20, 56), 3, "planet"),
    FaultySet((16, 20, 56), 3, "ring"),
    FaultySet((16, 16, 48), 4, "sun", bolted=True),
    FaultySet((16, 16, 48), 4, "ring"),
    FaultySet((16, 16, 48), 4, "sun", angles=(0, 78.75, 180, 258.75), rotations=2),
    FaultySet((24, 21, 66), 5, "sun"),
    FaultySet((24, 21, 66), 5, "ring"),
)
"""Sets that are solved as elastic ones."""
OF_GEARBOXES = (OF_SETS[0], OF_SETS[1], OF_SETS[4], OF_SETS[5], OF_SETS[6])
"""Those that are solved as a planetary stage of a gearbox too."""


@cache
def lines_of_set(faulty: FaultySet) -> tuple[np.ndarray, np.ndarray]:
    """Carrier orders (k,) and complex accelerations (k,) [m/s^2] at the sensor of the elastic set."""
    exact = solve(faulty.case, "housing")["housing"].exact
    return exact.order, exact.acceleration[0]


@cache
def lines_of_stage(faulty: FaultySet) -> tuple[np.ndarray, np.ndarray]:
    """The same of the set as a stage of a gearbox, at its sensor on the ring."""
    box = parse_case(case_text.write(gearbox_of_case(faulty.case).tables), name="box")
    response = solve_gearbox_response(solve_deflection(box), [_SPEED])
    (stage,) = response.stages
    sun, _, ring = faulty.teeth
    return added(stage.order * (sun + ring) / sun, accelerations(response, 1)[stage.name][0, 0])


def added(order: np.ndarray, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Add lines (k,) that have one order."""
    orders, place = np.unique(np.round(order, 6), return_inverse=True)
    total = np.zeros(len(orders), complex)
    np.add.at(total, place, lines)
    return orders, total


def off_orders(order: np.ndarray, lines: np.ndarray, step: float) -> float:
    """Largest line that lies at no multiple of a step, over the largest of all."""
    number, size = order / step, np.abs(lines)
    return float(size[np.abs(number - np.rint(number)) > 1e-4].max(initial=0.0) / size.max())


def step_of(order: np.ndarray, lines: np.ndarray, finest: float) -> float:
    """Largest step of which all lines that are there are multiples, itself one of ``finest``."""
    there = np.abs(lines) > PRESENT * np.abs(lines).max()
    return finest * float(np.gcd.reduce(np.rint(order[there] / finest).astype(int)))


def _rows(route: str, faulty: FaultySet, order: np.ndarray, lines: np.ndarray) -> tuple[Row, ...]:
    source, finest = "L = g q + m (z_s + z_r)/z_s, q + m z_r/z_p, g q", 1.0 / math.prod(faulty.teeth[:2])
    off = off_orders(order, lines, faulty.step)
    text, words = f"{faulty.words}: largest line at another order, over the largest", "step of the lines [orders]"
    return (
        at_most(f"orders, {route}", source, text, FAINT, off),
        within(
            f"orders, {route}",
            source,
            f"{faulty.words}: {words}",
            faulty.step,
            step_of(order, lines, finest),
            1e-9,
        ),
    )


def orders_of_sets(chosen: Sequence[FaultySet] = OF_SETS) -> tuple[Row, ...]:
    """Lines of elastic sets at a fixed sensor."""
    return tuple(row for faulty in chosen for row in _rows("set", faulty, *lines_of_set(faulty)))


def orders_of_stages(chosen: Sequence[FaultySet] = OF_GEARBOXES) -> tuple[Row, ...]:
    """Lines of the same sets as planetary stages of gearboxes, and the loudest one beside that of the set."""
    rows = list[Row]()
    for faulty in chosen:
        order, lines = lines_of_stage(faulty)
        rows += _rows("stage of a gearbox", faulty, order, lines)
        rows.append(_beside_set(faulty, order, lines))
    return tuple(rows)


def _beside_set(faulty: FaultySet, order: np.ndarray, lines: np.ndarray) -> Row:
    """The loudest line of the elastic set that a whole set has not, if there is any, and the same of the gearbox."""
    orders, of_set = lines_of_set(faulty)
    healthy = faulty.rotations or faulty.planets
    fresh = np.abs(orders / healthy - np.rint(orders / healthy)) > 1e-4
    never = faulty.step % healthy == 0.0
    loudest = int(np.argmax(np.where(fresh | never, np.abs(of_set), 0.0)))
    at = int(np.abs(order - orders[loudest]).argmin())
    text = f"{faulty.words}: loudest line of the fault, order {orders[loudest]:.6g} [m/s^2]"
    source = "the elastic set, solved in modes of sun, planets, carrier and ring"
    return within("orders, stage of a gearbox", source, text, abs(of_set[loudest]), abs(lines[at]), 0.03)


PAIR = """
format = 1
model = "pair"
title = "24/36"
set = { module = "3 mm", pressure_angle = "20 deg", face_width = "20 mm" }
material = { youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }
gear_1 = { teeth = 24, profile_shift = 0.0, bore_radius = "15 mm", bearing_stiffness = "3e8 N/m" }
gear_2 = { teeth = 36, profile_shift = 0.0, bore_radius = "20 mm", bearing_stiffness = "3e8 N/m" }
operation = { torque = "100 N m", speeds = ["900 rpm"] }
static = { positions = 8, flank_elements = 4, stresses = false }
dynamics = { damping_ratio = 0.05, mesh_harmonics = 3 }
"""


@cache
def lines_of_pair(worn: tuple[int | None, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Orders (k,) of gear 1 and amplitudes (3, k) of its bearing force [N], with wear of these teeth of gear 2.

    None stands for all teeth in one entry. The pair is a gearbox.
    """
    wear = {"kind": "wear", "flank": "left", "depths": ["2 um", "9 um"], "diameters": ["104 mm", "112 mm"]}
    entries = [wear | ({} if tooth is None else {"tooth": tooth}) for tooth in worn]
    pair = with_values(parse_case(PAIR, name="pair"), {"gear_2.fault": entries})
    box = parse_case(case_text.write(gearbox_of_case(pair).tables), name="box")
    response = solve_gearbox_response(solve_deflection(box), [_SPEED])
    (stage,) = response.stages
    return stage.order, stage.motion[0, :3]


def orders_of_pair() -> tuple[Row, ...]:
    """Lines of a pair as a gearbox: of one worn tooth, and of 36 equal ones beside wear of all teeth in one entry."""
    order, lines = lines_of_pair((2,))
    name, step = "orders, pair as a gearbox", 24 / 36
    size = np.abs(lines).max(axis=0)
    words, computed_step = "24/36, tooth of gear 2: step of the lines [orders]", step_of(order, size, step / 24)
    together, each = lines_of_pair((None,)), lines_of_pair(tuple(range(36)))
    alike = np.abs(each[0][:, None] - together[0]) < 1e-6
    missed = np.abs(each[1][:, alike.argmax(axis=0)] - together[1]).max()
    other = np.abs(each[1][:, ~alike.any(axis=1)]).max()
    most, source = np.abs(together[1]).max(), "wear of all teeth in one entry, one mesh period"
    text = "24/36, 36 teeth of gear 2 worn alike in 36 entries"
    return (
        within(name, "L = m z_1/z_2", words, step, computed_step, 1e-9),
        at_most(name, source, f"{text}: lines of the mesh, largest error over the largest", 1e-6, missed / most),
        at_most(name, source, f"{text}: largest line between them, over the largest", FAINT, other / most),
    )
