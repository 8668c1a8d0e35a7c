"""Datasets in the form of a run's results, made from closed forms: realistic sizes, exact symmetries."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import xarray as xr

N, SUN, PLANET, RING, MODULE = 3, 27, 40, 108, 1.5e-3
FACE_WIDTH, CENTRE_DISTANCE, OUTER = 0.025, 0.051, 0.1
ANGLES = 2 * np.pi * np.arange(N) / N
MESHES = [f"sun-planet {n + 1}" for n in range(N)] + [f"planet {n + 1}-ring" for n in range(N)]
SPEEDS = np.array([250.0, 3100.0])
HARMONICS, DIAMETERS = 12, 12
CARRIER_FREQUENCY = SPEEDS / 60 * SUN / (SUN + RING)


def planetary_set():
    """What the pictures need to know of the gears."""

    def gear(teeth, rim, sign):
        reference = MODULE * teeth / 2
        return SimpleNamespace(
            teeth=teeth,
            reference_radius=reference,
            tip_radius=reference + sign * MODULE,
            root_radius=reference - sign * 1.25 * MODULE,
            rim_radius=rim,
        )

    return SimpleNamespace(
        sun=gear(SUN, 0.009, 1),
        planet=gear(PLANET, 0.018, 1),
        ring=gear(RING, OUTER, -1),
        centre_distance=CENTRE_DISTANCE,
        planet_angles=ANGLES,
    )


def _variable(dims, values, units, long_name):
    return (dims, np.asarray(values), {"units": units, "long_name": long_name})


def _circumferential():
    return _variable("circumferential", np.arange(-DIAMETERS, DIAMETERS + 1), "1", "signed nodal diameter")


def static(*, defect: float = 0.0) -> xr.Dataset:
    """STE, stiffness and sharing of identical planets; `defect` makes the last planet differ."""
    position = np.arange(64) / 64
    force, ratio = 100 / 3 / 0.01903, {"sun": 1.5507, "ring": 1.9301}
    pair = [_pair_loads(position, ratio["sun" if j < N else "ring"], force) for j in range(2 * N)]
    engaged = np.array([(p > 0).sum(axis=0) for p in pair])
    stiffness = 2.6e8 * engaged * (1 + 0.05 * np.cos(2 * np.pi * position))
    stiffness[N - 1] *= 1 - defect
    ste = force / (0.93 * stiffness) + 2.2e-6
    share = np.full((N, 64), 1 / N)
    share[-1] -= defect * 0.1 * (1 + 0.2 * np.sin(2 * np.pi * position))
    share[:-1] += (1 / N - share[-1]) / (N - 1)
    mp = ("mesh", "position")
    return xr.Dataset(
        {
            "ste": _variable(mp, ste, "m", "static transmission error"),
            "ste_overall": _variable(("planet", "position"), ste[:N] + ste[N:], "m", "sun to ring"),
            "mesh_force": _variable(mp, np.full((2 * N, 64), force), "N", "mesh force"),
            "back_force": _variable(mp, np.zeros((2 * N, 64)), "N", "force on the back flanks"),
            "member_motion": _variable(("member", "position"), np.zeros((0, 64)), "m", "displacement"),
            "mesh_stiffness": _variable(mp, stiffness, "N/m", "tangent mesh stiffness"),
            "mesh_stiffness_secant": _variable(mp, force / ste, "N/m", "secant mesh stiffness"),
            "tooth_load": _variable(("mesh", "tooth", "position"), pair, "N", "load of a tooth pair"),
            "load_share": _variable(("planet", "position"), share, "1", "share of the torque"),
            "max_pressure": _variable(mp, 9e8 + 2e8 / engaged, "Pa", "largest contact pressure"),
        },
        coords={
            "mesh": MESHES,
            "position": _variable("position", position, "1", "position"),
            "planet": _variable("planet", [1, 2, 3], "1", "planet"),
        },
        attrs={
            "contact_ratio_sun_planet": ratio["sun"],
            "contact_ratio_planet_ring": ratio["ring"],
            "working_pressure_angle_sun_planet": np.radians(22.1995),
            "working_pressure_angle_planet_ring": np.radians(20.0),
            "contact": "profile",
            "module": 1.5e-3,
        },
    )


def _pair_loads(position, contact_ratio, force):
    """Two simultaneous pairs one base pitch apart, load split evenly in double contact."""
    path = np.arange(2)[:, None] + position
    on = (path < contact_ratio).astype(float)
    return force * on / on.sum(axis=0)


def stress() -> xr.Dataset:
    """Parabolic stresses along roots, one load class, Hertzian pressures, planets bent both ways."""
    mg, force = ("mesh", "gear"), 100 / 3 / 0.01903
    path = np.arange(-2, 3, 1 / 64)
    load = force * np.exp(-(((path - 0.4) / 0.5) ** 4))
    arc, slope = np.linspace(0, 1.2e-3, 12), np.linspace(0.1, 1.4, 12)
    along = 1 - ((arc - 5e-4) / 9e-4) ** 2
    # the largest stress of every gear [Pa]
    height = 4e4 * force * np.repeat([[1.0, 0.9], [0.85, 0.7]], N, axis=0)
    tension = height[..., None] * load / load.max()
    profile = height[..., None, None] * np.stack([along, -1.2 * along]) / along.max()
    at, top = int(along.argmax()), int(load.argmax())
    # the smallest: of planets that of the back flank, of sun and ring next to nothing
    low = height * np.repeat([[-0.05, -1.13], [-1.27, -0.05]], N, axis=0)
    same = np.ones((2 * N, 2))
    data = {
        "root_tension": _variable((*mg, "step"), tension, "Pa", "largest stress of the loaded flank's root"),
        "root_compression": _variable((*mg, "step"), -1.2 * tension, "Pa", "lowest of the back flank's"),
        "root_path": _variable((*mg, "step"), same[..., None] * path, "1", "path"),
        "root_load": _variable((*mg, "step"), same[..., None] * load, "N", "load"),
        "root_profile": _variable((*mg, "root", "point"), profile, "Pa", "stress along both roots"),
        "root_arc": _variable((*mg, "point"), same[..., None] * arc, "m", "arc length"),
        "root_slope": _variable((*mg, "point"), same[..., None] * slope, "rad", "slope of the root"),
        "root_worst": _variable(mg, height, "Pa", "largest stress"),
        "root_worst_arc": _variable(mg, arc[at] * same, "m", "its place"),
        "root_worst_slope": _variable(mg, slope[at] * same, "rad", "its place"),
        "root_worst_position": _variable(mg, path[top] % 1 * same, "1", "its position"),
        "root_worst_path": _variable(mg, path[top] * same, "1", "its path"),
        "root_worst_load": _variable(mg, load[top] * same, "N", "its load"),
        "root_notch_radius": _variable(mg, 0.45 * MODULE * same, "m", "smallest radius of curvature"),
        "root_range_maximum": _variable(mg, height, "Pa", "largest stress over a turn"),
        "root_range_minimum": _variable(mg, low, "Pa", "smallest stress over a turn"),
        "root_range_arc": _variable(mg, arc[at] * same, "m", "place of the range"),
        "iso_root_stress": _variable(mg, 0.95 * height, "Pa", "nominal root stress"),
    }
    return xr.Dataset(
        data | _planet_turn(height, low) | _tooth_contacts(force),
        coords={"mesh": MESHES, "gear": ["first", "second"], "root": ["loaded", "back"]},
        attrs={
            "sun_torque": 100.0,
            "mesh_periods": 1,
            "repeats": 1,
            "iso": "",
            "load_counting": "peaks",
            "module": MODULE,
            "nominal_load": force,
        },
    )


def _planet_turn(height, low) -> dict:
    """Root stress of the planets: one bump from each of their two meshes."""
    turn = np.arange(-0.25, 0.75, 1 / (64 * PLANET))
    here, there = (np.exp(-(((turn - place) / 0.02) ** 2)) for place in (0.0, 0.49))
    planets = [height[:N, 1:] * here + low[:N, 1:] * there, height[N:, :1] * there + low[N:, :1] * here]
    return {
        "planet_root_stress": _variable(("mesh", "turn"), np.vstack(planets), "Pa", "stress over a turn"),
        "turn": _variable("turn", turn, "1", "turns"),
    }


def _tooth_contacts(force) -> dict:
    """Pressures after Hertz with 10 mm reduced radius, and loads that are all in the last class."""
    position, edges = np.arange(64) / 64, np.linspace(0, force, 21)
    line = _pair_loads(position, 1.5507, force) / FACE_WIDTH
    half = np.sqrt(4 * line * 0.01 / (np.pi * 113e9))[:, None]
    offset = np.linspace(-1.2e-4, 1.2e-4, 25)
    inside = np.sqrt(np.maximum(half**2 - offset[:, None] ** 2, 0))
    pressure = np.divide(2 * line[:, None] * inside, np.pi * half**2, out=0 * inside, where=half > 0)
    every = (2 * N, *pressure.shape)
    path = MODULE * np.pi * np.cos(np.radians(20)) * (np.arange(2)[:, None] + position - 0.7)
    cycles, last = np.repeat([[N, 1], [1, N]], N, axis=0), np.eye(20)[[19] * (2 * N)]
    mpp, ml = ("mesh", "pair", "position"), ("mesh", "load_bin")
    largest = np.tile(pressure.max(axis=(0, 1)), (2 * N, 1))
    cells = np.broadcast_to(pressure, every)
    return {
        "contact_pressure": _variable(("mesh", "position"), largest, "Pa", "largest pressure"),
        "pressure_distribution": _variable(("mesh", "pair", "cell", "position"), cells, "Pa", "pressure"),
        "pressure_offset": _variable(("mesh", "cell"), np.tile(offset, (2 * N, 1)), "m", "place of a cell"),
        "pressure_centre": _variable(mpp, np.zeros((2 * N, 2, 64)), "m", "middle of the window"),
        "pressure_path": _variable(mpp, np.tile(path, (2 * N, 1, 1)), "m", "path"),
        "contact_worst_path": _variable("mesh", np.zeros(2 * N), "m", "its place: the pitch point"),
        "contact_worst_load": _variable("mesh", np.full(2 * N, force), "N", "its load"),
        "contact_worst_curvature": _variable("mesh", np.ones(2 * N), "1", "over that of the pitch point"),
        "contact_start": _variable(("mesh", "gear"), np.full((2 * N, 2), 1e-3), "m", "begin above the base"),
        "relief_kink": _variable("mesh", np.zeros(2 * N, dtype=int), "1", "whether a relief has a kink"),
        "iso_contact_stress": _variable("mesh", np.full(2 * N, 0.9 * largest.max()), "Pa", "nominal"),
        "iso_contact_ratio_factor": _variable("mesh", np.full(2 * N, 0.9), "1", "Z_eps"),
        "load_bin_low": _variable("load_bin", edges[:-1], "N", "lower limit"),
        "load_bin_high": _variable("load_bin", edges[1:], "N", "upper limit"),
        "load_time_share": _variable(ml, last, "1", "share of the time"),
        "load_cycle_share": _variable(ml, last, "1", "share of the cycles"),
        "load_cycles": _variable(("mesh", "gear"), cycles, "1", "cycles a turn"),
        "loaded_contact_ratio": _variable("mesh", np.full(2 * N, 1.5507), "1", "periods under load"),
        "position": _variable("position", position, "1", "position"),
        "load_bin": _variable("load_bin", (edges[1:] + edges[:-1]) / 2, "N", "middle of the class"),
    }


def modes() -> xr.Dataset:
    """Rigid motion, body modes and cosine and sine ring modes."""
    rigid = [f"{b}: {a}" for b in ("sun", "carrier", *(f"planet {n + 1}" for n in range(N))) for a in _AXES]
    dofs = [*rigid, *(f"ring: n={n} {p}" for n in range(5) for p in ("cosine", "sine"))]
    shape, frequency, kind, diameter = [], [], [], []
    components = []

    def add(values, hertz, what, n, field=()):
        shape.append([values.get(name, 0.0) for name in dofs])
        frequency.append(hertz)
        kind.append(what)
        diameter.append(n)
        row = np.zeros(2 * DIAMETERS + 1, complex)
        for m, value in field:
            row[DIAMETERS + m] = value
        components.append(row)

    ring = {"sun: rotation": 20.0, "carrier: rotation": 4.0} | {f"planet {n + 1}: rotation": -9.0 for n in range(N)}
    add(ring, 0.0, "rigid", 0)
    add(
        {f"planet {n + 1}: rotation": 50.0 for n in range(N)} | {"sun: rotation": 60.0},
        310.0,
        "rotational",
        0,
    )
    for axis, hertz in (("x", 840.0), ("y", 840.0)):
        add({f"sun: {axis}": 1.5, f"carrier: {axis}": 0.4}, hertz, "translational", 1, ((1, 0.05), (-1, 0.05)))
    for n, hertz in ((0, 5200.0), (1, 2100.0), (2, 2600.0), (3, 3150.0), (4, 4100.0)):
        for phase in (1.0, -1j)[: 1 if n == 0 else 2]:
            add({}, hertz, "ring", n, ((n, phase), (-n, np.conj(phase))))
    order = np.argsort(frequency, kind="stable")
    c = np.array(components)[order]
    # bent without being stretched: du_t/dphi = -u_r
    n = np.arange(-DIAMETERS, DIAMETERS + 1)
    along = 1j * c / np.where(n == 0, np.inf, n)
    mc = ("mode", "circumferential")
    return xr.Dataset(
        {
            "frequency": _variable("mode", np.array(frequency)[order], "Hz", "natural frequency"),
            "damping_ratio": _variable("mode", np.full(len(order), 0.05), "1", "damping ratio"),
            "kind": _variable("mode", np.array(kind)[order], "", "kind of mode"),
            "nodal_diameter": _variable("mode", np.array(diameter)[order], "1", "nodal diameters"),
            "shape": _variable(("dof", "mode"), np.array(shape)[order].T, "kg^-0.5", "mode shape"),
            "ring_shape_real": _variable(mc, c.real, "kg^-0.5", "ring shape"),
            "ring_shape_imag": _variable(mc, c.imag, "kg^-0.5", "ring shape"),
            "ring_tangential_shape_real": _variable(mc, along.real, "kg^-0.5", "ring shape"),
            "ring_tangential_shape_imag": _variable(mc, along.imag, "kg^-0.5", "ring shape"),
        },
        coords={
            "dof": dofs,
            "mode": _variable("mode", np.arange(len(order)), "1", "mode"),
            "circumferential": _circumferential(),
        },
    )


_AXES = ("x", "y", "rotation")


def ring_field() -> np.ndarray:
    """Carrier-frame components (speed, harmonic, n) [m] with the symmetry of identical planets in phase."""
    n = np.arange(-DIAMETERS, DIAMETERS + 1)
    h = np.arange(HARMONICS + 1)
    size = 2e-7 / (1 + h[:, None]) ** 2.2 / (1 + (n / 3) ** 2) * np.where(n == 0, 0.15, 1.0)
    resonance = 1 / np.abs(1 - (h[None] * CARRIER_FREQUENCY[:, None] * RING / 5600) ** 2 + 0.1j)
    field = size * resonance[:, :, None] * np.exp(1j * (0.7 * h[:, None] + 0.2 * np.abs(n))) * (n % N == 0)
    field[:, 0] = 6e-6 * (n % N == 0) / (1 + (n / 4) ** 2) * np.cos(0.4 * n)
    return field


def dynamics(*, speeds: np.ndarray | None = None) -> xr.Dataset:
    """Harmonics of identical planets; with `speeds` a resonance curve without ring components."""
    rpm = SPEEDS if speeds is None else np.asarray(speeds)
    mesh = rpm / 60 * SUN / (SUN + RING) * RING
    h = np.arange(HARMONICS + 1)
    gain = 1 / (1 - (h * mesh[:, None] / 1500) ** 2 + 0.1j * h * mesh[:, None] / 1500)
    kind = np.where(np.arange(2 * N) < N, 1.0, 0.7)
    dte = 1e-6 * kind[:, None] * np.exp(-1j * h) / (1 + h) ** 1.5 * gain[:, None, :]
    dte[:, :, 0] = 5e-6
    force = 3e8 * dte
    smh, s = ("speed", "mesh", "harmonic"), len(rpm)
    radius = 0.2 + 0.5 * np.abs(gain[:, 1]) / np.abs(gain).max()
    data = {
        "mesh_frequency": _variable("speed", mesh, "Hz", "mesh frequency"),
        "converged": _variable("speed", np.ones(s, bool), "1", "converged"),
        "iterations": _variable("speed", np.full(s, 14), "1", "iterations"),
        "residual": _variable("speed", np.full(s, 3e-8), "1", "residual"),
        "spectral_radius": _variable("speed", radius, "1", "spectral radius"),
        "floquet_multiplier": _variable("speed", np.full(s, 0.83), "1", "largest Floquet multiplier"),
        "stable": _variable("speed", np.ones(s, bool), "1", "whether no perturbation grows"),
        "method": _variable("speed", np.array(["fixed point"] * s), "", "method"),
    } | {
        f"{name}_{part}": _variable(smh, getattr(value, part), units, name)
        for name, value, units in (("dte", dte, "m"), ("mesh_force", force, "N"))
        for part in ("real", "imag")
    }
    coords = {
        "speed": _variable("speed", rpm, "rpm", "input speed"),
        "mesh": MESHES,
        "harmonic": _variable("harmonic", h, "1", "harmonic"),
    }
    if speeds is None:
        field, dims = ring_field()[-1], ("harmonic", "circumferential")
        for name, value in (("ring", field), ("ring_tangential", 0.3j * field)):
            for part in ("real", "imag"):
                data[f"{name}_{part}"] = _variable(dims, getattr(value, part), "m", name)
        coords["circumferential"] = _circumferential()
    return xr.Dataset(data, coords=coords)


def housing() -> xr.Dataset:
    """Exact lines of `ring_field` at orders h z_ring - n."""
    field, n, top = ring_field(), np.arange(-DIAMETERS, DIAMETERS + 1), HARMONICS * RING + DIAMETERS + 1
    lines = np.zeros((len(SPEEDS), top), complex)
    for h in range(HARMONICS + 1):
        for column, m in enumerate(n):
            order = h * RING - m
            if order > 0:
                lines[:, order] += field[:, h, column]
    speed = 2 * np.pi * CARRIER_FREQUENCY
    acceleration = lines * (speed[:, None] * np.arange(top)) ** 2
    so, words = ("speed", "order"), "radial displacement at the sensor"
    return xr.Dataset(
        {
            "lines_real": _variable(so, lines.real, "m", words),
            "lines_imag": _variable(so, lines.imag, "m", words),
            "carrier_speed": _variable("speed", speed, "rad/s", "speed of the carrier"),
            "excitation_limit": _variable("speed", np.full(len(SPEEDS), 5e3), "Hz", "limit"),
            "level": _variable("speed", np.sqrt((np.abs(acceleration) ** 2).sum(axis=1) / 2), "m/s^2", "level"),
            "pressure_level": _variable("speed", np.array([50.9, 87.7]), "dB", "level at the microphone"),
        },
        coords={
            "speed": _variable("speed", SPEEDS, "rpm", "input speed"),
            "order": _variable("order", np.arange(top), "1", "carrier order"),
        },
        attrs={
            **{"sensor_angle": 0.0, "ring_teeth": RING, "form": "linear", "points": 54, "method": "exact"},
            **{"microphone_distance": 1.0, "microphone_angle": 0.0, "air_density": 1.2, "sound_speed": 343.0},
            **{"outer_radius": OUTER, "face_width": FACE_WIDTH},
        },
    )


def runup() -> xr.Dataset:
    """Five speeds with lines at 105, 108 and 111 and their double, and two resonances."""
    speed, order = np.linspace(100.0, 500.0, 5), np.array([105, 108, 111, 213, 216, 219])
    lines = np.outer(speed / 500.0, [0.5, 0.1, 0.4, 0.2, 0.05, 0.3])
    kinds = np.outer(speed, [1.0, 0.5])
    text, rows, both = "some number", "resonance", ("speed", "mesh_kind")
    data = xr.Dataset(
        {
            "mesh_frequency": _variable("speed", 0.36 * speed, "Hz", "mesh frequency"),
            "carrier_speed": _variable("speed", speed * 2 * np.pi / 300, "rad/s", "speed of the carrier"),
            "excitation_limit": _variable("speed", np.full(5, 1e3), "Hz", text),
            "level": _variable("speed", np.sqrt(0.5 * (lines**2).sum(axis=1)), "m/s^2", text),
            "force_rms": _variable(both, kinds, "N", text),
            "force_peak": _variable(both, 1e3 + kinds, "N", text),
            "lowest_force": _variable("speed", 1e3 - speed, "N", text),
            "dynamic_factor": _variable(both, 1.0 + 1e-3 * kinds, "1", text),
            "lines_real": _variable(("speed", "order"), lines, "m/s^2", text),
            "lines_imag": _variable(("speed", "order"), 0.0 * lines, "m/s^2", text),
            "mode": _variable(rows, [3, 4], "1", text),
            "kind": _variable(rows, ["rotational", "ring, rotational"], "1", text),
            "mesh_harmonic": _variable(rows, [1, 2], "1", text),
            "frequency": _variable(rows, [90.0, 200.0], "Hz", text),
            "resonance_speed": _variable(rows, [250.0, 277.8], "rpm", text),
            "share": _variable(rows, [1.0, 0.2], "1", text),
            "resonance_level": _variable(rows, [0.2, 0.3], "m/s^2", text),
            "resonance_alone": _variable(rows, [0.15, 0.1], "m/s^2", text),
            "resonance_factor": _variable((rows, "mesh_kind"), np.full((2, 2), 1.1), "1", text),
            "operating_speed": _variable(rows, [250.0, 250.0], "rpm", text),
            "operating_alone": _variable(rows, [0.15, 0.0], "m/s^2", text),
            "distance": _variable(rows, [0.0, 11.1], "%", text),
        },
        coords={
            "speed": _variable("speed", speed, "rpm", "speed of the input"),
            "order": _variable("order", order, "1", "carrier order"),
            "mesh_kind": ["sun-planet", "planet-ring"],
        },
        attrs={"ring_teeth": 108, "operating_speeds": [250.0], "reference_acceleration": 1e-6},
    )
    return data
