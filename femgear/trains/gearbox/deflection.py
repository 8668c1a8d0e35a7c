"""System deflection: shafts, bearings, casing and teeth together under a load, and the teeth that it misaligns.

Newton's method on ``K q + B f(B^T q) + W p(W^T q) = load``: beams and linear springs in K, forces f of rolling
bearings by their geometry, slices p of the meshes as springs that only press. The distribution of the load over the
width and the planets comes from the contact of the teeth with the slopes and displacements that the system gives them;
it shifts the slices, and the system is solved again until slopes and mesh forces have settled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from femgear.errors import FemgearError, several
from femgear.system.assembly import GROUND, Assembly, StationSprings
from femgear.system.force_laws import RadialBearings
from femgear.system.rolling_bearings import BearingState, bearing_state, sliding_state
from femgear.trains.gearbox.case_file import CASING, BoxBearingSection, GearboxCase, LoadCaseSection
from femgear.trains.gearbox.casing import check_casing_held, elastic_foot_forces, rigid_foot_rows
from femgear.trains.gearbox.contact import (
    StageContact,
    given_separation,
    locate_contact_error,
    stage_contact,
    unequal_separation,
)
from femgear.trains.gearbox.geometry import rolling_bearing
from femgear.trains.gearbox.holding import loose_shafts, without_balance
from femgear.trains.gearbox.model import GearboxModel, StageModel, gearbox_model, member_of_stations
from femgear.trains.gearbox.passes import ContactPass, MeshPositions, forces_agree, next_start, slopes_agree
from femgear.trains.gearbox.planet_errors import error_gaps
from femgear.trains.gearbox.power import BoxFlow

_STEPS = 200
LEVERS = (1.0, 1.0, 1.0, 0.05, 0.05, 0.05)
"""Metres by which tilts and rotations are compared with shifts."""
# Misalignment over the width below which it is none [m].
_UPRIGHT = 1e-7
# Positions of the contact while slopes are far from settled, how near they come by them, relative, and the misalignment
# below which they are near at any rate [m].
_COARSE, _NEAR, _NEARLY_UPRIGHT = 12, 3e-3, 1e-6
_SETTLED = 1e-11  # residual force over the largest one
_LOOSE = 1e-11  # scaled stiffness of a motion that nothing holds, over the largest one
_LEAST_LOAD = 1e-3  # against which residuals count where nothing loads a gearbox [N]
# Differences of torque, relative, and of misalignment over the width [m] up to which equal teeth are one contact.
_COPIED, _COPIED_LENGTH = 1e-9, 1e-14
# Load of a rolling element over the largest force of the gearbox up to which it is rounding.
_PRESSED = 1e-9
_STIFFEST = 1e12  # of a rigid axial bearing of one sense [N/m]
# Stiffness that holds what hangs in clearances while bearings find their place, over that of a bearing.
_GUESS = 1e8


@dataclass(frozen=True)
class Deflection:
    """Loaded state of a gearbox.

    Parameters
    ----------
    model : GearboxModel
        The gearbox, with the mesh stiffnesses of the last contact.
    motion : (6n,) array
        Of all stations [m, rad].
    slice_force : (g,) array
        Force of every slice of every mesh [N].
    bearing_force : (b, 6) array
        Of every bearing on the shaft that it holds: along x, y, z [N] and about them [N m].
    bearing_stiffness : (b, 6, 6) array
        Tangents of all bearings at the loaded state [N/m, N, N m/rad].
    states : tuple of BearingState or None
        Of bearings by their geometry.
    residual : float
        Largest force out of balance over the largest force.
    iterations : int
        Newton steps of the last pass.
    contacts : mapping of str to StageContact
        Load distributions of the stages with teeth, by name.
    slopes : tuple of array
        Slopes of the meshes of every pass [rad]: of the approach of the flanks along the width.
    settled : bool
        Whether the slopes of the last two passes agree, and the mesh forces of contact and system.
    foot_force : (f, 3) array
        Of every foot on the casing, along x, y, z [N]; rigid ones that are more than needed share it with the
        smallest sum of squares.
    """

    model: GearboxModel
    motion: np.ndarray
    slice_force: np.ndarray
    bearing_force: np.ndarray
    bearing_stiffness: np.ndarray
    states: tuple[BearingState | None, ...]
    residual: float
    iterations: int
    contacts: Mapping[str, StageContact]
    slopes: tuple[np.ndarray, ...] = ()
    settled: bool = True
    foot_force: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def mesh_force(self) -> np.ndarray:
        """Force (M,) of every mesh along its normal [N]."""
        return np.array([self.slice_force[part].sum() for part in self.model.assembly.slices])

    @property
    def mesh_slope(self) -> np.ndarray:
        """Slope (M,) of the approach of the flanks of every mesh along its width [rad], closer at z > 0 positive."""
        return mesh_slopes(self.model.assembly, self.motion)


@dataclass(frozen=True)
class BearingLaw:
    """Force and stiffness of a bearing that is no set of linear springs.

    Parameters
    ----------
    section : BoxBearingSection
        With a kind, with an axial stiffness of one sense, or with play.
    factor : float
        On its stiffness: the same force at so many times smaller motions.
    """

    section: BoxBearingSection
    factor: float = 1.0

    def state(self, motion: np.ndarray) -> BearingState | None:
        """State of the rolling bearing at a motion (6,) [m, rad]; None of springs."""
        if self.section.kind is None:
            return None
        bearing, held = rolling_bearing(self.section), self.factor * motion
        if (sense := self.section.axial_sense) is None:
            return bearing_state(bearing, held)
        return sliding_state(bearing, held, {"positive": 1, "negative": -1}.get(sense, 0))

    def force(self, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force (6,) that holds a motion, and its derivative (6, 6) [N, N m]."""
        if (state := self.state(motion)) is not None:
            return state.force, self.factor * state.stiffness
        force, stiffness = np.zeros(6), np.zeros((6, 6))
        if self.section.axial_sense is not None:
            sense = 1.0 if self.section.axial_sense == "positive" else -1.0
            k = min(self.section.axial or 0.0, _STIFFEST) * self.factor
            if sense * motion[2] > 0.0:
                force[2], stiffness[2, 2] = k * motion[2], k
        if self.section.gapped:
            across, tangent = self.ring(np.array([[0, 1]])).evaluate(motion[None, :2], None)
            force[:2], stiffness[:2, :2] = across[0], tangent[0]
        return force, stiffness

    def ring(self, columns: np.ndarray) -> RadialBearings:
        """Make the ring of springs of a bearing with play, on columns (1, 2) of its motion along x and y."""
        assert self.section.radial is not None
        return RadialBearings(columns, self.section.radial * self.factor, 0.5 * self.section.clearance)

    def share(self, stiffness: np.ndarray) -> np.ndarray:
        """Take from the stiffness (6, 6) of a bearing that of this law, (6, 6): springs hold other motions too."""
        holds = self.held > 0.0
        return stiffness if self.section.kind is not None else np.where(holds[:, None] & holds, stiffness, 0.0)

    def pressing(self, motion: np.ndarray) -> float:
        """Largest load of its elements, or its thrust, at a motion (6,) [N]."""
        if (state := self.state(motion)) is not None:
            return float(state.lamina_load.max(initial=0.0))
        return float(np.abs(self.force(motion)[0]).max())

    @property
    def held(self) -> np.ndarray:
        """Stiffness (6,) of a linear bearing that holds the same motions [N/m, N m/rad]."""
        if self.section.kind is None:
            across = self.section.radial * self.factor if self.section.gapped and self.section.radial else 0.0
            along = 0.0 if self.section.axial_sense is None else _GUESS
            return np.array([across, across, along, 0.0, 0.0, 0.0])
        lever = 0.25 * (self.section.pitch_diameter or 0.0)
        thrust = self.section.kind in ("ball", "tapered", "spherical") and self.section.axial_sense != "none"
        tilt = 0.0 if self.section.kind == "spherical" else lever**2
        return _GUESS * np.array([1.0, 1.0, float(thrust), tilt, tilt, 0.0])


def laws_of(model: GearboxModel, factor: float = 1.0) -> list[tuple[int, BearingLaw, StationSprings]]:
    """List number, law and rows of the bearings that are no set of linear springs."""
    return [
        (number, BearingLaw(section, factor if section.estimated else 1.0), springs)
        for number, (section, springs) in enumerate(zip(model.case.bearing, model.bearings, strict=True))
        if section.nonlinear
    ]


def mesh_slopes(assembly: Assembly, motion: np.ndarray) -> np.ndarray:
    """Compute the slopes (M,) of the approach of all meshes along their widths [rad] from the motions (6n,)."""
    approach = assembly.columns.T @ motion
    slopes = np.zeros(len(assembly.contacts))
    for number, (contact, part) in enumerate(zip(assembly.contacts, assembly.slices, strict=True)):
        if len(contact.heights) > 1:
            slopes[number] = contact.heights @ approach[part] / (contact.heights @ contact.heights)
    return slopes


def mesh_separation(assembly: Assembly, motion: np.ndarray) -> np.ndarray:
    """Compute how far (M,) motions (6n,) take the flanks of every mesh apart along the normal [m]."""
    approach = assembly.columns.T @ motion
    return np.array([-approach[part].mean() for part in assembly.slices])


def solve_deflection(
    case: GearboxCase,
    load_case: LoadCaseSection | None = None,
    *,
    slopes: Sequence[float] | None = None,
    steps=None,
    estimate: float = 1.0,
) -> Deflection:
    """Solve for the loaded state of a gearbox, teeth and system in turn until slopes and forces of the meshes settle.

    Parameters
    ----------
    case : GearboxCase
        From `femgear.read_case`.
    load_case : LoadCaseSection, optional
        By default that which the case names first.
    slopes : (meshes,) floats, optional
        Slopes from which the first contact starts [rad]; by default those of the system with linear meshes.
    steps : Steps, optional
        What other computations have left of compliances.
    estimate : float
        Factor on the stiffness of bearings that are estimated.

    Raises
    ------
    CaseError
        See `gearbox_model`; motions that nothing holds (E-MECHANISM).
    ConvergenceError
        No balance, as of a bearing whose clearance swallows the load (E-CONVERGENCE).
    """
    model = gearbox_model(case, load_case, estimate=estimate)
    staged = [stage for stage in model.stages if model.flow.touches(stage.section)]
    gap = _first_gaps(model, staged)
    state = shared_torques(solve_state(model, gap))
    if not (staged and case.deflection.contact):
        return replace(state, slopes=(state.mesh_slope,))
    apart = mesh_separation(model.assembly, state.motion)
    start = MeshPositions(np.asarray(slopes, float) if slopes is not None else state.mesh_slope, apart)
    history, passes = [start.slopes], []
    contacts: dict[str, StageContact] = {}
    settled, coarse = False, True
    equal, model = model.flow, state.model
    for _ in range(case.deflection.passes):
        # stages without load, as of planets far off their places, lie where equal shares would press them
        flows = {stage.name: state.model.flow if state.model.flow.touches(stage.section) else equal for stage in staged}
        contacts = _contacts(model, staged, start, steps, _COARSE if coarse else None, flows)
        stiffness = {name: contact.stiffness for name, contact in contacts.items()}
        model = gearbox_model(case, load_case, mesh_stiffness=stiffness, estimate=estimate, flow=state.model.flow)
        gap = _gaps(model, staged, contacts, start.slopes)
        state = shared_torques(solve_state(model, gap, start=state))
        model = state.model
        end = MeshPositions(state.mesh_slope, mesh_separation(model.assembly, state.motion))
        passes.append(ContactPass(start, end))
        history.append(end.slopes)
        before, start = start, next_start(model, passes)
        tolerance = max(case.deflection.tolerance, _NEAR) if coarse else case.deflection.tolerance
        least = _NEARLY_UPRIGHT if coarse else _UPRIGHT
        alike = slopes_agree(model, end.slopes, before.slopes, tolerance, least)
        if coarse and len(passes) > 1:
            # what is left of the change after this pass
            alike = alike or slopes_agree(model, start.slopes, end.slopes, tolerance, least)
        carried = {stage.name for stage in staged if model.flow.touches(stage.section)}
        contacts = {name: contact for name, contact in contacts.items() if name in carried}
        alike = alike and forces_agree(model, state.mesh_force, contacts, tolerance)
        if alike and not coarse:
            settled = True
            break
        if alike:
            coarse, passes = False, []
    return replace(state, contacts=contacts, slopes=tuple(history), settled=settled)


def shared_torques(state: Deflection) -> Deflection:
    """Give stages side by side the torques by which shafts, bearings and meshes share them in a loaded state."""
    model, factors = state.model, dict[str, float]()
    for stage in model.stages:
        torque = abs(model.flow.first_torque(stage.section))
        if torque and any(stage.name in names for names in model.flow.side_by_side):
            normal = stage.sizes.base_radii[0] * math.cos(stage.sizes.base_helix)
            force = state.mesh_force[list(stage.meshes[: max(len(stage.planets), 1)])].sum()
            factors[stage.name] = float(force * normal / torque)
    return replace(state, model=replace(model, flow=model.flow.with_factors(factors))) if factors else state


def _contacts(
    model: GearboxModel,
    staged: Sequence[StageModel],
    start: MeshPositions,
    steps,
    positions: int | None,
    flows: Mapping[str, BoxFlow],
) -> dict[str, StageContact]:
    """Contacts of the teeth of all stages by name; those of equal teeth, torque and slopes are one.

    Equal branches of planets are copies of one another, each with the phases of its teeth: a mesh period is the same.
    """
    contacts, solved = dict[str, StageContact](), list[StageModel]()
    for stage in staged:
        equal = next((other for other in solved if _are_equal(stage, other, start, flows)), None)
        if equal is None:
            contacts[stage.name] = _contact(model, stage, start, steps, positions, flows[stage.name])
            solved.append(stage)
        else:
            contacts[stage.name] = contacts[equal.name]
    return contacts


def _are_equal(stage: StageModel, other: StageModel, start: MeshPositions, flows: Mapping[str, BoxFlow]) -> bool:
    """Whether two stages have the same teeth, and torque and positions that differ by rounding alone."""
    if type(stage.section) is not type(other.section) or _untitled(stage) != _untitled(other):
        return False
    torque, other_torque = (flows[compared.name].first_torque(compared.section) for compared in (stage, other))
    meshes, others = list(stage.meshes), list(other.meshes)
    slopes = start.slopes[meshes] - start.slopes[others]
    apart = unequal_separation(start.separations[meshes]) - unequal_separation(start.separations[others])
    lengths = [*np.abs(slopes) * (stage.width or 1.0), *np.abs(apart)]
    return abs(torque - other_torque) <= _COPIED * abs(torque) and max(lengths) <= _COPIED_LENGTH


def _untitled(stage: StageModel) -> dict[str, Any]:
    """Tables of the teeth of a stage without their title."""
    return {name: table for name, table in (stage.section.teeth or {}).items() if name != "title"}


def _contact(
    model: GearboxModel, stage: StageModel, start: MeshPositions, steps, positions: int | None, flow: BoxFlow
) -> StageContact:
    """Contact of the teeth of a stage with the positions of its meshes, at few angles until they settle."""
    torque, meshes = -flow.first_torque(stage.section), list(stage.meshes)
    slices = model.case.deflection.slices if model.case.motions == "space" else 0
    try:
        return stage_contact(
            stage.section,
            torque,
            start.slopes[meshes],
            separation=start.separations[meshes],
            slices=slices,
            positions=positions,
            steps=steps,
        )
    except FemgearError as error:
        locate_contact_error(error, model.case, stage.section, torque, stage.width)
        raise


def _first_gaps(model: GearboxModel, staged: Sequence[StageModel]) -> np.ndarray:
    """Gaps (g,) of the slices by errors of teeth and planets [m]."""
    gap = error_gaps(model)
    for stage in staged:
        apart = given_separation(stage.section, -model.flow.first_torque(stage.section))
        for mesh, value in zip(stage.meshes, apart, strict=True):
            gap[model.assembly.slices[mesh]] += value
    return gap


def _gaps(model, staged, contacts, slopes) -> np.ndarray:
    """Gaps (g,) of the slices with which springs have the loads of the contact at its slopes and approaches [m]."""
    assembly = model.assembly
    gap = error_gaps(model)
    for stage in staged:
        contact = contacts[stage.name]
        for place, mesh in enumerate(stage.meshes):
            mesh_contact, part = assembly.contacts[mesh], assembly.slices[mesh]
            force = contact.shares_at(place, len(mesh_contact.heights)) * contact.normal_force[place]
            # slope and approach are those with which the contact was solved
            gap[part] += slopes[mesh] * mesh_contact.heights + contact.approach[place] - force / mesh_contact.stiffness
    return gap


def solve_state(model: GearboxModel, gap: np.ndarray, *, start: Deflection | None = None) -> Deflection:
    """Solve for the balance of all forces with given gaps (g,) of the slices [m].

    Raises
    ------
    CaseError
        Motions that nothing holds (E-MECHANISM).
    ConvergenceError
        No balance (E-CONVERGENCE).
    """
    assembly = model.assembly
    held = assembly.held.copy()
    held[model.turns] = True
    fixed = replace(assembly, held=held)
    T, K, W, k = fixed.motions, assembly.stiffness, assembly.columns, assembly.slice_stiffness
    laws = laws_of(model, model.estimate)
    _check_held(model, fixed, T, K, W, k, laws)
    spread = [(spread_rows(springs, assembly), law) for _, law, springs in laws]
    scale = max(np.abs(model.load).max(initial=0.0), _LEAST_LOAD)
    y = np.zeros(T.shape[1]) if start is None else np.linalg.lstsq(T, start.motion, rcond=None)[0]
    if start is None and (laws or gap.any()):
        y = _guess(T, K, W, k, gap, laws, model.load, assembly)

    # most motions are single coordinates: a sparse product takes their rows and columns alone
    chosen = csr_array(T)

    def forces(y):
        q = T @ y
        press = np.maximum(W.T @ q - gap, 0.0)
        inner = K @ q + W @ (k * press)
        tangent = K + (W * (k * (press > 0.0))) @ W.T
        for rows, law in spread:
            force, stiffness = law.force(rows @ q)
            inner = inner + rows.T @ force
            tangent = tangent + rows.T @ stiffness @ rows
        return T.T @ (model.load - inner), np.ascontiguousarray(chosen.T @ tangent @ chosen)

    y, residual, iterations, left = _newton(forces, y, scale)
    if left is not None:
        station, way = _farthest(T @ y)
        raise without_balance(model.case, member_of_stations(model)[station], way, left)
    q = T @ y
    return _state(model, q, gap, laws, residual, iterations)


def _farthest(motion: np.ndarray) -> tuple[int, int]:
    """Find the station that has moved the farthest, and its way; tilts and rotations count by 50 mm."""
    station, way = divmod(int((np.abs(motion) * np.tile(LEVERS, len(motion) // 6)).argmax()), 6)
    return station, way


def _newton(forces, y: np.ndarray, scale: float) -> tuple[np.ndarray, float, int, float | None]:
    """Newton's method with a shorter step where the residual does not fall.

    The last value is the force that is left where there is no balance [N], else None.
    """
    residual, tangent = forces(y)
    size = np.abs(residual).max(initial=0.0)
    for iteration in range(_STEPS):
        if size <= _SETTLED * scale:
            return y, size / scale, iteration, None
        step = _solved(tangent, residual)
        share = 1.0
        while True:
            trial = y + share * step
            new, new_tangent = forces(trial)
            new_size = np.abs(new).max(initial=0.0)
            if new_size < size * (1.0 - 1e-4 * share) or share < 1e-3:
                break
            share *= 0.5
        if share < 1e-3 and not new_size < size:
            # rounding of stiff springs leaves the last digits open
            if size <= 1e-7 * scale:
                return y, size / scale, iteration, None
            trial = y + step
            new, new_tangent = forces(trial)
            new_size = np.abs(new).max(initial=0.0)
        y, residual, tangent, size = trial, new, new_tangent, new_size
    if size <= 1e-7 * scale:
        return y, size / scale, _STEPS, None
    return y, size / scale, _STEPS, float(size)


def _solved(tangent: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Newton step; motions without stiffness, as in clearances, are held softly."""
    size = np.sqrt(np.abs(np.diag(tangent)))
    size[size == 0.0] = size[size > 0.0].min(initial=1.0)
    scaled = tangent / np.outer(size, size)
    return np.linalg.solve(scaled + 1e-10 * np.eye(len(size)), residual / size) / size


def _guess(T, K, W, k, gap, laws, load, assembly) -> np.ndarray:
    """Motions with a linear spring in the place of every rolling bearing, and of every mesh."""
    tangent = K + (W * k) @ W.T
    for _, law, springs in laws:
        rows = spread_rows(springs, assembly)
        tangent = tangent + (rows.T * law.held) @ rows
    return _solved(T.T @ tangent @ T, T.T @ (load + W @ (k * gap)))


def spread_rows(springs: StationSprings, assembly: Assembly) -> np.ndarray:
    """Rows (r, 6n) of springs among all motions."""
    spread = np.zeros((len(springs.rows), assembly.count))
    for at, station in enumerate(springs.stations):
        if station != GROUND:
            spread[:, 6 * station : 6 * station + 6] += springs.rows[:, 6 * at : 6 * at + 6]
    return spread


def check_held(case: GearboxCase) -> None:
    """Refuse motions of shafts that neither springs nor bearings nor meshes hold.

    CaseError: one for every shaft (E-MECHANISM).
    """
    model = gearbox_model(case)
    held = model.assembly.held.copy()
    held[model.turns] = True
    fixed = replace(model.assembly, held=held)
    parts = fixed.motions, fixed.stiffness, fixed.columns, fixed.slice_stiffness
    _check_held(model, fixed, *parts, laws_of(model, model.estimate))


def _check_held(model: GearboxModel, fixed: Assembly, T, K, W, k, laws) -> None:
    """Refuse motions that neither springs nor bearings nor meshes hold."""
    tangent = K + (W * k) @ W.T
    for _, law, springs in laws:
        rows = spread_rows(springs, fixed)
        tangent = tangent + (rows.T * law.held) @ rows
    reduced = T.T @ tangent @ T
    size = np.sqrt(np.abs(np.diag(reduced)))
    size[size == 0.0] = 1.0
    scaled = reduced / np.outer(size, size)
    # the motions themselves, which take as long again, matter to a refusal alone
    values = np.linalg.eigvalsh(scaled)
    if not len(values) or values[0] >= _LOOSE * values[-1]:
        return
    values, vectors = np.linalg.eigh(scaled)
    loose = values < _LOOSE * values[-1]
    motion = T @ (vectors[:, loose] / size[:, None])
    if CASING in fixed.names:
        check_casing_held(
            motion, np.tile(LEVERS, len(fixed.names)), fixed.names.index(CASING), int(np.count_nonzero(loose))
        )
    raise several(loose_shafts(model.case, member_of_stations(model), motion))


def _state(model: GearboxModel, q, gap, laws, residual: float, iterations: int) -> Deflection:
    """Forces and tangents of all bearings and slices at the motions."""
    assembly, case = model.assembly, model.case
    press = np.maximum(assembly.columns.T @ q - gap, 0.0)
    force, stiffness = np.zeros((len(case.bearing), 6)), np.zeros((len(case.bearing), 6, 6))
    states: list[BearingState | None] = [None] * len(case.bearing)
    feet = _linear_bearings(model, q, press, laws, force, stiffness)
    least = _PRESSED * max(np.abs(model.load).max(initial=0.0), (assembly.slice_stiffness * press).max(initial=0.0))
    for number, law, springs in laws:
        motion = spread_rows(springs, assembly) @ q
        holding, tangent = law.force(motion)
        states[number] = law.state(motion)
        force[number] -= holding
        # elements that rounding presses hold nothing
        stiffness[number] += tangent if law.pressing(motion) > least else 0.0
    return Deflection(
        model,
        q,
        assembly.slice_stiffness * press,
        force,
        stiffness,
        tuple(states),
        residual,
        iterations,
        {},
        foot_force=feet,
    )


def _linear_bearings(model: GearboxModel, q, press, laws, force, stiffness) -> np.ndarray:
    """Forces of bearings of given stiffness, and of feet (f, 3); those of rigid ones balance their stations."""
    assembly, case = model.assembly, model.case
    rigid: list[tuple[int, int]] = []
    for number, (section, springs) in enumerate(zip(case.bearing, model.bearings, strict=True)):
        if section.kind is not None:
            continue
        values = np.array(model.linear_stiffness(section))
        finite = np.where(np.isfinite(values), values, 0.0)
        stiffness[number] = np.diag(values)
        force[number] = -finite * (spread_rows(springs, assembly) @ q)
        rigid += [(number, int(way)) for way in np.flatnonzero(np.isinf(values))]
    feet, foot_rows = elastic_foot_forces(model.casing, q), rigid_foot_rows(model.casing, assembly.count)
    if not rigid and not len(foot_rows):
        return feet
    # what is out of balance at all stations is what rigid bearings, joints and held motions carry
    left = model.load - assembly.stiffness @ q - assembly.columns @ (assembly.slice_stiffness * press)
    for _, law, springs in laws:
        rows = spread_rows(springs, assembly)
        left = left - rows.T @ law.force(rows @ q)[0]
    rows = np.array([spread_rows(model.bearings[number], assembly)[way] for number, way in rigid]).reshape(-1, len(q))
    others = _conditions(assembly, model)
    forces = np.linalg.lstsq(np.vstack([rows, foot_rows, others]).T, left, rcond=None)[0]
    for (number, way), value in zip(rigid, forces[: len(rigid)], strict=True):
        force[number, way] = -value
    if model.casing is not None:
        feet[np.isinf(model.casing.foot_stiffness[:, :3])] = -forces[len(rigid) : len(rigid) + len(foot_rows)]
    return feet


def _conditions(assembly: Assembly, model: GearboxModel) -> np.ndarray:
    """Rows of what is rigid or held but neither bearing nor foot: joints, pins, held motions, given turns."""
    rows = [np.zeros((0, assembly.count))]
    for springs in model.joints:
        if np.isinf(springs.stiffness).any():
            rows.append(spread_rows(springs, assembly)[np.isinf(springs.stiffness)])
    for follower in assembly.followers:
        at = [6 * leader + way for leader in follower.leaders for way in range(6)]
        coordinates = np.arange(6 * follower.station, 6 * follower.station + 6)
        rows.append(np.zeros((6, assembly.count)))
        rows[-1][np.arange(6), coordinates], rows[-1][:, at] = 1.0, -follower.rows
    held = np.flatnonzero(assembly.held)
    both = np.unique(np.concatenate([held, model.turns]))
    rows.append(np.eye(assembly.count)[both])
    return np.vstack(rows)
