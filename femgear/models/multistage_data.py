"""Data of planetary stages in series: the stages, what couples them, what drives and what is driven."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError
from femgear.models.planar_data import CENTRAL, PlanarSet, planar_from_set
from femgear.solvers.entries import checked_count, checked_numbers

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet

# radii of base circles may be rounded; tooth numbers that differ by more are another set
_RADII = 1e-3
# largest finite stiffness of a coupling [N m/rad, N/m]; beyond, rounding hides the other springs
STIFFEST = {"torsional": 1e12, "lateral": 1e15}


@dataclass(frozen=True, order=True)
class Member:
    """A central member of a stage.

    Parameters
    ----------
    stage : int
        From 1.
    name : {"carrier", "ring", "sun"}
    """

    stage: int
    name: str

    def __post_init__(self):
        object.__setattr__(self, "stage", checked_count(self.stage, "stage", code="E-COUPLING"))

    def __str__(self) -> str:
        return f"stage {self.stage} {self.name}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One planetary set of the train.

    Parameters
    ----------
    data : PlanarSet
    teeth : (3,) tuple of int, optional
        Of sun, planet and ring (positive); speeds and mesh frequencies need them.
    fixed : {"carrier", "ring", "sun"}, optional
        Member that the housing holds; None where all three turn.
    phases : (2N,) array, optional
        Mesh phases as fractions of the mesh period, as in `PlanetarySet.mesh_phases`.
    angle : float
        Angle of the stage's x axis against the common frame at time zero [rad]; lateral couplings see it.

    Raises
    ------
    CaseError
        Tooth numbers that do not fit the base radii (E-TEETH), an unknown fixed member or one that nothing
        holds (E-MECHANISM), phases of another number of meshes (E-SHAPE).
    """

    data: PlanarSet
    teeth: tuple[int, int, int] | None = None
    fixed: str | None = "ring"
    phases: Sequence[float] | np.ndarray | None = None
    angle: float = 0.0

    def __post_init__(self):
        if self.fixed is not None and self.fixed not in CENTRAL:
            raise CaseError(
                f"a fixed member {self.fixed!r}", code="E-MECHANISM", key="fixed", limit=", ".join(CENTRAL)
            )
        if self.fixed is not None and not getattr(self.data, self.fixed).torsional_support > 0.0:
            raise CaseError(
                f"the {self.fixed} is fixed but has no torsional support", code="E-MECHANISM",
                key=f"{self.fixed}.torsional_support", limit="above 0, or infinite",
            )  # fmt: skip
        if checked_numbers(self.angle, "angle", code="E-VALUE", unit="rad").ndim or not np.isfinite(
            self.angle
        ):
            raise CaseError(f"a stage angle of {self.angle} rad", code="E-VALUE", key="angle", limit="finite")
        if self.teeth is not None:
            object.__setattr__(self, "teeth", _checked_teeth(self.data, self.teeth))
        if self.phases is not None:
            phases = np.array(checked_numbers(self.phases, "phases", code="E-SHAPE", unit=""))
            if phases.shape != (2 * self.data.n_planets,) or not np.all(np.isfinite(phases)):
                raise CaseError(
                    f"mesh phases of shape {phases.shape}", code="E-SHAPE", key="phases",
                    limit=f"{2 * self.data.n_planets} finite numbers",
                )  # fmt: skip
            phases.setflags(write=False)
            object.__setattr__(self, "phases", phases)


@dataclass(frozen=True)
class StageCoupling:
    """A shaft between two members.

    Parameters
    ----------
    first, second : Member
        Of different stages.
    torsional : float
        Stiffness against their relative rotation [N m/rad]; infinite makes one rotation of both. Not zero:
        what does not transmit torque is no coupling of speeds.
    lateral : float
        Isotropic stiffness between their centres [N/m]: two equal springs, without tilt. Infinite joins the
        centres, which only a train at rest can have, or members in frames of one speed.

    Raises
    ------
    CaseError
        Members that are none or of one stage, stiffnesses out of range (E-COUPLING).
    """

    first: Member
    second: Member
    torsional: float = math.inf
    lateral: float = 0.0

    def __post_init__(self):
        for member in (self.first, self.second):
            if member.name not in CENTRAL:
                _refuse(f"a coupling of the {member.name!r}", f"members {', '.join(CENTRAL)}")
        if self.first.stage == self.second.stage:
            _refuse(f"a coupling inside stage {self.first.stage}", "members of two stages")
        units = {"torsional": "N m/rad", "lateral": "N/m"}
        for name, unit in units.items():
            value = checked_numbers(getattr(self, name), name, code="E-COUPLING", unit=unit)
            if value.ndim or not (value >= 0.0 and (value or name == "lateral")):
                lowest = "0 or more" if name == "lateral" else "above 0"
                _refuse(f"a {name} stiffness of {value.tolist()} {unit}", f"{lowest}, or infinite")
            if STIFFEST[name] < value < math.inf:
                raise CaseError(
                    f"a {name} stiffness of {value:g} {unit}", code="E-COUPLING", key=name,
                    limit=f"up to {STIFFEST[name]:g} {unit}: beyond, rounding hides all other springs",
                    remedy="take infinite for a rigid coupling",
                )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class MultistageSet:
    """Planetary stages and their couplings.

    Parameters
    ----------
    stages : tuple of Stage
    couplings : tuple of StageCoupling
        `in_series` makes those of a plain train. None: stages side by side.
    input, output : Member
        Where the external torques act.

    Raises
    ------
    CaseError
        No stage, members of stages that are not there (E-COUPLING), one member for input and output, or one
        that is fixed (E-MECHANISM).
    """

    stages: tuple[Stage, ...]
    couplings: tuple[StageCoupling, ...]
    input: Member
    output: Member

    def __post_init__(self):
        object.__setattr__(self, "stages", tuple(self.stages))
        object.__setattr__(self, "couplings", tuple(self.couplings))
        if not self.stages or not all(isinstance(one, Stage) for one in self.stages):
            _refuse("a train without stages, or of something else", "one Stage or more")
        named = [self.input, self.output]
        named += [member for one in self.couplings for member in (one.first, one.second)]
        for member in named:
            if not 1 <= member.stage <= len(self.stages) or member.name not in CENTRAL:
                _refuse(f"{member} in a train of {len(self.stages)} stages", "members of its stages")
        for member in (self.input, self.output):
            if self.input == self.output or self.stages[member.stage - 1].fixed == member.name:
                raise CaseError(
                    f"input {self.input} and output {self.output}", code="E-MECHANISM",
                    limit="two members that turn",
                )  # fmt: skip

    @property
    def n_meshes(self) -> int:
        """Of all stages."""
        return sum(2 * stage.data.n_planets for stage in self.stages)


def in_series(
    stages: Sequence[Stage],
    *,
    driving: str = "carrier",
    driven: str = "sun",
    torsional: float | Sequence[float] = math.inf,
    lateral: float | Sequence[float] = 0.0,
    input: str = "sun",
    output: str = "carrier",
) -> MultistageSet:
    """Stages one after the other: `driving` of each turns `driven` of the next.

    Parameters
    ----------
    stages : sequence of Stage
    driving, driven : {"carrier", "ring", "sun"}
    torsional, lateral : float or one a coupling
        See `StageCoupling`.
    input, output : {"carrier", "ring", "sun"}
        Of the first and the last stage.
    """
    if len(stages) < 1:
        _refuse("a train of no stages", "one stage or more")
    count = len(stages) - 1
    stiffness = []
    for name, values in (("torsional", torsional), ("lateral", lateral)):
        values = np.atleast_1d(checked_numbers(values, name, code="E-COUPLING", unit=""))
        if values.ndim != 1 or len(values) not in (1, count):
            _refuse(f"{values.size} {name} stiffnesses", f"one, or {count}")
        stiffness.append(np.broadcast_to(values, count).tolist())
    couplings = tuple(
        StageCoupling(Member(n + 1, driving), Member(n + 2, driven), *(values[n] for values in stiffness))
        for n in range(count)
    )
    return MultistageSet(
        stages=tuple(stages), couplings=couplings, input=Member(1, input), output=Member(count + 1, output)
    )


def stage_of_set(planetary_set: PlanetarySet, *, fixed: str | None = "ring", angle=0.0, **lumped) -> Stage:
    """Stage with the teeth, mesh phases, radii and angles of a geared set.

    Parameters
    ----------
    planetary_set : PlanetarySet
    fixed, angle
        See `Stage`.
    lumped
        Bodies and stiffnesses, see `femgear.models.planar_data.planar_from_set`.
    """
    s = planetary_set
    return Stage(
        data=planar_from_set(s, **lumped),
        teeth=(s.sun.teeth, s.planet.teeth, s.ring.teeth),
        fixed=fixed,
        phases=s.mesh_phases,
        angle=angle,
    )


def shaft_stiffness(
    diameter: float, length: float, *, young: float = 206e9, poisson: float = 0.3
) -> dict[str, float]:
    """Torsional and lateral stiffness of a solid round shaft whose ends do not tilt.

    ``k_t = G pi d^4 / (32 L)`` and, for Timoshenko's beam, ``k = 12 E I / (L^3 (1 + phi))`` with ``phi = 12 E
    I / (kappa G A L^2)`` (J. S. Przemieniecki, Theory of Matrix Structural Analysis, 1968, section 5.6) and
    ``kappa = 6 (1 + nu) / (7 + 6 nu)`` (G. R. Cowper, J. Appl. Mech. 33, 1966, 335-340).

    Parameters
    ----------
    diameter, length : float
        [m]
    young : float
        [Pa]
    poisson : float

    Returns
    -------
    dict
        ``torsional`` [N m/rad] and ``lateral`` [N/m], as `StageCoupling` takes them.

    Raises
    ------
    CaseError
        Lengths or moduli that no shaft has (E-COUPLING).
    """
    if not all(math.isfinite(one) and one > 0.0 for one in (diameter, length, young)):
        _refuse(f"a shaft of {diameter} m by {length} m and {young} Pa", "finite and above 0")
    if not -1.0 < poisson <= 0.5:
        _refuse(f"Poisson's ratio of {poisson}", "above -1, 0.5 or less")
    shear = young / (2.0 * (1.0 + poisson))
    polar = math.pi * diameter**4 / 32.0
    bending = 12.0 * young * 0.5 * polar
    kappa = 6.0 * (1.0 + poisson) / (7.0 + 6.0 * poisson)
    phi = bending / (kappa * shear * 0.25 * math.pi * diameter**2 * length**2)
    return {"torsional": shear * polar / length, "lateral": bending / (length**3 * (1.0 + phi))}


def _checked_teeth(data: PlanarSet, teeth) -> tuple[int, int, int]:
    numbers = checked_numbers(teeth, "teeth", code="E-TEETH", unit="")
    if numbers.shape != (3,) or not np.all(np.isfinite(numbers) & (numbers >= 1) & (numbers % 1 == 0)):
        raise CaseError(
            f"tooth numbers {numbers.tolist()}",
            code="E-TEETH",
            key="teeth",
            limit="sun, planet and ring, above 0",
        )
    sun, planet, ring = (int(z) for z in teeth)
    for name, ratio, radii in (
        ("planet", planet / sun, data.planet_radius / data.sun_radius),
        ("ring", ring / sun, data.ring_radius / data.sun_radius),
    ):
        if abs(radii / ratio - 1.0) > _RADII:
            raise CaseError(
                f"{name} and sun have {ratio:.6g} as ratio of teeth and {radii:.6g} as ratio of base radii",
                code="E-TEETH", key="teeth", value=(sun, planet, ring), limit="the same to 0.1 %",
            )  # fmt: skip
    return sun, planet, ring


def _refuse(message: str, limit: str):
    raise CaseError(message, code="E-COUPLING", limit=limit)
