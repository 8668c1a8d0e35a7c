"""The casing of the electric axle: its file against integrals over its volume, and against CalculiX."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from femgear.exchange.superelement import Superelement, read_superelement
from femgear.fe.beam import rigid_link
from validation import calculix
from validation.calculix import MILLIMETRE
from validation.calculix_casing import meshed_solid, solid_input
from validation.calculix_rows import SOURCE, where_installed
from validation.rows import Row, at_most, within

SHIPPED = Path(__file__).resolve().parents[1] / "cases" / "casings"
NAME = "casing of scripts/e_axle_casing.py"
SIZE, AROUND = 0.0095, 20
"""Length of the elements [m], and their least number on a circle."""
MODES, COMPARED = 18, 10
FREQUENCY_GATE, COMPLIANCE_GATE, VOLUME_GATE = 0.005, 0.02, 1e-5
PAIRS = (("A", "C", 0), ("B", "D", 1), ("ring of second stage", "F", 1), ("E", "F", 0))
"""Seats that are pressed apart along an axis, with the moment that balances their forces on the second one."""
# What Open CASCADE has for every volume of a geometry: volume, centre, tensor of inertia of a density of one.
VOLUMES = """import json, sys, gmsh
gmsh.initialize(); gmsh.option.setNumber("General.Terminal", 0); gmsh.open(sys.argv[1])
occ = gmsh.model.occ
rows = [[occ.getMass(*tag), *occ.getCenterOfMass(*tag), *occ.getMatrixOfInertia(*tag)] for tag in occ.getEntities(3)]
print("\\n" + json.dumps(rows))
"""


def shipped_casing() -> Superelement:
    """Read the casing of cases/e_axle_in_a_casing.toml."""
    return read_superelement(SHIPPED / "e_axle.npz", SHIPPED / "e_axle.csv")


def volume_integrals() -> np.ndarray:
    """Compute the mass (6, 6) of the exact geometry about the origin, by Open CASCADE [kg, kg m, kg m^2]."""
    from e_axle_casing import ALUMINIUM, STEEL, Box, geometry, in_ring

    with TemporaryDirectory() as folder:
        source = Path(folder) / "solid.geo"
        source.write_text(geometry(Box()), encoding="utf-8")
        words = [sys.executable, "-c", VOLUMES, str(source)]
        text = subprocess.run(words, check=True, capture_output=True, text=True, timeout=300).stdout
    volumes = np.array(json.loads(text.splitlines()[-1]))
    smallest = volumes[:, 0].argmin()  # its centre lies on the axis, in no material
    assert in_ring(volumes[smallest, 1:4, None]).all()
    total = np.zeros((6, 6))
    for number, (volume, *rest) in enumerate(volumes):
        density = (STEEL if number == smallest else ALUMINIUM)[2]
        mass = np.zeros((6, 6))
        mass[:3, :3], mass[3:, 3:] = density * volume * np.eye(3), density * np.reshape(rest[3:], (3, 3))
        # motions of the centre by those of the origin
        shift = rigid_link(np.array(rest[:3]))
        total += shift.T @ mass @ shift
    return total


def rigid_body() -> tuple[Row, ...]:
    """Mass, centre of mass and inertia of the file against the integrals over the volume."""
    body = shipped_casing()
    rigid = body.rigid_motions(np.zeros(3))
    ours, expected = rigid.T @ body.mass @ rigid, volume_integrals()
    source = "volume integrals by Open CASCADE"
    apart = np.abs(ours - expected)
    length = np.sqrt(np.trace(expected[3:, 3:]) / np.trace(expected[:3, :3]))
    return (
        within("casing", source, f"{NAME}: mass [kg]", expected[0, 0], ours[0, 0], VOLUME_GATE),
        at_most(
            "casing",
            source,
            f"{NAME}: static moments about the origin, difference over mass times radius of inertia",
            VOLUME_GATE,
            apart[:3, 3:].max() / (expected[0, 0] * length),
        ),
        at_most(
            "casing",
            source,
            f"{NAME}: tensor of inertia about the origin, difference over its largest entry",
            VOLUME_GATE,
            apart[3:, 3:].max() / expected[3:, 3:].max(),
        ),
    )


def _pair_loads(weights: dict[str, np.ndarray], places: dict[str, np.ndarray]) -> list[np.ndarray]:
    """Nodal forces of one newton on each of two seats against one another, and of the moment between them.

    ``weights`` (n, ..., 6) turn forces and moments on a seat into those of coordinates.
    """
    loads = []
    for first, second, axis in PAIRS:
        force = np.zeros(6)
        force[axis] = 1.0
        # what a rigid link from the first seat brings to the second one
        back = -rigid_link(places[first] - places[second]).T @ force
        loads.append(weights[first] @ force + weights[second] @ back)
    return loads


def file_compliances(body: Superelement) -> np.ndarray:
    """Compute how far pairs of seats yield under their own forces [m/N], by a superelement that nothing holds."""
    weights, places = {}, {}
    for name, node in body.of_role("seat").items():
        weights[name] = np.zeros((len(body.stiffness), 6))
        weights[name][[body.row[node.number, c] for c in range(1, 7)]] = np.eye(6)
        places[name] = body.place[node.number]
    rigid = body.rigid_motions(np.zeros(3))
    held = body.stiffness + (body.mass @ rigid) @ (body.mass @ rigid).T * 1e8
    return np.array([load @ np.linalg.solve(held, load) for load in _pair_loads(weights, places)])


def free_casing(size: float = SIZE, around: int = AROUND) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] and compliances of pairs of seats [m/N] of the free casing by CalculiX."""
    from carrier import mean_motions
    from e_axle_casing import ALUMINIUM, SEATS, STEEL, Box, geometry, in_ring, on_bore, seat_places

    points, solids, triangles = meshed_solid(geometry(Box(size=size, around=around)))
    places, weights = seat_places(), {}
    for name, (radius, _, half) in SEATS.items():
        corners = np.moveaxis(points[triangles[:, :3]], 2, 0).swapaxes(1, 2)
        chosen = on_bore(corners - places[name][:, None, None], radius=radius, half=half)
        weights[name] = mean_motions(points, triangles[chosen], places[name])
    young, poisson, density = ALUMINIUM
    lines = solid_input(points, solids, young=young, poisson=poisson, density=density)
    ring = np.flatnonzero(in_ring(points[solids[:, :4]].mean(axis=1).T))
    lines[-1] = "*SOLID SECTION, ELSET=BOX, MATERIAL=STEEL"  # the name of solid_input for its material
    young, poisson, density = STEEL
    rest = np.setdiff1d(np.arange(len(solids)), ring)
    lines += ["*ELSET, ELSET=BOX", *(f"{i + 1}," for i in rest), "*ELSET, ELSET=RING", *(f"{i + 1}," for i in ring)]
    lines += [
        f"*MATERIAL, NAME=GEAR\n*ELASTIC\n{1e-6 * young:.12g},{poisson:.12g}\n*DENSITY\n{1e-12 * density:.9g}",
        "*SOLID SECTION, ELSET=RING, MATERIAL=GEAR",
    ]
    loads = _pair_loads(weights, places)
    touched = np.unique(np.concatenate([np.flatnonzero(load.any(axis=1)) for load in loads]))
    lines += ["*NSET, NSET=SEATS", *(f"{i + 1}," for i in touched)]
    lines.append(f"*STEP\n*FREQUENCY\n{MODES}\n*END STEP")
    frequencies = calculix.frequencies(calculix.run("\n".join(lines) + "\n").tables)
    # three nodes hold it without a force
    used = np.unique(solids)
    first, two, three = (
        used[(points[used] @ np.array(way)).argmax()] + 1 for way in ((0, 0, 1), (0, 0, -1), (1, 0, 0))
    )
    lines[-1] = f"*BOUNDARY\n{first},1,3\n{two},1,2\n{three},2,2"
    for load in loads:
        lines.append("*STEP\n*STATIC\n*CLOAD, OP=NEW")
        lines += [f"{i + 1},{c + 1},{1e6 * load[i, c]:.12g}" for i, c in np.argwhere(load)]
        lines.append("*NODE PRINT, NSET=SEATS\nU\n*END STEP")
    compliance = []
    output = calculix.run("\n".join(lines) + "\n").tables
    for load, rows in zip(loads, calculix.tables(output, "displacements"), strict=True):
        moved = np.zeros((len(points), 3))
        moved[rows[:, 0].astype(int) - 1] = 1e-6 / MILLIMETRE * rows[:, 1:]
        compliance.append((load * moved).sum())
    return frequencies, np.array(compliance)


@where_installed
def axle_casing() -> tuple[Row, ...]:
    """The casing of the electric axle, held nowhere: natural frequencies, and seats pressed apart."""
    from e_axle_casing import free_frequencies

    body = shipped_casing()
    ours, compliances = free_frequencies(body)[:COMPARED], file_compliances(body)
    frequencies, expected = free_casing()
    elastic = frequencies[frequencies > 100.0][:COMPARED]
    rows = [
        within("casing", SOURCE, f"{NAME}, free: natural frequency {i + 1} [Hz]", theirs, value, FREQUENCY_GATE)
        for i, (theirs, value) in enumerate(zip(elastic, ours, strict=True))
    ]
    for (first, second, axis), theirs, value in zip(PAIRS, expected, compliances, strict=True):
        words = f"{NAME}, free: {first} pressed away from {second} along {'xyz'[axis]} [um/kN]"
        rows.append(within("casing", SOURCE, words, 1e9 * theirs, 1e9 * value, COMPLIANCE_GATE))
    return tuple(rows)
