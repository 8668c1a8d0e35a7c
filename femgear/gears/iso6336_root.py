"""Nominal root stress of gears after ISO 6336-3, method B, by a named edition.

sigma_F0 of spur and helical gears, external and internal, with tooth factors only: no application, dynamic or face
load factors. Helical gears are given by their transverse section (`profile.BasicRack`); their roots are those of the
virtual spur gear of the normal section. Teeth and diameters of internal gears are negative here and profile shifts
have the sign of the standard, which for internal gears is minus that of `gear.Gear`.

The editions differ in the helix factor (divided by cos^3 beta in 2019), in the load distribution factor f_eps of 2019,
and in the roots of internal gears: 2006 puts a rack of an equivalent rounding in the place of the pinion cutter, 2019
takes the fillet that the cutter generates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, cutter_of, generating_cutter_tip
from femgear.gears.iso6336 import (
    LATEST_EDITION,
    Edition,
    check_contact_ratio,
    helix_of,
    normal_pressure_angle,
    overlap_of,
)
from femgear.gears.profile import BasicRack, CutterTip, PinionCutter, RackTip, inv, roll

FINE_GRADE = 4
"""Flank tolerance class up to which deep teeth share the load as part 3 says for Y_DT."""


@dataclass(frozen=True)
class NominalRootStress:
    """Nominal root stress of one gear of a pair, its factors and the critical section.

    Parameters
    ----------
    stress : float
        sigma_F0 [Pa].
    form, correction, helix : float
        Y_F, with f_eps, Y_S and Y_beta.
    rim, deep_tooth : float
        Y_B and Y_DT.
    distribution : float
        f_eps, of the edition of 2019; 1 in that of 2006.
    arm, chord, fillet_radius : float
        Bending moment arm h_Fe, thickness of the tooth s_Fn and rho_F at the critical section [m].
    load_angle : float
        alpha_Fen [rad]: angle of the load against the normal of the centreline.
    load_radius : float
        Radius of the outer point of single pair contact, at which the load acts [m]; of helical teeth that of
        the virtual gear, d_en/2.
    edition : int
        2006 or 2019.
    """

    stress: float
    form: float
    correction: float
    helix: float
    rim: float
    deep_tooth: float
    distribution: float
    arm: float
    chord: float
    fillet_radius: float
    load_angle: float
    load_radius: float
    edition: Edition


THINNEST_RIM, THINNEST_RING = 0.5, 1.75
"""Rims that Y_B covers: thicker than this in tooth heights, of internal gears in normal modules."""


@dataclass(frozen=True)
class _VirtualTooth:
    """Tooth of the virtual spur gear of the normal section (ISO 6336-3, section 6.2), of spur gears itself.

    Parameters
    ----------
    teeth : float
        z_n [1], negative for an internal gear.
    module : float
        Normal module m_n [m].
    pressure_angle : float
        Normal pressure angle [rad].
    shift, dedendum, rounding : float
        Profile shift, dedendum of the rack and radius of its tip rounding, in normal modules.
    base_radius : float
        Base radius of the virtual gear [m], negative for an internal gear.
    tip_roll : float
        Roll length of its tip circle [m].
    """

    teeth: float
    module: float
    pressure_angle: float
    shift: float
    dedendum: float
    rounding: float
    base_radius: float
    tip_roll: float

    @property
    def base_pitch(self) -> float:
        """``pi m_n cos(alpha_n)`` [m]."""
        return math.pi * self.module * math.cos(self.pressure_angle)


def root_face_width(face_width: float, common: float, module: float) -> float:
    """Find the face width b_F at the root of a tooth [m] (ISO 6336-3, section 5).

    Of a gear that is wider than the face in common with its mate, at most one module beyond each end of that.
    """
    return min(face_width, common + 2.0 * module)


def root_helix_factor(helix_angle: float, overlap: float, edition: Edition = LATEST_EDITION) -> float:
    """Compute the helix factor of the root Y_beta = ``1 - eps_beta beta/120 deg`` (ISO 6336-3, section 8).

    In the edition of 2019 divided by ``cos^3(beta)``. The overlap ratio counts up to 1, the helix angle [rad] up to
    30 deg.
    """
    angle = min(abs(helix_angle), math.radians(30.0))
    factor = 1.0 - min(overlap, 1.0) * math.degrees(angle) / 120.0
    return factor / math.cos(angle) ** 3 if edition >= 2019 else factor


def load_distribution_factor(contact_ratio: float, overlap: float = 0.0) -> float:
    """Compute f_eps of the virtual contact ratio eps_alphan and the overlap ratio (ISO 6336-3:2019, section 6.1).

    Squared it goes with the overlap ratio from 1, or one half where two pairs always touch, to 1/eps_alphan. Of spur
    teeth from a contact ratio of two on it is 0.7: no pair carries alone at the point that the standard goes on to
    call the outer point of single pair contact, a contact ratio less one base pitches below the tip.
    """
    if overlap == 0.0:
        return 1.0 if contact_ratio < 2.0 else 0.7
    share, alone = min(overlap, 1.0), 1.0 if contact_ratio < 2.0 else 0.5
    return math.sqrt((1.0 - share) * alone + share / contact_ratio)


def rim_factor(rim: float, height: float, module: float, *, internal: bool) -> float:
    """Compute the rim thickness factor Y_B of a gear (ISO 6336-3, section 9).

    External gears ``1.6 ln(2.242 h/s_R)`` with a rim of up to 1.2 tooth heights, internal gears ``1.15 ln(8.324
    m_n/s_R)`` of up to 3.5 modules, else 1. The standard wants more than half a tooth height, or 1.75 modules.

    Parameters
    ----------
    rim, height, module : float
        Thickness of the rim under the root circle, height of the tooth and normal module [m].
    internal : bool
        Whether the teeth point inwards.
    """
    thin = 8.324 * module / rim if internal else 2.242 * height / rim
    limit = rim >= 3.5 * module if internal else rim >= 1.2 * height
    return 1.0 if limit else max((1.15 if internal else 1.6) * math.log(thin), 1.0)


def rim_factor_of(gear: Gear) -> float:
    """Compute the rim thickness factor Y_B of a gear by its own rim, see `rim_factor`."""
    module = gear.module * math.cos(helix_of(gear)[0])
    return rim_factor(*_rim_and_height(gear), module, internal=gear.internal)


def rim_beyond_range(gear: Gear) -> tuple[float, float] | None:
    """Find a rim that is too thin for `rim_factor`: its thickness and the limit; None of one within the range.

    Both in tooth heights, of internal gears in normal modules (ISO 6336-3, section 9).
    """
    rim, height = _rim_and_height(gear)
    size = gear.module * math.cos(helix_of(gear)[0]) if gear.internal else height
    limit = THINNEST_RING if gear.internal else THINNEST_RIM
    return None if rim > limit * size else (rim / size, limit)


def _rim_and_height(gear: Gear) -> tuple[float, float]:
    """Thickness of the rim under the root circle and height of the tooth [m]."""
    return abs(gear.root_radius - gear.rim_radius), abs(gear.tip_radius - gear.root_radius)


def deep_tooth_factor(contact_ratio: float, grade: int | None) -> float:
    """Compute Y_DT of the virtual contact ratio (ISO 6336-3, section 10): below 1 of fine teeth that are deep.

    ``2.366 - 0.666 eps_alphan`` from 2.05 to 2.5 and 0.7 above, with a flank tolerance class of `FINE_GRADE` or
    better; 1 of all others and where no class is given.
    """
    if grade is None or grade > FINE_GRADE or contact_ratio <= 2.05:
        return 1.0
    return max(2.366 - 0.666 * contact_ratio, 0.7)


def nominal_root_stress(
    gear: Gear,
    *,
    contact_ratio: float,
    tangential_force: float,
    common_width: float | None = None,
    edition: Edition = LATEST_EDITION,
    grade: int | None = None,
) -> NominalRootStress:
    """Compute the nominal root stress sigma_F0 [Pa] of a gear, ``F_t/(b m_n) Y_F Y_S Y_beta Y_B Y_DT``.

    The load acts at the outer point of single pair contact of the virtual spur gear, whose contact ratio is
    ``eps_alpha/cos^2(beta_b)``. The critical section is where the tangent of the fillet stands at 30 deg (internal
    gears 60 deg) to the centreline of the tooth.

    Parameters
    ----------
    contact_ratio, tangential_force : float
        Transverse contact ratio with its mate [1]; force at the reference circle [N].
    common_width : float, optional
        Face width that both have in common, where its mate is narrower [m]; see `root_face_width`. The
        overlap ratio is that of this width.
    edition : int
        2006 or 2019.
    grade : int, optional
        Flank tolerance class of ISO 1328-1, for `deep_tooth_factor`.

    Raises
    ------
    GeometryError
        Contact ratio of the virtual gear outside the range of the method, or a tooth that has no such section
        (E-ISO6336).
    """
    helix, base_helix = helix_of(gear)
    contact_ratio = contact_ratio / math.cos(base_helix) ** 2
    check_contact_ratio(contact_ratio)
    tooth, common = _virtual_tooth(gear), common_width or gear.face_width
    section = _generated_section if gear.internal and edition >= 2019 else _section_of_the_rack
    chord, fillet, foot = section(gear, tooth)
    arm, angle, radius = _load(tooth, contact_ratio, foot)
    if not (chord > 0.0 and arm > 0.0 and fillet > 0.0):
        raise GeometryError(
            f"the tooth has no critical section: chord {chord:.4g}, arm {arm:.4g}, fillet radius {fillet:.4g} modules",
            code="E-ISO6336",
            limit="all > 0",
            remedy="the root of this tooth is outside the range of method B",
        )
    overlap, m = overlap_of(gear, common), tooth.module
    share = load_distribution_factor(contact_ratio, overlap) if edition >= 2019 else 1.0
    form = share * 6.0 * arm * math.cos(angle) / (chord**2 * math.cos(tooth.pressure_angle))
    correction = stress_correction(chord / arm, 0.5 * chord / fillet)
    inclined, deep = root_helix_factor(helix, overlap, edition), deep_tooth_factor(contact_ratio, grade)
    thin = rim_factor_of(gear)
    nominal = tangential_force / (root_face_width(gear.face_width, common, m) * m)
    return NominalRootStress(
        stress=nominal * form * correction * inclined * thin * deep,
        form=form,
        correction=correction,
        helix=inclined,
        rim=thin,
        deep_tooth=deep,
        distribution=share,
        arm=arm * m,
        chord=chord * m,
        fillet_radius=fillet * m,
        load_angle=angle,
        load_radius=radius,
        edition=edition,
    )


def stress_correction(slenderness: float, notch: float) -> float:
    """Compute the stress correction factor Y_S (ISO 6336-3), made for 1 <= q_s < 8.

    ``(1.2 + 0.13 L) q_s^(1/(1.21 + 2.3/L))``; slenderness L = s_Fn/h_Fe, notch q_s = s_Fn/(2 rho_F).
    """
    return (1.2 + 0.13 * slenderness) * notch ** (1.0 / (1.21 + 2.3 / slenderness))


def fillet_section(tool: RackTip | CutterTip, slope: float) -> tuple[float, float, float]:
    """Find where the tangent of a generated fillet stands at a slope [rad] to the centreline of the tooth.

    The common normal of tool and fillet passes through the pitch point at its direction ``theta`` from the line of
    centres, see `femgear.gears.profile`; in the frame of the gear the tangent is a right angle further.

    Returns
    -------
    chord, radius, foot : float
        Thickness of the tooth there, radius of curvature of the fillet and distance of the chord from the axis [m].

    Raises
    ------
    GeometryError
        A fillet that has no such tangent (E-ISO6336).
    """

    def point(theta: float) -> np.ndarray:
        radius, angle = tool.fillet_point(theta)
        return np.array([float(radius) * math.cos(float(angle)), float(radius) * math.sin(float(angle))])

    def tangent(theta: float) -> float:
        step = 1e-6 * tool.end_angle
        along = point(theta + step) - point(theta - step)
        return math.atan2(abs(along[1]), abs(along[0]))

    theta = _falling_root(lambda at: tangent(at) - slope, 1e-5 * tool.end_angle, (1.0 - 1e-5) * tool.end_angle)
    step = 1e-4 * tool.end_angle
    before, at, after = (point(theta + shift) for shift in (-step, 0.0, step))
    first, second = (after - before) / (2.0 * step), (after - 2.0 * at + before) / step**2
    curvature = abs(float(first[0] * second[1] - first[1] * second[0])) / math.hypot(*first) ** 3
    return 2.0 * float(at[1]), 1.0 / curvature, float(at[0])


def _falling_root(function: Callable[[float], float], low: float, high: float) -> float:
    """Root of a function that falls from positive to negative, by bisection to the last bit."""
    if not function(low) > 0.0 > function(high):
        raise GeometryError(
            "the fillet has no tangent at the angle of the critical section",
            code="E-ISO6336",
            remedy="the profile shift or the tool is outside the range of method B",
        )
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _virtual_tooth(gear: Gear) -> _VirtualTooth:
    """Tooth of the normal section, ``z_n = z/(cos^2(beta_b) cos(beta))``, ``d_an = d_n + d_a - d``."""
    sign, stretch, alpha = -1.0 if gear.internal else 1.0, gear.rack.stretch, normal_pressure_angle(gear)
    module, teeth = gear.module / stretch, gear.teeth * stretch / math.cos(helix_of(gear)[1]) ** 2
    reference, shift = 0.5 * module * teeth, sign * gear.profile_shift * stretch
    base = reference * math.cos(alpha)
    return _VirtualTooth(
        teeth=sign * teeth,
        module=module,
        pressure_angle=alpha,
        shift=shift,
        dedendum=sign * (gear.reference_radius - gear.root_radius) / module + shift,
        rounding=gear.rack.root_radius * stretch,
        base_radius=base,
        tip_roll=roll(reference + (gear.tip_radius - gear.reference_radius), base),
    )


def _section_of_the_rack(gear: Gear, tooth: _VirtualTooth) -> tuple[float, float, float]:
    """Chord s_Fn, radius rho_F and foot of the moment arm on the centreline [modules], of the rack as tool.

    The foot is the distance of the chord from the axis, negative of an internal gear, whose fillet enters through the
    equivalent rack radius rho_fPv of its pinion cutter (ISO 6336-3:2006, section 6.2).
    """
    z, shift, dedendum = tooth.teeth, tooth.shift, tooth.dedendum
    alpha, rounding, limit = tooth.pressure_angle, tooth.rounding, math.pi / 3.0
    if gear.internal:
        cutter, limit, stretch = cutter_of(gear), math.pi / 6.0, gear.rack.stretch
        tip = rounding if cutter.tip_radius is None else cutter.tip_radius * stretch
        grown = (cutter.profile_shift * stretch + dedendum - tip) ** 1.95 / (3.156 * 1.036**cutter.teeth)
        rounding = tip + grown
    E = 0.25 * math.pi - dedendum * math.tan(alpha) - (1.0 - math.sin(alpha)) * rounding / math.cos(alpha)
    G = rounding - dedendum + shift
    theta = _solve_theta(z, G, 2.0 / z * (0.5 * math.pi - E) - limit, limit)
    offset = G / math.cos(theta) - rounding
    sine, cosine = (1.0, math.sqrt(3.0)) if gear.internal else (math.sqrt(3.0), 1.0)
    chord = z * math.sin(limit - theta) + sine * offset
    # published calculations after the corrected text of 2007 take the teeth of internal gears as positive in
    # this term alone, which makes the radius larger than that of the generated fillet
    growth = 2.0 * G**2 / (math.cos(theta) * (abs(z) * math.cos(theta) ** 2 - 2.0 * G))
    return chord, rounding + growth, 0.5 * (z * math.cos(limit - theta) + cosine * offset)


@dataclass(frozen=True)
class _NormalSection:
    """Numbers of the virtual internal gear of a normal section from which its cutter's tip follows.

    Parameters
    ----------
    teeth, module, pressure_angle, profile_shift, thickness_allowance, rack, base_radius, root_radius
        As of `femgear.gears.gear.Gear`, lengths in m; teeth are no whole number.
    """

    teeth: float
    module: float
    pressure_angle: float
    profile_shift: float
    thickness_allowance: float
    rack: BasicRack
    base_radius: float
    root_radius: float


def _generated_section(gear: Gear, tooth: _VirtualTooth) -> tuple[float, float, float]:
    """Chord, radius and foot as of `_section_of_the_rack`, of the fillet that the cutter generates."""
    cutter, stretch = cutter_of(gear), gear.rack.stretch
    virtual = abs(tooth.teeth) / gear.teeth
    normal = _NormalSection(
        teeth=abs(tooth.teeth),
        module=tooth.module,
        pressure_angle=tooth.pressure_angle,
        profile_shift=-tooth.shift,
        thickness_allowance=gear.thickness_allowance / stretch,
        rack=BasicRack(root_radius=tooth.rounding),
        base_radius=abs(tooth.base_radius),
        root_radius=0.5 * tooth.module * abs(tooth.teeth) + (gear.root_radius - gear.reference_radius),
    )
    rounding = None if cutter.tip_radius is None else cutter.tip_radius * stretch
    of_section = PinionCutter(cutter.teeth, cutter.profile_shift * stretch, rounding)
    tool = generating_cutter_tip(normal, of_section, teeth=virtual * cutter.teeth)
    chord, radius, foot = fillet_section(tool, math.pi / 3.0)
    return chord / tooth.module, radius / tooth.module, -foot / tooth.module


def _solve_theta(z: float, G: float, H: float, start: float) -> float:
    """Root of ``theta = 2 G/z tan(theta) - H`` by Newton's method (ISO 6336-3, section 6.2)."""
    theta = start
    for _ in range(50):
        value = 2.0 * G / z * math.tan(theta) - H - theta
        step = value / (2.0 * G / (z * math.cos(theta) ** 2) - 1.0)
        theta -= step
        if abs(step) < 1e-14:
            return theta
    raise GeometryError(
        "the critical section of the tooth root cannot be found",
        code="E-ISO6336",
        remedy="the profile shift or the rack is outside the range of method B",
    )


def _load(tooth: _VirtualTooth, contact_ratio: float, foot: float) -> tuple[float, float, float]:
    """Arm h_Fe [modules], load angle alpha_Fen and radius [m] of the outer single contact."""
    z, sign = tooth.teeth, math.copysign(1.0, tooth.teeth)
    along = tooth.tip_roll - sign * tooth.base_pitch * (contact_ratio - 1.0)
    radius = math.hypot(along, tooth.base_radius)
    alpha = math.acos(tooth.base_radius / radius)
    half = (0.5 * math.pi + 2.0 * tooth.shift * math.tan(tooth.pressure_angle)) / z
    gamma = half + inv(tooth.pressure_angle) - inv(alpha)
    angle = alpha - gamma
    reach = (math.cos(gamma) - math.sin(gamma) * math.tan(angle)) * sign * 2.0 * radius / tooth.module
    return 0.5 * reach - foot, angle, radius
