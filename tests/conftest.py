"""Makes the modules that several tests share, and those of scripts, importable by name."""

import sys
from pathlib import Path

TESTS = Path(__file__).parent

sys.path[:0] = [str(TESTS), str(TESTS.parent / "scripts")]
