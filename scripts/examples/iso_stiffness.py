"""
How good is the mesh stiffness of ISO 6336?
===========================================

Method B of ISO 6336-1 has the mean mesh stiffness from tooth numbers and shifts alone. Beside it stands
that of finite elements with contact, for pairs of one module and growing tooth numbers.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case, solve_static, with_values
from femgear.gears.iso6336_stiffness import pair_mesh_stiffness

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "spur_pair.toml")
teeth, standard, elements = [20, 26, 36], [], []
for z in teeth:
    bores = {"gear_1.bore_radius": f"{0.625 * z} mm", "gear_2.bore_radius": f"{1.25 * z} mm"}
    tips = dict.fromkeys(["gear_1.tip_diameter", "gear_2.tip_diameter"])  # those of the rack
    pair = {"gear_1.teeth": z, "gear_2.teeth": 2 * z, "set.centre_distance": f"{4.5 * z + 1} mm"} | tips
    static = solve_static(with_values(case, pair | bores | {"static.positions": 16}))
    width = static.planetary_set.gear_1.face_width
    standard.append(1e-9 * pair_mesh_stiffness(static.planetary_set)[1])
    elements.append(1e-9 * float(static.cycle.mean().mean()) / width)

# %%
# The standard claims no more than some ten per cent.

print("finite elements over ISO 6336:", np.round(np.divide(elements, standard), 3))
figure, ax = plt.subplots(layout="constrained")
ax.plot(teeth, standard, "o-", label="ISO 6336-1, method B")
ax.plot(teeth, elements, "s--", label="finite elements")
ax.set(xlabel="teeth of gear 1 (gear 2: twice as many) [1]", ylabel="c_γα [N/(mm µm)]", ylim=(0, None))
ax.legend()
plt.show()
