"""Kernels that tests share, and cells to run with them.

A kernel takes from five seconds (dopri5) to forty (adams) to compile.  So tests measure what a run measures by
default unless they are about another set, and take their kernels from here.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
import numpy as np

from support import columns
from sweep.engine.executor import execute
from sweep.kernels import measures
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import make_kernel
from sweep.models import MODELS, find
from sweep.models.ladder import slip
from sweep.models.stiff.slip import form_of
from sweep.models.theory import stability

PAPER_FORM = form_of(slip.MODEL)
"""The stiff form of the paper's equations."""


def kernel(
    method: str = "dopri5", model: str = "slip", measure: Iterable[str] | None = None, tolerance: float = TOLERANCE
) -> Kernel:
    """The kernel of a run with these settings; by default, with the measurements that a run takes by default."""
    return make_kernel(method, find(model), default_measures(model) if measure is None else measure, tolerance)


def default_measures(model: str) -> tuple[str, ...]:
    return measures.default(find(model))


def started(kernel: Kernel, step: Any, t_end: float, *, settle: bool = False, **parameters: Any) -> np.ndarray:
    """State rows of the standard case with some parameters replaced.

    Parameters
    ----------
    settle : give the kernel the critical spins, without which no cell settles
    """
    body = columns(**parameters)
    stable = stability.stable_ranges(MODELS[kernel.model.name], body) if settle else None
    return started_cells(kernel, body, step, t_end, stable)


def started_cells(
    kernel: Kernel, body: dict[str, np.ndarray], step: Any, t_end: Any, stable: np.ndarray | None = None
) -> np.ndarray:
    """State rows of the cells `body`; without `stable` none of them settles."""
    return kernel.start(body, np.broadcast_to(step, len(body["a"])).astype(float), t_end, stable)


def finish(kernel: Kernel, table: np.ndarray, *, settle: bool = True, **options: Any) -> np.ndarray:
    """Run all rows to their ends, in place."""
    kernel.table(table)["settles"] = settle
    execute(kernel, table, **options)
    return table


def run(kernel: Kernel, step: Any, t_end: float, *, settle: bool = False, **parameters: Any) -> np.ndarray:
    """State rows at their ends; parameters as of `started`."""
    return finish(kernel, started(kernel, step, t_end, settle=settle, **parameters))


def spin(kernel: Kernel, table: np.ndarray) -> np.ndarray:
    """Spin of each row."""
    return kernel.model.energy(*kernel.unpack(table))[0]


@contextmanager
def threads(number: int) -> Iterator[None]:
    """Run kernels on this number of threads, or on all there are."""
    before = numba.get_num_threads()
    numba.set_num_threads(min(number, numba.config.NUMBA_NUM_THREADS))
    try:
        yield
    finally:
        numba.set_num_threads(before)


# The longest first.
SHARED = [
    ("adams", "slip", (*default_measures("slip"), "estimate")),
    ("dopri5", "slip", default_measures("slip")),
    ("dopri5", "noslip", default_measures("noslip")),
    ("dopri5", "effective", default_measures("effective")),
    ("dopri5", "averaged", default_measures("averaged")),
    ("dopri5", "slip+coulomb+sigma", default_measures("slip+coulomb+sigma")),
    ("dopri5", "slip+viscous+offset", default_measures("slip+viscous+offset")),
    ("dopri5", "slip", ()),
    ("dopri5", "slip", ("reversals", "reversal_times=3")),
    ("dopri5", "averaged", ("reversals",)),
]
"""Method, model and measurements of the kernels that several files of tests run."""
