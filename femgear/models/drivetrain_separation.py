"""Meshes that separate: which flanks touch at the end of a step, and the steps themselves.

The force of a mesh is ``k max(x, 0) - k max(-x - backlash, 0)``. With the status of every mesh (drive flank,
none, back flank) the approaches at the end of a step obey a small linear system. The forces do not fall with
the approach and the flexibility takes no energy back, so that there is one solution. Changing the wrong
statuses and solving again mostly ends after one round; where it does not, the way from a known point is
followed across the borders of the statuses, which always ends (J. Katzenelson, Bell Syst. Tech. J. 44, 1965,
1605-1620; T. Fujisawa and E. S. Kuh, SIAM J. Appl. Math. 22, 1972, 307-328).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.models.drivetrain_step import MeshBlock, Scheme, march_closed

DRIVE, OPEN, BACK = 0, 1, 2
# Rounding of an approach relative to the largest one without mesh forces.
_ROUNDING = 1e-12
# Rounds of changing all wrong statuses; borders crossed a mesh; starts for the way across them.
_ROUNDS, _CROSSINGS, _STARTS = 12, 40, 5
# Steps that are tried at once with all drive flanks in touch, first and last.
_FEW, _MANY = 8, 64


@dataclass(frozen=True)
class PieceLaw:
    """Forces ``slope x + offset`` (n_meshes,) of meshes by their status.

    Parameters
    ----------
    touching, parted : (n,) arrays
        Slopes with flanks that touch and without [N/m].
    backlash : (n,) array
        [m]
    stiffness : (n,) array
        Of the back flank's offset [N/m].
    """

    touching: np.ndarray
    parted: np.ndarray
    backlash: np.ndarray
    stiffness: np.ndarray

    def pieces(self, status):
        """Slopes and offsets (n,) each."""
        slope = np.where(status == OPEN, self.parted, self.touching)
        back = status == BACK
        return slope, np.where(back, self.stiffness * np.where(back, self.backlash, 0.0), 0.0)

    def status(self, x):
        return np.where(x >= 0.0, DRIVE, np.where(x > -self.backlash, OPEN, BACK))

    def changed(self, x, status, rounding):
        """The statuses that fit x, the old ones where they do within rounding."""
        b = self.backlash
        fits = np.where(
            status == DRIVE,
            x >= -rounding,
            np.where(status == OPEN, (x <= rounding) & (x >= -b - rounding), x <= -b + rounding),
        )
        return np.where(fits, status, self.status(x))


def contact_law(stiffness, backlash) -> PieceLaw:
    """Drive and back flanks of the same stiffness, and play."""
    return PieceLaw(stiffness, np.zeros_like(stiffness), backlash, stiffness)


def solve_contact(flexibility, free, law: PieceLaw, status) -> tuple[np.ndarray, np.ndarray]:
    """Approaches and statuses (n,) with ``x + flexibility force(x) = free``.

    Parameters
    ----------
    flexibility : (n, n) array
        With a symmetric part that is not negative [m/N].
    free : (n,) array
        Approaches without the forces [m].
    law : PieceLaw
    status : (n,) int array
        First guess.

    Raises
    ------
    ConvergenceError
        No statuses fit (E-CONTACT-STATE).
    """
    for _ in range(_ROUNDS):
        x, found = _solved(flexibility, free, law, status)
        if np.array_equal(found, status):
            return x, status
        status = found
    return _across_borders(flexibility, free, law)


def _solved(flexibility, free, law, status):
    """Approaches of statuses, and the statuses that these have."""
    slope, offset = law.pieces(status)
    x = np.linalg.solve(np.eye(len(free)) + flexibility * slope, free - flexibility @ offset)
    return x, law.changed(x, status, _ROUNDING * np.abs(free).max(initial=0.0))


def _across_borders(flexibility, free, law):
    """Katzenelson's way from `free`; at a corner of several borders it begins again beside it."""
    random, size = np.random.default_rng(0), np.abs(free).max()
    for attempt in range(_STARTS):
        status = _one_way(flexibility, free, law, free + attempt * size * random.standard_normal(len(free)))
        if status is not None:
            x, found = _solved(flexibility, free, law, status)
            if np.array_equal(found, status):
                return x, status
    raise ConvergenceError(
        "no statuses of the meshes fit the end of a step", code="E-CONTACT-STATE",
        remedy="take shorter steps, or the start \"zero\"",
    )  # fmt: skip


def _one_way(flexibility, free, law, x):
    """Statuses at the end of the straight way of ``x + flexibility force(x)`` to `free`; None in a circle."""
    b, status = law.backlash, law.status(x)
    slope, offset = law.pieces(status)
    left = free - x - flexibility @ (slope * x + offset)
    for _ in range(_CROSSINGS * len(x)):
        slope = law.pieces(status)[0]
        way = np.linalg.solve(np.eye(len(x)) + flexibility * slope, left)
        down = way < 0.0
        # from a status, borders lie below, above or on both sides
        border = np.where(down, np.where(status == DRIVE, 0.0, -b), np.where(status == BACK, -b, 0.0))
        leaves = np.where(down, status != BACK, status != DRIVE) & np.isfinite(border) & (way != 0.0)
        share = np.full(len(x), np.inf)
        share[leaves] = np.maximum((border[leaves] - x[leaves]) / way[leaves], 0.0)
        first = int(np.argmin(share))
        if share[first] >= 1.0:
            return status
        x, left = x + share[first] * way, (1.0 - share[first]) * left
        x[first] = border[first]
        status[first] += 1 if down[first] else -1
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
    """Steps of meshes that separate, beside the tangent that the free motion takes."""

    def __init__(self, backlash):
        from scipy.linalg.lapack import dgesv

        self.backlash, self.dgesv = backlash, dgesv
        self.tries = _FEW
        self._take(np.full(len(backlash), DRIVE))

    def _take(self, status) -> None:
        """Keep a status, and the approaches from `least` to `most` that fit it."""
        b, back = self.backlash, status == BACK
        self.status, self.all_closed = status, not status.any()
        self.touches = (status != OPEN).astype(float)
        self.pushed = np.where(back, b, 0.0)
        self.least = np.where(status == DRIVE, 0.0, np.where(back, -np.inf, -b))
        self.most = np.where(status == DRIVE, np.inf, np.where(back, -b, 0.0))

    def march(self, scheme: Scheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
        """As `march_closed`, with the status of every mesh."""
        i, stop = steps.start, steps.stop
        while i < stop:
            if self.all_closed:
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
        """Steps until the first drive flank parts."""
        at, n = 2 * scheme.n, scheme.n
        z = rows[steps.start + 1 : steps.stop + 1, 0]
        x = z[:, :n] @ scheme.basic - z[:, at:] @ scheme.flexibility.T
        approach = np.einsum("tmj,tm->tj", meshes.selection[steps.start : steps.stop], x)
        parted = (approach < 0.0).any(axis=1)
        return int(np.argmax(parted)) if parted.any() else len(z)

    def _step(self, scheme, i, meshes, loads, rows) -> None:
        after, S = rows[i + 1], meshes.selection[i]
        np.dot(rows[i], scheme.advance, out=after)
        after[0] += loads[i]
        drawn = after[:, 2 * scheme.n :]
        drawn[:] = np.dot(self._forces(meshes, i, np.dot(drawn, S)), S.T)

    def _forces(self, meshes, i, free):
        """Forces and their tangents (2, n_meshes) from the approaches (2, n_meshes) without them."""
        forces, x = self._solved(meshes, i, free)
        if ((x >= self.least) & (x <= self.most)).all():
            return forces
        if not np.isfinite(free).all():
            return np.full_like(free, np.nan)
        law = contact_law(meshes.stiffness[i], self.backlash)
        found = law.changed(x, self.status, _ROUNDING * np.abs(free[0]).max())
        if np.array_equal(found, self.status):
            return forces
        self._take(solve_contact(meshes.turned[i].T, free[0], law, found)[1])
        return self._solved(meshes, i, free)[0]

    def _solved(self, meshes, i, free):
        """Forces and tangents of the present statuses, and the approaches (n_meshes,) that they lead to."""
        k, turned = meshes.stiffness[i], meshes.turned[i]
        slope = k * self.touches
        inner = turned * slope
        inner.ravel()[:: len(k) + 1] += 1.0
        right = slope * free
        right[0] += k * self.pushed
        # rows in C order are columns in that of Fortran: nothing is copied
        forces = self.dgesv(inner.T, right.T, overwrite_a=True, overwrite_b=True)[2].T
        return forces, free[0] - np.dot(forces[0], turned)
