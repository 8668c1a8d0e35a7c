"""Frequency response by dense solutions, to mesh errors and by complex modes; resonance peaks.

Of one viscously damped mode ``1 / |H|^2`` is a parabola in ``x = f^2`` (D. J. Ewins, Modal Testing, 2nd ed.,
2000, section 4.2), which makes parabolic interpolation exact; a verdict says whether modes overlap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.modal import ComplexModes, modal_damping, total_stiffness
from femgear.solvers.linear.receptance import MeshErrorResponse, _checked, _resonance
from femgear.system.system import MechanicalSystem, damping_matrix

# Bytes of dynamic stiffness that are solved in one batch.
_BATCH = 2**26
# Shift of the half-power band against the peak, relative to the band, of a mode that stands alone.
_ALONE = 0.05
# Samples inside the half-power band that its interpolation needs.
_SAMPLES = 5


@dataclass(frozen=True)
class DirectResponse(MeshErrorResponse):
    """The same with outputs ``L q`` (F, H, n_outputs), complex."""

    output: np.ndarray


@dataclass(frozen=True)
class ResonancePeak:
    """One peak of a displacement response.

    Parameters
    ----------
    frequency : float
        Interpolated peak [Hz]; ``f_n sqrt(1 - 2 zeta^2)`` of a single mode.
    natural_frequency : float
        ``f_n`` [Hz] of the single mode with this peak and band; NaN without a band.
    amplitude : float
        Interpolated, in the unit of the response.
    damping_ratio : float
        From the half-power band; NaN where the response does not fall to it on both sides.
    band : (float, float)
        Half-power frequencies [Hz].
    asymmetry : float
        Distance between the peak and the middle of the band, in squares of frequency, over the band's width:
        zero for a single mode.
    verdict : str
        ``"separate"``; ``"overlapping"`` where the response rises again before the end of the band, or the
        band is not symmetric, so that the damping belongs to no single mode; ``"incomplete"`` where the
        frequencies end before the band, as under heavy damping; ``"coarse"`` with too few samples in it.
    """

    frequency: float
    natural_frequency: float
    amplitude: float
    damping_ratio: float
    band: tuple[float, float]
    asymmetry: float
    verdict: str


def direct_response(
    system: MechanicalSystem,
    frequency,
    inputs,
    outputs,
    *,
    mesh_stiffness,
    speed: float = 0.0,
    damping_ratio=None,
) -> np.ndarray:
    """``L (K' + i omega D - omega^2 M)^-1 B`` by one dense solution a frequency, many in a batch.

    Parameters
    ----------
    system : MechanicalSystem
    frequency : (F,) array
        [Hz], positive or zero.
    inputs : (n, n_inputs) array
        ``B``, one column a force; `unit_force` makes them from names.
    outputs : (n_outputs, n) array
        ``L``.
    mesh_stiffness : (n_meshes,) array
        [N/m]
    speed : float
        That multiplies the gyroscopic matrix [rad/s].
    damping_ratio : float or (n,) array, optional
        Modal damping that is added to ``C``; see `modal.modal_damping`.

    Returns
    -------
    (F, n_outputs, n_inputs) complex array
        Receptances [m/N and the like].

    Raises
    ------
    CaseError
        Arrays that do not fit (E-SHAPE), frequencies that are none (E-RANGE).
    ConvergenceError
        An undamped resonance, or rigid motions at frequency zero (E-RESONANCE).
    """
    omega, inputs, outputs = _checked(frequency, inputs, outputs, len(system.M))
    stiffness = total_stiffness(system, mesh_stiffness)
    damping = damping_matrix(system, speed)
    if damping_ratio is not None:
        bare = replace(system, gyroscopic=None, C=np.zeros_like(system.C))
        damping = damping + modal_damping(bare, mesh_stiffness, damping_ratio)
    result = np.empty((len(omega), len(outputs), inputs.shape[1]), complex)
    step = max(1, _BATCH // (16 * len(stiffness) ** 2))
    for start in range(0, len(omega), step):
        w = omega[start : start + step, None, None]
        dynamic = stiffness - w**2 * system.M + 1j * w * damping
        try:
            result[start : start + step] = outputs @ np.linalg.solve(dynamic, inputs.astype(complex))
        except np.linalg.LinAlgError as error:
            f = w.ravel() / (2.0 * np.pi)
            raise _resonance(f"between {f[0]:.6g} and {f[-1]:.6g} Hz") from error
    if not np.all(np.isfinite(result)):
        bad = np.flatnonzero(~np.isfinite(result).all(axis=(1, 2)))[0]
        raise _resonance(f"at {omega[bad] / (2.0 * np.pi):.6g} Hz")
    return result


def mesh_error_response(
    system: MechanicalSystem,
    mesh_frequency,
    error,
    *,
    mesh_stiffness,
    harmonics=None,
    outputs=None,
    speed: float = 0.0,
    damping_ratio=None,
) -> DirectResponse:
    """Response to transmission errors ``e_j(t) = Re sum_h error_jh exp(i h omega_m t)`` of the meshes.

    A mesh transmits ``k_j (W_j^T q - e_j)``, so that its error drives the set by ``W_j k_j e_j``
    (A. Kahraman, J. Mech. Des. 116, 1994, 713-720).

    Parameters
    ----------
    system : MechanicalSystem
    mesh_frequency : (F,) array
        [Hz]
    error : (n_meshes, H) complex array
        Amplitude of every harmonic at every mesh [m], with its phase: for equal meshes
        ``e(tau + phi_j)`` of the phases ``phi_j`` (fractions of the mesh period) ``e_h exp(2 pi i h phi_j)``.
    mesh_stiffness : (n_meshes,) array
        [N/m]
    harmonics : (H,) int array, optional
        1 to H when not given.
    outputs : (n_outputs, n) array, optional
        ``L``; none when not given.
    speed, damping_ratio
        See `direct_response`.

    Raises
    ------
    CaseError
        As `direct_response`, and errors or harmonics that do not fit (E-SHAPE).
    """
    error, k = np.asarray(error, complex), np.asarray(mesh_stiffness, float)
    harmonics = np.arange(1, error.shape[-1] + 1) if harmonics is None else np.asarray(harmonics)
    if error.shape != (len(k), len(harmonics)) or not np.all(np.isfinite(error)):
        raise CaseError(
            f"transmission errors of shape {error.shape}",
            code="E-SHAPE",
            limit=f"({len(k)} meshes, {len(harmonics)} harmonics), finite",
        )
    mesh_frequency = np.atleast_1d(np.asarray(mesh_frequency, float))
    rows = np.empty((0, len(system.M))) if outputs is None else np.atleast_2d(np.asarray(outputs, float))
    # one receptance from every mesh serves all phases
    transfer = direct_response(
        system,
        np.outer(mesh_frequency, harmonics).ravel(),
        system.W * k,
        np.vstack([system.W.T, rows]),
        mesh_stiffness=k,
        speed=speed,
        damping_ratio=damping_ratio,
    )
    transfer = transfer.reshape(len(mesh_frequency), len(harmonics), -1, len(k))
    answer = np.einsum("fhoj,jh->fho", transfer, error)
    deflection = answer[..., : len(k)]
    return DirectResponse(mesh_frequency, harmonics, deflection, k * (deflection - error.T), answer[..., len(k) :])


def complex_modal_response(modes: ComplexModes, frequency, inputs, outputs) -> np.ndarray:
    """Receptance (F, n_outputs, n_inputs) as a sum over complex modes, with any viscous and gyroscopic terms.

    ``sum (L x)(y^H B) / (i omega - lambda)`` over all poles (Ewins, section 2.7), with the displacement of
    rigid motions as their velocity over ``i omega``.

    Parameters
    ----------
    modes : ComplexModes
    frequency, inputs, outputs
        See `direct_response`.
    """
    omega = 2.0 * np.pi * np.asarray(frequency, float)[:, None]
    poles = np.concatenate([modes.eigenvalue, modes.eigenvalue[modes.paired].conj()])
    gain = 1.0 / (1j * omega - poles)
    shape, drift, left = (
        np.hstack([array, array[:, modes.paired].conj()]) for array in (modes.shape, modes.drift, modes.left)
    )
    force = left.conj().T @ inputs
    result = np.einsum("ok,fk,ki->foi", outputs @ shape, gain, force)
    if np.any(drift):
        result += np.einsum("ok,fk,ki->foi", outputs @ drift, gain / (1j * omega), force)
    return result


def unit_force(system: MechanicalSystem, *names: str) -> np.ndarray:
    """One column (n, len(names)) a name of a degree of freedom; its transpose reads displacements.

    Raises
    ------
    CaseError
        A name that the system does not have (E-CHOICE).
    """
    columns = np.zeros((len(system.M), len(names)))
    for column, name in enumerate(names):
        if name not in system.dofs:
            raise CaseError(
                f"no degree of freedom {name!r}",
                code="E-CHOICE",
                limit=", ".join(system.dofs),
            )
        columns[system.dofs.index(name), column] = 1.0
    return columns


def resonance_peaks(frequency, response, *, prominence: float = 0.05) -> tuple[ResonancePeak, ...]:
    """Peaks of ``|response|``, lowest frequency first.

    Parameters
    ----------
    frequency : (F,) array
        [Hz], ascending.
    response : (F,) complex or real array
        A receptance (displacement over force), or its size.
    prominence : float
        Height above the neighbouring valley, relative to the peak, that makes a peak.

    Raises
    ------
    CaseError
        Arrays that are no response (E-RANGE).

    Notes
    -----
    Of one viscously damped mode ``1 / |H|^2`` is a parabola in ``x = f^2`` (Ewins, Modal Testing, 2nd ed.,
    section 4.2), which makes parabolic interpolation exact. The half-power points satisfy
    ``(x_2 - x_1) / x_peak = 2 tan(2 asin zeta)``, of which ``2 zeta = (f_2 - f_1) / f`` is the limit.
    """
    from scipy.signal import find_peaks

    f, size = np.asarray(frequency, float), np.abs(np.asarray(response))
    if f.ndim != 1 or f.shape != size.shape or not np.all(np.isfinite(size)) or np.any(np.diff(f) <= 0.0):
        raise CaseError(
            "no response to search for peaks",
            code="E-RANGE",
            limit="finite values over ascending frequencies, as many of both",
        )
    places, properties = find_peaks(size, prominence=0.0)
    places = places[properties["prominences"] >= prominence * size[places]]
    return tuple(_peak(f**2, size, int(i)) for i in places)


def _peak(x: np.ndarray, size: np.ndarray, i: int) -> ResonancePeak:
    """The peak at sample ``i`` of the response over ``x = f^2``, from parabolas of ``1 / |H|^2``."""
    # values relative to the peak keep the parabolas well scaled
    inverse = (size[i] / np.maximum(size, 1e-9 * size[i])) ** 2
    c = _parabola(x, inverse, i)
    shift = -0.5 * c[1] / c[2]
    top, lowest = x[i] + shift, c[0] + 0.5 * shift * c[1]
    edges, amplitude = _half_power(x, inverse, i, 2.0 * lowest), size[i] / np.sqrt(lowest)
    peak = float(np.sqrt(top))
    if isinstance(edges, str):
        nan = float("nan")
        return ResonancePeak(peak, nan, float(amplitude), nan, (nan, nan), nan, edges)
    low, high = edges
    ratio = np.sin(0.5 * np.arctan(0.5 * (high - low) / top))
    asymmetry = abs(0.5 * (high + low) - top) / (high - low)
    inside = np.count_nonzero((x >= low) & (x <= high))
    verdict = "coarse" if inside < _SAMPLES else "separate" if asymmetry <= _ALONE else "overlapping"
    natural = peak / np.sqrt(1.0 - 2.0 * ratio**2)
    band = (float(np.sqrt(low)), float(np.sqrt(high)))
    return ResonancePeak(peak, float(natural), float(amplitude), float(ratio), band, float(asymmetry), verdict)


def _parabola(x: np.ndarray, y: np.ndarray, i: int) -> np.ndarray:
    """Coefficients of the parabola in ``x - x_i`` through samples i - 1, i, i + 1."""
    near = slice(i - 1, i + 2)
    return np.linalg.solve(np.vander(x[near] - x[i], 3, increasing=True), y[near])


def _half_power(x: np.ndarray, inverse: np.ndarray, i: int, level: float) -> tuple[float, ...] | str:
    """Where ``inverse`` reaches the level on both sides, or why it does not."""
    edges = []
    for step in (-1, 1):
        line = inverse[i::step]
        above = np.flatnonzero(line >= level)
        if np.any(np.diff(line[: above[0] + 1] if len(above) else line) < 0.0):
            return "overlapping"
        if not len(above):
            return "incomplete"
        last = i + step * int(above[0])
        middle = min(max(last - step if above[0] > 1 else i, 1), len(x) - 2)
        c = _parabola(x, inverse, middle)
        roots = np.roots([c[2], c[1], c[0] - level])
        lo, hi = sorted((x[last] - x[middle], x[last - step] - x[middle]))
        # the level lies between two samples of the parabola, so that one root does
        edges.append(x[middle] + min(roots.real, key=lambda r: abs(r - np.clip(r, lo, hi))))
    return tuple(edges)
