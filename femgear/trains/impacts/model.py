"""Dimensionless gear pair with backlash, its units, and where and how its flanks part or hit.

Rotations on rigid shafts after A. Kahraman and R. Singh, Non-linear dynamics of a spur gear pair, J. Sound
Vib. 142 (1990) 49-75, Eqs. (1) to (4): the deflection along the line of action is
``r_1 theta_1 - r_2 theta_2``, and with the equivalent mass
``m_e = 1 / (r_1^2 / I_1 + r_2^2 / I_2) = I_1 I_2 / (r_1^2 I_2 + r_2^2 I_1)`` it obeys
``m_e x'' + c x' + f(x, t) = T_1 / r_1``.

In the dimensionless form lengths are counted in half backlashes b, forces in k b with the mean mesh stiffness
k, times in 1 / omega_n, omega_n = sqrt(k / m_e); bearings and k(t) are those of Kahraman and Singh, J. Sound
Vib. 146 (1991) 135-156. With the dynamic approach ``u = r_1 theta_1 - r_2 theta_2``, the displacements y_1,
y_2 of the gears along the line of action and the error e(t), the relative deflection of the mesh is

``x = u + y_1 - y_2 - e(t)``

and drive flanks touch above x = 1, back flanks below x = -1. In the coordinates (y_1, y_2, x) the error acts
through the inertia of ``u = x + e - y_1 + y_2`` alone: ``x'' + 2 zeta x' + k(t) f(x) = F - e''`` without
bearings. Time is scaled once more so that the tooth frequency is one for every frequency ratio Omega,
``theta = Omega t``: M and C carry Omega^2 and Omega, and branches over Omega are branches over a parameter.

No impact, single-sided and double-sided impact are told apart, as in the paper of 1990, by the range of the
relative deflection.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from femgear.solvers.continuation.branches import Branch
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, constant, orders_of
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem

# deflections of drive and back contact in half backlashes
DRIVE, BACK = 1.0, -1.0

# instants of a period, and a step of the ratio within which interpolation along the branch will do
_SAMPLES = 2048
_SHORT = 1e-3


@dataclass(frozen=True)
class PairBearings:
    """Bearings of both gears along the line of action, two numbers each: gear 1 and gear 2.

    ``mass`` over the equivalent mass m_e, ``stiffness`` over the mean mesh stiffness, and ``damping_ratio`` xi of
    ``c_i = 2 xi sqrt(k_i m_i)``.
    """

    mass: tuple[float, ...]
    stiffness: tuple[float, ...]
    damping_ratio: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class ImpactPair:
    """Dimensionless gear pair with backlash, k(t) and errors.

    Parameters
    ----------
    damping_ratio : float
        zeta of the mesh: ``c = 2 zeta sqrt(k m_e)``.
    load : float
        Mean force F over k b; positive keeps the drive flanks in contact.
    stiffness : sequence of complex
        Harmonics 1, 2, ... of k(t) over its mean, of the tooth frequency.
    tooth_error : sequence of complex
        Harmonics 1, 2, ... of the tooth-frequency error, in half backlashes.
    eccentricity : (complex, complex)
        Of gears 1 and 2 along the line of action, in half backlashes, with their phases.
    teeth : (int, int)
        Shaft frequencies are the tooth frequency over the tooth numbers.
    bearings : PairBearings, optional
        None holds both axes.
    """

    damping_ratio: float
    load: float
    stiffness: tuple[complex, ...] = ()
    tooth_error: tuple[complex, ...] = ()
    eccentricity: tuple[complex, complex] = (0.0, 0.0)
    teeth: tuple[int, ...] = (20, 30)
    bearings: PairBearings | None = None

    @property
    def frequency(self) -> np.ndarray:
        """Base frequencies (n_bases,) of the scaled time: the teeth, then the shafts that are eccentric."""
        return np.array([1.0, *(1.0 / z for e, z in zip(self.eccentricity, self.teeth) if e)])

    @property
    def periods(self) -> int:
        """Tooth periods after which everything repeats."""
        return math.lcm(*(z for e, z in zip(self.eccentricity, self.teeth) if e))

    def problem(self, ratio: float) -> NonlinearSystem:
        """Assemble the pair at the frequency ratio Omega, tooth frequency over omega_n, in the scaled time.

        Coordinates x, or y_1, y_2 and x; the one column is x. Solvers are given `ImpactPair.frequency`.
        """
        M, C, K, along = self._matrices()
        system = MechanicalSystem(
            M=ratio**2 * M,
            C=ratio * C,
            K=K,
            W=np.eye(len(M))[:, -1:],
            load=self.load * along,
            dofs=("y 1", "y 2", "x") if self.bearings else ("x",),
        )
        return NonlinearSystem(system, (self._mesh,), tuple(self._forces(ratio, along)))

    def mesh(self) -> GearMeshes:
        """Make the mesh with its play on the one column, see `ImpactPair.problem`."""
        return self._mesh

    @cached_property
    def _mesh(self) -> GearMeshes:
        """One for the problems of all ratios, whose solvers evaluate its coefficients once."""
        k = FourierSeries(np.array([[1.0, *self.stiffness]]), orders_of(0, len(self.frequency)))
        return GearMeshes(np.array([0]), k, deflection=constant([DRIVE]), backlash=DRIVE - BACK)

    def _matrices(self):
        """M, C, K with unit time 1 / omega_n, and the direction of u in the coordinates."""
        if self.bearings is None:
            return np.eye(1), np.array([[2.0 * self.damping_ratio]]), np.zeros((1, 1)), np.ones(1)
        along = np.array([-1.0, 1.0, 1.0])
        mass, stiffness = np.array([*self.bearings.mass, 0.0]), np.array([*self.bearings.stiffness, 0.0])
        damping = 2.0 * self.bearings.damping_ratio * np.sqrt(mass * stiffness)
        damping[-1] = 2.0 * self.damping_ratio
        return np.diag(mass) + np.outer(along, along), np.diag(damping), np.diag(stiffness), along

    def _forces(self, ratio: float, along):
        """Inertia forces ``-e''`` of the errors."""
        count, base = len(self.frequency), 0
        for h, error in enumerate(self.tooth_error, 1):
            if error:
                yield HarmonicForce((ratio * h) ** 2 * error * along, orders_of(0, count, h))
        for error, z in zip(self.eccentricity, self.teeth):
            if error:
                base += 1
                yield HarmonicForce((ratio / z) ** 2 * error * along, orders_of(base, count))


def separation_ratios(*, damping_ratio: float, load: float, error: float) -> tuple[float, ...]:
    """Find the frequency ratios at which drive flanks begin to part, ascending: none, one or two.

    The load over k b, the error in half backlashes. Rotations, constant stiffness, one harmonic of the
    error: as long as flanks touch the pair is linear and they part where
    ``error Omega^2 / |1 - Omega^2 + 2 i zeta Omega| = load``, a quadratic equation of Omega^2
    (Kahraman and Singh 1990, transition from no impact to single-sided impact).
    """
    s = (error / load) ** 2
    roots = np.roots([1.0 - s, 4.0 * damping_ratio**2 - 2.0, 1.0])
    real = roots[np.abs(roots.imag) < 1e-12].real
    return tuple(float(value) for value in np.sort(np.sqrt(real[real > 0.0])))


def impact_borders(pair: ImpactPair, branch: Branch, level: float) -> np.ndarray:
    """Find the ratios (n,) along the branch at which the smallest deflection passes a level, to 1e-6.

    The harmonic balance equations are solved again between two points of the branch; at limit points, where
    two points lie within 1e-3 of the ratio, the border is interpolated. The branch is one over the frequency
    ratio, of ``parameter_curve(pair.problem, ..., 1.0)``; the level in half backlashes is `DRIVE` for the
    first impacts, `BACK` for impacts on both flanks.
    """
    from scipy.optimize import brentq

    away = np.array([_lowest_deflection(solution) for solution in branch.solutions]) - level
    borders = []
    for i in np.flatnonzero(np.signbit(away[:-1]) != np.signbit(away[1:])):
        ends, near = branch.parameter[i : i + 2], branch.solutions[i]
        if abs(ends[1] - ends[0]) <= _SHORT:
            borders.append(ends[0] + away[i] / (away[i] - away[i + 1]) * (ends[1] - ends[0]))
            continue

        def lowest(ratio, near=near):
            solution = solve_harmonic_balance(
                pair.problem(ratio), 1.0, orders=near.orders, start=near, samples=1024, stability=False
            )
            return _lowest_deflection(solution) - level

        borders.append(brentq(lowest, *ends, xtol=1e-6))
    return np.array(borders)


def _lowest_deflection(solution) -> float:
    """Smallest deflection of a solution in scaled time, over 2048 phases."""
    return float(solution.at(2.0 * np.pi * np.arange(_SAMPLES) / _SAMPLES).min())


NORMAL, ONE_SIDED, TWO_SIDED, UNKNOWN = 0, 1, 2, 3
STATE_NAMES = ("normal", "one-sided impact", "two-sided impact", "not known")
"""One flank stays closed; it opens and the other does not close; both close."""


def range_states(lowest, highest) -> np.ndarray:
    """Tell the contact states (...), indices into `STATE_NAMES`, from the range of the relative deflection.

    ``lowest`` and ``highest`` (...) are in half backlashes. `UNKNOWN` where one is nan or infinite, as of a
    motion that did not settle.
    """
    lowest, highest = np.asarray(lowest, float), np.asarray(highest, float)
    both = (highest > DRIVE) & (lowest < BACK)
    closed = (lowest >= DRIVE) | (highest <= BACK)
    state = np.where(both, TWO_SIDED, np.where(closed, NORMAL, ONE_SIDED))
    return np.where(np.isfinite(lowest) & np.isfinite(highest), state, UNKNOWN)


def contact_shares(x) -> dict[str, np.ndarray]:
    """Compute the shares (...) of the instants with the drive flanks, none or the back flanks in contact.

    Relative deflections x (..., T) over a period are in half backlashes.
    """
    drive, back = np.asarray(x) > DRIVE, np.asarray(x) < BACK
    touching = {"drive": drive, "free": ~drive & ~back, "back": back}
    return {name: closed.mean(axis=-1) for name, closed in touching.items()}


def state_regions(parameter, state) -> list[tuple[int, float, float]]:
    """List runs of equal states (n,) along a curve: state, first and last value of the parameter (n,).

    Neighbouring runs share no value; where the state changes the border lies between them.
    """
    ends = np.flatnonzero(np.diff(state, append=-1, prepend=-1))
    return [(int(state[first]), float(parameter[first]), float(parameter[last - 1])) for first, last in pairwise(ends)]
