"""Says what a dataset is of: a run, single trajectories, critical spins, boundaries, a fit, or Sobol indices."""

from __future__ import annotations

import xarray as xr

from sweep.parameters import PARAMETERS
from sweep.results.dataset import VARIABLES

RUN, TRAJECTORY, CRITICAL, BOUNDARIES = "a run", "single trajectories", "critical spins", "boundaries"
FIT, INDICES = "a fit", "Sobol indices"


OWN_BODY = "a model"
"""What `model_brings` says of the model of a user that need not be of a rattleback."""


def is_of_own_body(dataset: xr.Dataset) -> bool:
    """Tell whether a user's model made it, which may be of anything."""
    return dataset.attrs.get("model_brings") == OWN_BODY


def parameters(dataset: xr.Dataset) -> list[str]:
    """Names of the physical parameters that a dataset tells."""
    return [name for name in str(dataset.attrs.get("model_parameters", "")).split() or PARAMETERS if name in dataset]


_MARKS = {
    TRAJECTORY: {"trajectory", "spin", "time", "t_stop"},
    CRITICAL: {"critical_reason"},
    BOUNDARIES: {"level", "curve", "end_more"},
    FIT: {"seen", "fitted"},
    INDICES: {"first_order", "total_order"},
}
"""Variables by which each is known."""


def kind(dataset: xr.Dataset) -> str | None:
    """Which of the six, told by the variables alone; None if it is of another program.

    Predictions count as a run, and so does a part of one.
    """
    there = {*dataset.variables, *dataset.dims}
    if found := [kind for kind, marks in _MARKS.items() if marks <= there]:
        return found[0]
    return RUN if set(VARIABLES) & set(dataset.data_vars) else None
