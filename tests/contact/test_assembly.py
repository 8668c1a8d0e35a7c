"""What a contact problem takes from that of another position."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from femgear.contact.assembly import ContactProblem


def cells(*places) -> Any:
    """A contact problem of which only mesh, pair and cell of the candidates are known."""
    mesh, pair, cell = np.array(places).T
    return SimpleNamespace(mesh=mesh, pair=pair, cell=cell)


def test_a_start_is_taken_from_the_same_cells_and_from_all_springs():
    before = cells((0, 0, 5), (0, 1, 3), (1, 0, 2), (1, 1, 3), (5, 2, 35))
    now = cells((1, 1, 3), (0, 1, 3), (0, 1, 4), (0, 0, 5), (1, 0, 2), (5, 2, 35), (4, 2, 35), (2, 0, 5))
    springs = [True, False, True]
    for touching in ([0, 1, 2, 3, 4], [1, 4], [0, 3], []):
        active = np.isin(np.arange(5), touching)
        start = ContactProblem.warm_start(now, before, np.append(active, springs))
        came = [{0: 3, 1: 1, 2: 4, 3: 0, 4: 5}[cell] for cell in touching]
        assert start.tolist() == [*np.isin(np.arange(8), came).tolist(), *springs]
