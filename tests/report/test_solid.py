"""The set in space: paths of contact, amplitudes of modes body by body, hands of helical teeth."""

import math
from pathlib import Path

import numpy as np
import pytest
import synthetic_results as synthetic

from femgear.case.gear_set import materials_of, planetary_set
from femgear.contact.bodies import make_sectors
from femgear.contact.tooth_loads import DeformedBody
from femgear.report.solid import _paths, solid
from femgear.trains.reading import read_case

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"


@pytest.fixture(scope="module")
def drawn():
    """Return what makes the model of the shipped set, at rest, of coarse sectors."""
    case = read_case(CASE)
    gears = planetary_set(case)
    sectors = make_sectors(gears, materials_of(case), flank_elements=4, refine=0.3)
    of_kind = {sector.gear.name: sector for sector in sectors.gears}
    places = [("sun", "sun", 0j), ("ring", "ring", 0j)]
    pins = gears.centre_distance * np.exp(1j * np.array(gears.planet_angles))
    places += [(f"planet {n + 1}", "planet", pin) for n, pin in enumerate(pins)]
    bodies = [
        DeformedBody(
            name,
            kind,
            np.array([pin.real, pin.imag]),
            0.1,
            np.zeros((of_kind[kind].gear.teeth, of_kind[kind].grid.n_nodes, 2)),
        )
        for name, kind, pin in places
    ]
    grids = {kind: sector.grid for kind, sector in of_kind.items()}
    materials = dict(zip(of_kind, materials_of(case), strict=True))
    return gears, lambda modes=None, **look: solid(gears, grids, bodies, materials, modes, **look)


def test_bodies_move_in_modes_as_much_as_modes_nc_says(drawn):
    """Largest motion of every body: of a disc |u| + |theta| r, of the ring that of its outer surface [mm]."""
    gears, model = drawn
    modes, found = synthetic.modes(), model(synthetic.modes())
    radii = {"sun": gears.sun.tip_radius, "planet": gears.planet.tip_radius, "carrier": gears.centre_distance}
    angle = np.linspace(0.0, 2 * np.pi, 721)
    wave = np.exp(1j * np.outer(angle, modes["circumferential"].values))
    assert len(found["modes"]) > 8
    for mode in found["modes"]:
        number = int(mode["title"].split(":")[0]) - 1
        shape = dict(zip(modes["dof"].values.tolist(), modes["shape"].values[:, number].tolist()))
        for name, (x, y, turn) in mode["bodies"].items():
            if (radius := radii.get(name.split()[0])) is None:
                continue
            true = [shape.get(f"{name}: {axis}", 0.0) for axis in ("x", "y", "rotation")]
            wanted = 1e3 * (math.hypot(*true[:2]) + abs(true[2]) * radius)
            assert math.hypot(x, y) + abs(turn) * 1e3 * radius == pytest.approx(wanted, rel=1e-6, abs=1e-9)
        ring = np.zeros((2, len(angle)))
        for n, *parts in mode["ring"]:
            for row, (real, imaginary) in enumerate((parts[:2], parts[2:])):
                ring[row] += real * np.cos(n * angle) - imaginary * np.sin(n * angle)
        for row, part in zip(ring, ("ring_shape", "ring_tangential_shape")):
            values = modes[f"{part}_real"].values[number] + 1j * modes[f"{part}_imag"].values[number]
            np.testing.assert_allclose(row, 1e3 * (wave @ values).real, atol=1e-3 * np.abs(ring).max() + 1e-9)


def test_faulty_teeth_are_marked_on_their_bodies(drawn):
    bodies = {body["name"]: body["marked"] for body in drawn[1](marked={"planet 2": ((3, "crack"),)})["bodies"]}
    assert bodies["planet 2"] == [[3, "crack"]] and not bodies["planet 1"] and not bodies["sun"]


def test_helical_teeth_turn_along_the_width_by_their_lead(drawn):
    """A lead is pi d / tan(beta): external mates are of opposite hands, the ring of that of its planets."""
    gears, model = drawn
    sectors, angle = model(helix_angle=math.radians(20.0))["sectors"], math.radians(20.0)
    twist = {kind: sector["twist"] for kind, sector in sectors.items()}
    for gear, hand in ((gears.sun, 1), (gears.planet, -1), (gears.ring, -1)):
        lead = math.pi * 2.0 * gear.reference_radius / math.tan(angle)
        assert twist[gear.name] == pytest.approx(hand * 2.0 * math.pi * gear.face_width / lead)
    # teeth that touch stay together over the width
    arcs = [twist[gear.name] * gear.reference_radius for gear in (gears.sun, gears.planet, gears.ring)]
    assert arcs == pytest.approx([arcs[0], -arcs[0], -arcs[0]])
    assert {sector["twist"] for sector in model()["sectors"].values()} == {0.0}


def test_pins_stand_in_their_planets(drawn):
    gears, model = drawn
    pins = model()["pins"]
    assert 0.0 < pins["radius"] < 1e3 * gears.planet.rim_radius
    assert [math.hypot(*centre) for centre in pins["centres"]] == pytest.approx([1e3 * gears.centre_distance] * 3)


@pytest.mark.parametrize("backwards", (False, True))
def test_paths_of_contact(backwards):
    s = planetary_set(read_case(CASE))
    found = 1e-3 * np.array(_paths(s, backwards=backwards)).reshape(2, s.n_planets, 2, 2)
    for n, psi in enumerate(s.planet_angles):
        pin = s.centre_distance * np.array([math.cos(psi), math.sin(psi)])
        for (first, last), base in zip(found[:, n], (s.sun.base_radius, s.ring.base_radius)):
            direction = (last - first) / math.dist(first, last)
            for centre, radius in ((0.0, base), (pin, s.planet.base_radius)):
                aside = first - centre
                distance = abs(aside[0] * direction[1] - aside[1] * direction[0])
                assert distance == pytest.approx(radius, rel=1e-4)
        # planet tip to sun tip, ring tip to planet tip
        (a, b), (c, d) = found[:, n]
        tips = (a - pin, s.planet), (b, s.sun), (c, s.ring), (d - pin, s.planet)
        for place, gear in tips:
            assert math.hypot(*place) == pytest.approx(gear.tip_radius, rel=1e-4)
