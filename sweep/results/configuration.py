"""Reads the configuration stored in a dataset, so that it can be run again."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import xarray as xr

from sweep.config import Config, load_config
from sweep.config.document import parse_value
from sweep.ended import without_ended
from sweep.faults import fault_of
from sweep.grid import CASE
from sweep.kernels.measures.misfit import Misfit
from sweep.results.kind import RUN, TRAJECTORY, kind, parameters


def configuration(
    dataset: xr.Dataset, model: Mapping[str, str] | None = None, announce: Callable[[str], None] | None = None
) -> Config:
    """Return the configuration of a dataset, or of the part of it that was selected, without its film.

    A table of cases is replaced by its first case.

    Parameters
    ----------
    model : the keys that name a user-defined model, if it is to run
    announce : called with a message before user code runs; None to refuse a user-defined model

    Raises
    ------
    ConfigError
        if the configuration cannot be run.
    """
    values = parse_value(str(dataset.attrs.get("config", "")), "config")
    if not isinstance(values, dict):
        raise fault_of("a configuration is a mapping of keys to values", "config")
    values = without_ended(values)
    cases = values.pop("cases", None)
    if isinstance(measure := values.get("measure"), list):
        values["measure"] = [each for each in measure if not (isinstance(each, dict) and Misfit.name in each)]
    stored = {name: value for each in values.values() if isinstance(each, dict) for name, value in each.items()}
    first = {}
    for name in parameters(dataset):
        column, varies = dataset[name], isinstance(stored.get(name, [] if cases else 0.0), list | dict)
        selected = column.ndim == 0 and varies and kind(dataset) in (RUN, TRAJECTORY)
        if "distribution" not in column.attrs and (selected or column.dims in ((CASE,), (TRAJECTORY.name,))):
            first[name] = float(column.values.flat[0])
    named = dict(model or {})
    whole = load_config(
        values, first | named, argument=lambda key: "--model" if key in named else key, announce=announce
    )
    parts = {name: dataset[name].values.tolist() for name, axis in whole.axes.items()
             if name in dataset.dims and dataset.sizes[name] < len(axis)}  # fmt: skip
    return load_config(whole, parts) if parts else whole
