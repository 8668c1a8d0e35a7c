"""Tooth pairs as springs: elimination side by side, and problems that know nothing of one another."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.contact.pair_springs import PairSprings, solve_laws, solved_side_by_side
from femgear.contact.supports import RIGID, Supports
from femgear.run import grid_cache
from femgear.study.relief import design_basis
from femgear.study.samples import Tolerances, sample_model
from femgear.trains.reading import read_case, with_value

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
SPRUNG = Supports(sun=5e7, carrier=2e8, planet=3e8)


def test_quasi_definite_systems_are_solved_side_by_side():
    """[[H, G], [G^T, -C]] with H and C positive definite, against LAPACK."""
    random = np.random.default_rng(1)
    n, forces, motions = 40, 7, 3
    spread = random.normal(size=(n, forces, forces))
    H = spread @ spread.swapaxes(1, 2) + np.eye(forces)
    G = random.normal(size=(n, forces, motions))
    soft = np.broadcast_to(-1e-6 * np.eye(motions), (n, motions, motions))
    matrix = np.block([[H, G], [G.swapaxes(1, 2), soft]])
    right = random.normal(size=(n, forces + motions))
    system = np.concatenate([matrix, right[..., None]], axis=2).transpose(1, 2, 0).copy()
    # the lower half is never looked at
    system[np.tril_indices(forces + motions, -1)] = np.nan
    expected = np.linalg.solve(matrix, right[..., None])[..., 0]
    np.testing.assert_allclose(solved_side_by_side(system).T, expected, rtol=1e-9)


@pytest.mark.parametrize(("supports", "sigma"), [(RIGID, "8 um"), (SPRUNG, "40 um")], ids=["fixed", "sprung"])
def test_no_problem_depends_on_those_beside_it(supports, sigma):
    """Planets open, and pairs of sprung sets must close one at a time."""
    case = with_value(read_case(CASE), "static.flank_elements", 8)
    basis = replace(design_basis(case, cache=grid_cache()), supports=supports)
    law = {"distribution": "normal", "sigma": sigma}
    pins = Tolerances.model_validate({"pin_errors": {"radial": law, "tangential": law}})
    model = sample_model(basis, pins, sun_torque=100.0, positions=8)
    springs, errors = model.level(*model.windows).springs, model.draw(1, 0, 60)
    shifts = model.level(*model.windows).shifts
    assert isinstance(springs, PairSprings)

    def solved(some):
        return solve_laws(springs, model.load, (shifts @ some.T).reshape(len(model.position), -1, len(some)))

    together = solved(errors)
    force, _, _, ended = together
    assert ended.all() and (force.reshape(8, 2, 3, -1, 60).sum(axis=3) == 0.0).any()
    # every planet passes on what it gets
    on_sun, on_ring = force.reshape(8, 2, 3, -1, 60).sum(axis=3).swapaxes(0, 1)
    np.testing.assert_allclose(on_sun, on_ring, atol=1e-6 * model.load.max())
    np.testing.assert_allclose(on_sun.sum(axis=1), model.load[3], rtol=1e-7)
    lost = errors.copy()
    lost[7] = np.nan
    with np.errstate(invalid="ignore"):
        spoiled = solved(lost)
    assert not spoiled[3][:, 7].any() and spoiled[3][:, np.arange(60) != 7].all()
    np.testing.assert_allclose(spoiled[0][..., :7], force[..., :7], rtol=0.0, atol=1e-9 * force.max())
    for i in (0, 17, 59):
        for values, alone in zip(together, solved(errors[i : i + 1]), strict=True):
            np.testing.assert_allclose(values[..., i], alone[..., 0], rtol=1e-9, atol=1e-9 * np.abs(alone).max())
