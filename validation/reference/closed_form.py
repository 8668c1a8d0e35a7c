"""Load sharing of rigidly centred planets in closed form, for meshes whose touching points are known.

With a fixed set of touching candidates ``A`` every mesh is linear in its deflection, ``F = a delta - b``,
where ``a = 1^T H_AA^-1 1`` is its tangent stiffness and ``b = 1^T H_AA^-1 e`` comes from the separations
``e``. The two meshes of a planet carry the same force, and their deflections add up to the approach of the
sun that all planets share.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import ContactError


@dataclass(frozen=True)
class LoadSharing:
    """Load sharing of N planets.

    Parameters
    ----------
    approach : float
        Approach of the sun towards the ring through every planet [m].
    force : (N,) array
        Force of both meshes of each planet [N]; zero for a planet that carries nothing.
    deflection_sun, deflection_ring : (N,) arrays
        Mesh deflections [m]; of a planet that carries nothing, those at which its meshes begin to touch
        on the ring side.
    """

    approach: float
    force: np.ndarray
    deflection_sun: np.ndarray
    deflection_ring: np.ndarray

    def __post_init__(self):
        for array in (self.force, self.deflection_sun, self.deflection_ring):
            array.setflags(write=False)


def share_load(a_sun, a_ring, b_sun, b_ring, total) -> LoadSharing:
    """Forces of N planets whose meshes obey ``F = a delta - b``.

    With ``s = 1/a_sun + 1/a_ring`` and ``c = b_sun/a_sun + b_ring/a_ring`` of each planet, the loaded
    planets satisfy ``F_n = (Delta - c_n) / s_n`` and ``Delta = (total + sum c/s) / sum 1/s``: springs in
    series, and these in parallel behind their gaps ``c_n``. Planets are loaded in the order of their gaps,
    as many as ``Delta`` exceeds.

    Parameters
    ----------
    a_sun, a_ring : (N,) arrays
        Tangent stiffness of the sun-planet and planet-ring meshes [N/m], positive.
    b_sun, b_ring : (N,) arrays
        Force that a mesh lacks because of its separations [N]; ``a e`` for a uniform gap ``e``.
    total : float
        Sum of the mesh forces on the sun [N], not negative.

    Returns
    -------
    LoadSharing

    Raises
    ------
    ContactError
        For a stiffness that is not positive, a negative total, values that are not finite, or shapes that
        differ.
    """
    a_s, a_r, b_s, b_r = (np.atleast_1d(np.asarray(v, float)) for v in (a_sun, a_ring, b_sun, b_ring))
    if not (a_s.shape == a_r.shape == b_s.shape == b_r.shape and a_s.ndim == 1 and len(a_s)):
        raise ContactError("the four mesh arrays must have one value a planet", code="E-SHAPE")
    finite = all(np.isfinite(v).all() for v in (a_s, a_r, b_s, b_r))
    if not (finite and a_s.min() > 0 and a_r.min() > 0 and 0 <= total < np.inf):
        raise ContactError(
            f"lowest stiffness {min(a_s.min(), a_r.min()):.3g} N/m, total force {total} N",
            code="E-SHAPE",
            limit="finite values, stiffness above zero, total zero or above",
        )
    s, c = 1 / a_s + 1 / a_r, b_s / a_s + b_r / a_r
    order = np.argsort(c)
    # Delta if only the first k planets of this order were loaded; it is the lowest where k is right
    candidates = (total + np.cumsum((c / s)[order])) / np.cumsum((1 / s)[order])
    approach = float(candidates.min())
    force = np.maximum(approach - c, 0.0) / s
    ring = (force + b_r) / a_r
    return LoadSharing(approach, force, approach - ring, ring)
