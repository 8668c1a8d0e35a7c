"""The figures of scripts/drivetrain.py that a run does not draw: contact loss and sensitivity."""

from __future__ import annotations

import numpy as np

# Factors of the sensitivity study: contact ratios stay above one, angles and phases are shifted.
STEPS = {"contact": (0.85, 1.1), "other": (0.5, 2.0)}
# Steps a second of the sensitivity study [Hz].
RATE = 20e3


def with_balance(case):
    """The case with the share of a torque that balances all others; as it is where it has no share."""
    from femgear.trains.reading import with_value

    for i, one in enumerate(case.operation.torque):
        if one.share is not None:
            return with_value(case, f"operation.torque[{i}].share", 1.0)
    return case


def backlash_figure(case, model, *, steps: int = 100_000):
    """The mesh that parts most at the start, around its first separation, and the same mesh made linear.

    Parameters
    ----------
    case : DrivetrainCase
    model : DrivetrainModel
        Of the case.
    steps : int
        Of the start that is searched, which ends where spectra begin.

    Returns
    -------
    Figure or None
        None where no mesh parts.
    str
        What was found.
    """
    from femgear.trains.drivetrain.figures import over_time

    parted, linear = separating_start(case, model, steps=steps)
    if not parted.lost.any():
        return None, f"no teeth part in the first {parted.time[-1]:.4g} s: no picture of contact loss"
    mesh = int(np.argmax(parted.lost))
    shown, first = first_separation(parted, mesh, mesh_period(case, model, mesh))
    gap, time = 1e3 * model.backlash[mesh], parted.time[shown]
    text = f"backlash of {gap:g} mm" if np.isfinite(gap) else "no back flank"
    curves = [(f"teeth that part, {text}", parted.force[shown, mesh])]
    if linear is not None:
        curves.append(("linear mesh, which pulls", linear.force[shown, mesh]))
    found = (
        f"{model.meshes[mesh]} parts first at {parted.time[first]:.4g} s; apart for "
        f"{parted.lost[mesh]:.2%} of the first {parted.time[-1]:.4g} s"
    )
    return over_time(time, [(found, curves)], unit="mesh force [kN]", factor=1e-3), found


def separating_start(case, model, *, steps: int):
    """The start of a case, every step recorded, with meshes that part and with linear ones.

    The second is None where the linear motion outgrows the numbers.
    """
    from femgear.errors import ConvergenceError
    from femgear.trains.drivetrain.case_file import settle_time, torque_histories
    from femgear.trains.drivetrain.simulation import march_drivetrain

    s, torques = case.simulation, torque_histories(case, model.ratio)
    duration = min(max(settle_time(case), 10.0 / s.rate), s.duration, steps / s.rate)
    options = {
        "duration": duration,
        "step": 1.0 / s.rate,
        "speed": case.operation.speed,
        "start": s.start,
        "outputs": (),
    }
    parted = march_drivetrain(model, torques, contact_loss=True, **options)
    try:
        return parted, march_drivetrain(model, torques, contact_loss=False, **options)
    except ConvergenceError:
        return parted, None


def mesh_period(case, model, mesh: int) -> float:
    """[s] at the speed of the operation."""
    return 2.0 * np.pi / model.frequencies(case.operation.speed)[model.mesh_base[mesh]]


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
    from published.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain

    from femgear.trains.drivetrain.model import drivetrain_model
    from femgear.trains.drivetrain.parts import constant_torques
    from femgear.trains.drivetrain.simulation import march_drivetrain

    model = drivetrain_model(wind_turbine_drivetrain(assumed))
    torques = constant_torques(paper_torques(balanced=True))
    run = march_drivetrain(model, torques, duration=30.0, step=1.0 / RATE, speed=PRINTED.speed, outputs=())
    kept = run.time >= 10.0
    times, force = run.time[kept], run.force[kept]
    f = model.frequencies(PRINTED.speed)
    window = np.hanning(len(times))

    def line(mesh, omega):
        return 2.0 * abs((window * np.exp(-1j * omega * times)) @ force[:, mesh]) / window.sum()

    return np.array([line(0, f[1]), line(0, f[1] - f[0]), line(-2, f[2]), line(-1, f[3])])
