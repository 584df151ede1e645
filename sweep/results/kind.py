"""What a dataset is of: a run, single trajectories, or critical spins."""

from __future__ import annotations

import xarray as xr

from sweep.results.dataset import VARIABLES

RUN, TRAJECTORY, CRITICAL = "a run", "single trajectories", "critical spins"


def kind(dataset: xr.Dataset) -> str | None:
    """Which of the three, told by the variables alone; None if it is of another program.

    Predictions count as a run, and so does a part of one.
    """
    if {"spin", "time", "t_stop"} <= set(dataset.variables) and "trajectory" in dataset.dims:
        return TRAJECTORY
    if "critical_reason" in dataset:
        return CRITICAL
    return RUN if set(VARIABLES) & set(dataset.data_vars) else None
