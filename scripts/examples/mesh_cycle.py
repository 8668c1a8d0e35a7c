"""
Where does the mesh stiffness jump?
===================================

The stiffness of a spur pair falls where a tooth pair leaves contact and rises where the next one enters it.
The load decides where: deflected teeth meet earlier and part later than the contact ratio of rigid gears
says.
"""

from pathlib import Path

import matplotlib.pyplot as plt

from femgear import read_case, solve

plt.style.use("tableau-colorblind10")
case = read_case(Path(__file__).parents[2] / "cases" / "spur_pair.toml")
results = solve(case, "stress")
static, stress = results["static"].dataset().isel(mesh=0), results["stress"].dataset().isel(mesh=0)

# %%
# Tooth pairs that carry at each of the 64 positions, and the share of the cycle with two of them.

pairs = (static.tooth_load > 0).sum("tooth")
print(f"contact ratio: rigid {results['static'].planetary_set.contact_ratio:.3f}, ", end="")
print(f"under load {float(stress.loaded_contact_ratio):.3f}")

figure, (above, below) = plt.subplots(2, sharex=True, layout="constrained")
above.plot(static.position, static.mesh_stiffness * 1e-6)
above.set(ylabel="mesh stiffness [N/µm]", ylim=(0, None))
below.step(static.position, pairs, where="mid", color="C1")
below.set(xlabel="position [mesh periods]", ylabel="tooth pairs in contact [1]", yticks=[1, 2])
plt.show()
