"""Where the motion of a drivetrain begins."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain_meshes import mesh_force
from femgear.models.drivetrain_separation import DRIVE, OPEN, PieceLaw, solve_contact

# Stiffness of a parted mesh over its own: bodies that it alone holds stay findable.
_SLIGHT = 1e-12
# Force that this stiffness may carry, over those of the loads.
_CARRIED = 1e-6


def start_state(model, scheme, track, start, *, contact_loss: bool) -> np.ndarray:
    """State ``(q, v, g)`` at the first instant; `track` stays there.

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
            q = static_deviations(model, U @ S, k, load, contact_loss=contact_loss)
        elif start != "zero":
            raise CaseError(f"a start {start!r}", code="E-START", limit="static, zero or two arrays")
    else:
        q, v = (np.asarray(one, float) for one in start)
        if q.shape != (n,) or v.shape != (n,):
            raise CaseError(f"a start of shapes {q.shape}, {v.shape}", code="E-START", limit=f"two ({n},)")
    force, _ = mesh_force((U @ S).T @ q, k, model.backlash, separates=contact_loss)
    return np.concatenate([q, v, S @ force])


def static_deviations(model, W, k, load, *, contact_loss: bool) -> np.ndarray:
    """Deviations (n,) under a load that does not drive the spin, meshes W (n, n_meshes) at one instant.

    Meshes that part are found as corrections ``r(x) = force(x) - k x`` of those that do not.
    """
    carried, total = model.system.M @ model.rigid, model.system.K + (W * k) @ W.T
    size = (np.abs(total).max() or 1.0) / np.abs(carried).max() ** 2
    flexible = np.linalg.inv(total + size * np.outer(carried, carried))
    q = flexible @ load
    x = W.T @ q
    if not contact_loss or not np.any(x < 0.0):
        return q
    law = PieceLaw(np.zeros_like(k), -(1.0 - _SLIGHT) * k, model.backlash, k)
    drawn = flexible @ W
    x, status = solve_contact(W.T @ drawn, x, law, np.full(len(k), DRIVE))
    loose = np.where((status == OPEN) & np.isinf(model.backlash), _SLIGHT * k * np.abs(x), 0.0)
    scale = (k * (np.abs(W).T @ (np.abs(flexible) @ np.abs(load)))).max()
    if loose.max() > _CARRIED * scale:
        raise CaseError(
            f"the first loads part the flanks of {model.meshes[int(np.argmax(loose))]}, and nothing else"
            " holds the gears", code="E-START", limit="loads that close the drive flanks, or a backlash",
            remedy="turn the torques or the speed, give the mesh a backlash, or start = \"zero\"",
        )  # fmt: skip
    slope, offset = law.pieces(status)
    return q - drawn @ (slope * x + offset)
