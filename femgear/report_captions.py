"""Where every picture of a run stands in the report, and what is said under it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femgear.case import Case
    from femgear.casefile.drivetrain import DrivetrainCase
    from femgear.storage import Results

# stem of a file, its section, its caption; {} stands for what follows the stem
CAPTIONS = (
    (
        "static_transmission_error",
        "Static",
        "Static transmission error over one mesh period: every mesh along its line of action, and from "
        "sun to ring. Sun and planets held at their bores, ring at its outer surface.",
    ),
    (
        "mesh_stiffness",
        "Static",
        "Mesh stiffness over one mesh period: tangent dF/dδ of the loaded mesh (thick) and secant F/δ "
        "(thin).",
    ),
    (
        "load_sharing",
        "Static",
        "Share of every planet in the torque of the sun.",
    ),
    (
        "tooth_loads",
        "Static",
        "Load of one tooth pair from its first to its last contact.",
    ),
    (
        "profile_deviations",
        "Static",
        "Deviations of the loaded flanks from the involute over the roll angle, positive with more material.",
    ),
    (
        "pitch_deviations",
        "Static",
        "Cumulative pitch deviations of the loaded flanks over the tooth number.",
    ),
    (
        "deformed_set",
        "Static",
        "Deformed set under the static load, magnified; at rest in grey.",
    ),
    (
        "contact_pressure",
        "Stresses",
        "Contact pressure of one tooth pair on its way through the mesh: largest value beside the nominal "
        "stress of ISO 6336-2, and distribution along the common tangent. At the ends tip corners touch.",
    ),
    (
        "load_spectrum",
        "Stresses",
        "Load spectrum of a tooth: share of the time under load in every load class, and the largest loads "
        "of its load cycles.",
    ),
    (
        "root_stress",
        "Stresses",
        "Stress in the roots of one tooth on its way through the mesh, beside the nominal stress of "
        "ISO 6336-3.",
    ),
    (
        "root_profile",
        "Stresses",
        "Stress along the roots of the tooth when its tension is largest; dotted the section of ISO 6336-3, "
        "where the tangent stands at 30° (internal gears 60°) to the centreline of the tooth.",
    ),
    (
        "planet_bending",
        "Stresses",
        "Roots of a planet's tooth while the planet turns once against the carrier: the sun bends it one "
        "way, the ring the other.",
    ),
    (
        "mode_shapes",
        "Modes",
        "Mode shapes with mean mesh stiffness: bodies with a mark of their rotation, and the outer "
        "surface of the ring; at rest in grey.",
    ),
    (
        "spatial_mode_shapes",
        "Modes",
        "Mode shapes of the helical set with mean mesh stiffness, from the front and, below, from the side, "
        "where bodies tilt and move along the axis. Motions of the side view are drawn at the scale of the "
        "front view times the factor given. At rest in grey.",
    ),
    (
        "mesh_phasing",
        "Modes",
        "Phases of sun and ring meshes at every planet for the first harmonics of the mesh frequency, and "
        "what is left of equal mesh forces on sun and ring: what cancels excites no mode of that kind.",
    ),
    (
        "helical_mesh_stiffness",
        "Static",
        "Stiffness and static transmission error of the meshes of planet 1 along the transverse line of "
        "action, centres fixed: of the helical meshes (solid), and of the spur gears of the transverse "
        "section (dotted) that the slices come from.",
    ),
    (
        "natural_frequencies",
        "Modes",
        "Natural frequencies over the nodal diameters of the ring.",
    ),
    (
        "ring_mode",
        "Modes",
        "A mode of the toothed ring on its foundation, on the finite-element grid.",
    ),
    (
        "dynamic_transmission_error",
        "Dynamics",
        "Dynamic transmission error over one mesh period (thick) beside the static one of the set on its "
        "supports, both without their mean. The thin static curve has the harmonics of the excitation alone: "
        "what rings in both curves "
        "is the cut series, not vibration. Pale: the whole static curve.",
    ),
    (
        "dynamic_spectrum",
        "Dynamics",
        "Harmonics of the dynamic transmission error, down to five decades below the largest.",
    ),
    (
        "speed_sweep",
        "Dynamics",
        "Fluctuation of the transmission error over the speed, and the verdicts on the solution: the "
        "fixed point contracts below 1, the motion is stable up to 1.",
    ),
    (
        "mesh_force_spectra",
        "Dynamics",
        "Mesh forces of planet 1 along the tooth normals over the frequency of each harmonic, h times the "
        "mesh frequency. Marks along the axis are natural frequencies by the phasing of the mode: a harmonic "
        "meets modes of its own phasing.",
    ),
    (
        "ring_static_deflection",
        "Dynamics",
        "Mean radial deflection of the ring's outer surface, which turns with the carrier.",
    ),
    (
        "operating_deflection",
        "Dynamics",
        "Operating deflection of the ring, without its mean, during one revolution of the carrier. Every "
        "frame is a true instant; the meshes appear slowed down as under a stroboscope.",
    ),
    (
        "housing_signal",
        "Housing",
        "Acceleration at the fixed sensor during one carrier revolution: all orders with the largest and the "
        "smallest value within a mesh period, and the band around a mesh harmonic with its envelope and "
        "lobes ({}).",
    ),
    (
        "order_spectrum",
        "Housing",
        "Carrier orders at the fixed sensor ({}): a wave of n nodal diameters at mesh harmonic h is heard"
        " at order h z − n, z the teeth of the ring, when the carrier turns counter-clockwise.",
    ),
    (
        "modulation",
        "Housing",
        "Envelope around a mesh harmonic over the angle of the carrier ({}).",
    ),
    (
        "stiffness_series",
        "Modes",
        "Mesh stiffness over the mesh period as the model takes it: a Fourier series, and the rectangular "
        "wave of the number of tooth pairs in contact that it stands for.",
    ),
    (
        "campbell",
        "Modes",
        "Natural frequencies over the speed of the first body, with gyroscopic terms and mean mesh "
        "stiffness, and the mesh frequencies.",
    ),
    (
        "drivetrain_mode",
        "Modes",
        "Mode shape of the drivetrain ({}), by the number in the table, where the free spin is the first; "
        "magnified, at rest in grey. The rays show how far each wheel turns. Shafts are drawn as bent "
        "beams between the places that the model knows. The drawing is a scheme: bodies without "
        "gears have a radius that is not theirs.",
    ),
    (
        "transient_speeds",
        "Transient",
        "Speed of the first and of the last body, low-passed to the rate of the records. Where the records "
        "are denser than the pixels, the band of their values is drawn.",
    ),
    (
        "transient_deviations",
        "Transient",
        "Rotation of the bodies less that of the free spin, which is the motion of the rigid chain under the "
        "same torques; low-passed to the rate of the records. Bands: least to largest record.",
    ),
    (
        "transient_forces",
        "Transient",
        "Mesh forces along the lines of action, low-passed to the rate of the records: peaks that are "
        "shorter are higher than here, the least and the largest force of all steps stand in the table. "
        "Bands: least to largest record.",
    ),
    (
        "mesh_force_spectrum",
        "Spectrum",
        "Amplitude spectra of mesh forces after the start: segments under Hann's window that overlap by "
        "half, root of the mean square, peak values. Dotted: mesh frequencies and their second and third "
        "harmonics at the mean speed. Where the speed changes, which the title tells, lines smear over "
        "frequency; over orders they do not.",
    ),
    (
        "side_bands",
        "Spectrum",
        "Mesh force around a mesh line over orders of the first body, in one segment ({}); a change of the "
        "speed does not smear them. Dotted: distances of the carrier's turn, or of the mesh line of the "
        "planetary stage.",
    ),
    (
        "weight_response",
        "Response to the weight",
        "Displacement of carrier, ring and sun over the frequency of the weight in the carrier frame, r.m.s. "
        "about the mean. Circles: limit points, those that corners of the tooth contact split drawn as one.",
    ),
    (
        "carrier_orbit",
        "Response to the weight",
        "Path of the carrier's centre in the carrier frame during one turn of the weight against it, at the "
        "responses that the legend names.",
    ),
    (
        "planet_bearing_forces",
        "Response to the weight",
        "Force between every planet and its pin during one turn of the weight against the carrier, at the "
        "response that the title names.",
    ),
    (
        "wedged_teeth",
        "Response to the weight",
        "Forces of both flanks of the meshes of planet 1 during one turn of the weight, at the response that "
        "the title names. Where both flanks of a mesh carry at once its teeth are wedged.",
    ),
    (
        "tooth_contact",
        "Response to the weight",
        "State of both flanks of the meshes of planet 1 over the frequency of the weight: 1 in contact all "
        "the time, 0 never.",
    ),
    (
        "response_orbit",
        "Weight and mesh frequency",
        "Paths of the centres of carrier, ring and sun in the carrier frame during one turn of the "
        "carrier ({}).",
    ),
    (
        "response_bearing_forces",
        "Weight and mesh frequency",
        "Force between every planet and its pin during one turn of the carrier ({}).",
    ),
    (
        "response_mesh_forces",
        "Weight and mesh frequency",
        "Mesh forces of planet 1 during one turn of the carrier ({}), and during six mesh periods where the "
        "mesh stiffness varies. They are drawn from their lines.",
    ),
    (
        "response_spectrum",
        "Weight and mesh frequency",
        "Lines of a mesh force and of the carrier's displacement ({}): multiples of the weight's frequency, "
        "and of the mesh frequency with their side bands where the mesh stiffness varies.",
    ),
    (
        "contact_over_speed",
        "Weight and mesh frequency",
        "State of both flanks of the meshes of planet 1 over the speed: 1 in contact all the time, 0 never.",
    ),
)
SECTIONS = (
    "Static",
    "Stresses",
    "Modes",
    "Dynamics",
    "Housing",
    "Response to the weight",
    "Weight and mesh frequency",
    "Transient",
    "Spectrum",
    "Other pictures",
)


def caption_of(stem: str) -> tuple[int, str, str]:
    """Place in the order, section and caption of a picture from its file name."""
    for rank, (prefix, section, caption) in enumerate(CAPTIONS):
        if stem == prefix or stem.startswith(prefix + "_"):
            what = stem[len(prefix) :].strip("_").replace("_", " ")
            return rank, section, caption.replace(" ({})", f" ({what})" if what else "")
    return len(CAPTIONS), "Other pictures", re.sub("[_-]+", " ", stem)


_BY_STABILITY = ("weight_response", "tooth_contact")
_OF_RESPONSE = (
    "response_orbit", "response_bearing_forces", "response_mesh_forces", "response_spectrum",
    "contact_over_speed",
)  # fmt: skip
_OF_SPUR_TEETH = ("static_transmission_error", "mesh_stiffness", "load_sharing", "tooth_loads")


def comparisons(case: Case | DrivetrainCase, stem: str) -> Iterator[str]:
    """What the case file adds to a caption: how to read the picture of this case, and published ones."""
    planar = case.planar
    if stem == "transient_forces":
        yield _contact(case)
    if case.helical is not None and stem in _OF_SPUR_TEETH:
        yield "Transverse spur section: these are spur gears of that section, not yet the helical ones."
    if planar is not None and stem in _BY_STABILITY and planar.branch is not None:
        yield (
            "Drawn through: stable by Floquet's theory; dashed: not stable; dotted: not known."
            if planar.branch.stability
            else "Stability was not computed: everything is drawn through."
        )
    if planar is not None and planar.mesh_stiffness is not None and stem.startswith(_OF_RESPONSE):
        yield "The mesh stiffness of this case is constant: the weight alone varies, at no mesh frequency."
    for entry in case.planar.published if case.planar is not None else ():
        if entry.figure is not None and (stem == entry.figure or stem.startswith(f"{entry.figure}_")):
            yield f"Beside {entry.source}: {entry.comparison}"


_OF_BRANCH = ("weight_response", "carrier_orbit", "planet_bearing_forces", "wedged_teeth", "tooth_contact")
# figures that show displacements alone, without forces or contact
_OF_MOTION = ("weight_response", "carrier_orbit", "response_orbit")


def doubts(results: Results, stem: str) -> Iterator[str]:
    """What the results of a planar case say against a picture, for its caption."""
    from femgear.models.planar_response import TAIL_LIMIT

    stage = "branch" if stem in _OF_BRANCH else "response" if stem.startswith(_OF_RESPONSE) else None
    if stage is None or results.case.planar is None or stage not in results.stages:
        return
    data = results.stage(stage)
    motion, force = (float(data[name].max()) for name in ("tail", "force_tail"))
    tail = motion if stem.startswith(_OF_MOTION) else max(motion, force)
    if tail > TAIL_LIMIT:
        yield (
            f"Marked where more than {TAIL_LIMIT:.0%} of the amplitude lies in the upper half of the "
            f"harmonics (up to {tail:.2g}): shapes and peaks there are not to be trusted (W-TAIL)."
        )


def _contact(case: DrivetrainCase) -> str:
    """What a force without its usual sign means."""
    if case.simulation.contact_loss:
        return "Zero: the teeth are apart; negative: their back flanks touch."
    return "Negative: the mesh is linear and pulls; real teeth would part."
