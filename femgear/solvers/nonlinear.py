"""A system with nonlinear elements and harmonic forces: what harmonic balance and time integration solve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.elements import Element
from femgear.solvers.entries import checked_numbers
from femgear.solvers.series import phase_of
from femgear.system import MechanicalSystem


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


def modal_damping(system: MechanicalSystem, mesh_stiffness, ratio) -> np.ndarray:
    """Viscous damping ``M Phi diag(2 zeta omega) Phi^T M`` (n, n) of modal damping ratios.

    Geradin and Rixen, Mechanical Vibrations, 3rd ed., section 3.1: all modes of the system whose columns have
    the stiffnesses ``mesh_stiffness`` (n_columns,) get ``ratio``, a number or one a mode; rigid ones none.
    """
    from femgear.solvers.modal import solve_modes

    modes = solve_modes(system, mesh_stiffness, damping_ratio=ratio)
    carried = system.M @ modes.shape
    return (carried * (4.0 * np.pi * modes.damping_ratio * modes.frequency)) @ carried.T
