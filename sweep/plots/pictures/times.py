"""Times of reversals, the first compared with its prediction, and what else of a trajectory the time limit cuts off."""

from __future__ import annotations

import xarray as xr

from sweep.plots.pictures.record import Picture

_UNSETTLED = {"time_limit": "not settled: time limit"}


def _first(dataset: xr.Dataset) -> xr.DataArray:
    times = dataset["reversal_times"]
    found = times.where(times["reversal"] == 1).sum("reversal", min_count=1, keep_attrs=True)
    return found.rename("t_first_reversal").assign_attrs(long_name="time of the first reversal")


def _ratio(dataset: xr.Dataset) -> xr.DataArray:
    found = _first(dataset) / dataset["t_first_reversal_predicted"]
    return found.rename("ratio").assign_attrs(long_name="first reversal, simulated / predicted", units="1")


PICTURES = (
    Picture(
        "t_first_reversal",
        needs=("reversal_times", "reversal"),
        derive=_first,
        words={"no_value": "no reversal"},
        rank=2,
    ),
    Picture("t_first_reversal_predicted", words={"no_value": "none predicted"}),
    Picture(
        "ratio",
        needs=("reversal_times", "reversal", "t_first_reversal_predicted"),
        derive=_ratio,
        compares=("t_first_reversal", "t_first_reversal_predicted"),
        scale="ratios",
        words={"no_value": "no reversal, or none predicted"},
    ),
    Picture("reversal_times", words={"no_value": "no such reversal"}),
    Picture("t_stop", words=_UNSETTLED),
    Picture("spin_final", words=_UNSETTLED, rank=1),
    Picture("spin_mean", words=_UNSETTLED),
)
