"""Regimes of motion: the long-term behaviour of a body, inferred from the measurements of a run.

This needs the dataset alone, and no plotting library.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from sweep.kernels.status import SETTLED

REGIMES = ("settles", "few_reversals", "reverses_regularly", "wanders", "undecided")
"""The names of the regimes, in the order of their codes.  A cell belongs to the first whose condition it meets."""

FEWEST = 4
"""Reversals needed to judge their regularity: two cycles."""

SAME = 0.01
"""Variation of the cycles, relative to their mean, below which a body reverses regularly."""

SURE = 3.0
"""Number of standard errors above zero beyond which a Lyapunov exponent counts as positive."""

NEEDS = ("status", "reversals", "cycle_variation", "lyapunov", "lyapunov_error")
"""The variables from which the regime is inferred."""


def regimes(dataset: xr.Dataset) -> xr.DataArray:
    """The regime of each cell, one of `REGIMES`.

    A body that has settled reverses no more.  Bodies that have reversed less than `FEWEST` times by the time
    limit have a regime of their own.  If the lengths of the cycles vary by less than `SAME`, the body reverses
    regularly; if they vary more and the largest Lyapunov exponent is positive by `SURE` standard errors, it wanders.
    Otherwise the run was too short to distinguish quasi-periodic motion from chaos.
    """
    status, reversals, variation, exponent, error = (dataset[name] for name in NEEDS)
    conditions = [status == SETTLED, reversals < FEWEST, variation < SAME, exponent > SURE * error]
    codes = np.arange(len(REGIMES), dtype="int8")
    *kinds, undecided = codes
    found = np.select([condition.values for condition in conditions], kinds, undecided)
    words = {"flag_values": codes, "flag_meanings": " ".join(REGIMES)}
    return xr.DataArray(found, status.coords, status.dims, "regime", {"long_name": "regime of motion", **words})
