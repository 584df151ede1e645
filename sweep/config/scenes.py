"""Whether what a configuration names beyond the paper makes a scene.

Parameters have to belong together, and there has to be such a body.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from sweep.config.document import Document
from sweep.config.faults import Fault
from sweep.config.schema import Config
from sweep.grid import BODY, Array, Grid, distinct
from sweep.models import bodies
from sweep.models.general import BASES
from sweep.models.scene import INERTIA, PAPER, PAPERS, PAPERS_LAW, SI, is_papers, strangers
from sweep.models.surfaces import ELLIPSOID, PARABOLOID, SURFACES, Surface
from sweep.parameters import PARAMETERS


def misfits(checked: Any, names: Collection[str], source: Document) -> Iterator[Fault]:
    """Faults of parameters that do not belong together."""
    law, units, surface = checked.friction.name, checked.units, checked.body.surface
    if "regularisation" in checked.friction.model_fields_set and checked.friction.law != "coulomb":
        yield source.fault(
            ("friction", "regularisation"), f"not of the law {law}; allowed: with law: coulomb", at_key=True
        )
    if is_papers(law, units, names, surface):
        return
    if checked.model not in BASES:
        beyond = [name for name in names if name not in PAPERS]
        beyond += [f"law: {law}"] * (law != PAPERS_LAW) + [f"units: {units}"] * (units != PAPER)
        beyond += [f"surface: {surface}"] * (surface != ELLIPSOID.name)
        words = f"the {checked.model} model knows no {', '.join(beyond)}; allowed: {', '.join(BASES)}"
        yield source.fault(("model",), words)
        return
    for name, reason in strangers(law, units, names, surface).items():
        yield source.fault(PARAMETERS[name].place, reason, at_key=True)


def without_default(checked: Any) -> frozenset[str]:
    """The parameters of the paper that a configuration has to give, because their defaults are of other bodies."""
    if checked.units == SI:
        return frozenset(PAPERS)
    return frozenset({"a", "b"} if checked.body.surface == PARABOLOID.name else ())


def impossible(config: Config) -> str:
    """What is wrong with the first body that cannot be or cannot stand; "" if all can."""
    if not {"offset", *INERTIA} & {*config.parameters, *(config.cases or ())}:
        return ""
    surface = SURFACES[config.surface]
    return next(filter(None, (_impossible(columns, surface) for columns in distinct(Grid.of(config), BODY))), "")


def _impossible(columns: Mapping[str, Array], surface: Surface) -> str:
    given = [name for name in ("a", "b", "c", "offset", *INERTIA) if name in columns]
    for bad, reason in bodies.wrongs(columns, surface):
        cells = np.flatnonzero(bad)
        if len(cells):
            at = ", ".join(f"{name}={columns[name][cells[0]]:g}" for name in given)
            return f"{reason} at {at}"
    return ""
