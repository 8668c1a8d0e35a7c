"""Separations that deviations add: of profiles along the flanks, and of whole tooth pairs."""

from __future__ import annotations

import numpy as np


def profile_form(planetary_set, deviations, kind, back):
    """Separation by deviations of the profiles as a function of both roll lengths, or None."""
    # on the back side a planet meets sun and ring with its other flanks
    planet = "planet_sun_side" if (kind == 0) != back else "planet_ring_side"
    forms = (planet, "ring" if kind else "sun")
    if deviations is None or not any(getattr(deviations, name).modifications for name in forms):
        return None
    from femgear.gears.deviations import profile_separation

    return lambda roll_1, roll_2: profile_separation(
        deviations, planetary_set, kind, roll_1, roll_2, back=back
    )


def pair_separations(planetary_set, deviations, tooth, turns, tau, *, back) -> np.ndarray:
    """Separations of whole tooth pairs by errors of pitch and position, shape (2N, P, pairs) [m]."""
    N = planetary_set.n_planets
    shift = np.zeros((2 * N, len(tau), tooth[0].shape[1]))
    if deviations is not None:
        from femgear.gears.deviations import body_separation, tooth_separation

        shift += body_separation(deviations, planetary_set, tau, back=back)[:, :, None]
        for mesh in range(2 * N):
            # with every mesh period the sun's teeth move on by one, those of planets and ring back
            sign = -1 if mesh < N else 1
            first = tooth[0][mesh][None, :] + sign * turns[:, None]
            second = tooth[1][mesh][None, :] + turns[:, None]
            shift[mesh] += tooth_separation(deviations, mesh, first, second, back=back)
    return shift
