"""Set up the trajectories of a dataset from its configuration, with a user-defined model if it is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from sweep.config import Fault, InputError
from sweep.config.user_models import SUFFIX
from sweep.explorer.slices import Source
from sweep.explorer.state import Cell
from sweep.faults import brief
from sweep.models.user.loading import entry_point
from sweep.results.configuration import configuration

Announce = Callable[[str], None]


class Setup:
    """The parts of a dataset's configuration that trajectories need, and the default parameters of a cell.

    Parameters
    ----------
    model : the file or entry point of a user's model; its code runs
    announce : called with a line of text before it runs

    Raises
    ------
    InputError
        if the dataset has no configuration, or one that cannot be run, or `model` is not the dataset's.
    """

    def __init__(self, source: Source, model: str | None = None, announce: Announce | None = None) -> None:
        # The dataset may come from anybody: a model in it that is a file or an entry point runs only if the user names
        # it.
        config = configuration(source.dataset, *((_named(source, model), announce) if model else ()))
        if not config.simulated:
            raise InputError([])
        medians = config.at_medians
        there = [name for name in config.tier.parameters if name in medians.parameters]
        self.config = replace(medians, parameters={name: medians.parameters[name] for name in there})
        here = source.parameters_at(tuple(self.config.parameters), dict.fromkeys(source.dims, 0))
        self.base: Cell = {name: here.get(name, v.numbers[0]) for name, v in self.config.parameters.items()}


def why_still(source: Source) -> str:
    """Explain why trajectories of a file that is not `usable` cannot be run."""
    if place := source.dataset.attrs.get("model_place"):
        return f"Its model is user code, {place}; name it to run trajectories: sweep explore FILE --model MODEL."
    return "This file has no configuration for trajectories."


def usable(source: Source) -> Setup | None:
    """The setup of the dataset; None if it has no configuration for trajectories."""
    try:
        return Setup(source)
    except InputError:
        return None


def _named(source: Source, model: str) -> dict[str, str]:
    """The keys by which the configuration names the user's model, which runs only if its hash is the dataset's.

    The file name in the dataset is ignored, because the dataset may come from anybody.
    """
    wanted, words = source.dataset.attrs.get("model_sha256"), ""
    if wanted is None:
        words = f"the model of {source.name} is not a user's; leave the option out"
    elif model.endswith(SUFFIX):
        model = str(Path(model).absolute())
    elif entry_point(model) is None:
        words = f"{brief(model)} is neither a Python file nor an entry point of an installed package"
    if words:
        raise InputError([Fault("", None, None, ("--model",), words)])
    return {"model": model, "model_sha256": str(wanted)}
