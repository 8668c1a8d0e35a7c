"""Public test rigs with planetary sets: their cases, what their recordings should hold, and whether one does.

No recording is shipped: licences and sizes are those of their owners, whose pages have the files. Checksums of them are
not known here. What a rig should show was written down before any recording was looked at.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from femgear.errors import CaseError
from femgear.findings import percent
from femgear.measured.heard_set import HeardSet, heard_set
from femgear.measured.lines import order_tolerance, sharpened_lines
from femgear.measured.recordings import read_by_turns
from femgear.measured.spectra import windowed_spectrum
from femgear.measured.wrong_turns import lines_near_mesh
from femgear.report.tables import Block
from femgear.trains.drafts import ToothForm, new_case
from femgear.trains.reading import parse_case

if TYPE_CHECKING:
    from femgear.housing.orders import OrderSpectrum
    from femgear.measured.requests import Recording

_THRESHOLD = -20.0
"""Level over the largest line of the bands from which on lines count [dB]."""
_LINES_FROM = -30.0
"""Level over the largest of all lines from which on they tell whether the recording is one of the rig [dB]."""
_BESIDE, _APART = 6, 0.05
"""Carrier orders on either side of a mesh harmonic, and distance of orders that count as one."""
_HARMONICS = 3
_LEAST_WHOLE = 0.25
"""Share of lines at whole orders below which the speed is another one: errors of pins and carrier make no others."""
_IN_PHASE_SHARE = 0.5
"""Largest height of the line at the mesh order over the largest, of planets in phase."""


@dataclass(frozen=True)
class Rig:
    """A public rig.

    Parameters
    ----------
    name, owner : str
        Of the rig, and who publishes its recordings.
    teeth : (sun, planet, ring)
        All gears spur.
    planets : int
        Equally spaced.
    module, speed : str
        With units, the speed that of the sun for which lines are predicted. Where no module is published it is assumed.
    module_known : bool
        Whether the module is published.
    recorded : str
        What is published of the recordings.
    predicted : mapping of int to float
        Carrier orders around the first mesh harmonic and heights over the largest, by the case with estimated supports.
    checksums : mapping of str to str
        SHA-256 of published files by their names; none is known.
    """

    name: str
    owner: str
    teeth: tuple[int, int, int]
    planets: int
    module: str
    speed: str
    module_known: bool
    recorded: str
    predicted: Mapping[int, float]
    checksums: Mapping[str, str] = field(default_factory=dict)

    @property
    def in_phase(self) -> bool:
        """Whether all planets mesh in phase."""
        return self.teeth[2] % self.planets == 0

    @property
    def source(self) -> str:
        """Text of the case file: what is not published is estimated, and says so."""
        numbers: dict[str, Any] = {"teeth": self.teeth, "module": self.module, "speed": self.speed}
        return new_case("planetary", **numbers, planets=self.planets, torque=None, face_width=None, form=ToothForm())

    def case(self) -> Any:
        """Read the case."""
        return parse_case(self.source, name=f"{self.name}.toml")


SDUST = Rig(
    "sdust",
    "Shandong University of Science and Technology",
    (18, 27, 72),
    3,
    "2 mm",
    "1500 rpm",
    True,
    "triaxial acceleration at 25.6 kHz, 1000 to 2500 rpm of the sun",
    {66: 0.075, 69: 0.84, 72: 0.054, 75: 1.0, 78: 0.105},
)
PRETORIA = Rig(
    "pretoria",
    "University of Pretoria",
    (13, 24, 62),
    3,
    "2 mm",
    "600 rpm",
    False,
    "acceleration, and one pulse in a turn of the carrier",
    {57: 0.04, 60: 0.77, 62: 0.0, 63: 1.0, 66: 0.12},
)
BJUT = Rig(
    "bjut",
    "Beijing University of Technology, wind turbine planetary gearbox",
    (28, 36, 100),
    4,
    "1 mm",
    "1800 rpm",
    False,
    "acceleration on the housing",
    {96: 0.85, 100: 0.10, 104: 1.0},
)
GRC = Rig(
    "grc",
    "National Renewable Energy Laboratory, Gearbox Reliability Collaborative",
    (21, 39, 99),
    3,
    "10 mm",
    "126 rpm",
    False,
    "acceleration on the housing; its teeth are helical, here they are spur",
    {93: 0.11, 96: 0.88, 99: 0.053, 102: 1.0},
)
SNU = Rig(
    "snu",
    "Seoul National University",
    (31, 31, 95),
    3,
    "2 mm",
    "900 rpm",
    False,
    "acceleration on the housing",
    {90: 0.10, 93: 0.93, 95: 0.0, 96: 1.0, 99: 0.27},
)
RIGS = {rig.name: rig for rig in (SDUST, PRETORIA, BJUT, GRC, SNU)}
"""All rigs by their names."""


@dataclass(frozen=True)
class RigCheck:
    """Whether a recording of a healthy rig holds what it should.

    Parameters
    ----------
    share : float
        Of the lines near mesh harmonics, those at multiples of the number of planets.
    lines : int
        Lines that were counted.
    at_mesh_order : float
        Line at the mesh order over the largest one around it.
    largest : (int, int)
        Whole orders of the two largest lines around the first mesh harmonic.
    whole : float
        Of the lines near mesh harmonics, those at whole orders.
    """

    share: float
    lines: int
    at_mesh_order: float
    largest: tuple[int, ...]
    whole: float

    def passed(self, rig: Rig) -> tuple[bool | None, bool | None]:
        """Tell whether the places of the lines, and their heights around the mesh order, are those of a rig.

        None where there is no line to compare.
        """
        places = self.share == 1.0 if self.lines else None
        if not self.largest:
            return places, None
        if rig.in_phase:
            heights = self.at_mesh_order < _IN_PHASE_SHARE
        else:
            heights = set(self.largest) == set(sorted(rig.predicted, key=lambda order: -rig.predicted[order])[:2])
        return places, heights


def find_rig(name: str) -> Rig:
    """Find a rig by its name (CaseError, E-CHOICE)."""
    if name.lower() not in RIGS:
        raise CaseError("there is no such rig", code="E-CHOICE", key="name", value=name, limit=", ".join(RIGS))
    return RIGS[name.lower()]


def check_rig(rig: Rig, spectrum: OrderSpectrum) -> RigCheck:
    """Compare the order spectrum of a healthy recording with what a rig should show.

    Lines above -20 dB of the largest within six orders of a mesh harmonic lie at multiples of the number of planets,
    within 0.05 orders. In phase the line at the mesh order stays below half the largest around it; out of phase the two
    predicted neighbours are the largest.
    """
    ring = rig.teeth[2]
    order, height = sharpened_lines(spectrum, 3 * _THRESHOLD)
    harmonic = np.clip(np.rint(order / ring), 1, _HARMONICS)
    near = np.abs(order - harmonic * ring) <= _BESIDE + _APART
    order, height = order[near], height[near]
    counted = height >= 10 ** (_THRESHOLD / 20) * height.max(initial=0.0)
    places = order[counted]
    at_multiples = np.abs(places - rig.planets * np.rint(places / rig.planets)) <= _APART
    first = np.abs(order - ring) <= _BESIDE + _APART
    order, height = order[first], height[first]
    at_mesh = height[np.abs(order - ring) <= _APART].max(initial=0.0) / height.max(initial=1e-300)
    largest = tuple(round(at) for at in order[np.argsort(-height, kind="stable")[:2]].tolist())
    share = float(at_multiples.mean()) if len(places) else 0.0
    whole = float((np.abs(places - np.rint(places)) <= _APART).mean()) if len(places) else 0.0
    return RigCheck(share, len(places), float(at_mesh), largest, whole)


def describe_rig(rig: Rig) -> Block:
    """Tabulate what is known of a rig, and what its healthy recordings should show."""
    rows = (
        ("owner", rig.owner),
        ("teeth of sun, planets, ring", "/".join(map(str, rig.teeth))),
        ("planets", f"{rig.planets}, {'in phase' if rig.in_phase else 'out of phase'}"),
        ("module", rig.module + ("" if rig.module_known else ", assumed")),
        ("recordings", rig.recorded),
        ("checksums", ", ".join(rig.checksums) or "none known"),
        ("predicted for", f"{rig.speed} of the sun, supports estimated"),
        *((f"order {order}", f"{height:g} of the largest") for order, height in rig.predicted.items()),
    )
    return Block(rig.name, rows=rows)


def judge_rig(rig: Rig, path: str | os.PathLike, recording: Recording) -> Block:
    """Tabulate whether a recording of a healthy rig holds what it should, by the rule of `check_rig`.

    CaseError: a recording that cannot be used, or one that ends below the mesh order (E-FILE, E-SPEED, E-RANGE); one
    that cannot be judged, as no line stands out near a mesh harmonic, or lines have nothing to do with the rig at this
    speed (E-FILE).
    """
    gear_set = heard_set(rig.case())
    spectrum = windowed_spectrum(read_by_turns(path, recording, gear_set))
    if spectrum.order[-1] < rig.teeth[2] + _BESIDE:
        raise CaseError(
            "the recording ends below the mesh order",
            code="E-RANGE",
            file=os.fsdecode(path),
            value=f"order {spectrum.order[-1]:.4g}",
            limit=f"order {rig.teeth[2] + _BESIDE}",
            remedy="sample it faster, or record at a lower speed",
        )
    _need_lines_of_rig(gear_set, spectrum, os.fsdecode(path))
    check = check_rig(rig, spectrum)
    if not check.lines:
        _refuse_to_judge("no line stands out near a mesh harmonic", os.fsdecode(path))
    if check.whole < _LEAST_WHOLE:
        words = (
            f"of the lines near mesh harmonics {percent(check.whole)} lie at whole orders, at the speed that is taken"
        )
        _refuse_to_judge(words, os.fsdecode(path))
    title = f"{rig.name}: {os.path.basename(os.fsdecode(path))}"
    return Block(title, ("", "found", "allowed", ""), tuple(_rows(rig, check)))


def _need_lines_of_rig(gear_set: HeardSet, spectrum: OrderSpectrum, file: str) -> None:
    """Refuse a spectrum whose lines are none of the set at the speed that is taken (CaseError, E-FILE)."""
    order, height = sharpened_lines(spectrum, _LINES_FROM)
    if not len(order):
        _refuse_to_judge("no line stands out of the noise", file)
    tolerance = order_tolerance(spectrum.turns)
    mesh = lines_near_mesh(gear_set, order, height, tolerance, float(spectrum.order[-1]))
    if mesh.factor != 1.0:
        words = f"lines lie at orders of the rig if the carrier made {mesh.factor:.4g} times as many turns"
        _refuse_to_judge(words, file)
    if not mesh.fits:
        _refuse_to_judge("lines lie as they would without this rig, at the speed that is taken", file)


def _refuse_to_judge(words: str, file: str) -> NoReturn:
    """Refuse a recording by which nothing can be said of a rig (CaseError, E-FILE)."""
    raise CaseError(
        f"the recording cannot be judged: {words}",
        code="E-FILE",
        file=file,
        limit="lines of the rig, 14 dB out of the noise around them",
        remedy="check the speed, --pulses-of and --per-turn, the channel and that the recording is one of this rig",
    )


_WORDS = {True: "passed", False: "not passed", None: "no line to compare"}


def _rows(rig: Rig, check: RigCheck) -> Iterator[tuple[str, ...]]:
    """Rows of the rule: what was found, what is allowed, whether it passed."""
    words = [_WORDS[verdict] for verdict in check.passed(rig)]
    at_multiples = f"{percent(check.share)} of {check.lines}"
    yield f"lines at multiples of {rig.planets}", at_multiples, "100 %", words[0]
    if rig.in_phase:
        limit = f"below {_IN_PHASE_SHARE:g} of the largest"
        yield f"line at the mesh order {rig.teeth[2]}", f"{check.at_mesh_order:.3g}", limit, words[1]
    else:
        strongest = sorted(sorted(rig.predicted, key=lambda order: -rig.predicted[order])[:2])
        largest = " and ".join(map(str, sorted(check.largest))) or "none"
        yield "largest lines at orders", largest, " and ".join(map(str, strongest)), words[1]
