"""The planet carrier of scripts/carrier.py by CalculiX, from its geometry on a grid of its own."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.linalg import eigh

from validation import calculix
from validation.calculix import MILLIMETRE
from validation.calculix_casing import meshed_solid, solid_input
from validation.calculix_rows import SOURCE, where_installed
from validation.rows import Row, within

SIZE, AROUND = 0.006, 14
"""Length of the elements [m], and their least number on a circle: tetrahedra of ten nodes on the true surfaces."""
MODES = 8
FREQUENCY_GATE, COMPLIANCE_GATE = 0.005, 0.01
"""Those of the casing's example."""
WAYS = ("radially", "around the axis", "along it", "about the radius", "about the tangent")


def clamped_carrier(carrier, *, size: float = SIZE, around: int = AROUND) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz], and compliance (6 N, 6) of all pins by loads on the first one, the seat clamped."""
    from dataclasses import replace

    from carrier import NU, RHO, E, geometry, mean_motions

    text = geometry(replace(carrier, size=size, around=around), whole=True)
    points, solids, triangles = meshed_solid(text + "Mesh.ElementOrder = 2;\n")
    used = np.unique(solids)
    end = carrier.half_span + carrier.cheek + carrier.stub
    seat = used[np.abs(points[used, 2] - end) < 1e-7]
    angles = 2.0 * math.pi / carrier.planets * np.arange(carrier.planets)
    places = np.column_stack([carrier.radius * np.cos(angles), carrier.radius * np.sin(angles), 0.0 * angles])
    loads = []
    for place in places:
        arm = points[triangles] - place
        on_pin = np.abs(np.hypot(arm[..., 0], arm[..., 1]) - carrier.pin) < 1e-7
        under = np.abs(arm[..., 2]) < 0.5 * carrier.bearing + 1e-7
        loads.append(mean_motions(points, triangles[(on_pin & under).all(axis=1)], place))
    pins = np.unique(np.concatenate([np.flatnonzero(np.abs(load).sum(axis=(1, 2))) for load in loads]))
    lines = solid_input(points, solids, young=E, poisson=NU, density=RHO)
    lines += ["*NSET, NSET=SEAT", *map(str, seat + 1), "*NSET, NSET=PINS", *map(str, pins + 1), "*BOUNDARY\nSEAT,1,3"]
    for way in range(6):
        lines.append("*STEP\n*STATIC\n*CLOAD, OP=NEW")
        load = loads[0][..., way]
        lines += [f"{i + 1},{c + 1},{1e6 * load[i, c]:.12g}" for i, c in np.argwhere(load)]
        lines.append("*NODE PRINT, NSET=PINS\nU\n*END STEP")
    lines.append(f"*STEP\n*FREQUENCY\n{MODES}\n*END STEP")
    output = calculix.run("\n".join(lines) + "\n").tables
    compliance = np.zeros((6 * len(places), 6))
    for way, rows in enumerate(calculix.tables(output, "displacements")[:6]):
        moved = np.zeros((len(points), 3))
        moved[rows[:, 0].astype(int) - 1] = 1e-6 / MILLIMETRE * rows[:, 1:]
        compliance[:, way] = np.concatenate([np.einsum("nda,nd->a", load, moved) for load in loads])
    return calculix.frequencies(output), compliance


@where_installed
def carrier_example() -> tuple[Row, ...]:
    """The carrier as femgear reads it, seat clamped: modes, compliance of one pin and of the next one."""
    from carrier import Carrier, reduced

    from femgear.exchange.carrier_files import read_carrier

    carrier = Carrier()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "carrier.npz"
        np.savez(path, **reduced(carrier))
        body = read_carrier(path)
    count = len(body.frequency)
    size = 6 * carrier.planets
    K, M = np.zeros((size + count,) * 2), np.eye(size + count)
    K[:size, :size], K[size:, size:] = np.linalg.inv(body.compliance), np.diag(body.frequency**2)
    M[:size, :size], M[:size, size:], M[size:, :size] = body.mass[6:, 6:], body.coupling[6:], body.coupling[6:].T
    ours = np.sqrt(eigh(K, M, eigvals_only=True)) / (2.0 * math.pi)
    expected, compliance = clamped_carrier(carrier)
    name = "carrier of scripts/carrier.py, seat clamped: "
    rows = [
        within("carrier", SOURCE, f"{name}natural frequency {i + 1} [Hz]", expected[i], ours[i], FREQUENCY_GATE)
        for i in range(MODES)
    ]
    for way, words in enumerate(WAYS):
        unit, scale = ("um/kN", 1e9) if way < 3 else ("urad/(N m)", 1e6)
        text = f"{name}compliance of a pin {words} [{unit}]"
        pair = scale * compliance[way, way], scale * body.compliance[way, way]
        rows.append(within("carrier", SOURCE, text, *pair, COMPLIANCE_GATE))
    apart = np.abs(body.compliance[6:9, :3] - compliance[6:9, :3]).max() / np.abs(compliance[:3, :3]).max()
    text = f"{name}a pin under forces on another, difference over the compliance of one"
    rows.append(within("carrier", SOURCE, text, 0.0, apart, COMPLIANCE_GATE))
    return tuple(rows)
