"""What a stage excites a gearbox with: its contact, or the number of tooth pairs where no contact is computed.

Meshes of a given stiffness and contact ratio have the wave of `pair_count_wave` under the constant
force F that the power flow gives them: ``f = k(t) (approach - mean approach) + F k(t) / k_0``. The pitch point is the
middle of the path of contact unless a phase is given, and teeth are as thick as their spaces at the pitch circle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femgear.case.dependencies import Steps
from femgear.errors import CaseError
from femgear.system.fourier import sample, tooth_lines
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.case_file import BoxMeshSection, PairSection
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.elastic_ring import ElasticRing
from femgear.trains.gearbox.friction import stage_friction
from femgear.trains.gearbox.geometry import StageSizes
from femgear.trains.gearbox.model import GearboxModel, StageModel
from femgear.trains.gearbox.stage_structure import stage_excitation

_RECORD = 2**13
"""Positions of the mesh period; of sets the next multiple of their planets."""


def exciting_stages(state: Deflection) -> list[StageModel]:
    """List the stages that excite a gearbox: those whose stiffness varies and whose teeth pass one another."""
    model = state.model
    return [stage for stage in model.stages if varies(state, stage) and model.flow.passes(stage.section)]


def varies(state: Deflection, stage: StageModel) -> bool:
    """Whether the meshes of a stage vary with their position: by contact, or by contact ratios where they carry."""
    by_pairs = stage.section.counts_pairs and state.model.flow.carries(stage.section)
    return stage.name in state.contacts or by_pairs


def excitation_of(
    state: Deflection,
    stage: StageModel,
    rings: Sequence[ElasticRing] = (),
    *,
    steps: Steps | None = None,
    friction: bool = False,
) -> MeshExcitation:
    """Compute the excitation of one of the `exciting_stages`, see `femgear.trains.gearbox.stage_structure`.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    stage : StageModel
    rings : sequence of ElasticRing
        Of the gearbox: the meshes of their stages have what the ring leaves.
    steps : Steps, optional
        What other computations of the stage have left.
    friction : bool
        Whether friction acts where the case asks for it; of stages with an elastic ring the rings say so.
    """
    for ring in rings:
        if ring.stage is stage:
            return ring.excitation
    if stage.name in state.contacts:
        contact = state.contacts[stage.name]
        rubs = stage_friction(state.model, stage, contact.result.planetary_set) if friction else None
        return stage_excitation(contact, rubs, steps=steps)
    return pair_count_excitation(state.model, stage)


def constant_excitation(state: Deflection, stage: StageModel, *, steps: Steps | None = None) -> MeshExcitation:
    """Make meshes that excite nothing: of the means of a stage that varies, else of a constant stiffness."""
    count = 512
    if varies(state, stage):
        drive = excitation_of(state, stage, steps=steps)
        means = {
            name: np.repeat(getattr(drive, name).mean(axis=1, keepdims=True), count, axis=1)
            for name in ("stiffness", "deflection", "force")
        }
        return replace(drive, **means, periods=1)
    contacts = state.model.assembly.contacts
    k = np.repeat([[contacts[mesh].stiffness.sum()] for mesh in stage.meshes], count, axis=1)
    return MeshExcitation(k, 0.0 * k, 0.0 * k, np.zeros(len(k)))


def pair_count_excitation(model: GearboxModel, stage: StageModel) -> MeshExcitation:
    """Compute mesh stiffness, deflection and force along the normals from the contact ratios of a stage.

    As time goes on where gear 1, or the sun against its carrier, turns counter-clockwise; tau = 0 where a pair of gear
    1, or of the sun with planet 1, touches at its pitch point.
    """
    section, sizes, N = stage.section, stage.sizes, max(len(stage.planets), 1)
    meshes = (section.mesh,) if isinstance(section, PairSection) else (section.sun_mesh, section.ring_mesh)
    count = N * -(-_RECORD // N)
    waves = [_wave(mesh, sizes, stage.flank, count // 2 - 1) for mesh in meshes if mesh is not None]
    mean = np.repeat([mesh.stiffness for mesh in meshes if mesh is not None], N)[:, None]
    lines = waves[0][None] if len(waves) == 1 else tooth_lines(waves[0], waves[1], mesh_phases(sizes))
    stiffness = mean * sample(np.column_stack([np.ones(len(lines)), lines]), count)
    normal = sizes.base_radii[0] * math.cos(sizes.base_helix)
    force = abs(model.flow.first_torque(section)) / (N * normal)
    deflection = np.broadcast_to(force / mean, stiffness.shape)
    return MeshExcitation(stiffness, deflection, stiffness * force / mean, np.zeros(len(mean)))


def _wave(mesh: BoxMeshSection, sizes: StageSizes, flank: int, harmonics: int) -> np.ndarray:
    """Harmonics (H,) of the stiffness of a mesh over its mean."""
    # the other flanks are those of the mirrored gears, whose path is passed from its end
    half, middle = 0.5 * (mesh.contact_ratio or 0.0), -flank * mesh.phase
    width = min(sizes.face_widths, default=0.0)
    pitch = 2.0 * math.pi * sizes.base_radii[0] / sizes.teeth[0]
    overlap = width * abs(math.tan(sizes.base_helix)) / pitch
    return _step_share(mesh) * pair_count_wave(middle - half, middle + half, harmonics, overlap=overlap)


def _step_share(mesh: BoxMeshSection) -> float:
    """Step of the stiffness by one pair more over that of pairs that are as stiff as one another."""
    if mesh.low_share is None or mesh.contact_ratio is None:
        return 1.0
    # with n pairs for 1 - s and n + 1 for s = e - n of the time the mean is (r + (1 - r) s) of the larger stiffness
    share = mesh.contact_ratio - math.floor(mesh.contact_ratio)
    return (1.0 - mesh.low_share) * mesh.contact_ratio / (mesh.low_share + (1.0 - mesh.low_share) * share)


def mesh_phases(sizes: StageSizes) -> np.ndarray:
    """Find the phases (2N,) of the meshes of a set from teeth and angles, as fractions of the mesh period.

    As those of `femgear.gears.planetary.PlanetarySet.mesh_phases`, of teeth as thick as their spaces: the planet tooth
    that touches the ring is half the planet and half a pitch away from the one that touches the sun.
    """
    sun, planet, _ = sizes.teeth
    psi = np.asarray(sizes.planet_angles)
    of_sun = -(psi - psi[0]) * sun / (2.0 * math.pi)
    return np.concatenate([of_sun, of_sun - 0.5 * (planet - 1)]) % 1.0


def pair_count_wave(start: float, end: float, harmonics: int, *, overlap: float = 0.0) -> np.ndarray:
    """Compute the harmonics of a mesh stiffness in proportion to the length of contact of its tooth pairs.

    A pair touches from ``start`` s to ``end`` e of its path, so that at ``Re sum k_h exp(2 pi i h tau)``
    ``k_h / k_0 = (exp(-2 pi i h s) - exp(-2 pi i h e)) / (pi i h (e - s)) sinc(h overlap)`` with ``sinc(x) = sin(pi
    x) / (pi x)``: a rectangular wave of spur gears (Parker and Lin, J. Mech. Des. 126, 2004, 68-76), the sum of the
    contact lines of helical ones (Maatar and Velex, J. Mech. Des. 118, 1996, 586-589).

    CaseError: a path that ends before it starts (E-RANGE).

    Parameters
    ----------
    start, end : float
        In transverse base pitches from the pitch point, which a pair passes at tau = 0, in the middle of the width.
    harmonics : int
        Number H of harmonics of the mesh frequency.
    overlap : float
        Overlap ratio of helical teeth [1].

    Returns
    -------
    (H,) complex array
        Harmonics 1 to H over the mean stiffness [1].
    """
    if not start < end:
        raise CaseError("the path of contact ends before it starts", code="E-RANGE", limit=f"end above {start:g}")
    h = np.arange(1, harmonics + 1)
    wave = (np.exp(-2j * np.pi * h * start) - np.exp(-2j * np.pi * h * end)) / (1j * np.pi * h * (end - start))
    return wave * np.sinc(h * overlap)
