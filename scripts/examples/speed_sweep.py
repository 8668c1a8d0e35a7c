"""
At which speeds does a gear pair whine?
=======================================

The dynamic transmission error of a pair over its speed. The resonance of the mesh appears where the mesh
frequency meets it, and again at fractions of that speed, where its harmonics do.
"""

from pathlib import Path

import matplotlib.pyplot as plt

from femgear import read_case, solve, with_values

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "spur_pair.toml")
case = with_values(case, {"runup.from": "2000 rpm", "runup.to": "24000 rpm", "static.stresses": False})
runup = solve(case, "runup")["runup"].dataset()

# %%
# The strongest resonances that the run-up names, beside the curve.

figure, ax = plt.subplots(layout="constrained")
ax.plot(runup.speed, 1e6 * runup.dte_rms)
strongest = runup.sortby("resonance_dte", ascending=False).isel(resonance=slice(3))
for harmonic, speed in zip(strongest.mesh_harmonic.values, strongest.resonance_speed.values):
    ax.axvline(speed, color="0.6", linestyle=":")
    ax.annotate(f"harmonic {harmonic}", (speed, 0.97), xycoords=("data", "axes fraction"), rotation=90, va="top")
    print(f"mesh harmonic {harmonic}: {speed:.0f} rpm")

ax.set(xlabel="speed of gear 1 [rpm]", ylabel="dynamic transmission error, r.m.s. [µm]")
plt.show()
