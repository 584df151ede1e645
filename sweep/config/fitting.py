"""Whether values that are valid by themselves fit together."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from sweep.config import scenes
from sweep.config.checked import Config
from sweep.config.document import Document
from sweep.config.faults import Fault
from sweep.config.schema import MAX_REFINED_CELLS
from sweep.grid import BODY, Grid, distinct
from sweep.kernels import measures, methods
from sweep.kernels.differentiate import undifferentiable
from sweep.kernels.measures import MEASURES
from sweep.models.model import Model, Tier
from sweep.parameters import Parameter

MAX_CELLS = 1_000_000_000
MAX_STEPS = 1e15


def misfits(
    checked: Any,
    model: Tier,
    given: dict[str, Any],
    columns: dict[str, tuple[float, ...]] | None,
    source: Document,
    known: Mapping[str, Parameter],
) -> Iterator[Fault]:
    """Faults of values that are valid by themselves but do not fit together."""
    for name in given:
        path = known[name].place
        # A number that the model does not use may stay, so that one file serves every model.
        if name not in model.parameters and given[name].is_axis:
            yield source.fault(
                path, f"the {model.name} model has no {name}; allowed: {', '.join(model.parameters)}", at_key=True
            )
        elif columns is not None and name in columns:
            yield source.fault(path, f"also a column of {checked.cases}; allowed: one of the two", at_key=True)
        elif columns is not None and given[name].is_axis:
            yield source.fault(path, "an axis with cases; allowed: a number, or a column of the table")
        if name in model.positive and 0.0 in given[name].numbers:
            yield source.fault(path, f"0; allowed with the {model.name} model: a number > 0")
    for name, values in (columns or {}).items():
        if name not in model.parameters:
            yield source.fault(("cases",), f"column {name}: the {model.name} model has no {name}")
        elif name in model.positive and 0.0 in values:
            yield source.fault(("cases",), f"column {name}: 0; allowed with the {model.name} model: numbers > 0")
    if isinstance(model, Model) and checked.integrator.method not in (*methods.allowed(model), methods.AUTO):
        names = ", ".join((*methods.allowed(model), methods.AUTO))
        yield source.fault(("integrator", "method"), f"cannot run the {model.name} model; allowed: {names}")
    if checked.integrator.method == methods.AUTO and checked.integrator.step != "auto":
        yield source.fault(("integrator", "step"), "a number with method: auto; allowed: auto")
    if checked.verify and not isinstance(model, Model):
        yield source.fault(("verify",), f"the {model.name} model takes no steps; allowed: 0")
    if checked.refine:
        yield from _unrefinable(checked, model, source)
    asked = names_of(checked.measure or ())
    for i, name in enumerate(asked):
        for reason in _unmeasurable(name, asked, checked.integrator.method, model):
            yield source.fault(("measure", i), reason)


def _unmeasurable(name: str, beside: Collection[str], method: str, model: Tier) -> Iterator[str]:
    """What is wrong with asking for the measurement `name`."""
    possible, kind = measures.possible(model), MEASURES[name]
    if name not in possible:
        yield f"not measured on the {model.name} model; allowed: {', '.join(possible)}"
    for needed in set(kind.needs) - set(beside):
        yield f"measured with the {needed}; allowed: {needed} beside it"
    if kind.follows_tangent and not methods.METHODS[method].follows_tangents:
        able = ", ".join(each for each, found in methods.METHODS.items() if found.follows_tangents)
        yield f"not measured with method: {method}; allowed: {able}"
    elif kind.follows_tangent and isinstance(model, Model) and (reason := undifferentiable(model)):
        yield f"not measured on the {model.name} model: {reason}; allowed: others"


def names_of(specs: Iterable[str]) -> list[str]:
    """The names of measurements given by their specs."""
    return [spec.partition("=")[0] for spec in specs]


def measured(asked: Collection[str] | None, model: Tier) -> tuple[str, ...]:
    """Specs of what is measured where these are asked for."""
    return measures.default(model) if asked is None else tuple(asked)


def _unrefinable(checked: Any, model: Tier, source: Document) -> Iterator[Fault]:
    """Faults of a refined run."""
    if not isinstance(model, Model):
        yield source.fault(("refine",), f"the {model.name} model is not simulated; allowed: 0")
    if checked.cases is not None:
        yield source.fault(("refine",), "with cases, which have no neighbours; allowed: 0, or axes")
    if checked.verify:
        yield source.fault(("verify",), "with refine; allowed: 0")
    if "reversals" not in measured(checked.measure, model):
        yield source.fault(("measure",), "no reversals, on which refine depends; allowed: reversals among them")


def _too_large(config: Config) -> str:
    cells = math.prod(map(len, config.axes.values()))
    return f"{cells} cells; allowed: at most {MAX_CELLS}" if cells > MAX_CELLS else ""


def _too_large_to_refine(config: Config) -> str:
    cells = math.prod(map(len, config.axes.values()))
    if not config.refine or cells <= MAX_REFINED_CELLS:
        return ""
    return f"{cells} cells, all held in memory; allowed: at most {MAX_REFINED_CELLS}, or refine: 0"


def _unusable_step(config: Config) -> str:
    """What is wrong with a step that the configuration fixes; "" if nothing is."""
    step, model = config.integrator.step, config.tier
    if step == "auto" or not isinstance(model, Model):
        return ""
    if config.integrator.t_end / step > MAX_STEPS:
        return f"{config.integrator.t_end / step:.2g} steps to t_end; allowed: at most {MAX_STEPS:.0e}"
    with np.errstate(all="ignore"):  # the period of a vanishingly small body is NaN
        names = BODY if config.of_rattlebacks else model.parameters
        longest = min(
            float(methods.longest_step(model, columns)[~model.impossible(columns)].min(initial=np.inf))
            for columns in distinct(Grid.of(config), names)
        )
    if step <= longest:
        return ""
    return f"{step:g}; allowed: auto, or at most {longest:.3g}, a quarter of the rattle's period"


# What is asked of a whole configuration, each only after the checks before it: the path at fault, and what is
# wrong ("" if nothing is).
CHECKS: tuple[tuple[tuple[str, ...], Callable[[Config], str]], ...] = (
    ((), _too_large),
    (("refine",), _too_large_to_refine),
    (("body",), scenes.impossible),
    (("start", "x0"), scenes.misplaced),
    (("integrator", "step"), _unusable_step),
)
