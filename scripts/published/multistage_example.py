"""Four-stage planetary reducers: an example whose numbers are femgear's own, and a published table.

The example is a drive of 55 kW at 1500 1/min with the ratio 538.6, of the size used at cutter heads and
slewing rings. Teeth, modules and face widths were chosen for moderate tooth forces, masses are those of
steel discs, mesh stiffness is ISO 6336-1 method B, shafts are solid round sections. It reproduces no
published train.

`PUBLISHED` is Table 2 of "Optimized design of dynamic characteristics of planetary gear train" as printed;
`published_train` makes a train of it with what the paper leaves out as arguments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from published.iso6336_stiffness import mesh_stiffness_method_b

from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.profile import BasicRack
from femgear.system.assembler import mesh_elements
from femgear.system.elements import GearMeshes
from femgear.system.fourier import harmonics_of, sample
from femgear.system.rigid_bodies import PlanarBody, PlanarSet, torsional_of_reduced, torsional_set
from femgear.trains.multistage.model import (
    MultistageSet,
    Stage,
    in_series,
    shaft_stiffness,
    stage_of_set,
    train_torques,
)
from femgear.trains.multistage.stages import stage_error
from femgear.trains.planar.model import phased_series

STEEL = 7850.0
"""Density [kg/m^3]."""
TORQUE = 350.0
"""On the first sun [N m]."""
SPEED = 1500.0 * math.pi / 30.0
"""Of the first sun [rad/s]."""
RING_RACK = BasicRack(addendum=0.9, dedendum=1.25, root_radius=0.25)
"""Of the rings; with an addendum of one module their tips would touch the planets' fillets."""
SHAFTS = ((0.045, 0.12), (0.080, 0.18), (0.130, 0.26))
"""Diameter and length [m] of the shafts from each carrier to the next sun."""
MOTOR_INERTIA = 0.35
"""Of the rotor on the first sun [kg m^2]."""
LOAD_INERTIA = 60.0
"""Of the driven machine on the last carrier [kg m^2]."""

PUBLISHED = {
    "sun mass": (0.241, 0.643, 1.753, 2.078),
    "planet mass": (0.575, 0.851, 3.815, 4.917),
    "carrier mass": (1.893, 2.462, 14.721, 20.496),
    "sun base radius": (13.652, 20.173, 31.758, 37.845),
    "planet base radius": (40.254, 41.654, 45.276, 50.716),
    "carrier equivalent radius": (60.492, 64.537, 79.625, 85.911),
    "sun inertia": (19.375, 354.162, 2537.376, 57743.751),
    "planet inertia": (571.163, 665.256, 5748.275, 94865.198),
    "carrier inertia": (6082.317, 86354.195, 136547.627, 197653.804),
    "external mesh stiffness": (9.271e6, 10.867e6, 11.346e7, 15.764e7),
    "internal mesh stiffness": (1.642e7, 2.754e7, 4.751e8, 6.347e8),
}
"""Stages 1 to 4 as printed: kg, mm, kg mm^2, N/mm."""
PUBLISHED_FREQUENCIES = (204.483, 1321.636)
"""Lowest and highest natural frequency that the same paper prints [Hz]; it has none at zero."""


@dataclass(frozen=True)
class StageDesign:
    """Choices from which a stage of the example is made.

    Parameters
    ----------
    teeth : (3,) tuple of int
        Sun, planet, ring.
    planets : int
    module, width : float
        [m]
    sun_support, carrier_support, ring_support, planet_bearing : float
        Radial stiffnesses [N/m].
    ring_torsion : float
        Of the ring in the housing, on ``u`` of its base circle [N/m].
    """

    teeth: tuple[int, int, int]
    planets: int
    module: float
    width: float
    sun_support: float
    carrier_support: float
    ring_support: float
    planet_bearing: float
    ring_torsion: float


DESIGNS = (
    StageDesign((21, 42, 105), 3, 2.5e-3, 40e-3, 1e8, 3e8, 2e9, 3e8, 2e9),
    StageDesign((21, 33, 87), 3, 5e-3, 70e-3, 0.0, 6e8, 4e9, 8e8, 4e9),
    StageDesign((22, 26, 74), 4, 8e-3, 110e-3, 0.0, 1.2e9, 6e9, 1.5e9, 6e9),
    StageDesign((24, 24, 72), 4, 12e-3, 170e-3, 0.0, 2.5e9, 1e10, 3e9, 1e10),
)


def four_stage_train(*, lateral: bool = True) -> MultistageSet:
    """The example train: sun 1 drives, each carrier turns the next sun, all rings are fixed.

    Parameters
    ----------
    lateral : bool
        The shafts between the stages carry the suns, too; otherwise they only twist, and the suns behind the
        first float in their meshes.
    """
    extra = [{} for _ in DESIGNS]
    extra[0]["sun"], extra[-1]["carrier"] = MOTOR_INERTIA, LOAD_INERTIA
    shafts = [shaft_stiffness(*size) for size in SHAFTS]
    return in_series(
        [example_stage(design, inertia=more) for design, more in zip(DESIGNS, extra)],
        torsional=[shaft["torsional"] for shaft in shafts],
        lateral=[shaft["lateral"] if lateral else 0.0 for shaft in shafts],
    )


def published_train(*, planets: int, stiffness_unit: float = 1e3, held: bool = False) -> MultistageSet:
    """Torsional train of the published table, its four stages joined rigidly.

    The paper prints neither number of planets, pressure angles, supports nor couplings. Torsion asks for the
    fewest of them: with rings at rest and equal pressure angles it depends on base radii, inertias, planet
    masses and mesh stiffnesses, and on the circle of the planets' centres, taken as ``(r_s + r_p) / cos 20
    deg``. The printed carrier radius cannot be that circle: in stage 4 it is less than ``r_s + r_p``.

    Parameters
    ----------
    planets : int
        In every stage, at equal angles.
    stiffness_unit : float
        Of the printed mesh stiffnesses [N/m]: 1e3 for the N/mm that stands there.
    held : bool
        The last carrier cannot turn, which leaves no mode at zero.
    """
    pressure_angle, stages = math.radians(20.0), []
    for number in range(4):
        row = {name: values[number] for name, values in PUBLISHED.items()}
        sun, planet = 1e-3 * row["sun base radius"], 1e-3 * row["planet base radius"]
        bodies = {
            name: PlanarBody(row[f"{name} mass"], 1e-6 * row[f"{name} inertia"], 0.0, 0.0)
            for name in ("sun", "planet", "carrier")
        }
        if held and number == 3:
            bodies["carrier"] = replace(bodies["carrier"], torsional_support=math.inf)
        data = PlanarSet(
            **bodies,
            ring=PlanarBody(1.0, 1.0, math.inf, math.inf),
            sun_radius=sun,
            planet_radius=planet,
            ring_radius=sun + 2.0 * planet,
            centre_distance=(sun + planet) / math.cos(pressure_angle),
            planet_angles=2.0 * np.pi * np.arange(planets) / planets,
            pressure_angle_sun_planet=pressure_angle,
            pressure_angle_planet_ring=pressure_angle,
            stiffness_sun_planet=stiffness_unit * row["external mesh stiffness"],
            stiffness_planet_ring=stiffness_unit * row["internal mesh stiffness"],
            planet_bearing=math.inf,
        )
        stages.append(Stage(data=torsional_set(data)))
    return in_series(stages)


def example_gears(design: StageDesign) -> PlanetarySet:
    """Geared set of a design: 20 degrees, no profile shift, planets at equal angles."""
    sun, planet, ring = (0.5 * design.module * z for z in design.teeth)
    rims = (0.3 * sun, 0.5 * planet, ring + 4.0 * design.module)
    gears = [
        Gear(
            z,
            design.module,
            math.radians(20.0),
            0.0,
            design.width,
            rim,
            internal=rack is RING_RACK,
            rack=rack,
        )
        for z, rim, rack in zip(design.teeth, rims, (BasicRack(), BasicRack(), RING_RACK))
    ]
    return close_set(*gears, planet_angles=equal_planet_angles(design.planets))


def example_stage(design: StageDesign, *, inertia: dict[str, float] | None = None) -> Stage:
    """Stage of a design, with further polar inertias [kg m^2] on its members by name."""
    more, geared = inertia or {}, example_gears(design)
    radius = {n: 0.5 * design.module * z for n, z in zip(("sun", "planet", "ring"), design.teeth)}
    rim = geared.ring.rim_radius
    solid = {
        "sun": _disc(design.width, radius["sun"]),
        "planet": _disc(design.width, radius["planet"], 0.5 * radius["planet"]),
        "ring": _disc(design.width, rim, radius["ring"]),
        # two cheeks, together as thick as 0.8 of the face width
        "carrier": _disc(0.8 * design.width, geared.centre_distance + 0.5 * radius["planet"]),
    }
    twist = torsional_of_reduced(design.ring_torsion, geared.ring.base_radius)
    supports = {
        "sun": (design.sun_support, 0.0),
        "planet": (0.0, 0.0),
        "ring": (design.ring_support, twist),
        "carrier": (design.carrier_support, 0.0),
    }
    bodies = {
        name: PlanarBody(mass, polar + more.get(name, 0.0), *supports[name])
        for name, (mass, polar) in solid.items()
    }
    sun_teeth, planet_teeth, _ = design.teeth
    ratios = geared.contact_ratio_sun_planet, geared.contact_ratio_planet_ring
    pairs = (sun_teeth, planet_teeth), (planet_teeth, math.inf)
    stiffness = [
        design.width * mesh_stiffness_method_b(*pair, 0.0, 0.0, ratio)[1]
        for pair, ratio in zip(pairs, ratios)
    ]
    return stage_of_set(
        geared,
        **bodies,
        stiffness_sun_planet=stiffness[0],
        stiffness_planet_ring=stiffness[1],
        planet_bearing=design.planet_bearing,
    )


def stiffness_waves(design: StageDesign, harmonics: int) -> tuple[np.ndarray, np.ndarray]:
    """Harmonics 1 to H of sun-planet and planet-ring stiffness over its mean, at phase zero.

    Stiffness in proportion to the number of tooth pairs in contact: a pair is, from the start s to the end e
    of its path in base pitches from the pitch point, so that ``k_h / k_0 = (exp(-2 pi i h s) - exp(-2 pi i h
    e)) / (pi i h (e - s))``.

    Returns
    -------
    two (H,) complex arrays
    """
    geared, h = example_gears(design), np.arange(1, harmonics + 1)
    waves = []
    for path in (geared.path_sun_planet, geared.path_planet_ring):
        start, end = (one / geared.base_pitch for one in path)
        wave = np.exp(-2j * np.pi * h * start) - np.exp(-2j * np.pi * h * end)
        waves.append(wave / (1j * np.pi * h * (end - start)))
    return waves[0], waves[1]


def example_errors(train: MultistageSet, torque: float, harmonics: int) -> dict[int, np.ndarray]:
    """Transmission errors (2N, H) [m] of every stage: deflection of its meshes under their mean force.

    ``e = F / k(t)`` without its mean, k with as many harmonics as are asked for. It stands for the stiffness
    k(t) in linear models where the dynamic forces are small beside F.
    """
    errors = {}
    on_sun = train_torques(train, torque).sun
    for number, (stage, design) in enumerate(zip(train.stages, DESIGNS), 1):
        data = stage.data
        force = abs(on_sun[number - 1]) / (data.n_planets * data.sun_radius)
        mean = data.stiffness_sun_planet[0], data.stiffness_planet_ring[0]
        waves = stiffness_waves(design, harmonics)
        errors[number] = stage_error(stage, *(force / k * _inverse(wave) for k, wave in zip(mean, waves)))
    return errors


def example_meshes(train: MultistageSet, harmonics: int) -> dict[int, GearMeshes]:
    """Meshes with the stiffness waves, for `multistage_problem`; they do not part."""
    made = {}
    for number, (stage, design) in enumerate(zip(train.stages, DESIGNS), 1):
        waves = stiffness_waves(design, harmonics)
        series = phased_series(*waves, stage.phases, mean=stage.data.mesh_stiffness)
        made[number] = mesh_elements(stage.data, stiffness=series, separates=False)
    return made


def _inverse(wave: np.ndarray) -> np.ndarray:
    """Harmonics 1 to H of ``1 / (1 + wave)``."""
    samples = 32 * len(wave)
    return harmonics_of(1.0 / sample(np.concatenate([[1.0], wave]), samples), len(wave))[1:]


def _disc(width: float, outer: float, inner: float = 0.0) -> tuple[float, float]:
    """Mass [kg] and polar inertia [kg m^2] of a steel disc with a hole."""
    mass = STEEL * math.pi * (outer**2 - inner**2) * width
    return mass, 0.5 * mass * (outer**2 + inner**2)
