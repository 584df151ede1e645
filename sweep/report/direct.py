"""Runs trajectories directly from columns of parameters, without configuration, labels or files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from sweep.engine.cells import Cells, Rules
from sweep.engine.executor import execute
from sweep.engine.life import live
from sweep.engine.lives import Lives
from sweep.grid import Array, Grid
from sweep.kernels import measures, methods
from sweep.kernels.build import build
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import TOLERANCE
from sweep.models import MODELS
from sweep.models.model import Columns, Model
from sweep.parameters import PAPER_PARAMETERS
from sweep.prediction import predict
from sweep.results.dataset import measured


@dataclass(frozen=True)
class Ends:
    """Trajectories that have run to their ends."""

    kernel: Kernel
    rows: Array
    t_end: float

    def __getitem__(self, name: str) -> Array:
        """Return a simulated variable of the dataset by name, of shape (cells,)."""
        return measured(self.kernel, self.rows, self.t_end)[name]

    @property
    def states(self) -> Array:
        """Return the model's states, of shape (states, cells)."""
        return self.kernel.states(self.rows)


def standard(**parameters: Any) -> dict[str, Array]:
    """Return the paper's standard case at μ = 75, with some parameters replaced, as columns."""
    values = {name: p.default for name, p in PAPER_PARAMETERS.items()} | {"mu": 75.0} | parameters
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in values.values()))
    return {name: array.copy() for name, array in zip(values, arrays, strict=True)}


@cache
def make_kernel(method: str, model: Model, measure: tuple[str, ...] | None = None) -> Kernel:
    """Return the compiled kernel with these measurements, by default those of a run."""
    kernel = methods.make_kernel(method, model, measures.default(model) if measure is None else measure)
    build([kernel])
    kernel.advancing.compile()
    return kernel


def simulate(
    columns: Columns,
    t_end: float,
    *,
    model: str = "slip",
    method: str = methods.PLAIN,
    step: float | Array | None = None,
    tolerance: float = TOLERANCE,
    settle: bool = False,
    decide: bool = False,
) -> Ends:
    """Run trajectories to their ends, with the measurements of a run.

    Parameters
    ----------
    columns : physical parameters by name, each of shape (cells,)
    t_end : time limit in sqrt(c/g)
    step : in sqrt(c/g), for all or of shape (cells,); by default the automatic one of `tolerance`
    settle : whether a trajectory ends as soon as it has settled
    decide : whether a failure is repeated with shorter steps until it is certain, as `sweep.run` does
    """
    chosen = MODELS[model]
    kernel = make_kernel(method, chosen)
    cells = len(columns["a"])
    steps = methods.automatic_step(method, chosen, columns, tolerance)[0] if step is None else step
    stable = predict(chosen, Grid({}, {}, dict(columns))).ranges
    steps = np.broadcast_to(steps, cells).astype(float)
    if decide:
        every, rows = np.arange(cells), kernel.initial(columns, stable)
        lives = Lives(Cells(
            kernel, every, columns, steps, np.zeros(cells), model=chosen, tolerance=np.full(cells, tolerance),
            rules=Rules(t_end, tolerance, settles=settle), stable=stable, rows=rows,
        ))  # fmt: skip
        live([lives])
        return Ends(kernel, lives.rows, t_end)
    rows = kernel.start(columns, steps, t_end, stable)
    kernel.table(rows)["settles"] = settle
    execute(kernel, rows)
    return Ends(kernel, rows, t_end)
