"""Planetary stages in series: ratios, modes of stages that know of each other and of stages that do not."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from fractions import Fraction

import numpy as np
from published.multistage_example import (
    PUBLISHED_FREQUENCIES,
    four_stage_case,
    four_stage_train,
    published_train,
)
from published.planetary_sets import lin_parker_set, torsional_set

from femgear.stages.lumped_set import gear_set_modes
from femgear.trains.multistage.model import (
    Member,
    MultistageSet,
    PlanetaryStage,
    StageCoupling,
    mean_mesh_stiffness,
    mesh_columns,
    multistage_system,
    speed_ratio,
    train_speeds,
    train_torques,
)
from femgear.trains.multistage.stages import error_response, loaded_errors, multistage_modes
from validation.reference.frequency_response import mesh_error_response
from validation.rows import Row, at_most, counted, information, within

SPEED, TORQUE = 50.0 * math.pi, 350.0
STRUCTURE = "Kiracofe and Parker, J. Vib. Acoust. 129, 2007: structure of the modes"


def ratios() -> tuple[Row, ...]:
    """Speeds and torques of the four-stage example against exact fractions."""
    train, exact = four_stage_train(), Fraction(1)
    for stage in train.stages:
        exact *= 1 + Fraction(stage.teeth[2], stage.teeth[0])
    speeds, torques = train_speeds(train, SPEED), train_torques(train, TORQUE)
    source, power = "product of 1 + z_r / z_s, exact", TORQUE * SPEED
    out = torques.output * speeds.of(train.output)
    mesh = train.stages[-1].teeth[2] * SPEED / float(exact) / (2.0 * math.pi)
    return (
        within("MS", source, "four stages: ratio of the speeds", float(exact), speed_ratio(train), 1e-12),
        within("MS", source, "output torque [N m]", -TORQUE * float(exact), torques.output, 1e-12),
        within("MS", "z_r w_c / (2 pi)", "mesh of stage 4 [Hz]", mesh, speeds.mesh_frequency[-1], 1e-12),
        within("MS", "power balance", "power at the output [W]", -power, out, 1e-12),
        at_most(
            "MS",
            "radii belong to teeth",
            "output torque of the lumped sets, relative difference",
            1e-12,
            abs(train_torques(train, TORQUE, radii=True).output / torques.output - 1.0),
        ),
    )


def uncoupled() -> tuple[Row, ...]:
    """Two identical stages side by side: every mode twice."""
    rows = []
    for planets in (3, 4, 5):
        data = lin_parker_set(planets)
        pair = (PlanetaryStage(data=data), PlanetaryStage(data=data))
        train = MultistageSet(stages=pair, couplings=(), input=Member(1, "sun"), output=Member(2, "carrier"))
        found, single = multistage_modes(train), gear_set_modes(data)
        elastic = single.frequency > 0.0
        error = np.abs(found.modes.frequency[2:] / np.repeat(single.frequency[elastic], 2) - 1.0).max()
        name = f"two uncoupled stages of {planets} planets: "
        rows.append(at_most("MS", "modes of one stage", name + "largest relative difference", 1e-10, error))
        own = Counter(found.modes.kind) == {kind: 2 * n for kind, n in Counter(single.kind).items()}
        rows.append(counted("MS", "modes of one stage", name + "every kind twice", 1, int(own)))
    return tuple(rows)


def structure() -> tuple[Row, ...]:
    """Kinds of the modes of the coupled four-stage example."""
    train = four_stage_train()
    found = multistage_modes(train)
    kinds = Counter(found.modes.kind)
    rotational, name = kinds["rotational"] + kinds["rigid"], "four stages: "
    rows = [
        counted("MS", STRUCTURE, name + "rotational modes, one rigid", 24, rotational),
        counted("MS", STRUCTURE, name + "translational modes", 48, kinds["translational"]),
        counted("MS", STRUCTURE, name + "planet modes, 3 (N - 3) a stage", 6, kinds["planet"]),
    ]
    planet = np.array(found.modes.kind) == "planet"
    for number in (3, 4):
        alone = gear_set_modes(train.stages[number - 1].data)
        own = alone.frequency[np.array(alone.kind) == "planet"]
        error = np.abs(found.modes.frequency[planet & (found.stage == number)] / own - 1.0).max()
        name = f"planet modes of stage {number}, coupled and alone: relative difference"
        rows.append(at_most("MS", STRUCTURE, name, 1e-9, error))
    return tuple(rows)


def soft_shaft() -> tuple[Row, ...]:
    """Two stages on a soft shaft: two inertias on a spring."""
    train = four_stage_train()
    stages = [replace(one, data=torsional_set(one.data)) for one in train.stages[:2]]
    rigid = math.inf
    stages = [
        replace(one, data=replace(one.data, ring=replace(one.data.ring, torsional_support=rigid))) for one in stages
    ]
    shaft = StageCoupling(Member(1, "carrier"), Member(2, "sun"), torsional=1.0)
    pair = MultistageSet(stages=tuple(stages), couplings=(shaft,), input=Member(1, "sun"), output=Member(2, "carrier"))
    first, second = (_reflected(one) for one in stages)
    # the second stage is felt at its sun
    second /= (1.0 + stages[1].teeth[2] / stages[1].teeth[0]) ** 2
    exact = math.sqrt(1.0 / first + 1.0 / second) / (2.0 * math.pi)
    ours = multistage_modes(pair).modes.frequency[1]
    source = "sqrt(k / J_1 + k / J_2), inertias by Willis"
    return (within("MS", source, "two torsional stages on a soft shaft [Hz]", exact, ours, 1e-6),)


def _reflected(stage: PlanetaryStage) -> float:
    """Inertia of a stage with a fixed ring, felt at its carrier [kg m^2]."""
    data, (zs, zp, zr) = stage.data, stage.teeth
    sun, planet = 1.0 + zr / zs, 1.0 - zr / zp
    planets = data.planet.mass * data.centre_distance**2 + data.planet.inertia * planet**2
    return data.carrier.inertia + data.sun.inertia * sun**2 + data.n_planets * planets


def response() -> tuple[Row, ...]:
    """Modal summation to the transmission errors of every stage."""
    train, speeds = four_stage_train(), SPEED * np.linspace(0.3, 1.2, 5)
    errors = loaded_errors(four_stage_case(), train)
    found = error_response(train, speeds, errors, damping_ratio=0.03)
    soft = error_response(four_stage_train(lateral=False), speeds, errors, damping_ratio=0.03)
    system, k, rows = multistage_system(train), mean_mesh_stiffness(train), []
    for number, columns in enumerate(mesh_columns(train), 1):
        table = np.zeros((train.n_meshes, 3), complex)
        table[columns] = errors[number]
        direct = mesh_error_response(system, found[number].mesh_frequency, table, mesh_stiffness=k, damping_ratio=0.03)
        size, name = np.abs(direct.force).max(), f"mesh forces by transmission errors of stage {number}: "
        error = np.abs(found[number].force - direct.force).max() / size
        rows.append(at_most("MS", "direct solution", name + "modal summation, difference", 1e-9, error))
        error = np.abs(found[number].force - soft[number].force).max() / size
        source = "no harmonic in the class of translations"
        rows.append(at_most("MS", source, name + "without lateral couplings, difference", 1e-9, error))
    return tuple(rows)


def published() -> tuple[Row, ...]:
    """Published four-stage table in torsion, free at both ends: stiffnesses as printed and a thousandth."""
    rows, source = [], "Optimized design of dynamic characteristics of planetary gear train"
    note = "number of planets, supports and shafts are not printed; docs/multistage.md has all readings"
    for unit, factor in (("N/mm as printed", 1e3), ("N/m", 1.0)):
        for planets in (3, 4):
            train = published_train(planets=planets, stiffness_unit=factor)
            elastic = multistage_modes(train).modes.frequency[1:]
            name = f"published table, {unit}, {planets} planets, rigid shafts: "
            for text, reference, value in zip(
                ("lowest", "highest"), PUBLISHED_FREQUENCIES, (elastic[0], elastic[-1]), strict=True
            ):
                words = f"{name}{text} elastic mode [Hz]"
                rows.append(information("MS", source, words, reference, value, note=note))
    return tuple(rows)
