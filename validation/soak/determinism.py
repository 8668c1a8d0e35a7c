"""The same bits whatever the threads, caches, locale, hash seed, time zone and folder."""

from __future__ import annotations

import random
import shutil
import subprocess
from functools import cache
from pathlib import Path

from validation.soak.programs import COMMANDS, contents, differences, start, trial_workspace, undisturbed
from validation.soak.trials import Outcome

PIECE = 4


@cache
def locales() -> tuple[str, ...]:
    """Locales that are installed."""
    done = subprocess.run(("locale", "-a"), capture_output=True, text=True, check=False)
    return tuple(done.stdout.split()) or ("C",)


def trial(number: int, folder: Path) -> Outcome:
    """Run a command with another environment and compare all files bit for bit."""
    rng = random.Random(f"determinism {number}")
    name = rng.choice(("run of a set", "run of a set with grids", "sweep", "run", "optimise", "run with pictures"))
    threads = rng.choice(("1", "2"))
    place = trial_workspace(name, folder, f"determinism {number} ä ö")
    if name == "sweep" and rng.random() < 0.3:
        shutil.rmtree(place / "meshes")  # a cache that is still empty
    environment = {
        "OPENBLAS_NUM_THREADS": threads,
        "OMP_NUM_THREADS": threads,
        "PYTHONHASHSEED": str(rng.randrange(1000)),
        "LC_ALL": rng.choice(locales()),
        "TZ": rng.choice(("UTC", "Asia/Kathmandu", "America/St_Johns")),
        "PYTHONOPTIMIZE": rng.choice(("", "1", "2")),
    }
    ended = start(COMMANDS[name].arguments(place), place, fresh=True, environment=environment).wait()
    wrong = ended.crash or (f"ended with {ended.code}: {ended.err[-400:]}" if ended.code else "")
    wrong = wrong or differences(contents(place / "out"), undisturbed(name, folder).contents)
    if wrong:
        return Outcome("different", f"{name} with {environment}: {wrong}")
    shutil.rmtree(place)
    return Outcome(f"{name}, {threads} thread{'s' * (threads != '1')}: the same bits", megabytes=ended.megabytes)
