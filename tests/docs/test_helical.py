"""docs/helical.md: stiffness, natural frequencies and root stresses are those of its cases."""

import re
from pathlib import Path

import numpy as np
import pytest

from femgear import read_case
from femgear.stages.static import solve_static, solve_stress
from femgear.trains.helical.stages import solve_helical_modes, solve_helical_static

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "helical.md").read_text(encoding="utf-8")
PROSE = " ".join(PAGE.split())
NAMES = {
    "sequential (pairs)": "sequentially phased 1",
    "in phase": "in phase",
    "counter-phased": "counter-phased",
}


@pytest.mark.slow
def test_printed_stiffness_and_frequencies_are_those_of_the_case():
    case = read_case(ROOT / "cases" / "helical_30_20_70.toml")
    found = solve_helical_modes(case, solve_helical_static(case)).dataset()
    k = 1e-6 * found["mesh_stiffness"].values
    assert f"{k[0]:.0f} N/µm (sun-planet) and {k[4]:.0f} N/µm (planet-ring)" in PROSE
    table, kind = PAGE.split("## Kahraman's train")[1], ""
    rows = re.findall(r"^\|\s*([^|]*?)\s*\| \d+ \| [\d.]+ \| ([\d.]+) \|$", table, flags=re.MULTILINE)
    assert len(rows) == 14
    phasing, frequency = found["phasing"].values.astype(str), found["frequency"].values
    for name, printed in rows:
        kind = NAMES.get(name, kind)
        nearest = min(frequency[phasing == kind], key=lambda f, p=float(printed): abs(f - p))
        assert abs(nearest - float(printed)) < (0.051 if "." in printed else 0.51), (kind, printed)
    fluctuation = np.ptp(found["helical_stiffness"].values[0]) / found["helical_stiffness"].values[0].mean()
    assert f"leaves {fluctuation:.0%}".replace("%", " %") in PROSE


@pytest.mark.slow
def test_printed_root_stresses_are_those_of_the_case():
    case = read_case(ROOT / "cases" / "helical_23_24_73.toml")
    stress = solve_stress(case, solve_static(case)).dataset().isel(mesh=[0, 3])
    columns = (
        1e-6 * stress["root_worst"].values.ravel(),
        stress["root_face_factor"].values.ravel(),
        1e-6 * stress["iso_root_stress"].values.ravel(),
    )
    for name, largest, factor, nominal in zip(
        ("sun", "planet, sun side", "planet, ring side", "ring"), *columns, strict=True
    ):
        assert f"| {name} | {largest:.0f} | {factor:.2f} | {nominal:.0f} |" in PAGE
