"""The spin at which a settled trajectory stays, when what is left of its rattle has decayed.

A trajectory settles, and is left, while its rattle can still change its spin by a third: the spin where it was left is
off by 4 to 6 % (median).  The slow equations (`sweep.models.stiff.final_spin`) give where it goes.  Of 79 settled cells
of the wide domain they were off by 1e-5 (median), by more than 0.1 % in 9 %, by 1.4 % at most; 29 bodies, nearly round
or hardly damped, have none.  In a coarse `configs/mu_b.yaml` the median was 3e-5; there a few spins beyond n_c1 that
still hold at t = 1e5, because the rattle that will turn them back is below 1e-14, make up all errors beyond 4 %.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.jit import on_all_threads
from sweep.kernels.layout import Table, constants_of
from sweep.kernels.measures.decay import FORESEEN
from sweep.kernels.measures.measurement import Measurement, measured
from sweep.kernels.status import SETTLED
from sweep.models.ladder import slip
from sweep.models.model import MODES, Array, stack
from sweep.models.stiff.final_spin import Ending, ending
from sweep.models.stiff.slip import STIFF_MODEL, Constants, momentum
from sweep.units import SPIN

_NEEDED = {*constants_of(slip.MODEL)}

_AT_A_TIME = 512
"""Cells whose ends one thread finds together, at 30 kB a cell while that goes on."""


class RestingSpin(Measurement):
    name = "resting_spin"
    summary = "spin at which a settled trajectory will stay"
    asks = MODES
    by_default = True

    variables = {
        "spin_rest": measured(
            "float64", SPIN, "spin after the rattle has decayed",
            "Spin of a settled trajectory when its rattle has decayed; missing without two rocking modes.",
        )
    }  # fmt: skip

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        return {"spin_rest": endings(table, table["status"] == SETTLED).spin}


def endings(table: Table, which: Array) -> Ending:
    """How the trajectories of a mask end that is left to their rattle; arrays over all, NaN where that is not known.

    A table that has a place for it keeps what was foreseen of a state.
    """
    result, keeps = Ending(*np.full((4, len(table.images)), np.nan)), FORESEEN[0] in table.layout
    if set(table.layout.names) >= _NEEDED:
        new = which & np.isfinite(table.columns(_states(table))).all(axis=1)
        if keeps:
            kept = new & (table[FORESEEN[0]] == table["done"] + 1)
            new &= ~kept
            for whole, name in zip(result, FORESEEN[1:], strict=True):
                whole[kept] = table[name][kept]
        cells = np.flatnonzero(new)

        def find(first: int) -> None:
            some = cells[first : first + _AT_A_TIME]
            found = ending(*slow_states(Table(table.images[some], table.layout)))
            for whole, part in zip(result, found, strict=True):
                whole[some] = part

        on_all_threads(find, range(0, len(cells), _AT_A_TIME))
        if keeps:
            for name, values in zip(FORESEEN, (table["done"] + 1, *result), strict=True):
                table[name][cells] = values[cells]
    return result


def slow_states(table: Table) -> tuple[Array, Constants]:
    """States and constants of `stiff.slip`, from images of a model with modes in either set of variables."""
    kept = {name: table[f"constant.{name}"] for name in slip.Constants._fields}
    constants = Constants(*(1 / kept[f"inv_{name}"] for name in ("I1", "I2", "I3")), **kept)
    states = table.columns(_states(table)).T
    return (states if _is_stiff(table) else stack(momentum(tuple(states), constants))), constants


def _states(table: Table) -> tuple[str, ...]:
    return STIFF_MODEL.states if _is_stiff(table) else slip.MODEL.states


def _is_stiff(table: Table) -> bool:
    return STIFF_MODEL.states[2] in table.layout
