"""The deformed set of a negative torque is the state that static.nc holds, seen from behind."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import materials_of
from femgear.contact.bodies import make_sectors
from femgear.contact.tooth_loads import deformed_set
from femgear.gears.planetary import mirrored_set
from femgear.stages.static import solve_static
from femgear.stages.static_figures import _left_flanks_loaded, _reflected
from femgear.trains.reading import read_case, with_values

SLICED = {"static.slices": 8, "sun.modifications": [{"kind": "lead slope", "amount": "12 um"}]}
HELICAL = {
    "set.helix_angle": "8 deg",
    "set.centre_distance": "51.5 mm",
    "sun.profile_shift": None,
    "ring.profile_shift": None,
    "static.slices": 25,  # forces of a record are means while one slice follows another
}
CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"


@pytest.mark.parametrize(
    ("members", "more"),
    [("fixed", {}), ("elastic", {}), ("fixed", SLICED), ("fixed", {**SLICED, **HELICAL})],
    ids=["fixed", "elastic", "slices", "helical"],
)
def test_errors_and_supports_of_the_case_are_in_the_deformed_set(members, more):
    changes = {
        "operation.torque": "-60 N m",
        "set.pin_errors": [{"planet": 2, "tangential": "5 um"}],
        "static.members": members,
        "static.positions": 8,
        "static.flank_elements": 6,
        **more,
    }
    case = with_values(read_case(CASE), changes)
    static = solve_static(case)
    gears, order, cycle = _left_flanks_loaded(static, case)
    assert order.tolist() == list(mirrored_set(static.planetary_set)[1])
    start = int(np.argmin(np.abs(static.cycle.position)))
    force = static.cycle.force[:, start]
    assert np.ptp(force[:3]) > 0.05 * force[:3].mean()
    seen = np.concatenate([force[order], force[3 + order]])
    # the cells of a walk fit the largest load of all its positions
    np.testing.assert_allclose(cycle.force[:, 0], seen, rtol=1e-3)
    name = "slice_load" if "static.slices" in more else "tooth_load"
    records = ((cycle, 0), (static.cycle, start))
    image, loads = (getattr(one, name)[..., at].max(axis=1) for one, at in records)
    seen = loads[[*order, *(3 + order)]]
    np.testing.assert_allclose(image, seen, rtol=0.0, atol=1e-3 * seen.max())
    assert gears.planet_angles == mirrored_set(static.planetary_set)[0].planet_angles


def test_bodies_of_a_negative_torque_stand_and_bend_as_those_of_the_set():
    """Every planet at its own pin, most bent where most is carried; teeth of the sun give way to the load."""
    changes = {
        "operation.torque": "-60 N m",
        "static.positions": 8,
        "static.flank_elements": 6,
        "set.pin_errors": [{"planet": 2, "tangential": "5 um"}],
    }
    case = with_values(read_case(CASE), changes)
    static = solve_static(case)
    gears, order, cycle = _left_flanks_loaded(static, case)
    sectors = make_sectors(gears, materials_of(case), flank_elements=4, refine=0.3)
    of_kind = {sector.gear.name: sector for sector in sectors.gears}
    image = deformed_set(gears, sectors, cycle)
    bodies = {body.name: body for body in (_reflected(one, of_kind[one.kind], order) for one in image)}
    names = [f"planet {n + 1}" for n in range(3)]
    pins = static.planetary_set.centre_distance * np.exp(1j * np.array(static.planetary_set.planet_angles))
    centres = np.array([complex(*bodies[name].centre) for name in names])
    np.testing.assert_allclose(centres, pins, atol=1e-12)
    force = static.cycle.force[:3, np.argmin(np.abs(static.cycle.position))]
    bent = [np.abs(bodies[name].displacement).max() for name in names]
    assert np.argsort(bent).tolist() == np.argsort(force).tolist()
    x, y = of_kind["sun"].grid.points.T
    u, v = np.moveaxis(bodies["sun"].displacement, -1, 0)
    assert np.mean((x * v - y * u) / np.hypot(x, y)) > 0.0
