"""A planetary stage as REXS 1.1, written by hand as the FVA Workbench arranges one.

Teeth, sizes, tools, material, speed and torque are those of FVA's example of a planetary stage with 17, 22
and 61 teeth (github.com/fva-net/rexs-api-java, "Planetary stage - Minus gearing").
"""

import copy
import json
import zipfile
from xml.sax.saxutils import escape, quoteattr

MM, DEG, NONE = "mm", "°", "none"


class Gearbox:
    """Components by id, each with type and attributes, and relations, that tests change and write."""

    def __init__(self, version: str = "1.1", planets: int = 3, addendum: float | None = 0.9):
        self.version, self.components, self.relations = version, {}, []
        self.add(1, "gear_unit", account_for_gravity=("true", NONE))
        self.add(2, "gear_casing", temperature_lubricant=(80.0, "C"))
        self.add(9, "planetary_stage")
        self.add(3, "planet_carrier")
        self.add(91, "lubricant", density_at_15_degree_celsius=(0.88, "kg / dm^3"))
        self.add(
            86,
            "material",
            density=(7.85, "kg / dm^3"),
            elastic_modulus=(210000.0, "N / mm^2"),
            poisson_ratio=(0.3, NONE),
        )
        tool = {"addendum_coefficient_reference_profile": (1.25, NONE)}
        self.add(83, "rack_shaped_tool", tip_radius_factor=(0.25, NONE), **tool)
        self.add(85, "cutter_wheel_tool", number_of_teeth=(23, NONE), tip_radius_factor=(0.0, NONE), **tool)
        self.relate("assembly", assembly=1, part=9)
        self.relate("assembly", assembly=9, part=3)
        self.gear(53, 17, "cylindrical_gear", 34, 34.0, 83)
        self.gear(58, 61, "ring_gear", 62, 280.0, 85)
        if addendum is not None:  # of the ring; FVA's example has none
            for flank in (2058, 3058):
                self.components[flank]["attributes"]["addendum_coefficient_basic_profile"] = (addendum, NONE)
        self.add(4, "shaft")
        self.relate("planet_carrier_shaft", planetary_stage=9, shaft=4)
        self.components[34]["attributes"] |= {"rotational_speed": (1500.0, "1 / min"), "defines_speed": ("true", NONE)}
        self.add(
            38,
            "external_load",
            torque_around_u_axis=(1591.5494309189535, "N m"),
            defines_torque=("true", NONE),
        )
        self.relate("assembly", assembly=34, part=38)
        self.add(65, "switchable_coupling", rotational_stiffness=(1e20, "N mm / rad"))
        self.relate("side", assembly=65, outer_part=2, inner_part=62)
        for bearing, shaft in ((36, 34), (37, 34), (59, 4), (60, 4)):
            self.add(bearing, "concept_bearing", radial_stiffness=(1e20, "N / m"))
            self.relate("side", assembly=bearing, outer_part=2, inner_part=shaft)
        for n in range(planets):
            self.gear(240 + n, 22, "cylindrical_gear", 230 + n, 58.0, 83, shift=0.0)
            self.add(270 + n, "shaft")
            for bearing in (280 + n, 290 + n):
                self.add(bearing, "concept_bearing", radial_stiffness=(1e20, "N / m"))
                self.relate("side", assembly=bearing, outer_part=230 + n, inner_part=270 + n)
            for mesh, first, second, angle in ((210, 53, 240 + n, 0.0), (220, 240 + n, 58, 180.0)):
                turned = (360.0 - n * 360.0 / planets + angle) % 360.0
                self.add(
                    mesh + n,
                    "cylindrical_stage",
                    center_distance=(78.0, MM),
                    rotating_angle_around_neg_u_axis=(turned, DEG),
                )
                self.relate("assembly", assembly=9, part=mesh + n)
                self.relate("stage", gear_1=first, stage=mesh + n, gear_2=second)

    def add(self, id, type, **attributes):
        self.components[id] = {"type": type, "name": f"{type} [{id}]", "attributes": dict(attributes)}

    def relate(self, type, **roles):
        self.relations.append((type, roles))

    def gear(self, id, teeth, type, shaft, diameter, tool, shift=None):
        self.add(
            id,
            type,
            number_of_teeth=(teeth, NONE),
            normal_module=(4.0, MM),
            face_width=(50.0, MM),
            helix_angle_reference_diameter=(0.0, DEG),
            u_coordinate_on_shaft=(25.0, MM),
        )
        self.add(shaft, "shaft")
        self.add(
            1000 + shaft,
            "shaft_section",
            u_coordinate_on_shaft=(0.0, MM),
            length=(100.0, MM),
            outer_diameter_begin=(diameter, MM),
            outer_diameter_end=(diameter, MM),
        )
        self.relate("assembly", assembly=shaft, part=1000 + shaft)
        self.relate("assembly", assembly=shaft, part=id)
        self.relate("reference", origin=id, referenced=86)
        self.relate("ordered_reference", origin=id, referenced=tool)
        for side in (2000, 3000):
            self.add(side + id, "flank_geometry", normal_pressure_angle=(20.0, DEG))
            if shift is not None:
                self.components[side + id]["attributes"]["addendum_modification_coefficient"] = (shift, NONE)
        self.relate("flank", gear=id, left=2000 + id, right=3000 + id)

    def set(self, id, **attributes):
        """The same gearbox with other attributes of a component; None takes one out."""
        changed = copy.deepcopy(self)
        own = changed.components[id]["attributes"]
        own |= attributes
        for name in [name for name, value in attributes.items() if value is None]:
            del own[name]
        return changed

    def xml(self):
        lines = [
            '<?xml version="1.0" encoding="UTF-8" standalone="no"?>',
            f'<model version="{self.version}">',
        ]
        lines.append("<!-- as FVA writes them: relations first --><relations>")
        for number, (type, roles) in enumerate(self.relations):
            refs = "".join(f'<ref hint="x" id="{id}" role="{role}"/>' for role, id in roles.items())
            lines.append(f'<relation id="{number}" type="{type}">{refs}</relation>')
        lines.append("</relations><components>")
        for id, one in self.components.items():
            lines.append(f'<component id="{id}" name={quoteattr(one["name"])} type="{one["type"]}">')
            for name, (value, unit) in one["attributes"].items():
                of = "" if unit is None else f' unit="{unit}"'
                lines.append(f'<attribute id="{name}"{of}>{escape(str(value))}</attribute>')
            for name, values in {"u_axis_vector": (1.0, 0.0, 0.0), **one.get("vectors", {})}.items():
                entries = "".join(f"<c>{value}</c>" for value in values)
                lines.append(f'<attribute id="{name}" unit="mm"><array>{entries}</array></attribute>')
            lines.append("</component>")
        lines.append("</components>")
        if getattr(self, "load_cases", ()):
            lines.append('<load_spectrum id="1">')
            for number, case in enumerate(self.load_cases, start=1):
                lines.append(f'<load_case id="{number}">')
                for id, attributes in case.items():
                    lines.append(f'<component id="{id}">')
                    for name, (value, unit) in attributes.items():
                        lines.append(f'<attribute id="{name}" unit="{unit}">{value}</attribute>')
                    lines.append("</component>")
                lines.append("</load_case>")
            lines.append("</load_spectrum>")
        return "\n".join([*lines, "</model>"])

    def json(self):
        def attribute(name, value, unit):
            if value in ("true", "false"):
                return {"id": name, "unit": unit, "boolean": value == "true"}
            return {"id": name, "unit": unit, "floating_point": value}

        components = [
            {
                "id": id,
                "type": one["type"],
                "name": one["name"],
                "attributes": [attribute(name, *pair) for name, pair in one["attributes"].items()]
                + [
                    {"id": name, "unit": "mm", "floating_point_array": list(values)}
                    for name, values in one.get("vectors", {}).items()
                ],
            }
            for id, one in self.components.items()
        ]
        relations = [
            {"id": n, "type": type, "refs": [{"id": id, "role": role} for role, id in roles.items()]}
            for n, (type, roles) in enumerate(self.relations)
        ]
        model = {"version": self.version, "components": components, "relations": relations}
        return json.dumps({"model": model})

    def write(self, path):
        """Write it as the name of the file says, and return the path."""
        if path.suffix == ".rexsz":
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr("rexs-model.rexs", self.xml())
        else:
            path.write_text(self.json() if path.suffix == ".rexsj" else self.xml(), encoding="utf-8")
        return path


class ParallelUnit(Gearbox):
    """Two spur stages 25/50 and 20/60 on three shafts, each in two bearings; 100 N m at 1500 rpm."""

    def __init__(self):
        self.version, self.components, self.relations = "1.4", {}, []
        self.add(1, "gear_unit")
        self.components[1]["name"] = "two stages"
        self.add(2, "gear_casing")
        self.relate("assembly", assembly=1, part=2)
        self.add(
            3,
            "material",
            density=(7.85, "kg / dm^3"),
            elastic_modulus=(206000.0, "N / mm^2"),
            poisson_ratio=(0.3, NONE),
        )
        for number, (length, diameter) in enumerate(((160.0, 30.0), (120.0, 40.0), (200.0, 55.0)), start=1):
            shaft = 10 * number
            self.add(shaft, "shaft")
            self.add(
                shaft + 1,
                "shaft_section",
                u_coordinate_on_shaft=(0.0, MM),
                length=(length, MM),
                outer_diameter_begin=(diameter, MM),
                outer_diameter_end=(diameter, MM),
            )
            self.relate("assembly", assembly=shaft, part=shaft + 1)
            self.relate("reference", origin=shaft, referenced=3)
            for bearing, place in ((shaft + 2, 10.0), (shaft + 3, length - 10.0)):
                self.add(
                    bearing,
                    "concept_bearing",
                    radial_stiffness=(2e8, "N / m"),
                    u_coordinate_on_shaft_inner_side=(place, MM),
                )
                self.relate("side", assembly=bearing, inner_part=shaft, outer_part=2)
        self.components[10]["attributes"] |= {"rotational_speed": (1500.0, "1 / min")}
        self.add(5, "external_load", torque_around_u_axis=(100.0, "N m"), u_coordinate_on_shaft=(0.0, MM))
        self.relate("assembly", assembly=10, part=5)
        self.wheel(41, 10, 25, 2.0, 24.0, 80.0)
        self.wheel(42, 20, 50, 2.0, 24.0, 35.0)
        self.wheel(43, 20, 20, 3.0, 36.0, 85.0)
        self.wheel(44, 30, 60, 3.0, 36.0, 100.0)
        self.mesh(51, 41, 42, 75.0, 0.0)
        self.mesh(52, 43, 44, 120.0, 90.0)

    def wheel(self, id, shaft, teeth, module, width, place, type="cylindrical_gear"):
        self.add(
            id,
            type,
            number_of_teeth=(teeth, NONE),
            normal_module=(module, MM),
            face_width=(width, MM),
            u_coordinate_on_shaft=(place, MM),
        )
        self.relate("assembly", assembly=shaft, part=id)
        for side in (1000, 2000):
            self.add(
                side + id,
                "cylindrical_gear_flank",
                normal_pressure_angle=(20.0, DEG),
                addendum_modification_coefficient=(0.0, NONE),
            )
        self.relate("flank", gear=id, left=1000 + id, right=2000 + id)

    def mesh(self, id, first, second, distance, angle):
        self.add(id, "cylindrical_stage", center_distance=(distance, MM), rotating_angle_around_neg_u_axis=(angle, DEG))
        self.relate("assembly", assembly=1, part=id)
        self.relate("stage", stage=id, gear_1=first, gear_2=second)


def both_units():
    """The planetary stage of `Gearbox`, and the two spur stages beside it with ids from 50000."""
    box, unit = Gearbox("1.4"), ParallelUnit()
    box.components |= {50000 + id: one for id, one in unit.components.items()}
    box.relations += [(type, {role: 50000 + id for role, id in roles.items()}) for type, roles in unit.relations]
    return box
