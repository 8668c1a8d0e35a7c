"""Results of a helical case: modes.nc, dynamics.nc, and the tables of the case and of its stiffness.

Every variable of a file carries its units; complex harmonics are stored as real and imaginary parts.
static.nc of a helical case holds spur gears, and its table sets the helical numbers beside theirs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import support_text
from femgear.case.quantities import RPM
from femgear.gears.planetary import virtual_teeth
from femgear.report.tables import Block, response_warnings
from femgear.stages.lumped_set import modes_dataset, stiffness_text, torsion_text
from femgear.stages.protocol import StageResult
from femgear.stages.static_results import mean_over_period, peak_to_peak
from femgear.storage.contents import Contents
from femgear.storage.results import FOURIER, complex_entries, coordinates, response_variables
from femgear.system.rigid_bodies import CENTRAL
from femgear.system.system import MeshExcitation
from femgear.trains.helical.model import HelicalSet, SectionStiffness

if TYPE_CHECKING:
    import xarray as xr

    from femgear.findings import Finding
    from femgear.gears.kinematics import Speeds
    from femgear.gears.planetary import PlanetarySet
    from femgear.solvers.stability.parametric import Stability
    from femgear.system.system import MechanicalSystem, Modes, Response
    from femgear.trains.helical.section import HelicalCase

_BODIES = (
    "",
    "mass [kg]",
    "polar, diametral inertia [kg m^2]",
    "radial, axial [N/m]",
    "tilt, torsional [N m/rad]",
)


@dataclass(frozen=True)
class HelicalModesResult(StageResult):
    """Modes with mean mesh stiffness, and what excites them.

    Parameters
    ----------
    planetary_set : PlanetarySet
        The set in its transverse section.
    data : HelicalSet
        Its rigid bodies, supports and mesh stiffnesses.
    system : MechanicalSystem
        Its equations of motion.
    modes : Modes
        With mean mesh stiffness.
    phasing : tuple of str
        Phasing of the planets in every mode, see `femgear.system.mode_kinds.phasing`.
    flank : {1, -1}
        Sign of `femgear.system.mesh_directions.mesh_directions`.
    section : SectionStiffness, optional
        Stiffness of a tooth pair in the transverse and in the normal section, where it was computed.
    excitation, whole : MeshExcitation, optional
        Along the tooth normals, a row a slice, and a row a mesh at its static state with fixed centres; None where
        the mesh stiffness is given.
    frictionless : MeshExcitation, optional
        ``excitation`` without the friction that acts.
    """

    planetary_set: PlanetarySet
    data: HelicalSet
    system: MechanicalSystem
    modes: Modes
    phasing: tuple[str, ...]
    flank: int
    section: SectionStiffness | None = None
    excitation: MeshExcitation | None = None
    whole: MeshExcitation | None = None
    frictionless: MeshExcitation | None = None

    def contents(self) -> Contents:
        """Collect the contents of modes.nc of a helical case: six motions of all bodies, no elastic ring."""
        contents = modes_dataset(
            self.data,
            self.planetary_set,
            self.modes,
            attrs={"title": "modes of the helical set at standstill"} | _attributes(self),
            phasing=self.phasing,
            along=" along the tooth normals",
        )
        if (whole := self.whole) is None:
            return contents
        along, where = np.cos(self.data.base_helix_angle), ("mesh", "position")
        position = np.arange(whole.stiffness.shape[1]) / whole.stiffness.shape[1]
        curves = {
            "helical_stiffness": (
                where,
                whole.stiffness * along**2,
                "N/m",
                "mesh stiffness along the transverse line of action",
            ),
            "helical_ste": (
                where,
                whole.deflection / along,
                "m",
                "static transmission error along the transverse line of action, centres fixed",
            ),
        }
        return contents.merge(Contents(curves, coords=coordinates(position=position), attrs={}))


@dataclass(frozen=True)
class HelicalDynamicsResult(StageResult):
    """Periodic response at every ``input_speed`` (speeds,) [rad/s], its ``stability``, and loads.

    ``modes`` are those it is made of, ``speeds`` those of the members, ``response`` the harmonics of the meshes.
    ``loads`` holds complex harmonics by name: ``pin`` (speeds, N, 6, H + 1) and ``support``
    (speeds, 3, 6, H + 1), three forces [N] and three moments [N m] each. ``friction_change`` (speeds,) [dB] is what
    friction adds to the forces of all supports, where it acts.
    """

    modes: HelicalModesResult
    input_speed: np.ndarray
    speeds: tuple[Speeds, ...]
    response: Response
    stability: Stability
    loads: dict[str, np.ndarray]
    friction_change: np.ndarray | None = None

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return bool(np.all(self.response.converged))

    @property
    def residual(self) -> float:
        """Largest relative residual of the solutions."""
        return float(np.max(self.response.residual))

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return self.response.message

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what dynamics.nc says against itself, see `response_warnings`."""
        return response_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of dynamics.nc of a helical case."""
        response, basis, lines = self.response, self.modes, ("speed", "mesh", "harmonic")
        data = basis.data
        whole = (len(response.mesh_frequency), 2 * data.n_planets, data.slices, -1)
        force, deflection = response.force.reshape(whole), response.deflection.reshape(whole)
        pin, support = self.loads["pin"], self.loads["support"]
        along = np.cos(data.base_helix_angle)
        on_planet = ("speed", "planet", "direction", "harmonic")
        on_member = ("speed", "member", "axis", "harmonic")
        entries = (
            (
                "dte",
                lines,
                deflection.mean(axis=2) / along,
                "m",
                "dynamic transmission error along the transverse line of action at mid-face",
            ),
            ("mesh_force", lines, force.sum(axis=2), "N", "dynamic mesh force along the tooth normals"),
            (
                "mesh_deflection",
                lines,
                deflection.mean(axis=2),
                "m",
                "deflection of the mesh spring along the tooth normals at mid-face",
            ),
            (
                "slice_force",
                ("speed", "mesh", "slice", "harmonic"),
                force,
                "N",
                "dynamic force of a slice along the tooth normals",
            ),
            ("pin_force", on_planet, pin[:, :, :3], "N", "force of the pin on the planet"),
            ("pin_moment", on_planet, pin[:, :, 3:], "N m", "moment of the pin on the planet"),
            ("support_force", on_member, support[:, :, :3], "N", "force of the support on the member"),
            ("support_moment", on_member, support[:, :, 3:], "N m", "moment of the support on the member"),
        )
        variables = response_variables(self) | complex_entries(entries)
        if self.friction_change is not None:
            words = "added by friction to the fluctuation of the forces of all supports"
            variables["friction_change"] = ("speed", self.friction_change, "dB", words)
        return Contents(
            variables,
            coords=_coordinates(self),
            attrs={
                "title": "periodic response of the helical set by the spectral method",
                "message": response.message,
                "ring_teeth": basis.planetary_set.ring.teeth,
                "fourier_convention": FOURIER,
            }
            | _attributes(basis),
        )


def _coordinates(result: HelicalDynamicsResult) -> dict[str, tuple]:
    data = result.modes.data
    slices = {"slice": ("slice", data.slice_heights, "m", "height of the slice above mid-face")}
    return slices | coordinates(
        mesh=result.modes.planetary_set.mesh_names,
        speed=result.input_speed / RPM,
        harmonic=np.arange(result.response.force.shape[-1]),
        planet=np.arange(1, data.n_planets + 1),
        direction=["radial", "tangential", "axial"],
        member=CENTRAL,
        axis=["x", "y", "z"],
    )


def _attributes(result: HelicalModesResult) -> dict:
    data, section = result.data, result.section
    given = {
        "model": "helical",
        "planet_angles": np.asarray(data.planet_angles),
        "base_helix_angle": data.base_helix_angle,
        "face_width": data.face_width,
    }
    if section is not None:
        given |= {"virtual_teeth": np.array(section.teeth), "section_factor": section.factor}
    return given


def describe_helical(case: HelicalCase, planetary: PlanetarySet) -> tuple[Block, ...]:
    """Tabulate bodies and supports of a case with its transverse section."""
    return (Block("Helical model", _BODIES, tuple(_bodies(case)), _model(case, planetary)),)


def _bodies(case: HelicalCase) -> Iterator[tuple[str, ...]]:
    helical, planet = case.helical, case.planet
    for name, section, radial in (
        ("sun", case.sun, support_text(case, "sun")),
        ("ring", helical.ring, support_text(case, "ring", helical.ring)),
        ("carrier", case.carrier, support_text(case, "carrier")),
        ("planet (pin)", planet, f"{planet.bearing_stiffness:.6g}"),
    ):
        space = getattr(helical, name.partition(" ")[0])
        yield (
            name,
            f"{section.mass:.6g}",
            f"{section.inertia:.6g}, {space.diametral_inertia:.6g}",
            f"{radial}, {space.axial_stiffness:.6g}",
            f"{space.tilt_stiffness:.6g}, {torsion_text(case, name, space.torsional_stiffness)}",
        )


def _model(case: HelicalCase, s: PlanetarySet) -> tuple[str, ...]:
    helical, given = case.helical, case.helical.mesh_stiffness
    if given is not None:
        text = f"mesh stiffness along the tooth normals: {stiffness_text(given)}"
    elif helical.section == "normal":
        teeth = "/".join(str(z) for z in virtual_teeth(s, helical.helix_angle))
        text = f"mesh stiffness: of the static solution, teeth as stiff as those of virtual gears {teeth}"
    else:
        text = "mesh stiffness: of the static solution, teeth of the transverse section"
    section = "gears, meshes and static solution are those of the transverse section"
    slices = "one slice" if helical.slices == 1 else f"{helical.slices} slices"
    points = helical.contact_points.replace("_", " ")
    return section, text, f"{slices} over the face width; forces act at the {points}"


def describe_helical_static(static: xr.Dataset, modes: xr.Dataset | None = None) -> Block:
    """Tabulate static.nc, which holds spur gears, and beside them the helical meshes of modes.nc."""
    curves = "ste", "mesh_stiffness"
    sources = [("spur", [(mean_over_period(static, name), peak_to_peak(static, name)) for name in curves])]
    if modes is not None and "helical_ste" in modes:
        sliced = (modes[name].values for name in ("helical_ste", "helical_stiffness"))
        sources.insert(0, ("helical", [(values.mean(axis=1), np.ptp(values, axis=1)) for values in sliced]))
    header, columns = ["mesh"], [[str(name) for name in static["mesh"].values]]
    for name, pair in sources:
        for sizes, short, factor, unit in zip(pair, ("STE", "k"), (1e6, 1e-6), ("um", "N/um")):
            header += [f"{name} {short} mean [{unit}]", "p-p"]
            columns += [[f"{factor * v:.4g}" for v in size] for size in sizes]
    header.append("spur force [N]")
    columns.append([f"{v:.3f}" for v in static["mesh_force"].values.mean(axis=1)])
    share = static["load_share"].values
    notes = [
        "spur: transverse spur section, whose gears the slices come from; all along its line of action",
        f"load share of a planet in the transverse spur section {share.min():.4f} to {share.max():.4f} "
        f"(equal: {1 / static.sizes['planet']:.4f}); contact: {static.attrs.get('contact', 'unknown')}",
    ]
    if static.attrs.get("mesh_periods", 1) > 1:
        notes.append(str(static.attrs["period"]))
    return Block("Static", tuple(header), tuple(zip(*columns)), tuple(notes))
