"""
Linear or parabolic tip relief?
===============================

Both shapes take the same amount off the tip of sun and planets and start at the same place. Which one
leaves less transmission error at the torque of the case, and how much does it matter to miss the best
amount?
"""

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case
from femgear.study.relief import design_basis, harris_map, sun_torque, with_tip_relief

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
basis = replace(design_basis(case), positions=16)
amounts, torque = np.linspace(0, 12e-6, 7), sun_torque(case, basis.gears)
figure, ax = plt.subplots(layout="constrained")

# %%
# One curve a shape: power 1 is a straight line over the roll length, power 2 a parabola.

for shape, power, style in (("linear", 1.0, "o-"), ("parabolic", 2.0, "s--")):
    variants = [with_tip_relief(None, basis.gears, amount=most, power=power) for most in amounts]
    error = 1e6 * harris_map(basis, torques=[torque], deviations=variants).peak_to_peak[:, 0, 0]
    ax.plot(1e6 * amounts, error, style, label=shape)
    print(f"{shape}: {error.min():.2f} um at {1e6 * amounts[error.argmin()]:g} um")

ax.set(xlabel="tip relief [µm]", ylabel="STE of sun-planet meshes, peak to peak [µm]", ylim=(0, None))
ax.legend()
plt.show()
