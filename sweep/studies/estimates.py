"""Says what a search would take, from the cells of its first round, before anything is computed."""

from __future__ import annotations

from sweep.config import Config
from sweep.engine.estimate import estimate as of_run
from sweep.results.store import Store
from sweep.studies import SPIN_WIDTH, boundaries, critical
from sweep.studies.search import measuring

_A_POINT = 8
"""Simulations that narrow a bracket of a boundary to the usual width, as a rule."""

_A_SPIN = 4
"""Simulations that narrow the bracket of a critical spin to the usual width, as a rule."""


def of_boundaries(config: Config, x: str | None = None, y: str | None = None) -> str:
    """Cells, steps, memory and time of the grid of a search for boundaries, a line each; what comes then.

    Raises
    ------
    ConfigError
        as `boundaries`.
    """
    across = boundaries.chosen_axes(config, x, y)
    words = f"then:   about {_A_POINT} simulations for each point where a curve crosses a line of the grid, "
    words += f"over {across[0]} and {across[1]}, and 2 or more between two points"
    return f"{of_run(measuring(config))}\n{words}"


def of_critical(config: Config) -> str:
    """Bodies of a search for critical spins; cells, steps, memory and time of its first round; what comes then.

    Raises
    ------
    ConfigError
        as `critical`.
    """
    config = critical.searchable(config)
    grid = config.grid
    axes = " × ".join(f"{d} {n}" for d, n in zip(grid.dims, grid.shape, strict=True)) or "one body"
    bodies = f"bodies: {grid.size} ({axes}), each with spins of both signs"
    search = critical.CriticalSpins(config, Store(), SPIN_WIDTH)
    if not search.spins:
        return f"{bodies}; none has an n_c1 from which to search"
    search.rounds.append(search.ask())
    then = f"then:   more spins outwards where none of these reverses, and about {_A_SPIN} simulations for each n_c2"
    return "\n".join([bodies, of_run(search.simulated()), then])
