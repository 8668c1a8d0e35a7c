"""As-built sets: closed forms of load sharing, springs against the whole contact problem, the command."""

import math
import re
import signal
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from script_runs import wait_for_lines

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.cli import main
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.pair_laws import PairLaws
from femgear.contact.pair_springs import PairSprings, solve_laws
from femgear.contact.solve import solve_contact
from femgear.contact.supports import RIGID, Supports
from femgear.errors import CaseError, StorageError
from femgear.gears.deviations import no_deviations
from femgear.run import grid_cache, solve
from femgear.storage.files import read_dataset
from femgear.study.relief import design_basis, sun_torque
from femgear.study.runner import Runner, open_runner
from femgear.study.sample_results import FILES, samples_into
from femgear.study.samples import (
    Law,
    Tolerances,
    between_positions,
    exact_numbers,
    over_a_turn,
    prepared,
    read_tolerances,
    sample_block,
    sample_case,
    sample_model,
    sample_positions,
    spring_numbers,
)
from femgear.trains.reading import read_case, with_value, with_values
from validation.soak import programs

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

CASES = Path(__file__).resolve().parents[2] / "cases"
CASE, TOLERANCES = CASES / "planetary_27_40_108.toml", CASES / "tolerances/3um.toml"
TORQUE = 100.0
ALPHA = math.radians(24.6)
"""Lin and Parker, J. Vib. Acoust. 121 (1999): pressure angle, mesh stiffness 5e8 N/m, bearings."""
slow = partial(pytest.param, marks=pytest.mark.slow)
SPRUNG = Supports(sun=5e7, carrier=2e8, planet=3e8)


def law(sigma="3 um", **more):
    return {"distribution": "normal", "sigma": sigma, **more}


def tolerances(**sections):
    return Tolerances.model_validate(sections)


PITCH_AND_PINS = tolerances(
    **{name: {"cumulative_pitch": law()} for name in ("sun", "planet", "ring")},
    pin_errors={"radial": law(), "tangential": law()},
)
ALL = tolerances(
    sun={"pitch": law("2 um"), "runout_amplitude": law("5 um", limit="8 um"), "profile_slope": law("2 um")},
    planet={
        "cumulative_pitch": {"distribution": "uniform", "limit": "3 um"},
        "runout_amplitude": law("4 um"),
        "profile_slope": law("2 um", mean="1 um"),
        "thickness_reduction": law("2 um", mean="20 um"),
    },
    ring={"profile_slope": law("3 um"), "thickness_reduction": law("2 um"), "runout_amplitude": law()},
    carrier={"runout_amplitude": law()},
    pin_errors={"tangential": law("2 um")},
)


@pytest.fixture(scope="module")
def case():
    return with_value(read_case(CASE), "static.flank_elements", 8)


@pytest.fixture(scope="module")
def basis(case):
    return design_basis(case, cache=grid_cache())


@pytest.fixture(scope="module")
def model(basis):
    return sample_model(basis, PITCH_AND_PINS, sun_torque=TORQUE)


def linear_laws(n_planets, load, *, bearing, sun=None, others=math.inf, mesh=5e8):
    """Planets as linear springs, both meshes under the angle ALPHA; the sun fixed, floating (0) or sprung.

    Carrier and ring rest on springs `others`.
    """
    psi = 2 * np.pi * np.arange(n_planets) / n_planets
    path = 2 / mesh + (2 * math.cos(ALPHA)) ** 2 / bearing
    axis = psi + np.pi / 2 - ALPHA
    normals = np.column_stack([np.cos(axis), np.sin(axis)])
    on_ring = np.column_stack([np.cos(psi - np.pi / 2 + ALPHA), np.sin(psi - np.pi / 2 + ALPHA)])
    of_carrier = on_ring - normals
    coupling = (on_ring @ on_ring.T + of_carrier @ of_carrier.T) / others
    coupling += normals @ normals.T / sun if sun else 0.0
    free = normals if sun == 0 else np.zeros((n_planets, 0))
    approach = np.column_stack([np.ones(n_planets), free])
    own = np.arange(n_planets)
    return PairLaws(
        force=np.geomspace(1e-3, 1.0, 6) * load,
        yields=np.full((1, n_planets, 6), path),
        moments=np.tile([0.0, 1.0, 0.0], (1, n_planets, 6, 1)),
        touching=np.zeros((1, n_planets, 1)),
        smooth=np.zeros((1, n_planets, 3, n_planets, 3)),
        supports=coupling,
        separation=np.zeros((1, n_planets)),
        mesh=own,
        approach=approach,
        loads=np.zeros((1, n_planets, 3)),
        motions=np.zeros((1, approach.shape[1])),
        pressure=np.zeros((1, n_planets, 6)),
    )


def spring_shares(laws, load, errors):
    """Shares (S, N) under tangential pin errors (S, N) [m], positive away from the path."""
    right = np.zeros(laws.approach.shape[1])
    right[0] = load
    found = solve_laws(PairSprings(laws), right, 2 * math.cos(ALPHA) * np.transpose(errors)[None])
    assert found[3].all()
    return found[0][0].T / load


@pytest.mark.parametrize("floating", [True, False])
@pytest.mark.parametrize("n_planets", [3, 4])
def test_linear_meshes_share_as_the_closed_form_says(n_planets, floating):
    """F_i = W/N - k_path 2 cos(alpha) res_i: least-squares residual by {1, cos psi, sin psi} or by {1}."""
    load, bearing = 20e3, 1e8
    laws = linear_laws(n_planets, load, bearing=bearing, sun=0.0 if floating else None)
    errors = np.random.default_rng(3).normal(0.0, 8e-6, (50, n_planets))
    psi = 2 * np.pi * np.arange(n_planets) / n_planets
    columns = [np.ones(n_planets)] + ([np.cos(psi), np.sin(psi)] if floating else [])
    basis = np.linalg.qr(np.column_stack(columns))[0]
    rest = errors - errors @ basis @ basis.T
    k_path = 1 / (1 / 5e8 + 1 / 5e8 + 4 * math.cos(ALPHA) ** 2 / bearing)
    expected = 1 / n_planets - k_path * 2 * math.cos(ALPHA) * rest / load
    assert expected.min() > 0
    np.testing.assert_allclose(spring_shares(laws, load, errors), expected, rtol=1e-8)


def test_published_shares():
    """A pin 20 um early at 20 kN: shares to the printed digits, bearings 1e8 N/m."""
    four = spring_shares(linear_laws(4, 20e3, bearing=1e8, sun=0.0), 20e3, [[-20e-6, 0, 0, 0]])
    assert four[0] == pytest.approx([0.2623, 0.2377, 0.2623, 0.2377], abs=5e-5)
    three = spring_shares(linear_laws(3, 20e3, bearing=1e8), 20e3, [[-20e-6, 0, 0]])
    assert three[0] == pytest.approx([0.366, 0.317, 0.317], abs=5e-4)


@pytest.mark.parametrize(
    ("n_planets", "sun", "forces"),
    [
        (3, 0.0, [861.1039] * 3),
        (3, 1e9, [585.99, 998.66, 998.66]),
        (4, 1e9, [326.18, 770.26, 716.60, 770.26]),
        (4, 0.0, [521.39, 770.26, 521.39, 770.26]),
    ],
)
def test_sharing_with_a_sprung_sun(n_planets, sun, forces):
    """A pin 2 um late under 2583.3118 N: an independent static solution with 3 (N + 3) coordinates.

    Its carrier and ring are held by 1e12 N/m.
    """
    load = 2583.3118
    laws = linear_laws(n_planets, load, bearing=1e9, sun=sun, others=1e12)
    found = spring_shares(laws, load, [[2e-6] + [0.0] * (n_planets - 1)])
    assert found[0] * load == pytest.approx(forces, abs=6e-3)


def test_planets_open_under_large_errors():
    """Alone on a fixed sun; on a floating one, by statics, opposite planets lose their load together."""
    fixed = spring_shares(linear_laws(3, 1e3, bearing=1e9), 1e3, [[1e-3, 0, 0], [0, -1e-3, 0], [0, 0, 0]])
    np.testing.assert_allclose(fixed, [[0, 0.5, 0.5], [0, 1, 0], [1 / 3] * 3], atol=1e-9)
    floating = linear_laws(4, 1e3, bearing=1e9, sun=0.0)
    found = spring_shares(floating, 1e3, [[1e-3, 0, 0, 0], [0, 0, 0, -1e-3]])
    np.testing.assert_allclose(found, [[0, 0.5, 0, 0.5]] * 2, atol=1e-8)


@pytest.mark.parametrize("sun", [None, 0.0, 1e8])
def test_newton_agrees_with_the_general_contact_solver(sun):
    """Five planets, many open: every sample is a contact problem of its own."""
    load = 4e3
    laws = linear_laws(5, load, bearing=1e9, sun=sun)
    errors = np.random.default_rng(9).normal(0.0, 3e-6, (60, 5))
    shares = spring_shares(laws, load, errors)
    assert (shares == 0).any()
    H = laws.supports + np.diag(laws.yields[0, :, 0])
    right = np.zeros(laws.approach.shape[1])
    right[0] = load
    for share, error in zip(shares, errors, strict=True):
        state = solve_contact(H, 2 * math.cos(ALPHA) * error, laws.approach, right)
        np.testing.assert_allclose(share, state.loads / load, atol=1e-9)


def walked(basis, model, errors, torque):
    """Numbers of one sample from the walk through the mesh cycle."""
    positions = model.basis.gears.equal_positions(16)
    cycle = replace(basis, deviations=model.deviations(errors), positions=positions).walk(torque)
    sun, ring = cycle.stiffness.reshape(2, basis.gears.n_planets, -1).mean(axis=(1, 2))
    return {
        "transmission_error": np.ptp(cycle.sun_arc),
        "planet_share": cycle.load_share.max(axis=1),
        "opens": (cycle.load_share <= 0).any(axis=1),
        "stiffness_sun_planet": sun,
        "stiffness_planet_ring": ring,
    }


def assert_equal(found, expected, rtol):
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=rtol, atol=rtol * np.abs(values).max())


@pytest.mark.parametrize(
    ("supports", "torque"),
    [
        (RIGID, TORQUE),
        slow(RIGID, -TORQUE),
        slow(SPRUNG, TORQUE),
        slow(SPRUNG, -TORQUE),
        slow(Supports(sun=0.0), TORQUE),
        slow(Supports(sun=0.0), -TORQUE),
    ],
    ids=["fixed", "fixed, reversed", "sprung", "sprung, reversed", "floating sun", "floating sun, reversed"],
)
def test_samples_are_those_of_the_walk_through_the_mesh_cycle(basis, torque, supports):
    basis = replace(basis, supports=supports)
    model = sample_model(basis, PITCH_AND_PINS, sun_torque=torque)
    errors = model.draw(1, 4, 4)
    exact, springs = exact_numbers(model, errors), spring_numbers(model, errors)
    for i in (0, 3):
        one = walked(basis, model, errors[i], torque)
        assert_equal({name: values[i] for name, values in exact.items()}, one, 1e-9)
    assert exact["opens"].any() == (supports == RIGID)
    np.testing.assert_array_equal(springs["opens"], exact["opens"])
    for name, most in (("transmission_error", 3e-3), ("planet_share", 1e-3), ("stiffness_sun_planet", 1e-2)):
        np.testing.assert_allclose(springs[name], exact[name], rtol=0, atol=most * exact[name].max())
    if supports.sun == 0.0:  # statics: three forces through known lines
        np.testing.assert_allclose(exact["planet_share"], 1 / 3, rtol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("planets", [4, 5])
def test_planets_out_of_phase(case, planets):
    """Five planets of 36/24/84 teeth in sequential phases; four at uneven angles."""
    values = {"set.planets": planets}
    if planets == 4:
        values |= {"set.planet_angles": [f"{k * 360 / 135!r} deg" for k in (0, 33, 68, 101)]}
    else:
        values |= {"sun.teeth": 36, "planet.teeth": 24, "ring.teeth": 84, "set.centre_distance": "45 mm"}
        values |= {"sun.bore_radius": "12 mm", "planet.bore_radius": "9 mm", "ring.outer_radius": "80 mm"}
        values |= {"sun.tip_diameter": None, "planet.tip_diameter": None}
        values |= {"sun.profile_shift": 0.0, "ring.profile_shift": None, "rack.root_radius": 0.2}
    basis = design_basis(with_values(case, values), cache=grid_cache())
    model = sample_model(basis, PITCH_AND_PINS, sun_torque=TORQUE)
    errors = model.draw(2, 0, 2)
    exact, springs = exact_numbers(model, errors), spring_numbers(model, errors)
    assert_equal({name: values[1] for name, values in exact.items()}, walked(basis, model, errors[1], TORQUE), 1e-9)
    assert_equal(springs, exact, 1e-2)


@pytest.mark.slow
def test_all_kinds_of_errors_at_a_negative_torque(basis):
    """Slopes tilt the windows where they are: the walk, which moves them, cuts them into other cells."""
    model = sample_model(basis, ALL, sun_torque=-TORQUE)
    errors = model.draw(5, 0, 3)
    exact, springs = exact_numbers(model, errors), spring_numbers(model, errors)
    for i in range(2):
        one = walked(basis, model, errors[i], -TORQUE)
        assert_equal({name: values[i] for name, values in exact.items()}, one, 6e-3)
    assert_equal(springs, exact, 1e-2)


@pytest.mark.slow
def test_a_planet_that_is_hardly_pressed_is_not_taken_for_open():
    """Sample 422 of seed 1: forces settle before motions; springs were 3 % off, and open at a position."""
    model, _ = prepared(read_case(CASE), TOLERANCES, cache=grid_cache())
    errors = np.concatenate([model.draw(1, i, 1) for i in (146, 422)])
    springs, exact = spring_numbers(model, errors), exact_numbers(model, errors)
    np.testing.assert_array_equal(springs["opens"], exact["opens"])
    assert not exact["opens"][1].any()
    for name in ("transmission_error", "planet_share", "stiffness_sun_planet", "stiffness_planet_ring"):
        np.testing.assert_allclose(springs[name], exact[name], rtol=2e-3, atol=1e-4 * exact[name].max())


@pytest.mark.slow
def test_no_errors_give_the_set_of_the_case(basis):
    nothing = tolerances(sun={"cumulative_pitch": law("0 um")}, pin_errors={"radial": law("0 um")})
    own = replace(no_deviations(basis.gears), pin_errors=[[0, 2e-6], [1e-6, 0], [0, 0]])
    for deviations in (None, own):
        placed = replace(basis, deviations=deviations)
        model = sample_model(placed, nothing, sun_torque=TORQUE)
        exact, springs = (sample_block(model, 1, 0, 2, exact=way) for way in (True, False))
        assert_equal(exact, springs, 2e-3)
        cycle = replace(placed, positions=16).walk(TORQUE)
        np.testing.assert_allclose(exact["transmission_error"], np.ptp(cycle.sun_arc), rtol=1e-9)


def test_a_sample_repeats_by_itself_and_follows_its_laws(model):
    whole, alone = sample_block(model, 7, 0, 40), sample_block(model, 7, 37, 1)
    for name in whole:
        np.testing.assert_allclose(alone[name][0], whole[name][37], rtol=1e-9)
    assert not np.array_equal(model.draw(7, 0, 1), model.draw(8, 0, 1))
    share = np.random.default_rng(1).random(100_000)
    cut = Law(distribution="normal", mean="1 um", sigma="2 um", limit="3 um").at(share)
    assert np.abs(cut - 1e-6).max() <= 3e-6
    # standard deviation of a normal law cut off at 1.5 of its own
    assert cut.std() == pytest.approx(2e-6 * 0.7426, rel=0.01)
    free = Law(distribution="normal", sigma="2 um").at(share)
    assert free.std() == pytest.approx(2e-6, rel=0.01) and np.abs(free).max() > 7e-6
    even = Law(distribution="uniform", mean="1 um", limit="4 um").at(share)
    assert even.min() == pytest.approx(-3e-6, abs=1e-9)
    assert even.std() == pytest.approx(8e-6 / 12**0.5, rel=0.01)


@pytest.mark.slow
def test_over_a_turn_is_the_walk_over_as_many_periods(basis):
    small = tolerances(sun={"runout_amplitude": law("4 um")}, pin_errors={"tangential": law("1 um")})
    model = sample_model(basis, small, sun_torque=-TORQUE, positions=8)
    errors = model.draw(3, 0, 1)[0]
    cycle = replace(basis, deviations=model.deviations(errors), positions=8).walk(-TORQUE, periods=27)
    # the sun repeats after 27 mesh periods, a quarter of the ring's 108 teeth
    ste, share = over_a_turn(model, errors)
    assert ste == pytest.approx(np.ptp(cycle.sun_arc), rel=3e-3)
    assert share == pytest.approx(cycle.load_share.max(), rel=3e-3)


def test_a_sample_is_a_case(case, basis):
    own = with_values(
        case,
        {
            "sun.modifications": [{"kind": "profile crowning", "amount": "2 um"}],
            "planet.errors.runout_amplitude": "3 um",
        },
    )
    model = sample_model(replace(basis, deviations=set_deviations(own)), ALL, sun_torque=TORQUE)
    made = set_deviations(sample_case(own, model, 4, 11))
    wanted = model.deviations(model.draw(4, 11, 1)[0])
    for name in ("sun_pitch", "planet_pitch", "planet_ring_side_pitch", "ring_pitch", "pin_errors"):
        np.testing.assert_allclose(getattr(made, name), getattr(wanted, name), atol=1e-15)
    np.testing.assert_allclose(made.planet_thickness, wanted.planet_thickness, atol=1e-15)
    for one, two in zip(made.planet_runout, wanted.planet_runout, strict=True):
        assert one.amplitude == pytest.approx(two.amplitude) and one.phase == pytest.approx(two.phase)
    for name in ("sun", "planet_sun_side", "planet_ring_side", "ring"):
        found, expected = ([m.amount for m in getattr(d, name).modifications] for d in (made, wanted))
        assert found == pytest.approx(expected)


@pytest.mark.slow
def test_the_command_writes_numbers_figure_and_the_worst_sample(case, tmp_path, capsys):
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(case.source, encoding="utf-8")
    words = ["samples", str(path), "--tolerances", str(TOLERANCES), "-o", str(out), "--seed", "3"]
    assert main([*words, "-n", "30"]) == 0
    said = capsys.readouterr().out
    assert "gear axes fixed" in said and "--only static" in said and "in series" not in said
    data = read_dataset(out / "samples.nc")
    assert data.sizes["sample"] == 30 and data.attrs["seed"] == 3 and "sigma" in data.attrs["tolerances"]
    assert data.transmission_error.attrs["units"] == "m"
    error = float(data.transmission_error_error)
    assert 0 < error < 1e-3 and f"{error:.1e} (transmission error)" in said
    worst = data.attrs["worst"]
    assert worst == int(data.transmission_error.values.argmax()) and worst in data.check.values
    assert (out / "samples.png").read_bytes()[:4] == b"\x89PNG"
    # femgear run of the worst sample gives the number with the peaks between, which the table names
    run = tmp_path / "run"
    assert main(["run", str(out / "worst.toml"), "--only", "static", "--no-pictures", "-o", str(run)]) == 0
    (of_run,) = set(read_dataset(run / "static.nc").ste_overall_peak_to_peak.values)
    solved_again = data.sel(check=worst)
    exact, between = (float(solved_again[f"transmission_error_{name}"]) for name in ("exact", "between"))
    assert of_run == pytest.approx(between, rel=1e-6) and between == pytest.approx(exact, rel=0.03)
    assert f"STE {1e6 * of_run:.6g} um" in said.replace("\n", " ")
    assert main([*words, "--index", str(worst)]) == 0
    again = read_case(out / f"sample_{worst}.toml")
    assert again == read_case(out / "worst.toml")
    # complete results are replaced with --force alone, whatever the command
    before = {name: (out / name).read_bytes() for name in FILES}
    for more in (["-n", "30"], ["--method", "exact", "-n", "2"]):
        assert main([*words, *more]) == 4
        refused = capsys.readouterr().err
        assert "E-OUTPUT" in refused and "--force" in refused
    assert before == {name: (out / name).read_bytes() for name in FILES}
    assert main([*words, "--method", "exact", "-n", "2", "--force"]) == 0
    few = read_dataset(out / "samples.nc")
    np.testing.assert_allclose(few.transmission_error, data.transmission_error[:2], rtol=1e-3)
    assert planetary_set(again).n_planets == 3


@pytest.mark.slow
def test_samples_drawn_at_random_are_solved_exactly(case, tmp_path, monkeypatch):
    """And many samples are drawn as points of a grid that weigh as many as lie there."""
    monkeypatch.setattr("femgear.study.sample_results._SHARE_AGAIN", 10)
    monkeypatch.setattr("femgear.study.sample_results._DRAWN", 20)
    monkeypatch.setattr("femgear.study.sample_results._ROWS", 15)
    basis = prepared(case, TOLERANCES, positions=8, cache=grid_cache())
    blocks, _ = samples_into(case, tmp_path, basis, count=40, seed=2)
    data = read_dataset(tmp_path / "samples.nc")
    drawn = data.drawn.values
    assert len(np.unique(drawn)) == 4 and "4 samples drawn at random" in blocks[1].title
    exact = exact_numbers(basis[0], np.concatenate([basis[0].draw(2, int(i), 1) for i in drawn]))
    for row, name in zip(blocks[1].rows, ("transmission_error", "largest_share"), strict=False):
        np.testing.assert_allclose(data[f"{name}_drawn"], exact[name], rtol=1e-9)
        difference = data[name].values[drawn] / exact[name] - 1.0
        np.testing.assert_allclose(data[f"{name}_difference"], difference, atol=1e-9)
        assert 0.0 < np.abs(difference).max() < 0.01
        assert float(row[-1]) == pytest.approx(100.0 * np.abs(difference).max(), rel=0.05)
        assert float(data[f"{name}_quantile"].sel(quantile=0.5)) == np.median(data[name].values)
    assert (tmp_path / "samples.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.slow
def test_errors_below_rounding_are_computed_and_drawn(case, tmp_path):
    path, out, laws = tmp_path / "case.toml", tmp_path / "out", tmp_path / "laws.toml"
    path.write_text(case.source, encoding="utf-8")
    law = 'tangential = {distribution = "normal", sigma = "3 um", limit = "1e-9 um"}'
    laws.write_text(f"[pin_errors]\n{law}\n", encoding="utf-8")
    assert main(["samples", str(path), "--tolerances", str(laws), "-o", str(out), "-n", "3"]) == 0
    assert np.ptp(read_dataset(out / "samples.nc").transmission_error.values) < 1e-13


@pytest.mark.slow
def test_members_that_move_share_better_and_are_told(case, tmp_path):
    path = tmp_path / "pins.toml"
    path.write_text('pin_errors.tangential = { distribution = "normal", sigma = "3 um" }', encoding="utf-8")
    medians = []
    for members, note in (("fixed", "gear axes fixed"), ("elastic", "planet-ring with the ring's foundation")):
        one = with_value(case, "static.members", members)
        (block, *_), _ = samples_into(one, tmp_path / members, prepared(one, path, cache=grid_cache()), count=20)
        assert [note in line for line in block.notes].count(True) == 1
        # the column "ideal" is what a run of the case finds
        of_run = 1e6 * solve(one, "static")["static"].cycle.peak_to_peak("sun_arc")
        assert float(block.rows[0][1]) == pytest.approx(of_run, rel=5e-3)
        medians.append(float(read_dataset(tmp_path / members / "samples.nc").largest_share.median()))
    assert medians[1] < 0.4 < 0.45 < medians[0]


class Interrupted(Runner):
    """Ends after some tasks, or counts them."""

    def __init__(self, tasks):
        super().__init__()
        self.tasks = tasks

    def _next(self):
        if not self.tasks:
            raise KeyboardInterrupt
        self.tasks -= 1
        return super()._next()


@pytest.mark.slow
def test_two_processes_and_an_interrupted_command_give_the_same_bits(case, tmp_path, monkeypatch):
    monkeypatch.setattr("femgear.study.sample_results._BLOCKS", {"spring": 8, "exact": 4})
    basis, journal = prepared(case, TOLERANCES, positions=8, cache=grid_cache()), tmp_path / "samples.jsonl"
    with open_runner(2) as runner:
        samples_into(case, tmp_path, basis, count=20, runner=runner)
    expected = read_dataset(tmp_path / "samples.nc")
    assert not journal.exists()
    for more in ({}, {"seed": 2}, {"count": 10}):
        with pytest.raises(StorageError, match=r"E-OUTPUT.*results already"):
            samples_into(case, tmp_path, basis, **{"count": 20, **more})
    assert expected.identical(read_dataset(tmp_path / "samples.nc")) and not journal.exists()
    with pytest.raises(KeyboardInterrupt) as ended:
        samples_into(case, tmp_path, basis, count=20, runner=Interrupted(2), force=True)
    assert "goes on" in ended.value.__notes__[0] and len(journal.read_bytes().splitlines()) == 3
    # of other samples nothing is taken, and nothing is lost
    for more in ({"seed": 2}, {"exact": True}):
        with pytest.raises(StorageError, match=r"E-JOURNAL.*written for another (seed|method)"):
            samples_into(case, tmp_path, basis, count=20, **more)
    with pytest.raises(StorageError, match=r"E-JOURNAL.*written for other tolerances"):
        samples_into(case, tmp_path, (basis[0], basis[1] + "\n"), count=20)
    with pytest.raises(StorageError, match=r"E-JOURNAL.*written for another case"):
        samples_into(with_value(case, "sun.mass", "3 kg"), tmp_path, basis, count=20)
    # a damaged block is computed again
    text = journal.read_bytes()
    journal.write_bytes(re.sub(rb'"8-16"', b'"0-16"', text))
    last = Interrupted(99)
    with pytest.warns(UserWarning, match="W-JOURNAL"):
        samples_into(case, tmp_path, basis, count=20, runner=last)
    # two blocks, and the samples that are solved again in every way
    assert last.tasks == 97 - len(expected.check) and not journal.exists()
    assert expected.identical(read_dataset(tmp_path / "samples.nc"))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["spring", "exact"])
def test_samples_that_are_killed_go_on_with_the_same_command(tmp_path, method):
    """By Ctrl-C and kill -9, in two processes and in one: the same numbers as without."""
    words = ["samples", CASE, "--tolerances", TOLERANCES, "--method", method]
    words += ["-n", "6000" if method == "spring" else "500", "-o"]
    journal, lines = tmp_path / "killed" / "samples.jsonl", 0
    for way, workers in ((signal.SIGINT, 2), (signal.SIGKILL, 2), (signal.SIGKILL, 1)):
        run = programs.start([*words, "killed", "--workers", workers], tmp_path, fresh=True)
        wait_for_lines(journal, lines + 2, run)
        run.kill(way)
        ended = run.wait()
        assert ended.code == (130 if way == signal.SIGINT else -9) and not ended.crash
        found = journal.read_bytes().count(b"\n")
        assert lines < found
        lines = found
    assert programs.start([*words, "killed"], tmp_path, fresh=True).wait().code == 0
    assert programs.start([*words, "whole"], tmp_path, fresh=True).wait().code == 0
    killed, whole = (read_dataset(tmp_path / name / "samples.nc") for name in ("killed", "whole"))
    assert whole.identical(killed) and not journal.exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[sun]\npich = { distribution = "normal", sigma = "3 um" }', "2: sun.pich: unknown key"),
        ('[sun]\npitch = { distribution = "normal" }', "2: sun.pitch: a normal distribution needs"),
        ('[sun]\npitch = { distribution = "gamma" }', "2: sun.pitch.distribution: not one of the choices"),
        ('[sun]\npitch = { distribution = "normal", sigma = "3" }', "2: sun.pitch.sigma: a length needs"),
        ('[sun]\npitch = { distribution = "normal", sigma = "-3 um" }', "not plausible"),
        ('[ring]\npitch = { distribution = "normal", sigma = "90 um" }', "2: ring.pitch: errors of 450 um"),
        ('[sun]\npitch = { distribution = "uniform", sigma = "3 um", limit = "1 um" }', "has no sigma"),
        ("[gear]\npitch = 3", "gear: unknown key"),
        ("[sun]\n[carrier]", "no error has a tolerance"),
        ('[pin_errors]\nradial = "3 um"', "a table is needed, not a text"),
    ],
)
def test_mistakes_of_a_tolerances_file(text, said, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        read_tolerances(path, 1.5e-3)
    assert said in str(caught.value) and "wrong.toml" in str(caught.value)


def test_refusals(basis, case, tmp_path, capsys):
    both = {"pitch": law(), "cumulative_pitch": law()}
    with pytest.raises(ValueError, match="say the same"):
        tolerances(sun=both)
    with pytest.raises(CaseError, match="nothing touches"):
        sample_model(basis, PITCH_AND_PINS, sun_torque=0.0)
    path = tmp_path / "case.toml"
    path.write_text(with_value(case, "static.back_flanks", True).source, encoding="utf-8")
    words = ["samples", str(path), "--tolerances", str(TOLERANCES), "-o", str(tmp_path / "out")]
    for more, said in (
        (["--method", "spring"], "--method exact"),
        (["-n", "0"], "--number"),
        (["--positions", "4"], "--positions"),
        (["--seed=-1"], "--seed"),
        (["--index=-2"], "--index"),
    ):
        assert main([*words, *more]) == 2
        assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_samples_have_the_errors_of_runs_with_many_positions(basis, torque):
    """Where pitch errors keep the record open, equidistant positions lacked up to two thirds at its end."""
    places = sample_positions(basis, torque, 16)
    model = sample_model(basis, PITCH_AND_PINS, sun_torque=torque, positions=places)
    assert places[0] == 0.0 and places[-1] == 1.0 and (np.diff(places) > 0.0).all() and len(places) < 40
    errors = model.draw(1, 0, 64)
    found = spring_numbers(model, errors)["transmission_error"]
    assert found.min() > 0.0
    many = np.append(np.arange(128) / 128, 1.0)
    for i in np.argsort(found)[[0, 1, 31, 63]]:
        walk = partial(
            walk_mesh_cycle,
            basis.gears,
            basis.bodies,
            sun_torque=torque,
            supports=basis.supports,
            deviations=model.deviations(errors[i]),
        )
        exact = np.ptp(walk(positions=many).sun_arc)
        assert found[i] == pytest.approx(exact, rel=0.03)
        # a run of the sample has it too, with positions between as far as the end
        cycle = walk(positions=16, options=CycleOptions(peaks=True))
        assert cycle.peak_to_peak("sun_arc") == pytest.approx(exact, rel=0.01)
        assert cycle.between is not None and cycle.between.position[-1] == 1.0


# --- slices of the face width ------------------------------------------------------------------------

AXES = tolerances(
    sun={
        "cumulative_pitch": law(),
        "lead_slope": law(),
        "lead_crowning": law("1 um", mean="2 um"),
        "misalignment": {"x": law("0.1 mrad"), "y": law("0.1 mrad")},
    },
    planet={
        "lead_slope": law("2 um"),
        "profile_slope": law("2 um"),
        "misalignment": {"radial": law("0.1 mrad"), "tangential": law("0.1 mrad")},
    },
    carrier={"misalignment": {"x": law("0.05 mrad")}},
    pin_errors={"tangential": law()},
)


@pytest.fixture(scope="module")
def sliced(case):
    return with_value(case, "static.slices", 9)


@pytest.mark.slow
@pytest.mark.parametrize(
    "values",
    [
        slow({}),
        slow({"operation.torque": "-100 N m", "static.members": "elastic"}),
        {
            "sun.modifications": [{"kind": "lead crowning", "amount": "3 um"}],
            "planet.tilt_stiffness": "2e4 N m/rad",
            "sun.torque_end": "front",
        },
    ],
    ids=["plain", "other flanks, elastic", "crowned, tilting, twisted"],
)
def test_springs_in_slices_are_within_a_permille_of_the_whole_contact(sliced, values):
    case = with_values(sliced, values)
    basis = design_basis(case, cache=grid_cache())
    torque = sun_torque(case, basis.gears)
    model = sample_model(basis, AXES, sun_torque=torque, positions=6)
    errors = model.draw(4, 0, 3)
    springs, exact = spring_numbers(model, errors), exact_numbers(model, errors)
    assert springs["transmission_error"] == pytest.approx(exact["transmission_error"], rel=2e-3)
    assert springs["planet_share"] == pytest.approx(exact["planet_share"], abs=1e-3)
    for kind in ("stiffness_sun_planet", "stiffness_planet_ring"):
        assert springs[kind] == pytest.approx(exact[kind], rel=1e-2)
    # exactly means as femgear run solves it
    sample = replace(basis, deviations=model.deviations(errors[0]), positions=model.position)
    if torque > 0:
        arc = sample.walk(torque, options=CycleOptions()).sun_arc
        assert exact["transmission_error"][0] == pytest.approx(np.ptp(arc), rel=1e-12)


@pytest.mark.slow
def test_a_sample_in_slices_is_a_case_that_a_run_solves(sliced, tmp_path):
    path = tmp_path / "axes.toml"
    path.write_text(
        "[sun]\nlead_slope = { distribution = 'normal', sigma = '3 um' }\n"
        "[planet.misalignment]\nradial = { distribution = 'uniform', limit = '0.2 mrad' }\n"
    )
    model, _ = prepared(sliced, path, positions=8, cache=grid_cache())
    made = sample_case(sliced, model, 1, 5)
    deviations, expected = set_deviations(made), model.deviations(model.draw(1, 5, 1)[0])
    assert deviations.planet_misalignment == pytest.approx(expected.planet_misalignment, abs=1e-12)
    assert deviations.sun.lead[0].amount == pytest.approx(expected.sun.lead[0].amount, abs=1e-15)
    of_run = solve(made, "static")["static"].cycle.peak_to_peak("sun_arc")
    assert between_positions(model, model.draw(1, 5, 1)[0])[0] == pytest.approx(of_run, rel=1e-6)


def test_leads_and_axes_askew_need_slices_of_spur_teeth(basis, case):
    with pytest.raises(CaseError, match=r"E-SLICES.*lead_slope"):
        sample_model(basis, tolerances(sun={"lead_slope": law()}), sun_torque=TORQUE)
    with pytest.raises(CaseError, match=r"E-SLICES.*planet\.misalignment\.radial"):
        sample_model(basis, tolerances(planet={"misalignment": {"radial": law("0.1 mrad")}}), sun_torque=TORQUE)


def test_slopes_of_axes_have_a_plausible_size():
    with pytest.raises(ValidationError, match="20 mrad"):
        Tolerances.model_validate({"sun": {"misalignment": {"x": law("10 mrad")}}}, context={"module": 1.5e-3})


# --- sets without springs ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "values",
    [
        slow({"static.slices": 12, "static.flank_elements": 6, "operation.torque": "-300 N m"}),
        slow({"static.back_flanks": True}),
        {"static.members": "elastic", "planet.bearing_clearance": "3 um"},
    ],
    ids=["helical", "back flanks", "bearing clearance"],
)
def test_samples_without_springs_are_those_of_runs(values, case, tmp_path):
    own = read_case(CASE.with_name("helical_23_24_73.toml")) if "static.slices" in values else case
    own = with_values(own, values)
    path = tmp_path / "tolerances.toml"
    lead = "lead_slope" if "static.slices" in values else "profile_slope"
    path.write_text(
        f"[sun]\n{lead} = {{ distribution = 'normal', sigma = '3 um' }}\n"
        "[planet]\nthickness_reduction = { distribution = 'uniform', mean = '20 um', limit = '5 um' }\n"
        "[pin_errors]\ntangential = { distribution = 'normal', sigma = '3 um' }\n",
        encoding="utf-8",
    )
    model, _ = prepared(own, path, positions=8, cache=grid_cache())
    assert model.walked
    errors = np.vstack([np.zeros(model.size), model.draw(2, 3, 1)])
    found = exact_numbers(model, errors)
    for index, made in enumerate((own, sample_case(own, model, 2, 3))):
        made = with_values(made, {"static.positions": 8, "static.longest_record": 1})
        cycle = solve(made, "static")["static"].cycle
        assert found["transmission_error"][index] == pytest.approx(cycle.peak_to_peak("sun_arc"), rel=1e-6)
        assert found["planet_share"][index] == pytest.approx(cycle.extremes("load_share")[1], rel=1e-6)
        kinds = cycle.mean("stiffness").reshape(2, -1).mean(axis=1)
        assert found["stiffness_sun_planet"][index] == pytest.approx(kinds[0], rel=1e-6)
        assert found["stiffness_planet_ring"][index] == pytest.approx(kinds[1], rel=1e-6)
        assert between_positions(model, errors[index])[0] == pytest.approx(found["transmission_error"][index])
    if "static.slices" not in values:  # these take a minute
        longer, share = over_a_turn(replace(model, basis=replace(model.basis, positions=3)), errors[1])
        assert longer > 0.0 and 1 / 3 <= share <= 1.0


@pytest.mark.slow
def test_the_command_solves_helical_samples_as_runs(tmp_path, capsys):
    """Without a method they are exact; springs and axes askew, which they have not, are refused with a way out."""
    own = read_case(CASE.with_name("helical_23_24_73.toml"))
    own = with_values(own, {"static.slices": 9, "static.flank_elements": 6})
    path, axes, out = tmp_path / "case.toml", tmp_path / "axes.toml", tmp_path / "out"
    path.write_text(own.source, encoding="utf-8")
    words = ["samples", str(path), "--positions", "8", "-n", "2", "-o", str(out), "--tolerances"]
    assert main([*words, str(TOLERANCES), "--method", "spring"]) == 2
    assert "--method exact" in capsys.readouterr().err
    axes.write_text("[sun.misalignment]\nx = { distribution = 'normal', sigma = '0.1 mrad' }\n", encoding="utf-8")
    assert main([*words, str(axes)]) == 2
    assert "or give a lead_slope" in capsys.readouterr().err
    assert not out.exists()
