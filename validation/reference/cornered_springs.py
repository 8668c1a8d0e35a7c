"""Springs with corners: piecewise linear laws, and bearings of a number of one-sided springs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from femgear.errors import CaseError
from femgear.system.force_laws import RadialBearings, _columns, _numbers, _positive, positive_part


@dataclass(frozen=True)
class PiecewiseSprings:
    """Continuous piecewise linear springs without force at ``x = 0``.

    Parameters
    ----------
    columns : (g,) int array
    breaks : (m,) array
        Ascending deflections where the slope changes [m].
    slopes : (m + 1,) array
        Slopes below, between and above the breaks [N/m].
    smoothing : float
        Length over which a slope changes [m], see `positive_part`; the force at rest stays zero.
    """

    columns: np.ndarray
    breaks: np.ndarray
    slopes: np.ndarray
    smoothing: float = 0.0

    def __post_init__(self):
        columns = _columns(self.columns, 1)
        breaks, slopes = np.atleast_1d(_numbers(self.breaks, "breaks")), _numbers(self.slopes, "slopes")
        if not (np.all(np.isfinite(breaks)) and np.all(np.isfinite(slopes))):
            raise CaseError(
                f"breaks {breaks.tolist()} with slopes {slopes.tolist()}",
                code="E-FINITE",
                limit="finite numbers",
            )
        if len(slopes) != len(breaks) + 1 or np.any(np.diff(breaks) <= 0.0):
            raise CaseError(
                f"{len(slopes)} slopes with breaks {breaks.tolist()}",
                code="E-SHAPE",
                limit="ascending breaks and one more slope than breaks",
            )
        _positive("smoothing length", self.smoothing)
        for name, value in (("columns", columns), ("breaks", breaks), ("slopes", slopes)):
            object.__setattr__(self, name, value)

    @property
    def reference(self) -> np.ndarray:
        """Mean of the lowest and the highest slope, (g, 1) [N/m]."""
        return np.full((len(self.columns), 1), 0.5 * (self.slopes.min() + self.slopes.max()))

    def evaluate(self, x, theta):
        """Forces (..., g, 1) and tangents (..., g, 1, 1)."""
        x = x[..., 0]
        change = np.diff(self.slopes)
        part, slope = positive_part(x[..., None] - self.breaks, self.smoothing)
        rest, _ = positive_part(-self.breaks, self.smoothing)
        force = self.slopes[0] * x + (part - rest) @ change
        return force[..., None], (self.slopes[0] + slope @ change)[..., None, None]

    def steepest(self, theta) -> np.ndarray:
        """Largest slope, (g, 1) [N/m]."""
        return np.full((len(self.columns), 1), self.slopes.max())

    def switches(self, x, theta):
        """Deflections beyond the breaks (..., g m)."""
        return np.zeros((*x.shape[:-2], 0)) if self.smoothing else (x - self.breaks).reshape(*x.shape[:-2], -1)

    def frozen(self, x, theta, closed):
        """Forces (g, 1) and tangents (g, 1, 1) beyond the breaks as given."""
        change, closed = np.diff(self.slopes), closed.reshape(len(self.columns), -1)
        rest = np.maximum(-self.breaks, 0.0) @ change
        force = self.slopes[0] * x[:, 0] + ((x - self.breaks) * closed) @ change - rest
        return force[:, None], (self.slopes[0] + closed @ change)[:, None, None]


@dataclass(frozen=True)
class BearingSprings(RadialBearings):
    """Bearings with radial clearance and ``springs`` one-sided radial springs ``4 k / n``, the first on x.

    Other parameters as for `RadialBearings`, the limit of infinitely many springs.

    Parameters
    ----------
    springs : int
    smoothing : float
        Length over which a spring sets in [m].
    """

    springs: int = 3
    smoothing: float = 0.0
    directions: np.ndarray = field(init=False)

    def __post_init__(self):
        super().__post_init__()
        _positive("smoothing length", self.smoothing)
        if self.springs < 3:
            raise CaseError(f"a bearing of {self.springs} springs", code="E-BEARING", key="springs", limit="3 or more")
        angle = 2.0 * np.pi * np.arange(self.springs) / self.springs
        object.__setattr__(self, "directions", np.stack([np.cos(angle), np.sin(angle)], axis=1))

    @property
    def each(self) -> np.ndarray:
        """Stiffness of a spring (g, 1) [N/m]."""
        return 4.0 * np.asarray(self.stiffness)[:, None] / self.springs

    def _overlaps(self, x) -> np.ndarray:
        return x @ self.directions.T - np.asarray(self.clearance)[:, None]

    def evaluate(self, x, theta):
        """Forces (..., g, 2) and tangents (..., g, 2, 2)."""
        force, slope = positive_part(self._overlaps(x), self.smoothing)
        tangents = np.einsum("...gs,si,sj->...gij", self.each * slope, self.directions, self.directions)
        return (self.each * force) @ self.directions, tangents

    def switches(self, x, theta):
        """Overlaps of the springs (..., g n) [m]."""
        return np.zeros((*x.shape[:-2], 0)) if self.smoothing else self._overlaps(x).reshape(*x.shape[:-2], -1)

    def frozen(self, x, theta, closed):
        """Forces (g, 2) and tangents (g, 2, 2) with the springs closed as given."""
        each = self.each * closed.reshape(len(self.columns), -1)
        tangents = np.einsum("gs,si,sj->gij", each, self.directions, self.directions)
        return (each * self._overlaps(x)) @ self.directions, tangents
