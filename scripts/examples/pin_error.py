"""
One planet pin is off: who carries the load?
============================================

A pin that stands a few micrometres behind its place makes its planet carry more than its share. A sun that
floats on its planets evens three of them out; a sun whose centre is held does not.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, with_values
from femgear.gears.deviations import no_deviations
from femgear.study.relief import design_basis, sun_torque

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
floating = {"static.members": "elastic", "sun.support_stiffness": "0 N/m"}
errors, figure, ax = np.array([0.0, 2.0, 4.0, 6.0]), *plt.subplots(layout="constrained")

# %%
# The load sharing factor is the largest load of a planet over the mean of all.

for name, sun, style in (("sun held", {}, "o-"), ("sun floats", floating, "s--")):
    basis, factor = replace(design_basis(with_values(case, sun)), positions=8), []
    for error in errors:
        pins = np.array([[0, -1e-6 * error], [0, 0], [0, 0]])  # radial, tangential of each planet
        off = replace(basis, deviations=replace(no_deviations(basis.gears), pin_errors=pins))
        factor.append(3 * off.walk(sun_torque(case, basis.gears)).load_share.max())
    ax.plot(errors, factor, style, label=name)
    print(f"{name}: {factor[-1]:.3f} at {errors[-1]:g} um")

ax.set(xlabel="pin 1 behind its place [µm]", ylabel="load sharing factor K_γ [1]")
ax.legend()
plt.show()
