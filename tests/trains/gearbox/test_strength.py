"""Safeties of the stages of a gearbox: load cases, planets, K_v of the response, what is missing."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from femgear.case.gear_set import planetary_set
from femgear.case.sections import StrengthSection
from femgear.report.tables import Marks
from femgear.stages.strength import rate_case
from femgear.trains.gearbox.case_file import teeth_of
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.strength import (
    describe_strength,
    flank_of_shafts,
    rated_stage,
    rated_stages,
    smallest_safeties,
    strength_contents,
)
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[3] / "cases"
LIMITS = {"material.root_stress_limit": "461 MPa", "material.contact_stress_limit": "1500 MPa"}


@pytest.fixture(scope="module")
def pair():
    return with_values(read_case(CASES / "spur_pair.toml"), LIMITS)


@pytest.fixture(scope="module")
def planetary():
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), LIMITS)


def contact_of(case, torque, force, face=None):
    """What a contact of a stage has that ratings take."""
    factor = None if face is None else np.array(face)
    cycle = SimpleNamespace(face_load_factor=factor)
    result = SimpleNamespace(planetary_set=planetary_set(case), sun_torque=torque, cycle=cycle)
    shown = np.ones(len(force)) if factor is None else factor
    return SimpleNamespace(case=case, result=result, normal_force=np.array(force), face_load_factor=shown)


def box(**given):
    """A gearbox with or without a section strength."""
    return SimpleNamespace(
        pair=(), strength=StrengthSection(**given), model_fields_set={"strength"} if given else set()
    )


def state_of(case, contacts):
    stages, first = [], 0
    for name, contact in contacts.items():
        count = len(contact.normal_force)
        stages.append(SimpleNamespace(name=name, section=name, meshes=tuple(range(first, first + count))))
        first += count
    flow = SimpleNamespace(mesh_frequency=dict.fromkeys(contacts, 500.0), carries=lambda section: section != "idle")
    assembly = SimpleNamespace(contacts=[None] * first)
    model = SimpleNamespace(case=case, flow=flow, stages=stages, assembly=assembly)
    return SimpleNamespace(model=model, contacts=contacts)


@pytest.fixture(scope="module")
def data(pair, planetary):
    """deflection.nc of two load cases, the second with twice the torque."""
    share = [900.0, 1000.0, 1100.0] * 2
    states = [
        state_of(
            box(quality=6),
            {
                "pair stage": contact_of(pair, load * 100.0, [1000.0], [1.2]),
                "set": contact_of(planetary, load * 50.0, share, [1.0, 1.1, 1.3, 1.0, 1.0, 1.05]),
            },
        )
        for load in (1.0, 2.0)
    ]
    variables, coords, attrs = strength_contents(states)
    values = {name: (tuple(dims.split()), value) for name, (dims, value, *_) in variables.items()}
    return xr.Dataset(
        values,
        coords={"load_case": ["half", "full"], "gear": coords["gear"][1], "stage": ["pair stage", "set"]},
        attrs=attrs,
    )


def test_without_contact_the_torque_of_a_stage_rates_its_teeth():
    axle = read_case(CASES / "e_axle.toml")
    state = solve_deflection(with_values(axle, {"deflection.contact": False, "strength.edition": 2006}))
    assert not state.contacts
    ratings = rated_stages(state)
    assert list(ratings) == ["first stage", "second stage"]
    pair = ratings["first stage"]
    teeth, torque = teeth_of(axle.pair[0]), abs(state.model.flow.first_torque(axle.pair[0]))
    nominal = rate_case(teeth, torque=torque, strength=StrengthSection(edition=2006)).nominal
    assert [flank.root_stress for flank in pair.flanks] == pytest.approx(nominal.root[0].tolist(), rel=1e-12)
    assert all(flank.root_factor == 1.0 for flank in pair.flanks)
    teeth = "pair[0].teeth.material", "planetary[0].teeth.material"
    plain = {f"{of}.{key}": None for of in teeth for key in ("treatment", "hardness")}
    assert not rated_stages(solve_deflection(with_values(axle, {"deflection.contact": False} | plain)))


def test_stages_are_rated_with_their_own_sharing_and_face_load(planetary):
    contact = contact_of(planetary, 50.0, [900.0, 1000.0, 1100.0] * 2, [1.0, 1.1, 1.3, 1.0, 1.0, 1.05])
    rating = rated_stage(box(), "set", contact, 500.0)
    assert rating.factors.sharing == pytest.approx([1.1, 1.1])
    assert rating.factors.face == pytest.approx([1.3, 1.05])
    assert rating.nominal.edition == 2019
    assert rated_stage(box(edition=2006), "set", contact, 500.0).nominal.edition == 2006
    own = contact_of(with_values(planetary, {"strength.edition": 2006}), 50.0, [1000.0] * 6)
    assert rated_stage(box(edition=2019), "set", own, 500.0).nominal.edition == 2006


def test_nothing_is_stored_where_nothing_asks(planetary):
    treated = ("material.treatment", "material.hardness", "ring.material")
    plain = with_values(planetary, dict.fromkeys((*LIMITS, *treated)))
    assert rated_stage(box(), "set", contact_of(plain, 50.0, [1000.0] * 6), 500.0) is None
    assert strength_contents([state_of(box(), {"set": contact_of(plain, 50.0, [1.0] * 6)})]) == ({}, {}, {})
    assert describe_strength(xr.Dataset(), 0, "") == () and not list(smallest_safeties(xr.Dataset(), None, Marks(())))


def test_stages_and_gears_that_carry_without_a_safety_are_named(pair):
    """Stages: rated, without limits, with those of gear 1 alone, and one that carries nothing."""
    case, gear_1 = (
        with_values(read_case(CASES / "spur_pair.toml"), {"material.treatment": None, "material.hardness": None}),
        {key.replace("material", "gear_1.material"): value for key, value in LIMITS.items()},
    )
    cases = {"first": pair, "second": case, "third": with_values(case, gear_1), "idle": case}
    state = state_of(box(edition=2019), {name: contact_of(of, 100.0, [1.0]) for name, of in cases.items()})
    *_, attrs = strength_contents([state])
    assert attrs["iso_unrated"] == "second | gear 2 of third"
    assert attrs["iso_missing"] == "dynamic face transverse"


def test_files_hold_stresses_and_safeties_of_all_load_cases(data, pair):
    half, full = data["iso_root_stress"].values
    assert full == pytest.approx(2.0 * half)
    rating = rate_case(
        pair, torque=200.0, face=np.array([1.2]), frequencies=(500.0,), strength=StrengthSection(quality=6)
    )
    assert data["iso_root_safety"].values[1, 0, 1] == pytest.approx(rating.flanks[1].root_safety)
    assert data["iso_contact_safety"].values[1, 0, 0] == pytest.approx(rating.flanks[0].contact_safety)
    assert data["iso_dynamic_factor"].values[1, 0] == pytest.approx(rating.standard[0].dynamic.factor)
    assert data["iso_flank"].values[4].tolist() == ["planet of set, ring side", "ring of set"]
    (block,) = describe_strength(data, 1, "")
    assert [row[0] for row in block.rows] == [
        "gear 1 of pair stage",
        "gear 2 of pair stage",
        "sun of set",
        "planet of set, sun side",
        "planet of set, ring side",
        "ring of set",
    ]
    assert block.title.endswith("ISO 6336:2019")


def test_the_verdict_has_the_dynamic_factor_of_the_response(data):
    """Of the chosen load case alone; the smallest of all load cases stands with flank and stress."""
    alone = dict(smallest_safeties(data.assign_attrs(load_case=1), None, Marks(())))
    least = np.nanmin(data["iso_root_safety"].values)
    text = alone["smallest safety S_F, ISO 6336:2019"]
    assert text.startswith(f"{least:.2f}, ") and ", full: sigma_F0" in text
    factor = np.array([[[3.0, 3.0], [3.0, np.nan]]])
    response = xr.Dataset(
        {
            "dynamic_factor": (("speed", "stage", "kind"), factor),
            "stage_of_mesh": ("mesh", ["pair stage", *["set"] * (data.sizes["mesh"] - 1)]),
        },
        coords={"stage": ["pair stage", "set"], "mesh": data["mesh"].values},
    )
    running = dict(smallest_safeties(data.assign_attrs(load_case=1), response, Marks(())))
    expected = np.nanmin(data["iso_root_safety"].values[1] * data["iso_dynamic_factor"].values[1, :, None] / 3.0)
    assert running["smallest safety S_F, ISO 6336:2019"].startswith(f"{expected:.2f}, ")
    other = dict(smallest_safeties(data.assign_attrs(load_case=0), response, Marks(())))
    assert other["smallest safety S_F, ISO 6336:2019"] != running["smallest safety S_F, ISO 6336:2019"]


def test_gears_of_pairs_named_after_their_shafts_have_the_names_of_these():
    pairs = [
        SimpleNamespace(name=f"short planet {i}-long planet {i}", shafts=(f"short planet {i}", f"long planet {i}"))
        for i in (1, 11)
    ]
    pairs.append(SimpleNamespace(name="first stage", shafts=("motor", "pinion")))
    named = flank_of_shafts("gear 2 of short planet 11-long planet 11", pairs)
    assert named == "long planet 11 in mesh with short planet 11"
    assert flank_of_shafts("gear 1 of first stage", pairs) == "gear 1 of first stage"
