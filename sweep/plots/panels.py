"""What figures of a dataset share: a panel for each value of the short axes, and the words on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import xarray as xr

from sweep.kernels.status import FAILURES
from sweep.models.analytic import best_b
from sweep.results.dataset import VARIABLES

SYMBOLS = {"mu": "μ", "delta": "δ", "n0": "n₀", "x0": "x₀", "y0": "y₀", "case": "case"}

MAX_ROWS = 8
"""Panels that a figure may have, one below the other."""


@dataclass(frozen=True)
class Panels:
    """What to draw, and where."""

    dataset: xr.Dataset
    names: list[str]
    """Variables."""
    across: list[str]
    """Dimensions drawn as axes: up to two."""
    each: list[dict[str, int]]
    """For each panel, its index along every other dimension."""


def indices(dataset: xr.Dataset, dims: list[str]) -> Iterator[dict[str, int]]:
    """All indices along `dims`, a panel each."""
    for index in product(*(range(dataset.sizes[d]) for d in dims)):
        yield dict(zip(dims, index, strict=True))


def symbol(name: str) -> str:
    return SYMBOLS.get(name, name)


def words(name: str) -> str:
    """A variable's name in words."""
    return {"reversals": "simulated reversals", "reversals_predicted": "predicted reversals (Takano)"}.get(
        name, name.replace("_", " ")
    )


def panel_title(dataset: xr.Dataset, panel: dict[str, int]) -> str:
    return ", ".join(f"{symbol(d)} = {float(dataset[d][i]):g}" for d, i in panel.items())


def heading(dataset: xr.Dataset) -> str:
    """The dataset's title and its constant parameters."""
    scalars = [f"{symbol(str(n))} = {float(v):g}" for n, v in dataset.coords.items() if v.ndim == 0]
    return f"{dataset.attrs.get('title', '')}\n{', '.join(scalars)}"


def failed(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """Whether `name` has no value because the trajectory failed."""
    if name in VARIABLES and VARIABLES[name].of_sound_runs and "status" in dataset:
        return dataset["status"].isin((0, *FAILURES))
    return xr.zeros_like(dataset[name], dtype=bool)


def best_shape(dataset: xr.Dataset) -> float | None:
    """b of the largest form factor, if it is the same in the whole dataset."""
    if any(name not in dataset or dataset[name].ndim for name in ("a", "c")):
        return None
    b = best_b(float(dataset["a"]), float(dataset["c"]))
    return b if np.isfinite(b) else None
