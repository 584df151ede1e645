"""Loads a user-defined model that a configuration names: a Python file.

Its code runs as soon as the configuration is read, so a configuration taken from a dataset must not name one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sweep.config.configuration import Config
from sweep.config.document import Document
from sweep.config.schema import SETTINGS
from sweep.faults import InputError, brief, either, fault_of
from sweep.grid import CASE, SAMPLE
from sweep.models import TIERS
from sweep.models.origin import Origin
from sweep.models.user import loading, trial

SUFFIX = ".py"

TAKEN = {path.rpartition(".")[2] for path in SETTINGS} | {"integrator", CASE, SAMPLE, "trajectory", "time"}
"""Names with another meaning in a configuration or as a dimension, which a user's parameter cannot have."""


def named(source: Document, announce: Callable[[str], None] | None) -> Origin | None:
    """Load the user-defined model of a document and return its origin; None if the model is built in or unknown.

    Parameters
    ----------
    announce : called with a message before the code runs; None if it must not run

    Raises
    ------
    InputError
        if the code cannot be read, does not define a model, or must not run.
    """
    name = source.values.get("model")
    if not isinstance(name, str) or name in TIERS:
        return None
    origin: Origin | None = source.known.get(("model", name))
    if origin is None and not name.endswith(SUFFIX):
        return None  # the schema refuses it later
    if announce is None:
        message = "refusing to run user code named inside a dataset"
        raise InputError([source.fault(("model",), f"{brief(name)}: {message}; choose {either(TIERS)}")])
    if origin is None:
        path, text = source.read_beside("model", name)
        origin = Origin.of_file(name, str(path), text)
    source.known["model", name] = origin
    announce(f"running the code of {origin.place} (SHA-256 {origin.digest[:16]}…)")
    for p in loading.load(origin).own_parameters:
        if wrong := [word for word in (p.name, p.section) if word in TAKEN]:
            message = f"parameter {p.path}: {wrong[0]!r} already has another meaning; rename it"
            raise fault_of(message, file=origin.place)
    return origin


def try_out(config: Config) -> None:
    """Call the functions of a user's model for the first and the last cell; raise an `InputError` if they do not
    work."""
    if config.origin:
        ends = {name: np.array([v.numbers[0], v.numbers[-1]]) for name, v in config.parameters.items()}
        ends |= {name: np.array([column[0], column[-1]]) for name, column in config.cases.items()}
        trial.try_out(config.equations, config.assembly.body(ends), config.own_law)
