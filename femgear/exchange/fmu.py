"""A functional mock-up unit of a train: co-simulation by FMI 2.0 or 3.0, in C.

The unit holds its source, `fmu_model.c` under the data of the train and over `fmu_interface_3.c` for FMI 3.0, and the
binary of the machine that writes it where there is a C compiler. So it needs neither Python nor a library where it
runs, and tools that compile sources run it anywhere. Modelica Association, Functional Mock-up Interface for Model
Exchange and Co-Simulation, 2.0.4, 2022; Functional Mock-up Interface, 3.0.2, 2024.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import uuid
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, get_args
from xml.etree import ElementTree

import numpy as np

import femgear
from femgear.errors import CaseError
from femgear.exchange.dynamic_model import HARMONICS, DynamicModel, MeshTables, check_ending, mesh_tables
from femgear.findings import Finding, tell
from femgear.storage.files import replaced_file

FmiVersion = Literal[2, 3]
"""Major versions of FMI that units are written for."""
IDENTIFIER = "femgear_model"
"""Name of the source and of the binary in the unit."""
TOLERANCE = 1e-9
"""Relative error of a step of the integration, of the energy of the modes, unless the user sets another one."""
_FOLDERS: dict[tuple[str, str], tuple[str, str]] = {
    ("Linux", "x86_64"): ("linux64", "x86_64-linux"),
    ("Linux", "aarch64"): ("", "aarch64-linux"),
    ("Windows", "AMD64"): ("win64", "x86_64-windows"),
    ("Darwin", "x86_64"): ("darwin64", "x86_64-darwin"),
    ("Darwin", "arm64"): ("darwin64", "aarch64-darwin"),
}
"""Folder of the binary by system and machine, as FMI 2.0 and 3.0 name them; empty where one has no name."""
_SUFFIXES = {"Linux": ".so", "Windows": ".dll", "Darwin": ".dylib"}
_SECONDS = 300
"""Longest that a compiler may take [s]."""
_EXPONENTS = ("kg", "m", "s", "rad")
_UNITS = {"N": (1, 1, -2, 0), "m": (0, 1, 0, 0), "N m": (1, 2, -2, 0), "rad": (0, 0, 0, 1), "rad/s": (0, 0, -1, 1)}
_UNITS |= {"m/s^2": (0, 1, -2, 0)}
"""Exponents of base units."""


@dataclass(frozen=True)
class UnitVariable:
    """A variable of a unit, all of which are real numbers.

    Parameters
    ----------
    name : str
    causality : {"parameter", "input", "output"}
    unit : str
        Empty of numbers without one.
    description : str
    start : float, optional
        None of outputs.
    """

    name: str
    causality: str
    unit: str
    description: str
    start: float | None = None


def write_fmu(model: DynamicModel, path: Path, *, harmonics: int = HARMONICS, version: FmiVersion = 2) -> None:
    """Write a train as functional mock-up unit; without a C compiler it holds the source alone (W-COMPILER).

    ``version`` is that of FMI. CaseError (E-CHOICE): another ending than .fmu, another version. StorageError: a file
    that cannot be written.
    """
    check_ending(path, "--fmu")
    if version not in get_args(FmiVersion):
        raise CaseError(
            "units are written for FMI 2 and 3", code="E-CHOICE", key="version", value=version, limit="2, 3"
        )
    variables = list(unit_variables(model))
    data = _data(model, mesh_tables(model, harmonics), variables)
    names = ["fmu_model.c", *(["fmu_interface_3.c"] if version == 3 else [])]
    code = "\n".join(files("femgear.exchange").joinpath(name).read_text(encoding="utf-8") for name in names)
    guid = str(uuid.uuid5(uuid.NAMESPACE_URL, data + code))
    source = f'#define GUID "{guid}"\n{data}\n{code}'
    described = _description if version == 2 else _description_3
    parts: dict[str, str | bytes] = {"modelDescription.xml": described(model, variables, guid)}
    parts |= {f"sources/{IDENTIFIER}.c": source, **_compiled(source, version)}
    if version == 3:
        parts["sources/buildDescription.xml"] = _build_description()
    with replaced_file(path, size=len(source)) as temporary, zipfile.ZipFile(temporary, "w") as unit:
        for place, part in parts.items():
            unit.writestr(place, part, zipfile.ZIP_DEFLATED)


def unit_variables(model: DynamicModel) -> Iterator[UnitVariable]:
    """List the variables of the unit of a train, in the order of their value references."""
    modal = model.modal
    yield UnitVariable("damping_factor", "parameter", "", "factor on the damping ratios of all modes", 1.0)
    yield UnitVariable("start_phase", "parameter", "", "phase of the first mesh at the beginning, in mesh periods", 0.0)
    yield UnitVariable("tolerance", "parameter", "", "relative error of a step of the integration", TOLERANCE)
    yield UnitVariable("speed", "input", "rad/s", "speed of the input but for what torques accelerate", model.speed)
    for port in modal.inputs[: _loads(model)]:
        yield UnitVariable(identifier(port.name), "input", port.unit, port.name, port.nominal)
    yield UnitVariable("mesh_phase", "output", "", "mesh periods of the first mesh since the phase 0")
    for word, unit in (("deflection", "m"), ("force", "N")):
        for mesh in modal.meshes:
            yield UnitVariable(
                identifier(f"{word} of {mesh}"), "output", unit, f"{word} of {mesh} along the line of action"
            )
    for port in modal.outputs[: _shown(model)]:
        turning = ", with its mean" if port.unit == "rad" else ""
        yield UnitVariable(identifier(port.name), "output", port.unit, port.name + turning)
    for number in modal.rotations:
        name = f"{modal.outputs[number].name} rate"
        yield UnitVariable(identifier(name), "output", "rad/s", f"{name}, with its mean")
    for number in modal.accelerations:
        name = f"{modal.outputs[number].name} acceleration"
        yield UnitVariable(identifier(name), "output", "m/s^2", name)
    if model.sensor is not None:
        yield UnitVariable("sensor", "output", "m", "radial displacement at the sensor on the ring")


def identifier(name: str) -> str:
    """Turn a name into one that every tool takes: letters, digits and underscores."""
    return re.sub(r"\W+", "_", name).strip("_").lower()


def _loads(model: DynamicModel) -> int:
    """Number of the inputs that are no friction of the tables."""
    return len(model.modal.inputs) - (0 if model.excitation.source is None else len(model.excitation.source))


def _shown(model: DynamicModel) -> int:
    """Number of the outputs before the waves of the ring, which the sensor alone needs."""
    return len(model.modal.outputs) if model.sensor is None else model.sensor.first


def _data(model: DynamicModel, tables: MeshTables, variables: Iterable[UnitVariable]) -> str:
    """Write the data of a train as C: sizes, then arrays, of which none is empty."""
    modal, sensor, loads = model.modal, model.sensor, _loads(model)
    starts = [variable.start for variable in variables if variable.start is not None]
    rigid = int(np.count_nonzero(modal.omega == 0.0))
    sizes: dict[str, float] = {"MODES": len(modal.omega), "RIGID": rigid, "MESHES": len(modal.meshes)}
    sizes |= {"INPUTS": len(modal.inputs), "LOAD_COUNT": loads, "OUTPUTS": len(modal.outputs), "SHOWN": _shown(model)}
    sizes |= {"ACCELERATIONS": len(modal.accelerations)}
    sizes |= {"ROTATIONS": len(modal.rotations), "POSITIONS": len(tables.phase), "PERIODS": model.excitation.periods}
    sizes |= {"MESH_RATE": model.mesh_rate, "SEPARATES": int(model.separates)}
    sizes |= {"SENSORS": int(sensor is not None), "DIAMETERS": 0, "SENSOR_ANGLE": 0.0, "CARRIER": 0.0}
    if sensor is not None:
        sizes |= {"DIAMETERS": sensor.diameters, "SENSOR_ANGLE": sensor.angle, "CARRIER": sensor.carrier}
    arrays = {"omega": modal.omega, "zeta": modal.damping_ratio, "mesh_stiffness": modal.mesh_stiffness}
    arrays |= {"mesh_rows": modal.mesh_rows, "mesh_residual": modal.mesh_residual, "start_values": np.array(starts)}
    arrays |= {"mesh_by_input": modal.mesh_by_input, "input_rows": modal.input_rows}
    arrays |= {"output_rows": modal.output_rows, "output_by_mesh": modal.output_by_mesh}
    arrays |= {"output_by_input": modal.output_by_input, "ratio": model.ratios, "backlash": model.excitation.backlash}
    arrays |= dict(zip(("mesh_ratio", "mesh_ahead"), model.phases, strict=True))
    arrays |= {"driver_row": modal.output_rows[model.driver, :rigid], "stiffness_table": tables.stiffness}
    arrays |= {"deflection_table": tables.deflection, "force_table": tables.force, "friction_table": tables.friction}
    lines = [f"#define {name} ({value!r})" for name, value in sizes.items()]
    lines += ["static const int turns[] = {" + ",".join(str(int(c.unit == "rad")) for c in modal.outputs) + "};"]
    lines += ["static const int shakes[] = {" + ",".join(str(int(c.accelerates)) for c in modal.outputs) + "};"]
    return "\n".join([*lines, *(_array(name, values) for name, values in arrays.items()), ""])


def _array(name: str, values: np.ndarray) -> str:
    """Write an array of numbers as one of C."""
    digits = "%.12g" if name.endswith("_table") else "%.17g"
    if not values.size:
        values = np.zeros([max(size, 1) for size in values.shape])
    shape = "".join(f"[{size}]" for size in values.shape)
    rows = (",".join(digits % value for value in row) for row in np.atleast_2d(values))
    body = ",\n".join(f"{{{row}}}" for row in rows)
    return f"static const double {name}{shape} = " + (f"{{{body}}};" if values.ndim == 2 else f"{body};")


def _description(model: DynamicModel, variables: list[UnitVariable], guid: str) -> bytes:
    """Write modelDescription.xml of a unit."""
    about = {"fmiVersion": "2.0", "modelName": model.title or "gear train", "guid": guid, "description": model.title}
    about |= {"generationTool": f"femgear {femgear.__version__}", "variableNamingConvention": "flat"}
    root = ElementTree.Element("fmiModelDescription", about | {"numberOfEventIndicators": "0"})
    abilities = {"modelIdentifier": IDENTIFIER, "canHandleVariableCommunicationStepSize": "true"}
    part = ElementTree.SubElement(root, "CoSimulation", abilities | {"canGetAndSetFMUstate": "true"})
    ElementTree.SubElement(ElementTree.SubElement(part, "SourceFiles"), "File", {"name": f"{IDENTIFIER}.c"})
    _add_units_and_times(root, model)
    listed = ElementTree.SubElement(root, "ModelVariables")
    for number, variable in enumerate(variables):
        part = ElementTree.SubElement(listed, "ScalarVariable", _entries(number, variable))
        ElementTree.SubElement(part, "Real", _numbers(variable))
    structure = ElementTree.SubElement(root, "ModelStructure")
    seen = [str(number) for number, variable in enumerate(variables, 1) if variable.causality == "output"]
    for kind in ("Outputs", "InitialUnknowns"):
        part = ElementTree.SubElement(structure, kind)
        for number in seen:
            ElementTree.SubElement(part, "Unknown", {"index": number})
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def _entries(number: int, variable: UnitVariable) -> dict[str, str]:
    """Entries of a variable that both versions give it."""
    entries = {"name": variable.name, "valueReference": str(number), "causality": variable.causality}
    entries |= {"description": variable.description}
    return entries | ({"variability": "fixed", "initial": "exact"} if variable.causality == "parameter" else {})


def _numbers(variable: UnitVariable) -> dict[str, str]:
    """Entries of the number that a variable is: its unit, and with what it starts."""
    unit = {"unit": variable.unit} if variable.unit in _UNITS else {}
    return unit | ({} if variable.start is None else {"start": repr(float(variable.start))})


def _add_units_and_times(root: ElementTree.Element, model: DynamicModel) -> None:
    """Add units, and times of a hundred mesh periods, to the description of a unit."""
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for name, powers in _UNITS.items():
        exponents = {base: str(power) for base, power in zip(_EXPONENTS, powers, strict=True) if power}
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", {"name": name}), "BaseUnit", exponents)
    period = 1.0 / (model.mesh_rate * model.speed)
    ElementTree.SubElement(root, "DefaultExperiment", {"stopTime": repr(100 * period), "stepSize": repr(period / 50)})


def _description_3(model: DynamicModel, variables: list[UnitVariable], token: str) -> bytes:
    """Write modelDescription.xml of a unit for FMI 3.0, whose last variable is the time."""
    about = {"fmiVersion": "3.0", "modelName": model.title or "gear train", "instantiationToken": token}
    about |= {"description": model.title, "generationTool": f"femgear {femgear.__version__}"}
    root = ElementTree.Element("fmiModelDescription", about | {"variableNamingConvention": "flat"})
    abilities = {"modelIdentifier": IDENTIFIER, "canHandleVariableCommunicationStepSize": "true"}
    ElementTree.SubElement(root, "CoSimulation", abilities | {"canGetAndSetFMUState": "true"})
    _add_units_and_times(root, model)
    listed = ElementTree.SubElement(root, "ModelVariables")
    for number, variable in enumerate(variables):
        ElementTree.SubElement(listed, "Float64", _entries(number, variable) | _numbers(variable))
    time = {"name": "time", "valueReference": str(len(variables)), "causality": "independent"}
    ElementTree.SubElement(listed, "Float64", time | {"variability": "continuous", "description": "time [s]"})
    structure = ElementTree.SubElement(root, "ModelStructure")
    seen = [str(number) for number, variable in enumerate(variables) if variable.causality == "output"]
    for kind in ("Output", "InitialUnknown"):
        for number in seen:
            ElementTree.SubElement(structure, kind, {"valueReference": number})
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def _build_description() -> bytes:
    """Write buildDescription.xml, by which tools compile the source of a unit for FMI 3.0."""
    root = ElementTree.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    build = ElementTree.SubElement(root, "BuildConfiguration", {"modelIdentifier": IDENTIFIER})
    sources = ElementTree.SubElement(build, "SourceFileSet", {"language": "C99"})
    ElementTree.SubElement(sources, "SourceFile", {"name": f"{IDENTIFIER}.c"})
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def _compiled(source: str, version: FmiVersion) -> dict[str, bytes]:
    """Compile the source of a unit: the binary by its place in the unit, nothing where that fails."""
    folder = _FOLDERS.get((platform.system(), platform.machine()), ("", ""))[version - 2]
    suffix = _SUFFIXES.get(platform.system(), "")
    compiler = next(filter(shutil.which, (os.environ.get("CC", ""), "cc", "gcc", "clang")), None)
    why = ""
    if not folder:
        why = f"FMI {version}.0 names no binaries of {platform.system()} on {platform.machine()}"
    elif compiler is None:
        why = "there is no C compiler (cc, gcc, clang, or what CC names)"
    else:
        with TemporaryDirectory() as place:
            text, binary = Path(place, f"{IDENTIFIER}.c"), Path(place, IDENTIFIER + suffix)
            text.write_text(source, encoding="utf-8")
            command = [compiler, "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-o", str(binary), str(text), "-lm"]
            try:
                subprocess.run(command, check=True, capture_output=True, timeout=_SECONDS)
                return {f"binaries/{folder}/{IDENTIFIER}{suffix}": binary.read_bytes()}
            except (OSError, subprocess.SubprocessError) as error:
                said = (getattr(error, "stderr", None) or b"").decode("utf-8", "replace").strip()
                why = f"{compiler} failed: {said.splitlines()[0] if said else error}"
    remedy = "install a C compiler and export again, or let the tool that reads the unit compile its source"
    tell(Finding("W-COMPILER", "", f"the unit holds its C source alone: {why}", remedy=remedy))
    return {}
