"""Rows of data sets of faulty teeth: every record alone, its labels, and the orders of its lines."""

from __future__ import annotations

import csv
import tempfile
from pathlib import Path

import numpy as np
import xarray as xr

from femgear.case.gear_set import planetary_set
from femgear.run import grid_cache
from femgear.storage.files import read_dataset
from femgear.study.fault_files import fault_records_into
from femgear.study.fault_request import FaultRequest, FurtherRecords
from femgear.trains.reading import read_case, with_values
from validation.recordings import CASE
from validation.rows import Row, at_most, counted

KINDS = ("healthy", "wear", "spall")
_COARSE = {"static.flank_elements": 8, "static.positions": 8, "dynamics.up_to": "2 kHz"}
_EACH, _FAINT = 2, 1e-9
"""Records of a machine; line over the largest that counts as none."""


def data_set() -> tuple[Row, ...]:
    """One machine of every kind with two records each, a planet's tooth at fault."""
    case, rows = with_values(read_case(CASE), _COARSE), list[Row]()
    request = {"kinds": KINDS, "gears": ("planet",), "each": _EACH, "seed": 7, "duration": "0.05 s"}
    count = _EACH * len(KINDS)
    with tempfile.TemporaryDirectory() as name:
        folder, alone = Path(name) / "all", Path(name) / "alone"
        fault_records_into(case, folder, FaultRequest(count=count, **request), cache=grid_cache())
        with open(folder / "labels.csv", encoding="utf-8") as stream:
            labels = list(csv.DictReader(stream))
        kinds = [kind for kind in KINDS for _ in range(_EACH)]
        wrong = sum(label["kind"] != kind for label, kind in zip(labels, kinds, strict=True))
        rows.append(counted("data set", "kinds in turn", f"{count} records: labels that are wrong", 0, wrong))
        for machine, kind in enumerate(KINDS):
            record = _EACH * machine + 1
            data = read_dataset(folder / labels[record]["file"])
            chosen = FurtherRecords(index=record)
            _, names = fault_records_into(
                case, alone, FaultRequest(count=count, **request), further=chosen, cache=grid_cache()
            )
            signal = read_dataset(alone / names[0])["signal"].values[0]
            differing = int((signal != data["signal"].values[1]).sum())
            text = f"{kind}: samples of a record that differ from those computed alone, of {signal.size}"
            rows.append(counted("data set", "the record computed alone", text, 0, differing))
            rows.append(_orders(kind, planetary_set(case).n_planets, data))
    return tuple(rows)


def _orders(kind: str, planets: int, data: xr.Dataset) -> Row:
    """Largest line of a record at an order that a whole set has not: none of a healthy one, some of a faulty planet."""
    first, source = int(data["line_count"].values[0]), "equal planets make multiples of N orders alone"
    order = data["line_order"].values[:first]
    size = np.hypot(data["line_real"].values[:first], data["line_imag"].values[:first])
    number = order / planets
    off = size[np.abs(number - np.rint(number)) > 1e-4].max(initial=0.0) / size.max()
    if kind == "healthy":
        return at_most("data set", source, "healthy: largest line off N q, over the largest", _FAINT, off)
    return counted("data set", source, f"{kind} of a planet: there are lines off N q (yes 1)", 1, int(off > _FAINT))
