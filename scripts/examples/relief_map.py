"""
How much tip relief for which torque?
=====================================

A relief that is right for one torque is too much below it and too little above. The map shows the valley of
quiet designs: the transmission error of a pair over torque and tip relief of both gears.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case
from femgear.study.relief import design_basis, harris_map, with_tip_relief

case = read_case(Path(__file__).parents[2] / "cases" / "spur_pair.toml")
basis = replace(design_basis(case), positions=12)
torques, reliefs = np.linspace(50, 350, 7), np.linspace(0, 30e-6, 7)
variants = [with_tip_relief(None, basis.gears, amount=amount) for amount in reliefs]
errors = 1e6 * harris_map(basis, torques=torques, deviations=variants).peak_to_peak[:, 0]

# %%
# The quietest relief of every torque.

best = errors.argmin(axis=0)
for torque, row in zip(torques, best):
    print(f"{torque:4.0f} N m: {1e6 * reliefs[row]:2.0f} um")

figure, ax = plt.subplots(layout="constrained")
filled = ax.contourf(torques, 1e6 * reliefs, errors, levels=12, cmap="cividis")
ax.plot(torques, 1e6 * reliefs[best], "wo-", label="least of every torque")
ax.set(xlabel="torque of gear 1 [N m]", ylabel="tip relief of both gears [µm]")
figure.colorbar(filled, label="transmission error, peak to peak [µm]")
ax.legend(loc="upper left", labelcolor="white", facecolor="0.3")
plt.show()
