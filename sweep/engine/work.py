"""Runs images to their ends, and keeps them, so that a batch that is interrupted goes on from where it was.

What follows from images that have ended, such as which cells are repeated and in which steps, is found again from them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from sweep.engine import executor
from sweep.grid import Array
from sweep.kernels.kernel import Kernel


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
        goal = kernel.table(images)["goal"]
        wanted = goal.copy()
        left = self.kept.get(name)
        if left is not None and left.shape == images.shape:
            images[:] = left
        self.kept[name] = images
        goal[:] = np.minimum(wanted, most)
        executor.execute(kernel, images, stop_when_settled=settle, after_chunk=self.after_chunk)
        goal[:] = wanted
        # What is found out about these runs later changes their images.
        self.kept[name] = images.copy()
