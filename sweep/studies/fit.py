"""Finds the body, friction and start that reproduce a film.

The misfit has many minima: a trajectory that reverses once more is another one.  So the search starts from points all
over the ranges (Sobol), and first asks for the beginning of the film, then for half as much again, and so on.

An interval holds the values of a parameter at which the other parameters can keep the misfit, in units of the variance,
within 1 or 3.84 of its least (profile likelihood: Raue et al. 2009, doi 10.1093/bioinformatics/btp358).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import ceil

import numpy as np
import xarray as xr
from scipy.stats import qmc

from sweep.config import Config, ConfigError, Values
from sweep.config.cross_checks import misplaced, unlike
from sweep.config.film import Film
from sweep.ended import ended
from sweep.faults import brief, fault_of, suggestion
from sweep.grid import BODY, Array
from sweep.interrupt import deferred
from sweep.kernels.measures.misfit import Misfit
from sweep.models.user.blame import blamed
from sweep.results import dataset
from sweep.results.kind import FIT
from sweep.results.provenance import provenance
from sweep.studies.misfit import UNKNOWNS, Ask, Minimum, Problem, minimise
from sweep.studies.search import require_certain
from sweep.studies.together import together
from sweep.units import ANGLE, SPIN, TIME
from sweep.variables import Variable

_TIME = Variable("float64", TIME, "time t", "Time since the film began.")
_SEEN = {
    "spin": Variable("float64", SPIN, "spin n"),
    "gyroscope": Variable("float64", SPIN, "angular velocity about the sensor's axis"),
    "heading": Variable("float64", ANGLE, "heading"),
}

LEVELS = {68: 1.0, 95: 3.84}
"""Percent of an interval, and how far its ends raise the misfit: quantiles of chi square for one parameter."""

POPULATION, KEPT = 256, 8
"""Points all over the ranges, and the best of them from which the search goes on."""

# Minima whose parameters differ by less than this share of their ranges are one.
_SAME = 0.01

# The search sees so much more of the film each time, and begins with its first twelfth.  Three films of turning bodies
# that were fitted from one reversal to the next were missed; doubling missed two, and 1.3 was no better than 1.5.
_LONGER, _HORIZONS = 1.5, 7

# A direction is not determined if its 95 % interval is longer than this share of the ranges.
_BLIND = 0.5

# How often intervals are sought anew because a lower minimum has turned up.
_RESTARTS = 3

_RUGGED = "the misfit is rugged: minima lie close together, and the intervals are of one of them alone"

# Correlation of two parameters beyond which neither is known without the other.
_TIED = 0.98


@deferred()
def fit(config: Config, film: Film, free: Sequence[str], note: Callable[[str], None]) -> xr.Dataset:
    """The fit of the law of friction that `config` names."""
    if not np.isfinite([film.time, film.value, film.errors]).all():
        raise fault_of("the film holds a value that is no number; leave out such instants")
    theirs = _of_film(film)
    config = _one_body(config, free, theirs)
    if reason := unlike(config, film):
        raise fault_of(f"the film {reason}")
    began = time.perf_counter()
    if film.omitted:
        note(film.omitted)
    ranges = {name: theirs.get(name) or _range(config, name) for name in free}
    if len(ranges) >= len(film.time):
        raise fault_of(f"{len(ranges)} parameters are free, and the film has {len(film.time)} rows; free fewer")
    ends = {name: Values(each, True, list(each)) for name, each in ranges.items() if name in (*BODY, "x0", "y0")}
    if off := misplaced(replace(config, parameters=config.parameters | ends)):
        raise ConfigError([config.fault(("start", "x0"), f"what is free reaches too far: {off}")])
    with blamed(config.origin):
        problem = Problem(config, film, ranges)
        minima = _search(problem, note)
        best, limits, rugged = _intervals(problem, minima[0], note)
    words = _blind(problem, best) + ([_RUGGED] if rugged else [])
    return _labelled(problem, [best, *minima[1:]], limits, words, time.perf_counter() - began)


def _one_body(config: Config, free: Sequence[str], of_film: Collection[str]) -> Config:
    """`config` if it describes one body, apart from the `free` parameters; `ConfigError` if not.

    `of_film` are the names of what may be free of the film.
    """
    require_certain(config)
    known = (*config.tier.parameters, *of_film)
    if not free:
        raise fault_of(f"name the free parameters, out of {', '.join(known)}")
    for name in free:
        if name not in known and (words := ended(name)):
            raise fault_of(words, name)
        if name not in known:
            message = f"{brief(name)} is no parameter of the {config.tier.name} model{suggestion(name, known)}"
            raise fault_of(f"{message}; free may be {', '.join(known)}")
    if config.cases:
        raise ConfigError([config.fault(("cases",), "cannot be fitted; a fit is of one body")])
    if more := [name for name in config.axes if name not in free]:
        raise ConfigError([config.fault(config.table[more[0]].place, "has several values; free it, or give one")])
    return config


def _of_film(film: Film) -> dict[str, tuple[float, float]]:
    """The ranges in which `UNKNOWNS` are sought, by name."""
    delay, most = float(film.time[-1]) / 10, float(np.abs(film.value).max()) / 10
    # No film shows where a heading counts from, so that it has no bias.
    return {"film_delay": (0.0, delay)} | ({} if film.what == "heading" else {"film_bias": (-most, most)})


def _range(config: Config, name: str) -> tuple[float, float]:
    """The range in which a parameter is sought: its axis, or from a fifth to five times a positive value."""
    values, parameter = config.parameters[name], config.table[name]
    if values.is_axis and len(values.numbers) > 1:
        return min(values.numbers), max(values.numbers)
    value = values.numbers[0]
    if value == 0:
        message = "give the ends of its range as two values, such as [-1, 1]: it is free, and zero tells no size"
        raise ConfigError([config.fault(parameter.place, message)])
    if max(parameter.above, parameter.at_least) >= 0:
        return value / 5, min(value * 5, parameter.below)
    return value - abs(value) / 2, value + abs(value) / 2


def _search(problem: Problem, note: Callable[[str], None]) -> list[Minimum]:
    """The minima over the whole film, the lowest first."""
    sobol = qmc.Sobol(len(problem.free), rng=0).random(POPULATION)
    rows = len(problem.film.time)
    horizons = [ceil(rows / _LONGER**k) for k in range(_HORIZONS - 1, -1, -1)]
    cost = np.sum(problem.residuals(sobol, horizons[0]) ** 2, axis=1)
    places = [np.full(len(problem.free), 0.5), *sobol[np.argsort(cost)[:KEPT]]]
    for number, instants in enumerate(horizons, start=1):
        answers = partial(problem.answers, instants=instants)
        found = together([partial(minimise, place=place) for place in places], answers)
        minima = _different(sorted(found, key=lambda each: each.misfit))
        note(f"film up to {problem.film.time[instants - 1]:.4g}, {number} of {len(horizons)}: minima: {len(minima)}")
        places = [each.place for each in minima]
    return minima


def _different(minima: list[Minimum]) -> list[Minimum]:
    found: list[Minimum] = []
    for each in minima:
        if all(np.max(np.abs(each.place - other.place)) > _SAME for other in found):
            found.append(each)
    return found


def _variance(problem: Problem, best: Minimum) -> float:
    """The variance of the residuals: 1 if the film tells its errors."""
    if problem.film.error is not None:
        return 1.0
    return best.misfit / (len(problem.film.time) - len(problem.free))


def _intervals(problem: Problem, best: Minimum, note: Callable[[str], None]) -> tuple[Minimum, Array, bool]:
    """The best minimum, and the ends of the intervals of `LEVELS` as places, shape (levels, 2, free).

    An end at 0 or 1 is that of the range.  Where a profile meets a lower minimum, all begins anew from that.  If
    that happens more than once, the misfit is rugged, which is told as well.
    """
    for restart in range(_RESTARTS + 1):
        limits, lower = _profiles(problem, best, note, stops=restart < _RESTARTS)
        if lower is None:
            break
        (best,) = together([partial(minimise, place=lower.place)], problem.answers)
        note(f"a lower minimum: {best.misfit:.6g}")
    return best, limits, restart > 1


def _profiles(
    problem: Problem, best: Minimum, note: Callable[[str], None], *, stops: bool
) -> tuple[Array, Minimum | None]:
    """The ends of all intervals, shape (levels, 2, free), or, if that `stops` it, a minimum that is lower."""
    ends = [
        partial(_end, problem=problem, best=best, i=i, sign=sign, allowed=allowed)
        for allowed in LEVELS.values() for sign in (-1, 1) for i in range(len(problem.free))
    ]  # fmt: skip
    found = together(ends, problem.answers, lambda end: stops and end[1] is not None)
    note(f"intervals: {problem.trajectories} trajectories so far")
    lower = min((each for _, each in found if each), key=lambda each: each.misfit, default=None)
    if lower and stops:
        return np.empty(0), lower
    low, high = np.reshape([end for end, _ in found], (len(LEVELS), 2, len(problem.free))).swapaxes(0, 1)
    # In a rugged misfit a narrow search may have come farther; what fits so well belongs to the wide interval too.
    return np.stack([np.minimum.accumulate(low), np.maximum.accumulate(high)], axis=1), None


def _end(ask: Ask, problem: Problem, best: Minimum, i: int, sign: int, allowed: float) -> tuple[float, Minimum | None]:
    """Where one parameter leaves its interval, and a lower minimum if one is met on the way."""
    variance, covariance = _variance(problem, best), _covariance(problem, best)
    size = np.sqrt(max(covariance[i, i], 1e-30))
    along, reach = covariance[:, i] / size**2, float(np.sqrt(allowed) * size)
    near, far = 0.0, np.inf
    for _ in range(8):
        end = float(np.clip(best.place[i] + sign * reach, 0, 1))
        start = np.clip(best.place + along * (end - best.place[i]), 0, 1)
        start[i] = end
        found = minimise(ask, start, i)
        above = (found.misfit - best.misfit) / variance
        if above < -0.01 * allowed:
            return end, found
        if abs(above / allowed - 1) < 0.05 or (end in (0, 1) and above < allowed):
            return end, None
        reach = abs(end - best.place[i])
        near, far = (reach, far) if above < allowed else (near, reach)
        # A profile is nearly a parabola; where it is not, halve.
        guess = reach * float(np.sqrt(allowed / max(above, 0.05 * allowed)))
        reach = guess if near < guess < far else (near + far) / 2
    return float(np.clip(best.place[i] + sign * reach, 0, 1)), None


def _covariance(problem: Problem, best: Minimum) -> Array:
    """Of the places, by the Jacobian; a direction that the film does not see is as wide as its range."""
    sizes, directions = np.linalg.eigh(best.jacobian.T @ best.jacobian / _variance(problem, best))
    return np.asarray((directions / np.maximum(sizes, 1.0)) @ directions.T)


def _blind(problem: Problem, best: Minimum) -> list[str]:
    """What the film does not determine, in words."""
    covariance, names = _covariance(problem, best), list(problem.free)
    sizes, directions = np.linalg.eigh(covariance)
    words = []
    for size, direction in zip(sizes[::-1], directions.T[::-1], strict=True):
        if 4 * np.sqrt(size) > _BLIND:
            some = [name for name, part in zip(names, direction, strict=True) if abs(part) > 0.3]
            together = " and ".join(some) + (" together" if len(some) > 1 else "")
            words.append(f"the film hardly determines {together}: the interval of 95 % is half of the range or more")
    deviation = np.sqrt(np.diag(covariance))
    tied = covariance / np.outer(deviation, deviation)
    words += [
        f"{names[i]} and {names[j]} are known only together: their correlation is {tied[i, j]:.3f}"
        for i in range(len(names))
        for j in range(i)
        if abs(tied[i, j]) > _TIED
    ]
    return words


def _labelled(problem: Problem, minima: list[Minimum], limits: Array, words: list[str], seconds: float) -> xr.Dataset:
    """What was found, with the film and the curve that fits it."""
    best, film, names = minima[0], problem.film, list(problem.free)
    covariance, variance = _covariance(problem, best), _variance(problem, best)
    deviation, rows = np.sqrt(np.diag(covariance)), len(film.time)
    fitted = film.value + problem.residuals(best.place[None])[0] * problem.film.errors
    told, clock = (dataset.described(each, problem.config.units) for each in (_SEEN[film.what], _TIME))
    ends = {
        f"{side}_{level}": ("parameter", problem.values(limits[k, end]), {"long_name": f"{side} end, {level} %"})
        for k, level in enumerate(LEVELS)
        for end, side in enumerate(("lower", "upper"))
    }
    found = xr.Dataset(
        {
            "value": ("parameter", problem.values(best.place), {"long_name": "value that fits best"}),
            **ends,
            "range_from": ("parameter", problem.low, {"long_name": "least value that was tried"}),
            "range_to": ("parameter", problem.high, {"long_name": "largest value that was tried"}),
            "correlation": (("parameter", "other"), covariance / np.outer(deviation, deviation)),
            "minimum": (("rank", "parameter"), problem.values(np.array([each.place for each in minima]))),
            "misfit": ("rank", [each.misfit / variance for each in minima], {"long_name": "chi square of a minimum"}),
            "seen": ("time", film.value, told),
            "fitted": ("time", fitted, told),
        },
        {"parameter": names, "other": names, "time": ("time", film.time, clock)},
    )  # fmt: skip
    criterion = rows * np.log(best.misfit / rows) if film.error is None else best.misfit
    values = dict(zip(names, problem.values(best.place).tolist(), strict=True))
    return found.assign_attrs(
        title=f"{problem.config.name}: fitted to a film ({problem.config.model} model)",
        **provenance(_with(problem.config, values), seconds, problem.trajectories, of=FIT),
        root_mean_square=float(np.sqrt(np.mean((fitted - film.value) ** 2))), akaike=float(criterion + 2 * len(names)),
        undetermined="; ".join(words), trajectories=problem.trajectories,
    )  # fmt: skip


def _with(config: Config, values: Mapping[str, float]) -> Config:
    """`config` with these values of its parameters."""
    fixed = {name: Values.one(value) for name, value in values.items() if name not in UNKNOWNS}
    measure = tuple(spec for spec in config.measure if spec.partition("=")[0] != Misfit.name)  # its film lies elsewhere
    return replace(
        config, name=f"{config.name}_fit", parameters=config.parameters | fixed, measure=measure, film=None
    )  # fmt: skip
