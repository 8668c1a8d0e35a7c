"""Records of a run that are thinned out behind a low pass, so that nothing beyond half their rate folds back."""

from __future__ import annotations

import numpy as np

PASS_BAND = 0.8
"""End of the pass band over half the record rate, where the stop band begins."""
_STOP = 80.0
"""Attenuation of the stop band [dB]."""


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
        from scipy.signal import firwin, kaiserord, savgol_coeffs

        self.every, self.count, self.seen = every, count, 0
        self.rows = count // every + 1
        length, beta = kaiserord(_STOP, (1.0 - PASS_BAND) / every)
        # the continuation needs as many rows as it adds
        half = min(length // 2, count) if every > 1 else 0
        self.half = half
        middle = 0.5 * (1.0 + PASS_BAND) / every
        window = ("kaiser", beta)
        self.weights = firwin(2 * half + 1, middle, window=window) if half else np.ones(1)  # type: ignore
        # of rows for the slope, at the first one, of their parabola; of a line for two
        steps = min(half, 2 * every)
        slope = savgol_coeffs(steps + 1, min(2, steps), deriv=1, pos=0, use="dot") if half else np.zeros(1)
        # ramps exactly, whatever the least squares round
        self.slope = slope / (slope @ np.arange(steps + 1.0)) if half else slope
        self.buffer, self.first, self.done = np.zeros((0, 0)), 0, 0

    def push(self, rows) -> np.ndarray:
        """Take further rows (n, c), and give the records (k, c) that become complete with them."""
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
        reach = self.first + len(self.buffer) - 1 - self.half
        stop = min(reach // self.every + 1, self.rows)
        if stop <= self.done:
            return np.empty((0, self.buffer.shape[1]))
        begin, number = self.done * self.every - self.half - self.first, stop - self.done
        wanted = self.buffer[begin : begin + (number - 1) * self.every + 2 * self.half + 1]
        filtered = _weighted(wanted, self.weights, self.every)
        self.done = stop
        keep = max(stop * self.every - self.half - self.first, 0)
        self.buffer, self.first = self.buffer[keep:].copy(), self.first + keep
        return filtered


def _weighted(rows, weights, every: int) -> np.ndarray:
    """Sums (k, c) of rows (n, c) weighted (w,) from every so many of them on, as far as the rows go.

    Rows in groups of ``every`` are weighted by products of matrices, whose parts then add up.
    """
    number, groups = (len(rows) - len(weights)) // every + 1, -(-len(weights) // every)
    filled = np.zeros(((number - 1 + groups) * every, rows.shape[1]))
    filled[: min(len(rows), len(filled))] = rows[: len(filled)]
    by_group = np.pad(weights, (0, groups * every - len(weights))).reshape(groups, every)
    parts = by_group @ filled.reshape(-1, every, rows.shape[1])
    along, across, column = parts.strides
    shape, strides = (number, groups, rows.shape[1]), (along, along + across, column)
    return np.lib.stride_tricks.as_strided(parts, shape, strides).sum(axis=1)
