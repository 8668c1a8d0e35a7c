"""What a gear train does, in words: by Willis' equation and the balance of power."""

from math import pi
from pathlib import Path

import pytest

from femgear.stages.duty import ShaftEnd, duty_sentence, force_words, in_digits, pair_duty, set_duty, teeth_words
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import train_of

CASES = Path(__file__).parents[2] / "cases"
RPM = pi / 30.0


def test_what_drives_comes_first_and_what_turns_nothing_is_left_out():
    ends = ShaftEnd("wheels", -300.0, (10.0,)), ShaftEnd("motor", 60.0, (50.0,)), ShaftEnd("casing", 240.0, (0.0,))
    text = duty_sentence(ends, "forward")
    assert text == "60 N m at 477 rpm (motor) make 300 N m at 95.5 rpm (wheels): 3 kW, ratio 5, forward."


def test_several_ends_and_speeds():
    ends = (
        ShaftEnd("engine", 100.0, (100.0 * RPM, 200.0 * RPM)),
        ShaftEnd("motor", 50.0, (100.0 * RPM, 200.0 * RPM)),
        ShaftEnd("propeller", -150.0, (100.0 * RPM, 200.0 * RPM)),
    )
    assert duty_sentence(ends) == (
        "100 N m at 100 to 200 rpm (engine) and 50 N m at 100 to 200 rpm (motor) make 150 N m at 100 to 200 rpm "
        "(propeller): up to 3.14 kW."
    )


def test_what_is_held_has_no_power_and_without_torque_nothing_is_said():
    ends = ShaftEnd("sun", 10.0, ()), ShaftEnd("carrier", -50.0, ())
    assert duty_sentence(ends) == "10 N m (sun) make 50 N m (carrier)."
    assert duty_sentence([ShaftEnd("sun", 0.0, (1.0,))]) == duty_sentence([]) == ""


def test_large_torques_are_in_kilonewtons():
    assert duty_sentence([ShaftEnd("wind", 4.183e6, (1.0,))]) == "4,183 kN m at 9.55 rpm (wind): 4.18 MW."


@pytest.mark.parametrize(
    "value, text", [(0.0, "0"), (0.01234, "0.0123"), (999.4, "999"), (1166.3, "1,166"), (4.183e6, "4,183,000")]
)
def test_numbers_have_separators_of_thousands(value, text):
    assert in_digits(value) == text


def test_a_set_turns_by_willis_and_keeps_its_power():
    """Ring held: the carrier turns z_s / (z_s + z_r) times as fast, with the torque over that."""
    case = with_values(
        read_case(CASES / "planetary_27_40_108.toml"),
        {"operation.torque": "60 N m", "operation.speeds": ["1000 rpm"]},
    )
    power = in_digits(60.0 * 1000.0 * RPM * 1e-3)
    assert (
        set_duty(case) == f"60 N m at 1,000 rpm (sun) make 300 N m at 200 rpm (carrier): {power} kW, ratio 5, "
        "spur teeth mesh at 360 Hz."
    )
    back = with_values(case, {"operation.torque": "-60 N m"})
    assert set_duty(back).startswith("300 N m at 200 rpm (carrier) make 60 N m at 1,000 rpm (sun): ")
    assert "ratio 1:5" in set_duty(back)


def test_a_pair_and_a_gearbox():
    assert pair_duty(read_case(CASES / "spur_pair.toml")) == (
        "200 N m at 1,500 rpm (gear 1) make 300 N m at 1,000 rpm (gear 2): 31.4 kW, ratio 1.5, spur teeth mesh "
        "at 600 Hz."
    )
    case = read_case(CASES / "e_axle.toml")
    text = train_of(case).duty(case)
    # 72/25 of the pair, 1 + 73/23 of the set whose ring stands
    assert f"ratio {72 / 25 * (1 + 73 / 23):.4g}, helical teeth mesh at 3,750 Hz and " in text
    # of spur and helical stages together nothing is said
    assert [teeth_words(angles) for angles in ([None, 0.0], [0.3, -0.2], [0.3, None], [])] == [
        "spur teeth",
        "helical teeth",
        "teeth",
        "teeth",
    ]
    assert text.endswith(" Hz, full torque, one of 2 load cases.")


def test_large_forces_are_in_kilonewtons():
    assert force_words(9876.54) == "9877 N" and force_words(88590.0) == "88.59 kN"
