"""Shafts as beams: statics, rigid motions, natural frequencies, whirl, each against what femgear did not compute."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from femgear.fe.beam import AXES, BeamShaft, RoundSection, ShaftPart, beam_shaft, rigid_link
from validation.rows import Row, at_most, within
from validation.timoshenko import (
    Disc,
    Support,
    free_bending,
    hinged_whirl,
    natural_frequencies,
    shaft_system,
    simply_supported,
    whirl_frequencies,
)

CLOSED = "closed form"
TRANSFER = "zeros of the exact transfer matrix"
LIBRARY = "ross-rotordynamics 2.3.0, the same elements"
CONES_OF_LIBRARY = "ross-rotordynamics 2.3.0, 96 elements of its own"
SECTION, LENGTH, COUNT = RoundSection(0.1, 0.02), 1.0, 24
PART = ShaftPart(LENGTH, SECTION.outer_diameter, SECTION.inner_diameter)
DISCS = (Disc(6, 20.0, 0.18, 0.10), Disc(16, 35.0, 0.50, 0.30))
BEARINGS = (Support(0, 5e7), Support(COUNT, 8e7))
CLAMP = Support(0, *[math.inf] * 4)
# damped natural frequencies [Hz] by that library, steel of 206 GPa, 0.3 and 7850 kg/m^3. Uniform shaft of 24
# elements: free; with discs; with discs in bearings of 5e7 and 8e7 N/m at the ends
FREE = ("452.333793", "1189.288296", "2195.991369")
WITH_DISCS = ("377.474134", "835.190445", "1324.163334")
IN_BEARINGS = ("106.033701", "275.141073", "575.650784")
STEPPED = (ShaftPart(0.3, 0.06), ShaftPart(0.5, 0.09, 0.03), ShaftPart(0.4, 0.05))
STEPPED_DISCS = (Disc(9, 30.0, 0.36, 0.20), Disc(24, 12.0, 0.09, 0.05))
STEPPED_BEARINGS = (Support(2, 4e7, axial=6e7), Support(19, 7e7))
# the stepped shaft of 24 elements of 50 mm on bearings of 4e7 and 7e7 N/m, speed [rad/s]: frequencies and their
# sense by that library, 1 turning with the shaft, -1 against it, 0 torsion and stretch
CAMPBELL: dict[float, tuple[tuple[str, int], ...]] = {
    300.0: (
        ("77.840792", -1),
        ("82.962492", 1),
        ("124.486136", -1),
        ("125.197148", 1),
        ("138.502864", 0),
        ("196.929981", 0),
        ("365.185712", -1),
        ("383.275923", 1),
        ("505.149342", -1),
        ("554.079136", 1),
    ),
    900.0: (
        ("72.604172", -1),
        ("87.817763", 1),
        ("123.868952", -1),
        ("126.017035", 1),
        ("138.502864", 0),
        ("196.929981", 0),
        ("346.414228", -1),
        ("400.387931", 1),
        ("456.667102", -1),
        ("587.198386", 1),
    ),
}
CONICAL = (
    ShaftPart(0.3, 0.06),
    ShaftPart(0.5, 0.06, 0.0, end_outer_diameter=0.10),
    ShaftPart(0.4, 0.10, 0.04),
)
# the conical shaft at 900 rad/s, a disc at its end, bearings of 1e7 N/m at the left end and 1e8 N/m at 0.8 m
CONICAL_CAMPBELL = (("76.744553", -1), ("81.243147", 1), ("197.820074", -1), ("198.048428", 1), ("374.096123", -1))


# a stepped rotor with a heavy disc beyond its second bearing, 24 elements of 25 mm, by the same library
OVERHUNG = (ShaftPart(0.25, 0.06), ShaftPart(0.15, 0.07, 0.02), ShaftPart(0.2, 0.05, 0.015))
OVERHUNG_DISCS = (Disc(4, 6.0, 0.02, 0.012), Disc(24, 25.0, 0.30, 0.17))
OVERHUNG_BEARINGS = (Support(2, 8e7, axial=6e7), Support(14, 1.2e8))
OVERHUNG_ELEMENT = 0.025
OVERHUNG_CAMPBELL: dict[float, tuple[tuple[str, int], ...]] = {
    600.0: (
        ("70.104804", -1),
        ("92.957155", 1),
        ("183.950930", 0),
        ("274.678913", -1),
        ("410.495510", 1),
        ("423.740744", 0),
        ("478.889595", -1),
        ("480.236512", 1),
        ("918.201172", -1),
        ("955.212413", 1),
    ),
    1800.0: (
        ("49.473380", -1),
        ("109.425515", 1),
        ("183.950930", 0),
        ("214.480193", -1),
        ("423.740738", 0),
        ("478.340298", 1),
        ("478.443722", -1),
        ("629.040027", 1),
        ("882.443876", -1),
        ("998.230311", 1),
    ),
}


def displacements(
    shaft: BeamShaft, held: Iterable[tuple[int, Sequence[str]]], load: Mapping[tuple[int, str], float]
) -> np.ndarray:
    """Static motions (n, 6) of a shaft.

    Parameters
    ----------
    shaft : BeamShaft
    held : (station, motions of `AXES`) pairs
        Motions that are zero; a negative station counts from the right end.
    load : mapping of (station, motion) to float
        Forces [N] and moments [N m].
    """
    size = len(shaft.mass)

    def number(station, axis):
        return (6 * station + AXES.index(axis)) % size

    fixed = {number(station, axis) for station, axes in held for axis in axes}
    free = np.array([i for i in range(size) if i not in fixed])
    force, moved = np.zeros(size), np.zeros(size)
    for (station, axis), value in load.items():
        force[number(station, axis)] += value
    moved[free] = np.linalg.solve(shaft.stiffness[np.ix_(free, free)], force[free])
    return moved.reshape(-1, 6)


def statics() -> tuple[Row, ...]:
    """Slopes and deflections on two bearings; twist and stretch of a stepped shaft."""
    s, load = SECTION, 1000.0
    bend, shear = s.bending_stiffness, s.shear_stiffness
    rows = []

    def add(text, wanted, ours):
        rows.append(within("statics", CLOSED, text, wanted, ours, 1e-9))

    def on_bearings(place, second):
        shaft = beam_shaft([PART], (place, second))
        seats, gear = (0, shaft.index_of(second)), shaft.index_of(place)
        held = [(seats[0], ("x", "y", "z", "rotation")), (seats[1], ("x", "y"))]
        return displacements(shaft, held, {(gear, "x"): load})[[*seats, gear]]

    moved = on_bearings(0.5 * LENGTH, LENGTH)
    add("gear amid two bearings, slope at the left seat [rad]", load * LENGTH**2 / (16.0 * bend), moved[0, 4])
    add("gear amid two bearings, slope at the right seat [rad]", -load * LENGTH**2 / (16.0 * bend), moved[1, 4])
    rows.append(at_most("statics", CLOSED, "gear amid two bearings, its slope [rad]", 1e-15, moved[2, 4]))
    deflection = load * LENGTH**3 / (48.0 * bend) + load * LENGTH / (4.0 * shear)
    add("gear amid two bearings, its deflection [m]", deflection, moved[2, 0])
    a, b = 0.3 * LENGTH, 0.7 * LENGTH
    moved = on_bearings(a, LENGTH)
    add("gear off mid, F a b (b - a) / 3 E I L [rad]", load * a * b * (b - a) / (3.0 * bend * LENGTH), moved[2, 4])
    deflection = load * a**2 * b**2 / (3.0 * bend * LENGTH) + load * a * b / (shear * LENGTH)
    add("gear off mid, its deflection [m]", deflection, moved[2, 0])
    span, over = 0.6 * LENGTH, 0.4 * LENGTH
    moved = on_bearings(LENGTH, span)
    # the couple F c on the span shears it evenly, so that all sections tilt by F c / (kappa G A L)
    even = load * over / (shear * span)
    add("overhung gear, slope at the far seat [rad]", -load * over * span / (6.0 * bend) + even, moved[0, 4])
    add("overhung gear, slope at the near seat [rad]", load * over * span / (3.0 * bend) + even, moved[1, 4])
    slope = load * over * (2.0 * span + 3.0 * over) / (6.0 * bend) + even
    add("overhung gear, its slope [rad]", slope, moved[2, 4])
    deflection = load * over**2 * (span + over) / (3.0 * bend) + load * over * (1.0 + over / span) / shear
    add("overhung gear, its deflection [m]", deflection, moved[2, 0])
    # the joint of two rigid links stores as much: docs/drivetrain.md
    energy = load**2 * LENGTH**3 / (6.0 * bend) + load**2 * LENGTH / (2.0 * shear)
    moved = displacements(divided(COUNT), [(0, AXES)], {(-1, "x"): load})[-1]
    add("cantilever of 24 elements under an end load, energy [J]", energy, 0.5 * load * moved[0])
    shaft = beam_shaft(STEPPED)
    moved = displacements(shaft, [(0, AXES)], {(-1, "rotation"): load, (-1, "z"): load})[-1]
    sections = [(part.section(0.0), part.length) for part in STEPPED]
    twist = sum(load * length / (2.0 * c.shear_modulus * c.second_moment) for c, length in sections)
    add("stepped shaft, twist [rad]", twist, moved[5])
    add("stepped shaft, stretch [m]", sum(load * length / (c.young * c.area) for c, length in sections), moved[2])
    return tuple(rows)


def cone_compliances(part: ShaftPart) -> dict[str, float]:
    """Compliances of the thin right end of a cantilever whose bore is in proportion to its outer diameter.

    ``int_0^L x^2 / (a + s x)^4 dx = L^3 / (3 a b^3)`` with ``b = a + s L``, and so on: integrals from the free end.
    """
    (b, bore), (a, _) = part.diameters
    L, s, m, G = part.length, (b - a) / part.length, bore / b, part.section(0.0).shear_modulus
    bend = part.young * math.pi / 64.0 * (1.0 - m**4)
    shear = part.section(0.0).shear_coefficient * G
    area = math.pi / 4.0 * (1.0 - m**2)
    even = (a**-3 - b**-3) / (3.0 * s)
    return {
        "deflection under a force": L**3 / (3.0 * a * b**3) / bend + L / (shear * area * a * b),
        "tilt under a force": L**2 * (3.0 * a + s * L) / (6.0 * a**2 * b**3) / bend,
        "tilt under a moment": even / bend,
        "stretch": L / (part.young * area * a * b),
        "twist": even * part.young / (2.0 * G * bend),
    }


def cones() -> tuple[Row, ...]:
    """Conical cantilevers, solid and hollow, as one element and as many."""
    rows = []
    ways = (("x", "x"), ("tilt y", "x"), ("tilt y", "tilt y"), ("z", "z"), ("rotation", "rotation"))
    for name, part in (
        ("solid cone 80 to 20 mm", ShaftPart(0.3, 0.08, end_outer_diameter=0.02)),
        ("hollow cone 80/40 to 50/25 mm", ShaftPart(0.3, 0.08, 0.04, 0.05, 0.025)),
    ):
        for words, longest in (("one element", math.inf), ("many elements", 0.01)):
            shaft = beam_shaft([part], longest_element=longest)
            for (quantity, wanted), (answer, load) in zip(cone_compliances(part).items(), ways, strict=True):
                ours = displacements(shaft, [(0, AXES)], {(-1, load): 1.0})[-1, AXES.index(answer)]
                rows.append(within("cones", CLOSED, f"{name}, {words}: {quantity}", wanted, ours, 1e-9))
    return tuple(rows)


def frustum(part: ShaftPart, start: float) -> np.ndarray:
    """Mass, static moment, moments about z and across it at the left end of the shaft, of a part that starts there."""

    def solid(diameters):
        a, b = diameters
        L, d = part.length, b - a
        # integrals of (a + d t)^2 t^n, t from 0 to 1, and of its fourth power
        n0, n1, n2 = (a * a / (n + 1) + 2 * a * d / (n + 2) + d * d / (n + 3) for n in range(3))
        fourth = sum(a**i * b ** (4 - i) for i in range(5)) / 5.0
        line, polar = math.pi / 4.0 * part.density * L, math.pi / 32.0 * part.density * L * fourth
        across = line * (start**2 * n0 + 2.0 * start * L * n1 + L**2 * n2) + 0.5 * polar
        return np.array([line * n0, line * (start * n0 + L * n1), polar, across])

    outer, inner = zip(*part.diameters)
    return solid(outer) - solid(inner)


def rigid_motions() -> tuple[Row, ...]:
    """Motions of the whole shaft: no force, the mass, inertia and angular momentum of the solid."""
    parts = (*STEPPED, ShaftPart(0.2, 0.09, 0.01, end_outer_diameter=0.06, end_inner_diameter=0.03))
    shaft = beam_shaft(parts, (0.11, 0.77))
    starts = np.concatenate([[0.0], np.cumsum([part.length for part in parts])])
    mass, static, polar, across = np.sum([frustum(part, start) for part, start in zip(parts, starts)], axis=0)
    motions = np.vstack([rigid_link((0.0, 0.0, z)) for z in shaft.stations])
    ours = motions.T @ shaft.mass @ motions
    momentum = motions.T @ shaft.gyroscopic @ motions
    text = "stepped and conical shaft, "
    force = np.abs(shaft.stiffness @ motions).max() / np.abs(shaft.stiffness).max()
    turned = np.zeros((6, 6))
    turned[3, 4], turned[4, 3] = polar, -polar
    rest = np.abs(momentum - turned).max() / polar
    return (
        at_most("rigid", "theory", text + "force of rigid motions over the largest stiffness", 1e-12, force),
        *(within("rigid", CLOSED, f"{text}mass along {AXES[i]} [kg]", mass, ours[i, i], 1e-12) for i in range(3)),
        within("rigid", CLOSED, text + "static moment [kg m]", static, ours[0, 4], 1e-12),
        within("rigid", CLOSED, text + "inertia about a diameter [kg m^2]", across, ours[3, 3], 1e-12),
        within("rigid", CLOSED, text + "inertia about the axis [kg m^2]", polar, ours[5, 5], 1e-12),
        at_most("rigid", CLOSED, text + "gyroscopic matrix of a disc of its inertia, error over it", 1e-12, rest),
    )


def divided(count: int) -> BeamShaft:
    """The uniform shaft in equal elements."""
    return beam_shaft([PART], longest_element=LENGTH / count)


def hinges(last: int) -> tuple[Support, Support]:
    """Hold both ends of a shaft across the axis, the right one by the number of its station."""
    return Support(0, math.inf), Support(last, math.inf)


def frequencies() -> tuple[Row, ...]:
    """Timoshenko shafts at rest: exact roots, and a rotor-dynamics library."""
    rows = []
    ours = natural_frequencies(shaft_system(divided(96), supports=hinges(96)))
    for number in (1, 2, 3):
        wanted = simply_supported(SECTION, LENGTH, number)
        text = f"simply supported Timoshenko shaft, 96 elements, mode {number} [Hz]"
        rows.append(within("shaft", CLOSED, text, wanted, _nearest(ours, wanted), 1e-3))
    for words, discs, top in (("", (), 2500.0), (" with two discs", DISCS, 1400.0)):
        stations = [Disc(4 * disc.station, disc.mass, disc.polar, disc.transverse) for disc in discs]
        places = [(disc.station / COUNT * LENGTH, disc) for disc in discs]
        ours = natural_frequencies(shaft_system(divided(4 * COUNT), discs=stations))
        for number, wanted in enumerate(free_bending(SECTION, LENGTH, 100.0, top, discs=places), 1):
            name = f"free-free shaft{words}, 96 elements, bending {number} [Hz]"
            rows.append(within("shaft", TRANSFER, name, wanted, _nearest(ours, wanted), 1e-3))
    cases: tuple[tuple[str, dict[str, Any], tuple[str, ...]], ...] = (
        ("free-free shaft", {}, FREE),
        ("free-free shaft with two discs", {"discs": DISCS}, WITH_DISCS),
        ("two discs in bearings", {"discs": DISCS, "supports": BEARINGS}, IN_BEARINGS),
    )
    for text, options, values in cases:
        ours = natural_frequencies(shaft_system(divided(COUNT), **options))
        for number, value in enumerate(values, 1):
            near = _nearest(ours, float(value))
            rows.append(within("shaft", LIBRARY, f"{text}, bending {number} [Hz]", float(value), near, 1e-5))
    return tuple(rows)


def along_and_about() -> tuple[Row, ...]:
    """Axial and torsional frequencies: ``(2 n - 1) c / 4 L`` of a clamped shaft, ``n c / 2 L`` of a free one."""
    rows, s = [], SECTION
    for words, axis, speed in (
        ("axial", "z", math.sqrt(s.young / s.density)),
        ("torsional", "rotation", math.sqrt(s.shear_modulus / s.density)),
    ):
        for ends, held, factor in (("free", (), (2, 4)), ("clamped", (CLAMP,), (1, 3))):
            ours = natural_frequencies(shaft_system(divided(96), supports=held), axes=(axis,))
            for number, half_waves in enumerate(factor, 1):
                wanted = half_waves * speed / (4.0 * LENGTH)
                text = f"{ends} shaft, 96 elements, {words} {number} [Hz]"
                rows.append(within("shaft", CLOSED, text, wanted, _nearest(ours, wanted), 1e-3))
    return tuple(rows)


def default_elements() -> tuple[Row, ...]:
    """First bending frequencies of uniform shafts with the stations of the default, largest error of all."""
    diameter, errors = 0.1, []
    for slender in (3, 5, 10, 20, 40):
        for bore in (0.0, 0.7):
            length, section = slender * diameter, RoundSection(diameter, bore * diameter)
            shaft = beam_shaft([ShaftPart(length, diameter, bore * diameter)])
            last = len(shaft.stations) - 1
            hinged = shaft_system(shaft, supports=hinges(last))
            free = natural_frequencies(shaft_system(shaft), axes=("x", "tilt y"))
            exact = free_bending(section, length, 0.5 * free[2], 1.05 * free[3])
            on_hinges = [simply_supported(section, length, number) for number in (1, 2)]
            ours = natural_frequencies(hinged, axes=("x", "tilt y"))
            errors += [free[2:4] / exact[:2] - 1.0, ours[:2] / on_hinges - 1.0]
    first, second = np.abs(errors).max(axis=0)
    text = "uniform shafts of 3 to 40 diameters, free and hinged, default elements, largest error of bending"
    return (
        at_most("default", f"{CLOSED}; {TRANSFER}", f"{text} 1", 2e-3, first),
        at_most("default", f"{CLOSED}; {TRANSFER}", f"{text} 2", 6e-3, second),
    )


def turning() -> tuple[Row, ...]:
    """Whirl of a uniform turning shaft on hinges, and of a disc at the end of a shaft without mass."""
    rows, speed = [], 2000.0
    hinged = shaft_system(divided(32), supports=hinges(32))
    ours = whirl_frequencies(hinged, speed)
    text = f"uniform shaft on hinges at {speed:g} rad/s, 32 elements, "
    for number in (1, 2):
        wanted = {sense: hinged_whirl(SECTION, LENGTH, number, sense * speed) for sense in (1, -1)}
        near = {sense: _nearest(ours[ours[:, 1] == sense, 0], wanted[sense]) for sense in (1, -1)}
        for sense, words in ((1, "forward"), (-1, "backward")):
            rows.append(within("whirl", CLOSED, f"{text}{words} whirl {number} [Hz]", wanted[sense], near[sense], 1e-3))
        split = wanted[1] - wanted[-1], near[1] - near[-1]
        rows.append(within("whirl", CLOSED, f"{text}forward less backward whirl {number} [Hz]", *split, 5e-3))
    part, disc, speed = ShaftPart(0.4, 0.05, density=0.0), Disc(1, 30.0, 0.6, 0.35), 500.0
    system = shaft_system(beam_shaft([part], longest_element=math.inf), discs=(disc,), supports=(CLAMP,))
    ours, s, L = whirl_frequencies(system, speed), part.section(0.0), part.length
    bend, shear = s.bending_stiffness, s.shear_stiffness
    cross = L**2 / (2.0 * bend)
    k = np.linalg.inv([[L**3 / (3.0 * bend) + L / shear, cross], [cross, L / bend]])
    # (k_uu - m w^2) (k_tt + I_p Omega w - I_t w^2) = k_ut^2, w positive in the sense of the shaft
    across, tilt = np.poly1d([-disc.mass, 0.0, k[0, 0]]), np.poly1d([-disc.transverse, disc.polar * speed, k[1, 1]])
    for root in sorted(np.roots((across * tilt - k[0, 1] ** 2).coeffs).real, key=abs):
        sense = 1 if root > 0.0 else -1
        wanted = abs(root) / (2.0 * math.pi)
        text = f"overhung disc at {speed:g} rad/s, {'forward' if sense > 0 else 'backward'} whirl [Hz]"
        rows.append(within("whirl", CLOSED, text, wanted, _nearest(ours[ours[:, 1] == sense, 0], wanted), 1e-9))
    return tuple(rows)


def library() -> tuple[Row, ...]:
    """Campbell diagram of a stepped shaft with discs, and of one with a cone, by a rotor-dynamics library."""
    rows = []
    stepped = shaft_system(beam_shaft(STEPPED, longest_element=0.05), discs=STEPPED_DISCS, supports=STEPPED_BEARINGS)
    conical = beam_shaft(CONICAL, (0.8,), longest_element=0.025)
    seat, end = conical.index_of(0.8), len(conical.stations) - 1
    with_cone = shaft_system(
        conical, discs=(Disc(end, 12.0, 0.09, 0.05),), supports=(Support(0, 1e7, axial=1e7), Support(seat, 1e8))
    )
    whirls = {-1: "backward whirl", 0: "torsion or stretch", 1: "forward whirl"}
    overhung = shaft_system(
        beam_shaft(OVERHUNG, longest_element=OVERHUNG_ELEMENT), discs=OVERHUNG_DISCS, supports=OVERHUNG_BEARINGS
    )
    cases = [("stepped shaft with two discs", stepped, speed, lines, 1e-5) for speed, lines in CAMPBELL.items()]
    cases += [("overhung stepped rotor", overhung, speed, lines, 1e-6) for speed, lines in OVERHUNG_CAMPBELL.items()]
    cases.append(("shaft with a cone and a disc", with_cone, 900.0, CONICAL_CAMPBELL, 1e-3))
    for text, system, speed, lines, gate in cases:
        ours = whirl_frequencies(system, speed)
        source = LIBRARY if gate < 1e-4 else CONES_OF_LIBRARY
        for value, sense in lines:
            near = _nearest(ours[ours[:, 1] == sense, 0], float(value))
            quantity = f"{text} at {speed:g} rad/s, {whirls[sense]} [Hz]"
            rows.append(within("Campbell", source, quantity, float(value), near, gate))
    return tuple(rows)


def _nearest(values, wanted: float) -> float:
    return float(values[np.argmin(np.abs(values - wanted))])
