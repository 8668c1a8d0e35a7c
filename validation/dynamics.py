"""Dynamic response of the reference set: time integration, truncation, stability."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.stability.parametric import stability
from femgear.system.fourier import sample
from femgear.system.system import MeshExcitation, Modes, mesh_harmonics
from validation.cases import reference_case, reference_modes, reference_static
from validation.rows import Row, at_most, counted, information, within

MESHES = (("sun-planet", 0), ("planet-ring", 3))
HARMONICS = 6
SHOOTING = "DOP853 over one period, periodic by linear shooting"


def _changed(**entries):
    """The reference case with dotted entries changed; ``__`` stands for the point."""
    from femgear.trains.reading import with_value

    case = reference_case()
    for key, value in entries.items():
        case = with_value(case, key.replace("__", "."), value)
    return case


def shooting(
    modes: Modes, excitation: MeshExcitation, mesh_frequency: float, *, harmonics: int, count: int = 128
) -> tuple[np.ndarray, np.ndarray]:
    """Periodic mesh deflections by time integration of the modal equations, and the Floquet multipliers.

    ``q'' + 2 zeta w q' + w^2 q = R^T load - R^T g``, ``g = F - k s + k~ d``, and for the modes left out
    ``d = R q + d_rest - T_res g``, solved for ``d`` at every instant.

    Parameters
    ----------
    modes, excitation, mesh_frequency
        As for `solve_spectral`, one speed.
    harmonics : int
        Mesh harmonics kept in stiffness, deflection and force.
    count : int
        Instants of one mesh period.

    Returns
    -------
    deflection : (n_meshes, count) array
        [m].
    multipliers : complex array
        Eigenvalues of the monodromy matrix, rigid modes left out.
    """
    from scipy.integrate import solve_ivp

    system = _ModalSystem.build(modes, excitation, mesh_frequency, harmonics)
    n, period = len(system.natural), 1.0 / mesh_frequency
    scale = np.concatenate([np.ones(n), system.natural])[:, None]
    start = np.hstack([np.diag(scale[:, 0]), np.zeros((2 * n, 1))])
    instants = period * np.arange(count + 1) / count
    path = solve_ivp(
        lambda t, y: system.rate(t, y.reshape(2 * n, -1)).ravel(),
        (0.0, period),
        start.ravel(),
        method="DOP853",
        t_eval=instants,
        rtol=1e-10,
        atol=1e-13,
    )
    path = path.y.reshape(2 * n, 2 * n + 1, -1)
    transition, particular = path[:, :-1, -1], path[:, -1, -1]
    initial = np.linalg.solve(np.diag(scale[:, 0]) - transition, particular)
    state = np.einsum("ijt,j->it", path[:, :-1], initial) + path[:, -1]
    deflection = [system.deflection(t, x)[0] for t, x in zip(instants[:-1], state[:n].T)]
    return np.array(deflection).T, np.linalg.eigvals(transition / scale.T)


@dataclass(frozen=True)
class _ModalSystem:
    """Modal equations of motion at one speed, the modes left out as static flexibility."""

    natural: np.ndarray
    damping: np.ndarray
    rows: np.ndarray
    residual: np.ndarray
    load: np.ndarray
    rest: np.ndarray
    signals: np.ndarray
    mean: np.ndarray
    speed: float

    @classmethod
    def build(cls, modes: Modes, excitation: MeshExcitation, mesh_frequency: float, harmonics: int):
        elastic = modes.frequency > 0
        natural = 2 * np.pi * modes.frequency[elastic]
        rows, load = modes.mesh_deflection[:, elastic], modes.modal_load[elastic]
        return cls(
            natural,
            2 * modes.damping_ratio[elastic] * natural,
            rows,
            modes.residual,
            load,
            modes.load_deflection - (rows / natural**2) @ load,
            np.stack(mesh_harmonics(excitation, harmonics)),
            modes.mesh_stiffness,
            2 * np.pi * mesh_frequency,
        )

    def deflection(self, t, q):
        """Deflections (n_meshes, ...) and forces beyond the mean stiffness, the last column forced."""
        wave = np.exp(1j * self.speed * t * np.arange(self.signals.shape[-1]))
        stiffness, still, force = (self.signals @ wave).real
        change, constant = stiffness - self.mean, force - stiffness * still
        d = self.rows @ q
        forced = d[:, -1] if d.ndim == 2 else d
        forced += self.rest - self.residual @ constant
        d = np.linalg.solve(np.eye(len(change)) + self.residual * change, d)
        g = change[:, None] * d if d.ndim == 2 else change * d
        (g[:, -1] if g.ndim == 2 else g)[...] += constant
        return d, g

    def rate(self, t, y):
        """Time derivative of columns of (q, q'); the last column carries the loads."""
        q, v = np.split(y, 2)
        a = -(self.natural**2)[:, None] * q - self.damping[:, None] * v
        a -= self.rows.T @ self.deflection(t, q)[1]
        a[:, -1] += self.load
        return np.concatenate([v, a])


def _solve(mesh_frequency, **options):
    basis = reference_modes()
    return solve_spectral(basis.modes, basis.excitation, mesh_frequency, excitation_harmonics=HARMONICS, **options)


def _resonance() -> float:
    """Mesh frequency [Hz] between 40 and 1600 Hz at which the planet-ring force fluctuates most."""
    frequency = np.linspace(40.0, 1600.0, 391)
    force = _solve(frequency, response_harmonics=2 * HARMONICS).force[:, 3, 1:]
    return float(frequency[np.argmax(np.sum(np.abs(force) ** 2, axis=1))])


def _compared(mesh_frequency: float, label: str) -> tuple[Row, ...]:
    basis = reference_modes()
    modes, excitation = basis.modes, basis.excitation
    reference, multipliers = shooting(modes, excitation, mesh_frequency, harmonics=HARMONICS)
    rows = []
    for lines in (2 * HARMONICS, 3 * HARMONICS):
        for method in ("fixed point", "direct"):
            solution = _solve(mesh_frequency, response_harmonics=lines, tolerance=1e-11, method=method)
            if not solution.converged[0]:
                continue
            ours = sample(solution.deflection[0], reference.shape[1])
            error = _distance(ours, reference)
            quantity = f"{label}, {method}, {lines} harmonics: largest difference over peak to peak"
            if lines == 3 * HARMONICS:
                rows.append(at_most("time", SHOOTING, quantity, 1e-4, error))
            else:
                note = "twice the excitation's harmonics; what is missing is the tail"
                rows.append(information("time", SHOOTING, quantity, None, error, note=note))
    verdict = stability(modes, excitation, mesh_frequency, excitation_harmonics=HARMONICS)
    largest = np.abs(multipliers).max()
    quantity = f"{label}: largest Floquet multiplier"
    rows.append(within("time", SHOOTING, quantity, largest, np.abs(verdict.multiplier[0]), 1e-3))
    return tuple(rows)


def time_integration() -> tuple[Row, ...]:
    """The periodic response at 3100 rpm against time integration."""
    return _compared(1116.0, "mesh frequency 1116 Hz")


def more_time_integration() -> tuple[Row, ...]:
    """The periodic response at 250 rpm and near a resonance against time integration."""
    peak = _resonance()
    return (
        *_compared(90.0, "mesh frequency 90 Hz"),
        *_compared(peak, f"mesh frequency {peak:g} Hz, where the planet-ring force fluctuates most"),
    )


def fixed_point() -> tuple[Row, ...]:
    """Fixed point and direct solution of the same equations, at the damping of the case and at 1 %."""
    basis = reference_modes()
    frequency = np.linspace(40.0, 1600.0, 79)
    options = {"response_harmonics": 3 * HARMONICS, "tolerance": 1e-11, "max_iterations": 400}
    rows = []
    for damping in (0.05, 0.01):
        modes = replace(basis.modes, damping_ratio=np.where(basis.modes.frequency > 0, damping, 0.0))
        direct = solve_spectral(modes, basis.excitation, frequency, method="direct", **options)
        fixed = solve_spectral(modes, basis.excitation, frequency, method="fixed point", **options)
        done, radius = fixed.converged, fixed.spectral_radius
        difference = np.abs(fixed.deflection - direct.deflection)[done].max(axis=(1, 2))
        error = (difference / np.abs(direct.deflection[done, :, 1:]).max(axis=(1, 2))).max()
        name = f"{len(frequency)} mesh frequencies, 40 to 1600 Hz, damping {damping:g}: "
        # one step shrinks the error by the radius, so 400 steps reach 1e-11 up to 0.938
        safe = radius < 0.93
        rows += [
            at_most("operator", "direct solution", name + "fixed point, relative difference", 1e-8, error),
            counted(
                "operator",
                "definition",
                name + "spectral radius below 0.93, and the fixed point converges",
                int(safe.sum()),
                int((done & safe).sum()),
            ),
            information(
                "operator",
                "definition",
                name + "radius of 1 or more (reference), and the fixed point fails (femgear)",
                int((radius >= 1).sum()),
                int((~done).sum()),
                note="the radius counts motions that identical planets in phase do not excite",
            ),
            information("operator", "definition", name + "largest spectral radius", None, radius.max()),
            at_most("operator", "definition", name + "residual, direct", 1e-10, direct.residual.max()),
        ]
    return tuple(rows)


def harmonics_kept() -> tuple[Row, ...]:
    """Harmonics of the response."""
    rows = []
    for frequency in (90.0, 1116.0):
        fine = _solve(frequency, response_harmonics=36)
        reference = sample(fine.deflection[0], 256)
        for lines in (12, 18, 24):
            ours = sample(_solve(frequency, response_harmonics=lines).deflection[0], 256)
            error = _distance(ours, reference)
            quantity = f"{frequency:g} Hz, {lines} harmonics: largest difference over peak to peak"
            rows.append(at_most("harmonics", "36 harmonics", quantity, 1e-3 if lines == 12 else 1e-4, error))
    return tuple(rows)


def modes_kept() -> tuple[Row, ...]:
    """Modes of ring and set, the static flexibility of the others kept or dropped."""
    from femgear.solvers.linear.modal import undamped_modes
    from femgear.trains.elastic.stages import solve_modes as pipeline_modes

    basis = reference_modes()
    fine = pipeline_modes(_changed(dynamics__response_harmonics=6 * HARMONICS), reference_static())
    top = 6 * HARMONICS * 1116.0
    rows = []
    for frequency in (90.0, 1116.0):
        reference = _periodic(fine.modes, fine.excitation, frequency)
        source = f"{len(fine.modes.frequency)} modes of set and ring below {2e-3 * top:.1f} kHz"
        for factor in (0.5, 1.0):
            modes = undamped_modes(
                basis.model.system,
                basis.modes.mesh_stiffness,
                damping_ratio=reference_case().dynamics.damping_ratio,
                max_frequency=factor * top,
            )
            bare = replace(modes, residual=np.zeros_like(modes.residual))
            errors = [_distance(_periodic(m, basis.excitation, frequency), reference) for m in (modes, bare)]
            name = f"{frequency:g} Hz, {len(modes.frequency)} modes below {1e-3 * factor * top:.1f} kHz"
            if factor == 1.0:
                words = name + ", those of the pipeline: largest difference over peak to peak"
                rows.append(at_most("modes", source, words, 2e-3, errors[0]))
            else:
                words = name + ": largest difference over peak to peak"
                rows.append(information("modes", source, words, None, errors[0]))
            words = name + ", residual flexibility dropped: the same"
            rows.append(information("modes", source, words, None, errors[1]))
    return tuple(rows)


def _periodic(modes, excitation, frequency):
    response = solve_spectral(modes, excitation, frequency, response_harmonics=3 * HARMONICS)
    return sample(response.deflection[0], 128)


def _distance(ours, reference) -> float:
    """Largest difference over the peak-to-peak value of each mesh."""
    return float((np.abs(ours - reference).max(axis=1) / np.ptp(reference, axis=1)).max())
