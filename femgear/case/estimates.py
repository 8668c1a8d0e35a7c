"""Estimates of masses, inertias and stiffnesses from the shapes of the gears, where a case leaves them out.

Bodies are full cylinders, stiffnesses fractions of the mesh stiffness of usual gears; every estimate says how
it was made. They tell where natural frequencies may lie: give what is known of bearings and shafts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from femgear.case.gear_set import planetary_set
from femgear.case.quantities import FOUNDATION, INERTIA, MASS, STIFFNESS, TORSION, Dimension, Section
from femgear.case.sections import gear_material
from femgear.findings import Finding
from femgear.gears.gear import Gear
from femgear.gears.iso6336_stiffness import material_factor

USUAL_STIFFNESS = 20e9
"""Mesh stiffness per face width c_gamma of steel gears [N/m^2], 20 N/(mm um): DIN 3990-1:1987, method C."""
SUPPORT_SHARE = 0.2
"""Stiffness of a bearing or support per mesh stiffness: 1e8 and 5e8 N/m in Table 1 of J. Lin, R. G. Parker,
J. Vib. Acoust. 121, 1999, 316-321."""
USUAL_LOAD = 1e6
"""K factor ``F_t / (b d_1) (u + 1) / u`` of moderately loaded gears [Pa], D. W. Dudley's measure of size."""


@dataclass(frozen=True)
class Estimate:
    """An estimated entry of a case.

    Parameters
    ----------
    value : float
        In SI units of the dimension.
    dimension : Dimension
        Physical quantity, which brings the unit that is written.
    how : str
        What it is made from, in words.
    """

    value: float
    dimension: Dimension
    how: str

    def __str__(self) -> str:
        return self.dimension.show(float(f"{self.value:.4g}"))


def cylinder(inner: float, outer: float, width: float, density: float) -> tuple[float, float, float]:
    """Compute mass [kg], polar and diametral inertia [kg m^2] of a hollow cylinder, radii and width in m.

    ``m = rho b pi (R^2 - r^2)``, ``I = m (R^2 + r^2) / 2`` and ``m (3 (R^2 + r^2) + b^2) / 12``.
    """
    mass, squares = density * width * math.pi * (outer**2 - inner**2), outer**2 + inner**2
    return mass, 0.5 * mass * squares, mass * (3.0 * squares + width**2) / 12.0


def gear_cylinder(gear: Gear, density: float) -> tuple[float, float, float]:
    """Compute the mass properties of a gear, as `cylinder`, between its rim and the circle ``r + x m``.

    There teeth are as wide as the spaces between them: what stands out of the circle fills these.
    """
    inner, outer = sorted((gear.rim_radius, gear.reference_radius + gear.profile_shift * gear.module))
    return cylinder(inner, outer, gear.face_width, density)


def estimated_mesh_stiffness(modulus_1: float, modulus_2: float, width: float) -> float:
    """Estimate the stiffness [N/m] of a mesh of gears of Young's moduli [Pa] over a common face width [m]."""
    return USUAL_STIFFNESS * material_factor(modulus_1, modulus_2) * width


def usual_torque(teeth: int, mate: int, module: float, width: float, meshes: int = 1) -> float:
    """Compute the torque [N m] on a gear of external meshes at `USUAL_LOAD`, module and width in m."""
    diameter, ratio = teeth * module, mate / teeth
    return 0.5 * meshes * USUAL_LOAD * width * diameter**2 * ratio / (ratio + 1.0)


def usual_rim(
    teeth: int,
    module: float,
    dedendum: float,
    shift: float = 0.0,
    *,
    internal: bool,
    helix: float = 0.0,
    addendum: float = 1.0,
) -> tuple[float, float]:
    """Choose the bore or outer radius of a gear, and compute its root radius [m].

    The rim is three normal modules, of internal gears four, and 1.25 tooth heights of longer teeth: from 1.2
    on it does not weaken them (ISO 6336-3). ``module`` in m, ``helix`` in rad, ``dedendum``, ``addendum`` and
    ``shift`` in modules.
    """
    rim = module * max(4.0 if internal else 3.0, 1.25 * (addendum + dedendum))
    sense = 1.0 if internal else -1.0
    root = module * (0.5 * teeth / math.cos(helix) + shift + sense * dedendum)
    return root + rim if internal else max(root - rim, 0.15 * root), root


def estimates(case: Any) -> dict[str, Estimate]:
    """Estimate the entries of a case that its gears allow, by dotted key.

    Of planetary sets and pairs. GeometryError: gears that cannot be made, see `planetary_set`.
    """
    gears = planetary_set(case)
    materials = {name: gear_material(case, name) for name in case.gear_names}
    bodies = {gear.name: (gear_cylinder(gear, materials[gear.name].density), _words(gear)) for gear in gears.gears}
    if "ring" in bodies:
        radius = gears.centre_distance + gears.planet.rim_radius
        how = "two discs of half the planets' face width, out to the far side of their bores"
        bodies["carrier"] = cylinder(0.0, radius, gears.planet.face_width, case.material.density), how
    estimates_ = {}
    for name, ((mass, polar, diametral), how) in bodies.items():
        stiffness, width, share = _support(gears, materials, name)
        of_gear = {"mass": Estimate(mass, MASS, how), "inertia": Estimate(polar, INERTIA, how)}
        support = "support" if name in ("sun", "ring", "carrier") else "bearing"
        of_gear[f"{support}_stiffness"] = Estimate(stiffness, STIFFNESS, share)
        estimates_ |= {f"{place}.{key}": estimate for key, estimate in of_gear.items() for place in _places(name)}
        spatial = {
            "diametral_inertia": Estimate(diametral, INERTIA, how),
            "axial_stiffness": Estimate(stiffness, STIFFNESS, f"as radially: {share}"),
            "tilt_stiffness": Estimate(
                stiffness * width**2 / 12.0, TORSION, "the radial stiffness, even over the face width"
            ),
        }
        estimates_ |= {f"helical.{name}.{key}": estimate for key, estimate in spatial.items()}
    if "ring" in bodies:
        stiffness, _, share = _support(gears, materials, "ring")
        area = 2.0 * math.pi * gears.ring.rim_radius * gears.ring.face_width
        how = f"over the outer surface {share}"
        foundation = Estimate(stiffness / area, FOUNDATION, how)
        estimates_ |= {f"ring.foundation_{name}": foundation for name in ("radial", "tangential")}
    return estimates_


def _support(gears: Any, materials: dict[str, Any], name: str) -> tuple[float, float, str]:
    """Stiffness of the support of a member [N/m], width of its meshes [m], and what they are made from.

    A mean over the meshes of the member; the carrier has those of its planets.
    """
    moduli = [material.youngs_modulus for material in materials.values()]
    meshes = [*zip(pairwise(materials), pairwise(moduli), gears.mesh_widths, strict=True)]
    name = "planet" if name == "carrier" else name
    meshes_there = [(pair, width) for names, pair, width in meshes if name in names]
    stiffness = (
        SUPPORT_SHARE * sum(estimated_mesh_stiffness(*pair, width) for pair, width in meshes_there) / len(meshes_there)
    )
    width = sum(width for _, width in meshes_there) / len(meshes_there)
    line = 1e-9 * stiffness / (SUPPORT_SHARE * width)
    share = f"{SUPPORT_SHARE:g} of a mesh stiffness of {line:.3g} N/(mm um) times the face width"
    return stiffness, width, share


def _places(name: str) -> tuple[str, ...]:
    """Sections that give the body of a member."""
    return ("planar.ring", "helical.ring") if name == "ring" else (name,)


def _words(gear: Gear) -> str:
    rim = "outer surface" if gear.internal else "bore"
    return f"cylinder from the {rim} to the circle on which teeth and spaces are equal"


_BODY = ("mass", "inertia", "support_stiffness")
_KEYS = (
    *(f"{name}.{key}" for name in ("sun", "carrier", "planar.ring", "helical.ring") for key in _BODY),
    *(f"planet.{key}" for key in ("mass", "inertia", "bearing_stiffness")),
    *(f"{name}.{key}" for name in ("gear_1", "gear_2") for key in ("mass", "inertia")),
    *(f"ring.foundation_{key}" for key in ("radial", "tangential")),
    *(
        f"helical.{name}.{key}"
        for name in ("sun", "ring", "carrier", "planet")
        for key in ("diametral_inertia", "axial_stiffness", "tilt_stiffness")
    ),
)
"""Entries of planetary sets and pairs that may be left out."""


def with_estimates(case: Any) -> tuple[Any, tuple[Finding, ...]]:
    """Put estimates in place of what a planetary set or pair leaves out, and say which (W-ESTIMATED).

    GeometryError: gears that cannot be made, where something is left out.
    """
    missing = [key for key in _KEYS if _left_out(case, key.split(".")) and not _on_shaft(case, key)]
    if not missing:
        return case, ()
    estimated = estimates(case)
    for key in missing:
        case = _with(case, key.split("."), estimated[key].value)
    shown = ", ".join(f"{key} = {estimated[key]}" for key in missing)
    text = f"left out and estimated from the gears: {shown}"
    remedy = "give what is known: modes and vibration depend on it, a static solution of fixed members does not"
    kinds = dict.fromkeys("stiffnesses" if "stiffness" in key or "foundation" in key else "masses" for key in missing)
    return case, (Finding("W-ESTIMATED", missing[0], text, remedy=remedy, concerns=" and ".join(kinds)),)


def _on_shaft(case: Any, key: str) -> bool:
    """Whether an entry is the stiffness of a support that a shaft gives."""
    name, _, entry = key.rpartition(".")
    return entry == "support_stiffness" and bool(getattr(getattr(case, name, None), "support_shaft", ()))


def _left_out(section: Any, path: list[str]) -> bool:
    """Whether the section of an entry is there and the entry is not."""
    name, *inner = path
    value = getattr(section, name, 0.0)
    return _left_out(value, inner) if inner else value is None or math.isnan(value)


def _with(section: Section, path: list[str], value: float) -> Any:
    """Copy of a section with one entry of it, or of sections in it, changed."""
    name, *inner = path
    new = _with(getattr(section, name), inner, value) if inner else value
    return section.model_copy(update={name: new})
