"""Pairs in slices over the width: against the plane, against a set, hands, leads, and what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from stages.test_static_pair import STEEL, TAU
from trains.pair.test_case_file import CASE, INTERNAL, pair_case

from femgear.case.gear_set import planetary_set
from femgear.contact.bodies import Bodies, make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.width_waves import width_waves
from femgear.errors import FemgearError
from femgear.gears.deviations import no_deviations
from femgear.gears.modifications import FlankForm, LeadSlope
from femgear.gears.pair import GearPair
from femgear.stages.static import solve_static
from femgear.stages.static_figures import contact_pattern
from femgear.stages.static_results import _helical, load_warnings, static_warnings
from femgear.trains.drafts import ToothForm, new_case
from femgear.trains.pair.stages import iso_stiffness
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import check_case, train_of
from validation.planetary import reference_set

SLICES = 12
HEIGHT = (np.arange(SLICES) + 0.5) / SLICES - 0.5
SLICED = {"static.slices": SLICES}
OPEN = {"set.centre_distance": None, "gear_1.profile_shift": 0.3, "gear_2.profile_shift": 0.1, **SLICED}
KINDS = pytest.mark.parametrize("kind", [{}, INTERNAL], ids=["external", "internal"])
ONE_KIND = pytest.mark.parametrize(
    "kind", [{}, pytest.param(INTERNAL, marks=pytest.mark.slow)], ids=["external", "internal"]
)


def helical(kind, angle, **more):
    tips = {"gear_1.tip_diameter": None, "gear_2.tip_diameter": None}
    inside = {"gear_2.outer_radius": "110 mm"} if kind else {}
    inside |= tips
    return pair_case({**kind, **OPEN, **inside, "set.helix_angle": f"{angle} deg", **more})


@ONE_KIND
def test_spur_slices_are_the_plane_pair(kind):
    plane, sliced = (solve_static(pair_case({**kind, **more})).cycle for more in ({}, SLICED))
    for name in ("deflection", "force", "stiffness"):
        expected = getattr(plane, name)
        assert np.abs(getattr(sliced, name) / expected - 1.0).max() < 1e-10, name
    assert sliced.face_load_factor == pytest.approx(1.0, abs=1e-9)


@pytest.mark.slow
@ONE_KIND
def test_the_other_hand_mirrors_the_width(kind):
    """Under the other torque too, which is that of the other hand from behind."""
    changes = {"set.helix_angle": "-20 deg"}, {"operation.torque": "-200 N m", "set.helix_angle": "-20 deg"}
    right, left, behind = (solve_static(helical(kind, 20, **more)).dataset() for more in ({}, *changes))
    back = -np.arange(right.sizes["position"]) % right.sizes["position"]
    for name in ("ste", "mesh_stiffness", "mesh_force"):
        np.testing.assert_allclose(left[name], right[name], rtol=1e-9, err_msg=name)
        np.testing.assert_allclose(behind[name][:, back], right[name], rtol=1e-9, err_msg=name)
    load = right.slice_load.values
    assert np.abs(left.slice_load.values - load[:, :, ::-1]).max() < 1e-9 * load.max()
    # a right-handed driver that turns counter-clockwise pushes its mate down
    base = np.arcsin(np.sin(np.radians(20.0)) * np.cos(np.radians(20.0)))
    assert right.axial_force.values == pytest.approx(-np.tan(base) * right.mesh_force.values, rel=1e-12)
    assert left.axial_force.values == pytest.approx(-right.axial_force.values, rel=1e-9)
    overlap = 20.0 * np.sin(np.radians(20.0)) / (np.pi * 3.0)
    assert right.attrs["overlap_ratio"] == pytest.approx(overlap, rel=1e-12)
    assert "planet_couple" not in right
    # solid pairs of 0, 10 and 20 degrees; of 20 degrees and 27.6 mm it is 9.4 %
    assert right.attrs["free_ends"] == pytest.approx(0.094 * 27.6 / 20.0, rel=0.01)
    assert "W-ENDS" in [one.code for one in static_warnings(right)]
    assert len(contact_pattern(right).axes) == 2  # the mesh and its colours


@pytest.mark.parametrize(
    "ahead",
    [pytest.param(None, marks=pytest.mark.slow, id="spur, lead slope"), pytest.param(0.8 * HEIGHT, id="helical")],
)
def test_a_set_whose_planet_does_not_couple_its_flanks_is_two_pairs(ahead):
    """In slices as in the plane: neither bodies nor their waves carry from one flank to the other."""
    s = replace(reference_set(), planet_angles=(0.0,))
    bodies = make_bodies(make_sectors(s, STEEL, flank_elements=12), STEEL)
    waves = width_waves(make_sectors(s, STEEL, flank_elements=6, refine=0.5), STEEL, SLICES)

    def apart(one):
        regular, n = one.planet.regular.copy(), len(one.planet.roll)
        regular[:, :n, n:] = regular[:, n:, :n] = 0.0
        return one.with_gear(1, replace(one.planet, regular=regular))

    bodies, waves = apart(bodies), replace(waves, bodies=tuple(map(apart, waves.bodies)))
    lead, force = FlankForm(() if ahead is not None else (LeadSlope(3e-6),)), 30.0 / s.sun.base_radius

    def walked(gears, bodies, waves, torque, positions):
        # the planet has its slope on both flanks, gear 1 or gear 2 of a pair
        flanks = ("sun",) if gears.gears[0].name == "planet" else ("planet_sun_side", "planet_ring_side")
        slope = replace(no_deviations(gears), **dict.fromkeys(flanks, lead))
        return walk_mesh_cycle(
            gears,
            bodies,
            sun_torque=torque,
            positions=positions,
            deviations=slope,
            options=CycleOptions(waves=waves, slices=SLICES, ahead=ahead),
        )

    whole = walked(s, bodies, waves, 30.0, TAU)
    for mesh, (one, two) in enumerate((("sun", "planet"), ("planet", "ring"))):

        def of_pair(found, one=one, two=two):
            return Bodies((getattr(found, one), getattr(found, two)), (s.sun.face_width,))

        pair = GearPair(getattr(s, one), getattr(s, two), s.centre_distance)
        crosswise = replace(waves, bodies=tuple(map(of_pair, waves.bodies)))
        torque, at = force * pair.gear_1.base_radius, TAU + s.mesh_phases[mesh]
        cycle = walked(pair, of_pair(bodies), crosswise, torque, at)
        for name in ("deflection", "stiffness", "force", "mesh_misalignment"):
            expected = getattr(whole, name)[mesh]
            limit = {"rtol": 1e-9, "atol": 1e-9 * np.abs(expected).max(), "err_msg": name}
            np.testing.assert_allclose(getattr(cycle, name)[0], expected, **limit)
        loads = [np.sort(one, axis=0)[-2:] for one in (cycle.slice_load[0], whole.slice_load[mesh])]
        np.testing.assert_allclose(*loads, rtol=1e-8, atol=1e-9 * loads[1].max())


@pytest.mark.slow
@ONE_KIND
def test_a_slope_loads_one_end_more_than_linear_teeth_would(kind):
    """ISO 6336-1: ``1 + F_by c_gamma b / (2 F)`` of full contact; slices resist a slope more than a load."""

    def factor(gear, amount):
        slope = [{"kind": "lead slope", "amount": f"{amount} um"}]
        case = pair_case({**kind, **SLICED, f"{gear}.modifications": slope})
        cycle = solve_static(case).cycle
        linear = 1e-6 * amount * iso_stiffness(case)[1] * case.set.face_width / (2.0 * cycle.force.max())
        return cycle.face_load_factor[0] - 1.0, linear

    (large, linear), (other, _), (small, _) = factor("gear_1", 4), factor("gear_2", 4), factor("gear_1", 1)
    assert large > linear and large == pytest.approx(4.0 * small, rel=0.03)
    assert other == pytest.approx(large, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "code", "key", "words"),
    [
        ({"set.helix_angle": "20 deg"}, "E-SLICES", "static.slices", "helical teeth with an overlap ratio"),
        ({"set.helix_angle": "-40 deg", **SLICED, "static.slices": 6}, "E-SLICES", "static.slices", "1.36"),
        ({"static.slices": 30}, "E-SLICES", "static.slices", "thinner than a quarter"),
        ({"static.slices": 30}, "E-SLICES", "static.slices", "use at most 25 slices"),
        ({"set.face_width": "15 mm"}, "E-SLICES", "static.slices", "give static.slices = 18"),
        ({"set.face_width": "150 mm"}, "E-SLICES", "static.slices", "give static.slices = 34"),
        ({**SLICED, "static.back_flanks": True}, "E-SLICES", "static.back_flanks", "no back flanks"),
        (
            {"set.helix_angle": "35 deg", **SLICED, "set.centre_distance": "91.5 mm"},
            "E-CENTRE-DISTANCE",
            "set.centre_distance",
            "transverse section",
        ),
        (
            {"gear_1.rack": {"root_radius": 0.6}, **SLICED},
            "E-ROOT-RADIUS",
            "gear_1.rack.root_radius",
            "transverse section",
        ),
    ],
)
def test_refusals_name_the_entries_of_the_file(changes, code, key, words):
    with pytest.raises(FemgearError) as found:
        check_case(helical({}, 20, **{"static.slices": 0, **changes}))
    problems = getattr(found.value, "problems", ()) or (found.value,)
    assert any(one.code == code and one.key == key and words in str(one) for one in problems)
    assert "leave static.slices out" not in str(found.value)


@pytest.mark.parametrize(("angle", "steep"), [("30 deg", False), ("-31 deg", True)])
def test_helices_beyond_those_validated_are_told(angle, steep):
    found = [one for one in load_warnings(helical({}, 20, **{"set.helix_angle": angle})) if "HELIX" in one.code]
    assert [(one.code, one.key) for one in found] == [("W-HELIX", "set.helix_angle")] * steep


@pytest.mark.slow
def test_the_slices_that_a_warning_advises_can_be_taken():
    """Under a load that makes contacts a sixteenth of the width wide."""
    slope = [{"kind": "lead slope", "amount": "40 um"}]
    coarse = {"operation.torque": "3000 N m", "static.positions": 8, "static.flank_elements": 8}
    case = pair_case({**coarse, "gear_1.modifications": slope, "static.slices": 8})
    said = " ".join(map(str, solve_static(case).findings))
    advice = re.search(r"8th of the width: take (\d+) slices, about", said)
    assert advice and 8 < int(advice[1]) < 25
    case = with_values(case, {"static.slices": int(advice[1])})
    assert any("more would be thinner" in one.text for one in solve_static(case).findings)


def test_stiffness_of_the_standard_knows_material_and_small_loads():
    steel, light, small = (
        iso_stiffness(pair_case(changes))[1]
        for changes in ({}, {"material.youngs_modulus": "70 GPa"}, {"operation.torque": "20 N m"})
    )
    assert light == pytest.approx(steel * 70.0 / 206.0)
    # 20 N m on a reference radius of 36 mm and 20 mm of width are 27.8 N/mm
    assert small == pytest.approx(steel * (20.0 / 0.036 / 0.020 / 100e3) ** 0.25)


@pytest.mark.parametrize(("modules", "told"), [(6.7, True), (12.0, False)])
def test_ends_of_narrow_spur_teeth_are_told_with_their_sizes(modules, told):
    """Solid gears with free ends, 6.7 modules wide: 3.4 % softer, K_Hbeta 1.032, slopes 12 to 17 % less."""
    ratio = 6.7 / modules
    data = xr.Dataset(attrs={"face_width": 3e-3 * modules, "module": 3e-3, "free_ends": 0.034 * ratio})
    found = [one for one in _helical(data) if one.code == "W-ENDS"]
    assert bool(found) == told
    if told:
        softer, aligned, slope = (float(x) for x in re.findall(r"about ([\d.]+)", found[0].text))
        assert softer == pytest.approx(3.4, abs=0.1) and aligned == pytest.approx(1.032, abs=0.005)
        assert 12.0 <= slope <= 17.0


@pytest.mark.slow
def test_overlap_keeps_teeth_of_a_low_transverse_contact_ratio_in_contact():
    """A transverse contact ratio of 0.98: always in contact, softer, and the load runs over the width."""
    whole = read_case(new_case("pair", teeth=(20, 30), form=ToothForm(helix="20 deg")))
    coarse = with_values(whole, {"static.positions": 8, "static.flank_elements": 6})
    tips = {f"{gear.name}.tip_diameter": f"{2e3 * gear.tip_radius - 1.5} mm" for gear in planetary_set(coarse).gears}
    short = with_values(coarse, tips)
    assert planetary_set(short).contact_ratio == pytest.approx(0.977, abs=1e-3)
    (said,) = (one for one in train_of(short).case_warnings(short) if one.code == "W-CONTACT-RATIO")
    assert said.severity == "doubt" and "transverse" in said.text
    check_case(short, "static")
    cycle, long = solve_static(short).cycle, solve_static(coarse).cycle
    assert cycle.residual.max() < 1e-9 and cycle.force.min() == pytest.approx(cycle.force.max(), rel=1e-9)
    assert 0.7 < cycle.stiffness.min() / long.stiffness.min() < 0.9
    with pytest.raises(FemgearError, match="E-CONTACT-RATIO"):
        check_case(with_values(short, {"set.face_width": "0.1 mm", "static.slices": 2}))


@pytest.mark.slow
def test_slices_with_leads_against_the_most_slices_and_512_positions():
    """Twelve slices at 16 positions: errors, stiffness, K_H-beta, pressures under slope and crowning."""
    leads = [{"kind": "lead slope", "amount": "8 um"}, {"kind": "lead crowning", "amount": "4 um"}]
    case = with_values(
        read_case(CASE),
        {"gear_1.modifications": leads, "static.flank_elements": 6, "static.stresses": False},
    )
    few, many = (
        solve_static(with_values(case, {"static.slices": slices, "static.positions": positions})).cycle
        for slices, positions in ((12, 16), (26, 512))
    )
    assert few.peak_to_peak() == pytest.approx(np.ptp(many.deflection, axis=1), rel=0.01)
    assert few.mean("deflection") == pytest.approx(many.deflection.mean(axis=1), rel=0.005)
    assert few.mean() == pytest.approx(many.stiffness.mean(axis=1), rel=0.005)
    assert few.face_load_factor == pytest.approx(many.face_load_factor, rel=0.005)
    assert few.extremes("max_pressure")[1] == pytest.approx(many.max_pressure.max(axis=1), rel=0.01)
