"""Pairs in slices that carry far more than the plane, or where it does not touch; positions of the helix."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from trains.pair.test_case_file import pair_case

from femgear.case.gear_set import planetary_set
from femgear.contact import face_width
from femgear.contact.face_width import over_slices, ripple_doubt, slices_ahead
from femgear.stages.static import record_positions, solve_static
from validation.reference.hertz import cell_influence

# the tip diameters of the case are those of spur teeth: helical ones are left to the rack
OWN_TIPS = {"gear_1.tip_diameter": None, "gear_2.tip_diameter": None}


def misaligned(torque, slope, *more, **changes):
    lead = {"kind": "lead slope", "amount": f"{slope} um"}
    changes = {"static.slices": 25, "operation.torque": f"{torque} N m", **changes}
    return pair_case({"gear_1.modifications": [lead, *more], **changes})


@pytest.mark.slow
def test_slices_that_carry_most_of_the_load_follow_the_curves_of_their_forces(monkeypatch):
    """Pairs yield less per force the more they carry, at more than four times the load of the pair too."""
    cycle = solve_static(misaligned(20, 40)).cycle
    assert cycle.slice_load.max() > 8.0 * cycle.force.max()
    monkeypatch.setattr(face_width, "_MOST", 40.0)
    wider = solve_static(misaligned(20, 40)).cycle
    assert cycle.face_load_factor == pytest.approx(wider.face_load_factor, rel=2e-3)
    assert cycle.stiffness == pytest.approx(wider.stiffness, rel=5e-3)


def kinked_peaks(load, radius, away, slope, modulus, cell):
    """Peak pressures [Pa] of half planes in contact where a circle is cut off from a place on.

    Cells of uniform pressure (Johnson, eq. 2.24b), none in tension; the kink lies at four places in a cell.
    Load in N/m; radius, distance of the kink from the circle's contact and cell in m.
    """
    reach, peaks = 4.0 * np.sqrt(4.0 * load * radius / (np.pi * modulus)), []
    for shift in (0.0, 0.25, 0.5, 0.75):
        x = away + cell * (np.arange(-100, 100) + shift)
        x = x[np.abs(x) < reach]
        gap = x**2 / (2.0 * radius) + slope * np.maximum(x - away, 0.0)
        compliance, pressed = cell_influence(x[:, None] - x, 0.5 * cell, 1.0, modulus), np.arange(len(x))
        forces = np.array([-1.0])
        while forces.min() < 0.0:
            n = len(pressed)
            system = np.block([[compliance[np.ix_(pressed, pressed)], -np.ones((n, 1))], [np.ones(n), np.zeros(1)]])
            forces = np.linalg.solve(system, np.append(-gap[pressed], load))[:-1]
            found, pressed = pressed, pressed[forces >= 0.0]
        assert found[0] > 0 and found[-1] < len(x) - 1
        peaks.append(forces.max() / cell)
    return peaks


def test_slices_where_the_plane_does_not_touch_have_pressures():
    """Hertz: ``p = sqrt(F E* / (pi b R))`` of lines, but where the contact lies over the start of a relief.

    There the flanks have a kink, where pressures grow with the logarithm of the cells: those of the same
    cells between two half planes, wherever the kink lies in its cell.
    """
    relief, starts = {"kind": "tip relief", "amount": "15 um"}, (77e-3, 112e-3)
    changes = {"gear_2.modifications": [relief | {"start_diameter": "112 mm"}], "static.positions": 16}
    static = solve_static(misaligned(50, 20, relief | {"start_diameter": "77 mm"}, **changes))
    cycle, gears = static.cycle, static.planetary_set.gears
    assert not cycle.edge_contact.any()
    carries = cycle.slice_load > 0.05 * cycle.slice_load.max()
    path = np.broadcast_to(cycle.path[:, :, None], carries.shape)[carries]
    tangent = np.tan(static.planetary_set.working_pressure_angle)
    rolls = gears[0].base_radius * tangent + path, gears[1].base_radius * tangent - path
    modulus, line_load = 206e9 / (2.0 * (1.0 - 0.3**2)), cycle.slice_load[carries] / 20e-3
    radius = rolls[0] * rolls[1] / (rolls[0] + rolls[1])
    hertz = np.sqrt(line_load * modulus / (np.pi * radius))
    pressure, width = cycle.slice_pressure[carries], np.sqrt(4.0 * line_load * radius / (np.pi * modulus))
    smooth = np.ones(len(path), bool)
    for gear, roll, start in zip(gears, rolls, starts, strict=True):
        begin = math.sqrt(0.25 * start**2 - gear.base_radius**2)
        away = (begin**2 - roll**2) / (2.0 * gear.base_radius)
        # the amount grows evenly over the roll length
        slope = 15e-6 / (gear.tip_roll - begin) * gear.base_radius / roll
        kinks = np.flatnonzero(np.abs(away) < 0.5 * width)
        smooth &= np.abs(away) > width
        assert len(kinks) > 10
        for i in kinks:
            # 36 of them are the windows of four times the force of the pair
            peaks = kinked_peaks(line_load[i], radius[i], away[i], slope[i], modulus, 15.1e-6)
            assert min(peaks) < pressure[i] < max(peaks)
    ratio = pressure / hertz
    assert 0.95 < ratio.min() and ratio[smooth].max() < 1.05
    assert np.median(ratio) == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.parametrize(("overlap", "slices"), [(1.3, 11), (0.8, 9), (2.15, 25)])
def test_the_doubt_of_the_ripple_covers_what_positions_miss(overlap, slices):
    """A stiffness whose jumps pass one slice after the other, beside the same one at 64 times the positions."""
    ahead, misses, doubts = slices_ahead(overlap, slices), [], []

    def record(count, start):
        position = np.arange(count) / count
        turned = np.mod(position[:, None] + ahead + start, 1.0)
        stiffness = (1.0 + 0.5 * (turned < 0.37) + 0.2 * turned).mean(axis=1)[None] * 1e8
        return SimpleNamespace(position=position, stiffness=stiffness, force=np.ones((1, count)))

    # three positions or more while one slice follows another, as `record_positions` takes them
    for count in (round(part * slices / overlap) for part in (3.0, 4.4, 7.1, 7.7, 10.3)):
        for start in np.linspace(0.0, 1.0 / count, 7, endpoint=False):
            seen, exact = (np.ptp(over_slices(record(n, start), ahead)["stiffness"]) for n in (count, 64 * count))
            misses.append(abs(seen / exact - 1.0))
            doubts.append(ripple_doubt(record(count, start), ahead))
    assert max(misses) > 0.05
    assert (np.array(misses) <= 1.5 * np.array(doubts)).all()
    assert ripple_doubt(record(64 * 24, 0.013), ahead) < 0.1 * max(doubts)
