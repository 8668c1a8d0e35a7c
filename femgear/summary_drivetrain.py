"""Tables of drivetrains: the chain of a case, and the numbers of a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain_rates import (
    GOOD_STEPS,
    frequency_shift,
    highest_mesh,
    mesh_mode,
    shift_rate,
)
from femgear.models.drivetrain_record import PASS_BAND
from femgear.datasets import RPM
from femgear.summary_block import Block
from femgear.summary_transient import GROWN, growth_rates, largest_gains, separating, shown_factor

if TYPE_CHECKING:
    import xarray as xr

    from femgear.casefile.drivetrain import DrivetrainCase
    from femgear.models.drivetrain import DrivetrainModel
    from femgear.models.drivetrain_rates import SpeedRange

_SHOWN = 16
# A speed that changes by more is worth a remark.
_CHANGE = 2.0
# Share by which steps may lower the frequency of a mode that the meshes drive, and a small one.
_SHIFT, _SMALL_SHIFT = 1e-2, 1e-3


def describe_drivetrain(case: DrivetrainCase) -> tuple[Block, ...]:
    """Bodies, shafts, gear stages, operation and warnings of a drivetrain case.

    Raises
    ------
    CaseError
        As `femgear.models.drivetrain_case.check_drivetrain`.
    """
    from femgear.models.drivetrain_case import check_drivetrain

    model = check_drivetrain(case)
    return (
        Block(case.title),
        _bodies(case, model),
        _shafts(model),
        _stages(case, model),
        _operation(case, model),
        Block("Warnings", notes=drivetrain_warnings(case, model) or ("none",)),
    )


def drivetrain_warnings(case: DrivetrainCase, model: DrivetrainModel | None = None) -> tuple[str, ...]:
    """What is allowed but deserves a look, in sentences; the model is made where it is not given.

    Raises
    ------
    CaseError
        As `femgear.models.drivetrain_case.check_drivetrain`, without a model.
    """
    from femgear.models.drivetrain_case import case_speeds, check_drivetrain

    model = model or check_drivetrain(case)
    speeds = case_speeds(case, model)
    warned = (
        _runaway(case, speeds),
        _rates(case, model, speeds),
        _spectra(case, model),
        _undamped(case),
    )
    return (*case.notices, *(text for some in warned for text in some))


def _undamped(case: DrivetrainCase) -> Iterator[str]:
    """Runs in which nothing takes energy out of vibration."""
    if case.simulation.damping_ratio == 0.0:
        yield (
            "[W-DAMPING] simulation.damping_ratio: 0, no damping at all: vibration of the start never dies "
            "away, resonances grow until something else stops them, and teeth seem to part that would not; "
            "gear trains are commonly computed with 0.02 to 0.05"
        )


def _runaway(case: DrivetrainCase, speeds: SpeedRange) -> Iterator[str]:
    """Torques that change the speed more than a run is meant for."""
    first = speeds.first
    if speeds.highest <= _CHANGE * first and speeds.lowest >= first / _CHANGE:
        return
    rpm = [f"{value / RPM:.6g}" for value in (first, speeds.last, speeds.lowest, speeds.highest)]
    between = (
        "" if speeds.last in (speeds.lowest, speeds.highest) else f" ({rpm[2]} to {rpm[3]} rpm on the way)"
    )
    turns = " and turn it back" if speeds.lowest < 0.0 else ""
    yield (
        f"[W-SPEED] operation.torque: the torques take {case.body[0].name} from {rpm[0]} to {rpm[1]} rpm in "
        f"{case.simulation.duration:g} s{between}{turns}; share = 1.0 on another body balances them"
    )


def _rates(case: DrivetrainCase, model: DrivetrainModel, speeds: SpeedRange) -> Iterator[str]:
    """Steps and records that are too slow for the highest mesh frequency, at the fastest speed."""
    from femgear.models.drivetrain_case import record_rate

    name, top = highest_mesh(model, speeds.fastest)
    rate, record = case.simulation.rate, record_rate(case, model)
    where = f"{top:.4g} Hz"
    if speeds.fastest > 1.01 * speeds.first:
        where += f" at {speeds.fastest / RPM:.6g} rpm, the fastest"
    if rate < GOOD_STEPS * top:
        yield (
            f"[W-RATE] simulation.rate: {rate / top:.3g} steps a period of the {name} ({where}) shift and "
            f"damp it; take {GOOD_STEPS} or more, {GOOD_STEPS * top:.4g} Hz"
        )
    # modes above the last line of the mesh stiffness answer as springs
    mode = mesh_mode(model, top * case.simulation.harmonics)
    if (shift := frequency_shift(mode, rate)) > _SHIFT:
        yield (
            f"[W-RATE] simulation.rate: steps of {rate:g} Hz lower the mode of {mode:.4g} Hz, which the "
            f"meshes drive, by {shift:.2%}; {_up(shift_rate(mode, _SHIFT))} Hz lowers it by {_SHIFT:.0%}, "
            f"{_up(shift_rate(mode, _SMALL_SHIFT))} Hz by {_SMALL_SHIFT:.1%}"
        )
    if 0.5 * PASS_BAND * record < top:
        yield (
            f"[W-RECORD] simulation.record: records of {record:g} Hz end at {0.5 * PASS_BAND * record:g} Hz, "
            f"below the {name} ({where})"
        )


def _up(value: float) -> str:
    """Three digits, rounded up."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{math.ceil(value / unit) * unit:.12g}"


def _spectra(case: DrivetrainCase, model: DrivetrainModel) -> Iterator[str]:
    """Runs that stop before the spectra, which would be refused."""
    from femgear.models.drivetrain_case import check_spectrum

    if not len(model.meshes):
        return
    try:
        check_spectrum(case, model)
    except CaseError as error:
        yield f"[W-SPECTRUM] {error.key}: {error.message}: the stage spectrum refuses this ({error.code})"


def _bodies(case: DrivetrainCase, model: DrivetrainModel) -> Block:
    rows = []
    for body in model.train.bodies:
        held = [one for one in model.train.bearings if one.body == body.name]
        rows.append(
            (
                body.name,
                f"{body.inertia:.6g}",
                f"{body.mass:.6g}",
                f"{body.transverse_inertia:.6g}" if body.tilts else "-",
                _spring(sum(one.radial for one in held), 3) if held else "-",
                f"{model.ratio[body.name]:.6g}",
                f"{model.ratio[body.name] * case.operation.speed / RPM:.4f}",
            )
        )
    header = (
        "", "inertia [kg m^2]", "mass [kg]", "about a diameter", "bearings [N/m]", "ratio", "speed [rpm]",
    )  # fmt: skip
    notes = (
        f"{len(model.rigid)} degrees of freedom, {len(model.meshes)} meshes; inertia of the chain about the "
        f"axis of {model.train.bodies[0].name} {model.inertia:.6g} kg m^2",
    )
    return Block("Bodies", header, tuple(rows), notes)


def _shafts(model: DrivetrainModel) -> Block:
    rows = []
    for one in model.train.shafts:
        s = one.springs
        kind = f"beam, {one.elements} elements" if one.elements else "joint"
        values = (_spring(value, 4) for value in (s.bending, s.torsion, s.shear))
        rows.append((f"{one.first} - {one.second}", f"{one.length:.4g}", *values, kind))
    header = ("", "length [m]", "bending [N m/rad]", "torsion [N m/rad]", "shear [N/m]", "model")
    return Block("Shafts", header, tuple(rows))


def _spring(stiffness: float, digits: int) -> str:
    return "rigid" if math.isinf(stiffness) else f"{stiffness:.{digits}g}"


def _stages(case: DrivetrainCase, model: DrivetrainModel) -> Block:
    train, hertz = model.train, model.frequencies(case.operation.speed) / (2.0 * np.pi)
    rows = []
    for i, (one, given) in enumerate(zip(train.planetary, case.planetary)):
        teeth = f"{given.sun_teeth} / {given.ring_teeth}, {len(one.planet_angles)} planets"
        radii = f"{1e3 * one.sun_radius:.4f}, {1e3 * one.planet_radius:.4f}, {1e3 * one.ring_radius:.4f}"
        contact = f"{one.sun_mesh.contact_ratio:.4g}, {one.ring_mesh.contact_ratio:.4g}"
        stiffness = f"{one.sun_mesh.stiffness:.4g}, {one.ring_mesh.stiffness:.4g}"
        ratio = model.ratio[one.sun] / model.ratio[one.carrier]
        driver, line = one.driver or one.ends[0], f"{hertz[2 * i + 1]:.4f}"
        rows.append((one.name, driver, teeth, radii, f"{ratio:.5g}", contact, stiffness, line))
    for i, (one, given) in enumerate(zip(train.parallel, case.parallel)):
        radii = f"{1e3 * one.first_radius:.4f}, {1e3 * one.second_radius:.4f}"
        ratio = model.ratio[one.second] / model.ratio[one.first]
        line = hertz[2 * len(train.planetary) + i]
        rows.append(
            (
                one.name, one.driver or one.ends[0], f"{given.teeth[0]} / {given.teeth[1]}", radii,
                f"{ratio:.5g}",
                f"{one.mesh.contact_ratio:.4g}", f"{one.mesh.stiffness:.4g}", f"{line:.4f}",
            )
        )  # fmt: skip
    header = (
        "stage", "driver", "teeth", "pitch radii [mm]", "ratio", "contact ratio", "stiffness [N/m]",
        "mesh [Hz]",
    )  # fmt: skip
    return Block("Gear stages", header, tuple(rows))


def _operation(case: DrivetrainCase, model: DrivetrainModel) -> Block:
    from femgear.models.drivetrain_case import case_speeds, record_rate, torque_histories

    rows, drive = [], 0.0
    for one in torque_histories(case, model.ratio):
        low, high = one.values.min(), one.values.max()
        text = f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}, {len(one.times)} points"
        rows.append((one.body, text))
        drive += float(one.values[0]) * model.ratio[one.body]
    s = case.simulation
    contact = "meshes part" if s.contact_loss else "meshes keep contact"
    change, last = drive / model.inertia / RPM, case_speeds(case, model).last / RPM
    notes = (
        f"first body {case.operation.speed / RPM:.6g} rpm at the start, where the torques change it by "
        f"{round(change, 6) + 0.0:.4g} rpm a second; {last:.6g} rpm at the end",
        f"{s.duration:g} s at {s.rate:g} steps a second, {record_rate(case, model):g} records a second; "
        f"{contact}",
        _damping(s.damping_ratio),
    )
    return Block("Operation", ("torque on", "[N m]"), tuple(rows), notes)


def _damping(ratio: float) -> str:
    return f"damping {100.0 * ratio:g} % of critical in all modes" if ratio else "no damping"


def describe_drivetrain_modes(data: xr.Dataset) -> Block:
    """Table of modes.nc of a drivetrain."""
    shown = min(data.sizes["mode"], _SHOWN)
    energy, members = data["energy"].values, [str(name) for name in data["member"].values]
    rows = []
    for i in range(shown):
        most = np.argsort(-energy[:, i])[:2]
        where = ", ".join(f"{members[m]} {energy[m, i]:.0%}" for m in most)
        share = f"{float(data['rotation_share'][i]):.1%}"
        hertz = f"{float(data['frequency'][i]):.3f}"
        rows.append((str(i + 1), hertz, str(data["kind"].values[i]), share, where))
    top = float(data["frequency"].max())
    notes = [f"{data.sizes['mode']} modes up to {top:.0f} Hz, the first {shown} shown"]
    lines = zip(data["base"].values, data["mesh_frequency"].values)
    if data.sizes["base"]:
        notes.append("mesh lines: " + ", ".join(f"{name} {float(value):.3f} Hz" for name, value in lines))
    header = ("mode", "frequency [Hz]", "kind", "rotation", "kinetic energy in")
    return Block("Modes", header, tuple(rows), tuple(notes))


def describe_transient(data: xr.Dataset) -> Block:
    """Table of transient.nc: mesh forces, those of all steps beside the recorded ones, speeds, balances."""
    rows, recorded = [], data["mesh_force"].values
    mean, low, high = (getattr(recorded, name)(axis=1) for name in ("mean", "min", "max"))
    least, largest, pulling = (data[name].values for name in ("least_force", "largest_force", "pulling"))
    parts, thinned = separating(data), int(data.attrs["every"]) > 1
    for v, variant in enumerate(data["variant"].values):
        for m, mesh in enumerate(data["mesh"].values):
            shown = (mean, least, largest, *((low, high) if thinned else ()))
            forces = [f"{1e-3 * values[v, m]:.4f}" for values in shown]
            shares = [f"{100.0 * pulling[v, m]:.2f}"]
            if parts:
                shares.insert(0, f"{100.0 * float(data['lost'][v, m]):.2f}")
            rows.append((str(variant), str(mesh), *forces, *shares))
    shares = ("no contact [% of time]", "back flank [% of time]") if parts else ("pulling [% of time]",)
    records = ("least recorded [kN]", "largest recorded [kN]") if thinned else ()
    header = ("model", "mesh", "mean [kN]", "least [kN]", "largest [kN]", *records, *shares)
    speed, body = data["speed"].values[0], str(data["body"].values[0])
    notes = [
        f"{data.attrs['steps']} steps, at any of which least and largest force may be; {body} from "
        f"{speed[0, 0] / RPM:.4f} to {speed[-1, 0] / RPM:.4f} rpm",
        *_recorded(data, thinned),
        *([_damping(float(data.attrs["damping_ratio"]))] if "damping_ratio" in data.attrs else []),
        f"energy balance {float(data['energy_error'].max()):.1e}, angular momentum "
        f"{float(data['momentum_error'].max()):.1e}",
        *_growth_notes(data),
    ]
    if pulling.any() and not parts:
        notes.append("these meshes are linear and keep contact: where they pull, real teeth part")
    return Block("Transient", header, tuple(rows), tuple(notes))


def _recorded(data: xr.Dataset, thinned: bool) -> Iterator[str]:
    if thinned:
        top = 0.5 * PASS_BAND / (float(data.attrs["step"]) * int(data.attrs["every"]))
        yield (
            f"recorded: what is left of them in files and pictures, every {data.attrs['every']}th step "
            f"behind a low pass that ends at {top:.4g} Hz"
        )


def _growth_notes(data: xr.Dataset) -> Iterator[str]:
    for variant, rate in growth_rates(data):
        if not math.isfinite(rate):
            continue
        if separating(data):
            words = "move apart: the motion is chaotic or unstable" if rate > 0.0 else "draw together"
            yield f"{variant}: neighbouring motions {words} (Lyapunov exponent {rate:.4g} 1/s)"
        else:
            way = "grows" if rate > 0.0 else "decays"
            text = f"{variant}: the free motion {way} with {abs(rate):.4g} 1/s in the mean"
            gain = largest_gains(data).get(variant, math.nan)
            yield f"{text}, at most {shown_factor(math.log10(gain))} times" if gain > GROWN else text


def describe_spectrum(data: xr.Dataset) -> Block:
    """Table of spectrum.nc: amplitudes of the named lines, of one mesh of every kind."""
    from femgear.plots.drivetrain_results import chosen_meshes, symbols

    meshes, amplitude = chosen_meshes(data), data["line_amplitude"].values
    names, variants = symbols(data), [str(name) for name in data["variant"].values]
    rows = []
    for i, orders in enumerate(data["line_orders"].values):
        mark = "" if bool(data["resolved"][i]) else " *"
        cells = (" / ".join(_newtons(value) for value in amplitude[:, i, m]) for m in meshes)
        rows.append((_combination(orders, names) + mark, f"{float(data['line_frequency'][i]):.3f}", *cells))
    header = ("line", "[Hz]", *(f"{data['mesh'].values[m]} [N]" for m in meshes))
    notes = [
        ", ".join(f"{names[b]}: {name}" for b, name in enumerate(data["base"].values)),
        f"amplitudes of the mesh forces after {float(data.attrs['settle']):g} s, peak values; frequencies at "
        "the mean speed",
    ]
    if len(variants) > 1:
        notes.append(f"in every cell: {' / '.join(variants)}")
    if not data["resolved"].values.all():
        notes.append("*: the record is too short to part this line from a neighbour")
    return Block("Spectrum", header, tuple(rows), tuple(notes))


def _newtons(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}" if value >= 0.1 else "< 0.1"


def _combination(orders, names) -> str:
    """A line as the sum of base frequencies, the largest first: ``f1 - 2 t``."""
    terms = ""
    for base in sorted(
        np.flatnonzero(orders), key=lambda base: (orders[base] < 0, names[base][0] == "t", -base)
    ):
        count, name = int(orders[base]), names[base]
        size = name if abs(count) == 1 else f"{abs(count)} {name}"
        terms += f" {'-' if count < 0 else '+'} {size}" if terms else size
    return terms
