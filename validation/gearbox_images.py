"""Gearboxes put down in another way: turned, shifted, mirrored, renamed and in other units they are themselves."""

from __future__ import annotations

from collections import defaultdict

from random_gearboxes import IMAGES, random_gearbox, unlike

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.reading import read_case
from validation.rows import Row, at_most

_COUNT = 10


def images() -> tuple[Row, ...]:
    """Random gearboxes of two stages, pairs and planetary sets, some in casings, beside their images."""
    worst: dict[str, float] = defaultdict(float)
    for seed in range(_COUNT):
        tables = random_gearbox(seed, 2)
        state = solve_deflection(read_case(tables))
        for name in IMAGES:
            worst[name] = max(worst[name], *unlike(tables, state, name, seed).values())
    text = "forces, motions and natural frequencies, largest difference over the largest"
    return tuple(
        at_most(f"{_COUNT} random gearboxes", "the same gearbox", f"{name}: {text}", 1e-9, apart)
        for name, apart in worst.items()
    )
