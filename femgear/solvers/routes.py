"""The harmonic equations along one parameter: a base frequency, or anything that changes the system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from femgear.solvers.corrector import told_value
from femgear.solvers.harmonic_balance import HarmonicBalance, harmonic_balance, solve_harmonic_balance
from femgear.solvers.hill import judged
from femgear.solvers.lines import coincidence_note
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.periodic import PeriodicSolution

# Step of the differences by a parameter, in parts of its range.
_DIFFERENCE = 1e-5


class Route(Protocol):
    """What a branch asks of the equations along its parameter; ``balance`` has them at its start."""

    balance: HarmonicBalance

    @property
    def scale(self) -> float: ...

    def told(self, parameter: float) -> str: ...

    def evaluate(self, y, parameter: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...

    def first(self, parameter: float, start) -> PeriodicSolution: ...

    def unknowns(self, lines) -> np.ndarray: ...

    def lines(self, y) -> np.ndarray: ...

    def solution(self, y, parameter: float, error: float, iterations: int = 0) -> PeriodicSolution: ...

    def judged(self, parameters, solutions, tolerance: float) -> tuple[PeriodicSolution, ...]: ...


@dataclass(frozen=True)
class FrequencyRoute:
    """One base frequency varies, the others are held."""

    balance: HarmonicBalance
    held: tuple[float, ...]
    base: int
    radius: bool = False

    @property
    def scale(self) -> float:
        """Typical deflection [m]."""
        return self.balance.scale

    def told(self, parameter: float) -> str:
        """The varied frequency in words."""
        return f"frequency {parameter:.6g} rad/s ({parameter / (2.0 * np.pi):.6g} Hz)"

    def frequency(self, parameter: float) -> np.ndarray:
        """All base frequencies (n_bases,) [rad/s]."""
        out = np.array(self.held)
        out[self.base] = parameter
        return out

    def evaluate(self, y, parameter: float):
        """Residual (n_y,), derivatives by the unknowns (n_y, n_y) and by the frequency (n_y,)."""
        residual, jacobian, slope = self.balance.evaluate(y, self.frequency(parameter))
        return residual, jacobian, slope[:, self.base]

    def first(self, parameter: float, start) -> PeriodicSolution:
        """Solution near the start."""
        balance = self.balance
        return solve_harmonic_balance(
            balance.problem, self.frequency(parameter), orders=balance.orders, start=start,
            samples=balance.grid.samples, reduction=balance.reduction, stability=False,
        )  # fmt: skip

    def unknowns(self, lines) -> np.ndarray:
        """Real unknowns (n_y,)."""
        return self.balance.unknowns(lines)

    def lines(self, y) -> np.ndarray:
        """Lines (n_columns, L)."""
        return self.balance.lines(y)

    def solution(self, y, parameter: float, error: float, iterations: int = 0) -> PeriodicSolution:
        """Solution at a corrected point."""
        return _told(self.balance, y, self.frequency(parameter), error, iterations, self.radius)

    def judged(self, parameters, solutions, tolerance: float) -> tuple[PeriodicSolution, ...]:
        """The solutions with their Floquet verdicts."""
        return judged(self.balance.problem, solutions, tolerance=tolerance)


@dataclass(frozen=True)
class FamilyRoute:
    """The system varies with the parameter, the base frequencies are held."""

    family: Callable[[float], NonlinearSystem]
    balance: HarmonicBalance
    omega: tuple[float, ...]
    limits: tuple[float, float]
    samples: tuple[int, ...] | int | None
    radius: bool = False

    @property
    def scale(self) -> float:
        """Typical deflection [m], the larger one of both ends."""
        return max(self.balance_at(parameter).scale for parameter in self.limits)

    def told(self, parameter: float) -> str:
        """The parameter in words."""
        return told_value(parameter)

    def balance_at(self, parameter: float) -> HarmonicBalance:
        """The equations; modes are computed again only where masses, stiffnesses or loads change."""
        problem = self.family(parameter)
        known = self.balance
        return harmonic_balance(
            problem, orders=known.orders, samples=self.samples,
            reduction=known.reduction if _same_linear_part(problem, known.problem) else None,
        )  # fmt: skip

    def evaluate(self, y, parameter: float):
        """Residual (n_y,), derivatives by the unknowns (n_y, n_y) and by the parameter (n_y,)."""
        step = _DIFFERENCE * (self.limits[1] - self.limits[0])
        residual, jacobian, _ = self.balance_at(parameter).evaluate(y, np.array(self.omega))
        # three points within the range, central where there is room
        offset = np.array([-1.0, 1.0]) * step
        if parameter + offset[0] < self.limits[0]:
            offset = np.array([1.0, 2.0]) * step
        elif parameter + offset[1] > self.limits[1]:
            offset = np.array([-1.0, -2.0]) * step
        a, b = offset
        near, far = (self._residual(y, parameter + value) - residual for value in offset)
        return residual, jacobian, (near * b / a - far * a / b) / (b - a)

    def _residual(self, y, parameter: float) -> np.ndarray:
        balance = self.balance_at(parameter)
        lines = balance.lines(y)
        value = balance.receptance(np.array(self.omega))[0]
        return balance.unknowns(balance.residual(lines, balance.forces(lines), value))

    def first(self, parameter: float, start) -> PeriodicSolution:
        """Solution near the start."""
        return solve_harmonic_balance(
            self.family(parameter), self.omega, orders=self.balance.orders, start=start,
            samples=self.samples, stability=False,
        )  # fmt: skip

    def unknowns(self, lines) -> np.ndarray:
        """Real unknowns (n_y,)."""
        return self.balance.unknowns(lines)

    def lines(self, y) -> np.ndarray:
        """Lines (n_columns, L)."""
        return self.balance.lines(y)

    def solution(self, y, parameter: float, error: float, iterations: int = 0) -> PeriodicSolution:
        """Solution at a corrected point."""
        return _told(self.balance_at(parameter), y, np.array(self.omega), error, iterations, self.radius)

    def judged(self, parameters, solutions, tolerance: float) -> tuple[PeriodicSolution, ...]:
        """The solutions with their Floquet verdicts, each of its own system."""
        return tuple(
            judged(self.family(float(parameter)), [solution], tolerance=tolerance)[0]
            for parameter, solution in zip(parameters, solutions)
        )


def _told(
    balance: HarmonicBalance, y, frequency, error: float, iterations: int, radius: bool
) -> PeriodicSolution:
    message = f"Point of a branch; last Newton step {error:.1e} of the scaled unknowns."
    message += coincidence_note(balance.orders, frequency)
    return balance.solution(
        y, frequency, radius=radius, converged=True, iterations=iterations, factorisations=iterations,
        message=message,
    )  # fmt: skip


def _same_linear_part(one: NonlinearSystem, other: NonlinearSystem) -> bool:
    """Whether two problems differ in their elements only."""
    if one.system is other.system and one.forces is other.forces and one.speed == other.speed:
        return True
    arrays = [
        [s.M, s.K, s.W, s.load, problem.damping, *(f.force for f in problem.forces)]
        for problem in (one, other)
        for s in (problem.system,)
    ]
    same_orders = [f.orders for f in one.forces] == [f.orders for f in other.forces]
    return same_orders and all(np.array_equal(a, b) for a, b in zip(*arrays))
