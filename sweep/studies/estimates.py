"""Estimates the cost of a study from the cells of its first round, before anything is computed."""

from __future__ import annotations

from sweep.engine.estimate import estimate as of_run
from sweep.results.store import Store
from sweep.studies.boundaries import Boundaries
from sweep.studies.critical import CriticalSpins
from sweep.studies.study import Task

_A_POINT = 8
"""Typical number of simulations that narrow a bracket of a boundary to the usual width."""

_A_SPIN = 4
"""Typical number of simulations that narrow the bracket of a critical spin to the usual width."""


def of(task: Task) -> str:
    """Describe cells, steps, memory and time of the first round of a study, and the rounds that follow, a line each."""
    study = task.make(task.config, Store())
    if isinstance(study, Boundaries):
        return _of_boundaries(study)
    return _of_critical(study) if isinstance(study, CriticalSpins) else of_run(study.config)


def _of_boundaries(search: Boundaries) -> str:
    """Describe the grid of a search for boundaries, and the rounds that follow."""
    words = f"then:   about {_A_POINT} simulations for each point where a curve crosses a line of the grid, "
    words += f"over {search.across[0]} and {search.across[1]}, and 2 or more between two points"
    return f"{of_run(search.config)}\n{words}"


def _of_critical(search: CriticalSpins) -> str:
    """Describe the bodies of a search for critical spins, its first round, and the rounds that follow."""
    grid = search.grid
    axes = " × ".join(f"{d} {n}" for d, n in zip(grid.dims, grid.shape, strict=True)) or "one body"
    bodies = f"bodies: {grid.size} ({axes}), each with spins of both signs"
    if not search.spins:
        return f"{bodies}; none has an n_c1 from which to search"
    search.rounds.append(search.ask())
    then = f"then:   more spins farther out where none of these reverses, and about {_A_SPIN} simulations for each n_c2"
    return "\n".join([bodies, of_run(search.simulated()), then])
