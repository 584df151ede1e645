"""Critical spins in three ways: the paper's formulas, the model's eigenvalues, and simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError, Fault, Values
from sweep.grid import Array, Grid
from sweep.models import MODELS
from sweep.parameters import START
from sweep.prediction import Prediction, predict
from sweep.results import dataset
from sweep.results.dataset import DISAGREES, EXISTS, NO_COUPLING, NO_FRICTION, NOT_FOUND
from sweep.results.provenance import provenance
from sweep.studies import bracket
from sweep.studies.bracket import Bracket
from sweep.studies.growth import find_n_c1
from sweep.studies.reversing import find_n_c2
from sweep.studies.stepwise import stepwise

WIDTH = 1e-3
"""Relative width down to which simulation brackets a critical spin."""

# Eigenvalues and simulation disagree where they are farther apart than the bracket is wide, or than this: simulated
# growth rates are off by up to 1.2e-5 of the decay rate at rest (`sweep.studies.growth`).
_ERROR = 1e-4

# Bodies searched together (about 100 MB of images).
_GROUP = 4096

_REMARKS = {
    NO_FRICTION: "without friction",
    NO_COUPLING: "without coupling",
    NOT_FOUND: "not found",
    DISAGREES: "disagree with the eigenvalues",
    dataset.REVERSES_AT_N_C1: "reverse at n_c1 already",
    dataset.UNDECIDED: "undecided at t_end",
    dataset.FAILED: "failed",
}

_REASON_OF = {
    bracket.NOT_YET: NOT_FOUND,
    bracket.HAPPENS: EXISTS,
    bracket.AT_ONCE: dataset.REVERSES_AT_N_C1,
    bracket.UNDECIDED: dataset.UNDECIDED,
    bracket.FAILED: dataset.FAILED,
}


def critical(config: Config, width: float = WIDTH, note: Callable[[str], None] = lambda _: None) -> xr.Dataset:
    """Critical spins over all axes of `config` except n0.

    n_c1 is the first spin, outwards from zero, at which a tiny rattle grows.  n_c2 is the first spin, outwards from
    the simulated n_c1, from which the trajectory from the configuration's start point reverses before t_end.

    Parameters
    ----------
    width : of the brackets, relative to the spin
    note : called with a line before each search

    Returns
    -------
    Dataset over the axes without n0.  With each `*_simulated` come the ends of its bracket, `*_inner` and `*_outer`,
    and its `*_reason`, which says why it is NaN, or that it disagrees with the eigenvalues.  `critical_reason` is the
    first of the four reasons that is not `exists`.

    Raises
    ------
    ConfigError
        if the model is a formula, or the start point is an axis.
    """
    stepwise(config)  # raises if there is nothing to simulate
    if beyond := sorted((START - {"n0"}) & set(config.axes)):
        raise ConfigError([Fault("critical", None, None, ("start", beyond[0]), "an axis; allowed: a number")])
    config = _without_n0(config)
    grid = Grid.of(config)
    prediction = predict(MODELS[config.model], grid)
    arrays: dict[str, Array] = dict(dataset.predicted(prediction))
    arrays.pop("reversals_predicted", None)
    reasons = np.full((2, 2, grid.size), NO_FRICTION)
    ends = np.full((2, 2, 2, grid.size), np.nan)
    searched = np.flatnonzero(_decays_at_rest(prediction, grid))
    for begin in range(0, len(searched), _GROUP):
        cells = searched[begin : begin + _GROUP]
        for event, found in enumerate(_search(config, grid, prediction, cells, width, note)):
            ends[event][:, :, cells], reasons[event][:, cells] = found
    for event, name in enumerate(("n_c1", "n_c2")):
        for side, inner, outer, reason in zip(("plus", "minus"), *ends[event], reasons[event], strict=True):
            arrays[f"{name}_{side}_simulated"] = (inner + outer) / 2
            arrays[f"{name}_{side}_simulated_inner"] = inner
            arrays[f"{name}_{side}_simulated_outer"] = outer
            arrays[f"{name}_{side}_reason"] = reason
    four = reasons.reshape(4, -1)
    arrays["critical_reason"] = four[(four != EXISTS).argmax(axis=0), np.arange(grid.size)]
    attributes = {"relative_width": width, **provenance(config, 0.0, grid.size)}
    return dataset.label(config, grid, arrays, attributes).drop_vars("n0")


def remarks(result: xr.Dataset) -> list[str]:
    """For each critical spin that some bodies lack, or that is not to be trusted, a line: how many bodies, and why."""
    lines = []
    for name in ("n_c1_plus", "n_c1_minus", "n_c2_plus", "n_c2_minus"):
        codes = result[f"{name}_reason"].values
        counts = {words: int((codes == code).sum()) for code, words in _REMARKS.items()}
        if found := ", ".join(f"{count} {words}" for words, count in counts.items() if count):
            lines.append(f"{name}: {found}, of {codes.size}")
    return lines


def _without_n0(config: Config) -> Config:
    """`config` with a single start spin, since no critical spin depends on it."""
    parameters = config.parameters | {"n0": Values((0.0,), False, 0.0)}
    cases = None if config.cases is None else {name: v for name, v in config.cases.items() if name != "n0"}
    return replace(config, parameters=parameters, cases=cases or None)


def _decays_at_rest(prediction: Prediction, grid: Grid) -> Array:
    """Whether friction makes the rattle of each body decay, so that there may be critical spins."""
    if prediction.formulas is None:
        return np.zeros(grid.size, bool)
    assert prediction.stability is not None  # it is a model
    return np.asarray((grid.columns()["mu"] > 0) & ~np.isnan(prediction.stability.n_c1[0]))


def _search(
    config: Config, grid: Grid, prediction: Prediction, cells: Array, width: float, note: Callable[[str], None]
) -> Iterator[tuple[Array, Array]]:
    """For n_c1 and for n_c2: the ends of the brackets, shape (2, 2, cells), and the reasons, shape (2, cells).

    The axes are inner and outer end, positive and negative side, cells.
    """
    assert prediction.formulas is not None
    assert prediction.stability is not None
    bodies = {name: np.tile(values[cells], 2) for name, values in grid.columns().items()}
    sign = np.repeat([1.0, -1.0], len(cells))
    uncoupled = np.isnan(prediction.formulas.n_c1[0][np.tile(cells, 2)])
    linear = np.abs(np.concatenate([n_c1[cells] for n_c1 in prediction.stability.n_c1]))

    note(f"n_c1 of {len(cells)} bodies")
    first = find_n_c1(config, bodies, sign, width)
    reason = _reasons(first)
    reason[(reason == NOT_FOUND) & uncoupled] = NO_COUPLING
    reason[(first.outcome != bracket.FAILED) & ~_agrees(first, linear, width)] = DISAGREES
    yield (sign * [first.inner, first.outer]).reshape(2, 2, -1), reason.reshape(2, -1)

    note(f"n_c2 of {len(cells)} bodies")
    at = np.flatnonzero(first.outcome == bracket.HAPPENS)
    second = find_n_c2(config, {name: values[at] for name, values in bodies.items()}, (sign * first.outer)[at], width)
    ends, reason = np.full((2, len(sign)), np.nan), reason.copy()
    ends[:, at], reason[at] = sign[at] * [second.inner, second.outer], _reasons(second)
    yield ends.reshape(2, 2, -1), reason.reshape(2, -1)


def _reasons(found: Bracket) -> Array:
    return np.array([_REASON_OF[outcome] for outcome in found.outcome.tolist()], int)


def _agrees(found: Bracket, linear: Array, width: float) -> Array:
    """Whether the eigenvalues' |n_c1| lies within the bracket, or there is none by both."""
    slack = 1 + max(width, _ERROR)
    within = (found.inner / slack <= linear) & (linear <= found.outer * slack)
    return np.asarray(np.where(found.outcome == bracket.NOT_YET, np.isinf(linear), within))
