"""Says from samples how probable each number of reversals is, and how exactly so many samples tell it."""

from __future__ import annotations

import numpy as np
import xarray as xr

from sweep.grid import SAMPLE, Array
from sweep.kernels.status import FAILURES, IMPOSSIBLE
from sweep.units import NUMBER
from sweep.variables import Variable

_END = "end of the 95 % interval of the probability, by Wilson's formula; it is wide enough for Sobol points."

PROBABILITIES = {
    name: Variable("float64", NUMBER, long_name, description, along="count")
    for name, long_name, description in (
        ("probability", "probability of so many spin reversals or more", ""),
        ("probability_low", "probability, lower end of its 95 % interval", f"Lower {_END}"),
        ("probability_high", "probability, upper end of its 95 % interval", f"Upper {_END}"),
    )
}
"""The variables over the axes that samples have in common, and over counts from one on."""

_SIGMAS = 1.959963984540054
"""Standard deviations of a normal distribution within which 95 % lie."""


def probabilities(dataset: xr.Dataset) -> dict[str, Array]:
    """Estimate the variables `PROBABILITIES` from those samples of a dataset that did not fail.

    They are NaN where all samples failed.  There are as many counts as any of the samples has, but at least one.
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
    """Tell which samples did not fail, over the dimensions of the status."""
    return ~dataset["status"].isin((*FAILURES, IMPOSSIBLE))


def interval(share: Array, samples: Array) -> tuple[Array, Array]:
    """The 95 % interval of a probability of which `samples` independent samples show the `share` (Wilson 1927)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        z = _SIGMAS**2 / samples
        middle = (share + z / 2) / (1 + z)
        half = np.sqrt(z * (share * (1 - share) + z / 4)) / (1 + z)
    return np.maximum(middle - half, 0), np.minimum(middle + half, 1)
