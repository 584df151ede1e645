"""Critical spins in three ways: the paper's formulas, the model's eigenvalues, and simulation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError, Values
from sweep.config.bodies import described_impossible
from sweep.config.user_models import explained
from sweep.engine.reporter import Reporter
from sweep.grid import Array, Grid
from sweep.interrupt import deferred
from sweep.jit import fingerprint
from sweep.parameters import START
from sweep.prediction import Prediction, predict
from sweep.results import dataset, netcdf
from sweep.results.checkpoint import Checkpoint
from sweep.results.dataset import DISAGREES, EXISTS, NO_COUPLING, NO_FRICTION, NOT_FOUND
from sweep.results.folder import RunFiles
from sweep.results.identity import Identity
from sweep.results.memory import Memory
from sweep.results.provenance import identify, provenance
from sweep.results.store import Store
from sweep.studies import bracket
from sweep.studies.bracket import Bracket
from sweep.studies.growth import find_n_c1
from sweep.studies.reversing import USUAL, body_seconds, find_n_c2
from sweep.studies.rounds import Rounds
from sweep.studies.settled import Settled
from sweep.studies.stepwise import stepwise

WIDTH = 1e-3
"""Relative width down to which simulation brackets a critical spin."""

# Eigenvalues and simulation disagree where they are farther apart than the bracket is wide, or than this: simulated
# growth rates are off by up to 1.2e-5 of the decay rate at rest (`sweep.studies.growth`).
_ERROR = 1e-4

# Bodies searched together (about 100 MB of images).
_GROUP = 4096

# Bodies by which the time for all others is judged.
_SAMPLE = 256

_REMARKS = {
    NO_FRICTION: "without friction",
    NO_COUPLING: "without coupling",
    NOT_FOUND: "not found",
    DISAGREES: "disagree with the eigenvalues",
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
    with explained(config.origin):
        return _found(config, width, output, fresh, reporter)


def _found(config: Config, width: float, output: str | Path | None, fresh: bool, reporter: Reporter) -> xr.Dataset:
    if output is None:
        return _search(config, width, Memory(), reporter)
    files, identity = RunFiles(Path(output), f"{config.name}_critical"), _identify(config, width)
    with files.locked():
        if fresh:
            files.discard()
        if files.has_dataset(identity):
            reporter.note(f"{files.dataset}: already complete, nothing to compute")
        else:
            files.picture.unlink(missing_ok=True)  # of a dataset that is gone
            store = Checkpoint(files.checkpoint, identity, reporter.note)
            netcdf.write(files.dataset, _search(config, width, store, reporter))
        files.discard_checkpoint()
        result = netcdf.open_dataset(files.dataset)
        if not files.picture.exists():
            from sweep.plots import critical as plots  # matplotlib takes a third of the time of `import sweep`

            files.save_picture(plots.draw(result))
    return result


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
    stepwise(config)  # raises if there is nothing to simulate
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
    return replace(config, parameters=parameters, cases=cases or None)


def _identify(config: Config, width: float) -> Identity:
    """What a search depends on: what a run does, the width, and the sources of the search."""
    run, search = identify(config), fingerprint(*(str(path) for path in sorted(Path(__file__).parent.glob("*.py"))))
    return replace(
        run,
        config=f"{run.config}# width of the brackets: {width!r}\n",
        config_hash=f"{run.config_hash}-{width!r}",
        source_hash=f"{run.source_hash}-{search}",
    )


def _search(config: Config, width: float, store: Store, reporter: Reporter) -> xr.Dataset:
    """Search the critical spins of all bodies; rounds that `store` has are not simulated again."""
    if store.done or store.load_running():
        reporter.note(f"resuming an earlier search, which finished {len(store.done)} rounds of simulations")
    grid = Grid.of(config)
    prediction = predict(config.equations, grid)
    arrays: dict[str, Array] = dict(dataset.predicted(prediction))
    arrays.pop("reversals_predicted", None)
    reasons = np.full((2, 2, grid.size), NO_FRICTION)
    ends = np.full((2, 2, 2, grid.size), np.nan)
    reasons[:, :, config.equations.impossible(grid.columns())] = dataset.NO_BODY
    searched = np.flatnonzero(_decays_at_rest(prediction, grid))
    settled = Settled(reporter, grid.size, len(searched))
    rounds = Rounds(store, settled.advanced)
    for begin in range(0, len(searched), _GROUP):
        cells = searched[begin : begin + _GROUP]
        group = _Group(config, grid, prediction, cells, width, rounds, settled, reporter)
        for event, found in enumerate(group.search()):
            ends[event][:, :, cells], reasons[event][:, cells] = found
        settled.group(len(cells))
    for event, name in enumerate(("n_c1", "n_c2")):
        for side, inner, outer, reason in zip(("plus", "minus"), *ends[event], reasons[event], strict=True):
            arrays[f"{name}_{side}_simulated"] = (inner + outer) / 2
            arrays[f"{name}_{side}_simulated_inner"] = inner
            arrays[f"{name}_{side}_simulated_outer"] = outer
            arrays[f"{name}_{side}_reason"] = reason
    four = reasons.reshape(4, -1)
    arrays["critical_reason"] = four[(four != EXISTS).argmax(axis=0), np.arange(grid.size)]
    origin = provenance(config, rounds.seconds, grid.size) | _identify(config, width).__dict__
    attributes = {"relative_width": width, **origin, **described_impossible(config)}
    return dataset.label(config, grid, arrays, attributes).drop_vars("n0")


def _decays_at_rest(prediction: Prediction, grid: Grid) -> Array:
    """Whether friction makes the rattle of each body decay, so that there may be critical spins."""
    assert prediction.stability is not None  # it is a model
    resisted = grid.columns()["mu"] > 0 if prediction.formulas else True
    return np.asarray(resisted & ~np.isnan(prediction.stability.n_c1[0]))


@dataclass(frozen=True)
class _Group:
    """Bodies whose spins of both signs are searched together, so that their simulations share the threads."""

    config: Config
    grid: Grid
    prediction: Prediction
    cells: Array
    """Indices of the bodies in the grid."""
    width: float
    rounds: Rounds
    settled: Settled
    reporter: Reporter

    def search(self) -> Iterator[tuple[Array, Array]]:
        """For n_c1 and for n_c2: the ends of the brackets, shape (2, 2, cells), and the reasons, shape (2, cells).

        The axes are inner and outer end, positive and negative side, cells.
        """
        assert self.prediction.stability is not None
        cells, width = self.cells, self.width
        bodies = {name: np.tile(values[cells], 2) for name, values in self.grid.columns().items()}
        sign = np.repeat([1.0, -1.0], len(cells))
        formulas = self.prediction.formulas
        uncoupled = np.isnan(formulas.n_c1[0][np.tile(cells, 2)]) if formulas else np.zeros(2 * len(cells), bool)
        linear = np.abs(np.concatenate([n_c1[cells] for n_c1 in self.prediction.stability.n_c1]))
        stable = np.tile(self.prediction.stability.ranges[:, cells], 2)

        settled = self.settled.first
        first = find_n_c1(self.config, bodies, sign, linear, width, self.rounds, settled)
        reason = _reasons(first)
        reason[(reason == NOT_FOUND) & uncoupled] = NO_COUPLING
        reason[(first.outcome != bracket.FAILED) & ~_agrees(first, linear, width)] = DISAGREES
        yield (sign * [first.inner, first.outer]).reshape(2, 2, -1), reason.reshape(2, -1)

        at = np.flatnonzero(first.outcome == bracket.HAPPENS)
        ends, reason = np.full((2, len(sign)), np.nan), reason.copy()
        theirs, begin = {name: values[at] for name, values in bodies.items()}, (sign * first.outer)[at]
        settled = self.settled.second
        second = find_n_c2(self.config, theirs, begin, stable[:, at], width, self.rounds, settled)
        ends[:, at], reason[at] = sign[at] * [second.inner, second.outer], _reasons(second)
        yield ends.reshape(2, 2, -1), reason.reshape(2, -1)


def _reasons(found: Bracket) -> Array:
    return np.array([_REASON_OF[outcome] for outcome in found.outcome.tolist()], int)


def _agrees(found: Bracket, linear: Array, width: float) -> Array:
    """Whether the eigenvalues' |n_c1| lies within the bracket, or there is none by both."""
    slack = 1 + max(width, _ERROR)
    within = (found.inner / slack <= linear) & (linear <= found.outer * slack)
    return np.asarray(np.where(found.outcome == bracket.NOT_YET, np.isinf(linear), within))
