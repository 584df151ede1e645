"""Searches for the minima of the misfit between a film and the trajectories of a body.

The misfit has many minima: a trajectory with one more reversal is a different minimum. The search therefore starts from
points all over the ranges (Sobol), and fits the beginning of the film first, then half as much again, and so on. If the
curve that it finds does not fit, the search is repeated from more points, and measured parameters, which may have made
up for a wrong start, vary only over the whole film.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial
from math import ceil, sqrt

import numpy as np
from scipy import stats
from scipy.stats import qmc

from sweep.config import Config, Values
from sweep.config.cross_checks import misplaced, unlike
from sweep.config.film import Film
from sweep.faults import brief, counted, fault_of, suggestion
from sweep.grid import BODY, Array
from sweep.studies import ranges, verdict
from sweep.studies.concurrent import run_concurrently
from sweep.studies.intervals import variance
from sweep.studies.misfit import ENOUGH, Minimum, Note, Problem, minimise
from sweep.studies.study import require_simulated

SEARCHES = ((256, 6, False), (1024, 8, True))
"""Numbers of points all over the ranges and of best points to continue from, and whether measured parameters are held;
the second if the first search finds no fit."""

# Minima whose parameters differ by less than this share of their ranges are merged.
_SAME = 0.01

# Factor by which the part of the film that the search sees grows each time, beginning with its first twelfth. Of the
# films of turning bodies that were fitted from one reversal to the next, three were missed; doubling missed two, and
# 1.3 was no better than 1.5.
_LONGER, _HORIZONS = 1.5, 7

# Accuracy of minima until a fit is believed.
_ROUGHLY = 1e-4

# Number of times outliers are sought and ranges widened: where the misfit would fall by half a variance within another
# tenth of the range. The weight of measured parameters need be no more accurate than `_STEADY`.
_ROUNDS, _WIDENED, _STEADY = 4, (0.1, 0.5), 0.01

_MOST_STEPS = 1e6
"""Largest median number of steps per trajectory. Random films take 3,000 to 30,000, and a million or more if degrees
are taken for radians."""


def posed(config: Config, film: Film, free: Sequence[str]) -> Problem:
    """Return the problem of fitting these parameters and those that were measured.

    Raises
    ------
    InputError
        if the film or a parameter cannot be used.
    """
    if not np.isfinite([film.time, film.value, film.errors]).all():
        raise fault_of("holds a value that is not a number; leave out that instant", "film")
    theirs, known = ranges.of_film(film), config.distributions
    config = _one_body(config, free, theirs)
    if reason := unlike(config, film):
        raise fault_of(reason, "film")
    sought = {
        name: theirs.get(name) or (ranges.measured(config.table[name], known[name]) if name in known
                                   else ranges.of_parameter(config, film, name))
        for name in dict.fromkeys([*free, *known])
    }  # fmt: skip
    if len(sought) + (film.what == "heading") >= len(film.time):
        raise fault_of(f"{len(sought)} parameters, and the film has {len(film.time)} rows; free fewer", "free")
    ends = {n: Values((r.low, r.high), True, [r.low, r.high]) for n, r in sought.items() if n in (*BODY, "x0", "y0")}
    if off := misplaced(replace(config, parameters=config.parameters | ends)):
        raise config.error("x0", f"the range of a free parameter is too wide: {off}")
    return Problem(config, film, sought, _countable(film), _noise(film))


def _noise(film: Film) -> float:
    """Return the standard deviation of a residual, as far as it can be known before a fit."""
    spread = stats.median_abs_deviation(np.diff(film.value, 3), scale="normal") / sqrt(20)
    return 1.0 if film.error is not None or not spread else float(spread)


def _countable(film: Film) -> Array:
    """Return the instants that count before anything is known."""
    return np.ones(len(film.time), bool) if film.what == "heading" else verdict.gross(film.value)


def _one_body(config: Config, free: Sequence[str], of_film: Collection[str]) -> Config:
    """Return `config` if it describes one body, apart from the `free` parameters; raise an `InputError` otherwise.

    `of_film` holds the names of the free parameters of the film itself.
    """
    require_simulated(config)
    config = config.at_medians
    known = (*config.tier.parameters, *of_film)
    if not free:
        raise fault_of(f"name at least one parameter, out of {', '.join(known)}", "free")
    for name in free:
        if name not in known:
            message = f"{brief(name)} is not a parameter of the {config.tier.name} model{suggestion(name, known)}"
            raise fault_of(f"{message}; these can be free: {', '.join(known)}", "free")
    if config.cases:
        raise config.error(("cases",), "cannot be fitted; a fit takes a single body")
    if more := [name for name in config.axes if name not in free]:
        raise config.error(more[0], "has several values; make it free, or give one value")
    return config


def check_length(problem: Problem) -> None:
    """Raise an `InputError` if a fit would take hours, as it does for a film whose unit is wrong."""
    film, places = problem.film, qmc.Sobol(len(problem.free), rng=0).random(64)
    usual = float(np.median(film.time[-1] / problem.steps(places)))
    if usual > _MOST_STEPS:
        raise fault_of(
            f"a trajectory over it takes {float(f'{usual:.1g}'):,.0f} steps, and a fit needs thousands of "
            f"trajectories; check the units of the film, which shows up to {np.abs(film.value).max():.3g} and lasts "
            f"{film.time[-1]:.3g}, and those of the body", "film",
        )  # fmt: skip


def found(problem: Problem, note: Note) -> tuple[Problem, list[Minimum]]:
    """Return the minima over the whole film, lowest first, and the problem with the final ranges and outliers."""
    tried: list[tuple[Problem, list[Minimum], bool]] = []
    for points, kept, hold in SEARCHES:
        *_, (_, minima) = searched(problem, points, kept, note, hold=hold)
        calm, minima = settled(problem, minima, note)
        fits = verdict.judged(calm, minima[0]).fits
        tried.append((calm, minima, fits))
        # A wider range may have led into a corner far from the minimum.
        if calm.free == problem.free and fits:
            break
    problem, minima, fits = min(tried, key=lambda each: each[1][0].misfit)
    if fits:
        # Slopes at the ends of ranges are exact only now: by rough ones, a range was not widened that is too narrow.
        minima = _minimised(problem, [each.place for each in minima], enough=ENOUGH)
        problem, minima = settled(problem, minima, note, ENOUGH)
    return problem, _different(turned(problem, minima))


def turned(problem: Problem, minima: list[Minimum]) -> list[Minimum]:
    """Turn minima by half a turn where that changes nothing: the best to the configured start, the others to it."""
    if not (at := problem.mirrored):
        return minima
    toward = np.full(2, 0.5)
    toward[0] += problem.config.parameters[list(problem.free)[at[0]]].numbers[0] or 1.0
    found: list[Minimum] = []
    for each in minima:
        if (each.place[at] - 0.5) @ (toward - 0.5) < 0:
            place, jacobian = each.place.copy(), each.jacobian.copy()
            place[at], jacobian[:, at] = 1 - place[at], -jacobian[:, at]
            each = each._replace(place=place, jacobian=jacobian)
        found.append(each)
        toward = found[0].place[at]
    return found


def searched(
    problem: Problem, points: int, kept: int, note: Note, *, hold: bool = False
) -> Iterator[tuple[int, list[Minimum]]]:
    """Yield minima over more and more instants, and their number: over the whole film last.

    With `hold`, measured parameters vary only over the whole film.
    """
    sobol, rows = qmc.Sobol(len(problem.free), rng=int(hold)).random(points), len(problem.film.time)
    known = problem.measured if hold else []
    centre = np.array([each.place(each.prior[0]) if each.prior else 0.5 for each in problem.free.values()])
    sobol[:, known] = centre[known]
    horizons = [ceil(rows / _LONGER**k) for k in range(_HORIZONS - 1, -1, -1)]
    cost = np.sum(problem.residuals(sobol, horizons[0]) ** 2, axis=1)
    places = [centre, *sobol[np.argsort(cost)[:kept]]]
    for number, instants in enumerate(horizons, start=1):
        minima = _minimised(problem, places, instants, fixed=known if instants < rows else ())
        note(f"film up to {problem.film.time[instants - 1]:.4g}, {number} of {len(horizons)}: minima: {len(minima)}")
        places = [each.place for each in minima]
        yield instants, minima


def _minimised(
    problem: Problem, places: Sequence[Array], instants: int | None = None, enough: float = _ROUGHLY,
    fixed: Sequence[int] = (),
) -> list[Minimum]:  # fmt: skip
    """Return the minima near these places, lowest first, over the film or its first instants."""
    answers = partial(problem.answers, instants=instants)
    searches = [partial(minimise, place=place, fixed=fixed, enough=enough) for place in places]
    return _different(run_concurrently(searches, answers))


def settled(
    problem: Problem, minima: list[Minimum], note: Note, enough: float = _ROUGHLY
) -> tuple[Problem, list[Minimum]]:
    """Return the minima after leaving out outliers and widening ranges at whose ends the best minimum lies."""
    for _ in range(_ROUNDS):
        best = minima[0]
        kept = verdict.outliers(problem, best)
        sides = verdict.pressed(problem, best, *_WIDENED)
        free = {name: r.widened(up=sides[name] > 0) if name in sides else r for name, r in problem.free.items()}
        scale = np.sqrt(variance(problem, best))
        steady = not problem.measured or abs(scale / problem.scale - 1) < _STEADY
        if free == problem.free and (kept == problem.kept).all() and steady:
            break
        if (off := int((~kept).sum())) and (kept != problem.kept).any():
            note(f"{counted(off, 'outlier')} left out")
        if wider := [name for name in free if free[name] != problem.free[name]]:
            note(f"wider ranges: {', '.join(wider)}")
        new = replace(problem, free=free, kept=kept, scale=scale, _steps={})
        minima = _minimised(new, [new.place(problem.values(each.place)) for each in minima], enough=enough)
        problem = new
    return problem, minima


def _different(minima: list[Minimum]) -> list[Minimum]:
    """Return the distinct minima, lowest first."""
    found: list[Minimum] = []
    for each in sorted(minima, key=lambda each: each.misfit):
        if all(np.max(np.abs(each.place - other.place)) > _SAME for other in found):
            found.append(each)
    return found
