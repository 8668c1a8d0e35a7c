"""
Where do natural frequencies veer when planet bearings get stiffer?
===================================================================

Sorted by frequency, modes that meet seem to cross. Where they veer they exchange shapes, good ones for bad.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from femgear import read_case
from femgear.case.gear_set import planetary_set
from femgear.solvers.linear.modal import complex_modes
from femgear.solvers.linear.tracking import oscillating, track_modes
from femgear.stages.lumped_set import gear_set_system
from femgear.trains.planar.model import planar_data

case = read_case(Path(__file__).parents[2] / "cases" / "nrel_pgb.toml")
data = planar_data(case, planetary_set(case))


def modes(exponent):
    stiffer = gear_set_system(replace(data, planet_bearing=10**exponent))
    return oscillating(complex_modes(stiffer, data.mesh_stiffness))


tracked = track_modes(modes, np.linspace(8, 11, 31), gear_set_system(data).M)

# %%
# Steps are refined where branches come near, so that a veering is not taken for a crossing.

print(f"{len(tracked.value)} stiffnesses, places left unresolved: {len(tracked.unresolved)}")
figure, ax = plt.subplots(layout="constrained")
ax.loglog(10**tracked.value, tracked.frequency)
ax.set(xlabel="stiffness of the planet bearings [N/m]", ylabel="natural frequency [Hz]")
plt.show()
