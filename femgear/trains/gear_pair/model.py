"""Dimensionless gear pair with backlash, its units, and the ratios at which its flanks part or hit.

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
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, checked_count, checked_numbers
from femgear.solvers.continuation.branches import Branch
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.system.elements import GearMeshes
from femgear.system.fourier import FourierSeries, constant
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem

# deflections of drive and back contact in half backlashes
DRIVE, BACK = 1.0, -1.0

# instants of a period, and a step of the ratio within which interpolation along the branch will do
_SAMPLES = 2048
_SHORT = 1e-3


@dataclass(frozen=True)
class PairBearings:
    """Bearings of both gears along the line of action.

    Parameters
    ----------
    mass : (float, float)
        Of gears 1 and 2 over the equivalent mass m_e.
    stiffness : (float, float)
        Of their bearings over the mean mesh stiffness.
    damping_ratio : float
        ``c_i = 2 xi sqrt(k_i m_i)``.
    """

    mass: tuple[float, ...]
    stiffness: tuple[float, ...]
    damping_ratio: float = 0.0

    def __post_init__(self):
        given = (self.mass, self.stiffness)
        values = [checked_numbers(one, "bearings", code="E-RANGE", unit="") for one in given]
        if any(v.shape != (2,) or not np.all(np.isfinite(v) & (v > 0.0)) for v in values):
            raise CaseError(
                f"bearings with masses {self.mass} and stiffnesses {self.stiffness}", code="E-RANGE",
                limit="two of each, above 0",
            )  # fmt: skip
        _not_negative("damping ratio of the bearings", self.damping_ratio)


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

    def __post_init__(self):
        _not_negative("damping ratio", self.damping_ratio)
        _number("load", self.load)
        for name in ("stiffness", "tooth_error", "eccentricity"):
            given = checked_numbers(getattr(self, name), name, code="E-RANGE", unit="", kind=complex)
            values = np.atleast_1d(given)
            if values.ndim != 1 or not np.all(np.isfinite(values)):
                raise CaseError(f"{name} {values.tolist()}", code="E-RANGE", key=name, limit="finite numbers")
            object.__setattr__(self, name, tuple(values.tolist()))
        teeth = checked_numbers(self.teeth, "teeth", code="E-RANGE", unit="")
        whole = teeth.shape == (2,) and np.all(teeth >= 1) and np.all(teeth == np.floor(teeth))
        if len(self.eccentricity) != 2 or not whole or not np.all(np.isfinite(teeth)):
            raise CaseError(
                f"eccentricities {self.eccentricity} of gears with {self.teeth} teeth", code="E-RANGE",
                limit="two of each, whole numbers of teeth, one or more",
            )  # fmt: skip
        object.__setattr__(self, "teeth", tuple(int(z) for z in teeth))
        if len(set(self.frequency)) < len(self.frequency):
            raise CaseError(
                f"eccentricities {self.eccentricity} of gears with {self.teeth} teeth make two base "
                "frequencies one", code="E-RANGE", key="eccentricity", limit="every base frequency once",
                remedy="give the sum of both to one gear where only the mesh counts, or other teeth",
            )  # fmt: skip

    @property
    def frequency(self) -> np.ndarray:
        """Base frequencies of the scaled time: the teeth, then the shafts that are eccentric."""
        return np.array([1.0, *(1.0 / z for e, z in zip(self.eccentricity, self.teeth) if e)])

    @property
    def periods(self) -> int:
        """Tooth periods after which everything repeats."""
        return math.lcm(*(z for e, z in zip(self.eccentricity, self.teeth) if e))

    def problem(self, ratio: float, *, divided: int = 1) -> NonlinearSystem:
        """The pair at the frequency ratio Omega, tooth frequency over omega_n, in the scaled time.

        Coordinates x, or y_1, y_2 and x; the one column is x. Solvers are given `frequency`; for motions that
        repeat after several tooth periods ``divided`` counts these, and the first base is 1 / divided.
        """
        divided = checked_count(divided, "divided", code="E-RANGE")
        ratio = _number("ratio", ratio, code="E-RANGE")
        if not (math.isfinite(ratio) and ratio > 0.0):
            raise CaseError(f"a frequency ratio of {ratio}", code="E-RANGE", key="ratio", limit="above 0")
        M, C, K, along = self._matrices()
        system = MechanicalSystem(
            M=ratio**2 * M, C=ratio * C, K=K, W=np.eye(len(M))[:, -1:], load=self.load * along,
            dofs=("y 1", "y 2", "x") if self.bearings else ("x",),
        )  # fmt: skip
        forces = tuple(self._forces(ratio, along, divided))
        return NonlinearSystem(system, (self.mesh(divided),), forces)

    def mesh(self, divided: int = 1) -> GearMeshes:
        """The mesh with its play on the one column, see `problem`."""
        orders = _orders(0, divided, len(self.frequency))
        k = FourierSeries(np.array([[1.0, *self.stiffness]]), orders)
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

    def _forces(self, ratio: float, along, divided: int):
        """Inertia forces ``-e''`` of the errors."""
        count, base = len(self.frequency), 0
        for h, error in enumerate(self.tooth_error, 1):
            if error:
                yield HarmonicForce((ratio * h) ** 2 * error * along, _orders(0, h * divided, count))
        for error, z in zip(self.eccentricity, self.teeth):
            if error:
                base += 1
                yield HarmonicForce((ratio / z) ** 2 * error * along, _orders(base, 1, count))


@dataclass(frozen=True)
class PairScales:
    """Units of the dimensionless pair.

    Parameters
    ----------
    length : float
        Half backlash along the line of action [m].
    frequency : float
        omega_n [rad/s].
    force : float
        k b [N].
    """

    length: float
    frequency: float
    force: float


def pair_scales(*, inertia, base_radius, stiffness: float, backlash: float) -> PairScales:
    """Units of a pair with polar inertias [kg m^2], base radii [m], mesh stiffness [N/m] and play [m].

    Parameters
    ----------
    inertia, base_radius : (float, float)
    stiffness : float
        Mean.
    backlash : float
        Total play along the line of action.
    """
    given = {"inertia": inertia, "base_radius": base_radius, "stiffness": stiffness, "backlash": backlash}
    values = np.concatenate(
        [np.ravel(checked_numbers(one, key, code="E-RANGE", unit="")) for key, one in given.items()]
    ).tolist()
    if np.shape(inertia) != (2,) or len(values) != 6 or not all(math.isfinite(v) and v > 0.0 for v in values):
        raise CaseError(f"a gear pair with the data {values}", code="E-RANGE", limit="all above 0")
    mass = 1.0 / sum(r * r / i for r, i in zip(base_radius, inertia))
    return PairScales(0.5 * backlash, math.sqrt(stiffness / mass), 0.5 * stiffness * backlash)


def separation_ratios(*, damping_ratio: float, load: float, error: float) -> tuple[float, ...]:
    """Frequency ratios at which drive flanks begin to part, ascending: none, one or two.

    Rotations, constant stiffness, one harmonic of the error: as long as flanks touch the pair is linear and
    they part where ``error Omega^2 / |1 - Omega^2 + 2 i zeta Omega| = load``, a quadratic equation of
    Omega^2 (Kahraman and Singh 1990, transition from no impact to single-sided impact).
    """
    given = {"damping_ratio": damping_ratio, "load": load, "error": error}
    damping_ratio, load, error = (_number(key, value) for key, value in given.items())
    _not_negative("damping ratio", damping_ratio)
    if load == 0.0:
        raise CaseError(
            "a pair without load has no closed flanks that could part", code="E-RANGE", key="load",
            limit="not 0",
        )  # fmt: skip
    s = (error / load) ** 2
    roots = np.roots([1.0 - s, 4.0 * damping_ratio**2 - 2.0, 1.0])
    real = roots[np.abs(roots.imag) < 1e-12].real
    return tuple(float(value) for value in np.sort(np.sqrt(real[real > 0.0])))


def lowest_deflection(solution) -> float:
    """Smallest deflection of a solution in scaled time, over 2048 phases."""
    return float(solution.at(2.0 * np.pi * np.arange(_SAMPLES) / _SAMPLES).min())


def impact_borders(pair: ImpactPair, branch: Branch, level: float) -> np.ndarray:
    """Ratios (n,) along the branch at which the smallest deflection passes a level, to 1e-6.

    The harmonic balance equations are solved again between two points of the branch; at limit points, where
    two points lie within 1e-3 of the ratio, the border is interpolated.

    Parameters
    ----------
    pair : ImpactPair
    branch : Branch
        Over the frequency ratio, from ``parameter_curve(pair.problem, ..., 1.0)``.
    level : float
        `DRIVE` for the first impacts, `BACK` for impacts on both flanks.

    Raises
    ------
    CaseError
        A level that is no finite number (E-RANGE).
    """
    from scipy.optimize import brentq

    number = checked_numbers(level, "level", code="E-RANGE", unit="")
    if number.ndim or not np.isfinite(number):
        raise CaseError(f"a level of {number.tolist()}", code="E-RANGE", key="level", limit="a finite number")
    away = np.array([lowest_deflection(one) for one in branch.solutions]) - level
    borders = []
    for i in np.flatnonzero(np.signbit(away[:-1]) != np.signbit(away[1:])):
        ends, near = branch.parameter[i : i + 2], branch.solutions[i]
        if abs(ends[1] - ends[0]) <= _SHORT:
            borders.append(ends[0] + away[i] / (away[i] - away[i + 1]) * (ends[1] - ends[0]))
            continue

        def lowest(ratio, near=near):
            found = solve_harmonic_balance(
                pair.problem(ratio), 1.0, orders=near.orders, start=near, samples=1024, stability=False
            )
            return lowest_deflection(found) - level

        borders.append(brentq(lowest, *ends, xtol=1e-6))
    return np.array(borders)


def _orders(base: int, order: int, count: int) -> tuple[int, ...]:
    return tuple(order if place == base else 0 for place in range(count))


def _number(key: str, value, code: str = "E-RANGE") -> float:
    """One finite number."""
    number = checked_numbers(value, key, code=code, unit="")
    if number.ndim or not np.isfinite(number):
        raise CaseError(f"a {key} of {number.tolist()}", code=code, key=key, limit="one finite number")
    return float(number)


def _not_negative(name: str, value: float) -> None:
    if _number(name, value) < 0.0:
        raise CaseError(f"{name} {value}", code="E-RANGE", limit="0 or more")
