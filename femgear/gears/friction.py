"""Sliding and friction of teeth: sliding speeds over the path of contact, coefficients of friction, loss factors.

The loss of a mesh is ``P = mu H_V P_in``, with a coefficient of friction mu that holds for the whole path and the loss
factor H_V, the mean over a mesh period of force times sliding speed over the power that the teeth pass on:

    H_V = (1 / p_et) integral of F(zeta) |v_s(zeta)| / (F_bt v_b) d zeta / cos(beta_b)

(H. Ohlendorf, thesis TH Munich 1958; A. Wimmer, Lastverluste von Stirnradverzahnungen, thesis TU Munich 2006, who takes
computed load distributions F). Here `loss_factor` has the load in equal parts on the lines of contact of all pairs; the
loss factor of computed loads is `femgear.stages.losses.computed_loss_factor`. Speeds are those of gears against their
carrier, and along the line of action in the transverse section.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.gears.pair import GearPair

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
PITCH_ZONE = 1e-9
"""Overlap ratio below which lines of contact are parallel to the axes."""


@dataclass(frozen=True)
class PathSpeeds:
    """Speeds and curvatures of two flanks at points of the path of contact.

    Parameters
    ----------
    path : (...) array
        Path coordinate from the pitch point in the direction of motion [m].
    rolling_1, rolling_2 : (...) arrays
        Speeds of both surfaces along the common tangent, against the point of contact [m/s].
    radius : (...) array
        Radius of relative curvature in the normal section [m].
    """

    path: np.ndarray
    rolling_1: np.ndarray
    rolling_2: np.ndarray
    radius: np.ndarray

    @property
    def sliding(self) -> np.ndarray:
        """Speed (...) with which flank 1 slides on flank 2 [m/s], negative before the pitch point."""
        return self.rolling_1 - self.rolling_2

    @property
    def sum_speed(self) -> np.ndarray:
        """Sum (...) of the speeds of both surfaces [m/s]."""
        return self.rolling_1 + self.rolling_2

    @property
    def specific_sliding(self) -> tuple[np.ndarray, np.ndarray]:
        """Sliding over the speed of the own surface (...) of flank 1 and flank 2 [1]; infinite at a base circle."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return 1.0 - self.rolling_2 / self.rolling_1, 1.0 - self.rolling_1 / self.rolling_2


def path_speeds(pair: GearPair, path: Any, mesh_frequency: float = 1.0, base_helix: float = 0.0) -> PathSpeeds:
    """Compute rolling speeds and relative curvature at path coordinates [m] of any shape.

    Parameters
    ----------
    mesh_frequency : float
        [Hz]
    base_helix : float
        Helix angle on the base cylinder [rad].
    """
    zeta = np.asarray(path, float)
    gear_1, gear_2 = pair.gears
    sense = 1.0 if gear_2.internal else -1.0
    tangent = math.tan(pair.working_pressure_angle)
    roll_1, roll_2 = gear_1.base_radius * tangent + zeta, gear_2.base_radius * tangent + sense * zeta
    speed_1, speed_2 = (2.0 * math.pi * mesh_frequency / gear.teeth for gear in pair.gears)
    with np.errstate(divide="ignore", invalid="ignore"):
        # 1/rho = 1/rho_1 + 1/rho_2, minus with an internal gear 2
        radius = roll_1 * roll_2 / (roll_2 - sense * roll_1) / math.cos(base_helix)
    return PathSpeeds(zeta, speed_1 * roll_1, speed_2 * roll_2, radius)


def sliding_per_path(pair: GearPair) -> float:
    """Compute sliding speed over path coordinate and speed of gear 1: ``1 + z_1/z_2``, minus with an internal gear."""
    sense = -1.0 if pair.gear_2.internal else 1.0
    return 1.0 + sense * pair.gear_1.teeth / pair.gear_2.teeth


def partial_contact_ratios(pair: GearPair) -> tuple[float, float]:
    """Compute the parts of the transverse contact ratio after and before the pitch point, eps_1 and eps_2."""
    start, end = pair.path
    return end / pair.base_pitch, -start / pair.base_pitch


def loss_factor(pair: GearPair, overlap: float = 0.0, base_helix: float = 0.0) -> float:
    """Compute H_V with the load in equal parts on all lines of contact, whatever the contact ratios are.

    Half of the load in double contact of spur teeth. The mean over the mesh period is a sum of Gauss rules between the
    positions at which a line of contact begins, ends or passes the pitch point.

    Parameters
    ----------
    overlap : float
        Overlap ratio of helical teeth [1].
    base_helix : float
        Helix angle on the base cylinder [rad].
    """
    start, end = (place / pair.base_pitch for place in pair.path)
    lean = abs(overlap)
    breaks = np.array([place + side * 0.5 * lean for place in (start, 0.0, end) for side in (-1.0, 1.0)]) % 1.0
    breaks = np.unique(np.concatenate([breaks, [0.0, 1.0]]))
    low, length = breaks[:-1, None], np.diff(breaks)[:, None]
    phase = (low + 0.5 * length * (1.0 + _NODES)).ravel()
    weight = (0.5 * length * _WEIGHTS).ravel()
    pairs = np.arange(math.floor(start - lean) - 1, math.ceil(end + lean) + 2)
    in_contact, distance = _lines(phase + pairs[:, None], start, end, lean)
    mean = float(weight @ (distance.sum(axis=0) / in_contact.sum(axis=0)))
    pitch = 2.0 * math.pi / pair.gear_1.teeth
    return pitch * sliding_per_path(pair) * mean / math.cos(base_helix)


def _lines(middle: np.ndarray, start: float, end: float, lean: float) -> tuple[np.ndarray, np.ndarray]:
    """Share of the width in which lines of contact touch, and the integral of their |path| over it [base pitches].

    Lines pass the middle of the width at ``middle``, and are ``lean`` further on from one end of it to the other.
    """
    if lean < PITCH_ZONE:
        touches = ((middle >= start) & (middle <= end)).astype(float)
        return touches, touches * np.abs(middle)
    low, high = np.clip(middle - 0.5 * lean, start, end), np.clip(middle + 0.5 * lean, start, end)
    return (high - low) / lean, 0.5 * (high * np.abs(high) - low * np.abs(low)) / lean


def closed_loss_factor(pair: GearPair, base_helix: float = 0.0) -> float:
    """Compute H_V in closed form; NaN where it does not hold: partial contact ratios beyond 1, or negative ones.

    ``H_V = pi (u + 1) / (z_1 u cos(beta_b)) (1 - eps_alpha + eps_1^2 + eps_2^2)`` (H. Ohlendorf, 1958; ISO/TR
    14179-2:2001), with u - 1 where gear 2 is internal, for contact ratios from 1 to 2.
    """
    after, before = partial_contact_ratios(pair)
    whole = after + before
    if not (0.0 <= min(after, before) and max(after, before) <= 1.0 <= whole <= 2.0):
        return math.nan
    form = 1.0 - whole + after**2 + before**2
    return math.pi / pair.gear_1.teeth * sliding_per_path(pair) * form / math.cos(base_helix)


def schlenk_friction(
    line_load: Any, sum_speed: Any, radius: Any, *, viscosity: float, roughness: float, lubricant: float = 1.0
) -> Any:
    """Compute the mean coefficient of friction of L. Schlenk (thesis TU Munich 1994; ISO/TR 14179-2:2001, eq. 37).

    ``mu = 0.048 (F_bt/b / (v_sum rho))^0.2 eta^-0.05 R_a^0.25 X_L`` in N/mm, m/s, mm, mPa s and um.

    Parameters
    ----------
    line_load : float or (...) array
        Force at the base circle over face width [N/m]; below 150 N/mm that counts, as the report has it.
    sum_speed : float or (...) array
        Sum of the surface speeds at the pitch point [m/s], at most 50 m/s counts.
    radius : float or (...) array
        Radius of relative curvature at the pitch point in the normal section [m].
    viscosity : float
        Dynamic viscosity of the oil at its temperature in operation [Pa s].
    roughness : float
        Mean R_a of both flanks [m].
    lubricant : float
        X_L: 1 of mineral oils, see `LUBRICANT_FACTORS`.
    """
    load = np.maximum(1e-3 * np.asarray(line_load, float), SCHLENK_LEAST_LOAD)
    return 0.048 * _load_speed(load, sum_speed, radius) * _oil(viscosity) * (1e6 * roughness) ** 0.25 * lubricant


def niemann_friction(
    line_load: Any, sum_speed: Any, radius: Any, *, viscosity: float, roughness: float, lubricant: float = 1.0
) -> Any:
    """Compute the mean coefficient of friction of Niemann and Winter, which ISO/TS 6336-22:2018 has too.

    ``mu = 0.045 (F_bt/b / (v_sum rho))^0.2 eta^-0.05 X_R X_L`` with ``X_R = 2.2 (R_a / rho)^0.25``, in N/mm, m/s, mm,
    mPa s and um (G. Niemann, H. Winter, Maschinenelemente II, 1983; ISO/TR 13989-2:2000). Parameters as of
    `schlenk_friction`; loads below 150 N/mm and speeds beyond 50 m/s count as these.
    """
    load = np.maximum(1e-3 * np.asarray(line_load, float), SCHLENK_LEAST_LOAD)
    rough = 2.2 * (1e6 * roughness / (1e3 * np.asarray(radius, float))) ** 0.25
    return 0.045 * _load_speed(load, sum_speed, radius) * _oil(viscosity) * rough * lubricant


def flash_friction(
    line_load: Any, sum_speed: Any, radius: Any, *, viscosity: float, roughness: float, lubricant: float = 1.0
) -> Any:
    """Compute the mean coefficient of friction of the flash temperature (ISO/TS 6336-20:2017).

    ``mu = 0.060 (w_Bt / (v_sum rho))^0.2 eta^-0.05 R_a^0.25 X_L`` in N/mm, m/s, mm, mPa s and um. Parameters as of
    `schlenk_friction`.
    """
    load = 1e-3 * np.asarray(line_load, float)
    return 0.060 * _load_speed(load, sum_speed, radius) * _oil(viscosity) * (1e6 * roughness) ** 0.25 * lubricant


SCHLENK_LEAST_LOAD, FASTEST = 150.0, 50.0
"""Line load [N/mm] below which, and sum of speeds [m/s] beyond which coefficients of friction stay as they are."""
LUBRICANT_FACTORS = {"mineral": 1.0, "PAO": 0.8, "polyglycol": 0.7, "water-soluble polyglycol": 0.6}
"""X_L of kinds of oil (ISO/TS 6336-20 and -22)."""
FRICTION_LAWS = {"schlenk": schlenk_friction, "niemann": niemann_friction, "iso": flash_friction}
"""Coefficients of friction by the name of the entry ``losses.friction``."""


def _load_speed(load: Any, sum_speed: Any, radius: Any) -> Any:
    """Compute ``(w / (v rho))^0.2`` of N/mm, m/s and m."""
    return (load / (np.minimum(sum_speed, FASTEST) * 1e3 * np.asarray(radius, float))) ** 0.2


def _oil(viscosity: float) -> float:
    """Compute ``eta^-0.05`` of Pa s."""
    return (1e3 * viscosity) ** -0.05


def table_friction(
    line_load: Any, speed: Any, *, loads: tuple[float, ...], speeds: tuple[float, ...], coefficients: Any
) -> Any:
    """Interpolate coefficients of friction (loads, speeds) of a table in line load [N/m] and pitch line speed [m/s].

    Linear in both; beyond the table its edge counts.
    """
    values, given = np.asarray(coefficients, float), np.broadcast(line_load, speed)
    place = [
        np.interp(np.ravel(np.broadcast_to(at, given.shape)), grid, np.arange(len(grid)))
        for at, grid in ((line_load, loads), (speed, speeds))
    ]
    low = [np.minimum(at.astype(int), max(len(grid) - 2, 0)) for at, grid in zip(place, (loads, speeds), strict=True)]
    result = np.zeros(place[0].shape)
    for up in (0, 1):
        for right in (0, 1):
            row = np.minimum(low[0] + up, len(loads) - 1)
            column = np.minimum(low[1] + right, len(speeds) - 1)
            share = np.abs(1 - up - (place[0] - low[0])) * np.abs(1 - right - (place[1] - low[1]))
            result += share * values[row, column]
    return result.reshape(given.shape)
