"""Figures drawn in two processes are those drawn in one."""

import sys
import threading

import pytest

from femgear import second_process
from femgear.report import page, style
from femgear.stages.protocol import Drawn, Figures, Stage, Train

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="one process elsewhere")


def test_figures_are_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr(second_process, "second_core", lambda: True)

    def drawn_by(stage):
        figure, (ax,) = style.new_figure()
        ax.plot([0, 1], [stage, 2.0])
        style.label(ax, "time [s]", "force [N]", "a line")
        return {f"picture_{stage}": figure}

    stages = tuple(Stage(str(n), "", *[None] * 3) for n in range(3))
    figures = {str(n): Figures({}, draw=lambda _, n=n: drawn_by(n)) for n in range(3)}
    train = Train("sample", "a sample", stages, lambda case: (), lambda case: (), figures)
    drawn = Drawn(None, {str(n): None for n in range(3)})
    begun = threading.active_count()
    names = page.write_figures(tmp_path, train, drawn)
    assert names == [*(f"picture_{n}.png" for n in range(3)), "charts.json"] and threading.active_count() == begun
    for n in range(3):
        assert (tmp_path / names[n]).read_bytes() == style.png_bytes(drawn_by(n)[f"picture_{n}"])
