"""Commands that write cases: from a few numbers, for a ratio, as a gearbox, with a casing."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from femgear.commands.files import write_case_file
from femgear.commands.program import Quantity, Whole, app, examples, whole_number
from femgear.commands.terminal import Progress, print_blocks, print_warnings, say, says_when_long, warning_lines
from femgear.study.teeth_request import TeethStrength, WantedTeeth


@Parameter(name="*")
@dataclass(frozen=True)
class ToothOptions:
    """What is known of the teeth.

    Parameters
    ----------
    teeth
        Tooth numbers of sun, planet and ring, or of both gears; of the last four kinds as in docs/planets.md.
    shifts
        Profile shifts of sun and planet, perhaps of the ring (positive outwards), or of both gears. Default:
        none where the teeth close without, else shared by equal sliding.
    centre_distance
        Centre distance. Default: the one at which the shifts close the gears.
    helix
        Helix angle of planetary sets, pairs, gearboxes and helical cases. Default: 0 deg, of helical cases 20 deg.
    addendum
        Addendum of the basic rack, in modules. Default: 1, or a value with fewer warnings.
    """

    teeth: Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative="")] = ()
    shifts: Annotated[tuple[float, ...], Parameter(consume_multiple=True, negative="")] = ()
    centre_distance: Quantity | None = None
    helix: Quantity | None = None
    addendum: float | None = None


@app.command(
    help_epilogue=examples(
        'femgear new planetary -o set.toml --teeth 17 37 91 --torque "200 N m"',
        'femgear new pair -o pair.toml --teeth 17 40 --module "3 mm"',
    )
)
@says_when_long("case")
def new(
    kind: str,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    module: Quantity | None = None,
    torque: Quantity | None = None,
    speed: Quantity | None = None,
    planets: Whole | None = None,
    face_width: Quantity | None = None,
    form: ToothOptions | None = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write a commented case from a few numbers; masses, inertias and stiffnesses are estimated.

    Parameters
    ----------
    kind
        planetary, pair, planar, helical, drivetrain, gearbox; with other planets stepped, double, ravigneaux, wolfrom.
    output
        Case file to write. Default: KIND.toml.
    module
        Module, of helical teeth the normal one. Default: 2 mm.
    torque
        Torque on sun or pinion. Default: the one that gives a K factor of 1 N/mm^2.
    speed
        Speed of sun or pinion. Default: 1000 rpm.
    planets
        Number of planets. Default: three where equal spacing and room allow, else four or five.
    face_width
        Face width. Default: twelve modules.
    force
        Replace the file.
    """
    from femgear.trains.drafts import ToothForm, new_case

    form = form or ToothOptions()
    count = tuple(whole_number(text_of_count, "--teeth") for text_of_count in form.teeth)
    numbers: dict[str, Any] = {"teeth": count, "module": module, "torque": torque, "speed": speed}
    teeth_as = ToothForm(form.shifts, form.centre_distance, form.helix, form.addendum)
    text = new_case(kind, **numbers, planets=planets, face_width=face_width, form=teeth_as)
    output = output or Path(f"{kind}.toml")
    write_case_file(text, output, force=force)
    for line in takewhile(lambda line_there: line_there.startswith("#"), text.splitlines()):
        say(f" {line[1:]}")
    say(f"next:    femgear run {shlex.quote(str(output))}")
    return 0


@app.command
def teeth(
    *,
    ratio: float,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    wanted: Annotated[WantedTeeth | None, Parameter(name="*", negative="")] = None,
    strength: Annotated[TeethStrength | None, Parameter(name="*")] = None,
) -> int:
    """Find tooth numbers for a ratio: all that assemble, by size, with phasing, hunting teeth and transmission error.

    Parameters
    ----------
    ratio
        Speed of the driving member over that of the driven one: gear 1 over gear 2, sun over carrier.
    output
        Folder of teeth.csv, teeth.png and the case files of the best.
    """
    from femgear.run import grid_cache
    from femgear.study.teeth import teeth_into

    request = wanted or WantedTeeth(), strength or TeethStrength()
    with Progress() as progress:
        blocks, names = teeth_into(output, ratio, *request, cache=grid_cache(), progress=progress)
    print_blocks(blocks)
    say(f"files in {output}: {', '.join(names)}")
    return 0


@app.command
@says_when_long("gearbox")
def gearbox(
    case: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write a planetary set or a pair as a gearbox of one stage; name what a gearbox cannot hold.

    Its members are bodies on springs. Shafts, rolling bearings, a casing and more stages can be added to the file. A
    file of a former model (multistage, drivetrain) is written with the entries of today.

    Parameters
    ----------
    case
        TOML case file of a set, with or without the sections planar and helical, of a pair, or of a former model.
    output
        Case file to write. Default: NAME_gearbox.toml.
    force
        Replace the file.
    """
    from femgear.case import text as case_text
    from femgear.trains.gearbox_of_case import gearbox_of_case
    from femgear.trains.reading import parse_case, read_case

    written = gearbox_of_case(read_case(case))
    text = case_text.write(written.tables)
    parse_case(text)  # what is no gearbox is refused before a file is written
    print_warnings(warning_lines(written.findings, whole=True))
    output = output or Path(f"{case.stem}_gearbox.toml")
    write_case_file(text, output, force=force)
    say(f"next:    femgear run {shlex.quote(str(output))}")
    return 0


@app.command
@says_when_long("casing")
def casing(
    case: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Give a gearbox a rigid casing on feet, three sensors and a run-up, all estimated, so that a run has its sound.

    A set, a pair or a file of a former model first becomes a gearbox, as by femgear gearbox.

    Parameters
    ----------
    case
        TOML case file of a gearbox without a casing, of a set or of a pair.
    output
        Case file to write, in the folder of the case if that names other files. Default: NAME_in_casing.toml.
    force
        Replace the file.
    """
    from femgear.case.text import read_text
    from femgear.trains.gearbox_of_case import case_in_casing
    from femgear.trains.reading import read_case

    output = output or case.with_name(f"{case.stem}_in_casing.toml")
    text, findings = case_in_casing(read_case(case), read_text(case), str(output))
    print_warnings(warning_lines(findings, whole=True))
    write_case_file(text, output, force=force)
    say(f"next:    femgear run {shlex.quote(str(output))}")
    return 0
