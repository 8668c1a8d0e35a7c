"""From a helical case to the helical set, from spur gears to the stiffness of its teeth, and refusals.

Bodies, supports, radii, helix and torque are those of the case. Teeth are solved as spur gears of the
transverse section; those of the normal section, the virtual gears, tell by how much their stiffness differs.
Refused before anything is computed are supports that are missing and torques too large.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError, ConvergenceError, GeometryError
from femgear.system.system import MeshExcitation
from femgear.trains.helical.section import HelicalCase
from femgear.trains.protocol import one_blas_thread
from femgear.trains.rigid import check_one_period, driving_torque, mesh_stiffnesses, needed, torsional_support

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet
    from femgear.trains.helical.model import HelicalSet

# both sections are solved on the same grid, and only the ratio of their stiffnesses counts
FLANK_ELEMENTS, POSITIONS = 8, 16
# any stiffness shows whether something takes up the load [N/m, N m/rad]
_TRIAL = 1e8
_AXES = {"axial_stiffness": "axial", "tilt_stiffness": "tilt"}
# c' of steel teeth [N/m^2] and Young's modulus of steel [Pa] (ISO 6336-1, method B); what teeth give way by
# before nothing is left of their contact [modules]
_TOOTH, _STEEL, _MOST = 14e9, 206e9, 0.25


def helical_data(case: HelicalCase, gears: PlanetarySet, mesh_stiffness=None) -> HelicalSet:
    """Helical set of a case: bodies and supports of its entries, radii and angles of its gears.

    Parameters
    ----------
    case : Case
    gears : PlanetarySet
        Of the transverse section.
    mesh_stiffness : (2N,) array, optional
        Mean stiffnesses along the tooth normals [N/m] where the case gives none.
    """
    from femgear.system.rigid_bodies import HelicalBody, HelicalSupport
    from femgear.trains.helical.model import helical_from_set

    helical = case.helical
    bodies = {}
    for name, one in (("sun", case.sun), ("ring", helical.ring), ("carrier", case.carrier)):
        space = getattr(helical, name)
        torsional = torsional_support(case, name, space.torsional_stiffness)
        radial = needed(one.support_stiffness, f"{name}.support_stiffness")
        support = HelicalSupport(radial, space.axial_stiffness, space.tilt_stiffness, torsional)
        bodies[name] = HelicalBody(one.mass, one.inertia, space.diametral_inertia, support)
    pin = helical.planet
    return helical_from_set(
        gears,
        helix_angle=helical.signed_helix_angle,
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
        face_width=case.set.face_width,
    )


def base_helix_angle(case: HelicalCase, gears: PlanetarySet) -> float:
    """beta_b [rad] without sign: ``tan beta_b = tan beta cos alpha_t`` (ISO 21771, section 4.2.6)."""
    return math.atan(math.tan(case.helical.helix_angle) * math.cos(gears.sun.pressure_angle))


def overlap_ratio(case: HelicalCase, gears: PlanetarySet) -> float:
    """eps_beta of both meshes."""
    from femgear.trains.helical.model import contact_ratios

    found = contact_ratios(gears, helix_angle=case.helical.helix_angle, face_width=case.set.face_width)
    return float(found[0, 1])


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
def section_stiffness(
    case: HelicalCase, gears: PlanetarySet, *, cache: Path | None = None
) -> SectionStiffness:
    """Stiffness of the teeth of both sections, from one planet each under the same load a length.

    The mean stiffness of a mesh over its contact ratio: c' of ISO 6336-1. Flanks are exact, grids coarse.

    Parameters
    ----------
    case : Case
        With a section helical.
    gears : PlanetarySet
        Of its transverse section.
    cache : path, optional
        Folder of generated grids.

    Raises
    ------
    CaseError
        Virtual gears that cannot be made (E-GEOMETRY).
    GridError, ContactError
    """
    virtual = virtual_gears(case, gears)
    single = replace(gears, planet_angles=gears.planet_angles[:1])
    load = line_load(case, gears)
    transverse, normal = (_pair_stiffness(case, one, load, cache) for one in (single, virtual))
    teeth = (virtual.sun.teeth, virtual.planet.teeth, virtual.ring.teeth)
    return SectionStiffness(teeth, transverse, normal, base_helix_angle(case, gears))


def virtual_gears(case: HelicalCase, gears: PlanetarySet) -> PlanetarySet:
    """`femgear.gears.planetary.virtual_set` of a case.

    Raises
    ------
    CaseError
        E-GEOMETRY: they cannot be made.
    """
    from femgear.gears.planetary import virtual_set

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
    """Record along tooth normals of helical teeth without overlap, from spur gears of the transverse section.

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
    values = [
        record.stiffness * scale / along**2,
        (record.deflection + softer) * along,
        record.force / along,
    ]
    if reversed_time:
        values = [np.roll(one[:, ::-1], 1, axis=1) for one in values]
    return MeshExcitation(*values, backlash=record.backlash * along, periods=record.periods)


def shared_load(record: MeshExcitation) -> MeshExcitation:
    """The same tangent lines at the static state of a set with fixed centres.

    Each planet passes the force on that it takes, ``F = k_s (d_s - e_s) = k_r (d_r - e_r)``, and one rotation
    of the sun closes the meshes of all planets, ``d_s + d_r = X``; the forces on the sun add up to those of
    the record.

    Parameters
    ----------
    record : MeshExcitation
        2N rows, one a mesh.
    """
    meshes = (2, len(record.stiffness) // 2, -1)
    k = record.stiffness.reshape(meshes)
    intercept = (record.deflection - record.force / record.stiffness).reshape(meshes)
    compliance, gap = (1.0 / k).sum(axis=0), intercept.sum(axis=0)
    total = record.force.reshape(meshes)[0].sum(axis=0)
    closing = (total + (gap / compliance).sum(axis=0)) / (1.0 / compliance).sum(axis=0)
    force = (closing - gap) / compliance
    deflection = intercept + force / k
    return replace(
        record, force=np.concatenate([force, force]), deflection=deflection.reshape(record.deflection.shape)
    )


def line_load(case: HelicalCase, gears: PlanetarySet) -> float:
    """Load a width of each sun mesh in the transverse section, which is that a length of contact line [N/m].

    ``F_n / (b / cos beta_b)`` with ``F_n = F_t / cos beta_b``.
    """
    from femgear.gears.kinematics import torques

    sun = torques(gears, member=case.operation.input, torque=case.operation.torque).sun
    return abs(sun) / (gears.n_planets * gears.sun.base_radius * gears.sun.face_width)


def _pair_stiffness(case: HelicalCase, gears: PlanetarySet, load: float, cache: Path | None) -> np.ndarray:
    """Mean stiffness of a tooth pair per width (2,) of the meshes of one planet [N/m^2]."""
    from femgear.contact.bodies import make_bodies, make_sectors
    from femgear.contact.cycle import walk_mesh_cycle
    from femgear.fe.elasticity import Material

    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    sectors = make_sectors(gears, material, flank_elements=FLANK_ELEMENTS, cache=cache)
    width = gears.sun.face_width
    cycle = walk_mesh_cycle(
        gears,
        make_bodies(sectors, material),
        sun_torque=load * width * gears.sun.base_radius,
        positions=POSITIONS,
        contact=case.static.contact,
    )
    ratios = np.array([gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring])
    return cycle.stiffness.mean(axis=1) / (width * ratios)


def check_helical_case(case: HelicalCase, gears: PlanetarySet) -> None:
    """Refuse what the helical model cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        E-MECHANISM: torque, thrust or tilting moments that nothing takes up. E-RANGE: stiffnesses too far
        apart, a torque that no teeth carry. E-PERIODS: a static record of several mesh
        periods. E-GEOMETRY: virtual gears that cannot be made.
    """
    _check_supports(case, gears)
    if case.helical.mesh_stiffness is not None:
        return
    _check_torque(case, gears)
    check_one_period(case, gears, "helical")
    if case.helical.section == "normal":
        virtual_gears(case, gears)


def _check_torque(case: HelicalCase, gears: PlanetarySet) -> None:
    """A load under which teeth would give way by a large part of their height has no static solution."""
    stiffness = _TOOTH * case.material.youngs_modulus / _STEEL
    share = line_load(case, gears) / (stiffness * gears.sun.module)
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
        if error.code != "E-RIGID-MODE":
            raise
        raise CaseError(
            "the stiffest supports are too stiff beside the softest: rounding hides the soft ones",
            code="E-RANGE",
            key="helical",
            limit="tilt and torsional stiffnesses over the radius squared within 1e17 N/m",
            remedy="lower the largest axial_stiffness, tilt_stiffness or torsional_stiffness",
            file=case.location("helical"),
        ) from None
    if not balanced:
        _refuse_loose(case, data)


def _balanced(case: HelicalCase, data: HelicalSet) -> bool:
    """Whether supports take up what the torque asks of them."""
    from femgear.solvers.linear.modal import solve_modes
    from femgear.system.assembler import gear_set_system

    try:
        solve_modes(gear_set_system(data, torque=driving_torque(case)), data.column_stiffness)
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
    cures = [one for one in free if _balanced(case, _supported(data, *one))] or free
    names = [f"helical.{body}.{entry}" for body, entry in cures]
    what = {"axial_stiffness": "thrust", "tilt_stiffness": "tilting moments"}
    lost = " or the ".join(dict.fromkeys(what[entry] for _, entry in cures)) or "torque"
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
    change = {_AXES[entry]: _TRIAL}
    if body == "planet":
        return replace(data, planet_bearing=replace(data.planet_bearing, **change))
    one = getattr(data, body)
    return replace(data, **{body: replace(one, support=replace(one.support, **change))})
