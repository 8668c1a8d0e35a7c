"""Mesh stiffness of helical teeth from that of spur teeth: thin slices that follow each other.

A helical gear is cut across its axis into thin slices, each of them a spur gear that is turned by the helix
against its neighbour, and the slices carry side by side without any coupling between them (thin-slice
approximation, J. D. Smith, Gear Noise and Vibration, 2nd ed., 2003). It leaves out that loaded slices draw
unloaded neighbours along, and that teeth are softer at their ends. Each slice has the stiffness of the spur
gear of its normal section, per length of the contact line.
"""

from __future__ import annotations

import math

import numpy as np

from femgear.errors import CaseError
from femgear.system import MeshExcitation


def contact_line_width(face_width: float, base_helix_angle: float) -> float:
    """``b / cos beta_b`` [m]: face width of the spur gear of the normal section whose record is sliced.

    Its teeth are as long as the contact lines of the helical gear. With the stiffness c' per length along
    the tooth normals, the mesh has ``c' b / cos beta_b`` along the normal, hence ``c' b cos beta_b`` in the
    transverse section, as ISO 6336-1, method B, has it.
    """
    return face_width / math.cos(base_helix_angle)


def helical_excitation(
    record: MeshExcitation, overlap_ratio, *, slices: int = 1, hand: int = 1
) -> MeshExcitation:
    """Record of helical meshes, or of their slices, from that of spur meshes with the same mesh period.

    Height z above mid-face runs ahead of it by ``eps_beta z / b`` mesh periods, so that

    ``k(tau) = 1 / eps_beta int k_spur(tau + s) ds``, s from ``-eps_beta / 2`` to ``eps_beta / 2``,

    which multiplies harmonic h by ``sin(pi h eps_beta) / (pi h eps_beta)``: nothing is left of it where
    ``h eps_beta`` is a whole number. Tangent lines add up: the mesh force is the mean of the forces of the
    slices, and the deflection at which their tangents together carry it is the mean weighted by stiffness.

    Parameters
    ----------
    record : MeshExcitation or MeshCycle
        Of the spur gears of the normal section with the face width `contact_line_width`, all of it loaded as
        the whole helical mesh; stiffnesses and deflections along the tooth normals. Mesh phases are those at
        mid-face. A `MeshCycle` knows no backlash, which is then zero.
    overlap_ratio : float or (n_meshes,) array
        eps_beta, 0 or more.
    slices : int
        Number S of equal slices of the face width; each has a row of its own with its part of stiffness and
        force, in the order of the columns of `femgear.models.helical.mesh_directions`.
    hand : {1, -1}
        1 where height +z runs ahead: a right-handed sun that turns counter-clockwise against the carrier, or
        a left-handed one that turns clockwise. Only slices see it.

    Returns
    -------
    MeshExcitation
        (n_meshes S) rows.

    Raises
    ------
    CaseError
        Overlap ratios, slices or a hand that cannot be (E-HELICAL), a slice that loses its stiffness
        (E-MESH-STIFFNESS).
    """
    count = len(record.stiffness)
    ahead = slice_phases(np.zeros(count), overlap_ratio, slices=slices, hand=hand).reshape(count, slices)
    overlap = _overlap(overlap_ratio, count)
    backlash = np.broadcast_to(getattr(record, "backlash", 0.0), count)
    filtered = [
        _sliced(values, record.periods, ahead, overlap / slices) / slices
        for values in (record.stiffness, record.force, record.stiffness * record.deflection)
    ]
    stiffness, force, weighted = (values.reshape(-1, values.shape[-1]) for values in filtered)
    if np.any(stiffness <= 0.0):
        raise CaseError(
            "the spur record has positions without stiffness for a whole slice", code="E-MESH-STIFFNESS",
            remedy="give a record whose meshes stay closed",
        )  # fmt: skip
    return MeshExcitation(
        stiffness=stiffness,
        deflection=weighted / stiffness,
        force=force,
        backlash=np.repeat(backlash, slices),
        periods=record.periods,
    )


def slice_phases(phases, overlap_ratio, *, slices: int, hand: int = 1) -> np.ndarray:
    """Phases (n_meshes S,) of the slices of meshes, as fractions of the mesh period.

    Parameters
    ----------
    phases : (n_meshes,) array
        At mid-face.
    overlap_ratio, slices, hand
        See `helical_excitation`.
    """
    phases = np.asarray(phases, float)
    overlap = _overlap(overlap_ratio, len(phases))
    if isinstance(slices, bool) or int(slices) != slices or slices < 1:
        raise CaseError(f"{slices} slices of the face width", code="E-HELICAL", limit="1 or more")
    if hand not in (1, -1):
        raise CaseError(f"a hand of {hand}", code="E-HELICAL", limit="1 or -1")
    height = (np.arange(slices) + 0.5) / slices - 0.5
    return (phases[:, None] + hand * overlap[:, None] * height).ravel()


def _sliced(values: np.ndarray, periods: int, ahead: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Means (n, S, P) of (n, P) samples of `periods` mesh periods over windows of `width` around `ahead`.

    Exact for the trigonometric polynomial through the samples.
    """
    count = values.shape[-1]
    order = np.fft.rfftfreq(count, 1.0 / count) / periods  # in cycles a mesh period
    shift = np.exp(2j * np.pi * order * ahead[..., None]) * np.sinc(order * width[:, None, None])
    return np.fft.irfft(np.fft.rfft(values)[:, None] * shift, n=count)


def _overlap(overlap_ratio, meshes: int) -> np.ndarray:
    overlap = np.asarray(overlap_ratio, float)
    if overlap.shape not in ((), (meshes,)) or not np.all(np.isfinite(overlap)) or np.any(overlap < 0.0):
        raise CaseError(
            f"overlap ratios {overlap.tolist()}", code="E-HELICAL", key="overlap_ratio",
            limit=f"one number of 0 or more, or {meshes}", remedy="give b sin|beta| / (pi m_n)",
        )  # fmt: skip
    return np.broadcast_to(overlap, (meshes,))
