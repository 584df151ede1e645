"""What is ours of a dataset of xarray: `dataset.sweep.plot()`, `dataset.sweep.trajectory(mu=60)`.

Registered with the first dataset.  It calls what `import sweep` offers, by name, since that is above all datasets.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

import xarray as xr

from sweep.config import Config, load_config
from sweep.config.document import parse_value
from sweep.ended import without_ended
from sweep.faults import fault_of
from sweep.grid import CASE
from sweep.kernels.measures.misfit import Misfit


@xr.register_dataset_accessor("sweep")  # type: ignore[no-untyped-call]
class Accessor:
    """What `import sweep` does with a dataset."""

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    def plot(self, variable: str | None = None, **options: Any) -> Any:
        """Draw the dataset; arguments, figure and errors as of `sweep.plot`."""
        return import_module("sweep").plot(self._dataset, variable, **options)

    def trajectory(self, **values: Any) -> Any:
        """Follow single cells densely in time, with the configuration of the dataset.

        Parameters
        ----------
        values : the cells, such as ``mu=60``, and the other arguments of `sweep.trajectory`

        Raises
        ------
        ValueError
            if the dataset tells no configuration.
        ConfigError
            as `sweep.trajectory`; also if its model is code of a user, which runs only if `sweep.trajectory` is given
            the configuration.
        """
        if "config" not in self._dataset.attrs:
            raise ValueError("the dataset tells no configuration; call sweep.trajectory with one")
        return import_module("sweep").trajectory(configuration(self._dataset), **values)


def configuration(
    dataset: xr.Dataset, model: Mapping[str, str] | None = None, announce: Callable[[str], None] | None = None
) -> Config:
    """Return the configuration of a dataset, without a film; its first case stands for a table of cases.

    Parameters
    ----------
    model : the keys by which the user names their model, if it is to run
    announce : told in words that code of a user is about to run; None if such a model is to be refused

    Raises
    ------
    ConfigError
        if it cannot be run.
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
