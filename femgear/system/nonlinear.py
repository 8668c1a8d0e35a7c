"""A system with nonlinear elements and harmonic forces: what harmonic balance and time integration solve.

What of the element forces depends on time alone is tabulated once for known instants (`tabulated_law`). A
constant load that nothing takes up is told with the free motion that it drives away (`drift_note`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.system.elements import Element, GearMeshes, PolynomialSprings
from femgear.system.entries import checked_numbers
from femgear.system.series import phase_of
from femgear.system.system import MechanicalSystem

Law = Callable[[int, np.ndarray], tuple[np.ndarray, np.ndarray]]
# Inertia that holds free motions, over the mean stiffness, and the share of the load that counts as balanced.
_HELD, _BALANCED = 1e-12, 1e-6


@dataclass(frozen=True)
class HarmonicForce:
    """``Re(force exp(i orders . theta))`` on the degrees of freedom.

    Parameters
    ----------
    force : (n,) complex array
        [N, N m].
    orders : tuple of int
        Multiples of the base frequencies.
    """

    force: np.ndarray
    orders: tuple[int, ...] = (1,)

    def __post_init__(self):
        force = checked_numbers(self.force, "force", code="E-SHAPE", unit="N", kind=complex).copy()
        force.setflags(write=False)
        object.__setattr__(self, "force", force)


@dataclass(frozen=True)
class NonlinearSystem:
    """``M q'' + (C + speed G) q' + K q + W f(W^T q, theta) = load + sum of harmonic forces``.

    ``theta_b = omega_b t`` are the phases of the base frequencies, which the solvers are given.

    Parameters
    ----------
    system : MechanicalSystem
        ``W`` holds one column for every deflection of an element.
    elements : tuple of Element
        They may share columns; their forces add.
    forces : tuple of HarmonicForce
    speed : float
        Speed that multiplies the gyroscopic matrix [rad/s].
    """

    system: MechanicalSystem
    elements: tuple[Element, ...]
    forces: tuple[HarmonicForce, ...] = ()
    speed: float = 0.0

    def __post_init__(self):
        _check_system(self.system)
        n, columns = self.system.W.shape
        for element in self.elements:
            if element.columns.max(initial=-1) >= columns:
                raise CaseError(
                    f"an element acts on column {element.columns.max()} of {columns}", code="E-SHAPE",
                    limit=f"0 to {columns - 1}",
                )  # fmt: skip
        for force in self.forces:
            if force.force.shape != (n,) or not np.all(np.isfinite(force.force)):
                raise CaseError(
                    f"a harmonic force of shape {force.force.shape} on {n} degrees of freedom",
                    code="E-SHAPE", limit="one finite number a degree of freedom",
                )  # fmt: skip

    @property
    def damping(self) -> np.ndarray:
        """``C + speed G`` (n, n)."""
        if self.system.gyroscopic is None or not self.speed:
            return self.system.C
        return self.system.C + self.speed * self.system.gyroscopic

    @property
    def reference(self) -> np.ndarray:
        """Linear stiffness of every column near which the elements work, (n_columns,) [N/m]."""
        total = np.zeros(self.system.W.shape[1])
        for element in self.elements:
            np.add.at(total, element.columns, element.reference)
        return total

    @property
    def stiffness(self) -> np.ndarray:
        """``K + W c W^T`` (n, n) with the reference c of the columns [N/m]."""
        return self.system.K + (self.system.W * self.reference) @ self.system.W.T

    @property
    def bases(self) -> int:
        """Number of base frequencies that the elements and forces name."""
        orders = [force.orders for force in self.forces]
        for element in self.elements:
            orders += [s.orders for s in vars(element).values() if hasattr(s, "orders")]
        return max([len(o) for o in orders if any(o)], default=1)


def checked_bases(problem: NonlinearSystem, frequency) -> np.ndarray:
    """Base frequencies as an array (n_bases,), finite and no more than elements and forces name.

    Raises
    ------
    CaseError
        Not a list of finite numbers, or one too long (E-FREQUENCY).
    """
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-FREQUENCY", unit="rad/s"))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)):
        raise CaseError("base frequencies must be finite numbers", code="E-FREQUENCY", key="frequency")
    if len(frequency) > problem.bases:
        raise CaseError(
            f"{len(frequency)} base frequencies, elements and forces name {problem.bases}",
            code="E-FREQUENCY", key="frequency", value=frequency.tolist(), limit=f"{problem.bases} or fewer",
            remedy="leave out those that drive nothing, or give elements and forces one order a frequency",
        )  # fmt: skip
    return frequency


def element_forces(problem: NonlinearSystem, x, theta) -> tuple[np.ndarray, np.ndarray]:
    """Forces (..., n_columns) and tangents (..., n_columns, n_columns) of all elements.

    Parameters
    ----------
    problem : NonlinearSystem
    x : (..., n_columns) array
        Deflections [m].
    theta : (..., n_bases) array
        Phases of the base frequencies [rad].
    """
    x = np.asarray(x, float)
    force = np.zeros(x.shape)
    tangent = np.zeros((*x.shape, x.shape[-1]))
    for element in problem.elements:
        part, slope = element.evaluate(x[..., element.columns], theta)
        for group, columns in enumerate(element.columns):
            force[..., columns] += part[..., group, :]
            tangent[..., columns[:, None], columns] += slope[..., group, :, :]
    return force, tangent


def external_force(problem: NonlinearSystem, theta) -> np.ndarray:
    """Constant load and harmonic forces (..., n) at the phases theta (..., n_bases)."""
    theta = np.asarray(theta, float)
    total = np.broadcast_to(problem.system.load, (*theta.shape[:-1], len(problem.system.load))).copy()
    for force in problem.forces:
        total += (np.exp(1j * phase_of(theta, force.orders))[..., None] * force.force).real
    return total


def tabulated_law(problem: NonlinearSystem, theta) -> Law:
    """A function of instant number and deflections: forces and tangents beyond the reference stiffness.

    Parameters
    ----------
    problem : NonlinearSystem
    theta : (n_times, n_bases) array
        Phases of the instants [rad].

    Returns
    -------
    callable
        ``law(i, x (n_columns,)) -> (f - c x (n_columns,), df/dx - c)`` with ``c`` the
        reference of the problem; the second is (n_columns,) where every element acts on single
        columns, else (n_columns, n_columns).
    """
    theta, reference = np.asarray(theta, float), problem.reference
    every = np.arange(len(reference))
    parts = [(element.columns, _single_law(element, theta)) for element in problem.elements]
    if not parts:
        nothing = np.zeros(len(reference))
        return lambda i, x: (nothing, nothing)
    if any(columns.shape[1] > 1 for columns, _ in parts):
        return _coupled_law(problem, theta)
    if len(parts) == 1 and np.array_equal(parts[0][0][:, 0], every):
        only = parts[0][1]

        def whole(i, x):
            force, slope = only(i, x)
            return force - reference * x, slope - reference

        return whole
    indices = [columns[:, 0] for columns, _ in parts]

    def summed(i, x):
        total, tangent = -reference * x, -reference
        for columns, (_, part) in zip(indices, parts):
            force, slope = part(i, x[columns])
            np.add.at(total, columns, force)
            np.add.at(tangent, columns, slope)
        return total, tangent

    return summed


def drift_note(problem: NonlinearSystem) -> str:
    """What to know of a constant load out of balance; empty where supports and elements take it up.

    Free motions are held by ``e M``: of ``(K' + e M) u = load`` the part ``e M u`` tends to the load on the
    free motions as e falls. Every column counts as held, by contact if need be.
    """
    system, load = problem.system, problem.system.load
    root = np.sqrt(np.abs(np.diag(system.M)))
    if not np.any(load) or not np.all(root > 0.0):
        return ""
    stiffness = (system.K / root).T / root
    columns = system.W / root[:, None]
    hold = np.abs(problem.reference)
    hold = np.where(hold > 0.0, hold, hold.max(initial=0.0) or 1.0)
    stiffness = stiffness + (columns * hold) @ columns.T
    inertia, force = (system.M / root).T / root, load / root
    size = np.trace(np.abs(stiffness)) / len(load) or 1.0
    held = []
    for share in (_HELD, 10.0 * _HELD):
        weight = share * size * inertia
        held.append(weight @ np.linalg.solve(stiffness + weight, force))
    free = (10.0 * held[0] - held[1]) / 9.0
    share = float(np.linalg.norm(free) / np.linalg.norm(force))
    if not share > _BALANCED:
        return ""
    dof = int(np.argmax(np.abs(np.linalg.solve(inertia, free))))
    name = system.dofs[dof] if system.dofs else f"degree of freedom {dof}"
    return (
        f"; the mean drifts: nothing takes up {share:.2g} of the constant load (it drives {name} away), "
        "balance it or add a support"
    )


def _check_system(system: MechanicalSystem) -> None:
    """Refuse matrices of wrong shapes, numbers that are not finite, wrong symmetries, W without columns."""
    n = len(system.M)
    shapes = {"M": (n, n), "C": (n, n), "K": (n, n), "load": (n,), "gyroscopic": (n, n)}
    for name, shape in shapes.items():
        array = getattr(system, name)
        if array is None and name == "gyroscopic":
            continue
        if array.shape != shape:
            raise CaseError(f"{name} has shape {array.shape}", code="E-SHAPE", limit=f"{shape}, as M")
        if not np.all(np.isfinite(array)):
            raise CaseError(f"{name} holds numbers that are not finite", code="E-FINITE")
        size = np.abs(array).max(initial=0.0)
        # circulatory forces make K unsymmetric, which time integration and shooting take
        sign = {"M": 1.0, "gyroscopic": -1.0}.get(name, 0.0)
        if sign and np.abs(array - sign * array.T).max(initial=0.0) > 1e-9 * size:
            kind = "symmetric" if sign > 0 else "skew-symmetric"
            raise CaseError(f"{name} is not {kind}", code="E-SYMMETRY", limit=f"{kind} to 1e-9")
    if system.W.ndim != 2 or len(system.W) != n or not system.W.shape[1]:
        raise CaseError(
            f"W has shape {system.W.shape}", code="E-SHAPE", limit=f"({n}, 1 or more deflections)",
            remedy="give one column for every deflection of an element",
        )  # fmt: skip
    if not np.all(np.isfinite(system.W)):
        raise CaseError("W holds numbers that are not finite", code="E-FINITE")


def _single_law(element: Element, theta) -> Law:
    """Forces (g,) and slopes (g,) of an element on single columns."""
    if type(element) is GearMeshes:
        return _mesh_law(element, theta)
    if type(element) is PolynomialSprings:
        return _polynomial_law(element)

    def general(i, x):
        force, slope = element.evaluate(x[:, None], theta[i])
        return force[:, 0], slope[:, 0, 0]

    return general


def _polynomial_law(element: PolynomialSprings) -> Law:
    """``PolynomialSprings.evaluate`` with the coefficients of force and slope ready for Horner's rule."""
    force_terms = list(element.coefficients.T[::-1])
    slope_terms = [c * (len(force_terms) - d) for d, c in enumerate(force_terms)]

    def law(i, x):
        force, slope = force_terms[0], slope_terms[0]
        for f, s in zip(force_terms[1:], slope_terms[1:]):
            force, slope = force * x + f, slope * x + s
        return force * x, slope

    return law


def _mesh_law(element: GearMeshes, theta) -> Law:
    """``GearMeshes.evaluate`` with its series tabulated."""
    k = np.array(element.stiffness.at(theta))
    offset = element.force.at(theta) - k * element.deflection.at(theta)
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


def _smooth_mesh_law(k, offset, play, smoothing) -> Law:
    length = smoothing * k
    square = length * length
    finite = np.isfinite(play[0])
    gap = np.where(finite, play, 0.0)

    def smooth(i, x):
        line = offset[i] + k[i] * x
        root = np.sqrt(line * line + square[i])
        force, slope = 0.5 * (line + root), 0.5 * (1.0 + line / root)
        behind = np.where(finite, -line - gap[i], 0.0)
        root = np.sqrt(behind * behind + square[i])
        back, back_slope = 0.5 * (behind + root), 0.5 * (1.0 + behind / root)
        return force - finite * back, k[i] * (slope + finite * back_slope)

    return smooth


def _coupled_law(problem: NonlinearSystem, theta) -> Law:
    """Elements on groups of columns, evaluated as they are."""
    reference = np.diag(problem.reference)

    def law(i, x):
        total, tangent = -reference @ x, -reference
        for element in problem.elements:
            force, slope = element.evaluate(x[element.columns], theta[i])
            for columns, f, t in zip(element.columns, force, slope):
                total[columns] += f
                tangent[columns[:, None], columns] += t
        return total, tangent

    return law
