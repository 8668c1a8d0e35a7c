"""Many tasks by one and by two worker processes: tasks of a second, and growth over the number of samples."""

from functools import partial

import pytest
from stages import some_work

TASKS = "Eight tasks of about a second, over the number of worker processes"
SAMPLES = "As-built sets over their number (reference set, curves of tooth pairs known)"
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
@pytest.mark.parametrize(
    ("method", "count"), [(name, count) for name, counts in SIZES.items() for count in counts]
)
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
