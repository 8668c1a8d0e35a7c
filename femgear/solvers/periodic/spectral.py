"""Periodic response of the gear meshes in the frequency domain, all speeds together.

The harmonic equations of the mesh deflections, ``E + T G E = S``, are solved for many speeds at once, by a
fixed point or directly; meshes that repeat others later in time are solved once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.system.fourier import Product, pad, sample
from femgear.system.system import MeshExcitation, Modes, Response, mesh_harmonics, source_harmonics

# Two signals or receptances closer than this (relative) are equal: identical planets. And what natural
# frequencies of theirs differ by from rounding, which damping shows as a 1/(2 zeta)th at resonances.
_EQUAL, _ROUNDED = 1e-9, 1e-10
# Share of the energy in the upper half of the harmonics above which the message warns. Halving or doubling
# the harmonics of planetary sets shows a truncation error of the size of this share: 0.1 % of the amplitude.
_TAIL_ENERGY = 1e-3
# Fluctuation, relative to the mean, below which there is none.
_STILL = 1e-12
# A receptance relative to the static one beyond the inverse of which it is infinite.
_UNDAMPED = 1e-10
# Harmonics of speeds treated together: their receptances and matrices stay in the cache.
_BATCH = 4000
# And the most harmonics of any of them over the fewest.
_SPREAD = 3.0
# Part of the deflections with their mean that fluctuations are at least taken to be.
_LEAST = 1e-4
# Krylov steps of the first cycle at most, of each one after it twice as many; cycles, their residual, that
# for which single precision is used, and the part of its residual to which a cycle of it gets without delay.
_KRYLOV, _CYCLES, _ROUNDING, _SINGLE, _REACHED = 250, 4, 1e-13, 1e-7, 3e-6
# Unknowns of one speed up to which the spectral radius is exact.
_FEW = 60
# Iterations of the fixed point after which it may be given up.
_FIRST = 8


def solve_spectral(
    modes: Modes,
    excitation: MeshExcitation,
    mesh_frequency,
    *,
    excitation_harmonics: int | np.ndarray = 6,
    response_harmonics: int | np.ndarray = 12,
    tolerance: float = 1e-6,
    method: str = "auto",
    max_iterations: int = 100,
    radius: bool = True,
) -> Response:
    """Solve for the periodic response of the gear meshes at all mesh frequencies.

    The force of mesh j is ``f_j = F_j + k_j (d_j - s_j)`` (see MeshExcitation) with k, s and F cut to
    `excitation_harmonics`. With ``k~ = k - mean`` and the receptance T of the system that has the mean
    stiffnesses, the mesh deflections satisfy for every harmonic h

        ``d_h + T_h (k~ d)_h = S_h = d_load delta_h0 - T_h [F - k s]_h``

    which are Eqs. (7) to (12) of "Vibratory response of planetary gear sets housing by a spectral iterative
    approach"; its iteration is ``E <- S - T G E`` from ``E = S``.

    Parameters
    ----------
    modes : Modes
        Basis with mesh stiffnesses near the mean of the excitation.
    excitation : MeshExcitation
    mesh_frequency : float or (n_speeds,) array
        [Hz], not negative; zero gives the static response.
    excitation_harmonics, response_harmonics : int or (n_speeds,) int array
        Mesh harmonics kept in the data and in the response, of all speeds or one a speed; products are formed
        without aliasing. The result has as many harmonics as the speed with the most, zeros beyond its own.
    tolerance : float
        Change, relative to what fluctuates, at which the fixed point stops; the full equations of a converged
        solution then hold to ten times that.
    method : {"auto", "fixed point", "direct"}
        ``"auto"`` uses the fixed point where its changes promise convergence within `max_iterations`, and
        the direct solution of the same equations elsewhere.
    max_iterations : int
        Of the fixed point.
    radius : bool
        Compute the spectral radius of the fixed point, which is else NaN; nothing else depends on it.

    Returns
    -------
    Response
        Where ``converged`` is False (only with ``method="fixed point"``) the harmonics are NaN.

    Raises
    ------
    CaseError
        Data that cannot be used: not finite, negative frequencies, too few positions.
    ConvergenceError
        An undamped resonance, or equations that even the direct solution does not satisfy.
    """
    frequency = _checked(modes, excitation, mesh_frequency, method, tolerance, max_iterations)
    kept = np.stack(np.broadcast_arrays(frequency, excitation_harmonics, response_harmonics)[1:]).astype(int)
    _check_harmonics(*kept)
    excited, answered = (kept := kept * excitation.periods).max(axis=1)
    data = _Data.build(modes, excitation, excited, answered, frequency.max() / excitation.periods)
    n, speeds, sources = len(data.stiffness), len(frequency), 0 if data.source is None else len(data.source)
    sizes = n, n, len(modes.frequency), sources
    lines: Any = [np.zeros((speeds, size, answered + 1), complex) for size in sizes]
    numbers: Any = [np.zeros(speeds, kind) for kind in (float, float, float, float, int, bool)]
    solved = _Solved(*lines, *numbers)
    for part in _batches(frequency, kept[1]):
        how = _How(method, tolerance, max_iterations, radius)
        _solve_batch(modes, data, part, frequency / excitation.periods, kept, solved, how)
    return _response(frequency, solved, method, tolerance, excitation.periods)


def _batches(frequency: np.ndarray, highest: np.ndarray) -> list[np.ndarray]:
    """Numbers of speeds that are solved together, of similar numbers of harmonics (n_speeds,).

    All of a batch have as many as the speed with the most.
    """
    batches, first, together = list[list[int]](), 0, 0
    for speed in np.lexsort((frequency, highest)):
        size = int(highest[speed]) + 1
        together += size
        if not batches or size > _SPREAD * first or together > _BATCH:
            batches.append([])
            first = together = size
        batches[-1].append(int(speed))
    return [np.array(batch) for batch in batches]


@dataclass(frozen=True)
class HarmonicProblem:
    """``E_h + T_h (g E)_h = S_h`` for every harmonic h, mesh and speed.

    Parameters
    ----------
    receptance : (n, n, n_speeds, H + 1) complex array
        T [m/N], zero beyond the harmonics of a speed.
    product : Product
        Multiplication by the stiffness fluctuation g (n, H + 1) or (n, n_speeds, H + 1) of each mesh [N/m].
    source : (n, n_speeds, H + 1) complex array
        S [m].
    """

    receptance: np.ndarray
    product: Product
    source: np.ndarray

    def take(self, speeds: Any = slice(None), kind: Any = complex) -> HarmonicProblem:
        """Take the problem at some of the speeds, indices or a mask, complex or np.complex64."""
        receptance = self.receptance[:, :, speeds].astype(kind, copy=False)
        return HarmonicProblem(receptance, self.product.take(speeds, kind), self.source[:, speeds])


@dataclass(frozen=True)
class Twins:
    """Meshes that repeat others later in time: ``x_j(t) = x_leader(j)(t - phase_j T)``.

    Parameters
    ----------
    leaders : (n_groups,) int array
        First mesh of every group.
    group : (n_meshes,) int array
        Group of every mesh.
    shift : (n_meshes, H + 1) complex array
        Factors ``exp(-2 pi i h phase_j)``.
    """

    leaders: np.ndarray
    group: np.ndarray
    shift: np.ndarray

    @property
    def period(self) -> int:
        """Distance of harmonics at which all shifts are the same; their number where there are none."""
        again = np.all(np.abs(self.shift[:, 1:] - 1.0) < 1e3 * _EQUAL, axis=0)
        return int(again.argmax()) + 1 if again.any() else self.shift.shape[1]


def compliance(modes: Modes, omega: np.ndarray, chosen: Any = slice(None)) -> np.ndarray:
    """Compute modal receptances ``1 / (w_k^2 - omega^2 + 2 i zeta w_k omega)`` (..., n_modes) [s^2].

    Zero for rigid modes, which no self-equilibrated force moves. At angular frequencies (...) [rad/s], of
    some of the modes where they are chosen.

    ConvergenceError: an undamped resonance of a mode that a mesh moves.
    """
    natural, damping = 2.0 * np.pi * modes.frequency[chosen], modes.damping_ratio[chosen]
    elastic = natural > 0.0
    w = np.where(elastic, natural, 1.0)
    ratio = np.asarray(omega)[..., None] / w
    denominator = np.empty(ratio.shape, complex)
    denominator.real, denominator.imag = 1.0 - ratio * ratio, 2.0 * damping * ratio
    if damping.min(initial=1.0) < _UNDAMPED:
        moved = elastic & np.any(modes.mesh_deflection[:, chosen] != 0.0, axis=0)
        resonant = np.abs(denominator) < _UNDAMPED
        if np.any(resonant & moved):
            mode = np.arange(len(modes.frequency))[chosen][np.argwhere(resonant & moved)[0][-1]]
            raise ConvergenceError(
                f"undamped resonance of mode {mode + 1} at {modes.frequency[mode]:.6g} Hz: infinite response",
                code="E-RESONANCE",
                key="damping_ratio",
                value=float(modes.damping_ratio[mode]),
                limit="> 0",
                remedy="give the mode some damping or move the speed",
            )
        denominator[resonant] = 1.0
    return np.where(elastic, 1.0 / (w * w), 0.0) / denominator


def transfer(receptances: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Compute ``T_h f_h`` (n, n_speeds, H + 1) [m].

    Of receptances (n, n, n_speeds, H + 1) [m/N] and forces (n, n_speeds, H + 1) [N].
    """
    n, speeds, size = force.shape
    # in memory as `_rows` has it
    out = np.empty((speeds, n, size), np.result_type(receptances, force)).transpose(1, 0, 2)
    for response_, row in zip(out, receptances):
        np.multiply(row[0], force[0], out=response_)
        for part, other in zip(row[1:], force[1:]):
            response_ += part * other
    return out


def _apply(problem: HarmonicProblem, deflection: np.ndarray) -> np.ndarray:
    """``T G E`` of (n, n_speeds, H + 1) harmonics."""
    return transfer(problem.receptance, problem.product(deflection))


def _norm(deflection: np.ndarray) -> np.ndarray:
    """Euclidean norm over meshes and harmonics, per speed."""
    return np.sqrt(np.einsum("jsh,jsh->s", deflection, deflection.conj()).real)


def _moving(deflection: np.ndarray) -> np.ndarray:
    """Euclidean norm (n_speeds,) of what fluctuates, at least `_LEAST` of that with the mean.

    Gears of stiff teeth move by a hundredth of what their load deflects them.
    """
    whole = np.maximum(_norm(deflection), np.finfo(float).tiny)
    return np.maximum(_norm(deflection[..., 1:]), _LEAST * whole)


def solve_direct(problem: HarmonicProblem, accuracy: float = _ROUNDING) -> np.ndarray:
    """Solve ``(I + T G) E = S`` for the harmonics (n, n_speeds, H + 1) of the mesh deflections [m].

    Least residual in the space of the fixed point's iterates, to an accuracy relative to what fluctuates in S
    and in E: adaptive simpler GMRES (P. Jiranek and M. Rozloznik, Numer. Algorithms 53, 2010, pp. 93-112),
    all speeds together; but for rounding none depends on the others.
    """
    solution = problem.source.copy()
    moving, single = _moving(problem.source), accuracy >= _SINGLE
    for cycle in range(_CYCLES):
        rest = problem.source - solution - _apply(problem, solution)
        size, limit = _norm(rest), accuracy * np.minimum(moving, _moving(solution))
        todo = np.flatnonzero(size > limit)
        if not len(todo):
            break
        part = problem.take(todo, np.complex64 if single else complex)
        # the next cycle takes over where rounding would hold this one up
        near = np.maximum(limit, _REACHED * size) if single else limit
        solution[:, todo] += _cycle(part, _rows(rest[:, todo]), near[todo], _KRYLOV * 2**cycle)
    return solution


def _cycle(problem: HarmonicProblem, rest: np.ndarray, limit: np.ndarray, steps_at_most: int) -> np.ndarray:
    """Correction (n, n_speeds, H + 1) [m] that brings residuals, as rows, below limits (n_speeds,) [m].

    In the precision of the receptances.
    """
    speeds, n, most = len(rest), len(problem.source), min(steps_at_most, rest.shape[1])
    rest = rest.astype(np.real(problem.receptance).dtype, copy=False)
    ways, images = (np.empty((speeds, most, rest.shape[1]), rest.dtype) for _ in range(2))
    shares, steps, before = np.zeros((speeds, most, most)), np.zeros((speeds, most, 1)), limit
    for k in range(most + 1):
        size = np.linalg.norm(rest, axis=1)
        # a speed that is done takes no further part
        todo = size > limit
        if k == most or not todo.any():
            break
        ways[:, k] = rest * np.where(todo, 1.0 / np.where(todo, size, 1.0), 0.0)[:, None]
        if k:
            # residuals that hardly shrink are hardly independent
            stagnant = todo & (size > 0.9 * before)
            ways[stagnant, k] = images[stagnant, k - 1]
        before = size
        image = ways[:, k] + _rows(_apply(problem, _lines(ways[:, k], n)))
        share = np.matmul(images[:, :k], image[..., None])
        image -= np.matmul(images[:, :k].transpose(0, 2, 1), share)[..., 0]
        length = np.where(todo, np.linalg.norm(image, axis=1), 1.0)
        np.divide(image, np.maximum(length, np.finfo(float).tiny)[:, None], out=images[:, k])
        shares[:, :k, k], shares[:, k, k] = share[..., 0], length
        steps[:, k, 0] = np.einsum("sd,sd->s", images[:, k], rest)
        rest -= steps[:, k].astype(rest.dtype) * images[:, k]
    share = np.linalg.solve(shares[:, :k, :k], steps[:, :k]).astype(rest.dtype)
    return _lines(np.matmul(ways[:, :k].transpose(0, 2, 1), share)[..., 0], n)


def spectral_radius(problem: HarmonicProblem) -> np.ndarray:
    """Compute the spectral radius (n_speeds,) of the fixed point, that of ``T G``, without unit.

    The largest Ritz value of Arnoldi steps from one random vector (Saad, Numerical Methods for Large
    Eigenvalue Problems, algorithm 6.1): as many as there are unknowns, which makes it exact, of many unknowns
    20 in single precision; all speeds together, but for rounding none depends on the others.
    """
    n, speeds, size = problem.source.shape
    few = n * (2 * size - 1) <= _FEW
    steps, kind, real = (n * (2 * size - 1), complex, float) if few else (20, np.complex64, np.float32)
    start = np.random.default_rng(0).standard_normal((n, 1, size, 2)).view(complex)[..., 0]
    start[..., 0] = np.real(start[..., 0])
    rough = problem.take(kind=kind)
    basis, hessenberg = (
        np.empty((speeds, steps + 1, 2 * n * size), real),
        np.zeros((speeds, steps + 1, steps), real),
    )
    basis[:, 0] = _rows((start / _norm(start)[:, None]).astype(kind))
    for k in range(steps):
        image = _rows(_apply(rough, _lines(basis[:, k], n)))[..., None]
        orthonormal = basis[:, : k + 1]
        for _ in range(2 if few else 1):
            share = np.matmul(orthonormal, image)
            image -= np.matmul(orthonormal.transpose(0, 2, 1), share)
            hessenberg[:, : k + 1, k] += share[..., 0]
        length = np.linalg.norm(image[..., 0], axis=1)
        hessenberg[:, k + 1, k] = length
        basis[:, k + 1] = image[..., 0] / np.maximum(length, np.finfo(real).tiny)[:, None]
    return np.abs(np.linalg.eigvals(hessenberg[:, :-1])).max(axis=-1)


def find_twins(signals: tuple[np.ndarray, ...]) -> Twins:
    """Group meshes whose signals, harmonics (n_meshes, H + 1), are all the same but for one time shift."""
    scales = [max(np.abs(signal).max(), np.finfo(float).tiny) for signal in signals]
    stacked = np.stack([signal / scale for signal, scale in zip(signals, scales)])
    n, size = stacked.shape[1:]
    h = np.arange(size)
    leaders, group, shift = [], np.zeros(n, dtype=int), np.ones((n, size), dtype=complex)
    for j in range(n):
        for index, leader in enumerate(leaders):
            factor = np.exp(-2j * np.pi * h * _phase(stacked[:, leader], stacked[:, j]))
            if np.abs(stacked[:, j] - factor * stacked[:, leader]).max() < _EQUAL:
                group[j], shift[j] = index, factor
                break
        else:
            group[j] = len(leaders)
            leaders.append(j)
    return Twins(np.array(leaders), group, shift)


@dataclass(frozen=True)
class _Class:
    """Harmonics ``h`` at which twins have one shift, and the modes ``used`` that their joint forces move.

    ``rows`` (G, used) are the modal forces of every group, ``pairs`` (used, G G) and ``residual`` (G G,) make
    the receptance between the leaders of modal receptances.
    """

    h: slice
    used: np.ndarray
    rows: np.ndarray
    pairs: np.ndarray
    residual: np.ndarray


def _classes(modes: Modes, twins: Twins) -> list[_Class]:
    """Harmonics in classes of one shift; of meshes without twins all are in one."""
    member = twins.group == np.arange(len(twins.leaders))[:, None]
    classes, period = [], twins.period
    for i in range(period):
        shift = member * twins.shift[:, i]
        rows = shift @ modes.mesh_deflection
        used = np.flatnonzero(np.abs(rows).max(axis=0) > _EQUAL * np.abs(modes.mesh_deflection).max())
        pairs = modes.mesh_deflection[twins.leaders][:, None, used] * rows[:, used]
        pairs, residual = pairs.reshape(-1, len(used)).T, modes.residual[twins.leaders] @ shift.T
        classes.append(_Class(slice(i, None, period), used, rows[:, used], pairs, residual.ravel()))
    return classes


def _alike(modes: Modes, twins: Twins, omega: float) -> bool:
    """Whether receptances at multiples of a frequency [rad/s] share the symmetry of twins."""
    modal = compliance(modes, omega * np.arange(twins.shift.shape[1]))
    rows, member = modes.mesh_deflection, twins.group == np.arange(len(twins.leaders))[:, None]
    full = np.einsum("ik,hk,jk->hij", rows, modal, rows, optimize=True) + modes.residual
    folded = np.einsum("hij,gjh->ihg", full, member[:, :, None] * twins.shift)
    error = folded - twins.shift[:, :, None] * folded[twins.leaders][twins.group]
    least = np.where(modes.frequency > 0.0, modes.damping_ratio, 1.0).min(initial=1.0)
    equal = min(max(_EQUAL, _ROUNDED / max(2.0 * least, _UNDAMPED)), _LEAST)
    return bool(np.all(np.abs(error).max(axis=(0, 2)) <= equal * np.abs(full).max(axis=(1, 2))))


@dataclass(frozen=True)
class _Solved:
    """Response at all speeds, written down batch by batch.

    Parameters
    ----------
    deflection, force : (n_speeds, n, H + 1) complex arrays
        Harmonics of the meshes [m], [N].
    modal : (n_speeds, n_modes, H + 1) complex array
        Harmonics of the modal coordinates [m kg^1/2].
    source : (n_speeds, c, H + 1) complex array
        Harmonics of the loads along the sources [N, N m].
    residual, radius, tail, lowest : (n_speeds,) arrays
        ``residual``, ``spectral_radius``, ``tail`` and ``lowest_force`` of `Response`.
    iterations : (n_speeds,) int array
        Iterations of the fixed point.
    direct : (n_speeds,) bool array
        Whether the direct solution was used.
    """

    deflection: np.ndarray
    force: np.ndarray
    modal: np.ndarray
    source: np.ndarray
    residual: np.ndarray
    radius: np.ndarray
    tail: np.ndarray
    lowest: np.ndarray
    iterations: np.ndarray
    direct: np.ndarray


def _response(frequency, solved: _Solved, method: str, tolerance: float, periods: int) -> Response:
    """The speeds together; refuses what even the direct solution does not satisfy."""
    residual = solved.residual
    converged = residual <= 10.0 * tolerance
    if method != "fixed point" and not np.all(converged):
        worst = int(np.argmax(np.where(np.isfinite(residual), residual, np.inf)))
        raise ConvergenceError(
            f"residual {residual[worst]:.3e} of the harmonic equations at {frequency[worst]:.6g} Hz",
            code="E-RESONANCE",
            limit=f"{10.0 * tolerance:.1e}",
            remedy="the equations are nearly singular there: give the modes more damping or move the speed",
        )
    for array in (solved.deflection, solved.force, solved.modal, solved.tail, solved.lowest):
        array[~converged] = np.nan
        array.setflags(write=False)
    response = Response(
        mesh_frequency=frequency,
        deflection=solved.deflection,
        force=solved.force,
        modal=solved.modal,
        converged=converged,
        residual=residual,
        iterations=solved.iterations,
        spectral_radius=solved.radius,
        tail=solved.tail,
        method=tuple("direct" if flag else "fixed point" for flag in solved.direct),
        lowest_force=solved.lowest,
        message="",
        periods=periods,
        source=solved.source if solved.source.shape[1] else None,
    )
    return replace(response, message=joint_message([response]))


def _check_harmonics(excitation_harmonics: np.ndarray, response_harmonics: np.ndarray) -> None:
    short = response_harmonics < excitation_harmonics
    if np.any(short):
        wanted, given = excitation_harmonics[short][0], response_harmonics[short][0]
        raise CaseError(
            f"{given} response harmonics cannot follow {wanted} of the excitation",
            code="E-HARMONICS",
            key="response_harmonics",
            value=int(given),
            limit=f">= {wanted}, better twice as many",
        )


def _checked(modes, excitation, mesh_frequency, method, tolerance, max_iterations) -> np.ndarray:
    frequency = np.atleast_1d(np.array(mesh_frequency, dtype=float))
    if frequency.ndim != 1 or not len(frequency):
        raise CaseError("mesh frequencies must be one list", code="E-SHAPE", key="mesh_frequency")
    bad = ~np.isfinite(frequency) | (frequency < 0.0)
    if np.any(bad):
        raise CaseError(
            "mesh frequencies must be finite and not negative",
            code="E-RANGE",
            key="mesh_frequency",
            value=float(frequency[bad][0]),
            limit=">= 0 Hz",
        )
    if len(modes.mesh_stiffness) != len(excitation.stiffness):
        raise CaseError(
            f"modes of {len(modes.mesh_stiffness)} meshes, excitation of {len(excitation.stiffness)}",
            code="E-SHAPE",
        )
    if method not in ("auto", "fixed point", "direct"):
        raise CaseError(
            f"unknown method {method!r}",
            code="E-CHOICE",
            key="method",
            value=method,
            limit="auto, fixed point, direct",
        )
    if not 1e-12 <= tolerance < 1.0 or max_iterations < 1:
        raise CaseError(
            f"tolerance {tolerance} and {max_iterations} iterations cannot be used",
            code="E-RANGE",
            limit="1e-12 <= tolerance < 1, at least one iteration",
        )
    return frequency


@dataclass(frozen=True)
class _Data:
    """Excitation and symmetry of the meshes, the same at all speeds.

    Parameters
    ----------
    stiffness, deflection, force : (n, H + 1) complex arrays
        Harmonics of the mesh stiffness [N/m], the free deflection [m] and the mesh force [N] of the excitation.
    twins : Twins
        Which meshes repeat which.
    classes : list of _Class
        Harmonics at which all twins have one shift.
    source : (c, H + 1) complex array, optional
        Harmonics of the loads along the sources [N, N m].
    """

    stiffness: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    twins: Twins
    classes: list[_Class]
    source: np.ndarray | None = None

    @classmethod
    def build(cls, modes: Modes, excitation: MeshExcitation, excited: int, count: int, fastest: float) -> _Data:
        excited //= excitation.periods
        stiffness, deflection, force = (pad(harmonics_, count) for harmonics_ in mesh_harmonics(excitation, excited))
        load = pad(modes.load_deflection[:, None], count)
        source, signals = source_harmonics(excitation, excited), [stiffness, deflection, force, load]
        if source is not None:
            if modes.source_load is None or modes.source_load.shape[1] != len(source):
                raise CaseError("the modes do not know the sources of the excitation", code="E-SHAPE")
            source = pad(source, count)
            signals.append(_by_sources(modes, source, 2.0 * np.pi * fastest * np.arange(count + 1)[None])[:, 0])
        twins = find_twins(tuple(signals))
        if twins.period > len(twins.group) or not _alike(modes, twins, 2.0 * np.pi * fastest):
            twins = _alone(len(twins.group), count)
        return cls(stiffness, deflection, force, twins, _classes(modes, twins), source)


def _by_sources(modes: Modes, source: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Mesh deflections (n, n_speeds, H + 1) by loads along the sources (c, H + 1), at (n_speeds, H + 1) [rad/s]."""
    assert modes.source_load is not None
    assert modes.source_residual is not None
    moved = _moved_by_sources(modes, source, omega)
    return np.moveaxis(moved @ modes.mesh_deflection.T, -1, 0) + (modes.source_residual @ source)[:, None]


def _moved_by_sources(modes: Modes, source: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Modal coordinates (n_speeds, H + 1, n_modes) by loads along the sources; rigid modes, which strain nothing, 0."""
    assert modes.source_load is not None
    return compliance(modes, omega) * (modes.source_load @ source).T


def _alone(n: int, count: int) -> Twins:
    """Meshes of which none repeats another."""
    return Twins(np.arange(n), np.arange(n), np.ones((n, count + 1), complex))


@dataclass(frozen=True)
class _How:
    """Options of `solve_spectral`.

    ``method`` is one of its names, ``tolerance`` the relative residual and ``max_iterations`` the number of
    iterations at most; ``radius`` tells whether the spectral radius is computed.
    """

    method: str
    tolerance: float
    max_iterations: int
    radius: bool


def _solve_batch(modes, data: _Data, part, fundamental, kept, solved: _Solved, how: _How):
    """Solve at some speeds, numbers ``part``, and write down what is found."""
    excited, answered = kept[:, part]
    lines, leaders, group = np.arange(answered.max() + 1), data.twins.leaders, data.twins.group
    n, size, groups = len(group), len(lines), len(leaders)
    answered_lines = lines <= answered[:, None]
    stiffness, deflection, force = (
        harmonics_[leaders, None, :size] * (lines <= excited[:, None])
        for harmonics_ in (data.stiffness, data.deflection, data.force)
    )
    forcing = (force - Product(stiffness)(deflection)) * answered_lines
    stiffness[..., 0] -= modes.mesh_stiffness[leaders, None]
    receptance, modal = np.empty((groups, groups, len(part), size), complex), []
    for class_ in data.classes:
        modal.append(compliance(modes, 2.0 * np.pi * fundamental[part, None] * lines[class_.h], class_.used))
        between = np.moveaxis(modal[-1] @ class_.pairs + class_.residual, -1, 0)
        receptance[..., class_.h] = between.reshape(groups, groups, len(part), -1)
    receptance *= answered_lines
    source, driven, moved_by = -transfer(receptance, forcing), None, None
    source[..., 0] += modes.load_deflection[leaders, None]
    if data.source is not None:
        # of lines beyond the last one that is excited there is nothing
        kept_lines = lines <= excited[:, None]
        omega = 2.0 * np.pi * fundamental[part, None] * lines
        driven = _by_sources(modes, data.source[:, :size], omega) * kept_lines
        moved_by = _moved_by_sources(modes, data.source[:, :size], omega) * kept_lines[..., None]
        source += driven[leaders]
        solved.source[part, :, :size] = data.source[None, :, :size] * kept_lines[:, None]
    problem = HarmonicProblem(receptance, Product(stiffness), source)
    solved.radius[part] = spectral_radius(problem) if how.radius else np.nan
    solution, solved.iterations[part], solved.direct[part] = _solve(problem, how)
    total = (forcing + problem.product(solution)) * answered_lines
    shift = data.twins.shift[:, None, :size]
    every, deflection = total[group] * shift, solution[group] * shift
    force = every + modes.mesh_stiffness[:, None, None] * deflection
    predicted = -np.tensordot(modes.residual, every, axes=1) * answered_lines
    for class_, response in zip(data.classes, modal):
        moved = -(np.moveaxis(total[:, :, class_.h], 0, -1) @ class_.rows) * response
        predicted[:, :, class_.h] += np.moveaxis(moved @ modes.mesh_deflection[:, class_.used].T, -1, 0)
        solved.modal[..., :size][part[:, None], class_.used, class_.h] = moved.transpose(0, 2, 1)
    predicted[..., 0] += modes.load_deflection[:, None]
    if driven is not None and moved_by is not None:
        predicted += driven
        solved.modal[part, :, :size] += moved_by.swapaxes(1, 2)
    if modes.modal_load is not None:
        solved.modal[part, :, 0] += modes.modal_load * compliance(modes, np.zeros(()))
    solved.residual[part] = _norm(deflection - predicted) / _moving(deflection)
    solved.deflection[part, :, :size], solved.force[part, :, :size] = (
        harmonics_.transpose(1, 0, 2) for harmonics_ in (deflection, force)
    )
    solved.tail[part] = _tail(deflection.transpose(1, 0, 2), answered)
    solved.lowest[part] = sample(force[leaders], 4 * size).min(axis=(0, 2))
    # the full equations decide: planets equal to 1e-9 only, or a last iteration that grew again
    rough = ~(solved.residual[part] <= how.tolerance)
    if rough.any() and (how.method == "auto" or (how.method == "direct" and groups < n)):
        twins = _alone(n, data.stiffness.shape[1] - 1)
        whole = replace(data, twins=twins, classes=_classes(modes, twins))
        _solve_batch(modes, whole, part[rough], fundamental, kept, solved, replace(how, method="direct"))


def _solve(problem: HarmonicProblem, how: _How):
    """Deflections, iterations and where the direct solution was used."""
    speeds = problem.source.shape[1]
    if how.method == "direct":
        return solve_direct(problem), np.zeros(speeds, int), np.ones(speeds, bool)
    deflection, iterations, done = _fixed_point(
        problem, how.tolerance, how.max_iterations, patient=how.method != "auto"
    )
    direct = (how.method == "auto") & ~done
    chosen = np.flatnonzero(direct)
    if len(chosen):
        deflection[:, chosen] = solve_direct(problem.take(chosen), max(0.5 * how.tolerance, _ROUNDING))
    return deflection, iterations, direct


def _fixed_point(problem: HarmonicProblem, tolerance: float, max_iterations: int, *, patient: bool):
    """``E <- S - T G E`` until the relative change is below `tolerance`, at most `max_iterations` times.

    Where the changes do not promise that it is given up, unless `patient`. Returns values, iterations, and
    whether they converged.
    """
    values, active = problem.source.copy(), np.arange(problem.source.shape[1])
    iterations, done = np.zeros(len(active), int), np.zeros(len(active), bool)
    limit = 1e8 * np.maximum(_norm(values), np.finfo(float).tiny)
    value, history = values, []
    for step in range(1, max_iterations + 1):
        new = problem.source - _apply(problem, value)
        size, change = _norm(new), _norm(new - value)
        value, history = new, [change, *history[:_FIRST]]
        enough = tolerance * _moving(new)
        small = change <= enough
        stop = small | ~(size < limit[active]) | (step == max_iterations)
        if not patient and step > _FIRST:
            shrink = change / np.maximum(history[_FIRST], np.finfo(float).tiny)
            # as many times the shrinking of the last iterations as are left
            left = (max_iterations - step) / _FIRST
            stop |= change * np.minimum(shrink, 1.0) ** left > enough
        if stop.any():
            at, rest = active[stop], ~stop
            values[:, at], iterations[at], done[at] = new[:, stop], step, small[stop]
            if not rest.any():
                break
            active, problem, value = active[rest], problem.take(rest), value[:, rest]
            history = [vectors[rest] for vectors in history]
    return values, iterations, done


def _tail(deflection: np.ndarray, highest: np.ndarray) -> np.ndarray:
    """Share of the fluctuating amplitude in the harmonics above half the highest (root of energies).

    Zero where the fluctuation is rounding of the mean.
    """
    energy = np.sum(np.abs(deflection) ** 2, axis=1)
    upper = np.where(np.arange(energy.shape[1]) > highest[:, None] // 2, energy, 0.0).sum(axis=1)
    total = energy[:, 1:].sum(axis=1)
    still = total <= _STILL**2 * energy[:, 0]
    return np.where(still, 0.0, np.sqrt(upper / np.where(still, 1.0, total)))


def joint_message(responses: Sequence[Response]) -> str:
    """Write what is to be said of responses, each at some speeds: the method, and everything doubtful."""
    names = ("mesh_frequency", "converged", "spectral_radius", "tail", "lowest_force")
    frequency, converged, radius, tail, lowest = (
        np.concatenate([getattr(response, name) for response in responses]) for name in names
    )
    direct = np.concatenate([np.array(response.method) == "direct" for response in responses])
    largest = ""
    if not np.all(np.isnan(radius)):
        worst = int(np.nanargmax(radius))
        largest = f"; largest spectral radius {radius[worst]:.3g} at {frequency[worst]:.6g} Hz"
    parts = [
        f"{len(frequency)} speeds: fixed point at {int(np.sum(~direct & converged))}, direct solution at "
        f"{int(np.sum(direct))}{largest}."
    ]
    if not np.all(converged):
        first = int(np.argmin(converged))
        parts.append(
            f"The fixed point did not converge at {int(np.sum(~converged))} speeds, first at "
            f"{frequency[first]:.6g} Hz with spectral radius {radius[first]:.3g}: use the direct solution."
        )
    if not np.any(converged):
        return " ".join(parts)
    short = converged & (tail**2 > _TAIL_ENERGY)
    if np.any(short):
        worst = int(np.argmax(np.where(converged, tail, -1.0)))
        parts.append(
            f"Too few response harmonics at {int(np.sum(short))} speeds: the upper half holds "
            f"{tail[worst] ** 2:.2g} of the energy at {frequency[worst]:.6g} Hz (wanted: below "
            f"{_TAIL_ENERGY:g})."
        )
    if np.any(lowest < 0.0):
        worst = int(np.nanargmin(lowest))
        parts.append(
            f"A mesh force becomes negative at {int(np.sum(lowest < 0.0))} speeds, worst at "
            f"{frequency[worst]:.6g} Hz ({lowest[worst]:.4g} N): teeth would separate there, "
            "which this linear solution cannot follow."
        )
    return " ".join(parts)


def _phase(leader: np.ndarray, follower: np.ndarray) -> float:
    """Time shift, as a fraction of the period, from the first harmonic that is there."""
    present = np.abs(leader[:, 1:]) > 1e3 * _EQUAL
    if not np.any(present):
        return 0.0
    h = int(np.argmax(np.any(present, axis=0))) + 1
    signal = int(np.argmax(np.abs(leader[:, h])))
    return float(-np.angle(follower[signal, h] / leader[signal, h]) / (2.0 * np.pi * h))


def _rows(harmonics: Any) -> np.ndarray:
    """(n, n_speeds, H + 1) harmonics as one interleaved real row a speed."""
    flat = np.ascontiguousarray(harmonics.transpose(1, 0, 2))
    return flat.view(np.real(flat).dtype).reshape(len(flat), -1)


def _lines(rows: np.ndarray, n: int) -> np.ndarray:
    """(n, n_speeds, H + 1) harmonics of rows as `_rows` makes them."""
    parts = np.ascontiguousarray(rows).view(np.result_type(rows, np.complex64))
    return parts.reshape(len(rows), n, -1).transpose(1, 0, 2)
