"""Runs Gmsh on one prepared outline, in a process of its own: ``python _gmsh_worker.py < IN.npz > OUT.npz``.

Gmsh has one global model, does not return on some outlines and installs signal handlers; in a process
that can be killed none of this matters. Only gmsh and numpy are imported, never femgear.
Exit codes: 0 done; 3 gmsh cannot be imported; 4 gmsh refused the outline.
"""

import io
import os
import signal
import sys

import numpy as np


def triangulate(gmsh, job):
    """Make first-order triangles of all faces of a job [m]; the nodes of the outline come first."""
    points, segments = job["points"], job["segments"]
    loops = np.split(job["loops"], job["loop_ends"][:-1])
    settings = {
        "General.Terminal": 0,
        "General.NumThreads": 1,
        "Mesh.RandomSeed": 1,
        "Mesh.Algorithm": 6,
        "Mesh.MeshSizeFromPoints": 0,
        "Mesh.MeshSizeFromCurvature": 0,
        "Mesh.MeshSizeExtendFromBoundary": 1,
    }
    for name, value in settings.items():
        gmsh.option.setNumber(name, value)
    geo = gmsh.model.geo
    for tag, (x, y) in enumerate(points, start=1):
        geo.addPoint(x, y, 0.0, tag=tag)
    for tag, (start, end) in enumerate(segments + 1, start=1):
        geo.addLine(int(start), int(end), tag=tag)
        geo.mesh.setTransfiniteCurve(tag, 2)
    for tag, loop in enumerate(loops, start=1):
        geo.addCurveLoop([int(s) for s in loop], tag=tag)
        geo.addPlaneSurface([tag], tag=tag)
    geo.synchronize()
    gmsh.model.mesh.generate(2)
    return _collect(gmsh, len(points), len(loops))


def _collect(gmsh, n_outline, n_faces):
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    number = np.full(int(tags.max()) + 1, -1)
    for i in range(n_outline):
        number[int(gmsh.model.mesh.getNodes(0, i + 1)[0][0])] = i
    inner = tags[number[tags.astype(int)] < 0].astype(int)
    number[inner] = n_outline + np.arange(len(inner))
    points = np.empty((len(tags), 2))
    points[number[tags.astype(int)]] = coordinates.reshape(-1, 3)[:, :2]
    triangles, face = [], []
    for k in range(n_faces):
        kinds, _, nodes = gmsh.model.mesh.getElements(2, k + 1)
        if list(kinds) != [2]:
            raise RuntimeError(f"surface {k + 1} holds no triangles")
        triangles.append(number[nodes[0].astype(int)].reshape(-1, 3))
        face.append(np.full(len(triangles[-1]), k))
    return {"points": points, "triangles": np.vstack(triangles), "face": np.concatenate(face)}


def answer(source, target):
    """Triangulate the job of one ``.npz`` stream into another; returns 0, 3 without Gmsh, 4 if it fails."""
    with np.load(io.BytesIO(source.read())) as file:
        job = dict(file)
    if hasattr(signal, "alarm"):  # ends the process even when the one that started it is gone
        signal.alarm(int(job["time_limit"]) + 5)
    try:
        import gmsh
    except (ImportError, OSError) as error:
        print(error, file=sys.stderr)
        return 3
    gmsh.initialize(["femgear"], readConfigFiles=False, interruptible=False)
    try:
        result = triangulate(gmsh, job)
    except Exception as error:  # gmsh raises bare Exception
        print(str(error) or gmsh.logger.getLastError(), file=sys.stderr)
        return 4
    finally:
        gmsh.finalize()
    data = io.BytesIO()
    np.savez(data, **result)
    target.write(data.getvalue())
    return 0


if __name__ == "__main__":
    # whatever Gmsh prints goes to standard error: standard output holds the grid
    with open(os.dup(1), "wb") as output:
        os.dup2(2, 1)
        sys.exit(answer(sys.stdin.buffer, output))
