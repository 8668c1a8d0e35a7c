"""An axisymmetric elastic ring under meshes that run around in it.

Its waves ``exp(i n phi)`` know nothing of one another, so that planets which push at the order L move the wave n at
``K = L - s n`` and feel it at L again: the compliance of the ring joins the planets at one side band alone,

    u_j[L] = -sum_n a_n exp(i n psi_j) conj(a_n) H_n(K) sum_k exp(-i n psi_k) g_k[L],

where N equal planets in a pattern leave the waves with ``K + pattern`` a multiple of N. Waves of any number cost a
sum, no equations of their own. A fixed place of the ring at angle theta hears the order K by ``b_n exp(i n theta)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.housing.sensor import ReadOnlyArrays
from femgear.housing.two_way.carrier_orders import CarrierOrders


@dataclass(frozen=True)
class RunningRing(ReadOnlyArrays):
    """Modes of a ring on its foundation, each in one wave that turns; those of n > 0 stand for n and -n.

    Parameters
    ----------
    natural_frequency : (r,) array
        Of mass-normalised modes [rad/s], above zero.
    diameter : (r,) int array
        Nodal diameters n, 0 or more.
    approach : (r,) complex array
        Approach a_n of the flanks of planet-ring by a unit wave, of a planet at angle 0 [kg^-1/2].
    surface : (r, 2) complex array
        Radial (outwards) and tangential displacement b_n of the outer surface at angle 0 by a unit wave [kg^-1/2].
    loss : float
        Loss factor of the ring [1].
    sliding : (2, r) complex array, optional
        What friction of a planet at angle 0 moves by a unit wave: sliding along the tangent [kg^-1/2], and turning
        [rad m^-1 kg^-1/2].
    """

    natural_frequency: np.ndarray
    diameter: np.ndarray
    approach: np.ndarray
    surface: np.ndarray
    loss: float = 0.0
    sliding: np.ndarray | None = None

    @property
    def waves(self) -> tuple[np.ndarray, np.ndarray]:
        """Circumferential orders n (w,) of all waves, below zero too, and the modes (w,) that they are of."""
        both = np.flatnonzero(self.diameter > 0)
        return np.concatenate([self.diameter, -self.diameter[both]]), np.concatenate([np.arange(len(self)), both])

    def __len__(self) -> int:
        return len(self.diameter)

    def of_waves(self, values: np.ndarray) -> np.ndarray:
        """Values (w, ...) of all waves from those of the modes (r, ...): the conjugates of waves -n."""
        order, mode = self.waves
        chosen = values[mode]
        return np.where((order < 0).reshape(-1, *[1] * (values.ndim - 1)), chosen.conj(), chosen)

    def receptance(self, omega: np.ndarray) -> np.ndarray:
        """Receptances (..., w) [s^2] of the waves at angular frequencies (..., w)."""
        stiffness = self.natural_frequency[self.waves[1]] ** 2 * (1.0 + 1j * self.loss * np.sign(omega))
        return 1.0 / (stiffness - np.asarray(omega) ** 2)


def _met(ring: RunningRing, orders: CarrierOrders, blocks, band: np.ndarray) -> np.ndarray:
    """Whether waves take part (B, b, w): planets in a pattern cancel in all others."""
    order, N = ring.waves[0], orders.paths.symmetry
    whole = (orders.base + orders.pattern)[blocks][:, None] + band
    return (whole[..., None] - orders.sense * order) % N == 0


def ring_compliance(
    ring: RunningRing,
    orders: CarrierOrders,
    blocks,
    band: np.ndarray,
    angles: np.ndarray,
    speeds: tuple[float, float],
    pushed: np.ndarray,
) -> np.ndarray:
    """Compute compliances (B, b, G, G) of a ring at the meshes of leading planets by forces at these [m/N].

    Parameters
    ----------
    ring : RunningRing
    orders : CarrierOrders
        Of the forces.
    blocks : (B,) int array
        Numbers of the blocks.
    band : (b,) int array
        Side bands of the forces.
    angles : (G,) array
        Of the leading planets [rad].
    speeds : two floats
        Mesh frequency and speed of the carrier [rad/s].
    pushed : (r,) complex array
        What the forces move by a unit wave of every mode: ``approach`` of those of the meshes, ``sliding`` of friction.
    """
    omega, order = _angular(ring, orders, blocks, band, speeds), ring.waves[0]
    amplitude = ring.of_waves(ring.approach) * ring.of_waves(pushed).conj()
    weight = np.where(_met(ring, orders, blocks, band), ring.receptance(omega) * amplitude, 0.0)
    around = np.exp(1j * np.outer(order, angles))
    return orders.paths.symmetry * np.einsum("kbw,wg,wh->kbgh", weight, around, around.conj(), optimize=True)


def _angular(ring: RunningRing, orders: CarrierOrders, blocks, band, speeds: tuple[float, float]) -> np.ndarray:
    """Angular frequencies (B, b, w) of the waves in the fixed frame [rad/s]."""
    mesh, carrier = speeds
    line = (orders.base[blocks] + orders.seed[blocks]) / orders.paths.z_ring
    turns = np.asarray(band)[:, None] - orders.sense * ring.waves[0]
    return line[:, None, None] * mesh + turns * carrier


def ring_motion(
    ring: RunningRing,
    orders: CarrierOrders,
    force: np.ndarray,
    angles: np.ndarray,
    speeds: tuple[float, float],
    places: tuple[np.ndarray, np.ndarray],
    shown_bands: np.ndarray,
    pushed: np.ndarray,
) -> np.ndarray:
    """Compute two-sided displacements (Q + 1, S, k) of fixed places of the outer surface [m].

    Parameters
    ----------
    ring, orders, angles, speeds
        As for `ring_compliance`.
    force : (G, B, R) complex array
        Of the leading planets on the ring [N].
    places : two arrays
        Angles (k,) of the places [rad], and their directions (k, 2): shares of radial and tangential displacement.
    shown_bands : (S,) int array
        Side bands to give; those of waves beyond are left out.
    pushed : (r,) complex array
        As for `ring_compliance`.
    """
    order, every = ring.waves[0], np.arange(len(orders.base))
    omega = _angular(ring, orders, every, orders.bands, speeds)
    push = orders.paths.symmetry * np.einsum("wg,gbr->brw", np.exp(-1j * np.outer(order, angles)), force)
    wave = -ring.receptance(omega) * ring.of_waves(pushed).conj() * push
    wave = np.where(_met(ring, orders, every, orders.bands), wave, 0.0)
    theta, direction = places
    seen = (ring.of_waves(ring.surface) @ np.asarray(direction).T) * np.exp(1j * np.outer(order, theta))
    moved = np.zeros((len(every), len(shown_bands), len(theta)), complex)
    at = {int(band): k for k, band in enumerate(shown_bands)}
    for r, band in enumerate(orders.bands):
        turns = band - orders.sense * order
        for turn in np.unique(turns):
            if (k := at.get(int(turn))) is not None:
                chosen = turns == turn
                moved[:, k] += wave[:, r, chosen] @ seen[chosen]
    return moved.reshape(orders.patterns, -1, *moved.shape[1:]).sum(axis=0)
