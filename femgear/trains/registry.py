"""The trains that femgear knows, and the stages of a case."""

from __future__ import annotations

from femgear.case.text import described
from femgear.errors import CaseError
from femgear.trains.drivetrain.stages import DRIVETRAIN
from femgear.trains.elastic.stages import ELASTIC
from femgear.trains.gear_pair.stages import GEAR_PAIR
from femgear.trains.helical.stages import HELICAL
from femgear.trains.multistage.stages import MULTISTAGE
from femgear.trains.planar.stages import PLANAR
from femgear.trains.protocol import Stage, Train

TRAINS: tuple[Train, ...] = (MULTISTAGE, GEAR_PAIR, DRIVETRAIN, HELICAL, PLANAR, ELASTIC)
"""Special models before more general ones: a case belongs to the first whose model it is one of."""


def train_of(case) -> Train:
    """Find the train that a case is one of; other things are refused (E-TYPE)."""
    for train in TRAINS:
        if isinstance(case, train.model):
            return train
    raise CaseError(
        f"a case is needed, not {described(case)}", code="E-TYPE", remedy="femgear.read_case(path) reads one"
    )


def stages_of(case, only: str | None = None) -> tuple[Stage, ...]:
    """List the stages to compute, in order.

    Parameters
    ----------
    only : str, optional
        Last stage; it is computed with what it needs, whatever the case says of it.

    Raises
    ------
    CaseError
        E-STAGE: the case has no such stage.
    """
    train = train_of(case)
    if only is None:
        return tuple(stage for stage in train.stages if stage.wanted(case) and not stage.unavailable(case))
    last = train.stage(only)
    why = f"it is no stage of {train.words}" if last is None else last.unavailable(case)
    if why:
        allowed = [stage.name for stage in train.stages if not stage.unavailable(case)]
        raise CaseError(
            f"no stage {only}: {why}", code="E-STAGE", key="only", value=only, limit=", ".join(allowed)
        )
    needs, needed = {stage.name: stage.before(case) for stage in train.stages}, {only}
    while more := {one for name in needed for one in needs[name]} - needed:
        needed |= more
    return tuple(stage for stage in train.stages if stage.name in needed)


def check_case(case, only: str | None = None) -> None:
    """Refuse what the stages of a run cannot represent, before anything is computed.

    Raises
    ------
    CaseError, GeometryError
    """
    for check in dict.fromkeys(stage.check for stage in stages_of(case, only)):
        if check is not None:
            check(case)
