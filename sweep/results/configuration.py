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


def configuration(
    dataset: xr.Dataset, model: Mapping[str, str] | None = None, announce: Callable[[str], None] | None = None
) -> Config:
    """Return the configuration of a dataset without its film; a table of cases is replaced by its first case.

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
    values.pop("cases", None)
    if isinstance(measure := values.get("measure"), list):
        values["measure"] = [each for each in measure if not (isinstance(each, dict) and Misfit.name in each)]
    first = {str(name): float(c[0]) for name, c in dataset.coords.items() if c.dims == (CASE,) and name != CASE}
    named = dict(model or {})
    return load_config(
        values, first | named, argument=lambda key: "--model" if key in named else key, announce=announce
    )
