"""The tables of docs/validation.md, in their order.

A row is added in a function without arguments that returns rows, named here under the parts of a theme, or
under its slow parts when it takes more than a few seconds.
"""

from __future__ import annotations

from femgear.validation import (
    contact,
    elasticity,
    geometry,
    modulation,
    parametric,
    planetary,
    standard,
    two_body,
    vibration,
)
from femgear.validation.run import Theme

THEMES = (
    Theme(
        "geometry",
        "Gear geometry",
        "Profile shifts of internal gears are positive when they move the flank outwards. D2, D3 and D4 take "
        "teeth with an addendum of one module.",
        (
            geometry.involute_function,
            geometry.external_pairs,
            geometry.internal_pairs,
            geometry.limits,
            geometry.internal_interference,
            geometry.helical,
        ),
    ),
    Theme(
        "planetary sets",
        "Planetary sets",
        "",
        (planetary.reference_geometry, planetary.nrel_report, planetary.assembly),
    ),
    Theme(
        "ISO 6336",
        "Mesh stiffness of ISO 6336-1",
        "Method B, which the computed mesh stiffness is compared with.",
        (standard.single_pairs, standard.nrel_stiffness),
    ),
    Theme(
        "elasticity",
        "Plane elasticity",
        "Structured grids of second-order triangles with the assembly that the gears use.",
        (
            elasticity.patch_test,
            elasticity.manufactured_solution,
            elasticity.elliptic_membrane,
            elasticity.thick_cylinder,
            elasticity.ring_under_pressure,
            elasticity.curved_bar,
            elasticity.pinched_ring,
            elasticity.invariances,
        ),
    ),
    Theme(
        "vibration",
        "Plane vibration",
        "Finite elements as above, and the closed form of the annulus that rings are compared with.",
        (
            vibration.tapered_membrane,
            vibration.annulus,
            vibration.lame_modes,
            vibration.thick_ring,
            vibration.thin_limit,
        ),
    ),
    Theme(
        "contact",
        "Contact",
        "",
        (
            contact.closed_forms,
            contact.pressure_cells,
            contact.depth_reference,
            contact.springs_with_gap,
        ),
        (two_body.tooth_pairs, two_body.tip_contact),
    ),
    Theme(
        "stability",
        "Parametric stability",
        "G5 and G6: one gear pair of unit mass, contact ratio 1.635, mesh stiffness 1 and 0.65.",
        (
            parametric.mathieu,
            parametric.meissner,
            parametric.rectangular_stiffness,
            parametric.fixed_point,
        ),
    ),
    Theme(
        "modulation",
        "Modulation by the carrier",
        "Orders are carrier orders; a ring pattern of n nodal diameters at mesh harmonic h is heard at order "
        "h z_ring - n.",
        (
            modulation.modulated_carriers,
            modulation.planet_passage,
            modulation.moving_sensor,
            modulation.linear_interpolation,
            modulation.lobes,
        ),
    ),
)
