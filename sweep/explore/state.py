"""What the page shows, as the address says it: every value that comes from an address is checked here."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from urllib.parse import urlencode

from sweep.config.faults import brief
from sweep.explore.slices import Source
from sweep.parameters import PARAMETERS, Parameter
from sweep.plots.quantities import subject

MAX_CELLS = 6
"""Curves over each other; as many as there are colours that everybody can tell apart."""

Cell = Mapping[str, float]
"""The parameters of a trajectory."""


@dataclass(frozen=True)
class State:
    """The map that is shown and the cells whose trajectories are drawn."""

    x: str
    y: str
    """Empty for a dataset of one axis."""
    show: str
    """One of the source's variables."""
    at: Mapping[str, int] = field(default_factory=dict)
    """The index on each axis that is not drawn."""
    cells: tuple[Cell, ...] = ()

    def with_axes(self, x: str, y: str) -> State:
        """The same with other axes; one that was chosen for both changes places with the other."""
        if x == y and x == self.x:
            x = self.y
        elif x == y:
            y = self.x
        return replace(self, x=x, y=y)


def first(source: Source) -> State:
    """What is shown when the address asks for nothing, over the two longest axes, in the dataset's order."""
    longest = sorted(source.dims, key=lambda d: -len(source.axes[d].values))[:2]
    x, *rest = [d for d in source.dims if d in longest]
    about = subject(source.dataset)
    show = about if about in source.variables else source.variables[0]
    return State(x, rest[0] if rest else "", show, dict.fromkeys(source.axes, 0))


def write(state: State, source: Source, base: Cell) -> str:
    """The query of the address that opens `state`; of a cell it names what lies on an axis or differs from `base`."""
    pairs = [("x", state.x), *([("y", state.y)] if state.y else []), ("show", state.show)]
    pairs += [(d, f"{source.axes[d].values[i]:.12g}") for d, i in state.at.items() if d not in (state.x, state.y)]
    for cell in state.cells:
        told = {n: v for n, v in cell.items() if n in source.dims or v != base.get(n)}
        pairs.append(("cell", ",".join(f"{n}:{v:.12g}" for n, v in told.items())))
    return urlencode(pairs, safe=":,")


def read(
    query: Mapping[str, Sequence[str]], source: Source, base: Cell, known: Mapping[str, Parameter] = PARAMETERS
) -> tuple[State, list[str]]:
    """The state that an address asks for, and what in it cannot be done and is left out.

    Parameters
    ----------
    query : the values of each key of the query
    base : the parameters of a trajectory that a cell does not name; empty where none can be run
    known : what they are, by name
    """
    state, faults = first(source), list[str]()
    given = {key: values[-1] for key, values in query.items() if values}
    axes = {}
    for key in ("x", "y"):
        if (name := given.pop(key, "")) in source.dims:
            axes[key] = name
        elif name:
            faults.append(f"{key}={brief(name)}: no axis; allowed: {', '.join(source.dims)}")
    if state.y:
        x = axes.get("x", state.x)
        others = [d for d in (axes.get("y"), state.y, state.x) if d and d != x]
        state = replace(state, x=x, y=others[0])
    if (name := given.pop("show", "")) in source.variables:
        state = replace(state, show=name)
    elif name:
        faults.append(f"show={brief(name)}: no variable; allowed: {', '.join(source.variables)}")
    cells = list(query.get("cell", ()))
    given.pop("cell", None)
    at = dict(state.at)
    for key, text in given.items():
        if key not in source.axes:
            faults.append(f"{brief(key)}: unknown; allowed: x, y, show, cell, {', '.join(source.axes)}")
        elif (index := _index(source, key, text)) is None:
            values = source.axes[key].values
            faults.append(f"{key}={brief(text)}: not on the axis; allowed: {values[0]:g} to {values[-1]:g}")
        else:
            at[key] = index
    found = []
    for text in cells[:MAX_CELLS]:
        cell, wrong = _cell(text, base, known)
        faults += wrong
        if not wrong:
            found.append(cell)
    if len(cells) > MAX_CELLS:
        faults.append(f"{len(cells)} cells; allowed: at most {MAX_CELLS}")
    return replace(state, at=at, cells=tuple(found)), faults


def wrong_value(parameter: Parameter, value: float | None) -> str:
    """What is wrong with the value of a parameter; "" if nothing is."""
    if value is not None and math.isfinite(value) and parameter.allows(value):
        return ""
    return f"{parameter.name}: {'not a number' if value is None else f'{value:g}'}; allowed: {parameter.allowed}"


def _index(source: Source, axis: str, text: str) -> int | None:
    values = source.axes[axis].values
    number = _number(text)
    slack = 1e-9 * max(abs(values[0]), abs(values[-1]))
    if number is None or not values[0] - slack <= number <= values[-1] + slack:
        return None
    return source.axes[axis].nearest(number)


def _cell(text: str, base: Cell, known: Mapping[str, Parameter]) -> tuple[Cell, list[str]]:
    cell = dict(base)
    return cell, list(_fill(cell, text, known))


def _fill(cell: dict[str, float], text: str, known: Mapping[str, Parameter]) -> Iterator[str]:
    if not cell:
        yield f"cell={brief(text)}: this file has no configuration from which a trajectory could be run"
        return
    for pair in text.split(",", len(cell)):
        name, _, value = pair.partition(":")
        if name not in cell:
            yield f"cell={brief(text)}: no parameter {brief(name)}; allowed: {', '.join(cell)}"
        elif fault := wrong_value(known[name], _number(value)):
            yield f"cell={brief(text)}: {fault}"
        else:
            cell[name] = float(value)


def _number(text: str) -> float | None:
    try:
        number = float(text) if len(text) <= 40 else math.nan
    except ValueError:
        return None
    return number if math.isfinite(number) else None
