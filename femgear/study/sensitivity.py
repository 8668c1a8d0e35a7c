"""Derivatives of transmission error and load sharing with respect to anything that separates flanks.

While the touching cells A stay the same, the contact problem is linear,

    gap_A + H_AA p_A - G_A q = 0,    G_A^T p_A = load,    G_A = J B

with J (cells, meshes) telling the mesh of every cell and B the approach of the meshes per motion. Hence

    Z = H_AA^-1 J,    K = J^T Z,    S = B^T K B,    v = Z^T d gap
    d q = S^-1 B^T v,    d F = -(I - K B S^-1 B^T) v       (F = J^T p, the mesh forces)

One factorisation of H_AA gives the gradients of all motions and mesh forces with respect to the separation of
every cell (the adjoint of a linear system: M. B. Giles, N. A. Pierce, Flow, Turbulence and Combustion 65,
2000, 393-415). The chain rule goes on through the separations, which cost no contact solution.

What these derivatives are not: cells change sides at the rims of the contacts, where pressures vanish, so
over a finite step the exact function bends away from them. Extremes over positions and planets have kinks,
see `peak_to_peak_slopes`.

`tolerances` tells what an optimum loses when its variables are off by their tolerances: computed again, not
by derivatives, which a corner does not have.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.supports import RIGID, Supports
from femgear.errors import CaseError
from femgear.gears.deviations import (
    SetDeviations,
    body_separation,
    mirrored_deviations,
    no_deviations,
    profile_separation,
    tooth_separation,
)
from femgear.study.linearised import LinearContact, linear_positions
from femgear.study.objectives import Quantity
from femgear.study.problem import Failure
from femgear.study.relief import pin_error
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    from femgear.contact.bodies import Bodies
    from femgear.gears.planetary import PlanetarySet
    from femgear.study.problem import Evaluations
    from femgear.study.variables import Variable


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives per unit of one parameter, planets and positions in the order of the linearisation.

    Parameters
    ----------
    sun_arc : (P,) array
        Of the transmission error from sun to ring [m].
    deflection : (2N, P) array
        Of the transmission error of every mesh [m]; NaN for meshes of planets that carry nothing.
    force : (2N, P) array
        Of the mesh forces [N].
    share : (N, P) array
        Of the shares in the sun's torque; they add up to zero.
    """

    sun_arc: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    share: np.ndarray


@one_blas_thread()
def linearise(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    sun_torque: float,
    positions: int = 64,
    periods: int = 1,
    only=None,
    contact: str = "profile",
    cells: int = 36,
    deviations: SetDeviations | None = None,
    supports: Supports = RIGID,
) -> LinearContact:
    """Contact of all drive flanks and what it answers to small separations of any cell.

    Parameters
    ----------
    planetary_set, bodies, contact, cells, deviations, supports
        As for `contact.cycle.walk_mesh_cycle`.
    sun_torque : float
        [N m], not zero; a negative one loads the other flanks.
    positions, periods : int
        Positions in a mesh period, and mesh periods in the record.
    only : sequence of int, optional
        Numbers of the positions wanted; all of the record when left out.

    Returns
    -------
    LinearContact

    Raises
    ------
    CaseError
        E-TORQUE: no torque; E-RANGE: no such position; E-SUPPORT: bearings with clearance.
    ContactError
    """
    if not (np.isfinite(sun_torque) and sun_torque):
        raise CaseError("without torque nothing touches", code="E-TORQUE", value=sun_torque)
    record = positions * periods
    chosen = np.arange(record) if only is None else np.atleast_1d(np.asarray(only, int))
    if not len(chosen) or chosen.min() < 0 or chosen.max() >= record:
        raise CaseError("no such position", code="E-RANGE", value=only, limit=f"0 to {record - 1}")
    if supports.planet_clearance:
        raise CaseError(
            "bearings with clearance have no derivative here",
            code="E-SUPPORT",
            key="planet.bearing_clearance",
            value=supports.planet_clearance,
            limit="0 m",
        )
    return linear_positions(
        planetary_set,
        bodies,
        sun_torque,
        chosen,
        {"positions": positions, "periods": periods, "contact": contact, "cells": cells},
        deviations,
        supports,
    )


def sensitivity(
    linear: LinearContact, variant: Callable[[float], SetDeviations], value: float, *, step: float
) -> Sensitivity:
    """Derivatives with respect to one parameter of the deviations.

    Parameters
    ----------
    linear : LinearContact
        Of the set with the deviations ``variant(value)``.
    variant : callable
        Deviations (of the set as it is, not mirrored) for a value of the parameter, as those of
        `femgear.study.relief`.
    value : float
    step : float
        The separations are differentiated centrally over twice this; exact where they are linear in the
        parameter (amounts, pitch and pin errors).

    Returns
    -------
    Sensitivity
        Per unit of the parameter.

    Raises
    ------
    CaseError
        E-RANGE: a step that is not positive.
    """
    if not (np.isfinite(step) and step > 0):
        raise CaseError("a derivative needs a step", code="E-RANGE", value=step, limit="over 0")
    low, high = variant(value - step), variant(value + step)
    if linear.mirrored:
        low, high = (
            mirrored_deviations(deviations, linear.original, linear.solved, linear.order)
            for deviations in (low, high)
        )
    change = (separations(linear, high) - separations(linear, low)) / (2.0 * step)
    return _sensitivity(linear, change)


def _sensitivity(linear: LinearContact, change: np.ndarray) -> Sensitivity:
    """From the changes of the separations of all touching cells."""
    N, t = linear.solved.n_planets, linear.touching
    pushed = np.zeros((len(linear.position), 2 * N))
    np.add.at(pushed, t.at, t.weight * change[:, None])
    rows = linear.mesh_rows
    force = np.einsum("pij,pj->ip", linear.force_response, pushed)[rows]
    return Sensitivity(
        sun_arc=np.einsum("pj,pj->p", linear.arc_response, pushed),
        deflection=np.einsum("pij,pj->ip", linear.deflection_response, pushed)[rows],
        force=force,
        share=force[:N] / linear.load,
    )


def separations(linear: LinearContact, deviations: SetDeviations) -> np.ndarray:
    """What deviations of the solved set add to the separations of the touching cells, (M,) [m]."""
    s, t, N = linear.solved, linear.touching, linear.solved.n_planets
    total = body_separation(deviations, s, linear.solved_position)[t.mesh, t.at]
    for mesh in range(2 * N):
        rows = t.mesh == mesh
        total[rows] += tooth_separation(deviations, mesh, t.tooth_1[rows], t.tooth_2[rows])
    for kind in (0, 1):
        rows = t.mesh // N == kind
        total[rows] += profile_separation(deviations, s, kind, t.roll_1[rows], t.roll_2[rows])
    return total


def pin_sensitivities(linear: LinearContact) -> np.ndarray:
    """Change of all shares per displacement of every pin, (N shares, N pins, 2, P) [1/m].

    The third index is radial (outwards), tangential (counter-clockwise). Pin errors separate whole meshes,
    so these derivatives hold beside any other deviations.
    """
    ideal, N = no_deviations(linear.original), linear.original.n_planets
    found = [
        [
            sensitivity(linear, pin_error(ideal, planet=n + 1, direction=way), 0.0, step=1e-6).share
            for way in ("radial", "tangential")
        ]
        for n in range(N)
    ]
    return np.moveaxis(np.array(found), 2, 0)


def peak_to_peak_slopes(signal, change, *, step: float) -> tuple[float, float]:
    """Left and right derivative of a peak to peak value.

    The largest and the smallest of linear functions are convex and concave, so the peak to peak of
    ``signal + x change`` is convex in x and piecewise straight: its one-sided slopes are those of the
    positions that hold the extremes (J. M. Danskin, SIAM J. Appl. Math. 14, 1966). They differ where two
    positions share an extreme, as at the optimum of a relief; left is then below zero, right above. Over a
    finite step both are secants, which count positions that become the extreme one within it. Between the
    positions of the record the extreme may lie a little higher.

    Parameters
    ----------
    signal : (P,) or (K, P) array
        Of several signals the largest peak to peak counts.
    change : array of the same shape
        Derivative of every value per unit of the parameter.
    step : float
        Of the parameter to either side.

    Returns
    -------
    left, right : float
        Per unit of the parameter, left at most right.
    """
    return _slopes(lambda y: float(np.ptp(np.atleast_2d(y), axis=1).max()), signal, change, step)


def sharing_factor_slopes(share, change, *, step: float) -> tuple[float, float]:
    """Left and right derivative of the load sharing factor K_gamma = N max share.

    It has a kink where planets share the largest load, as those of an ideal set do: then both slopes
    point upwards, left below zero and right above. See `peak_to_peak_slopes`.

    Parameters
    ----------
    share : (N, P) array
        Shares at one position or at several.
    change : (N, P) array
        Derivative of every share per unit of the parameter.
    step : float
        Of the parameter to either side.
    """
    return _slopes(lambda y: len(y) * float(y.max()), share, change, step)


def _slopes(function, values, change, step):
    """Secants of a function of the values to the left and to the right."""
    values, change = np.asarray(values, float), np.asarray(change, float)
    if not (np.isfinite(step) and step > 0):
        raise CaseError("a slope needs a step", code="E-RANGE", value=step, limit="over 0")
    here = function(values)
    return (here - function(values - step * change)) / step, (function(values + step * change) - here) / step


@dataclass(frozen=True)
class Tolerance:
    """Quantities with one variable off by its tolerance.

    Parameters
    ----------
    variable : Variable
    tolerance : float
        In the unit of the variable.
    less, more : dict
        Value of every quantity by name [SI] with the variable lower and higher; NaN where that cannot be
        computed.
    """

    variable: Variable
    tolerance: float
    less: dict[str, float]
    more: dict[str, float]

    def slope(self, name: str, value: float) -> tuple[float, float]:
        """Rise of a quantity per unit of the variable towards less and towards more.

        Both are positive at a corner, where a derivative does not exist.
        """
        return (self.less[name] - value) / self.tolerance, (self.more[name] - value) / self.tolerance


def tolerances(
    evaluations: Evaluations, x: Sequence[float], quantities: Sequence[Quantity]
) -> tuple[tuple[Tolerance, ...], dict[str, float]]:
    """Every variable off by its tolerance, alone; and all of them at once, each to its worse side.

    Parameters
    ----------
    evaluations : Evaluations
    x : (n,) sequence
        The optimum, in the units of the variables. Points may lie outside the bounds.
    quantities : sequence of Quantity
        The first says which side is the worse one.

    Returns
    -------
    tuple of Tolerance
    dict
        Quantities by name, all variables off at once; NaN where that cannot be computed.
    """
    x, found = np.array(x, float), []
    worse = x.copy()
    for i, variable in enumerate(evaluations.problem.variables):
        tolerance = variable.tolerance_at(float(x[i]))
        sides = []
        for sign in (-1.0, 1.0):
            off = x.copy()
            off[i] += sign * tolerance
            sides.append(_values(evaluations, off, quantities))
        found.append(Tolerance(variable, tolerance, *sides))
        objective = [side[quantities[0].name] for side in sides]
        # a side that cannot be computed is no place to go
        if np.isfinite(objective).any():
            worse[i] += (-tolerance, tolerance)[int(np.nanargmax(objective))]
    return tuple(found), _values(evaluations, worse, quantities)


def _values(evaluations: Evaluations, x, quantities) -> dict[str, float]:
    """Quantities by name at a point; NaN where it cannot be computed."""
    try:
        return evaluations.values(x, quantities)
    except Failure:
        return {quantity.name: np.nan for quantity in quantities}
