"""Strength of ISO 6336 by edition: published reports, test gears, tolerances of ISO 1328-1."""

from __future__ import annotations

import math
from functools import lru_cache

from femgear.gears.gear import Gear
from femgear.gears.gear_steels import GEAR_STEELS, stress_limit
from femgear.gears.iso6336 import (
    Edition,
    bending_face_factor,
    contact_ratio_factor,
    helix_of,
    nominal_contact_stress,
    single_pair_factors,
    zone_factor,
)
from femgear.gears.iso6336_load import (
    disc_inertia,
    dynamic_factor,
    face_load_factor,
    reduced_mass,
    resonance_speed,
)
from femgear.gears.iso6336_root import (
    NominalRootStress,
    fillet_section,
    load_distribution_factor,
    nominal_root_stress,
)
from femgear.gears.iso6336_stiffness import (
    BENDING_SHARE,
    gear_blank_factor,
    pair_mesh_stiffness,
    theoretical_single_stiffness,
)
from femgear.gears.pair import GearPair, close_pair
from femgear.gears.planetary import PlanetarySet, equal_planet_angles
from femgear.gears.profile import (
    BasicRack,
    PinionCutter,
    RackTip,
    base_helix_angle,
    transverse_rack,
    transverse_tool,
)
from femgear.gears.tolerances import flank_tolerances
from validation.rows import Row, information, printed, within

ALPHA = math.radians(20.0)
STAGE_1 = "KISSsoft report, NREL 5 MW gearbox, planetary stage 1"
STAGE_3 = "KISSsoft report, NREL 5 MW gearbox, stage 3 (24/95, 10 deg)"
EXAMPLE = "ISO/TR 6336-30:2017, worked example 1 (17/103, m_n 8, 15.8 deg)"
FZG_C = "FZG test gear C, 16/24, m 4.5, 200 N m, ISO 6336:2006 evaluated by hand"
FZG_H_ISO = "FZG test gear H501, 20/30, m_n 3.5, 15 deg, 100 N m, ISO 6336:2006 evaluated by hand"
FZG_H = "GEARpie, report of FZG gear H501, 20/30, m_n 3.5, 15 deg, 100 N m, DIN 3990"
EDITION_2019 = "KISSsoft reports by ISO 6336:2019 of planetary stages, m_n 40, 15 deg"
TOLERANCES = "ISO 1328-1:2013, eq. 5 to 12 with the rounding of 5.2.3, 40 teeth, m 3, b 30, class 6"
STAGE_1_FORCE, STAGE_3_FORCE = 779454.877, 240064.4
STEEL = {"youngs_modulus": 206e9, "poisson_ratio": 0.3}
HALF_PERCENT = 5e-3


@lru_cache(maxsize=1)
def first_stage() -> PlanetarySet:
    """Planetary stage 1 of the NREL 5 MW gearbox: 19/17/56, m 45, three planets."""

    def gear(teeth, shift, tip, root, rim, rounding, **of_ring) -> Gear:
        return Gear(
            teeth,
            45e-3,
            ALPHA,
            shift,
            0.491,
            0.5e-3 * rim,
            rack=BasicRack(1.0, 1.25, rounding),
            tip_diameter=1e-3 * tip,
            root_diameter=1e-3 * root,
            **of_ring,
        )

    return PlanetarySet(
        gear(19, 0.6170, 978.808, 798.030, 482.33, 0.38),
        gear(17, 0.8021, 905.470, 724.692, 408.99, 0.38),
        gear(56, 0.5013, 2475.118, 2677.618, 2994.24, 0.30, internal=True, cutter=PinionCutter(36, 0.0, 0.30)),
        0.863,
        equal_planet_angles(3),
    )


def helical_gears(teeth, shifts, tips, bores, *, module, degrees, width, rack) -> tuple[Gear, ...]:
    """Make helical gears from their normal section; lengths in mm, None for tips of the rack."""
    beta = math.radians(degrees)
    transverse, angle = transverse_tool(module * 1e-3, ALPHA, beta)
    return tuple(
        Gear(
            z,
            transverse,
            angle,
            x * math.cos(beta),
            width * 1e-3,
            0.5e-3 * bore,
            rack=transverse_rack(BasicRack(*rack), beta),
            tip_diameter=tip and tip * 1e-3,
            name=name,
        )
        for z, x, tip, bore, name in zip(teeth, shifts, tips, bores, ("pinion", "wheel"), strict=True)
    )


@lru_cache(maxsize=1)
def third_stage() -> GearPair:
    """Stage 3 of the NREL 5 MW gearbox."""
    gears = helical_gears(
        (24, 95),
        (0.48, 0.6691),
        (380.747, 1395.376),
        (179.10, 1193.32),
        module=14,
        degrees=10,
        width=360,
        rack=(1.0, 1.25, 0.38),
    )
    return GearPair(*gears, 0.861)


def helical_test_gear(rounding: float) -> GearPair:
    """Make the FZG test gear H501 with a rounding of the rack [modules]; the wheel's shift is found."""
    gears = helical_gears(
        (20, 30),
        (0.1809, 0.0891),
        (80.672, 116.264),
        (30.0, 30.0),
        module=3.5,
        degrees=15,
        width=23,
        rack=(1.0, 1.25, rounding),
    )
    return close_pair(*gears, centre_distance=91.5e-3, find=("wheel",))


def reported_test_gear(rounding: float) -> GearPair:
    """Make the FZG test gear H501 by its shifts alone, its tips shortened by what these need, as GEARpie does."""
    rack = {"module": 3.5, "degrees": 15, "width": 23, "rack": (1.0, 1.25, rounding)}
    shifts, bores = (0.1809, 0.0891), (30.0, 30.0)
    open_tips = close_pair(*helical_gears((20, 30), shifts, (None, None), bores, **rack))
    radii = [gear.reference_radius for gear in open_tips.gears]
    shortened = sum(radii) + 3.5e-3 * sum(shifts) - open_tips.centre_distance
    tips = [2e3 * (r + 3.5e-3 * (1.0 + x) - shortened) for r, x in zip(radii, shifts, strict=True)]
    return close_pair(*helical_gears((20, 30), shifts, tips, bores, **rack))


def contact_stress(pair: GearPair, force: float) -> float:
    """Compute sigma_H0 [MPa] of a pair of steel under a force at the reference circle [N], gear 1 the pinion."""
    first, second = pair.gears
    if not second.internal and second.teeth < first.teeth:
        first, second = second, first
    load = {"contact_ratio": pair.contact_ratio, "tangential_force": force}
    return 1e-6 * nominal_contact_stress(first, second, working_angle=pair.working_pressure_angle, **load, **STEEL)


def root_stresses(pair: GearPair, force: float, edition: Edition = 2006) -> tuple[NominalRootStress, ...]:
    """Compute sigma_F0 of both gears of a pair under a force at the reference circle [N]."""
    load = {"contact_ratio": pair.contact_ratio, "tangential_force": force}
    return tuple(nominal_root_stress(gear, edition=edition, **load) for gear in pair.gears)


def report_of_stage_1() -> tuple[Row, ...]:
    """Tooth factors and nominal stresses of all four flanks of the published report."""
    rows, gears = [], first_stage()
    flanks = ("sun", "planet, sun side", "planet, ring side", "ring")
    roots = [root for pair in gears.kinds for root in root_stresses(pair, STAGE_1_FORCE)]
    prints = (
        ("1.56", "2.06", 113.46),
        ("1.44", "2.14", 108.94),
        ("1.14", "2.38", 95.70),
        ("1.27", "2.13", 95.32),
    )
    for flank, root, (form, correction, stress) in zip(flanks, roots, prints, strict=True):
        rows += [
            printed("stage 1", STAGE_1, f"{flank}: form factor Y_F", form, root.form),
            printed("stage 1", STAGE_1, f"{flank}: stress correction Y_S", correction, root.correction),
            within(
                "stage 1",
                STAGE_1,
                f"{flank}: nominal root stress sigma_F0 [MPa]",
                stress,
                1e-6 * root.stress,
                HALF_PERCENT,
            ),
        ]
    prints = (("2.06", "0.981", 759.92), ("2.71", "0.952", 588.62))
    for name, pair, (zone, ratio, stress) in zip(("sun-planet", "planet-ring"), gears.kinds, prints, strict=True):
        ours = contact_stress(pair, STAGE_1_FORCE)
        factor = contact_ratio_factor(pair.contact_ratio)
        rows += [
            printed("stage 1", STAGE_1, f"{name}: Z_H", zone, zone_factor(ALPHA, pair.working_pressure_angle)),
            printed("stage 1", STAGE_1, f"{name}: Z_eps", ratio, factor),
            within("stage 1", STAGE_1, f"{name}: nominal contact stress sigma_H0 [MPa]", stress, ours, HALF_PERCENT),
        ]
    return tuple(rows)


def single_contact_of_stage_1() -> tuple[Row, ...]:
    """Z_B and Z_D, and what masses and stiffness make of the mesh resonance."""
    gears, rows = first_stage(), []
    for name, pair, factors in zip(
        ("sun-planet", "planet-ring"), gears.kinds, (("1.04", "1.05"), ("1.00", "1.00")), strict=True
    ):
        angle = {"working_angle": pair.working_pressure_angle, "path": pair.path}
        ours = single_pair_factors(*pair.gears, **angle, edition=2006)
        for symbol, reference, value in zip(("Z_B", "Z_D"), factors, ours, strict=True):
            rows.append(printed("stage 1", STAGE_1, f"{name}: {symbol}", reference, value))
    note = "with the printed C_R 0.862"
    outer, inner = ([0.862e-9 * value for value in pair_mesh_stiffness(pair)] for pair in gears.kinds)
    for name, ours, prints in (
        ("sun-planet", outer, (12.362, 13.426, 11.412)),
        ("planet-ring", inner, (13.289, 16.063, 13.653)),
    ):
        values = (*ours, BENDING_SHARE * ours[1])
        for symbol, reference, value in zip(("c'", "c_gamma_alpha", "c_gamma_beta"), prints, values, strict=True):
            quantity = f"{name}: {symbol} [N/(mm um)]"
            rows.append(within("stage 1", STAGE_1, quantity, reference, value, HALF_PERCENT, note=note))
    sun, planet, _ = (disc_inertia(gear, 7830.0) for gear in gears.gears)
    of_mesh = reduced_mass(sun / gears.n_planets, planet), reduced_mass(planet)
    for name, reference, value in zip(("sun-planet", "planet-ring"), ("0.6606", "2.4597"), of_mesh, strict=True):
        note = "the sun shared by its planets, the ring fixed"
        rows.append(printed("stage 1", STAGE_1, f"{name}: m_red [kg/mm]", reference, 1e-3 * value, note=note))
    return tuple(rows)


def report_of_stage_3() -> tuple[Row, ...]:
    """Helical stage: roots, flanks, stiffness with its gear blank factor, and K_v by method B."""
    pair = third_stage()
    rows = [
        within(
            "stage 3", STAGE_3, f"{name}: nominal root stress sigma_F0 [MPa]", value, 1e-6 * root.stress, HALF_PERCENT
        )
        for name, value, root in zip(
            ("pinion", "wheel"), (117.92, 127.69), root_stresses(pair, STAGE_3_FORCE), strict=True
        )
    ]
    ours = contact_stress(pair, STAGE_3_FORCE)
    rows.append(within("stage 3", STAGE_3, "nominal contact stress sigma_H0 [MPa]", 570.79, ours, HALF_PERCENT))
    blank = gear_blank_factor(0.25, 5.0)
    rows.append(printed("stage 3", STAGE_3, "gear blank factor C_R, b_s/b 0.25, s_R/m_n 5", "0.898", blank))
    single, mean = (1e-9 * value for value in pair_mesh_stiffness(pair, math.radians(10.0)))
    rows.append(within("stage 3", STAGE_3, "c' over C_R [N/(mm um)]", 15.403, single, HALF_PERCENT))
    rows.append(within("stage 3", STAGE_3, "c_gamma_alpha over C_R [N/(mm um)]", 20.748, mean, HALF_PERCENT))
    mass = reduced_mass(*(disc_inertia(gear, 7830.0) for gear in pair.gears))
    rows.append(within("stage 3", STAGE_3, "m_red [kg/mm]", 0.36503, 1e-3 * mass, HALF_PERCENT))
    resonance = resonance_speed(24, 1e9 * blank * mean, mass)
    rows.append(within("stage 3", STAGE_3, "n_E1 [1/min]", 2843.0, 30.0 / math.pi * resonance, HALF_PERCENT))
    ratio = math.pi / 30.0 * 1165.9 / resonance
    rows.append(printed("stage 3", STAGE_3, "N", "0.410", ratio))
    factor = dynamic_factor(
        resonance_ratio=ratio,
        line_load=1.25 * STAGE_3_FORCE / pair.face_width,
        stiffness=1e9 * blank * single,
        contact_ratio=2.884,
        # ISO 1328-1:1997, class 6: 16 and 22 um, of which 7.5 % run in
        pitch_deviation=0.925 * 16e-6,
        profile_deviation=0.925 * 22e-6,
        tip_relief=2e-6,
    ).factor
    rows.append(within("stage 3", STAGE_3, "K_v, method B, C_a 2 um", 1.092, factor, HALF_PERCENT))
    return tuple(rows)


def technical_report() -> tuple[Row, ...]:
    """Example to the standard: c_gamma_beta and K_Fbeta beside what the theme on teeth has of it."""
    gears = helical_gears(
        (17, 103),
        (0.145, 0.0),
        (159.66, 872.35),
        (60.0, 400.0),
        module=8,
        degrees=15.8,
        width=100,
        rack=(1.0, 1.4, 0.39),
    )
    pair = GearPair(*gears, 0.5)
    stiffness = BENDING_SHARE * pair_mesh_stiffness(pair, math.radians(15.8))[1]
    height = max(gear.tip_radius - gear.root_radius for gear in gears)
    ours = contact_stress(pair, 9000.0 / gears[0].reference_radius)
    return (
        within("example 1", EXAMPLE, "c_gamma_beta [N/(mm um)]", 14.8451, 1e-9 * stiffness, HALF_PERCENT),
        within(
            "example 1",
            EXAMPLE,
            "K_Fbeta of K_Hbeta 1.16",
            1.12803,
            bending_face_factor(1.16, 0.1, height),
            HALF_PERCENT,
        ),
        within("example 1", EXAMPLE, "nominal contact stress sigma_H0 [MPa]", 1206.58, ours, HALF_PERCENT),
    )


def fzg_gears() -> tuple[Row, ...]:
    """FZG gears C and H501 by the edition of 2006."""
    rack, rows = BasicRack(1.0, 1.25, 0.375), []
    shape = (4.5e-3, ALPHA)
    spur = GearPair(
        Gear(16, *shape, 0.1817, 0.014, 0.01, rack=rack, tip_diameter=82.636e-3),
        Gear(24, *shape, 0.1715, 0.014, 0.01, rack=rack, tip_diameter=118.544e-3),
        91.5e-3,
    )
    note = (
        "with a rounding of 0.30 modules, which its Y_F 1.479, 1.490 and Y_S 2.047, 2.036 have; 0.38 gives 90.7, 91.1"
    )
    for case, source, pair, torque, values, remark in (
        ("C", FZG_C, spur, 200.0, (275.70, 267.54, 1239.07), ""),
        ("H501", FZG_H_ISO, helical_test_gear(0.30), 100.0, (96.7, 96.9, 652.5), note),
    ):
        force = torque / pair.gears[0].reference_radius
        for gear, value, root in zip(("pinion", "wheel"), values, root_stresses(pair, force), strict=False):
            quantity = f"{gear}: nominal root stress sigma_F0 [MPa]"
            rows.append(within(case, source, quantity, value, 1e-6 * root.stress, HALF_PERCENT, note=remark))
        ours = contact_stress(pair, force)
        rows.append(within(case, source, "nominal contact stress sigma_H0 [MPa]", values[2], ours, HALF_PERCENT))
    return tuple(rows)


def helical_fzg_gear() -> tuple[Row, ...]:
    """FZG gear H501: as GEARpie reports it, and the section of its own rack by the fillet that the tool generates.

    The rounding of 0.38 modules stands in GEARpie's library of gears, but its strength has 0.30 of all helical gears
    (``rfer`` of DIN3990.py). Its force is that of the pitch circle, its Z_beta the sqrt(cos beta) of DIN 3990.
    """
    pair, rows = reported_test_gear(0.30), []
    force = 100.0 / (pair.centre_distance * 20.0 / 50.0)
    note = "rounding 0.30 modules, as the report's program has it of all helical gears; its list of gears says 0.38"
    reported = (("1.479", "2.047", "95.80"), ("1.490", "2.036", "96.01"))
    for gear, values, root in zip(("pinion", "wheel"), reported, root_stresses(pair, force), strict=True):
        ours = root.form, root.correction, 1e-6 * root.stress
        for name, value, number in zip(("Y_F", "Y_S", "sigma_F0 [MPa]"), values, ours, strict=True):
            rows.append(printed("H501", FZG_H, f"{gear}: {name}", value, number, note=note))
    degrees = math.radians(15.0)
    ours = contact_stress(pair, force) * math.cos(degrees)
    note = "without 1/cos(beta) = Z_beta^2 of ISO over that of DIN 3990"
    rows.append(printed("H501", FZG_H, "sigma_H0 of DIN 3990 [MPa]", "627.27", ours, note=note))
    test_gear, generated = reported_test_gear(0.38), "fillet that the rack generates, point by point"
    for gear, root in zip(test_gear.gears, root_stresses(test_gear, force), strict=True):
        chord, radius, _ = generated_section(gear)
        sizes = ("chord s_Fn", chord, root.chord), ("radius rho_F", radius, root.fillet_radius)
        for name, reference, number in sizes:
            words = f"{gear.name}: {name} [mm], rounding 0.38"
            rows.append(within("H501", generated, words, 1e3 * reference, 1e3 * number, 1e-5))
    return tuple(rows)


def face_factors() -> tuple[Row, ...]:
    """K_Hbeta of two reports of GEARpie by method C, from its own deviations, stiffness (DIN 3990) and load.

    Its F_beta is ``0.1 sqrt(d_2) + 0.63 sqrt(b) + 4.2`` um, f_ma half of it, y_beta 15 % of that, f_sh 0.
    """
    spur = "GEARpie, report of FZG gear C14, 16/24, m 4.5, 200 N m"
    rows = []
    for case, source, teeth, shifts, (module, width, degrees), (force, dynamic, ratio), reference in (
        ("C14", spur, (16, 24), (0.1817, 0.1715), (4.5, 14.0, 0.0), (5464.5, 1.02, 1.46), "1.06"),
        ("H501", FZG_H, (20, 30), (0.1809, 0.0891), (3.5, 23.0, 15.0), (2732.2, 1.03, 1.46), "1.20"),
    ):
        beta = math.radians(degrees)
        virtual = [z / (math.cos(base_helix_angle(ALPHA, beta)) ** 2 * math.cos(beta)) for z in teeth]
        single = 0.8 * math.cos(beta) * theoretical_single_stiffness(*virtual, *shifts)
        tolerance = 0.1 * math.sqrt(module * teeth[1] / math.cos(beta)) + 0.63 * math.sqrt(width) + 4.2
        line_load = 1.25 * dynamic * force / width
        stiffness = single * (0.75 * ratio + 0.25)
        ours = face_load_factor(0.85 * 0.5e-6 * tolerance, 1e3 * line_load, stiffness)
        rows.append(printed(case, source, "face load factor K_Hbeta, method C", reference, ours))
    return tuple(rows)


def life_lines_of_a_program() -> tuple[Row, ...]:
    """Z_NT and Y_NT between their knees as a public program has them, which read the figures of the standard.

    Its Z_NT of steels that may stand 5e7 load cycles has numbers of load cycles beside its factors that are those of
    other materials: it is left out.
    """
    program = "ddjokic/python-gearbox, tables of ISO 6336-2 and -3"
    rows = []
    for kind, treatment, factors in (
        ("Y_NT", "case hardened steel", {1e4: 1.97, 1e5: 1.53, 1e6: 1.15, 1e8: 0.94}),
        ("Y_NT", "through hardened alloy steel", {1e5: 1.79, 1e6: 1.2, 1e9: 0.895}),
        ("Y_NT", "nitrided steel", {1e4: 1.4, 1e5: 1.21, 1e6: 1.07}),
        ("Y_NT", "nitrocarburised steel", {1e5: 1.05}),
        ("Z_NT", "nitrided steel", {1e6: 1.07, 1e7: 0.97, 1e8: 0.93}),
        ("Z_NT", "nitrocarburised steel", {1e6: 1.02, 1e9: 0.89}),
    ):
        steel = GEAR_STEELS[treatment]
        line = steel.root_life if kind == "Y_NT" else steel.contact_life
        for cycles, reference in factors.items():
            quantity = f"{kind} of {treatment} at {cycles:.0e} load cycles"
            rows.append(information("life factors", program, quantity, reference, line.at(cycles)))
    return tuple(rows)


def generated_section(gear: Gear) -> tuple[float, float, float]:
    """Find chord, radius and foot [m] of the critical section of a helical gear by the fillet of its virtual gear."""
    z = gear.teeth * gear.rack.stretch / math.cos(helix_of(gear)[1]) ** 2
    module, stretch = gear.module / gear.rack.stretch, gear.rack.stretch
    rounding, dedendum = (size * stretch * module for size in (gear.rack.root_radius, gear.rack.dedendum))
    half_width = 0.25 * math.pi * module - dedendum * math.tan(ALPHA)
    half_width -= (1.0 - math.sin(ALPHA)) / math.cos(ALPHA) * rounding
    depth = dedendum - rounding - gear.profile_shift * stretch * module
    tool = RackTip(0.5 * module * z, depth, half_width, rounding, math.pi / z, 0.5 * math.pi - ALPHA)
    return fillet_section(tool, math.radians(30.0))


def edition_of_2019() -> tuple[Row, ...]:
    """f_eps of two published calculations, with tips shortened by what the shifts need."""
    rows = []
    for teeth, shifts, width, reference in (
        ((33, 27), (0.2004, 0.2624), 800, "0.801"),
        ((41, 34), (0.3698, 0.9220), 750, "0.840"),
    ):
        of_rack = {"module": 40, "degrees": 15, "width": width, "rack": (1.0, 1.25, 0.38)}
        open_tips = helical_gears(teeth, shifts, (None, None), (200.0, 200.0), **of_rack)
        distance = close_pair(*open_tips).centre_distance
        reach = sum(gear.reference_radius for gear in open_tips) + 0.04 * sum(shifts) - distance
        tips = [2e3 * (gear.tip_radius - reach) for gear in open_tips]
        pair = GearPair(*helical_gears(teeth, shifts, tips, (200.0, 200.0), **of_rack), distance)
        ratio = pair.contact_ratio / math.cos(base_helix_angle(ALPHA, math.radians(15.0))) ** 2
        quantity = f"{teeth[0]}/{teeth[1]}: f_eps"
        rows.append(printed("2019", EDITION_2019, quantity, reference, load_distribution_factor(ratio, 1.0)))
    return tuple(rows)


def life_factors() -> tuple[Row, ...]:
    """Z_NT and Y_NT of case hardened steel at the load cycles of published calculations, and slopes of damage."""
    steel, soft = GEAR_STEELS["case hardened steel"], GEAR_STEELS["through hardened alloy steel"]
    cases = (
        ("stage 1", STAGE_1, "sun, 1124.7e6 cycles: Z_NT", "0.909", steel.contact_life.at(1124.7e6)),
        ("stage 1", STAGE_1, "planet, 419e6 cycles: Z_NT", "0.937", steel.contact_life.at(419.0e6)),
        ("stage 1", STAGE_1, "ring, 381.6e6 cycles: Z_NT", "0.940", soft.contact_life.at(381.6e6)),
        ("stage 1", STAGE_1, "sun, 1124.7e6 cycles: Y_NT", "0.888", steel.root_life.at(1124.7e6)),
        ("stage 1", STAGE_1, "planet, 419e6 cycles: Y_NT", "0.906", steel.root_life.at(419.0e6)),
        ("stage 1", STAGE_1, "ring, 381.6e6 cycles: Y_NT", "0.907", soft.root_life.at(381.6e6)),
        ("example 1", EXAMPLE, "pinion, 1.080e9 cycles: Z_NT", "0.910", steel.contact_life.at(1.080e9)),
        ("example 1", EXAMPLE, "wheel, 1.783e8 cycles: Z_NT", "0.962", steel.contact_life.at(1.783e8)),
    )
    exponent = "exponent of flanks, ln(5e7/1e5)/ln 1.6"
    return (
        *(printed(*case, digits=1.1) for case in cases),
        printed("materials", "ISO 6336-2, table 2", exponent, "13.22", steel.contact_life.slope),
    )


def materials() -> tuple[Row, ...]:
    """Limits of ISO 6336-5 beside the numbers of published calculations and of a public program."""
    program = "github.com/waa552/fyp-website, data.js: upper ends of the lines of ME"
    rows = []
    for treatment, hardness, contact, root in (
        ("normalised steel", 210, 1.520 * 210 + 250, 0.386 * 210 + 147),
        ("through hardened carbon steel", 210, 0.838 * 210 + 432, 0.283 * 210 + 202),
        ("through hardened alloy steel", 390, 2.213 * 390 + 260, 0.358 * 390 + 231),
        ("through hardened cast alloy steel", 360, 1.350 * 360 + 356, 0.356 * 360 + 186),
        ("case hardened steel", 700, 1650.0, 525.0),
        ("flame hardened steel", 615, 0.505 * 615 + 1013, 0.271 * 615 + 237),
        ("nitrided steel", 700, 1450.0, 468.0),
        ("nitrided through hardening steel", 600, 1217.0, 432.0),
        ("nitrocarburised steel", 600, 950.0, 388.0),
    ):
        for symbol, kind, value in (("sigma_Hlim", "contact", contact), ("sigma_Flim", "root", root)):
            ours = 1e-6 * stress_limit(treatment, "ME", hardness, kind)
            quantity = f"{treatment}, ME, {hardness}: {symbol} [MPa]"
            rows.append(within("materials", program, quantity, value, ours, HALF_PERCENT))
    flank = 1e-6 * stress_limit("case hardened steel", "MQ", 720, "contact")
    rows.append(within("materials", STAGE_1, "case hardened steel, MQ: sigma_Hlim [MPa]", 1500.0, flank, HALF_PERCENT))
    return tuple(rows)


def tolerances() -> tuple[Row, ...]:
    """Flank tolerances of a gear; all references are whole or half micrometres."""
    ours = flank_tolerances(6, diameter=0.12, normal_module=3e-3, face_width=0.03)
    return tuple(
        printed("tolerances", TOLERANCES, f"{symbol} [um]", reference, 1e6 * value)
        for symbol, reference, value in (
            ("f_pT", "9.0", ours.pitch),
            ("F_pT", "29", ours.cumulative_pitch),
            ("F_alphaT", "12", ours.profile),
            ("f_falphaT", "9.5", ours.profile_form),
            ("f_HalphaT", "7.5", ours.profile_slope),
            ("F_rT", "26", ours.runout),
        )
    )
