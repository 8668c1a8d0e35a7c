"""
Do the natural frequencies of a paper's table come out?
=======================================================

Lin and Parker (J. Vib. Acoust. 121, 1999, 316-321) print masses, stiffnesses and diameters of a set of rigid
bodies, and its natural frequencies. A set from numbers of one's own is made in the same way.
"""

from math import cos, pi, radians

import matplotlib.pyplot as plt

from femgear.stages.lumped_set import gear_set_modes
from femgear.system.rigid_bodies import PlanarBody, PlanarSet

angle, sun, planet = radians(24.6), 77.42e-3 / 2, 100.35e-3 / 2  # radii of base circles [m]
ring, distance = sun + 2 * planet, (sun + planet) / cos(angle)
lumped = PlanarSet(  # inertias of the paper are I/r^2, torsional stiffnesses act on r theta
    sun=PlanarBody(0.4, 0.39 * sun**2, support=1e8),
    planet=PlanarBody(0.66, 0.61 * planet**2),
    ring=PlanarBody(2.35, 3.00 * ring**2, support=1e8, torsional_support=1e9 * ring**2),
    carrier=PlanarBody(5.43, 6.29 * distance**2, support=1e8),
    planet_bearing=1e8,
    sun_radius=sun,
    planet_radius=planet,
    ring_radius=ring,
    centre_distance=distance,
    planet_angles=[0, 2 * pi / 3, 4 * pi / 3],
    stiffness_sun_planet=5e8,
    stiffness_planet_ring=5e8,
    pressure_angle_sun_planet=angle,
    pressure_angle_planet_ring=angle,
)
printed = [743.2, 1102.4, 1475.7, 1896.0, 1930.3, 2276.4, 2658.3, 6986.3, 7462.8, 9647.9, 11775.3]

# %%
# Translational modes are pairs: each stands once in the table.

modes = gear_set_modes(lumped)
ours = sorted({round(float(f), 3) for f in modes.frequency if f > 1})
print("\n".join(f"{a:8.1f} {b:9.3f} Hz" for a, b in zip(printed, ours, strict=True)))
figure, ax = plt.subplots(layout="constrained")
ax.plot(printed, [b - a for a, b in zip(printed, ours)], "o")
ax.axhspan(-0.05, 0.05, alpha=0.2, label="half a unit of the last printed digit")
ax.set(xlabel="printed natural frequency [Hz]", ylabel="computed less printed [Hz]")
ax.legend(loc="upper right")
plt.show()
