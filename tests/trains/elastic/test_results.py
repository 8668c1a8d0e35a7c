"""Tables of the results of an elastic set."""

from report.test_figures import synthetic

from femgear.stages import static_figures as static_figures
from femgear.trains.elastic.results import describe_housing


def test_the_table_of_the_housing_has_both_sensors():
    block = describe_housing(synthetic.housing())
    column = block.header.index("microphone [dB(A)]")
    assert [row[column] for row in block.rows] == ["50.9", "87.7"]
    assert "1 m from the ring" in block.notes[-1] and "over its face width" in block.notes[-1]
