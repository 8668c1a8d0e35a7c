"""Stages "static" and "stress": static.nc, stress.nc, their tables and warnings, and those of the set itself.

Every variable of a file carries its units. The table of stresses sets those of finite elements beside the
nominal stresses of ISO 6336. Phases of the meshes decide which of their harmonics sun and ring hear, and
which kinds of modes these excite; neighbouring tooth numbers are listed with what they would change in that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.checks import steep_helix
from femgear.case.dependencies import Entries
from femgear.case.gear_set import planetary_set, set_deviations, shaft_lines
from femgear.case.quantities import RPM
from femgear.case.sections import face_width, gear_material
from femgear.case.teeth import case_overlap
from femgear.case.tooth_friction import friction_findings
from femgear.contact.bodies import flank_widths
from femgear.contact.peaks import FEWEST, peak_doubt, tooth_pair_codes
from femgear.contact.root_stress import BACK, LOADED, NOTCH_REACH, RootCycle
from femgear.contact.slices import PARTS as SLICES
from femgear.findings import DOUBT, Finding, findings_in, percent
from femgear.gears.checks import check_set, tip_clearances
from femgear.gears.deviations import check_deviations
from femgear.gears.friction import path_speeds
from femgear.gears.gear import Gear, tooth_thickness
from femgear.gears.iso6336 import bending_face_factor, contact_helix_factor, helix_of, relative_curvature
from femgear.gears.kinematics import speeds, torques
from femgear.gears.pair import BRANCH, GearSet
from femgear.gears.phasing import KINDS, ZERO, neighbouring_teeth, phasing_of_set, phasing_table
from femgear.gears.profile import base_helix_angle, overlap_ratio
from femgear.gears.tooth import ROOT_RADIUS_LIMIT, root_notches
from femgear.report.style import family
from femgear.report.tables import Block, Marks, chosen, significant, tabulate
from femgear.stages.drawing_tables import describe_drawing
from femgear.stages.protocol import StageResult
from femgear.stages.strength import SIDES, NominalStresses, with_rim_doubts
from femgear.stages.stress_reasons import largest_pressure, over_hertz, reason_values, stress_reasons
from femgear.stages.tooth_faults import describe_faults, fault_findings
from femgear.storage.contents import Contents
from femgear.storage.results import coordinates, declared

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.planetary import Case
    from femgear.case.teeth import GearCase
    from femgear.contact.bodies import Bodies, Sectors
    from femgear.contact.mesh_cycle import MeshCycle
    from femgear.contact.root_stress import RootRange, RootStresses
    from femgear.contact.tooth_loads import LoadSpectrum
    from femgear.contact.width_waves import WidthWaves
    from femgear.gears.planetary import PlanetarySet

_COUNTING = (
    "one load cycle an engagement, from zero to the largest load of the tooth (peak counting between "
    "crossings of zero, ASTM E1049)"
)
HELD = "gear axes fixed"
SERIES = "of planet-ring with the ring's foundation; the STE with all supports"
"""What mesh stiffness and transmission error contain where members move."""
_PIN_FORCE = "force of the pin on the planet in the frame of the carrier"
_EQUIDISTANT = "{} at equidistant positions, which cut peaks off; its peak to peak: {}_peak_to_peak"
STATIC_VARIABLES = {
    "ste": ("mesh position", "m", _EQUIDISTANT.format("static transmission error of the mesh", "ste")),
    "ste_overall": (
        "planet position",
        "m",
        _EQUIDISTANT.format("static transmission error from sun to ring", "ste_overall"),
    ),
    "mesh_force": ("mesh position", "N", "mesh force along the line of action"),
    "back_force": ("mesh position", "N", "force on the back flanks of the mesh"),
    "member_motion": ("member position", "m", "displacement of the axis of a member that moves"),
    "bearing_force": ("planet axis position", "N", _PIN_FORCE),
    "mesh_stiffness": (
        "mesh position",
        "N/m",
        _EQUIDISTANT.format("tangent mesh stiffness", "mesh_stiffness"),
    ),
    "mesh_stiffness_secant": ("mesh position", "N/m", "secant mesh stiffness"),
    "tooth_load": ("mesh tooth position", "N", "load of a tooth pair"),
    "back_tooth_load": ("mesh tooth position", "N", "load of a tooth pair on its back flanks"),
    "load_share": (
        "planet position",
        "1",
        "share of the planet in the torque at equidistant positions; its largest: largest_load_share",
    ),
    "max_pressure": (
        "mesh position",
        "Pa",
        "largest contact pressure away from flank ends at equidistant positions; of all: largest_pressure",
    ),
    "edge_contact": ("mesh position", "1", "whether a contact reaches the end of a flank"),
    "residual": ("position", "1", "residual of contact conditions and equilibrium"),
    "iterations": ("position", "1", "steps of the active set"),
}
"""Variables of static.nc: dimensions, unit, and what they are."""
_PEAK = "peak to peak of the {} over the record and the positions between"
_MEAN = "mean of the {} over the record and the positions between"
_LARGEST = "largest contact pressure away from flank ends over the record and the positions between"
PEAK_VARIABLES = {
    "ste_mean": ("mesh", "m", _MEAN.format("static transmission error of the mesh")),
    "mesh_stiffness_mean": ("mesh", "N/m", _MEAN.format("tangent mesh stiffness")),
    "largest_pressure": ("mesh", "Pa", _LARGEST),
    "ste_peak_to_peak": ("mesh", "m", _PEAK.format("static transmission error of the mesh")),
    "ste_overall_peak_to_peak": ("planet", "m", _PEAK.format("transmission error from sun to ring")),
    "mesh_stiffness_peak_to_peak": ("mesh", "N/m", _PEAK.format("tangent mesh stiffness")),
    "smallest_load_share": ("planet", "1", "smallest share of the planet in the torque"),
    "largest_load_share": ("planet", "1", "largest share of the planet in the torque"),
    "ste_between": ("mesh between", "m", "transmission error of the mesh at the positions between"),
    "ste_overall_between": ("planet between", "m", "that from sun to ring at the positions between"),
    "mesh_stiffness_between": ("mesh between", "N/m", "tangent mesh stiffness at the positions between"),
}
"""Extremes and means, and further positions at which extremes lie."""
FRICTION_VARIABLES = {
    "friction_force": ("mesh position", "N", "friction force of gear 1 on gear 2 along the tangent, as flank 1 moves"),
    "friction_moment": ("mesh position", "N m", "moment of these forces about the pitch point"),
}
"""Variables of static.nc where friction acts (`losses.excites`)."""
SLICE_VARIABLES = {
    "slice_load": ("mesh tooth slice position", "N", "load of a tooth pair in a slice, times their number"),
    "face_load_factor": (
        "mesh",
        "1",
        "K_H-beta: largest load of a 25th of the width over the mean of its tooth pair",
    ),
    "slice_pressure": ("mesh tooth slice position", "Pa", "largest pressure of a tooth pair in a slice"),
    "mesh_misalignment": (
        "mesh position",
        "m",
        "misalignment of the mesh under load over the face width, closer at z > 0 positive",
    ),
    "lead_offset": ("mesh position", "m", "smallest separation by leads and given misalignments"),
    "member_tilt": (
        "tilt position",
        "rad",
        "slope of the axis of a member that tilts, wind-up of the carrier",
    ),
}
"""Further ones of contact in slices over the width."""
HELIX_VARIABLES = {
    "axial_force": ("mesh position", "N", "axial force of gear 1 on gear 2, positive towards +z"),
    "planet_couple": ("planet position", "N m", "couple of the axial forces that tilts a planet"),
}
"""Further ones of helical teeth; all others are those of the transverse section."""
_ENDS = 0.2, 5.0
"""By how much free ends soften a mesh, times face width over normal module: of spur teeth, and what helical
ones add over the square of tan beta. From solid pairs of 0, 10 and 20 degrees, rows *finite* of
docs/validation.md."""
_SPUR_ENDS = {"softer": 0.23, "aligned": 0.21, "slope": 1.0}
"""Of spur teeth, times face width over module: by what share free ends soften a mesh, by how much they raise
K_H-beta of aligned flanks above 1, by what share they lower K_H-beta - 1 under a slope. From solid gears:
softer by 3.4 % at 6.7 and 2.4 % at 9.2 modules, 1.032 at 6.7, 12 to 17 % at 6.7 and 6 % at 16.7 modules (rows
*ends* and *finite* of docs/validation.md)."""
_NOTED_ENDS = 0.025
"""Share by which free ends soften meshes of spur teeth in slices without a word."""
_ATTRIBUTES = {
    "ste": "deflection",
    "ste_overall": "overall_deflection",
    "mesh_force": "force",
    "mesh_stiffness": "stiffness",
    "mesh_stiffness_secant": "secant_stiffness",
}
"""Attributes of the mesh cycle whose variables have another name."""
_PRESSURE = "contact pressure in the cells of a tooth pair"
_CELL_PLACE = "place of a cell along the common tangent from the middle of its window"
_TIME_SHARE = "share of the time under load that a tooth spends in the load class"
_CYCLE_SHARE = "share of the load cycles whose largest load lies in the load class"
_CYCLES = "load cycles of this flank of a tooth per turn of the gear against the carrier"
_HIGHEST = "largest stress over a turn at the point of the root with the widest range"
_TURN = "stress over a turn at the point of the planet's root with the widest range"
_OF_TOOTH = "stress of every tooth at the point of its root with the widest range"
STRESS_VARIABLES = {
    "root_tension": ("mesh gear step", "Pa", "largest stress in the root of the loaded flank"),
    "root_compression": ("mesh gear step", "Pa", "lowest stress in the root of the back flank"),
    "root_path": ("mesh gear step", "1", "path from the pitch point in base pitches"),
    "root_load": ("mesh gear step", "N", "load of the tooth pair"),
    "root_over_width": ("mesh gear step slice", "Pa", "largest stress in the loaded root by slice"),
    "root_face_factor": ("mesh gear", "1", "K_F-beta: largest root stress over its mean across the width"),
    "iso_face_factor": ("mesh", "1", "K_F-beta from K_H-beta, ISO 6336-1"),
    "root_profile": ("mesh gear root point", "Pa", "stress along the root at the largest tension"),
    "root_arc": ("mesh gear point", "m", "arc length from the end of the flank"),
    "root_slope": ("mesh gear point", "rad", "angle of the root to the centreline of the tooth"),
    "root_worst": ("mesh gear", "Pa", "largest stress in the root of the loaded flank"),
    "root_worst_arc": ("mesh gear", "m", "its arc length from the end of the flank"),
    "root_worst_slope": ("mesh gear", "rad", "its angle of the root to the centreline of the tooth"),
    "root_worst_position": ("mesh gear", "1", "its position in mesh periods"),
    "root_worst_path": ("mesh gear", "1", "its path from the pitch point in base pitches"),
    "root_range_maximum": ("mesh gear", "Pa", _HIGHEST),
    "root_range_minimum": ("mesh gear", "Pa", "smallest stress there"),
    "root_range_arc": ("mesh gear", "m", "arc length of that point from the end of the flank"),
    "planet_root_stress": ("mesh turn", "Pa", _TURN),
    "tooth_root_maximum": ("mesh gear tooth", "Pa", f"largest {_OF_TOOTH}"),
    "tooth_root_minimum": ("mesh gear tooth", "Pa", f"smallest {_OF_TOOTH}"),
    "contact_pressure": ("mesh position", "Pa", "largest contact pressure away from flank ends"),
    "pressure_distribution": ("mesh pair cell position", "Pa", _PRESSURE),
    "pressure_offset": ("mesh cell", "m", _CELL_PLACE),
    "pressure_centre": ("mesh pair position", "m", "middle of the window from the path point"),
    "pressure_path": ("mesh pair position", "m", "path of the tooth pair from the pitch point"),
    "load_bin_low": ("load_bin", "N", "lower limit of the load class"),
    "load_bin_high": ("load_bin", "N", "upper limit of the load class"),
    "load_time_share": ("mesh load_bin", "1", _TIME_SHARE),
    "load_cycle_share": ("mesh load_bin", "1", _CYCLE_SHARE),
    "load_cycles": ("mesh gear", "1", _CYCLES),
    "loaded_contact_ratio": ("mesh", "1", "mesh periods a tooth pair is loaded"),
    "root_worst_load": ("mesh gear", "N", "load of its tooth pair then"),
    "root_notch_radius": ("mesh gear", "m", "smallest radius of curvature of the root"),
    "largest_pressure": ("mesh", "Pa", _LARGEST),
    "contact_worst_position": ("mesh", "1", "its position in mesh periods, of planets that are alike of one"),
    "contact_worst_path": (
        "mesh",
        "m",
        "path of the pair with the largest pressure, outwards on gear 1",
    ),
    "contact_worst_load": ("mesh", "N", "its load, in slices that of the slice times their number"),
    "contact_worst_curvature": ("mesh", "1", "relative curvature there over that at the pitch point"),
    "contact_worst_margin": ("mesh", "m", "from it to the end of the path of contact, negative beyond"),
    "contact_start": ("mesh gear", "m", "distance from the base circle at which contact begins, radially"),
    "relief_kink": ("mesh", "1", "whether reliefs of the mesh begin with a kink"),
    "iso_contact_ratio_factor": ("mesh", "1", "contact ratio factor Z_eps in it, ISO 6336-2"),
    "iso_contact_stress": ("mesh", "Pa", "nominal contact stress sigma_H0, ISO 6336-2"),
    "iso_root_stress": ("mesh gear", "Pa", "nominal root stress sigma_F0, ISO 6336-3 method B"),
    "iso_single_pair_factor": ("mesh gear", "1", "single pair factor Z_B or Z_D, ISO 6336-2"),
    "iso_rim_factor": ("mesh gear", "1", "rim factor Y_B in sigma_F0, ISO 6336-3"),
    "rim_thickness": ("mesh gear", "1", "thickness of the rim over the height of the teeth"),
    "contact_ratio": ("mesh", "1", "transverse contact ratio of the involutes"),
    "path_start": ("mesh", "1", "start of the path of contact from the pitch point in base pitches"),
    "path_end": ("mesh", "1", "end of the path of contact from the pitch point in base pitches"),
}
"""Variables of stress.nc; records of one mesh period have none of single teeth, longer ones no pressures.

Contact in slices has those over the width and no pressures of cells.
"""

LARGEST_PEAK_DOUBT = 0.03
"""Share of a peak to peak that may be missing between positions without a word (docs/validation.md)."""
_HARMONICS, _ROWS = 6, 8
"""Harmonics whose phasing is listed, and neighbouring sets."""
_DISTANCE, _TOLERANCE = 3, 0.02
"""How far teeth and ratio of neighbouring sets may lie away."""
_KINKED = 1.3
"""Largest pressure over that of Hertz with a kink in the contact that is told."""
UNEQUAL = 1.03
"""Share over the equal one with which planets are no longer taken as alike."""
LARGE = "W-DEFLECTION", "W-MOTION", "W-ENDS"
"""Findings that concern transmission errors and stiffnesses."""
LARGEST_PRESSURE = 4e9
"""Contact pressure that no steel carries [Pa]."""
_SHORT = dict(zip(KINDS, ("in", "counter", "sequential", "unequal")))


@dataclass(frozen=True)
class StaticResult(StageResult):
    """Static transmission error, load sharing and mesh stiffness of all meshes.

    Parameters
    ----------
    planetary_set : GearSet
        The set as the case has it.
    sectors : Sectors
        Finite element grids of one tooth of each gear.
    bodies : Bodies
        Flank compliances of the gears.
    cycle : MeshCycle
        The static solution over the record.
    sun_torque : float
        Torque on the sun [N m], with its sign.
    entries : Entries
        Entries of the case that the result depends on, as in the results that follow.
    period_message : str
        How the errors repeat.
    overlap_ratio : float
        Of helical teeth [1]; zero for spur teeth.
    base_helix_angle : float
        Of helical teeth [rad], positive where the sun is right-handed.
    waves : WidthWaves, optional
        What bodies yield across the width, where it is solved in slices.
    drawing : dict, optional
        Attributes that tell what a drawing carries, see `femgear.stages.drawing_tables.drawing_attributes`.
    """

    planetary_set: Any
    sectors: Sectors
    bodies: Bodies
    cycle: MeshCycle
    sun_torque: float
    entries: Entries
    period_message: str = ""
    overlap_ratio: float = 0.0
    base_helix_angle: float = 0.0
    waves: WidthWaves | None = None
    drawing: dict[str, Any] = field(default_factory=dict)

    @property
    def residual(self) -> float:
        """Largest violation of contact conditions and equilibrium, relative."""
        return float(self.cycle.residual.max())

    @property
    def message(self) -> str:
        """How contact was found."""
        return self.cycle.message

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what static.nc says against itself, see `static_warnings`."""
        return static_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of static.nc."""
        cycle, gears = self.cycle, self.planetary_set
        bodies = self.bodies.gears
        kinds = {f"{pair.gear_1.name}_{pair.gear_2.name}": pair for pair in gears.kinds}
        variables, width = STATIC_VARIABLES, min(gears.mesh_widths)
        if cycle.slice_load is not None:
            variables = variables | SLICE_VARIABLES
        if cycle.friction_force is not None:
            variables = variables | FRICTION_VARIABLES
        values = {name: getattr(cycle, _ATTRIBUTES.get(name, name)) for name in variables}
        if self.overlap_ratio:
            # a right-handed gear that turns another counter-clockwise pushes it towards -z
            sense = -math.copysign(math.tan(self.base_helix_angle), self.base_helix_angle * self.sun_torque)
            values["axial_force"] = sense * cycle.force
            if gears.members:
                values["planet_couple"] = self._planet_couple()
            variables = variables | {name: HELIX_VARIABLES[name] for name in HELIX_VARIABLES if name in values}
        values |= self._peaks()
        variables = variables | {name: PEAK_VARIABLES[name] for name in PEAK_VARIABLES if name in values}
        teeth, planets = cycle.tooth_load.shape[1], np.arange(1, gears.n_planets + 1)
        return Contents(
            declared(variables, values),
            coords=self._over_width(width)
            | self._places_between()
            | {
                "member": ("member", list(cycle.member_names), "1", "moving member and direction"),
                "tooth": ("tooth", np.arange(teeth), "1", "tooth pair in the order of the path"),
                **coordinates(mesh=gears.mesh_names, position=cycle.position, planet=planets, axis=["x", "y"]),
            },
            attrs={
                "title": "static transmission error, load sharing and mesh stiffness",
                **{
                    f"{name}_{kind}": getattr(pair, name)
                    for name in ("contact_ratio", "working_pressure_angle")
                    for kind, pair in kinds.items()
                },
                "mesh_phases": np.asarray(gears.mesh_phases),
                "planet_angles": np.asarray(gears.planet_angles),
                "centre_distance": gears.centre_distance,
                "face_width": width,
                "module": gears.gears[0].module,
                "overlap_ratio": abs(self.overlap_ratio),
                "free_ends": self._free_ends(),
                "teeth": np.array([gear.teeth for gear in gears.gears]),
                "sun_torque": self.sun_torque,
                **self.drawing,
                "contact": cycle.contact,
                "mesh_periods": cycle.periods,
                **self._doubt(),
                "period": self.period_message,
                "peaks_cut_off": self._cut_off(),
                "pressure_cells": cycle.unknowns,
                "unknowns": np.array([body.unknowns for body in bodies]),
                "message": cycle.message,
            },
        )

    def _peaks(self) -> dict[str, np.ndarray]:
        """Extremes and means of the record, and what was solved between its positions."""
        cycle, planets = self.cycle, np.ones(self.planetary_set.n_planets)
        share = cycle.extremes("load_share")
        peaks = {
            "ste_mean": cycle.mean("deflection"),
            "mesh_stiffness_mean": cycle.mean("stiffness"),
            "largest_pressure": cycle.extremes("max_pressure")[1],
            "ste_peak_to_peak": cycle.peak_to_peak(),
            "ste_overall_peak_to_peak": cycle.peak_to_peak("sun_arc") * planets,
            "mesh_stiffness_peak_to_peak": cycle.peak_to_peak("stiffness"),
            "smallest_load_share": share[0],
            "largest_load_share": share[1],
        }
        if (between := cycle.between) is not None:
            peaks["ste_between"] = between.deflection
            peaks["ste_overall_between"] = planets[:, None] * between.sun_arc
            peaks["mesh_stiffness_between"] = between.stiffness
        return peaks

    def _doubt(self) -> dict[str, float]:
        """Attribute peak_doubt: what the search for peaks has left, without one what spur curves show at positions.

        Of helical teeth ripple_doubt, that of the mesh stiffness.
        """
        cycle = self.cycle
        if cycle.between is not None:
            return {"peak_doubt": cycle.between.doubt}
        if not cycle.force.any():
            return {}
        if cycle.helical:
            return {"ripple_doubt": cycle.ripple_doubt}
        curves, pitch = np.concatenate([cycle.deflection, cycle.stiffness]), self.planetary_set.base_pitch
        codes, later = (
            tooth_pair_codes(cycle.path, cycle.tooth_load, cycle.position + after, pitch)
            for after in (0.0, float(cycle.periods))
        )
        other = (codes != np.column_stack([codes[:, 1:], later[:, 0]])).any(axis=0)
        return {"peak_doubt": _doubt_of_curves(cycle.position, curves, cycle.periods, other)}

    def _cut_off(self) -> float:
        """Find the largest share that equidistant positions cut off a transmission error's peak to peak."""
        whole = self.cycle.peak_to_peak()
        missed = whole - np.ptp(self.cycle.deflection, axis=-1)
        return float(np.divide(missed, whole, out=np.zeros(len(whole)), where=whole > 0.0).max())

    def _planet_couple(self) -> np.ndarray:
        """Couple (N, P) [N m] of the axial forces of sun and ring on every planet, at the working circles."""
        gears = self.planetary_set
        force = self.cycle.force.reshape(-1, gears.n_planets, len(self.cycle.position))
        arms = [gears.gears[BRANCH].base_radius / math.cos(pair.working_pressure_angle) for pair in gears.kinds]
        return math.tan(abs(self.base_helix_angle)) * np.einsum("k,knp->np", arms, force)

    def _free_ends(self) -> float:
        """Estimate by what share free ends make meshes in slices softer than mirror planes do."""
        gear = self.planetary_set.gears[0]
        if not self.overlap_ratio:
            in_slices = self.cycle.slice_load is not None
            return _SPUR_ENDS["softer"] * gear.module / gear.face_width if in_slices else 0.0
        slope = math.tan(self.base_helix_angle) / math.cos(gear.pressure_angle)
        normal_module = gear.module * math.cos(math.atan(slope))
        return (_ENDS[0] + _ENDS[1] * slope**2) * normal_module / min(self.planetary_set.mesh_widths)

    def _places_between(self) -> dict[str, Any]:
        """Coordinate of the positions between, where these were looked for."""
        if (between := self.cycle.between) is None:
            return {}
        return {"between": ("between", between.position, "1", "position between those of the record")}

    def _over_width(self, width: float) -> dict[str, Any]:
        """Coordinate of the slices, where there are any."""
        if self.cycle.slice_load is None:
            return {}
        count = self.cycle.slice_load.shape[2]
        return {
            "slice": _slice_places(width, count),
            "tilt": ("tilt", list(self.cycle.tilt_names), "1", "member and direction of its end z > 0"),
        }


def _slice_places(width: float, count: int) -> tuple:
    """Coordinate of the slices of a face width [m]."""
    place = width * ((np.arange(count) + 0.5) / count - 0.5)
    return "slice", place, "m", "place of a slice from the middle of the face width"


@dataclass(frozen=True)
class StressResult(StageResult):
    """Stresses of all meshes and gears over the mesh cycle.

    Parameters
    ----------
    planetary_set : GearSet
        The set as the case has it.
    cycle : MeshCycle
        The static solution that it belongs to.
    influences : RootStresses
        Stress along the roots per unit flank load [Pa/N].
    roots : tuple of RootCycle
        Gear 1 and gear 2 of mesh 0, then of mesh 1, and so on; of records beyond
        `femgear.stages.static.WHOLE_RECORD` mesh periods those periods in which the worst tooth of
        that gear passes the mesh.
    first_period : (4N,) int array
        Mesh period of the record with which each of `roots` begins.
    ranges : tuple of RootRange
        In the same order.
    between : tuple of tuple of RootCycle
        The same gears and meshes as those of `roots`, for every record of positions between.
    spectrum : LoadSpectrum
        Loads of the teeth of every mesh over time.
    nominal : NominalStresses
        Nominal stresses of ISO 6336 at the same load, for comparison.
    sun_torque : float
        [N m]
    closes : bool
        Whether the record repeats after its end. Where it does not, a tooth that the end of the record cuts
        off is followed on from the beginning of the record.
    relief_kinks : tuple of bool
        Whether flanks of both kinds of mesh have reliefs that begin with a kink; empty for none.
    """

    planetary_set: Any
    cycle: MeshCycle
    influences: RootStresses
    roots: tuple[RootCycle, ...]
    first_period: np.ndarray
    ranges: tuple[RootRange, ...]
    spectrum: LoadSpectrum
    nominal: NominalStresses
    sun_torque: float
    closes: bool
    relief_kinks: tuple[bool, ...] = ()
    between: tuple[tuple[RootCycle, ...], ...] = ()

    @property
    def message(self) -> str:
        """What the stresses rest on."""
        return "linear, from the loads of the static solution"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what stress.nc says against itself, see `stress_warnings`."""
        return stress_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of stress.nc."""
        cycle, edges = self.cycle, self.spectrum.edges
        values: dict[str, Any] = root_values(self.roots) | self.worst_roots() | self._ranges() | self._loads()
        values |= self._contacts() | reason_values(self.planetary_set, self.nominal)
        values["contact_pressure"] = cycle.max_pressure
        if cycle.pressure is not None:
            values |= {
                "pressure_distribution": cycle.pressure,
                "pressure_offset": cycle.pressure_offset,
                "pressure_centre": cycle.pressure_centre,
                "pressure_path": cycle.path,
            }
        coords = coordinates(mesh=self.planetary_set.mesh_names, position=cycle.position) | {
            "gear": ("gear", ["first", "second"], "1", "gear of the mesh"),
            "root": ("root", ["loaded", "back"], "1", "flank above the root"),
            "load_bin": ("load_bin", 0.5 * (edges[1:] + edges[:-1]), "N", "middle of the load class"),
        }
        if cycle.slice_load is not None:
            values |= self._over_width()
            width = min(self.planetary_set.mesh_widths)
            coords["slice"] = _slice_places(width, cycle.slice_load.shape[2])
        if "planet_root_stress" in values:
            n = values["planet_root_stress"].shape[1]
            words = "turns of the planet against the carrier since the pitch point with the sun"
            coords["turn"] = ("turn", (np.arange(n) - n // 4) / n, "1", words)
        attributes = {
            "title": "root stresses, contact pressures and load spectra",
            "sun_torque": self.sun_torque,
            "mesh_periods": cycle.periods,
            "repeats": int(self.closes),
            "module": self.planetary_set.gears[0].module,
            "nominal_load": self._nominal_load,
            "iso_contact_helix_factor": contact_helix_factor(helix_of(self.planetary_set.gears[0])[0]),
            "load_counting": _COUNTING,
            "iso": self.nominal.message,
            "iso_edition": self.nominal.edition,
        }
        return Contents(declared(STRESS_VARIABLES, values), coords, attributes)

    def worst_roots(self) -> dict[str, np.ndarray]:
        """Find the largest stress in the root of the loaded flank of every gear in every mesh, and its place.

        Over the record and the positions between, by the names of `STRESS_VARIABLES`, (meshes, 2, ...) each.
        """
        rows, position = [], self.cycle.position
        each = len(position) // self.cycle.periods
        for root, first in zip(self.roots, self.first_period, strict=True):
            at = root.worst[1]
            rows.append(_worst_of(root, float(position[(first * each + at) % len(position)])))
        if self.cycle.between is not None:
            for record, roots in zip(self.cycle.between.records, self.between, strict=True):
                others = [_worst_of(root, float(record.position[root.worst[1]])) for root in roots]
                rows = [max(pair, key=itemgetter(0)) for pair in zip(rows, others, strict=True)]
        parts = ("arc", "slope", "position", "path", "load")
        names = ("root_worst", *(f"root_worst_{name}" for name in parts), "root_profile")
        largest = dict(zip(names, map(_by_gear, zip(*self._largest_of_alike(rows))), strict=True))
        notches = [[root_notches(gear)[1] for gear in pair.gears] for pair in self.planetary_set.kinds]
        return largest | {"root_notch_radius": self.planetary_set.of_kinds(notches)}

    def _largest_of_alike(self, rows: list[tuple]) -> list[tuple]:
        """Give all planets that go through the same states the row, gear by gear, whose first is largest.

        The positions between are those of one of them.
        """
        N, alike = self.planetary_set.n_planets, self.cycle.alike
        return [
            max((rows[2 * n + root.gear] for n in _alike(root.mesh, N, alike)), key=itemgetter(0))
            for root in self.roots
        ]

    @property
    def _nominal_load(self) -> float:
        """Load of a mesh along the line of action under equal shares [N]."""
        s = self.planetary_set
        return abs(self.sun_torque) / (s.n_planets * s.gears[0].base_radius)

    def _contacts(self) -> dict[str, np.ndarray]:
        """Place, load and curvature of the tooth pair with the largest pressure of every mesh."""
        s = self.planetary_set
        rows, starts = [], []
        for mesh, pair in enumerate(s.kinds[kind] for kind in s.mesh_kind):
            angle, (low, high) = pair.working_pressure_angle, pair.path
            position, place, load = self._most_pressed(mesh)
            at, pitch = (
                relative_curvature(*pair.gears, working_angle=angle, path=path)
                for path in (float(np.clip(place, low, high)), 0.0)
            )
            rows.append((position, place, load, at / pitch, min(place - low, high - place)))
            length_1, length_2 = (gear.base_radius * math.tan(angle) for gear in pair.gears)
            rolls = length_1 + low, (length_2 + low if pair.gear_2.internal else length_2 - high)
            starts.append(
                [
                    math.hypot(gear.base_radius, roll) - gear.base_radius
                    for gear, roll in zip(pair.gears, rolls, strict=True)
                ]
            )
        parts = "position", "path", "load", "curvature", "margin"
        names = [f"contact_worst_{part}" for part in parts]
        kinks = self.relief_kinks or (False,) * len(s.kinds)
        return dict(zip(names, np.array(rows).T, strict=True)) | {
            "largest_pressure": self.cycle.extremes("max_pressure")[1],
            "contact_start": np.array(starts),
            "relief_kink": s.of_kinds(np.array(kinks, dtype=int)),
        }

    def _most_pressed(self, mesh: int) -> tuple[float, float, float]:
        """Position, path [m] and load [N] of the tooth pair of a mesh with its `largest_pressure`."""
        cycle, between = self.cycle, self.cycle.between
        records = [cycle] if between is None else [cycle, between]
        # of planets that go through the same states the pair of that which the positions between enclose
        meshes = _alike(mesh, self.planetary_set.n_planets, cycle.alike)
        walked, mesh = max(
            ((record, n) for n in meshes for record in records),
            key=lambda place: float(place[0].max_pressure[place[1]].max(initial=0.0)),
        )
        at = int(walked.max_pressure[mesh].argmax())
        # the cycle counts paths in the direction of motion, towards the root of gear 1 where that is turned
        sense = -1.0 if self.sun_torque < 0.0 else 1.0
        return (
            float(walked.position[at]),
            sense * float(walked.pressed_path[mesh, at]),
            float(walked.pressed_load[mesh, at]),
        )

    def _ranges(self) -> dict[str, np.ndarray]:
        """Stress ranges over a turn, of single teeth where they differ, and the history of planets' roots."""
        ranges = self.ranges
        rows = [
            (range_of_root.maximum, range_of_root.minimum, r.arc[range_of_root.point])
            for r, range_of_root in zip(self.roots, ranges, strict=True)
        ]
        names = "root_range_maximum", "root_range_minimum", "root_range_arc"
        columns = zip(*self._largest_of_alike(rows))
        values: dict[str, np.ndarray] = dict(zip(names, map(_by_gear, columns), strict=True))
        planets = [range_of_root.history for range_of_root in ranges if range_of_root.kind == "planet"]
        if planets and planets[0] is not None:
            values["planet_root_stress"] = np.array(planets)
        if self.cycle.periods > 1:
            values["tooth_root_maximum"] = _by_gear([range_of_root.tooth_maximum for range_of_root in ranges])
            values["tooth_root_minimum"] = _by_gear([range_of_root.tooth_minimum for range_of_root in ranges])
        return values

    def _over_width(self) -> dict[str, np.ndarray]:
        """Stresses over the face width, and face load factors of the root."""
        s, factor = self.planetary_set, self.cycle.face_load_factor
        assert factor is not None
        heights = [[abs(gear.tip_radius - gear.root_radius) for gear in pair.gears] for pair in s.kinds]
        highest = s.of_kinds(np.max(heights, axis=1))
        width = min(s.mesh_widths)
        return {
            "root_over_width": _by_gear([root.history().over_width for root in self.roots]),
            "root_face_factor": _by_gear([root.face_load_factor for root in self.roots]),
            "iso_face_factor": np.array(
                [bending_face_factor(k, width, h) for k, h in zip(factor, highest, strict=True)]
            ),
        }

    def _loads(self) -> dict[str, np.ndarray]:
        """Load classes, how often the teeth are in them, and nominal stresses, the same for every planet."""
        spectrum, nominal, N = self.spectrum, self.nominal, self.planetary_set.n_planets
        return {
            "load_bin_low": spectrum.edges[:-1],
            "load_bin_high": spectrum.edges[1:],
            "load_time_share": spectrum.time,
            "load_cycle_share": spectrum.engagements,
            "load_cycles": spectrum.cycles,
            "loaded_contact_ratio": spectrum.duration,
            "iso_contact_ratio_factor": np.repeat(nominal.contact_ratio_factor, N),
            "iso_contact_stress": np.repeat(nominal.contact, N),
            "iso_root_stress": np.repeat(nominal.root, N, axis=0),
            "iso_single_pair_factor": np.repeat(nominal.single_pair, N, axis=0),
        }


def _alike(mesh: int, planets: int, alike: int) -> list[int]:
    """List the meshes of a kind whose planets go through the same states as that of a mesh, itself first."""
    first = mesh // planets * planets
    return [first + (mesh + n * planets // alike) % planets for n in range(alike)]


def _worst_of(root: RootCycle, position: float) -> tuple:
    """Largest stress of a root [Pa], its arc, slope, position, path and load, and the stresses along it."""
    slot, at, point = root.worst
    place = root.arc[point], root.slope[point], position, root.path[slot, at], root.load[slot, at]
    return root.tension[slot, at], *place, root.stress[slot, at]


def root_values(roots: tuple[RootCycle, ...]) -> dict[str, np.ndarray]:
    """Follow the worst tooth of every gear through every mesh: stresses of both roots and loads.

    Roots are those of `femgear.contact.root_stress.root_stress_cycle`. The variables are some of
    `STRESS_VARIABLES`, which has shapes and units; points that a root does not have are NaN.
    """
    histories = [root.history() for root in roots]
    return {
        "root_tension": _by_gear([history.stress[:, LOADED].max(axis=-1) for history in histories]),
        "root_compression": _by_gear([history.stress[:, BACK].min(axis=-1) for history in histories]),
        "root_path": _by_gear([history.path for history in histories]),
        "root_load": _by_gear([history.load for history in histories]),
        "root_profile": _by_gear([root.stress[root.worst[:2]] for root in roots]),
        "root_arc": _by_gear([root.arc for root in roots]),
        "root_slope": _by_gear([root.slope for root in roots]),
    }


def _by_gear(rows) -> np.ndarray:
    """Stack rows of gear 1 and 2 of mesh 0, of mesh 1, ... as (mesh, gear, ...); shorter ones end in NaN."""
    rows = [np.asarray(row) for row in rows]
    if rows[0].ndim:
        longest = max(row.shape[-1] for row in rows)
        missing = [(0, 0)] * (rows[0].ndim - 1)
        rows = [np.pad(row, [*missing, (0, longest - row.shape[-1])], constant_values=np.nan) for row in rows]
    values = np.array(rows)
    return values.reshape(-1, 2, *values.shape[1:])


def static_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what is wrong with the contents of static.nc in an engineer's eyes."""
    module = float(data.attrs["module"])  # of helical gears in their transverse section
    names = ("mesh_force", "back_force", "max_pressure", "member_motion", "ste")
    force, back, pressure, motion, approach = (data[name].values for name in names)
    if "lead_offset" in data:
        # an offset of leads is no deflection
        approach = approach - data["lead_offset"].values
    if (largest := float(largest_pressure(data).max())) > LARGEST_PRESSURE:
        text = (
            f"the contact pressure reaches {largest * 1e-6:.0f} MPa: no steel carries that, and the model stays elastic"
        )
        yield Finding("W-PRESSURE", "", text)
    moved = np.abs(motion).max(initial=0.0)
    if np.abs(approach).max(initial=0.0) > 0.05 * module:
        yield Finding("W-DEFLECTION", "", _deflection(approach, moved, members=len(motion)))
    if moved > 0.05 * module:
        text = (
            f"a member moves by {moved * 1e6:.0f} um, more than 5 % of the module: contact points and arms "
            "are those of the unmoved set"
        )
        yield Finding("W-MOTION", "", text)
    if (doubt := _peak_doubt(data)) >= 1.0:
        text = (
            "between the positions transmission errors, mesh stiffnesses or load shares may have higher peaks: "
            "a record with so many tooth pairs is not searched to the end for them"
        )
        yield Finding("W-POSITIONS", "static.positions", text, remedy="take more positions")
    elif doubt > LARGEST_PEAK_DOUBT:
        reach = (
            "between the positions transmission errors, mesh stiffnesses or load shares may go on by "
            f"{percent(doubt)} of their peak to peak"
        )
        yield Finding("W-POSITIONS", "static.positions", reach, remedy="take more positions")
    if (ripple := data.attrs.get("ripple_doubt", 0.0)) > LARGEST_PEAK_DOUBT:
        text = (
            f"half of the positions change the mesh stiffness by {percent(ripple)} of its peak to peak, as slices of "
            "helical teeth come into contact one after the other: more of them may change it too"
        )
        yield Finding("W-RIPPLE", "static.positions", text, remedy="take more positions")
    if ((force > 0) & (pressure <= 0)).any():
        text = (
            "at some positions every contact of a mesh lies at the end of a flank: its pressure has no limit "
            "and is not given"
        )
        yield Finding("W-EDGE", "", text)
    if "face_load_factor" in data and data["face_load_factor"].values.max() > 1.02:
        count = data.sizes["slice"]
        if count < SLICES:
            text = f"K_Hbeta is the mean over a {count}th of the width: {_more_slices(data, module)}"
            yield Finding("W-FACE-LOAD", "static.slices", text)
    if "slice_load" in data:
        yield from _lifted(data)
        yield from _helical(data)
    unloaded = (force + back)[: data.sizes["planet"]] <= 0.0
    always = unloaded.all(axis=1)
    for word, unloaded_planets in (("all", always), ("some", unloaded.any(axis=1) & ~always)):
        if unloaded_planets.any() and force.any():
            planets = ", ".join(str(n + 1) for n in np.flatnonzero(unloaded_planets))
            text = (
                f"planet {planets} carries nothing at {word} positions: its place and transmission error (*, "
                "a dash where it never carries) are not determined there; the smallest motion without "
                "penetration stands for them"
            )
            yield Finding("W-OPEN", "", text)
    if ((force > 0) & (back > 0)).any():
        yield Finding("W-WEDGED", "", "some meshes are loaded on both flanks at once")
    if ((back > 0) & ~(force > 0)).any():
        text = "some meshes carry on their back flanks alone: planets work against one another"
        yield Finding("W-BACK", "", text)


def stress_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List which stresses of stress.nc stand at a kink or at an end of what was searched."""
    module, seen = float(data.attrs["module"]), set[str]()
    for mesh, name in enumerate(data["mesh"].values):
        titles = SIDES.get(family(name), tuple(str(name).split("-")))
        for number, title in enumerate(titles):
            flank = data.isel(mesh=mesh, gear=number)
            gear = title.split(",")[0].replace(" ", "_")
            radius, worst = float(flank["root_notch_radius"]), float(flank["root_worst"])
            if radius < ROOT_RADIUS_LIMIT * module and gear not in seen:
                seen.add(gear)
                yield Finding(
                    "W-KINK",
                    f"{gear}.rack.root_radius",
                    f"the root of the {gear.replace('_', ' ')} has a corner (a radius below "
                    f"{1e6 * ROOT_RADIUS_LIMIT * module:.3g} um): there the stress has no limit. Root "
                    f"stresses are those {1e3 * NOTCH_REACH * module:.3g} mm from it and farther; the "
                    f"largest, {1e-6 * worst:.1f} MPa, grows towards it",
                    remedy="give the rounding of the tool as root_radius",
                    concerns=gear.replace("_", " "),
                )
            elif worst > 0.0 and float(flank["root_worst_arc"]) <= 0.0 and title not in seen:
                seen.add(title)
                yield Finding(
                    "W-KINK",
                    "",
                    f"the largest root stress of the {title}, {1e-6 * worst:.1f} MPa, stands at the end of "
                    "the flank, where the root begins: it may be larger on the flank above",
                    concerns=title,
                )
    yield from _kinked_reliefs(data)


def _kinked_reliefs(data: xr.Dataset) -> Iterator[Finding]:
    """Name the kinds of mesh whose pressure at the kink of a linear relief is far above that of Hertz.

    Under a kink pressure has no limit (K. L. Johnson, Contact Mechanics, 1985, section 5.2, blunt wedges).
    """
    if "slice" in data.sizes or data.attrs["nominal_load"] == 0.0:
        return  # slices have the pressure of Hertz
    excess = over_hertz(data)
    names = [family(str(name)) for name in data["mesh"].values]
    for kind in dict.fromkeys(names):
        largest = max(ratio for ratio, name in zip(excess, names, strict=True) if name == kind)
        kinked = any(data["relief_kink"].values[[name == kind for name in names]])
        if kinked and largest > _KINKED:
            yield Finding(
                "W-KINK",
                "",
                f"contact pressure of {kind}: a linear relief begins with a kink, under which pressure has "
                f"no limit and grows with the cells; {largest:.2f} times that of Hertz for the same load",
                remedy='shape = "parabolic" makes no kink',
                concerns=kind,
            )


def _more_slices(data: xr.Dataset, module: float) -> str:
    """Advise as many slices as are thicker than a quarter of the module [m] and than contacts are wide."""
    width, load, pressure = data.attrs["face_width"], data.slice_load.values, data.slice_pressure.values
    # width 4 F' / (pi p) of a line contact under F' per length (Johnson, Contact Mechanics, 4.3)
    contact = 4.0 / (np.pi * width) * np.divide(load, pressure, out=np.zeros(load.shape), where=pressure > 0)
    # finer slices carry higher peaks, and pressures at the ends of flanks are not known
    most = int(width / max(1.2 * float(contact.max(initial=0.0)), 0.25 * module))
    if most <= data.sizes["slice"]:
        return "more would be thinner than contacts are wide, or than a quarter of the module"
    return f"take {SLICES} slices or more" if most >= SLICES else f"take {most} slices, about as many as fit"


def _helical(data: xr.Dataset) -> Iterator[Finding]:
    """Tell what slices of helical teeth leave out: ends that are free, and tilts of planets under thrust."""
    softer = data.attrs.get("free_ends", 0.0)
    if "axial_force" not in data:
        if softer > _NOTED_ENDS:
            yield _narrow(data)
    elif softer > 0.05:
        text = f"free ends make meshes softer by about {100 * softer:.0f} %: here they are mirror planes"
        remedy = "take mesh stiffness and transmission error with that margin"
        yield Finding("W-ENDS", "set.helix_angle", text, remedy=remedy)
    if "planet_couple" not in data or not data["mesh_force"].values.any():
        return
    couple, width = data["planet_couple"].values, data.attrs["face_width"]
    total = data["mesh_force"].values.reshape(2, *couple.shape).sum(axis=0)
    if tilts := thrust_words(float(couple.max()), float(couple.sum() / total.sum()), width):
        text = (
            f"axial forces tilt every planet with {tilts}: bearings are taken to hold planets upright, and K_Hbeta is "
            "that of upright planets"
        )
        remedy = "give the tilt that bearings allow as a lead slope of the planets"
        yield Finding("W-THRUST", "set.helix_angle", text, remedy=remedy)


def thrust_words(couple: float, offset: float, width: float) -> str:
    """Write the couple of axial forces on a planet; empty of one that tilts no more than loads amid the width do.

    Parameters
    ----------
    couple : float
        Largest couple on a planet [N m].
    offset : float
        How far off the middle of the width mesh forces would make the same couple [m]; up to 5 % of the width are amid.
    width : float
        Face width [m].
    """
    if offset <= 0.05 * width:
        return ""
    return f"up to {couple:.3g} N m, as loads {offset * 1e3:.2g} mm off the middle of the width would"


def _narrow(data: xr.Dataset) -> Finding:
    """Say what the mirror planes at the ends of narrow spur teeth change."""
    modules = data.attrs["face_width"] / data.attrs["module"]
    softer, aligned, slope = (factor / modules for factor in _SPUR_ENDS.values())
    text = (
        f"teeth are {modules:.3g} modules wide and their ends mirror planes: free ends make meshes about "
        f"{percent(softer, 1)} softer, raise K_Hbeta of aligned flanks to about {1.0 + aligned:.2f} and lower "
        f"K_Hbeta - 1 under slopes by about {percent(slope)}"
    )
    return Finding("W-ENDS", "static.slices", text, remedy="take K_Hbeta and stiffness with that margin")


def _lifted(data: xr.Dataset) -> Iterator[Finding]:
    """Name the mesh of whose width the least ever carries, where an end lifts."""
    carries = data["slice_load"].values.max(axis=(1, 3)) > 0.0
    share = np.where(carries.any(axis=1), carries.mean(axis=1), 1.0)
    worst = int(share.argmin())
    if share[worst] < 1.0:
        both = not carries[worst, [0, -1]].any()
        text = (
            f"{'both ends are' if both else 'one end is'} lifted: {100 * share[worst]:.0f} % of the width of "
            f"{data['mesh'].values[worst]} carry at all"
        )
        count = int(carries[worst].sum())
        if count < 3:
            text += f", {count} of the slices: stiffness and K_Hbeta are 10 % off over two, more over one"
        yield Finding("W-LIFTED", "", text)


def _deflection(approach: np.ndarray, moved: float, *, members: int) -> str:
    """Approach of the flanks beyond 5 % of the module: of teeth and bodies, or of moving members as well."""
    if not members:
        return (
            f"the teeth deflect by {np.abs(approach).max() * 1e6:.0f} um, more than 5 % of the module: small "
            "displacements no longer hold"
        )
    sun, ring = (np.abs(half).max() * 1e6 for half in np.split(approach, 2))
    return (
        f"the flanks approach by {sun:.0f} um between sun and planets and by {ring:.0f} um "
        "between planets and ring, more than 5 % of the module: small displacements no longer hold. This is "
        "not the deflection of the teeth alone: it contains the motion of the members, up to "
        f"{moved * 1e6:.0f} um, and between planets and ring that of the ring on its foundation; "
        'static.members = "fixed" shows the teeth'
    )


def _peak_doubt(data: xr.Dataset) -> float:
    """Find the share of a peak to peak that may lie between positions, of helical teeth by their curves."""
    if not data.attrs.get("overlap_ratio"):
        return float(data.attrs.get("peak_doubt", 0.0))
    curves = [data[name].values for name in ("ste", "mesh_stiffness")]
    values = np.concatenate([curve.reshape(-1, curve.shape[-1]) for curve in curves])
    return _doubt_of_curves(data["position"].values, values, int(data.attrs["mesh_periods"]))


def _doubt_of_curves(position: np.ndarray, values: np.ndarray, periods: int, other: np.ndarray | None = None) -> float:
    """Find the share of a peak to peak by which curves (K, P) may rise between equidistant positions (P,).

    ``other`` (P,) tells behind which of them other tooth pairs carry, where that is known.
    """
    least = 1e-3 * np.abs(values).max(axis=-1, initial=0.0)
    doubt = peak_doubt(position, values, least, periods, other)
    if len(position) > FEWEST * periods:
        return doubt
    # slopes between so few do not show narrow peaks: what every other position misses
    whole = np.maximum(np.ptp(values, axis=-1), least)
    halves = [np.ptp(values[:, first::2], axis=-1) for first in (0, 1)]
    varies = whole > least
    return float(max(doubt, (1.0 - np.minimum(*halves)[varies] / whole[varies]).max(initial=0.0)))


def peak_to_peak(data: xr.Dataset, name: str) -> np.ndarray:
    """Find the peak to peak (M,) of a variable (M, P) of static.nc, positions between included where there are any."""
    stored = data.get(f"{name}_peak_to_peak")
    return np.ptp(data[name].values, axis=-1) if stored is None else stored.values


def mean_over_period(data: xr.Dataset, name: str) -> np.ndarray:
    """Find the mean (M,) of a variable (M, P) of static.nc, positions between included where there are any."""
    stored = data.get(f"{name}_mean")
    return data[name].values.mean(axis=-1) if stored is None else stored.values


def describe_static(data: xr.Dataset, run: Iterable[Finding] = ()) -> Block:
    """Tabulate transmission errors, stiffnesses and load sharing of static.nc.

    The findings of the whole ``run`` give the order of the marks.
    """
    lowest, highest = (data.get(f"{end}_load_share", data.load_share) for end in ("smallest", "largest"))
    marks = Marks(findings_in(data.attrs), run)

    def error(row: xr.Dataset, value: float) -> str:
        """Write a transmission error, marked where the mesh of a loaded set carries nothing at times."""
        carries = (row.mesh_force + row.back_force).values > 0.0
        text = significant(value * 1e6, 4) if abs(row.ste.values.mean()) < 1e-8 else f"{value * 1e6:.4f}"
        if not data.mesh_force.values.any() or carries.all():
            return text
        return f"{text}*" if carries.any() else "-"

    columns = {
        "mesh": lambda row: str(row.mesh.item()),
        "STE mean [um]": lambda row: marks(error(row, float(mean_over_period(row, "ste"))), *LARGE),
        "STE p-p [um]": lambda row: marks(error(row, float(peak_to_peak(row, "ste"))), *LARGE, "W-POSITIONS"),
        "k mean [N/um]": lambda row: marks(
            significant(float(mean_over_period(row, "mesh_stiffness")) / 1e6, 3), *LARGE
        ),
        "k p-p [N/um]": lambda row: marks(
            significant(float(peak_to_peak(row, "mesh_stiffness")) / 1e6, 3), *LARGE, "W-POSITIONS", "W-RIPPLE"
        ),
        "force [N]": lambda row: significant(row.mesh_force.values.mean(), 3),
        "p max [MPa]": lambda row: _pressure(float(largest_pressure(row)), marks),
    }
    if "face_load_factor" in data:
        columns["K_Hbeta"] = lambda row: (
            marks(f"{float(row.face_load_factor):.3f}", "W-FACE-LOAD", "W-THRUST")
            if row.mesh_force.values.any()
            else "-"
        )
        columns["misaligned [um]"] = lambda row: f"{float(row.mesh_misalignment.mean()) * 1e6:+.2f}"
    contact = f"contact: {data.attrs.get('contact', 'unknown')}"
    sharing = (
        f"load share of a planet {float(lowest.min()):.4f} to {float(highest.max()):.4f} "
        f"(equal sharing {1 / data.sizes['planet']:.4f}); {contact}"
    )
    most, mean, held = shares(data)
    sharing += f"; {held}, K_gamma = {mean:.3f}" if most > UNEQUAL else ""
    k = "k: tangent stiffness dF/dx of teeth and bodies"
    notes = [sharing, f"{k}, held at their bores and at the outer surface of the ring"]
    if data.sizes.get("member", 0):
        notes[1] = f"{k}, {SERIES}"
    if most > UNEQUAL and held == HELD:
        notes.append(
            "K_gamma with held centres: the teeth alone take up errors of pins, an upper bound; "
            'static.members = "elastic" has that on supports and bearings'
        )
    if data.sizes["mesh"] == 1:
        notes = [contact, f"{k}, held at bore or outer surface"]
    if "axial_force" in data:
        axial = float(np.abs(data.axial_force.values).mean(axis=1).max())
        notes.append(
            f"helical teeth, overlap ratio {data.attrs['overlap_ratio']:.3f}, axial force of a mesh "
            f"{axial:.1f} N; all else in the transverse section"
        )
    if data.attrs.get("mesh_periods", 1) > 1:
        notes.append(str(data.attrs["period"]))
    meshes = [data.sel(mesh=mesh) for mesh in data.mesh.values]
    return tabulate("Static", meshes, columns, notes, marks)


def _pressure(pressure: float, marks: Marks) -> str:
    """Write the largest contact pressure of a mesh [MPa], a dash without any, marked where it is doubtful."""
    if pressure <= 0.0:
        return "-"
    return marks(significant(pressure / 1e6, 1), *pressure_doubts((), "", pressure))


def shares(data: xr.Dataset) -> tuple[float, float, str]:
    """Find the largest share of static.nc and K_gamma, over the equal share, and what holds the members."""
    share = data["load_share"] * data.sizes["planet"]
    held = "on supports and bearings" if data.sizes.get("member", 0) else HELD
    most = data.get("largest_load_share", data["load_share"]).max() * data.sizes["planet"]
    return float(most), float(share.mean("position").max()), held


def describe_stress(data: xr.Dataset, findings: Iterable[Finding] = (), run: Iterable[Finding] = ()) -> Block:
    """Tabulate the largest stresses of stress.nc beside the nominal ones, with place and range.

    One row for the contact and one for the root of every kind of gear, each of its worst mesh. Marked are
    those that doubts of the file, and ``findings`` of the run, concern; all findings of the ``run`` give the order of
    the marks.
    """
    findings = (*findings, *findings_in(data.attrs))
    marks = Marks(findings, run)
    names = [str(name) for name in data["mesh"].values]
    contact, roots = [], []
    for kind in dict.fromkeys(map(family, names)):
        meshes = [i for i, name in enumerate(names) if family(name) == kind]
        titles = SIDES.get(kind, tuple(kind.split("-")))
        of_kind = data.isel(mesh=meshes)
        doubts = pressure_doubts(findings, kind, float(largest_pressure(of_kind).max()))
        contact.append(_contact_row(kind, of_kind, partial(_marked, marks, doubts)))
        for number, title in enumerate(titles):
            doubts = root_doubts(findings, title, titles[1 - number])
            of_kind = data.isel(mesh=meshes, gear=number)
            roots.append(_root_row(title, of_kind, partial(_marked, marks, doubts)))
    equal, against = ("", "") if len(names) == 1 else ("equal load on all planets and ", " against the carrier")
    header = "[MPa]", "FE", "ISO 6336", "FE/ISO", "position", "arc [mm]", "tangent [deg]", "range", "cycles"
    edition = f":{data.attrs['iso_edition']}" if "iso_edition" in data.attrs else ""
    notes = [
        f"ISO 6336{edition}: nominal stresses sigma_H0 and sigma_F0 (method B) with {equal}no "
        "load factors; FE, under the loads of static.nc: largest contact pressure away from flank ends, and "
        "largest tension in the root",
        "position in mesh periods; arc from the end of the flank, tangent to the centreline of the tooth; "
        "range: smallest to largest stress at the root point where they differ most, while the gear turns "
        f"once{against}; cycles: load cycles of the flank in that turn",
    ]
    if data.attrs.get("iso"):
        notes.append(f"not by ISO 6336: {data.attrs['iso']}")
    notes += [reason.sentence for reason in stress_reasons(data)]
    if "root_face_factor" in data:
        header = *header, "K_Fbeta", "by ISO"
        contact = [(*row, "-", "-") for row in contact]
        notes.append(
            "K_Fbeta: largest root stress over its mean across the width, by ISO: K_Hbeta^N_F (ISO 6336-1); "
            "ranges and positions are those of the slice with the largest"
        )
    if not data.attrs.get("repeats", 1):
        notes.append("the record does not repeat: stress ranges are those that it shows")
    return Block("Stresses", header, (*contact, *roots), (*notes, *marks.notes))


def pressure_doubts(findings: Iterable[Finding], kind: str, pressure: float) -> list[str]:
    """Codes of findings that concern the largest contact pressure [Pa] of a kind of mesh."""
    kinked = [finding.code for finding in findings if finding.code == "W-KINK" and finding.concerns == kind]
    return [*kinked, *(["W-PRESSURE"] if pressure > LARGEST_PRESSURE else []), "W-EDGE"]


def root_doubts(findings: Iterable[Finding], title: str, mate: str) -> list[str]:
    """Codes of findings that concern the root stress of a flank, such as "planet, sun side", with a mate."""
    return [finding.code for finding in findings if _concerns(finding, title, mate)]


def _marked(marks: Marks, codes: list[str], text: str) -> str:
    """Mark the text of a stress that findings of these codes concern."""
    return marks(text, *dict.fromkeys(codes))


def _concerns(finding: Finding, title: str, mate: str) -> bool:
    """Tell whether a finding concerns the root stress of a flank, such as "planet, sun side", with a mate."""
    gear, other = (name.split(",")[0] for name in (title, mate))
    if finding.code == "W-FILLET":
        return finding.concerns == gear and finding.key.startswith(f"{other}.")
    if finding.code == "W-RIM":
        return finding.severity == DOUBT and finding.concerns == gear
    return finding.code == "W-KINK" and finding.concerns in (gear, title)


def _contact_row(kind: str, data: xr.Dataset, marked: Callable[[str], str]) -> tuple[str, ...]:
    """Write the largest contact pressure of a kind of mesh, marked where it is doubtful."""
    pressure = largest_pressure(data)
    mesh = int(pressure.argmax())
    pressure_there, nominal = float(pressure[mesh]), float(data["iso_contact_stress"][mesh])
    if "contact_worst_position" in data:
        position = float(data["contact_worst_position"][mesh])
    else:
        position = float(data["position"][int(data["contact_pressure"].values[mesh].argmax())])
    place = f"{position:.3f}" if pressure_there else "-"
    largest, *compared = _compared(pressure_there, nominal)
    return (f"contact {kind}", marked(largest), *compared, place, *["-"] * 4)


def _root_row(title: str, data: xr.Dataset, marked: Callable[[str], str]) -> tuple[str, ...]:
    """Write the largest root stress of a gear in its worst mesh, marked where it is doubtful."""
    mesh = int(data["root_worst"].values.argmax())
    values_there = {name: float(values) for name, values in data.isel(mesh=mesh).items() if not values.dims}
    stress_there, place = values_there["root_worst"], ["-"] * 3
    if stress_there:
        arc, slope = values_there["root_worst_arc"] * 1e3, np.degrees(values_there["root_worst_slope"])
        place = [f"{values_there['root_worst_position']:.3f}", f"{arc:.3f}", f"{slope:.1f}"]
    low, high = values_there["root_range_minimum"] * 1e-6, values_there["root_range_maximum"] * 1e-6
    largest, *compared = _compared(stress_there, values_there["iso_root_stress"])
    return (
        f"root {title}",
        marked(largest),
        *compared,
        *place,
        f"{significant(low, 1)} to {significant(high, 1)}",
        f"{values_there['load_cycles']:g}",
        *[f"{values_there[name]:.3f}" for name in ("root_face_factor", "iso_face_factor") if name in values_there],
    )


def _compared(value: float, nominal: float) -> tuple[str, str, str]:
    """Write both values in MPa and their ratio; a dash where there is none."""
    comparable = np.isfinite(nominal)
    ratio = f"{value / nominal:.2f}" if comparable and nominal else "-"
    return significant(value * 1e-6, 1), significant(nominal * 1e-6, 1) if comparable else "-", ratio


def describe_set(case: Case) -> tuple[Block, ...]:
    """Tabulate geometry, phasing and operation of a planetary set."""
    planetary = planetary_set(case)
    return (
        describe_gears(planetary, case.helix_angle),
        *describe_drawing(case),
        *describe_materials(case),
        describe_meshes(planetary, case.helix_angle),
        _harmonics(planetary),
        _neighbours(planetary),
        _operation(case, planetary),
        *describe_faults(case, _first_mesh_frequency(case, planetary)),
    )


def set_warnings(case: Case) -> Iterator[Finding]:
    """List what is allowed in any planetary set but deserves a look."""
    gears = planetary_set(case)
    yield from with_rim_doubts(check_set(gears, overlap=case_overlap(case, gears)), case)
    yield from case.notices
    yield from load_warnings(case)


def load_warnings(case: Any) -> Iterator[Finding]:
    """List what deserves a look in the deviations and the torque of a case."""
    yield from check_deviations(set_deviations(case), planetary_set(case))
    yield from fault_findings(case)
    yield from width_warnings(case)
    yield from friction_findings(case, planetary_set(case))
    yield from steep_helix("set.helix_angle", case.set.helix_angle)
    if case.operation.torque <= 0:
        nothing = "without torque no tooth touches; only static results exist"
        text = "a negative torque loads the other flanks" if case.operation.torque < 0 else nothing
        yield Finding("W-TORQUE", "operation.torque", text)


def width_warnings(case: Any) -> Iterator[Finding]:
    """Say what gears that are wider than the faces they share with their mates leave out."""
    gears: Any = planetary_set(case)
    common = flank_widths([gear.face_width for gear in gears.gears])
    beyond = {
        gear.name.replace("_", " "): 1e3 * (gear.face_width - max(widths))
        for gear, widths in zip(gears.gears, common, strict=True)
        if gear.face_width > max(widths)
    }
    if not beyond:
        return
    wider = " and ".join(f"{name} ({more:.4g} mm)" for name, more in beyond.items())
    text = (
        f"wider than their mates: {wider}: teeth bend over the common face width (ISO 6336-1), what they "
        "have beyond it does not help; rims and bodies have their own width"
    )
    remedy = "take mesh stiffness and transmission error with that margin"
    if case.static.slices > 1:
        text += "; over the width the common face ends in mirror planes, as if the wider gear ended there too"
        remedy += ", and loads at the ends of the face as an estimate"
    key = next(iter(beyond)).replace(" ", "_")
    yield Finding("W-WIDTHS", f"{key}.face_width", text, remedy=remedy)


def describe_materials(case: GearCase) -> Iterator[Block]:
    """Tabulate materials and face widths of the gears, where one has others than the rest."""
    sections = [getattr(case, name) for name in case.gear_names]
    if all(section.material is None and section.face_width is None for section in sections):
        return

    def limit(value: float | None) -> str:
        return "-" if value is None else f"{1e-6 * value:g}"

    rows = [(name, gear_material(case, name), face_width(case, name)) for name in case.gear_names]
    columns = {
        "": lambda row: row[0].replace("_", " "),
        "face width [mm]": lambda row: f"{1e3 * row[2]:.6g}",
        "E [GPa]": lambda row: f"{1e-9 * row[1].youngs_modulus:.6g}",
        "Poisson's ratio": lambda row: f"{row[1].poisson_ratio:.4g}",
        "density [kg/m^3]": lambda row: f"{row[1].density:.6g}",
        "sigma_Flim [MPa]": lambda row: limit(row[1].root_stress_limit),
        "sigma_Hlim [MPa]": lambda row: limit(row[1].contact_stress_limit),
    }
    yield tabulate("Materials", rows, columns, ("what a gear leaves out is that of set and material",))


def describe_gears(s: GearSet, helix_angle: float | None = None) -> Block:
    """Tabulate diameters and teeth of all gears; of helical ones, helix in rad, numbers of both sections."""
    normal = 1.0 if helix_angle is None else math.cos(helix_angle)
    transverse = "" if helix_angle is None else "transverse "
    rows = {
        "teeth": lambda g: str(g.teeth),
        "profile shift" if helix_angle is None else "profile shift [normal modules]": lambda g: (
            f"{g.profile_shift / normal:.5f}"
        ),
        "reference diameter [mm]": lambda g: f"{2e3 * g.reference_radius:.4f}",
        "tip diameter [mm]": lambda g: f"{2e3 * g.tip_radius:.4f}",
        "root diameter [mm]": lambda g: f"{2e3 * g.root_radius:.4f}",
        "start of involute, diameter [mm]": lambda g: f"{2e3 * g.form_radius:.4f}",
        f"{transverse}tooth thickness at the tip [mm]": lambda g: (
            f"{1e3 * float(tooth_thickness(g, g.tip_radius)):.4f}"
        ),
        "bore or outer diameter [mm]": lambda g: f"{2e3 * g.rim_radius:.4f}",
    }
    columns: dict[str, Any] = {"": lambda name: name}
    columns |= {gear.name: partial(lambda gear, name: rows[name](gear), gear) for gear in s.gears}
    angles = ", ".join(f"{math.degrees(angle):.6g}" for angle in s.planet_angles[:12])
    first = s.gears[0]
    notes = (
        *_helix(first, helix_angle),
        f"{transverse}module {first.module * 1e3:.6g} mm, {transverse}pressure angle "
        f"{math.degrees(first.pressure_angle):.6g} deg, {_widths(s)}, "
        f"centre distance {s.centre_distance * 1e3:.6g} mm",
        *[f"{s.n_planets} planet{'s' * (s.n_planets > 1)} at {angles} deg"] * s.repeated[BRANCH],
        *[
            f"profile shift of the {gear.name}: positive moves the flank outwards (the opposite of ISO 21771)"
            for gear in s.gears
            if gear.internal
        ],
    )
    return tabulate("Gears", rows, columns, notes)


def _widths(s: GearSet) -> str:
    """Face width of all gears in words, or the widths that meshes have in common where gears differ."""
    widths = [gear.face_width for gear in s.gears]
    if len(set(widths)) == 1:
        return f"face width {widths[0] * 1e3:.6g} mm"
    shown = " and ".join(f"{width * 1e3:.6g}" for width in dict.fromkeys(s.mesh_widths))
    return f"face width in common {shown} mm"


def _helix(gear: Gear, helix_angle: float | None) -> Iterator[str]:
    """Write helix angle [rad], module and pressure angle of the normal section; nothing of spur teeth."""
    if helix_angle is None:
        return
    angle = math.atan(math.tan(gear.pressure_angle) * math.cos(helix_angle))
    base = base_helix_angle(angle, helix_angle)
    yield (
        f"helix angle {math.degrees(abs(helix_angle)):.6g} deg, on the base cylinder "
        f"{math.degrees(abs(base)):.6g} deg; {gear.name.replace('_', ' ')} "
        f"{'right' if helix_angle > 0.0 else 'left'}-handed; normal module "
        f"{gear.module * math.cos(helix_angle) * 1e3:.6g} mm, normal pressure angle "
        f"{math.degrees(angle):.6g} deg"
    )


def _contact_ratio_rows(s: GearSet, helix_angle: float | None) -> Iterator[tuple[str, ...]]:
    """Rows of contact ratios; ``eps_gamma = eps_alpha + eps_beta`` of helical teeth (ISO 21771, 5.4)."""
    ratios = [pair.contact_ratio for pair in s.kinds]
    if helix_angle is None:
        yield ("contact ratio", *(f"{ratio:.4f}" for ratio in ratios))
        return
    normal_module = s.gears[0].module * math.cos(helix_angle)
    overlap = [overlap_ratio(width, normal_module, helix_angle) for width in s.mesh_widths]
    yield ("transverse contact ratio", *(f"{ratio:.4f}" for ratio in ratios))
    yield ("overlap ratio", *(f"{ratio:.4f}" for ratio in overlap))
    yield ("total contact ratio", *(f"{sum(both):.4f}" for both in zip(ratios, overlap)))


def describe_meshes(s: GearSet, helix_angle: float | None = None) -> Block:
    """Tabulate what the geometry says of every kind of mesh; the helix angle of helical teeth in rad."""
    transverse, normal = "", 1.0
    if helix_angle is not None:
        # play along the tooth normal, of which the base helix leaves a part in the transverse section
        angle = math.atan(math.tan(s.gears[0].pressure_angle) * math.cos(helix_angle))
        transverse, normal = "transverse ", math.cos(base_helix_angle(angle, helix_angle))
    phases = [f"{phase:.4f}" for phase in s.mesh_phases]
    more = ", ..." if s.n_planets > 6 else ""
    clearance = iter(f"{1e3 * value:.3f}" for value in tip_clearances(s).values())
    alone = [
        [f"{1e3 * low:.4f} to {1e3 * high:.4f}" for low, high in pair.single_contact] or ["-"] * 2 for pair in s.kinds
    ]
    of_kinds = [", ".join(phases[rows][:6]) + more for rows in s.kind_rows]
    names = [f"{pair.gear_1.name}-{pair.gear_2.name}" for pair in s.kinds]
    rows = (
        (
            f"{transverse}working pressure angle [deg]",
            *(f"{math.degrees(pair.working_pressure_angle):.4f}" for pair in s.kinds),
        ),
        *_contact_ratio_rows(s, helix_angle),
        ("normal backlash [um]", *(f"{round(normal * kind.backlash * 1e6, 2) + 0.0:.2f}" for kind in s.kinds)),
        ("tip clearances [mm]", *(f"{next(clearance)}, {next(clearance)}" for _ in s.kinds)),
        ("single contact, first gear [mm]", *(first for first, _ in alone)),
        ("single contact, second gear [mm]", *(second for _, second in alone)),
        *_sliding_rows(s),
        *[("mesh phases [periods]", *of_kinds)] * (len(phases) > 1),
    )
    pair = "pair of the transverse section" if transverse else "pair"
    note = f"single contact: diameters between which one tooth {pair} carries, from root to tip of a gear"
    return Block("Meshes", ("", *names), rows, (note,))


def _sliding_rows(s: GearSet) -> Iterator[tuple[str, ...]]:
    """Rows of the specific sliding of both gears of every kind of mesh, at the first and the last contact."""
    sliding = [path_speeds(pair, pair.path).specific_sliding for pair in s.kinds]
    for place, gear in enumerate(("first", "second")):
        ends = (of_kind[place] for of_kind in sliding)
        yield f"specific sliding, {gear} gear", *(f"{low:.3f} to {high:.3f}" for low, high in ends)


def _operation(case: Case, s: PlanetarySet) -> Block:
    """Tabulate the speeds of all members."""
    operation = case.operation
    entries = [
        speeds(s, input=operation.input, fixed=operation.fixed, speed=operation.speeds[i])
        for i in chosen(len(operation.speeds))
    ]
    columns = {
        "sun [rpm]": lambda v: f"{v.sun / RPM:.4f}",
        "carrier [rpm]": lambda v: f"{v.carrier / RPM:.4f}",
        "ring [rpm]": lambda v: f"{v.ring / RPM:.4f}",
        "planet [rpm]": lambda v: f"{v.planet / RPM:.4f}",
        "mesh frequency [Hz]": lambda v: f"{v.mesh_frequency:.4f}",
    }
    load = torques(s, member=operation.input, torque=operation.torque)
    notes = [
        f"input {operation.input}, fixed {operation.fixed}; torque on sun {load.sun:.6g} N m, "
        f"carrier {load.carrier:.6g} N m, ring {load.ring:.6g} N m"
    ]
    if len(operation.speeds) > len(entries):
        notes.append(f"{len(operation.speeds)} speeds, of which the first and the last are shown")
    return tabulate("Operation", entries, columns, (*notes, *shaft_lines(case)))


def _first_mesh_frequency(case: Case, s: PlanetarySet) -> float | None:
    """Mesh frequency [Hz] at the first speed; None without speeds."""
    operation = case.operation
    if not operation.speeds:
        return None
    return speeds(s, input=operation.input, fixed=operation.fixed, speed=operation.speeds[0]).mesh_frequency


def _harmonics(s: PlanetarySet) -> Block:
    """Tabulate how the phases of the meshes add up at the first harmonics."""
    phasing = phasing_of_set(s)
    table = phasing_table(phasing, range(1, _HARMONICS + 1))
    columns = {
        "harmonic": lambda i: str(table.harmonics[i]),
        "planets are": lambda i: table.kind[i],
        "k": lambda i: "-" if table.cyclic[i] < 0 else str(table.cyclic[i]),
        "torque": lambda i: _share(table.members[i][:, 0].max()),
        "lateral force": lambda i: _share(table.members[i][:, 1].max()),
        "can excite modes": lambda i: ", ".join(table.excited[i]),
    }
    common = math.gcd(s.sun.teeth, s.planet.teeth), math.gcd(s.planet.teeth, s.ring.teeth)
    notes = (
        "k = mod(h z_sun, N); torque, lateral force: what is left of equal mesh forces on sun, ring, carrier",
        f"phases lead: a planet's ring mesh is {-phasing.lag % 1.0:.4f} periods ahead of its sun mesh",
        f"common divisors of the teeth: sun and planet {common[0]}, planet and ring {common[1]}",
    )
    return tabulate("Mesh phasing", range(_HARMONICS), columns, notes)


def _share(value: float) -> str:
    """Write what is left of a force."""
    return "cancelled" if value < ZERO else f"{100.0 * value:.1f} %"


def _neighbours(s: PlanetarySet) -> Block:
    """Tabulate tooth numbers near those of the set, and what they would change."""
    wanted = (s.sun.teeth, s.planet.teeth, s.ring.teeth)
    closure = max(1, abs(wanted[2] - wanted[0] - 2 * wanted[1]))
    neighbours = neighbouring_teeth(
        *wanted, s.n_planets, distance=_DISTANCE, ratio_tolerance=_TOLERANCE, closure=min(closure, 10)
    )
    neighbours = neighbours.only(np.any(neighbours.teeth != np.array(wanted), axis=1))
    # sets with equal spacing first, each group by its ratio
    neighbours = neighbours.only(np.argsort(~neighbours.equally_spaced, kind="stable"))

    def spacing(i: int) -> str:
        off = math.degrees(neighbours.spacing_error[i])
        return "equal" if neighbours.equally_spaced[i] else f"off by {off:.2f} deg"

    columns = {
        "teeth": lambda i: "/".join(str(z) for z in neighbours.teeth[i]),
        "ratio": lambda i: f"{neighbours.ratio[i]:.4f}",
        "change": lambda i: f"{100.0 * neighbours.ratio_change[i]:+.2f} %",
        "spacing": spacing,
        "harmonics 1 to 4": lambda i: _kinds([_SHORT[name] for name in neighbours.kind_names[i]]),
        "hunting": lambda i: "yes" if neighbours.hunting[i] else "no",
        "room [modules]": lambda i: f"{neighbours.room[i]:.2f}",
    }
    near = f"{len(neighbours)} within {_DISTANCE} teeth and {100 * _TOLERANCE:g} % of the ratio"
    notes = (f"{near}; room: unshifted tips",)
    block = tabulate("Neighbouring tooth numbers", range(min(len(neighbours), _ROWS)), columns, notes)
    return replace(block, beside=True)


def _kinds(kinds: list[str]) -> str:
    """Write the phasing of some harmonics, once where they agree."""
    return kinds[0] if len(set(kinds)) == 1 else ", ".join(kinds)
