"""Trajectories straight from columns of parameters: a report needs no configuration, labels or files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from sweep.engine.executor import execute
from sweep.grid import Array, Grid
from sweep.kernels import lanes, methods
from sweep.kernels.lanes import Kernel
from sweep.models import MODELS
from sweep.models.coefficients import rattle_period
from sweep.models.model import Columns, Model
from sweep.parameters import PARAMETERS
from sweep.prediction import predict
from sweep.results.dataset import measured

MEASURE = ("reversals", "energy_error")


@dataclass(frozen=True)
class Ends:
    """Trajectories that have been carried to their ends."""

    kernel: Kernel
    images: Array
    t_end: float

    def __getitem__(self, name: str) -> Array:
        """A simulated variable of the dataset by its name, shape (cells,)."""
        return measured(self.kernel, self.images, self.t_end)[name]

    @property
    def states(self) -> Array:
        """The model's, of shape (states, cells)."""
        return self.kernel.unpack(self.images)[0]


def standard(**parameters: Any) -> dict[str, Array]:
    """The paper's standard case at μ = 75, with some parameters replaced, as columns."""
    values = {name: p.default for name, p in PARAMETERS.items()} | {"mu": 75.0} | parameters
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in values.values()))
    return {name: array.copy() for name, array in zip(values, arrays, strict=True)}


def never_stable(cells: int) -> Array:
    """Ranges of spin for `Kernel.images` in which nothing settles."""
    return np.full((6, cells), np.nan)


@cache
def make_kernel(method: str, model: Model, measure: tuple[str, ...]) -> Kernel:
    """The kernel, compiled."""
    kernel = methods.make_kernel(method, model, measure)
    kernel.compile()
    return kernel


def simulate(
    columns: Columns,
    t_end: float,
    *,
    model: str = "slip",
    method: str = "dopri5",
    step: float | Array | None = None,
    tolerance: float = lanes.TOLERANCE,
    measure: Iterable[str] = MEASURE,
    ranges: bool = True,
    settle: bool = False,
) -> Ends:
    """Carry trajectories to their ends.

    Parameters
    ----------
    columns : physical parameters by name, each of shape (cells,)
    t_end : time limit in sqrt(c/g)
    step : in sqrt(c/g), for all or of shape (cells,); by default the automatic one of `tolerance`
    measure : what of this the model can measure
    ranges : whether to tell the kernel at which spins the rattle decays: without, nothing settles
    settle : whether a trajectory ends where it has settled
    """
    chosen = MODELS[model]
    kernel = make_kernel(method, chosen, tuple(name for name in measure if name in chosen.measures))
    cells = len(columns["a"])
    steps = methods.automatic_step(method, chosen, columns, tolerance)[0] if step is None else step
    stability = predict(chosen, Grid({}, {}, dict(columns))).stability if ranges else None
    stable = stability.ranges if stability else never_stable(cells)
    steps = np.broadcast_to(steps, cells).astype(float)
    images = kernel.images(columns, steps, t_end, stable, rattle_period(columns))
    execute(kernel, images, stop_when_settled=settle)
    return Ends(kernel, images, t_end)
