"""
How many times a turn does the gear set swell?
==============================================

Side bands beat: what a sensor hears of one mesh harmonic swells and fades while the carrier turns. Equal
planets make a multiple of their number of equal swellings; one elsewhere breaks the pattern.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve, with_values
from femgear.housing.orders import OrderSpectrum, analyse_band
from femgear.housing.sensor import stored_lines

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
case = with_values(case, {"static.positions": 16, "operation.speeds": ["250 rpm"]})
places = {"equal": [0, 45, 90], "third planet moved": [0, 45, 95]}  # in 135ths of a turn, where teeth fit
figure, ax = plt.subplots(subplot_kw={"projection": "polar"}, layout="constrained")

# %%
# The envelope of the first mesh harmonic over the angle of the carrier.

for (name, steps), style in zip(places.items(), ("-", "--")):
    moved = with_values(case, {"set.planet_angles": [f"{step * 360 / 135:.12f} deg" for step in steps]})
    lines = stored_lines(solve(moved, "housing")["housing"].dataset().isel(speed=0))
    band = analyse_band(OrderSpectrum(lines.order, lines.acceleration), 108, 1)
    text, largest = f"{name}: {len(band.lobes.position)} lobes", band.envelope.max()
    turn = 2 * np.pi * np.arange(len(band.envelope)) / len(band.envelope)
    ax.plot(turn, band.envelope / largest, style, label=text)
    print(f"{text}, up to {largest:.2g} m/s^2")

ax.set(yticks=[0.5, 1], xlabel="angle of the carrier [°]", title="envelope over its largest value [1]")
figure.legend(loc="outside lower center")
plt.show()
