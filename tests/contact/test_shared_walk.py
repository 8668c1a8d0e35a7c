"""Walks whose positions two processes share: the numbers of one."""

import subprocess
import sys

import numpy as np
import pytest

from femgear import second_process
from femgear.contact import cycle
from femgear.stages.static import solve_static
from femgear.trains.elastic.stages import solve_modes
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

SLOPE = {"kind": "lead slope", "amount": "10 um"}
FEW = {"static.flank_elements": 6, "static.stresses": False}
SPUR = {"sun.modifications": [SLOPE], "static.slices": 9, "static.positions": 16}
HELICAL = {"static.slices": 9, "static.positions": 8, "static.flank_elements": 4}


@pytest.mark.parametrize(
    ("name", "entries"),
    [pytest.param("planetary_27_40_108", SPUR, marks=pytest.mark.slow), ("helical_23_24_73", HELICAL)],
)
def test_two_processes_find_the_numbers_of_one(name, entries, monkeypatch):
    case, shared, found = with_values(read_case(f"cases/{name}.toml"), FEW | entries), [], []
    tasks = second_process.shared
    # parts of a walk as many as one of 72 positions has
    monkeypatch.setattr(cycle, "_ROWS", cycle._ROWS // 3)
    monkeypatch.setattr(second_process, "shared", lambda parts: shared.append(len(parts)) or tasks(parts))
    for two in (True, False):
        monkeypatch.setattr(second_process, "second_core", lambda two=two: two)
        static = solve_static(case)
        found.append((static.dataset(), solve_modes(case, static).dataset()))
    # of helical teeth the positions too, not the gears alone
    assert 3 in shared and (max(shared) > 3) == (name == "helical_23_24_73")
    for one, other in zip(*found, strict=True):
        for variable in ("ste", "mesh_stiffness", "slice_load", "supported_stiffness"):
            if variable in one:
                scale = np.abs(other[variable]).max()
                np.testing.assert_allclose(one[variable], other[variable], rtol=0.0, atol=1e-12 * scale)


ORDERS = """
import pickle
import numpy as np
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.case.gear_set import planetary_set
from femgear.fe.elasticity import Material
from femgear.trains.reading import read_case

steel = Material(206e9, 0.3, 7850.0)
gears = planetary_set(read_case("cases/planetary_27_40_108.toml"))
bodies = make_bodies(make_sectors(gears, steel, flank_elements=6), steel)


def strides(value, name=""):
    if isinstance(value, np.ndarray):
        yield name, value.shape, value.strides
    for key, part in getattr(value, "__dict__", {}).items():
        yield from strides(part, f"{name}.{key}")
    for number, part in enumerate(value if isinstance(value, (list, tuple)) else ()):
        yield from strides(part, f"{name}[{number}]")


here, there = (list(strides(one)) for one in (bodies, pickle.loads(pickle.dumps(bodies))))
assert len(here) > 50
print([one for one, other in zip(here, there, strict=True) if one != other])
"""


@pytest.mark.slow
def test_gears_from_another_process_have_the_same_order_in_memory():
    """Which process condenses a gear is chance, and products round by the order: results would change by it."""
    run = subprocess.run([sys.executable, "-c", ORDERS], capture_output=True, text=True, timeout=120)
    assert run.stdout.strip() == "[]", run.stdout + run.stderr
