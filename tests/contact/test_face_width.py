"""Pairs in slices that carry far more than the plane, or where it does not touch; positions of the helix."""

import math

import numpy as np
import pytest
from trains.pair.test_pair import pair_case

from femgear.case.gear_set import planetary_set
from femgear.contact import face_width
from femgear.trains.static.stages import record_positions, solve_static


# the tip diameters of the case are those of spur teeth: helical ones are left to the rack
OWN_TIPS = {"gear_1.tip_diameter": None, "gear_2.tip_diameter": None}


def misaligned(torque, slope, *more, **changes):
    lead = {"kind": "lead slope", "amount": f"{slope} um"}
    changes = {"static.slices": 25, "operation.torque": f"{torque} N m", **changes}
    return pair_case({"gear_1.modifications": [lead, *more], **changes})


def test_slices_that_carry_most_of_the_load_follow_the_curves_of_their_forces(monkeypatch):
    """Pairs yield less per force the more they carry, at more than four times the load of the pair too."""
    cycle = solve_static(misaligned(20, 40)).cycle
    assert cycle.slice_load.max() > 8.0 * cycle.force.max()
    monkeypatch.setattr(face_width, "_MOST", 40.0)
    wider = solve_static(misaligned(20, 40)).cycle
    assert cycle.face_load_factor == pytest.approx(wider.face_load_factor, rel=2e-3)
    assert cycle.stiffness == pytest.approx(wider.stiffness, rel=5e-3)


def test_slices_where_the_plane_does_not_touch_have_pressures():
    """Hertz: ``p = sqrt(F E* / (pi b R))`` of lines; relieved tips part the flanks faster than circles."""
    relief = {"kind": "tip relief", "amount": "15 um"}
    changes = {"gear_2.modifications": [relief | {"start_diameter": "112 mm"}], "static.positions": 16}
    static = solve_static(misaligned(50, 20, relief | {"start_diameter": "77 mm"}, **changes))
    cycle, (one, two) = static.cycle, static.planetary_set.gears
    assert not cycle.edge_contact.any()
    carries = cycle.slice_load > 0.05 * cycle.slice_load.max()
    path = np.broadcast_to(cycle.path[:, :, None], carries.shape)[carries]
    tangent = np.tan(static.planetary_set.working_pressure_angle)
    one, two = one.base_radius * tangent + path, two.base_radius * tangent - path
    modulus, width = 206e9 / (2.0 * (1.0 - 0.3**2)), 20e-3
    hertz = np.sqrt(cycle.slice_load[carries] * modulus * (one + two) / (np.pi * width * one * two))
    ratio = cycle.slice_pressure[carries] / hertz
    assert 0.95 < ratio.min() and ratio.max() < 2.0 and np.median(ratio) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("helix", [20, 30])
def test_pressures_of_helical_teeth_are_those_of_the_normal_section(helix):
    """Hertz at the pitch point: flanks are curved less by cos(beta_b); the load is that per width."""
    distance = 91.5 / math.cos(math.radians(helix))
    changes = {"set.helix_angle": f"{helix} deg", "set.centre_distance": f"{distance:.4f} mm", **OWN_TIPS}
    static = solve_static(pair_case({**changes, "static.slices": 15, "static.positions": 16}))
    cycle, (one, two) = static.cycle, static.planetary_set.gears
    middle = cycle.slice_load[..., 7, :]  # whose path is that of mid-width
    pitch = (np.abs(cycle.path) < 5e-4) & (middle > 0.2 * cycle.slice_load.max())
    tangent = np.tan(static.planetary_set.working_pressure_angle)
    path = cycle.path[pitch]
    one, two = one.base_radius * tangent + path, two.base_radius * tangent - path
    modulus, curved = 206e9 / (2.0 * (1.0 - 0.3**2)), (1 / one + 1 / two) * math.cos(static.base_helix_angle)
    hertz = np.sqrt(middle[pitch] * modulus * curved / (np.pi * 20e-3))
    assert cycle.slice_pressure[..., 7, :][pitch] == pytest.approx(hertz, rel=3e-3)


def test_a_contact_of_one_slice_is_warned_of():
    """Its stiffness is that of the slice: twice as many of them are half as stiff."""
    found = solve_static(misaligned(0.1, 10))
    assert found.dataset()["face_load_factor"].values == pytest.approx(25.0)
    assert any("1 of the slices: stiffness and K_Hbeta" in one.text for one in found.findings)
    assert not any("of the slices" in one.text for one in solve_static(misaligned(20, 10)).findings)


@pytest.mark.parametrize(
    ("angle", "wanted", "expected"),
    [(20, 16, 103), (20, 64, 103), (35, 64, 82), (5, 64, 68), (1, 16, 16), (1e-6, 64, 64), (-1e-6, 8, 8)],
)
def test_positions_of_a_helix_meet_slices_alike(angle, wanted, expected):
    """Multiples of pi m_n slices/(b sin beta), from three on, or whole parts of it: never without end."""
    changes = {"set.helix_angle": f"{angle} deg", "set.centre_distance": None, "gear_2.profile_shift": 0.1}
    changes |= OWN_TIPS
    case = pair_case({**changes, "static.slices": 25, "static.positions": wanted})
    assert record_positions(case, planetary_set(case)) == expected
