"""
Which modes twist, which shake, which bend the ring?
====================================================

Modes of a symmetric set are of few kinds: in rotational ones the members twist against each other, in
translational ones sun and carrier move sideways, in planet modes neither; ring modes mostly bend the ring.
The kind tells what can excite a mode, and what heals it.
"""

from pathlib import Path

import matplotlib.pyplot as plt

from femgear import read_case, solve_modes, solve_static, with_values

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml")
case = with_values(case, {"static.positions": 16, "static.stresses": False})
modes = solve_modes(case, solve_static(case)).dataset()
shown = modes.sel(mode=(modes.frequency > 1) & (modes.frequency < 10e3))

# %%
# Height is how far the first sun mesh deflects in the mode: high stems are what the mesh can drive.

figure, ax = plt.subplots(layout="constrained")
for number, kind in enumerate(dict.fromkeys(shown.kind.values)):
    of_kind = shown.sel(mode=shown.kind == kind)
    deflection = abs(of_kind.mesh_deflection[0])
    ax.vlines(1e-3 * of_kind.frequency, 0, deflection, color=f"C{number}")
    ax.plot(1e-3 * of_kind.frequency, deflection, "osD^vP*X"[number], color=f"C{number}", label=kind)
    print(f"{kind}: {', '.join(f'{f:.0f}' for f in of_kind.frequency.values[:6])} Hz ...")

ax.set(xlabel="natural frequency [kHz]", ylabel="deflection of the first sun mesh [kg^-1/2]")
ax.legend()
plt.show()
