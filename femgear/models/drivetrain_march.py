"""Newmark's method for a drivetrain through time: meshes that are linear, or separate.

A step is linear in the state and in the loads (`femgear.models.drivetrain_step`); meshes that part add the
search for the flanks that touch (`femgear.models.drivetrain_separation`). Beside the motion goes the free one
without loads, whose growth tells a parametric resonance (`femgear.models.drivetrain_growth`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain import DrivetrainModel
from femgear.models.drivetrain_books import Books, Ledger
from femgear.models.drivetrain_checks import check_free_spin
from femgear.models.drivetrain_contacts import contact_model
from femgear.models.drivetrain_growth import FreeMotion, piece_length
from femgear.models.drivetrain_record import Record
from femgear.models.drivetrain_separation import Separating, check_pushing
from femgear.models.drivetrain_start import start_state
from femgear.models.drivetrain_step import MeshBlock, Scheme, Spin, march_closed
from femgear.models.drivetrain_torque import TorqueHistory
from femgear.solvers.newmark import AVERAGE_ACCELERATION, StepRule

_BLOCK = 4096


@dataclass(frozen=True)
class DrivetrainRun:
    """Motion of a drivetrain, recorded every few steps.

    Parameters
    ----------
    time : (n,) array
        [s]
    outputs : tuple of str
    motion, velocity : (n, n_outputs) arrays
        Deviations from the free spin [m, rad].
    approach, force : (n, n_meshes) arrays
        Of the drive flanks [m]; of the meshes, drive less back flank [N].
    spin, spin_speed : (n,) arrays
        Angle and speed of the first body without its deviation [rad], [rad/s].
    meshes, ledger
        Names, energies.
    drift : float
        Largest spin found in the deviations after a block, before it was taken out [rad].
    momentum : float
        Error of the angular momentum about the first body's axis, over the largest impulse or momentum.
    steps : int
    step : float
        [s]
    extremes : (2, n_meshes) array
        Least and largest force at any step [N], whatever is recorded.
    pulling : (n_meshes,) array
        Share of the steps with a negative force: of a linear mesh that pulls, or of a back flank that pushes
        more than the drive flank.
    lost : (n_meshes,) array
        Share of the steps in which no flank touches; zeros where meshes are linear.
    contact_loss : bool
    growth : float
        Mean rate of the logarithm of the free motion after the first third of the run [1/s]; NaN where
        nothing moves but the spin.
    gain : float
        Largest growth of the free motion between any two instants of the run, as a factor; NaN likewise.
    """

    time: np.ndarray
    outputs: tuple[str, ...]
    motion: np.ndarray
    velocity: np.ndarray
    approach: np.ndarray
    force: np.ndarray
    spin: np.ndarray
    spin_speed: np.ndarray
    meshes: tuple[str, ...]
    ledger: Ledger
    drift: float
    momentum: float
    steps: int
    step: float
    extremes: np.ndarray
    pulling: np.ndarray
    lost: np.ndarray
    contact_loss: bool
    growth: float
    gain: float


def march_drivetrain(
    model: DrivetrainModel,
    torques: Sequence[TorqueHistory],
    *,
    duration: float,
    step: float,
    speed: float,
    start="static",
    outputs: Sequence[str] | None = None,
    every: int = 1,
    lowpass: bool = False,
    rule: StepRule = AVERAGE_ACCELERATION,
    separate_spin: bool = True,
    contact_loss: bool = False,
) -> DrivetrainRun:
    """Step a drivetrain through time.

    Parameters
    ----------
    model : DrivetrainModel
    torques : sequence of TorqueHistory
    duration, step : float
        [s]. Any step is taken; cases are refused below four steps a mesh period (`check_drivetrain`, E-RATE),
        and warned of below thirty and of modes that the step lowers (W-RATE).
    speed : float
        Of the first body at the start [rad/s]; gyroscopic terms keep this value.
    start : {"static", "zero"} or pair of (n,) arrays
        Deviations and their velocities: static under the first loads, none (loads set in suddenly), or given.
    outputs : sequence of str, optional
        Coordinates to record; all rotations when not given.
    every : int
        Steps between records.
    lowpass : bool
        Records are low-passed (`femgear.models.drivetrain_record.Decimator`), so that nothing beyond half
        their rate appears as something else; False takes the motion at these instants as it is.
    rule : StepRule
        Newmark's gamma and beta; without the averaging of generalised alpha.
    separate_spin : bool
        False integrates the spin with the rest, to show what it does.
    contact_loss : bool
        Drive flanks part, and back flanks touch after the backlash; False lets meshes pull.

    Raises
    ------
    CaseError
        Steps and durations that are none, an explicit or averaged rule (E-STEP, E-STEP-RULE), a start that
        does not fit (E-START), bearings that hold the rotation (E-BEARING), a negative stiffness of meshes
        that separate (E-STIFFNESS).
    ConvergenceError
        The motion outgrows the numbers (E-DIVERGED); no flanks fit a step (E-CONTACT-STATE).
    """
    _check(model, duration, step, every, rule)
    count = max(1, round(duration / step))
    stepped = contact_model(model) if contact_loss else model
    track = Spin(stepped, torques, step, speed, separate_spin)
    scheme = Scheme.of(stepped, rule, step, speed, track.directions)
    names = _outputs(model, outputs)
    at = np.array([model.index(name) for name in names], int)
    if contact_loss:
        check_pushing(model, track.table)
    record = Record(model, count, every, at, lowpass=lowpass, contact_loss=contact_loss)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = _Motion(model, scheme, track, start, count, contact_loss)
        books = Books(stepped, scheme, track, motion.state)
        for first in range(0, count, _BLOCK):
            states, block = motion.block(first, min(_BLOCK, count - first))
            books.add(states, block)
            books.check(
                states, block, first=first, exact=(rule.gamma, rule.beta) == (0.5, 0.25),
                free=motion.free, contact_loss=contact_loss,
            )  # fmt: skip
            record.take(first, len(states) - 1, states, block)
            motion.state = books.without_drift(states[-1]) if separate_spin else states[-1].copy()
    return DrivetrainRun(
        step * every * np.arange(count // every + 1), names, *record.columns(), model.meshes, books.ledger(),
        books.drift, books.momentum_error(), count, step,
        record.extremes, record.pulled / record.steps, record.lost / record.steps, contact_loss,
        motion.free.growth(), motion.free.gain(),
    )  # fmt: skip


def _check(model, duration, step, every, rule) -> None:
    if not (np.isfinite(duration) and np.isfinite(step) and 0.0 < step <= duration):
        raise CaseError(
            f"{duration} s in steps of {step} s", code="E-STEP", limit="0 < step <= duration", key="step"
        )
    if int(every) != every or every < 1:
        raise CaseError(f"every {every} steps", code="E-STEP", key="every", limit="1 or more")
    if rule.mass or rule.force or rule.beta < 0.25 or rule.gamma < 0.5:
        raise CaseError(
            f"the rule {rule} is not stable for any step", code="E-STEP-RULE",
            limit="Newmark's rules with gamma of 1/2 or more and beta of 1/4 or more",
        )  # fmt: skip
    check_free_spin(model)


def _outputs(model, outputs) -> tuple[str, ...]:
    if outputs is None:
        return tuple(name for name in model.system.dofs if name.endswith("rotation"))
    return tuple(outputs)


class _Motion:
    """The motion and the free motion beside it, block by block."""

    def __init__(self, model, scheme, track, start, count, contact_loss):
        self.scheme, self.track, self.piece = scheme, track, piece_length(count)
        self.meshes = len(model.meshes)
        contacts = model.contacts if contact_loss else None
        self.state = start_state(model, scheme, track, start, contacts=contacts)
        self.free = FreeMotion(model, scheme)
        self.free_row = self.free.start()
        self.march = march_closed
        if contact_loss and model.meshes:
            self.march = Separating(contacts.gap, self.meshes).march

    def block(self, first: int, number: int):
        """States (number + 1, 2 n + m) of the next steps, and their loads and meshes."""
        scheme, h = self.scheme, self.track.step
        block = self.track.block(first, number)
        meshes = MeshBlock.of(scheme, block, self.meshes)
        loads = block.loads[:-1] @ scheme.loads_before + block.loads[1:] @ scheme.loads_after
        rows = np.empty((number + 1, 2, len(scheme.advance)))
        rows[0] = scheme.row(self.state), self.free_row
        for begin in range(0, number, self.piece):
            end = min(begin + self.piece, number)
            self.march(scheme, meshes, loads, rows, range(begin, end))
            rows[end, 1] = self.free.renewed(rows[end, 1], h * (first + end))
        self.free_row = rows[-1, 1].copy()
        return scheme.states(rows[:, 0]), block
