"""Planets that are shafts of their own: as planetary stages, as springs by hand, in phase, refused where they miss."""

import math

import numpy as np
import pytest
from planet_gearboxes import (
    known_set,
    loaded,
    members,
    pair,
    planet,
    simple_set,
    springs_by_hand,
    stepped_set,
    uneven_planets,
)
from scipy.linalg import eigh

from femgear.errors import CaseError
from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet, equal_planet_angles
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.gearbox.planet_shafts import pair_phases, standing_planets
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.solid_bodies import gearbox_bodies
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.mark.parametrize("motions", ["space", "plane", "rotation"])
@pytest.mark.parametrize("fixed", ["ring", "carrier"])
def test_simple_planets_are_those_of_a_planetary_stage(motions, fixed):
    own, known = (
        solve_deflection(read_case(make(motions=motions, fixed=fixed, torque=-80.0)))
        for make in (simple_set, known_set)
    )
    np.testing.assert_allclose(own.mesh_force, known.mesh_force, rtol=1e-9)
    frequencies = [solve_gearbox_modes(found).modes.frequency for found in (own, known)]
    np.testing.assert_allclose(*frequencies, rtol=1e-9, atol=1e-9 * frequencies[0].max())
    speed = own.model.flow.speed
    assert speed["p0"] == pytest.approx(known.model.flow.planet_speed["set"])


@pytest.mark.parametrize("torque", [100.0, -100.0])
@pytest.mark.parametrize("speed", [1000.0, -1000.0])
def test_phases_are_those_of_the_planetary_set(torque, speed):
    teeth, planets = (28, 38, 104), 3
    tables = simple_set(teeth=teeth, planets=planets, torque=torque)
    tables["operation"]["load_case"][0]["speed"]["sun"] = f"{speed} rpm"
    case = read_case(tables)
    phases = pair_phases(case, gearbox_flow(case))
    gears = [
        Gear(z, 2e-3, math.radians(20.0), 0.0, 20e-3, 0.12 if inside else 5e-3, internal=inside, tip_open=True)
        for z, inside in zip(teeth, (False, False, True), strict=True)
    ]
    expected = PlanetarySet(*gears, 66e-3, equal_planet_angles(planets)).mesh_phases
    if torque * speed < 0.0:
        # the other flanks at the same sense of rotation: the lag of the planets changes its sign
        expected = np.concatenate([expected[:3], expected[:3] - (expected[3] - expected[0])])
    if speed < 0.0:
        expected = -np.asarray(expected)
    names = [f"sun-{n}" for n in range(3)] + [f"{n}-ring" for n in range(3)]
    apart = np.array([phases[name] for name in names]) - expected
    assert np.abs(apart - np.rint(apart)).max() < 1e-9


def test_stepped_planets_have_the_modes_of_their_springs():
    stiffness = (4e8, 4.2e8, 3.9e8, 3e8, 3.1e8, 2.8e8)
    modes = solve_gearbox_modes(solve_deflection(read_case(stepped_set(stiffness=stiffness)))).modes
    mass, k, _ = springs_by_hand(stiffness)
    kept = [i for i in range(18) if i != 8]  # the ring is held
    expected = np.sqrt(np.maximum(eigh(k[np.ix_(kept, kept)], mass[np.ix_(kept, kept)], eigvals_only=True), 0.0))
    expected /= 2.0 * math.pi
    np.testing.assert_allclose(modes.frequency, expected, rtol=1e-9, atol=1e-9 * expected.max() + 1e-3)


def test_stepped_planets_share_the_load_as_their_springs_do():
    stiffness = (4e8, 4.4e8, 3.6e8, 3e8, 3.1e8, 2.8e8)
    found = solve_deflection(read_case(stepped_set(stiffness=stiffness)))
    _, k, rows = springs_by_hand(stiffness)
    load = np.zeros(18)
    load[2], load[5] = 100.0, -100.0 * (1.0 + 57 * 108 / (24 * 27))
    kept = [i for i in range(18) if i not in (2, 8)]  # the sun's turn is free: it is taken as zero
    motion = np.zeros(18)
    motion[kept] = np.linalg.solve(k[np.ix_(kept, kept)], load[kept])
    np.testing.assert_allclose(found.mesh_force, np.array(stiffness) * (rows @ motion), rtol=1e-9)
    shares = found.model.flow.torque_shares
    assert sum(shares[f"sun-{n}"] for n in range(3)) == pytest.approx(1.0)
    assert shares["sun-1"] > shares["sun-0"] > shares["sun-2"]


UNEQUAL = (4e8, 4.4e8, 3.6e8, 3e8, 3.1e8, 2.8e8)


def forces_by_name(tables):
    found = solve_deflection(read_case(tables))
    return {stage.name: force for stage, force in zip(found.model.stages, found.mesh_force, strict=True)}, found


def scaled(value, size):
    """A quantity, its number times what its unit asks for of a gearbox ``size`` times as large of one material."""
    number, unit = value.split(" ", 1)
    power = {"mm": 1, "N/m": 1, "N m/rad": 3, "N m": 3, "kg": 3, "kg m^2": 5}.get(unit, 0)
    return f"{float(number) * size**power!r} {unit}"


def enlarged(tables, size):
    if isinstance(tables, dict):
        return {key: enlarged(value, size) for key, value in tables.items()}
    if isinstance(tables, list):
        return [enlarged(value, size) for value in tables]
    is_quantity = isinstance(tables, str) and tables[0] in "-0123456789" and " " in tables
    return scaled(tables, size) if is_quantity else tables


def test_a_stepped_set_in_the_mirror_carries_the_same():
    own, _ = forces_by_name(stepped_set(stiffness=UNEQUAL))
    tables = stepped_set(stiffness=UNEQUAL)
    for shaft in tables["shaft"]:
        x, y = shaft["axis"]
        shaft["axis"] = [x, y.removeprefix("-") if y.startswith("-") else f"-{y}"]
    tables["operation"]["load_case"][0] |= {"torque": {"sun": "-100 N m"}, "speed": {"sun": "-1000 rpm"}}
    assert forces_by_name(tables)[0] == pytest.approx(own, rel=1e-9)


def test_a_stepped_set_that_drives_backwards_carries_as_its_mirror_image():
    own, found = forces_by_name(stepped_set(stiffness=UNEQUAL))
    swapped = [UNEQUAL[n] for n in (0, 2, 1, 3, 5, 4)]
    tables = stepped_set(stiffness=swapped)
    tables["operation"]["load_case"][0]["torque"] = {"sun": "-100 N m"}
    back, driven = forces_by_name(tables)
    twins = {"sun-1": "sun-2", "sun-2": "sun-1", "1-ring": "2-ring", "2-ring": "1-ring"}
    assert {twins.get(name, name): force for name, force in back.items()} == pytest.approx(own, rel=1e-9)
    assert back != pytest.approx(own, rel=1e-3)
    outputs = [one.model.flow.port_torque["carrier"] for one in (found, driven)]
    assert outputs[0] == pytest.approx(-outputs[1])


def test_a_stepped_set_of_twice_the_size_carries_as_its_surface_grows():
    own, found = forces_by_name(stepped_set(stiffness=UNEQUAL))
    large, grown = forces_by_name(enlarged(stepped_set(stiffness=UNEQUAL), 2.0))
    assert large == pytest.approx({name: 4.0 * force for name, force in own.items()}, rel=1e-9)
    frequencies = [solve_gearbox_modes(one).modes.frequency for one in (found, grown)]
    np.testing.assert_allclose(2.0 * frequencies[1], frequencies[0], rtol=1e-9, atol=1e-9 * frequencies[0].max())


def test_the_order_of_planets_in_the_file_is_no_matter():
    own, found = forces_by_name(stepped_set(stiffness=UNEQUAL))
    tables = stepped_set(stiffness=UNEQUAL)
    for key in ("pair", "shaft", "mass", "bearing"):
        driven, *others = tables[key]
        tables[key] = [driven, *reversed(others)]
    other, turned = forces_by_name(tables)
    assert other == pytest.approx(own, rel=1e-9)
    frequencies = [solve_gearbox_modes(one).modes.frequency for one in (found, turned)]
    np.testing.assert_allclose(*frequencies, rtol=1e-9, atol=1e-9 * frequencies[0].max())


def test_double_planets_yield_as_a_chain_of_three_pairs():
    sun, inner, outer, ring = 24, 18, 20, 84
    stiffness = (4e8, 3e8, 5e8)
    near, far, between = 42e-3, 64e-3, 38e-3
    beside = math.acos((near**2 + far**2 - between**2) / (2.0 * near * far))
    tables = members(sun=(1.0, 5e-4), carrier=(4.0, 2e-2), ring=(3.0, 4e-2)) | {"pair": []}
    chain = ((sun, inner), (inner, outer), (outer, ring))
    for n in range(3):
        psi = 2.0 * math.pi * n / 3.0
        planet(tables, f"inner {n}", near, psi)
        planet(tables, f"outer {n}", far, psi + beside)
        bodies = ("sun", f"inner {n}", f"outer {n}", "ring")
        for i, (teeth, k) in enumerate(zip(chain, stiffness, strict=True)):
            mesh = {"stiffness": f"{k!r} N/m"}
            shafts = bodies[i : i + 2]
            tables["pair"].append(pair("-".join(shafts), shafts, teeth, 2e-3, internal=i == 2, mesh=mesh))
    tables = loaded(tables, 90.0, 1000.0, "ring", ("carrier",), "rotation")
    held = [bearing for bearing in tables["bearing"] if bearing.get("outer_shaft") == "carrier"]
    for bearing in held:
        bearing["radial"] = "rigid"
    found = solve_deflection(read_case(tables))
    arm = 1e-3 * sun * math.cos(math.radians(20.0))
    force = 90.0 / (3.0 * arm)
    np.testing.assert_allclose(found.mesh_force, force, rtol=1e-9)
    # sun and ring turn against one another by the deflections of all three meshes
    model = found.model
    turned = [found.motion[6 * model.first[name] + 5] for name in ("sun", "ring")]
    yielded = arm * turned[0] - arm * ring / sun * turned[1]
    assert yielded == pytest.approx(force * sum(1.0 / k for k in stiffness), rel=1e-9)


@pytest.mark.parametrize(("shift", "fits"), [(0.0, True), (1.0, True), (0.4, False)])
def test_planets_stand_where_their_teeth_find_gaps(shift, fits):
    """Planet 2 so many places of 1/(z_s + z_r) of a turn further on."""
    tables = simple_set(teeth=(28, 38, 104))
    angle = 2.0 * math.pi * (1.0 / 3.0 + shift / 132.0)
    (row,) = (shaft for shaft in tables["shaft"] if shaft["name"] == "p1")
    row["axis"] = [f"{66.0 * math.cos(angle):.12g} mm", f"{66.0 * math.sin(angle):.12g} mm"]
    if fits:
        assert read_case(tables)
        return
    with pytest.raises(CaseError, match="do not assemble"):
        read_case(tables)


def refused(change):
    tables = simple_set()
    change(tables)
    with pytest.raises(CaseError) as refusal:
        read_case(tables)
    return str(refusal.value)


def test_carriers_that_carry_nothing_are_refused():
    assert "none is a planet" in refused(lambda t: t["pair"][0].update(carrier="ring", shafts=["sun", "carrier"]))
    assert "has a gear of the pair" in refused(lambda t: t["pair"][0].update(carrier="sun"))
    assert "no bearing of its carrier" in refused(
        lambda t: [bearing.pop("outer_shaft") for bearing in t["bearing"] if bearing["shaft"] == "p0"]
    )
    assert "'arm'" in refused(lambda t: t["pair"][0].update(carrier="arm"))


def test_planets_that_stand_on_a_turning_carrier_are_told():
    (finding,) = standing_planets(read_case(uneven_planets()))
    assert finding.code == "W-STANDING" and "carrier turns" in finding.text
    assert not [*standing_planets(read_case(simple_set()))]


def test_planets_run_around_in_the_picture_and_shared_gears_are_drawn_once():
    bodies = [body for body in gearbox_bodies(read_case(simple_set()), {}) if body.kind == "gear"]
    assert [body.member for body in bodies] == ["sun", "p0", "p1", "p2", "ring"]
    around = {body.member: body.orbit for body in bodies}
    carrier = 27 / (27 + 105)
    assert around["sun"] is None and around["ring"] is None
    assert around["p1"] == pytest.approx((0.0, 0.0, carrier))


@pytest.mark.slow
def test_teeth_of_pairs_alone_yield_as_those_of_a_whole_set():
    """What sun and planets yield between their meshes, which pairs leave out, is little."""
    from femgear.case import text as case_text
    from femgear.stages.static import solve_static
    from femgear.trains.drafts import new_case
    from femgear.trains.reading import parse_case

    coarse = {"positions": 16, "flank_elements": 10, "stresses": False}
    tables = case_text.parse(new_case("planetary", teeth=(27, 39, 105), torque="90 N m", planets=3), "")
    whole = solve_static(parse_case(case_text.write(tables | {"static": coarse | {"members": "fixed"}}))).cycle
    kept = ("teeth", "profile_shift", "bore_radius", "outer_radius", "tip_diameter")
    shared = {"module": "2 mm", "pressure_angle": "20 deg"} | {k: tables["set"][k] for k in ("face_width", "backlash")}
    for mesh, (first, second, torque) in enumerate((("sun", "planet", 30.0), ("planet", "ring", 30.0 * 39 / 27))):
        gears = [{k: v for k, v in tables[name].items() if k in kept} for name in (first, second)]
        gears = [{"profile_shift": 0.0} | gear for gear in gears]
        pair_alone = {"model": "pair", "title": "alone", "set": shared, "material": tables["material"]}
        pair_alone |= {"gear_1": gears[0], "gear_2": gears[1], "static": coarse}
        alone = solve_static(parse_case(case_text.write(pair_alone | {"operation": {"torque": f"{torque} N m"}}))).cycle
        assert alone.mean()[0] == pytest.approx(whole.mean()[3 * mesh], rel=5e-4)
        assert alone.peak_to_peak()[0] == pytest.approx(whole.peak_to_peak()[3 * mesh], rel=2e-3)
