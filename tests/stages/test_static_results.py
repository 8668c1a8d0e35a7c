"""Stage "stress": ranges, spectra and nominal stresses against geometry, equilibrium and root cycles."""

import math
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from femgear.contact.flank_pairs import LEFT, RIGHT
from femgear.contact.root_stress import LOADED, body_stress, root_stress_cycle
from femgear.contact.tooth_loads import loaded_teeth
from femgear.fe.elasticity import Material
from femgear.findings import Finding
from femgear.gears.gear import half_thickness_angle
from femgear.report.tables import unmarked
from femgear.stages import static as static_stages
from femgear.stages.static import relief_kinks, solve_static, solve_stress
from femgear.stages.static_results import _peak_doubt, describe_set, describe_stress, stress_warnings
from femgear.stages.strength import nominal_stresses
from femgear.trains.reading import read_case, with_value, with_values
from validation.reference.root_stress import set_root_stress

FILE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"
P, N = 16, 3

STEEL = Material(206e9, 0.3, 7850.0)


def coarse(**changes):
    case = read_case(FILE)
    settings = {"dynamics.mesh_harmonics": 3, "static.positions": P, "static.flank_elements": 8}
    for key, value in (settings | changes).items():
        case = with_value(case, key, value)
    return case


@pytest.fixture(scope="module", autouse=True)
def grids(tmp_path_factory):
    """Folder of the grids, which most cases share."""
    global CACHE
    CACHE = tmp_path_factory.mktemp("grids")


def solved(**changes):
    case = coarse(**changes)
    static = solve_static(case, cache=CACHE)
    return case, static, solve_stress(case, static)


@pytest.fixture(scope="module")
def reference():
    return solved()


@pytest.fixture(scope="module")
def reversed_torque():
    return solved(**{"operation.torque": "-100 N m"})


def fields(static, result, *, reverse=False):
    """Field of every body and the meshes that act on it."""
    teeth = loaded_teeth(static.cycle, reverse=reverse)
    bodies = [(result.influences.sun, [(j, 0, LEFT) for j in range(N)])]
    bodies += [(result.influences.planet, [(n, 1, LEFT), (N + n, 0, RIGHT)]) for n in range(N)]
    bodies.append((result.influences.ring, [(N + j, 1, LEFT) for j in range(N)]))
    positions = np.arange(static.cycle.position.size)
    for root, acting in bodies:
        numbers = np.arange(len(root.influence))
        field = body_stress(static.planetary_set, root, acting, [teeth], positions, numbers)
        yield field[:, :, 0], acting, teeth


def assert_fields_are_root_cycles(static, result, cycles, *, reverse=False):
    """Every mesh sees in its slots what the field of the whole body has at the teeth with those numbers."""
    for field, acting, teeth in fields(static, result, reverse=reverse):
        m = field.shape[1] // 2
        for mesh, gear, side in acting:
            sides = field[teeth.tooth[gear, mesh] % len(field)].reshape(-1, 2, m, field.shape[2])
            expected = sides[:, :: 1 if side == LEFT else -1].transpose(0, 3, 1, 2)
            found = cycles[2 * mesh + gear].stress[1:-1]
            found = found[::-1] if reverse else found
            assert np.abs(expected - found).max() < 1e-9 * np.abs(found).max()


@pytest.mark.slow
def test_field_of_a_body_is_that_of_the_root_cycles(reference, reversed_torque):
    for (_, static, result), reverse in ((reference, False), (reversed_torque, True)):
        assert_fields_are_root_cycles(static, result, result.roots, reverse=reverse)


def test_influences_are_those_of_solutions_of_their_own(reference):
    """Sun and planet are observed with their flanks; each gear alone gives the same to rounding."""
    _, static, result = reference
    alone = set_root_stress(static.sectors, STEEL)
    for kind in ("sun", "planet", "ring"):
        found, expected = (getattr(one, kind).influence for one in (result.influences, alone))
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


def test_loads_on_back_flanks_are_part_of_the_field(reference):
    _, static, result = reference
    cycle = static.cycle
    wedged = replace(
        cycle,
        back_tooth_load=0.3 * cycle.tooth_load,
        back_path=-cycle.path,
        back_tooth=cycle.tooth + 2,
    )
    roots = root_stress_cycle(static.planetary_set, result.influences, wedged)
    assert max(np.abs(a.stress - b.stress).max() for a, b in zip(roots, result.roots, strict=True)) > 1e6
    assert_fields_are_root_cycles(replace(static, cycle=wedged), result, roots)


def test_ranges_hold_the_histories_of_both_meshes(reference):
    """At the point of the range, the engagements with sun and ring alone give its two ends."""
    *_, result = reference
    for n in range(N):
        sun_side, ring_side = result.roots[2 * n + 1], result.roots[2 * (N + n)]
        of_sun, of_ring = result.ranges[2 * n + 1], result.ranges[2 * (N + n)]
        assert (of_sun.kind, of_ring.kind) == ("planet", "planet")
        # the root that the sun pulls is the root of the back flank while the ring is in mesh, and vice versa
        for one, loaded, other in ((of_sun, sun_side, ring_side), (of_ring, ring_side, sun_side)):
            tension = loaded.stress[:, :, LOADED, one.point]
            compression = other.stress[:, :, 1 - LOADED, one.point]
            assert one.history.max() == pytest.approx(max(tension.max(), compression.max()), rel=1e-9)
            assert one.history.min() == pytest.approx(min(tension.min(), compression.min()), rel=1e-9)
            # the ends of the range lie between the positions of the history
            assert 1.0 - 1e-12 < one.maximum / one.history.max() < 1.1
            assert 1.0 - 1e-12 < one.minimum / one.history.min() < 1.1
            # bent both ways: a ratio far below the zero of a gear that is bent one way
            assert one.minimum < -0.5 * one.maximum


@pytest.mark.parametrize("reverse", [False, True])
def test_ring_follows_sun_after_the_angle_between_the_pitch_points(reference, reversed_torque, reverse):
    """The tooth turns by pi less (more, with the other flanks) its half angles on both pitch circles."""
    _, static, result = reversed_torque if reverse else reference
    s = static.planetary_set
    half = sum(
        float(half_thickness_angle(s.planet, s.planet.base_radius / math.cos(angle)))
        for angle in (s.working_pressure_angle_sun_planet, s.working_pressure_angle_planet_ring)
    )
    between = (math.pi + (half if reverse else -half)) / (2.0 * math.pi)
    pitch = s.sun.base_pitch
    for n in range(N):
        peaks = []
        for number in (2 * n + 1, 2 * (N + n)):
            one, root = result.ranges[number], result.roots[number]
            peak = (one.history.argmax() - len(one.history) // 4) / len(one.history)
            tension = root.stress[:, :, LOADED, one.point]
            path = root.path[np.unravel_index(tension.argmax(), tension.shape)]
            peaks.append(peak - path / s.planet.teeth)
        # the first is the pitch point with the sun: place zero, to half a sample
        assert peaks[0] == pytest.approx(0.0, abs=0.51 / (P * s.planet.teeth))
        assert peaks[1] - peaks[0] == pytest.approx(between, abs=1e-6)
    assert pitch == pytest.approx(s.planet.base_pitch)


def test_the_sun_is_bent_by_all_planets_in_one_turn(reference):
    *_, result = reference
    for mesh in range(N):
        one, root = result.ranges[2 * mesh], result.roots[2 * mesh]
        assert one.history is not None and len(one.history) == 27 * P
        height = one.history > 0.6 * one.maximum
        assert np.count_nonzero(height & ~np.roll(height, 1)) == N
        # slots of root cycles have one more at either end
        slot, position = one.worst
        assert root.tension[slot + 1, position] == root.tension.max()


def test_negative_torque_is_the_mirror_image(reference, reversed_torque):
    front, back = reference[2], reversed_torque[2]
    for a, b in zip(front.ranges, back.ranges, strict=True):
        assert (b.maximum, b.minimum, b.point) == pytest.approx((a.maximum, a.minimum, a.point), rel=1e-6)
        if a.kind == "planet" and a.mesh % N == 0:
            # planet 1 lies on the mirror; seen from behind time runs the other way
            quarter = len(a.history) // 4
            mirrored = np.roll(np.roll(a.history, -quarter)[::-1], 1 + quarter)
            shift = min((-1, 0, 1), key=lambda k: np.abs(np.roll(mirrored, k) - b.history).max())
            assert np.abs(np.roll(mirrored, shift) - b.history).max() < 1e-6 * a.maximum
    for name in ("edges", "time", "engagements", "cycles", "duration"):
        assert getattr(back.spectrum, name) == pytest.approx(getattr(front.spectrum, name), rel=1e-6)
    assert back.nominal.root == pytest.approx(front.nominal.root, rel=1e-12)


def test_load_spectrum_carries_the_mesh_force(reference):
    """Mean load under load times the pairs in mesh is the mesh force, to half a class."""
    _, static, result = reference
    spectrum = result.spectrum
    middle, width = 0.5 * (spectrum.edges[1:] + spectrum.edges[:-1]), np.diff(spectrum.edges)[0]
    force = spectrum.time @ middle * spectrum.duration
    assert force == pytest.approx(static.cycle.force.mean(axis=1), abs=0.5 * width * spectrum.duration.max())
    assert spectrum.time.sum(axis=1) == pytest.approx(1.0)
    assert spectrum.engagements.max(axis=1) == pytest.approx(1.0)
    # identical teeth: every peak is the largest load of the mesh
    peak = np.searchsorted(spectrum.edges, static.cycle.tooth_load.max(axis=(1, 2)) * (1 - 1e-9)) - 1
    assert (spectrum.engagements.argmax(axis=1) == peak).all()
    assert spectrum.cycles.tolist() == [[3, 1]] * N + [[1, 3]] * N
    assert spectrum.duration[0] > static.planetary_set.contact_ratio_sun_planet


def with_pitch_error(amount, monkeypatch, **changes):
    """One planet and tooth 5 of the sun out of place: a record of 27 mesh periods, of which few are kept."""
    monkeypatch.setattr(static_stages, "WHOLE_RECORD", 2)
    settings = {
        "sun.errors": {"cumulative_pitch": [amount if tooth == 5 else "0 um" for tooth in range(27)]},
        "set.planets": 1,
        "static.positions": 8,
    }
    return solved(**settings | changes)


@pytest.fixture(scope="module")
def pitch_error():
    with pytest.MonkeyPatch.context() as monkeypatch:
        yield with_pitch_error("8 um", monkeypatch)


@pytest.mark.slow
def test_the_tooth_with_the_pitch_error_is_found(pitch_error):
    _, static, result = pitch_error
    assert static.cycle.periods == 27 and result.closes
    for one in result.ranges:
        worst = np.flatnonzero(one.tooth_maximum == one.tooth_maximum.max())
        if one.kind == "sun":
            assert worst.tolist() == [5] and len(one.tooth_maximum) == 27
            assert np.delete(one.tooth_maximum, 5).max() < 0.95 * one.maximum
        elif one.kind == "planet":
            # 27 has no divisor in common with 40: every tooth of a planet meets every tooth of the sun
            assert len(worst) == len(one.tooth_maximum) == 40
        else:
            # of the ring every 27th tooth meets the same
            assert len(one.tooth_maximum) == 108 and (one.tooth_maximum[:27] == one.tooth_maximum[27:54]).all()
        assert one.history is None
    data = result.dataset()
    assert "planet_root_stress" not in data and "pressure_distribution" not in data
    assert data["tooth_root_maximum"].sizes["tooth"] == 108
    assert np.isfinite(data["tooth_root_maximum"].values[0]).sum(axis=-1).tolist() == [27, 40]


def assert_kept_is_the_worst_of_all(static, result, *, reverse):
    """The periods that are kept give the same as the whole record."""
    cycle = static.cycle
    whole = root_stress_cycle(static.planetary_set, result.influences, cycle, reverse=reverse)
    each = len(cycle.position) // cycle.periods
    for root, part, first in zip(whole, result.roots, result.first_period, strict=True):
        assert part.stress.size < 0.5 * root.stress.size
        # teeth that no error reaches are equally loaded: the worst of the record need not be the only one
        position = (first * each + part.worst[1]) % len(cycle.position)
        a = root.history((position // each - part.worst[0]) % cycle.periods)
        b = part.history()
        assert a.path == pytest.approx(b.path)
        assert a.stress == pytest.approx(b.stress, rel=1e-9, abs=1e-3)
        assert root.tension[part.worst[0], position] == pytest.approx(root.tension.max(), rel=1e-12)


def test_long_records_keep_the_history_of_the_worst_tooth(pitch_error):
    _, static, result = pitch_error
    assert_kept_is_the_worst_of_all(static, result, reverse=False)


@pytest.mark.slow
def test_long_records_of_negative_torque_keep_it_too(monkeypatch):
    _, static, result = with_pitch_error("-8 um", monkeypatch, **{"operation.torque": "-100 N m"})
    assert_kept_is_the_worst_of_all(static, result, reverse=True)
    # the other flank of a tooth that lags stands ahead
    assert result.ranges[0].tooth_maximum.argmax() == 5


@pytest.mark.parametrize("torque", ["100 N m", "-100 N m"])
def test_records_that_do_not_repeat_say_so(torque, monkeypatch):
    changes = {"static.longest_record": 5, "operation.torque": torque}
    _, static, result = with_pitch_error("8 um", monkeypatch, **changes)
    assert static.cycle.periods == 5 and not result.closes
    assert result.dataset().attrs["repeats"] == 0
    assert_fields_are_root_cycles_of_one_planet(static, result, reverse=torque.startswith("-"))


def assert_fields_are_root_cycles_of_one_planet(static, result, *, reverse):
    """With the whole record in one cycle: what a tooth has at most is what its roots have in the slots."""
    roots = root_stress_cycle(static.planetary_set, result.influences, static.cycle, reverse=reverse)
    for root, one in zip(roots, result.ranges, strict=True):
        assert one.history is None
        slot, position = one.worst
        assert root.tension[slot + 1, position] == pytest.approx(root.tension.max(), rel=1e-9)
        assert one.maximum <= root.tension.max() * (1 + 1e-9)
        # most teeth never come into mesh while so few periods pass
        assert 5 <= np.count_nonzero(one.tooth_maximum > 0.3 * root.tension.max()) <= 8


def test_no_torque_gives_zeros_without_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, _, result = solved(**{"operation.torque": "0 N m"})
        data = result.dataset()
    for name in ("root_tension", "root_worst", "root_range_maximum", "contact_pressure", "load_cycles"):
        assert not data[name].values.any(), name
    assert not result.nominal.root.any() and not result.nominal.contact.any()
    assert not result.spectrum.time.any()


def test_one_planet():
    _, _, result = solved(**{"set.planets": 1})
    assert result.spectrum.cycles.tolist() == [[1, 1], [1, 1]]
    assert len(result.ranges) == 4 and result.ranges[1].history is not None
    # one planet carries the whole torque
    assert result.nominal.root[0, 0] == pytest.approx(nominal_stresses(result.planetary_set, 100.0, STEEL).root[0, 0])


def test_nominal_stresses_scale_as_the_standard_says(reference):
    """sigma_F0 with the force, sigma_H0 with its root; a set of three shares the torque in three."""
    gears, nominal = reference[1].planetary_set, reference[2].nominal
    twice = nominal_stresses(gears, 200.0, STEEL)
    assert twice.root == pytest.approx(2.0 * nominal.root, rel=1e-12)
    assert twice.contact == pytest.approx(math.sqrt(2.0) * nominal.contact, rel=1e-12)
    # Hertz at the pitch point with Z_eps: rho_1 rho_2/(rho_2 + rho_1) of sun and planet, F_b/b
    angle, width = gears.working_pressure_angle_sun_planet, gears.sun.face_width
    rho = [g.base_radius * math.tan(angle) for g in (gears.sun, gears.planet)]
    force = 100.0 / (3 * gears.sun.base_radius)
    modulus = 206e9 / (2.0 * (1.0 - 0.3**2))
    hertz = math.sqrt(force / width * modulus / math.pi * (1.0 / rho[0] + 1.0 / rho[1]))
    z_eps = math.sqrt((4.0 - gears.contact_ratio_sun_planet) / 3.0)
    assert nominal.contact[0] == pytest.approx(z_eps * hertz, rel=1e-9)
    assert nominal.message == ""


def test_outside_the_range_of_the_standard_there_is_no_number(reference, monkeypatch):
    """Contact ratios of 2.5 and above are not covered: no value, and a reason, but no failure."""
    gears = reference[1].planetary_set
    ratio = property(lambda pair: 2.6 if pair.gear_2.internal else 1.5)
    monkeypatch.setattr(type(gears.kinds[0]), "contact_ratio", ratio)
    found = nominal_stresses(gears, 100.0, STEEL)
    assert np.isfinite(found.contact[0]) and np.isfinite(found.root[0]).all()
    assert np.isnan(found.contact[1]) and np.isnan(found.root[1]).all()
    assert "planet-ring" in found.message and "2.6" in found.message


def test_an_elastic_ring_is_on_its_foundation(reference):
    """What carries the ring in the static solution carries it here; a very stiff foundation is a held rim."""
    case, static, result = reference
    elastic = with_value(case, "static.members", "elastic")
    hard = elastic
    for name in ("radial", "tangential"):
        hard = with_value(hard, f"ring.foundation_{name}", "1e18 N/m^3")
    held = result.influences.ring.influence
    soft, hard = (static_stages._influences(one, static).ring.influence for one in (elastic, hard))
    assert np.abs(hard - held).max() < 1e-3 * np.abs(held).max()
    assert np.abs(soft - held).max() > 0.05 * np.abs(held).max()


def test_a_linear_relief_begins_with_a_kink_that_is_told_where_the_pressure_is_high(reference):
    """Only where it is far above that of Hertz, and a parabolic relief has none."""
    case, _, result = reference
    relief = {"kind": "tip relief", "amount": "4 um", "start_diameter": "43 mm"}
    kinks = {
        shape: relief_kinks(with_value(case, "sun.modifications", [relief | {"shape": shape}]))
        for shape in ("linear", "parabolic")
    }
    assert kinks == {"linear": (True, False), "parabolic": (False, False)}
    data = replace(result, relief_kinks=kinks["linear"]).dataset()
    assert not list(stress_warnings(data))
    high = data.assign(largest_pressure=1.5 * data.largest_pressure)
    (finding,) = stress_warnings(high)
    assert finding.code == "W-KINK" and "contact pressure of sun-planet: a linear relief" in finding.text
    assert not list(stress_warnings(high.assign(relief_kink=0 * high.relief_kink)))


def test_the_largest_pressure_is_that_of_hertz_for_its_place_and_load(reference):
    """sigma_H0 without Z_eps times the roots of load and relative curvature; cells and windows 2 %."""
    _, static, result = reference
    data, pair = result.dataset(), static.planetary_set.kinds[0]
    path = float(data.contact_worst_path[0])
    assert pair.path[0] < path < pair.path[1]
    roll = [gear.base_radius * math.tan(pair.working_pressure_angle) for gear in pair.gears]
    there = 1.0 / (roll[0] + path) + 1.0 / (roll[1] - path)
    assert float(data.contact_worst_curvature[0]) == pytest.approx(there / (1 / roll[0] + 1 / roll[1]))
    modulus = 206e9 / (2.0 * (1.0 - 0.3**2))
    load = float(data.contact_worst_load[0]) / static.planetary_set.sun.face_width
    hertz = math.sqrt(load * modulus / math.pi * there)
    assert float(data.largest_pressure[0]) == pytest.approx(hertz, rel=0.02)


def test_a_negative_torque_presses_at_the_same_places(reference, reversed_torque):
    one, other = (result.dataset() for *_, result in (reference, reversed_torque))
    for name in ("contact_worst_path", "contact_worst_curvature", "contact_worst_load"):
        assert other[name].values[0] == pytest.approx(one[name].values[0], rel=1e-6), name


def test_why_stresses_differ_from_the_nominal_ones_is_told_beyond_30_percent(reference):
    data = reference[2].dataset()
    told = [note for note in describe_stress(data).notes if "FE/ISO =" in note]
    beside = {row[0]: row[3] for row in describe_stress(data).rows}
    named = {name for name, ratio in beside.items() if not 1 / 1.3 < float(ratio) < 1.3}
    assert {note.split(", FE/ISO")[0] for note in told} == named
    ratio = float(data.largest_pressure[:3].max() / data.iso_contact_stress[0])
    high = data.assign(largest_pressure=1.6 / ratio * data.largest_pressure)
    (note,) = (note for note in describe_stress(high).notes if note.startswith("contact sun-planet"))
    assert "FE/ISO = 1.60" in note
    # the factors are the ratio
    factors = [float(part.split()[0].rstrip(":")) for part in note.split(" x ")[1:]]
    assert math.prod(factors) == pytest.approx(1.6, rel=0.02)
    # of a linear relief the factor beside Hertz is named
    assert "by the kink" in _reason(high.assign(relief_kink=0 * high.relief_kink + 1))
    assert "by the tip corner" in _reason(high.assign(contact_worst_margin=0 * high.contact_worst_margin - 1e-5))
    low = data.assign(root_worst=0.5 * data.root_worst)
    assert any(note.startswith("root sun, FE/ISO = 0.") for note in describe_stress(low).notes)


def _reason(data):
    """Why the contact of sun and planet has another pressure than the nominal one."""
    return next(note for note in describe_stress(data).notes if note.startswith("contact sun-planet, FE"))


def test_a_corner_of_the_root_is_told_with_the_entry_that_rounds_it(reference):
    data = reference[2].dataset()
    corner = data.assign(root_notch_radius=data.root_notch_radius.copy())
    corner.root_notch_radius[3:, 1] = 1e-6
    (finding,) = stress_warnings(corner)
    assert finding.code == "W-KINK" and finding.key == "ring.rack.root_radius"
    # the figure is marked where it stands, and the one whose fillet a tip runs into
    fillet = Finding(
        "W-FILLET", "sun.tip_diameter", "a tip runs into a root fillet", severity="doubt", concerns="planet"
    )
    block = describe_stress(corner, [finding, fillet])
    marked = {row[0]: row[1] for row in block.rows if unmarked(row[1]) != row[1]}
    assert set(marked) == {"root ring", "root planet, sun side"}
    assert [note for note in block.notes if "W-KINK, doubt" in note or "W-FILLET, doubt" in note]
    assert all(unmarked(row[1]) == row[1] for row in describe_stress(data).rows)
    end = data.assign(root_worst_arc=data.root_worst_arc.copy())
    end.root_worst_arc[0, 0] = 0.0
    (finding,) = stress_warnings(end)
    assert finding.code == "W-KINK" and "end of the flank" in finding.text and "sun" in finding.text


# W-POSITIONS of helical teeth, whose record has no positions between the equidistant ones.


def record(count, *, overlap=1.2, **attrs):
    """A transmission error with a peak of straight lines at 0.37 of the period, and a constant stiffness."""
    position = np.arange(count) / count
    error = np.maximum(1.0 - np.abs(position - 0.37) / 0.1, 0.0) * 1e-6 + 1e-5
    curves = {"ste": error, "mesh_stiffness": np.full(count, 5e8)}
    variables = {name: (("mesh", "position"), curve[None]) for name, curve in curves.items()}
    fixed = {"overlap_ratio": overlap, "mesh_periods": 1}
    return xr.Dataset(variables, coords={"position": position}, attrs={**fixed, **attrs})


@pytest.mark.parametrize("count", [8, 16, 32, 64, 128, 256])
def test_the_doubt_of_few_positions_covers_what_they_miss(count):
    data = record(count)
    missed = 1.0 - np.ptp(data.ste.values) / 1e-6
    # the lines from both sides meet at the peak
    if count >= 32:
        assert _peak_doubt(data) == pytest.approx(missed / (1.0 - missed), abs=1e-9)
    assert _peak_doubt(data) >= 0.5 * missed


def test_spur_teeth_have_the_doubt_of_their_search_for_peaks():
    assert _peak_doubt(record(16, overlap=0.0, peak_doubt=0.004)) == 0.004
    assert _peak_doubt(record(16, overlap=0.0)) == 0.0


@pytest.mark.parametrize("count", (16, 24, 64))
def test_a_record_without_a_search_tells_what_it_may_miss(count):
    changes = {"static.flank_elements": 4, "static.stresses": False}
    case = with_values(read_case(FILE.with_name("spur_pair.toml")), changes)
    searched = solve_static(case).dataset()
    data = solve_static(with_values(case, {"static.peaks": False, "static.positions": count})).dataset()
    assert "between" not in data.dims
    missed = 1.0 - data.ste_peak_to_peak.values / searched.ste_peak_to_peak.values
    assert (missed > -1e-9).all() and data.attrs["peak_doubt"] > 0.5 * missed.max()


# Tables of phasing and of neighbouring teeth for the terminal and the report.


CASES = Path(__file__).resolve().parents[2] / "cases"


def tables(case):
    blocks = {block.title: block for block in describe_set(case)}
    return blocks["Mesh phasing"], blocks["Neighbouring tooth numbers"]


def test_reference_set_is_in_phase():
    harmonics, neighbours = tables(read_case(CASES / "planetary_27_40_108.toml"))
    assert [row[:3] for row in harmonics.rows] == [(str(h), "in-phase", "0") for h in range(1, 7)]
    assert {row[3:] for row in harmonics.rows} == {("100.0 %", "cancelled", "rotational")}
    assert "planet and ring 4" in harmonics.notes[-1]
    teeth = [row[0] for row in neighbours.rows]
    assert teeth[:3] == ["27/41/108", "28/41/110", "26/40/106"] and "27/40/108" not in teeth
    assert neighbours.rows[1][4] == "sequential, sequential, in, sequential"


@pytest.mark.parametrize("planets", [1, 2])
def test_few_planets(planets):
    case = read_case(CASES / "planetary_27_40_108.toml")
    case = with_value(case, "set.planets", planets)
    if planets == 2:
        case = with_value(case, "set.planet_angles", ["0 deg", "181.333333333 deg"])
    harmonics, neighbours = tables(case)
    assert len(harmonics.rows) == 6 and neighbours.rows
    assert harmonics.rows[0][1] == ("in-phase" if planets == 1 else "unequally phased")
    assert harmonics.rows[0][5] == "rotational-translational"


def test_lead_of_the_ring_meshes_is_that_of_the_phases():
    blocks = {block.title: block for block in describe_set(read_case(CASES / "planetary_27_40_108.toml"))}
    meshes, harmonics = blocks["Meshes"], blocks["Mesh phasing"]
    phase = dict((row[0], row[1:]) for row in meshes.rows)["mesh phases [periods]"][1].split(", ")[0]
    assert phase == "0.4636" and f"a planet's ring mesh is {phase} periods ahead" in harmonics.notes[1]


def test_published_gearbox():
    harmonics, _ = tables(read_case(CASES / "nrel_pgb.toml"))
    assert len(harmonics.rows) == 6
    assert {len(row) for row in harmonics.rows} == {len(harmonics.header)}


def test_neighbours_with_equal_spacing_come_first():
    _, neighbours = tables(read_case(CASES / "helical_30_20_70.toml"))
    assert [row[0] for row in neighbours.rows[:2]] == ["31/21/73", "29/19/67"]
    spacing = [row[3] for row in neighbours.rows]
    assert spacing[:2] == ["equal", "equal"] and "equal" not in spacing[2:] and len(spacing) == 8
