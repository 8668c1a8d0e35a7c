"""What the housing functions refuse before they compute, and how the sensor moves past the field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError


@dataclass(frozen=True)
class Motion:
    """How the sensor moves past the carrier-frame field: direction +1, 0, -1 and the speed orders count."""

    direction: int
    base_speed: np.ndarray


def read_only(obj, *names: str) -> None:
    """Replace the named fields of a frozen dataclass by read-only arrays of their own."""
    for name in names:
        array = np.array(getattr(obj, name))
        array.setflags(write=False)
        object.__setattr__(obj, name, array)


def checked_field(field) -> tuple[np.ndarray, np.ndarray]:
    """The field as a complex array and its circumferential orders n = -n_max..n_max."""
    field = np.asarray(field, dtype=complex)
    if field.ndim < 2 or field.size == 0 or field.shape[-1] % 2 == 0 or not np.all(np.isfinite(field)):
        raise CaseError(
            f"the carrier-frame field of shape {field.shape} is not usable",
            code="E-FIELD",
            limit="finite values of shape (..., H + 1, 2 n_max + 1)",
            remedy="give one column for every n = -n_max..n_max",
        )
    n_max = field.shape[-1] // 2
    return field, np.arange(-n_max, n_max + 1)


def checked_angle(angle: float) -> float:
    if not np.isfinite(angle):
        raise CaseError(
            f"the angle {angle} is not a number of radians",
            code="E-ANGLE",
            key="housing.sensor_angle",
            value=angle,
            limit="a finite angle",
            remedy="give an angle such as 0.5",
        )
    return float(angle)


def check_points(points: int) -> None:
    if points != int(points) or points < 3:
        raise CaseError(
            f"{points} points do not describe a ring",
            code="E-POINTS",
            key="housing.points",
            value=points,
            limit="an integer of at least 3, more than twice the largest nodal diameter that matters",
            remedy="use 54 or more, a multiple of the number of planets",
        )


def check_teeth(z_ring: int) -> None:
    if z_ring != int(z_ring) or z_ring < 1:
        raise CaseError(
            f"{z_ring} ring teeth do not give a mesh order",
            code="E-TEETH",
            key="ring.teeth",
            value=z_ring,
            limit="a positive integer",
            remedy="give the number of teeth of the ring",
        )


def motion_of(field: np.ndarray, z_ring: int, carrier_speed, mesh_frequency) -> Motion:
    """Direction and base speed, refusing what the order analysis cannot express."""
    check_teeth(z_ring)
    speed = np.asarray(carrier_speed, dtype=float)
    direction = np.unique(np.sign(speed))
    if speed.shape != field.shape[:-2] or not np.all(np.isfinite(speed)) or direction.size != 1:
        raise CaseError(
            f"carrier speeds of shape {speed.shape}, directions {direction.tolist()}, do not fit the field",
            code="E-SPEED",
            value=carrier_speed,
            limit=f"finite speeds of shape {field.shape[:-2]}, all of one direction",
            remedy="one speed for every field; split a sweep where the carrier changes direction",
        )
    expected = z_ring * np.abs(speed)
    given = expected if mesh_frequency is None else 2 * np.pi * np.asarray(mesh_frequency, dtype=float)
    standing = direction[0] == 0
    if given.shape != speed.shape or not np.all(given > 0) or not np.all(np.isfinite(given)):
        raise CaseError(
            "the mesh frequency is missing or not positive"
            if standing
            else "the mesh frequency is not usable",
            code="E-SPEED",
            value=mesh_frequency,
            limit=f"positive mesh frequencies [Hz] of shape {speed.shape}",
            remedy="give mesh_frequency: a carrier that stands still does not tell it",
        )
    if not standing and not np.allclose(given, expected, rtol=1e-6, atol=0):
        raise CaseError(
            "the mesh frequency is not that of a fixed ring, and a housing sensor does not ride on another",
            code="E-SPEED",
            value=mesh_frequency,
            limit="z_ring |carrier_speed| / (2 pi)",
            remedy="use a set whose ring or carrier is fixed",
        )
    return Motion(int(direction[0]), given / z_ring)


def top_order(field: np.ndarray, z_ring: int, max_order: int | None) -> int:
    harmonics, n_max = field.shape[-2] - 1, field.shape[-1] // 2
    top = max((harmonics + 1) * z_ring, harmonics * z_ring + n_max) if max_order is None else max_order
    if top != int(top) or top < 1:
        raise CaseError(
            f"{max_order} is not a highest carrier order",
            code="E-ORDERS",
            key="max_order",
            value=max_order,
            limit="a positive integer",
            remedy="leave it out for (H + 1) z_ring",
        )
    return int(top)
