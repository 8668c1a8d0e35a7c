"""Where the motion of a drivetrain begins."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain_separation import ContactLaw, solve_contact

# Stiffness of a parted mesh over its own: bodies that it alone holds stay findable.
_SLIGHT = 1e-12
# Force that this stiffness may carry, over those of the loads.
_CARRIED = 1e-6


def start_state(model, scheme, track, start, *, contacts=None) -> np.ndarray:
    """State ``(q, v, g)`` at the first instant; `track` stays there.

    With `contacts` (`femgear.models.drivetrain_contacts`), to which `scheme` and `track` belong then, meshes
    separate.

    Raises
    ------
    CaseError
        A start that is none, or loads that part flanks behind which nothing holds the gears (E-START).
    """
    n, U = scheme.n, scheme.basic
    angle, speed = track.angle, track.speed
    block = track.block(0, 1)
    track.angle, track.speed = angle, speed
    S, k = block.selection[0], block.stiffness[0]
    if isinstance(start, str):
        q, v = np.zeros((2, n))
        if start == "static":
            load = track.directions @ block.loads[0]
            load = load - track.carried * (model.rigid @ load) / track.inertia
            q = static_deviations(model, U @ S, k, load, contacts=contacts)
        elif start != "zero":
            raise CaseError(f"a start {start!r}", code="E-START", limit="static, zero or two arrays")
    else:
        q, v = (np.asarray(one, float) for one in start)
        if q.shape != (n,) or v.shape != (n,):
            raise CaseError(f"a start of shapes {q.shape}, {v.shape}", code="E-START", limit=f"two ({n},)")
    approach = (U @ S).T @ q
    force = k * (approach if contacts is None else np.maximum(approach - contacts.gap, 0.0))
    return np.concatenate([q, v, S @ force])


def static_deviations(model, W, k, load, *, contacts=None) -> np.ndarray:
    """Deviations (n,) under a load that does not drive the spin, meshes or contacts W (n, c) at one instant.

    Drive flanks that part, and back flanks that touch, are found as corrections of drive flanks that all
    touch.
    """
    meshes = len(model.meshes)
    drive, stiffness = W[:, :meshes], k[:meshes]
    carried, total = model.system.M @ model.rigid, model.system.K + (drive * stiffness) @ drive.T
    size = (np.abs(total).max() or 1.0) / np.abs(carried).max() ** 2
    flexible = np.linalg.inv(total + size * np.outer(carried, carried))
    q = flexible @ load
    if contacts is None:
        return q
    free, first = W.T @ q - contacts.gap, np.arange(len(k)) < meshes
    if np.array_equal(free >= 0.0, first):
        return q
    law = ContactLaw(np.where(first, 0.0, k), np.where(first, -(1.0 - _SLIGHT) * k, 0.0))
    drawn = flexible @ W
    u, closed = solve_contact(W.T @ drawn, free, law, first)
    loose = _SLIGHT * stiffness * np.abs(u[:meshes])
    loose[closed[:meshes] | np.isfinite(model.backlash)] = 0.0
    scale = (k * (np.abs(W).T @ (np.abs(flexible) @ np.abs(load)))).max()
    if loose.max() > _CARRIED * scale:
        raise CaseError(
            f"the first loads part the flanks of {model.meshes[int(np.argmax(loose))]}, and nothing else"
            " holds the gears", code="E-START", limit="loads that close the drive flanks, or a backlash",
            remedy="name the driver of the stage that these loads press, give the mesh a backlash, or"
            " start = \"zero\"",
        )  # fmt: skip
    return q - drawn @ (law.slopes(closed) * u)
