"""Case file of the oscillator: ``model = "oscillator"``."""

from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict

from femgear.case.quantities import MASS, STIFFNESS, Number, Quantity, Title
from femgear.case.text import CaseFile, ReadCase


class OscillatorSection(BaseModel):
    """A mass on a spring."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    mass: Annotated[float, Quantity(MASS, 1e-3, 1e3)]
    stiffness: Annotated[float, Quantity(STIFFNESS, 1.0, 1e12)]
    damping_ratio: Annotated[float, Number(0.0, 1.0)] = 0.02


class OscillatorCase(ReadCase):
    """A simple oscillator."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    train: ClassVar[str] = "oscillator"
    model: Literal["oscillator"]
    title: Title
    oscillator: OscillatorSection


FILE = CaseFile(OscillatorCase)
