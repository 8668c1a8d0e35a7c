"""What the fluctuation of the mesh stiffness about its mean makes of deflections, in time, and GMRES on it.

``kappa_j(t) x_j(t)`` of every mesh, lines of one and the same side band: one Fourier transform over the lines
each way. Lines of negative q at the side band r are the conjugates of those of positive q at -r.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femgear.housing.two_way.carrier_orders import CarrierOrders

_FEW, _STEPS, CYCLES, _RITZ = 3000, 250, 3, 60
"""Unknowns up to which a cycle of GMRES takes as many steps as it needs; steps of the first cycle of more of
them at most, of each one after it twice as many; cycles; steps that tell the spectral radius."""
_TWICE, _TINY, _ROOM = 0.7, np.finfo(float).tiny, 15
"""Part of its length that a vector keeps if it is orthogonal; what no norm is below; vectors in memory that
a Krylov space starts with."""


def _fft() -> Any:
    """SciPy's transforms, which overwrite what they are given."""
    from scipy import fft

    return fft


class MeshFluctuation:
    """Multiplication by the fluctuation of the stiffness, see the head of this module.

    Parameters
    ----------
    stiffness : (n, H + 1) complex array
        One-sided harmonics of ``k - k0``, of the J leading meshes if there is one pattern, else of all
        meshes [N/m].
    orders : CarrierOrders
        Lines and side bands of the forces.
    owner, turn : (n,) int arrays
        Leading mesh of every mesh, and its turns from it.
    """

    def __init__(self, stiffness: np.ndarray, orders: CarrierOrders, owner: np.ndarray, turn: np.ndarray):
        self.orders, self.owner, N = orders, owner, orders.paths.symmetry
        self.leaders = owner == np.arange(owner.max() + 1)[:, None]
        whole = orders.base[:, None] + orders.pattern[:, None] + orders.bands
        # whole turns have no rounding
        self.phase = None
        if orders.patterns > 1:
            self.phase = np.exp(2j * np.pi * (orders.sense * turn[:, None, None] * (whole % N) % N) / N)
        self.points = _fft().next_fast_len(2 * orders.lines + stiffness.shape[1])
        spectrum = np.zeros((len(stiffness), self.points), complex)
        spectrum[:, : stiffness.shape[1]] = stiffness
        self.samples = np.real(_fft().ifft(spectrum, norm="forward"))[:, None]

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Products (J, B, R) of the leading meshes with values of that shape."""
        lines, middle = self.orders.lines, self.orders.middle
        meshes = self.of_meshes(values)
        two = np.zeros((len(meshes), middle + 1, self.points), complex)
        two[..., : lines + 1] = meshes[:, :, middle:].swapaxes(1, 2)
        two[..., self.points - lines :] = meshes[:, :0:-1, middle::-1].swapaxes(1, 2).conj()
        time = _fft().ifft(two, norm="forward", overwrite_x=True)
        time *= self.samples
        two = _fft().fft(time, norm="forward", overwrite_x=True)
        answer = np.empty_like(meshes)
        answer[:, :, middle:] = two[..., : lines + 1].swapaxes(1, 2)
        negative = np.concatenate([two[..., :1], two[..., : self.points - lines - 1 : -1]], axis=-1)
        answer[:, :, middle::-1] = negative.swapaxes(1, 2).conj()
        answer[:, 0, middle] = two[:, 0, 0]
        return self.of_leaders(answer)

    def of_meshes(self, values: np.ndarray) -> np.ndarray:
        """Values (n, Q + 1, R) of every mesh by those of the leaders in all patterns (J, B, R)."""
        if self.phase is None:
            return values
        every = values[self.owner] * self.phase
        return every.reshape(len(every), self.orders.patterns, -1, every.shape[2]).sum(axis=1)

    def of_leaders(self, values: np.ndarray) -> np.ndarray:
        """Values (J, B, R) of the leaders in all patterns by those of every mesh (n, Q + 1, R)."""
        if self.phase is None:
            return values
        every = np.tile(values, (1, self.orders.patterns, 1)) * self.phase.conj()
        return np.tensordot(self.leaders, every, axes=1) / self.orders.paths.symmetry


def gmres(
    answer, right: np.ndarray, size: float, start, tolerance: float, cycles: int = CYCLES
) -> tuple[np.ndarray, float, float, int]:
    """Solve ``x - answer(x) = right`` (n,) by GMRES.

    Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869.

    The solution, its residual over ``size``, the largest Ritz value of ``answer``, and the products taken.
    """
    solution = right if start is None else start
    rest, products, radius = right - solution + answer(solution), 1, 0.0
    for cycle in range(cycles):
        if not float(np.linalg.norm(rest)) > tolerance * size:
            break
        steps = len(rest) if len(rest) <= _FEW else _STEPS * 2**cycle
        step, hessenberg = _krylov(answer, rest, 0.5 * tolerance * size, steps)
        few = hessenberg[: min(len(hessenberg), _RITZ), :_RITZ]
        radius = max(radius, float(np.abs(np.linalg.eigvals(few)).max()))
        solution = solution + step
        rest, products = right - solution + answer(solution), products + len(hessenberg) + 1
    return solution, float(np.linalg.norm(rest)) / size, radius, products


def _krylov(answer, rest: np.ndarray, limit: float, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Correction (n,) that brings a residual (n,) below a limit, of so many steps at most.

    And ``answer`` on the Krylov space (k, k).
    """
    size = float(np.linalg.norm(rest))
    basis, columns, triangle = (rest / size)[None], list[np.ndarray](), list[np.ndarray]()
    right, turns = [size], list[tuple[float, float]]()
    for k in range(most):
        if k + 1 >= len(basis):  # most corrections take few steps: memory grows with them
            basis = np.concatenate([basis, np.empty((max(k + 1, _ROOM), len(rest)))])
        image, orthonormal, column = answer(basis[k]), basis[: k + 1], np.zeros(k + 2)
        before, length = np.inf, np.linalg.norm(image)
        while length < _TWICE * before:  # what is left is orthogonal only if it is not small
            share = orthonormal @ image
            image = image - share @ orthonormal
            column[: k + 1] += share
            before, length = length, np.linalg.norm(image)
        column[k + 1] = length
        basis[k + 1] = image / max(length, _TINY)
        columns.append(column)
        # rotations make the equations (1 - answer) triangular
        rotated = (-column).tolist()
        rotated[k] += 1.0
        for i, (c, s) in enumerate(turns):
            rotated[i], rotated[i + 1] = (
                c * rotated[i] + s * rotated[i + 1],
                c * rotated[i + 1] - s * rotated[i],
            )
        length = max(float(np.hypot(rotated[k], rotated[k + 1])), _TINY)
        c, s = rotated[k] / length, rotated[k + 1] / length
        turns.append((c, s))
        triangle.append(np.array([*rotated[:k], length]))
        right[k:] = [c * right[k], -s * right[k]]
        if abs(right[k + 1]) <= limit:
            break
    count = len(columns)
    share = np.linalg.solve(_square(triangle, count), np.array(right[:count]))
    return share @ basis[:count], _square(columns, count)


def _square(columns: list[np.ndarray], count: int) -> np.ndarray:
    """Matrix (count, count) of columns, some shorter, one longer."""
    square = np.zeros((count, count))
    for k, column in enumerate(columns):
        square[: min(len(column), count), k] = column[:count]
    return square
