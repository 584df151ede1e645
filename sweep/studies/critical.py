"""Critical spins: by the paper's formulas, by the model's eigenvalues, and n_c2 by simulation."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError, Values
from sweep.config.bodies import described_impossible
from sweep.config.user_models import explained
from sweep.engine.reporter import Progress, Reporter
from sweep.grid import Array, Grid
from sweep.interrupt import deferred
from sweep.parameters import START
from sweep.prediction import Prediction, predict
from sweep.results import dataset
from sweep.results.dataset import EXISTS, NO_COUPLING, NO_FRICTION, NOT_FOUND
from sweep.results.folder import RunFiles
from sweep.results.identity import Identity
from sweep.results.provenance import provenance
from sweep.results.store import Store
from sweep.studies import bracket
from sweep.studies.kept import identified, kept
from sweep.studies.reversing import USUAL, body_seconds, find_n_c2
from sweep.studies.rounds import Rounds
from sweep.studies.trajectory import require_simulated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 1e-3
"""Relative width down to which simulation brackets n_c2."""

# Searches for n_c2 that run together (about 100 MB of images).
_GROUP = 8192

# Bodies by which the time for all others is judged.
_SAMPLE = 256

# Of what is left of a search, the share that a round of simulations brings, as a guess while the round goes on.
_ROUND = 0.5

_REMARKS = {
    NO_FRICTION: "without friction",
    NO_COUPLING: "without coupling",
    NOT_FOUND: "not found",
    dataset.REVERSES_AT_N_C1: "reverse at n_c1 already",
    dataset.UNDECIDED: "undecided at t_end",
    dataset.FAILED: "failed",
    dataset.NO_BODY: "impossible",
}

_REASON_OF = {
    bracket.NOT_YET: NOT_FOUND,
    bracket.HAPPENS: EXISTS,
    bracket.AT_ONCE: dataset.REVERSES_AT_N_C1,
    bracket.UNDECIDED: dataset.UNDECIDED,
    bracket.FAILED: dataset.FAILED,
}


@deferred()
def critical(
    config: Config,
    width: float = WIDTH,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    reporter: Reporter | None = None,
) -> xr.Dataset:
    """As `sweep.api.critical`; what there is to tell goes to `reporter` alone, with progress counted in bodies."""
    config, reporter = _searchable(config), reporter or Reporter()
    files = None if output is None else RunFiles(Path(output), f"{config.name}_critical")
    with explained(config.origin):
        return kept(
            files, _identify(config, width), lambda store: _search(config, width, store, reporter), _draw,
            fresh=fresh, reporter=reporter,
        )  # fmt: skip


def estimate(config: Config) -> str:
    """Bodies, simulations and time of a search, a line each, told from a sample of the bodies.

    Raises
    ------
    ConfigError
        as `critical`.
    """
    config = _searchable(config)
    grid = Grid.of(config)
    axes = " × ".join(f"{name} {len(values)}" for name, values in grid.axes.items())
    if grid.cases is not None:
        axes = f"case {grid.size}"
    usual, most = (grid.size * seconds for seconds in body_seconds(config, grid.sample(_SAMPLE).columns()))
    return "\n".join(
        [
            f"bodies:      {grid.size} ({axes or 'one body'}), each with spins of both signs",
            f"simulations: about {USUAL} for each n_c2, to t = {config.integrator.t_end:g} at most",
            f"time:        about {usual:.3g} s; at most about {most:.3g} s, if every simulation runs to t_end",
        ]
    )


def remarks(result: xr.Dataset) -> list[str]:
    """For each critical spin that some bodies lack, or that is not to be trusted, a line: how many bodies, and why."""
    lines = []
    for name in ("n_c1_plus", "n_c1_minus", "n_c2_plus", "n_c2_minus"):
        codes = result[f"{name}_reason"].values
        counts = {words: int((codes == code).sum()) for code, words in _REMARKS.items()}
        if found := ", ".join(f"{count} {words}" for words, count in counts.items() if count):
            lines.append(f"{name}: {found}, of {codes.size}")
    return lines


def _searchable(config: Config) -> Config:
    """`config` with a single start spin, since no critical spin depends on it; `ConfigError` if there is no search."""
    require_simulated(config)
    if not config.of_rattlebacks:
        raise ConfigError([config.fault(("model",), "no rattleback; critical spins are asked of: slip, noslip")])
    if beyond := sorted((START - {"n0"}) & set(config.axes)):
        raise ConfigError([config.fault(("start", beyond[0]), "cannot be an axis of critical spins; give one number")])
    if "n0" not in config.tier.parameters:
        raise ConfigError(
            [config.fault(("start",), "cannot be given by angles and angular velocities here; give x0 and y0")]
        )
    parameters = config.parameters | {"n0": Values((0.0,), False, 0.0)}
    cases = None if config.cases is None else {name: v for name, v in config.cases.items() if name != "n0"}
    return replace(config, parameters=parameters, cases=cases or None, integrator=config.integrator.patient)


def _identify(config: Config, width: float) -> Identity:
    return identified(config, f"width of the brackets: {width!r}")


def _draw(result: xr.Dataset) -> Figure:
    from sweep.plots import critical as plots  # matplotlib takes a third of the time of `import sweep`

    return plots.draw(result)


def _search(config: Config, width: float, store: Store, reporter: Reporter) -> xr.Dataset:
    """Search n_c2 of all bodies; rounds that `store` has are not simulated again."""
    if store.done or store.load_running():
        reporter.note(f"resuming an earlier search, which finished {len(store.done)} rounds of simulations")
    grid = Grid.of(config)
    prediction = predict(config.equations, grid)
    assert prediction.stability is not None  # it is a model
    # Both signs one after the other: each is a search of its own.
    n_c1, sign = np.concatenate(prediction.stability.n_c1), np.repeat([1.0, -1.0], grid.size)
    bodies = {name: np.tile(values, 2) for name, values in grid.columns().items()}
    stable = np.tile(prediction.stability.ranges, 2)
    first = _reasons_of_n_c1(config, grid, prediction)
    second, inner, outer = first.copy(), *np.full((2, len(n_c1)), np.nan)
    searched = np.flatnonzero(first == EXISTS)
    settled = _Settled(reporter, grid.size, grid.size - len(searched) / 2)
    rounds = Rounds(store, settled.advance)
    for begin in range(0, len(searched), _GROUP):
        at = searched[begin : begin + _GROUP]
        theirs = {name: values[at] for name, values in bodies.items()}
        found = find_n_c2(config, theirs, n_c1[at], stable[:, at], width, rounds, settled.share)
        inner[at], outer[at] = sign[at] * found.inner, sign[at] * found.outer
        second[at] = [_REASON_OF[outcome] for outcome in found.outcome.tolist()]
        settled.finish(len(at) / 2)
    arrays: dict[str, Array] = dict(dataset.predicted(prediction))
    arrays.pop("reversals_predicted", None)
    for side, half in (("plus", slice(grid.size)), ("minus", slice(grid.size, None))):
        arrays[f"n_c2_{side}_simulated"] = (inner[half] + outer[half]) / 2
        arrays[f"n_c2_{side}_simulated_inner"], arrays[f"n_c2_{side}_simulated_outer"] = inner[half], outer[half]
        arrays[f"n_c1_{side}_reason"], arrays[f"n_c2_{side}_reason"] = first[half], second[half]
    four = np.concatenate([first, second]).reshape(4, -1)
    arrays["critical_reason"] = four[(four != EXISTS).argmax(axis=0), np.arange(grid.size)]
    origin = provenance(config, rounds.seconds, grid.size) | _identify(config, width).__dict__
    attributes = {"relative_width": width, **origin, **described_impossible(config)}
    return dataset.label(config, grid, arrays, attributes).drop_vars("n0")


def _reasons_of_n_c1(config: Config, grid: Grid, prediction: Prediction) -> Array:
    """Why the eigenvalues have no n_c1, or that it exists: n_c1+ of all bodies, and then n_c1-."""
    assert prediction.stability is not None
    columns, formulas, linear = grid.columns(), prediction.formulas, np.array(prediction.stability.n_c1)
    unresisted = np.isnan(linear) | (columns["mu"] <= 0 if formulas else False)
    never = np.isinf(linear)
    uncoupled = never & (np.isnan(formulas.n_c1[0]) if formulas else False)
    impossible = np.broadcast_to(config.equations.impossible(columns), linear.shape)
    reasons = [dataset.NO_BODY, NO_FRICTION, NO_COUPLING, NOT_FOUND]
    return np.select([impossible, unresisted, uncoupled, never], reasons, EXISTS).ravel()


class _Settled:
    """Adds up the bodies that are settled, with parts of those that are being searched, for a reporter."""

    def __init__(self, reporter: Reporter, bodies: int, finished: float) -> None:
        """Count `bodies`, of which `finished` are settled from the start."""
        self._reporter, self._bodies, self._finished, self._began = reporter, bodies, finished, time.perf_counter()
        self._group = self._left = self._told = 0.0
        self._before: float | None = None

    def share(self, share: Array) -> None:
        """Such a share of each search of a group is done; each is half a body."""
        self._group, self._left = float(share.sum()) / 2, float((1 - share).sum()) / 2
        self.advance(0.0)

    def advance(self, share: float) -> None:
        """Such a share of a round of simulations is done."""
        # A round may bring less than was guessed.
        self._told = max(self._told, self._finished + self._group + _ROUND * self._left * share)
        self._before = self._told if self._before is None else self._before
        seconds = max(time.perf_counter() - self._began, np.finfo(float).tiny)
        self._reporter.chunk(Progress(self._bodies, self._told, 0, self._before, seconds))

    def finish(self, bodies: float) -> None:
        """A group of so many bodies is finished."""
        self._finished += bodies
        self.share(np.zeros(0))
