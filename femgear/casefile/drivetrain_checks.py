"""What must hold between the entries of a drivetrain case: names, chain, teeth and radii, torques, times."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from itertools import pairwise

from femgear.casefile.drivetrain import DrivetrainCase, PlanetarySection, ShaftSection
from femgear.casefile.units import FREQUENCY, LENGTH, TIME
from femgear.errors import CaseError

# Ratios of radii and teeth that differ by more belong to no gears; profile shifts explain the rest.
RATIO_TOLERANCE = 0.01
# Above this the difference is worth a remark.
_REMARK = 1e-4
MOST_STEPS = 1e8
MOST_VALUES = 2.5e8
LEAST_RECORDS = 64


def cross_check(case: DrivetrainCase) -> list[CaseError]:
    """What no entry shows alone."""
    names = list(_names(case))
    found = [*names, *(problem for check in _CHECKS for problem in check(case))]
    return found if names else [*found, *_chain(case)]


def joints(case: DrivetrainCase) -> list[tuple[str, str, str]]:
    """Key, and the two bodies, of every shaft and gear stage."""
    found = [(f"shaft[{i}].between", *one.between) for i, one in enumerate(case.shaft)]
    found += [(f"parallel[{i}].between", *one.between) for i, one in enumerate(case.parallel)]
    return found + [(f"planetary[{i}].sun", one.carrier, one.sun) for i, one in enumerate(case.planetary)]


def _names(case: DrivetrainCase) -> Iterator[CaseError]:
    names = [body.name for body in case.body]
    for i, name in enumerate(names):
        if name in names[:i]:
            yield CaseError("two bodies have one name", code="E-DUPLICATE", key=f"body[{i}].name", value=name)
    used = [(key, name) for key, *ends in joints(case) if ".between" in key for name in ends]
    for i, stage in enumerate(case.planetary):
        used += [(f"planetary[{i}].carrier", stage.carrier), (f"planetary[{i}].sun", stage.sun)]
    used += [(f"bearing[{i}].body", one.body) for i, one in enumerate(case.bearing) if one.body is not None]
    used += [(f"operation.torque[{i}].body", one.body) for i, one in enumerate(case.operation.torque)]
    for key, name in used:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
            yield CaseError(
                "there is no such body",
                code="E-BODY",
                key=key,
                value=name,
                limit=", ".join(names[:20]),
                remedy=f"did you mean {near[0]}?" if near else "name a body of a [[body]] table",
            )
    for key, first, second in joints(case):
        if first == second:
            yield CaseError("a body is joined to itself", code="E-BODY", key=key, value=first)


def _chain(case: DrivetrainCase) -> Iterator[CaseError]:
    """Everything hangs together, and shafts alone close no loop."""
    group = {body.name: body.name for body in case.body}

    def root(name: str) -> str:
        while group[name] != name:
            name = group[name]
        return name

    for key, first, second in joints(case):
        one, two = root(first), root(second)
        if one == two and key.startswith("shaft"):
            yield CaseError(
                f"the shaft closes a loop: {first} and {second} are joined already",
                code="E-LOOP",
                key=key,
                limit="one way by shafts from body to body",
                remedy="leave one of the shafts out",
            )
        group[two] = one
    start = root(case.body[0].name)
    apart = [(i, body.name) for i, body in enumerate(case.body) if root(body.name) != start]
    if apart:
        i, name = apart[0]
        yield CaseError(
            f"nothing joins {', '.join(name for _, name in apart)} to {case.body[0].name}",
            code="E-DISCONNECTED",
            key=f"body[{i}].name",
            value=name,
            remedy="add a [[shaft]], a [[parallel]] or a [[planetary]]",
        )


def _bodies(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, body in enumerate(case.body):
        if body.tilts and body.transverse_inertia == 0.0:
            yield CaseError(
                "a body that tilts needs an inertia about a diameter",
                code="E-KEY-MISSING",
                key=f"body[{i}].transverse_inertia",
                remedy="give it (a flat disc has half its inertia about the axis), or tilts = false",
            )
    elements = {shaft.between: shaft.elements for shaft in case.shaft}
    for i, one in enumerate(case.bearing):
        inside = (one.shaft is not None, one.station is not None)
        if inside != (one.body is None,) * 2:
            yield CaseError(
                "a bearing sits on one body, or on one station inside a shaft",
                code="E-CHOICE",
                key=f"bearing[{i}].{'body' if one.body else 'shaft'}",
                limit="body, or shaft with station",
            )
        elif one.shaft is not None and not one.station < elements.get(one.shaft, 0):
            stations = elements.get(one.shaft, 0) - 1
            yield CaseError(
                "there is no such station",
                code="E-BODY",
                key=f"bearing[{i}].station",
                value=one.station,
                limit=f"1 to {stations}"
                if stations > 0
                else "a [[shaft]] with this between and 2 elements or more",
            )
        if one.radial == one.tilt == one.torsion == 0.0:
            yield CaseError(
                "a bearing without stiffness",
                code="E-RANGE",
                key=f"bearing[{i}].radial",
                value="0 N/m",
                limit="one of radial, tilt and torsion above 0",
            )
        if math.isinf(one.radial) and one.offset:
            yield CaseError(
                "a rigid bearing beside the centre of its body",
                code="E-CHOICE",
                key=f"bearing[{i}].offset",
                value=LENGTH.show(one.offset),
                limit="0 mm where radial is rigid",
                remedy="give a finite stiffness",
            )


def _shafts(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, shaft in enumerate(case.shaft):
        springs = [name for name in ("bending", "torsion", "shear") if getattr(shaft, name) is not None]
        if message := _shaft_problem(shaft, springs):
            yield CaseError(
                message,
                code="E-CHOICE",
                key=f"shaft[{i}].{springs[0] if springs else 'outer_diameter'}",
                limit="bending and torsion, or outer_diameter with what else the section needs",
            )
        if shaft.outer_diameter is not None and not shaft.inner_diameter < shaft.outer_diameter:
            yield CaseError(
                "the bore is as large as the shaft",
                code="E-RANGE",
                key=f"shaft[{i}].inner_diameter",
                value=LENGTH.show(shaft.inner_diameter),
                limit=f"below {LENGTH.show(shaft.outer_diameter)}",
            )


def _shaft_problem(shaft: ShaftSection, springs: list[str]) -> str:
    if shaft.outer_diameter is None:
        if not {"bending", "torsion"} <= set(springs):
            return "the shaft has neither a section nor both springs"
        return "elements need a section" if shaft.elements else ""
    return f"the shaft has a section and {' and '.join(springs)}" if springs else ""


def _sizes(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, stage in enumerate(case.parallel):
        key, given = f"parallel[{i}]", _given(stage, ("radii", "base_radii", "module"))
        if len(given) != 1:
            yield _one_of(f"{key}.{given[0] if given else 'radii'}", "radii, base_radii or module")
            continue
        radii = stage.radii or stage.base_radii
        if radii and (problem := _mismatch(radii[1] / radii[0], stage.teeth[1] / stage.teeth[0])):
            yield _unfit(f"{key}.teeth", problem)
    for i, stage in enumerate(case.planetary):
        yield from _planetary_sizes(stage, f"planetary[{i}]")


def _planetary_sizes(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    pitch = _given(stage, ("sun_radius", "planet_radius"))
    base = _given(stage, ("sun_base_radius", "planet_base_radius"))
    ways = [pitch, base, _given(stage, ("module",))]
    if [len(way) for way in ways] not in ([2, 0, 0], [0, 2, 0], [0, 0, 1]):
        words = "sun_radius and planet_radius, sun_base_radius and planet_base_radius, or module"
        yield _one_of(f"{key}.{next((way[0] for way in ways if way), 'sun_radius')}", words)
    elif pitch or base:
        sun, planet = (getattr(stage, name) for name in (pitch or base))
        pairs = [("ring_teeth", 1.0 + 2.0 * planet / sun, stage.ring_teeth / stage.sun_teeth)]
        if stage.planet_teeth is not None:
            pairs.append(("planet_teeth", planet / sun, stage.planet_teeth / stage.sun_teeth))
        for name, radii, teeth in pairs:
            if problem := _mismatch(radii, teeth):
                yield _unfit(f"{key}.{name}", problem)
    if not stage.sun_teeth < stage.ring_teeth:
        yield CaseError(
            "the ring has no more teeth than the sun",
            code="E-TEETH",
            key=f"{key}.ring_teeth",
            value=stage.ring_teeth,
            limit=f"more than {stage.sun_teeth}",
        )
    yield from _assembly(stage, key)


def _assembly(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    both, angles = stage.ring_teeth + stage.sun_teeth, stage.planet_angles
    if angles is None:
        if both % stage.planets:
            yield CaseError(
                f"{stage.planets} equally spaced planets do not assemble",
                code="E-ASSEMBLY",
                key=f"{key}.planets",
                value=stage.planets,
                limit=f"a divisor of ring_teeth + sun_teeth = {both}",
            )
        yield from _neighbours(stage, key, 2.0 * math.pi / stage.planets)
        return
    if any(b <= a for a, b in pairwise(angles)) or angles[-1] - angles[0] >= 2.0 * math.pi - 1e-9:
        yield CaseError(
            "the planet angles do not ascend within one turn", code="E-RANGE", key=f"{key}.planet_angles"
        )
    yield from _neighbours(stage, key, min(b - a for a, b in pairwise((*angles, angles[0] + 2.0 * math.pi))))
    steps = [(angle - angles[0]) * both / (2.0 * math.pi) for angle in angles]
    if any(abs(step - round(step)) > 1e-3 for step in steps):
        yield CaseError(
            "the planets do not assemble at these angles",
            code="E-ASSEMBLY",
            key=f"{key}.planet_angles",
            limit=f"whole multiples of 360 deg / {both} from one another",
        )


def _neighbours(stage: PlanetarySection, key: str, apart: float) -> Iterator[CaseError]:
    """Pitch circles of neighbouring planets must not overlap; sizes by the teeth."""
    share = (stage.ring_teeth - stage.sun_teeth) / (stage.ring_teeth + stage.sun_teeth)
    if share > 0.0 and math.sin(0.5 * min(apart, math.pi)) <= share:
        most = math.degrees(2.0 * math.asin(share))
        yield CaseError(
            "neighbouring planets overlap",
            code="E-NEIGHBOURS",
            key=f"{key}.{'planets' if stage.planet_angles is None else 'planet_angles'}",
            value=f"{math.degrees(apart):.4g} deg from one to the next",
            limit=f"more than {most:.4g} deg",
            remedy="take fewer planets, or smaller ones",
        )


def _given(section, names) -> list[str]:
    return [name for name in names if getattr(section, name) is not None]


def _one_of(key: str, words: str) -> CaseError:
    return CaseError("the sizes of the gears are needed once", code="E-CHOICE", key=key, limit=words)


def _mismatch(radii: float, teeth: float) -> str:
    if abs(teeth / radii - 1.0) <= RATIO_TOLERANCE:
        return ""
    return f"the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}"


def _unfit(key: str, message: str) -> CaseError:
    return CaseError(
        message,
        code="E-TEETH",
        key=key,
        limit=f"ratios within {RATIO_TOLERANCE:.0%} of one another",
        remedy="correct the teeth or the radii, or give module in place of the radii",
    )


def _torques(case: DrivetrainCase) -> Iterator[CaseError]:
    shares, bodies = [], []
    for i, one in enumerate(case.operation.torque):
        key = f"operation.torque[{i}]"
        series = len(_given(one, ("times", "torques")))
        given = _given(one, ("torque", "file", "share")) + ["times"] * bool(series)
        if len(given) != 1 or series == 1:
            yield CaseError(
                "the torque on a body is given in one way",
                code="E-CHOICE",
                key=f"{key}.{given[0] if given else 'torque'}",
                limit="torque, file, times with torques, or share",
            )
        elif series:
            if len(one.times) != len(one.torques) or any(b <= a for a, b in pairwise(one.times)):
                yield CaseError(
                    "the series needs ascending times, and as many torques",
                    code="E-TORQUE",
                    key=f"{key}.times",
                    value=f"{len(one.times)} times, {len(one.torques)} torques",
                )
        if one.body in bodies:
            yield CaseError("a second torque on one body", code="E-DUPLICATE", key=f"{key}.body")
        bodies.append(one.body)
        shares += [key] if one.share is not None else []
    if len(shares) > 1 or (shares and len(bodies) == 1):
        yield CaseError(
            "a share needs other torques that it balances, none of them a share",
            code="E-TORQUE",
            key=f"{shares[-1]}.share",
            limit="one share, beside torques that are given",
        )


def _simulation(case: DrivetrainCase) -> Iterator[CaseError]:
    s = case.simulation
    ratio = s.rate / case.record_rate
    if ratio < 1.0 - 1e-9 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        yield CaseError(
            "a record is kept after a whole number of steps",
            code="E-RANGE",
            key="simulation.record",
            value=FREQUENCY.show(case.record_rate),
            limit=f"{FREQUENCY.show(s.rate)} (simulation.rate) over a whole number",
        )
    for key, size, most, words in (
        ("duration", s.duration * s.rate, MOST_STEPS, "steps"),
        ("record", s.duration * case.record_rate * (2 * len(case.body) + 8), MOST_VALUES, "kept numbers"),
    ):
        if size > most:
            yield CaseError(
                f"{size:.3g} {words} are too many", code="E-RANGE", key=f"simulation.{key}", limit=f"{most:g}"
            )
    late = s.duration - settle_time(case)
    if late * case.record_rate < LEAST_RECORDS:
        yield CaseError(
            "hardly anything is left for the spectra",
            code="E-RANGE",
            key="simulation.settle" if s.settle is not None else "simulation.duration",
            value=TIME.show(settle_time(case)) if s.settle is not None else TIME.show(s.duration),
            limit=f"{LEAST_RECORDS} records or more after simulation.settle",
        )
    elif s.resolution is not None and not 1.0 / late <= s.resolution <= case.record_rate / 16.0:
        yield CaseError(
            "the record has no such resolution",
            code="E-RANGE",
            key="simulation.resolution",
            value=FREQUENCY.show(s.resolution),
            limit=f"{FREQUENCY.show(1.0 / late)} to {FREQUENCY.show(case.record_rate / 16.0)}",
        )


def settle_time(case: DrivetrainCase) -> float:
    """Start that the spectra leave out [s]: as given, or three tenths."""
    s = case.simulation
    return 0.3 * s.duration if s.settle is None else s.settle


def notices(case: DrivetrainCase) -> tuple[str, ...]:
    """Remarks on a case that was checked."""
    found = []
    for i, stage in enumerate(case.parallel):
        radii = stage.radii or stage.base_radii
        if radii:
            found.append((f"parallel[{i}]", radii[1] / radii[0], stage.teeth[1] / stage.teeth[0]))
    for i, stage in enumerate(case.planetary):
        for sun, planet in (
            (stage.sun_radius, stage.planet_radius),
            (stage.sun_base_radius, stage.planet_base_radius),
        ):
            if sun is not None:
                found.append(
                    (f"planetary[{i}]", 1.0 + 2.0 * planet / sun, stage.ring_teeth / stage.sun_teeth)
                )
    said = [
        f"[W-TEETH] {key}.teeth: the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}; speeds follow "
        "the radii, mesh frequencies the teeth of the first gear or of the ring"
        for key, radii, teeth in found
        if abs(teeth / radii - 1.0) > _REMARK
    ]
    if not case.bearing:
        said.append("[W-BEARING] there is no [[bearing]]")
    return tuple(said)


_CHECKS = (_bodies, _shafts, _sizes, _torques, _simulation)
