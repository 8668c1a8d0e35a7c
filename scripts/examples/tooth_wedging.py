"""
Do teeth wedge under the weight of the carrier?
===============================================

In a large horizontal set the weight lifts and drops the carrier once a turn. With little play back flanks
touch while the drive flanks carry: teeth wedge, and planet bearings are overloaded. How much play is
enough?
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve, with_values

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "nrel_pgb.toml")
plays, touching = np.arange(0.04, 0.13, 0.01), []
for play in plays:
    changed = with_values(case, {"set.backlash": f"{play:.3f} mm", "operation.speeds": ["30 rpm"]})
    response = solve(changed, "response")["response"].dataset().isel(speed=0)
    touching.append([float(response.back_contact[:3].max()), float(response.back_contact[3:].max())])

# %%
# The share of a turn in which back flanks touch, of the mesh where they do so longest.

touching = np.array(touching)
print(f"free from {plays[np.flatnonzero(touching.max(axis=1) == 0)[0]]:.2f} mm on")
figure, ax = plt.subplots(layout="constrained")
ax.plot(plays, 100 * touching[:, 0], "o-", label="sun")
ax.plot(plays, 100 * touching[:, 1], "s--", label="ring")
ax.set(xlabel="play on the reference circles [mm]", ylabel="time with back contact [%]")
ax.legend()
plt.show()
