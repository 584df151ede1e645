"""Which of the uncertain parameters a result depends on: Sobol indices, from a run of samples that share parameters.

The design, and the estimates from it, are those of Saltelli et al. (2010), doi 10.1016/j.cpc.2009.09.018.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError
from sweep.config.distributions import chances
from sweep.grid import Array
from sweep.kernels.status import FAILURES, IMPOSSIBLE
from sweep.results.dataset import variables
from sweep.studies.kept import Task
from sweep.studies.search import Study, require_simulated
from sweep.variables import Variable

QUANTITIES = ("reversals", "t_first_reversal", "t_last_reversal", "spin_mean")
"""The results whose indices are found, as far as they are measured."""

_RESAMPLED = 400
"""Resamples of an interval: its ends are then certain to a tenth of its width."""

_ORDERS = {
    "first_order": "first-order index of Sobol: share of the variance that goes where the parameter alone is known",
    "total_order": "total index of Sobol: share of the variance that stays where all parameters but this are known",
}

VARIABLES = {
    f"{order}{end}": Variable("float64", "1", f"{words}{where}")
    for order, words in _ORDERS.items()
    for end, where in (("", ""), ("_low", "; lower end of its interval of 95 %"), ("_high", "; upper end"))
}
"""The variables of the dataset, over quantities and parameters."""


def indices(config: Config) -> Task:
    """What `sweep.api.indices` asks for."""
    return Task(designed(config), "indices", "Sobol indices", Indices)


def designed(config: Config) -> Config:
    """`config` with the samples of the design, n (parameters + 2) of them; `ConfigError` if it has none.

    The first n are independent of the next; then come the first n again for each parameter, with that parameter from
    the next.  n is the number of samples that the configuration asks for, rounded up to a power of two.
    """
    require_simulated(config)
    if not config.samples:
        words = "no parameter is a distribution; give one, such as n0: {normal: [0.05, 0.002]}"
        raise ConfigError([config.fault((), words)])
    if config.axes:
        name = next(iter(config.axes))
        raise ConfigError([config.fault(config.table[name].place, "cannot be an axis of indices; give one number")])
    known = config.distributions
    first, second = np.split(chances(2 * len(known), 1 << (config.samples - 1).bit_length(), config.seed), 2, axis=1)
    mixed = [np.where(np.arange(len(known)) == i, second, first) for i in range(len(known))]
    chance = np.concatenate([first, second, *mixed])
    cases = {name: tuple(each.at(chance[:, i]).tolist()) for i, (name, each) in enumerate(known.items())}
    return replace(config, cases=cases, samples=len(chance))


class Indices(Study):
    """A run of the design, and the indices that follow from it."""

    def labelled(self) -> xr.Dataset:
        """The indices of all quantities that were measured; NaN where a sample failed, or none differs."""
        arrays, apart = self._gather()
        names = [name for name in QUANTITIES if name in arrays]
        failed = np.isin(arrays["status"], (*FAILURES, IMPOSSIBLE))
        values = np.stack([np.where(failed, np.nan, arrays[name]) for name in names])
        parameters = list(self.config.cases)
        found = with_intervals(values.reshape(len(names), len(parameters) + 2, -1), self.config.seed)
        attributes = {"title": f"{self.config.name}: Sobol indices", **self._attributes(self.grid.size, apart)}
        return xr.Dataset(
            variables(VARIABLES, ("quantity", "parameter"), found),
            {"quantity": names, "parameter": parameters},
            attributes | {"trajectories": self.grid.size},
        )


def sobol(values: Array) -> tuple[Array, Array]:
    """Estimate first-order and total indices, both of shape (…, parameters).

    Parameters
    ----------
    values : the results of the design, shape (…, parameters + 2, n)
    """
    first, second, mixed = values[..., :1, :], values[..., 1:2, :], values[..., 2:, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.var(values[..., :2, :], axis=(-2, -1))[..., None]
        alone = np.mean((second - np.mean(values[..., :2, :], axis=(-2, -1), keepdims=True)) * (mixed - first), axis=-1)
        return alone / variance, np.mean((first - mixed) ** 2, axis=-1) / 2 / variance


def with_intervals(values: Array, seed: int) -> dict[str, Array]:
    """The indices of `values`, and their intervals of 95 % by resampling; `values` as of `sobol`."""
    random, size = np.random.default_rng(seed), values.shape[-1]
    again = [sobol(values[..., random.integers(size, size=size)]) for _ in range(_RESAMPLED)]
    found = dict[str, Array]()
    for k, (name, index) in enumerate(zip(("first_order", "total_order"), sobol(values), strict=True)):
        low, high = np.quantile([each[k] for each in again], (0.025, 0.975), axis=0)
        found |= {name: index, f"{name}_low": low, f"{name}_high": high}
    return found
