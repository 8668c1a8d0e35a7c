"""Time signals from WAV and MATLAB files, of all versions, by SciPy and h5py."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case.text import read_bytes
from femgear.errors import printable
from femgear.measured.channels import (
    LEAST_SAMPLES,
    MOST_BYTES,
    Channel,
    agreed_rate,
    file_problem,
    is_rate,
    is_time,
    rate_of_times,
)

_SCALE = re.compile(rb"1\.0 = ([0-9.eE+-]+) ([^;]{1,20}); femgear")
"""What a WAV file of femgear says of its full scale."""
_HDF5, _HDF5_AT = b"\x89HDF", (0, 512)
"""How a file of version 7.3 begins, at its beginning or after MATLAB's own 512 bytes."""
_MOST_CHANNELS = 1000


def read_wav_signals(path: str | os.PathLike, *, rate: float | None = None) -> tuple[Channel, ...]:
    """Read the channels of a WAV file: whole numbers over their full scale, floats as they are.

    Files of femgear state their full scale, and come back in its unit. CaseError: E-FILE: no WAV file, one that is
    broken off, or another rate than the given one [Hz].
    """
    from scipy.io import wavfile

    name = printable(Path(path).name)
    data = read_bytes(path, MOST_BYTES, "name a WAV file")
    remedy = "copy the file again, or export it as WAV of integers or floats"
    promised = int.from_bytes(data[4:8], "little") + 8 if data[:4] == b"RIFF" else len(data)
    if len(data) < promised < 0xFFFFFFF0:
        raise file_problem(
            name, "the file is broken off", value=f"{len(data)} bytes", limit=f"{promised}", remedy=remedy
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks of other programs
            in_file, samples = wavfile.read(os.fspath(path))
    except Exception as error:  # of many kinds, where a file is damaged
        raise file_problem(name, f"no WAV file that can be read: {str(error)[:120]}", remedy=remedy) from error
    samples = samples.reshape(len(samples), -1)
    unit, scale = "", 1.0
    if samples.dtype.kind in "iu":
        middle = 128.0 if samples.dtype == np.uint8 else 0.0
        samples, scale = samples - middle, 128.0 if middle else float(-np.iinfo(samples.dtype).min)
    elif stated := _SCALE.search(data[-4096:]):
        unit, scale = stated[2].decode("ascii", "replace"), 1.0 / float(stated[1])
    rate = agreed_rate(float(in_file), rate, name)
    numbered = enumerate(samples.T.astype(float) / scale, 1)
    return tuple(Channel(name, f"channel {number}", unit, rate, column) for number, column in numbered)


def read_matlab_signals(path: str | os.PathLike, *, rate: float | None = None) -> tuple[Channel, ...]:
    """Read the vectors and the columns of matrices of a MATLAB file, of structs too, as channels.

    A vector of times, or a number called ``fs``, ``rate`` or the like, tells the samples a second. CaseError: E-FILE:
    no such file, no vectors of one length, no rate.
    """
    name = printable(Path(path).name)
    head = read_bytes(path, MOST_BYTES, "name a MATLAB file")[: _HDF5_AT[-1] + len(_HDF5)]
    hdf5 = any(head[place:].startswith(_HDF5) for place in _HDF5_AT)
    variables = _hdf5_variables(path, name) if hdf5 else _matlab_variables(path, name)
    arrays = list(_numeric("", variables))
    in_file = next((float(value.flat[0]) for title, value in arrays if value.size == 1 and is_rate(_last(title))), None)
    vectors = [(title, column) for title, value in arrays for title, column in _columns(title, value)]
    times = [vector for title, vector in vectors if is_time(_last(title))]
    start = 0.0
    if times:
        in_file, start = rate_of_times(times[0], "s", name, rate)
    signals = [(title, vector) for title, vector in vectors if not is_time(_last(title))]
    if not signals:
        raise file_problem(
            name,
            "no signals",
            value=", ".join(title for title, _ in arrays[:12]) or None,
            limit=f"vectors of {LEAST_SAMPLES} samples or more",
            remedy="save the samples as vectors, and the rate as fs",
        )
    rate = agreed_rate(in_file, rate, name)
    return tuple(Channel(name, title, "", rate, vector, start) for title, vector in signals[:_MOST_CHANNELS])


def _matlab_variables(path: str | os.PathLike, name: str) -> Mapping[str, Any]:
    """Variables of a file of level 4 or 5."""
    from scipy.io import loadmat

    try:
        variables = loadmat(os.fspath(path), simplify_cells=True)
    except Exception as error:  # of many kinds, where a file is damaged
        remedy = "copy the file again, or save it by save('-v7')"
        raise file_problem(name, f"no MATLAB file that can be read: {str(error)[:120]}", remedy=remedy) from error
    return {key: value for key, value in variables.items() if not key.startswith("__")}


def _hdf5_variables(path: str | os.PathLike, name: str) -> Mapping[str, Any]:
    """Variables of a file of version 7.3, which is HDF5 with its dimensions in the reverse order."""
    import h5py

    variables = dict[str, Any]()

    def keep(title: str, item: Any) -> None:
        hidden = title.startswith("#")
        if isinstance(item, h5py.Dataset) and not hidden and item.dtype.kind in "iuf" and item.shape:
            variables[title.replace("/", ".")] = item[()].T

    try:
        with h5py.File(os.fspath(path), "r") as file:
            file.visititems(keep)
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        remedy = "copy the file again, or save it by save('-v7')"
        raise file_problem(name, f"no MATLAB file that can be read: {str(error)[:120]}", remedy=remedy) from error
    return variables


def _numeric(prefix: str, variables: Mapping[str, Any]) -> Iterator[tuple[str, np.ndarray]]:
    """Arrays of real numbers by their names, those of structs as "struct.field"."""
    for key, value in variables.items():
        title = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from _numeric(f"{title}.", value)
        elif np.asarray(value).dtype.kind in "iuf":
            yield title, np.atleast_1d(np.asarray(value, float))


def _columns(title: str, value: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Vectors of an array: itself, or the lines along its longer side where it is a matrix."""
    values = np.squeeze(value)
    if values.ndim == 1 and len(values) >= LEAST_SAMPLES:
        yield title, values
    elif values.ndim == 2 and max(values.shape) >= LEAST_SAMPLES and min(values.shape) <= _MOST_CHANNELS:
        matrix = values if values.shape[0] >= values.shape[1] else values.T
        yield from ((f"{title} {number}", column) for number, column in enumerate(matrix.T, 1))


def _last(title: str) -> str:
    """Name of a field without those of its structs."""
    return title.rpartition(".")[2]
