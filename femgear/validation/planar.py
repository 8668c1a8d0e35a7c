"""Lumped planetary set: published frequencies and mode structure, torsional limit, static load sharing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.errors import ConvergenceError
from femgear.models.planar import (
    PlanarBody,
    PlanarSet,
    PlanarTorque,
    inertia_of_reduced,
    planar_from_set,
    torsional_of_reduced,
    torsional_set,
)
from femgear.models.planar_modes import planar_modes
from femgear.models.planar_problem import planar_meshes, planar_problem
from femgear.models.wind_turbine import wind_turbine_b
from femgear.solvers.nonlinear import NonlinearSystem, element_forces
from femgear.validation.planetary import nrel_set
from femgear.validation.rows import Row, at_most, counted, printed, within

LIN_PARKER = "Lin and Parker, J. Vib. Acoust. 121, 1999, Table 2"
INDEPENDENT = "independent computation of the same model"
KINDS = ("rotational", "translational", "planet")

# printed by Lin and Parker: rotational (the zero first), translational, planet
PUBLISHED = {
    3: (
        ("1475.7", "1930.3", "2658.3", "7462.8", "11775.3"),
        ("743.2", "1102.4", "1896.0", "2276.4", "6986.3", "9647.9"),
        (),
    ),
    4: (
        ("1536.6", "1970.6", "2625.7", "7773.6", "13071.1"),
        ("727.0", "1091.0", "1892.8", "2342.5", "7189.9", "10437.6"),
        ("1808.2", "5963.8", "6981.7"),
    ),
    5: (
        ("1567.4", "2006.1", "2614.8", "8065.4", "14253.1"),
        ("710.0", "1072.0", "1888.1", "2425.3", "7382.4", "11172.3"),
        ("1808.2", "5963.8", "6981.7"),
    ),
}
PLANET = (1808.18088204, 5963.76002161, 6981.70516704)
PRECISE = {
    3: (
        (1475.7472, 1930.3466, 2658.3244, 7462.8034, 11775.2658),
        (743.1639, 1102.4193, 1896.0199, 2276.3801, 6986.2982, 9647.9132),
        (),
    ),
    4: (
        (1536.5355, 1970.5924, 2625.6502, 7773.5513, 13071.1102),
        (727.2673, 1091.1635, 1892.8176, 2342.5035, 7189.9454, 10437.5618),
        PLANET,
    ),
    5: (
        (1567.3977, 2006.0785, 2614.7957, 8065.3899, 14253.0924),
        (710.0452, 1072.0124, 1888.0771, 2425.2954, 7382.3799, 11172.3087),
        PLANET,
    ),
}


def lin_parker_set(planets: int = 3, *, planet_bearing: float = 1e8, sun_support: float = 1e8) -> PlanarSet:
    """Example set of Lin and Parker (1999, Table 1), equally spaced.

    Inertias are given as I / r^2 and the torsional support of the ring as k_u, so that the radii do not
    enter its modes. The printed base diameters of sun, planet and ring do not close; 77.42 mm and 100.35 mm
    of sun and planet are kept, and ring and centre distance follow from them.
    """
    alpha = math.radians(24.6)
    sun, planet = 0.5 * 0.07742, 0.5 * 0.10035
    ring, distance = sun + 2.0 * planet, (sun + planet) / math.cos(alpha)

    def body(mass, reduced, radius, **supports):
        return PlanarBody(mass, inertia_of_reduced(reduced, radius), **supports)

    torsional = torsional_of_reduced(1e9, ring)
    return PlanarSet(
        sun=body(0.4, 0.39, sun, support=sun_support),
        ring=body(2.35, 3.00, ring, support=1e8, torsional_support=torsional),
        carrier=body(5.43, 6.29, distance, support=1e8),
        planet=body(0.66, 0.61, planet),
        sun_radius=sun,
        ring_radius=ring,
        planet_radius=planet,
        centre_distance=distance,
        planet_angles=2.0 * np.pi * np.arange(planets) / planets,
        pressure_angle_sun_planet=alpha,
        pressure_angle_planet_ring=alpha,
        stiffness_sun_planet=5e8,
        stiffness_planet_ring=5e8,
        planet_bearing=planet_bearing,
    )


def by_kind(modes) -> dict[str, np.ndarray]:
    """Frequencies [Hz] of the elastic modes of every kind."""
    kinds = np.array(modes.kind)
    return {kind: modes.frequency[kinds == kind] for kind in (*KINDS, "mixed")}


def static_mesh_forces(problem: NonlinearSystem) -> np.ndarray:
    """Forces of all columns at rest, by Newton iterations from closed meshes.

    Raises
    ------
    ConvergenceError
        The equilibrium is not reached (E-STATIC).
    """
    system, theta = problem.system, np.zeros(problem.bases)
    W = system.W
    q = np.linalg.solve(system.K + (W * problem.reference) @ W.T, system.load)
    for _ in range(30):
        force, tangent = element_forces(problem, W.T @ q, theta)
        rest = system.load - system.K @ q - W @ force
        if np.abs(rest).max() <= 1e-10 * np.abs(system.load).max():
            return force
        q = q + np.linalg.solve(system.K + W @ tangent @ W.T, rest)
    raise ConvergenceError("the static state is not found", code="E-STATIC")


def frequencies() -> tuple[Row, ...]:
    """F1: natural frequencies, single and double ones checked by their kind."""
    rows = []
    for planets, precise in PRECISE.items():
        found = by_kind(planar_modes(lin_parker_set(planets)))
        multiplicity = (1, 2, planets - 3)
        ours = [found[kind][::times] if times else () for kind, times in zip(KINDS, multiplicity)]
        for kind, values, texts in zip(KINDS, ours, PUBLISHED[planets], strict=True):
            for text, value in zip(texts, values, strict=True):
                name = f"{planets} planets, {kind} mode [Hz]"
                rows.append(_published(planets, name, text, value))
        error = max(
            abs(value / reference - 1.0)
            for values, references in zip(ours, precise, strict=True)
            for value, reference in zip(values, references, strict=True)
        )
        rows.append(
            at_most("F1", INDEPENDENT, f"{planets} planets: largest relative difference", 1e-7, error)
        )
    return tuple(rows)


def _published(planets: int, name: str, text: str, value: float) -> Row:
    if planets == 4:
        # 727.0 and 1091.0 are printed where the model gives 727.27 and 1091.16; all other entries agree
        note = "printed too low, cause unknown" if text in ("727.0", "1091.0") else ""
        return within("F1", LIN_PARKER, name, float(text), value, 5e-4, note=note)
    if planets == 3:
        return within("F1", LIN_PARKER, name, float(text), value, 5e-5)
    return printed("F1", LIN_PARKER, name, text, value)


def structure() -> tuple[Row, ...]:
    """F3: 6 single, 6 double and 3 (N - 3)-fold modes."""
    rows, source = [], "Lin and Parker, 1999: structure of the modes"
    for planets in (3, 4, 5, 6):
        kinds = list(planar_modes(lin_parker_set(planets)).kind)
        name = f"{planets} planets: "
        expected = (("rotational, one rigid", 6), ("translational", 12), ("planet", 3 * (planets - 3)))
        counts = (kinds.count("rotational") + kinds.count("rigid"), *map(kinds.count, KINDS[1:]))
        for (kind, reference), ours in zip(expected, counts, strict=True):
            rows.append(counted("F3", source, f"{name}{kind} modes", reference, ours))
        rows.append(counted("F3", source, name + "coordinates", 9 + 3 * planets, len(kinds)))
    return tuple(rows)


def torsional() -> tuple[Row, ...]:
    """F4: no translations, ring held."""
    rows = []
    others = {3: (4657.3914, 11173.8276), 4: (4846.9994, 12542.3527), 5: (4979.1379, 13784.9556)}
    for planets, (low, high) in others.items():
        data = torsional_set(lin_parker_set(planets))
        held = replace(data, ring=replace(data.ring, torsional_support=math.inf))
        modes = planar_modes(held)
        name = f"torsional, {planets} planets, ring held: "
        expected = [0.0, low, *[math.sqrt(1e9 / 0.61) / (2.0 * math.pi)] * (planets - 1), high]
        closed = modes.frequency[2:-1]
        source = "sqrt((k_sp + k_pr) r^2 / I_p)"
        error = np.abs(closed / expected[2:-1] - 1.0).max()
        rows.append(counted("F4", "one rotation", name + "rigid modes", 1, int(np.sum(modes.frequency == 0))))
        rows.append(at_most("F4", source, name + f"{planets - 1} planet modes, difference", 1e-9, error))
        for text, value in ((low, modes.frequency[1]), (high, modes.frequency[-1])):
            rows.append(printed("F4", INDEPENDENT, name + "mode [Hz]", f"{text:.4f}", value))
    return tuple(rows)


def sharing_set(
    planets: int, *, sun_support: float = 0.0, planet_bearing: float = 1e8, others: float = math.inf
) -> PlanarSet:
    """The example set with ring and carrier held, or on stiff supports [N/m] (of u too)."""
    data = lin_parker_set(planets, planet_bearing=planet_bearing, sun_support=sun_support)
    held = {
        name: replace(
            getattr(data, name), support=others, torsional_support=torsional_of_reduced(others, radius)
        )
        for name, radius in (("ring", data.ring_radius), ("carrier", data.centre_distance))
    }
    return replace(data, **held)


def sun_forces(data: PlanarSet, torque: float, tangential) -> np.ndarray:
    """Static sun-planet forces (N,) [N] with tangential pin errors (N,) [m], no play and no separation."""
    pins = np.column_stack([np.zeros(data.n_planets), tangential])
    problem = planar_problem(
        data,
        meshes=planar_meshes(data, separates=False),
        torque=PlanarTorque(torque, output=None),
        pin_errors=pins,
    )
    return static_mesh_forces(problem)[: data.n_planets]


def closed_form_sharing(data: PlanarSet, torque: float, tangential) -> np.ndarray:
    """``F = W / N - k 2 cos(alpha) res`` of equal planets, ring and carrier rigid, sun floating.

    ``res`` is what a least-squares fit by 1, cos psi and sin psi leaves of the tangential errors, and
    ``1 / k = 1 / k_sp + 1 / k_pr + 4 cos^2(alpha) / k_p``.
    """
    psi, angle = data.planet_angles, data.pressure_angle_sun_planet
    basis = np.column_stack([np.ones_like(psi), np.cos(psi), np.sin(psi)])
    rest = tangential - basis @ np.linalg.lstsq(basis, tangential, rcond=None)[0]
    k_sp, k_pr, k_p = (
        getattr(data, n)[0] for n in ("stiffness_sun_planet", "stiffness_planet_ring", "planet_bearing")
    )
    path = 1.0 / (1.0 / k_sp + 1.0 / k_pr + 4.0 * math.cos(angle) ** 2 / k_p)
    return torque / data.sun_radius / len(psi) - 2.0 * math.cos(angle) * path * rest


def load_sharing() -> tuple[Row, ...]:
    """F6: 100 N m, one pin 2 um out of place; ring and carrier rigid, planet bearings 1e9 N/m.

    The reference values with a supported sun belong in all printed digits to 1e12 N/m at ring and carrier;
    the rigid limit stands beside them.
    """
    rows, source = [], INDEPENDENT
    cases = (
        (3, 0.0, "floating", ("861.1039", "861.1039", "861.1039")),
        (3, 1e9, "on 1e9 N/m", ("585.99", "998.66", "998.66")),
        (4, 1e9, "on 1e9 N/m", ("326.18", "770.26", "716.60", "770.26")),
        (4, 0.0, "floating", ("521.39", "770.26", "521.39", "770.26")),
    )
    for planets, support, words, forces in cases:
        error = 2e-6 * np.eye(planets)[0]
        options = {"sun_support": support, "planet_bearing": 1e9}
        rigid = sun_forces(sharing_set(planets, **options), 100.0, error)
        ours = sun_forces(sharing_set(planets, **options, others=1e12), 100.0, error) if support else rigid
        name = f"{planets} planets, sun {words}: force at planet "
        for n, (text, value) in enumerate(zip(forces, ours, strict=True), 1):
            note = f"rigid ring and carrier: {rigid[n - 1]:.2f} N" if support else ""
            rows.append(printed("F6", source, f"{name}{n} [N]", text, value, note=note))
    for planets, text in ((3, "1.000000"), (4, "1.192677"), (5, "1.311758")):
        ours = sun_forces(sharing_set(planets, planet_bearing=1e9), 100.0, 2e-6 * np.eye(planets)[0])
        name = f"{planets} planets, sun floating: load sharing factor"
        rows.append(printed("F6", source, name, text, planets * ours.max() / ours.sum()))
    return tuple(rows)


def closed_form() -> tuple[Row, ...]:
    """L: load sharing with random pin errors."""
    rows, source = [], "closed form of the load sharing"
    rng = np.random.default_rng(5)
    for planets in (3, 4, 5, 6):
        data, errors = sharing_set(planets), rng.normal(scale=20e-6, size=planets)
        torque = 20e3 * data.sun_radius
        exact = closed_form_sharing(data, torque, errors)
        error = np.abs(sun_forces(data, torque, errors) / exact - 1.0).max()
        name = f"{planets} planets, sun floating, random tangential pin errors: largest difference"
        rows.append(at_most("L", source, name, 1e-6, error))
    for planets, support, words, shares in (
        (4, 0.0, "floating", (".2623", ".2377", ".2623", ".2377")),
        (3, math.inf, "held", (".366", ".317", ".317")),
    ):
        data = sharing_set(planets, sun_support=support)
        ours = sun_forces(data, 20e3 * data.sun_radius, -20e-6 * np.eye(planets)[0]) / 20e3
        for n, (text, value) in enumerate(zip(shares, ours, strict=True), 1):
            name = f"{planets} planets, sun {words}, pin 1 20 um ahead: share of planet {n}"
            rows.append(printed("L", INDEPENDENT, name, text, value))
    return tuple(rows)


def balance() -> tuple[Row, ...]:
    """F7: torques of the members from the kinematics of the lumped set."""
    stiffness, body = 1e9, PlanarBody(1.0, 1.0, 1e8, math.inf)
    bodies = {name: body for name in ("ring", "carrier", "sun")}
    data = planar_from_set(
        nrel_set(),
        **bodies | {"sun": replace(body, torsional_support=0.0)},
        planet=PlanarBody(1.0, 1.0),
        stiffness_sun_planet=stiffness,
        stiffness_planet_ring=stiffness,
        planet_bearing=1e9,
    )
    forces = static_mesh_forces(planar_problem(data, torque=PlanarTorque(162105.5, output=None)))
    ring = forces[3:].sum() * data.ring_radius
    both = math.cos(data.pressure_angle_sun_planet), math.cos(data.pressure_angle_planet_ring)
    carrier = data.centre_distance * (forces[:3].sum() * both[0] + forces[3:].sum() * both[1])
    source = "KISSsoft report of the NREL 5 MW gearbox, stage 2"
    # the report rounds the torques to 0.1 N m from more digits of the sun's torque
    return (
        within("F7", source, "torque on the ring from the mesh forces [N m]", 837545.1, ring, 1e-6),
        within("F7", source, "torque on the carrier from the mesh forces [N m]", 999650.6, carrier, 1e-6),
        printed("F7", "1 + z_r / z_s", "torque ratio", "6.1666667", carrier / 162105.5),
        at_most("F7", "radii close", "largest closure error", 1e-12, max(map(abs, data.closure))),
    )


def wind_turbine() -> tuple[Row, ...]:
    """Lowest modes of the wind turbine set."""
    found = by_kind(planar_modes(wind_turbine_b()))
    rows, source = [], INDEPENDENT
    for kind, values, texts in (
        ("translational", found["translational"][::2], ("40.761", "156.869")),
        ("rotational", found["rotational"], ("69.563", "302.710")),
    ):
        for text, value in zip(texts, values):
            rows.append(printed("PG-B", source, f"wind turbine set, {kind} mode [Hz]", text, value))
    return tuple(rows)
