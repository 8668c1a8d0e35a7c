"""Figures: those of results take a dataset as stored, those of `frequency` arrays; all return a `Figure`."""

from femgear.plots.dynamic import (
    ring_mean_deflection,
    speed_sweep,
    transmission_error_period,
    transmission_error_spectrum,
)
from femgear.plots.frequency import (
    branch,
    campbell,
    frequency_response,
    poincare_section,
    stability_chart,
    waterfall,
)
from femgear.plots.modal import mode_shapes, natural_frequencies
from femgear.plots.sensor import housing_signal, modulation_polar, order_spectrum
from femgear.plots.static import load_sharing, mesh_stiffness, static_transmission_error, tooth_loads
from femgear.plots.style import png_bytes, save_figure

__all__ = [
    "branch",
    "campbell",
    "frequency_response",
    "housing_signal",
    "load_sharing",
    "mesh_stiffness",
    "mode_shapes",
    "modulation_polar",
    "natural_frequencies",
    "order_spectrum",
    "png_bytes",
    "poincare_section",
    "ring_mean_deflection",
    "save_figure",
    "speed_sweep",
    "stability_chart",
    "static_transmission_error",
    "tooth_loads",
    "transmission_error_period",
    "transmission_error_spectrum",
    "waterfall",
]
