"""Materials of gears whose teeth have none: of their shafts, of the gearbox, steel; and what is said of it."""

import pytest
from small_gearbox import pair_tables, set_on_shafts

from femgear.case.gear_set import materials_of
from femgear.trains.gearbox.case_file import teeth_of
from femgear.trains.reading import read_case

BRONZE, IRON = {"youngs_modulus": "110 GPa", "density": "8800 kg/m^3"}, {"youngs_modulus": "170 GPa"}


def moduli(tables, kind="pair") -> list[float]:
    """Moduli of the gears of the stage [GPa]."""
    return [1e-9 * one.youngs_modulus for one in materials_of(teeth_of(getattr(read_case(tables), kind)[0]))]


def without_material(tables, kind="pair"):
    del tables[kind][0]["teeth"]["material"]
    return tables


def told(tables) -> list[str]:
    return [one.text for one in read_case(tables).notices if one.key.endswith("teeth.material")]


def test_gears_without_a_material_are_of_steel_and_that_is_said():
    tables = without_material(pair_tables(teeth=True))
    assert moduli(tables) == pytest.approx([206.0, 206.0])
    assert told(tables) == ["the teeth have no material: steel is taken, 206 GPa"]
    assert not told(pair_tables(teeth=True))


def test_they_take_that_of_the_gearbox_and_of_their_shafts():
    tables = without_material(pair_tables(teeth=True)) | {"material": IRON}
    tables["shaft"][1]["material"] = BRONZE
    assert moduli(tables) == pytest.approx([170.0, 110.0])
    made = materials_of(teeth_of(read_case(tables).pair[0]))
    assert [one.density for one in made] == pytest.approx([7850.0, 8800.0])
    assert told(tables) == [
        "the teeth have no material: that of the gearbox is taken, 170 GPa, of gears on output 110 GPa"
    ]


def test_what_a_gear_says_itself_holds():
    tables = without_material(pair_tables(teeth=True))
    tables["shaft"][1]["material"] = BRONZE
    tables["pair"][0]["teeth"]["gear_2"]["material"] = {"youngs_modulus": "120 GPa"}
    assert moduli(tables) == pytest.approx([206.0, 120.0])


def test_teeth_with_a_material_keep_it_on_any_shaft():
    tables = pair_tables(teeth=True) | {"material": IRON}
    tables["shaft"][1]["material"] = BRONZE
    assert moduli(tables) == pytest.approx([206.0, 206.0])


def test_of_a_set_the_sun_takes_that_of_its_shaft_planets_and_ring_that_of_the_gearbox():
    tables = without_material(set_on_shafts(), "planetary") | {"material": IRON}
    tables["shaft"][0]["material"] = BRONZE
    assert moduli(tables, "planetary") == pytest.approx([110.0, 170.0, 170.0])


def test_the_case_that_is_written_reads_as_itself():
    case = read_case(without_material(pair_tables(teeth=True)) | {"material": IRON})
    again = read_case(case.source)
    assert again == case
    assert [one.text for one in again.notices] == [one.text for one in case.notices]
