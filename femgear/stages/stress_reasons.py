"""Why stresses of finite elements differ from the nominal ones of ISO 6336, told from the numbers of stress.nc.

A reason is given where they differ by more than `DIFFERS`. Its causes are looked for one by one: contact near a base
circle, a contact ratio of 2 and more, contact of a tip corner beyond the path, a thin rim; the factors that make up the
ratio stand beside them. None is guessed: what the numbers do not show is "all else".
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import family
from femgear.stages.strength import SIDES

if TYPE_CHECKING:
    import xarray as xr

    from femgear.gears.pair import GearSet
    from femgear.stages.strength import NominalStresses

DIFFERS = 1.3
"""Largest stress of finite elements over the nominal one, or that over it, for which a reason is given."""
TWO_PAIRS = 2.0
"""Transverse contact ratio from which two pairs of teeth carry at any time (ISO 6336 parts 2 and 3)."""
_AS_HERTZ = 1.1
"""Ratio of the largest pressure and that of Hertz up to which cells and deformation explain it."""
_BEYOND = 1e-6
"""Base pitches by which contact lies beyond its path where a tip corner carries."""
BASE_CIRCLE, CONTACT_RATIO, TIP_CORNER, RIM = (
    "contact near the base circle",
    "contact ratio above 2",
    "tip corner in contact",
    "thin rim",
)
"""Names of the causes."""


@dataclass(frozen=True)
class StressReason:
    """Why a stress differs from its nominal one.

    Parameters
    ----------
    title : str
        ``"contact sun-planet"`` or ``"root planet, ring side"``.
    ratio : float
        Of finite elements over ISO 6336.
    causes : dict of str
        Names of the causes that the numbers show, with these numbers; empty where they show none.
    factors : str
        What the ratio is made of.
    """

    title: str
    ratio: float
    causes: dict[str, str]
    factors: str

    @property
    def sentence(self) -> str:
        """All of it, for a note."""
        shown = "".join(f"; {name}: {numbers}" for name, numbers in self.causes.items())
        return f"{self.title}, FE/ISO = {self.ratio:.2f}: {self.factors}{shown}"


def reason_values(gears: GearSet, nominal: NominalStresses) -> dict[str, np.ndarray]:
    """Collect what stress.nc needs of geometry and nominal stresses to tell reasons, by the names of its variables.

    Of meshes (M,), of gears in meshes (M, 2).
    """
    ends = np.array([pair.path for pair in gears.kinds]) / gears.base_pitch
    rims = [
        [1.0 if root is None else root.rim for root in (nominal.roots[kind] if nominal.roots else (None, None))]
        for kind in range(len(gears.kinds))
    ]
    thickness = [
        [
            abs(gear.root_radius - gear.rim_radius) / abs(gear.tip_radius - gear.root_radius)
            for gear in (pair.gear_1, pair.gear_2)
        ]
        for pair in gears.kinds
    ]
    return {
        "contact_ratio": gears.of_kinds([pair.contact_ratio for pair in gears.kinds]),
        "path_start": gears.of_kinds(ends[:, 0]),
        "path_end": gears.of_kinds(ends[:, 1]),
        "iso_rim_factor": gears.of_kinds(np.array(rims)),
        "rim_thickness": gears.of_kinds(np.array(thickness)),
    }


def largest_pressure(data: xr.Dataset) -> np.ndarray:
    """Find the largest contact pressures (M,) of the meshes in static.nc or stress.nc [Pa]."""
    if (stored := data.get("largest_pressure")) is not None:
        return stored.values
    return data["max_pressure" if "max_pressure" in data else "contact_pressure"].values.max(axis=-1)


def over_hertz(data: xr.Dataset) -> np.ndarray:
    """Compute the largest pressures (M,) over those of Hertz for load and curvature; 0 without sigma_H0."""
    load, curvature = data["contact_worst_load"].values, data["contact_worst_curvature"].values
    hertz = data["iso_contact_stress"].values / _nominal_over_hertz(data)
    hertz = hertz * np.sqrt(load / data.attrs["nominal_load"] * curvature)
    largest = largest_pressure(data)
    return np.divide(largest, hertz, out=np.zeros(len(hertz)), where=hertz > 0.0)


def _nominal_over_hertz(data: xr.Dataset) -> np.ndarray:
    """Z_eps Z_beta of every mesh: sigma_H0 over the pressure of Hertz at the pitch point."""
    return data["iso_contact_ratio_factor"].values * data.attrs.get("iso_contact_helix_factor", 1.0)


def stress_reasons(data: xr.Dataset) -> Iterator[StressReason]:
    """Say why stresses of stress.nc differ from nominal ones by more than `DIFFERS`, of the worst mesh of its kind."""
    names = [str(name) for name in data["mesh"].values]
    if float(data.attrs.get("nominal_load", 0.0)) == 0.0:  # files of format 4 have none
        return
    for kind in dict.fromkeys(map(family, names)):
        meshes = [i for i, name in enumerate(names) if family(name) == kind]
        mesh = meshes[int(largest_pressure(data)[meshes].argmax())]
        ratio = float(largest_pressure(data)[mesh] / data["iso_contact_stress"].values[mesh])
        if _differs(ratio):
            yield _contact_reason(data, kind, mesh, ratio)
        for number, title in enumerate(SIDES.get(kind, tuple(kind.split("-")))):
            mesh = meshes[int(data["root_worst"].values[meshes, number].argmax())]
            flank = data.isel(mesh=mesh, gear=number)
            ratio = float(flank["root_worst"] / flank["iso_root_stress"])
            if _differs(ratio):
                yield _root_reason(flank, title, number, ratio, data.attrs)


def _differs(ratio: float) -> bool:
    return ratio > DIFFERS or 0.0 < ratio < 1.0 / DIFFERS


def _contact_reason(data: xr.Dataset, kind: str, mesh: int, ratio: float) -> StressReason:
    """Reason of the largest pressure of a mesh."""
    worst, load = data.isel(mesh=mesh), float(data["contact_worst_load"].values[mesh])
    share, curvature = load / float(data.attrs["nominal_load"]), float(worst["contact_worst_curvature"])
    excess, of_hertz = float(over_hertz(data)[mesh]), float(_nominal_over_hertz(data)[mesh])
    helical = float(data.attrs.get("iso_contact_helix_factor", 1.0)) > 1.0
    factors = (
        f"x {math.sqrt(curvature):.2f} by the relative curvature where the pressure is largest, {curvature:.2f} times "
        f"that of the pitch point; x {math.sqrt(share):.2f} by the load of the tooth pair, {share:.2f} of the nominal "
        f"one; x {1.0 / of_hertz:.2f}: sigma_H0 has Z_eps{' Z_beta' * helical}; x {excess:.2f} "
        f"{_beside_hertz(worst, excess, curvature)}"
    )
    return StressReason(f"contact {kind}", ratio, _contact_causes(worst, kind, excess, curvature), factors)


def _contact_causes(worst: xr.Dataset, kind: str, excess: float, curvature: float) -> dict[str, str]:
    """Causes of the largest pressure of a mesh."""
    causes = {}
    if curvature > DIFFERS:
        start, flank = min(zip(worst["contact_start"].values, kind.split("-"), strict=True))
        named = flank if flank.startswith("gear") else f"the {flank}"
        causes[BASE_CIRCLE] = f"on {named} it begins {1e3 * start:.2g} mm above the base circle"
    causes |= _many_pairs(worst)
    margin = float(worst.get("contact_worst_margin", 0.0))
    if excess > _AS_HERTZ and margin < 0.0 and not int(worst["relief_kink"]):
        causes[TIP_CORNER] = f"loaded teeth touch {-1e3 * margin:.2g} mm beyond the end of the path"
    return causes


def _root_reason(flank: xr.Dataset, title: str, number: int, ratio: float, attributes: dict) -> StressReason:
    """Reason of the largest stress in the root of gear ``number`` of a mesh."""
    share = float(flank["root_worst_load"]) / float(attributes["nominal_load"])
    rest = f"x {ratio / share:.2f} by all else" if share > 0.0 else "the tooth itself is not loaded"
    radius = float(flank["root_notch_radius"]) / attributes["module"]
    factors = (
        f"x {share:.2f} by the load of the tooth pair; {rest}: its place, rim and neighbouring teeth, which ISO 6336-3 "
        f"takes in part, the notch, sharpest radius {radius:.3f} modules"
    )
    causes = _many_pairs(flank)
    sense = -1.0 if float(attributes.get("sun_torque", 1.0)) < 0.0 else 1.0
    causes |= _corner_of_root(flank, number, sense * float(flank["root_worst_path"]))
    if "iso_rim_factor" in flank and float(flank["iso_rim_factor"]) > 1.0:
        causes[RIM] = (
            f"{float(flank['rim_thickness']):.2f} tooth heights thick, for which sigma_F0 has Y_B "
            f"{float(flank['iso_rim_factor']):.2f}; finite elements have the rim itself, as it is held"
        )
    return StressReason(f"root {title}", ratio, causes, factors)


def _many_pairs(data: xr.Dataset) -> dict[str, str]:
    """The cause that two pairs of teeth always carry."""
    value = float(data.get("contact_ratio", 0.0))
    if value < TWO_PAIRS:
        return {}
    return {CONTACT_RATIO: f"{value:.2f}: two pairs always share the load, which ISO 6336 has in factors alone"}


def _corner_of_root(flank: xr.Dataset, number: int, path: float) -> dict[str, str]:
    """The cause that a root is stressed most while a tip corner carries, beyond the end of the path [base pitches]."""
    if "path_end" not in flank:
        return {}
    beyond_end, beyond_start = path - float(flank["path_end"]), float(flank["path_start"]) - path
    beyond = max(beyond_end, beyond_start)
    if beyond <= _BEYOND:
        return {}
    whose = "its own" if (beyond_end >= beyond_start) == (number == 0) else "its mate's"
    return {TIP_CORNER: f"{whose} corner carries {beyond:.2g} base pitches beyond the end of the path"}


def _beside_hertz(flank: xr.Dataset, excess: float, curvature: float) -> str:
    """Say why the largest pressure of a mesh is not that of Hertz for its load and curvature."""
    if 1.0 / _AS_HERTZ < excess < _AS_HERTZ:
        return "by all else: cells, and teeth that deform"
    margin = float(flank.get("contact_worst_margin", 0.0))
    if excess > 1.0 and int(flank["relief_kink"]):
        return "by the kink with which a linear relief begins: under it pressure has no limit"
    if excess > 1.0 and margin < 0.0:
        return f"by the tip corner: loaded teeth touch {-1e3 * margin:.2g} mm beyond the end of the path"
    if curvature > DIFFERS:
        return "by the curvature, which changes over the width of the contact so near to the base circle"
    if excess > 1.0:
        return "by the shape of the flanks: modifications, or the end of a flank beside the contact"
    return "by contact that touches the end of a flank, whose pressure is left out, or by modifications"


def reason_row(data: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Write the row of a verdict that says which stresses differ from nominal ones, and by which causes."""
    texts = [
        f"{reason.title} {reason.ratio:.2f} ({', '.join(reason.causes) or 'see Stresses'})"
        for reason in stress_reasons(data)
    ]
    if texts:
        yield f"FE over ISO 6336, outside 1/{DIFFERS:g} to {DIFFERS:g}", ", ".join(texts)
