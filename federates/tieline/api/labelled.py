"""The grid's table as an xarray dataset: a variable a quantity, over time and element."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from tieline.errors import InputError
from tieline.tables import read_table, units_of

if TYPE_CHECKING:
    import xarray as xr

TIME = "t_s"
_BUS = re.compile(r"B(\d+)")


def dataset(path: Path) -> "xr.Dataset":
    """Return a table whose columns are `QUANTITY.ELEMENT` as one variable for each quantity.

    Dimensions are `t_s`, `unit` (names) and `bus` (numbers); elements that a quantity does not
    have are NaN. Each variable has `units` and, where it has no elements, a `long_name`.

    Raises:
        InputError: xarray is not installed, or there is no such table.
    """
    xarray = _xarray()
    if not path.is_file():
        raise InputError(f"{path}: there is no such table")
    table, facts = read_table(path), units_of(path)
    time = (TIME, table[TIME].to_numpy(), {"units": facts[TIME][0], "long_name": facts[TIME][1]})
    parts: dict[str, list[str]] = {}
    for name in table.columns.drop(TIME):
        parts.setdefault(name.partition(".")[0], []).append(name)
    arrays = []
    for quantity, names in parts.items():
        unit, description = facts[names[0]]
        about = {"units": unit}
        values = table[names].to_numpy()
        if names == [quantity]:
            about["long_name"] = description
            content = xarray.DataArray(values[:, 0], {TIME: time}, (TIME,), quantity, about)
        else:
            place, elements = _elements([name.partition(".")[2] for name in names])
            coordinates = {TIME: time, place: elements}
            content = xarray.DataArray(values, coordinates, (TIME, place), quantity, about)
        arrays.append(content)
    merged: xr.Dataset = xarray.Dataset({array.name: _whole(array, arrays) for array in arrays})
    return merged


def along_runs(datasets: Mapping[str, "xr.Dataset"]) -> "xr.Dataset":
    """Return the datasets of several runs side by side, along a dimension `run`.

    Raises:
        InputError: there is none.
    """
    if not datasets:
        raise InputError("no run of the sweep is complete: there is nothing to put side by side")
    joined: xr.Dataset = _xarray().concat(
        list(datasets.values()),
        pd.Index(list(datasets), name="run"),
        data_vars="all",
        join="outer",
        combine_attrs="override",
    )
    return joined


def _whole(array: "xr.DataArray", arrays: list["xr.DataArray"]) -> "xr.DataArray":
    """Return an array over all the elements that any has: units as recorded, buses by number."""
    for place in array.dims[1:]:
        labels = [label for other in arrays if place in other.dims for label in other[place].values]
        every = sorted(set(labels)) if place == "bus" else list(dict.fromkeys(labels))
        array = array.reindex({place: every})
    return array


def _elements(names: list[str]) -> tuple[str, "np.ndarray[tuple[int], np.dtype[np.generic]]"]:
    """Return the dimension of some elements and its labels: `B61` is bus 61, `G26` a unit."""
    buses = [_BUS.fullmatch(name) for name in names]
    if all(buses):
        return "bus", np.array([int(match[1]) for match in buses if match])
    return "unit", np.array(names)


def _xarray() -> Any:
    try:
        import xarray
    except ImportError as error:
        raise InputError("xarray is not installed: pip install 'tieline[xarray]'") from error
    return xarray
