"""The stages of the reference case, as things to measure: what each needs, does, and how large it is."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"
SWEEP_SPEEDS = 1000


class Reference:
    """The reference case and the results of its stages, each computed when it is first asked for."""

    @cached_property
    def case(self):
        from femgear.trains.reading import read_case

        return read_case(CASE)

    @cached_property
    def material(self):
        from femgear.fe.elasticity import Material

        section = self.case.material
        return Material(section.youngs_modulus, section.poisson_ratio, section.density)

    @cached_property
    def cache(self) -> Path:
        self._folder = tempfile.TemporaryDirectory()
        return Path(self._folder.name)

    @cached_property
    def gears(self):
        from femgear.case.gear_set import planetary_set

        return planetary_set(self.case)

    @cached_property
    def halves(self):
        return outlines(self)

    @cached_property
    def grids(self):
        from femgear.fe.grid import mirror

        return [mirror(grid) for grid in cached_grids(self)]

    @cached_property
    def sectors(self):
        from femgear.contact.bodies import make_sectors

        elements = self.case.static.flank_elements
        return make_sectors(self.gears, self.material, flank_elements=elements, cache=self.cache)

    @cached_property
    def bodies(self):
        return compliance(self)

    @cached_property
    def static(self):
        return static(self)

    @cached_property
    def modes(self):
        return modes(self)

    @cached_property
    def dynamics(self):
        return dynamics(self)

    @property
    def sun_torque(self) -> float:
        return self.case.operation.torque

    @cached_property
    def sweep_frequency(self) -> np.ndarray:
        return np.linspace(0.25, 1.5, SWEEP_SPEEDS) * 1116.0


def outlines(reference: Reference):
    """Exact outlines of half a tooth sector of each gear."""
    from femgear.gears.tooth import half_sector

    gears, elements = reference.gears, reference.case.static.flank_elements
    return [half_sector(gear, flank_elements=elements) for gear in (gears.sun, gears.planet, gears.ring)]


def cold_grids(reference: Reference):
    """Gmsh grids of the three half sectors, nothing cached."""
    from femgear.fe.meshing import mesh_outlines

    return mesh_outlines(reference.halves, cache=None)


def cached_grids(reference: Reference):
    """The same grids from the cache."""
    from femgear.fe.meshing import mesh_outlines

    return mesh_outlines(reference.halves, cache=reference.cache)


def assembly(reference: Reference):
    """Stiffness matrices of the three sectors."""
    from femgear.contact.bodies import RING_STATE, TEETH_STATE
    from femgear.fe.elasticity import stiffness

    states = (TEETH_STATE, TEETH_STATE, RING_STATE)
    width = reference.gears.sun.face_width
    return [
        stiffness(grid, reference.material, state=state, thickness=width)
        for grid, state in zip(reference.grids, states)
    ]


def compliance(reference: Reference):
    """Compliance between all flanks of all teeth of the three bodies."""
    from femgear.contact.bodies import make_bodies

    return make_bodies(reference.sectors, reference.material)


def contact(reference: Reference):
    """Contact of all meshes at the positions of the case."""
    from femgear.contact.cycle import walk_mesh_cycle

    positions = reference.case.static.positions
    return walk_mesh_cycle(reference.gears, reference.bodies, sun_torque=reference.sun_torque, positions=positions)


def static(reference: Reference):
    """The static stage, grids cached."""
    from femgear.stages.static import solve_static

    return solve_static(reference.case, cache=reference.cache)


def modes(reference: Reference):
    """The modal stage."""
    from femgear.trains.elastic.stages import solve_modes

    return solve_modes(reference.case, reference.static)


def dynamics(reference: Reference):
    """The dynamic stage: the speeds of the case, with their Floquet verdicts."""
    from femgear.trains.elastic.stages import solve_dynamics

    return solve_dynamics(reference.case, reference.static, reference.modes)


SWEEP_HARMONICS = 6


def sweep(reference: Reference):
    """Periodic responses at 1000 speeds, six mesh harmonics."""
    from femgear.solvers.periodic.spectral import solve_spectral

    result = reference.modes
    return solve_spectral(
        result.modes,
        result.excitation,
        reference.sweep_frequency,
        excitation_harmonics=SWEEP_HARMONICS,
        response_harmonics=3 * SWEEP_HARMONICS,
    )


def sweep_verdicts(reference: Reference):
    """Periodic responses at 1000 speeds and the Floquet verdict of each."""
    from femgear.solvers.stability.parametric import stability

    result, response = reference.modes, sweep(reference)
    stability(
        result.modes,
        result.excitation,
        reference.sweep_frequency,
        excitation_harmonics=SWEEP_HARMONICS,
    )
    return response


def housing(reference: Reference):
    """The housing stage."""
    from femgear.trains.elastic.stages import solve_housing

    return solve_housing(reference.case, reference.dynamics)


def on_supports(case, speeds, supports, *, harmonics: int | None = None, diameters: int = 14, runup: int = 0):
    """The case on supports, with a run-up of so many speeds from 300 to 3100 rpm.

    The excitation ends at so many mesh harmonics, by default where that of a run does.
    """
    from femgear.trains.reading import with_values

    stiffness = dict.fromkeys(("radial_stiffness", "tangential_stiffness"), "4e8 N/m")
    entries = {
        "housing.support": [one | stiffness for one in supports],
        "housing.nodal_diameters": diameters,
        "housing.published": [],
        "operation.speeds": speeds,
        "runup.from": "300 rpm",
        "runup.to": "3100 rpm",
        "runup.count": runup,
    } | ({} if harmonics is None else {"dynamics.mesh_harmonics": harmonics})
    return with_values(case, entries)


def on_feet(case, speeds, **known):
    """The case on the four feet of docs/bolts.md."""
    feet = [{"angle": f"{a} deg", "width": "20 mm", "mass": "50 g"} for a in (35, 145, 215, 325)]
    return on_supports(case, speeds, feet, **known)


def on_bolts(case, speeds, **known):
    """The case on the six bolts of docs/bolts.md."""
    bolts = [{"angle": f"{a} deg", "width": "12 mm", "mass": "20 g"} for a in range(15, 375, 60)]
    return on_supports(case, speeds, bolts, **known)


def turning_speeds(count: int) -> dict:
    """Speeds of the input from 300 to 3100 rpm."""
    return {"from": "300 rpm", "to": "3100 rpm", "count": count}


def two_way(reference: Reference, modes=None, *, speeds=("250 rpm",), harmonics=None, diameters=14, supported=on_feet):
    """Mesh forces of the set on supports both ways, and of the ring without them."""
    from femgear.stages.lumped_set import member_speeds
    from femgear.trains.elastic.excitation_limit import limited
    from femgear.trains.elastic.fixed_housing import fixed_housing

    modes = modes or reference.modes
    case = supported(reference.case, speeds, harmonics=harmonics, diameters=diameters)
    first, speeds = member_speeds(case, reference.gears), np.array(case.operation.speeds)
    limit = limited(case, first.mesh_frequency * speeds, modes.reach, given=case.dynamics.mesh_harmonics)
    return fixed_housing(case, modes, first.carrier * speeds, limit)


def runup_on_bolts(reference: Reference, count: int):
    """The run-up of the set on six bolts, with speeds beside its resonances."""
    from femgear.trains.elastic.stages import solve_runup

    return solve_runup(on_bolts(reference.case, ["3100 rpm"], runup=count), reference.modes)


def whole(reference: Reference):
    """Static, modes, dynamics and housing, grids cached; no pictures."""
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes

    case = reference.case
    still = solve_static(case, cache=reference.cache)
    basis = solve_modes(case, still)
    return solve_housing(case, solve_dynamics(case, still, basis))


def whole_cold(reference: Reference):
    """The same with new grids."""
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes

    case = reference.case
    still = solve_static(case)
    basis = solve_modes(case, still)
    return solve_housing(case, solve_dynamics(case, still, basis))


def misaligned(case, *, slices: int = 25, positions: int = 32):
    """The case with a lead slope of 10 um on the sun, solved in slices over the width."""
    from femgear.case.sections import ModificationSection

    slope = ModificationSection.model_validate({"kind": "lead slope", "amount": "10 um"})
    sun = case.sun.model_copy(update={"modifications": (slope,)})
    static = case.static.model_copy(update={"slices": slices, "positions": positions, "stresses": False})
    return case.model_copy(update={"sun": sun, "static": static})


def slices(reference: Reference):
    """The static stage in 25 slices over the width, 32 positions, grids cached."""
    from femgear.stages.static import solve_static

    return solve_static(misaligned(reference.case), cache=reference.cache)


def slices_cold(reference: Reference):
    """The same with new grids."""
    from femgear.stages.static import solve_static

    return solve_static(misaligned(reference.case))


def slices_modes(reference: Reference):
    """Static and modal stage in slices."""
    from femgear.trains.elastic.stages import solve_modes

    return solve_modes(misaligned(reference.case), slices(reference))


def helical(planets: int):
    """Case of a helical set out of phase, 25 slices and the default positions: of three planets or five."""
    from femgear.trains.reading import read_case, with_values

    case = read_case(ROOT / "cases" / "helical_23_24_73.toml")
    case = with_values(case, {"static.positions": 64, "static.slices": 25, "static.stresses": False})
    if planets == 3:
        return case
    shifts = dict.fromkeys(("sun.tip_diameter", "planet.tip_diameter"))
    teeth = {"sun.teeth": 36, "planet.teeth": 24, "ring.teeth": 84, "sun.module": "1.5 mm"}
    shifts |= {"sun.profile_shift": 0.0, "planet.profile_shift": 0.0, "ring.outer_radius": "80 mm"}
    return with_values(case, {"set.planets": planets, "sun.bore_radius": "12 mm", **teeth, **shifts})


def helical_modes(planets: int, reference: Reference):
    """Static and modal stage of a helical set out of phase in slices."""
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_modes

    case = helical(planets)
    return solve_modes(case, solve_static(case, cache=reference.cache))


def help_text(_):
    """``femgear --help`` in a new process."""
    _in_new_process("from femgear.cli import main; main(['--help'])")


def package(_):
    """``import femgear`` in a new process."""
    _in_new_process("import femgear")


def reading(_):
    """Import femgear and read the case in a new process."""
    _in_new_process(f"import femgear; femgear.read_case({str(CASE)!r})")


def demo(reference: Reference):
    """``femgear run`` with all pictures and the report, as `make demo`."""
    _run(reference)


def without_pictures(reference: Reference):
    """``femgear run --no-pictures``."""
    _run(reference, "--no-pictures")


def first_line(reference: Reference):
    """``femgear run`` until the first line of its verdict, into a new folder: a run that was ended would go on."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "femgear.cli", "run", str(CASE), "-o", f"{folder}/results"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            assert any(line.strip() for line in process.stdout)
            process.kill()  # one that is asked to end writes its files first


def script(reference: Reference):
    """Import femgear, solve for the static state, modes and response, in a new process."""
    solve = "s = femgear.solve_static(case, cache=cache); m = femgear.solve_modes(case, s)"
    _in_new_process(
        f"import femgear; case, cache = femgear.read_case({str(CASE)!r}), {str(reference.cache)!r}; {solve}; "
        "femgear.solve_dynamics(case, s, m)"
    )


def _run_arguments(reference: Reference, *words: str) -> list[str]:
    return ["run", str(CASE), "-o", str(reference.cache / "results"), "--force", *words]


def _run(reference: Reference, *words: str) -> None:
    _in_new_process(f"from femgear.cli import main; main({_run_arguments(reference, *words)!r})")


def _in_new_process(program: str) -> None:
    subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, env=os.environ)


@dataclass(frozen=True)
class Stage:
    """Something to measure.

    Parameters
    ----------
    title : str
    run : callable
        Given the reference, whose properties in `needs` were asked for before.
    needs : tuple of str
    unknowns : callable
        Given the reference and the result.
    rounds : int
    limit : float, optional
        Time that the project promises [s].
    """

    title: str
    run: Callable
    needs: tuple[str, ...]
    unknowns: Callable
    rounds: int = 5
    limit: float | None = None


def _sector_unknowns(reference, _):
    return 2 * sum(len(grid.points) for grid in reference.grids)


def _lines(reference, response):
    return response.deflection.shape[1] * (2 * response.deflection.shape[2] - 1) * len(response.mesh_frequency)


def _none(*_):
    return None


STAGES = {
    "outlines": Stage("outlines of three tooth sectors", outlines, ("gears",), _none, 9),
    "cold_grids": Stage("grids by Gmsh, cold", cold_grids, ("halves", "grids"), _sector_unknowns, 3),
    "cached_grids": Stage("grids from the cache", cached_grids, ("halves", "grids"), _sector_unknowns, 9),
    "assembly": Stage("stiffness matrices", assembly, ("grids",), _sector_unknowns),
    "compliance": Stage(
        "flank compliance of all teeth",
        compliance,
        ("sectors",),
        lambda _, b: sum(body.unknowns for body in (b.sun, b.planet, b.ring)),
    ),
    "contact": Stage("contact, 64 positions", contact, ("bodies",), lambda _, cycle: cycle.unknowns),
    "static": Stage("static stage", static, ("grids",), lambda _, r: r.cycle.unknowns),
    "slices": Stage(
        "static stage in 25 slices, 32 positions",
        slices,
        ("grids",),
        lambda _, r: r.cycle.slice_load.size,
        3,
        2.0,
    ),
    "slices_cold": Stage("the same, new grids", slices_cold, (), _none, 3, 5.0),
    "slices_modes": Stage("static and modal stage in 25 slices", slices_modes, ("grids",), _none, 3, 2.0),
    "helical_3": Stage(
        "static and modal stage, helical, three planets out of phase, 25 slices",
        partial(helical_modes, 3),
        (),
        _none,
        1,
        4.0,
    ),
    "helical_5": Stage("the same, five planets", partial(helical_modes, 5), (), _none, 1, 4.0),
    "modes": Stage("modal stage", modes, ("static",), lambda _, r: len(r.model.system.M)),
    "dynamics": Stage(
        "dynamics, 2 speeds, with Floquet verdict", dynamics, ("modes",), lambda r, d: _lines(r, d.response)
    ),
    "sweep": Stage("sweep of 1000 speeds", sweep, ("modes",), _lines, 3, 1.0),
    "sweep_verdicts": Stage("sweep of 1000 speeds with Floquet verdicts", sweep_verdicts, ("modes",), _lines, 3),
    "two_way": Stage(
        "both ways, four feet, 250 rpm, excited as in a run, n to 14",
        two_way,
        ("modes",),
        lambda _, r: r.two_way.force[:, 1:].size * 2,
        3,
    ),
    "two_way_bolts": Stage(
        "the same, six bolts",
        partial(two_way, supported=on_bolts),
        ("modes",),
        lambda _, r: r.two_way.force[:, 1:].size * 2,
        3,
    ),
    "housing": Stage("housing, 2 speeds", housing, ("dynamics",), lambda _, h: h.lines.displacement.size, 9),
    "whole": Stage("whole computation, grids cached", whole, ("grids",), _none, 3, 3.0),
    "whole_cold": Stage("whole computation, new grids", whole_cold, (), _none, 3),
    "demo": Stage("femgear run with pictures and report, as make demo", demo, (), _none, 3, 10.0),
    "without_pictures": Stage("femgear run --no-pictures", without_pictures, (), _none, 3, 1.5),
    "first_line": Stage("femgear run until the first line of its verdict", first_line, (), _none, 3, 2.0),
    "script": Stage(
        "import femgear, static state, modes and response, in a new process",
        script,
        ("grids",),
        _none,
        3,
        1.0,
    ),
    "reading": Stage("import femgear and read the case", reading, (), _none, 9),
    "help": Stage("femgear --help", help_text, (), _none, 9, 0.3),
    "package": Stage("import femgear, with the start of Python", package, (), _none, 9, 0.1),
}


def baseline():
    """Fixed work that times are compared with: factor and solve a Laplacian of 160 x 160 points.

    Ratios to it are much the same on machines of different speed.
    """
    from scipy.sparse import diags_array, eye_array, kron
    from scipy.sparse.linalg import splu

    n = 160
    line = diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    laplacian = (kron(line, eye_array(n)) + kron(eye_array(n), line)).tocsc()
    return splu(laplacian).solve(np.ones((n * n, 8)))


def some_work(times):
    """Do the work of `baseline` some times, as a task of a worker: a dozen takes about a second."""
    for _ in range(times):
        baseline()
