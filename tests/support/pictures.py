"""Pictures beside those that the pages show."""

from pathlib import Path

import matplotlib.image as mpimg
import numpy as np
from numpy.typing import NDArray


def difference(one: Path, other: Path) -> float:
    """Mean difference of two pictures in brightness, of 0 … 1; infinite if they are not of one size.

    Squares of eight pixels are compared, so that letters may be rendered a little differently.
    """
    first, second = _coarse(one), _coarse(other)
    return float(np.abs(first - second).mean()) if first.shape == second.shape else np.inf


def _coarse(path: Path) -> NDArray[np.float64]:
    pixels = mpimg.imread(path)[..., :3].astype(float)
    rows, columns = (length // 8 for length in pixels.shape[:2])
    return pixels[: 8 * rows, : 8 * columns].reshape(rows, 8, columns, 8, 3).mean(axis=(1, 3))
