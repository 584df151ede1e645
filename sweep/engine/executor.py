"""Advances trajectories to their ends, in chunks of work, and keeps them for a batch that is interrupted.

What follows from images that have ended, such as which cells are repeated and in which steps, is found again from them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

from sweep.grid import Array
from sweep.interrupt import point
from sweep.jit import threads
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, LANES
from sweep.kernels.measures.resting_spin import endings
from sweep.kernels.status import RUNNING, SETTLED
from sweep.models.ladder import slip
from sweep.models.model import MODES
from sweep.models.stiff.form import subset
from sweep.models.theory import linear

CHUNK_SECONDS = 0.7
"""Length of a chunk.  Progress, checkpoints and Ctrl-C wait for the end of one."""

STEP_SECONDS = 25e-9
"""Rough time of a step of one lane on one thread, measured on the slip model with dopri5 (`sweep bench`)."""

_REACH = 4.0
"""How many times the change of the spin at the present rates may be exceeded, where no slow equations hold."""

UNTIL_ALL_STOP = 2**40
"""Blocks of steps: as many as are needed."""


def execute(
    kernel: Kernel,
    images: Array,
    *,
    stop_when_settled: bool,
    after_chunk: Callable[[], None] = lambda: None,
    chunk_blocks: int | None = None,
) -> None:
    """Advance all unfinished `images`, in place, until every trajectory has ended.

    Parameters
    ----------
    images : shape (cells, rows), a row of the table per trajectory
    stop_when_settled : end a trajectory as soon as its spin can no longer reverse
    after_chunk : called after each chunk, when `images` is consistent: to report, save, or stop
        by raising an exception
    chunk_blocks : blocks of steps per chunk; by default as many as take about `CHUNK_SECONDS`

    Notes
    -----
    Trajectories that have begun go first and the others follow in random order, so that those done
    are always a fair sample, from which the time left can be estimated.  Neither the order nor the
    size of the chunks changes a result.
    """
    status = kernel.table(images)["status"]
    steps = kernel.table(images)["done"]
    order = np.random.default_rng(0).permutation(len(images))
    blocks = chunk_blocks or 1
    while len(pending := order[status[order] == RUNNING]):
        pending = pending[np.argsort(steps[pending] == 0, kind="stable")]
        chunk_began = time.perf_counter()
        kernel.advance(images, pending, blocks, stop_when_settled)
        kernel.carry(images)
        if chunk_blocks is None:
            blocks = _rescale(blocks, time.perf_counter() - chunk_began, CHUNK_SECONDS)
        after_chunk()
        point()


def _rescale(blocks: int, seconds: float, wanted: float) -> int:
    # While the last trajectories pause often, every call is short, and `blocks` would grow without end.
    return min(max(1, int(blocks * np.clip(wanted / seconds, 0.25, 8))), UNTIL_ALL_STOP)


def nominal_seconds(steps: Array) -> float:
    """Rough upper bound on the time for trajectories of so many `steps`, shape (cells,)."""
    lanes = max(threads() * LANES, len(steps))
    blocks = np.ceil(steps / BLOCK)
    return float(max(blocks.mean() * lanes / threads(), blocks.max() * LANES) * BLOCK * STEP_SECONDS)


def too_early(kernel: Kernel, images: Array) -> Array:
    """Find the cells, by index, that have settled although their spin may reverse once more.

    The kernel lets a cell settle by a bound on what the energy of its rattle can do to the spin
    (`sweep.kernels.lanes`).  The bound fails where a strong rattle hardly decays, and turns the spin all the while, and
    where friction is too weak to stop the slip.  The slow equations foresee what comes; where they do not hold, the
    spin must keep its sign, and the rattle decay, even if the rattle changes the spin `_REACH` times as much as at its
    present rates.
    """
    if MODES not in kernel.model.offers:
        return np.empty(0, np.intp)
    table = kernel.table(images)
    settled = table["status"] == SETTLED
    left = endings(table, settled).reversals
    early, unknown = left > 0, np.flatnonzero(settled & np.isnan(left))
    if len(unknown):
        early[unknown] = ~_stays(kernel, images[unknown])
    return np.flatnonzero(early)


def _stays(kernel: Kernel, images: Array) -> Array:
    """Tell where the spin keeps its sign and the rattle decays even at `_REACH` times the change foreseen."""
    constants = subset(slip.Constants, kernel.unpack(images)[1])
    states = kernel.model_states(images)
    spin, _, _ = slip.MODEL.energy(tuple(states), constants)
    farthest = spin + _REACH * (linear.resting_spin(slip.MODEL, constants, states) - spin)
    known = np.isfinite(farthest)
    growth = linear.growth_rate(slip.MODEL, constants, np.where(known, farthest, spin))
    return np.asarray(known & (spin * farthest > 0) & (growth < 0))


class Work:
    """The runs of a batch, each with a name of its own.

    Parameters
    ----------
    left : images by the names of their runs, as an interrupted batch has left them in `kept`
    after_chunk : called after each chunk of work: to report, to save `kept`, or to stop by raising an exception
    """

    def __init__(self, left: Mapping[str, Array] | None = None, after_chunk: Callable[[], None] = lambda: None) -> None:
        self.kept, self.after_chunk = dict(left or {}), after_chunk

    def run(
        self, name: str, kernel: Kernel, images: Array, *, settle: bool = False, most: Array | float = np.inf
    ) -> None:
        """Run `images` to their ends, in place.

        Parameters
        ----------
        settle : whether a run ends where its spin can reverse no more
        most : steps after which a run ends at the latest, shape (cells,)
        """
        self._run(name, kernel, images, settle, most)
        if settle and len(early := too_early(kernel, images)):
            on = images[early]
            kernel.table(on)["status"] = RUNNING
            self._run(f"{name} unsettled", kernel, on, False, np.broadcast_to(most, len(images))[early])
            images[early] = on

    def _run(self, name: str, kernel: Kernel, images: Array, settle: bool, most: Array | float) -> None:
        goal = kernel.table(images)["goal"]
        wanted = goal.copy()
        left = self.kept.get(name)
        if left is not None and left.shape == images.shape:
            images[:] = left
        self.kept[name] = images
        goal[:] = np.minimum(wanted, most)
        execute(kernel, images, stop_when_settled=settle, after_chunk=self.after_chunk)
        goal[:] = wanted
        # What is found out about these runs later changes their images.
        self.kept[name] = images.copy()
