"""Key figures of pairs and planetary sets: lives, losses, temperatures, and of pairs errors and stresses too."""

from __future__ import annotations

from typing import Any

from femgear.case.load_spectrum import has_rated_bearings, required_life
from femgear.case.tooth_friction import friction_acts
from femgear.stages.heat_results import HEAT_KEY_FIGURES
from femgear.stages.key_figures import DECIBEL, MICROMETRES, STRESS, KeyFigure, Stored
from femgear.stages.life_results import LIFE_FIGURES, PLANET_BEARING_FIGURE, SPECTRUM_FIGURES
from femgear.stages.losses_results import LOSS_FIGURES
from femgear.stages.static_results import peak_to_peak

FRICTION_FIGURE = KeyFigure("friction change", DECIBEL, "dynamics", Stored("friction_change"), whole=True)
"""What friction that acts adds to the level of the housing, of a pair to the bearing forces, at most."""
TOOTH_FIGURES = (
    *LIFE_FIGURES,
    *SPECTRUM_FIGURES,
    PLANET_BEARING_FIGURE,
    *LOSS_FIGURES,
    *HEAT_KEY_FIGURES,
    FRICTION_FIGURE,
)
"""Of all that load cases, oil and losses give a set or a pair."""


def tooth_key_figures(case: Any) -> tuple[KeyFigure, ...]:
    """List the key figures of a set or a pair that its load cases, oil and losses give."""
    return tuple(figure for figure in TOOTH_FIGURES if not missing_entry(case, figure))


def missing_entry(case: Any, figure: KeyFigure) -> str:
    """Say which entry would give a case a figure that the stage has not without it; empty where nothing is missing."""
    if figure in SPECTRUM_FIGURES and required_life(case.operation) is None:
        return "operation.required_hours"
    if figure == FRICTION_FIGURE and not friction_acts(case):
        return "losses.excites"
    if figure == PLANET_BEARING_FIGURE and not has_rated_bearings(case):
        return "planet.dynamic_rating" if hasattr(case, "planet") else "a planetary set"
    return ""


def pair_key_figures(case: Any) -> tuple[KeyFigure, ...]:
    """List the key figures of a pair: transmission error, stresses, and those of lives and losses."""
    pressure, root = Stored("largest_pressure"), Stored("root_worst")
    return (
        KeyFigure("STE", MICROMETRES, "static", _transmission_error, ("W-PARTED", "W-POSITIONS"), whole=True),
        KeyFigure("contact pressure", STRESS, "static", pressure, ("W-PRESSURE", "W-EDGE", "W-KINK"), whole=True),
        KeyFigure("root stress", STRESS, "stress", root, ("W-KINK",), whole=True),
        *tooth_key_figures(case),
    )


def _transmission_error(data: Any) -> float:
    """Largest transmission error of a mesh, peak to peak [m]."""
    return float(peak_to_peak(data, "ste").max())
