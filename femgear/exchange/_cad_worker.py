"""Runs Gmsh's OpenCASCADE on prepared gears, in a process of its own: ``python _cad_worker.py FILE.step < IN.npz``.

Gmsh has one global model and installs signal handlers. Only gmsh and numpy are imported, never femgear. Lengths are in
mm. Prints the volume of every body [mm^3]; exit codes: 0 done; 3 gmsh cannot be imported; 4 gmsh refused the gears.
"""

import io
import signal
import sys

import numpy as np

SECTIONS = 3
"""Sections through which the surfaces of helical teeth go, per the twist of `STEP` rad and at least."""
STEP = 0.15


def _outline(occ, gear, turn, height):
    """Add the curves of all teeth, turned, at a height: splines on flanks and fillets, arcs at tips and roots."""
    teeth, flank, fillet = int(gear["teeth"]), gear["flank"], gear["fillet"]
    centre = occ.addPoint(0.0, 0.0, height)
    mirrored = np.array([1.0, -1.0])
    curves, gaps, pitch = [], [], 2.0 * np.pi / teeth

    def points(places, angle):
        c, s = np.cos(angle), np.sin(angle)
        return [occ.addPoint(*place, height) for place in places @ np.array([[c, s], [-s, c]])]

    # without a root circle fillets meet in the middle of the gap, in one point
    meeting = [] if gear["root"] else [points(fillet[-1:], turn + number * pitch)[0] for number in range(teeth)]
    for number in range(teeth):
        angle = turn + number * pitch
        upper, upper_root = points(flank, angle), points(fillet[1:], angle)
        lower, lower_root = points(flank * mirrored, angle), points(fillet[1:] * mirrored, angle)
        if meeting:
            lower_root[-1], upper_root[-1] = meeting[number - 1], meeting[number]
        curves.append(
            [
                occ.addSpline([*lower_root[::-1], lower[-1]]),
                occ.addSpline(lower[::-1]),
                occ.addCircleArc(lower[0], centre, upper[0]),
                occ.addSpline(upper),
                occ.addSpline([upper[-1], *upper_root]),
            ]
        )
        gaps.append((lower_root[-1], upper_root[-1]))
    joined = []
    for number in range(teeth):
        joined += curves[number]
        if not meeting:
            joined.append(occ.addCircleArc(gaps[number][1], centre, gaps[(number + 1) % teeth][0]))
    return joined


def _sector(occ, gear, number, reach, turn, height):
    """Add the curves of what is cut off a tooth: its sector from the radius that it reaches to beyond its tip."""
    half, radius = np.pi / float(gear["teeth"]), np.hypot(*np.asarray(gear["flank"]).T)
    beyond = (
        min(radius.min(), reach) - 0.1 * np.ptp(radius) if gear["internal"] else radius.max() + 0.1 * np.ptp(radius)
    )
    centre, middle = occ.addPoint(0.0, 0.0, height), turn + 2.0 * half * number
    corners = [
        [
            occ.addPoint(r * np.cos(middle + side * half), r * np.sin(middle + side * half), height)
            for side in (-1.0, 1.0)
        ]
        for r in (reach, beyond)
    ]
    (a, b), (c, d) = corners
    return [
        occ.addCircleArc(a, centre, b),
        occ.addLine(b, d),
        occ.addCircleArc(d, centre, c),
        occ.addLine(c, a),
    ]


def _body(occ, gear):
    """Add one gear with its first end at z = 0; returns the tag of its volume."""
    tag, width, twist = _whole_body(occ, gear), float(gear["width"]), float(gear["twist"])
    for number, reach in gear["short"]:
        if twist == 0.0:
            face = occ.addPlaneSurface([occ.addCurveLoop(_sector(occ, gear, number, reach, 0.0, 0.0))])
            cut = next(tag_ for dim, tag_ in occ.extrude([(2, face)], 0.0, 0.0, width) if dim == 3)
        else:
            count = max(SECTIONS, 1 + int(np.ceil(abs(twist) / STEP)))
            shares = np.linspace(0.0, 1.0, count)
            wires = [occ.addWire(_sector(occ, gear, number, reach, twist * s, width * s)) for s in shares]
            cut = next(tag_ for dim, tag_ in occ.addThruSections(wires, makeSolid=True) if dim == 3)
        tag = occ.cut([(3, tag)], [(3, cut)])[0][0][1]
    return tag


def _whole_body(occ, gear):
    """Add one gear with all its teeth as `_body`."""
    width, rim, internal, twist = float(gear["width"]), float(gear["rim"]), bool(gear["internal"]), float(gear["twist"])
    if twist == 0.0:
        teeth = occ.addCurveLoop(_outline(occ, gear, 0.0, 0.0))
        circle = occ.addCurveLoop([occ.addCircle(0.0, 0.0, 0.0, rim)])
        face = occ.addPlaneSurface([circle, teeth] if internal else [teeth, circle])
        return next(tag for dim, tag in occ.extrude([(2, face)], 0.0, 0.0, width) if dim == 3)
    count = max(SECTIONS, 1 + int(np.ceil(abs(twist) / STEP)))
    wires = [occ.addWire(_outline(occ, gear, twist * share, width * share)) for share in np.linspace(0.0, 1.0, count)]
    teeth = next(tag for dim, tag in occ.addThruSections(wires, makeSolid=True) if dim == 3)
    if internal:
        blank = occ.addCylinder(0.0, 0.0, 0.0, 0.0, 0.0, width, rim)
        return occ.cut([(3, blank)], [(3, teeth)])[0][0][1]
    bore = occ.addCylinder(0.0, 0.0, -1.0, 0.0, 0.0, width + 2.0, rim)
    return occ.cut([(3, teeth)], [(3, bore)])[0][0][1]


def write_solids(gmsh, job, path):
    """Write the gears in their places as a STEP file; returns the volumes."""
    occ, volumes, made = gmsh.model.occ, [], {}
    places = job["places"]
    for kind, x, y, z, angle in places:
        kind = int(kind)
        if kind not in made:
            names = ("teeth", "flank", "fillet", "root", "width", "rim", "internal", "twist", "short")
            made[kind] = _body(occ, {name: job[f"{name}_{kind}"] for name in names})
        tag = occ.copy([(3, made[kind])])[0][1]
        occ.rotate([(3, tag)], 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, angle)
        occ.translate([(3, tag)], x, y, z)
        volumes.append(tag)
    occ.remove([(3, tag) for tag in made.values()], recursive=True)
    occ.synchronize()
    for number, tag in enumerate(volumes):
        gmsh.model.setEntityName(3, tag, str(job["names"][number]))
    gmsh.write(path)
    return [occ.getMass(3, tag) for tag in volumes]


if __name__ == "__main__":
    try:
        import gmsh
    except (ImportError, OSError) as error:
        print(error, file=sys.stderr)
        sys.exit(3)
    with np.load(io.BytesIO(sys.stdin.buffer.read())) as file:
        job = dict(file)
    if hasattr(signal, "alarm"):  # ends the process even when the one that started it is gone
        signal.alarm(int(job["time_limit"]) + 5)
    gmsh.initialize(["femgear"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        result = write_solids(gmsh, job, sys.argv[1])
    except Exception as error:  # gmsh raises bare Exception
        print(str(error) or gmsh.logger.getLastError(), file=sys.stderr)
        sys.exit(4)
    finally:
        gmsh.finalize()
    print("volumes", *(f"{volume:.12g}" for volume in result))
