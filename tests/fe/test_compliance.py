"""The sector route against the same grid solved as a whole gear."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from femgear.contact.bodies import flank_load_columns, flank_stations
from femgear.errors import GridError
from femgear.fe import compliance
from femgear.fe.compliance import (
    condense_sector,
    half_sectors,
    interpolation,
    mirror_nodes,
    mirrored_columns,
    node_dofs,
    sector_harmonics,
    static_cut_shapes,
    symmetric_factor,
    tooth_compliance,
)
from femgear.fe.elasticity import Material, foundation, mass, stiffness
from femgear.fe.grid import copy_nodes, mirror, rotated_copies
from femgear.fe.meshing import mesh_outline
from femgear.fe.reduction import cyclic_modes, sector_basis, smooth_cut_shapes
from femgear.gears.gear import Gear
from femgear.gears.tooth import half_sector

STEEL = Material(206e9, 0.3, 7850.0)
THICKNESS = 0.02


@pytest.fixture(scope="module")
def gear():
    return Gear(
        teeth=18,
        module=3e-3,
        pressure_angle=np.deg2rad(20),
        profile_shift=0.2,
        face_width=THICKNESS,
        rim_radius=0.014,
    )


@pytest.fixture(scope="module")
def sector(gear):
    return mirror(mesh_outline(half_sector(gear, flank_elements=6)))


@pytest.fixture(scope="module")
def whole(sector, gear):
    return rotated_copies(sector, gear.teeth)


@pytest.mark.decisive
def test_sector_compliance_is_that_of_the_whole_gear(gear, sector, whole):
    """Displacements on several teeth for loads on both flanks of tooth 0: to 1e-10 of the largest."""
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    stations = flank_stations(sector, gear)
    loads = flank_load_columns(sector, stations)
    cyclic = tooth_compliance(
        condense_sector(sector, K, count=gear.teeth, rim="rim", loads=loads, observations=loads).supported()
    )
    K_whole = stiffness(whole, STEEL, state="plane strain", thickness=THICKNESS)
    free = np.setdiff1d(np.arange(K_whole.shape[0]), node_dofs(np.unique(whole.boundaries["rim"])))
    nodes = copy_nodes(sector, gear.teeth)
    both = np.hstack([loads, mirrored_columns(loads, mirror_nodes(sector))])
    n_whole = 2 * len(whole.points)
    force = _on_tooth(both, nodes[0], 0.0, n_whole)
    u = np.zeros_like(force)
    u[free] = symmetric_factor(K_whole[free][:, free]).solve(force[free])
    for tooth in (0, 1, 5, 9, 17):
        observe = _on_tooth(both, nodes[tooth], tooth * gear.pitch_angle, n_whole)
        assert np.abs(observe.T @ u - cyclic[tooth]).max() < 1e-10 * cyclic[0].max()


def _on_tooth(columns, nodes, angle, size):
    """Columns of a sector placed on the tooth at `angle` of the whole gear."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    result = np.zeros((size, columns.shape[1]))
    turned = np.einsum("ij,njm->nim", turn, columns.reshape(-1, 2, columns.shape[1]))
    np.add.at(result, 2 * nodes, turned[:, 0])
    np.add.at(result, 2 * nodes + 1, turned[:, 1])
    return result


def test_compliance_is_reciprocal_and_positive(gear, sector):
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    loads = flank_load_columns(sector, flank_stations(sector, gear))
    H = tooth_compliance(
        condense_sector(sector, K, count=gear.teeth, rim="rim", loads=loads, observations=loads).supported()
    )
    assert np.abs(H - np.roll(H[::-1], 1, axis=0).transpose(0, 2, 1)).max() < 1e-12 * H.max()
    z, n = gear.teeth, H.shape[1]
    lag = (np.arange(z)[:, None] - np.arange(z)) % z
    full = H[lag].transpose(0, 2, 1, 3).reshape(z * n, z * n)
    assert np.linalg.eigvalsh(0.5 * (full + full.T))[0] > 0


def test_compliance_does_not_depend_on_the_scale(gear):
    """With E fixed the compliance per unit thickness is scale-free (benchmark A10)."""
    values = []
    for scale in (1.0, 10.0):
        big = Gear(
            teeth=18,
            module=scale * 3e-3,
            pressure_angle=np.deg2rad(20),
            profile_shift=0.2,
            face_width=THICKNESS,
            rim_radius=scale * 0.014,
        )
        grid = mirror(mesh_outline(half_sector(big, flank_elements=8)))
        K = stiffness(grid, STEEL, state="plane strain", thickness=THICKNESS)
        loads = flank_load_columns(grid, flank_stations(grid, big))
        schur = condense_sector(grid, K, count=18, rim="rim", loads=loads, observations=loads).supported()
        values.append(tooth_compliance(schur)[0])
    assert np.abs(values[1] - values[0]).max() < 1e-9 * values[0].max()


def test_free_body_is_refused(gear, sector):
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    loads = flank_load_columns(sector, flank_stations(sector, gear))
    free = condense_sector(sector, K, count=gear.teeth, rim=None, loads=loads, observations=loads).supported()
    with pytest.raises(GridError, match="nothing holds it"):
        tooth_compliance(free)
    # translation is the last harmonic as well as the first
    with pytest.raises(GridError, match="nothing holds it"):
        sector_harmonics(free, [gear.teeth - 1])


@pytest.mark.parametrize(("axis", "free"), [(1, (1, 17)), (0, (0,))], ids=["translation", "rotation"])
def test_a_body_held_against_the_other_motion_only_is_refused(gear, sector, axis, free):
    """Springs on the teeth against their own rotation leave the translation, radial ones the rotation."""
    middle = np.flatnonzero(mirror_nodes(sector) == np.arange(len(sector.points)))
    inner, outer = middle[np.argsort(sector.points[middle, 0])][3:5]
    spring = np.zeros((2 * len(sector.points), 1))
    spring[2 * outer + axis] = 1.0
    if axis == 1:
        spring[2 * inner + axis] = -1.0
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    K = K + 1e9 * csc_array(spring) @ csc_array(spring).T
    loads = flank_load_columns(sector, flank_stations(sector, gear))
    schur = condense_sector(sector, K, count=gear.teeth, rim=None, loads=loads, observations=loads).supported()
    for harmonic in (0, 1, 2, 16, 17):
        if harmonic in free:
            with pytest.raises(GridError, match="E-GRID-FREE"):
                sector_harmonics(schur, [harmonic])
        else:
            assert np.isfinite(sector_harmonics(schur, [harmonic])).all()


def test_a_solution_that_misses_its_equations_is_refused(gear, sector):
    """Two nodes off the axis without stiffness of their own: small pivots cost all digits."""
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS).tolil()
    held = [np.unique(sector.boundaries[name]) for name in ("rim", "cut_left", "cut_right")]
    free = np.setdiff1d(np.arange(len(sector.points)), np.concatenate(held))
    node = free[sector.points[free, 1] > 1e-4][5]
    unit = K.diagonal().mean()
    for place, sign in ((node, 1.0), (mirror_nodes(sector)[node], -1.0)):
        both = [2 * place, 2 * place + 1]
        K[both, :] = 0.0
        K[:, both] = 0.0
        K[both[0], both[0]] = K[both[1], both[1]] = 1e-13 * unit
        K[both[0], both[1]] = K[both[1], both[0]] = sign * unit
    loads = np.zeros((K.shape[0], 1))
    # also as large as the entries of the stiffness, which are right-hand sides too
    for size in (1.0, unit):
        loads[[2 * node, 2 * node + 1], 0] = size, 0.3 * size
        with pytest.raises(GridError, match="E-RESIDUAL"):
            condense_sector(sector, csc_array(K), count=18, rim="rim", loads=loads, observations=loads).supported()
        with pytest.raises(GridError, match="E-RESIDUAL"):
            for half in half_sectors(sector, csc_array(K), "rim"):
                half.held((half.fields.T @ loads)[: half.inner])


def test_a_load_of_nothing_moves_nothing(sector):
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    for half in half_sectors(sector, K, "rim"):
        assert not half.held(np.zeros((half.inner, 2))).any()


WRONG = {
    "solution": (lambda x: x - [1.0, 0.0, 0.0], (1.0, 1.0)),
    **{f"factor {rows}": (lambda x: x, rows) for rows in itertools.product((0.9, 1.1), repeat=2)},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_residual_counts_whatever_its_sign(wrong, monkeypatch):
    """The wrong solution misses three equations by -2, -1 and 0; rows of a wrong factor by either sign."""
    change, rows = WRONG[wrong]
    matrix, columns = csc_array([[2.0, 1.0], [1.0, 2.0]]), csc_array([[0.0], [1.0]])

    def factored(whole, **options):
        factor = symmetric_factor(whole, **options)
        scale = diags_array([1.0, *rows])
        return SimpleNamespace(L=csc_array(scale @ factor.L), U=factor.U, solve=lambda b: change(factor.solve(b)))

    (found,) = compliance._schur_complements([matrix], [[1.0]], columns, 1)
    np.testing.assert_allclose(found, [[1.5, 1.0], [1.0, 0.0]], rtol=0, atol=1e-15)
    monkeypatch.setattr(compliance, "symmetric_factor", factored)
    with pytest.raises(GridError, match="E-RESIDUAL"):
        compliance._schur_complements([matrix], [[1.0]], columns, 1)


def test_load_on_a_cut_is_refused(gear, sector):
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    loads = flank_load_columns(sector, flank_stations(sector, gear))
    loads[node_dofs(np.unique(sector.boundaries["cut_left"]))] = 1.0
    with pytest.raises(GridError, match="cut"):
        condense_sector(sector, K, count=18, rim="rim", loads=loads, observations=loads).supported()


def test_interpolation_is_exact_for_quadratics(sector, gear):
    rng = np.random.default_rng(1)
    stations = flank_stations(sector, gear)
    points = stations.points + stations.normals * rng.uniform(0.1e-3, 1.0e-3, (len(stations.points), 1))
    W = interpolation(sector, points)

    def f(p):
        return 1.0 + 300 * p[:, 0] - 50 * p[:, 1] + 2e4 * p[:, 0] * p[:, 1] - 1e4 * p[:, 1] ** 2

    straight = np.abs(W @ f(sector.points) - f(points))
    # exact in straight elements; in the curved ones along flank and fillet the map itself is quadratic
    assert np.median(straight) < 1e-12
    assert straight.max() < 1e-3
    assert np.abs(W @ sector.points - points).max() < 1e-15
    with pytest.raises(GridError, match="outside"):
        interpolation(sector, np.array([[1.0, 0.0]]))


@pytest.mark.slow
def test_cyclic_modes_are_those_of_the_whole_body(gear, sector, whole):
    """Every natural frequency of the whole gear on a foundation, by nodal diameter, to 1e-4."""
    from scipy.sparse.linalg import LinearOperator, eigsh

    def matrices(grid):
        K = stiffness(grid, STEEL, state="plane stress", thickness=THICKNESS)
        return K + foundation(grid, "rim", 1e11, 1e11, thickness=THICKNESS), mass(grid, STEEL, THICKNESS)

    K, M = matrices(sector)
    loads = flank_load_columns(sector, flank_stations(sector, gear))[:, 3:4]
    basis = sector_basis(sector, K, M, count=gear.teeth, loads=loads)
    modes = cyclic_modes(
        basis,
        nodal_diameters=range(10),
        loads=loads,
        outputs=loads,
        max_frequency=6e4,
        static_correction=False,
    )
    # above the limit only where a diameter has no other mode: no static shapes
    above = modes.nodal_diameter[modes.frequency > 6e4]
    assert np.all(np.bincount(modes.nodal_diameter)[above] == 1)
    sector_frequencies = np.sort(np.repeat(modes.frequency, np.where(modes.paired, 2, 1)))
    K_whole, M_whole = matrices(whole)
    factor = symmetric_factor(K_whole)
    inverse = LinearOperator(K_whole.shape, matvec=factor.solve, dtype=float)
    values = eigsh(K_whole, k=16, M=M_whole, sigma=0.0, OPinv=inverse, return_eigenvectors=False)
    reference = np.sort(np.sqrt(values)) / (2 * np.pi)
    assert np.abs(sector_frequencies[:16] / reference - 1).max() < 1e-4
    # a lower limit leaves out what lies above it, but for the lowest mode of every nodal diameter
    low = {"nodal_diameters": range(10), "loads": loads, "outputs": loads, "static_correction": False}
    for limit in (30e3, 40e3, 50e3):
        lowest = np.append(True, np.diff(modes.nodal_diameter) > 0)
        expected = modes.frequency[lowest | (modes.frequency <= limit)]
        found = cyclic_modes(basis, max_frequency=limit, **low).frequency
        np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.decisive
@pytest.mark.parametrize("smooth", [False, True])
def test_reduced_ring_is_statically_complete(gear, sector, smooth):
    """Modes plus static shape give the exact cyclic compliance of the load, whatever the cut-off.

    Also where the cut has a few shapes alone; natural frequencies are those of the whole cut then.
    """
    K = stiffness(sector, STEEL, state="plane stress", thickness=THICKNESS)
    K = K + foundation(sector, "rim", 1e11, 1e11, thickness=THICKNESS)
    loads = flank_load_columns(sector, flank_stations(sector, gear))[:, 3:4]
    schur = condense_sector(sector, K, count=gear.teeth, rim=None, loads=loads, observations=loads).supported()
    exact = sector_harmonics(schur, np.arange(10))[:, 0, 0].real
    shapes = smooth_cut_shapes(sector, static_cut_shapes(schur, np.arange(10)))
    whole, basis = (
        sector_basis(sector, K, mass(sector, STEEL, THICKNESS), count=gear.teeth, loads=loads, cut_shapes=chosen)
        for chosen in (None, shapes if smooth else None)
    )
    frequency = [
        cyclic_modes(b, nodal_diameters=range(10), loads=loads, outputs=loads, max_frequency=6e4).frequency
        for b in (whole, basis)
    ]
    assert basis.cut == (2 * shapes.shape[1] if smooth else whole.cut)
    assert shapes.shape[1] < 0.5 * len(shapes)
    np.testing.assert_allclose(*frequency, rtol=2e-6)
    for top in (1.0, 3e4):
        modes = cyclic_modes(basis, nodal_diameters=range(10), loads=loads, outputs=loads, max_frequency=top)
        terms = np.abs(modes.load[:, 0]) ** 2 / (2 * np.pi * modes.frequency) ** 2
        ours = np.bincount(modes.nodal_diameter, weights=terms)
        # the foundation is 1e3 times softer than the tooth: rounding costs that much of the double precision
        assert np.abs(ours / exact - 1).max() < 1e-8


def test_displacement_field_of_the_whole_gear(gear, sector, whole):
    """Loads on three teeth: the field from one sector is that of the whole gear."""
    from femgear.fe.compliance import cyclic_displacement

    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    columns = flank_load_columns(sector, flank_stations(sector, gear))
    loads = np.zeros((gear.teeth, columns.shape[0]))
    loads[0], loads[1], loads[7] = columns[:, 2], 0.5 * columns[:, 6], -0.2 * columns[:, 4]
    field = cyclic_displacement(sector, K, loads, held="rim")
    nodes = copy_nodes(sector, gear.teeth)
    force = sum(_on_tooth(loads[t][:, None], nodes[t], t * gear.pitch_angle, 2 * len(whole.points)) for t in range(18))
    K_whole = stiffness(whole, STEEL, state="plane strain", thickness=THICKNESS)
    free = np.setdiff1d(np.arange(K_whole.shape[0]), node_dofs(np.unique(whole.boundaries["rim"])))
    u = np.zeros(K_whole.shape[0])
    u[free] = symmetric_factor(K_whole[free][:, free]).solve(force[free, 0])
    for t in (0, 3, 7):
        a = t * gear.pitch_angle
        turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
        assert np.abs(field[t] @ turn.T - u.reshape(-1, 2)[nodes[t]]).max() < 1e-10 * np.abs(u).max()


def test_a_rim_supported_afterwards_is_one_that_was_supported_before(gear, sector):
    """Held, and on foundations stiff and soft: as condensed with the foundation in the stiffness."""
    K = stiffness(sector, STEEL, state="plane strain", thickness=THICKNESS)
    loads = flank_load_columns(sector, flank_stations(sector, gear))
    options = dict(count=gear.teeth, loads=loads, observations=loads)
    free = condense_sector(sector, K, rim="rim", **options)
    for modulus in (1e10, 1e13):
        springs = foundation(sector, "rim", modulus, 0.5 * modulus, thickness=THICKNESS)
        before = tooth_compliance(condense_sector(sector, K + springs, rim=None, **options).supported())
        after = tooth_compliance(free.supported(springs))
        assert np.abs(after - before).max() < 1e-9 * np.abs(before).max()
    # an all but rigid foundation holds
    springs = foundation(sector, "rim", 1e18, 1e18, thickness=THICKNESS)
    held, rigid = (tooth_compliance(free.supported(support)) for support in (None, springs))
    assert np.abs(held - rigid).max() < 1e-4 * np.abs(held).max()
