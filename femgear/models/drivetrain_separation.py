"""Meshes that separate: which flanks touch at the end of a step, and the steps themselves.

Drive and back flanks are contacts of their own (`femgear.models.drivetrain_contacts`) with the force
``k max(u, 0)`` of their overlap u, the approach less the gap. With the contacts known that touch, the
overlaps at the end of a step obey a small linear system. The forces do not fall with the overlap and the
flexibility takes no energy back, so that there is one solution. Changing the wrong contacts and solving again
mostly ends after one round; where it does not, the way from a known point is followed across the borders of
the contacts, which always ends (J. Katzenelson, Bell Syst. Tech. J. 44, 1965, 1605-1620; T. Fujisawa and
E. S. Kuh, SIAM J. Appl. Math. 22, 1972, 307-328).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.models.drivetrain_step import MeshBlock, Scheme, march_closed

# Rounding of an overlap relative to the largest one without mesh forces.
_ROUNDING = 1e-12
# Rounds of changing all wrong contacts; borders crossed a contact; starts for the way across them.
_ROUNDS, _CROSSINGS, _STARTS = 12, 40, 5
# Steps that are tried at once with all drive flanks and no others in touch, first and last.
_FEW, _MANY = 8, 64


@dataclass(frozen=True)
class ContactLaw:
    """Forces ``touching u`` (n,) of the overlaps u of contacts that touch, ``parted u`` of the others.

    Parameters
    ----------
    touching, parted : (n,) arrays
        [N/m]
    """

    touching: np.ndarray
    parted: np.ndarray

    def slopes(self, closed):
        """(n,) [N/m]"""
        return np.where(closed, self.touching, self.parted)


def one_sided(stiffness) -> ContactLaw:
    """Contacts that push only."""
    return ContactLaw(stiffness, np.zeros_like(stiffness))


def solve_contact(flexibility, free, law: ContactLaw, closed) -> tuple[np.ndarray, np.ndarray]:
    """Overlaps and the contacts that touch (n,), with ``u + flexibility force(u) = free``.

    Parameters
    ----------
    flexibility : (n, n) array
        With a symmetric part that is not negative [m/N].
    free : (n,) array
        Overlaps without the forces [m].
    law : ContactLaw
    closed : (n,) bool array
        First guess.

    Raises
    ------
    ConvergenceError
        No contacts fit (E-CONTACT-STATE).
    """
    for _ in range(_ROUNDS):
        u, found = _solved(flexibility, free, law, closed)
        if np.array_equal(found, closed):
            return u, closed
        closed = found
    return _across_borders(flexibility, free, law)


def _solved(flexibility, free, law, closed):
    """Overlaps with these contacts, and the contacts that touch with them."""
    u = np.linalg.solve(np.eye(len(free)) + flexibility * law.slopes(closed), free)
    return u, changed(u, closed, _ROUNDING * np.abs(free).max(initial=0.0))


def changed(u, closed, rounding):
    """The contacts that touch with overlaps u; within rounding as before."""
    return np.where(closed, u >= -rounding, u > rounding)


def _across_borders(flexibility, free, law):
    """Katzenelson's way from `free`; at a corner of several borders it begins again beside it."""
    random, size = np.random.default_rng(0), np.abs(free).max()
    for attempt in range(_STARTS):
        closed = _one_way(flexibility, free, law, free + attempt * size * random.standard_normal(len(free)))
        if closed is not None:
            u, found = _solved(flexibility, free, law, closed)
            if np.array_equal(found, closed):
                return u, closed
    raise ConvergenceError(
        "no contacts of the meshes fit the end of a step", code="E-CONTACT-STATE",
        remedy="take shorter steps, or the start \"zero\"",
    )  # fmt: skip


def _one_way(flexibility, free, law, u):
    """Contacts at the end of the straight way of ``u + flexibility force(u)`` to `free`; None in a circle."""
    closed = u >= 0.0
    left = free - u - flexibility @ (law.slopes(closed) * u)
    for _ in range(_CROSSINGS * len(u)):
        way = np.linalg.solve(np.eye(len(u)) + flexibility * law.slopes(closed), left)
        leaves = np.where(closed, way < 0.0, way > 0.0)
        share = np.full(len(u), np.inf)
        share[leaves] = np.maximum(-u[leaves] / way[leaves], 0.0)
        first = int(np.argmin(share))
        if share[first] >= 1.0:
            return closed
        u, left = u + share[first] * way, (1.0 - share[first]) * left
        u[first], closed[first] = 0.0, not closed[first]
    return None


def check_pushing(model, table) -> None:
    """Refuse meshes that separate and whose stiffness, samples (t, n_meshes), is negative anywhere."""
    least = table.min(axis=0, initial=np.inf)
    if np.any(least < 0.0):
        mesh = int(np.argmin(least))
        raise CaseError(
            f"the stiffness of mesh {model.meshes[mesh]} falls to {least[mesh]:.4g} N/m: parted teeth do not"
            " pull", code="E-STIFFNESS", limit="0 N/m or more at any phase",
            remedy="take another number of harmonics, or a larger low_share",
        )  # fmt: skip


class Separating:
    """Steps of meshes that separate, beside the tangent that the free motion takes.

    Parameters
    ----------
    gap : (n,) array
        Of all contacts [m].
    meshes : int
        Number of the first contacts, which are the drive flanks.
    """

    def __init__(self, gap, meshes: int):
        from scipy.linalg.lapack import dgesv

        self.gap, self.dgesv = gap, dgesv
        self.drive = np.arange(len(gap)) < meshes
        # what leaves the drive flanks, and no others, in touch is not below zero
        self.sense = np.where(self.drive, 1.0, -1.0)
        self.tries = _FEW
        self._take(self.drive)

    def _take(self, closed) -> None:
        """Keep the contacts that touch, and the overlaps from `least` to `most` that fit them."""
        self.closed, self.drives = closed, np.array_equal(closed, self.drive)
        self.touching = np.flatnonzero(closed)
        self.play = self.gap[self.touching]
        self.least = np.where(closed, 0.0, -np.inf)
        self.most = np.where(closed, np.inf, 0.0)

    def march(self, scheme: Scheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
        """As `march_closed`, with the contacts that touch."""
        i, stop = steps.start, steps.stop
        while i < stop:
            if self.drives:
                tried = range(i, min(i + self.tries, stop))
                march_closed(scheme, meshes, loads, rows, tried)
                kept = self._kept(scheme, meshes, rows, tried)
                i += kept
                self.tries = min(2 * self.tries, _MANY)
                if kept == len(tried):
                    continue
                self.tries = _FEW
            self._step(scheme, i, meshes, loads, rows)
            i += 1

    def _kept(self, scheme, meshes, rows, steps) -> int:
        """Steps until the first drive flank parts or back flank touches."""
        at, n = 2 * scheme.n, scheme.n
        z = rows[steps.start + 1 : steps.stop + 1, 0]
        x = z[:, :n] @ scheme.basic - z[:, at:] @ scheme.flexibility.T
        approach = np.einsum("tmj,tm->tj", meshes.selection[steps.start : steps.stop], x)
        wrong = ((approach - self.gap) * self.sense < 0.0).any(axis=1)
        return int(np.argmax(wrong)) if wrong.any() else len(z)

    def _step(self, scheme, i, meshes, loads, rows) -> None:
        after = rows[i + 1]
        np.dot(rows[i], scheme.advance, out=after)
        after[0] += loads[i]
        drawn = after[:, 2 * scheme.n :]
        drawn[:] = self._forces(scheme, meshes, i, drawn)

    def _forces(self, scheme, meshes, i, x):
        """Forces and their tangents (2, m) on the simple motions from these motions (2, m) without them."""
        forces, u = self._solved(scheme, meshes, i, x)
        if ((u >= self.least) & (u <= self.most)).all():
            return forces
        if not np.isfinite(x).all():
            return np.full_like(x, np.nan)
        S = meshes.selection[i]
        free = np.dot(x[0], S) - self.gap
        found = changed(u, self.closed, _ROUNDING * np.abs(free).max())
        if np.array_equal(found, self.closed):
            return forces
        flexibility = np.dot(S.T, np.dot(scheme.flexibility, S))
        self._take(solve_contact(flexibility, free, one_sided(meshes.stiffness[i]), found)[1])
        return self._solved(scheme, meshes, i, x)[0]

    def _solved(self, scheme, meshes, i, x):
        """Forces and tangents with the present contacts, and the overlaps (n,) that they lead to."""
        S, k = meshes.selection[i], meshes.stiffness[i][self.touching]
        if not len(k):
            return np.zeros_like(x), np.dot(x[0], S) - self.gap
        own, flexible = S.take(self.touching, axis=1), scheme.flexibility.T
        inner = np.dot(np.dot(own.T, flexible), own) * k
        inner.ravel()[:: len(k) + 1] += 1.0
        right = np.dot(x, own)
        right[0] -= self.play
        right *= k
        # rows in C order are columns in that of Fortran: nothing is copied
        forces = np.dot(self.dgesv(inner.T, right.T, overwrite_a=True, overwrite_b=True)[2].T, own.T)
        return forces, np.dot(x[0] - np.dot(forces[0], flexible), S) - self.gap
