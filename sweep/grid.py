"""The cells of a sweep: one row a trajectory, in the C order of the axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sweep.parameters import START

Array = NDArray[Any]


class Sweepable(Protocol):
    """What a grid is made from: `sweep.config.Config` is one."""

    @property
    def parameters(self) -> Mapping[str, Any]: ...
    @property
    def cases(self) -> Mapping[str, tuple[float, ...]] | None: ...


@dataclass(frozen=True)
class Grid:
    """Cells over axes, or a list of cases along the one dimension `case`."""

    axes: dict[str, Array]
    """Values by axis; empty for cases."""
    constants: dict[str, float]
    cases: dict[str, Array] | None = None

    @classmethod
    def of(cls, config: Sweepable) -> Grid:
        values = config.parameters
        return cls(
            axes={name: np.array(v.numbers) for name, v in values.items() if v.is_axis},
            constants={name: v.numbers[0] for name, v in values.items() if not v.is_axis},
            cases=None if config.cases is None else {k: np.array(v) for k, v in config.cases.items()},
        )

    @property
    def dims(self) -> tuple[str, ...]:
        return ("case",) if self.cases is not None else tuple(self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        if self.cases is not None:
            return (len(next(iter(self.cases.values()))),)
        return tuple(map(len, self.axes.values()))

    @property
    def size(self) -> int:
        return prod(self.shape)

    def columns(self) -> dict[str, Array]:
        """All parameters, each as an array of shape (size,)."""
        if self.cases is not None:
            varying = self.cases
        else:
            mesh = np.meshgrid(*self.axes.values(), indexing="ij")
            varying = {name: values.ravel() for name, values in zip(self.axes, mesh, strict=True)}
        return varying | {name: np.full(self.size, value) for name, value in self.constants.items()}

    def bodies(self) -> tuple[Grid, Array]:
        """The grid without the parameters of the start, and for each cell its place in that."""
        if self.cases is not None:
            return self, np.arange(self.size)
        kept = {name: values for name, values in self.axes.items() if name not in START}
        place = np.arange(prod(map(len, kept.values()))).reshape([len(v) for v in kept.values()])
        for position, name in enumerate(self.axes):
            if name in START:
                place = np.repeat(np.expand_dims(place, position), len(self.axes[name]), position)
        constants = self.constants | {name: float(v[0]) for name, v in self.axes.items() if name in START}
        return Grid(kept, constants), place.ravel()


def off_the_body(config: Sweepable) -> str:
    """What is wrong with the first cell whose start point lies off the ellipsoid; "" if none does."""
    p = Grid.of(config).columns()
    if "x0" not in p:
        return ""
    cos, sin = np.cos(p["delta"]), np.sin(p["delta"])
    x, y = p["x0"] * cos - p["y0"] * sin, p["x0"] * sin + p["y0"] * cos
    outside = np.flatnonzero((x / p["a"]) ** 2 + (y / p["b"]) ** 2 >= 1)
    if not len(outside):
        return ""
    i = outside[0]
    at = ", ".join(f"{name}={p[name][i]:g}" for name in ("x0", "y0", "a", "b", "delta"))
    return f"start point off the ellipsoid at {at}; allowed: (x/a)² + (y/b)² < 1 in the body's axes"
