"""Where every picture of a run stands in the report, and what is said under it."""

from __future__ import annotations

import re

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
        "Mesh stiffness over one mesh period: tangent dF/dδ of the loaded mesh (solid) and secant F/δ "
        "(dotted).",
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
        "Dynamic transmission error over one mesh period, beside the static one; both without their mean.",
    ),
    (
        "dynamic_spectrum",
        "Dynamics",
        "Harmonics of the dynamic transmission error.",
    ),
    (
        "speed_sweep",
        "Dynamics",
        "Fluctuation of the transmission error over the speed, and the verdicts on the solution: the "
        "fixed point contracts below 1, the motion is stable below 1.",
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
        "Acceleration at the fixed sensor during one carrier revolution: all orders, and the band around "
        "a mesh harmonic with its envelope and lobes ({}).",
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
)
SECTIONS = ("Static", "Stresses", "Modes", "Dynamics", "Housing", "Other pictures")


def caption_of(stem: str) -> tuple[int, str, str]:
    """Place in the order, section and caption of a picture from its file name."""
    for rank, (prefix, section, caption) in enumerate(CAPTIONS):
        if stem == prefix or stem.startswith(prefix + "_"):
            what = stem[len(prefix) :].strip("_").replace("_", " ")
            return rank, section, caption.replace(" ({})", f" ({what})" if what else "")
    return len(CAPTIONS), "Other pictures", re.sub("[_-]+", " ", stem)
