"""The mechanical system: every model ends in these types, every solver starts from them.

`MechanicalSystem` holds the matrices, `NonlinearSystem` joins them with the laws of their elements and with
harmonic forces for harmonic balance and time integration. What of the element forces depends on time alone is
tabulated once for known instants (`tabulated_law`). A constant load that nothing takes up is told with the
free motion that it drives away (`drift_note`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from femgear.errors import CaseError, checked_numbers
from femgear.system.force_laws import Element, GearMeshes, coefficients_of, tabulated_element
from femgear.system.fourier import harmonics_of, phase_of, series_of

Law = Callable[[int, np.ndarray], tuple[np.ndarray, np.ndarray]]
# Inertia that holds free motions, over the mean stiffness, and the share of the load that counts as balanced.
_HELD, _BALANCED = 1e-12, 1e-6


def freeze(obj):
    """Turn the array fields of a frozen dataclass into read-only arrays of its own."""
    for field_ in fields(obj):
        value = getattr(obj, field_.name)
        # the annotations np.ndarray and NDArray[...]
        if value is not None and "ndarray" in str(field_.type).lower():
            # one that nobody can write to is as good as a copy
            shared = isinstance(value, np.ndarray) and value.flags.owndata and not value.flags.writeable
            array = np.array(value, copy=None if shared else True)
            array.setflags(write=False)
            object.__setattr__(obj, field_.name, array)


@dataclass(frozen=True)
class MechanicalSystem:
    """``M q'' + (C + Omega G) q' + K q + W f(W^T q, t) = load``.

    ``K`` holds the linear part without the gear meshes; each mesh is a column of ``W`` and its
    spring deflection, positive in compression, is ``W^T q``.

    Parameters
    ----------
    M, C, K : (n, n) arrays
        Mass [kg, kg m^2], viscous damping [N s/m, ...] and stiffness [N/m, ...].
    W : (n, n_meshes) array
        Mesh directions: deflection of every mesh per unit of each coordinate.
    load : (n,) array
        Constant external load [N, N m].
    dofs : tuple of str
        One name a degree of freedom, such as ``"planet 2: x"``.
    gyroscopic : (n, n) array, optional
        Skew-symmetric matrix G [kg, kg m^2] that multiplies the speed of rotation [rad/s].
    flexibility : (n_meshes, n_meshes) array, optional
        Static compliance of bodies that are rigid in the coordinates, from the force of every mesh to the
        deflection of every other [m/N]: the spring deflections are then ``W^T q - flexibility f``.
    sources : (n, c) array, optional
        Directions of external loads that vary with the mesh, ``MeshExcitation.source``.
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    W: np.ndarray
    load: np.ndarray
    dofs: tuple[str, ...]
    gyroscopic: np.ndarray | None = None
    flexibility: np.ndarray | None = None
    sources: np.ndarray | None = None

    def __post_init__(self):
        freeze(self)


@dataclass(frozen=True)
class MeshExcitation:
    """Gear meshes linearised about their loaded static state, over one common period.

    The force of mesh ``j`` is ``f_j(t) = force_j(t) + stiffness_j(t) (W_j^T q - deflection_j(t))``:
    the tangent line at the static state, so that the quasi-static dynamic solution is the static one.

    Parameters
    ----------
    stiffness : (n_meshes, n_positions) array
        Tangent mesh stiffness [N/m] at equidistant positions of the period (end point excluded).
    deflection : (n_meshes, n_positions) array
        Static deflection of the mesh spring [m] (the static transmission error for rigid bodies).
    force : (n_meshes, n_positions) array
        Static mesh force [N].
    backlash : (n_meshes,) array
        Total play along the line of action [m].
    periods : int
        Number of mesh periods that the record spans.
    source : (c, n_positions) array, optional
        Loads along ``MechanicalSystem.sources``, such as the friction of the flanks [N, N m].
    """

    stiffness: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    backlash: np.ndarray
    periods: int = 1
    source: np.ndarray | None = None

    def __post_init__(self):
        freeze(self)

    @cached_property
    def every_harmonic(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All harmonics (n_meshes, L) of stiffness, deflection and force in the record, see `mesh_harmonics`."""
        most = (self.stiffness.shape[1] - 1) // 2
        stiffness, deflection, force = (
            harmonics_of(array, most) for array in (self.stiffness, self.deflection, self.force)
        )
        return stiffness, deflection, force

    def along_normal(self, cosine: float) -> MeshExcitation:
        """Turn what is along the line of action of the transverse section into what is along the tooth normal.

        Of a base helix angle of this ``cosine`` the force along the normal is 1/cos(beta_b) of that in the transverse
        section, the approach cos(beta_b) of it.
        """
        stiffness, force = self.stiffness / cosine**2, self.force / cosine
        return replace(
            self, stiffness=stiffness, deflection=self.deflection * cosine, force=force, backlash=self.backlash * cosine
        )


@dataclass(frozen=True)
class Modes:
    """Modal basis of a system whose meshes have their mean stiffness.

    Parameters
    ----------
    frequency : (n_modes,) array
        Undamped natural frequencies [Hz], ascending; zero for rigid-body modes.
    damping_ratio : (n_modes,) array
        Share of critical damping [1].
    shape : (n_dofs, n_modes) array
        Mass-normalised mode shapes [kg^-1/2].
    mesh_stiffness : (n_meshes,) array
        Mean mesh stiffness [N/m] that the modes contain.
    mesh_deflection : (n_meshes, n_modes) array
        Deflection of the mesh springs per unit of a mode, ``W^T shape`` without `MechanicalSystem.flexibility`
        [kg^-1/2].
    residual : (n_meshes, n_meshes) array
        Static flexibility of what the modes leave out, ``W^T K^+ W - sum r r^T / omega^2`` and
        `MechanicalSystem.flexibility` [m/N].
    load_deflection : (n_meshes,) array
        Static mesh deflection under the constant external load, ``W^T K^+ load`` [m], all modes included.
    kind : tuple of str
        Such as ``"rigid"``, ``"rotational"``, ``"translational"``, ``"planet"``, ``"ring"``.
    nodal_diameter : (n_modes,) int array
        Dominant number of nodal diameters of the ring, -1 where there is no ring.
    dofs : tuple of str
        Names of the degrees of freedom, as in `MechanicalSystem`; empty where they have none.
    modal_load : (n_modes,) array, optional
        ``shape^T load`` [N kg^-1/2]: what the constant external load does on each mode; ``None`` means no load.
    source_load : (n_modes, c) array, optional
        ``shape^T sources`` of `MechanicalSystem.sources` [kg^-1/2], of rigid modes too.
    source_residual : (n_meshes, c) array, optional
        Static mesh deflection per source that the modes leave out [m/N].
    """

    frequency: np.ndarray
    damping_ratio: np.ndarray
    shape: np.ndarray
    mesh_stiffness: np.ndarray
    mesh_deflection: np.ndarray
    residual: np.ndarray
    load_deflection: np.ndarray
    kind: tuple[str, ...]
    nodal_diameter: np.ndarray
    dofs: tuple[str, ...] = field(default=())
    modal_load: np.ndarray | None = None
    source_load: np.ndarray | None = None
    source_residual: np.ndarray | None = None

    def __post_init__(self):
        freeze(self)


@dataclass(frozen=True)
class Response:
    """Periodic response at one or many speeds, as complex harmonics of the mesh frequency.

    ``x(t) = Re sum_{h=0..H} X_h exp(i h omega t)`` with ``omega = 2 pi mesh_frequency / periods``.

    Parameters
    ----------
    mesh_frequency : (n_speeds,) array
        Mesh frequency [Hz].
    deflection : (n_speeds, n_meshes, H + 1) complex array
        Mesh spring deflection ``W^T q`` [m].
    force : (n_speeds, n_meshes, H + 1) complex array
        Mesh force [N].
    modal : (n_speeds, n_modes, H + 1) complex array
        Coordinates of the modes that were kept, without the residual part [m kg^1/2].
    converged : (n_speeds,) bool array
        Whether the residual is small enough.
    residual : (n_speeds,) array
        Relative residual of the harmonic equations.
    iterations : (n_speeds,) int array
        Iterations of the fixed point, also where it was given up; 0 with ``method="direct"``.
    spectral_radius : (n_speeds,) array
        Spectral radius of the fixed-point operator; the iteration contracts below one.
    tail : (n_speeds,) array
        Share of the amplitude in the upper half of the harmonics, a measure of truncation.
    lowest_force : (n_speeds,) array
        Lowest force of all meshes within the period [N]; teeth cannot pull.
    method : tuple of str
        ``"fixed point"`` or ``"direct"``, one a speed.
    message : str
        Method by number of speeds, and everything that is doubtful.
    periods : int
        Mesh periods in one period of the excitation record: harmonic ``h`` has the frequency
        ``h mesh_frequency / periods``.
    source : (n_speeds, c, H + 1) complex array, optional
        Loads of `MeshExcitation.source` that were kept at every speed [N, N m].
    """

    mesh_frequency: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    modal: np.ndarray
    converged: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    spectral_radius: np.ndarray
    tail: np.ndarray
    lowest_force: np.ndarray
    method: tuple[str, ...]
    message: str
    periods: int = 1
    source: np.ndarray | None = None

    def __post_init__(self):
        freeze(self)

    def without_lines(self) -> Response:
        """Give what is known of every speed, without the harmonics, which take the memory."""
        none = np.empty((len(self.mesh_frequency), 0, 0), complex)
        return replace(self, deflection=none, force=none, modal=none, source=None)


def gear_meshes(
    excitation: MeshExcitation,
    *,
    harmonics: int,
    columns=None,
    separates: bool = True,
    smoothing: float = 0.0,
    orders: tuple[int, ...] = (1,),
) -> GearMeshes:
    """Make the meshes of a static record, each series cut to ``harmonics`` mesh harmonics.

    Parameters
    ----------
    excitation : MeshExcitation
        Its zero backlashes mean that there is no back side.
    harmonics : int
        Mesh harmonics kept.
    columns : (g,) int array, optional
        Columns of ``W``; the first ones when not given.
    separates, smoothing
        Of `GearMeshes`.
    orders : tuple of int
        Orders of the mesh frequency; the record's own period counts ``periods`` mesh periods, so with
        ``periods`` above one the base frequency must be the mesh frequency over ``periods``.
    """
    count = harmonics * excitation.periods
    names = ("stiffness", "deflection", "force")
    series = {name: series_of(getattr(excitation, name), count, orders=orders) for name in names}
    backlash = np.where(excitation.backlash > 0.0, excitation.backlash, np.inf)
    columns = np.arange(len(excitation.stiffness)) if columns is None else columns
    return GearMeshes(columns, **series, backlash=backlash, separates=separates, smoothing=smoothing)


def mesh_harmonics(excitation: MeshExcitation, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the harmonics of stiffness, deflection and force of the meshes, ``count`` mesh harmonics each.

    [N/m], [m] and [N], (n_meshes, count periods + 1) complex each: a record of several periods keeps all its
    lines up to that frequency.

    CaseError: numbers that are not finite, arrays that do not fit each other, too few positions.
    """
    if count < 1 or int(count) != count:
        raise CaseError("at least one excitation harmonic is needed", code="E-HARMONICS", value=count)
    arrays = (excitation.stiffness, excitation.deflection, excitation.force)
    for name, array in zip(("stiffness", "deflection", "force"), arrays):
        if array.ndim != 2 or array.shape != excitation.stiffness.shape:
            raise CaseError(
                f"mesh {name} has shape {array.shape}, mesh stiffness {excitation.stiffness.shape}",
                code="E-SHAPE",
                limit="(n_meshes, n_positions), the same for all",
            )
        if not np.all(np.isfinite(array)):
            raise CaseError(f"mesh {name} holds numbers that are not finite", code="E-FINITE")
    if excitation.periods < 1:
        raise CaseError("the record spans no period", code="E-HARMONICS", value=excitation.periods)
    lines = int(count) * excitation.periods
    most = (excitation.stiffness.shape[1] - 1) // 2
    if lines > most:
        harmonics_of(excitation.stiffness, lines)  # says so
    stiffness, deflection, force = (
        lines_of_series[:, : lines + 1].copy() for lines_of_series in excitation.every_harmonic
    )
    return stiffness, deflection, force


def source_harmonics(excitation: MeshExcitation, count: int) -> np.ndarray | None:
    """Compute ``count`` mesh harmonics (c, count periods + 1) of the loads along the sources; None without any."""
    return None if excitation.source is None else harmonics_of(excitation.source, count * excitation.periods)


@dataclass(frozen=True)
class HarmonicForce:
    """``Re(force exp(i orders . theta))`` on the degrees of freedom, ``force`` (n,) complex [N, N m].

    ``orders`` are multiples of the base frequencies.
    """

    force: np.ndarray
    orders: tuple[int, ...] = (1,)

    def __post_init__(self):
        force = checked_numbers(self.force, "force", code="E-SHAPE", unit="N", kind=complex)
        object.__setattr__(self, "force", force)
        freeze(self)


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
    speed : float
        Speed that multiplies the gyroscopic matrix [rad/s].
    """

    system: MechanicalSystem
    elements: tuple[Element, ...]
    forces: tuple[HarmonicForce, ...] = ()
    speed: float = 0.0

    def __post_init__(self):
        check_matrices(self.system)
        n, columns = self.system.W.shape
        for element in self.elements:
            if element.columns.max(initial=-1) >= columns:
                raise CaseError(
                    f"an element acts on column {element.columns.max()} of {columns}",
                    code="E-SHAPE",
                    limit=f"0 to {columns - 1}",
                )
        for force in self.forces:
            if force.force.shape != (n,) or not np.all(np.isfinite(force.force)):
                raise CaseError(
                    f"a harmonic force of shape {force.force.shape} on {n} degrees of freedom",
                    code="E-SHAPE",
                    limit="one finite number a degree of freedom",
                )

    @property
    def damping(self) -> np.ndarray:
        """``C + speed G`` (n, n) [N s/m, ...]."""
        return damping_matrix(self.system, self.speed)

    @property
    def reference(self) -> np.ndarray:
        """Linear stiffness of every column near which the elements work, (n_columns,) [N/m]."""
        total = np.zeros(self.system.W.shape[1])
        for element in self.elements:
            np.add.at(total, element.columns, element.reference)
        return total

    @property
    def stiffness(self) -> np.ndarray:
        """``K + W c W^T`` (n, n) [N/m, ...] with the reference c of the columns [N/m]."""
        return self.system.K + (self.system.W * self.reference) @ self.system.W.T

    @property
    def bases(self) -> int:
        """Number of base frequencies that the elements and forces name."""
        orders = [force.orders for force in self.forces]
        for element in self.elements:
            orders += [series.orders for series in coefficients_of(element).values()]
        return max([len(o) for o in orders if any(o)], default=1)


def damping_matrix(system: MechanicalSystem, speed: float) -> np.ndarray:
    """Compute the damping ``C + speed G`` (n, n) [N s/m, ...] at a speed of rotation [rad/s]."""
    if system.gyroscopic is None or not speed:
        return system.C
    return system.C + speed * system.gyroscopic


def checked_bases(problem: NonlinearSystem, frequency) -> np.ndarray:
    """Check base frequencies (n_bases,) [rad/s]: finite and no more than elements and forces name.

    CaseError: not a list of finite numbers, or one too long (E-RANGE).
    """
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)):
        raise CaseError("base frequencies must be finite numbers", code="E-RANGE", key="frequency")
    if len(frequency) > problem.bases:
        raise CaseError(
            f"{len(frequency)} base frequencies, elements and forces name {problem.bases}",
            code="E-RANGE",
            key="frequency",
            value=frequency.tolist(),
            limit=f"{problem.bases} or fewer",
            remedy="leave out those that drive nothing, or give elements and forces one order a frequency",
        )
    return frequency


def element_forces(problem: NonlinearSystem, x, theta) -> tuple[np.ndarray, np.ndarray]:
    """Compute forces (..., n_columns) [N] and tangents (..., n_columns, n_columns) [N/m] of all elements.

    At deflections x (..., n_columns) [m] and phases theta (..., n_bases) of the base frequencies [rad].
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
    """Compute constant load and harmonic forces (..., n) [N, N m] at phases theta (..., n_bases) [rad]."""
    theta = np.asarray(theta, float)
    total = np.broadcast_to(problem.system.load, (*theta.shape[:-1], len(problem.system.load))).copy()
    for force in problem.forces:
        total += np.real(np.exp(1j * phase_of(theta, force.orders))[..., None] * force.force)
    return total


def tabulated_law(problem: NonlinearSystem, theta) -> Law:
    """Tabulate the forces and tangents of all elements beyond the reference stiffness, at known instants.

    These have the phases theta (n_times, n_bases) [rad]. The callable ``law(i, x (n_columns,) [m])`` gives
    ``f - c x`` (n_columns,) [N] and ``df/dx - c`` [N/m] with ``c`` the reference of the problem; the second
    is (n_columns,) where every element acts on single columns, else (n_columns, n_columns).
    """
    theta, reference = np.asarray(theta, float), problem.reference
    every = np.arange(len(reference))
    parts = [(element.columns, tabulated_element(element, theta)) for element in problem.elements]
    if not parts:
        nothing = np.zeros(len(reference))
        return lambda i, x: (nothing, nothing)
    if any(columns.shape[1] > 1 for columns, _ in parts):
        springs = np.diag(reference)

        def coupled(i, x):
            force, tangent = element_forces(problem, x, theta[i])
            return force - reference * x, tangent - springs

        return coupled
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
    """Write what to know of a constant load out of balance; empty where supports and elements take it up.

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


def check_matrices(
    system: MechanicalSystem, *, symmetric: tuple[str, ...] = ("M",), columns: int | None = None
) -> None:
    """Refuse matrices of wrong shapes (E-SHAPE), not finite (E-FINITE) or of wrong symmetries (E-SYMMETRY).

    Circulatory forces make K unsymmetric, which time integration takes: ``symmetric`` names those that must
    be. ``W`` has so many ``columns``; one or more when that is not given.
    """
    n = len(system.M)
    shapes = {"M": (n, n), "C": (n, n), "K": (n, n), "load": (n,), "gyroscopic": (n, n), "W": (n, columns)}
    if columns is None:
        shapes["W"] = (n, max(1, system.W.shape[-1]))
    for name, shape in shapes.items():
        array = getattr(system, name)
        if array is None:
            continue
        if array.shape != shape:
            raise CaseError(f"{name} has shape {array.shape}", code="E-SHAPE", limit=f"{shape}")
        if not np.all(np.isfinite(array)):
            raise CaseError(f"{name} holds numbers that are not finite", code="E-FINITE")
        sign = 1.0 if name in symmetric else -1.0 if name == "gyroscopic" else 0.0
        size = np.abs(array).max(initial=0.0)
        if sign and np.abs(array - sign * array.T).max(initial=0.0) > 1e-9 * size:
            kind = "symmetric" if sign > 0 else "skew-symmetric"
            raise CaseError(f"{name} is not {kind}", code="E-SYMMETRY", limit=f"{kind} to 1e-9")
