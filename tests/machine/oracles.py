"""What must hold of a dataset by itself, and of the same cells wherever they are run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.grid import Array
from sweep.kernels.status import FAILURES, IMPOSSIBLE, SETTLED, TIME_LIMIT
from sweep.models.general.laws import LAWS
from sweep.models.general.surfaces import SURFACES
from sweep.parameters import PARAMETERS
from sweep.results.dataset import STATUSES
from sweep.results.probabilities import PROBABILITIES
from sweep.units import NUMBER, Unit

MIRRORED = ("delta", "n0", "y0", "Ixy", "Iyz", "roll", "omega1", "omega3", "slip2")
TURNED = ("x0", "y0", "Ixz", "Iyz", "roll", "pitch", "omega1", "omega2", "slip1", "slip2")
"""Parameters that change sign where y does, and where a body is turned by half a turn about z."""

LENGTH, TIME, MASS = 2.0**-4, 2.0**-3, 2.0**-5
"""In m, s and kg, what a real body has for the paper's units: powers of two, so that products of them are exact."""

Rows = dict[str, Array]
"""Values over cells, in a row, by name."""


def rows(dataset: xr.Dataset) -> Rows:
    """All variables and coordinates that a run has for each cell, in C order of its dimensions."""
    dims = dataset["status"].dims
    found = {}
    for name in dataset.variables:
        variable = dataset[name]
        if name not in PROBABILITIES and "count" not in variable.dims and name not in ("case", "sample"):
            along = [dim for dim in variable.dims if dim not in dims]
            whole = variable.broadcast_like(dataset["status"]).transpose(*dims, *along)
            found[str(name)] = whole.values.reshape(dataset["status"].size, *(dataset.sizes[dim] for dim in along))
    return found


def sound(config: Config, dataset: xr.Dataset) -> None:
    """Counts have the parity of the spins, nothing ends after t_end, and what is defined is finite."""
    found = rows(dataset)
    status = found["status"]
    assert set(status.tolist()) <= set(STATUSES) - {0}
    ran = np.isin(status, (SETTLED, TIME_LIMIT)) & (found.get("inferred", 0 * status) == 0)
    if config.simulated:
        # An end is the end of a step.
        assert (found["t_stop"][ran] <= config.integrator.t_end + found["step"][ran]).all(), "a run ends after t_end"
        assert np.isfinite(found["spin_final"][ran]).all()
        assert (found["spin_error"][ran] >= 0).all() if "spin_error" in found else True
    if "decided" in found and config.of_rattlebacks:
        model, columns = config.equations, config.grid.columns()
        whole = {name: columns[name] for name in model.parameters}
        with np.errstate(all="ignore"):
            start, *_ = model.energy(model.start(whole), model.constants.of(whole))
        known = (found["decided"] == 1) & (start != 0) & ran
        odd = np.sign(start) * np.sign(found["spin_final"]) != (-1.0) ** found["reversals"]
        assert not (odd & known).any(), f"parity of {_first(found, odd & known)}"
    if "reversals" in found:
        assert (found["reversals"][ran] >= 0).all()
    if "t_last_reversal" in found and "reversals" in found:
        some = ran & (found["reversals"] > 0)
        assert (found["t_last_reversal"][some] <= found["t_stop"][some]).all()


def same(one: Rows, other: Rows, names: Iterable[str] = ()) -> None:
    """The same numbers of the same cells, of all variables that both have or of those that are named."""
    for name in names or one:
        if name in one and name in other:
            np.testing.assert_array_equal(one[name], other[name], name)


def alike(one: Rows, other: Rows) -> None:
    """The same ends and counts, of cells whose numbers differ by rounding: where both say that these are certain."""
    certain = np.ones(len(one["status"]), bool)
    for found in (one, other):
        if "decided" in found:
            certain &= (found["decided"] == 1) & (found.get("sensitive", 0 * found["status"]) == 0)
        else:
            certain &= np.isin(found["status"], (*FAILURES, IMPOSSIBLE))
    for name in ("status", "reversals"):
        if name in one and name in other:
            np.testing.assert_array_equal(one[name][certain], other[name][certain], name)


def scales(config: Config) -> dict[str, float]:
    """What one of the paper's units is in SI, by parameter, for a body of the size above."""
    pure = LAWS[config.law].pure
    meanings = SURFACES[config.surface].meanings
    units: dict[str, Any] = {name: p.units for name, p in PARAMETERS.items()}
    units |= {name: meaning["units"] for name, meaning in meanings.items() if "units" in meaning}
    units |= dict.fromkeys(pure, NUMBER)
    return {
        name: LENGTH**unit.length * TIME**unit.time * MASS**unit.mass
        for name, unit in units.items() if isinstance(unit, Unit)
    }  # fmt: skip


def _first(found: Rows, which: Array) -> str:
    cell = int(np.flatnonzero(which)[0])
    return ", ".join(f"{name}={values[cell]}" for name, values in found.items() if values.ndim == 1)
