"""
How much does misalignment cost?
================================

Ten micrometres of slope across the face width and the load moves to one end. The face load factor says by
how much the worst part of the width is loaded beyond the mean; crowning trades some of it for a higher load
in the middle.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve_static, with_values

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "spur_pair.toml")
case = with_values(case, {"static.slices": 15, "static.positions": 8})
slopes = np.array([0.0, 5.0, 10.0])
figure, ax = plt.subplots(layout="constrained")

# %%
# Contact in 15 slices over the width, with and without 4 µm of lead crowning on gear 1.

for crowning, style in ((0, "o-"), (4, "s--")):
    factor = []
    for slope in slopes:
        lead = [{"kind": "lead slope", "amount": f"{slope} um"}] if slope else []
        lead += [{"kind": "lead crowning", "amount": f"{crowning} um"}] if crowning else []
        static = solve_static(with_values(case, {"gear_1.modifications": lead})).dataset()
        factor.append(float(static.face_load_factor[0]))
    ax.plot(slopes, factor, style, label=f"crowning {crowning} µm")
    print(f"crowning {crowning} um: K_Hbeta", np.round(factor, 2))

ax.set(xlabel="lead slope over the face width [µm]", ylabel="face load factor K_Hβ [1]")
ax.legend()
plt.show()
