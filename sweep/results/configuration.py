"""Reads the configuration stored in a dataset, so that it can be run again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import xarray as xr

from sweep.config import Config, load_config
from sweep.config.document import parse_value
from sweep.faults import fault_of
from sweep.grid import CASE
from sweep.results.kind import RUN, TRAJECTORY, kind, parameters


def configuration(
    dataset: xr.Dataset, model: str | None = None, announce: Callable[[str], None] | None = None
) -> Config:
    """Return the configuration of a dataset, or of the part of it that was selected.

    Parameters
    ----------
    model : the file of a user-defined model, if it is to run
    announce : called with a message before user code runs; None to refuse a user-defined model

    Raises
    ------
    InputError
        if the configuration cannot be run.
    """
    values = parse_value(str(dataset.attrs.get("config", "")), "config")
    if not isinstance(values, dict):
        raise fault_of("a configuration is a mapping of keys to values", "config")
    cases = values.pop("cases", None)
    selected = _selected(dataset, values, of_table=cases is not None)
    named = {"model": model} if model else {}
    return load_config(
        values, selected | named, argument=lambda key: "--model" if key in named else key, announce=announce
    )


def _selected(dataset: xr.Dataset, stored: Mapping[str, Any], *, of_table: bool) -> dict[str, Any]:
    """Return the values that the dataset has of parameters that vary in the stored configuration."""
    given = {name: value for each in stored.values() if isinstance(each, dict) for name, value in each.items()}
    cells, found, table = kind(dataset) in (RUN, TRAJECTORY), dict[str, Any](), dict[str, list[float]]()
    for name in parameters(dataset):
        column = dataset[name]
        varies = isinstance(given[name], list | dict) if name in given else of_table
        if column.dims == (CASE,):
            table[name] = column.values.tolist()
        elif cells and varies and column.dims in ((), (name,)) and "distribution" not in column.attrs:
            found[name] = column.values.tolist()
    return found | ({"cases": table} if table else {})
