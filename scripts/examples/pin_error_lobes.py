"""
Why does one speed show five lobes and another six?
===================================================

Equal planets make three or six equal swellings a turn at every speed. One pin a few micrometres off adds
side bands next to the mesh orders: they break the pattern where the set is quiet, not where it is loud.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve, with_values
from femgear.housing.orders import OrderSpectrum, analyse_band
from femgear.housing.sensor import stored_lines

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
case = with_values(case, {"operation.speeds": ["800 rpm", "2200 rpm"]})
pins = {"pins true": [], "pin 1 off by 2.4 µm": [{"planet": 1, "tangential": "2.4 um"}]}
figure, axes = plt.subplots(1, 2, subplot_kw={"projection": "polar"}, figsize=(8, 5), layout="constrained")

# %%
# Measured were five lobes around order 216 at 800 rpm and six around order 432 at 2200 rpm.

for (name, errors), style in zip(pins.items(), ("-", "--")):
    housing = solve(with_values(case, {"set.pin_errors": errors}), "housing")["housing"].dataset()
    for ax, (speed, harmonic) in zip(axes, ((800, 2), (2200, 4))):
        lines = stored_lines(housing.sel(speed=speed, method="nearest"))
        band = analyse_band(OrderSpectrum(lines.order, lines.acceleration), 108, harmonic)
        turn = 2 * np.pi * np.arange(len(band.envelope)) / len(band.envelope)
        text = f"{name}: {len(band.lobes.position)} lobes"
        ax.plot(turn, band.envelope / band.envelope.max(), style, label=text)
        ax.set(title=f"envelope around {108 * harmonic}, {speed} rpm [1]", xlabel="angle of the carrier [°]")
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2))
        print(f"{speed} rpm, {text}")
plt.show()
