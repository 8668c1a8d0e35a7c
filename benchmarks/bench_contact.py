"""Contact with errors and moving members, Monte Carlo, derivatives; growth over planets and positions."""

from functools import cached_property
from time import process_time

import numpy as np
import pytest
from table import growth

ERRORS = "Errors, floating sun, samples (compliance known)"
PLANETS = "Contact, 64 positions or as many more as meet all planets alike, over the number of planets (36/24/84)"
POSITIONS = "Contact over the number of positions (reference set)"
ELEMENTS = "Compliance and contact, 64 positions, over the elements along a flank (reference set)"
SLICES = "Static stage in slices over the width, 32 positions (reference set)"
SLICED_PLANETS = (
    "Contact in 25 slices, 16 positions or as many more as meet all planets alike, over the planets (36/24/84)"
)
SAMPLES = 10_000


def record(benchmark, title, note="", limit=None):
    """Notes of a row; a promised time is also a test."""
    benchmark.extra_info.update(title=title, note=note, limit=limit)
    if limit is not None and benchmark.stats is not None:
        assert benchmark.stats.stats.median < limit, f"{title}: {benchmark.stats.stats.median:.2f} s"


@pytest.fixture(scope="module")
def erroneous(reference):
    """Pitch errors of all gears of quality 6 or so, and of all pins."""
    from dataclasses import replace

    from femgear.gears.deviations import no_deviations

    draw, gears = np.random.default_rng(1), reference.gears
    ideal = no_deviations(gears)
    names = ("sun_pitch", "planet_pitch", "planet_ring_side_pitch", "ring_pitch", "pin_errors")
    return replace(ideal, **{name: draw.normal(0.0, 3e-6, getattr(ideal, name).shape) for name in names})


@pytest.mark.benchmark(group=ERRORS)
@pytest.mark.parametrize(
    ("periods", "positions", "limit"), [(1, 64, 5.0), (27, 16, None)], ids=["64 positions", "27 periods"]
)
def test_errors_and_floating_sun(benchmark, reference, erroneous, periods, positions, limit):
    from femgear.contact.cycle import walk_mesh_cycle
    from femgear.contact.supports import Supports

    options = {
        "positions": positions,
        "periods": periods,
        "deviations": erroneous,
        "supports": Supports(sun=0.0),
    }
    cycle = benchmark.pedantic(
        walk_mesh_cycle,
        args=(reference.gears, reference.bodies),
        kwargs={"sun_torque": reference.sun_torque, **options},
        rounds=3,
        warmup_rounds=1,
    )
    assert cycle.residual.max() < 1e-9
    title = f"six meshes, pitch and pin errors, floating sun, {len(cycle.position)} positions"
    record(benchmark, title, f"up to {cycle.unknowns} pressure cells, {periods} mesh periods", limit)


@pytest.mark.benchmark(group=ERRORS)
def test_monte_carlo(benchmark, reference):
    from femgear.study.relief import DesignBasis
    from femgear.study.samples import Tolerances, sample_block, sample_model

    law = {"distribution": "normal", "sigma": "3 um"}
    gear, pins = {"cumulative_pitch": law}, {"radial": law, "tangential": law}
    tolerances = {"sun": gear, "planet": gear, "ring": gear, "pin_errors": pins}

    def sample():
        basis = DesignBasis(reference.gears, reference.bodies)
        model = sample_model(basis, Tolerances.model_validate(tolerances), sun_torque=reference.sun_torque)
        return sample_block(model, 1, 0, SAMPLES)

    found = benchmark.pedantic(sample, rounds=1)
    note = "16 positions of one mesh period, tooth pairs as springs, their curves included"
    assert len(found["transmission_error"]) == SAMPLES
    record(benchmark, f"{SAMPLES} as-built sets, pitch and pin errors", note, 40.0)


@pytest.mark.benchmark(group=ERRORS)
def test_derivatives(benchmark, reference):
    from femgear.study.relief import DesignBasis
    from femgear.study.sensitivity import linearise, pin_sensitivities

    basis = DesignBasis(reference.gears, reference.bodies)

    def derive():
        linear = linearise(basis, sun_torque=reference.sun_torque)
        return pin_sensitivities(linear)

    found = benchmark.pedantic(derive, rounds=3, warmup_rounds=1)
    record(benchmark, "derivatives of all shares by all pin errors", f"{found.size} derivatives, 64 positions")


class Planets:
    """A set whose planets may be 3, 4, 5 or 6: (36 + 84)/N is whole, and six of them fit."""

    @cached_property
    def material(self):
        from femgear.fe.elasticity import Material

        return Material(206e9, 0.3, 7850.0)

    @cached_property
    def bodies(self):
        from femgear.contact.bodies import make_bodies, make_sectors

        sectors = make_sectors(self.gears(3), self.material, flank_elements=24, cache=None)
        return make_bodies(sectors, self.material)

    @staticmethod
    def gears(n_planets):
        from femgear.gears.gear import Gear
        from femgear.gears.planetary import PlanetarySet, equal_planet_angles

        common = {
            "module": 1.5e-3,
            "pressure_angle": np.radians(20.0),
            "profile_shift": 0.0,
            "face_width": 25e-3,
        }
        return PlanetarySet(
            sun=Gear(teeth=36, rim_radius=12e-3, name="sun", **common),
            planet=Gear(teeth=24, rim_radius=9e-3, name="planet", **common),
            ring=Gear(teeth=84, rim_radius=80e-3, internal=True, name="ring", **common),
            centre_distance=45e-3,
            planet_angles=equal_planet_angles(n_planets),
        )


@pytest.fixture(scope="module")
def planets():
    return Planets()


@pytest.fixture(scope="module")
def medians():
    """Sizes and medians of the rows of every group so far."""
    return {}


def walk(benchmark, gears, bodies, positions, rounds=3):
    from femgear.contact.cycle import walk_mesh_cycle

    options = {"sun_torque": 100.0, "positions": positions}
    return benchmark.pedantic(walk_mesh_cycle, args=(gears, bodies), kwargs=options, rounds=rounds, warmup_rounds=1)


@pytest.mark.benchmark(group=PLANETS, timer=process_time)
@pytest.mark.parametrize("n_planets", [3, 4, 5, 6])
def test_growth_over_planets(benchmark, planets, medians, n_planets):
    gears = planets.gears(n_planets)
    cycle = walk(benchmark, gears, planets.bodies, gears.equal_positions(64))
    np.testing.assert_allclose(cycle.load_share.mean(axis=1), 1 / n_planets, rtol=1e-2)
    note = f"{len(cycle.position)} positions, {cycle.unknowns} pressure cells" + growth(
        benchmark, medians, PLANETS, n_planets
    )
    record(benchmark, f"{n_planets} planets, {2 * n_planets} meshes", note)


@pytest.mark.benchmark(group=POSITIONS, timer=process_time)
@pytest.mark.parametrize("positions", [16, 32, 64, 128, 256])
def test_growth_over_positions(benchmark, reference, medians, positions):
    cycle = walk(benchmark, reference.gears, reference.bodies, positions)
    note = f"{cycle.unknowns} pressure cells" + growth(benchmark, medians, POSITIONS, positions)
    record(benchmark, f"{positions} positions", note)


@pytest.mark.benchmark(group=ELEMENTS, timer=process_time)
@pytest.mark.parametrize("elements", [12, 24, 48, 96])
def test_growth_over_flank_elements(benchmark, reference, medians, elements):
    from femgear.contact.bodies import make_bodies, make_sectors
    from femgear.contact.cycle import walk_mesh_cycle

    options = {"sun_torque": reference.sun_torque, "positions": 64}
    sectors = make_sectors(reference.gears, reference.material, flank_elements=elements, cache=reference.cache)

    def still():
        return walk_mesh_cycle(reference.gears, make_bodies(sectors, reference.material), **options)

    cycle = benchmark.pedantic(still, rounds=3, warmup_rounds=1)
    assert cycle.residual.max() < 1e-9
    unknowns = sum(2 * len(one.grid.points) for one in (sectors.sun, sectors.planet, sectors.ring))
    note = f"{unknowns} unknowns of three sectors, mean stiffness of the sun-planet meshes "
    note += f"{1e-6 * cycle.stiffness[:3].mean():.1f} N/um" + growth(benchmark, medians, ELEMENTS, elements)
    record(benchmark, f"{elements} elements along a flank", note)


@pytest.mark.benchmark(group=SLICES, timer=process_time)
@pytest.mark.parametrize("slices", [9, 17, 33, 65])
def test_growth_over_slices(benchmark, reference, medians, slices):
    from stages import misaligned

    from femgear.stages.static import solve_static

    case = misaligned(reference.case, slices=slices)
    found = benchmark.pedantic(solve_static, args=(case,), kwargs={"cache": reference.cache}, rounds=3, warmup_rounds=1)
    factor = found.cycle.face_load_factor.max()
    note = f"K_Hbeta {factor:.3f} by a lead slope of 10 um" + growth(benchmark, medians, SLICES, slices)
    record(benchmark, f"{slices} slices", note)


@pytest.mark.benchmark(group=SLICED_PLANETS, timer=process_time)
@pytest.mark.parametrize("n_planets", [3, 4, 5, 6])
def test_growth_of_slices_over_planets(benchmark, planets, medians, n_planets):
    from femgear.contact.bodies import make_sectors
    from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
    from femgear.contact.width_waves import width_waves

    gears = planets.gears(n_planets)
    sectors = make_sectors(gears, planets.material, flank_elements=6, refine=0.5)
    waves = width_waves(sectors, planets.material, 25)
    options = {"positions": gears.equal_positions(16), "options": CycleOptions(waves=waves, slices=25)}
    cycle = benchmark.pedantic(
        walk_mesh_cycle,
        args=(gears, planets.bodies),
        kwargs={"sun_torque": 100.0} | options,
        rounds=3,
    )
    note = f"{len(cycle.position)} positions, {cycle.slice_load.shape[1]} tooth pairs a mesh"
    note += growth(benchmark, medians, SLICED_PLANETS, n_planets)
    record(benchmark, f"{2 * n_planets} meshes", note)
