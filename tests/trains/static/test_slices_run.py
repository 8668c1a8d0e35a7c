"""Slices in a case file: what the stages store, draw, warn of and refuse."""

from pathlib import Path

import numpy as np
import pytest
from page_examples import check_documented

from femgear.errors import CaseError
from femgear.trains.elastic.stages import solve_modes
from femgear.trains.reading import read_case, with_values
from femgear.trains.static.figures import face_load
from femgear.trains.static.results import describe_static
from femgear.trains.static.stages import solve_static

ROOT = Path(__file__).parents[3]
SLOPE = {"kind": "lead slope", "amount": "10 um"}


@pytest.fixture(scope="module")
def case():
    coarse = {"static.positions": 8, "static.flank_elements": 8, "static.slices": 7}
    return with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), coarse)


@pytest.fixture(scope="module")
def misaligned(case):
    case = with_values(case, {"sun.modifications": [SLOPE, {"kind": "lead crowning", "amount": "2 um"}]})
    return case, solve_static(case)


def test_static_results_hold_the_load_over_the_width(misaligned):
    data = misaligned[1].dataset()
    assert data["slice_load"].dims == ("mesh", "tooth", "slice", "position")
    assert data["slice"].values == pytest.approx(25e-3 * (np.arange(7) - 3) / 7)
    mean = data["slice_load"].mean("slice")
    assert np.abs(mean - data["tooth_load"]).max() < 1e-9 * data["tooth_load"].max()
    # more material at z > 0 carries more
    first = data["slice_load"].values[0].sum(axis=(0, 2))
    assert (np.diff(first) >= 0).all() and first[-1] > 2 * first[0]
    factor = data["face_load_factor"].values
    assert factor[:3] == pytest.approx(factor[0], rel=1e-6) and factor[0] > 1.5
    block = describe_static(data, 1.5e-3)
    assert block.rows[0][block.header.index("K_Hbeta")] == f"{factor[0]:.3f}"
    assert "W-FACE-LOAD" in data.attrs["warnings"]
    check_documented(data, "## static.nc")


def test_the_load_over_the_width_is_drawn(misaligned):
    figure = face_load(misaligned[1].dataset())
    image = figure.axes[0].collections[0].get_array()
    width, load = 25.0, misaligned[1].cycle.slice_load[0]
    assert image.max() == pytest.approx(load.max() / width) and np.ma.count_masked(image)


def test_modes_follow_the_softer_meshes(case, misaligned):
    """Loads on part of the width: sun-planet meshes are softer, those with the ring as they were."""
    plane = with_values(case, {"static.slices": 0})
    found = [solve_modes(one, static).dataset() for one, static in (misaligned, (plane, solve_static(plane)))]
    soft, stiff = (one["mesh_stiffness"].values for one in found)
    assert (soft[:3] < 0.9 * stiff[:3]).all() and np.abs(soft[3:] / stiff[3:] - 1).max() < 1e-3


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"static.slices": 0, "sun.modifications": [SLOPE]}, "sun.modifications[0]"),
        ({"static.back_flanks": True}, "static.back_flanks"),
        ({"static.members": "elastic", "planet.bearing_clearance": "5 um"}, "planet.bearing_clearance"),
        ({"static.slices": 100}, "static.slices"),
    ],
)
def test_what_slices_cannot_do_is_refused(case, changes, key):
    with pytest.raises(CaseError) as caught:
        solve_static(with_values(case, changes))
    assert caught.value.code == "E-SLICES" and caught.value.key == key and caught.value.file


@pytest.mark.parametrize(
    ("section", "code"),
    [
        ({"kind": "end relief", "amount": "5 um"}, "E-KEY-MISSING"),
        ({"kind": "lead slope"}, "E-KEY-MISSING"),
        ({"kind": "lead crowning", "amount": "5 um", "start_diameter": "41 mm"}, "E-MODIFICATION"),
        ({"kind": "profile slope", "amount": "5 um", "length": "3 mm"}, "E-MODIFICATION"),
    ],
)
def test_leads_have_their_own_entries(case, section, code):
    with pytest.raises(CaseError) as caught:
        with_values(case, {"sun.modifications": [section]})
    assert caught.value.code == code
