"""Many tasks by one and by two worker processes: tasks of a second, and growth over the number of samples."""

from functools import partial
from time import process_time

import pytest
from stages import some_work

TASKS = "Eight tasks of about a second, over the number of worker processes"
SAMPLES = "As-built sets over their number (reference set, curves of tooth pairs known)"
SLICED = "As-built sets in slices of the face width (reference set, CPU)"
SIZES = {"spring": (1000, 2000, 4000, 8000), "exact": (100, 200, 400)}


@pytest.fixture(scope="module", params=[1, 2], ids=["1 worker", "2 workers"])
def runner(request):
    """Processes that have begun, and loaded what they need."""
    from femgear.study.runner import Processes

    with Processes(request.param) as found:
        assert len([*found.map(some_work, [1] * 4)]) == 4
        yield found


@pytest.fixture(scope="module")
def medians():
    """Medians of the rows so far, which later ones are compared with."""
    return {}


@pytest.fixture(scope="module")
def model(reference):
    from femgear.study.relief import DesignBasis
    from femgear.study.samples import Tolerances, sample_model

    law = {"distribution": "normal", "sigma": "3 um"}
    gear, pins = {"cumulative_pitch": law}, {"radial": law, "tangential": law}
    tolerances = {"sun": gear, "planet": gear, "ring": gear, "pin_errors": pins}
    basis = DesignBasis(reference.gears, reference.bodies)
    return sample_model(basis, Tolerances.model_validate(tolerances), sun_torque=reference.sun_torque)


def record(benchmark, medians, key, title, note=""):
    """A row whose note says how many times faster it is than one worker."""
    workers, *what = key
    # without measurement (--benchmark-disable) there is nothing to compare
    medians[key] = median = benchmark.stats.stats.median if benchmark.stats is not None else 1.0
    if (1, *what) in medians and workers > 1:
        note += f"; {medians[1, *what] / median:.2f} times as fast as one worker"
    benchmark.extra_info.update(title=title, note=note.lstrip("; "))


@pytest.mark.benchmark(group=TASKS)
def test_tasks_of_a_second(benchmark, medians, runner):
    found = benchmark.pedantic(lambda: [*runner.map(some_work, [12] * 8)], rounds=2)
    assert len(found) == 8
    record(benchmark, medians, (runner.workers, "tasks"), f"{runner.workers} worker processes")


@pytest.mark.benchmark(group=SAMPLES)
@pytest.mark.parametrize(("method", "count"), [(name, count) for name, counts in SIZES.items() for count in counts])
def test_samples(benchmark, medians, runner, model, method, count):
    from femgear.study.sample_results import _BLOCKS, _block

    size, block = _BLOCKS[method], partial(_block, model, 1, method == "exact")
    items = [(first, min(first + size, count)) for first in range(0, count, size)]
    found = benchmark.pedantic(lambda: dict(runner.map(block, items)), rounds=1)
    assert sum(len(one["transmission_error"]) for one in found.values()) == count
    key, first = (runner.workers, method, count), (runner.workers, method, SIZES[method][0])
    title = f"{count} samples, {'tooth pairs as springs' if method == 'spring' else 'exactly'}, "
    record(benchmark, medians, key, title + f"{runner.workers} workers")
    each = f"{1e3 * medians[key] / count:.3g} ms a sample; {count / first[2]:g} times as many take "
    note = f"{each}{medians[key] / medians[first]:.2f} times as long"
    benchmark.extra_info["note"] = "; ".join(filter(None, (note, benchmark.extra_info["note"])))


@pytest.fixture(scope="module")
def sliced():
    """Reference set in 25 slices, whose leads and axes are tolerances."""
    from femgear.run import grid_cache
    from femgear.study.relief import design_basis, sun_torque
    from femgear.study.samples import Tolerances, sample_model, sample_positions
    from femgear.trains.reading import read_case, with_values

    case = with_values(read_case("cases/planetary_27_40_108.toml"), {"static.slices": 25})
    law = {"distribution": "normal", "sigma": "3 um"}
    askew = {"distribution": "normal", "sigma": "0.1 mrad"}
    tolerances = {
        "sun": {"cumulative_pitch": law, "lead_slope": law, "misalignment": {"x": askew, "y": askew}},
        "planet": {"lead_slope": law, "misalignment": {"radial": askew, "tangential": askew}},
        "ring": {"lead_slope": law},
        "pin_errors": {"radial": law, "tangential": law},
    }
    basis = design_basis(case, cache=grid_cache())
    torque = sun_torque(case, basis.gears)
    positions = sample_positions(basis, torque, 16)
    return sample_model(basis, Tolerances.model_validate(tolerances), sun_torque=torque, positions=positions)


@pytest.mark.benchmark(group=SLICED, timer=process_time)
@pytest.mark.parametrize(("method", "count"), [("spring", 512), ("exact", 4)])
def test_samples_in_slices(benchmark, sliced, method, count):
    from femgear.study.samples import exact_numbers, solve_samples

    errors = sliced.draw(1, 0, count)
    found = benchmark.pedantic(
        lambda: solve_samples(sliced, errors, exact=method == "exact"), rounds=3, warmup_rounds=1
    )
    exact = exact_numbers(sliced, errors[:4])
    missed = abs(found["transmission_error"][:4] / exact["transmission_error"] - 1.0).max()
    title = f"{count} samples in 25 slices, {'as springs' if method == 'spring' else 'exactly'}"
    median = benchmark.stats.stats.median if benchmark.stats is not None else 0.0
    note = f"{1e3 * median / count:.3g} ms a sample at {len(sliced.position)} positions"
    note += f"; STE of four within {missed:.1e}" if method == "spring" else ""
    benchmark.extra_info.update(title=title, note=note)
