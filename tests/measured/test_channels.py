"""femgear.measured.channels: names, times, rates, and channels that are refused."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.measured.channels import (
    Channel,
    agreed_rate,
    checked_channel,
    choose_channel,
    cut_channel,
    rate_of_times,
    split_unit,
)


def channel(values, name="a", rate=1000.0):
    return Channel("file.csv", name, "V", rate, np.asarray(values, float))


SINE = np.sin(np.arange(200))


@pytest.mark.parametrize(
    ("title", "parts"),
    [
        ("acc 1 [m/s^2]", ("acc 1", "m/s^2")),
        (" acc (g) ", ("acc", "g")),
        ("acc", ("acc", "")),
        ("acc (left) [g]", ("acc (left)", "g")),
        ("(", ("(", "")),
    ],
)
def test_names_and_units(title, parts):
    assert split_unit(title) == parts


def test_times_that_are_printed_with_few_digits_give_their_rate():
    time = np.round(3.0 + np.arange(5000) / 25600, 5)
    rate, start = rate_of_times(time, "s", "a")
    assert rate == pytest.approx(25600, rel=1e-4) and start == 3.0
    with pytest.raises(CaseError, match="not even"):
        rate_of_times(np.round(time, 3), "s", "a")
    assert rate_of_times(np.round(time, 3), "s", "a", 25600.0)[0] == pytest.approx(25600, rel=5e-3)
    assert rate_of_times(1e3 * np.arange(100) / 51200, "ms", "a")[0] == pytest.approx(51200)


@pytest.mark.parametrize(
    ("time", "unit", "words"),
    [
        (np.r_[0:50, 51:100], "s", "from sample 50 at 49 s to the next 2 s"),
        (np.zeros(100), "s", "do not ascend"),
        (-np.arange(100.0), "s", "do not ascend"),
        (np.arange(100.0), "rpm", "a unit of time that is none"),
    ],
)
def test_times_that_are_no_scale(time, unit, words):
    with pytest.raises(CaseError, match=words) as refused:
        rate_of_times(time, unit, "file.csv")
    assert refused.value.code == "E-FILE" and refused.value.remedy and "file.csv" in str(refused.value)


def test_rates_must_agree_and_be_known():
    assert agreed_rate(None, 100.0, "a") == agreed_rate(100.0, None, "a") == 100.0 == agreed_rate(100.0, 100.05, "a")
    with pytest.raises(CaseError, match="another one than --rate"):
        agreed_rate(100.0, 200.0, "a")
    with pytest.raises(CaseError, match="how many samples a second"):
        agreed_rate(None, None, "a")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (SINE[:63], "63 samples"),
        (np.full(100, 2.5), "all samples are equal"),
        (np.where(np.arange(200) == 7, np.nan, SINE), "sample 8 is no finite number"),
        (np.where(np.arange(200) == 9, np.inf, SINE), "sample 10 is no finite number"),
    ],
)
def test_empty_and_damaged_channels_are_refused(values, words):
    with pytest.raises(CaseError, match=words) as refused:
        checked_channel(channel(values))
    assert refused.value.remedy and "channel a" in str(refused.value)


def test_a_channel_is_chosen_by_name_or_number():
    channels = [channel(SINE, "x"), channel(2 * SINE, "y"), channel(3 * SINE, "3")]
    assert choose_channel(channels, "y").name == choose_channel(channels, "2").name == "y"
    assert choose_channel(channels[:1], None).name == "x"
    for name, words in ((None, "3 channels"), ("z", "no channels called z"), ("4", "no channels")):
        with pytest.raises(CaseError, match=words) as refused:
            choose_channel(channels, name)
        assert "1 x; 2 y" in str(refused.value)


@pytest.mark.parametrize(
    ("begin", "end", "samples"),
    [
        (None, None, (0, 200)),
        (10.05, None, (50, 200)),
        (None, 10.1, (0, 100)),
        (10.05, 10.0505, (50, 51)),
        (1, 99, (0, 200)),
    ],
)
def test_a_part_of_a_channel_keeps_its_times(begin, end, samples):
    whole = Channel("file.csv", "a", "V", 1000.0, SINE, 10.0)
    part = cut_channel(whole, begin, end)
    assert np.array_equal(part.values, SINE[slice(*samples)])
    assert part.time == pytest.approx(whole.time[slice(*samples)])


@pytest.mark.parametrize(("begin", "end"), [(10.3, None), (None, 10.0), (10.1, 10.1), (10.1, 10.05)])
def test_a_part_without_samples_is_refused(begin, end):
    with pytest.raises(CaseError, match="no samples of channel a between two times") as refused:
        cut_channel(Channel("file.csv", "a", "V", 1000.0, SINE, 10.0), begin, end)
    assert refused.value.code == "E-RANGE"
    assert "10 to 10.2 s" in str(refused.value)
