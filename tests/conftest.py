"""Makes the modules that several tests share, and those of scripts, importable by name; shared fixtures."""

import functools
import os
import sys
from pathlib import Path

import numpy as np
import pytest

TESTS = Path(__file__).parent

sys.path[:0] = [str(TESTS), str(TESTS.parent / "scripts")]

from small_systems import chain_excitation, geared_chain, planet_excitation, planet_set  # noqa: E402, F401


@pytest.fixture(scope="session", autouse=True)
def grids_are_made_once(tmp_path_factory):
    """One process of Gmsh for each outline, whatever tests and workers ask for it.

    The real function stays reachable as ``meshing._run_gmsh.__wrapped__``.
    """
    from femgear.fe import meshing

    # workers of pytest-xdist have folders of their own below a common one
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "outlines"
    folder.mkdir(exist_ok=True)

    @functools.wraps(meshing._run_gmsh)
    def run_once(plan):
        path = folder / f"{meshing._content_hash(plan)}.npz"
        if not path.exists():
            made = path.with_suffix(f".{os.getpid()}.{id(plan)}.npz")
            np.savez(made, **run_once.__wrapped__(plan))
            made.replace(path)
        with np.load(path) as file:
            return dict(file)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshing, "_run_gmsh", run_once)
        yield
