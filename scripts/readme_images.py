#!/usr/bin/env python3
"""Run all cases and scripts, bring their pictures into docs/images, made small, and write docs/gallery.md."""

from __future__ import annotations

import io
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from script_tools import Progress, run_script

ROOT = Path(__file__).resolve().parents[1]
# most bytes, and pixels across, of a picture; its colours
LARGEST, WIDEST, COLOURS = 110_000, 960, 40
HEAD = """# Gallery

Pictures of every case and script, with the command that makes them. Made by
`scripts/readme_images.py docs`; pictures that two commands make alike stand with the first command.
"""


@dataclass(frozen=True)
class Run:
    """A command, its title, entries of its case as (old, new) text, and what its pictures say.

    Sentences by the beginning of the file name; other pictures have the captions of the case's report. ``shows``
    has the beginnings of the pictures shown, where others are of the same kind as those of another run; else all.
    """

    command: str
    title: str
    entry: tuple[str, str] | None = None
    says: dict[str, str] = field(default_factory=dict)
    case: str = ""
    shows: tuple[str, ...] = ("",)


# what a fixed housing changes most; its other pictures are of the kind of the reference set
HOUSING = ("modulation_3100", "order_cuts", "order_spectrum_3100", "waterfall")

# casing of the electric axle, sensors and a run-up
AXLE_ON_FEET = """[gravity]

[casing]
mass = "22 kg"
centre = ["40 mm", "0 mm", "80 mm"]
inertia = ["0.3 kg m^2", "0.4 kg m^2", "0.35 kg m^2"]

[[casing.foot]]
name = "left front"
position = ["-80 mm", "-100 mm", "0 mm"]
stiffness = ["1e8 N/m", "2e8 N/m", "1e8 N/m"]

[[casing.foot]]
name = "right front"
position = ["160 mm", "-100 mm", "0 mm"]
stiffness = ["1e8 N/m", "2e8 N/m", "1e8 N/m"]

[[casing.foot]]
name = "left back"
position = ["-80 mm", "-100 mm", "180 mm"]
stiffness = ["1e8 N/m", "2e8 N/m", "1e8 N/m"]

[[casing.foot]]
name = "right back"
position = ["160 mm", "-100 mm", "180 mm"]
stiffness = ["1e8 N/m", "2e8 N/m", "1e8 N/m"]

[[sensor]]
name = "top"
position = ["40 mm", "80 mm", "90 mm"]
direction = "y"

[[sensor]]
name = "side"
position = ["-80 mm", "0 mm", "90 mm"]
direction = "x"

[runup]
from = "2000 rpm"
to = "12000 rpm"
count = 100
"""


def _case(name: str, title: str, shows: tuple[str, ...] = ("",)) -> Run:
    return Run(f"femgear run cases/{name}.toml", title, shows=shows)


def _script(command: str, title: str, **says: str) -> Run:
    return Run(f"scripts/{command}", title, says=says)


RUNS = {
    "planetary_27_40_108": _case("planetary_27_40_108", "Reference set 27/40/108, elastic ring"),
    "on_six_bolts": _case("on_six_bolts", "Reference set on six bolts, two named sensors", HOUSING[:-1]),
    "cracked_planet": Run(
        "femgear run cases/cracked_planet.toml --only static",
        "Reference set with a cracked planet, contact of its teeth",
        shows=("load_sharing", "static_transmission_error"),
    ),
    "faults": Run(
        "femgear faults cases/planetary_27_40_108.toml --tolerances cases/tolerances/still.toml --limits 3 --seed 7",
        "Reference set, sizes from which on faults stand out",
        says={"limits": "Level by which faults of sun, planet and ring stand out of healthy sets, over their size"},
    ),
    "in_a_casing": _case("in_a_casing", "Reference set in a casing of a file", HOUSING),
    "misaligned": Run(
        "femgear run cases/planetary_27_40_108.toml --only stress",
        "Misaligned and crowned sun, 25 slices",
        entry=(
            "[static]\n",
            '[[sun.modifications]]\nkind = "lead slope"\namount = "10 um"\n\n'
            '[[sun.modifications]]\nkind = "lead crowning"\namount = "5 um"\n\n[static]\nslices = 25\n',
        ),
    ),
    "helical_23_24_73": Run(
        "femgear run cases/helical_23_24_73.toml --only static", "Helical set with an elastic ring, 25 slices"
    ),
    "modulation_paper": _case("modulation_paper", "Set of the modulation paper"),
    "helical_30_20_70": _case("helical_30_20_70", "Helical set 30/20/70"),
    "helical_slices": Run(
        "femgear run cases/helical_30_20_70.toml",
        "Helical set in eight slices",
        entry=("slices = 1 ", "slices = 8 "),
    ),
    "nrel_pgb": _case("nrel_pgb", "Wind turbine set B, rigid bodies"),
    "nrel_pgb_static": _case("nrel_pgb_static", "Wind turbine set B with computed mesh stiffness"),
    "nrel_pga": _case("nrel_pga", "Wind turbine set A, rigid bodies"),
    "wind_turbine_drivetrain": _case(
        "wind_turbine_drivetrain",
        "Wind turbine drivetrain",
        ("campbell", "mesh_force_spectrum", "side_bands", "transient"),
    ),
    "grc_like_drivetrain": _case(
        "grc_like_drivetrain",
        "Drivetrain like that of the gearbox collaborative",
        ("campbell", "mesh_force_spectrum", "side_bands", "transient_forces", "transient_speeds"),
    ),
    "own_chain": _case(
        "own_chain", "A drivetrain to start from", ("campbell", "mesh_force_spectrum", "transient_forces")
    ),
    "e_axle": _case("e_axle", "Electric axle: shafts, bearings and two stages"),
    "e_axle_on_feet": Run(
        "femgear run cases/e_axle.toml",
        "Electric axle on feet, over the speed",
        entry=("[gravity]\n", AXLE_ON_FEET),
        shows=("run_up_levels",),
    ),
    "e_axle_in_a_casing": _case("e_axle_in_a_casing", "Electric axle in an elastic casing", ("mode_energy",)),
    "e_axle_casing": _script(
        "e_axle_casing.py",
        "Casing of the electric axle",
        casing="Casing of the axle, seen through, with the surfaces that are tied to its nodes.",
    ),
    "stepped_e_axle": _case(
        "stepped_e_axle", "Electric axle with stepped planets", ("sensor_spectra", "load_patterns")
    ),
    "robot_reducer": _case("robot_reducer", "Robot reducer with two rings", ("sensor_spectra",)),
    "ravigneaux_set": _case("ravigneaux_set", "Ravigneaux set in its second gear", ("sensor_spectra",)),
    "planet_carrier": _case("planet_carrier", "Planetary stage with an elastic carrier", ("mode_energy",)),
    "five_megawatt_chain": _case(
        "five_megawatt_chain", "Chain of a five-megawatt wind turbine", ("deflected_shafts", "mode_energy")
    ),
    "four_stage_reducer": _case(
        "four_stage_reducer", "Four planetary stages in series", ("campbell", "stage_energy", "stage_forces")
    ),
    "published_four_stages": _case("published_four_stages", "Four published stages in series", ("stage_energy",)),
    "spur_pair": _case("spur_pair", "Spur gear pair from its teeth"),
    "gear_pair": _case("gear_pair", "Gear pair with backlash"),
    "gear_pair_light": _case("gear_pair_light", "Lightly loaded gear pair"),
    "samples": Run(
        "femgear samples cases/planetary_27_40_108.toml --tolerances cases/tolerances/3um.toml -n 10000",
        "As-built samples",
        says={"samples": "STE over the largest share of a planet, and the distribution of both."},
    ),
    "mesh_stiffness": _script(
        "mesh_stiffness.py",
        "Mesh stiffness",
        mesh_stiffness="Transmission error and tangent stiffness of all meshes over the mesh period.",
    ),
    "load_sharing": _script(
        "load_sharing.py",
        "Load sharing",
        load_sharing="Shares of the planets where one of them has a gap, and the load sharing factor.",
        tooth_loads="Load of the tooth pairs of the planet with the gap and of its neighbour, along the path.",
    ),
    "harris_map": Run(
        "femgear harris cases/planetary_27_40_108.toml",
        "Harris map",
        says={"harris_map": "Transmission error over torque: every tip relief has a torque at which it is best."},
    ),
    "tip_relief_design": Run(
        "femgear relief cases/planetary_27_40_108.toml",
        "Design of the tip relief",
        says={"tip_relief": "Transmission error over amount and length of the relief, the best one marked."},
    ),
    "lead_design": _script(
        "lead_design.py",
        "Design of the crowning",
        lead_design="Face load factor and transmission error over misalignment and torque for three leads.",
    ),
    "pin_error_load_sharing": _script(
        "pin_error_load_sharing.py",
        "Pin errors",
        load_sharing="Distribution of the load sharing factor: a floating sun takes most errors up.",
    ),
    "optimise": Run(
        "femgear optimise cases/planetary_27_40_108.toml",
        "Optimised tip relief",
        says={
            "optimum": "Transmission error and mesh force before and after, and the course of the search.",
            "tolerances": "What the tolerances of the entries found do to the objective.",
        },
    ),
    "housing_modulation": _script(
        "housing_modulation.py",
        "Modulation of the housing",
        order_spectrum="Orders around the mesh harmonic: the ring's field splits them, windows do not.",
        envelope="Acceleration of a fixed point and its envelope: six lobes, three by the Hanning model.",
        modulation="The same envelopes around the ring over the angle of the carrier.",
    ),
    "side_bands": _script(
        "side_bands.py --ring 70 --sun 30 --planet 20 --angle 0 --angle 86.4 --angle 180 --angle 266.4 "
        "--spectrum cases/spectra/lines_30_70.csv",
        "Which side bands are normal",
        side_bands="Array factor around mesh harmonics, and what is measured there.",
    ),
    "gyroscopic": _script(
        "gyroscopic.py",
        "Gyroscopic and convective terms",
        gyroscopic="Change of the natural frequencies with the carrier speed, and what is heard on the ring.",
    ),
    "planet_phasing": _script(
        "planet_phasing.py",
        "Planet phasing",
        phases="Phases of sun and ring meshes at every planet, and what is left of their forces.",
        resultants="Resultants and kinds of modes that every harmonic excites, for four sets.",
        mesh_forces="Mesh forces of Kahraman's train over the frequency of every harmonic.",
    ),
    "campbell": _script(
        "campbell.py",
        "Campbell diagram of a wind turbine set",
        campbell="Natural frequencies of set B over the carrier speed, and critical speeds.",
    ),
    "gravity_wedging": _script(
        "gravity_wedging.py",
        "Tooth wedging by weight",
        gravity_wedging="Carrier over the frequency of its weight for three plays; dashed: not stable.",
        carrier_orbit="Path of the carrier's centre at the peak.",
        planet_bearings="Planet bearing forces at the peak over one turn of the weight.",
        tooth_contact="Share of the cycle in which both flanks touch: where back flanks do, teeth wedge.",
    ),
    "bearing_clearance": _script(
        "bearing_clearance.py",
        "Clearance of the carrier bearing",
        ring_resonance="Resonance of the ring: its peak moves down with the clearance.",
        tooth_contact="Contact of both flanks over frequency and clearance: above the line teeth wedge.",
    ),
    "stiff_surroundings": _script(
        "stiff_surroundings.py",
        "What do bearings and casing change?",
        stiff_surroundings="Levels of the electric axle with bearings, shafts, planets, casing and feet made stiff "
        "in turn.",
    ),
    "bearing_stiffness": _script(
        "bearing_stiffness.py",
        "Stiffness of rolling bearings",
        bearing_stiffness="Clearance moves the shaft; preload stiffens two rows once all balls carry.",
    ),
    "impacts": _script(
        "impacts.py",
        "Impacts and chaos",
        damping="Amplitude and mean for two damping ratios; dashed: not stable.",
        tooth_error="Amplitude and mean for three tooth errors; dashed: not stable.",
        contact_states="Contact states by harmonic balance and by sweeps in time.",
        chaos="Deflection once a period and the largest Lyapunov exponent: chaos where it is positive.",
        sections="Stroboscopic sections at three ratios.",
        eccentricity="Mesh force of a set with an eccentric sun: a floating sun keeps the teeth in contact.",
        sun_path="Path of the sun's centre, held and floating.",
        spectrum="Lines of the mesh force: side bands of the sun's turn about every mesh harmonic.",
    ),
    "multistage_published": _script(
        "multistage.py",
        "Readings of a published table",
        published="Natural frequencies of eight readings of the table beside the printed range.",
    ),
    "drivetrain": Run(
        "scripts/drivetrain.py --balanced",
        "Wind turbine drivetrain at constant speed",
        says={
            "backlash": "A mesh that parts, around its first separation; made linear, it pulls.",
            "sensitivity": "Lines at half and twice each assumed input.",
        },
        case="cases/wind_turbine_drivetrain.toml",
    ),
}


def main(
    docs: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/gallery"),
    only: Annotated[tuple[str, ...], Parameter(negative="", consume_multiple=True)] = (),
    keep: bool = False,
) -> None:
    """Write images/ and gallery.md, which README and docs show, each picture in few colours.

    Parameters
    ----------
    docs
        Folder of both; pictures there that no run makes any more are removed.
    output
        Folder of the results, one folder a run.
    only
        Names of the runs; the others stay on the page as they are.
    keep
        Take the pictures of runs that are there, without computing them again.
    """
    from femgear.errors import CaseError
    from femgear.storage.files import write_bytes, write_text

    if unknown := set(only) - set(RUNS):
        raise CaseError(f"no run {', '.join(sorted(unknown))}", code="E-CHOICE", key="--only", limit=", ".join(RUNS))
    page, images = docs / "gallery.md", docs / "images"
    sections = _sections(page)
    with Progress() as progress:
        for name in only or RUNS:
            progress(name)
            if not (keep and _pictures(output / name)):
                _compute(RUNS[name], output / name)
            progress(name, 1)
    shown = {path.read_bytes(): path for path in sorted(images.glob("*/*.png"))}
    shown = {data: path for data, path in shown.items() if path.parent.name not in (only or RUNS)}
    for name in only or RUNS:
        place, pictures = images / name, []
        place.mkdir(parents=True, exist_ok=True)
        for source in _pictures(output / name):
            if not source.name.startswith(RUNS[name].shows):
                continue
            data = small(source)
            if data in shown:
                continue
            shown[data] = place / source.name
            write_bytes(data, place / source.name)
            pictures.append((source.stem, f"images/{name}/{source.name}"))
        _remove(place, {Path(link).name for _, link in pictures})
        sections[RUNS[name].title] = _section(RUNS[name], output / name, pictures)
    texts = [sections[run.title] for run in RUNS.values() if run.title in sections]
    write_text("\n".join([HEAD, *texts]), page)
    print(f"{len(shown)} pictures, {sum(map(len, shown)) / 1e6:.2f} MB, in {images}")


def _sections(page: Path) -> dict[str, str]:
    """Sections of the page as it is, by their titles."""
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    parts = [part for part in re.split(r"(?m)^## ", text)[1:]]
    return {part.split("\n", 1)[0]: f"## {part.rstrip()}\n" for part in parts}


def _pictures(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.png"))


def _remove(folder: Path, kept: set[str]) -> None:
    """Remove pictures that no run makes any more."""
    for path in folder.glob("*.png"):
        if path.name not in kept:
            path.unlink()
    if not any(folder.iterdir()):
        folder.rmdir()


def _compute(run: Run, folder: Path) -> None:
    """Run a command as its own process; its messages are shown where it fails."""
    from femgear.errors import FemgearError

    first, *words = shlex.split(run.command)
    start = ["-m", "femgear.cli"] if first == "femgear" else [str(ROOT / first)]
    words = [str(ROOT / word) if word.startswith("cases/") else word for word in words]
    folder.parent.mkdir(parents=True, exist_ok=True)
    if run.entry is not None:
        case = folder.with_suffix(".toml")
        case.write_text(Path(words[1]).read_text(encoding="utf-8").replace(*run.entry), encoding="utf-8")
        words[1] = str(case)
    if words[:1] == ["run"]:
        words.append("--force")
    done = subprocess.run(
        [sys.executable, *start, *words, "-o", str(folder)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise FemgearError(f"{run.command} ended with {done.returncode}:\n{done.stderr}", code="E-OUTPUT")


def small(source: Path) -> bytes:
    """A picture as PNG of few colours."""
    from PIL import Image

    from femgear.errors import StorageError

    with Image.open(source) as picture:
        picture = picture.convert("RGB")
    if picture.width > WIDEST:
        size = (WIDEST, round(picture.height * WIDEST / picture.width))
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    stream, plain = io.BytesIO(), Image.Dither.NONE
    # colours far apart: those that are most frequent would be shades of grey alone
    few = picture.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, kmeans=2, dither=plain)
    few.save(stream, "png", optimize=True)
    if len(data := stream.getvalue()) <= LARGEST:
        return data
    raise StorageError(f"{source.name} takes {len(data)} bytes", code="E-RANGE", limit=f"{LARGEST} bytes")


def _section(run: Run, folder: Path, pictures: list[tuple[str, str]]) -> str:
    """The part of the page that shows a run."""
    lines = [f"## {run.title}", ""]
    if run.entry is not None:
        old, new = (text.strip() for text in run.entry)
        lines += [f"In the case file `{old}` becomes", "", "```toml", new, "```", ""]
    lines += [f"`{run.command} -o out/{folder.name}`", ""]
    for stem, link in pictures:
        words = _sentence(run, stem)
        # the text of a picture names it; what it shows stands below, for all readers
        lines += [f"![{run.title}: {stem.replace('_', ' ')}]({link})", "", f"*{words}*", ""]
    if not pictures:
        lines += ["Its pictures stand above.", ""]
    return "\n".join(lines)


def _sentence(run: Run, stem: str) -> str:
    """What a picture shows: as it stands above, else the first sentence of its caption in a report."""
    from femgear.report.page import caption_of
    from femgear.trains.reading import read_case
    from femgear.trains.registry import train_of

    words = next((words for start, words in run.says.items() if stem.startswith(start)), "")
    if not words:
        case = run.case or next(word for word in run.command.split() if word.startswith("cases/"))
        words = caption_of(train_of(read_case(ROOT / case)), stem)[2]
    return re.split(r"(?<=[^.]\.) (?=[A-Z])", words)[0].rstrip(".") + "."


if __name__ == "__main__":
    sys.exit(run_script(main))
