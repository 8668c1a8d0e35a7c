"""What a walk through the mesh cycle finds: records of all meshes over the positions, and what follows from them.

`femgear.contact.cycle.walk_mesh_cycle` makes a `MeshCycle`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.contact.peaks import mean_weights
from femgear.contact.slices import largest_mean


@dataclass(frozen=True)
class Between:
    """States at E positions between those of a mesh cycle, ascending.

    Parameters
    ----------
    position : (E,) array
        In mesh periods.
    deflection, stiffness : (M, E) arrays
        As in `MeshCycle` [m], [N/m].
    sun_arc : (E,) array
        [m]
    load_share : (N, E) array
        Share of every planet in the load of all [1].
    max_pressure, pressed_path, pressed_load : (M, E) arrays
        [Pa], [m], [N]
    looked : (N,) bool array
        Planets whose extremes these positions enclose: one of those that go through the same states.
    records : tuple of MeshCycle
        The same positions in the order in which they were solved, with the loads of the tooth pairs.
    doubt : float
        Share of a peak to peak that what is not resolved may still add; 1 where it was not searched to the end.
    """

    position: np.ndarray
    deflection: np.ndarray
    stiffness: np.ndarray
    sun_arc: np.ndarray
    load_share: np.ndarray
    max_pressure: np.ndarray
    pressed_path: np.ndarray
    pressed_load: np.ndarray
    looked: np.ndarray
    records: tuple[MeshCycle, ...]
    doubt: float


@dataclass(frozen=True)
class MeshCycle:
    """Static solution over one mesh period or several.

    The M meshes are in the order sun-planet 1..N, planet 1..N-ring; of a pair alone gear 1 stands for the
    sun, gear 2 for its only planet.

    Parameters
    ----------
    position : (P,) array
        In mesh periods.
    deflection : (M, P) array
        Static transmission error of every mesh along its line of action: the approach of the flanks
        by the motions of their gears, deviations included [m].
    sun_arc : (P,) array
        Rotation of the sun behind the unloaded, exact set, as an arc on its base circle [m].
    force, back_force : (M, P) arrays
        Force on the drive and on the back flanks of the mesh, torque over base radius [N].
    stiffness : (M, P) array
        Tangent mesh stiffness dF/d delta at constant loads of the other meshes [N/m].
    tooth_load : (M, T, P) array
        Load of each simultaneous tooth pair, in the order of the path coordinate [N]; from one mesh period to
        the next a pair goes on to the next place, whatever the sign of the torque.
    path : (M, T, P) array
        Path coordinate of each tooth pair, from the pitch point in the direction of motion [m].
    tooth : (2, M, T) int array
        Tooth numbers of the pairs on gear 1 and gear 2 in the first mesh period, see
        `femgear.contact.flank_pairs`.
    back_tooth_load, back_path : (M, T, P) arrays
        The same of the back flanks' own pairs [N], [m]: the path coordinate falls with the position, and
        grows towards the tip of gear 1 as that of the drive flanks does (with a negative torque, both towards
        its root). All of the back flanks is zero where they were not looked at.
    back_tooth : (2, M, T) int array
        Their tooth numbers, counted as those of `tooth`.
    bearing_force : (N, 2, P) array
        Force of the pin on each planet, x and y in the frame of the carrier [N].
    max_pressure : (M, P) array
        Largest pressure of the contacts that do not reach the end of a flank [Pa]: under a sharp edge the
        pressure has no limit, it grows with every halving of the cells.
    pressed_path, pressed_load : (M, P) arrays
        Path coordinate of the tooth pair that has it [m], and its load [N]; in slices those of the slice that
        has it, the load times their number.
    edge_contact : (M, P) bool array
        Whether a contact of the mesh reaches a tip corner or the start of the involute.
    open_planets : (N, P) bool array
        Planets that carry nothing.
    residual, iterations : (P,) arrays
        Largest relative violation of the contact conditions and of equilibrium, and linear solutions.
    member_motion : (m, P) array
        Displacement of the axes of floating or sprung members [m], named by `member_names`; that of a planet
        is measured from its pin. Inside the clearance of its bearing the place of a planet that carries
        nothing is not determined: the smallest motion without penetration stands for it.
    member_names : tuple of str
        Such as ``"sun: x"``.
    periods : int
        Mesh periods in the record.
    contact : str
        ``"profile"`` or ``"line_of_action"``.
    unknowns : int
        Largest number of pressure cells at one position.
    message : str
        How the positions were solved, and whether planets or meshes lose their load.
    pressure : (M, T, C, P) array, optional
        Pressure in the cells of the drive flanks [Pa], where it was asked for.
    pressure_offset : (M, C) array, optional
        Place of these cells along the common tangent [m], positive towards growing path coordinates, from
        the middle of their window.
    pressure_centre : (M, T, P) array, optional
        Place of the middle of each window from the point on the path [m]: zero but for windows that end at
        the end of a flank or follow modified profiles. To be added to `pressure_offset`.
    held_stiffness : (M, P) array, optional
        As `stiffness`, with the ring held at its outer surface [N/m].
    held_compliance : (M, M, P) array, optional
        Tangent compliance between the meshes through their common bodies, the ring held, supports left out
        [m/N]; zero where a mesh carries nothing.
    slice_load : (M, T, S, P) array, optional
        Load of each tooth pair in equal slices of the width, times their number [N].
    slice_pressure : (2N, T, S, P) array, optional
        Largest pressure of the tooth pair in these slices [Pa], as `max_pressure`: zero at ends of flanks.
    mesh_misalignment, lead_offset : (2N, P) arrays, optional
        Misalignment of every mesh under load, leads and errors included: rise of the approach from one end of
        the width to the other as a least-squares line, positive where flanks come closer at z > 0; and the
        smallest separation of its flanks by leads and given misalignments [m].
    member_tilt : (k, P) array, optional
        Slope of the axes of members that tilt, and wind-up of the carrier [rad], named by `tilt_names`.
    tilt_names : tuple of str
        Such as ``"sun: x"``, direction in which the end z > 0 moves, and ``"carrier: wind-up"``.
    helical : bool
        Whether the slices are those of helical teeth: the path coordinates are those at mid-width.
    between : Between, optional
        States at further positions, between which and the others no extremes are left.
    alike : int
        Rotations that map the planets onto one another: they go through the same states.
    friction_force, friction_moment : (M, P) arrays, optional
        Force of gear 1 on gear 2 along the tangent, positive as flank 1 moves there while gear 1 drives [N], and the
        sum of the same times the path coordinates of the tooth pairs, as the flanks that are loaded drive [N m].
    ripple_doubt : float
        Of helical teeth in slices: share of its peak to peak by which half of the positions change a mesh stiffness,
        see `femgear.contact.face_width.ripple_doubt`.
    """

    position: np.ndarray
    deflection: np.ndarray
    sun_arc: np.ndarray
    force: np.ndarray
    back_force: np.ndarray
    stiffness: np.ndarray
    tooth_load: np.ndarray
    path: np.ndarray
    tooth: np.ndarray
    back_tooth_load: np.ndarray
    back_path: np.ndarray
    back_tooth: np.ndarray
    bearing_force: np.ndarray
    max_pressure: np.ndarray
    pressed_path: np.ndarray
    pressed_load: np.ndarray
    edge_contact: np.ndarray
    open_planets: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    member_motion: np.ndarray
    member_names: tuple[str, ...]
    periods: int
    contact: str
    unknowns: int
    message: str
    pressure: np.ndarray | None = None
    pressure_offset: np.ndarray | None = None
    pressure_centre: np.ndarray | None = None
    held_stiffness: np.ndarray | None = None
    held_compliance: np.ndarray | None = None
    slice_load: np.ndarray | None = None
    slice_pressure: np.ndarray | None = None
    mesh_misalignment: np.ndarray | None = None
    lead_offset: np.ndarray | None = None
    member_tilt: np.ndarray | None = None
    tilt_names: tuple[str, ...] = ()
    helical: bool = False
    between: Between | None = None
    alike: int = 1
    friction_force: np.ndarray | None = None
    friction_moment: np.ndarray | None = None
    ripple_doubt: float = 0.0

    def extremes(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest values over the record and the positions between.

        Of ``deflection``, ``stiffness`` or ``max_pressure`` of every mesh (M,), ``load_share`` of planets
        (N,), or ``sun_arc``.
        """
        values = np.asarray(getattr(self, name))
        if self.between is not None:
            values = np.concatenate([values, getattr(self.between, name)], axis=-1)
        if values.ndim == 1:
            return values.min(), values.max()
        classes, shape = len(self.open_planets) // self.alike, (-1, self.alike, values.shape[-1])
        # the same states at other times: the positions between are those of one planet
        of_class = values.reshape(-1, self.alike, classes, values.shape[-1]).swapaxes(1, 2).reshape(shape)
        low, high = (
            np.repeat(extreme.reshape(-1, 1, classes), self.alike, axis=1).ravel()
            for extreme in (of_class.min(axis=(1, 2)), of_class.max(axis=(1, 2)))
        )
        return low, high

    def peak_to_peak(self, name: str = "deflection") -> np.ndarray:
        """Compute the difference of the `extremes`, of their shape: by default of transmission errors (M,) [m]."""
        low, high = self.extremes(name)
        return np.asarray(high - low)

    def mean(self, name: str = "stiffness") -> np.ndarray:
        """Compute the mean over the record of what is linear between its positions and those between.

        Of every mesh (M,). Stiffnesses jump where tooth pairs come and go, which a few equidistant positions
        place some per cent of a mesh period off.
        """
        between = None if self.between is None else getattr(self.between, name)
        return self.mean_with(np.asarray(getattr(self, name)), between)

    def mean_with(
        self, values: np.ndarray, between: np.ndarray | None, position: np.ndarray | None = None
    ) -> np.ndarray:
        """Compute the mean (M,) over the record of values of the meshes (M, P) with those at positions between (M, E).

        Parameters
        ----------
        position : (E,) array, optional
            Of the values between [mesh periods]; by default those of `Between`.
        """
        if between is None or self.between is None:
            return values.mean(axis=-1)
        place = self.between.position if position is None else position
        weights = mean_weights(np.append(self.position, place), self.periods)
        of_meshes = np.concatenate([values, between], axis=-1) @ weights
        # of planets that go through the same states those count whose jumps are enclosed
        classes = len(self.between.looked) // self.alike
        looked = self.between.looked.reshape(self.alike, classes)
        of_class = np.where(looked, of_meshes.reshape(-1, self.alike, classes), 0.0).sum(axis=1)
        return np.repeat(of_class[:, None] / looked.sum(axis=0), self.alike, axis=1).ravel()

    @property
    def face_load_factor(self) -> np.ndarray | None:
        """K_H-beta of every mesh (M,): largest load per width of a tooth pair over the mean of that pair.

        The largest over a 25th of the width (`femgear.contact.slices.largest_mean`), at the position where
        it is largest. Of helical teeth, whose pairs carry on a part of the width each, the load of all pairs
        in the mean of the positions.
        """
        if self.slice_load is None:
            return None
        load = self.slice_load
        if self.helical:
            load = load.sum(axis=1, keepdims=True).mean(axis=-1, keepdims=True)
        largest = largest_mean(load, axis=2).reshape(len(load), -1)
        at = largest.argmax(axis=1)[:, None]
        mean = np.take_along_axis(load.mean(axis=2).reshape(len(load), -1), at, axis=1)
        largest = np.take_along_axis(largest, at, axis=1)
        return np.divide(largest, mean, out=np.ones(mean.shape), where=mean > 0)[:, 0]

    @property
    def overall_deflection(self) -> np.ndarray:
        """Transmission error from sun to what is held over every planet, shape (N, P) [m].

        With fixed centres the sum of the two mesh deflections; moving members add their part.
        """
        return np.broadcast_to(self.sun_arc, self.open_planets.shape)

    @property
    def secant_stiffness(self) -> np.ndarray:
        """Force over deflection, zero where a mesh carries nothing, shape (M, P) [N/m]."""
        loaded = (self.force > 0) & (self.deflection > 0)
        return np.divide(self.force, self.deflection, out=np.zeros_like(self.force), where=loaded)

    @property
    def load_share(self) -> np.ndarray:
        """Share of every planet in the sun's torque, shape (N, P); zero without torque."""
        n = len(self.open_planets)
        carried = self.force[:n] - self.back_force[:n]
        total = carried.sum(axis=0)
        # teeth may be wedged without torque: what is left of their forces is then rounding
        loaded = total > 1e-9 * (self.force[:n] + self.back_force[:n]).sum(axis=0)
        return np.divide(carried, total, out=np.zeros((n, len(total))), where=loaded)

    @property
    def wedged(self) -> np.ndarray:
        """Meshes that are loaded on both flanks at once, shape (M, P)."""
        return (self.force > 0) & (self.back_force > 0)
