"""Tries which one change of film, body or law would make a fit better: all if it is doubtful, else sign and law.

Each change is a fit of its own, from fewer points and without intervals.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from math import degrees, prod, radians, sqrt

import numpy as np

from sweep.config import Config, load_config
from sweep.config.film import Film
from sweep.faults import InputError, either
from sweep.grid import BODY
from sweep.models.general.laws import LAWS, Law
from sweep.studies import ranges, search, verdict
from sweep.studies.misfit import Minimum, Note, Problem
from sweep.units import ANGLE, SPIN, named, pretty

_POINTS, _KEPT = 64, 2
"""Numbers of points all over the ranges and of best points to continue from."""

_SIZES = 1.7
"""Factor by which a size may be wrong."""

_RATES = (1 / 8, 1 / 4, 1 / 2, 24 / 30, 25 / 30, 30 / 25, 30 / 24, 2, 4, 8)
"""Ratios of usual frame rates."""

_LAWS = ("viscous", "coulomb")
_LATE, _EARLY = (1 / 8, 1 / 4), (1 / 2, 3 / 4)
"""Shares of the film before or after which rows may show a hand."""

_LESS, _ROOM = 0.8, 1.3
"""Share of the misfit below which a change is worth naming, and factor by which outliers may raise one."""

SURE = 14.0
"""Fall of Akaike's criterion above which a change is so much more likely, 1000 to 1, that a fit cannot be trusted."""


_ALWAYS = ("the sign", "the law")
"""Changes that are tried for every fit: start and sizes can make up for a wrong law until residuals look like noise."""


@dataclass(frozen=True)
class _Change:
    """A change, and the problem that it leads to."""

    kind: str
    words: str
    problem: Problem
    scale: float = 1.0
    """Factor by which the values of the film are larger."""
    shows: str = ""
    """The parameter whose value the change is about."""


def advised(
    config: Config, posed: Problem, free: Sequence[str], problem: Problem, best: Minimum, judged: verdict.Verdict,
    note: Note, *, compared: bool,
) -> tuple[str, float]:  # fmt: skip
    """Try changes one at a time; say which of them is most likely, and by how much it lowers Akaike's criterion.

    `posed` is the problem that led to the `best` minimum of `problem`, which was `judged`; `compared` says whether laws
    are compared.
    """
    before, kinds, film = _size(problem, best), list[str](), posed.film

    def silent(_: str) -> None: ...

    def criterion(problem: Problem, size: float) -> float:
        return 2 * (len(film.time) * float(np.log(max(size, 1e-300))) + len(problem.unknown))

    tried: list[tuple[bool, int, int, float, float, str]] = []
    for changes in (_changes(config, posed, free, compared=compared), _cuts(posed)):
        trials = [
            (change, search.searched(change.problem, _POINTS, _KEPT, silent))
            for change in changes
            if judged.doubtful or change.kind in _ALWAYS
        ]
        kinds += dict.fromkeys(change.kind for change, _ in trials)
        queue = [(0.0, k) for k in range(len(trials))]
        while queue:  # the change that fits best so far goes on first: the right one, and most of the others need not
            _, k = heappop(queue)
            change, parts = trials[k]
            instants, minima = next(parts)
            least = min([before, *(each[4] for each in tried)]) * change.scale / np.median(film.errors)
            if minima[0].misfit > (_ROOM * least) ** 2 * change.problem.rows:
                continue
            if instants < len(change.problem.film.time):
                heappush(queue, (minima[0].misfit / change.scale**2 / instants, k))
                continue
            calm, minima = search.settled(change.problem, minima, silent)
            fits, size = verdict.judged(calm, minima[0]).fits, _size(calm, minima[0]) / change.scale
            note(f"{change.words}: misfit {size:.3g}, where it was {before:.3g}")
            words = change.words + _value(change.shows, calm, minima[0])
            likely = criterion(calm, size)  # rounded: of changes that are equally likely, the first is named
            tried.append((not fits, round(likely), k, likely, size, words))
        if judged.fits or not all(each[0] for each in tried):  # a cut leaves too few rows to compare their noise
            break
    usual = criterion(problem, before)
    off, _, _, least, size, words = min(tried, default=(True, 0, 0, usual, before, ""))
    unit = pretty(named(ANGLE if film.what == "heading" else SPIN, config.units))
    fall = f"which reduces the misfit from {before:.2g} to {size:.2g} {unit}"
    if size > _LESS * before and off:
        return f"No single change makes it much better; tried were {either(kinds).replace(' or ', ' and ')}.", 0.0
    return f"Change one thing: {words}, {fall}{'; the curve then fits' * (not off)}.", usual - least


def _size(problem: Problem, best: Minimum) -> float:
    """Return the root mean square of the residuals, including those of measured parameters."""
    return float(np.sqrt(best.misfit / problem.rows) * np.median(problem.film.errors))


def _value(name: str, problem: Problem, best: Minimum) -> str:
    """Return the value of a parameter with its unit, to add to a change."""
    if not name:
        return ""
    value = problem.values(best.place)[[*problem.free].index(name)]
    return f" = {value:.3g}{verdict.unit_after(problem.config, name)}"


def _changes(config: Config, posed: Problem, free: Sequence[str], *, compared: bool) -> Iterator[_Change]:
    """Make the changes that leave all rows of the film."""
    film, per = posed.film, "" if posed.film.what == "heading" else "/s"
    films = [
        ("the unit", f"read the film in deg{per}", _scaled(film, radians(1)), radians(1)),
        ("the unit", f"read the film in rad{per}, not in deg{per}", _scaled(film, degrees(1)), degrees(1)),
        ("the sign", "reverse the sign of the film", _scaled(film, -1.0), 1.0),
    ]  # fmt: skip
    for kind, words, other, scale in films:
        yield from _posed(kind, words, config, other, free, scale)
    for name, each in ranges.of_film(film).items():
        if name not in free:
            yield _ranged(name, f"let {name} be free", posed, name, each)
    for name, each in posed.free.items():
        if each.given:
            wider = replace(each, given=False).widened(up=True).widened(up=False)
            yield _ranged(f"the range of {name}", f"widen the range of {name}", posed, name, wider)
    if config.model == "slip" and not (compared or config.origin):
        for law in [LAWS[name] for name in _LAWS if name != config.law]:
            other_law, own = with_law(config, law)
            names = [name for name in (*free, *own) if name in other_law.tier.parameters or name not in config.table]
            yield from _posed("the law", f"take law: {law.name}", other_law, film, [*dict.fromkeys(names)])
    measured = [*config.distributions] or [name for name in BODY if name != "gravity" and name in config.parameters]
    for name in measured:
        value = posed.config.parameters[name].numbers[0]
        if value and name not in free:
            wider = ranges.Range.even(value / _SIZES, value * _SIZES)
            yield _ranged(name, f"correct {name}", posed, name, wider)
    for rate in _RATES:
        words = f"multiply the times of the film by {rate:.3g} (another frame rate)"
        yield from _posed("the frame rate", words, config, replace(film, time=film.time * rate), free)


def _ranged(kind: str, words: str, posed: Problem, name: str, within: ranges.Range) -> _Change:
    """Make the change that seeks a parameter in another range."""
    return _Change(kind, words, replace(posed, free={**posed.free, name: within}, _steps={}), shows=name)


def _cuts(posed: Problem) -> Iterator[_Change]:
    """Make the changes that leave out rows at one end of the film."""
    film, last = posed.film, posed.film.time[-1]
    for share, words in [(each, "before") for each in _LATE] + [(each, "after") for each in _EARLY]:
        kept = film.time >= share * last if words == "before" else film.time <= share * last
        error = None if film.error is None else film.error[kept]
        cut = replace(film, time=film.time[kept] - film.time[kept][0], value=film.value[kept], error=error)
        if len(cut.time) > len(posed.free):
            problem = replace(posed, film=cut, kept=posed.kept[kept], _steps={})
            yield _Change("a cut", f"leave out the rows {words} {share * last:.3g}", problem)


def _posed(
    kind: str, words: str, config: Config, film: Film, free: Sequence[str], scale: float = 1.0
) -> Iterator[_Change]:
    """Make a change of the film or the law, unless it cannot be followed."""
    with suppress(InputError):
        problem = search.posed(config, film, free)
        search.check_length(problem)
        yield _Change(kind, words, problem, scale)


def _scaled(film: Film, by: float) -> Film:
    return replace(film, value=film.value * by, error=None if film.error is None else film.error * abs(by))


def left_open(config: Config) -> list[str]:
    """Return the speed of a dry law if the configuration does not give it: a ruler does not show it."""
    given = config.source.values.get("friction", {}) if config.source else config.parameters
    return ["speed"] if "speed" in config.parameters and "speed" not in given else []


def with_law(config: Config, law: Law) -> tuple[Config, list[str]]:
    """Return `config` with another law, and the parameters of the law that it does not give, which are free.

    A coefficient of dry friction says nothing about a viscous one, and vice versa.
    """
    document, before = config.document(), LAWS[config.law]
    kept = {key: document[key] for key in document if key not in ("integrator", "measure")}
    owned = {name for each in LAWS.values() for name in each.parameters}
    given = {name: value for name, value in document.get("friction", {}).items() if name not in left_open(config)}
    friction = {name: value for name, value in given.items() if name not in {*owned, "law"}} | {"law": law.name}
    said = [name for name in law.parameters if name in given and (name in law.pure) == (name in before.pure)]
    friction |= {name: given[name] for name in said}
    own = [
        name for name in law.parameters if name not in said and (name == "speed" or config.table[name].default is None)
    ]
    friction |= {name: sqrt(prod(ranges.wide(config, law)[name])) for name in own}
    return load_config({**kept, "friction": friction, "integrator": {"t_end": config.integrator.t_end}}), own
