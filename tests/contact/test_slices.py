"""Contact in slices over the face width: the plane contact, linear springs, leads, supports and mirrors."""

from dataclasses import replace

import numpy as np
import pytest
from contact.test_cycle import STEEL, TORQUE, reference_set
from scipy.spatial import KDTree

from femgear.contact import cycle, slices
from femgear.contact.bodies import flank_load_columns, flank_stations, make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.slices import _SliceNewton
from femgear.contact.supports import Supports
from femgear.contact.width_waves import cosines, wave_displacement, width_waves
from femgear.fe.compliance import (
    boundary_nodes,
    condense_sector,
    node_dofs,
    symmetric_factor,
    tooth_compliance,
)
from femgear.fe.elasticity import Material, basis, stiffness, wave_stiffness
from femgear.fe.grid import rotated_copies
from femgear.gears.deviations import lead_separation, no_deviations
from femgear.gears.modifications import EndRelief, FlankForm, LeadCrowning, LeadSlope, lead_deviation

SLICES = 9


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def sectors(gears):
    return make_sectors(gears, STEEL, flank_elements=6, refine=0.5)


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=12), STEEL)


@pytest.fixture(scope="module")
def waves(sectors):
    return width_waves(sectors, STEEL, SLICES)


def walk(gears, bodies, waves, *lead, gear="sun", **options):
    options = {"sun_torque": TORQUE, "positions": 4} | options
    deviations = replace(no_deviations(gears), **{gear: FlankForm(lead)})
    return walk_mesh_cycle(
        gears, bodies, deviations=deviations, options=CycleOptions(waves=waves, slices=SLICES), **options
    )


# --- bodies ----------------------------------------------------------------------------------------


def test_energy_of_a_wave_is_that_of_its_strains(sectors):
    """Quadratic fields, those of the elements but for their curved edges, integrated from their strains."""
    grid, k = sectors.sun.grid, 700.0
    parts = wave_stiffness(grid, STEEL)
    rng, scale = np.random.default_rng(0), 1.5e-3
    c = rng.normal(size=(3, 6))

    def field(i, x, y):
        x, y = x / scale, y / scale
        return c[i] @ np.stack([np.ones_like(x), x, y, x * x, x * y, y * y]).reshape(6, -1)

    def slope(i, x, y, axis):
        x, y = x / scale, y / scale
        zero, one = np.zeros_like(x), np.ones_like(x)
        terms = [zero, one, zero, 2 * x, y, zero] if axis == 0 else [zero, zero, one, zero, x, 2 * y]
        return c[i] @ np.stack(terms).reshape(6, -1) / scale

    straight = basis(grid, order=6)
    x, y = np.asarray(straight.global_coordinates()).reshape(2, -1)
    lam, mu = STEEL.lame("plane strain")
    total, z = 0.0, (np.arange(16) + 0.5) / 16 * 2 * np.pi
    U, V, W = (field(i, x, y) for i in range(3))
    (Ux, Uy), (Vx, Vy), (Wx, Wy) = ((slope(i, x, y, 0), slope(i, x, y, 1)) for i in range(3))
    for cos, sin in zip(np.cos(z), np.sin(z)):
        e = Ux * cos, Vy * cos, k * W * cos
        g = (Uy + Vx) * cos, (Wx - k * U) * sin, (Wy - k * V) * sin
        density = lam * sum(e) ** 2 + 2 * mu * sum(one**2 for one in e) + mu * sum(one**2 for one in g)
        total += (density * straight.dx.ravel()).sum() / 16
    u = np.stack([field(i, *grid.points.T) for i in range(3)], axis=1).ravel()
    energy = u @ (parts[0] + k * parts[1] + k**2 * parts[2]) @ u
    assert energy == pytest.approx(2 * total, rel=1e-6)


@pytest.mark.slow
def test_sector_answers_waves_as_the_whole_gear(sectors):
    sector, teeth = sectors.sun, sectors.sun.gear.teeth
    stations = flank_stations(sector.grid, sector.gear)
    loads = np.insert(flank_load_columns(sector.grid, stations), range(2, 2 * sector.grid.n_nodes + 1, 2), 0, 0)
    whole = rotated_copies(sector.grid, teeth)
    nodes, at = KDTree(whole.points).query(sector.grid.points[stations.nodes])[1], 3
    free = np.setdiff1d(np.arange(3 * whole.n_nodes), node_dofs(boundary_nodes(whole, "rim"), 3))
    for k in (10.0, 1500.0):
        parts = [
            (K[0] + k * K[1] + k**2 * K[2]).tocsc()
            for K in (wave_stiffness(one, STEEL) for one in (sector.grid, whole))
        ]
        options = {"count": teeth, "rim": "rim", "loads": loads, "observations": loads}
        found = tooth_compliance(condense_sector(sector.grid, parts[0], **options).supported())
        force = np.zeros(3 * whole.n_nodes)
        force[3 * nodes[at] + np.arange(2)] = stations.normals[at]
        moved = np.zeros(3 * whole.n_nodes)
        moved[free] = symmetric_factor(parts[1][free][:, free]).solve(force[free])
        expected = sum(moved[3 * nodes + c] * stations.normals[:, c] for c in (0, 1))
        assert np.abs(found[0, : len(nodes), at] - expected).max() < 1e-10 * np.abs(expected).max()


def test_long_waves_are_plane_strain(sectors):
    """Without an axial displacement; of a body of unit thickness."""
    grid = sectors.planet.grid
    plane, (wave, _, _) = stiffness(grid, STEEL), wave_stiffness(grid, STEEL)
    dofs = (3 * np.arange(grid.n_nodes)[:, None] + [0, 1]).ravel()
    assert abs(wave[dofs][:, dofs] - plane).max() < 1e-12 * abs(plane).max()


@pytest.mark.parametrize(
    ("x", "depth", "k", "printed"), [(0.3, 0.5, 0.6, 0.98689728426), (1.0, 0.2, 2.0, 0.06716461742)]
)
def test_half_space_under_a_cosine(x, depth, k, printed):
    assert wave_displacement(x, depth, k, Material(1.0, 0.3, 1.0)) == pytest.approx(printed, rel=1e-9)


def test_cosines_are_orthonormal():
    T = cosines(25)
    assert np.abs(T @ T.T - np.eye(25)).max() < 1e-14 and np.ptp(T[0]) == 0.0


# --- slices ----------------------------------------------------------------------------------------


def spring_newton(separation, *, stiffness, load, slices, tilting=None):
    """Slices of one linear spring, not coupled across the width."""
    from femgear.contact.pair_laws import PairLaws

    force = np.geomspace(1.0, 1e5, 8)
    laws = PairLaws(
        force=force,
        yields=np.full((1, 1, 8), 1 / stiffness),
        moments=np.full((1, 1, 8, 3), 1 / 3),
        touching=np.zeros((1, 1, 1)),
        smooth=np.zeros((1, 1, 3, 1, 3)),
        supports=np.zeros((1, 1)),
        separation=np.zeros((1, 1)),
        mesh=np.zeros(1, int),
        approach=np.ones((1, 1)),
        loads=np.full((1, 1, 3), load / 3),
        motions=np.full((1, 1), load / stiffness),
        pressure=np.zeros((1, 1, 8)),
    )
    across = np.zeros((1, slices, 1, slices, 1))
    apart = np.asarray(separation)[None, :, None]
    rows, smooth = np.zeros((1, 1), int), laws.smooth[None]
    return _SliceNewton(laws, rows, np.array([load]), across, apart, smooth, tilting)


def spring_slices(separation, *, load, **options):
    """Loads of these slices as parts of their mean."""
    return spring_newton(separation, load=load, **options).solve()[0][0, :, 0] / load


@pytest.mark.parametrize(("misaligned", "factor"), [(2e-6, 1.106), (5e-6, 1.266), (10e-6, 1.532)])
def test_slices_of_their_own_give_the_linear_face_load_factor_of_iso_6336(misaligned, factor):
    """K_H-beta = 1 + (1 - 1/N) F_by c b/(2 F): c' = 11.084 N/(mm um), b = 25 mm, 100 N/mm."""
    slope = misaligned * ((np.arange(25) + 0.5) / 25 - 0.5)
    found = spring_slices(slope, stiffness=11.084e9 * 0.025, load=100e3 * 0.025, slices=25)
    assert round(found.max(), 3) == factor and found.mean() == pytest.approx(1.0, abs=1e-12)


def test_ends_that_lift_follow_the_root_law_of_iso_6336():
    """K_H-beta = sqrt(2 F_by c b/F) where part of the width carries."""
    slices, misaligned = 200, 60e-6
    slope = misaligned * ((np.arange(slices) + 0.5) / slices - 0.5)
    found = spring_slices(slope, stiffness=11.084e9 * 0.025, load=100e3 * 0.025, slices=slices)
    edge = 1.5 * found.max() - 0.5 * np.sort(found)[-2]
    assert edge == pytest.approx(np.sqrt(2 * misaligned * 11.084e9 / 100e3), rel=2e-3)
    assert (found == 0.0).mean() == pytest.approx(1 - 2 / edge, abs=0.01)


def test_crowning_of_slices_of_their_own():
    """K = 1 + C c/(3 w) for C (2 z/b)^2, C = 10 um, 200 N/mm."""
    slices = 400
    crown = 10e-6 * (2 * (np.arange(slices) + 0.5) / slices - 1) ** 2
    found = spring_slices(crown, stiffness=11.084e9 * 0.025, load=200e3 * 0.025, slices=slices)
    assert found.max() == pytest.approx(1.185, abs=1e-3)


def test_without_leads_slices_are_the_plane_contact(gears, bodies, waves):
    plane = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=4)
    sliced = walk(gears, bodies, waves)
    for name in (
        "deflection",
        "sun_arc",
        "force",
        "stiffness",
        "tooth_load",
        "bearing_force",
        "max_pressure",
    ):
        expected = getattr(plane, name)
        assert np.abs(getattr(sliced, name) - expected).max() < 1e-10 * np.abs(expected).max(), name
    assert np.abs(sliced.slice_load - sliced.tooth_load[:, :, None]).max() < 1e-10 * sliced.force.max()
    assert np.abs(sliced.face_load_factor - 1).max() < 1e-9


def test_slices_add_up_and_balance_the_torque(gears, bodies, waves):
    cycle = walk(gears, bodies, waves, LeadSlope(10e-6), LeadCrowning(4e-6))
    assert np.abs(cycle.slice_load.mean(axis=2) - cycle.tooth_load).max() < 1e-12 * cycle.force.max()
    assert cycle.force[:3].sum(axis=0) * gears.sun.base_radius == pytest.approx(TORQUE, rel=1e-9)
    assert np.abs(cycle.force[:3] - cycle.force[3:]).max() < 1e-9 * cycle.force.max()
    assert cycle.face_load_factor[:3].min() > 1.2 and np.abs(cycle.face_load_factor[3:] - 1).max() < 1e-2


def test_the_mirror_image_over_the_width_is_that_of_the_mirrored_lead(gears, bodies, waves):
    one, other = (walk(gears, bodies, waves, LeadSlope(sign * 8e-6), EndRelief(5e-6, 4e-3)) for sign in (1, -1))
    assert np.abs(one.slice_load - other.slice_load[:, :, ::-1]).max() < 1e-9 * one.slice_load.max()
    assert np.abs(one.stiffness - other.stiffness).max() < 1e-9 * one.stiffness.max()
    assert (one.iterations > 0).all()


def _no_coupling(found, some, waves, count):
    shape = found.setup.images, len(some), count, len(found.mesh), count, len(found.mesh)
    return [np.zeros(shape) for _ in waves]


def test_coupling_raises_the_largest_load(gears, bodies, waves, monkeypatch):
    """Slices that are gears of their own spread a misalignment better than one body: by 1 to 11 %."""
    coupled = walk(gears, bodies, waves, LeadSlope(4e-6)).face_load_factor[0]
    monkeypatch.setattr(slices, "slice_compliance", _no_coupling)
    loose = walk(gears, bodies, waves, LeadSlope(4e-6)).face_load_factor[0]
    assert 1.01 < coupled / loose < 1.11


def test_supports_carry_the_width_as_a_whole(gears, bodies, waves):
    """Springs of the members change the errors of transmission, not how the width shares the load."""
    held = walk(gears, bodies, waves, LeadSlope(10e-6))
    sprung = walk(gears, bodies, waves, LeadSlope(10e-6), supports=Supports(planet=1e8, carrier=5e7))
    assert np.abs(sprung.slice_load - held.slice_load).max() < 1e-6 * held.slice_load.max()


def test_a_negative_torque_is_carried_too(gears, bodies, waves):
    cycle = walk(gears, bodies, waves, LeadSlope(5e-6), sun_torque=-TORQUE)
    assert cycle.face_load_factor[0] > 1.1
    assert cycle.force[:3].sum(axis=0) * gears.sun.base_radius == pytest.approx(TORQUE, rel=1e-9)


# --- leads -----------------------------------------------------------------------------------------


def test_leads_are_those_of_the_standards():
    z = np.array([-10.0, -5.0, 0.0, 5.0, 10.0]) * 1e-3
    form = FlankForm((LeadSlope(8e-6),))
    assert lead_deviation(form, 20e-3, z) == pytest.approx([4e-6, 2e-6, 0, -2e-6, -4e-6], abs=1e-18)
    form = FlankForm((LeadCrowning(8e-6),))
    assert lead_deviation(form, 20e-3, z) == pytest.approx([8e-6, 2e-6, 0, 2e-6, 8e-6], abs=1e-18)
    form = FlankForm((EndRelief(8e-6, 10e-3),))
    assert lead_deviation(form, 20e-3, z) == pytest.approx([8e-6, 2e-6, 0, 2e-6, 8e-6], abs=1e-18)


def test_leads_of_both_flanks_of_a_mesh_add_up(gears):
    planet = FlankForm((LeadSlope(2e-6),))
    deviations = replace(
        no_deviations(gears),
        sun=FlankForm((LeadSlope(6e-6),)),
        planet_sun_side=planet,
        planet_ring_side=planet,
    )
    sun, _, _, ring, _, _ = lead_separation(deviations, gears, 4)
    assert sun == pytest.approx(8e-6 * np.array([3, 1, -1, -3]) / 8, abs=1e-15)
    assert ring == pytest.approx(sun / 4, abs=1e-15)


def test_a_negative_torque_keeps_the_ends_of_the_width(gears, bodies, waves):
    """More material at z > 0 carries more there, whichever flanks carry."""
    for sign in (1, -1):
        cycle = walk(gears, bodies, waves, LeadSlope(8e-6), sun_torque=sign * TORQUE)
        over_width = cycle.slice_load[:3].sum(axis=(0, 1, 3))
        assert over_width[-1] > 2 * over_width[0]


def test_a_planet_that_carries_nothing_is_open_in_slices_too(gears, bodies, waves):
    pins = np.array([[0.0, 10e-6], [0.0, 0.0], [0.0, 0.0]])
    options = {
        "sun_torque": 10.0,
        "positions": 4,
        "deviations": replace(no_deviations(gears), pin_errors=pins),
    }
    sliced = walk_mesh_cycle(gears, bodies, **options, options=CycleOptions(waves=waves, slices=SLICES))
    plane = walk_mesh_cycle(gears, bodies, **options)
    assert plane.open_planets.any() and np.array_equal(sliced.open_planets, plane.open_planets)
    assert np.abs(sliced.stiffness - plane.stiffness).max() < 1e-9 * plane.stiffness.max()


@pytest.mark.parametrize("sun", [0.0, 1e7, 5e7])
@pytest.mark.parametrize("error", [1e-6, 10e-6])
def test_errors_on_soft_supports_settle(gears, bodies, waves, sun, error):
    """Slices that lift move the members, which bring them back: sides change until all conditions hold."""
    pins = np.array([[0.0, error], [0.0, 0.0], [0.0, 0.0]])
    deviations = replace(no_deviations(gears), sun=FlankForm((LeadSlope(10e-6),)), pin_errors=pins)
    supports = Supports(sun=sun, planet=3e8, carrier=2e8)
    cycle = walk_mesh_cycle(
        gears,
        bodies,
        sun_torque=TORQUE,
        positions=4,
        deviations=deviations,
        supports=supports,
        options=CycleOptions(waves=waves, slices=SLICES),
    )
    assert cycle.residual.max() < 1e-9 and cycle.slice_load.min() >= 0.0
    assert cycle.force[:3].sum(axis=0) * gears.sun.base_radius == pytest.approx(TORQUE, rel=1e-9)


def test_pairs_that_only_an_end_reaches_are_candidates(gears, bodies, waves, monkeypatch):
    """A slope of 280 um: the end that stands out meets pairs that the mean does not reach."""
    found = walk(gears, bodies, waves, LeadSlope(280e-6), positions=8)
    first = cycle.first_windows

    def wide(*arguments):
        share, nearest = first(*arguments)
        return share, 20 * nearest

    monkeypatch.setattr(cycle, "first_windows", wide)
    expected = walk(gears, bodies, waves, LeadSlope(280e-6), positions=8)
    # what loads lift at the far end is not looked for
    assert np.abs(found.sun_arc - expected.sun_arc).max() < 1e-5 * np.abs(expected.sun_arc).max()


@pytest.mark.slow
def test_coarse_grids_will_do(gears, bodies, waves):
    """Waves of twice as fine elements change K_H-beta by less than 2e-3."""
    fine = width_waves(make_sectors(gears, STEEL, flank_elements=12, refine=1.0), STEEL, SLICES)
    for lead in (LeadSlope(10e-6), LeadCrowning(10e-6), EndRelief(10e-6, 3e-3)):
        coarse, finer = (walk(gears, bodies, one, lead).face_load_factor[0] for one in (waves, fine))
        assert coarse == pytest.approx(finer, rel=2e-3)


def test_light_loads_settle_as_closely_as_heavy_ones(gears, bodies, waves):
    """0.01 N m: what stops the iteration is no length of the windows that are absent."""
    cycle = walk(gears, bodies, waves, LeadSlope(0.05e-6), sun_torque=0.01)
    total = 0.01 / gears.sun.base_radius
    assert np.abs(cycle.force[:3].sum(axis=0) / total - 1).max() < 1e-8 and cycle.residual.max() < 1e-9
    assert np.abs(cycle.force[:3] - cycle.force[0]).max() < 1e-8 * total
