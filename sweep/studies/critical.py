"""Find critical spins by the paper's formulas, by the model's eigenvalues, and n_c2 by simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np
import xarray as xr

from sweep.config import Config, Values
from sweep.engine.estimate import estimate
from sweep.grid import Array
from sweep.kernels.status import SETTLED
from sweep.models.model import Columns
from sweep.models.theory.stability import SPIN_LIMIT
from sweep.parameters import START
from sweep.prediction import Prediction, predict
from sweep.results import dataset
from sweep.results.dataset import Reason
from sweep.results.margins import Counts
from sweep.results.store import Store
from sweep.studies import WIDTHS
from sweep.studies.roots import CLOSER, Root
from sweep.studies.study import Search, Task, measuring, require_between, require_certain

RATIO = 1.25
"""Ratio of successive spins in the outward search."""

# Number of spins simulated at once in the outward search.
_OUTWARDS = 5

_A_SPIN = 4
"""Typical number of simulations that narrow a bracket to the usual width."""

# The search ends at this multiple of n_c1. The paper's n_c2 is 2 n_c1; over 200 bodies (a = 1.5 … 50, |δ| <= 0.5, μ =
# 0.1 … 5000) it was found at up to 7.7 n_c1, with a median of 2.01. Beyond that, fast spins take long to simulate, and
# the body topples or leaves the plane instead: of 40 bodies searched up to a spin of 10, none reversed there.
_FARTHEST = 8.0


def critical(config: Config, width: float) -> Task:
    """Arguments of `sweep.api.critical`."""
    require_between("bracket", width, WIDTHS)
    words = f"width of the brackets: {width!r}"
    return Task(searchable(config), "critical", words, partial(CriticalSpins, width=width))


def searchable(config: Config) -> Config:
    """Return `config` with a single start spin, which has no influence; raise an `InputError` if it is unsuitable."""
    require_certain(config)
    if not config.of_rattlebacks:
        raise config.error(("model",), "not a rattleback; choose the model slip or noslip")
    if beyond := sorted((START - {"n0"}) & set(config.axes)):
        raise config.error(beyond[0], "cannot be an axis of critical spins; give one number")
    if "n0" not in config.tier.parameters:
        raise config.error(("start",), "cannot be given by angles and angular velocities here; give x0 and y0")
    parameters = config.parameters | {"n0": Values.one(0.0)}
    cases = {name: v for name, v in config.cases.items() if name != "n0"}
    found = replace(measuring(config), parameters=parameters, cases=cases)
    return replace(found, integrator=found.integrator.in_one_leg)


class Answer(NamedTuple):
    """The outcome of a simulation at one spin."""

    place: float
    """The logarithm of |spin|."""
    distance: float
    """Distance in spin from n_c2: negative where the spin does not reverse, NaN where unknown."""
    measured: bool
    """Whether the distance lies on the branch that vanishes smoothly at n_c2."""
    failed: bool
    certain: bool
    """Whether the count is certain, or its error is unknown."""


@dataclass
class Spin:
    """The search for n_c2 of one body and one sign of spin, outwards from n_c1."""

    body: int
    sign: float
    width: float
    left: list[float]
    """Places of the outward search that remain to be simulated."""
    passed: list[Answer] = field(default_factory=list)
    """Outcomes of the outward search."""
    reverses: float = np.inf
    """The nearest place known to reverse."""
    root: Root | None = None
    """The bracket, once the outward search has found one."""
    checked: dict[float, bool] = field(default_factory=dict)
    """Places simulated with estimated errors, and whether they count as the bracket says, with certainty."""
    reason: int | None = None
    """The result; None while the search goes on."""

    def wanted(self) -> list[float]:
        """Return the places to simulate next."""
        if not self.root:
            return self.left[:_OUTWARDS]
        return self._unchecked() if self.root.ended else self.root.wanted()

    def learn(self, answers: list[Answer]) -> None:
        """Record the outcomes at the requested places."""
        self.reverses = min([self.reverses, *(each.place for each in answers if each.distance > 0 and each.certain)])
        if self.root:
            self.reason = self._narrowed(self.root, answers)
        else:
            self.left = self.left[len(answers) :]
            self.reason = self._outwards(answers)

    def _narrowed(self, root: Root, answers: list[Answer]) -> int | None:
        """Narrow the bracket; return the result once it is narrow, or as narrow as certain counts allow."""
        for each in answers:
            before = root.values.get(each.place)
            self.checked[each.place] = each.certain and (before is None or (before > 0) == (each.distance > 0))
            root.learn(each.place, each.distance if each.certain else np.nan, smooth=each.measured)
        if any(each.failed for each in answers):
            return Reason.FAILED
        if any(np.isnan(each.distance) for each in answers):
            return Reason.NOT_SETTLED
        if not root.ended or self._unchecked():
            return None
        return Reason.EXISTS if self.checked[root.low] and self.checked[root.high] else Reason.NOT_SETTLED

    def _unchecked(self) -> list[float]:
        """Return the ends of the bracket that were simulated without estimating their errors."""
        return [end for end in (self.root.low, self.root.high) if end not in self.checked] if self.root else []

    def _outwards(self, answers: list[Answer]) -> int | None:
        """Advance until a spin reverses; then set the bracket, or the reason why there is none."""
        for each in answers:
            if each.failed:
                return Reason.FAILED
            self.passed.append(each)
            if each.distance > 0:
                return self._bracketed()
        if self.left:
            return None
        return Reason.NOT_SETTLED if np.isnan(self.passed[-1].distance) else Reason.NOT_FOUND

    def _bracketed(self) -> int | None:
        """Make a bracket of the last two places."""
        if len(self.passed) == 1:
            return Reason.REVERSES_AT_N_C1
        low, high = self.passed[-2:]
        if np.isnan(low.distance):
            return Reason.NOT_SETTLED
        values = {each.place: each.distance for each in (low, high)}
        smooth = {each.place: each.distance for each in self.passed if each.measured}
        self.root = Root(low.place, high.place, -np.log1p(-self.width), values, smooth, closer=CLOSER)
        return None


class CriticalSpins(Search):
    """The search for n_c2 of both signs for all bodies."""

    def __init__(self, config: Config, store: Store, width: float) -> None:
        super().__init__(config, store, width)
        self.prediction = predict(config.equations, self.grid)
        self.columns = self.grid.columns()
        self.first = _reasons_of_n_c1(config, self.columns, self.prediction)
        limit = SPIN_LIMIT * config.equations.spin_unit(self.columns)
        self.spins = [
            Spin(body, (1.0, -1.0)[side], width, _way(abs(n_c1[body]), limit[body]))
            for side, n_c1 in enumerate(self.prediction.n_c1)
            for body in np.flatnonzero(self.first[side] == Reason.EXISTS).tolist()
        ]
        sizes = np.abs(self.prediction.n_c1) / config.equations.spin_unit(self.columns)
        self._slowest = float(sizes[self.first == Reason.EXISTS].min(initial=1.0))
        """The slowest n_c1 from which a search begins, in sqrt(g/c), or 1."""
        self._asked: list[tuple[Spin, list[float]]] = []

    def sharp(self, width: float) -> float:
        """Return the tolerance with which brackets are narrowed to a width, relative to the slowest spin."""
        return super().sharp(width * self._slowest)

    def estimate(self) -> str:
        axes = " × ".join(f"{d} {n}" for d, n in zip(self.grid.dims, self.grid.shape, strict=True)) or "one body"
        bodies = f"bodies: {self.grid.size} ({axes}), each with spins of both signs"
        if not self.spins:
            return f"{bodies}; none has an n_c1 from which to search"
        self.rounds.append(self.ask())
        then = "then:   more spins farther out where none of these reverses, and about "
        then += f"{_A_SPIN} simulations for each n_c2"
        return "\n".join([bodies, estimate(self.simulated()), then])

    def ask(self) -> Mapping[str, Array]:
        spins = [spin for spin in self.spins if spin.reason is None]
        outwards = [spin for spin in spins if not spin.root]
        if not outwards:
            self.tolerance, self.estimates = self.sharp(self.width), self.config.integrator.estimate_errors
        self._asked = [(spin, spin.wanted()) for spin in outwards or spins]
        body = np.array([spin.body for spin, places in self._asked for _ in places], int)
        n0 = np.array([spin.sign * np.exp(place) for spin, places in self._asked for place in places])
        varying = (*self.config.axes, *self.config.cases)
        given = self.grid.given()
        return {name: given[name][body] for name in varying} | {"n0": n0}

    def learn(self, found: Mapping[str, Array]) -> None:
        counts, reversed_ = Counts.of(found), found["reversals"] > 0
        distance = counts.distance(1)
        measured = counts.borders(1) & ~np.isnan(distance)
        # A trajectory that fails after a reversal has reversed, but its last arc cannot be measured.
        size = np.exp([place for _, places in self._asked for place in places])
        distance = np.where(reversed_ & ~(distance > 0), size, distance)
        failed = ~counts.known & ~reversed_
        certain = (found["status"] != SETTLED) | (found.get("certain", counts.known) == 1)
        answers = zip(distance.tolist(), measured.tolist(), failed.tolist(), certain.tolist(), strict=True)
        for spin, places in self._asked:
            spin.learn([Answer(place, *next(answers)) for place in places])

    def dataset(self) -> xr.Dataset:
        """Return the critical spins by formulas, eigenvalues and simulation, with the cost of the search."""
        reasons, bracket = self.first.T.copy(), np.full((self.grid.size, 2, 2), np.nan)
        for spin in self.spins:
            at = (spin.body, int(spin.sign < 0))
            reasons[at] = spin.reason
            if spin.reason == Reason.EXISTS and spin.root:
                bracket[at] = [spin.sign * np.exp(end) for end in (spin.root.low, spin.root.high)]
            elif spin.reason in (Reason.NOT_SETTLED, Reason.REVERSES_AT_N_C1) and np.isfinite(spin.reverses):
                bracket[(*at, 1)] = spin.sign * np.exp(spin.reverses)
        arrays: dict[str, Array] = dict(self.prediction.variables)
        arrays.pop("reversals_predicted", None)
        arrays |= {"n_c2_simulated": bracket.mean(axis=-1), "n_c2_bracket": bracket, "n_c_reason": reasons}
        title = f"{self.config.name}: critical spins ({self.config.model} model)"
        return dataset.label(self.config, self.grid, arrays, {"title": title, **self.attributes()}).drop_vars("n0")


def _way(n_c1: float, limit: float) -> list[float]:
    """Return the places of the outward search from n_c1."""
    farthest = min(_FARTHEST * n_c1, limit)
    steps = int(np.ceil(np.log(farthest / n_c1) / np.log(RATIO)))
    return [float(np.log(min(n_c1 * RATIO**i, farthest))) for i in range(steps + 1)]


def _reasons_of_n_c1(config: Config, columns: Columns, prediction: Prediction) -> Array:
    """Return why the eigenvalues give no n_c1, or that it exists, for n_c1+ and n_c1- of all bodies, shape (2,
    bodies)."""
    by_formula, linear = prediction.variables.get("n_c1"), prediction.n_c1
    unresisted = np.isnan(linear) | (columns["mu"] <= 0 if by_formula is not None else False)
    never = np.isinf(linear)
    uncoupled = never & (np.isnan(by_formula.T) if by_formula is not None else False)
    impossible = np.broadcast_to(config.equations.impossible(columns), linear.shape)
    reasons = [Reason.IMPOSSIBLE, Reason.NO_FRICTION, Reason.NO_COUPLING, Reason.NOT_FOUND]
    return np.select([impossible, unresisted, uncoupled, never], reasons, Reason.EXISTS)
