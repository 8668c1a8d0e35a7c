"""The ring alone: cyclic modes of one sector against annulus and whole toothed ring, waves from the carrier.

The annulus cannot have the frequencies of a ring with teeth; what the teeth do to them is information.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.contact.bodies import RING_STATE, active_flank_load
from femgear.fe.elasticity import mass, stiffness
from femgear.fe.reduction import cyclic_modes, sector_basis
from validation.cases import PAPER, reference_material, reference_modes, reference_static
from validation.reference.annulus import annulus_frequencies
from validation.rows import Row, at_most, information, within
from validation.whole_ring import free_modes, whole_grid

DIAMETERS = np.arange(2, 7)
# nodal diameters of the free ring in plane stress, and an independent computation of its own outline [Hz]
ELSEWHERE = {2: 1240.5, 3: 3407.9, 4: 6297.9, 0: 8601.2, 5: 9760.2}
# root fillet of the second outline that is compared with it, in modules
SHARP = 0.05
EXACT = "exact annulus in plane stress (degree-converged Ritz, agrees with the Bessel determinant)"
# a part that shall not count keeps this share of its thickness
NOTHING = 1e-9
# largest carrier speed [rad/s] and change of the natural frequencies up to there, as the paper claims
FASTEST, CLAIM = 120.0, 0.01
SLIGHT = f"{PAPER}: less than 1 % between 0 and 120 rad/s"


def _lowest(grid, stiffness_matrix, mass_matrix, count, load) -> np.ndarray:
    """Lowest free natural frequency of every nodal diameter [Hz]."""
    basis = sector_basis(grid, stiffness_matrix, mass_matrix, count=count, loads=load)
    modes = cyclic_modes(
        basis,
        nodal_diameters=DIAMETERS,
        loads=load,
        outputs=load,
        max_frequency=1.0,
        static_correction=False,
    )
    return modes.frequency


def _annulus_sector(inner: float, outer: float, count: int):
    """Grid of one of `count` equal sectors of an annulus, meshed from half of it."""
    from femgear.fe.grid import mirror
    from femgear.fe.meshing import Outline, mesh_outline

    half = math.pi / count

    def arc(radius, start, end, edges):
        angle = np.linspace(start, end, 2 * edges + 1)
        points = radius * np.column_stack([np.cos(angle), np.sin(angle)])
        points[angle == 0.0, 1] = 0.0
        return points

    radius = np.linspace(inner, outer, 2 * 8 + 1)
    along = np.column_stack([radius, np.zeros_like(radius)])
    turned = radius[:, None] * [math.cos(half), math.sin(half)]
    rim, bore = arc(outer, 0.0, half, 3), arc(inner, half, 0.0, 3)
    curves = (("symmetry", along), ("rim", rim), ("cut", turned[::-1]), ("root", bore))
    return mirror(mesh_outline(Outline(curves), cache=None))


def plain_annulus() -> tuple[Row, ...]:
    """An annulus without teeth through the cyclic reduction that the ring takes."""
    static = reference_static()
    ring, material = static.planetary_set.ring, reference_material()
    grid = _annulus_sector(ring.root_radius, ring.rim_radius, ring.teeth)
    node = np.argmin(np.hypot(*(grid.points - [ring.root_radius, 0.0]).T))
    load = np.zeros((2 * grid.n_nodes, 1))
    load[2 * node] = 1.0
    K = stiffness(grid, material, state="plane stress", thickness=ring.face_width)
    ours = _lowest(grid, K, mass(grid, material, ring.face_width), ring.teeth, load)
    exact = _exact(ring.root_radius)
    name = "annulus 82.875/100 mm from one sector of 108, n = "
    return tuple(
        within("ring", EXACT, f"{name}{n} [Hz]", reference, value, 1e-4)
        for n, reference, value in zip(DIAMETERS, exact, ours, strict=True)
    )


def _exact(inner: float) -> np.ndarray:
    static = reference_static()
    ring, material = static.planetary_set.ring, reference_material()
    return annulus_frequencies(inner, ring.rim_radius, material, nodal_diameters=DIAMETERS)[:, 0]


def _toothed(tooth_stiffness: float, tooth_mass: float) -> np.ndarray:
    """Natural frequencies of the free ring with shares of the thickness of its teeth."""
    static = reference_static()
    sector, width = static.sectors.ring, static.planetary_set.ring.face_width
    material = reference_material()
    K = stiffness(
        sector.grid,
        material,
        state=RING_STATE,
        thickness={"tooth": tooth_stiffness * width, "body": width},
    )
    M = mass(sector.grid, material, {"tooth": tooth_mass * width, "body": width})
    load = active_flank_load(sector.grid, static.planetary_set, 1.0)
    return _lowest(sector.grid, K, M, sector.gear.teeth, load)


def _tooth_data() -> tuple[float, float, float]:
    """Mass of a tooth over that of the annulus sector, radius of its centre [m], radius of an annulus
    with the area of the body that carries the teeth (it reaches up into the fillets)."""
    static = reference_static()
    sector, ring, material = (
        static.sectors.ring,
        static.planetary_set.ring,
        reference_material(),
    )
    outer, root = ring.rim_radius, ring.root_radius
    M = mass(sector.grid, material, {"tooth": 1.0, "body": NOTHING})
    moved, x = (np.zeros(2 * sector.grid.n_nodes) for _ in range(2))
    moved[::2], x[::2] = 1.0, sector.grid.points[:, 0]
    teeth = moved @ M @ moved
    body = moved @ mass(sector.grid, material, {"tooth": NOTHING, "body": 1.0}) @ moved
    area = body / material.density * ring.teeth / math.pi
    annulus = material.density * math.pi * (outer**2 - root**2) / ring.teeth
    return teeth / annulus, (x @ M @ moved) / teeth, math.sqrt(outer**2 - area)


def toothed_ring() -> tuple[Row, ...]:
    """The free toothed ring beside the annulus of its root circle, the difference taken apart: information.

    The annulus is another body, so that no row here can say how right the ring is: `whole_ring` does.
    """
    ring = reference_static().planetary_set.ring
    ours, stiff, bare = _toothed(1.0, 1.0), _toothed(1.0, NOTHING), _toothed(NOTHING, NOTHING)
    share, centre, inner = _tooth_data()
    annulus, thicker = _exact(ring.root_radius), _exact(inner)
    middle = 0.5 * (ring.root_radius + ring.rim_radius)
    relative = (ring.rim_radius - ring.root_radius) / middle
    n = DIAMETERS
    # inextensional bending: u_r = 1, u_phi = -1/n + (n - 1/n)(r - R)/R (Love, art. 293)
    bending = n - 1 / n
    moving_teeth = 1 + (-1 / n + bending * (centre - middle) / middle) ** 2
    moving_ring = 1 + 1 / n**2 + bending**2 * relative**2 / 12
    predicted = stiff / np.sqrt(1 + share * moving_teeth / moving_ring)
    teeth = (
        f"another body: the teeth add {100 * share:.1f} % of mass, which moves more than the rim does, and 2 "
        "to 3 % of frequency by their stiffness"
    )
    bent = "teeth without mass, with the mass of the teeth moving as on a ring in inextensional bending"
    parts = (
        ("free toothed ring", annulus, ours, EXACT, teeth),
        (
            "body without teeth",
            thicker,
            bare,
            EXACT + ", of the same area as the body",
            "its edge is wavy",
        ),
        ("teeth without mass: their stiffness", annulus, stiff, EXACT, ""),
        ("free toothed ring", predicted, ours, bent, "an estimate: the rim shears and stretches too"),
    )
    return tuple(
        information("ring", source, f"{name}, n = {number} [Hz]", reference, value, note=note)
        for name, references, values, source, note in parts
        for number, reference, value in zip(n, references, values, strict=True)
    )


def _sector_modes(gear, diameters, state, *, refine: float = 1.0) -> np.ndarray:
    """Lowest elastic frequency [Hz] of every nodal diameter by cyclic reduction of a sector of its own.

    Parameters
    ----------
    gear : Gear
    diameters : sequence of int
    state : dict of region to str
    refine : float
        Divides the element sizes and multiplies the motions of the cut whose inertia moves the inside, 6 x 2.
    """
    from femgear.fe.grid import mirror
    from femgear.fe.meshing import mesh_outline
    from femgear.gears.tooth import half_sector

    static = reference_static()
    grid = mirror(mesh_outline(half_sector(gear, refine=refine)))
    material, width = reference_material(), gear.face_width
    K = stiffness(grid, material, state=state, thickness=width)
    load = active_flank_load(grid, static.planetary_set, 1.0)
    basis = sector_basis(
        grid,
        K,
        mass(grid, material, width),
        count=gear.teeth,
        loads=load,
        interior_shapes=round(6 * refine),
    )
    modes = cyclic_modes(
        basis,
        nodal_diameters=diameters,
        loads=load,
        outputs=load,
        max_frequency=20e3,
        static_correction=False,
    )
    # n = 0 turns as a rigid body at zero frequency first
    elastic = modes.frequency > 1.0
    return np.array([modes.frequency[elastic & (modes.nodal_diameter == n)][0] for n in diameters])


def _whole_modes(grid, diameters, state) -> np.ndarray:
    """The same of a whole ring, the mean of the two modes of a pair, which its grid splits a little."""
    frequencies, number = free_modes(grid, reference_material(), state, count=16)
    return np.array([frequencies[number == n][: 1 if n == 0 else 2].mean() for n in diameters])


def whole_ring() -> tuple[Row, ...]:
    """The free toothed ring twice: one sector with quadratic elements, all teeth in one cubic grid.

    The gate of a row is the sum of what both still change in plane stress when all element edges are halved
    (in the sector also with twice the motions of the cut that move the inside): where halving at least halves
    an error, each is below its change.
    """
    gear, rows = reference_static().planetary_set.ring, []
    coarse, fine = (whole_grid(gear, refine=refine) for refine in (1, 2))
    plane, diameters = {"tooth": "plane stress", "body": "plane stress"}, (*ELSEWHERE, 6)
    ours, whole = _sector_modes(gear, diameters, plane), _whole_modes(fine, diameters, plane)
    errors = np.abs(_sector_modes(gear, diameters, plane, refine=2.0) / ours - 1.0)
    other = np.abs(_whole_modes(coarse, diameters, plane) / whole - 1.0)
    mixed = _sector_modes(gear, DIAMETERS, RING_STATE), _whole_modes(fine, DIAMETERS, RING_STATE)
    source = "whole ring of 108 teeth, cubic elements (validation/whole_ring.py)"
    cases = (("plane stress", diameters, ours, whole), ("teeth in plane strain", DIAMETERS, *mixed))
    for words, numbers, values, references in cases:
        for n, value, reference in zip(numbers, values, references, strict=True):
            k = diameters.index(n)
            note = (
                f"gate: changes on halving all edges in plane stress, {100 * errors[k]:.1g} % of femgear's and "
                f"{100 * other[k]:.1g} % of the whole ring's"
            )
            name = f"free toothed ring, {words}, n = {n} [Hz]"
            rows.append(within("ring", source, name, reference, value, errors[k] + other[k], note=note))
    return tuple(rows)


def turning_carrier() -> tuple[Row, ...]:
    """Natural frequencies in the carrier frame, gyroscopic and convective terms included, up to 120 rad/s."""
    from gyroscopic import ring_wave_shares, turning_system

    from femgear.solvers.linear.tracking import campbell_data

    basis = reference_modes()
    distance = reference_static().planetary_set.centre_distance
    elastic = np.flatnonzero(basis.modes.frequency > 0.0)
    below = elastic[basis.modes.frequency[elastic] < 10e3]
    campbell = campbell_data(
        lambda speed: turning_system(basis.model, centre_distance=distance, carrier_speed=speed),
        np.linspace(0.0, FASTEST, 13),
        basis.modes.mesh_stiffness,
        count=len(below),
    )
    still, last = campbell.frequency[0], campbell.frequency[-1]
    change = np.abs(campbell.frequency / still - 1.0).max(axis=0)
    shares = ring_wave_shares(basis.model, campbell.tracked.shape[-1])
    wave = shares.argmax(axis=0) - len(shares) // 2
    on_the_ring = last - wave * FASTEST / (2.0 * np.pi)
    why = "these waves run around the ring. The next row has their frequency on the ring itself"
    rows = list(_bare_ring_turning(basis))
    first = np.append(True, np.diff(still) > 1e-6 * still[1:])
    for members in np.split(np.arange(len(still)), np.flatnonzero(first)[1:]):
        i = members[0]
        kind, n = basis.modes.kind[below[i]], basis.modes.nodal_diameter[below[i]]
        name = f"mode {i + 1}, {kind}" + (f", n = {n}" if n >= 0 else "")
        ends = ", ".join(f"{f:.2f}" for f in np.sort(last[members]))
        note = f"{still[i]:.2f} Hz at rest, {ends} Hz at 120 rad/s"
        text = f"{name}, in the carrier frame: largest change"
        largest = change[members].max()
        rows.append(at_most("turning", SLIGHT, text, CLAIM, largest, note=note, explanation=why))
        if largest > CLAIM:
            away = np.abs(on_the_ring[members] / still[i] - 1.0).max()
            ends = ", ".join(f"{f:.2f}" for f in np.sort(on_the_ring[members]))
            text = f"{name}, strongest wave as heard on the ring: largest change"
            rows.append(at_most("turning", SLIGHT, text, CLAIM, away, note=f"{ends} Hz at 120 rad/s"))
        elif len(members) == 1 and wave[i] and shares[:, i].sum() > 0.5:
            apart = abs(wave[i]) * FASTEST / (2.0 * np.pi)
            text = f"{name}, standing wave, heard on the ring as two lines: their distance from the middle"
            note = f"{last[i] - apart:.2f}, {last[i] + apart:.2f} Hz at 120 rad/s"
            rows.append(information("turning", SLIGHT, text, CLAIM, apart / still[i], note=note))
    name = "modes below 10 kHz in the carrier frame (reference), with a change below 1 % (femgear)"
    rows.append(information("turning", SLIGHT, name, len(change), int(np.sum(change < CLAIM))))
    return tuple(rows)


def _bare_ring_turning(basis) -> list[Row]:
    """The ring alone on its foundation, seen from the carrier at 120 rad/s."""
    from gyroscopic import turning_system

    from femgear.solvers.linear.modal import complex_modes

    alone = replace(basis.model.system, W=np.zeros((len(basis.model.system.M), 0)), flexibility=None)
    alone = turning_system(replace(basis.model, system=alone), centre_distance=0.0, carrier_speed=FASTEST)
    frequencies = complex_modes(alone, np.zeros(0), speed=FASTEST).frequency
    rows, modes = [], basis.ring.modes
    for n in range(1, 6):
        lowest, split = modes.frequency[modes.nodal_diameter == n].min(), n * FASTEST / (2.0 * np.pi)
        for sign, source in ((-1, "f - n Omega / 2 pi"), (1, "f + n Omega / 2 pi")):
            seen = lowest + sign * split
            text = f"ring alone on its foundation, n = {n}, seen from 120 rad/s [Hz]"
            nearest = frequencies[np.argmin(np.abs(frequencies - seen))]
            rows.append(within("turning", source, text, seen, nearest, 1e-9))
        text = f"ring alone, n = {n}, in the carrier frame: n Omega / 2 pi over f = {lowest:.2f} Hz"
        rows.append(information("turning", SLIGHT, text, CLAIM, split / lowest, note="on the ring: no change"))
    return rows


def other_outline() -> tuple[Row, ...]:
    """The free toothed ring in plane stress beside a computation whose root fillets are not known."""
    gear, diameters = reference_static().planetary_set.ring, tuple(ELSEWHERE)
    plane = {"tooth": "plane stress", "body": "plane stress"}
    ours = _sector_modes(gear, diameters, plane)
    sharp = replace(gear, rack=replace(gear.rack, root_radius=SHARP))
    sharper = _sector_modes(sharp, diameters, plane)
    return tuple(
        information(
            "ring",
            "independent computation with root fillets of its own",
            f"free toothed ring, plane stress, n = {n} [Hz]",
            ELSEWHERE[n],
            value,
            note=f"{SHARP} instead of {gear.rack.root_radius} modules at the cutter's tip {other:.1f} Hz",
        )
        for n, value, other in zip(diameters, ours, sharper, strict=True)
    )
