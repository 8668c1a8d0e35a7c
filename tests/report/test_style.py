"""What all figures share: colours, lines that agree, curves that keep their extremes, files."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from report.test_figures import synthetic

from femgear.errors import StorageError
from femgear.report import style
from femgear.report.style import COLOURS, drawn_lines
from femgear.stages import static_figures as static_figures


def test_identical_meshes_are_drawn_once():
    values = np.ones((6, 8))
    names = synthetic.MESHES
    assert drawn_lines(names, values) == [
        ("all sun-planet meshes (identical)", 0),
        ("all planet-ring meshes (identical)", 3),
    ]
    values[1, 3] = 1.1
    assert [text for text, _ in drawn_lines(names, values)] == [
        *synthetic.MESHES[:3],
        "all planet-ring meshes (identical)",
    ]
    alone = drawn_lines(["sun-planet 1", "planet 1-ring"], values[:2])
    assert alone == [("sun-planet 1", 0), ("planet 1-ring", 1)]


def test_meshes_of_a_family_that_agree_are_drawn_once():
    names = [*(f"sun-planet {n}" for n in (1, 2, 3, 4)), *(f"planet {n}-ring" for n in (1, 2, 3, 4))]
    one, other = np.sin(np.arange(9.0)), np.cos(np.arange(9.0))
    lines = drawn_lines(names, [one, other, one, other, one, one, one, one], partly=True)
    assert lines == [
        ("sun-planet 1, sun-planet 3 (identical)", 0),
        ("sun-planet 2, sun-planet 4 (identical)", 1),
        ("all planet-ring meshes (identical)", 4),
    ]
    lines = drawn_lines(names, np.diag(np.arange(1.0, 9.0)), partly=True)
    assert lines == [(name, row) for row, name in enumerate(names)]


def test_colours_differ_for_deuteranopes():
    """Vienot, Brettel and Mollon (1999): colours of lines stay apart when red and green are confused."""
    to_lms = np.array([[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]])
    rgb = np.array([[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in COLOURS]) ** 2.2
    lms = rgb @ to_lms.T
    lms[:, 1] = 0.494207 * lms[:, 0] + 1.24827 * lms[:, 2]
    seen = np.clip(lms @ np.linalg.inv(to_lms).T, 0, 1) ** (1 / 2.2)
    distance = np.linalg.norm(seen[:, None] - seen[None], axis=2) + np.eye(len(seen))
    assert distance.min() > 0.15


def test_a_figure_is_written_whole_or_not_at_all(tmp_path):
    figure = static_figures.load_sharing(synthetic.static())
    style.save_figure(figure, tmp_path / "a.png")
    style.save_figure(figure, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.png"]
    with pytest.raises(StorageError):
        style.save_figure(figure, tmp_path / "missing" / "a.png")


def test_figures_do_without_pyplot():
    package = Path(style.__file__).parents[1]
    drawing = {path for path in package.rglob("*.py") if "matplotlib" in path.read_text(encoding="utf-8")}
    drawing |= set(package.rglob("figures.py"))
    names = [".".join(path.relative_to(package.parent).with_suffix("").parts) for path in sorted(drawing)]
    assert {"femgear.report.style", "femgear.report.response"} <= set(names)
    assert len([name for name in names if name.startswith("femgear.trains.")]) >= 7
    code = f"import sys, {', '.join(names)}; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0
