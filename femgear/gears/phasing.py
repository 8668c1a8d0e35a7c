"""Mesh phases of planets, what they make of the harmonics of the mesh frequency, and tooth numbers for them.

Planets stand at assembly positions, whole multiples m_n of ``2 pi / Z`` from the first, ``Z = z_s + z_r``, so
that every phase is a ratio of whole numbers and every sum over the planets is exact. The sums tell which
resultants the planets cancel, and which modes a harmonic can excite (`phasing_table`).

Two conventions for the phases gamma_j, in mesh periods; the force or error of mesh j in harmonic h has the
factor ``exp(2 pi i h gamma_j)``:

* ``"rotation"``: those of teeth that turn. A planet ahead of the first in the sense of the sun meets the same
  sun tooth later, a ring tooth earlier: ``-z_s psi_n / 2 pi`` and ``+z_r psi_n / 2 pi`` (R. G. Parker and
  J. Lin, J. Mech. Des. 126, 2004, 365-370). At assembly positions both are equal but for the lag of a planet.
* ``"printed"``: ``+z_s psi_n / 2 pi`` and ``+z_r psi_n / 2 pi``, Eq. (6) of A. Kahraman, J. Mech. Des. 116,
  1994, 713-720. What sun meshes excite then travels round the other way than what ring meshes excite.

`neighbouring_teeth` lists tooth numbers near wanted ones with their ratio, assembly, phasing, hunting teeth
and room between the planets.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from femgear.errors import GeometryError
from femgear.findings import percent
from femgear.gears.gear import TEETH_RANGE, is_whole
from femgear.gears.kinematics import sun_ratio
from femgear.gears.planetary import PlanetarySet, assembly_positions, check_angles, check_planets

CONVENTIONS = ("rotation", "printed")
KINDS = ("in-phase", "counter-phased", "sequentially phased", "unequally phased")
MODES = ("rotational", "translational", "planet")
ZERO = 1e-9
"""Share of the mesh forces below which a sum counts as cancelled."""


@dataclass(frozen=True)
class MeshPhasing:
    """Phases of the 2N meshes of a set.

    Parameters
    ----------
    sun_teeth, ring_teeth : int
        Numbers of teeth, both positive.
    positions : tuple of int
        m_n, assembly positions of the planets counted from the first.
    rotation : {1, -1}
        Sense of the sun against the carrier, 1 counter-clockwise.
    flank : {1, -1}
        Loaded flanks, 1 for those of a sun that drives counter-clockwise.
    convention : {"rotation", "printed"}
        Which of two conventions the phases follow, see the head of the module.
    lag : float
        Mesh periods from pitch-point contact of a planet with the sun to that with the ring, for a sun that
        drives counter-clockwise; `standard_lag` for unshifted teeth.

    Raises
    ------
    GeometryError
        Numbers that describe no set (E-RANGE).
    """

    sun_teeth: int
    ring_teeth: int
    positions: tuple[int, ...]
    rotation: int = 1
    flank: int = 1
    convention: str = "rotation"
    lag: float = 0.0

    def __post_init__(self):
        _check_phasing(self)
        object.__setattr__(self, "positions", tuple(int(m) for m in self.positions))

    @property
    def n_planets(self) -> int:
        """Number N of planets."""
        return len(self.positions)

    @property
    def teeth_sum(self) -> int:
        """Z, the number of assembly positions in one turn."""
        return self.sun_teeth + self.ring_teeth

    @property
    def planet_angles(self) -> np.ndarray:
        """psi_n - psi_1 [rad], (N,)."""
        return 2.0 * math.pi * np.array(self.positions) / self.teeth_sum

    @property
    def equally_spaced(self) -> bool:
        """Whether the planets stand ``2 pi / N`` apart."""
        return all(m * self.n_planets == n * self.teeth_sum for n, m in enumerate(self.positions))

    @property
    def turns(self) -> tuple[int, int]:
        """Mesh periods by which the phases of sun and ring meshes grow over one turn of psi."""
        sun = self.sun_teeth if self.convention == "printed" else -self.sun_teeth
        return self.rotation * sun, self.rotation * self.ring_teeth

    @property
    def phases(self) -> np.ndarray:
        """gamma_j in [0, 1), (2N,), sun meshes first; zero for "sun-planet 1".

        With the convention "rotation" those of `PlanetarySet.mesh_phases`. The ring mesh of a planet comes
        after its sun mesh by the lag: turning back runs through the same contacts in the opposite order, and
        the other flanks are the drive flanks of the mirror image, which turns the other way.
        """
        steps = np.mod(np.outer(self.turns, self.positions), self.teeth_sum)
        phase = steps / self.teeth_sum - np.array([[0.0], [self.rotation * self.flank * self.lag]])
        phase = np.mod(phase.ravel(), 1.0)
        return np.where(phase > 1.0 - 1e-12, 0.0, phase)


def mesh_phasing(
    sun_teeth: int,
    ring_teeth: int,
    planet_angles: Sequence[float],
    *,
    rotation: int = 1,
    flank: int = 1,
    convention: str = "rotation",
    lag: float = 0.0,
) -> MeshPhasing:
    """Find the phases of the meshes of planets at given angles psi_n (N,) [rad], ascending within one turn.

    The other arguments are those of `MeshPhasing`.

    Raises
    ------
    GeometryError
        Angles at which the planets do not assemble (E-ASSEMBLY, with the nearest that do), no angles
        (E-RANGE), or other numbers that describe no set (E-RANGE).
    """
    angles = tuple(float(angle) for angle in planet_angles)
    check_angles(angles)
    MeshPhasing(sun_teeth, ring_teeth, (0,), rotation, flank, convention, lag)
    positions = assembly_positions(sun_teeth, ring_teeth, angles)
    return MeshPhasing(sun_teeth, ring_teeth, positions, rotation, flank, convention, lag)


def phasing_of_set(planetary_set: PlanetarySet) -> MeshPhasing:
    """Find the phases of the meshes of a geared set, the lag of its planets from their tooth thickness."""
    s, phases = planetary_set, planetary_set.mesh_phases
    lag = float(np.mod(phases[0] - phases[s.n_planets], 1.0))
    return mesh_phasing(s.sun.teeth, s.ring.teeth, s.planet_angles, lag=lag)


def standard_lag(planet_teeth: int) -> float:
    """Compute the lag [mesh periods] of a planet whose teeth are half a pitch thick, 0 or 1/2.

    Its working flanks are ``z_p / 2 - 1 / 2`` pitches apart: an odd planet touches sun and ring at their
    pitch points at the same time, an even one half a period apart (Parker and Lin, 2004).

    Raises
    ------
    GeometryError
        No whole number of teeth that a gear can have (E-RANGE).
    """
    if not is_whole(planet_teeth) or not TEETH_RANGE[0] <= planet_teeth <= TEETH_RANGE[1]:
        limit = f"a whole number, {TEETH_RANGE[0]} to {TEETH_RANGE[1]}"
        raise GeometryError(f"the lag of a planet with {planet_teeth!r} teeth", code="E-RANGE", limit=limit)
    return 0.5 * ((planet_teeth - 1) % 2)


def phase_factors(phasing: MeshPhasing, harmonics) -> np.ndarray:
    """Compute the phase factors ``exp(2 pi i h gamma_j)`` (H, 2N) of the meshes in whole harmonics h (H,).

    Parameters
    ----------
    phasing : MeshPhasing
        Of the 2N meshes.
    harmonics : (H,) int array
        Multiples of the mesh frequency.

    Raises
    ------
    GeometryError
        Harmonics that are no whole numbers from 1 (E-HARMONICS).
    """
    return np.exp(2j * np.pi * np.outer(check_harmonics(harmonics), phasing.phases))


def planet_sums(turns, positions, teeth_sum, harmonics, orders) -> np.ndarray:
    """Compute means over the planets of ``exp(2 pi i h gamma_n) exp(i q psi_n)``, for one set or many.

    Order q = 0 adds up torques and thrusts, q = +-1 lateral forces and tilting moments (the two senses of
    their whirl), any q the motion ``exp(i q psi_n)`` of the planets. With equal spacing the mean is 1 where
    ``h turns + q`` is a multiple of N and 0 elsewhere (R. G. Parker, J. Sound Vib. 236, 2000, 561-573).

    From whole numbers: turns and teeth_sum (...) and positions (..., N) of `MeshPhasing`, harmonics (H,) and
    orders (Q,); (..., H, Q) complex.
    """
    turns, positions, teeth_sum = (np.asarray(a, np.int64) for a in (turns, positions, teeth_sum))
    rank = np.multiply.outer(turns, np.asarray(harmonics))[..., :, None] + np.asarray(orders)
    total = teeth_sum[..., None, None, None]
    # whole numbers first: a sum that vanishes does so to rounding at any harmonic
    steps = np.mod(rank[..., None] * positions[..., None, None, :], total)
    return np.exp(2j * np.pi * (steps / total)).mean(axis=-1)


def _phase_kinds(turns, positions, teeth_sum, harmonics) -> np.ndarray:
    """Phasing of every harmonic, (..., H) indices of `KINDS`; arguments as in `planet_sums`.

    In-phase: all planets alike. Counter-phased: each planet half a period from its neighbours. Sequentially
    phased: the same other step from every planet to the next. Unequally phased: anything else.
    """
    turns, positions, teeth_sum = (np.asarray(a, np.int64) for a in (turns, positions, teeth_sum))
    following = np.concatenate([positions[..., 1:], positions[..., :1] + teeth_sum[..., None]], axis=-1)
    total = teeth_sum[..., None, None]
    rank = np.multiply.outer(turns, np.asarray(harmonics))[..., None]
    steps = np.mod(rank * (following - positions)[..., None, :], total)
    alike = np.all(steps == steps[..., :1], axis=-1)
    half = np.all(2 * steps == total, axis=-1)
    return np.select([np.all(steps == 0, axis=-1), half, alike], [0, 1, 2], 3)


def cyclic_harmonic(phasing: MeshPhasing, harmonics) -> np.ndarray:
    """Find ``k = mod(h z_s, N)`` (H,) of equally spaced planets in harmonics h (H,); -1 for unequal spacing.

    The rule of Parker (2000): k = 0 rotational, k = 1 or N - 1 translational, other k planet modes only.
    """
    harmonics = check_harmonics(harmonics)
    if not phasing.equally_spaced:
        return np.full(len(harmonics), -1)
    return np.mod(harmonics * phasing.sun_teeth, phasing.n_planets)


@dataclass(frozen=True, eq=False)
class PhasingTable:
    """What a set makes of harmonics of the mesh frequency, when the mesh forces of all planets are equal.

    Parameters
    ----------
    harmonics : (H,) int array
        Multiples of the mesh frequency.
    kind : tuple of str
        One of `KINDS` for every harmonic, the same for sun and ring meshes.
    cyclic : (H,) int array
        k = mod(h z_s, N); -1 for unequally spaced planets.
    members : (H, 3, 4) array
        Torque, lateral force, thrust and tilting moment on sun, ring and carrier as shares of what they were
        if all planets acted alike and in the worst direction: 0 cancelled, 1 everything adds up.
    planets : (H, N, 5) array
        Torque, tangential and radial force, thrust and tilting moment of the two meshes of each planet, 0 to
        1, for equal forces in both meshes and equal pressure angles.
    modes : (H, 3) array
        How much of the phase pattern belongs to the kinds of `MODES`, 0 to 1.
    separate : bool
        Whether rotational and translational modes exist apart from each other, ``sum exp(i psi_n) = 0``.
    """

    harmonics: np.ndarray
    kind: tuple[str, ...]
    cyclic: np.ndarray
    members: np.ndarray
    planets: np.ndarray
    modes: np.ndarray
    separate: bool

    @property
    def excited(self) -> tuple[tuple[str, ...], ...]:
        """Kinds of modes that every harmonic can excite.

        Where rotational and translational modes do not exist apart they are named together.
        """
        excited = []
        for row in self.modes > ZERO:
            names = [name for name, on in zip(MODES, row) if on]
            if not self.separate and (row[0] or row[1]):
                names = ["rotational-translational"] + (["planet"] if row[2] else [])
            excited.append(tuple(names))
        return tuple(excited)


def phasing_table(phasing: MeshPhasing, harmonics: Sequence[int] = range(1, 7)) -> PhasingTable:
    """Tell which resultants cancel and which modes are excited in harmonics (H,) of the mesh frequency.

    The mesh forces of one harmonic act on sun and ring along directions that turn with psi_n, and at points
    that do. Torque and thrust are their plain sum (q = 0); lateral forces, and tilting moments of the axial
    forces, are sums with ``exp(+-i psi_n)``. The carrier takes the pin forces of the planets, the sum of both
    meshes, so that its resultant is sure to vanish where those of sun and ring both do. A. Kahraman (J. Mech.
    Des. 116, 1994, 713-720, Table 1) has the case of four equal planets, R. G. Parker (J. Sound Vib. 236,
    2000, 561-573) the sums for equal spacing.

    Raises
    ------
    GeometryError
        Harmonics that are no whole numbers from 1 (E-HARMONICS).
    """
    orders = check_harmonics(harmonics)
    turns, N = np.array(phasing.turns), phasing.n_planets
    positions = np.array([phasing.positions] * 2)
    total = np.full(2, phasing.teeth_sum)
    size = np.abs(planet_sums(turns, positions, total, orders, (0, 1, -1)).swapaxes(0, 1))
    plain, turning = size[..., 0], size[..., 1:].max(axis=-1)  # (H, 2)
    both = [np.column_stack([part, part.max(axis=1)]) for part in (plain, turning)]
    kinds = _phase_kinds(turns[0], positions[0], total[0], orders)
    return PhasingTable(
        harmonics=orders,
        kind=tuple(KINDS[k] for k in kinds),
        cyclic=cyclic_harmonic(phasing, orders),
        members=np.stack([both[0], both[1], both[0], both[1]], axis=-1),
        planets=_planet_resultants(phasing, orders),
        modes=_mode_shares(phase_factors(phasing, orders).reshape(-1, 2, N), phasing.planet_angles, size),
        separate=bool(abs(np.exp(1j * phasing.planet_angles).mean()) < ZERO),
    )


def check_harmonics(harmonics) -> np.ndarray:
    """Check harmonics (H,) of the mesh frequency: whole numbers from 1, others are refused (E-HARMONICS)."""
    checked = np.atleast_1d(np.asarray(harmonics))
    if checked.ndim != 1 or not len(checked) or checked.dtype.kind not in "iu" or checked.min() < 1:
        message = f"harmonics {harmonics!r} of the mesh frequency"
        raise GeometryError(message, code="E-HARMONICS", limit="whole numbers from 1")
    return checked.astype(np.int64)


def _planet_resultants(phasing: MeshPhasing, harmonics: np.ndarray) -> np.ndarray:
    """Sums and differences of the two meshes of each planet, (H, N, 5).

    Meshes of equal forces push the planet the same way along the carrier's circle and turn it opposite ways;
    a planet of one hand feels opposite thrusts from sun and ring, which tilt it.
    """
    between = (phasing.phases[phasing.n_planets :] - phasing.phases[: phasing.n_planets]) * np.pi
    sums, differences = (np.abs(f(np.outer(harmonics, between))) for f in (np.cos, np.sin))
    table = np.stack([differences, sums, differences, differences, sums], axis=-1)
    return np.where(table < ZERO, 0.0, table)


def _mode_shares(factors: np.ndarray, psi: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Shares (H, 3) of the phase pattern in 1, in ``exp(+-i psi_n)`` and in neither.

    In planet modes the central members rest, which asks of the planets' amplitudes w_n ``sum w_n = sum w_n
    exp(i psi_n) = 0``, at unequal spacing too (J. Lin and R. G. Parker, J. Sound Vib. 233, 2000, 921-928).
    """
    basis = np.exp(1j * np.outer((0, 1, -1), psi)).T
    left, value, _ = np.linalg.svd(basis, full_matrices=False)
    left = left[:, value > 1e-9 * value[0]]
    rest = factors - (factors @ left.conj()) @ left.T
    planet = np.linalg.norm(rest, axis=-1).max(axis=1) / math.sqrt(len(psi))
    shares = np.column_stack([size[..., 0].max(axis=1), size[..., 1:].max(axis=(1, 2)), planet])
    return np.where(shares < ZERO, 0.0, shares)


def _check_phasing(phasing: MeshPhasing) -> None:
    """Refuse numbers that describe no set (E-RANGE)."""
    p, problem = phasing, None
    whole = (*p.positions, p.sun_teeth, p.ring_teeth, p.rotation, p.flank)
    if not all(is_whole(value) for value in whole):
        problem = "teeth, positions, rotation and flank must be whole numbers"
    elif not all(TEETH_RANGE[0] <= z <= TEETH_RANGE[1] for z in (p.sun_teeth, p.ring_teeth)):
        problem = f"{p.sun_teeth} sun and {p.ring_teeth} ring teeth, allowed {TEETH_RANGE[0]} to {TEETH_RANGE[1]}"
    elif p.ring_teeth <= p.sun_teeth:
        problem = f"a ring of {p.ring_teeth} teeth around a sun of {p.sun_teeth}, allowed: more than the sun"
    elif not p.positions or p.positions[0] != 0 or np.any(np.diff([*p.positions, p.teeth_sum]) <= 0):
        problem = f"positions {p.positions}, which must ascend from 0 to less than {p.teeth_sum}"
    elif p.rotation not in (1, -1) or p.flank not in (1, -1):
        problem = f"rotation {p.rotation} and flank {p.flank}, allowed 1 or -1"
    elif p.convention not in CONVENTIONS:
        problem = f"the convention {p.convention!r}, allowed {' or '.join(CONVENTIONS)}"
    elif not math.isfinite(p.lag):
        problem = f"a lag of {p.lag!r} periods, allowed: a finite number"
    if problem:
        raise GeometryError(f"mesh phases of {problem}", code="E-RANGE", remedy="see MeshPhasing")


DISTANCE_LIMIT = 30
# Share of the centre distance that profile shifts cannot bridge, and overlap of tips [modules] that no
# shortened tooth removes.
_CLOSURE, _OVERLAP = 0.05, 1.0


@dataclass(frozen=True, eq=False)
class ToothChoices:
    """Sets of equal planets, nearest ratio first; C choices, N planets, H harmonics.

    Parameters
    ----------
    teeth : (C, 3) int array
        Sun, planet, ring.
    ratio, ratio_change : (C,) arrays
        ``1 + z_r / z_s``, sun over carrier with the ring held; relative change against the wanted teeth.
    closure : (C,) int array
        ``z_r - z_s - 2 z_p``; what is not zero is left to profile shifts.
    positions : (C, N) int array
        Assembly positions nearest to equal spacing, multiples of ``2 pi / (z_s + z_r)``.
    equally_spaced : (C,) bool array
        Whether ``(z_s + z_r) / N`` is whole.
    kind, cyclic : (C, H) int arrays
        Indices of `phasing.KINDS` for the harmonics 1 to H, and mod(h z_s, N), -1 for unequal spacing.
    sums : (C, H, 2) array
        Shares of the mesh forces that add up to torque (and thrust), and to lateral force (and tilting
        moment), 0 to 1.
    hunting : (C,) bool array
        Whether every tooth meets every tooth of the other gear in both meshes: no common divisors.
    room : (C,) array
        Between the tip circles of the two nearest planets [modules], negative where they overlap.
    """

    teeth: np.ndarray
    ratio: np.ndarray
    ratio_change: np.ndarray
    closure: np.ndarray
    positions: np.ndarray
    equally_spaced: np.ndarray
    kind: np.ndarray
    cyclic: np.ndarray
    sums: np.ndarray
    hunting: np.ndarray
    room: np.ndarray

    def __len__(self) -> int:
        return len(self.teeth)

    @property
    def spacing_error(self) -> np.ndarray:
        """Largest angle [rad] by which a planet misses equal spacing, (C,)."""
        equal = np.arange(self.positions.shape[1]) / self.positions.shape[1]
        turns = self.positions / (self.teeth[:, 0] + self.teeth[:, 2])[:, None]
        return 2.0 * math.pi * np.abs(turns - equal).max(axis=1)

    @property
    def kind_names(self) -> np.ndarray:
        """Names of the phasing, (C, H)."""
        return np.array(KINDS)[self.kind]

    def only(self, chosen) -> ToothChoices:
        """Take the choices of a mask (C,) or of indices, in their order."""
        return ToothChoices(**{field.name: getattr(self, field.name)[chosen] for field in fields(self)})


def neighbouring_teeth(
    sun_teeth: int,
    planet_teeth: int,
    ring_teeth: int,
    planets: int,
    *,
    distance: int = 3,
    ratio_tolerance: float = 0.03,
    closure: int = 1,
    harmonics: int = 4,
    fitting: bool = True,
) -> ToothChoices:
    """Find all tooth numbers within a distance of the wanted ones, the wanted ones among them.

    Conditions of assembly, coaxial gears and neighbouring planets: H. W. Mueller, Epicyclic Drive Trains
    (Wayne State University Press, 1982). Unshifted teeth are taken for the room between planets, at the
    smaller of the reference centre distances of both meshes.

    Parameters
    ----------
    sun_teeth, planet_teeth, ring_teeth, planets : int
        Wanted numbers of teeth, all positive, and number of planets.
    distance : int
        Largest change of each tooth number, up to 30.
    ratio_tolerance : float
        Largest relative change of ``1 + z_r / z_s``.
    closure : int
        Largest ``|z_r - z_s - 2 z_p|``; each tooth asks for about half a module of profile shift.
    harmonics : int
        H, number of harmonics of the mesh frequency that are compared.
    fitting : bool
        Leaves out sets whose neighbouring planets overlap.

    Raises
    ------
    GeometryError
        Numbers out of range (E-CHOICE, E-RANGE).
    """
    check_planets(planets)
    wanted = (sun_teeth, planet_teeth, ring_teeth)
    _check(wanted, distance, ratio_tolerance, closure, harmonics)
    steps = np.arange(-distance, distance + 1)
    teeth = np.stack(np.meshgrid(*(z + steps for z in wanted), indexing="ij"), axis=-1).reshape(-1, 3)
    misfit = teeth[:, 2] - teeth[:, 0] - 2 * teeth[:, 1]
    teeth = teeth[(np.abs(misfit) <= closure) & np.all(teeth >= TEETH_RANGE[0], axis=1)]
    ratio = sun_ratio(teeth[:, 0], teeth[:, 2])
    change = ratio / sun_ratio(sun_teeth, ring_teeth) - 1.0
    near = np.abs(change) <= ratio_tolerance + 1e-12
    teeth, ratio, change = teeth[near], ratio[near], change[near]
    order = np.lexsort((*teeth.T[::-1], np.abs(teeth - wanted).sum(axis=1), np.round(np.abs(change), 12)))
    phasing = _described(teeth[order], ratio[order], change[order], planets, np.arange(1, harmonics + 1))
    return phasing.only(phasing.room > 0.0) if fitting else phasing


def coaxial_teeth(sun_teeth: int, planet_teeth: int, ring_teeth: int, planets: int) -> list[tuple[int, int, int]]:
    """Find tooth numbers next to those wanted whose unshifted gears have one centre distance and assemble.

    Unshifted gears of one module close where ``z_r = z_s + 2 z_p``; N equally spaced planets assemble where N divides
    ``z_s + z_r``, and have room where their tips stay apart (H. W. Mueller, as in `neighbouring_teeth`).

    Parameters
    ----------
    sun_teeth, planet_teeth, ring_teeth, planets : int
        Wanted numbers of teeth, all positive, and number of planets.

    Returns
    -------
    list of (int, int, int)
        Teeth of sun, planet and ring: those that change the fewest gears first, then those with the fewest changes.
    """
    wanted = np.array([sun_teeth, planet_teeth, ring_teeth])
    steps = np.arange(-3, 4)
    closing_planet = (ring_teeth - sun_teeth) // 2
    tried_planets = np.unique(np.concatenate([planet_teeth + steps, closing_planet + steps]))
    sun, planet = (numbers.ravel() for numbers in np.meshgrid(sun_teeth + steps, tried_planets, indexing="ij"))
    teeth = np.stack([sun, planet, sun + 2 * planet], axis=-1)
    total = teeth[:, 0] + teeth[:, 2]
    teeth = teeth[(total % planets == 0) & np.all((teeth >= TEETH_RANGE[0]) & (teeth <= TEETH_RANGE[1]), axis=1)]
    total = teeth[:, 0] + teeth[:, 2]
    positions = np.arange(planets) * (total // planets)[:, None]
    teeth = teeth[_room(teeth, positions, total) > 0.0]
    changes = np.abs(teeth - wanted)
    order = np.lexsort((changes.sum(axis=1), np.count_nonzero(changes, axis=1)))
    return [(int(z_s), int(z_p), int(z_r)) for z_s, z_p, z_r in teeth[order]]


def check_teeth(phasing: MeshPhasing, planet_teeth: int) -> tuple[str, ...]:
    """Check the tooth numbers of a set, and remark on those that profile shifts must help to one.

    The phasing has the teeth of sun and ring and the positions of the planets. The remarks are words: the
    shifts that are needed, tips of unshifted planets that overlap [modules].

    Raises
    ------
    GeometryError
        Centre distances of both meshes that profile shifts cannot make equal (E-CHOICE), planets that
        overlap (E-NEIGHBOURS).
    """
    standard_lag(planet_teeth)
    sun, ring, problems = phasing.sun_teeth, phasing.ring_teeth, []
    teeth, misfit = f"{sun}/{planet_teeth}/{ring}", ring - sun - 2 * planet_teeth
    if abs(misfit) > _CLOSURE * (sun + planet_teeth):
        message = f"{teeth}: z_r - z_s - 2 z_p = {misfit}, more than profile shifts can take up"
        limit, remedy = f"{percent(_CLOSURE)} of z_s + z_p", f"{(ring - sun) // 2} teeth close this set"
        raise GeometryError(message, code="E-CHOICE", key="planet teeth", limit=limit, remedy=remedy)
    if abs(misfit) > 1:
        problems.append(f"z_r - z_s - 2 z_p = {misfit}: profile shifts of about {abs(misfit) / 2:g} times the module")
    places = np.array([phasing.positions])
    room = float(_room(np.array([[sun, planet_teeth, ring]]), places, np.array([sun + ring]))[0])
    if room < -_OVERLAP:
        message = f"{phasing.n_planets} planets of {teeth} overlap by {-room:.4g} modules"
        remedy = "use fewer planets, or fewer teeth on the planets"
        raise GeometryError(message, code="E-NEIGHBOURS", remedy=remedy)
    if room <= 0.0:
        problems.append(f"unshifted planets overlap by {-room:.3g} modules")
    return tuple(problems)


def _described(teeth, ratio, change, planets: int, harmonics) -> ToothChoices:
    """What `ToothChoices` tells of some teeth (C, 3) and their ratios (C,)."""
    sun, planet, ring = teeth.T
    total = sun + ring
    n = np.arange(planets)
    # the assembly position nearest to n / N of a turn
    positions = (2 * n * total[:, None] + planets) // (2 * planets)
    even = total % planets == 0
    sums = np.abs(planet_sums(-sun, positions, total, harmonics, (0, 1, -1)))
    cyclic = np.mod(np.outer(sun, harmonics), planets)
    return ToothChoices(
        teeth=teeth,
        ratio=ratio,
        ratio_change=change,
        closure=ring - sun - 2 * planet,
        positions=positions,
        equally_spaced=even,
        kind=_phase_kinds(-sun, positions, total, harmonics),
        cyclic=np.where(even[:, None], cyclic, -1),
        sums=np.stack([sums[..., 0], sums[..., 1:].max(axis=-1)], axis=-1),
        hunting=(np.gcd(sun, planet) == 1) & (np.gcd(planet, ring) == 1),
        room=_room(teeth, positions, total),
    )


def _room(teeth, positions, total) -> np.ndarray:
    """Between the tip circles of unshifted neighbouring planets [modules]; infinite for one planet."""
    sun, planet, ring = teeth.T
    if positions.shape[1] == 1:
        return np.full(len(teeth), math.inf)
    around = np.concatenate([positions, total[:, None]], axis=1)
    # beyond half a turn the planets stand nearer on the other side
    gap = np.diff(around, axis=1).min(axis=1) * 2.0 * math.pi / total
    distance = 0.5 * np.minimum(sun + planet, ring - planet)
    return 2.0 * distance * np.sin(0.5 * np.minimum(gap, math.pi)) - (planet + 2)


def _check(wanted, distance, ratio_tolerance, closure, harmonics) -> None:
    """Refuse arguments of `neighbouring_teeth` that are out of range (E-CHOICE)."""
    numbers = {"distance": (distance, 0, DISTANCE_LIMIT), "closure": (closure, 0, 10)}
    numbers["harmonics"] = (harmonics, 1, 100)
    numbers |= {f"{name} teeth": (z, *TEETH_RANGE) for name, z in zip(("sun", "planet", "ring"), wanted)}
    for name, (value, least, most) in numbers.items():
        if not is_whole(value) or not least <= value <= most:
            message = f"neighbouring tooth numbers with {name} {value!r}"
            limit = f"a whole number, {least} to {most}"
            raise GeometryError(message, code="E-CHOICE", key=name, limit=limit)
    if not (math.isfinite(ratio_tolerance) and ratio_tolerance >= 0.0):
        raise GeometryError(f"a ratio tolerance of {ratio_tolerance}", code="E-CHOICE", limit=">= 0")
    if wanted[2] <= wanted[1]:
        message = f"a ring of {wanted[2]} teeth around planets of {wanted[1]}"
        raise GeometryError(message, code="E-CHOICE", limit="more ring than planet teeth")
