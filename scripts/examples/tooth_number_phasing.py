"""
Which modes do my tooth numbers excite?
=======================================

In a set of equally spaced planets the remainder of (harmonic times sun teeth) over the number of planets
decides what is left of the mesh forces: a torque, a lateral force, or nothing on sun, ring and carrier.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from femgear.gears.phasing import mesh_phasing, phasing_table
from femgear.gears.planetary import equal_planet_angles

planets, suns, harmonics = 4, range(24, 32), range(1, 9)
kinds = ["rotational", "translational", "planet"]
table = np.zeros((len(suns), len(harmonics)), int)
for row, sun in enumerate(suns):
    ring = 100 - sun  # divisible by the number of planets together: the set can be assembled
    phases_of_set = phasing_table(mesh_phasing(sun, ring, equal_planet_angles(planets)), harmonics)
    table[row] = [kinds.index(names[0]) for names in phases_of_set.excited]

# %%
# Sun and ring have 100 teeth together; a row tells which kind of mode every mesh harmonic drives.

print(f"sun of 27: harmonics 1 to 4 drive {[kinds[kind] for kind in table[3, :4]]}")
colours, norm = ListedColormap(["#D55E00", "#56B4E9", "#DDDDDD"]), BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3)
figure, ax = plt.subplots(layout="constrained")
drawn = ax.pcolormesh(harmonics, suns, table, cmap=colours, norm=norm, edgecolor="white")
ax.set(xlabel="harmonic of the mesh frequency [1]", ylabel="teeth of the sun [1]", yticks=suns)
figure.colorbar(drawn, ticks=range(3), label="modes that are driven").set_ticklabels(kinds)
plt.show()
