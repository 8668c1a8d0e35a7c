"""Tasks of milliseconds that processes and Dask workers can import, with the marks that they leave."""

import os
import signal
import time
import warnings
from pathlib import Path

from femgear.errors import ContactError
from femgear.study.objectives import NUMBER, StudyQuantity

POISON = 0.5


def square(x):
    return x * x


def threads(_):
    """Threads of every BLAS that is loaded."""
    from threadpoolctl import threadpool_info

    return [one["num_threads"] for one in threadpool_info()]


def warned(x):
    warnings.warn("task says this", UserWarning, stacklevel=1)
    return x


def refused(x):
    raise ContactError("no such contact", code="E-CONTACT", key="sun.mass", value=x)


def poisoned(task):
    """Square of a number; 13 ends the process, 17 kills it once. Every try leaves a line."""
    folder, x = task
    with open(Path(folder) / f"{x}", "a", encoding="utf-8") as stream:
        stream.write(f"{os.getpid()}\n")
    if x == 13:
        os._exit(1)
    if x == 17 and len((Path(folder) / "17").read_text().split()) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def slow(seconds):
    time.sleep(seconds)
    return os.getpid()


def marked(task):
    """As `slow`, of a folder and a number that each call leaves there."""
    folder, x = task
    with open(Path(folder) / f"{os.getpid()}", "a", encoding="utf-8") as stream:
        stream.write(f"{x}\n")
    return slow(0.001)


def marks(folder):
    """Numbers of all calls of `marked`."""
    return sorted(int(x) for file in Path(folder).iterdir() for x in file.read_text().split())


def memory_of_client_and_scheduler(address, scheduler, folder):
    """MB of this process and of a scheduler after 1000, 10 000 and 30 000 calls of `marked` on a cluster."""
    import psutil

    from femgear.study.runner import Dask

    watched, sizes = (psutil.Process(), psutil.Process(scheduler)), []
    with Dask(address) as runner:
        for done, count in ((0, 1000), (1000, 9000), (10_000, 20_000)):
            items = ((str(folder), done + x) for x in range(count))
            found = [index for index, _ in runner.map(marked, items)]
            assert sorted(found) == [*range(count)]
            sizes.append([one.memory_info().rss / 1e6 for one in watched])
    return sizes


def _valley(variant):
    x, y = variant.case.dynamics.damping_ratio, variant.case.carrier.mass
    return 1.0 + (0.6 - x) ** 2 + 10.0 * (y - x**2 / 0.36) ** 2


def _ends_its_process(variant):
    if variant.case.dynamics.damping_ratio == POISON:
        os._exit(1)
    return variant.case.dynamics.damping_ratio / 7.0


VALLEY = StudyQuantity("valley", NUMBER, "gears", _valley)
DEADLY = StudyQuantity("deadly", NUMBER, "gears", _ends_its_process)
