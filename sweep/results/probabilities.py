"""Estimates the probability of each number of reversals from samples, with its sampling error."""

from __future__ import annotations

import numpy as np
import xarray as xr

from sweep.grid import SAMPLE, Array
from sweep.kernels.status import FAILURES, IMPOSSIBLE
from sweep.units import NUMBER
from sweep.variables import Variable

_END = "end of the 95 % interval of the probability, by Wilson's formula."

PROBABILITIES = {
    name: Variable("float64", NUMBER, long_name, description, along=("count",))
    for name, long_name, description in (
        ("probability", "probability of at least this many reversals", ""),
        ("probability_low", "probability, lower end of its 95 % interval", f"Lower {_END}"),
        ("probability_high", "probability, upper end of its 95 % interval", f"Upper {_END}"),
    )
}
"""Variables over the axes shared by the samples, and over counts from one on."""

_SIGMAS = 1.959963984540054
"""Number of standard deviations of a normal distribution that contain 95 %."""


def probabilities(dataset: xr.Dataset) -> dict[str, Array]:
    """Estimate the variables `PROBABILITIES` from the samples of a dataset that did not fail.

    They are NaN where all samples failed. Counts run up to the highest of any sample, and to at least one.
    """
    valid = sound(dataset).transpose(..., SAMPLE).values
    reversals = np.where(valid, dataset["reversals"].transpose(..., SAMPLE).values, 0)
    counts = np.arange(1, max(1, reversals.max()) + 1)
    samples = valid.sum(-1)[..., None]
    with np.errstate(invalid="ignore"):  # no samples
        share = np.stack([(reversals >= count).sum(-1) for count in counts], axis=-1) / samples
    low, high = interval(share, samples)
    return {"probability": share, "probability_low": low, "probability_high": high}


def sound(dataset: xr.Dataset) -> xr.DataArray:
    """Return a mask of the samples that did not fail, over the dimensions of the status."""
    return ~dataset["status"].isin((*FAILURES, IMPOSSIBLE))


def interval(share: Array, samples: Array) -> tuple[Array, Array]:
    """Return the 95 % interval of a probability, given the `share` among independent `samples` (Wilson 1927)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        z = _SIGMAS**2 / samples
        middle = (share + z / 2) / (1 + z)
        half = np.sqrt(z * (share * (1 - share) + z / 4)) / (1 + z)
    return np.maximum(middle - half, 0), np.minimum(middle + half, 1)
