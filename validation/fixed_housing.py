"""A ring on springs, and a small set that runs around in it: both ways, against routes that share no code.

The ring is thin and inextensional, the gears are a sun in two springs with rigid planets on fixed pins.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import linalg

from femgear.case.gear_set import planetary_set
from femgear.fe.reduction import CyclicModes
from femgear.gears.phasing import MeshPhasing, phasing_table
from femgear.housing.orders import FOREIGN, NORMAL, array_factor, classify_line, order_level, order_spectrum
from femgear.housing.sensor import component_lines
from femgear.housing.two_way.response import MeshPaths, TwoWayResponse, solve_two_way, structure_lines
from femgear.housing.two_way.structure import FixedStructure, Support, circumferential, supported_ring
from femgear.housing.two_way.turn_stability import turn_stability
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.periodic.spectral import HarmonicProblem, solve_direct, solve_spectral
from femgear.solvers.stability.parametric import stability
from femgear.stages.static import solve_static
from femgear.system.fourier import Product, harmonics_of, pad
from femgear.system.system import MechanicalSystem, MeshExcitation, Modes
from femgear.trains.elastic import stages as elastic
from femgear.trains.elastic.model import gears_alone, mesh_springs
from femgear.trains.reading import with_values
from validation.cases import reference_case, reference_modes
from validation.rows import Row, at_most, counted, printed, within

E, RHO, R, WIDTH, HEIGHT = 206e9, 7850.0, 0.1, 0.025, 0.01
AREA, INERTIA = WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12
PRESSURE = np.radians(20.0)
DIRECTION = np.sin(PRESSURE), -np.cos(PRESSURE)
SPRING = 1e6
WU = "Wu and Parker 2006"
EQUAL = tuple(2 * np.pi * np.arange(3) / 3)
FEET = tuple(Support(a, 4e7, 2e7, 0.05) for a in np.radians([20.0, 100.0, 195.0, 310.0]))
_ROUNDINGS = 8
PAIR = MeshPaths(97, tuple(2 * np.pi * np.array([0.0, 0.24, 0.5, 0.74])))


def thin_ring(highest: int, direction=DIRECTION, *, foundation=0.0, lowest=0) -> CyclicModes:
    """Closed-form modes of a thin middle line on a foundation [N/m^3]: w = cos n phi, v = -sin(n phi)/n.

    ``w^2 = EI/(rho A R^4) n^2 (n^2 - 1)^2/(n^2 + 1)`` (W. Soedel, Vibrations of Shells and Plates, 5.3).
    """
    n = np.arange(lowest, highest + 1)
    mass = RHO * AREA * np.pi * R * np.where(n == 0, 2.0, 1.0 + 1.0 / np.maximum(n, 1) ** 2)
    stiffness = np.pi * (E * INERTIA / R**3 * (n**2 - 1.0) ** 2 + foundation * WIDTH * R)
    # the rotation has no radial displacement: the same foundation, tangential, holds it
    stiffness = np.where(n == 0, 2 * np.pi * foundation * WIDTH * R, stiffness)
    norm = np.sqrt(np.where(n == 0, 1.0, 2.0) / 97)
    radial = np.where(n == 0, 0.0, 1.0) / np.sqrt(mass) / norm + 0j
    tangential = np.where(n == 0, 1.0, 1j / np.maximum(n, 1)) / np.sqrt(mass) / norm
    load = direction[0] * radial + direction[1] * tangential
    return CyclicModes(
        97,
        n,
        np.sqrt(stiffness / mass) / (2 * np.pi),
        load[:, None],
        np.stack([radial, tangential], axis=1),
        np.zeros((0, len(n))),
        np.zeros((0, 0)),
    )


def springs(count: int, stiffness: float = SPRING, highest: int = 40) -> np.ndarray:
    """Natural frequencies [Hz] of the ring on radial springs, which its rotation does not feel."""
    held = [Support(2 * np.pi * i / count, stiffness, 0.0) for i in range(count)]
    options = {"max_diameter": 0, "max_frequency": 1e6, "damping_ratio": 0.0}
    return supported_ring(thin_ring(highest, lowest=1), held, **options).natural_frequency / (2 * np.pi)


_TABLE = {
    3: ("671.777", "671.777", "1786.239", "1816.949", "3433.436", "3433.436", "5544.262", "5544.262"),
    4: ("631.531", "727.960", "1806.998", "1806.998", "3424.957", "3447.440"),
}


def splitting() -> tuple[Row, ...]:
    """Pairs of modes of the ring on N equal springs split where 2n/N is whole."""
    rows = list[Row]()
    for count, table in _TABLE.items():
        # two rigid motions come first
        support = springs(count)[2:]
        for i, reference in enumerate(table):
            words = f"{count} springs, n = {2 + i // 2}, {'second' if i % 2 else 'first'} natural frequency, Hz"
            rows.append(printed("splitting", WU, words, reference, support[i]))
        weak = (2 * np.pi * springs(count, 1e2)[2 : 2 + len(table)]) ** 2
        error = 0.0
        for n in range(2, 2 + len(table) // 2):
            free = (2 * np.pi * thin_ring(n).frequency[n]) ** 2
            change = count * 1e2 / (RHO * AREA * np.pi * R * (1 + 1 / n**2))
            expected = [0.0, change] if 2 * n % count == 0 else [change / 2] * 2
            error = max(error, np.abs(weak[2 * n - 4 : 2 * n - 2] - free - expected).max() / change)
        words = f"{count} springs of 100 N/m: change of omega^2 against first order, over the largest"
        rows.append(at_most("splitting", WU, words, 1e-3, error))
    return tuple(rows)


# CalculiX: plane ring of the reference set on its foundation, springs and masses spread over the feet
_FEET = {
    (4e8, 0.05): (2861.2, 3526.4, 3678.4, 4137.0, 4188.4, 4707.6, 6225.9),
    (4e9, 0.0): (4751.1, 4848.4, 5556.7, 5805.2, 6758.2, 7757.8, 9931.1),
}


FEET_ANGLES = 35.0, 145.0, 215.0, 325.0  # degrees
FOOT_WIDTH = 0.02  # m


def ring_on_feet(stiffness: float, mass: float) -> np.ndarray:
    """Natural frequencies [Hz] of the ring of the reference set on four feet."""
    ring, width = reference_modes().ring, FOOT_WIDTH / reference_case().ring.outer_radius
    held = [Support(np.radians(a), stiffness, stiffness, mass, width) for a in FEET_ANGLES]
    return supported_ring(
        ring.modes, held, max_diameter=26, max_frequency=np.inf, damping_ratio=0.0, rim=ring.rim_compliance
    ).natural_frequency / (2 * np.pi)


def yielding() -> tuple[Row, ...]:
    """The ring of the reference set on four feet of 20 mm, which press into its rim."""
    rows = list[Row]()
    for (stiffness, mass), frequencies in _FEET.items():
        casing = ring_on_feet(stiffness, mass)
        for i, reference in enumerate(frequencies):
            words = f"four feet of {stiffness:.0e} N/m, {1e3 * mass:g} g: natural frequency {i + 1}, Hz"
            rows.append(within("feet", "CalculiX", words, reference, casing[i], 0.002))
    return tuple(rows)


def gears(angles) -> MechanicalSystem:
    """Sun (x, y, rotation as a length) in springs and planets that roll on fixed pins."""
    N = len(angles)
    M, K = np.diag([1.0, 1.0, 0.5] + [0.3] * N), np.diag([2e6, 2e6, 1e6] + [1e4] * N)
    W, load = np.zeros((3 + N, 2 * N)), np.zeros(3 + N)
    for j, angle in enumerate(angles):
        W[:3, j] = np.cos(angle + 0.4), np.sin(angle + 0.4), 1.0
        W[3 + j, j], W[3 + j, N + j] = -1.0, 1.0
    load[2] = 300.0
    return MechanicalSystem(M, np.zeros_like(K), K, W, load, tuple(f"q{i}" for i in range(len(K))))


def excitation(paths: MeshPaths, sense: int = 1, depth: float = 0.15) -> MeshExcitation:
    """Two harmonics of stiffness, deflection and force; planets in the phases of their angles."""
    tau = 2 * np.pi * np.arange(64) / 64

    def wave(lag):
        phase = tau + paths.z_ring * sense * np.array(paths.planet_angles)[:, None]
        return np.cos(phase + lag) + 0.4 * np.sin(2 * phase)

    stiffness = 5e6 * np.concatenate([1 + depth * wave(0.0), 1.3 + depth * wave(0.7)])
    deflection = 1e-5 * np.concatenate([1 + 0.3 * wave(0.2), 2 + 0.4 * wave(0.1)])
    force = 100 + 10 * np.concatenate([wave(0.5), wave(0.5)])
    return MeshExcitation(stiffness, deflection, force, np.zeros(len(force)))


def shaken(paths: MeshPaths, periods: int, *, planet: int | None = None, sense: int = 1) -> MeshExcitation:
    """The excitation with errors that turn, of all planets one after the other or of one planet alone."""
    drive, N = excitation(paths, sense), len(paths.planet_angles)
    tau = 2 * np.pi * np.arange(64 * periods) / (64 * periods)
    error = np.cos(tau + 5 * np.array(paths.planet_angles)[:, None])
    if planet is not None:
        error[np.arange(N) != planet] = 0.0
    error = 0.08 * np.concatenate([error, 1.2 * error])
    stiffness, deflection, force = (
        np.tile(signal, (1, periods)) for signal in (drive.stiffness, drive.deflection, drive.force)
    )
    return MeshExcitation(
        stiffness * (1 + error), deflection * (1 + 0.5 * error), force, np.zeros(2 * N), periods=periods
    )


def rigid_modes(paths: MeshPaths, drive: MeshExcitation, ratio: float = 0.04) -> Modes:
    """Modes of sun and planets with the mean stiffness of all planets."""
    mean, N = drive.stiffness.mean(axis=1), len(paths.planet_angles)
    equal = np.repeat([mean[:N].mean(), mean[N:].mean()], N)
    return undamped_modes(gears(paths.planet_angles), equal, damping_ratio=ratio)


def feet(max_diameter: int, highest: int = 20) -> FixedStructure:
    """The ring on four irregular feet; the modes above 6 kHz are static."""
    place = 0.3, 2.0
    return supported_ring(
        thin_ring(highest),
        FEET,
        max_diameter=max_diameter,
        max_frequency=6e3,
        damping_ratio=0.03,
        sensor_angles=place,
    )


def solved(paths: MeshPaths, structure, speeds, *, depth=0.15, harmonics=6, ratio=0.04, **options) -> TwoWayResponse:
    """The set in a structure by the two-way solution."""
    drive = excitation(paths, int(np.sign(speeds[0])), depth)
    modes = undamped_modes(gears(paths.planet_angles), drive.stiffness.mean(axis=1), damping_ratio=ratio)
    return solve_two_way(modes, drive, structure, paths, speeds, harmonics=(2, harmonics), **options)


def order_rules() -> tuple[Row, ...]:
    """Every planet solved for: what orders remain, and what one planet alone gives."""
    structure, rows, speeds = feet(8), list[Row](), np.array([-40.0])
    every, turned_once = (MeshPaths(97, EQUAL, 0.1, symmetry) for symmetry in (1, 3))
    for paths, step, words in ((every, 3, "equal spacing, N = 3"), (PAIR, 2, "(0, 24, 50, 74)/100 turn")):
        order, lines = structure_lines(structure, solved(paths, structure, speeds))
        size = np.abs(order**2 * lines)
        leak = size[..., order % step != 0].max() / size.max()
        words = f"{words}: largest acceleration off the multiples of {step} over the largest"
        rows.append(at_most("order rules", "symmetry", words, 1e-10, leak))
    full, single = (structure_lines(structure, solved(p, structure, speeds)) for p in (every, turned_once))
    apart = np.abs(full[1][..., full[0] % 3 == 0] - single[1]).max() / np.abs(single[1]).max()
    rows.append(at_most("order rules", "all planets", "one planet against three: sensor lines", 1e-10, apart))
    return tuple(rows)


def _foundation(max_diameter: int, damping: float) -> tuple[CyclicModes, FixedStructure]:
    """The ring on a foundation all around, and the structure that it is."""
    ring = thin_ring(max_diameter, foundation=2e10)
    options = {"max_diameter": max_diameter, "max_frequency": 1e6, "damping_ratio": damping}
    return ring, supported_ring(ring, (), sensor_angles=(0.3,), **options)


def joined(paths: MeshPaths, ring: CyclicModes, max_diameter: int) -> MechanicalSystem:
    """Gears and ring in the frame of the carrier."""
    system, place = gears(paths.planet_angles), np.array(paths.planet_angles) + paths.load_angle
    waves = circumferential(ring, ring.load[:, 0], max_diameter)
    at = np.real(waves @ np.exp(1j * np.outer(np.arange(-max_diameter, max_diameter + 1), place)))
    n, size = len(system.K), len(at)
    natural = 2 * np.pi * np.repeat(ring.frequency, np.where(ring.paired, 2, 1))
    M, K = np.eye(n + size), np.diag(np.append(np.zeros(n), natural**2))
    M[:n, :n], K[:n, :n] = system.M, system.K
    W = np.vstack([system.W, np.hstack([np.zeros_like(at), -at])])
    load = np.append(system.load, np.zeros(size))
    return MechanicalSystem(M, 0 * K, K, W, load, ("",) * len(K))


def _apart(two_way, present, structure, field, teeth, base, leaders) -> tuple[np.ndarray, np.ndarray]:
    """Mesh forces of the two-way response against present dynamics, and lines of the sensor at 0.3.

    Differences at every speed: over the largest fluctuation of a force, and over the largest line.
    """
    H = present.force.shape[-1]
    middle, force = (
        two_way.force[..., np.isin(two_way.order, np.arange(H) * teeth)],
        present.force[:, leaders],
    )
    lines = component_lines(field, teeth, base, 0.3)
    order, sensor_response = structure_lines(structure, two_way)
    same, expected = np.isin(order, lines.order), np.zeros((len(base), len(order)), complex)
    expected[:, same] = lines.displacement[:, np.isin(lines.order, order)]
    still = order < 0.5 * teeth
    moving = np.abs(sensor_response[:, 0] - expected)[:, ~still].max(axis=1) / np.abs(expected[:, ~still]).max(axis=1)
    apart = np.abs(middle - force).max(axis=(1, 2)) / np.abs(force[..., 1:]).max(axis=(1, 2))
    return apart, moving


def axisymmetric() -> tuple[Row, ...]:
    """A foundation all around: what the carrier frame knows already.

    The present dynamics leave the convective terms of the ring out, which are n/z_ring of the frequency: they
    vanish for 1e13 teeth. With few teeth the wave n has its receptance at the order h z_ring - n. With modal
    damping of the set as a whole gears and ring damp each other.
    """
    ring, teeth, rows = _foundation(5, 0.0)[0], 10**13, list[Row]()
    paths, speed = MeshPaths(teeth, EQUAL, 0.1), np.array([1.0, 20.0, 100.0, 700.0, 1500.0, 3000.0])
    # angles whose mesh phases are zero to rounding
    drive = excitation(replace(paths, z_ring=0))
    system, whole, mean = gears(EQUAL), joined(paths, ring, 5), drive.stiffness.mean(axis=1)
    kept = {"excitation_harmonics": 2, "response_harmonics": 6}
    for ratio in (0.0, 0.01, 0.05):
        structure = _foundation(5, ratio)[1]
        modes, rigid = (undamped_modes(equations, mean, damping_ratio=ratio) for equations in (whole, system))
        present = solve_spectral(modes, drive, speed / (2 * np.pi), tolerance=1e-12, method="direct", **kept)
        field = np.swapaxes(modes.shape[len(system.K) :] @ present.modal, 1, 2)
        field = field @ circumferential(ring, ring.output[:, 0], 5)
        two_way = solve_two_way(
            rigid,
            drive,
            structure,
            paths,
            speed / teeth,
            harmonics=(2, 6),
            tolerance=1e-13,
            damping=modal_damping(whole, mean, ratio) if ratio else None,
        )
        apart = _apart(two_way, present, structure, field, teeth, speed / teeth, slice(None))
        words = f"against the dynamics of the set on its foundation, 1e13 teeth, damping {ratio:g}"
        rows.append(at_most("axisymmetric", "solve_spectral", f"mesh forces {words}", 1e-10, apart[0].max()))
        rows.append(at_most("axisymmetric", "component_lines", f"sensor lines {words}", 1e-10, apart[1].max()))
    return (*rows, *_convective())


def _convective() -> tuple[Row, ...]:
    structure, paths, speed, ratio = _foundation(5, 0.03)[1], MeshPaths(37, EQUAL, 0.1), 20.0, 0.04
    response = solved(paths, structure, np.array([-speed]), harmonics=8, ratio=ratio, tolerance=1e-13)
    drive, system = excitation(paths, -1), gears(EQUAL)
    mean = drive.stiffness.mean(axis=1)
    damping, between = modal_damping(system, mean, ratio), np.subtract.outer(EQUAL, EQUAL)
    receptance, natural = np.empty((6, 6, 1, 9), complex), structure.natural_frequency
    for h in range(9):
        w = h * 37 * speed
        free = system.W.T @ np.linalg.solve(system.K + 1j * w * damping - w**2 * system.M, system.W)
        for n in range(-5, 6):
            # the carrier turns backwards
            wave = (h * 37 + n) * speed
            modal = 1 / (natural**2 - wave**2 + 2j * 0.03 * natural * wave)
            free[3:, 3:] += modal @ np.abs(structure.ring_shape[:, n + 5]) ** 2 * np.exp(1j * n * between)
        receptance[:, :, 0, h] = np.linalg.solve(np.eye(6) + free * mean, free)
    k, s, F = (pad(harmonics_of(signal, 2), 8)[:, None] for signal in (drive.stiffness, drive.deflection, drive.force))
    forcing = F - Product(k)(s)
    source = -np.einsum("ijsh,jsh->ish", receptance, forcing)
    rigid = system.W.T @ np.linalg.solve(system.K, system.load)
    source[:, 0, 0] += rigid - np.real(receptance[:, :, 0, 0]) @ (mean * rigid)
    fluctuating = np.array(k)
    fluctuating[..., 0] -= mean[:, None]
    force = forcing + Product(k)(solve_direct(HarmonicProblem(receptance, Product(fluctuating), source)))
    middle = response.force[0][:, np.isin(response.order, np.arange(9) * 37)]
    apart = np.abs(middle - force[:, 0]).max() / np.abs(force[..., 1:]).max()
    words = "mesh forces against the carrier frame with convective terms, 37 teeth"
    return (at_most("axisymmetric", "solve_direct", words, 1e-10, apart),)


def _moving(structure: FixedStructure, angles) -> np.ndarray:
    """Displacement of the modes on the path at angles (...), (..., m)."""
    n = np.arange(-structure.max_diameter, structure.max_diameter + 1)
    return np.real(np.exp(1j * np.multiply.outer(angles, n)) @ structure.ring_shape.T)


def _sampled(response: TwoWayResponse, theta) -> np.ndarray:
    return np.real(response.force[0] @ np.exp(1j * np.outer(response.order, theta)))


def _short(structure: FixedStructure, count: int, kept: int) -> FixedStructure:
    """The first modes alone, no residual, waves up to ``kept`` nodal diameters."""
    n_max = structure.max_diameter
    inside = np.abs(np.arange(-n_max, n_max + 1)) <= kept
    return FixedStructure(
        structure.natural_frequency[:count],
        structure.damping_ratio[:count],
        structure.ring_shape[:count] * inside,
        structure.sensor_shape[:count],
        0 * structure.residual,
        0 * structure.sensor_residual,
    )


def _coordinates(structure: FixedStructure) -> np.ndarray:
    """Cosine and sine coordinates (n_ring, m) of the modes, of waves (cosine - i sine)/sqrt 2."""
    n = structure.wave_order
    pairs = np.sqrt(2) * np.stack([structure.wave_shape.real, -structure.wave_shape.imag], axis=-1)
    return np.stack(
        [
            structure.wave_shape[:, i].real if diameter == 0 else pairs[:, i, 0] if diameter > 0 else pairs[:, i - 1, 1]
            for i, diameter in enumerate(n)
        ]
    )


def in_time() -> tuple[Row, ...]:
    """Three rigid planets and some modes, integrated over a turn of the carrier.

    Four modes with modal damping of gears and modes; and a ring of two nodal diameters on feet, with modal
    damping of gears and ring as a whole without the feet, in the frame of the carrier. The ring's material
    moves with its velocity in space, turned into that frame.
    """
    paths, ring = MeshPaths(37, EQUAL, 0.1, 3), thin_ring(2, foundation=2e10)
    options = {"max_diameter": 2, "max_frequency": 1e6, "damping_ratio": 0.03, "sensor_angles": (0.3, 2.0)}
    mean = excitation(paths).stiffness.mean(axis=1)
    joint = modal_damping(joined(paths, ring, 2), mean, 0.04)
    return (
        *_in_time("ten degrees of freedom", paths, _short(feet(6), 4, 2), None),
        *_in_time("damping of gears and ring as a whole", paths, supported_ring(ring, FEET, **options), joint),
        *_in_time("errors that turn", paths, supported_ring(ring, FEET, **options), joint, shaken(paths, 2)),
        *_in_time(
            "an error of one planet",
            paths,
            supported_ring(ring, FEET, **options),
            joint,
            shaken(paths, 2, planet=1),
        ),
    )


def _equations(paths: MeshPaths, structure: FixedStructure, joint, drive, speed: float, ratio: float):
    """Rate of states of gears and modes as `solve_ivp` takes it, mesh forces, and the number of states."""
    system, mean, natural = gears(EQUAL), drive.stiffness.mean(axis=1), structure.natural_frequency
    n, m = len(system.K), len(natural)
    alone, size = modal_damping(system, mean, ratio), 2 * (n + m)
    P = drive.periods
    series = [harmonics_of(signal, 2 * P) for signal in (drive.stiffness, drive.deflection, drive.force)]
    shape = np.zeros((0, m)) if joint is None else _coordinates(structure)

    def forces(theta, state):
        """Mesh forces, and the modes' displacement at the meshes, of states (size, ...)."""
        wave = np.exp(1j * 37 / P * theta * np.arange(2 * P + 1))
        k, s, F = (np.real(lines_of_signal @ wave)[:, None] for lines_of_signal in series)
        path = _moving(structure, np.array(EQUAL) + 0.1 + theta)
        d = system.W.T @ state[:n]
        d[3:] -= path @ state[n : n + m]
        return k * d, F - k * s, path

    def damped(theta, v, r):
        """Damping forces on the gears and modes of their velocities."""
        if joint is None:
            return alone @ v, (2 * structure.damping_ratio * natural)[:, None] * r
        turn = np.eye(len(shape))
        for i in np.flatnonzero(structure.wave_order < 0):
            angle = structure.wave_order[i - 1] * theta
            turn[i - 1 : i + 1, i - 1 : i + 1] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        force = joint @ np.concatenate([v, turn @ shape @ r])
        return force[:n], (turn @ shape).T @ force[n:]

    def rate(time, flat, constant):
        state = flat.reshape(size, -1)
        linear, source, path = forces(speed * time, state)
        force = linear + source * constant
        x, q, v, r = np.split(state, [n, n + m, 2 * n + m])
        on_gears, on_modes = damped(speed * time, v, r)
        load = system.load[:, None] * constant - system.K @ x - on_gears - system.W @ force
        modal = path.T @ force[3:] - (natural**2)[:, None] * q - on_modes
        return np.concatenate([v, r, np.linalg.solve(system.M, load), modal]).ravel()

    return rate, forces, size


def _in_time(
    words: str, paths: MeshPaths, structure: FixedStructure, joint, drive: MeshExcitation | None = None
) -> tuple[Row, ...]:
    speed, drive = 20.0, drive or excitation(paths)
    modes = rigid_modes(paths, drive)
    response = solve_two_way(
        modes, drive, structure, paths, np.array([speed]), harmonics=(2, 12), side_bands=12, damping=joint
    )
    rate, forces, size = _equations(paths, structure, joint, drive, speed, 0.04)
    n, m = len(modes.shape), len(structure.natural_frequency)
    # the periodic motion by the monodromy matrix: columns of unit starts without load, then the loaded one
    start, constant = np.eye(size, size + 1), np.append(np.zeros(size), 1.0)
    times = np.linspace(0, response.turns * 2 * np.pi / speed, 200 * response.turns + 1)
    precise = {"method": "DOP853", "rtol": 1e-8, "atol": 1e-11, "t_eval": times}
    states = solve_ivp(rate, (0, times[-1]), start.ravel(), args=(constant,), **precise).y
    states = states.reshape(size, size + 1, -1)
    end = states[..., -1]
    first = np.append(np.linalg.solve(np.eye(size) - end[:, :size], end[:, size]), 1.0)
    motion, exact = np.einsum("ijt,j->it", states, first), np.empty((6, len(times)))
    for i, time in enumerate(times):
        linear, source, _ = forces(speed * time, motion[:, i : i + 1])
        exact[:, i] = (linear + source)[:, 0]
    ours = _sampled(response, speed * times)
    solved_for = [0, 3] if len(ours) == 2 else slice(None)
    apart = np.abs(ours - exact[solved_for]).max() / np.ptp(exact)
    order, lines = structure_lines(structure, response)
    at_sensor = np.real(lines[0] @ np.exp(1j * np.outer(order, speed * times)))
    expected = structure.sensor_shape.T @ motion[n : n + m]
    moved = np.abs(at_sensor - expected).max() / np.ptp(expected)
    return (
        at_most("in time", "DOP853", f"{words}: mesh forces over their range", 1e-5, apart),
        at_most("in time", "DOP853", f"{words}: sensors over their range", 1e-5, moved),
    )


def multipliers() -> tuple[Row, ...]:
    """Eleven degrees of freedom, hardly damped: the largest multiplier of a turn, stable and unstable."""
    paths, ring, rows = MeshPaths(37, EQUAL, 0.1, 3), thin_ring(2, foundation=2e10), list[Row]()
    ratio, options = 2e-4, {"max_diameter": 2, "max_frequency": 1e6, "damping_ratio": 2e-4}
    structure = supported_ring(ring, FEET, **options)
    drives = {depth: excitation(paths, depth=depth) for depth in (0.15, 0.4)}
    for words, speed, drive in (
        ("stable", 100.0, drives[0.15]),
        ("unstable", 230.0, drives[0.4]),
        ("an error of one planet", 100.0, shaken(paths, 2, planet=1)),
    ):
        mean = drive.stiffness.mean(axis=1)
        joint = modal_damping(joined(paths, ring, 2), mean, ratio)
        rate, _, size = _equations(paths, structure, joint, drive, speed, ratio)
        start, end = np.eye(size).ravel(), 2 * np.pi * drive.periods / speed
        turn = solve_ivp(rate, (0, end), start, "DOP853", args=(0.0,), rtol=1e-9, atol=1e-12).y[:, -1]
        reference = np.abs(np.linalg.eigvals(turn.reshape(size, size))).max()
        modes = undamped_modes(gears(EQUAL), mean, damping_ratio=ratio)
        kept = {"harmonics": 2, "damping": joint, "frequency_ratio": 1e3, "tolerance": 1e-8}
        multipliers = turn_stability(modes, drive, structure, paths, [speed], **kept)
        turns = "a turn" if drive.periods == 1 else f"{drive.periods} turns"
        text = f"eleven degrees of freedom, {words}: modulus of the largest multiplier of {turns}"
        rows.append(within("stability", "DOP853", text, reference, multipliers.modulus[0], 1e-6))
        text = f"{words}: 1 where the modulus is at most 1"
        rows.append(counted("stability", "DOP853", text, int(reference <= 1), int(multipliers.stable[0])))
    # the rotation of a ring is the same in both frames: present verdict, over a mesh period
    ring = thin_ring(0, foundation=2e10)
    structure = supported_ring(ring, (), max_diameter=0, max_frequency=1e6, damping_ratio=ratio)
    for words, speed, depth in (("stable", 100.0, 0.15), ("unstable", 170.0, 0.4)):
        drive = excitation(paths, depth=depth)
        mean, whole = drive.stiffness.mean(axis=1), joined(paths, ring, 0)
        modes, rigid = (undamped_modes(equations, mean, damping_ratio=ratio) for equations in (whole, gears(EQUAL)))
        frequency, joint = 37 * speed / (2 * np.pi), modal_damping(whole, mean, ratio)
        kept = {"excitation_harmonics": 2, "frequency_ratio": 1e3, "steps": 800}
        present = stability(modes, drive, frequency, **kept).modulus[0] ** 37
        kept = {"harmonics": 2, "damping": joint, "frequency_ratio": 1e3, "tolerance": 1e-8}
        multipliers = turn_stability(rigid, drive, structure, paths, [speed], **kept).modulus[0]
        text = f"set on its foundation, n = 0, {words}: modulus of the largest multiplier of a turn"
        rows.append(within("stability", "present verdict", text, float(present), multipliers, 1e-6))
    return tuple(rows)


def by_samples() -> tuple[Row, ...]:
    """Forces at samples of a turn, products in time, receptances by FFT, and GMRES, for all planets."""
    paths, speed, structure = MeshPaths(97, EQUAL, 0.1, 3), 2 * np.pi, feet(14)
    response = solved(paths, structure, np.array([speed]), harmonics=10)
    drive, system, count = excitation(paths), gears(EQUAL), 2048
    mean, theta, order = drive.stiffness.mean(axis=1), 2 * np.pi * np.arange(count) / count, np.arange(1025)
    damping, w, natural = modal_damping(system, mean, 0.04), speed * order, structure.natural_frequency
    dynamic = system.K + np.multiply.outer(1j * w, damping) - np.multiply.outer(w**2, system.M)
    gear = system.W.T @ np.linalg.solve(dynamic, system.W)
    modal = 1 / (natural**2 - w[:, None] ** 2 + 0.06j * natural * w[:, None])
    angles = np.add.outer(theta, np.array(EQUAL) + 0.1)
    path, wave = _moving(structure, angles), np.exp(1j * np.multiply.outer(angles, np.arange(-14, 15)))
    k, s, F = (
        np.real(harmonics_of(signal, 2) @ np.exp(1j * 97 * np.outer(np.arange(3), theta)))
        for signal in (drive.stiffness, drive.deflection, drive.force)
    )

    def deflection(force):
        """Of the meshes under forces (6, n_times)."""
        moved = np.fft.irfft(np.einsum("lij,jl->il", gear, np.fft.rfft(force)), count)
        q = np.fft.irfft(np.fft.rfft(np.einsum("tjm,jt->mt", path, force[3:])) * modal.T, count)
        static = np.real(
            np.einsum("tjn,nk,tik,it->jt", wave, structure.residual, wave.conj(), force[3:], optimize=True)
        )
        moved[3:] += np.einsum("tjm,mt->jt", path, q) + static
        return moved

    start = (system.W.T @ np.linalg.solve(system.K, system.load))[:, None]
    right, products = (F + k * (start - s)).ravel(), [0]

    def product(flat):
        products[0] += 1
        force = flat.reshape(6, count)
        return (force + k * deflection(force)).ravel()

    # the gears alone, with mean stiffness, precondition
    inverse = np.linalg.inv(np.eye(6) + mean[:, None] * gear)

    def nearly(flat):
        return np.fft.irfft(np.einsum("lij,jl->il", inverse, np.fft.rfft(flat.reshape(6, count))), count).ravel()

    shape = (6 * count, 6 * count)
    operator: Any = linalg.LinearOperator
    force, failed = linalg.gmres(
        operator(shape, matvec=product, dtype=float),
        right,
        rtol=1e-8,
        restart=200,
        maxiter=10,
        M=operator(shape, matvec=nearly, dtype=float),
    )
    exact = force.reshape(6, count)[[0, 3]]
    apart = np.abs(_sampled(response, theta) - exact).max() / np.ptp(exact)
    words = "four feet, 14 nodal diameters, 60 rpm of the carrier: mesh forces over their range"
    return (
        counted("by samples", "GMRES", "GMRES converged", 1, int(failed == 0)),
        at_most("by samples", "GMRES", words, 1e-4, apart, note=f"{products[0]} products"),
    )


def _green(angle, w: float) -> np.ndarray:
    """Radial displacement of the free thin ring per radial force at an angle and a frequency [rad/s].

    ``sum_n g(n) exp(i n phi)`` over all whole n of the rational g, by the residues at its six poles.
    """
    bending, inertia = E * INERTIA / R**3, RHO * AREA * R * w**2
    poles = np.sqrt(np.roots([bending, -2 * bending, bending - inertia, -inertia]) + 0j)
    z = np.concatenate([poles, -poles])
    slope = 2 * z * (bending * (3 * z**4 - 4 * z**2 + 1) - inertia)
    angle = np.mod(angle, 2 * np.pi)[..., None]
    # the larger exponential is divided out
    forward = np.imag(z) >= 0
    kernel = np.where(
        forward,
        np.exp(1j * z * angle) / np.expm1(2j * np.pi * np.where(forward, z, 1j)),
        np.exp(1j * z * (angle - 2 * np.pi)) / -np.expm1(-2j * np.pi * np.where(forward, -1j, z)),
    )
    return -np.sum(1j * z**2 / slope * kernel, axis=-1)


def green() -> tuple[Row, ...]:
    """A constant force runs around the ring on four radial springs: Ritz against the exact ring."""
    speed, top, sensor, places = 500.0, 200, 0.7, np.array([0.3, 1.9, 3.3, 5.0])
    held = [Support(angle, SPRING, 0.0) for angle in places]
    structure = supported_ring(
        thin_ring(top, (1.0, 0.0), lowest=1),
        held,
        max_diameter=top,
        max_frequency=1e5,
        damping_ratio=0.0,
        sensor_angles=(sensor,),
    )
    constant, none, paths = np.array([[[0.0], [1.0]]]), np.zeros(1), MeshPaths(1, (0.0,))
    load = TwoWayResponse(np.array([speed]), np.zeros(1, int), constant, *[none] * 3, *[none.astype(int)] * 2, paths)
    heard_order, sensor_response = structure_lines(structure, load)
    n = np.arange(1, top + 1)
    exact = np.empty(top, complex)
    for K in n:
        w = K * speed
        bending, inertia = E * INERTIA / R**3 * (K**2 - 1.0) ** 2, RHO * AREA * R * (1 + 1 / K**2) * w**2
        # the force is heard at the order K by its wave -K
        free = 1 / (2 * np.pi * (bending - inertia)) * np.exp(-1j * K * np.append(places, sensor))
        away = _green(np.subtract.outer(np.append(places, sensor), places), w)
        at = np.linalg.solve(np.eye(4) + SPRING * away[:4], free[:4])
        exact[K - 1] = 2 * (free[4] - SPRING * away[4] @ at)
    lines = sensor_response[0, 0, np.isin(heard_order, n)]
    apart = np.abs(lines - exact).max() / np.abs(exact).max()
    words = "four radial springs, force at 500 rad/s: lines of a sensor over the largest"
    return (at_most("moving force", "Green's function", words, 1e-6, apart),)


# teeth of sun and ring, places of the planets over the assembly positions, factors around the first harmonic
_PRINTED = (
    ((28, 68), np.arange(4) / 4, {64: 1.0, 66: 0.0, 67: 0.0, 68: 1.0, 70: 0.0, 72: 1.0}),
    ((30, 70), np.arange(4) / 4, {68: 1.0, 69: 0.0, 70: 0.0, 71: 0.0, 72: 1.0}),
    ((31, 95), np.arange(3) / 3, {93: 1.0, 94: 0.0, 95: 0.0, 96: 1.0}),
    ((27, 108), np.arange(3) / 3, {105: 1.0, 107: 0.0, 108: 1.0, 109: 0.0, 111: 1.0}),
    (
        (30, 70),
        np.array([0, 24, 50, 74]) / 100,
        {62: 0.930, 64: 0.426, 66: 0.876, 68: 0.536, 70: 0.809, 72: 0.637, 74: 0.729, 76: 0.729, 78: 0.637}
        | dict.fromkeys(range(61, 79, 2), 0.0),
    ),
    (
        (36, 84),
        np.array([0, 2, 6, 8]) / 12,
        {76: 0.5, 78: 1.0, 80: 0.5, 82: 0.5, 84: 1.0, 86: 0.5, 88: 0.5, 90: 1.0, 92: 0.5}
        | dict.fromkeys(range(75, 92, 2), 0.0),
    ),
)
# spacing and phasing, teeth, assembly positions of the planets, factor at the mesh order
_GROUPS = (
    ("equal, in phase", (28, 68), (0, 24, 48, 72), 1.0),
    ("equal, sequentially phased", (30, 70), (0, 25, 50, 75), 0.0),
    ("unequal, in phase", (36, 84), (0, 20, 60, 80), 1.0),
    ("unequal, sequentially phased", (30, 70), (0, 15, 50, 65), 0.0),
    ("unequal, arbitrarily phased", (30, 70), (0, 24, 50, 74), np.cos(np.pi / 5)),
)


def array_factors() -> tuple[Row, ...]:
    """The planet array factor against cosines, and the five groups by tooth numbers."""
    rows = list[Row]()
    for (sun, ring), place, factors in _PRINTED:
        apart = np.abs(array_factor(2 * np.pi * place, [*factors]) - [*factors.values()]).max()
        words = f"{sun}/{ring}, planets at {', '.join(f'{360 * angle:.4g}' for angle in place)} deg: factors of "
        source = "closed form, three digits"
        rows.append(at_most("array factor", source, f"{words}{len(factors)} orders", 0.0005, apart))
    for i, (words, (sun, ring), place, factor) in enumerate(_GROUPS, 1):
        ours = float(array_factor(2 * np.pi * np.array(place) / (sun + ring), ring))
        source = f"group {i} of Inalpolat and Kahraman (2009)"
        text = f"{sun}/{ring}, {words}: factor of the mesh order"
        rows.append(within("array factor", source, text, factor, ours, 1e-12, relative=False))
        # torque of all ring meshes over that of meshes in phase, from the phases of the teeth
        torque = round(float(phasing_table(MeshPhasing(sun, ring, place), (1,)).members[0, 1, 0]), 12)
        text = f"{sun}/{ring}, {words}: factor of the mesh order, torque on the ring by its mesh phases"
        rows.append(within("array factor", "phases of the teeth", text, torque, ours, 1e-12, relative=False))
    return tuple(rows)


def turning_errors() -> tuple[Row, ...]:
    """Planets that are heard while they pass a sensor, with a sun or one planet that runs out: every line.

    Amplitudes ``(1 + 0.3 cos(angle of the error to the mesh)) cos(z_ring (theta + psi))`` through a window
    ``exp(cos(theta + psi))``, over so many turns of the carrier that all repeats itself.
    """
    rows, (sun, planet, ring) = list[Row](), (30, 20, 70)
    for places in ((0, 25, 50, 75), (0, 24, 50, 74)):
        psi = 2 * np.pi * np.array(places) / (sun + ring)
        for name, turns in (("no error", 0), ("the sun", sun), ("one planet", planet)):
            count = max(turns, 1)
            theta = 2 * np.pi * np.arange(640 * count) / 640
            passing = theta[:, None] + psi
            # of the sun its turn against the arm of each planet
            error = ring / sun * theta[:, None] - psi if turns == sun else ring / planet * theta[:, None]
            shaken = np.array([turns != planet or j == 0 for j in range(4)]) * 0.3 * bool(turns)
            sensor_signal = (1 + shaken * np.cos(error)) * np.cos(ring * passing) * np.exp(np.cos(passing))
            spectrum = order_spectrum(sensor_signal.sum(axis=1))
            lines = np.flatnonzero(spectrum.amplitude > 1e-9 * spectrum.amplitude.max())
            classified = [classify_line(k / count, psi, (ring, sun, planet), tolerance=1e-6) for k in lines if k]
            kinds = [line.verdict for line in classified]
            unequal = len(kinds) - kinds.count(NORMAL)
            # a healthy set has multiples of its symmetry alone
            whole = (lines % count == 0) & (lines // count % (4 if places[1] == 25 else 2) == 0)
            words = f"30/20/70 at {places}/100 turn, {name} with an error: lines that need it"
            words = words if turns else f"30/20/70 at {places}/100 turn, no error: lines that need one"
            rows.append(counted("turning parts", "sum in time", words, int((~whole).sum()), unequal))
            text = f"the same: lines that are not of this stage, of {len(lines)}"
            rows.append(counted("turning parts", "sum in time", text, 0, kinds.count(FOREIGN)))
    return tuple(rows)


def reference_set_on_supports() -> tuple[Row, ...]:
    """The reference set, hardly damped, on next to no support: its present dynamics but for the inertia of
    waves that run around in the frame of the carrier, which is little at low speed."""
    weak = [{"angle": "0 deg", "radial_stiffness": "1 N/m", "tangential_stiffness": "1 N/m"}]
    entries = {"dynamics.damping_ratio": 1e-4, "housing.form": "exact", "housing.published": []}
    case = with_values(reference_case(), entries | {"operation.speeds": ["250 rpm"]})
    static = solve_static(case)
    modes = elastic.solve_modes(case, static)
    held = with_values(case, {"housing.support": weak})
    dynamics = [elastic.solve_dynamics(variant, static, modes) for variant in (case, held)]
    present, ours = (elastic.solve_housing(*two) for two in zip((case, held), dynamics))
    theirs, other = present.exact, ours.exact
    apart = np.abs(theirs.order - theirs.z_ring * np.rint(theirs.order / theirs.z_ring))
    kept = (theirs.order < 6.5 * theirs.z_ring) & (apart <= 14)
    lines = theirs.acceleration[0, kept]
    apart = np.abs(other.acceleration[0, np.isin(other.order, theirs.order[kept])] - lines).max()
    words = "reference set, 250 rpm, damping 1e-4: lines of six mesh harmonics, n to 14, over the largest"
    level = float(ours.supported["one_way_level"][0])
    return (
        at_most("axisymmetric", "present dynamics", words, 0.01, apart / np.abs(lines).max()),
        within(
            "axisymmetric",
            "forces one way",
            "the same: level, m/s^2",
            level,
            order_level(ours.lines)[0],
            1e-6,
        ),
    )


def reference_set_in_its_ring() -> tuple[Row, ...]:
    """The reference set without supports, 1e9 times its teeth: its present dynamics, with their damping.

    With few harmonics, and with all up to 22.5 kHz. At low speed the forces hardly fluctuate, for planets in
    phase share a constant torque: rounding of the stiffnesses, from the coupling to the flanks, is then what
    differs, with damping and without.
    """
    few = (np.array([540.0, 1116.0]), (6, 12), "1500 and 3100 rpm, six harmonics")
    every = ((250, (250, 262)), (1000, (62, 74)), (3100, (20, 32)))
    speeds = (
        few,
        *((np.array([0.36 * rpm]), kept, f"{rpm} rpm, {kept[0]} harmonics up to 22.5 kHz") for rpm, kept in every),
    )
    case, rows = with_values(reference_case(), {"housing.form": "exact"}), list[Row]()
    modes = elastic.solve_modes(case, solve_static(case))
    for ratio, chosen_speeds in ((0.01, speeds[:1]), (0.05, speeds)):
        for frequency, kept, name in chosen_speeds:
            apart = _in_its_ring(case, modes, ratio, frequency, kept)
            words = f"reference set, {name}, 108e9 teeth, damping {ratio:g}"
            gate = 1e-10 if kept[0] == 6 else 1e-8
            for method, quantity, far in zip(
                ("solve_spectral", "component_lines"), ("mesh forces", "sensor lines"), apart
            ):
                rows.append(at_most("axisymmetric", method, f"{words}: {quantity}", gate, far.max()))
    return tuple(rows)


def _present(whole, drive, ratio: float, frequency, kept) -> tuple[Modes, Any]:
    """Modes and response of the whole set; of few harmonics the mean over roundings of its stiffnesses.

    Each last digit of theirs moves the fluctuation of the forces by 1e-10, for it is a thousandth of their
    mean; both halves of the roundings agree to 4e-12.
    """
    few = kept[0] == 6
    modes_and_drives = list[tuple[Modes, Any]]()
    for digits in range(-_ROUNDINGS, _ROUNDINGS + 1) if few else (0,):
        factor = 1.0 + digits * np.finfo(float).eps
        stiffness, flexibility = factor * drive.stiffness, whole.flexibility / factor
        joint = undamped_modes(replace(whole, flexibility=flexibility), stiffness.mean(axis=1), damping_ratio=ratio)
        response = solve_spectral(
            joint,
            replace(drive, stiffness=stiffness),
            frequency,
            tolerance=1e-12,
            method="direct" if few else "auto",
            excitation_harmonics=kept[0],
            response_harmonics=kept[1],
        )
        modes_and_drives.append((joint, response))
    joint, middle = modes_and_drives[len(modes_and_drives) // 2]
    force = np.mean([response.force for _, response in modes_and_drives], axis=0)
    # modal coordinates have the signs and pairs of their own modes
    moved = np.mean([modes.shape @ response.modal for modes, response in modes_and_drives], axis=0)
    modal = np.linalg.solve(joint.shape, moved) if few else middle.modal
    return joint, replace(middle, force=force, modal=modal)


def _in_its_ring(case, modes, ratio: float, frequency, kept) -> tuple[np.ndarray, np.ndarray]:
    """Differences of both routes, see `_apart`, at mesh frequencies (n,) [Hz], (excited, kept) harmonics."""
    n_max, ring, model = 14, modes.ring, modes.model
    low = {name: getattr(ring, name)[: n_max + 1] for name in ("compliance", "held_compliance")}
    drive, flexibility = mesh_springs(planetary_set(case), replace(ring, **low), modes.state)
    W, mean = model.system.W.copy(), drive.stiffness.mean(axis=1)
    W[model.ring_slice][model.ring_diameter > n_max] = 0.0
    whole, teeth = replace(model.system, W=W, flexibility=flexibility), 108 * 10**9
    base = 2 * np.pi * frequency / teeth
    paths = MeshPaths(teeth, tuple(planetary_set(case).planet_angles), ring.load_angle, 3)
    rigid = undamped_modes(gears_alone(model, flexibility), mean, damping_ratio=ratio)
    joint, present = _present(whole, drive, ratio, frequency, kept)
    field = np.swapaxes(joint.shape[model.ring_slice] @ present.modal, 1, 2)
    field = field @ circumferential(ring.modes, ring.modes.output[:, 0], n_max)
    structure = supported_ring(
        ring.modes, (), max_diameter=n_max, max_frequency=np.inf, damping_ratio=ratio, sensor_angles=(0.3,)
    )
    ours = solve_two_way(
        rigid,
        drive,
        structure,
        paths,
        base,
        harmonics=kept,
        damping=modal_damping(whole, mean, ratio),
        tolerance=1e-14,
    )
    return _apart(ours, present, structure, field, teeth, base, [0, 3])
