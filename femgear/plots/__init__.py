"""Figures of results: every function takes a dataset as stored and returns a matplotlib `Figure`."""

from femgear.plots.dynamic import (
    ring_mean_deflection,
    speed_sweep,
    transmission_error_period,
    transmission_error_spectrum,
)
from femgear.plots.modal import mode_shapes, natural_frequencies
from femgear.plots.sensor import housing_signal, modulation_polar, order_spectrum
from femgear.plots.static import load_sharing, mesh_stiffness, static_transmission_error, tooth_loads
from femgear.plots.style import png_bytes, save_figure

__all__ = [
    "housing_signal",
    "load_sharing",
    "mesh_stiffness",
    "mode_shapes",
    "modulation_polar",
    "natural_frequencies",
    "order_spectrum",
    "png_bytes",
    "ring_mean_deflection",
    "save_figure",
    "speed_sweep",
    "static_transmission_error",
    "tooth_loads",
    "transmission_error_period",
    "transmission_error_spectrum",
]
