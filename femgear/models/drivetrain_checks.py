"""Refusals of drivetrain data."""

from __future__ import annotations

import itertools
import math

import numpy as np

from femgear.errors import CaseError

# Stiffness against the spin, over that of the rotations, that is rounding.
_FREE = 1e-9


def check_numbers(name: str, data, *, positive, least) -> None:
    """Refuse numbers that are not finite, not above zero, or below zero."""
    for key in (*positive, *least):
        value = getattr(data, key)
        if not math.isfinite(value) or value < 0.0 or (key in positive and value == 0.0):
            raise CaseError(
                f"{key} of {name} is {value}", code="E-DRIVETRAIN", key=key,
                limit="finite, above 0" if key in positive else "finite, 0 or more",
            )  # fmt: skip


def check_driver(name: str, driver: str | None, ends: tuple[str, str]) -> None:
    """Refuse a driver that is none of the two bodies of its stage."""
    if driver is not None and driver not in ends:
        raise CaseError(
            f"{driver!r} drives {name}", code="E-DRIVETRAIN", key="driver", limit=" or ".join(ends),
            remedy="name the body that drives, or leave it out",
        )  # fmt: skip


def check_free_spin(model) -> None:
    """Refuse a chain that turns in bearings with a torsion spring, which would not see the spin."""
    K, rigid = model.system.K, model.rigid
    if np.any(np.abs(K @ rigid) > _FREE * (np.abs(K) @ np.abs(rigid)).max(initial=0.0)):
        raise CaseError(
            "a bearing holds the rotation of a chain that turns", code="E-BEARING", key="bearing.torsion",
            limit="no torsion stiffness against the housing",
            remedy="leave it out; a torque on the body takes its place",
        )  # fmt: skip


def check_train(train) -> None:
    """Refuse unknown or repeated names, pieces that do not hang together, wrong ratios of damping."""
    names = [body.name for body in train.bodies]
    if not names or len(set(names)) < len(names):
        raise CaseError(f"bodies {names}", code="E-DRIVETRAIN", limit="one body or more, no name twice")
    links = [(one.first, one.second) for one in (*train.shafts, *train.parallel)]
    links += [(one.carrier, one.sun) for one in train.planetary]
    for first, second in (*links, *((one.body, one.body) for one in train.bearings)):
        for name in (first, second):
            if name not in names:
                raise CaseError(f"there is no body {name!r}", code="E-DRIVETRAIN", limit=", ".join(names))
    if any(first == second for first, second in links):
        raise CaseError("a shaft or stage joins a body to itself", code="E-DRIVETRAIN")
    reached = {names[0]}
    for _ in names:
        reached |= {end for link in links if reached & set(link) for end in link}
    if set(names) - reached:
        raise CaseError(
            f"nothing joins {', '.join(sorted(set(names) - reached))} to {names[0]}", code="E-DRIVETRAIN",
            remedy="add a shaft or a gear stage",
        )  # fmt: skip
    for stage in train.planetary:
        _check_planets(stage)
    if not 0.0 <= train.damping_ratio < 1.0 or not math.isfinite(train.gravity):
        raise CaseError(
            f"damping ratio {train.damping_ratio}, gravity {train.gravity} m/s^2", code="E-DRIVETRAIN",
            limit="a ratio from 0 to below 1, finite gravity",
        )  # fmt: skip


def _check_planets(stage) -> None:
    angles = stage.planet_angles
    if not angles or not all(math.isfinite(a) for a in angles) or not stage.planet_bearing > 0.0:
        raise CaseError(
            f"planets of {stage.name}", code="E-DRIVETRAIN",
            limit="one finite angle or more, a bearing stiffness above 0 N/m or infinite",
        )  # fmt: skip
    if any(b <= a for a, b in itertools.pairwise(angles)) or angles[-1] - angles[0] >= 2.0 * math.pi:
        raise CaseError(
            f"planet angles {angles} rad of {stage.name}", code="E-DRIVETRAIN",
            limit="ascending within one turn",
        )  # fmt: skip
