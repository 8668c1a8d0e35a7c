"""Willis' equations of stepped and Ravigneaux sets in closed form, beside those that femgear makes of their pairs."""

from fractions import Fraction

from femgear.gears.power_flow import planetary_condition
from femgear.gears.shaft_graph import EXTERNAL, INTERNAL, SpeedCondition, StageGears


def stepped_condition(name, sun, carrier, ring, sun_teeth, first, second, ring_teeth):
    """Tie the speeds of a set whose planets have a first gear on the sun and a second one on the ring.

    ``z_s z_b (w_s - w_c) + z_a z_r (w_r - w_c) = 0``. A shaft that is None is the casing.
    """
    on_sun, on_ring = sun_teeth * second, first * ring_teeth
    weights = {sun: Fraction(on_sun), ring: Fraction(on_ring), carrier: Fraction(-on_sun - on_ring)}
    gears = StageGears(
        {"sun": sun_teeth, "first planet": first, "second planet": second, "ring": ring_teeth},
        {"sun": sun, "carrier": carrier, "ring": ring},
        (("sun", "first planet", EXTERNAL), ("second planet", "ring", INTERNAL)),
        (("first planet", "second planet"),),
    )
    return SpeedCondition(name, {shaft: weight for shaft, weight in weights.items() if shaft is not None}, gears)


def ravigneaux_conditions(name, small_sun, large_sun, carrier, ring, small_teeth, large_teeth, ring_teeth):
    """Tie the speeds of a Ravigneaux set: by short and long planets from the small sun, by long ones from the large."""
    small = planetary_condition(f"{name} small sun", small_sun, carrier, ring, small_teeth, ring_teeth, double=True)
    return small, planetary_condition(f"{name} large sun", large_sun, carrier, ring, large_teeth, ring_teeth)
