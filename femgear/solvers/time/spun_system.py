"""A system of gear meshes whose phases and directions go on with one rotation, as integration in time takes it.

Its coordinates are deviations from a large common rotation, the rigid-body rotation, which torques change. Flanks of
meshes and the springs beside them are contacts: their forces are ``k (x - gap)`` along their approach x, of those that
part ``max(., 0)``. Stiffness and gap follow the phase of the mesh, the directions the angles of the carriers. Laws are
elements beside them whose forces depend on the motion alone, as those of bearings with play.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import linalg

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.system.force_laws import Element, GearMeshes
from femgear.system.fourier import FourierSeries
from femgear.system.system import MechanicalSystem
from femgear.system.turning_meshes import TurningMeshes

DRIVE, BACK, SPRING = 1, -1, 0
"""What a contact is: drive flank, back flank, or a spring that never parts."""
_NO_PHASE = np.zeros(0)
_TABLE = 8192
"""Points of the tables of a mesh period, between which stiffness and gap are linear."""


@dataclass(frozen=True)
class ContactGroup:
    """Contacts of one ``element``, which are what ``side`` says: `DRIVE`, `BACK` or `SPRING`.

    ``mesh`` (g,) int are the numbers of their meshes, not looked at of springs.
    """

    element: GearMeshes | TurningMeshes
    side: int
    mesh: np.ndarray


@dataclass(frozen=True)
class SpunSystem:
    """A system whose meshes go on with one rotation.

    The approaches of its c contacts are ``S(angles)^T basic^T q`` with ``S = fixed + sum_p (cos phi_p even_p + sin
    phi_p odd_p)`` and ``phi_p`` the angle of carrier p. Drive flanks and springs come before back flanks.

    Parameters
    ----------
    system : MechanicalSystem
        Of the n coordinates, ``K`` without the contacts, ``C`` with all gyroscopic terms, ``load`` the constant load.
    spin : (n,) array
        Motion by the rigid-body rotation, of one radian of the shaft that gives the speed; zero where none is free.
    basic : (n, m) array
        Motions that the contacts take part in.
    fixed, even, odd : (m, c), (P, m, c), (P, m, c) arrays
        Directions of the contacts along these.
    turn_ratio : (P,) array
        Speeds of the carriers over that of the shaft [1].
    stiffness, gap : (t, c) arrays
        Over equal steps of the phase, both ends included [N/m], [m]; of one row where it never changes.
    phase_ratio : (c,) array
        Speed of the phase of every contact over that of the shaft [1].
    side, mesh : (c,) int arrays
        `DRIVE`, `BACK` or `SPRING`, and number of the mesh.
    meshes : tuple of str
        Names of the M meshes.
    laws : tuple of Element
        On columns of ``basic``; forces do not depend on phases.
    """

    system: MechanicalSystem
    spin: np.ndarray
    basic: np.ndarray
    fixed: np.ndarray
    even: np.ndarray
    odd: np.ndarray
    turn_ratio: np.ndarray
    stiffness: np.ndarray
    gap: np.ndarray
    phase_ratio: np.ndarray
    side: np.ndarray
    mesh: np.ndarray
    meshes: tuple[str, ...]
    laws: tuple[Element, ...] = ()

    @cached_property
    def carried(self) -> np.ndarray:
        """Momenta (n,) of the rigid-body rotation at unit speed."""
        return self.system.M @ self.spin

    @cached_property
    def inertia(self) -> float:
        """Inertia of the whole about the shaft that gives the speed [kg m^2]; infinite where nothing turns freely."""
        return float(self.spin @ self.carried) or np.inf

    @property
    def closed(self) -> int:
        """Number of drive flanks and springs, which touch under load."""
        return int(np.count_nonzero(self.side != BACK))

    @property
    def drives(self) -> np.ndarray:
        """Places (M,) of the drive flanks among the contacts, mesh by mesh."""
        flanks = np.flatnonzero(self.side == DRIVE)
        return flanks[np.argsort(self.mesh[flanks], kind="stable")]

    @property
    def kept_together(self) -> SpunSystem:
        """The same with drive flanks that may pull, and no back flanks."""
        n = self.closed
        contacts = {name: getattr(self, name)[:n] for name in ("phase_ratio", "side", "mesh")}
        contacts |= {name: getattr(self, name)[..., :n] for name in ("fixed", "even", "odd", "stiffness", "gap")}
        return replace(self, **contacts)

    @property
    def law_springs(self) -> np.ndarray:
        """Springs (m,) of the laws on their columns, near which they work [N/m]."""
        springs = np.zeros(self.basic.shape[1])
        for law in self.laws:
            np.add.at(springs, law.columns, law.reference)
        return springs

    def law_forces(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute forces (m,) of the laws at motions x (m,) of ``basic`` and tangents (m, m) [N], [N/m]."""
        force, tangent = np.zeros(len(x)), np.zeros((len(x), len(x)))
        for law in self.laws:
            parts, slopes = law.evaluate(x[law.columns], _NO_PHASE)
            for columns, part, slope in zip(law.columns, parts, slopes, strict=True):
                force[columns] += part
                tangent[columns[:, None], columns] += slope
        return force, tangent

    def share(self, direction: np.ndarray) -> float:
        """Part of a load along a direction (n,) that drives the rotation: its power at unit speed."""
        return float(direction @ self.spin)

    def without_drive(self, load: np.ndarray) -> np.ndarray:
        """Take from a load (n,) [N, N m] what drives the rotation; the rest is (n,)."""
        return load - self.carried * (self.spin @ load) / self.inertia

    def selection(self, angle: np.ndarray) -> np.ndarray:
        """Compute ``S`` (t, m, c) at angles (t,) of the shaft [rad]."""
        angles = np.asarray(angle, float)[:, None] * self.turn_ratio
        whole = np.empty((len(angles), *self.fixed.shape))
        whole[...] = self.fixed
        # few entries turn
        turns = np.any((self.even != 0.0) | (self.odd != 0.0), axis=0)
        whole[..., turns] += np.cos(angles) @ self.even[:, turns] + np.sin(angles) @ self.odd[:, turns]
        return whole

    def at_phases(self, table: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Interpolate one of the tables (t, c) at angles (t',) of the shaft [rad], to (t', c)."""
        if len(table) == 1:
            return np.broadcast_to(table, (len(angle), table.shape[1]))
        steps = len(table) - 1
        place = (np.abs(np.asarray(angle)[:, None] * self.phase_ratio) / (2.0 * np.pi) % 1.0) * steps
        low = place.astype(int)
        part, column = place - low, np.arange(table.shape[1])
        return (1.0 - part) * table[low, column] + part * table[low + 1, column]

    def mesh_forces(self, approach: np.ndarray, stiffness: np.ndarray, gap: np.ndarray, *, parts: bool) -> np.ndarray:
        """Compute forces (..., M) [N] of the meshes, drive less back flank.

        From ``approach`` (..., c) [m], ``stiffness`` (..., c) [N/m] and ``gap`` (..., c) [m] of the contacts. Without
        ``parts`` flanks may pull, and there are no back flanks.
        """
        force = stiffness * (approach - gap)
        if not parts:
            return force[..., self.drives]
        total = np.maximum(force[..., self.drives], 0.0)
        behind = np.flatnonzero(self.side == BACK)
        # no mesh has two back flanks
        total[..., self.mesh[behind]] -= np.maximum(force[..., behind], 0.0)
        return total

    def touching(self, approach: np.ndarray, gap: np.ndarray) -> np.ndarray:
        """Tell of meshes (..., M) whether one of their flanks touches.

        From ``approach`` (..., c) and ``gap`` (..., c) [m].
        """
        overlap = approach - gap >= 0.0
        touched = overlap[..., self.drives].copy()
        behind = np.flatnonzero(self.side == BACK)
        touched[..., self.mesh[behind]] |= overlap[..., behind]
        return touched

    def static_flexibility(self, W: np.ndarray, k: np.ndarray) -> np.ndarray:
        """Compute deviations (n, n) by loads that do not drive the rotation [m/N], contacts W (n, c), k (c,) closed.

        Laws are springs.
        """
        total = self.system.K + (W * k) @ W.T + (self.basic * self.law_springs) @ self.basic.T
        largest = np.abs(self.carried).max(initial=0.0)
        size = (np.abs(total).max() or 1.0) / largest**2 if largest else 0.0
        return np.linalg.inv(total + size * np.outer(self.carried, self.carried))


def spun_system(
    system: MechanicalSystem,
    groups: Sequence[ContactGroup],
    meshes: Sequence[str],
    *,
    base_ratio: Sequence[float] | np.ndarray,
    shaft: np.ndarray,
    laws: Sequence[Element] = (),
) -> SpunSystem:
    """Make a system that goes on with one rotation from meshes as elements on the columns of its ``W``.

    Parameters
    ----------
    system : MechanicalSystem
        Of n coordinates and m columns.
    groups : sequence of ContactGroup
        Elements without backlash: back flanks are groups of their own.
    meshes : sequence of str
        Names of the M meshes.
    base_ratio : (b,) sequence of float
        Speeds of the base frequencies of the elements over that of the shaft that gives the speed [1].
    shaft : (n,) array
        Rotation of this shaft per unit of the coordinates.
    laws : sequence of Element
        On columns of ``W``, whose forces do not depend on phases.

    Raises
    ------
    CaseError
        Several rotations that nothing holds (E-MECHANISM); stiffnesses that are not positive (E-STIFFNESS).
    """
    groups = sorted(groups, key=lambda group: group.side == BACK)
    ratios = np.asarray(base_ratio, float)
    turns = list(dict.fromkeys(g.element.wave.orders for g in groups if isinstance(g.element, TurningMeshes)))
    columns = system.W.shape[1]
    parts: dict[str, list[Any]] = {name: [] for name in ("fixed", "even", "odd", "stiffness", "gap", "phase_ratio")}
    for group in groups:
        element, count = group.element, len(group.element.columns)
        fixed, even, odd = np.zeros((columns, count)), *np.zeros((2, len(turns), columns, count))
        place = element.columns.T, np.arange(count)
        if isinstance(element, TurningMeshes):
            number = turns.index(element.wave.orders)
            fixed[place], even[number][place], odd[number][place] = element.fixed.T, element.even.T, element.odd.T
        else:
            fixed[place] = 1.0
        stiffness, gap, ratio = _tables(element, ratios)
        for name, values in zip(parts, (fixed, even, odd, stiffness, gap, np.full(count, ratio)), strict=True):
            parts[name].append(values)
    arrays = {
        name: np.concatenate(values, axis=-1) for name, values in parts.items() if name in ("fixed", "even", "odd")
    }
    arrays |= {name: _joined(parts[name]) for name in ("stiffness", "gap")}
    side = np.concatenate([np.full(len(group.element.columns), group.side) for group in groups])
    made = SpunSystem(
        system,
        np.zeros(len(system.M)),
        system.W,
        **arrays,
        turn_ratio=np.array([np.dot(orders, ratios[: len(orders)]) for orders in turns]),
        phase_ratio=np.concatenate(parts["phase_ratio"]),
        side=side,
        mesh=np.concatenate([group.mesh for group in groups]).astype(int),
        meshes=tuple(meshes),
        laws=tuple(laws),
    )
    return replace(made, spin=free_rotation(made, shaft))


def _tables(element: GearMeshes | TurningMeshes, ratios: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Stiffness and gap (t, g) of an element over the phase of its mesh, and the speed of this phase."""
    series = [element.stiffness, element.deflection, element.force]
    lines = [term.amplitudes if isinstance(term, FourierSeries) else np.zeros((0, 0)) for term in series]
    orders = {term.orders for term, amplitudes in zip(series, lines, strict=True) if amplitudes.shape[1] > 1}
    if len(orders) > 1 or not all(part.size for part in lines):
        raise CaseError(
            "meshes of several base frequencies in one element", code="E-SHAPE", limit="Fourier series of one"
        )
    steps = max(_TABLE, 64 * max(part.shape[1] for part in lines))
    phase = 2.0 * np.pi * np.arange(steps + 1)[:, None] / steps if orders else np.zeros((1, 1))
    k, deflection, force = (np.array(FourierSeries(amplitudes).at(phase)) for amplitudes in lines)
    if np.any(k <= 0.0):
        raise CaseError(
            f"a mesh stiffness falls to {k.min():.3g} N/m",
            code="E-STIFFNESS",
            limit="above 0 N/m at any time",
            remedy="take other harmonics: a series that is cut overshoots its jumps by about 9 %",
        )
    gap = deflection - force / k
    gap = gap[:1] if np.ptp(gap, axis=0).max(initial=0.0) <= 1e-12 * np.abs(gap).max(initial=0.0) else gap
    ratio = float(np.dot(next(iter(orders)), ratios[: len(next(iter(orders)))])) if orders else 0.0
    return k, gap, ratio


def _joined(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Tables side by side, those of one row as long as the others."""
    rows = max(len(table) for table in tables)
    return np.concatenate([np.broadcast_to(table, (rows, table.shape[1])) for table in tables], axis=1)


def free_rotation(made: SpunSystem, shaft: np.ndarray) -> np.ndarray:
    """Find the free rotation (n,) by one radian of a shaft; zero where nothing turns freely.

    ``shaft`` (n,) is its rotation per unit of the coordinates.

    CaseError: several motions that nothing holds (E-MECHANISM).
    """
    still, k = made.kept_together, made.stiffness[:-1].mean(axis=0) if len(made.stiffness) > 1 else made.stiffness[0]
    W, k = still.basic @ still.selection(np.zeros(1))[0], k[: made.closed]
    plain = replace(made.system, W=W, C=0.0 * made.system.C, load=0.0 * made.system.load, gyroscopic=None)
    plain = replace(plain, K=plain.K + (made.basic * made.law_springs) @ made.basic.T)
    modes = undamped_modes(plain, k)
    free = modes.shape[:, modes.frequency == 0.0]
    if not free.shape[1]:
        return np.zeros(len(shaft))
    if free.shape[1] > 1 or abs(shaft @ free[:, 0]) < 1e-9 * np.abs(free).max():
        raise CaseError(
            f"{free.shape[1]} motions are free, not the turn of the shaft that gives the speed alone",
            code="E-MECHANISM",
            limit="one rotation",
            remedy="hold or couple the shafts that are left free, or give a bearing the direction that it lacks",
        )
    # once more, to rounding: what the stiffness with the momentum held does to the momentum
    carried = made.system.M @ free[:, 0]
    total = plain.K + (W * k) @ W.T
    size = np.abs(total).max() / np.abs(carried).max() ** 2
    motion = linalg.solve(total + size * np.outer(carried, carried), carried, assume_a="sym")
    return motion / (shaft @ motion)
