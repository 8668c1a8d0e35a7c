"""Plane vibration: membranes and rings."""

from __future__ import annotations

import math

import numpy as np

from femgear.fe.elasticity import Material, mass, stiffness
from validation.mapped import boundary_nodes, mapped_grid, ring_mapping
from validation.reference.annulus import annulus_frequencies
from validation.rows import REPEATED, Row, at_most, printed, within

NAFEMS_MATERIAL = Material(200e9, 0.3, 8000.0)
EXACT = "free annulus, 4x4 determinant of Bessel functions"


def frequencies(grid, material, *, count: int, expected: float, held=(), state: str = "plane stress"):
    """Lowest natural frequencies of a grid and their shapes.

    Parameters
    ----------
    grid : Grid
    material : Material
    count : int
        Number of modes, rigid ones included.
    expected : float
        Rough lowest elastic frequency [Hz]; the shift of the iteration is a negative fraction of it.
    held : array of int
        Degrees of freedom that are fixed.

    Returns
    -------
    ((count,) array, (n_free, count) array, mass matrix of the free dofs)
        Frequencies [Hz], the sign that of the eigenvalue.
    """
    from scipy.sparse.linalg import eigsh

    free = np.setdiff1d(np.arange(2 * grid.n_nodes), held)
    K = stiffness(grid, material, state=state)[free][:, free].tocsc()
    M = mass(grid, material)[free][:, free].tocsc()
    shift = -((0.3 * 2 * math.pi * expected) ** 2)
    value, shape = eigsh(K, count, M, sigma=shift, v0=np.ones(len(free)))
    order = np.argsort(value)
    value = value[order]
    return np.sign(value) * np.sqrt(np.abs(value)) / (2 * math.pi), shape[:, order], M


def tapered_membrane() -> tuple[Row, ...]:
    """B1: NAFEMS FV32."""
    grid = mapped_grid(lambda u, v: (10 * u, (v - 0.5) * (5 - 4 * u)), 48, 24)
    root = boundary_nodes(grid, "u=0")
    held = (2 * root[:, None] + [0, 1]).ravel()
    ours = frequencies(grid, NAFEMS_MATERIAL, count=6, expected=44.0, held=held)[0]
    nafems = (44.623, 130.03, 162.70, 246.05, 379.90, 391.44)
    converged = (44.617, 130.010, 162.689, 245.986, 379.718, 391.405)
    rows = []
    for mode, (published, exact, value) in enumerate(zip(nafems, converged, ours, strict=True), 1):
        name = f"NAFEMS FV32, tapered membrane, mode {mode} [Hz]"
        rows.append(within("B1", "NAFEMS", name, published, value, 1e-3))
        rows.append(within("B1", f"converged independent solution ({REPEATED})", name, exact, value, 1e-4))
    return tuple(rows)


def annulus() -> tuple[Row, ...]:
    """B2: NAFEMS FV33, closed form and FE."""
    inner, outer = 1.8, 6.0
    exact = annulus_frequencies(inner, outer, NAFEMS_MATERIAL, nodal_diameters=range(5), count=3)
    values = {
        2: "125.698966",
        0: "224.203941",
        1: "232.868657",
        3: "262.757799",
        4: "375.288293",
    }
    name = "NAFEMS FV33, free annulus 1.8/6 m: "
    rows = [
        printed("B2", EXACT, name + f"closed form, n = {n} [Hz]", value, exact[n, 0]) for n, value in values.items()
    ]
    rows.append(printed("B2", EXACT, name + "closed form, n = 2, second [Hz]", "335.285469", exact[2, 1]))
    strain = annulus_frequencies(inner, outer, NAFEMS_MATERIAL, nodal_diameters=[2], state="plane strain")[0, 0]
    rows.append(printed("B2", EXACT, name + "closed form, n = 2, plane strain [Hz]", "129.222705", strain))
    grid = mapped_grid(ring_mapping(inner, outer), 16, 128, closed=True)
    ours = frequencies(grid, NAFEMS_MATERIAL, count=13, expected=125.0)[0]
    rows.append(
        at_most(
            "B8",
            "three rigid motions",
            name + "FE, rigid over elastic",
            1e-6,
            np.abs(ours[:3]).max() / ours[3],
        )
    )
    pairs = ((3, "125.698966"), (5, "224.203941"), (6, "232.868657"), (8, "262.757799"), (10, "335.285469"))
    rows.extend(
        within("B2", EXACT, name + f"FE, elastic mode {k - 2} [Hz]", float(value), ours[k], 1e-4) for k, value in pairs
    )
    split = max(abs(ours[k + 1] / ours[k] - 1) for k in (3, 6, 8, 10))
    rows.append(at_most("B2", "symmetry", name + "FE, split of double frequencies", 1e-4, split))
    return tuple(rows)


def lame_modes() -> tuple[Row, ...]:
    """B3: equivoluminal modes of a free square, exact for any Poisson ratio."""
    grid = mapped_grid(lambda u, v: (u, v), 24, 24)
    x, y = (math.pi * part for part in grid.points.T)
    exact = np.column_stack([np.cos(x) * np.sin(y), -np.sin(x) * np.cos(y)]).ravel()
    rows = []
    for nu in (0.3, 0.45):
        material = Material(200e9, nu, 8000.0)
        speed = math.sqrt(material.shear_modulus / material.density)
        reference = speed / math.sqrt(2.0)
        value, shape, M = frequencies(grid, material, count=14, expected=reference)
        overlap = np.abs(exact @ (M @ shape))
        shown = "2192.645048" if nu == 0.3 else f"{reference:.6f}"
        name = f"Lame mode of a free unit square, nu {nu} [Hz]"
        source = "c_s/(sqrt 2 a)"
        rows.append(within("B3", source, name, float(shown), value[np.argmax(overlap)], 1e-5))
    return tuple(rows)


def thick_ring() -> tuple[Row, ...]:
    """B5: the ring of Code_Aster V2.03.109."""
    middle, depth = 0.369, 0.048
    material = Material(185e9, 0.3, 7800.0)
    inner, outer = middle - depth / 2, middle + depth / 2
    exact = annulus_frequencies(inner, outer, material, nodal_diameters=range(2, 7))[:, 0]
    values = ("209.980793", "586.201660", "1103.981552", "1746.530691", "2498.149393")
    name = "ring 369 mm, 48 mm thick: "
    rows = [
        printed("B5", EXACT, name + f"closed form, n = {n} [Hz]", value, ours, digits=2)
        for n, value, ours in zip(range(2, 7), values, exact, strict=True)
    ]
    breathing = annulus_frequencies(inner, outer, material, nodal_diameters=[0])[0, 0]
    rows.append(printed("B5", EXACT, name + "closed form, breathing [Hz]", "2103.804620", breathing, digits=2))
    strain = annulus_frequencies(inner, outer, material, nodal_diameters=[2, 3], state="plane strain")[:, 0]
    for n, value, ours in zip((2, 3), ("220.025450", "613.743942"), strain, strict=True):
        rows.append(printed("B5", EXACT, name + f"closed form, plane strain, n = {n} [Hz]", value, ours))
    grid = mapped_grid(ring_mapping(inner, outer), 4, 128, closed=True)
    ours = frequencies(grid, material, count=7, expected=210.0)[0]
    for n, k in ((2, 3), (3, 5)):
        rows.append(within("B5", EXACT, name + f"FE, n = {n} [Hz]", float(values[n - 2]), ours[k], 2e-4))
    return tuple(rows)


def thin_limit() -> tuple[Row, ...]:
    """B7: exact over thin-ring frequency, where double precision is easily lost."""
    values = {
        (2, 0.001): ".999999525",
        (2, 0.01): ".999952505",
        (2, 0.1): ".995299479",
        (3, 0.001): ".9999987183",
        (3, 0.01): ".9998718666",
        (3, 0.1): ".9875060268",
    }
    material = Material(185e9, 0.3, 7800.0)
    bar = math.sqrt(material.youngs_modulus / material.density)
    rows = []
    for (n, ratio), value in values.items():
        exact = annulus_frequencies(1 - ratio / 2, 1 + ratio / 2, material, nodal_diameters=[n])[0, 0]
        thin = n * (n**2 - 1) / math.sqrt(n**2 + 1) * ratio / math.sqrt(12) * bar / (2 * math.pi)
        source = "Bessel determinant in 60 digits over the thin ring (Love, art. 293)"
        name = f"annulus over thin ring, n = {n}, h/R {ratio}"
        rows.append(printed("B7", source, name, value, exact / thin))
    return tuple(rows)
