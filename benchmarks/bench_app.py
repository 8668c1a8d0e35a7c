"""How soon a slider of the app is answered: the first numbers that are new, with their charts.

Where the contact changes they are those of the draft, which counts while the slider moves.
"""

from itertools import chain, count
from pathlib import Path
from time import process_time

import pytest

GROUP = "Sliders of the app: the first new part of the answer, read, computed, judged and drawn (reference set)"
# time of one process on one core: what else the machine does must not count
pytestmark = pytest.mark.benchmark(group=GROUP, timer=process_time)
LIMIT = 0.2
"""CPU [s] that the project promises for the median."""
CASE = Path("cases/planetary_27_40_108.toml")
CHARTS = ("static_transmission_error", "load_sharing", "contact_pattern", "order_spectrum", "dynamic_spectrum")
"""Those that the app draws at first."""
RELIEF = {"kind": "tip relief", "start_diameter": "43 mm", "amount": "4 um"}
PIN = {"planet": 1, "tangential": "4 um"}
# by what is dragged: the key of the slider, and its places, never the same twice
SLIDERS = {
    "torque": ("operation.torque", lambda n: f"{90 + 0.1 * n:g} N m"),
    "speed": ("operation.speeds[1]", lambda n: f"{3000 + n} rpm"),
    "damping": ("dynamics.damping_ratio", lambda n: 0.04 + 1e-4 * n),
    "tip relief": ("sun.modifications[0].amount", lambda n: f"{4 + 0.01 * n:g} um"),
    "pin error": ("set.pin_errors[0].tangential", lambda n: f"{4 + 0.01 * n:g} um"),
}
# what a slider needs in the case
GIVEN = {"tip relief": {"sun.modifications": [RELIEF]}, "pin error": {"set.pin_errors": [PIN]}}


@pytest.mark.parametrize("name", SLIDERS)
def test_slider(benchmark, name):
    from femgear.app.bench import Bench
    from femgear.app.document import with_entry
    from femgear.run import grid_cache

    text = CASE.read_text(encoding="utf-8")
    for key, value in ({"housing.published": None} | GIVEN.get(name, {})).items():
        text = with_entry(text, key, value)
    bench, seen = Bench(CASE.parent, cache=grid_cache()), {}
    stages = [stage["name"] for stage in bench.look(text, "case.toml")["stages"]]

    def first_new(text):
        """Stage of the first part with new numbers; what was there before is the answer to the text before."""
        bench.look(text, "case.toml")
        draft = bench.draft(text, "case.toml", CHARTS, dict(seen))
        for part in chain(draft, bench.answer(text, "case.toml", CHARTS, stages, dict(seen))):
            seen[part["stage"]] = part["number"]
            if not part["same"]:
                return part
        raise AssertionError("nothing is new")

    for part in bench.answer(text, "case.toml", CHARTS, stages):
        seen[part["stage"]] = part["number"]
    numbers, (key, place) = count(1), SLIDERS[name]
    part = benchmark.pedantic(lambda: first_new(with_entry(text, key, place(next(numbers)))), rounds=9, warmup_rounds=2)
    assert part["charts"] or part["stage"] == "modes"
    benchmark.extra_info.update(title=name, note=f"new: {part['stage']}", limit=LIMIT)
