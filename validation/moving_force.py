"""A ring under mesh forces that travel around it: one motion by full, modal and condensed integration.

The ring is that of the reference set without its teeth (root circle to outer surface, plane stress, on its
foundation), with all its finite elements. One mesh force a planet travels on the root circle with the
carrier, a mean and harmonics of the mesh frequency; each is spread as ``cos^(2p)`` of half the angle from
its planet, which holds the nodal diameters up to p and no others. The motion from rest has a closed form in
every mode, which is the reference for all routes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np

from femgear.fe.elasticity import Material, foundation, mass, stiffness
from femgear.gears.kinematics import speeds
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.time.transient import solve_transient
from femgear.stages.protocol import one_blas_thread
from femgear.system.system import HarmonicForce, MechanicalSystem, Modes, NonlinearSystem, external_force
from validation.mapped import mapped_grid, ring_mapping
from validation.planetary import reference_set
from validation.reference.force_history import solve_force_history
from validation.reference.plane_elasticity import edge_load
from validation.rows import Row, at_most, information, within

ELEMENTS = 36  # around the ring, one across it
DIAMETERS = 15  # p
HARMONICS = (1.0, 0.4, 0.25, 0.15, 0.1, 0.06)  # of the mesh frequency, from zero on, over the mean
FORCE = 100.0 / 3.0 / 19.03e-3  # N, of one mesh at 100 N m
SUN_SPEED = 3100.0 * 2.0 * np.pi / 60.0
DAMPING = 0.02
FOUNDATION = 1e10  # N/m^3, radial and tangential
PERIODS = 12  # mesh periods from rest
STEEL = Material(206e9, 0.3, 7850.0)


@dataclass(frozen=True)
class MovingForce:
    """The ring, its load and the exact motion.

    Parameters
    ----------
    problem : NonlinearSystem
        With all harmonics of the load; one column, the radial displacement at one place of the outer surface.
    damped : NonlinearSystem
        The same with the damping matrix of the modal damping ratio.
    carrier : float
        Speed of the carrier [rad/s], the base frequency of the load.
    mesh_period : float
        [s]
    modes : Modes
        All of them.
    """

    problem: NonlinearSystem
    damped: NonlinearSystem
    carrier: float
    mesh_period: float
    modes: Modes

    def times(self, steps: int) -> np.ndarray:
        """Instants with so many steps a mesh period [s]."""
        return np.arange(PERIODS * steps + 1) * (self.mesh_period / steps)

    def force(self, times) -> np.ndarray:
        """Force history (n_times, n) [N]."""
        return external_force(self.problem, times[:, None] * self.carrier)

    def exact(self, times) -> np.ndarray:
        """Displacements (n_times, n) from rest: sum over modes and harmonics in closed form.

        ``y'' + 2 zeta w y' + w^2 y = Re P e^(i W t)``: ``Re Y e^(i W t)`` with
        ``Y = P / (w^2 - W^2 + 2 i zeta w W)``, and a free motion that starts from its negative (A. K. Chopra,
        Dynamics of Structures, section 3.2).
        """
        natural, ratio = 2.0 * np.pi * self.modes.frequency[:, None], self.modes.damping_ratio[:, None]
        driven = self.carrier * np.array([f.orders[0] for f in self.problem.forces])
        push = self.modes.shape.T @ np.array([f.force for f in self.problem.forces]).T
        lines = push / (natural**2 - driven**2 + 2j * ratio * natural * driven)
        settled = (lines @ np.exp(1j * np.outer(driven, times))).real
        turn = natural * np.sqrt(1.0 - ratio**2)
        begin, rate = -lines.sum(axis=1).real[:, None], -(1j * driven * lines).sum(axis=1).real[:, None]
        other = (rate + ratio * natural * begin) / turn
        free = np.exp(-ratio * natural * times)
        free = free * (begin * np.cos(turn * times) + other * np.sin(turn * times))
        return (self.modes.shape @ (settled + free)).T


@cache
@one_blas_thread()
def moving_force() -> MovingForce:
    """The ring of the reference set under three mesh forces."""
    gears = reference_set()
    inner, outer, width = gears.ring.root_radius, gears.ring.rim_radius, gears.ring.face_width
    grid = mapped_grid(ring_mapping(inner, outer), 1, ELEMENTS, closed=True)
    K = stiffness(grid, STEEL, state="plane stress", thickness=width)
    K = (K + foundation(grid, "u=1", FOUNDATION, FOUNDATION, thickness=width)).toarray()
    M, n = mass(grid, STEEL, width).toarray(), 2 * grid.n_nodes
    sensor = np.zeros((n, 1))
    sensor[2 * np.argmax(grid.points[:, 0])] = 1.0
    system = MechanicalSystem(M, np.zeros((n, n)), K, sensor, np.zeros(n), ())
    modes = undamped_modes(system, np.zeros(1), damping_ratio=DAMPING)
    turning = speeds(gears, input="sun", fixed="ring", speed=SUN_SPEED)
    forces = _travelling_forces(grid, gears)
    C = modal_damping(system, np.zeros(1), DAMPING)
    damped = MechanicalSystem(M, C, K, sensor, np.zeros(n), ())
    return MovingForce(
        NonlinearSystem(system, (), forces),
        NonlinearSystem(damped, (), forces),
        turning.carrier,
        1.0 / turning.mesh_frequency,
        modes,
    )


def _travelling_forces(grid, gears) -> tuple[HarmonicForce, ...]:
    """Lines of the load at orders of the carrier.

    Planet j at the angle psi carries ``F sum_h a_h cos(h z (Omega t + psi))``, spread as
    ``sum_m c_m e^(i m (phi - psi - Omega t))``; summed over the planets it has the orders ``h z - m``.
    """
    p, angle = DIAMETERS, gears.working_pressure_angle_planet_ring
    spread = np.array([comb(2 * p, p + m) for m in range(-p, p + 1)]) / comb(2 * p, p)
    spread = spread / (2.0 * np.pi * gears.ring.root_radius * gears.ring.face_width)
    shapes = [_pattern(grid, m, angle, gears.ring.face_width) for m in range(-p, p + 1)]
    lines: dict[int, np.ndarray] = {}
    for h, share in enumerate(HARMONICS):
        for m, c, shape in zip(range(-p, p + 1), spread, shapes, strict=True):
            order = h * gears.ring.teeth - m
            together = np.exp(1j * order * np.asarray(gears.planet_angles)).sum()
            line = FORCE * share * c * together * shape
            if abs(together) < 1e-9:
                continue
            # a line at a negative order is the conjugate one at the positive order
            order, line = (order, line) if order >= 0 else (-order, line.conj())
            lines[order] = lines.get(order, 0.0) + line
    return tuple(HarmonicForce(force, (order,)) for order, force in sorted(lines.items()))


def _pattern(grid, m: int, angle: float, width: float) -> np.ndarray:
    """Consistent nodal forces (n,) of the unit traction ``e^(i m phi)`` on the root circle.

    It pushes outwards with the sine and around with the cosine of the pressure angle.
    """

    def traction(part):
        def value(x, normal):
            phi = np.arctan2(x[..., 1], x[..., 0])
            c, s = np.cos(phi), np.sin(phi)
            direction = np.stack([np.sin(angle) * c - np.cos(angle) * s, np.sin(angle) * s + np.cos(angle) * c])
            return np.moveaxis(part(np.exp(1j * m * phi)) * direction, 0, -1)

        return value

    real, imaginary = (edge_load(grid, "u=0", traction(part), thickness=width) for part in (np.real, np.imag))
    return real + 1j * imaginary


@dataclass(frozen=True)
class Run:
    """A route at a number of steps a mesh period, and its error against the exact motion.

    ``error`` is the root mean square of the difference over that of the motion less its mean, over all
    degrees of freedom and the end of every 16th of a mesh period.
    """

    name: str
    steps: int
    unknowns: int
    error: float


@one_blas_thread()
def run(route: str, steps: int, **options) -> Run:
    """One route: step rules march all degrees of freedom, the others are those of `solve_force_history`."""
    case = moving_force()
    times = case.times(steps)
    if route in ("average acceleration", "generalised alpha"):
        motion = solve_transient(case.damped, case.carrier, times, method=route, step=times[1], **options)
        unknowns = len(case.damped.system.M)
    else:
        motion = solve_force_history(
            case.problem.system,
            times,
            case.force(times),
            route=route,
            damping_ratio=DAMPING,
            mesh_stiffness=np.zeros(1),
            **options,
        )
        unknowns = motion.unknowns
    return Run(route, steps, unknowns, _error(case, times, steps, motion.displacement))


def _error(case: MovingForce, times, steps, displacement) -> float:
    seen = slice(None, None, steps // 16)
    exact = case.exact(times[seen])
    moving = exact - exact.mean(axis=0)
    return float(np.linalg.norm(displacement[seen] - exact) / np.linalg.norm(moving))


NAMES = {
    "modal": "Duhamel, {} modes",
    "average acceleration": "Newmark, average acceleration, {} degrees of freedom",
    "generalised alpha": "generalised alpha, {} degrees of freedom",
    "guyan": "Guyan, {} masters, exact steps",
    "full": "exact steps of all {} degrees of freedom",
}
# route, steps a mesh period, options; their errors are the result of the comparison, so that no gate is set
TABLE = (
    ("full", 64, {}),
    ("modal", 64, {}),
    ("modal", 256, {}),
    ("modal", 64, {"count": 20}),
    ("modal", 256, {"count": 20}),
    ("average acceleration", 64, {}),
    ("average acceleration", 128, {}),
    ("average acceleration", 256, {}),
    ("generalised alpha", 128, {}),
    ("guyan", 64, {"count": 72}),
    ("guyan", 256, {"count": 72}),
    ("guyan", 64, {"count": 144}),
)


def table() -> tuple[Row, ...]:
    """Errors of all routes, and the orders that theory gives them."""
    runs = {(route, steps, *more.values()): run(route, steps, **more) for route, steps, more in TABLE}
    source, rows = "closed form in every mode", []
    for motion in runs.values():
        name = f"{NAMES[motion.name].format(motion.unknowns)}, {motion.steps} steps a mesh period: error"
        rows.append(information("moving", source, name, None, motion.error))
    newmark = [runs["average acceleration", steps].error for steps in (64, 128, 256)]
    duhamel = [runs["modal", steps].error for steps in (64, 256)]
    same = abs(runs["full", 64].error - runs["modal", 64].error)
    second = "second order in the step"
    return (
        *rows,
        within(
            "moving",
            second,
            "Newmark: error of 64 over that of 128 steps",
            4.0,
            newmark[0] / newmark[1],
            0.05,
        ),
        within(
            "moving",
            second,
            "Newmark: error of 128 over that of 256 steps",
            4.0,
            newmark[1] / newmark[2],
            0.05,
        ),
        within(
            "moving",
            second,
            "Duhamel: error of 64 over that of 256 steps",
            16.0,
            duhamel[0] / duhamel[1],
            0.05,
        ),
        at_most(
            "moving",
            "same steps",
            "all modes against all degrees of freedom: difference of errors",
            1e-8,
            same,
        ),
    )
