"""A case whose ring stands on supports or in a casing: both ways and one way, lines and sound on disk."""

import sys
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
from casing import Casing, write_casing

from femgear import second_process
from femgear.case.quantities import RPM
from femgear.errors import CaseError
from femgear.housing.orders import order_level
from femgear.housing.sensor import stored_lines
from femgear.housing.sound import pressure_level, stored_sound
from femgear.stages.static import solve_static
from femgear.trains.elastic import checks, stages
from femgear.trains.elastic.checks import case_warnings, fixed_diameters, housing_warnings
from femgear.trains.elastic.results import describe_housing, run_up_lines
from femgear.trains.elastic.runup import describe_runup
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes, solve_runup
from femgear.trains.reading import parse_case, read_case, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

CASE = Path(__file__).parents[3] / "cases" / "planetary_27_40_108.toml"
FEET = [
    {"angle": f"{angle} deg", "radial_stiffness": "4e8 N/m", "tangential_stiffness": "2e8 N/m"}
    for angle in (35, 145, 215, 325)
]
NOTHING = ("radial_stiffness", "tangential_stiffness")
SMALL = {
    "static.positions": 8,
    "static.flank_elements": 6,
    "static.stresses": False,
    "housing.published": [],
    "dynamics.mesh_harmonics": 2,
    "operation.speeds": ["400 rpm", "3100 rpm"],
    "runup.count": 0,
    "dynamics.tolerance": 1e-8,
}
WEAK = [{"angle": "10 deg", "radial_stiffness": "1 N/m", "tangential_stiffness": "1 N/m", "width": "9 mm"}]


def reference(**entries):
    return with_values(read_case(CASE), SMALL | entries)


@pytest.fixture(scope="module")
def before():
    """Static solution and modes of sets of one kind."""

    def solved(case):
        static = solve_static(case)
        return static, solve_modes(case, static)

    return solved(reference())


@pytest.fixture(autouse=True)
def uncompared(monkeypatch):
    """No comparison with more excitation, which takes most of the time: see test_excitation_limit.py."""

    def end(case, modes, heard, frequency, carrier, level=None):
        return modes.reach, 2 * modes.reach, 0 * frequency

    monkeypatch.setattr(stages, "excitation_end", end)


def heard(case, static, modes):
    return solve_housing(case, solve_dynamics(case, static, modes))


@pytest.mark.slow
def test_levels_are_as_exact_as_the_tolerance_says(before):
    """A hundredth and less of the forces fluctuates: what is left unsolved is judged by that."""
    speeds = {"operation.speeds": ["10 rpm", "400 rpm", "3100 rpm"], "housing.support": FEET}
    levels = [
        heard(reference(**speeds | {"dynamics.tolerance": tolerance}), *before).dataset()["level"].values
        for tolerance in (1e-6, 1e-10)
    ]
    np.testing.assert_allclose(*levels, rtol=1e-6)


@pytest.mark.parametrize("ratio", [1e-4, pytest.param(0.05, marks=pytest.mark.slow)])
def test_next_to_no_support_is_the_ring_on_its_foundation(before, ratio):
    present = reference(**{"dynamics.damping_ratio": ratio, "operation.speeds": ["400 rpm"]})
    case = with_values(present, {"housing.support": WEAK})
    modes = solve_modes(case, before[0])
    dynamics = solve_dynamics(case, before[0], modes)
    assert dynamics.fixed is not None
    data, other = (one.dataset() for one in (solve_housing(case, dynamics), heard(present, before[0], modes)))
    np.testing.assert_allclose(data["level"], data["one_way_level"], rtol=1e-6)
    np.testing.assert_allclose(data["level"], other["level"], rtol=0.01)
    for name in ("pressure_level", "power_level", "equivalent_power_level"):
        # nodal diameters to 14, and waves that run around in the frame of the carrier
        np.testing.assert_allclose(data[name], other[name], atol=0.3)
    mean = dynamics.response.force[:, [0, 3], 0]
    np.testing.assert_allclose(dynamics.fixed.two_way.force[..., 0], mean, rtol=1e-6)


def test_feet_change_the_level_and_the_file_holds_what_is_heard(before):
    case = reference(**{"housing.support": FEET, "dynamics.tolerance": 1e-9})
    data = heard(case, *before).dataset()
    assert abs(data["level"] / data["one_way_level"] - 1.0).max() > 0.2
    assert data["two_way_residual"].max() < 1e-10
    assert data["order_tail"].max() < 0.1
    assert (data["turn_multiplier"].values < 1.0).all() and "2 of 2 speeds looked at are stable" in " ".join(
        describe_housing(data).notes
    )
    grown = data.assign(turn_multiplier=data["turn_multiplier"] + 2.0)
    assert any("unstable at 400, 3100" in one.text for one in housing_warnings(grown))
    lines, pressure = stored_sound(data)
    assert lines.method == "supports" == stored_lines(data).method
    assert not (lines.order % 3).any()
    np.testing.assert_allclose(pressure_level(pressure, lines.frequency), data["pressure_level"], atol=1e-4)


def heard_forces(case, before):
    """Forces of one mesh of both kinds over a turn at the last speed, line by line."""
    found = solve_dynamics(case, *before).fixed.two_way
    turn = np.exp(2j * np.pi * np.outer(found.order, np.arange(5000)) / 5000)
    return np.real(found.force[-1] @ turn)


def test_run_up_is_that_of_the_housing(before):
    ends = {"runup.from": "2000 rpm", "runup.to": "3100 rpm", "runup.count": 4}
    case = reference(**{"housing.support": FEET, "housing.sensor_angle": "20 deg"} | ends)
    found = solve_runup(case, before[1])
    at = np.flatnonzero(np.isclose(found.input_speed / RPM, 3100.0))
    result = heard(case, *before)
    assert found.response.level[at] == pytest.approx(order_level(result.exact)[1:], rel=1e-9)
    order, lines = found.response.order, found.response.lines[at[0]]
    same = np.isin(result.exact.order, order)
    np.testing.assert_allclose(lines, result.exact.acceleration[1, same], atol=1e-6 * np.abs(lines).max())
    forces = heard_forces(case, before)
    assert found.response.force_peak[at[0]] == pytest.approx(forces.max(axis=1), rel=1e-3)
    assert found.response.lowest_force[at[0]] == pytest.approx(forces.min(), rel=1e-3)
    data = found.dataset()
    assert "in the housing that stands still" in " ".join(describe_runup(data).notes)
    lines, pressure = run_up_lines(data, result.dataset().attrs)
    assert (lines.method, pressure) == ("supports", None)
    assert not [one for one in case_warnings(case) if one.code == "W-SUPPORT"]


@pytest.mark.skipif(sys.platform != "linux", reason="one process elsewhere")
def test_run_up_in_two_processes_is_the_same(before, monkeypatch):
    ends = {"runup.from": "3000 rpm", "runup.to": "3100 rpm", "runup.count": 4}
    case = reference(**{"housing.support": FEET} | ends)
    monkeypatch.setattr(stages, "_PART", 1.0)  # every speed is a part
    alone, told = solve_runup(case, before[1]).response, []
    monkeypatch.setattr(stages, "_FEW_SPEEDS", 1)
    monkeypatch.setattr(second_process, "second_core", lambda: True)
    found = solve_runup(case, before[1], progress=lambda *one: told.append(one)).response
    for name in ("level", "force_peak", "lowest_force", "order", "lines"):
        assert np.array_equal(getattr(found, name), getattr(alone, name)), name
    in_housing = [done for _, done, _ in told[1:]]  # the first one is the foundation's
    assert in_housing == sorted(in_housing)


SENSORS = [
    {"name": "top", "angle": "90 deg"},
    {"name": "tangential", "angle": "90 deg", "direction": "tangential"},
    {"name": "across", "angle": "90 deg", "direction": "30 deg"},
    {"name": "where the level is", "angle": "20 deg"},
    {"name": "foot", "angle": "35 deg", "direction": "tangential"},
]


@pytest.mark.parametrize("held", [{}, {"housing.support": FEET}])
def test_named_sensors(before, held):
    case = reference(**{"housing.sensor": SENSORS, "housing.sensor_angle": "20 deg", **held})
    result = heard(case, *before)
    (names, moved), data = result.outputs["sensor"], result.dataset()
    assert names == tuple(one["name"] for one in SENSORS) == tuple(data["sensor"].values)
    size = np.abs(moved).max()
    turned = np.sqrt(3) / 2 * moved[:, 0] + moved[:, 1] / 2
    np.testing.assert_allclose(moved[:, 2], turned, rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(moved[:, 3], result.exact.displacement, rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(data["sensor_level"][:, 3], data["level"], rtol=1e-6)
    if held:
        names, force = result.outputs["force"]
        assert names[:2] == ("support 1 radial", "support 1 tangential") and len(names) == 8
        np.testing.assert_allclose(force[:, 1], 2e8 * moved[:, 4], rtol=0, atol=1e-9 * np.abs(force).max())


@pytest.mark.parametrize("held", [{}, {"housing.support": FEET}])
def test_a_wide_sensor_feels_the_mean_of_points_over_its_width(before, held):
    place, share = np.polynomial.legendre.leggauss(8)
    width = 0.03
    places = 35.0 + np.degrees(0.5 * width / reference().ring.outer_radius) * place
    points = [{"name": f"point {i}", "angle": f"{x:.15g} deg", "direction": "30 deg"} for i, x in enumerate(places)]
    wide = {"name": "wide", "angle": "35 deg", "direction": "30 deg", "width": f"{width} m"}
    case = reference(**{"housing.sensor": [wide, *points], **held})
    moved = heard(case, *before).outputs["sensor"][1]
    mean = np.einsum("spk,p->sk", moved[:, 1:], 0.5 * share)
    np.testing.assert_allclose(moved[:, 0], mean, rtol=0, atol=1e-9 * np.abs(mean).max())
    middle = moved[:, 1:][:, 3:5].mean(axis=1)
    assert np.abs(mean - middle).max() > 1e-3 * np.abs(mean).max()


@pytest.mark.slow
def test_sensors_of_both_routes(before):
    """Next to no support at low speed: radial and tangential lines by two ways."""
    entries = {"dynamics.damping_ratio": 1e-4, "operation.speeds": ["400 rpm"], "housing.sensor": SENSORS}
    case = reference(**entries)
    modes = solve_modes(case, before[0])
    both = [heard(one, before[0], modes) for one in (with_values(case, {"housing.support": WEAK}), case)]
    orders = np.intersect1d(both[0].exact.order, both[1].exact.order)
    ours, theirs = (one.outputs["sensor"][1][..., np.isin(one.exact.order, orders)] for one in both)
    for i in range(len(SENSORS)):
        np.testing.assert_allclose(ours[:, i], theirs[:, i], rtol=0, atol=0.01 * np.abs(theirs[:, i]).max())


@pytest.mark.slow
def test_planets_that_differ_make_all_orders():
    pin = {"planet": 1, "tangential": "3 um"}
    case = reference(**{"housing.support": FEET, "set.pin_errors": [pin], "housing.nodal_diameters": 6})
    case = with_values(case, {"dynamics.mesh_harmonics": 1, "dynamics.response_harmonics": 2})
    static = solve_static(case)
    lines = heard(case, static, solve_modes(case, static)).exact
    size = np.abs(lines.acceleration[1])
    assert size[lines.order % 3 != 0].max() > 1e-3 * size.max()


WAYS = np.array([np.sin(np.radians(20.0)), -np.cos(np.radians(20.0))])
TINY = Casing(size=0.02, points=24, modes=8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("casing")
    write_casing(TINY, path)
    return path


def in_casing(folder, structure, **entries):
    """The reference case beside the files of its casing."""
    copy(CASE, folder / "case.toml")
    fixed = {"housing.nodal_diameters": 6, "housing.structure": structure}
    return with_values(read_case(folder / "case.toml"), SMALL | fixed | entries)


def checksum_of(case) -> str:
    return case.housing.structure.sha256


@pytest.mark.slow
def test_supports_and_their_structure_in_a_file_are_one(before, tmp_path, monkeypatch):
    """The ring of a file is loaded where flanks touch, that of the case at the middle of its teeth.

    Without damping: the ring of the case and the gears damp each other, a casing has damping of its own. The
    ring has the nodal diameters of the file alone.
    """
    monkeypatch.setattr(checks, "MAX_DIAMETER", 14)
    undamped = {"dynamics.damping_ratio": 0.0}
    case = reference(**{"housing.support": FEET, "housing.sensor_angle": "20 deg"} | undamped)
    before = before[0], solve_modes(case, before[0])
    dynamics = solve_dynamics(case, *before)
    assert dynamics.fixed is not None
    one, n_max = dynamics.fixed.structure, fixed_diameters(case)
    angle = 2 * np.pi * np.arange(60) / 60
    wave = np.exp(1j * np.outer(angle + before[1].ring.load_angle, np.arange(-n_max, n_max + 1)))
    top, count = before[1].max_diameter, 4 * (before[1].max_diameter + 1)
    one = one.combined(np.eye(one.sensor_shape.shape[1])[:, :count])
    around = np.exp(1j * np.outer(2 * np.pi * np.arange(count) / count, np.arange(-top, top + 1))) / count
    at = np.real(around.conj() @ np.exp(1j * np.arange(-top, top + 1) * np.radians(20.0)))
    arrays = {
        "natural_frequency": one.natural_frequency,
        "damping_ratio": one.damping_ratio,
        "ring_angle": angle,
        "ring_shape": (one.ring_shape @ wave.T).real[..., None] * WAYS,
        "sensor_shape": (one.sensor_shape @ at)[:, None],
        "ring_compliance": (wave @ one.residual @ wave.conj().T).real,
        "sensor_compliance": (at @ one.sensor_residual @ wave.conj().T).real[None],
    }
    np.savez(tmp_path / "ring.npz", **arrays)
    held = in_casing(tmp_path, {"file": "ring.npz"}, **{"housing.nodal_diameters": n_max} | undamped)
    ours, theirs = solve_housing(case, dynamics), heard(held, *before)
    lines, size = theirs.exact.acceleration, np.abs(ours.exact.acceleration).max()
    np.testing.assert_allclose(lines, ours.exact.acceleration, rtol=0, atol=1e-9 * size)
    for name, values in ours.supported.items():
        if not name.startswith("two_way"):  # how the equations are solved is not a property of the set
            np.testing.assert_allclose(theirs.supported[name], values, rtol=1e-6, atol=1e-12)
    data = theirs.dataset()
    assert "pressure_level" not in data and list(data["sensor"].values) == ["sensor 1"]
    assert "missing_compliance" not in data.attrs
    with pytest.raises(CaseError, match="sensor_area"):
        stored_sound(data)
    assert "no sensor_area" in describe_housing(data).notes[-1]
    # all of the surface: its equivalent radiated power is that of the waves of the ring
    out = one.sensor_residual @ wave.conj().T
    arrays["sensor_shape"] = np.hstack([arrays["sensor_shape"], one.sensor_shape])
    arrays["sensor_compliance"] = np.vstack([arrays["sensor_compliance"], out.real])
    surface = 2 * np.pi * ours.cylinder.radius * ours.cylinder.length
    arrays["sensor_area"] = np.append(0.0, np.full(count, surface / count))
    np.savez(tmp_path / "ring.npz", **arrays)
    heard_all = heard(
        in_casing(tmp_path, {"file": "ring.npz"}, **{"housing.nodal_diameters": n_max} | undamped), *before
    )
    data, ring = heard_all.dataset(), ours.dataset()
    np.testing.assert_allclose(data["equivalent_power_level"], ring["equivalent_power_level"], atol=1e-6)
    assert "power_level" not in data and "from above" in data["equivalent_power_level"].long_name
    lines, pressure = stored_sound(data)
    assert heard_all.sound is not None
    # a free field at 1 m
    power = np.abs(pressure) ** 2 * 4 * np.pi / (2 * 1.204 * 343.0)
    np.testing.assert_allclose(power, heard_all.sound[2][:, : len(lines.order)], rtol=1e-5)
    assert "from above" in describe_housing(data).notes[-1]


@pytest.mark.parametrize(
    ("area", "words"),
    [([1.0], "areas"), ([-1.0, 2.0], "areas"), ([0.0, 0.0], "areas")],
)
def test_refused_areas(before, folder, area, words):
    with np.load(folder / "casing.npz") as arrays:
        np.savez(folder / "wrong.npz", **arrays, sensor_area=area)
    with pytest.raises(CaseError, match=words) as error:
        solve_modes(in_casing(folder, {"file": "wrong.npz"}), before[0])
    assert (error.value.code, error.value.key) == ("E-SHAPE", "housing.structure.file")


@pytest.mark.slow
def test_both_ways_are_told_beside_one_way(before):
    case = reference(**{"housing.support": FEET, "operation.speeds": ["3100 rpm", "400 rpm"]})
    result = heard(case, *before)
    data = result.dataset()
    level, one_way = data["level"].values, data["one_way_level"].values
    np.testing.assert_allclose(data["one_way_difference"], 20 * np.log10(level / one_way))
    table = describe_housing(data)
    at = table.header.index("one way [m/s^2]")
    told = zip(one_way, data["one_way_difference"].values)
    assert [row[at] for row in table.rows] == [f"{one:.4g} ({two:+.1f} dB)" for one, two in told]
    far = np.flatnonzero(abs(data["one_way_difference"].values) > 3.0)
    assert len(far) == 1
    (finding,) = (one for one in housing_warnings(data) if one.code == "W-ONE-WAY")
    assert f"{data['speed'].values[far[0]]:g} rpm" in finding.text
    near = housing_warnings(data.isel(speed=[1 - far[0]]))
    assert "W-ONE-WAY" not in [one.code for one in near]


def test_one_casing_in_three_kinds_of_files(before, folder):
    nodes = {"npz": "nodes_held.csv", "pch": "nodes.csv", "uff": "nodes_held.csv"}
    held = {kind: {"file": f"casing.{kind}", "nodes": one, "damping_ratio": 0.02} for kind, one in nodes.items()}
    found = {kind: heard(in_casing(folder, table), *before) for kind, table in held.items()}
    names, lines = found["npz"].outputs["sensor"]
    assert names == ("top", "flange") and list(found) == ["npz", "pch", "uff"]
    for one in found.values():
        assert one.outputs["sensor"][0] == names
        np.testing.assert_allclose(one.outputs["sensor"][1], lines, rtol=0, atol=1e-6 * np.abs(lines).max())
    forces, ground = found["pch"].outputs["force"]
    assert forces[0] == "foot left x" and list(found["uff"].outputs) == ["sensor"]
    data = found["pch"].dataset()
    stored = data["force_lines_real"] + 1j * data["force_lines_imag"]
    assert stored.dims == ("speed", "force", "order") and data["force_lines_real"].units == "N"
    np.testing.assert_allclose(stored, ground, rtol=1e-6)
    # mean force on the ground: that of the planets, which changes with the place where they mesh
    fixed = solve_dynamics(in_casing(folder, held["pch"]), *before).fixed
    assert fixed is not None
    two_way = fixed.two_way
    once = np.conj(two_way.force[:, 1, list(two_way.order).index(1)]) / 2
    x, y, z = np.real(ground[..., 0]).reshape(-1, 2, 3).sum(axis=1).T
    scale = np.abs(ground[..., 0]).max()
    np.testing.assert_allclose(x + 1j * y, 3 * once * (WAYS[0] + 1j * WAYS[1]), atol=1e-5 * scale)
    assert np.abs(once).max() > 0.01 * scale and np.abs(z).max() < 1e-5 * scale


def test_modes_that_lack_compliance_are_said(before, folder):
    """Modes of the example up to 900 Hz, without residual; matrices lack nothing, however few are kept."""
    with np.load(folder / "casing.npz") as arrays:
        few = {name: one[:3] if name.endswith(("frequency", "shape")) else one for name, one in arrays.items()}
    np.savez(folder / "few.npz", **few)
    for table, codes in (
        ({"file": "few.npz"}, ["W-RESIDUAL"]),
        ({"file": "casing.op4", "nodes": "nodes.csv", "damping_ratio": 0.02, "max_frequency": "900 Hz"}, []),
    ):
        data = heard(in_casing(folder, table, **{"operation.speeds": ["400 rpm"]}), *before).dataset()
        found = [one for one in housing_warnings(data) if one.code != "W-ONE-WAY"]
        assert [one.code for one in found] == codes
        assert not found or "without residual" in found[0].text
    tonnes = {**few, "ring_shape": 1e-2 * few["ring_shape"]}
    np.savez(folder / "tonnes.npz", **tonnes)
    with pytest.raises(CaseError, match="expected") as error:
        heard(in_casing(folder, {"file": "tonnes.npz"}), *before)
    assert (error.value.code, error.value.key) == ("E-UNITS", "housing.structure.units")


def test_results_belong_to_what_the_files_hold(before, folder):
    table = {"file": "casing.npz", "nodes": "nodes_held.csv"}
    case = in_casing(folder, table)
    digest = checksum_of(case)
    again = parse_case(case.source, name=str(folder / "elsewhere.toml"))
    assert again == case and len(digest) == 64
    dynamics = solve_dynamics(case, *before)
    changed = folder / "changed.npz"
    with np.load(folder / "casing.npz") as arrays:
        np.savez(changed, **{**arrays, "sensor_shape": 2 * arrays["sensor_shape"]})
    other = in_casing(folder, table | {"file": "changed.npz"})
    assert checksum_of(other) != digest
    for late, key in ((other, "housing.structure.sha256"), (None, "housing.structure.file")):
        with pytest.raises(CaseError) as error:
            if late:
                solve_housing(late, dynamics)
            else:
                changed.write_bytes(b"")
                solve_modes(other, before[0])
        assert (error.value.code, error.value.key) == ("E-OTHER-CASE", key)


@pytest.mark.parametrize(
    ("table", "entries", "code", "key"),
    [
        ({"file": "none.npz"}, {}, "E-FILE", "housing.structure.file"),
        ({"file": "../casing.npz"}, {}, "E-FILE", "housing.structure.file"),
        ({"file": "casing.npz", "nodes": "none.csv"}, {}, "E-FILE", "housing.structure.nodes"),
        ({"nodes": "nodes.csv"}, {}, "E-KEY-MISSING", "housing.structure.file"),
        ({"file": "casing.npz"}, {"housing.support": FEET}, "E-CHOICE", "housing"),
        ({"file": "casing.npz"}, {"housing.sensor": SENSORS}, "E-CHOICE", "housing"),
        ({"file": "casing.npz"}, {"housing.form": "linear"}, "E-CHOICE", "housing.form"),
        ({"file": "casing.npz"}, {"housing.nodal_diameters": 7}, "E-COUNT", "housing.structure.file"),
        ({"file": "casing.npz", "nodes": "nodes.csv"}, {}, "E-SHAPE", "housing.structure.nodes"),
        ({"file": "casing.pch"}, {}, "E-KEY-MISSING", "housing.structure.nodes"),
        ({"file": "casing.pch", "nodes": "nodes.csv"}, {}, "E-KEY-MISSING", "housing.structure.damping_ratio"),
        ({"file": "casing.npz", "units": "inch"}, {}, "E-CHOICE", "housing.structure.units"),
    ],
)
def test_refused_casings(before, folder, table, entries, code, key):
    with pytest.raises(CaseError) as error:
        solve_modes(in_casing(folder, table, **entries), before[0])
    assert (error.value.code, error.value.key) == (code, key)


def test_supports_side_by_side_are_allowed(before):
    touching = [{**FEET[0], "angle": f"{angle} deg", "width": "17.4 mm"} for angle in (355, 5)]
    case = reference(**{"housing.support": touching, "operation.speeds": ["400 rpm"], "dynamics.tolerance": 1e-9})
    assert heard(case, *before).supported["two_way_residual"].max() < 1e-10


@pytest.mark.parametrize(
    ("entries", "code"),
    [
        ({"housing.support": [FEET[0], {**FEET[1], "angle": "-325 deg"}]}, "E-DUPLICATE"),
        ({"housing.support": FEET, "housing.form": "linear"}, "E-CHOICE"),
        ({"housing.support": FEET, "housing.nodal_diameters": 18}, "E-RANGE"),
        ({"housing.support": [{**FEET[0], "width": "1 m"}]}, "E-SUPPORT"),
        ({"housing.support": [FEET[0], {"angle": "1 deg"} | dict.fromkeys(NOTHING, "0 N/m")]}, "E-SUPPORT"),
        ({"housing.support": [{**one, "width": "200 mm"} for one in FEET]}, "E-SUPPORT"),
        (
            {"housing.support": [{**FEET[0], "angle": a, "width": "9 mm"} for a in ("359 deg", "2 deg")]},
            "E-SUPPORT",
        ),
        ({"housing.sensor": SENSORS + SENSORS[:1]}, "E-DUPLICATE"),
        ({"housing.sensor": [{**SENSORS[0], "direction": "axial"}]}, "E-UNIT"),
    ],
)
def test_refused(before, entries, code):
    with pytest.raises(CaseError) as error:
        case = reference(**entries)
        static, modes = before
        solve_modes(case, static)
        solve_dynamics(case, static, modes)
    assert error.value.code == code
