"""Contents of files without xarray: they read, and are written, as the dataset that they become."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from test_run import QUICK, quick

from femgear.run import solve
from femgear.storage.contents import Contents, Datasets, Labelled, as_dataset
from femgear.storage.files import read_dataset, write_dataset

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = ["planetary_27_40_108"]


def contents():
    rng = np.random.default_rng(1)
    force = rng.standard_normal((3, 4))
    holed = force.copy()
    holed[1, 2] = np.nan
    variables = {
        "force": ("mesh speed", force, "N", "mesh force"),
        "holed": (("mesh", "speed"), holed, "N", "with a gap"),
        "level": ("speed", [1.0, 4.0, 2.0, 3.0], "m/s^2", "level"),
        "good": ("speed", [True, False, True, True], "1", "whether it is"),
        "kind": ("mesh", ["a", "b", "cc"], "1", "kind"),
        "sun": ((), 7.5, "N m", "torque"),
        "count": ("bearing", np.arange(2), "1", "no coordinate"),
    }
    coords = {
        "mesh": ("mesh", ["m1", "m2", "m3"], "1", "gear mesh"),
        "speed": ("speed", [10.0, 20.0, 30.0, 40.0], "rpm", "speed"),
        "frequency": ("speed", [1.0, 2.0, 3.0, 4.0], "Hz", "beside"),
    }
    return Contents(variables, coords, {"title": "t", "module": 1.5})


READINGS = {
    "variable": lambda data: data.force,
    "by name": lambda data: data["level"],
    "number": lambda data: data.sun.item(),
    "float": lambda data: float(data.level[1]),
    "coordinate": lambda data: data.speed,
    "dimension without coordinate": lambda data: data["bearing"],
    "coordinate of a variable": lambda data: data.force.isel(mesh=1).frequency,
    "coordinate of a part": lambda data: data.level.isel(speed=2).speed.item(),
    "attribute of the file": lambda data: data.module,
    "units": lambda data: data.force.attrs,
    "one": lambda data: data.force.isel(mesh=1),
    "last": lambda data: data.force.isel(speed=-1),
    "slice": lambda data: data.force.isel(mesh=slice(1, None), speed=0),
    "several": lambda data: data.force.isel(speed=[0, 3]),
    "several by numbers": lambda data: data.level[[0, -1]],
    "mask": lambda data: data.level.isel(speed=data.good.values),
    "place": lambda data: data.force[1, 2],
    "row": lambda data: data.force[1],
    "everything": lambda data: data.force[...],
    "label": lambda data: data.sel(mesh="m2").force,
    "label of a number": lambda data: data.sel(speed=20.0).level,
    "nearest label": lambda data: data.sel(speed=[21.0], method="nearest").level,
    "part": lambda data: data.isel(speed=2).force,
    "scalar coordinate": lambda data: data.isel(speed=2).speed.item(),
    "part of some": lambda data: data.isel(speed=[1, 2]).level,
    "largest": lambda data: data.force.max(),
    "largest along": lambda data: data.force.max("mesh"),
    "largest with a gap": lambda data: data.holed.max("speed"),
    "least of axes": lambda data: data.holed.min(axis=1),
    "mean": lambda data: data.force.mean("speed"),
    "mean with a gap": lambda data: data.holed.mean(),
    "sum": lambda data: data.good.sum(),
    "all": lambda data: bool(data.good.all()),
    "any": lambda data: bool((data.level > 3.5).any()),
    "deviation": lambda data: data.force.std("speed"),
    "quotient": lambda data: data.force / data.holed,
    "broadcast": lambda data: data.force * data.level,
    "of a number": lambda data: 2.0 - data.level**2,
    "absolute": lambda data: abs(-data.force),
    "not": lambda data: ~data.good,
    "function": lambda data: np.abs(data.force),
    "function of two": lambda data: np.maximum(data.force, data.holed),
    "function of two shapes": lambda data: np.hypot(data.force, data.level),
    "array": lambda data: np.asarray(data.force),
    "sizes": lambda data: dict(data.sizes),
    "names": lambda data: [*data],
    "there": lambda data: ("force" in data, "speed" in data, "nothing" in data),
    "get": lambda data: data.get("nothing", data.level),
    "items": lambda data: [name for name, one in data.items() if one.dims[:1] == ("mesh",)],
    "added": lambda data: data.assign(_change=("speed", np.arange(4.0))).isel(speed=1)._change,
    "iteration": lambda data: [float(one) for one in data.level],
    "length": lambda data: len(data.level),
    "format": lambda data: f"{data.sun:.3f}",
    "what only xarray has": lambda data: data.force.stack(all=("mesh", "speed")).values,
    "sort of a dataset": lambda data: data.sortby("level").level,
}


@pytest.mark.parametrize("reading", READINGS.values(), ids=READINGS.keys())
def test_contents_read_as_their_dataset(reading):
    found, wanted = reading(contents()), reading(contents().to_xarray())
    if isinstance(wanted, xr.DataArray):
        assert tuple(found.dims) == wanted.dims and found.dtype == wanted.dtype
        found, wanted = found.values, wanted.values
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda data: data["nothing"],
        lambda data: data.nothing,
        lambda data: data.isel(nothing=0),
        lambda data: data.sel(mesh="m9"),
        lambda data: data.isel(mesh=7),
        lambda data: float(data.level),
        lambda data: bool(data.good),
        lambda data: hash(data.level),
    ],
)
def test_what_a_dataset_refuses_contents_refuse_by_the_same_error(wrong):
    with pytest.raises(Exception) as wanted:
        wrong(contents().to_xarray())
    with pytest.raises(wanted.type):
        wrong(contents())


def test_sizes_that_do_not_agree_are_refused():
    with pytest.raises(ValueError, match="b has 2 along x, others 3"):
        Contents({"a": ("x", np.zeros(3), "1", "a"), "b": ("x", np.zeros(2), "1", "b")}, {}, {})
    with pytest.raises(ValueError, match="a has 2 dimensions"):
        Contents({"a": ("x", np.zeros((3, 2)), "1", "a")}, {}, {})


def test_merged_contents_are_the_merged_dataset():
    more = Contents({"a": ("place", [1.0, 2.0], "m", "a")}, {"place": ("place", [0, 1], "1", "p")}, {})
    wanted = contents().to_xarray().merge(more.to_xarray())
    assert contents().merge(more).to_xarray().identical(wanted)
    with pytest.raises(ValueError, match="both have count, force"):
        contents().merge(contents())


def test_datasets_are_made_when_they_are_asked_for():
    made = contents()
    data = Datasets({"static": made, "modes": contents()})
    assert [*data] == ["static", "modes"] and len(data) == 2
    assert data["static"] is data["static"] and data["static"].identical(as_dataset(made))
    assert isinstance(made["force"], Labelled)


@cache
def results(name):
    return solve(quick(name))


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in QUICK if name not in CASES]


@pytest.mark.parametrize("name", [*CASES, *SLOW])
def test_files_have_the_bytes_of_those_of_datasets(name, tmp_path):
    """Variables, attributes, dimensions, types and coordinates, as xarray made them before and reads them."""
    for stage, result in results(name).items():
        found, paths = result.contents(), (tmp_path / "contents.nc", tmp_path / "dataset.nc")
        write_dataset(found, paths[0])
        write_dataset(result.dataset(), paths[1])
        assert paths[0].read_bytes() == paths[1].read_bytes(), stage
        stored = read_dataset(paths[0])
        assert [*stored.variables] == [*found.variables] and dict(stored.sizes) == found.sizes
        for key, one in found.variables.items():
            np.testing.assert_array_equal(stored[key].values, one.values)
            assert stored[key].dims == one.dims and stored[key].attrs.items() >= one.attrs.items()
            assert stored[key].dtype.kind.replace("O", "U") == one.dtype.kind
        assert [str(one) for one in result.warnings(found)] == [str(one) for one in result.warnings(stored)]
