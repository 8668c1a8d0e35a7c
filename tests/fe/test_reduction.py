"""Which modes of a cyclic body come in pairs, and what a basis without the static shape holds."""

import numpy as np
import pytest

from femgear.fe.reduction import CyclicModes


@pytest.mark.parametrize(("count", "paired"), [(6, [0, 1, 1, 0]), (7, [0, 1, 1, 1]), (2, [0, 0])])
def test_all_but_the_first_and_the_middle_diameter_come_in_pairs(count, paired):
    """cos(n phi) and sin(n phi): the sine is nothing for n = 0, and at all sectors for n = N / 2."""
    n, none = np.arange(len(paired)), np.zeros((1, len(paired)))
    modes = CyclicModes(count, n, n.astype(float), none, none, none, none)
    assert modes.paired.tolist() == [bool(one) for one in paired]
    assert modes.norm == pytest.approx(np.sqrt(np.where(paired, 2, 1) / count))
