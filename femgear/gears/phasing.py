"""Mesh phases of planets and what they make of the harmonics of the mesh frequency.

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
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import TEETH_RANGE, is_whole
from femgear.gears.planetary import PlanetarySet, assembly_positions, check_angles

CONVENTIONS = ("rotation", "printed")
KINDS = ("in-phase", "counter-phased", "sequentially phased", "unequally phased")
MEMBERS = ("sun", "ring", "carrier")
RESULTANTS = ("torque", "lateral force", "thrust", "tilting moment")
PLANET_RESULTANTS = ("torque", "tangential force", "radial force", "thrust", "tilting moment")
MODES = ("rotational", "translational", "planet")
ZERO = 1e-9
"""Share of the mesh forces below which a sum counts as cancelled."""


@dataclass(frozen=True)
class MeshPhasing:
    """Phases of the 2N meshes of a set.

    Parameters
    ----------
    sun_teeth, ring_teeth : int
    positions : tuple of int
        m_n, assembly positions of the planets counted from the first.
    rotation : {1, -1}
        Sense of the sun against the carrier, 1 counter-clockwise.
    flank : {1, -1}
        Loaded flanks, 1 for those of a sun that drives counter-clockwise.
    convention : {"rotation", "printed"}
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
        """N"""
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
        return all(m * self.n_planets == n * self.teeth_sum for n, m in enumerate(self.positions))

    @property
    def turns(self) -> tuple[int, int]:
        """Mesh periods by which the phases of sun and ring meshes grow over one turn of psi."""
        sun = self.sun_teeth if self.convention == "printed" else -self.sun_teeth
        return self.rotation * sun, self.rotation * self.ring_teeth

    @property
    def ring_lag(self) -> float:
        """Periods by which the ring mesh of a planet comes after its sun mesh; the sense and the flank count.

        Turning back runs through the same contacts in the opposite order; the other flanks are the drive
        flanks of the mirror image, which turns the other way.
        """
        return self.rotation * self.flank * self.lag

    @property
    def phases(self) -> np.ndarray:
        """gamma_j in [0, 1), (2N,), sun meshes first; zero for "sun-planet 1".

        With the convention "rotation" those of `PlanetarySet.mesh_phases`.
        """
        steps = np.mod(np.outer(self.turns, self.positions), self.teeth_sum)
        phase = steps / self.teeth_sum - np.array([[0.0], [self.ring_lag]])
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
    """Find the phases of planets at given angles.

    Parameters
    ----------
    planet_angles : (N,) sequence of float
        psi_n [rad], ascending within one turn.
    sun_teeth, ring_teeth, rotation, flank, convention, lag
        See `MeshPhasing`.

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


def phasing_of_set(
    planetary_set: PlanetarySet, *, rotation: int = 1, flank: int = 1, convention: str = "rotation"
) -> MeshPhasing:
    """Find the phases of a geared set, the lag of its planets from the real thickness of their teeth.

    ``rotation``, ``flank`` and ``convention`` are those of `MeshPhasing`.
    """
    s, phases = planetary_set, planetary_set.mesh_phases
    options = {"rotation": rotation, "flank": flank, "convention": convention}
    lag = float(np.mod(phases[0] - phases[s.n_planets], 1.0))
    return mesh_phasing(s.sun.teeth, s.ring.teeth, s.planet_angles, lag=lag, **options)


def standard_lag(planet_teeth: int) -> float:
    """Lag of a planet whose teeth are half a pitch thick, in [0, 1).

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
    """``exp(2 pi i h gamma_j)``, (H, 2N), for whole harmonics h."""
    return np.exp(2j * np.pi * np.outer(check_harmonics(harmonics), phasing.phases))


def planet_sums(turns, positions, teeth_sum, harmonics, orders) -> np.ndarray:
    """Compute means over the planets of ``exp(2 pi i h gamma_n) exp(i q psi_n)``, for one set or many.

    Order q = 0 adds up torques and thrusts, q = +-1 lateral forces and tilting moments (the two senses of
    their whirl), any q the motion ``exp(i q psi_n)`` of the planets. With equal spacing the mean is 1 where
    ``h turns + q`` is a multiple of N and 0 elsewhere (R. G. Parker, J. Sound Vib. 236, 2000, 561-573).

    Parameters
    ----------
    turns, teeth_sum : (...) int arrays
        Periods by which the phase grows over one turn, and Z; see `MeshPhasing`.
    positions : (..., N) int array
    harmonics, orders : (H,), (Q,) int arrays

    Returns
    -------
    (..., H, Q) complex array
    """
    turns, positions, teeth_sum = (np.asarray(a, np.int64) for a in (turns, positions, teeth_sum))
    rank = np.multiply.outer(turns, np.asarray(harmonics))[..., :, None] + np.asarray(orders)
    total = teeth_sum[..., None, None, None]
    # whole numbers first: a sum that vanishes does so to rounding at any harmonic
    steps = np.mod(rank[..., None] * positions[..., None, None, :], total)
    return np.exp(2j * np.pi * (steps / total)).mean(axis=-1)


def phase_kinds(turns, positions, teeth_sum, harmonics) -> np.ndarray:
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
    """``k = mod(h z_s, N)`` of equally spaced planets, (H,) int; -1 for unequal spacing.

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
    kind : tuple of str
        One of `KINDS` for every harmonic, the same for sun and ring meshes.
    cyclic : (H,) int array
        k = mod(h z_s, N); -1 for unequally spaced planets.
    members : (H, 3, 4) array
        Resultants on `MEMBERS` by `RESULTANTS` as shares of what they were if all planets acted alike and in
        the worst direction: 0 cancelled, 1 everything adds up.
    planets : (H, N, 5) array
        Resultants of the two meshes of each planet by `PLANET_RESULTANTS`, 0 to 1, for equal forces in both
        meshes and equal pressure angles.
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
    def cancelled(self) -> np.ndarray:
        """Whether a resultant vanishes on sun, ring, carrier, (H, 3, 4) bool."""
        return self.members < ZERO

    @property
    def excited(self) -> tuple[tuple[str, ...], ...]:
        """Kinds of modes that every harmonic can excite.

        Where rotational and translational modes do not exist apart they are named together.
        """
        found = []
        for row in self.modes > ZERO:
            names = [name for name, on in zip(MODES, row) if on]
            if not self.separate and (row[0] or row[1]):
                names = ["rotational-translational"] + (["planet"] if row[2] else [])
            found.append(tuple(names))
        return tuple(found)


def phasing_table(phasing: MeshPhasing, harmonics: Sequence[int] = range(1, 7)) -> PhasingTable:
    """Cancellation of resultants and excitation of modes for harmonics of the mesh frequency.

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
    kinds = phase_kinds(turns[0], positions[0], total[0], orders)
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
    """Harmonics as whole numbers from 1, (H,); refuses others (E-HARMONICS)."""
    found = np.atleast_1d(np.asarray(harmonics))
    if found.ndim != 1 or not len(found) or found.dtype.kind not in "iu" or found.min() < 1:
        message = f"harmonics {harmonics!r} of the mesh frequency"
        raise GeometryError(message, code="E-HARMONICS", limit="whole numbers from 1")
    return found.astype(np.int64)


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
        problem = (
            f"{p.sun_teeth} sun and {p.ring_teeth} ring teeth, allowed {TEETH_RANGE[0]} to {TEETH_RANGE[1]}"
        )
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
