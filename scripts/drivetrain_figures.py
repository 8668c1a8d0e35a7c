"""The figures of scripts/drivetrain.py."""

from __future__ import annotations

import numpy as np

RPM = np.pi / 30.0
# Factors of the sensitivity study: contact ratios stay above one, angles and phases are shifted.
STEPS = {"contact": (0.85, 1.1), "other": (0.5, 2.0)}


def draw_all(folder, models, runs, *, modes, vary, progress) -> list[str]:
    """Write all figures; returns their names."""
    from femgear.plots import save_figure

    made = {
        "stiffness.png": stiffness_figure(models["with bending"]),
        "deviation.png": deviation_figure(runs),
        "forces.png": force_figure(runs),
    }
    made |= spectrum_figures(models, runs)
    progress("Campbell diagram")
    made["campbell.png"] = campbell_figure(models["with bending"])
    progress("Campbell diagram", 1.0)
    progress("contact loss")
    made["backlash.png"] = backlash_figure(models["with bending"])
    progress("contact loss", 1.0)
    if vary:
        made["sensitivity.png"] = sensitivity_figure(progress)
    for name, figure in made.items():
        save_figure(figure, folder / name)
    return [*made, *mode_pictures(folder, models["with bending"], modes)]


def stiffness_figure(model):
    from femgear.models.drivetrain_meshes import gibbs_overshoot, stiffness_levels
    from femgear.plots.drivetrain import stiffness_series
    from femgear.solvers.series import FourierSeries

    train, harmonics = model.train, model.stiffness.shape[1] - 1
    waves = [("sun-planet 1", train.planetary[0].sun_mesh, 0)]
    waves += [
        (stage.name, stage.mesh, len(model.meshes) - len(train.parallel) + i)
        for i, stage in enumerate(train.parallel)
    ]
    phase = np.linspace(0.0, 2.0, 1601)
    curves, steps = [], []
    for text, wave, row in waves:
        curves.append((text, FourierSeries(model.stiffness[row]).at(2.0 * np.pi * phase[:, None])[:, 0]))
        low, high, share = stiffness_levels(wave)
        inside = (phase + wave.phase + 0.5 * share) % 1.0 < share
        steps.append((text, np.where(inside, high, low)))
    over = gibbs_overshoot(waves[0][1], harmonics)
    title = f"mesh stiffness, {harmonics} terms; overshoot {100 * over:.1f} % of the jump"
    return stiffness_series(phase, curves, steps, title=title)


def deviation_figure(runs):
    from femgear.plots.drivetrain import over_time

    some = next(iter(runs.values()))
    shown = slice(None, None, max(1, len(some.time) // 6000))
    bodies = ("carrier", "sun", "gear 2", "generator")
    panels = [
        (f"{body}: rotation less the free spin", [
            (text, run.motion[shown, run.outputs.index(f"{body}: rotation")]) for text, run in runs.items()
        ])
        for body in bodies
    ]  # fmt: skip
    return over_time(some.time[shown], panels, unit="deviation [mrad]", factor=1e3)


def force_figure(runs):
    from femgear.plots.drivetrain import over_time

    some = next(iter(runs.values()))
    shown = slice(None, None, max(1, len(some.time) // 30000))
    panels = [
        (mesh, [(text, run.force[shown, run.meshes.index(mesh)]) for text, run in reversed(runs.items())])
        for mesh in chosen_meshes(some)
    ]
    return over_time(some.time[shown], panels, unit="force [kN]", factor=1e-3)


def chosen_meshes(run):
    return ("sun-planet 1", "planet 1-ring of carrier", "gear 1-gear 2", "gear 2-gear 3")


def spectrum_figures(models, runs):
    """Spectra over frequency of the last part, side bands over orders of the carrier."""
    from femgear.models.drivetrain_spectra import averaged_spectrum, order_spectrum
    from femgear.plots.drivetrain import spectra

    some = next(iter(runs.values()))
    model, step = models["with bending"], some.step
    late = some.time > 0.3 * some.time[-1]
    speed = float(some.spin_speed[late].mean())
    bases = model.frequencies(speed) / (2.0 * np.pi)
    lines = [
        ("f_p", bases[1]),
        ("2 f_p", 2 * bases[1]),
        ("3 f_p", 3 * bases[1]),
        ("f_12", bases[2]),
        ("f_23", bases[3]),
    ]
    resolution = max(0.1, 4.0 / (some.time[-1] - some.time[0]))
    found = {t: averaged_spectrum(r.force[late], step, resolution=resolution) for t, r in runs.items()}
    low = found["torsional"].frequency <= 300.0
    meshes = chosen_meshes(some)
    panels = [
        (mesh, [(t, s.amplitude[some.meshes.index(mesh)][low]) for t, s in found.items()]) for mesh in meshes
    ]
    figures = {
        "spectrum.png": spectra(
            found["torsional"].frequency[low], panels, lines=lines, unit="force [kN]", factor=1e-3
        )
    }
    # one segment: as fine as the record allows
    turns = 0.99 * np.ptp(some.spin[late]) / (2.0 * np.pi)
    tracked = {
        t: order_spectrum(
            r.force[late],
            r.spin[late],
            resolution=1.0 / turns,
            per_turn=round(0.8 * 2 * np.pi / (step * speed)),
        )
        for t, r in runs.items()
    }
    order = tracked["torsional"].frequency
    for name, mesh, base in (
        ("side_bands_planetary.png", meshes[0], 1),
        ("side_bands_gear_1.png", meshes[2], 2),
    ):
        centre = model.base_ratio[base]
        width = 8.0 if base == 1 else 1.3 * model.base_ratio[1]
        near = np.abs(order - centre) <= width
        shift = model.base_ratio[0] if base == 1 else model.base_ratio[1]
        text = "" if base == 1 else "f_p"
        marks = [
            (f"{k:+d} {text or 'turn'}" if k else "mesh", centre + k * shift)
            for k in range(-3, 4)
            if abs(k * shift) <= width
        ]
        curves = [(t, s.amplitude[some.meshes.index(mesh)][near]) for t, s in tracked.items()]
        figures[name] = spectra(
            order[near],
            [(mesh, curves)],
            lines=marks,
            unit="force [kN]",
            factor=1e-3,
            x="order of the carrier [1]",
        )
    return figures


def campbell_figure(model):
    from dataclasses import replace

    from femgear.plots.frequency import campbell
    from femgear.solvers.campbell import campbell_data

    system = replace(model.system, C=np.zeros_like(model.system.C), load=np.zeros(len(model.rigid)))
    speeds = np.linspace(0.0, 20.0 * RPM, 21)
    orders = [model.base_ratio[1], 2 * model.base_ratio[1], *model.base_ratio[2:]]
    found = campbell_data(lambda _: system, speeds, model.mean_stiffness, orders=orders, count=22)
    below = [(c.speed / RPM, c.frequency) for c in found.critical if c.frequency < 310.0]
    return campbell(
        found.speed / RPM, found.frequency, orders=np.array(orders) / 60.0,
        order_names=["f_p", "2 f_p", "f_12", "f_23"], critical=below, speed_unit="rpm of the rotor",
    )  # fmt: skip


def backlash_figure(model, *, span: float = 0.4, step: float = 1e-4):
    """The start under suddenly set torques: meshes that pull, and meshes that part and cross the backlash."""
    from femgear.models.drivetrain import drivetrain_problem
    from femgear.models.wind_turbine_drivetrain import PRINTED, paper_torques
    from femgear.plots.drivetrain import backlash_forces
    from femgear.solvers.transient import solve_transient

    times = np.arange(0.0, span, step)
    curves = []
    for text, separates in (("linear meshes", False), ("with backlash of 0.2 mm", True)):
        problem = drivetrain_problem(
            model, torques=paper_torques(balanced=True), separates=separates, speed=PRINTED.speed
        )
        zero = np.zeros(len(model.rigid))
        run = solve_transient(problem, model.frequencies(PRINTED.speed), times, start=(zero, zero), step=step)
        curves.append((text, mesh_forces(model, problem, run, PRINTED.speed)[:, -2]))
    late = times > 0.72 * span
    curves = [(text, force[late]) for text, force in curves]
    return backlash_forces(
        times[late], curves, title="gear 1-gear 2 after torques and weight set in suddenly"
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


def mode_pictures(folder, model, count) -> list[str]:
    """Elastic modes: the first ones that bend and twist, drawn in space."""
    if not count:
        return []
    from femgear.models.drivetrain_layout import drivetrain_layout, layout_motion
    from femgear.scene.drivetrain import drivetrain_picture
    from femgear.solvers.modal import solve_modes

    layout = drivetrain_layout(model.train)
    modes = solve_modes(model.still, model.mean_stiffness)
    wheels = [(w.centre, w.radius, w.width, w.body) for w in layout.wheels]
    elastic = np.flatnonzero(modes.frequency > 1e-3)[:count]
    names = []
    for number, mode in enumerate(elastic, 1):
        move, turn = layout_motion(model, layout, modes.shape[:, mode])
        name = f"mode_{number}.png"
        drivetrain_picture(
            folder / name, wheels=wheels, centres=layout.centre, shafts=layout.shafts, move=move, turn=turn,
            names=layout.names, title=f"mode {number}: {modes.frequency[mode]:.2f} Hz",
        )  # fmt: skip
        names.append(name)
    return names
