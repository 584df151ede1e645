"""The times of the first K reversals; the configuration sets K: `measure: [reversals, {reversal_times: 12}]`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.kernels.codegen import compile_inline
from sweep.kernels.layout import Layout, Table
from sweep.kernels.measures.measurement import Measurement
from sweep.models.model import SPIN, Array, Columns
from sweep.variables import Variable


@dataclass(frozen=True)
class ReversalTimes(Measurement):
    name = "reversal_times"
    summary = "times of the first K reversals: {reversal_times: K}, by default K = 10"
    asks = SPIN
    needs = ("reversals",)
    variables = {
        "reversal_times": Variable(
            "float64", "1", "time of each spin reversal, in sqrt(c/g)", along="reversal", of_sound_runs=True
        )
    }
    bounds = (1, 1000)
    count: int = 10
    """K, the number of reversals whose times are kept."""

    @property
    def rows(self) -> tuple[str, ...]:
        return tuple(f"reversal_time{k}" for k in range(self.count))

    @property
    def spec(self) -> str:
        return f"{self.name}={self.count}"

    def start(self, columns: Columns, step: Array, rattle: Array) -> Mapping[str, Array | float]:
        return dict.fromkeys(self.rows, np.nan)

    def make_at_reversal(self, layout: Layout) -> Any:
        arguments = "group, lane, reverses, count, crossing"
        lines = [f"def at_reversal({arguments}):"]
        for k, name in enumerate(self.rows):
            place = f"group[{layout.at(name)} + lane]"
            lines.append(f"    {place} = crossing if reverses & (count == {k + 1}.0) else {place}")
        return compile_inline("at_reversal", "\n".join(lines), {})

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        return {"reversal_times": table.columns(self.rows)}
