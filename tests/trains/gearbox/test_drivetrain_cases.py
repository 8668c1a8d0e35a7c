"""Files of the former model "drivetrain" are gearbox cases when they are read, and are refused by their own entries."""

import math
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from published.wind_turbine_drivetrain import wind_turbine_drivetrain

from femgear.errors import CaseError
from femgear.system.fourier import harmonics_of
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.excitation import pair_count_excitation
from femgear.trains.gearbox.model import gearbox_model
from femgear.trains.gearbox.stage_structure import in_time
from femgear.trains.reading import read_case, to_toml, with_values
from validation import drivetrain

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[3] / "cases"
TEXT = """
    model = "drivetrain"
    title = "two pairs of gears side by side"
    body = [{name = "a", inertia = "0.25 kg m^2", mass = "20 kg", tilts = false},
            {name = "b", inertia = "2 kg m^2", mass = "60 kg", tilts = false}]
    bearing = [{body = "a", radial = "2e8 N/m"}, {body = "b", radial = "1e8 N/m"}]
    operation = {speed = "1000 rpm", torque = [{body = "a", torque = "60 N m"}, {body = "b", share = 1.0}]}
    simulation = {duration = "0.1 s", damping_ratio = 0.03}
    [[parallel]]
    between = ["a", "b"]
    teeth = [23, 71]
    module = "3 mm"
    mesh = {stiffness = "3e8 N/m", contact_ratio = 1.7}
    [[parallel]]
    between = ["a", "b"]
    teeth = [23, 71]
    module = "3 mm"
    mesh = {stiffness = "1e8 N/m", contact_ratio = 1.3}
"""


@pytest.mark.parametrize("rows", ["former_modes", "former_histories"])
def test_modes_and_histories_are_those_of_the_former_train(rows):
    for row in getattr(drivetrain, rows)():
        assert row.verdict == "passes", row


def test_a_file_is_read_as_a_gearbox_and_stays_one():
    case = read_case(CASES / "own_chain.toml")
    assert [one.code for one in case.notices] == ["W-FORMER"] and case.train == "gearbox"
    again = read_case(to_toml(case))
    assert again == case and again.notices == ()
    # the series of the motor is in the case
    assert case.transient.torque[0].times == (0.0, 0.5, 0.8, 1.0)
    assert case.load_case.torque["motor"] == pytest.approx((0.5 * 60 + 0.3 * 90 + 1.2 * 120) / 2.0)


def test_stages_side_by_side_share_by_their_stiffness():
    """As the former train did: of springs between the same shafts the stiffer one takes more, in their ratio."""
    found = solve_deflection(read_case(TEXT))
    assert found.model.flow.side_by_side == (("a-b", "a-b 2"),)
    # 3e8 and 1e8 N/m
    assert found.model.flow.torque_shares == pytest.approx({"a-b": 0.75, "a-b 2": 0.25}, rel=1e-9)


def waves(case) -> dict[str, np.ndarray]:
    """Harmonics of the mesh stiffnesses over time by their meshes, over the mean."""
    model = gearbox_model(case)
    found = {}
    for stage in model.stages:
        excitation = in_time(model, stage, pair_count_excitation(model, stage))[0]
        names = [model.assembly.contacts[mesh].name for mesh in stage.meshes]
        lines = harmonics_of(excitation.stiffness, 8)
        found |= dict(zip(names, lines[:, 1:] / lines[:, :1].real, strict=True))
    return found


def two_levels(ratio: float, low_share: float | None, ahead: float) -> np.ndarray:
    """Harmonics of a rectangular wave, counted at many instants, most pairs in the middle of the period."""
    pairs, count = math.floor(ratio), 40_000
    share = ratio - pairs
    low = pairs / (pairs + 1.0) if low_share is None else low_share
    tau = (np.arange(count) + 0.5) / count + ahead
    wave = np.where(np.abs((tau + 0.5) % 1.0 - 0.5) < 0.5 * share, 1.0, low)
    shift = np.exp(-1j * np.pi * np.arange(1, 9) / count)
    return harmonics_of(wave / wave.mean(), 8)[1:] * shift


@pytest.mark.parametrize("sense", [1, -1])
def test_phases_are_shares_by_which_waves_are_ahead_in_time(sense):
    tables = wind_turbine_drivetrain()
    tables["operation"]["torque"][0]["torque"] = f"{sense * 15e3} N m"
    tables["operation"]["speed"] = f"{sense * 0.6} rad/s" if sense > 0 else "0.6 rad/s"
    planets = tables["planetary"][0]
    planets["sun_mesh"] |= {"phase": 0.3, "low_share": 0.7}
    planets["ring_mesh"] |= {"phase": -1.2}
    tables["parallel"][0]["mesh"] |= {"phase": 0.15}
    tables["parallel"][1]["mesh"] |= {"phase": 0.4, "contact_ratio": 2.3}
    found = waves(read_case(tables))
    third = 2.0 * math.pi / 3.0
    for name, ratio, low, ahead in (
        ("carrier-sun sun-planet 1", 1.75, 0.7, 0.3),
        ("carrier-sun sun-planet 2", 1.75, 0.7, 0.3 - 47 * third / (2.0 * math.pi)),
        ("carrier-sun planet 1-ring", 1.9, None, -1.2),
        ("carrier-sun planet 3-ring", 1.9, None, -1.2 + 184 * 2.0 * third / (2.0 * math.pi)),
        ("gear 1-gear 2", 1.78, None, 0.15),
        ("gear 2-gear 3", 2.3, None, 0.4),
    ):
        assert found[name] == pytest.approx(two_levels(ratio, low, ahead), abs=1e-3), name


def test_joints_and_beams_bend_as_the_shafts_do():
    """A shaft of a section as a joint, and as beams on bearings inside: statics of both are alike."""
    tables = tomllib.loads((CASES / "own_chain.toml").read_text(encoding="utf-8"))
    tables["operation"]["torque"] = [{"body": "motor", "torque": "60 N m"}, {"body": "fan", "share": 1.0}]
    tables["shaft"][1]["density"] = "1e-3 kg/m^3"
    motions = []
    for elements in (4, 0):
        tables["shaft"][1]["elements"] = elements
        found = solve_deflection(read_case(tables))
        fan = found.model.first["fan"]
        motions.append(found.motion[6 * fan : 6 * fan + 6])
    assert motions[0] == pytest.approx(motions[1], rel=1e-6, abs=1e-9 * np.abs(motions[0]).max())
    tables["shaft"][1] |= {"elements": 4}
    tables["bearing"].append({"shaft": ["wheel", "fan"], "station": 2, "radial": "1e9 N/m"})
    held = read_case(tables).bearing[-4]
    assert (held.shaft, held.position, held.radial) == ("shaft wheel-fan", pytest.approx(0.3), 1e9)


def test_driver_and_unlike_radii_are_told():
    tables = wind_turbine_drivetrain()
    tables["parallel"][0]["driver"] = "gear 1"
    codes = [(one.code, one.key) for one in read_case(tables).notices]
    assert ("W-UNUSED", "parallel[0].driver") in codes
    assert [key for code, key in codes if code == "W-TEETH"] == [
        "parallel[0].teeth",
        "parallel[1].teeth",
        "planetary[0].ring_teeth",
    ]


def test_a_pair_in_place_of_a_mesh_gives_its_teeth(tmp_path):
    pair = (CASES / "spur_pair.toml").read_text(encoding="utf-8")
    (tmp_path / "pair.toml").write_text(pair, encoding="utf-8")
    case = read_case(CASES / "spur_pair.toml")
    shutil.copy(CASES / "own_chain_motor.csv", tmp_path)
    lines = (CASES / "own_chain.toml").read_text(encoding="utf-8")
    size = f"{case.module!r} m"
    lines = lines.replace("teeth = [23, 71]", "teeth = [24, 36]").replace('module = "3 mm"', f'module = "{size}"')
    mesh = next(line for line in lines.splitlines() if line.startswith("mesh = "))
    (tmp_path / "chain.toml").write_text(lines.replace(mesh, 'stiffness = "pair.toml"'), encoding="utf-8")
    chain = read_case(tmp_path / "chain.toml")
    assert chain.pair[0].teeth["gear_1"]["teeth"] == 24 and chain.pair[0].mesh is None
    assert "W-FORMER" in [one.code for one in chain.notices if one.key == "parallel[0].stiffness"]


@pytest.mark.parametrize(
    ("changes", "code", "key"),
    [
        ({"body": [{"name": "a", "inertia": "1 kg m^2", "mass": "1 kg"}] * 2}, "E-DUPLICATE", "body[1].name"),
        ({"bearing": [{"body": "c", "radial": "1e8 N/m"}]}, "E-CHOICE", "bearing[0].body"),
        ({"bearing": [{"body": "a", "station": 1, "radial": "1e8 N/m"}]}, "E-CHOICE", "bearing[0].body"),
        ({"shaft": [{"between": ["a", "b"], "length": "1 m"}]}, "E-CHOICE", "shaft[0].outer_diameter"),
        ({"parallel": []}, "E-DRIVETRAIN", "body[1].name"),
        ({"parallel[0].module": None}, "E-CHOICE", "parallel[0].radii"),
        ({"parallel[0].mesh": None}, "E-CHOICE", "parallel[0].mesh"),
        ({"operation.torque": [{"body": "a"}]}, "E-CHOICE", "operation.torque[0].torque"),
        ({"simulation.durations": "1 s"}, "E-KEY-UNKNOWN", "simulation.durations"),
    ],
)
def test_refusals_name_the_entries_of_the_file(changes, code, key):
    tables = tomllib.loads(TEXT)
    for entry, value in changes.items():
        *way, last = entry.replace("[0]", ".0").split(".")
        table = tables
        for part in way:
            table = table[int(part)] if part.isdigit() else table[part]
        if value is None:
            del table[last]
        else:
            table[last] = value
    with pytest.raises(CaseError) as refused:
        read_case(tables)
    assert (code, key) in [(one.code, one.key) for one in refused.value.problems]


def test_a_series_beside_the_case_is_refused_with_its_key(tmp_path):
    text = (CASES / "own_chain.toml").read_text(encoding="utf-8")
    (tmp_path / "chain.toml").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        read_case(tmp_path / "chain.toml")
    assert (refused.value.code, refused.value.key) == ("E-FILE", "operation.torque[0].file")


def test_entries_of_the_gearbox_change_it():
    case = with_values(read_case(CASES / "own_chain.toml"), {"transient.rate": "40 kHz"})
    assert case.transient.rate == 40e3 and case.transient.record == 5e3
