"""The casing of a gearbox: a rigid body on feet, in which bearings, rings and couplings sit.

A station at its centre of mass has six motions; every seat and every foot is a point of it, by a rigid link. Feet are
springs to the ground along x, y and z.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.system.assembly import GROUND, MOTIONS, StationSprings, joint
from femgear.trains.gearbox.case_file import CASING, BoxBearingSection, BoxCasingSection, GearboxCase

MEMBERS = ("sun", "carrier", "ring")
# Share of the largest motion below which the casing stands still in a motion that nothing holds.
_STILL = 1e-3


@dataclass(frozen=True)
class CasingModel:
    """The casing in the model.

    Parameters
    ----------
    station : int
        Number of its station, at its centre of mass.
    stations : tuple of int
        That station, and those of its elastic motions, six each.
    centre : (3,) array
        Place of the station [m].
    seats : mapping of str to (3,) array
        Places of all that sits in the casing [m], by name, see `casing_seats`.
    standing : frozenset of str
        Names of those that are in what stands still instead.
    seat_stations : mapping of str to int
        Stations of seats that have one: those of an elastic casing.
    feet : tuple of StationSprings
        Of every foot: six rows of the motion of its place against the ground.
    foot_stiffness : (f, 6) array
        Their stiffnesses along x, y, z [N/m], infinite where rigid; zeros against rotations.
    foot_offsets : (f, 3) array
        Places of the feet from the station [m].
    """

    station: int
    stations: tuple[int, ...]
    centre: np.ndarray
    seats: Mapping[str, np.ndarray]
    standing: frozenset[str]
    seat_stations: Mapping[str, int]
    feet: tuple[StationSprings, ...]
    foot_stiffness: np.ndarray
    foot_offsets: np.ndarray

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Names of the feet."""
        return tuple(foot.name for foot in self.feet)

    @property
    def foot_places(self) -> np.ndarray:
        """Places (f, 3) of the feet [m]."""
        return self.centre + self.foot_offsets

    @property
    def elastic(self) -> tuple[int, ...]:
        """Stations that are no place, but elastic motions."""
        return self.stations[1:]


def bearing_name(bearing: BoxBearingSection, number: int) -> str:
    """Name of a bearing: as given, or by its number and its shaft."""
    return bearing.name or f"bearing {number + 1} of {bearing.shaft}"


def called(kind: str, name: str) -> str:
    """Name of a part with its kind, once."""
    return name if kind in name.split() else f"{kind} {name}"


def casing_seats(case: GearboxCase) -> dict[str, np.ndarray]:
    """Find the places (3,) of all that sits in the casing [m], by name, whether or not the casing moves.

    Bearings have their names; members of planetary sets are ``"ring of STAGE"``, couplings with the casing
    ``"coupling NAME"``, or their number in place of a name; shafts that stand still ``"SHAFT held"``.
    """
    seats = [(name, place) for _, name, place in named_seats(case)]
    return dict(seats)


def named_seats(case: GearboxCase) -> list[tuple[str, str, np.ndarray]]:
    """List key, name and place (3,) [m] of all that sits in the casing."""

    def at(shaft: str, position: float | None) -> np.ndarray:
        section = case.shaft_named(shaft)
        return np.array([*section.axis, section.start + (position or 0.0)])

    seats = [
        (f"bearing[{i}]", bearing_name(bearing, i), at(bearing.shaft, bearing.position))
        for i, bearing in enumerate(case.bearing)
        if bearing.outer_shaft is None
    ]
    for i, coupling in enumerate(case.coupling):
        if CASING in coupling.between:
            other = 1 - coupling.between.index(CASING)
            place = at(coupling.between[other], (coupling.positions or (None, None))[other])
            seats.append((f"coupling[{i}]", f"coupling {coupling.name or i + 1}", place))
    for i, stage in enumerate(case.planetary):
        shafts = [(getattr(stage, name), getattr(stage, f"{name}_position")) for name in MEMBERS]
        # a member that stands in the casing lies where the others are
        places = [at(*shaft) for shaft in shafts if shaft[0] != CASING]
        for name, (shaft, _) in zip(MEMBERS, shafts, strict=True):
            if shaft == CASING:
                place = places[-1] if name == "ring" else places[0]
                seats.append((f"planetary[{i}].{name}", f"{name} of {stage.name}", place))
    seats += [("operation.fixed", f"{name} held", at(name, 0.0)) for name in case.operation.fixed]
    return seats


def inertia_tensor(section: BoxCasingSection) -> np.ndarray:
    """Tensor of inertia (3, 3) about the centre of mass [kg m^2]: products of inertia enter with their sign turned."""
    assert section.inertia is not None
    xy, xz, yz = section.products
    return np.diag(section.inertia) - np.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])


def casing_mass(section: BoxCasingSection) -> np.ndarray:
    """Mass matrix (6, 6) of a rigid casing about its centre of mass [kg, kg m^2]."""
    assert section.mass is not None
    mass = section.mass * np.eye(6)
    mass[3:, 3:] = inertia_tensor(section)
    return mass


def casing_model(case: GearboxCase, station: int) -> CasingModel:
    """Make the seats and feet of a rigid casing on its station."""
    section = case.casing
    assert section is not None
    assert section.centre is not None
    offsets = np.array([np.subtract(foot.position or (), section.centre) for foot in section.foot])
    feet = tuple(
        joint(name, (GROUND, station), (np.zeros(3), offset), np.ones(6))
        for name, offset in zip(section.foot_names, offsets, strict=True)
    )
    stiffness = foot_stiffness(case, [foot.stiffness for foot in section.foot])
    standing = frozenset(section.stands_still)
    centre = np.array(section.centre)
    return CasingModel(station, (station,), centre, casing_seats(case), standing, {}, feet, stiffness, offsets)


def foot_stiffness(case: GearboxCase, given: Sequence[Sequence[float]]) -> np.ndarray:
    """Arrange the stiffnesses (f, 3) of feet [N/m] as those (f, 6) of joints."""
    stiffness = np.zeros((len(given), 6))
    # weight along held motions rests in these
    stiffness[:, :3] = np.where([True, True, case.motions == "space"], np.reshape(given, (-1, 3)), 0.0)
    return stiffness


def _foot_rows(casing: CasingModel, count: int) -> np.ndarray:
    """Rows (f, 3, count) of the motions of all feet along x, y, z among all motions."""
    rows = np.zeros((len(casing.feet), 3, count))
    for row, springs in zip(rows, casing.feet, strict=True):
        for at, station in enumerate(springs.stations):
            if station != GROUND:
                row[:, 6 * station : 6 * station + 6] += springs.rows[:3, 6 * at : 6 * at + 6]
    return rows


def elastic_foot_forces(casing: CasingModel | None, motion: np.ndarray) -> np.ndarray:
    """Compute the forces (f, 3) of the feet on the casing [N] at motions (6n,); zero where feet are rigid."""
    if casing is None:
        return np.zeros((0, 3))
    stiffness = casing.foot_stiffness[:, :3]
    return -np.where(np.isfinite(stiffness), stiffness, 0.0) * (_foot_rows(casing, len(motion)) @ motion)


def rigid_foot_rows(casing: CasingModel | None, count: int) -> np.ndarray:
    """Rows (r, count) of the motions that rigid feet hold, foot by foot, among all motions."""
    if casing is None:
        return np.zeros((0, count))
    return _foot_rows(casing, count)[np.isinf(casing.foot_stiffness[:, :3])]


def check_casing_held(motion: np.ndarray, levers: np.ndarray, station: int, count: int) -> None:
    """Refuse (E-MECHANISM) motions (6n, k) that nothing holds if the casing, a station, takes part in them.

    ``levers`` (6n,) compare tilts and rotations with shifts; ``count`` motions are free in all.
    """
    size = np.abs(motion) * levers[:, None]
    of_casing = size[6 * station : 6 * station + 6]
    if of_casing.max() <= _STILL * size.max():
        return
    way, _ = np.unravel_index(int(of_casing.argmax()), of_casing.shape)
    raise CaseError(
        f"nothing holds {count} motion{'s' * (count > 1)}: {CASING} ({MOTIONS[way]}) with what sits in it",
        code="E-MECHANISM",
        key="casing.foot",
        limit="feet that hold the casing along x, y and z and against turning",
        remedy="give three feet or more that do not lie on one line, with stiffness along x, y and z",
    )
