"""Helical planetary set of rigid bodies that move in space: the set of a case, and what its teeth excite.

Carrier, ring, sun and N planets have three translations and three rotations each, 6 (N + 3) coordinates. A.
Kahraman, Planetary Gear Train Dynamics, J. Mech. Des. 116, 1994, 713-720: rigid bodies, gear meshes as
springs along the tooth normals, supports and planet pins in all directions, without terms of the carrier's
speed. The matrices are those of `femgear.system.mesh_directions.gear_set_system`; with the meshes as
elements, `femgear.stages.lumped_set.gear_set_problem`, they have a stiffness that changes, play and contact loss.

The mesh stiffness follows from that of spur teeth. Teeth are solved as spur gears of the transverse section;
those of the normal section, the virtual gears, tell by how much their stiffness differs. A helical gear is
cut across its axis into thin slices, each of them a spur gear that is turned by the helix against its
neighbour, and the slices carry side by side without any coupling between them (thin-slice approximation,
J. D. Smith, Gear Noise and Vibration, 2nd ed., 2003). It leaves out that loaded slices draw unloaded
neighbours along, and that teeth are softer at their ends. Each slice has the stiffness of the spur gear of
its normal section, per length of the contact line.

Refused before anything is computed are supports that are missing and torques too large. Planets that tilt on their pins
under the thrust of their teeth are a doubt of safeties without K_Hbeta (ISO 6336-1, method C).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NoReturn

import numpy as np

from femgear.case.fault_sections import no_faults
from femgear.case.gear_set import materials_of, planetary_set, support_stiffness
from femgear.case.tooth_friction import no_acting_friction
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import walk_mesh_cycle
from femgear.errors import CaseError, ConvergenceError, GeometryError
from femgear.findings import Finding, percent
from femgear.gears import profile
from femgear.gears.iso6336_load import face_load_factor
from femgear.gears.iso6336_stiffness import BENDING_SHARE, material_factor, pair_mesh_stiffness
from femgear.gears.kinematics import torques
from femgear.gears.pair import BRANCH
from femgear.gears.planetary import virtual_set
from femgear.solvers.linear.modal import undamped_modes
from femgear.stages.lumped_set import check_one_period, driving_torque, mesh_stiffnesses, needed, torsional_support
from femgear.stages.protocol import one_blas_thread
from femgear.stages.static_results import set_warnings, thrust_words
from femgear.stages.strength import rating_wanted
from femgear.system.mesh_directions import gear_set_system
from femgear.system.rigid_bodies import (
    ContactLines,
    HelicalBody,
    HelicalSupport,
    RigidSet,
    check_support,
    gear_geometry,
    refuse,
)
from femgear.system.system import MeshExcitation
from femgear.trains.helical.section import HelicalCase

if TYPE_CHECKING:
    from femgear.contact.mesh_cycle import MeshCycle
    from femgear.gears.planetary import PlanetarySet

# Rounded numbers miss each other by less than 1 %, other distances or angles than those of the gears by more.
_CLOSURE = 0.1
# both sections are solved on the same grid, and only the ratio of their stiffnesses counts
_FLANK_ELEMENTS, _POSITIONS = 8, 16
# any stiffness shows whether something takes up the load [N/m, N m/rad]
_TRIAL = 1e8
# entries of the supports that helical teeth ask for, their directions, and what they take up
_AXES = {"axial_stiffness": ("axial", "thrust"), "tilt_stiffness": ("tilt", "tilting moments")}
# c' of steel teeth [N/m^2] (ISO 6336-1, method B); what teeth give way by
# before nothing is left of their contact [modules]
_TOOTH, _MOST = 14e9, 0.25
# K_Hbeta of tilted planets that safeties may leave out: 5 % of S_F, half of it of S_H
_TILTED = 1.05


@dataclass(frozen=True, kw_only=True, eq=False)
class HelicalSet(RigidSet):
    """Data of the helical set; the centres of all bodies lie in one plane.

    Bodies, radii, angles and mesh stiffnesses as in `RigidSet`; a stiffness of zero leaves a mesh out.

    CaseError: as `RigidSet`, and radii, centre distance and pressure angles that miss each other by more than
    10 % (E-RANGE). `closure` tells by how much they do.

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
    """

    base_helix_angle: float
    planet_bearing: HelicalSupport
    contact_points: Literal["pitch_point", "base_circles"] = "pitch_point"
    slices: int = 1
    face_width: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        check_support("planet_bearing", self.planet_bearing, count=self.n_planets)
        if self.contact_points not in ("pitch_point", "base_circles"):
            refuse("contact_points", repr(self.contact_points), "", "pitch_point or base_circles")
        if not abs(self.base_helix_angle) < 0.5 * math.pi:
            refuse("base_helix_angle", self.base_helix_angle, "rad", "between -pi/2 and pi/2")
        worst = max(self.closure, key=abs)
        if abs(worst) > _CLOSURE:
            raise CaseError(
                f"centre distance of {self.centre_distance} m",
                code="E-RANGE",
                key="centre_distance",
                value=self.centre_distance,
                limit=f"(r_s + r_p) / cos alpha_sp and (r_r - r_p) / cos alpha_pr, within {percent(_CLOSURE)}",
                remedy=f"radii, centre distance and pressure angles miss each other by {abs(worst):.3g}",
            )

    @property
    def column_stiffness(self) -> np.ndarray:
        """Mean stiffness (2N S,) of the columns of ``W`` [N/m], the slices of a mesh side by side."""
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


def helical_data(case: HelicalCase, gears: PlanetarySet, mesh_stiffness=None) -> HelicalSet:
    """Make the helical set of a case: bodies and supports of its entries, radii and angles of its gears.

    The gears are those of the transverse section; mean stiffnesses (2N,) along the tooth normals [N/m] are
    taken where the case gives none.
    """
    helical = case.helical
    bodies = {}
    for name, section in (("sun", case.sun), ("ring", helical.ring), ("carrier", case.carrier)):
        space = getattr(helical, name)
        torsional = torsional_support(case, name, space.torsional_stiffness)
        radial = needed(support_stiffness(case, name, section), f"{name}.support_stiffness")
        support = HelicalSupport(radial, space.axial_stiffness, space.tilt_stiffness, torsional)
        bodies[name] = HelicalBody(section.mass, section.inertia, space.diametral_inertia, support)
    pin = helical.planet
    return HelicalSet(
        **gear_geometry(gears),
        base_helix_angle=profile.base_helix_angle(case.sun.pressure_angle, helical.signed_helix_angle),
        **bodies,
        planet=HelicalBody(case.planet.mass, case.planet.inertia, pin.diametral_inertia),
        **mesh_stiffnesses(helical.mesh_stiffness, mesh_stiffness),
        planet_bearing=HelicalSupport(
            case.planet.bearing_stiffness,
            pin.axial_stiffness,
            pin.tilt_stiffness,
            pin.torsional_stiffness or 0.0,
        ),
        contact_points=helical.contact_points,
        slices=helical.slices,
        face_width=min(gears.mesh_widths),
    )


def contact_ratios(planetary_set: PlanetarySet, *, helix_angle: float) -> np.ndarray:
    """Compute the transverse and overlap contact ratio (2, 2) of the sun-planet and the planet-ring mesh.

    ``eps_gamma = eps_alpha + eps_beta``, ``eps_beta = b sin|beta| / (pi m_n)`` (ISO 21771, sections 5.4.2.3
    and 5.4.4); a row is one mesh. The gears are those of the transverse section, ``b`` is the
    face width that both gears of a mesh have in common; helix angle in rad.
    """
    s = planetary_set
    normal_module = s.sun.module * math.cos(helix_angle)
    overlap = [profile.overlap_ratio(width, normal_module, helix_angle) for width in s.mesh_widths]
    return np.array([[s.contact_ratio_sun_planet, s.contact_ratio_planet_ring], overlap]).T


def helical_excitation(record: MeshExcitation, overlap_ratio, *, slices: int = 1, hand: int = 1) -> MeshExcitation:
    """Make the record of helical meshes, or of their slices, from that of spur meshes of the same period.

    Height z above mid-face runs ahead of it by ``eps_beta z / b`` mesh periods, so that

    ``k(tau) = 1 / eps_beta int k_spur(tau + s) ds``, s from ``-eps_beta / 2`` to ``eps_beta / 2``,

    which multiplies harmonic h by ``sin(pi h eps_beta) / (pi h eps_beta)``: nothing is left of it where
    ``h eps_beta`` is a whole number. Tangent lines add up: the mesh force is the mean of the forces of the
    slices, and the deflection at which their tangents together carry it is the mean weighted by stiffness.

    CaseError: a slice that loses its stiffness (E-STIFFNESS).

    Parameters
    ----------
    record : MeshExcitation
        Of the spur gears of the normal section, all of it loaded as the whole helical mesh; stiffnesses and
        deflections along the tooth normals. Their teeth are as long as the contact lines, so that the face
        width is ``b / cos beta_b`` (ISO 6336-1, method B: ``c' b cos beta_b`` in the transverse section).
        Mesh phases are those at mid-face.
    overlap_ratio : float or (n_meshes,) array
        eps_beta, 0 or more.
    slices : int
        Number S of equal slices of the face width; each has a row of its own with its part of stiffness and
        force, in the order of the columns of `femgear.system.mesh_directions.mesh_directions`.
    hand : {1, -1}
        1 where height +z runs ahead: a right-handed sun that turns counter-clockwise against the carrier, or
        a left-handed one that turns clockwise. Only slices see it.

    Returns
    -------
    MeshExcitation
        (n_meshes S) rows.
    """
    count = len(record.stiffness)
    overlap = np.broadcast_to(np.asarray(overlap_ratio, float), count)
    ahead = slice_phases(np.zeros(count), overlap, slices=slices, hand=hand).reshape(count, slices)
    filtered = [
        _sliced(values, record.periods, ahead, overlap / slices) / slices
        for values in (record.stiffness, record.force, record.stiffness * record.deflection)
    ]
    stiffness, force, weighted = (values.reshape(-1, values.shape[-1]) for values in filtered)
    if np.any(stiffness <= 0.0):
        raise CaseError(
            "the spur record has positions without stiffness for a whole slice",
            code="E-STIFFNESS",
            remedy="give a record whose meshes stay closed",
        )
    return MeshExcitation(
        stiffness=stiffness,
        deflection=weighted / stiffness,
        force=force,
        backlash=np.repeat(np.broadcast_to(record.backlash, count), slices),
        periods=record.periods,
    )


def helical_friction(
    cycle: MeshCycle, overlap_ratio: np.ndarray, *, slices: int = 1, hand: int = 1, reversed_time: bool = False
) -> np.ndarray | None:
    """Make the loads (4N S + 1, P) of friction on all slices from the record of spur teeth; None without friction.

    Forces along the flanks [N], then their moments about the pitch points [N m], as they act on the coordinates along
    `femgear.system.mesh_directions.friction_directions`, and zeros for what takes their mean. Slices and
    ``overlap_ratio`` (2N,) [1] are those of `helical_excitation`.
    """
    if cycle.friction_force is None or cycle.friction_moment is None:
        return None
    count = len(cycle.friction_force)
    ahead = slice_phases(np.zeros(count), overlap_ratio, slices=slices, hand=hand).reshape(count, slices)
    rows = list[np.ndarray]()
    for values in (cycle.friction_force, cycle.friction_moment):
        record = np.roll(values[:, ::-1], 1, axis=1) if reversed_time else values
        rows.append(-_sliced(record, cycle.periods, ahead, overlap_ratio / slices).reshape(count * slices, -1) / slices)
    return np.concatenate([*rows, np.zeros((1, rows[0].shape[1]))])


def slice_phases(phases, overlap_ratio, *, slices: int, hand: int = 1) -> np.ndarray:
    """Compute phases (n_meshes S,) of the slices, in mesh periods, from those at mid-face (n_meshes,).

    The overlap ratio, slices and hand are those of `helical_excitation`.
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


@dataclass(frozen=True)
class SectionStiffness:
    """Stiffness of one tooth pair in the transverse section and in the normal one.

    Parameters
    ----------
    teeth : (3,) tuple of int
        Of the virtual sun, planet and ring.
    transverse, normal : (2,) array
        Mean stiffness c' of a tooth pair [N/m^2] of the sun-planet and the planet-ring mesh: of the
        transverse section, per face width along the transverse line of action; of the virtual gears, per
        length of the contact line along the tooth normal.
    base_helix_angle : float
        [rad]
    """

    teeth: tuple[int, int, int]
    transverse: np.ndarray
    normal: np.ndarray
    base_helix_angle: float

    @property
    def factor(self) -> np.ndarray:
        """``c'_n cos(beta_b) / c'_t`` (2,): helical stiffness over that of the transverse section.

        A piece dz of the face width holds ``dz / cos beta_b`` of contact line. A turn that closes the
        transverse line of action by d closes the normal by ``d cos beta_b``, and of the normal force the
        part ``cos beta_b`` makes torque: ``dF_t = c'_n (dz / cos beta_b) cos^2 beta_b d``. ISO 6336-1,
        method B, likewise takes c' of virtual gears times ``cos beta``.
        """
        return self.normal * math.cos(self.base_helix_angle) / self.transverse


@one_blas_thread()
def section_stiffness(case: HelicalCase, gears: PlanetarySet, *, cache: Path | None = None) -> SectionStiffness:
    """Compute the stiffness of the teeth of both sections, from one planet each under equal load a length.

    The mean stiffness of a mesh over its contact ratio: c' of ISO 6336-1. Flanks are exact, grids coarse. The
    gears are those of the transverse section; ``cache`` is the folder of generated grids.

    CaseError: virtual gears that cannot be made (E-GEOMETRY). GridError, ContactError.
    """
    virtual = _virtual_gears(case, gears)
    single = replace(gears, planet_angles=gears.planet_angles[:1])
    load = _line_load(case, gears)
    transverse, normal = (_pair_stiffness(case, section_gears, load, cache) for section_gears in (single, virtual))
    teeth = (virtual.sun.teeth, virtual.planet.teeth, virtual.ring.teeth)
    base = profile.base_helix_angle(case.sun.pressure_angle, case.helical.helix_angle)
    return SectionStiffness(teeth, transverse, normal, base)


def _virtual_gears(case: HelicalCase, gears: PlanetarySet) -> PlanetarySet:
    """Virtual gears of the normal section of a case; refused where they cannot be made (E-GEOMETRY)."""
    try:
        return virtual_set(gears, case.helical.helix_angle)
    except GeometryError as error:
        raise CaseError(
            f"the virtual gears of the normal section cannot be made: {error.message}",
            code="E-GEOMETRY",
            key="helical.section",
            value=case.helical.section,
            limit='"transverse" for these teeth',
            remedy='write section = "transverse": teeth then are those of the transverse section, too stiff',
            file=case.location("helical.section"),
        ) from None


def normal_record(
    record: MeshExcitation, factor: np.ndarray, base_helix_angle: float, *, reversed_time: bool = False
) -> MeshExcitation:
    """Make the record along tooth normals, without overlap, from spur gears of the transverse section.

    ``k_n = factor k_t / cos^2 beta_b``, ``F_n = F_t / cos beta_b``; the tangent line of force over deflection
    keeps its intercept ``d_t - F_t / k_t``, which holds deviations of the flanks, and changes its slope:
    ``d_n = (d_t - F_t / k_t + F_t / (factor k_t)) cos beta_b``.

    Parameters
    ----------
    record : MeshExcitation
        Along the transverse line of action, 2N rows.
    factor : (2,) array
        Of the sun-planet and the planet-ring meshes.
    base_helix_angle : float
        [rad]
    reversed_time : bool
        For a sun that turns clockwise against the carrier: positions of the record run the other way.
    """
    scale = np.repeat(np.asarray(factor, float), len(record.stiffness) // 2)[:, None]
    along = math.cos(base_helix_angle)
    softer = record.force / record.stiffness * (1.0 / scale - 1.0)
    values = [record.stiffness * scale / along**2, (record.deflection + softer) * along, record.force / along]
    if reversed_time:
        values = [np.roll(lines[:, ::-1], 1, axis=1) for lines in values]
    return MeshExcitation(*values, backlash=record.backlash * along, periods=record.periods)


def shared_load(record: MeshExcitation) -> MeshExcitation:
    """Move tangent lines of a record, 2N rows, to the static state of a set with fixed centres.

    Each planet passes the force on that it takes, ``F = k_s (d_s - e_s) = k_r (d_r - e_r)``, and one rotation
    of the sun closes the meshes of all planets, ``d_s + d_r = X``; the forces on the sun add up to those of
    the record.
    """
    meshes = (2, len(record.stiffness) // 2, -1)
    k = record.stiffness.reshape(meshes)
    intercept = (record.deflection - record.force / record.stiffness).reshape(meshes)
    compliance, gap = (1.0 / k).sum(axis=0), intercept.sum(axis=0)
    total = record.force.reshape(meshes)[0].sum(axis=0)
    closing = (total + (gap / compliance).sum(axis=0)) / (1.0 / compliance).sum(axis=0)
    force = (closing - gap) / compliance
    deflection = intercept + force / k
    return replace(record, force=np.concatenate([force, force]), deflection=deflection.reshape(record.deflection.shape))


def _line_load(case: HelicalCase, gears: PlanetarySet) -> float:
    """Largest load a width of a mesh in the transverse section, which is that a length of contact line [N/m].

    ``F_n / (b / cos beta_b)`` with ``F_n = F_t / cos beta_b``.
    """
    sun = torques(gears, member=case.operation.input, torque=case.operation.torque).sun
    return abs(sun) / (gears.n_planets * gears.sun.base_radius * min(gears.mesh_widths))


def _pair_stiffness(case: HelicalCase, gears: PlanetarySet, load: float, cache: Path | None) -> np.ndarray:
    """Mean stiffness of a tooth pair per width (2,) of the meshes of one planet [N/m^2]."""
    materials = materials_of(case)
    sectors = make_sectors(gears, materials, flank_elements=_FLANK_ELEMENTS, cache=cache)
    widths = np.array(gears.mesh_widths)
    cycle = walk_mesh_cycle(
        gears,
        make_bodies(sectors, materials),
        sun_torque=load * widths.min() * gears.sun.base_radius,
        positions=_POSITIONS,
        contact=case.static.contact,
    )
    ratios = np.array([gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring])
    return cycle.stiffness.mean(axis=1) / (widths * ratios)


def check_helical_case(case: HelicalCase, gears: PlanetarySet) -> None:
    """Refuse what the helical model cannot represent, before anything is computed.

    CaseError: E-MECHANISM: torque, thrust or tilting moments that nothing takes up. E-RANGE: stiffnesses too
    far apart, a torque that no teeth carry. E-PERIODS: a static record of several mesh periods. E-GEOMETRY:
    virtual gears that cannot be made.
    """
    _check_supports(case, gears)
    if case.helical.mesh_stiffness is not None:
        no_faults(case, "with a given mesh stiffness no flank is looked at, and so no fault of a tooth")
        no_acting_friction(case, "a given helical.mesh_stiffness has no tooth loads, and so no friction")
        return
    _check_torque(case, gears)
    check_one_period(case, gears, "the helical model takes")
    if case.helical.section == "normal" and case.static.slices < 2:
        _virtual_gears(case, gears)


def _check_torque(case: HelicalCase, gears: PlanetarySet) -> None:
    """A load under which teeth would give way by a large part of their height has no static solution."""
    moduli = [material.youngs_modulus for material in materials_of(case)]
    stiffness = _TOOTH * min(material_factor(*pair) for pair in pairwise(moduli))
    share = _line_load(case, gears) / (stiffness * gears.sun.module)
    if share > _MOST:
        raise CaseError(
            f"a tooth pair would give way by {share:.3g} modules under this torque",
            code="E-RANGE",
            key="operation.torque",
            value=f"{case.operation.torque:.6g} N m",
            limit=f"{abs(case.operation.torque) * _MOST / share:.3g} N m, by {_MOST} modules, for this set",
            remedy="check the unit of the torque, or give the teeth a wider face or a larger module",
            file=case.location("operation.torque"),
        )


def _check_supports(case: HelicalCase, gears: PlanetarySet) -> None:
    """The thrust of helical teeth needs axial supports and its moments tilt supports."""
    data = helical_data(case, gears, np.full(2 * gears.n_planets, _TRIAL))
    try:
        balanced = _balanced(case, data)
    except ConvergenceError as error:
        if error.code not in ("E-RIGID-MODE", "E-STIFFNESS"):
            raise
        _refuse_hidden(case)
    if not balanced:
        _refuse_loose(case, data)


def _refuse_hidden(case: HelicalCase) -> NoReturn:
    """Refuse supports that are there, but too soft beside the others for a number to hold both."""
    raise CaseError(
        "the stiffest supports are too stiff beside the softest: rounding hides the soft ones",
        code="E-RANGE",
        key="helical",
        limit="tilt and torsional stiffnesses over the radius squared within 1e17 N/m",
        remedy="bring axial_stiffness, tilt_stiffness and torsional_stiffness closer together",
        file=case.location("helical"),
    ) from None


def _balanced(case: HelicalCase, data: HelicalSet) -> bool:
    """Whether supports take up what the torque asks of them."""
    try:
        undamped_modes(gear_set_system(data, torque=driving_torque(case)), data.column_stiffness)
    except CaseError as error:
        if error.code != "E-LOAD-BALANCE":
            raise
        return False
    return True


def _refuse_loose(case: HelicalCase, data: HelicalSet) -> None:
    """Name the supports of zero stiffness that would each take up what nothing takes up."""
    free = [
        (body, entry)
        for body in ("sun", "ring", "carrier", "planet")
        for entry in _AXES
        if getattr(getattr(case.helical, body), entry) == 0.0
    ]
    if not free and data.support_stiffness[:, 0].all():
        _refuse_hidden(case)
    cures = [motion for motion in free if _balanced(case, _supported(data, *motion))] or free
    names = [f"helical.{body}.{entry}" for body, entry in cures]
    lost = " or the ".join(dict.fromkeys(_AXES[entry][1] for _, entry in cures)) or "torque"
    raise CaseError(
        f"nothing takes up the {lost} of the helical teeth",
        code="E-MECHANISM",
        key=names[0] if names else "helical",
        value="0" if names else None,
        limit=f"above 0: {' or '.join(names)}" if names else "supports of sun, ring and carrier above 0",
        remedy="give axial_stiffness, tilt_stiffness and support_stiffness",
        file=case.location(names[0] if names else "helical"),
    )


def _supported(data: HelicalSet, body: str, entry: str) -> HelicalSet:
    """The same set with one support that was missing."""
    change = {_AXES[entry][0]: _TRIAL}
    if body == "planet":
        return replace(data, planet_bearing=replace(data.planet_bearing, **change))
    held_body = getattr(data, body)
    return replace(data, **{body: replace(held_body, support=replace(held_body.support, **change))})


def helical_warnings(case: HelicalCase) -> Iterator[Finding]:
    """List what is allowed in a helical set but deserves a look."""
    yield from set_warnings(case)
    in_slices = case.helical.mesh_stiffness is None and case.static.slices > 1
    if rating_wanted(case) and not in_slices and case.operation.torque != 0.0:
        yield from _thrust_doubts(case, planetary_set(case))


def _thrust_doubts(case: HelicalCase, gears: PlanetarySet) -> Iterator[Finding]:
    """Doubt safeties without the K_Hbeta of planets that axial forces tilt on their pins, where it is above `_TILTED`.

    ``tan(beta_b) F`` of sun and ring, on the working circles, tilt a planet about the tangent. Pins hold it, and so do
    its meshes by ``k b^2/12 sin^2(alpha_wt)``. Radial slopes part flanks by ``sin(alpha_wt)`` of them. Sun and ring
    stay upright: equal planets at equal angles leave them no couple.
    """
    sun = torques(gears, member=case.operation.input, torque=case.operation.torque).sun
    force = abs(sun) / (gears.n_planets * gears.sun.base_radius)
    base = profile.base_helix_angle(case.sun.pressure_angle, case.helical.helix_angle)
    moduli, widths = [material.youngs_modulus for material in materials_of(case)], np.array(gears.mesh_widths)
    angles = np.array([pair.working_pressure_angle for pair in gears.kinds])
    arms = gears.gears[BRANCH].base_radius / np.cos(angles)
    couple, offset = force * math.tan(base) * arms.sum(), 0.5 * math.tan(base) * arms.sum()
    # c_gammabeta of both kinds of mesh [N/m^2]
    stiffness = BENDING_SHARE * np.array(
        [
            material_factor(*of_mesh) * pair_mesh_stiffness(pair, case.helical.helix_angle)[1]
            for pair, of_mesh in zip(gears.kinds, pairwise(moduli), strict=True)
        ]
    )
    by_meshes = (stiffness * widths**3 / 12.0 * np.sin(angles) ** 2).sum()
    tilt = couple / (case.helical.planet.tilt_stiffness + by_meshes)
    apart = tilt * widths * np.sin(angles)
    factor = max(face_load_factor(*values) for values in zip(apart, force / widths, stiffness, strict=True))
    tilts = thrust_words(couple, offset, float(widths.min()))
    if tilts and factor > _TILTED:
        text = (
            f"axial forces tilt every planet with {tilts}: by {1e3 * tilt:.2g} mrad, which makes K_Hbeta about "
            f"{factor:.2g}. Safeties leave it out"
        )
        remedy = (
            "femgear gearbox CASE makes a gearbox, whose K_Hbeta has the tilts of its planets; stiffer pins tilt less"
        )
        yield Finding("W-THRUST", "helical.planet.tilt_stiffness", text, remedy=remedy)
