"""In-plane vibration of a free annulus, exact to rounding for thick and for very thin rings.

Displacements ``u_r = U(r) cos(n phi)``, ``u_phi = V(r) sin(n phi)`` make the strains
``U'``, ``(U + n V)/r`` and ``V' - (V + n U)/r`` (Love, "A Treatise on the Mathematical Theory of
Elasticity", 4th ed., section 22). The classical solution is the zero of a 4 x 4 determinant of Bessel
functions; its columns become parallel as the ring gets thin, so that double precision fails near
h/R = 2e-4. Here U and V are Legendre polynomials of such a degree that nothing is left to converge,
and the natural frequencies are singular values of the strain operator, not eigenvalues of its square;
one of the functions is the inextensional bending field, whose strain is known without cancellation.
"""

from __future__ import annotations

import numpy as np

from femgear.errors import GeometryError
from femgear.fe.elasticity import Material


def annulus_frequencies(
    inner: float,
    outer: float,
    material: Material,
    *,
    nodal_diameters,
    count: int = 1,
    state: str = "plane stress",
) -> np.ndarray:
    """Natural frequencies of a free annulus, without rigid motions.

    Parameters
    ----------
    inner, outer : float
        Radii [m], 0 < inner < outer.
    material : Material
    nodal_diameters : sequence of int
        Numbers n >= 0; for n = 0 radial (breathing) and torsional modes together, for n > 0 every
        frequency belongs to two modes.
    count : int
        Number of frequencies for each n.
    state : str
        ``"plane stress"`` or ``"plane strain"``.

    Returns
    -------
    (len(nodal_diameters), count) array
        Frequencies [Hz], ascending for each n.

    Raises
    ------
    GeometryError
        When the radii are not in order, or a number of nodal diameters or modes is not possible.
    """
    if not (0 < inner < outer < np.inf):
        raise GeometryError(
            f"an annulus cannot have radii {inner} and {outer} m", code="E-ANNULUS", limit="0 < inner < outer"
        )
    orders = [int(n) for n in nodal_diameters]
    if count < 1 or min(orders, default=0) < 0:
        raise GeometryError(
            f"{count} frequencies for nodal diameters {orders}", code="E-ANNULUS", limit="count >= 1, n >= 0"
        )
    lam, mu = material.lame(state)
    rows = [_one_order(inner, outer, n, count, lam / mu) for n in orders]
    speed = np.sqrt(mu / material.density)
    return np.array(rows).reshape(len(orders), count) * speed / (2 * np.pi * inner)


def _one_order(inner, outer, n, count, lame_ratio):
    """Lowest angular frequencies, in units of shear speed over inner radius, at a converged degree."""
    degree, last = 16, None
    while True:
        value = _ritz(outer / inner, n, count, lame_ratio, max(degree, 2 * count + 8))
        if last is not None and np.allclose(value, last, rtol=1e-11, atol=0):
            return value
        if degree > 256:
            raise GeometryError(
                f"the annulus with outer over inner radius {outer / inner:.3g} does not converge for n = {n}",
                code="E-ANNULUS",
                limit="a hole that is not extremely small",
            )
        degree, last = 2 * degree, value


def _ritz(ratio, n, count, lame_ratio, degree):
    t, weight = np.polynomial.legendre.leggauss(2 * degree + 8)
    half = 0.5 * (ratio - 1.0)
    r = 1.0 + half * (1.0 + t)
    weight = weight * half * r
    P = np.polynomial.legendre.legvander(t, degree)
    dP = np.zeros_like(P)
    for k in range(1, degree + 1):
        dP[:, k] = k * P[:, k - 1] + t * dP[:, k - 1]
    fields, strains, rigid = _functions(P, dP / half, r, half, n)
    # (lambda + 2 mu)(e_r^2 + e_phi^2) + 2 lambda e_r e_phi + mu g^2 as a sum of squares, divided by mu
    e_r, e_phi, shear = strains
    root = np.sqrt(weight)[:, None]
    operator = root[None] * np.stack([np.sqrt(lame_ratio + 1.0) * (e_r + e_phi), e_r - e_phi, shear])
    inertia = root[None] * fields
    operator, inertia = operator.reshape(-1, operator.shape[-1]), inertia.reshape(-1, inertia.shape[-1])
    for motion in rigid:
        base = (root.T * motion).ravel()
        base = base / np.linalg.norm(base)
        inertia = inertia - np.outer(base, base @ inertia)
    scale = np.linalg.norm(operator, axis=0)
    triangle = np.linalg.qr(operator / scale, mode="r")
    flexible = np.linalg.svd(np.linalg.solve(triangle.T, (inertia / scale).T), compute_uv=False)
    return 1.0 / flexible[:count]


def _functions(P, dP, r, half, n):
    """Trial fields (2, q, m), their strains (3, q, m) and the rigid motions; r in inner radii."""
    zero = np.zeros_like(P)
    radial_strain = np.stack([dP, P / r[:, None], -n * P / r[:, None]])
    hoop_strain = np.stack([zero, n * P / r[:, None], dP - P / r[:, None]])
    radial, hoop = np.stack([P, zero]), np.stack([zero, P])
    if n == 0:
        # the rigid rotation V = r is left out by leaving out the linear function
        fields = np.concatenate([radial, hoop[..., :1], hoop[..., 2:]], axis=2)
        strains = np.concatenate([radial_strain, hoop_strain[..., :1], hoop_strain[..., 2:]], axis=2)
        return fields, strains, [np.stack([0 * r, r])]
    # U = 1, V = -1/n + b s, s = (r - R)/R, b = n - 1/n: no shear, no radial strain, bending strain n b s / r
    middle = 1.0 + half
    s, b = (r - middle) / middle, n - 1.0 / n
    bending = np.stack([np.ones_like(r), -1.0 / n + b * s])[..., None]
    bending_strain = np.stack([0 * r, n * b * s / r, 0 * r])[..., None]
    fields = np.concatenate([radial[..., 1:], hoop], axis=2)
    strains = np.concatenate([radial_strain[..., 1:], hoop_strain], axis=2)
    if n == 1:  # the bending field is the rigid translation
        return fields, strains, [bending[..., 0]]
    return np.concatenate([bending, fields], axis=2), np.concatenate([bending_strain, strains], axis=2), []
