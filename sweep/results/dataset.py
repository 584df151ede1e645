"""Labelled results: from images and predictions to an xarray dataset with CF-1.11 attributes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.grid import Array, Grid
from sweep.kernels import lanes, methods
from sweep.kernels.lanes import Kernel
from sweep.parameters import PARAMETERS
from sweep.prediction import Prediction

STATUSES = {
    0: "not_run",
    lanes.SETTLED: "settled",
    lanes.TIME_LIMIT: "time_limit",
    lanes.LIFT_OFF: "lift_off",
    lanes.DIVERGED: "diverged",
    lanes.PARADOX: "paradox",
}

EXISTS, NO_FRICTION, NO_COUPLING, NOT_FOUND = range(4)
REASONS = {EXISTS: "exists", NO_FRICTION: "no_friction", NO_COUPLING: "no_coupling", NOT_FOUND: "not_found"}

NOISE = {0: "firm", 1: "noise_limited"}

STEP_RULES = {methods.FIXED: "fixed", methods.ACCURACY: "accuracy", methods.STABILITY: "stability"}


@dataclass(frozen=True)
class Variable:
    dtype: str
    units: str
    long_name: str
    flags: Mapping[int, str] | None = None
    per_body: bool = False
    """Without the parameters of the start."""


def _critical(sign: str, event: str, source: str) -> Variable:
    where = "positive spin above" if sign == "+" else "negative spin below"
    return Variable("float64", "1", f"{where} which {event}, by {source}, in sqrt(g/c)", per_body=True)


_FORMULA, _EIGENVALUES = "the formula of Takano (2011)", "the eigenvalues of the model"

VARIABLES: dict[str, Variable] = {
    "reversals": Variable("int16", "1", "spin reversals of the simulated trajectory"),
    "t_first_reversal": Variable("float64", "1", "time of the first spin reversal, in sqrt(c/g)"),
    "t_last_reversal": Variable("float64", "1", "time of the last spin reversal, in sqrt(c/g)"),
    "noise_limited": Variable(
        "int8", "1", "whether a mode of the rattle fell under the round-off of the other before it grew", NOISE
    ),
    "spin_mean": Variable("float64", "1", "spin averaged over the last full window before t_stop, in sqrt(g/c)"),
    "status": Variable("int8", "1", "how the simulation of the trajectory ended", STATUSES),
    "inferred": Variable("int8", "1", "how reversals and status were found", {0: "simulated", 1: "inferred"}),
    "spin_final": Variable("float64", "1", "spin at t_stop, in sqrt(g/c)"),
    "t_stop": Variable("float64", "1", "time at which the simulation ended, in sqrt(c/g)"),
    "energy_error": Variable(
        "float64",
        "1",
        f"largest violation of the energy balance, looked at every {lanes.BLOCK} steps, "
        "relative to the start energy above rest",
    ),
    "method": Variable("int8", "1", "integration method of the trajectory", dict(enumerate(methods.METHODS))),
    "step": Variable("float64", "1", "integration step, in sqrt(c/g)"),
    "step_rule": Variable("int8", "1", "what set the integration step", STEP_RULES),
    "reversals_predicted": Variable("int16", "1", "spin reversals predicted by Takano (2011), cases (I) and (II)"),
    "n_c1_plus": _critical("+", "rattle grows", _FORMULA),
    "n_c1_minus": _critical("-", "rattle grows", _FORMULA),
    "n_c2_plus": _critical("+", "spin reverses", _FORMULA),
    "n_c2_minus": _critical("-", "spin reverses", _FORMULA),
    "n_c1_plus_linear": _critical("+", "rattle grows", _EIGENVALUES),
    "n_c1_minus_linear": _critical("-", "rattle grows", _EIGENVALUES),
    "form_factor": Variable("float64", "1", "form factor L(f) of Takano (2011)", per_body=True),
    **{
        f"n_{n}_{side}_simulated{suffix}": _critical(
            {"plus": "+", "minus": "-"}[side], event, f"bisection of simulations{words}"
        )
        for n, event in (("c1", "rattle grows"), ("c2", "spin reverses"))
        for side in ("plus", "minus")
        for suffix, words in (("", ""), ("_inner", ": end of the bracket nearer zero"), ("_outer", ": far end"))
    },
    "critical_reason": Variable("int8", "1", "why a critical spin is not a number", REASONS, per_body=True),
}


def _again(name: str) -> Variable:
    return replace(VARIABLES[name], long_name=f"{VARIABLES[name].long_name}; second run, with finer steps")


_VERIFIED_CELL = Variable("int64", "1", "cell run again: its index in the C order of the axes")
VERIFIED: dict[str, Variable] = {
    **{name: _again(name) for name in ("reversals", "t_last_reversal", "spin_final", "status", "energy_error", "step")},
    "spin_difference": Variable("float64", "1", "difference in spin between the two runs at t_stop, in sqrt(g/c)"),
    "count_changed": Variable("int8", "1", "whether the two runs count other reversals", {0: "no", 1: "yes"}),
}


def measured(kernel: Kernel, images: Array, t_end: float | Array) -> dict[str, Array]:
    """The simulated variables, each of shape (cells,), from images at their ends."""

    def row(name: str) -> Array:
        return np.asarray(images[:, kernel.row(name)])

    spin, _, _ = kernel.model.energy(*kernel.unpack(images))
    result = {
        "status": row("status"),
        "spin_final": spin,
        "t_stop": kernel.times(images, t_end),
        "step": row("step"),
    }
    if "reversals" in kernel.measure:
        closed = kernel.times(images, t_end) >= row("period")
        result["reversals"] = row("reversals")
        result["t_last_reversal"] = row("last_reversal")
        if "first_reversal" in kernel.measure:
            result["t_first_reversal"] = row("first_reversal")
        if "noise_limited" in kernel.measure:
            result["noise_limited"] = row("noise_limited")
        result["spin_mean"] = np.where(closed, row("closed_window") / row("period"), np.nan)
    if "energy_error" in kernel.measure:
        start, violation = row("energy_start"), row("violation")
        result["energy_error"] = np.divide(violation, start, out=violation.copy(), where=start > 0)
    return result


def predicted(prediction: Prediction) -> dict[str, Array]:
    """The predicted variables, over cells or bodies."""
    result = {"form_factor": prediction.form_factor}
    if formulas := prediction.formulas:
        plus, minus = formulas.n_c1
        result["reversals_predicted"] = formulas.reversals
        result |= {"n_c1_plus": plus, "n_c1_minus": minus, "n_c2_plus": 2 * plus, "n_c2_minus": 2 * minus}
    if stability := prediction.stability:
        finite = [np.where(np.isfinite(n), n, np.nan) for n in stability.n_c1]
        result["n_c1_plus_linear"], result["n_c1_minus_linear"] = finite
    return result


def label(config: Config, grid: Grid, arrays: Mapping[str, Array], attributes: Mapping[str, Any]) -> xr.Dataset:
    """A dataset of arrays over the cells of `grid` (or over its bodies, where they are per body), flat or shaped."""
    variables = {
        name: xr.Variable(
            over.dims, np.asarray(arrays[name]).astype(spec.dtype, copy=False).reshape(over.shape), described(spec)
        )
        for name, (over, spec) in layout(grid, arrays).items()
    }
    coordinates = {
        name: xr.Variable((name,), values, _parameter_attributes(name)) for name, values in grid.axes.items()
    }
    for name, column in (grid.cases or {}).items():
        coordinates[name] = xr.Variable(("case",), column, _parameter_attributes(name))
    if grid.cases is not None:
        index = np.arange(grid.size, dtype="int64")
        coordinates["case"] = xr.Variable(("case",), index, {"long_name": "row of the table of cases", "units": "1"})
    for name, value in grid.constants.items():
        coordinates[name] = xr.Variable((), value, _parameter_attributes(name))
    head = {"Conventions": "CF-1.11", "title": f"{config.name}: reversals of a rattleback ({config.model} model)"}
    return xr.Dataset(variables, coordinates, {**head, **attributes})


def layout(grid: Grid, names: Iterable[str]) -> dict[str, tuple[Grid, Variable]]:
    """Of the variables `names` those over cells or bodies, each with the grid that it is an array over."""
    bodies, _ = grid.bodies()
    return {name: (bodies if spec.per_body else grid, spec) for name, spec in VARIABLES.items() if name in names}


def blocks(grid: Grid, tile: tuple[slice, ...], arrays: Mapping[str, Array]) -> Iterator[tuple[str, Any, Array]]:
    """Name, place in the whole array, and values of each variable of a tile's flat `arrays`."""
    at = dict(zip(grid.dims, tile, strict=True))
    for name, (over, spec) in layout(grid.part(tile), arrays).items():
        values = np.asarray(arrays[name]).astype(spec.dtype).reshape(over.shape)
        yield name, tuple(at[dim] for dim in over.dims), values


def assemble(grid: Grid, tiles: Iterable[tuple[tuple[slice, ...], Mapping[str, Array]]]) -> dict[str, Array]:
    """Arrays over all cells or bodies from those of the tiles."""
    whole: dict[str, Array] = {}
    for tile, arrays in tiles:
        for name, (over, spec) in layout(grid, set(arrays) - set(whole)).items():
            whole[name] = np.empty(over.shape, spec.dtype)
        for name, place, values in blocks(grid, tile, arrays):
            whole[name][place] = values
    return whole


def beside(result: xr.Dataset, again: Mapping[str, Array]) -> xr.Dataset:
    """`result` with what a second run of some cells found, along the dimension `verified`."""
    variables = {
        f"verified_{name}": xr.Variable(
            "verified", np.asarray(again[f"verified_{name}"]).astype(spec.dtype), described(spec)
        )
        for name, spec in {"cell": _VERIFIED_CELL, **VERIFIED}.items()
        if f"verified_{name}" in again
    }
    result = result.assign(variables)
    if "verified_count_changed" in again:
        result.attrs["verified_counts_changed"] = int(again["verified_count_changed"].sum())
    if "verified_spin_difference" in again:
        result.attrs["verified_largest_spin_difference"] = float(again["verified_spin_difference"].max())
    return result


def described(spec: Variable) -> dict[str, Any]:
    """The attributes of a variable."""
    words: dict[str, Any] = {"long_name": spec.long_name, "units": spec.units}
    if spec.flags:
        words["flag_values"] = np.array(list(spec.flags), dtype=spec.dtype)
        words["flag_meanings"] = " ".join(spec.flags.values())
    return words


def _parameter_attributes(name: str) -> dict[str, str]:
    return {"long_name": PARAMETERS[name].long_name, "units": PARAMETERS[name].units}
