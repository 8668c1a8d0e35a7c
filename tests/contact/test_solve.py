"""The contact problem against a general quadratic program, springs by hand, and its own conditions."""

from dataclasses import replace

import daqp
import numpy as np
import pytest

from femgear.contact.solve import solve_contact
from femgear.errors import ContactError
from validation.reference.closed_form import share_load
from validation.reference.hertz import surface_relative_to_depth
from validation.reference.tangent import mesh_tangent_matrix, tangent_stiffness


def planetary_motions(mesh, n_planets):
    """Columns for N planets and the sun; mesh order sun-planet 1..N, planet 1-ring..N."""
    G = np.zeros((len(mesh), n_planets + 1))
    G[np.arange(len(mesh)), mesh % n_planets] = np.where(mesh < n_planets, -1.0, 1.0)
    G[mesh < n_planets, n_planets] = 1.0
    return G


def random_planetary(rng, *, n_planets, pairs, cells, gap_size, floating=False, uneven_arms=False):
    """A problem with the structure of a planetary set: half-plane windows on bodies that couple meshes."""
    n_meshes, width = 2 * n_planets, 3e-4
    window = np.repeat(np.arange(n_meshes), pairs)
    x = (np.arange(cells) + 0.5) / cells * width - width / 2
    local = surface_relative_to_depth(x[:, None] - x, width / cells / 2, 3e-4, 79e9, 0.3) / 12.5e-3
    shares_body = (window[:, None] % n_planets == window % n_planets) | (
        (window[:, None] < n_planets) == (window < n_planets)
    )
    noise = rng.normal(size=shares_body.shape)
    smooth = shares_body * (noise @ noise.T) / len(window) * rng.uniform(0, 0.5) + np.eye(len(window))
    values, vectors = np.linalg.eigh(smooth)
    smooth = 2e-9 * (vectors * np.maximum(values, 0.05)) @ vectors.T
    H = np.kron(np.eye(len(window)), local) + np.kron(smooth, np.ones((cells, cells)))
    middle = rng.uniform(-0.3, 0.3, len(window))[:, None] * width
    profile = (x - middle) ** 2 / (2 * rng.uniform(4e-3, 15e-3, len(window))[:, None])
    separation = gap_size * np.abs(rng.normal(size=len(window))) * rng.integers(0, 2, len(window))
    mesh_gap = gap_size * rng.normal(size=n_meshes)
    if rng.random() < 0.4:
        mesh_gap[rng.integers(n_meshes)] += rng.choice([3e-6, 3e-5, 1e-3])
    mesh = np.repeat(window, cells)
    gap = (profile + separation[:, None]).ravel() + mesh_gap[mesh]
    G = planetary_motions(mesh, n_planets)
    if uneven_arms:
        G *= 1 + 0.03 * rng.normal(size=len(mesh))[:, None]
    if floating:
        angle = 2 * np.pi * (mesh % n_planets) / n_planets + 0.35
        sun = mesh < n_planets
        G = np.column_stack([G, np.where(sun, np.cos(angle), 0), np.where(sun, np.sin(angle), 0)])
    return H, gap, G, mesh


def by_daqp(H, gap, G, load):
    """The same loads and daqp's iterations, of the quadratic program in unit load and mean compliance."""
    n, m = G.shape
    unit, mean = np.abs(load).max(), np.trace(H) / n
    upper, lower = np.r_[np.full(n, 1e30), load / unit], np.r_[np.zeros(n), load / unit]
    sense = np.r_[np.zeros(n), np.full(m, 5)].astype(np.int32)
    loads, _, flag, info = daqp.solve(
        np.ascontiguousarray(H / mean),
        gap / mean / unit,
        np.ascontiguousarray(G.T),
        upper,
        lower,
        sense,
        primal_tol=1e-12,
        dual_tol=1e-12,
    )
    assert flag == 1
    return loads * unit, info["iterations"]


def assert_contact_conditions(state, H, gap, G, load):
    """Signs and complementarity exact; separation and equilibrium to rounding."""
    assert (state.loads >= 0).all() and (state.gaps >= 0).all()
    assert not (state.loads * state.gaps).any()
    assert (state.loads[~state.active] == 0).all() and (state.gaps[state.active] == 0).all()
    assert (state.loads[state.active] > 0).all()
    moved = G @ state.motions
    size = max(np.abs(gap).max(), np.abs(moved).max())
    assert np.abs(gap + H @ state.loads - moved - state.gaps).max() <= 1e-12 * size
    assert np.abs(G.T @ state.loads - load).max() <= 1e-12 * max(np.abs(load).max(), 1e-300)


@pytest.mark.parametrize("floating", [False, True])
def test_200_random_positions_agree_with_daqp(floating):
    rng = np.random.default_rng(11 if floating else 12)
    unloaded = 0
    for _ in range(100):
        n_planets = int(rng.integers(3, 6))
        H, gap, G, mesh = random_planetary(
            rng,
            n_planets=n_planets,
            pairs=int(rng.integers(1, 4)),
            cells=int(rng.integers(4, 13)),
            gap_size=10 ** rng.uniform(-8, -5),
            floating=floating,
            uneven_arms=rng.random() < 0.5,
        )
        load = np.zeros(G.shape[1])
        load[n_planets] = 10 ** rng.uniform(0, 4.3)
        state = solve_contact(H, gap, G, load)
        assert_contact_conditions(state, H, gap, G, load)
        assert np.abs(state.loads - by_daqp(H, gap, G, load)[0]).max() <= 1e-9 * state.loads.max()
        force = np.bincount(mesh, state.loads, 2 * n_planets)
        unloaded += (force[:n_planets] == 0).any()
        if not floating:
            np.testing.assert_array_equal(state.open_motions[:n_planets], force[:n_planets] == 0)
            assert not state.open_motions[n_planets]
        again = solve_contact(H, gap, G, load, start=rng.random(len(gap)) < 0.3)
        np.testing.assert_allclose(again.loads, state.loads, rtol=0, atol=1e-10 * state.loads.max())
        np.testing.assert_allclose(again.motions, state.motions, rtol=0, atol=1e-9 * np.abs(state.motions).max())
    assert unloaded > 20


def test_warm_start_takes_few_steps_and_changes_nothing():
    rng = np.random.default_rng(3)
    H, gap, G, mesh = random_planetary(rng, n_planets=3, pairs=3, cells=28, gap_size=2e-7)
    load = np.array([0.0, 0.0, 0.0, 7000.0])
    start = solve_contact(H, gap, G, load).active
    moved = gap + 2e-8 * rng.normal(size=6)[mesh]
    warm, cold = solve_contact(H, moved, G, load, start=start), solve_contact(H, moved, G, load)
    assert warm.iterations <= 4 < cold.iterations
    np.testing.assert_array_equal(warm.active, cold.active)
    np.testing.assert_allclose(warm.loads, cold.loads, rtol=1e-9)
    assert solve_contact(H, moved, G, load, start=warm.active).iterations == 1


@pytest.mark.parametrize("gap", [1e-6, 3e-6])
@pytest.mark.parametrize("total", [60.0, 1500.0, 6000.0])
def test_gap_on_one_planet_shares_as_springs_do(gap, total):
    """Six springs and a gap on planet 2, against the closed form of springs in series and parallel."""
    a = np.array([3.1e8, 2.9e8, 3.3e8, 4.0e8, 4.2e8, 3.9e8])
    separations = np.array([0, gap, 0, 0, 0, 0])
    state = solve_contact(np.diag(1 / a), separations, planetary_motions(np.arange(6), 3), [0, 0, 0, total])
    expected = share_load(a[:3], a[3:], (a * separations)[:3], np.zeros(3), total)
    np.testing.assert_allclose(state.loads, np.tile(expected.force, 2), rtol=1e-12)
    assert state.motions[3] == pytest.approx(expected.approach, rel=1e-12)
    loaded = expected.force > 0
    np.testing.assert_allclose(state.motions[:3][loaded], expected.deflection_ring[loaded], rtol=1e-12)
    assert state.open_motions.tolist() == [False, bool(expected.force[1] == 0), False, False]
    # by hand: the two planets without gap share until their approach has closed the gap
    path = 1 / (1 / a[:3] + 1 / a[3:])
    closes = gap * (path[0] + path[2])
    by_hand = 0.0 if total <= closes else (total - closes) * path[1] / path.sum()
    assert state.loads[1] == pytest.approx(by_hand, rel=1e-12, abs=1e-12)


def test_touching_surfaces_share_as_the_springs_of_their_active_sets():
    """Many candidates a mesh: a = 1' H_AA^-1 1 and b = 1' H_AA^-1 e, without coupling between meshes."""
    rng = np.random.default_rng(8)
    H, gap, G, mesh = random_planetary(rng, n_planets=3, pairs=2, cells=16, gap_size=5e-7)
    H = H * (mesh[:, None] == mesh)
    for extra in (1e-6, 3e-6):
        separations = gap + np.where(mesh == 1, extra, 0.0)
        state = solve_contact(H, separations, G, [0, 0, 0, 6000.0])
        a = np.diag(mesh_tangent_matrix(H, state.active, mesh, 6))
        b = np.zeros(6)
        for j in range(6):
            index = np.flatnonzero(state.active & (mesh == j))
            b[j] = np.linalg.solve(H[np.ix_(index, index)], separations[index]).sum()
        expected = share_load(a[:3], a[3:], b[:3], b[3:], 6000.0)
        np.testing.assert_allclose(np.bincount(mesh, state.loads), np.tile(expected.force, 2), rtol=1e-10)
        assert state.motions[3] == pytest.approx(expected.approach, rel=1e-10)


def test_open_planet_stays_at_rest_or_follows_the_flank_that_reaches_it():
    a = np.full(6, 3e8)
    G = planetary_motions(np.arange(6), 3)
    apart = solve_contact(np.diag(1 / a), np.array([0, 9e-5, 0, 0, 0, 0]), G, [0, 0, 0, 300.0])
    assert apart.open_motions.tolist() == [False, True, False, False]
    assert apart.motions[1] == 0 and apart.loads[1] == apart.loads[4] == 0
    # the ring flank lies 5 um inside the planet: the planet gives way by 5 um and touches without load
    pushed = solve_contact(np.diag(1 / a), np.array([0, 9e-5, 0, 0, -5e-6, 0]), G, [0, 0, 0, 300.0])
    assert pushed.motions[1] == pytest.approx(-5e-6, rel=1e-9)
    assert pushed.gaps[4] <= 1e-18 and pushed.loads[4] == 0 and pushed.open_motions[1]


def test_without_load_nothing_touches():
    rng = np.random.default_rng(1)
    H, gap, G, _ = random_planetary(rng, n_planets=3, pairs=1, cells=5, gap_size=0)
    state = solve_contact(H, np.abs(gap), G, np.zeros(4))
    assert not state.loads.any() and not state.motions.any() and not state.active.any()
    assert state.open_motions.all() and state.residual == 0 and state.method == "no load"
    np.testing.assert_allclose(state.gaps, np.abs(gap), rtol=1e-15)
    overlapping = solve_contact(H, gap - 2e-6, G, np.zeros(4))
    assert not overlapping.loads.any() and (overlapping.gaps >= 0).all()
    assert np.abs(gap - 2e-6 - G @ overlapping.motions - overlapping.gaps).max() < 1e-18


def test_wedged_body_carries_preload_without_external_load():
    """Two springs that squeeze a body by 2 e carry 2 e / (h_1 + h_2)."""
    h = np.array([2e-9, 3e-9])
    state = solve_contact(np.diag(h), np.full(2, -1e-6), np.array([[1.0], [-1.0]]), [0.0])
    np.testing.assert_allclose(state.loads, 2e-6 / h.sum(), rtol=1e-12)
    assert state.motions[0] == pytest.approx(-1e-6 + h[0] * state.loads[0], rel=1e-9)


def test_no_candidates_and_no_load():
    state = solve_contact(np.zeros((0, 0)), np.zeros(0), np.zeros((0, 2)), np.zeros(2))
    assert state.open_motions.all() and state.motions.tolist() == [0, 0]
    with pytest.raises(ContactError, match="E-CONTACT-OPEN"):
        solve_contact(np.zeros((0, 0)), np.zeros(0), np.zeros((0, 1)), [1.0])


def test_prescribed_approach_has_no_motions():
    """Pressed by 3 and 2 um both springs touch; pressed by 3 and 1 um the first lifts the second."""
    H = np.array([[2e-9, 1e-9], [1e-9, 2e-9]])
    state = solve_contact(H, -np.array([3e-6, 2e-6]), np.zeros((2, 0)), np.zeros(0))
    np.testing.assert_allclose(state.loads, np.linalg.solve(H, [3e-6, 2e-6]), rtol=1e-13)
    alone = solve_contact(H, -np.array([3e-6, 1e-6]), np.zeros((2, 0)), np.zeros(0))
    np.testing.assert_allclose(alone.loads, [1500.0, 0.0], rtol=1e-13)
    assert alone.gaps[1] == pytest.approx(0.5e-6, rel=1e-9)


def test_bounded_steps_hand_over_to_daqp():
    rng = np.random.default_rng(21)
    H, gap, G, _ = random_planetary(rng, n_planets=4, pairs=2, cells=8, gap_size=1e-6)
    load = np.array([0, 0, 0, 0, 900.0])
    slow, usual = solve_contact(H, gap, G, load, max_steps=1), solve_contact(H, gap, G, load)
    assert slow.method == "daqp" and usual.method == "active set"
    # one block step, one single pivot, those of daqp, and one linear solution of the set that daqp found
    assert slow.iterations == 1 + 1 + by_daqp(H, gap, G, load)[1] + 1
    np.testing.assert_allclose(slow.loads, usual.loads, rtol=0, atol=1e-11 * usual.loads.max())
    np.testing.assert_allclose(slow.motions, usual.motions, rtol=0, atol=1e-11 * np.abs(usual.motions).max())


def test_result_scales_with_units():
    """Metres and newtons against millimetres and kilonewtons, and motions with any arm."""
    rng = np.random.default_rng(5)
    H, gap, G, _ = random_planetary(rng, n_planets=3, pairs=2, cells=6, gap_size=3e-7)
    load = np.array([0, 0, 0, 2000.0])
    si = solve_contact(H, gap, G, load)
    arm = np.array([0.03, 0.03, 0.03, 0.019])
    other = solve_contact(H * 1e6, gap * 1e3, G * arm * 1e3, load * arm)
    np.testing.assert_allclose(other.loads, si.loads * 1e-3, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(other.motions * arm, si.motions, rtol=1e-10)


def test_tangents_are_the_derivatives_of_the_loaded_solution():
    """With one motion a mesh, dF/dq of the whole solution is the coupled tangent."""
    rng = np.random.default_rng(17)
    H, gap, _, mesh = random_planetary(rng, n_planets=3, pairs=2, cells=9, gap_size=2e-7)
    G = (mesh[:, None] == np.arange(6)).astype(float)
    load = rng.uniform(1500, 2500, 6)
    state = solve_contact(H, gap, G, load)
    tangent = mesh_tangent_matrix(H, state.active, mesh, 6)
    compliance = np.empty((6, 6))
    for j in range(6):
        more = solve_contact(H, gap, G, load + 1e-3 * np.eye(6)[j], start=state.active)
        np.testing.assert_array_equal(more.active, state.active)
        compliance[:, j] = (more.motions - state.motions) / 1e-3
    np.testing.assert_allclose(np.linalg.inv(compliance), tangent, rtol=1e-4, atol=1e-5 * tangent.max())


def test_tangent_of_unloaded_meshes_is_zero():
    H, mesh = np.diag([1e-9, 2e-9, 4e-9]), np.array([0, 0, 2])
    active = np.array([True, True, False])
    state = solve_contact(H[:2, :2], np.zeros(2), np.ones((2, 1)), [3.0])
    state = replace(state, loads=np.append(state.loads, 0.0), gaps=np.zeros(3), active=active)
    # one cell a window: no end of a contact has a neighbour
    tangent = tangent_stiffness(H, state, mesh, np.arange(3), np.zeros(3, int), 3)
    np.testing.assert_allclose(tangent, [1.5e9, 0, 0], rtol=1e-14)
    np.testing.assert_allclose(mesh_tangent_matrix(H, active, mesh, 3), np.diag([1.5e9, 0, 0]), rtol=1e-14)
    assert not mesh_tangent_matrix(H, np.zeros(3, bool), mesh, 3).any()
    with pytest.raises(ContactError, match="E-CONTACT-COMPLIANCE"):
        tangent_stiffness(-H, state, mesh, np.arange(3), np.zeros(3, int), 3)


def hertz(load, cells, width):
    """Parabolic gap over the cells of one window of a half plane, and its solution under a load."""
    from scipy.linalg import toeplitz

    from femgear.contact.local_compliance import surface_displacement

    cell = width / cells
    x = (np.arange(cells) + 0.5 - 0.5 * cells) * cell
    # a rigid shift stands for the body behind
    H = toeplitz(surface_displacement(np.arange(cells) * cell, 0.5 * cell, 80e9, 0.3)) + 2e-10
    return H, solve_contact(H, x**2 / 0.02, np.ones((cells, 1)), [load])


@pytest.mark.slow
def test_tangent_follows_the_load_without_steps():
    """Load over approach of a Hertzian contact while cells join it: the slope of 16 times finer cells."""
    width, loads = 4e-4, np.linspace(2e5, 4e5, 41)
    found = {}
    for cells in (40, 640):
        place = np.arange(cells)
        solved = [hertz(load, cells, width) for load in loads]
        zero = np.zeros(cells, int)
        found[cells] = np.array([tangent_stiffness(H, s, zero, zero, place, 1)[0] for H, s in solved])
        stepped = [mesh_tangent_matrix(H, s.active, zero, 1)[0, 0] for H, s in solved]
        found[-cells] = np.array(stepped)
    smooth, stepped = (np.abs(found[n] / found[640] - 1).max() for n in (40, -40))
    assert smooth < 0.15 * stepped
    assert np.abs(np.diff(found[40], 2)).max() < 0.3 * np.abs(np.diff(found[-40], 2)).max()


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"H": np.array([[1.0, 2.0], [2.0, 1.0]])}, "E-CONTACT-COMPLIANCE"),
        ({"H": np.array([[1.0, 0.1], [0.2, 1.0]])}, "E-CONTACT-COMPLIANCE"),
        ({"H": np.ones((2, 2))}, "E-CONTACT-COMPLIANCE"),
        ({"H": np.array([[1.0, np.nan], [np.nan, 1.0]])}, "E-SHAPE"),
        ({"H": np.eye(3)}, "E-SHAPE"),
        ({"gap": np.array([0.0, np.inf])}, "E-SHAPE"),
        ({"G": np.ones(2)}, "E-SHAPE"),
        ({"load": np.array([np.nan])}, "E-SHAPE"),
        ({"load": np.array([1.0, 2.0])}, "E-SHAPE"),
        ({"load": np.array([-1.0])}, "E-CONTACT-OPEN"),
        ({"G": np.zeros((2, 1))}, "E-CONTACT-OPEN"),
        ({"start": np.ones(3, bool)}, "E-SHAPE"),
    ],
)
def test_impossible_problems_are_refused(change, code):
    given = {"H": np.eye(2), "gap": np.zeros(2), "G": np.ones((2, 1)), "load": np.array([1.0]), "start": None}
    given |= change
    with pytest.raises(ContactError) as caught:
        solve_contact(given["H"], given["gap"], given["G"], given["load"], start=given["start"])
    assert caught.value.code == code


def test_results_are_read_only():
    state = solve_contact(np.eye(1), np.zeros(1), np.ones((1, 1)), [1.0])
    with pytest.raises(ValueError, match="read-only"):
        state.loads[0] = 2.0


def test_share_load_refuses_and_loads_planets_in_the_order_of_their_gaps():
    a = np.full(3, 2e8)
    forces = [share_load(a, a, a * [0, 1e-6, 2e-6], 0 * a, total).force for total in (0.0, 90.0, 250.0, 900.0)]
    assert [int((f > 0).sum()) for f in forces] == [0, 1, 2, 3]
    # path stiffness 1e8 N/m: second planet at 100 N, third at 300 N
    np.testing.assert_allclose(forces[2], [175, 75, 0], rtol=1e-12)
    np.testing.assert_allclose(forces[3], [400, 300, 200], rtol=1e-12)
    for bad in (
        (a, a, 0 * a, 0 * a, -1.0),
        (0 * a, a, a, a, 1.0),
        (a, a, a, a[:2], 1.0),
        (a, a, a, a * np.nan, 1.0),
    ):
        with pytest.raises(ContactError, match="E-SHAPE"):
            share_load(*bad)
