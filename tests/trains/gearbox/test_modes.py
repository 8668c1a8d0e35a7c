"""Modes of gearboxes: energies, kinds, gyroscopic terms, excitation lines."""

from collections import Counter

import numpy as np
import pytest
from published.multistage_example import four_stage_case
from small_gearbox import pair_tables, planetary_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import GearboxModes, excitation_orders, linear_system, solve_gearbox_modes
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.fixture(scope="module")
def found():
    return solve_gearbox_modes(solve_deflection(read_case(pair_tables())))


def test_energies_of_members_and_parts_sum_to_one(found):
    elastic = found.modes.frequency > 0.0
    assert found.kinetic.sum(axis=0) == pytest.approx(np.ones(len(elastic)), rel=1e-9)
    assert found.strain.sum(axis=0)[elastic] == pytest.approx(np.ones(elastic.sum()), rel=1e-9)
    assert found.modes.kind[0] == "rigid"


def test_strain_energy_is_kinetic_energy(found):
    assembly, _, stiffness = linear_system(found.deflection)
    approach = assembly.columns.T @ found.motion
    energy = np.einsum("im,ij,jm->m", found.motion, assembly.stiffness, found.motion) + stiffness @ approach**2
    assert energy == pytest.approx((2.0 * np.pi * found.modes.frequency) ** 2, rel=1e-8, abs=1.0)


def test_a_shaft_without_mass_has_no_modes():
    tables = pair_tables()
    tables["shaft"][1]["material"] = {"density": "0 kg/m^3"}
    with pytest.raises(CaseError) as refused:
        modes_of(tables)
    assert (refused.value.code, refused.value.key) == ("E-MASS", "shaft[1].material.density")


def test_a_shaft_on_a_soft_axial_bearing_swings_along_its_axis(found):
    mass = 7850.0 * np.pi / 4.0 * 0.04**2 * 0.09
    axial = [hertz for hertz, kind in zip(found.modes.frequency, found.modes.kind, strict=True) if kind == "axial"]
    assert min(abs(hertz / (np.sqrt(1e8 / mass) / (2.0 * np.pi)) - 1.0) for hertz in axial) < 5e-3


def test_lines_of_turns_and_meshes(found):
    orders = excitation_orders(found.deflection.model, "input")
    assert orders == pytest.approx(
        {
            "input turn": 1.0,
            "output turn": 2.0 / 3.0,
            "stage mesh": 24.0,
            "harmonic 2 of stage mesh": 48.0,
            "harmonic 3 of stage mesh": 72.0,
        }
    )


def test_the_wind_turbine_twists_as_its_rotor_and_generator_on_one_spring():
    case = read_case("cases/five_megawatt_chain.toml")
    # the reference turbine is one whose casing stands still
    case = case.model_copy(update={"casing": None, "sensor": ()})
    modes = solve_gearbox_modes(solve_deflection(case)).modes
    torsional = [hertz for hertz, kind in zip(modes.frequency, modes.kind, strict=True) if kind == "torsional"]
    # 2.18 Hz without the inertia of the gears (NREL/TP-500-38060)
    assert torsional[0] == pytest.approx(2.18, rel=0.03)
    assert torsional[0] < 2.18


def test_turning_splits_the_bending_of_a_heavy_disc():
    tables = pair_tables()
    disc = {"shaft": "input", "position": "90 mm", "mass": "8 kg", "inertia": "0.3 kg m^2"}
    tables["mass"] = [disc]
    tables["operation"]["load_case"][0]["speed"]["input"] = "20000 rpm"
    campbell = solve_gearbox_modes(solve_deflection(read_case(tables))).campbell
    still, fast = np.sort(campbell.frequency[0]), np.sort(campbell.frequency[-1])
    assert np.abs(fast / np.where(still > 0.0, still, 1.0) - 1.0)[still > 0.0].max() > 0.05


def test_a_coupling_is_none_of_the_pins_whatever_it_is_called():
    """Parts of the strain energy go by what they are, not by their names."""
    case = read_case("cases/e_axle.toml")
    spring = {"name": "shear pin 1", "between": ["rotor", "casing"], "positions": ["10 mm", "0 mm"]}
    coupling = [spring | {"torsion": "1e3 N m/rad", "transmits": False}]
    modes = solve_gearbox_modes(
        solve_deflection(with_values(case, {"coupling": coupling, "deflection.contact": False}))
    )
    assert "coupling shear pin 1" in modes.parts and "pins of second stage" in modes.parts
    assert not any(part.startswith("pins of shear") for part in modes.parts)


def modes_of(tables) -> GearboxModes:
    return solve_gearbox_modes(solve_deflection(read_case(tables)))


@pytest.fixture(scope="module")
def four_stages() -> GearboxModes:
    return solve_gearbox_modes(solve_deflection(four_stage_case()))


def test_every_mode_of_equal_planets_is_of_one_class(four_stages):
    # 24 rotations of 12 members and 4 planets a class; 3 (N - 3) planet modes a stage
    expected = {"rigid": 1, "rotational": 23, "translational": 48, "planet": 6}
    assert Counter(four_stages.stages.kinds) == expected


def test_planet_modes_stay_in_one_stage_and_shares_add_up(four_stages):
    stages = four_stages.stages
    planet = np.array(stages.kinds) == "planet"
    assert stages.energy[:, planet].max(axis=0) == pytest.approx(np.ones(6))
    assert {*stages.energy[:, planet].argmax(axis=0).tolist()} == {2, 3}
    # every body is of some stage
    assert stages.energy.sum(axis=0) == pytest.approx(np.ones(78))


def test_unequal_planets_mix_the_classes():
    gears = {"planet_angles": ["0 deg", "90 deg", "210 deg"], "planets": 3}
    case = with_values(four_stage_case(), {f"planetary[0].gears.{key}": value for key, value in gears.items()})
    kinds = Counter(solve_gearbox_modes(solve_deflection(case)).stages.kinds)
    assert kinds["mixed"] > 10 and kinds["planet"] == 6


def test_a_shaft_of_two_stages_is_half_of_each():
    tables = pair_tables()
    stage = tables["pair"][0]
    tables["shaft"].append(tables["shaft"][1] | {"name": "last", "axis": ["180 mm", "0 mm"]})
    tables["bearing"] += [
        bearing | {"name": f"{bearing['name']} 2", "shaft": "last"} for bearing in tables["bearing"][2:]
    ]
    second = {"name": "second", "shafts": ["output", "last"], "positions": ["60 mm", "60 mm"]}
    tables["pair"].append(stage | second | {"gears": stage["gears"] | {"teeth": [30, 30]}})
    tables["load"][1] |= {"shaft": "last"}
    found = modes_of(tables)
    shares = dict(zip(found.members, found.kinetic, strict=True))
    assert found.stages.energy[0] == pytest.approx(shares["input"] + 0.5 * shares["output"])
    assert found.stages.energy[1] == pytest.approx(shares["last"] + 0.5 * shares["output"])
    assert {*found.stages.kinds} == {""}


def test_in_space_shafts_along_their_axes_belong_to_rotations_and_tilts_to_translations():
    found = modes_of(planetary_tables() | {"modes": {"up_to": "1 MHz"}})
    kinds = Counter(found.stages.kinds)
    # three planets: x and y with tilts in pairs, rotations and axial motions one by one
    assert kinds["mixed"] == kinds["planet"] == 0 and kinds["translational"] == 2 * (len(found.modes.frequency) // 3)
