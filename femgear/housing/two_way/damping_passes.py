"""Forces of the damping of a set, pass by pass, until they are those of the motion that they make.

Without the fluctuation of the mesh stiffness the blocks of the two-way response
(`femgear.housing.two_way.harmonic_blocks`) know nothing of one another. Under forces e beyond the mean stiffness that
are held, damping and motion of every block are brought together in sweeps of its own, few of most blocks and
many at a resonance; solutions for e in between therefore are few, and blocks that they hardly change wait.
Only a pass of all blocks tells that nothing changes any more.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femgear.housing.two_way.harmonic_blocks import HarmonicBlocks
from femgear.housing.two_way.set_damping import DampingForces, SetDamping

_MIXED, _SWEEPS = 3, 2
"""Sweeps that are extrapolated together; sweeps of one pass after its first one, at most."""
_EXPECTED, _WAITING, _UNSETTLED, _SLOW = 0.2, 0.03, 0.06, 0.5
"""Part of its change that a sweep leaves to a block before it is known; part of all changes that may wait for
the next pass, and that a pass may leave; change over that of the pass before from which on passes are
extrapolated together, those of all blocks as one."""
_SINGLE, _LEAST, _STILL, _TINY = 1e-7, 1e-2, 1e-12, np.finfo(float).tiny
"""Accuracy of the forces of the damping in single precision; what a sweep leaves at least; part of its change
up to which the forces of a block stood still; what no norm is below."""
_AXES = (0, 0, 1, 1)
"""Axes of the blocks in the parts of the forces."""


class DampingPasses:
    """Forces of the damping at one speed, for the next solution.

    Parameters
    ----------
    damping : SetDamping
        Of the set beyond modal damping.
    blocks : HarmonicBlocks
        Equations at this speed.
    """

    def __init__(self, damping: SetDamping, blocks: HarmonicBlocks):
        self.damping, self.blocks, self._load = damping, blocks, blocks.load()
        self.forces, self._made = damping.none(len(blocks.place)), list[DampingForces]()
        self._answers = damping.receptances(blocks)
        shape = self.forces.still.shape
        self._seen, self._changes = np.zeros(shape, complex), np.zeros((_MIXED, *shape), complex)
        # of every block: what its change is of that of its mesh forces, what a sweep leaves of it, what is
        # left, sweeps under one e
        self._ratio, self._left, self._count = np.zeros(shape[1]), np.zeros(shape[1]), np.zeros(shape[1], int)
        self._rate = np.full(shape[1], _EXPECTED)
        self._before, self._together = np.inf, False

    @property
    def moved(self) -> tuple[np.ndarray, np.ndarray]:
        """Deflections d_0 (J, B, R) of the meshes by load and damping, u_0 (G, B, R) of the ring by damping [m]."""
        return self._load + self.forces.still, self.forces.way

    def drag(self) -> np.ndarray:
        """Forces (B, S, m) on all modes of the structure."""
        return self.damping.on_all_modes(self._made[0].on_structure)

    def follow(self, motion: tuple[np.ndarray, ...], enough: float) -> tuple[float, bool]:
        """Follow a motion: forces e (J, B, R), u (G, B, R) and mesh forces f (J, B, R) of a solution.

        Norm of the changes of mesh forces by what it makes of the damping [N], and whether all blocks were
        asked; they are at the latest where changes of ``enough`` are expected.
        """
        force = motion[2]
        moved = _of_blocks(force - self._seen)
        expected = self._left + self._ratio * moved
        changed = _largest(expected, _WAITING * max(float(np.linalg.norm(expected)), enough))
        first = not self._made
        whole = first or self._together or np.linalg.norm(expected) <= enough
        if whole:
            changed = np.arange(len(expected))
        if not self._together:
            self._count[:] = 0
        self._seen[:, changed] = force[:, changed]
        expected[changed] = changes = self._sweep(motion, changed)
        # blocks whose forces stood still tell nothing of what a change of them makes
        moving = moved[changed] > _STILL * changes
        ratio = np.divide(changes, moved[changed], out=np.zeros(len(changed)), where=moving)
        self._ratio[changed] = np.maximum(self._ratio[changed], ratio)
        change = float(np.linalg.norm(expected))
        if first and enough > _SINGLE * change:
            self._be_single()
        self._together |= change > _SLOW * self._before and not first
        self._before = change
        if not self._together and not (whole and change <= enough):
            self._settle(motion, changed, _UNSETTLED * max(change, enough))
        return change, bool(whole)

    def _settle(self, motion, numbers: np.ndarray, limit: float) -> None:
        """Sweep through those of some blocks that have more than a limit left, e being held."""
        extra, way, force = motion[0], motion[1].copy(), motion[2].copy()
        for _ in range(_SWEEPS):
            now = numbers[_largest(self._left[numbers], limit)]
            if not len(now):
                break
            part, (load, given) = self.blocks.part(now), self.moved
            deflection, way[:, now] = part.deflections(extra[:, now], load[:, now], given[:, now])
            force[:, now] = part.forces(extra[:, now], deflection, way[:, now])
            self._sweep((extra, way, force), now)

    def _sweep(self, motion, numbers: np.ndarray) -> np.ndarray:
        """Answer a motion in some blocks, and extrapolate; norms (b,) of the changes of mesh forces."""
        at: Any = slice(None) if len(numbers) == len(self._left) else numbers
        if not self._made:
            self._made = [self.damping.none(len(self.blocks.place)) for _ in range(_MIXED)]
        if self._count[numbers].any():
            for newer, older in ((1, 2), (0, 1)):
                _put(self._made[older], self._made[newer], at)
                self._changes[older][:, at] = self._changes[newer][:, at]
        made, G = self._made[0], len(self.blocks.place)
        self.damping.answer(self.blocks, self._answers, motion, self.forces, made, at if at is numbers else None)
        changes = (made.still[:, at] - self.forces.still[:, at]).astype(complex)
        changes[G:] -= made.way[:, at] - self.forces.way[:, at]
        changes *= self.blocks.gears.mean[:, None, None]
        self._changes[0][:, at] = changes
        self._count[numbers] += 1
        self._blend(at, _shares(self._changes[:, :, at], self._count[numbers], self._together))
        norms = _of_blocks(changes)
        again = self._count[numbers] > 1
        rate = norms[again] / np.maximum(self._left[numbers][again], _TINY) * self._rate[numbers][again]
        self._rate[numbers[again]] = np.clip(rate, _LEAST, 1.0)
        self._left[numbers] = self._rate[numbers] * norms
        return norms

    def _blend(self, at, shares: np.ndarray) -> None:
        """Blend sweeps of blocks by shares (n, b) of them."""
        for axis, total, *parts in zip(_AXES, self.forces.parts, *(pass_.parts for pass_ in self._made)):
            index, real = (slice(None),) * axis + (at,), total.real.dtype
            blended = parts[0][index]
            if shares[1:].any():
                weights = shares.astype(real)
                weights = weights[..., None, None] if axis == 0 else weights[:, None, :, None]
                blended = sum(weight * part[index] for weight, part in zip(weights, parts))
            total[index] = blended

    def _be_single(self) -> None:
        """Go on in single precision."""
        self.damping = self.damping.single()
        self._answers = tuple(answer.astype(np.complex64) for answer in self._answers)
        self.forces, first = self.forces.single(), self._made[0].single()
        self._made = [first, *(_nothing_like(first) for _ in self._made[1:])]


def _largest(values: np.ndarray, limit: float) -> np.ndarray:
    """Numbers, ascending, of the largest of values (n,): those without which the norm is below a limit."""
    order = np.argsort(values)
    beyond = np.sqrt(np.cumsum(values[order] ** 2)) > limit
    return np.sort(order[beyond])


def _nothing_like(forces: DampingForces) -> DampingForces:
    """Zeros of the same shapes and precision."""
    return DampingForces(*(np.zeros_like(part) for part in forces.parts))


def _put(to: DampingForces, what: DampingForces, at) -> None:
    """Write the forces of some blocks."""
    for axis, part, other in zip(_AXES, to.parts, what.parts):
        index = (slice(None),) * axis + (at,)
        part[index] = other[index]


def _of_blocks(values: np.ndarray) -> np.ndarray:
    """Norms (B,) of the blocks of values (J, B, R)."""
    return np.sqrt(_products(values, values))


def _shares(changes: np.ndarray, count: np.ndarray, together: bool) -> np.ndarray:
    """Shares (n, b) of sweeps, one in every block, whose changes (n, J, b, R) together are least.

    D. G. Anderson, J. ACM 12 (1965) 547-560. Equations of real signals are linear over real numbers alone. Of
    the newest ones of every block by their ``count`` (b,); of all blocks together where those are one.
    """
    share = np.zeros((len(changes) - 1, len(count)))
    if (count > 1).any():
        with_more = [i for i in range(1, len(changes)) if (count > i).any()]
        steps = [(changes[0] - changes[i]) * (count > i)[:, None] for i in with_more]
        product = np.array([[_products(step, other) for other in steps] for step in steps])
        wanted = np.array([_products(step, changes[0]) for step in steps])
        if together:
            product, wanted = product.sum(axis=2, keepdims=True), wanted.sum(axis=1, keepdims=True)
        inverse = np.linalg.pinv(np.moveaxis(product, 2, 0), rcond=1e-13, hermitian=True)
        share[: len(with_more)] = (inverse @ wanted.T[..., None])[..., 0].T
    return np.concatenate([1.0 - share.sum(axis=0)[None], share])


def _products(first: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Real inner products (B,) of the blocks of values (J, B, R)."""
    return np.sum(np.real(first) * np.real(other) + np.imag(first) * np.imag(other), axis=(0, 2))
