"""
Which lines does a mesh force have in a drivetrain?
===================================================

A motor, an elastic coupling, a gear stage and a fan, integrated in time under a load that rises. The
spectrum of the mesh force has the harmonics of the mesh frequency, amplified where shafts and bearings
resonate.
"""

from pathlib import Path

import matplotlib.pyplot as plt

from femgear import read_case, solve

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "own_chain.toml")
spectrum = solve(case, "spectrum")["spectrum"].dataset().isel(variant=0, mesh=0)

# %%
# The three named lines, of the motion after it has settled.

figure, ax = plt.subplots(layout="constrained")
ax.semilogy(spectrum.frequency, spectrum.amplitude)
for harmonic, line in enumerate(spectrum.line_frequency.values, 1):
    print(f"mesh harmonic {harmonic}: {line:.0f} Hz, {float(spectrum.line_amplitude[harmonic - 1]):.1f} N")
    ax.axvline(line, color="0.7", linestyle=":", zorder=0)
ax.set(xlabel="frequency [Hz]", ylabel="amplitude of the mesh force [N]")
plt.show()
