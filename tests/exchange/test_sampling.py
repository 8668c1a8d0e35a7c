"""How signals are sampled: what is no sampling is refused by its option."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.exchange.sampling import Sampling
from femgear.housing.sound import LEVELS


def test_a_level_that_is_none_is_refused():
    assert Sampling().level == LEVELS[0]
    with pytest.raises(CaseError) as caught:
        Sampling(level="mm")
    assert caught.value.key == "--level" and "mm/s rms" in caught.value.limit


@pytest.mark.parametrize("key", ["rate", "duration", "run_up", "pressure_scale", "acceleration_scale"])
def test_a_sampling_that_is_none_is_refused(key):
    for value in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(CaseError) as caught:
            Sampling(**{key: value})
        assert caught.value.code == "E-RANGE" and caught.value.key == f"--{key.replace('_', '-')}"
