"""What can be drawn of commands, functions and cuts of datasets, from the options and signatures themselves."""

from __future__ import annotations

import json
from collections.abc import Callable
from inspect import signature
from random import Random
from typing import Any

import click
import numpy as np
import xarray as xr

import sweep
from machine.draws import Draws, setting
from sweep.cli import main
from sweep.config.schema import PATHS
from sweep.parameters import PARAMETERS
from sweep.plots.quantities import DERIVED
from sweep.results.dataset import VARIABLES

VERBS = {name: command for name, command in main.commands.items() if name not in ("reproduce", "bench", "explore")}
"""Reports take minutes, and an explorer does not end."""

FUNCTIONS = {name: signature(getattr(sweep, name)).parameters for name in sweep.__all__ if name.islower()}

SLOW = ("fit", "animate")
"""Verbs that are drawn in campaigns alone."""

AXES = ("mu", "b", "n0", "c")

TEXTS: dict[str | None, tuple[str, ...]] = {
    "NAME=VALUE": tuple(f"{name}={value}" for name in (*AXES, *PARAMETERS) for value in (60, 3, 0.05, 0, -1, "2deg")),
    "LENGTH": ("85mm", "50mm", "3in", "17 cm", "2mm", "1"),
    "NUMBER[+-ERROR]UNIT": ("12.0+-0.1cm", "30g", "1.24g/cm3", "2deg", "5mm", "1 in", "x"),
    "NAME,NAME": ("mu", "n0,mu", "film_delay", "viscous,coulomb", "c", ""),
    "NAME": ("viridis", "magma", "RdBu", "quick"),
    None: (*AXES, "count", *VARIABLES, *DERIVED, "nothing"),
}
"""Texts that an option may have, by what its help calls them; any of them where the help has another word."""

VALUES: dict[str, tuple[Any, ...]] = {
    "x": AXES, "y": AXES, "variable": (*VARIABLES, *DERIVED),
    "at": ({"n0": 0.05}, {"mu": 60}, {"b": 3}, {"case": 0}), "title": ("", "A title", "μ & $"),
    "vmin": (-1, 0, 1.5), "vmax": (0, 5, 1e7),
    "cmap": ("viridis", "no"), "width": ("85mm", "50mm", "3in"),
    "bracket": (0.01, 0.1, 0.5), "deviation": (0.01, 0.1), "every": (0.5, 5.0, 1e3), "samples": (1, 2),
    "speed": (1.0, 10.0), "laws": ((), ("viscous",)),
}  # fmt: skip
"""Values that an argument may have, by its name."""

_TYPES: dict[str, tuple[Any, ...]] = {"bool": (True, False), "float": (0.0, 5.0, 40.0), "int": (1, 3), "str": ("mu",)}
"""Those of any other argument, by the first word of its type."""


def _options(command: click.Command) -> list[str]:
    mine = [each for each in command.params if isinstance(each, click.Option) and each.name != "client"]
    return [str(each.name) for each in mine if not isinstance(each.type, click.Path)]


OPTIONS = {verb: _options(command) for verb, command in VERBS.items()}
"""The options of each command that are drawn: files and addresses are the machine's."""


def option(verb: str, name: str, number: int) -> list[str]:
    """An option of a command with a value, as words of the command line."""
    random, found = Random(f"{verb} {name} {number}"), next(each for each in VERBS[verb].params if each.name == name)
    if getattr(found, "is_flag", False):
        return [found.opts[0]]
    if isinstance(found.type, click.Choice):
        values: Any = found.type.choices
    elif isinstance(found.type, click.IntRange | click.FloatRange) or found.type is click.FLOAT:
        low, high = getattr(found.type, "min", None) or 0, getattr(found.type, "max", None) or np.inf
        usual = found.default if isinstance(found.default, int | float) else 1
        values = [n for n in (usual, 3 * usual, 10 * usual, 40) if low <= n <= high]
    elif found.name == "settings":
        path = random.choice(sorted(PATHS))
        values = [f"{path}={json.dumps(setting(path, number))}"]
    else:
        values = TEXTS.get(found.metavar, random.choice([*TEXTS.values()]))
    first = str(random.choice(values))
    both = [value for value in map(str, values) if value.partition("=")[0] == first.partition("=")[0]]
    twice = [found.opts[0], random.choice(both)] if getattr(found, "multiple", False) and number % 2 else []
    return [found.opts[0], first, *twice]


def arguments(function: str, drawn: Draws) -> dict[str, Any]:
    """Arguments of a function, by keyword."""
    kinds = {name: str(each.annotation).partition(" ")[0] for name, each in FUNCTIONS[function].items()}
    return {name: Random(f"{name} {n}").choice(VALUES.get(name) or _TYPES[kinds[name]]) for name, n in drawn}


_MINE = ("config", "source", "dataset", "film", "free", "output", "client", "progress", "overrides", "ax")
"""Arguments that the machine gives, or that need an object that a user makes."""

TAKEN = {name: [each for each in known if each not in _MINE] for name, known in FUNCTIONS.items()}
"""The arguments of each function that are drawn."""

CALLED = sorted({name for name, known in FUNCTIONS.items() if {"config", "source"} & {*known}} - {"run", "load_config"})
"""The functions that take a configuration."""

CUTS: dict[str, Callable[[xr.Dataset, str, Random], xr.Dataset]] = {
    "isel": lambda dataset, dim, random: dataset.isel({dim: random.choice((0, -1, slice(None, None, -1)))}),
    "one value": lambda dataset, dim, _: dataset.isel({dim: [0]}),
    "none": lambda dataset, dim, _: dataset.isel({dim: slice(0, 0)}),
    "sel": lambda dataset, dim, _: dataset.sel({dim: dataset[dim][-1]}) if dim in dataset.coords else dataset,
    "mean": lambda dataset, dim, _: dataset.mean(dim),
    "mean of all": lambda dataset, *_: dataset.mean(),
    "max": lambda dataset, dim, _: dataset.max(dim, keep_attrs=True),
    "stack": lambda dataset, dim, _: dataset.stack(  # once: xarray stacks no stacked dimension
        {}
        if any(str(each).startswith("both_") for each in dataset.dims)
        else {f"both_{dim}": [dim, *(each for each in dataset.dims if each != dim)][:2]}
    ),
    "transpose": lambda dataset, *_: dataset.transpose(*reversed([*dataset.dims])),
    "drop": lambda dataset, _, random: dataset.drop_vars(random.choice([*dataset.data_vars])),
    "where": lambda dataset, *_: dataset.where(dataset["status"] > 1) if "status" in dataset else dataset,
    "squeeze": lambda dataset, *_: dataset.squeeze(),
    "one": lambda dataset, _, random: dataset[[random.choice([*dataset.data_vars])]],
}
"""What users do with datasets, along one of their dimensions."""
