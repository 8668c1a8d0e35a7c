"""Modes of the helical planetary set, their kinds and phasing, and where their energy sits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.models.helical import (
    CENTRAL,
    HelicalSet,
    free_motions,
    helical_system,
    mesh_directions,
    pin_directions,
)
from femgear.models.helical_data import body_masses
from femgear.models.kinds import SetMotions, named_kinds, phase_basis
from femgear.models.planar_data import member_radius
from femgear.models.planar_modes import body_motions, energy_shares
from femgear.solvers.modal import solve_modes
from femgear.system import Modes

KINDS = {"rotational": "rotational-axial", "translational": "translational-tilting", "planet": "planet"}
SPRINGS = ("radial", "axial", "tilt", "torsional")
# Relative distance of frequencies that rounding alone makes.
_ONE_FREQUENCY = 1e-9


def helical_modes(
    data: HelicalSet, *, mesh_stiffness=None, damping_ratio: float = 0.0, max_frequency: float | None = None
) -> Modes:
    """Modes of the set at standstill, with their kinds.

    Parameters
    ----------
    data : HelicalSet
    mesh_stiffness : (2N S,) array, optional
        Of the columns [N/m]; that of the set when not given.
    damping_ratio : float
        Of all modes.
    max_frequency : float, optional
        Keep the modes up to this frequency [Hz]; all when not given.

    Returns
    -------
    Modes
        ``kind`` from `helical_kinds`; modes of one frequency have one phasing each.
    """
    stiffness = data.column_stiffness if mesh_stiffness is None else mesh_stiffness
    modes = solve_modes(
        helical_system(data), stiffness, damping_ratio=damping_ratio, max_frequency=max_frequency
    )
    # tilts of the planets that no mesh feels have one frequency in several classes
    Q = phase_basis(helical_motions(data, modes.shape), modes.frequency, tolerance=_ONE_FREQUENCY)
    return replace(
        modes,
        shape=modes.shape @ Q,
        mesh_deflection=modes.mesh_deflection @ Q,
        modal_load=Q.T @ modes.modal_load,
        kind=helical_kinds(data, modes.shape @ Q, frequency=modes.frequency),
    )


def helical_kinds(data: HelicalSet, shape, *, frequency) -> tuple[str, ...]:
    """Kind of every mode from its shape.

    T. Eritenel and R. G. Parker (J. Sound Vib. 325, 2009, 397-420) for equal planets at equal angles: in a
    rotational-axial mode the central members rotate and move along z, and all planets move alike; in a
    translational-tilting mode they move and tilt in the plane; in a planet mode they rest. With four planets
    these are the modes that Kahraman (1994) calls in-phase, sequentially phased and counter-phased; the
    phasing itself comes from `femgear.models.kinds.phasing` of `helical_motions`.

    Parameters
    ----------
    data : HelicalSet
    shape : (n, m) array
        In the coordinates of `helical_system`.
    frequency : (m,) array
        Zero for rigid-body modes.

    Returns
    -------
    tuple of str
        ``rigid``; ``rotational-axial``, ``translational-tilting`` or ``planet`` where at least 99 % of the
        kinetic energy belongs to that class; else ``mixed``.

    Raises
    ------
    CaseError
        Shapes of another system (E-SHAPE).
    """
    named = named_kinds(class_shares(data, shape), frequency)
    return tuple(KINDS.get(kind, kind) for kind in named)


def class_shares(data: HelicalSet, shape) -> np.ndarray:
    """Shares (3, m) of rotational-axial, translational-tilting and planet motion in the kinetic energy."""
    return energy_shares(helical_motions(data, shape))


def helical_motions(data: HelicalSet, shape) -> SetMotions:
    """Motions of all bodies, held ones and planets tied to their pins included.

    The central members stand twice: x, y and rotation, then tilt about x, tilt about y and z, which turn with
    the frame as those do. Planets have all six motions.

    Parameters
    ----------
    data : HelicalSet
    shape : (n, m) array
        In the coordinates of `helical_system`.

    Raises
    ------
    CaseError
        Shapes of another system (E-SHAPE).
    """
    full, mass = body_motions(data, free_motions(data), shape), body_masses(data)
    plane, space = [0, 1, 5], [3, 4, 2]
    central = np.concatenate([full[:3, plane], full[:3, space]])
    central_mass = np.concatenate([mass[:3, plane], mass[:3, space]])
    return SetMotions(central, central_mass, full[3:], mass[3:], data.planet_angles)


def helical_springs(data: HelicalSet, *, mesh_stiffness=None) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Springs of the set by name, for `femgear.solvers.mode_energy.strain_shares`.

    Parameters
    ----------
    data : HelicalSet
    mesh_stiffness : (2N S,) array, optional
        Of the columns [N/m]; that of the set when not given.

    Returns
    -------
    dict of str to (columns (n, g), stiffness (g,))
        Meshes one by one (a column a slice); of planet bearings and of supports of the central members
        ``radial`` (two columns), ``axial``, ``tilt`` (two) and ``torsional``, in [m] and [rad]; what is held
        or free has no spring.
    """
    T, N = free_motions(data), data.n_planets
    k = np.asarray(data.column_stiffness if mesh_stiffness is None else mesh_stiffness, float)
    meshes = (T.T @ mesh_directions(data)).reshape(T.shape[1], 2 * N, data.slices)
    names = [f"sun-planet {n + 1}" for n in range(N)] + [f"planet {n + 1}-ring" for n in range(N)]
    k = k.reshape(2 * N, data.slices)
    springs = {name: (meshes[:, j], k[j]) for j, name in enumerate(names)}
    pins = pin_directions(data)
    for n in range(N):
        springs |= _by_direction(f"bearing of planet {n + 1}", T.T @ pins[:, n], data.pin_stiffness[n])
    for row, name in enumerate(CENTRAL):
        scale = np.array([1.0] * 3 + [member_radius(data, name)] * 3)
        columns = T[6 * row : 6 * row + 6].T / scale
        springs |= _by_direction(f"support of the {name}", columns, getattr(data, name).support.stiffness)
    return springs


def _by_direction(name: str, columns: np.ndarray, stiffness: np.ndarray) -> dict:
    """Springs (two radial, axial, two tilts, torsional) that are finite and not zero."""
    there = np.isfinite(stiffness) & (stiffness > 0.0)
    places = ([0, 1], [2], [3, 4], [5])
    return {
        f"{name}, {direction}": (columns[:, rows], stiffness[rows])
        for direction, rows in zip(SPRINGS, places)
        if there[rows[0]]
    }
