"""Printed frequencies of whirling shafts, computed again by the library; the overhung rotor as a gearbox."""

import math
import warnings

import numpy as np
import pytest

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.reading import read_case
from validation.shafts import (
    CAMPBELL,
    OVERHUNG,
    OVERHUNG_BEARINGS,
    OVERHUNG_CAMPBELL,
    OVERHUNG_DISCS,
    OVERHUNG_ELEMENT,
    STEPPED,
    STEPPED_BEARINGS,
    STEPPED_DISCS,
)
from validation.timoshenko import whirl_frequencies


def rotor(ross, parts, longest, discs, supports):
    """The same shaft in elements of ROSS."""
    steel, elements = ross.Material("steel", rho=7850, E=206e9, Poisson=0.3), []
    for part in parts:
        count = math.ceil(part.length / longest * (1.0 - 1e-9))
        section = {"idl": part.inner_diameter, "odl": part.outer_diameter, "material": steel}
        elements += [ross.ShaftElement(L=part.length / count, **section) for _ in range(count)]
    disks = [ross.DiskElement(n=d.station, m=d.mass, Id=d.transverse, Ip=d.polar) for d in discs]
    bearings = [ross.BearingElement(n=s.station, kxx=s.radial, kyy=s.radial, kzz=s.axial, cxx=0.0) for s in supports]
    return ross.Rotor(elements, disks, bearings)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shaft", "lines"),
    [
        ((STEPPED, 0.05, STEPPED_DISCS, STEPPED_BEARINGS), CAMPBELL),
        ((OVERHUNG, OVERHUNG_ELEMENT, OVERHUNG_DISCS, OVERHUNG_BEARINGS), OVERHUNG_CAMPBELL),
    ],
    ids=["stepped", "overhung"],
)
def test_printed_whirl_is_that_of_the_library(shaft, lines):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ross = pytest.importorskip("ross")
        built = rotor(ross, *shaft)
        for speed, values in lines.items():
            hertz = built.run_modal(speed, num_modes=48).wd / (2.0 * math.pi)
            for value, _ in values:
                assert np.abs(hertz - float(value)).min() <= 1e-7 * float(value)


def overhung_tables(speed: float):
    """The overhung rotor as a gearbox without stages."""
    discs = [
        {"mass": f"{d.mass} kg", "inertia": f"{d.polar} kg m^2", "transverse_inertia": f"{d.transverse} kg m^2"}
        | {"shaft": "rotor", "position": f"{d.station * OVERHUNG_ELEMENT!r} m"}
        for d in OVERHUNG_DISCS
    ]
    bearings = [
        {"shaft": "rotor", "position": f"{s.station * OVERHUNG_ELEMENT!r} m", "radial": f"{s.radial} N/m"}
        | ({"axial": f"{s.axial} N/m"} if s.axial else {})
        for s in OVERHUNG_BEARINGS
    ]
    names = ("length", "outer_diameter", "inner_diameter")
    parts = [{name: f"{getattr(part, name)!r} m" for name in names} for part in OVERHUNG]
    return {
        "model": "gearbox",
        "title": "overhung rotor",
        "shaft": [{"name": "rotor", "part": parts}],
        "mass": discs,
        "bearing": bearings,
        "load": [
            {"name": "motor", "shaft": "rotor", "position": "0 m"},
            {"name": "fan", "shaft": "rotor", "position": "0.6 m"},
        ],
        "operation": {
            "output": ["fan"],
            "load_case": [{"torque": {"motor": "10 N m"}, "speed": {"rotor": f"{speed!r} rad/s"}}],
        },
    }


@pytest.mark.parametrize("sense", [1, -1])
def test_a_gearbox_without_stages_whirls_as_the_rotor(sense):
    for speed, lines in OVERHUNG_CAMPBELL.items():
        found = solve_deflection(read_case(overhung_tables(sense * speed)))
        _, system, _ = linear_system(found)
        # the speeds are in the gyroscopic matrix of a gearbox
        ours = whirl_frequencies(system, 1.0)
        for value, way in lines:
            same = ours[ours[:, 1] == sense * way, 0]
            # other elements than those of the library
            assert np.abs(same - float(value)).min() <= 1e-4 * float(value)
