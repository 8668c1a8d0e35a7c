"""Peak memory of one stage, measured in a process of its own: ``python benchmarks/memory.py STAGE``."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path


def peak_memory(name: str) -> dict[str, float] | None:
    """Resident memory of a fresh process before a stage and its peak during the stage [MB].

    Returns
    -------
    dict with ``before`` and ``peak``, or None where the system does not tell (other than Linux).
    """
    if not Path("/proc/self/clear_refs").exists():
        return None
    done = subprocess.run([sys.executable, __file__, name], capture_output=True, text=True, timeout=300, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def _status(key: str) -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(key + ":"):
            return int(line.split()[1]) / 1024
    raise KeyError(key)


def _measure(name: str) -> None:
    from stages import STAGES, Reference

    from femgear.stages.protocol import one_blas_thread

    stage, reference = STAGES[name], Reference()
    with one_blas_thread():
        for need in stage.needs:
            getattr(reference, need)
        before = _status("VmRSS")
        # the kernel forgets the highest water mark so far
        Path("/proc/self/clear_refs").write_text("5")
        stage.run(reference)
    print(json.dumps({"before": before, "peak": _status("VmHWM")}))


if __name__ == "__main__":
    _measure(sys.argv[1])
