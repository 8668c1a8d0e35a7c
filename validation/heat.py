"""Contact temperatures and oil film of teeth: Blok's band, closed forms of the standards, a test gear."""

from __future__ import annotations

import math

import numpy as np

from femgear.gears.contact_temperature import (
    BLOK,
    contact_half_width,
    flash_temperature,
    hertz_pressure,
    path_load_sharing,
    reduced_modulus,
)
from femgear.gears.friction import path_speeds
from femgear.gears.micropitting import film_thickness, oil_state
from femgear.stages.heat import POINTS, load_over_path, solve_heat
from femgear.stages.losses import solve_losses
from femgear.stages.static import solve_static
from femgear.trains.reading import read_case, with_values
from validation.losses import C14_SPEED, C14_TORQUE, C14_WIDTH, GEARPIE, SPUR, spur_test_gear
from validation.rows import Row, at_most, information, printed, within

DUHAMEL = "Duhamel's integral of a half space under a moving band of elliptical heat"
CLOSED = "ISO/TS 6336-20, mu X_M X_G w_Bt^0.75 v_t^0.5/a^0.25 with X_M = 50, X_alphabeta = 1.22 sin^0.25/cos^0.75"
FILM = "ISO/TS 6336-22 in mm, N/mm^2, N s/m^2"
OIL = (100e-6, 11e-6, 880.0, "mineral")


def band_factor() -> float:
    """Find the largest of ``integral q(s)/sqrt(x - s) ds sqrt(2/pi)`` of a half ellipse q of unit area on -1..1."""
    largest = 0.0
    for x in np.linspace(-0.5, 1.0, 151):
        root = np.linspace(0.0, math.sqrt(x + 1.0), 20001)
        heat = 2.0 / math.pi * np.sqrt(np.clip(1.0 - (x - root**2) ** 2, 0.0, None))
        largest = max(largest, 2.0 * float(np.trapezoid(heat, root)) * math.sqrt(2.0 / math.pi))
    return largest


def closed_forms() -> tuple[Row, ...]:
    """Flash temperature, pressure and film of the FZG gear C14 at 200 N m and 1500 rpm."""
    pair, width = spur_test_gear((0.1817, 0.1715), (82.636, 118.544)), C14_WIDTH
    load, modulus = C14_TORQUE / pair.gear_1.base_radius / width, reduced_modulus((206e9, 0.3), (206e9, 0.3))
    frequency, angle = C14_SPEED / (2.0 * math.pi) * 16, pair.working_pressure_angle
    path = np.linspace(*pair.path, 9)
    speeds, pitch = path_speeds(pair, path, frequency), path_speeds(pair, 0.0, frequency)
    half = contact_half_width(load, speeds.radius, modulus)
    flash = flash_temperature(0.05, load, half, speeds.rolling_1, speeds.rolling_2)
    place = path / (pair.gear_1.base_radius * math.tan(angle))
    shape = np.abs(np.sqrt(1.0 + place) - np.sqrt(1.0 - place / 1.5)) / ((1.0 + place) * (1.5 - place)) ** 0.25
    geometry = 0.51 * 1.22 * math.sin(angle) ** 0.25 / math.cos(angle) ** 0.75 * math.sqrt(2.5) * shape
    speed, unit_load = C14_SPEED * 36.6e-3, 1e-3 * load * math.cos(angle)
    standard = 0.05 * 50.0 * geometry * unit_load**0.75 * speed**0.5 / 91.5**0.25
    ratio, pressure = flash / standard, hertz_pressure(load, speeds.radius, modulus)
    bands = np.sqrt(8.0 * speeds.radius * pressure / modulus)
    carried = 13.8e3 * (np.sqrt(speeds.rolling_1) + np.sqrt(speeds.rolling_2))
    of_pressure = 0.5 * math.sqrt(math.pi) * 0.05 * pressure * np.abs(speeds.sliding) / carried * bands
    steps = [*speeds.specific_sliding[0][:1], *speeds.specific_sliding[1][-1:]]
    return (
        within("band", DUHAMEL, "factor 1.11 of H. Blok", band_factor(), BLOK, 5e-3),
        within("C14", CLOSED, "flash temperature at nine points, largest ratio", 1.0, ratio.max(), 5e-3),
        within("C14", CLOSED, "flash temperature at nine points, smallest ratio", 1.0, ratio.min(), 5e-3),
        within("C14", "ISO/TS 6336-22, sqrt(pi)/2 mu p dv sqrt(8 rho p/E_r)", "flash temperature, largest [K]",
               float(of_pressure.max()), float(flash.max()), 0.02),
        printed("C14", GEARPIE, "pressure at the pitch point [MPa]", "1347.3",
                1e-6 * float(hertz_pressure(load, pitch.radius, modulus))),
        within("C14", GEARPIE, "half width at the pitch point [um]", 199.567,
               1e6 * float(contact_half_width(load, pitch.radius, modulus)), 5e-4),
        printed("C14", GEARPIE, "largest specific sliding of gear 1", "3.8", -steps[0]),
        printed("C14", GEARPIE, "largest specific sliding of gear 2", "2.2", -steps[1]),
        within("C14", FILM, "film at the pitch point [um]", _film_in_units(pitch, pressure[4], modulus),
               1e6 * float(_film(pitch, hertz_pressure(load, pitch.radius, modulus), modulus)), 2e-3),
    )  # fmt: skip


def _film(pitch, pressure, modulus: float):
    teeth, contact = oil_state(*OIL, 363.15), oil_state(*OIL, 373.15)
    return film_thickness(pitch.radius, modulus, pitch.sum_speed, pressure, teeth, contact)


def _film_in_units(pitch, pressure: float, modulus: float) -> float:
    """The film at the pitch point as the standard writes it [um]: oil of 100 and 11 mm^2/s at 90 and 100 degrees."""
    radius, reduced = 1e3 * float(pitch.radius), 1e-6 * modulus

    def oil(celsius: float) -> tuple[float, float]:
        def thin(kelvin: float) -> float:
            low, high = (math.log10(math.log10(value + 0.7)) for value in (100.0, 11.0))
            slope = (high - low) / (math.log10(373.15) - math.log10(313.15))
            return 10.0 ** (10.0 ** (low + slope * (math.log10(kelvin) - math.log10(313.15)))) - 0.7

        dynamic = [1e-6 * thin(t + 273.15) * (880.0 - 0.7 * (t + 273.15 - 289.0)) for t in (celsius, 38.0)]
        alpha = 2.657e-8 * dynamic[1] ** 0.1348 * (1.0 + 516.0 * (1.0 / (celsius + 273.0) - 1.0 / 311.0))
        return dynamic[0], alpha

    (eta, alpha), (eta_hot, alpha_hot) = oil(90.0), oil(100.0)
    material = 1e6 * alpha * reduced
    speed = eta * float(pitch.sum_speed) / (2000.0 * reduced * radius)
    load = 2.0 * math.pi * (1e-6 * pressure) ** 2 / reduced**2
    sliding = alpha_hot * eta_hot / (alpha * eta)
    return 1600.0 * radius * material**0.6 * speed**0.7 * load**-0.13 * sliding**0.22


def whole_run() -> tuple[Row, ...]:
    """Loads, temperatures and bulk temperatures of the whole computation of C14."""
    oil = {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s", "temperature": "90 degC", "fzg_stage": 12}
    case = with_values(read_case(SPUR.format(positions=64)), {"lubricant": oil})
    static = solve_static(case)
    heat = solve_heat(case, static, solve_losses(case, static)).dataset()
    pair = static.planetary_set.kinds[0]
    path = np.linspace(pair.path[0], pair.path[1], POINTS)
    mean = C14_TORQUE / pair.gear_1.base_radius / C14_WIDTH
    carried = load_over_path(static, 0, path)
    middle = np.abs(path) < 0.15 * pair.base_pitch
    beyond = path > pair.path[0] + pair.base_pitch
    partner = np.interp(path[beyond] - pair.base_pitch, path, carried)
    shared = float(heat["shared_flash_temperature"].max())
    bulk = heat["bulk_temperature"].values[0, 0]
    limits = path_load_sharing(pair, np.array([pair.path[0], 0.0, pair.path[1]]))
    return (
        within("C14", "one pair carries all", "load over width at the pitch point [N/m]", mean,
               float(carried[middle].min()), 1e-6),
        within("C14", "both pairs carry all", "loads a base pitch apart, largest sum [N/m]", mean,
               float((carried[beyond] + partner).max()), 1e-2),
        within("C14", "1/3, 1, 1/3", "X_Gamma at A, C and E, sum", 5.0 / 3.0, float(limits.sum()), 1e-12),
        information("C14", "X_Gamma", "largest flash temperature of the computed loads [K]", shared,
                    float(heat["flash_temperature"].max())),
        within("C14", "ISO/TS 6336-20", "rise of the teeth over the oil by their losses, part 22 [K]",
               bulk[0] - 90.0, bulk[1] - 90.0, 0.3, note="two models of one thing"),
        at_most("C14", "ISO/TS 6336-20", "scuffing safety below one", 0.0,
                max(0.0, 1.0 - float(heat["scuffing_safety"].min()))),
    )  # fmt: skip
