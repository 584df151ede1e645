"""What is ours of a dataset of xarray: `dataset.sweep.plot()`, `dataset.sweep.trajectory(mu=60)`.

`sweep` registers it with the first of its names that is used.
"""

from __future__ import annotations

from typing import Any

import xarray as xr

from sweep import api
from sweep.results.configuration import configuration


@xr.register_dataset_accessor("sweep")  # type: ignore[no-untyped-call]
class Accessor:
    """What `import sweep` does with a dataset."""

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    def plot(self, variable: str | None = None, **options: Any) -> Any:
        """Draw the dataset; arguments, figure and errors as of `sweep.plot`."""
        from sweep.plots.picture import plot  # which loads matplotlib

        return plot(self._dataset, variable, **options)

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
        return api.trajectory(configuration(self._dataset), **values)
