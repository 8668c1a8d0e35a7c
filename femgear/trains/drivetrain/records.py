"""Records of a run: every few steps, low-passed before they are thinned out, and extremes of all steps."""

from __future__ import annotations

import numpy as np

from femgear.trains.drivetrain.model import DrivetrainModel

# The pass band ends at this share of half the record rate, where the stop band begins.
PASS_BAND = 0.8
# Attenuation of the stop band [dB].
_STOP = 80.0


class Decimator:
    """Low pass and decimation of columns that come in blocks, without delay.

    A linear-phase filter (Kaiser window; J. F. Kaiser and R. W. Schafer, IEEE Trans. Acoust. Speech Signal
    Process. 28, 1980, 105-107) with 80 dB between 0.8 and 1.0 of half the record rate. Beyond both ends the
    columns go on as their mirror image about a ramp. Its slope is that of the parabola of least squares
    through two records (A. Savitzky and M. J. E. Golay, Anal. Chem. 36, 1964, 1627-1639), so that constants
    and ramps pass unchanged. Near an end both bands suffer. Of a tone at 0.1, 0.3 and 0.5 times half the
    record rate the end record misses 0.2, 5 and 20 % (r.m.s. over its phases), of one at 2, 6 and 12 times
    it keeps 36, 11 and 7 %; the next three keep 5 % and less.

    Parameters
    ----------
    every : int
        Steps a record; 1 passes everything.
    count : int
        Steps in all; rows 0 to `count` come.
    """

    def __init__(self, every: int, count: int):
        from scipy.signal import firwin, kaiserord

        self.every, self.count, self.seen = every, count, 0
        self.rows = count // every + 1
        length, beta = kaiserord(_STOP, (1.0 - PASS_BAND) / every)
        # the continuation needs as many rows as it adds
        half = min(length // 2, count) if every > 1 else 0
        self.half = half
        middle = 0.5 * (1.0 + PASS_BAND) / every
        window = ("kaiser", beta)
        self.weights = firwin(2 * half + 1, middle, window=window) if half else np.ones(1)  # type: ignore
        self.slope = _end_slope(min(half, 2 * every)) if half else np.zeros(1)
        self.buffer, self.first, self.done = np.zeros((0, 0)), 0, 0

    def push(self, rows) -> np.ndarray:
        """Records (k, c) that become complete with further rows (n, c)."""
        rows = np.asarray(rows, float)
        self.buffer = np.vstack([self.buffer, rows]) if self.seen else rows.copy()
        self.seen += len(rows)
        half, last = self.half, self.seen == self.count + 1
        if self.done == 0 and self.first == 0:
            if len(self.buffer) <= half and not last:
                return np.empty((0, rows.shape[1]))
            ahead = self._mirrored(self.buffer[: half + 1])
            self.buffer, self.first = np.vstack([ahead[::-1], self.buffer]), -half
        if last and half:
            self.buffer = np.vstack([self.buffer, self._mirrored(self.buffer[-1 - half :][::-1])])
        return self._filtered()

    def _mirrored(self, rows) -> np.ndarray:
        """Rows (half, c) beyond the end at which `rows` (half + 1, c) begin."""
        slope = self.slope @ (rows[: len(self.slope)] - rows[0])
        return rows[1:] - 2.0 * np.outer(np.arange(1, len(rows)), slope)

    def _filtered(self) -> np.ndarray:
        """Records whose whole window is in the buffer."""
        from scipy.signal import upfirdn

        reach = self.first + len(self.buffer) - 1 - self.half
        stop = min(reach // self.every + 1, self.rows)
        if stop <= self.done:
            return np.empty((0, self.buffer.shape[1]))
        begin, number = self.done * self.every - self.half - self.first, stop - self.done
        wanted = self.buffer[begin : begin + (number - 1) * self.every + 2 * self.half + 1]
        # only every so many values of the convolution are computed: the padding makes the first one of them
        pad = -2 * self.half % self.every
        padded = np.vstack([np.zeros((pad, wanted.shape[1])), wanted])
        start = (2 * self.half + pad) // self.every
        found = upfirdn(self.weights, padded, down=self.every, axis=0)[start : start + number]
        self.done = stop
        keep = max(stop * self.every - self.half - self.first, 0)
        self.buffer, self.first = self.buffer[keep:].copy(), self.first + keep
        return found


def _end_slope(steps: int) -> np.ndarray:
    """Weights (steps + 1,) of rows for the slope, at the first one, of their parabola; of a line for two."""
    from scipy.signal import savgol_coeffs

    weights = savgol_coeffs(steps + 1, min(2, steps), deriv=1, pos=0, use="dot")
    # ramps exactly, whatever the least squares round
    return weights / (weights @ np.arange(steps + 1.0))


class Record:
    """What a run keeps: coordinates, meshes, spin."""

    def __init__(
        self, model: DrivetrainModel, count: int, at, *, every: int, lowpass: bool, contact_loss: bool
    ):
        self.every, self.at = every, at
        self.contacts = model.contacts if contact_loss else None
        self.basic = (self.contacts or model).geometry.basic
        rows, meshes = count // self.every + 1, len(model.meshes)
        widths = [len(at), len(at), meshes, meshes, 1, 1]
        self.cuts = np.cumsum(widths)[:-1]
        self.table = np.empty((rows, sum(widths)))
        self.decimator = Decimator(self.every, count) if lowpass and self.every > 1 else None
        self.filled, self.steps = 0, 0
        self.extremes = np.array([np.full(meshes, np.inf), np.full(meshes, -np.inf)])
        self.pulled, self.lost = np.zeros((2, meshes))

    def take(self, first: int, states, block) -> None:
        """Rows of the states and the `Block` of some steps; that of their start with the first one alone."""
        begin = min(first, 1)
        approach = np.einsum("tmj,tm->tj", block.selection, states[:, : len(self.basic)] @ self.basic)
        force, touched = block.stiffness * approach, np.ones((1, 1), bool)
        if self.contacts is not None:
            force, touched = self.contacts.mesh_forces(approach, block.stiffness)
            approach = approach[:, : force.shape[1]]
        self._count(force[begin:], touched[begin:])
        if self.decimator is None:
            at = (-first % self.every) or self.every if first else 0
            kept = slice(at, None, self.every)
        else:
            kept = slice(begin, None)
        n = len(self.basic)
        motion, velocity = states[kept, :n][:, self.at], states[kept, n : 2 * n][:, self.at]
        spin = block.angle[kept, None], block.speed[kept, None]
        new = np.hstack([motion, velocity, approach[kept], force[kept], *spin])
        if self.decimator is not None:
            new = self.decimator.push(new)
        self.table[self.filled : self.filled + len(new)] = new
        self.filled += len(new)

    def _count(self, force, touched) -> None:
        self.extremes[0] = np.minimum(self.extremes[0], force.min(axis=0, initial=np.inf))
        self.extremes[1] = np.maximum(self.extremes[1], force.max(axis=0, initial=-np.inf))
        self.pulled += np.count_nonzero(force < 0.0, axis=0)
        self.lost += np.count_nonzero(~touched, axis=0)
        self.steps += len(force)

    def columns(self, step: float) -> dict[str, np.ndarray]:
        """Arrays of a `DrivetrainRun`."""
        *tables, angle, speed = np.split(self.table, self.cuts, axis=1)
        names = ("motion", "velocity", "approach", "force")
        return {
            **{name: np.ascontiguousarray(one) for name, one in zip(names, tables)},
            "time": step * self.every * np.arange(len(self.table)),
            "spin": angle[:, 0].copy(),
            "spin_speed": speed[:, 0].copy(),
            "extremes": self.extremes,
            "pulling": self.pulled / self.steps,
            "lost": self.lost / self.steps,
        }
