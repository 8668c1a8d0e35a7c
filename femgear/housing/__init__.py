"""Housing: from the carrier frame to a fixed sensor, and what its order spectrum tells."""

from femgear.housing.hanning import hanning_model, phased_harmonics
from femgear.housing.modulation import (
    HousingSignal,
    SensorLines,
    fixed_sensor_lines,
    fixed_sensor_signal,
    heaviside_linear_lines,
)
from femgear.housing.orders import (
    BandAnalysis,
    Line,
    Lobes,
    OrderSpectrum,
    analyse_band,
    analytic_signal,
    band_pass,
    count_lobes,
    dominant_lines,
    envelope,
    line_sources,
    order_level,
    order_spectrum,
    symmetry_leakage,
)
from femgear.housing.points import heaviside_linear, passages, point_signals, unresolved_share

__all__ = [
    "BandAnalysis",
    "HousingSignal",
    "Line",
    "Lobes",
    "OrderSpectrum",
    "SensorLines",
    "analyse_band",
    "analytic_signal",
    "band_pass",
    "count_lobes",
    "dominant_lines",
    "envelope",
    "fixed_sensor_lines",
    "fixed_sensor_signal",
    "hanning_model",
    "heaviside_linear",
    "heaviside_linear_lines",
    "line_sources",
    "order_level",
    "order_spectrum",
    "passages",
    "phased_harmonics",
    "point_signals",
    "symmetry_leakage",
    "unresolved_share",
]
