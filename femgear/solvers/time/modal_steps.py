"""Steps in modal coordinates that are exact for the linear part: only the column forces are interpolated.

Between two instants the forces are linear in time (see `convolution`), so a linear system has no period error
and no damping of the step; the column forces beyond the reference stiffness are of second order. Modes that
are left out count as static flexibility.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.modal import output_load, residual_output, solve_modes
from femgear.solvers.time.convolution import step_matrices
from femgear.system.fourier import phase_of
from femgear.system.system import Modes, NonlinearSystem


@dataclass(frozen=True)
class ModalScheme:
    """Exact modal steps; the state is (y, v) of the modes, (2, m). See `newmark.Scheme`."""

    step: float
    modes: Modes
    transition: np.ndarray
    first: np.ndarray
    last: np.ndarray
    pushed: np.ndarray
    drawn: np.ndarray
    flexibility: np.ndarray
    rows: np.ndarray
    loads: np.ndarray
    static: np.ndarray
    static_columns: np.ndarray
    residual: np.ndarray
    problem: NonlinearSystem
    factorisations: int = 1

    def start(self, q, v, theta, law):
        """Modal state of the motion; the part of modes that are left out is dropped."""
        carried = self.problem.system.M @ self.modes.shape
        state = np.stack([q @ carried, v @ carried])
        x = self.rows @ state[0] + (self._waves(theta[:1]) @ self.static_columns).real[0]
        g, _ = law(0, x)
        return state, g

    def _waves(self, theta):
        wave = np.array([np.exp(1j * phase_of(theta, f.orders)) for f in self.problem.forces])
        return np.vstack([np.ones((1, len(theta))), wave.reshape(-1, len(theta))]).T

    def table(self, theta):
        """What the loads add in n steps, (n, 2 m + n_c): to y and v, then to the columns at the ends."""
        wave = self._waves(theta)
        modal = (wave @ self.loads).real
        push = modal[:-1, None] * self.first + modal[1:, None] * self.last
        static = (wave[1:] @ self.static_columns).real
        return np.hstack([push.reshape(len(push), -1), static])

    def free(self, state, g, load):
        """(y, v) at the end of the step without the column forces there."""
        out = (self.transition * state).sum(axis=1)
        out -= (self.pushed @ g).reshape(out.shape)
        out += load[: out.size].reshape(out.shape)
        return out

    def deflection(self, state, load):
        """Columns (n_c,) but for the static flexibility under their own forces."""
        return self.rows @ state[0] + load[state.size :]

    def finish(self, state, g):
        """(y, v) at the end of the step."""
        return state - (self.drawn @ g).reshape(state.shape)

    def columns(self, states, g, theta):
        """(..., n_c)."""
        own = self.problem.system.W.T @ self.residual
        return states[..., 0, :] @ self.rows.T - g @ own + (self._waves(theta) @ self.static_columns).real

    def motion(self, states, g, theta):
        """Displacements and velocities (n, dofs); modes left out count in the displacements only."""
        static = (self._waves(theta) @ self.static).real - g @ self.residual.T
        return states[:, 0] @ self.modes.shape.T + static, states[:, 1] @ self.modes.shape.T, None

    def local_error(self, states, g):
        """Modal norm of what a parabola through three column forces would add: ``drawn d(dg) / 12``.

        The linear interpolation misses ``g'' t (h - t) / 2``, whose mean is ``h^2 g'' / 12``.
        """
        if len(g) < 3:
            return np.zeros(len(g) - 1)
        bend = np.diff(g, n=2, axis=0)
        bend = np.vstack([bend[:1], bend])
        return np.linalg.norm(bend @ (self.drawn + self.pushed)[: len(self.rows.T)].T, axis=1) / 12.0


def modal_scheme(problem: NonlinearSystem, step: float, *, count=None, max_frequency=None) -> ModalScheme:
    """Modes with the reference stiffnesses of the columns and their exact steps.

    Raises
    ------
    CaseError
        Damping that couples the modes, gyroscopic terms, negative reference stiffnesses (see
        `femgear.solvers.linear.modal.solve_modes`).
    """
    system = problem.system
    if system.gyroscopic is not None and problem.speed and np.any(system.gyroscopic):
        raise CaseError(
            "modal steps cannot carry gyroscopic terms", code="E-GYROSCOPIC", key="method",
            remedy='take method "average acceleration" or "generalised alpha"',
        )  # fmt: skip
    system = replace(system, gyroscopic=None)
    modes = solve_modes(system, problem.reference, count=count, max_frequency=max_frequency)
    natural, every = 2.0 * np.pi * modes.frequency, np.eye(len(system.M))
    transition, first, last = step_matrices(natural, modes.damping_ratio, step)
    rows = modes.mesh_deflection
    pushed, drawn = ((part[:, :, None] * rows.T).reshape(-1, len(rows)) for part in (first.T, last.T))
    residual = residual_output(system, modes, every)
    loads, static = [modes.modal_load], [output_load(system, modes, every)]
    for force in problem.forces:
        loads.append(modes.shape.T @ force.force)
        static.append(
            _static(system, modes, force.force.real) + 1j * _static(system, modes, force.force.imag)
        )
    elastic = np.where(natural > 0.0, natural, np.inf)
    loads = np.array(loads, complex)
    static = np.array(static) - (loads / elastic**2) @ modes.shape.T
    return ModalScheme(
        step, modes, np.ascontiguousarray(transition.transpose(1, 2, 0)), first.T, last.T, pushed, drawn,
        rows @ drawn[: len(natural)] + system.W.T @ residual, rows, loads, static, static @ system.W,
        residual, problem,
    )  # fmt: skip


def _static(system, modes, force):
    """Elastic displacement under a force, all modes."""
    return output_load(replace(system, load=force), modes, np.eye(len(force)))
