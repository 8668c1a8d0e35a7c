"""Figures of mesh phasing show what the tables say."""

import numpy as np
import pytest
from planet_phasing import mesh_force_spectra, resultant_chart

from femgear.gears.phasing import MeshPhasing, phasing_table
from femgear.trains.helical.figures import phase_diagram


def test_hands_of_the_dials_are_the_phases():
    phasing = MeshPhasing(29, 71, (0, 25, 50, 75), lag=0.25)
    figure = phase_diagram(phasing, harmonics=(1, 2))
    for ax, h in zip(figure.axes, (1, 2)):
        for name, phases in (("sun mesh", phasing.phases[:4]), ("ring mesh", phasing.phases[4:])):
            lines = [line for line in ax.lines if line.get_label() == name]
            hands = np.array([np.diff(line.get_xdata() + 1j * line.get_ydata())[0] for line in lines])
            assert hands / np.abs(hands) == pytest.approx(1j * np.exp(2j * np.pi * h * phases), abs=1e-9)
    titles = [ax.get_title() for ax in figure.axes]
    assert titles == ["harmonic 1: sequentially phased", "harmonic 2: counter-phased"]
    assert [text.get_text() for text in figure.axes[0].texts][-1] == "lateral 100 %"
    assert "nothing" in figure.axes[1].texts[-1].get_text()


@pytest.mark.parametrize("planets", [1, 2, 9])
def test_dials_of_any_number_of_planets(planets):
    phasing = MeshPhasing(27, 9 * 9, tuple(range(0, 108, 108 // planets))[:planets])
    (ax,) = phase_diagram(phasing, harmonics=(1,)).axes
    assert len([line for line in ax.lines if line.get_label() == "sun mesh"]) == planets


def test_areas_are_the_shares():
    table = phasing_table(MeshPhasing(30, 72, (0, 21, 51, 72)), range(1, 4))
    figure = resultant_chart({"pairs": table})
    (ax,) = [ax for ax in figure.axes if ax.get_visible()]
    sizes = [np.atleast_1d(marks.get_sizes()) / 130 for marks in ax.collections]
    assert sizes[0] == pytest.approx(table.members[:, 0, 0])
    assert len(sizes[1]) == 0 and len(sizes[3]) == 0
    assert sizes[2] == pytest.approx(table.modes[:, 0])
    assert sizes[4] == pytest.approx(table.modes[:, 2])


def test_equal_meshes_are_drawn_once():
    frequency = np.linspace(100, 5000, 50)
    alike = np.abs(np.random.default_rng(3).normal(size=(2, 50, 1))) * np.ones(2)
    apart = alike * (1.0, 0.5)
    forces, modes = {"alike": alike, "apart": apart}, {"planet": np.array([900.0])}
    figure = mesh_force_spectra(frequency, forces, modes=modes, meshes=("one", "two"))
    counts = [len(ax.lines) for ax in figure.axes if ax.get_visible()]
    assert counts == [3, 5]
    assert figure.axes[1].lines[1].get_ydata() == pytest.approx(apart[0, :, 1])
    assert figure.axes[0].lines[-1].get_xdata() == pytest.approx([0.9])
