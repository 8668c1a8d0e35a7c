"""The contour plot of a relief search marks its optimum."""

import numpy as np


def test_the_optimum_is_marked_under_its_torque_alone():
    from femgear.study.figures import relief_contours

    amounts, lengths = np.array([2e-6, 4e-6, 6e-6]), np.array([0.4, 0.8, 1.2])
    ratios = np.array([np.full((3, 3), 0.8), [[0.9, 0.6, 0.1], [0.7, 0.5, 0.4], [0.9, 0.8, 0.7]]])
    figure = relief_contours(amounts, lengths, ratios, [50.0, 100.0], optimum=(3e-6, 1.1), design=100.0)
    names = [ax.get_legend_handles_labels()[1] for ax in figure.axes[:2]]
    assert names == [["chosen for 100 N m"], ["25 % of unmodified", "optimum at 100 N m"]]
    (legend,) = figure.legends
    assert {text.get_text() for text in legend.get_texts()} == {name for one in names for name in one}
    faces = [ax.lines[-1].get_markerfacecolor() for ax in figure.axes[:2]]
    assert faces[0] == "white" and faces[1] == figure.axes[1].lines[-1].get_color()
