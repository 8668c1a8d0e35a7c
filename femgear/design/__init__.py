"""Design maps: transmission error over torque and relief, load sharing over pin errors."""

from femgear.design.relief import (
    HarrisMap,
    ReliefGrid,
    ReliefOptimum,
    harris_map,
    optimise_relief,
    relief_grid,
    relief_starts,
    with_tip_relief,
)
from femgear.design.samples import Sharing, SharingModel, sharing_of_samples
from femgear.design.sharing import (
    pin_samples,
    sharing_model,
    walked_shares,
)

__all__ = [
    "HarrisMap",
    "ReliefGrid",
    "ReliefOptimum",
    "Sharing",
    "SharingModel",
    "harris_map",
    "optimise_relief",
    "pin_samples",
    "relief_grid",
    "relief_starts",
    "sharing_model",
    "sharing_of_samples",
    "walked_shares",
    "with_tip_relief",
]
