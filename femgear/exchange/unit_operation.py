"""Loads of a REXS unit and its load cases as tables of a gearbox: torques, forces, speeds, shares.

The load that takes the power is the one that says no torque.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from femgear.case.quantities import SPEED, TORQUE
from femgear.exchange.gear_unit import POWER, UnitFlow, unit_flow, with_load_case
from femgear.exchange.planetary_stage import with_unit
from femgear.exchange.rexs import Component, Model
from femgear.exchange.unit_bearings import FORCE
from femgear.exchange.unit_shafts import NoGearbox
from femgear.exchange.unit_spectrum import load_case_shares, share_time

_USUAL_SPEED = 1000.0 * SPEED.scale


@dataclass(frozen=True)
class ShaftGroup:
    """Shafts that stages and couplings tie together.

    Parameters
    ----------
    shafts : tuple of str
        Their ids.
    freedom : int
        In how many ways they turn: shafts less stages and couplings.
    ends : tuple of str
        Shafts of one stage, which nothing holds.
    """

    shafts: tuple[str, ...]
    freedom: int
    ends: tuple[str, ...]


def shaft_groups(
    shafts: Sequence[str],
    stages: Iterable[Sequence[str | None]],
    joints: Iterable[Sequence[str]] = (),
    held: Iterable[str] = (),
) -> list[ShaftGroup]:
    """Find the groups of shafts from the shafts of stages, None the casing, and those that couplings join or hold.

    A stage takes one freedom, and so does a coupling between shafts that no other one joins already.
    """
    ties = [[shaft for shaft in stage if shaft is not None] for stage in stages]
    turning = _merged(shafts, joints)
    group = _merged(shafts, [*joints, *ties])
    standing = {turning[shaft] for shaft in held}
    groups = []
    for number in dict.fromkeys(group.values()):
        members = tuple(shaft for shaft in shafts if group[shaft] == number)
        inside = [tie for tie in ties if tie and group[tie[0]] == number]
        rotors = {turning[shaft] for shaft in members}
        ends = tuple(
            shaft
            for shaft in members
            if turning[shaft] not in standing
            and sum(turning[shaft] in {turning[o] for o in tie} for tie in inside) == 1
        )
        groups.append(ShaftGroup(members, len(rotors - standing) - len(inside), ends))
    return groups


def _merged(shafts: Sequence[str], ties: Iterable[Sequence[str]]) -> dict[str, int]:
    """Number of the group of every shaft that ties make."""
    group = {shaft: number for number, shaft in enumerate(shafts)}
    for tie in ties:
        for shaft in tie[1:]:
            old, new = group[shaft], group[tie[0]]
            group = {shaft: new if number == old else number for shaft, number in group.items()}
    return group


@dataclass
class OperationReader:
    """Reader of the loads and load cases of a unit.

    Parameters
    ----------
    model : Model
        What the file holds.
    groups : list of ShaftGroup
        Shafts by their ids.
    members : mapping of str to list of Component
        Components of the file that make a shaft.
    loads : mapping of str to (Component, str)
        Loads of the file with the id of their shaft, by their names in the case.
    names : mapping of str to str
        Names of shafts in the case by their ids.
    """

    model: Model
    groups: list[ShaftGroup]
    members: Mapping[str, list[Component]]
    loads: Mapping[str, tuple[Component, str]]
    names: Mapping[str, str]

    def tables(self, wanted: int | None) -> tuple[dict[str, Any], dict[str, str]]:
        """Table of the operation, and shafts of loads that the file lacks by the names of these.

        NoGearbox: nothing has a torque; more or fewer outputs than ways in which shafts turn.
        """
        number, _ = self.model.chosen_case(wanted)
        cases = self.model.load_cases or ({},)
        flows, shares = [unit_flow(self.model, given) for given in cases], load_case_shares(cases)
        torques = [self._torques(given, flow) for given, flow in zip(cases, flows, strict=True)]
        outputs, added = self._outputs(torques)
        tables, places = [], {}
        for place, (given, flow, said) in enumerate(zip(cases, flows, torques, strict=True), start=1):
            torque = {name: with_unit(value, TORQUE) for name, value in said.items() if value and name not in outputs}
            if not torque:
                self.model.remark("operation", f"load case {place} has no torque: it is left out")
                continue
            table: dict[str, Any] = {"name": f"load case {place}", "torque": torque}
            table["speed"] = self._speeds(given, flow) | {}
            table |= self._forces(given)
            if (share := shares[place - 1]) is not None:
                table["share"] = float(f"{share:.12g}")
            places[place] = len(tables) + 1
            tables.append(table)
        if not tables:
            raise NoGearbox("no load gives a torque")
        share_time(tables, self.model)
        first = places.get(number)
        if first is None:
            raise NoGearbox(f"load case {number} has no torque")
        return {"output": outputs, "first": first, "load_case": tables}, added

    def _torques(self, given, flow: UnitFlow) -> dict[str, float]:
        """Torques of loads [N m] in a load case, from powers where the file has these; zero where it has none."""
        torques = {}
        for name, (part, shaft) in self.loads.items():
            load = with_load_case(part, given)
            torque = self.model.number(load, "torque_around_u_axis", TORQUE)
            power = self.model.number(load, "power", POWER)
            speed = next((flow.speed[member.id] for member in self.members[shaft] if flow.speed.get(member.id)), None)
            torques[name] = (power / speed if power is not None and speed and not torque else torque) or 0.0
        return torques

    def _outputs(self, torques: Sequence[Mapping[str, float]]) -> tuple[list[str], dict[str, str]]:
        """Names of the loads that take the power, and the shafts of those that the file lacks.

        Of every group of shafts they are loads that say no torque, else the end of a shaft of one stage without a
        load, else the load that is named last.
        """
        outputs: list[str] = []
        added: dict[str, str] = {}
        for group in self.groups:
            loads_there = [name for name, (_, shaft) in self.loads.items() if shaft in group.shafts]
            driving = [name for name in loads_there if any(said[name] for said in torques)]
            if group.freedom < 1:
                continue
            if not driving:
                which = ", ".join(self.names[shaft_there] for shaft_there in group.shafts[:6])
                raise NoGearbox(f"no load gives a torque to {which}")
            silent = [name for name in loads_there if name not in driving and self._transmits(name)]
            taking = silent[-group.freedom :]
            loaded = {self.loads[name][1] for name in loads_there if self._transmits(name)}
            for shaft in group.ends:
                if len(taking) < group.freedom and shaft not in loaded:
                    name = self._new_name(added)
                    added[name] = shaft
                    taking.append(name)
                    self.model.remark("load", f"the file has no load on {self.names[shaft]}: its end takes the power")
            if len(taking) < group.freedom and len(driving) > group.freedom - len(taking):
                taking.append(driving[-1])
            if len(taking) != group.freedom:
                raise NoGearbox(f"{group.freedom} loads have to take the power, {len(taking)} are there")
            outputs += taking
        return outputs, added

    def _new_name(self, added: Mapping[str, str]) -> str:
        """Name of a load that the file lacks, which nothing else has."""
        taken = {*added, *self.loads, *self.names.values()}
        names = ("output", *(f"output {number}" for number in range(2, 10_000)))
        return next(name for name in names if name not in taken)

    def _transmits(self, name: str) -> bool:
        return (self.model.text(self.loads[name][0], "transmits_torque") or "true") == "true"

    def _speeds(self, given, flow: UnitFlow) -> dict[str, str]:
        """Speeds that tell those of all shafts: as many of every group as it has ways to turn."""
        speeds: dict[str, str] = {}
        for group in self.groups:
            said = {}
            for shaft in group.shafts:
                for part in self.members[shaft]:
                    speed = self.model.number(with_load_case(part, given), "rotational_speed", SPEED)
                    if speed is not None and shaft not in said:
                        said[shaft] = speed
            by_flow = {
                shaft_there: flow.speed[part.id]
                for shaft_there in group.shafts
                for part in self.members[shaft_there][:1]
                if flow.speed.get(part.id)
            }
            speeds_given = said | {key: speed for key, speed in by_flow.items() if key not in said}
            if len(speeds_given) < group.freedom:
                assumed = next((shaft for shaft in group.ends if shaft not in speeds_given), group.shafts[0])
                text = f"the file does not tell the speed of {self.names[assumed]}: 1000 rpm are taken"
                self.model.remark("operation.speed", text)
                speeds_given[assumed] = _USUAL_SPEED
            for shaft, speed in list(speeds_given.items())[: group.freedom]:
                speeds[self.names[shaft]] = with_unit(speed, SPEED)
        return speeds

    def _forces(self, given) -> dict[str, Any]:
        """Forces and tilting moments at loads in a load case: v, w, u of the unit are x, y, z."""
        force, moment = {}, {}
        for name, (part, _) in self.loads.items():
            load = with_load_case(part, given)
            forces = [self.model.number(load, f"force_{way}_direction", FORCE) or 0.0 for way in "vwu"]
            moments = [self.model.number(load, f"torque_around_{way}_axis", TORQUE) or 0.0 for way in "vw"]
            if any(forces):
                force[name] = [with_unit(newtons, FORCE) for newtons in forces]
            if any(moments):
                moment[name] = [with_unit(newton_metres, TORQUE) for newton_metres in moments]
        return {key: value for key, value in (("force", force), ("tilting_moment", moment)) if value}
