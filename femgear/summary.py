"""What an engineer wants to read first: the gears of a case, and the numbers of a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.case_shafts import shaft_lines
from femgear.casefile.drivetrain import DrivetrainCase
from femgear.gears import check_set, speeds, tooth_thickness, torques
from femgear.gears.checks import tip_clearances
from femgear.gears.deviation_checks import check_deviations
from femgear.gears.motion import MEMBERS
from femgear.models.ring import MAX_DIAMETER
from femgear.summary_block import Block
from femgear.summary_drivetrain import (
    describe_drivetrain,
    describe_drivetrain_modes,
    describe_spectrum,
    describe_transient,
)
from femgear.summary_helical import describe_helical, describe_helical_static
from femgear.summary_phasing import describe_phasing
from femgear.summary_planar import describe_branch, describe_planar, describe_response
from femgear.summary_stress import describe_stress

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case import Case
    from femgear.gears import PlanetarySet
    from femgear.storage import Results

RPM = math.pi / 30
_MANY = 8
# Angle between the ends of a coupling that is worth a warning [rad].
MOST_WINDING = 1.0


def describe(case: Case | DrivetrainCase) -> tuple[Block, ...]:
    """Blocks of any kind of case: its title first, its warnings last."""
    if isinstance(case, DrivetrainCase):
        return describe_drivetrain(case)
    from femgear.case import planetary_set

    return describe_case(case, planetary_set(case))


def describe_case(case: Case, planetary: PlanetarySet) -> tuple[Block, ...]:
    """Geometry, operation and warnings of a case.

    Parameters
    ----------
    case : Case
    planetary : PlanetarySet
        As `femgear.case.planetary_set` makes it.

    Returns
    -------
    tuple of Block
    """
    planar = () if case.planar is None else (describe_planar(case, planetary),)
    helical = () if case.helical is None else describe_helical(case, planetary)
    return (
        Block(case.title),
        _gears(planetary),
        _meshes(planetary),
        *describe_phasing(planetary),
        _operation(case, planetary),
        *planar,
        *helical,
        Block("Warnings", notes=warnings_of(case, planetary) or ("none",)),
    )


def warnings_of(case: Case, planetary: PlanetarySet) -> tuple[str, ...]:
    """What is allowed but deserves a look, in sentences."""
    found = [str(warning) for warning in check_set(planetary)] + list(case.notices)
    from femgear.case import set_deviations

    found += [str(warning) for warning in check_deviations(set_deviations(case), planetary)]
    if case.operation.torque == 0:
        found.append(
            "[W-TORQUE] operation.torque: without torque no tooth touches; only static results exist"
        )
    if case.operation.torque < 0:
        found.append("[W-TORQUE] operation.torque: a negative torque loads the other flanks")
    elastic = case.planar is None and case.helical is None
    if elastic and case.dynamics.damping_ratio == 0.0 and case.operation.fixed == "ring":
        found.append(
            "[W-DAMPING] dynamics.damping_ratio: without damping resonances have no limit, and levels depend "
            "on how near a line lies to one; 0.02 to 0.05 is usual"
        )
    if elastic:
        found += _wound_up(case, planetary)
    if elastic and case.planet.bearing_clearance and case.operation.fixed == "ring":
        found.append(
            "[W-BEARING] planet.bearing_clearance: the dynamics have linear planet bearings; the clearance "
            'acts in the static results alone, with static.members = "elastic"'
        )
    if elastic and case.housing.form == "linear" and case.housing.points <= 2 * MAX_DIAMETER:
        found.append(
            f"[W-POINTS] housing.points: {case.housing.points} points do not resolve the ring's "
            f"{MAX_DIAMETER} nodal diameters; use more than {2 * MAX_DIAMETER}"
        )
    return tuple(found)


def _wound_up(case: Case, planetary: PlanetarySet) -> Iterator[str]:
    """Couplings that the torque turns further than any stands: a slip of units, as a rule."""
    acting = torques(planetary, member=case.operation.input, torque=case.operation.torque)
    output = next(name for name in MEMBERS if name not in (case.operation.input, case.operation.fixed))
    for name, member in (("motor", case.operation.input), ("brake", output)):
        section = getattr(case, name)
        angle = 0.0 if section is None else abs(getattr(acting, member)) / section.coupling_stiffness
        if angle > MOST_WINDING:
            yield (
                f"[W-COUPLING] {name}.coupling_stiffness: {section.coupling_stiffness:.4g} N m/rad lets the "
                f"torque turn the coupling by {math.degrees(angle):.4g} deg; couplings stand a few degrees, "
                "elastic ones twenty"
            )


def _gears(s: PlanetarySet) -> Block:
    gears = (s.sun, s.planet, s.ring)

    def row(name, value):
        return (name, *(value(gear) for gear in gears))

    rows = (
        row("teeth", lambda g: str(g.teeth)),
        row("profile shift", lambda g: f"{g.profile_shift:.5f}"),
        row("reference diameter [mm]", lambda g: f"{2e3 * g.reference_radius:.4f}"),
        row("tip diameter [mm]", lambda g: f"{2e3 * g.tip_radius:.4f}"),
        row("root diameter [mm]", lambda g: f"{2e3 * g.root_radius:.4f}"),
        row("start of involute, diameter [mm]", lambda g: f"{2e3 * g.form_radius:.4f}"),
        row(
            "tooth thickness at the tip [mm]",
            lambda g: f"{1e3 * float(tooth_thickness(g, g.tip_radius)):.4f}",
        ),
        row("bore or outer diameter [mm]", lambda g: f"{2e3 * g.rim_radius:.4f}"),
    )
    angles = ", ".join(f"{math.degrees(angle):.6g}" for angle in s.planet_angles[:12])
    notes = (
        f"module {s.sun.module * 1e3:.6g} mm, pressure angle {math.degrees(s.sun.pressure_angle):.6g} deg, "
        f"face width {s.sun.face_width * 1e3:.6g} mm, centre distance {s.centre_distance * 1e3:.6g} mm",
        f"{s.n_planets} planets at {angles} deg",
        "profile shift of the ring: positive moves the flank outwards (the opposite of ISO 21771)",
    )
    return Block("Gears", ("", "sun", "planet", "ring"), rows, notes)


def _meshes(s: PlanetarySet) -> Block:
    n = s.n_planets
    phases = s.mesh_phases

    def listing(values):
        text = ", ".join(f"{value:.4f}" for value in values[:6])
        return text + (", ..." if len(values) > 6 else "")

    clearance = {name: f"{1e3 * value:.3f}" for name, value in tip_clearances(s).items()}
    rows = (
        (
            "working pressure angle [deg]",
            f"{math.degrees(s.working_pressure_angle_sun_planet):.4f}",
            f"{math.degrees(s.working_pressure_angle_planet_ring):.4f}",
        ),
        ("contact ratio", f"{s.contact_ratio_sun_planet:.4f}", f"{s.contact_ratio_planet_ring:.4f}"),
        (
            "normal backlash [um]",
            f"{round(s.backlash_sun_planet * 1e6, 2) + 0.0:.2f}",
            f"{round(s.backlash_planet_ring * 1e6, 2) + 0.0:.2f}",
        ),
        (
            "tip clearances [mm]",
            f"{clearance['sun tip to planet root']}, {clearance['planet tip to sun root']}",
            f"{clearance['planet tip to ring root']}, {clearance['ring tip to planet root']}",
        ),
        ("mesh phases [periods]", listing(phases[:n]), listing(phases[n:])),
    )
    return Block("Meshes", ("", "sun-planet", "planet-ring"), rows)


def _operation(case: Case, s: PlanetarySet) -> Block:
    operation = case.operation
    chosen = operation.speeds
    if len(chosen) > _MANY:
        chosen = (*chosen[: _MANY // 2], *chosen[-_MANY // 2 :])
    rows = []
    for speed in chosen:
        v = speeds(s, input=operation.input, fixed=operation.fixed, speed=speed)
        turns = (f"{value / RPM:.4f}" for value in (v.sun, v.carrier, v.ring, v.planet))
        rows.append((*turns, f"{v.mesh_frequency:.4f}"))
    load = torques(s, member=operation.input, torque=operation.torque)
    notes = [
        f"input {operation.input}, fixed {operation.fixed}; torque on sun {load.sun:.6g} N m, "
        f"carrier {load.carrier:.6g} N m, ring {load.ring:.6g} N m"
    ]
    if len(operation.speeds) > _MANY:
        notes.append(f"{len(operation.speeds)} speeds, of which the first and the last are shown")
    notes += shaft_lines(case)
    header = ("sun [rpm]", "carrier [rpm]", "ring [rpm]", "planet [rpm]", "mesh frequency [Hz]")
    return Block("Operation", header, tuple(rows), tuple(notes))


def describe_results(results: Results) -> tuple[Block, ...]:
    """The numbers of a run, one block a stage.

    Parameters
    ----------
    results : Results

    Returns
    -------
    tuple of Block
    """
    describe = {
        "static": _static,
        "stress": describe_stress,
        "modes": _modes,
        "dynamics": _dynamics,
        "housing": _housing,
        "branch": describe_branch,
        "response": describe_response,
        "transient": describe_transient,
        "spectrum": describe_spectrum,
    }
    if isinstance(results.case, DrivetrainCase):
        describe["modes"] = describe_drivetrain_modes
    elif results.case.helical is not None:
        modes = results.modes if "modes" in results.stages else None
        describe["static"] = lambda data: describe_helical_static(data, modes)
    blocks = [describe[stage](getattr(results, stage)) for stage in results.stages]
    timings = ((stage, f"{seconds:.2f}") for stage, seconds in results.manifest.timings.items())
    return (*blocks, Block("Time", ("stage", "[s]"), tuple(timings)))


def _static(data: xr.Dataset) -> Block:
    rows = []
    for mesh in data.mesh.values:
        one = data.sel(mesh=mesh)
        ste = one.ste.values
        rows.append(
            (
                str(mesh),
                f"{ste.mean() * 1e6:.4f}",
                f"{np.ptp(ste) * 1e6:.4f}",
                f"{one.mesh_stiffness.values.mean() / 1e6:.3f}",
                f"{np.ptp(one.mesh_stiffness.values) / 1e6:.3f}",
                f"{one.mesh_force.values.mean():.3f}",
                f"{one.max_pressure.values.max() / 1e6:.1f}" if one.max_pressure.values.any() else "-",
            )
        )
    share = data.load_share.values
    header = (
        "mesh",
        "STE mean [um]",
        "STE p-p [um]",
        "k mean [N/um]",
        "k p-p [N/um]",
        "force [N]",
        "p max [MPa]",
    )
    notes = [
        f"load share of a planet {share.min():.4f} to {share.max():.4f} "
        f"(equal sharing {1 / data.sizes['planet']:.4f}); contact: {data.attrs.get('contact', 'unknown')}",
    ]
    notes += _stiffness_notes(elastic=data.sizes.get("member", 0) > 0)
    if data.attrs.get("mesh_periods", 1) > 1:
        notes.append(str(data.attrs["period"]))
    if warnings := str(data.attrs.get("warnings", "")):
        notes += [f"[{text.strip()}" for text in warnings.split("[") if text]
    return Block("Static", header, tuple(rows), tuple(notes))


def _stiffness_notes(*, elastic: bool) -> list[str]:
    """What the columns k and STE of the static table contain."""
    held = "k: tangent stiffness dF/dx of teeth and bodies"
    if not elastic:
        return [f"{held}, held at their bores and at the outer surface of the ring"]
    return [
        f"{held}; of planet-ring with the ring on its foundation in series, so that it is no",
        "stiffness of the teeth alone; the STE contains that and the motion of the members",
    ]


def _modes(data: xr.Dataset) -> Block:
    shown = min(data.sizes["mode"], 16)
    rows = tuple(
        (
            str(i + 1),
            f"{float(data.frequency[i]):.2f}",
            str(data.kind.values[i]),
            _diameter(int(data.nodal_diameter[i])),
        )
        for i in range(shown)
    )
    notes = (
        f"{data.sizes['mode']} modes up to {float(data.frequency.max()):.0f} Hz, the first {shown} shown",
    )
    return Block("Modes", ("mode", "frequency [Hz]", "kind", "nodal diameters"), rows, notes)


def _diameter(number: int) -> str:
    return "-" if number < 0 else str(number)


def _dynamics(data: xr.Dataset) -> Block:
    dte = np.hypot(data.dte_real.values, data.dte_imag.values)  # speed, mesh, harmonic
    rms = np.sqrt(0.5 * (dte[:, :, 1:] ** 2).sum(axis=2)).max(axis=1)
    largest = np.abs(data.floquet_multiplier.values)
    stable = data.stable.values.astype(bool) if "stable" in data else largest < 1.0
    # helical cases are excited by a number of harmonics
    reach = [()] * data.sizes["speed"]
    if "excitation_limit" in data:
        reach = [(f"{value / 1e3:.2f}",) for value in data.excitation_limit.values]
    rows = tuple(
        (
            f"{float(data.speed[i]):.2f}",
            f"{float(data.mesh_frequency[i]):.2f}",
            *reach[i],
            f"{rms[i] * 1e6:.4f}",
            str(data.method.values[i]),
            str(int(data.iterations[i])),
            f"{float(data.spectral_radius[i]):.4f}",
            f"{largest[i]:.4f}",
            "yes" if bool(data.converged[i]) else "NO",
        )
        for i in _chosen(data.sizes["speed"])
    )
    header = (
        "speed [rpm]",
        "mesh [Hz]",
        *(("excited up to [kHz]",) if reach[0] else ()),
        "DTE rms [um]",
        "method",
        "iterations",
        "radius",
        "Floquet",
        "converged",
    )
    notes = (
        "DTE rms: the largest of all meshes, without its mean; iterations, radius: of the fixed point,",
        "which contracts below 1; Floquet: largest multiplier, stable up to 1 (exactly 1 without damping)",
        f"{int(data.converged.sum())} of {len(stable)} speeds converged, {int(stable.sum())} stable",
    )
    if "level_change" in data:
        change = np.abs(data.level_change.values)
        notes += (
            f"level of the housing with excitation up to {data.attrs['compared_to'] / 1e3:.4g} kHz: "
            f"{np.nanmax(change):.2g} dB away at most, at {int(np.isfinite(change).sum())} speeds looked at",
        )
    return Block("Dynamics", header, rows, notes)


def _housing(data: xr.Dataset) -> Block:
    rows = []
    for i in _chosen(data.sizes["speed"]):
        one = data.isel(speed=i)
        amplitude = one.order_amplitude.values
        largest = np.argsort(-amplitude, kind="stable")[:5]
        lines = ", ".join(f"{round(float(one.order[j]))} ({amplitude[j]:.3g})" for j in largest)
        limit = f"{float(one.excitation_limit) / 1e3:.2f}"
        rows.append((f"{float(one.speed):.2f}", limit, f"{float(one.level):.4g}", lines))
    header = (
        "speed [rpm]",
        "excited up to [kHz]",
        "rms [m/s^2]",
        "largest lines: carrier order (amplitude [m/s^2])",
    )
    form = data.attrs["form"]
    note = f"form of the signal: {form}" + (f", {data.attrs['points']} points" if form == "linear" else "")
    return Block("Housing", header, tuple(rows), (note,))


def _chosen(count: int) -> Iterator[int]:
    """All indices of a short list, the first and last of a long one."""
    return (i for i in range(count) if count <= _MANY or i < _MANY // 2 or i >= count - _MANY // 2)
