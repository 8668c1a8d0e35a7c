"""Contact states of gear meshes over a motion: closed on one flank, parted, or hit on both sides.

No impact, single-sided and double-sided impact are told apart, as by A. Kahraman and R. Singh (J. Sound Vib.
142, 1990, 49-75), by the range of the relative deflection, or by the signs of the mesh forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from femgear.errors import CaseError, checked_numbers
from femgear.system.elements import GearMeshes

NORMAL, ONE_SIDED, TWO_SIDED, UNKNOWN = 0, 1, 2, 3
STATE_NAMES = ("normal", "one-sided impact", "two-sided impact", "not known")


@dataclass(frozen=True)
class ContactStates:
    """What every mesh of a motion does.

    Parameters
    ----------
    state : (..., g) int array
        Index into `STATE_NAMES`: one flank stays closed; it opens and the other does not close; both close.
    drive, free, back : (..., g) arrays
        Shares of the instants with the drive flanks, no flanks and the back flanks in contact.
    """

    state: np.ndarray
    drive: np.ndarray
    free: np.ndarray
    back: np.ndarray


def contact_states(meshes: GearMeshes, x, theta) -> ContactStates:
    """Contact over the instants of a motion.

    Parameters
    ----------
    meshes : GearMeshes
        Meshes that separate.
    x : (..., T, n_columns) array
        Deflections of all columns at T instants, at least one period of them [m].
    theta : (T, n_bases) array
        Phases of the instants [rad].

    Raises
    ------
    CaseError
        Meshes that do not separate, no instants, deflections or forces that are not finite (E-CONTACT).
    """
    if not meshes.separates:
        raise CaseError(
            "meshes that do not separate have no impacts", code="E-CONTACT", limit="separates=True"
        )
    x = checked_numbers(x, "x", code="E-CONTACT", unit="m")
    theta = checked_numbers(theta, "theta", code="E-CONTACT", unit="rad")
    if x.ndim < 2 or x.shape[-1] <= meshes.columns.max(initial=-1) or theta.ndim != 2 or not len(theta):
        _refuse(f"deflections of shape {x.shape} at phases of shape {theta.shape}")
    if x.shape[-2] != len(theta):
        _refuse(f"{x.shape[-2]} deflections of every column at {len(theta)} instants")
    _, line, behind, has_back = meshes.flank_forces(x[..., meshes.columns], theta)
    if not np.all(np.isfinite(line)):
        _refuse("deflections or forces that are not finite")
    drive, back = line > 0.0, has_back & (behind < 0.0)
    both = drive.any(axis=-2) & back.any(axis=-2)
    closed = drive.all(axis=-2) | back.all(axis=-2)
    state = np.where(both, TWO_SIDED, np.where(closed, NORMAL, ONE_SIDED))
    return ContactStates(state, drive.mean(axis=-2), (~drive & ~back).mean(axis=-2), back.mean(axis=-2))


def solution_states(meshes: GearMeshes, solution, *, samples: int = 1024) -> ContactStates:
    """Contact in a periodic solution, at equidistant phases; with several bases on a grid of all phases.

    Parameters
    ----------
    meshes : GearMeshes
    solution : PeriodicSolution
        With lines ``orders`` (L, n_bases) and amplitudes ``deflection`` (n_columns, L).
    samples : int
        Phases of every base: 1024 for one base, ``samples ** (1 / n_bases)`` but 64 at least for several.
    """
    bases = solution.orders.shape[1]
    each = samples if bases == 1 else max(64, round(samples ** (1.0 / bases)))
    axes = np.meshgrid(*[2.0 * np.pi * np.arange(each) / each] * bases, indexing="ij")
    theta = np.stack([axis.ravel() for axis in axes], axis=1)
    x = (np.exp(1j * theta @ solution.orders.T) @ solution.deflection.T).real
    return contact_states(meshes, x, theta)


def range_states(lowest, highest, *, drive: float, back: float) -> np.ndarray:
    """States (...) from the smallest and largest deflection, where the flanks close at constant deflections.

    `UNKNOWN` where an extreme is nan or infinite, as of a motion that did not settle.

    Parameters
    ----------
    lowest, highest : (...) arrays
        Of the relative deflection.
    drive, back : float
        Deflections above and below which the drive and the back flanks touch.
    """
    lowest, highest, drive, back = (
        checked_numbers(value, name, code="E-CONTACT", unit="m")
        for name, value in (("lowest", lowest), ("highest", highest), ("drive", drive), ("back", back))
    )
    if not (np.all(np.isfinite([drive, back])) and np.all(back <= drive)):
        _refuse(f"flanks that close above {drive} and below {back}")
    if lowest.shape != highest.shape or np.any(lowest > highest):
        _refuse("smallest deflections above the largest, or of another number")
    both = (highest > drive) & (lowest < back)
    closed = (lowest >= drive) | (highest <= back)
    state = np.where(both, TWO_SIDED, np.where(closed, NORMAL, ONE_SIDED))
    return np.where(np.isfinite(lowest) & np.isfinite(highest), state, UNKNOWN)


def state_regions(parameter, state) -> list[tuple[int, float, float]]:
    """Runs of equal states along a curve or sweep: state, first and last value of the parameter.

    Neighbouring runs share no value; where the state changes the border lies between them.
    """
    parameter = checked_numbers(parameter, "parameter", code="E-CONTACT", unit="")
    state = checked_numbers(state, "state", code="E-CONTACT", unit="")
    if parameter.ndim != 1 or parameter.shape != state.shape:
        _refuse(f"states of shape {state.shape} over parameters of shape {parameter.shape}")
    ends = np.flatnonzero(np.diff(state, append=-1, prepend=-1))
    return [
        (int(state[first]), float(parameter[first]), float(parameter[last - 1]))
        for first, last in pairwise(ends)
    ]


def _refuse(message: str):
    raise CaseError(
        message, code="E-CONTACT", limit="finite numbers, as many instants as phases, one or more"
    )
