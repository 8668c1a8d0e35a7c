"""Strength of teeth after ISO 6336 by the edition of the case: nominal stresses, load factors, safeties.

One rating for all trains. Load factors are those that femgear computes where a train has them: K_gamma from the
sharing of the planets, K_v from the response, K_Hbeta from the contact over the width; K_v of part 1 takes the place of
the computed one, and K_Halpha is that of part 1, where the case gives a flank tolerance class. What nothing tells is 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import materials_of, planetary_set
from femgear.case.sections import gear_material
from femgear.errors import GeometryError
from femgear.fe.elasticity import Material, material_of_each
from femgear.findings import DOUBT, Finding
from femgear.gears.iso6336 import (
    BY_EXPERIENCE,
    LATEST_EDITION,
    PROVEN,
    UNMODIFIED,
    Edition,
    contact_ratio_factor,
    contact_safety,
    nominal_contact_stress,
    overlap_of,
    root_safety,
    single_pair_factors,
)
from femgear.gears.iso6336_load import (
    DynamicFactor,
    Running,
    disc_inertia,
    dynamic_factor,
    dynamic_factor_of_speed,
    face_load_factor,
    face_running_in,
    mesh_misalignment_of_tolerances,
    reduced_mass,
    resonance_speed,
    running_in,
    transverse_load_factors,
)
from femgear.gears.iso6336_root import NominalRootStress, nominal_root_stress, rim_beyond_range, rim_factor_of
from femgear.gears.iso6336_stiffness import BENDING_SHARE, line_load_factor, material_factor, pair_mesh_stiffness
from femgear.gears.kinematics import speeds
from femgear.gears.pair import BRANCH, GearSet
from femgear.gears.tolerances import tolerances_of_gear

if TYPE_CHECKING:
    from femgear.case.sections import StrengthSection
    from femgear.gears.pair import GearPair

MODIFIED = {"none": UNMODIFIED, "experience": BY_EXPERIENCE, "proven": PROVEN}
"""f_ZCa by the entry ``strength.modification``."""
SIDES = {"sun-planet": ("sun", "planet, sun side"), "planet-ring": ("planet, ring side", "ring")}
"""Names of the flanks in both kinds of mesh of a planetary set; those of a pair are its gears."""
HARDENED = 1e9
"""sigma_Hlim above which flanks run in as surface hardened ones [Pa], as do those without a limit."""


OF_TEETH = (
    "W-MATERIAL",
    "W-FACE-LOAD",
    "W-THRUST",
    "W-STIFFNESS",
    "W-PASSES",
    "W-DEFLECTION",
    "W-OPEN",
    "W-FAULT",
)
"""Codes of the findings that concern safeties and lives alike: limits, and load factors of the contact."""
OF_ROOTS = (*OF_TEETH, "W-RIM")
"""Those of roots."""


@dataclass(frozen=True)
class NominalStresses:
    """Nominal stresses after ISO 6336 with equal load on all planets and no load factors.

    Parameters
    ----------
    contact : (k,) array
        sigma_H0 of every kind of mesh [Pa] (ISO 6336-2, method B).
    root : (k, 2) array
        sigma_F0 of gear 1 and gear 2 [Pa] (ISO 6336-3, method B).
    contact_ratio_factor : (k,) array
        Z_eps.
    message : str
        Why a value is NaN, of gears outside the range of the method.
    single_pair : (k, 2) array
        Z_B and Z_D of gear 1 and gear 2.
    roots : tuple of tuple of NominalRootStress or None
        Factors of the root stresses, by kind and gear.
    edition : int
        2006 or 2019.
    """

    contact: np.ndarray
    root: np.ndarray
    contact_ratio_factor: np.ndarray
    message: str
    single_pair: np.ndarray = field(default_factory=lambda: np.ones((0, 2)))
    roots: tuple[tuple[NominalRootStress | None, ...], ...] = ()
    edition: Edition = LATEST_EDITION


@dataclass(frozen=True)
class StandardFactors:
    """Load factors of part 1 of a kind of mesh, from its flank tolerance class.

    Parameters
    ----------
    dynamic : DynamicFactor
        K_v by method B.
    by_speed : float
        K_v by method C; NaN outside its classes.
    transverse, root_transverse : float
        K_Halpha and K_Falpha by method B.
    face : float
        K_Hbeta by method C, with shafts and bearings that are rigid.
    """

    dynamic: DynamicFactor
    by_speed: float
    transverse: float
    root_transverse: float
    face: float


@dataclass(frozen=True)
class MeshLoadFactors:
    """Load factors of all kinds of mesh of gears, and where they come from.

    Parameters
    ----------
    application : float
        K_A.
    sharing, dynamic, face, transverse, root_transverse : (k,) arrays
        K_gamma, K_v, K_Hbeta, K_Halpha and K_Falpha. K_Hbeta stands for K_Fbeta too, on the safe side.
    sources : mapping of str
        By the names of these arrays where each comes from; none of factors that nothing told, which are 1.
    message : str
        Why there are no factors of part 1 although the case gives a flank tolerance class.
    given_meshes : bool
        Whether meshes have a given stiffness: part 1 has their K_Hbeta then, where contact over the width has none.
    """

    application: float
    sharing: np.ndarray
    dynamic: np.ndarray
    face: np.ndarray
    transverse: np.ndarray
    root_transverse: np.ndarray
    sources: Mapping[str, str] = field(default_factory=dict)
    message: str = ""
    given_meshes: bool = False

    @property
    def contact(self) -> np.ndarray:
        """Product (k,) for the flanks, under the root of which sigma_H grows."""
        return self.application * self.sharing * self.dynamic * self.face * self.transverse

    @property
    def root(self) -> np.ndarray:
        """Product (k,) for the roots."""
        return self.application * self.sharing * self.dynamic * self.face * self.root_transverse


@dataclass(frozen=True)
class RatedFlank:
    """Stresses and safeties of one flank and the root below it.

    Parameters
    ----------
    name, gear : str
        ``"planet, ring side"``, and the section of the case, ``"planet"``.
    kind : int
        Number of its kind of mesh.
    root_stress, contact_stress : float
        sigma_F0, and sigma_H0 times Z_B or Z_D [Pa]; NaN outside the range of the method.
    single_pair : float
        Z_B or Z_D.
    root : NominalRootStress or None
        Factors of the root stress.
    root_factor, contact_factor : float
        Products of the load factors.
    root_limit, contact_limit : float or None
        sigma_Flim and sigma_Hlim [Pa].
    reversed_bending : bool
        Whether the teeth bend both ways, as those of planets.
    """

    name: str
    gear: str
    kind: int
    root_stress: float
    contact_stress: float
    single_pair: float
    root: NominalRootStress | None
    root_factor: float
    contact_factor: float
    root_limit: float | None
    contact_limit: float | None
    reversed_bending: bool

    @property
    def words(self) -> str:
        """Name in a sentence: "the sun", "gear 1"."""
        return gear_words(self.name)

    @property
    def root_safety(self) -> float:
        """S_F; NaN without a limit or a load."""
        if self.root_limit is None or self.root_stress == 0.0:
            return math.nan
        return root_safety(self.root_limit, self.root_stress, self.root_factor, reversed_bending=self.reversed_bending)

    @property
    def contact_safety(self) -> float:
        """S_H; NaN without a limit or a load."""
        if self.contact_limit is None or self.contact_stress == 0.0:
            return math.nan
        return contact_safety(self.contact_limit, self.contact_stress, self.contact_factor)


def gear_words(name: str) -> str:
    """Name a gear, by its section or its title, in a sentence: "the sun", "gear 1"."""
    title = name.replace("_", " ")
    return title if title.startswith("gear ") else f"the {title}"


def nominal_stresses(
    gears: GearSet,
    torque: float,
    material: Material | Sequence[Material],
    *,
    edition: Edition = LATEST_EDITION,
    grade: int | None = None,
    modified: float = UNMODIFIED,
) -> NominalStresses:
    """Compute sigma_H0 and sigma_F0 of all kinds of mesh under the mean load of a planet.

    Parameters
    ----------
    gears : GearSet
        A planetary set or a pair.
    torque : float
        On the sun or gear 1, of either sign [N m].
    material : Material or sequence of Material
        Of all gears, or one for each.
    edition, grade, modified
        As for `femgear.gears.iso6336_root.nominal_root_stress` and `single_pair_factors`.
    """
    # torque over reference radius: the same at all gears
    force = abs(torque) / (gears.n_planets * gears.gears[0].reference_radius)
    elastic = [
        (of_gear.youngs_modulus, of_gear.poisson_ratio) for of_gear in material_of_each(material, len(gears.gears))
    ]
    contact, root = np.full(len(gears.kinds), math.nan), np.full((len(gears.kinds), 2), math.nan)
    ratio_factor, single, messages, roots = contact.copy(), root.copy(), list[str](), list[tuple]()
    for i, pair in enumerate(gears.kinds):
        gear_1, gear_2 = pair.gears
        small, large = (gear_1, gear_2) if gear_2.internal or gear_1.teeth <= gear_2.teeth else (gear_2, gear_1)
        load: dict[str, Any] = {"contact_ratio": pair.contact_ratio, "tangential_force": force}
        angle, ((modulus, ratio), mate) = pair.working_pressure_angle, (elastic[n] for n in gears.mates[i])
        try:
            elasticity: dict[str, Any] = {"youngs_modulus": modulus, "poisson_ratio": ratio, "mate": mate}
            contact[i] = nominal_contact_stress(small, large, working_angle=angle, **elasticity, **load)
            ratio_factor[i] = contact_ratio_factor(pair.contact_ratio, overlap_of(small, pair.face_width))
            single[i] = single_pair_factors(
                gear_1, gear_2, working_angle=angle, path=pair.path, edition=edition, modified=modified
            )
        except GeometryError as error:
            messages.append(f"{gear_1.name}-{gear_2.name}: {error.message}")
        of_kind = list[NominalRootStress | None]()
        for j, gear in enumerate((gear_1, gear_2)):
            try:
                of_kind.append(
                    nominal_root_stress(gear, common_width=pair.face_width, edition=edition, grade=grade, **load)
                )
                root[i, j] = of_kind[-1].stress  # type: ignore[union-attr]
            except GeometryError as error:
                of_kind.append(None)
                messages.append(f"{gear.name} in {gear_1.name}-{gear_2.name}: {error.message}")
        roots.append(tuple(of_kind))
    return NominalStresses(
        contact, root, ratio_factor, "; ".join(dict.fromkeys(messages)), single, tuple(roots), edition
    )


def case_stresses(case: Any, torque: float, strength: StrengthSection | None = None) -> NominalStresses:
    """Compute the nominal stresses of the gears of a case by the edition and class of its section ``strength``.

    Torque on the sun or gear 1 [N m]; a gearbox gives the ``strength`` of its stages.
    """
    given = case.strength if strength is None else strength
    return nominal_stresses(
        planetary_set(case),
        torque,
        materials_of(case),
        edition=given.edition,
        grade=given.quality,
        modified=MODIFIED[flank_modification(case, given)],
    )


def flank_modification(case: Any, strength: StrengthSection) -> str:
    """Tell how flanks are modified, as the entry ``strength.modification`` does.

    Where it is not given, ``"experience"`` of cases whose flanks have modifications, else ``"none"``.
    """
    if strength.modification is not None:
        return strength.modification
    modified = any(getattr(case, gear).modifications for gear in case.gear_names)
    return "experience" if modified else "none"


def standard_factors(
    case: Any,
    kind: int,
    *,
    torque: float,
    mesh_frequency: float,
    application: float,
    face: float | None,
    quality: int,
) -> StandardFactors:
    """Compute the load factors of part 1 of a kind of mesh of a case.

    Parameters
    ----------
    case : case of gears
        With materials, and the limits that tell how flanks run in.
    kind : int
        Number of the kind of mesh.
    torque : float
        On the sun or gear 1 [N m].
    mesh_frequency : float
        [Hz]
    application : float
        ``K_A K_gamma``.
    face : float or None
        K_Hbeta; None has it by method C, see `femgear.gears.iso6336_load.mesh_misalignment_of_tolerances`.
    quality : int
        Flank tolerance class of ISO 1328-1.

    Raises
    ------
    GeometryError
        Sizes or classes that the standards do not cover (E-ISO1328, E-ISO6336).
    """
    gears: GearSet = planetary_set(case)
    pair, numbers = gears.kinds[kind], gears.mates[kind]
    pinion = min((gear for gear in pair.gears if not gear.internal), key=lambda gear: gear.teeth)
    turning = 2.0 * math.pi * mesh_frequency / pinion.teeth
    force = application * abs(torque) / (gears.n_planets * gears.gears[0].reference_radius)
    line_load, helix = force / pair.face_width, abs(case.helix_angle or 0.0)
    single, mean = (
        _elastic_factor(case, numbers) * line_load_factor(line_load) * value
        for value in pair_mesh_stiffness(pair, helix)
    )
    pitch, profile = _effective_deviations(case, pair, numbers, quality, turning * pinion.reference_radius)
    overlap = overlap_of(pinion, pair.face_width)
    dynamic = dynamic_factor(
        resonance_ratio=turning / resonance_speed(pinion.teeth, mean, _mass(case, gears, numbers)),
        line_load=line_load,
        stiffness=single,
        contact_ratio=pair.contact_ratio + overlap,
        pitch_deviation=pitch,
        profile_deviation=profile,
    )
    ratio = max(gear.teeth for gear in pair.gears) / pinion.teeth
    by_speed = math.nan
    if quality >= 3:
        speed = {"teeth": pinion.teeth, "speed": turning * pinion.reference_radius, "ratio": ratio}
        by_speed = dynamic_factor_of_speed(grade=quality, line_load=line_load, overlap=overlap, **speed)
    speed_of_pitch = turning * pinion.reference_radius
    over_width = _face_factor(case, gears, kind, quality, line_load * dynamic.factor, mean, speed_of_pitch)
    transverse = transverse_load_factors(
        line_load=line_load * dynamic.factor * (over_width if face is None else face),
        mesh_stiffness=mean,
        contact_ratio=pair.contact_ratio,
        overlap=overlap,
        pitch_deviation=pitch,
    )
    return StandardFactors(dynamic, by_speed, *transverse, over_width)


def _face_factor(
    case: Any, gears: GearSet, kind: int, quality: int, line_load: float, stiffness: float, speed: float
) -> float:
    """K_Hbeta by method C at a line load [N/m], with c_gammaalpha [N/m^2] and the pitch line velocity [m/s]."""
    pair, numbers = gears.kinds[kind], gears.mates[kind]
    first, second = (tolerances_of_gear(gear, quality).helix_slope for gear in pair.gears)
    pinion = None if gears.members else 2.0 * min(gear.reference_radius for gear in pair.gears)
    misalignment = mesh_misalignment_of_tolerances(
        line_load, (first, second), width=pair.face_width, pinion_diameter=pinion
    )
    limits = [gear_material(case, case.gear_names[number]).contact_stress_limit for number in numbers]
    taken = [
        face_running_in(misalignment, _running(limit), contact_limit=limit or HARDENED, speed=speed) for limit in limits
    ]
    return face_load_factor(misalignment - 0.5 * sum(taken), line_load, BENDING_SHARE * stiffness)


def _elastic_factor(case: Any, numbers: tuple[int, int]) -> float:
    """E/E_St of both gears of a kind of mesh."""
    materials = materials_of(case)
    first, second = (materials[number].youngs_modulus for number in numbers)
    return material_factor(first, second)


def _effective_deviations(
    case: Any, pair: GearPair, numbers: tuple[int, int], quality: int, speed: float
) -> tuple[float, float]:
    """Larger f_pb and f_falpha of both gears [m], less what runs in at a pitch line velocity [m/s]."""
    tolerances = [tolerances_of_gear(gear, quality) for gear in pair.gears]
    pitch = max(of_gear.base_pitch(pair.gear_1.pressure_angle) for of_gear in tolerances)
    profile = max(of_gear.profile_form for of_gear in tolerances)
    limits = [gear_material(case, case.gear_names[number]).contact_stress_limit for number in numbers]
    left = []
    for deviation in (pitch, profile):
        taken = [
            running_in(deviation, _running(limit), contact_limit=limit or HARDENED, speed=speed) for limit in limits
        ]
        left.append(deviation - 0.5 * sum(taken))
    return left[0], left[1]


def _running(limit: float | None) -> Running:
    return "surface hardened" if limit is None or limit > HARDENED else "through hardened"


def _mass(case: Any, gears: GearSet, numbers: tuple[int, int]) -> float:
    """Reduced mass of a mesh per face width [kg/m]: sun and ring shared by the planets, a fixed member endless."""
    masses = list[float]()
    for number in numbers:
        gear, name = gears.gears[number], case.gear_names[number]
        share = gears.n_planets if gears.repeated[BRANCH] and number != BRANCH else 1
        fixed = getattr(case.operation, "fixed", None) == name
        masses.append(math.inf if fixed else disc_inertia(gear, gear_material(case, name).density) / share)
    first, second = sorted(masses)
    return reduced_mass(first, second)


def mesh_frequencies(case: Any) -> tuple[float, ...]:
    """Compute the mesh frequencies of a case at its operating speeds [Hz]."""
    gears, operation = planetary_set(case), case.operation
    if not gears.repeated[BRANCH]:
        return tuple(speed * gears.gears[0].teeth / (2.0 * math.pi) for speed in operation.speeds)
    return tuple(
        abs(speeds(gears, input=operation.input, fixed=operation.fixed, speed=speed).mesh_frequency)
        for speed in operation.speeds
    )


def mesh_load_factors(
    case: Any,
    torque: float,
    *,
    sharing: np.ndarray | None = None,
    dynamic: np.ndarray | None = None,
    face: np.ndarray | None = None,
    frequencies: Sequence[float] = (),
    strength: StrengthSection | None = None,
) -> tuple[MeshLoadFactors, tuple[StandardFactors | None, ...]]:
    """Collect the load factors of all kinds of mesh of a case, computed ones and those of part 1.

    Parameters
    ----------
    case : case of gears
        With its section ``strength``, unless that of a gearbox is given.
    torque : float
        On the sun or gear 1 [N m].
    sharing, dynamic, face : (k,) arrays, optional
        Computed K_gamma, K_v and K_Hbeta.
    frequencies : sequence of float
        Mesh frequencies [Hz], of which part 1 takes that with the largest K_v.
    strength : StrengthSection, optional
        In place of the case's.

    Returns
    -------
    factors : MeshLoadFactors
    standard : tuple of StandardFactors or None
        Those of part 1 by kind of mesh, None where no class or speed is given.
    """
    given, gears = case.strength if strength is None else strength, planetary_set(case)
    ones, sources = np.ones(len(gears.kinds)), dict[str, str]()
    computed = {"sharing": sharing, "dynamic": dynamic, "face": face}
    sources |= {name: "computed" for name, values in computed.items() if values is not None}
    by_deviations, width = face is None and _has_given_meshes(case), ones if face is None else face
    sharing = ones if sharing is None else sharing
    standard, messages = list[StandardFactors | None](), list[str]()
    for kind in range(len(gears.kinds)):
        application = given.application_factor * float(sharing[kind])
        load = {"application": application, "face": None if by_deviations else float(width[kind])}
        try:
            standard.append(_largest_standard(case, kind, frequencies, torque=torque, quality=given.quality, **load))
        except GeometryError as error:
            standard.append(None)
            messages.append(error.message)
    transverse, root_transverse, of_part_1, over_width = (ones.copy() for _ in range(4))
    for kind, factors in enumerate(standard):
        if factors is not None:
            transverse[kind], root_transverse[kind] = factors.transverse, factors.root_transverse
            of_part_1[kind], over_width[kind] = factors.dynamic.factor, factors.face
    if any(standard) and by_deviations:
        width, sources["face"] = over_width, f"part 1, method C, class {given.quality}, shafts and bearings rigid"
    if any(standard):
        sources["transverse"] = f"part 1, class {given.quality}"
        sources.setdefault("dynamic", f"part 1, method B, class {given.quality}")
    dynamic = of_part_1 if dynamic is None else dynamic
    factors = MeshLoadFactors(
        given.application_factor,
        sharing,
        dynamic,
        width,
        transverse,
        root_transverse,
        sources,
        "; ".join(dict.fromkeys(messages)),
        _has_given_meshes(case),
    )
    return factors, tuple(standard)


def _has_given_meshes(case: Any) -> bool:
    """Whether the meshes of a planar or helical case have a given stiffness."""
    sections = (getattr(case, name, None) for name in ("planar", "helical"))
    return any(section is not None and section.mesh_stiffness is not None for section in sections)


def _largest_standard(
    case: Any, kind: int, frequencies: Sequence[float], *, quality: int | None, **load: Any
) -> StandardFactors | None:
    """Factors of part 1 at the mesh frequency with the largest K_v; None without a class, a load or a speed."""
    if quality is None or not frequencies or load["torque"] == 0.0:
        return None
    rated = [standard_factors(case, kind, mesh_frequency=f, quality=quality, **load) for f in frequencies]
    return max(rated, key=lambda factors: factors.dynamic.factor)


@dataclass(frozen=True)
class Rating:
    """Rating of all flanks of the gears of a case.

    Parameters
    ----------
    flanks : tuple of RatedFlank
        By kind of mesh and gear.
    nominal : NominalStresses
        Without load factors.
    factors : MeshLoadFactors
        Those of the safeties.
    standard : tuple of StandardFactors or None
        Of part 1, by kind of mesh.
    """

    flanks: tuple[RatedFlank, ...]
    nominal: NominalStresses
    factors: MeshLoadFactors
    standard: tuple[StandardFactors | None, ...]


def rate_case(
    case: Any,
    *,
    torque: float | None = None,
    sharing: np.ndarray | None = None,
    dynamic: np.ndarray | None = None,
    face: np.ndarray | None = None,
    frequencies: Sequence[float] | None = None,
    strength: StrengthSection | None = None,
) -> Rating:
    """Rate all flanks of the gears of a case, each gear with the limits of its own material.

    Parameters
    ----------
    torque : float, optional
        On the sun or gear 1 [N m], by default the case's.
    frequencies : sequence of float, optional
        Mesh frequencies [Hz], by default those of the operating speeds.
    sharing, dynamic, face : (k,) arrays, optional
        Load factors, see `mesh_load_factors`.
    strength : StrengthSection, optional
        By default that of the case.
    """
    driving = float(case.torque_on_first_gear() if torque is None else torque)
    nominal = case_stresses(case, driving, strength)
    computed: dict[str, Any] = {"sharing": sharing, "dynamic": dynamic, "face": face}
    turning = mesh_frequencies(case) if frequencies is None else frequencies
    factors, standard = mesh_load_factors(case, driving, frequencies=turning, strength=strength, **computed)
    return Rating(tuple(_flanks(case, planetary_set(case), nominal, factors)), nominal, factors, standard)


def _flanks(case: Any, gears: GearSet, nominal: NominalStresses, factors: MeshLoadFactors) -> Iterator[RatedFlank]:
    for kind, (pair, numbers) in enumerate(zip(gears.kinds, gears.mates, strict=True)):
        titles = SIDES.get(f"{pair.gear_1.name}-{pair.gear_2.name}") or tuple(
            gear.name.replace("_", " ") for gear in pair.gears
        )
        for j, number in enumerate(numbers):
            name = case.gear_names[number]
            material = gear_material(case, name)
            yield RatedFlank(
                name=titles[j],
                gear=name,
                kind=kind,
                root_stress=float(nominal.root[kind, j]),
                contact_stress=float(nominal.contact[kind] * nominal.single_pair[kind, j]),
                single_pair=float(nominal.single_pair[kind, j]),
                root=nominal.roots[kind][j],
                root_factor=float(factors.root[kind]),
                contact_factor=float(factors.contact[kind]),
                root_limit=material.root_stress_limit,
                contact_limit=material.contact_stress_limit,
                reversed_bending=gears.repeated[number],
            )


def rating_wanted(case: Any) -> bool:
    """Tell whether a case asks for safeties: by a section ``strength`` or by a limit of a material."""
    limits = (gear_material(case, gear) for gear in case.gear_names)
    given = "strength" in case.model_fields_set
    return given or any(material.root_stress_limit or material.contact_stress_limit for material in limits)


def with_rim_doubts(findings: Iterable[Finding], case: Any) -> Iterator[Finding]:
    """Put the doubts of `thin_rims` in the place of the notes on the same rims, among the findings of gears."""
    doubts = {finding.key: finding for finding in thin_rims(case)}
    for finding in findings:
        if finding.code != "W-RIM" or finding.key not in doubts:
            yield finding
    yield from doubts.values()


def thin_rims(case: Any) -> Iterator[Finding]:
    """List the gears whose root stress rests on a thin rim that no number has (W-RIM, a doubt).

    S_F has the influence of a rim by Y_B of ISO 6336-3, down to half a tooth height (of rings 1.75 modules): thinner
    rims of rated gears are a doubt. Without S_F only finite elements give a root stress, and they hold the bore of a
    gear rigid: rims of less than 1.2 tooth heights, above which Y_B is 1, are a doubt then.
    """
    for name, gear in zip(case.gear_names, planetary_set(case).gears, strict=True):
        rated, beyond = gear_material(case, name).root_stress_limit is not None, rim_beyond_range(gear)
        key = f"{name}.{'outer_radius' if gear.internal else 'bore_radius'}"
        if rated and beyond is not None:
            thickness, limit = beyond
            unit = "modules" if gear.internal else "tooth heights"
            yield Finding(
                "W-RIM",
                key,
                f"the rim of {gear_words(name)} is {thickness:.3g} {unit} thick: its S_F and life rest on a rim "
                "factor Y_B outside its range",
                remedy="a thicker rim",
                severity=DOUBT,
                limit=f"more than {limit:g} {unit} (ISO 6336-3)",
                concerns=gear_words(name).removeprefix("the "),
            )
        elif not rated and not gear.internal and (factor := rim_factor_of(gear)) > 1.0:
            yield Finding(
                "W-RIM",
                key,
                f"the rim of {gear_words(name)} is thin and its bore held rigid, as by a solid shaft; where the rim "
                f"stands free ISO 6336-3 raises its root stress by Y_B = {factor:.2f}, which no S_F has in this case",
                remedy="give material.treatment and hardness for an S_F with Y_B, or a thicker rim",
                severity=DOUBT,
                limit=">= 1.2 tooth heights",
                concerns=gear_words(name).removeprefix("the "),
            )
