"""Two-way response of a set with errors that turn with its gears.

Its meshes repeat after P mesh periods, their harmonics are P-ths of a mesh harmonic, and forces have orders
``q z_ring/P + r``. The mean stiffness k0 of all periods and of planets that errors alone tell apart has whole
mesh harmonics: it couples q with ``q + P`` alone, so that every seed ``p = q modulo P`` and every pattern of
the planets has equations of the size of one planet without errors (`femgear.housing.carrier_orders`). What
the errors change couples them,

    f = F + k0 (d - u) - k ste + (k - k0) (d - u),

and is small, so that the last term is iterated upon, all orders of k kept.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.housing.carrier_orders import (
    CarrierOrders,
    LeadingMeshes,
    MeshPaths,
    Motion,
    SpeedEquations,
    equations,
    planet_groups,
    two_sided,
)
from femgear.housing.sensor import carrier_turns
from femgear.housing.set_damping import set_damping
from femgear.system.system import MeshExcitation, Modes, mesh_harmonics

_TOLERANCE, _PASSES, _TOGETHER, _TINY = 1e-7, 60, 6, np.finfo(float).tiny
"""Change of the fluctuating deflections, over their norm, in the last pass; passes at most, and those
that are extrapolated together; what no norm is below."""
_SILENT = 1e-8
"""Part of the largest source of a pass below which a seed and pattern stay at rest."""
_KEPT = 1e9
"""Size of the factors of one speed that are kept from pass to pass [bytes]."""


@dataclass(frozen=True)
class _Key:
    """Seed ``p z_ring/P`` and pattern of the planets."""

    seed: int
    pattern: int


class TurningErrors:
    """Set whose meshes repeat after several mesh periods, in a housing that stands still.

    CaseError: mean stiffnesses of the modes that differ between planets of a group (E-SYMMETRY).

    Parameters
    ----------
    gears : Modes
        As for `femgear.housing.two_way.solve_two_way`, with the same mean stiffness for planets of one group.
    excitation : MeshExcitation
    count : int
        Mesh harmonics of the excitation.
    structure, orders, groups
        The structure, orders of a whole seed, and `femgear.housing.two_way.planet_groups`.
    damping : (n, n) array, optional
        Of gears and ring as a whole.
    """

    def __init__(
        self, gears: Modes, excitation: MeshExcitation, count: int, structure, orders: CarrierOrders, groups,
        *, damping,
    ):  # fmt: skip
        self.gears, self.structure, self.orders, self.periods = gears, structure, orders, excitation.periods
        self.leaders, self.group, turn = groups
        self.place = np.array(orders.paths.planet_angles)[self.leaders] + orders.paths.load_angle
        planets, H, P, N = len(turn), orders.harmonics, self.periods, orders.paths.symmetry
        self.turn, self.owner = _meshes(groups)
        self.residues = np.arange(-((P - 1) // 2), P // 2 + 1)
        self.q = (np.arange(-H, H + 1)[:, None] * P + self.residues).ravel()
        leading, mean = np.array([*self.leaders, *(planets + self.leaders)]), gears.mesh_stiffness
        apart = np.abs(mean - mean[leading][self.owner]).max()
        if apart > 1e-9 * mean.max():
            message = f"the mean stiffness of planets that repeat one another differs by {apart:.3g} N/m"
            raise CaseError(message, code="E-SYMMETRY", remedy="take the modes of `mean_excitation`")
        from scipy.signal import fftconvolve

        stiffness, deflection, force = (two_sided(one) for one in mesh_harmonics(excitation, count))
        even = two_sided(mesh_harmonics(mean_excitation(excitation, orders.paths, orders.sense), count)[0])
        self.known = LeadingMeshes.build(gears, even[leading], orders, *groups)
        lines, self.change = count * P, stiffness.copy()
        self.change[:, ::P] -= even
        product = fftconvolve(stiffness, deflection, axes=1)
        product[:, lines : 3 * lines + 1] -= force
        self.forcing = np.zeros((2 * planets, len(self.q)), complex)
        inside = np.abs(self.q) <= 2 * lines
        self.forcing[:, inside] = -product[:, 2 * lines + self.q[inside]]
        self.damping = damping
        patterns = [(p, m) for p in range(P // 2 + 1) for m in range(N if p else N // 2 + 1)]
        self.keys = [_Key(p, m) for p, m in patterns]
        self.parts = {key: self._part(key) for key in self.keys}

    def _turned(self, whole, sign: int, pattern: int = 0) -> np.ndarray:
        """Phases (2N, ...) of the meshes against those of their leaders at whole parts of orders."""
        N = self.orders.paths.symmetry
        turn = self.turn.reshape(-1, *(1,) * np.ndim(whole))
        return np.exp(2j * np.pi * (sign * self.orders.sense * turn * ((whole + pattern) % N) % N) / N)

    def _part(self, key: _Key):
        """Orders of a seed and pattern, their damping, and phases of the meshes at them."""
        seed = key.seed * self.orders.paths.z_ring / self.periods
        orders, damping = replace(self.orders, seed=seed, pattern=key.pattern), None
        if self.damping is not None:
            met, to, back = orders.meeting()
            damping = set_damping(
                self.damping, self.gears, self.structure, orders.solved + key.pattern,
                (met + key.pattern, to, back), symmetry=orders.paths.symmetry, sense=orders.sense,
                offset=seed - key.pattern,
            )  # fmt: skip
        return orders, damping, self._turned(orders.every, 1, key.pattern)

    @property
    def numbers(self) -> np.ndarray:
        """Orders (Q, R) of the forces in multiples of 1/turns, both signs."""
        turns = carrier_turns(self.orders.paths.z_ring, self.periods)
        r = np.arange(-self.orders.side_bands, self.orders.side_bands + 1)
        return self.q[:, None] * (self.orders.paths.z_ring * turns // self.periods) + turns * r

    def solve(self, speed: float) -> tuple[np.ndarray, dict[_Key, Motion], float]:
        """Solve at a speed of the carrier [rad/s], positive.

        Forces (2N, Q, R) [N], two-sided, the motion of every seed and pattern that moves, and the largest
        residual. ConvergenceError: errors that change the stiffness too much (E-CONVERGENCE).
        """
        bands, planets = 2 * self.orders.side_bands + 1, len(self.group)
        shape = 2 * planets, len(self.q), bands
        still = (int(np.flatnonzero(self.q == 0)[0]), bands // 2)
        moved, kept, found = np.zeros(shape, complex), dict[_Key, SpeedEquations](), dict[_Key, Motion]()

        def respond(job: tuple[_Key, np.ndarray, float]) -> tuple[_Key, Motion]:
            key, source, loose = job
            one = kept.get(key)
            if one is None:
                orders, damping, _ = self.parts[key]
                (one,) = equations(self.known, self.structure, self.place, orders, np.array([speed]), damping)
                if (len(kept) + 1) * one.factors[0].nbytes <= _KEPT:
                    kept[key] = one
            return key, one.solve(source, found.get(key), loose)

        pairs = list[tuple[np.ndarray, np.ndarray]]()  # motions that were put in, and what they change
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            for number in range(_PASSES):
                sources = self._sources(moved, self.keys if number else self.keys[:1])
                found = dict(pool.map(respond, sources))
                answer = self._planets(found, _over_ring, shape)
                fluctuating, change = answer.copy(), answer - moved
                fluctuating[:, *still] = change[:, *still] = 0.0
                size = max(float(np.linalg.norm(fluctuating)), _TINY)
                if number and (apart := float(np.linalg.norm(change)) / size) <= _TOLERANCE:
                    force = self._planets(found, lambda one: one.force, shape)
                    return force, found, max(apart, *(one.residual for one in found.values()))
                pairs = [*pairs[-_TOGETHER:], (moved, answer - moved)] if number else pairs
                moved = _accelerated(pairs, answer)
        raise ConvergenceError(
            f"what the turning errors change is not small: the deflections change by {apart:.1e} in pass "
            f"{_PASSES} at {speed:.6g} rad/s", code="E-CONVERGENCE", limit=f"{_TOLERANCE:g}",
            remedy="give gears and structure more damping, or smaller errors",
        )  # fmt: skip

    def _sources(self, moved: np.ndarray, keys) -> list[tuple[_Key, np.ndarray, float]]:
        """Forces of the leaders that are no stiffness k0 times deflections, and how small they are.

        Of what is not silent; the latter is the largest over each.
        """
        from scipy.signal import fftconvolve

        N, size = self.orders.paths.symmetry, 2 * self.orders.harmonics + 1
        force = fftconvolve(moved, self.change[:, :, None], mode="same", axes=1)
        force[:, :, force.shape[2] // 2] += self.forcing
        found, count = list[tuple[_Key, np.ndarray]](), 2 * len(self.leaders)
        force = force.reshape(len(force), size, self.periods, -1)
        for key in keys:
            own = force[:, :, key.seed - self.residues[0]] * self.parts[key][2].conj()
            source = np.array([own[self.owner == one].sum(axis=0) for one in range(count)]) / N
            found.append((key, source))
        sizes = np.array([np.linalg.norm(source) for _, source in found])
        heard = (sizes > _SILENT * sizes.max()) | (np.arange(len(sizes)) == 0)
        loose = sizes.max() / np.maximum(sizes, _TINY)
        return [(*one, float(times)) for one, own, times in zip(found, heard, loose) if own]

    def _planets(self, found: dict[_Key, Motion], values, shape) -> np.ndarray:
        """Values (2N, Q, R) of all meshes by those of the leaders of every seed and pattern."""
        size, first = 2 * self.orders.harmonics + 1, -self.residues[0]
        every = np.zeros((shape[0], size, self.periods, shape[2]), complex)
        for key, one in found.items():
            own = values(one)[self.owner] * self.parts[key][2]
            every[:, :, first + key.seed] += own
            if self.paired(key):
                every[:, :, first - key.seed] += own[:, ::-1, ::-1].conj()
        return every.reshape(shape)

    def paired(self, key: _Key) -> bool:
        """Whether another seed and pattern are the conjugates of these."""
        if key.seed == 0:
            return key.pattern > 0 and 2 * key.pattern != self.orders.paths.symmetry
        return 2 * key.seed != self.periods


def mean_excitation(excitation: MeshExcitation, paths: MeshPaths, sense: int) -> MeshExcitation:
    """Average the meshes over their periods, and over planets that repeat one another by their places.

    ``sense`` is that of the carrier, 1 or -1. Of errors that turn what they do on an average remains.
    """
    turn, owner = _meshes(planet_groups(paths.planet_angles, paths.symmetry))
    count = excitation.stiffness.shape[1] // excitation.periods
    whole = sense * turn[:, None] * np.arange(count // 2 + 1) * (paths.z_ring % paths.symmetry)
    phase = np.exp(2j * np.pi * (whole % paths.symmetry) / paths.symmetry)
    alike, found = owner[:, None] == owner, list[np.ndarray]()
    for values in (excitation.stiffness, excitation.deflection, excitation.force):
        lines = np.fft.rfft(values.reshape(len(values), -1, count).mean(axis=1)) / phase
        found.append(np.fft.irfft(phase * (alike @ lines) / alike.sum(axis=1)[:, None], count))
    return replace(excitation, stiffness=found[0], deflection=found[1], force=found[2], periods=1)


def _meshes(groups) -> tuple[np.ndarray, np.ndarray]:
    """Turns (2N,) of all meshes from their leaders, and the numbers (2N,) of these."""
    leaders, group, turn = groups
    return np.tile(turn, 2), np.concatenate([group, len(leaders) + group])


def _accelerated(pairs: list[tuple[np.ndarray, np.ndarray]], answer: np.ndarray) -> np.ndarray:
    """Motions for the next pass: of all that the passes before span those that change least.

    D. G. Anderson, J. ACM 12 (1965) 547-560. The equations are linear over real numbers alone.
    """
    if len(pairs) < 2:
        return answer
    last, newest = pairs[-1]
    steps = [(last - moved, newest - change) for moved, change in pairs[:-1]]
    product = np.array([[np.vdot(one, other).real for _, other in steps] for _, one in steps])
    wanted = np.array([np.vdot(one, newest).real for _, one in steps])
    share = np.linalg.lstsq(product, wanted, rcond=1e-13)[0]
    return answer - sum(times * (moved + change) for times, (moved, change) in zip(share, steps))


def _over_ring(one: Motion) -> np.ndarray:
    """Deflections (2 G, 2 H + 1, R) of the meshes [m]."""
    found = one.deflection.copy()
    found[len(one.way) :] -= one.way
    return found


def solve_turning_errors(errors: TurningErrors, speeds: np.ndarray, heard) -> tuple[Any, ...]:
    """Solve for the forces of the meshes at all speeds of the carrier (n_speeds,) [rad/s], positive.

    ``heard`` gives the orders of the structure in multiples of 1/turns by those of the forces. Returned are
    the latter (n_L,) from 0 upwards, forces (n_speeds, 2N, n_L) [N], residuals and shares at the outer side
    bands (n_speeds,), and the modal forces of the damping (n_speeds, n_K, m) or none.
    """
    two, orders = errors.numbers, errors.orders
    number, to = np.unique(np.abs(two), return_inverse=True)
    to, turns = to.reshape(two.shape), carrier_turns(orders.paths.z_ring, errors.periods)
    above, outer = two > 0, np.zeros(two.shape, bool)
    outer[:, np.abs(np.arange(two.shape[1]) - two.shape[1] // 2) > orders.n_max] = True
    count, planets = len(speeds), len(errors.group)
    force = np.zeros((count, 2 * planets, len(number)), complex)
    residual, tail = np.empty((2, count))
    reached = heard(number)
    drag = None
    if errors.damping is not None:
        drag = np.zeros((count, len(reached), len(errors.structure.natural_frequency)), complex)
    for i, speed in enumerate(speeds):
        every, motions, residual[i] = errors.solve(float(speed))
        for mesh in range(2 * planets):
            np.add.at(force[i, mesh], to[above], 2.0 * every[mesh][above])
            force[i, mesh, 0] = np.real(every[mesh][two == 0].sum())
        energy = np.where(two == 0, 0.0, np.abs(every[planets:]) ** 2).sum(axis=0)
        tail[i] = np.sqrt(energy[outer].sum() / max(energy.sum(), _TINY))
        for key, one in motions.items():
            if drag is None or one.drag is None:
                continue
            part = errors.parts[key][0]
            met = np.rint((part.meeting()[0] + part.seed) * turns).astype(int)
            for sign in (1, -1) if errors.paired(key) else (1,):
                own = sign * met >= 0
                place = np.searchsorted(reached, sign * met[own])
                values = one.drag[own] if sign == 1 else one.drag[own].conj()
                np.add.at(drag[i], place, values)
    sounding = force.any(axis=(0, 1)) | (number == 0)
    number, force = number[sounding], force[..., sounding]
    if drag is not None:
        drag = drag[:, np.isin(reached, heard(number))]
    return number, force, residual, tail, drag
