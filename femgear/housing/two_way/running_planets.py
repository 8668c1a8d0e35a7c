"""Planets that run around in one fixed structure, which they meet at their meshes and their pins.

Everything that looks the same from every angle of the carrier stands still: shafts with sun and carrier, ring,
bearings, casing, other stages. It is a structure of modes m. Planet j at ``phi_j = psi_j + s Omega t`` meets it
at contact points c, its meshes and the springs of its pin. Per unit of a mode a point approaches by
``sum_n P[c, n, m] exp(i n phi_j)``: n = 0 of rotations and axial motions, +-1 of lateral ones and tilts. With
the motions x of the planet in the frame of the carrier, its approaches A, and forces g of the springs

    Delta = A^T x + sum_n sum_m P[n, m] exp(i n phi_j) q_m[K],     g = e + k Delta,       K = L - s n
    (M (d/dt + s Omega S)^2 + G (d/dt + s Omega S)) x = -A g,      q_m[K] = -H_m sum_j sum_n conj(P exp(i n phi_j)) g

where S turns vectors by 90 degrees: Coriolis and centripetal terms are those of the turning frame. Forces beyond
the mean stiffness k0 of the meshes, ``e = s + kappa Delta``, have the static part ``s = (F - mean F) - k (ste -
mean ste)``. For given e every mesh harmonic is a small system of its own; kappa couples them in time, and GMRES
solves for e (`femgear.housing.two_way.response` has the same structure for a ring alone). All is about the mean
state, which statics give: motions that nothing holds take up no mean force.

N equal planets move the structure at ``K = 0, N, 2 N, ...`` alone. Where no wave beyond n = +-1 exists and N is 3
or more, the side bands fall into groups of three that know nothing of one another but for kappa.

Friction of the flanks acts at points of its own, along the tangents and as couples: forces g that are given, as they
do not follow the forces of the motion.

A pair is the case without planets: one mesh, n = 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femgear.errors import ConvergenceError
from femgear.gears.shaft_graph import connected_sets
from femgear.housing.sensor import ReadOnlyArrays
from femgear.housing.two_way.carrier_orders import CarrierOrders, MeshPaths, planet_groups
from femgear.housing.two_way.mesh_fluctuation import CYCLES, MeshFluctuation, gmres
from femgear.housing.two_way.response import check_repeated
from femgear.housing.two_way.running_ring import RunningRing, ring_compliance, ring_motion
from femgear.system.fourier import Product, pad
from femgear.system.system import MeshExcitation, mesh_harmonics, source_harmonics

RING = 1
"""Contact point of a planet with the ring."""
_RESIDUAL = 1e-6
"""Residual that is refused."""
_STILL = 1e-12
"""Frequency over the mesh frequency below which it is none."""
_SINGULAR = 1e-11
"""Singular value of a scaled system of the means, over the largest, of a motion of the whole that nothing holds."""
_BENDING = 1e-10
"""Square of a frequency of a free planet, over the highest, of a motion that bends it."""
_INDEPENDENT = 1e-13
"""Coupling of two motions of a planet over their own, in mass or stiffness, that is rounding."""
_ROOM = 64e6
"""Size of the systems that are in memory together [bytes]."""


@dataclass(frozen=True)
class RubbingPoints(ReadOnlyArrays):
    """Where friction of the flanks acts: F = 2 kinds points, along the tangent of each kind of mesh, then as a couple.

    Parameters
    ----------
    shape : (F, W, m) complex array
        Sliding of flank 1 on flank 2, and its turning against it, as `RunningStage.shape` [kg^-1/2, rad m^-1 kg^-1/2].
    approach : (p, F) array
        The same per unit of the motions of a planet [1, m].
    """

    shape: np.ndarray
    approach: np.ndarray

    def __len__(self) -> int:
        return len(self.shape)


@dataclass(frozen=True)
class PlanetMotions:
    """Motions of a planet, all of them or some that know nothing of the others.

    Parameters
    ----------
    ways : (p, n) array
        Unit vectors of the motions along the axes of the planet [1].
    mass, gyroscopic, turning : (n, n) arrays
        Of them, as of `RunningStage`.
    elastic : (n, n) array or None
        Stiffness between them [N/m, N, N m/rad].
    """

    ways: np.ndarray
    mass: np.ndarray
    gyroscopic: np.ndarray
    turning: np.ndarray
    elastic: np.ndarray | None

    def part(self, ways: np.ndarray) -> PlanetMotions:
        """Take some of the motions, ways (p, n)."""
        matrices = (self.mass, self.gyroscopic, self.turning, self.elastic)
        return PlanetMotions(ways, *(None if matrix is None else ways.conj().T @ matrix @ ways for matrix in matrices))  # type: ignore[arg-type]


@dataclass(frozen=True)
class RunningStage(ReadOnlyArrays):
    """A stage, of N planets or a pair, and the structure that it runs in.

    Parameters
    ----------
    natural_frequency : (m,) array
        Of the mass-normalised modes of the structure without the stage [rad/s]; zero of motions that nothing holds.
    damping_ratio : (m,) array
        Of these modes [1].
    shape : (C, W, m) complex array
        Approach P of the contact points of a planet at angle 0 by the waves n = -(W-1)/2 .. (W-1)/2 [kg^-1/2, m
        kg^-1/2 of springs against rotation]; meshes come first.
    mass, gyroscopic : (p, p) arrays
        Of one planet [kg, kg m^2], the latter that of its rotation over the mesh frequency [kg, kg m^2]; p = 0 of a
        pair. Axes: radial, tangential, z.
    turning : (p, p) array
        S: time derivative of the axes at unit speed, ``e_r' = e_t``.
    approach : (p, C) array
        Approach of the contact points per unit of the motions of a planet [1, m].
    stiffness : (C,) array
        Of the springs, those of the meshes the mean of the excitation [N/m, N m/rad]; infinite ones are rigid.
    loss : (C,) array
        Loss factor of the springs, twice the damping ratio that they alone would give a mode [1].
    excitation : MeshExcitation
        Of the meshes kind by kind (sun, ring), planet by planet; its sources those of friction on all of them, point
        by point and planet by planet.
    paths : MeshPaths
        Teeth of the ring, negative where planets follow one another against the sense of the carrier, angles and
        symmetry of the planets.
    sense : int
        Of the carrier, 1 or -1.
    structure_loss : float
        Loss factor of the structure, which adds to its damping ratios half of itself [1].
    viscous : (C,) array, optional
        Viscous damping of the springs [N s/m, N m s].
    flexibility : (N, C, N, C) array, optional
        Compliance between the springs of all planets by bodies that they have in common, such as an elastic
        carrier, in series with the springs [m/N]. A turn from planet to planet maps it on itself.
    ring : RunningRing, optional
        Elastic ring in series with the meshes planet-ring.
    rubbing : RubbingPoints, optional
        Where the sources of the excitation act; without it there is no friction.
    elastic : (p, p) array, optional
        Stiffness of a planet that bends, or of a branch of planets, between its own motions [N/m, N, N m/rad].
    """

    natural_frequency: np.ndarray
    damping_ratio: np.ndarray
    shape: np.ndarray
    mass: np.ndarray
    gyroscopic: np.ndarray
    turning: np.ndarray
    approach: np.ndarray
    stiffness: np.ndarray
    loss: np.ndarray
    excitation: MeshExcitation
    paths: MeshPaths
    sense: int = 1
    structure_loss: float = 0.0
    viscous: np.ndarray | None = None
    flexibility: np.ndarray | None = None
    ring: RunningRing | None = None
    rubbing: RubbingPoints | None = None
    elastic: np.ndarray | None = None

    @property
    def waves(self) -> np.ndarray:
        """Circumferential orders n (W,)."""
        return np.arange(self.shape.shape[1]) - self.shape.shape[1] // 2

    @cached_property
    def groups(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Leaders (G,), group (N,) and turns (N,) of the planets, see `planet_groups`."""
        return planet_groups(self.paths.planet_angles, self.paths.symmetry)

    @property
    def kinds(self) -> int:
        """Meshes of a planet: 2, of a pair 1."""
        return len(self.excitation.stiffness) // len(self.paths.planet_angles)

    @cached_property
    def every_shape(self) -> np.ndarray:
        """Shapes (C + F, W, m) of the contact points, and of those of friction."""
        return self.shape if self.rubbing is None else np.concatenate([self.shape, self.rubbing.shape])

    @cached_property
    def products(self) -> np.ndarray:
        """Products (m, (C W) ((C + F) W)) of the shapes of contact points with those of all points."""
        P, pushed = (shape.reshape(-1, shape.shape[2]) for shape in (self.shape, self.every_shape))
        return (P[:, None] * pushed.conj()).reshape(-1, P.shape[1]).T

    @cached_property
    def rigid_and_bent(self) -> tuple[np.ndarray, np.ndarray]:
        """Motions (p, r) of a planet that bends that bend nothing, and all others (p, p - r)."""
        assert self.elastic is not None
        # the mass gives shifts and tilts a common scale
        size = np.sqrt(np.maximum(np.diag(self.mass), np.finfo(float).tiny))
        values, vectors = np.linalg.eigh(self.elastic / np.outer(size, size))
        bending = values > _BENDING * values.max(initial=0.0)
        motions = vectors / size[:, None]
        return motions[:, ~bending], motions[:, bending]

    @property
    def ring_points(self) -> dict[int, np.ndarray]:
        """Points at which the meshes push the elastic ring, each with what it moves by unit waves (r,)."""
        assert self.ring is not None
        pushed = {RING: self.ring.approach}
        if self.rubbing is not None:
            assert self.ring.sliding is not None
            # the second kind of mesh, its friction and its couple
            pushed |= dict(zip(len(self.stiffness) + np.array([RING, self.kinds + RING]), self.ring.sliding))
        return pushed

    def receptance(self, omega: np.ndarray) -> np.ndarray:
        """Receptances (..., m) [s^2] of the modes at angular frequencies (...); free motions have none at rest."""
        omega = np.asarray(omega, float)[..., None]
        stiffness = self.natural_frequency**2 * (1.0 + 1j * self.structure_loss * np.sign(omega))
        below = stiffness - omega**2 + 2j * self.damping_ratio * self.natural_frequency * omega
        nothing = (self.natural_frequency == 0.0) & (omega == 0.0)
        return np.where(nothing, 0.0, 1.0 / np.where(nothing, 1.0, below))

    def compliance(self, omega: np.ndarray) -> np.ndarray:
        """Compliances (..., C) of the springs with their damping [m/N] at angular frequencies (...)."""
        omega = np.asarray(omega, float)[..., None]
        rigid = np.isinf(self.stiffness)
        stiffness = np.where(rigid, 1.0, self.stiffness) * (1.0 + 1j * self.loss * np.sign(omega))
        if self.viscous is not None:
            stiffness = stiffness + 1j * omega * self.viscous
        return np.where(rigid, 0.0, 1.0 / stiffness)

    @cached_property
    def planet_motions(self) -> PlanetMotions:
        """All motions of a planet along their axes."""
        return PlanetMotions(np.eye(len(self.mass)), self.mass, self.gyroscopic, self.turning, self.elastic)

    @cached_property
    def independent_motions(self) -> tuple[PlanetMotions, ...]:
        """Motions of a planet whose inertia and stiffness know nothing of the others.

        Whirls forwards and backwards of round shafts, their axial motions and rotations, and planets of a branch.
        """
        whirls = np.eye(len(self.mass), dtype=complex)
        for i, j in zip(*np.nonzero(self.turning == -1.0), strict=True):
            whirls[[i, j, i, j], [i, i, j, j]] = np.array([1j, 1.0, -1j, 1.0]) / np.sqrt(2.0)
        size = np.sqrt(np.maximum(np.diag(self.mass), np.finfo(float).tiny))
        coupled = np.eye(len(size), dtype=bool)
        for matrix in (self.mass, self.gyroscopic, self.turning * np.outer(size, size), self.elastic):
            if matrix is not None:
                effect = np.abs(whirls.conj().T @ (matrix / np.outer(size, size)) @ whirls)
                largest = np.sqrt(effect.max(axis=1, initial=0.0))
                coupled |= effect > _INDEPENDENT * np.outer(largest, largest)
        sets = connected_sets([np.flatnonzero(row) for row in coupled | coupled.T])
        return tuple(self.planet_motions.part(whirls[:, sorted(members)]) for members in sets)

    def planet_stiffness(
        self, omega: np.ndarray, mesh_frequency: float, speed: float, motions: PlanetMotions | None = None
    ) -> np.ndarray:
        """Dynamic stiffness (..., n, n) of a planet at angular frequencies (...) in the frame of the carrier.

        ``speed`` is that of the carrier, positive for its sense [rad/s]; ``motions`` by default all of them.
        """
        planet, omega = motions or self.planet_motions, np.asarray(omega, float)
        M, T, spinning = planet.mass, self.sense * speed * planet.turning, mesh_frequency * planet.gyroscopic
        # powers of i omega in M (d/dt + s Omega S)^2 + G (d/dt + s Omega S), then the springs and their loss
        matrices, powers = [M @ T @ T + spinning @ T, 2.0 * M @ T + spinning, M], [omega**0, 1j * omega, -(omega**2)]
        if planet.elastic is not None:
            matrices.append(planet.elastic)
            powers.append(1.0 + 1j * self.structure_loss * np.sign(omega))
        dynamic = np.stack(powers, axis=-1) @ np.stack(matrices).astype(complex).reshape(len(matrices), -1)
        return dynamic.reshape(*omega.shape, *M.shape)

    def shared(self, whole: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Compute the compliances (..., G, C, G, C) [m/N] by bodies in common.

        ``whole`` (...) are the orders of the carrier with the number of a pattern of the planets, ``omega`` (...) their
        angular frequencies [rad/s].
        """
        assert self.flexibility is not None
        leaders, group, turn = self.groups
        N, loss = self.paths.symmetry, self.loss.max(initial=0.0)
        member = group == np.arange(len(leaders))[:, None]
        phase = np.exp(2j * np.pi * ((self.sense * turn * (np.asarray(whole)[..., None] % N)) % N) / N)
        compliance = np.einsum("...j,hj,gcjd->...gchd", phase, member, self.flexibility[leaders], optimize=True)
        return compliance / (1.0 + 1j * loss * np.sign(np.asarray(omega)))[..., None, None, None, None]


@dataclass(frozen=True)
class RunningResponse(ReadOnlyArrays):
    """Periodic response of a stage in its structure at one speed, two-sided, of the harmonics 0 .. Q.

    Parameters
    ----------
    mesh_frequency, carrier_speed : float
        [rad/s], both positive or zero.
    force : (G, C + F, B, R) complex array
        Forces beyond their means on the contact points of the leading planets, and friction [N, N m], by harmonics and
        side bands.
    approach : (J, B, R) complex array
        Approaches of the leading meshes beyond their means [m].
    band : (S,) int array
        Side bands of the structure.
    modal : (Q + 1, S, m) complex array
        Coordinates of the modes of the structure [m kg^1/2], in all patterns of the planets.
    orders : CarrierOrders
        Lines and side bands of the forces: line q has the frequency of q/periods mesh frequencies.
    residual, radius : float
        Residual of the equations, and spectral radius of the iteration without GMRES [1].
    products : int
        Products with the fluctuating stiffness.
    tail : float
        Share (root of energies) of the mesh forces in the upper half of the harmonics, and in the outermost
        side bands.
    kinds : int
        Meshes of a planet.
    leaders : tuple of (int, int)
        Number of the leader of every planet, and its turns from that.
    """

    mesh_frequency: float
    carrier_speed: float
    force: np.ndarray
    approach: np.ndarray
    band: np.ndarray
    modal: np.ndarray
    orders: CarrierOrders
    residual: float
    radius: float
    products: int
    tail: tuple[float, float]
    kinds: int
    leaders: tuple[tuple[int, int], ...]

    @property
    def frequency(self) -> np.ndarray:
        """Angular frequencies (Q + 1, S) of the structure [rad/s]."""
        line = np.arange(len(self.modal))[:, None] / self.orders.periods
        return line * self.mesh_frequency + self.band * self.carrier_speed

    def lines(self, shape: np.ndarray) -> np.ndarray:
        """Amplitudes (Q + 1, S, k) of ``Re sum u exp(i frequency t)`` of places that the modes (m, k) move.

        Of harmonic 0 side bands below zero have none: they are the others' conjugates.
        """
        return self.one_sided(self.modal @ shape)

    def one_sided(self, values: np.ndarray) -> np.ndarray:
        """Give the one-sided amplitudes (Q + 1, S, k) of two-sided values (Q + 1, S, k), see `lines`."""
        amplitudes = 2.0 * values
        amplitudes[0, self.band < 0] = 0.0
        amplitudes[0, self.band == 0] *= 0.5
        return amplitudes


def solve_running(
    stage: RunningStage,
    mesh_frequency: float,
    carrier_speed: float,
    *,
    harmonics: tuple[int, int],
    side_bands: int | None = None,
    tolerance: float = 1e-10,
    cycles: int = CYCLES,
) -> RunningResponse:
    """Solve for the periodic response of a stage and its structure at one speed.

    CaseError: planets that do not repeat one another (E-SYMMETRY). ConvergenceError: equations that are nearly
    singular (E-RESONANCE).

    Parameters
    ----------
    stage : RunningStage
    mesh_frequency, carrier_speed : float
        [rad/s], both positive; the speed zero of a pair and of a carrier that stands still.
    harmonics : two ints
        Mesh harmonics of the excitation, and of the response.
    side_bands : int, optional
        On either side of every harmonic; by default four times the largest wave.
    tolerance : float
        Residual over the norm of what fluctuates.
    cycles : int
        Of GMRES.
    """
    (response,) = solve_excitations(
        (stage,),
        mesh_frequency,
        carrier_speed,
        harmonics=harmonics,
        side_bands=side_bands,
        tolerance=tolerance,
        cycles=cycles,
    )
    return response


def solve_excitations(
    stages: Sequence[RunningStage],
    mesh_frequency: float,
    carrier_speed: float,
    *,
    harmonics: tuple[int, int],
    side_bands: int | None = None,
    tolerance: float = 1e-10,
    cycles: int = CYCLES,
) -> list[RunningResponse]:
    """Solve for the responses of stages that differ in their excitation alone: what moves is solved once.

    Parameters
    ----------
    stages : sequence of RunningStage
        Of equal motions, springs, periods of the excitation and paths.
    mesh_frequency, carrier_speed, harmonics, side_bands, tolerance, cycles
        As of `solve_running`, which says what is refused.
    """
    problems = [_Problem(stage, harmonics, side_bands) for stage in stages]
    parts = list(problems[0].parts(mesh_frequency, carrier_speed))
    return [problem.solve(parts, mesh_frequency, carrier_speed, tolerance, cycles) for problem in problems]


@dataclass(frozen=True)
class _Part:
    """Blocks whose side bands act on one another through the structure, solved for unit forces of the meshes.

    Parameters
    ----------
    blocks : (k,) int array
        Their numbers.
    bands : (b,) int array
        Places of the side bands.
    structure_bands : (s,) int array
        Side bands of the structure between them.
    answer : (k, b G C, b M G) complex array
        Forces of the contact points by the forces e beyond k0 [1].
    rubbed : (k, b G C, b F G) complex array
        The same by friction [1, 1/m].
    """

    blocks: np.ndarray
    bands: np.ndarray
    structure_bands: np.ndarray
    answer: np.ndarray
    rubbed: np.ndarray


def forces_on_structure(stage: RunningStage, response: RunningResponse, vectors: np.ndarray) -> np.ndarray:
    """Compute what the contact points of all planets do to motions of the structure, two-sided (Q + 1, S, k) [N, N m].

    Beyond the mean, at the side bands of `RunningResponse.band`.

    Parameters
    ----------
    stage : RunningStage
    response : RunningResponse
        Of that stage.
    vectors : (C + F, W, k) complex array
        Approach of the contact points of a planet at angle 0, and sliding, by every motion, wave by wave [1, m].
    """
    orders, N, n = response.orders, stage.paths.symmetry, stage.waves
    psi = np.asarray(stage.paths.planet_angles)[stage.groups[0]]
    padded = np.concatenate([response.force, np.zeros((*response.force.shape[:3], 1))], axis=3)
    forces = np.zeros((len(orders.base), len(response.band), vectors.shape[2]), complex)
    for w, wave in enumerate(n):
        place = orders.place(response.band + stage.sense * wave)
        around = np.exp(-1j * wave * psi)
        forces -= N * np.einsum("g,gcbs,ck->bsk", around, padded[..., place], vectors[:, w].conj(), optimize=True)
    moved = (orders.base[:, None] + orders.pattern[:, None] + response.band) % N == 0
    forces[~moved] = 0.0
    return forces.reshape(orders.patterns, -1, *forces.shape[1:]).sum(axis=0)


def ring_lines(stage: RunningStage, response: RunningResponse, angles, directions) -> np.ndarray:
    """Compute amplitudes (Q + 1, S, k) at fixed places of the elastic ring of a stage, beyond those of its seat [m].

    Parameters
    ----------
    stage : RunningStage
    response : RunningResponse
        Of that stage.
    angles : (k,) array
        Of the places around the ring [rad].
    directions : (k, 2) array
        Shares of radial (outwards) and tangential displacement.
    """
    if stage.ring is None or not len(angles):
        return np.zeros((*response.modal.shape[:2], len(angles)), complex)
    psi = np.asarray(stage.paths.planet_angles)[stage.groups[0]]
    speeds, places = (response.mesh_frequency, response.carrier_speed), (angles, directions)
    displacement = np.sum(
        [
            ring_motion(stage.ring, response.orders, response.force[:, at], psi, speeds, places, response.band, pushed)
            for at, pushed in stage.ring_points.items()
        ],
        axis=0,
    )
    return response.one_sided(displacement)


@dataclass(frozen=True)
class _PlanetEquations:
    """Equations of one planet, ``rows g + dynamic x = 0``, and what its motions x add to the approach of its points.

    Of a planet that bends motions are eliminated: all at mesh harmonics, about frequency zero those that bend it.

    Parameters
    ----------
    bands : (n,) int array
        Places of the bands that keep motions.
    compliance : (blocks, b, C, C + F) array
        Approach of the points by unit forces and friction through the motions that are eliminated [m/N].
    rows, columns, dynamic : (blocks, n, p, C + F), (blocks, n, C, p) and (blocks, n, p, p) arrays
        Of the motions that are kept.
    """

    bands: np.ndarray
    compliance: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    dynamic: np.ndarray


def _planet_equations(stage: RunningStage, omega: np.ndarray, mesh_frequency: float, speed: float) -> _PlanetEquations:
    """Make the equations of a planet at angular frequencies (blocks, b) in the frame of the carrier."""
    count, b = omega.shape
    pushed = stage.approach if stage.rubbing is None else np.hstack([stage.approach, stage.rubbing.approach])
    C = len(stage.stiffness)
    compliance = np.zeros((count, b, C, pushed.shape[1]), complex)
    if stage.elastic is None:
        dynamic = stage.planet_stiffness(omega, mesh_frequency, speed)
        rows = np.broadcast_to(pushed, (count, b, *pushed.shape))
        columns = np.broadcast_to(-stage.approach.T, (count, b, *stage.approach.T.shape))
        return _PlanetEquations(np.arange(b), compliance, rows, columns, dynamic)
    # motions that nothing bends have no stiffness at rest, be it in the frame of the carrier or in that of the casing
    still = (np.abs(omega) <= 1.5 * speed).any(axis=0)
    for motions in stage.independent_motions if not still.all() else ():
        moving = stage.planet_stiffness(omega[:, ~still], mesh_frequency, speed, motions)
        right = np.broadcast_to(motions.ways.conj().T @ pushed, (*moving.shape[:3], pushed.shape[1]))
        compliance[:, ~still] += (stage.approach.T @ motions.ways) @ np.linalg.solve(moving, right)
    if not still.any():
        rows, columns, dynamic = (
            np.zeros((count, 0, *shape)) for shape in (pushed.shape, stage.approach.T.shape, 2 * [len(stage.mass)])
        )
        return _PlanetEquations(np.flatnonzero(still), compliance, rows, columns, dynamic)
    rigid, bent = stage.rigid_and_bent
    dynamic = stage.planet_stiffness(omega[:, still], mesh_frequency, speed)
    kept, gone = dynamic @ rigid, dynamic @ bent
    inverse = np.linalg.inv(bent.T @ gone)
    through, of_bent = rigid.T @ gone @ inverse, bent.T @ pushed
    compliance[:, still] = of_bent[:, :C].T @ inverse @ of_bent
    rows = rigid.T @ pushed - through @ of_bent
    columns = of_bent[:, :C].T @ inverse @ (bent.T @ kept) - (rigid.T @ stage.approach).T
    return _PlanetEquations(
        np.flatnonzero(still), compliance, rows, columns, rigid.T @ kept - through @ (bent.T @ kept)
    )


class _Problem:
    """A stage with so many harmonics of the excitation and of the response, at any speed."""

    def __init__(self, stage: RunningStage, harmonics: tuple[int, int], side_bands: int | None):
        excited, kept = harmonics
        self.stage, widest, periods = stage, int(stage.waves[-1]), stage.excitation.periods
        self.leaders, group, turn = stage.groups
        bands = 4 * widest if side_bands is None else side_bands
        symmetry = stage.paths.symmetry
        patterns = 1 if periods == 1 else symmetry
        self.orders = CarrierOrders(stage.paths, kept * periods, widest, bands, stage.sense, periods, patterns)
        N, kinds = len(stage.paths.planet_angles), stage.kinds
        leading = np.concatenate([kind * N + self.leaders for kind in range(kinds)])
        owner = np.concatenate([kind * len(self.leaders) + group for kind in range(kinds)])
        turns = np.tile(turn, kinds)
        signals = mesh_harmonics(stage.excitation, excited)
        if patterns == 1 and periods == 1:
            check_repeated(signals, self.orders, *stage.groups)
            signals = tuple(values[leading] for values in signals)
            owner, turns = np.arange(len(leading)), np.zeros(len(leading), int)
        self.mean = np.repeat(stage.stiffness[:kinds], len(self.leaders))
        self.source, self.fluctuation = self._source(signals, owner, turns)
        self.rubbing = self._rubbing(excited, group, turn)

    def _source(self, signals, owner, turns) -> tuple[np.ndarray, MeshFluctuation]:
        """Static part of the forces beyond k0 (J, B, R), and the fluctuation of the stiffness."""
        stiffness, deflection, force = signals
        orders, lines = self.orders, self.orders.lines
        varying = stiffness.copy()
        varying[:, 0] -= self.mean[owner]
        deflection, force = deflection.copy(), force.copy()
        deflection[:, 0] = force[:, 0] = 0.0
        fluctuation = MeshFluctuation(varying, orders, owner, turns)
        forcing = pad(force, lines) - Product(pad(stiffness, lines))(pad(deflection, lines)[:, None])[:, 0]
        source = np.zeros((len(forcing), lines + 1, len(orders.bands)), complex)
        source[..., orders.middle] = 0.5 * forcing
        source[:, 0, orders.middle] = np.real(forcing[:, 0])
        return fluctuation.of_leaders(source), fluctuation

    def _rubbing(self, excited: int, group: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """Friction beyond its mean at the points of the leading planets (F G, B, R) [N, N m]."""
        orders, lines = self.orders, source_harmonics(self.stage.excitation, excited)
        points, N, G = 0 if self.stage.rubbing is None else len(self.stage.rubbing), len(group), len(self.leaders)
        friction = np.zeros((points * N, orders.lines + 1, len(orders.bands)), complex)
        if points and lines is not None:
            # sources push along the sliding, forces at points against it
            friction[..., orders.middle] = -0.5 * pad(lines, orders.lines)
            friction[:, 0] = 0.0
        if orders.patterns == 1 and orders.periods == 1:
            return friction.reshape(points, N, *friction.shape[1:])[:, self.leaders].reshape(-1, *friction.shape[1:])
        alone, turns = np.zeros((max(points, 1) * N, 1)), np.tile(turn, max(points, 1))
        owner = np.concatenate([point * G + group for point in range(max(points, 1))])
        return MeshFluctuation(alone, orders, owner, turns).of_leaders(friction) if points else friction

    def solve(
        self, parts: Sequence[_Part], mesh_frequency: float, speed: float, tolerance: float, cycles: int
    ) -> RunningResponse:
        """Solve at a mesh frequency and a speed of the carrier [rad/s], by the `parts` there."""
        orders, shape = self.orders, self.source.shape
        line = np.tile(np.arange(orders.lines + 1), orders.patterns) / orders.periods
        omega = line[:, None] * mesh_frequency + orders.bands * speed
        omega[np.abs(omega) < _STILL * mesh_frequency] = 0.0
        springs = np.repeat(self.stage.compliance(omega)[..., : self.stage.kinds], len(self.leaders), axis=-1)
        springs = springs.transpose(2, 0, 1)

        def approach(extra: np.ndarray) -> np.ndarray:
            return springs * (self._mesh_forces(parts, extra) - extra)

        def answer(flat: np.ndarray) -> np.ndarray:
            return self.fluctuation(approach(flat.view(complex).reshape(shape))).ravel().view(float)

        source, rubbed = self.source, 0.0
        if self.stage.rubbing is not None:
            rubbed = springs * self._mesh_forces(parts, self.rubbing, by_friction=True)
            source = source + self.fluctuation(rubbed)
        right = source.ravel().view(float)
        size = max(float(np.linalg.norm(right)), np.finfo(float).tiny)
        flat, residual, radius, products = gmres(answer, right, size, None, tolerance, cycles)
        if not residual < _RESIDUAL:
            hertz = mesh_frequency / (2.0 * np.pi)
            raise ConvergenceError(
                f"residual {residual:.3e} of the response at a mesh frequency of {hertz:.6g} Hz",
                code="E-RESONANCE",
                limit=f"{_RESIDUAL:g}",
                remedy="give the modes some damping",
            )
        extra = flat.view(complex).reshape(shape)
        force, (band, modal) = self._forces(parts, extra), self._modal(parts, extra, mesh_frequency, speed)
        tail = self._tail(force[:, : self.stage.kinds])
        figures = approach(extra) + rubbed, band, modal, orders, residual, radius, products, tail
        _, group, turn = self.stage.groups
        repeated = tuple(zip(group.tolist(), turn.tolist(), strict=True))
        return RunningResponse(mesh_frequency, speed, force, *figures, self.stage.kinds, repeated)

    def _groups_of_bands(self, residue: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Side bands that the structure connects, and the bands of the structure between them, by residue."""
        orders, waves = self.orders, self.stage.sense * self.stage.waves
        structure_bands = orders.structure_bands(residue)
        reached = [orders.place(band + waves) for band in structure_bands]
        owner = np.arange(len(orders.bands))
        for places in reached:
            inside = places[places < len(owner)]
            if len(inside):
                owner[np.isin(owner, owner[inside])] = owner[inside].min()
        for first in np.unique(owner):
            bands = np.flatnonzero(owner == first)
            used = [k for k, places in enumerate(reached) if np.isin(places, bands).any()]
            yield bands, structure_bands[used]

    def parts(self, mesh_frequency: float, speed: float) -> Iterator[_Part]:
        """Solve all blocks for unit forces e beyond k0."""
        orders, stage = self.orders, self.stage
        G, C, p = len(self.leaders), len(stage.stiffness), len(stage.mass)
        for residue in range(orders.paths.symmetry):
            blocks = orders.blocks(residue)
            if not len(blocks):
                continue
            for bands, structure_bands in self._groups_of_bands(residue):
                size = 16.0 * (len(bands) * G * (C + p)) ** 2
                for portion in np.array_split(blocks, int(np.ceil(len(blocks) * size / _ROOM))):
                    still = portion[orders.base[portion] + orders.seed[portion] == 0]
                    for chosen in (np.setdiff1d(portion, still), still):
                        if len(chosen):
                            answers = self._answer(chosen, bands, structure_bands, mesh_frequency, speed)
                            yield _Part(chosen, bands, structure_bands, *answers)

    def _answer(
        self, blocks, bands, structure_bands, mesh_frequency: float, speed: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Forces of the contact points by unit forces e of the meshes, (blocks, b G C, b G M), and by unit friction."""
        stage, orders, (G, C) = self.stage, self.orders, (len(self.leaders), len(self.stage.stiffness))
        b, line = len(bands), (orders.base[blocks] + orders.seed[blocks]) / orders.paths.z_ring
        omega = line[:, None] * mesh_frequency + orders.bands[bands] * speed
        omega[np.abs(omega) < _STILL * mesh_frequency] = 0.0
        inner, free = self._compliance(blocks, bands, structure_bands, omega, (mesh_frequency, speed))
        planets = _planet_equations(stage, omega, mesh_frequency, speed)
        for k in range(b):
            for g in range(G):
                inner[:, k, g, :, k, g] += planets.compliance[:, k]
        points, p = b * G * C, planets.dynamic.shape[2]
        size = points + len(planets.bands) * G * p
        system = np.zeros((len(blocks), size, size), complex)
        system[:, :points, :points] = inner[..., :C].reshape(len(blocks), points, points)
        for n, k in enumerate(planets.bands.tolist()):
            for g in range(G):
                at, of_points = points + (n * G + g) * p + np.arange(p), (k * G + g) * C + np.arange(C)
                system[:, at[:, None], of_points] = planets.rows[:, n, :, :C]
                system[:, of_points[:, None], at] = planets.columns[:, n]
                system[:, at[:, None], at] = planets.dynamic[:, n]
        if free:  # motions that nothing holds take up no mean force
            border = np.zeros((len(free), size), complex)
            border[:, :points] = free
            border = np.broadcast_to(border, (len(blocks), *border.shape))
            corner = np.zeros((len(blocks), len(free), len(free)))
            system = np.block([[system, -border.swapaxes(1, 2)], [border.conj(), corner]])
        right = self._unit_forces(inner, stage.compliance(omega), planets, system.shape[1])
        ends = np.array([b * G * stage.kinds])
        if free:
            answers = [_consistent(*equations, points) for equations in zip(system, right, strict=True)]
            by_meshes, by_friction = np.split(np.stack(answers), ends, axis=2)
            return by_meshes, by_friction
        # planets have units of their own
        rows = 1.0 / np.maximum(np.abs(system).max(axis=2), np.finfo(float).tiny)
        columns = 1.0 / np.maximum(np.abs(system * rows[:, :, None]).max(axis=1), np.finfo(float).tiny)
        scaled_forces = np.linalg.solve(system * rows[:, :, None] * columns[:, None], right * rows[:, :, None])
        by_meshes, by_friction = np.split((scaled_forces * columns[:, :, None])[:, :points], ends, axis=2)
        return by_meshes, by_friction

    def _compliance(
        self, blocks, bands, structure_bands, omega, speeds: tuple[float, float]
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """Compliance (blocks, b, G, C, b, G, C + F) between the points at angular frequencies (blocks, b).

        And approaches of motions that nothing holds, at rest.
        """
        stage, orders, (mesh_frequency, speed) = self.stage, self.orders, speeds
        b, G, C = len(bands), len(self.leaders), len(stage.stiffness)
        line = (orders.base[blocks] + orders.seed[blocks]) / orders.paths.z_ring
        inner, free = np.zeros((len(blocks), b, G, C, b, G, len(stage.every_shape)), complex), list[np.ndarray]()
        for band in structure_bands:
            free += self._add_structure(inner, band, bands, line * mesh_frequency + band * speed)
        every = np.arange(b)[:, None, None], np.arange(G)[:, None], np.arange(C)
        inner[:, every[0], every[1], every[2], every[0], every[1], every[2]] += stage.compliance(omega)[:, :, None, :]
        if stage.flexibility is not None:
            whole = (orders.base + orders.pattern)[blocks][:, None] + orders.bands[bands]
            shared = stage.shared(whole, omega)
            for k in range(b):
                inner[:, k, :, :, k, :, :C] += shared[:, k]
        if stage.ring is not None:
            angles = np.asarray(stage.paths.planet_angles)[self.leaders]
            for at, pushed in stage.ring_points.items():
                ring = ring_compliance(stage.ring, orders, blocks, orders.bands[bands], angles, speeds, pushed)
                for k in range(b):
                    inner[:, k, :, RING, k, :, at] += ring[:, k]
        return inner, free

    def _unit_forces(
        self, inner: np.ndarray, compliance: np.ndarray, planets: _PlanetEquations, size: int
    ) -> np.ndarray:
        """Right-hand sides (blocks, size, b G (M + F)) of unit forces e of all leading meshes, then of friction.

        Band by band, by the compliances of the points and (blocks, b, C) of the springs.
        """
        stage, kinds, G, C = self.stage, self.stage.kinds, len(self.leaders), len(self.stage.stiffness)
        count, b, p = len(inner), inner.shape[1], planets.dynamic.shape[2]
        right = np.zeros((count, size, b, kinds, G), complex)
        for k in range(b):
            for g in range(G):
                for kind in range(kinds):
                    right[:, (k * G + g) * C + kind, k, kind, g] = compliance[:, k, kind]
        if stage.rubbing is None:
            return right.reshape(count, size, -1)
        points, F = b * G * C, len(stage.rubbing)
        rubbing = np.zeros((count, size, b, F, G), complex)
        rubbing[:, :points] = -inner[..., C:].swapaxes(-1, -2).reshape(count, points, b, F, G)
        for n, k in enumerate(planets.bands.tolist()):
            for g in range(G):
                at = points + (n * G + g) * p
                rubbing[:, at : at + p, k, :, g] = -planets.rows[:, n, :, C:]
        return np.concatenate([right.reshape(count, size, -1), rubbing.reshape(count, size, -1)], axis=2)

    def _add_structure(self, inner: np.ndarray, band: int, bands: np.ndarray, omega: np.ndarray) -> list[np.ndarray]:
        """Add compliances of the structure at one of its bands; approaches of the motions that are free there."""
        stage, orders = self.stage, self.orders
        n, (C, W, _) = stage.waves, stage.shape.shape
        number = {int(place): k for k, place in enumerate(bands)}
        places = orders.place(band + stage.sense * n)
        connected = [(w, number[int(place)]) for w, place in enumerate(places) if int(place) in number]
        omega = np.where(np.abs(omega) < _STILL * max(np.abs(omega).max(), 1.0), 0.0, omega)
        both = (stage.receptance(omega) @ stage.products).reshape(len(omega), C, W, -1, W)
        psi = np.asarray(stage.paths.planet_angles)[self.leaders]
        N = stage.paths.symmetry
        for w, k in connected:
            for v, m in connected:
                phase = N * np.exp(1j * n[w] * psi)[:, None] * np.exp(-1j * n[v] * psi)
                inner[:, k, :, :, m] += phase[None, :, None, :, None] * both[:, None, :, w, None, :, v]
        if not (omega == 0.0).any():
            return []
        free_motions = []
        for mode in np.flatnonzero(stage.natural_frequency == 0.0):
            row = np.zeros(inner.shape[1:4], complex)
            for w, k in connected:
                row[k] += np.exp(1j * n[w] * psi)[:, None] * stage.shape[:, w, mode]
            if np.abs(row).max() > 1e-9 * np.abs(stage.shape[:, :, mode]).max(initial=0.0) > 0.0:
                free_motions.append(row.ravel())
        return free_motions

    def _sub(self, part: _Part, extra: np.ndarray) -> np.ndarray:
        """Forces e (blocks, b G M, 1) of a part of those of all (J, B, R)."""
        of_part = extra[:, part.blocks[:, None], part.bands]
        return of_part.transpose(1, 2, 0).reshape(len(part.blocks), -1, 1)

    def _mesh_forces(self, parts, extra: np.ndarray, *, by_friction: bool = False) -> np.ndarray:
        """Forces (J, B, R) of the leading meshes by forces e beyond k0, or by friction."""
        kinds, mesh_forces = self.stage.kinds, np.zeros(self.source.shape, complex)
        G, C = len(self.leaders), len(self.stage.stiffness)
        for part in parts:
            b, answer = len(part.bands), part.rubbed if by_friction else part.answer
            force = (answer @ self._sub(part, extra)).reshape(-1, b, G, C)[..., :kinds]
            mesh_forces[:, part.blocks[:, None], part.bands] = force.transpose(3, 2, 0, 1).reshape(-1, len(force), b)
        return mesh_forces

    def _part_forces(self, part: _Part, extra: np.ndarray) -> np.ndarray:
        """Forces (blocks, b, G, C + F) of all points of the leaders in a part by forces e beyond k0 and friction."""
        G, C = len(self.leaders), len(self.stage.stiffness)
        size, rubbing = (len(part.blocks), len(part.bands), G), self.stage.rubbing
        force = (part.answer @ self._sub(part, extra)).reshape(*size, C)
        if rubbing is None:
            return force
        given = self._sub(part, self.rubbing)
        force = force + (part.rubbed @ given).reshape(force.shape)
        return np.concatenate([force, given.reshape(*size[:2], len(rubbing), G).swapaxes(2, 3)], axis=3)

    def _forces(self, parts, extra: np.ndarray) -> np.ndarray:
        """Forces (G, C + F, B, R) of all points of the leaders by forces e beyond k0 and friction."""
        G, points = len(self.leaders), len(self.stage.every_shape)
        forces = np.zeros((G, points, *extra.shape[1:]), complex)
        for part in parts:
            forces[:, :, part.blocks[:, None], part.bands] = self._part_forces(part, extra).transpose(2, 3, 0, 1)
        return forces

    def _modal(self, parts, extra: np.ndarray, mesh_frequency: float, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """Side bands (S,) of the structure, and the coordinates (Q + 1, S, m) of its modes."""
        stage, orders, shape = self.stage, self.orders, self.stage.every_shape
        N, n = stage.paths.symmetry, stage.waves
        reach = int(orders.bands[-1]) + max(int(n[-1]), 0 if stage.ring is None else int(stage.ring.diameter.max()))
        every = np.arange(-reach, reach + 1)
        coordinates = np.zeros((orders.lines + 1, len(every), len(stage.natural_frequency)), complex)
        psi = np.asarray(stage.paths.planet_angles)[self.leaders]
        for part in parts:
            force = self._part_forces(part, extra)
            line = (orders.base[part.blocks] + orders.seed[part.blocks]) / orders.paths.z_ring
            number = {int(place): k for k, place in enumerate(part.bands)}
            for band in part.structure_bands:
                total = np.zeros((len(part.blocks), coordinates.shape[2]), complex)
                for w, place in enumerate(orders.place(band + stage.sense * n)):
                    if int(place) in number:
                        at = force[:, number[int(place)]] * np.exp(-1j * n[w] * psi)[:, None]
                        total += at.sum(axis=1) @ shape[:, w].conj()
                omega = line * mesh_frequency + band * speed
                omega[np.abs(omega) < _STILL * mesh_frequency] = 0.0
                coordinates[part.blocks % (orders.lines + 1), band + reach] -= N * stage.receptance(omega) * total
        return every, coordinates

    def _tail(self, force: np.ndarray) -> tuple[float, float]:
        """Shares of the mesh forces (G, M, B, R) in the upper half of the harmonics, and at the outer bands."""
        orders = self.orders
        energy = (np.abs(force) ** 2).sum(axis=(0, 1)).reshape(orders.patterns, -1, len(orders.bands)).sum(axis=0)
        energy[0, orders.middle] = 0.0
        whole = max(float(energy.sum()), np.finfo(float).tiny)
        upper, outer = energy[len(energy) // 2 + 1 :].sum(), energy[:, [0, -1]].sum() if len(orders.bands) > 1 else 0.0
        return float(np.sqrt(upper / whole)), float(np.sqrt(outer / whole))


def _consistent(system: np.ndarray, right: np.ndarray, points: int) -> np.ndarray:
    """Forces (points, k) of a system of the means, in which the whole may move: forces do not hang on that.

    Of the first ``points`` rows and columns are forces and approaches, of the others motions and balances.
    """
    diagonal = np.abs(np.diag(system))[:points]
    scale = np.ones(len(system))
    scale[:points] = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, diagonal.max(initial=0.0) or 1.0))
    effect = np.abs(system[points:, :points] * scale[:points]).max(axis=1, initial=0.0)
    scale[points:] = 1.0 / np.where(effect > 0.0, effect, 1.0)
    scaled = scale[:, None] * system * scale
    solution = np.linalg.lstsq(scaled, scale[:, None] * right, rcond=_SINGULAR)[0]
    return (scale[:, None] * solution)[:points]
