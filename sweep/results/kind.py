"""What a dataset is of: a run, single trajectories, or critical spins."""

from __future__ import annotations

import xarray as xr

RUN, TRAJECTORY, CRITICAL = "a run", "single trajectories", "critical spins"


def kind(dataset: xr.Dataset) -> str | None:
    """Which of the three, told by the variables alone; None if it is of another program.

    The predictions of a sweep count as a run, which they are part of.
    """
    if {"spin", "t_stop"} <= set(dataset.data_vars) and "trajectory" in dataset.dims:
        return TRAJECTORY
    if "critical_reason" in dataset:
        return CRITICAL
    return RUN if {"status", "form_factor"} & set(dataset.data_vars) else None
