"""Flanks as they are meshed: where they stand, how far apart they are, and pressures that both of them feel.

The pressure is piecewise linear between the corners of one flank (the slave); separations are weighted with
its hat functions (M. A. Puso, T. A. Laursen, Comput. Methods Appl. Mech. Eng. 193, 2004; linear multipliers
for quadratic elements: A. Popp, B. I. Wohlmuth, M. W. Gee, W. A. Wall, SIAM J. Sci. Comput. 34, 2012). The
integrals are taken edge by edge of the slave.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

GAUSS = 8


@dataclass(frozen=True)
class PlacedFlank:
    """A flank of curved edges in its place.

    Parameters
    ----------
    points : (2k + 1, 2) array
        Corner, mid, corner, ... in the frame of its tooth [m], the body on the left.
    angle : float
        Of the tooth's centreline [rad].
    centre : (2,) array
        Of its gear [m].
    """

    points: np.ndarray
    angle: float
    centre: np.ndarray

    @property
    def turn(self) -> np.ndarray:
        """Rotation (2, 2) from the frame of the tooth."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array([[c, -s], [s, c]])

    @property
    def placed(self) -> np.ndarray:
        """Points in their place [m]."""
        return self.points @ self.turn.T + self.centre


def on_edges(points, edge, t):
    """Points and tangents (q, 2) and shape values (3, q) at places t in 0 .. 1 on edges (q,) of a curve."""
    node = points[2 * edge[:, None] + [0, 1, 2]]
    shape = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
    slope = np.stack([4 * t - 3, 4 - 8 * t, 4 * t - 1])
    return np.einsum("iq,qic->qc", shape, node), np.einsum("iq,qic->qc", slope, node), shape


def opposite(points, x, normal):
    """Where lines through `x` (q, 2) along `normal` meet a curve: edge, place and whether they do at all."""
    along = np.column_stack([-normal[:, 1], normal[:, 0]])
    corner = points[None, 0::2] - x[:, None]
    aside = np.einsum("qkc,qc->qk", corner, along)
    away = np.abs(np.einsum("qkc,qc->qk", corner, normal))
    crosses = aside[:, :-1] * aside[:, 1:] <= 0
    meets = crosses.any(axis=1)
    # of several crossings the nearest
    edge = np.where(crosses, away[:, :-1], np.inf).argmin(axis=1)
    row = np.arange(len(x))
    first, last = aside[row, edge], aside[row, edge + 1]
    t = np.clip(first / np.where(first == last, 1.0, first - last), 0.0, 1.0)
    for _ in range(8):
        y, slope, _ = on_edges(points, edge, t)
        rate = (slope * along).sum(axis=1)
        t = np.clip(t - ((y - x) * along).sum(axis=1) / np.where(rate == 0, 1.0, rate), -0.01, 1.01)
    return edge, t, meets


def smallest_separation(slave: PlacedFlank, master: PlacedFlank) -> tuple[float, int]:
    """Smallest separation along the normals of the slave [m] and the edge of the slave where it is."""
    points = slave.placed
    edge = np.repeat(np.arange(len(points) // 2), 3)
    t = np.tile([0.0, 0.5, 1.0], len(points) // 2)
    gap, meets = _separations(points, master.placed, edge, t)[:2]
    gap = np.where(meets, gap, np.inf)
    at = int(gap.argmin())
    return float(gap[at]), int(edge[at])


def _separations(slave, master, edge, t):
    """Separations, whether there is a counterpart, and both places with normals and shape values."""
    x, tangent, shape = on_edges(slave, edge, t)
    length = np.hypot(*tangent.T)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / length[:, None]
    on_edge, on_t, meets = opposite(master, x, normal)
    for _ in range(3):
        y, along, on_shape = on_edges(master, on_edge, on_t)
        normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
        on_edge, on_t, meets = opposite(master, x, normal)
    y, _, on_shape = on_edges(master, on_edge, on_t)
    return ((y - x) * normal).sum(axis=1), meets, (x, normal, length, shape), (y, on_edge, on_shape)


@dataclass(frozen=True)
class FlankContact:
    """Mean separations and consistent nodal loads of the hats of one tooth pair.

    Parameters
    ----------
    gap : (m,) array
        Mean separation under each hat [m].
    arm : (m,) array
        Approach under each hat per unit base-circle arc of gear 1.
    width : (m,) array
        Length under each hat, the integral of the hat along the flank [m].
    slave_load, master_load : (nodes, 2, m) arrays
        Nodal forces on the points of both flanks per unit force of each hat, in the frames of their teeth.
    goes_on : (bool, bool)
        Whether both flanks go on beyond the first and beyond the last hat.
    """

    gap: np.ndarray
    arm: np.ndarray
    width: np.ndarray
    slave_load: np.ndarray
    master_load: np.ndarray
    goes_on: tuple[bool, bool]


def flank_contact(
    slave: PlacedFlank, master: PlacedFlank, near: tuple[int, int], *, drives: bool, base_radius: float
) -> FlankContact:
    """Weighted separations and loads of one tooth pair.

    Parameters
    ----------
    slave, master : PlacedFlank
    near : (int, int)
        First and last edge of the slave that may touch.
    drives : bool
        Whether the slave belongs to gear 1, which turns counter-clockwise.
    base_radius : float
        Of gear 1 [m].
    """
    first, last = near
    node, weight = np.polynomial.legendre.leggauss(GAUSS)
    edge = np.repeat(np.arange(first, last + 1), GAUSS)
    t = np.tile(0.5 * (1 + node), last + 1 - first)
    gap, meets, (x, normal, length, shape), (y, on_edge, on_shape) = _separations(slave.placed, master.placed, edge, t)
    hats = np.maximum(1.0 - np.abs((edge - first + t)[:, None] - np.arange(last - first + 2)), 0.0)
    hats *= (np.tile(0.5 * weight, last + 1 - first) * length)[:, None]
    whole = hats.sum(axis=0)
    hats *= meets[:, None]
    width = hats.sum(axis=0)
    # hats that hang over the end of the other flank by nearly all of their length are left out
    kept = width > 0.02 * whole
    share = hats[:, kept] / width[kept]
    place = (x if drives else y) - (slave.centre if drives else master.centre)
    turning = np.column_stack([-place[:, 1], place[:, 0]]) / base_radius
    arm = (turning * normal).sum(axis=1) * (1.0 if drives else -1.0)
    return FlankContact(
        gap=share.T @ gap,
        arm=share.T @ arm,
        width=width[kept],
        slave_load=_nodal(slave, edge, shape, -normal, share),
        master_load=_nodal(master, on_edge, on_shape, normal, share),
        goes_on=(first > 0 and bool(kept[0]), last < len(slave.points) // 2 - 1 and bool(kept[-1])),
    )


def _nodal(flank, edge, shape, direction, share):
    """Nodal forces (nodes, 2, m) in the frame of the tooth."""
    result = np.zeros((len(flank.points), 2, share.shape[1]))
    local = direction @ flank.turn
    for i in range(3):
        np.add.at(result, 2 * edge + i, shape[i][:, None, None] * local[:, :, None] * share[:, None, :])
    return result
