"""The themes of docs/validation.csv, in their order.

A row is added in a function without arguments that returns rows, named here under the parts of a theme, or
under its slow parts when it takes more than a few seconds.
"""

from __future__ import annotations

from validation import (
    calculix_casing,
    calculix_rows,
    calculix_solid,
    contact,
    drivetrain,
    dynamics,
    elasticity,
    face_width,
    fixed_housing,
    geometry,
    helical,
    helical_pair,
    helical_teeth,
    housing,
    impacts,
    integration,
    levels,
    members,
    modulation,
    moving_force,
    multistage,
    nonlinear,
    nonlinear_tones,
    nrel,
    pairs,
    parametric,
    parametric_routes,
    planar,
    planetary,
    rims,
    ring,
    routes,
    sharing,
    sound,
    standard,
    static,
    stress,
    support_stiffness,
    torque_rotation,
    turning,
    two_body,
    vibration,
)
from validation.run import Theme

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
        (
            standard.single_pairs,
            standard.nrel_stiffness,
            standard.helical_stiffness,
            standard.form_circles,
        ),
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
        "pairs",
        "Gear pairs",
        "Negative tooth numbers are internal gears, shifts positive where they move the flank outwards. "
        "Bodies are held 8 modules beyond their roots, small ones at 0.4 of the reference radius: the "
        "standard's solid disc has no twist between teeth and hub. Whole bodies: all teeth in one plane "
        "grid, held at the bore. Helical pairs: module and shifts of the normal section. Rows *finite*: both "
        "gears solid over their face width, half as fine as in plane contact, contacts on the path alone.",
        (),
        (pairs.iso_stiffness, pairs.whole_bodies, helical_pair.finite_width),
    ),
    Theme(
        "CalculiX",
        "CalculiX",
        "Another finite-element program, where it is installed (`ccx`; Debian: calculix-ccx). Pairs: whole "
        "gears in contact at 200 N m, 20 mm wide, positions in mesh periods; the body of an internal gear is "
        "in plane stress, as in femgear, all else in plane strain. Contact is a penalty of 1 GPa at 10 nm, "
        "elements there are 15 um long; rows *settings* have ten times the one and half the other. Rows "
        "*width*: straight teeth as solids between mirror planes, one flank with a slope. "
        "The ring is that of the reference set on its foundation and on feet of 20 mm, all teeth in a grid. "
        "The casing is meshed anew from its geometry.",
        (),
        (
            calculix_rows.external_pair,
            calculix_rows.internal_pair,
            calculix_rows.settings,
            calculix_solid.face_load,
            calculix_rows.ring_on_feet,
            calculix_casing.casing_example,
        ),
    ),
    Theme(
        "static",
        "Static solution of the reference set",
        "27/40/108, 100 N m at the sun, 64 positions. The convergence rows compare the case as it stands "
        "with one numerical parameter changed. Their gates come from what the results are for: 1 % of the "
        "mean mesh stiffness moves a natural frequency by 0.5 %, a twentieth of the half-power width at 5 % "
        "damping, and 3 % of the transmission error is 0.26 dB of the excitation. The depth at which half "
        "plane and elements are joined goes from two half widths of the contact, a third of the default, up "
        "to what fits into a tooth, three times the default.",
        (static.equilibrium, static.iso_stiffness, static.planet_gaps, static.some_random_problems),
        (static.numerical_parameters, static.element_size, static.random_problems),
    ),
    Theme(
        "face width",
        "Contact over the face width",
        "Slices over the width, joined by waves of the bodies between mirror planes; sets are 27/40/108. "
        "Rows *solid*, *ends* and *root*: a sector in three dimensions, section coordinates turning with the "
        "teeth, all teeth by cyclic symmetry. Rows *helix*: endless gears of 30/20/70 teeth, m_n 1.6 mm, as "
        "in docs/helical.md. Love's patch and Hertz's ellipse have no rows: femgear has no contact of "
        "points.",
        (
            face_width.springs,
            face_width.half_space,
            face_width.cosine_transform,
            face_width.cantilever_plate,
        ),
        (
            face_width.solid_elements,
            face_width.ends_of_teeth,
            face_width.root_stresses,
            face_width.whole_sets,
            face_width.refinement,
            helical_teeth.factors,
            helical_teeth.refined,
            helical_teeth.root_stresses,
        ),
    ),
    Theme(
        "members",
        "Relief, errors and moving members",
        "The same set with tip relief, pin errors, a floating sun, planet bearings and reversed torque.",
        (members.sharing, members.relief, members.rigid_relief),
    ),
    Theme(
        "sharing",
        "Load sharing under pin errors",
        "Meshes of 5e8 N/m and pressure angles of 24.6 degrees, as in the set of Lin and Parker (1999); "
        "separations, supports and solution are those of the contact problem.",
        (sharing.pin_errors, sharing.lumped_sets),
    ),
    Theme(
        "stress",
        "Stresses of teeth",
        "",
        (stress.nominal_flanks, stress.nominal_roots, stress.nominal_helical_flanks, stress.hertz_of_teeth),
        (stress.root_against_whole_gear, stress.sharp_root_over_grids, stress.roots_of_high_contact_ratio),
    ),
    Theme(
        "rims",
        "Elastic rims",
        "27/40/108 with elastic members, 100 N m and a pin error; the ring on its foundation has a rim of "
        "one module under the root. Tooth loads are those of the contact solution, spread over half a "
        "module of flank. Differences are relative to the largest displacement.",
        (rims.sharing_with_a_thin_rim,),
        (rims.thin_ring, rims.planet_between_its_meshes),
    ),
    Theme(
        "ring",
        "Vibration of the ring",
        "One sector of 108 by cyclic reduction, free, teeth in plane strain and rim in plane stress where "
        "nothing else is said. The annulus of the root circle is another body than the toothed ring and only "
        "information beside it; what gates the ring with teeth has all its teeth in a grid of its own. Rows "
        "*turning*: the reference set, and its ring alone on the foundation, with the gyroscopic and "
        "convective terms of the carrier frame. In that frame the equations do not change with time, so that "
        "natural frequencies exist; the ring is fixed in the housing.",
        (ring.plain_annulus, ring.toothed_ring, ring.other_outline, ring.turning_carrier),
        (ring.whole_ring,),
    ),
    Theme(
        "two routes",
        "Two routes to the mesh stiffness",
        "Sun-planet and planet-ring of 27/40/108, each alone, 100/3 N m at the sun.",
        (torque_rotation.same_depth,),
        (
            torque_rotation.all_positions,
            torque_rotation.planet_and_ring,
            torque_rotation.tip_corners,
            torque_rotation.other_treatments,
        ),
    ),
    Theme(
        "support",
        "Support stiffness",
        "K = F/X, one face coupled to a centre node.",
        (support_stiffness.annuli,),
        (support_stiffness.shafts,),
    ),
    Theme(
        "moving",
        "A ring under moving mesh forces",
        "Errors relative to the motion.",
        (),
        (moving_force.table,),
    ),
    Theme(
        "lumped set",
        "Lumped planetary set",
        "",
        (
            planar.frequencies,
            planar.structure,
            planar.torsional,
            planar.load_sharing,
            planar.closed_form,
            planar.balance,
            planar.wind_turbine,
        ),
    ),
    Theme(
        "helical",
        "Helical planetary set",
        "Forces act at the base circles, as in the paper, where nothing else is said.",
        (
            helical.table_4,
            helical.rigid,
            helical.table_2,
            helical.table_1,
            helical.leakage,
            helical.response,
        ),
    ),
    Theme(
        "multistage",
        "Planetary stages in series",
        "",
        (
            multistage.ratios,
            multistage.uncoupled,
            multistage.structure,
            multistage.soft_shaft,
            multistage.response,
            multistage.published,
        ),
    ),
    Theme(
        "drivetrain",
        "Wind turbine drivetrain",
        "",
        (
            drivetrain.shafts,
            drivetrain.shaft_joints,
            drivetrain.kinematics,
            drivetrain.shifted_planets,
            drivetrain.base_line,
            drivetrain.stiffness,
            drivetrain.reductions,
            drivetrain.balances,
            drivetrain.torques,
            drivetrain.growth,
            drivetrain.contact_loss,
        ),
        (drivetrain.minute,),
    ),
    Theme(
        "wind turbine sets",
        "Planetary sets of two wind turbines",
        "NREL/CP-5000-55355; what every reading of its tables gives stands in docs/nrel.md.",
        (nrel.frequencies, nrel.linear_peak),
        slow_parts=(
            nrel.ring_resonance,
            nrel.ring_motion,
            nrel.wedging,
            nrel.folds,
            nrel.small_plays,
            nrel.sun_support,
            nrel.extended,
            nrel.weight_against_stiffness,
        ),
    ),
    Theme(
        "dynamics",
        "Dynamic response of the reference set",
        "6 mesh harmonics of the excitation, 5 % modal damping. Differences are those of the mesh deflections.",
        (dynamics.fixed_point, dynamics.harmonics_kept, dynamics.modes_kept, dynamics.time_integration),
        (dynamics.more_time_integration, turning.time_integration, turning.standstill),
    ),
    Theme(
        "levels",
        "Dynamic model at rest, and level of the housing",
        "Default settings: the excitation reaches as far as each row says. Beside the reference set one out "
        "of phase and one with two opposite pairs of planets.",
        (),
        (levels.at_rest, levels.more_torque, levels.reach),
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
            parametric_routes.mathieu_verdicts,
            parametric_routes.meissner_verdicts,
            parametric_routes.rectangular_bands,
            parametric_routes.verdict_against_fixed_point,
        ),
        (parametric_routes.mathieu_boundaries,),
    ),
    Theme(
        "nonlinear vibration",
        "Nonlinear vibration",
        "H2 is example 1 of NLvib: x'' + 0.05 x' + x + 0.1 x^3 = 0.18 cos(Omega t).",
        (
            nonlinear.free_duffing,
            nonlinear.limit_points,
            nonlinear.three_motions,
            nonlinear.dead_zone,
            nonlinear.stops,
            nonlinear.truss,
            nonlinear.manufactured,
            nonlinear_tones.two_tones,
            nonlinear_tones.one_tone,
            nonlinear_tones.other_package,
        ),
        (integration.sweeps,),
    ),
    Theme(
        "impacts",
        "Impacts and chaos",
        "",
        (impacts.one_term_balance,),
        (impacts.linear_exponents, impacts.damping_and_impacts, impacts.period_two, impacts.chaos),
    ),
    Theme(
        "time integration",
        "Time integration",
        "Periods, limits and orders are measured on marched steps. I1 and I2: free vibration without "
        "damping; I3: x'' + 0.1 x' + 4 x = cos 3t from (1, 0), at t = 10.",
        (
            integration.period_errors,
            integration.stability_limits,
            integration.order,
            integration.energy,
        ),
    ),
    Theme(
        "three routes",
        "One motion by three routes",
        "Harmonic balance, shooting and adaptive integration of the same equations; differences of the "
        "lines of all mesh deflections over the largest line that fluctuates. Integration starts at rest, in "
        "(a) at the motion of one harmonic; the short one of (c) starts at the balanced motion. (c) is the "
        "set of Lin and Parker with 3 planets, 300 N m, 5 % damping, mesh stiffnesses with three harmonics "
        "and 20 um of backlash.",
        (routes.duffing_routes, routes.pair_routes, routes.train_routes),
        (routes.pair_routes_on_both_flanks, routes.train_from_rest),
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
    Theme(
        "housing",
        "Modulated signal of the reference set",
        "Radial acceleration at a fixed point of the ring's outer surface; lobes are maxima of the envelope "
        "with a prominence above a tenth of its largest value. The paper's pair of lines 645/649 at the 6th "
        "mesh harmonic cannot come from identical planets on a symmetric ring: only orders that are "
        "multiples of the number of planets are left, and 649 is none.",
        (
            housing.symmetry,
            housing.first_harmonic,
            housing.unit_forces,
            housing.interpolation,
            housing.higher_harmonics,
            housing.resonances,
        ),
        (turning.orders,),
    ),
    Theme(
        "fixed_housing",
        "Fixed housing",
        "A ring on supports has no symmetry: forces and motions act both ways in orders of the carrier. The "
        "ring of these rows is thin and inextensional (206 GPa, 7850 kg/m3, radius 100 mm, 25 mm x 10 mm), "
        "the set in it a sun in springs and planets on fixed pins. Routes in time and by samples of a turn "
        "share no equation with the solution.",
        (
            fixed_housing.splitting,
            fixed_housing.yielding,
            fixed_housing.order_rules,
            fixed_housing.array_factors,
            fixed_housing.turning_errors,
            fixed_housing.axisymmetric,
            fixed_housing.green,
        ),
        (
            fixed_housing.in_time,
            fixed_housing.multipliers,
            fixed_housing.by_samples,
            fixed_housing.reference_set_in_its_ring,
            fixed_housing.reference_set_on_supports,
        ),
    ),
    Theme(
        "sound",
        "Sound of the housing",
        "The housing radiates as a ring in a rigid, endless cylinder; air of 1.204 kg/m3 and 343 m/s.",
        (
            sound.efficiency,
            sound.side_bands,
            sound.power,
            sound.equivalent,
            sound.weighting,
            sound.signals,
            sound.loudness,
        ),
        (sound.short_ring,),
    ),
)
