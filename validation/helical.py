"""Helical planetary set: published frequencies, kinds of modes, rigid motions, limits, phased response."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from published.planetary_sets import TABLE_2, cases, kahraman_set

from femgear.findings import percent
from femgear.gears.phasing import phase_factors
from femgear.solvers.linear.receptance import modal_error_response
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system, mesh_directions
from femgear.system.mode_kinds import gear_set_motions, phasing
from femgear.trains.helical.model import HelicalSet
from validation import independent
from validation.reference.frequency_response import mesh_error_response
from validation.rows import Row, at_most, counted, information, within

PAPER = "Kahraman, J. Mech. Des. 116, 1994"
KAHRAMAN = f"{PAPER}, Table 4, axial and tilt stiffnesses ten times those printed"
INDEPENDENT = independent.SOURCE
PHASINGS = {"SP": "sequentially phased 1", "IP": "in phase", "CP": "counter-phased"}
# printed frequencies [Hz] and those of an independent implementation, by phasing
TABLE_4 = {
    "SP": ((643, 1832, 3902, 7895, 10228, 14712), (644.35, 1836.20, 3903.13, 7899.17, 10233.59, 14731.78)),
    "IP": ((3116, 3704, 7900, 8407, 12032), (3116.55, 3704.31, 7900.52, 8407.24, 12032.88)),
    "CP": ((3627, 7625, 9840), (3627.12, 7624.95, 9840.18)),
}
# one unit of the last printed digit [Hz], and never more than this share
UNIT, SHARE = 1.0, 3e-4


def by_phasing(data: HelicalSet, *, below: float = 15e3) -> dict[str, np.ndarray]:
    """Frequencies [Hz] of the elastic modes of every phasing below a frequency [Hz]."""
    modes = gear_set_modes(data)
    names = np.array(phasing(gear_set_motions(data, modes.shape)))
    inside = (modes.frequency > 0.0) & (modes.frequency < below)
    return {key: modes.frequency[inside & (names == name)] for key, name in PHASINGS.items()}


def table_4() -> tuple[Row, ...]:
    """All modes below 15 kHz, with their phasing from the shapes."""
    rows, data = [], kahraman_set()
    modes, frequencies = gear_set_modes(data), by_phasing(data)
    moved, others = _entries_of_pairs(data), independent.kahraman().frequencies()
    for key, (printed, precise) in TABLE_4.items():
        twins = 2 if key == "SP" else 1
        rows.append(counted("K", KAHRAMAN, f"{key} modes below 15 kHz", twins * len(printed), len(frequencies[key])))
        for k, (text, value) in enumerate(zip(printed, precise, strict=True)):
            ours = frequencies[key][::twins][k]
            rows.append(_printed_mode(key, text, value, ours, moved[k]))
            reference = others[np.argmin(np.abs(others - ours))]
            rows.append(within("K", INDEPENDENT, f"{key} mode [Hz]", reference, ours, 1e-9))
    rigid = int(np.sum(modes.frequency == 0.0))
    rows.append(counted("K", "one rotation of sun, planets and carrier", "modes at 0 Hz", 1, rigid))
    below = int(np.sum(modes.frequency < 15e3))
    rows.append(counted("K", KAHRAMAN, "modes below 15 kHz, with that at 0 Hz", 21, below))
    pitch = by_phasing(replace(data, contact_points="pitch_point"))
    for key, (printed, _) in TABLE_4.items():
        twins = 2 if key == "SP" else 1
        away = np.abs(pitch[key][::twins] / np.array(printed) - 1.0).max()
        name = f"{key} modes with forces at the pitch points: largest distance from the print"
        rows.append(information("K", KAHRAMAN, name, None, away, note="another model than the paper's"))
    return tuple(rows)


def _printed_mode(key: str, text: int, value: float, ours: float, moved: float) -> Row:
    """A frequency beside the print of Table 4, gated by its digits where these decide.

    Frequencies of modes in phase and counter-phased are printed cut off (7900.52 as 7900) or rounded (7624.95
    as 7625). Sequentially phased modes miss the print by more than its digits and those of the entries that
    they alone feel (`_entries_of_pairs`), so that no gate follows from the print.
    """
    name, note = f"{key} mode [Hz]", f"independent computation: {value} Hz"
    if key != "SP":
        gate = min(UNIT / text, SHARE)
        return within("K", KAHRAMAN, name, text, ours, gate, note=note + "; gate: one unit of the print")
    note += f"; half a unit of the printed entries that only these modes feel moves it by {moved:.2f} Hz"
    return information("K", KAHRAMAN, name, float(text), ours, note=note)


def _entries_of_pairs(data: HelicalSet) -> np.ndarray:
    """Shift [Hz] of each pair of modes by half units of the entries that translations and tilts alone feel.

    Modes in phase and counter-phased agree with the print, so that the other entries are as printed: masses
    of sun and ring in the plane, diametral inertias.
    """
    base = by_phasing(data, below=15.1e3)["SP"][::2][:6]
    total = np.zeros(len(base))
    for name, entries in (("sun", "mi"), ("ring", "mi"), ("carrier", "i"), ("planet", "i")):
        body = getattr(data, name)
        radius = data.centre_distance if name == "carrier" else getattr(data, f"{name}_radius")
        half = 5e-3 if name == "carrier" else 5e-4
        for entry in entries:
            change = (
                {"mass": body.mass + half}
                if entry == "m"
                else {"diametral_inertia": body.diametral_inertia + half * radius**2}
            )
            moved = by_phasing(replace(data, **{name: replace(body, **change)}), below=15.1e3)["SP"]
            total += np.abs(moved[::2][:6] - base)
    return total


def rigid_motions(data: HelicalSet) -> np.ndarray:
    """Coordinates (6 (N + 3), 6) of the whole set moved along and turned about x, y and z as one body."""
    radii = (data.centre_distance, data.ring_radius, data.sun_radius)
    motions = np.zeros((data.n_planets + 3, 6, 6))
    for row, radius in enumerate(radii):
        motions[row] = np.diag([1.0] * 3 + [radius] * 3)
    for n, psi in enumerate(data.planet_angles):
        out = np.array([math.cos(psi), math.sin(psi), 0.0])
        frame = np.array([out, [-out[1], out[0], 0.0], [0.0, 0.0, 1.0]])
        arm = data.centre_distance * out
        carried = np.hstack([np.eye(3), np.cross(np.eye(3), arm).T])
        motions[3 + n, :3] = frame @ carried
        motions[3 + n, 3:, 3:] = data.planet_radius * frame
    return motions.reshape(-1, 6)


def rigid() -> tuple[Row, ...]:
    """What the meshes feel when the whole set moves as one body."""
    rows = []
    for planets in (3, 4, 5):
        angles = 2.0 * np.pi * np.arange(planets) / planets + 0.1 * np.arange(planets) * (planets == 5)
        data = kahraman_set(planet_angles=angles, contact_points="pitch_point", slices=3, face_width=0.03)
        strain = np.abs(mesh_directions(data).T @ rigid_motions(data)).max(axis=0)
        name = f"{planets} planets, 3 slices: largest strain of a mesh by a unit motion [m, m/rad]"
        rows.append(at_most("K", "rigid-body motion", name, 1e-12, strain.max()))
    data = kahraman_set()
    strain = np.abs(mesh_directions(data).T @ rigid_motions(data)).max(axis=0)
    name = "forces at the base circles: largest strain by a unit displacement or turn about z"
    rows.append(at_most("K", "rigid-body motion", name, 1e-12, strain[[0, 1, 2, 5]].max()))
    # the two points of a mesh are L = a sin(alpha) apart along the line of action
    alpha = data.pressure_angle_sun_planet
    largest = math.sin(data.base_helix_angle) * data.centre_distance * math.sin(alpha) * math.cos(alpha)
    name = "forces at the base circles: strain of the first mesh by a common tilt [m/rad]"
    rows.append(within("K", "a sin(alpha) cos(alpha) sin(beta)", name, largest, strain[3], 1e-12))
    return tuple(rows)


def table_2() -> tuple[Row, ...]:
    """Classes of the tooth numbers, and what each harmonic is by the phases."""
    rows = []
    for letter, (sun, ring, planet, printed_class) in TABLE_2.items():
        # I: Z / 4 whole, II: (Z + 3) / 4, III: (Z + 2) / 4, IV: (Z + 1) / 4
        numerals = [("I", "IV", "III", "II")[-z % 4] for z in (sun, ring)]
        ours = "-".join([*numerals, "odd" if planet % 2 else "even"])
        name = f"case {letter}, {sun}-{ring}-{planet}: class {printed_class}"
        rows.append(counted("K", f"{PAPER}, Table 2", name, 1, int(ours == printed_class), note=ours))
    return tuple(rows)


def table_1() -> tuple[Row, ...]:
    """Table 1(c): resultants of the two meshes of a planet, by the phases as printed in Eq. (6)."""
    data, rows = kahraman_set(contact_points="pitch_point"), []
    directions = mesh_directions(data)
    # tangential and tilt about the tangent against torque, radial force and thrust
    together, apart = [1, 4], [5, 0, 2]
    alone = np.abs(directions[18:24, 0])
    for letter, case in cases(convention="printed").items():
        sun, _, planet, _ = TABLE_2[letter]
        worst = 0.0
        for h in (1, 2):
            factors = phase_factors(case, [h])[0]
            for n in range(4):
                load = directions[18 + 6 * n : 24 + 6 * n] * factors
                size = np.abs(load[:, n] + load[:, 4 + n])[together + apart] / (2 * alone[together + apart])
                # l (Z_r - Z_s) psi_n = -2 l Z_s psi_n turns every other planet where l and Z_s are odd
                against = (h * (planet + 1) + h * sun * n) % 2
                expected = [1.0 - against] * 2 + [float(against)] * 3
                worst = max(worst, np.abs(size - expected).max())
        pattern = f"Z_s {'odd' if sun % 2 else 'even'}, Z_p {'odd' if planet % 2 else 'even'}, l = 1 and 2"
        name = f"case {letter}, {pattern}: what adds up and what cancels on the planets, difference"
        rows.append(at_most("K", f"{PAPER}, Table 1(c)", name, 1e-12, worst))
    return tuple(rows)


def leakage() -> tuple[Row, ...]:
    """Forces that phased transmission errors exert on modes of another phasing, over those on their own."""
    data, rows = kahraman_set(), []
    modes = gear_set_modes(data, max_frequency=20e3)
    names = np.array(phasing(gear_set_motions(data, modes.shape)))
    for letter, case in cases().items():
        push = data.mesh_stiffness[:, None] * 1e-6 * phase_factors(case, range(1, 5)).T
        work = np.abs(modes.mesh_deflection.T @ push)
        worst, kinds = 0.0, []
        for h in range(1, 5):
            kinds.append(("IP", "SP", "CP", "SP")[h * case.sun_teeth % 4])
            matching = names == PHASINGS[kinds[-1]]
            worst = max(worst, work[~matching, h - 1].max() / work[matching, h - 1].max())
        teeth = "-".join(map(str, TABLE_2[letter][:3]))
        name = f"case {letter}, {teeth}: harmonics 1 to 4 excite {', '.join(kinds)} modes; others"
        rows.append(at_most("K", f"{PAPER}, Table 2", name, 1e-9, worst))
    return tuple(rows)


def response() -> tuple[Row, ...]:
    """Forced response to 1 um in four harmonics, 5 % damping: modes against direct solution, and the peak."""
    data, rows = kahraman_set(), []
    system, modes = gear_set_system(data), gear_set_modes(data, damping_ratio=0.05)
    hertz = np.linspace(50.0, 15e3, 300)
    for letter, convention in product("EF", ("rotation", "printed")):
        error = 1e-6 * phase_factors(cases(convention=convention)[letter], range(1, 5)).T
        response = modal_error_response(modes, hertz, error)
        k = data.column_stiffness
        direct = mesh_error_response(system, hertz, error, mesh_stiffness=k, damping_ratio=0.05)
        away = np.abs(response.force[0] - direct.force).max() / np.abs(direct.force).max()
        name = f"case {letter}, {convention} phases: "
        rows.append(at_most("K", "direct solution", name + "mesh forces, difference", 1e-10, away))
        rows += _symmetry(name, convention, np.abs(response.force[0, :, 0, :4]))
    fine = np.arange(5000.0, 15000.0, 5.0)
    # a mode and any constant beside it peak within the damping ratio of the mode: it is the gate
    light = 0.005
    sharp = gear_set_modes(data, damping_ratio=light)
    for letter, h, kind, mode in (
        ("C", 1, "CP", 9840.0),
        ("C", 3, "CP", 9840.0),
        ("C", 2, "IP", None),
        ("C", 4, "IP", None),
        ("D", 1, "CP", 7625.0),
        ("D", 3, "CP", 7625.0),
        ("F", 1, "SP", None),
        ("F", 3, "SP", None),
    ):
        peak, wide = (_peak(peaks_of, letter, h, fine) for peaks_of in (sharp, modes))
        choices = np.array(TABLE_4[kind][0])
        mode = mode or choices[np.abs(choices - peak).argmin()]
        name = f"case {letter}, harmonic {h}: highest peak from 5 to 15 kHz, {kind} mode [Hz]"
        note = f"{percent(light, 1)} damping; {wide:.0f} Hz with 5 %"
        rows.append(within("K", PAPER, name, mode, peak, light, note=note))
    return tuple(rows)


def _peak(modes, letter: str, harmonic: int, hertz) -> float:
    """Frequency [Hz] of the harmonic at which the force of the first sun mesh is largest."""
    error = 1e-6 * phase_factors(cases()[letter], [harmonic]).T
    response = modal_error_response(modes, hertz / harmonic, error, harmonics=[harmonic])
    return float(hertz[np.abs(response.force[0, :, 0, 0]).argmax()])


def _symmetry(name: str, convention: str, size: np.ndarray) -> tuple[Row, ...]:
    """Which of the sun mesh forces (F, 4) of a sequentially phased set are equal."""
    pairs = np.abs(size[:, [0, 1]] - size[:, [2, 3]]).max() / size.max()
    alike = np.ptp(size, axis=1).max() / size.max()
    rows = [at_most("K", PAPER, name + "difference of sun mesh forces of opposite planets", 1e-10, pairs)]
    if convention == "rotation":
        rows.append(at_most("K", "symmetry", name + "difference of all sun mesh forces", 1e-10, alike))
    else:
        differ, text = int(alike > 0.1), name + "forces of neighbours differ by more than a tenth"
        rows.append(counted("K", PAPER, text, 1, differ, note=f"{alike:.3f} of the largest"))
    return tuple(rows)
