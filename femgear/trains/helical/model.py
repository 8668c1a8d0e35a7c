"""Helical planetary set of rigid bodies that move in space: its data, and the excitation by helical teeth.

Carrier, ring, sun and N planets have three translations and three rotations each, 6 (N + 3) coordinates.
A. Kahraman, Planetary Gear Train Dynamics, J. Mech. Des. 116, 1994, 713-720: rigid bodies, gear meshes as
springs along the tooth normals, supports and planet pins in all directions, without terms of the carrier's
speed. The matrices are those of `femgear.system.assembler.gear_set_system`; with the meshes as elements,
`femgear.trains.gear_set.gear_set_problem`, they have a stiffness that changes, play and contact loss.

The mesh stiffness follows from that of spur teeth. A helical gear is cut across its axis into thin slices,
each of them a spur gear that is turned by the helix against its neighbour, and the slices carry side by side
without any coupling between them (thin-slice approximation, J. D. Smith, Gear Noise and Vibration, 2nd ed.,
2003). It leaves out that loaded slices draw unloaded neighbours along, and that teeth are softer at their
ends. Each slice has the stiffness of the spur gear of its normal section, per length of the contact line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from femgear.errors import CaseError
from femgear.gears import profile
from femgear.system.rigid_bodies import (
    ContactLines,
    HelicalSupport,
    RigidSet,
    check_support,
)
from femgear.system.system import MeshExcitation

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

# Rounded numbers miss each other by less than 1 %, other distances or angles than those of the gears by more.
_CLOSURE = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class HelicalSet(RigidSet):
    """Data of the helical set; the centres of all bodies lie in one plane.

    Bodies, radii, angles and mesh stiffnesses as in `RigidSet`; a stiffness of zero leaves a mesh out.

    Parameters
    ----------
    base_helix_angle : float
        Angle of the tooth normals to the transverse section [rad], beta_b with ``sin beta_b = sin beta cos
        alpha_n``; positive for a right-handed sun, whose planets and ring are then left-handed.
    planet_bearing : HelicalSupport
        Between planet and carrier, of numbers or (N,) arrays; infinite ties the planet to its pin.
    contact_points : {"pitch_point", "base_circles"}
        Where the mesh force acts in the transverse section. ``pitch_point``: on both gears at the pitch
        point. ``base_circles``: on each gear where the line of action touches its own base circle, as in
        A. Kahraman, J. Mech. Des. 116, 1994, 713-720 (Eqs. 7a, 7b: arms of base radii); the two points
        differ, so that a common tilt of both gears strains the mesh.
    slices : int
        Number S of equal slices of the face width, each of them one column of ``W`` with ``1/S`` of the
        stiffness, at mid-height of the slice.
    face_width : float
        [m], needed for more than one slice.

    Raises
    ------
    CaseError
        As `RigidSet`, and radii, centre distance and pressure angles that miss each other by more than 10 %
        (E-RANGE). `closure` tells by how much they do.
    """

    directions: ClassVar[dict[str, tuple[int, ...]]] = {
        "{}, radial": (0, 1),
        "{}, axial": (2,),
        "{}, tilt": (3, 4),
        "{}, torsional": (5,),
    }

    base_helix_angle: float
    planet_bearing: HelicalSupport
    contact_points: Literal["pitch_point", "base_circles"] = "pitch_point"
    slices: int = 1
    face_width: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        check_support("planet_bearing", self.planet_bearing, count=self.n_planets)
        worst = max(self.closure, key=abs)
        if abs(worst) > _CLOSURE:
            raise CaseError(
                f"centre distance of {self.centre_distance} m", code="E-RANGE", key="centre_distance",
                value=self.centre_distance,
                limit=f"(r_s + r_p) / cos alpha_sp and (r_r - r_p) / cos alpha_pr, within {_CLOSURE:.0%}",
                remedy=f"radii, centre distance and pressure angles miss each other by {abs(worst):.3g}",
            )  # fmt: skip

    @property
    def column_stiffness(self) -> np.ndarray:
        """Mean stiffness of the 2N S columns of ``W`` [N/m], the slices of a mesh side by side."""
        return np.repeat(self.mesh_stiffness, self.slices) / self.slices

    @property
    def slice_heights(self) -> np.ndarray:
        """Height (S,) of the slices above mid-face [m]."""
        return self.face_width * ((np.arange(self.slices) + 0.5) / self.slices - 0.5)

    @property
    def pin_stiffness(self) -> np.ndarray:
        """Of the planet bearings, (N, 6): radial, tangential, axial [N/m], two tilts, torsional [N m/rad]."""
        return np.broadcast_to(self.planet_bearing.stiffness, (self.n_planets, 6))

    @property
    def contact_lines(self) -> ContactLines:
        """Helix, slices and contact points of the meshes."""
        heights = tuple(self.slice_heights.tolist())
        return ContactLines(self.base_helix_angle, heights, self.contact_points == "base_circles")


def contact_ratios(planetary_set: PlanetarySet, *, helix_angle: float, face_width: float) -> np.ndarray:
    """Compute the transverse and overlap contact ratio (2, 2) of the sun-planet and the planet-ring mesh.

    ``eps_gamma = eps_alpha + eps_beta``, ``eps_beta = b sin|beta| / (pi m_n)`` (ISO 21771, sections 5.4.2.3
    and 5.4.4); a row is one mesh.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Its gears in the transverse section.
    helix_angle : float
        [rad]
    face_width : float
        That both gears of a mesh have in common [m].
    """
    s = planetary_set
    normal_module = s.sun.module * math.cos(helix_angle)
    overlap = profile.overlap_ratio(face_width, normal_module, helix_angle)
    return np.array([[s.contact_ratio_sun_planet, overlap], [s.contact_ratio_planet_ring, overlap]])


def helical_excitation(
    record: MeshExcitation, overlap_ratio, *, slices: int = 1, hand: int = 1
) -> MeshExcitation:
    """Make the record of helical meshes, or of their slices, from that of spur meshes of the same period.

    Height z above mid-face runs ahead of it by ``eps_beta z / b`` mesh periods, so that

    ``k(tau) = 1 / eps_beta int k_spur(tau + s) ds``, s from ``-eps_beta / 2`` to ``eps_beta / 2``,

    which multiplies harmonic h by ``sin(pi h eps_beta) / (pi h eps_beta)``: nothing is left of it where
    ``h eps_beta`` is a whole number. Tangent lines add up: the mesh force is the mean of the forces of the
    slices, and the deflection at which their tangents together carry it is the mean weighted by stiffness.

    Parameters
    ----------
    record : MeshExcitation or MeshCycle
        Of the spur gears of the normal section, all of it loaded as the whole helical mesh; stiffnesses and
        deflections along the tooth normals. Their teeth are as long as the contact lines, so that the face
        width is ``b / cos beta_b`` (ISO 6336-1, method B: ``c' b cos beta_b`` in the transverse section).
        Mesh phases are those at mid-face. A `femgear.contact.cycle.MeshCycle` knows no backlash, which is
        then zero.
    overlap_ratio : float or (n_meshes,) array
        eps_beta, 0 or more.
    slices : int
        Number S of equal slices of the face width; each has a row of its own with its part of stiffness and
        force, in the order of the columns of `mesh_directions`.
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
        A slice that loses its stiffness (E-STIFFNESS).
    """
    count = len(record.stiffness)
    overlap = np.broadcast_to(np.asarray(overlap_ratio, float), count)
    ahead = slice_phases(np.zeros(count), overlap, slices=slices, hand=hand).reshape(count, slices)
    backlash = np.broadcast_to(getattr(record, "backlash", 0.0), count)
    filtered = [
        _sliced(values, record.periods, ahead, overlap / slices) / slices
        for values in (record.stiffness, record.force, record.stiffness * record.deflection)
    ]
    stiffness, force, weighted = (values.reshape(-1, values.shape[-1]) for values in filtered)
    if np.any(stiffness <= 0.0):
        raise CaseError(
            "the spur record has positions without stiffness for a whole slice", code="E-STIFFNESS",
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
    """Compute phases (n_meshes S,) of the slices of meshes, as fractions of the mesh period.

    Parameters
    ----------
    phases : (n_meshes,) array
        At mid-face.
    overlap_ratio, slices, hand
        See `helical_excitation`.
    """
    phases = np.asarray(phases, float)
    overlap = np.broadcast_to(np.asarray(overlap_ratio, float), len(phases))
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
