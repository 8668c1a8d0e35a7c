"""Stiffness, mass, loads and foundations against closed forms; the checks around a solve."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from femgear.errors import FemgearError, GridError
from femgear.fe.elasticity import Material, foundation, mass, stiffness
from femgear.fe.grid import Grid
from femgear.fe.meshing import Outline, mesh_outline
from validation.reference.plane_elasticity import (
    check_solution,
    checked_solve,
    edge_load,
    rank_check,
    stress,
    to_skfem,
)

STEEL = Material(206e9, 0.3, 7850.0)


def rectangle(width, height, k, *, origin=(0.0, 0.0)):
    x, y = origin
    corners = np.array([(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
    t = np.linspace(0, 1, 2 * k + 1)[:, None]
    names = ("bottom", "right", "top", "left")
    sides = [(1 - t) * a + t * b for a, b in zip(corners, np.roll(corners, -1, axis=0))]
    return mesh_outline(Outline(tuple(zip(names, sides))))


def quarter_ring(inner, outer, k=8):
    def arc(r, a, b):
        t = np.linspace(a, b, 2 * k + 1)
        return r * np.stack([np.cos(t), np.sin(t)], axis=1)

    t = np.linspace(0, 1, 2 * k + 1)[:, None]
    bottom = (1 - t) * [inner, 0.0] + t * [outer, 0.0]
    end = (1 - t) * [0.0, outer] + t * [0.0, inner]
    outline = (("bottom", bottom), ("outer", arc(outer, 0, np.pi / 2)), ("end", end))
    return mesh_outline(Outline((*outline, ("inner", arc(inner, np.pi / 2, 0)))))


@pytest.fixture(scope="module")
def plate():
    return rectangle(2.0, 1.0, 4)


@pytest.mark.parametrize("grid", [rectangle(2.0, 1.0, 3, origin=(50.0, 7.0)), quarter_ring(0.05, 0.09)])
def test_matrices_are_those_that_scikit_fem_assembles(grid):
    """Of straight elements far from the origin, and of curved ones, at the same quadrature points."""
    from skfem import BilinearForm
    from skfem.helpers import dot, grad

    from femgear.fe.elasticity import basis, node_of_dof

    scalar = basis(grid)
    order = np.argsort(node_of_dof(grid, scalar))
    wanted = BilinearForm(lambda u, v, _: u * v).assemble(scalar).tocsr()[order][:, order]
    found = mass(grid, Material(1.0, 0.0, 1.0)).tocsr()[::2, ::2]
    assert abs(found - wanted).max() < 1e-11 * abs(wanted).max()
    # with lam = 0 the trace of both directions is 3 mu times the Laplacian
    wanted = BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(scalar).tocsr()[order][:, order]
    K = stiffness(grid, Material(2.0, 0.0, 1.0)).tocsr()
    found = (K[::2, ::2] + K[1::2, 1::2]) / 3.0
    assert abs(found - wanted).max() < 1e-10 * abs(wanted).max()


@pytest.mark.parametrize("state", ["plane strain", "plane stress"])
def test_stiffness_is_symmetric_and_has_three_rigid_motions(plate, state):
    K = stiffness(plate, STEEL, state=state, thickness=0.02)
    assert abs(K - K.T).max() == 0.0
    x, y = plate.points.T
    for motion in ([1 + 0 * x, 0 * x], [0 * x, 1 + 0 * x], [-y, x]):
        assert np.abs(K @ np.ravel(motion, order="F")).max() < 1e-13 * abs(K).max()
    value = np.linalg.eigvalsh(K.toarray())
    assert np.count_nonzero(value < 1e-10 * value[-1]) == 3


def test_uniaxial_stress_strains_by_the_textbook(plate):
    """Guards against libraries that change what their plane stress constants mean: ratio 1.0000."""
    pull = 1e8
    left = np.unique(plate.boundaries["left"])
    fixed = np.append(2 * left, 2 * left[0] + 1)
    for state, along, across in (
        ("plane stress", 1.0, -0.3),
        ("plane strain", 1 - 0.3**2, -0.3 * 1.3),
    ):
        K = stiffness(plate, STEEL, state=state, thickness=0.5)
        u = checked_solve(plate, K, edge_load(plate, "right", (pull, 0.0), thickness=0.5), fixed=fixed)
        strain = pull / STEEL.youngs_modulus
        expected = np.column_stack(
            [
                along * strain * plate.points[:, 0],
                across * strain * (plate.points[:, 1] - plate.points[left[0], 1]),
            ]
        )
        assert np.allclose(u.reshape(-1, 2), expected, rtol=0, atol=1e-11 * strain)
        field = stress(plate, STEEL, u, state=state)
        assert np.allclose(field, [pull, 0.0, 0.0], rtol=0, atol=1e-8 * pull)


def test_stresses_of_a_pull_at_an_angle_and_of_a_shear(plate):
    """A pull p at 30 degrees has p cos^2, p sin^2, p sin cos by Hooke, a shear mu times its angle."""
    pull, angle = 1e8, np.deg2rad(30.0)
    along = np.array([np.cos(angle), np.sin(angle)])
    tensor = pull * np.outer(along, along)
    strain = ((1 + 0.3) * tensor - 0.3 * pull * np.eye(2)) / 206e9
    field = stress(plate, STEEL, plate.points @ strain, state="plane stress")
    expected = pull * np.array([0.75, 0.25, np.sqrt(0.1875)])
    np.testing.assert_allclose(field, np.broadcast_to(expected, field.shape), rtol=1e-9)
    for motion in ([[0.0, 1e-4], [0.0, 0.0]], [[0.0, 0.0], [1e-4, 0.0]]):
        sheared = stress(plate, STEEL, plate.points @ np.array(motion), state="plane strain")
        exact = np.array([0.0, 0.0, 1e-4 * 206e9 / 2.6])
        np.testing.assert_allclose(sheared, np.broadcast_to(exact, sheared.shape), rtol=1e-9, atol=1.0)


def test_states_and_thicknesses_by_region():
    t = np.linspace(0, 1, 9)[:, None]
    corners = np.array([(0, 0), (2, 0), (2, 1), (0, 1)], dtype=float)
    sides = [(1 - t) * a + t * b for a, b in zip(corners, np.roll(corners, -1, axis=0))]
    outline = Outline(
        tuple(zip("abcd", sides)),
        (("middle", (1 - t) * [1.0, 0.0] + t * [1.0, 1.0]),),
        (("left", (0.5, 0.5)), ("right", (1.5, 0.5))),
    )
    grid = mesh_outline(outline)
    mixed = stiffness(
        grid,
        STEEL,
        state={"left": "plane strain", "right": "plane stress"},
        thickness={"left": 0.1, "right": 0.3},
    )
    parts = []
    for name, state, thickness in (("left", "plane strain", 0.1), ("right", "plane stress", 0.3)):
        part = Grid(grid.points, grid.triangles[grid.regions[name]])
        used, triangles = np.unique(part.triangles, return_inverse=True)
        K = stiffness(Grid(grid.points[used], triangles.reshape(-1, 6)), STEEL, state=state, thickness=thickness)
        dofs = np.ravel([2 * used, 2 * used + 1], order="F")
        place = csc_array((np.ones(len(dofs)), (dofs, np.arange(len(dofs)))), shape=(2 * grid.n_nodes, len(dofs)))
        parts.append(place @ K @ place.T)
    assert abs(mixed - parts[0] - parts[1]).max() < 1e-14 * abs(mixed).max()
    M = mass(grid, STEEL, {"left": 0.1, "right": 0.3})
    assert np.ones(2 * grid.n_nodes) @ M @ np.ones(2 * grid.n_nodes) == pytest.approx(2 * 7850 * 0.4, rel=1e-13)


def test_mass_gives_weight_and_moments_of_inertia():
    inner, outer = 0.5, 1.0
    grid = quarter_ring(inner, outer, k=12)
    M = mass(grid, STEEL, 0.02)
    x, y = grid.points.T
    shift, turn = np.ravel([1 + 0 * x, 0 * x], order="F"), np.ravel([-y, x], order="F")
    weight = 7850 * 0.02 * np.pi / 4 * (outer**2 - inner**2)
    assert shift @ M @ shift == pytest.approx(weight, rel=1e-6)
    assert turn @ M @ turn == pytest.approx(0.5 * weight * (outer**2 + inner**2), rel=2e-6)
    assert np.linalg.eigvalsh(M.toarray()).min() > 0


def test_edge_loads_have_the_right_resultants():
    grid = quarter_ring(1.0, 2.0, k=10)
    x, y = grid.points.T
    force = edge_load(grid, "inner", lambda x, n: -3e5 * n, thickness=0.1).reshape(-1, 2)
    # pressure in a bore pushes outwards; on a quarter its resultant is p r t along both axes
    np.testing.assert_allclose(force.sum(axis=0), [3e5 * 0.1, 3e5 * 0.1], rtol=1e-6)
    assert abs(np.sum(x * force[:, 1] - y * force[:, 0])) < 1e-6 * 3e4
    force = edge_load(grid, "outer", (1e5, -2e5), thickness=0.1).reshape(-1, 2)
    np.testing.assert_allclose(force.sum(axis=0), np.array([1e5, -2e5]) * 0.1 * np.pi, rtol=1e-6)
    off = np.setdiff1d(np.arange(grid.n_nodes), grid.boundaries["outer"])
    assert not force[off].any()
    with pytest.raises(GridError, match="no boundary 'rim'"):
        edge_load(grid, "rim", (1.0, 0.0))


def test_foundation_work_of_rigid_motions():
    grid = quarter_ring(1.0, 2.0, k=12)
    kr, kt, thickness, radius = 3e9, 1e9, 0.05, 2.0
    K = foundation(grid, "outer", kr, kt, thickness=thickness)
    x, y = grid.points.T
    arc = thickness * radius * np.pi / 2
    turn, shift = np.ravel([-y, x], order="F"), np.ravel([1 + 0 * x, 0 * x], order="F")
    assert turn @ K @ turn == pytest.approx(kt * radius**2 * arc, rel=1e-6)
    assert shift @ K @ shift == pytest.approx(0.5 * (kr + kt) * arc, rel=1e-6)
    assert abs(K - K.T).max() < 1e-15 * abs(K).max()


def test_foundation_pressure_is_modulus_times_displacement():
    """A full bore pressure on a ring held by a radial foundation, quarter symmetry: Lame plus spring."""
    a, b, p, k = 0.1, 0.12, 50e6, 1e11
    grid = quarter_ring(a, b, k=16)
    K = stiffness(grid, STEEL, state="plane strain", thickness=0.01)
    ground = foundation(grid, "outer", k, 0.0, thickness=0.01)
    load = edge_load(grid, "inner", lambda x, n: -p * n, thickness=0.01)
    bottom, end = np.unique(grid.boundaries["bottom"]), np.unique(grid.boundaries["end"])
    u = checked_solve(grid, K + ground, load, fixed=np.append(2 * bottom + 1, 2 * end), springs=ground)
    # Timoshenko & Goodier, section 28: stresses A +- B / r^2 with outer pressure q = k u(b)
    E, nu = 206e9 / (1 - 0.3**2), 0.3 / 0.7
    per_p = 2 * a**2 * b / (E * (b**2 - a**2))
    per_q = b * ((1 - nu) * b**2 + (1 + nu) * a**2) / (E * (b**2 - a**2))
    outer = np.unique(grid.boundaries["outer"])
    radial = np.sum(u.reshape(-1, 2)[outer] * grid.points[outer], axis=1) / b
    exact = per_p * p / (1 + per_q * k)
    # of third order in the length of the elements, on both sides of the exact value
    np.testing.assert_allclose(radial, exact, rtol=5e-5)
    assert radial.mean() == pytest.approx(exact, rel=1e-6)


def test_skfem_grid_keeps_names_and_order(plate):
    other = to_skfem(plate)
    assert other.nelements == len(plate.triangles)
    np.testing.assert_allclose(other.p[:, other.t[:3]].transpose(2, 1, 0), plate.points[plate.triangles[:, :3]])
    for name, edges in plate.boundaries.items():
        ends = np.sort(other.p[:, other.facets[:, other.boundaries[name]]].transpose(2, 1, 0), axis=1)
        np.testing.assert_allclose(ends, np.sort(plate.points[edges[:, :2]], axis=1))
    assert np.array_equal(other.subdomains["body"], plate.regions["body"])


def test_free_and_half_held_bodies_are_refused(plate):  # bad input 59
    K = stiffness(plate, STEEL)
    load = edge_load(plate, "right", (1.0, 0.0))
    left = np.unique(plate.boundaries["left"])
    with pytest.raises(GridError) as error:
        checked_solve(plate, K, load, fixed=[])
    assert error.value.code == "E-GRID-FREE" and "part 1 of 1" in str(error)
    with pytest.raises(GridError, match=r"can move along \(-?0.000, -?1.000\)"):
        checked_solve(plate, K, load, fixed=2 * left)
    pin = left[0]
    with pytest.raises(GridError) as error:
        checked_solve(plate, K, load, fixed=[2 * pin, 2 * pin + 1])
    x, y = plate.points[pin]
    assert f"can turn about ({x:g}, {y:g}) m" in str(error)
    rank_check(plate, [2 * pin, 2 * pin + 1, 2 * left[1]])


def test_every_part_must_be_held():
    one, two = rectangle(1.0, 1.0, 2), rectangle(1.0, 1.0, 2, origin=(5.0, 0.0))
    both = Grid(np.vstack([one.points, two.points]), np.vstack([one.triangles, two.triangles + one.n_nodes]))
    held = np.unique(one.boundaries["left"])
    with pytest.raises(GridError, match="part 2 of 2") as error:
        rank_check(both, np.append(2 * held, 2 * held + 1))
    assert "around (5.5, 0.5) m" in str(error)


def test_springs_hold_a_body():
    grid = quarter_ring(1.0, 2.0)
    rank_check(grid, [], springs=foundation(grid, "outer", 1e9, 1e9, thickness=0.1))
    with pytest.raises(GridError, match=r"can turn about \(0, 0\) m"):
        rank_check(grid, [], springs=foundation(grid, "outer", 1e9, 0.0, thickness=0.1))


def test_bad_solutions_are_refused(plate):
    K = stiffness(plate, STEEL)
    left = np.unique(plate.boundaries["left"])
    fixed = np.append(2 * left, 2 * left + 1)
    load = edge_load(plate, "right", (1e6, 2e6))
    u = checked_solve(plate, K, load, fixed=fixed)
    assert check_solution(K, u, load, fixed=fixed) < 1e-10
    with pytest.raises(FemgearError) as error:
        check_solution(K, 1.13 * u, load, fixed=fixed)
    assert error.value.code == "E-SOLVE" and "1.30e-01" in str(error)
    with pytest.raises(FemgearError) as error:
        check_solution(K, np.where(np.arange(len(u)) == 3, np.nan, u), load, fixed=fixed)
    assert error.value.code == "E-SOLVE"
    with pytest.raises(FemgearError) as error:
        check_solution(-K, -u, load, fixed=fixed)
    assert error.value.code == "E-SOLVE"
    with pytest.raises(FemgearError) as error:
        checked_solve(plate, K, np.where(np.arange(len(u)) == 3, np.inf, load), fixed=fixed)
    assert error.value.code == "E-SOLVE"


def test_prescribed_displacements_and_several_loads(plate):
    K = stiffness(plate, STEEL, state="plane stress")
    edges = np.unique(np.concatenate([plate.boundaries[n].ravel() for n in plate.boundaries]))
    field = plate.points @ np.array([[1e-3, 2e-3], [-5e-4, 3e-3]])
    fixed = np.append(2 * edges, 2 * edges + 1)
    u = checked_solve(plate, K, np.zeros(2 * plate.n_nodes), fixed=fixed, values=field.ravel()[fixed])
    assert np.allclose(u, field.ravel(), rtol=0, atol=1e-15)
    left = np.unique(plate.boundaries["left"])
    loads = np.stack([edge_load(plate, "right", (1.0, 0.0)), edge_load(plate, "top", (0.0, 1.0))], axis=1)
    fixed = np.append(2 * left, 2 * left + 1)
    both = checked_solve(plate, K, loads, fixed=fixed)
    for column in range(2):
        np.testing.assert_allclose(both[:, column], checked_solve(plate, K, loads[:, column], fixed=fixed), rtol=1e-9)
