"""Set up the trajectories of a dataset from its configuration, with a user-defined model if it is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from sweep.config import Fault, InputError
from sweep.config.document import text_of
from sweep.explorer.slices import Source
from sweep.explorer.state import Cell
from sweep.faults import brief
from sweep.grid import CASE
from sweep.models.origin import Origin
from sweep.results.configuration import configuration

Announce = Callable[[str], None]


class Setup:
    """The parts of a dataset's configuration that trajectories need, and the default parameters of a cell.

    Parameters
    ----------
    model : the file of a user's model; its code runs
    announce : called with a line of text before it runs

    Raises
    ------
    InputError
        if the dataset has no configuration, or one that cannot be run, or `model` is not the dataset's.
    """

    def __init__(self, source: Source, model: str | None = None, announce: Announce | None = None) -> None:
        # The dataset may come from anybody: a model file that it names runs only if the user names it.
        first = source.dataset.isel({CASE: 0}, missing_dims="ignore")
        config = configuration(first, *((_checked(source, model), announce) if model else ()))
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


def _checked(source: Source, model: str) -> str:
    """Return the path of the user's model, which may run only if its hash is the dataset's.

    The file name in the dataset is ignored, because the dataset may come from anybody.
    """

    def refusal(words: str) -> InputError:
        return InputError([Fault("", None, None, ("--model",), words)])

    path, wanted = Path(model).absolute(), source.dataset.attrs.get("model_sha256")
    if wanted is None:
        raise refusal(f"the model of {source.name} is not a user's; leave the option out")
    text = text_of(path, lambda reason: refusal(f"{brief(str(path))}: {reason}"))
    if (found := Origin.of_file(model, str(path), text).digest) != wanted:
        words = f"has the SHA-256 {found}, not the dataset's {wanted}; name the file that made it"
        raise refusal(f"{brief(str(path))} {words}")
    return str(path)
