"""How signals of a run are sampled for other programs."""

from __future__ import annotations

import math
from dataclasses import dataclass

from femgear.errors import CaseError

_SAMPLES = 50_000_000
"""Samples of a signal, at most: 17 minutes at 48 kHz."""
_SLOWEST = 1000  # samples a second: a file of fewer holds no gear noise, and few players take it


@dataclass(frozen=True)
class Sampling:
    """How signals are sampled.

    Parameters
    ----------
    rate
        Samples a second [Hz], 1000 or more; lines at half of it and above are left out.
    duration
        Of every signal at one speed [s]; whole turns of the carrier come nearest to it.
    run_up
        Duration of the run-up from the first to the last of its speeds [s].
    pressure_scale
        Full scale of WAV files of sound pressure [Pa]: the sample 1.0 stands for it. Default: one for all
        files, which the sum of the amplitudes of no speed exceeds.
    acceleration_scale
        Full scale of WAV files of acceleration [m/s^2], with the same default.
    force_scale
        Full scale of WAV files of force [N], with the same default.
    level
        Unit and detector of order_cuts.csv: "mm/s rms", "g peak", "um peak", "dB rms" (re 1e-6 m/s^2), ...
    """

    rate: int = 48000
    duration: float = 10.0
    run_up: float = 30.0
    pressure_scale: float | None = None
    acceleration_scale: float | None = None
    force_scale: float | None = None
    level: str = "m/s^2 rms"

    def __post_init__(self):
        from femgear.housing.sound import LEVELS  # noqa: PLC0415  femgear --help needs samplings, but no numbers

        if self.level not in LEVELS:
            raise CaseError(
                "no such level",
                code="E-CHOICE",
                key="--level",
                value=self.level,
                limit=", ".join(LEVELS),
                remedy="leave it out for the default",
            )
        for name, value in vars(self).items():
            least = _SLOWEST if name == "rate" else 0.0
            if name != "level" and value is not None and not (least <= value < math.inf and value > 0.0):
                raise CaseError(
                    "no such sampling",
                    code="E-RANGE",
                    key=f"--{name.replace('_', '-')}",
                    value=value,
                    limit=f"{least:g} Hz or more" if least else "a number above zero",
                    remedy="leave it out for the default",
                )
        samples = self.rate * max(self.duration, self.run_up)
        if samples > _SAMPLES:
            raise CaseError(
                "signals of so many samples take too much memory",
                code="E-MEMORY",
                value=f"{samples:.4g}",
                limit=f"{_SAMPLES:.4g}",
                remedy="lower --rate, --duration or --run-up",
            )
