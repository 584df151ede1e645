"""How the trajectories of a dataset are run: by its configuration, and by a user's model if that is named."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sweep.config import Config, ConfigError, brought, load_config
from sweep.config.document import Document
from sweep.config.faults import brief
from sweep.explore.slices import Source
from sweep.explore.state import Cell
from sweep.models.user import loading

Announce = Callable[[str], None]


class Setup:
    """How the dataset's trajectories are run: its configuration, and the parameters of a cell that are not named.

    Parameters
    ----------
    model : the file or entry point of the model, if a user brought it; its code runs
    announce : told in words that it is about to run

    Raises
    ------
    ConfigError
        if the dataset has no configuration, or one that cannot be run, or `model` is not the dataset's.
    """

    def __init__(self, source: Source, model: str | None = None, announce: Announce | None = None) -> None:
        self.config = _configuration(source, _named(source, model), announce) if model else _configuration(source)
        here = source.parameters_at(tuple(self.config.parameters), dict.fromkeys(source.dims, 0))
        self.base: Cell = {name: here.get(name, v.numbers[0]) for name, v in self.config.parameters.items()}


def why_still(source: Source) -> str:
    """Why no trajectory is run of a file that is not `usable`."""
    if place := source.dataset.attrs.get("model_place"):
        return f"Its model is code of a user, {place}, and runs only if you name it: sweep explore FILE --model MODEL."
    return "This file tells no configuration to run trajectories from."


def usable(source: Source) -> Setup | None:
    """The setup of the dataset, None if it has no configuration to run trajectories from."""
    try:
        return Setup(source)
    except ConfigError:
        return None


def _named(source: Source, model: str) -> dict[str, Any]:
    """What the configuration has to say of the model that the user names, which is not run before it is the right one.

    What the dataset says of its file does not matter: the dataset may come from anybody.
    """
    place = str(Path(model).absolute()) if model.endswith(brought.SUFFIX) else model
    option = Document("", {"model": place}, arguments={("model",): ("--model", ("model",))})
    wanted = source.dataset.attrs.get("model_sha256")
    found = brought.of_file(option, place) if model.endswith(brought.SUFFIX) else loading.entry_point(model)
    if wanted is None:
        words = f"the model of {source.name} is none that a user brought; allowed: no --model"
    elif found is None:
        words = f"{brief(model)}: unknown; allowed: a Python file, or an entry point of an installed package"
    elif found.digest != wanted:
        words = f"{brief(model)} has the SHA-256 {found.digest}; allowed: that of {source.name}, {brief(str(wanted))}"
    else:
        return {"model": place, "model_sha256": found.digest}
    raise ConfigError([option.fault(("model",), words)])


def _configuration(source: Source, named: Mapping[str, Any] | None = None, announce: Announce | None = None) -> Config:
    """The configuration in the dataset; a table of cases, which is another file, gives way to the first case.

    It may come from anybody, so that a model in it that is a file or an entry point is refused, not run, unless the
    user has named it.
    """
    text = str(source.dataset.attrs.get("config", ""))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "explore.yaml")
        path.write_text(text, encoding="utf-8")
        overrides: dict[str, Any] = dict(named or {})
        if "case" in source.dims:
            path.write_text("\n".join(line for line in text.split("\n") if not line.startswith("cases:")), "utf-8")
            coordinates = [str(n) for n, c in source.dataset.coords.items() if n != "case"]
            overrides |= source.parameters_at(tuple(coordinates), {"case": 0})
        config = load_config(path, overrides, announce=announce)
    if not config.simulated:
        raise ConfigError([])
    names = config.tier.parameters
    return replace(config, parameters={name: config.parameters[name] for name in names if name in config.parameters})
