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
from femgear.trains.reading import read_case, to_toml, with_values

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


@pytest.mark.parametrize("twist", [0.0, 0.2])
def test_a_missing_tooth_is_gone_from_the_solid(tmp_path, twist):
    gear = planetary_set(read_case(CASES / "planetary_27_40_108.toml")).sun
    width = (0.0, gear.face_width)
    placed = PlacedGear("sun", gear, (0.0, 0.0), width, twist=twist, short=((3, gear.root_radius),))
    (volume,) = write_step([placed], tmp_path / "sun.step")
    # of its sector a part of the annulus from bore to root is left
    sector = (gear_area(gear) - np.pi * (gear.root_radius**2 - gear.rim_radius**2)) / gear.teeth
    exact = (gear_area(gear) - sector) * gear.face_width
    assert volume == pytest.approx(exact, rel=1e-6 if twist == 0.0 else 1e-4)
    if twist == 0.0:
        _, centres = read_back(tmp_path / "sun.step")
        away = np.arctan2(*centres[0, 1::-1]) - 2.0 * np.pi * 3 / gear.teeth
        assert np.cos(away) == pytest.approx(-1.0, abs=1e-6)


@pytest.mark.slow
def test_a_broken_tip_is_cut_off_the_ring(tmp_path):
    gear = planetary_set(read_case(CASES / "planetary_27_40_108.toml")).ring
    reach = gear.tip_radius + 0.4e-3
    whole, short = (
        write_step([PlacedGear("ring", gear, (0.0, 0.0), (0.0, 0.01), short=teeth)], tmp_path / f"{len(teeth)}.step")
        for teeth in ((), ((5, reach),))
    )
    curves = half_curves(gear)
    x, y = curves["flank"].T
    radius = np.linspace(gear.tip_radius, reach, 200)
    by_radius = np.argsort(np.hypot(x, y))
    half = np.interp(radius, np.hypot(x, y)[by_radius], np.abs(np.arctan2(y, x))[by_radius])
    # area between the tip and the radius that is left, of both halves
    missing = 2.0 * np.trapezoid(radius * half, radius) * 0.01
    assert whole[0] - short[0] == pytest.approx(missing, rel=1e-3)


def test_short_teeth_have_short_outlines(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    gears = planetary_set(read_case(CASES / "planetary_27_40_108.toml"))
    sun, reach = gears.sun, gears.sun.tip_radius - 0.5e-3
    placed = PlacedGear("sun", sun, (0.0, 0.0), (0.0, 0.01), short=((0, reach), (5, sun.root_radius)))
    write_dxf([placed], tmp_path / "sun.dxf")
    space = ezdxf.readfile(tmp_path / "sun.dxf").modelspace()
    radii = np.array([arc.dxf.radius for arc in space.query("ARC")])
    assert np.isclose(radii, 1e3 * sun.tip_radius, rtol=1e-9).sum() == sun.teeth - 2
    assert np.isclose(radii, 1e3 * reach, rtol=1e-9).sum() == 1
    whole = sun.teeth * 4
    assert len(space.query("SPLINE")) == whole - 4
    ends = [np.hypot(*np.array(spline.fit_points)[:, :2].T).max() for spline in space.query("SPLINE")]
    assert np.isclose(ends, 1e3 * reach, rtol=1e-9).sum() == 2


def test_what_is_not_drawn_is_told(tmp_path, capsys):
    case = read_case(CASES / "planetary_27_40_108.toml")
    wear = {"kind": "wear", "tooth": 4, "flank": "left", "depth": "5 um"}
    faulty = with_values(case, {"sun.fault": [{"kind": "missing", "tooth": 3}, wear]})
    (tmp_path / "case.toml").write_text(to_toml(faulty), encoding="utf-8")
    assert main(["cad", str(tmp_path / "case.toml"), "-o", str(tmp_path / "case.dxf")]) == 0
    told = capsys.readouterr()
    assert "not drawn: sun.fault[1] (wear)" in told.out + told.err
