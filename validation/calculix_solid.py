"""CalculiX in three dimensions: a pair of straight teeth over its width, one flank with a lead slope."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.case.planetary import Case
from femgear.fe.elasticity import Material
from femgear.gears.kinematics import orientations
from validation import calculix
from validation.calculix import MILLIMETRE, PlaneBody
from validation.calculix_rows import NEAR, PENALTY, SOURCE, STEP, where_installed
from validation.rows import Row, within

LAYERS = 4
SLICES = 24
SLOPE = 6.0
"""Lead slope of gear 1 [um]."""
SIZE = 50e-6
"""Length of the elements at the contact [m], a third of its half width."""
SIZES = 2.0, 4.0, 6.0
SPAN = 2
"""Teeth to either side of the loaded one: bores close under the teeth leave the others at rest.

In the plane the pair approaches by 0.7 % more with these alone than with all teeth, by 0.02 % with four to
either side.
"""
GATE = 0.005
"""Of K_Hbeta; loads of single layers have twice that."""
CASE = f"""
format = 1
model = "pair"
title = "Pair for CalculiX, over the width"
material = {{ youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }}
operation = {{ torque = "200 N m" }}
set = {{ module = "3 mm", pressure_angle = "20 deg", face_width = "20 mm", centre_distance = "91.5 mm" }}
static = {{ positions = 8, slices = {SLICES} }}
[gear_1]
teeth = 24
profile_shift = 0.3
bore_radius = "27 mm"
tip_diameter = "79.8 mm"
modifications = [{{ kind = "lead slope", amount = "{SLOPE} um" }}]
[gear_2]
teeth = 36
tip_diameter = "115.3786 mm"
bore_radius = "43 mm"
"""


def extruded(
    body: PlaneBody,
    name: str,
    material: Material,
    width: float,
    *,
    twist: float = 0.0,
    node: int = 0,
    element: int = 0,
) -> tuple[list[str], np.ndarray]:
    """Write a plane body as layers of wedges of 15 nodes between mirror planes, numbered after those given.

    Parameters
    ----------
    body : PlaneBody
    name : str
    material : Material
    width : float
        [m], the middle at zero.
    twist : float
        Angle by which the end z > 0 is turned about the origin beyond the other end [rad].
    node, element : int

    Returns
    -------
    lines : list of str
        With surfaces ``S<name>L<layer>`` of "contact 0" and the nodes of the rim as set ``RIM<name>``.
    numbers : (2 LAYERS + 1, n) int array
        Node numbers at heights; zero amid layers for the middles of sides.
    """
    levels, corner = 2 * LAYERS + 1, np.zeros(len(body.points), bool)
    corner[body.triangles[:, :3]] = True
    there = np.ones((levels, len(corner)), bool)
    there[1::2] = corner
    numbers = np.where(there, node + np.cumsum(there).reshape(there.shape), 0)
    lines = [f"*NODE, NSET=N{name}"]
    for level, part in zip(numbers, np.linspace(-0.5, 0.5, levels), strict=True):
        points = MILLIMETRE * calculix._turned(body.points, part * twist)
        z = MILLIMETRE * part * width
        lines += [f"{n},{x:.14g},{y:.14g},{z:.14g}" for n, (x, y) in zip(level, points, strict=True) if n]
    lines.append(f"*ELEMENT, TYPE=C3D15, ELSET=E{name}")
    count = len(body.triangles)
    for layer in range(LAYERS):
        below, middle, above = numbers[2 * layer : 2 * layer + 3]
        for i, nodes in enumerate(body.triangles):
            corners, sides = nodes[:3], nodes[3:]
            parts = below[corners], above[corners], below[sides], above[sides], middle[corners]
            row = ",".join(map(str, np.concatenate(parts)))
            lines.append(f"{element + layer * count + i + 1},{row}")
    E, nu = 1e-6 * material.youngs_modulus, material.poisson_ratio
    lines += [
        f"*MATERIAL, NAME=M{name}\n*ELASTIC\n{E:.12g},{nu:.12g}",
        f"*SOLID SECTION, ELSET=E{name}, MATERIAL=M{name}",
        f"*NSET, NSET=ENDS{name}",
        *map(str, numbers[[0, -1]].ravel()),
        f"*NSET, NSET=RIM{name}",
    ]
    rim = numbers[:, np.unique(body.edges["rim"])].ravel()
    lines += map(str, rim[rim > 0])
    for layer in range(LAYERS):
        surface = calculix.surface_input(
            body, f"S{name}L{layer}", body.edges["contact 0"], element=element + layer * count
        )
        # the sides of a wedge are its faces 3, 4 and 5
        lines += [surface[0], *(f"{row[:-1]}{int(row[-1]) + 2}" for row in surface[1:])]
    return lines, numbers


@dataclass(frozen=True)
class SolidContact:
    """Torque on gear 1 (s,) [N m], and its share of every layer (s, layers) [N m]."""

    torque: np.ndarray
    layer_torque: np.ndarray


def solid_contact(
    bodies: Sequence[PlaneBody],
    approach: Sequence[float],
    *,
    base_radius: float,
    width: float,
    material: Material,
    slope: float,
    penalty: float,
) -> SolidContact:
    """Solve two extruded gears in contact: rim of the first turned, that of the second held.

    Parameters
    ----------
    bodies : two PlaneBody
        In place, touching; the first about the origin.
    approach : sequence of float
        Rotations of the first gear as paths along the line of action [m].
    base_radius, width : float
        Base radius of the first gear and face width [m].
    material : Material
    slope : float
        Rise of the flank of the first gear over the width [m].
    penalty : float
        Contact pressure over overclosure [Pa/m].
    """
    first, numbers = extruded(bodies[0], "1", material, width, twist=slope / base_radius)
    after = {"node": int(numbers.max()), "element": LAYERS * len(bodies[0].triangles)}
    lines = first + extruded(bodies[1], "2", material, width, **after)[0]
    lines += calculix.contact_input([f"S1L{layer},S2L{layer}" for layer in range(LAYERS)], penalty)
    lines.append("*BOUNDARY\nRIM2,1,3\nRIM1,3,3\nENDS1,3,3\nENDS2,3,3")
    rim = np.unique(bodies[0].edges["rim"])
    levels, nodes = np.nonzero(numbers[:, rim])
    nodes = rim[nodes]
    for path in approach:
        lines += calculix.turned_input(numbers[levels, nodes], bodies[0].points[nodes], path / base_radius)
        for layer in range(LAYERS):
            surfaces = f"SLAVE=S1L{layer}, MASTER=S2L{layer}"
            lines.append(f"*CONTACT PRINT, {surfaces}, FREQUENCY={calculix.LAST}\nCF")
        lines.append("*END STEP")
    torque = contact_moments(calculix.run("\n".join(lines) + "\n").tables)
    layers = 1e-3 * np.abs(torque).reshape(len(approach), LAYERS)
    return SolidContact(layers.sum(axis=1), layers)


def contact_moments(text: str) -> np.ndarray:
    """Read the moments about z of all contact surfaces, in the order of the tables [N mm]."""
    forces = re.findall(r"total surface force[^\n]*\n\s*([^\n]+)\n", text)
    return np.array([float(row.split()[5]) for row in forces])


def over_width(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Load of every layer over their mean by CalculiX and by femgear, at position 0 with one tooth pair."""
    from femgear.case.gear_set import gear_material
    from femgear.stages.static import solve_static

    static = solve_static(case)
    cycle, gears = static.cycle, static.planetary_set
    load = cycle.slice_load[0, :, :, 0]
    tooth = load.sum(axis=1).argmax()
    ours = load[tooth].reshape(LAYERS, -1).mean(axis=1)
    first, second = gears.kinds[0].gears
    angles = [of_gear[0] for of_gear in orientations(gears, 0.0).gears]
    approach, centre = cycle.deflection[0, 0], gears.centre_distance
    (mates,) = calculix.near_teeth((first, second), angles, centre, within=NEAR * approach)
    bodies = [
        calculix.whole_gear(
            gear, "left", {mates.teeth[number]: mates.rolls[number]}, size=SIZE, sizes=SIZES, span=SPAN
        ).turned(angles[number], (place, 0.0))
        for number, (gear, place) in enumerate(((first, 0.0), (second, centre)))
    ]
    contact = solid_contact(
        bodies,
        approach * np.array([1.0 - STEP, 1.0 + STEP]),
        base_radius=first.base_radius,
        width=first.face_width,
        material=gear_material(case, "gear_1"),
        slope=1e-6 * SLOPE,
        penalty=PENALTY,
    )
    part = (static.sun_torque - contact.torque[0]) / np.diff(contact.torque)[0]
    theirs = contact.layer_torque[0] + part * np.diff(contact.layer_torque, axis=0)[0]
    return theirs / theirs.mean(), ours / ours.mean()


@where_installed
def face_load() -> tuple[Row, ...]:
    """Load over the width of one tooth pair under a lead slope, in three dimensions between mirror planes."""
    from femgear.trains.reading import parse_case

    expected, record = over_width(parse_case(CASE, name="wide pair"))
    name = f"24/36, lead slope of {SLOPE:g} um, {LAYERS} layers of wedges between mirror planes: "
    note = f"mean load of a layer; femgear has {SLICES} slices"
    rows = [within("width", SOURCE, name + "K_Hbeta", expected.max(), record.max(), GATE, note=note)]
    for i, (theirs, ours) in enumerate(zip(expected, record, strict=True)):
        text = f"{name}load of layer {i + 1} over the mean"
        rows.append(within("width", SOURCE, text, theirs, ours, 2 * GATE))
    return tuple(rows)
