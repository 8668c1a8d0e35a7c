"""Findings: what is allowed, or was computed, but deserves a look; and the catalogue of their codes.

A refusal is an exception of `femgear.errors`. A finding ends nothing: it goes into the one list of a run,
which terminal, page, manifest, result files, ``femgear check`` and docs/errors.md read.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from typing import Any, NamedTuple

from femgear.errors import printable

NOTE, DOUBT, FAULT = "note", "doubt", "fault"
SEVERITIES = (NOTE, DOUBT, FAULT)
"""From the least to the most severe: worth knowing; a number may be wrong; nothing real carries that."""


class Meaning(NamedTuple):
    """What a code means.

    Parameters
    ----------
    severity : str
        One of `SEVERITIES`, unless a finding has its own.
    sentence : str
        What it is about.
    words : str
        The same in few words, beside a number that it concerns.
    advice : str
        What to do about it where a finding names nothing of its own; a sentence.
    """

    severity: str
    sentence: str
    words: str
    advice: str


CATALOGUE = {
    "W-BACK": Meaning(
        NOTE,
        "Meshes carry on their back flanks.",
        "back flanks carry",
        "Look at errors and play of the planets: some of them work against the others.",
    ),
    "W-BACKLASH": Meaning(
        NOTE,
        "Contact loss is asked for where teeth have no back side, or there are no meshes.",
        "no back side to meet",
        "Give set.backlash, or leave contact loss out.",
    ),
    "W-BALANCE": Meaning(
        DOUBT,
        "A harmonic balance did not converge.",
        "a balance is missed",
        "Take fewer harmonics, more damping or smaller steps, and do not use its numbers before.",
    ),
    "W-BEARING": Meaning(
        NOTE,
        "Bearings are missing, or one has a property that a stage does not take.",
        "a bearing is missing or in part left out",
        "Give the bearing, or read results as those without that property.",
    ),
    "W-BRANCH": Meaning(
        DOUBT,
        "The curve of a response breaks off.",
        "the curve breaks off",
        "Begin from the other end, or give more damping: what lies beyond is not known.",
    ),
    "W-CHAOS": Meaning(
        DOUBT,
        "Neighbouring motions move apart: details of the record depend on the steps.",
        "details depend on the steps",
        "Compare two values of transient.rate, and use means and largest values alone.",
    ),
    "W-CLEARANCE": Meaning(
        NOTE,
        "A tip comes close to the root of its mate.",
        "little tip clearance",
        "Give tip_diameter or a deeper dedendum, if the drawing has more room.",
    ),
    "W-CLIPPING": Meaning(
        DOUBT,
        "Samples of a sound exceed its full scale.",
        "sound beyond its full scale",
        "Raise the full scale that the message names, and export again.",
    ),
    "W-COMPILER": Meaning(
        NOTE,
        "A functional mock-up unit has no binary.",
        "no binary in the unit",
        "Install a C compiler and export again, or let the tool that reads the unit compile it.",
    ),
    "W-CONTACT-POINTS": Meaning(
        DOUBT,
        "The mesh forces on both gears do not act on one line.",
        "mesh forces off one line",
        'Write helical.contact_points = "pitch_point".',
    ),
    "W-CONTACT-RATIO": Meaning(
        NOTE,
        "The contact ratio is low.",
        "low contact ratio",
        "Give longer teeth or smaller profile shifts; noise and loads of single teeth are high.",
    ),
    "W-CONVERGENCE": Meaning(
        DOUBT,
        "A periodic solution did not converge.",
        "a speed did not converge",
        "Leave these speeds out, or give more damping; their numbers hold nothing.",
    ),
    "W-COUPLING": Meaning(
        NOTE,
        "The torque turns a coupling further than couplings go.",
        "the coupling turns far",
        "Give the stiffness of the coupling of your catalogue.",
    ),
    "W-CROSS": Meaning(
        DOUBT,
        "Stages change one another by more than a response stage by stage may leave out.",
        "stages shake one another",
        "Compute the stages together in time, with [transient], or read levels with that margin.",
    ),
    "W-DAMPING": Meaning(
        DOUBT,
        "Without damping resonances have no limit.",
        "no damping",
        "Give a damping ratio; 0.02 to 0.05 is usual of gear trains.",
    ),
    "W-DEFLECTION": Meaning(
        DOUBT,
        "Deflections are no longer small; in a gearbox a fault where ten times over the limit.",
        "large deflections",
        "Stiffen shafts and bearings where the message says, or take less torque.",
    ),
    "W-EDGE": Meaning(
        DOUBT,
        "Contacts lie at the end of a flank, where the pressure has no limit.",
        "contact at the end of a flank",
        "Do not use the pressure there; a relief or a crowning moves the contact inwards.",
    ),
    "W-ENDS": Meaning(
        DOUBT,
        "Free ends of the teeth make meshes softer than the model has them.",
        "free ends of teeth left out",
        "Read stiffness and load distribution with the margin of the message.",
    ),
    "W-ESTIMATED": Meaning(
        NOTE,
        "Values that were left out are estimated.",
        "estimated values",
        "Give what is known of them in the case file: vibration and levels rest on masses and stiffnesses.",
    ),
    "W-EXCITATION": Meaning(
        DOUBT,
        "The excitation ends below what levels need, or nothing excites.",
        "excitation falls short",
        "Raise dynamics.up_to, or read the number as one that may be higher by what the message says.",
    ),
    "W-FACE-LOAD": Meaning(
        DOUBT,
        "The load over the face width is too uneven for its slices, or leaves a part of the width bare.",
        "uneven load over the width",
        "Take more slices, or stiffer shafts and bearings where the face width lifts.",
    ),
    "W-FAULT": Meaning(
        DOUBT,
        "A fault of a tooth has effects that the model leaves out, or none that shows.",
        "effects of a fault left out",
        "Take orders and places as they are, and sizes with the margin of the message.",
    ),
    "W-FILLET": Meaning(
        NOTE,
        "A tip runs into the root fillet of its mate by a little.",
        "a tip meets a fillet",
        "Give a smaller tip diameter, or another rounding of the tool.",
    ),
    "W-FORMER": Meaning(
        NOTE,
        "A file of a former model is read as one of today.",
        "file of a former model",
        "femgear gearbox FILE writes it with the entries of today.",
    ),
    "W-FOUNDATION": Meaning(
        DOUBT,
        "A model for other programs has the ring on its foundation, not on supports or in a casing.",
        "ring on its foundation alone",
        "Take levels at sensors from a run, and the model for teeth and shafts.",
    ),
    "W-FREE": Meaning(
        DOUBT,
        "More modes have no stiffness than a gearbox has ways to turn.",
        "motions that nothing holds",
        "Give bearings that carry, and stiffer feet.",
    ),
    "W-FRICTION": Meaning(
        DOUBT,
        "Friction acts at all speeds with the coefficient of one of them.",
        "friction of another speed",
        "Compute speeds that matter as load cases of their own.",
    ),
    "W-GROWTH": Meaning(
        DOUBT,
        "The free motion grows: a parametric resonance.",
        "motion that grows",
        "Give more damping or another speed, or let teeth part.",
    ),
    "W-HEAT": Meaning(
        DOUBT,
        "Teeth are hotter, or their oil film thinner, than the oil is good for.",
        "oil beyond its range",
        "Take another oil, a lower temperature of the oil, or less torque.",
    ),
    "W-HELIX": Meaning(
        DOUBT,
        "The helix angle lies outside what is validated.",
        "helix angle not validated",
        "Read stiffnesses with a margin: docs/validation.md says how far they are checked.",
    ),
    "W-JOURNAL": Meaning(
        NOTE,
        "Lines of a journal were damaged and are left out.",
        "damaged lines of a journal",
        "Nothing: what stood there is computed again.",
    ),
    "W-KINK": Meaning(
        DOUBT,
        "A stress stands at a kink, or at an end of what was searched.",
        "stress at a kink",
        'Write shape = "parabolic" for reliefs, and give the rounding of the tool; the stress beside it holds.',
    ),
    "W-LIFE": Meaning(
        FAULT,
        "Teeth or bearings fail before the life that the case asks for.",
        "life too short",
        "Less torque or time in the load case that is named, a wider face, a larger module or bearing.",
    ),
    "W-LIFTED": Meaning(
        NOTE,
        "Parts of the face width never carry.",
        "part of the width lifts",
        "Look at misalignment and crowning: fewer millimetres carry than the teeth have.",
    ),
    "W-LOAD": Meaning(
        NOTE,
        "Without load nothing keeps the flanks on one side.",
        "no load",
        "Give a torque.",
    ),
    "W-LOSSES": Meaning(
        NOTE,
        "Losses of a part are left out, or rest on a simpler model.",
        "losses in part unknown",
        "Give teeth and lubricant of the stages that the message names.",
    ),
    "W-MATERIAL": Meaning(
        DOUBT,
        "Safeties and lives rest on an estimated treatment of the gears.",
        "treatment is estimated",
        "Give treatment, grade and hardness of the drawing, and leave estimated out.",
    ),
    "W-MOTION": Meaning(
        DOUBT,
        "A member moves far enough to change contact points and arms.",
        "a member moves far",
        "Give stiffer supports, or less torque: contact points are those of the unmoved set.",
    ),
    "W-NEIGHBOURS": Meaning(
        NOTE,
        "Neighbouring planets come close to one another.",
        "planets close to one another",
        "Take fewer planets, or other teeth.",
    ),
    "W-OIL": Meaning(
        DOUBT,
        "The viscosity of the oil is extrapolated beyond the temperatures at which its law holds.",
        "oil temperature beyond its law",
        "Give an oil with viscosities at the temperatures of the contact.",
    ),
    "W-ONE-WAY": Meaning(
        NOTE,
        "Supports or a casing change the level; load factors are computed without them.",
        "casing not in load factors",
        "Read K_gamma and mesh forces as those without the casing.",
    ),
    "W-OPEN": Meaning(
        NOTE,
        "A planet carries nothing at some positions.",
        "a planet is unloaded at times",
        "Give more torque, or smaller errors of the pins, if planets are to share the load.",
    ),
    "W-OVERLAP": Meaning(
        DOUBT,
        "Shafts and gears take up the same space.",
        "bodies in one place",
        "Correct axis, start or diameters of what the message names.",
    ),
    "W-PARTED": Meaning(
        NOTE,
        "Teeth never touch.",
        "teeth never touch",
        "Give torques or a start that close the flanks.",
    ),
    "W-PLANETS": Meaning(
        NOTE,
        "Planets are not equally spaced, or their number is unusual.",
        "unusual planets",
        "Nothing, if the drawing has them so: fewer forces cancel than with equal spacing.",
    ),
    "W-PLAY": Meaning(
        DOUBT,
        "Bearings that carry nothing hold nothing: shafts float in their play.",
        "a shaft floats in its play",
        "Give weight, preload or less clearance, or a load that presses the shaft to one side.",
    ),
    "W-PLUGIN": Meaning(
        NOTE,
        "A package has a train of a name that is taken.",
        "two trains of one name",
        "Remove the package, or rename its train.",
    ),
    "W-POINTS": Meaning(
        DOUBT,
        "Points on the ring do not resolve its waves.",
        "too few points on the ring",
        "Raise housing.points as the message says.",
    ),
    "W-POSITIONS": Meaning(
        DOUBT,
        "Peaks between positions may be higher.",
        "peaks between positions",
        "Raise static.positions, or the number that the message names.",
    ),
    "W-PASSES": Meaning(
        DOUBT,
        "Shafts and teeth have not settled within the passes that are allowed.",
        "shafts have not settled",
        "Raise deflection.passes.",
    ),
    "W-PRESSURE": Meaning(
        FAULT,
        "The contact pressure exceeds what any steel carries.",
        "pressure beyond any steel",
        "Less torque, a wider face, or a larger module.",
    ),
    "W-PROFILE": Meaning(
        NOTE,
        "A profile has proportions that are unusual.",
        "unusual proportions",
        "Nothing, if the drawing has them so.",
    ),
    "W-PULL": Meaning(
        DOUBT,
        "Meshes pull where real teeth would part.",
        "flanks pull that would part",
        "Give more torque or damping, or compute with teeth that part.",
    ),
    "W-RATE": Meaning(
        DOUBT,
        "Steps or samples are too coarse for the frequencies.",
        "steps too coarse",
        "Raise the rate that the message names.",
    ),
    "W-RECORD": Meaning(
        NOTE,
        "A record ends below a frequency that matters.",
        "record ends low",
        "Raise transient.record, if higher frequencies matter.",
    ),
    "W-RELIEF-SIGN": Meaning(
        NOTE,
        "A modification adds material.",
        "a relief adds material",
        "Give a positive amount, which takes material off.",
    ),
    "W-RESIDUAL": Meaning(
        DOUBT,
        "Static compliance beyond the modes of a casing is missing.",
        "casing without static rest",
        "Export more modes, residual vectors, or the reduced matrices.",
    ),
    "W-REVERSAL": Meaning(
        NOTE,
        "Load cases of both directions bend roots both ways, which lowers their strength.",
        "roots bent both ways",
        "Give strength.reversal_factor, or leave load cases out that reverse no load.",
    ),
    "W-RIGID": Meaning(
        DOUBT,
        "A response holds bodies rigid that the modes have elastic.",
        "bodies held rigid",
        "Look at the modes of these bodies near the lines that matter.",
    ),
    "W-RIM": Meaning(
        NOTE,
        "A rim is thin; a doubt where no S_F has it by the rim factor of ISO 6336-3, or the factor ends.",
        "thin rim",
        "Give a thicker rim, or material.treatment and hardness for an S_F with the factor.",
    ),
    "W-REXS": Meaning(
        DOUBT,
        "A REXS file holds what the case that was made of it has not, or has otherwise.",
        "REXS file with other content",
        "Compare the entries that the message names with their source.",
    ),
    "W-RIPPLE": Meaning(
        DOUBT,
        "With more positions the peak to peak of the mesh stiffness of helical teeth may differ.",
        "ripple of mesh stiffness",
        "Raise static.positions.",
    ),
    "W-ROWS": Meaning(
        NOTE,
        "Tables that no sheet can hold are left out.",
        "tables left out",
        "Export them with --csv.",
    ),
    "W-SEPARATION": Meaning(
        NOTE,
        "Flanks part at speeds of operation.",
        "flanks part",
        "Give set.backlash, more torque or more damping.",
    ),
    "W-SETTLED": Meaning(
        DOUBT,
        "Motions do not repeat within the periods that are allowed.",
        "motions do not repeat",
        "Allow more periods: the motion may be chaotic.",
    ),
    "W-SIZE": Meaning(
        NOTE,
        "The computation takes long, or fills much memory.",
        "long computation",
        "Take fewer speeds, or a lower dynamics.up_to, if that is too much.",
    ),
    "W-SLICES": Meaning(
        NOTE,
        "Slices make the dynamics slow.",
        "slices take time",
        "Take fewer slices, if that is too long.",
    ),
    "W-SMOOTHING": Meaning(
        DOUBT,
        "The smoothing of contact changes the result.",
        "smoothed contact",
        "Lower planar.smoothing where teeth part or wedge.",
    ),
    "W-SPECTRUM": Meaning(
        NOTE,
        "The stage spectrum refuses this case.",
        "no load spectrum",
        "Give what the message names, or leave the spectrum out.",
    ),
    "W-SPEED": Meaning(
        NOTE,
        "Torques change the speed within the record.",
        "speed changes in the record",
        "share = 1.0 at another load balances the torques.",
    ),
    "W-STANDING": Meaning(
        DOUBT,
        "Planets of a carrier that turns vibrate where they stand: lines have no side bands.",
        "planets vibrate where they stand",
        "Give equal branches on one carrier; else levels hold, and lines have no side bands.",
    ),
    "W-STEPS": Meaning(
        DOUBT,
        "Peaks of resonances are too narrow for the speeds of a run-up.",
        "few speeds at resonances",
        "Raise runup.count, or take a narrower range: levels may be higher.",
    ),
    "W-STIFFNESS": Meaning(
        DOUBT,
        "Results rest on estimated stiffnesses, of bearings or of meshes.",
        "estimated stiffness",
        "Give stiffness or catalogue numbers of bearings, and the contact of teeth.",
    ),
    "W-STRENGTH": Meaning(
        FAULT,
        "A tooth fails at once: a stress exceeds its static strength.",
        "a tooth fails at once",
        "Less torque in that load case, a wider face, a larger module, or another treatment.",
    ),
    "W-SWEEP": Meaning(
        NOTE,
        "A sweep takes long.",
        "long sweep",
        "Nothing: an interrupted sweep goes on where it was.",
    ),
    "W-TAIL": Meaning(
        DOUBT,
        "The highest harmonics of a response are not small.",
        "too few harmonics",
        "Raise the number that the message names; forces and levels change by what it says.",
    ),
    "W-TEETH": Meaning(
        NOTE,
        "Teeth do not suit their radii, shifted planets have no centre distance, or planets do not assemble.",
        "teeth do not suit",
        "Correct teeth, radii or number of planets as the message says.",
    ),
    "W-THRUST": Meaning(
        DOUBT,
        "Axial forces tilt the planets, which K_Hbeta takes as upright.",
        "planets tilt under thrust",
        "Make a gearbox of the case (femgear gearbox CASE), or give the tilt that bearings allow as a lead slope.",
    ),
    "W-TIP": Meaning(
        NOTE,
        "Tips are shorter than those of the basic rack.",
        "shortened tips",
        "Give tip_diameter where the drawing has another one.",
    ),
    "W-TIP-THIN": Meaning(
        NOTE,
        "The tooth is thin at its tip.",
        "thin tips",
        "Take a smaller profile shift or tip diameter: hardened tips may break off.",
    ),
    "W-TONE": Meaning(
        NOTE,
        "A recording has tones of constant frequency, such as the hum of the mains, while the speed changes.",
        "hum in the recording",
        "Look for hum of the mains and for other machines; lines of the set are what is left.",
    ),
    "W-TORQUE": Meaning(
        NOTE,
        "The torque has an unusual sign or size.",
        "unusual torque",
        "Nothing, if it is meant so.",
    ),
    "W-UNDERCUT": Meaning(
        NOTE,
        "The tool cuts into the flank at the root.",
        "undercut",
        "Give a larger profile shift or more teeth.",
    ),
    "W-UNSTABLE": Meaning(
        DOUBT,
        "A periodic solution is unstable: a real machine leaves it.",
        "unstable motion",
        "Do not use this speed: give more damping, or compute the motion in time.",
    ),
    "W-UNSTEADY": Meaning(
        DOUBT,
        "The speed of a recording is another one than is said, or changes: lines are smeared.",
        "speed of the recording",
        "Give the speed that the message names, or record pulses.",
    ),
    "W-UNUSED": Meaning(
        NOTE,
        "An entry of the case has no effect.",
        "entry without effect",
        "Leave it out, or give what would make it act.",
    ),
    "W-WEDGED": Meaning(
        NOTE,
        "Meshes are loaded on both flanks at once.",
        "loaded on both flanks",
        "Give more backlash.",
    ),
    "W-WEDGING": Meaning(
        NOTE,
        "Teeth have so little play that they may wedge.",
        "little play",
        "Give more backlash, or smaller errors.",
    ),
    "W-WIDTHS": Meaning(
        NOTE,
        "Gears are wider than their mates; in a gearbox a doubt where they face each other in part.",
        "unequal face widths",
        "Correct face widths or places of the gears.",
    ),
}
"""What every code means; the text of a finding says the numbers."""


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
        Gear, flank or kind of mesh whose numbers it is about, where these are not all that its code is about; kinds of
        entries that are estimated.
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
        usual = CATALOGUE[self.code].severity if self.code else NOTE
        object.__setattr__(self, "severity", self.severity or usual)
        if self.severity not in SEVERITIES:
            raise ValueError(f"{self.severity!r} is no severity: {', '.join(SEVERITIES)}")

    def __str__(self) -> str:
        head = f"[{self.code}] " if self.code else ""
        where = f"{self.key}: " if self.key else ""
        usual = f" (usual: {self.limit})" if self.limit else ""
        return printable(f"{head}{where}{self.text}{'; ' if self.remedy else ''}{self.remedy}{usual}")


def in_words(code: str) -> str:
    """Write a code behind what it means in few words, such as "flanks part (W-SEPARATION)"."""
    return f"{CATALOGUE[code].words} ({code})"


def percent(share: float, places: int = 0, *, signed: bool = False) -> str:
    """Write a share in per cent with so many places, a space before the sign (ISO 80000-1): ``"22 %"``."""
    return f"{100.0 * share:{'+' * signed}.{places}f} %"


def remark(text: str) -> Finding:
    """Make a finding without code and entry: what was read in a way that deserves to be said."""
    return Finding("", "", text)


def once(findings: Iterable[Finding], stage: str = "") -> tuple[Finding, ...]:
    """List findings of a stage, each once and in their order; without a stage they keep theirs."""
    copies = from_data(as_data(findings))  # of whatever class
    return tuple(dict.fromkeys(replace(finding, stage=stage) if stage else finding for finding in copies))


def counted(findings: Sequence[Finding]) -> str:
    """Count findings by their severity, the most severe first: ``"2 doubts, 1 note"``; empty of none."""
    counts = {severity: sum(finding.severity == severity for finding in findings) for severity in reversed(SEVERITIES)}
    return ", ".join(f"{count} {severity}{'s' * (count > 1)}" for severity, count in counts.items() if count)


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
