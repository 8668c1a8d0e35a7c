"""Tables of losses, whatever they come from."""

import numpy as np

from femgear.stages.losses import solve_losses
from femgear.stages.losses_results import describe_losses, loss_tables
from femgear.stages.static import solve_static
from femgear.trains.reading import read_case, with_values

LOSSES = {"friction": "constant", "coefficient": 0.05, "torque_shares": [1.0], "speed_shares": [0.5, 1.0]}


def test_tables_show_the_numbers_of_the_file():
    changes = {"static.positions": 8, "static.flank_elements": 6, "static.stresses": False, "losses": LOSSES}
    case = with_values(read_case("cases/spur_pair.toml"), changes)
    result = solve_losses(case, solve_static(case))
    data = result.contents()
    block = describe_losses(data)
    row = dict(zip(block.header, block.rows[0], strict=True))
    assert float(row["efficiency"]) == np.round(float(data["efficiency"].values[0]), 6)
    assert abs(float(row["input [W]"]) - float(row["losses [W]"]) - float(row["output [W]"])) < 1.0
    meshes, whole_map = loss_tables(data)
    assert dict(zip(meshes.header, meshes.rows[0], strict=True))["mu"] == "0.0500"
    assert whole_map.header == ("torque", "speed 0.5", "speed 1") and len(whole_map.rows) == 1
