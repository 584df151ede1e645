"""Export the page: the curves as a table, and the configuration of the slice and of its trajectories."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import xarray as xr

from sweep.config import Config, Values
from sweep.explorer.runner import Curve
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source
from sweep.explorer.state import Cell, State
from sweep.plots import labels


def stem(source: Source) -> str:
    """Return the name of exported files without suffix: the title of the dataset, as far as it is a valid name."""
    words = re.sub(r"[^A-Za-z0-9_-]", "", str(source.dataset.attrs.get("title", "")).split(":")[0])
    return f"{words or 'sweep'}_explored"


def csv(curves: Sequence[Curve | None]) -> str:
    """The samples of all trajectories, one per line, below a line of names and units."""
    tables = [_table(curve.dataset, k) for k, curve in enumerate(curves, 1) if curve]
    return "".join(t.to_csv(index=False, header=t is tables[0], float_format="%.10g", na_rep="nan") for t in tables)


def _table(one: xr.Dataset, k: int) -> Any:
    """The samples of the k-th trajectory as a table of pandas."""
    series = one[[name for name, v in one.data_vars.items() if v.dims == ("time",)]].reset_coords(drop=True)
    heads = {name: labels.with_unit(str(name), labels.unit(one, str(name))) for name in series.variables}
    table = series.to_dataframe().reset_index().rename(columns=heads)
    table.insert(0, "trajectory", k)
    return table


def yaml(source: Source, setup: Setup, state: State) -> str:
    """The configuration of the slice, and in comments the commands that make the map and the trajectories from it."""
    name, config = f"{stem(source)}.yaml", _sliced(source, setup.config, state)
    lines = [f"# python -m sweep run {name}"]
    lines += [f"# python -m sweep trajectory {name} {_options(config, cell)}" for cell in state.cells]
    if "case" in source.dims:
        lines.append("# The cases of the table are left out; this is the first of them.")
    if "sample" in source.dims:
        lines.append("# The samples are left out; the medians of their distributions replace them.")
    return "\n".join([*lines, config.to_yaml()])


def _sliced(source: Source, config: Config, state: State) -> Config:
    """`config` with a number for each axis that is not drawn."""
    fixed = {name: at for name, at in state.at.items() if name in config.parameters and name not in (state.x, state.y)}
    values = {name: Values.one(float(source.axes[name].values[at])) for name, at in fixed.items()}
    return replace(config, parameters={**config.parameters, **values})


def _options(config: Config, cell: Cell) -> str:
    given = {n: v.numbers[0] for n, v in config.parameters.items() if not v.is_axis}
    return " ".join(f"--at {name}={value:.12g}" for name, value in cell.items() if given.get(name) != value)
