"""Checks that individually valid values fit together.

Each check yields the path of the key to change, and a message that says what is wrong and what to do.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from sweep.config.configuration import Config
from sweep.config.film import Film
from sweep.config.schema import MAX_CELLS_IN_MEMORY
from sweep.config.values import Values
from sweep.faults import Path, either
from sweep.grid import BODY, Array, distinct
from sweep.kernels import measures, methods
from sweep.models.general import starts, validity
from sweep.models.general.surfaces import ELLIPSOID, SURFACES
from sweep.models.model import Model
from sweep.models.origin import Origin
from sweep.models.user import loading
from sweep.models.variants import BASES, INERTIA, Physics
from sweep.parameters import OF_SOLIDS, PARAMETERS
from sweep.units import SI, TIME, named

MAX_CELLS = 1_000_000_000
MAX_STEPS = 1e15

Misfit = tuple[Path, str]


def of_physics(values: Any, physics: Physics, origin: Origin | None) -> Iterator[Misfit]:
    """Check that parameters, law, units and surface belong together, and that the model supports them."""
    if origin and not loading.law(origin):  # any parameters
        if "units" in values.model_fields_set:
            yield ("units",), "the file of the model gives the units; leave them out"
        return
    if not origin and physics.beyond and values.model not in BASES:
        unknown = ", ".join(physics.beyond)
        yield ("model",), f"the {values.model} model does not support {unknown}; choose {either(BASES)}"
        return
    yield from ((PARAMETERS[name].place, reason) for name, reason in physics.misfits().items())
    yield from _of_assembly(physics)


def _of_assembly(physics: Physics) -> Iterator[Misfit]:
    """Check that the solid has its sizes, and that the weights leave the centre of mass above the lowest point."""
    solid, weights = physics.assembly.solid, physics.assembly.weights
    if (solid or weights) and physics.units != SI:
        yield ("units",), "solids and weights are in SI; set units: SI"
    for names in solid.needs if solid else ():
        if not {*names} & physics.names:
            yield ("body",), f"a size of the solid is missing; add {either(names)}"
    if solid and physics.surface != ELLIPSOID:
        yield ("body", "surface"), "cannot be combined with a solid, whose surface is an ellipsoid; leave it out"
    if weights and (off := physics.assembly.sideways).any():
        words = "have their centre of mass at {:.3g} m along a and {:.3g} m along b, where no model has it".format(*off)
        yield ("body", "weights"), f"{words}; put as much at [-x, -y] as at [x, y]"


def of_values(config: Config, given: Mapping[str, Values]) -> Iterator[Misfit]:
    """Check that values fit the model, the method and each other; `given` holds the values of all parameters."""
    yield from _of_parameters(config, given)
    yield from _of_integrator(config)
    for i, spec in enumerate(config.measure):
        yield from ((("measure", i), reason) for reason in _unmeasurable(spec.partition("=")[0], config))


def of_units(config: Config, written: Mapping[Path, str]) -> Iterator[Misfit]:
    """Check that values with units (`written`, by path) may have them in the unit system of the configuration."""
    for path, unit in written.items():
        if reason := config.unitless(str(path[-1]), unit):
            yield path, reason


def of_all_cells(config: Config) -> Iterator[Misfit]:
    """Check all cells; each check relies on the ones before it."""
    cells = config.grid.size
    if cells > MAX_CELLS:
        yield (), f"{cells} cells are too many; keep to {MAX_CELLS}"
    if config.samples and cells > MAX_CELLS_IN_MEMORY:
        yield ("samples",), f"cannot hold {cells} cells in memory; keep to {MAX_CELLS_IN_MEMORY} in all"
    checks = {("body",): impossible, ("start", "x0"): misplaced, ("integrator", "step"): _unusable_step}
    yield from ((path, reason) for path, check in checks.items() if (reason := check(config)))


def _of_parameters(config: Config, given: Mapping[str, Values]) -> Iterator[Misfit]:
    model, columns = config.tier, config.cases
    listed = {} if config.samples else columns
    for name in [name for name in listed if name not in model.parameters]:
        yield ("cases",), f"column {name}: the {model.name} model has no {name}; remove it"
    for name, value in given.items():
        path = config.table[name].place
        # A parameter that the model does not use may stay, so that one file serves every model.
        if name not in model.parameters and value.is_axis:
            yield path, f"the {model.name} model has no {name}; its parameters are {', '.join(model.parameters)}"
        elif name in columns and not config.samples:
            yield path, f"is also a column of {config.cases_file or 'cases'}; remove one of the two"
        elif config.cases_file is not None and (value.is_axis or value.distribution):
            kind = "a distribution" if value.distribution else "an axis"
            yield path, f"cannot be {kind} together with cases; give a number, or add a column to the table"
        elif config.samples and (beyond := [n for n in columns.get(name, ()) if not config.table[name].allows(n)]):
            message = f"{len(beyond)} of {len(columns[name])} samples are like {beyond[0]:.4g}"
            yield path, f"must be {config.table[name].allowed}, but {message}; choose another distribution"
    if config.samples and not config.distributions:
        yield ("samples",), "needs a parameter that is a distribution, such as n0: {normal: [0.05, 0.002]}"
    numbers = {config.table[name].place: value.numbers for name, value in given.items() if name in model.positive}
    numbers |= {("cases", name): listed[name] for name in model.positive if name in listed}
    for path, values in numbers.items():
        if (small := min(values)) < _LEAST:
            yield path, f"must be at least {_LEAST:g} for the {model.name} model, not {small:g}"
    for name in model.parameters:
        if name not in config.parameters and name not in columns:
            yield config.table[name].place, f"missing; give {config.table[name].allowed}"


_LEAST = 1e-300
"""Smallest value of a parameter that a model divides by; results overflow for smaller ones."""


def _of_integrator(config: Config) -> Iterator[Misfit]:
    model, integrator = config.tier, config.integrator
    if not isinstance(model, Model):
        return
    usable = methods.allowed(model, config.measure)
    if usable and integrator.method not in (*usable, methods.AUTO):  # without any, a measurement is refused
        able = integrator.method in methods.allowed(model)
        cannot = f"make all of {', '.join(config.measure)} on" if able else "run"
        choice = either((*usable, methods.AUTO))
        yield ("integrator", "method"), f"cannot {cannot} the {model.name} model; choose {choice}"
    if integrator.method == methods.AUTO and integrator.step != "auto":
        yield ("integrator", "step"), "must be auto with method: auto; or choose a method"


def _unmeasurable(name: str, config: Config) -> Iterator[str]:
    """Say why the measurement `name` is impossible."""
    model, possible = config.tier, measures.possible(config.tier)
    if name not in possible:
        yield f"{name} cannot be measured on the {model.name} model; choose from {', '.join(possible)}"
    for needed in set(measures.MEASURES[name].needs) - {spec.partition("=")[0] for spec in config.measure}:
        yield f"{name} is measured with the {needed}; add {needed}"


def unlike(config: Config, film: Film) -> str:
    """Say why a film cannot be compared with trajectories of `config`; return "" if it can.

    A film in the wrong unit can be a million times too long, and would take a million times longer to follow.
    """
    last, end = float(film.time[-1]), config.integrator.in_one_leg.t_end
    given = "name the unit in the header, such as 'time (ms)'"
    if film.clock and config.units != SI:
        other = named(TIME, config.units) or "those of the model"
        return f"gives times in {film.clock}; set units: SI, or convert all to {other} and name no unit"
    if last > end:
        message = f"lasts {last:g}, but trajectories {end:g}; raise t_end, or cut the film"
        return f"{message}; if its times are in a unit such as ms, {given}" if film.clock == "" else message
    gap = float(np.median(np.diff(film.time)))
    if film.clock == "" and config.units == SI and gap >= _SLOW:
        return f"has rows {gap:g} s apart if its times are in s; {given}"
    turned = float(np.percentile(np.abs(np.diff(film.value)), 90)) if film.what == "heading" else 0.0
    if turned > _TURNED:
        words = f"turns by {turned:.2g} rad from row to row, too far to count turns"
        return f"{words}; if its headings are in degrees, name the unit, such as 'heading (deg)'"
    spin = float(np.percentile(np.abs(film.value), 90)) if film.what != "heading" else 0.0
    if config.units == SI and config.of_rattlebacks and spin > _FAST:
        return f"turns at {spin:.3g} rad/s; if its spins are in degrees, name the unit, such as 'spin (deg/s)'"
    return ""


_SLOW = 1.0
"""Seconds between rows above which the unit of time must be named: such a film would not resolve the rattle."""

_TURNED = 1.0
"""Radians from row to row above which headings do not show the motion between them."""

_FAST = 100.0
"""Radians per second, 16 turns, above which no body stays on a table."""


def _unusable_step(config: Config) -> str:
    """Say what is wrong with a step fixed in the configuration; return "" if nothing is."""
    step, model = config.integrator.step, config.tier
    if step == "auto" or not isinstance(model, Model):
        return ""
    if config.integrator.t_end / step > MAX_STEPS:
        return f"takes {config.integrator.t_end / step:.2g} steps to t_end; keep to {MAX_STEPS:.0e}, or choose auto"
    with np.errstate(all="ignore"):  # the period of a vanishingly small body is NaN
        names = BODY if config.of_rattlebacks else model.parameters
        longest = min(
            float(methods.longest_step(model, columns)[~model.impossible(columns)].min(initial=np.inf))
            for columns in distinct(config.grid, names)
        )
    too_long = f"must be auto or at most {longest:.3g}, a quarter of the rattle's period, not {step:g}"
    return "" if step <= longest else too_long


_SHAPE = (*OF_SOLIDS, "a", "b", "c", "offset", *INERTIA)

Reason = tuple[str, int, dict[str, float]]
"""Why some bodies are impossible or cannot stand, how many cells are affected, and the parameters of the first."""


def impossible(config: Config) -> str:
    """Describe the first impossible body if all are impossible; return "" otherwise."""
    return unfit(config) if sum(cells for _, cells, _ in _reasons(config)) == config.grid.size else ""


def unfit(config: Config) -> str:
    """Describe the first body that is impossible or cannot stand; return "" if there is none."""
    names = [name for name in _SHAPE if name in config.tier.parameters]
    return next((f"{message} (at {_at(first, names)})" for message, _, first in _reasons(config)), "")


def described_impossible(config: Config) -> dict[str, str]:
    """Return the dataset attribute that says how many cells have the status `impossible`, and why."""
    varying = [name for name in _SHAPE if name in {*config.axes, *config.cases}]
    found = [
        f"{cells} cells, {message.partition(';')[0]}, the first at {_at(first, varying)}"
        for message, cells, first in _reasons(config)
    ]
    return {"impossible": "; ".join(found)} if found else {}


def misplaced(config: Config) -> str:
    """Describe the first cell whose start point lies off the body; return "" if there is none."""
    surface = SURFACES[config.surface]
    if not config.of_rattlebacks or "x0" not in {*config.parameters, *config.cases}:
        return ""
    for columns in distinct(config.grid, (*BODY, "x0", "y0")):
        with np.errstate(over="ignore"):  # infinity lies off the body as well
            cells = np.flatnonzero(surface.off(columns, *starts.point(columns)))
        if len(cells):
            place = _at(_cell(columns, cells[0]), ("x0", "y0", "a", "b", "delta"))
            return f"start point off the {surface.name} at {place}; keep {surface.outline}"
    return ""


def _cell(columns: Mapping[str, Array], cell: int) -> dict[str, float]:
    return {name: float(column[cell]) for name, column in columns.items()}


def _at(values: Mapping[str, float], names: Iterable[str]) -> str:
    return ", ".join(f"{name}={values[name]:g}" for name in names if name in values)


def _reasons(config: Config) -> list[Reason]:
    """Collect the reasons why bodies are impossible or cannot stand; only the first reason of a cell counts."""
    if not config.of_rattlebacks:
        return []
    grid, surface = config.grid, SURFACES[config.surface]
    counts, first, seen = Counter[str](), dict[str, dict[str, float]](), 0
    for columns in distinct(grid, BODY):
        left = np.ones(len(columns["a"]), bool)
        seen += len(left)
        for bad, message in validity.wrongs(columns, surface):
            cells = np.flatnonzero(bad & left)
            if len(cells):
                first.setdefault(message, _cell(columns, cells[0]))
                counts[message] += len(cells)
                left[cells] = False
    return [(message, counts[message] * grid.size // seen, first[message]) for message in first]
