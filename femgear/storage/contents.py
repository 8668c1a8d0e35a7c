"""What the file of a stage holds, without xarray: numbers with named dimensions, units and words.

To import xarray takes longer than some stages, and pandas with it. Runs and their tables read contents by the
few words of xarray that they need; whatever else is asked of them is asked of the dataset that they become
(`Contents.to_xarray`), so that functions of a dataset take contents too.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

Entry = tuple[Any, Any, str, str]
"""``(dims, values, units, long_name)``; dims as names or one text."""


class Labelled:
    """An array with named dimensions: a variable of some contents, as the `xarray.DataArray` of that name.

    ``parent`` gives the contents when their coordinates are asked for.
    """

    def __init__(self, values: Any, dims: tuple[str, ...], attrs: Mapping[str, Any], parent: Callable[[], Contents]):
        self.values, self.dims, self.attrs, self._parent = np.asarray(values), dims, dict(attrs), parent

    def to_xarray(self) -> xr.DataArray:
        """Make the array (...) of xarray, with the coordinates of its dimensions."""
        import xarray as xr

        coords = self._parent().coordinates_along(self.dims)
        return xr.DataArray(self.values, coords=coords, dims=self.dims, attrs=self.attrs)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        coordinate = self._parent().coords.get(name)
        if coordinate is not None and set(coordinate.dims) <= {*self.dims}:
            return coordinate
        return getattr(self.to_xarray(), name)

    dtype = property(lambda self: self.values.dtype)
    shape = property(lambda self: self.values.shape)
    size = property(lambda self: self.values.size)
    ndim = property(lambda self: self.values.ndim)
    nbytes = property(lambda self: self.values.nbytes)
    sizes = property(lambda self: dict(zip(self.dims, self.values.shape, strict=True)))

    def item(self, *place: Any) -> Any:
        """Give the one number, or text, as Python has it."""
        return self.values.item(*place)

    def _like(
        self,
        values: object,
        dims: tuple[str, ...] | None = None,
        parent: Callable[[], Contents] | None = None,
    ) -> Labelled:
        dims = self.dims if dims is None else dims
        return Labelled(values, dims, self.attrs, self._parent if parent is None else parent)

    def isel(self, **places: Any) -> Labelled:
        """Choose by numbers along dimensions: one, which ends the dimension, a slice, or several."""
        values, dims = self.values, self.dims
        for dim, place in places.items():
            axis = dims.index(dim)
            values = values[(slice(None),) * axis + (_place(place),)]
            dims = dims[:axis] + dims[axis + 1 :] if np.ndim(place) == 0 and _is_one(place) else dims
        return self._like(values, dims, lambda: self._parent().isel(**places))

    def __getitem__(self, place: Any) -> Labelled:
        parts = place if isinstance(place, tuple) else (place,)
        simple = all(_is_one(part) or isinstance(part, slice) for part in parts)
        if not simple and (len(parts) > 1 or np.ndim(place) != 1):
            return self.to_xarray()[place]  # type: ignore[return-value]
        return self.isel(**dict(zip(self.dims, parts)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Labelled]:
        return (self[number] for number in range(len(self.values)))

    def __float__(self) -> float:
        return float(self.values)

    def __int__(self) -> int:
        return int(self.values)

    def __bool__(self) -> bool:
        return bool(self.values)

    def __neg__(self) -> Labelled:
        return self._like(-self.values)

    def __abs__(self) -> Labelled:
        return self._like(np.abs(self.values))

    def __invert__(self) -> Labelled:
        return self._like(~self.values)

    def __format__(self, how: str) -> str:
        return format(self.values.item(), how) if how else str(self)

    def __repr__(self) -> str:
        return f"<Labelled {self.dims}: {self.values!r}>"

    def _reduced(self, name: str, dim: object, **options: object) -> Any:
        """Reduce as xarray does, which leaves NaN out: where there is one, it does it itself."""
        number = self.values.dtype.kind
        if options or not isinstance(dim, str | None) or (number == "f" and np.isnan(self.values).any()):
            return getattr(self.to_xarray(), name)(*([] if dim is None else [dim]), **options)
        axis = None if dim is None else self.dims.index(dim)
        left = () if dim is None else tuple(kept_dim for kept_dim in self.dims if kept_dim != dim)
        return self._like(getattr(np, name)(self.values, axis=axis), left, self._parent)

    def max(self, dim: Any = None, **options: Any) -> Any:
        """Find the largest along a dimension, or of all."""
        return self._reduced("max", dim, **options)

    def min(self, dim: Any = None, **options: Any) -> Any:
        """Find the smallest along a dimension, or of all."""
        return self._reduced("min", dim, **options)

    def sum(self, dim: Any = None, **options: Any) -> Any:
        """Add up along a dimension, or all."""
        return self._reduced("sum", dim, **options)

    def mean(self, dim: object = None, **options: object) -> Any:
        """Compute the mean along a dimension, or of all."""
        return self._reduced("mean", dim, **options)

    def any(self, dim: Any = None, **options: Any) -> Any:
        """Tell whether one along a dimension, or of all, is true."""
        return self._reduced("any", dim, **options)

    def all(self, dim: Any = None, **options: Any) -> Any:
        """Tell whether all along a dimension, or all, are true."""
        return self._reduced("all", dim, **options)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        others = [operand for operand in inputs if isinstance(operand, Labelled)]
        if method != "__call__" or options or any(other.dims != self.dims for other in others):
            inputs = tuple(operand.to_xarray() if isinstance(operand, Labelled) else operand for operand in inputs)
            return getattr(ufunc, method)(*inputs, **options)
        result = ufunc(*(operand.values if isinstance(operand, Labelled) else operand for operand in inputs))
        return self._like(result) if np.shape(result) == self.shape else result


def _operation(apply: Callable[..., Any], *, swapped: bool = False) -> Callable[..., Any]:
    """Make an operator of `Labelled`: of arrays over the same dimensions and of numbers, else xarray's."""

    def operate(self: Labelled, other: Any) -> Any:
        simple = np.ndim(other) == 0 or np.shape(other) == self.shape
        if (isinstance(other, Labelled) and other.dims != self.dims and other.dims) or not simple:
            left, right = self.to_xarray(), other.to_xarray() if isinstance(other, Labelled) else other
            return apply(right, left) if swapped else apply(left, right)
        right = other.values if isinstance(other, Labelled) else other
        return self._like(apply(right, self.values) if swapped else apply(self.values, right))

    return operate


for _name in ("add", "sub", "mul", "truediv", "pow", "lt", "le", "gt", "ge", "eq", "ne", "and_", "or_"):
    _apply = getattr(operator, _name)
    setattr(Labelled, f"__{_name.strip('_')}__", _operation(_apply))
    if _name in ("add", "sub", "mul", "truediv", "pow"):
        setattr(Labelled, f"__r{_name}__", _operation(_apply, swapped=True))
Labelled.__hash__ = None  # type: ignore[assignment]


class Contents:
    """Variables, coordinates and attributes of a stage's file, as the `xarray.Dataset` of these.

    Parameters
    ----------
    variables, coords : mapping of str to Entry
        By name: dimensions, values, unit and meaning of each.
    attrs : mapping
        Of the file.
    """

    def __init__(self, variables: Mapping[str, Entry], coords: Mapping[str, Entry], attrs: Mapping[str, Any]):
        self.attrs = dict(attrs)
        self._entered = {}, {}
        for made, entries in zip(self._entered, (variables, coords), strict=True):
            for name, (dims, values, units, words) in entries.items():
                dims = tuple(dims.split() if isinstance(dims, str) else dims)
                made[name] = Labelled(values, dims, {"units": units, "long_name": words}, self._itself)
        self._check()

    def _itself(self) -> Contents:
        return self

    def _check(self) -> None:
        """Collect the sizes of the dimensions; ValueError where two variables do not agree."""
        sizes = self.sizes = dict[str, int]()
        for name, variable in self.variables.items():
            if len(variable.dims) != variable.ndim:
                raise ValueError(f"{name} has {variable.ndim} dimensions, not {variable.dims}")
            for dim, size in variable.sizes.items():
                if sizes.setdefault(dim, size) != size:
                    raise ValueError(f"{name} has {size} along {dim}, others {sizes[dim]}")

    data_vars = property(lambda self: self._entered[0])
    coords = property(lambda self: self._entered[1])
    dims = property(lambda self: self.sizes)
    nbytes = property(lambda self: sum(variable.nbytes for variable in self.variables.values()))

    @property
    def variables(self) -> dict[str, Labelled]:
        """Variables and coordinates by name."""
        return self._entered[0] | self._entered[1]

    def to_xarray(self) -> xr.Dataset:
        """Make the dataset of xarray that has the same variables, coordinates and attributes."""
        import xarray as xr

        made = [{n: (value.dims, value.values, value.attrs) for n, value in part.items()} for part in self._entered]
        return xr.Dataset(made[0], coords=made[1], attrs=self.attrs)

    def coordinates_along(self, dims: tuple[str, ...]) -> dict[str, Any]:
        """List the coordinates that stand over some dimensions, or over none, as xarray takes them."""
        along = {name: coord for name, coord in self.coords.items() if {*coord.dims} <= {*dims}}
        return {name: (value.dims, value.values, value.attrs) for name, value in along.items()}

    def __getitem__(self, name: Any) -> Any:
        if isinstance(name, str):
            if (variable := self.variables.get(name)) is not None:
                return variable
            if name in self.sizes:
                return Labelled(np.arange(self.sizes[name]), (name,), {}, self._itself)
        return self.to_xarray()[name]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in ("_entered", "attrs", "sizes"):
            raise AttributeError(name)
        if name in self.variables or name in self.sizes:
            return self[name]
        return self.attrs[name] if name in self.attrs else getattr(self.to_xarray(), name)

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __iter__(self) -> Iterator[str]:
        return iter(self.data_vars)

    def __len__(self) -> int:
        return len(self.data_vars)

    def __repr__(self) -> str:
        return f"<Contents: {', '.join(self.data_vars)}>"

    def get(self, name: str, default: Any = None) -> Any:
        """Give the variable or coordinate of a name, something else where there is none."""
        return self.variables.get(name, default)

    def items(self) -> Iterator[tuple[str, Labelled]]:
        """List the variables by name."""
        return iter(self.data_vars.items())

    def assign(self, **entries: Any) -> Contents:
        """Add variables ``(dims, values)`` to those that there are, in contents of their own."""
        copy_ = self._chosen(lambda labelled: (labelled.values, labelled.dims))
        for name, (dims, values) in entries.items():
            dims = tuple(dims.split() if isinstance(dims, str) else dims)
            copy_.data_vars[name] = Labelled(values, dims, {}, copy_._itself)
        copy_._check()
        return copy_

    def sel(self, **labels: Any) -> Contents:
        """Choose by one label of every dimension; KeyError where none has it."""
        places = {}
        for dim, label in labels.items():
            axis = self.coords.get(dim)
            if axis is None or axis.dims != (dim,) or np.ndim(label) or isinstance(label, slice):
                return self.to_xarray().sel(**labels)  # type: ignore[return-value]
            places_there = np.flatnonzero(axis.values == label)
            if len(places_there) != 1:
                raise KeyError(label)
            places[dim] = int(places_there[0])
        return self.isel(**places)

    def _chosen(self, choose: Callable[[Labelled], tuple[object, tuple[str, ...]]]) -> Contents:
        """Contents of parts of all variables."""
        copy_ = Contents.__new__(Contents)
        copy_.attrs = dict(self.attrs)
        copy_._entered = tuple(
            {name: Labelled(*choose(value), value.attrs, copy_._itself) for name, value in part.items()}
            for part in self._entered
        )  # type: ignore[assignment]
        copy_._check()
        return copy_

    def isel(self, **places: object) -> Contents:
        """Choose by numbers along dimensions: one, which ends the dimension, a slice, or several.

        ValueError: no variable has such a dimension.
        """
        if absent := places.keys() - self.sizes.keys():
            raise ValueError(f"no dimension {', '.join(map(str, absent))}: there are {', '.join(self.sizes)}")

        def choose(labelled: Labelled) -> tuple[Any, tuple[str, ...]]:
            values, dims = labelled.values, labelled.dims
            for dim, place in places.items():
                if dim in dims:
                    axis = dims.index(dim)
                    values = values[(slice(None),) * axis + (_place(place),)]
                    dims = dims[:axis] + dims[axis + 1 :] if _is_one(place) else dims
            return values, dims

        return self._chosen(choose)

    def merge(self, other: Contents) -> Contents:
        """Join the variables and coordinates of two contents; the attributes are those of the first.

        ValueError: both have a variable, or sizes do not agree.
        """
        if both := self.data_vars.keys() & other.data_vars.keys():
            raise ValueError(f"both have {', '.join(sorted(both))}")
        copy_ = self._chosen(lambda labelled: (labelled.values, labelled.dims))
        for made, more in zip(copy_._entered, other._entered, strict=True):
            made.update(
                {n: Labelled(value.values, value.dims, value.attrs, copy_._itself) for n, value in more.items()}
            )
        copy_._check()
        return copy_


def as_dataset(data: Contents | xr.Dataset) -> xr.Dataset:
    """Make the dataset of xarray of some contents; a dataset is one already."""
    return data.to_xarray() if isinstance(data, Contents) else data


class Datasets(Mapping[str, Any]):
    """Contents of files by stage, as datasets of xarray, which is loaded when the first is asked for."""

    def __init__(self, contents: Mapping[str, Contents | xr.Dataset]):
        self._contents = dict(contents)

    def __getitem__(self, stage: str) -> xr.Dataset:
        dataset = self._contents[stage] = as_dataset(self._contents[stage])
        return dataset

    def __iter__(self) -> Iterator[str]:
        return iter(self._contents)

    def __len__(self) -> int:
        return len(self._contents)

    def __repr__(self) -> str:
        return f"<Datasets: {', '.join(self)}>"


def _is_one(place: object) -> bool:
    """Tell whether a place along a dimension is one number."""
    return isinstance(place, (int, np.integer)) or (isinstance(place, np.ndarray) and place.ndim == 0)


def _place(place: object) -> Any:
    """Make what NumPy takes as a place along one axis."""
    return place if isinstance(place, slice) or _is_one(place) else np.asarray(place)
