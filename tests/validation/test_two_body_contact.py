"""One tooth pair of the reference set against a two-body finite-element contact; checks of that contact."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import ContactError
from femgear.fe.elasticity import Material
from validation import two_body
from validation.mapped import mapped_grid
from validation.mortar import boundary_dofs, make_surface, mortar_contact
from validation.planetary import reference_set

pytestmark = pytest.mark.decisive

STEEL = Material(206e9, 0.3, 7850.0)


@pytest.fixture(scope="module")
def bodies():
    return two_body.flank_bodies()


def block(low, high, columns, bottom, *, held, boundary):
    """Surface of a block of unit width between two heights, its sides free to slide up and down."""
    grid = mapped_grid(lambda u, v: (u, low + (high - low) * v), columns, 2)
    dofs = [boundary_dofs(grid, "u=0")[0::2], boundary_dofs(grid, "u=1")[0::2]]
    dofs.append(boundary_dofs(grid, held))
    return make_surface(grid, STEEL, boundary, held=np.unique(np.concatenate(dofs)), centre=(0.0, bottom))


def test_two_blocks_with_different_grids_transmit_a_uniform_pressure():
    """Uniaxial strain: p = F / width, approach p (h_1 + h_2) / (lambda + 2 mu)."""
    lower = block(0.0, 0.3, 5, 0.0, held="v=0", boundary="v=1")
    upper = block(0.3, 0.8, 8, 0.0, held="v=1", boundary="v=0")
    # a centre far away makes the turn a translation
    far = 1e9
    approach, _, pressure = mortar_contact(lower, upper, (0, 4), 1e6, centre=far, base_radius=far)
    lam, mu = STEEL.lame("plane strain")
    assert pressure == pytest.approx(np.full(6, 1e6), rel=1e-7)
    assert approach == pytest.approx(1e6 * 0.8 / (lam + 2 * mu), rel=1e-7)


def test_an_initial_separation_adds_to_the_approach():
    lower = block(0.0, 0.3, 3, 0.0, held="v=0", boundary="v=1")
    gap, far = 1e-6, 1e9
    results = []
    for lift in (0.0, gap):
        upper = block(0.3, 0.8, 4, lift, held="v=1", boundary="v=0")
        results.append(mortar_contact(lower, upper, (0, 2), 1e6, centre=far, base_radius=far)[0])
    assert results[1] - results[0] == pytest.approx(gap, rel=1e-6)


def test_contact_beyond_the_edges_that_may_touch_is_refused():
    lower = block(0.0, 0.3, 6, 0.0, held="v=0", boundary="v=1")
    upper = block(0.3, 0.8, 6, 0.0, held="v=1", boundary="v=0")
    with pytest.raises(ContactError) as error:
        mortar_contact(lower, upper, (1, 4), 1e6, centre=1e9, base_radius=1e9)
    assert error.value.code == "E-CONTACT"


def test_bodies_without_overlap_are_refused():
    lower = block(0.0, 0.3, 6, 0.0, held="v=0", boundary="v=1")
    upper = block(0.3, 0.8, 6, 0.0, held="v=1", boundary="v=0")
    upper = replace(upper, points=upper.points + np.array([0.5, 0.0]))
    with pytest.raises(ContactError) as error:
        mortar_contact(lower, upper, (0, 5), 1e6, centre=1e9, base_radius=1e9)
    assert error.value.code == "E-SHAPE"


@pytest.mark.parametrize(
    "fraction", [pytest.param(-16 / 64, marks=pytest.mark.slow), pytest.param(0.0, marks=pytest.mark.slow), 24 / 64]
)
def test_tooth_pair_on_coarse_grids(bodies, fraction):
    """Two bodies with element edges of a tenth of the contact's half width: 0.1 % in the approach."""
    ours, two = two_body.femgear_contact(bodies, fraction), two_body.two_body_contact(fraction)
    hertz = two_body.hertz_of(fraction)
    assert ours.approach == pytest.approx(two.approach, rel=2e-3)
    assert ours.peak_pressure == pytest.approx(two.peak_pressure, rel=5e-3)
    assert ours.half_width == pytest.approx(two.half_width, rel=1e-2)
    assert two.peak_pressure == pytest.approx(hertz.peak_pressure, rel=5e-3)
    assert two.half_width == pytest.approx(hertz.half_width, rel=1e-2)


def test_the_line_load_is_that_of_the_reference_set():
    s = reference_set()
    force = 100.0 / s.sun.base_radius / s.n_planets
    assert two_body.LINE_LOAD * s.sun.face_width == pytest.approx(force, rel=2e-3)


def test_half_width_of_a_semi_ellipse():
    a, peak = 6e-5, 7e8
    x = np.linspace(-a, a, 100001)
    pressure = peak * np.sqrt(1 - (x / a) ** 2)
    width = two_body.equal_half_width(np.trapezoid(pressure, x), np.trapezoid(pressure**2, x))
    assert width == pytest.approx(a, rel=1e-6)


@pytest.mark.slow
def test_tooth_pairs_with_converged_grids():
    rows = two_body.tooth_pairs()
    approaches = [row for row in rows if row.quantity.endswith("approach [um]")]
    assert len(approaches) == 3
    assert max(abs(row.error) for row in approaches) < 1e-3
    assert all(row.verdict in ("passes", "information") for row in rows)


@pytest.mark.slow
def test_contact_at_the_tip_corner_stays_close():
    rows = two_body.tip_contact()
    assert [abs(row.error) < limit for row, limit in zip(rows, (3e-3, 1e-2))] == [True, True]
