"""What a fixed sensor hears of the reference set, beside what the modulation paper reports."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.housing.orders import BandAnalysis, OrderSpectrum, analyse_band, count_lobes
from femgear.housing.sensor import (
    SensorLines,
    component_lines,
    fixed_sensor_lines,
    hanning_model,
    heaviside_linear_lines,
    lines_in_form,
)
from validation.cases import PAPER, reference_case, reference_dynamics, reference_housing, reference_modes
from validation.reference.sensor_in_time import heaviside_linear, passages, point_signals, symmetry_leakage
from validation.rows import Row, at_most, counted, information, within

SLOW, FAST = 0, 1
SPEEDS = ("250 rpm", "3100 rpm")


def _spectrum(lines, speed: int) -> OrderSpectrum:
    return OrderSpectrum(lines.order, lines.acceleration[speed])


def _band(lines, speed: int, harmonic: int) -> BandAnalysis:
    return analyse_band(_spectrum(lines, speed), lines.z_ring, harmonic)


def _strongest(band: BandAnalysis) -> tuple[float, float]:
    """The two strongest orders, ascending."""
    low, high = sorted(line.order for line in band.lines[:2])
    return low, high


def _every_line() -> dict[str, SensorLines]:
    """Lines at all orders, of a field with all nodal diameters: housing.nc keeps those of the symmetry."""
    from femgear.trains.elastic.outputs import mesh_and_ring_outputs

    dynamics, housing = reference_dynamics(), reference_housing()
    modes = replace(reference_modes(), symmetry=1)
    field = mesh_and_ring_outputs(modes, dynamics.response)[1]
    place = dynamics.ring_teeth, np.array([state.carrier for state in dynamics.speeds]), 0.0
    exact = fixed_sensor_lines(field, *place)
    linear = lines_in_form(component_lines(field, *place), "linear", housing.points, housing.harmonics)
    return {"exact lines": exact, "linear interpolation": linear}


def symmetry() -> tuple[Row, ...]:
    """Identical planets leave multiples of N alone."""
    rows = []
    for speed, label in enumerate(SPEEDS):
        for name, lines in _every_line().items():
            leak = float(symmetry_leakage(_spectrum(lines, speed), 3))
            quantity = f"{label}, {name}: largest line off the multiples of 3 over the largest line"
            rows.append(at_most("symmetry", "McFadden and Smith 1985", quantity, 1e-8, leak))
    return tuple(rows)


def first_harmonic() -> tuple[Row, ...]:
    """250 rpm around the mesh frequency: dominating lines, lobes, Hanning model."""
    housing, dynamics = reference_housing(), reference_dynamics()
    rows = []
    for name, lines in (("exact lines", housing.exact), ("linear interpolation", housing.lines)):
        band = _band(lines, SLOW, 1)
        low, high = _strongest(band)
        label = f"250 rpm, 1st mesh harmonic, {name}: "
        rows += [
            counted("paper", PAPER, label + "lower dominating order", 105, low),
            counted("paper", PAPER, label + "upper dominating order", 111, high),
            counted("paper", PAPER, label + "lobes a carrier revolution", 6, len(band.lobes.position)),
            information("paper", "definition", label + "level of the third line [dB]", None, band.lines[2].level),
        ]
    force = dynamics.response.force[SLOW, 3:, :2]
    field = hanning_model(force, reference_modes().model.planet_angles)
    carrier = dynamics.speeds[SLOW].carrier
    sensor_lines = fixed_sensor_lines(field, dynamics.ring_teeth, carrier, 0.0)
    band = analyse_band(OrderSpectrum(sensor_lines.order, sensor_lines.displacement), dynamics.ring_teeth, 1)
    label = "250 rpm, 1st mesh harmonic, Hanning window on the planet-ring forces: "
    rows.append(counted("paper", PAPER, label + "lobes", 3, len(band.lobes.position)))
    return tuple(rows)


def unit_forces() -> tuple[Row, ...]:
    """The ring under constant mesh forces: extremes of its radial deflection around the circumference."""
    static = reference_dynamics().ring_radial[SLOW, 0]
    n = np.arange(len(static)) - len(static) // 2
    deflection = np.real(np.exp(1j * np.outer(2 * np.pi * np.arange(720) / 720, n)) @ static)
    lobes = count_lobes(np.abs(deflection - deflection.mean()))
    quantity = "deflection of the ring under equal forces of its meshes: lobes, outwards and inwards"
    return (counted("paper", PAPER, quantity, 6, len(lobes.position)),)


def interpolation() -> tuple[Row, ...]:
    """sinc^2 of the linear interpolation, and Eqs. 13-16 in time, on the field of the ring."""
    case, dynamics, housing = reference_case(), reference_dynamics(), reference_housing()
    z_ring, points = dynamics.ring_teeth, case.housing.points
    n_max = dynamics.ring_radial.shape[-1] // 2
    n = np.arange(-n_max, n_max + 1)
    rows = []
    source = "sinc^2(n/P), the transform of the hat function"
    for harmonic, diameter in ((1, -3), (1, 3), (1, 6), (4, -12)):
        alone = np.where(n == diameter, dynamics.ring_radial[FAST], 0.0)
        alone[np.arange(len(alone)) != harmonic] = 0.0
        carrier = dynamics.speeds[FAST].carrier
        order = z_ring * harmonic - diameter
        lines = [
            np.abs(hear(alone, z_ring, carrier, 0.0, **options).displacement[order])
            for hear, options in ((heaviside_linear_lines, {"points": points}), (fixed_sensor_lines, {}))
        ]
        quantity = f"3100 rpm, h {harmonic}, n {diameter}: linear over exact line at order {order}"
        ratio = lines[0] / lines[1]
        rows.append(within("sinc", source, quantity, np.sinc(diameter / points) ** 2, ratio, 1e-12))
    field = dynamics.ring_radial[FAST].copy()
    field[0] = 0.0
    samples = 20 * z_ring * points
    literal = heaviside_linear(point_signals(field, z_ring, points=points, samples=samples), passages(points, 0.0))
    amplitudes = np.fft.rfft(literal)[1 : z_ring * len(field)] * 2 / samples
    ours = heaviside_linear_lines(field, z_ring, dynamics.speeds[FAST].carrier, 0.0, points=points)
    closed = ours.displacement[1 : z_ring * len(field)]
    quantity = "3100 rpm: lines of Eqs. 13-16 written out in time against the closed form, over the largest"
    error = np.abs(amplitudes - closed).max() / np.abs(closed).max()
    rows.append(at_most("sinc", "Eqs. 13-16 as meant", quantity, 1e-5, error, note=_sampled(samples)))
    rows.append(_static_images(housing, dynamics, points))
    return tuple(rows)


def _sampled(samples: int) -> str:
    return f"{samples} samples: what is left is the aliasing of the kinks between points"


def _static_images(housing, dynamics, points: int) -> Row:
    """Images of the static deflection under linear interpolation, which fall on the mesh orders."""
    carrier, z_ring = dynamics.speeds[SLOW].carrier, dynamics.ring_teeth
    static = np.zeros_like(dynamics.ring_radial[SLOW])
    static[0] = dynamics.ring_radial[SLOW, 0]
    images = heaviside_linear_lines(static, z_ring, carrier, 0.0, points=points)
    orders = slice(z_ring - 20, z_ring + 21)
    return information(
        "sinc",
        "largest line there of the vibration [m/s^2]",
        "250 rpm, orders 88 to 128: largest line that the static deflection would make [m/s^2]",
        float(np.abs(housing.lines.acceleration[SLOW, orders]).max()),
        float(np.abs(images.acceleration[orders]).max()),
        note="108 teeth are twice 54 points, so its images fall on the mesh orders; femgear carries the "
        "static deflection exactly in both forms",
    )


def higher_harmonics() -> tuple[Row, ...]:
    """3100 rpm around the 5th and 6th mesh harmonics."""
    exact = _every_line()["exact lines"]
    fifth, sixth = _band(exact, FAST, 5), _band(exact, FAST, 6)
    low, high = _strongest(fifth)
    label = "3100 rpm, 5th mesh harmonic: "
    rows = [
        counted("paper", PAPER, label + "lower dominating order", 537, low),
        counted("paper", PAPER, label + "upper dominating order", 543, high),
        counted("paper", PAPER, label + "lobes a carrier revolution", 6, len(fifth.lobes.position)),
        information("paper", "definition", label + "level of the third line [dB]", None, fifth.lines[2].level),
    ]
    low, high = _strongest(sixth)
    note = (
        "649 is no multiple of 3: identical planets on a symmetric ring cannot make it, and the paper's own "
        "645 would pair with 651"
    )
    label = "3100 rpm, 6th mesh harmonic: "
    rows += [
        information("paper", PAPER, label + "lower dominating order", 645.0, low),
        information("paper", PAPER, label + "upper dominating order", 649.0, high, note=note),
        information("paper", "definition", label + "line at order 649 over the strongest", None, _level(exact, 649)),
        information("paper", "definition", label + "lobes", None, len(sixth.lobes.position)),
    ]
    return tuple(rows)


def _level(lines, order: int) -> float:
    amplitude = np.abs(lines.acceleration[FAST])
    return float(amplitude[order] / amplitude[order - 54 : order + 55].max())


def resonances() -> tuple[Row, ...]:
    """Modes that mesh phasing lets harmonics excite, and the one of them that lies on 3100 rpm."""
    from femgear.solvers.linear.resonances import modal_forces

    modes = reference_modes()
    forces = modal_forces(modes.modes, modes.excitation, 12)
    kinds = np.array([modes.modes.kind[i].removeprefix("ring, ") for i in forces.mode])
    other = float(forces.share[kinds == "translational"].max())
    place = int(np.abs(forces.frequency - 4 * 1116.0).argmin())
    rule = "Parker 2000; Ambarisha and Parker 2006"
    where = "3100 rpm, 4th mesh harmonic: "
    return (
        at_most("symmetry", rule, "modal force on translational modes over the largest", 1e-9, other),
        counted("symmetry", rule, where + "excited mode nearest to it", 15, int(forces.mode[place]) + 1),
    )
