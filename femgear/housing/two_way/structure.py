"""The housing that stands still: a linear structure, fixed in space, that the planets' meshes run around in.

`FixedStructure` is all that the two-way solution (`femgear.housing.two_way.response`) knows of a casing, and
what every source of one is converted to: natural frequencies, damping, mode shapes along the path of the
meshes and at the sensors, and the static compliance of the modes left out. It comes from the cyclic modes of
a ring on springs (`supported_ring`) or from arrays (`from_arrays`), those of a file by `numpy.load`.

At the housing angle phi the path has the displacement ``w_m(phi) = sum_n P[m, n] exp(i n phi)`` of mode m,
n = -n_max .. n_max: the component, on the pitch circle, along the line of action of the planet-ring mesh,
positive where the ring gives way to the planet. A mesh force f >= 0 at phi does the modal force w_m(phi) f.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import eigh

from femgear.errors import CaseError
from femgear.housing.sensor import ReadOnlyArrays

if TYPE_CHECKING:
    from femgear.fe.reduction import CyclicModes

_ROUNDING, _FREE = 1e-9, 1e-12
"""Part of an array by which it may miss a symmetry; of the largest omega^2 below which a motion is free."""
_NOTHING = 1e-8
"""Part of a wave in a mode that is rounding: what such waves do to one another is its square."""
_SAME_PLACE = 1e-9
"""Angle within which supports stand at one place [rad]."""
_CONDITION = 1e3
"""Of the Fourier matrix of points around the ring, beyond which they leave gaps."""


@dataclass(frozen=True)
class FixedStructure(ReadOnlyArrays):
    """Linear structure, fixed in space, under loads that run around its ring.

    CaseError: E-SHAPE: arrays that do not fit each other or are not finite. E-MECHANISM: a motion that
    nothing holds. E-DAMPING. E-SYMMETRY: coefficients that belong to no real displacement.

    Parameters
    ----------
    natural_frequency : (m,) array
        Undamped, of mass-normalised modes [rad/s]; above zero, for something must hold the ring.
    damping_ratio : (m,) array
        0 <= zeta < 1.
    ring_shape : (m, 2 n_max + 1) complex array
        Circumferential coefficients P of the displacement on the path of the meshes [kg^-1/2], see the head
        of this module; ``P[m, -n]`` is the conjugate of ``P[m, n]``.
    sensor_shape : (m, n_sensors) array
        Displacement of the modes at the sensors, each in its own direction [kg^-1/2].
    residual : (2 n_max + 1, 2 n_max + 1) complex array
        Static compliance of what the modes leave out [m/N], ``sum_m P[m, n] conj(P[m, n'])/omega_m^2`` over
        the missing modes m: Hermitian.
    sensor_residual : (n_sensors, 2 n_max + 1) complex array
        The same from the path to the sensors [m/N], ``sum_m phi_m conj(P[m, n'])/omega_m^2``.
    sensor_area : (n_sensors,) array, optional
        Of the outer surface that moves as the sensor does, across it [m^2]; 0 of sensors that stand for none.
    wave_shape : (m, n_waves) complex array
        The modes in the waves of a ring alone, see `ring_waves`; no waves where there is no such ring.
    wave_order : (n_waves,) int array
        Circumferential order n of every wave ``exp(i n phi)``.
    sectors : int
        Equal sectors around the ring: waves of the orders n and n' act on one another only where the number
        divides ``n - n'``.
    """

    natural_frequency: np.ndarray
    damping_ratio: np.ndarray
    ring_shape: np.ndarray
    sensor_shape: np.ndarray
    residual: np.ndarray
    sensor_residual: np.ndarray
    sensor_area: np.ndarray | None = None
    wave_shape: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    wave_order: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    sectors: int = 1

    def __post_init__(self):
        super().__post_init__()
        (m, width), sensors = self.ring_shape.shape, self.sensor_shape.shape[-1]
        waves = len(self.wave_order)
        shapes = {
            "wave_shape": (m if waves else 0, waves),
            "wave_order": (waves,),
            "natural_frequency": (m,),
            "damping_ratio": (m,),
            "ring_shape": (m, width),
            "sensor_shape": (m, sensors),
            "residual": (width, width),
            "sensor_residual": (sensors, width),
        }
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array.shape != shape or not np.isfinite(array).all() or width % 2 == 0:
                raise CaseError(
                    f"{name} of shape {array.shape} does not fit a structure of {m} modes, {width} "
                    f"circumferential coefficients and {sensors} sensors, or is not finite",
                    code="E-SHAPE",
                    key=name,
                    limit=f"finite numbers of shape {shape}, coefficients n = -n_max .. n_max",
                )
        area = self.sensor_area
        if area is not None and (area.shape != (sensors,) or not (area >= 0).all() or not 0 < area.sum() < np.inf):
            raise CaseError(
                f"areas of shape {area.shape} are not those of the {sensors} sensors",
                code="E-SHAPE",
                key="sensor_area",
                limit="one for each, 0 or more [m^2], one above 0",
            )
        if not (self.natural_frequency > 0).all():
            raise CaseError(
                "a mode of the structure is free or has a negative stiffness",
                code="E-MECHANISM",
                key="natural_frequency",
                value=float(self.natural_frequency.min()),
                limit="above 0 rad/s",
                remedy="hold the structure: supports, bolts, a foundation",
            )
        if not ((self.damping_ratio >= 0) & (self.damping_ratio < 1)).all():
            message, limit = "damping ratios of the structure", "0 or more, below 1"
            raise CaseError(message, code="E-DAMPING", value=self.damping_ratio.tolist(), limit=limit)
        for name, first, second in (
            ("ring_shape", self.ring_shape, self.ring_shape[:, ::-1]),
            ("residual", self.residual, self.residual.T),
            ("residual", self.residual, self.residual[::-1, ::-1]),
            ("sensor_residual", self.sensor_residual, self.sensor_residual[:, ::-1]),
        ):
            if np.abs(first - second.conj()).max(initial=0.0) > _ROUNDING * np.abs(first).max(initial=0.0):
                message, limit = "no real displacement has such coefficients", "that of -n conjugate to n"
                raise CaseError(message, code="E-SYMMETRY", key=name, limit=f"{limit}, compliances Hermitian")

    @property
    def max_diameter(self) -> int:
        """Largest nodal diameter n_max of the path."""
        return self.ring_shape.shape[1] // 2

    def moved_by(self, waves: np.ndarray) -> np.ndarray:
        """Find numbers (k,) of the modes that have some of the waves (2 n_max + 1,) bool of the path or of the ring."""
        n = np.arange(-self.max_diameter, self.max_diameter + 1)
        moved = np.zeros(len(self.natural_frequency), bool)
        for shape, order in ((self.ring_shape, n), (self.wave_shape, self.wave_order)):
            if len(order):
                size = np.abs(shape)
                size_of_group = size[:, np.isin(order, n[waves])].max(axis=1, initial=0.0)
                moved |= size_of_group > _NOTHING * size.max(axis=1, initial=0.0)
        return np.flatnonzero(moved)

    def combined(self, weights) -> FixedStructure:
        """Replace the sensors by k weighted sums of them, ``weights`` (n_sensors, k)."""
        weights = np.asarray(weights, float)
        shape, residual = self.sensor_shape @ weights, weights.T @ self.sensor_residual
        return replace(self, sensor_shape=shape, sensor_residual=residual, sensor_area=None)

    def below(self, max_frequency: float) -> FixedStructure:
        """Represent the modes beyond a frequency [Hz] by their static part."""
        kept = self.natural_frequency <= 2 * np.pi * max_frequency
        left = self.ring_shape[~kept].conj() / self.natural_frequency[~kept, None] ** 2
        return replace(
            self,
            natural_frequency=self.natural_frequency[kept],
            damping_ratio=self.damping_ratio[kept],
            ring_shape=self.ring_shape[kept],
            sensor_shape=self.sensor_shape[kept],
            residual=self.residual + self.ring_shape[~kept].T @ left,
            sensor_residual=self.sensor_residual + self.sensor_shape[~kept].T @ left,
            wave_shape=self.wave_shape[kept] if len(self.wave_order) else self.wave_shape,
        )


_ARRAYS = ("natural_frequency", "damping_ratio", "ring_angle", "ring_shape", "sensor_shape")
_OPTIONAL = ("ring_compliance", "sensor_compliance", "sensor_area")
ARRAY_NAMES = (*_ARRAYS, *_OPTIONAL)
"""Arrays that `from_arrays` takes."""
_DIMENSIONS = {
    "natural_frequency": [("modes",)],
    "damping_ratio": [(), ("modes",)],
    "ring_angle": [("points",)],
    "ring_shape": [("modes", "points", "2")],
    "sensor_shape": [("modes", "sensors")],
    "ring_compliance": [("points", "points")],
    "sensor_compliance": [("sensors", "points")],
    "sensor_area": [("sensors",)],
}
_LARGEST = 1e30
"""Entry of an array in SI units, at most: squares of larger ones overflow, and no casing has them."""
_SLOWEST, _FASTEST = 2e-3 * np.pi, 2e9 * np.pi
"""Natural frequencies that a casing can have: 1 mHz to 1 GHz [rad/s]."""


def _check_arrays(values: Mapping[str, np.ndarray]) -> None:
    """Refuse arrays of other dimensions, entries that are not finite and frequencies that no casing has."""
    for name, array in values.items():
        shapes = _DIMENSIONS[name]
        if array.ndim not in map(len, shapes):
            raise CaseError(
                f"{name} has the shape {array.shape}",
                code="E-SHAPE",
                key=name,
                limit=" or ".join(f"({', '.join(shape)}{',' * (len(shape) == 1)})" for shape in shapes),
                remedy="export the array with these dimensions",
            )
        if not (np.abs(array) <= _LARGEST).all():
            wrong = array[~(np.abs(array) <= _LARGEST)][0]
            raise CaseError(
                f"{name} has an entry that is not finite, or too large",
                code="E-FINITE",
                key=name,
                value=float(wrong),
                limit=f"finite numbers up to {_LARGEST:g} in SI units",
                remedy="export the array again, and look at the units",
            )
    frequency = values["natural_frequency"]
    outside = frequency[(frequency > 0) & ((frequency < _SLOWEST) | (frequency > _FASTEST))]
    if outside.size:
        raise CaseError(
            "a natural frequency that no casing has",
            code="E-RANGE",
            key="natural_frequency",
            value=float(outside[0]),
            limit=f"{_SLOWEST:.3g} to {_FASTEST:.3g} rad/s",
            remedy="give natural frequencies in rad/s",
        )


def from_arrays(arrays: Mapping[str, object], *, direction, max_diameter: int) -> FixedStructure:
    """Make a structure of mode shapes at points of the pitch circle and at sensors.

    CaseError: as `FixedStructure`; E-KEY-MISSING: arrays that are missing; E-COUNT: too few points;
    E-DUPLICATE: two at one angle; E-FINITE: entries that are not finite, or too large; E-RANGE: points that
    leave gaps, a direction that is no unit vector, natural frequencies that no casing has.

    Parameters
    ----------
    arrays : mapping of str to (...) array
        ``natural_frequency`` (m,) [rad/s] of mass-normalised modes; ``damping_ratio`` () or (m,);
        ``ring_angle`` (p,), housing angles of the points [rad], all around in any order, at least four a
        nodal diameter; ``ring_shape`` (m, p, 2), displacement there outwards and counter-clockwise
        [kg^-1/2]; ``sensor_shape`` (m, n_sensors) [kg^-1/2]. Where modes are missing, their static compliance
        [m/N]: ``ring_compliance`` (p, p) between the points in that direction, ``sensor_compliance``
        (n_sensors, p) from the points to the sensors. For the sound ``sensor_area`` (n_sensors,), of the
        surface that every sensor across it stands for [m^2], 0 of others.
    direction : (radial, tangential)
        Of the force on the ring along the line of action, a unit vector.
    max_diameter : int
        Largest nodal diameter kept.
    """
    missing = [name for name in _ARRAYS if name not in arrays]
    if missing:
        message, limit = f"the structure lacks {', '.join(missing)}", f"the arrays {', '.join(_ARRAYS)}"
        raise CaseError(message, code="E-KEY-MISSING", key=missing[0], limit=limit)
    values = {name: np.asarray(arrays[name], float) for name in (*_ARRAYS, *_OPTIONAL) if name in arrays}
    _check_arrays(values)
    angle, shape, sensors = (values[name] for name in ("ring_angle", "ring_shape", "sensor_shape"))
    if np.abs(angle).max(initial=0.0) > 4 * np.pi:
        message, limit = "angles of the points beyond two turns", "radians, up to one turn"
        raise CaseError(message, code="E-UNITS", key="ring_angle", value=float(np.abs(angle).max()), limit=limit)
    apart = np.diff(around := np.sort(angle.ravel() % (2 * np.pi)), append=around[:1] + 2 * np.pi)
    if (apart <= 1e-3 * 2 * np.pi / max(angle.size, 1)).any():
        value, limit = float(around[apart.argmin()]), "one point at an angle, zero and a turn being one"
        raise CaseError(
            "two points of the ring stand at the same angle",
            code="E-DUPLICATE",
            key="ring_angle",
            value=value,
            limit=limit,
            remedy="keep one of them",
        )
    points, least = angle.size, max(4 * max_diameter, 1)
    if points < least:
        message = f"{points} points of the ring do not resolve {max_diameter} nodal diameters"
        raise CaseError(message, code="E-COUNT", key="ring_angle", limit=f"{least} points or more")
    between = values.get("ring_compliance", np.zeros((points, points)))
    away = values.get("sensor_compliance", np.zeros((sensors.shape[-1], points)))
    fits = shape.shape[1:] == (points, 2) and between.shape == (points, points)
    if angle.ndim != 1 or not fits or away.shape[-1] != points:
        message = f"shapes {shape.shape} and compliances {between.shape}, {away.shape} at {points} points"
        raise CaseError(message, code="E-SHAPE", key="ring_shape", limit=f"(modes, {points}, 2)")
    waves = np.exp(1j * np.outer(angle, np.arange(-max_diameter, max_diameter + 1)))
    fit = np.linalg.pinv(waves)
    if not np.linalg.cond(waves) < _CONDITION or abs(np.linalg.norm(direction) - 1.0) > _ROUNDING:
        message = "the points leave gaps around the ring, or the direction of the force is no unit vector"
        raise CaseError(message, code="E-RANGE", key="ring_angle", remedy="give equally spaced points")
    return FixedStructure(
        natural_frequency=values["natural_frequency"],
        damping_ratio=np.broadcast_to(values["damping_ratio"], shape.shape[:1]),
        ring_shape=shape @ np.asarray(direction, float) @ fit.T,
        sensor_shape=sensors,
        residual=fit @ (0.5 * (between + between.T)) @ fit.conj().T,
        sensor_residual=away @ fit.conj().T,
        sensor_area=values.get("sensor_area"),
    )


@dataclass(frozen=True)
class Support:
    """A bolt, foot or lug of the outer surface: springs to the ground and a mass that moves along.

    Parameters
    ----------
    angle : float
        Of its middle on the housing [rad].
    radial_stiffness, tangential_stiffness : float
        [N/m].
    mass : float
        [kg].
    width : float
        Angle over which stiffness and mass are spread evenly [rad]; 0 for a point.
    """

    angle: float
    radial_stiffness: float
    tangential_stiffness: float
    mass: float = 0.0
    width: float = 0.0

    def __post_init__(self):
        values = self.radial_stiffness, self.tangential_stiffness, self.mass, self.width
        if not (np.isfinite([self.angle, *values]).all() and min(values) >= 0 and self.width <= 2 * np.pi):
            message = f"a support at {self.angle} rad with stiffness, mass and width {values}"
            raise CaseError(message, code="E-SUPPORT", limit="not negative, a width of one turn at most")


def circumferential(ring: CyclicModes, values, max_diameter: int) -> np.ndarray:
    """Compute the circumferential coefficients of a functional of cyclic modes, per ring coordinate.

    Parameters
    ----------
    values : (m,) complex array
        What the functional takes from every mode, a column of ``ring.load`` or ``ring.output``.
    max_diameter : int
        Largest nodal diameter of the result; waves of others are left out.

    Returns
    -------
    (n_coordinates, 2 max_diameter + 1) complex array
        ``V`` of the value ``sum_n V[i, n] exp(i n phi)`` at the angle phi for the unit coordinate i: cosine
        and, of paired modes, sine of every mode in turn.
    """
    mode, sine = _coordinates(ring)
    n, single = ring.nodal_diameter[mode], ~ring.paired[mode]
    value = np.where(sine, -1j, 1.0) * np.where(single, 1.0, 0.5) * (ring.norm * values)[mode]
    columns = np.zeros((len(mode), 2 * max_diameter + 1), complex)
    for kept, sign in ((n <= max_diameter, 1), ((n <= max_diameter) & ~single, -1)):
        columns[kept, max_diameter + sign * n[kept]] = value[kept] if sign > 0 else np.conj(value[kept])
    return columns


def _coordinates(ring: CyclicModes) -> tuple[np.ndarray, np.ndarray]:
    """Mode of every coordinate of a ring, int, and whether it is its sine, bool, (n_coordinates,) each."""
    mode = np.repeat(np.arange(len(ring.paired)), np.where(ring.paired, 2, 1))
    return mode, np.append(False, mode[1:] == mode[:-1])


def ring_waves(order) -> np.ndarray:
    """Make waves ``(a - i b)/sqrt 2`` of cosine a and sine b of the coordinates of a ring, a unitary matrix.

    (n_waves, n_coordinates) from the orders (n_waves,) int: n and -n of a pair stand together. In a frame
    that has turned by the angle theta a wave has the factor ``exp(i n theta)``.
    """
    first, half = np.flatnonzero(np.asarray(order) < 0) - 1, np.sqrt(0.5)
    waves = np.eye(len(order), dtype=complex)
    waves[first, first] = waves[first + 1, first] = half
    waves[first, first + 1], waves[first + 1, first + 1] = -1j * half, 1j * half
    return waves


@dataclass(frozen=True)
class _Places:
    """Places on the outer surface: p patches that are loaded or observed.

    ``angle`` (p,) around the ring and ``width`` (p,) [rad], ``direction`` (p,) from outwards [rad], and ``waves`` (p,),
    the largest order of the waves that each feels.
    """

    angle: np.ndarray
    width: np.ndarray
    direction: np.ndarray
    waves: np.ndarray

    def factors(self, order: np.ndarray) -> np.ndarray:
        """Means (p, n) over the places of waves ``exp(i n phi)`` of orders (n,); zero of those not felt."""
        mean = np.exp(1j * np.outer(self.angle, order)) * np.sinc(np.outer(self.width, order) / (2 * np.pi))
        return np.where(np.abs(order) <= self.waves[:, None], mean, 0.0)

    def moved(self, radial: np.ndarray, tangential: np.ndarray) -> np.ndarray:
        """Displacement (n_coordinates, p) of coordinates with fields (n_coordinates, 2 top + 1) of waves."""
        order = np.arange(radial.shape[1]) - radial.shape[1] // 2
        waves, across, along = self.factors(order).T, np.cos(self.direction), np.sin(self.direction)
        return np.real(across * (radial @ waves) + along * (tangential @ waves))


def _patches(supports: Sequence[Support], top: int) -> tuple[_Places, np.ndarray, np.ndarray]:
    """Cut supports into patches that waves of an order resolve; their stiffness [N/m] and mass [kg] (p,)."""
    rows = list[tuple[float, ...]]()
    for support in supports:
        count = max(int(np.ceil(2 * top * support.width)), 1)
        width = support.width / count
        for i in range(count):
            angle = support.angle + (i - 0.5 * (count - 1)) * width
            for turned, stiffness in ((0.0, support.radial_stiffness), (0.5 * np.pi, support.tangential_stiffness)):
                rows.append((angle, width, turned, stiffness / count, support.mass / count))
    angle, width, direction, stiffness, mass = np.array(rows).reshape(-1, 5).T
    return _Places(angle, width, direction, np.full(len(angle), np.inf)), stiffness, mass


def _beyond_modes(rim: np.ndarray, radial, tangential, omega: np.ndarray) -> np.ndarray:
    """Compliance (m, 2, 2) of the outer surface that modes of frequencies omega [rad/s] leave out [m/N].

    Radial and tangential displacement (n_coordinates, 2 top + 1) of the coordinates. Free motions have none.
    """
    top, fields = radial.shape[1] // 2, np.stack([radial, tangential])[:, omega > 0.0]
    of_modes = np.einsum("icn,jcn,c->nij", fields, fields.conj(), 1.0 / omega[omega > 0.0] ** 2)[top:]
    rest = np.array(rim)
    rest[: top + 1] -= of_modes[: len(rest)]
    values, ways = np.linalg.eigh(rest)
    # differences of rounding are no negative compliance
    return (ways * np.maximum(values, 0.0)[:, None]) @ ways.conj().swapaxes(1, 2)


def _compliance(rest: np.ndarray | None, loads: _Places, seen: _Places) -> np.ndarray:
    """Compliance (n_loads, n_seen) of the outer surface beyond its modes between places [m/N]."""
    compliance = np.zeros((len(loads.angle), len(seen.angle)))
    if rest is None:
        return compliance
    order = np.arange(len(rest))
    weight = np.where(order == 0, 1.0, 2.0)
    acting, watched = loads.factors(order), seen.factors(order)
    for i, to in enumerate((np.cos(seen.direction), np.sin(seen.direction))):
        for j, of in enumerate((np.cos(loads.direction), np.sin(loads.direction))):
            waves = (acting.conj() * (weight * rest[:, i, j])) @ watched.T
            compliance += of[:, None] * np.real(waves) * to
    return compliance * (loads.width > 0.0)[:, None]


def _held(
    omega: np.ndarray, supports: Sequence[Support], at: np.ndarray, between: np.ndarray, springs, fields
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness and mass of the coordinates of a ring on supports, and what its patches do to them.

    By the displacement ``at`` (n_coordinates, p) of the patches, the compliance (p, p) between them beyond
    the modes, their stiffness and mass (p,), and radial and tangential fields of the coordinates. The springs
    are less by ``B (k - (1/k + D)^-1) B^T``, B and D these displacements and that compliance: residual
    attachment, one static shape a patch, whose inertia is left out (R. R. Craig and A. J. Kurdila,
    Fundamentals of Structural Dynamics, 2006, chapter 17).
    """
    (stiffness, mass), n = springs, np.arange(fields[0].shape[1]) - fields[0].shape[1] // 2
    root = np.sqrt(stiffness)
    # springs in series with what the surface yields beneath them beyond the modes
    series = root[:, None] * np.linalg.solve(np.eye(len(root)) + root[:, None] * between * root, np.diag(root))
    carried = at @ series
    rode = at - carried @ between
    K, M = np.diag(omega**2) + (carried - at * stiffness) @ at.T, np.eye(len(omega))
    M = M + (rode * mass) @ rode.T - (at * mass) @ at.T
    for support in supports:
        apart = n[:, None] - n
        mean = np.exp(1j * apart * support.angle) * np.sinc(apart * support.width / (2 * np.pi))
        for spring, felt in zip((support.radial_stiffness, support.tangential_stiffness), fields):
            both = np.real(felt @ mean @ felt.conj().T)
            K, M = K + spring * both, M + support.mass * both
    return K, M, carried


def equal_sectors(supports: Sequence[Support], most: int) -> int:
    """Count the equal sectors of a ring on supports, up to a number that rings without supports have."""
    if not supports:
        return most
    kinds = dict[tuple[float, ...], list[float]]()
    for support in supports:
        kind = support.radial_stiffness, support.tangential_stiffness, support.mass, support.width
        kinds.setdefault(kind, []).append(support.angle)
    places = [np.array(angles) for angles in kinds.values()]
    for sectors in range(min(len(place) for place in places), 1, -1):
        turned = [np.subtract.outer(place + 2 * np.pi / sectors, place) for place in places]
        if all((np.abs(np.sin(0.5 * difference)).min(axis=1) < _SAME_PLACE).all() for difference in turned):
            return sectors
    return 1


def _modes_of(K: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squares of the natural frequencies [rad^2/s^2] and mode shapes; refuses free motions (E-MECHANISM)."""
    square, shape = eigh(K, M)
    square = np.where(square < _FREE * square[-1], 0.0, square)
    if not square[0] > 0:
        message = f"the supports leave {int((square == 0).sum())} motions of the ring free"
        remedy = "hold x, y and rotation by supports, or give the ring a foundation"
        raise CaseError(message, code="E-MECHANISM", key="housing.support", remedy=remedy)
    return square, shape


def supported_ring(  # noqa: PLR0913
    ring: CyclicModes,
    supports: Sequence[Support],
    *,
    max_diameter: int,
    max_frequency: float,
    damping_ratio: float,
    sensor_angles: Any = (0.0,),
    sensor_directions: Any = 0.0,
    sensor_widths: Any = 0.0,
    sensor_waves: Any = np.inf,
    rim: np.ndarray | None = None,
) -> FixedStructure:
    """Make a structure of a ring on supports: a Ritz approximation in the cyclic modes of the ring.

    Mass-normalised coordinates of the ring have the stiffness ``diag(omega^2) + sum k V G V^H`` and the mass
    ``1 + sum m V G V^H`` with V of `circumferential` at the outer surface, and for a support of the width b
    at the angle phi_s ``G[n, n'] = exp(i (n - n') phi_s) sin((n - n') b/2)/((n - n') b/2)``, the mean over
    it. What the surface yields under supports beyond the modes stands in series, see `_held`. Supports couple
    nodal diameters (X. Wu and R. G. Parker, J. Sound Vib. 295, 2006, 194-213).

    CaseError: as `FixedStructure`: supports that do not hold the ring (E-MECHANISM).

    Parameters
    ----------
    ring : CyclicModes
        One load, the displacement into the ring on the path of the meshes; outputs radial and tangential
        displacement of the outer surface. On its foundation, or free where the supports hold it.
    supports : sequence of Support
        None leaves the ring as it is.
    max_diameter : int
        Largest nodal diameter of the path. Supports couple those of all modes.
    max_frequency : float
        Modes beyond are represented by their static part [Hz].
    damping_ratio : float
        Of all modes.
    sensor_angles : (n_sensors,) array
        Places of the sensors, which feel the displacement of the outer surface [rad].
    sensor_directions, sensor_widths : float or (n_sensors,) array
        Directions from outwards, counter-clockwise, and angles over which sensors take the mean [rad]. The
        mean over a support times its stiffness is its force on the ground.
    sensor_waves : float or (n_sensors,) array
        Nodal diameters up to which sensors feel waves: what sensors around the ring tell of places between
        them knows nothing of shorter ones.
    rim : (m, 2, 2) complex array, optional
        Static compliance of the outer surface for waves of the orders 0 .. m - 1, all of it, see
        `femgear.fe.compliance.rim_compliance` [m/N]. Supports of no width yield nothing of their own: that of
        a point has no limit.
    """
    top = max(int(ring.nodal_diameter.max()), max_diameter)
    path, radial, tangential = (
        circumferential(ring, wave_shape, top) for wave_shape in (ring.load[:, 0], ring.output[:, 0], ring.output[:, 1])
    )
    omega = 2 * np.pi * ring.frequency[_coordinates(ring)[0]]
    rest = None if rim is None else _beyond_modes(rim, radial, tangential, omega)
    patches, *springs = _patches(supports, top)
    between = _compliance(rest, patches, patches)
    K, M, carried = _held(omega, supports, patches.moved(radial, tangential), between, springs, (radial, tangential))
    square, shape = _modes_of(K, M)
    middle = slice(top - max_diameter, top + max_diameter + 1)
    sensors = _Places(
        *np.broadcast_arrays(
            *(
                np.atleast_1d(values).astype(float)
                for values in (sensor_angles, sensor_widths, sensor_directions, sensor_waves)
            )
        )
    )
    at_sensors = sensors.moved(radial, tangential) - carried @ _compliance(rest, patches, sensors)
    waves, sensors = shape.T @ path[:, middle], shape.T @ at_sensors
    mode, sine = _coordinates(ring)
    order, n_waves = np.where(sine, -1, 1) * ring.nodal_diameter[mode], waves.shape[1]
    every = FixedStructure(
        natural_frequency=np.sqrt(square),
        damping_ratio=np.full(len(square), damping_ratio),
        ring_shape=waves,
        sensor_shape=sensors,
        residual=np.zeros((n_waves, n_waves), complex),
        sensor_residual=np.zeros((sensors.shape[1], n_waves), complex),
        wave_shape=(ring_waves(order) @ shape).T,
        wave_order=order,
        sectors=equal_sectors(supports, 2 * top + 1),
    )
    return every.below(max_frequency)
