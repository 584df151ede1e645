"""Finds the body, friction and start that reproduce a film, with intervals and a verdict."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from sweep.config import Config, Values
from sweep.config.film import Film
from sweep.grid import Array
from sweep.interrupt import deferred
from sweep.models.user.blame import blamed
from sweep.results import dataset
from sweep.results.kind import FIT
from sweep.results.provenance import provenance
from sweep.studies import search, verdict
from sweep.studies.changes import SURE, advised
from sweep.studies.intervals import LEVELS, blind, covariance, intervals, variance
from sweep.studies.misfit import UNKNOWNS, Minimum, Note, Problem
from sweep.units import ANGLE, SPIN, TIME
from sweep.variables import Variable

_TIME = Variable("float64", TIME, "time t", "Time since the film began.")
_SEEN = {
    "spin": Variable("float64", SPIN, "spin n"),
    "gyroscope": Variable("float64", SPIN, "angular velocity about the sensor's axis"),
    "heading": Variable("float64", ANGLE, "heading"),
}

_OPTIONAL = ("sigma",)
"""Parameters that every law has, and that are zero unless a configuration names them."""

_RUGGED = "the misfit is rugged: minima lie close together, and the intervals belong to only one of them"


@deferred()
def fit(config: Config, film: Film, free: Sequence[str], note: Note, *, compared: bool = False) -> xr.Dataset:
    """Fit the law of friction that `config` names, which may be one of several that are `compared`."""
    began, posed = time.perf_counter(), search.posed(config, film, free)
    if film.omitted:
        note(film.omitted)
    if config.distributions:
        note(f"free within the measured distribution: {', '.join(config.distributions)}")
    with blamed(config.origin):
        search.check_length(posed)
        problem, minima = search.found(posed, note)
        found, limits, rugged = intervals(problem, minima, note, lambda best: verdict.judged(problem, best).fits)
        (best,) = search.turned(problem, [found])
        if best is not found:
            at = problem.mirrored
            limits[..., at] = 1 - limits[:, ::-1][..., at]
        judged = verdict.judged(problem, best)
        advice, gain = advised(config, posed, free, problem, best, judged, note, compared=compared)
        if judged.fits and gain > SURE:
            judged = judged._replace(reasons=["the film is far more likely with one change"])
    words = blind(problem, best) + ([_RUGGED] if rugged else [])
    return _labelled(problem, [best, *minima[1:]], limits, words, time.perf_counter() - began, judged, advice)


def with_optional(config: Config, free: Sequence[str]) -> Config:
    """Return `config` with zero for the free couples that any law may have in addition, such as `sigma`."""
    named = {*config.parameters, *config.cases}
    zero = {name: Values.one(0.0) for name in free if name in _OPTIONAL and name not in named}
    return replace(config, parameters=config.parameters | zero) if zero and config.of_rattlebacks else config


def _labelled(
    problem: Problem, minima: list[Minimum], limits: Array, words: list[str], seconds: float,
    judged: verdict.Verdict, advice: str,
) -> xr.Dataset:  # fmt: skip
    """Return the dataset of the result, with the film and the fitted curve."""
    best, film, names = minima[0], problem.film, list(problem.free)
    spread, unit = covariance(problem, best), variance(problem, best)
    deviation, rows = np.sqrt(np.diag(spread)), problem.rows
    fitted = film.value + verdict.of_film(problem, best) * film.errors
    edge = _ends(problem, limits)
    shown, clock = (dataset.described(each, problem.config.units) for each in (_SEEN[film.what], _TIME))
    ends = {
        f"{side}_{level}": ("parameter", problem.values(place), {"long_name": f"{side} end, {level} % confidence"})
        for level, places in zip(LEVELS, limits, strict=True)
        for side, place in zip(("lower", "upper"), places, strict=True)
    }
    found = xr.Dataset(
        {
            "value": ("parameter", problem.values(best.place), {"long_name": "best-fit value"}),
            **ends,
            "edge": ("parameter", edge, {"long_name": "ends of the 95 % interval that are limits of the search",
                                         "flag_values": np.arange(4, dtype=np.int8),
                                         "flag_meanings": "none lower upper both"}),
            "range_from": ("parameter", [each.low for each in problem.free.values()],
                           {"long_name": "lower limit of the search"}),
            "range_to": ("parameter", [each.high for each in problem.free.values()],
                         {"long_name": "upper limit of the search"}),
            "correlation": (("parameter", "other"), spread / np.outer(deviation, deviation)),
            "minimum": (("rank", "parameter"), problem.values(np.array([each.place for each in minima]))),
            "misfit": ("rank", [each.misfit / unit for each in minima], {"long_name": "chi square of a minimum"}),
            "seen": ("time", film.value, shown),
            "fitted": ("time", fitted, shown),
            "outlier": ("time", ~problem.kept, {"long_name": "row that is left out"}),
        },
        {"parameter": names, "other": names, "time": ("time", film.time, clock)},
    )  # fmt: skip
    noise = judged.noise * float(np.median(film.errors))
    criterion = rows * np.log(best.misfit / rows) if film.error is None else best.misfit
    values = dict(zip(names, problem.values(best.place).tolist(), strict=True))
    return found.assign_attrs(
        title=f"{problem.config.name}: fitted to a film ({problem.config.model} model)",
        **provenance(_with(problem.config, values), seconds, problem.trajectories, of=FIT),
        root_mean_square=float(np.sqrt(np.mean((fitted - film.value)[problem.kept] ** 2))),
        akaike=float(criterion + 2 * len(names)), noise=noise, outliers=int((~problem.kept).sum()),
        fits=int(judged.fits), fits_because=judged.because,
        verdict=verdict.sentences(problem, judged, problem.values(best.place),
                                  np.array([problem.values(end) for end in limits[-1]]), edge, words,
                                  advice),
        undetermined="; ".join(words), trajectories=problem.trajectories,
    )  # fmt: skip


def _ends(problem: Problem, limits: Array) -> Array:
    """Return which ends of the 95 % intervals are limits of the search: 1 lower, 2 upper, 3 both; shape (free,)."""
    low, high = limits[-1]
    return np.array([
        (each.ends(one) < 0) + 2 * (each.ends(other) > 0)
        for each, one, other in zip(problem.free.values(), low, high, strict=True)
    ], np.int8)  # fmt: skip


def _with(config: Config, values: Mapping[str, float]) -> Config:
    """Return `config` with these values of its parameters."""
    fixed = {name: Values.one(value) for name, value in values.items() if name not in UNKNOWNS}
    return replace(config, name=f"{config.name}_fit", parameters=config.parameters | fixed)
