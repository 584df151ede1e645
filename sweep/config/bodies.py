"""Find bodies and start points of a configuration that cannot be."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from sweep.config.configuration import Config
from sweep.grid import BODY, Array, Grid, distinct
from sweep.models.general import starts, validity
from sweep.models.general.selection import INERTIA
from sweep.models.general.surfaces import SURFACES

_SHAPE = ("a", "b", "c", "offset", *INERTIA)

Reason = tuple[str, int, dict[str, float]]
"""Why some bodies cannot be or cannot stand, how many cells have one, and the parameters of the first."""


def impossible(config: Config) -> str:
    """Say what is wrong with the first body if none can be or can stand; "" if any can."""
    found = _reasons(config)
    return _said(found[0]) if sum(cells for _, cells, _ in found) == Grid.of(config).size else ""


def unfit(config: Config) -> str:
    """Say what is wrong with the first body that cannot be or cannot stand; "" if all can."""
    return next(map(_said, _reasons(config)), "")


def described_impossible(config: Config) -> dict[str, str]:
    """Return the attribute of a dataset that says how many cells have the status `impossible`, and why."""
    varying = {*config.axes, *(config.cases or ())}
    found = [
        f"{cells} cells, {words.partition(';')[0]}, the first at {_at(first, varying)}"
        for words, cells, first in _reasons(config)
    ]
    return {"impossible": "; ".join(found)} if found else {}


def misplaced(config: Config) -> str:
    """Say what is wrong with the first cell whose start point lies off the body; "" if no cell's does."""
    surface = SURFACES[config.surface]
    if not config.of_rattlebacks or "x0" not in {*config.parameters, *(config.cases or ())}:
        return ""
    for columns in distinct(Grid.of(config), (*BODY, "x0", "y0")):
        with np.errstate(over="ignore"):  # infinity lies off the body as well
            cells = np.flatnonzero(surface.off(columns, *starts.point(columns)))
        if len(cells):
            first = _at(_values(columns, ("x0", "y0", "a", "b", "delta"), cells[0]))
            return f"start point off the {surface.name} at {first}; keep {surface.outline}"
    return ""


def _said(reason: Reason) -> str:
    words, _, first = reason
    return f"{words} (at {_at(first)})"


def _at(values: Mapping[str, float], names: set[str] | None = None) -> str:
    return ", ".join(f"{name}={value:g}" for name, value in values.items() if names is None or name in names)


def _values(columns: Mapping[str, Array], names: tuple[str, ...], cell: int) -> dict[str, float]:
    return {name: float(columns[name][cell]) for name in names if name in columns}


def _reasons(config: Config) -> list[Reason]:
    """Collect the reasons why bodies cannot be or cannot stand; a cell counts for the first that is true of it."""
    if not config.of_rattlebacks or not {"offset", *INERTIA} & {*config.parameters, *(config.cases or ())}:
        return []
    grid, surface = Grid.of(config), SURFACES[config.surface]
    counts, first, seen = Counter[str](), dict[str, dict[str, float]](), 0
    for columns in distinct(grid, BODY):
        left = np.ones(len(columns["a"]), bool)
        seen += len(left)
        for bad, words in validity.wrongs(columns, surface):
            cells = np.flatnonzero(bad & left)
            if len(cells):
                first.setdefault(words, _values(columns, _SHAPE, cells[0]))
                counts[words] += len(cells)
                left[cells] = False
    return [(words, counts[words] * grid.size // seen, first[words]) for words in first]
