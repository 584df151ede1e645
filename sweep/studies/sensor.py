"""What a fit may find of the film itself: when it begins, and how the sensor shows and lies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sweep.grid import Array
from sweep.kernels.measures.misfit import Film
from sweep.models import attitude
from sweep.models.model import Columns, Model

UNKNOWNS = ("film_delay", "film_bias", "film_lean_x", "film_lean_y")
"""What a fit may find of a film beside the parameters of the body, by the names that the option --free takes."""


def of_film(film: Film) -> dict[str, tuple[float, float]]:
    """The ranges in which all that can be found of a film is sought, by name."""
    most = float(np.abs(film.value).max()) / 10
    ranges = {"film_delay": (0.0, float(film.time[-1]) / 10)}  # from the start of the motion to the first row
    if film.what != "heading":
        ranges["film_bias"] = -most, most  # what is shown of a body at rest
    if film.what == "gyroscope":
        ranges |= dict.fromkeys(("film_lean_x", "film_lean_y"), (-0.2, 0.2))  # of the sensor, in radian
    return ranges


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
