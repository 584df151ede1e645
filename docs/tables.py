"""Tables and lists of the reference, made from the sources that the program itself reads: see `MADE`."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.config import messages, schema
from sweep.kernels import measures, methods
from sweep.kernels.status import COUNT_DOUBTS, FAILURES
from sweep.models import MODELS, TIERS
from sweep.models.model import Model
from sweep.parameters import PARAMETERS, SI_ALONE, Parameter
from sweep.results import dataset
from sweep.results.probabilities import PROBABILITIES
from sweep.units import PAPER_UNITS, SI, WRITTEN, named, pretty
from sweep.variables import Variable

Row = tuple[str, ...]


def _parameters() -> tuple[Row, list[Row]]:
    rows = [
        (
            f"`{p.path}`",
            p.description or p.long_name,
            f"{pretty(named(p.units, SI))}, with `units: SI` alone" if p.name in SI_ALONE else _unit(p),
            "required" if p.default is None else f"{p.default:g}",
            p.allowed.removeprefix("a finite number "),
        )
        for p in PARAMETERS.values()
    ]
    return ("name", "meaning", "unit", "default", "allowed"), rows


def _unit(of: Parameter | Variable) -> str:
    """The paper's unit and that of SI, if they differ."""
    return " or ".join(dict.fromkeys(pretty(named(of.units, system)) for system in (PAPER_UNITS, SI)))


def _units() -> tuple[Row, list[Row]]:
    return ("in SI", "also written"), [(pretty(unit.si), ", ".join(names)) for unit, names in WRITTEN.items()]


def _settings() -> tuple[Row, list[Row]]:
    rows = [
        (f"`{path}`", str(field.description), _default(field), messages.allowed(field))
        for path, field in schema.SETTINGS.items()
    ]
    return ("name", "meaning", "default", "allowed"), rows


def _default(field: Any) -> str:
    value = field.default
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if value is None or value == "":
        return ""
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def _variables() -> tuple[Row, list[Row]]:
    tables = {
        "all": {name: spec for name, spec in dataset.VARIABLES.items() if not spec.per_body},
        "all but the start's": {name: spec for name, spec in dataset.VARIABLES.items() if spec.per_body},
        "all but `sample`, and `count`": PROBABILITIES,
    }
    rows = []
    for over, table in tables.items():
        for name, spec in table.items():
            below = spec.masks or name == "status"
            meaning = "see below" if below else spec.description or spec.long_name
            if spec.flags and not below:
                meaning += f" ({', '.join(f'{code} {flag}' for code, flag in spec.flags.items())})"
            rows.append((f"`{name}`", spec.dtype, over, _unit(spec), meaning))
    return ("variable", "type", "axes", "unit", "meaning"), rows


def _doubts() -> tuple[Row, list[Row]]:
    rows = [
        (str(int(bit)), f"`{name}`", words, "yes" if bit in COUNT_DOUBTS else "no")
        for bit, (name, words, _) in dataset.DOUBTS.items()
    ]
    return ("bit", "flag", "meaning", "against the count"), rows


_STATUS_MEANINGS = {
    "not_run": "not simulated",
    "settled": "upright spin is stable, and the remaining rattle can change neither that nor the count",
    "time_limit": "`t_end` was reached first, or the time of `stop_early` if the end could not be predicted",
    "lift_off": "the normal force fell to zero: the body leaves the plane",
    "diverged": "the integration failed, even with shorter steps; the numbers are meaningless",
    "paradox": "Painlevé's paradox: no contact force solves the equations",
    "toppled": "the body is tilted by a right angle, the limit of the variables",
    "impossible": "not simulated: the body cannot exist, or does not stand upright at rest",
}


def _statuses() -> tuple[Row, list[Row]]:
    failures = {dataset.STATUSES[code] for code in FAILURES}
    rows = [
        (str(code), f"`{name}`", _STATUS_MEANINGS[name], "yes" if name in failures else "no")
        for code, name in dataset.STATUSES.items()
    ]
    return ("code", "status", "meaning", "counts as failed"), rows


def _measurements() -> tuple[Row, list[Row]]:
    rows = []
    for name, kind in measures.MEASURES.items():
        needs = ", ".join(f"`{n}`" for n in kind.needs)
        rows.append((f"`{name}`", kind.summary, needs, "yes" if kind.by_default else "no"))
    return ("measurement", "description", "needs", "by default"), rows


def _methods() -> tuple[Row, list[Row]]:
    rows = []
    for method in methods.METHODS.values():
        models = ", ".join(f"`{m.name}`" for m in MODELS.values() if method.runs(m))
        rows.append((f"`{method.name}`", method.summary, models))
    return ("method", "description", "models"), rows


def _models() -> tuple[Row, list[Row]]:
    rows = []
    for tier in TIERS.values():
        used = ", ".join(f"`{m}`" for m in methods.allowed(tier)) if isinstance(tier, Model) else "none"
        states = ", ".join(f"`{s}`" for s in tier.states) if isinstance(tier, Model) else ""
        possible = ", ".join(f"`{m}`" for m in measures.possible(tier))
        rows.append((f"`{tier.name}`", tier.summary, states, used, possible))
    return ("model", "description", "states", "methods", "measures"), rows


def _classes() -> tuple[Row, list[Row]]:
    public = sorted(name for name in sweep.__all__ if inspect.isclass(getattr(sweep, name)))
    rows = [(f"`sweep.{name}`", inspect.getdoc(getattr(sweep, name)).partition("\n")[0]) for name in public]
    return ("name", "purpose"), rows


def _table(rows: tuple[Row, list[Row]]) -> str:
    head, body = rows
    lines = ["| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in (head, *body)]
    lines.insert(1, "|" + "---|" * len(head))
    return "\n".join(lines)


_ENTRY = re.compile(r"([*\w]+(?:, [*\w]+)*) : (.*)")
_ERRORS = re.compile(r"\w+Error(, \w+Error)*$")


def _markdown(docstring: str) -> Iterator[str]:
    """Yield the lines of a docstring without its examples, with sections in bold and parameters as a list."""
    text = docstring.partition("\nExamples\n---")[0].replace("``", "`").replace(".  ", ". ")
    lines = text.splitlines()
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        if below and set(below) == {"-"}:
            yield f"**{line}**\n"
        elif entry := _ENTRY.match(line):
            yield f"- `{entry[1]}`: {entry[2]}"
        elif _ERRORS.match(line):
            yield f"- {line}:"
        elif not line or set(line) != {"-"}:
            yield re.sub(r"^    ", "  ", line)


def _python() -> str:
    """Each function with its parameters, without their types, which its description contains."""
    parts = []
    for name in (name for name in sweep.__all__ if inspect.isfunction(getattr(sweep, name))):
        signature = inspect.signature(getattr(sweep, name))
        bare = [each.replace(annotation=each.empty) for each in signature.parameters.values()]
        call = f"sweep.{name}{signature.replace(parameters=bare, return_annotation=signature.empty)}"
        call = re.sub(r"=<.*?>(?=[,)])", "=…", call)
        parts += [f"### `{name}`\n", f"```text\n{call}\n```\n", *_markdown(inspect.getdoc(getattr(sweep, name))), ""]
    return "\n".join(parts)


def _commands() -> str:
    parts = []
    for name in main.commands:
        text = CliRunner().invoke(main, [name, "--help"], prog_name="sweep").stdout
        parts.append(f"## `{name}`\n\n```text\n{text}```\n")
    return "\n".join(parts)


_TABLES = (
    _parameters, _units, _settings, _variables, _statuses, _doubts, _measurements, _methods, _models, _classes,
)  # fmt: skip

MADE: dict[str, Callable[[], str]] = {
    **{table.__name__[1:]: partial(lambda table: _table(table()), table) for table in _TABLES},
    "python": _python,
    "commands": _commands,
}
"""What makes each part of a page, by the name in its comment."""
