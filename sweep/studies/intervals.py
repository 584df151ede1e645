"""Finds the confidence intervals of a fit: how far each parameter can go while the others keep the misfit low.

An interval reaches from the least to the largest value of a parameter at which the other parameters can keep the
misfit, in units of the variance, within 1 or 3.84 of its minimum (profile likelihood: Raue et al. 2009, doi
10.1093/bioinformatics/btp358).  The misfit may have several valleys: a coarse scan of every parameter finds them, and
each side is then followed outwards from the outermost of them.  The parameters that were measured vary in all profiles;
their own intervals are those of the linear theory, since a measurement leaves little room for more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import compress
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy import stats

from sweep.grid import Array
from sweep.studies.concurrent import run_concurrently
from sweep.studies.misfit import Ask, Minimum, Note, Problem, minimise

LEVELS = {68: 1.0, 95: 3.84}
"""Percentages of the intervals, and rise of the misfit at their ends: quantiles of chi square for one parameter, hence
for errors that are known."""

# A direction is undetermined if its 95 % interval is longer than this share of the ranges.
_BLIND = 0.5

# Number of times intervals are computed again because a lower minimum has turned up.
_RESTARTS = 3

# Values at which a scan holds each parameter, as shares of its range and as deviations from the best.
_WIDE, _NARROW = np.linspace(0.08, 0.92, 6), np.array([-3.0, -1.5, 1.5, 3.0])

# Relative accuracies of the scan: first rough, then fine where the misfit has risen by fewer variances than `_HIGH`.
_ACCURACIES, _HIGH = (1e-2, 1e-5), 100.0

# Fall of the misfit, in units of the variance, with which a minimum is lower than the best.
_LOWER = 0.05

# Accuracy of a profile, in units of the variance.
_ENOUGH = 3e-3

# Correlation of two parameters above which neither is known without the other.
_TIED = 0.98


def variance(problem: Problem, best: Minimum) -> float:
    """Return the variance of the residuals: 1 if the film gives its errors."""
    if problem.film.error is not None:
        return 1.0
    return best.misfit / problem.freedom


def _rises(problem: Problem) -> list[float]:
    """Return the rise of the misfit at the ends of the intervals of `LEVELS`, in units of the variance.

    If the variance follows from the residuals, it is a quantile of Student's t, squared.
    """
    if problem.film.error is not None:
        return [*LEVELS.values()]
    return [float(each) for each in stats.f.isf(stats.chi2.sf([*LEVELS.values()], 1), 1, problem.freedom)]


class _Side(NamedTuple):
    """The profile of one parameter on one side of the best minimum."""

    ends: list[float]
    """Where it leaves the intervals of `LEVELS`."""
    valley: list[tuple[Array, float]]
    """Places, and how far their misfits exceed the minimum, in units of the variance."""
    lower: Minimum | None
    """A minimum that is lower than the best, if one is met."""


def intervals(
    problem: Problem, minima: Sequence[Minimum], note: Note, believed: Callable[[Minimum], bool] = lambda _: True
) -> tuple[Minimum, Array, bool]:
    """Return the best minimum, and the ends of the intervals of `LEVELS` as places, shape (levels, 2, free).

    `minima` are those of the search, the lowest first.  An end at 0 or 1 is an end of the range.  If a profile meets a
    lower minimum, the computation starts again from there.  If that happens more than once, the misfit is rugged, which
    is reported too.  The intervals of a minimum that is not `believed` are those of the linear theory, after a rough
    scan for a lower one.
    """
    best = minima[0]
    for restart in range(_RESTARTS + 1):
        limits, lower = _profiles(problem, best, minima, note, stops=restart < _RESTARTS, rough=not believed(best))
        if lower is None:
            break
        (best,) = run_concurrently([partial(minimise, place=lower.place)], problem.answers)
        note(f"a lower minimum: {best.misfit:.6g}")
    return best, limits, restart > 1


def _profiles(
    problem: Problem, best: Minimum, minima: Sequence[Minimum], note: Note, *, stops: bool, rough: bool
) -> tuple[Array, Minimum | None]:
    """Return the ends of all intervals, shape (levels, 2, free), or, with `stops`, a lower minimum if one is met."""
    unit, parameters = variance(problem, best), problem.unknown
    valleys = [*minima, *_scanned(problem, best, rough=rough)]
    lower = min(valleys, key=lambda each: each.misfit)
    if stops and lower.misfit < best.misfit - _LOWER * unit:
        return np.empty(0), lower
    deviations, rises = np.sqrt(np.outer([*LEVELS.values()], np.diag(covariance(problem, best)))), _rises(problem)
    low, high = np.clip([best.place - deviations, best.place + deviations], 0, 1)
    if rough:
        return np.stack([low, high], axis=1), None
    known = [(best.place, 0.0), *((each.place, (each.misfit - best.misfit) / unit) for each in valleys)]
    known = [(_on_side(problem, place, best), rise) for place, rise in known]
    sides = [
        partial(_side, problem=problem, best=best, known=known, i=i, sign=sign) for sign in (-1, 1) for i in parameters
    ]
    found = run_concurrently(sides, problem.answers, lambda side: stops and side.lower is not None)
    note(f"intervals: {problem.trajectories} trajectories so far")
    lowest = min((side.lower for side in found if side.lower), key=lambda each: each.misfit, default=None)
    if lowest and stops:
        return np.empty(0), lowest
    low[:, parameters], high[:, parameters] = np.reshape(
        [side.ends for side in found], (2, len(parameters), len(LEVELS))
    ).transpose(0, 2, 1)
    known += [(_on_side(problem, place, best), rise) for side in found for place, rise in side.valley]
    places, above = np.stack([place for place, _ in known]), np.array([rise for _, rise in known])
    for level, allowed in enumerate(rises):
        within = places[above <= allowed]
        low[level] = np.minimum(low[level], within.min(axis=0))
        high[level] = np.maximum(high[level], within.max(axis=0))
    return np.stack([np.minimum.accumulate(low), np.maximum.accumulate(high)], axis=1), None


def _on_side(problem: Problem, place: Array, best: Minimum) -> Array:
    """Return a place, turned by half a turn, which changes nothing, if that takes its start to the side of the best."""
    at, place = problem.mirrored, place.copy()
    if (place[at] - 0.5) @ (best.place[at] - 0.5) < 0:
        place[at] = 1 - place[at]
    return place


def _scanned(problem: Problem, best: Minimum, *, rough: bool) -> list[Minimum]:
    """Return minima, most of them with one parameter fixed, in valleys that walls of the misfit hide from a profile."""
    deviation, searches = np.sqrt(np.diag(covariance(problem, best))), list[tuple[int, Array]]()
    for i in problem.unknown:
        for end in np.clip([*_WIDE, *(best.place[i] + _NARROW * deviation[i])], 0, 1):
            searches.append((i, np.where(np.arange(len(problem.free)) == i, end, best.place)))
    found, unit = list[Minimum](), variance(problem, best)
    for enough in _ACCURACIES:
        found = _minimised(problem, [partial(minimise, place=at, fixed=[i], enough=enough) for i, at in searches])
        low = [each.misfit < best.misfit + _HIGH * unit for each in found]
        found = [*compress(found, low)]
        searches = [(i, each.place) for (i, _), each in zip(compress(searches, low), found, strict=True)]
        if rough:
            return found
    beyond = [each.place for each in found if each.misfit > best.misfit + _rises(problem)[-1] * unit]
    return found + _minimised(problem, [partial(minimise, place=at, enough=_ACCURACIES[-1]) for at in beyond])


def _minimised(problem: Problem, searches: list[Callable[[Ask], Minimum]]) -> list[Minimum]:
    return run_concurrently(searches, problem.answers) if searches else []


def _side(ask: Ask, problem: Problem, best: Minimum, known: list[tuple[Array, float]], i: int, sign: int) -> _Side:
    """Follow parameter `i` out of its intervals on one side, from the `known` places in the valleys of the misfit."""
    spread, unit = covariance(problem, best), variance(problem, best)
    size = np.sqrt(max(spread[i, i], 1e-30))
    along, reach, ends = spread[:, i] / size**2, float(size), list[float]()
    side, before = _Side(ends, [], None), 1.0
    for allowed in _rises(problem):
        reach, before = reach * sqrt(allowed / before), allowed
        near = max(sign * (place[i] - best.place[i]) for place, rise in known + side.valley if rise <= allowed)
        reach, far = max(reach, float(near + size / 2)), np.inf
        for _ in range(8):
            end = float(np.clip(best.place[i] + sign * reach, 0, 1))
            places = [place for place, rise in known + side.valley if rise < 10 * allowed]
            starts = _starts(places, best.place + along * (end - best.place[i]), i, end)
            start = min(starts, key=lambda each: float(np.sum(ask(each[None]) ** 2)))
            found = minimise(ask, start, [i], _ENOUGH / problem.rows)
            above = (found.misfit - best.misfit) / unit
            side.valley.append((found.place, above))
            if above < -_LOWER * allowed:
                side = side._replace(lower=found)
            if side.lower or (end in (0, 1) and above < allowed):
                break
            reach = abs(end - best.place[i])
            # A profile is nearly a parabola; where it is not, halve the interval.
            guess = reach * sqrt(allowed / max(above, 0.05 * allowed))
            if abs(above / allowed - 1) < 0.05:
                reach = guess
                break
            near, far = (reach, far) if above < allowed else (near, reach)
            reach = guess if near < guess < far else (near + far) / 2
        ends.append(float(np.clip(best.place[i] + sign * reach, 0, 1)))
        if side.lower:
            ends += ends[-1:] * (len(LEVELS) - len(ends))
            break
    return side


def _starts(valley: list[Array], straight: Array, i: int, end: float) -> list[Array]:
    """Return places from which to descend into a valley, which may be curved, with parameter `i` at `end`.

    They lie on the straight line of the linear theory, on the line through the two places of the `valley` nearest to
    the end, and at the nearest of them.
    """
    near = sorted(valley, key=lambda each: abs(each[i] - end))[:2]
    starts = [straight, near[0].copy()]
    if len(near) > 1 and near[0][i] != near[1][i]:
        starts.append(near[0] + (near[0] - near[1]) * (end - near[0][i]) / (near[0][i] - near[1][i]))
    starts = [np.clip(each, 0, 1) for each in starts]
    for each in starts:
        each[i] = end
    return starts


def covariance(problem: Problem, best: Minimum) -> Array:
    """Return the covariance of the places, from the Jacobian; unconstrained directions are as wide as their ranges."""
    sizes, directions = np.linalg.eigh(best.jacobian.T @ best.jacobian / variance(problem, best))
    return np.asarray((directions / np.maximum(sizes, 1.0)) @ directions.T)


def blind(problem: Problem, best: Minimum) -> list[str]:
    """Describe what the film does not determine, apart from parameters that were measured."""
    spread, names = covariance(problem, best), list(problem.free)
    sought = [names[i] for i in problem.unknown]
    sizes, directions = np.linalg.eigh(spread)
    sentences = []
    for size, direction in zip(sizes[::-1], directions.T[::-1], strict=True):
        if 4 * np.sqrt(size) > _BLIND:
            some = [name for name, part in zip(names, direction, strict=True) if abs(part) > 0.3 and name in sought]
            if not some:
                continue
            parameters = " and ".join(some) + (" together" if len(some) > 1 else "")
            words = "the 95 % interval covers half of the range or more"
            sentences.append(f"the film hardly determines {parameters}: {words}")
    deviation = np.sqrt(np.diag(spread))
    tied = spread / np.outer(deviation, deviation)
    sentences += [
        f"{names[i]} and {names[j]} are known only in combination: their correlation is {tied[i, j]:.3f}"
        for i, j in np.argwhere(np.tril(np.abs(tied), -1) > _TIED)
    ]
    return sentences
