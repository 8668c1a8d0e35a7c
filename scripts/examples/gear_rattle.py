"""
When do teeth hit each other?
=============================

A lightly loaded pair with play and a tooth error: near its resonance the drive flanks part, cross the play
and strike the back flanks. Two periods of the motion, by harmonic balance.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case
from femgear.solvers import periodic_response
from femgear.trains.impacts.case_file import pair_of
from femgear.trains.impacts.model import contact_shares

plt.style.use("tableau-colorblind10")
pair = pair_of(read_case(Path(__file__).parents[2] / "cases" / "gear_pair.toml"))
figure, ax = plt.subplots(layout="constrained")

# %%
# Lengths count in half the play: above 1 the drive flanks touch, below -1 the back flanks.

phase = np.linspace(0, 4 * np.pi, 513)
for ratio, style in ((0.4, "-"), (0.8, "--"), (2.0, "-.")):
    x = periodic_response(pair.problem(ratio), 1.0, harmonics=12).solution.at(phase)[:, 0]
    ax.plot(phase / (2 * np.pi), x, style, label=f"frequency ratio {ratio:g}")
    shares = contact_shares(x[:-1])
    print(f"{ratio:g}:", ", ".join(f"{name} {share:.2f}" for name, share in shares.items()))

ax.axhspan(-1, 1, color="0.92", label="no contact")
ax.set(xlabel="time [periods of the tooth error]", ylabel="deflection of the mesh [half the play]")
figure.legend(loc="outside lower center", ncols=2)
plt.show()
