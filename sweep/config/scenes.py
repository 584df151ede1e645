"""Whether what a configuration names beyond the paper makes a scene.

Parameters have to belong together, and there has to be such a body.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.config.checked import Config
from sweep.config.document import Document
from sweep.config.faults import Fault
from sweep.grid import BODY, Grid, distinct, off_the_body
from sweep.models.general import validity
from sweep.models.general.laws import Law
from sweep.models.general.selection import INERTIA, PAPER, PAPER_LAW, PAPER_PARAMETERS, SI, is_papers, strangers
from sweep.models.general.surfaces import ELLIPSOID, PARABOLOID, SURFACES
from sweep.models.general.variants import BASES
from sweep.parameters import PARAMETERS, Parameter


def misfits_of_own(checked: Any, law: Law | None, names: Collection[str], source: Document) -> Iterator[Fault]:
    """Faults of parameters that do not belong together, where a user brings the model, or its `law` of friction."""
    if law is None:
        if "units" in checked.model_fields_set:
            yield source.fault(("units",), "the model's file says its units; allowed: no units", at_key=True)
        return
    for name, reason in strangers(law.name, checked.units, names, checked.body.surface, law).items():
        yield source.fault(PARAMETERS[name].place, reason, at_key=True)


def misfits(checked: Any, names: Collection[str], source: Document) -> Iterator[Fault]:
    """Faults of parameters that do not belong together."""
    law, units, surface = checked.friction.name, checked.units, checked.body.surface
    if checked.model_sha256 is not None:
        yield source.fault(("model_sha256",), f"the {checked.model} model is no file; allowed: none", at_key=True)
    if "regularisation" in checked.friction.model_fields_set and checked.friction.law != "coulomb":
        yield source.fault(
            ("friction", "regularisation"), f"not of the law {law}; allowed: with law: coulomb", at_key=True
        )
    if is_papers(law, units, names, surface):
        return
    if checked.model not in BASES:
        beyond = [name for name in names if name not in PAPER_PARAMETERS]
        beyond += [f"law: {law}"] * (law != PAPER_LAW) + [f"units: {units}"] * (units != PAPER)
        beyond += [f"surface: {surface}"] * (surface != ELLIPSOID.name)
        words = f"the {checked.model} model knows no {', '.join(beyond)}; allowed: {', '.join(BASES)}"
        yield source.fault(("model",), words)
        return
    for name, reason in strangers(law, units, names, surface).items():
        yield source.fault(PARAMETERS[name].place, reason, at_key=True)


def without_default(units: str, surface: str) -> list[Parameter]:
    """The parameters of the paper that a configuration has to give, because their defaults are of other bodies."""
    names = PAPER_PARAMETERS if units == SI else {"a", "b"} if surface == PARABOLOID.name else ()
    return [PARAMETERS[name] for name in names]


@dataclass(frozen=True)
class _Reason:
    """Why some bodies cannot be or cannot stand."""

    words: str
    cells: int
    first: dict[str, float]
    """The parameters of the first of them."""

    def __str__(self) -> str:
        return f"{self.words} at {_at(self.first)}"


def impossible(config: Config) -> str:
    """What is wrong with the first body if none can be or can stand; "" if any can."""
    found = _reasons(config)
    return str(found[0]) if sum(reason.cells for reason in found) == Grid.of(config).size else ""


def unfit(config: Config) -> str:
    """What is wrong with the first body that cannot be or cannot stand; "" if all can."""
    return next(map(str, _reasons(config)), "")


def described_impossible(config: Config) -> dict[str, str]:
    """The attribute of a dataset that says how many cells have a status of `impossible`, and why."""
    varying = {*config.axes, *(config.cases or ())}
    found = [
        f"{reason.cells} cells, {reason.words.partition(';')[0]}, the first at "
        + _at({name: value for name, value in reason.first.items() if name in varying})
        for reason in _reasons(config)
    ]
    return {"impossible": "; ".join(found)} if found else {}


def _at(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name}={value:g}" for name, value in values.items())


def _reasons(config: Config) -> list[_Reason]:
    """Each reason why bodies cannot be or cannot stand; a cell counts for the first that is true of it."""
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
                given = [name for name in ("a", "b", "c", "offset", *INERTIA) if name in columns]
                first.setdefault(words, {name: float(columns[name][cells[0]]) for name in given})
                counts[words] += len(cells)
                left[cells] = False
    return [_Reason(words, counts[words] * grid.size // seen, first[words]) for words in first]


def misplaced(config: Config) -> str:
    """What is wrong with the first cell whose start point lies off the ellipsoid; "" if no cell's does."""
    return off_the_body(config) if config.of_rattlebacks else ""
