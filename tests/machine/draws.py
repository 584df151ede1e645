"""What can be drawn of configurations, from the schema, the shipped files and what refusals say.

A draw is a name and a small number, which together give a value, so that Hypothesis shrinks what fails to few names.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from itertools import product
from random import Random
from typing import Any

import numpy as np
from fuzzing import check_refusal
from hypothesis import strategies as st
from ruamel.yaml import YAML
from support import ROOT

from sweep.config import Config, InputError, load_config
from sweep.config.distributions import FAMILIES
from sweep.config.schema import PATHS, schema_of
from sweep.faults import Fault
from sweep.kernels.measures import MEASURES, chosen
from sweep.kernels.measures.measurement import Measurement
from sweep.kernels.methods import AUTO, automatic, cheapest
from sweep.models import TIERS
from sweep.models.general.solids import SOLIDS
from sweep.parameters import PARAMETERS, Parameter
from sweep.plots.quantities import DERIVED, check_pictures
from sweep.results.dataset import VARIABLES
from sweep.units import PAPER_UNITS

Flat = dict[str, Any]
"""A configuration: values by path."""

Draws = list[tuple[str, int]]

PHYSICAL = {parameter.path: parameter for parameter in PARAMETERS.values()}


def draws(names: Iterable[str], most: int, least: int = 0) -> st.SearchStrategy[Draws]:
    """Some of the names, each with a number for its value."""
    each = st.tuples(st.sampled_from(sorted(names)), st.integers(0, 999))
    return st.lists(each, min_size=least, max_size=most, unique_by=lambda drawn: drawn[0]) if names else st.just([])


def flattened(document: Mapping[str, Any]) -> Flat:
    sections = {
        key for key, value in document.items() if isinstance(value, dict) and any(f"{key}." in p for p in PATHS)
    }
    inner = {f"{key}.{name}": value for key in document if key in sections for name, value in document[key].items()}
    return {key: value for key, value in document.items() if key not in sections} | inner


def nested(flat: Flat) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for path, value in flat.items():
        section, _, name = path.rpartition(".")
        (found.setdefault(section, {}) if section else found)[name] = value
    return found


def numbers(value: Any) -> list[float]:
    """The numbers in a value of a parameter: those of an axis, the ends of a range, what describes a distribution."""
    if isinstance(value, dict):
        return [value["start"], value["stop"]] if "start" in value else next(iter(value.values()))
    return value if isinstance(value, list) else [value]


MEASURED: Flat = {
    "units": "SI", "body.solid": "half_ellipsoid", "body.length": 0.12, "body.width": 0.036, "body.height": 0.016,
    "body.mass": 0.052, "body.angle": 0.035, "friction.mu": 30, "start.n0": 5, "start.x0": 1e-3, "start.y0": 3e-4,
}  # fmt: skip
"""A body by its sizes."""


@cache
def shipped() -> dict[str, Flat]:
    """The configurations that come with the package and need no user-defined code, and two more; two values an axis."""
    found: dict[str, Flat] = {"paper": {"friction.mu": 60}, "measured": dict(MEASURED)}
    for file in sorted((ROOT / "configs").glob("*.yaml")):
        flat = flattened(YAML(typ="safe").load(file.read_text(encoding="utf-8")))
        if flat.get("model", "slip") in TIERS:
            flat |= {
                path: numbers(flat[path])[:2] for path in flat if path in PHYSICAL and isinstance(flat[path], list)
            }
            flat |= {path: numbers(flat[path]) for path in flat if path in PHYSICAL and "start" in str(flat[path])}
            found[file.stem] = flat | ({"samples": 3} if "samples" in flat else {})
    return found


@cache
def _known(path: str, units: str) -> list[float]:
    of_units = [flat for flat in shipped().values() if flat.get("units", PAPER_UNITS) == units]
    known = [number for flat in of_units for number in numbers(flat.get(path, []))]
    return [number for number in known if isinstance(number, int | float)]


def _physical(parameter: Parameter, random: Random, units: str) -> Any:
    """A number, an axis, a range or a distribution; near what a shipped configuration says of it, or anything."""
    alike = [each.path for each in PHYSICAL.values() if each.units == parameter.units]
    known = _known(parameter.path, units) or [n for path in alike for n in _known(path, units)] or [0.01, 0.3, 1.0]

    def number(_: int) -> float:
        near = random.choice(known) * random.choice((1, 1, 0.5, 0.9, 1.1, 2, -1)) + random.choice((0, 0, 0, 0.01))
        return float(f"{next(n for n in (near, abs(near), known[0], 0.5) if parameter.allows(n)):.4g}")

    values = sorted(set(map(number, range(random.choice((1, 2, 3))))))
    form = random.choice(("number", "list", "list", "range", "distribution"))
    if form == "list":
        return random.sample(values, len(values))
    if form == "range":
        return {"start": values[0], "stop": values[-1], "num": random.choice((1, 2, 3, 6)),
                "spacing": random.choice(("linear", "log"))}  # fmt: skip
    if form == "number":
        return values[0]
    family = random.choice(sorted(FAMILIES))
    return {family: [values[0], 1.1 * values[0] if family == "uniform" else abs(values[0]) / 10 or 0.1]}


def _of_schema(field: Mapping[str, Any], random: Random) -> Any:
    """A value that the JSON schema of a field allows, by itself; mostly a small one."""
    field = random.choice(field.get("anyOf", [field]))
    if choices := field.get("enum", [field["const"]] if "const" in field else []):
        return random.choice(choices)
    kind = field.get("type")
    if kind in ("number", "integer"):
        low = field.get("minimum", field.get("exclusiveMinimum", field.get("ge", -9)))
        high = field.get("maximum", field.get("exclusiveMaximum", 9))
        numbers = [n for n in (low, 1, 2, 3, 0.5, 1e-3, 1e-6, 20, min(high, 40)) if low <= n <= high]
        number = random.choice(numbers)
        return int(number) if kind == "integer" else float(number)
    return {"boolean": random.random() < 0.5, "string": random.choice(("a", "x-1", "2")), "null": None}.get(str(kind))


def _measure(random: Random) -> Any:
    names = random.sample(sorted(MEASURES), random.randrange(5))
    bounds = {name: MEASURES[name].bounds for name in names}
    return [{name: random.randint(b[0], min(b[1], 4))} if (b := bounds[name]) else name for name in names]


def _weights(random: Random) -> Any:
    """Two of the same mass, on opposite sides of the centre."""
    mass, along, across = random.choice((1e-4, 1e-3)), random.choice((0.01, 0.02)), random.choice((-0.002, 0.002))
    return [{"mass": mass, "at": [sign * along, sign * across, 0]} for sign in (1, -1)]


def _cases(random: Random) -> Any:
    names = random.sample(["n0", "mu", "b", random.choice(sorted(PARAMETERS))], random.choice((1, 2)))
    return {
        name: [v for _ in range(3) for v in numbers(_physical(PARAMETERS[name], random, PAPER_UNITS))][:3]
        for name in names
    }


SPECIAL = {
    "measure": _measure,
    "cases": _cases,
    "picture": lambda random: random.sample([*VARIABLES, *DERIVED], random.choice((1, 2))),
    "body.solid": lambda random: random.choice(sorted(SOLIDS)),
    "body.weights": _weights,
    "samples": lambda random: random.choice((1, 2, 3, 5)),
    "seed": lambda random: random.randrange(5),
    "integrator.t_end": lambda random: random.choice((20, 100.0, 300, 1000)),
    "integrator.step": lambda random: random.choice(("auto", 0.02, 0.05, 0.15, 1.0)),
    "integrator.tolerance": lambda random: random.choice(("auto", 1e-4, 1e-6, 1e-8, 1e-10)),
}  # fmt: skip
"""What the schema cannot say, or what would take long."""


@cache
def fields() -> dict[str, Any]:
    schema = schema_of(None).model_json_schema()
    sections = {key: schema["$defs"][value["$ref"].rpartition("/")[2]]["properties"]
                for key, value in schema["properties"].items() if "$ref" in value}  # fmt: skip
    return flattened(sections) | {key: v for key, v in schema["properties"].items() if key not in sections}


OTHERWISE = [path for path in fields() if path in PATHS and path not in PHYSICAL]
"""Keys of what is not physical: each counts as much as all parameters together, which are alike."""


def setting(path: str, number: int, units: str = PAPER_UNITS) -> Any:
    """The value of a key of a configuration that belongs to a number."""
    random = Random(f"{path} {number}")
    if path in PHYSICAL:
        return _physical(PHYSICAL[path], random, units)
    return SPECIAL[path](random) if path in SPECIAL else _of_schema(fields()[path], random)


def accepted(flat: Flat, base: str = "paper") -> tuple[Flat, Config]:
    """The configuration, without what refusals name and with what they miss, until it is accepted; or else the base."""
    flat = dict(flat)
    for i in range(20):
        try:
            check_pictures(config := load_config(nested(flat)))
            return flat, config
        except InputError as error:
            check_refusal(error, "")
            for fault in error.faults:
                flat = _mended(flat, fault, i)
    return shipped()[base], load_config(nested(shipped()[base]))


def _mended(flat: Flat, fault: Fault, number: int) -> Flat:
    """The configuration without the key that a fault names; or with the one that is missing; or without its section."""
    paths = [".".join(map(str, fault.path[:k])) for k in range(len(fault.path), 0, -1)]
    if found := [path for path in paths if path in flat]:
        return {path: value for path, value in flat.items() if path != found[0]}
    if fault.message.startswith("missing"):
        return flat | {paths[0]: numbers(setting(paths[0], number))[0]}
    return {path: value for path, value in flat.items() if path.split(".")[0] != fault.path[0]}


def in_yaml(flat: Flat) -> str:
    return json.dumps(nested(flat), indent=1)  # which is YAML


# Kernels.  Each takes seconds to be compiled, so that a session has a pool of them.

Piece = tuple[str, str, tuple[str, ...]]
"""Method, model and specs of measurements."""

MOST_CELLS, MOST_STEPS = 40, 5e5
"""Length of a run, which takes a fraction of a second."""


def kernels(config: Config) -> set[Piece]:
    """What a run of the configuration may need."""
    methods = automatic(config.equations) if config.integrator.method == AUTO else [config.integrator.method]
    return {(method, config.tier.name, compiled(config.measure)) for method in methods}


def compiled(specs: Iterable[str]) -> tuple[str, ...]:
    """Those of the measurements that are made in a kernel."""
    return tuple(each.spec for each in chosen(specs) if isinstance(each, Measurement))


def steps(config: Config) -> float:
    """Steps of all cells to t_end."""
    model, columns, integrator = config.equations, config.grid.columns(), config.integrator
    columns = {name: column[~model.impossible(columns)] for name, column in columns.items()}
    with np.errstate(all="ignore"):
        _, step, _ = cheapest(model, columns, config.tolerance, integrator.t_end)
    return float((integrator.t_end / (step if integrator.step == "auto" else integrator.step + 0 * step)).sum())


def affordable(config: Config, pool: set[Piece]) -> bool:
    """Whether it takes little time, and no kernel beyond the pool, to run a configuration."""
    small = config.simulated and config.grid.size <= MOST_CELLS and kernels(config) <= pool
    return small and steps(config) <= MOST_STEPS


def bases(pool: set[Piece]) -> list[Flat]:
    """The shipped configurations, of any model and method, with what the kernels of a pool measure."""
    found = []
    for flat, model in product(shipped().values(), TIERS):
        there, config = accepted(flat | {"model": model})
        unit = 1.0 if config.units == PAPER_UNITS else float(np.sqrt(config.grid.columns()["c"].max() / 9.8))
        t_end = round(300 * unit, 1)
        for method, name, specs in sorted({(AUTO, *piece[1:]) for piece in pool} | pool):
            if (model, name) == (config.model, config.tier.name):
                of_pool = {"measure": written(specs), "integrator.method": method, "integrator.t_end": t_end}
                ours, config = accepted(there | of_pool)
                if kernels(config) <= pool:
                    found.append(ours)
    return found


def scene(base: Flat, changes: Draws, pool: set[Piece]) -> tuple[Flat, Config]:
    """A configuration with each change that the kernels of the pool can run, and no more cells or steps than usual."""
    flat, config = accepted(base)
    for drawn, number in changes:
        path = _mostly_own(drawn, number, config)
        changed, new = _with_few_samples(*accepted(flat | {path: setting(path, number, config.units)}), number)
        if path in changed and new.simulated and kernels(new) <= pool:
            flat, config = changed, new
    return _shortened(*_thinned(flat, config))


def _mostly_own(path: str, number: int, config: Config) -> str:
    """A key; three times of four one that the model has, in the place of a parameter that it has not."""
    own = [config.table[name].path for name in config.tier.parameters]
    return own[number % len(own)] if path in PHYSICAL and path not in own and number % 4 else path


def _with_few_samples(flat: Flat, config: Config, number: int) -> tuple[Flat, Config]:
    """The same with 2 to 4 samples, if they are as many as by default."""
    many = config.samples and config.samples > 5
    return accepted(flat | {"samples": 2 + number % 3}) if many else (flat, config)


def _thinned(flat: Flat, config: Config) -> tuple[Flat, Config]:
    """The same with shorter axes, the shortest first, until it has no more cells than usual."""
    while config.grid.size > MOST_CELLS:
        longer = [name for name, values in config.axes.items() if len(values) > 1]
        axis = min(longer, key=lambda name: len(config.axes[name]))
        flat, config = accepted(flat | {config.table[axis].path: list(config.axes[axis][:-1])})
    return flat, config


def _shortened(flat: Flat, config: Config) -> tuple[Flat, Config]:
    """The same until an earlier time, if it takes more steps than usual."""
    if (number := steps(config)) <= MOST_STEPS:
        return flat, config
    return accepted(flat | {"integrator.t_end": float(f"{config.integrator.t_end * MOST_STEPS / number:.2g}")})


def written(specs: Iterable[str]) -> list[Any]:
    """Measurements as a configuration names them."""
    return [{kind: int(n)} if n else kind for kind, _, n in (spec.partition("=") for spec in specs)]


def further(random: Random) -> Iterator[set[Piece]]:
    """Kernels of configurations that are drawn."""
    while True:
        base = shipped()[random.choice(sorted(shipped()))]
        drawn = {path: setting(path, random.randrange(1000)) for path in random.sample(sorted(PATHS), 4)}
        _, config = accepted(base | drawn)
        if config.simulated:
            yield kernels(config)
