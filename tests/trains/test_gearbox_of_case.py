"""Sets and pairs as gearboxes have the modes, the torque and the sensors of their cases."""

import numpy as np
import pytest

from femgear import cli
from femgear.errors import CaseError
from femgear.run import solve
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import read_case, with_values

CASES = (
    "planetary_27_40_108",
    "on_six_bolts",
    "in_a_casing",
    "nrel_pgb",
    "nrel_pga",
    "nrel_pgb_static",
    "helical_30_20_70",
    "helical_23_24_73",
    "spur_pair",
)


def frequencies(case):
    """Natural frequencies above 1 Hz, ascending."""
    found = np.sort(solve(case, only="modes")["modes"].modes.frequency)
    return found[found > 1.0]


@pytest.mark.parametrize("name", CASES)
def test_a_shipped_case_is_a_gearbox_under_its_torque(name):
    case = read_case(f"cases/{name}.toml")
    box = read_case(gearbox_of_case(case).tables)
    assert list(box.load_case.torque.values()) == [case.operation.torque]
    stage = (*box.pair, *box.planetary)[0]
    assert stage.teeth is None or stage.teeth["set"]
    assert len(box.sensor) == (1 + len(case.housing.sensor) if case.train == "elastic" else 0)


@pytest.mark.parametrize(
    "name", ["nrel_pgb", pytest.param("helical_23_24_73", marks=pytest.mark.slow, id="helical, elastic ring")]
)
def test_modes_are_those_of_the_case(name):
    case = read_case(f"cases/{name}.toml")
    expected = frequencies(case)
    tables = gearbox_of_case(case).tables
    box = read_case(tables | {"modes": {"up_to": "300 kHz"}})
    assert frequencies(box)[: len(expected)] == pytest.approx(expected, rel=1e-7)


def test_entries_without_a_place_are_told():
    written = gearbox_of_case(read_case("cases/nrel_pga.toml"))
    assert "planar.branch" in {one.key for one in written.findings}
    # the bearing between carrier and ring keeps its play, the whole way between its rings
    (bearing,) = (one for one in read_case(written.tables).bearing if one.name == "carrier bearing")
    given = read_case("cases/nrel_pga.toml").planar.carrier_bearing
    assert (bearing.shaft, bearing.outer_shaft, bearing.radial) == ("carrier", "ring", given.stiffness)
    assert bearing.clearance == pytest.approx(2.0 * given.clearance, rel=1e-12) and bearing.gapped
    assert written.tables["gravity"]["direction"][2] == 0.0


def test_meshes_of_a_given_stiffness_keep_their_play_and_what_has_no_place_is_told():
    case = read_case("cases/nrel_pgb.toml")
    written = gearbox_of_case(case)
    (stage,) = read_case(written.tables).planetary
    assert stage.sun_mesh.backlash == pytest.approx(482e-6, rel=1e-3) == stage.ring_mesh.backlash
    changed = with_values(
        case, {"planar.line_backlash": "0.1 mm", "planar.damping_ratios": [0.03], "planar.back_flanks": True}
    )
    written = gearbox_of_case(changed)
    assert read_case(written.tables).planetary[0].sun_mesh.backlash == pytest.approx(1e-4)
    keys = {finding.key for finding in written.findings}
    assert "planar.damping_ratios" in keys and not keys & {"planar.line_backlash", "planar.back_flanks"}
    balance = read_case(written.tables).balance
    assert (balance.harmonics, balance.side_bands, balance.back_flanks) == (1, 10, True)


def test_a_file_of_a_former_model_is_written_as_the_gearbox_that_it_is_read_as(tmp_path):
    file, path = "cases/wind_turbine_drivetrain.toml", str(tmp_path / "box.toml")
    assert cli.main(["gearbox", file, "-o", path]) == 0
    box, former = read_case(path), read_case(file)
    assert ["W-FORMER" in {notice.code for notice in case.notices} for case in (former, box)] == [True, False]
    assert [shaft.name for shaft in box.shaft] == [shaft.name for shaft in former.shaft]


def test_what_is_no_set_is_refused():
    with pytest.raises(CaseError) as refused:
        gearbox_of_case(read_case("cases/gear_pair.toml"))
    assert refused.value.key == "model" and refused.value.value == "gear_pair"


def test_the_command_writes_a_case_that_runs_and_replaces_none(tmp_path, monkeypatch, capsys):
    path = str(tmp_path / "box.toml")
    assert cli.main(["gearbox", "cases/spur_pair.toml", "-o", path]) == 0
    assert read_case(path).train == "gearbox" and cli.main(["check", path]) == 0
    assert cli.main(["gearbox", "cases/spur_pair.toml", "-o", path]) == 2
    assert "--force" in capsys.readouterr().err


def test_a_load_spectrum_goes_along():
    spectrum = [
        {"name": "start: cold", "torque": "150 N m", "speed": "500 rpm", "share": 0.02},
        {"name": "run", "torque": "100 N m", "speed": "3100 rpm", "share": 0.9},
        {"torque": "-60 N m", "speed": "1000 rpm", "share": 0.08},
    ]
    path = "cases/spur_pair.toml"
    given = with_values(read_case(path), {"operation.load_case": spectrum, "operation.required_hours": 20000})
    written = gearbox_of_case(given)
    box = read_case(written.tables)
    assert [one.name for one in box.operation.load_case] == ["1 start cold", "run", "3"]
    assert [one.share for one in box.operation.load_case] == [0.02, 0.9, 0.08]
    for ours, one in zip(box.operation.load_case, given.operation.load_case, strict=True):
        assert list(ours.torque.values()) == [one.torque] and list(ours.speed.values()) == [one.speed]
    assert box.operation.required_hours == 20000
    nearest = min(given.operation.load_case, key=lambda one: abs(one.torque - given.operation.torque))
    assert list(box.load_case.torque.values()) == [nearest.torque]
    told = {one.key: one.text for one in written.findings}
    assert f"{nearest.torque:g} N m" in told["operation.torque"]


def test_lives_of_a_pair_are_those_of_its_gearbox():
    entries = {
        "material.treatment": "case hardened steel",
        "material.hardness": 720,
        "operation.load_case": [
            {"torque": "300 N m", "speed": "600 rpm", "share": 0.1},
            {"torque": "200 N m", "speed": "1500 rpm", "share": 0.9},
        ],
        "static.positions": 16,
        "static.flank_elements": 8,
    }
    pair = with_values(read_case("cases/spur_pair.toml"), entries)
    alone = solve(pair, only="life")["life"].dataset()
    box = solve(read_case(gearbox_of_case(pair).tables), only="deflection")["deflection"].dataset()
    for name in ("root_life", "flank_life", "root_equivalent_torque", "flank_damage_share"):
        np.testing.assert_allclose(box[name], alone[name], rtol=1e-6)
    assert np.isfinite(alone["flank_life"].values[0])


def test_what_several_speeds_become_is_said_with_what_gives_the_others():
    case = with_values(read_case("cases/planetary_27_40_108.toml"), {"operation.speeds": ["250 rpm", "3100 rpm"]})
    (speeds,) = (finding for finding in gearbox_of_case(case).findings if finding.key == "operation.speeds")
    assert speeds.text == "a load case has one speed: the first one, 250 rpm, of 2 from 250 rpm to 3100 rpm"
    assert speeds.remedy.startswith('for the others give [runup] with from = "250 rpm", to = "3100 rpm"; or change ')
    swept = gearbox_of_case(with_values(case, {"runup": {"from": "250 rpm", "to": "3100 rpm"}})).findings
    (speeds,) = (finding for finding in swept if finding.key == "operation.speeds")
    assert speeds.remedy.startswith("its [runup] has the others")
