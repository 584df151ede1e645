"""Finds the smallest change of each parameter that gives another number of reversals.

The slow equations foresee the counts over a range of each parameter in turn, which shows where to look. Simulations of
the full model then bracket the place at which the count changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.config.document import is_number, plain_data
from sweep.config.values import Values
from sweep.engine.reporter import Reporter
from sweep.engine.run import run
from sweep.faults import fault_of, refusal
from sweep.grid import Array
from sweep.models.general import starts
from sweep.models.general.surfaces import SURFACES
from sweep.models.model import ENDING
from sweep.prediction import foreseen
from sweep.results.kind import ATTRIBUTE, CHANGES
from sweep.studies.study import measuring, require_certain

# Each parameter is scanned from half of its value to twice as much, in steps of 0.7 %.
_FACTOR, _PLACES = 2.0, 201

# Cells that are simulated at once for a parameter, and the relative width of a bracket that is narrow enough. The first
# ones reach a quarter farther than the foreseen place.
_TOGETHER, _WIDTH, _FARTHER = 12, 1e-3, 1.25


@dataclass
class _Bracket:
    """Two values of a parameter, between which the count changes: as foreseen, until cells have been simulated."""

    near: float
    far: float
    count: int
    """The count at `far`."""

    @property
    def wide(self) -> bool:
        return bool(abs(np.log(self.far / self.near)) > _WIDTH)

    def places(self) -> Array:
        """Values between the two, and the second."""
        return np.asarray(self.near * (self.far / self.near) ** (np.arange(1, _TOGETHER + 1) / _TOGETHER))

    def narrow(self, counts: Array, reach: Array) -> bool:
        """Keep the first part at whose end the count is one to `reach`; return whether there is one.

        There is none beyond a count that is not decided: it may be one to `reach` as well.
        """
        first, ends = int(np.argmax(reach)), [self.near, *self.places()]
        if not reach[first] or (counts[:first] < 0).any():
            return False
        self.near, self.far, self.count = ends[first], ends[first + 1], int(counts[first])
        return True


def changes(config: Config, reversals: int, reporter: Reporter) -> xr.Dataset:
    """Arguments of `sweep.api.changes`."""
    more = plain_data(reversals)
    if not (is_number(more) and isinstance(more, int) and more):
        raise fault_of(refusal(reversals, "a whole number: 1 for one reversal more, -1 for one less"), "reversals")
    cell = _cell(config)
    now = int(_counts(config, {name: np.array([value]) for name, value in cell.items()}, reporter)[0])
    if now < 0:
        raise config.error((), "the count of this body is not decided; see `decided` of a run")
    brackets = _foreseen(config, cell, reversals)
    while wide := {name: each.places() for name, each in brackets.items() if each.wide}:
        columns = {name: np.tile(value, (len(wide), _TOGETHER)) for name, value in cell.items()}
        for i, (name, places) in enumerate(wide.items()):
            columns[name][i] = places
        counts = _counts(config, {name: values.ravel() for name, values in columns.items()}, reporter)
        for name, theirs in zip(wide, counts.reshape(len(wide), _TOGETHER), strict=True):
            if not brackets[name].narrow(theirs, _reach(theirs, now, reversals)):
                del brackets[name]
    return _dataset(config, cell, now, brackets)


def _cell(config: Config) -> dict[str, float]:
    """Return the parameters of the only cell of a configuration; raise a `InputError` if there are more."""
    if ENDING not in config.tier.offers:
        raise config.error(("model",), "has no foreseen counts; choose the model slip with viscous friction")
    require_certain(config)
    if config.grid.size > 1:
        name = next(name for name, values in {**config.axes, **config.cases}.items() if len(values) > 1)
        raise config.error(name, "has several values; give a single one")
    return {name: float(column[0]) for name, column in config.grid.columns().items()}


def _foreseen(config: Config, cell: Mapping[str, float], reversals: int) -> dict[str, _Bracket]:
    """Return brackets, by parameter, that hold the nearest value at which the foreseen count has changed enough."""
    names = [name for name, value in cell.items() if value]
    factors = _FACTOR ** np.linspace(-1, 1, _PLACES)
    columns = {name: np.full((len(names), _PLACES), value) for name, value in cell.items()}
    for i, name in enumerate(names):
        columns[name][i] *= factors
    flat = {name: values.ravel() for name, values in columns.items()}
    # What cannot be run has the present count, as if it were the body itself.
    possible = _possible(config, flat)
    flat = {name: np.where(possible, values, cell[name]) for name, values in flat.items()}
    counts = foreseen(config.equations, flat, check=False)["reversals_foreseen"].reshape(len(names), _PLACES)
    middle, brackets = _PLACES // 2, dict[str, _Bracket]()
    for i, name in enumerate(names):
        reached = np.flatnonzero(_reach(counts[i], counts[i, middle], reversals))
        if reached.size:
            nearest = reached[np.abs(reached - middle).argmin()]
            ends = cell[name] * factors[nearest] ** np.array([_FARTHER, 1.0])
            there = _possible(config, {n: ends if n == name else np.full(2, value) for n, value in cell.items()})
            brackets[name] = _Bracket(cell[name], float(ends[np.argmax(there)]), int(counts[i, nearest]))
    return brackets


def _possible(config: Config, columns: Mapping[str, Array]) -> Array:
    """Return which cells can be run: values within their bounds, a body that stands, and a start point on it."""
    bounded = [np.vectorize(config.table[name].allows)(values) for name, values in columns.items()]
    off = SURFACES[config.surface].off(columns, *starts.point(columns)) if "x0" in columns else False
    return np.asarray(np.all(bounded, axis=0) & ~config.equations.impossible(columns) & np.logical_not(off))


def _reach(counts: Array, now: int, reversals: int) -> Array:
    """Return which counts differ from `now` by as many reversals as asked for, or more, in the same sense."""
    return np.asarray((counts - now) * np.sign(reversals) >= abs(reversals)) & (counts >= 0)


def _counts(config: Config, columns: Mapping[str, Array], reporter: Reporter) -> Array:
    """Simulate cells; the count of a cell that is not decided is -1."""
    cases = {name: tuple(values.tolist()) for name, values in columns.items()}
    found = run(replace(measuring(config), parameters={}, cases=cases, picture=()), reporter=reporter)
    return np.where(found["decided"].values == 1, found["reversals"].values, -1)


def _dataset(config: Config, cell: Mapping[str, float], now: int, brackets: Mapping[str, _Bracket]) -> xr.Dataset:
    """Label the brackets; a parameter without one has NaN and the present count."""
    alone = replace(config, parameters={name: Values.one(value) for name, value in cell.items()}, cases={})
    names = [name for name, value in cell.items() if value]
    nothing = _Bracket(np.nan, np.nan, now)
    rows = [(cell[name], brackets.get(name, nothing)) for name in names]
    columns = {
        "value": ([value for value, _ in rows], "value of the parameter"),
        "change": ([each.far / value - 1 for value, each in rows], "relative change that gives the other count"),
        "unchanged_at": ([each.near for _, each in rows], "last simulated value before that"),
        "changed_at": ([each.far for _, each in rows], "first simulated value with the other count"),
        "reversals": ([each.count for _, each in rows], "spin reversals there, simulated"),
    }
    variables = {name: ("parameter", values, {"long_name": meaning}) for name, (values, meaning) in columns.items()}
    attributes = {"title": f"{config.name}: changes of {now} reversals", "config": alone.label(), "reversals": now}
    return xr.Dataset(variables, {"parameter": names}, {ATTRIBUTE: CHANGES.name, **attributes})
