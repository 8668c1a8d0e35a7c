"""The tables of docs/validation.md, in their order."""

from __future__ import annotations

from femgear.validation import contact, elasticity, geometry, modulation, planetary, vibration
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
        "Finite elements as above; the closed form of the annulus is the one that the toothed ring is compared with.",
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
    ),
    Theme(
        "modulation",
        "Modulation by the carrier",
        "Orders are carrier orders; a ring pattern of n nodal diameters at mesh harmonic h is heard at order h z_ring - n.",
        (
            modulation.modulated_carriers,
            modulation.planet_passage,
            modulation.moving_sensor,
            modulation.linear_interpolation,
            modulation.lobes,
        ),
    ),
)
