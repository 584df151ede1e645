"""Find bodies of `sweep.models.general.rigid_body` that are impossible or cannot stand upright, and say why."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sweep.models.general import rigid_body
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import Array, Columns

_ROUNDING = 1e-12

_FLATTEST = 1e30
"""Ratio of semi-axes up to which no power of it in the equations overflows."""


def impossible(columns: Columns, surface: Surface = ELLIPSOID) -> Array:
    """Find the bodies that are impossible or cannot stand, shape (cells,)."""
    return np.asarray(np.any([bad for bad, _ in wrongs(columns, surface)], axis=0))


def wrongs(columns: Columns, surface: Surface = ELLIPSOID) -> Iterator[tuple[Array, str]]:
    """Yield each possible fault: the bodies that have it, shape (cells,), and a sentence on what to do."""
    flat = np.maximum(columns["a"], columns["b"]) > _FLATTEST * columns["c"]
    yield flat, f"semi-axes differ by a factor of more than {_FLATTEST:.0e}; check their units"
    yield surface.outside(columns), f"centre of mass outside {surface.interior}"
    moments = np.linalg.eigvalsh(rigid_body.matrix(rigid_body.inertia(columns)))
    yield moments[:, 0] <= 0, "matrix of inertia not positive definite; all three principal moments must be positive"
    least, middle, largest = moments.T
    yield (
        largest > (least + middle) * (1 + _ROUNDING),
        "no body has such moments of inertia; none of the principal ones may exceed the sum of the other two",
    )
    with np.errstate(over="ignore"):  # infinitely stiff is stable
        k1, k2 = rigid_body.stiffness(columns, surface)
    least, most = np.minimum(k1, k2), np.maximum(k1, k2)
    neutral = (least <= 0) & (least >= -_ROUNDING * most)
    below = f"keep the centre of mass below both centres of curvature, {surface.bounds}"
    yield (least <= 0) & ~neutral, f"upright rest is not stable; {below}"
    yield neutral, f"upright rest is neutral, so that the body need not rock back; {below}"
