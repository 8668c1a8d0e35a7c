"""What kind of mode a shape of the planetary set is, its phasing and its number of nodal diameters.

With equal planets at equal angles the modes fall into classes of the cyclic group of order N (J. Lin and
R. G. Parker, J. Vib. Acoust. 121, 1999, for the rigid ring): rotational (class 0), translational (class +-1)
and planet modes (the other classes). The ring's nodal diameters n belong to class n mod N. One classification
serves all models: they bring their shapes into `SetMotions`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.system.mesh_directions import free_motions
from femgear.system.rigid_bodies import RigidSet, body_masses

_PURE = 0.99
_CLASSES = ("rotational", "translational", "planet")
_CENTRAL = ("carrier", "ring", "sun", "motor", "brake")
# motions of a central member that turn into each other with the frame, the third one alone
_PLANES = ((0, 1, 5), (3, 4, 2))
_IN_SPACE = {"rotational": "rotational-axial", "translational": "translational-tilting"}


@dataclass(frozen=True)
class SetMotions:
    """Motions of the bodies in every mode; coordinates that are held are zero.

    Parameters
    ----------
    central : (b, 3, m) array
        x, y and rotation of the bodies on the axis, in the units of the shapes.
    central_mass : (b, 3) array
        [kg, kg m^2]
    planets : (N, 3, m) array
        Radial, tangential and rotation, or all motions (N, axes, m).
    planet_mass : (N, 3) array
        [kg, kg m^2]
    planet_angles : (N,) array
        [rad]
    """

    central: np.ndarray
    central_mass: np.ndarray
    planets: np.ndarray
    planet_mass: np.ndarray
    planet_angles: np.ndarray

    @property
    def weighted(self) -> np.ndarray:
        """Planet motions whose squares are twice the kinetic energy, (N, 3, m)."""
        return np.sqrt(self.planet_mass)[:, :, None] * self.planets

    @property
    def energy(self) -> np.ndarray:
        """Twice the kinetic energy (m,) of all bodies, without units of time."""
        central = np.einsum("ba,bam->m", self.central_mass, np.abs(self.central) ** 2)
        return central + (np.abs(self.weighted) ** 2).sum(axis=(0, 1))


def mode_kinds(shape, mass, dofs, *, frequency, ring_diameter, ring_slice, planet_angles):
    """Find the kind and the nodal diameter of every mode by its kinetic energy.

    Parameters
    ----------
    shape : (n, m) array
        Mode shapes.
    mass : (n,) array
        Diagonal mass matrix [kg, kg m^2].
    frequency : (m,) array
        [Hz], zero for rigid-body modes.
    ring_diameter : (n_ring,) int array
        Nodal diameter of every ring coordinate.
    ring_slice : slice
        Of the ring's n_ring coordinates.
    planet_angles : (N,) array
        [rad].

    Returns
    -------
    kinds : tuple of str
        ``rigid``, ``rotational``, ``translational``, ``planet``; ``ring, ...`` where the ring holds more than
        half of the kinetic energy; ``mixed`` where no class holds 99 % of it.
    nodal_diameter : (m,) int array
        The one with most of the ring's kinetic energy; -1 where the ring holds less than a thousandth.
    """
    energy = mass[:, None] * np.abs(np.asarray(shape)) ** 2
    total = energy.sum(axis=0)
    ring = energy[ring_slice]
    share = np.zeros((int(ring_diameter.max()) + 1, energy.shape[1]))
    np.add.at(share, ring_diameter, ring)
    classes = class_energies(set_motions(shape, mass, dofs, planet_angles))
    N = len(planet_angles)
    for n in range(len(share)):
        classes[min(n % N, N - n % N, 2)] += share[n]
    held = ring.sum(axis=0) > 0.5 * total
    kinds = [
        f"ring, {kind}" if on_ring and kind != "rigid" else kind
        for kind, on_ring in zip(named_kinds(classes / total, frequency), held)
    ]
    moves = share.sum(axis=0) > 1e-3 * total
    return tuple(kinds), np.where(moves, share.argmax(axis=0), -1)


def set_motions(shape, mass, dofs: Sequence[str], planet_angles) -> SetMotions:
    """Collect the motions of the bodies by the names of their coordinates, from shapes (n, m).

    Masses (n,) are the diagonal [kg, kg m^2], planet angles (N,) [rad]. Names are ``"sun: x"``,
    ``"carrier: rotation"`` or ``"ring: u"``, ``"planet 1: x"`` or ``"planet 1: radial"``; other names and
    names that are missing do not count.
    """
    shape, place = np.asarray(shape), {name: i for i, name in enumerate(dofs)}
    planet_angles = np.asarray(planet_angles, float)

    def rows(bodies, *axes):
        dof = [[next((place[k] for a in axis if (k := f"{b}: {a}") in place), -1) for axis in axes] for b in bodies]
        dof = np.array(dof)
        there = dof >= 0
        return np.where(there[..., None], shape[dof], 0.0), np.where(there, np.asarray(mass)[dof], 0.0)

    planets = [f"planet {n + 1}" for n in range(len(planet_angles))]
    turn = ("rotation", "u")
    central, central_mass = rows(_CENTRAL, ("x",), ("y",), turn)
    if f"{planets[0]}: x" in place:
        moved, planet_mass = rows(planets, ("x",), ("y",), turn)
        c, s = np.cos(planet_angles)[:, None], np.sin(planet_angles)[:, None]
        x, y = moved[:, 0], moved[:, 1]
        moved = np.stack([c * x + s * y, c * y - s * x, moved[:, 2]], axis=1)
    else:
        moved, planet_mass = rows(planets, ("radial",), ("tangential",), turn)
    return SetMotions(central, central_mass, moved, planet_mass, planet_angles)


def class_energies(motions: SetMotions) -> np.ndarray:
    """Compute twice the kinetic energy (3, m) of rotational, translational and planet motion.

    Masses times squared motions, without units of time. Lin and Parker (1999, section 4) for equal spacing:
    in a rotational mode the central members only turn and all planets move alike; in a translational one they
    only translate, and the motion of planet n is ``p cos psi_n + p' sin psi_n``; in a planet mode they rest,
    and the planets' motion is free of both patterns. The same patterns are looked for at unequal spacing,
    where they are not independent: the classes then need not add up to the whole, and a motion that no class
    explains reaches 99 % of it in none.
    """
    energy = motions.central_mass[:, :, None] * np.abs(motions.central) ** 2
    psi, weighted = motions.planet_angles, motions.weighted
    alike, waves = _harmonic(psi, 0), _harmonic(psi, 1)
    rotational = energy[:, 2].sum(axis=0) + _inside(alike, weighted)
    translational = energy[:, :2].sum(axis=(0, 1)) + _inside(waves, weighted)
    both = _orthonormal(np.column_stack([alike, waves]))
    planet = (np.abs(weighted) ** 2).sum(axis=(0, 1)) - _inside(both, weighted)
    return np.array([rotational, translational, planet])


def phase_shares(motions: SetMotions) -> np.ndarray:
    """Compute the shares of the cyclic harmonics in the planets' kinetic energy, 0 to 1.

    Returns
    -------
    (N // 2 + 1, m) array
        Harmonic 0: all planets in phase; j (with N - j): neighbours apart by the phase ``2 pi j / N``; N / 2:
        neighbours in counter-phase. At equal spacing this is the discrete Fourier transform of the local
        planet motions, and the shares add up to one. At unequal spacing the share of j is what the patterns
        ``cos j psi_n`` and ``sin j psi_n`` explain; these overlap, so that the shares can add up to more than
        one. NaN where the planets rest.
    """
    weighted, N = motions.weighted, len(motions.planet_angles)
    total = (np.abs(weighted) ** 2).sum(axis=(0, 1))
    energy = np.array([_inside(_harmonic(motions.planet_angles, j), weighted) for j in range(N // 2 + 1)])
    moves = total > 1e-12 * motions.energy
    return np.where(moves, energy / np.where(moves, total, 1.0), np.nan)


def phasing(motions: SetMotions) -> tuple[str, ...]:
    """Name the phasing of the planets in every mode (m,).

    A. Kahraman (J. Mech. Des. 116, 1994, 713-720): ``in phase``, ``sequentially phased j`` and
    ``counter-phased`` where one harmonic of `phase_shares` holds 99 % and no other more than 1 %; ``mixed``
    else, as for modes of unequally spaced planets; ``at rest``.
    """
    share, N = phase_shares(motions), len(motions.planet_angles)
    names = ["in phase", *(f"sequentially phased {j}" for j in range(1, N // 2 + 1))]
    if N % 2 == 0:
        names[-1] = "counter-phased"
    kinds = []
    for shares in share.T:
        if np.isnan(shares[0]):
            kinds.append("at rest")
            continue
        best = int(shares.argmax())
        pure = shares[best] >= _PURE and np.all(np.delete(shares, best) <= 1.0 - _PURE)
        kinds.append(names[best] if pure else "mixed")
    return tuple(kinds)


def mixture(frequency, energy: Callable[[np.ndarray], np.ndarray], *, tolerance: float = 1e-7) -> np.ndarray:
    """Find the orthogonal matrix Q (m, m) that parts the modes ``shape @ Q`` of each frequency [Hz].

    Modes of one frequency, to a relative tolerance, may be mixed at will: Q diagonalises the symmetric matrix
    (k, k) that ``energy`` gives of the numbers (k,) of such modes.
    """
    frequency = np.asarray(frequency, float)
    Q = np.eye(len(frequency))
    starts = np.flatnonzero(np.diff(frequency) > tolerance * frequency[1:]) + 1
    for group in np.split(np.arange(len(frequency)), starts):
        # a single mode stays as it is, sign included
        if len(group) > 1:
            share, mixed = np.linalg.eigh(energy(group))
            # shares of the energy that differ by rounding are equal
            Q[np.ix_(group, group)] = fixed_basis(np.round(share, 9), mixed)
    return Q


def fixed_basis(values, vectors, *, tolerance: float = 1e-8) -> np.ndarray:
    """Turn eigenvectors (n, m), orthonormal, so that every machine finds the same ones.

    A library chooses the sign of an eigenvector, and those of a multiple eigenvalue at will within their
    space. Here the coordinate with the most motion in that space, of those equal to a millionth the first,
    moves in its first vector alone, and is positive there; the next vectors follow likewise from what is
    left: QR with row pivoting (G. Golub and C. Van Loan, Matrix Computations, 4th ed., section 5.4.2).
    Ascending ``values`` (m,) are equal that differ by less than the relative tolerance.
    """
    values, fixed = np.asarray(values), np.array(vectors)
    starts = np.flatnonzero(np.diff(values) > tolerance * np.abs(values[1:])) + 1
    for group in np.split(np.arange(len(values)), starts):
        for first in group:
            rest = fixed[:, first : group[-1] + 1]
            size = np.linalg.norm(rest, axis=1)
            row = rest[np.argmax(size >= (1.0 - 1e-6) * size.max())]
            mirror = row + np.copysign(np.linalg.norm(row), row[0]) * np.eye(len(row))[0]
            turned = rest - np.outer(rest @ mirror, 2.0 / (mirror @ mirror) * mirror)
            fixed[:, first : group[-1] + 1] = -np.copysign(1.0, row[0]) * turned
    return fixed


def phase_basis(motions: SetMotions, frequency, *, tolerance: float = 1e-7) -> np.ndarray:
    """Find the orthogonal matrix Q (m, m) that gives modes ``shape @ Q`` one phasing each, where it can.

    With six planets and more the planet modes of several harmonics coincide on a rigid ring. Within each
    frequency [Hz] the `mixture` is that of ``sum_j j E_j``, E_j the planets' energy in harmonic j, of motions
    of real mass-normalised shapes: harmonics come apart where they are independent, as at equal spacing.
    """
    weighted = motions.weighted

    def energy(group: np.ndarray) -> np.ndarray:
        total = np.zeros((len(group),) * 2)
        for j in range(1, len(motions.planet_angles) // 2 + 1):
            pattern = _harmonic(motions.planet_angles, j)
            part = np.einsum("nk,nam->kam", pattern, weighted[:, :, group]).reshape(-1, len(group))
            total += j * part.T @ part
        return total

    return mixture(frequency, energy, tolerance=tolerance)


def named_kinds(share, frequency) -> tuple[str, ...]:
    """Name modes ``rigid``, by the class with at least 99 % of the kinetic energy, or ``mixed``.

    From the `class_energies` over the whole kinetic energy (3, m), and frequencies (m,), zero if rigid [Hz].
    """
    best, most = share.argmax(axis=0), share.max(axis=0)
    return tuple(
        "rigid" if f == 0.0 else _CLASSES[i] if value >= _PURE else "mixed"
        for f, i, value in zip(np.asarray(frequency), best, most)
    )


def _harmonic(planet_angles: np.ndarray, j: int) -> np.ndarray:
    """Orthonormal basis of the patterns ``cos j psi_n`` and ``sin j psi_n`` over the planets."""
    return _orthonormal(np.column_stack([np.cos(j * planet_angles), np.sin(j * planet_angles)]))


def _orthonormal(patterns: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the patterns; two opposite planets know one wave only."""
    left, size, _ = np.linalg.svd(patterns, full_matrices=False)
    return left[:, size > 1e-9 * size[0]]


def _inside(pattern: np.ndarray, weighted: np.ndarray) -> np.ndarray:
    """Energy (m,) of the part of the planets' motion that lies in the patterns."""
    return (np.abs(np.einsum("nk,nam->kam", pattern, weighted)) ** 2).sum(axis=(0, 1))


def class_shares(data: RigidSet, shape) -> np.ndarray:
    """Compute the shares (3, m) of rotational, translational and planet motion in the kinetic energy.

    ``shape`` (n, m) is in the coordinates of `gear_set_system`. In space rotational-axial,
    translational-tilting and planet motion; see `class_energies`, also for unequal spacing.
    """
    motions = gear_set_motions(data, shape)
    return class_energies(motions) / motions.energy


def gear_set_motions(data: RigidSet, shape) -> SetMotions:
    """Collect the motions of all bodies in every mode, held ones and planets tied to pins included.

    Shapes (n, m) are in the coordinates of `gear_set_system`, others are refused (CaseError, E-SHAPE). The
    central members of bodies that move in space stand twice: x, y and rotation, then tilt about x, tilt about
    y and z, which turn with the frame as those do. Planets have all their motions.
    """
    shape, T, axes = np.asarray(shape), free_motions(data), data.axes
    if shape.ndim != 2 or len(shape) != T.shape[1]:
        raise CaseError(f"mode shapes of shape {shape.shape}", code="E-SHAPE", limit=f"({T.shape[1]}, modes)")
    full, mass = (T @ shape).reshape(data.n_planets + 3, len(axes), -1), body_masses(data)
    planes = [[axes.index(axis) for axis in plane] for plane in _PLANES if set(plane) <= set(axes)]
    central = np.concatenate([full[:3, plane] for plane in planes])
    central_mass = np.concatenate([mass[:3, plane] for plane in planes])
    return SetMotions(central, central_mass, full[3:], mass[3:], data.angles)


def gear_set_kinds(data: RigidSet, shape, *, frequency) -> tuple[str, ...]:
    """Find the kind of every mode from its shape.

    T. Eritenel and R. G. Parker (J. Sound Vib. 325, 2009, 397-420) for bodies that move in space, equal
    planets at equal angles: in a rotational-axial mode the central members rotate and move along z, and all
    planets move alike; in a translational-tilting mode they move and tilt in the plane; in a planet mode they
    rest. With four planets these are the modes that Kahraman (1994) calls in-phase, sequentially phased and
    counter-phased; the phasing itself comes from `phasing` of `gear_set_motions`.

    CaseError: shapes of another system (E-SHAPE).

    Parameters
    ----------
    shape : (n, m) array
        In the coordinates of `gear_set_system`.
    frequency : (m,) array
        [Hz], zero for rigid-body modes.

    Returns
    -------
    tuple of str
        ``rigid``; ``rotational``, ``translational`` or ``planet``, in space ``rotational-axial``,
        ``translational-tilting`` or ``planet``, where at least 99 % of the kinetic energy belongs to that
        class; else ``mixed``, as for most modes of unequally spaced planets.
    """
    kinds = named_kinds(class_shares(data, shape), frequency)
    return tuple(_IN_SPACE.get(kind, kind) for kind in kinds) if len(data.axes) > 3 else kinds
