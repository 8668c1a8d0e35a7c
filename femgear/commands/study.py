"""Commands that compute many changed cases: sweeps, as-built samples, and searches."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from femgear.commands.files import need_new_files, write_case_file
from femgear.commands.program import Quantity, Tasks, Whole, app, examples
from femgear.commands.terminal import Progress, print_blocks, say
from femgear.errors import CaseError


@app.command(
    name="sweep",
    help_epilogue=examples(
        'femgear sweep planetary.toml --over "operation.torque=50 N m,100 N m" -o sweep',
        'femgear sweep planetary.toml -o widths --of "root stress sun" --of ste \\',
        '  --over "set.face_width=20 mm..40 mm/5"',
    ),
)
def compute_sweep(
    case: Path,
    /,
    *,
    over: Annotated[tuple[str, ...], Parameter(negative="")],
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    of: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    speeds: tuple[str, str] | None = None,
    tasks: Tasks | None = None,
) -> int:
    """Compute quantities over values of entries of a case; goes on where it was interrupted.

    Parameters
    ----------
    case
        TOML case file.
    over
        As "operation.torque=50 N m,100 N m" or "sun.modifications[0].amount=0 um..12 um/7"; entries that go
        together as "sun.teeth,planet.teeth,ring.teeth=27/40/108,30/40/111". May be repeated.
    output
        Folder of sweep.csv, sweep.png and the journal sweep.jsonl.
    of
        Quantities as in docs/optimise.md: ste, ste overall, mesh force, housing, ...; of gearboxes K_Hbeta, STE,
        bearing life, level, ... of the whole or of one part; of pairs STE, root life, losses, .... May be repeated.
        Default: transmission errors; of gearboxes and pairs all that stand for the whole.
    speeds
        First and last speed of the input, for mesh forces and the housing; of gearboxes those of the run-up.
    """
    from femgear.run import grid_cache
    from femgear.study.objectives import default_quantities, need_quantities
    from femgear.study.runner import open_runner
    from femgear.study.sweep import describe_sweep, sweep_into
    from femgear.trains.reading import read_case

    data = read_case(case)
    need_quantities(data)
    of = of or default_quantities(data)
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        options = {"speeds": speeds, "cache": grid_cache(), "progress": progress, "runner": runner}
        swept, names = sweep_into(data, output, over=over, of=of, **options)
    failed = sum(bool(error) for error in swept.errors)
    print_blocks([describe_sweep(swept)])
    cases = f"{len(swept.points)} case{'s' * (len(swept.points) != 1)}"
    print(f"{cases}, {swept.computed} computed now, {failed} cannot be computed")
    say(f"files in {output}: {', '.join(names)}")
    return 0


@Parameter(name="*")
@dataclass(frozen=True)
class DrawnSamples:
    """Samples that a command draws.

    Parameters
    ----------
    number
        Number of samples. Default: 1000; 100 of gearboxes and pairs, each of which is solved as a run solves it.
    seed
        Seed of the random numbers. Sample i of a seed is the same whatever the number of samples.
    index
        Write this sample as a case file, sample_INDEX.toml, and compute none.
    of
        Of gearboxes: key figures as in femgear sweep; may be repeated. Default: all figures of the whole gearbox.
    speeds
        Of gearboxes: first and last speed of the run-up.
    """

    number: Annotated[int | None, Parameter(name=("--number", "-n"))] = None
    seed: Whole = 1
    index: int | None = None
    of: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    speeds: tuple[str, str] | None = None


@app.command
def samples(
    case: Path,
    /,
    *,
    tolerances: Path,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    positions: Whole | None = None,
    method: Literal["spring", "exact"] | None = None,
    force: bool = False,
    drawn: DrawnSamples | None = None,
    tasks: Tasks | None = None,
) -> int:
    """Compute as-built sets over tolerances of teeth and pins, or as-built gearboxes over those of their entries.

    Parameters
    ----------
    case
        TOML case file.
    tolerances
        TOML file of the distributions of errors, as in docs/samples.md.
    output
        Folder of samples.nc, samples.png and worst.toml; of gearboxes samples.csv and percentiles.csv in place of
        the first.
    positions
        Of sets: equidistant ones of one mesh period; those of the peaks of the set and its end come beside them.
        Default: 16.
    method
        Tooth pairs as springs, whose error is stated, or the whole contact problem. Default: springs, but for
        helical teeth, back flanks and bearings with clearance, which have none.
    force
        Of sets: replace the results that the folder holds, once the new ones are computed.
    """
    from femgear.run import grid_cache
    from femgear.storage.files import own_files, write_text
    from femgear.study.objectives import has_figures
    from femgear.study.runner import open_runner
    from femgear.study.sample_results import samples_into
    from femgear.study.samples import checked, prepared, sample_case
    from femgear.trains.reading import read_case, to_toml

    drawn = drawn or DrawnSamples()
    checked(1 if drawn.number is None else drawn.number, "--number", 1)
    checked(drawn.seed, "--seed", 0, 2**32)
    checked(drawn.index or 0, "--index", 0)
    data = read_case(case)
    if has_figures(data):
        others = {"positions": positions, "method": method, "force": force or None}
        return _samples_of_entries(data, output, tolerances, drawn, tasks, others)
    _refuse_options({"of": drawn.of or None, "speeds": drawn.speeds}, "gearboxes", "leave it out")
    number, seed, index = drawn.number or 1000, drawn.seed, drawn.index
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        progress("curves of tooth pairs")
        basis = prepared(data, tolerances, positions=positions or 16, cache=grid_cache())
        progress("curves of tooth pairs", 1.0)
        if index is None:
            options = {"count": number, "seed": seed, "exact": None if method is None else method == "exact"}
            blocks, names = samples_into(data, output, basis, force=force, **options, progress=progress, runner=runner)
        else:
            blocks, names = [], [f"sample_{index}.toml"]
            own_files(output, names)
            write_text(to_toml(sample_case(data, basis[0], seed, index)), output / names[0])
    if blocks:
        print_blocks(blocks)
    say(f"files in {output}: {', '.join(names)}")
    return 0


def _refuse_options(options: Mapping[str, Any], of: str, remedy: str) -> None:
    """Refuse (E-ARGUMENTS) options that are given, and that other cases alone have."""
    for name, value in options.items():
        if value is not None:
            message = f"an option of samples of {of}"
            raise CaseError(message, code="E-ARGUMENTS", key=f"--{name}", value=value, remedy=remedy)


def _samples_of_entries(
    data: Any,
    output: Path,
    tolerances: Path,
    drawn: DrawnSamples,
    tasks: Tasks | None,
    others: Mapping[str, Any],
) -> int:
    """Compute samples of a gearbox, tabulate them and name the files; ``others`` are options that it has not."""
    from femgear.run import grid_cache
    from femgear.study.entry_samples import ENTRY_SAMPLES, EntryRequest, entry_samples_into
    from femgear.study.runner import open_runner

    _refuse_options(others, "planetary sets", "leave it out: samples of others are solved as femgear run does")
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:
        count = ENTRY_SAMPLES if drawn.number is None else drawn.number
        request = EntryRequest(drawn.of, drawn.speeds, count, drawn.seed, drawn.index)
        options = {"cache": grid_cache(), "progress": progress, "runner": runner}
        blocks, names = entry_samples_into(data, output, tolerances, request, **options)
    if blocks:
        print_blocks(blocks)
    say(f"files in {output}: {', '.join(names)}")
    return 0


@Parameter(name="*")
@dataclass(frozen=True)
class Search:
    """How far a search goes.

    Parameters
    ----------
    method
        Method of the search; auto takes derivatives where the problem has them.
    positions
        Positions over one mesh period in the search; the refinement takes those of the case, the check 128.
    flank_elements
        Elements along a flank in the search; the refinement takes those of the case, the check 32.
    samples
        Random designs before the descents. Default: five a variable.
    max_designs
        Designs after which search and refinement end.
    seed
        Seed of the random designs.
    check
        Run case and optimum anew into the folders before and after.
    """

    method: Literal["auto", "minimax", "global", "simplex", "powell"] = "auto"
    positions: Whole = 24
    flank_elements: Whole = 12
    samples: Whole | None = None
    max_designs: Whole | None = None
    seed: Whole = 0
    check: bool = True


@Parameter(name="*")
@dataclass(frozen=True)
class Sought:
    """What is searched.

    Parameters
    ----------
    vary
        Entries to vary, as "sun.modifications[0].amount=0 um..15 um +- 1 um" with a tolerance, or "KEY1,KEY2=0 um..15
        um" for entries with one value; may be repeated. Default: amount and start of one more tip relief on every
        loaded flank; gearboxes have no default.
    shape
        Shape of the reliefs; a linear one begins with a kink, under which the contact pressure rises (W-KINK).
    goal
        What to minimise: ste (largest of the next three), ste overall, ste sun-planet, ste planet-ring, mesh
        force, peak mesh force, housing, contact pressure, root stress sun (planet, ring), contact ratio
        sun-planet (planet-ring), tip thickness sun (planet, ring); of gearboxes K_Hbeta, STE, level, ... of the
        whole or of one part, as in "level top".
    limit
        Limit on one of these quantities, as "root stress sun <= 300 MPa"; may be repeated.
    of
        Further quantities to report; may be repeated. Default: transmission errors, mesh forces, housing.
    second
        Second goal: the Pareto front of both is searched as well.
    torque
        Torque on the input. Default: that of the case.
    speeds
        First and last speed of the input, for mesh forces and the housing, by default 1000 and 3500 rpm; of
        gearboxes those of the run-up, by default as in the case.
    """

    vary: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    shape: Literal["linear", "parabolic"] = "parabolic"
    goal: str = "ste"
    limit: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    of: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    second: str | None = None
    torque: Quantity | None = None
    speeds: tuple[str, str] | None = None


@app.command(
    help_epilogue=examples(
        "# the tip relief with the least transmission error",
        "femgear optimise planetary.toml -o optimum",
        "# the one with the least mesh force, at another torque",
        'femgear optimise planetary.toml -o calm --goal "mesh force" --torque "150 N m"',
    )
)
def optimise(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    sought: Sought | None = None,
    search: Search | None = None,
    tasks: Tasks | None = None,
) -> int:
    """Find the best values of some entries, checked by runs; goes on where it was interrupted.

    Search with few positions on a coarse grid, refinement with those of the case, check on a finer one. The
    optimum is written as a case file.

    Parameters
    ----------
    case
        TOML case file.
    output
        Folder of optimum.toml, tables, figures and journals.
    """
    from femgear.run import grid_cache
    from femgear.study.optimise import SearchEffort, SearchRequest, optimise_into
    from femgear.study.runner import open_runner
    from femgear.trains.reading import read_case

    request, effort = SearchRequest(**vars(sought or Sought())), SearchEffort(**vars(search or Search()))
    data = read_case(case)
    with open_runner(**vars(tasks or Tasks())) as runner, Progress() as progress:

        def tell(blocks) -> None:
            with progress.aside():
                print_blocks(blocks)
                sys.stdout.flush()

        names = optimise_into(
            data,
            output,
            request,
            effort,
            lambda changed, folder, stage: _run_into(changed, folder, stage, progress),
            cache=grid_cache(),
            progress=progress,
            runner=runner,
            tell=tell,
        )
    say(f"files in {output}: {', '.join(names)}")
    return 0


def _run_into(case: Any, folder: Path, only: str, progress: Progress) -> Any:
    """Run a case into a folder up to a stage, over its former results, and open the new ones."""
    from femgear.run import run_case
    from femgear.storage.results import run_folder
    from femgear.trains.reading import open_results

    with run_folder(folder, force=True) as place:
        run_case(case, place, only=only, pictures=False, progress=progress)
    return open_results(folder, partial=False)


@app.command
def relief(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    torque: Quantity | None = None,
    also: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    largest: str | None = None,
    shape: Literal["linear", "parabolic"] = "parabolic",
    points: Whole = 7,
    positions: Whole | None = None,
) -> int:
    """Find the tip relief of sun and planets, or of a pair, with the least transmission error at one torque.

    Amount and length are searched over a map, which is drawn, and from its best point on. The relief is
    written as a case file, with the numbers that a run of it finds. Goes on where it was interrupted.

    Parameters
    ----------
    case
        TOML case file of a planetary set or a pair; the relief adds to its modifications.
    output
        Folder of relief.toml, tip_relief.csv, tip_relief.png and the journal.
    torque
        Torque on the input, to design for. Default: that of the case.
    also
        Further torques with a map each; may be repeated. Default: half and one and a half times the first.
    largest
        Largest amount searched. Default: twice the mean deflection of the sun-planet meshes.
    shape
        Shape of the relief; a linear one begins with a kink, under which the contact pressure rises (W-KINK).
    points
        Points of the map along each parameter.
    positions
        Positions over one mesh period. Default: those of the case.
    """
    from femgear.run import grid_cache
    from femgear.study.tip_relief import ReliefRequest, relief_into
    from femgear.trains.reading import read_case

    request = ReliefRequest(torque, also, largest, shape, points, positions)
    data = read_case(case)
    with Progress() as progress:
        blocks, names = relief_into(data, output, request, cache=grid_cache(), progress=progress)
    print_blocks(blocks)
    say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command(name="wear")
def compute_wear(
    case: Path,
    /,
    *,
    hours: float,
    coefficient: float,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    steps: Whole = 4,
    speed: Quantity | None = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Wear the loaded flanks by hours of running, in steps of which each has the loads of the flanks that are left.

    Archard's law on the loads of the teeth. The case with the worn flanks is written, as faults of the kind wear, and
    how half of the steps change the depths. As in: femgear wear set.toml --hours 1000 --coefficient 1e-18 -o worn.toml

    Parameters
    ----------
    case
        TOML case file of a planetary set, a pair, or a gearbox: of that the load case that it names first.
    hours
        Of running [h].
    coefficient
        Wear coefficient [m^2/N]: volume over load and sliding distance, 1e-18 to 1e-16 of lubricated steel.
    output
        Case file to write, in the folder of the case if that names other files.
    steps
        In which the hours are taken.
    speed
        Of the input, as "3000 rpm"; a gearbox has that of its load case. Default: the first of the case.
    force
        Replace the file.
    """
    from femgear.run import grid_cache
    from femgear.study.wear import WearRequest, describe_wear, wear_of_case, worn_text
    from femgear.trains.reading import read_case

    need_new_files([output], force=force)
    request = WearRequest(hours, coefficient, steps, speed)
    data = read_case(case)
    with Progress() as progress:
        worn = wear_of_case(data, request, cache=grid_cache(), progress=progress)
    print_blocks([describe_wear(worn, request)])
    text, kept = worn_text(case, output, worn)
    if not kept:
        say("comments are left out: tables of the case stand within braces, or in files that the output has not")
    write_case_file(text, output, force=force)
    say(f"next:    femgear run {shlex.quote(str(output))}")
    return 0


@app.command
def harris(
    case: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    relief: Annotated[tuple[str, ...], Parameter(negative="")] = ("0 um", "2 um", "4 um", "6 um", "8 um"),
    length: float = 1.0,
    shape: Literal["linear", "parabolic"] = "parabolic",
    torque: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    positions: Whole | None = None,
) -> int:
    """Compute the transmission error over torque for several tip reliefs (Harris map).

    Goes on where it was interrupted.

    Parameters
    ----------
    case
        TOML case file of a planetary set or a pair; the reliefs add to its modifications.
    output
        Folder of harris_map.csv, harris_map.png and the journal.
    relief
        Tip relief of sun and planets (sun side), such as "4 um"; may be repeated.
    length
        Length of the reliefs, in lengths of two-pair contact: 1 starts at the ends of single-pair contact.
    shape
        Shape of the reliefs; a linear one begins with a kink, under which the contact pressure rises (W-KINK).
    torque
        Torque on the input; may be repeated. Default: 11 torques from a tenth to twice that of the case.
    positions
        Positions over one mesh period. Default: those of the case.
    """
    from femgear.run import grid_cache
    from femgear.study.harris import HarrisRequest, harris_into
    from femgear.trains.reading import read_case

    request = HarrisRequest(relief, length, shape, torque, positions)
    data = read_case(case)
    with Progress() as progress:
        blocks, names = harris_into(data, output, request, cache=grid_cache(), progress=progress)
    print_blocks(blocks)
    say(f"files in {output}: {', '.join(names)}")
    return 0
