"""From a YAML file to a checked `Config`."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sweep.config import cases, document, scenes, schema
from sweep.config.faults import ConfigError, Fault
from sweep.config.messages import describe
from sweep.config.plain import plain
from sweep.config.schema import Config, Integrator, Values
from sweep.grid import BODY, Grid, distinct, off_the_body
from sweep.kernels import measures, methods
from sweep.kernels.differentiate import undifferentiable
from sweep.kernels.measures import MEASURES
from sweep.models.model import Model, Tier
from sweep.models.scene import SI
from sweep.parameters import PARAMETERS, SECTIONS

__all__ = ["Config", "ConfigError", "ConfigLike", "Fault", "Integrator", "Values", "load_config"]

ConfigLike = Config | Mapping[str, Any] | str | os.PathLike[str]
"""What stands for a configuration: itself, what its file says, or the path of that file."""


def load_config(
    config: ConfigLike, overrides: Mapping[str, Any] | None = None, *, argument: Callable[[str], str] = str
) -> Config:
    """Read and check a configuration.

    Parameters
    ----------
    config : path of a YAML file, what such a file says as a mapping, or a configuration.  An axis of a mapping may be
        a list, tuple, range, NumPy array or `xarray.DataArray`
    overrides : values that replace those of `config`, by path ("friction.mu") or, for a parameter or a setting of the
        integrator, by bare name ("mu")
    argument : what faults call the override of this key

    Raises
    ------
    ConfigError
        with a `Fault` for each thing that is wrong.
    """
    if isinstance(config, Config) and not overrides:
        return config
    source = _source(config)
    for key, value in (overrides or {}).items():
        source.set(_full_path(key), plain(value), argument(key))
    # A name made from the file's must not be refused, since the user did not choose it.
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", Path(source.file).stem).lstrip("._-")[:100]
    source.values.setdefault("name", stem or "sweep")
    try:
        checked = schema.Schema.model_validate(source.values)
    except ValidationError as error:
        found = describe(error.errors(), schema.Schema)
        raise ConfigError([source.fault(path, text, at_key=key) for path, text, key in found]) from None
    resolved = _resolve(checked, source)
    object.__setattr__(resolved, "source", source)
    return resolved


def _source(config: ConfigLike) -> document.Document:
    """The document of a configuration, to be changed freely."""
    if isinstance(config, Config):
        if config.source:
            return deepcopy(config.source)
        values, table = config.document(), None
        if config.cases is not None:
            table = config.cases_file or "cases", config.cases
            values["cases"] = table[0]
        return document.Document("", values, table=table)
    if isinstance(config, Mapping):
        return document.Document("", plain(config))
    return document.read(Path(config))


def _full_path(key: str) -> tuple[str, ...]:
    """Where the value of an override belongs."""
    if key in PARAMETERS:
        return PARAMETERS[key].place
    return ("integrator", key) if key in Integrator.model_fields else tuple(key.split("."))


def _resolve(checked: Any, source: document.Document) -> Config:
    """Fill in defaults, order the axes, and check that the values fit together."""
    given = _given(checked, source)
    if "offset" in given and not given["offset"].is_axis and given["offset"].numbers == (0.0,):
        del given["offset"]  # the default: it does not make a body other than the paper's
    columns = _table(checked.cases, source) if checked.cases is not None else None
    names, law, units = (*given, *(columns or ())), checked.friction.name, checked.units
    surface, needed = checked.body.surface, scenes.without_default(checked)
    if faults := list(scenes.misfits(checked, names, source)):
        raise ConfigError(faults)
    model = schema.tier_of(checked.model, law, units, names, surface)
    checked = _with_method(checked, model)
    faults = list(_misfits(checked, model, given, columns, source))
    order = sorted(model.parameters, key=lambda n: (_rank(n, schema.FIRST_AXES), _rank(n, tuple(given))))
    parameters = {}
    for name in order:
        default = None if name in needed else PARAMETERS[name].default
        if name in given:
            parameters[name] = given[name]
        elif name in (columns or {}):
            continue
        elif default is None:
            parameter = PARAMETERS[name]
            faults.append(source.fault(parameter.place, f"missing; allowed: {parameter.allowed}"))
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
        verify=checked.verify or 0.0,
        refine=checked.refine,
        cases=columns,
        cases_file=checked.cases,
        units=units,
        law=law,
        surface=surface,
    )
    if units == SI and "t_end" not in checked.integrator.model_fields_set:
        config = config.with_time()
    for path, check in _CHECKS:
        if reason := check(config):
            raise ConfigError([source.fault(path, reason)])
    if checked.verify is None and config.integrator.method == methods.AUTO and not config.refine:
        return replace(config, verify=schema.VERIFIED if Grid.of(config).size * schema.VERIFIED >= 1 else 0.0)
    return config


def _given(checked: Any, source: document.Document) -> dict[str, Values]:
    """The physical parameters that the document names, in its order."""
    found: dict[str, Values] = {}
    for key, value in source.values.items():
        if key in SECTIONS:
            found |= {name: getattr(getattr(checked, key), name) for name in value if name in PARAMETERS}
        elif key in PARAMETERS:
            found[key] = getattr(checked, key)
    return found


def _table(name: str, source: document.Document) -> dict[str, tuple[float, ...]]:
    """The columns of the table of cases, which is read once for all that is made from `source`."""
    if not source.table or source.table[0] != name:
        source.table = name, cases.read(source, name)
    return source.table[1]


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
    step, model = config.integrator.step, config.tier
    if step == "auto" or not isinstance(model, Model):
        return ""
    if config.integrator.t_end / step > schema.MAX_STEPS:
        return f"{config.integrator.t_end / step:.2g} steps to t_end; allowed: at most {schema.MAX_STEPS:.0e}"
    with np.errstate(all="ignore"):  # the period of a vanishingly small body is NaN
        longest = min(
            float(methods.longest_step(model, columns)[~model.impossible(columns)].min(initial=np.inf))
            for columns in distinct(Grid.of(config), BODY)
        )
    if step <= longest:
        return ""
    return f"{step:g}; allowed: auto, or at most {longest:.3g}, a quarter of the rattle's period"


# What is asked of a whole configuration, each only after the checks before it: the path at fault, and what is
# wrong ("" if nothing is).
_CHECKS: tuple[tuple[tuple[str, ...], Callable[[Config], str]], ...] = (
    ((), _too_large),
    (("refine",), _too_large_to_refine),
    (("body",), scenes.impossible),
    (("start", "x0"), off_the_body),
    (("integrator", "step"), _unusable_step),
)


def _with_method(checked: Any, model: Tier) -> Any:
    """The default method, filled in: `auto` where there is a choice and the step is not given."""
    integrator = checked.integrator
    alone = any(MEASURES[name].follows_tangent for name in _names(checked.measure or ()))
    if "method" in integrator.model_fields_set and not (alone and integrator.method == methods.AUTO):
        return checked
    choice = not alone and isinstance(model, Model) and len(methods.allowed(model)) > 1 and integrator.step == "auto"
    method = methods.AUTO if choice else methods.PLAIN
    return checked.model_copy(update={"integrator": integrator.model_copy(update={"method": method})})


def _measures(asked: list[str] | None, model: Tier) -> tuple[str, ...]:
    return measures.default(model) if asked is None else tuple(asked)


def _rank(name: str, names: tuple[str, ...]) -> int:
    return names.index(name) if name in names else len(names)


def _misfits(
    checked: Any,
    model: Tier,
    given: dict[str, Any],
    columns: dict[str, tuple[float, ...]] | None,
    source: document.Document,
) -> Iterator[Fault]:
    """Faults of values that are valid by themselves but do not fit together."""
    for name in given:
        path = PARAMETERS[name].place
        # A number that the model does not use may stay, so that one file serves every model.
        if name not in model.parameters and given[name].is_axis:
            yield source.fault(
                path, f"the {model.name} model has no {name}; allowed: {', '.join(model.parameters)}", at_key=True
            )
        elif columns is not None and name in columns:
            yield source.fault(path, f"also a column of {checked.cases}; allowed: one of the two", at_key=True)
        elif columns is not None and given[name].is_axis:
            yield source.fault(path, "an axis with cases; allowed: a number, or a column of the table")
    for name in columns or {}:
        if name not in model.parameters:
            yield source.fault(("cases",), f"column {name}: the {model.name} model has no {name}")
    if isinstance(model, Model) and checked.integrator.method not in (*methods.allowed(model), methods.AUTO):
        names = ", ".join((*methods.allowed(model), methods.AUTO))
        yield source.fault(("integrator", "method"), f"cannot run the {model.name} model; allowed: {names}")
    if checked.integrator.method == methods.AUTO and checked.integrator.step != "auto":
        yield source.fault(("integrator", "step"), "a number with method: auto; allowed: auto")
    if checked.verify and not isinstance(model, Model):
        yield source.fault(("verify",), f"the {model.name} model takes no steps; allowed: 0")
    if checked.refine:
        yield from _unrefinable(checked, model, source)
    yield from _unmeasurable(checked.measure or (), model, source)
    for i, name in enumerate(_names(checked.measure or ())):
        method = checked.integrator.method
        if MEASURES[name].follows_tangent and not methods.METHODS[method].follows_tangents:
            able = ", ".join(each for each, found in methods.METHODS.items() if found.follows_tangents)
            yield source.fault(("measure", i), f"not measured with method: {method}; allowed: {able}")
        elif MEASURES[name].follows_tangent and isinstance(model, Model) and (reason := undifferentiable(model)):
            yield source.fault(("measure", i), f"not measured on the {model.name} model: {reason}; allowed: others")


def _unmeasurable(specs: Sequence[str], model: Tier, source: document.Document) -> Iterator[Fault]:
    """Faults of the measurements asked for."""
    names, possible = _names(specs), measures.possible(model)
    for i, name in enumerate(names):
        if name not in possible:
            yield source.fault(
                ("measure", i), f"not measured on the {model.name} model; allowed: {', '.join(possible)}"
            )
        for needed in set(MEASURES[name].needs) - set(names):
            yield source.fault(("measure", i), f"measured with the {needed}; allowed: {needed} beside it")


def _names(specs: Iterable[str]) -> list[str]:
    """The names of measurements given by their specs."""
    return [spec.partition("=")[0] for spec in specs]


def _unrefinable(checked: Any, model: Tier, source: document.Document) -> Iterator[Fault]:
    """Faults of a refined run."""
    if not isinstance(model, Model):
        yield source.fault(("refine",), f"the {model.name} model is not simulated; allowed: 0")
    if checked.cases is not None:
        yield source.fault(("refine",), "with cases, which have no neighbours; allowed: 0, or axes")
    if checked.verify:
        yield source.fault(("verify",), "with refine; allowed: 0")
    if "reversals" not in _measures(checked.measure, model):
        yield source.fault(("measure",), "no reversals, on which refine depends; allowed: reversals among them")
