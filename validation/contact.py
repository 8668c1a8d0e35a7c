"""Line contact against Hertz's closed forms and elementary problems."""

from __future__ import annotations

import math

import numpy as np

from femgear.contact.solve import solve_contact
from validation.reference.hertz import (
    HertzLine,
    cell_influence,
    contact_modulus,
    hertz_line,
    relative_radius,
    surface_relative_to_depth,
    weber_banaschek,
)
from validation.rows import REPEATED, Row, at_most, printed, within

HERTZ = "Hertz (Johnson, Contact Mechanics, 4.2)"
PEAK_ERRORS = {40: "-1.286e-3", 80: "-3.234e-4", 160: "-8.116e-5", 320: "-2.034e-5", 640: "-5.09e-6"}


def cylinder_in_bore() -> HertzLine:
    """The contact of C3: radius 50 mm in a bore of 75 mm, 500 N/mm, steel of 206 GPa."""
    modulus = contact_modulus(206e9, 0.3, 206e9, 0.3)
    return hertz_line(500e3, relative_radius(0.050, -0.075), modulus)


def closed_forms() -> tuple[Row, ...]:
    """C1 to C3: Hertz's line contact."""
    nafems = hertz_line(35e6, 0.050, contact_modulus(210e9, 0.3, 70e9, 0.3))
    shear, depth = nafems.max_shear()
    sine = math.sin(math.radians(20.0))
    pinion = hertz_line(100e3, relative_radius(0.020 * sine, 0.040 * sine), contact_modulus(206e9, 0.3, 206e9, 0.3))
    bore = cylinder_in_bore()
    roller = "NAFEMS cylindrical roller, R 50 mm, 35 kN/mm: "
    pair = "20/40, m 2, pitch point, 100 N/mm: "
    inside = "cylinder 50 in bore 75 mm, 500 N/mm: "
    return (
        printed("C1", HERTZ, roller + "half width [mm]", "6.2146279", 1e3 * nafems.half_width),
        printed("C1", HERTZ, roller + "peak pressure [MPa]", "3585.36223", 1e-6 * nafems.peak_pressure),
        printed("C1", HERTZ, roller + "largest shear over peak", ".3002831", shear / nafems.peak_pressure),
        printed("C1", HERTZ, roller + "its depth over half width", ".7861514", depth / nafems.half_width),
        printed(
            "C1",
            HERTZ,
            roller + "largest shear [MPa]",
            "1076.61",
            1e-6 * shear,
            explanation="the printed ratio 0.3002831 times the printed peak 3585.36223 MPa is 1076.624 MPa",
        ),
        printed("C1", HERTZ, roller + "depth of the largest shear [mm]", "4.8856", 1e3 * depth),
        printed("C2", HERTZ, pair + "half width [mm]", ".07162297", 1e3 * pinion.half_width),
        printed("C2", HERTZ, pair + "peak pressure [MPa]", "888.848552", 1e-6 * pinion.peak_pressure),
        printed("C3", HERTZ, inside + "half width [mm]", ".9185182", 1e3 * bore.half_width),
        printed("C3", HERTZ, inside + "peak pressure [MPa]", "346.547167", 1e-6 * bore.peak_pressure),
    )


def half_plane_contact(cells: int):
    """Solve the contact of C3 with uniform-pressure cells over twice the half width either side.

    Returns
    -------
    (state, pressure, width)
        ContactState, cell pressures [Pa] and cell width [m].
    """
    exact = cylinder_in_bore()
    width = 4 * exact.half_width / cells
    x = (np.arange(cells) + 0.5) * width - 2 * exact.half_width
    influence = cell_influence(x[:, None] - x, width / 2, 40 * exact.half_width, exact.modulus)
    gap = x**2 / (2 * exact.radius)
    state = solve_contact(influence, gap, np.ones((cells, 1)), np.array([exact.line_load]))
    return state, state.loads / width, width


def pressure_cells() -> tuple[Row, ...]:
    """C4: contact found by the complementarity solver on a half plane."""
    exact = cylinder_in_bore()
    rows, errors = [], []
    for cells, published in PEAK_ERRORS.items():
        state, pressure, _ = half_plane_contact(cells)
        errors.append(pressure.max() / exact.peak_pressure - 1)
        name = f"relative error of the peak pressure, {cells} cells"
        rows.append(printed("C4", f"independent solution ({REPEATED})", name, published, errors[-1]))
    order = math.log2(errors[-2] / errors[-1])
    complementarity = float(np.abs(state.loads * state.gaps).max())
    balance = abs(state.loads.sum() / exact.line_load - 1)
    approach = exact.approach(40 * exact.half_width)
    return (
        *rows,
        within("C4", "theory", "order of the peak pressure", 2.0, order, 0.05, relative=False),
        within("C4", HERTZ, "approach at 640 cells [m]", approach, float(state.motions[0]), 1e-4),
        at_most("C4", "definition", "largest load times gap [N]", 0.0, complementarity),
        at_most("C4", "equilibrium", "relative load balance", 1e-12, balance),
        at_most("C4", "definition", "most negative load [N/m]", 0.0, min(0.0, float(state.loads.min()))),
    )


def depth_reference() -> tuple[Row, ...]:
    """Approach of the surface to a point under it, against Weber and Banaschek."""
    youngs, nu, load, half = 206e9, 0.3, 100e3, 7e-5
    shear = youngs / (2 * (1 + nu))
    rows = []
    for factor in (20, 50):
        cells = 400
        width = 2 * half / cells
        x = (np.arange(cells) + 0.5) * width - half
        edges = np.linspace(-1.0, 1.0, cells + 1)
        area = 0.5 * (edges * np.sqrt(1 - edges**2) + np.arcsin(edges))
        cell_loads = load * np.diff(area) * 2 / math.pi
        ours = cell_loads @ surface_relative_to_depth(x, width / 2, factor * half, shear, nu)
        reference = weber_banaschek(load, half, factor * half, youngs, nu)
        rows.append(
            within(
                "Weber-Banaschek",
                "Weber and Banaschek 1953",
                f"approach of the contact to the depth of {factor} half widths, 100 N/mm [m]",
                reference,
                ours,
                1e-3,
                note="the closed form holds for depths much larger than the contact",
            )
        )
    return tuple(rows)


def springs_with_gap() -> tuple[Row, ...]:
    """C6: two springs, one with a gap, share a load."""
    stiffness, gap = np.array([10.0, 15.0]), np.array([0.0, 2.0])
    rows = []
    for load, motion in ((10.0, 1.0), (20.0, 2.0), (21.0, 2.04), (50.0, 3.2), (100.0, 5.2)):
        state = solve_contact(np.diag(1 / stiffness), gap, np.ones((2, 1)), np.array([load]))
        name = f"springs 10 and 15, gap 2, load {load:g}: motion"
        rows.append(within("C6", "closed form", name, motion, float(state.motions[0]), 1e-12))
    return (
        *rows,
        within("C6", "closed form", "force of the second spring at load 100", 48.0, state.loads[1], 1e-12),
    )
