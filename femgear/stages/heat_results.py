"""Stage "heat": heat.nc, its tables, its rows of the verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.quantities import CELSIUS, RPM
from femgear.findings import Finding
from femgear.report.tables import Block, Marks, tabulate
from femgear.stages.key_figures import NUMBER, KeyFigure, Stored
from femgear.stages.losses_results import point_label
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.storage.results import as_written, declared

if TYPE_CHECKING:
    import xarray as xr

HEAT_KEY_FIGURES = (
    KeyFigure("scuffing safety", NUMBER, "heat", Stored("scuffing_safety", pick="smallest"), ("W-HEAT",), whole=True),
    KeyFigure("film ratio", NUMBER, "heat", Stored("smallest_film_ratio", pick="smallest"), whole=True),
)
"""Key figures of all trains with temperatures: the worst of all operating points and kinds of mesh."""
_SHOWN = 12
"""Operating points in a table, at most."""
_CURVE = "{} mesh_kind point"
HEAT_VARIABLES = {
    "path_place": ("mesh_kind point", "m", "path coordinate from the pitch point in the direction of motion"),
    "path_load": (_CURVE, "N/m", "largest load over width at the place, of all tooth pairs, slices and planets"),
    "path_pressure": (_CURVE, "Pa", "pressure of that load by Hertz"),
    "specific_sliding": ("mesh_kind gear point", "1", "sliding over the speed of the own surface"),
    "sliding_speed": (_CURVE, "m/s", "sliding speed"),
    "flash_temperature": (_CURVE, "K", "flash temperature of that load, ISO/TS 6336-20"),
    "shared_flash_temperature": (_CURVE, "K", "flash temperature with the load sharing factor X_Gamma of the standard"),
    "film_ratio": (_CURVE, "1", "film over roughness lambda_GF,Y, ISO/TS 6336-22; NaN without load or oil data"),
    "heat_friction": ("{} mesh_kind standard", "1", "coefficient of friction of ISO/TS 6336-20 and -22, or as given"),
    "bulk_temperature": ("{} mesh_kind standard", "degC", "bulk temperature by flash temperatures, and by losses"),
    "highest_temperature": ("{} mesh_kind", "degC", "largest contact temperature, ISO/TS 6336-20"),
    "scuffing_temperature": ("", "degC", "temperature at which the oil fails; NaN without fzg_stage"),
    "scuffing_safety": ("{} mesh_kind", "1", "S_B of ISO/TS 6336-20; NaN without fzg_stage"),
    "smallest_film_ratio": ("{} mesh_kind", "1", "lambda_GF,min of ISO/TS 6336-22"),
    "film_safety": ("{} mesh_kind", "1", "S_lambda of ISO/TS 6336-22; NaN without permissible_film"),
}
"""Variables of heat.nc: dimensions, of which {} is that of the operating points, unit and text."""
STANDARDS = ("ISO/TS 6336-20", "ISO/TS 6336-22")


@dataclass(frozen=True)
class MeshHeat:
    """Temperatures and oil film of a kind of mesh over its path of contact.

    Parameters
    ----------
    path : (n,) array
        [m]
    line_load, pressure : (n,) arrays
        [N/m], [Pa]
    specific_sliding : (2, n) array
        Of gear 1 and gear 2 [1].
    sliding : (n,) array
        [m/s]
    flash, shared_flash : (n,) arrays
        Flash temperature of the computed loads, and with X_Gamma [K].
    film : (n,) array
        Film over roughness [1].
    friction : (float, float)
        Coefficients of ISO/TS 6336-20 and -22.
    bulk : (float, float)
        Bulk temperatures by flash temperatures and by losses [K].
    scuffing : float
        Scuffing temperature [K]; NaN without a load stage.
    safety : float
        S_B.
    oil : float
        Temperature of the oil [K].
    """

    path: np.ndarray
    line_load: np.ndarray
    pressure: np.ndarray
    specific_sliding: np.ndarray
    sliding: np.ndarray
    flash: np.ndarray
    shared_flash: np.ndarray
    film: np.ndarray
    friction: tuple[float, float]
    bulk: tuple[float, float]
    scuffing: float
    safety: float
    oil: float

    @property
    def highest(self) -> float:
        """Largest contact temperature [K]."""
        return self.bulk[0] + float(self.flash.max())

    @property
    def idle(self) -> MeshHeat:
        """The same mesh without load: teeth as hot as the oil, whose film then matters nowhere."""
        nothing, oil = 0.0 * self.flash, self.oil
        return replace(
            self,
            line_load=nothing,
            pressure=nothing,
            flash=nothing,
            shared_flash=nothing,
            film=nothing + math.nan,
            bulk=(oil, oil),
            safety=math.nan,
        )

    @property
    def smallest_film(self) -> float:
        """Smallest film over roughness; NaN where it is not known."""
        return float(np.nanmin(self.film)) if np.isfinite(self.film).any() else math.nan


@dataclass(frozen=True, eq=False)
class HeatResult(StageResult):
    """Temperatures and oil films of all operating points.

    Parameters
    ----------
    points : tuple of tuple of MeshHeat
        By operating point and kind of mesh.
    kinds : tuple of str
        Names of the kinds of mesh.
    dim : str
        ``"speed"`` or ``"load_case"``.
    labels : array or sequence of str
        Speeds of the input [rad/s], or names of load cases.
    oil_temperature : float
        [K]
    permissible_film : float
        lambda_GFP; NaN where the case has none.
    """

    points: tuple[tuple[MeshHeat, ...], ...]
    kinds: tuple[str, ...]
    dim: str
    labels: Any
    oil_temperature: float
    permissible_film: float = math.nan

    @property
    def message(self) -> str:
        """How the temperatures were found."""
        return "closed forms at every point of the path, by the loads of the contact"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what heat.nc says against itself."""
        return heat_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of heat.nc."""
        first = self.points[0]

        def every(read) -> np.ndarray:
            return np.array([[read(mesh) for mesh in point] for point in self.points])

        smallest = every(lambda mesh: mesh.smallest_film)
        values = {
            "path_place": [mesh.path for mesh in first],
            "path_load": every(lambda mesh: mesh.line_load),
            "path_pressure": every(lambda mesh: mesh.pressure),
            "specific_sliding": [mesh.specific_sliding for mesh in first],
            "sliding_speed": every(lambda mesh: mesh.sliding),
            "flash_temperature": every(lambda mesh: mesh.flash),
            "shared_flash_temperature": every(lambda mesh: mesh.shared_flash),
            "film_ratio": every(lambda mesh: mesh.film),
            "heat_friction": every(lambda mesh: mesh.friction),
            "bulk_temperature": every(lambda mesh: mesh.bulk) - CELSIUS,
            "highest_temperature": every(lambda mesh: mesh.highest) - CELSIUS,
            "scuffing_temperature": first[0].scuffing - CELSIUS,
            "scuffing_safety": every(lambda mesh: mesh.safety),
            "smallest_film_ratio": smallest,
            "film_safety": smallest / self.permissible_film,
        }
        count = len(first[0].path)
        coords: dict[str, tuple] = {
            "mesh_kind": ("mesh_kind", list(self.kinds), "1", "kind of mesh"),
            "point": ("point", np.arange(count), "1", "point of the path of contact"),
            "gear": ("gear", ["first", "second"], "1", "gear of the mesh"),
            "standard": ("standard", list(STANDARDS), "1", "standard"),
        }
        if self.dim == "speed":
            coords["speed"] = ("speed", as_written(np.asarray(self.labels) / RPM), "rpm", "speed of the input")
        else:
            coords[self.dim] = (self.dim, list(self.labels), "1", "load case")
        texts = {name: (dims.format(self.dim), unit, text) for name, (dims, unit, text) in HEAT_VARIABLES.items()}
        attrs = {
            "title": "temperatures and oil film of the teeth",
            "oil_temperature": self.oil_temperature - CELSIUS,
            "permissible_film": self.permissible_film,
        }
        return Contents(declared(texts, {name: np.asarray(value) for name, value in values.items()}), coords, attrs)


def heat_warnings(data: Any) -> Iterator[Finding]:
    """List safeties below one."""
    for name, words, key in (
        ("scuffing_safety", "scuffing safety S_B", "lubricant.fzg_stage"),
        ("film_safety", "film safety S_lambda", "lubricant.permissible_film"),
    ):
        values = np.asarray(data[name].values, float)
        if np.isfinite(values).any() and (least := float(np.nanmin(values))) < 1.0:
            yield Finding("W-HEAT", key, f"{words} is {least:.2f}", limit="1 and more")


def hottest_point(data: Any) -> tuple[int, str]:
    """Find the operating point of heat.nc with the hottest contact: its number, and its speed or load case."""
    highest = data["highest_temperature"]
    number = int(np.nanmax(np.asarray(highest.values, float), axis=1).argmax())
    return number, point_label(data, highest.dims[0], number)


def describe_heat(data: Any) -> Block:
    """Tabulate temperatures, films and safeties of the operating points of heat.nc."""
    dim = data["highest_temperature"].dims[0]
    labels, kinds = data[dim].values, [str(kind) for kind in data["mesh_kind"].values]
    places = [(point, kind) for point in range(min(len(labels), _SHOWN)) for kind in range(len(kinds))]

    def figure(name: str, form: str, *rest: int):
        def text(place: tuple[int, int]) -> str:
            value = float(np.asarray(data[name].values)[(*place, *rest)])
            return f"{value:{form}}" if math.isfinite(value) else "-"

        return text

    columns = {
        "speed" if dim == "speed" else "load case": lambda place: point_label(data, dim, place[0]),
        "mesh": lambda place: kinds[place[1]],
        "flash, largest [K]": lambda place: f"{float(data['flash_temperature'].values[place].max()):.1f}",
        "teeth [°C]": figure("bulk_temperature", ".1f", 0),
        "by losses [°C]": figure("bulk_temperature", ".1f", 1),
        "contact [°C]": figure("highest_temperature", ".1f"),
        "S_B": figure("scuffing_safety", ".2f"),
        "lambda_GF,min": figure("smallest_film_ratio", ".3f"),
    }
    notes = [
        f"oil at {float(data.attrs['oil_temperature']):.1f} °C; teeth: bulk temperature of ISO/TS 6336-20, by losses: "
        "of ISO/TS 6336-22, with X_Ca 1; K_A alone multiplies the computed loads",
    ]
    if not np.isfinite(float(data["scuffing_temperature"].values)):
        notes.append("give lubricant.fzg_stage to get S_B")
    return tabulate("Temperatures", places, columns, notes)


def heat_tables(data: Any) -> Iterator[Block]:
    """Tabulate where on the path the contact is hottest and the film thinnest, where that is largest."""
    number, where = hottest_point(data)
    kinds = [str(kind) for kind in data["mesh_kind"].values]

    def row(kind: int) -> tuple[str, ...]:
        place = 1e3 * data["path_place"].values[kind]
        flash, film = data["flash_temperature"].values[number, kind], data["film_ratio"].values[number, kind]
        hottest = int(flash.argmax())
        thin = f"{place[int(np.nanargmin(film))]:+.3f}" if np.isfinite(film).any() else "-"
        sliding = data["specific_sliding"].values[kind]
        worst = ", ".join(f"{min(values[0], values[-1]):.3f}" for values in sliding)
        shared = float(data["shared_flash_temperature"].values[number, kind].max())
        return kinds[kind], f"{place[hottest]:+.3f}", thin, f"{shared:.1f}", worst

    header = ("mesh", "hottest [mm]", "thinnest film [mm]", "flash with X_Gamma [K]", "specific sliding, smallest")
    note = f"at {where}; places from the pitch point towards the tip of the first gear"
    yield Block("Over the path of contact", header, tuple(row(kind) for kind in range(len(kinds))), (note,))


def heat_rows(results: Any, marks: Marks) -> Iterator[tuple[str, str]]:
    """Write the rows of a verdict on scuffing and film; none where no temperatures were computed."""
    if "heat" not in results.stages:
        return
    data = results.heat
    kinds = [str(kind) for kind in data["mesh_kind"].values]
    for name, words, form in (
        ("highest_temperature", "hottest contact, ISO/TS 6336-20", "{:.0f} °C"),
        ("scuffing_safety", "smallest scuffing safety S_B, ISO/TS 6336-20", "{:.2f}"),
        ("smallest_film_ratio", "thinnest film lambda_GF,min, ISO/TS 6336-22", "{:.3f}"),
        ("film_safety", "smallest film safety S_lambda, ISO/TS 6336-22", "{:.2f}"),
    ):
        values = np.asarray(data[name].values, float)
        if not np.isfinite(values).any():
            continue
        pick = np.nanargmax if name == "highest_temperature" else np.nanargmin
        at = np.unravel_index(int(pick(values)), values.shape)
        text = form.format(values[at])
        below = name.endswith("_safety") and values[at] < 1.0
        marked = marks(text, *(("W-HEAT",) if below else ()), "W-OIL", of=("heat",))
        dim = data[name].dims[0]
        several = f", {point_label(data, dim, int(at[0]))}" if len(values) > 1 else ""
        yield words, f"{marked}, {kinds[at[1]]}{several}"
