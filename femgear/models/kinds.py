"""What kind of mode a shape of the planetary set is, and its number of nodal diameters.

With equal planets at equal angles the modes fall into classes of the cyclic group of order N (Lin and
Parker, J. Vib. Acoust. 121, 1999, for the rigid ring): rotational (class 0), translational (class +-1)
and planet modes (the other classes). The ring's nodal diameters n belong to class n mod N.
"""

from __future__ import annotations

import numpy as np


def mode_kinds(shape, mass, dofs, *, frequency, ring_diameter, ring_slice, planet_angles):
    """Kind and nodal diameter of every mode.

    Parameters
    ----------
    shape : (n, m) array
        Mode shapes.
    mass : (n,) array
        Diagonal mass matrix.
    dofs : tuple of str
    frequency : (m,) array
        [Hz], zero for rigid-body modes.
    ring_diameter : int array
        Nodal diameter of every ring coordinate.
    ring_slice : slice
    planet_angles : (N,) array
        [rad].

    Returns
    -------
    kinds : tuple of str
        ``rigid``, ``rotational``, ``translational``, ``planet``; ``ring, ...`` where the ring holds more than
        half of the kinetic energy; ``mixed`` where no class holds 99 % of it.
    nodal_diameter : (m,) int array
        The one with most of the ring's kinetic energy; -1 where the ring holds less than a thousandth.
    """
    energy = mass[:, None] * np.asarray(shape) ** 2
    total = energy.sum(axis=0)
    ring = energy[ring_slice]
    share = np.zeros((int(ring_diameter.max()) + 1, energy.shape[1]))
    np.add.at(share, ring_diameter, ring)
    classes = _class_energy(shape, mass, dofs, planet_angles)
    N = len(planet_angles)
    for n in range(len(share)):
        folded = n % N
        classes[min(folded, N - folded)] += share[n]
    # planet modes of different classes coincide on a rigid ring, where any mixture of them is a mode
    kinetic = np.vstack([classes[:2], classes[2:].sum(axis=0)])
    kinds = []
    for m in range(energy.shape[1]):
        if frequency[m] == 0.0:
            kinds.append("rigid")
            continue
        best = int(kinetic[:, m].argmax())
        name = (
            ("rotational", "translational", "planet")[best]
            if kinetic[best, m] >= 0.99 * total[m]
            else "mixed"
        )
        kinds.append(f"ring, {name}" if ring[:, m].sum() > 0.5 * total[m] else name)
    moves = share.sum(axis=0) > 1e-3 * total
    return tuple(kinds), np.where(moves, share.argmax(axis=0), -1)


def _class_energy(shape, mass, dofs, planet_angles):
    """Kinetic energy of the rigid bodies in each cyclic class, shape (N // 2 + 1, m)."""
    N = len(planet_angles)
    place = {name: i for i, name in enumerate(dofs)}
    result = np.zeros((max(N // 2 + 1, 2), shape.shape[1]))
    for body in ("sun", "carrier", "motor", "brake"):
        for axis, index in (("x", 1), ("y", 1), ("rotation", 0)):
            if (i := place.get(f"{body}: {axis}")) is not None:
                result[index] += mass[i] * shape[i] ** 2
    planets = [[place[f"planet {n + 1}: {a}"] for a in ("x", "y", "rotation")] for n in range(N)]
    x, y, turn = (shape[[p[k] for p in planets]] for k in range(3))
    c, s = np.cos(planet_angles)[:, None], np.sin(planet_angles)[:, None]
    for local, inertia in (
        (c * x + s * y, mass[planets[0][0]]),
        (c * y - s * x, mass[planets[0][0]]),
        (turn, mass[planets[0][2]]),
    ):
        for k in range(N):
            wave = np.exp(-2j * np.pi * k * np.arange(N) / N)[:, None]
            result[min(k, N - k)] += inertia * np.abs((wave * local).sum(axis=0)) ** 2 / N
    return result
