"""Gears, deviations and shafts that a case describes; cases are read by `femgear.trains.reading`.

`planetary_set` closes the gears on their centre distance and checks them, `set_deviations` turns
modifications and errors into separations of the loaded flanks, `support_stiffness` what holds members that stand on a
shaft its support stiffness. Refusals name the entries of the case file, with file and line.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache, singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.checks import check_floating
from femgear.case.messages import in_terms_of_the_case, rack_at
from femgear.case.quantities import FREE, LENGTH
from femgear.case.sections import (
    CarrierErrors,
    Case,
    GearErrors,
    RingErrors,
    SunSection,
    face_width,
    gear_material,
)
from femgear.errors import CaseError, FemgearError, GeometryError
from femgear.fe.elasticity import Material
from femgear.fe.shaft import ShaftStep, check_shaft, shaft_support_stiffness, timoshenko_flexibility
from femgear.gears.checks import check_set
from femgear.gears.deviations import (
    Ovality,
    Runout,
    SetDeviations,
    body_separation,
    check_deviations,
    no_deviations,
    tooth_displacements,
)
from femgear.gears.gear import Gear
from femgear.gears.kinematics import torques
from femgear.gears.modifications import (
    EndRelief,
    FlankForm,
    FlankTwist,
    LeadCrowning,
    LeadSlope,
    MeasuredLead,
    MeasuredProfile,
    Modification,
    ProfileCrowning,
    ProfileSlope,
    RootRelief,
    TipRelief,
    check_form,
    roll_at,
)
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.profile import BasicRack, PinionCutter, overlap_ratio, transverse_rack, transverse_tool
from femgear.gears.tips import settled_tips
from femgear.remembered import remembered

if TYPE_CHECKING:
    from femgear.case.sections import CarrierSection, MaterialSection, ModificationSection

_PLAY = 1e-9
"""Play below which there is no back side [m]: what rounding leaves of none."""
_ON_SHAFTS = ("sun", "carrier")
"""Members that may stand on a shaft."""


def need_set(case: Any) -> None:
    """Refuse a case without a planetary set of its own (E-MODEL)."""
    if not isinstance(case, Case):
        raise CaseError(
            f"a {case.model} has no planetary set of its own",
            code="E-MODEL",
            key="model",
            value=case.model,
            remedy="use femgear check and femgear run, or a case without model",
            file=case.location("model"),
        )


@remembered(latest=16)
def planetary_set(case: Any) -> PlanetarySet:
    """Make the gears of a case, closed on their centre distance [m] and checked.

    Profile shifts, or the centre distance, that the case leaves out are found. Gears of a helical case are
    those of its transverse section.

    GeometryError, with file and line: what cannot be made, assembled or run (see
    `femgear.gears.checks.check_set`), and members that float without being held (E-MECHANISM).
    """
    try:
        return checked_set(case)
    except GeometryError as error:
        in_terms_of_the_case(error, case)
        if (error.key or "").endswith("rack.root_radius"):
            _name_root_radius(error, case)
        if case.set.backlash:
            _name_backlash(error, case)
        raise


@singledispatch
def checked_set(case: Any) -> Any:
    """Make the gears of a case, closed on their centre distance and checked; others register their own."""
    need_set(case)
    closed = _closed_set(case)
    check_set(closed, overlap=case_overlap(case, closed))
    check_floating(case, closed)
    return closed


def case_overlap(case: Any, gears: Any) -> float:
    """Compute the overlap ratio of helical teeth on the narrowest face in common; 0 of spur teeth."""
    if case.helix_angle is None:
        return 0.0
    module = gears.gears[0].module * math.cos(case.helix_angle)
    return abs(overlap_ratio(min(gears.mesh_widths), module, case.helix_angle))


def _closed_set(case: Case) -> PlanetarySet:
    """Gears of a case, closed on their centre distance but not yet checked as a set."""
    ring = case.ring
    left_open = (("sun", case.sun.profile_shift), ("ring", ring.profile_shift))
    closed = close_set(
        gear_of(case, case.sun, "sun", case.sun.bore_radius),
        gear_of(case, case.planet, "planet", case.planet.bore_radius),
        gear_of(case, ring, "ring", ring.outer_radius, internal=True),
        planet_angles=case.set.planet_angles or equal_planet_angles(case.set.planets),
        centre_distance=case.set.centre_distance,
        find=tuple(name for name, shift in left_open if shift is None),
    )
    return settled_tips(closed, free=free_tips(case))


def free_tips(case: Any) -> tuple[str, ...]:
    """List the gears of a case whose tips are to run free of their mates."""
    return tuple(name for name in case.gear_names if getattr(case, name).tip_diameter == FREE)


def gear_of(case: Any, section: Any, name: str, rim: float, *, internal: bool = False) -> Gear:
    """Make a gear of a case from its section; the rim is its bore or outer radius [m].

    Its tip is open until the gears are closed, see `femgear.gears.tips.settled_tips`.
    """
    given, module, pressure_angle = section.rack or case.rack, case.module, case.pressure_angle
    rack = BasicRack(**given.model_dump())
    if case.helix_angle is not None:
        module, pressure_angle = transverse_tool(module, pressure_angle, case.helix_angle)
        rack = transverse_rack(rack, case.helix_angle)
    cutter, tip = None, None if section.tip_diameter == FREE else section.tip_diameter
    if internal and section.cutter_teeth is not None:
        shift = section.cutter_profile_shift * _normal_modules(case)
        cutter = PinionCutter(teeth=section.cutter_teeth, profile_shift=shift)
    return Gear(
        teeth=section.teeth,
        module=module,
        pressure_angle=pressure_angle,
        profile_shift=(section.profile_shift or 0.0) * _normal_modules(case),
        face_width=face_width(case, name),
        rim_radius=rim,
        internal=internal,
        rack=rack,
        cutter=cutter,
        tip_diameter=tip,
        root_diameter=section.root_diameter,
        thickness_allowance=0.5 * case.set.backlash,
        name=name,
        tip_open=True,
    )


def _normal_modules(case: Case) -> float:
    """Normal modules in the module of the gears' section: cos(beta) of helical teeth, 1 of spur teeth."""
    return 1.0 if case.helix_angle is None else math.cos(case.helix_angle)


def _refusal(case: Case) -> str:
    """Code of what is wrong with the gears of a case; empty where nothing is."""
    try:
        checked_set(case)
    except GeometryError as error:
        return error.code
    return ""


def _name_backlash(error: GeometryError, case: Case) -> None:
    """Let a refusal of teeth that the backlash thins too far name it, and its largest value in whole um."""

    def code(steps: int) -> str:
        less = case.set.model_copy(update={"backlash": 1e-6 * steps})
        return _refusal(case.model_copy(update={"set": less}))

    without = code(0)
    if error.code != without:
        steps = range(math.ceil(1e6 * case.set.backlash))
        first = bisect_left(steps, True, key=lambda one: code(one) != without)
        error.key, error.value = "set.backlash", LENGTH.show(case.set.backlash)
        error.limit = f"up to {LENGTH.show(1e-6 * (first - 1))} for these gears, each of which takes half of it"
        error.remedy, error.file = "reduce the backlash, or check its unit", case.location("set.backlash")


def _name_root_radius(error: GeometryError, case: Case) -> None:
    """Let a refusal of the tool's rounding name the largest root radius that can be typed in its place.

    The limit of one gear is not that of the others, and that of a gear whose profile shift is found only
    shows with that shift.
    """
    key = error.key or ""
    most = _largest_root_radius(case, key, ("E-ROOT-RADIUS", "E-FILLET"))
    if error.code == "E-FILLET":
        if most is not None:
            error.remedies = (f"reduce root_radius to {most:.4f} or less", *error.remedies[1:])
        return
    if most is None:
        most = _largest_root_radius(case, key, ("E-ROOT-RADIUS",))
    if most is None:
        error.limit, error.remedy = None, "reduce the dedendum: no root_radius fits"
    else:
        # also where none fits with the one cutter that the gear has then: a smaller rounding may have another
        error.limit = f"<= {most:.4f} modules for the gears of this rack"
        error.remedy = "reduce root_radius"


def _largest_root_radius(case: Case, key: str, codes: tuple[str, ...]) -> float | None:
    """Largest root radius [modules] of four decimals that is not refused with one of the codes, if any."""

    def refused(steps: int) -> bool:
        rack = rack_at(case, key).model_copy(update={"root_radius": steps / 1e4})
        gear = key.partition(".")[0]
        owner = {} if gear == "rack" else {gear: getattr(case, gear).model_copy(update={"rack": rack})}
        return _refusal(case.model_copy(update=owner or {"rack": rack})) in codes

    first = bisect_left(range(round(1e4 * rack_at(case, key).root_radius)), True, key=refused)
    return (first - 1) / 1e4 if first else None


@remembered(latest=16)
def set_deviations(case: Any) -> SetDeviations:
    """Turn modifications and errors of a case into separations of the loaded flanks [m].

    GeometryError: modifications that the flanks cannot have (E-MODIFICATION), with file and line, and what
    `planetary_set` refuses.
    """
    s = planetary_set(case)
    found = made_deviations(case, s)
    try:
        check_deviations(found, s)
    except GeometryError as error:
        error.file = case.location(error.key or "")
        raise
    return found


@singledispatch
def made_deviations(case: Any, s: Any) -> SetDeviations:
    """Make the deviations of a case with the gears `s`, not yet checked; others register their own."""
    sun, ring = case.sun.errors or GearErrors(), case.ring.errors or RingErrors()
    planets = [_planet_errors(case, n) for n in range(1, s.n_planets + 1)]
    pitch = [pitch_of(errors, s.planet) for errors in planets]
    oval, misaligned = ring.ovality, np.zeros((s.n_planets, 2))
    for askew in case.planet.misalignment:
        misaligned[askew.planet - 1] = askew.radial, askew.tangential
    return replace(
        no_deviations(s),
        sun=flank_form(case, s.sun),
        planet_sun_side=flank_form(case, s.planet, "sun side"),
        planet_ring_side=flank_form(case, s.planet, "ring side"),
        ring=flank_form(case, s.ring),
        # a tooth that stands further on brings its left flank nearer to the mate, its right flank away
        sun_pitch=-pitch_of(sun, s.sun),
        planet_pitch=[-displaced for displaced in pitch],
        planet_ring_side_pitch=pitch,
        ring_pitch=-pitch_of(ring, s.ring),
        sun_runout=runout_of(sun),
        planet_runout=tuple(runout_of(errors) for errors in planets),
        ring_runout=runout_of(ring),
        carrier_runout=runout_of(case.carrier.errors or CarrierErrors()),
        pin_errors=pin_errors(case, s),
        ovality=Ovality(**oval.model_dump()) if oval else Ovality(),
        sun_thickness=sun.thickness_reduction or 0.0,
        planet_thickness=[errors.thickness_reduction or 0.0 for errors in planets],
        ring_thickness=ring.thickness_reduction or 0.0,
        planet_misalignment=misaligned,
        **{
            f"{name}_misalignment": (askew.x, askew.y)
            for name in ("sun", "carrier")
            if (askew := getattr(case, name).misalignment) is not None
        },
    )


@singledispatch
def driving_torque(case: Case, torque: float | None = None) -> float:
    """Find the torque on the sun [N m] under one on the input, by default the case's.

    Others register their own.
    """
    value = case.operation.torque if torque is None else torque
    return torques(planetary_set(case), member=case.operation.input, torque=value).sun


def pin_errors(case: Case, gears: PlanetarySet) -> np.ndarray:
    """Collect the displacements of the pins of all planets, radial and tangential, (N, 2) [m]."""
    pins = np.zeros((gears.n_planets, 2))
    for pin in case.set.pin_errors:
        pins[pin.planet - 1] = pin.radial, pin.tangential
    return pins


def _planet_errors(case: Case, number: int) -> GearErrors:
    """Errors of one planet: those of all planets, replaced by what is given for this one."""
    common = case.planet.errors or GearErrors()
    own = next((one for one in case.planet.individual if one.planet == number), None)
    given = {} if own is None else own.model_dump(exclude_unset=True, exclude={"planet"})
    if "pitch" in given or "cumulative_pitch" in given:
        given = {"pitch": None, "cumulative_pitch": None} | given
    return common.model_copy(update=given)


def pitch_of(errors: GearErrors, gear: Gear) -> np.ndarray:
    """Displacement of every tooth on the base circle [m]."""
    return tooth_displacements(gear, cumulative=errors.cumulative_pitch, single=errors.pitch)


def runout_of(errors: CarrierErrors) -> Runout:
    """Make the runout of a table of errors."""
    return Runout(errors.runout_amplitude or 0.0, errors.runout_phase or 0.0)


def flank_form(case: Any, gear: Gear, side: str = "both") -> FlankForm:
    """Form of both flanks of sun or ring, or of a planet's flank on the "sun side" or the "ring side"."""
    found = []
    for i, section in enumerate(getattr(case, gear.name).modifications):
        if getattr(section, "flank", "both") not in (side, "both"):
            continue
        try:
            found.append(_modification(section, gear))
            check_form(FlankForm((found[-1],)), gear)
            if isinstance(found[-1], MeasuredProfile):
                _check_reach(found[-1], gear, f"{gear.name}.modifications[{i}]")
        except GeometryError as error:
            error.key = f"{gear.name}.modifications[{i}]"
            if source := case.profile_files.get(error.key):
                error.message += f" (points of {source})"
            error.file = case.location(error.key)
            raise
    return FlankForm(tuple(found))


def _modification(section: ModificationSection, gear: Gear) -> Modification:
    """Form over the roll length [m]; measured deviations are material, which forms count as taken off."""
    if section.kind == "measured profile":
        angles, diameters = section.roll_angles or (), section.diameters or ()
        rolls = [roll_at(gear, roll_angle=a) or 0.0 for a in angles]
        rolls += [roll_at(gear, diameter=d) or 0.0 for d in diameters]
        points = sorted(zip(rolls, section.deviations or (), strict=True))
        return MeasuredProfile(tuple(r for r, _ in points), tuple(-e for _, e in points))
    if section.kind == "measured lead":
        points = sorted(zip(section.places or (), section.deviations or (), strict=True))
        return MeasuredLead(tuple(z for z, _ in points), tuple(-e for _, e in points))
    start, end = (
        roll_at(
            gear,
            diameter=getattr(section, f"{name}_diameter"),
            roll_angle=getattr(section, f"{name}_roll_angle"),
            length=getattr(section, f"{name}_roll_length"),
        )
        for name in ("start", "end")
    )
    amount = section.amount or 0.0
    match section.kind:
        case "tip relief" | "root relief":
            # a relief without its start is refused when the case is read
            relief = TipRelief if section.kind == "tip relief" else RootRelief
            return relief(amount, start or 0.0, end, section.exponent)
        case "profile slope":
            return ProfileSlope(amount, start, end)
        case "lead slope":
            return LeadSlope(amount)
        case "lead crowning":
            return LeadCrowning(amount)
        case "flank twist":
            return FlankTwist(amount)
        case "end relief":
            return EndRelief(amount, section.length or 0.0)
        case _:
            return ProfileCrowning(amount, start, end)


def _check_reach(profile: MeasuredProfile, gear: Gear, key: str) -> None:
    """Refuse a measured profile that lies beside the flank, with both ranges."""
    low, high = sorted((gear.form_roll, gear.tip_roll))
    if profile.roll[-1] >= low and profile.roll[0] <= high:
        return
    raise GeometryError(
        f"{gear.name}: no part of the measured profile lies on the flank",
        code="E-MODIFICATION",
        key=key,
        value=_range(gear, *profile.roll[:: len(profile.roll) - 1]),
        limit=f"points within {_range(gear, low, high)}",
        remedy="check the unit of its first column and that it belongs to this gear",
    )


def _range(gear: Gear, low: float, high: float) -> str:
    """Two roll lengths as roll angles and diameters, for messages."""
    angles = (math.degrees(roll / gear.base_radius) for roll in (low, high))
    diameters = (2e3 * math.hypot(roll, gear.base_radius) for roll in (low, high))
    return "roll angles {:.4g} to {:.4g} deg, diameters {:.6g} to {:.6g} mm".format(*angles, *diameters)


def line_play(case: Any) -> float:
    """Compute the play of a pair along the line of action [m] with thickness errors; zero for rounding."""
    gears: Any = planetary_set(case)
    play = gears.backlash + body_separation(set_deviations(case), gears, 0.0, back=True)[0, 0]
    return float(play) if play > _PLAY else 0.0


def check_shafts(case: Case) -> None:
    """Refuse parts that make no shaft (GeometryError E-SHAFT, with file and line); no element is made for it."""
    for name in _ON_SHAFTS:
        if getattr(case, name).support_shaft:
            with _of_shaft(case, name):
                check_shaft(_steps(getattr(case, name)))


def support_stiffness(case: Any, member: str, section: Any = None) -> Any:
    """Find the radial stiffness [N/m] that holds a member: the entry of its section, or that of its shaft.

    The member stands on the free end of a stepped cantilever, its face rigidly coupled to the axis, which may
    tilt: ``K = F/X``, see `femgear.fe.shaft.shaft_support_stiffness`. The shaft of the sun is of its
    material, that of the carrier of the section ``material``. The section is by default that of the member.
    None where nothing holds it.
    """
    section = getattr(case, member) if section is None else section
    if not getattr(section, "support_shaft", ()):
        return section.support_stiffness
    with _of_shaft(case, member):
        return _stiffness(_steps(section), _shaft_material(case, member))


@contextmanager
def _of_shaft(case: Case, member: str) -> Iterator[None]:
    """Let a refusal name the shaft of a member, file and line."""
    try:
        yield
    except FemgearError as error:
        error.key = f"{member}.support_shaft"
        error.file = case.location(error.key)
        raise


def shaft_lines(case: Case) -> tuple[str, ...]:
    """Write the support stiffness [N/um] of every shaft in a sentence, that of Timoshenko's beam.

    That of finite elements is computed by the first stage that needs it, see `support_stiffness`.
    """
    lines = []
    for name in _ON_SHAFTS:
        section = getattr(case, name)
        if section.support_shaft:
            beam = 1.0 / timoshenko_flexibility(_steps(section), _shaft_material(case, name))[0, 0]
            lines.append(
                f"support of the {name} from its shaft: {beam * 1e-6:.4g} N/um as a beam; stages take it from "
                "finite elements"
            )
    return tuple(lines)


def support_text(case: Any, member: str, section: Any = None) -> str:
    """Write the radial stiffness [N/m] that holds a member for a table, without computing that of a shaft."""
    section = getattr(case, member) if section is None else section
    return "its shaft" if getattr(section, "support_shaft", ()) else f"{section.support_stiffness:.6g}"


def materials_of(case: Any) -> tuple[Material, ...]:
    """Take the materials of the gears of a case in the order of its set: elasticity and density."""
    return tuple(material_of(case, name) for name in case.gear_names)


def material_of(case: Any, gear: str) -> Material:
    """Take the material of a gear of a case: elasticity [Pa] and density [kg/m^3]."""
    return _elastic(gear_material(case, gear))


def _shaft_material(case: Case, member: str) -> Material:
    """Material of the shaft of a member: that of a gear, or for the carrier that of the case."""
    return _elastic(gear_material(case, member) if member in case.gear_names else case.material)


def _elastic(section: MaterialSection) -> Material:
    return Material(section.youngs_modulus, section.poisson_ratio, section.density)


def _steps(section: SunSection | CarrierSection) -> tuple[ShaftStep, ...]:
    return tuple(ShaftStep(*part.model_dump().values()) for part in section.support_shaft)


_stiffness = lru_cache(maxsize=64)(shaft_support_stiffness)
"""Support stiffness of a shaft [N/m], computed once for equal shafts."""
