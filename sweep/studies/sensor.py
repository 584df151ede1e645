"""What a fit may find of the film itself: when it begins, and how the sensor shows and lies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.grid import Array
from sweep.kernels.measures.misfit import Film
from sweep.models import attitude
from sweep.models.model import Columns, Model


@dataclass(frozen=True)
class Unknown:
    """Something of a film that a fit may find beside the parameters of the body."""

    words: str
    of: tuple[str, ...]
    """What films of `Film.what` have it."""
    limits: Callable[[Film], tuple[float, float]]
    """The range in which it is sought."""


def _share(film: Film) -> tuple[float, float]:
    most = float(np.abs(film.value).max()) / 10
    return -most, most


UNKNOWNS = {
    "film_delay": Unknown(
        "time from the start of the motion to the first row", ("spin", "gyroscope", "heading"),
        lambda film: (0.0, float(film.time[-1]) / 10),
    ),
    "film_bias": Unknown("what is shown of a body at rest", ("spin", "gyroscope"), _share),
    "film_lean_x": Unknown("by how much the sensor leans towards x, in radian", ("gyroscope",), lambda _: (-0.2, 0.2)),
    "film_lean_y": Unknown("by how much the sensor leans towards y, in radian", ("gyroscope",), lambda _: (-0.2, 0.2)),
}  # fmt: skip
"""All of them, by the names that the option --free takes."""


def of_film(film: Film) -> dict[str, tuple[float, float]]:
    """The ranges of all that can be found of a film, by name."""
    return {name: each.limits(film) for name, each in UNKNOWNS.items() if film.what in each.of}


def seen_by(model: Model, film: Film, columns: Columns, found: Mapping[str, Array]) -> tuple[Any, Array | None]:
    """What `sampled` has to look at, and about which axis; a model without an attitude shows its spin.

    Parameters
    ----------
    columns : the parameters of the bodies, each of shape (cells,)
    found : values of `UNKNOWNS`, of the same shape
    """
    if film.what == "spin" or model.path is None:
        return None, None
    angle = model.turned(columns)
    cos, sin, none = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    if film.what == "heading":
        return attitude.turning, np.stack([cos, sin, none])
    x, y = (np.sin(found.get(f"film_lean_{axis}", none)) for axis in "xy")
    return attitude.rate, np.stack([x * cos - y * sin, x * sin + y * cos, -np.sqrt(1 - x**2 - y**2)])
