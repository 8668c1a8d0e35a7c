"""Two-way response of a planetary set and a housing that stands still, in orders of the carrier.

Gears and carrier do not change with time in the frame of the carrier, ring and casing do not in space. Mesh j
stands at the housing angle ``phi_j + s theta``, ``theta = |Omega_c| t``, s the sense of the carrier, and
everything repeats after a turn. With ``x(t) = sum_L x[L] exp(i L theta)``, modes m of the structure, their
receptances H_m and circumferential coefficients P (`femgear.housing.two_way.structure.FixedStructure`)

    q_m[K] = H_m(K Omega) sum_j sum_n conj(P[m, n]) exp(-i n phi_j) f_j[K + s n]
    u_j[L] = sum_m sum_n P[m, n] exp(i n phi_j) q_m[L - s n]                   (what the ring gives way)
    d_j[L] = d_load delta_L0 - sum_k T_jk(L Omega) (f - k0 d)_k[L]             (gears against a rigid ring)
    f_j    = F_j + k_j (d_j - u_j - ste_j),

a harmonic transfer function (N. M. Wereley, Analysis and Control of Linear Periodically Time Varying Systems,
PhD thesis, MIT, 1991). With ``k = k0 + kappa(t)`` and k0 the mean all but the source

    e = F - k ste + kappa (d - u)

is of one mesh harmonic h alone, its side bands ``h z_ring + r``, |r| <= 2 n_max: small systems
(`femgear.housing.two_way.harmonic_blocks`) that precondition the spectral iteration, in which the last term, a
product in time, is iterated upon by GMRES. The cost grows with the number of harmonics.

A set that is the same after a turn by ``2 pi/N`` repeats itself in time, ``f_j(theta) =
f_i(theta + s (phi_j - phi_i))``: one of N planets is solved for, and q_m[K] vanishes unless N divides K, on
any structure. Errors that turn with gears repeat the meshes after P mesh periods: lines are P-ths of a
harmonic then, planets move in N patterns (`femgear.housing.two_way.carrier_orders`), and kappa couples all of them.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_count
from femgear.housing.sensor import ReadOnlyArrays, carrier_turns
from femgear.housing.two_way.carrier_orders import (
    CarrierOrders,
    LeadingMeshes,
    MeshPaths,
    planet_groups,
    receptance,
    ring_load,
)
from femgear.housing.two_way.damping_passes import DampingPasses
from femgear.housing.two_way.harmonic_blocks import HarmonicBlocks, blocks_of_speed
from femgear.housing.two_way.mesh_fluctuation import CYCLES, MeshFluctuation, gmres
from femgear.housing.two_way.set_damping import SetDamping, set_damping
from femgear.housing.two_way.structure import FixedStructure
from femgear.system.fourier import Product, pad
from femgear.system.system import MeshExcitation, Modes, mesh_harmonics

_EQUAL, _RESIDUAL = 1e-9, 1e-6
"""Part of the largest harmonic by which meshes that repeat others may differ; residual that is refused."""
_PASSES = 60
"""Passes of the damping at most."""
_INNER, _FIRST = 1e-2, 1e-4
"""Accuracy of a solution over the change by the pass before; of the first one over what fluctuates in its
source."""
_MOST, _TINY, _LEAST = 4e9, np.finfo(float).tiny, 1e-4
"""Size of what one speed takes at most [bytes]; what no norm is below; part of the forces with their mean
that fluctuations are at least taken to be."""


@dataclass(frozen=True)
class TwoWayResponse(ReadOnlyArrays):
    """Forces of the meshes over carrier orders: ``Re sum_k force[k] exp(i order[k] |carrier_speed| t)``.

    Parameters
    ----------
    carrier_speed : (n_speeds,) array
        [rad/s], counter-clockwise positive.
    order : (n_orders,) array
        From 0 upwards; multiples of 1/turns.
    force : (n_speeds, n, n_orders) complex array
        Of the sun-planet, then the planet-ring meshes, of the planets that the others repeat or of all [N].
    residual : (n_speeds,) array
        Of the forces in their equations, over the norm of what fluctuates.
    tail : (n_speeds,) array
        Share of the fluctuating planet-ring forces beyond half the side bands (root of energies), a measure
        of truncation.
    spectral_radius : (n_speeds,) array
        Of the spectral iteration without GMRES: largest Ritz value.
    products : (n_speeds,) int array
        Products with the fluctuating stiffness.
    harmonics : (n_speeds,) int array
        Mesh harmonics.
    paths : MeshPaths
        Ways of the meshes around the ring.
    drag : (n_speeds, n_lines, m) complex array, optional
        Modal forces on the structure [N kg^-1/2] by the damping of the set beyond that of its modes, at the
        orders of `structure_lines`, two-sided.
    turns : int
        Turns of the carrier after which all repeats.
    """

    carrier_speed: np.ndarray
    order: np.ndarray
    force: np.ndarray
    residual: np.ndarray
    tail: np.ndarray
    spectral_radius: np.ndarray
    products: np.ndarray
    harmonics: np.ndarray
    paths: MeshPaths
    drag: np.ndarray | None = None
    turns: int = 1

    def at(self, speeds_chosen) -> TwoWayResponse:
        """Response at the speeds ``speeds_chosen`` alone."""
        names = ("carrier_speed", "force", "residual", "tail", "spectral_radius", "products", "harmonics")
        parts = {name: getattr(self, name)[speeds_chosen] for name in names}
        return replace(self, **parts, drag=None if self.drag is None else self.drag[speeds_chosen])


def solve_two_way(  # noqa: PLR0913
    gears: Modes,
    excitation: MeshExcitation,
    structure: FixedStructure,
    paths: MeshPaths,
    carrier_speed,
    *,
    harmonics: object,
    coupled_diameters: int | None = None,
    side_bands: int | None = None,
    damping=None,
    tolerance: float = 1e-10,
    cycles: int = CYCLES,
    workers: int | None = None,
) -> TwoWayResponse:
    """Solve for the mesh forces of a set in a housing that stands still, at all speeds.

    CaseError: data that do not fit, planets that do not repeat one another (E-SYMMETRY), E-MEMORY.
    ConvergenceError: equations that are nearly singular (E-RESONANCE).

    Parameters
    ----------
    gears : Modes
        Of gears and carrier with mean stiffnesses against a rigid ring: N sun-planet, N planet-ring meshes.
        Without `damping` what damps them acts against the ring at rest.
    excitation : MeshExcitation
        Of the 2N meshes; their stiffness without what the structure is elastic. Over several mesh periods
        with errors that turn: then the symmetry is that of the places of the planets and of the modes.
    carrier_speed : (n_speeds,) array
        [rad/s], counter-clockwise positive, all of one direction.
    harmonics : two ints or (n_speeds,) int arrays
        Mesh harmonics kept in the data, and in the response.
    coupled_diameters : int, optional
        Up to which waves act on one another and make side bands, those beyond on themselves. Default: all.
    side_bands : int, optional
        Of every harmonic; default twice those. An axisymmetric structure makes none.
    damping : (n, n) array, optional
        Of gears and ring as a whole, see `femgear.housing.two_way.set_damping.set_damping` [N s/m, ...]; without it
        gears and structure have each the modal damping of its own.
    tolerance : float
        Residual, and change of the forces by damping in their last pass, both over what fluctuates.
    cycles : int
        Of GMRES, each of twice the steps of the one before; beyond equations are nearly singular.
    workers : int, optional
        Threads; default one for every core, fewer where memory is short.
    """
    n_max = structure.max_diameter
    coupled = n_max if coupled_diameters is None else min(coupled_diameters, n_max)
    speeds = _checked(gears, excitation, carrier_speed, paths, coupled)
    excited, kept = _checked_harmonics(harmonics, len(speeds))
    bands = 2 * coupled if side_bands is None else side_bands
    sense, periods = int(np.sign(speeds[0])), excitation.periods

    def orders_of(i: int) -> CarrierOrders:
        size = int(kept[i]) * periods, n_max, bands, sense, periods, 1 if periods == 1 else paths.symmetry
        return CarrierOrders(paths, *size, structure.sectors)

    widest, shared = int(kept.argmax()), (coupled, cycles)
    turning = _TurningSet(gears, excitation, structure, orders_of(widest), int(excited.max()), damping)
    lines = _Lines(_Problem(turning, orders_of(widest), int(excited[widest]), *shared), len(speeds))

    def solve(i: int) -> None:
        problem = _Problem(turning, orders_of(i), int(excited[i]), *shared)
        lines.keep(i, problem, problem.solve(abs(float(speeds[i])), tolerance))

    room = max(int(_MOST / 4 / lines.size), 1)
    with ThreadPoolExecutor(min(workers or os.cpu_count() or 1, room)) as pool:  # BLAS lets others run
        list(pool.map(solve, range(len(speeds))))
    _check_residual(lines.figures[0], speeds, max(_RESIDUAL, 10.0 * tolerance))
    return lines.response(speeds, kept, paths if periods == 1 else replace(paths, symmetry=1))


@dataclass(frozen=True)
class _Answer:
    """Forces of the leading meshes at one speed, and how they were found.

    Parameters
    ----------
    force : (J, B, R) complex array
        Of J meshes in B blocks of R side bands [N].
    drag : (B, S, m) complex array or None
        Modal forces of the damping on the structure [N kg^-1/2].
    residual : float
        Of the forces in their equations [1].
    radius : float
        Spectral radius of the iteration without GMRES.
    products : int
        Products with the fluctuating stiffness.
    """

    force: np.ndarray
    drag: np.ndarray | None
    residual: float
    radius: float
    products: int


class _TurningSet:
    """Set in a structure, as all speeds have it.

    With the leading meshes, the harmonics of all meshes up to a number, and the damping for the most lines.
    """

    def __init__(
        self,
        gears: Modes,
        excitation: MeshExcitation,
        structure: FixedStructure,
        orders: CarrierOrders,
        most: int,
        damping,
    ):
        paths, angles = orders.paths, np.asarray(orders.paths.planet_angles, float)
        self.groups = leaders, group, turn = planet_groups(angles, paths.symmetry)
        self.structure, self.periods = structure, excitation.periods
        self.harmonics, self.mean = mesh_harmonics(excitation, most), gears.mesh_stiffness
        self.leading = np.concatenate([leaders, len(angles) + leaders])
        self.owner, self.turns = np.concatenate([group, len(leaders) + group]), np.tile(turn, 2)
        self.gears = LeadingMeshes.build(gears, paths, orders.sense, self.groups)
        self.place = angles[leaders] + paths.load_angle
        self.damping = None if damping is None else set_damping(damping, self.gears, structure, orders)


class _Problem:
    """Set and structure with some harmonics of the excitation, at any speed."""

    def __init__(self, turning: _TurningSet, orders: CarrierOrders, excited: int, coupled: int, cycles: int):
        self.structure, self.orders, self.coupled, self.cycles = turning.structure, orders, coupled, cycles
        self.gears, self.place, mean = turning.gears, turning.place, turning.mean
        lines = excited * turning.periods + 1
        stiffness, deflection, force = (harmonics_[:, :lines] for harmonics_ in turning.harmonics)
        leading, owner, turns = turning.leading, turning.owner, turning.turns
        if orders.patterns == 1 and orders.periods == 1:
            check_repeated((stiffness, deflection, force), orders, *turning.groups)
            stiffness, deflection, force = (values[leading] for values in (stiffness, deflection, force))
            owner, turns, mean = np.arange(len(leading)), np.zeros(len(leading), int), mean[leading]
        elif (apart := np.abs(mean - mean[leading][owner]).max()) > _EQUAL * mean.max():
            message = f"the mean stiffness of planets that repeat one another differs by {apart:.3g} N/m"
            raise CaseError(message, code="E-SYMMETRY", remedy="take the modes of `mean_excitation`")
        J, (B, R) = len(leading), (len(orders.base), len(orders.bands))
        self.size = 16.0 * B * (R * R * (J / 2) ** 2 + R * J * (J + 60))
        if self.size > _MOST:
            message = f"{B} lines with {R} side bands of {J // 2} planets need {self.size / 1e9:.2g} GB"
            remedy = "take fewer mesh harmonics or nodal diameters"
            raise CaseError(message, code="E-MEMORY", limit=f"{_MOST / 1e9:g} GB", remedy=remedy)
        lines = orders.lines
        forcing = pad(force, lines) - Product(pad(stiffness, lines))(pad(deflection, lines)[:, None])[:, 0]
        varying = stiffness.copy()
        varying[:, 0] -= mean
        self.fluctuation = MeshFluctuation(varying, orders, owner, turns)
        source = np.zeros((len(forcing), lines + 1, R), complex)
        source[..., orders.middle] = 0.5 * forcing
        source[:, 0, orders.middle] = np.real(forcing[:, 0])
        self.source = self.fluctuation.of_leaders(source)
        self.damping = turning.damping and turning.damping.of(orders)

    def solve(self, speed: float, tolerance: float) -> _Answer:
        """Solve at a speed of the carrier [rad/s], positive."""
        blocks = blocks_of_speed(self.gears, self.structure, self.orders, self.place, speed, self.coupled)
        if self.damping is None:
            solved = self._solved(blocks, blocks.load(), None, None, max(tolerance, _FIRST))
            solved = self._solved(blocks, blocks.load(), None, solved, tolerance)
            return _Answer(solved.force, None, solved.residual, solved.radius, solved.products)
        return self._damped(blocks, self.damping, tolerance)

    def _solved(self, blocks: HarmonicBlocks, moved, given, before: _Solution | None, tolerance: float) -> _Solution:
        """Solve for forces e beyond k0, near a solution before, with deflections d_0 and u_0.

        What fluctuates is known by the solution before; the source alone is many times of it where the mesh
        hardly feels what excites it.
        """
        still = _over_ring(*blocks.deflections(np.zeros_like(self.source), moved, given))
        right, shape = self.source + self.fluctuation(still), self.source.shape

        def answer(flat: np.ndarray) -> np.ndarray:
            motion = blocks.deflections(flat.view(complex).reshape(shape))
            return self.fluctuation(_over_ring(*motion)).ravel().view(float)

        first = None if before is None else before.extra.ravel().view(float)
        size = self._fluctuating(right if before is None else before.force)
        flat, residual, radius, products = gmres(answer, right.ravel().view(float), size, first, tolerance, self.cycles)
        extra = flat.view(complex).reshape(shape)
        deflection, way = blocks.deflections(extra, moved, given)
        return _Solution(extra, way, blocks.forces(extra, deflection, way), residual, radius, products)

    def _damped(self, blocks: HarmonicBlocks, damping: SetDamping, tolerance: float) -> _Answer:
        """Solve with the damping of the set, whose forces follow the motion, pass by pass."""
        passes, accuracy = DampingPasses(damping, blocks), max(0.5 * tolerance, _FIRST)
        products, radius, change = 0, 0.0, 1.0
        solved: Any = None
        for _ in range(_PASSES):
            solved = self._solved(blocks, *passes.moved, solved, accuracy)
            products, radius = products + solved.products, max(radius, solved.radius)
            size = self._fluctuating(solved.force)
            change, whole = passes.follow((solved.extra, solved.way, solved.force), tolerance * size)
            change /= size
            # what GMRES leaves unsolved no further pass will mend
            if (whole and max(change, solved.residual) <= tolerance) or solved.residual > accuracy:
                break
            accuracy = max(0.5 * tolerance, min(_INNER * change, _FIRST))
        return _Answer(solved.force, passes.drag(), max(solved.residual, change), radius, products)

    def _fluctuating(self, forces: np.ndarray) -> float:
        """Norm of forces (J, B, R) without those constant in time, which are often a thousand times it."""
        constant = forces[:, self.orders.base + self.orders.seed == 0, self.orders.middle]
        whole, still = float(np.linalg.norm(forces)), float(np.linalg.norm(constant))
        return max(np.sqrt(max(whole**2 - still**2, 0.0)), _LEAST * whole, _TINY)

    def tail(self, force: np.ndarray) -> float:
        """Share (root of energies) of the fluctuating ring forces that is at the outer side bands."""
        energy = np.abs(force[len(self.place) :]) ** 2
        energy[:, self.orders.base + self.orders.seed == 0] *= 0.5
        energy[:, 0, self.orders.middle] = 0.0
        outer = 2 * np.abs(self.orders.bands) > self.orders.side_bands
        return float(np.sqrt(energy[..., outer].sum() / max(energy.sum(), _TINY)))


class _Lines:
    """Lines of the forces at all speeds, with the most harmonics of any of them.

    Orders ``number`` (n_orders,) and ``reached`` (n_lines,) of the structure are multiples of 1/turns.
    """

    def __init__(self, widest: _Problem, count: int):
        orders, modes = widest.orders, len(widest.structure.natural_frequency)
        self.size, self.turns = widest.size, carrier_turns(orders.paths.z_ring, orders.periods)
        self.number = self.numbers(orders)[0]
        waves = self.turns * orders.sense * orders.diameters
        self.reached = structure_numbers(self.number, waves, orders.paths.symmetry if orders.periods == 1 else 1)
        self.force = np.zeros((count, len(widest.fluctuation.owner), len(self.number)), complex)
        self.figures, self.drag = np.zeros((4, count)), None
        if widest.damping is not None:
            self.drag = np.zeros((count, len(self.reached), modes), complex)

    def numbers(self, orders: CarrierOrders) -> tuple[np.ndarray, np.ndarray]:
        """Orders (n_orders,) of the forces, multiples of 1/turns from 0, and places (Q + 1, R) among them."""
        number, place = np.unique(np.abs(orders.numbers(self.turns)), return_inverse=True)
        return number, place.reshape(-1, len(orders.bands))

    def response(self, speeds: np.ndarray, harmonics: np.ndarray, paths: MeshPaths) -> TwoWayResponse:
        """Response at speeds (n_speeds,) [rad/s] with so many harmonics (n_speeds,)."""
        residual, tail, radius, products = self.figures
        order = self.number if self.turns == 1 else self.number / self.turns
        counts = products.astype(int), harmonics
        return TwoWayResponse(speeds, order, self.force, residual, tail, radius, *counts, paths, self.drag, self.turns)

    def keep(self, i: int, problem: _Problem, answer: _Answer) -> None:
        """Write down what is found at the speed number i."""
        number, place = self.numbers(problem.orders)
        at = np.searchsorted(self.number, number)
        self.force[i][:, at] = self._one_sided(problem, answer.force, place, len(number))
        self.figures[:, i] = answer.residual, problem.tail(answer.force), answer.radius, answer.products
        if self.drag is not None and answer.drag is not None:
            self._add_drag(self.drag[i], problem.orders, answer.drag)

    def _one_sided(self, problem: _Problem, force: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
        """Amplitudes (n, n_orders) of all meshes by two-sided forces (J, B, R) of the leaders."""
        every, middle = problem.fluctuation.of_meshes(force), problem.orders.middle
        values = 2.0 * np.where(problem.orders.numbers(self.turns) < 0, every.conj(), every)
        # the other half of line 0 is its conjugate
        values[:, 0, :middle] = 0.0
        values[:, 0, middle] = np.real(every[:, 0, middle])
        lines = np.zeros((count, len(every)), complex)
        _add_at(lines, place, np.moveaxis(values, 0, -1))
        lines = lines.T
        lines[:, 0] = np.real(lines[:, 0])
        return lines

    def _add_drag(self, drag: np.ndarray, orders: CarrierOrders, values: np.ndarray) -> None:
        """Add two-sided modal forces (B, S, m) to those (n_lines, m) at the orders of the structure."""
        number, line = np.rint(orders.structure_order * self.turns).astype(int), np.arange(orders.lines + 1)
        used = (np.tile(line, orders.patterns) > 0)[:, None] | (number >= 0)
        at = np.minimum(np.searchsorted(self.reached, np.abs(number)), len(self.reached) - 1)
        used &= self.reached[at] == np.abs(number)
        _add_at(drag, at[used], np.where((number < 0)[..., None], values.conj(), values)[used])


def _add_at(total: np.ndarray, place: np.ndarray, values: np.ndarray) -> None:
    """Add values (n, ...) to places (n,) of a total, most of which get one of them."""
    number = place.ravel()
    values, left = values.reshape(len(number), *total.shape[1:]), np.arange(len(number))
    while len(left):  # a place gets one value at a time
        places, first = np.unique(number[left], return_index=True)
        total[places] += values[left[first]]
        left = np.delete(left, first)


@dataclass(frozen=True)
class _Solution:
    """Solution of the equations of one speed by GMRES.

    Parameters
    ----------
    extra : (J, B, R) complex array
        Forces e beyond those of the mean stiffness k0 [N].
    way : (G, B, R) complex array
        Displacement u of the ring at its meshes, along their lines of action [m].
    force : (J, B, R) complex array
        Forces of the meshes [N].
    residual, radius, products
        As in `_Answer`.
    """

    extra: np.ndarray
    way: np.ndarray
    force: np.ndarray
    residual: float
    radius: float
    products: int


def _over_ring(deflection: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Deflections (J, B, R) of the meshes [m], those of ring meshes without what the ring gives way."""
    deflection[len(way) :] -= way
    return deflection


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
    numbers = structure_numbers(number, across, paths.symmetry * turns if paths.symmetry > 1 else 1)
    both = np.concatenate([-number[:0:-1], number])
    reaching = numbers[:, None] + across
    back = np.minimum(np.searchsorted(both, reaching), len(both) - 1)
    back = np.where(both[back] == reaching, back, len(both))
    place = np.array(paths.planet_angles)[leaders] + paths.load_angle
    half = response.force[:, len(place) :] * np.where(number == 0, 1.0, 0.5)
    ring = np.concatenate([half[..., :0:-1].conj(), half], axis=-1)
    order = numbers if turns == 1 else numbers / turns
    lines = np.empty((len(speed), len(order), structure.sensor_shape.shape[1]), complex)
    for i in range(len(speed)):  # one by one: modes at all orders of all speeds would fill the memory
        load = ring_load(paths.symmetry, ring[i], place, n, back)
        modal = load @ structure.ring_shape.conj().T
        if response.drag is not None:
            modal += response.drag[i]
        modal *= receptance(structure, speed[i] * order)
        lines[i] = load @ structure.sensor_residual.T + modal @ structure.sensor_shape
    lines = np.swapaxes(lines, 1, 2) * np.where(order == 0, 1.0, 2.0)
    return order, np.where(order == 0, np.real(lines), lines)


def structure_numbers(number: np.ndarray, across: np.ndarray, symmetry: int) -> np.ndarray:
    """Orders (n_K,) of a structure, from 0, that forces of orders (n_L,) from 0 reach across its waves (n,).

    All counted in the same whole numbers; multiples of the symmetry alone.
    """
    reached = np.unique(np.concatenate([number, -number])[:, None] - across)
    return reached[(reached >= 0) & (reached % symmetry == 0)]


def _checked_harmonics(harmonics, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Mesh harmonics (n_speeds,) of excitation and response."""
    excited, kept = (np.broadcast_to(harmonic, count).tolist() for harmonic in harmonics)
    for excited_count, other in dict.fromkeys(zip(excited, kept)):
        checked_count(excited_count, "excitation harmonics", code="E-HARMONICS")
        checked_count(other, "response harmonics", code="E-HARMONICS", least=excited_count)
    return np.array(excited, int), np.array(kept, int)


def _checked(gears, excitation, carrier_speed, paths, n_max) -> np.ndarray:
    """Speeds (n_speeds,) [rad/s] of data that belong together."""
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


def _check_residual(residual: np.ndarray, speeds: np.ndarray, limit: float) -> None:
    """Refuse equations that are singular at a speed (n_speeds,) [rad/s] (E-RESONANCE)."""
    if not (residual < limit).all():
        worst = int(np.argmax(np.where(np.isfinite(residual), residual, np.inf)))
        message = f"residual {residual[worst]:.3e} of the two-way equations at {speeds[worst]:.6g} rad/s"
        remedy = "give gears and structure some damping"
        raise ConvergenceError(message, code="E-RESONANCE", limit=f"{limit:g}", remedy=remedy)


def check_repeated(one_sided, orders: CarrierOrders, leaders, group, turn) -> None:
    """Refuse planets whose meshes do not repeat those of their leaders (E-SYMMETRY)."""
    N, harmonic = orders.paths.symmetry, np.arange(one_sided[0].shape[1])
    # whole turns have no rounding
    whole = turn[:, None] * harmonic * (orders.sense * orders.paths.z_ring % N)
    shift = np.exp(2j * np.pi * (whole % N) / N)
    for name, values in zip(("stiffness", "deflection", "force"), one_sided):
        apart = max(
            np.abs(half - shift * half[leaders][group]).max() for half in np.split(values, len(values) // len(turn))
        )
        if apart > _EQUAL * np.abs(values).max():
            raise CaseError(
                f"the {name} of equal planets differs by {apart / np.abs(values).max():.2e} of its largest harmonic",
                code="E-SYMMETRY",
                key="symmetry",
                value=N,
                limit=f"{_EQUAL:g}",
                remedy="take symmetry 1, which solves for every planet",
            )
