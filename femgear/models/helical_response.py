"""Forced response of planetary sets to transmission errors by modal summation: meshes, pins, bearings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.modal import residual_output
from femgear.system import MechanicalSystem, Modes

# Distance to an undamped pole, relative to it, below which the response is infinite.
_RESONANT = 1e-12


@dataclass(frozen=True)
class ErrorResponse:
    """Response of several cases to transmission errors on harmonics of the mesh frequency.

    Parameters
    ----------
    mesh_frequency : (F,) array
        [Hz]
    harmonics : (H,) int array
    deflection : (n_cases, F, H, n_columns) complex array
        ``W^T q`` [m]: the dynamic transmission error of every mesh or slice.
    force : (n_cases, F, H, n_columns) complex array
        Dynamic mesh force ``k (W^T q - e)`` [N].
    output : (n_cases, F, H, n_outputs) complex array
    """

    mesh_frequency: np.ndarray
    harmonics: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    output: np.ndarray


def modal_error_response(
    system: MechanicalSystem, modes: Modes, mesh_frequency, error, *, harmonics=None, outputs=None
) -> ErrorResponse:
    """Response to transmission errors ``e_j(t) = Re sum_h error_jh exp(i h omega_m t)`` by summing modes.

    ``q = sum phi (phi^T W k e) / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)``, with the static
    flexibility of modes that were left out (Geradin and Rixen, Mechanical Vibrations, 3rd ed., section 2.9;
    A. Kahraman, J. Mech. Des. 116, 1994, 713-720, sums all modes). Many cases share one gain. A transmission
    error does no work on rigid motions, so that these stay at rest.
    `femgear.solvers.frequency_response.mesh_error_response` is the direct solution.

    Parameters
    ----------
    system : MechanicalSystem
    modes : Modes
        Of that system; ``modes.mesh_stiffness`` are the stiffnesses ``k`` of the columns of ``W``.
    mesh_frequency : (F,) array
        [Hz]
    error : (n_columns, H) or (n_cases, n_columns, H) complex array
        [m]; of one case the result has a first axis of length one. For phases phi_j as fractions of the mesh
        period, ``k_j(tau) = k(tau + phi_j)``, it is ``e_h exp(2 pi i h phi_j)``, see `phased_errors`.
    harmonics : (H,) int array, optional
        Whole numbers from 1; 1 to H when not given.
    outputs : (n_outputs, n) array, optional
        ``L``, such as the rows of `spring_loads`; none when not given.

    Raises
    ------
    CaseError
        Errors or harmonics that do not fit (E-SHAPE), harmonics or frequencies that are none (E-HARMONICS,
        E-FREQUENCY).
    ConvergenceError
        An undamped resonance (E-RESONANCE).
    """
    k, count = modes.mesh_stiffness, len(system.M)
    error, harmonics = _errors(error, harmonics, len(k))
    frequency = _frequencies(mesh_frequency)
    rows = np.empty((0, count)) if outputs is None else np.atleast_2d(np.asarray(outputs, float))
    elastic = modes.frequency > 0.0
    left = np.vstack([system.W.T, rows]) @ modes.shape[:, elastic]
    gain = _gain(modes, elastic, np.outer(frequency, harmonics))
    # forces k e of the errors on the meshes, and on the modes
    push = k[:, None] * error
    modal = np.einsum("jm,cjh->chm", modes.mesh_deflection[:, elastic], push)
    static = np.zeros((len(error), len(harmonics), len(left)))
    if modes.shape.shape[1] < count:
        rest = np.vstack([modes.residual, residual_output(system, modes, rows)])
        static = np.einsum("oj,cjh->cho", rest, push)
    answer = np.empty((len(error), len(frequency), len(harmonics), len(left)), complex)
    for h in range(len(harmonics)):
        answer[:, :, h] = (gain[:, h] * modal[:, None, h]) @ left.T + static[:, None, h]
    deflection, output = answer[..., : len(k)], answer[..., len(k) :]
    force = k * (deflection - error.transpose(0, 2, 1)[:, None])
    return ErrorResponse(frequency, harmonics, deflection, force, output)


def phased_errors(amplitudes, phases) -> np.ndarray:
    """Transmission errors (n_meshes, H) of meshes that follow each other.

    Parameters
    ----------
    amplitudes : (H,) or (n_meshes, H) complex array
        Harmonics 1 to H at phase zero [m].
    phases : (n_meshes,) array
        phi_j as fractions of the mesh period, ``e_j(tau) = e(tau + phi_j)``: `PlanetarySet.mesh_phases`.
    """
    amplitudes, phases = np.asarray(amplitudes, complex), np.asarray(phases, float)
    turns = phases[:, None] * np.arange(1, amplitudes.shape[-1] + 1)
    return amplitudes * np.exp(2j * np.pi * turns)


def spring_loads(springs: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and rows (n_outputs, n) that read the loads of springs from the coordinates.

    Parameters
    ----------
    springs : mapping of str to (columns (n, g), stiffness (g,))
        From `helical_springs` or `planar_springs`; those of meshes give ``k W^T q`` without the transmission
        error, whose force is in `ErrorResponse.force`.

    Returns
    -------
    names : tuple of str
        The name of the spring, with ``1`` and ``2`` behind it where it has two columns or more.
    rows : (n_outputs, n) array
        [N/m, N m/rad and the like]
    """
    names, rows = [], []
    for name, (columns, stiffness) in springs.items():
        several = len(stiffness) > 1
        names += [f"{name} {i + 1}" if several else name for i in range(len(stiffness))]
        rows.append((columns * stiffness).T)
    return tuple(names), np.vstack(rows)


def _errors(error, harmonics, columns: int) -> tuple[np.ndarray, np.ndarray]:
    error = np.asarray(error, complex)
    error = error[None] if error.ndim == 2 else error
    harmonics = np.arange(1, error.shape[-1] + 1) if harmonics is None else np.atleast_1d(harmonics)
    if harmonics.ndim != 1 or harmonics.dtype.kind not in "iu" or np.any(harmonics < 1):
        raise CaseError(
            f"harmonics {harmonics.tolist()} of the mesh frequency", code="E-HARMONICS", key="harmonics",
            limit="whole numbers from 1", remedy="the mean of a transmission error is a static load",
        )  # fmt: skip
    if error.shape[1:] != (columns, len(harmonics)) or not np.all(np.isfinite(error)):
        raise CaseError(
            f"transmission errors of shape {error.shape}", code="E-SHAPE",
            limit=f"(cases, {columns} meshes, {len(harmonics)} harmonics), finite",
        )  # fmt: skip
    return error, harmonics


def _frequencies(mesh_frequency) -> np.ndarray:
    frequency = np.atleast_1d(np.asarray(mesh_frequency, float))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)) or np.any(frequency < 0.0):
        raise CaseError(
            f"mesh frequencies of shape {frequency.shape}", code="E-FREQUENCY", key="mesh_frequency",
            limit="a list of numbers >= 0 Hz",
        )  # fmt: skip
    return frequency


def _gain(modes: Modes, elastic: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """``1 / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)`` (F, H, m)."""
    natural, w = 2.0 * np.pi * modes.frequency[elastic], 2.0 * np.pi * frequency[..., None]
    below = natural**2 - w**2 + 2j * modes.damping_ratio[elastic] * natural * w
    bad = np.abs(below) <= _RESONANT * np.maximum(natural**2, w**2)
    if np.any(bad):
        mode = int(np.argwhere(bad)[0, -1])
        raise ConvergenceError(
            f"undamped resonance at {natural[mode] / (2 * np.pi):.6g} Hz: infinite response",
            code="E-RESONANCE", remedy="give the motion some damping or move the frequency",
        )  # fmt: skip
    return 1.0 / below
