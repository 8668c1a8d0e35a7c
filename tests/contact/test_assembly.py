"""What a contact problem takes from that of another position."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femgear.contact.assembly import Candidates, ContactProblem


def cells(*places) -> Any:
    """A contact problem of which only mesh, pair and cell of the candidates are known."""
    mesh, pair, cell = np.array(places).T
    return SimpleNamespace(mesh=mesh, pair=pair, cell=cell)


@pytest.mark.decisive
def test_a_start_is_taken_from_the_same_cells_and_from_all_springs():
    before = cells((0, 0, 5), (0, 1, 3), (1, 0, 2), (1, 1, 3), (5, 2, 35))
    now = cells((1, 1, 3), (0, 1, 3), (0, 1, 4), (0, 0, 5), (1, 0, 2), (5, 2, 35), (4, 2, 35), (2, 0, 5))
    springs = [True, False, True]
    for touching in ([0, 1, 2, 3, 4], [1, 4], [0, 3], []):
        active = np.isin(np.arange(5), touching)
        start = ContactProblem.warm_start(now, before, np.append(active, springs))
        came = [{0: 3, 1: 1, 2: 4, 3: 0, 4: 5}[cell] for cell in touching]
        assert start.tolist() == [*np.isin(np.arange(8), came).tolist(), *springs]


def test_contact_reaches_the_end_of_a_flank_where_its_first_or_last_cell_does():
    """Four windows of five cells, of which the last two windows hold three: both ends, one, none."""
    candidate = np.ones((1, 4, 5), bool)
    candidate[0, 2:, 3:] = False
    touching = np.zeros((1, 4, 5), bool)
    at_edge = np.zeros((2, 1, 4), bool)
    found: Any = SimpleNamespace(candidate=candidate, at_edge=at_edge)
    # the low end, then the high one: a contact in one cell alone, wherever it is
    for end, reached in ((0, (0, 0, 0, 0)), (1, (4, 4, 2, 2))):
        for window in range(4):
            for cell in range(5 if window < 2 else 3):
                touching[:], at_edge[:] = False, False
                touching[0, window, cell] = True
                assert not Candidates.at_flank_end(found, touching).any()
                at_edge[end] = True
                expected = np.zeros((1, 4), bool)
                expected[0, window] = cell == reached[window]
                assert np.array_equal(Candidates.at_flank_end(found, touching), expected)
