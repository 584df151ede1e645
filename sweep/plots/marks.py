"""What kind of result each cell of a dataset has, so that figures tell settled counts from all others.

From the dataset alone, and without any library that draws.
"""

from __future__ import annotations

import operator
from functools import reduce

import numpy as np
import xarray as xr

from sweep.grid import Array
from sweep.kernels.status import FAILURES, IMPOSSIBLE, TIME_LIMIT
from sweep.plots.labels import STATUS_WORDS, flag_words
from sweep.plots.quantities import DERIVED, field
from sweep.results.dataset import VARIABLES

WORDS = {
    "not_run": "not run",
    "failed": "failed",
    "impossible": "no such body, or none that stands",
    "no_value": "no value",
    "time_limit": "lower bound: ended at the time limit, may still grow",
    "inferred": "inferred from the cells around, not simulated",
    "noise_limited": "limited by round-off: the count is firm, late times are not",
    "uncertain": "count not certain: it depends on the windows or on the start's 10th digit",
}
"""The kinds of cell, and what they mean.  A cell may be of several kinds, but of one of the first four at most."""

BLANK = ("not_run", "failed", "impossible", "no_value")
"""The kinds of cell without a result to draw."""

_GROWING = {"reversals", "raw_reversals", "reversals_low", "reversals_high", "t_last_reversal", "difference"}
"""What a longer trajectory can only raise; of the difference, the simulated part."""

_PER_VARIABLE = {
    ("t_last_reversal", "no_value"): "no reversal",
    ("t_first_reversal", "no_value"): "no reversal",
    ("t_first_reversal_predicted", "no_value"): "none predicted",
    ("ratio", "no_value"): "no reversal, or none predicted",
    ("reversal_times", "no_value"): "no such reversal",
    ("spin_final", "time_limit"): "not settled: ended at the time limit",
    ("spin_mean", "time_limit"): "not settled: ended at the time limit",
    ("t_stop", "time_limit"): "not settled: ended at the time limit",
}


def marks(dataset: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """For each kind in `WORDS`, where the cells are of that kind.

    Parameters
    ----------
    name : as `sweep.plots.quantities.field` takes it

    Returns
    -------
    Booleans over the dimensions of the variable, for all kinds.  Kinds that do not concern the variable (a prediction
    cannot fail, a final spin is no count) are false everywhere.
    """
    found, simulated = field(dataset, name), _is_simulated(name)

    def among(variable: str, *values: int) -> Array:
        """Where a variable with flags has one of these values, over the dimensions of `found`."""
        if not simulated or variable not in dataset:
            return np.zeros(found.shape, bool)
        flags = dataset[variable].variable
        where = np.isin(flags.values, values).transpose([flags.dims.index(d) for d in found.dims if d in flags.dims])
        places = tuple(slice(None) if d in flags.dims else None for d in found.dims)
        return np.asarray(np.broadcast_to(where[places], found.shape))

    not_run, failed, inferred = among("status", 0), among("status", *FAILURES), among("inferred", 1)
    impossible = among("status", IMPOSSIBLE)
    missing = np.isnan(found.values) if found.dtype.kind == "f" else np.zeros(found.shape, bool)
    sound = ~(not_run | failed | impossible)
    grows, limited = name in _GROWING, name in _GROWING or (name, "time_limit") in _PER_VARIABLE
    kinds = {
        "not_run": not_run,
        "failed": failed,
        "impossible": impossible,
        "no_value": missing & sound & ~inferred,
        "time_limit": among("status", TIME_LIMIT) & ~missing & limited,
        "inferred": inferred,
        "noise_limited": among("noise_limited", 1) & sound,
        "uncertain": (among("sensitive", 1) | among("window_dependent", 1)) & sound & grows,
    }
    coordinates = {dim: dataset[dim].values for dim in found.dims if dim in dataset.coords}
    return {kind: xr.DataArray(kinds[kind], coordinates, found.dims) for kind in WORDS}


def legend(dataset: xr.Dataset, name: str, among: dict[str, xr.DataArray] | None = None) -> dict[str, str]:
    """What a legend says of each kind that occurs: its words, and how many cells are of it.

    Parameters
    ----------
    among : the kinds of the cells; by default those of `marks`
    """
    kinds = marks(dataset, name) if among is None else among
    counts = {kind: (int(where.sum()), where.size) for kind, where in kinds.items()}
    return {
        kind: f"{meaning(dataset, name, kind)} ({count} of {size})" for kind, (count, size) in counts.items() if count
    }


def blank(kinds: dict[str, xr.DataArray]) -> xr.DataArray:
    """Where there is no result to draw, by the kinds of the cells."""
    return reduce(operator.or_, (kinds[kind] for kind in BLANK))


def in_words(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """A variable with flags, such as `status`, as words instead of numbers."""
    meanings = flag_words(dataset, name)
    values = dataset[name]
    found = np.full(values.shape, "", dtype=object)
    for value, meaning in meanings.items():
        found[values.values == value] = meaning
    return xr.DataArray(found, values.coords, values.dims, name)


def meaning(dataset: xr.Dataset, name: str, kind: str) -> str:
    """What a kind of cell means for a variable, in words."""
    if kind == "failed":
        codes, counts = np.unique(dataset["status"], return_counts=True)
        ends = [f"{n} {STATUS_WORDS[c]}" for c, n in zip(codes.tolist(), counts.tolist(), strict=True) if c in FAILURES]
        return f"failed: {', '.join(ends)}"
    if kind == "inferred" and field(dataset, name).dtype.kind == "f":
        return "not simulated: only counts are inferred"
    return _PER_VARIABLE.get((name, kind), WORDS[kind])


def _is_simulated(name: str) -> bool:
    return name in DERIVED or name == "t_stop" or (name in VARIABLES and VARIABLES[name].of_sound_runs)
