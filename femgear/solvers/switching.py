"""Contact changes: elements that are piecewise linear, with the pieces that hold taken as given.

Such an element is a sum of positive parts ``max(u, 0)`` of switches u, linear in its deflections. Frozen,
each part is u where it is closed and zero where it is open, whatever the sign of u: smooth across the change.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.elements import Element, GearMeshes, PiecewiseSprings, RadialBearings
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.series import FourierSeries, StepSeries, constant, phase_of


@dataclass(frozen=True)
class SharpMeshes:
    """Separating gear meshes without smoothing; ``k``, deflection and force come from one series, (3, g)."""

    columns: np.ndarray
    coefficients: Callable[[np.ndarray], np.ndarray]
    backlash: np.ndarray
    has_back: np.ndarray

    def _sides(self, x, theta):
        k, deflection, force = self.coefficients(theta)
        line = force + k * (x[..., 0] - deflection)
        return k, line, line + k * self.backlash

    def evaluate(self, x, theta):
        """As `GearMeshes.evaluate`."""
        k, line, behind = self._sides(x, theta)
        back = (behind < 0.0) & self.has_back
        force = np.maximum(line, 0.0) + np.where(back, behind, 0.0)
        return force[..., None], (k * ((line > 0.0) | back))[..., None, None]

    def switches(self, x, theta):
        """Drive flanks (g), then back flanks where there are some."""
        _, line, behind = self._sides(x, theta)
        return np.concatenate([line, -behind[..., self.has_back]], axis=-1)

    def frozen(self, x, theta, closed):
        """Forces (g, 1) and tangents (g, 1, 1) with the flanks closed as given."""
        k, line, behind = self._sides(x, theta)
        drive, back = closed[: len(k)].astype(float), np.zeros(len(k))
        back[self.has_back] = closed[len(k) :]
        return (line * drive + behind * back)[:, None], (k * (drive + back))[:, None, None]


def sharp(elements) -> tuple[Element, ...]:
    """The elements with their meshes as `SharpMeshes` where those say the same."""
    return tuple(
        SharpMeshes(
            e.columns, _coefficients(e), np.where(np.isfinite(e.backlash), e.backlash, 0.0),
            np.isfinite(e.backlash),
        )
        if type(e) is GearMeshes and e.separates and not e.smoothing
        else e
        for e in elements
    )  # fmt: skip


def _coefficients(element: GearMeshes):
    """A function of the phases (..., n_bases): ``k``, deflection and force (3, ..., g)."""
    series = element.stiffness, element.deflection, element.force
    changing = {s.orders for s in series if not (isinstance(s, FourierSeries) and s.amplitudes.shape[1] == 1)}
    if len(changing) > 1 or not all(isinstance(s, FourierSeries) for s in series):
        return lambda theta: np.stack(np.broadcast_arrays(*(s.at(theta) for s in series)))
    count, groups = max(s.amplitudes.shape[1] for s in series), len(element.columns)
    table = np.zeros((3, groups, count), complex)
    for row, s in zip(table, series):
        row[:, : s.amplitudes.shape[1]] = s.amplitudes
    means = np.ascontiguousarray(table[..., 0].real)
    if not changing:
        return lambda theta: means.reshape(3, *[1] * (np.ndim(theta) - 1), groups)
    orders, table, harmonic = changing.pop(), table.reshape(3 * groups, count).T, 1j * np.arange(count)

    def at(theta):
        wave = np.exp(np.asarray(phase_of(theta, orders))[..., None] * harmonic)
        values = (wave @ table).real.reshape(*wave.shape[:-1], 3, groups)
        return values if values.ndim == 2 else np.moveaxis(values, -2, 0)

    return at


def switches(element: Element, x, theta) -> np.ndarray:
    """Arguments (..., m) of the positive parts of an element, zero of them for a smooth one.

    Parameters
    ----------
    element : Element
    x : (..., g, d) array
    theta : (..., n_bases) array
    """
    x = np.asarray(x, float)
    if isinstance(element, SharpMeshes):
        return element.switches(x, theta)
    if isinstance(element, PiecewiseSprings) and not element.smoothing:
        return (x - element.breaks).reshape(*x.shape[:-2], -1)
    if isinstance(element, RadialBearings) and element.springs is not None and not element.smoothing:
        return (x @ element.directions.T - element.clearance[:, None]).reshape(*x.shape[:-2], -1)
    return np.zeros((*x.shape[:-2], 0))


def frozen(element: Element, x, theta, closed) -> tuple[np.ndarray, np.ndarray]:
    """Forces (g, d) and tangents (g, d, d) of an element whose switches are closed as given, one instant."""
    if not len(closed):
        return element.evaluate(x, theta)
    if isinstance(element, SharpMeshes):
        return element.frozen(x, theta, closed)
    groups = len(element.columns)
    closed = closed.reshape(groups, -1)
    if isinstance(element, PiecewiseSprings):
        change = np.diff(element.slopes)
        rest = np.maximum(-element.breaks, 0.0) @ change
        force = element.slopes[0] * x[:, 0] + ((x - element.breaks) * closed) @ change - rest
        return force[:, None], (element.slopes[0] + closed @ change)[:, None, None]
    each = (4.0 * element.stiffness / element.springs)[:, None] * closed
    stretch = x @ element.directions.T - element.clearance[:, None]
    tangents = np.einsum("gs,si,sj->gij", each, element.directions, element.directions)
    return (each * stretch) @ element.directions, tangents


@dataclass(frozen=True)
class Contacts:
    """Elements of a problem with the contact state between two changes.

    ``closed``: one bool array an element, or None, when the elements are evaluated as they are.
    """

    elements: tuple[Element, ...]
    columns: int
    closed: tuple[np.ndarray, ...] | None = None

    def forces(self, x, theta):
        """Forces (n_c,) and tangents (n_c, n_c) of one instant."""
        total, tangent = np.zeros(self.columns), np.zeros((self.columns, self.columns))
        for number, element in enumerate(self.elements):
            own = x[element.columns]
            if self.closed is None:
                force, slope = element.evaluate(own, theta)
            else:
                force, slope = frozen(element, own, theta, self.closed[number])
            if element.columns.shape[1] == 1:
                np.add.at(total, element.columns, force)
                np.add.at(tangent, (element.columns[:, 0], element.columns[:, 0]), slope[:, 0, 0])
                continue
            for columns, f, t in zip(element.columns, force, slope):
                total[columns] += f
                tangent[columns[:, None], columns] += t
        return total, tangent

    def gaps(self, x, theta) -> np.ndarray:
        """All switches (..., m) at deflections x (..., n_c), positive where they are on their side.

        Closed switches are ``u``, open ones ``-u``: a negative value says that the state has to change.
        """
        sides = [switches(e, x[..., e.columns], theta) for e in self.elements]
        return np.concatenate(sides, axis=-1) * np.where(np.concatenate(self.closed), 1.0, -1.0)

    def flipped(self, which) -> Contacts:
        """With the switches ``which`` (m,) bool changed."""
        state = np.concatenate(self.closed) ^ which
        parts = np.split(state, np.cumsum([len(c) for c in self.closed])[:-1])
        return replace(self, closed=tuple(parts))


def contacts(problem: NonlinearSystem, x, theta, rate, *, events: bool) -> Contacts:
    """Contact state at deflections x (n_c,) and phases theta (n_bases,), tending as the rate of x.

    A switch at zero within rounding is closed when its deflection rate opens the next instant so.
    """
    elements, columns = sharp(problem.elements), problem.system.W.shape[1]
    if not events:
        return Contacts(elements, columns)
    size = np.abs(x).max(initial=0.0)
    ahead = x + 1e-9 * (size or 1.0) * rate / (np.abs(rate).max(initial=0.0) or 1.0)
    closed = tuple(switches(e, ahead[e.columns], theta) > 0.0 for e in elements)
    return Contacts(elements, columns, closed)


def stepped(problem: NonlinearSystem, frequency) -> list[tuple[np.ndarray, float]]:
    """Breaks (fractions) and repetition rate [1/s] of every step series of the elements."""
    found = []
    for element in problem.elements:
        for field in fields(element):
            series = getattr(element, field.name)
            if isinstance(series, StepSeries) and len(series.breaks) > 1:
                rate = float(phase_of(frequency, series.orders)) / (2.0 * np.pi)
                if rate < 0.0:
                    raise CaseError("a step series runs backwards", code="E-FREQUENCY", limit="rates above 0")
                if rate:
                    found.append((series.breaks, rate))
    return found


def next_break(steps, time: float) -> float:
    """First instant after ``time`` at which a step series changes; infinite when none does."""
    best = np.inf
    for breaks, rate in steps:
        turn = time * rate
        later = breaks + np.floor(turn) - turn
        later = np.where(later <= 1e-12 * max(1.0, abs(turn)), later + 1.0, later)
        best = min(best, time + float(later.min()) / rate)
    return best


def held(problem: NonlinearSystem, theta) -> NonlinearSystem:
    """The problem with its step series at their values at the phases ``theta``, constant."""
    elements = []
    for element in problem.elements:
        changed = {
            field.name: constant(getattr(element, field.name).at(theta))
            for field in fields(element)
            if isinstance(getattr(element, field.name), StepSeries)
        }
        elements.append(replace(element, **changed) if changed else element)
    return replace(problem, elements=tuple(elements))
