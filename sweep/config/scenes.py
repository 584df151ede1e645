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
from sweep.grid import BODY, Array, Grid, distinct, off_the_body
from sweep.models import solid
from sweep.models.general import BASES
from sweep.models.laws import Law
from sweep.models.scene import INERTIA, PAPER, PAPERS, PAPERS_LAW, is_papers, strangers
from sweep.parameters import PARAMETERS


def misfits_of_own(checked: Any, law: Law | None, names: Collection[str], source: Document) -> Iterator[Fault]:
    """Faults of parameters that do not belong together, where a user brings the model, or its `law` of friction."""
    if law is None:
        if "units" in checked.model_fields_set:
            yield source.fault(("units",), "the model's file says its units; allowed: no units", at_key=True)
        return
    for name, reason in strangers(law.name, checked.units, names, law).items():
        yield source.fault(PARAMETERS[name].place, reason, at_key=True)


def misfits(checked: Any, names: Collection[str], source: Document) -> Iterator[Fault]:
    """Faults of parameters that do not belong together."""
    law, units = checked.friction.name, checked.units
    if checked.model_sha256 is not None:
        yield source.fault(("model_sha256",), f"the {checked.model} model is no file; allowed: none", at_key=True)
    if "regularisation" in checked.friction.model_fields_set and checked.friction.law != "coulomb":
        yield source.fault(
            ("friction", "regularisation"), f"not of the law {law}; allowed: with law: coulomb", at_key=True
        )
    if is_papers(law, units, names):
        return
    if checked.model not in BASES:
        beyond = [name for name in names if name not in PAPERS]
        beyond += [f"law: {law}"] * (law != PAPERS_LAW) + [f"units: {units}"] * (units != PAPER)
        words = f"the {checked.model} model knows no {', '.join(beyond)}; allowed: {', '.join(BASES)}"
        yield source.fault(("model",), words)
        return
    for name, reason in strangers(law, units, names).items():
        yield source.fault(PARAMETERS[name].place, reason, at_key=True)


def impossible(config: Config) -> str:
    """What is wrong with the first body that cannot be or cannot stand; "" if all can."""
    if not config.of_rattlebacks or not {"offset", *INERTIA} & {*config.parameters, *(config.cases or ())}:
        return ""
    return next(filter(None, map(_impossible, distinct(Grid.of(config), BODY))), "")


def _impossible(columns: Mapping[str, Array]) -> str:
    given = [name for name in ("a", "b", "c", "offset", *INERTIA) if name in columns]
    for bad, reason in _wrongs(columns):
        cells = np.flatnonzero(bad)
        if len(cells):
            at = ", ".join(f"{name}={columns[name][cells[0]]:g}" for name in given)
            return f"{reason} at {at}"
    return ""


def misplaced(config: Config) -> str:
    """What is wrong with the first cell whose start point lies off the ellipsoid; "" if no cell's does."""
    return off_the_body(config) if config.of_rattlebacks else ""


_ROUNDING = 1e-12


def _wrongs(columns: Mapping[str, Array]) -> Iterator[tuple[Array, str]]:
    """Which bodies are impossible, shape (cells,), and why."""
    offset, c = solid.offset(columns), columns["c"]
    yield np.abs(offset) >= c, "centre of mass outside the ellipsoid; allowed: |offset| < c"
    moments = np.linalg.eigvalsh(solid.matrix(solid.inertia(columns)))
    yield moments[:, 0] <= 0, "matrix of inertia not positive definite; allowed: three positive principal moments"
    least, middle, largest = moments.T
    yield (
        largest > (least + middle) * (1 + _ROUNDING),
        "no body has such moments of inertia; allowed: no principal moment above the sum of the other two",
    )
    k1, k2 = solid.stiffness(columns)
    yield (
        np.minimum(k1, k2) <= 0,
        "upright rest is unstable; allowed: the centre of mass below both centres of curvature, "
        "offset > c - a²/c and offset > c - b²/c",
    )
