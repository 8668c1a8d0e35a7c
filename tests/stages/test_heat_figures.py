"""Curves over the path of contact."""

import numpy as np
import xarray as xr
from stages.test_heat_results import mesh, result

from femgear.stages.heat_figures import HEAT_FIGURES, LOSSES_FIGURES, draw_contact_path
from femgear.stages.protocol import Drawn


def test_the_picture_has_the_curves_of_every_kind_of_mesh():
    heat = result(mesh(), mesh(film=0.1)).dataset()
    load, hot, film, sliding = draw_contact_path(heat).axes
    # curves of both kinds, those of X_Gamma beside them, both gears, the pitch point in each, two for the legend
    assert [len(axes.lines) for axes in (load, hot, film, sliding)] == [3, 6, 3, 6]
    place, values = film.lines[1].get_data()
    assert np.allclose(place, 1e3 * heat["path_place"].values[1]) and np.allclose(
        values, heat["film_ratio"].values[0, 1]
    )
    assert hot.lines[0].get_ydata().max() == 360.0 - 273.15 + 120.0


def test_there_is_no_picture_without_load():
    heat = result(mesh()).dataset()
    heat["path_load"] = 0.0 * heat["path_load"]
    assert HEAT_FIGURES.draw(Drawn(None, {"heat": heat})) == {}


def test_the_map_has_a_curve_for_every_torque():
    shares = {"torque_share": [0.5, 1.0], "speed_share": [0.5, 1.0, 2.0]}
    values = np.array([[0.97, 0.98, 0.985], [0.975, 0.985, 0.99]])
    losses = xr.Dataset({"efficiency_map": (("torque_share", "speed_share"), values)}, shares)
    (axes,) = LOSSES_FIGURES.draw(Drawn(None, {"losses": losses}))["efficiency_map"].axes
    assert np.allclose([line.get_ydata() for line in axes.lines], 100.0 * values)
    assert LOSSES_FIGURES.draw(Drawn(None, {"losses": losses.drop_vars("efficiency_map")})) == {}
