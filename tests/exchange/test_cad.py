"""Gears for CAD: volumes of solids against exact areas, outlines of DXF files, refusals."""

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.cli import main
from femgear.errors import CaseError, StorageError
from femgear.exchange import cad
from femgear.exchange.cad import PlacedGear, gear_area, half_curves, placed_gears, write_cad, write_dxf, write_step
from femgear.stages.gears_in_space import case_bodies
from femgear.trains.gearbox.solid_bodies import gearbox_bodies
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[2] / "cases"
READ = """import gmsh, sys
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
gmsh.model.occ.importShapes(sys.argv[1])
gmsh.model.occ.synchronize()
for _, tag in gmsh.model.getEntities(3):
    print("volume", gmsh.model.occ.getMass(3, tag), *gmsh.model.occ.getCenterOfMass(3, tag))
gmsh.finalize()"""


def read_back(path):
    """Volume [m^3] and centre of mass [m] of every body of a STEP file, as Gmsh reads them."""
    done = subprocess.run(
        [sys.executable, "-c", READ, str(path)], capture_output=True, text=True, timeout=900, check=True
    )
    rows = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("volume")]
    numbers = np.array(rows, float)
    return 1e-9 * numbers[:, 0], 1e-3 * numbers[:, 1:]


def test_the_sun_is_as_large_as_its_exact_area_and_in_its_place(tmp_path):
    gear = planetary_set(read_case(CASES / "planetary_27_40_108.toml")).sun
    placed = PlacedGear("sun", gear, (0.02, -0.01), (0.005, 0.005 + gear.face_width), angle=0.1)
    (volume,) = write_step([placed], tmp_path / "sun.step")
    exact = gear_area(gear) * gear.face_width
    assert volume == pytest.approx(exact, rel=1e-6)
    volumes, centres = read_back(tmp_path / "sun.step")
    assert volumes == pytest.approx([exact], rel=1e-6)
    assert centres[0] == pytest.approx([0.02, -0.01, 0.005 + 0.5 * gear.face_width], abs=1e-8)
    assert [path.name for path in tmp_path.iterdir()] == ["sun.step"]


@pytest.mark.slow
def test_the_reference_set_is_read_back_with_its_volumes(tmp_path):
    case = read_case(CASES / "planetary_27_40_108.toml")
    gears = placed_gears(case_bodies(case))
    write_cad(gears, tmp_path / "set.step")
    volumes, _ = read_back(tmp_path / "set.step")
    exact = sorted(gear_area(placed.gear) * placed.gear.face_width for placed in gears)
    assert sorted(volumes) == pytest.approx(exact, rel=1e-5)


@pytest.mark.slow
def test_helical_teeth_keep_their_volume(tmp_path):
    gears = placed_gears(gearbox_bodies(read_case(CASES / "e_axle.toml"), {}))
    pinion = gears[0]
    assert abs(pinion.twist) > 0.05
    (volume,) = write_step([pinion], tmp_path / "pinion.step")
    assert volume == pytest.approx(gear_area(pinion.gear) * (pinion.ends[1] - pinion.ends[0]), rel=1e-4)


def test_curves_of_half_a_tooth_join_from_its_middle_to_that_of_the_gap():
    for gear in planetary_set(read_case(CASES / "planetary_27_40_108.toml")).gears:
        curves = list(half_curves(gear).values())
        for first, second in pairwise(curves):
            assert first[-1] == pytest.approx(second[0], abs=1e-12)
        assert curves[0][0, 1] == pytest.approx(0.0, abs=1e-12)
        assert np.arctan2(*curves[-1][-1, ::-1]) == pytest.approx(np.pi / gear.teeth)


def test_the_outline_of_a_dxf_is_closed_and_lies_between_tip_and_root(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    gears = placed_gears(case_bodies(read_case(CASES / "spur_pair.toml")))
    write_dxf(gears, tmp_path / "pair.dxf")
    drawing = ezdxf.readfile(tmp_path / "pair.dxf")
    assert drawing.units == 4  # mm
    for placed in gears:
        curves = [one for one in drawing.modelspace() if one.dxf.layer == placed.name]
        kinds = [one.dxftype() for one in curves]
        teeth = placed.gear.teeth
        assert (kinds.count("SPLINE"), kinds.count("CIRCLE")) == (4 * teeth, 1) and kinds.count("ARC") >= teeth
        centre = 1e3 * np.array(placed.axis)
        ends = []
        for one in curves:
            if one.dxftype() == "SPLINE":
                points = np.array([tuple(point)[:2] for point in one.fit_points])
                ends += [points[0], points[-1]]
            elif one.dxftype() == "ARC":
                ends += [np.array(tuple(one.start_point)[:2]), np.array(tuple(one.end_point)[:2])]
        ends = np.array(ends)
        radius = np.hypot(*(ends - centre).T)
        assert (
            radius.min() >= 1e3 * placed.gear.root_radius - 1e-3 and radius.max() <= 1e3 * placed.gear.tip_radius + 1e-6
        )
        # every end meets that of one other curve
        distance = np.hypot(*(ends[:, None] - ends[None]).transpose(2, 0, 1))
        assert (np.sort(distance, axis=1)[:, 1] < 1e-6).all()


def test_other_formats_cases_without_teeth_and_files_that_are_there_are_refused(tmp_path, capsys):
    with pytest.raises(CaseError, match=r"tells its format"):
        write_cad((), tmp_path / "pair.iges")
    with pytest.raises(CaseError) as refused:
        placed_gears(())
    assert refused.value.code == "E-TEETH"
    assert main(["cad", str(CASES / "gear_pair.toml"), "-o", str(tmp_path / "a.step")]) == 2
    (tmp_path / "pair.dxf").touch()
    assert main(["cad", str(CASES / "spur_pair.toml"), "-o", str(tmp_path / "pair.dxf")]) == 2
    assert "E-OUTPUT" in capsys.readouterr().err
    assert main(["cad", str(CASES / "spur_pair.toml"), "-o", str(tmp_path / "pair.dxf"), "--force"]) == 0


def test_what_opencascade_refuses_is_told_and_leaves_no_file(tmp_path, monkeypatch):
    gear = planetary_set(read_case(CASES / "spur_pair.toml")).gears[0]
    curves = {name: 0.0 * points for name, points in half_curves(gear).items()}
    monkeypatch.setattr(cad, "half_curves", lambda gear: curves)
    with pytest.raises(StorageError) as refused:
        write_step([PlacedGear("a", gear, (0.0, 0.0), (0.0, 0.01))], tmp_path / "a.step")
    assert refused.value.code == "E-CAD" and not list(tmp_path.iterdir())
