"""Helical sets whose meshes come from contact over the width: both models, from case to result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import femgear
from femgear.contact import root_stress
from femgear.contact.bodies import helical_stiffness
from femgear.contact.cycle import walk_mesh_cycle
from femgear.errors import CaseError
from femgear.stages.static import record_positions, solve_static, solve_stress
from femgear.trains.helical.stages import solve_helical_modes, solve_helical_static, solve_helical_stress
from femgear.trains.registry import stages_of

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "cases" / "helical_23_24_73.toml").read_text(encoding="utf-8")


@pytest.fixture
def few_waves(monkeypatch):
    """Root stress over the width from four waves for nine: what is compared here holds for either."""
    monkeypatch.setattr(root_stress, "_WAVES", 4)


def case_with(tmp_path, text, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return femgear.read_case(path)


@pytest.mark.slow
def test_elastic_set_with_a_helix(few_waves, tmp_path):
    """Whole overlap ratio: of the transmission error of the transverse section 5 % are left."""
    fewer = ("positions = 64\nslices = 25", "positions = 24\nslices = 12"), ("18 mm", "17.281 mm")
    # by the nominal root stresses of 2006, which sizes below are of
    case = femgear.with_values(case_with(tmp_path, TEXT, *fewer), {"strength.edition": 2006})
    found = solve_static(case)
    overlap = 17.281 * np.sin(np.radians(15.5)) / np.pi / 1.47
    assert overlap == pytest.approx(1.0, abs=1e-3)
    gears, passed = found.planetary_set, len(found.cycle.position) / (12 / overlap)
    assert len(found.cycle.position) == record_positions(case, gears) and abs(passed - round(passed)) < 0.1
    spur = walk_mesh_cycle(gears, found.bodies, sun_torque=found.sun_torque, positions=96)
    assert np.ptp(found.cycle.deflection[0]) < 0.05 * np.ptp(spur.deflection[0])
    data = found.dataset()
    assert found.cycle.helical and data["slice_load"].sizes["slice"] == 12
    # a right-handed sun that turns counter-clockwise pushes the planets down, and they the ring
    base = np.arcsin(np.sin(np.radians(15.5)) * np.cos(np.radians(17.5)))
    stress = solve_stress(case, found)
    loads, ahead = found.cycle.slice_load, stress.influences.ahead
    path = found.cycle.path[:, :, None] / gears.base_pitch + ahead[:, None]
    for kind, pair in enumerate(gears.kinds):
        meshes, ends = slice(3 * kind, 3 * kind + 3), np.array(pair.path) / gears.base_pitch
        carries = loads[meshes] > 0.0
        assert carries.any()
        # bent teeth touch a little before and behind the path
        there = path[meshes][carries]
        assert (there > ends[0] - 0.2).all() and (there < ends[1] + 0.2).all()
    file = stress.dataset()
    # Z_eps^2 of a whole overlap ratio is 1/eps_alpha; without Z_eps and Z_beta sigma_H0 is that of Hertz
    ratios = np.repeat([pair.contact_ratio for pair in gears.kinds], 3)
    assert file["iso_contact_ratio_factor"].values == pytest.approx(ratios**-0.5, rel=1e-3)
    assert file.attrs["iso_contact_helix_factor"] == pytest.approx(np.cos(np.radians(15.5)) ** -0.5)
    hertz = file["iso_contact_stress"] / file["iso_contact_ratio_factor"] / file.attrs["iso_contact_helix_factor"]
    hertz *= np.sqrt(file["contact_worst_load"] / file.attrs["nominal_load"] * file["contact_worst_curvature"])
    assert file["contact_pressure"].max("position").values == pytest.approx(hertz.values, rel=0.01)
    roots = (file["root_worst"] / file["iso_root_stress"]).values
    assert roots[:3] == pytest.approx(0.85, abs=0.05) and roots[3:, 0] == pytest.approx(0.85, abs=0.05)
    assert roots[3:, 1] == pytest.approx(0.67, abs=0.05) and not file.attrs["iso"]
    assert file["root_face_factor"].values == pytest.approx(1.0, abs=0.06)
    straight = replace(found, base_helix_angle=0.0)
    ratio = file["root_worst"].values / solve_stress(case, straight).dataset()["root_worst"].values
    stiff = [helical_stiffness(found.base_helix_angle, internal=ring) for ring in (False, True)]
    expected = 1.0 / np.array([[stiff[0], stiff[0]]] * 3 + [[stiff[0], stiff[1]]] * 3)
    assert ratio == pytest.approx(expected, rel=1e-9)
    assert data["axial_force"].values == pytest.approx(-np.tan(base) * found.cycle.force, rel=1e-12)
    assert data.attrs["overlap_ratio"] == pytest.approx(overlap, rel=1e-12)
    # sun and ring push a planet to opposite sides on opposite arms, at the working circles
    gears, axial = found.planetary_set, np.abs(data["axial_force"].values)
    sun, planet, ring = (gear.teeth for gear in gears.gears)
    arms = gears.centre_distance * planet / np.array([sun + planet, ring - planet])
    couple = arms[0] * axial[: gears.n_planets] + arms[1] * axial[gears.n_planets :]
    assert data["planet_couple"].values == pytest.approx(couple, rel=1e-12)
    assert "W-THRUST" in [one.code for one in found.findings]


@pytest.mark.parametrize(("angle", "steep"), [(30, False), (31, True)])
def test_steep_helices_of_rigid_sets_are_told(angle, steep):
    case = femgear.read_case(ROOT / "cases" / "helical_30_20_70.toml")
    case = femgear.with_values(case, {"helical.helix_angle": f"{angle} deg", "helical.mesh_stiffness": None})
    assert [one.key for one in case.notices if one.code == "W-HELIX"] == ["helical.helix_angle"] * steep


@pytest.mark.slow
def test_rigid_set_takes_the_meshes_of_the_contact(few_waves, tmp_path):
    """The quick estimate has another section factor, and slices that do not draw one another along."""
    text = (ROOT / "cases" / "helical_30_20_70.toml").read_text(encoding="utf-8")
    text = text.replace("[helical.mesh_stiffness]", "[ignored]") if "[helical.mesh_stiffness]" in text else text
    quick = case_with(tmp_path, text)
    if quick.helical.mesh_stiffness is not None:
        quick = quick.model_copy(update={"helical": quick.helical.model_copy(update={"mesh_stiffness": None})})
    sliced = quick.static.model_copy(update={"slices": 12, "positions": 16})
    full = quick.model_copy(update={"static": sliced})
    quick = quick.model_copy(update={"static": quick.static.model_copy(update={"positions": 16})})
    statics = [solve_helical_static(one) for one in (quick, full)]
    modes = [solve_helical_modes(*both) for both in zip((quick, full), statics, strict=True)]
    stiffness = [one.excitation.stiffness.mean(axis=1) for one in modes]
    assert stiffness[1] == pytest.approx(stiffness[0], rel=0.1)
    frequency = [one.modes.frequency[one.modes.frequency > 100.0][:6] for one in modes]
    assert frequency[1] == pytest.approx(frequency[0], rel=0.05)
    assert [any(stage.name == "stress" for stage in stages_of(one, None)) for one in (quick, full)] == [0, 1]
    stress = solve_helical_stress(full, statics[1])
    assert np.ptp(stress.influences.ahead) == pytest.approx(statics[1].overlap_ratio * 11 / 12, rel=1e-9)
    assert np.isfinite(stress.dataset()["root_over_width"].values).all()


@pytest.mark.parametrize(
    ("change", "limit"),
    [(("slices = 25\n", ""), "at least 8"), (("slices = 25", "slices = 6"), "at least 8")],
)
def test_helix_without_enough_slices_is_refused(tmp_path, change, limit):
    with pytest.raises(CaseError) as raised:
        solve_static(case_with(tmp_path, TEXT, change))
    assert raised.value.code == "E-SLICES" and raised.value.limit == limit
    assert raised.value.key == "static.slices"
