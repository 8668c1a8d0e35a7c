"""The classical model of a planet's passage: every planet carries a Hanning window past the sensor.

The sensor hears sum_p w(phi - psi_p) s_p(t), phi its angle in the carrier frame, psi_p that of planet p,
s_p the signal of the planet's mesh with the ring, and w(x) = (1 + cos(2 pi x / width))/2 for
|x| < width/2, 0 elsewhere. A window that rides on the planet is a field of the carrier frame:
U[h, n] = sum_p c_n exp(-i n psi_p) s_p[h], where

    c_n = width/(4 pi) sinc(v)/(1 - v^2),  v = n width/(2 pi),  c_n = width/(8 pi) where |v| = 1.

width = 2 pi: McFadden and Smith (1985), every planet always heard; width = 2 pi/N: Inalpolat and
Kahraman (2009), only the nearest planet of N is heard.
"""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError


def phased_harmonics(harmonics, mesh_phases) -> np.ndarray:
    """Harmonics of planets that all do the same, each at its own mesh phase.

    Parameters
    ----------
    harmonics : (..., H + 1) complex array
        Mesh signal of a planet of phase zero: Re sum_h harmonics[h] exp(i h omega_m t).
    mesh_phases : (N,) array
        Phase of every planet's mesh with the ring, as a fraction of the mesh period.

    Returns
    -------
    (..., N, H + 1) complex array
    """
    harmonics = np.asarray(harmonics, dtype=complex)
    turns = np.outer(mesh_phases, np.arange(harmonics.shape[-1]))
    return harmonics[..., None, :] * np.exp(2j * np.pi * turns)


def hanning_model(harmonics, planet_angles, *, width: float | None = None, n_max: int = 24) -> np.ndarray:
    """Carrier-frame field of the Hanning-window model, for `fixed_sensor_lines`.

    Parameters
    ----------
    harmonics : (..., N, H + 1) complex array
        Harmonics of every planet's mesh signal in common time, for example the mesh forces of the
        planet-ring meshes, or from `phased_harmonics`.
    planet_angles : (N,) array
        Angles psi_p in the carrier frame [rad].
    width : float, optional
        Angle over which a planet is heard [rad], 0 < width <= 2 pi; default 2 pi/N.
    n_max : int
        Circumferential orders kept; c_n falls like 1/n^3 (width = 2 pi: nothing beyond n = 1).

    Returns
    -------
    (..., H + 1, 2 n_max + 1) complex array
        In the unit of the harmonics.

    Raises
    ------
    CaseError
        ``E-FIELD`` for harmonics that do not fit the planets; ``E-WINDOW`` for a width out of range.
    """
    harmonics, psi = np.asarray(harmonics, dtype=complex), np.asarray(planet_angles, dtype=float)
    if harmonics.ndim < 2 or psi.shape != harmonics.shape[-2:-1] or not np.all(np.isfinite(harmonics)):
        raise CaseError(
            f"mesh harmonics of shape {harmonics.shape} do not fit {psi.size} planets",
            code="E-FIELD",
            limit="finite values of shape (..., planets, H + 1)",
            remedy="give the harmonics of the planet-ring meshes alone",
        )
    width = 2 * np.pi / psi.size if width is None else width
    # a width rounded from degrees may exceed the circle by one bit
    if not 0 < width <= 2 * np.pi * (1 + 1e-12):
        raise CaseError(
            f"a window of {width} rad does not fit on the ring",
            code="E-WINDOW",
            value=width,
            limit="0 < width <= 2 pi",
            remedy="leave it out for 2 pi divided by the number of planets",
        )
    n = np.arange(-n_max, n_max + 1)
    riding = _window_components(n, width)[:, None] * np.exp(-1j * np.outer(n, psi))
    return np.swapaxes(riding @ harmonics, -1, -2)


def _window_components(n: np.ndarray, width: float) -> np.ndarray:
    """Fourier components c_n of the window on the circle."""
    v = n * width / (2 * np.pi)
    # sinc(v)/(1 - v^2) = (sinc(v - 1) + sinc(v + 1))/2 + sinc(v): no division at |v| = 1
    return width / (4 * np.pi) * (np.sinc(v) + (np.sinc(v - 1) + np.sinc(v + 1)) / 2)
