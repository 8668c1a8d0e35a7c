"""What a torque that ripples at the mesh frequency makes of the lines beside the mesh order: docs/measured.md."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear import solve, with_values
from femgear.housing.sensor import component_lines
from femgear.rigs import find_rig
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.trains.elastic.model import RADIAL, TANGENTIAL
from femgear.trains.elastic.outputs import mesh_and_ring_outputs

PAGE = Path(__file__).parents[2] / "docs" / "measured.md"
ORDERS = (92, 93, 95, 96, 98)


def heights(modes, share, torque, output) -> dict[int, float]:
    """Accelerations at orders of the set at 900 rpm over that at 96, the torque of the load rippling by a share."""
    carrier, source = 2 * np.pi * 900 / 60 * 31 / (31 + 95), np.array(modes.excitation.source)
    angle = 2 * np.pi * np.linspace(0.0, 1.0, source.shape[1], endpoint=False)
    source[-1] += share * torque * np.cos(angle)
    rippled = replace(modes, symmetry=1, excitation=replace(modes.excitation, source=source))
    response = solve_spectral(rippled.modes, rippled.excitation, np.array([95 * carrier / (2 * np.pi)]))
    field = mesh_and_ring_outputs(rippled, response, output)[1]
    lines = component_lines(field, 95, np.array([carrier]), 0.0, symmetry=1)
    size = dict(zip(lines.order.tolist(), np.abs(lines.acceleration[0]).tolist(), strict=True))
    return {order: size[order] / size[96] for order in ORDERS}


@pytest.mark.slow
def test_the_page_says_what_a_rippling_torque_makes():
    """The source that takes the power of friction is a torque at the output; friction itself is next to nothing."""
    friction = {"losses": {"friction": "constant", "coefficient": 1e-6, "excites": True}}
    coarse = {"static.flank_elements": 8, "static.positions": 16, "static.stresses": False}
    case = with_values(find_rig("snu").case(), friction | coarse)
    modes = solve(case, only="modes")["modes"]
    rows = re.findall(r"^\| (\d+) % \| (radial|along the ring) \| (.*) \|$", PAGE.read_text(encoding="utf-8"), re.M)
    assert len(rows) == 4
    for share, way, cells in rows:
        output = RADIAL if way == "radial" else TANGENTIAL
        found = heights(modes, int(share) / 100, case.operation.torque, output)
        for order, cell in zip(ORDERS, cells.split(" | "), strict=True):
            assert found[order] == pytest.approx(float(cell), abs=6e-4, rel=5e-3)
