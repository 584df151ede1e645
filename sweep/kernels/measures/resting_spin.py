"""The spin at which a settled trajectory remains when the rest of its rattle has decayed.

A trajectory settles, and ends, while its rattle can still change its spin by a third: the spin at its end is off by
4 to 6 % (median).  The slow equations (`sweep.models.slow.estimate`) give the final value.  Of 74 settled cells of the
wide domain that had decayed by t = 400 000, they were off by 1e-5 (median), by more than 0.1 % in 4 %, by 0.4 % at
most; 11 of 90 bodies have none.  In a coarse `configs/mu_b.yaml` (439 cells) the median was 1.5e-5, and 1.1 % at most.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sweep.jit import on_all_threads
from sweep.kernels.layout import Table, constants_of
from sweep.kernels.measures.decay import WOUND
from sweep.kernels.measures.measurement import Kind, measured
from sweep.kernels.status import SETTLED
from sweep.models.model import Array, Model, Offer
from sweep.models.slow.estimate import Ending, ending
from sweep.models.stiff.form import STATES, velocities
from sweep.models.stiff.slip import form_of
from sweep.units import SPIN

_AT_A_TIME = 512
"""Number of cells whose ends one thread finds together; each needs 10 kB meanwhile."""


class RestingSpin(Kind):
    name = "resting_spin"
    summary = "final spin of a settled trajectory"
    asks = Offer.MODES
    by_default = True
    exact = False

    variables = {
        "spin_rest": measured(
            "float64", SPIN, "spin after the rattle has decayed",
            "Spin of a settled trajectory when its rattle has decayed; missing without two rocking modes.",
        )
    }  # fmt: skip

    def read(self, table: Table, times: Array, left: Ending) -> Mapping[str, Array]:
        return {"spin_rest": only(ends_as_predicted(table, left), left).spin}


def ends_as_predicted(table: Table, left: Ending) -> Array:
    """Return which trajectories have settled as the slow equations predict, shape (cells,).

    A nearly round body may settle because it was watched (`decay`): its rattle is then too large for them.
    """
    watched = (table[WOUND] > 0) if WOUND in table.layout else False
    return np.asarray((table["status"] == SETTLED) & (left.reversals == 0) & ~np.asarray(watched))


def only(which: Array, left: Ending) -> Ending:
    """Return the endings of a mask of trajectories, NaN for the others."""
    return Ending(*(np.where(which, values, np.nan) for values in left))


def endings(table: Table, which: Array) -> Ending:
    """Find how the trajectories of a mask end under their rattle alone; arrays over all cells, NaN where unknown."""
    result, model = Ending(*np.full((4, len(table.rows)), np.nan)), table.layout.model
    if model is None or Offer.ENDING not in model.offers:
        return result
    cells = np.flatnonzero(which & np.isfinite(table.columns(model.states)).all(axis=1))

    def find(first: int) -> None:
        some = cells[first : first + _AT_A_TIME]
        found = ending(form_of(model).full, *_full_states(model, Table(table.rows[some], table.layout)))
        for whole, part in zip(result, found, strict=True):
            whole[some] = part

    on_all_threads(find, range(0, len(cells), _AT_A_TIME))
    return result


def _full_states(model: Model, table: Table) -> tuple[Array, Any]:
    """States in the full model's variables and constants, of a model with modes in either set of variables."""
    constants = model.constants(*table.columns(constants_of(model)).T)
    states = table.columns(model.states).T
    return (velocities(form_of(model).nonstiff, states, constants) if model.states == STATES else states), constants
