"""W-POSITIONS of helical teeth, whose record has no positions between the equidistant ones."""

import numpy as np
import pytest
import xarray as xr

from femgear.stages.static_results import _peak_doubt


def record(count, *, overlap=1.2, **attrs):
    """A transmission error with a peak of straight lines at 0.37 of the period, and a constant stiffness."""
    position = np.arange(count) / count
    error = np.maximum(1.0 - np.abs(position - 0.37) / 0.1, 0.0) * 1e-6 + 1e-5
    curves = {"ste": error, "mesh_stiffness": np.full(count, 5e8)}
    variables = {name: (("mesh", "position"), curve[None]) for name, curve in curves.items()}
    fixed = {"overlap_ratio": overlap, "mesh_periods": 1}
    return xr.Dataset(variables, coords={"position": position}, attrs={**fixed, **attrs})


@pytest.mark.parametrize("count", [8, 16, 32, 64, 128, 256])
def test_the_doubt_of_few_positions_covers_what_they_miss(count):
    data = record(count)
    missed = 1.0 - np.ptp(data.ste.values) / 1e-6
    # the lines from both sides meet at the peak
    if count >= 32:
        assert _peak_doubt(data) == pytest.approx(missed / (1.0 - missed), abs=1e-9)
    assert _peak_doubt(data) >= 0.5 * missed


def test_spur_teeth_have_the_doubt_of_their_search_for_peaks():
    assert _peak_doubt(record(16, overlap=0.0, peak_doubt=0.004)) == 0.004
    assert _peak_doubt(record(16, overlap=0.0)) == 0.0
