"""What a case of gears of another train gives, and what is made of it."""

from dataclasses import replace
from typing import Any, ClassVar

import pytest

from femgear.case.flank_sections import GearErrors
from femgear.case.gear_set import need_set, planetary_set, set_deviations
from femgear.case.teeth import GearCase, runout_of
from femgear.errors import CaseError, GeometryError
from femgear.gears.deviations import no_deviations
from femgear.gears.gear import Gear
from femgear.gears.pair import close_pair


class Twins(GearCase):
    """Two equal gears."""

    train: ClassVar[str] = "twins"
    gear_names: ClassVar[tuple[str, ...]] = ("left", "right")
    model: str = "twins"
    teeth: int = 30
    made: ClassVar[list] = []

    def closed_gears(self) -> Any:
        self.made.append(self)
        gear = {"teeth": self.teeth, "module": 2e-3, "pressure_angle": 0.35, "profile_shift": 0.1}
        gear |= {"face_width": 0.02, "rim_radius": 0.01}
        return close_pair(*(Gear(**gear, name=name) for name in self.gear_names))

    def made_deviations(self, gears: Any) -> Any:
        return replace(
            no_deviations(gears), sun_runout=runout_of(GearErrors.model_validate({"runout_amplitude": "7 um"}))
        )

    def torque_on_first_gear(self, torque: float | None = None) -> float:
        return 3.0 if torque is None else torque


def test_a_case_of_another_train_says_by_methods_what_its_gears_are():
    case = Twins()
    assert [gear.name for gear in planetary_set(case).gears] == ["left", "right"]
    assert set_deviations(case).sun_runout.amplitude == pytest.approx(7e-6)
    planetary_set(case)
    assert case.made == [case], "gears are made once for a case"
    with pytest.raises(CaseError, match="E-MODEL"):
        need_set(case)


def test_what_its_gears_cannot_be_is_refused():
    with pytest.raises(GeometryError, match="E-TEETH"):
        planetary_set(Twins(teeth=2))


def test_a_case_that_leaves_a_method_out_is_none():
    class Half(GearCase):
        def closed_gears(self) -> Any:
            return None

    with pytest.raises(TypeError, match="made_deviations"):
        Half()  # type: ignore[abstract]
