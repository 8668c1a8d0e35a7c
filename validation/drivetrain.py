"""Drivetrains: reductions of the chain, balances, printed numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from drivetrain_references import torsional_matrices
from published.wind_turbine_drivetrain import (
    PRINTED,
    RADII_TEETH,
    line_teeth,
    paper_torques,
    ratio_of_radii,
    wind_turbine_drivetrain,
)

from femgear.solvers.linear.modal import undamped_modes
from femgear.system.mesh_directions import gear_set_system
from femgear.trains.drivetrain.kinematics import coordinates_of, planar_of, rigid_rotation
from femgear.trains.drivetrain.model import (
    balanced_torque,
    drivetrain_model,
    rectangular_series,
    torsional_model,
)
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    MeshSection,
    ParallelSection,
    PlanetarySection,
    constant_torques,
)
from femgear.trains.drivetrain.simulation import Records, march_drivetrain
from validation.rows import Row, at_most, information, printed, within

PAPER = "Dynamic analysis of the wind turbine drivetrain considering shaft bending effect"
# two wheels and one mesh: mean stiffness [N/m], teeth
STIFFNESS, TEETH = 2e8, 20


def kinematics() -> tuple[Row, ...]:
    """Ratio and mesh lines of the paper."""
    rows = [printed("speeds", PAPER, "speed ratio from the radii", "34.654", ratio_of_radii())]
    teeth = line_teeth()
    note = "no check: tooth numbers are not printed, and these whole numbers were fitted to the lines"
    for name, value, ours in zip(("planetary", "gear 1-2", "gear 2-3"), PRINTED.lines, teeth.lines()):
        rows.append(information("speeds", PAPER, f"mesh line {name} [Hz]", value, ours, note=note))
    for name, value, ours in zip(("planetary", "gear 1-2", "gear 2-3"), PRINTED.lines, RADII_TEETH.lines()):
        text = f"mesh line {name}, module 5 mm, which divides every radius [Hz]"
        rows.append(information("speeds", PAPER, text, value, ours))
    return tuple(rows)


def shifted_planets() -> tuple[Row, ...]:
    """A planet that profile shifts give two teeth fewer than (z_r - z_s)/2, by Willis and ISO 21771."""
    mesh = MeshSection.in_si(stiffness=1e10, contact_ratio=1.2)
    stage = PlanetarySection.in_si(
        carrier="carrier",
        sun="sun",
        ring_teeth=56,
        sun_teeth=19,
        planet_teeth=17,
        module=0.045,
        planet_mass=1611.0,
        planet_inertia=174.9,
        sun_mesh=mesh,
        ring_mesh=mesh,
    )
    bodies = tuple(BodySection.in_si(name=name, inertia=100.0, mass=1e3, tilts=False) for name in ("carrier", "sun"))
    chain = Drivetrain(bodies, planetary=(stage,))
    place = coordinates_of(chain)
    spin = rigid_rotation(chain, place)
    carrier, sun, planet = (spin[i] for i in (4, place.body["sun"] + 4, place.planets[0][0, 2]))
    base = 17 * 22.5 * math.cos(math.radians(20.0))
    case = "shifted planets"
    return (
        within(case, "Willis", "19/17/56: sun over carrier", 75.0 / 19.0, sun / carrier, 1e-9),
        within(
            case,
            "Willis",
            "planet over sun in the carrier's frame",
            -19.0 / 17.0,
            (planet - carrier) / (sun - carrier),
            1e-9,
        ),
        within(case, "ISO 21771", "base radius of the planet [mm]", base, 1e3 * stage.base_radii[1], 1e-9),
    )


def shaft_joints() -> tuple[Row, ...]:
    """Printed stiffnesses of shafts beside the joint of two rigid links that stores the energy of a beam."""
    rows = []
    springs = (PRINTED.low_speed, PRINTED.intermediate, PRINTED.high_speed)
    for name, (bending, torsion) in zip(("low-speed", "intermediate", "high-speed"), springs):
        for words, halves in (("both halves of the joint", 2), ("one joint", 1)):
            text = f"{name} shaft, bending over torsion; slender round steel shaft, energy of {words}"
            slender = 0.75 * halves * 1.3
            rows.append(information("shaft", PAPER, text, bending / torsion, slender, note="docs/drivetrain.md"))
    return tuple(rows)


def base_line() -> tuple[Row, ...]:
    """Lowest elastic mode beside the base lines of the paper's Fig. 5."""
    train = wind_turbine_drivetrain()
    rows = []
    for words, value, model in (
        ("shafts that bend", 2.5, drivetrain_model(train)),
        ("torsional", 2.0, torsional_model(train)),
    ):
        ours = undamped_modes(model.still, model.mean_stiffness).frequency[1]
        rows.append(information("modes", f"{PAPER}, Fig. 5", f"base line, {words} [Hz]", value, ours))
    lower = rows[0].ours / rows[1].ours
    text = "lowest mode with shafts that bend over that with held axes: above one"
    source = "Rayleigh: constraints raise natural frequencies"
    rows.append(at_most("modes", source, text, 0.0, max(lower - 1.0, 0.0)))
    return tuple(rows)


def stiffness() -> tuple[Row, ...]:
    """Rectangular mesh stiffness, contact ratio 1.635, 1 or 0.65."""
    lines = rectangular_series(MeshSection.in_si(stiffness=0.87225, contact_ratio=1.635, low_share=0.65), 15).real
    wanted = [0.87225] + [0.7 / (math.pi * h) * math.sin(math.pi * h * 0.635) for h in range(1, 16)]
    error = np.abs(lines - wanted).max()
    return (at_most("mesh stiffness", "closed form", "rectangular wave, error of 15 harmonics", 1e-12, error),)


def reductions() -> tuple[Row, ...]:
    """Held axes: torsion; one planetary stage: the planar set."""
    train = wind_turbine_drivetrain()
    model = torsional_model(train)
    parts = zip((model.system.M, model.system.K, model.system.W), torsional_matrices(train)[:3])
    error = max(np.abs(ours - wanted).max() / np.abs(wanted).max() for ours, wanted in parts)
    stage = train.planetary[0]
    bodies = tuple(b.changed(tilts=False) for b in train.bodies if b.name in ("carrier", "sun"))
    alone = Drivetrain(
        bodies,
        planetary=(stage,),
        bearings=(
            BearingSection.in_si(body="carrier", radial=2e8),
            BearingSection.in_si(body="sun", radial=3e7),
        ),
        gravity=0.0,
    )
    lumped = planar_of(alone, stage)
    carrier, sun = replace(lumped.carrier, support=2e8), replace(lumped.sun, support=3e7)
    lumped = replace(lumped, carrier=carrier, sun=sun)
    ours = drivetrain_model(alone)
    ours = undamped_modes(ours.still, ours.mean_stiffness).frequency[1:]
    theirs = undamped_modes(gear_set_system(lumped), lumped.mesh_stiffness).frequency[1:]
    planar = np.abs(ours / theirs - 1.0).max()
    return (
        at_most("reductions", "torsional matrices", "chain with held axes, error of M, K and W", 1e-9, error),
        at_most("reductions", "planar set", "planetary stage alone, error of natural frequencies", 1e-9, planar),
    )


def balances() -> tuple[Row, ...]:
    """Energy and momentum over one second; the minute is in `minute`."""
    return _balances(1.0)


def minute() -> tuple[Row, ...]:
    """Energy and momentum over 60 s of 20 000 steps a second."""
    return _balances(60.0)


def _balances(duration: float) -> tuple[Row, ...]:
    model = drivetrain_model(wind_turbine_drivetrain())
    run = march_drivetrain(
        model,
        constant_torques(paper_torques()),
        duration=duration,
        step=5e-5,
        speed=PRINTED.speed,
        start="zero",
        records=Records(200),
    )
    text = f"36 dof, {duration:g} s in steps of 50 µs:"
    return (
        at_most("balances", "theory", f"{text} energy", 1e-6, run.energy_balance.error),
        at_most("balances", "theory", f"{text} angular momentum", 1e-6, run.momentum),
        at_most("balances", "theory", f"{text} spin in the deviations [rad]", 1e-9, run.drift),
    )


def torques() -> tuple[Row, ...]:
    """Torque that holds the speed."""
    model = drivetrain_model(wind_turbine_drivetrain())
    ours = -balanced_torque(model, "rotor", PRINTED.torque, "generator")["generator"]
    wanted = PRINTED.torque / ((1 + 43 / 11) * (29 / 9.5) * (18.5 / 8))
    return (within("torques", "kinematics", "generator torque that holds the speed [N m]", wanted, ours, 1e-12),)


def _pair(harmonics: int):
    """Two wheels on held axes, one mesh, and its natural frequency [rad/s]."""
    stage = ParallelSection.in_si(
        between=("a", "b"),
        teeth=(TEETH, TEETH),
        radii=(0.05, 0.1),
        mesh=MeshSection.in_si(stiffness=STIFFNESS, contact_ratio=1.5, low_share=0.8),
    )
    bodies = (
        BodySection.in_si(name="a", mass=10.0, inertia=0.2, tilts=False),
        BodySection.in_si(name="b", mass=20.0, inertia=0.9, tilts=False),
    )
    held = (BearingSection.in_si(body="a", radial=math.inf), BearingSection.in_si(body="b", radial=math.inf))
    model = drivetrain_model(Drivetrain(bodies, parallel=(stage,), bearings=held, gravity=0.0), harmonics=harmonics)
    frequency = undamped_modes(model.still, model.mean_stiffness).frequency[-1]
    return model, 2.0 * math.pi * float(frequency)


def growth() -> tuple[Row, ...]:
    """Free motion in the middle of the principal instability: Mathieu's equation."""
    from scipy.integrate import solve_ivp

    model, natural = _pair(1)
    share = abs(model.stiffness[0, 1]) / model.mean_stiffness[0]

    def rate(t, y):
        return [y[2], y[3], *(-(1.0 + share * math.cos(2.0 * t)) * y[:2])]

    found = solve_ivp(rate, (0.0, math.pi), [1.0, 0.0, 0.0, 1.0], method="DOP853", rtol=1e-11, atol=1e-12)
    largest = np.abs(np.linalg.eigvals(found.y[:, -1].reshape(2, 2))).max()
    wanted = math.log(largest) / math.pi * natural
    period = math.pi / natural
    run = march_drivetrain(
        model, (), duration=150 * period, step=period / 200, speed=2.0 * natural / TEETH, start="zero"
    )
    text = "free motion of one mesh at twice its natural frequency, 200 steps a period: growth [1/s]"
    return (within("growth", "Mathieu's equation by DOP853", text, wanted, run.growth, 1e-3),)


def contact_loss() -> tuple[Row, ...]:
    """Free flight and impact of one mesh: a parabola and a sine, three times."""
    model, w = _pair(0)
    mass, load, speed = STIFFNESS / w**2, 5000.0, 0.1
    rest = load / STIFFNESS
    flight = 2.0 * speed * mass / load
    period = flight + (2.0 * math.pi - 2.0 * math.atan(speed / (w * rest))) / w
    torques = balanced_torque(model, "a", load * 0.05 * math.cos(math.radians(20.0)), "b")
    column = model.system.W[:, 0]
    start = np.zeros(len(column)), -speed * mass * np.linalg.solve(model.system.M, column)
    run = march_drivetrain(
        model,
        constant_torques(torques),
        duration=3.0 * period,
        step=period / 800,
        speed=10.0,
        start=start,
        contact_loss=True,
    )
    t = run.time % period
    touch = rest * (1.0 - np.cos(w * (t - flight))) + speed / w * np.sin(w * (t - flight))
    wanted = np.where(t < flight, -speed * t + 0.5 * load / mass * t**2, touch)
    error = np.abs(run.approach[:, 0] - wanted).max() / np.ptp(wanted)
    text = "flight and impact, 800 steps a period, three periods:"
    return (
        at_most("contact loss", "closed form", f"{text} approach over its range", 1e-4, error),
        at_most("contact loss", "theory", f"{text} energy balance", 1e-9, run.energy_balance.error),
    )
