"""Gear meshes whose directions turn with a carrier, and the coordinates of planets that let all else stand still.

The planets of a set meet what stands still at places that move. N equal, equally spaced planets, N = 3 or more, have
motions ``x`` along their own axes (radial, tangential, z) that are waves around the carrier. With the angle theta of
the carrier from where it stood,

    x_j = sum_k D_jk(theta) y_k,     D = exp(theta Gamma),     Gamma_jk = -(2/N) sin(psi_j - psi_k)

takes the waves of order one, which lateral motions and tilts of sun, carrier and ring have at the planets, out of the
turning frame: with the coordinates y, which are x where the carrier stood, all of a structure on any uneven supports
is constant but the directions of the meshes (the multi-blade coordinates of R. P. Coleman and A. M. Feingold, NACA
Report 1351, 1958). Waves of other orders are of the planets alone and stay in the turning frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from femgear.errors import CaseError
from femgear.system.force_laws import positive_part
from femgear.system.fourier import FourierSeries, Series, constant

_RANK = 1e-11
"""Direction over the largest that counts as none."""
_EQUAL = 1e-6
"""Angle [rad] by which planets may miss their equal spacing."""


@dataclass(frozen=True)
class TurningDirections:
    """Approach of g flanks along motions that turn with a carrier: ``fixed + cos theta even + sin theta odd``.

    Parameters
    ----------
    fixed, even, odd : (g, n) arrays
        Per unit of n motions [1, m].
    """

    fixed: np.ndarray
    even: np.ndarray
    odd: np.ndarray

    def at(self, angle: float) -> np.ndarray:
        """Approach (g, n) per unit of the motions with the carrier at an angle [rad]."""
        return self.fixed + np.cos(angle) * self.even + np.sin(angle) * self.odd

    @property
    def stacked(self) -> np.ndarray:
        """All three parts (3g, n), one after the other."""
        return np.vstack([self.fixed, self.even, self.odd])

    def along(self, motions: np.ndarray) -> TurningDirections:
        """Take these directions per unit of m coordinates, of which ``motions`` (n, m) are the motions."""
        return TurningDirections(self.fixed @ motions, self.even @ motions, self.odd @ motions)

    def on(self, columns: np.ndarray) -> TurningDirections:
        """Express these directions, which lie in the span of some columns (n, d), by them: (g, d) each."""
        parts = np.linalg.lstsq(columns, self.stacked.T, rcond=None)[0].T
        return TurningDirections(*np.split(parts, 3))


@dataclass(frozen=True)
class TurningMeshes:
    """Flanks with ``F = force + k (S x - deflection)``, of which those that part have ``max(F, 0)``.

    ``S = fixed + cos theta even + sin theta odd`` takes from the deflections of d columns the approach of every
    flank.

    Parameters
    ----------
    columns : (g, d) int array
        Columns of ``W`` that every flank takes part in.
    fixed, even, odd : (g, d) arrays
        See `TurningDirections`.
    wave : FourierSeries
        Cosine and sine of the angle theta of the carrier, from `femgear.system.force_laws.turning_wave`.
    stiffness : FourierSeries or SummedSeries
        ``k`` (g,) [N/m].
    deflection, force : FourierSeries or SummedSeries, optional
        State (g,) about which the flanks are linear [m, N]; zero where not given.
    separates : bool
        Whether the flanks part.
    """

    columns: np.ndarray
    fixed: np.ndarray
    even: np.ndarray
    odd: np.ndarray
    wave: FourierSeries
    stiffness: Series
    deflection: Series | None = None
    force: Series | None = None
    separates: bool = False

    def __post_init__(self):
        for name in ("deflection", "force"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, constant(np.zeros(len(self.columns))))

    @property
    def degree(self) -> int | None:
        """Degree of the law in the deflections; None where flanks part."""
        return None if self.separates else 1

    @property
    def reference(self) -> np.ndarray:
        """Mean stiffness of the columns by themselves (g, d) [N/m]."""
        square = self.fixed**2 + 0.5 * (self.even**2 + self.odd**2)
        return self.stiffness.mean[:, None] * square

    def steepest(self, theta) -> np.ndarray:
        """Find a bound of the stiffness (g, d) [N/m] of the columns over the phases theta (n, n_bases) [rad]."""
        reach = np.abs(self.fixed) + np.hypot(self.even, self.odd)
        # of all columns at once
        return self.stiffness.at(theta).max(axis=0)[:, None] * reach * reach.sum(axis=1, keepdims=True)

    def _lines(self, x, theta) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Directions (..., g, d), stiffness [N/m] and linear force (..., g) [N]."""
        assert self.deflection is not None and self.force is not None
        turn = np.asarray(self.wave.at(theta))
        c, s = turn[..., 0, None, None], turn[..., 1, None, None]
        S, k = self.fixed + c * self.even + s * self.odd, self.stiffness.at(theta)
        return S, k, self.force.at(theta) + k * ((S * x).sum(axis=-1) - self.deflection.at(theta))

    def forces(self, x, theta) -> np.ndarray:
        """Compute the force (..., g) [N] of every flank at deflections x (..., g, d) of the columns [m]."""
        line = self._lines(x, theta)[2]
        return positive_part(line)[0] if self.separates else line

    def switches(self, x, theta) -> np.ndarray:
        """Compute the linear forces (..., g) [N], whose signs tell which flanks touch; none of a linear law."""
        if not self.separates:
            return np.zeros((*np.shape(x)[:-2], 0))
        return self._lines(x, theta)[2]

    def frozen(self, x, theta, closed) -> tuple[np.ndarray, np.ndarray]:
        """Compute forces (g, d) [N] and tangents (g, d, d) [N/m] with the flanks closed (g,) as given."""
        S, k, line = self._lines(x, theta)
        touching = closed.astype(float) if self.separates else np.ones(len(S))
        return _on_columns(S, touching * line, touching * k)

    def evaluate(self, x, theta) -> tuple[np.ndarray, np.ndarray]:
        """Compute forces (..., g, d) [N] and tangents (..., g, d, d) [N/m], see `femgear.system.force_laws.Element`."""
        S, k, line = self._lines(x, theta)
        if not self.separates:
            return _on_columns(S, line, np.broadcast_to(k, line.shape))
        force, closed = positive_part(line)
        return _on_columns(S, force, k * closed)

    def evaluate_together(self, x, theta) -> tuple[np.ndarray, np.ndarray]:
        """Compute the sums over all flanks: forces (..., d) [N] and tangents (..., d, d) [N/m], at x (..., d) [m].

        All flanks have the same columns.
        """
        S, k, line = self._lines(x[..., None, :], theta)
        force, slope = line, np.broadcast_to(k, line.shape)
        if self.separates:
            force, closed = positive_part(line)
            slope = k * closed
        turned = np.swapaxes(S, -1, -2)
        return (turned @ force[..., None])[..., 0], turned @ (slope[..., None] * S)


def _on_columns(S: np.ndarray, force: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces (..., g, d) and tangents (..., g, d, d) on the columns of flanks along S (..., g, d)."""
    return force[..., None] * S, slope[..., None, None] * S[..., :, None] * S[..., None, :]


def independent_directions(directions: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Choose of directions (g, n) as few as span them all: (n, d) columns.

    Motions n count by their ``mass`` (n, n): a direction is large where a force along it moves much.
    """
    root = linalg.cholesky(mass, lower=True)
    mobile = linalg.solve_triangular(root, directions.T, lower=True)
    _, triangle, order = linalg.qr(mobile, mode="economic", pivoting=True)  # type: ignore[misc]
    size = np.abs(np.diag(triangle))
    rank = int(np.count_nonzero(size > _RANK * size.max(initial=0.0))) if len(size) else 0
    return directions[np.sort(order[:rank])].T


def turned_row(row: np.ndarray) -> np.ndarray:
    """Turn the approach (..., 6) per unit of the motions of a place on the axis by a quarter of a turn, to (..., 6)."""
    turned = np.zeros_like(row)
    for first in (0, 3):
        turned[..., first], turned[..., first + 1] = -row[..., first + 1], row[..., first]
    return turned


def planet_wave_generator(angles) -> np.ndarray:
    """Compute Gamma (N, N) of the waves of order one of planets at angles [rad], see the head of this module.

    CaseError: fewer than three planets, or unequal spaces between them (E-TURNING).
    """
    psi = np.asarray(angles, float)
    N = len(psi)
    spacing = np.sort((psi - psi[0] + _EQUAL) % (2.0 * np.pi)) - _EQUAL
    if N < 3 or np.abs(spacing - 2.0 * np.pi * np.arange(N) / N).max() > _EQUAL:
        raise CaseError(
            f"{N} planets at {', '.join(f'{angle:g}' for angle in np.degrees(psi))} deg make masses and springs depend"
            " on the angle of their carrier",
            code="E-TURNING",
            limit="three planets or more, equally spaced, or a carrier that stands still",
            remedy="space the planets equally, or hold the carrier",
        )
    return -2.0 / N * np.sin(psi[:, None] - psi)


def planet_waves(angles) -> TurningDirections:
    """Make ``D`` (N, N) of the head of this module from the angles of the planets [rad].

    CaseError: see `planet_wave_generator`.
    """
    psi, odd = np.asarray(angles, float), planet_wave_generator(angles)
    even = 2.0 / len(psi) * np.cos(psi[:, None] - psi)
    return TurningDirections(np.eye(len(psi)) - even, even, odd)
