"""The figures of scripts/drivetrain.py that a run does not draw: contact loss and sensitivity."""

from __future__ import annotations

import numpy as np

from femgear.findings import percent

# Factors of the sensitivity study: contact ratios stay above one, angles and phases are shifted.
STEPS = {"contact": (0.85, 1.1), "other": (0.5, 2.0)}
# Steps a second of the sensitivity study [Hz].
RATE = 20e3


def with_balance(case):
    """The case with the share of a torque that balances all others; as it is where it has no share."""
    from femgear.trains.reading import with_value

    for i, torque in enumerate(case.transient.torque):
        if torque.share is not None:
            return with_value(case, f"transient.torque[{i}].share", 1.0)
    return case


def backlash_figure(case, *, steps: int = 100_000):
    """The mesh that parts most at the start, around its first separation, and the same mesh made linear.

    Parameters
    ----------
    case : GearboxCase
    steps : int
        Of the start that is searched, which ends where spectra begin.

    Returns
    -------
    Figure or None
        None where no mesh parts.
    str
        What was found.
    """
    from femgear.trains.gearbox.transient_figures import over_time

    parted, linear = separating_start(case, steps=steps)
    run, model = parted.run, parted.model
    if not run.lost.any():
        return None, f"no teeth part in the first {run.time[-1]:.4g} s: no picture of contact loss"
    mesh = int(np.argmax(run.lost))
    stage = next(stage for stage in model.stages if run.meshes[mesh] in stage.meshes)
    shown, first = first_separation(run, mesh, 2.0 * np.pi / model.box.frequency[stage.mesh_base])
    gap, time = 1e3 * stage.excitation.backlash[stage.meshes.index(run.meshes[mesh])], run.time[shown]
    text = f"backlash of {gap:g} mm" if gap else "no back flank"
    curves = [(f"teeth that part, {text}", run.force[shown, mesh])]
    if linear is not None:
        curves.append(("linear mesh, which pulls", linear.run.force[shown, mesh]))
    words = (
        f"{run.meshes[mesh]} parts first at {run.time[first]:.4g} s; apart for "
        f"{percent(run.lost[mesh], 2)} of the first {run.time[-1]:.4g} s"
    )
    return over_time(time, [(words, curves)], unit="mesh force [kN]", factor=1e-3), words


def separating_start(case, *, steps: int):
    """The start of a case, every step recorded, with meshes that part and with linear ones.

    The second is None where the linear motion outgrows the numbers.
    """
    from femgear.errors import ConvergenceError

    s = case.transient
    duration = min(max(s.settled, 10.0 / s.rate), s.duration, steps / s.rate)
    parted = started(case, duration, contact_loss=True)
    try:
        return parted, started(case, duration, contact_loss=False)
    except ConvergenceError:
        return parted, None


def started(case, duration: float, *, contact_loss: bool):
    """Motion of a case over a duration [s], every step recorded."""
    from femgear.trains.gearbox.deflection import solve_deflection
    from femgear.trains.gearbox.transient import gearbox_in_time, integrate

    transient = case.transient.model_copy(update={"duration": duration, "contact_loss": contact_loss})
    case = case.model_copy(update={"transient": transient})
    return integrate(gearbox_in_time(solve_deflection(case), transient), lowpass=False)


def first_separation(run, mesh: int, period: float) -> tuple[slice, int]:
    """Steps around the first instant at which a mesh that was loaded is apart, and that instant.

    Two mesh periods before and six after it.
    """
    force = run.force[:, mesh]
    loaded = int(np.argmax(force != 0.0))
    first = loaded + int(np.argmax(force[loaded:] == 0.0))
    low, high = np.searchsorted(run.time, run.time[first] + period * np.array([-2.0, 6.0]))
    return slice(low, high + 1), first


def sensitivity_figure(progress):
    """Lines of the mesh forces with every assumed number lower and higher."""
    from published.wind_turbine_drivetrain import ASSUMED, assumption_names, varied

    names = [n for n in assumption_names() if "teeth" not in n and np.all(np.asarray(getattr(ASSUMED, n)) != 0.0)]
    names = [n for n in names if n != "backlash" and not n.startswith("direction")]
    base, ratios = line_amplitudes(ASSUMED), []
    for number, name in enumerate(names):
        progress("sensitivity", number, len(names))
        factors = STEPS["contact" if "contact" in name else "other"]
        ratios.append([line_amplitudes(varied(name, f)) / base for f in factors])
    progress("sensitivity", len(names), len(names))
    table = np.array(ratios).transpose(2, 0, 1)
    texts = ("f_p in sun-planet 1", "f_p − turn, sun-planet 1", "f_12 in gear 1-2", "f_23 in gear 2-3")
    title = "mesh force lines at half and twice each assumed input (contact ratios: 0.85 and 1.1 times)"
    return input_ratios([n.replace("_", " ") for n in names], list(zip(texts, table)), title=title)


def input_ratios(names, quantities, *, title: str = ""):
    """What assumed inputs do: quantity at half and at twice the input over that at the input itself.

    Parameters
    ----------
    names : (k,) sequence
    quantities : sequence of (text, ratio (k, 2))

    Returns
    -------
    Figure
    """
    from femgear.report.style import BLACK, COLOURS, SIZE, label, legend_below, new_figure

    count = len(names)
    columns = min(len(quantities), 2)
    rows = -(-len(quantities) // columns)
    width, height = 3.4 * columns + 2.4, (0.3 * count + 0.8) * rows + 1.0
    figure, axes = new_figure(rows=rows, columns=columns, width=width, height=height, sharey=True)
    at = np.arange(count)[::-1]
    for ax, (text, ratio) in zip(axes, quantities):
        ratio = np.asarray(ratio, float)
        for side, (colour, note) in enumerate(((COLOURS[0], "lower input"), (COLOURS[1], "higher input"))):
            ax.barh(at + 0.18 - 0.36 * side, ratio[:, side] - 1.0, height=0.34, left=1.0, color=colour, label=note)
        ax.axvline(1.0, color=BLACK, linewidth=0.8)
        ax.set_yticks(at, names)
        label(ax, "ratio [1]", title=text)
    if title:
        figure.suptitle(title, fontsize=SIZE)
    legend_below(figure)
    return figure


def line_amplitudes(assumed) -> np.ndarray:
    """Amplitudes [N] of four lines of the mesh forces at constant speed, 20 s behind 10 s of settling."""
    from published.wind_turbine_drivetrain import wind_turbine_drivetrain

    from femgear.trains.reading import read_case

    tables = wind_turbine_drivetrain(assumed)
    tables["operation"]["torque"][1]["share"] = 1.0
    tables["simulation"] |= {"duration": "30 s", "rate": f"{RATE} Hz", "start": "static", "torsional": False}
    motion = started(read_case(tables), 30.0, contact_loss=False)
    run, model = motion.run, motion.model
    kept = run.time >= 10.0
    times, force = run.time[kept], run.force[kept]
    window = np.hanning(len(times))
    omega = dict(zip(model.box.bases, model.box.frequency, strict=True))
    mesh, turn = omega["carrier-sun mesh"], omega["carrier-sun carrier"]

    def line(name, frequency):
        column = run.meshes.index(name)
        return 2.0 * abs((window * np.exp(-1j * frequency * times)) @ force[:, column]) / window.sum()

    sun, pairs = "carrier-sun sun-planet 1", ("gear 1-gear 2", "gear 2-gear 3")
    lines = [(sun, mesh), (sun, mesh - turn), *((name, omega[f"{name} mesh"]) for name in pairs)]
    return np.array([line(*entry) for entry in lines])
