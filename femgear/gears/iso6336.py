"""Nominal tooth stresses and mesh stiffness after ISO 6336, for orientation beside what is computed.

sigma_H0 (part 2) and sigma_F0 (part 3, method B) of spur and helical gears with tooth contact factors only:
no application, dynamic or face load factors. The formulas are those of ISO 6336-2:2006 (with the helix factor
of its corrigendum of 2008) and ISO 6336-3:2006, with the factor f_eps of ISO 6336-3:2019 for spur teeth of
contact ratios of two and above. Teeth and diameters of internal gears are negative here and profile shifts
have the sign of the standard, which for internal gears is minus that of `gear.Gear`. Helical gears are given
by their transverse section, whose rack tells the helix angle (`profile.BasicRack`); their roots are those of
the virtual spur gear of the normal section. `mesh_stiffness_method_b` (part 1) is the mesh stiffness of sets
that are given by their teeth alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, cutter_of
from femgear.gears.pair import GearPair
from femgear.gears.profile import base_helix_angle, inv, overlap_ratio, roll

# coefficients C1 .. C9 of the minimum flexibility q', ISO 6336-1:2019, eq. 82 (gears of one module depth)
_C = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
STEEL = 206e9
"""Young's modulus of the steel for which part 1 gives the stiffness of teeth [Pa]."""
THEORETICAL_CORRECTION = 0.8
"""C_M: measured over theoretical stiffness of solid gears."""


@dataclass(frozen=True)
class NominalRootStress:
    """Nominal root stress of one gear of a pair, its factors and the critical section.

    Parameters
    ----------
    stress : float
        sigma_F0 [Pa].
    form, correction, helix : float
        Y_F, with f_eps, Y_S and Y_beta.
    arm, chord, fillet_radius : float
        Bending moment arm h_Fe, thickness of the tooth s_Fn and rho_F at the critical section [m].
    load_angle : float
        alpha_Fen [rad]: angle of the load against the normal of the centreline.
    load_radius : float
        Radius of the outer point of single pair contact, at which the load acts [m]; of helical teeth that of
        the virtual gear, d_en/2.
    """

    stress: float
    form: float
    correction: float
    helix: float
    arm: float
    chord: float
    fillet_radius: float
    load_angle: float
    load_radius: float


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


def helix_of(gear: Gear) -> tuple[float, float]:
    """Find the helix angles of a gear on the reference and the base cylinder [rad], 0 of a spur gear."""
    angle = math.acos(1.0 / gear.rack.stretch)
    return angle, base_helix_angle(_normal_pressure_angle(gear), angle)


def overlap_of(gear: Gear, width: float) -> float:
    """Compute the overlap ratio eps_beta of a gear over a face width [m]."""
    return overlap_ratio(width, gear.module / gear.rack.stretch, helix_of(gear)[0])


def zone_factor(pressure_angle: float, working_angle: float, base_helix: float = 0.0) -> float:
    """Compute the zone factor Z_H (ISO 6336-2, section 6).

    ``sqrt(2 cos(beta_b) cos(alpha_wt) / (cos^2(alpha_t) sin(alpha_wt)))``: pressure angle and working
    pressure angle of the transverse section, and helix angle on the base cylinder, in rad.
    """
    return math.sqrt(2.0 * math.cos(base_helix) / math.tan(working_angle)) / math.cos(pressure_angle)


def elasticity_factor(youngs_modulus: float, poisson_ratio: float, mate: tuple[float, float] | None = None) -> float:
    """Compute Z_E = ``1/sqrt(pi ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2))`` [Pa^0.5] (ISO 6336-2, section 7).

    Young's modulus [Pa] and Poisson's ratio of one gear, and of its mate where that has others.
    """
    pair = (youngs_modulus, poisson_ratio), mate or (youngs_modulus, poisson_ratio)
    return 1.0 / math.sqrt(math.pi * sum((1.0 - nu**2) / modulus for modulus, nu in pair))


def root_face_width(face_width: float, common: float, module: float) -> float:
    """Find the face width b_F at the root of a tooth [m] (ISO 6336-3, section 5).

    Of a gear that is wider than the face in common with its mate, at most one module beyond each end of that.
    """
    return min(face_width, common + 2.0 * module)


def material_factor(modulus_1: float, modulus_2: float) -> float:
    """Compute E/E_St of two gears, with which the stiffness of their teeth grows (ISO 6336-1, method B).

    ``E = 2 E_1 E_2/(E_1 + E_2)``, Young's moduli in Pa.
    """
    return 2.0 * modulus_1 / (modulus_1 + modulus_2) * modulus_2 / STEEL


def contact_ratio_factor(contact_ratio: float, overlap: float = 0.0) -> float:
    """Compute the contact ratio factor Z_eps of the transverse contact ratio and the overlap ratio.

    ``sqrt((4 - eps_alpha)/3 (1 - eps_beta) + eps_beta/eps_alpha)``, eps_beta at most 1 (ISO 6336-2,
    section 8).
    """
    _check_contact_ratio(contact_ratio)
    overlap = min(overlap, 1.0)
    return math.sqrt((4.0 - contact_ratio) / 3.0 * (1.0 - overlap) + overlap / contact_ratio)


def contact_helix_factor(helix_angle: float) -> float:
    """Compute the helix factor of the contact Z_beta = ``1/sqrt(cos(beta))`` (ISO 6336-2:2006/Cor 1:2008)."""
    return 1.0 / math.sqrt(math.cos(helix_angle))


def root_helix_factor(helix_angle: float, overlap: float) -> float:
    """Compute the helix factor of the root Y_beta = ``1 - eps_beta beta/120 deg`` (ISO 6336-3:2006).

    The overlap ratio counts up to 1, the helix angle [rad] up to 30 deg (section 8).
    """
    return 1.0 - min(overlap, 1.0) * min(math.degrees(abs(helix_angle)), 30.0) / 120.0


def nominal_contact_stress(
    gear_1: Gear,
    gear_2: Gear,
    *,
    working_angle: float,
    contact_ratio: float,
    tangential_force: float,
    youngs_modulus: float,
    poisson_ratio: float,
    mate: tuple[float, float] | None = None,
) -> float:
    """Compute the nominal contact stress sigma_H0 [Pa] of a gear pair (ISO 6336-2, section 5).

    ``Z_H Z_E Z_eps Z_beta sqrt(F_t/(d_1 b) (u + 1)/u)``

    Parameters
    ----------
    gear_1 : Gear
        The external gear; of two, that with fewer teeth.
    gear_2 : Gear
        For an internal gear u is negative.
    working_angle : float
        Transverse working pressure angle of the pair [rad].
    contact_ratio : float
        Transverse contact ratio, 1 to 2.5.
    tangential_force : float
        F_t at the reference circle [N]: torque over reference radius, not negative.
    youngs_modulus, poisson_ratio : float
        Of both gears [Pa, 1].
    mate : (float, float), optional
        Those of one of them, where they differ.

    Raises
    ------
    GeometryError
        Contact ratio outside the range of the method (E-ISO6336).
    """
    width, (helix, base_helix) = min(gear_1.face_width, gear_2.face_width), helix_of(gear_1)
    zone = zone_factor(gear_1.pressure_angle, working_angle, base_helix)
    elasticity = elasticity_factor(youngs_modulus, poisson_ratio, mate)
    ratio = contact_ratio_factor(contact_ratio, overlap_of(gear_1, width))
    u = (-gear_2.teeth if gear_2.internal else gear_2.teeth) / gear_1.teeth
    line = tangential_force / (2.0 * gear_1.reference_radius * width) * (u + 1.0) / u
    return zone * elasticity * ratio * contact_helix_factor(helix) * math.sqrt(line)


def nominal_root_stress(
    gear: Gear, *, contact_ratio: float, tangential_force: float, common_width: float | None = None
) -> NominalRootStress:
    """Compute the nominal root stress sigma_F0 [Pa] of a gear, ``F_t/(b m_n) Y_F Y_S Y_beta``.

    The load acts at the outer point of single pair contact of the virtual spur gear, whose contact ratio is
    ``eps_alpha/cos^2(beta_b)``; of spur teeth, from a contact ratio of two on, the part
    `load_distribution_factor` of it. The edition of 2019 has that factor for helical teeth too, with another
    Y_beta; with the Y_beta of 2006 it is left out, on the safe side. Rim and deep-tooth factors are 1. The
    critical section is where the tangent of the fillet stands at 30 deg (internal gears 60 deg) to the
    centreline of the tooth; the fillet of an internal gear enters through the equivalent rack radius rho_fPv
    of its pinion cutter (ISO 6336-3, section 6.2).

    Parameters
    ----------
    contact_ratio, tangential_force : float
        As for `nominal_contact_stress`, with its mate [1, N].
    common_width : float, optional
        Face width that both have in common, where its mate is narrower [m]; see `root_face_width`. The
        overlap ratio is that of this width.

    Raises
    ------
    GeometryError
        Contact ratio of the virtual gear outside the range of the method, or a tooth that has no such section
        (E-ISO6336).
    """
    helix, base_helix = helix_of(gear)
    contact_ratio = contact_ratio / math.cos(base_helix) ** 2
    _check_contact_ratio(contact_ratio)
    tooth, common = _virtual_tooth(gear), common_width or gear.face_width
    chord, fillet, direction, offset = _critical_section(gear, tooth)
    arm, angle, radius = _load(tooth, contact_ratio, direction, offset)
    if not (chord > 0.0 and arm > 0.0 and fillet > 0.0):
        raise GeometryError(
            f"the tooth has no critical section: chord {chord:.4g}, arm {arm:.4g}, fillet radius {fillet:.4g} modules",
            code="E-ISO6336",
            limit="all > 0",
            remedy="the root of this tooth is outside the range of method B",
        )
    form = 6.0 * arm * math.cos(angle) / (chord**2 * math.cos(tooth.pressure_angle))
    form *= load_distribution_factor(contact_ratio) if helix == 0.0 else 1.0
    correction = stress_correction(chord / arm, 0.5 * chord / fillet)
    inclined, m = root_helix_factor(helix, overlap_of(gear, common)), tooth.module
    nominal = tangential_force / (root_face_width(gear.face_width, common, m) * m)
    return NominalRootStress(
        stress=nominal * form * correction * inclined,
        form=form,
        correction=correction,
        helix=inclined,
        arm=arm * m,
        chord=chord * m,
        fillet_radius=fillet * m,
        load_angle=angle,
        load_radius=radius,
    )


def load_distribution_factor(contact_ratio: float) -> float:
    """Compute f_eps (ISO 6336-3:2019, of spur teeth): 0.7 where two pairs or more always carry, else 1.

    At a contact ratio of two and above no pair carries alone at the point that the standard goes on to call
    the outer point of single pair contact, a contact ratio less one base pitches below the tip.
    """
    return 1.0 if contact_ratio < 2.0 else 0.7


def stress_correction(slenderness: float, notch: float) -> float:
    """Compute the stress correction factor Y_S (ISO 6336-3), made for 1 <= q_s < 8.

    ``(1.2 + 0.13 L) q_s^(1/(1.21 + 2.3/L))``; slenderness L = s_Fn/h_Fe, notch q_s = s_Fn/(2 rho_F).
    """
    return (1.2 + 0.13 * slenderness) * notch ** (1.0 / (1.21 + 2.3 / slenderness))


def root_safety(limit: float, nominal: float, load_factor: float, *, reversed_bending: bool) -> float:
    """Compute the safety S_F against breakage of a tooth (ISO 6336-3, section 5), for long life.

    ``sigma_Flim Y_ST Y_M / (sigma_F0 K)`` with Y_ST = 2 and Y_M = 0.7 for teeth that bend both ways (annex B:
    planets); all other factors Y are 1.

    Parameters
    ----------
    limit, nominal : float
        sigma_Flim of the material (ISO 6336-5) and sigma_F0 [Pa].
    load_factor : float
        Product of the factors K of the load.
    """
    return 2.0 * limit * (0.7 if reversed_bending else 1.0) / (nominal * load_factor)


def contact_safety(limit: float, nominal: float, load_factor: float) -> float:
    """Compute the safety S_H against pitting (ISO 6336-2, section 5), for long life.

    ``sigma_Hlim / (sigma_H0 sqrt(K))`` with sigma_Hlim of the material (ISO 6336-5), sigma_H0 [Pa] times
    `single_pair_factor`, and the product K of the factors of the load; all other factors Z are 1.
    """
    return limit / (nominal * math.sqrt(load_factor))


def single_pair_factor(gear_1: Gear, gear_2: Gear, *, working_angle: float, path: tuple[float, float]) -> float:
    """Compute the larger of Z_B, Z_D and 1, from the pitch point to a single pair in contact (ISO 6336-2, 6).

    The root of the relative curvature at the inner point of single contact of either gear over that at the
    pitch point; 1 where two pairs always touch. Helical teeth have the part 1 - eps_beta of what exceeds 1.

    Parameters
    ----------
    gear_1, gear_2 : Gear
        As of `nominal_contact_stress`.
    working_angle : float
        [rad].
    path : (float, float)
        Ends of the path of contact [m], from the pitch point outwards on gear 1.
    """
    low, high, pitch = *path, gear_1.base_pitch
    if high - low >= 2.0 * pitch:
        return 1.0
    inner, outer, middle = (
        relative_curvature(gear_1, gear_2, working_angle=working_angle, path=place)
        for place in (high - pitch, low + pitch, 0.0)
    )
    overlap = min(overlap_of(gear_1, min(gear_1.face_width, gear_2.face_width)), 1.0)
    return 1.0 + (1.0 - overlap) * (math.sqrt(max(inner, outer, middle) / middle) - 1.0)


def relative_curvature(gear_1: Gear, gear_2: Gear, *, working_angle: float, path):
    """Compute the sum of the curvatures of two flanks in contact [1/m], that of an internal gear negative.

    At path coordinates [m] (float or array), 0 at the pitch point and positive outwards on gear 1; the
    working pressure angle in rad. Infinite where a flank begins at its base circle.
    """
    roll_1 = np.maximum(gear_1.base_radius * math.tan(working_angle) + path, 0.0)
    roll_2 = gear_2.base_radius * math.tan(working_angle) + (path if gear_2.internal else -path)
    with np.errstate(divide="ignore"):
        curvature = 1.0 / np.asarray(roll_1) + (-1.0 if gear_2.internal else 1.0) / np.maximum(roll_2, 0.0)
    return curvature if curvature.ndim else float(curvature)


def bending_face_factor(contact_factor, face_width: float, tooth_height: float):
    """Compute the face load factor of the root stress K_F-beta from K_H-beta of the contact (ISO 6336-1).

    ``K_Hbeta^N_F``, ``N_F = 1 / (1 + h/b + (h/b)^2)`` with h/b at most 1/3; face width b and tooth height h
    from root to tip of the gear with the smaller b/h [m].
    """
    ratio = min(tooth_height / face_width, 1 / 3)
    return contact_factor ** (1 / (1 + ratio + ratio**2))


def _normal_pressure_angle(gear: Gear) -> float:
    """Pressure angle of the normal section [rad]."""
    return math.atan(math.tan(gear.pressure_angle) / gear.rack.stretch)


def _virtual_tooth(gear: Gear) -> _VirtualTooth:
    """Tooth of the normal section, ``z_n = z/(cos^2(beta_b) cos(beta))``, ``d_an = d_n + d_a - d``."""
    sign, stretch, alpha = -1.0 if gear.internal else 1.0, gear.rack.stretch, _normal_pressure_angle(gear)
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


def _critical_section(gear: Gear, tooth: _VirtualTooth) -> tuple[float, float, float, float]:
    """Chord s_Fn and radius rho_F [modules] (ISO 6336-3, section 6.2).

    With them what the moment arm follows from: ``pi/3 - theta`` (internal ``pi/6 - theta``) and
    ``G / cos(theta) - rho_fPv``.
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
    chord = z * math.sin(limit - theta) + (1.0 if gear.internal else math.sqrt(3.0)) * offset
    # published calculations after the corrected text of 2007 take the teeth of internal gears as positive in
    # this term alone, which makes the radius larger than that of the generated fillet
    growth = 2.0 * G**2 / (math.cos(theta) * (abs(z) * math.cos(theta) ** 2 - 2.0 * G))
    return chord, rounding + growth, limit - theta, offset


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


def _load(tooth: _VirtualTooth, contact_ratio: float, direction: float, offset: float):
    """Arm h_Fe [modules], load angle alpha_Fen and radius [m] of the outer single contact."""
    z, sign = tooth.teeth, math.copysign(1.0, tooth.teeth)
    along = tooth.tip_roll - sign * tooth.base_pitch * (contact_ratio - 1.0)
    radius = math.hypot(along, tooth.base_radius)
    alpha = math.acos(tooth.base_radius / radius)
    half = (0.5 * math.pi + 2.0 * tooth.shift * math.tan(tooth.pressure_angle)) / z
    gamma = half + inv(tooth.pressure_angle) - inv(alpha)
    angle = alpha - gamma
    reach = (math.cos(gamma) - math.sin(gamma) * math.tan(angle)) * sign * 2.0 * radius / tooth.module
    arm = 0.5 * (reach - z * math.cos(direction) - (math.sqrt(3.0) if z < 0.0 else 1.0) * offset)
    return arm, angle, radius


def _check_contact_ratio(contact_ratio: float) -> None:
    """Refuse a transverse contact ratio outside the range of the method (E-ISO6336)."""
    if not 1.0 <= contact_ratio < 2.5:
        raise GeometryError(
            f"nominal stresses for a contact ratio of {contact_ratio:.4g}",
            code="E-ISO6336",
            limit="1 .. 2.5",
            remedy="change tip diameters or profile shifts",
        )


def theoretical_single_stiffness(
    teeth_1: int,
    teeth_2: float,
    shift_1: float,
    shift_2: float,
    *,
    helix_angle: float = 0.0,
    pressure_angle: float = math.radians(20.0),
) -> float:
    """Compute the theoretical stiffness c'_th [N/m^2] of a tooth pair of solid steel discs, per face width.

    ``1/c'_th = C1 + C2/z_n1 + C3/z_n2 + C4 x1 + C5 x1/z_n1 + C6 x2 + C7 x2/z_n2 + C8 x1^2 + C9 x2^2`` in
    mm um/N (ISO 6336-1, method B), fitted to x1 >= x2, -0.5 <= x1 + x2 <= 2 and 100 <= F_bt/b <= 1600 N/mm.

    Parameters
    ----------
    teeth_1 : int
        Of the pinion, the gear with fewer teeth: the formula is not symmetric.
    teeth_2 : float
        Of the wheel; ``math.inf`` for an internal gear.
    shift_1, shift_2 : float
        Profile shifts in modules; for an internal gear 2 the standard's shift enters as printed there, which
        is minus that of `gear.Gear`.
    helix_angle, pressure_angle : float
        [rad], in the normal section; ``z_n = z / (cos^2(beta_b) cos(beta))``.

    Raises
    ------
    GeometryError
        Shifts outside the range of the formula (E-ISO6336).
    """
    virtual = math.cos(base_helix_angle(pressure_angle, helix_angle)) ** 2 * math.cos(helix_angle)
    pinion, wheel = virtual / teeth_1, (0.0 if math.isinf(teeth_2) else virtual / teeth_2)
    terms = (
        1.0,
        pinion,
        wheel,
        shift_1,
        shift_1 * pinion,
        shift_2,
        shift_2 * wheel,
        shift_1**2,
        shift_2**2,
    )
    flexibility = sum(c * t for c, t in zip(_C, terms, strict=True))
    if not flexibility > 0.0:
        raise GeometryError(
            f"ISO 6336-1 method B gives the flexibility {flexibility:.4g} mm um/N",
            code="E-ISO6336",
            limit="> 0",
            remedy="the profile shifts are outside the range of method B (-0.5 <= x1 + x2 <= 2)",
        )
    return 1e9 / flexibility


def basic_rack_factor(*, dedendum: float, pressure_angle: float) -> float:
    """Compute the basic rack factor C_B (ISO 6336-1, method B).

    ``[1 + 0.5 (1.2 - h_fP/m)] [1 - 0.02 (20 deg - alpha_n)]``; ``dedendum`` in modules (the mean of both
    gears when they differ), ``pressure_angle`` [rad].
    """
    return (1.0 + 0.5 * (1.2 - dedendum)) * (1.0 - 0.02 * (20.0 - math.degrees(pressure_angle)))


def mesh_stiffness_method_b(
    teeth_1: int,
    teeth_2: float,
    shift_1: float,
    shift_2: float,
    contact_ratio: float,
    *,
    dedendum: float = 1.2,
    pressure_angle: float = math.radians(20.0),
    helix_angle: float = 0.0,
) -> tuple[float, float]:
    """Compute single stiffness c' and mean mesh stiffness c_gamma_alpha [N/m^2] after ISO 6336-1, method B.

    ``c' = c'_th C_M C_R C_B cos(beta)`` with C_M = 0.8, and ``c_gamma_alpha = c' (0.75 eps_alpha + 0.25)``,
    given for eps_alpha >= 1.2; under it the standard lets c' of spur gears be up to 10 % lower, not applied
    here. Both are for steel (E = 206 GPa) and solid discs, C_R = 1.

    Parameters
    ----------
    teeth_1, teeth_2, shift_1, shift_2, helix_angle
        As for `theoretical_single_stiffness`.
    contact_ratio : float
        Transverse contact ratio eps_alpha, at least 1.
    dedendum, pressure_angle : float
        Basic rack [modules, rad]; the defaults make C_B = 1.

    Returns
    -------
    c_single, c_mean : float
        [N/m^2], per unit face width (1 N/(mm um) = 1e9 N/m^2).

    Raises
    ------
    GeometryError
        Shifts outside the range of the formula (E-ISO6336).
    """
    rack = basic_rack_factor(dedendum=dedendum, pressure_angle=pressure_angle)
    solid = theoretical_single_stiffness(
        teeth_1, teeth_2, shift_1, shift_2, helix_angle=helix_angle, pressure_angle=pressure_angle
    )
    single = solid * THEORETICAL_CORRECTION * rack * math.cos(helix_angle)
    return single, single * (0.75 * contact_ratio + 0.25)


def pair_mesh_stiffness(pair: GearPair, helix_angle: float = 0.0) -> tuple[float, float]:
    """Compute c' and c_gamma_alpha [N/m^2] of a pair with both gears' racks, see `mesh_stiffness_method_b`.

    Gear 1 of the standard is the pinion, whatever comes first in the pair; of gears with as many teeth the
    one with the larger profile shift, for which the formula is fitted. An internal gear counts as endless,
    its shift with the sign of the standard. Gears with a helix angle [rad] are given by their transverse
    section; rack and shifts enter as those of the normal section.
    """
    normal = math.cos(helix_angle)
    pinion, wheel = sorted(pair.gears, key=lambda gear: (gear.internal, gear.teeth, -gear.profile_shift))
    teeth, shift = (math.inf, -wheel.profile_shift) if wheel.internal else (wheel.teeth, wheel.profile_shift)
    return mesh_stiffness_method_b(
        pinion.teeth,
        teeth,
        pinion.profile_shift / normal,
        shift / normal,
        pair.contact_ratio,
        dedendum=0.5 * (pinion.rack.dedendum + wheel.rack.dedendum) / normal,
        pressure_angle=math.atan(math.tan(pinion.pressure_angle) * normal),
        helix_angle=helix_angle,
    )
