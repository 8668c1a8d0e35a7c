"""What a command asks of labelled signals of faulty gears."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FaultRequest:
    """What machines are drawn, and how their signals are recorded.

    Parameters
    ----------
    kinds
        Kinds of machines, separated by commas: healthy, crack, spall, missing, broken corner, wear. Each machine takes
        the next one. Default: all.
    gears
        Gears that have the faults, separated by commas: sun, planet, ring. Default: all.
    sizes
        As "crack=0.5 mm..2 mm,wear=2 um..20 um": depth of cracks and wear, length of spalls and broken corners.
        Default: some parts of the module.
    speeds
        First and last speed of the input. Default: half the largest of the case, and that.
    torques
        Smallest and largest torque of the input. Default: half of that of the case, and that.
    count
        Number of records.
    each
        Records of each machine, every one at a speed of its own.
    seed
        Seed of all that is drawn. Record i of a seed is the same, however many there are.
    noise
        White noise, by its root mean square over that of the signal, as "-30 dB"; or none.
    duration
        Length of a record.
    rate
        Samples a second [Hz].
    up_to
        Highest frequency of the mesh forces. Default: that of the case, else 5 kHz.
    """

    kinds: tuple[str, ...] = ()
    gears: tuple[str, ...] = ()
    sizes: tuple[str, ...] = ()
    speeds: tuple[str, str] | None = None
    torques: tuple[str, str] | None = None
    count: int = 1000
    each: int = 20
    seed: int = 1
    noise: str = "-30 dB"
    duration: str = "1 s"
    rate: int = 25600
    up_to: str | None = None


@dataclass(frozen=True)
class FurtherRecords:
    """Further files of records.

    Parameters
    ----------
    wav
        A WAV file of every record, in which 1.0 stands for 1 m/s^2.
    csv
        A table of time and acceleration of every record.
    index
        Compute this record alone: record_INDEX.nc, the same to the last bit, and its case record_INDEX.toml.
    limits
        Find from which size on faults stand out of healthy sets, with so many sizes of every kind. limits.csv and
        limits.png are written, and no records.
    """

    wav: bool = False
    csv: bool = False
    index: int | None = None
    limits: int | None = None
