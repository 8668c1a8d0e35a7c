"""Findings: what is allowed, or was computed, but deserves a look; and the catalogue of their codes.

A refusal is an exception of `femgear.errors`. A finding ends nothing: it goes into the one list of a run,
which terminal, page, manifest, result files, ``femgear check`` and docs/errors.md read.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from typing import Any

from femgear.errors import printable

NOTE, DOUBT, FAULT = "note", "doubt", "fault"
SEVERITIES = (NOTE, DOUBT, FAULT)
"""From the least to the most severe: worth knowing; a number may be wrong; nothing real carries that."""

CATALOGUE = {
    "W-BACK": (NOTE, "Meshes carry on their back flanks."),
    "W-BACKLASH": (NOTE, "Contact loss is asked for where teeth have no back side, or there are no meshes."),
    "W-BALANCE": (DOUBT, "A harmonic balance did not converge."),
    "W-BEARING": (NOTE, "Bearings are missing, or one has a property that a stage does not take."),
    "W-BRANCH": (DOUBT, "The curve of a response breaks off."),
    "W-CHAOS": (DOUBT, "Neighbouring motions move apart: details of the record depend on the steps."),
    "W-CLEARANCE": (NOTE, "A tip comes close to the root of its mate."),
    "W-CLIPPING": (DOUBT, "Samples of a sound exceed its full scale."),
    "W-COMPILER": (NOTE, "A functional mock-up unit has no binary."),
    "W-CONTACT-POINTS": (DOUBT, "The mesh forces on both gears do not act on one line."),
    "W-CONTACT-RATIO": (NOTE, "The contact ratio is low."),
    "W-CONVERGENCE": (DOUBT, "A periodic solution did not converge."),
    "W-COUPLING": (NOTE, "The torque turns a coupling further than couplings go."),
    "W-CROSS": (DOUBT, "Stages change one another by more than a response stage by stage may leave out."),
    "W-DAMPING": (DOUBT, "Without damping resonances have no limit."),
    "W-DEFLECTION": (DOUBT, "Deflections are no longer small; in a gearbox a fault where ten times over the limit."),
    "W-EDGE": (DOUBT, "Contacts lie at the end of a flank, where the pressure has no limit."),
    "W-ENDS": (DOUBT, "Free ends of the teeth make meshes softer than the model has them."),
    "W-ESTIMATED": (NOTE, "Values that were left out are estimated."),
    "W-EXCITATION": (
        DOUBT,
        "The excitation ends below what levels need, or nothing excites.",
    ),
    "W-FACE-LOAD": (DOUBT, "Slices are too wide for the load distribution over the face width."),
    "W-FAULT": (DOUBT, "A fault of a tooth has effects that the model leaves out, or none that shows."),
    "W-FILLET": (NOTE, "A tip runs into the root fillet of its mate by a little."),
    "W-FORMER": (NOTE, "A file of a former model is read as one of today."),
    "W-FOUNDATION": (
        DOUBT,
        "A model for other programs has the ring on its foundation, not on supports or in a casing.",
    ),
    "W-FREE": (DOUBT, "More modes have no stiffness than a gearbox has ways to turn."),
    "W-FRICTION": (DOUBT, "Friction acts at all speeds with the coefficient of one of them."),
    "W-GROWTH": (DOUBT, "The free motion grows: a parametric resonance."),
    "W-HEAT": (DOUBT, "Teeth are hotter, or their oil film thinner, than the oil is good for."),
    "W-HELIX": (DOUBT, "The helix angle lies outside what is validated."),
    "W-JOURNAL": (NOTE, "Lines of a journal were damaged and are left out."),
    "W-KINK": (DOUBT, "A stress stands at a kink, or at an end of what was searched."),
    "W-LIFE": (FAULT, "Teeth or bearings fail before the life that the case asks for."),
    "W-LIFTED": (NOTE, "Parts of the face width never carry."),
    "W-LOAD": (NOTE, "Without load nothing keeps the flanks on one side."),
    "W-LOSSES": (NOTE, "Losses of a part are left out, or rest on a simpler model."),
    "W-MATERIAL": (DOUBT, "Safeties and lives rest on an estimated treatment of the gears."),
    "W-MOTION": (DOUBT, "A member moves far enough to change contact points and arms."),
    "W-NEIGHBOURS": (NOTE, "Neighbouring planets come close to one another."),
    "W-OIL": (DOUBT, "The viscosity of the oil is extrapolated beyond the temperatures at which its law holds."),
    "W-ONE-WAY": (NOTE, "Supports or a casing change the level that load factors are computed without."),
    "W-OPEN": (NOTE, "A planet carries nothing at some positions."),
    "W-OVERLAP": (DOUBT, "Shafts and gears take up the same space."),
    "W-PARTED": (NOTE, "Teeth never touch."),
    "W-PLANETS": (NOTE, "Planets are not equally spaced, or their number is unusual."),
    "W-PLAY": (DOUBT, "Bearings that carry nothing hold nothing: shafts float in their play."),
    "W-PLUGIN": (NOTE, "A package has a train of a name that is taken."),
    "W-POINTS": (DOUBT, "Points on the ring do not resolve its waves."),
    "W-POSITIONS": (DOUBT, "Peaks between positions may be higher."),
    "W-PASSES": (DOUBT, "Shafts and teeth have not settled within the passes that are allowed."),
    "W-PRESSURE": (FAULT, "The contact pressure exceeds what any steel carries."),
    "W-PROFILE": (NOTE, "A profile has proportions that are unusual."),
    "W-PULL": (DOUBT, "Meshes pull where real teeth would part."),
    "W-RATE": (DOUBT, "Steps or samples are too coarse for the frequencies."),
    "W-RECORD": (NOTE, "A record ends below a frequency that matters."),
    "W-RELIEF-SIGN": (NOTE, "A modification adds material."),
    "W-RESIDUAL": (DOUBT, "Static compliance beyond the modes of a casing is missing."),
    "W-REVERSAL": (NOTE, "Load cases of both directions bend roots both ways, which lowers their strength."),
    "W-RIGID": (DOUBT, "A response holds bodies rigid that the modes have elastic."),
    "W-RIM": (NOTE, "A rim is thin; of rated gears a doubt where the rim factor of ISO 6336-3 does not hold."),
    "W-REXS": (DOUBT, "A REXS file holds what the case that was made of it has not, or has otherwise."),
    "W-ROWS": (NOTE, "Tables that no sheet can hold are left out."),
    "W-SEPARATION": (NOTE, "Flanks part at speeds of operation."),
    "W-SETTLED": (DOUBT, "Motions do not repeat within the periods that are allowed."),
    "W-SIZE": (NOTE, "The computation takes long, or fills much memory."),
    "W-SLICES": (NOTE, "Slices make the dynamics slow."),
    "W-SMOOTHING": (DOUBT, "The smoothing of contact changes the result."),
    "W-SPECTRUM": (NOTE, "The stage spectrum refuses this case."),
    "W-SPEED": (NOTE, "Torques change the speed within the record."),
    "W-STANDING": (DOUBT, "Planets of a carrier that turns vibrate where they stand: lines have no side bands."),
    "W-STEPS": (DOUBT, "Peaks of resonances are too narrow for the speeds of a run-up."),
    "W-STIFFNESS": (DOUBT, "Results rest on estimated stiffnesses, of bearings or of meshes."),
    "W-STRENGTH": (FAULT, "A tooth fails at once: a stress exceeds its static strength."),
    "W-SWEEP": (NOTE, "A sweep takes long."),
    "W-TAIL": (DOUBT, "The highest harmonics of a response are not small."),
    "W-TEETH": (
        NOTE,
        "Teeth do not suit their radii, shifted planets have no centre distance, or planets do not assemble.",
    ),
    "W-THRUST": (DOUBT, "Axial forces tilt the planets, which the model holds upright."),
    "W-TIP": (NOTE, "Tips are shorter than those of the basic rack."),
    "W-TIP-THIN": (NOTE, "The tooth is thin at its tip."),
    "W-TORQUE": (NOTE, "The torque has an unusual sign or size."),
    "W-UNDERCUT": (NOTE, "The tool cuts into the flank at the root."),
    "W-UNSTABLE": (DOUBT, "A periodic solution is unstable: a real machine leaves it."),
    "W-UNSTEADY": (DOUBT, "The speed of a recording is another one than is said, or changes: lines are smeared."),
    "W-UNUSED": (NOTE, "An entry of the case has no effect."),
    "W-WEDGED": (NOTE, "Meshes are loaded on both flanks at once."),
    "W-WEDGING": (NOTE, "Teeth have so little play that they may wedge."),
    "W-WIDTHS": (NOTE, "Gears are wider than their mates; in a gearbox a doubt where they face each other in part."),
}
"""Severity and meaning of every code, in one sentence; the text of a finding says the numbers."""


@dataclass(frozen=True)
class Finding:
    """Something that is allowed but deserves a look; ``str(finding)`` is the sentence that the user reads.

    Parameters
    ----------
    code : str
        Stable identifier out of `CATALOGUE`; empty for a remark.
    key : str
        Dotted path of the entry of the case file that draws it, or empty.
    text : str
        What is worth a look, with the numbers.
    remedy : str, optional
        What to do about it.
    severity : str, optional
        One of `SEVERITIES`; empty takes that of the catalogue, for a remark ``"note"``.
    limit : str, optional
        What is usual: within it there would be no finding.
    concerns : str, optional
        Gear, flank or kind of mesh whose numbers it is about, where these are not all that its code is about.
    stage : str, optional
        Stage of a run whose results draw it, empty of the case. Findings that differ in it alone are equal.

    Raises
    ------
    KeyError
        The catalogue has no such code.
    ValueError
        There is no such severity.
    """

    code: str
    key: str
    text: str
    _: KW_ONLY
    remedy: str = ""
    severity: str = ""
    limit: str = ""
    concerns: str = ""
    stage: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        usual = CATALOGUE[self.code][0] if self.code else NOTE
        object.__setattr__(self, "severity", self.severity or usual)
        if self.severity not in SEVERITIES:
            raise ValueError(f"{self.severity!r} is no severity: {', '.join(SEVERITIES)}")

    def __str__(self) -> str:
        head = f"[{self.code}] " if self.code else ""
        where = f"{self.key}: " if self.key else ""
        usual = f" (usual: {self.limit})" if self.limit else ""
        return printable(f"{head}{where}{self.text}{'; ' if self.remedy else ''}{self.remedy}{usual}")


def remark(text: str) -> Finding:
    """Make a finding without code and entry: what was read in a way that deserves to be said."""
    return Finding("", "", text)


def once(findings: Iterable[Finding], stage: str = "") -> tuple[Finding, ...]:
    """List findings of a stage, each once and in their order; without a stage they keep theirs."""
    copies = from_data(as_data(findings))  # of whatever class
    return tuple(dict.fromkeys(replace(finding, stage=stage) if stage else finding for finding in copies))


def by_severity(findings: Iterable[Finding]) -> list[Finding]:
    """Sort findings from the most to the least severe, those of one severity in their order."""
    return sorted(findings, key=lambda finding: -SEVERITIES.index(finding.severity))


def as_data(findings: Iterable[Finding]) -> list[dict[str, str]]:
    """Turn findings into tables of texts, as manifest.json and the result files hold them."""
    names = [field_.name for field_ in fields(Finding)]
    return [{name: getattr(finding, name) for name in names} for finding in findings]


def from_data(data: Iterable[dict[str, Any]]) -> tuple[Finding, ...]:
    """Make the findings that `as_data` turned into tables; a code that the catalogue has no more is text.

    TypeError, KeyError, ValueError: other data.
    """
    findings = []
    for values_of_one in data:
        values = {name: str(value) for name, value in values_of_one.items()}
        if (code := values["code"]) and code not in CATALOGUE:
            values |= {"code": "", "text": f"[{code}] {values['text']}"}
        findings.append(Finding(**values))
    return tuple(findings)


def as_text(findings: Iterable[Finding]) -> str:
    """Write findings as JSON, the attribute ``findings`` of a result file."""
    return json.dumps(as_data(findings))


def findings_in(attributes: Any) -> tuple[Finding, ...]:
    """Read the findings of a stage from the attributes of its file, none where it has none."""
    return from_data(json.loads(attributes.get("findings", "[]")))


class FindingWarning(UserWarning):
    """A finding outside a run, such as of an export or a search; its argument is the `Finding`."""


def tell(finding: Finding, *, stacklevel: int = 2) -> None:
    """Tell a finding that belongs to no results: the command line prints it as those of a run."""
    warnings.warn(FindingWarning(finding), stacklevel=stacklevel + 1)
