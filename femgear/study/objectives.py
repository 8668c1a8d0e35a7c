"""What can be minimised or limited: numbers that follow from a case, each from as few stages as it needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from femgear.case.units import ACCELERATION, SPEED, TORQUE, Dimension, to_si
from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.study.variants import Range, Variant

Mesh = Literal["largest", "overall", "sun-planet", "planet-ring"]
MICROMETRES = Dimension("a length", "m", "um", 1e-6)
FORCE = Dimension("a force", "N", "N", 1.0)
LEVEL = ACCELERATION
STRESS = Dimension("a stress", "Pa", "MPa", 1e6)
NUMBER = Dimension("a number", "1", "1", 1.0)
STAGES = ("gears", "static", "stress", "dynamics", "housing")
"""In the order of their effort."""


@dataclass(frozen=True)
class Quantity:
    """A number that follows from a case.

    Parameters
    ----------
    name : str
        Says all that it depends on; two quantities of one name are the same.
    dimension : Dimension
        Its units on disk (SI) and in tables.
    stage : str
        Last stage that it needs, one of `STAGES`.
    compute : callable
        ``(Variant) -> float`` in SI units.
    signal : callable, optional
        Of a transmission error ``(sun_arc, deflection, N) -> (K, P) array``: it is the largest peak to peak.
    torque : float, optional
        Of a transmission error: on the input [N m]; None means that of the case.
    """

    name: str
    dimension: Dimension
    stage: str
    compute: Callable[[Variant], float]
    signal: Callable | None = None
    torque: float | None = None

    def show(self, value: float) -> str:
        """Text of an SI value."""
        number = f"{value / self.dimension.scale:.5g}"
        return number if self.dimension is NUMBER else f"{number} {self.dimension.shown}"


def transmission_error(mesh: Mesh = "largest", *, torque: str | None = None) -> Quantity:
    """Static transmission error, peak to peak over the record [m].

    Parameters
    ----------
    mesh : {"largest", "overall", "sun-planet", "planet-ring"}
        From sun to ring along the base circle of the sun, or the largest of one kind of mesh, or the largest
        of all these. The overall error may vanish while those of the meshes cancel one another.
    torque : str, optional
        Of the input, with its unit; that of the case when left out.

    Raises
    ------
    CaseError
        E-OBJECTIVE: no such mesh; E-TORQUE: no torque.
    """
    rows = {
        "largest": lambda arc, deflection, n: np.vstack([arc, deflection]),
        "overall": lambda arc, deflection, n: np.atleast_2d(arc),
        "sun-planet": lambda arc, deflection, n: deflection[:n],
        "planet-ring": lambda arc, deflection, n: deflection[n:],
    }
    signal = _chosen(mesh, rows, "mesh")
    value = None if torque is None else to_si(torque, TORQUE)
    if value == 0:
        raise CaseError("without torque no tooth bends", code="E-TORQUE", key="torque", value=torque)

    def compute(variant: Variant) -> float:
        cycle = variant.static(value).cycle
        return peak_to_peak(signal(cycle.sun_arc, cycle.deflection, len(cycle.deflection) // 2))

    where = "" if value is None else f" at {TORQUE.show(value)}"
    return Quantity(f"STE peak to peak, {mesh}{where}", MICROMETRES, "static", compute, signal, value)


def peak_to_peak(signals: np.ndarray) -> float:
    """Largest peak to peak of the rows."""
    return float(np.ptp(signals, axis=1).max())


def mesh_force(
    first: str,
    last: str,
    *,
    speeds: int = 51,
    part: Literal["dynamic", "peak"] = "dynamic",
    mesh: Literal["all", "sun-planet", "planet-ring"] = "all",
) -> Quantity:
    """Largest mesh force over a range of input speeds, over time and meshes [N].

    The mean force of a mesh follows from the torque whatever the flanks look like: the dynamic part is the
    largest deviation from it.

    Parameters
    ----------
    first, last : str
        Input speeds with their unit.
    speeds : int
        Number of equidistant speeds.
    part : {"dynamic", "peak"}
        Largest deviation from the mean, or largest force.
    mesh : {"all", "sun-planet", "planet-ring"}
    """
    at = _range(first, last, speeds)
    of_mean = _chosen(part, {"dynamic": True, "peak": False}, "part")
    rows = {
        "all": lambda n: slice(None),
        "sun-planet": lambda n: slice(n),
        "planet-ring": lambda n: slice(n, None),
    }
    take = _chosen(mesh, rows, "mesh")

    def compute(variant: Variant) -> float:
        force = variant.response(at).force
        chosen = force[:, take(force.shape[1] // 2)]
        return float(forces_over_time(chosen, dynamic=of_mean).max())

    which = "" if mesh == "all" else f", {mesh}"
    return Quantity(f"{part} mesh force{which}, {_words(at)}", FORCE, "dynamics", compute)


def forces_over_time(force: np.ndarray, *, dynamic: bool) -> np.ndarray:
    """Largest force, or largest deviation from its mean, of every speed and mesh [N].

    Parameters
    ----------
    force : (speeds, meshes, H + 1) complex array
        ``F(t) = Re sum_h F_h exp(i h omega t)``.
    dynamic : bool

    Returns
    -------
    (speeds, meshes) array
        From sixteen samples a period of the highest harmonic: within 2 % of its amplitude.
    """
    harmonics = force.shape[-1]
    padded = np.zeros((*force.shape[:2], 8 * harmonics + 1), complex)
    padded[..., :harmonics] = force
    padded[..., 0] = 2.0 * force[..., 0].real
    samples = 16 * harmonics
    history = np.fft.irfft(padded, samples, axis=-1) * (0.5 * samples)
    if not dynamic:
        return history.max(axis=-1)
    return np.abs(history - force[..., :1].real).max(axis=-1)


def housing_level(first: str, last: str, *, speeds: int = 51) -> Quantity:
    """Largest amplitude of any carrier order at the fixed sensor over a range of speeds [m/s^2].

    Of the exact lines (`femgear.housing.fixed_sensor_lines`) of the radial acceleration.
    """
    at = _range(first, last, speeds)

    def compute(variant: Variant) -> float:
        return float(np.abs(variant.housing(at).exact.acceleration).max())

    return Quantity(f"housing level, {_words(at)}", LEVEL, "housing", compute)


def contact_ratio(mesh: Literal["sun-planet", "planet-ring"]) -> Quantity:
    """Transverse contact ratio, from the tip circles."""
    names = {"sun-planet": "contact_ratio_sun_planet", "planet-ring": "contact_ratio_planet_ring"}
    name = _chosen(mesh, names, "mesh")
    return Quantity(f"contact ratio, {mesh}", NUMBER, "gears", lambda v: float(getattr(v.gears, name)))


def tip_thickness(gear: Literal["sun", "planet", "ring"]) -> Quantity:
    """Thickness of the teeth on the tip circle, in modules."""
    from femgear.gears.gear import tooth_thickness

    name = _chosen(gear, {g: g for g in ("sun", "planet", "ring")}, "gear")

    def compute(variant: Variant) -> float:
        found = getattr(variant.gears, name)
        return float(tooth_thickness(found, found.tip_radius)) / found.module

    return Quantity(f"tip thickness over module, {gear}", NUMBER, "gears", compute)


def contact_pressure() -> Quantity:
    """Largest contact pressure away from the ends of the flanks [Pa]."""
    return Quantity(
        "contact pressure", STRESS, "static", lambda v: float(v.static().cycle.max_pressure.max())
    )


def root_stress(gear: Literal["sun", "planet", "ring"]) -> Quantity:
    """Largest stress in the roots of a gear [Pa], of a planet in both its meshes."""
    from femgear.contact.root_stress import LOADED

    places = {"sun": ((0, 0),), "planet": ((0, 1), (1, 0)), "ring": ((1, 1),)}
    wanted = _chosen(gear, places, "gear")

    def compute(variant: Variant) -> float:
        n, roots = variant.gears.n_planets, variant.stress().roots
        # gear 1 and gear 2 of mesh 0, then of mesh 1, and so on
        chosen = [roots[2 * mesh + i] for k, i in wanted for mesh in range(k * n, (k + 1) * n)]
        return max(float(root.stress[:, :, LOADED].max()) for root in chosen)

    return Quantity(f"root stress, {gear}", STRESS, "stress", compute)


def _chosen(value, table: dict, key: str):
    """Entry of a table, refused (E-OBJECTIVE) where there is none."""
    try:
        return table[value]
    except (KeyError, TypeError):
        raise CaseError(
            f"no such {key}", code="E-OBJECTIVE", key=key, value=value, limit=", ".join(table)
        ) from None


def _range(first: str, last: str, count: int) -> Range:
    """Range of speeds from texts with units, refused (E-OBJECTIVE) where it is none."""
    low, high = to_si(first, SPEED), to_si(last, SPEED)
    if not (0 < low < high and 2 <= count <= 10000):
        raise CaseError(
            "not a range of speeds",
            code="E-OBJECTIVE",
            key="speeds",
            value=f"{count} from {first} to {last}",
            limit="2 to 10000 speeds, from over 0 upwards",
        )
    return low, high, int(count)


def _words(at: Range) -> str:
    """A range of speeds in the name of a quantity."""
    return f"{at[0] / SPEED.scale:.6g} to {SPEED.show(at[1])} ({at[2]} speeds)"
