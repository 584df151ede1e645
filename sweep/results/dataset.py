"""Turns state rows and predictions into a labelled xarray dataset with CF-1.11 attributes."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import IntEnum
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.grid import CASE, SAMPLE, Array, Grid
from sweep.kernels import measures, status
from sweep.kernels.kernel import Kernel
from sweep.kernels.measures.resting_spin import endings
from sweep.kernels.method import STEP_RULES
from sweep.kernels.methods import METHODS
from sweep.kernels.status import COUNT_DOUBTS, SETTLED, TIME_LIMIT, Doubt
from sweep.models.general.surfaces import ELLIPSOID
from sweep.models.slow.estimate import Ending
from sweep.results.probabilities import PROBABILITIES, probabilities
from sweep.units import NUMBER, PAPER_UNITS, SPIN, TIME
from sweep.variables import Variable, attributes

_STATUSES = {
    0: ("not_run", "not run"),
    status.SETTLED: ("settled", "settled"),
    status.TIME_LIMIT: ("time_limit", "ended at the time limit"),
    status.LIFT_OFF: ("lift_off", "lifted off the table"),
    status.DIVERGED: ("diverged", "diverged"),
    status.PARADOX: ("paradox", "met Painlevé's paradox"),
    status.TOPPLED: ("toppled", "toppled"),
    status.IMPOSSIBLE: ("impossible", "impossible body, or one that cannot stand"),
}
STATUSES, STATUS_WORDS = ({code: each[k] for code, each in _STATUSES.items()} for k in (0, 1))
"""How a trajectory ended: the flags of the variable `status`, and the labels that figures use for them."""


class Reason(IntEnum):
    """Whether a critical spin exists (n_c1 by the eigenvalues, n_c2 by simulation), and if not, why."""

    EXISTS = 0
    NO_FRICTION = 1
    NO_COUPLING = 2
    NOT_FOUND = 3
    REVERSES_AT_N_C1 = 4
    NOT_SETTLED = 5
    FAILED = 6
    IMPOSSIBLE = 7


REASONS = {int(reason): reason.name.lower() for reason in Reason}
"""The flags of variables that hold a `Reason`."""

_FINER, _LOOK = "lower the tolerance", "look at the trajectory"
DOUBTS = {
    Doubt.TIME_LIMIT: ("not_final", "the time limit came first, so more reversals may follow", "raise t_end"),
    Doubt.STEP: ("depends_on_step", "longer steps give a different number of reversals", _FINER),
    Doubt.WINDOWS: ("depends_on_windows", "averages over other windows give a different number of reversals", _LOOK),
    Doubt.PARITY: ("contradicts_spin", "the sign of the final spin does not match the number of reversals", _LOOK),
    Doubt.MARGIN: ("close_to_another", "a margin is smaller than ten times its error, so another count is possible",
                   _FINER),
    Doubt.ROUND_OFF: ("round_off", "round-off decides when late reversals come; their times and the final spin are "
                      "unknown", ""),
    Doubt.TOLERANCE: ("misses_tolerance", "the estimated error of the final spin exceeds the tolerance", _FINER),
}  # fmt: skip
"""Names of the flags of `doubts`, what each means, and what to do about it."""

ROWS = {CASE: "Row of the table of cases.", SAMPLE: "Number of the sample."}
"""The meaning of the index along the rows of a table."""


def _flag(long_name: str, meanings: Mapping[int, str], description: str = "", **how: Any) -> Variable:
    return Variable("int8", NUMBER, long_name, description, meanings, **how)


def _critical(name: str, source: str, by: str, *along: str) -> Variable:
    event = "a tiny rattle grows" if name == "n_c1" else "the spin reverses"
    words = f"Spin beyond which {event}, by {by}."
    return Variable("float64", SPIN, f"{name}, {source}", words, per_body=True, along=("sign", *along))


FURTHER = {
    "sign": ([1, -1], "sign of the spin"),
    "end": (["inner", "outer"], "end of the bracket"),
    "reversal": ([], "number of the reversal"),
}
"""Values and words of further dimensions of variables; a dimension without values is counted from one."""

VARIABLES: dict[str, Variable] = {
    **{
        name: spec
        for kind in (*measures.MEASURES.values(), *measures.OF_COUNTS)
        for name, spec in kind.variables.items()
    },
    "status": _flag("how the trajectory ended", STATUSES),
    "spin_final": Variable("float64", SPIN, "final spin n", "Spin at t_stop.", of_sound_runs=True),
    "spin_error": Variable("float64", SPIN, "estimated error of the final spin",
                           "Estimated error of spin_final; missing where it is unknown, as after a reversal that grew "
                           "from round-off.", of_sound_runs=True),
    "certain": _flag("is the count certain?", {0: "uncertain", 1: "certain"},
                     "Whether the number of reversals is final, with margins larger than ten times their errors; the "
                     "reasons against it are in doubts.", of_sound_runs=True),
    "doubts": _flag("reasons for doubt", {int(bit): name for bit, (name, *_) in DOUBTS.items()},
                    "Bits by name: " + " ".join(f"{name}: {words}." for name, words, _ in DOUBTS.values()),
                    of_sound_runs=True, masks=True),
    "t_stop": Variable("float64", TIME, "time of the end", "Time at which the simulation ended."),
    "method": _flag("integration method", {each.code: name for name, each in METHODS.items()}),
    "step": Variable("float64", TIME, "integration step"),
    "step_rule": _flag("what set the integration step", STEP_RULES),
    "reversals_predicted": Variable("int16", NUMBER, "spin reversals, predicted (Takano 2011)",
                                    "Spin reversals predicted by Takano (2011), cases (I) and (II)."),
    "t_first_reversal_predicted": Variable("float64", TIME, "first reversal, predicted (Garcia–Hubbard)",
                                           "Time of the first spin reversal predicted by Garcia and Hubbard (1988); "
                                           "missing where nothing drives a reversal, where friction stops it, or where "
                                           "their formula does not cover the body."),
    "n_c1": _critical("n_c1", "formula", "the formula of Takano (2011)"),
    "n_c2": _critical("n_c2", "formula", "the formula of Takano (2011)"),
    "n_c1_linear": _critical("n_c1", "eigenvalues", "the eigenvalues of the model"),
    "n_c2_simulated": _critical("n_c2", "simulation", "simulation: the middle of the bracket"),
    "n_c2_bracket": _critical("n_c2", "simulation: ends", "simulation: the ends of the bracket", "end"),
    "n_c_reason": _flag("why a critical spin is missing", REASONS,
                        "Whether n_c1_linear and n_c2_simulated exist, and if not, why.",
                        per_body=True, along=("sign",)),
    "form_factor": Variable("float64", NUMBER, "form factor L(f)", "Form factor L(f) of Takano (2011).", per_body=True),
}  # fmt: skip


SERIES: dict[str, Variable] = {name: spec for kind in measures.MEASURES.values() for name, spec in kind.series.items()}
"""The series that measurements add to a trajectory."""


def measured(kernel: Kernel, rows: Array, t_end: float | Array, left: Ending | None = None) -> dict[str, Array]:
    """Return the simulated variables from final state rows, of shape (cells,) or (cells, length).

    `left` is what is left to come of their spins, by default as the slow equations predict it.
    """
    table = kernel.table(rows)
    left = left or endings(table, table["status"] == SETTLED)
    times = kernel.times(rows, t_end)
    result = {"status": table["status"], "spin_final": kernel.spins(rows), "t_stop": times, "step": table["step"]}
    doubts: Array = np.zeros(len(rows), int)
    for each in kernel.kinds:
        result |= each.read(table, times, left)
        doubts |= each.doubts(table)
    return result | {"doubts": doubts}


def label(config: Config, grid: Grid, arrays: Mapping[str, Array], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Return a dataset of `arrays` over the cells of `grid`, or over its bodies where a variable is per body.

    The cells may lie along one dimension, in C order, or along the dimensions of the grid.
    """
    meaning = {"reversals": VARIABLES[config.tier.counts]}
    variables = {
        name: xr.Variable(
            (*over.dims, *spec.along),
            shaped(over, spec, arrays[name]),
            described(meaning.get(name, spec), config.units),
        )
        for name, (over, spec) in layout(grid, arrays).items()
    }
    coordinates = {name: xr.Variable((name,), values, config.described(name)) for name, values in grid.axes.items()}
    for name, variable in variables.items():
        for dim in VARIABLES[name].along:
            values, words = FURTHER[dim]
            counted = np.arange(1, variable.sizes[dim] + 1)
            coordinates[dim] = xr.Variable((dim,), values or counted, {"long_name": words})
    for name, column in grid.table.items():
        coordinates[name] = xr.Variable((grid.row,), column, config.described(name))
    if grid.table:
        index = np.arange(grid.shape[-1], dtype="int64")
        coordinates[grid.row] = xr.Variable((grid.row,), index, {"long_name": grid.row, "description": ROWS[grid.row]})
    for name, value in grid.constants.items():
        coordinates[name] = xr.Variable((), value, config.described(name))
    of = " of a rattleback" if config.of_rattlebacks else ""
    head = {"Conventions": "CF-1.11", "title": f"{config.name}: reversals{of} ({config.model} model)"}
    head |= {"surface": config.surface} if config.surface != ELLIPSOID.name else {}
    head |= {"body": json.dumps(config.assembly.spec)} if config.assembly.spec else {}
    found = xr.Dataset(variables, coordinates, {**head, **attributes})
    return with_probabilities(config, found) if grid.row == SAMPLE and "reversals" in found else found


def with_probabilities(config: Config, dataset: xr.Dataset) -> xr.Dataset:
    """Add to `dataset`, which holds samples, the probability of each number of reversals."""
    axes = [str(dim) for dim in dataset["status"].dims if dim != SAMPLE]
    found = probabilities(dataset)
    counts = np.arange(1, found["probability"].shape[-1] + 1)
    coordinate = xr.Variable(("count",), counts, {"long_name": "spin reversals, at least"})
    added = variables(PROBABILITIES, (*axes, "count"), found, config.units)
    return dataset.assign_coords(count=coordinate).assign(added)


TRAJECTORIES = "trajectory"
"""Name of the dimension along which `along_one` lists trajectories."""


def along_one(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset of trajectories, whatever their dimensions, with all of them along the first dimension."""
    cells = [str(dim) for dim in dataset["spin"].dims if dim != "time"]
    if not cells:
        return dataset.expand_dims(TRAJECTORIES)
    found = dataset if cells == [TRAJECTORIES] else dataset.stack({TRAJECTORIES: cells}, create_index=False)
    return found.transpose(TRAJECTORIES, ...)


def uncertain(dataset: xr.Dataset) -> xr.DataArray:
    """Return a mask of the cells whose count is not certain: it may not be final, or another one is possible.

    Cells without a count, which failed or are impossible, are not among them.
    """
    counted = dataset["status"].isin((SETTLED, TIME_LIMIT))
    return counted & (dataset["doubts"] & int(COUNT_DOUBTS) > 0)


def never_settles(dataset: xr.Dataset) -> bool:
    """Return whether no cell has settled, as in a model that cannot: its counts grow with the time limit for ever."""
    return not (dataset["status"] == SETTLED).any()


def check_names(config: Config, series: Iterable[str] = ()) -> None:
    """Raise an `InputError` if a parameter has the name of a variable or dimension, or of one of these `series`."""
    own = {*VARIABLES, *PROBABILITIES, *ROWS, *FURTHER, *series}
    names = own & set(config.tier.parameters)
    if names:
        words = f"parameter {min(names)}: is reserved for a variable of the dataset; rename it"
        raise config.error(("model",), words)


def layout(grid: Grid, names: Iterable[str]) -> dict[str, tuple[Grid, Variable]]:
    """Return the variables `names` that extend over cells or bodies, each with the grid that it extends over."""
    bodies = grid.of_bodies()
    return {name: (bodies if spec.per_body else grid, spec) for name, spec in VARIABLES.items() if name in names}


def shaped(over: Grid, spec: Variable, values: Array) -> Array:
    """Return `values` over the cells of `over`, with the dimensions and type of the variable."""
    values = np.asarray(values).astype(spec.dtype, copy=False)
    return values.reshape(over.shape + values.shape[values.ndim - len(spec.along) :])


def pieces(grid: Grid, tile: tuple[slice, ...], arrays: Mapping[str, Array]) -> Iterator[tuple[str, Any, Array]]:
    """Yield for each variable in a tile's flat `arrays` its name, its place in the whole array, and its values."""
    at = dict(zip(grid.dims, tile, strict=True))
    for name, (over, spec) in layout(grid.part(tile), arrays).items():
        yield name, tuple(at[dim] for dim in over.dims), shaped(over, spec, arrays[name])


def assemble(grid: Grid, tiles: Iterable[tuple[tuple[slice, ...], Mapping[str, Array]]]) -> dict[str, Array]:
    """Assemble the arrays over all cells or bodies from the tiles."""
    whole: dict[str, Array] = {}
    for tile, arrays in tiles:
        for name, (over, spec) in layout(grid, set(arrays) - set(whole)).items():
            whole[name] = np.empty(over.shape + np.shape(arrays[name])[1:], spec.dtype)
        for name, place, values in pieces(grid, tile, arrays):
            whole[name][place] = values
    return whole


def variables(
    specs: Mapping[str, Variable], dims: Sequence[str], found: Mapping[str, Array], system: str = PAPER_UNITS
) -> dict[str, xr.Variable]:
    """Return the variables of `specs` that `found` contains, along common dimensions."""
    return {
        name: xr.Variable(dims, np.asarray(found[name]).astype(spec.dtype, copy=False), described(spec, system))
        for name, spec in specs.items()
        if name in found
    }


def described(spec: Variable, system: str = PAPER_UNITS) -> dict[str, Any]:
    """Return the CF attributes of a variable in a system of units."""
    words: dict[str, Any] = {**attributes(spec, system)}
    if spec.flags:
        words["flag_masks" if spec.masks else "flag_values"] = np.array(list(spec.flags), dtype=spec.dtype)
        words["flag_meanings"] = " ".join(spec.flags.values())
    return words
