"""Makes files of what is seen, without Bokeh: slice and trajectories as netCDF, and the configuration of both."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from sweep.config import Config, Values
from sweep.explorer.runner import Curve
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source
from sweep.explorer.state import Cell, State
from sweep.plots import labels


def stem(source: Source) -> str:
    """The name of all files without its ending: what a configuration may be called, whatever the dataset's title is."""
    words = re.sub(r"[^A-Za-z0-9_-]", "", str(source.dataset.attrs.get("title", "")).split(":")[0])
    return f"{words or 'sweep'}_explored"


def netcdf(source: Source, address: str, state: State, curves: Sequence[Curve]) -> bytes:
    """The slice with all its variables, and in the groups `trajectory_1`, … the trajectories, as a netCDF file."""
    fixed = {d: state.at.get(d, 0) for d in source.dims if d not in (state.x, state.y)}
    part = source.dataset.isel(fixed).load().assign_attrs(explored=address)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "slice.nc")
        part.to_netcdf(path, engine="netcdf4")
        for k, curve in enumerate(curves, 1):
            curve.dataset.to_netcdf(path, engine="netcdf4", mode="a", group=f"trajectory_{k}")
        return path.read_bytes()


def csv(curves: Sequence[Curve]) -> str:
    """The samples of all trajectories, one a line, below a line of names and units."""
    tables = [pd.DataFrame(columns=["trajectory"])] if not curves else []
    for k, curve in enumerate(curves, 1):
        one = curve.dataset
        names = ["time", *(str(name) for name, v in one.data_vars.items() if v.dims == ("time",))]
        series = {labels.with_unit(name, labels.unit(one, name)): one[name].values for name in names}
        tables.append(pd.DataFrame({"trajectory": k} | series))
    return str(pd.concat(tables).to_csv(index=False, float_format="%.10g", na_rep="nan"))


def yaml(source: Source, setup: Setup, state: State) -> str:
    """The configuration of the slice, and in comments the commands that make the map and the trajectories from it."""
    name, config = f"{stem(source)}.yaml", _sliced(source, setup.config, state)
    lines = [f"# python -m sweep run {name}"]
    lines += [f"# python -m sweep trajectory {name} {_options(config, cell)}" for cell in state.cells]
    if "case" in source.dims:
        lines.append("# The cases of the table are left out; this is the first of them.")
    if "sample" in source.dims:
        lines.append("# The samples are left out; the medians of their distributions stand for them.")
    return "\n".join([*lines, config.to_yaml()])


def _sliced(source: Source, config: Config, state: State) -> Config:
    """`config` with a number for each axis that is not drawn."""
    fixed = {name: at for name, at in state.at.items() if name in config.parameters and name not in (state.x, state.y)}
    values = {name: Values.one(float(source.axes[name].values[at])) for name, at in fixed.items()}
    return replace(config, parameters={**config.parameters, **values})


def _options(config: Config, cell: Cell) -> str:
    given = {n: v.numbers[0] for n, v in config.parameters.items() if not v.is_axis}
    return " ".join(f"--at {name}={value:.12g}" for name, value in cell.items() if given.get(name) != value)
