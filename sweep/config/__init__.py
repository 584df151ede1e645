"""From a YAML file to a checked `Config`."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Mapping
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from sweep.config import brought, cases, document, fitting, scenes, schema
from sweep.config.checked import FIRST_AXES, Config, tier_of
from sweep.config.faults import ConfigError, Fault
from sweep.config.messages import describe
from sweep.config.plain import plain
from sweep.config.schema import Integrator
from sweep.config.values import Values
from sweep.grid import Grid
from sweep.kernels import methods
from sweep.kernels.measures import MEASURES
from sweep.models.general.selection import PAPER_LAW, SI
from sweep.models.general.surfaces import ELLIPSOID
from sweep.models.model import Model, Tier
from sweep.models.origin import Origin
from sweep.models.user import loading
from sweep.parameters import Parameter, sections

__all__ = ["Config", "ConfigError", "ConfigLike", "Fault", "Integrator", "Values", "load_config"]

ConfigLike = Config | Mapping[str, Any] | str | os.PathLike[str]
"""What stands for a configuration: itself, what its file says, or the path of that file."""


def load_config(
    config: ConfigLike,
    overrides: Mapping[str, Any] | None = None,
    *,
    argument: Callable[[str], str] = str,
    announce: Callable[[str], None] | None = lambda words: None,  # noqa: ARG005
) -> Config:
    """Read and check a configuration.

    If its model is a file or an entry point, the code of that runs.

    Parameters
    ----------
    config : path of a YAML file, what such a file says as a mapping, or a configuration.  An axis of a mapping may be
        a list, tuple, range, NumPy array or `xarray.DataArray`
    overrides : values that replace those of `config`, by path ("friction.mu") or, for a parameter or a setting of the
        integrator, by bare name ("mu")
    argument : what faults call the override of this key
    announce : told in words that code of a user is about to run; None if such a model is to be refused

    Raises
    ------
    ConfigError
        with a `Fault` for each thing that is wrong.
    """
    if isinstance(config, Config) and not overrides:
        return config
    source, origin = _opened(config, overrides or {}, argument, announce)
    known = loading.table(origin)
    for key, value in (overrides or {}).items():
        source.set(_full_path(key, known), plain(value), argument(key))
    # A name made from the file's must not be refused, since the user did not choose it.
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", Path(source.file).stem).lstrip("._-")[:100]
    source.values.setdefault("name", stem or "sweep")
    try:
        checked = schema.schema_of(origin).model_validate(source.values)
    except ValidationError as error:
        found = describe(error.errors(), schema.schema_of(origin))
        raise ConfigError([source.fault(path, text, at_key=key) for path, text, key in found]) from None
    resolved = _resolve(checked, source, origin)
    object.__setattr__(resolved, "source", source)
    return resolved


def parameters_of(config: ConfigLike, overrides: Mapping[str, Any]) -> Mapping[str, Parameter]:
    """The parameters that a configuration with these overrides may name; errors as of `load_config`."""
    if isinstance(config, Config) and "model" not in overrides:
        return config.table
    _, origin = _opened(config, overrides, str, lambda words: None)  # noqa: ARG005
    return loading.table(origin)


def _opened(
    config: ConfigLike,
    overrides: Mapping[str, Any],
    argument: Callable[[str], str],
    announce: Callable[[str], None] | None,
) -> tuple[document.Document, Origin | None]:
    """The document of a configuration, and where its model comes from, if a user brings it."""
    source = _source(config)
    for key in {"model", "model_sha256"} & set(overrides):  # what the code to run depends on
        source.set((key,), plain(overrides[key]), argument(key))
    return source, brought.named(source, announce)


def _source(config: ConfigLike) -> document.Document:
    """The document of a configuration, to be changed freely."""
    if isinstance(config, Config):
        if config.source:
            return deepcopy(config.source)
        values, table = config.document(), None
        if config.cases is not None:
            table = config.cases_file or "cases", config.cases
            values["cases"] = table[0]
        return document.Document("", values, table=table, model=config.origin)
    if isinstance(config, Mapping):
        return document.Document("", plain(config))
    return document.read(Path(config))


def _full_path(key: str, known: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Where the value of an override belongs."""
    if key in known:
        return known[key].place
    return ("integrator", key) if key in Integrator.model_fields else tuple(key.split("."))


def _resolve(checked: Any, source: document.Document, origin: Origin | None) -> Config:
    """Fill in defaults, order the axes, and check that the values fit together."""
    known = loading.table(origin)
    given = _given(checked, source, known)
    if not origin and "offset" in given and given["offset"].spec == 0.0:
        del given["offset"]  # the default: it does not make a body other than the paper's
    columns = _table(checked.cases, source, known) if checked.cases is not None else None
    model, law, units, surface = _model(checked, origin, (*given, *(columns or ())), source)
    needed = scenes.without_default(units, surface)
    checked = _with_method(checked, model)
    faults = list(fitting.misfits(checked, model, given, columns, source, known))
    order = sorted(model.parameters, key=lambda n: (_rank(n, FIRST_AXES), _rank(n, tuple(given))))
    parameters = {}
    for name in order:
        default = None if known[name] in needed else known[name].default
        if name in given:
            parameters[name] = given[name]
        elif name in (columns or {}):
            continue
        elif default is None:
            faults.append(source.fault(known[name].place, f"missing; allowed: {known[name].allowed}"))
        else:
            parameters[name] = Values((default,), False, default)
    if faults:
        raise ConfigError(faults)
    config = Config(
        name=checked.name,
        model=checked.model,
        parameters=parameters,
        integrator=checked.integrator,
        measure=fitting.measured(checked.measure, model),
        max_failed_fraction=checked.max_failed_fraction,
        verify=checked.verify or 0.0,
        refine=checked.refine,
        cases=columns,
        cases_file=checked.cases,
        units=units,
        law=law,
        surface=surface,
        origin=origin,
    )
    brought.try_out(config)
    if units == SI and config.of_rattlebacks and "t_end" not in checked.integrator.model_fields_set:
        config = config.with_time()
    for path, check in fitting.CHECKS:
        if reason := check(config):
            raise ConfigError([source.fault(path, reason)])
    if checked.verify is None and config.integrator.method == methods.AUTO and not config.refine:
        return replace(config, verify=schema.VERIFIED if Grid.of(config).size * schema.VERIFIED >= 1 else 0.0)
    return config


def _model(
    checked: Any, origin: Origin | None, names: Collection[str], source: document.Document
) -> tuple[Tier, str, str, str]:
    """The model of a configuration that names these parameters, with its law of friction, its units and its surface."""
    law, units = loading.law(origin) if origin else None, checked.units
    surface = checked.body.surface if law or not origin else ELLIPSOID.name
    found = scenes.misfits_of_own(checked, law, names, source) if origin else scenes.misfits(checked, names, source)
    if faults := list(found):
        raise ConfigError(faults)
    if not origin:
        law_name = checked.friction.name
        return tier_of(checked.model, law_name, units, names, surface), law_name, units, surface
    model = loading.find(origin, units, names, surface)
    return (model, law.name, units, surface) if law else (model, PAPER_LAW, model.units, surface)


def _given(checked: Any, source: document.Document, known: Mapping[str, Parameter]) -> dict[str, Values]:
    """The physical parameters that the document names, in its order."""
    found: dict[str, Values] = {}
    for key, value in source.values.items():
        if key in sections(known):
            found |= {name: getattr(getattr(checked, key), name) for name in value if name in known}
        elif key in known:
            found[key] = getattr(checked, key)
    return found


def _table(name: str, source: document.Document, known: Mapping[str, Parameter]) -> dict[str, tuple[float, ...]]:
    """The columns of the table of cases, which is read once for all that is made from `source`."""
    if not source.table or source.table[0] != name:
        source.table = name, cases.read(source, name, known)
    return source.table[1]


def _with_method(checked: Any, model: Tier) -> Any:
    """The default method, filled in: `auto` where there is a choice and the step is not given."""
    integrator = checked.integrator
    alone = any(MEASURES[name].follows_tangent for name in fitting.names_of(checked.measure or ()))
    if "method" in integrator.model_fields_set and not (alone and integrator.method == methods.AUTO):
        return checked
    choice = not alone and isinstance(model, Model) and len(methods.allowed(model)) > 1 and integrator.step == "auto"
    method = methods.AUTO if choice else methods.PLAIN
    return checked.model_copy(update={"integrator": integrator.model_copy(update={"method": method})})


def _rank(name: str, names: tuple[str, ...]) -> int:
    return names.index(name) if name in names else len(names)
