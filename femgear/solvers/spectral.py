"""Periodic response of the gear meshes in the frequency domain, all speeds together."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers import operator
from femgear.solvers.harmonics import mesh_harmonics, multiply, pad, product_matrix, sample
from femgear.solvers.operator import HarmonicProblem, Twins
from femgear.system import MeshExcitation, Modes, Response

# Share of the energy in the upper half of the harmonics above which the message warns (amplitudes: its root).
_TAIL_ENERGY = 1e-6
# Speeds treated together: their receptances and matrices stay in the cache.
_BATCH = 40


def solve_spectral(
    modes: Modes,
    excitation: MeshExcitation,
    mesh_frequency,
    *,
    excitation_harmonics: int = 6,
    response_harmonics: int = 12,
    tolerance: float = 1e-6,
    method: str = "auto",
    max_iterations: int = 100,
) -> Response:
    """Periodic response at all mesh frequencies.

    The force of mesh j is ``f_j = F_j + k_j (d_j - s_j)`` (see MeshExcitation) with k, s and F cut to
    `excitation_harmonics`. With ``k~ = k - mean`` and the receptance T of the system that has the mean
    stiffnesses, the mesh deflections satisfy for every harmonic h

        ``d_h + T_h (k~ d)_h = S_h = d_load delta_h0 - T_h [F - k s]_h``

    which are Eqs. (7) to (12) of "Vibratory response of planetary gear sets housing by a spectral iterative
    approach"; its iteration is ``E <- S - T G E`` from ``E = S``.

    Parameters
    ----------
    modes : Modes
        Basis with mesh stiffnesses near the mean of the excitation.
    excitation : MeshExcitation
    mesh_frequency : float or (n_speeds,) array
        [Hz], not negative; zero gives the static response.
    excitation_harmonics, response_harmonics : int
        Mesh harmonics kept in the data and in the response; products are formed without aliasing.
    tolerance : float
        Relative change at which the fixed point stops, and relative residual of a converged solution.
    method : {"auto", "fixed point", "direct"}
        ``"auto"`` uses the fixed point where its spectral radius promises convergence within
        `max_iterations` and the direct solution of the same equations elsewhere.
    max_iterations : int
        Of the fixed point.

    Returns
    -------
    Response
        Where ``converged`` is False (only with ``method="fixed point"``) the harmonics are NaN.

    Raises
    ------
    CaseError
        Data that cannot be used: not finite, negative frequencies, too few positions.
    ConvergenceError
        An undamped resonance, or equations that even the direct solution does not satisfy.
    """
    frequency = _checked(modes, excitation, mesh_frequency, method, tolerance, max_iterations)
    if response_harmonics < excitation_harmonics:
        raise CaseError(
            f"{response_harmonics} response harmonics cannot follow {excitation_harmonics} of the excitation",
            code="E-HARMONICS", key="response_harmonics", value=response_harmonics,
            limit=f">= {excitation_harmonics}, better twice as many",
        )  # fmt: skip
    count = response_harmonics * excitation.periods
    data = _Data.build(modes, excitation, excitation_harmonics, count)
    options = (method, tolerance, max_iterations)
    parts = [
        _solve_batch(modes, data, frequency[start : start + _BATCH] / excitation.periods, options)
        for start in range(0, len(frequency), _BATCH)
    ]
    joined = [np.concatenate(part) for part in zip(*parts)]
    deflection, force, modal, residual, iterations, radius, direct = joined
    converged = residual <= tolerance
    if method != "fixed point" and not np.all(converged):
        worst = int(np.argmax(np.where(np.isfinite(residual), residual, np.inf)))
        raise ConvergenceError(
            f"residual {residual[worst]:.3e} of the harmonic equations at {frequency[worst]:.6g} Hz",
            code="E-RESONANCE", limit=f"{tolerance:.1e}",
            remedy="the equations are nearly singular there: give the modes more damping or move the speed",
        )  # fmt: skip
    for array in (deflection, force, modal):
        array[~converged] = np.nan
    tail = _tail(deflection)
    return Response(
        mesh_frequency=frequency, deflection=deflection, force=force, modal=modal, converged=converged,
        residual=residual, iterations=iterations, spectral_radius=radius, tail=tail,
        method=tuple("direct" if flag else "fixed point" for flag in direct),
        message=_message(frequency, converged, direct, radius, tail, force), periods=excitation.periods,
    )  # fmt: skip
