"""Variants of a case against the whole pipeline, and the numbers that are taken from them."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case.dependencies import Steps, compliance_entries, fingerprint, ring_entries
from femgear.case.quantities import SPEED
from femgear.errors import CaseError
from femgear.stages.static import solve_static
from femgear.study.designs import open_designs
from femgear.study.objectives import (
    at_speeds,
    contact_pressure,
    forces_over_time,
    housing_level,
    mesh_force,
    named_quantity,
    natural_frequency,
    response_at,
    root_stress,
    transmission_error,
)
from femgear.study.problem import tip_reliefs
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.live import Answer
from femgear.trains.reading import read_case, with_values

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
RANGE = (1000.0 * SPEED.scale, 3500.0 * SPEED.scale, 6)
SPEEDS = ("1000 rpm", "3500 rpm")


@pytest.fixture(scope="module")
def coarse(coarse_states):
    """The reference set with reliefs of no amount, coarse."""
    case, _ = tip_reliefs(read_case(CASE))
    return with_values(case, {"static.flank_elements": 4, "static.positions": 14, "static.stresses": False})


@pytest.fixture(scope="module")
def grids(tmp_path_factory):
    return tmp_path_factory.mktemp("grids")


@pytest.fixture(scope="module")
def steps():
    """Steps with all that the variants of this file leave behind."""
    return Steps()


@pytest.fixture(scope="module")
def reused(coarse, grids, steps):
    """A variant with reliefs that takes compliances and dynamic model from the one without."""
    first = Answer(coarse, steps, cache=grids)
    response_at(first, RANGE)
    changes = {"sun.modifications[0].amount": "5 um", "planet.modifications[0].amount": "5 um"}
    variant = Answer(with_values(coarse, changes), steps, cache=grids)
    response_at(variant, RANGE)
    return first, variant


@pytest.fixture(scope="module")
def whole(reused, grids):
    """The same variant by the stages of the pipeline, nothing reused."""
    case = at_speeds(reused[1].case, RANGE)
    static = solve_static(case, cache=grids)
    modes = solve_modes(case, static)
    dynamics = solve_dynamics(case, static, modes)
    return case, static, dynamics, solve_housing(case, dynamics)


def test_variants_are_what_the_pipeline_computes(reused, whole):
    first, variant = reused
    _, static, dynamics, _ = whole
    assert variant.static.bodies is first.static.bodies
    for name in ("sun_arc", "deflection", "force", "stiffness"):
        np.testing.assert_array_equal(getattr(variant.static.cycle, name), getattr(static.cycle, name))
    np.testing.assert_allclose(response_at(variant, RANGE).force, dynamics.response.force, rtol=1e-9, atol=1e-7)
    assert np.ptp(variant.static.cycle.sun_arc) < 0.9 * np.ptp(first.static.cycle.sun_arc)


def test_quantities_are_what_the_results_on_disk_hold(reused, whole):
    from femgear.stages.static import solve_stress

    variant, (case, static, dynamics, housing) = reused[1], whole
    data, forces = static.dataset(), dynamics.dataset()
    ste = data["ste_peak_to_peak"].values
    assert transmission_error("sun-planet").compute(variant) == pytest.approx(ste[:3].max(), rel=1e-12)
    assert transmission_error("planet-ring").compute(variant) == pytest.approx(ste[3:].max(), rel=1e-12)
    overall = data["ste_overall_peak_to_peak"].values.max()
    assert transmission_error("overall").compute(variant) == pytest.approx(overall, rel=1e-12)
    assert transmission_error().compute(variant) == pytest.approx(max(overall, ste.max()), rel=1e-12)
    # a finer synthesis of the mesh forces, term by term
    lines = forces["mesh_force_real"].values + 1j * forces["mesh_force_imag"].values
    time = np.exp(2j * np.pi * np.outer(np.arange(lines.shape[-1]), np.arange(2000) / 2000))
    history = np.real(lines @ time)
    dynamic = np.abs(history - history.mean(axis=-1, keepdims=True)).max()
    assert mesh_force(*SPEEDS, speeds=6).compute(variant) == pytest.approx(dynamic, rel=5e-3)
    peak = mesh_force(*SPEEDS, speeds=6, part="peak").compute(variant)
    assert peak == pytest.approx(history.max(), rel=1e-4)
    level = np.abs(housing.exact.acceleration).max()
    assert housing_level(*SPEEDS, speeds=6).compute(variant) == pytest.approx(level, rel=1e-9)
    worst = solve_stress(case, static).dataset()["root_worst"].values
    stresses = [root_stress(gear).compute(variant) for gear in ("sun", "planet", "ring")]
    expected = [worst[:3, 0].max(), max(worst[:3, 1].max(), worst[3:, 0].max()), worst[3:, 1].max()]
    np.testing.assert_allclose(stresses, expected, rtol=1e-12)
    assert contact_pressure().compute(variant) == data["max_pressure"].values.max()
    found = solve_modes(variant.case, static).modes.frequency
    assert natural_frequency(11).compute(variant) == pytest.approx(found[10], rel=1e-9)
    with pytest.raises(CaseError, match=f"ends before this mode, with number {len(found)} at {found[-1]:.5g} Hz"):
        natural_frequency(999).compute(variant)


@pytest.mark.parametrize(
    "changes",
    [
        # with the loaded state of the others, of which the latest few are kept
        {"static.members": "elastic"},
        pytest.param({"dynamics.up_to": "60 kHz"}, marks=pytest.mark.slow),
        {"carrier.mass": "4 kg"},
        pytest.param({"operation.torque": "90 N m"}, marks=pytest.mark.slow),
        {"operation.torque": "-90 N m"},
        pytest.param({"ring.foundation_radial": "2e10 N/m^3"}, marks=pytest.mark.slow),
    ],
    ids=lambda changes: next(iter(changes)),
)
@pytest.mark.usefixtures("reused")
def test_shared_steps_change_no_number(coarse, grids, steps, changes):
    """A variant that differs in masses, loads or supports, with all that others left behind."""
    case = with_values(coarse, changes)
    shared, alone = Answer(case, steps, cache=grids), Answer(case, Steps(), cache=grids)
    np.testing.assert_array_equal(shared.static.cycle.deflection, alone.static.cycle.deflection)
    force, expected = (response_at(one, RANGE).force for one in (shared, alone))
    # Krylov steps in single precision show how arrays lie in memory
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_other_geometry_gets_grids_and_models_of_its_own(coarse):
    def keys(**changes):
        case = with_values(coarse, {k.replace("__", "."): v for k, v in changes.items()})
        same = (fingerprint(of(case)) == fingerprint(of(coarse)) for of in (compliance_entries, ring_entries))
        return tuple(same)

    assert keys(sun__profile_shift=0.52680) == (False, False)
    assert keys(material__youngs_modulus="200 GPa") == (False, False)
    assert keys(static__flank_elements=5) == (False, False)
    assert keys(static__members="elastic") == (False, False)
    # a ring that is held does not feel its foundation
    assert keys(ring__foundation_radial="2e10 N/m^3") == (True, False)
    moving = {"static__members": "elastic", "ring__foundation_radial": "2e10 N/m^3"}
    assert keys(**moving) == (False, False)
    assert keys(carrier__mass="4 kg") == (True, True)
    assert keys(operation__torque="90 N m") == (True, True)
    assert keys(dynamics__damping_ratio=0.03) == (True, True)
    assert keys(static__positions=32, set__backlash="0.1 mm")[0] is False
    assert keys(sun__errors={"thickness_reduction": "1 um"}) == (True, True)


@pytest.mark.slow
def test_the_optimum_of_the_page_is_one():
    """The rounded reliefs of docs/optimise.md on the grid of the case, which is not that of their search."""
    import re

    from femgear.run import grid_cache

    page = (CASE.parents[1] / "docs" / "optimise.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    values = dict(re.findall(r'^(\S+) = "(.*)"$', block, flags=re.MULTILINE))
    assert len(values) == 8
    case, _ = tip_reliefs(read_case(CASE))
    case = with_values(case, {"static.positions": 40, "static.stresses": False})
    before = Answer(case, Steps(), cache=grid_cache())
    after = before.of(with_values(case, values))
    for mesh in ("largest", "overall", "sun-planet"):
        ste = transmission_error(mesh)
        assert ste.compute(after) < 0.4 * ste.compute(before)
    ste = transmission_error("planet-ring")
    assert ste.compute(after) < ste.compute(before)
    forces = [forces_over_time(response_at(one, RANGE).force, dynamic=True).max(axis=1) for one in (before, after)]
    assert np.all(forces[1] < forces[0]) and forces[1].max() < 0.5 * forces[0].max()


def test_a_life_without_end_goes_through_the_journal(tmp_path):
    """JSON has no infinity: the journal holds null, and the design is known again."""
    strong = {"material.treatment": "case hardened steel", "material.hardness": 720}
    loads = [{"torque": "10 N m", "speed": "1500 rpm"}]
    quick = {"static.positions": 14, "static.flank_elements": 4, "operation.load_case": loads}
    case = with_values(read_case(CASE.with_name("spur_pair.toml")), strong | quick)
    quantity = named_quantity("root life", case=case)
    for computed in (1, 0):
        with open_designs(case, [("gear_1.profile_shift",)], journal=tmp_path / "journal.jsonl") as designs:
            assert designs.values((0.3,), [quantity])["root life"] == np.inf and designs.computed == computed
    assert '"root life": null' in (tmp_path / "journal.jsonl").read_text()
