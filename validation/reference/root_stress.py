"""Root stress influences from solutions of their own, beside those that are observed with the flanks."""

from femgear.contact.bodies import Sectors
from femgear.contact.root_stress import RootStresses, root_stress_influence
from femgear.fe.elasticity import Material


def set_root_stress(sectors: Sectors, material: Material) -> RootStresses:
    """Influences of sun, planet and ring, each held at its rim as in `bodies.make_bodies`."""
    return RootStresses(tuple(root_stress_influence(s.grid, s.gear, material) for s in sectors.gears))
