"""Parametric stability: Mathieu, Meissner and one gear pair with a rectangular mesh stiffness."""

from __future__ import annotations

import math

import numpy as np

from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.stability.floquet import monodromy
from femgear.solvers.stability.parametric import stability
from femgear.system.system import MeshExcitation, Modes
from validation.rows import REPEATED, Row, counted, printed, within

RATIO, SOFT = 0.635, 0.65
MEAN = RATIO + (1 - RATIO) * SOFT
NATURAL = math.sqrt(MEAN)
EXACT = "matrix exponentials of the two constant parts"


def mathieu_monodromy(a: float, q: float, damping: float = 0.0, steps: int = 2000) -> np.ndarray:
    """Monodromy of ``x'' + damping x' + (a - 2 q cos 2t) x = 0`` over pi, fourth-order Magnus steps.

    The exponent of a step is ``h/2 (A1 + A2) - sqrt(3)/12 h^2 [A1, A2]`` with A at the Gauss points
    (Blanes, Casas, Oteo and Ros, The Magnus expansion and some of its applications, 2009).
    """
    h = math.pi / steps
    middle = (np.arange(steps) + 0.5) * h
    gauss = []
    for side in (-1, 1):
        matrix = np.zeros((steps, 2, 2))
        matrix[:, 0, 1], matrix[:, 1, 1] = 1.0, -damping
        matrix[:, 1, 0] = -(a - 2 * q * np.cos(2 * (middle + side * h * math.sqrt(3) / 6)))
        gauss.append(matrix)
    first_point, two = gauss
    effective = 0.5 * (first_point + two) - math.sqrt(3) / 12 * h * (first_point @ two - two @ first_point)
    return monodromy(effective, np.full(steps, h))


def mathieu() -> tuple[Row, ...]:
    """G1, G2, G3: Mathieu's equation."""
    rows = []
    source = "scipy.special.mathieu_a, mathieu_b"
    for q, name, a in (
        (1.0, "a0", -0.4551386041),
        (1.0, "a1", 1.8591080725),
        (1.0, "a2", 4.3713009827),
        (1.0, "b1", -0.1102488170),
        (1.0, "b2", 3.9170247730),
        (5.0, "a0", -5.8000460209),
        (5.0, "a1", 1.8581875415),
        (5.0, "b1", -5.7900805986),
        (5.0, "b2", 2.0994604455),
    ):
        expected = -2.0 if name.endswith("1") else 2.0
        trace = np.trace(mathieu_monodromy(a, q))
        quantity = f"Mathieu, q = {q:g}, characteristic value {name}: trace of the monodromy"
        rows.append(within("G1", source, quantity, expected, trace, 1e-7, relative=False))
    multipliers = np.sort(np.linalg.eigvals(mathieu_monodromy(1.0, 1.0)).real)
    circle = np.abs(np.linalg.eigvals(mathieu_monodromy(2.5, 1.0)))
    source = f"independent integration, DOP853 ({REPEATED})"
    rows += [
        printed("G2", source, "Mathieu a = 1, q = 1: larger multiplier", "-4.15605494", multipliers[0]),
        printed("G2", source, "Mathieu a = 1, q = 1: smaller multiplier", "-.2406128", multipliers[1]),
        within("G2", "theory", "Mathieu a = 2.5, q = 1: larger modulus", 1.0, circle.max(), 1e-9),
    ]
    for damping, q in ((0.1, 0.1000546711), (0.2, 0.2004369763)):
        largest = np.abs(np.linalg.eigvals(mathieu_monodromy(1.0, q, damping))).max()
        quantity = f"damped Mathieu a = 1, c = {damping}, at the threshold q: largest multiplier"
        rows.append(within("G3", f"threshold by DOP853 ({REPEATED})", quantity, 1.0, largest, 1e-9))
    return tuple(rows)


def meissner() -> tuple[Row, ...]:
    """G4: Meissner's equation, exact."""
    rows = []
    for d, e, value in (
        (0.25, 0.1, "-2.15946099"),
        (1.0, 0.3, "2.01491540"),
        (0.5, 0.2, "-.79900962"),
        (0.3678177281, 0.2, "-2.00000000"),
        (0.9900288140, 0.2, "2.00000000"),
        (1.0290305698, 0.2, "2.00000000"),
    ):
        parts = np.array([[[0.0, 1.0], [-(d + sign * e), 0.0]] for sign in (1, -1)])
        trace = np.trace(monodromy(parts, np.full(2, math.pi)))
        source = "2 cos A cos B - (w1/w2 + w2/w1) sin A sin B"
        rows.append(printed("G4", source, f"Meissner d = {d}, e = {e}: trace of the monodromy", value, trace))
    return tuple(rows)


def rectangular_monodromy(ratio: float, damping: float) -> np.ndarray:
    """Monodromy of one gear pair, ``x'' + 2 damping x' + k(t) x = 0``, k = 1 / 0.65, contact ratio 1.635."""
    period = 2 * math.pi / (ratio * NATURAL)
    parts = np.array([[[0.0, 1.0], [-k, -2 * damping]] for k in (1.0, SOFT)])
    return monodromy(parts, np.array([RATIO, 1 - RATIO]) * period)


def rectangular_stiffness() -> tuple[Row, ...]:
    """G5: rectangular mesh stiffness, bands and damped multipliers."""
    rows = []
    for low, high in ((1.884253, 2.113835), (0.964393, 1.026547), (0.660884, 0.665614), (0.491420, 0.504073)):
        for name, ratio in (("lower", low), ("upper", high)):
            # the modulus of the trace passes 2 at the boundary
            inside = [abs(np.trace(rectangular_monodromy(ratio + step, 0.0))) > 2 for step in (-1e-6, 1e-6)]
            quantity = f"{name} boundary of the unstable band at {ratio}: found within 1e-6 (1 yes)"
            rows.append(counted("G5", EXACT, quantity, 1, inside[0] != inside[1]))
    for damping, ratio, value in (
        (0.02, 2.0, "1.1198031"),
        (0.02, 1.0, "1.0608524"),
        (0.02, 0.5, ".8858646"),
        (0.05, 2.0, "1.0124401"),
        (0.05, 1.0, ".8660985"),
    ):
        largest = np.abs(np.linalg.eigvals(rectangular_monodromy(ratio, damping))).max()
        quantity = f"decay {damping}, w_m/w_n = {ratio:g}: largest multiplier"
        rows.append(printed("G5", EXACT, quantity, value, largest))
    return tuple(rows)


def one_pair(damping_ratio: float) -> tuple[Modes, MeshExcitation]:
    """Modal basis and excitation of the gear pair of G5 and G6, unit mass, sampled mesh stiffness."""
    stiffness = np.where(np.arange(2000) < RATIO * 2000, 1.0, SOFT)[None]
    unit = np.ones((1, 1))
    modes = Modes(
        frequency=np.array([NATURAL / (2 * math.pi)]),
        damping_ratio=np.array([damping_ratio]),
        shape=unit,
        mesh_stiffness=np.array([MEAN]),
        mesh_deflection=unit,
        residual=0 * unit,
        load_deflection=np.array([1 / MEAN]),
        kind=("elastic",),
        nodal_diameter=np.array([-1]),
    )
    level = np.ones_like(stiffness)
    return modes, MeshExcitation(stiffness=stiffness, deflection=level, force=level, backlash=np.zeros(1))


def fixed_point() -> tuple[Row, ...]:
    """G6: spectral radius of the fixed point against the Floquet verdict."""
    modes, excitation = one_pair(0.03)
    ratios = np.array([2.0, 1.0, 0.5])
    frequency = ratios * NATURAL / (2 * math.pi)
    # the reference treats the jumps of the stiffness exactly: take many of its harmonics
    response = solve_spectral(modes, excitation, frequency, excitation_harmonics=40, response_harmonics=80)
    multipliers = stability(modes, excitation, frequency, excitation_harmonics=40).modulus
    rows = []
    source, name = f"operator of 200 harmonics, exponentials ({REPEATED})", "damping ratio 0.03, w_m/w_n = "
    for ratio, value, radius in zip(ratios, (".096", "1.022", ".579"), response.spectral_radius, strict=True):
        quantity = f"{name}{ratio:g}: spectral radius of the fixed point"
        rows.append(printed("G6", source, quantity, value, radius))
    for ratio, value, multiplier in zip(ratios, ("1.090", "1.005"), multipliers, strict=False):
        note = "unstable, though the fixed point converges" if ratio == 2 else ""
        rows.append(printed("G6", source, f"{name}{ratio:g}: largest multiplier", value, multiplier, note=note))
    for ratio, multiplier in zip(ratios, multipliers, strict=True):
        exact = np.abs(np.linalg.eigvals(rectangular_monodromy(ratio, 0.03 * NATURAL))).max()
        quantity = f"{name}{ratio:g}: largest multiplier, 40 harmonics"
        rows.append(within("G6", EXACT, quantity, exact, multiplier, 1e-4))
    return tuple(rows)
