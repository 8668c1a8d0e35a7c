"""Which harmonics of the mesh frequency excite which modes, and where they meet over the speed.

At rest the meshes have the deflection ``s_j`` and the force ``F_j`` of their static record. Beyond its mean
stiffness ``k_j``, which the modes contain, mesh j acts with ``P_jh = F_jh - k_j s_jh`` in harmonic h, the
right-hand side of the harmonic equations in `femgear.solvers.periodic.spectral` in the limit of low speed.
On mode i with the mesh deflections ``r_ij`` that is the modal force ``Q_ih = -sum_j r_ij P_jh``.

Equal and equally spaced planets have equal ``P_jh`` but for their phases, which cancel this sum for all modes
of other kinds: with ``k = h z_sun mod N`` rotational modes are excited where k = 0, translational ones where
k = 1 or N - 1, planet modes else (R. G. Parker, J. Sound Vib. 236, 2000, 561-573; V. K. Ambarisha and R. G.
Parker, J. Vib. Acoust. 128, 2006, 133-142), and those of an elastic ring by its nodal diameters n where
n = k or -k mod N. Nothing here knows the rule: the sum itself is computed, so that unequal planets and
spacing are no exceptions, and nodes of a mode at the meshes count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.system.system import MeshExcitation, Modes, freeze, mesh_harmonics

EXCITED = 1e-3
"""Share of the largest modal force of a harmonic from which on a mode counts as excited by it."""
ONE_FREQUENCY = 1e-6
"""Modes closer than this (relative) are one: any mixture of them is a mode."""
ONE_SPEED = 1e-9
"""Speeds closer than this (relative) are one: they differ by rounding."""
_REFINED = 40
"""Resonances that get speeds of their own, at most."""


@dataclass(frozen=True)
class ModalForces:
    """Forces of the mesh harmonics 1..H on the G natural frequencies of a system, rigid motions left out.

    Parameters
    ----------
    mode : (G,) int array
        First mode of each natural frequency.
    frequency : (G,) array
        [Hz]
    damping_ratio : (G,) array
        Of each natural frequency [1].
    force : (G, H) array
        Modal force [N/kg^1/2], of several modes of one frequency the root of the sum of squares.
    output_level : (G, H) array
        Root mean square [m/s^2] of the output of these modes, were they free masses: what is heard far above
        them, ``1/(2 damping_ratio)`` times as much in resonance.
    """

    mode: np.ndarray
    frequency: np.ndarray
    damping_ratio: np.ndarray
    force: np.ndarray
    output_level: np.ndarray

    def __post_init__(self):
        freeze(self)

    @property
    def share(self) -> np.ndarray:
        """Modal forces over the largest of their harmonic, (G, H), 0 to 1."""
        return self.force / np.maximum(self.force.max(axis=0, initial=0.0), np.finfo(float).tiny)

    @property
    def excited(self) -> np.ndarray:
        """Whether a harmonic excites a natural frequency, (G, H) bool: its share is `EXCITED` or more."""
        return self.share >= EXCITED


@dataclass(frozen=True)
class Crossings:
    """Meetings of a mesh harmonic with a natural frequency that it excites, by mesh frequency.

    ``row`` (c,) are numbers of natural frequencies in `ModalForces`, ``harmonic`` (c,) those of mesh harmonics from 1,
    ``mesh_frequency`` (c,) is in Hz.
    """

    row: np.ndarray
    harmonic: np.ndarray
    mesh_frequency: np.ndarray

    def __post_init__(self):
        freeze(self)


def modal_forces(modes: Modes, excitation: MeshExcitation, count: int, output=None) -> ModalForces:
    """Compute the modal forces of mesh harmonics 1 to ``count``.

    CaseError: data that do not fit each other (E-SHAPE), too few positions (E-HARMONICS).

    Parameters
    ----------
    modes : Modes
        Basis with the mean stiffnesses of the excitation.
    count : int
        At most half the positions of the record.
    output : (n_modes, L) complex array, optional
        Amplitudes [kg^-1/2] of L lines that are heard apart, of every mode: components of a field. Without
        them nothing is heard.
    """
    if len(modes.mesh_stiffness) != len(excitation.stiffness):
        raise CaseError(
            f"modes of {len(modes.mesh_stiffness)} meshes, excitation of {len(excitation.stiffness)}",
            code="E-SHAPE",
        )
    _, deflection, force = mesh_harmonics(excitation, count)
    left = force - modes.mesh_stiffness[:, None] * deflection
    whole_harmonics = slice(excitation.periods, None, excitation.periods)
    Q = -modes.mesh_deflection.T @ left[:, whole_harmonics]
    elastic = np.flatnonzero(modes.frequency > 0.0)
    frequency, damping = modes.frequency[elastic], modes.damping_ratio[elastic]
    first = np.flatnonzero(np.diff(frequency, prepend=0.0) > ONE_FREQUENCY * frequency)
    Q = Q[elastic]
    lines = np.zeros((len(modes.frequency), 1)) if output is None else np.asarray(output)
    amplitude = np.add.reduceat(Q[:, :, None] * lines[elastic][:, None, :], first, axis=0)
    return ModalForces(
        mode=elastic[first],
        frequency=frequency[first],
        damping_ratio=damping[first],
        force=np.sqrt(np.add.reduceat(np.abs(Q) ** 2, first, axis=0)),
        # mass-normalised modes: their force is an acceleration
        output_level=np.sqrt(0.5 * (np.abs(amplitude) ** 2).sum(axis=-1)),
    )


def crossings(forces: ModalForces, lowest: float, highest: float, up_to: float) -> Crossings:
    """Find the mesh frequencies [Hz] between two at which an excited mode meets its harmonic.

    Natural frequencies above ``up_to`` [Hz], where the excitation ends, meet none.
    """
    harmonic = np.arange(1, forces.force.shape[1] + 1)
    at = forces.frequency[:, None] / harmonic
    crossed = forces.excited & (at >= lowest) & (at <= highest) & (forces.frequency[:, None] <= up_to)
    row, column = np.nonzero(crossed)
    along = np.argsort(at[row, column], kind="stable")
    row, column = row[along], column[along]
    return Crossings(row, harmonic[column], at[row, column])


def refined_speeds(speeds: np.ndarray, resonance: np.ndarray, level_times_damping: np.ndarray, damping: np.ndarray):
    """Add speeds at resonances (c,) whose peaks are narrower than the steps between speeds (s,), ascending.

    A peak of damping ratio z at speed w falls to half its power at ``w (1 - z)`` and ``w (1 + z)``. The
    resonances of the highest expected levels get these three speeds; undamped ones, which have no largest level, none.

    Parameters
    ----------
    speeds : (s,) array
        Ascending, in the unit of the resonances.
    resonance, damping : (c,) arrays
        Speed and damping ratio of every resonance.
    level_times_damping : (c,) array
        Its level times its damping ratio, as of `ModalForces.output_level`.
    """
    step = np.diff(speeds).max(initial=0.0) if len(speeds) > 1 else np.inf
    narrow = np.flatnonzero((damping > 0.0) & (damping * resonance < step))
    strongest = narrow[np.argsort(-level_times_damping[narrow] / damping[narrow], kind="stable")[:_REFINED]]
    around = resonance[strongest, None] * (1.0 + damping[strongest, None] * np.array([-1.0, 0.0, 1.0]))
    inside = (around >= speeds[0]) & (around <= speeds[-1])
    return merged_speeds(speeds, around[inside])


def merged_speeds(*lists: np.ndarray) -> np.ndarray:
    """Merge lists (n,) of speeds, ascending; of those that differ by rounding the one of the earliest list is kept.

    Several harmonics meet different modes at one speed where natural frequencies have whole ratios, which
    gives that speed again but for its last digits.
    """
    merged = np.empty(0)
    for speeds in map(np.unique, lists):
        new = speeds[np.diff(speeds, prepend=-np.inf) > ONE_SPEED * np.abs(speeds)]
        distance = np.abs(new[:, None] - merged).min(axis=1, initial=np.inf)
        merged = np.sort(np.concatenate([merged, new[distance > ONE_SPEED * np.abs(new)]]))
    return merged


def unresolved(speeds: np.ndarray, resonance: np.ndarray, level_times_damping: np.ndarray, damping: np.ndarray) -> int:
    """Count the resonances (c,) that matter with no speed (s,) within half the half width of their peaks.

    There an amplitude is 11 % below its peak. Those count of which a twentieth of the highest level is
    expected. ``level_times_damping`` and ``damping`` (c,) are those of the resonances, as of `refined_speeds`.
    """
    expected = level_times_damping / np.where(damping > 0.0, damping, np.inf)
    counted = (expected > 0.05 * expected.max(initial=0.0)) & (resonance >= speeds[0]) & (resonance <= speeds[-1])
    distance = np.abs(speeds[:, None] - resonance[counted]).min(axis=0)
    return int(np.count_nonzero(distance > 0.5 * damping[counted] * resonance[counted]))
