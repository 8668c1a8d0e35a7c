"""
Which harmonics of the thrust reach the bearings?
=================================================

Helical teeth push along the axis. With these tooth numbers neighbouring planets mesh half a period apart:
their thrusts cancel in odd harmonics of the mesh frequency and add up in even ones.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "helical_30_20_70.toml")
dynamics = solve(case, "dynamics")["dynamics"].dataset().sel(axis="z")
thrust = np.abs(dynamics.support_force_real + 1j * dynamics.support_force_imag)  # speed, member, harmonic
for harmonic in range(4):
    largest = thrust.sel(harmonic=harmonic).max("speed")
    words = (f"{name} {force:.1f} N" for name, force in zip(thrust.member.values, largest.values))
    print(f"harmonic {harmonic}:", ", ".join(words))

# %%
# The second harmonic, the first one that is left, over the speed.

figure, ax = plt.subplots(layout="constrained")
for member, style in zip(thrust.member.values, ("-", "--", "-.")):
    ax.semilogy(dynamics.speed, thrust.sel(member=member, harmonic=2), style, label=member)
ax.set(xlabel="speed of the sun [rpm]", ylabel="axial force of mesh harmonic 2 [N]")
ax.legend()
plt.show()
