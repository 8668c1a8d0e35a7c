"""A parallel stage with the mesh stiffness of the teeth of a pair: numbers, senses, entries, refusals."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from femgear.case.text import write
from femgear.errors import CaseError
from femgear.stages.static import solve_static
from femgear.system.fourier import FourierSeries
from femgear.trains.drivetrain.case_file import pair_case_of
from femgear.trains.drivetrain.figures import stiffness_figure
from femgear.trains.drivetrain.model import case_model
from femgear.trains.reading import case_schema, parse_case, read_case, to_toml, with_values

CASES = Path(__file__).parents[3] / "cases"
PAIR = {
    "teeth = 24": "teeth = 23",
    "teeth = 36 ": "teeth = 71 ",
    '"91.5 mm"': '"142 mm"',
    '# backlash = "0.1 mm"': 'backlash = "0.12 mm"',
    "positions = 64": "positions = 32",
    'tip_diameter = "79.8 mm"': "",
    'tip_diameter = "115.3786 mm"': "",
}
ENTRY = "parallel[0].stiffness"


@pytest.fixture(scope="module")
def chain(tmp_path_factory):
    folder = tmp_path_factory.mktemp("chain")
    text = (CASES / "spur_pair.toml").read_text(encoding="utf-8")
    for old, new in PAIR.items():
        text = text.replace(old, new)
    (folder / "pair.toml").write_text(text, encoding="utf-8")
    text = (CASES / "own_chain.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^mesh = .*$", 'stiffness = "pair.toml"', text)
    (folder / "chain.toml").write_text(text, encoding="utf-8")
    (folder / "own_chain_motor.csv").write_bytes((CASES / "own_chain_motor.csv").read_bytes())
    return read_case(folder / "chain.toml")


@cache
def static(text):
    return solve_static(parse_case(text, numbered=False)).dataset()


def test_mean_and_harmonics_are_those_of_the_static_solution_of_the_pair(chain):
    model, pair = case_model(chain), pair_case_of(write(chain.parallel[0].stiffness))
    k = static(to_toml(pair)).mesh_stiffness.values[0]
    position = np.arange(len(k)) / len(k)
    first = 2.0 * np.mean(k * np.exp(-2j * np.pi * position))
    assert model.stiffness[0, 0] == pytest.approx(k.mean(), rel=1e-9)
    assert model.stiffness[0, 1] == pytest.approx(first, rel=1e-9)
    # all harmonics that the samples have give them back
    whole = case_model(with_values(chain, {"simulation.harmonics": len(k) // 2 - 1})).stiffness
    found = FourierSeries(whole).at(2.0 * np.pi * position[:, None])[:, 0]
    alone = np.real(np.fft.rfft(k)[-1]) / len(k) * (-1.0) ** np.arange(len(k))
    np.testing.assert_allclose(found, k - alone, rtol=1e-9)
    assert model.backlash[0] == pytest.approx(0.12e-3 * np.cos(np.radians(20.0)), rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "turned"),
    [
        ({f"{ENTRY}.operation.torque": "-200 N m"}, False),
        ({"parallel[0].driver": "wheel"}, True),
        ({"parallel[0].driver": "wheel", f"{ENTRY}.operation.torque": "-200 N m"}, True),
    ],
)
def test_time_runs_backwards_where_the_second_gear_drives(chain, changes, turned):
    """Whatever the sign of the torque in the case of the pair: flanks are alike."""
    one, two = (case_model(case).stiffness[0] for case in (chain, with_values(chain, changes)))
    np.testing.assert_allclose(two, one.conj() if turned else one, rtol=1e-9, atol=1e-9 * abs(one[0]))
    assert abs(one[1].imag) > 1e-3 * abs(one[0])


def test_the_case_holds_the_pair_and_changes_with_it(chain):
    again = parse_case(to_toml(chain))
    assert again == chain and again.profile_files == {}
    assert chain.profile_files[ENTRY] == "pair.toml"
    heavier = with_values(chain, {f"{ENTRY}.operation.torque": "800 N m"})
    assert heavier != chain and heavier.model_dump() != chain.model_dump()
    assert case_model(heavier).mean_stiffness[0] > 1.02 * case_model(chain).mean_stiffness[0]
    figure = stiffness_figure(case_model(chain))
    assert figure.axes[0].get_lines()[0].get_label() == "computed, first drives"
    entry = case_schema("drivetrain")["$defs"]["ParallelSection"]["properties"]["stiffness"]
    assert {"string", "object"} <= set(entry["anyOf"][0]["type"])


def test_flanks_without_play_have_no_back_side_and_it_is_said(chain):
    loose = with_values(chain, {"simulation.contact_loss": True})
    tight = with_values(loose, {f"{ENTRY}.set.backlash": None})
    assert not loose.notices and [one.key for one in tight.notices] == [ENTRY]
    assert np.isinf(case_model(tight).backlash[0])


@pytest.mark.parametrize(
    ("changes", "code", "key"),
    [
        ({"parallel[0].teeth": [24, 74]}, "E-TEETH", "parallel[0].teeth"),
        ({"parallel[0].module": "4 mm"}, "E-TEETH", "parallel[0].module"),
        ({"parallel[0].module": None, "parallel[0].radii": ["35 mm", "108 mm"]}, "E-TEETH", "parallel[0].radii"),
        ({"parallel[0].pressure_angle": "25 deg"}, "E-TEETH", "parallel[0].pressure_angle"),
        ({"parallel[0].helix_angle": "10 deg"}, "E-TEETH", "parallel[0].helix_angle"),
        ({ENTRY: None}, "E-KEY-MISSING", "parallel[0].mesh"),
        ({ENTRY: 7}, "E-TYPE", ENTRY),
        ({ENTRY: "no.toml"}, "E-FILE", ENTRY),
        ({ENTRY: "../pair.toml"}, "E-FILE", ENTRY),
        ({"parallel[0].mesh": {"stiffness": "3e8 N/m", "contact_ratio": 1.6}}, "E-CHOICE", ENTRY),
        ({f"{ENTRY}.set.modul": 3}, "E-KEY-UNKNOWN", f"{ENTRY}.set.modul"),
        ({f"{ENTRY}.model": "multistage"}, "E-KEY-MISSING", f"{ENTRY}.stage"),
        ({f"{ENTRY}.static.positions": 30}, "E-RANGE", f"{ENTRY}.static.positions"),
        ({f"{ENTRY}.operation.torque": "0 N m"}, "E-RANGE", f"{ENTRY}.operation.torque"),
        ({f"{ENTRY}.gear_1.errors": {"runout_amplitude": "5 um"}}, "E-RANGE", f"{ENTRY}.gear_1.errors"),
        ({f"{ENTRY}.set.centre_distance": "120 mm"}, "E-CENTRE-DISTANCE", f"{ENTRY}.set.centre_distance"),
    ],
)
def test_refusals_name_the_entry(chain, changes, code, key):
    with pytest.raises(CaseError) as found:
        with_values(chain, changes)
    assert (code, key) in [(one.code, one.key) for one in found.value.problems or (found.value,)]


def test_working_circles_are_sizes_of_the_same_gears(chain):
    """Pitch radii at the centre distance of the pair, with the pressure angle there."""
    radii, angle = (142.0 * 23 / 94, 142.0 * 71 / 94), np.degrees(np.arccos(141.0 / 142 * np.cos(np.pi / 9)))
    changes = {
        "parallel[0].module": None,
        "parallel[0].radii": [f"{one:.4f} mm" for one in radii],
        "parallel[0].pressure_angle": f"{angle:.4f} deg",
    }
    assert with_values(chain, changes).parallel[0].stiffness == chain.parallel[0].stiffness
