"""A system with meshes as a model between inputs and outputs: in modes, and as matrices A, B, C, D.

The law of a mesh, ``f = k_m (x - e)``, has its mean stiffness k_m and one input, the displacement e of the flanks. With
the transmission error as e it is the linear model. ``e = x - f / k_m`` of any other force f(x, t) makes the same
matrices those of a stiffness that varies, or of flanks that part.

What modes leave out stands in the matrices as its static flexibility, so that they have the receptance of
`femgear.solvers.periodic.spectral` to the last digit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.modal import pseudo_solve, rigid_basis, spring_directions
from femgear.system.system import MechanicalSystem, Modes, freeze


@dataclass(frozen=True)
class Port:
    """An input or an output of a system.

    Parameters
    ----------
    name : str
    unit : str
        Of an output in the unit "rad" the rate is an output, too.
    direction : (n,) array
        Of an input the load on every coordinate per unit of it; of an output its value per unit of every coordinate.
    nominal : float
        Value of an input about which the system is linear.
    accelerates : bool
        Of an output in the unit "m": whether its acceleration is an output, too.
    """

    name: str
    unit: str
    direction: np.ndarray
    nominal: float = 0.0
    accelerates: bool = False

    def __post_init__(self):
        freeze(self)


@dataclass(frozen=True)
class ModalModel:
    """Modes, what excites them, and what is seen of them; c inputs, M meshes, p outputs, m modes.

    ``eta'' + 2 zeta omega eta' + omega^2 eta = input_rows^T u - mesh_rows^T g`` with the mesh forces ``f = k_m x + g``
    and their deflections ``x = mesh_rows eta - mesh_residual g + mesh_by_input u``.

    Parameters
    ----------
    omega, damping_ratio : (m,) arrays
        Natural frequencies [rad/s], 0 of rigid modes, and shares of critical damping [1].
    mesh_stiffness : (M,) array
        Mean mesh stiffnesses k_m [N/m].
    mesh_rows : (M, m) array
        Deflection of the meshes per unit of a mode [kg^-1/2].
    mesh_residual : (M, M) array
        Static flexibility of the meshes that the modes leave out [m/N].
    mesh_by_input : (M, c) array
        Static deflection of the meshes per input that the modes leave out.
    input_rows : (c, m) array
        Modal load per input.
    output_rows : (p, m) array
        Outputs per unit of a mode.
    output_by_mesh, output_by_input : (p, M), (p, c) arrays
        Static outputs per mesh force g, and per input, that the modes leave out.
    meshes : tuple of str
    inputs, outputs : tuples of Port
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    mesh_stiffness: np.ndarray
    mesh_rows: np.ndarray
    mesh_residual: np.ndarray
    mesh_by_input: np.ndarray
    input_rows: np.ndarray
    output_rows: np.ndarray
    output_by_mesh: np.ndarray
    output_by_input: np.ndarray
    meshes: tuple[str, ...]
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]

    def __post_init__(self):
        freeze(self)

    @property
    def nominal(self) -> np.ndarray:
        """Values (c,) of the inputs about which the system is linear."""
        return np.array([port.nominal for port in self.inputs])

    @property
    def rotations(self) -> np.ndarray:
        """Numbers (n,) of the outputs that are rotations."""
        return np.flatnonzero([port.unit == "rad" for port in self.outputs])

    @property
    def accelerations(self) -> np.ndarray:
        """Numbers (n,) of the outputs whose accelerations are outputs, too."""
        return np.flatnonzero([port.accelerates for port in self.outputs])


@dataclass(frozen=True)
class StateSpace:
    """``x' = A x + B u``, ``y = C x + D u``.

    Parameters
    ----------
    A, B, C, D : (2m, 2m), (2m, M + c), (p, 2m), (p, M + c) arrays
        The states are the coordinates of the m modes, then their rates.
    states, inputs, outputs : tuples of str
        Names. The first M inputs are displacements of flanks, the first 2 M outputs deflections and forces of meshes.
    state_units, input_units, output_units : tuples of str
    nominal : (M + c,) array
        Inputs about which the system is linear, of the meshes zero.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    nominal: np.ndarray

    def __post_init__(self):
        freeze(self)


def modal_model(
    system: MechanicalSystem,
    modes: Modes,
    *,
    meshes: Sequence[str],
    inputs: Sequence[Port],
    outputs: Sequence[Port] = (),
) -> ModalModel:
    """Make the model between inputs and outputs of a system in its modes.

    Loads of the system that no input makes at its nominal value are one more input, "other loads", of the value 1.

    Parameters
    ----------
    system : MechanicalSystem
        Without gyroscopic terms; friction of its ``sources`` is an input each.
    modes : Modes
        Of this system.
    meshes : sequence of str
        Names of the columns of ``W``.
    inputs, outputs : sequences of Port

    Raises
    ------
    CaseError
        Names or directions that do not fit the system (E-SHAPE).

    Notes
    -----
    Friction moves no rigid mode, as in `femgear.solvers.periodic.spectral.solve_spectral`: its mean is in balance, and
    what it leaves strains nothing. Residual flexibility: Geradin and Rixen, Mechanical Vibrations, 3rd ed., section
    2.9, as in `femgear.solvers.linear.modal.undamped_modes`.
    """
    n, count = system.W.shape
    if len(meshes) != count or any(len(port.direction) != n for port in (*inputs, *outputs)):
        raise CaseError("names or directions do not fit the system", code="E-SHAPE", limit=f"{count} meshes, {n} rows")
    inputs = [*inputs, *_other_loads(system, inputs)]
    inputs += (rubbing := _friction(system, meshes))
    loads = np.array([port.direction for port in inputs]).reshape(-1, n).T
    rows = np.array([port.direction for port in outputs]).reshape(-1, n)
    springs, omega = spring_directions(system, modes.mesh_stiffness), 2.0 * np.pi * modes.frequency
    inverse = np.where(omega > 0.0, 1.0 / np.where(omega > 0.0, omega, 1.0) ** 2, 0.0)
    static = pseudo_solve(*rigid_basis(system, modes), np.hstack([springs, loads]))
    by_mesh, by_input = static[:, :count], static[:, count:]
    modal, moved = loads.T @ modes.shape, rows @ modes.shape
    modal[len(inputs) - len(rubbing) :, omega == 0.0] = 0.0
    in_modes = inverse[:, None] * modal.T
    return ModalModel(
        omega=omega,
        damping_ratio=modes.damping_ratio,
        mesh_stiffness=modes.mesh_stiffness,
        mesh_rows=modes.mesh_deflection,
        mesh_residual=modes.residual,
        mesh_by_input=springs.T @ by_input - modes.mesh_deflection @ in_modes,
        input_rows=modal,
        output_rows=moved,
        output_by_mesh=rows @ by_mesh - (moved * inverse) @ modes.mesh_deflection.T,
        output_by_input=rows @ by_input - moved @ in_modes,
        meshes=tuple(meshes),
        inputs=tuple(inputs),
        outputs=tuple(outputs),
    )


def _other_loads(system: MechanicalSystem, inputs: Sequence[Port]) -> list[Port]:
    """What the inputs at their nominal values leave of the constant load, as one input."""
    rest = system.load - sum(port.nominal * port.direction for port in inputs)
    if np.abs(rest).max(initial=0.0) <= 1e-12 * np.abs(system.load).max(initial=0.0):
        return []
    return [Port("other loads", "1", rest, 1.0)]


def _friction(system: MechanicalSystem, meshes: Sequence[str]) -> list[Port]:
    """What friction does along every mesh and about it, and what the output takes of it, as inputs."""
    if system.sources is None:
        return []
    names = [(f"friction force of {mesh}", "N") for mesh in meshes]
    names += [(f"friction moment of {mesh}", "N m") for mesh in meshes] + [("friction at the output", "N m")]
    if system.sources.shape[1] != len(names):
        raise CaseError("the sources are not those of friction", code="E-SHAPE", limit=f"{len(names)} columns")
    return [Port(name, unit, column) for (name, unit), column in zip(names, system.sources.T, strict=True)]


def state_space(model: ModalModel) -> StateSpace:
    """Make the matrices of a model, whose inputs are displacements of flanks, then those of the model.

    Outputs are deflections [m] and forces [N] of the meshes, the outputs of the model, the rates of its rotations, and
    accelerations of those that have one. Rates and accelerations are those of the modes, without what these leave out.
    """
    m, k, turning = len(model.omega), model.mesh_stiffness, model.rotations
    nothing, flanks = np.zeros((m, m)), model.mesh_rows.T * k
    A = np.block([[nothing, np.eye(m)], [-np.diag(model.omega**2), -np.diag(2.0 * model.damping_ratio * model.omega)]])
    loads = np.hstack([flanks, model.input_rows.T])
    B = np.vstack([np.zeros_like(loads), loads])
    deflection = np.hstack([model.mesh_residual * k, model.mesh_by_input])
    force = k[:, None] * deflection
    force[:, : len(k)] -= np.diag(k)
    # g = - k_m e
    seen = np.hstack([model.output_by_mesh * k, model.output_by_input])
    rates, shaken = model.output_rows[turning], model.output_rows[model.accelerations]
    modal = np.vstack([model.mesh_rows, k[:, None] * model.mesh_rows, model.output_rows, np.zeros_like(rates)])
    speeds = np.vstack([np.zeros((len(modal) - len(rates), m)), rates])
    modal, speeds = np.vstack([modal, shaken @ A[m:, :m]]), np.vstack([speeds, shaken @ A[m:, m:]])
    D = np.vstack([deflection, force, seen, np.zeros((len(rates), seen.shape[1])), shaken @ loads])
    rotating = [model.outputs[number] for number in turning]
    shaking = [model.outputs[number] for number in model.accelerations]
    return StateSpace(
        A=A,
        B=B,
        C=np.hstack([modal, speeds]),
        D=D,
        states=tuple(f"{word} {number + 1}" for word in ("mode", "rate of mode") for number in range(m)),
        inputs=(*(f"displacement of {mesh}" for mesh in model.meshes), *(port.name for port in model.inputs)),
        outputs=(
            *(f"{word} of {mesh}" for word in ("deflection", "force") for mesh in model.meshes),
            *(port.name for port in model.outputs),
            *(f"{port.name} rate" for port in rotating),
            *(f"{port.name} acceleration" for port in shaking),
        ),
        state_units=("m kg^1/2",) * m + ("m kg^1/2/s",) * m,
        input_units=("m",) * len(k) + tuple(port.unit for port in model.inputs),
        output_units=(
            *("m",) * len(k),
            *("N",) * len(k),
            *(port.unit for port in model.outputs),
            *("rad/s",) * len(rotating),
            *("m/s^2",) * len(shaking),
        ),
        nominal=np.concatenate([np.zeros(len(k)), model.nominal]),
    )
