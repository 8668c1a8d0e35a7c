"""
When is a tooth root stressed most?
===================================

A tooth is loaded while its flank is on the path of contact. Its root is stressed most near the end of
single-pair contact, where one tooth carries everything at a long lever arm, not where it first touches.
"""

from pathlib import Path

import matplotlib.pyplot as plt

from femgear import read_case, solve, with_value

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "spur_pair.toml")
stress = solve(with_value(case, "static.positions", 32), "stress")["stress"].dataset().isel(mesh=0)

# %%
# Each gear passes through its mesh once; the abscissa is the path of contact from the pitch point.

figure, ax = plt.subplots(layout="constrained")
for gear, style in ((0, "-"), (1, "--")):
    of_gear = stress.isel(gear=gear)
    ax.plot(of_gear.root_path, 1e-6 * of_gear.root_tension, style, label=f"gear {gear + 1}")
    nominal = 1e-6 * float(of_gear.iso_root_stress)
    print(f"gear {gear + 1}: {1e-6 * float(of_gear.root_tension.max()):.0f} MPa, ISO 6336-3 {nominal:.0f} MPa")

ax.set(xlabel="place on the path of contact [base pitches]", ylabel="largest tension in the root [MPa]")
ax.legend()
plt.show()
