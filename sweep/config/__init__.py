"""Turns a YAML file into a checked `Config`."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from copy import deepcopy
from itertools import islice
from math import ceil, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sweep import faults
from sweep.config import cases, cross_checks, document, schema, user_models
from sweep.config.configuration import FIRST_AXES, Config, model_of, present
from sweep.config.distributions import chances, drawn
from sweep.config.document import plain_data
from sweep.config.messages import explain
from sweep.config.schema import Integrator
from sweep.config.values import Values, in_si, values_of
from sweep.faults import Fault, InputError, fault_of, local_path, refusal, suggestion
from sweep.kernels import measures, methods
from sweep.kernels.kernel import STRETCH
from sweep.models.general.laws import LAWS
from sweep.models.general.solids import Assembly
from sweep.models.general.surfaces import ELLIPSOID, SURFACES
from sweep.models.model import Model, Offer, Tier
from sweep.models.origin import Origin
from sweep.models.user import loading
from sweep.models.variants import PAPER_LAW, Physics
from sweep.parameters import PARAMETERS, Parameter, sections
from sweep.units import SI, TIME

__all__ = ["Config", "ConfigLike", "Fault", "InputError", "Integrator", "Values", "load_config", "values_at"]

ConfigLike = Config | Mapping[str, Any] | str | os.PathLike[str]
"""A configuration, a mapping with the contents of its file, or the path of the file."""


def load_config(
    config: ConfigLike,
    overrides: Mapping[str, Any] | None = None,
    *,
    argument: Callable[[str], str] = str,
    announce: Callable[[str], None] | None = lambda message: None,  # noqa: ARG005
) -> Config:
    """Read and check a configuration.

    If the model is a file, its code is run.

    Parameters
    ----------
    config : path of a YAML file, its contents as a mapping, or a configuration.  An axis of a mapping may be
        a list, tuple, range, NumPy array or `xarray.DataArray`, and `cases` a `pandas.DataFrame`; numbers may be
        quantities of Pint or Astropy
    overrides : values that replace those of `config`, by path ("friction.mu") or, for a parameter or a setting of the
        integrator, by bare name ("mu")
    argument : function that returns the name of an override in error messages
    announce : called with a message before user code runs; None to refuse user-defined models

    Raises
    ------
    InputError
        with a `Fault` for each error.
    """
    if isinstance(config, Config) and not overrides:
        return config
    source, overrides = _source(config), overrides or {}
    if "model" in overrides:  # on which the code to run depends
        source.set(("model",), plain_data(overrides["model"]), argument("model"))
    origin = user_models.named(source, announce)
    known = loading.table(origin)
    for key, value in overrides.items():
        source.set(_full_path(key, known), plain_data(value), argument(key))
    # A name derived from the file name must not be refused, since the user did not choose it.
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", Path(source.file).stem).lstrip("._-")[:100]
    source.values.setdefault("name", stem or "sweep")
    kind = schema.schema_of(origin)
    try:
        given = isinstance(source.values.get("cases"), dict)  # columns, which are checked as those of a file are
        values = kind.model_validate(source.values | ({"cases": ""} if given else {}))
    except ValidationError as error:
        found = explain(error.errors(), kind).items()
        raise InputError(source.fault(path, text, at_key=key) for path, (text, key) in found) from None
    return _resolve(values, source, origin)


def _source(config: ConfigLike) -> document.Document:
    """Return the document of a configuration as a copy that may be changed."""
    if hasattr(config, "data_vars"):  # a dataset is a mapping too
        raise fault_of("this is a dataset, not a configuration; it has methods, such as dataset.sweep.trajectory")
    if isinstance(config, Mapping):
        return document.Document("", plain_data(config))
    if not isinstance(config, Config):
        wanted = "the path of a YAML file, a mapping with its contents, or a Config"
        return document.read(local_path(config, "config", wanted))
    if config.source:
        return deepcopy(config.source)
    values = config.document()
    known: dict[tuple[str, str], Any] = {("model", config.model): config.origin}
    if config.cases_file:
        known["cases", config.cases_file] = config.cases, {}
    return document.Document("", values, known=known)


def _full_path(key: str, known: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Return the path of the value that an override replaces."""
    if key in known:
        return known[key].place
    return ("integrator", key) if key in Integrator.model_fields else tuple(key.split("."))


def _resolve(values: Any, source: document.Document, origin: Origin | None) -> Config:
    """Fill in defaults, order the axes, and check that all values fit together."""
    known = loading.table(origin)
    given = _given(values, source, known)
    columns: cases.Columns = {}
    units_of_cases: dict[faults.Path, str] = {}
    if values.cases is not None:  # it may be ""
        columns, units = cases.read(source, known)
        units_of_cases = {("cases", name): unit for name, unit in units.items() if unit}
    physics = _physics(values, origin, frozenset((*present(given), *columns)))
    _refuse(source, cross_checks.of_physics(values, physics, origin))
    model = model_of(values.model, origin, physics)
    uncertain = {n: v.distribution for n, v in given.items() if v.distribution and n in model.parameters}
    samples = values.samples or (schema.SAMPLES if uncertain else None)
    if samples and uncertain and values.cases is None:
        columns = drawn(uncertain, chances(len(uncertain), samples, values.seed))
    parameters = _parameters(model, given, columns, known, physics)
    numbers = {name: value.numbers for name, value in parameters.items()} | columns
    measure = tuple(measures.default(model) if values.measure is None else values.measure)
    config = Config(
        name=values.name,
        model=values.model,
        parameters=parameters,
        integrator=_integrator(values, model, measure, _slowest(physics, numbers)),
        measure=measure,
        max_failed_fraction=values.max_failed_fraction,
        picture=_pictures(values, source),
        cases=columns,
        cases_file=values.cases,
        samples=samples,
        seed=values.seed,
        units=physics.units,
        law=physics.law.name,
        surface=physics.surface.name,
        assembly=physics.assembly,
        origin=origin,
    )
    object.__setattr__(config, "source", source)
    _refuse(source, cross_checks.of_units(config, _written(source, given, known) | units_of_cases))
    _refuse(source, cross_checks.of_values(config, given))
    user_models.try_out(config)
    _refuse(source, islice(cross_checks.of_all_cells(config), 1))
    return config


def _pictures(values: Any, source: document.Document) -> tuple[str, ...]:
    """Return the variables to draw; those of a file apply only to what is measured there."""
    other = ("measure",) in source.arguments and ("picture",) not in source.arguments
    return () if other else tuple(values.picture or ())


def _refuse(source: document.Document, misfits: Iterable[cross_checks.Misfit]) -> None:
    if found := list(misfits):
        raise InputError(source.fault(path, message, at_key=True) for path, message in found)


def _given(values: Any, source: document.Document, known: Mapping[str, Parameter]) -> dict[str, Values]:
    """Collect the physical parameters that the document names, in document order."""
    found: dict[str, Values] = {}
    for key, value in source.values.items():
        if key in sections(known):
            found |= {name: getattr(getattr(values, key), name) for name in value if name in known}
        elif key in known:
            found[key] = getattr(values, key)
    if known is PARAMETERS and "offset" not in present(found):
        found.pop("offset", None)  # the default, which is the paper's body
    return found


def _written(
    source: document.Document, given: Mapping[str, Values], known: Mapping[str, Parameter]
) -> dict[faults.Path, str]:
    """Collect the units given with values, by path."""
    found = {known[name].place: value.unit for name, value in given.items() if value.unit}
    settings = source.values.get("integrator", {}).items()
    return found | {("integrator", name): unit for name, raw in settings if (unit := in_si(TIME, raw)[1])}


def _physics(values: Any, origin: Origin | None, names: frozenset[str]) -> Physics:
    """Collect the non-numeric settings of a configuration that names these parameters."""
    made = loading.load(origin) if origin else None
    if isinstance(made, Model):  # a user's model gives the units itself
        return Physics(made.units, LAWS[PAPER_LAW], ELLIPSOID, names)
    law = made.law if made else LAWS[values.friction.law]
    return Physics(
        values.units, law, SURFACES[values.body.surface], names, Assembly(values.body.solid, values.body.weights)
    )


def _parameters(
    model: Tier, given: Mapping[str, Values], columns: Collection[str], known: Mapping[str, Parameter], physics: Physics
) -> dict[str, Values]:
    """Return the parameters of the model as axes in order, without columns of the table and missing ones."""
    found = {}
    # Distributions keep the order of the document, which is the order of drawing.
    first = [name for name in FIRST_AXES if not (name in given and given[name].distribution)]
    order = dict.fromkeys((*first, *given, *model.parameters))
    for name in (name for name in order if name in model.parameters):
        default = None if known[name] in physics.required else known[name].default
        if name in given:
            found[name] = given[name]
        elif name not in columns and default is not None:
            found[name] = Values.one(default)
    return found


def values_at(config: Config, at: Mapping[str, Any]) -> dict[str, Values]:
    """Return the values requested for each parameter; raise an `InputError` for the first that cannot be run."""
    if not isinstance(at, Mapping):
        raise fault_of(refusal(at, "values by parameter, such as {'mu': 60}"), "at")
    model = config.tier
    if unknown := next((name for name in at if name not in model.parameters), ""):
        message = f"is not a parameter of the {model.name} model{suggestion(unknown, model.parameters)}"
        raise fault_of(f"{message}; its parameters are {', '.join(model.parameters)}", "at", unknown)
    return {name: values_of(config.table[name], value, config.unitless, "at") for name, value in at.items()}


def _integrator(values: Any, model: Tier, measure: tuple[str, ...], slowest: float) -> Integrator:
    """Fill in the settings of the integrator whose defaults depend on other settings, such as the `slowest` body."""
    integrator, said, found = values.integrator, values.integrator.model_fields_set, dict[str, Any]()
    if "method" not in said:
        choice = isinstance(model, Model) and len(methods.automatic(model, measure)) > 1 and integrator.step == "auto"
        found["method"] = methods.AUTO if choice else methods.PLAIN
    if "stop_early" not in said and not all(each.final_when_settled for each in measures.chosen(measure)):
        found["stop_early"] = integrator.t_end >= schema.FOREVER
        said = {*said, "stop_early"}
    if "t_end" not in said:
        found["t_end"] = usual = _longest(schema.T_END, slowest)
        if Offer.ENDING in model.offers and ("stop_early" not in said or integrator.first_leg):
            found |= {"t_end": _longest(schema.LATER, slowest), "stop_early": integrator.first_leg or usual}
    return Integrator(**{**dict(integrator), **found})


def _slowest(physics: Physics, numbers: Mapping[str, tuple[float, ...]]) -> float:
    """Return sqrt(c/g) of the slowest body with these values of its parameters, in s; 0 in other units than SI."""
    if physics.units != SI or "gravity" not in numbers:
        return 0.0
    largest = physics.assembly.body({name: np.array([max(values)]) for name, values in numbers.items()})
    return sqrt(float(largest["c"][0]) / min(numbers["gravity"])) if "c" in largest else 0.0


def _longest(time: float, slowest: float) -> float:
    """Return a time given in sqrt(c/g), whose value for the slowest body is `slowest`; in s, if that is not 0."""
    if not slowest:
        return time
    longest = time * slowest
    # A whole number of stretches, so that the steps do not depend on the limit (`sweep.kernels.kernel.STRETCH`).
    return float(STRETCH * max(ceil(min(longest, schema.LATEST) / STRETCH), 1))
