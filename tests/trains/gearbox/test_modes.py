"""Modes of gearboxes: energies, kinds, gyroscopic terms, excitation lines."""

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import excitation_orders, linear_system, solve_gearbox_modes
from femgear.trains.reading import read_case, with_values


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
            "2 x stage mesh": 48.0,
            "3 x stage mesh": 72.0,
        }
    )


def test_the_wind_turbine_twists_as_its_rotor_and_generator_on_one_spring():
    modes = solve_gearbox_modes(solve_deflection(read_case("cases/five_megawatt_chain.toml"))).modes
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
