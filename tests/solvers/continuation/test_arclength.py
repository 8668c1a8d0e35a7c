import numpy as np
import pytest

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.continuation.arclength import continue_curve
from femgear.solvers.continuation.corrector import StepOptions
from validation.reference.branch_switching import switch_branch


def circle(u, p):
    return np.array([u[0] ** 2 + p * p - 1.0]), np.array([[2.0 * u[0]]]), np.array([2.0 * p])


def pitchfork(u, p):
    return p * u - u**3, np.array([[p - 3.0 * u[0] ** 2]]), u.copy()


def test_closed_loop_with_its_limit_points():
    found = continue_curve(circle, [1.0], 0.0, limits=(-2.0, 2.0), unit=1.0)
    assert found.closed and found.complete and found.message == "closed loop"
    np.testing.assert_allclose(found.parameter[found.folds], [1.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(found.points[found.folds], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.points[:, 0] ** 2 + found.parameter**2, 1.0, atol=1e-12)
    angle = np.unwrap(np.arctan2(found.parameter, found.points[:, 0]))
    assert np.all(np.diff(angle) > 0.0)
    assert angle[-1] - angle[0] == pytest.approx(2.0 * np.pi, abs=1e-9)


@pytest.mark.parametrize("direction, end", [(1, 0.9), (-1, -0.3)])
def test_ends_of_the_range_are_hit_exactly(direction, end):
    asked = []

    def watched(u, p):
        asked.append(p)
        return circle(u, p)

    found = continue_curve(watched, [1.0], 0.0, limits=(-0.3, 0.9), direction=direction)
    assert found.parameter[-1] == end and found.complete and not found.closed
    assert found.points[-1, 0] == pytest.approx(np.sqrt(1.0 - end**2), abs=1e-14)
    assert min(asked) >= -0.3 - 1e-15 and max(asked) <= 0.9 + 1e-15


@pytest.mark.parametrize("largest", [0.1, 1.0])
@pytest.mark.parametrize("short", [1e-10, 1e-12])
def test_range_that_ends_just_before_a_limit_point(short, largest):
    """The step passes both: the curve ends at the bound, not at the limit point beyond."""
    end = 1.0 - short
    options = StepOptions(first=largest, largest=largest)
    found = continue_curve(circle, [1.0], 0.0, limits=(-0.3, end), options=options)
    assert found.parameter[-1] == found.parameter.max() == end and found.complete and not len(found.folds)
    assert found.points[-1, 0] == pytest.approx(np.sqrt(1.0 - end**2), rel=1e-4)


def test_curve_that_starts_at_the_bound_and_leaves_at_once():
    found = continue_curve(circle, [np.sqrt(0.19)], 0.9, limits=(0.0, 0.9), direction=1)
    assert found.complete and found.parameter.tolist() == [0.9, 0.9]
    np.testing.assert_allclose(found.points[:, 0], np.sqrt(0.19), rtol=1e-15)


def test_limit_load_of_the_von_mises_truss_is_passed():
    half_span, height, stiffness = 1.0, 0.1, 1.0
    rest = np.hypot(half_span, height)

    def truss(v, load):
        rise = height - v[0]
        length = np.hypot(half_span, rise)
        force = 2.0 * stiffness * (1.0 / length - 1.0 / rest) * rise
        slope = -2.0 * stiffness * (1.0 / length - 1.0 / rest - rise**2 / length**3)
        return np.array([force - load]), np.array([[slope]]), np.array([-1.0])

    found = continue_curve(truss, [0.0], 0.0, limits=(-1e-3, 1e-3), scale=0.1)
    first, second = found.folds
    snap = height - np.sqrt(rest ** (2.0 / 3.0) - 1.0)
    assert found.parameter[first] == pytest.approx(3.81087190e-4, rel=3e-9)
    assert found.points[first, 0] == pytest.approx(snap, rel=1e-9)
    assert found.points[first, 0] == pytest.approx(0.0423607465, rel=3e-9)
    assert found.parameter[second] == pytest.approx(-found.parameter[first], rel=1e-12)
    assert found.parameter[-1] == 1e-3 and found.points[-1, 0] > 2.0 * height


def test_pitchfork_and_both_sides_of_the_other_branch():
    known = continue_curve(pitchfork, [0.0], -1.0, limits=(-1.0, 1.0))
    assert len(known.branch_points) == 1 and not len(known.folds)
    assert known.parameter[known.branch_points[0]] == pytest.approx(0.0, abs=1e-9)
    assert known.parameter[-1] == 1.0 and not np.any(known.points)
    up, down = switch_branch(pitchfork, known, known.branch_points[0], limits=(-1.0, 1.0))
    assert sorted([up.points[-1, 0], down.points[-1, 0]]) == pytest.approx([-1.0, 1.0], abs=1e-12)
    for side in (up, down):
        assert side.complete and not len(side.branch_points)
        np.testing.assert_allclose(side.points[:, 0] ** 2, side.parameter, atol=1e-12)


def test_transcritical_crossing_of_two_curved_branches():
    def crossing(u, p):
        a, b = u[0] - p, u[0] + 2.0 * p + p * p
        return np.array([a * b]), np.array([[a + b]]), np.array([-b + a * (2.0 + 2.0 * p)])

    known = continue_curve(crossing, [-1.0], -1.0, limits=(-1.0, 1.0))
    np.testing.assert_allclose(known.points[:, 0], known.parameter, atol=1e-9)
    index = known.branch_points[0]
    assert known.parameter[index] == pytest.approx(0.0, abs=1e-9)
    ends = {
        side.parameter[-1]: side.points[-1, 0] for side in switch_branch(crossing, known, index, limits=(-1.0, 1.0))
    }
    assert ends == pytest.approx({-1.0: 1.0, 1.0: -3.0}, abs=1e-10)


@pytest.mark.parametrize("gap", [1e-1, 1e-2, 1e-3])
@pytest.mark.parametrize("count", [2, 3])
def test_close_curves_are_never_spliced(gap, count):
    # two or three parallel curves: the tangents agree, only the distance tells them apart
    def parallel(u, p):
        d = u[0] - np.sin(6.0 * p)
        if count == 2:
            value, slope = d * d - gap**2, 2.0 * d
        else:
            value, slope = d * (d * d - gap**2), 3.0 * d * d - gap**2
        return np.array([value]), np.array([[slope]]), np.array([-slope * 6.0 * np.cos(6.0 * p)])

    found = continue_curve(parallel, [gap], 0.0, limits=(0.0, 1.0))
    assert found.complete
    np.testing.assert_allclose(found.points[:, 0] - np.sin(6.0 * found.parameter), gap, rtol=1e-6)


GAPS = (0.1, 0.07, 0.05, 0.04, 0.03, 0.02, 0.01, 0.005, 0.002)


def family(gap, rate=6.0):
    """Curves ``sin(rate p) + k gap``: Newton's method reaches one from everywhere, every second one alike."""

    def curves(u, p):
        d = np.pi * (u[0] - np.sin(rate * p)) / gap
        slope = np.cos(d) * np.pi / gap
        return np.array([np.sin(d)]), np.array([[slope]]), np.array([-slope * rate * np.cos(rate * p)])

    return curves


@pytest.mark.parametrize(
    "largest", [pytest.param(0.1, marks=pytest.mark.slow), pytest.param(0.3, marks=pytest.mark.slow), 1.0]
)
@pytest.mark.parametrize("gap", GAPS)
def test_endless_family_of_curves_with_large_steps(gap, largest):
    options = StepOptions(first=largest, largest=largest)
    found = continue_curve(family(gap), [0.0], 0.0, limits=(0.0, 1.0), options=options)
    assert found.complete or "lost after" in found.message
    np.testing.assert_allclose(found.points[:, 0], np.sin(6.0 * found.parameter), atol=1e-9)


@pytest.mark.parametrize("largest", [0.1, 1.0])
@pytest.mark.parametrize("gap", [0.05, 0.005, 0.002])
def test_curves_on_close_sheets_in_two_unknowns(gap, largest):
    """Sheets ``u_1 = sin 6p + k gap``, crossed by the surface ``u_2 = cos 4p + u_1^2 - sin^2 6p``."""

    def sheets(u, p):
        s, c = np.sin(6.0 * p), np.cos(6.0 * p)
        d = np.pi * (u[0] - s) / gap
        slope = np.cos(d) * np.pi / gap
        value = np.array([np.sin(d), u[1] - np.cos(4.0 * p) - u[0] ** 2 + s**2])
        jacobian = np.array([[slope, 0.0], [-2.0 * u[0], 1.0]])
        return value, jacobian, np.array([-6.0 * slope * c, 4.0 * np.sin(4.0 * p) + 12.0 * s * c])

    options = StepOptions(first=largest, largest=largest)
    found = continue_curve(sheets, [0.0, 1.0], 0.0, limits=(0.0, 1.0), options=options)
    assert found.complete or "lost after" in found.message
    right = np.column_stack([np.sin(6.0 * found.parameter), np.cos(4.0 * found.parameter)])
    np.testing.assert_allclose(found.points, right, atol=1e-9)


NEAR = {
    2.331e-05: (
        (-1.7957, 0.1023, 0.2172, -0.4162),
        (1.34, 4.8189, 2.2051, 5.3404),
        (1.653, 3.3059, 5.7854, 9.0913),
        (5.369, 0.005876),
    ),
    8.134e-05: (
        (-0.017, -0.1127, -0.095, -0.1623),
        (4.8036, 2.8172, 0.1337, 2.1858),
        (2.9171, 5.8342, 10.2098, 16.044),
        (4.86, 0.01776),
    ),
}


@pytest.mark.parametrize("aims", [{}, {"angle": 0.5, "contraction": 0.25}])
@pytest.mark.parametrize("gap", NEAR)
def test_long_largest_steps_leave_short_ones_checked(gap, aims):
    """Two of 240 random families ``u = sum a sin(w p + phase) + k gap`` that need far shorter steps."""
    a, phase, w, (largest, first) = (np.array(part) for part in NEAR[gap])

    def middle(p):
        return np.sum(a * np.sin(w * p + phase))

    def curves(u, p):
        d = np.pi * (u[0] - middle(p)) / gap
        slope = np.cos(d) * np.pi / gap
        return (
            np.array([np.sin(d)]),
            np.array([[slope]]),
            np.array([-slope * np.sum(a * w * np.cos(w * p + phase))]),
        )

    options = StepOptions(first=first, largest=largest, max_points=80, **aims)
    found = continue_curve(curves, [middle(0.0)], 0.0, limits=(0.0, 1.0), options=options)
    away = found.points[:, 0] - [middle(p) for p in found.parameter]
    assert len(found.parameter) == 80 and np.abs(away).max() < 1e-6 * gap


def test_detour_between_two_points_is_not_passed_over():
    """A rise much narrower than the step; the prediction beyond it is exactly on another curve."""
    height = np.tanh(8.0)
    gap = height / 700.0

    def rising(u, p):
        d = np.pi * (u[0] - np.tanh(8.0 * (p - 1.0))) / gap
        slope = np.cos(d) * np.pi / gap
        rise = 8.0 / np.cosh(8.0 * (p - 1.0)) ** 2
        return np.array([np.sin(d)]), np.array([[slope]]), np.array([-slope * rise])

    options = StepOptions(first=1.2, largest=1.2)
    found = continue_curve(rising, [-height], 0.0, limits=(0.0, 2.0), options=options)
    assert found.complete
    np.testing.assert_allclose(found.points[:, 0], np.tanh(8.0 * (found.parameter - 1.0)), atol=1e-9)


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_imperfect_pitchfork_keeps_its_branch(gap):
    def imperfect(u, p):
        return p * u - u**3 + gap, np.array([[p - 3.0 * u[0] ** 2]]), u.copy()

    start = np.roots([-1.0, 0.0, -1.0, gap])
    start = start[np.abs(start.imag) < 1e-9].real
    found = continue_curve(imperfect, start, -1.0, limits=(-1.0, 1.0))
    assert found.complete and not len(found.branch_points) and not len(found.folds)
    assert found.points[-1, 0] == pytest.approx(np.roots([-1.0, 0.0, 1.0, gap]).real.max(), abs=1e-9)


def test_close_pair_of_limit_points_in_one_step():
    # u^3 - d u = p has limit points at u = -+sqrt(d / 3), here much nearer than a step
    d = 1e-3

    def cubic(u, p):
        return u**3 - d * u - p, np.array([[3.0 * u[0] ** 2 - d]]), np.array([-1.0])

    found = continue_curve(cubic, [-1.0], -1.0 + d, limits=(-1.0, 1.0), options=StepOptions(largest=0.5))
    root = np.sqrt(d / 3.0)
    np.testing.assert_allclose(found.points[found.folds, 0], [-root, root], rtol=1e-8)
    np.testing.assert_allclose(found.parameter[found.folds], [2 * root**3, -2 * root**3], atol=1e-12)


def test_lost_branch_tells_where_and_why():
    def ending(u, p):
        if p > 0.5:
            raise ConvergenceError("nothing there", code="E-NOTHING")
        return u - p, np.eye(1), -np.ones(1)

    found = continue_curve(ending, [0.0], 0.0, limits=(0.0, 1.0))
    assert not found.complete and not found.closed
    assert found.parameter[-1] == pytest.approx(0.5, abs=1e-6) and found.parameter[-1] <= 0.5
    assert "lost after parameter = 0.49999" in found.message or "lost after parameter = 0.5" in found.message
    assert "nothing there" in found.message


def test_number_of_points_is_limited_and_said():
    found = continue_curve(circle, [1.0], 0.0, limits=(-2.0, 2.0), options=StepOptions(max_points=5))
    assert not found.complete and "max_points" in found.message and len(found.parameter) == 5


def test_refusals():
    with pytest.raises(CaseError, match="E-RANGE"):
        continue_curve(circle, [1.0], 0.0, limits=(-1.0, 1.0), scale=0.0)
    with pytest.raises(CaseError, match="E-RANGE"):
        StepOptions(smallest=1.0)
    with pytest.raises(ConvergenceError, match="E-START"):
        continue_curve(circle, [0.5], 1.5, limits=(-2.0, 2.0))
    known = continue_curve(circle, [1.0], 0.0, limits=(-2.0, 2.0))
    with pytest.raises(CaseError, match="E-CONVERGENCE"):
        switch_branch(circle, known, 3, limits=(-2.0, 2.0))
