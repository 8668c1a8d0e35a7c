#!/usr/bin/env python3
"""Natural frequencies of a set with an elastic ring over the carrier speed, inertia of its frame included."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

FILES = ("gyroscopic.csv", "gyroscopic.png")
CLAIM = 0.01


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/gyroscopic"),
    highest: str = "120 rad/s",
    speeds: int = 13,
    below: str = "10 kHz",
) -> None:
    """Follow the modes over the carrier speed, with gyroscopic and convective terms: tables, a picture, CSV.

    Frequencies are those of the carrier frame, in which the model does not change with time. The ring stands
    still in the housing: a wave of n nodal diameters that the carrier frame has at f is heard on the ring at
    f - n Omega / 2 pi.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out.
    output
        Folder of the results.
    highest
        Largest carrier speed with its unit.
    speeds
        Number of speeds from zero, 3 or more.
    below
        Frequency with its unit; modes that are lower at rest are followed.
    """
    from femgear.case.gear_set import need_set, planetary_set
    from femgear.case.quantities import FREQUENCY, SPEED, to_si
    from femgear.report.style import save_figure
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.checks import check_rim_speed
    from femgear.trains.elastic.stages import solve_modes
    from femgear.trains.reading import read_case

    top, limit = to_si(highest, SPEED), to_si(below, FREQUENCY)
    if not top > 0.0 or speeds < 3 or not limit > 0.0:
        raise CaseError(
            f"{speeds} speeds up to {highest}, modes below {below}",
            code="E-RANGE",
            limit="3 speeds or more, above 0, modes above 0 Hz",
        )
    data = read_case(case)
    need_set(data)
    planetary_set(data)  # refuse before the folder is touched
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        progress("modes", 0, 1)
        static = solve_static(data, progress=progress)
        result, distance = solve_modes(data, static), static.planetary_set.centre_distance
        check_rim_speed(result.ring.modes, [top])
        branches = followed(result, distance, np.linspace(0.0, top, speeds), limit)
        progress("modes", 1, 1)
    ring = bare_ring(result.ring.modes, limit)
    _write(folder, branches)
    save_figure(_figure(branches, ring, top), folder / "gyroscopic.png")
    _print(branches, ring, top, highest)
    say_files(folder, FILES)


@dataclass(frozen=True)
class Branches:
    """Modes over the speed: frequencies (p, m) [Hz] in the carrier frame, names, and what the ring hears.

    At the largest speed: ``share`` (m,) of the ring in the kinetic energy, ``wave`` (m,) its strongest nodal
    diameter with the sense in which the wave travels, and ``part`` (m,) of that wave in the ring's energy.
    """

    speed: np.ndarray
    frequency: np.ndarray
    kind: tuple[str, ...]
    share: np.ndarray
    wave: np.ndarray
    part: np.ndarray

    @property
    def change(self) -> np.ndarray:
        """Relative to the frequency at rest, (p, m)."""
        return self.frequency / self.frequency[0] - 1.0

    @property
    def heard(self) -> np.ndarray:
        """Frequency of the strongest wave on the ring at the largest speed, (m,) [Hz]."""
        return self.frequency[-1] - self.wave * self.speed[-1] / (2.0 * np.pi)

    @property
    def standing(self) -> np.ndarray:
        """Whether the sense against that of the strongest wave holds a tenth of the two or more, (m,)."""
        return (self.wave != 0) & (self.part < 0.9)


def followed(result, centre_distance: float, speeds, below: float) -> Branches:
    """Branches of all elastic modes that are below a frequency [Hz] at rest."""
    from femgear.solvers.linear.tracking import campbell_data

    modes, model = result.modes, result.model
    elastic = np.flatnonzero(modes.frequency > 0.0)
    count = int(np.count_nonzero(modes.frequency[elastic] < below))
    if not count:
        raise CaseError(f"no modes below {below:g} Hz", code="E-RANGE", limit="a higher frequency")
    campbell = campbell_data(
        lambda speed: turning_system(model, centre_distance=centre_distance, carrier_speed=speed),
        speeds,
        modes.mesh_stiffness,
        count=count,
    )
    speeds_given = campbell.tracked.given
    shares = ring_wave_shares(model, campbell.tracked.shape[-1])
    largest = len(shares) // 2
    wave = np.argmax(shares, axis=0) - largest
    columns, whole = np.arange(count), shares.sum(axis=0)
    both = shares[largest + wave, columns] + (wave != 0) * shares[largest - wave, columns]
    return Branches(
        speed=campbell.speed[speeds_given],
        frequency=campbell.frequency[speeds_given],
        kind=tuple(modes.kind[i] for i in elastic[:count]),
        share=whole,
        wave=wave,
        part=shares[largest + wave, columns] / np.where(both > 0.0, both, 1.0),
    )


def turning_system(model, *, centre_distance: float, carrier_speed: float):
    """Add the inertia terms of the turning carrier frame to the matrices of the set.

    A body of mass m at rest in that frame has ``m (x'' - 2 Omega y' - Omega^2 x)`` and
    ``m (y'' + 2 Omega x' - Omega^2 y)`` (J. Lin and R. G. Parker, J. Vib. Acoust. 121, 1999, 316-321). The
    ring does not turn: its points run backwards through the frame, ``d/dt - Omega d/dphi`` (S. C. Huang and
    W. Soedel, J. Sound Vib. 115, 1987, 253-274). The pair ``q = c - i s`` of n nodal diameters, displacement
    ``Re(q U e^{i n phi})``, has the velocity ``q' - i n Omega q``: the terms of a body of mass 1 at the speed
    ``n Omega``. Alone it has ``f +- n Omega / 2 pi`` in the frame and f on the ring.

    The centrifugal force ``m Omega^2 a`` of a planet pulls its pin outwards; when the carrier turns by theta
    the pin comes inwards by ``a theta^2 / 2``, which stiffens that rotation by ``m (Omega a)^2`` a planet. It
    balances the centripetal term of the planets, so that the rotation of the mechanism stays free.

    Parameters
    ----------
    model : femgear.trains.elastic.model.ElasticSet
    centre_distance : float
        Of sun and planets, a [m].
    carrier_speed : float
        Mean speed Omega of the carrier [rad/s].

    Returns
    -------
    MechanicalSystem
        ``gyroscopic`` multiplies the carrier speed; K holds the centripetal terms, the load the centrifugal
        forces of the planets.
    """
    system = model.system
    place, mass = {name: i for i, name in enumerate(system.dofs)}, np.diag(system.M)
    x = np.array([i for name, i in place.items() if name.endswith(": x")])
    sine = model.ring_slice.start + np.flatnonzero(model.ring_phase == 1)
    diameter = model.ring_diameter[sine - model.ring_slice.start]
    first, second = np.concatenate([x, sine - 1]), np.concatenate([x + 1, sine])
    waves = np.concatenate([np.ones(len(x)), diameter])
    gyroscopic, centripetal, load = np.zeros_like(system.K), np.zeros(len(mass)), system.load.copy()
    gyroscopic[first, second] = -2.0 * waves * mass[first]
    gyroscopic[second, first] = 2.0 * waves * mass[first]
    centripetal[first] = centripetal[second] = waves**2 * mass[first]
    for number, psi in enumerate(model.planet_angles):
        i = place[f"planet {number + 1}: x"]
        centripetal[place["carrier: rotation"]] -= mass[i] * centre_distance**2
        outwards = carrier_speed**2 * mass[i] * centre_distance
        load[i : i + 2] += outwards * np.array([np.cos(psi), np.sin(psi)])
    K = system.K - carrier_speed**2 * np.diag(centripetal)
    return replace(system, K=K, load=load, gyroscopic=gyroscopic)


def ring_wave_shares(model, shape) -> np.ndarray:
    """Share the kinetic energy of complex modes out among the travelling waves of the ring.

    Parameters
    ----------
    model : femgear.trains.elastic.model.ElasticSet
    shape : (n, m) complex array
        Mode shapes, motion ``Re(shape e^{i omega t})``.

    Returns
    -------
    (2 n_max + 1, m) array
        Row ``n_max + n``: the part of the whole that the waves ``e^{i n phi} e^{i omega t}`` hold, phi in the
        carrier frame; a point of the ring hears them at ``omega - n Omega``. Standing waves have equal parts
        of n and -n; the other bodies hold what the sum over n misses.
    """
    shape = np.asarray(shape, complex)
    total = np.einsum("im,ij,jm->m", shape.conj(), model.system.M, shape).real
    ring, n = shape[model.ring_slice], model.ring_diameter
    largest = int(n.max(initial=0))
    shares = np.zeros((2 * largest + 1, shape.shape[1]))
    single = np.ones(len(n), bool)
    sine = np.flatnonzero(model.ring_phase == 1)
    single[sine] = single[sine - 1] = False
    for sign in (1, -1):
        wave = np.abs(ring[sine - 1] - sign * 1j * ring[sine]) ** 2 / 2.0
        np.add.at(shares, largest + sign * n[sine], wave)
    alone = np.flatnonzero(single)
    for row in (largest + n[alone], largest - n[alone]):
        np.add.at(shares, row, 0.5 * np.abs(ring[alone]) ** 2)
    return shares / total


def bare_ring(modes, below: float) -> list[tuple[int, float]]:
    """Nodal diameters, from 1, and lowest frequencies [Hz] of the ring alone on its foundation."""
    diameters = []
    for n in range(1, int(modes.nodal_diameter.max()) + 1):
        frequency = float(modes.frequency[modes.nodal_diameter == n].min())
        if frequency < below:
            diameters.append((n, frequency))
    return diameters


def _wave(branches: Branches, i: int) -> str:
    n = int(branches.wave[i])
    return f"±{abs(n)}" if branches.standing[i] else f"{n:+d}" if n else "0"


def _print(branches: Branches, ring, top: float, highest: str) -> None:
    change, fixed_ear = branches.change[-1], branches.heard
    rows = []
    for i, kind in enumerate(branches.kind):
        still = branches.frequency[0, i]
        on_ring = (f"{fixed_ear[i]:.2f}", f"{100.0 * (fixed_ear[i] / still - 1.0):+.3f}")
        if branches.standing[i]:
            apart = abs(branches.wave[i]) * top / (2.0 * np.pi)
            on_ring = (f"{branches.frequency[-1, i]:.2f} ± {apart:.2f}", f"± {100.0 * apart / still:.3f}")
        rows.append(
            (
                f"{still:.2f}",
                kind,
                f"{branches.frequency[-1, i]:.2f}",
                f"{100.0 * change[i]:+.3f}",
                f"{branches.share[i]:.2f}",
                _wave(branches, i),
                *on_ring,
            )
        )
    header = (
        "at rest [Hz]",
        "kind",
        "carrier frame [Hz]",
        "change [%]",
        "ring's share",
        "wave",
        "on the ring [Hz]",
        "change [%]",
    )
    print_table(f"Natural frequencies at {highest} of the carrier", header, rows)
    inside = int(np.sum(np.abs(change) < CLAIM))
    print(f"{inside} of {len(change)} modes change by less than 1 % in the carrier frame")
    lines = [
        (
            str(n),
            f"{f:.2f}",
            f"{f - n * top / (2 * np.pi):.2f}",
            f"{f + n * top / (2 * np.pi):.2f}",
            f"± {100.0 * n * top / (2 * np.pi * f):.3f}",
        )
        for n, f in ring
    ]
    title = "Ring alone on its foundation: f on the ring, f -+ n Omega / 2 pi in the carrier frame"
    print_table(title, ("nodal diameters", "on the ring [Hz]", "backward [Hz]", "forward [Hz]", "change [%]"), lines)


def _write(folder: Path, branches: Branches) -> None:
    header = ("carrier speed [rad/s]", "mode", "kind", "frequency [Hz]", "change [1]")
    records = (
        (float(speed), i + 1, branches.kind[i], float(branches.frequency[p, i]), float(branches.change[p, i]))
        for p, speed in enumerate(branches.speed)
        for i in range(len(branches.kind))
    )
    write_csv(folder / "gyroscopic.csv", header, records)


def _figure(branches: Branches, ring, top: float):
    from femgear.report.style import BLACK, BLUE, GREY, VERMILION, label, legend_below, line_style, new_figure

    figure, (left, right) = new_figure(columns=2, width=11.0, height=5.2)
    still = branches.frequency[0]
    # pairs of equal frequency share a line style; those that hardly move are grey
    group = np.concatenate([[0], np.cumsum(np.diff(still) > 1e-6 * still[1:])])
    moving = [g for g in np.unique(group) if np.abs(branches.change[:, group == g]).max() > 0.5 * CLAIM]
    for g in np.unique(group):
        members = np.flatnonzero(group == g)
        if g in moving:
            n = abs(int(branches.wave[members[0]]))
            style = line_style(moving.index(g)) | {"label": f"{still[members[0]]:.0f} Hz, waves of n = {n}"}
        else:
            style = {"color": GREY, "linewidth": 0.8, "label": "all other modes"}
        left.plot(branches.speed, 100.0 * branches.change[:, members], **style)
    left.set_xlim(0.0, top)
    label(left, "carrier speed [rad/s]", "change of frequency [%]", "in the carrier frame")
    for ax in (left, right):
        for level in (-1.0, 1.0):
            ax.axhline(level, color=BLACK, linewidth=0.8, linestyle=(0, (6, 3)))
    split = np.array([(f, 100.0 * n * top / (2.0 * np.pi * f)) for n, f in ring])
    for sign in (1, -1):
        right.plot(split[:, 0], sign * split[:, 1], "x", color=BLACK, label="ring alone, carrier frame")
    right.plot(
        still,
        100.0 * branches.change[-1],
        "o",
        color=BLUE,
        markerfacecolor="none",
        label="set, carrier frame",
    )
    # standing waves are heard as two lines, one a sense
    much, apart = branches.share > 0.25, branches.wave * top / (2.0 * np.pi)
    lines = [(branches.heard, much), (branches.frequency[-1] + apart, much & branches.standing)]
    for line, shown in lines:
        right.plot(
            still[shown],
            100.0 * (line / still - 1.0)[shown],
            "s",
            color=VERMILION,
            markersize=4,
            label="set, as heard on the ring (ring holds over a quarter of the energy)",
        )
    label(right, "frequency at rest [Hz]", "change of frequency [%]", f"at {top:g} rad/s")
    legend_below(figure, columns=3)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
