"""Springs between motions: gear meshes with play, bearings with clearance, polynomial laws.

An element acts on groups of columns of ``W`` and gives, for their deflections ``x = W^T q``, the forces
``f(x, t)`` of ``M q'' + C q' + K q + W f = load`` and the tangents ``df/dx``, for all instants at once.
Tangents jump where contacts open or close and where a stiffness steps; `tangent_jumps` finds these instants
of a period. `tabulated_element` is the law of an element at known instants.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, is_dataclass, replace
from typing import Protocol, TypeGuard

import numpy as np

from femgear.errors import CaseError, checked_numbers
from femgear.system.fourier import FourierSeries, Series, StepSeries, constant

# Phases a harmonic at which the sign of a stiffness is looked at, and rounding of its size.
_PHASES, _ROUNDING = 32, 1e-12
# Intervals of a period that are searched, and the share of a change that must be unlike its neighbours'.
_INTERVALS = 512
_UNLIKE = 0.1
# Jumps below this share of the largest tangent do not count.
_SMALL = 1e-9
# Halvings before and after which a change that stays is a jump, and halvings down to rounding.
_FIRST, _SECOND, _LAST = 6, 12, 50
# Times that an interval is searched for one more jump.
_ROUNDS = 4


class Element(Protocol):
    """What a solver asks of an element.

    ``columns`` (g, d) int array: g independent groups of d columns of ``W``. ``reference`` (g, d): a linear
    stiffness [N/m] near which it works. ``evaluate(x, theta)``: from deflections x (..., g, d) [m] and phases
    theta (..., n_bases) [rad], forces (..., g, d) [N] and tangents (..., g, d, d) [N/m].

    Optional: ``degree`` of the law in x, None where it has corners. ``steepest(theta)`` (g, d): largest
    stiffness over phases (n, n_bases), where that is not the reference. ``evaluate_together(x, theta)``, where all
    groups have one set of d columns: the sums over the groups, from x (..., d).
    """

    @property
    def columns(self) -> np.ndarray: ...

    @property
    def reference(self) -> np.ndarray: ...

    def evaluate(self, x, theta) -> tuple[np.ndarray, np.ndarray]: ...


class CorneredElement(Element, Protocol):
    """An element whose law is a sum of positive parts ``max(u, 0)``.

    ``switches(x, theta)``: the arguments u (..., m). ``frozen(x, theta, closed)``: forces (g, d) and tangents
    (g, d, d) of one instant with the parts closed (m,) or open as given, whatever the sign of u.
    """

    def switches(self, x, theta) -> np.ndarray: ...

    def frozen(self, x, theta, closed) -> tuple[np.ndarray, np.ndarray]: ...


def has_corners(element: Element) -> TypeGuard[CorneredElement]:
    """Tell whether an element knows where its law has corners."""
    return hasattr(element, "switches")


def positive_part(x, smoothing: float | np.ndarray = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Compute ``max(x, 0)``, in the unit of x, and its slope [1]: arrays of the shape of x.

    With a smoothing length s, one value or of the shape of x, ``(x + sqrt(x^2 + s^2)) / 2``. The smooth form differs
    by at most s / 2, at the corner (NREL/CP-5000-55355 smooths its contacts so).
    """
    if not np.any(smoothing):
        closed = x > 0.0
        return np.where(closed, x, 0.0), closed.astype(float)
    root = np.sqrt(x * x + np.asarray(smoothing) ** 2)
    return 0.5 * (x + root), 0.5 * (1.0 + x / root)


@dataclass(frozen=True)
class GearMeshes:
    """Gear meshes ``phi(F) - phi(-F - k b)`` with ``F = force + k (x - deflection)`` and ``phi = max(., 0)``.

    The tangent line of a loaded mesh, cut where the drive flanks part and taken up again when the teeth have
    crossed the backlash. With ``separates`` false the line goes on into tension.

    Parameters
    ----------
    columns : (g,) or (g, 1) int array
        Columns of ``W`` whose deflections act on the g meshes.
    stiffness : FourierSeries, StepSeries or SummedSeries
        ``k`` of every mesh [N/m].
    deflection : FourierSeries, StepSeries or SummedSeries, optional
        Deflection of the mesh at the state about which it is linear [m]; zero when not given. With `force`
        zero this is the unloaded transmission error.
    force : FourierSeries, StepSeries or SummedSeries, optional
        Force at that state [N]; zero when not given.
    backlash : (g,) array or float
        Total play along the line of action [m]; infinite when there is no back side.
    smoothing : float
        Length [m] over which contact sets in, see `positive_part`.
    separates : bool
        Whether the flanks part. Teeth that do cannot pull: their stiffness must not be negative anywhere.
    """

    columns: np.ndarray
    stiffness: Series
    deflection: Series | None = None
    force: Series | None = None
    backlash: np.ndarray | float = np.inf
    smoothing: float = 0.0
    separates: bool = True

    def __post_init__(self):
        columns = _columns(self.columns, 1)
        backlash = np.broadcast_to(_numbers(self.backlash, "backlash", "E-BACKLASH"), len(columns)).copy()
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "backlash", backlash)
        for name, series in zip(("deflection", "force"), self.state):
            object.__setattr__(self, name, series)
        _positive("smoothing length", self.smoothing)
        if np.any(np.isnan(backlash)) or np.any(backlash < 0.0):
            raise CaseError(f"backlash of {backlash.min():.4g} m", code="E-BACKLASH", limit="0 m or more, or infinite")
        for name in ("stiffness", "deflection", "force"):
            series = getattr(self, name)
            if not hasattr(series, "mean") or len(np.atleast_1d(series.mean)) != len(columns):
                count = len(np.atleast_1d(series.mean)) if hasattr(series, "mean") else "no"
                raise CaseError(
                    f"{count} series of the mesh {name} for {len(columns)} meshes",
                    code="E-SHAPE",
                    key=name,
                    remedy="give FourierSeries([[mean, ...], ...]) or StepSeries, one row a mesh",
                )
        if self.separates:
            _check_pressing(self.stiffness)

    @property
    def state(self) -> tuple[Series, Series]:
        """Deflection and force of every mesh at the state about which it is linear [m, N]."""
        deflection, force = (
            constant(np.zeros(len(self.columns))) if series is None else series
            for series in (self.deflection, self.force)
        )
        return deflection, force

    @property
    def degree(self) -> int | None:
        """Degree of the law in the deflections; None where flanks part."""
        return None if self.separates else 1

    @property
    def reference(self) -> np.ndarray:
        """Mean mesh stiffness, (g, 1) [N/m]."""
        return self.stiffness.mean[:, None]

    def steepest(self, theta) -> np.ndarray:
        """Find the largest stiffness (g, 1) [N/m] over the phases theta (n, n_bases) [rad]."""
        return self.stiffness.at(theta).max(axis=0)[:, None]

    def flank_forces(self, x, theta):
        """Compute stiffness [N/m], forces of drive and back flanks (..., g) [N], and which have a back side.

        From deflections ``x`` (..., g, 1) [m] at the phases ``theta`` (..., n_bases) [rad]. Drive flanks are closed
        where their force is positive, back flanks where theirs is negative.
        """
        k = self.stiffness.at(theta)
        deflection, force = self.state
        line = force.at(theta) + k * (x[..., 0] - deflection.at(theta))
        has_back = np.isfinite(self.backlash)
        return k, line, line + k * np.where(has_back, self.backlash, 0.0), has_back

    def switches(self, x, theta):
        """Compute the forces (..., m) [N] of drive flanks, then of back flanks where there are some.

        From deflections ``x`` (..., g, 1) [m] at the phases ``theta`` (..., n_bases) [rad].
        """
        if not self.separates or self.smoothing:
            return np.zeros((*x.shape[:-2], 0))
        _, line, behind, has_back = self.flank_forces(x, theta)
        return np.concatenate([line, -behind[..., has_back]], axis=-1)

    def frozen(self, x, theta, closed):
        """Compute forces (g, 1) [N] and tangents (g, 1, 1) [N/m] with the flanks closed (m,) as given."""
        k, line, behind, has_back = self.flank_forces(x, theta)
        drive, back = closed[: len(k)].astype(float), np.zeros(len(k))
        back[has_back] = closed[len(k) :]
        return (line * drive + behind * back)[:, None], (k * (drive + back))[:, None, None]

    def evaluate(self, x, theta):
        """Compute forces (..., g, 1) [N] and tangents (..., g, 1, 1) [N/m], see `Element`."""
        k, line, behind, has_back = self.flank_forces(x, theta)
        if not self.separates:
            return line[..., None], np.broadcast_to(k, line.shape)[..., None, None]
        force, slope = positive_part(line, self.smoothing * k)
        if np.any(has_back):
            back, back_slope = positive_part(-behind, self.smoothing * k)
            force, slope = force - has_back * back, slope + has_back * back_slope
        return force[..., None], (k * slope)[..., None, None]


@dataclass(frozen=True)
class RadialBearings:
    """Bearings with radial clearance: a ring of infinitely many one-sided radial springs.

    ``F(r) = (2 k / pi) [r (p + sin p cos p) - 2 c sin p]``, ``cos p = c / r``,
    beyond the clearance c, zero within (integral of the springs over the loaded arc; for c = 0 it is
    ``k r``).

    Parameters
    ----------
    columns : (g, 2) int array
        x and y of the inner relative to the outer ring.
    stiffness : (g,) array or float
        ``k`` [N/m].
    clearance : (g,) array or float
        Radial, from the centred position [m].
    """

    columns: np.ndarray
    stiffness: np.ndarray | float
    clearance: np.ndarray | float = 0.0

    def __post_init__(self):
        columns = _columns(self.columns, 2)
        object.__setattr__(self, "columns", columns)
        for name in ("stiffness", "clearance"):
            value = np.broadcast_to(_numbers(getattr(self, name), name), len(columns)).copy()
            if not np.all(np.isfinite(value)) or np.any(value < 0.0):
                raise CaseError(f"bearing {name} of {value.min():.4g}", code="E-BEARING", limit="0 or more")
            object.__setattr__(self, name, value)

    @property
    def reference(self) -> np.ndarray:
        """Stiffness without clearance, (g, 2) [N/m]."""
        return np.repeat(np.asarray(self.stiffness)[:, None], 2, axis=1)

    def evaluate(self, x, theta):
        """Compute forces (..., g, 2) [N] and tangents (..., g, 2, 2) [N/m]; the phases do not count."""
        r = np.hypot(x[..., 0], x[..., 1])
        touching = (r > self.clearance) & (r > 0.0)
        safe = np.where(touching, r, 1.0)
        cosine = np.where(touching, self.clearance / safe, 1.0)
        half = np.arccos(cosine)
        sine = np.sqrt(1.0 - cosine * cosine)
        factor = 2.0 * self.stiffness / np.pi
        radial = np.where(touching, factor * (half + sine * cosine), 0.0)
        secant = np.where(touching, radial - 2.0 * factor * cosine * sine, 0.0)
        # at rest in the centre of a bearing without clearance the law is linear
        centred = (self.clearance == 0.0) & ~touching
        radial, secant = np.where(centred, self.stiffness, radial), np.where(centred, self.stiffness, secant)
        unit = x / safe[..., None]
        tangent = (radial - secant)[..., None, None] * unit[..., :, None] * unit[..., None, :]
        return secant[..., None] * x, tangent + secant[..., None, None] * np.eye(2)


@dataclass(frozen=True)
class PolynomialSprings:
    """``f = sum_d coefficients[d - 1] x^d``.

    Parameters
    ----------
    columns : (g,) int array
        Columns of ``W`` whose deflections act on the g springs.
    coefficients : (g, degree) array
        Of x, x^2, x^3, ... [N/m, N/m^2, ...].
    """

    columns: np.ndarray
    coefficients: np.ndarray

    def __post_init__(self):
        columns = _columns(self.columns, 1)
        table = np.atleast_2d(_numbers(self.coefficients, "coefficients"))
        if not np.all(np.isfinite(table)):
            raise CaseError(
                f"coefficients {table.tolist()}", code="E-FINITE", key="coefficients", limit="finite numbers"
            )
        if len(table) != len(columns):
            raise CaseError(
                f"{len(table)} rows of coefficients for {len(columns)} springs",
                code="E-SHAPE",
                limit="one row a spring",
            )
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "coefficients", table)

    @property
    def degree(self) -> int:
        """Degree of the law in the deflections."""
        return self.coefficients.shape[1]

    @property
    def reference(self) -> np.ndarray:
        """Stiffness at rest, (g, 1) [N/m]."""
        return self.coefficients[:, :1]

    def evaluate(self, x, theta):
        """Compute forces (..., g, 1) [N] and tangents (..., g, 1, 1) [N/m], see `Element`."""
        x = x[..., 0]
        force: np.ndarray = np.zeros_like(x)
        slope: np.ndarray = np.zeros_like(x)
        for coefficient in self.coefficients.T[::-1]:
            slope = slope * x + force + coefficient
            force = (force + coefficient) * x
        return force[..., None], slope[..., None, None]


def turning_wave(orders: tuple[int, ...], *, phase: float = 0.0) -> FourierSeries:
    """Make the cosine and sine of ``phi = phase + orders . theta`` as two coefficients.

    ``orders`` are multiples of the base frequencies, negative for a frame that turns clockwise; ``phase`` is
    phi at time zero [rad].
    """
    if not math.isfinite(phase):
        raise CaseError(f"a phase of {phase} rad", code="E-RANGE", key="phase", limit="finite")
    turned = np.exp(1j * phase)
    return FourierSeries(np.array([[0.0, turned], [0.0, -1j * turned]]), orders)


def coefficients_of(element: Element) -> dict[str, Series]:
    """Collect the coefficients of an element that repeat with the phases, by the names of its fields."""
    return {
        name: series for name, series in vars(element).items() if hasattr(series, "at") and hasattr(series, "orders")
    }


def with_coefficients(element: Element, change: Callable[[Series], object]) -> Element:
    """Make an element with its periodic coefficients as ``change`` makes them."""
    changed = {name: change(series) for name, series in coefficients_of(element).items()}
    return replace(element, **changed) if changed and is_dataclass(element) else element


def tangent_jumps(tangents: Callable[..., np.ndarray], states: np.ndarray) -> list[np.ndarray]:
    """Find the fractions of the period at which the tangents of states jump.

    Tangents at 512 equidistant instants; an interval whose change is unlike the mean of its neighbours' is
    halved towards the larger change. A smooth change shrinks with the interval, a jump stays; what lies on
    either side of one is searched in the same way, four times in all. Not seen are jumps below a tenth of the
    smooth change over an interval or 1e-9 of the largest tangent, jumps that undo each other within one
    interval, and the inner ones of three or more equal jumps in neighbouring intervals.

    Parameters
    ----------
    tangents : callable
        ``(fraction (k, s), states (k,)) -> (k, s, n, n)`` [N/m] of any of the states, each with fractions of
        its own, periodic in the fraction.
    states : (m,) int array
        Numbers by which ``tangents`` knows the states.

    Returns
    -------
    list of (n_jumps,) arrays
        Fractions of every state, ascending between 0 and 1; jumps within 1e-13 of these ends are left out.
    """
    states = np.asarray(states)
    nodes = (np.arange(-1, _INTERVALS + 3) - 0.5) / _INTERVALS
    # one interval more on both sides, for the neighbours
    at_nodes = tangents(np.broadcast_to(nodes[1:-2], (len(states), _INTERVALS + 1)), states)
    size = np.abs(at_nodes).max(axis=(1, 2, 3), initial=0.0)
    change = np.diff(at_nodes, axis=1)
    around = 0.5 * (np.roll(change, 1, axis=1) + np.roll(change, -1, axis=1))
    unlike, change = (np.abs(a).max(axis=(2, 3), initial=0.0) for a in (change - around, change))
    suspect = (unlike > _UNLIKE * change) & (change > _SMALL * size[:, None])
    row: np.ndarray
    row, column = np.nonzero(suspect)
    jumps = [[] for _ in states]
    low: np.ndarray = nodes[1:-2][column]
    high: np.ndarray = nodes[2:-1][column]
    for _ in range(_ROUNDS):
        row, low, high, where = _halved(tangents, states, size, row, low, high)
        if not len(row):
            break
        for i, fraction in zip(row, where % 1.0):
            jumps[i].append(fraction)
        gap = 4.0 * np.finfo(float).eps
        low, high = np.concatenate([low, where + gap]), np.concatenate([where - gap, high])
        row = np.concatenate([row, row])
    return [_sorted(fractions) for fractions in jumps]


def _halved(tangents, states, size, row, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, ...]:
    """Jumps in intervals (k,) of the rows: rows, ends and places of those that hold one."""
    a, b, before = low, high, np.full(len(row), np.inf)
    for level in range(_LAST):
        if not len(row):
            break
        middle = 0.5 * (a + b)
        values = tangents(np.stack([a, middle, b], axis=1), states[row])
        change = np.abs(np.diff(values, axis=1)).max(axis=(2, 3))
        left = change[:, 0] >= change[:, 1]
        a, b = np.where(left, a, middle), np.where(left, middle, b)
        change = change.max(axis=1)
        if level == _FIRST:
            before = change
        if level == _SECOND:
            keep = (change > 0.5 * before) & (change > _SMALL * size[row])
            row, low, high, a, b = (array[keep] for array in (row, low, high, a, b))
    return row, low, high, b


def _sorted(fractions) -> np.ndarray:
    """Ascending fractions, those at the ends of the period and double ones left out."""
    values = np.sort(np.asarray(fractions, float))
    values = values[(values > 1e-13) & (values < 1.0 - 1e-13)]
    return values[np.diff(values, prepend=-1.0) > 1e-13]


def tabulated_element(element: Element, theta: np.ndarray) -> Callable:
    """Tabulate the law of an element on single columns at instants with phases (n_times, n_bases) [rad].

    The result is ``law(i, x (g,) [m]) -> (forces (g,) [N], slopes (g,) [N/m])`` at instant i.
    """
    if type(element) is GearMeshes:
        return _mesh_law(element, theta)

    def general(i, x):
        force, slope = element.evaluate(x[:, None], theta[i])
        return force[:, 0], slope[:, 0, 0]

    return general


def _mesh_law(element: GearMeshes, theta) -> Callable:
    """``GearMeshes.evaluate`` with its series tabulated."""
    k = np.array(element.stiffness.at(theta))
    deflection, force = element.state
    offset = force.at(theta) - k * deflection.at(theta)
    if not element.separates:
        return lambda i, x: (offset[i] + k[i] * x, k[i])
    has_back = np.isfinite(element.backlash)
    play = k * np.where(has_back, element.backlash, 0.0)
    play[:, ~has_back] = np.inf
    if element.smoothing:
        return _smooth_mesh_law(k, offset, play, element.smoothing)
    if not np.any(has_back):

        def drive(i, x):
            stiffness = k[i]
            line = offset[i] + stiffness * x
            closed = line > 0.0
            return line * closed, stiffness * closed

        return drive

    def both(i, x):
        stiffness = k[i]
        line = offset[i] + stiffness * x
        behind = line + play[i]
        drive, back = line > 0.0, behind < 0.0
        return np.maximum(line, 0.0) + np.minimum(behind, 0.0), stiffness * (drive | back)

    return both


def _smooth_mesh_law(k, offset, play, smoothing) -> Callable:
    length, finite = smoothing * k, np.isfinite(play[0])
    gap = np.where(finite, play, 0.0)

    def smooth(i, x):
        line = offset[i] + k[i] * x
        force, slope = positive_part(line, length[i])
        back, back_slope = positive_part(-line - gap[i], length[i])
        return force - finite * back, k[i] * (slope + finite * back_slope)

    return smooth


def _check_pressing(stiffness) -> None:
    """Refuse a stiffness of parting teeth that is negative somewhere in its period."""
    if isinstance(stiffness, StepSeries):
        values, turn = stiffness.values, stiffness.breaks
    elif isinstance(stiffness, FourierSeries):
        count = stiffness.amplitudes.shape[1]
        turn = np.arange(_PHASES * count) / (_PHASES * count)
        wave = np.exp(2j * np.pi * turn[:, None] * np.arange(count))
        values = (stiffness.amplitudes @ wave.T).real
    else:
        return  # values on a grid, of a series that has been checked
    lowest = values.min(axis=1)
    mesh = int(np.argmin(lowest))
    if not lowest[mesh] >= -_ROUNDING * np.abs(values[mesh]).max():
        instant = float(turn[np.argmin(values[mesh])])
        raise CaseError(
            f"the stiffness of mesh {mesh + 1} is {lowest[mesh]:.4g} N/m at {instant:.4g} of its period, and "
            "its teeth part",
            code="E-STIFFNESS",
            key="stiffness",
            value=float(lowest[mesh]),
            limit="0 N/m or more at every instant",
            remedy="lower the fluctuation or keep other harmonics of k(t), or take separates=False for a "
            "line that may pull",
        )


def _columns(columns, width: int) -> np.ndarray:
    """Columns as a (g, width) integer array."""
    array = np.array(columns)
    array = array.reshape(-1, width) if array.ndim < 2 else array
    if array.shape[1] != width or not np.issubdtype(array.dtype, np.integer) or np.any(array < 0):
        raise CaseError(f"columns {array.tolist()}", code="E-SHAPE", limit=f"groups of {width} column numbers of W")
    array.setflags(write=False)
    return array


def _numbers(value, key: str, code: str = "E-SHAPE") -> np.ndarray:
    """A copy of the numbers, without text."""
    return checked_numbers(value, key, code=code, unit="").copy()


def _positive(name: str, value: float) -> None:
    length = _numbers(value, name, "E-RANGE")
    if not (np.isfinite(length) and length >= 0.0):
        raise CaseError(f"{name} of {length} m", code="E-RANGE", limit="0 m or more")
