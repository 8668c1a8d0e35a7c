"""Gears with their exact teeth for CAD: solids as STEP by Gmsh's OpenCASCADE, outlines as DXF by ezdxf.

Flanks and fillets are splines through points of the true curves, tips and roots arcs; helical teeth go through turned
sections. Lengths in the files are mm. The shaft of a gear is its bore, of an internal gear the rim.
"""

from __future__ import annotations

import io
import math
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.errors import CaseError, StorageError, nvh_library
from femgear.fe.meshing import gmsh_missing
from femgear.gears.gear import Gear
from femgear.gears.short_teeth import ShortTeeth
from femgear.gears.tooth import half_sector
from femgear.storage.disk_errors import storage_errors
from femgear.storage.files import write_text

if TYPE_CHECKING:
    from femgear.report.space import SpaceBody

WORKER = Path(__file__).with_name("_cad_worker.py")
TIME_LIMIT = 3600.0
"""Longest time of the process that makes the solids [s]."""
FORMATS = (".step", ".stp", ".dxf")
"""Ends of the names of the files that can be written."""
_AT_REACH = 1e-6
"""Share of a radius within which points lie on it."""
_FLANK = 12
"""Edges of a flank: splines through their points miss the area of the gear by 2e-7."""


@dataclass(frozen=True)
class PlacedGear:
    """A gear in its place.

    Parameters
    ----------
    name : str
    gear : Gear
        In its transverse section.
    axis : (float, float)
        x and y of its axis [m].
    ends : (float, float)
        z of both ends of its face width [m].
    twist : float
        By which its teeth turn from the first to the second end [rad].
    angle : float
        Of a tooth at the first end [rad].
    short : tuple of (int, float)
        Teeth that are missing or short, counter-clockwise from that one, and the radii that they reach [m].
    """

    name: str
    gear: Gear
    axis: tuple[float, float]
    ends: tuple[float, float]
    twist: float = 0.0
    angle: float = 0.0
    short: ShortTeeth = ()


def placed_gears(bodies: Iterable[SpaceBody]) -> tuple[PlacedGear, ...]:
    """Choose the gears with teeth of some bodies in space.

    Raises
    ------
    CaseError
        E-TEETH: none has teeth.
    """
    gears = tuple(
        PlacedGear(body.name, body.gear, body.axis, body.ends, body.twist, body.angle, body.short)
        for body in bodies
        if body.gear is not None
    )
    if not gears:
        remedy = "give the teeth of a stage in place of its sizes"
        raise CaseError("no gear of this case has teeth of its own", code="E-TEETH", remedy=remedy)
    return gears


def half_curves(gear: Gear) -> dict[str, np.ndarray]:
    """Find the curves (k, 2) of half a tooth [m], each from the middle of the tooth to the middle of the gap."""
    curves = dict(half_sector(gear, flank_elements=_FLANK).curves)
    half = {}
    for name in ("tip", "flank", "fillet", "root"):
        if name in curves:
            points = np.asarray(curves[name])
            angle = np.arctan2(points[[0, -1], 1], points[[0, -1], 0])
            half[name] = points if angle[0] < angle[1] else points[::-1]
    return half


def short_curves(half: dict[str, np.ndarray], reach: float, *, internal: bool) -> dict[str, np.ndarray]:
    """Cut the curves (k, 2) of half a tooth off at the radius that it reaches [m], where an arc is its tip.

    Flank and fillet keep what lies on the side of the root, with a point at that radius; of a missing tooth nothing.
    """
    curves = {name: half[name] for name in ("root",) if name in half}
    ends = []
    for name in ("flank", "fillet"):
        points, radius = half[name], np.hypot(*half[name].T)
        inside = radius > reach * (1.0 + _AT_REACH) if internal else radius < reach * (1.0 - _AT_REACH)
        cut = points[inside]
        if inside.any() and not inside.all():
            last = int(np.flatnonzero(inside[:-1] != inside[1:])[0])
            share = (reach - radius[last]) / (radius[last + 1] - radius[last])
            between = points[last] + share * (points[last + 1] - points[last])
            between = between * (reach / np.hypot(*between))
            cut = np.vstack([between, cut]) if inside[-1] else np.vstack([cut, between])
            ends.append(between)
        curves[name] = cut
    # of a missing tooth the arc spans the whole sector, from the middle of one gap to that of the next
    last = half["root" if "root" in half else "fillet"][-1]
    end = ends[0] if ends else last * (reach / np.hypot(*last))
    return curves | {"tip": np.array([end, end])}


def gear_area(gear: Gear) -> float:
    """Compute the area between teeth and bore, or teeth and rim, of a gear [m^2], by Green's theorem on fine curves."""
    curves = dict(half_sector(gear, flank_elements=200, refine=8.0).curves)
    double = 0.0
    for name in ("tip", "flank", "fillet", "root"):
        if name in curves:
            x, y = np.asarray(curves[name]).T
            double += abs(float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))
    return abs(gear.teeth * double - math.pi * gear.rim_radius**2)


def write_step(gears: Sequence[PlacedGear], path: Path) -> tuple[float, ...]:
    """Write gears as solids into a STEP file; returns their volumes [m^3].

    Parameters
    ----------
    gears : sequence of PlacedGear
        Equal ones, as planets, are made once.
    path : Path
        Of the file, whose name ends in .step.

    Raises
    ------
    GridError
        E-GRID-GMSH: Gmsh cannot be loaded.
    StorageError
        E-CAD: OpenCASCADE makes no solid of these gears.
    """
    kinds: dict[tuple[Any, float, float, ShortTeeth], int] = {}
    job: dict[str, Any] = {}
    places = []
    for placed in gears:
        width = placed.ends[1] - placed.ends[0]
        kind = kinds.setdefault((placed.gear, width, placed.twist, placed.short), len(kinds))
        places.append([kind, *(1e3 * value for value in (*placed.axis, placed.ends[0])), placed.angle])
        if f"teeth_{kind}" not in job:
            curves = half_curves(placed.gear)
            of_kind = {
                "teeth": placed.gear.teeth,
                "flank": 1e3 * curves["flank"],
                "fillet": 1e3 * curves["fillet"],
                "root": "root" in curves,
                "width": 1e3 * width,
                "rim": 1e3 * placed.gear.rim_radius,
                "internal": placed.gear.internal,
                "twist": placed.twist,
                "short": np.array([(number, 1e3 * radius) for number, radius in placed.short]).reshape(-1, 2),
            }
            job |= {f"{name}_{kind}": value for name, value in of_kind.items()}
    job |= {"places": np.array(places), "time_limit": TIME_LIMIT, "names": np.array([placed.name for placed in gears])}
    source = io.BytesIO()
    np.savez(source, **job)
    unfinished = path.with_name(f".{path.stem}.unfinished.step")
    command = [sys.executable, "-P", str(WORKER), str(unfinished)]
    try:
        done = subprocess.run(command, input=source.getvalue(), timeout=TIME_LIMIT, capture_output=True)
    except subprocess.TimeoutExpired as error:
        text = f"Gmsh was stopped: no solids after {TIME_LIMIT:g} s"
        raise StorageError(text, code="E-CAD", remedy="write a DXF, or fewer gears") from error
    words = done.stdout.decode(errors="replace").split()
    if done.returncode or "volumes" not in words:
        unfinished.unlink(missing_ok=True)
        text = " ".join(done.stderr.decode(errors="replace").split())[-400:]
        if done.returncode == 3:
            raise gmsh_missing(text)
        remedy = "write a DXF of the outlines instead"
        raise StorageError(f"Gmsh made no solids: {text}", code="E-CAD", remedy=remedy)
    with storage_errors(path):
        unfinished.replace(path)
    return tuple(1e-9 * float(word) for word in words[words.index("volumes") + 1 :])


def write_dxf(gears: Sequence[PlacedGear], path: Path) -> None:
    """Write the outlines of gears at the middle of their face width into a DXF file, a layer for each.

    Raises
    ------
    FemgearError
        E-LIBRARY: ezdxf is not installed.
    """
    with nvh_library("DXF files", "cad"):
        from ezdxf.filemanagement import new
    document = new("R2010", units=4)  # mm
    space = document.modelspace()
    for placed in gears:
        document.layers.add(placed.name)
        look = {"layer": placed.name}
        half, gear = half_curves(placed.gear), placed.gear
        centre = 1e3 * np.array(placed.axis)
        space.add_circle(tuple(centre), 1e3 * gear.rim_radius, dxfattribs=look)
        middle = placed.angle + 0.5 * placed.twist

        def turned(points: np.ndarray, angle: float, centre: np.ndarray = centre) -> list[tuple[float, float]]:
            c, s = math.cos(angle), math.sin(angle)
            return [tuple(point) for point in 1e3 * points @ np.array([[c, s], [-s, c]]) + centre]

        reached = dict(placed.short)
        for number in range(gear.teeth):
            angle = middle + 2.0 * math.pi * number / gear.teeth
            curves = half if number not in reached else short_curves(half, reached[number], internal=gear.internal)
            for side in (1.0, -1.0):
                for name in ("flank", "fillet"):
                    if len(curves[name]) > 1:
                        space.add_spline(turned(curves[name] * [1.0, side], angle), dxfattribs=look)
            for name, at in (("tip", angle), ("root", angle + math.pi / gear.teeth)):
                if name in curves:
                    end = curves[name][-1 if name == "tip" else 0]
                    reach = abs(math.atan2(end[1], end[0]) - (0.0 if name == "tip" else math.pi / gear.teeth))
                    ends = math.degrees(at - reach), math.degrees(at + reach)
                    space.add_arc(tuple(centre), 1e3 * float(np.hypot(*end)), *ends, dxfattribs=look)
    text = io.StringIO()
    document.write(text)
    write_text(text.getvalue(), path)


def write_cad(gears: Sequence[PlacedGear], path: Path, tell: Callable[[str], object] = lambda text: None) -> None:
    """Write gears as STEP or DXF, as the name of the file ends, and tell the volumes of solids.

    Raises
    ------
    CaseError
        E-ARGUMENTS: another end of the name.
    FemgearError
        As `write_step` and `write_dxf`.
    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise CaseError(
            "the name of the file tells its format",
            code="E-ARGUMENTS",
            key="--output",
            value=path.name,
            limit=", ".join(FORMATS),
        )
    if suffix == ".dxf":
        write_dxf(gears, path)
        return
    for placed, volume in zip(gears, write_step(gears, path), strict=True):
        tell(f"{placed.name}: {1e9 * volume:,.1f} mm^3")
