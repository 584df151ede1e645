"""Predicts the cells of a sweep from theory, without running it."""

from __future__ import annotations

from typing import Any

import xarray as xr

from sweep import prediction
from sweep.config import ConfigLike, load_config
from sweep.results import dataset


def predict(config: ConfigLike, **overrides: Any) -> xr.Dataset:
    """Return the predictions of the paper and of the linear theory on the grid of `config`, without simulating.

    If `first_reversal` is measured, the time of the first reversal is predicted as well.

    Parameters
    ----------
    config : a configuration, a mapping with the contents of its file, or the path of a file
    overrides : values that replace those of the file, such as ``mu=60``

    Raises
    ------
    ConfigError
        if the configuration cannot be used.

    Examples
    --------
    >>> sweep.predict({"friction": {"mu": [60, 130]}}).reversals_predicted.values
    array([3, 7], dtype=int16)
    """
    config = load_config(config, overrides)
    grid = config.grid
    found = prediction.predict(config.tier, grid, config.measure).variables
    return dataset.label(config, grid, found, {"config": config.label()})
