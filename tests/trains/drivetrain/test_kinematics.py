"""Planetary stages of a chain whose planets have other teeth than (z_r - z_s)/2, against closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest

from femgear.errors import CaseError, FemgearError
from femgear.findings import DOUBT
from femgear.trains.drivetrain.kinematics import coordinates_of, mesh_geometry, rigid_rotation
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    MeshSection,
    PlanetarySection,
)
from femgear.trains.reading import parse_case, with_values

SUN, PLANET, RING = 19, 17, 56  # first stage of a 5 MW wind turbine, m = 45 mm
GRC = Path(__file__).parents[3] / "cases" / "grc_like_drivetrain.toml"
COSINE = math.cos(math.radians(20.0))
MESH = MeshSection.in_si(stiffness=1e9, contact_ratio=1.3)
BASE = [0.5 * 0.045 * z * COSINE for z in (SUN, PLANET, RING)]


def stage_of(**sizes):
    return PlanetarySection.in_si(
        carrier="carrier",
        sun="sun",
        ring_teeth=RING,
        sun_teeth=SUN,
        planet_mass=100.0,
        planet_inertia=10.0,
        sun_mesh=MESH,
        ring_mesh=MESH,
        **sizes,
    )


def train_of(stage):
    bodies = tuple(BodySection.in_si(name=name, inertia=10.0, mass=100.0, tilts=False) for name in ("carrier", "sun"))
    bearings = tuple(BearingSection.in_si(body=name, radial=1e9) for name in ("carrier", "sun"))
    return Drivetrain(bodies, planetary=(stage,), bearings=bearings)


WAYS = {
    "module": {"module": 0.045, "centre_distance": 0.84},
    "half-way": {"module": 0.045},
    "base radii": {"sun_base_radius": BASE[0], "planet_base_radius": BASE[1], "centre_distance": 0.83},
    # rounded: the ratio of the teeth counts
    "pitch radii": {"sun_radius": 0.4434, "planet_radius": 0.3966, "pressure_angle": math.radians(25.0)},
}


@pytest.mark.parametrize("bearing", [math.inf, 1e9])
@pytest.mark.parametrize("way", WAYS)
def test_speeds_are_those_of_willis_by_the_teeth(way, bearing):
    stage = stage_of(planet_teeth=PLANET, planet_bearing=bearing, **WAYS[way])
    train = train_of(stage)
    place = coordinates_of(train)
    spin = rigid_rotation(train, place)
    carrier, sun, planet = (spin[i] for i in (place.body["carrier"] + 4, place.body["sun"] + 4, place.planets[0][0, 2]))
    assert sun / carrier == pytest.approx(1.0 + RING / SUN, rel=1e-12)
    assert (planet - carrier) / (sun - carrier) == pytest.approx(-SUN / PLANET, rel=1e-12)
    # the free spin presses no flank: base radii, centre distance and working angles belong together
    closing = mesh_geometry(train, place, spin).frozen.T @ spin
    assert np.abs(closing).max() < 1e-12


def test_base_radii_are_those_of_the_teeth():
    stage = stage_of(planet_teeth=PLANET, **WAYS["module"])
    assert stage.base_radii == pytest.approx(BASE, rel=1e-12)
    assert 1e3 * stage.base_radii[1] == pytest.approx(359.43, abs=5e-3)
    # ISO 21771: a cos(alpha_w) is the sum or the difference of the base radii, d_w = 2 r_b / cos(alpha_w)
    sun, ring = stage.working_angles
    assert 0.84 * math.cos(sun) == pytest.approx(BASE[0] + BASE[1])
    assert 0.84 * math.cos(ring) == pytest.approx(BASE[2] - BASE[1])
    assert stage.pitch_radii[0] == pytest.approx(BASE[0] / math.cos(sun))
    assert stage.ring_radius == pytest.approx(BASE[2] / math.cos(ring))
    radii = stage_of(planet_teeth=PLANET, **WAYS["base radii"])
    assert radii.base_radii == pytest.approx(BASE)
    assert radii.axis_distance == 0.83
    assert stage_of(planet_teeth=PLANET, module=0.045).axis_distance == pytest.approx(0.84375)


def test_without_shift_nothing_changes():
    stage = PlanetarySection.in_si(
        carrier="c",
        sun="s",
        ring_teeth=99,
        sun_teeth=21,
        planet_teeth=39,
        module=0.01,
        planet_mass=1.0,
        planet_inertia=1.0,
        sun_mesh=MESH,
        ring_mesh=MESH,
    )
    assert stage.axis_distance == pytest.approx(0.3)
    assert (*stage.pitch_radii, stage.ring_radius) == pytest.approx((0.105, 0.195, 0.495))
    assert stage.working_angles == pytest.approx([math.radians(20.0)] * 2)
    assert stage.changed(planet_teeth=None).base_radii == pytest.approx(stage.base_radii)


def grc(**changes):
    values = {f"planetary[0].{key}": value for key, value in changes.items()}
    return with_values(parse_case(GRC.read_text(encoding="utf-8")), values)


def test_a_distance_that_nobody_gave_is_said():
    found = [one for one in grc(planet_teeth=38).notices if one.code == "W-TEETH"]
    assert [(one.key, one.severity) for one in found] == [("planetary[0].centre_distance", DOUBT)]
    assert "308 mm" in str(found[0])
    given = grc(planet_teeth=38, centre_distance="305 mm")
    assert not [one for one in given.notices if one.code == "W-TEETH"]
    assert given.planetary[0].axis_distance == 0.305


@pytest.mark.parametrize(
    ("changes", "code", "key"),
    [
        ({"planet_teeth": None, "ring_teeth": 96}, "E-KEY-MISSING", "planet_teeth"),
        ({"planet_teeth": 38, "centre_distance": "250 mm"}, "E-CENTRE-DISTANCE", "centre_distance"),
        ({"centre_distance": "600 mm"}, "E-CENTRE-DISTANCE", "centre_distance"),
        (
            {"module": None, "sun_radius": "107.8 mm", "planet_radius": "200.2 mm", "centre_distance": "308 mm"},
            "E-CHOICE",
            "centre_distance",
        ),
    ],
)
def test_what_makes_no_planets_is_refused(changes, code, key):
    with pytest.raises(FemgearError) as caught:
        grc(**changes)
    problems = [error for error in caught.value.problems if isinstance(error, CaseError)]
    assert (code, f"planetary[0].{key}") in [(one.code, one.key) for one in problems]


def test_true_base_radii_of_shifted_gears_are_read():
    base = [0.5 * 0.01 * z * math.cos(math.radians(24.6)) for z in (21, 38)]
    case = grc(
        module=None,
        planet_teeth=38,
        sun_base_radius=f"{base[0]!r} m",
        planet_base_radius=f"{base[1]!r} m",
        centre_distance="298 mm",
    )
    assert case.planetary[0].base_radii == pytest.approx([*base, base[0] * 99 / 21])
