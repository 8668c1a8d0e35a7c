"""What can be minimised or limited: numbers that follow from a case, each from as few stages as it needs.

`femgear.trains.live.Answer` holds the stages of one case, `StudyQuantity` takes a number from them, and
`named_quantity` finds it by the words of a command line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from femgear.case.checks import LEAST_TORQUE
from femgear.case.dependencies import response_entries
from femgear.case.gear_set import need_set, planetary_set
from femgear.case.messages import no_such
from femgear.case.planetary import Case
from femgear.case.quantities import ACCELERATION, FREQUENCY, SPEED, TORQUE, Dimension, to_si
from femgear.case.sections import LARGEST_TORQUE
from femgear.errors import CaseError
from femgear.findings import NOTE, Finding
from femgear.gears.gear import tooth_thickness
from femgear.moved import former_names
from femgear.remembered import remembered
from femgear.stages.key_figures import MICROMETRES, NUMBER, STRESS, KeyFigure, figure_of
from femgear.stages.static_results import LARGE
from femgear.stages.tooth_figures import TOOTH_FIGURES, missing_entry
from femgear.system.fourier import sample
from femgear.trains.elastic import stages as elastic_stages
from femgear.trains.elastic.checks import case_warnings, response_findings
from femgear.trains.live import Answer
from femgear.trains.reading import with_values
from femgear.trains.registry import train_of

if TYPE_CHECKING:
    from femgear.stages.protocol import StageResult
    from femgear.system.system import Response

Mesh = Literal["largest", "overall", "sun-planet", "planet-ring"]
_MeshKind = Literal["sun-planet", "planet-ring"]
_GearName = Literal["sun", "planet", "ring"]
Range = tuple[float, float, int]
"""First and last input speed [rad/s] and number of speeds."""
Speeds = tuple[str, str]
"""First and last speed of the input, with their units."""
_SPEEDS = 51
"""Of a range, by default."""
_FORCE = Dimension("a force", "N", "N", 1.0)
STAGES = ("gears", "static", "deflection", "stress", "life", "losses", "heat", "modes", "dynamics", "runup", "housing")
"""In the order of their effort."""


def under_torque(answer: Answer, torque: float | None) -> Answer:
    """Give the answer under a torque on the input [N m], by default that of the case."""
    if torque is None:
        return answer
    operation = answer.case.operation.model_copy(update={"torque": torque})
    return answer.of(answer.case.model_copy(update={"operation": operation}))


def response_at(answer: Answer, speeds: Range) -> Response:
    """Compute the periodic response at a range of speeds [rad/s], without verdict on its stability."""
    there = answer.of(at_speeds(answer.case, speeds))
    entries = response_entries(there.case)
    return answer.steps.kept("response", entries) or answer.steps.keep(
        "response", entries, elastic_stages.solve_response(there.case, there.modes)
    )


def at_speeds(case: Case, speeds: Range) -> Case:
    """Set equidistant speeds of the input [rad/s] in a case, its published lines left out.

    CaseError: a planar or helical case, which has no elastic ring (E-STAGE).
    """
    need_elastic_ring(case, "mesh forces over speed and housing levels need")
    first, last, count = speeds
    low, high = (f"{value / SPEED.scale:.12g} rpm" for value in (first, last))
    there = {"from": low, "to": high, "count": count}
    return with_values(case, {"housing.published": None, "operation.speeds": there})


def need_elastic_ring(case: Case, subject: str) -> None:
    """Refuse a planar or helical case (E-STAGE); the subject with its verb begins the message."""
    other = [name for name in ("planar", "helical") if getattr(case, name, None) is not None]
    if other:
        raise CaseError(
            f"{subject} a case with an elastic ring",
            code="E-STAGE",
            key=other[0],
            limit="transmission error, contact ratio, tip thickness, contact pressure, root stress",
        )


def _no_findings(answer: Answer) -> Iterable[Finding]:
    return ()


def _of_static(codes: tuple[str, ...], torque: float | None, answer: Answer) -> Iterator[Finding]:
    """Findings of some codes of the static solution."""
    return (finding for finding in under_torque(answer, torque).static.findings if finding.code in codes)


def _of_stresses(answer: Answer) -> Iterator[Finding]:
    """Findings of stresses at kinks."""
    return (finding for finding in (*answer.static.findings, *answer.stress.findings) if finding.code == "W-KINK")


def _of_response(at: Range, answer: Answer) -> Iterator[Finding]:
    """Findings of the response over speeds, and of its damping."""
    there = answer.of(at_speeds(answer.case, at))
    yield from (warning for warning in case_warnings(there.case) if warning.code == "W-DAMPING")
    yield from elastic_stages.findings_of_response(there.case, there.modes, response_at(answer, at))


def _of_level(at: Range, answer: Answer) -> Iterator[Finding]:
    """Findings of the level of the housing over speeds, and of its damping."""
    there = answer.of(at_speeds(answer.case, at))
    yield from (warning for warning in case_warnings(there.case) if warning.code == "W-DAMPING")
    dynamics = there.dynamics
    limits = dynamics.level_change, dynamics.excitation_limit, dynamics.compared_to
    yield from response_findings(there.case, dynamics.response, *limits)


@dataclass(frozen=True)
class StudyQuantity:
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
        ``(Answer) -> float`` in SI units.
    signal : callable, optional
        Of a transmission error [m] ``(sun_arc, deflection, N) -> (K, P) array``: its largest peak to peak.
    torque : float, optional
        Of a transmission error: on the input [N m]; None means that of the case.
    findings : callable
        ``(Answer) -> findings`` that concern the number.
    """

    name: str
    dimension: Dimension
    stage: str
    compute: Callable[[Answer], float]
    signal: Callable | None = None
    torque: float | None = None
    findings: Callable[[Answer], Iterable[Finding]] = _no_findings

    def __post_init__(self):
        _chosen(self.stage, {name: name for name in STAGES}, "stage")

    def doubts(self, answer: Answer) -> list[str]:
        """Codes of the doubts and faults that concern the number, each once."""
        return list(dict.fromkeys(finding.code for finding in self.findings(answer) if finding.severity != NOTE))

    def show(self, value: float) -> str:
        """Write an SI value in the unit of tables."""
        number = f"{value / self.dimension.scale:.5g}"
        return number if self.dimension is NUMBER else f"{number} {self.dimension.shown}"


def transmission_error(mesh: Mesh = "largest", *, torque: str | None = None) -> StudyQuantity:
    """Define the static transmission error, peak to peak over the record [m].

    "overall" goes from sun to ring along the base circle of the sun and may vanish while the errors of the
    meshes cancel one another; "sun-planet" and "planet-ring" are the largest of their kind, "largest" is that
    of all these. The torque is that of the input, with its unit; that of the case when left out.

    CaseError: no such mesh (E-OBJECTIVE), no torque (E-TORQUE).
    """
    signal = partial(_signal, _chosen(mesh, {name: name for name in get_args(Mesh)}, "mesh"))
    value = None if torque is None else to_si(torque, TORQUE, low=-LARGEST_TORQUE, high=LARGEST_TORQUE)
    if value is not None and abs(value) < LEAST_TORQUE:
        raise CaseError(
            "without torque no tooth bends",
            code="E-TORQUE",
            key="torque",
            value=torque,
            limit=f"{LEAST_TORQUE:g} N m or more of either sign",
        )
    compute = partial(_peak_to_peak, signal, value)
    where = "" if value is None else f" at {TORQUE.show(value)}"
    findings = partial(_of_static, (*LARGE, "W-POSITIONS"), value)
    name = f"STE peak to peak, {mesh}{where}"
    return StudyQuantity(name, MICROMETRES, "static", compute, signal, value, findings)


def _signal(mesh: Mesh, arc: np.ndarray, deflection: np.ndarray, n: int) -> np.ndarray:
    """Rows of the transmission error (K, P) [m] of one kind of mesh, the overall one, or all of them."""
    arc = np.reshape(arc, (1, -1))
    kinds = {"sun-planet": deflection[:n], "planet-ring": deflection[n:], "overall": arc}
    return np.vstack([arc, deflection]) if mesh == "largest" else kinds[mesh]


def _peak_to_peak(signal: Callable, torque: float | None, answer: Answer) -> float:
    cycle = under_torque(answer, torque).static.cycle
    arc, meshes = (cycle.extremes(name) for name in ("sun_arc", "deflection"))
    low, high = (signal(arc[i], meshes[i][:, None], len(meshes[i]) // 2) for i in (0, 1))
    return float((high - low).max())


def mesh_force(
    first: str, last: str, *, speeds: int = 51, part: Literal["dynamic", "peak"] = "dynamic"
) -> StudyQuantity:
    """Define the largest mesh force over equidistant input speeds, of all times and meshes [N].

    Part "dynamic" is the largest deviation from the mean force of a mesh, which follows from the torque
    whatever the flanks look like; "peak" is the largest force. ``first`` and ``last`` speed have their unit, as in
    ``"1000 rpm"``; ``speeds`` is their number.

    CaseError: no such ``part``, or not a range of speeds (E-OBJECTIVE).
    """
    at = _range(first, last, speeds)
    of_mean = _chosen(part, {"dynamic": True, "peak": False}, "part")
    name, compute = f"{part} mesh force, {_words(at)}", partial(_largest_force, at, of_mean)
    return StudyQuantity(name, _FORCE, "dynamics", compute, findings=partial(_of_response, at))


def _largest_force(at: Range, dynamic: bool, answer: Answer) -> float:
    return float(forces_over_time(response_at(answer, at).force, dynamic=dynamic).max())


def forces_over_time(force: np.ndarray, *, dynamic: bool) -> np.ndarray:
    """Find the largest force, or deviation from its mean, of every speed and mesh (speeds, meshes) [N].

    Of the harmonics ``force`` (speeds, meshes, H + 1), ``F(t) = Re sum_h F_h exp(i h omega t)``, from sixteen
    samples a period of the highest one: within 2 % of its amplitude.
    """
    history = sample(force, 16 * force.shape[-1])
    if not dynamic:
        return history.max(axis=-1)
    return np.abs(history - np.real(force[..., :1])).max(axis=-1)


def housing_level(first: str, last: str, *, speeds: int = 51) -> StudyQuantity:
    """Define the largest amplitude of any carrier order at the fixed sensor over speeds [m/s^2].

    Speeds are as for `mesh_force`, lines the exact ones of the radial acceleration, see
    `femgear.housing.sensor.component_lines`.
    """
    at = _range(first, last, speeds)
    name, compute = f"largest carrier order, {_words(at)}", partial(_largest_level, at)
    return StudyQuantity(name, ACCELERATION, "housing", compute, findings=partial(_of_level, at))


def _largest_level(at: Range, answer: Answer) -> float:
    there = answer.of(at_speeds(answer.case, at))
    return float(np.abs(there.housing.exact.acceleration).max())


def natural_frequency(mode: int) -> StudyQuantity:
    """Define a natural frequency of the set [Hz] by its number from 1, as tables have it.

    Modes are counted by frequency in every case: two that meet over a sweep exchange their numbers.

    CaseError: not a number from 1 to 1000 (E-OBJECTIVE); when it is computed, fewer modes (E-MODES).
    """
    if not (isinstance(mode, int) and 1 <= mode <= 1000):
        raise CaseError("no mode", code="E-OBJECTIVE", key="mode", value=mode, limit="1 to 1000")
    return StudyQuantity(f"natural frequency {mode}", FREQUENCY, "modes", partial(_frequency, mode))


def _frequency(mode: int, answer: Answer) -> float:
    frequencies = answer.modes.modes.frequency
    if mode > len(frequencies):
        raise CaseError(
            f"the modal basis ends before this mode, with number {len(frequencies)} at {frequencies[-1]:.5g} Hz",
            code="E-MODES",
            key="mode",
            value=mode,
            limit=f"1 to {len(frequencies)}",
        )
    return float(frequencies[mode - 1])


def contact_ratio(mesh: _MeshKind) -> StudyQuantity:
    """Define the transverse contact ratio [1] of a ``mesh``, "sun-planet" or "planet-ring", from the tip circles.

    CaseError: no such mesh (E-OBJECTIVE).
    """
    names = {"sun-planet": "contact_ratio_sun_planet", "planet-ring": "contact_ratio_planet_ring"}
    name = _chosen(mesh, names, "mesh")
    return StudyQuantity(f"contact ratio, {mesh}", NUMBER, "gears", partial(_of_gears, name))


def _of_gears(name: str, answer: Answer) -> float:
    return float(getattr(planetary_set(answer.case), name))


def tip_thickness(gear: _GearName) -> StudyQuantity:
    """Define the thickness of the teeth of a ``gear`` on its tip circle, over the module [1].

    CaseError: none of "sun", "planet" and "ring" (E-OBJECTIVE).
    """
    name = _chosen(gear, {g: g for g in get_args(_GearName)}, "gear")
    return StudyQuantity(f"tip thickness over module, {gear}", NUMBER, "gears", partial(_tip_thickness, name))


def _tip_thickness(name: str, answer: Answer) -> float:
    gear = getattr(planetary_set(answer.case), name)
    return float(tooth_thickness(gear, gear.tip_radius)) / gear.module


def contact_pressure() -> StudyQuantity:
    """Define the largest contact pressure away from the ends of the flanks [Pa]."""
    findings = partial(_of_static, ("W-PRESSURE", "W-EDGE", "W-KINK"), None)
    return StudyQuantity("contact pressure", STRESS, "static", _largest_pressure, findings=findings)


def _largest_pressure(answer: Answer) -> float:
    return float(answer.static.cycle.extremes("max_pressure")[1].max())


def root_stress(gear: _GearName) -> StudyQuantity:
    """Define the largest stress in the roots of a ``gear`` [Pa], of a planet in both its meshes.

    CaseError: none of "sun", "planet" and "ring" (E-OBJECTIVE).
    """
    places = {"sun": ((0, 0),), "planet": ((0, 1), (1, 0)), "ring": ((1, 1),)}
    wanted = _chosen(gear, places, "gear")
    compute = partial(_largest_stress, wanted)
    return StudyQuantity(f"root stress, {gear}", STRESS, "stress", compute, findings=_of_stresses)


def _largest_stress(wanted: tuple[tuple[int, int], ...], answer: Answer) -> float:
    n, largest = planetary_set(answer.case).n_planets, answer.stress.worst_roots()["root_worst"]
    return max(float(largest[k * n : (k + 1) * n, gear].max()) for k, gear in wanted)


def _chosen(value, table: dict, key: str):
    """Entry of a table, refused (E-OBJECTIVE) where there is none."""
    try:
        return table[value]
    except (KeyError, TypeError):
        raise CaseError(f"no such {key}", code="E-OBJECTIVE", key=key, value=value, limit=", ".join(table)) from None


def _range(first: str, last: str, count: int) -> Range:
    """Range of speeds from texts with units, refused (E-OBJECTIVE) where it is none."""
    try:
        low, high = to_si(first, SPEED), to_si(last, SPEED)
    except CaseError as error:
        error.key = "speeds"
        raise
    if not (0 < low < high and 2 <= count <= 10000):
        raise CaseError(
            "not a range of speeds",
            code="E-OBJECTIVE",
            key="speeds",
            value=f"{count} from {first} to {last}",
            limit="2 to 10000 speeds, from over 0 upwards",
            remedy='give the lower speed first, as in "1000 rpm" and "3500 rpm"',
        )
    return low, high, int(count)


def _words(at: Range) -> str:
    """A range of speeds in the name of a quantity."""
    return f"{at[0] / SPEED.scale:.6g} to {SPEED.show(at[1])} ({at[2]} speeds)"


def quantity_of_figure(figure: KeyFigure) -> StudyQuantity:
    """Define the quantity that a key figure of a train is."""
    findings = partial(_of_figure, figure)
    return StudyQuantity(figure.name, figure.dimension, figure.stage, partial(_figure, figure), findings=findings)


_WORDS: dict[str, Callable[..., StudyQuantity]] = {
    "ste": transmission_error,
    **{f"ste {mesh}": partial(transmission_error, mesh) for mesh in get_args(Mesh)[1:]},
    "mesh force": mesh_force,
    "peak mesh force": partial(mesh_force, part="peak"),
    "housing": housing_level,
    **{f"contact ratio {mesh}": partial(contact_ratio, mesh) for mesh in get_args(_MeshKind)},
    **{f"tip thickness {gear}": partial(tip_thickness, gear) for gear in get_args(_GearName)},
    "contact pressure": contact_pressure,
    **{f"root stress {gear}": partial(root_stress, gear) for gear in get_args(_GearName)},
    **{figure.name: partial(quantity_of_figure, figure) for figure in TOOTH_FIGURES},
}
_OVER_SPEEDS = ("mesh force", "peak mesh force", "housing")
"""Quantities that take the first and the last speed."""
NAMES = tuple(_WORDS)


def _figure(figure: KeyFigure, answer: Answer) -> float:
    return figure.read(_contents(answer[figure.stage]))


def _of_figure(figure: KeyFigure, answer: Answer) -> Iterable[Finding]:
    """Findings of the stage of a key figure that concern it."""
    return figure.concerned(answer[figure.stage].findings)


@remembered(4)
def _contents(result: StageResult) -> Any:
    """Contents of the file of a result, which many figures are read from."""
    return result.contents()


def has_figures(case: Any) -> bool:
    """Tell whether the quantities of a case are the key figures of its train alone; those of sets are more."""
    return not isinstance(case, Case) and bool(train_of(case).key_figures(case))


def need_quantities(case: Any) -> None:
    """Refuse a case without a planetary set whose train has no key figures (E-MODEL)."""
    if not has_figures(case):
        need_set(case)


def with_run_up(case: Any, speeds: Speeds | None) -> Any:
    """Set first and last speed of the run-up in a case whose quantities are key figures; others stay as they are.

    At as many speeds as its [runup] has, 51 by default.
    """
    if speeds is None or not has_figures(case):
        return case
    values = {"runup.from": speeds[0], "runup.to": speeds[1], "runup.count": case.runup.count or _SPEEDS}
    return with_values(case, values)


def default_quantities(case: Any) -> tuple[str, ...]:
    """Name the quantities of a sweep that names none: transmission errors, or the figures of the whole."""
    if not has_figures(case):
        return "ste", "ste sun-planet", "ste planet-ring"
    figures = train_of(case).key_figures(case)
    stages = {stage.name: stage for stage in train_of(case).stages}
    return tuple(figure.name for figure in figures if figure.whole and not stages[figure.stage].unavailable(case))


def _figure_quantity(words: str, case: Any) -> StudyQuantity:
    """Find the quantity of a key figure of the train of a case, or a natural frequency."""
    figures = train_of(case).key_figures(case)
    if (figure := figure_of(figures, words)) is None:
        names = list(dict.fromkeys((*(figure.name for figure in figures), *(() if has_figures(case) else NAMES))))
        figure = figure_of(TOOTH_FIGURES, words) if hasattr(case, "gear_names") else None
        if figure is not None:
            entry = missing_entry(case, figure)
            message, remedy = f"{figure.name} needs {entry}", f"give {entry}"
            raise CaseError(message, code="E-STAGE", key="objective", value=words, remedy=remedy)
        what, limit = "take one of these names", ", ".join((*names, "natural frequency N"))
        error = no_such("quantity", "objective", words, names, what, limit=limit)
        error.code = "E-OBJECTIVE"
        raise error
    if why := next((stage.unavailable(case) for stage in train_of(case).stages if stage.name == figure.stage), ""):
        remedy = "give [runup] with from, to and count" if figure.stage == "runup" else None
        message = f"{figure.name} needs the stage {figure.stage}: {why}"
        raise CaseError(message, code="E-STAGE", key="objective", value=words, remedy=remedy)
    return quantity_of_figure(figure)


def named_quantity(words: str, *, speeds: Speeds | None = None, case: Any = None) -> StudyQuantity:
    """Find the quantity of some words: one of `NAMES`, or a key figure of the train of a case.

    Mesh forces and housing levels of planetary sets need the first and the last speed of the input, with units.

    CaseError: no such quantity, or no speeds for one that needs them (E-OBJECTIVE); a stage that the case has not
    (E-STAGE).
    """
    name = " ".join(words.split()).lower()
    if (mode := name.removeprefix("natural frequency ")) != name and mode.isdecimal():
        return natural_frequency(int(mode))
    if case is not None and (has_figures(case) or figure_of(TOOTH_FIGURES, words) is not None):
        return _figure_quantity(words, case)
    if name not in _WORDS:
        raise CaseError(
            "no such quantity",
            code="E-OBJECTIVE",
            key="objective",
            value=words,
            limit=", ".join((*NAMES, "natural frequency N")),
            remedy="take one of these names",
        )
    if name not in _OVER_SPEEDS:
        return _WORDS[name]()
    if speeds is None:
        remedy = 'give two speeds of the input, "1000 rpm" and "3500 rpm"'
        message = f"{name} is found over a range of speeds"
        raise CaseError(message, code="E-OBJECTIVE", key="speeds", remedy=remedy)
    return _WORDS[name](*speeds)


__getattr__ = former_names(__name__, {"Quantity": StudyQuantity})
