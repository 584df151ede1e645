"""Models that users bring: from a Python file, or from an installed package by an entry point.

Their code runs when they are loaded.  So nothing here is called with a name that the user has not given.
"""

from __future__ import annotations

import hashlib
import importlib.util
import linecache
import re
import sys
import traceback
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from importlib import metadata
from os.path import abspath
from pathlib import Path
from types import ModuleType
from typing import Any

from sweep.models.general import variants
from sweep.models.general.laws import Law
from sweep.models.general.selection import variant
from sweep.models.general.surfaces import ELLIPSOID
from sweep.models.general.variants import SlipWith
from sweep.models.model import Model
from sweep.models.origin import ModelError, Origin
from sweep.models.user import checks
from sweep.parameters import PARAMETERS, Parameter

GROUP = "sweep.models"
"""Group of the entry points by which packages bring models."""


def entry_point(name: str) -> Origin | None:
    """The model that an installed package offers by a name; None if there is none.  Nothing is imported."""
    found = metadata.entry_points(group=GROUP, name=name)
    if not found:
        return None
    place = next(iter(found)).value
    digest = hashlib.sha256()
    for path in _sources(_package(place)):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return Origin(name, place, "", digest.hexdigest())


def entry_points() -> tuple[str, ...]:
    """Names of all models that installed packages offer."""
    return tuple(sorted(each.name for each in metadata.entry_points(group=GROUP)))


def _package(place: str) -> str:
    return place.partition(":")[0].partition(".")[0]


def _sources(package: str) -> list[Path]:
    spec = importlib.util.find_spec(package)
    if spec is None:
        return []
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    return sorted(path for folder in folders for path in folder.rglob("*.py")) or [Path(str(spec.origin))]


@cache
def load(origin: Origin) -> Model | SlipWith:
    """Run the code of a file or a package, once in a process, and return what it defines as its model.

    Raises
    ------
    ModelError
        if that cannot be done, or if what it defines is no model.
    """
    made: Model | SlipWith
    with blamed(origin):
        made = _file(origin) if origin.is_file else _imported(origin)
        checks.inspect(made, origin)
    if isinstance(made, SlipWith):
        return replace(made, origin=origin)
    # The states of an image lie beside other quantities, whose names nobody has to know.
    states = tuple(f"state.{name}" for name in made.states)
    parameters = (*(p.name for p in made.own_parameters), *made.parameters)
    return replace(made, origin=origin, states=states, parameters=parameters)


def _file(origin: Origin) -> Any:
    module = ModuleType(f"sweep_model_{origin.digest[:16]}")
    module.__file__ = origin.place
    sys.modules[module.__name__] = module
    # Messages quote what runs, not what the file may say by then.
    linecache.cache[origin.place] = (len(origin.text), None, origin.text.splitlines(keepends=True), origin.place)
    try:
        code = compile(origin.text, origin.place, "exec")
    except (SyntaxError, ValueError) as error:
        raise ModelError(origin.place, getattr(error, "lineno", None), f"not Python: {error.args[0]}") from None
    try:
        exec(code, module.__dict__)
    except SystemExit as error:
        raise RuntimeError("it ends the program") from error
    return getattr(module, "MODEL", None)


def _imported(origin: Origin) -> Any:
    try:
        return next(iter(metadata.entry_points(group=GROUP, name=origin.name))).load()
    except (ImportError, AttributeError) as error:
        raise ModelError(f"entry point {origin.name} = {origin.place}", None, str(error)) from None


def table(origin: Origin | None) -> dict[str, Parameter]:
    """The parameters that a configuration may name: of a user's model, or, without one, of those of this package."""
    if origin is None:
        return PARAMETERS
    made = load(origin)
    own = {p.name: p for p in made.own_parameters}
    if isinstance(made, SlipWith):
        return {**PARAMETERS, **own}
    return {name: own.get(name) or PARAMETERS[name] for name in made.parameters}


def law(origin: Origin) -> Law | None:
    """The law of friction that a file brings for `slip`; None if it brings a model of its own."""
    made = load(origin)
    return made.law if isinstance(made, SlipWith) else None


def find(origin: Origin, units: str, names: Collection[str], surface: str = ELLIPSOID.name) -> Model:
    """The model for a configuration that names these parameters; `surface` is that of a body with a law of friction."""
    made = load(origin)
    if isinstance(made, Model):
        return made
    found = variant("slip", made.law.name, units, names, surface, made.law)
    return replace(found, origin=origin, own_parameters=made.own_parameters)


def compiled_as(origin: Origin, name: str) -> Model:
    """The model whose compiled code has the key "name@digest"."""
    made = load(origin)
    return made if isinstance(made, Model) else replace(variants.variant(name, (), made.law), origin=origin)


@contextmanager
def blamed(origin: Origin | None) -> Iterator[None]:
    """Turn errors that come from the code of a user's model into a `ModelError` that says where."""
    try:
        yield
    except ModelError:
        raise
    except Exception as error:
        if origin is None or not (found := _place(error, origin)):
            raise
        raise ModelError(*found, _words(error, found[0])) from None


def _place(error: Exception, origin: Origin) -> tuple[str, int] | None:
    """File and line of the user's code from which an error comes."""
    ours = [origin.place] if origin.is_file else list(map(str, _sources(_package(origin.place))))
    known = {abspath(file): file for file in ours}
    chain = [error, *filter(None, [error.__cause__])]
    frames = (frame for each in chain for frame in traceback.walk_tb(each.__traceback__))
    lines = [(frame.f_code.co_filename, line) for frame, line in frames]
    if where := getattr(error, "loc", None):  # of Numba's errors
        lines.append((where.filename, where.line))
    lines += [(file, int(line)) for file, line in _FILE.findall(str(error))]
    found = [(known[abspath(file)], line) for file, line in lines if abspath(file) in known]
    return found[-1] if found else None


_FILE = re.compile(r'File "(.+?)", line (\d+)')


_ARITHMETIC = "plain arithmetic and NumPy's functions of numbers, such as np.sqrt and np.minimum"


def _words(error: Exception, place: str) -> str:
    """What an error of the user's code in the file `place` says, and what is allowed where that is known."""
    text = str(error)
    if isinstance(error, KeyError):
        return f"KeyError: {text}; allowed: names of the model's parameters"
    if "truth value of an array" in text:
        return f"a branch on arrays; allowed: {_ARITHMETIC}"
    if type(error).__module__.startswith("numba"):
        # Numba tells, from the outermost function inwards: that it failed, why, and where.
        ends = [match.start() for match in _FILE.finditer(text) if abspath(match[1]) == abspath(place)]
        lines = [line.strip() for line in text[: ends[-1] if ends else None].splitlines() if line.strip()]
        begin = max((i + 1 for i, line in enumerate(lines[:-1]) if "Failed in" in line), default=0)
        return f"does not compile: {lines[begin]}; allowed: {_ARITHMETIC}, functions marked with sweep.jit.inline"
    return f"{type(error).__name__}: {text}".splitlines()[0]
