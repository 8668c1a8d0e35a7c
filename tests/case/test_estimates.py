"""What a case may leave out, the estimates in its place, and the forms in which cases are read."""

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from femgear.case.dependencies import static_entries
from femgear.case.estimates import cylinder, estimated_mesh_stiffness, estimates, gear_cylinder, usual_rim, usual_torque
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import to_si
from femgear.errors import CaseError
from femgear.gears.tooth import half_sector
from femgear.trains.reading import case_schema, read_case, with_value, with_values

CASES = Path(__file__).parents[2] / "cases"
REFERENCE = CASES / "planetary_27_40_108.toml"
BODIES = ("mass", "inertia", "support_stiffness")
LEFT_OUT = {
    **{f"sun.{key}": None for key in BODIES},
    **{f"planet.{key}": None for key in ("mass", "inertia", "bearing_stiffness")},
    **{f"ring.foundation_{key}": None for key in ("radial", "tangential")},
    "carrier": None,
}


@pytest.fixture(scope="module")
def case():
    return read_case(REFERENCE)


@pytest.mark.parametrize("name", ["planetary_27_40_108", "nrel_pgb_static", "spur_pair"])
def test_cylinders_are_as_heavy_as_the_teeth_that_they_stand_for(name):
    """Area and second moment of the true outline, by Green's theorem, times density and width."""
    gears = planetary_set(read_case(CASES / f"{name}.toml"))
    for gear in gears.gears:
        x, y = np.vstack([points[:-1] for _, points in half_sector(gear).curves]).T
        cross = x * np.roll(y, -1) - np.roll(x, -1) * y
        moments = sum(u * u + u * np.roll(u, -1) + np.roll(u, -1) ** 2 for u in (x, y))
        sectors = 7850.0 * gear.face_width * 2 * gear.teeth
        mass, inertia = sectors * abs(cross.sum()) / 2.0, sectors * abs((cross * moments).sum()) / 12.0
        made = gear_cylinder(gear, 7850.0)
        assert made[0] == pytest.approx(mass, rel=0.05) and made[1] == pytest.approx(inertia, rel=0.06)
    ring = cylinder(0.1, 0.2, 0.3, 7850.0)
    slices = np.linspace(-0.15, 0.15, 3001)
    tilted = np.trapezoid(ring[1] / 0.3 / 2.0 + ring[0] / 0.3 * slices**2, slices)
    assert ring[2] == pytest.approx(tilted, rel=1e-6)


def test_estimates_against_published_sets(case):
    """Planets of Kahraman's train; carriers to a factor of two, of his and the NREL sets."""
    train = read_case(CASES / "helical_30_20_70.toml")
    assert estimates(train)["planet.inertia"].value == pytest.approx(2.56e-5, rel=0.01)
    for name in ("helical_30_20_70", "nrel_pga", "nrel_pgb"):
        one = read_case(CASES / f"{name}.toml")
        assert 0.5 < estimates(one)["carrier.mass"].value / one.carrier.mass < 2.0, name
    found = estimates(case)
    assert found["planet.mass"].value == pytest.approx(case.planet.mass, rel=2e-3)
    assert found["planet.inertia"].value == pytest.approx(case.planet.inertia, rel=2e-3)


def test_stiffnesses_are_those_of_lin_and_parker_over_their_mesh(case):
    """Bearings and supports of 1e8 N/m with meshes of 5e8 N/m, which 25 mm of steel have."""
    found, width = estimates(case), case.set.face_width
    assert estimated_mesh_stiffness(206e9, 206e9, width) == pytest.approx(5e8)
    for key in ("sun.support_stiffness", "carrier.support_stiffness", "planet.bearing_stiffness"):
        assert found[key].value == pytest.approx(1e8)
    # a ring that moves as a whole feels (k_r + k_t)/2 over its outer surface
    both = sum(found[f"ring.foundation_{key}"].value for key in ("radial", "tangential"))
    assert 0.5 * both * 2.0 * math.pi * case.ring.outer_radius * width == pytest.approx(1e8)
    soft = with_value(case, "material.youngs_modulus", "103 GPa")
    assert estimates(soft)["planet.bearing_stiffness"].value == pytest.approx(5e7)


def test_usual_torque_and_rim():
    torque = usual_torque(20, 30, 2e-3, 24e-3, 3)
    force = torque / 3 / 20e-3
    assert force / (24e-3 * 40e-3) * (1.5 + 1.0) / 1.5 == pytest.approx(1e6)
    radius, root = usual_rim(20, 2e-3, 1.25, internal=False)
    assert root == pytest.approx(17.5e-3) and root - radius == pytest.approx(6e-3)
    radius, root = usual_rim(60, 2e-3, 1.25, 0.1, internal=True)
    assert root == pytest.approx(62.7e-3) and radius - root == pytest.approx(8e-3)


def test_what_is_left_out_is_estimated_and_told(case):
    bare, known = with_values(case, LEFT_OUT), estimates(case)
    (said,) = [one for one in bare.notices if one.code == "W-ESTIMATED"]
    for key in ("sun.mass", "carrier.inertia", "planet.bearing_stiffness", "ring.foundation_radial"):
        section, _, name = key.partition(".")
        assert getattr(getattr(bare, section), name) == known[key].value
        assert f"{key} = {known[key]}" in said.text
        assert to_si(str(known[key]), known[key].dimension) == pytest.approx(known[key].value, rel=1e-3)
    assert not [one for one in case.notices if one.code == "W-ESTIMATED"]
    # static results with fixed members are those of the full case
    assert static_entries(bare) == static_entries(case)


def test_only_what_is_left_out_is_estimated(case):
    some = with_values(case, {"sun.mass": None, "sun.support_stiffness": "0 N/m"})
    assert some.sun.support_stiffness == 0.0 and some.sun.inertia == case.sun.inertia
    (said,) = [one for one in some.notices if one.code == "W-ESTIMATED"]
    assert said.key == "sun.mass" and "inertia" not in said.text
    shaft = [{"length": "60 mm", "outer_diameter": "30 mm"}]
    held = with_values(case, {"carrier.support_stiffness": None, "carrier.support_shaft": shaft})
    assert not [one for one in held.notices if one.code == "W-ESTIMATED"]


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("nrel_pgb", {"planar.ring": None}),
        ("helical_30_20_70", {f"helical.{body}": None for body in ("sun", "ring", "carrier", "planet")}),
    ],
)
def test_rigid_bodies_may_be_left_out_too(name, changes):
    case = read_case(CASES / f"{name}.toml")
    loose = {key: None for key in LEFT_OUT if not key.startswith("ring.")}
    bare = with_values(case, changes | loose)

    def numbers(value):
        if isinstance(value, dict):
            return [one for inner in value.values() for one in numbers(inner)]
        return [value] if isinstance(value, float) else []

    assert all(map(math.isfinite, numbers(bare.model_dump()))) and numbers(bare.model_dump())
    section = next(iter(changes)).partition(".")[0]
    assert any(one.code == "W-ESTIMATED" and f"{section}.ring.mass" in one.text for one in bare.notices)


def test_masses_of_a_pair_are_estimated_and_told_too():
    pair = read_case(CASES / "spur_pair.toml")
    (said,) = [one for one in pair.notices if one.code == "W-ESTIMATED"]
    known = estimates(pair)
    for name in pair.gear_names:
        for key in ("mass", "inertia"):
            assert getattr(getattr(pair, name), key) == known[f"{name}.{key}"].value
            assert f"{name}.{key} = {known[f'{name}.{key}']}" in said.text
    assert "bearing_stiffness" not in said.text and pair.gear_1.bearing_stiffness is None
    given = with_values(pair, {"gear_1.mass": "1 kg", "gear_1.inertia": "1e-3 kg m^2"})
    assert given.gear_1.mass == 1.0 and given.gear_2.mass == pair.gear_2.mass
    (said,) = [one for one in given.notices if one.code == "W-ESTIMATED"]
    assert "gear_1" not in said.text


def test_gears_that_cannot_be_made_are_refused_where_they_are_needed(case):
    with pytest.raises(Exception, match="E-ASSEMBLY") as caught:
        with_values(case, {"set.planets": 4, "sun.mass": None})
    assert caught.value.key == "set.planets"


def test_the_schema_is_json_and_requires_no_estimate():
    schema = json.loads(json.dumps(case_schema(), allow_nan=False))
    assert "mass" not in schema["$defs"]["SunSection"]["required"] and "carrier" not in schema["required"]
    assert schema["$defs"]["SunSection"]["required"] == ["teeth", "module", "pressure_angle", "bore_radius"]


def test_cases_are_read_from_paths_texts_and_tables(case):
    text = REFERENCE.read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    assert read_case(text) == read_case(tables) == read_case(str(REFERENCE)) == case
    tables["sun"]["profile_shift"] = np.float64(0.52681)
    assert read_case(tables) == case
    del tables["set"]
    with pytest.raises(CaseError) as caught:
        read_case(tables)
    assert (caught.value.code, caught.value.key) == ("E-KEY-MISSING", "set")
    with pytest.raises(CaseError) as caught:
        read_case(text.replace("teeth = 27", "teeth = 2.7"))
    assert caught.value.key == "sun.teeth"


@pytest.mark.parametrize(("source", "code"), [(3, "E-TYPE"), (None, "E-TYPE"), ({1: 2}, "E-TYPE"), ("x", "E-FILE")])
def test_other_things_are_no_cases(source, code):
    with pytest.raises(CaseError, match=code):
        read_case(source)
