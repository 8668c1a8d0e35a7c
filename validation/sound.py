"""Sound of a radiating ring and cylinder, of its signals and of tones, beside closed forms and standards."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import j1

from femgear.housing.sensor import SensorLines
from femgear.housing.sound import (
    Cylinder,
    Microphone,
    a_weighting,
    equivalent_sound,
    pressure_transfer,
    radiation_efficiency,
    sampled_signal,
    sound_power,
    sound_pressure,
    sound_quality,
)
from validation.rows import Row, at_most, printed, within

JUNGER = "Junger and Feit 1986, closed form, evaluated apart"
EFFICIENCIES = {
    0.5: (".57252", ".19746", "3.0914e-3", "2.0884e-5"),
    1.0: (".79188", ".73880", ".099544", "2.5456e-3"),
    2.0: (".92514", ".98814", "1.0248", ".26988"),
}
"""Radiation efficiency of 0 to 3 nodal diameters by ka."""
WEIGHTS = {31.62: -39.4, 100.0: -19.1, 501.19: -3.2, 1000.0: 0.0, 1995.3: 1.2, 3981.1: 1.0, 15849.0: -6.6}
"""A-weighting [dB] by exact frequency: IEC 61672-1:2013, table 3."""


def outgoing(n: int, near: float, far: float) -> complex:
    """Integrate the radial wave equation inwards: outgoing wave at kr = far over its slope at ka = near.

    From 400, where the asymptotic series of an outgoing wave is exact to rounding, and without any Hankel
    function.
    """
    start = 400.0

    def series(x):
        total, term = 0j, 1 + 0j
        for k in range(1, 30):
            total += term
            term *= -1j * (4 * n * n - (2 * k - 1) ** 2) / (8 * k * x)
        return np.exp(-1j * (x - start)) / np.sqrt(x) * total

    step = 1e-3
    slope = (8 * (series(start + step) - series(start - step)) - series(start + 2 * step)) / (12 * step)
    slope += series(start - 2 * step) / (12 * step)

    def equation(x, w):
        return [w[1], -w[1] / x - (1 - (n / x) ** 2) * w[0]]

    places = sorted({near, far}, reverse=True)
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "t_eval": places}
    outwards = solve_ivp(equation, (start, near), [series(start), slope], **options)
    return outwards.y[0, 0] / outwards.y[1, -1]


def efficiency() -> tuple[Row, ...]:
    """Radiation efficiency of a cylinder."""
    return tuple(
        printed(
            "sigma",
            JUNGER,
            f"radiation efficiency, n = {n}, ka = {ka:g}",
            text,
            float(radiation_efficiency(n, ka)),
        )
        for ka, texts in EFFICIENCIES.items()
        for n, text in enumerate(texts)
    )


def side_bands() -> tuple[Row, ...]:
    """What air filters of side bands of equal velocity: 1116 Hz, a = 100 mm, at 1 m from the axis."""
    cylinder, frequency = Cylinder(0.1, np.inf), 1116.0
    n = np.arange(5)
    pressure = pressure_transfer(n, frequency, cylinder, 0.9)
    k = 2 * np.pi * frequency / 343.0
    rows = []
    for m, text in enumerate(("0.3", "0.5", "-4.7", "-16.6"), 1):
        level = 20 * np.log10(np.abs(pressure[m] / pressure[0]))
        quantity = f"1116 Hz, a = 100 mm, r = 1 m: pressure of n = {m} over that of n = 0 [dB]"
        rows.append(printed("air", JUNGER, quantity, text, level))
    for m in n:
        wave = -1j * 1.204 * 343.0 * outgoing(int(m), 0.1 * k, k)
        error = abs(pressure[m] / wave - 1)
        quantity = f"1116 Hz, n = {m}: complex pressure at 1 m against the wave equation in steps, relative"
        rows.append(at_most("air", "Helmholtz equation, integrated inwards", quantity, 1e-8, error))
    return tuple(rows)


def axial_waves(n: int, frequency: float, ring: Cylinder, distance: float) -> complex:
    """Sum the pressure of a ring in a rigid cylinder over real axial wave numbers, 400,000 of them."""
    from scipy.special import h2vp, hankel2

    a, width, k = ring.radius, ring.length, 2 * np.pi * frequency / ring.sound_speed
    angle = (np.arange(200_000) + 0.5) * (np.pi / 2 / 200_000)
    decay = (np.arange(200_000) + 0.5) * (60 / distance / 200_000)
    steps = np.pi / 2 / 200_000 * k * np.cos(angle), 60 / distance / 200_000 * decay / np.hypot(k, decay)
    waves = (k * np.sin(angle), k * np.cos(angle)), (np.hypot(k, decay), -1j * decay)
    total = sum(
        (
            step
            * np.sinc(axial * width / 2 / np.pi)
            * hankel2(n, radial * (a + distance))
            / (radial * h2vp(n, radial * a))
        ).sum()
        for step, (axial, radial) in zip(steps, waves)
    )
    return complex(-1j * ring.density * ring.sound_speed * width * k / np.pi * total)


def short_ring() -> tuple[Row, ...]:
    """Pressure and power of a ring in a rigid cylinder."""
    rows, ring = [], Cylinder(0.1, 0.025)
    for n in range(5):
        for frequency in (60.0, 1116.0, 8000.0):
            expected = axial_waves(n, frequency, ring, 0.9)
            error = abs(complex(pressure_transfer(n, frequency, ring, 0.9)) / expected - 1)
            quantity = f"{frequency:g} Hz, n = {n}, ring of 25 mm: complex pressure at 1 m, relative"
            rows.append(at_most("width", "sum over real axial wave numbers", quantity, 1e-5, error))
    small, distance = Cylinder(1e-3, 1e-3), 3.0
    monopole = 1j * 2 * np.pi * 50.0 * 1.204 * 1e-3 * 1e-3 / (2 * (distance + 1e-3))
    monopole *= np.exp(-2j * np.pi * 50.0 / 343.0 * distance)
    error = abs(complex(pressure_transfer(0, 50.0, small, distance)) / monopole - 1)
    quantity = "50 Hz, n = 0, ring of 1 mm: complex pressure at 3 m, relative"
    rows.append(at_most("width", "point source i omega rho Q/(4 pi r)", quantity, 1e-3, error))
    n = np.arange(5)
    over_endless = radiation_efficiency(n, 2.0, 2000.0) / radiation_efficiency(n, 2.0)
    for m, ratio in zip(n, over_endless):
        quantity = f"ka = 2, n = {m}: radiation efficiency of b = 2000 a over that of the endless cylinder"
        rows.append(within("width", "endless cylinder", quantity, 1.0, ratio, 1e-3))
    return tuple(rows)


def power() -> tuple[Row, ...]:
    """Sound power against the integral of the intensity far away."""
    rows, cylinder, wide, far = [], Cylinder(0.1, np.inf), Cylinder(0.1, 0.025), 5000.0
    nodes, weights = np.polynomial.legendre.leggauss(200)
    for n in range(4):
        order = np.array([108 - n])
        lines = SensorLines(order, np.array([1e-6 + 2e-6j]), np.array(60.0), 0.3, 108, "exact")
        angles = np.linspace(0.0, 2 * np.pi, 33)[:-1]
        pressures = [sound_pressure(lines, cylinder, Microphone(far - 0.1, angle))[0] for angle in angles]
        velocity = abs(order[0] * 60.0 * lines.displacement[0])
        ka, surface = lines.frequency[0] * 2 * np.pi * 0.1 / 343.0, 2 * np.pi * 0.1
        flow = np.mean(np.abs(pressures) ** 2) / (2 * 1.204 * 343.0) * 2 * np.pi * far
        over = flow / (1.204 * 343.0 * surface * velocity**2 / 2)
        quantity = f"1031 Hz, n = {n}: sigma_n against the intensity over a circle of 5 km"
        rows.append(within("power", "intensity p^2/(rho c)", quantity, over, float(radiation_efficiency(n, ka)), 1e-6))
        # far away the pressure at polar angle t is that of the axial wave number k cos t (Williams 1999)
        sine = np.sqrt(1 - nodes**2)
        slope = np.sqrt(2 / (np.pi * ka * sine * radiation_efficiency(n, ka * sine)))
        shape = np.sinc(ka / 0.1 * 0.025 * nodes / (2 * np.pi)) / (np.pi * sine * slope)
        intensity = 1.204 * 343.0 * (velocity * 0.025 * shape) ** 2 / 2
        flow = 2 * np.pi * (weights * intensity).sum()
        quantity = f"1031 Hz, n = {n}: sound power against the intensity over a sphere [W]"
        rows.append(within("power", "far field by stationary phase", quantity, flow, sound_power(lines, wide)[0], 1e-4))
        beside = abs(sound_pressure(lines, wide, Microphone(far - 0.1, 0.0))[0]) * far
        expected = 1.204 * 343.0 * velocity * 0.025 * np.sqrt(np.pi * ka * radiation_efficiency(n, ka) / 2) / np.pi
        quantity = f"1031 Hz, n = {n}: pressure times distance at 5 km [Pa m]"
        rows.append(within("power", "far field by stationary phase", quantity, expected, beside, 1e-3))
    return tuple(rows)


def equivalent() -> tuple[Row, ...]:
    """The estimate from above by sums over a surface: a sphere that pulsates, a piston in a baffle.

    Efficiencies ``(ka)^2/(1 + (ka)^2)`` and ``1 - J1(2 ka)/ka`` (Junger and Feit).
    """
    rho, c, a, rows = 1.204, 343.0, 0.1, list[Row]()
    area = np.diff(np.linspace(0, 4 * np.pi * a**2, 101) ** 1.5) / np.sqrt(4 * np.pi * a**2)
    velocity = np.full((1, len(area)), 1e-3 * np.exp(0.7j))
    for ka, gate in ((1.0, 1e-12), (5.0, 1e-12), (200.0, 1e-12)):
        pressure, power = (spectrum[0] for spectrum in equivalent_sound(velocity, area, rho, c, 1.0))
        exact = ka**2 / (1 + ka**2)
        # waves in all directions: pressure at 1 m, power through its sphere
        far = rho * c * 1e-3 * a * ka / np.sqrt(1 + ka**2)
        words = f"sphere that pulsates, ka = {ka:g}: "
        through = 4 * np.pi * far**2 / (2 * rho * c)
        over = within("estimate", JUNGER, words + "power over the exact one", 1 / exact, power / through, gate)
        rows += [
            over,
            within(
                "estimate", JUNGER, words + "pressure at 1 m, the same", 1 / np.sqrt(exact), abs(pressure) / far, gate
            ),
        ]
    piston = 1 - j1(2 * 300.0) / 300.0
    ours = equivalent_sound(velocity[:, :1], np.array([np.pi * a**2]), rho, c, 1.0)[1][0]
    exact = 0.5 * rho * c * np.pi * a**2 * 1e-6 * piston
    rows.append(
        within("estimate", JUNGER, "piston in a baffle, ka = 300: power over the exact one", 1.0, ours / exact, 5e-4)
    )
    return tuple(rows)


def weighting() -> tuple[Row, ...]:
    """A-weighting against the table of the standard."""
    return tuple(
        printed(
            "A",
            "IEC 61672-1:2013, table 3",
            f"A-weighting at {frequency:g} Hz [dB]",
            f"{level:.1f}",
            float(20 * np.log10(a_weighting(frequency))),
        )
        for frequency, level in WEIGHTS.items()
    )


def signals() -> tuple[Row, ...]:
    """Signals against their lines."""
    rng = np.random.default_rng(3)
    order = np.arange(0, 28_000, 3)
    values = (rng.normal(size=order.size) + 1j * rng.normal(size=order.size)) / (1 + order)
    values[0] = 0.4
    speed, samples = 2 * np.pi * 50 / 60, 8 * 57_600
    signal = sampled_signal(order, values, speed, samples=samples)
    audible = values[order * 50 / 60 < 24e3]
    power_of_lines = audible[0].real ** 2 + 0.5 * (np.abs(audible[1:]) ** 2).sum()
    ours, expected = np.sqrt(np.mean(signal**2)), np.sqrt(power_of_lines)
    chosen = rng.integers(0, samples, 40)
    turned = np.outer(chosen * (50 / 60 / 48e3), order[: len(audible)]) % 1.0
    direct = (np.exp(2j * np.pi * turned) @ audible).real
    error = np.abs(signal[chosen] - direct).max() / np.abs(audible).sum()
    name = "9 600 carrier orders at 50 rpm, 48 kHz, eight turns: "
    return (
        within("signal", "Parseval", name + "root mean square over that of the lines", expected, ours, 1e-12),
        at_most("signal", "sum of cosines", name + "samples, over the sum of amplitudes", 1e-11, error),
    )


def loudness() -> tuple[Row, ...]:
    """Loudness of tones by mosqito against the definition of the sone."""
    time = np.arange(96_000) / 48e3
    rows = []
    for level, sone, gate in ((40.0, 1.0, 0.01), (60.0, 4.0, 0.02)):
        tone = np.sqrt(2) * 20e-6 * 10 ** (level / 20) * np.sin(2 * np.pi * 1000 * time)
        quantity = f"loudness of 1 kHz at {level:g} dB by mosqito [sone]"
        ours = sound_quality(tone).loudness
        rows.append(within("loudness", "sone: 40 phon = 1, twice every 10 phon", quantity, sone, ours, gate))
    return tuple(rows)
