"""The state of the page, the choices that change it, and the address that holds it.

Every value that comes from an address or from a browser is checked here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import urlencode

import numpy as np

from sweep.axis import Axis
from sweep.explorer.slices import Source
from sweep.faults import brief
from sweep.parameters import PARAMETERS, Parameter
from sweep.plots import labels
from sweep.plots.quantities import subject
from sweep.plots.scales import LARGEST

MAX_CELLS = 6
"""Largest number of curves over each other: the number of colours that everybody can distinguish."""

LIMITS = {"low": "colours from", "high": "to"}
"""The ends of the colour scale, and their labels on the page."""

# Smaller limits count as zero, because a logarithmic scale would overflow.
_ZERO = 1e-100

# Largest number of unknown keys of an address in a message.
_NAMED = 5

_ZOOM = "zoom"
"""The key of the part of the map that is shown, which the page itself reads and writes."""

Cell = Mapping[str, float]
"""The parameters of a trajectory."""

PALETTES = ("", "viridis", "cividis", "inferno", "turbo", "gray", "PuOr_r", "coolwarm")
"""Colour maps of matplotlib to choose from; without one a variable has its default."""


@dataclass(frozen=True)
class State:
    """The map that is shown and the cells whose trajectories are drawn."""

    x: str
    y: str
    """Empty for a dataset of one axis."""
    show: str
    """The variable, one of the source's."""
    at: Mapping[str, int] = field(default_factory=dict)
    """The index on each axis that is not drawn."""
    cells: tuple[Cell, ...] = ()
    palette: str = ""
    scale: str = ""
    """Whose values set the colours: those of all maps, or "map" for those of the map that is shown."""
    limits: Mapping[str, float] = field(default_factory=dict)
    """Ends of the colour scale that the visitor has chosen; the values determine the others."""
    changed: Cell = field(default_factory=dict)
    """Parameters with other values than in the dataset, for which counts are estimated."""


@dataclass(frozen=True)
class Choice:
    """A part of the state that the visitor chooses among `options`; its `name` is the key in the address."""

    name: str
    title: str
    options: Sequence[str]
    words: Sequence[str]
    """The options in the words of the page."""
    axis: Axis | None = None
    """The axis of the dataset whose values are the options; empty for other choices."""

    def find(self, text: str) -> int | None:
        """The option that an address names, which may be any number on an axis; None if there is none."""
        if not self.axis:
            return self.options.index(text) if text in self.options else None
        at, (low, high) = number(text), self.axis.values[[0, -1]]
        slack = 1e-9 * max(abs(low), abs(high))
        return self.axis.nearest(at) if low - slack <= at <= high + slack else None

    def of(self, state: State) -> int:
        """The option that is chosen in a state."""
        if self.axis:
            return state.at[self.name]
        return self.options.index(getattr(state, self.name))

    def put(self, state: State, k: int) -> State:
        """The state with option `k`; two axes that would be the same change places."""
        if self.axis:
            return replace(state, at={**state.at, self.name: k})
        change: dict[str, Any] = {self.name: self.options[k]}
        if self.name == "show" and self.options[k] != state.show:
            change["limits"] = {}
        other = {"x": "y", "y": "x"}.get(self.name, "")
        if other and getattr(state, other) == self.options[k]:
            change[other] = getattr(state, self.name)
        return replace(state, **change)


_CHOSEN = "sign"
"""An axis along which no map is drawn: the visitor chooses the sign of a critical spin."""


def choices(source: Source) -> dict[str, Choice]:
    """All choices for the map of a dataset, by name."""
    drawn = [d for d in source.axes if d != _CHOSEN]
    axes = drawn, [*map(source.words, drawn)]
    found = [Choice("show", "variable", source.variables, [*map(source.words, source.variables)])]
    found.append(Choice("x", "horizontal axis", *axes))
    if len(drawn) > 1:
        found.append(Choice("y", "vertical axis", *axes))
    for name, axis in source.axes.items():
        unit = labels.si_unit(source.dataset, name)
        exact, short = [f"{v:.12g}" for v in axis.values], [f"{labels.number(v)}{unit}" for v in axis.values]
        found.append(Choice(name, source.words(name), exact, short, axis))
    found.append(Choice("palette", "palette", PALETTES, ["default", *PALETTES[1:]]))
    found.append(Choice("scale", "colours", ("", "map"), ("same in all maps", "of this map")))
    return {choice.name: choice for choice in found}


def first(source: Source) -> State:
    """The state for an address without a query: the dataset's subject over its two longest axes, as in a picture.

    The other axes have their first value, but start spins the largest and signs the positive one.
    """
    about = subject(source.dataset)
    show = about if about in source.variables else source.variables[0]
    dims = [str(d) for d in source.cell[show].dims if d != _CHOSEN]
    dims += [d for d in source.axes if d not in (*dims, _CHOSEN)][: max(0, 2 - len(dims))]
    longest = sorted(dims, key=lambda d: -len(source.axes[d].values))[:2]
    *y, x = [d for d in dims if d in longest]
    last = {d: len(axis.values) - 1 for d, axis in source.axes.items() if d in ("n0", "omega3", _CHOSEN)}
    return State(x, y[0] if y else "", show, dict.fromkeys(source.axes, 0) | last)


def telling(source: Source, state: State) -> dict[str, int]:
    """Return the index of a cell of a map to show first: of the cells that reverse, one that counts as most of them.

    Of several, it is the one nearest to the middle, which is also taken without any count.
    """
    part = source.map(state.show, state.x, state.y, state.at)
    values = np.where(part.blank, 0, part.values)
    some = values[values > 0]
    here = values == np.median(some) if some.size else ~part.blank
    rows, columns = np.nonzero(here if here.any() else np.ones(values.shape, bool))
    height, width = values.shape
    k = np.hypot((rows + 0.5) / height - 0.5, (columns + 0.5) / width - 0.5).argmin()
    return {**state.at, state.x: int(columns[k])} | ({state.y: int(rows[k])} if state.y else {})


def write(state: State, source: Source, base: Cell) -> str:
    """The query of the address that opens `state`; for a cell it has the values that lie on an axis or differ from
    `base`."""
    chosen = {name: c.options[c.of(state)] for name, c in choices(source).items() if name not in (state.x, state.y)}
    pairs = [(name, option) for name, option in chosen.items() if option]
    pairs += [(name, f"{state.limits[name]:.12g}") for name in LIMITS if name in state.limits]
    if state.changed:
        pairs.append(("with", _named_values(state.changed)))
    for cell in state.cells:
        named = {n: v for n, v in cell.items() if n in source.dims or v != base.get(n)}
        pairs.append(("cell", _named_values(named)))
    return urlencode(pairs, safe=":,")


def _named_values(cell: Cell) -> str:
    return ",".join(f"{name}:{value:.12g}" for name, value in cell.items())


def read(
    query: Mapping[str, Sequence[str]], source: Source, base: Cell, known: Mapping[str, Parameter] = PARAMETERS
) -> tuple[State, list[str]]:
    """Read the state from an address, with a message for each part that is invalid and left out.

    Parameters
    ----------
    query : the values of each key of the query
    base : the parameters of a trajectory that a cell does not name; empty where none can be run
    known : the records of these parameters, by name
    """
    state, faults, unknown, all_choices = first(source), list[str](), list[str](), choices(source)
    # Limits come last, because a change of the variable resets them.
    for key, values in sorted(query.items(), key=lambda pair: pair[0] in LIMITS):
        choice = all_choices.get(key)
        if choice and (k := choice.find(values[-1])) is not None:
            state = choice.put(state, k)
        elif choice:
            among = f"from {choice.options[0]} to {choice.options[-1]}" if choice.axis else ", ".join(choice.options)
            faults.append(f"{key}={brief(values[-1])} is not there; choose {among}")
        elif key in LIMITS and math.isfinite(at := limit(values[-1])):
            state = replace(state, limits={**state.limits, key: at})
        elif key in LIMITS:
            faults.append(f"{key}={brief(values[-1])}: give a number from {-LARGEST:g} to {LARGEST:g}")
        elif key not in ("cell", "with", _ZOOM):
            unknown.append(f"'{brief(key)}'")
    if unknown:
        expected = ", ".join([*all_choices, *LIMITS, _ZOOM, "with", "cell"])
        those, more = ", ".join(unknown[:_NAMED]), " …" if len(unknown) > _NAMED else ""
        faults.append(f"unknown URL parameter {those}{more}; expected one of {expected}")
    if len(state.limits) == len(LIMITS) and not state.limits["low"] < state.limits["high"]:
        faults.append("low is not below high; the values set the ends of the colours")
        state = replace(state, limits={})
    asked = query.get("cell", ())
    cells: dict[str, list[Cell]] = {"with": [], "cell": []}
    for key, texts in (("with", query.get("with", ())[-1:]), ("cell", asked[:MAX_CELLS])):
        for text in texts:
            try:
                cells[key].append(_cell(text, base, known))
            except ValueError as fault:
                faults.append(f"{key}={brief(text)}: {fault}")
    if len(asked) > MAX_CELLS:
        faults.append(f"{len(asked)} cells are too many; the first {MAX_CELLS} are drawn")
    changed = {n: v for cell in cells["with"] for n, v in cell.items() if v != base[n]}
    if along := [name for name in changed if name in source.dims]:
        faults.append(f"with: {', '.join(along)} varies in this file; only constant parameters can be changed")
        changed = {name: value for name, value in changed.items() if name not in along}
    return replace(state, cells=tuple(cells["cell"]), changed=changed), faults


def wrong_value(parameter: Parameter, value: float) -> str:
    """Return what is wrong with the value of a parameter, or an empty string."""
    if math.isfinite(value) and parameter.allows(value):
        return ""
    return f"{parameter.name} has to be {parameter.allowed}"


def _cell(text: str, base: Cell, known: Mapping[str, Parameter]) -> Cell:
    """Read the cell that an address names; `ValueError` if it is invalid."""
    if not base:
        raise ValueError("this file has no configuration for trajectories")
    cell = dict(base)
    for pair in text.split(",", len(base)):
        name, _, value = pair.partition(":")
        if name not in cell:
            raise ValueError(f"{brief(name)} is not a parameter; choose {', '.join(cell)}")
        cell[name] = number(value)
        if fault := wrong_value(known[name], cell[name]):
            raise ValueError(fault)
    return cell


def limit(text: str) -> float:
    """An end of the colour scale as a text spells it; NaN if it is not a number, or farther out than `LARGEST`."""
    at = number(text)
    return math.nan if abs(at) > LARGEST else 0.0 if abs(at) < _ZERO else at


def number(text: str) -> float:
    """The number that a text spells, or else NaN."""
    try:
        return float(text) if len(text) <= 40 else math.nan
    except ValueError:
        return math.nan
