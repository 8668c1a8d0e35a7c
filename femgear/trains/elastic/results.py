"""Results of a case with an elastic ring: modes.nc, dynamics.nc, housing.nc, and the tables of the housing.

Every variable of a file carries its units; complex harmonics are stored as real and imaginary parts and
belong to real motions by ``x(t) = Re sum_h X_h exp(i h omega t)``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Entries
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.case.quantities import RPM
from femgear.exchange.formats import Shapes, Signal, Spectrum, line_extent
from femgear.exchange.sampling import Sampling
from femgear.findings import Finding, percent
from femgear.gears.modifications import FlankForm
from femgear.gears.planetary import mesh_names
from femgear.housing.orders import OrderSpectrum, analyse_band, order_level
from femgear.housing.sensor import (
    SensorLines,
    component_lines,
    hanning_model,
    lines_in_form,
    rounded_lines,
    stored_lines,
)
from femgear.housing.sound import (
    NO_AREAS,
    Cylinder,
    Microphone,
    levels_of,
    microphone_lines,
    power_level,
    pressure_level,
    run_up_signal,
    sampled_signal,
    sound_power,
    sound_pressure,
    stored_sound,
    whole_turns,
)
from femgear.report.response import stored_harmonics
from femgear.report.tables import (
    MANY,
    Block,
    Marks,
    chosen,
    doubtful_excitation,
    in_decibels,
    level_change_at,
    response_doubts,
    shown_level,
    significant,
    tabulate,
)
from femgear.solvers.periodic.solution import CIRCLE
from femgear.solvers.stability.parametric import stability
from femgear.stages.assumptions import assumption_rows
from femgear.stages.friction_source import friction_rows
from femgear.stages.heat_results import heat_rows
from femgear.stages.life_results import life_rows
from femgear.stages.losses_results import efficiency_rows
from femgear.stages.planet_bearings import planet_bearing_rows
from femgear.stages.protocol import StageResult, one_blas_thread
from femgear.stages.static_results import (
    HELD,
    LARGE,
    SIDES,
    UNEQUAL,
    peak_to_peak,
    pressure_doubts,
    root_doubts,
    shares,
)
from femgear.stages.strength import Rating, rate_case, rating_wanted
from femgear.stages.strength_results import (
    computed_load_factors,
    doubts_of,
    dynamic_factors,
    safety_notes,
    safety_rows,
    strength_block,
)
from femgear.stages.stress_reasons import largest_pressure, reason_row
from femgear.storage.contents import Contents
from femgear.storage.results import (
    FOURIER,
    complex_entries,
    coordinates,
    mode_entries,
    response_variables,
)
from femgear.trains.elastic.checks import checked_speeds, dynamics_warnings, housing_warnings
from femgear.trains.elastic.model import RADIAL, TANGENTIAL, ElasticSet, RingModel, ring_field
from femgear.trains.elastic.runup import KINDS, LEVEL_CHANGE, largest_factors, loudest, meeting_columns

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.planetary import Case
    from femgear.case.sections import MeasuredSection
    from femgear.contact.bodies import Bodies
    from femgear.contact.loaded_period import LoadedPeriod
    from femgear.gears.kinematics import Speeds
    from femgear.housing.two_way.response import MeshPaths, TwoWayResponse
    from femgear.housing.two_way.structure import FixedStructure
    from femgear.solvers.stability.parametric import Stability
    from femgear.storage.results import Results
    from femgear.system.system import MeshExcitation, Modes, Response

# what lines of many speeds are rounded to, over the largest acceleration of their speed, and from how many on
_ROUNDED, _MANY = 1e-5, 40
# speeds, and bands at each of them, that are listed
_FEW, _CUTS = 4, 24
_FIRST, _STRONGEST = 6, 4
_MEASURED_SHOWN, _ONE_ORDER = 12, 0.02
"""Lines of a recording that are listed, and the distance of orders that count as one."""
FRICTION_CHANGE = "added by friction to the level of the housing"
_HIGHEST, _EQUIVALENT = "highest frequency of the excitation", "the same with the radiation efficiency one"
_ESTIMATE = "by equivalent radiated power (radiation efficiency one): an estimate from above"
_PARTS = ("sun", "planet, sun side", "planet, ring side", "ring")
"""Flanks in the order of their meshes, below their gears."""
_FORMS = ("sun", "planet_sun_side", "planet_ring_side", "ring")
_OF_LEVEL = "dynamics", "housing"
"""Stages whose findings concern what is heard at operating speeds."""
_HEARD = {"microphone [dB(A) re 20 µPa]": "pressure_level", "sound power [dB(A) re 1 pW]": "power_level"}
BEARING_FACTORS = 0.5, 2.0
"""Multiples of the bearing stiffness of planets between which load sharing is shown."""
_RING_ALONE = "of the ring alone: a casing of 2 to 3.5 times its width that moves as it does radiates 6 to 11 dB more"
"""Sound pressure far away grows with the length that moves, while that is short of a wavelength."""
_NEAR, _COUNTS = 10.0, 0.05
"""Distance of a resonance from an operating speed [%], at most, and share of its level there, at least."""
_SUPPORTED = {
    "turn_multiplier": ("1", "largest Floquet multiplier over a turn of the carrier, at some speeds"),
    "one_way_level": ("m/s^2", "level by the mesh forces of the ring without its supports"),
    "one_way_difference": ("dB", "level over that by the mesh forces of the ring without its supports"),
    "two_way_residual": ("1", "residual of the two-way equations"),
    "two_way_radius": ("1", "spectral radius of the iteration for the two-way response"),
    "two_way_products": ("1", "products with the fluctuating stiffness that its solution took"),
    "order_tail": ("1", "share of the mesh forces in the outer half of the side bands"),
    "dynamic_factor": ("1", "largest mesh force over its mean on the supports, K_v"),
}
_ONE_WAY = "that by the mesh forces of the ring on its foundation, without supports or casing"
_OUTPUTS = {
    "sensor": ("m", "displacement at the sensor, in its direction"),
    "force": ("N", "force of the housing on the ground"),
}
_DIRECTIONS = {RADIAL: "radial", TANGENTIAL: "tangential"}


@dataclass(frozen=True)
class ModesResult(StageResult):
    """Mechanical system with its elastic ring, its loaded state, and its modal basis.

    Parameters
    ----------
    ring : RingModel
        Modes of the elastic ring.
    model : ElasticSet
        System of gears, carrier and ring.
    excitation : MeshExcitation
        Mesh stiffness [N/m], deflection [m] and force [N] over the record.
    modes : Modes
        With mean mesh stiffness.
    bodies : tuple of Bodies
        Flank compliances with the ring on its foundation, and with the ring held.
    state : LoadedPeriod
        Static state of the set on its supports, whatever ``static.members`` shows.
    reach : float
        Frequency for whose excitation the basis was made [Hz].
    symmetry : int
        Turns by ``2 pi/symmetry`` take every planet to the place of one like it.
    entries : Entries
        Entries of the case that the result depends on.
    bearing_share : (2N, 2) array, optional
        Mean force of a mesh over that of all of its kind, with `BEARING_FACTORS` of the planets' bearing
        stiffness; None where planets share equally.
    frictionless : MeshExcitation, optional
        The excitation of the same set without friction, where friction acts.
    """

    ring: RingModel
    model: ElasticSet
    excitation: MeshExcitation
    modes: Modes
    bodies: tuple[Bodies, Bodies]
    state: LoadedPeriod
    reach: float
    symmetry: int
    entries: Entries
    bearing_share: np.ndarray | None = None
    frictionless: MeshExcitation | None = None

    @property
    def max_diameter(self) -> int:
        """Largest nodal diameter of the ring model."""
        return len(self.ring.compliance) - 1

    def contents(self) -> Contents:
        """Collect the contents of modes.nc."""
        modes, model, state, n_max = self.modes, self.model, self.state, self.max_diameter
        record, supported = "mesh supported_position", "static transmission error of the set on its supports"
        between = "compliance between the meshes through their bodies"
        variables = mode_entries(modes) | {
            "nodal_diameter": ("mode", modes.nodal_diameter, "1", "dominant nodal diameter of the ring"),
            "shape": (
                "dof mode",
                modes.shape,
                "kg^-1/2",
                "mode shape of unit mass; rotations in kg^-1/2 m^-1",
            ),
            "mesh_stiffness": ("mesh", modes.mesh_stiffness, "N/m", "mean mesh stiffness, ring taken out"),
            "mesh_deflection": ("mesh mode", modes.mesh_deflection, "kg^-1/2", "mesh deflection of the mode"),
            "supported_ste": (record, state.deflection, "m", supported),
            "supported_force": (record, state.force, "N", "mesh force of the set on its supports"),
            "supported_stiffness": (record, state.stiffness, "N/m", "tangent mesh stiffness on the supports"),
            "flexibility": ("mesh other_mesh", model.system.flexibility, "m/N", between),
        }
        factors = {}
        if self.bearing_share is not None:
            variables["bearing_share"] = (
                "mesh bearing_factor",
                self.bearing_share,
                "1",
                "mean mesh force over that of all of its kind at other bearing stiffnesses of planets",
            )
            words = "bearing stiffness of planets over that of the case"
            factors = {"bearing_factor": ("bearing_factor", np.array(BEARING_FACTORS), "1", words)}
        motions = modes.shape[model.ring_slice].T
        for name, output in (("ring_shape", RADIAL), ("ring_tangential_shape", TANGENTIAL)):
            field = ring_field(self.ring.modes, motions, output, n_max)
            words = f"outer {_DIRECTIONS[output]} displacement, component exp(i n phi)"
            for part in ("real", "imag"):
                variables[f"{name}_{part}"] = ("mode circumferential", getattr(field, part), "kg^-1/2", words)
        names, diameters = mesh_names(len(modes.mesh_stiffness) // 2), np.arange(-n_max, n_max + 1)
        denser = "position in mesh periods, denser near jumps of the stiffness"
        return Contents(
            variables,
            coords={
                "other_mesh": ("other_mesh", names, "1", "gear mesh"),
                "supported_position": ("supported_position", state.position, "1", denser),
                **coordinates(mode=np.arange(1, len(modes.frequency) + 1), dof=modes.dofs, mesh=names),
                **coordinates(circumferential=diameters),
                **factors,
            },
            attrs={
                "title": "modal basis with mean mesh stiffnesses",
                "unknowns": len(model.system.M),
                "planet_angles": model.planet_angles,
                "excitation_reach": self.reach,
            }
            | ({"periods": state.periods} if state.periods > 1 else {}),
        )


@dataclass(frozen=True)
class FixedHousing:
    """Ring and casing that stand still, the forces in them, and those in the ring on its foundation alone.

    Parameters
    ----------
    structure : FixedStructure
        Ring and casing, with their sensors: some at equal distances around the outer surface of a ring on supports,
        then ``sensors`` and ``forces``.
    two_way : TwoWayResponse
        Forces of the meshes in this structure.
    one_way : TwoWayResponse
        Forces of the meshes in the ring on its foundation.
    sensors, forces : tuples of str
        Names of displacements and of forces that it observes.
    missing : str
        As in `HousingResult`.
    judged : JudgedTurn, optional
        What the verdict on its stability is made of.
    """

    structure: FixedStructure
    two_way: TwoWayResponse
    one_way: TwoWayResponse
    sensors: tuple[str, ...] = ()
    forces: tuple[str, ...] = ()
    missing: str = ""
    judged: JudgedTurn | None = None


@dataclass(frozen=True)
class JudgedTurn:
    """What the Floquet verdict over turns of the carrier is made of, which is found when it is asked for.

    Parameters
    ----------
    gears, excitation, structure, paths, damping
        As for `femgear.housing.two_way.turn_stability.turn_stability`.
    carrier_speed : (speeds,) array
        [rad/s]
    at : (n,) int array
        Numbers of the speeds that get a verdict.
    turns : int
        Turns of the carrier after which all repeats.
    harmonics : int
        Mesh harmonics of the stiffness.
    """

    gears: Modes
    excitation: MeshExcitation
    structure: FixedStructure
    paths: MeshPaths
    damping: Any
    carrier_speed: np.ndarray
    at: np.ndarray
    turns: int
    harmonics: int

    @cached_property
    def multiplier(self) -> np.ndarray:
        """Modulus of the largest Floquet multiplier over a turn (speeds,), nan where there is no verdict."""
        from femgear.housing.two_way.turn_stability import turn_stability

        multipliers = np.full(len(self.carrier_speed), np.nan)
        if len(self.at):
            with one_blas_thread():
                multipliers[self.at] = turn_stability(
                    self.gears,
                    self.excitation,
                    self.structure,
                    self.paths,
                    self.carrier_speed[self.at],
                    damping=self.damping,
                    harmonics=self.harmonics,
                ).modulus
        return multipliers ** (1.0 / self.turns)


@dataclass(frozen=True)
class Judged:
    """What the Floquet verdict on a response is made of: `femgear.solvers.stability.parametric.stability`.

    ``modes`` and ``excitation`` of the set, ``mesh_frequency`` (speeds,) [Hz], and the number of mesh ``harmonics``
    of the stiffness.
    """

    modes: Modes
    excitation: MeshExcitation
    mesh_frequency: np.ndarray
    harmonics: int


@dataclass(frozen=True)
class DynamicsResult(StageResult):
    """Periodic response at all speeds of the input, its stability, and the field of the ring.

    ``warnings`` are of all speeds of the case, with the last of them.

    Parameters
    ----------
    input_speed : (speeds,) array
        [rad/s]
    speeds : tuple of Speeds
        Of the members, one a speed of the input.
    response : Response
        Harmonics of the meshes.
    judged : Judged
        What the verdict on its stability is made of.
    dte : (speeds, 2N, H + 1) complex array
        Dynamic transmission error of every mesh, the deflection of the ring included [m].
    ring_radial : (speeds, H + 1, 2 n_max + 1) complex array
        Circumferential components of the radial displacement of the ring at its outer surface [m].
    ring_tangential : (speeds or 1, H + 1, 2 n_max + 1) complex array
        The same of the tangential displacement, at all speeds where a sensor of the case hears it, else at the last.
    ring_teeth : int
        Teeth of the ring: the carrier order of the mesh frequency.
    symmetry : int
        As in `ModesResult`.
    harmonics : int
        Harmonics at the speed of the case that has the most.
    excitation_limit : (speeds,) array
        Frequency at which the excitation ends [Hz].
    level_change : (speeds,) array
        What the level of the housing changes when the excitation ends at ``compared_to`` instead [dB]; nan at
        speeds that were not looked at.
    compared_to : float
        [Hz]
    entries : Entries
        Entries of the case that the result depends on.
    fixed : FixedHousing, optional
        The housing that stands still; all else is of the ring on its foundation.
    friction_change : (speeds,) array, optional
        What the friction of the teeth adds to the level of the housing, where it acts [dB].
    """

    input_speed: np.ndarray
    speeds: tuple[Speeds, ...]
    response: Response
    judged: Judged
    dte: np.ndarray
    ring_radial: np.ndarray
    ring_tangential: np.ndarray
    ring_teeth: int
    symmetry: int
    harmonics: int
    excitation_limit: np.ndarray
    level_change: np.ndarray
    compared_to: float
    entries: Entries
    fixed: FixedHousing | None = None
    friction_change: np.ndarray | None = None

    @cached_property
    @one_blas_thread()
    def stability(self) -> Stability:
        """Floquet verdict at every speed, computed when it is first asked for: what is heard needs none."""
        of = self.judged
        return stability(of.modes, of.excitation, of.mesh_frequency, excitation_harmonics=of.harmonics)

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return bool(np.all(self.response.converged))

    @property
    def residual(self) -> float:
        """Largest relative residual of the solutions."""
        return float(np.max(self.response.residual))

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return self.response.message

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what dynamics.nc says against itself, see `dynamics_warnings`."""
        return dynamics_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of dynamics.nc."""
        response, lines, field = self.response, "speed mesh harmonic", "harmonic circumferential"
        radial, tangential = (
            f"outer {way} displacement of the ring at the last speed" for way in ("radial", "tangential")
        )
        n_max = self.ring_radial.shape[-1] // 2
        entries = (
            ("dte", lines, self.dte, "m", "dynamic transmission error"),
            ("mesh_force", lines, response.force, "N", "dynamic mesh force"),
            ("ring", field, self.ring_radial[-1], "m", radial),
            ("ring_tangential", field, self.ring_tangential[-1], "m", tangential),
        )
        reach = {
            "excitation_limit": ("speed", self.excitation_limit, "Hz", _HIGHEST),
            "level_change": ("speed", self.level_change, "dB", LEVEL_CHANGE),
        }
        if self.friction_change is not None:
            reach["friction_change"] = ("speed", self.friction_change, "dB", FRICTION_CHANGE)
        harmonic, periods = np.arange(response.force.shape[-1]), response.periods
        return Contents(
            response_variables(self) | reach | complex_entries(entries, single=True),
            coords=coordinates(
                speed=self.input_speed / RPM,
                mesh=mesh_names(self.dte.shape[1] // 2),
                harmonic=harmonic if periods == 1 else harmonic / periods,
                circumferential=np.arange(-n_max, n_max + 1),
            ),
            attrs=({"periods": periods} if periods > 1 else {})
            | {
                "title": "periodic response by the spectral method",
                "message": response.message,
                "compared_to": self.compared_to,
                "ring_teeth": self.ring_teeth,
                "fourier_convention": FOURIER,
            },
        )


@dataclass(frozen=True)
class HousingResult(StageResult):
    """What a fixed sensor on the ring or on the housing around it hears at all speeds of the input.

    Parameters
    ----------
    input_speed : (speeds,) array
        [rad/s]
    exact : SensorLines
        Lines of the sensor by the components of the displacement.
    form : str
        ``"exact"`` or ``"linear"``: how the case wants ``lines``.
    points : int
        Points of the ring between which the linear form interpolates.
    harmonics, symmetry : int
        As in `DynamicsResult`.
    excitation_limit : (speeds,) array
        Frequency at which the excitation ends [Hz].
    cylinder : Cylinder
        What radiates.
    microphone : Microphone
        Where that is heard.
    sound : tuple of three (speeds, n_orders) arrays, optional
        Of a housing that stands still the results of `surface_sound`; of a casing whose areas are known those of
        `equivalent_sound` as the first and the last.
    supported : mapping of (speeds,) arrays, K_v (speeds, 2)
        Numbers of `_SUPPORTED`, of a housing that stands still.
    judged : JudgedTurn, optional
        What the verdict on its stability is made of, of a housing that stands still.
    outputs : mapping of (names, (speeds, n_names, n_orders) complex array)
        Lines of each of `_OUTPUTS`.
    missing : str
        What static compliance a casing lacks.
    """

    input_speed: np.ndarray
    exact: SensorLines
    form: str
    points: int
    harmonics: int
    symmetry: int
    excitation_limit: np.ndarray
    cylinder: Cylinder
    microphone: Microphone
    sound: tuple[np.ndarray, np.ndarray | None, np.ndarray] | None = None
    supported: Mapping[str, np.ndarray] = field(default_factory=dict)
    judged: JudgedTurn | None = None
    outputs: Mapping[str, tuple[tuple[str, ...], np.ndarray]] = field(default_factory=dict)
    missing: str = ""

    @cached_property
    def lines(self) -> SensorLines:
        """Lines in the form of the case."""
        return lines_in_form(self.exact, self.form, self.points, self.harmonics)

    @property
    def message(self) -> str:
        """What the lines rest on."""
        return "summed from the periodic response"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what housing.nc says against itself, see `housing_warnings`."""
        return housing_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of housing.nc; `femgear.housing.sensor.stored_lines` reads the lines."""
        exact, words, rounding = self.exact, "radial displacement at the sensor", "none"
        values = exact.displacement
        if len(values) > _MANY:
            values = rounded_lines(exact, _ROUNDED)
            rounding = f"less than {_ROUNDED:g} of the largest acceleration of a speed; smaller lines are zero"
        cylinder, frequency, sound = self.cylinder, exact.frequency, self.sound
        stored: list[Any] = [("lines", "speed order", values, "m", words)]
        if sound is not None:
            stored.append(("pressure", "speed order", sound[0], "Pa", "sound pressure at the microphone"))
        elif not self.supported:
            pressure = sound_pressure(exact, cylinder, self.microphone)
            sound = pressure, *(sound_power(exact, cylinder, equivalent=equivalent) for equivalent in (False, True))
        for kind, (_, moved) in self.outputs.items():
            stored.append((f"{kind}_lines", f"speed {kind} order", moved, *_OUTPUTS[kind]))
        variables = complex_entries(tuple(stored), single=True) | {
            "carrier_speed": ("speed", exact.carrier_speed, "rad/s", "speed of the carrier"),
            "excitation_limit": ("speed", self.excitation_limit, "Hz", _HIGHEST),
            "level": ("speed", order_level(self.lines), "m/s^2", "root mean square of the acceleration"),
        }
        if "sensor" in self.outputs:
            moved = np.swapaxes(self.outputs["sensor"][1], 0, 1)
            level = order_level(replace(exact, displacement=moved)).T
            words = "root mean square of the acceleration of the sensor"
            variables["sensor_level"] = ("speed sensor", level, "m/s^2", words)
        if sound is not None:
            pressure_words, power = "sound pressure level at the microphone, re 20 uPa", "sound power level, re 1 pW"
            levels = {"pressure_level": (pressure_level(sound[0], frequency), f"A-weighted {pressure_words}")}
            if sound[1] is not None:
                levels["power_level"] = power_level(sound[1], frequency), f"A-weighted {power}"
            words = _EQUIVALENT if sound[1] is not None else f"A-weighted {power}, {_ESTIMATE}"
            levels["equivalent_power_level"] = power_level(sound[2], frequency), words
            variables |= {
                name: ("speed", values_of_level, "dB(A)", meaning)
                for name, (values_of_level, meaning) in levels.items()
            }
        judged = {} if self.judged is None else {"turn_multiplier": self.judged.multiplier}
        supported = {
            name: ("speed" if value.ndim == 1 else "speed mesh_kind", value, *_SUPPORTED[name])
            for name, value in {**judged, **self.supported}.items()
        }
        kinds = {"mesh_kind": ("mesh_kind", list(KINDS), "1", "kind of mesh")} if self.supported else {}
        names = {kind: (kind, output[0], "1", f"name of the {kind}") for kind, output in self.outputs.items()}
        order = {"order": ("order", exact.order, "1", "carrier order")}
        return Contents(
            variables | supported,
            coords=coordinates(speed=self.input_speed / RPM) | order | names | kinds,
            attrs=({"missing_compliance": self.missing} if self.missing else {})
            | ({"turns": exact.turns} if exact.turns > 1 else {})
            | {
                "title": "what a sensor fixed on the housing hears",
                "sensor_angle": exact.sensor_angle,
                "form": self.form,
                "points": self.points,
                "method": exact.method,
                "ring_teeth": exact.z_ring,
                "symmetry": self.symmetry,
                "rounding": rounding,
                "microphone_distance": self.microphone.distance,
                "microphone_angle": self.microphone.angle,
                "outer_radius": cylinder.radius,
                "face_width": cylinder.length,
                "air_density": cylinder.density,
                "sound_speed": cylinder.sound_speed,
            },
        )


def verdict(results: Results) -> Iterator[Block]:
    """Tabulate what decides, as far as it was computed: errors, factors, stresses, levels, resonances."""
    stages, rows, notes, marks = results.stages, list[tuple[str, str]](), list[str](), Marks(results.findings)
    if replace(set_deviations(results.case), **dict.fromkeys(_FORMS, FlankForm())).ideal:
        notes.append("teeth and pins without errors")
    if "static" in stages:
        static = results.static
        error = _by_kind(static["mesh"].values, peak_to_peak(static, "ste") * 1e6)
        shown = [f"{significant(value, 3)} µm" for value in map(float, error)]
        text = _kinds("{}", shown, lambda text: marks(text, *LARGE, "W-POSITIONS", of=("static",)))
        rows.append((f"transmission error, peak to peak{_where(static, '')}", text))
    factors, computed, doubts = factors_of_speeds(results), known_factors(results), dict[int, tuple[str, ...]]()
    if "dynamics" in stages:
        if "housing" in stages and "dynamic_factor" in results.housing:
            notes.append("K_v: of the set in the housing that stands still")
        doubts = level_doubts(results, factors.argmax(axis=0).tolist())
        rows.append(("planet load factor K_gamma, mean over all positions", _kinds("{:.3f}", computed["K_gamma"])))
        rows += _unequal(results, computed["K_gamma"], notes)
        codes = _all_of(doubts)
        text = _kinds("{:.3f}", computed["K_v"], lambda text: marks(text, *codes, of=_OF_LEVEL))
        rows.append(("largest dynamic factor K_v, at operating speeds", text))
        rows += friction_rows(results, marks)
    rated = rating_wanted(results.case)
    if rated and "dynamics" not in stages and "K_gamma" in computed:
        text = _kinds("{:.3f}", computed["K_gamma"])
        rows.append((f"planet load factor K_gamma, mean over all positions{_where(results.static, ', static')}", text))
    if "K_Hβ" in computed:
        text = _kinds("{:.3f}", computed["K_Hβ"], lambda text: marks(text, "W-FACE-LOAD", "W-THRUST"))
        rows.append(("face load factor K_Hβ", text))
    if "stress" in stages:
        rows += _stresses(results, marks)
    if rated or "stress" in stages:
        rows += _safeties(results.case, computed, notes, marks, _all_of(doubts))
    if "life" in stages:
        rows += (*life_rows(results.life, marks), *planet_bearing_rows(results.life, marks))
    if "runup" in stages:
        rows.append(("largest dynamic factor K_v of the run-up", largest_factors(results.runup, marks)))
        rows.append(("largest level of the run-up", loudest(results.runup, marks)))
    rows += assumption_rows(results, marks)
    rows += efficiency_rows(results, marks)
    rows += heat_rows(results, marks)
    if rows:
        yield Block("Verdict", rows=tuple(rows), notes=(*notes, *marks.notes))
    if rated:
        yield strength_block(_rated(results.case, computed), KINDS)
    if "dynamics" in stages:
        yield _operating_points(results, factors, doubts)
    if "runup" in stages:
        yield _near_resonances(results.runup, Marks(results.findings))


def level_doubts(results: Results, more: Iterable[int] = ()) -> dict[int, tuple[str, ...]]:
    """Codes of findings that concern dynamic factors and levels, by number of the speeds that tables show, and more."""
    if "dynamics" not in results.stages:
        return {}
    dynamics, changes = results.dynamics, level_changes(results)
    return {
        i: (*doubtful_excitation(changes[i]), *response_doubts(dynamics.isel(speed=i)), "W-DAMPING", "W-FRICTION")
        for i in dict.fromkeys((*chosen(dynamics.sizes["speed"]), *more))
    }


def marked_level(results: Results, i: int, marks: Marks, codes: Iterable[str], *, digits: int = 4) -> str:
    """Write the level of the housing at a speed by its number, with marks of what makes it doubtful [m/s^2]."""
    change = float(level_changes(results)[i])
    level = float(results.housing["level"][i])
    return shown_level(level, change, marks, *codes, "W-POINTS", of=_OF_LEVEL, digits=digits)


def _all_of(doubts: Mapping[int, tuple[str, ...]]) -> tuple[str, ...]:
    """Codes of any of some speeds, each once."""
    return tuple(dict.fromkeys(code for codes in doubts.values() for code in codes))


def _unequal(results: Results, sharing: np.ndarray, notes: list[str]) -> Iterator[tuple[str, str]]:
    """Rows of what K_gamma (2,) rests on, and of the largest share at one instant if it hides that.

    Notes say which model it is of, and what static results show instead.
    """
    most = sharing
    if "modes" in results.stages and "bearing_share" in results.modes:
        names, share = results.modes["mesh"].values, results.modes["bearing_share"].values
        softer, stiffer = (_by_kind(names, column) for column in share.T)
        pairs = ", ".join(f"{kind} {a:.3f} and {b:.3f}" for kind, a, b in zip(KINDS, softer, stiffer))
        yield "K_gamma with half and twice the bearing stiffness", pairs
        notes.append(
            "K_gamma: largest mean share of a planet over the equal one, on supports and bearings; it rests "
            f"on planet.bearing_stiffness = {results.case.planet.bearing_stiffness:.3g} N/m"
        )
    if "modes" in results.stages and "supported_force" in results.modes:
        force = results.modes["supported_force"].values
        most = np.array([(half / half.mean(axis=0)).max() for half in np.split(force, 2)])
    if (most > UNEQUAL * sharing).any():
        yield "largest share at one instant, at rest", _kinds("{:.3f}", most)
        notes.append("at one instant: of the equal share, on the same supports and bearings; K_v contains it")
    shown, mean, held = shares(results.static)
    if not 1.0 / UNEQUAL < shown / most.max() < UNEQUAL:
        percent = 100.0 * shown / results.static.sizes["planet"]
        yield f"largest share of a planet at one position, {held}", f"{shown:.3f} of the equal one ({percent:.2f} %)"
        notes.append(
            "K_gamma, K_v: on supports and bearings; static stresses and load shares (static.members): "
            f"{held}, largest share {mean:.3f} of the equal one as a mean over all positions, {shown:.3f} at one "
            "position" + (": there the teeth alone take up errors of pins, an upper bound" if held == HELD else "")
        )


def _where(static: xr.Dataset, equal: str) -> str:
    """Say on what static results stand where planets do not share equally, else as they are equal."""
    largest, _, held = shares(static)
    return f", {held}" if largest > UNEQUAL else equal


def _by_kind(names, values: np.ndarray) -> np.ndarray:
    """Find the largest values (2,) of sun-planet and planet-ring meshes, of those of all (n_meshes,)."""
    ring = np.array(["ring" in str(name) for name in names])
    return np.array([values[~ring].max(), values[ring].max()])


def _kinds(form: str, values, marked: Callable[[str], str] = str) -> str:
    """Write a value of either kind of mesh, each ``marked`` where it is doubtful."""
    return ", ".join(f"{kind} {marked(form.format(value))}" for kind, value in zip(KINDS, values))


def factors_of_speeds(results: Results) -> np.ndarray:
    """K_v (n_speeds, 2) at all operating speeds, of the set in a housing that stands still; ones without any."""
    if "dynamics" not in results.stages:
        return np.ones((1, 2))
    if "housing" in results.stages and "dynamic_factor" in results.housing:
        return results.housing["dynamic_factor"].values
    return dynamic_factors(results.dynamics, len(KINDS))


def known_factors(results: Results) -> dict[str, np.ndarray]:
    """Load factors (2,) of both kinds of mesh by their symbols, as far as they were computed, ISO 6336-1.

    K_v is the largest at any operating speed, K_gamma the largest mean force of a mesh over that of all of its kind;
    without a response that of the static solution.
    """
    factors = dict[str, np.ndarray]()
    if "dynamics" in results.stages:
        mean = results.dynamics["mesh_force_real"].isel(harmonic=0).values
        of_kinds = mean.reshape(len(mean), len(KINDS), -1)
        sharing = (of_kinds.max(axis=2) / of_kinds.mean(axis=2)).max(axis=0)
        factors = {"K_gamma": np.maximum(sharing, 1.0), "K_v": factors_of_speeds(results).max(axis=0)}
    if "static" in results.stages:
        sharing, face = computed_load_factors(results.static, KINDS)
        factors |= {} if sharing is None else {"K_gamma": factors.get("K_gamma", sharing)}
        factors |= {} if face is None else {"K_Hβ": face}
    return factors


def _stresses(results: Results, marks: Marks) -> Iterator[tuple[str, str]]:
    """Rows of the largest stresses, and of why they differ from those of ISO 6336."""
    stress = results.stress

    def largest(name: str) -> np.ndarray:
        return np.array([half.max(axis=0) for half in np.split(stress[name].values, 2)])

    root = largest("root_worst").ravel()
    contact, worst = largest_pressure(stress).reshape(2, -1).max(axis=1), int(root.argmax())
    where = _where(results.static, ", static")
    titles, number = SIDES[KINDS[worst // 2]], worst % 2
    kinked = root_doubts(results.findings, titles[number], titles[1 - number])
    yield f"largest root stress{where}", marks(f"{root[worst] * 1e-6:.1f} MPa, {_PARTS[worst]}", *kinked)
    pressures = [
        marks(f"{kind} {significant(pressure * 1e-6, 1)} MPa", *pressure_doubts(results.findings, kind, pressure))
        for kind, pressure in zip(KINDS, contact)
    ]
    yield f"largest contact pressure{where}", ", ".join(pressures)
    yield from reason_row(stress)


def _safeties(
    case: Case, computed: Mapping[str, np.ndarray], notes: list[str], marks: Marks, doubts: tuple[str, ...]
) -> Iterator[tuple[str, str]]:
    """Rows of S_F and S_H of ISO 6336 with the load factors (2,) that were computed, by their symbols.

    ``doubts`` are codes of the findings that concern the dynamic factors.
    """
    rating = _rated(case, computed)
    for name, text in safety_rows(rating, KINDS):
        yield name, marks(text, *doubts, *doubts_of(f"{name} {text}"), of=("static", *_OF_LEVEL))
    notes += safety_notes(rating)


def remarks_of_casing(results: Results, stem: str) -> Iterator[str]:
    """Say how a casing of a file radiates, below the lines of a microphone."""
    if stem.startswith("microphone_spectrum") and results.case.housing.structure is not None:
        yield "All of the surface of the casing radiates as large plates do, an estimate from above."


def rate_set(results: Results) -> Rating | None:
    """Rate the teeth of a run with the load factors that it has; None where the case asks for no safeties."""
    if not rating_wanted(results.case):
        return None
    return _rated(results.case, known_factors(results))


def _rated(case: Case, computed: Mapping[str, np.ndarray]) -> Rating:
    """Rate the flanks of a planetary set with the load factors (2,) that were computed, by their symbols."""
    sharing, dynamic, face = (computed.get(symbol) for symbol in ("K_gamma", "K_v", "K_Hβ"))
    return rate_case(case, sharing=sharing, dynamic=dynamic, face=face)


def _operating_points(results: Results, factors: np.ndarray, doubts: Mapping[int, tuple[str, ...]]) -> Block:
    """Tabulate dynamic factors (n_speeds, 2) and level at the operating speeds, with what they assume.

    ``doubts`` are codes of the findings that concern them, by number of the speed.
    """
    dynamics, housing, case = results.dynamics, "housing" in results.stages, results.case
    speeds, shown = dynamics["speed"].values, list(chosen(dynamics.sizes["speed"]))
    marks = Marks(results.findings)

    def marked(text: str, i: int) -> str:
        return marks(text, *doubts[i], of=_OF_LEVEL)

    def level(i: int) -> str:
        return marked_level(results, i, marks, doubts[i])

    columns = {
        "speed [rpm]": lambda i: f"{speeds[i]:.6g}",
        **{f"K_v {kind}": lambda i, k=k: marked(f"{factors[i, k]:.3f}", i) for k, kind in enumerate(KINDS)},
        "level [m/s²]": lambda i: level(i) if housing else "-",
    }
    ring, limit, notes = case.ring, dynamics, list[str]()
    if housing and "one_way_difference" in results.housing:
        apart = results.housing["one_way_difference"].values
        columns["level [m/s²]"] = lambda i: f"{level(i)} ({in_decibels(float(apart[i]))})"
        notes.append(f"level: in brackets how far from {_ONE_WAY} (one way)")
    if housing:
        limit = results.housing
        for text, name in _HEARD.items():
            if name in limit:
                columns[text] = lambda i, name=name: marked(f"{float(limit[name][i]):.1f}", i)
        if "pressure_level" in limit:
            notes.append("dB(A): sound weighted as the ear hears it; 0 dB is a pressure of 20 µPa, of power 1 pW")
        if limit.attrs.get("method") == "casing" and "pressure_level" in limit:
            notes.append(f"microphone: {_ESTIMATE}")
    ends = sorted({f"{1e-3 * float(end):.4g}" for end in limit["excitation_limit"][[0, -1]]}, key=float)
    notes.append(
        f"levels assume: foundation of the ring {ring.foundation_radial:.3g} N/m³ radial, "
        f"{ring.foundation_tangential:.3g} N/m³ tangential; damping ratio {case.dynamics.damping_ratio:g} of "
        f"all modes; excitation up to {' to '.join(ends)} kHz; small motion about the static state"
        + (f"; past a sensor the ring moves by {1e6 * _passing(limit):.3g} um" if housing else "")
    )
    if housing and "pressure_level" in limit and limit.attrs.get("method") != "casing":
        notes.append(f"sound: {_RING_ALONE}")
    return tabulate("At the operating speeds", shown, columns, notes, marks)


def level_changes(results: Results) -> np.ndarray:
    """Find how far a longer excitation changes the level of the housing at every speed (S,) [dB], NaN unknown."""
    if "dynamics" not in results.stages:
        return np.full(results.housing.sizes["speed"], np.nan)
    change = results.dynamics.get("level_change")
    return np.full(results.dynamics.sizes["speed"], np.nan) if change is None else change.values


def _passing(housing: xr.Dataset) -> float:
    """Find the largest displacement of the sensor, peak to peak, by orders below the mesh [m]."""
    lines = stored_lines(housing)
    low = lines.order < lines.z_ring / 2
    turned = np.exp(1j * np.outer(lines.order[low], np.linspace(0, 2 * np.pi * lines.turns, 720)))
    return float(np.ptp(np.real(lines.displacement[:, low] @ turned), axis=-1).max())


def _near_resonances(runup: xr.Dataset, marks: Marks) -> Block:
    """Tabulate the resonances nearest to the operating speeds, of those that count there."""
    value = {str(name): variable.values for name, variable in runup.items() if variable.dims[:1] == ("resonance",)}
    level = np.interp(value["operating_speed"], runup["speed"].values, runup["level"].values)
    near = np.abs(value["distance"]) <= _NEAR
    counts, nearest = np.flatnonzero(near & (value["operating_alone"] >= _COUNTS * level)), list[int]()
    for speed in np.unique(value["operating_speed"][counts]):
        of_speed = counts[value["operating_speed"][counts] == speed]
        nearest += of_speed[np.argsort(np.abs(value["distance"][of_speed]), kind="stable")[:_FEW]].tolist()
    columns = {
        "operating [rpm]": lambda i: f"{value['operating_speed'][i]:.6g}",
        "resonance": lambda i: f"{np.round(value['distance'][i], 1) + 0.0:+.1f} %",
        **meeting_columns(value),
        "alone [m/s²]": lambda i: marks(f"{value['operating_alone'][i]:.3g}", "W-DAMPING"),
    }
    note = (
        f"mesh harmonics within {_NEAR:g} % of a mode that they excite, the nearest {_FEW} of those that "
        f"give {100 * _COUNTS:g} % of the level or more; alone: level there by that mode at that harmonic"
    )
    rows = nearest[: 2 * MANY]
    notes = (note if rows else "none",)
    return tabulate("Resonances near the operating speeds", rows, columns, notes, marks)


def describe_housing(
    data: xr.Dataset,
    changes: np.ndarray | None = None,
    findings: Iterable[Finding] = (),
    doubts: Mapping[int, tuple[str, ...]] = MappingProxyType({}),
) -> Block:
    """Tabulate level and largest lines [m/s^2] at every speed [rpm] of housing.nc.

    ``changes`` (n_speeds,) [dB] are those of `level_changes`; the findings mark levels that are doubtful,
    those of a periodic response at the speeds whose numbers have their codes in ``doubts``.
    """
    marks, count = Marks(findings), data.sizes["speed"]
    changes = np.full(count, np.nan) if changes is None else changes

    def codes(i: int) -> tuple[str, ...]:
        unstable = "turn_multiplier" in data and float(data["turn_multiplier"][i]) > 1.0 + CIRCLE
        return (*doubts.get(i, ()), *(["W-UNSTABLE"] if unstable else []), "W-DAMPING", "W-FRICTION")

    def level(value: Any, i: int) -> str:
        return shown_level(float(value[i]), changes[i], marks, *codes(i), "W-POINTS", of=_OF_LEVEL)

    def marked(text: str, i: int, *more: str) -> str:
        return marks(text, *doubtful_excitation(changes[i]), *codes(i), *more, of=_OF_LEVEL)

    def one_way(i: int) -> str:
        """Write the level by the forces of one way, and how far that of both ways is from it."""
        return f"{level(data.one_way_level, i)} ({in_decibels(float(data.one_way_difference[i]))})"

    audible, both = "pressure_level" in data, "one_way_difference" in data
    columns = {
        "speed [rpm]": lambda i: f"{float(data.speed[i]):.2f}",
        "excited up to [kHz]": lambda i: f"{float(data.excitation_limit[i]) / 1e3:.2f}",
        "rms [m/s^2]": lambda i: level(data.level, i),
        **({"one way [m/s^2]": one_way} if both else {}),
        **(
            {"microphone [dB(A) re 20 µPa]": lambda i: marked(f"{float(data.pressure_level[i]):.1f}", i)}
            if audible
            else {}
        ),
        "largest lines: carrier order (amplitude [m/s^2])": lambda i: marked(
            _largest_lines(data.isel(speed=i)), i, "W-POINTS"
        ),
    }
    form = data.attrs["form"]
    note = f"form of the signal: {form}" + (f", {data.attrs['points']} points" if form == "linear" else "")
    sound_words = (
        "microphone: {microphone_distance:g} m from the ring, which radiates over its face width in a rigid "
        "cylinder into air of {air_density:g} kg/m^3 and {sound_speed:g} m/s; "
    ).format(**data.attrs) + _RING_ALONE
    if data.attrs["method"] == "casing":
        place = f"{data.attrs['microphone_distance']:g} m from the casing"
        sound_words = f"microphone: {place} in a free field, {_ESTIMATE}"
    if not audible:
        sound_words = NO_AREAS
    if both:
        sound_words += f"; one way: {_ONE_WAY}, and how far the level is from it"
        judged = data["turn_multiplier"].values
        judged = judged[np.isfinite(judged)]
        sound_words += f"; {int((judged <= 1.0 + CIRCLE).sum())} of {len(judged)} speeds looked at are stable: "
        sound_words += "largest Floquet multiplier over a turn of the carrier at most 1"
    return tabulate("Housing", chosen(count), columns, (note, sound_words), marks)


def sensor_signals(results: Results, sampling: Sampling) -> Iterator[Signal]:
    """Sample accelerometer and microphone of housing.nc at every speed until all has repeated.

    Then those of runup.nc, where the run has it, during a run-up from its first to its last speed.
    """
    rate = sampling.rate
    for speed, name, unit, order, values in _recordings(results):
        samples = whole_turns(speed, sampling.duration, rate=rate)
        yield Signal(name, unit, rate, sampled_signal(order, values, speed, samples=samples, rate=rate))
    if "runup" in results.stages:
        lines, pressure = run_up_lines(results.runup, results.housing.attrs)
        signals = [("accelerometer_run_up", "m/s^2", lines.acceleration)]
        signals += [] if pressure is None else [("microphone_run_up", "Pa", pressure)]
        for name, unit, values in signals:
            recorded = run_up_signal(lines.order, values, lines.base_speed, duration=sampling.run_up, rate=rate)
            yield Signal(name, unit, rate, recorded, steady=False)


def run_up_lines(runup: xr.Dataset, attributes: Mapping[str, Any]) -> tuple[SensorLines, np.ndarray | None]:
    """Read the lines of the sensor from runup.nc, and compute those of the microphone (n_speeds, n_orders) [Pa].

    ``attributes`` are those of housing.nc: places of both, ring and air. A housing that stands still has
    several nodal diameters a line, and no microphone there.
    """
    lines = _run_up_of_sensor(runup, attributes)
    return lines, microphone_lines(lines, attributes) if lines.method == "exact" else None


def _run_up_of_sensor(runup: xr.Dataset, attributes: Mapping[str, Any]) -> SensorLines:
    """Read the lines of the sensor from runup.nc; see `run_up_lines`."""
    order, carrier = runup["order"].values, runup["carrier_speed"].values
    stored = runup["lines_real"].values + 1j * runup["lines_imag"].values
    displacement = -stored / (np.maximum(order, 1) * carrier[:, None]) ** 2
    place = float(attributes["sensor_angle"]), int(attributes["ring_teeth"])
    return SensorLines(order, displacement, carrier, *place, runup.attrs.get("method", "exact"))


def signal_extent(results: Results, rate: float) -> dict[str, tuple[float, float, float]]:
    """Find the extent of all lines of both sensors by unit, see `femgear.exchange.formats.line_extent`."""
    parts = [(unit, order, np.array([speed]), v[None]) for speed, _, unit, order, v in _recordings(results)]
    if "runup" in results.stages:
        lines, pressure = run_up_lines(results.runup, results.housing.attrs)
        kinds = ("m/s^2", lines.acceleration), ("Pa", pressure)
        parts += [(unit, lines.order, lines.base_speed, signal) for unit, signal in kinds if signal is not None]
    return line_extent(parts, rate)


def order_cuts(results: Results, form: str) -> tuple[list[str], np.ndarray]:
    """Tabulate levels of the sensor over the speeds of runup.nc: of all lines, of the strongest orders.

    The table (n_speeds, columns) has the units of its heads. Its last column tells what a longer excitation changes the
    level of all lines [dB], NaN unknown.
    """
    lines = _run_up_of_sensor(results.runup, results.housing.attrs)
    fluctuating = lines.order > 0
    levels = levels_of(lines.acceleration[:, fluctuating], lines.frequency[:, fluctuating], form)
    strongest = np.sort(np.argsort(-np.abs(lines.acceleration[:, fluctuating]).max(axis=0), kind="stable")[:_CUTS])
    unit = form.replace("dB", "dB re 1e-6 m/s^2")
    names = (f"order {order} [{unit}]" for order in lines.order[fluctuating][strongest])
    header = ["speed [rpm]", f"all lines [{unit.replace('peak', 'peak = sqrt(2) rms')}]", *names]
    speed = results.runup["speed"].values
    change = level_change_at(results.runup, speed)
    columns = [speed, levels[:, -1], levels[:, strongest], change]
    return [*header, "change by a longer excitation [dB]"], np.column_stack(columns)


def sensor_spectra(results: Results) -> Iterator[Spectrum]:
    """List the lines of accelerometer and microphone of housing.nc at every speed and at every order.

    Orders are whole, or multiples of the turns after which all repeats.
    """
    for speed, name, unit, order, values in _recordings(results):
        every = np.zeros(order[-1] + 1, complex)
        every[order] = values
        yield Spectrum(name, unit, speed / (2 * np.pi), every)


def _recordings(results: Results) -> Iterator[tuple[float, str, str, np.ndarray, np.ndarray]]:
    """Speed [rad/s], name, unit, orders and amplitudes of both sensors at every speed.

    Speeds are those of the carrier over the turns after which all repeats, of which orders are multiples.
    """
    housing = results.housing
    for s, rpm in enumerate(housing["speed"].values):
        at_speed = housing.isel(speed=s)
        lines, name = stored_lines(at_speed), np.format_float_positional(rpm, 9, fractional=False, trim="-")
        speed = float(lines.base_speed) / lines.turns
        yield speed, f"accelerometer_{name}_rpm", "m/s^2", lines.number, lines.acceleration
        if "pressure_level" in at_speed:
            exact, pressure = stored_sound(at_speed)
            yield speed, f"microphone_{name}_rpm", "Pa", exact.number, pressure


def ring_shapes(results: Results) -> Shapes:
    """Evaluate the modes of modes.nc at points of the ring's outer surface, in the frame of the carrier."""
    modes, radius = results.modes, float(results.case.ring.outer_radius)
    n = modes["circumferential"].values
    angle = 2 * np.pi * np.arange(4 * (n.max() + 1)) / (4 * (n.max() + 1))
    wave = np.exp(1j * np.outer(n, angle))
    radial, tangential = (
        ((modes[f"{name}_real"].values + 1j * modes[f"{name}_imag"].values) @ wave).real
        for name in ("ring_shape", "ring_tangential_shape")
    )
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = radial * cosine - tangential * sine, radial * sine + tangential * cosine
    return Shapes(
        radius * np.stack([cosine, sine, np.zeros_like(angle)], axis=-1),
        modes["frequency"].values,
        modes["damping_ratio"].values,
        np.stack([x, y, np.zeros_like(x)], axis=-1),
    )


def _largest_lines(housing: xr.Dataset) -> str:
    """Write the five largest lines of one speed."""
    lines = stored_lines(housing)
    amplitude = np.abs(lines.acceleration)
    largest = np.argsort(-amplitude, kind="stable")[:5]
    return ", ".join(f"{lines.order[j]:.8g} ({amplitude[j]:.3g})" for j in largest)


def mesh_bands(results: Results) -> Block:
    """Tabulate dominant lines and lobes around every mesh harmonic of the excitation, at a few speeds."""
    housing, case = results.housing, results.case
    teeth = int(housing.attrs["ring_teeth"])
    rows, threshold = [], 0.0
    for s in checked_speeds(housing.sizes["speed"], _FEW):
        lines = stored_lines(housing.isel(speed=s))
        spectrum, turns = OrderSpectrum(lines.order, lines.acceleration, lines.turns), lines.turns
        windowed = None
        if "dynamics" in results.stages:
            windowed = hanning_spectrum(results.dynamics, housing, planetary_set(case).planet_angles, s)
        rpm = float(housing["speed"][s])
        for h in _shown_harmonics(spectrum, teeth, case.dynamics.mesh_harmonics):
            band = analyse_band(spectrum, teeth, h, count=3)
            threshold = band.lobes.threshold
            two = [_line(line, h * teeth) for line in band.lines[:2]] + ["-", "-"]
            third = f"{band.lines[2].level:.1f}" if len(band.lines) > 2 else "-"
            lobes, hanning = (
                "-" if side is None else f"{len(side.lobes.position) / turns:.4g}"
                for side in (band, windowed and analyse_band(windowed, teeth, h))
            )
            published = _published(case, rpm, h)
            rows.append((f"{rpm:.6g}", str(h), str(h * teeth), *two[:2], third, lobes, hanning, published))
    header = (
        "speed [rpm]",
        "harmonic",
        "order",
        "strongest line [m/s²]",
        "second line [m/s²]",
        "third [dB]",
        "lobes",
        "Hanning lobes",
        "published",
    )
    notes = [
        f"lobes of the envelope a carrier revolution that stand out by {percent(threshold)} of its largest value; "
        "third: level of the third line below the strongest; Hanning lobes: of the classical model, in which "
        "each planet is heard through a Hanning window while it passes the sensor",
        *dict.fromkeys(f"published: {entry.source}" for entry in case.housing.published),
    ]
    if not case.housing.published:
        header, rows = header[:-1], [row[:-1] for row in rows]
    return Block("Around the mesh harmonics", header, tuple(rows), tuple(notes))


def _shown_harmonics(spectrum, teeth: int, given: int | None) -> list[int]:
    """All mesh harmonics of the excitation; of those up to a frequency the first and the strongest ones."""
    highest = round(float(spectrum.order[-1]) / teeth)
    if given is not None:
        return list(range(1, min(given, highest) + 1))
    bands = np.zeros(highest + 1)
    np.maximum.at(bands, np.rint(spectrum.order / teeth).astype(int), spectrum.amplitude)
    strongest = bands[1:].argsort()[::-1][:_STRONGEST] + 1
    return sorted({*range(1, min(_FIRST, highest) + 1), *strongest.tolist()})


def hanning_spectrum(dynamics: xr.Dataset, housing: xr.Dataset, planet_angles, speed: int) -> OrderSpectrum:
    """Compute the order spectrum of the Hanning-window model with the planet-ring forces of dynamics.nc."""
    ring = [str(name).endswith("ring") for name in dynamics["mesh"].values]
    force = stored_harmonics(dynamics.isel(speed=speed), "mesh_force")[ring]
    lines = component_lines(
        hanning_model(force, planet_angles),
        int(housing.attrs["ring_teeth"]),
        float(housing["carrier_speed"][speed]),
        float(housing.attrs["sensor_angle"]),
        periods=int(dynamics.attrs.get("periods", 1)),
    )
    return OrderSpectrum(lines.order, lines.acceleration, lines.turns)


def _published(case, rpm: float, harmonic: int) -> str:
    """What the case file says was published for a speed and mesh harmonic."""
    for entry in case.housing.published:
        if entry.harmonic == harmonic and np.isclose(entry.speed / RPM, rpm):
            lobes = "" if entry.lobes is None else f"; {entry.lobes} lobes"
            return f"{', '.join(map(str, entry.orders))}{lobes}"
    return "-"


def measured_at(case: Case, rpm: float) -> tuple[MeasuredSection, ...]:
    """List the measured lines of a case at a speed of the input [rpm]."""
    return tuple(entry for entry in case.housing.measured if np.isclose(entry.speed / RPM, rpm))


def measured_lines(results: Results) -> tuple[Block, ...]:
    """Tabulate the strongest measured lines of every recording beside the computed ones of the same order."""
    housing, rows = results.housing, []
    for s, rpm in enumerate(map(float, housing["speed"].values)):
        for entry in measured_at(results.case, rpm):
            lines = stored_lines(housing.isel(speed=s))
            computed, height = np.abs(lines.acceleration), np.array(entry.accelerations)
            for k in sorted(np.argsort(-height, kind="stable")[:_MEASURED_SHOWN]):
                near = np.abs(lines.order - entry.orders[k]) <= _ONE_ORDER
                ours = float(computed[near].max(initial=0.0))
                difference = f"{20 * np.log10(height[k] / ours):+.1f}" if ours > 0.0 and height[k] > 0.0 else "-"
                numbers = f"{entry.orders[k]:.6g}", f"{height[k]:.3g}", f"{ours:.3g}" if near.any() else "-", difference
                rows.append((entry.source, f"{rpm:.6g}", *numbers))
    header = ("measured", "speed [rpm]", "order", "measured [m/s²]", "computed [m/s²]", "measured over computed [dB]")
    note = "a dash: no line is computed at this order; femgear measured says what would make it"
    return (Block("Measured lines beside the computed ones", header, tuple(rows), (note,)),) if rows else ()


def _line(line, centre: int) -> str:
    order, sign = line.order, "+" if line.order > centre else "−"
    offset = f" = {centre} {sign} {abs(order - centre):.5g}" if order != centre else ""
    return f"{order:.8g}{offset}: {line.amplitude:.3g}"
