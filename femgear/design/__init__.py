"""Design maps: transmission error over torque and relief, load sharing over pin errors, derivatives."""

from femgear.design.derivatives import (
    LinearContact,
    Sensitivity,
    linearise,
    peak_to_peak_slopes,
    pin_sensitivities,
    sensitivity,
    sharing_factor_slopes,
)
from femgear.design.parameters import (
    pin_error,
    relief_amount,
    relief_length,
    tooth_pitch_error,
    two_pair_length,
)
from femgear.design.relief import (
    HarrisMap,
    ReliefGrid,
    harris_map,
    relief_grid,
    relief_starts,
    with_tip_relief,
)
from femgear.design.relief_optimum import ReliefOptimum, optimise_relief
from femgear.design.samples import Sharing, SharingModel, sharing_of_samples
from femgear.design.sharing import (
    pin_samples,
    sharing_model,
    walked_shares,
)

__all__ = [
    "HarrisMap",
    "LinearContact",
    "ReliefGrid",
    "ReliefOptimum",
    "Sensitivity",
    "Sharing",
    "SharingModel",
    "harris_map",
    "linearise",
    "optimise_relief",
    "peak_to_peak_slopes",
    "pin_error",
    "pin_samples",
    "pin_sensitivities",
    "relief_amount",
    "relief_grid",
    "relief_length",
    "relief_starts",
    "sensitivity",
    "sharing_factor_slopes",
    "sharing_model",
    "sharing_of_samples",
    "tooth_pitch_error",
    "two_pair_length",
    "walked_shares",
    "with_tip_relief",
]
