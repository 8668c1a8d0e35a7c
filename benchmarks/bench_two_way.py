"""Set and housing both ways: speeds, nodal diameters, harmonics, unequal planets; reading a casing."""

from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
import pytest
from memory import peak_memory
from stages import ROOT, on_feet, two_way
from table import growth

# time of one process on one core: what else the machine does must not count
pytestmark = pytest.mark.benchmark(timer=process_time)

WAYS = "Both ways and one: reference set on four feet, six harmonics of the response, n to 14"
SPEEDS = "Both ways over the number of speeds (six harmonics, n to 14)"
DIAMETERS = "Both ways over the nodal diameters (20 speeds, six harmonics)"
HARMONICS = "Both ways over the harmonics of the response (20 speeds, n to 14)"
PLANETS = "Both ways: equal planets and planets that differ (5 speeds, three harmonics, n to 8)"
ERRORS = (
    "Both ways with errors of the sun that turn, over their mesh periods (two speeds, six harmonics, n to 8)"
)
CASINGS = "Reading a casing: 56 points of the ring, 138 modes (scripts/casing.py)"
TIME, MEMORY = 60.0, 500.0
"""What is promised of 1000 speeds [s], [MB]."""


@pytest.fixture(scope="module")
def rows():
    """Times of the rows of every group."""
    return {}


def solved(benchmark, reference, group, *, rounds=3, planets=1, **given):
    """One row of forces of both routes at some speeds; how many unknowns a speed has."""
    benchmark.group, symmetry = group, reference.modes.symmetry if planets == 1 else 1
    modes = replace(reference.modes, symmetry=symmetry)
    found = benchmark.pedantic(two_way, args=(reference, modes), kwargs=given, rounds=rounds,
                               warmup_rounds=1 if rounds > 1 else 0)  # fmt: skip
    assert found.two_way.residual.max() < 1e-8
    return 2 * len(found.two_way.order) * found.two_way.force.shape[1] // 2


# on two cores: speeds are solved side by side
@pytest.mark.benchmark(timer=perf_counter)
def test_thousand_speeds(benchmark, reference):
    unknowns = solved(benchmark, reference, WAYS, rounds=1, count=1000)
    memory = peak_memory("two_way")
    note = f"{unknowns} real unknowns a speed"
    if memory:
        note += f"; peak {memory['peak']:.0f} MB, promised {MEMORY:.0f}"
        assert memory["peak"] < MEMORY, note
    benchmark.extra_info.update(title="1000 speeds", note=note, limit=TIME)
    if benchmark.stats is not None:
        assert benchmark.stats.stats.median < TIME, f"{benchmark.stats.stats.median:.1f} s"


@pytest.mark.parametrize("count", [50, 150, 450])
def test_growth_over_speeds(benchmark, reference, rows, count):
    solved(benchmark, reference, SPEEDS, rounds=1, count=count)
    benchmark.extra_info.update(title=f"{count} speeds", note=growth(benchmark, rows, SPEEDS, count)[2:])


@pytest.mark.parametrize("most", [4, 8, 14])
def test_growth_over_nodal_diameters(benchmark, reference, rows, most):
    unknowns = solved(benchmark, reference, DIAMETERS, count=20, diameters=most)
    note = f"{unknowns} real unknowns a speed" + growth(benchmark, rows, DIAMETERS, most)
    benchmark.extra_info.update(title=f"n to {most}", note=note)


@pytest.mark.parametrize("harmonics", [3, 6, 12])
def test_growth_over_harmonics(benchmark, reference, rows, harmonics):
    unknowns = solved(benchmark, reference, HARMONICS, count=20, harmonics=harmonics)
    note = f"{unknowns} real unknowns a speed" + growth(benchmark, rows, HARMONICS, harmonics)
    benchmark.extra_info.update(title=f"{harmonics} harmonics", note=note)


@pytest.mark.parametrize("planets", [1, 3])
def test_unequal_planets(benchmark, reference, rows, planets):
    known = {"count": 5, "harmonics": 3, "diameters": 8}
    unknowns = solved(benchmark, reference, PLANETS, planets=planets, **known)
    note = f"{unknowns} real unknowns a speed" + growth(benchmark, rows, PLANETS, planets)
    title = "equal: one is solved for" if planets == 1 else "all three are solved for"
    benchmark.extra_info.update(title=title, note=note)


@pytest.mark.parametrize("periods", [3, 9, 27])
def test_growth_over_mesh_periods(benchmark, reference, rows, periods):
    from femgear.trains.elastic.stages import solve_modes
    from femgear.trains.reading import with_values
    from femgear.trains.static.stages import solve_static

    waves = 2.0 * np.cos(2.0 * np.pi * np.arange(27) / periods)
    case = with_values(reference.case, {"sun.errors": {"cumulative_pitch": [f"{one} um" for one in waves]}})
    modes = solve_modes(case, solve_static(case, cache=reference.cache))
    other = type(reference)()
    other.case = case
    benchmark.group = ERRORS
    known = {"count": 2, "diameters": 8}
    found = benchmark.pedantic(two_way, args=(other, modes), kwargs=known, rounds=3, warmup_rounds=1)
    assert found.two_way.residual.max() < 1e-6
    note = f"{len(found.two_way.order)} carrier orders" + growth(benchmark, rows, ERRORS, periods)
    benchmark.extra_info.update(title=f"{periods} mesh periods", note=note)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    from casing import Casing, write_casing

    path = tmp_path_factory.mktemp("casing")
    write_casing(Casing(), path)
    return path


@pytest.mark.parametrize("name", ["casing.npz", "surface.npz", "casing.pch", "casing.op4", "casing.uff"])
def test_reading_a_casing(benchmark, folder, name):
    from femgear.housing.casing_files import read_casing

    benchmark.group = CASINGS
    table = None if name.endswith("npz") else folder / ("nodes_held.csv" if "uff" in name else "nodes.csv")
    way = np.sin(np.radians(20.0)), -np.cos(np.radians(20.0))
    known = {"direction": way, "pitch_radius": 0.081, "max_diameter": 14, "damping_ratio": 0.02}
    found = benchmark.pedantic(
        read_casing, args=(folder / name,), kwargs={**known, "nodes": table}, rounds=3, warmup_rounds=1
    )
    assert len(found.natural_frequency) == 138
    benchmark.extra_info.update(title=name, note=f"{(folder / name).stat().st_size / 1e6:.2f} MB")


def test_the_case_has_the_feet_of_its_page(reference):
    """docs/bolts.md says where they stand."""
    case = on_feet(reference.case, 6, 14, 2)
    page = (ROOT / "docs" / "bolts.md").read_text(encoding="utf-8")
    assert [round(np.degrees(one.angle)) for one in case.housing.support] == [35, 145, 215, 325]
    assert "35, 145, 215 and 325 degrees" in page
