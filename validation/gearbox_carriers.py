"""Elastic carriers in gearboxes: the same beams by closed forms, from files and without reduction; tubes and webs."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from carrier_bodies import ANGLES, HALF, beam_carrier, unreduced_frequencies, written
from scipy.sparse.linalg import spsolve
from small_gearbox import planetary_tables

from femgear.trains.gearbox.carrier import wind_up_stiffness
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.reading import read_case, with_value
from validation.rows import Row, at_most, information, within

SELF = "the same gearbox"
LARGEST = 1e-9
OUTER, INNER, PLATE, RIM = 0.045, 0.035, 0.02, 0.05
"""Radii of a tube or of webs between two plates, thickness and radius of these [m]."""
TUBE_GATE, WEB_GATE = 0.03, 0.2
PLATES = """SetFactory("OpenCASCADE");
Cylinder(1) = {{0, 0, -{end}, 0, 0, {plate}, {rim}}};
Cylinder(2) = {{0, 0, {half}, 0, 0, {plate}, {rim}}};
{webs}
BooleanUnion(50) = {{ Volume{{1}}; Delete; }}{{ Volume{{2, 10:{last}}}; Delete; }};
Mesh.MeshSizeMax = 0.007; Mesh.MeshSizeFromCurvature = 30; Mesh.RandomSeed = 1; General.NumThreads = 1;
"""
WEB = """Cylinder({n}) = {{0, 0, -{half}, 0, 0, 2*{half}, {outer}, {arc}}};
Cylinder({n} + 20) = {{0, 0, -{half}, 0, 0, 2*{half}, {inner}}};
BooleanDifference({n} + 40) = {{ Volume{{{n}}}; Delete; }}{{ Volume{{{n} + 20}}; Delete; }};
Rotate {{{{0, 0, 1}}, {{0, 0, 0}}, {turn}}} {{ Volume{{{n} + 40}}; }}
"""


def _planets(state: Deflection) -> np.ndarray:
    """Motions (N, 6) of the planets [m, rad]."""
    return np.array([state.motion[6 * station : 6 * station + 6] for station in state.model.stages[0].planets])


def _frequencies(case: Any) -> np.ndarray:
    return solve_gearbox_modes(solve_deflection(case)).modes.frequency


def beams() -> tuple[Row, ...]:
    """A carrier of beams, from a file: closed forms, no reduction, turned, stiff, and in balance."""
    bearing = {"radial": "4e8 N/m", "tilt": "5e4 N m/rad"}
    entries = {"planet": {"mass": "0.4 kg", "inertia": "1e-4 kg m^2", "bearing": bearing}}
    with TemporaryDirectory() as folder:
        return tuple(_beam_rows(entries, lambda arrays: _superelement(Path(folder), arrays)))


def _superelement(folder: Path, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """The entry of a carrier of these arrays, in the place of its file."""
    written(folder, arrays)
    text = planetary_tables(carrier_body={"file": "carrier.npz"})
    case = folder / "case.toml"
    from femgear.case import text as case_text

    case.write_text(case_text.write(text), encoding="utf-8")
    section = read_case(case).planetary[0].superelement
    assert section is not None
    return {"superelement": {name: list(getattr(section, name)) for name in type(section).model_fields}}


def _beam_rows(entries: dict[str, Any], of: Callable[[dict[str, np.ndarray]], dict[str, Any]]):
    def case(body: dict[str, Any] | None, **others: Any) -> Any:
        given = {} if body is None else {"carrier_body": body}
        return read_case(planetary_tables(**entries, **given, **others))

    name, arrays = "carrier of beams", beam_carrier(elements=2)
    pins = {"diameter": "20 mm", "length": f"{HALF!r} m"}
    closed = solve_deflection(case({"wind_up_stiffness": "3e5 N m/rad"}, pins=pins))
    body = of(arrays)
    state = solve_deflection(case(body))
    size = np.abs(_planets(closed)).max()
    apart = np.abs(_planets(state) - _planets(closed)).max() / size
    yield at_most(name, "femgear, closed forms", "motions of the planets, difference over the largest", LARGEST, apart)
    yield at_most(name, "equilibrium", "force out of balance over the largest", LARGEST, state.residual)
    whole = solve_deflection(with_value(case(body), "modes.up_to", "200 kHz"))
    expected = unreduced_frequencies(whole, arrays)
    ours = solve_gearbox_modes(whole).modes.frequency
    ours, expected = ours[ours > 0.0], expected[expected > 1.0]
    low = ours < 2e4
    apart = np.abs(ours / expected[: len(ours)] - 1.0)[low].max()
    text = "natural frequencies up to 20 kHz with all inner modes, largest difference, relative"
    yield at_most(name, "the beams without reduction", text, LARGEST, apart)
    base, pitch = _frequencies(case(body)), 2.0 * math.pi / 3.0
    turned = _frequencies(case(body, angle=f"{pitch!r} rad"))
    other = _frequencies(case(of(beam_carrier(elements=2, angles=tuple(a + pitch for a in ANGLES)))))
    for words, values in (("turned by a planet pitch", turned), ("with pins renumbered", other)):
        apart = np.abs(values / np.maximum(base, 1.0) - base / np.maximum(base, 1.0)).max()
        yield at_most(f"{name} {words}", SELF, "natural frequencies, largest difference, relative", LARGEST, apart)
    stiff, rigid = solve_deflection(case(of(beam_carrier(stiffer=1e9)))), solve_deflection(case(None))
    apart = np.abs(_planets(stiff) - _planets(rigid)).max() / np.abs(_planets(rigid)).max()
    text = "motions of the planets, difference over the largest"
    yield at_most(f"{name}, 1e9 times as stiff", "femgear, a rigid carrier", text, LARGEST, apart)


def twist_of_plates(share: float, webs: int, *, stiffer: float) -> float:
    """Torsional stiffness between two plates by finite elements [N m/rad], of webs or of a tube (share 1).

    The plates are so many times stiffer than what lies between them.
    """
    from skfem import Basis, ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet, condense
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    arc = 2.0 * math.pi * share / webs
    names = {"half": HALF, "plate": PLATE, "rim": RIM, "end": HALF + PLATE, "outer": OUTER, "inner": INNER}
    parts = "".join(WEB.format(n=10 + n, arc=arc, turn=2.0 * math.pi * n / webs, **names) for n in range(webs))
    text = PLATES.format(webs=parts, last=0, **names).replace("2, 10:0", f"2, 50:{49 + webs}").replace("(50)", "(90)")
    with TemporaryDirectory() as folder:
        source, grid = Path(folder) / "plates.geo", Path(folder) / "plates.msh"
        source.write_text(text, encoding="utf-8")
        run = "import sys, gmsh; gmsh.initialize(sys.argv, run=True)"
        words = [sys.executable, "-c", run, "-3", "-v", "1", "-format", "msh22", source, "-o", grid]
        subprocess.run(words, check=True, capture_output=True, timeout=300)
        mesh = MeshTet.load(grid)
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=2)
    form = linear_elasticity(*lame_parameters(2.06e11, 0.3))
    plates = mesh.elements_satisfying(lambda x: np.abs(x[2]) > HALF)
    of_plates = form.assemble(Basis(mesh, basis.elem, intorder=2, elements=plates))
    K = (form.assemble(basis) + (stiffer - 1.0) * of_plates).tocsc()

    def rotation(low: float, high: float) -> np.ndarray:
        """Mean rotation (n,) of the rim of a plate."""
        rim = mesh.facets_satisfying(
            lambda x: (np.hypot(x[0], x[1]) > RIM - 1e-3) & (low < x[2]) & (x[2] < high), boundaries_only=True
        )
        surface = FacetBasis(mesh, basis.elem, facets=rim)
        x = np.asarray(surface.global_coordinates())
        about = LinearForm(lambda v, w: w.x[0] * v[1] - w.x[1] * v[0]).assemble(surface)
        return about / ((x[0] ** 2 + x[1] ** 2) * surface.dx).sum()

    top, bottom = rotation(HALF, HALF + PLATE), rotation(-HALF - PLATE, -HALF)
    held = basis.get_dofs(mesh.facets_satisfying(lambda x: x[2] < 1e-6 - HALF - PLATE, boundaries_only=True))
    inner, load, _, free = condense(K, top, D=held.flatten())
    moved = np.zeros(basis.N)
    moved[free] = spsolve(inner.tocsc(), load)
    # a torque of one on the upper plate
    return 1.0 / float((top - bottom) @ moved)


def wind_up() -> tuple[Row, ...]:
    """A tube and webs between two plates, by finite elements: with plates 1000 times as stiff, and with their own."""
    rows = []
    for name, share, webs, gate in (("tube", 1.0, 1, TUBE_GATE), ("three webs, share 0.4", 0.4, 3, WEB_GATE)):
        body = {"web_outer_diameter": "90 mm", "web_inner_diameter": "70 mm", "web_share": share}
        case = read_case(planetary_tables(pins={"diameter": "20 mm", "length": f"{HALF!r} m"}, carrier_body=body))
        ours, name = wind_up_stiffness(case, case.planetary[0]), f"{name}, 90/70 mm, 36 mm long"
        text = "torsional stiffness between {} [N m/rad]"
        expected = twist_of_plates(share, webs, stiffer=1e3)
        rows.append(within(name, "finite elements", text.format("stiff cheeks"), expected, ours, gate))
        expected = twist_of_plates(share, webs, stiffer=1.0)
        note = "closed forms take the cheeks as rigid"
        rows.append(information(name, "finite elements", text.format("cheeks of 20 mm"), expected, ours, note=note))
    return tuple(rows)


def drum() -> tuple[Row, ...]:
    """The stage of cases/planet_carrier.toml, with the teeth."""
    state = solve_deflection(read_case("cases/planet_carrier.toml"))
    name = "planetary stage, drum carrier"
    return (
        at_most(name, "equilibrium", "force out of balance over the largest", LARGEST, state.residual),
        at_most(name, SELF, "passes until slopes agree to 1e-4", 5, len(state.slopes) - 1),
    )
