"""docs/casings.md: its commands and examples run as they stand, and print what it says."""

import re

import pytest
from page_examples import read_page, run_examples
from script_runs import run_script

from femgear.exchange.node_tables import read_nodes

PAGE, EXAMPLES, PRINTED = read_page("casings.md")


@pytest.mark.parametrize("coarse", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["coarse", "as it stands"])
def test_the_page_runs(coarse, tmp_path, monkeypatch):
    words = re.search(r"^\.venv/bin/python scripts/(casing\.py) (.+)$", PAGE, re.MULTILINE)
    size = 0.02 if coarse else 0.009
    command = words[1], *words[2].split(), *(["--size", size] if coarse else [])
    done = run_script(*command, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    monkeypatch.chdir(tmp_path)
    table, *printed = PRINTED
    found = run_examples("casings.md", EXAMPLES)
    if coarse:
        # frequencies, stiffness and the modes in the range are those of larger elements
        found, printed = (re.sub(r"\[[\d ]+\]|\d+(?= N/um| of )", "", "".join(one)) for one in (found, printed))
    assert found == printed
    (tmp_path / "table.csv").write_text(table)
    written = {one.number: one for one in read_nodes(tmp_path / "out/casing/nodes.csv")}
    for one in read_nodes(tmp_path / "table.csv")[:3]:
        same = written[one.number]
        assert (one.role, one.name, one.dofs, one.direction) == (
            same.role,
            same.name,
            same.dofs,
            same.direction,
        )
        assert abs(one.position - same.position).max() < (size if one.role == "sensor" else 1e-9)
    # what is there of the same sizes is not made again
    before = (tmp_path / "out/casing/casing.pch").stat().st_mtime_ns
    assert run_script(*command, folder=tmp_path).returncode == 0
    assert (tmp_path / "out/casing/casing.pch").stat().st_mtime_ns == before
