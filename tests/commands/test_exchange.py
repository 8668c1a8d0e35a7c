"""femgear/commands/exchange.py: files of other programs."""

from pathlib import Path

import numpy as np
import pytest
from command_stand_ins import CASE, STAGES

from femgear import cli
from femgear.trains.reading import open_results, read_case

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")


def test_export_writes_every_number_with_its_unit(tmp_path, capsys, pipeline):
    import pandas as pd

    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out), "--no-pictures"]) == 0
    assert cli.main(["export", str(out)]) == 2
    assert "--csv" in capsys.readouterr().err
    assert cli.main(["export", str(out), "--csv"]) == 0
    printed, results, tables = capsys.readouterr().out, open_results(out), {}
    assert "modes_dof_mode.csv" in printed
    for stage in STAGES:
        for name, one in results[stage].data_vars.items():
            path = out / "exported" / ("_".join((stage, *one.dims)) + ".csv")
            if not one.size:  # a heading alone tells nothing
                assert not path.exists()
                continue
            if path not in tables:
                tables[path] = pd.read_csv(path, keep_default_na=False, na_values=[""])
            table = tables[path]
            column = name if one.dtype.kind in "OUSb" else f"{name} [{one.attrs['units']}]"
            if one.dims:
                stored = table[column].to_numpy()
                if one.dtype.kind in "OUSb":
                    assert list(stored) == list(one.values.ravel())
                else:
                    np.testing.assert_allclose(stored, one.values.ravel(), rtol=1e-14)
                place = [table.columns.get_loc(c) for c in table.columns if c.split(" [")[0] in one.dims]
                assert place == list(range(len(one.dims)))
            else:
                assert table.set_index("name").value[name] == str(one.item())
    assert cli.main(["run", str(CASE), "-o", str(out), "--no-pictures", "--force", "--only", "static"]) == 0
    # tables of other results
    assert not (out / "exported").exists()


def test_rexs_in_and_out(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["rexs", str(CASE), "-o", "stage.rexs"]) == 0
    assert cli.main(["import", "stage.rexs", "-o", "back.toml"]) == 0
    out = capsys.readouterr().out
    assert "written: back.toml" in out and "assumed: 8" in out and "not used" in out
    assert read_case("back.toml").operation == read_case(CASE).operation
    assert cli.main(["rexs", str(CASE), "-o", "stage.rexs"]) == 2
    assert cli.main(["import", "stage.rexs", "-o", "back.toml", "--force", "--stage", "99"]) == 2
    assert "--stage" in capsys.readouterr().err
    assert cli.main(["rexs", str(CASE.with_name("spur_pair.toml")), "-o", "pair.rexs"]) == 2
    assert "E-MODEL" in capsys.readouterr().err and not Path("pair.rexs").exists()


def test_export_writes_what_can_be_and_names_what_cannot(tmp_path, capsys):
    """A pair has no modes of a ring and no microphone; a contact alone has no sound."""
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE.with_name("spur_pair.toml")), "-o", str(out), "--only", "static"]) == 0
    capsys.readouterr()
    assert cli.main(["export", str(out), "--csv", "--wav", "--mat"]) == 2
    printed = capsys.readouterr()
    assert (out / "exported" / "results.mat").is_file() and (out / "exported" / "static_mesh.csv").is_file()
    assert "not written: --wav" in printed.out and "[E-STAGE]" in printed.err and "--wav" in printed.err
    # nothing can be written: nothing is
    assert cli.main(["export", str(out), "--wav", "-o", str(tmp_path / "none")]) == 2
    assert not (tmp_path / "none").exists()


def test_a_model_that_cannot_be_leaves_the_others(tmp_path, capsys):
    """Weight and clearances of a planar case have no linear model; its stiffness is a table."""
    case, table, unit = CASE.with_name("nrel_pgb_static.toml"), tmp_path / "k.csv", tmp_path / "set.npz"
    words = ["export", str(case), "--state-space", str(unit), "--stiffness-table", str(table)]
    assert cli.main(words) == 2
    printed = capsys.readouterr()
    assert table.is_file() and not unit.exists()
    assert "not written: --state-space" in printed.out and "E-MODEL" in printed.err


def test_the_harmonics_of_a_model_stand_beside_those_of_its_run(tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE.with_name("spur_pair.toml")), "-o", str(out), "--no-pictures"]) == 0
    assert cli.main(["export", str(out), "--state-space", str(tmp_path / "pair.npz")]) == 0
    data = open_results(out).dynamics
    kept = round(float(data["excitation_limit"][0] / data["mesh_frequency"][0]))
    assert f"mesh harmonics in its tables: 100, of the run: {kept} at 1,500 rpm" in capsys.readouterr().out
