"""Errors that turn with gears: dynamics over the whole record, and the orders of a fixed sensor."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from femgear.housing.sensor import SensorLines
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.stability.parametric import stability
from femgear.system.fourier import harmonics_of, sample
from femgear.system.system import MeshExcitation, Modes
from validation.cases import reference_case
from validation.dynamics import shooting
from validation.rows import Row, at_most, within

SHOOTING = "DOP853 over the whole record, periodic by linear shooting"
FOUR_PLANETS = {
    "set.planets": 4,
    "set.centre_distance": "40.1 mm",
    "sun.teeth": 21,
    "sun.module": "2 mm",
    "sun.bore_radius": "8 mm",
    "sun.profile_shift": None,
    "sun.tip_diameter": None,
    "planet.teeth": 19,
    "planet.bore_radius": "9 mm",
    "planet.profile_shift": 0.0,
    "planet.tip_diameter": None,
    "ring.teeth": 59,
    "ring.outer_radius": "75 mm",
    "ring.tip_diameter": "114.6 mm",
    "ring.profile_shift": None,
}
"""Changes of the reference case to 21/19/59, whose four planets mesh a quarter of a period apart."""


FEET = {
    "housing.support": [
        {"angle": f"{angle} deg", "radial_stiffness": "2e8 N/m", "tangential_stiffness": "1e8 N/m"}
        for angle in (200, 235, 340)
    ],
    "housing.nodal_diameters": 9,
    "dynamics.up_to": None,
    "dynamics.mesh_harmonics": 4,
}


def pitch(*values: float, teeth: int) -> list[str]:
    """Displacements of all teeth in a pattern [um], as an entry of a case."""
    return [f"{value} um" for value in np.resize(values, teeth)]


def low_modes(modes: Modes, highest: float) -> Modes:
    """Modes up to a frequency [Hz]; the others leave their static flexibility, as integrators want them."""
    low = modes.frequency < highest
    r, w = modes.mesh_deflection[:, ~low], 2 * np.pi * modes.frequency[~low]
    return replace(
        modes,
        residual=modes.residual + (r / w**2) @ r.T,
        kind=tuple(kind for kind, kept in zip(modes.kind, low) if kept),
        **{n: getattr(modes, n)[low] for n in ("frequency", "damping_ratio", "nodal_diameter", "modal_load")},
        **{n: getattr(modes, n)[:, low] for n in ("shape", "mesh_deflection")},
    )


def in_time(modes: Modes, excitation: MeshExcitation, frequency: float) -> tuple[float, float, float]:
    """Compare with time integration, for which the record is one long period of a slower mesh.

    Largest difference of the deflections over their peak to peak, with one mesh harmonic of the excitation,
    and the largest multiplier by `stability` and of the integrator.
    """
    basis, periods = low_modes(modes, 4000.0), excitation.periods
    response = solve_spectral(
        basis, excitation, frequency, excitation_harmonics=1, response_harmonics=4, tolerance=1e-11
    )
    single = replace(excitation, periods=1)
    whole, multipliers = shooting(basis, single, frequency / periods, harmonics=periods, count=1024)
    error = np.abs(sample(response.deflection[0], 1024) - whole).max() / np.ptp(whole, axis=1).max()
    ours = stability(basis, excitation, frequency, excitation_harmonics=1).modulus[0]
    return float(error), float(ours), float(np.abs(multipliers).max())


def off_the_rule(lines: SensorLines, step: int) -> float:
    """Largest acceleration of lines that are no multiples of ``step``/turns, over the largest of all."""
    amplitude = np.abs(lines.acceleration)
    forbidden = amplitude[:, lines.number % step != 0].max(axis=1)
    return float((forbidden / amplitude.max(axis=1)).max())


@cache
def _solved(which: str):
    """Results by stage of the reference set with a pin error and one of the sun, or others."""
    from femgear.run import solve
    from femgear.trains.reading import with_values

    of_sun = {"sun.errors": {"cumulative_pitch": pitch(4, -2, 0, teeth=27)}}
    changes = {
        "sun and pin": of_sun | {"set.pin_errors": [{"planet": 1, "tangential": "2 um"}]},
        "ring": {"ring.errors": {"cumulative_pitch": pitch(4, -2, 0, teeth=108)}},
        "four": FOUR_PLANETS | {"sun.errors": {"cumulative_pitch": pitch(4, -2, 0, teeth=21)}},
    }
    changes["four on feet"] = changes["four"] | FEET
    run = {"housing.form": "exact", "dynamics.tolerance": 1e-9, "operation.speeds": ["2000 rpm", "3100 rpm"]}
    if which == "sun and pin":
        run["operation.speeds"] = ["0.01 rpm"]
    return solve(with_values(reference_case(), run | changes[which]), "housing")


def time_integration() -> tuple[Row, ...]:
    """Errors of sun and pin, three mesh periods."""
    modes = _solved("sun and pin")["modes"]
    error, ours, reference = in_time(modes.modes, modes.excitation, 900.0)
    words = "errors of sun and pin, 900 Hz: "
    return (
        at_most("turning", SHOOTING, words + "largest difference over peak to peak", 1e-4, error),
        within("turning", SHOOTING, words + "largest Floquet multiplier of the record", reference, ours, 1e-3),
    )


def standstill() -> tuple[Row, ...]:
    """At 0.01 rpm the dynamics are the static record."""
    solution, rows = _solved("sun and pin"), []
    response, state = solution["dynamics"].response, solution["modes"].state
    for name, lines in (("deflection", solution["dynamics"].dte[0]), ("force", response.force[0])):
        wanted = sample(harmonics_of(state.resampled(name, 3 * 8192), 18), 512)
        error = np.abs(sample(lines[:, :19], 512) - wanted).max() / np.ptp(wanted, axis=1).max()
        words = f"errors of sun and pin, 0.01 rpm, {name}: largest difference over peak to peak"
        rows.append(at_most("turning", "loaded record of the set on its supports", words, 1e-3, error))
    return tuple(rows)


def orders() -> tuple[Row, ...]:
    """Orders ``N q + m S``: only those of the error's turns in space."""
    rule = "order rule L = N q + m S, at 2000 and 3100 rpm"
    four, ring, feet = (_solved(name)["housing"].exact for name in ("four", "ring", "four on feet"))
    words = "21/19/59, pattern of three teeth of the sun: largest line off the multiples of 4/3 over the largest"
    other = "27/40/108, pattern of three teeth of the ring: largest line off the multiples of 3 over the largest"
    return (
        at_most("turning", rule, words, 1e-10, off_the_rule(four, 4)),
        at_most("turning", rule, other, 1e-10, off_the_rule(ring, 3)),
        at_most("turning", rule, f"on three feet: {words}", 1e-8, off_the_rule(feet, 4)),
    )
