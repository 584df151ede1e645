"""Computes how far trajectories are from a film, the sum of squares of (computed - seen) / error, and its minima.

Minima are sought from several places in parallel. A trajectory and its neighbours on both sides, which give the columns
of the Jacobian, take the same steps: the misfit is then as smooth as the motion, whereas adaptive steps would create
spurious minima (Creswell et al. 2024, doi 10.1098/rsif.2023.0369).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sweep.config import Config
from sweep.config.film import Film
from sweep.grid import Array
from sweep.interrupt import point
from sweep.kernels.methods import PLAIN, automatic_step
from sweep.kernels.samples import sampled
from sweep.models.model import take
from sweep.studies.ranges import Range, mirrored

UNKNOWNS = ("film_delay", "film_bias")
"""Parameters of the film that a fit may find besides those of the body, by the names that the option --free takes."""

# Half the distance between two columns of the Jacobian, as a share of a parameter's range. With 3e-6 the search in a
# film of seven reversals in 5 s, which amplify errors, ended at ten times the misfit.
_NEAR = 1e-4

# Tolerance of the steps: an error in spin at t = 400 that no film shows.
_TOLERANCE = 1e-6

# Places that round to the same multiples of this share of the ranges share the step of the first one.
_STEADY = 0.02

# If a body lifts off or a run diverges, every value is missed by this multiple of the largest one.
_LOST = 10.0

ENOUGH = 1e-9
"""Relative accuracy of the misfit and the place of a minimum."""

_MOST_STEPS, _FLAT = 50, 1e-14

# Damping of the first step, its limits, the factors tried at once, and the share of a step that shows its bend.
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING, _FACTORS, _PROBE = 1e-3, 1e-9, 1e6, (0.1, 1.0, 10.0), 0.1


class Minimum(NamedTuple):
    """A local minimum."""

    place: Array
    """The free parameters, as shares of their ranges, shape (free,)."""
    misfit: float
    jacobian: Array
    """Jacobian of the residuals with respect to the place, shape (instants and measured, free)."""
    away: Array
    """The residuals, shape (instants and measured,)."""


Ask = Callable[[Array], Array]
"""Returns the residuals, shape (cells, instants and measured), at places, shape (cells, free).

The places are so close together that their trajectories take the same steps.
"""


Note = Callable[[str], None]
"""Receives a message on the progress of a fit."""


@dataclass
class Problem:
    """A film, and the trajectories that should reproduce it."""

    config: Config
    film: Film
    free: Mapping[str, Range]
    """The ranges of the free parameters, including those of `UNKNOWNS`."""
    kept: Array
    """Mask of the instants that count, shape (instants,); outliers do not."""
    scale: float = 1.0
    """The standard deviation of a residual, which sets the weight of measured parameters."""
    trajectories: int = 0
    """Number of trajectories computed so far."""
    _steps: dict[tuple[float, ...], float] = field(default_factory=dict)
    """Steps by rounded places."""

    @property
    def rows(self) -> int:
        """Number of residuals that count."""
        return int(self.kept.sum()) + len(self.measured)

    @property
    def freedom(self) -> int:
        """Number of these less that of what is found, such as the direction from which a heading is counted."""
        return self.rows - len(self.free) - (self.film.what == "heading")

    @property
    def measured(self) -> list[int]:
        """Indices of the parameters that were measured independently."""
        return [i for i, each in enumerate(self.free.values()) if each.prior]

    @property
    def unknown(self) -> list[int]:
        """Indices of the other parameters."""
        return [i for i in range(len(self.free)) if i not in self.measured]

    @property
    def mirrored(self) -> list[int]:
        """Indices of the start point or tilt, whose signs half a turn reverses."""
        return [list(self.free).index(name) for name in mirrored(self.config, self.free)]

    def values(self, places: Array) -> Array:
        """Return the free parameters at places, of the same shape (..., free)."""
        return np.stack([each.values(places[..., i]) for i, each in enumerate(self.free.values())], axis=-1)

    def place(self, values: Array) -> Array:
        """Return the place of values, both of shape (free,)."""
        return np.array([each.place(value) for each, value in zip(self.free.values(), values, strict=True)])

    def columns(self, places: Array) -> dict[str, Array]:
        """Return all parameters of the bodies at places of shape (cells, free)."""
        fixed = {name: np.full(len(places), v.numbers[0]) for name, v in self.config.parameters.items()}
        free = {name: values for name, values in self._found(places).items() if name not in UNKNOWNS}
        return self.config.assembly.body(fixed | free)

    def _found(self, places: Array) -> dict[str, Array]:
        """Return the free parameters at places of shape (cells, free), by name."""
        return {name: np.ascontiguousarray(each) for name, each in zip(self.free, self.values(places).T, strict=True)}

    def steps(self, places: Array) -> Array:
        """Return a step for each trajectory of a search, shape (cells,): infinite for a body that cannot be."""
        model, columns = self.config.equations, self.columns(places)
        found, possible = np.full(len(places), np.inf), np.flatnonzero(~model.impossible(columns))
        if len(possible):
            columns = take(columns, possible)
            found[possible] = automatic_step(PLAIN, model, columns, _TOLERANCE)[0]
        return found

    def curves(self, places: Array, times: Array, steps: Array | None = None) -> Array:
        """Return what a film of the trajectories at `places` would show, shape (cells, times); NaN for lost ones.

        Without `steps`, of shape (cells,), each trajectory takes its automatic step.
        """
        model, columns, found = self.config.equations, self.columns(places), self._found(places)
        self.trajectories += len(places)
        curves, possible = np.full((len(places), len(times)), np.nan), np.flatnonzero(~model.impossible(columns))
        columns, found = (take(each, possible) for each in (columns, found))
        steps = automatic_step(PLAIN, model, columns)[0] if steps is None else steps[possible]
        longest = self.free["film_delay"].high if "film_delay" in self.free else 0.0
        shown = sampled(model, columns, steps, times, self.film.what, found.get("film_delay"), longest)
        shown[np.isnan(shown).any(axis=1)] = np.nan
        curves[possible] = shown + found.get("film_bias", np.zeros(len(possible)))[:, None]
        point()
        return curves

    def residuals(self, places: Array, instants: int | None = None, steps: Array | None = None) -> Array:
        """Return (computed - seen) / error at all or the first `instants` of the film, shape (cells, instants).

        It is zero for outliers.
        """
        seen, error, kept = self.film.value[:instants], self.film.errors[:instants], self.kept[:instants]
        away = self.curves(places, self.film.time[:instants], steps) - seen
        if self.film.what == "heading":  # a film does not show where a heading is counted from
            away -= np.average(away, axis=1, weights=kept * error**-2.0)[:, None]
        return np.where(np.isnan(away), _LOST * np.abs(seen[kept]).max(), away) / error * kept

    def _off_measured(self, places: Array) -> Array:
        """Return the deviations of parameters from their measured values, in errors, shape (cells, measured)."""
        known = [(self.values(places)[:, i], [*self.free.values()][i].prior) for i in self.measured]
        found = [(value - prior[0]) / prior[1] for value, prior in known if prior]
        return self.scale * np.reshape(found, (len(found), len(places))).T

    def answers(self, places: Sequence[Array], instants: int | None = None) -> Iterator[Array]:
        """Return the residuals that searches `Ask` for: of the film and, after these, of independent measurements."""
        cells = np.concatenate(places)
        steps = [np.full(len(each), step) for each, step in zip(places, self._steps_of(places), strict=True)]
        found = self.residuals(cells, instants, np.concatenate(steps))
        found = np.concatenate([found, self._off_measured(cells)], axis=1)
        return iter(np.split(found, np.cumsum([len(each) for each in places[:-1]])))

    def _steps_of(self, places: Sequence[Array]) -> list[float]:
        """Return for each of the `places` the automatic step of the first there, or of the first ever close to it."""
        keys = [tuple(np.round(each[0] / _STEADY).tolist()) for each in places]
        new = {key: each[0] for key, each in zip(keys, places, strict=True) if np.isinf(self._steps.get(key, np.inf))}
        if new:  # together, since one alone takes as long
            self._steps |= zip(new, self.steps(np.stack([*new.values()])).tolist(), strict=True)
        return [self._steps[key] for key in keys]


def minimise(ask: Ask, place: Array, fixed: Sequence[int] = (), enough: float = ENOUGH) -> Minimum:
    """Find the minimum near a place, over all parameters except the `fixed` ones, whose columns of the Jacobian are 0.

    The search ends when a step changes the misfit by less than the share `enough`.  It is Levenberg and Marquardt's,
    and its steps bend as valleys do (geodesic acceleration: Transtrum and Sethna 2012, arXiv:1201.5885).
    """
    here, damping, size = place.copy(), _DAMPING, np.zeros(len(place))
    varied = np.delete(np.arange(len(place)), list(fixed))
    away, jacobian = _look(ask, here, varied, enough)
    for _ in range(_MOST_STEPS):
        misfit, slope = away @ away, jacobian.T @ away
        closed = ((here <= 0) & (slope > 0)) | ((here >= 1) & (slope < 0))
        moved = varied[~closed[varied]]
        columns, size = jacobian[:, moved], np.maximum(size, np.linalg.norm(jacobian, axis=0))
        factors = damping * np.array(_FACTORS)
        scaled = factors[:, None, None] * np.diag(np.maximum(size[moved], _FLAT) ** 2)
        inverse = np.linalg.inv(columns.T @ columns + scaled) @ columns.T
        straight = -inverse @ away
        if not len(moved) or np.max(-straight @ slope[moved]) < enough * misfit / 2:
            break
        probed = ask(_moved(here, moved, np.concatenate([0 * straight[:1], _PROBE * straight])))
        second = 2 / _PROBE**2 * (probed[1:] - probed[0] - _PROBE * straight @ columns.T)
        bent = -np.einsum("kij,kj->ki", inverse, second) / 2
        bent[2 * np.linalg.norm(bent * size[moved], axis=1) > np.linalg.norm(straight * size[moved], axis=1)] = 0
        tried = _moved(here, moved, straight + bent)
        misfits = np.sum(ask(tried) ** 2, axis=1)
        best = int(np.argmin(misfits))
        if misfits[best] < misfit:
            here, damping = tried[best], max(factors[best], _LEAST_DAMPING)
            away, jacobian = _look(ask, here, varied, enough)
        else:
            damping = factors[-1] * _FACTORS[-1]
        if misfits[best] < misfit < misfits[best] * (1 + enough) or damping > _MOST_DAMPING:
            break
    return Minimum(here, float(away @ away), jacobian, away)


def _look(ask: Ask, place: Array, varied: Array, enough: float) -> tuple[Array, Array]:
    """Return the residuals at a place and their Jacobian, from one side unless the minimum is to be accurate."""
    steps, both = _NEAR * np.eye(len(place))[varied], enough <= ENOUGH
    found = ask(np.concatenate([place[None], place + steps, *([place - steps] if both else [])]))
    ahead, behind = found[1 : 1 + len(steps)], found[1 + len(steps) :] if both else found[:1]
    jacobian = np.zeros((found.shape[1], len(place)))
    jacobian[:, varied] = (ahead - behind).T / (_NEAR * (1 + both))
    return found[0], jacobian


def _moved(place: Array, moved: Array, steps: Array) -> Array:
    """Return a place with some of its parameters `moved` by several steps, within the ranges."""
    found = np.tile(place, (len(steps), 1))
    found[:, moved] += steps
    return np.asarray(np.clip(found, 0, 1))
