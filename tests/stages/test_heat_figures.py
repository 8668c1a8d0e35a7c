"""Curves over the path of contact."""

import numpy as np
from stages.test_heat_results import mesh, result

from femgear.stages.heat_figures import HEAT_FIGURES, draw_contact_path
from femgear.stages.protocol import Drawn


def test_the_picture_has_the_curves_of_every_kind_of_mesh():
    heat = result(mesh(), mesh(film=0.1)).dataset()
    load, hot, film, sliding = draw_contact_path(heat).axes
    # curves of both kinds, those of X_Gamma beside them, both gears, and the pitch point in each
    assert [len(axes.lines) for axes in (load, hot, film, sliding)] == [3, 5, 3, 5]
    place, values = film.lines[1].get_data()
    assert np.allclose(place, 1e3 * heat["path_place"].values[1]) and np.allclose(
        values, heat["film_ratio"].values[0, 1]
    )
    assert hot.lines[0].get_ydata().max() == 360.0 - 273.15 + 120.0


def test_there_is_no_picture_without_load():
    heat = result(mesh()).dataset()
    heat["path_load"] = 0.0 * heat["path_load"]
    assert HEAT_FIGURES.draw(Drawn(None, {"heat": heat})) == {}
