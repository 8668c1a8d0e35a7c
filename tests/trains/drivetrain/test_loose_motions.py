"""Motions that nothing holds: counted by hand, whatever the sizes of springs and inertias."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from femgear.trains.drivetrain.case_file import drivetrain_of
from femgear.trains.drivetrain.checks import loose_motions
from femgear.trains.drivetrain.parts import BearingSection, BodySection, Drivetrain, ShaftSection
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[3] / "cases"


@pytest.fixture(scope="module")
def own():
    return drivetrain_of(read_case(CASES / "own_chain.toml"))


@pytest.mark.parametrize("name", ["wind_turbine_drivetrain", "grc_like_drivetrain", "own_chain"])
def test_shipped_chains_are_held(name):
    assert loose_motions(drivetrain_of(read_case(CASES / f"{name}.toml"))) == (0, ())


def test_sizes_do_not_matter(own):
    """Inertias of 1e-12 kg m^2, shafts of 70 m to 1 km, springs from 1e-3 to 1e15."""
    tiny = replace(own, bodies=tuple(one.changed(inertia=1e-12) for one in own.bodies))
    assert loose_motions(tiny)[0] == 0
    for length in (70.0, 1000.0):
        shafts = (own.shafts[0], own.shafts[1].changed(length=length))
        assert loose_motions(replace(own, shafts=shafts))[0] == 0
    for torsion, bending in ((1e-3, 1e15), (1e15, 1e-3), (1e-3, math.inf)):
        shafts = (own.shafts[0].changed(torsion=torsion, bending=bending), own.shafts[1])
        assert loose_motions(replace(own, shafts=shafts))[0] == 0


def test_true_mechanisms_are_counted(own):
    kept = own.bearings[:2]
    # the second shaft: two translations and two tilts; the mesh holds one of them, the spin stays
    count, names = loose_motions(replace(own, bearings=kept))
    shaft = {name.split(":")[0] for name in names}
    assert count == 4 and shaft <= {"wheel", "fan"}
    # the first shaft as well: the mesh joins both
    assert loose_motions(replace(own, bearings=()))[0] == 8
    # held by one bearing without tilt: it pivots in two planes
    hinge = Drivetrain(
        (
            BodySection.in_si(name="a", mass=1.0, inertia=1.0, transverse_inertia=1.0),
            BodySection.in_si(name="b", mass=1.0, inertia=1.0, transverse_inertia=1.0),
        ),
        (ShaftSection.in_si(between=("a", "b"), length=1.0, outer_diameter=0.05, elements=30),),
        bearings=(BearingSection.in_si(body="a", radial=1e8),),
    )
    assert loose_motions(hinge)[0] == 2
    assert loose_motions(replace(hinge, bearings=(BearingSection.in_si(body="a", radial=1e8, tilt=1e-3),)))[0] == 0
    assert (
        loose_motions(
            replace(
                hinge,
                bearings=(
                    BearingSection.in_si(body="a", radial=1e8),
                    BearingSection.in_si(body="b", radial=1e-3),
                ),
            )
        )[0]
        == 0
    )
    assert (
        loose_motions(replace(hinge, bearings=(BearingSection.in_si(body="a", radial=math.inf, tilt=math.inf),)))[0]
        == 0
    )


def test_one_body():
    free = Drivetrain((BodySection.in_si(name="a", mass=1.0, inertia=1.0, tilts=False),))
    assert loose_motions(free)[0] == 2
    assert loose_motions(replace(free, bearings=(BearingSection.in_si(body="a", radial=5.0),)))[0] == 0
