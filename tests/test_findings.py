"""Warnings: one catalogue, and one list that every code reaches.

`RAISED` has for every code a way that users have to meet it, by cases, results, exports and studies. Runs of
every kind of train show that the list reaches standard error, manifest, files, page and terminal.
"""

import json
import re
import warnings
from collections.abc import Callable, Iterable
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
import synthetic_results as synthetic
import xarray as xr
from planet_gearboxes import uneven_planets

from femgear import cli
from femgear.findings import CATALOGUE, SEVERITIES, Finding, FindingWarning, as_data, from_data, once, percent, remark
from femgear.report.tables import lower_bound
from femgear.run import solve
from femgear.stages.static_results import describe_stress
from femgear.trains.reading import open_results, read_case, with_values
from femgear.trains.registry import train_of, trains

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

PACKAGE = Path(__file__).parents[1] / "femgear"
CASES = Path(__file__).parents[1] / "cases"


def codes_in_the_source() -> set[str]:
    files = (path for path in PACKAGE.rglob("*.py") if path.name != "findings.py")
    return {code for path in files for code in re.findall(r'"(W-[A-Z0-9-]+)"', path.read_text())}


def test_every_code_stands_in_the_catalogue_and_is_raised():
    assert codes_in_the_source() == set(CATALOGUE)


@pytest.mark.parametrize("code", CATALOGUE)
def test_meanings_are_sentences_and_severities_known(code):
    meaning = CATALOGUE[code]
    assert meaning.severity in SEVERITIES
    for sentence in (meaning.sentence, meaning.advice):
        assert sentence[0].isupper() or sentence.startswith(("femgear ", "share = "))
        assert sentence.endswith(".") and max(len(part.split()) for part in re.split(r"[.:;] ", sentence)) <= 25
    # beside a number on a card
    assert 2 <= len(meaning.words) <= 40 and not meaning.words.endswith(".") and code not in meaning.words


def test_a_finding_has_the_severity_of_its_code_unless_given():
    assert Finding("W-PRESSURE", "", "too much").severity == "fault"
    assert Finding("W-PRESSURE", "", "too much", severity="doubt").severity == "doubt"
    assert remark("read so").severity == "note"


def test_unknown_codes_and_severities_are_refused():
    with pytest.raises(KeyError, match="W-NOWHERE"):
        Finding("W-NOWHERE", "", "text")
    with pytest.raises(ValueError, match="loud"):
        Finding("W-PULL", "", "text", severity="loud")


# --- a way to every code ------------------------------------------------------------------------------


def case(name: str, changes: dict | None = None):
    """A shipped case with some entries changed."""
    return with_values(read_case(CASES / f"{name}.toml"), changes or {})


def of_case(name: str, changes: dict | None = None) -> tuple[Finding, ...]:
    read = case(name, changes)
    return train_of(read).case_warnings(read)


PLANETARY, HELICAL, CHAIN = "planetary_27_40_108", "helical_30_20_70", "own_chain"


def former_file() -> tuple[Finding, ...]:
    """Findings of a file of planetary stages in series."""
    body = {"mass": "1 kg", "inertia": "1e-2 kg m^2", "support_stiffness": "1e8 N/m"}
    bodies = dict.fromkeys(("sun", "carrier", "ring"), body)
    ring = bodies["ring"] | {"torsional_stiffness": "1e9 N m/rad"}
    planet = {"mass": "1 kg", "inertia": "1e-3 kg m^2", "bearing_stiffness": "1e8 N/m"}
    gears = {"teeth": [24, 24, 72], "module": "4 mm", "face_width": "40 mm"}
    stage = bodies | {"ring": ring, "planet": planet, "gears": gears}
    read = read_case({"model": "multistage", "title": "one stage", "stage": [stage]})
    return train_of(read).case_warnings(read)


def of_text(change: Callable[[str], str]) -> tuple[Finding, ...]:
    """Findings of the reference case with its text changed before it is read."""
    read = read_case(change((CASES / f"{PLANETARY}.toml").read_text(encoding="utf-8")))
    return train_of(read).case_warnings(read)


def of_stage(train: str, stage: str, data: xr.Dataset) -> tuple[Finding, ...]:
    """What a stage says against the contents of its file."""
    (known,) = (one.train for one in trains() if one.name == train)
    return known.stage(stage).findings(data)


def short_life(*lives: float) -> xr.Dataset:
    """A root that fails before its time, or at once."""
    return xr.Dataset(
        {
            "root_life": ("root", [*lives]),
            "root_damage": ("root", [0.5, 2.0]),
            "root_damage_share": (("load_case", "root"), [[0.4, 0.7], [0.6, 0.3]]),
        },
        coords={"load_case": ["start", "run"], "root": ["gear 1", "gear 2"]},
    )


def reversed_root() -> xr.Dataset:
    """A root that the second load case bends back."""
    both = ("load_case", "root"), [[0], [1]]
    return short_life(9e9, 9e9).isel(root=[0]).assign(root_reversed=both, root_reversal_factor=("root", [0.7]))


def told(work: Callable[[], object]) -> tuple[Finding, ...]:
    """Findings that exports and studies tell beside results."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        work()
    return tuple(one.message.args[0] for one in said if issubclass(one.category, FindingWarning))


def static(**changes) -> xr.Dataset:
    """Contents of static.nc of identical planets with some variables and attributes replaced by values."""
    data = synthetic.static().assign_attrs(contact="profile")
    for name, value in changes.items():
        if name in data:
            data[name] = data[name].copy(data=np.broadcast_to(value, data[name].shape))
        else:
            data.attrs[name] = value
    return data


def edge(name: str, value: float) -> xr.Dataset:
    """A variable of static.nc that has another value at the first mesh and position."""
    data = static()
    values = data[name].values.copy()
    values[0, 0] = value
    return static(**{name: values})


def corner() -> xr.Dataset:
    """stress.nc of roots with a sharp corner."""
    sharp = {"root_notch_radius": (("mesh", "gear"), np.zeros((6, 2))), "relief_kink": ("mesh", np.zeros(6))}
    return synthetic.stress().assign(sharp).assign_attrs(module=1.5e-3, nominal_load=0.0)


def over_width(*, lifted: bool = False, couple: float = 0.0, **attrs) -> xr.Dataset:
    """static.nc of teeth in 8 slices, with K_Hbeta 1.3."""
    data = static(face_width=25e-3, **attrs)
    load = np.broadcast_to(data["tooth_load"].values[:, :, None], (6, 2, 8, 64)).copy()
    if lifted:
        load[:, :, 0] = 0.0
    dims = ("mesh", "tooth", "slice", "position")
    data = data.assign(
        slice_load=(dims, load),
        slice_pressure=(dims, 1e9 * (load > 0.0)),
        face_load_factor=("mesh", np.full(6, 1.3)),
    )
    return data.assign(planet_couple=(("planet", "position"), np.full((3, 64), couple)))


def moved() -> xr.Dataset:
    """static.nc with a sun that moves by 0.2 mm."""
    data = static().drop_vars("member_motion")
    return data.assign(member_motion=(("member", "position"), np.full((1, 64), 2e-4)))


def dynamics(**values) -> xr.Dataset:
    """dynamics.nc with some variables replaced by values at the last speed."""
    data = synthetic.dynamics()
    for name, value in values.items():
        changed = data[name].values.copy()
        changed[-1] = value
        data[name] = data[name].copy(data=changed)
    return data


def housing(**values) -> xr.Dataset:
    """housing.nc at two speeds with further variables, and attributes of text."""
    data = xr.Dataset(coords={"speed": [250.0, 3100.0]})
    data["excitation_limit"] = ("speed", [1e4, 2e4])
    attrs = {name: value for name, value in values.items() if isinstance(value, str)}
    entries = {name: ("speed", value) for name, value in values.items() if name not in attrs}
    return data.assign(entries).assign_attrs(attrs)


def large() -> tuple[Finding, ...]:
    """Findings of the reference case where every size is one that is told."""
    from femgear.trains.elastic import stages

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "_NOTICED", 0.0)
        return of_case(PLANETARY)


def runup(lowest: float = 1.0, missed: int = 0) -> xr.Dataset:
    speed = np.array([1000.0, 2000.0])
    values = {"lowest_force": ("speed", [1.0, lowest]), "force_peak": ("speed", [1e3, 1e3])}
    return xr.Dataset(values, {"speed": speed}, {"unresolved_resonances": missed})


def tail(value: float) -> xr.Dataset:
    """What response.nc of a planar case says of the ends of its series."""
    values = {name: ("speed", [value, 0.0]) for name in ("tail", "force_tail")}
    return xr.Dataset(values, {"speed": [10.0, 20.0]}, {"mesh_lines": 1})


def exported(wanted: str, rows: int | None = None, **sampling):
    """Findings of an export of synthetic results, into sheets with so many rows at most."""

    def work(folder: Path) -> tuple[Finding, ...]:
        from femgear.exchange import formats
        from femgear.exchange.sampling import Sampling
        from femgear.run import export_results
        from femgear.storage.files import list_own

        results = open_results(synthetic_run(folder / "out"))
        list_own(folder / "exported")
        how = Sampling(duration=0.1, **sampling)
        with pytest.MonkeyPatch.context() as patch:
            if rows is not None:
                patch.setattr(formats, "_ROWS", rows)
            return told(lambda: export_results(results, folder / "exported", [wanted], how))

    return work


def synthetic_run(folder: Path) -> Path:
    """A results folder of the reference case from synthetic data."""
    from edited_manifests import finish

    from femgear.storage.files import write_dataset, write_text
    from femgear.storage.results import prepare_output

    prepare_output(folder)
    read, names, findings = case(PLANETARY), ["case.toml"], []
    write_text(read.source, folder / "case.toml")
    for stage in ("static", "modes", "dynamics", "housing"):
        data = getattr(synthetic, stage)()
        for name in data.coords:
            data[name].attrs.setdefault("units", "1")
            data[name].attrs.setdefault("long_name", str(name))
        findings += train_of(read).stage(stage).findings(data)
        write_dataset(data, folder / f"{stage}.nc")
        names.append(f"{stage}.nc")
    finish(folder, names, timings={}, convergence={}, findings=findings)
    return folder


def damaged_journal(folder: Path) -> tuple[Finding, ...]:
    """A sweep that goes on from a journal of which a line was changed."""
    from femgear.study.sweep import sweep_into

    over, of = ["carrier.mass=1 kg..2 kg/3"], ["contact ratio sun-planet"]
    work = partial(sweep_into, case(PLANETARY), folder, over=over, of=of)
    work()
    (journal,) = (path for path in folder.iterdir() if path.suffix == ".jsonl")
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([*lines[:2], lines[2][:20] + b"\n", *lines[3:]]))
    return told(work)


def long_sweep(folder: Path) -> tuple[Finding, ...]:
    from femgear.study import sweep

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep, "_MANY", 4)
        over, of = ["carrier.mass=1 kg..2 kg/5"], ["contact ratio sun-planet"]
        return told(lambda: sweep.sweep_into(case(PLANETARY), folder, over=over, of=of))


def rexs(folder: Path) -> tuple[Finding, ...]:
    """Findings of a file whose case leaves something out."""
    from rexs_stage import Gearbox

    from femgear.exchange.planetary_stage import case_tables
    from femgear.exchange.rexs import read_model

    box = Gearbox()
    box.add(999, "cylindrical_stage")  # a second stage, of fixed axes
    model = read_model(box.write(folder / "stage.rexs"))
    case_tables(model)
    return model.findings


@cache
def transient_base() -> xr.Dataset:
    vm, one = ("variant", "mesh"), np.ones((1, 1))
    return xr.Dataset(
        {
            "least_force": (vm, -200.0 * one),
            "pulling": (vm, 0.0 * one),
            "lost": (vm, 0.0 * one),
            "growth": (("variant",), [-3.0]),
            "gain": (("variant",), [1.0]),
            "energy_error": (("variant",), [1e-12]),
            "momentum_error": (("variant",), [1e-14]),
        },
        {"variant": ["with bending"], "mesh": ["a-b"]},
        {"steps": 40_000, "step": 5e-5, "contact": "linear", "mesh_mode": 0.0},
    )


def transient(contact: str = "linear", **values) -> xr.Dataset:
    """What transient.nc says of a run of 2 s."""
    data = transient_base().assign_attrs(contact=contact)
    return data.assign({name: data[name] * 0.0 + value for name, value in values.items()})


PROFILE = {"kind": "measured profile", "diameters": ["41 mm", "41.5 mm"], "deviations": ["0 um", "1 um"]}
CLOSE = ["0 deg", f"{29 * 360 / 135} deg", "200 deg"]
SHARP = {
    "sun.teeth": 14,
    "sun.tip_diameter": None,
    "sun.profile_shift": 0.0,
    "sun.bore_radius": "3 mm",
    "planet.teeth": 40,
    "ring.teeth": 94,
    "planet.bore_radius": "3 mm",
    "set.centre_distance": "40.5 mm",
    "ring.tip_diameter": "138.6 mm",
    "ring.cutter_teeth": None,
}
RESULTS: dict[str, Callable[[], Iterable[Finding]]] = {
    "W-BACK": lambda: of_stage("elastic", "static", static(mesh_force=0.0, back_force=10.0)),
    "W-BALANCE": lambda: of_stage("gearbox", "transient", transient(energy_error=1e-3)),
    "W-BRANCH": lambda: of_stage("gear_pair", "response", xr.Dataset(attrs={"complete": 0, "message": "lost at 0.7"})),
    "W-CHAOS": lambda: of_stage("gearbox", "transient", transient("separating", growth=5.0)),
    "W-CONVERGENCE": lambda: of_stage("elastic", "dynamics", dynamics(converged=False)),
    "W-DEFLECTION": lambda: of_stage("elastic", "static", static(ste=1e-4)),
    "W-EDGE": lambda: of_stage("elastic", "static", edge("max_pressure", 0.0)),
    "W-ENDS": lambda: of_stage("elastic", "static", over_width(free_ends=0.09)),
    "W-FACE-LOAD": lambda: of_stage("elastic", "static", over_width()),
    "W-GROWTH": lambda: of_stage("gearbox", "transient", transient(growth=2.0)),
    "W-KINK": lambda: of_stage("elastic", "stress", corner()),
    "W-LIFE": lambda: of_stage("pair", "life", short_life(200.0, 50.0)),
    "W-LIFTED": lambda: of_stage("elastic", "static", over_width(lifted=True)),
    "W-HEAT": lambda: of_stage(
        "pair",
        "heat",
        xr.Dataset({name: (("speed", "mesh_kind"), [[0.9]]) for name in ("scuffing_safety", "film_safety")}),
    ),
    "W-LOSSES": lambda: of_stage(
        "pair", "losses", xr.Dataset({"efficiency": ("speed", [0.0])}, {"speed": [250.0]}, {"missing": ""})
    ),
    "W-MOTION": lambda: of_stage("elastic", "static", moved()),
    "W-ONE-WAY": lambda: of_stage("elastic", "housing", housing(one_way_difference=[0.1, 5.0])),
    "W-OPEN": lambda: of_stage("elastic", "static", edge("mesh_force", 0.0)),
    "W-PARTED": lambda: of_stage("gearbox", "transient", transient("separating", lost=1.0)),
    "W-RIPPLE": lambda: of_stage("elastic", "static", static(ripple_doubt=0.05)),
    "W-POSITIONS": lambda: of_stage("elastic", "static", static(peak_doubt=0.5)),
    "W-PRESSURE": lambda: of_stage("pair", "static", static(max_pressure=5e9)),
    "W-PULL": lambda: of_stage("elastic", "runup", runup(lowest=-100.0)),
    "W-RESIDUAL": lambda: of_stage("elastic", "housing", housing(missing_compliance="a tenth")),
    "W-SEPARATION": lambda: of_stage(
        "pair",
        "dynamics",
        dynamics().assign(
            drive_contact=("speed", [1.0, 0.9]), back_contact=("speed", [0.0, 0.0]), backlash=("x", [1e-5])
        ),
    ),
    "W-STANDING": lambda: train_of(planets := read_case(uneven_planets())).case_warnings(planets),
    "W-STRENGTH": lambda: of_stage("pair", "life", short_life(200.0, 0.0)),
    "W-STIFFNESS": lambda: of_stage(
        "gearbox",
        "deflection",
        xr.Dataset(
            {
                "settled": ("load_case", [True]),
                "estimate_face_load_factor": (("estimate", "mesh"), [[1.1], [1.3]]),
            },
            coords={"load_case": ["nominal"], "mesh": ["stage"]},
        ),
    ),
    "W-PASSES": lambda: of_stage(
        "gearbox",
        "deflection",
        xr.Dataset({"settled": ("load_case", [False])}, coords={"load_case": ["nominal"]}),
    ),
    "W-FREE": lambda: of_stage(
        "gearbox",
        "modes",
        xr.Dataset(
            {"kind": ("mode", ["rigid", "rigid", "casing"]), "main_member": ("mode", ["input", "casing", "casing"])},
            attrs={"ways": 1},
        ),
    ),
    "W-CROSS": lambda: of_stage(
        "gearbox",
        "dynamics",
        xr.Dataset(
            {
                "lowest_force": (("speed", "stage", "kind"), [[[1.0], [1.0]]]),
                "outer": (("speed", "stage"), [[0.0, 0.0]]),
                "cross_excitation": (("speed", "stage", "other_stage"), [[[0.0, 0.2], [0.0, 0.0]]]),
                "mesh_force_rms": (("speed", "stage", "kind"), [[[2.0], [1.0]]]),
                "mean_force": (("speed", "stage", "kind"), [[[10.0], [10.0]]]),
            },
            coords={"speed": [1000.0], "stage": ["first", "second"], "other_stage": ["first", "second"]},
            attrs={"missing": "", "rigid": "", "up_to": 2e4},
        ),
    ),
    "W-RIGID": lambda: of_stage(
        "gearbox",
        "dynamics",
        xr.Dataset(
            {
                "lowest_force": (("speed", "stage", "kind"), [[[1.0], [1.0]]]),
                "outer": (("speed", "stage"), [[0.0, 0.0]]),
            },
            coords={"speed": [1000.0], "stage": ["first", "second"]},
            attrs={"missing": "", "rigid": "ring of second", "up_to": 2e4},
        ),
    ),
    "W-PLAY": lambda: of_stage(
        "gearbox",
        "deflection",
        xr.Dataset(
            {
                "settled": ("load_case", [True]),
                "slack": (("load_case", "bearing", "motion"), [[[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]]),
            },
            coords={"load_case": ["nominal"], "bearing": ["A"]},
        ),
    ),
    "W-SETTLED": lambda: of_stage("gear_pair", "sweep", xr.Dataset({"settled": ("ratio", [1, 0])})),
    "W-STEPS": lambda: of_stage("elastic", "runup", runup(missed=3)),
    "W-TAIL": lambda: of_stage("planar", "response", tail(0.3)),
    "W-THRUST": lambda: of_stage("helical", "static", over_width(couple=20.0)),
    "W-UNSTABLE": lambda: of_stage("elastic", "dynamics", dynamics(stable=False)),
    "W-WEDGED": lambda: of_stage("planar", "static", static(back_force=10.0)),
}
OF_CASES: dict[str, Callable[[], Iterable[Finding]]] = {
    "W-BACKLASH": lambda: of_case(CHAIN, {"transient.contact_loss": True, "pair[0].mesh.backlash": None}),
    "W-BEARING": lambda: of_case(PLANETARY, {"planet.bearing_clearance": "10 um"}),
    "W-CLEARANCE": lambda: of_case(PLANETARY, {"sun.tip_diameter": "45.6 mm"}),
    "W-CONTACT-POINTS": lambda: of_case(HELICAL, {"helical.contact_points": "base_circles"}),
    "W-CONTACT-RATIO": lambda: of_case(PLANETARY, {"sun.tip_diameter": "44 mm", "planet.tip_diameter": "62.4 mm"}),
    "W-COUPLING": lambda: of_case(PLANETARY, {"motor.coupling_stiffness": "1 N m/rad"}),
    "W-DAMPING": lambda: of_case(PLANETARY, {"dynamics.damping_ratio": 0.0}),
    "W-ESTIMATED": lambda: of_case(PLANETARY, {"sun.mass": None}),
    "W-EXCITATION": lambda: of_case("gear_pair", {"mesh.error": None, "mesh.stiffness_waves": None}),
    "W-FAULT": lambda: of_case(PLANETARY, {"sun.fault": [{"kind": "missing", "tooth": 3}]}),
    "W-FILLET": lambda: of_case(PLANETARY, {"rack.root_radius": 0.26, "sun.profile_shift": None}),
    "W-FORMER": former_file,
    "W-HELIX": lambda: of_case(HELICAL, {"helical.helix_angle": "31 deg", "helical.mesh_stiffness": None}),
    "W-LOAD": lambda: of_case("gear_pair", {"operation.torque": "0 N m"}),
    "W-MATERIAL": lambda: of_case(
        PLANETARY,
        {"material.treatment": "case hardened steel", "material.hardness": 720, "material.estimated": True},
    ),
    "W-NEIGHBOURS": lambda: of_case(PLANETARY, {"set.planet_angles": CLOSE}),
    "W-OVERLAP": lambda: of_case("e_axle", {"shaft[0].part[1].outer_diameter": "40 mm"}),
    "W-PLANETS": lambda: of_case(PLANETARY, {"set.planets": 1}),
    "W-POINTS": lambda: of_case(PLANETARY, {"housing": {"form": "linear", "points": 9}}),
    "W-PROFILE": lambda: of_case(PLANETARY, {"sun.modifications": [PROFILE]}),
    "W-RATE": lambda: of_case(CHAIN, {"transient.rate": "15 kHz"}),
    "W-RECORD": lambda: of_case(CHAIN, {"transient.record": "1 kHz"}),
    "W-RELIEF-SIGN": lambda: of_case(
        PLANETARY, {"sun.modifications": [{"kind": "profile crowning", "amount": "-5 um"}]}
    ),
    "W-REVERSAL": lambda: of_stage("pair", "life", reversed_root()),
    "W-RIM": lambda: of_case(PLANETARY, {"ring.outer_radius": "85 mm"}),
    "W-SIZE": large,
    "W-SLICES": lambda: of_case(
        HELICAL, {"helical.slices": 30, "operation.speeds": {"from": "100 rpm", "to": "3000 rpm", "count": 1000}}
    ),
    "W-SMOOTHING": lambda: of_case("nrel_pgb", {"planar.smoothing": "2 um"}),
    "W-SPECTRUM": lambda: of_case(CHAIN, {"transient.resolution": "0.01 Hz"}),
    "W-SPEED": lambda: of_case(
        CHAIN,
        {
            "transient.torque": [{"load": "motor", "torque": "300 N m"}, {"load": "fan", "torque": "0 N m"}],
            "transient.rate": "100 kHz",
        },
    ),
    "W-FRICTION": lambda: of_case(
        "spur_pair",
        {
            "lubricant": {"viscosity": "20 mm^2/s", "density": "850 kg/m^3"},
            "losses": {"friction": "schlenk", "roughness": "0.4 um", "excites": True},
            "operation.speeds": ["250 rpm", "3100 rpm"],
        },
    ),
    "W-OIL": lambda: of_case("e_axle", {"lubricant.temperature": "-40 degC"}),
    "W-TEETH": lambda: read_case(CASES / "wind_turbine_drivetrain.toml").notices,
    "W-TIP": lambda: of_case(PLANETARY, {"sun.tip_diameter": None}),
    "W-TIP-THIN": lambda: of_case(PLANETARY, {"set.backlash": "1 mm"}),
    "W-TORQUE": lambda: of_case(PLANETARY, {"operation.torque": "-10 N m"}),
    "W-UNDERCUT": lambda: of_case(PLANETARY, SHARP),
    "W-UNUSED": lambda: of_case("nrel_pga"),
    "W-WIDTHS": lambda: of_case(PLANETARY, {"sun.face_width": "35 mm"}),
    "W-WEDGING": lambda: of_case(PLANETARY, {"set.pin_errors": [{"planet": 1, "tangential": "20 um"}]}),
}


def plugin(folder: Path) -> list[Finding]:
    """A package whose train has the name of one of femgear's."""
    from unittest import mock

    from femgear.trains import registry

    taken = registry.Installed("pair", "model", "swinging:FILE", "swinging:TRAIN", "swings")
    registry._tell_taken.cache_clear()
    with (
        mock.patch.object(registry, "_installed", lambda: (taken,)),
        warnings.catch_warnings(record=True) as w,
    ):
        warnings.simplefilter("always")
        registry.trains()
    registry._tell_taken.cache_clear()
    return [one.message.args[0] for one in w]


def unsteady(folder: Path) -> list[Finding]:
    """A recording whose speed is a little above what is said."""
    from recorded_signals import HEALTHY, RATE, recording, write_columns

    from femgear.measured.heard_set import heard_set
    from femgear.measured.recordings import read_by_turns
    from femgear.measured.requests import Recording

    signal, _, _ = recording(HEALTHY, HEALTHY.values(), wander=0.0, carrier=3.006, seconds=8.0)
    path = write_columns(folder / "a.csv", "time [s];acc\n", (np.arange(len(signal)) / RATE, signal))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_by_turns(path, Recording(speed="900 rpm"), heard_set(read_case(CASES / "planetary_27_40_108.toml")))
    return [warning.message.args[0] for warning in caught if isinstance(warning.message, FindingWarning)]


def model_of_a_set_on_bolts(folder: Path) -> tuple[Finding, ...]:
    """A model for other programs of a set whose ring stands on supports."""
    from femgear.run import dynamic_model

    bolt = {"angle": "0 deg", "radial_stiffness": "2e8 N/m", "tangential_stiffness": "2e8 N/m"}
    changes = {"housing.support": [bolt], "static.positions": 8, "static.flank_elements": 4, "static.stresses": False}
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), changes | {"housing.published": None})
    return told(lambda: dynamic_model(case))


def without_compiler(folder: Path) -> tuple[Finding, ...]:
    """A unit that is written where there is no C compiler."""
    from chain_model import chain_model

    from femgear.exchange.fmu import write_fmu

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", str(folder))
        return told(lambda: write_fmu(chain_model(), folder / "chain.fmu"))


def hum(folder: Path) -> tuple[Finding, ...]:
    """A recording of a set whose speed wanders, beside the hum of the mains."""
    from recorded_signals import CASE, HEALTHY, RATE, recording, write_columns

    from femgear.measured.heard_set import heard_set
    from femgear.measured.recordings import read_by_turns
    from femgear.measured.requests import Recording

    signal, pulses, _ = recording(HEALTHY, HEALTHY.values(), wander=0.02)
    time = np.arange(len(signal)) / RATE
    columns = time, signal + np.cos(2 * np.pi * 50.0 * time), pulses
    path = write_columns(folder / "hum.csv", "time [s];acc [m/s^2];tacho [V]\n", columns)
    return told(lambda: read_by_turns(path, Recording(pulses="tacho"), heard_set(read_case(CASE))))


OTHERS: dict[str, Callable[[Path], Iterable[Finding]]] = {
    "W-CLIPPING": exported("wav", acceleration_scale=1e-6),
    "W-COMPILER": without_compiler,
    "W-FOUNDATION": model_of_a_set_on_bolts,
    "W-JOURNAL": damaged_journal,
    "W-PLUGIN": plugin,
    "W-REXS": rexs,
    "W-ROWS": exported("xlsx", rows=3),
    "W-SWEEP": long_sweep,
    "W-TONE": hum,
    "W-UNSTEADY": unsteady,
}
RAISED = {
    **{code: lambda folder, way=way: way() for code, way in {**RESULTS, **OF_CASES}.items()},
    **OTHERS,
}


def test_the_table_has_a_way_to_every_code():
    assert set(RAISED) == set(CATALOGUE)


@pytest.mark.parametrize("code", CATALOGUE)
def test_every_code_reaches_the_list(code, tmp_path):
    found = [one for one in RAISED[code](tmp_path) if one.code == code]
    assert found and all(one.text for one in found)
    assert once(found) == tuple(dict.fromkeys(once(found)))
    assert from_data(json.loads(json.dumps(as_data(found)))) == once(found)


# --- marks of doubtful numbers ------------------------------------------------------------------------


def test_the_level_of_an_excitation_that_ends_early_is_a_bound(tmp_path):
    """Of the speed whose level a longer excitation raises by 3 dB; the other is known."""
    from femgear.trains.elastic.results import describe_housing

    data, finding = synthetic.housing(), Finding("W-EXCITATION", "", "ends early")
    first, second = (row[2] for row in describe_housing(data, np.array([3.0, 0.2]), [finding]).rows)
    assert first == lower_bound(float(data["level"][0])) and second == f"{float(data['level'][1]):.4g}"
    unknown = describe_housing(data, None, [finding])
    assert unknown.rows[0][2].endswith("†") and "W-EXCITATION, doubt" in unknown.notes[-1]


def test_pressures_that_no_steel_carries_are_marked_in_the_table_of_a_run():
    from femgear.findings import as_text
    from femgear.stages.static_results import describe_static

    data = static(max_pressure=5e9)
    data.attrs["findings"] = as_text(of_stage("elastic", "static", data))
    block = describe_static(data)
    cells = {row[block.header.index("p max [MPa]")] for row in block.rows}
    assert cells == {"5000.0†"} and "W-PRESSURE, fault" in block.notes[-1]


# --- the transport ------------------------------------------------------------------------------------


def test_a_finding_of_a_run_is_in_manifest_file_page_table_and_on_standard_error(tmp_path, capsys):
    """A pair whose teeth deflect by more than the model is meant for."""
    changes = {"operation.torque": "3 kN m", "static.positions": 8, "static.flank_elements": 6}
    path, out = tmp_path / "pair.toml", tmp_path / "out"
    path.write_text(case("spur_pair", changes).source, encoding="utf-8")
    assert cli.main(["run", str(path), "-o", str(out), "--only", "static"]) == 0
    printed = capsys.readouterr()
    results = open_results(out)
    (finding,) = (one for one in results.findings if one.code == "W-DEFLECTION")
    assert (finding.severity, finding.stage) == ("doubt", "static")
    assert f"warning: {finding}" in printed.err.splitlines() and "large deflections (W-DEFLECTION)" in printed.out
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["findings"] == as_data(results.findings)
    of_stages = once(one for one in results.findings if one.stage)
    assert from_data(json.loads(results.static.attrs["findings"])) == of_stages
    said = manifest["convergence"]["static"]
    assert said["converged"] is True and said["residual"] < 1e-9 and said["message"]
    assert said["findings"] == [one.code for one in of_stages]
    (solved,) = solve(results.case, only="static").values()
    assert solved.findings == of_stages and solved.converged and solved.residual == said["residual"]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert '<li class="doubt">doubt of static: [W-DEFLECTION]' in page and "Warnings: none" not in page
    assert cli.main(["report", str(out)]) == 0
    assert (out / "report.html").read_text(encoding="utf-8") == page
    capsys.readouterr()
    assert cli.main(["report", str(out), "--verbose"]) == 0 and "doubt W-DEFLECTION" in capsys.readouterr().out


def test_a_folder_of_the_former_format_says_that_its_warnings_are_not_known(tmp_path):
    from edited_manifests import edit_manifest

    folder = synthetic_run(tmp_path / "out")
    edit_manifest(folder, femgear_format=4)
    (finding,) = open_results(folder).findings
    assert "stored no warnings" in finding.text and not finding.code


def test_stresses_of_the_former_format_are_tabulated_without_reasons():
    data = synthetic.stress()
    data["iso_root_stress"] = 0.5 * data["iso_root_stress"]
    assert any("FE/ISO =" in note for note in describe_stress(data).notes)
    del data.attrs["nominal_load"], data.attrs["module"]
    later = ("root_worst_load", "root_notch_radius", "contact_worst_load", "contact_worst_curvature")
    block = describe_stress(data.drop_vars([*later, "contact_start", "relief_kink"]))
    assert len(block.rows) == 6 and not any("FE/ISO =" in note for note in block.notes)


def test_a_code_that_the_catalogue_has_no_more_is_read_as_text():
    data = [{"code": "W-GONE", "key": "a.b", "text": "words", "severity": "doubt", "stage": "static"}]
    (finding,) = from_data(data)
    assert str(finding) == "a.b: [W-GONE] words" and (finding.severity, finding.stage) == ("doubt", "static")


def test_shares_have_a_space_before_the_sign_of_per_cent():
    """ISO 80000-1, 7.1.4; no text of the package writes one otherwise."""
    assert (percent(0.216), percent(0.0155, 1), percent(0.5, signed=True)) == ("22 %", "1.6 %", "+50 %")
    assert percent(-0.081, 1, signed=True) == "-8.1 %"
    package = Path(cli.__file__).parent
    without = [
        str(path.relative_to(package))
        for path in sorted(package.rglob("*.py"))
        if "app" not in path.relative_to(package).parts and re.search(r":[^{}\"\s]*%\}", path.read_text("utf-8"))
    ]
    assert without == []
