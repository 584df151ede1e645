"""The curves on which a count changes: cells of a grid tell where they pass, and simulations how exactly.

On each edge of the grid whose ends count differently, the distance in spin from the boundary (`sweep.results.margins`)
has a root.  All roots are narrowed side by side, until two simulated cells on either side are as near as is asked.  The
simulated cells are a table of cases that grows, so that a search is checkpointed, interrupted, and spread over a
cluster as a run is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError
from sweep.config.faults import Fault
from sweep.engine.cluster import Cluster
from sweep.engine.errors import ROUND_OFF
from sweep.engine.reporter import Reporter
from sweep.engine.run import carry_out
from sweep.engine.whole import Whole
from sweep.grid import Array
from sweep.interrupt import deferred
from sweep.kernels.measures import possible
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.models.model import COUNT
from sweep.plots.axis import Axis
from sweep.results.dataset import described
from sweep.results.folder import RunFiles
from sweep.results.margins import FOUND, OPEN, POINTS, UNCERTAIN, Counts, contours
from sweep.results.store import Store
from sweep.studies.kept import identified, kept
from sweep.studies.roots import Root
from sweep.studies.trajectory import require_simulated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MEASURED = ("reversals", "margin", "energy_error")

_FINER = 1e-4
"""Tolerance of the simulations that narrow a bracket, relative to its width: near a boundary a spin is that small."""

_EACH = 8
"""Simulations that narrow a bracket from a cell of a grid to `WIDTH`, as a rule."""


WIDTH = 1e-6
"""Relative distance of the two simulated cells between which a count changes."""


@deferred()
def boundaries(
    config: Config,
    x: str | None = None,
    y: str | None = None,
    width: float = WIDTH,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    reporter: Reporter | None = None,
    cluster: Cluster | None = None,
) -> xr.Dataset:
    """As `sweep.api.boundaries`; what there is to tell goes to `reporter` alone."""
    across, reporter = _across(config, x, y), reporter or Reporter()
    config = _measuring(config)
    identity = identified(config, f"boundaries over {across[0]} and {across[1]}; width of the brackets: {width!r}")
    files = None if output is None else RunFiles(Path(output), f"{config.name}_boundaries")

    def search(store: Store) -> xr.Dataset:
        found = Search(config, store, across, width)
        carry_out(found, store, reporter, cluster)
        return found.labelled().assign_attrs(vars(identity))

    return kept(files, identity, search, _draw, fresh=fresh, reporter=reporter)


def estimate(config: Config, x: str | None = None, y: str | None = None) -> str:
    """Cells, steps, memory and time of a search, a line each, told from a sample of its grid.

    Raises
    ------
    ConfigError
        as `boundaries`.
    """
    from sweep.engine.estimate import estimate as of_run

    across = _across(config, x, y)
    words = f"then:   about {_EACH} simulations for each point where a curve crosses a line of the grid"
    return f"{of_run(_measuring(config))}\n{words}, over {across[0]} and {across[1]}"


def _measuring(config: Config) -> Config:
    """`config` with what a search needs to know of a cell, and no more."""
    measure = tuple(name for name in _MEASURED if name in possible(config.equations))
    return replace(config, measure=measure, verify=0.0, refine=0)


def _across(config: Config, x: str | None, y: str | None) -> tuple[str, str]:
    """The axes over which boundaries are curves: those named, or else the first two."""
    require_simulated(config)
    if COUNT not in config.equations.offers:
        raise ConfigError([config.fault(("model",), "counts no reversals, so that there are no boundaries")])
    long = [name for name, values in config.axes.items() if len(values) > 1]
    for option, name in (("x", x), ("y", y)):
        if name is not None and name not in long:
            words = f"{option}: {name} is no axis of more than one value; the axes are {', '.join(long) or 'none'}"
            raise ConfigError([Fault("", None, None, (), words)])
    rest = [name for name in long if name not in (x, y)]
    up = y or (rest.pop(0) if rest else None)
    right = x or (rest.pop(0) if rest else None)
    if up is None or right is None or up == right:
        raise ConfigError([config.fault((), "boundaries need two axes; give two parameters more than one value")])
    return right, up


@dataclass
class Point:
    """A point of a curve, on an edge of the grid, that is being narrowed."""

    level: int
    curve: int
    closed: bool
    along: str
    """The axis along which the edge lies."""
    cell: dict[str, float]
    """The other parameters of the edge."""
    root: Root
    """In the straight coordinate of the axis (`Axis.straight`)."""
    counts: dict[float, int]
    """The counts that are known along the edge, by place."""
    decided: set[float]
    """The places whose counts are certain."""


class Search(Whole):
    """The simulations of a search: first the cells of the grid, then those that the roots ask for."""

    def __init__(self, config: Config, store: Store, across: tuple[str, str], width: float) -> None:
        super().__init__(config, store)
        self.across, self.width = across, width
        self.axes = {name: Axis(name, np.array(sorted(config.axes[name]))) for name in across}
        self.points: list[Point] = []
        self.asked: list[tuple[Point, float]] = []
        """The points and places of the cells that were asked for last."""
        self.rows: list[dict[str, float]] = []
        """The parameters of the cells beyond the grid."""
        self._learned = 0
        self._sure = np.empty(0, bool)
        """Whether the counts of the cells of `asked` are certain; taken for granted where no errors are estimated."""

    def simulated(self) -> Config:
        """The configuration whose cases are all simulated cells."""
        columns = self.grid.columns()
        varying = dict.fromkeys([*self.config.axes, *(self.config.cases or {})])
        cases = {name: (*columns[name].tolist(), *(row[name] for row in self.rows)) for name in varying}
        constants = {name: v for name, v in self.config.parameters.items() if name not in cases}
        integrator = self.config.integrator
        if self.rows:
            finer = max(_FINER * self.width, ROUND_OFF)
            integrator = integrator.model_copy(update={"tolerance": min(integrator.tolerance, finer)})
        return replace(self.config, parameters=constants, cases=cases, integrator=integrator)

    def grow(self, tile_size: Callable[[int], int]) -> bool:
        """Add the cells to simulate next, judging by all results so far; False if every search has ended."""
        if not self.tiles:
            return self._add(self.grid.size, tile_size)
        found = self._learn()
        if not self.points:
            self.points = list(self._points(found))
        else:
            for (point, place), count, sure in zip(self.asked, _each(found), self._sure, strict=True):
                distance = float(count.distance(point.level)[0])
                point.root.learn(place, distance, smooth=_is_smooth(count, point.level))
                point.counts[place] = int(count.reversals[0])
                if sure:
                    point.decided.add(place)
        self.asked = [(point, place) for point in self.points if not point.root.ended for place in point.root.wanted()]
        bent = {name: axis.bent for name, axis in self.axes.items()}
        self.rows += [
            {**point.cell, point.along: float(bent[point.along](np.array(place)))} for point, place in self.asked
        ]
        return self._add(len(self.asked), tile_size)

    def labelled(self) -> xr.Dataset:
        """The points, with what their search has cost."""
        _, apart = self._gather()
        columns = {name: np.array(values) for name, values in self._columns().items()}
        head: dict[str, Any] = {
            "Conventions": "CF-1.11",
            "title": f"{self.config.name}: boundaries ({self.config.model} model)",
        }
        head |= {"x": self.across[0], "y": self.across[1], "relative_width": self.width}
        head |= {"trajectories": self.tiles[-1][0].stop} | self._attributes(self.tiles[-1][0].stop, apart)
        own = {name: xr.Variable("point", columns[name].astype(spec.dtype), described(spec))
               for name, spec in POINTS.items()}  # fmt: skip
        own["bracket"] = xr.Variable("point", columns["bracket"], {"long_name": "axis along which the bracket lies"})
        places = {name: xr.Variable("point", columns[name], self.config.described(name)) for name in self.config.axes}
        for name, axis in self.axes.items():
            spacing = "log" if axis.spacing == "log" else "linear"
            places[name].attrs |= {"actual_range": axis.values[[0, -1]], "spacing": spacing}
        fixed = {
            name: xr.Variable((), value, self.config.described(name)) for name, value in self.grid.constants.items()
        }
        return xr.Dataset(own, {**places, **fixed}, head)

    def _columns(self) -> dict[str, list[Any]]:
        """The variables and coordinates of all points, by name."""
        columns: dict[str, list[Any]] = {name: [] for name in (*POINTS, "bracket", *self.config.axes)}
        for point in self.points:
            axis, root = self.axes[point.along], point.root
            ends = sorted((root.low, root.high), key=lambda place: root.values[place])
            fewer, more = (float(axis.bent(np.array(place))) for place in ends)
            row: dict[str, Any] = {"level": point.level, "curve": point.curve, "closed": point.closed}
            sure = FOUND if point.decided >= {*ends} else UNCERTAIN
            row |= {"end_fewer": fewer, "end_more": more, "outcome": OPEN if root.unknown else sure}
            row |= {"reversals_fewer": point.counts[ends[0]], "reversals_more": point.counts[ends[1]]}
            row |= {"bracket": point.along, **point.cell, point.along: (fewer + more) / 2}
            for name, values in columns.items():
                values.append(row[name])
        return columns

    def _add(self, cells: int, tile_size: Callable[[int], int]) -> bool:
        """Simulate so many cells more, in tiles of their own."""
        first, step = self.tiles[-1][0].stop if self.tiles else 0, max(tile_size(cells), 1)
        self.tiles += [(slice(i, min(i + step, first + cells)),) for i in range(first, first + cells, step)]
        return cells > 0

    def _learn(self) -> Counts:
        """What the tiles say that were added last."""
        new = [self.store.load(i) for i in range(self._learned, len(self.tiles))]
        self._learned = len(self.tiles)
        status, count, more, fewer = (
            np.concatenate([tile[name] for tile in new])
            for name in ("status", "reversals", "margin_more", "margin_fewer")
        )
        self._sure = (
            np.concatenate([tile["decided"] for tile in new]).astype(bool) if "decided" in new[0] else count >= 0
        )
        return Counts(count.astype(float), more, fewer, np.isin(status, (SETTLED, TIME_LIMIT)))

    def _points(self, found: Counts) -> Iterator[Point]:
        """The points that the cells of the grid tell of, curve by curve."""
        names, (x, y) = list(self.config.axes), self.across
        order = [names.index(name) for name in (*(n for n in names if n not in self.across), y, x)]
        tables = [np.transpose(each.reshape(self.grid.shape), order) for each in vars(found).values()]
        others = [name for name in names if name not in self.across]
        number = 0
        for at in product(*(range(len(self.config.axes[name])) for name in others)):
            cell = {name: self.config.axes[name][i] for name, i in zip(others, at, strict=True)}
            counts = Counts(*(_sorted(each[at], self.config.axes[y], self.config.axes[x]) for each in tables))
            for level in counts.levels():
                for xs, ys in contours(_levelled(counts.distance(level)), *map(np.arange, counts.known.shape[::-1])):
                    places = list(zip(xs.tolist(), ys.tolist(), strict=True))
                    closed = places[0] == places[-1]
                    for place in places[: -1 if closed else None]:
                        yield replace(self._point(level, cell, counts, place), curve=number, closed=closed)
                    number += 1

    def _point(self, level: int, cell: dict[str, float], counts: Counts, at: tuple[float, float]) -> Point:
        """The point of a curve at `at`, in indices along x and y, one of which is whole."""
        x, y = self.across
        horizontal = abs(at[0] - round(at[0])) > abs(at[1] - round(at[1]))
        along, other = (x, y) if horizontal else (y, x)
        first, fixed = int(np.floor(at[not horizontal])), round(at[horizontal])
        axis = self.axes[along]
        places = axis.straight(axis.values[first : first + 2]).tolist()
        ends = [counts.at((fixed, first + i) if horizontal else (first + i, fixed)) for i in (0, 1)]
        values = [float(end.distance(level)[0]) for end in ends]
        smooth = {p: v for p, v, end in zip(places, values, ends, strict=True) if _is_smooth(end, level)}
        ends_ = np.abs(axis.values[first : first + 2])
        size = 1.0 if axis.spacing == "log" else float(ends_.min() or ends_.max())
        root = Root(places[0], places[1], self.width * size, dict(zip(places, values, strict=True)), smooth)
        counted = {p: int(end.reversals[0]) for p, end in zip(places, ends, strict=True)}
        return Point(
            level, 0, False, along, cell | {other: float(self.axes[other].values[fixed])}, root, counted, set()
        )


def _each(found: Counts) -> Iterator[Counts]:
    return (found.at(i) for i in range(len(found.known)))


def _is_smooth(count: Counts, level: int) -> bool:
    """Tell whether the distance of a cell is the measured one, not a guess."""
    return bool(count.reversals[0] in (level - 1, level))


def _sorted(table: Array, y: tuple[float, ...], x: tuple[float, ...]) -> Array:
    return np.asarray(table[np.ix_(np.argsort(y), np.argsort(x))])


def _levelled(distance: Array) -> Array:
    """Numbers of the same signs, so much alike that a contour passes through the middle part of each edge."""
    return np.asarray(np.sign(distance) * (2 + np.tanh(np.abs(distance) / np.nanmax(np.abs(distance)))))


def _draw(result: xr.Dataset) -> Figure:
    from sweep.plots import boundaries as plots  # matplotlib takes a third of the time of `import sweep`

    return plots.draw(result)
