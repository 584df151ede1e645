"""Find the curves on which a count changes: the grid locates them, and simulations refine them.

On each edge of the grid whose ends have different counts, the distance in spin from the boundary
(`sweep.results.margins`) has a root. The curves are followed from edge to edge, with brackets around roots no narrower
than necessary. Then all brackets are narrowed in parallel, until the simulated cells on either side are as close as
requested.

Along a single axis the boundaries are points. Its values are simulated, and the middle of each stretch between them in
which the slow equations estimate another count. A cell whose count is not certain cannot be the end of a bracket there,
so a bracket stays wide where no other cell is found.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise, product
from typing import Any

import numpy as np
import xarray as xr

from sweep.axis import Axis, contours
from sweep.config import Config
from sweep.engine.estimate import estimate
from sweep.faults import fault_of
from sweep.grid import Array
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.models.model import Offer, take
from sweep.prediction import estimates
from sweep.results.dataset import variables
from sweep.results.margins import POINTS, Counts
from sweep.results.store import Store
from sweep.studies import DEVIATIONS, WIDTHS
from sweep.studies.curve import Cell, Curve, Middle, Point
from sweep.studies.roots import CLOSER
from sweep.studies.study import Search, Task, measuring, require_between, require_certain

# Largest rounding error of a whole index along an edge of the grid. `_levelled` keeps points on diagonals farther away.
_ON = 1e-9

_A_POINT = 8
"""Typical number of simulations that narrow a bracket to the usual width."""

_PLACES = 201
"""Least number of places along the axis at which the count is estimated."""

Asked = tuple[Curve, Point | Middle, float]
"""A requested cell: the part and curve that it belongs to, and its place along the line."""


def boundaries(config: Config, x: str | None, y: str | None, width: float, deviation: float) -> Task:
    """Arguments of `sweep.api.boundaries`."""
    require_between("bracket", width, WIDTHS)
    require_between("deviation", deviation, DEVIATIONS)
    across = chosen_axes(config, x, y)
    message = f"boundaries over {' and '.join(across)}; width of the brackets: {width!r}; deviation: {deviation!r}"
    kind = Boundaries if len(across) == 2 else Along
    make = partial(kind, across=across, width=width, deviation=deviation)
    return Task(measuring(config), "boundaries", message, make)


def chosen_axes(config: Config, x: str | None, y: str | None) -> tuple[str, ...]:
    """Return the axes over which boundaries are curves: the named ones, or else the first two, or the only one."""
    require_certain(config)
    if Offer.COUNT not in config.equations.offers:
        raise config.error(("model",), "does not count reversals, so it has no boundaries")
    long = [name for name, values in config.axes.items() if len(values) > 1]
    for option, name in (("x", x), ("y", y)):
        if name is not None and name not in long:
            message = f"{name} is not an axis of more than one value; the axes are {', '.join(long) or 'none'}"
            raise fault_of(message, option)
    if not long:
        raise config.error((), "boundaries need an axis; give a parameter more than one value")
    if x is not None and x == y:
        raise fault_of(f"{x} is the other axis already; choose two axes", "y")
    if len(long) == 1:
        return (long[0],)
    rest = (name for name in long if name not in (x, y))
    up = y or next(rest)
    right = x or next(rest)
    return right, up


class Boundaries(Search):
    """A search whose first round simulates the cells of the grid."""

    def __init__(self, config: Config, store: Store, across: tuple[str, ...], width: float, deviation: float) -> None:
        super().__init__(config, store, width)
        self.across, self.deviation = across, deviation
        self.axes = {name: Axis(name, np.array(sorted(config.axes[name]))) for name in across}
        self.curves: list[Curve] = []
        self._grid = {"cells_not_final": 0, "pairs_not_searched": 0}
        """What was not searched on the grid, as attributes of the dataset."""
        self._asked: list[Asked] = []
        """The cells requested last."""
        self._asking = self._search()

    def estimate(self) -> str:
        words = f"then:   about {_A_POINT} simulations for each point where a curve crosses a line of the grid, "
        words += f"over {self.across[0]} and {self.across[1]}, and 2 or more between two points"
        return f"{estimate(self.config)}\n{words}"

    def ask(self) -> Mapping[str, Array]:
        if not self.rounds:
            columns = self.grid.given()
            return {name: columns[name] for name in self.config.axes}
        self._asked = next(self._asking, [])
        rows = [each.parameters(place) for _, each, place in self._asked]
        return {name: np.array([row[name] for row in rows]) for name in self.config.axes}

    def _search(self) -> Iterator[list[Asked]]:
        """Follow the curves, then narrow all brackets, with error estimates at their ends."""
        self.tolerance = self.sharp(self.deviation)
        yield from iter(self._followed, [])
        self.tolerance, self.estimates = self.sharp(self.width), self.config.integrator.estimate_errors
        points = [(curve, point, set(point.cells)) for curve in self.curves for point in curve.points]
        for _, point, _ in points:
            point.narrow(self.width)
        yield from iter(self._wanted, [])
        yield [
            (curve, point, end)
            for curve, point, before in points
            for end in (point.root.low, point.root.high)
            if end in before and point.found
        ]

    def _followed(self) -> list[Asked]:
        for curve in self.curves:
            curve.grow(self.deviation)
        return self._wanted()

    def _wanted(self) -> list[Asked]:
        return [(curve, each, place) for curve in self.curves for each in curve.searched() for place in each.wanted()]

    def learn(self, found: Mapping[str, Array]) -> None:
        counts = self._counts(found)
        if len(self.rounds) == 1:
            self._grid["cells_not_final"] = int((found["status"] == TIME_LIMIT).sum())
            self.curves = list(self._curves(counts))
            return
        sure = found.get("certain", counts.known)
        levels = np.array([curve.level for curve, *_ in self._asked])
        cells = map(Cell, counts.distance(levels), counts.reversals, sure, counts.borders(levels))
        for (_, each, place), cell in zip(self._asked, cells, strict=True):
            each.learn(place, cell)

    def _counts(self, found: Mapping[str, Array]) -> Counts:
        """Return the counts of the cells requested last, among which brackets are sought."""
        return Counts.of(found)

    def dataset(self) -> xr.Dataset:
        """Return the dataset of the points, with the cost of the search."""
        columns = self._columns()
        head: dict[str, Any] = dict(zip("xy", self.across, strict=False)) | self.attributes() | self._grid
        if len(self.across) == 2:
            off = sum(not middle.confirmed for curve in self.curves for middle in curve.middles.values())
            head |= {"deviation": self.deviation, "middles_off": off}
        title = f"{self.config.name}: boundaries ({self.config.model} model)"
        own = variables(POINTS, ["point"], columns)
        own["bracket"] = xr.Variable("point", columns["bracket"], {"long_name": "axis along which the bracket lies"})
        places = {name: xr.Variable("point", columns[name], self.config.described(name)) for name in self.config.axes}
        for name, axis in self.axes.items():
            spacing = "log" if axis.spacing == "log" else "linear"
            places[name].attrs |= {"actual_range": axis.values[[0, -1]], "spacing": spacing}
        fixed = {
            name: xr.Variable((), value, self.config.described(name)) for name, value in self.grid.constants.items()
        }
        return xr.Dataset(own, {**places, **fixed}, {"Conventions": "CF-1.11", "title": title, **head})

    def _columns(self) -> dict[str, Array]:
        """Return the variables and coordinates of all points, by name."""
        pieces = ((curve.level, *piece) for curve in self.curves for piece in curve.pieces())
        rows = [
            {"level": level, "curve": number, "closed": closed, **point.row()}
            for number, (level, points, closed) in enumerate(pieces)
            for point in points
        ]
        return {name: np.array([row[name] for row in rows]) for name in (*POINTS, "bracket", *self.config.axes)}

    def _curves(self, found: Counts) -> Iterator[Curve]:
        """Return the curves located by the cells of the grid."""
        names, (x, y) = list(self.config.axes), self.across
        others = [name for name in names if name not in self.across]
        order = [names.index(name) for name in (*others, y, x)]
        tables = [np.transpose(each.reshape(self.grid.shape), order) for each in vars(found).values()]
        for at in product(*(range(len(self.config.axes[name])) for name in others)):
            cell = {name: self.config.axes[name][i] for name, i in zip(others, at, strict=True)}
            counts = Counts(*(_sorted(each[at], self.config.axes[y], self.config.axes[x]) for each in tables))
            self._grid["pairs_not_searched"] += _not_searched(counts)
            rows, columns = (Axis(name, np.arange(len(self.config.axes[name]))) for name in (y, x))
            for level in counts.levels():
                distance = counts.distance(level)
                known = distance, counts.reversals, counts.known, counts.borders(level)
                for xs, ys in contours(_levelled(distance), columns, rows, corners=True):
                    places = [at for at in zip(xs.tolist(), ys.tolist(), strict=True) if _on_an_edge(at)]
                    closed = len(places) > 1 and places[0] == places[-1]
                    points = [self._edge(known, place, cell) for place in places[: -1 if closed else None]]
                    yield Curve(level, closed, (self.axes[x], self.axes[y]), points)

    def _edge(self, known: tuple[Array, ...], at: tuple[float, float], others: dict[str, float]) -> Point:
        """Return the point on the edge at `at`, in indices along x and y, one of which is whole.

        `known` holds distances, counts, and masks of certain and measured cells, of shape (y, x).
        """
        x, y = self.across
        horizontal = abs(at[0] - round(at[0])) > abs(at[1] - round(at[1]))
        along, other = (self.axes[x], self.axes[y]) if horizontal else (self.axes[y], self.axes[x])
        first, whole = int(np.floor(at[not horizontal])), round(at[horizontal])
        pair = (whole, slice(first, first + 2)) if horizontal else (slice(first, first + 2), whole)
        places = along.straight(along.values[first : first + 2]).tolist()
        cells = dict(zip(places, map(Cell, *(each[pair].tolist() for each in known)), strict=True))
        return Point.between(along, others | {other.name: float(other.values[whole])}, cells, places, self.deviation)


class Along(Boundaries):
    """A search along one axis, whose curves are single points."""

    def __init__(self, config: Config, store: Store, across: tuple[str, ...], width: float, deviation: float) -> None:
        super().__init__(config, store, across, width, deviation)
        (self.along,) = self.axes.values()
        self.estimates = config.integrator.estimate_errors
        self._grid = {"cells_not_final": 0}

    def estimate(self) -> str:
        words = f"then:   cells where the slow equations estimate another count, and about {_A_POINT} for each change"
        return f"{estimate(self.config)}\n{words}"

    def ask(self) -> Mapping[str, Array]:
        if self.rounds:
            return super().ask()
        places = self._first()
        fixed = {name: np.full(len(places), values[0]) for name, values in self.config.axes.items()}
        return fixed | {self.along.name: places}

    def _first(self) -> Array:
        """Return the values of the axis, and the middle of each stretch between them with another estimated count."""
        values = self.along.values
        if Offer.ENDING not in self.config.tier.offers:
            return values
        parts = -(-(_PLACES - 1) // (len(values) - 1))
        at = np.arange(parts * (len(values) - 1) + 1)
        places = self.along.bent(np.interp(at / parts, np.arange(len(values)), self.along.straight(values)))
        given = {name: np.full(len(places), column[0]) for name, column in self.grid.given().items()}
        columns = self.config.assembly.body(given | {self.along.name: places})
        possible = ~self.config.equations.impossible(columns)
        at, places, columns = at[possible], places[possible], take(columns, possible)
        counts = estimates(self.config.equations, columns, check=False)["reversals_estimated"]
        ends = [0, *(np.flatnonzero(np.diff(counts)) + 1), len(at)]
        between = [(first + last) // 2 for first, last in pairwise(ends) if (at[first:last] % parts).all()]
        return np.sort(np.concatenate([values, places[between]]))

    def _search(self) -> Iterator[list[Asked]]:
        """Narrow all brackets, and those with uncertain cells from outside."""
        self.tolerance = self.sharp(self.width)
        yield from iter(self._wanted, [])

    def _counts(self, found: Mapping[str, Array]) -> Counts:
        certain = found["certain"] == 1 if "certain" in found else found["status"] == SETTLED
        return replace(Counts.of(found), known=certain)

    def _curves(self, found: Counts) -> Iterator[Curve]:
        """Return a curve with one point for each count that begins between two neighbours with certain counts."""
        places = self.along.straight(self.rounds[0][self.along.name]).tolist()
        others = {name: values[0] for name, values in self.config.axes.items() if name != self.along.name}
        for two in pairwise(np.flatnonzero(found.known).tolist()):
            few, many = sorted(int(found.reversals[i]) for i in two)
            ends = [places[i] for i in two]
            for level in range(few + 1, many + 1):
                distance, measured = found.distance(level), found.borders(level)
                cells = {places[i]: Cell(float(distance[i]), int(found.reversals[i]), True, measured[i]) for i in two}
                point = Point.between(self.along, others, cells, ends, self.deviation)
                point.narrow(self.width)
                point.root.closer = CLOSER
                yield Curve(level, False, (self.along,), [point])


def _sorted(table: Array, y: tuple[float, ...], x: tuple[float, ...]) -> Array:
    return np.asarray(table[np.ix_(np.argsort(y), np.argsort(x))])


def _on_an_edge(at: tuple[float, float]) -> bool:
    """Return whether a place, in indices, lies between two neighbours and not on a diagonal by an unknown cell."""
    return min(abs(index - round(index)) for index in at) < _ON


def _not_searched(counts: Counts) -> int:
    """Count neighbouring pairs with different counts but no contour between them: too little is known around them."""
    found = 0
    for turned in (np.asarray, np.transpose):
        reversals, known = turned(counts.reversals), turned(counts.known)
        left_out = np.zeros((len(known), known.shape[1] - 1), bool)
        for level in counts.levels():
            finite, more = np.isfinite(turned(counts.distance(level))), reversals >= level
            pairs = finite[:, 1:] & finite[:, :-1]
            beside = np.pad(finite[:, 1:] | finite[:, :-1], ((1, 1), (0, 0)))
            searched = pairs & (beside[:-2] | beside[2:])
            left_out |= (more[:, 1:] != more[:, :-1]) & known[:, 1:] & known[:, :-1] & ~searched
        found += int(left_out.sum())
    return found


def _levelled(distance: Array) -> Array:
    """Return numbers with the same signs, similar enough that a contour passes through the middle part of each edge."""
    side = np.where(distance > 0, 1, -1)  # a cell may lie exactly on the boundary
    return np.asarray(side * (2 + np.tanh(np.abs(distance) / np.nanmax(np.abs(distance), initial=1e-300))))
