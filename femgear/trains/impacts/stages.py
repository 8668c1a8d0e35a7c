"""The pipeline of a gear pair: response by harmonic balance, sweep and chaos by integration in time.

Lengths count in half backlashes and times in 1 / omega_n, as in `femgear.trains.impacts.model`; every file
tells these units.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.quantities import RPM
from femgear.findings import Finding
from femgear.report.tables import Block
from femgear.solvers.continuation.branches import Branch, parameter_curve
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.stability.lyapunov import LyapunovExponents, lyapunov_exponents
from femgear.solvers.time.stroboscopic import SweepResponse, sweep_up_and_down
from femgear.stages.protocol import (
    FiguresOf,
    Progress,
    Stage,
    StageResult,
    Train,
    blaming_start,
    one_blas_thread,
    silent,
)
from femgear.storage.contents import Contents
from femgear.storage.results import FOURIER, complex_entries
from femgear.trains.impacts.case_file import GearPairCase, pair_of, scales_of
from femgear.trains.impacts.judgements import impact_duty, impact_judgements
from femgear.trains.impacts.model import (
    BACK,
    DRIVE,
    STATE_NAMES,
    contact_shares,
    impact_borders,
    range_states,
    separation_ratios,
    state_regions,
)

if TYPE_CHECKING:
    import xarray as xr

# instants of a period at which extremes and contact are looked for
_INSTANTS = 512
# points of a motion that the bifurcation diagram shows, periods of a section over those of an exponent
_SHOWN, _LONGER = 80, 8
_SHARES = {
    "drive": "share of the time on the drive flank",
    "free": "share of the time between the flanks",
    "back": "share of the time on the back flank",
}
_CHAOTIC = {True: "yes", False: "no", None: "not told"}
_LENGTH, _RATE = "in half backlashes", "in natural angular frequencies"


@dataclass(frozen=True, eq=False)
class ImpactResponseResult(StageResult):
    """Periodic motions of the ``case`` along a ``branch`` of p points.

    ``lowest`` and ``highest`` (p,) are the extremes of the motion in half backlashes, ``shares`` (p,) those of the time
    with the drive flanks, none or the back flanks in contact. ``borders`` (b,) are the frequency ratios at which the
    lowest deflection passes a level, in half backlashes: flanks begin to part or to hit there; by that level.
    """

    case: GearPairCase
    branch: Branch
    lowest: np.ndarray
    highest: np.ndarray
    shares: dict[str, np.ndarray]
    borders: dict[float, np.ndarray]

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return bool(np.all(self.branch.converged))

    @property
    def residual(self) -> float:
        """Largest relative residual of the solutions."""
        return float(np.max(self.branch.residual))

    @property
    def message(self) -> str:
        """Where the branch ended, and why."""
        return self.branch.message

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what response.nc says against itself."""
        return _response_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of response.nc."""
        branch = self.branch
        variables = _motions("point", self.lowest, self.highest, np.real(branch.lines[:, 0, 0]))
        variables |= _numbers(
            "point",
            stable=(branch.stable, "whether the motion is known to be stable"),
            multiplier=(branch.largest_multiplier, "largest Floquet multiplier"),
            **{f"{name}_share": (share, _SHARES[name]) for name, share in self.shares.items()},
        )
        variables |= _numbers("limit_point", fold=(branch.folds, "number of the point, from 0"))
        words = "frequency ratio from which {} flanks {}"
        for name, level, verb in (("drive", DRIVE, "part"), ("back", BACK, "touch")):
            border = {f"{name}_border": (self.borders[level], words.format(name, verb))}
            variables |= _numbers(f"{name}_crossing", **border)
        lines = [("deflection", "point line", branch.lines[:, 0], "1", f"relative deflection {_LENGTH}")]
        coords = _ratios(self.case, "point", branch.parameter)
        coords |= _numbers("line", line=(branch.orders[:, 0], "harmonic of the tooth frequency"))
        attrs = {"message": branch.message, "complete": int(branch.complete), "fourier_convention": FOURIER}
        title = "periodic motions by harmonic balance"
        return Contents(variables | complex_entries(lines), coords, _units(self.case, title) | attrs)


@dataclass(frozen=True, eq=False)
class SweepResult(StageResult):
    """Motions to which integration of the ``case`` settles, ``up`` over ascending ratios and ``down`` again."""

    case: GearPairCase
    up: SweepResponse
    down: SweepResponse

    @property
    def converged(self) -> bool:
        """Whether all motions repeat."""
        return bool(np.all(self.up.settled) and np.all(self.down.settled))

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "integrated in time until the motion repeats"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what sweep.nc says against itself."""
        return _sweep_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of sweep.nc; both directions over the ascending ratio."""

        def both(name: str) -> np.ndarray:
            return np.array([getattr(self.up, name), getattr(self.down, name)[::-1]])

        dims = "direction ratio"
        extremes = both("lowest")[..., 0], both("highest")[..., 0], np.real(both("lines")[..., 0, 0])
        variables, settled = _motions(dims, *extremes), both("settled")
        for name in ("amplitude", "mean"):
            # one period of a motion that needs several is not its amplitude, nor its mean
            _, values, unit, words = variables[name]
            words += "; NaN where it does not repeat every tooth period"
            variables[name] = dims, np.where(settled, values, np.nan), unit, words
        variables |= _numbers(
            dims,
            settled=(settled, "whether the motion repeats"),
            periods=(both("periods"), "periods until then"),
        )
        coords = _ratios(self.case, "ratio", self.up.frequency)
        coords |= _numbers("direction", direction=(["up", "down"], "direction of the sweep"))
        return Contents(variables, coords, _units(self.case, "settled motions, ratio up and down"))


@dataclass(frozen=True, eq=False)
class ChaosResult(StageResult):
    """Lyapunov exponents of the motions of the ``case`` over the frequency ``ratio`` (r,).

    ``exponents`` has exponents and a section for every ratio, ``sections`` longer ones for some, with their ratio.
    """

    case: GearPairCase
    ratio: np.ndarray
    exponents: list[LyapunovExponents]
    sections: list[tuple[float, LyapunovExponents]]

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "integrated in time; the error of every exponent stands beside it"

    def contents(self) -> Contents:
        """Collect the contents of chaos.nc; exponents are per unit of time 1 / omega_n."""
        ratio, exponents = self.ratio, self.exponents
        variables = _numbers(
            "ratio",
            exponent=(ratio * [result.largest for result in exponents], f"largest Lyapunov exponent {_RATE}"),
            error=(ratio * [result.error[0] for result in exponents], f"its error {_RATE}"),
            lowest=([result.lowest[0] for result in exponents], f"smallest deflection {_LENGTH}"),
            highest=([result.highest[0] for result in exponents], f"largest deflection {_LENGTH}"),
            repeats=([result.section.repeats_after(1e-3) for result in exponents], "periods until it repeats, or 0"),
            chaotic=([_CHAOTIC[result.chaotic] for result in exponents], "yes, no or not told"),
        )
        points = [result.section.deflection[-_SHOWN:, 0] for result in exponents]
        variables |= _numbers("ratio period", point=(points, f"deflection once a period {_LENGTH}"))
        if self.sections:
            at, long = np.array([r for r, _ in self.sections]), [section for _, section in self.sections]
            velocity = at[:, None] * [result.section.velocity[:, -1] for result in long]
            variables |= _numbers(
                "section",
                section_ratio=(at, "frequency ratio of the section"),
                section_exponent=(at * [result.largest for result in long], f"largest exponent {_RATE}"),
                section_error=(at * [result.error[0] for result in long], f"its error {_RATE}"),
            )
            variables |= _numbers(
                "section run",
                section_deflection=([result.section.deflection[:, 0] for result in long], f"deflection {_LENGTH}"),
                section_velocity=(velocity, f"velocity {_LENGTH}, {_RATE}"),
            )
        title = "Lyapunov exponents and sections once a period"
        return Contents(variables, _ratios(self.case, "ratio", ratio), _units(self.case, title))


def _numbers(dims: str, **entries: tuple) -> dict[str, tuple]:
    """Entries ``(values, words)`` without a unit."""
    return {name: (dims, values, "1", words) for name, (values, words) in entries.items()}


def _motions(dims: str, lowest, highest, mean) -> dict[str, tuple]:
    return _numbers(
        dims,
        amplitude=(0.5 * (highest - lowest), f"half of largest less smallest, {_LENGTH}"),
        mean=(mean, f"mean deflection {_LENGTH}"),
        lowest=(lowest, f"smallest deflection {_LENGTH}"),
        highest=(highest, f"largest deflection {_LENGTH}"),
        state=(np.array(STATE_NAMES)[range_states(lowest, highest)], "contact state"),
    )


def _ratios(case: GearPairCase, dimension: str, ratio) -> dict[str, tuple]:
    """Frequency ratio and speed of the driving gear along a dimension."""
    speed = ratio * scales_of(case).frequency / case.gears.teeth[0]
    words = "tooth frequency over natural frequency"
    return {
        "ratio": (dimension, ratio, "1", words),
        "speed": (dimension, speed / RPM, "rpm", "speed of the driving gear"),
    }


def _units(case: GearPairCase, title: str) -> dict[str, Any]:
    """Attributes: title, half backlash [m], natural frequency [Hz], and force that counts as one [N]."""
    scales = scales_of(case)
    natural = scales.frequency / (2.0 * np.pi)
    lengths = {"half_backlash": scales.length, "natural_frequency": natural, "unit_force": scales.force}
    return {"title": title} | lengths


@one_blas_thread()
def solve_impact_response(case: GearPairCase) -> ImpactResponseResult:
    """Follow periodic motions over the frequency ratio past limit points, with stability and contact."""
    pair, given = pair_of(case), case.response
    with blaming_start(case, "response.from"):
        branch = parameter_curve(
            pair.problem,
            (given.start, given.to),
            1.0,
            harmonics=given.harmonics,
            samples=1024,
            radius=False,
            options=StepOptions(largest=given.largest_step),
        )
    phase = 2.0 * np.pi * np.arange(_INSTANTS) / _INSTANTS
    x = np.array([solution.at(phase)[:, 0] for solution in branch.solutions])
    borders = {level: np.sort(impact_borders(pair, branch, level)) for level in (DRIVE, BACK)}
    return ImpactResponseResult(case, branch, x.min(axis=1), x.max(axis=1), contact_shares(x), borders)


@one_blas_thread()
def solve_sweep(case: GearPairCase) -> SweepResult:
    """Integrate in time at every frequency ratio until the motion repeats, upwards and from there back."""
    pair, given = pair_of(case), case.sweep
    assert given is not None
    ratios = np.concatenate([np.linspace(range_.start, range_.to, range_.count) for range_ in given.ranges])
    up, down = sweep_up_and_down(
        lambda ratio: (pair.problem(ratio), pair.frequency),
        ratios,
        steps=given.steps * pair.periods,
        periods=pair.periods,
        most=given.most_periods,
    )
    return SweepResult(case, up, down)


@one_blas_thread()
def solve_chaos(case: GearPairCase, *, progress: Progress = silent) -> ChaosResult:
    """Compute Lyapunov exponents over the ratio, each from the end of the one before, and long sections."""
    pair, given, results = pair_of(case), case.chaos, []
    assert given is not None
    ratios, start = np.linspace(given.start, given.to, given.count), None
    options: dict[str, Any] = {"steps": given.steps * pair.periods, "periods": pair.periods}
    for number, ratio in enumerate(ratios):
        progress("chaos", number, len(ratios))
        results.append(
            lyapunov_exponents(
                pair.problem(ratio),
                pair.frequency,
                points=given.points,
                skip=given.skip,
                start=start,
                **options,
            )
        )
        start = results[-1].section.displacement[-1], results[-1].section.velocity[-1]
    sections = []
    for wanted in given.sections:
        place = int(np.argmin(np.abs(ratios - wanted)))
        end = results[place].section
        once = lyapunov_exponents(
            pair.problem(ratios[place]),
            pair.frequency,
            points=_LONGER * given.points,
            skip=100,
            start=(end.displacement[-1], end.velocity[-1]),
            **options,
        )
        sections.append((float(ratios[place]), once))
    return ChaosResult(case, ratios, results, sections)


def _describe_case(case: GearPairCase) -> tuple[Block, ...]:
    """Tabulate units and numbers of the pair of a case."""
    scales, pair = scales_of(case), pair_of(case)
    numbers = {
        "natural frequency [Hz]": scales.frequency / (2.0 * np.pi),
        "its speed of the driving gear [rpm]": scales.frequency / case.gears.teeth[0] / RPM,
        "half backlash b [um]": 1e6 * scales.length,
        "force k b [N]": scales.force,
        "load over k b": pair.load,
        "damping ratio": pair.damping_ratio,
    }
    rows = [(text, f"{value:.6g}") for text, value in numbers.items()]
    waves = {"tooth error over b": pair.tooth_error, "mesh stiffness wave over its mean": pair.stiffness}
    for text, wave in waves.items():
        rows.append((text, ", ".join(f"{abs(amplitude):.6g}" for amplitude in wave) or "none"))
    notes: tuple[str, ...] = ()
    if pair.load and len(pair.tooth_error) == 1 and pair.bearings is None:
        parting = separation_ratios(
            damping_ratio=pair.damping_ratio, load=abs(pair.load), error=abs(pair.tooth_error[0])
        )
        ends = " and ".join(f"{ratio:.4f}" for ratio in parting) or "no ratio"
        notes = (f"with constant stiffness drive flanks begin to part at {ends} of the natural frequency",)
    return (Block("Gear pair", (), tuple(rows), notes),)


def _case_warnings(case: GearPairCase) -> Iterator[Finding]:
    """List what is allowed but deserves a look."""
    if case.operation.torque == 0.0:
        yield Finding("W-LOAD", "operation.torque", "without load nothing keeps the flanks on one side")
    if not (case.mesh.error or case.mesh.stiffness_waves or any(case.gears.eccentricity)):
        text = "neither error nor stiffness waves nor eccentricity excite the pair"
        yield Finding("W-EXCITATION", "mesh", text)


def _response_warnings(data: xr.Dataset) -> Iterator[Finding]:
    if not data.attrs["complete"]:
        yield Finding("W-BRANCH", "response", str(data.attrs["message"]))


def _sweep_warnings(data: xr.Dataset) -> Iterator[Finding]:
    if lost := int((~data["settled"].values.astype(bool)).sum()):
        yield Finding("W-SETTLED", "sweep", f"{lost} motions do not repeat within sweep.most_periods")


def _describe_response(data: xr.Dataset) -> Block:
    rows = [
        ("largest amplitude [half backlashes]", f"{float(data['amplitude'].max()):.4f}"),
        ("limit points at ratio", _listed(data["ratio"].values[data["fold"].values])),
        ("drive flanks begin to part at", _listed(data["drive_border"].values)),
        ("back flanks begin to touch at", _listed(data["back_border"].values)),
    ]
    points = f"{data.sizes['point']} points, {int(data['stable'].sum())} stable; {data.attrs['message']}"
    return Block("Response", ("", "ratio"), tuple(rows), (points,))


def _listed(values) -> str:
    return ", ".join(f"{value:.4f}" for value in np.sort(values)) or "none"


def _describe_sweep(data: xr.Dataset) -> Block:
    rows = [
        (str(direction), STATE_NAMES[number], f"{min(ends):.3f}", f"{max(ends):.3f}")
        for direction, states in zip(data["direction"].values, data["state"].values)
        for number, *ends in state_regions(data["ratio"].values, [STATE_NAMES.index(state) for state in states])
    ]
    return Block("Sweep", ("sweep", "contact state", "from ratio", "to ratio"), tuple(rows))


def _describe_chaos(data: xr.Dataset) -> Block:
    words = [str(value_there) for value_there in data["chaotic"].values]
    chaotic = data["ratio"].values[[word == "yes" for word in words]]
    ends = [f"{ratio:.4g}" for ratio in chaotic[[0, -1]]] if len(chaotic) else ["none", "none"]
    counts, lowest = [len(words), len(chaotic), words.count("not told")], float(data["lowest"].min())
    row = str(counts[0]), str(counts[1]), *ends, str(counts[2]), f"{lowest:.3f}"
    header = ("ratios", "chaotic", "from", "to", "not told", "smallest deflection [half backlashes]")
    notes = ("chaotic: exponent clearly positive, bounded, no repetition",)
    return Block("Chaos", header, (row,), notes)


def _no_response(case: GearPairCase) -> str:
    eccentric = any(case.gears.eccentricity)
    return "the shafts of eccentric gears add base frequencies; take sweep" if eccentric else ""


GEAR_PAIR = Train(
    name="gear_pair",
    words="a gear pair",
    stages=(
        Stage(
            name="response",
            title="Response",
            solve=solve_impact_response,
            verdict=lambda result: {"points": len(result.lowest), "message": result.branch.message},
            describe=lambda results: _describe_response(results.response),
            unavailable=_no_response,
            warnings=ImpactResponseResult.warnings,
        ),
        Stage(
            name="sweep",
            title="Sweep",
            solve=solve_sweep,
            verdict=lambda result: {"settled": int(result.up.settled.sum() + result.down.settled.sum())},
            describe=lambda results: _describe_sweep(results.sweep),
            unavailable=lambda case: "" if case.sweep else "the case has no section sweep",
            warnings=SweepResult.warnings,
        ),
        Stage(
            name="chaos",
            title="Chaos",
            solve=solve_chaos,
            options=("progress",),
            verdict=lambda result: {"ratios": len(result.ratio)},
            describe=lambda results: _describe_chaos(results.chaos),
            unavailable=lambda case: "" if case.chaos else "the case has no section chaos",
        ),
    ),
    describe=_describe_case,
    warnings=_case_warnings,
    judgements=impact_judgements,
    duty=impact_duty,
    front=(("amplitude_and_mean", 0), ("contact_states", 0)),
    figures=FiguresOf("femgear.trains.impacts.figures:FIGURES"),
)
