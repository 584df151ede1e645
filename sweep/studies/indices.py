"""Finds which uncertain parameters a result depends on: Sobol indices, from a run of samples that share parameters.

The design is that of Saltelli et al. (2010), doi 10.1016/j.cpc.2009.09.018, and SciPy estimates the indices.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr
from scipy import stats

from sweep.config import Config
from sweep.config.distributions import chances, drawn
from sweep.engine.whole import Whole
from sweep.grid import Array
from sweep.kernels.measures import chosen
from sweep.kernels.status import FAILURES, IMPOSSIBLE
from sweep.results.dataset import variables
from sweep.studies.study import Task, require_simulated
from sweep.units import NUMBER
from sweep.variables import Variable

QUANTITIES = ("reversals", "t_last_reversal", "spin_mean")
"""The results whose indices are computed, if they are measured."""

_RESAMPLED = 400
"""Number of resamples for an interval, which makes its ends certain to a tenth of its width."""

_ORDERS = {
    "first_order": ("first-order Sobol index", "Share of the variance that fixing this parameter alone would remove."),
    "total_order": ("total Sobol index", "Share of the variance that remains if all other parameters are fixed."),
}

VARIABLES = {
    f"{order}{end}": Variable("float64", NUMBER, f"{long_name}{where}", description)
    for order, (long_name, description) in _ORDERS.items()
    for end, where in (("", ""), ("_low", ", lower end of 95 %"), ("_high", ", upper end of 95 %"))
}
"""Variables of the dataset, over quantities and parameters."""


def indices(config: Config) -> Task:
    """Arguments of `sweep.api.indices`."""
    return Task(designed(config), "indices", "Sobol indices", Indices)


def designed(config: Config) -> Config:
    """Return `config` with the samples of the design, n (parameters + 2) of them; raise a `InputError` if it has none.

    The first n samples and the next n are independent; then the first n are repeated for each parameter, with that
    parameter taken from the second n. n is the number of samples in the configuration, rounded up to a power of two.
    """
    require_simulated(config)
    if not config.samples:
        raise config.error((), "no parameter is a distribution; give one, such as n0: {normal: [0.05, 0.002]}")
    for name in config.axes:
        raise config.error(name, "cannot be an axis of indices; give one number")
    if not any(name in each.variables for each in chosen(config.measure) for name in QUANTITIES):
        raise config.error(("measure",), "has no quantity that indices are computed of; add reversals")
    known = config.distributions
    first, second = np.split(chances(2 * len(known), 1 << (config.samples - 1).bit_length(), config.seed), 2, axis=1)
    mixed = [np.where(np.arange(len(known)) == i, second, first) for i in range(len(known))]
    chance = np.concatenate([first, second, *mixed])
    return replace(config, cases=drawn(known, chance), samples=len(chance))


class Indices(Whole):
    """A run of the design, and the indices computed from it."""

    def dataset(self) -> xr.Dataset:
        """Return the indices of all measured quantities; NaN where a sample failed, or all samples agree."""
        arrays = self._gather()
        names = [name for name in QUANTITIES if name in arrays]
        failed = np.isin(arrays["status"], (*FAILURES, IMPOSSIBLE))
        values = np.stack([np.where(failed, np.nan, arrays[name]) for name in names])
        parameters = list(self.config.cases)
        found = estimated(values.reshape(len(names), len(parameters) + 2, -1), self.config.seed)
        title, size = f"{self.config.name}: Sobol indices", self.grid.size
        attributes = {"title": title, **self._attributes(size), "trajectories": size}
        labelled = variables(VARIABLES, ("quantity", "parameter"), found)
        return xr.Dataset(labelled, {"quantity": names, "parameter": parameters}, attributes)


def estimated(values: Array, seed: int) -> dict[str, Array]:
    """Estimate the indices and their 95 % intervals, by name, each of shape (quantities, parameters).

    Parameters
    ----------
    values : the results of the design, shape (quantities, parameters + 2, n), n being a power of two
    """
    known = np.ptp(values, axis=(1, 2)) > 0  # SciPy would give 0 for a result that is NaN or constant
    quantities, both, n = values.shape
    # SciPy drops dimensions of length one, and fails if no other is left: so a further quantity is added, all zero.
    filled = np.zeros((quantities + 1, both, n))
    filled[:-1][known] = values[known]

    def find(rows: Array) -> Array:
        first, second, *mixed = filled[..., rows].swapaxes(0, 1)
        found = stats.sobol_indices(func={"f_A": first, "f_B": second, "f_AB": np.stack(mixed)}, n=n)
        return np.reshape([found.first_order, found.total_order], (len(_ORDERS), quantities + 1, both - 2))

    # The `bootstrap` method of what `sobol_indices` returns takes no seed.
    low, high = stats.bootstrap(
        (np.arange(n),), find, vectorized=False, n_resamples=_RESAMPLED, method="percentile", rng=seed
    ).confidence_interval
    ends = {"": find(np.arange(n)), "_low": low, "_high": high}
    return {
        f"{order}{end}": np.where(known[:, None], each[k, :-1], np.nan)
        for end, each in ends.items()
        for k, order in enumerate(_ORDERS)
    }
