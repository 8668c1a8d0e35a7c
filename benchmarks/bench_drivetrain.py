"""The 36-dof drivetrain: a minute of integration."""

from functools import cache
from time import process_time

import pytest

# seconds of the core: the wall clock counts what else runs on it
pytestmark = pytest.mark.benchmark(timer=process_time)

MINUTE = "Wind turbine drivetrain, 36 dof"
LIMIT = 60.0
"""Seconds of one core that a minute at 20 kHz may take."""
STEP = 5e-5


@cache
def model():
    from published.wind_turbine_drivetrain import wind_turbine_drivetrain

    from femgear.trains.drivetrain.model import drivetrain_model

    return drivetrain_model(wind_turbine_drivetrain())


def run(duration, step, **options):
    from published.wind_turbine_drivetrain import PRINTED, paper_torques

    from femgear.trains.drivetrain.parts import constant_torques
    from femgear.trains.drivetrain.simulation import march_drivetrain

    torques = constant_torques(paper_torques(balanced=True))
    return march_drivetrain(model(), torques, duration=duration, step=step, speed=PRINTED.speed, outputs=(), **options)


def test_a_minute_at_20_khz(benchmark):
    from femgear.trains.drivetrain.simulation import Records

    benchmark.group = MINUTE
    model()
    records = Records(20, lowpass=True)
    found = benchmark.pedantic(run, args=(60.0, STEP), kwargs={"records": records}, rounds=1)
    assert found.energy_balance.error < 1e-6 and found.momentum < 1e-6
    note = f"{found.steps} steps, 15 terms of the mesh stiffness, records low-passed to 1 kHz; "
    note += f"energy balance {found.energy_balance.error:.0e}; time of the process"
    benchmark.extra_info.update(title="average acceleration, 60 s at 20 kHz", note=note, limit=LIMIT)
    if benchmark.stats is not None:
        assert benchmark.stats.stats.median < LIMIT
