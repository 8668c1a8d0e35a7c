"""Entries of an integration in time: torques, what contradicts itself, files beside the case (tests/case as well)."""

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.transient_case import TorqueOverTimeSection, torque_histories
from femgear.trains.reading import read_case, to_toml


def case_of(**entries):
    return read_case(pair_tables() | {"transient": {"duration": "1 s"} | entries})


def test_a_share_balances_the_others_over_their_speeds():
    known = TorqueOverTimeSection.model_construct
    torques = [
        ("a", known(times=(0.0, 1.0), torques=(10.0, 30.0))),
        ("b", known(share=0.5)),
        ("c", known(torque=6.0)),
    ]
    *_, last = torque_histories(torques, {"a": 1.0, "b": -0.25, "c": 2.0})
    assert last.body == "b" and last.at([0.0, 0.5, 1.0]) == pytest.approx(0.5 / 0.25 * np.array([22.0, 32.0, 42.0]))


@pytest.mark.parametrize(
    ("entries", "code", "key"),
    [
        ({"torque": [{"load": "fan", "torque": "1 N m"}]}, "E-CHOICE", "transient.torque[0].load"),
        ({"torque": [{"load": "motor", "torque": "1 N m"}] * 2}, "E-DUPLICATE", "transient.torque[1].load"),
        ({"torque": [{"load": "motor"}]}, "E-CHOICE", "transient.torque[0].torque"),
        ({"torque": [{"load": "motor", "times": ["0 s"]}]}, "E-CHOICE", "transient.torque[0].times"),
        (
            {"torque": [{"load": "motor", "times": ["1 s", "0 s"], "torques": ["1 N m", "2 N m"]}]},
            "E-TORQUE",
            "transient.torque[0].times",
        ),
        (
            {"torque": [{"load": "motor", "share": 1.0}, {"load": "brake", "share": 1.0}]},
            "E-TORQUE",
            "transient.torque[1].share",
        ),
        ({"duration": "1e5 s", "rate": "1 MHz"}, "E-RANGE", "transient.duration"),
        ({"settle": "2 s"}, "E-RANGE", "transient.settle"),
        ({"record": "3 kHz"}, "E-RANGE", "transient.record"),
        ({"torque": [{"load": "motor", "file": "no.csv"}]}, "E-FILE", "transient.torque[0].file"),
    ],
)
def test_refusals_name_their_entries(entries, code, key):
    with pytest.raises(CaseError) as refused:
        case_of(**entries)
    assert (code, key) in [(one.code, one.key) for one in refused.value.problems]


def test_a_series_in_a_file_is_kept_inside_the_case(tmp_path):
    (tmp_path / "motor.csv").write_text("time [ms]; torque [kN m]\n0; 0,1\n500; 0,2\n", encoding="utf-8")
    case = case_of(torque=[{"load": "motor", "torque": "1 N m"}])
    text = to_toml(case).replace('torque = "1 N m"', 'file = "motor.csv"')
    (tmp_path / "box.toml").write_text(text, encoding="utf-8")
    case = read_case(tmp_path / "box.toml")
    torque = case.transient.torque[0]
    assert (torque.times, torque.torques) == ((0.0, 0.5), (100.0, 200.0)) and torque.file is None
    assert read_case(to_toml(case)).transient == case.transient
    assert case.transient.settled == pytest.approx(0.3)
