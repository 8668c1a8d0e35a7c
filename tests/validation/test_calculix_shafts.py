"""Round solids: elements that fit one another, means of sections, a bar in tension by CalculiX."""

from collections import Counter

import numpy as np
import pytest

from femgear.fe.beam import AXES, ShaftPart
from validation.calculix import installed
from validation.calculix_shafts import (
    ALL,
    HIGH,
    SLENDER,
    UNIFORM,
    Bearing,
    Shaft,
    assembled,
    beam_statics,
    round_solid,
    solid_statics,
)

_FACES = {
    20: ([0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]),
    15: ([0, 1, 2], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]),
}


@pytest.mark.parametrize(
    "shaft",
    [pytest.param(UNIFORM, marks=pytest.mark.slow), pytest.param(SLENDER, marks=pytest.mark.slow), ALL, HIGH],
    ids=["uniform", "slender", "all", "high"],
)
def test_elements_fit_and_the_free_faces_are_the_surface(shaft):
    solid = round_solid(shaft)
    faces = Counter(
        tuple(sorted(row[side]))
        for elements in (solid.hexahedra, solid.wedges)
        for row in elements
        for side in _FACES[elements.shape[1]]
    )
    assert max(faces.values()) == 2
    # free corners lie on the surface: at a radius of the shaft there, or at a step or an end
    free = np.unique([node for face, count in faces.items() if count == 1 for node in face])
    z, radius = solid.points[free, 2], np.hypot(*solid.points[free, :2].T)
    edges = np.concatenate([[0.0], np.cumsum([part.length for part in shaft.parts])])
    for place, r in zip(z, radius, strict=True):
        if np.abs(edges - place).min() > 1e-9:
            part = int(np.searchsorted(edges, place)) - 1
            section = shaft.parts[part].section((place - edges[part]) / shaft.parts[part].length)
            assert min(abs(2 * r - section.outer_diameter), abs(2 * r - section.inner_diameter)) < 1e-8


def test_means_of_sections_are_those_of_rigid_motions():
    solid = round_solid(ALL)
    turn, shift = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -3.0])
    for place, means in solid.means.items():
        moved = shift + np.cross(turn, solid.points - [0.0, 0.0, place])
        found = [float((means[axis] * moved).sum()) for axis in AXES]
        np.testing.assert_allclose(found, [*shift, *turn], atol=1e-12)


@pytest.mark.skipif(not installed(), reason="CalculiX is not installed")
def test_a_bar_on_springs_twists_and_stretches_as_a_beam():
    springs = dict(zip(AXES, (1e9, 1e9, 1e9, 1e7, 1e7, 1e7), strict=True))
    shaft = Shaft((ShaftPart(0.12, 0.04, 0.02),), (Bearing(0.0, springs),), (0.12,))
    load = {(0.12, "z"): 1e4, (0.12, "rotation"): 100.0}
    (solid,), beam = solid_statics(shaft, [load]), beam_statics(*assembled(shaft), load)
    np.testing.assert_allclose(solid[0.12][[2, 5]], beam[0.12][[2, 5]], rtol=1e-3)
