"""Stages of the oscillator: its natural frequency, its receptance."""

from dataclasses import dataclass

import numpy as np

from femgear.report.tables import Block
from femgear.stages.protocol import Figures, Stage, StageResult, Train
from femgear.storage.results import dataset


@dataclass(frozen=True)
class ModesResult(StageResult):
    """Natural frequency [Hz]."""

    frequency: float

    def dataset(self):
        """Contents of modes.nc."""
        return dataset({"frequency": ((), self.frequency, "Hz", "natural frequency")}, {}, {"title": "oscillator"})


@dataclass(frozen=True)
class ReceptanceResult(StageResult):
    """Receptance (n,) [m/N] over the frequency (n,) [Hz]."""

    frequency: np.ndarray
    receptance: np.ndarray

    def dataset(self):
        """Contents of receptance.nc."""
        return dataset(
            {"receptance": (("frequency",), self.receptance, "m/N", "amplitude of the displacement")},
            {"frequency": (("frequency",), self.frequency, "Hz", "frequency of the force")},
            {"title": "oscillator"},
        )


def solve_modes(case):
    """Natural frequency ``sqrt(k/m) / 2 pi``."""
    given = case.oscillator
    return ModesResult(float(np.sqrt(given.stiffness / given.mass) / (2 * np.pi)))


def solve_receptance(case, modes):
    """Receptance ``1 / (k (1 - r^2 + 2 i zeta r))``, r the frequency over the natural one."""
    ratio = np.linspace(0.0, 3.0, 301)
    given = case.oscillator
    factor = 1 - ratio**2 + 2j * given.damping_ratio * ratio
    frequency = modes.frequency * ratio
    return ReceptanceResult(frequency, np.abs(1 / (given.stiffness * factor)))


def draw(drawn):
    """Receptance over the frequency."""
    from femgear.report.style import label, new_figure

    data = drawn.data["receptance"]
    figure, (ax,) = new_figure()
    ax.semilogy(data["frequency"], data["receptance"])
    label(ax, "frequency [Hz]", "receptance [m/N]")
    return {"receptance": figure}


OSCILLATOR = Train(
    name="oscillator",
    words="an oscillator",
    stages=(
        Stage(
            name="modes",
            title="Modes",
            solve=solve_modes,
            verdict=lambda result: {"modes": 1},
            describe=lambda results: Block(
                "Modes", ("frequency [Hz]",), ((f"{float(results.modes['frequency']):.3f}",),)
            ),
        ),
        Stage(
            name="receptance",
            title="Receptance",
            solve=solve_receptance,
            takes=("modes",),
            verdict=lambda result: {"points": len(result.frequency)},
            describe=lambda results: Block(
                "Receptance", ("largest [m/N]",), ((f"{float(results.receptance['receptance'].max()):.4g}",),)
            ),
            needs=lambda case: ("modes",),
        ),
    ),
    describe=lambda case: (Block("Oscillator"),),
    warnings=lambda case: (),
    figures={"receptance": Figures({"receptance": "Displacement of the mass for a unit force."}, draw)},
)
