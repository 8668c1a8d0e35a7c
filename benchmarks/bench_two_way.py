"""Set and housing both ways: speeds, nodal diameters, harmonics, unequal planets; reading a casing."""

from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
import pytest
from memory import peak_memory
from stages import ROOT, on_bolts, on_feet, runup_on_bolts, turning_speeds, two_way
from table import growth

# time of one process on one core: what else the machine does must not count
pytestmark = pytest.mark.benchmark(timer=process_time)

RUNS = "Both ways: reference set excited as in a run, n to 14"
HARMONICS = "Both ways over the mesh harmonics of the excitation (250 rpm, n to 14)"
SPEEDS = "Both ways over the number of speeds (12 mesh harmonics, n to 14)"
DIAMETERS = "Both ways over the nodal diameters (250 rpm, 64 mesh harmonics)"
PLANETS = "Both ways: equal planets and planets that differ (5 speeds, 12 mesh harmonics, n to 8)"
ERRORS = "Both ways with errors that turn, over their mesh periods (2 speeds, 3 mesh harmonics, n to 8)"
CASINGS = "Reading a casing: 56 points of the ring, 138 modes (scripts/casing.py)"


@pytest.fixture(scope="module")
def rows():
    """Times of the rows of every group."""
    return {}


def solved(benchmark, reference, group, *, rounds=1, planets=1, **given) -> str:
    """Measure forces of both routes at some speeds; note how large they are and what they took."""
    benchmark.group, symmetry = group, reference.modes.symmetry if planets == 1 else 1
    modes = replace(reference.modes, symmetry=symmetry)
    found = benchmark.pedantic(
        two_way, args=(reference, modes), kwargs=given, rounds=rounds, warmup_rounds=1 if rounds > 1 else 0
    )
    assert found.two_way.residual.max() < 1e-6
    unknowns = len(found.two_way.order) * found.two_way.force.shape[1]
    return f"{unknowns} real unknowns a speed, {found.two_way.products.max()} products at most"


def promise(benchmark, title, note, limit):
    """Note a row and the time that the project promises for it [s]."""
    benchmark.extra_info.update(title=title, note=note, limit=limit)
    if limit is not None and benchmark.stats is not None:
        assert benchmark.stats.stats.median < limit, f"{title}: {benchmark.stats.stats.median:.2f} s"


@pytest.mark.parametrize(
    ("supported", "name", "limit"),
    [(on_bolts, "six bolts", 1.0), (on_feet, "four feet", None)],
    ids=["bolts", "feet"],
)
def test_one_speed_at_full_band(benchmark, reference, supported, name, limit):
    note = solved(benchmark, reference, RUNS, rounds=3, supported=supported)
    if memory := peak_memory("two_way" if supported is on_feet else "two_way_bolts"):
        note += f"; peak {memory['peak']:.0f} MB"
    promise(benchmark, f"one speed, 250 rpm, {name}", note, limit)


# on two cores: two processes share the speeds
@pytest.mark.benchmark(timer=perf_counter)
@pytest.mark.parametrize(("count", "limit"), [(400, 20.0), (1000, 60.0)], ids=["400", "1000"])
def test_run_up_at_full_band(benchmark, reference, count, limit):
    benchmark.group = RUNS
    assert reference.modes is not None
    found = benchmark.pedantic(runup_on_bolts, args=(reference, count), rounds=1)
    note = f"{len(found.input_speed)} speeds with those beside resonances, {found.response.lines.shape[1]} lines"
    promise(benchmark, f"run-up of {count} speeds, 300 to 3100 rpm, six bolts", note, limit)


def test_errors_that_turn_at_full_band(benchmark, reference):
    other, modes = erroneous(reference, {"runout_amplitude": "5 um"})
    benchmark.group = RUNS
    known = {"speeds": ["3100 rpm"]}
    found = benchmark.pedantic(two_way, args=(other, modes), kwargs=known, rounds=3)
    assert found.two_way.residual.max() < 1e-6
    note = f"{modes.excitation.periods} mesh periods, {found.two_way.products.max()} products"
    promise(benchmark, "5 um runout of the sun, 3100 rpm, four feet", note, 5.0)


@pytest.mark.parametrize("harmonics", [60, 120, 240, 480])
def test_growth_over_harmonics(benchmark, reference, rows, harmonics):
    note = solved(benchmark, reference, HARMONICS, harmonics=harmonics)
    note += growth(benchmark, rows, HARMONICS, harmonics)
    benchmark.extra_info.update(title=f"{harmonics} harmonics", note=note)


@pytest.mark.parametrize("count", [10, 30, 90])
def test_growth_over_speeds(benchmark, reference, rows, count):
    note = solved(benchmark, reference, SPEEDS, speeds=turning_speeds(count), harmonics=12)
    benchmark.extra_info.update(title=f"{count} speeds", note=note + growth(benchmark, rows, SPEEDS, count))


@pytest.mark.parametrize("most", [4, 8, 14])
def test_growth_over_nodal_diameters(benchmark, reference, rows, most):
    note = solved(benchmark, reference, DIAMETERS, harmonics=64, diameters=most)
    note += growth(benchmark, rows, DIAMETERS, most)
    benchmark.extra_info.update(title=f"n to {most}", note=note)


@pytest.mark.parametrize("planets", [1, 3])
def test_unequal_planets(benchmark, reference, rows, planets):
    known = {"speeds": turning_speeds(5), "harmonics": 12, "diameters": 8}
    note = solved(benchmark, reference, PLANETS, planets=planets, **known)
    note += growth(benchmark, rows, PLANETS, planets)
    title = "equal: one is solved for" if planets == 1 else "all three are solved for"
    benchmark.extra_info.update(title=title, note=note)


def erroneous(reference, errors):
    """The reference case with errors of the sun that turn, and its modes."""
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_modes
    from femgear.trains.reading import with_values

    other = type(reference)()
    other.case = with_values(reference.case, {"sun.errors": errors})
    return other, solve_modes(other.case, solve_static(other.case, cache=reference.cache))


@pytest.mark.parametrize("periods", [3, 9, 27])
def test_growth_over_mesh_periods(benchmark, reference, rows, periods):
    waves = 2.0 * np.cos(2.0 * np.pi * np.arange(27) / periods)
    other, modes = erroneous(reference, {"cumulative_pitch": [f"{one} um" for one in waves]})
    benchmark.group = ERRORS
    known = {"speeds": turning_speeds(2), "harmonics": 3, "diameters": 8}
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
    from femgear.exchange.casing_files import read_casing

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
    case = on_feet(reference.case, ["250 rpm"])
    page = (ROOT / "docs" / "bolts.md").read_text(encoding="utf-8")
    assert [round(np.degrees(one.angle)) for one in case.housing.support] == [35, 145, 215, 325]
    assert "35, 145, 215 and 325 degrees" in page
