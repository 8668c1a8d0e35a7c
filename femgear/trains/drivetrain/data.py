"""Data of a drivetrain: bodies on parallel axes, what joins them, and torques over time.

All axes are parallel to z; rotations are positive about z. The classes of the chain map one to one on the
tables of a case file: numbers, names of bodies, no arrays but the planet angles. Torques are constant or a
series; that of a CSV file is read by `femgear.trains.drivetrain.section`. Names stay apart where two stages
join the same bodies (`numbered`), and the data refuse what no drivetrain can be.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.system.shaft import JointSprings, ShaftSection, beam_element, joint_springs

# Stiffness against the spin, over that of the rotations, that is rounding.
_FREE = 1e-9


@dataclass(frozen=True)
class ChainBody:
    """A rigid body that turns about an axis.

    Parameters
    ----------
    name : str
    mass : float
        [kg]
    inertia : float
        About its axis [kg m^2].
    transverse_inertia : float
        About a diameter [kg m^2]; for the carrier without the planets.
    tilts : bool
        Whether it tilts: x, y, two tilts and the rotation, else x, y and the rotation.
    """

    name: str
    mass: float
    inertia: float
    transverse_inertia: float = 0.0
    tilts: bool = True

    def __post_init__(self):
        check_numbers(f"body {self.name}", self, positive=("mass", "inertia"), least=("transverse_inertia",))
        if self.tilts and not self.transverse_inertia > 0.0:
            raise CaseError(
                f"body {self.name} tilts but has no transverse inertia", code="E-DRIVETRAIN",
                key="transverse_inertia", limit="above 0 kg m^2", remedy="give it one, or set tilts = false",
            )  # fmt: skip


@dataclass(frozen=True)
class ChainShaft:
    """A shaft between the bodies at its ends: two rigid links with a joint of springs, or a beam.

    Parameters
    ----------
    first, second : str
        Bodies.
    length : float
        [m]
    bending, torsion : float, optional
        Springs of the joint [N m/rad]; of the section where not given. Infinite holds the two together.
    shear : float, optional
        Of the joint [N/m]; where not given that of a Timoshenko shaft of this bending stiffness and
        ``shear_ratio``; infinite is the spherical joint.
    shear_ratio : float
        ``Phi`` of the shaft, used where the shear spring is not given.
    section : ShaftSection, optional
    elements : int
        Timoshenko elements of the section; 0 takes the joint of springs, without mass.
    """

    first: str
    second: str
    length: float
    bending: float | None = None
    torsion: float | None = None
    shear: float | None = None
    shear_ratio: float = 0.0
    section: ShaftSection | None = None
    elements: int = 0

    def __post_init__(self):
        name = f"shaft {self.first} to {self.second}"
        check_numbers(name, self, positive=("length",), least=("shear_ratio",))
        given = (self.bending, self.torsion)
        if self.section is None and (None in given or self.elements):
            raise CaseError(
                f"{name} has no section", code="E-DRIVETRAIN",
                limit="bending and torsion, or a section; elements need a section",
            )  # fmt: skip
        if self.elements and any(value is not None for value in (*given, self.shear)):
            raise CaseError(f"{name} has elements and springs", code="E-DRIVETRAIN", limit="one of them")
        for key in ("bending", "torsion", "shear"):
            value = getattr(self, key)
            if value is not None and not value > 0.0:
                raise CaseError(f"{key} of {name} is {value}", code="E-DRIVETRAIN", limit="above 0")
        if int(self.elements) != self.elements or self.elements < 0:
            raise CaseError(f"{name} has {self.elements} elements", code="E-DRIVETRAIN", limit="0 or more")

    @property
    def springs(self) -> JointSprings:
        """Of the joint."""
        bending, torsion, shear = self.bending, self.torsion, self.shear
        if self.section is not None:
            own = joint_springs(self.section, self.length)
            shear = own.shear if bending is None and shear is None else shear
            bending = own.bending if bending is None else bending
            torsion = own.torsion if torsion is None else torsion
        assert bending is not None and torsion is not None  # or there is a section
        if shear is None:
            shear = 12.0 * bending / ((1.0 + self.shear_ratio) * self.length**2)
        return JointSprings(bending, torsion, shear)

    @property
    def element_matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, stiffness, and gyroscopic matrix per unit speed, of one element (10, 10)."""
        assert self.section is not None  # elements need one
        return beam_element(self.section, self.length / self.elements)


@dataclass(frozen=True)
class MeshWave:
    """Rectangular mesh stiffness by the number of tooth pairs in contact.

    Parameters
    ----------
    stiffness : float
        Mean over the mesh period [N/m].
    contact_ratio : float
        Mean number of pairs in contact, 1 or more.
    low_share : float, optional
        Stiffness with the smaller number of pairs over that with the larger; where not given, every pair is
        as stiff as another: the number of pairs over that number and one.
    phase : float
        Fraction of the mesh period by which the wave is ahead.
    backlash : float
        Along the line of action [m]; infinite without back side.
    """

    stiffness: float
    contact_ratio: float
    low_share: float | None = None
    phase: float = 0.0
    backlash: float = math.inf

    def __post_init__(self):
        check_numbers("mesh", self, positive=("stiffness", "contact_ratio"), least=())
        share = self.low_share
        if self.contact_ratio < 1.0 or not math.isfinite(self.phase) or not self.backlash >= 0.0:
            raise CaseError(
                f"a mesh {self}", code="E-DRIVETRAIN",
                limit="contact ratio of 1 or more, a finite phase, a backlash of 0 m or more",
            )  # fmt: skip
        if share is not None and not 0.0 < share <= 1.0:
            raise CaseError(f"low_share of {share}", code="E-DRIVETRAIN", limit="above 0, up to 1")


@dataclass(frozen=True)
class ParallelStage:
    """Two external gears on parallel axes.

    Parameters
    ----------
    first, second : str
        Bodies.
    first_radius, second_radius : float
        Pitch radii [m].
    first_teeth : int
        Teeth of the first gear, for the mesh frequency.
    mesh : MeshWave
    pressure_angle, helix_angle : float
        Transverse pressure angle, helix angle [rad]. A positive helix angle pushes the second gear along z
        where the first drives, against z where the second does.
    direction : float
        Angle of the line from the first to the second axis, from x [rad].
    first_offset, second_offset : float
        Place of the mesh along z from the centre of either body [m], which tilts it.
    driver : str, optional
        The body whose teeth push, which makes its leading flanks the loaded ones; the first where not given.
    """

    first: str
    second: str
    first_radius: float
    second_radius: float
    first_teeth: int
    mesh: MeshWave
    pressure_angle: float = math.radians(20.0)
    helix_angle: float = 0.0
    direction: float = 0.0
    first_offset: float = 0.0
    second_offset: float = 0.0
    driver: str | None = None

    def __post_init__(self):
        name = f"stage {self.first} to {self.second}"
        check_numbers(name, self, positive=("first_radius", "second_radius", "first_teeth"), least=())
        angles = self.pressure_angle, self.helix_angle
        if not (0.0 < angles[0] < 0.5 * math.pi and abs(angles[1]) < 0.5 * math.pi):
            raise CaseError(f"angles {angles} rad of {name}", code="E-DRIVETRAIN", limit="within 90 degrees")
        check_driver(name, self.driver, self.ends)

    @property
    def name(self) -> str:
        return f"{self.first}-{self.second}"

    @property
    def ends(self) -> tuple[str, str]:
        """Both bodies; the first drives where nothing else is said."""
        return self.first, self.second

    @property
    def flank(self) -> int:
        """1 where the first of the ends drives, else -1."""
        return -1 if self.driver == self.second else 1


@dataclass(frozen=True)
class PlanetaryStage:
    """Carrier, sun and planets on the axis of both, with a ring that the housing holds.

    Parameters
    ----------
    carrier, sun : str
        Bodies.
    sun_radius, planet_radius : float
        Pitch radii [m]; the ring's is ``sun + 2 planet``.
    ring_teeth, sun_teeth : int
        For mesh frequency and phases.
    planet_mass, planet_inertia : float
        [kg], about its own axis [kg m^2].
    planet_transverse_inertia : float
        [kg m^2]
    sun_mesh, ring_mesh : MeshWave
        Of one planet; their phases are those of the first one.
    planet_angles : tuple of float
        Ascending, from x when the carrier's phase is zero [rad].
    pressure_angle : float
        [rad]
    planet_bearing : float
        [N/m]; infinite fixes the planets' axes to their pins, so that each has its rotation only.
    driver : str, optional
        Carrier or sun, the one that drives the other; the carrier where not given.
    """

    carrier: str
    sun: str
    sun_radius: float
    planet_radius: float
    ring_teeth: int
    sun_teeth: int
    planet_mass: float
    planet_inertia: float
    planet_transverse_inertia: float
    sun_mesh: MeshWave
    ring_mesh: MeshWave
    planet_angles: tuple[float, ...] = (0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0)
    pressure_angle: float = math.radians(20.0)
    planet_bearing: float = math.inf
    driver: str | None = None

    def __post_init__(self):
        positive = (
            "sun_radius", "planet_radius", "ring_teeth", "sun_teeth", "planet_mass", "planet_inertia",
        )  # fmt: skip
        check_numbers(self.name, self, positive=positive, least=("planet_transverse_inertia",))
        check_driver(f"stage {self.carrier} to {self.sun}", self.driver, self.ends)
        angles = self.planet_angles
        if not angles or not all(math.isfinite(a) for a in angles) or not self.planet_bearing > 0.0:
            raise CaseError(
                f"planets of {self.name}", code="E-DRIVETRAIN",
                limit="one finite angle or more, a bearing stiffness above 0 N/m or infinite",
            )  # fmt: skip
        if any(b <= a for a, b in itertools.pairwise(angles)) or angles[-1] - angles[0] >= 2.0 * math.pi:
            raise CaseError(
                f"planet angles {angles} rad of {self.name}", code="E-DRIVETRAIN",
                limit="ascending within one turn",
            )  # fmt: skip

    @property
    def name(self) -> str:
        return f"{self.carrier}-{self.sun}"

    @property
    def ends(self) -> tuple[str, str]:
        """Carrier and sun; the carrier drives where nothing else is said."""
        return self.carrier, self.sun

    @property
    def flank(self) -> int:
        """1 where the carrier drives, -1 where the sun does."""
        return -1 if self.driver == self.sun else 1

    @property
    def centre_distance(self) -> float:
        """[m]"""
        return self.sun_radius + self.planet_radius

    @property
    def ring_radius(self) -> float:
        """[m]"""
        return self.sun_radius + 2.0 * self.planet_radius


@dataclass(frozen=True)
class ChainBearing:
    """Bearing in the housing, of a body or of a station inside a shaft of several elements.

    Parameters
    ----------
    body : str
        Of a station the first body of its shaft.
    radial : float
        Along x and y [N/m]; infinite holds the body (with no offset).
    tilt : float
        Against tilts [N m/rad]; infinite holds them.
    offset : float
        Place along z from the centre of the body [m].
    torsion : float
        Against rotation [N m/rad], for modes alone: `check_free_spin` refuses it elsewhere.
    other : str, optional
        Second body of the shaft.
    station : int
        Number of the station inside the shaft, from 1 beside the first body; 0 is the body itself.
    """

    body: str
    radial: float
    tilt: float = 0.0
    offset: float = 0.0
    torsion: float = 0.0
    other: str | None = None
    station: int = 0

    def __post_init__(self):
        values = (self.radial, self.tilt, self.torsion)
        if not all(value >= 0.0 for value in values) or not math.isfinite(self.offset + self.torsion):
            raise CaseError(f"a bearing {self}", code="E-DRIVETRAIN", limit="stiffnesses of 0 or more")
        if math.isinf(self.radial) and self.offset:
            raise CaseError(
                f"an infinitely stiff bearing beside the centre of {self.body}", code="E-DRIVETRAIN",
                key="offset", limit="0 m where radial is infinite", remedy="give a finite stiffness",
            )  # fmt: skip


@dataclass(frozen=True)
class Drivetrain:
    """A chain from the driving body to the driven one.

    Parameters
    ----------
    bodies : tuple of ChainBody
    shafts : tuple of ChainShaft
    parallel : tuple of ParallelStage
    planetary : tuple of PlanetaryStage
    bearings : tuple of ChainBearing
        Several of a body add.
    gravity : float
        Along -y [m/s^2].
    damping_ratio : float
        Of all elastic modes with mean mesh stiffnesses.

    Raises
    ------
    CaseError
        Unknown or repeated names, a chain in pieces or with a loop that does not turn (E-DRIVETRAIN).
    """

    bodies: tuple[ChainBody, ...]
    shafts: tuple[ChainShaft, ...] = ()
    parallel: tuple[ParallelStage, ...] = ()
    planetary: tuple[PlanetaryStage, ...] = ()
    bearings: tuple[ChainBearing, ...] = ()
    gravity: float = 9.80665
    damping_ratio: float = 0.0

    def __post_init__(self):
        names = [body.name for body in self.bodies]
        if not names or len(set(names)) < len(names):
            raise CaseError(f"bodies {names}", code="E-DRIVETRAIN", limit="one body or more, no name twice")
        links = [(one.first, one.second) for one in self.shafts]
        links += [one.ends for one in (*self.parallel, *self.planetary)]
        for first, second in (*links, *((one.body, one.body) for one in self.bearings)):
            for name in (first, second):
                if name not in names:
                    raise CaseError(f"there is no body {name!r}", code="E-DRIVETRAIN", limit=", ".join(names))
        if any(first == second for first, second in links):
            raise CaseError("a shaft or stage joins a body to itself", code="E-DRIVETRAIN")
        reached = {names[0]}
        for _ in names:
            reached |= {end for link in links if reached & set(link) for end in link}
        if set(names) - reached:
            raise CaseError(
                f"nothing joins {', '.join(sorted(set(names) - reached))} to {names[0]}", code="E-DRIVETRAIN",
                remedy="add a shaft or a gear stage",
            )  # fmt: skip
        if not 0.0 <= self.damping_ratio < 1.0 or not math.isfinite(self.gravity):
            raise CaseError(
                f"damping ratio {self.damping_ratio}, gravity {self.gravity} m/s^2", code="E-DRIVETRAIN",
                limit="a ratio from 0 to below 1, finite gravity",
            )  # fmt: skip

    def body(self, name: str) -> ChainBody:
        """The body of that name."""
        return next(one for one in self.bodies if one.name == name)


@dataclass(frozen=True)
class TorqueHistory:
    """Torque on one body, linear between the instants and constant outside them.

    Parameters
    ----------
    body : str
    times : (m,) array
        Ascending [s].
    values : (m,) array
        [N m], positive about z.
    """

    body: str
    times: np.ndarray
    values: np.ndarray

    def __post_init__(self):
        times, values = (
            np.atleast_1d(np.array(self.times, float)),
            np.atleast_1d(np.array(self.values, float)),
        )
        fits = times.ndim == 1 and times.shape == values.shape and len(times) > 0
        if not fits or not np.all(np.isfinite([times, values])) or np.any(np.diff(times) <= 0.0):
            raise CaseError(
                f"the torque history of {self.body} has {times.size} instants and {values.size} values",
                code="E-TORQUE", limit="as many finite values as ascending instants, one or more",
            )  # fmt: skip
        for name, array in (("times", times), ("values", values)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def at(self, times) -> np.ndarray:
        """Torque [N m] at any instants [s]."""
        return np.interp(times, self.times, self.values)


def constant_torques(torques: dict[str, float]) -> tuple[TorqueHistory, ...]:
    """Histories of constant torques on bodies [N m]."""
    return tuple(TorqueHistory(body, np.zeros(1), np.array([value])) for body, value in torques.items())


def numbered(names: Sequence[str]) -> list[str]:
    """Names in their order; one that was there before gets the next free number: ``a-b``, ``a-b 2``."""
    found: list[str] = []
    for name in names:
        number, text = 1, name
        while text in found:
            number += 1
            text = f"{name} {number}"
        found.append(text)
    return found


def check_numbers(name: str, data, *, positive, least) -> None:
    """Refuse numbers that are not finite, not above zero, or below zero."""
    for key in (*positive, *least):
        value = getattr(data, key)
        if not math.isfinite(value) or value < 0.0 or (key in positive and value == 0.0):
            raise CaseError(
                f"{key} of {name} is {value}", code="E-DRIVETRAIN", key=key,
                limit="finite, above 0" if key in positive else "finite, 0 or more",
            )  # fmt: skip


def check_driver(name: str, driver: str | None, ends: tuple[str, str]) -> None:
    """Refuse a driver that is none of the two bodies of its stage."""
    if driver is not None and driver not in ends:
        raise CaseError(
            f"{driver!r} drives {name}", code="E-DRIVETRAIN", key="driver", limit=" or ".join(ends),
            remedy="name the body that drives, or leave it out",
        )  # fmt: skip


def check_free_spin(model) -> None:
    """Refuse a chain that turns in bearings with a torsion spring, which would not see the spin."""
    K, rigid = model.system.K, model.rigid
    if np.any(np.abs(K @ rigid) > _FREE * (np.abs(K) @ np.abs(rigid)).max(initial=0.0)):
        raise CaseError(
            "a bearing holds the rotation of a chain that turns", code="E-BEARING", key="bearing.torsion",
            limit="no torsion stiffness against the housing",
            remedy="leave it out; a torque on the body takes its place",
        )  # fmt: skip
