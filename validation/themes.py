"""The themes of docs/validation.csv, in their order.

A row is added in a function without arguments that returns rows, named here under the parts of a theme, or
under its slow parts when it takes more than a few seconds.
"""

from __future__ import annotations

from validation import (
    axle_casing,
    bearings,
    bending_planets,
    calculix_carrier,
    calculix_casing,
    calculix_cracks,
    calculix_rows,
    calculix_shafts,
    calculix_solid,
    casings,
    chain_in_casing,
    contact,
    drawing,
    drivetrain,
    dynamics,
    elasticity,
    face_width,
    fault_data_sets,
    fault_orders,
    faults,
    fixed_housing,
    friction,
    gearbox,
    gearbox_carriers,
    gearbox_cross,
    gearbox_friction,
    gearbox_images,
    gearbox_in_time,
    gearbox_nonlinear,
    gearbox_planets,
    gearbox_power,
    gearbox_response,
    gearbox_rings,
    gearbox_statics,
    geometry,
    heat,
    helical,
    helical_pair,
    helical_teeth,
    housing,
    impacts,
    integration,
    levels,
    life,
    losses,
    members,
    modulation,
    moving_force,
    multistage,
    nonlinear,
    nonlinear_tones,
    nrel,
    one_system,
    other_programs,
    pairs,
    parametric,
    parametric_routes,
    planar,
    planetary,
    power_flow,
    recordings,
    rims,
    ring,
    routes,
    shafts,
    sharing,
    sound,
    standard,
    static,
    strength,
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
        "teeth with an addendum of one module. Compared with: closed forms in extended precision; gates: printed "
        "digits.",
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
        "drawing",
        "Measures of drawings",
        "Gears of a normal module of 3 mm; internal gears have negative tooth numbers, their shifts are positive where "
        "they move the flank outwards. Rows of the profile: points of the flanks, on planes and on a ball that touch "
        "them, found without a formula. Compared with: closed forms by hand; the generated profile; DIN 3967; gates: "
        "1e-12; 1e-9; printed digits.",
        (
            drawing.textbook,
            drawing.another_program,
            drawing.helical_by_section,
            drawing.on_the_profile,
            drawing.shortened_tips,
            drawing.there_and_back,
            drawing.fits,
        ),
    ),
    Theme(
        "planetary sets",
        "Planetary sets",
        "Compared with: published gear report of the NREL 5 MW gearbox; 27/40/108: 22.1995°, 20.0000°, 1.5507, "
        "1.9301; gates: printed digits.",
        (planetary.reference_geometry, planetary.nrel_report, planetary.assembly),
    ),
    Theme(
        "power_flow",
        "Power flow",
        "Graphs of shafts, pairs and planetary sets without losses; speeds, torques and power are compared in "
        "fractions. Compared with: Willis' table, closed forms of Simpson, Ravigneaux, Lepelletier and Wolfrom sets, "
        "printed ratios of transmissions, power and torque balance; gates: exact; 1e-15; printed digits.",
        (power_flow.ratios, power_flow.refusals, power_flow.frequencies),
    ),
    Theme(
        "gearbox_planets",
        "Planets of any kind",
        "Planets that are shafts of their own. Compared with: places by trial of all teeth in random sets, speeds by "
        "the teeth that pass, planetary stages, springs set up by hand, symmetry of lines, time integration in axes at "
        "rest; gates: exact; 1e-12 of linear statics, 1e-10, 1e-9; 1e-6 of a sun that all but floats and in time.",
        (
            gearbox_planets.places,
            gearbox_planets.kinematics,
            gearbox_planets.simple_planets,
            gearbox_planets.parting_planets,
            gearbox_planets.stepped_planets,
            gearbox_planets.planet_errors,
            gearbox_planets.symmetric_lines,
        ),
        (bending_planets.bending_planets, bending_planets.bending_in_time),
    ),
    Theme(
        "losses",
        "Losses",
        "Loss factors, coefficients of friction and efficiencies. Rows *C14*, *A* and *H501* are FZG test gears. "
        "Compared with: reports of GEARpie, closed forms, sums over the path; gates: printed digits; 5 % between loads "
        "of finite elements and those of a formula; 1e-9 for balances of powers. Rows with *mu 0.06*: friction that "
        "acts, beside closed forms and time integration; gates: 1e-12, 1e-9, 1e-6, 5 % of what is of the first order.",
        (losses.fzg_gears, losses.sets, losses.computed_loads),
        (losses.gearbox, friction.friction_of_a_pair, friction.friction_of_sets),
    ),
    Theme(
        "heat",
        "Contact temperatures and oil film",
        "Flash temperature, scuffing and film of the FZG test gear C14. Compared with: Duhamel's integral, the closed "
        "form of ISO/TS 6336-20, reports of GEARpie; gates: 0.5 %; printed digits; 30 % between the bulk temperatures "
        "of both standards.",
        (heat.closed_forms, heat.whole_run),
    ),
    Theme(
        "ISO 6336",
        "Mesh stiffness of ISO 6336-1",
        "Method B of the standard, with which the computed mesh stiffness is compared; gates: 15 %.",
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
        "Structured grids of second-order triangles with the assembly that the gears use. Compared with: patch "
        "test, NAFEMS LE1 (92.7 MPa), Lamé cylinder, pinched ring; gates: 1e-11; printed digits.",
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
        "Finite elements as above, and the closed form of the annulus that rings are compared with. Compared "
        "with: NAFEMS free vibration, exact annulus, thick and thin rings; gates: source by source.",
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
        "Compared with: Hertz, half plane with pressure cells, springs with a gap; one tooth pair against a fully "
        "resolved two-body solution; gates: order 2 in the peak pressure; 1 %.",
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
        "Another finite-element program, where it is installed (`ccx`; Debian: calculix-ccx). Pairs: whole gears "
        "in contact at 200 N m, 20 mm wide, positions in mesh periods; the body of an internal gear is in plane "
        "stress, as in femgear, all else in plane strain. Contact is a penalty of 1 GPa at 10 nm, elements there "
        "are 15 um long; rows *settings* have ten times the one and half the other. Rows *width*: straight teeth "
        "as solids between mirror planes, one flank with a slope. The ring is that of the reference set on its "
        "foundation and on feet of 20 mm, all teeth in a grid. The casing is meshed anew from its geometry. "
        "Compared with: where `ccx` is installed (Debian: calculix-ccx): an external and an internal pair as "
        "whole gears in contact at eight positions, straight teeth as solids under a lead slope, ring on feet, "
        "the casing example; gates: 0.2 % of transmission error, tangent stiffness and frequencies; 2 % of "
        "pressure and root stress; 1 % of both meshes of a stepped planet; 0.5 % of K_Hβ and of the casing's "
        "frequencies; positions where a tip corner carries differ by up to 0.8 % in transmission error and 1.8 % in "
        "stiffness.",
        (),
        (
            calculix_rows.external_pair,
            calculix_rows.internal_pair,
            calculix_rows.stepped_set,
            calculix_rows.settings,
            calculix_cracks.cracked_pair,
            calculix_solid.face_load,
            calculix_rows.ring_on_feet,
            calculix_casing.casing_example,
        ),
    ),
    Theme(
        "static",
        "Static solution of the reference set",
        "27/40/108, 100 N m at the sun, 64 positions. The convergence rows compare the case as it stands with one "
        "numerical parameter changed. Their gates come from what the results are for: 1 % of the mean mesh "
        "stiffness moves a natural frequency by 0.5 %, a twentieth of the half-power width at 5 % damping, and 3 "
        "% of the transmission error is 0.26 dB of the excitation. The depth at which half plane and elements are "
        "joined goes from two half widths of the contact, a third of the default, up to what fits into a tooth, "
        "three times the default. Compared with: equilibrium and complementarity; daqp on random problems; closed "
        "form of the load sharing; gates: 1e-9. Element size and depth: the same case, refined; gates: 1 % of k, "
        "3 % of the transmission error. Peaks between 8 to 64 positions of a mesh period: 512 equidistant "
        "positions, in and out of phase, three to six planets, either torque; gates: 2 % of peaks to peaks, 3 % "
        "with tip relief; 0.5 % of means, 2 % of pressures, 1.5 % of root stresses.",
        (static.equilibrium, static.iso_stiffness, static.planet_gaps, static.some_random_problems),
        (static.numerical_parameters, static.element_size, static.random_problems),
    ),
    Theme(
        "face width",
        "Contact over the face width",
        "Slices over the width, joined by waves of the bodies between mirror planes; sets are 27/40/108. Rows "
        "*solid*, *ends* and *root*: a sector in three dimensions, section coordinates turning with the teeth, "
        "all teeth by cyclic symmetry. Rows *helix*: endless gears of 30/20/70 teeth, m_n 1.6 mm, as in "
        "docs/helical.md. Love's patch and Hertz's ellipse have no rows: femgear has no contact of points. "
        "Compared with: springs of ISO 6336-1, half space, plate strip; teeth in three dimensions, straight and "
        "helical; refinement; gates: printed digits; 1e-9; 0.5 %; 1 %.",
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
        "separations, supports and solution are those of the contact problem. Compared with: closed form, springs "
        "between points; gates: 1e-6; 1e-9.",
        (sharing.pin_errors, sharing.lumped_sets),
    ),
    Theme(
        "stress",
        "Stresses of teeth",
        "Compared with: KISSsoft report, Hertz, whole gear in finite elements; gates: printed digits; 1 %; 2 %.",
        (stress.nominal_flanks, stress.nominal_roots, stress.nominal_helical_flanks, stress.hertz_of_teeth),
        (stress.root_against_whole_gear, stress.sharp_root_over_grids, stress.roots_of_high_contact_ratio),
    ),
    Theme(
        "strength",
        "Strength of ISO 6336",
        "Nominal stresses, load factors and tolerances by the edition that the reference has: 2006, where no other is "
        "named. Compared with: KISSsoft reports, ISO/TR 6336-30, FZG test gears, ISO 1328-1; gates: 0.5 %; printed "
        "digits.",
        (
            strength.report_of_stage_1,
            strength.single_contact_of_stage_1,
            strength.report_of_stage_3,
            strength.technical_report,
            strength.fzg_gears,
            strength.helical_fzg_gear,
            strength.face_factors,
            strength.life_lines_of_a_program,
            strength.edition_of_2019,
            strength.tolerances,
            strength.life_factors,
            strength.materials,
        ),
    ),
    Theme(
        "life",
        "Life over load cases (ISO 6336-6)",
        "Damage sums of roots and flanks, load cycles against the carrier, safeties of spectra. Gears are of case "
        "hardened steel where no other is named; contacts of load cases are solved. Compared with: figures and sums by "
        "hand, KISSsoft report, single runs; gates: printed digits; 1e-12; 1e-9 of safeties that are iterated.",
        (
            life.three_torques,
            life.cycles_of_a_set,
            life.damage_of_halves,
            life.lives_in_hours,
            life.single_runs,
            life.reversed_set,
        ),
        (life.spectrum_of_a_file, life.spectrum_as_imported),
    ),
    Theme(
        "faults",
        "Faulty teeth",
        "Reference set, cracks at 70° to the centre line of their tooth, their faces open. Orders: sets of 3, 4 and 5 "
        "planets, also bolted and at unequal angles, with a worn tooth, as sets and as stages of gearboxes. "
        "Recordings: computed signals with noise and a speed that wanders by 1 %, through files of four formats. "
        "Data sets: records alone and among others. "
        "Compared with: the whole matrix of all cuts; one grid of all teeth; the healthy gear where nothing parts; the "
        "energy release rate by J in two domains; published frequencies of a set 17/37/91; formulas of the orders; "
        "gates: 1e-12; 1 %; every bit; 2 %; printed digits; 1e-9 of the largest line; 3 % of a gearbox beside the set; "
        "0.01 orders; 0.2 dB; gaps by hand 1e-9; spalls in slices 1e-9; "
        "Archard's law in closed form 1e-6.",
        (faults.frequencies, faults.energy_release),
        (
            faults.no_crack,
            faults.update_identity,
            faults.one_grid,
            faults.over_one_another,
            faults.spalls_in_slices,
            faults.wear_at_constant_load,
            fault_orders.orders_of_sets,
            fault_orders.orders_of_stages,
            fault_orders.orders_of_pair,
            recordings.come_back,
            fault_data_sets.data_set,
        ),
    ),
    Theme(
        "rims",
        "Elastic rims",
        "27/40/108 with elastic members, 100 N m and a pin error; the ring on its foundation has a rim of one "
        "module under the root. Tooth loads are those of the contact solution, spread over half a module of "
        "flank. Differences are relative to the largest displacement. Compared with: whole gear in cubic "
        "elements; gates: 1 %.",
        (rims.sharing_with_a_thin_rim,),
        (rims.thin_ring, rims.planet_between_its_meshes),
    ),
    Theme(
        "ring",
        "Vibration of the ring",
        "One sector of 108 by cyclic reduction, free, teeth in plane strain and rim in plane stress where nothing "
        "else is said. The annulus of the root circle is another body than the toothed ring and only information "
        "beside it; what gates the ring with teeth has all its teeth in a grid of its own. Rows *turning*: the "
        "reference set, and its ring alone on the foundation, with the gyroscopic and convective terms of the "
        "carrier frame. In that frame the equations do not change with time, so that natural frequencies exist; "
        "the ring is fixed in the housing. Compared with: exact annulus; the toothed ring with all its teeth in "
        "one grid of cubic elements; frequencies up to 120 rad/s of the carrier; gates: 0.01 %; row by row.",
        (ring.plain_annulus, ring.toothed_ring, ring.other_outline, ring.turning_carrier),
        (ring.whole_ring,),
    ),
    Theme(
        "two routes",
        "Two routes to the mesh stiffness",
        "Sun-planet and planet-ring of 27/40/108, each alone, 100/3 N m at the sun. Compared with: whole gears, "
        "contact resolved; gates: 1 %.",
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
        "shafts",
        "Shafts",
        "Stepped and conical shafts as Timoshenko beams with six motions a station. Compared with: closed forms, "
        "exact transfer matrix, ROSS, solids of 20-node elements by CalculiX on bearings that hold the means of their "
        "sections; gates: 1e-9 at rest; 0.1 % in vibration, 1e-5 with equal elements; of solids 0.1 % in statics and "
        "0.2 % in vibration without steps, 0.5 % of cones, 1 % of steps of a tenth. High shoulders differ by what the "
        "solid yields at its steps, with which as joints the beam is within 1 % in statics and 0.5 % in vibration.",
        (
            shafts.statics,
            shafts.cones,
            shafts.rigid_motions,
            shafts.frequencies,
            shafts.along_and_about,
            shafts.default_elements,
            shafts.turning,
            shafts.library,
        ),
        (calculix_shafts.shafts_beside_solids, calculix_shafts.steps_of_solids),
    ),
    Theme(
        "gearbox",
        "Whole gearboxes",
        "Shafts, bearings, teeth and weight in one model. Compared with: the models of single sets, stages, pairs and "
        "drivetrains, lever rules and textbook thrust, itself from another start, casings as matrices and as all their "
        "finite elements; elastic carriers: the same beams by closed forms and without reduction, finite elements of "
        "the wind-up, CalculiX where it is installed; a shipped casing: integrals over its volume, CalculiX; gates: "
        "1e-9 of natural frequencies, motions and forces, five passes of teeth and system, 0.1 % of modes of a meshed "
        "casing, 1e-5 of mass and inertia; wind-up of a tube 3 %, of webs 20 %; CalculiX: 1 % of compliance, 0.5 % of "
        "frequencies, of the shipped casing 2 and 0.5 %.",
        (
            gearbox.other_trains,
            gearbox.elastic_ring,
            gearbox_statics.loaded_states,
            gearbox_statics.stages_side_by_side,
            gearbox.wind_turbine,
            gearbox.statics,
            gearbox.passes,
            casings.on_feet,
            casings.of_files,
            casings.meshed,
            axle_casing.rigid_body,
            gearbox_carriers.beams,
            gearbox_images.images,
        ),
        (gearbox_carriers.wind_up, gearbox_carriers.drum, calculix_carrier.carrier_example, axle_casing.axle_casing),
    ),
    Theme(
        "gearbox_response",
        "Response of gearboxes",
        "Stages that fluctuate in shafts, bearings and casing. Planets run around between sun, carrier and ring on "
        "uneven springs, helical ones with tilts and gyroscopic terms in a casing beside their axis. Compared with: "
        "the same bodies in axes at rest, integrated over a turn by DOP853; the solution for gear sets, on pairs and "
        "on planets whose carrier stands still; symmetry; power put in and lost; inertia and forces of the casing; "
        "two stages whose stiffness fluctuates at once; elastic rings: the set on its foundation at full band, all "
        "nodes of a ring in a casing; friction: pair and set by their own trains, planets at rest by statics. Gates: "
        "1e-6 in time; 1e-10 of lines that symmetry forbids; 1e-9, of elastic rings and friction 1e-8, of planets at "
        "rest 1e-3, of the power of friction 5 %, 1e-4 of frequencies; a factor of two for the estimate of what one "
        "stage after the other leaves out.",
        (
            gearbox_rings.on_foundation,
            gearbox_response.equal_planets,
            gearbox_response.pair_on_bearings,
            gearbox_response.carrier_at_rest,
            gearbox_friction.friction_of_stages,
            gearbox_power.input_and_losses,
        ),
        (
            gearbox_rings.in_casing,
            gearbox_in_time.in_time,
            gearbox_in_time.six_motions,
            gearbox_power.casing_forces,
            gearbox_cross.two_stages,
            gearbox_cross.any_phase,
        ),
    ),
    Theme(
        "gearbox_nonlinear",
        "Gearboxes whose teeth part",
        "Contact loss, back flanks that wedge, weight, bearings with play and turning planets on uneven supports, on "
        "one assembled system. "
        "Compared with: the trains of a pair and of a planar set, by harmonic balance; the linear response; the "
        "same bodies in axes at rest, integrated by DOP853. "
        "Gates: 1e-9; 1e-8 of the linear response; 1e-6 in time and with play; of the chain 1e-10 and 1e-4.",
        (gearbox_nonlinear.pairs, gearbox_nonlinear.linear_meshes),
        (
            gearbox_nonlinear.planar_sets,
            gearbox_nonlinear.turning_in_time,
            gearbox_nonlinear.loose_carrier,
            gearbox_nonlinear.loose_pair,
            chain_in_casing.off_the_planets,
            chain_in_casing.lines_of_weight,
        ),
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
        "Compared with: Lin and Parker 1999, torsional limit, closed form of load sharing; gates: printed digits, "
        "but for three of 39 entries, all of N = 4: 1536.6 Hz printed a unit of the last digit too high, 727.0 "
        "and 1091.0 Hz too low by 0.037 and 0.015 %, cause unknown; 1e-9 against springs between points.",
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
        "Forces act at the base circles, as in the paper, where nothing else is said. Compared with: Kahraman "
        "1994, Table 4: 20 modes and their phasing, the eight cases of Table 2, Table 1(c), with axial and tilt "
        "stiffnesses ten times the printed ones, which miss Table 4 by up to 46 %; rigid motions; direct "
        "solution; gates: one unit of the print, in-plane pairs information; 1e-9 against springs between points; "
        "1e-12; 1e-10.",
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
        "Compared with: Willis in fractions, stages alone, springs one by one, the train that had them before; gates: "
        "1e-12; 1e-9; 1e-6.",
        (
            multistage.ratios,
            multistage.uncoupled,
            multistage.structure,
            multistage.soft_shaft,
            multistage.response,
            multistage.former_modes,
            multistage.former_response,
            multistage.turning_frames,
            multistage.published,
        ),
        slow_parts=(
            multistage.balance,
            multistage.balance_running,
            multistage.left_out,
        ),
    ),
    Theme(
        "drivetrain",
        "Wind turbine drivetrain",
        "Gearboxes integrated in time. Compared with: the train of drivetrains that had these cases before, modes, "
        "histories and spectra; the integrator of any nonlinear system; closed forms, energy and momentum; harmonic "
        "balance of a whole chain in the play of its bearings; gates: 0.1 %; 1e-9, of lines 1e-8; 1e-6; 1e-4 of the "
        "chain.",
        (
            drivetrain.shaft_joints,
            drivetrain.kinematics,
            drivetrain.shifted_planets,
            drivetrain.base_line,
            drivetrain.stiffness,
            drivetrain.former_modes,
            drivetrain.former_histories,
            drivetrain.general_integrator,
            drivetrain.balances,
            drivetrain.torques,
            drivetrain.growth,
            drivetrain.contact_loss,
        ),
        (drivetrain.former_spectra, drivetrain.minute, drivetrain.chain_in_its_play, drivetrain.chain_side_bands),
    ),
    Theme(
        "bearings",
        "Rolling bearings",
        "Balls and laminae of rollers by ISO/TS 16281, lives by ISO 281 and ISO/TS 16281. The ball bearing has 7 "
        "balls of 11.5 mm on 43.5 mm, grooves of 0.52 and 0.53, 210 GPa, C 23.4 kN, its first ball under the radial "
        "load; the roller bearing 18 rollers of 20 mm, without profile in closed forms. Compared with: another "
        "program, Sjövall's integrals, central differences, symmetry, published factors and orders; gates: 0.05 %; "
        "1e-6; 1e-10; printed digits. Formulas of books are information.",
        (
            bearings.another_program,
            bearings.rollers,
            bearings.invariances,
            bearings.books,
            bearings.lives,
            bearings.orders,
        ),
    ),
    Theme(
        "wind turbine sets",
        "Planetary sets of two wind turbines",
        "NREL/CP-5000-55355; what every reading of its tables gives stands in docs/nrel.md. Compared with: linear "
        "modes, folds under weight, ring resonance over bearing clearance; [nrel.md](nrel.md) says what is not "
        "reached; gates: digits of the inputs; 0.01 % against a harmonic balance of its own.",
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
        "6 mesh harmonics of the excitation, 5 % modal damping. Differences are those of the mesh deflections. "
        "Compared with: static solution at 1 rpm; direct solution; time integration; gates: 0.1 %; 1e-8; 1e-4 of "
        "peak to peak.",
        (dynamics.fixed_point, dynamics.harmonics_kept, dynamics.modes_kept, dynamics.time_integration),
        (dynamics.more_time_integration, turning.time_integration, turning.standstill),
    ),
    Theme(
        "levels",
        "Dynamic model at rest, and level of the housing",
        "Default settings: the excitation reaches as far as each row says. Beside the reference set one out of "
        "phase and one with two opposite pairs of planets. Compared with: static state of the set on its "
        "supports; static states under more and less torque; excitation up to twice the frequency; twice the "
        "positions; gates: 0.1 %; 0.5 %; 1 dB; 0.3 dB.",
        (),
        (levels.at_rest, levels.more_torque, levels.reach),
    ),
    Theme(
        "stability",
        "Parametric stability",
        "G5 and G6: one gear pair of unit mass, contact ratio 1.635, mesh stiffness 1 and 0.65. Compared with: "
        "Mathieu's equation, piecewise constant stiffness in closed form; gates: source by source.",
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
        "H2 is example 1 of NLvib: x'' + 0.05 x' + x + 0.1 x^3 = 0.18 cos(Omega t). Compared with: elliptic "
        "integrals, NLvib example 1, dead zone, von Mises truss, PyPI harmonicbalance, two tones; gates: printed "
        "digits; 1e-12; 1e-4 for two tones.",
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
        "Compared with: describing functions of Kahraman and Singh, integration, Ueda's oscillator; gates: 5e-9; "
        "1e-3; three errors of the mean.",
        (impacts.one_term_balance,),
        (impacts.linear_exponents, impacts.damping_and_impacts, impacts.period_two, impacts.chaos),
    ),
    Theme(
        "time integration",
        "Time integration",
        "Periods, limits and orders are measured on marched steps. I1 and I2: free vibration without damping; I3: "
        "x'' + 0.1 x' + 4 x = cos 3t from (1, 0), at t = 10. Compared with: closed forms of Newmark's family, "
        "measured on marched steps; gates: 1e-10; printed digits.",
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
        "Harmonic balance, shooting and adaptive integration of the same equations; differences of the lines of "
        "all mesh deflections over the largest line that fluctuates. Integration starts at rest, in (a) at the "
        "motion of one harmonic; the short one of (c) starts at the balanced motion. (c) is the set of Lin and "
        "Parker with 3 planets, 300 N m, 5 % damping, mesh stiffnesses with three harmonics and 20 um of "
        "backlash. Compared with: harmonic balance, shooting, adaptive integration: Duffing, gear pair, 18-dof "
        "train with contact loss; gates: 1e-5 of the largest line.",
        (routes.duffing_routes, routes.pair_routes, routes.train_routes),
        (routes.pair_routes_on_both_flanks, routes.train_from_rest),
    ),
    Theme(
        "modulation",
        "Modulation by the carrier",
        "Orders are carrier orders; a ring pattern of n nodal diameters at mesh harmonic h is heard at order h "
        "z_ring - n. Compared with: orders 105 and 111 with six lobes at 250 rpm, 537 and 543 with six lobes at "
        "3100 rpm; three lobes of the Hanning model; sinc² of the interpolation; gates: exact.",
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
        "other_programs",
        "Models for other programs",
        "Functional mock-up units run by FMPy until their start is forgotten, and matrices A, B, C, D. Rows with FMU "
        "need the library fmpy and a C compiler. Compared with: the spectral solver, harmonic balance, lines of the "
        "sensor, modes; gates: 1e-6 of the largest value in the period; 1e-9.",
        (other_programs.matrices,),
        (other_programs.pairs, other_programs.rubbing, other_programs.sets, other_programs.gearboxes),
    ),
    Theme(
        "fixed_housing",
        "Fixed housing",
        "A ring on supports has no symmetry: forces and motions act both ways in orders of the carrier. The "
        "ring of these rows is thin and inextensional (206 GPa, 7850 kg/m3, radius 100 mm, 25 mm x 10 mm), "
        "the set in it a sun in springs and planets on fixed pins. Routes in time and by samples of a turn "
        "share no equation with the solution; one linear system of all harmonics and side bands solves the "
        "same equations without iterating.",
        (
            fixed_housing.splitting,
            fixed_housing.yielding,
            fixed_housing.order_rules,
            fixed_housing.array_factors,
            fixed_housing.turning_errors,
            fixed_housing.axisymmetric,
            fixed_housing.green,
            one_system.small_sets,
        ),
        (
            fixed_housing.in_time,
            fixed_housing.multipliers,
            fixed_housing.by_samples,
            fixed_housing.reference_set_in_its_ring,
            fixed_housing.reference_set_on_supports,
            one_system.reference_set,
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
