"""Planets that go round in coordinates at rest, of stages and of branches: motion, and what a carrier feels."""

from dataclasses import replace

import numpy as np
import pytest
from casings import casing_tables
from planet_gearboxes import COUNTED, bending_set, known_set, simple_set
from small_gearbox import planetary_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.transient import gearbox_in_time, integrate
from femgear.trains.gearbox.transient_checks import check_transient
from femgear.trains.gearbox.turning_planets import (
    centrifugal_pull,
    pin_changes,
    planets_of_stage,
    turning_planets,
    wave_generator,
)
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


def test_a_carrier_that_turns_or_tilts_as_a_whole_feels_no_centrifugal_force():
    tables = planetary_tables(planet={"mass": "0.4 kg", "inertia": "1e-4 kg m^2", "bearing": {"radial": "1e8 N/m"}})
    found = solve_deflection(read_case(tables | {"deflection": {"slices": 1}}))
    stage, assembly = found.model.stages[0], found.model.assembly
    own = replace(assembly, inertias=tuple(one for one in assembly.inertias if one.stations[0] in stage.planets))
    planets = planets_of_stage(found.model, stage)
    assert planets is not None
    Z, hub = wave_generator(planets, assembly.count), stage.members[1]
    stiffness = planets.speed**2 * Z @ own.mass @ Z + centrifugal_pull(assembly, planets, own.mass)
    for way in range(6):
        motion = np.zeros((len(assembly.names), 6))
        motion[hub, way] = 1.0
        for planet in stage.planets:
            arm = assembly.places[planet] - assembly.places[hub]
            motion[planet, :3] = motion[hub, :3] + np.cross(motion[hub, 3:], arm)
            motion[planet, 3:] = motion[hub, 3:]
        force = stiffness @ motion.ravel()
        assert np.abs(force).max() < 1e-12 * np.abs(stiffness).max()


TIME = {"duration": "4 ms", "rate": "60 kHz", "start": "static"}


def motion_of(tables):
    """Deflection and motion in time of a gearbox, both of all meshes in their order."""
    case = read_case(tables | {"casing": casing_tables(), "transient": TIME})
    check_transient(case)
    found = solve_deflection(case)
    return found, integrate(gearbox_in_time(found, case.transient), lowpass=False)


@pytest.mark.parametrize(
    ("fixed", "torque", "motions"),
    [("ring", 100.0, "plane"), ("ring", -80.0, "space"), ("carrier", 100.0, "plane"), ("sun", 90.0, "plane")],
)
def test_planets_that_are_shafts_move_in_time_as_those_of_a_planetary_stage(fixed, torque, motions):
    """All meshes with k(t) of 30 % and their phases, in a casing on uneven feet."""
    moved = []
    for make in (simple_set, known_set):
        tables = make(teeth=(28, 38, 104), mesh=COUNTED, torque=torque, motions=motions)
        tables["operation"] |= {"fixed": [fixed], "output": ["carrier" if fixed != "carrier" else "ring"]}
        if fixed == "sun":
            case = {"torque": {"ring": f"{torque} N m"}, "speed": {"ring": "1000 rpm"}}
            tables["operation"]["load_case"][0] |= case
        moved.append(motion_of(tables)[1].run)
    own, known = (run.force for run in moved)
    assert np.ptp(known, axis=0).min() > 0.05 * known.mean()
    assert np.abs(own - known).max() < 1e-9 * np.abs(known).max()


def bending():
    tables = bending_set(0.3, back=False)
    for pair in tables["pair"]:
        pair["mesh"] = {"stiffness": "3e8 N/m"}
    for bearing in tables["bearing"]:
        bearing.pop("torsional", None)
    return tables


def test_shafts_of_constant_meshes_stay_at_the_loaded_state_as_they_go_round():
    """A rotation of the whole, with pins that pull planets of two stations inwards, moves nothing else."""
    found, motion = motion_of(bending())
    assert motion.run.force == pytest.approx(np.broadcast_to(found.mesh_force, motion.run.force.shape), rel=1e-7)
    assert np.abs(motion.run.velocity).max() < 1e-7 * motion.run.speed[0]


def test_pins_of_branches_have_the_mean_of_all():
    tables = bending()
    tables["bearing"][3]["radial"] = "5e8 N/m"
    found = solve_deflection(read_case(tables))
    model = found.model
    planets = turning_planets(model, model.stages)["sun 0"]
    changes = pin_changes(found, planets)
    assert [*changes] == [3, 5, 7, 4, 6, 8]
    radial = [found.bearing_stiffness[number][0, 0] + changes[number][0, 0] for number in (3, 5, 7)]
    assert radial == pytest.approx([3e8] * 3)


@pytest.mark.parametrize(
    ("change", "words"),
    [("pin", "have errors"), ("play", "play"), ("held", "differ"), ("two", "2 planets")],
)
def test_planets_that_go_round_unlike_are_refused_in_time(change, words):
    tables = simple_set(planets=2 if change == "two" else 3) | {"transient": TIME}
    shafts = {shaft["name"]: shaft for shaft in tables["shaft"]}
    if change == "pin":
        shafts["p1"]["pin_error"] = {"tangential": "3 um"}
    if change == "play":
        for bearing in tables["bearing"][3:]:
            bearing["clearance"] = "20 um"
    if change == "held":
        tables["bearing"].append({"name": "more", "shaft": "p0", "radial": "1e5 N/m"})
    with pytest.raises(CaseError, match=words) as refused:
        check_transient(read_case(tables))
    assert refused.value.code == "E-TURNING" and refused.value.key == "transient"
    tables["transient"] = TIME | {"turning": False}
    check_transient(read_case(tables))
