"""Sections of oil and losses: what they give, and what they refuse."""

import pytest

from femgear.case.lubrication import check_film, check_losses, oil_at, oil_doubts
from femgear.case.messages import oil_notices
from femgear.errors import CaseError
from femgear.trains.reading import read_case, with_values

PAIR = "cases/spur_pair.toml"
OIL = {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s", "temperature": "70 degC", "density": "900 kg/m^3"}
SCHLENK = {"friction": "schlenk", "roughness": "0.4 um"}
TABLE = {"line_loads": ["100 N/mm"], "speeds": ["1 m/s"], "coefficients": [[0.06]]}


def pair(losses=SCHLENK, oil=OIL):
    return with_values(read_case(PAIR), {"losses": losses, **({"lubricant": oil} if oil else {})})


def test_the_viscosity_is_that_at_the_temperature_of_operation_or_as_given():
    assert oil_at(pair(oil=OIL | {"temperature": "100 degC"})) == pytest.approx(11e-6 * 900.0)
    assert oil_at(pair(oil=OIL | {"temperature": "373.15 K"})) == pytest.approx(11e-6 * 900.0)
    assert oil_at(pair(oil=OIL), 313.15) == pytest.approx(100e-6 * 900.0)
    assert oil_at(pair(oil={"viscosity": "15 mm^2/s"})) == pytest.approx(15e-6 * 870.0)


@pytest.mark.parametrize(
    "losses, oil, key",
    [
        (SCHLENK, None, "lubricant.viscosity_40"),
        (SCHLENK, {"viscosity_40": "100 mm^2/s", "temperature": "70 degC"}, "lubricant.viscosity_100"),
        (SCHLENK, {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s"}, "lubricant.temperature"),
        ({"friction": "niemann"}, OIL, "losses.roughness"),
        ({"friction": "constant"}, None, "losses.coefficient"),
        ({"friction": "table"}, None, "losses.table"),
    ],
)
def test_what_is_missing_for_the_friction_is_named(losses, oil, key):
    with pytest.raises(CaseError) as refused:
        check_losses(pair(losses, oil))
    assert (refused.value.code, refused.value.key) == ("E-KEY-MISSING", key) and refused.value.remedies


@pytest.mark.parametrize(
    "changes, code",
    [
        ({"lubricant": OIL | {"viscosity_100": "120 mm^2/s"}}, "E-RANGE"),
        ({"lubricant": OIL | {"temperature": "700 degC"}}, "E-RANGE"),
        ({"lubricant": OIL | {"temperature": "70"}}, "E-UNIT"),
        ({"lubricant": OIL | {"viscosity_40": "100 mPa s"}}, "E-UNIT"),
        ({"lubricant": OIL | {"viscosity": "15 mm^2/s"}}, "E-DUPLICATE"),
        ({"losses": {"friction": "constant", "coefficient": 0.0}}, "E-RANGE"),
        ({"losses": {"friction": "wimmer"}}, "E-CHOICE"),
        (
            {"losses": {"table": {"line_loads": ["1 N/mm"], "speeds": ["1 m/s"], "coefficients": [[0.05, 0.04]]}}},
            "E-COUNT",
        ),
        (
            {"losses": {"table": {"line_loads": ["1 N/mm"] * 2, "speeds": ["1 m/s"], "coefficients": [[0.05]] * 2}}},
            "E-RANGE",
        ),
    ],
)
def test_values_that_cannot_be_are_refused(changes, code):
    with pytest.raises(CaseError) as refused:
        with_values(read_case(PAIR), changes)
    assert refused.value.code == code


def test_loads_of_a_table_that_descend_are_refused_with_what_they_are():
    table = {"line_loads": ["10 N/mm", "1 N/mm"], "speeds": ["1 m/s"], "coefficients": [[0.05], [0.04]]}
    with pytest.raises(CaseError) as refused:
        with_values(read_case(PAIR), {"losses": {"friction": "table", "table": table}})
    assert refused.value.message.startswith("line_loads") and refused.value.value == "10 N/mm, 1 N/mm"


@pytest.mark.parametrize(
    "kind, temperature, doubtful",
    [
        ("mineral", "-50 degC", True),
        ("mineral", "-9 degC", False),
        ("mineral", "150 degC", False),
        ("mineral", "250 degC", True),
        ("PAO", "-30 degC", False),
        ("PAO", "-50 degC", True),
    ],
)
def test_an_oil_beyond_the_range_of_the_law_is_a_doubt(kind, temperature, doubtful):
    findings = list(oil_doubts(pair(oil=OIL | {"kind": kind, "temperature": temperature})))
    assert [finding.code for finding in findings] == ["W-OIL"] * doubtful


def test_a_thin_oil_is_a_doubt_and_a_given_viscosity_none():
    thin = OIL | {"viscosity_40": "5 mm^2/s", "viscosity_100": "1.7 mm^2/s", "temperature": "120 degC"}
    (finding,) = oil_doubts(pair(oil=thin))
    assert "1.38 mm^2/s" in finding.text or "1.3" in finding.text
    assert not list(oil_doubts(pair(oil={"viscosity": "1 mm^2/s", "temperature": "250 degC"})))


def test_remedies_of_an_oil_can_be_followed():
    """Cold oil: its viscosity in operation is given, and then nothing is said; a film asks for the other two."""
    cold = pair(oil=OIL | {"temperature": "-50 degC"})
    assert "in place of both" in str(next(oil_doubts(cold)).remedy)
    alone = pair(oil={"viscosity": "5000 mm^2/s", "temperature": "-50 degC"})
    assert not [*oil_doubts(alone)]
    check_film(alone)
    film = pair(oil={"viscosity": "5000 mm^2/s", "temperature": "-50 degC", "permissible_film": 0.3})
    with pytest.raises(CaseError) as refused:
        check_film(film)
    assert "in place of viscosity, or leave permissible_film out" in str(refused.value.remedy)


@pytest.mark.parametrize(("name", "value"), [("coefficient", 0.02), ("table", TABLE)])
def test_a_coefficient_beside_a_formula_is_told(name, value):
    case = pair(losses=SCHLENK | {name: value})
    assert [one.key for one in oil_notices(case) if one.code == "W-UNUSED"] == [f"losses.{name}"]
