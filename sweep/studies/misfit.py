"""How far trajectories are from a film: the misfit, a sum of squares of (computed - seen) / error, and its minima.

SciPy minimises, from several places side by side.  A trajectory and its neighbours on both sides, the columns of the
Jacobian, take the same steps: the misfit is as smooth as the motion, where steps that adapt would leave minima of their
own (Creswell et al. 2024, doi 10.1098/rsif.2023.0369).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from sweep.config import Config
from sweep.config.film import Film
from sweep.grid import Array
from sweep.interrupt import point
from sweep.kernels.methods import PLAIN, automatic_step
from sweep.kernels.samples import sampled

UNKNOWNS = ("film_delay", "film_bias")
"""What a fit may find of a film besides the parameters of the body, by the names that the option --free takes."""

# Half the distance of two columns of the Jacobian, as a share of a parameter's range.  With 3e-6 the search in a film
# of seven reversals in 5 s, which amplify errors, ended at ten times the misfit.
_NEAR = 1e-4

# Places that round to the same multiples of this share of the ranges have the same step: that of the first one.
_STEADY = 0.02

# A body that lifts off, or a run that diverges, misses every value by this many times the largest one.
_LOST = 10.0

# A minimum is found when a step changes misfit or place by less than a share, or there is no slope; and the most steps.
_ENOUGH, _FLAT, _MOST_STEPS = 1e-9, 1e-14, 50


class Minimum(NamedTuple):
    """A local minimum."""

    place: Array
    """The free parameters, as shares of their ranges, shape (free,)."""
    misfit: float
    jacobian: Array
    """Of the residuals with respect to the place, shape (instants, free)."""


Ask = Callable[[Array], Array]
"""Tells the residuals, shape (cells, instants), at places, shape (cells, free).

These are so close together that their trajectories take the same steps."""


@dataclass
class Problem:
    """A film, and the trajectories that are to reproduce it."""

    config: Config
    film: Film
    free: Mapping[str, tuple[float, float]]
    """The free parameters, those of `UNKNOWNS` too, and the ends of the ranges in which they are sought."""
    trajectories: int = 0
    """How many were computed."""
    _steps: dict[tuple[float, ...], float] = field(default_factory=dict)
    """Steps by rounded places."""

    def __post_init__(self) -> None:
        self.low, self.high = (np.array(ends) for ends in zip(*self.free.values(), strict=True))
        self.ratio = self.low > 0
        """Where a range of positive numbers is divided evenly in its logarithm."""

    def values(self, places: Array) -> Array:
        """The free parameters at places, of the same shape (..., free)."""
        low, high = (np.where(self.ratio, np.log(np.where(self.ratio, end, 1)), end) for end in (self.low, self.high))
        found = low + (high - low) * places
        return np.where(self.ratio, np.exp(np.where(self.ratio, found, 0)), found)

    def columns(self, places: Array) -> dict[str, Array]:
        """All parameters of the bodies at places of shape (cells, free)."""
        fixed = {name: np.full(len(places), v.numbers[0]) for name, v in self.config.parameters.items()}
        return fixed | {name: values for name, values in self._found(places).items() if name not in UNKNOWNS}

    def _found(self, places: Array) -> dict[str, Array]:
        """The free parameters at places of shape (cells, free), by name."""
        return {name: np.ascontiguousarray(each) for name, each in zip(self.free, self.values(places).T, strict=True)}

    def curves(self, places: Array, times: Array, steps: Array | None = None) -> Array:
        """What a film shows of the trajectories at `places`, shape (cells, times); NaN for one that is lost.

        Without `steps`, of shape (cells,), each takes its automatic one.
        """
        model, columns, found = self.config.equations, self.columns(places), self._found(places)
        self.trajectories += len(places)
        curves, possible = np.full((len(places), len(times)), np.nan), np.flatnonzero(~model.impossible(columns))
        columns, found = ({name: v[possible] for name, v in each.items()} for each in (columns, found))
        steps = automatic_step(PLAIN, model, columns)[0] if steps is None else steps[possible]
        longest = self.free.get("film_delay", (0.0, 0.0))[1]
        shown = sampled(model, columns, steps, times, self.film.what, found.get("film_delay"), longest)
        shown[np.isnan(shown).any(axis=1)] = np.nan
        curves[possible] = shown + found.get("film_bias", np.zeros(len(possible)))[:, None]
        point()
        return curves

    def residuals(self, places: Array, instants: int | None = None, steps: Array | None = None) -> Array:
        """(computed - seen) / error at all or the first `instants` of the film, shape (cells, instants)."""
        seen, error = self.film.value[:instants], self.film.errors[:instants]
        away = self.curves(places, self.film.time[:instants], steps) - seen
        if self.film.what == "heading":  # no film tells where a heading counts from
            away -= np.average(away, axis=1, weights=error**-2.0)[:, None]
        return np.where(np.isnan(away), _LOST * np.abs(seen).max(), away) / error

    def answers(self, places: Sequence[Array], instants: int | None = None) -> Iterator[Array]:
        """The residuals that searches `Ask` for."""
        steps = [np.full(len(each), self._step(each)) for each in places]
        found = self.residuals(np.concatenate(places), instants, np.concatenate(steps))
        return iter(np.split(found, np.cumsum([len(each) for each in places[:-1]])))

    def _step(self, places: Array) -> float:
        """The least automatic step of bodies close together, or of the first that were as close: it takes 5 ms."""
        key = tuple(np.round(places[0] / _STEADY).tolist())
        if np.isinf(self._steps.get(key, np.inf)):
            model, columns = self.config.equations, self.columns(places)
            possible = ~model.impossible(columns)
            columns = {name: values[possible] for name, values in columns.items()}
            self._steps[key] = float(automatic_step(PLAIN, model, columns)[0].min(initial=np.inf))
        return self._steps[key]


def minimise(ask: Ask, place: Array, fixed: int | None = None) -> Minimum:
    """The minimum near a place, over all parameters but the `fixed` one."""
    moved = np.array([i for i in range(len(place)) if i != fixed], int)
    known: dict[bytes, tuple[Array, Array]] = {}

    def look(some: Array) -> tuple[Array, Array]:
        if (key := some.tobytes()) not in known:
            known.clear()
            at = place.copy()
            at[moved] = some
            steps = _NEAR * np.eye(len(place))
            found = ask(np.concatenate([at[None], at + steps, at - steps]))
            ahead, behind = found[1 : len(place) + 1], found[len(place) + 1 :]
            known[key] = found[0], (ahead - behind).T / (2 * _NEAR)
        return known[key]

    if not len(moved):
        away, jacobian = look(place[moved])
        return Minimum(place, float(np.sum(away**2)), jacobian)
    inside = np.clip(place[moved], 1e-9, 1 - 1e-9)
    found = least_squares(
        lambda some: look(some)[0], inside, lambda some: look(some)[1][:, moved], bounds=(0, 1), x_scale="jac",
        max_nfev=_MOST_STEPS, ftol=_ENOUGH, xtol=_ENOUGH, gtol=_FLAT,
    )  # fmt: skip
    end = place.copy()
    end[moved] = found.x
    return Minimum(end, float(2 * found.cost), look(found.x)[1])
