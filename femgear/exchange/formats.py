"""Signals as WAV, signals, spectra and modes as universal files, tables as spreadsheets, numbers for MATLAB.

Every file is whole or not there. Numbers are in SI units: the sample 1.0 of a WAV file is its full scale,
which the file states; nothing is normalised.
"""

from __future__ import annotations

import io
import shutil
import struct
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from itertools import chain, count, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from femgear.errors import StorageError, nvh_library, printable
from femgear.storage.files import replaced_file

if TYPE_CHECKING:
    import xarray as xr

_QUANTITIES = {"m/s^2": 12, "Pa": 15}
"""Specific data type of a unit: universal file, dataset 58, record 9."""
_ROWS = 1_048_576  # of a sheet: ECMA-376 leaves it open, Excel has no more
_SHEET, _SPREADSHEET = "xl/worksheets/sheet{}.xml", "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
"""Part of a workbook that holds a sheet, by its number from 1, and the names of its elements."""
_ROWS_TOGETHER = 4096
"""Rows of a sheet that are compressed at once."""
_SHEET_EFFORT = 3
"""Of the compression of a workbook, from 1 to 9."""


SCALES = {"Pa": "pressure_scale", "m/s^2": "acceleration_scale", "N": "force_scale"}
"""Full scale of WAV files by unit."""


@dataclass(frozen=True)
class Signal:
    """Sampled signal of a sensor: ``values`` (n,) in its ``unit``, at so many samples a second as its ``rate`` [Hz].

    ``name`` is what files call it; ``steady`` tells whether the speed stays the same.
    """

    name: str
    unit: str
    rate: int
    values: np.ndarray
    steady: bool = True


@dataclass(frozen=True)
class Spectrum:
    """Lines of a sensor at the multiples 0, 1, 2, .. of a frequency ``step`` [Hz], or at a ``frequency`` (n,) each.

    ``name`` is what files call it; ``values`` (n,) are complex peak amplitudes in its ``unit``.
    """

    name: str
    unit: str
    step: float
    values: np.ndarray
    frequency: np.ndarray | None = None


@dataclass(frozen=True)
class Shapes:
    """Modes of a structure at ``points`` (P, 3) [m].

    ``frequency`` (M,) [Hz], ``damping_ratio`` (M,) [1] and mass-normalised ``shape`` (M, P, 3) [kg^-1/2].
    ``words`` tell what the points are, or in which frame they move.
    """

    points: np.ndarray
    frequency: np.ndarray
    damping_ratio: np.ndarray
    shape: np.ndarray
    words: str = "in the frame of the carrier"


def line_extent(parts: Iterable[tuple], rate: float) -> dict[str, tuple[float, float, float]]:
    """Find by unit the largest sum of amplitudes of a speed, and what half a rate [Hz] and above has of it.

    That is the largest root mean square of these lines, with the one of all lines at that speed; of parts
    ``(unit, orders (n,), speeds (s,) [rad/s], amplitudes (s, n))``.
    """
    sums_of = dict[str, tuple[float, float, float]]()
    for unit, order, speed, values in parts:
        power, above = 0.5 * np.abs(values) ** 2, order * speed[:, None] >= np.pi * rate
        lost, (most, least, _) = (power * above).sum(axis=1), sums_of.get(unit, (0.0, 0.0, 0.0))
        worst = int(lost.argmax())
        level = (float(np.sqrt(lost[worst])), float(np.sqrt(power[worst].sum())))
        sums = max(most, float(np.abs(values).sum(axis=1).max()))
        sums_of[unit] = (sums, *(level if level[0] >= least else sums_of[unit][1:]))
    return sums_of


def write_wav(signal: Signal, path: Path, *, full_scale: float = 1.0) -> None:
    """Write a signal as WAV file of 32-bit floats: samples are its values over the full scale, in its unit.

    The full scale stands in the comment of the file (RIFF INFO, ICMT). Samples above 1 are kept as they are;
    most players clip them.

    Parameters
    ----------
    signal : Signal
        Samples in its unit.
    path : path
        File that is written, or replaced as a whole.
    full_scale : float
        Value that becomes 1.0, in the unit of the signal.

    Raises
    ------
    StorageError
        A full disk (E-DISK-FULL), a file that cannot be written (E-STORAGE).
    """
    from scipy.io import wavfile

    text = f"{signal.name}; 1.0 = {full_scale:.9g} {signal.unit}; femgear".encode("ascii", "replace") + b"\0"
    text += b"\0" * (len(text) % 2)
    comment = b"LIST" + struct.pack("<I", len(text) + 12) + b"INFOICMT" + struct.pack("<I", len(text)) + text
    samples = (signal.values / full_scale).astype(np.float32)
    with replaced_file(path, size=samples.nbytes) as temporary:
        wavfile.write(temporary, signal.rate, samples)
        with open(temporary, "r+b") as stream:
            end = stream.seek(0, 2)
            stream.write(comment)
            stream.seek(4)
            stream.write(struct.pack("<I", end + len(comment) - 8))


def write_functions(signals: Iterable[Signal], spectra: Iterable[Spectrum], path: Path) -> None:
    """Write signals and spectra as universal file, datasets 164 (SI units) and 58.

    Spectra have the function type 0: of complex lines the library writes no other. The format holds the step
    of the abscissa with six digits and values with twelve; ID line 2 tells the rate or step in full. Lines at
    frequencies of their own have an uneven abscissa.
    """
    unused = {f"{name}_spec_data_type": 0 for name in ("orddenom", "z_axis")} | {"z_axis_value": 0.0}
    scalar = {"rsp_dir": 0, "ref_node": 0, "ref_dir": 0, "binary": 0, "abscissa_spacing": 1, **unused}
    with _universal_file(path) as write:
        for number, signal in enumerate(chain[Signal | Spectrum](signals, spectra), 1):
            uneven = signal.frequency if isinstance(signal, Spectrum) else None
            if isinstance(signal, Signal):
                step, words = 1 / signal.rate, f"samples a second [Hz]: {signal.rate!r}"
                kind = {"func_type": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s"}
            else:
                step, words = signal.step, f"peak amplitudes, step [Hz]: {signal.step!r}"
                words = words if uneven is None else "peak amplitudes of lines, which are not evenly spaced"
                kind = {"func_type": 0, "abscissa_spec_data_type": 18, "abscissa_axis_units_lab": "Hz"}
            unit = {"ordinate_spec_data_type": _QUANTITIES[signal.unit], "ordinate_axis_units_lab": signal.unit}
            x = step * np.arange(len(signal.values)) if uneven is None else uneven
            data = {"data": signal.values, "x": x, "id1": signal.name, "id2": words}
            spaced = scalar | {"abscissa_spacing": int(uneven is None)}
            write(58, rsp_node=number, **data, **kind, **unit, **spaced)


def write_modes(shapes: Shapes, path: Path) -> None:
    """Write modes as universal file: datasets 164 (SI units), 15 (nodes) and one 55 (normal mode) for each.

    Shapes are normalised to the modal mass 1 kg; the format holds six digits. The words of the shapes are
    ID line 1.
    """
    nodes = np.arange(1, len(shapes.points) + 1)
    # structural model, normal mode, displacement vectors, real
    fixed = {"model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "data_type": 2}
    fixed |= {"n_data_per_node": 3, "load_case": 1, "modal_damp_his": 0.0, "node_nums": nodes}
    with _universal_file(path) as write:
        write(15, node_nums=nodes, **dict(zip("xyz", shapes.points.T)))
        modes = zip(shapes.frequency.tolist(), shapes.damping_ratio.tolist(), shapes.shape)
        for number, (frequency, damping, shape) in enumerate(modes, 1):
            motion = dict(zip(("r1", "r2", "r3"), shape.T))
            always = {"mode_n": number, "freq": frequency, "modal_m": 1.0, "modal_damp_vis": damping}
            write(55, id1=shapes.words, **always, **motion, **fixed)


@contextmanager
def _universal_file(path: Path) -> Iterator[Any]:
    """Give a function ``(dataset, **fields)`` that appends to a new universal file in SI units."""
    with nvh_library("universal files"):
        import pyuff
    with replaced_file(path) as temporary, tempfile.TemporaryDirectory() as place:
        # after every data set the library reads its file again: one of that set alone
        of_one_set = Path(place) / "set.uff"
        file = pyuff.UFF(str(of_one_set))

        def write(kind: int, **values: object) -> None:
            try:
                file.write_sets(getattr(pyuff, f"prepare_{kind}")(**values), mode="overwrite")
            except Exception as error:  # the library hides what happened: a full disk, an interrupt
                raise error.__context__ or error from None
            with open(of_one_set, "rb") as written, open(temporary, "ab") as whole:
                shutil.copyfileobj(written, whole)

        scales = {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
        write(164, units_code=1, units_description="SI", temp_mode=1, **scales)
        yield write


def write_workbook(tables: Iterable[tuple[str, Any]], path: Path) -> list[str]:
    """Write pandas tables by name as spreadsheet (xlsx), one sheet for each; no text becomes a formula.

    Numbers that are not finite become text. Returns the names of tables of more rows than a sheet has, which
    are left out.
    """
    with nvh_library("spreadsheets"):
        from openpyxl import Workbook
    book, titles, long = Workbook(), set[str](), list[str]()
    book.remove(book.worksheets[0])
    with replaced_file(path) as temporary, ZipFile(temporary, "w", ZIP_DEFLATED, compresslevel=_SHEET_EFFORT) as parts:
        for name, frame in tables:
            if len(frame) >= _ROWS:
                long.append(f"{name} ({len(frame)} rows)")
                continue
            book.create_sheet(_sheet_name(name, titles))
            with parts.open(_SHEET.format(len(titles)), "w", force_zip64=True) as sheet:
                rows = _sheet_rows(frame)
                while block := "".join(islice(rows, _ROWS_TOGETHER)):
                    sheet.write(block.encode())
        if not titles:  # a book without a sheet cannot be opened
            book.create_sheet()
        # the library makes all but the rows, for which it takes ten times as long as all the rest
        shell = io.BytesIO()
        book.save(shell)
        written = set(parts.namelist())
        with ZipFile(shell) as others:
            for part in others.namelist():
                if part not in written:
                    parts.writestr(part, others.read(part))
    return long


def _sheet_rows(frame: Any) -> Iterator[str]:
    """Write a pandas table as the sheet of a workbook (ECMA-376-1, 18.3), part by part: its beginning, rows, end."""
    letters = [_column_letters(number) for number in range(frame.shape[1])]
    yield f'<worksheet xmlns="{_SPREADSHEET}"><sheetData>'
    row = "".join(f'<c r="{letter}{{0}}"{{{place}}}' for place, letter in enumerate(letters, start=1))
    write = f'<row r="{{0}}">{row}</row>'.format
    yield write(1, *(_sheet_cell(str(column)) for column in frame.columns))
    columns = [_sheet_cells(frame.iloc[:, place]) for place in range(frame.shape[1])]
    yield from map(write, count(2), *columns)
    yield "</sheetData></worksheet>"


def _sheet_cells(column: Any) -> Iterable[str]:
    """Cells of a column: what follows their places."""
    values = column.tolist()
    if column.dtype.kind in "iu" or (column.dtype.kind == "f" and np.isfinite(column.to_numpy()).all()):
        return (f"><v>{value!r}</v></c>" for value in values)
    if all(isinstance(value, str) for value in values):
        cells = {value: _sheet_cell(value) for value in set(values)}  # names stand in many rows
        return map(cells.__getitem__, values)
    return map(_sheet_cell, values)


def _sheet_cell(value: Any) -> str:
    """Cell of a value: what follows its place."""
    if isinstance(value, bool):
        return f' t="b"><v>{value:d}</v></c>'
    if isinstance(value, int) or (isinstance(value, float) and np.isfinite(value)):
        return f"><v>{value!r}</v></c>"
    # as text of its own, a beginning = makes no formula
    return f' t="inlineStr"><is><t xml:space="preserve">{escape(printable(str(value)), quote=False)}</t></is></c>'


def _column_letters(number: int) -> str:
    """Letters of a column by its number from 0: A to Z, then AA."""
    above, place = divmod(number, 26)
    return (_column_letters(above - 1) if above else "") + chr(ord("A") + place)


def _sheet_name(name: str, titles: set[str]) -> str:
    """Shorten a name to the 31 characters of a sheet, so that no two are the same."""
    short, number = name[:31], 2
    while short.lower() in titles:
        end = f"~{number}"
        short, number = name[: 31 - len(end)] + end, number + 1
    titles.add(short.lower())
    return short


def write_matlab(stages: Mapping[str, xr.Dataset], path: Path) -> None:
    """Write the numbers of some stages as MATLAB file (level 5): a struct for each, ``modes.frequency``.

    Real and imaginary part are one complex array, texts are cells, ``units`` and ``attributes`` structs.
    StorageError: a stage of 2 GB or more, which the format does not hold (E-RANGE).
    """
    from scipy.io import savemat

    largest = max((stage.nbytes for stage in stages.values()), default=0)
    if largest >= 2**31:
        raise StorageError(
            f"a stage of {largest / 1e9:.1f} GB",
            code="E-RANGE",
            file=str(path),
            limit="less than 2.1 GB",
            remedy="export it with --csv, or read its .nc file by ncread",
        )
    structures = {stage: _struct(data) for stage, data in stages.items()}
    with replaced_file(path, size=sum(data.nbytes for data in stages.values())) as temporary:
        savemat(temporary, structures, appendmat=False, long_field_names=True, oned_as="column")


def _struct(data: xr.Dataset) -> dict[str, Any]:
    """Variables of a dataset by name, as `write_matlab` writes them."""
    arrays, units = dict[str, Any](), dict[str, str]()
    for key, variable in data.variables.items():
        name, values = str(key), variable.values
        whole = name.removesuffix("_real").removesuffix("_imag")
        if f"{whole}_real" in data and f"{whole}_imag" in data:
            name, values = whole, data[f"{whole}_real"].values + 1j * data[f"{whole}_imag"].values
        arrays[name] = values.astype(object) if values.dtype.kind in "OU" else values
        units[name] = str(variable.attrs.get("units", "1"))
    return {**arrays, "units": units, "attributes": {str(name): attr for name, attr in data.attrs.items()}}
