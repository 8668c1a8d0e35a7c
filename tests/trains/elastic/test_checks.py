"""Changes of a level that are told."""

import numpy as np

from femgear.trains.elastic.checks import missing_level


def test_only_a_noticeable_change_is_told():
    rpm, limit = np.array([100.0, 200.0, 300.0]), np.array([1e3, 2e3, 3e3])
    assert missing_level(rpm, np.array([0.9, -0.99, np.nan]), limit, 2e4) == ()
    (text,) = map(str, missing_level(rpm, np.array([0.9, -3.0, np.nan]), limit, 2e4))
    assert "at 200 rpm" in text and "-3.0 dB" in text and "1 of the 2 speeds" in text
