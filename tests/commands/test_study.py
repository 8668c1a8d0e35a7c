"""femgear/commands/study.py: what studies print."""

import re

from command_stand_ins import CASE, Narrow

from femgear import cli


def test_a_sweep_prints_its_table(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("rich.console.Console", Narrow)
    over = "sun.profile_shift=0.50,0.52,9.0"
    command = ["sweep", str(CASE), "-o", str(tmp_path / "out"), "--of", "contact ratio sun-planet"]
    code = cli.main([*command, "--over", over.removesuffix(",9.0")])
    out = re.sub("\x1b[^m]*m", "", capsys.readouterr().out)
    assert code == 0 and "Sweep" in out and "2 cases, 2 computed now" in out
    table = (tmp_path / "out" / "sweep.csv").read_text().splitlines()
    for line in table[1:]:
        shift, ratio = line.split(",")[:2]
        assert re.search(rf"{shift}\s+{float(ratio):.5g}\s", out)
    assert max(map(len, out.split(" cases, ")[0].splitlines())) <= 80
    command[3] = str(tmp_path / "one")
    assert cli.main([*command, "--over", "sun.profile_shift=0.50"]) == 0
    assert "1 case, 1 computed now" in capsys.readouterr().out
