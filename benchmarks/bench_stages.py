"""Time, memory and size of every stage of the reference case: ``make bench``."""

import pytest
from memory import peak_memory
from stages import STAGES, baseline
from table import BASELINE


@pytest.mark.benchmark(group=BASELINE)
def test_baseline(benchmark):
    benchmark.pedantic(baseline, rounds=9, warmup_rounds=1)


@pytest.mark.benchmark(group="Stages")
@pytest.mark.parametrize("name", STAGES)
def test_stage(benchmark, reference, name):
    stage = STAGES[name]
    for need in (*stage.needs, "grids"):
        getattr(reference, need)
    result = benchmark.pedantic(stage.run, args=(reference,), rounds=stage.rounds, warmup_rounds=1)
    # processes of their own
    others = {"demo", "without_pictures", "first_line", "script", "reading", "help", "package"}
    memory = {} if name in others else peak_memory(name) or {}
    if memory:
        benchmark.extra_info.update(peak=memory["peak"], added=memory["peak"] - memory["before"])
    benchmark.extra_info.update(title=stage.title, unknowns=stage.unknowns(reference, result), limit=stage.limit)
