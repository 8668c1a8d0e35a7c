"""Two-way response of a planetary set and a housing that stands still, in orders of the carrier.

Gears and carrier do not change with time in the frame of the carrier, ring and casing do not in space. Mesh j
stands at the housing angle ``phi_j + s theta``, ``theta = |Omega_c| t``, s the sense of the carrier, and
everything repeats after a turn. With ``x(t) = sum_L x[L] exp(i L theta)``, modes m of the structure, their
receptances H_m and circumferential coefficients P (`femgear.housing.structure.FixedStructure`)

    q_m[K] = H_m(K Omega) sum_j sum_n conj(P[m, n]) exp(-i n phi_j) f_j[K + s n]
    u_j[L] = sum_m sum_n P[m, n] exp(i n phi_j) q_m[L - s n]                   (what the ring gives way)
    d_j[L] = d_load delta_L0 - sum_k T_jk(L Omega) (f - k0 d)_k[L]             (gears against a rigid ring)
    f_j    = F_j + k_j (d_j - u_j - ste_j),

a harmonic transfer function (N. M. Wereley, Analysis and Control of Linear Periodically Time Varying Systems,
PhD thesis, MIT, 1991). k, F and ste have orders that are multiples of z_ring: the gears couple L with L + p
z_ring alone, the structure the side bands of one mesh harmonic. Orders are ``h z_ring + r``, |h| <= H,
|r| <= 2 n_max. A set that is the same after a turn by ``2 pi/N`` repeats itself in time, ``f_j(theta) =
f_i(theta + s (phi_j - phi_i))``: one of N planets is solved for, and q_m[K] vanishes unless N divides K, on
any structure.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_count
from femgear.housing.carrier_orders import (
    CarrierOrders,
    LeadingMeshes,
    MeshPaths,
    equations,
    mirrored,
    planet_groups,
    receptance,
    ring_load,
    two_sided,
)
from femgear.housing.sensor import ReadOnlyArrays, carrier_turns
from femgear.housing.set_damping import set_damping
from femgear.housing.structure import FixedStructure
from femgear.housing.turning_errors import TurningErrors, solve_turning_errors
from femgear.system.system import MeshExcitation, Modes, mesh_harmonics

_EQUAL, _RESIDUAL, _RESIDUAL_ERRORS = 1e-9, 1e-8, 1e-6
"""Part of the largest harmonic by which meshes that repeat others may differ; residual that is refused, and
that with errors that turn, which are iterated upon."""
_MEMORY, _MOST, _BYTES = 6e7, 4e9, 130
"""Size of the speeds that are solved together, of one at most, and of one unknown times one [bytes]."""


@dataclass(frozen=True)
class TwoWayResponse(ReadOnlyArrays):
    """Forces of the meshes over carrier orders: ``Re sum_k force[k] exp(i order[k] |carrier_speed| t)``.

    Parameters
    ----------
    carrier_speed : (n_speeds,) array
        [rad/s], counter-clockwise positive.
    order : (n_orders,) array
        From 0 upwards; multiples of 1/turns.
    force : (n_speeds, 2 G, n_orders) complex array
        Of the sun-planet, then the planet-ring meshes of the G planets that the others repeat [N].
    residual : (n_speeds,) array
        Of the planet-ring forces in their equations, over their norm. With errors that turn, or the change
        of the deflections in the last pass if that is larger.
    tail : (n_speeds,) array
        Share of the fluctuating planet-ring forces beyond n_max side bands (root of energies), a measure of
        truncation.
    harmonics, side_bands : int
        Mesh harmonics H, and side bands on either side of each.
    drag : (n_speeds, n_lines, m) complex array, optional
        Two-sided modal forces on the structure [N kg^-1/2] by the damping of the set beyond that of its
        modes, at the orders of `structure_lines`.
    turns : int
        Turns of the carrier after which all repeats.
    """

    carrier_speed: np.ndarray
    order: np.ndarray
    force: np.ndarray
    residual: np.ndarray
    tail: np.ndarray
    harmonics: int
    side_bands: int
    paths: MeshPaths
    drag: np.ndarray | None = None
    turns: int = 1

    def at(self, some) -> TwoWayResponse:
        """Response at the speeds number ``some`` alone."""
        names = ("carrier_speed", "force", "residual", "tail")
        parts = {name: getattr(self, name)[some] for name in names}
        return replace(self, **parts, drag=None if self.drag is None else self.drag[some])


def solve_two_way(
    gears: Modes,
    excitation: MeshExcitation,
    structure: FixedStructure,
    paths: MeshPaths,
    carrier_speed,
    *,
    harmonics: tuple[int, int] = (6, 12),
    side_bands: int | None = None,
    damping=None,
) -> TwoWayResponse:
    """Solve for the mesh forces of a set in a housing that stands still, at all speeds.

    CaseError: data that do not belong together, planets that do not repeat one another (E-SYMMETRY),
    E-MEMORY.

    Parameters
    ----------
    gears : Modes
        Of gears and carrier with mean mesh stiffnesses against a rigid ring: N sun-planet, then N planet-ring
        meshes. Without `damping` what damps them acts against the ring at rest.
    excitation : MeshExcitation
        Of the 2N meshes; their stiffness without what the structure is elastic. Over several mesh periods
        with errors that turn: then the symmetry is that of the places of the planets and of the modes.
    carrier_speed : (n_speeds,) array
        [rad/s], counter-clockwise positive, all of one direction.
    harmonics : (int, int)
        Mesh harmonics kept in the data, and in the response.
    side_bands : int, optional
        Of every harmonic of the forces; default ``2 n_max``. An axisymmetric structure makes none.
    damping : (n, n) array, optional
        Of gears and ring as a whole, see `femgear.housing.set_damping.set_damping` [N s/m, ...]; without it
        gears and structure have each the modal damping of its own.
    """
    n_max, angles = structure.max_diameter, np.asarray(paths.planet_angles, float)
    speeds = _checked(gears, excitation, carrier_speed, paths, n_max, harmonics)
    groups, bands = planet_groups(angles, paths.symmetry), 2 * n_max if side_bands is None else side_bands
    orders = CarrierOrders(paths, harmonics[1], n_max, bands, int(np.sign(speeds[0])))
    if excitation.periods > 1:
        known = gears, excitation, harmonics[0], structure, orders, groups
        return _turning(TurningErrors(*known, damping=damping), speeds)
    return _one_period(gears, excitation, structure, orders, groups, speeds, harmonics[0], damping)


def _one_period(
    gears: Modes, excitation: MeshExcitation, structure: FixedStructure, orders: CarrierOrders, groups,
    speeds: np.ndarray, harmonics: int, damping,
) -> TwoWayResponse:  # fmt: skip
    """Response of a set without errors that turn, the forces of planets that the others repeat."""
    paths, n_max, angles = orders.paths, orders.n_max, np.asarray(orders.paths.planet_angles, float)
    leaders, bands, H = groups[0], orders.side_bands, orders.harmonics
    one_sided = mesh_harmonics(excitation, harmonics)
    _check_repeated(one_sided, orders, *groups)
    stiffness, deflection, force = (two_sided(one[[*leaders, *(len(angles) + leaders)]]) for one in one_sided)
    known, place = LeadingMeshes.build(gears, stiffness, orders, *groups), angles[leaders] + paths.load_angle
    source = np.zeros((*known.product.shape[:2], 2 * bands + 1), complex)
    wide = (0, 0), (H - harmonics,) * 2
    deflection, force = np.pad(deflection, wide), np.pad(force, wide)
    source[..., bands] = force - np.einsum("mhk,mk->mh", known.product, deflection)
    count, n_orders = len(place), len(orders.positive)
    # of one speed [bytes]
    size = _BYTES * (count * n_orders) ** 2
    if size > _MOST:
        message = f"{count} planets with {n_orders} carrier orders need {size / 1e9:.2g} GB"
        raise CaseError(message, code="E-MEMORY", remedy="take fewer mesh harmonics or nodal diameters")
    # without side bands what the ring gives way takes more than the unknowns
    step = max(int(_MEMORY / (size + _BYTES * (2 * n_max + 1) ** 3)), 1)
    drag, order = None, orders.meeting()[0]
    if damping is not None:
        placed: Any = {"symmetry": paths.symmetry, "sense": orders.sense}
        damping = set_damping(damping, gears, structure, orders.solved, orders.meeting(), **placed)
        drag = np.empty((len(speeds), (order >= 0).sum(), len(structure.natural_frequency)), complex)
    force = np.empty((len(speeds), 2 * count, n_orders), complex)
    residual, tail = np.empty((2, len(speeds)))
    outer = np.abs(orders.every - np.arange(-H, H + 1)[:, None] * paths.z_ring) > n_max

    def solve(first: int) -> None:
        speed = np.abs(speeds[first : first + step])
        for i, one in enumerate(equations(known, structure, place, orders, speed, damping), first):
            found = one.solve(source)
            kept = found.force.reshape(2 * count, -1)[:, -n_orders:]
            force[i] = kept * np.where(np.arange(n_orders) == 0, 1, 2)
            residual[i], tail[i] = found.residual, _share(found.force[count:], outer, orders.every == 0)
            if drag is not None and found.drag is not None:
                drag[i] = found.drag[order >= 0]

    workers = max(min(os.cpu_count() or 1, int(_MOST / 10 / (size * step))), 1)
    with ThreadPoolExecutor(workers) as pool:  # BLAS and LAPACK do not hold up one another
        list(pool.map(solve, range(0, len(speeds), step)))
    _check_residual(residual, speeds)
    return TwoWayResponse(speeds, orders.positive, force, residual, tail, H, bands, paths, drag)


def _turning(errors: TurningErrors, speeds: np.ndarray) -> TwoWayResponse:
    """Response of a set with errors that turn, the forces of all its planets."""
    orders, sense = errors.orders, errors.orders.sense
    turns = carrier_turns(orders.paths.z_ring, errors.periods)
    number, force, residual, tail, drag = solve_turning_errors(
        errors, np.abs(speeds), lambda met: structure_numbers(met, turns * sense * orders.n, 1)
    )
    _check_residual(residual, speeds, _RESIDUAL_ERRORS)
    order, paths = number if turns == 1 else number / turns, replace(orders.paths, symmetry=1)
    size = orders.harmonics, orders.side_bands
    return TwoWayResponse(speeds, order, force, residual, tail, *size, paths, drag, turns)


def structure_lines(structure: FixedStructure, response: TwoWayResponse) -> tuple[np.ndarray, np.ndarray]:
    """Compute the lines of the sensors of a structure under forces that run around in it.

    Carrier orders (n_orders,) from 0, multiples of the symmetry, and displacements
    (n_speeds, n_sensors, n_orders) [m] of ``u(t) = Re sum_k u[k] exp(i order[k] |carrier_speed| t)``. The
    sensors stand still: nothing is modulated after that.
    """
    paths, turns, speed = response.paths, response.turns, np.abs(response.carrier_speed)
    leaders = planet_groups(paths.planet_angles, paths.symmetry)[0]
    n = np.arange(-structure.max_diameter, structure.max_diameter + 1)
    number = np.rint(response.order * turns).astype(int)
    across = turns * int(np.sign(response.carrier_speed[0])) * n
    heard = structure_numbers(number, across, paths.symmetry * turns if paths.symmetry > 1 else 1)
    both = np.concatenate([-number[:0:-1], number])
    met = heard[:, None] + across
    back = np.minimum(np.searchsorted(both, met), len(both) - 1)
    back = np.where(both[back] == met, back, len(both))
    place = np.array(paths.planet_angles)[leaders] + paths.load_angle
    ring = mirrored(response.force[:, len(place) :] * np.where(number == 0, 1.0, 0.5))
    order = heard if turns == 1 else heard / turns
    lines = np.empty((len(speed), len(order), structure.sensor_shape.shape[1]), complex)
    for i in range(len(speed)):  # one by one: modes at all orders of all speeds would fill the memory
        load = ring_load(paths.symmetry, ring[i], place, n, back)
        modal = load @ structure.ring_shape.conj().T
        if response.drag is not None:
            modal += response.drag[i]
        modal *= receptance(structure, speed[i], order)
        lines[i] = load @ structure.sensor_residual.T + modal @ structure.sensor_shape
    lines = np.swapaxes(lines, 1, 2) * np.where(order == 0, 1.0, 2.0)
    return order, np.where(order == 0, np.real(lines), lines)


def structure_numbers(number: np.ndarray, across: np.ndarray, symmetry: int) -> np.ndarray:
    """Orders (n_K,) of a structure, from 0, that forces of orders (n_L,) from 0 reach across its waves (n,).

    All counted in the same whole numbers; multiples of the symmetry alone.
    """
    met = np.unique(np.concatenate([number, -number])[:, None] - across)
    return met[(met >= 0) & (met % symmetry == 0)]


def _share(force: np.ndarray, outer: np.ndarray, still: np.ndarray) -> float:
    """Share (root of energies) of the fluctuating forces (..., n_h, R) that is at the outer side bands."""
    energy = np.where(still, 0.0, np.abs(force) ** 2)
    return float(np.sqrt(energy[..., outer].sum() / max(energy.sum(), np.finfo(float).tiny)))


def _checked(gears, excitation, carrier_speed, paths, n_max, harmonics) -> np.ndarray:
    """Speeds (n_speeds,) [rad/s] of data that belong together."""
    checked_count(harmonics[0], "excitation harmonics", code="E-HARMONICS")
    checked_count(harmonics[1], "response harmonics", code="E-HARMONICS", least=harmonics[0])
    teeth = checked_count(paths.z_ring, "ring teeth", code="E-TEETH")
    if teeth <= 6 * n_max:
        message = f"side bands of {n_max} nodal diameters overlap between the harmonics of {teeth} teeth"
        raise CaseError(message, code="E-RANGE", limit=f"up to {(teeth - 1) // 6} nodal diameters")
    meshes = len(gears.mesh_stiffness), len(excitation.stiffness), 2 * len(paths.planet_angles)
    if len({*meshes}) > 1:
        message = f"modes, excitation and planets of {meshes} meshes do not fit each other"
        raise CaseError(message, code="E-SHAPE", limit="two meshes a planet")
    speeds = np.atleast_1d(np.asarray(carrier_speed, float))
    sense = np.unique(np.sign(speeds))
    if speeds.ndim != 1 or len(sense) != 1 or sense[0] == 0 or not np.isfinite(speeds).all():
        message, limit = "speeds of the carrier must be one list", "finite, of one direction, none zero"
        raise CaseError(message, code="E-SPEED", key="carrier_speed", value=carrier_speed, limit=limit)
    return speeds


def _check_residual(residual: np.ndarray, speeds: np.ndarray, limit: float = _RESIDUAL) -> None:
    """Refuse equations that are singular at a speed (n_speeds,) [rad/s] (E-RESONANCE)."""
    if not (residual < limit).all():
        worst = int(np.argmax(np.where(np.isfinite(residual), residual, np.inf)))
        message = f"residual {residual[worst]:.3e} of the two-way equations at {speeds[worst]:.6g} rad/s"
        remedy = "give gears and structure some damping"
        raise ConvergenceError(message, code="E-RESONANCE", limit=f"{limit:g}", remedy=remedy)


def _check_repeated(one_sided, orders: CarrierOrders, leaders, group, turn) -> None:
    """Refuse planets whose meshes do not repeat those of their leaders (E-SYMMETRY)."""
    N, harmonic = orders.paths.symmetry, np.arange(one_sided[0].shape[1])
    # whole turns have no rounding
    whole = turn[:, None] * harmonic * (orders.sense * orders.paths.z_ring % N)
    shift = np.exp(2j * np.pi * (whole % N) / N)
    for name, values in zip(("stiffness", "deflection", "force"), one_sided):
        apart = max(np.abs(half - shift * half[leaders][group]).max() for half in np.split(values, 2))
        if apart > _EQUAL * np.abs(values).max():
            raise CaseError(
                f"the {name} of equal planets differs by {apart / np.abs(values).max():.2e} of its largest "
                "harmonic", code="E-SYMMETRY", key="symmetry", value=N, limit=f"{_EQUAL:g}",
                remedy="take symmetry 1, which solves for every planet",
            )  # fmt: skip
