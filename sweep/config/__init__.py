"""From a YAML file to a checked `Config`."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sweep.config import cases, document, schema
from sweep.config.faults import ConfigError, Fault, brief
from sweep.config.schema import Config, Integrator, Values
from sweep.grid import BODY, Grid, distinct, off_the_body
from sweep.kernels import methods
from sweep.models import MODELS, TIERS
from sweep.models.coefficients import rattle_period
from sweep.models.model import Model, Tier
from sweep.parameters import PARAMETERS

__all__ = ["Config", "ConfigError", "Fault", "Integrator", "Values", "load_config"]


def load_config(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Config:
    """Read and check a configuration.

    Parameters
    ----------
    path : YAML file
    overrides : values that replace the file's, by path ("friction.mu") or, for a parameter or a
        setting of the integrator, by its bare name ("mu")

    Raises
    ------
    ConfigError
        with a `Fault` for each thing that is wrong.
    """
    source = document.read(Path(path))
    for key, value in (overrides or {}).items():
        plain = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
        source.set(_full_path(key), plain, f"--set {brief(key)}")
    # A name that nobody gave is none to refuse.
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", Path(path).stem).lstrip("._-")[:100]
    source.values.setdefault("name", stem or "sweep")
    try:
        checked = schema.Schema.model_validate(source.values)
    except ValidationError as error:
        faults = [schema.describe(e) for e in error.errors()]
        raise ConfigError([source.fault(path, text, at_key=key) for path, text, key in faults]) from None
    return _resolve(checked, source)


def _full_path(key: str) -> tuple[str, ...]:
    if key in PARAMETERS:
        return PARAMETERS[key].section, key
    return ("integrator", key) if key in Integrator.model_fields else tuple(key.split("."))


def _resolve(checked: Any, source: document.Document) -> Config:
    """Fill in defaults, order the axes, and check what one value says of another."""
    model = TIERS[checked.model]
    given = {
        key: getattr(getattr(checked, section), key)
        for section, keys in source.values.items()
        if section in {p.section for p in PARAMETERS.values()}
        for key in keys
    }
    columns = cases.read(source, checked.cases) if checked.cases is not None else None
    faults = list(_misfits(checked, given, columns, source))
    order = sorted(model.parameters, key=lambda n: (_rank(n, schema.FIRST_AXES), _rank(n, tuple(given))))
    parameters = {}
    for name in order:
        default = PARAMETERS[name].default
        if name in given:
            parameters[name] = given[name]
        elif name in (columns or {}):
            continue
        elif default is None:
            parameter = PARAMETERS[name]
            faults.append(source.fault((parameter.section, name), f"missing; allowed: {parameter.allowed}"))
        else:
            parameters[name] = Values((default,), False, default)
    if faults:
        raise ConfigError(faults)
    config = Config(
        name=checked.name,
        model=checked.model,
        parameters=parameters,
        integrator=checked.integrator,
        measure=_measures(checked.measure, model),
        max_failed_fraction=checked.max_failed_fraction,
        verify=checked.verify,
        refine=checked.refine,
        cases=columns,
        cases_file=checked.cases,
    )
    if reason := _too_large(config):
        raise ConfigError([source.fault((), reason)])
    if reason := _too_large_to_refine(config):
        raise ConfigError([source.fault(("refine",), reason)])
    if beyond := off_the_body(config):
        raise ConfigError([source.fault(("start", "x0"), beyond)])
    if reason := _unusable_step(config):
        raise ConfigError([source.fault(("integrator", "step"), reason)])
    return config


def _too_large(config: Config) -> str:
    cells = math.prod(map(len, config.axes.values()))
    return f"{cells} cells; allowed: at most {schema.MAX_CELLS}" if cells > schema.MAX_CELLS else ""


def _too_large_to_refine(config: Config) -> str:
    cells = math.prod(map(len, config.axes.values()))
    if not config.refine or cells <= schema.MAX_REFINED_CELLS:
        return ""
    return f"{cells} cells, all held in memory; allowed: at most {schema.MAX_REFINED_CELLS}, or refine: 0"


def _unusable_step(config: Config) -> str:
    """What is wrong with a step that the configuration fixes; "" if nothing is."""
    step = config.integrator.step
    if step == "auto" or config.model not in MODELS:
        return ""
    if config.integrator.t_end / step > schema.MAX_STEPS:
        return f"{config.integrator.t_end / step:.2g} steps to t_end; allowed: at most {schema.MAX_STEPS:.0e}"
    # A window of the period-averaged spin closes at most once a step.
    with np.errstate(all="ignore"):  # a body that is next to nothing has a period of NaN
        longest = min(float(rattle_period(columns).min()) / 2 for columns in distinct(Grid.of(config), BODY))
    return "" if step <= longest else f"{step:g}; allowed: auto, or at most {longest:.3g}, half a rattle's period"


def _measures(asked: list[str] | None, model: Tier) -> tuple[str, ...]:
    if asked is not None:
        return tuple(asked)
    return tuple(name for name in schema.DEFAULT_MEASURES if name in model.measures)


def _rank(name: str, names: tuple[str, ...]) -> int:
    return names.index(name) if name in names else len(names)


def _misfits(checked: Any, given: dict[str, Any], columns: Any, source: document.Document) -> Any:
    model = TIERS[checked.model]
    for name in given:
        path = (PARAMETERS[name].section, name)
        # A number that the model has no use for may stay: one file then serves every model.
        if name not in model.parameters and given[name].is_axis:
            yield source.fault(
                path, f"the {model.name} model has no {name}; allowed: {', '.join(model.parameters)}", at_key=True
            )
        elif columns is not None and name in columns:
            yield source.fault(path, f"also a column of {checked.cases}; allowed: one of the two", at_key=True)
        elif columns is not None and given[name].is_axis:
            yield source.fault(path, "an axis beside cases; allowed: a number, or a column of the table")
    for name in columns or {}:
        if name not in model.parameters:
            yield source.fault(("cases",), f"column {name}: the {model.name} model has no {name}")
    if isinstance(model, Model) and checked.integrator.method not in (*methods.allowed(model), "auto"):
        names = ", ".join((*methods.allowed(model), "auto"))
        yield source.fault(("integrator", "method"), f"cannot run the {model.name} model; allowed: {names}")
    if checked.integrator.method == "auto" and checked.integrator.step != "auto":
        yield source.fault(("integrator", "step"), "a number beside method: auto; allowed: auto")
    if checked.verify and not isinstance(model, Model):
        yield source.fault(("verify",), f"the {model.name} model takes no steps; allowed: 0")
    if checked.refine:
        yield from _unrefinable(checked, model, source)
    for i, name in enumerate(checked.measure or ()):
        if name not in model.measures:
            yield source.fault(
                ("measure", i), f"not measured on the {model.name} model; allowed: {', '.join(model.measures)}"
            )
        elif name in ("first_reversal", "noise_limited") and "reversals" not in checked.measure:
            yield source.fault(("measure", i), "measured with the reversals; allowed: reversals beside it")


def _unrefinable(checked: Any, model: Tier, source: document.Document) -> Any:
    if not isinstance(model, Model):
        yield source.fault(("refine",), f"the {model.name} model is not simulated; allowed: 0")
    if checked.cases is not None:
        yield source.fault(("refine",), "beside cases, which have no neighbours; allowed: 0, or axes")
    if checked.verify:
        yield source.fault(("verify",), "beside refine; allowed: 0")
    if "reversals" not in _measures(checked.measure, model):
        yield source.fault(("measure",), "no reversals, which refine goes by; allowed: reversals among them")
