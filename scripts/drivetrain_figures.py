"""The figures of scripts/drivetrain.py that a run does not draw: contact loss and sensitivity."""

from __future__ import annotations

import numpy as np

# Factors of the sensitivity study: contact ratios stay above one, angles and phases are shifted.
STEPS = {"contact": (0.85, 1.1), "other": (0.5, 2.0)}
# A torque that drives the spin, relative to the largest.
_UNBALANCED = 1e-6


def with_balance(case):
    """The case with the share of a torque that balances all others; as it is where it has no share."""
    from femgear.case import with_value

    for i, one in enumerate(case.operation.torque):
        if one.share is not None:
            return with_value(case, f"operation.torque[{i}].share", 1.0)
    return case


def backlash_figure(case, model, *, span: float = 0.4, step: float = 1e-4):
    """The start under suddenly set torques: meshes that pull, and meshes that part and cross the backlash.

    None where no mesh of the last stage has a backlash, or the torques do not balance.
    """
    from femgear.models.drivetrain import drivetrain_problem
    from femgear.models.drivetrain_case import torque_histories
    from femgear.plots.drivetrain import backlash_forces
    from femgear.solvers.transient import solve_transient

    torques = {one.body: float(one.values[0]) for one in torque_histories(case, model.ratio)}
    drive = [torque * model.ratio[body] for body, torque in torques.items()]
    mesh = len(model.meshes) - max(1, len(model.train.parallel))
    unbalanced = abs(sum(drive)) > _UNBALANCED * max(map(abs, drive), default=1.0)
    if mesh < 0 or not np.isfinite(model.backlash[mesh]) or unbalanced:
        return None
    speed, times, curves = case.operation.speed, np.arange(0.0, span, step), []
    for text, separates in (
        ("linear meshes", False), (f"with backlash of {1e3 * model.backlash[mesh]:g} mm", True),
    ):  # fmt: skip
        problem = drivetrain_problem(model, torques=torques, separates=separates, speed=speed)
        zero = np.zeros(len(model.rigid))
        run = solve_transient(problem, model.frequencies(speed), times, start=(zero, zero), step=step)
        curves.append((text, mesh_forces(model, problem, run, speed)[:, mesh]))
    late = times > 0.72 * span
    curves = [(text, force[late]) for text, force in curves]
    return backlash_forces(
        times[late], curves, title=f"{model.meshes[mesh]} after torques and weight set in suddenly"
    )


def mesh_forces(model, problem, run, speed):
    """Mesh forces (n, n_meshes) of a run of `drivetrain_problem`."""
    from femgear.models.drivetrain_meshes import mesh_force

    theta = run.time[:, None] * model.frequencies(speed)
    forces = []
    for element in problem.elements:
        phi = (theta @ np.array(element.turn, float))[:, None, None]
        S = element.fixed + np.cos(phi) * element.even + np.sin(phi) * element.odd
        approach = (S * run.deflection[:, element.columns]).sum(axis=-1)
        k = element.stiffness.at(theta)
        forces.append(mesh_force(approach, k, element.backlash, separates=element.separates)[0])
    return np.hstack(forces)


def sensitivity_figure(progress):
    """Settled motion with every assumed number lower and higher."""
    from femgear.models.wind_turbine_drivetrain import ASSUMED, assumption_names, varied
    from femgear.plots.drivetrain import sensitivity

    names = [
        n for n in assumption_names() if "teeth" not in n and np.all(np.asarray(getattr(ASSUMED, n)) != 0.0)
    ]
    names = [n for n in names if n != "backlash" and not n.startswith("direction")]
    base, ratios = settled_quantities(ASSUMED), []
    for number, name in enumerate(names):
        progress("sensitivity", number, len(names))
        factors = STEPS["contact" if "contact" in name else "other"]
        ratios.append([settled_quantities(varied(name, f)) / base for f in factors])
    progress("sensitivity", len(names), len(names))
    table = np.array(ratios).transpose(2, 0, 1)
    texts = ("f_p in sun-planet 1", "f_p ± turn, sun-planet 1", "f_12 in gear 1-2", "f_23 in gear 2-3")
    title = "mesh force lines at half and twice each assumed input (contact ratios: 0.85 and 1.1 times)"
    return sensitivity([n.replace("_", " ") for n in names], list(zip(texts, table)), title=title)


def settled_quantities(assumed) -> np.ndarray:
    """Amplitudes [N] of four lines of the settled mesh forces."""
    from femgear.models.drivetrain import drivetrain_model
    from femgear.models.drivetrain_balance import drivetrain_lines, settled_motion
    from femgear.models.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain

    model = drivetrain_model(wind_turbine_drivetrain(assumed))
    orders = drivetrain_lines(model, harmonics=10, bands=2, mixed=1)
    found = settled_motion(model, paper_torques(balanced=True), speed=PRINTED.speed, orders=orders)
    times = np.arange(0.0, 20.0, 1e-3)
    force = found.at(times)[1]
    f = model.frequencies(PRINTED.speed)
    window = np.hanning(len(times))

    def line(mesh, omega):
        return 2.0 * abs((window * np.exp(-1j * omega * times)) @ force[:, mesh]) / window.sum()

    beside = max(line(0, f[1] + f[0]), line(0, f[1] - f[0]))
    return np.array([line(0, f[1]), beside, line(-2, f[2]), line(-1, f[3])])
