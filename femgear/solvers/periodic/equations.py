"""The harmonic equations of the element deflections, whatever the number of degrees of freedom.

``X_l + T(omega_l) (F_l - reference X_l) = T_load(omega_l) S_l`` for every line l, with the receptance T of
the system whose elements are springs of the reference stiffness, the lines F of the element forces by
alternating between frequency and time, and the loads S.
(Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems, 2019, chapters 2 and 4.)

For many lines the derivative is an operator without a matrix of its size (`LineTangent`). One product costs a
transform forth and back and the receptance of every line. GMRES (Saad and Schultz, SIAM J. Sci. Stat. Comput.
7 (1986) 856) needs few of them, because the operator is the unit matrix plus the fixed point of the iteration
with reference springs, whose eigenvalues are small or few. Directions that turn with a carrier couple lines however
constant stiffnesses are: such lines are solved together first (`femgear.solvers.periodic.line_groups`).

A periodic motion needs a mean acceleration of zero, so on motions that supports leave free the mean forces of
the elements balance the constant load (Krack and Gross, section 2.3: line zero of the harmonic equations). A
one-sided contact pushes only; where the load asks it to pull, with nothing else to hold it, its mean
deflection grows without end, and so does everything that is measured by it (`_uncarried_note`).
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import linalg
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs, gmres

from femgear.errors import CaseError, ConvergenceError, checked_count
from femgear.solvers.linear.receptance import (
    FEW_FREQUENCIES,
    DirectReduction,
    Reduction,
    reduce_directly,
    reduce_problem,
    source_columns,
)
from femgear.solvers.periodic.line_groups import line_groups
from femgear.solvers.periodic.phase_grid import (
    PhaseGrid,
    coupled_pairs,
    forces_on_grid,
    on_grid,
    phase_grid,
    sample_counts,
)
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.system.force_laws import Element, GearMeshes
from femgear.system.fourier import checked_lines, harmonic_lines, line_tail
from femgear.system.system import NonlinearSystem

# Mean deflection, over the typical one and over the lengths of the elements, beyond which it is far away.
_FAR, _LENGTHS = 1e6, 10.0
# Share of the static deflection by which the mean may be out of balance.
_BALANCED = 1e-3
# Stiffness relative to the largest, strain of a column and force beyond reach that count as none.
_FREE, _UNSTRAINED, _BEYOND = 1e-11, 1e-9, 1e-6
# Degrees of freedom up to which the free motions are computed to name the cause.
_MOST_DOFS = 1500
# Unknowns up to which matrices of their size are cheaper than products with them.
MANY = 600
# Stiffness of a column, relative to the largest one, that counts as none.
_NO_STIFFNESS = 1e-9
# Where a problem keeps its reduction for few lines.
_KEPT = "_reduction_for_few_lines"
# Relative accuracy of a Newton step, and products after which the matrix is taken instead.
_ACCURACY, _PRODUCTS = 1e-3, 60


@dataclass(frozen=True)
class HarmonicBalance:
    """The harmonic equations of a problem on given lines, ready for any base frequencies.

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    orders : (L, n_bases) int array
        Lines; line 0 is the mean.
    reduction : Reduction or DirectReduction
        Receptances between the columns and the loads at every line.
    grid : PhaseGrid
        Instants at which the elements are evaluated.
    elements : tuple of Element
        With their coefficients on the grid.
    pairs : (n_pairs, 2) int array
        Columns that elements couple.
    source : (n_loads, L) complex array
        Amplitudes of the load columns of the reduction.
    scale : float
        Typical deflection [m]: the largest static one, or a length of the elements where there is none.
    longest : float
        Largest length that an element names [m].
    """

    problem: NonlinearSystem
    orders: np.ndarray
    reduction: Reduction | DirectReduction
    grid: PhaseGrid
    elements: tuple[Element, ...]
    pairs: np.ndarray
    source: np.ndarray
    scale: float
    longest: float

    @cached_property
    def turning_bases(self) -> list[int]:
        """Bases by which directions of elements turn."""
        waves = [np.array(wave.orders) for element in self.elements if (wave := getattr(element, "wave", None))]
        return sorted({int(base) for orders in waves for base in np.flatnonzero(orders)})

    @property
    def size(self) -> int:
        """Number of real unknowns, ``n_columns (2 L - 1)``."""
        return len(self.reduction.reference) * (2 * len(self.orders) - 1)

    def unknowns(self, lines) -> np.ndarray:
        """Make the real vector ``Re X_0, Re X_1, Im X_1, ...`` (n_y,) [m] of lines (n_columns, L) [m]."""
        lines = np.asarray(lines, np.complex128)
        out = np.empty((len(lines), 2 * lines.shape[1] - 1))
        out[:, 0], out[:, 1::2], out[:, 2::2] = lines[:, 0].real, lines[:, 1:].real, lines[:, 1:].imag
        return out.ravel()

    def lines(self, y) -> np.ndarray:
        """Make the lines (n_columns, L) [m] of the unknowns y (n_y,) [m]."""
        table = np.asarray(y, float).reshape(len(self.reduction.reference), -1)
        out = np.empty((len(table), len(self.orders)), complex)
        out[:, 0], out[:, 1:] = table[:, 0], table[:, 1::2] + 1j * table[:, 2::2]
        return out

    def forces(self, lines) -> tuple[np.ndarray, np.ndarray]:
        """Compute the element forces beyond the reference springs (n_columns, L) [N] at lines of that shape.

        With them for every coupled pair their derivative (n_pairs, L, 2 L - 1) [N/m] by the unknowns of one
        column.
        """
        # one transform for forces and tangents; columns without elements keep their reference spring
        both = self.grid.transform(np.hstack(self.beyond_reference(lines)))
        n = len(self.reduction.reference)
        return self.grid.amplitudes(both[:n]), self.grid.products(both[n:])

    def forces_beyond(self, lines) -> np.ndarray:
        """Compute the element forces beyond the reference springs (n_columns, L) [N] at lines of that shape."""
        return self.grid.amplitudes(self.grid.transform(self.beyond_reference(lines)[0]))

    def beyond_reference(self, lines) -> tuple[np.ndarray, np.ndarray]:
        """Compute forces (N, n_columns) [N] and tangents (N, n_pairs) [N/m] less the reference springs."""
        reference, x = self.reduction.reference, self.grid.values(lines)
        force, tangent = forces_on_grid(self.elements, self.pairs, x, self.grid.theta)
        of_itself = self.pairs[:, 0] == self.pairs[:, 1]
        tangent[:, of_itself] -= reference[self.pairs[of_itself, 0]]
        return force - reference * x, tangent

    def receptance(self, frequency) -> tuple[np.ndarray, np.ndarray]:
        """Compute receptance [m/N] and derivative (L, n_columns, n_columns + n_loads) at bases [rad/s]."""
        frequency = np.atleast_1d(np.asarray(frequency, float))
        return self.reduction.at(self.orders @ frequency)

    def receptance_at(self, frequency) -> np.ndarray:
        """Compute the receptance (L, n_columns, n_columns + n_loads) [m/N] alone at bases [rad/s]."""
        return self.reduction.value(self.orders @ np.atleast_1d(np.asarray(frequency, float)))

    def residual(self, lines, force, receptance) -> np.ndarray:
        """Compute the residual ``X + T (F - reference X) - T_load S`` (n_columns, L) [m].

        From ``lines`` X (n_columns, L) [m], ``force`` of the elements (n_columns, L) [N] and the ``receptance`` of
        `receptance_at`.
        """
        return lines + self._respond(receptance, force)

    def jacobian(self, products, receptance) -> np.ndarray:
        """Compute the derivative (n_y, n_y) of the residual by the unknowns, from `forces` and receptance."""
        n, width = len(self.reduction.reference), 2 * len(self.orders) - 1
        columns = np.zeros((n, len(self.orders), n, width), np.complex128)
        transfer = receptance[:, :, :n].transpose(1, 0, 2)
        for (row, column), block in zip(self.pairs, products):
            columns[:, :, column] += transfer[:, :, row, None] * block
        out = np.empty((n, width, n, width))
        out[:, 0], out[:, 1::2] = np.real(columns[:, 0]), np.real(columns[:, 1:])
        out[:, 2::2] = np.imag(columns[:, 1:])
        out = out.reshape(n * width, n * width)
        out[np.diag_indices(n * width)] += 1.0
        return out

    def evaluate(
        self, y, frequency, forces: tuple[np.ndarray, np.ndarray] | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute the residual (n_y,) [m] at unknowns y (n_y,) [m] and base frequencies (n_bases,) [rad/s].

        With its derivatives (n_y, n_y) by y and (n_y, n_bases) by the base frequencies; ``forces`` are those of
        `forces` at y, where they are known.
        """
        lines = self.lines(y)
        force, products = self.forces(lines) if forces is None else forces
        value, change = self.receptance(frequency)
        moved = self._respond(change, force)
        slope = np.stack([self.unknowns(moved * order) for order in self.orders.T], axis=1)
        residual = self.unknowns(self.residual(lines, force, value))
        return residual, self.jacobian(products, value), slope

    def spectral_radius(self, y, frequency, products: np.ndarray | None = None) -> float:
        """Compute the spectral radius of the fixed point ``X <- T_load S - T (F - reference X)`` at y (n_y,).

        ``products`` are those of `forces` at y, where they are known. Largest modulus of the eigenvalues of ``T d(F -
        reference X)/dX``, the Jacobian of the residual less one; all are computed up to 600 unknowns. Beyond, Arnoldi's
        method finds it to 1 %.
        """
        receptance = self.receptance_at(frequency)
        if self.size > MANY:
            radius = krylov_radius(linearised(self, receptance, np.asarray(y, float))[1])
            if radius is not None:
                return radius
        products = self.forces(self.lines(y))[1] if products is None else products
        matrix = self.jacobian(products, receptance)
        matrix[np.diag_indices(self.size)] -= 1.0
        return float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0))

    def linear_start(self, frequency) -> np.ndarray:
        """Compute the unknowns (n_y,) [m] of the response with reference springs, forced as at its mean."""
        value = self.receptance_at(frequency)
        static = -self._respond(value, np.zeros((len(self.reduction.reference), len(self.orders))))
        mean = np.zeros_like(static)
        mean[:, 0] = static[:, 0]
        return self.unknowns(-self._respond(value, self.forces(mean)[0]))

    def crossed_start(self, frequency) -> np.ndarray | None:
        """Compute `linear_start` (n_y,) [m] with meshes that the mean load pulls apart on their back flanks.

        None where there is no such mesh: between both flanks nothing tells Newton's method the way.
        """
        lines, pulled_across = self.lines(self.linear_start(frequency)), False
        for mesh in self.elements:
            if isinstance(mesh, GearMeshes) and mesh.separates:
                column, (deflection, force) = mesh.columns.ravel(), mesh.state
                carried = force.mean + mesh.stiffness.mean * (np.real(lines[column, 0]) - deflection.mean)
                backlash = np.asarray(mesh.backlash)
                pulled = (carried < 0.0) & np.isfinite(backlash)
                lines[column[pulled], 0] -= backlash[pulled]
                pulled_across |= bool(pulled.any())
        return self.unknowns(lines) if pulled_across else None

    def solution(self, y, frequency, *, radius: bool = False, forces: Any = None, **what_happened) -> PeriodicSolution:
        """Make a solution of unknowns (n_y,) [m]; keywords are fields of `PeriodicSolution` on how it came.

        With ``radius`` the spectral radius of the fixed point is among them, where the lines are finite;
        ``forces`` are those of `forces` at the lines where they are known.
        """
        frequency = np.atleast_1d(np.asarray(frequency, float))
        lines = self.lines(y)
        beyond, products = (self.forces_beyond(lines), None) if forces is None else forces

        def residual() -> np.ndarray:
            return self.residual(lines, beyond, self.receptance_at(frequency))

        if "residual" not in what_happened:
            what_happened["residual"] = relative_residual(self, self.unknowns(residual()), y)
        if radius and np.all(np.isfinite(lines)):
            what_happened["spectral_radius"] = self.spectral_radius(y, frequency, products)
        entries = {"converged": True, "iterations": 0, "factorisations": 0, "message": "", **what_happened}
        if note := _uncarried_note(self, lines, residual, entries["converged"]):
            # the whole mean load is out of balance, whatever its ratio to a deflection that runs away
            entries |= {"converged": False, "message": f"Not converged: {note}."}
            entries["residual"] = max(entries["residual"], 1.0)
        force = beyond + self.reduction.reference[:, None] * lines
        return PeriodicSolution(frequency, self.orders, lines, force, tail=line_tail(lines, self.orders), **entries)

    def _respond(self, receptance, force) -> np.ndarray:
        """``T force - T_load S`` (n_columns, L)."""
        table = np.concatenate([force, -self.source]).T
        return (receptance @ table[..., None])[..., 0].T


def harmonic_balance(
    problem: NonlinearSystem,
    *,
    harmonics: int | None = None,
    orders=None,
    samples=None,
    reduction: Reduction | DirectReduction | None = None,
    frequencies: int | None = None,
    like: HarmonicBalance | None = None,
) -> HarmonicBalance:
    """Make the harmonic equations of a problem.

    CaseError: lines that cannot be used, a harmonic force without line, too few samples. ConvergenceError: a
    rigid motion that strains a column, see `reduced`.

    Parameters
    ----------
    harmonics : int, optional
        Highest harmonic; with several base frequencies the highest sum of orders (`harmonic_lines`).
    orders : (L, n_bases) int array, optional
        The lines themselves, such as those of `side_bands`. One of the two must be given.
    samples : int or tuple of int, optional
        Points of the phase grid along every base; see `sample_counts` for the default.
    reduction : Reduction, optional
        Of the same problem, from `reduce_problem`; made here when not given.
    frequencies : int, optional
        At how many base frequencies the equations are asked for where these are few, which saves modes.
    like : HarmonicBalance, optional
        Equations whose grid is taken where the problem has the very same elements, lines and samples.
    """
    if (harmonics is None) == (orders is None):
        words = "give the number of harmonics or the lines"
        raise CaseError(words, code="E-HARMONICS", limit="one of the two")
    if orders is None:
        harmonics = checked_count(harmonics, "harmonics", code="E-HARMONICS", least=0)
        _check_harmonics(problem, harmonics)
        orders = harmonic_lines(harmonics, problem.bases)
    else:
        orders = checked_lines(orders)
    bases = orders.shape[1]
    if bases < problem.bases:
        raise CaseError(
            f"lines of {bases} base frequencies, elements and forces of {problem.bases}",
            code="E-HARMONICS",
            remedy="give one order a base frequency",
        )
    if samples is not None:
        samples = (samples,) * bases if np.ndim(samples) == 0 else tuple(samples)
        if len(samples) != bases or any(int(count) != count for count in samples):
            raise CaseError(f"samples {samples} for {bases} base frequencies", code="E-HARMONICS")
    if reduction is None:
        reduction = reduced(problem, None if frequencies is None else frequencies * len(orders))
    columns, loads = len(reduction.reference), 1 + 2 * len(problem.forces)
    if reduction.static.shape != (columns, columns + loads) or columns != problem.system.W.shape[1]:
        raise CaseError("the reduction belongs to another problem", code="E-SHAPE", key="reduction")
    source = source_columns(problem, orders)
    counts = samples or sample_counts(problem, orders)
    if like is not None and _same_elements(problem, orders, like) and like.grid.samples == counts:
        grid, elements, pairs, longest = like.grid, like.elements, like.pairs, like.longest
    else:
        grid = phase_grid(orders, counts)
        elements = tuple(on_grid(element, grid.theta) for element in problem.elements)
        pairs, longest = coupled_pairs(elements), _longest(problem)
    static = float(np.abs(reduction.static[:, columns:] @ source).max(initial=0.0))
    scale = static or longest or 1.0
    return HarmonicBalance(problem, orders, reduction, grid, elements, pairs, source, scale, longest)


def _same_elements(problem: NonlinearSystem, orders: np.ndarray, like: HarmonicBalance) -> bool:
    """Whether a problem has the elements of equations, object by object, and the same lines (L, n_bases)."""
    mine, other = problem.elements, like.problem.elements
    return len(mine) == len(other) and all(map(operator.is_, mine, other)) and np.array_equal(orders, like.orders)


def reduced(problem: NonlinearSystem, lines: int | None = None) -> Reduction | DirectReduction:
    """Reduce a problem at its elements' own reference; a refusal names the element without stiffness there.

    For so many ``lines`` alone, where that is known, in the way that is cheaper for them; the problem keeps
    that reduction. ConvergenceError: a motion without stiffness strains an element (E-RIGID-MODE).
    """
    if lines is not None and lines <= FEW_FREQUENCIES:
        # a frozen dataclass: `replace` makes problems without it
        kept = vars(problem)[_KEPT] = vars(problem).get(_KEPT) or reduce_directly(problem)
        if kept is not None:
            return kept
    try:
        return reduce_problem(problem)
    except ConvergenceError as error:
        total = np.abs(problem.reference)
        column = int(np.argmin(total))
        if error.code != "E-RIGID-MODE" or total[column] > _NO_STIFFNESS * total.max():
            raise
        raise ConvergenceError(
            f"{_element_name(problem, column)} has no linear stiffness, and nothing else holds the motion "
            "that strains it",
            code="E-RIGID-MODE",
            limit="a stiffness at rest, or a reference in its place",
            remedy="where it stiffens with the deflection pass reduction=reduce_problem(problem, "
            "reference=stiffness of every column at the expected amplitude [N/m]); else give it a stiffness",
        ) from error


def _element_name(problem: NonlinearSystem, column: int) -> str:
    """Kind and number of the first element on a column: "bearing 1"."""
    kinds = {"GearMeshes": "mesh", "RadialBearings": "bearing", "PolynomialSprings": "spring"}
    count: dict[str, int] = {}
    for element in problem.elements:
        kind = kinds.get(type(element).__name__, "spring")
        here = np.flatnonzero(np.any(element.columns == column, axis=1))
        if len(here):
            return f"{kind} {count.get(kind, 0) + int(here[0]) + 1}"
        count[kind] = count.get(kind, 0) + len(element.columns)
    return f"column {column + 1} of W, on which no element acts,"


@dataclass(frozen=True)
class LineTangent:
    """``dR/dX`` of the harmonic equations of a ``balance`` at one deflection, without a matrix of its size.

    ``receptance`` (L, n_columns, n_columns + n_loads) [m/N] of the lines; ``stiffness`` (N, n_pairs) [N/m]:
    tangents of the coupled pairs less the reference springs, on the grid.
    """

    balance: HarmonicBalance
    receptance: np.ndarray
    stiffness: np.ndarray

    def fixed_point(self, y) -> np.ndarray:
        """Compute ``T d(F - reference X)`` (n_y,) [m] for a change y (n_y,) [m] of the unknowns."""
        balance = self.balance
        lines = balance.lines(y)
        n, pairs = len(lines), balance.pairs
        x = balance.grid.values(lines)
        force = np.zeros_like(x)
        for number, (row, column) in enumerate(pairs):
            force[:, row] += self.stiffness[:, number] * x[:, column]
        moved = balance.grid.amplitudes(balance.grid.transform(force))
        return balance.unknowns((self.receptance[:, :, :n] @ moved.T[..., None])[..., 0].T)

    def solve(self, error) -> np.ndarray | None:
        """Solve for ``dR/dX^-1 error`` (n_y,) [m] to three digits; None where GMRES does not get there."""
        balance, near = self.balance, lambda y: y
        if balance.turning_bases:
            n = len(balance.reduction.reference)
            parts = balance.turning_bases, balance.pairs, self.receptance[:, :, :n], self.stiffness
            groups = line_groups(balance.grid, *parts)
            near = lambda y: balance.unknowns(groups.solve(balance.lines(y)))  # noqa: E731

        def product(y) -> np.ndarray:
            solved = near(y)
            return solved + self.fixed_point(solved)

        step, state = gmres(_operator(len(error), product), error, rtol=_ACCURACY, restart=_PRODUCTS, maxiter=1)
        return None if state else near(step)


def linearised(balance: HarmonicBalance, receptance, y) -> tuple[np.ndarray, LineTangent]:
    """Compute the residual (n_y,) [m] of the harmonic equations at y (n_y,) [m], and its derivative.

    ``receptance`` as `LineTangent` has it.
    """
    lines = balance.lines(y)
    force, stiffness = balance.beyond_reference(lines)
    beyond = balance.grid.amplitudes(balance.grid.transform(force))
    error = balance.unknowns(balance.residual(lines, beyond, receptance))
    return error, LineTangent(balance, receptance, stiffness)


def krylov_radius(tangent: LineTangent) -> float | None:
    """Find the spectral radius of the fixed point to 1 %; None where Arnoldi's method fails.

    Hundreds of lines far from any resonance have eigenvalues of nearly the same modulus: more digits would
    take ten times as many products.
    """
    size = tangent.balance.size
    operator = _operator(size, tangent.fixed_point)
    # a fixed start: the same value every time
    start = np.random.default_rng(0).standard_normal(size)
    try:
        values = eigs(
            operator,
            k=1,
            ncv=30,
            v0=start,
            which="LM",
            tol=1e-2,  # type: ignore[arg-type]
            maxiter=60,
            return_eigenvectors=False,
        )
    except ArpackError:
        return None
    return float(np.abs(values).max())


def _operator(size: int, product: Callable[[np.ndarray], np.ndarray]):
    return LinearOperator((size, size), matvec=product, dtype=float)  # type: ignore[call-arg]


def relative_residual(balance: HarmonicBalance, error, y) -> float:
    """Divide a violation (n_y,) [m] by the largest deflection at y (n_y,), whose mean counts up to `far`."""
    table = np.abs(np.reshape(y, (len(balance.reduction.reference), -1)))
    mean = min(float(table[:, 0].max()), far(balance))
    size = max(mean, float(table[:, 1:].max(initial=0.0)), 1e-9 * balance.scale)
    # numbers that are not finite must not count as a large deflection
    return float(np.abs(error).max() / size) if np.all(np.isfinite(y)) else np.inf


def far(balance: HarmonicBalance) -> float:
    """Choose the mean deflection [m] beyond which no element takes up more: a size that cannot run away."""
    return max(_FAR * balance.scale, _LENGTHS * balance.longest)


def _uncarried_note(balance: HarmonicBalance, lines, residual, converged: bool) -> str:
    """Which column's mean load nothing carries, or ""; ``residual()`` (n_columns, L) [m] is at the lines."""
    mean = np.abs(lines[:, 0])
    finite = bool(np.all(np.isfinite(lines)))
    away = not finite or mean.max() > max(far(balance), 10.0 * np.abs(lines[:, 1:]).max(initial=0.0))
    # converged lines are doubted only where their mean is far away and out of balance
    if converged and not away:
        return ""
    # first by the forces alone: so far away the residual is the rounding of two large numbers
    unreached = _beyond_reach(balance)
    if unreached is not None:
        column, wanted, low, high = unreached
        bound = f"no less than {low:.4g} N" if wanted < low else f"no more than {high:.4g} N"
        why = f"it needs {wanted:.4g} N, the elements there give {bound}"
    elif away and finite and np.abs(residual()[:, 0]).max() > _BALANCED * balance.scale:
        column = int(np.argmax(mean))
        why = f"its mean deflection runs away, {lines[column, 0].real:.3g} m"
    else:
        return ""
    return (
        f"nothing carries the mean load of column {column + 1}{_named(balance, column)}: {why}; turn the "
        "load round, give the contact a back side (backlash) or add a support"
    )


def _named(balance: HarmonicBalance, column: int) -> str:
    name = _element_name(balance.problem, column)
    return f" ({name})" if not name.startswith("column") else ""


def _beyond_reach(balance: HarmonicBalance) -> tuple[int, float, float, float] | None:
    """Column, mean force wanted of it, lowest and highest mean force that its elements have [N].

    None where some forces within the reach of all elements balance the load on the free motions: a linear
    programme that minimises what is left over. Of several columns the least forces are the wanted ones.
    """
    from scipy.optimize import linprog

    strain, load = _free_balance(balance)
    columns = np.flatnonzero(np.abs(strain).max(axis=0, initial=0.0) > _UNSTRAINED)
    if not len(columns) or not np.any(load):
        return None
    wanted = np.linalg.lstsq(strain[:, columns], load, rcond=None)[0]
    size = np.abs(wanted).max() or 1.0
    reach = np.array([_reach(balance, int(column)) for column in columns])
    rows, eye = strain[:, columns], np.eye(len(load))
    bounds = np.clip(reach / size, -_FAR, _FAR).tolist() + [(0.0, None)] * (2 * len(load))
    cost = np.concatenate([np.zeros(len(columns)), np.ones(2 * len(load))])
    left = linprog(cost, A_eq=np.hstack([rows, eye, -eye]), b_eq=load / size, bounds=bounds)
    if not left.success or left.fun <= _BEYOND * np.abs(load / size).max():
        return None
    worst = int(np.argmax(np.maximum(reach[:, 0] - wanted, wanted - reach[:, 1])))
    return int(columns[worst]), float(wanted[worst]), *reach[worst].tolist()


def _free_balance(balance: HarmonicBalance) -> tuple[np.ndarray, np.ndarray]:
    """Strain (r, n_columns) by motions that only elements hold, of unit size, and the load (r,) on them."""
    system, reference = balance.problem.system, balance.reduction.reference
    if len(system.M) > _MOST_DOFS:  # these motions are not looked for
        return np.zeros((0, len(reference))), np.zeros(0)
    square, shape = linalg.eigh(0.5 * (system.K + system.K.T), system.M)
    whole = np.diag(system.K) + np.einsum("ij,j,ij->i", system.W, reference, system.W)
    free = shape[:, np.abs(square) <= _FREE * np.abs(whole / np.diag(system.M)).max()]
    steady = sum(np.real(force.force) for force in balance.problem.forces if not any(force.orders))
    strain, load = free.T @ system.W, free.T @ (system.load + steady)
    size = np.abs(strain).max(axis=1, initial=0.0)
    # motions that strain no column carry no load either: the reduction has made sure
    held = size > _UNSTRAINED * size.max(initial=0.0)
    return strain[held] / size[held, None], load[held] / size[held]


def _reach(balance: HarmonicBalance, column: int) -> tuple[float, float]:
    """Lowest and highest mean force [N] of a column between far apart and far together."""
    values = []
    for sign in (-1.0, 1.0):
        lines = np.zeros((len(balance.reduction.reference), len(balance.orders)), complex)
        lines[column, 0] = sign * far(balance)
        beyond = balance.forces(lines)[0][column, 0].real
        values.append(float(beyond + balance.reduction.reference[column] * lines[column, 0].real))
    low, high = sorted(values)
    # what is left of two large numbers is their rounding
    rounding = 1e-12 * balance.reduction.reference[column] * far(balance)
    return (0.0 if abs(low) <= rounding else low), (0.0 if abs(high) <= rounding else high)


def _check_harmonics(problem: NonlinearSystem, harmonics: int) -> None:
    """Refuse fewer harmonics than the harmonic forces name."""
    for number, force in enumerate(problem.forces):
        wanted = int(np.abs(force.orders).sum())
        if wanted > harmonics >= 0:
            raise CaseError(
                f"{harmonics} harmonics, but harmonic force {number + 1} has orders {tuple(force.orders)}",
                code="E-HARMONICS",
                key="harmonics",
                value=harmonics,
                limit=f"{wanted} or more",
                remedy="raise the number of harmonics",
            )


def _longest(problem) -> float:
    """Largest finite length that an element names [m]; zero without one."""
    names = ("backlash", "clearance", "breaks", "smoothing")
    lengths = [np.ravel(getattr(e, name)) for e in problem.elements for name in names if hasattr(e, name)]
    sizes = np.abs(np.concatenate([*lengths, np.zeros(1)]))
    return float(sizes[np.isfinite(sizes)].max())
