"""Support stiffness of the members that a case gives a shaft: K = F/X of the shaft by finite elements."""

from __future__ import annotations

from functools import lru_cache

from femgear.casefile.sections import Case
from femgear.errors import FemgearError

MEMBERS = ("sun", "carrier")


def with_shafts(case: Case) -> Case:
    """The case with the support stiffness of its shafts, held at one end and coupled at the other.

    The member stands on the free end of a stepped cantilever, its face rigidly coupled to the axis, which
    may tilt: ``K = F/X``, see `femgear.fe.shaft_body.shaft_support_stiffness`. The shaft is of the material
    of the gears.

    Raises
    ------
    GeometryError
        Parts that make no shaft (E-SHAFT), with file and line.
    """
    found = {}
    for name in MEMBERS:
        section = getattr(case, name)
        if not section.support_shaft:
            continue
        parts = tuple((one.length, one.outer_diameter, one.inner_diameter) for one in section.support_shaft)
        material = case.material
        try:
            stiffness = _stiffness(parts, material.youngs_modulus, material.poisson_ratio, material.density)
        except FemgearError as error:
            error.key = f"{name}.support_shaft"
            error.file = case.location(error.key)
            raise
        found[name] = section.model_copy(update={"support_stiffness": stiffness})
    return case.model_copy(update=found) if found else case


def shaft_lines(case: Case) -> tuple[str, ...]:
    """What the shafts of a case hold, in sentences, with the beam of Timoshenko beside."""
    from femgear.fe.elasticity import Material
    from femgear.fe.shaft_body import ShaftStep, timoshenko_flexibility

    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    lines = []
    for name in MEMBERS:
        section = getattr(case, name)
        if section.support_shaft:
            steps = [
                ShaftStep(one.length, one.outer_diameter, one.inner_diameter) for one in section.support_shaft
            ]
            beam = 1.0 / timoshenko_flexibility(steps, material)[0, 0]
            lines.append(
                f"support of the {name} from its shaft: {section.support_stiffness * 1e-6:.4g} N/um "
                f"(as a beam {beam * 1e-6:.4g})"
            )
    return tuple(lines)


@lru_cache(maxsize=64)
def _stiffness(parts: tuple, youngs_modulus: float, poisson_ratio: float, density: float) -> float:
    from femgear.fe.elasticity import Material
    from femgear.fe.shaft_body import ShaftStep, shaft_support_stiffness

    steps = [ShaftStep(*part) for part in parts]
    return shaft_support_stiffness(steps, Material(youngs_modulus, poisson_ratio, density))
