"""Contact in slices of the face width: tooth pairs as springs, joined by what bodies yield across the width.

Of spur teeth all slices are at one position; those of helical teeth are each at one of its own. The
compliance between them is that of `femgear.contact.width_waves`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import get_lapack_funcs

from femgear.contact.assembly import Candidates
from femgear.contact.batch import cyclic_harmonics
from femgear.contact.pair_laws import PairLaws
from femgear.contact.supports import TiltingMembers
from femgear.contact.width_waves import WidthWaves, slice_compliance
from femgear.errors import ContactError

_REFRESHED, _BOLD, _MOST = 4, 20, 500
"""Newton steps for which moments follow forces, after which slices change sides one by one, and in all."""
_SETTLED, _ROUNDED = 1e-11, 1e-12
"""Shares of the load, and of what separations would take to close, by which forces may still change."""
_FAINT = 1e-9
"""Share of the load below which a force is rounding."""
_SOFTEST = 1e-13
"""Spring on every motion, over that of a tooth pair: it holds what no loaded pair holds."""
_TOGETHER = 8
"""Positions that are solved at once."""
_POSV: Any = {kind: get_lapack_funcs(("posv",), dtype=kind)[0] for kind in (float, complex)}
"""Solution of Hermitian systems by Cholesky's factor, with a word whether they are definite."""
PARTS = 25
"""Of the width, over which loads are told."""


@dataclass(frozen=True)
class SliceState:
    """Solution at P positions in N slices of W windows (tooth pairs), of m motions.

    Parameters
    ----------
    force : (P, N, W) array
        Force of a tooth pair, were it the same over the whole width [N]; the mean over slices is that of the
        pair. Of helical teeth a window may be that of another pair in every slice.
    motions : (P, m) array
        [m].
    mesh : (W,) array
        Mesh of every window.
    iterations, residual : (P,) arrays
        Linear solutions, and largest violation of the contact conditions over the largest displacement.
    tangents : tuple of (P, meshes) arrays
        For the bodies, and others that were asked for: increments of the mesh forces per unit approach of
        every mesh at constant loads of the others [N/m]. Of spur teeth less those of the plane solution.
    joint : (H, P, meshes, meshes) array
        Of the bodies that were asked for: the same per unit approach of each mesh while the others hold
        theirs, in every harmonic over the images; empty without them.
    """

    force: np.ndarray
    motions: np.ndarray
    mesh: np.ndarray
    iterations: np.ndarray
    residual: np.ndarray
    tangents: tuple[np.ndarray, ...]
    joint: np.ndarray

    def largest(self) -> np.ndarray:
        """Largest force of a tooth pair in a 25th of the width (P, W) [N]."""
        return largest_mean(self.force, axis=1)

    def of_laws(self, laws: PairLaws) -> np.ndarray:
        """Largest force of every spring in the slices that it stands for, (rows, W) [N]."""
        return self.force.reshape(len(laws.separation), -1, len(self.mesh)).max(axis=1)

    def contact_width(self, candidates: Candidates, laws: PairLaws) -> np.ndarray:
        """Largest width of the contact of every spring along the profile, (rows, W) [m]."""
        touched = (laws.touching <= self.of_laws(laws)[..., None]).sum(axis=-1)
        return touched * candidates.setup.cell[candidates.mesh]

    def overflows(self, candidates: Candidates, laws: PairLaws) -> bool:
        """Whether a slice presses cells at the end of a window that is not the end of a flank."""
        reached = laws.touching[..., [0, -1]] <= self.of_laws(laws)[..., None]
        return bool((reached & ~np.moveaxis(candidates.at_edge, 0, -1)).any())

    def reaches_ends(self, candidates: Candidates, laws: PairLaws) -> np.ndarray:
        """Whether a contact reaches an end of a flank, (rows, W)."""
        touched = (laws.touching <= self.of_laws(laws)[..., None]) & candidates.candidate
        return candidates.at_flank_end(touched)

    def of_meshes(self) -> np.ndarray:
        """Force of every mesh per slice over the whole width [N], (P, N, meshes)."""
        return self.force @ (self.mesh[:, None] == np.arange(self.mesh[-1] + 1))


def largest_mean(load, *, axis: int) -> np.ndarray:
    """Find the largest mean over a 25th of the width of the loads in equal slices, which lie along ``axis`` (...).

    Towards an end at which the flanks stand askew the load grows without limit, as the logarithm of the
    slices' number: the mirror plane of the end makes a ridge of them. What a part of the width carries does
    not. 25 slices are such parts themselves.
    """
    load = np.moveaxis(np.asarray(load, float), axis, -1)
    count, part = load.shape[-1], 1.0 / PARTS
    total = np.concatenate([np.zeros((*load.shape[:-1], 1)), load.cumsum(axis=-1) / count], axis=-1)
    # the mean is largest where one of its ends is that of a slice
    edges = np.arange(count + 1) / count
    start = np.unique(np.clip(np.concatenate([edges, edges - part]), 0.0, 1.0 - part).round(12))
    first, last = (_between(total, part_of_turn * count) for part_of_turn in (start, start + part))
    return (last - first).max(axis=-1) / part


def _between(values: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Values (..., n) at places in between (m,), by straight lines."""
    low = np.minimum(place.astype(int), values.shape[-1] - 2)
    return values[..., low] + (place - low) * (values[..., low + 1] - values[..., low])


def solve_slices(
    candidates: Candidates,
    laws: PairLaws,
    load,
    waves: WidthWaves,
    separations: np.ndarray,
    held: tuple[np.ndarray, WidthWaves] | None = None,
    tilting: TiltingMembers | None = None,
) -> SliceState:
    """Solve the contact of all tooth pairs in all slices, which share their motions.

    Newton's method on the pairs as springs (`femgear.contact.pair_laws.PairLaws`). Without separations spur teeth
    have the plane solution that the laws were made of.

    ContactError: E-CONTACT: the iteration does not end.

    Parameters
    ----------
    candidates : Candidates
        All windows, with the pairs that the laws are of: at P positions, or, of helical teeth, in all N
        slices at each of them, (P N) rows.
    load : (m,) array
        External load on the motions [N].
    separations : (P, N, W) array
        What leads, crowning and misalignment add in the slices to whole pairs [m].
    held : (I, rows, W, 3, W, 3) array and WidthWaves, optional
        `Candidates.images` of other bodies [m/N], for whose tangents the contact is taken too.
    tilting : TiltingMembers, optional
        Motions that differ from slice to slice; they follow the others.
    """
    parts, load, (P, N, _) = [], np.asarray(load, float), separations.shape
    each = len(candidates.position) // P
    for first in range(0, P, _TOGETHER):
        block = np.arange(first, min(first + _TOGETHER, P))
        rows = block[:, None] * each + np.arange(each)
        smooth = candidates.images[:, rows]
        across, *of_held = slice_compliance(candidates, rows, (waves,) if held is None else (waves, held[1]), N)
        bodies = [(smooth, across)]
        if held is not None:
            bodies.append((held[0][:, rows], of_held[0]))
        newton = _SliceNewton(laws, rows, load, across.sum(axis=0), separations[block], smooth[0], tilting)
        # in the plane nothing tilts or winds up
        before = _of_one_slice(laws, rows, load, bodies) if each == 1 else []
        if tilting is not None:
            mesh, window = laws.mesh, np.arange(N)[:, None]
            coupling = tilting.coupling[mesh, window][:, :, mesh, window]
            newton.across = newton.across + coupling / newton.unit
            bodies = [(body, change + coupling) for body, change in bodies]
        # a sector settles as its whole set does
        solved = newton.solve(candidates.setup.images)
        after = newton.tangents(bodies)
        after = [b - a for a, b in zip(before, after, strict=True)] if before else after
        # positions come first
        parts.append((*solved, after[0].swapaxes(0, 1), *after[1:]))
    force, motions, iterations, residual, joint, *joint_motions = (
        np.concatenate(part) for part in zip(*parts, strict=True)
    )
    return SliceState(force, motions, laws.mesh, iterations, residual, tuple(joint_motions), joint.swapaxes(0, 1))


def _of_one_slice(laws: PairLaws, rows, load, bodies) -> list[np.ndarray]:
    """Tangents of `_SliceNewton` in the plane state: slices that are alike do not feel one another."""
    P, W = len(rows), len(laws.mesh)
    alone = [(smooth, np.zeros((len(smooth), P, 1, W, 1, W))) for smooth, _ in bodies]
    plane = _SliceNewton(laws, rows, load, alone[0][1][0], np.zeros((P, 1, W)), alone[0][0][0])
    return plane.tangents(alone)


class _SliceNewton:
    """Newton's method of `solve_slices` at some positions; motions and compliances over ``unit``.

    Springs are those of the ``rows`` (P, L) of the laws: one for all slices, or one for each of them;
    ``smooth`` (P, L, W, 3, W, 3) is the compliance that they contain of their own windows [m/N].
    """

    def __init__(self, laws: PairLaws, rows, load, across, separations, smooth, tilting=None):
        self.laws, self.rows, self.smooth = laws, rows, smooth
        (P, N, W), L = separations.shape, rows.shape[1]
        k = 0 if tilting is None else len(tilting.names)
        # approach by the motions that slices do not share, (N, W, k)
        self.tilts = np.zeros((N, W, 0)) if tilting is None else tilting.approach[laws.mesh].swapaxes(0, 1)
        self.load = np.append(load, np.zeros(k))
        self.shape, self.size, self.each = (P, N, W), N * W, N // L
        self.unit = float(laws.yields[np.isfinite(laws.separation)].mean())
        self.across = across / self.unit
        self.moments = laws.moments[rows.ravel()]
        self.S = laws.smooth[rows].swapaxes(4, 5).reshape(P, L, W, 3, -1)
        plane = laws.loads[rows]
        field = (self.S @ plane.swapaxes(2, 3).reshape(P, L, 1, -1, 1))[..., 0]
        self.field = field + (plane.sum(axis=-1) @ laws.supports)[..., None]
        # friction on sprung members, and in the equilibrium, of every slice
        self.rubbing = self.levers = None
        if laws.friction is not None:
            of_rows = (laws.friction.supports[rows] / self.unit, laws.friction.arms[rows])
            self.rubbing, self.levers = (np.repeat(values, self.each, axis=1) for values in of_rows)
            self.field = self.field + (laws.friction.supports[rows] @ plane.sum(axis=-1)[..., None])
        self.plane, motions = plane.sum(axis=-1), laws.motions[rows] / self.unit
        self.motions = np.hstack([motions.mean(axis=1), np.zeros((P, k))])
        # of springs on the motions, over the unit
        self.springs = np.full(len(self.load), _SOFTEST)
        if tilting is not None:
            self.springs[len(load) :] += tilting.stiffness * self.unit
        there = np.isfinite(laws.separation[rows])
        self.apart = np.where(there, laws.separation[rows], 1.0)
        there, self.apart, self.force = (
            np.repeat(values, self.each, axis=1) for values in (there, self.apart, self.plane)
        )
        self.widest = float(np.abs(np.where(there, self.apart + separations, 0.0)).max())
        self.closed, self.carrying = self.force > 0.0, None
        # at the given state the curves miss their own points by their interpolation
        self.refresh()
        missed = self.by_laws(self.force)[0] + self.force @ laws.supports / self.unit
        if self.rubbing is not None:
            missed += (self.rubbing @ self.force[..., None])[..., 0]
        missed -= np.repeat(motions @ laws.approach.T, self.each, axis=1)
        self.apart = self.apart - np.where(self.force > 0.0, missed, 0.0) * self.unit + separations
        self.refresh()

    def refresh(self) -> None:
        """Take the moments of the pressures from the forces as they are."""
        (P, N, W), L = self.shape, self.rows.shape[1]
        mu = self._moments(self.force).reshape(P, L, self.each, W, 3).swapaxes(2, 3)
        half = (mu @ self.S).reshape(P, L, W, self.each, 3, W)
        between = (half * mu.transpose(0, 1, 3, 4, 2)[:, :, None]).sum(axis=-2)
        self.between = between.swapaxes(2, 3).reshape(P, N, W, W) / self.unit
        bent = (mu * self.field[:, :, :, None]).sum(axis=-1).swapaxes(2, 3)
        self.bent = (self.apart - bent.reshape(P, N, W)) / self.unit

    def _moments(self, force: np.ndarray) -> np.ndarray:
        """Moments ``mu`` (P, N, W, 3) under forces (P, N, W) [N]."""
        P, N, W = self.shape
        laws = replace(self.laws, moments=self.moments)
        of_rows = force.reshape(-1, self.each, W).swapaxes(0, 1)
        return laws.moments_under(of_rows).swapaxes(0, 1).reshape(P, N, W, 3)

    def by_laws(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Separations by what each slice carries by itself, and their slope, (P, N, W) as the force, over the unit."""
        W = self.shape[2]
        value, slope = self.laws.approaches(force.reshape(-1, W), np.repeat(self.rows.ravel(), self.each))
        gap = self.bent + value.reshape(self.shape) / self.unit + (self.between @ force[..., None])[..., 0]
        return gap, slope.reshape(self.shape) / self.unit

    def gaps(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Separations that are left under forces, and their slope over the own force, (P, N, W) each, over the unit."""
        P = self.shape[0]
        gap, slope = self.by_laws(force)
        gap += (self.across.reshape(P, self.size, -1) @ force.reshape(P, -1, 1)).reshape(self.shape)
        # members on springs move as a whole
        gap += (force.mean(axis=1) @ self.laws.supports / self.unit)[:, None]
        if self.rubbing is not None:
            gap += (self.rubbing @ force[..., None])[..., 0].mean(axis=1)[:, None]
        shared = self.laws.approach.shape[1]
        gap = gap - (self.motions[:, :shared] @ self.laws.approach.T)[:, None]
        return gap - np.einsum("nwk,pk->pnw", self.tilts, self.motions[:, shared:]), slope

    def solve(self, images: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Iterate until all positions are solved: forces, motions, steps and residuals.

        What changes by little against the load of the whole set, of so many ``images``, is settled.

        Slices that pull open and slices that overlap close, all at once; after `_BOLD` steps the last one
        alone (K. G. Murty, Linear Algebra Appl. 7, 1974), which ends for every linear problem.
        """
        P, steps = len(self.rows), np.zeros(len(self.rows), int)
        load = images * np.abs(self.load).max()
        # with members on springs, which move as a whole
        N, n = self.shape[1], self.size
        joined = self.across + self.laws.supports[:, None] / (N * self.unit)
        if self.rubbing is not None:
            joined = joined + self.rubbing.swapaxes(1, 2)[:, None] / N
        self.joined = joined.reshape(P, n, n)
        # separations that are large against the load leave their rounding in it
        limit = max(_SETTLED * load, _ROUNDED * self.widest / self.unit)
        todo = np.ones(P, bool)
        for step in range(_MOST):
            if step < _REFRESHED:
                self.refresh()
            # moments follow forces at first
            moved = self.step(todo | (step < _REFRESHED), single=step >= _BOLD)
            steps += todo
            todo = moved > limit
            if not todo.any() and step >= _REFRESHED:
                self.force = np.where(self.force > _FAINT * load, self.force, 0.0)
                gap = self.gaps(self.force)[0]
                missed = np.where(self.force > 0.0, np.abs(gap), np.maximum(-gap, 0.0))
                residual = missed.reshape(P, -1).max(axis=1) / np.abs(self.force).max(initial=load)
                return self.force, self.motions * self.unit, steps, residual
        raise ContactError(
            f"the contact of slices does not settle at {int(todo.sum())} of {P} positions",
            code="E-CONTACT",
            remedy="look for modifications, clearances or stiffnesses of very different size",
        )

    def tangents(self, bodies) -> list[np.ndarray]:
        """Compute joint and own tangents, as `SliceState` has them.

        ``bodies`` are pairs of compliances between all windows and their images, (I, P, L, W, 3, W, 3) and
        across the width, (I, P, N, W, N, W) [m/N]. The list begins with ``joint`` (H, P, meshes, meshes) of
        the last of several bodies; ``own`` (P, meshes) of each follow [N/m].
        """
        (P, N, _), meshes = self.shape, np.arange(int(self.laws.mesh[-1]) + 1)
        carrying = _Carrying.of((self.force > 0.0).reshape(P, self.size), self.shape[2])
        on, at = carrying.on, carrying.at
        c, k, rows = at.shape[1], self.tilts.shape[-1], np.arange(P)[:, None]
        ones = (np.tile(self.laws.mesh, N)[at][..., None] == meshes) * on[..., None].astype(float)
        ones = np.concatenate([ones, np.zeros((P, k, len(meshes)))], axis=1)
        blocks, A, slope = [], np.zeros((1, P, c + k, c + k)), self.gaps(self.force)[1]
        # a border of tilts is not symmetric
        solve = np.linalg.solve if k else _symmetric_solution
        moments = self._moments(self.force)
        for number, (smooth, across) in enumerate(bodies, 1):
            # the images are those of the last bodies alone
            images = len(across) if number == len(bodies) else 1
            A, alone = self._bordered(smooth[:images], across[:images], moments, slope, carrying), []
            for j in meshes:
                carries, columns = _first(ones[:, :c, j] > 0.0)
                carries = np.hstack([carries, np.ones((P, k), bool)])
                columns = np.hstack([columns, np.tile(np.arange(c, c + k), (P, 1))])
                part = np.where(
                    carries[:, :, None] & carries[:, None],
                    A[0, rows[..., None], columns[:, :, None], columns[:, None]],
                    np.eye(carries.shape[1]),
                )
                carries = np.where(columns < c, carries, False)
                alone.append((carries * solve(part, carries[..., None].astype(float))[..., 0]).sum(axis=1))
            blocks.append(np.stack(alone, axis=1) / (N * self.unit))
        if len(bodies) == 1:
            return [np.zeros((1, P, 0, 0)), *blocks]
        harmonics = cyclic_harmonics(A)
        answers = [solve(harmonics[0].real, ones), *(solve(harmonic, ones) for harmonic in harmonics[1:])]
        return [ones.swapaxes(1, 2) @ np.array(answers) / (N * self.unit), *blocks]

    def _bordered(self, smooth, across, moments, slope, carrying: _Carrying) -> np.ndarray:
        """Compliance between the loaded slices and to their images, (I, P, c + k, c + k), over the unit."""
        (P, N, W), n, L = self.shape, self.size, self.rows.shape[1]
        mu = moments.reshape(P, L, self.each, W, 3).swapaxes(2, 3)
        half = mu @ smooth.swapaxes(5, 6).reshape(-1, P, L, W, 3, 3 * W)
        between = half.reshape(-1, P, L, W, self.each, 3, W) * mu.transpose(0, 1, 3, 4, 2)[:, :, None]
        between = between.sum(axis=-2).swapaxes(3, 4)
        # the springs contain what bodies yield under their own window
        diagonal = np.diagonal(self.smooth, axis1=2, axis2=4).transpose(0, 1, 4, 2, 3)
        between[0][..., range(W), range(W)] -= np.einsum("plwsa,plwab,plwsb->plsw", mu, diagonal, mu)
        between = between.reshape(-1, P, N, W, W) / self.unit
        between[0][..., range(W), range(W)] += slope
        across, on, at = across.reshape(-1, P, n, n), carrying.on, carrying.at
        c, k, tilts = at.shape[1], self.tilts.shape[-1], self.tilts.reshape(n, -1)[at] * on[..., None]
        matrices = np.zeros((len(across), P, c + k, c + k))
        for matrix, part, beside in zip(matrices, across, between, strict=True):
            self._gather(matrix, part, beside, carrying, 1.0 / self.unit)
        matrices[0][:, range(c), range(c)] += ~on
        # tilts follow the increments: the border of the rows that carry
        matrices[..., :c, c:], matrices[..., c:, :c] = -tilts, tilts.swapaxes(1, 2) / N
        matrices[..., range(c, c + k), range(c, c + k)] = self.springs[len(self.load) - k :]
        return matrices

    def _gather(self, system, across, between, carrying: _Carrying, factor=1.0) -> None:
        """Put compliances of the slices that carry into the first rows and columns of systems (P, ., .).

        Those ``across`` (P, n, n) times a factor, and those ``between`` the windows of a slice (P, N, W, W).
        """
        c = carrying.at.shape[1]
        block = system[:, :c, :c]
        for part, whole, at in zip(block, across, carrying.at, strict=True):
            np.multiply(whole.take(at, axis=0).take(at, axis=1), factor, out=part)
        if not carrying.on.all():
            block *= carrying.on[:, :, None] & carrying.on[:, None]
        p, i, j, other_window, window, w = carrying.beside
        block[p, i, j] += between[p, other_window, window, w]

    def step(self, todo: np.ndarray, *, single: bool) -> np.ndarray:
        """Take a step at positions ``todo`` (P,); the largest changes of forces (P,) [N], inf while sides change."""
        (P, N, W), n, m = self.shape, self.size, len(self.load)
        gap, slope = self.gaps(self.force)
        wrong = np.where(self.closed, self.force < 0.0, gap < 0.0).reshape(P, n)
        changed = wrong.any(axis=1)
        if single:
            last = n - 1 - wrong[:, ::-1].argmax(axis=1)
            wrong &= np.arange(n) == last[:, None]
        self.closed = self.closed ^ wrong.reshape(P, N, W)
        before, self.force = self.force, np.where(self.closed, self.force, 0.0)
        if (self.force != before).any():
            gap, slope = self.gaps(self.force)
        # what is closed alone, and as many of the others as the position with the most of it asks for
        if self.carrying is None or changed.any():
            self.carrying = _Carrying.of(self.closed.reshape(P, n), W)
        on, at = self.carrying.on, self.carrying.at
        block = np.empty((P, at.shape[1], at.shape[1]))
        between = self.between.copy()
        between[..., range(W), range(W)] += slope
        self._gather(block, self.joined, between, self.carrying)
        G = np.hstack([np.tile(self.laws.approach, (N, 1)), self.tilts.reshape(n, -1)])[at]
        tilted, levers = np.einsum("nwk,pnw->pk", self.tilts, self.force), None
        carried = np.hstack([self.force.sum(axis=1) @ self.laws.approach, tilted]) / N
        if self.levers is not None:
            shared = self.levers.shape[-1]
            carried[:, :shared] += (self.force.reshape(P, 1, n) @ self.levers.reshape(P, n, shared))[:, 0] / N
            levers = G.copy()
            levers[..., :shared] += np.take_along_axis(self.levers.reshape(P, n, shared), at[..., None], axis=1)
        balance = self.load - carried - self.springs * self.motions
        gap, change = np.take_along_axis(gap.reshape(P, n), at, axis=1), np.zeros((P, n + m))
        for place in np.flatnonzero(todo | changed):
            # what is closed comes first
            carrying = slice(int(on[place].sum()))
            solution = _bordered_solution(
                block[place, carrying, carrying],
                G[place, carrying],
                self.springs,
                -gap[place, carrying],
                balance[place],
                N,
                None if levers is None else levers[place, carrying],
            )
            change[place, at[place, carrying]], change[place, n:] = solution
        # pulls stay until the next step: motions belong to them
        self.force = np.where(self.closed, self.force + change[:, :n].reshape(P, N, W), 0.0)
        self.motions = self.motions + change[:, n:]
        moved = np.abs(self.force - before).reshape(P, -1).max(axis=1)
        return np.where(changed, np.inf, moved)


def _bordered_solution(
    compliance: np.ndarray,
    G: np.ndarray,
    springs: np.ndarray,
    right: np.ndarray,
    balance: np.ndarray,
    slices: int,
    levers: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Solve ``A f - G q = right, G^T f / N + S q = balance`` for forces (c,) and motions (m,).

    The compliance A (c, c) is symmetric and mostly definite; S are springs (m,), N slices. With friction the
    equilibrium has ``levers`` (c, m) in place of G, and A need not be symmetric.
    """
    failed = levers is not None
    if not failed:
        _, solved, failed = _POSV[float](compliance.T, np.column_stack([G, right]))
    if failed:
        solved = np.linalg.solve(compliance, np.column_stack([G, right]))
    by_motions, alone = solved[:, :-1], solved[:, -1]
    below = (G if levers is None else levers).T / slices
    moved = np.linalg.solve(np.diag(springs) + below @ by_motions, balance - below @ alone)
    return alone + by_motions @ moved, moved


def _symmetric_solution(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve systems (..., n, n) that are Hermitian and mostly definite for right sides (..., n, k)."""
    solution = np.empty(right.shape, matrices.dtype)
    solver = _POSV[complex if np.iscomplexobj(matrices) else float]
    for place in np.ndindex(matrices.shape[:-2]):
        _, solution[place], failed = solver(matrices[place], right[place])
        if failed:
            solution[place] = np.linalg.solve(matrices[place], right[place])
    return solution


@dataclass(frozen=True)
class _Carrying:
    """Those slices of windows that carry, as many places c at each of P positions.

    ``on`` (P, c) tells whether a place is taken, ``at`` (P, c) which of all n slices of windows stands there.
    ``beside`` are position, row and column of pairs in the same slice, with slice and both windows.
    """

    on: np.ndarray
    at: np.ndarray
    beside: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, carries: np.ndarray, windows: int) -> _Carrying:
        """Find them among all slices of windows (P, n), of so many windows a slice."""
        on, at = _first(carries)
        (P, n), c = carries.shape, at.shape[1]
        p, i = np.arange(P)[:, None], np.arange(c)
        place = np.full((P, n), -1)
        place[p, at] = np.where(on, i, -1)
        beside = place.reshape(P, -1, windows)[p, at // windows]
        p, i, w = np.nonzero((beside >= 0) & on[..., None])
        return cls(on, at, (p, i, beside[p, i, w], *np.divmod(at[p, i], windows), w))


def _first(on: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places where rows (P, n) are true, as many for every row, (P, c): whether they are, and which."""
    at = np.argsort(~on, axis=1, kind="stable")[:, : max(int(on.sum(axis=1).max()), 1)]
    return np.take_along_axis(on, at, axis=1), at
