"""What tooth numbers are searched for, as a user says it."""

from dataclasses import fields

from femgear.gears.tooth_search import ToothDemand
from femgear.study.teeth import tooth_demand
from femgear.study.teeth_request import TeethStrength, WantedTeeth


def test_what_is_left_out_is_what_the_search_takes_without_it():
    assert tooth_demand(3.6, WantedTeeth(), TeethStrength()) == ToothDemand(ratio=3.6)
    names = {field.name for kind in (WantedTeeth, TeethStrength) for field in fields(kind)}
    assert {field.name for field in fields(ToothDemand)} - {"ratio"} <= names
