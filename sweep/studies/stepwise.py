"""Prepare a configuration for a study that stops between steps."""

from __future__ import annotations

from dataclasses import replace

from sweep.config import Config, ConfigError
from sweep.config.faults import either
from sweep.kernels.methods import METHODS, PLAIN
from sweep.models import MODELS


def stepwise(config: Config) -> Config:
    """Return `config` with a method that can be stopped after any step, which takes one without a history.

    A step that was fixed for another method is dropped, as it may be unstable with this one.

    Raises
    ------
    ConfigError
        if the model is a formula, which takes no steps.
    """
    if not config.simulated:
        message = f"the {config.model} model is a formula and cannot be simulated; choose {either(MODELS)}"
        raise ConfigError([config.fault(("model",), message)])
    method = METHODS.get(config.integrator.method)
    if method and method.stops_anywhere:
        return config
    return replace(config, integrator=config.integrator.model_copy(update={"method": PLAIN, "step": "auto"}))
