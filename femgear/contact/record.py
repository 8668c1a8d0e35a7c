"""What a walk through the mesh cycle gives: loads, motions and stiffness of all 2N meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MeshCycle:
    """Static solution over one mesh period or several; meshes in the order sun-planet 1..N, planet 1..N-ring.

    Parameters
    ----------
    position : (P,) array
        In mesh periods.
    deflection : (2N, P) array
        Static transmission error of every mesh along its line of action: the approach of the flanks
        by the motions of their gears, deviations included [m].
    sun_arc : (P,) array
        Rotation of the sun behind the unloaded, exact set, as an arc on its base circle [m].
    force : (2N, P) array
        Force on the drive flanks of the mesh, torque over base radius [N].
    back_force : (2N, P) array
        Force on its back flanks [N]; zero where they were not looked at.
    stiffness : (2N, P) array
        Tangent mesh stiffness dF/d delta at constant loads of the other meshes [N/m].
    tooth_load : (2N, T, P) array
        Load of each simultaneous tooth pair, in the order of the path coordinate [N]; from one mesh period to
        the next a pair goes on to the next place, whatever the sign of the torque.
    path : (2N, T, P) array
        Path coordinate of each tooth pair, from the pitch point in the direction of motion [m].
    tooth : (2, 2N, T) int array
        Tooth numbers of the pairs on gear 1 and gear 2 in the first mesh period, see `tooth_zero_angles`.
    back_tooth_load : (2N, T, P) array
        Load of each tooth pair on the back flanks [N]; the T places are those of the back side's own pairs.
        This and the next two are zero where back flanks were not looked at.
    back_path : (2N, T, P) array
        Path coordinate of these pairs [m], on the line of action of the back flanks: it falls with the
        position, and grows towards the tip of gear 1 as that of the drive flanks does (with a negative
        torque, both towards its root).
    back_tooth : (2, 2N, T) int array
        Their tooth numbers, counted as those of `tooth`.
    bearing_force : (N, 2, P) array
        Force of the pin on each planet, x and y in the frame of the carrier [N].
    max_pressure : (2N, P) array
        Largest pressure of the contacts that do not reach the end of a flank [Pa]: under a sharp edge the
        pressure has no limit, it grows with every halving of the cells.
    edge_contact : (2N, P) bool array
        Whether a contact of the mesh reaches a tip corner or the start of the involute.
    open_planets : (N, P) bool array
        Planets that carry nothing.
    residual : (P,) array
        Largest relative violation of the contact conditions and of equilibrium.
    iterations : (P,) int array
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
    pressure : (2N, T, C, P) array, optional
        Pressure in the cells of the drive flanks [Pa], where it was asked for.
    pressure_offset : (2N, C) array, optional
        Place of these cells along the common tangent [m], positive towards growing path coordinates, from
        the middle of their window.
    pressure_centre : (2N, T, P) array, optional
        Place of the middle of each window from the point on the path [m]: zero but for windows that end at
        the end of a flank or follow modified profiles. To be added to `pressure_offset`.
    compliance : (2N, 2N, P) array, optional
        Tangent compliance between the meshes through their common bodies, supports left out [m/N]; zero
        where a mesh carries nothing.
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
    compliance: np.ndarray | None = None

    @property
    def overall_deflection(self) -> np.ndarray:
        """Transmission error from sun to ring over every planet, shape (N, P) [m].

        With fixed centres the sum of the two mesh deflections; moving members add their part.
        """
        return np.broadcast_to(self.sun_arc, (len(self.deflection) // 2, len(self.sun_arc)))

    @property
    def secant_stiffness(self) -> np.ndarray:
        """Force over deflection, zero where a mesh carries nothing, shape (2N, P) [N/m]."""
        loaded = (self.force > 0) & (self.deflection > 0)
        return np.divide(self.force, self.deflection, out=np.zeros_like(self.force), where=loaded)

    @property
    def load_share(self) -> np.ndarray:
        """Share of every planet in the sun's torque, shape (N, P); zero without torque."""
        n = len(self.force) // 2
        carried = self.force[:n] - self.back_force[:n]
        total = carried.sum(axis=0)
        # teeth may be wedged without torque: what is left of their forces is then rounding
        loaded = total > 1e-9 * (self.force[:n] + self.back_force[:n]).sum(axis=0)
        return np.divide(carried, total, out=np.zeros((n, len(total))), where=loaded)

    @property
    def wedged(self) -> np.ndarray:
        """Meshes that are loaded on both flanks at once, shape (2N, P)."""
        return (self.force > 0) & (self.back_force > 0)


def cycle_without_load(
    n_planets: int,
    position: np.ndarray,
    *,
    periods: int,
    contact: str,
    cells: int,
    pressures: bool = False,
) -> MeshCycle:
    """The defined result without load: nothing touches, nothing is stiff, no pressure has a place."""
    N, positions = n_planets, len(position)
    zero, teeth = np.zeros((2 * N, positions)), np.zeros((2 * N, 1, positions))
    found = {}
    if pressures:
        found = {
            "pressure": np.zeros((2 * N, 1, cells, positions)),
            "pressure_offset": np.zeros((2 * N, cells)),
            "pressure_centre": teeth,
        }
    return MeshCycle(
        position=position,
        deflection=zero,
        sun_arc=np.zeros(positions),
        force=zero,
        back_force=zero,
        stiffness=zero,
        tooth_load=teeth,
        path=teeth,
        tooth=np.zeros((2, 2 * N, 1), int),
        back_tooth_load=teeth,
        back_path=teeth,
        back_tooth=np.zeros((2, 2 * N, 1), int),
        bearing_force=np.zeros((N, 2, positions)),
        max_pressure=zero,
        edge_contact=np.zeros((2 * N, positions), bool),
        open_planets=np.ones((N, positions), bool),
        residual=np.zeros(positions),
        iterations=np.zeros(positions, int),
        member_motion=np.zeros((0, positions)),
        member_names=(),
        periods=periods,
        contact=contact,
        unknowns=0,
        message="no torque: no tooth carries load and the mesh stiffness is zero",
        **found,
    )
