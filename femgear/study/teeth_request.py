"""What tooth numbers are searched for, as a user says it: light, for the command line reads it at its start."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class WantedTeeth:
    """What gears are searched for.

    Parameters
    ----------
    kind
        planetary, pair, stepped (planets with two gears), double (pairs of planets) or ravigneaux.
    planets
        A number, or as 3..5 all from one to another; may be repeated.
    tolerance
        Largest relative deviation from the ratio.
    fixed
        Member of a set that stands: ring, carrier (the ring is driven), or sun (the ring drives). Of a Ravigneaux set
        the small sun drives, and sun is the large one, the default.
    most
        Teeth to size; of more, those nearest to the ratio.
    best
        Teeth whose transmission error is computed: the smallest of every phasing, then the smallest.
    positions
        Positions over one mesh period for the transmission error.
    flank_elements
        Elements along a flank for it.
    """

    kind: str = "planetary"
    planets: tuple[str, ...] = ("3",)
    tolerance: float = 0.02
    fixed: str | None = None
    most: int = 10_000
    best: int = 12
    positions: int = 24
    flank_elements: int = 12


@dataclass(frozen=True)
class TeethStrength:
    """What decides the size of gears.

    Parameters
    ----------
    torque
        On sun or gear 1. Sizes go with its third root, their order does not depend on it.
    width_ratio
        Face width over the reference diameter of the smaller external gear of a mesh.
    contact_limit, root_limit
        sigma_Hlim and sigma_Flim. Default: case hardened steel, grade MQ.
    load_factor
        Product of all load factors K of ISO 6336.
    contact_safety, root_safety
        Least S_H and S_F.
    """

    torque: str = "100 N m"
    width_ratio: float = 0.8
    contact_limit: str = "1500 MPa"
    root_limit: str = "425 MPa"
    load_factor: float = 1.5
    contact_safety: float = 1.1
    root_safety: float = 1.4
