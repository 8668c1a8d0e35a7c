"""Two published gear units, by their numbers.

`IndustrialUnit` has those of the two-stage gear unit of BearinxSimulationSuite/REXSapi, `ThreeStageUnit` those of
SEW's three-stage gear unit in fva-net/rexs-api-java.
"""

from rexs_stage import DEG, MM, NONE, Gearbox


class _Unit(Gearbox):
    """Components of a unit with shafts in a casing."""

    load_cases = ()

    def __init__(self, version):
        self.version, self.components, self.relations = version, {}, []
        self.add(1, "gear_unit")
        self.add(2, "gear_casing")

    def shaft(self, id, place, sections, **attributes):
        """A shaft with its zero at (u, v, w) and sections (length, outer, inner diameter)."""
        self.add(id, "shaft", reference_component_for_position=(1, NONE), **attributes)
        self.components[id]["vectors"] = {"support_vector": place}
        u = 0.0
        for number, (length, outer, inner) in enumerate(sections):
            part = 1000 * id + number
            self.add(
                part,
                "shaft_section",
                u_coordinate_on_shaft=(u, MM),
                length=(length, MM),
                outer_diameter_begin=(outer, MM),
                outer_diameter_end=(outer, MM),
                inner_diameter_begin=(inner, MM),
                inner_diameter_end=(inner, MM),
            )
            self.relate("assembly", assembly=id, part=part)
            u += length

    def wheel(self, id, shaft, place, teeth, module, helix, width, shift):
        self.add(
            id,
            "cylindrical_gear",
            number_of_teeth=(teeth, NONE),
            normal_module=(module, MM),
            helix_angle_reference_diameter=(helix, DEG),
            face_width=(width, MM),
            u_coordinate_on_shaft=(place, MM),
        )
        self.relate("assembly", assembly=shaft, part=id)
        for side in (500000, 600000):
            self.add(
                side + id,
                "cylindrical_gear_flank" if self.version > "1.3" else "flank_geometry",
                normal_pressure_angle=(20.0, DEG),
                addendum_modification_coefficient=(shift, NONE),
            )
        self.relate("flank", gear=id, left=500000 + id, right=600000 + id)

    def mesh(self, id, first, second, distance, angle):
        self.add(id, "cylindrical_stage", center_distance=(distance, MM), rotating_angle_around_neg_u_axis=(angle, DEG))
        self.relate("assembly", assembly=1, part=id)
        self.relate("stage", stage=id, gear_1=first, gear_2=second)

    def bearing(self, id, type, inner, place, outer=2, outer_place=0.0, **attributes):
        at = {"u_coordinate_on_shaft_inner_side": (place, MM), "u_coordinate_on_shaft_outer_side": (outer_place, MM)}
        self.add(id, type, **at, **attributes)
        self.relate("side", assembly=id, inner_part=inner, outer_part=outer)

    def load(self, id, shaft, place, **attributes):
        self.add(id, "external_load", u_coordinate_on_shaft=(place, MM), **attributes)
        self.relate("assembly", assembly=shaft, part=id)


def planetary_unit():
    """The stage of `Gearbox` with whole shafts: sun in two bearings, carrier of two plates with pins, ring held."""
    box = Gearbox("1.4")
    box.components[34]["vectors"] = {"support_vector": (0.0, 0.0, 0.0)}
    box.components[38]["attributes"]["u_coordinate_on_shaft"] = (100.0, MM)
    box.add(6, "shaft")
    box.relate("planet_carrier_shaft", planetary_stage=9, shaft=6)
    for shaft, zero, length, outer, inner in ((4, -100.0, 100.0, 80.0, 60.0), (6, 50.0, 8.0, 99.0, 88.0)):
        box.components[shaft]["vectors"] = {"support_vector": (zero, 0.0, 0.0)}
        box.add(
            1000 + shaft,
            "shaft_section",
            u_coordinate_on_shaft=(0.0, MM),
            length=(length, MM),
            outer_diameter_begin=(outer, MM),
            inner_diameter_begin=(inner, MM),
            inner_diameter_end=(inner, MM),
        )
        box.relate("assembly", assembly=shaft, part=1000 + shaft)
    box.components[3]["attributes"]["strut_inner_diameter"] = (110.0, MM)
    for plate, zero, inner in ((67, -8.0, 80.0), (68, 50.0, 99.0)):
        box.add(plate, "side_plate", length=(8.0, MM), outer_diameter=(219.0, MM), inner_diameter=(inner, MM))
        box.components[plate]["vectors"] = {"support_vector": (zero, 0.0, 0.0)}
        box.relate("assembly", assembly=3, part=plate)
    for number in range(3):
        pin = 270 + number
        box.relate("planet_pin", planetary_stage=9, shaft=pin)
        box.relate("planet_shaft", planetary_stage=9, shaft=230 + number)
        box.add(1000 + pin, "shaft_section", length=(66.0, MM), outer_diameter_begin=(43.2, MM))
        box.relate("assembly", assembly=pin, part=1000 + pin)
        for joint, place, plate in ((600 + number, 4.0, 67), (700 + number, 62.0, 68)):
            box.add(joint, "coupling", length=(8.0, MM), u_coordinate_on_shaft_inner_side=(place, MM))
            box.relate("side", assembly=joint, inner_part=pin, outer_part=plate)
    for bearing, place in ((36, 75.0), (37, 95.0), (59, 25.0), (60, 75.0)):
        box.components[bearing]["attributes"]["u_coordinate_on_shaft_inner_side"] = (place, MM)
    return box


class IndustrialUnit(_Unit):
    """27/51 and 23/34 teeth on three shafts, two of them coaxial with a needle bearing between; four load cases."""

    def __init__(self):
        super().__init__("1.4")
        self.shaft(12, (-70.0, 0.0, 0.0), ((80, 50, 0), (80, 60, 0), (30, 50, 0)))
        self.shaft(13, (-25.0, 0.0, -190.0), ((45, 80, 0), (60, 90, 0), (165, 80, 0)))
        hollow = ((20, 70, 58), (8, 70, 58), (3, 70, 58))
        self.shaft(14, (90.0, 0.0, 0.0), (*hollow, (82, 70, 0), (10, 80, 0), (100, 60, 0)))
        self.wheel(15, 12, 117.0, 27, 4.5, 21.0, 50.0, 0.231415)
        self.wheel(17, 13, 72.0, 51, 4.5, -21.0, 50.0, 0.231415)
        self.wheel(16, 13, 180.0, 23, 6.5, -10.0, 74.0, 0.15074)
        self.wheel(18, 14, 65.0, 34, 6.5, 10.0, 74.0, 0.15074)
        self.components[16]["attributes"]["tip_diameter"] = (1.0, MM)
        self.mesh(19, 15, 17, 190.0, 180.0)
        self.mesh(20, 16, 18, 190.0, 0.0)
        catalogue = "rolling_bearing_with_catalog_geometry"
        tilt = {"bending_stiffness": (1e15, "N mm / rad")}
        self.bearing(33, catalogue, 12, 65.0, outer_place=-5.0, axial_force_absorption=("both_directions", NONE))
        self.bearing(34, catalogue, 14, 13.0, outer_place=103.0, axial_force_absorption=("negative", NONE))
        self.bearing(35, catalogue, 14, 140.0, outer_place=230.0, axial_force_absorption=("positive", NONE))
        self.bearing(36, "concept_bearing", 12, 175.0, 14, 15.0, axial_force_absorption=("no_direction", NONE), **tilt)
        self.bearing(37, "concept_bearing", 13, 20.0, axial_force_absorption=("negative", NONE), **tilt)
        self.bearing(38, "concept_bearing", 13, 250.0, axial_force_absorption=("positive", NONE), **tilt)
        self.load(40, 12, 0.0, transmits_torque=("true", NONE))
        self.load(41, 14, 170.0, transmits_torque=("true", NONE))
        self.load(42, 12, 0.0, transmits_torque=("false", NONE))
        cases = ((543, 567, 456, 20), (3456, 345, 678, 30), (1234, 456, 876, 35), (789, 789, 1233, 15))
        self.load_cases = [
            {
                1: {"load_duration_fraction": (share, "%")},
                12: {"rotational_speed": (speed, "1 / min")},
                40: {"torque_around_u_axis": (torque, "N m")},
                42: {"force_v_direction": (force, "N")},
            }
            for speed, torque, force, share in cases
        ]


class ThreeStageUnit(_Unit):
    """23/67, 13/76 and 14/87 teeth on four shafts in nine bearings, with places of gears at their left faces."""

    def __init__(self):
        super().__init__("1.0")
        first = ((40, 19), (11.5, 22), (2.3, 25), (1.3, 23.9), (18.9, 25), (30.3, 30), (15.2, 25), (22.5, 22))
        self.shaft(4, (0.0, 0.0, 0.0), [(*one, 0) for one in (*first, (4, 14), (15.9, 10), (1.1, 9.6), (1.5, 10))])
        self.components[4]["attributes"]["rotational_speed"] = (1400.0, "1 / min")
        second = ((2.5, 14.8), (10, 15), (13.5, 16), (23, 14), (10.5, 15))
        self.shaft(5, (137.5, 47.02148907341676, -24.45362069957225), [(*one, 0) for one in second])
        third = ((7, 14.6), (14, 15), (52, 20), (5, 25.91), (41, 18.403), (9, 25.91), (12, 17), (3, 16.8))
        self.shaft(36, (128.5, 50.33350037591513, 32.45007497243242), [(*one, 0) for one in third])
        last = ((4, 35), (1.6, 33), (20.4, 35), (39, 40), (44, 39.5), (22, 40), (19, 47), (70, 35))
        self.shaft(54, (182.7, -19.008575782311063, -1.026431327759056), [(*one, 0) for one in last])
        self.wheel(23, 4, 146.0, 23, 1.0, 30.0, 16.0, 0.581)
        self.wheel(34, 5, 13.5, 67, 1.0, -30.0, 11.0, 0.5131)
        self.wheel(38, 5, 26.0, 13, 1.25, -10.0, 23.0, 0.521)
        self.wheel(52, 36, 41.5, 76, 1.25, 10.0, 15.0, -0.094)
        self.wheel(56, 36, 78.0, 14, 1.5, 10.0, 41.0, 0.536)
        self.wheel(69, 54, 26.3, 87, 1.5, -10.0, 36.0, -0.4815)
        self.mesh(6, 23, 34, 53.0, 117.47677801890632)
        self.mesh(37, 38, 52, 57.0, 3.3310739238719993)
        self.mesh(55, 56, 69, 77.0, -115.77001197095069)
        for id, shaft, place, bore, outside, width, dynamic, static, takes in (
            (20, 4, 65.5, 25, 62, 17, 22.4, 11.4, "both_directions"),
            (21, 4, 111.8, 25, 52, 15, 14.0, 7.8, "no_direction"),
            (32, 5, 6.5, 15, 35, 11, 7.8, 3.75, "negative"),
            (33, 5, 54.5, 15, 35, 11, 7.8, 3.75, "positive"),
            (49, 36, 13.5, 15, 42, 13, 11.4, 5.4, "negative"),
            (50, 36, 66.0, 20, 47, 14, 32.5, 24.7, "no_direction"),
            (51, 36, 135.0, 17, 47, 14, 15.0, 6.5, "positive"),
            (66, 54, 16.8, 35, 72, 17, 25.5, 15.3, "no_direction"),
            (67, 54, 119.5, 40, 90, 23, 42.5, 25.0, "both_directions"),
        ):
            kind = "radial_roller_bearing" if id == 50 else "radial_grooved_ball_bearing"
            self.bearing(
                id,
                "rolling_bearing_with_catalog_geometry",
                shaft,
                place,
                outer_place=place,
                bearing_type=(kind, NONE),
                inner_diameter=(bore, MM),
                outer_diameter=(outside, MM),
                width=(width, MM),
                radial_stiffness=(1e23, "N / m"),
                dynamic_capacity=(dynamic, "kN"),
                static_capacity=(static, "kN"),
                axial_force_absorption=(takes, NONE),
            )
        self.load(22, 4, 20.0, torque_around_u_axis=(4.724562306435156, "N m"))
        self.load(68, 54, 185.0)
