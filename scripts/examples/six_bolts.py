"""
What do six bolts change at a ring?
===================================

On an even foundation every wave of the ring stands for itself. Six bolts couple waves and move resonances:
loud speeds become quiet, and others loud.
"""

from pathlib import Path

import matplotlib.pyplot as plt

from femgear import read_case, solve, with_values

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
speeds = {"from": "1000 rpm", "to": "3400 rpm", "count": 17}
coarse = {"static.positions": 16, "static.stresses": False, "runup.count": 0, "dynamics.mesh_harmonics": 4}
case = with_values(case, coarse | {"operation.speeds": speeds, "housing.published": []})
size = {"radial_stiffness": "4e8 N/m", "tangential_stiffness": "4e8 N/m", "width": "12 mm", "mass": "20 g"}
bolts = {"housing.support": [{"angle": f"{angle} deg"} | size for angle in range(15, 375, 60)]}
figure, ax = plt.subplots(layout="constrained")

# %%
# The level at the sensor over the speed of the sun, by four mesh harmonics.

for name, change, style in (("foundation alone", {}, "-"), ("six bolts", bolts, "--")):
    housing = solve(with_values(case, change), "housing")["housing"].dataset()
    ax.plot(housing.speed, housing.level, style, label=name)
    print(f"{name}: up to {float(housing.level.max()):.1f} m/s^2")

ax.set(xlabel="speed of the sun [rpm]", ylabel="acceleration, r.m.s. [m/s²]", ylim=(0, None))
ax.legend()
plt.show()
