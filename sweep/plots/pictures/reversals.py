"""Counts of reversals, and their difference from the prediction."""

from __future__ import annotations

import xarray as xr

from sweep.plots import labels
from sweep.plots.pictures.record import Picture

_GROWING = {"time_limit": "lower bound: time limit", "uncertain": "uncertain count"}
"""Words for what a longer trajectory can raise."""


def _difference(dataset: xr.Dataset) -> xr.DataArray:
    simulated = dataset["reversals"]  # whose integers are too short for a difference
    found = (simulated.astype("int32") if simulated.dtype.kind == "i" else simulated) - dataset["reversals_predicted"]
    return found.rename("difference").assign_attrs(long_name=f"{labels.origin(dataset, 'reversals')} − predicted")


PICTURES = (
    Picture("reversals", words=_GROWING, theory=True, boundaries=True, rank=4),
    Picture("reversals_estimated", theory=True),
    Picture("reversals_predicted", theory=True, rank=3),
    Picture(
        "difference",
        needs=("reversals", "reversals_predicted"),
        derive=_difference,
        compares=("reversals", "reversals_predicted"),
        scale="differences",
        words=_GROWING,
        theory=True,
    ),
    Picture("t_last_reversal", words=_GROWING | {"no_value": "no reversal"}),
)
