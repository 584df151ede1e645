"""Says what a study would take, from the cells of its first round, before anything is computed."""

from __future__ import annotations

from sweep.engine.estimate import estimate as of_run
from sweep.results.store import Store
from sweep.studies.boundaries import Boundaries
from sweep.studies.critical import CriticalSpins
from sweep.studies.kept import Task

_A_POINT = 8
"""Simulations that narrow a bracket of a boundary to the usual width, as a rule."""

_A_SPIN = 4
"""Simulations that narrow the bracket of a critical spin to the usual width, as a rule."""


def of(task: Task) -> str:
    """Cells, steps, memory and time of the first round of a study, a line each, and what comes then."""
    study = task.make(task.config, Store())
    if isinstance(study, Boundaries):
        return _of_boundaries(study)
    return _of_critical(study) if isinstance(study, CriticalSpins) else of_run(study.config)


def _of_boundaries(search: Boundaries) -> str:
    """The grid of a search for boundaries; what comes then."""
    words = f"then:   about {_A_POINT} simulations for each point where a curve crosses a line of the grid, "
    words += f"over {search.across[0]} and {search.across[1]}, and 2 or more between two points"
    return f"{of_run(search.config)}\n{words}"


def _of_critical(search: CriticalSpins) -> str:
    """Bodies of a search for critical spins; its first round; what comes then."""
    grid = search.grid
    axes = " × ".join(f"{d} {n}" for d, n in zip(grid.dims, grid.shape, strict=True)) or "one body"
    bodies = f"bodies: {grid.size} ({axes}), each with spins of both signs"
    if not search.spins:
        return f"{bodies}; none has an n_c1 from which to search"
    search.rounds.append(search.ask())
    then = f"then:   more spins outwards where none of these reverses, and about {_A_SPIN} simulations for each n_c2"
    return "\n".join([bodies, of_run(search.simulated()), then])
