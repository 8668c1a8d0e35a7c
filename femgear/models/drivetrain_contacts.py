"""Drive and back flanks of the meshes of a drivetrain as one-sided contacts, each with its own normal.

On the back flank the tangential and the axial part of the normal are reversed, the radial one is not: gears
that come closer close both flanks, and teeth wedge (Y. Guo and R. G. Parker, Eur. J. Mech. A 29, 2010,
1022-1033; for parallel axes the left and the right line of action of ISO 21771).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.models.drivetrain_coordinates import Coordinates
from femgear.models.drivetrain_data import Drivetrain
from femgear.models.drivetrain_meshes import (
    MeshGeometry,
    flank_directions,
    planar_places,
    turned_directions,
)

# Radial part of a normal, over the whole, that the held coordinates leave nothing of.
_NOTHING = 1e-12


@dataclass(frozen=True)
class FlankContacts:
    """Contacts with the forces ``k max(x - gap, 0)`` along their own normals.

    Parameters
    ----------
    geometry : MeshGeometry
        Of the drive flanks of all meshes, then of the back flanks that the backlash lets touch; among the
        free coordinates. The first simple motions are those of the drive flanks alone.
    mesh : (n_contacts,) int array
        Mesh of every contact.
    gap : (n_contacts,) array
        Zero at the drive flanks, the backlash at the back flanks [m].
    columns : tuple of (n_contacts,) int arrays
        Simple motions that every contact takes part in; those of a stage and flank are alike in number.
    """

    geometry: MeshGeometry
    mesh: np.ndarray
    gap: np.ndarray
    columns: tuple[np.ndarray, ...]

    def mesh_forces(self, approach, stiffness):
        """Forces (..., n_meshes), drive less back flank, and whether any flank touches, from approaches.

        Parameters
        ----------
        approach, stiffness : (..., n_contacts) arrays
            [m], [N/m]
        """
        n = int(self.mesh.max(initial=-1)) + 1
        overlap = approach - self.gap
        force = stiffness * np.maximum(overlap, 0.0)
        touching = overlap >= 0.0
        total, touched = force[..., :n].copy(), touching[..., :n].copy()
        # no mesh has two back flanks
        total[..., self.mesh[n:]] -= force[..., n:]
        touched[..., self.mesh[n:]] |= touching[..., n:]
        return total, touched


def flank_contacts(
    train: Drivetrain, place: Coordinates, spin, T, geometry: MeshGeometry, backlash
) -> FlankContacts:
    """Contacts of all meshes; an infinite backlash has no back flank.

    Parameters
    ----------
    train : Drivetrain
    place : Coordinates
    spin : (n_all,) array
    T : (n_all, n) array
        All coordinates by the free ones.
    geometry : MeshGeometry
        Of the drive flanks, among the free coordinates.
    backlash : (n_meshes,) array
        [m]
    """
    count, behind = len(geometry.names), np.flatnonzero(np.isfinite(backlash))
    total, planar = flank_directions(train, place, spin, back=True), planar_places(train, place)
    apart = _apart(geometry, T, total, planar)
    wedges = np.flatnonzero(np.any(apart != 0.0, axis=0)[behind])
    extra = dict(zip(behind[wedges], len(geometry.fixed) + np.arange(len(wedges))))
    size = len(geometry.fixed) + len(wedges), count + len(behind)
    fixed, (even, odd) = np.zeros(size), np.zeros((2, len(planar), *size))
    for whole, part in ((fixed, geometry.fixed), (even, geometry.even), (odd, geometry.odd)):
        whole[..., : len(geometry.fixed), :count] = part
    columns = [np.append(j, _shared(geometry, j)) for j in range(count)]
    for column, j in enumerate(behind, start=count):
        stage, own, radial = geometry.stage[j], _shared(geometry, j), [extra[j]] if j in extra else []
        fixed[j, column], fixed[radial, column] = -1.0, 1.0
        if stage < len(planar):
            even[stage, own, column], odd[stage, own, column] = turned_directions(total[planar[stage], j])
        columns.append(np.r_[j, radial, own].astype(int))
    names = (*geometry.names, *(f"{geometry.names[j]}, back flank" for j in behind))
    mesh = np.r_[np.arange(count), behind].astype(int)
    basic = np.hstack([geometry.basic, apart[:, behind[wedges]]])
    both = MeshGeometry(names, basic, fixed, even, odd, geometry.stage[mesh])
    gap = np.append(np.zeros(count), np.asarray(backlash, float)[behind])
    return FlankContacts(both, mesh, gap, tuple(columns))


def _apart(geometry: MeshGeometry, T, total, planar) -> np.ndarray:
    """What the back flanks have beside the reversed drive flanks (n, n_meshes), but for what turns.

    That is the radial part twice; zero for all meshes of a stage whose held coordinates leave nothing of it.
    """
    rest = total.copy()
    for number, places in enumerate(planar):
        rest[np.ix_(places, np.flatnonzero(geometry.stage == number))] = 0.0
    apart = T.T @ rest + geometry.basic[:, : len(geometry.names)]
    whole = np.abs(T.T @ total).max(axis=0, initial=0.0)
    radial = np.abs(apart).max(axis=0, initial=0.0) > _NOTHING * whole
    return np.where(np.isin(geometry.stage, geometry.stage[radial]), apart, 0.0)


def _shared(geometry: MeshGeometry, mesh: int) -> np.ndarray:
    """Simple motions of the carrier and the sun of a mesh; none of a parallel stage."""
    stage = int(geometry.stage[mesh])
    return len(geometry.names) + 4 * stage + np.arange(4 if stage < len(geometry.even) else 0)


def contact_model(model):
    """The model with every contact in the place of a mesh, for integration in time."""
    contacts = model.contacts
    return replace(
        model, geometry=contacts.geometry, stiffness=model.stiffness[contacts.mesh],
        backlash=model.backlash[contacts.mesh], mesh_base=model.mesh_base[contacts.mesh],
    )  # fmt: skip
