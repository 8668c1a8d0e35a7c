"""Shafts that nothing holds: floating along their axes, pushed where no bearing takes it, loose in the assembled model.

What entries show without a model is judged by names alone, so that all faults of a file are told at once: which shafts
bearings, couplings, planets and helical meshes tie to the casing along z, and whether the bearings of one sense can
balance the thrusts. `loose_shafts` names what is left over, the motions that the stiffness matrix leaves free.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from femgear.case.quantities import LENGTH
from femgear.errors import CaseError, ConvergenceError
from femgear.gears.shaft_graph import connected_sets
from femgear.trains.gearbox.case_file import CASING, FORCE, BoxBearingSection, GearboxCase, PairSection, named_load_case
from femgear.trains.gearbox.geometry import pair_sizes, set_sizes
from femgear.trains.gearbox.power import BoxFlow

_MOTIONS = ("along x", "along y", "along its axis", "tilting about x", "tilting about y", "turning")
"""Of the motions of a shaft, in the order of `femgear.system.assembly.MOTIONS`."""
_LEVER = 0.05
"""Length by which tilts and rotations are compared with shifts [m]."""
_PART = 1e-3
"""Share of the largest motion from which on a shaft takes part in it."""
_FREE = 0.5
"""Share of a way that free motions have of it, from which on it is one of them."""
_ROUNDING = 1e-12
"""Thrust of a shaft over the largest of a stage that is none."""
_UNTAKEN = 1e-6
"""Thrust that nothing takes, over the largest one, that is rounding."""
LARGEST_CLEARANCE = 0.1
"""Of a bearing of a shaft with a gear of a pair, over the module: the shaft moves so far before the bearing carries."""
_ALONG = 'axial = "rigid" or a stiffness, or a kind that takes thrust'
ACROSS = "give it two bearings across its axis, apart from one another, or one with a tilt stiffness"


def senses(bearing: BoxBearingSection) -> tuple[bool, bool]:
    """Tell whether a bearing takes thrust on its shaft towards +z, and towards -z."""
    if bearing.kind is None:
        if not bearing.axial:
            return False, False
        return bearing.axial_sense != "negative", bearing.axial_sense != "positive"
    if bearing.axial_sense is not None:
        return bearing.axial_sense == "positive", bearing.axial_sense == "negative"
    if bearing.kind in ("cylindrical", "needle"):
        return False, False
    if bearing.rows == 2 or bearing.contact_angle == 0.0 or bearing.kind == "spherical":
        return True, True
    return bearing.contact_angle > 0.0, bearing.contact_angle < 0.0


def _shaft_meant(case: GearboxCase, name: str) -> str:
    """Name of a shaft, or that which a wrong one is nearest to: one fault is told once."""
    names = [CASING, *(shaft.name for shaft in case.shaft)]
    return name if name in names else next(iter(difflib.get_close_matches(name, names, 1)), name)


def floating_shafts(case: GearboxCase, *, judged: Mapping[str, Sequence[int]]) -> Iterator[CaseError]:
    """Refuse shafts that nothing ties to the casing along their axes.

    Parameters
    ----------
    case : GearboxCase
        Its names need not be right.
    judged : mapping of str to sequence of int
        Numbers of the pairs and planetary sets whose sizes are known; others may tie what they join.
    """
    if case.motions != "space":
        return
    ties: list[set[str]] = [{shaft.name} for shaft in case.shaft]
    for bearing in case.bearing:
        if any(senses(bearing)):
            ties.append({_shaft_meant(case, bearing.shaft), _shaft_meant(case, bearing.outer_shaft or CASING)})
    ties += [
        set(map(lambda name: _shaft_meant(case, name), coupling.between))
        for coupling in case.coupling
        if coupling.axial
    ]
    for number, pair in enumerate(case.pair):
        if number not in judged["pair"] or pair_sizes(pair).base_helix:
            ties.append({_shaft_meant(case, name) for name in pair.shafts})
    for number, stage in enumerate(case.planetary):
        if number not in judged["planetary"] or set_sizes(stage).base_helix:
            ties.append({_shaft_meant(case, name) for name in (stage.sun, stage.carrier, stage.ring)})
    for cluster in connected_sets(ties):
        numbers = [i for i, shaft in enumerate(case.shaft) if shaft.name in cluster]
        if CASING not in cluster and numbers:
            yield _floating(case, numbers)


def _floating(case: GearboxCase, numbers: Sequence[int]) -> CaseError:
    names = [case.shaft[i].name for i in numbers]
    bearings = [bearing.name or f"bearing[{i}]" for i, bearing in enumerate(case.bearing) if bearing.shaft in names]
    plural = len(names) > 1
    return CaseError(
        f"shaft{'s' * plural} {', '.join(names)} float{'s' * (not plural)} along the axis: nothing holds "
        f"{'them' if plural else 'it'} towards +z or -z",
        code="E-MECHANISM",
        key=f"shaft[{numbers[0]}].name",
        value=f"{', '.join(bearings)} without axial stiffness" if bearings else "no bearing",
        limit="one bearing or coupling that holds it along its axis",
        remedy=f"give a bearing of {names[0]} {_ALONG}",
    )


def tilting_shafts(case: GearboxCase) -> Iterator[CaseError]:
    """Refuse shafts that tilt: on one bearing of given stiffnesses without tilt, with at most one pair of gears."""
    if case.motions != "space":
        return
    joined = {name for coupling in case.coupling for name in coupling.between}
    joined |= {name for stage in case.planetary for name in (stage.sun, stage.carrier, stage.ring)}
    for shaft in case.shaft:
        bearings = [bearing for bearing in case.bearing if shaft.name in (bearing.shaft, bearing.outer_shaft)]
        pairs = [pair for pair in case.pair if shaft.name in pair.shafts]
        alone = len(bearings) == 1 and bearings[0].kind is None and not bearings[0].tilt
        if alone and len(pairs) < 2 and shaft.name not in joined:
            yield _loose(case, shaft.name, (3, 4))


def loose_fits(case: GearboxCase, pairs: Sequence[PairSection]) -> Iterator[CaseError]:
    """Refuse bearings whose clearance swallows the load of the gears on their shaft, of pairs with known sizes."""
    for i, bearing in enumerate(case.bearing):
        on_shaft = [pair for pair in pairs if bearing.shaft in pair.shafts]
        if bearing.kind is None or not on_shaft:
            continue
        sizes = {pair.name: pair_sizes(pair) for pair in on_shaft}
        modules = {
            name: 2.0
            * size.base_radii[0]
            * math.cos(size.base_helix)
            / (size.teeth[0] * math.cos(size.pressure_angles[0]))
            for name, size in sizes.items()
        }
        name = min(modules, key=lambda key: modules[key])
        most = LARGEST_CLEARANCE * modules[name]
        if bearing.clearance > most:
            yield CaseError(
                f"the clearance swallows the load: shaft {bearing.shaft} moves by half of it before the bearing "
                "carries, and the teeth part",
                code="E-BEARING",
                key=f"bearing[{i}].clearance",
                value=LENGTH.show(bearing.clearance),
                limit=f"at most {LENGTH.show(most)}, a tenth of the module of {name}",
                remedy='give the radial clearance of the catalogue in its unit, as in "20 um"',
            )


def untaken_thrust(case: GearboxCase, flow: BoxFlow, number: int) -> Iterator[CaseError]:
    """Refuse thrusts of a load case that no bearings of their senses can balance; its number counts from 0.

    Thrusts are those of helical meshes under the torques of the power flow, and of loads; not judged where weight acts
    along z.
    """
    if case.motions != "space" or (case.gravity is not None and case.gravity.direction[2]):
        return
    names = [shaft.name for shaft in case.shaft]
    ends, bounds = _holders(case)
    held = next((cluster for cluster in connected_sets([{CASING}, *map(set, ends)]) if CASING in cluster), set())
    if {*names} <= held and all(bound == (None, None) for bound in bounds):
        return
    from scipy.optimize import linprog

    thrust = shaft_thrusts(case, flow, number)
    count, size = len(names), np.abs(thrust).max(initial=0.0)
    if not size:
        return
    balance = np.zeros((count, len(ends)))
    for column, (inner, outer) in enumerate(ends):
        for name, sign in ((inner, 1.0), (outer, -1.0)):
            if name in names:
                balance[names.index(name), column] += sign
    # slack of either sign at every shaft, as little as there need be
    shifts = np.array(list(_shifted_thrusts(case, flow))).reshape(-1, count).T
    matrix = np.hstack([balance, shifts / size, np.eye(count), -np.eye(count)])
    free = len(ends) + shifts.shape[1]
    cost = np.concatenate([np.zeros(free), np.ones(2 * count)])
    bounds = [*bounds, *[(None, None)] * shifts.shape[1], *[(0.0, None)] * (2 * count)]
    solved = linprog(cost, A_eq=matrix, b_eq=-thrust / size, bounds=bounds)
    slack = solved.x[free : free + count] - solved.x[free + count :]
    for i in np.flatnonzero(np.abs(slack) > _UNTAKEN):
        yield _untaken(case, int(i), -float(slack[i]) * size, case.operation.load_case[number].name)


def shaft_thrusts(case: GearboxCase, flow: BoxFlow, number: int) -> np.ndarray:
    """Compute the thrusts (n,) on all shafts by helical meshes and loads in a load case [N], towards +z positive.

    ``F tan(beta_b) / r_b`` of gear 1 with the sense of its torque and hand, the opposite of gear 2 or the ring; both
    meshes of a planet balance.
    """
    pushes = stage_thrusts(case, flow)
    thrust = np.sum(list(pushes.values()), axis=0) if pushes else np.zeros(len(case.shaft))
    largest = max((np.abs(push).max(initial=0.0) for push in pushes.values()), default=0.0)
    # hands that balance one another
    thrust[np.abs(thrust) < _ROUNDING * largest] = 0.0
    given = case.operation.load_case[number].force
    for load in case.load:
        place = [shaft.name for shaft in case.shaft].index(load.shaft)
        thrust[place] += load.force[2] + (given[load.name][2] if load.name in given else 0.0)
    return thrust


def stage_thrusts(case: GearboxCase, flow: BoxFlow) -> dict[str, np.ndarray]:
    """Compute the thrusts (n,) of every stage on all shafts [N], by its name."""
    names = [shaft.name for shaft in case.shaft]
    pushes = dict[str, np.ndarray]()
    for stage in (*case.pair, *case.planetary):
        if isinstance(stage, PairSection):
            sizes, (first, last) = pair_sizes(stage), stage.shafts
        else:
            sizes, first, last = set_sizes(stage), stage.sun, stage.ring
        push = -flow.first_torque(stage) * math.tan(sizes.base_helix) / sizes.base_radii[0]
        pushes[stage.name] = np.array([push * ((name == first) - (name == last)) for name in names])
    return pushes


def _shifted_thrusts(case: GearboxCase, flow: BoxFlow) -> Iterator[np.ndarray]:
    """Thrusts (n,) [N] where of stages side by side another one takes all that the first one would."""
    shares, pushes = flow.torque_shares, stage_thrusts(case, flow)
    for names in flow.side_by_side:
        first, *others = [name for name in names if shares.get(name)] or [""]
        for name in others:
            yield pushes[name] / shares[name] - pushes[first] / shares[first]


def _holders(case: GearboxCase) -> tuple[list[tuple[str, str]], list[tuple[float | None, float | None]]]:
    """Shafts that bearings, couplings and planets join along z, and bounds of their force on the first ones."""
    ends: list[tuple[str, str]] = []
    bounds: list[tuple[float | None, float | None]] = []
    for bearing in case.bearing:
        positive, negative = senses(bearing)
        if positive or negative:
            ends.append((bearing.shaft, bearing.outer_shaft or CASING))
            # thrust towards +z is held by a force towards -z
            bounds.append((None if positive else 0.0, None if negative else 0.0))
    ends += [(coupling.between[0], coupling.between[1]) for coupling in case.coupling if coupling.axial]
    bounds += [(None, None)] * (len(ends) - len(bounds))
    return ends, bounds


def _untaken(case: GearboxCase, number: int, thrust: float, load_case: str) -> CaseError:
    name, way = case.shaft[number].name, "+z" if thrust > 0.0 else "-z"
    key, reason = f"shaft[{number}].name", "no bearing that takes thrust"
    for i, bearing in enumerate(case.bearing):
        if bearing.shaft == name and any(senses(bearing)):
            key = f"bearing[{i}].{'contact_angle' if bearing.axial_sense is None else 'axial_sense'}"
            reason = f"{bearing.name or key} takes thrust towards {'+z' if senses(bearing)[0] else '-z'} alone"
            break
    return CaseError(
        f"nothing takes the thrust on shaft {name} towards {way} in {named_load_case(load_case)}",
        code="E-MECHANISM",
        key=key,
        value=f"{FORCE.show(abs(thrust))} towards {way}; {reason}",
        limit=f"a bearing of {name} that takes thrust towards {way}",
        remedy="turn the bearing round, give a second one of the other sense, or change the hand of the teeth",
    )


def loose_shafts(case: GearboxCase, owners: Sequence[str], motion: np.ndarray) -> list[CaseError]:
    """Name the shafts, and planets, that take part in free motions (6n, k), and their ways.

    ``owners`` are the shafts, or "planets of STAGE", of the n stations. Rotation counts where a shaft has nothing else.
    """
    levers = np.tile([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER], len(owners))
    weighted, problems = motion * levers[:, None], []
    least = _PART * np.abs(weighted).max()
    for owner in dict.fromkeys(owners):
        stations = np.flatnonzero([name == owner for name in owners])
        rows = weighted.reshape(len(owners), 6, -1)[stations]
        mean = rows.mean(axis=0)
        if np.abs(rows).max() <= least:
            continue
        # of the space of free motions of the body, how much of every way lies in it
        basis, sizes, _ = np.linalg.svd(mean, full_matrices=False)
        basis = basis[:, sizes > least]
        ways = [i for i in range(6) if np.linalg.norm(basis[i]) > _FREE] or [int(np.abs(mean).max(axis=1).argmax())]
        others = [i for i in ways if i != 5]
        if others or len(ways) == 1:
            problems.append((owner, others or ways))
    moving = [problem for problem in problems if problem[1] != [5]] or problems
    return [_loose(case, owner, ways) for owner, ways in moving]


def _loose(case: GearboxCase, owner: str, ways: Sequence[int]) -> CaseError:
    names = [shaft.name for shaft in case.shaft]
    if owner in names:
        key, what = f"shaft[{names.index(owner)}].name", f"shaft {owner}"
        bearings = [bearing.name or f"bearing[{i}]" for i, bearing in enumerate(case.bearing) if bearing.shaft == owner]
        value = f"bearings {', '.join(bearings)}" if bearings else "no bearing"
    else:
        stages = [f"planets of {stage.name}" for stage in case.planetary]
        key = f"planetary[{stages.index(owner)}].planet.bearing" if owner in stages else "bearing"
        what, value = owner, None
    remedies = [
        *([f"give a bearing of it {_ALONG}"] if 2 in ways else []),
        *([ACROSS] if {*ways} & {0, 1, 3, 4} else []),
    ]
    return CaseError(
        f"nothing holds {what} {', '.join(('' if i < 3 else 'against ') + _MOTIONS[i] for i in ways)}",
        code="E-MECHANISM",
        key=key,
        value=value,
        limit="bearings that hold every shaft across, along its axis and against tilting",
        remedy="; ".join(remedies) or "join it with what turns, or hold it",
    )


def without_balance(case: GearboxCase, owner: str, way: int, left: float) -> ConvergenceError:
    """Make the refusal of a load that finds no balance.

    ``owner`` moves the farthest, along or about the ``way`` of `_MOTIONS`; ``left`` is the force out of balance [N].
    """
    bearings = {i: bearing for i, bearing in enumerate(case.bearing) if bearing.shaft == owner and bearing.nonlinear}
    shafts = [shaft.name for shaft in case.shaft]
    key, value = "bearing", None
    limit = "bearings that carry what loads and weight put on the shaft, in its sense"
    remedy = "a smaller clearance or a preload of the bearings of this shaft, or a load that presses them"
    if bearings:
        i = max(bearings, key=lambda number: bearings[number].clearance)
        entry = "clearance" if way != 2 and bearings[i].kind else "axial_sense" if bearings[i].axial_sense else "kind"
        key, value = f"bearing[{i}].{entry}", getattr(bearings[i], entry)
        value = LENGTH.show(value) if entry == "clearance" else value
    elif way != 2 and owner in shafts:
        key = f"shaft[{shafts.index(owner)}]"
        limit = "shafts, bearings and teeth that give way little under the load"
        remedy = "stiffer parts or bearings of this shaft, or less torque"
    return ConvergenceError(
        f"the loads of the gearbox find no balance: {FORCE.show(left)} are left, and {owner} moves the farthest, "
        f"{_MOTIONS[way]}",
        code="E-CONVERGENCE",
        key=key,
        value=value,
        limit=limit,
        remedy="give a bearing that takes the thrust" if way == 2 else remedy,
        file=case.location(key),
    )
