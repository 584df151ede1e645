"""Tables of the reference, made from the sources that the program itself reads.

Each directive is named after its table and takes no arguments: see `setup`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import sweep
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
            p.allowed,
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
            meaning = spec.description or spec.long_name
            if spec.flags and not spec.masks:
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


def _functions() -> tuple[Row, list[Row]]:
    """Functions first, in the order of their names, then classes."""
    public = sorted((inspect.isclass(getattr(sweep, name)), name) for name in sweep.__all__)
    rows = []
    for is_class, name in public:
        summary = inspect.getdoc(getattr(sweep, name)).partition("\n")[0]
        rows.append((f"{{py:{'class' if is_class else 'func'}}}`~sweep.{name}`", summary))
    return ("name", "purpose"), rows


def _directive(make: Callable[[], tuple[Row, list[Row]]]) -> type[SphinxDirective]:
    class Table(SphinxDirective):
        def run(self) -> list[nodes.Node]:
            head, rows = make()
            lines = ["| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in (head, *rows)]
            lines.insert(1, "|" + "---|" * len(head))
            return self.parse_text_to_nodes("\n".join(lines))

    return Table


def setup(app: Sphinx) -> dict[str, bool]:
    for name, make in (
        ("parameters", _parameters),
        ("units", _units),
        ("settings", _settings),
        ("variables", _variables),
        ("statuses", _statuses),
        ("doubts", _doubts),
        ("measurements", _measurements),
        ("methods", _methods),
        ("models", _models),
        ("functions", _functions),
    ):
        app.add_directive(name, _directive(make))
    return {"parallel_read_safe": True}
