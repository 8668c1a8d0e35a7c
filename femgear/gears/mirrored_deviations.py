"""Deviations of a set as its mirror image has them: the flanks that a negative torque loads."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.gears.motion import orientations

if TYPE_CHECKING:
    from femgear.gears.deviations import Runout, SetDeviations
    from femgear.gears.planetary import PlanetarySet


def mirrored_deviations(
    deviations: SetDeviations, planetary_set: PlanetarySet, mirrored: PlanetarySet, order
) -> SetDeviations:
    """Deviations as the mirror image of the set has them, for a torque that loads the other flanks.

    The image is taken at the line through the first planet, with the sun where it was and the play of all
    meshes taken up the other way. The sun then drives the right flanks of the planets, here the ring side;
    a tooth of sun or ring has the same form on both flanks and its pitch deviation moves it as a whole.

    Parameters
    ----------
    deviations, planetary_set : SetDeviations, PlanetarySet
    mirrored : PlanetarySet
        Planet angles ``2 psi_1 - psi``, ascending from the first planet.
    order : (N,) integer array
        Mirrored planet ``i`` is original planet ``order[i]``.

    Returns
    -------
    SetDeviations
    """
    d, s, order = deviations, planetary_set, [int(n) for n in order]
    axis = 2.0 * s.planet_angles[0]
    image = orientations(mirrored)
    # at this position the right flank of tooth 0 of the sun is where its left flank is at position 0
    found = orientations(s, 2.0 * (s.planet_angles[0] - orientations(s).sun) / s.sun.pitch_angle)
    ring = round((axis - image.ring - found.ring) / s.ring.pitch_angle)
    planets = [
        round((axis - angle - found.planets[n]) / s.planet.pitch_angle)
        for n, angle in zip(order, image.planets, strict=True)
    ]
    runouts = [_reflected(d.planet_runout[n], k * s.planet.pitch_angle) for n, k in zip(order, planets)]
    return replace(
        d,
        planet_sun_side=d.planet_ring_side,
        planet_ring_side=d.planet_sun_side,
        sun_pitch=-_turned(d.sun_pitch, 0),
        ring_pitch=-_turned(d.ring_pitch, ring),
        planet_pitch=[_turned(d.planet_ring_side_pitch[n], k) for n, k in zip(order, planets)],
        planet_ring_side_pitch=[_turned(d.planet_pitch[n], k) for n, k in zip(order, planets)],
        planet_runout=tuple(runouts),
        sun_runout=_reflected(d.sun_runout, 0.0),
        ring_runout=_reflected(d.ring_runout, ring * s.ring.pitch_angle),
        carrier_runout=_reflected(d.carrier_runout, axis),
        ovality=replace(d.ovality, phase=ring * s.ring.pitch_angle - d.ovality.phase),
        pin_errors=d.pin_errors[order] * [1.0, -1.0],
        planet_thickness=d.planet_thickness[order],
    )


def _turned(values: np.ndarray, first: int) -> np.ndarray:
    """Values of the teeth ``first``, ``first - 1``, ..."""
    return values[(first - np.arange(len(values))) % len(values)]


def _reflected(runout: Runout, axis: float) -> Runout:
    return replace(runout, phase=axis - runout.phase)
