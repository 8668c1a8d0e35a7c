"""The command line: ``femgear`` and its commands, which stand in `femgear.commands`."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence

from femgear.commands import INTERRUPTED, LOADING

_MEMORY = 600_000_000
"""Memory that a process needs to load the libraries of a run [bytes]; with less they end or stop it."""

with contextlib.suppress(ImportError):  # Windows has no such limits
    import resource

    for _limit, _option in ((resource.RLIMIT_AS, "-v"), (resource.RLIMIT_DATA, "-d")):
        if 0 <= resource.getrlimit(_limit)[0] < _MEMORY:  # none is negative
            sys.stderr.write(
                "[E-MEMORY] this process may use too little memory\n"
                f"  found:   {resource.getrlimit(_limit)[0] / 1e6:.0f} MB\n"
                f"  allowed: {_MEMORY / 1e6:.0f} MB or more\n"
                f"  remedy:  raise the limit (ulimit {_option})\n"
            )
            raise SystemExit(3)

try:
    from femgear.commands import assistance, design, exchange, process, program, recordings, run, study
except KeyboardInterrupt:  # loading takes long enough to be interrupted, before main can say so
    sys.stderr.write("interrupted\n")
    raise SystemExit(INTERRUPTED) from None
except (ImportError, MemoryError) as error:
    sys.stderr.write(f"[E-LIBRARY] {type(error).__name__}: {' '.join(str(error).split())}\n  remedy:  {LOADING}\n")
    raise SystemExit(5) from None  # femgear.errors, where the number stands, may be what cannot be loaded

COMMANDS = assistance, design, exchange, recordings, run, study
"""Modules whose functions are the commands."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line: exit code 0, 2 (bad input), 3 (numerics), 4 (storage) or 130 (interrupted)."""
    return process.call(program.app, arguments, program="femgear")


if __name__ == "__main__":
    sys.exit(main())
