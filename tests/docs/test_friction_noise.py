"""docs/friction_noise.md: its example prints what it says, and teeth bend under friction as much as it says."""

import re

import numpy as np
import pytest
from page_examples import read_page, run_examples
from scipy.sparse.linalg import spsolve

from femgear.contact.bodies import flank_load_columns, flank_stations
from femgear.stages.static import solve_static
from femgear.trains.reading import read_case, with_values

PAGE, EXAMPLES, PRINTED = read_page("friction_noise.md")


@pytest.mark.slow
def test_examples_print_what_the_page_says():
    assert run_examples("friction_noise.md", EXAMPLES) == PRINTED and len(PRINTED) == 1


@pytest.mark.slow
def test_teeth_bend_under_friction_as_the_page_says():
    """Forces over a millimetre of the flank, 4 mm before and after the pitch point, of a sector held at its cuts."""
    static = solve_static(with_values(read_case("cases/spur_pair.toml"), {"static.stresses": False}))
    gears, shares = static.planetary_set, []
    for gear, sector in zip(gears.gears, static.sectors.gears, strict=True):
        grid, stations = sector.grid, flank_stations(sector.grid, gear)
        held = np.concatenate([np.unique(grid.boundaries[name]) for name in ("rim", "cut_left", "cut_right")])
        free = np.setdiff1d(np.arange(2 * len(grid.points)), [*(2 * held), *(2 * held + 1)])
        along = flank_load_columns(grid, stations)
        tangent = np.zeros(along.shape)
        at = np.arange(len(stations.nodes))
        tangent[2 * stations.nodes, at] = -stations.normals[:, 1]
        tangent[2 * stations.nodes + 1, at] = stations.normals[:, 0]
        stiffness = sector.stiffness.tocsc()[free][:, free]
        pitch = gear.base_radius * np.tan(gears.kinds[0].working_pressure_angle)
        for place in (-4e-3, 0.0, 4e-3):
            weight = np.exp(-(((stations.roll - pitch - place) / 0.6e-3) ** 2))
            loads = np.column_stack([along @ weight, tangent @ weight])[free] / weight.sum()
            moved = spsolve(stiffness, loads)
            shares.append(loads[:, 0] @ moved[:, 1] / (loads[:, 0] @ moved[:, 0]))
    low, high = map(float, re.search(r"by\s+([\d.]+)\s+to\s+([\d.]+)\s+of\s+what\s+an\s+equal", PAGE).groups())
    assert (round(min(shares), 2), round(max(shares), 2)) == (low, high)
    assert 0.06 * min(shares) == pytest.approx(0.01, abs=0.005) and 0.06 * max(shares) == pytest.approx(0.03, abs=0.005)
