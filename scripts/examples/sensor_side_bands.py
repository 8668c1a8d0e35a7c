"""
Are these side bands normal?
============================

The carrier turns, so that a sensor on the housing hears lines beside each mesh harmonic, at whole orders of
the carrier. The spacing of the planets alone decides which ones a healthy set has: those where its array
factor is not zero.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve, with_values
from femgear.gears.planetary import equal_planet_angles
from femgear.housing.orders import array_factor
from femgear.housing.sensor import stored_lines

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
case = with_values(case, {"static.positions": 16, "static.stresses": False, "runup.count": 0})
lines = stored_lines(solve(case, "housing")["housing"].dataset().isel(speed=1))

# %%
# Orders around the fifth mesh harmonic of the ring with 108 teeth at 3100 rpm, and what the spacing allows.

near = np.abs(lines.order - 5 * 108) <= 12
orders, amplitudes = lines.order[near], np.abs(lines.acceleration[near])
print("allowed and heard:", orders[amplitudes > 1e-3 * amplitudes.max()].tolist())
figure, (above, below) = plt.subplots(2, sharex=True, layout="constrained")
above.bar(orders, amplitudes, width=0.4)
above.set(ylabel="acceleration [m/s²]")
every = np.arange(528, 553)
below.bar(every, array_factor(equal_planet_angles(3), every), width=0.4, color="C1")
below.set(xlabel="carrier order [1]", ylabel="array factor [1]")
plt.show()
