"""The spin at which a settled trajectory stays, when what is left of its rattle has decayed.

A trajectory settles, and is left, while its rattle can still change its spin by a third: of 60 settled cells, the spin
at the end was off by more than 0.1 % in 55.  The slow equations (`sweep.models.stiff.final_spin`) give where it goes:
of the same cells this was off by more than 0.1 % in five, by 0.8 % at most.  Beyond n_c1 a mode first grows and turns
the spin back: of 55 such cells of `configs/mu.yaml` and `configs/b.yaml`, followed to t = 1e6, the median was off by
0.03 %, five by more than 0.5 %, one by 6 %.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.kernels.layout import Table
from sweep.kernels.measures.measurement import Measurement, measured
from sweep.kernels.status import SETTLED
from sweep.models.ladder import slip
from sweep.models.model import MODES, Array, stack
from sweep.models.stiff.final_spin import resting_spin
from sweep.models.stiff.slip import STIFF_MODEL, Constants, momentum


class RestingSpin(Measurement):
    name = "resting_spin"
    summary = "spin at which a settled trajectory will stay"
    asks = MODES
    by_default = True

    variables = {
        "spin_rest": measured(
            "float64",
            "spin when the rattle of a settled trajectory has decayed, in sqrt(g/c); missing without two rocking modes",
        )
    }

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        result, settled = np.full(len(table.images), np.nan), table["status"] == SETTLED
        if settled.any():
            result[settled] = resting_spin(*_split(Table(table.images[settled], table.layout)))
        return {"spin_rest": result}


def _split(table: Table) -> tuple[Array, Constants]:
    """States and constants of `stiff.slip`, from images of either set of variables."""
    kept = {name: table[f"constant.{name}"] for name in slip.Constants._fields}
    constants = Constants(*(1 / kept[f"inv_{name}"] for name in ("I1", "I2", "I3")), **kept)
    if STIFF_MODEL.states[2] in table.layout:
        return table.columns(STIFF_MODEL.states).T, constants
    return stack(momentum(tuple(table.columns(slip.MODEL.states).T), constants)), constants
