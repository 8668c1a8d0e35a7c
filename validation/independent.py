"""Planetary sets of rigid bodies once more, as a network of springs between points in space.

The references of rows "springs between points": plain NumPy and SciPy, nothing of femgear's models. Each
body has three translations v and three rotations phi in one fixed frame; a spring of stiffness k between
points a of body A and b of body B along n stores ``k/2 (n . (v_A + phi_A x a - v_B - phi_B x b))^2``, with a
and b seen from the centres of the bodies. Mesh springs lie on the line of action, which touches the
base circles of both gears; a pin holds its planet by springs between planet and carrier at the pin. A planar
set keeps x, y and the rotation about z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from decimal import Decimal

import numpy as np

GROUND = "ground"
PLANAR = (0, 1, 5)
SOURCE = "springs between points (validation/independent.py)"


@dataclass
class Network:
    """Bodies with masses and springs between them; matrices are made on demand.

    Parameters
    ----------
    places : dict of str to (3,) array
        Centres of the bodies [m].
    mass : dict of str to (6,) array
        Masses [kg] and inertias [kg m^2].
    springs : list of (str, (n_bodies, 6) array, float)
        Kind, stretch per unit of every coordinate, stiffness [N/m].
    """

    places: dict = field(default_factory=dict)
    mass: dict = field(default_factory=dict)
    springs: list = field(default_factory=list)

    def body(self, name: str, place, mass: float, polar: float, diametral: float = 1.0) -> None:
        """Add a body with its inertias about z and about the axes across it."""
        self.places[name] = np.array([*place, 0.0])
        self.mass[name] = np.array([mass, mass, mass, diametral, diametral, polar])

    def point_spring(self, kind: str, body: str, other: str, point, normal, stiffness: float, *, second=None):
        """Spring between a point of each body [m] (the same one unless `second` is given) along a normal."""
        row = np.zeros((len(self.places), 6))
        for sign, name, at in ((1.0, body, point), (-1.0, other, point if second is None else second)):
            if name != GROUND:
                arm = np.asarray(at) - self.places[name]
                row[self._number(name)] += sign * np.concatenate([normal, np.cross(arm, normal)])
        self.springs.append((kind, row, stiffness))

    def turn_spring(self, body: str, other: str, axis, stiffness: float) -> None:
        """Spring against the relative rotation of two bodies about an axis [N m/rad]."""
        row = np.zeros((len(self.places), 6))
        for sign, name in ((1.0, body), (-1.0, other)):
            if name != GROUND:
                row[self._number(name), 3:] += sign * np.asarray(axis)
        self.springs.append(("turn", row, stiffness))

    def hold(self, body: str, other: str, point, *, radial=0.0, axial=0.0, tilt=0.0, torsion=0.0) -> None:
        """Bearing between two bodies at a point: springs along x, y and z and about them."""
        for axis, along, about in zip(np.eye(3), (radial, radial, axial), (tilt, tilt, torsion), strict=True):
            self.point_spring("pin" if other != GROUND else "support", body, other, point, axis, along)
            self.turn_spring(body, other, axis, about)

    def mesh(self, kind, body, other, planet, base_radii, alpha, beta, stiffness, *, sense) -> None:
        """Mesh spring that presses `other` in the tangential sense +-1 seen from the carrier's centre.

        The normal into `other` leans outwards by the pressure angle; its feet on the base circles lie
        across it, on the side of the pitch point of each gear.
        """
        out = self.places[planet] / np.linalg.norm(self.places[planet])
        along = np.cross([0.0, 0.0, 1.0], out)
        flat = math.sin(alpha) * out + sense * math.cos(alpha) * along
        foot = math.cos(alpha) * out - sense * math.sin(alpha) * along
        normal = math.cos(beta) * flat - math.sin(beta) * np.array([0.0, 0.0, 1.0])
        # an external mesh lies between the two centres, an internal one beyond both
        sides = (1.0, -1.0) if other == planet else (1.0, 1.0)
        feet = [
            self.places[name] + side * radius * foot
            for name, side, radius in zip((body, other), sides, base_radii, strict=True)
        ]
        self.point_spring(kind, body, other, feet[0], normal, stiffness, second=feet[1])

    def matrices(self, axes=tuple(range(6)), held=()) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass (n,), stiffness (n, n) and the numbers (n,) of the coordinates that are left.

        Parameters
        ----------
        axes : sequence of int
            Of every body, `PLANAR` for plane motion.
        held : sequence of str or (str, int)
            Bodies that do not move, or single coordinates of theirs.
        """
        kept = [
            6 * self._number(name) + axis
            for name in self.places
            for axis in axes
            if name not in held and (name, axis) not in held
        ]
        rows = np.array([row.ravel()[kept] for _, row, _ in self.springs])
        k = np.array([stiffness for *_, stiffness in self.springs])
        M = np.concatenate([self.mass[name] for name in self.places])[kept]
        return M, (rows.T * k) @ rows, np.array(kept)

    def frequencies(self, axes=tuple(range(6)), held=()) -> np.ndarray:
        """Natural frequencies [Hz], ascending, rigid motions as (nearly) zero."""
        M, K, _ = self.matrices(axes, held)
        return _frequencies(np.diag(M), K)

    def torsional_frequencies(self) -> np.ndarray:
        """The same of a plane set that only rotates: ring held, planets on rigid pins of the carrier."""
        M, K, kept = self.matrices(PLANAR, ("ring", ("sun", 0), ("sun", 1), ("carrier", 0), ("carrier", 1)))
        planets = [name for name in self.places if name.startswith("planet")]
        T = np.zeros((len(kept), 2 + len(planets)))
        for column, name in enumerate(("sun", "carrier", *planets)):
            T[np.flatnonzero(kept == 6 * self._number(name) + 5)[0], column] = 1.0
        for name in planets:
            first = np.flatnonzero(kept == 6 * self._number(name))[0]
            T[first : first + 2, 1] = np.cross([0.0, 0.0, 1.0], self.places[name])[:2]
        return _frequencies((T.T * M) @ T, T.T @ K @ T)

    def _number(self, name: str) -> int:
        return list(self.places).index(name)


def _frequencies(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    from scipy.linalg import eigh

    scale = 1.0 / np.sqrt(np.diag(M))
    values = eigh(scale[:, None] * K * scale, scale[:, None] * M * scale, eigvals_only=True)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * math.pi)


def network(*, radii, distance, angles, alpha, beta, bodies, supports, pin, meshes, flank=1.0) -> Network:
    """Planetary set with the flanks on which a counter-clockwise sun drives, or -1 for the other ones.

    Parameters
    ----------
    radii : (float, float, float)
        Base radii of sun, planet and ring [m].
    distance : float
        From the sun to the planets [m].
    angles : (N,) array
        Places of the planets [rad].
    alpha, beta : float
        Transverse pressure angle and base helix angle [rad].
    bodies : dict of str to tuple
        Mass [kg], polar and diametral inertia [kg m^2] of ``"sun"``, ``"ring"``, ``"carrier"``, ``"planet"``.
    supports : dict of str to dict
        Options of `Network.hold` for the support of each central member.
    pin : dict
        The same for every planet on its pin.
    meshes : (float, float)
        Stiffness of the sun's and of the ring's meshes [N/m].
    flank : {1, -1}
    """
    net = Network()
    for name in ("sun", "ring", "carrier"):
        net.body(name, (0.0, 0.0), *bodies[name])
    planets = [f"planet {n}" for n in range(len(angles))]
    for name, angle in zip(planets, angles, strict=True):
        net.body(name, (distance * math.cos(angle), distance * math.sin(angle)), *bodies["planet"])
    for name, support in supports.items():
        net.hold(name, GROUND, np.zeros(3), **support)
    sun, planet_radius, ring = radii
    for name in planets:
        net.hold(name, "carrier", net.places[name], **pin)
        net.mesh("sun", "sun", name, name, (sun, planet_radius), alpha, flank * beta, meshes[0], sense=flank)
        net.mesh("ring", name, "ring", name, (planet_radius, ring), alpha, flank * beta, meshes[1], sense=-flank)
    return net


def lin_parker(planets: int, *, pin=1e8, sun_support=1e8, others=1e8, ring_turn=1e9, carrier_turn=0.0):
    """Set of Lin and Parker (1999, Table 1), equally spaced: kg, N/m on translations and on ``r theta``."""
    alpha = math.radians(24.6)
    sun, planet = 0.5 * 0.07742, 0.5 * 0.10035
    ring, distance = sun + 2.0 * planet, (sun + planet) / math.cos(alpha)
    return network(
        radii=(sun, planet, ring),
        distance=distance,
        angles=2.0 * np.pi * np.arange(planets) / planets,
        alpha=alpha,
        beta=0.0,
        bodies={
            "sun": (0.4, 0.39 * sun**2),
            "ring": (2.35, 3.0 * ring**2),
            "carrier": (5.43, 6.29 * distance**2),
            "planet": (0.66, 0.61 * planet**2),
        },
        supports={
            "sun": {"radial": sun_support},
            "ring": {"radial": others, "torsion": ring_turn * ring**2},
            "carrier": {"radial": others, "torsion": carrier_turn * distance**2},
        },
        pin={"radial": pin},
        meshes=(5e8, 5e8),
    )


# set B of NREL/CP-5000-55355: masses [kg], inertias I / r^2 [kg], supports, meshes and pin [N/m], torsional
# supports [N/m rad] as printed
WIND_TURBINE_B = {
    "sun mass": "51",
    "ring mass": "4000",
    "carrier mass": "1330",
    "planet mass": "114",
    "sun inertia": "61.1",
    "ring inertia": "2484",
    "carrier inertia": "314.7",
    "planet inertia": "51.9",
    "ring support": "4e9",
    "carrier support": "126e6",
    "sun torsion": "3e6",
    "ring torsion": "24.4e6",
    "sun mesh": "3.95e9",
    "ring mesh": "5.29e9",
    "pin": "5.3e9",
}


def wind_turbine_b(*, flank: float = 1.0, **changes: float) -> Network:
    """Set B as docs/nrel.md reads it: 16/26/68, module 14 mm, 24.6 deg; changed entries by name."""
    alpha, distance = math.radians(24.6), 0.294
    sun, planet, ring = (0.5 * 14e-3 * teeth * math.cos(alpha) for teeth in (16, 26, 68))
    given = {name: float(text) for name, text in WIND_TURBINE_B.items()} | changes
    return network(
        radii=(sun, planet, ring),
        distance=distance,
        angles=2.0 * np.pi * np.arange(3) / 3,
        alpha=alpha,
        beta=0.0,
        bodies={
            name: (given[f"{name} mass"], given[f"{name} inertia"] * radius**2)
            for name, radius in (("sun", sun), ("ring", ring), ("carrier", distance), ("planet", planet))
        },
        supports={
            "sun": {"radial": 100.0, "torsion": 4.0 * given["sun torsion"]},
            "ring": {"radial": given["ring support"], "torsion": 4.0 * given["ring torsion"]},
            "carrier": {"radial": given["carrier support"]},
        },
        pin={"radial": given["pin"]},
        meshes=(given["sun mesh"], given["ring mesh"]),
        flank=flank,
    )


def wind_turbine_a(*, flank: float = 1.0) -> Network:
    """Set A of the same paper as docs/nrel.md reads it: 21/39/99, inertias as I / r^2, 24.6 deg."""
    alpha, distance = math.radians(24.6), 0.308
    sun, planet, ring = (0.5 * diameter * math.cos(alpha) for diameter in (0.2156, 0.4004, 1.0164))
    return network(
        radii=(sun, planet, ring),
        distance=distance,
        angles=2.0 * np.pi * np.arange(3) / 3,
        alpha=alpha,
        beta=0.0,
        bodies={
            "sun": (181.6, 3.2 * sun**2),
            "ring": (2633.0, 144.2 * ring**2),
            "carrier": (759.9, 59.1 * distance**2),
            "planet": (104.0, 3.2 * planet**2),
        },
        supports={
            "sun": {"radial": 100.0, "torsion": 45.8e6},
            "ring": {"radial": 102e6, "torsion": 57.4e6},
            "carrier": {"radial": 5e9},
        },
        pin={"radial": 6.8e9},
        meshes=(16.9e9, 19.2e9),
        flank=flank,
    )


def half_unit(text: str) -> float:
    """Half a unit of the last digit of a printed number, such as 0.05e6 of ``"24.4e6"``."""
    return 0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent)


def moved_by_digits(frequencies) -> np.ndarray:
    """Sum of the shifts [Hz] of frequencies of set B by half a unit of the last digit of every printed entry.

    Parameters
    ----------
    frequencies : callable
        Of a `Network`, returns an array [Hz].
    """
    base = frequencies(wind_turbine_b())
    return sum(
        np.abs(frequencies(wind_turbine_b(**{name: float(text) + half_unit(text)})) - base)
        for name, text in WIND_TURBINE_B.items()
    )


def kahraman() -> Network:
    """Set of Kahraman (1994, Table 3) with axial and tilt stiffnesses of 10 000 N/um."""
    alpha, micro = math.radians(21.34), 1e6
    sun, planet, ring, distance = 0.024, 0.016, 0.056, 0.040 / math.cos(alpha)

    def body(radius, mass, polar, diametral):
        return mass, polar * radius**2, diametral * radius**2

    def support(radius, radial, torsion=0.0):
        turning = {"tilt": 1e4 * micro * radius**2, "torsion": torsion * micro * radius**2}
        return {"radial": radial * micro, "axial": 1e4 * micro} | turning

    return network(
        radii=(sun, planet, ring),
        distance=distance,
        angles=0.5 * np.pi * np.arange(4),
        alpha=alpha,
        beta=math.radians(20.0),
        bodies={
            "sun": body(sun, 0.460, 0.272, 0.136),
            "ring": body(ring, 0.588, 0.759, 0.389),
            "carrier": body(distance, 3.0, 1.5, 0.75),
            "planet": body(planet, 0.177, 0.100, 0.050),
        },
        supports={
            "sun": support(sun, 1e-4),
            "ring": support(ring, 1e4, 1e4),
            "carrier": support(distance, 100.0),
        },
        pin=support(distance, 100.0),
        meshes=(200.0 * micro, 200.0 * micro),
    )


def sun_forces(net: Network, torque: float, errors, *, held=("ring", "carrier")) -> np.ndarray:
    """Forces (N,) [N] of the sun's meshes at rest in a plane set whose pins are displaced.

    Parameters
    ----------
    net : Network
    torque : float
        On the sun [N m].
    errors : (N,) array
        Displacement of the pins along the turning sense [m].
    held : sequence of str or (str, int)
        See `Network.matrices`.
    """
    _, K, kept = net.matrices(PLANAR, held)
    load = np.zeros(6 * len(net.places))
    load[6 * list(net.places).index("sun") + 5] = torque
    for n, error in enumerate(errors):
        name = f"planet {n}"
        place = net.places[name] / np.linalg.norm(net.places[name])
        pin = error * np.cross([0.0, 0.0, 1.0], place)
        number = list(net.places).index(name)
        for kind, row, k in net.springs:
            # the pin's springs stretch by the planet's motion less the pin's displacement
            if kind == "pin" and row[number, :3].any():
                load += k * (row[number, :3] @ pin) * row.ravel()
    q = np.linalg.solve(K, load[kept])
    rows = [(row.ravel()[kept], k) for kind, row, k in net.springs if kind == "sun"]
    return np.array([k * (row @ q) for row, k in rows])
