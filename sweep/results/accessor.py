"""What is ours of a dataset of xarray: `dataset.sweep.plot()`, `dataset.sweep.trajectory(mu=60)`.

Registered with the first dataset.  It calls what `import sweep` offers, by name, since that is above all datasets.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import xarray as xr
from ruamel.yaml import YAML

from sweep.config import Config, load_config


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
        return import_module("sweep").trajectory(configuration(self._dataset.attrs["config"]), **values)


def configuration(text: str) -> Config:
    """The configuration that a dataset tells in `config`; `ConfigError` if its model is code of a user."""
    return load_config(YAML(typ="safe", pure=True).load(text) or {}, announce=None)
