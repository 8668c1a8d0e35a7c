"""Members on shafts: the support stiffness of a case from the parts of a shaft."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import shaft_lines, support_stiffness
from femgear.errors import CaseError, GeometryError
from femgear.trains.reading import read_case, with_value

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"
PARTS = [
    {"length": "60 mm", "outer_diameter": "30 mm"},
    {"length": "40 mm", "outer_diameter": "24 mm", "inner_diameter": "8 mm"},
]


def on_shaft(parts, member="sun"):
    """The reference case with a shaft in place of the support stiffness of a member."""
    text = CASE.read_text(encoding="utf-8")
    lines, inside = [], False
    for line in text.splitlines():
        inside = line.startswith(f"[{member}]") or (inside and not line.startswith("["))
        if not (inside and line.startswith("support_stiffness")):
            lines.append(line)
    from femgear.case.text import parse, write
    from femgear.trains.reading import parse_case

    data = parse("\n".join(lines), "case.toml")
    data[member]["support_shaft"] = parts
    return parse_case(write(data), name="case.toml")


def test_a_slender_shaft_is_the_cantilever_of_bernoulli_and_timoshenko():
    """K = 3 E I / l^3 with a shear part: F/X = 1/(l^3/3EI + l/(kappa G A)), kappa = 0.886 for nu = 0.3."""
    case = on_shaft([{"length": "400 mm", "outer_diameter": "40 mm"}])
    E, G, d, length = 206e9, 206e9 / 2.6, 0.04, 0.4
    kappa = 6 * 1.3 / (7 + 6 * 0.3)
    soft = length**3 / (3 * E * np.pi * d**4 / 64) + length / (kappa * G * np.pi * d**2 / 4)
    assert support_stiffness(case, "sun") == pytest.approx(1.0 / soft, rel=0.01)


def test_parts_of_a_stepped_shaft_and_what_check_says_of_them():
    case = on_shaft(PARTS, "carrier")
    stiffness = support_stiffness(case, "carrier")
    assert 1e6 < stiffness < 1e9
    (said,) = shaft_lines(case)
    assert said.startswith("support of the carrier from its shaft") and "beam" in said
    stiffer = with_value(case, "carrier.support_shaft", [PARTS[0]])
    assert support_stiffness(stiffer, "carrier") > stiffness
    assert case.location("carrier.support_shaft").startswith("case.toml:")


@pytest.mark.parametrize(
    ("parts", "error", "code"),
    [
        ([{"length": "60 mm"}], CaseError, "outer_diameter"),
        ([{"length": "0 mm", "outer_diameter": "30 mm"}], CaseError, "E-RANGE"),
        ([{"length": "60 mm", "outer_diameter": "30"}], CaseError, "E-UNIT"),
        (
            [{"length": "60 mm", "outer_diameter": "30 mm", "inner_diameter": "30 mm"}],
            GeometryError,
            "E-SHAFT",
        ),
        (
            [PARTS[0], {"length": "9 mm", "outer_diameter": "90 mm", "inner_diameter": "40 mm"}],
            GeometryError,
            "E-SHAFT",
        ),
    ],
)
def test_shafts_that_are_none(parts, error, code):
    with pytest.raises(error, match=code) as caught:
        on_shaft(parts)
    assert "sun.support" in str(caught.value)


def test_a_shell_too_thin_for_elements_is_refused_in_words_of_the_case():
    part = {"length": "60 mm", "outer_diameter": "20 mm", "inner_diameter": "19.9 mm"}
    with pytest.raises(GeometryError, match="E-SHAFT") as caught:
        on_shaft([part])
    assert "sun.support_shaft" in str(caught.value) and "thinnest wall" in str(caught.value)


def test_cases_with_shafts_are_read_checked_and_changed_without_finite_elements(monkeypatch, tmp_path, capsys):
    """The first stage that needs the support computes it."""
    from femgear.cli import main
    from femgear.fe import meshing, shaft
    from femgear.trains.reading import to_toml

    def none(*_, **__):
        raise AssertionError("a grid of the shaft")

    monkeypatch.setattr(shaft, "mesh_outline", none)
    monkeypatch.setattr(meshing, "mesh_outline", none)
    part = {"length": "61 mm", "outer_diameter": "31 mm"}
    case = with_value(on_shaft([part]), "operation.torque", "120 N m")
    path = tmp_path / "case.toml"
    path.write_text(to_toml(case), encoding="utf-8")
    assert main(["check", str(path)]) == 0
    assert "N/um as a beam" in " ".join(capsys.readouterr().out.split())
    with pytest.raises(AssertionError, match="a grid of the shaft"):
        support_stiffness(case, "sun")


def test_stiffness_and_shaft_together_are_refused():
    with pytest.raises(CaseError, match="E-DUPLICATE"):
        with_value(read_case(CASE), "sun.support_shaft", PARTS)
