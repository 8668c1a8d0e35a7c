"""The casing of a gearbox from a file: its superelement, and the nodes of all that sits in it.

Every bearing, ring, coupling and held shaft in the casing has a node of its name, close to its place; what is left of
the distance is bridged by a rigid link.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from femgear.case.csv_columns import refuse_other_files
from femgear.case.messages import no_such
from femgear.case.quantities import LENGTH, MASS
from femgear.errors import CaseError, refused_at, several
from femgear.fe.beam import rigid_link
from femgear.findings import Finding
from femgear.report.tables import Block
from femgear.system.assembly import GROUND, Beam, Follower, Inertia, StationSprings
from femgear.trains.gearbox.case_file import CASING, BoxCasingSection, GearboxCase
from femgear.trains.gearbox.casing import CasingModel, casing_seats, foot_stiffness

if TYPE_CHECKING:
    from femgear.exchange.superelement import ModalBody, Superelement

HIGHEST_MODE = 1e6
"""Of the modes with seats and feet held that are kept where the case has no limit: the highest of any case [Hz]."""
SEAT_DISTANCE = 0.01
"""Distance of a node from the place of its seat over the size of the casing, at most."""


def casing_element(case: GearboxCase) -> Superelement:
    """Read the superelement of the casing of a case, with a node for every seat and foot.

    CaseError: as `femgear.exchange.superelement.read_superelement`; E-OTHER-CASE: files that are not those that the
    case was read with; all that makes it no casing of this case, at once.
    """
    section, (file, nodes) = case.casing, casing_file_paths(case)
    assert section is not None
    try:
        refuse_other_files((file, nodes), section.file or "", section.sha256)
        element, problems = _read(str(file), str(nodes), section.units, section.sha256 or "")
    except CaseError as error:
        is_entry = error.key in BoxCasingSection.model_fields
        error.key, error.file = f"casing.{error.key if is_entry else 'file'}", error.file or str(file)
        raise
    every = [refused_at(problem, f"casing.{problem.key}") for problem in problems]
    every += [*_seat_problems(case, section, element), *_foot_problems(section, element)]
    for problem in every:
        problem.file = str(nodes if problem.key == "casing.nodes" else file)
    if every:
        raise several(every)
    return element


def casing_file_paths(case: GearboxCase) -> tuple[Path, Path]:
    """Find file and table of nodes of a casing, beside the case file or below."""
    section, folder = case.casing, Path(case.name).parent
    assert section is not None
    return folder / (section.file or ""), folder / (section.nodes or "")


@lru_cache(maxsize=8)
def _read(file: str, nodes: str, units: str, sha256: str) -> tuple[Superelement, tuple[CaseError, ...]]:
    """Superelement of files of a checksum, each read once, and what makes it no elastic body."""
    from femgear.exchange.superelement import free_body_problems, read_superelement

    element = read_superelement(Path(file), Path(nodes), units=units)
    return element, tuple(free_body_problems(element))


def check_casing_file(case: GearboxCase) -> None:
    """Refuse, before a run, files of a casing that are none of this case."""
    if case.casing is not None and case.casing.file is not None:
        casing_element(case)


def elastic_casing(case: GearboxCase) -> tuple[Superelement, ModalBody]:
    """Read the superelement of a casing, and split it into a rigid body and elastic motions.

    CaseError: see `casing_element`.
    """
    section, element = case.casing, casing_element(case)
    assert section is not None
    seats = element.of_role("seat")
    used = [seats[name].number for name in casing_seats(case) if name not in section.stands_still]
    used += [node.number for node in element.of_role("foot").values()]
    sensor_nodes = [node.number for node in element.nodes if node.role == "sensor" and node.number not in used]
    numbers = tuple(dict.fromkeys(used)), tuple(dict.fromkeys(sensor_nodes))
    file, nodes = map(str, casing_file_paths(case))
    highest = section.max_frequency or HIGHEST_MODE
    return element, _split(file, nodes, section.units, section.sha256 or "", numbers, highest)


@lru_cache(maxsize=8)
def _split(file: str, nodes: str, units: str, sha256: str, numbers: tuple, highest: float) -> ModalBody:
    """Modal body of files of a checksum, of the ``numbers`` of the nodes of its interface and of sensors."""
    from femgear.exchange.superelement import modal_body

    interface, sensors = numbers
    return modal_body(_read(file, nodes, units, sha256)[0], interface, others=sensors, max_frequency=highest)


@dataclass(frozen=True)
class ElasticParts:
    """Stations and matrices of an elastic casing, in the order of its stations.

    Parameters
    ----------
    names : tuple of str
        Of the casing, its elastic motions, six each, and its seats.
    places : (n, 3) array
        Of these stations [m].
    held : (n, 6) bool array
        Elastic motions that there are not, or that are rigid.
    inertias : tuple of Inertia
        Of the rigid body and of the elastic motions.
    beam : Beam
        Stiffness of the elastic motions.
    followers : tuple of Follower
        Seats.
    """

    names: tuple[str, ...]
    places: np.ndarray
    held: np.ndarray
    inertias: tuple[Inertia, ...]
    beam: Beam
    followers: tuple[Follower, ...]


def elastic_casing_model(case: GearboxCase, station: int) -> tuple[CasingModel, ElasticParts]:
    """Make the stations, seats and feet of an elastic casing, from a number of station on."""
    section, (element, body) = case.casing, elastic_casing(case)
    assert section is not None
    count = len(body.stiffness)
    groups = -(-count // 6)
    stations, standing = tuple(range(station, station + 1 + groups)), frozenset(section.stands_still)

    def rows(number: int, place: np.ndarray) -> np.ndarray:
        """Motions (6, 6 (1 + groups)) of a point that a rigid link joins to a node."""
        elastic = np.zeros((6, 6 * groups))
        elastic[:, :count] = rigid_link(place - element.place[number]) @ body.shape[number]
        return np.hstack([rigid_link(place - body.centre), elastic])

    nodes = {name: node.number for name, node in element.of_role("seat").items()}
    seats = {name: place for name, place in casing_seats(case).items() if name not in standing}
    seat_stations = {name: stations[-1] + 1 + i for i, name in enumerate(seats)}
    followers = tuple(
        Follower(f"seat {name}", seat_stations[name], stations, rows(nodes[name], place))
        for name, place in seats.items()
    )
    feet, offsets, given = [], [], dict(zip(section.foot_names, section.foot, strict=True))
    for name, node in element.of_role("foot").items():
        at = rows(node.number, element.place[node.number])
        feet.append(StationSprings(name, (GROUND, *stations), np.hstack([np.zeros((6, 6)), at]), np.ones(6)))
        offsets.append(element.place[node.number] - body.centre)
    stiffness = [given[foot.name].stiffness if foot.name in given else (math.inf,) * 3 for foot in feet]
    model = CasingModel(
        station,
        stations,
        body.centre,
        casing_seats(case),
        standing,
        seat_stations,
        tuple(feet),
        foot_stiffness(case, stiffness),
        np.reshape(offsets, (-1, 3)),
    )
    return model, _elastic_parts(body, stations, seats, followers)


def _elastic_parts(body: ModalBody, stations: tuple[int, ...], seats, followers) -> ElasticParts:
    """Arrange the matrices of a body on its stations, with those of its seats."""
    count, groups = len(body.stiffness), len(stations) - 1
    rigid = np.isinf(body.stiffness)
    mass, stiffness = np.zeros((2, 6 * groups, 6 * groups))
    mass[:count, :count] = body.mass
    np.fill_diagonal(stiffness[:count, :count], np.where(rigid, 0.0, body.stiffness))
    held = np.zeros((1 + groups + len(seats), 6), bool)
    held[1 : 1 + groups] = np.append(rigid, np.ones(6 * groups - count, bool)).reshape(groups, 6)
    names = (CASING, *(f"{CASING} elastic {i + 1}" for i in range(groups)), *(f"seat {name}" for name in seats))
    places = np.vstack([np.tile(body.centre, (1 + groups, 1)), *seats.values()])
    inertias = (
        Inertia(stations[:1], body.rigid_mass, np.zeros((6, 6))),
        Inertia(stations[1:], mass, np.zeros_like(mass)),
    )
    return ElasticParts(
        names, places, held, inertias if groups else inertias[:1], Beam(stations[1:], stiffness), followers
    )


def _seat_problems(case: GearboxCase, section: BoxCasingSection, element: Superelement) -> Iterator[CaseError]:
    """Seats without a node, nodes without a seat, and nodes far from their seats."""
    nodes, seats = element.of_role("seat"), casing_seats(case)
    missing = [name for name in seats if name not in nodes and name not in section.stands_still]
    if missing:
        yield CaseError(
            f"{len(missing)} of {len(seats)} seats in the {CASING} have no node",
            code="E-KEY-MISSING",
            key="casing.nodes",
            value=", ".join(missing[:20]),
            limit="a node of the role seat NAME for each",
            remedy=f'add a row of the role "seat {missing[0]}" to the table, or list the seat in casing.stands_still',
        )
    for name in nodes:
        if name in section.stands_still:
            yield CaseError(
                "a seat stands still and has a node",
                code="E-CHOICE",
                key=f"casing.stands_still[{section.stands_still.index(name)}]",
                value=name,
                limit="one of both",
                remedy="leave it out, or take the row of the seat out of the table of nodes",
            )
        elif name not in seats:
            limit = ", ".join([*seats][:20])
            yield no_such("seat", "casing.nodes", name, [*seats], f"name what sits in the {CASING}", limit=limit)
    limit = SEAT_DISTANCE * element.size
    for name in seats.keys() & nodes.keys():
        place = element.place[nodes[name].number]
        if (distance := math.dist(place, seats[name])) > limit:
            at, wanted = (", ".join(LENGTH.show(float(value)) for value in lengths) for lengths in (place, seats[name]))
            yield CaseError(
                f"the node of the seat {name} is far from it",
                code="E-RANGE",
                key="casing.nodes",
                value=f"{LENGTH.show(distance)} off: node {nodes[name].number} at {at}, seat at {wanted}",
                limit=f"{LENGTH.show(limit)}, 1 % of the size of the casing",
                remedy="correct coordinates or position, or give casing.units; both count from one origin",
            )


def _foot_problems(section: BoxCasingSection, element: Superelement) -> Iterator[CaseError]:
    """Feet that have no node."""
    nodes = [*element.of_role("foot")]
    for number, name in enumerate(section.foot_names):
        if name not in nodes:
            limit = ", ".join(nodes[:20]) or "none: the table has no nodes of the role foot NAME"
            yield no_such("foot", f"casing.foot[{number}].name", name, nodes, "name a foot of the table", limit=limit)
    if not nodes and not section.stands_still:
        yield CaseError(
            "the casing has no feet",
            code="E-SUPPORT",
            key="casing.nodes",
            limit="one or more nodes of the role foot NAME",
            remedy="keep a node a foot in the reduction, and give it the role foot NAME",
        )


def casing_at_hand(case: GearboxCase) -> Superelement | None:
    """Read the superelement of a case; None where its files are not there, as beside the results of a run."""
    try:
        return casing_element(case)
    except CaseError as error:
        if error.code in ("E-FILE", "E-OTHER-CASE"):
            return None
        raise


def casing_notices(case: GearboxCase) -> Iterator[Finding]:
    """Tell seats whose nodes have no rotations (W-BEARING): they tilt as the casing does as a whole."""
    if case.casing is None or case.casing.file is None:
        return
    element = casing_at_hand(case)
    if element is None:
        return
    plain = [name for name, node in element.of_role("seat").items() if len(element.components(node)) == 3]
    if plain:
        text = (
            f"nodes of {len(plain)} seats have no rotations: {', '.join(plain[:5])} tilt as the casing as a whole, "
            "and moments on them do not bend it"
        )
        yield Finding("W-BEARING", "casing.nodes", text, remedy="keep six directions of the node in the reduction")


def describe_casing(case: GearboxCase) -> Iterator[Block]:
    """Tabulate mass, centre of mass, feet and seats of a casing, and the first mode of one of a file."""
    section = case.casing
    if section is None:
        return
    seats = [name for name in casing_seats(case) if name not in section.stands_still]
    if section.file is None:
        assert section.mass is not None
        mass, centre, feet, elastic = section.mass, section.centre or (), section.foot_names, "rigid"
    elif casing_at_hand(case) is None:
        yield Block("Casing", rows=(("file", section.file), ("sits in it", ", ".join(seats) or "nothing")))
        return
    else:
        element, body = elastic_casing(case)
        mass, centre, feet = body.rigid_mass[0, 0], body.centre, [*element.of_role("foot")]
        soft = np.isfinite(body.stiffness)
        elastic = f"{int(soft.sum())} elastic motions"
        if soft.any():
            square = linalg.eigvalsh(np.diag(body.stiffness[soft]), body.mass[np.ix_(soft, soft)])
            elastic += f", first mode {math.sqrt(float(square[0])) / (2.0 * math.pi):.4g} Hz when free"
    rows = [
        ("mass", MASS.show(float(mass))),
        ("centre of mass x, y, z", ", ".join(LENGTH.show(float(value)) for value in centre)),
        ("gives way", elastic),
        ("feet", ", ".join(feet)),
        ("sits in it", ", ".join(seats) or "nothing"),
    ]
    if section.stands_still:
        rows.append(("stands still", ", ".join(section.stands_still)))
    yield Block("Casing", rows=tuple(rows))
