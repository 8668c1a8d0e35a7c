"""Root stresses as dataset and as figures."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg

from femgear.case.gear_set import materials_of
from femgear.contact.bodies import make_sectors
from femgear.contact.root_stress import RootCycle
from femgear.contact.tooth_loads import deformed_set
from femgear.gears.deviations import no_deviations
from femgear.gears.gear import Gear
from femgear.gears.modifications import FlankForm, MeasuredProfile, ProfileSlope, TipRelief
from femgear.gears.planetary import close_set, equal_planet_angles, mirrored_set
from femgear.report.style import png_bytes
from femgear.stages import static_figures as static_figures
from femgear.stages.protocol import Drawn
from femgear.stages.static import solve_static
from femgear.stages.static_figures import (
    _left_flanks_loaded,
    _reflected,
    active_rolls,
    draw_contact_pressure,
    draw_load_spectrum,
    has_pitches,
    has_profiles,
    pitch_chart,
    planet_bending,
    profile_chart,
    root_stress_history,
    root_stress_profile,
)
from femgear.stages.static_results import STRESS_VARIABLES, root_values
from femgear.storage.results import dataset, declared
from femgear.trains.reading import read_case, with_values

MESHES = ["sun-planet 1", "sun-planet 2", "planet 1-ring", "planet 2-ring"]
P = 8


def cycle(mesh, gear, *, periods=1):
    """Smooth stresses of four slots; planets have more root points than sun and ring."""
    kind = ("sun", "planet", "planet", "ring")[2 * (mesh >= 2) + gear]
    points = 14 if kind == "planet" else 10
    positions = P * periods
    turn = np.arange(positions) % P / P
    path = np.arange(-2, 2)[:, None] + turn
    arc = np.linspace(0, 1e-3, points)
    bump = np.sin(np.pi * np.arange(points) / (points - 1)) + 0.05
    load = np.exp(-((path - 0.3) ** 2)) * (1000 + mesh)
    # one period of a long record is worse than the others
    load = load * (1 + 0.5 * (np.arange(positions) // P == periods - 1))
    stress = 1e5 * load[..., None, None] * np.array([1.0, -1.2])[:, None] * bump
    slope = np.linspace(0.1, 1.5, points)
    over_width = stress[:, :, 0].max(axis=-1)[..., None]
    return RootCycle(kind, mesh, gear, path, load, stress, arc, slope, periods, over_width)


def cycles(**options):
    return tuple(cycle(mesh, gear, **options) for mesh in range(4) for gear in (0, 1))


def root_stress_dataset(roots, meshes):
    data = dataset(declared(STRESS_VARIABLES, root_values(roots)), {}, {})
    return data.assign_coords(mesh=meshes, gear=["first", "second"], root=["loaded", "back"])


@pytest.fixture(scope="module")
def stress():
    return root_stress_dataset(cycles(), MESHES)


def test_dataset_holds_the_extremes(stress):
    assert dict(stress.sizes) == {"mesh": 4, "gear": 2, "step": 4 * P, "root": 2, "point": 14}
    for variable in stress.data_vars.values():
        assert {"units", "long_name"} <= set(variable.attrs)
    for root in cycles():
        row = stress.isel(mesh=root.mesh, gear=root.gear)
        assert float(row.root_tension.max()) == root.stress.max()
        assert float(row.root_compression.min()) == root.stress.min()
        assert np.isfinite(row.root_arc.values).sum() == len(root.arc)
        assert np.nanmax(row.root_profile.sel(root="loaded").values) == root.stress.max()
        assert np.diff(row.root_path.values) == pytest.approx(1 / P)


def test_the_worst_tooth_of_a_long_record_is_followed():
    roots = cycles(periods=3)
    stress = root_stress_dataset(roots, MESHES)
    assert stress.sizes["step"] == 4 * P
    for root in roots:
        row = stress.isel(mesh=root.mesh, gear=root.gear)
        assert float(row.root_tension.max()) == root.stress.max()
        assert np.diff(row.root_path.values) == pytest.approx(1 / P)


def test_figures_are_drawn_with_units(stress):
    for figure in (root_stress_history(stress), root_stress_profile(stress)):
        assert png_bytes(figure).startswith(b"\x89PNG")
        assert len(figure.axes) == 4
        assert all("[MPa]" in ax.get_ylabel() for ax in figure.axes[::2])
        assert all("[" in ax.get_xlabel() for ax in figure.axes[2:])
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        legend = figure.legends[0].get_window_extent(canvas.renderer)
        assert all(not legend.overlaps(ax.get_tightbbox(canvas.renderer)) for ax in figure.axes)


def test_figures_show_the_numbers(stress):
    history = root_stress_history(stress)
    for ax, (mesh, gear) in zip(history.axes, ((1, 0), (1, 1), (3, 0), (3, 1)), strict=True):
        drawn = ax.lines[0].get_ydata().max()
        assert drawn == pytest.approx(1e-6 * float(stress.root_tension[mesh, gear].max()))
        assert f"{drawn:.3g}" in ax.get_title(loc="left")
    # the second planet carries more
    assert history.axes[1].get_title(loc="left").startswith("planet 2, sun side")
    profile = root_stress_profile(stress)
    assert [len(ax.lines[0].get_xdata()) for ax in profile.axes] == [14] * 4
    # the critical sections: 30 deg and, on the ring, 60 deg between slopes of 0.1 and 1.5 rad
    for ax, angle in zip(profile.axes, (30, 30, 30, 60), strict=True):
        place = ax.lines[-1].get_xdata()[0]
        assert place == pytest.approx((np.radians(angle) - 0.1) / 1.4, rel=1e-6)


def test_a_root_without_critical_section_has_no_mark(stress):
    flat = stress.assign(root_slope=0.0 * stress.root_slope + 0.2)
    assert all(len(ax.lines) == 3 for ax in root_stress_profile(flat).axes)


PAIRS, CELLS, BINS, PITCH = 3, 24, 10, 4.4e-3


@pytest.fixture(scope="module")
def whole(stress):
    """Root stresses with nominal values, semi-elliptic pressures, a spectrum and the turn of a planet."""
    path = PITCH * (np.arange(PAIRS)[:, None] - 1 + np.arange(P) / P)
    offset = np.linspace(-9e-5, 9e-5, CELLS)
    peak = np.where(np.abs(path) < 0.9 * PITCH, 8e8 + 1e11 * path, 0.0)
    shape = np.sqrt(np.maximum(1 - (offset / 6e-5) ** 2, 0.0))
    pressure = np.broadcast_to(peak[:, None] * shape[:, None], (4, PAIRS, CELLS, P))
    by_pair = ("mesh", "pair", "position")
    turn = np.linspace(-0.25, 0.75, 200, endpoint=False)
    bumps = np.exp(-((turn / 0.02) ** 2)) - 0.6 * np.exp(-(((turn - 0.49) / 0.02) ** 2))
    history = 1e8 * np.outer([1.0, 1.1, -0.9, -1.2], bumps)
    share = np.zeros((4, BINS))
    share[:, 4], share[:, 9] = 0.75, 0.25
    edges = np.linspace(0, 1000, BINS + 1)
    return stress.assign(
        iso_root_stress=(("mesh", "gear"), np.full((4, 2), 9.5e7)),
        iso_contact_stress=("mesh", [7e8, 7e8, 3e8, 3e8]),
        contact_pressure=(("mesh", "position"), pressure.max(axis=(1, 2))),
        pressure_distribution=(("mesh", "pair", "cell", "position"), pressure),
        pressure_offset=(("mesh", "cell"), np.tile(offset, (4, 1))),
        pressure_centre=(by_pair, np.zeros((4, PAIRS, P))),
        pressure_path=(by_pair, np.tile(path, (4, 1, 1))),
        load_bin_low=("load_bin", edges[:-1]),
        load_bin_high=("load_bin", edges[1:]),
        load_time_share=(("mesh", "load_bin"), share),
        load_cycle_share=(("mesh", "load_bin"), np.eye(BINS)[[9] * 4]),
        load_cycles=(("mesh", "gear"), [[2, 1], [2, 1], [1, 2], [1, 2]]),
        planet_root_stress=(("mesh", "turn"), history),
        turn=("turn", turn),
    )


def test_nominal_stress_is_drawn_where_it_is_known(whole, stress):
    for ax in root_stress_history(whole).axes:
        assert any(np.allclose(line.get_ydata(), 95.0) for line in ax.lines)
    assert all(len(ax.lines) == 3 for ax in root_stress_history(stress).axes)
    unknown = whole.assign(iso_root_stress=np.nan * whole.iso_root_stress)
    assert all(len(ax.lines) == 3 for ax in root_stress_history(unknown).axes)


def test_pressure_is_drawn_over_the_path_of_one_pair(whole):
    figure = draw_contact_pressure(whole)
    for ax, nominal in zip(figure.axes[:2], (700.0, 300.0), strict=True):
        path, pressure = ax.lines[0].get_data()
        assert (np.diff(path) > 0).all() and pressure[0] == pressure[-1] == 0.0
        assert pressure.max() == pytest.approx(1e-6 * float(whole.pressure_distribution.max()))
        assert ax.lines[1].get_ydata() == pytest.approx([nominal, nominal])
    for ax in figure.axes[2:4]:
        (image,) = ax.collections
        values = np.ma.asarray(image.get_array()).reshape(CELLS, -1)
        assert values.max() == pytest.approx(1e-6 * float(whole.pressure_distribution.max()))
        # cells without pressure are left blank, and the picture reaches as far as there is any
        assert values.mask[0].all() and 60 < ax.get_ylim()[1] < 70


def test_spectrum_and_bending_show_the_numbers(whole):
    left, right = draw_load_spectrum(whole).axes
    for ax in (left, right):
        time, cycles = (patch.get_data() for patch in ax.patches)
        assert time.values == pytest.approx(100 * whole.load_time_share.values[0])
        assert cycles.values.argmax() == 9 and cycles.edges[-1] == 1000
    assert "sun 2, planet 1" in left.get_title(loc="left")
    assert "planet 1, ring 2" in right.get_title(loc="left")
    (ax,) = planet_bending(whole).axes
    assert ax.get_title(loc="left") == "planet 2"  # the wider of the two ranges
    assert ax.lines[0].get_ydata() == pytest.approx(1e-6 * whole.planet_root_stress.values[1])
    assert ax.lines[1].get_ydata() == pytest.approx(1e-6 * whole.planet_root_stress.values[3])


@pytest.mark.slow
def test_new_figures_hide_nothing(whole):
    for figure in (draw_contact_pressure(whole), draw_load_spectrum(whole), planet_bending(whole)):
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        legend = figure.legends[0].get_window_extent(canvas.renderer)
        assert all(not legend.overlaps(ax.get_tightbbox(canvas.renderer)) for ax in figure.axes)
        assert all("[" in ax.get_ylabel() + ax.get_xlabel() for ax in figure.axes[-2:])


def test_the_planet_that_carries_is_shown_and_named(whole):
    """Planet 1 carries nothing, as when its pin stands back: figures of planet 2, not empty ones."""
    loaded = np.array([0.0, 1.0, 0.0, 1.0])
    spans = (
        "contact_pressure",
        "pressure_distribution",
        "load_time_share",
        "load_cycle_share",
        "load_cycles",
    )
    names = (*spans, "root_tension", "root_compression")
    case = whole.assign({name: whole[name] * xr.DataArray(loaded, dims="mesh") for name in names})
    figure = draw_contact_pressure(case)
    for ax, mesh in zip(figure.axes[:2], ("sun-planet 2", "planet 2-ring"), strict=True):
        assert ax.get_title(loc="left").startswith(mesh)
        assert ax.lines[0].get_ydata().max() == pytest.approx(1e-6 * float(whole.pressure_distribution.max()))
    for ax, mesh in zip(draw_load_spectrum(case).axes, ("sun-planet 2", "planet 2-ring"), strict=True):
        assert ax.get_title(loc="left").startswith(mesh)
        assert ax.patches[0].get_data().values.max() == 75.0
    for figure in (root_stress_history(case), root_stress_profile(case)):
        assert figure.axes[1].get_title(loc="left").startswith("planet 2")
    higher = xr.DataArray([1.0, 1.0, 1.0, 1.1], dims="mesh")
    more = whole.assign(contact_pressure=whole.contact_pressure * higher)
    assert draw_contact_pressure(more).axes[0].get_title(loc="left").startswith("sun-planet 2")
    # the first planet never reaches the highest load class
    often = whole.load_time_share.values.copy()
    often[[0, 2]] = np.eye(BINS)[4]
    shown = draw_load_spectrum(whole.assign(load_time_share=(("mesh", "load_bin"), often)))
    assert shown.axes[0].get_title(loc="left").startswith("sun-planet 2")


def test_a_set_without_any_load_shows_the_first_planet(whole):
    case = whole.assign({name: 0.0 * whole[name] for name in ("contact_pressure", "pressure_distribution")})
    assert draw_contact_pressure(case).axes[0].get_title(loc="left").startswith("sun-planet 1")


# Charts of deviations: the curves are the deviations with material positive, axes say their units.


ALPHA = math.radians(20.0)
UM = 1e-6


@pytest.fixture(scope="module")
def gears():
    return close_set(
        Gear(27, 1.5e-3, ALPHA, 0.0, 0.025, 9e-3),
        Gear(40, 1.5e-3, ALPHA, 0.0, 0.025, 18e-3),
        Gear(108, 1.5e-3, ALPHA, 0.0, 0.025, 0.1, internal=True),
        planet_angles=equal_planet_angles(3),
        centre_distance=51e-3,
        find=("sun", "ring"),
    )


@pytest.fixture(scope="module")
def deviations(gears):
    middle = 0.5 * (gears.sun.form_roll + gears.sun.tip_roll)
    d = no_deviations(gears)
    return replace(
        d,
        sun=FlankForm((TipRelief(12 * UM, middle, power=2.0),)),
        planet_ring_side=FlankForm((ProfileSlope(4 * UM),)),
        ring=FlankForm((MeasuredProfile((0.025, 0.030), (1 * UM, 5 * UM)),)),
        sun_pitch=3 * UM * np.sin(2 * np.pi * np.arange(27) / 27),
    )


def line(ax, name):
    return next(one for one in ax.get_lines() if one.get_label() == name)


def test_profiles_are_drawn_with_material_positive(gears, deviations):
    figure = profile_chart(deviations, gears)
    sun, _, ring_side, ring = figure.axes
    angle, height = line(sun, "profile").get_data()
    tip = math.degrees(gears.sun.tip_roll / gears.sun.base_radius)
    assert angle.max() == pytest.approx(tip, rel=1e-12)
    assert height[angle.argmax()] == pytest.approx(-12.0, rel=1e-12) and height[angle.argmin()] == 0.0
    angle, height = line(ring_side, "profile").get_data()
    assert [height[0], height[-1]] == pytest.approx([-2.0, 2.0], rel=1e-12)
    # a measured point is drawn where it was measured, and tip and root of the ring lie the other way round
    angle, height = line(ring, "profile").get_data()
    point = math.degrees(0.030 / gears.ring.base_radius)
    assert height[np.abs(angle - point).argmin()] == pytest.approx(-5.0, rel=1e-12)
    assert line(ring, "tip circle").get_xdata()[0] < line(ring, "form circle").get_xdata()[0]


def test_active_parts_lie_on_the_flanks_and_cover_the_path(gears):
    rolls = active_rolls(gears)
    flanks = (gears.sun, gears.planet, gears.planet, gears.ring)
    for (start, end), gear in zip(rolls, flanks, strict=True):
        low, high = sorted((gear.form_roll, gear.tip_roll))
        assert low < start + 1e-9 and start < end and end < high + 1e-9
    ratios = [(end - start) / gears.base_pitch for start, end in rolls]
    one, two = gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring
    assert ratios == pytest.approx([one, one, two, two], rel=1e-12)
    # on the line of action roll lengths of both flanks add up to the distance of the tangent points
    length = gears.centre_distance * math.sin(gears.working_pressure_angle_sun_planet)
    assert rolls[0][0] + rolls[1][1] == pytest.approx(length, rel=1e-12)
    length = gears.centre_distance * math.sin(gears.working_pressure_angle_planet_ring)
    assert rolls[3][0] - rolls[2][0] == pytest.approx(length, rel=1e-12)


def test_pitches_are_drawn_with_material_positive(gears, deviations):
    figure = pitch_chart(deviations, gears)
    tooth, height = line(figure.axes[0], "sun").get_data()
    assert height == pytest.approx(-3 * np.sin(2 * np.pi * tooth / 27), abs=1e-12)
    assert len(figure.axes[1].get_lines()) == 3


@pytest.mark.parametrize("chart", [profile_chart, pitch_chart])
def test_axes_say_their_units_and_nothing_is_drawn_twice(gears, deviations, chart):
    for d in (deviations, no_deviations(gears)):
        figure = chart(d, gears)
        FigureCanvasAgg(figure).draw()
        assert all("[" in ax.get_xlabel() for ax in figure.axes)
        assert all("[µm]" in ax.get_ylabel() for ax in figure.axes[::2])
        assert len(figure.legends) == 1
        texts = [text.get_text() for text in figure.legends[0].get_texts()]
        assert len(texts) == len(set(texts))
    assert png_bytes(chart(deviations, gears))[:4] == b"\x89PNG"


def test_charts_are_left_out_where_there_is_nothing_of_their_kind(gears, deviations, monkeypatch):
    ideal = no_deviations(gears)
    pins = replace(ideal, pin_errors=np.full((3, 2), 5 * UM))
    forms = replace(deviations, sun_pitch=np.zeros(27))
    pitches = replace(pins, ring_pitch=deviations.sun_pitch[0] + UM * np.arange(108))
    none = replace(ideal, sun=FlankForm((ProfileSlope(0.0),)))
    both = ["profile_deviations", "pitch_deviations"]
    for d, names in ((pins, []), (none, []), (forms, both[:1]), (pitches, both[1:]), (deviations, both)):
        monkeypatch.setattr(static_figures, "planetary_set", lambda _: gears)
        monkeypatch.setattr(static_figures, "set_deviations", lambda _, d=d: d)
        assert list(static_figures.FIGURES[""].draw(Drawn(None, {}))) == names
        assert [has_profiles(d, gears), has_pitches(d)] == [name in names for name in both]


# The deformed set of a negative torque is the state that static.nc holds, seen from behind.


SLICED = {"static.slices": 8, "sun.modifications": [{"kind": "lead slope", "amount": "12 um"}]}
HELICAL = {
    "set.helix_angle": "8 deg",
    "set.centre_distance": "51.5 mm",
    "sun.profile_shift": None,
    "ring.profile_shift": None,
    "static.slices": 25,  # forces of a record are means while one slice follows another
}
CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"


@pytest.mark.parametrize(
    ("members", "more"),
    [
        ("fixed", {}),
        pytest.param("elastic", {}, marks=pytest.mark.slow),
        pytest.param("fixed", SLICED, marks=pytest.mark.slow),
        pytest.param("fixed", {**SLICED, **HELICAL}, marks=pytest.mark.slow),
    ],
    ids=["fixed", "elastic", "slices", "helical"],
)
def test_errors_and_supports_of_the_case_are_in_the_deformed_set(members, more):
    changes = {
        "operation.torque": "-60 N m",
        "set.pin_errors": [{"planet": 2, "tangential": "5 um"}],
        "static.members": members,
        "static.positions": 8,
        "static.flank_elements": 6,
        **more,
    }
    case = with_values(read_case(CASE), changes)
    static = solve_static(case)
    gears, order, cycle = _left_flanks_loaded(static, case)
    assert order.tolist() == list(mirrored_set(static.planetary_set)[1])
    start = int(np.argmin(np.abs(static.cycle.position)))
    force = static.cycle.force[:, start]
    assert np.ptp(force[:3]) > 0.05 * force[:3].mean()
    seen = np.concatenate([force[order], force[3 + order]])
    # the cells of a walk fit the largest load of all its positions
    np.testing.assert_allclose(cycle.force[:, 0], seen, rtol=1e-3)
    name = "slice_load" if "static.slices" in more else "tooth_load"
    records = ((cycle, 0), (static.cycle, start))
    image, loads = (getattr(one, name)[..., at].max(axis=1) for one, at in records)
    seen = loads[[*order, *(3 + order)]]
    np.testing.assert_allclose(image, seen, rtol=0.0, atol=1e-3 * seen.max())
    assert gears.planet_angles == mirrored_set(static.planetary_set)[0].planet_angles


def test_bodies_of_a_negative_torque_stand_and_bend_as_those_of_the_set():
    """Every planet at its own pin, most bent where most is carried; teeth of the sun give way to the load."""
    changes = {
        "operation.torque": "-60 N m",
        "static.positions": 8,
        "static.flank_elements": 6,
        "set.pin_errors": [{"planet": 2, "tangential": "5 um"}],
    }
    case = with_values(read_case(CASE), changes)
    static = solve_static(case)
    gears, order, cycle = _left_flanks_loaded(static, case)
    sectors = make_sectors(gears, materials_of(case), flank_elements=4, refine=0.3)
    of_kind = {sector.gear.name: sector for sector in sectors.gears}
    image = deformed_set(gears, sectors, cycle)
    bodies = {body.name: body for body in (_reflected(one, of_kind[one.kind], order) for one in image)}
    names = [f"planet {n + 1}" for n in range(3)]
    pins = static.planetary_set.centre_distance * np.exp(1j * np.array(static.planetary_set.planet_angles))
    centres = np.array([complex(*bodies[name].centre) for name in names])
    np.testing.assert_allclose(centres, pins, atol=1e-12)
    force = static.cycle.force[:3, np.argmin(np.abs(static.cycle.position))]
    bent = [np.abs(bodies[name].displacement).max() for name in names]
    assert np.argsort(bent).tolist() == np.argsort(force).tolist()
    x, y = of_kind["sun"].grid.points.T
    u, v = np.moveaxis(bodies["sun"].displacement, -1, 0)
    assert np.mean((x * v - y * u) / np.hypot(x, y)) > 0.0
