"""Housing: from the carrier frame to a fixed sensor, and what its order spectrum tells."""

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
    order_level,
    order_spectrum,
)
from femgear.housing.sensor import (
    HousingSignal,
    SensorLines,
    fixed_sensor_lines,
    fixed_sensor_signal,
    hanning_model,
    heaviside_linear_lines,
)

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
    "fixed_sensor_lines",
    "fixed_sensor_signal",
    "hanning_model",
    "heaviside_linear_lines",
    "order_level",
    "order_spectrum",
]
