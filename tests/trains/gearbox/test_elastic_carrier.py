"""Carriers from files in a gearbox: the same beams without reduction, stiff and turned ones, places that do not fit."""

import math

import numpy as np
import pytest
from carrier_bodies import ANGLES, HALF, SEAT, SECTION, beam_carrier, unreduced_frequencies, without_tilts, written
from small_gearbox import planetary_tables

from femgear.errors import CaseError
from femgear.fe.beam import rigid_link
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.reading import read_case, with_value

PINS = {"diameter": "20 mm", "length": f"{HALF!r} m"}
BEARING = {
    "planet": {"mass": "0.4 kg", "inertia": "1e-4 kg m^2", "bearing": {"radial": "4e8 N/m", "tilt": "5e4 N m/rad"}}
}


@pytest.fixture
def case_of(tmp_path, monkeypatch):
    """Case of a set with a carrier of these arrays."""
    monkeypatch.chdir(tmp_path)

    def read(arrays, **entries):
        written(tmp_path, arrays)
        gravity = {"gravity": entries.pop("gravity")} if "gravity" in entries else {}
        return read_case(planetary_tables(carrier_body={"file": "carrier.npz"}, **entries) | gravity)

    return read


def closed(**entries):
    return read_case(planetary_tables(pins=PINS, carrier_body={"wind_up_stiffness": "3e5 N m/rad"}, **entries))


def planets(found):
    stations = found.model.stages[0].planets
    return np.array([found.motion[6 * station : 6 * station + 6] for station in stations])


@pytest.mark.parametrize("entries", [{}, BEARING])
def test_statics_are_those_of_the_same_beams_by_closed_forms(case_of, entries):
    expected, found = solve_deflection(closed(**entries)), solve_deflection(case_of(beam_carrier(), **entries))
    assert planets(found) == pytest.approx(planets(expected), rel=1e-9, abs=1e-9 * np.abs(planets(expected)).max())
    assert found.mesh_slope == pytest.approx(expected.mesh_slope, rel=1e-9)
    assert found.bearing_force == pytest.approx(expected.bearing_force, rel=1e-9, abs=1e-6)
    assert found.residual < 1e-9


def test_pins_of_the_case_give_way_beside_the_carrier_of_the_file(case_of):
    both = ({"pins": PINS}, {})
    # without wind-up planets do not tilt, and both bend in series
    soft, hard = (solve_deflection(case_of(beam_carrier(wind_up=1e12), **entries)) for entries in both)
    alone, rigid = (solve_deflection(read_case(planetary_tables(**entries))) for entries in both)
    along = planets(soft) - planets(hard)
    assert along == pytest.approx(planets(alone) - planets(rigid), rel=1e-6, abs=1e-10)


@pytest.mark.parametrize("entries", [{}, BEARING])
def test_modes_are_those_of_the_beams_without_reduction(case_of, entries):
    arrays = beam_carrier(elements=2)
    found = solve_deflection(with_value(case_of(arrays, **entries), "modes.up_to", "200 kHz"))
    modes = solve_gearbox_modes(found)
    expected = unreduced_frequencies(found, arrays)
    expected = expected[expected > 1.0]
    ours = modes.modes.frequency[modes.modes.frequency > 0.0]
    assert ours == pytest.approx(expected[: len(ours)], rel=1e-8)
    assert len(ours) > 30
    assert modes.kinetic.sum(axis=0) == pytest.approx(np.ones(len(modes.modes.frequency)), rel=1e-9)
    elastic = modes.modes.frequency > 0.0
    assert modes.strain.sum(axis=0)[elastic] == pytest.approx(np.ones(elastic.sum()), rel=1e-6)
    assert "carrier of set" in modes.members and "carrier of set" in modes.parts


def test_few_inner_modes_are_enough_for_low_modes(case_of):
    arrays = beam_carrier(elements=2)
    found = solve_deflection(with_value(case_of(arrays), "modes.up_to", "8 kHz"))
    modes = solve_gearbox_modes(found).modes
    assert sum(name.startswith("carrier of set: mode") for name in modes.dofs) == 1
    expected = unreduced_frequencies(found, arrays)
    low = modes.frequency[(modes.frequency > 0.0) & (modes.frequency < 8e3)]
    assert low == pytest.approx(expected[expected > 1.0][: len(low)], rel=1e-3)


def frequencies(case):
    return solve_gearbox_modes(solve_deflection(case)).modes.frequency


def test_a_stiff_carrier_is_the_rigid_one(case_of):
    arrays = beam_carrier(stiffer=1e9)
    found = solve_deflection(case_of(arrays, **BEARING))
    rigid = solve_deflection(read_case(planetary_tables(**BEARING)))
    assert planets(found) == pytest.approx(planets(rigid), rel=1e-9, abs=1e-9 * np.abs(planets(rigid)).max())
    body = np.vstack([np.eye(6), *(rigid_link((x, y, z - SEAT)) for x, y, z in arrays["position"][1:])])
    body = np.vstack([body, np.zeros((1, 6))])
    tables = planetary_tables(**BEARING)
    whole = body.T @ arrays["mass"] @ body
    centre = np.array([0.0, 0.0, SEAT + whole[0, 4] / whole[0, 0]])
    away = rigid_link(-np.array([0.0, 0.0, whole[0, 4] / whole[0, 0]]))
    about = away.T @ whole @ away
    tables["mass"].append(
        {
            "shaft": "carrier",
            "position": f"{float(centre[2])!r} m",
            "mass": f"{float(whole[0, 0])!r} kg",
            "inertia": f"{float(whole[5, 5])!r} kg m^2",
            "transverse_inertia": f"{float(about[3, 3])!r} kg m^2",
        }
    )
    assert frequencies(case_of(arrays, **BEARING)) == pytest.approx(frequencies(read_case(tables)), rel=1e-8, abs=1e-6)


def test_turned_by_a_planet_pitch_and_renumbered_it_is_itself(case_of):
    arrays = beam_carrier(elements=2)
    expected = frequencies(case_of(arrays, **BEARING))
    pitch = 2.0 * math.pi / 3.0
    turned = frequencies(case_of(arrays, **BEARING, angle=f"{pitch!r} rad"))
    assert turned == pytest.approx(expected, rel=1e-9, abs=1e-6)
    other = beam_carrier(elements=2, angles=tuple(angle + pitch for angle in ANGLES))
    assert frequencies(case_of(other, **BEARING)) == pytest.approx(expected, rel=1e-9, abs=1e-6)
    # drawn at another angle in its file
    other = beam_carrier(elements=2, angles=tuple(angle + 0.7 for angle in ANGLES))
    assert frequencies(case_of(other, **BEARING)) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_pins_without_rotations_stay_upright_on_the_shaft(case_of):
    found = solve_deflection(case_of(without_tilts(beam_carrier())))
    whole = solve_deflection(case_of(beam_carrier()))
    assert np.abs(found.mesh_slope).max() < 1e-9 * np.abs(whole.mesh_slope).max()
    assert (frequencies(case_of(without_tilts(beam_carrier())))[1:] > 0.0).all()


def test_the_weight_of_the_carrier_is_a_load(case_of):
    case = case_of(beam_carrier(elements=2), gravity={"acceleration": "10 m/s^2"})
    load = solve_deflection(case).model.load.reshape(-1, 6).sum(axis=0)
    pins = 3.0 * SECTION.area * SECTION.density * 2.0 * HALF
    assert load[1] == pytest.approx(-10.0 * (2.0 + 8.0 + 3 * 0.4 + 3.0 + pins), rel=1e-9)


@pytest.mark.parametrize(
    ("arrays", "entries", "code", "key"),
    [
        (beam_carrier(angles=(0.0, 2.0)), {}, "E-COUNT", "file"),
        (beam_carrier(angles=(0.0, 2.0, 4.0)), {}, "E-RANGE", "file"),
        (beam_carrier(angles=ANGLES[::-1]), {}, "E-RANGE", "file"),
        (beam_carrier(), {"units": "mm-t-s"}, "E-UNITS", "file"),
        (beam_carrier(), {"units": "inch"}, "E-CHOICE", "units"),
        (beam_carrier(), {"wind_up_stiffness": "1e5 N m/rad"}, "E-CHOICE", "wind_up_stiffness"),
        (beam_carrier(), {"file": "none.npz"}, "E-FILE", "file"),
        (beam_carrier(), {"nodes": "none.csv"}, "E-FILE", "nodes"),
    ],
)
def test_carriers_that_do_not_fit_are_refused_by_key(tmp_path, monkeypatch, arrays, entries, code, key):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, arrays)
    with pytest.raises(CaseError) as raised:
        read_case(planetary_tables(carrier_body={"file": "carrier.npz"} | entries))
    problems = getattr(raised.value, "problems", None) or (raised.value,)
    assert (code, f"planetary[0].carrier_body.{key}") in [(one.code, one.key) for one in problems]
    assert all(one.remedy or one.limit for one in problems)


def test_pins_off_their_circle_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, beam_carrier())
    tables = planetary_tables(carrier_body={"file": "carrier.npz"})
    tables["planetary"][0]["gears"] |= {"teeth": [22, 20, 62], "centre_distance": "42 mm"}
    with pytest.raises(CaseError, match="miss their circle") as raised:
        read_case(tables)
    assert "42 mm" in str(raised.value)


def test_the_case_keeps_the_carrier_when_its_file_is_gone(case_of, tmp_path):
    case = case_of(beam_carrier())
    (tmp_path / "carrier.npz").unlink()
    assert read_case(case.source) == case
    assert case.profile_files == {"planetary[0].carrier_body.file": "carrier.npz"}


def test_the_seat_lies_on_the_shaft(case_of, tmp_path):
    tables = planetary_tables(carrier_body={"file": "carrier.npz"}, carrier_position="-30 mm")
    case_of(beam_carrier())
    del tables["mass"][1]
    seat = tables["bearing"].pop()
    tables["bearing"] += [seat | {"position": place} for place in ("20 mm", "60 mm")]
    tables["shaft"][1] |= {"start": "30 mm", "part": [{"length": "80 mm", "outer_diameter": "40 mm"}]}
    tables["load"] = [{"name": "carrier", "shaft": "carrier", "position": "80 mm"}]
    found = solve_deflection(read_case(tables))
    assert found.residual < 1e-9
    tables["planetary"][0]["carrier_position"] = "-35 mm"
    tables["shaft"][1]["start"] = "35 mm"
    with pytest.raises(CaseError, match="off the shaft") as raised:
        read_case(tables)
    assert raised.value.key == "planetary[0].carrier_body.file"
