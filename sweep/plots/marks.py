"""Classify the cells of a dataset by their kind of result, so that figures distinguish certain counts from others.

This needs the dataset alone, and no plotting library.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from sweep.grid import Array
from sweep.kernels.status import FAILURES, IMPOSSIBLE, TIME_LIMIT, Doubt
from sweep.plots.labels import is_code
from sweep.plots.pictures import of
from sweep.plots.quantities import field
from sweep.results.dataset import STATUS_WORDS, never_settles, uncertain

WORDS = {
    "not_run": "not run",
    "failed": "failed",
    "impossible": "impossible body",
    "no_value": "no value",
    "time_limit": "lower bound: time limit",
    "round_off": "limited by round-off",
    "uncertain": "uncertain count",
}
"""The kinds of cell, and their meanings.  A cell may be of several kinds, but only one of the first four."""

UNBOUNDED = "followed up to the time limit"
"""Words for the kind `time_limit` where no cell has settled, as in a model that never settles."""

BLANK = ("not_run", "failed", "impossible", "no_value")
"""The kinds of cell without a result to draw."""


def marks(dataset: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """Return the cells of each kind in `WORDS`.

    Parameters
    ----------
    name : as `sweep.plots.quantities.field` takes it

    Returns
    -------
    Booleans over the dimensions of the variable, for all kinds.  Kinds that do not concern the variable (a prediction
    cannot fail, a final spin is no count, a mean over cells is of no single one) are false everywhere.
    """
    found, picture = field(dataset, name), of(name)
    none = found.isnull() & False

    def of_each(variable: str) -> bool:
        """Return whether the dataset has a code for each value."""
        return variable in dataset and is_code(dataset[variable]) and {*dataset[variable].dims} <= {*found.dims}

    def among(variable: str, *values: int) -> xr.DataArray:
        """Return where a variable has one of these flags; nowhere if it has none for each value."""
        if not picture.simulated or not of_each(variable):
            return none
        return none | dataset[variable].isin(values)

    not_run, failed = among("status", 0), among("status", *FAILURES)
    impossible, missing = among("status", IMPOSSIBLE), found.isnull()
    sound = ~(not_run | failed | impossible)
    known = picture.simulated and of_each("status") and of_each("doubts")
    return {
        "not_run": not_run,
        "failed": failed,
        "impossible": impossible,
        "no_value": missing & sound,
        "time_limit": among("status", TIME_LIMIT) & ~missing & ("time_limit" in picture.words),
        "round_off": none | (sound & (dataset["doubts"] & int(Doubt.ROUND_OFF) > 0) if known else False),
        "uncertain": none | (uncertain(dataset) if known and "uncertain" in picture.words else False),
    }


def legend(dataset: xr.Dataset, name: str) -> dict[str, str]:
    """Return the legend entry of each kind that occurs, with the number of its cells."""
    counts = {kind: int(where.sum()) for kind, where in marks(dataset, name).items()}
    return {kind: f"{_meaning(dataset, name, kind)} ({count})" for kind, count in counts.items() if count}


def shared_kinds(dataset: xr.Dataset, name: str) -> dict[str, str]:
    """Return a sentence on each kind of cells with a result that more than half of all cells share."""
    found = {kind: where for kind, where in marks(dataset, name).items() if kind not in BLANK}
    shares = {kind: (int(where.sum()), where.size) for kind, where in found.items()}
    return {
        kind: f"{_meaning(dataset, name, kind)}, in {f'all {size}' if count == size else f'{count} of {size}'} cells"
        for kind, (count, size) in shares.items()
        if 2 * count > size
    }


def with_results(dataset: xr.Dataset, name: str) -> Array:
    """The values of the cells that have a result to draw, shape (cells,)."""
    found, kinds = field(dataset, name), marks(dataset, name)
    values, *blank = xr.broadcast(found, *(kinds[kind] for kind in BLANK))
    return np.asarray(values.values[~np.any([where.values for where in blank], axis=0)])


def _meaning(dataset: xr.Dataset, name: str, kind: str) -> str:
    """Return the meaning of a kind of cell for a variable, in words."""
    if kind == "failed":
        codes, counts = np.unique(dataset["status"].values, return_counts=True)
        ends = [f"{n} {STATUS_WORDS[c]}" for c, n in zip(codes.tolist(), counts.tolist(), strict=True) if c in FAILURES]
        return f"failed: {', '.join(ends)}"
    if kind == "time_limit" and never_settles(dataset):
        return UNBOUNDED
    return of(name).words.get(kind, WORDS[kind])
