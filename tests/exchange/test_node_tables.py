"""Tables of nodes: rows as they were written, and what is refused."""

import pytest

from femgear.errors import CaseError
from femgear.exchange.node_tables import feet_of, read_nodes
from femgear.storage.files import write_csv


def test_table_of_nodes_is_read_as_it_was_written(tmp_path):
    header = ("node", "role", "x", "y", "z", "direction", "dofs")
    rows = [(1, "seat A", -0.1, 0.0, -2e-3, "", "123456"), (2, "sensor top", "-.5", 0, 0, "-z", "123")]
    write_csv(tmp_path / "nodes.csv", header, rows)
    seat, sensor = read_nodes(tmp_path / "nodes.csv", {"seat": True, "sensor": True, "foot": True})
    assert sensor.direction == "-z" and seat.position.tolist() == [-0.1, 0.0, -2e-3] and sensor.position[0] == -0.5
    # tables that former versions wrote have an apostrophe before it
    text = (tmp_path / "nodes.csv").read_text()
    (tmp_path / "former.csv").write_text(text.replace(",-z,", ",'-z,"))
    assert read_nodes(tmp_path / "former.csv", {"seat": True, "sensor": True})[1].direction == "-z"


@pytest.mark.parametrize(
    ("row", "code"),
    [
        ("1,ring,0,0,0", None),
        ("1,foot left,0,0,0", "E-COUNT"),
        ("1,ring,0,nan,0", "E-CHOICE"),
        ("1.5,ring,0,0,0", "E-CHOICE"),
        ("1,sensor,0,0,0", "E-CHOICE"),
        ("1,pedestal A,0,0,0", "E-CHOICE"),
    ],
)
def test_rows_are_read_or_refused_with_the_roles_that_there_are(row, code, tmp_path):
    path = tmp_path / "nodes.csv"
    path.write_text(f"node,role,x,y,z\n{row}\n")
    if code is None:
        (node,) = read_nodes(path)
        assert (node.number, node.role, node.direction, node.dofs) == (1, "ring", "radial", "123")
        return
    with pytest.raises(CaseError) as error:
        read_nodes(path)
    assert error.value.code == code and error.value.file == str(path)
    assert code == "E-COUNT" or "ring or sensor NAME or foot NAME or centre" in error.value.limit.replace(", ", " or ")


def test_feet_are_named_once_however_many_nodes_they_have(tmp_path):
    path = tmp_path / "nodes.csv"
    path.write_text("node,role\n1,ring\n2,foot left\n3,foot right\n4,foot left\n")
    assert feet_of(read_nodes(path)) == ["left", "right"]
