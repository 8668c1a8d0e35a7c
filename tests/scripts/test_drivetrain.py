"""scripts/drivetrain.py on chains that have no gears, or no picture of contact loss."""

import pytest
from script_runs import run_script

pytestmark = pytest.mark.usefixtures("pictures_undrawn")


def run(path, output):
    return run_script("drivetrain.py", path, "-o", output, folder=path.parent)


@pytest.mark.slow
def test_drivetrain_takes_a_chain_without_gears(tmp_path):
    path = tmp_path / "discs.toml"
    path.write_text("""
        model = "drivetrain"
        title = "two discs"
        body = [{name = "a", inertia = "1 kg m^2", mass = "10 kg", tilts = false},
                {name = "b", inertia = "2 kg m^2", mass = "10 kg", tilts = false}]
        shaft = [{between = ["a", "b"], length = "0.5 m", outer_diameter = "50 mm"}]
        bearing = [{body = "a", radial = "1e8 N/m"}, {body = "b", radial = "1e8 N/m"}]
        operation = {speed = "100 rpm", torque = [{body = "a", torque = "30 N m"}]}
        simulation = {duration = "0.2 s", modes = 0}
    """)
    done = run(path, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "Transient" in done.stdout and "Spectrum" not in done.stdout
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"forces.csv", "transient_speeds.png"}


def test_drivetrain_keeps_its_tables_when_an_extra_picture_fails(tmp_path):
    """The first torque opens the flanks that the later ones press together: no static start."""
    path = tmp_path / "pair.toml"
    path.write_text("""
        model = "drivetrain"
        title = "two gears"
        body = [{name = "a", inertia = "0.2 kg m^2", mass = "10 kg", tilts = false},
                {name = "b", inertia = "2 kg m^2", mass = "10 kg", tilts = false}]
        bearing = [{body = "a", radial = "1e8 N/m"}, {body = "b", radial = "1e8 N/m"}]
        [[parallel]]
        between = ["a", "b"]
        teeth = [23, 71]
        module = "3 mm"
        mesh = {stiffness = "3e8 N/m", contact_ratio = 1.68}
        [operation]
        speed = "1000 rpm"
        [[operation.torque]]
        body = "a"
        times = ["0 s", "10 ms"]
        torques = ["-60 N m", "60 N m"]
        [[operation.torque]]
        body = "b"
        share = 1.0
        [simulation]
        duration = "0.2 s"
        damping_ratio = 0.03
        modes = 0
    """)
    done = run(path, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "contact loss: no picture: [E-START]" in done.stdout and "Spectrum" in done.stdout
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert "forces.csv" in names and "backlash.png" not in names
