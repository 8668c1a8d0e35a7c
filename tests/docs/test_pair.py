"""The numbers of docs/pair.md are what the package computes."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from page_examples import read_page, run_examples

from femgear.stages.life import solve_life
from femgear.stages.static import solve_static, solve_stress
from femgear.stages.strength import rate_case
from femgear.study.relief import design_basis, harris_map, with_tip_relief
from femgear.trains.pair.stages import iso_stiffness
from femgear.trains.reading import read_case, with_values

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "pair.md").read_text(encoding="utf-8")
PROSE = " ".join(PAGE.split())
CASE = ROOT / "cases" / "spur_pair.toml"


def test_table_and_relief():
    case = read_case(CASE)
    static = solve_static(case)
    cycle, data = static.cycle, solve_stress(case, static).dataset()
    roots = zip(data.root_worst.values[0] / 1e6, data.iso_root_stress.values[0] / 1e6, strict=True)
    found = [
        float(cycle.mean("deflection")[0]) * 1e6,
        float(cycle.peak_to_peak()[0]) * 1e6,
        float(cycle.mean()[0]) / case.set.face_width / 1e9,
        iso_stiffness(case)[1] / 1e9,
        float(data.largest_pressure[0]) / 1e6,
        float(data.iso_contact_stress[0]) / 1e6,
        *(x for pair in roots for x in pair),
    ]
    rows = re.findall(r"(?m)^\| [a-z].*\] \|(.*)\|$", PAGE)
    printed = [float(number) for row in rows for number in re.findall(r"[\d.]+", row)]
    assert found == pytest.approx(printed, rel=2e-3)
    basis, plain = design_basis(case), re.search(r"falls from ([\d.]+) to ([\d.]+) µm", PROSE)
    forms = [with_tip_relief(None, static.planetary_set, amount=a) for a in (0.0, 15e-6)]
    peaks = harris_map(replace(basis, positions=64), torques=[200.0], deviations=forms).peak_to_peak
    assert plain and 1e6 * peaks[:, 0, 0] == pytest.approx([float(one) for one in plain.groups()], rel=5e-3)


def test_the_internal_pair_can_be_solved():
    (block,) = re.findall(r"```toml\n\[gear_2\]\n(.*?)```", PAGE, re.DOTALL)
    entries = dict(line.split(" = ") for line in block.strip().splitlines())
    changes = {f"gear_2.{key}": int(v) if v.isdigit() else v.strip('"') for key, v in entries.items()}
    changes |= {"gear_2.bore_radius": None, "static.positions": 8}
    changes |= {"set.centre_distance": "54 mm", "gear_1.profile_shift": 0.0, "gear_1.tip_diameter": None}
    assert solve_static(with_values(read_case(CASE), changes)).cycle.stiffness.min() > 0.0


def test_lives_over_load_cases():
    """The table, and what the load case backwards does to roots."""
    strong, spectrum = (tomllib.loads(text) for text in re.findall(r"```toml\n(\[(?:mat|op).*?)```", PAGE, re.DOTALL))
    tables = tomllib.loads(CASE.read_text(encoding="utf-8"))
    for section in (strong, spectrum):
        for name, entries in section.items():
            tables.setdefault(name, {}).update(entries)
    case = read_case(tables)
    static = solve_static(case)
    data = solve_life(case, static).dataset()
    rows = re.findall(r"(?m)^\| (root|flank) of gear (\d) \|(.*)\|$", PAGE)
    for kind, gear, numbers in rows:
        names = "life", "damage", "spectrum_safety", "equivalent_torque"
        found = [float(data[f"{kind}_{name}"].values[int(gear) - 1]) for name in names]
        assert found == pytest.approx([float(number) for number in numbers.split("|")], rel=2e-3)
    assert len(rows) == 4 and data["flank_damage_share"].values[1, 0] == pytest.approx(0.53, abs=5e-3)
    assert list(data["flank_damage"].values[2:]) == [0.0, 0.0]
    tables["operation"]["load_case"][2]["torque"] = "120 N m"
    forwards = solve_life(read_case(tables), static).dataset()
    assert f"S_F is {forwards['root_spectrum_safety'].min():.2f}, and no root" in PROSE
    assert not forwards["root_damage"].any()


@pytest.mark.slow
def test_helical_pair_and_lead_slope():
    rows = re.findall(r"(?m)^\| (?:Overlap|STE|Stiff|Axial).*?\|(.*)\|$", PAGE)
    printed = np.array([[float(one) for one in row.split("|")] for row in rows])
    (block,) = re.findall(r"```toml\n(set.helix.*?)```", PAGE, re.DOTALL)
    entries = [line.split(" = ") for line in block.strip().splitlines()]
    helical = {key: int(v) if v.isdigit() else v.strip('"') for key, v in entries}
    for column, width in zip(printed.T, (None, "20 mm", "27.6 mm"), strict=True):
        case = with_values(read_case(CASE), {**helical, "set.face_width": width} if width else {})
        static = solve_static(case)
        cycle, force = static.cycle, np.tan(static.base_helix_angle) * static.cycle.force.mean()
        stiffness = cycle.stiffness.mean() / case.set.face_width, iso_stiffness(case)[1]
        found = [static.overlap_ratio, cycle.deflection.mean() * 1e6, np.ptp(cycle.deflection) * 1e6]
        assert np.allclose([*found, *(k / 1e9 for k in stiffness), force], column, rtol=3e-3, atol=4e-3)
    slope = [{"kind": "lead slope", "amount": "4 um"}]
    case = with_values(read_case(CASE), {"static.slices": 25, "gear_1.modifications": slope})
    cycle = solve_static(case).cycle
    linear = 1.0 + 4e-6 * iso_stiffness(case)[1] * case.set.face_width / (2.0 * cycle.force.max())
    assert f"K_Hβ = {cycle.face_load_factor[0]:.2f}. Linear teeth" in PROSE and f"give {linear:.2f}:" in PROSE


def test_stiffness_for_ross(tmp_path, monkeypatch):
    """Mean and first harmonic of what ROSS interpolates are those of the static solution."""
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    monkeypatch.chdir(tmp_path)
    _, examples, printed = read_page("pair.md")
    assert run_examples("pair.md", examples) == printed[:1]
    known = np.load("spur_pair_stiffness.npz")
    theta, stiffness = known["theta"], known["stiffness"]
    assert theta[0] == 0.0 and theta[-1] == 2.0 * np.pi / 24 and stiffness[-1] == stiffness[0]
    k = solve_static(read_case(CASE)).cycle.stiffness[0]
    # the middle of the third period, and all positions of the first
    turned = 2.0 * np.pi / 24 * np.append(2.5, np.arange(len(k)) / len(k))
    expected = np.append(k[len(k) // 2], k)
    np.testing.assert_allclose(np.interp(turned % theta[-1], theta, stiffness), expected, rtol=1e-9)
    ross = pytest.importorskip("ross")
    mesh = object.__new__(ross.multi_rotor.Mesh)
    mesh.theta_range, mesh.stiffness_range = theta, stiffness
    np.testing.assert_allclose(mesh.interpolate_stiffness(turned), expected, rtol=1e-9)


@pytest.mark.slow
def test_rotors_of_ross_carry_the_torque(tmp_path, monkeypatch):
    """The example runs as printed; in the mean the mesh carries the torque of the case."""
    pytest.importorskip("ross")
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    monkeypatch.chdir(tmp_path)
    _, examples, printed = read_page("pair.md")
    rotors = re.findall(r"(?m)^```py\n(.*?)^```", PAGE, re.DOTALL)
    numbers = [
        [float(one) for one in re.findall(r"[\d.]+", text.split("period")[1])]
        for text in (run_examples("pair.md", [*examples, *rotors])[-1], printed[1])
    ]
    assert numbers[0] == pytest.approx(numbers[1], rel=5e-3)
    assert numbers[0][0] == pytest.approx(read_case(CASE).operation.torque, rel=5e-3)


def test_safeties_of_the_page():
    """Of the case that the page shows, with the K_v that it states."""
    section = " ".join(PAGE.partition("## Is it strong enough?")[2].partition("\n## ")[0].split())
    factor, method_b, method_c = (
        float(re.search(pattern, section)[1])
        for pattern in (r"computed ([\d.]+);", r"it is ([\d.]+) \(method B", r"and ([\d.]+)\s\(method C")
    )
    treated = {"material.treatment": "case hardened steel", "material.hardness": 720}
    case = with_values(read_case(CASE), treated | {"strength.quality": 6, "strength.application_factor": 1.25})
    rating = rate_case(case, dynamic=np.array([factor]))
    roots = re.search(r"S_F = ([\d.]+) and ([\d.]+), S_H = ([\d.]+) and ([\d.]+)\.", section)
    safeties = [flank.root_safety for flank in rating.flanks] + [flank.contact_safety for flank in rating.flanks]
    assert safeties == pytest.approx([float(value) for value in roots.groups()], abs=0.006)
    standard = rating.standard[0]
    assert (standard.dynamic.factor, standard.by_speed) == pytest.approx((method_b, method_c), abs=6e-4)
