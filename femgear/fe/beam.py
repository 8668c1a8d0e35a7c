"""Shafts that stretch, bend, shear and twist: Timoshenko beam elements, stepped and conical shafts, rigid bodies.

Every station has six motions, displacements along x, y and the axis z, then right-handed rotations about x, y
(tilts) and z [m], [rad]; their forces are in N and N m. Stiffness and consistent mass: J. S. Przemieniecki,
Theory of Matrix Structural Analysis (1968), sections 5.6 and 11.3; gyroscopic terms: H. D. Nelson, J. Mech.
Des. 102 (1980) 793-803.

Conical elements take the displacements that forces at their ends cause: flexibility integrals along the
length give the stiffness, the same displacements carry mass and angular momentum. A uniform one is
`beam_element`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from femgear.errors import CaseError, GeometryError

AXES = ("x", "y", "z", "tilt x", "tilt y", "rotation")
SAME_PLACE = 1e-9
"""Places closer to one another [m] are one station."""
ELEMENTS_OF_SHAFT = 16
"""Least number of elements over the length of a shaft, see `beam_shaft`."""
LARGEST_TAPER = 100.0
"""Of the thick over the thin end of a part, in outer diameter and in wall."""
TAPER_OF_ELEMENT = 10.0
"""The same within one element, for which `QUADRATURE_POINTS` integrate to rounding."""
QUADRATURE_POINTS = 32

# coordinates of two stations that bend together: (x, tilt y) and (y, -tilt x) bend alike
_XZ, _YZ, _SIGN = [0, 4, 6, 10], [1, 3, 7, 9], np.array([1.0, -1.0, 1.0, -1.0])
_AXIAL, _TWIST = [2, 8], [5, 11]


@dataclass(frozen=True)
class RoundSection:
    """Round section and material.

    CaseError: diameters that no shaft has (E-SHAFT).

    Parameters
    ----------
    outer_diameter, inner_diameter : float
        [m]
    young, poisson : float
        Young's modulus [Pa] and Poisson's ratio [1].
    density : float
        [kg/m^3]; zero for a shaft without mass.
    """

    outer_diameter: float
    inner_diameter: float = 0.0
    young: float = 2.06e11
    poisson: float = 0.3
    density: float = 7850.0

    def __post_init__(self):
        if not 0.0 <= self.inner_diameter < self.outer_diameter < math.inf:
            raise CaseError(f"a shaft section {self}", code="E-SHAFT", limit="0 <= inner < outer diameter")

    @property
    def area(self) -> float:
        """[m^2]"""
        return 0.25 * math.pi * (self.outer_diameter**2 - self.inner_diameter**2)

    @property
    def second_moment(self) -> float:
        """About a diameter [m^4]; twice as much about the axis."""
        return math.pi / 64.0 * (self.outer_diameter**4 - self.inner_diameter**4)

    @property
    def shear_modulus(self) -> float:
        """[Pa]"""
        return 0.5 * self.young / (1.0 + self.poisson)

    @property
    def shear_coefficient(self) -> float:
        """Of G. R. Cowper, J. Appl. Mech. 33 (1966) 335-340, round and hollow round section."""
        nu, m2 = self.poisson, (self.inner_diameter / self.outer_diameter) ** 2
        both = (1.0 + m2) ** 2
        return 6.0 * (1.0 + nu) * both / ((7.0 + 6.0 * nu) * both + (20.0 + 12.0 * nu) * m2)

    @property
    def bending_stiffness(self) -> float:
        """``E I`` [N m^2]"""
        return self.young * self.second_moment

    @property
    def shear_stiffness(self) -> float:
        """``kappa G A`` [N]"""
        return self.shear_coefficient * self.shear_modulus * self.area

    def shear_ratio(self, length: float) -> float:
        """``Phi = 12 E I / (kappa G A l^2)`` at a length [m]: deflection by shear over that by bending."""
        return 12.0 * self.young * self.second_moment / (self.shear_stiffness * length**2)


@dataclass(frozen=True)
class ShaftPart:
    """One part of a stepped shaft, cylindrical or conical.

    GeometryError: numbers that no shaft has, or a part too conical for a beam (E-SHAFT).

    Parameters
    ----------
    length : float
        [m]
    outer_diameter, inner_diameter : float
        Of the left end [m].
    end_outer_diameter, end_inner_diameter : float or None
        Of the right end [m]; None where the diameter does not change.
    young, poisson : float
        Young's modulus [Pa] and Poisson's ratio [1].
    density : float
        [kg/m^3]
    """

    length: float
    outer_diameter: float
    inner_diameter: float = 0.0
    end_outer_diameter: float | None = None
    end_inner_diameter: float | None = None
    young: float = 2.06e11
    poisson: float = 0.3
    density: float = 7850.0

    def __post_init__(self):
        both = self.diameters
        sound = all(0.0 <= inner < outer < math.inf for outer, inner in both)
        if not (0.0 < self.length < math.inf and sound):
            limit = "length > 0, 0 <= inner < outer diameter"
            raise GeometryError(f"a part of a shaft {(self.length, *both)}", code="E-SHAFT", limit=limit)
        if not (0.0 < self.young < math.inf and -1.0 < self.poisson <= 0.5 and 0.0 <= self.density < math.inf):
            raise GeometryError(
                f"a shaft of the material {(self.young, self.poisson, self.density)}",
                code="E-SHAFT",
                limit="Young's modulus > 0, Poisson's ratio above -1 and at most 0.5, density >= 0",
            )
        if self.taper > LARGEST_TAPER:
            raise GeometryError(
                f"one end of a part of a shaft is {self.taper:.4g} times as thick as the other",
                code="E-SHAFT",
                limit=f"diameters and walls of both ends within a factor of {LARGEST_TAPER:g}",
            )

    @property
    def diameters(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Outer and inner diameter of the left end, then of the right end [m]."""
        outer, inner = self.end_outer_diameter, self.end_inner_diameter
        return (
            (self.outer_diameter, self.inner_diameter),
            (self.outer_diameter if outer is None else outer, self.inner_diameter if inner is None else inner),
        )

    @property
    def taper(self) -> float:
        """Thick over thin end, the larger one of outer diameters and walls [1]."""
        (outer, inner), (end_outer, end_inner) = self.diameters
        pairs = ((outer, end_outer), (outer - inner, end_outer - end_inner))
        return max(max(pair) / min(pair) for pair in pairs)

    def section(self, share: float) -> RoundSection:
        """Section at a share of the length, 0 at the left end and 1 at the right one."""
        (outer, inner), (end_outer, end_inner) = self.diameters
        right = min(max(float(share), 0.0), 1.0)
        left = 1.0 - right
        return RoundSection(
            left * outer + right * end_outer,
            left * inner + right * end_inner,
            self.young,
            self.poisson,
            self.density,
        )


@dataclass(frozen=True)
class BeamShaft:
    """Matrices of a shaft on its stations, six motions each in the order of `AXES`.

    Parameters
    ----------
    stations : (n,) array
        Places from the left end [m], ascending.
    mass, stiffness : (6n, 6n) arrays
        Of the free shaft, in N, m, rad, kg.
    gyroscopic : (6n, 6n) array
        Multiplies the speed of rotation [rad/s], positive about z, and the velocities.
    """

    stations: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray
    gyroscopic: np.ndarray

    def index_of(self, place: float) -> int:
        """Find the number of the station at a place [m].

        GeometryError: there is none (E-SHAFT).
        """
        number = int(np.abs(self.stations - place).argmin())
        if not abs(self.stations[number] - place) <= 2.0 * SAME_PLACE:
            raise GeometryError(
                f"no station of the shaft stands at {1e3 * place:.9g} mm; the nearest one is at "
                f"{1e3 * self.stations[number]:.9g} mm",
                code="E-SHAFT",
                limit="places that the shaft was divided at",
            )
        return number


def beam_shaft(
    parts: Sequence[ShaftPart], places: Iterable[float] = (), *, longest_element: float | None = None
) -> BeamShaft:
    """Assemble mass, stiffness and gyroscopic matrices of a stepped shaft.

    Stations stand at both ends, at every step, at every place that is asked for, and between them so that
    elements are short enough for vibration; statics of loads at stations are exact with any of them.

    Parameters
    ----------
    parts : sequence of ShaftPart
        From left to right.
    places : (n,) floats
        Where gears, bearings and loads are [m] from the left end; those within `SAME_PLACE` are one.
    longest_element : float, optional
        [m]. By default a sixteenth (`ELEMENTS_OF_SHAFT`) of the length of the shaft: see the notes.

    Notes
    -----
    The error of a frequency is of second order in the length of the elements. With the default, the first bending,
    axial and torsional frequencies of free and of hinged uniform shafts of 3 to 40 diameters, solid and with a bore
    of 0.7 diameters, are within 0.2 % of the exact ones, the second ones within 0.7 % (``python validation --theme
    shafts``). With twelve elements the first bending frequency was 0.3 % off, with eight 0.7 %.

    Raises
    ------
    GeometryError
        No parts, neighbours that do not touch, places off the shaft, elements without length (E-SHAFT).
    """
    check_touching([part.diameters for part in parts])
    lengths = np.array([part.length for part in parts])
    edges = np.concatenate([[0.0], np.cumsum(lengths)])
    longest = edges[-1] / ELEMENTS_OF_SHAFT if longest_element is None else longest_element
    if not longest > 0.0:
        raise GeometryError(f"a longest element of {longest:g} m", code="E-SHAFT", limit="more than zero")
    cuts = _cuts(edges, places)
    stations, elements = [0.0], []
    for number, part in enumerate(parts):
        left, right = edges[number], edges[number + 1]
        cuts_inside = cuts[(cuts >= left) & (cuts <= right)]
        for start, end in pairwise(cuts_inside):
            count = max(math.ceil((end - start) / longest * (1.0 - 1e-9)), _taper_count(part, start - left, end - left))
            inner = start + (end - start) * np.arange(count + 1) / count
            inner[-1] = end
            elements += [(part, near_end - left, far_end - left) for near_end, far_end in pairwise(inner)]
            stations += inner[1:].tolist()
    size = 6 * len(stations)
    total = np.zeros((3, size, size))
    for number, element in enumerate(elements):
        place = slice(6 * number, 6 * number + 12)
        total[:, place, place] += part_element(*element)
    mass, stiffness, gyroscopic = total
    return BeamShaft(np.array(stations), mass, stiffness, gyroscopic)


def check_touching(diameters: Sequence[tuple[tuple[float, float], tuple[float, float]]]) -> None:
    """Refuse shafts without parts and neighbours that do not touch.

    Outer and inner diameters [m] of the left and of the right end of every part.

    GeometryError: E-SHAFT.
    """
    if not diameters:
        raise GeometryError("a shaft without parts", code="E-SHAFT", limit="one part or more")
    for (_, (outer, inner)), ((next_outer, next_inner), _) in pairwise(diameters):
        if not max(inner, next_inner) < min(outer, next_outer):
            raise GeometryError(
                "two neighbouring parts of a shaft do not touch",
                code="E-SHAFT",
                limit="the bore of each below the outer diameter of the other",
            )


def _cuts(edges: np.ndarray, places: Iterable[float]) -> np.ndarray:
    """Ends, steps and places [m], ascending, each once; steps stay where they are."""
    cuts = list(edges)
    for place in sorted(map(float, places)):
        if not -SAME_PLACE <= place <= edges[-1] + SAME_PLACE:
            raise GeometryError(
                f"a place at {1e3 * place:.6g} mm on a shaft of {1e3 * edges[-1]:.6g} mm",
                code="E-SHAFT",
                limit=f"0 to {1e3 * edges[-1]:.6g} mm from the left end",
            )
        if min(abs(place - cut) for cut in cuts) > SAME_PLACE:
            cuts.append(place)
    return np.sort(cuts)


def _taper_count(part: ShaftPart, start: float, end: float) -> int:
    """Equal elements from one place in a part to another [m], none with more than `TAPER_OF_ELEMENT`."""
    left, right = (part.section(place / part.length) for place in (start, end))
    walls = [section.outer_diameter - section.inner_diameter for section in (left, right)]
    outer = [left.outer_diameter, right.outer_diameter]
    taper = max(max(pair) / min(pair) for pair in (outer, walls))
    return max(1, math.ceil((taper - 1.0) / (TAPER_OF_ELEMENT - 1.0)))


def part_element(part: ShaftPart, start: float, end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, stiffness and gyroscopic matrix (12, 12) of an element from one place in a part to another [m]."""
    (outer, inner), (end_outer, end_inner) = part.diameters
    if outer == end_outer and inner == end_inner:
        return beam_element(part.section(0.0), end - start)
    return _conical_element(part, start, end)


@dataclass(frozen=True)
class JointSprings:
    """Springs of the joint in the middle of two rigid links, each half as long as the shaft.

    Parameters
    ----------
    bending : float
        Against the relative tilt of the links [N m/rad], equal about x and y.
    torsion : float
        [N m/rad]
    shear, axial : float
        Against the relative displacements at the joint, across and along the shaft [N/m]; an infinite shear
        stiffness makes it a spherical joint.
    """

    bending: float
    torsion: float
    shear: float = math.inf
    axial: float = math.inf


def joint_springs(section: RoundSection, length: float) -> JointSprings:
    """Springs of the joint of two links that have the static stiffness matrix of a Timoshenko shaft.

    ``E I / l`` in bending, ``G J / l`` in torsion, ``E A / l`` along the axis, and a joint that shears with
    ``12 E I / ((1 + Phi) l^3)``, at a length l [m].
    """
    bending, phi = section.young * section.second_moment / length, section.shear_ratio(length)
    torsion = 2.0 * section.shear_modulus * section.second_moment / length
    shear = 12.0 * bending / ((1.0 + phi) * length**2)
    return JointSprings(bending, torsion, shear, section.young * section.area / length)


def joint_deflections(length: float) -> np.ndarray:
    """Rows (6, 12) of the joint's deflections: shear along x and y, stretch, bend about x and y, twist.

    Each link, half the length [m] of the shaft, moves with the station at its end; a tilt about y moves the
    joint along x, one about x along -y.
    """
    first, second = (rigid_link((0.0, 0.0, offset)) for offset in (0.5 * length, -0.5 * length))
    return np.hstack([-first, second])


def growth_load(shaft: BeamShaft, growth: float) -> np.ndarray:
    """Compute the loads (6n,) on its stations that give a free shaft its growth along the axis [N].

    ``growth`` is that of its length over it, such as alpha dT by heat. The loads are the stiffness times the motions of
    a shaft that grows freely, exact for sections of any size.
    """
    free = np.zeros((len(shaft.stations), 6))
    free[:, 2] = growth * np.asarray(shaft.stations)
    return shaft.stiffness @ free.ravel()


def rigid_link(offset) -> np.ndarray:
    """Compute the motions (6, 6) of a point at an offset (3,) [m] per unit of the motions of its station.

    Rigid-body motion ``v + phi x c``; tilts and rotation are those of the station. The transpose carries
    forces on the point to the station.
    """
    x, y, z = map(float, offset)
    link = np.eye(6)
    link[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return link


def body_matrices(mass: float, polar: float, transverse: float, offset: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Compute mass and gyroscopic matrix (6, 6) of a rigid body on its station.

    ``I_t tilt_x'' + I_p Omega tilt_y' = moment``, ``I_t tilt_y'' - I_p Omega tilt_x' = moment`` about its centre.

    Parameters
    ----------
    mass : float
        [kg]
    polar, transverse : float
        Moments of inertia I_p about the axis and I_t about a diameter through the centre of gravity [kg m^2].
    offset : float
        Of the centre of gravity from the station along the axis [m].
    """
    gyroscopic = np.zeros((6, 6))
    gyroscopic[3, 4], gyroscopic[4, 3] = polar, -polar
    inertia = np.diag([mass, mass, mass, transverse, transverse, polar])
    if offset == 0.0:
        return inertia, gyroscopic
    link = rigid_link((0.0, 0.0, offset))
    # the speed of rotation and the tilts of the body are those of the station
    return link.T @ inertia @ link, gyroscopic


def beam_element(section: RoundSection, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, stiffness and gyroscopic matrix (12, 12) of an element of a length [m] between two stations.

    The last one multiplies the speed of rotation [rad/s], positive about z.
    """
    l, phi = length, section.shear_ratio(length)
    springs = joint_springs(section, length)
    rows = joint_deflections(length)
    k = np.array([springs.shear, springs.shear, springs.axial, springs.bending, springs.bending, springs.torsion])
    moving, turning = _mass_terms(l, phi)
    line, rotary = section.density * section.area * l, section.density * section.second_moment / l
    plane = line / (1.0 + phi) ** 2 * moving + rotary / (1.0 + phi) ** 2 * turning
    ends = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    polar = 2.0 * section.density * section.second_moment * l
    M = _both_planes(plane, line * ends, polar * ends)
    # rotary times turning is the integral of rho I times the product of the tilts
    return M, (rows.T * k) @ rows, _gyroscopic(rotary / (1.0 + phi) ** 2 * turning)


def _both_planes(plane: np.ndarray, axial: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Matrix (12, 12) of an element from those of one plane (4, 4), of stretch and of twist (2, 2)."""
    total = np.zeros((12, 12))
    total[np.ix_(_XZ, _XZ)] = plane
    total[np.ix_(_YZ, _YZ)] = _SIGN[:, None] * plane * _SIGN
    total[np.ix_(_AXIAL, _AXIAL)] = axial
    total[np.ix_(_TWIST, _TWIST)] = twist
    return total


def _gyroscopic(tilting: np.ndarray) -> np.ndarray:
    """Gyroscopic matrix (12, 12) of an element from the part of the tilts in its mass in one plane (4, 4)."""
    G = np.zeros((12, 12))
    # a disc of polar inertia I has I tilt_y' in the row of tilt x and -I tilt_x' in that of tilt y
    block = 2.0 * tilting * _SIGN
    G[np.ix_(_XZ, _YZ)] = block
    G[np.ix_(_YZ, _XZ)] = -block.T
    return G


def _mass_terms(l: float, phi: float) -> tuple[np.ndarray, np.ndarray]:
    """Translation and rotation (4, 4) in one plane, times (1 + Phi)^2, on w and its slope at both ends."""
    a, b = 13 / 35 + 7 * phi / 10 + phi**2 / 3, (11 / 210 + 11 * phi / 120 + phi**2 / 24) * l
    c, d = 9 / 70 + 3 * phi / 10 + phi**2 / 6, (13 / 420 + 3 * phi / 40 + phi**2 / 24) * l
    e, f = (1 / 105 + phi / 60 + phi**2 / 120) * l**2, (1 / 140 + phi / 60 + phi**2 / 120) * l**2
    moving = np.array([[a, b, c, -d], [b, e, d, -f], [c, d, a, -b], [-d, -f, -b, e]])
    g, h = 6 / 5, (1 / 10 - phi / 2) * l
    i, j = (2 / 15 + phi / 6 + phi**2 / 3) * l**2, (1 / 30 + phi / 6 - phi**2 / 6) * l**2
    turning = np.array([[g, h, -g, h], [h, i, -h, -j], [-g, -h, g, -h], [h, -j, -h, i]])
    return moving, turning


def _conical_element(part: ShaftPart, start: float, end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrices as of `beam_element` from one place in a conical part to another [m]."""
    length = end - start
    nodes, weights, integral = _quadrature()
    x, weights, integral = 0.5 * length * (1.0 + nodes), 0.5 * length * weights, 0.5 * length * integral
    sections = [part.section((start + here) / part.length) for here in x]
    bend, shear, stretch = (
        1.0 / np.array([getattr(section, name) for section in sections])
        for name in ("bending_stiffness", "shear_stiffness", "area")
    )
    area = part.density / stretch
    rotary = part.density / (part.young * bend)
    # the left end held, a force and a moment (columns) at the right one: tilt and deflection at x
    moment = np.column_stack([length - x, np.ones_like(x)])
    curvature, strain = bend[:, None] * moment, np.outer(shear, [1.0, 0.0])
    tilt = integral @ curvature
    deflection = integral @ (tilt + strain)
    flexibility = (moment.T * (weights * bend)) @ moment
    flexibility[0, 0] += weights @ shear
    stiffness = np.linalg.inv(flexibility)
    # deflection and tilt of the right end beyond those of the rigid body that moves with the left end
    beyond = np.array([[-1.0, -length, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])
    forces, ones, zero = stiffness @ beyond, np.ones_like(x), np.zeros_like(x)
    w = np.column_stack([ones, x, zero, zero]) + deflection @ forces
    psi = np.column_stack([zero, ones, zero, zero]) + tilt @ forces
    tilting = (psi.T * (weights * rotary)) @ psi
    plane = (w.T * (weights * area)) @ w + tilting
    along, along_mass = _two_ended(stretch / part.young, area, weights, integral)
    shear_modulus = part.section(0.0).shear_modulus
    twist, twist_mass = _two_ended(0.5 * part.young * bend / shear_modulus, 2.0 * rotary, weights, integral)
    M = _both_planes(plane, along_mass, twist_mass)
    return M, _both_planes(beyond.T @ forces, along, twist), _gyroscopic(tilting)


def _two_ended(flexibility, mass, weights, integral) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass (2, 2) of a bar in tension or torsion, by flexibility and mass per length at points."""
    k = 1.0 / (weights @ flexibility)
    second = k * (integral @ flexibility)
    shapes = np.column_stack([1.0 - second, second])
    return k * np.array([[1.0, -1.0], [-1.0, 1.0]]), (shapes.T * (weights * mass)) @ shapes


@cache
def _quadrature() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss's points and weights on -1 to 1, and the integrals (n, n) from -1 to every point.

    The last ones are those of the Legendre series through the points:
    ``int P_k = (P_(k+1) - P_(k-1)) / (2 k + 1)``.
    """
    count = QUADRATURE_POINTS
    nodes, weights = np.polynomial.legendre.leggauss(count)
    P = np.polynomial.legendre.legvander(nodes, count)
    series = 0.5 * (2.0 * np.arange(count) + 1.0)[:, None] * (P[:, :count] * weights[:, None]).T
    below = np.column_stack([-np.ones(count), P[:, : count - 1]])
    primitive = (P[:, 1:] - below) / (2.0 * np.arange(count) + 1.0)
    return nodes, weights, primitive @ series
