"""Pictures of the vibration of a pair."""

import pytest
from trains.pair.test_stages import solved

from femgear.report.charts import chart
from femgear.stages.protocol import Drawn
from femgear.trains.pair.figures import RUNUP
from femgear.trains.pair.stages import solve_pair_runup


@pytest.mark.parametrize(("speeds", "crossings"), [(("1500 rpm", "1900 rpm"), True), (("20 rpm",), False)])
def test_campbell_diagram_shows_the_mode_and_the_harmonics_that_meet_it(speeds, crossings):
    case, modes, _ = solved(("operation.speeds", speeds))
    runup = solve_pair_runup(case, modes).dataset()
    figure = RUNUP.draw(Drawn(case, {"runup": runup, "modes": modes.dataset()}))["campbell"]
    (ax,) = figure.axes
    labels = [line.get_label() for line in ax.get_lines()]
    met = len(ax.collections[0].get_offsets())
    assert (met > 3) == ("torsional mode" in labels) == crossings
    assert chart(figure) is not None
