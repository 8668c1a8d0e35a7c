"""Stage "stress": root stresses, contact pressures, load spectra and nominal stresses of a static result."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.analysis_spectrum import load_spectrum, loaded_teeth, root_ranges
from femgear.case import Case, set_deviations
from femgear.dependencies import check_entries, static_entries
from femgear.errors import GeometryError
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis import Progress, StaticResult
    from femgear.analysis_spectrum import LoadSpectrum, RootRange
    from femgear.contact.cycle import MeshCycle
    from femgear.contact.root_stress import RootCycle, RootStresses
    from femgear.gears import PlanetarySet

# beyond this many mesh periods stresses are kept around the worst tooth only: 64 positions of 256 periods
# would take a quarter of a gigabyte for three planets
WHOLE_RECORD = 16
# longer than any record: the true common period of a set
UNLIMITED = 10**12


@dataclass(frozen=True)
class NominalStresses:
    """Nominal stresses after ISO 6336 with equal load on all planets and no load factors.

    Parameters
    ----------
    contact : (2,) array
        sigma_H0 of sun-planet and planet-ring [Pa] (ISO 6336-2, method B).
    root : (2, 2) array
        sigma_F0 of gear 1 and gear 2 of both [Pa] (ISO 6336-3, method B).
    message : str
        Why a value is NaN: gears outside the range of the method; otherwise empty.
    """

    contact: np.ndarray
    root: np.ndarray
    message: str


@dataclass(frozen=True)
class StressResult:
    """Stresses of all meshes and gears over the mesh cycle.

    Parameters
    ----------
    planetary_set : PlanetarySet
    cycle : MeshCycle
        The static solution that it belongs to.
    influences : RootStresses
    roots : tuple of RootCycle
        Gear 1 and gear 2 of mesh 0, then of mesh 1, and so on; of records beyond `WHOLE_RECORD` mesh periods
        those periods in which the worst tooth of that gear passes the mesh.
    first_period : (4N,) int array
        Mesh period of the record with which each of `roots` begins.
    ranges : tuple of RootRange
        In the same order.
    spectrum : LoadSpectrum
    nominal : NominalStresses
    sun_torque : float
        [N m]
    closes : bool
        Whether the record repeats after its end. Where it does not, a tooth that the end of the record cuts
        off is followed on from the beginning of the record.
    """

    planetary_set: PlanetarySet
    cycle: MeshCycle
    influences: RootStresses
    roots: tuple[RootCycle, ...]
    first_period: np.ndarray
    ranges: tuple[RootRange, ...]
    spectrum: LoadSpectrum
    nominal: NominalStresses
    sun_torque: float
    closes: bool

    def dataset(self) -> xr.Dataset:
        """Contents of stress.nc."""
        from femgear.datasets_stress import stress_dataset

        return stress_dataset(self)


@one_blas_thread()
def solve_stress(case: Case, static: StaticResult, *, progress: Progress | None = None) -> StressResult:
    """Root stresses of every gear in every mesh, stress ranges over a turn, load spectra, nominal stresses.

    The static solution need not have pressures (`StaticResult.cycle.pressure`); where it has, they are part
    of the result.

    Parameters
    ----------
    case : Case
    static : StaticResult
        Of that case.
    progress : callable, optional
        Called with (stage, done, total).

    Raises
    ------
    GridError
        When the root of a tooth is not one chain of edges or a body can move freely.
    """
    from femgear.gears.deviations import common_period

    check_entries(static.entries, static_entries(case), "static solution")
    gears, cycle, reverse = static.planetary_set, static.cycle, static.sun_torque < 0
    influences = _influences(case, static)
    if progress is not None:
        progress("stress", 1, 2)
    repeats, _ = common_period(set_deviations(case), gears, limit=UNLIMITED)
    closes = repeats == cycle.periods
    teeth = loaded_teeth(cycle, reverse=reverse)
    ranges = root_ranges(gears, influences, teeth, closes=closes)
    roots, first = _root_cycles(gears, influences, cycle, ranges, reverse)
    return StressResult(
        planetary_set=gears,
        cycle=cycle,
        influences=influences,
        roots=roots,
        first_period=first,
        ranges=ranges,
        spectrum=load_spectrum(teeth, closes=closes),
        nominal=nominal_stresses(
            gears, static.sun_torque, case.material.youngs_modulus, case.material.poisson_ratio
        ),
        sun_torque=static.sun_torque,
        closes=closes,
    )


def _influences(case: Case, static: StaticResult) -> RootStresses:
    """Root influences of the bodies as the static solution holds them.

    Sun and planet were observed with their flanks; only the ring, whose contact has two plane states, is
    solved again.
    """
    from femgear.contact.root_stress import RootStresses, observed_root_stress, root_stress
    from femgear.fe.elasticity import Material, foundation

    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    sectors, bodies = static.sectors, static.bodies
    pairs = (sectors.sun, bodies.sun), (sectors.planet, bodies.planet)
    sun, planet = (observed_root_stress(sector.gear, flank.root) for sector, flank in pairs)
    grid, gear = sectors.ring.grid, sectors.ring.gear
    held, support = "rim", None
    if case.static.members == "elastic":
        stiffness = case.ring.foundation_radial, case.ring.foundation_tangential
        held, support = None, foundation(grid, "rim", *stiffness, thickness=gear.face_width)
    return RootStresses(sun, planet, root_stress(grid, gear, material, held=held, support=support))


def _root_cycles(gears, influences, cycle: MeshCycle, ranges, reverse):
    """Root stress of every gear in every mesh, and the mesh period with which each begins."""
    from femgear.contact.root_stress import root_stress_cycle

    if cycle.periods <= WHOLE_RECORD:
        roots = root_stress_cycle(gears, influences, cycle, reverse=reverse)
        return roots, np.zeros(len(roots), int)
    each, slots = len(cycle.position) // cycle.periods, cycle.tooth_load.shape[1]
    # one slot more at either end, and a period before and after
    length = min(slots + 4, cycle.periods)
    done, roots, first = {}, [], []
    for number, one in enumerate(ranges):
        slot, position = one.worst
        start = (position // each - slot - 2) % cycle.periods
        if start not in done:
            part = _excerpt(cycle, start, length)
            done[start] = root_stress_cycle(gears, influences, part, reverse=reverse)
        roots.append(done[start][number])
        first.append(start)
    return tuple(roots), np.array(first)


def _excerpt(cycle: MeshCycle, start: int, length: int) -> MeshCycle:
    """Loads of some mesh periods of a cycle; tooth numbers stay those of its first period."""
    each = len(cycle.position) // cycle.periods
    take = (start * each + np.arange(length * each)) % len(cycle.position)
    names = ("tooth_load", "path", "back_tooth_load", "back_path", "back_force")
    parts = {name: getattr(cycle, name)[..., take] for name in names}
    return replace(cycle, position=np.arange(len(take)) / each, periods=length, **parts)


def nominal_stresses(
    planetary_set: PlanetarySet, sun_torque: float, youngs_modulus: float, poisson_ratio: float
) -> NominalStresses:
    """sigma_H0 and sigma_F0 of both kinds of mesh under the mean load of a planet.

    Parameters
    ----------
    planetary_set : PlanetarySet
    sun_torque : float
        Of either sign [N m].
    youngs_modulus, poisson_ratio : float
        [Pa, 1]
    """
    from femgear.gears.iso6336_stress import nominal_contact_stress, nominal_root_stress

    s = planetary_set
    # torque over reference radius: the same at all three gears
    force = abs(sun_torque) / (s.n_planets * s.sun.reference_radius)
    contact, root, messages = np.full(2, math.nan), np.full((2, 2), math.nan), []
    meshes = (
        (s.sun, s.planet, s.working_pressure_angle_sun_planet, s.contact_ratio_sun_planet),
        (s.planet, s.ring, s.working_pressure_angle_planet_ring, s.contact_ratio_planet_ring),
    )
    for i, (one, two, angle, ratio) in enumerate(meshes):
        small, large = (one, two) if two.internal or one.teeth <= two.teeth else (two, one)
        try:
            contact[i] = nominal_contact_stress(
                small,
                large,
                working_angle=angle,
                contact_ratio=ratio,
                tangential_force=force,
                youngs_modulus=youngs_modulus,
                poisson_ratio=poisson_ratio,
            ).stress
        except GeometryError as error:
            messages.append(f"{one.name}-{two.name}: {error.message}")
        for j, gear in enumerate((one, two)):
            try:
                root[i, j] = nominal_root_stress(gear, contact_ratio=ratio, tangential_force=force).stress
            except GeometryError as error:
                messages.append(f"{gear.name} in {one.name}-{two.name}: {error.message}")
    return NominalStresses(contact, root, "; ".join(dict.fromkeys(messages)))
