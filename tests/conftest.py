"""Makes the modules that several tests share, and those of scripts, importable by name; shared fixtures."""

import sys
from pathlib import Path

TESTS = Path(__file__).parent

sys.path[:0] = [str(TESTS), str(TESTS.parent / "scripts")]

from small_systems import chain_excitation, geared_chain, planet_excitation, planet_set  # noqa: E402, F401
