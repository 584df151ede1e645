"""The page of one visitor: the map and its controls, the chosen cells and their trajectories."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.models import Column, ColumnDataSource, CustomJS, Div

from sweep.explore import controls, export, figure, page
from sweep.explore import state as states
from sweep.explore.cells import News, Runner
from sweep.explore.chosen import CellControls
from sweep.explore.colours import CURVES
from sweep.explore.controls import escaped
from sweep.explore.curves import Curves
from sweep.explore.drawn import Drawn
from sweep.explore.lines import critical_lines
from sweep.explore.saving import Saving
from sweep.explore.setup import Setup
from sweep.explore.slices import Source
from sweep.explore.state import Cell, State
from sweep.parameters import PARAMETERS
from sweep.plots import labels

_BESIDE = ("reversals", "reversals_predicted", "status")
"""What the pointer shows of a cell at once; the server adds everything else."""


class View:
    """Everything on one page.  Each change goes through `_change`, which draws what differs and writes the address."""

    def __init__(
        self,
        document: Document,
        source: Source,
        setup: Setup | None,
        runner: Runner,
        query: Mapping[str, Sequence[str]],
    ) -> None:
        self._document, self._source, self._setup = document, source, setup
        self._base: Cell = setup.base if setup else {}
        self._known = setup.config.table if setup else PARAMETERS
        self.state, self._faults = states.read(query, source, self._base, self._known)
        self._shown: figure.Map | None = None
        self._build()
        self._drawn = Drawn(self.state.cells, setup, runner, self._tell)
        self._draw_map()
        self._draw_cells()
        document.on_session_destroyed(lambda _: self._drawn.leave())

    # ---- parts of the page

    def _build(self) -> None:
        self._address = ColumnDataSource({"query": [""]}, name="address")
        self._address.js_on_change("data", CustomJS(code="sweep.address(cb_obj.data.query[0])"))
        self._probe = ColumnDataSource({"i": [-1], "j": [-1]}, name="probe")
        controls.on(self._probe, "data", lambda _: self._point())
        self._request = ColumnDataSource({"i": [-1], "j": [-1], "add": [False], "count": [0]}, name="request")
        controls.on(self._request, "data", lambda _: self._requested())
        self._map = Column(sizing_mode="stretch_width", name="map")
        self._legend = Div(sizing_mode="stretch_width", name="legend")
        self._cell = Div(sizing_mode="stretch_width", name="cell")
        self._notice = Div(name="notice", styles={"color": "white"})
        self._notice.js_on_change("text", CustomJS(code="sweep.notice(cb_obj.text)"))
        args = {"address": self._address, "notice": self._notice}
        code = "sweep.address(address.data.query[0]); sweep.notice(notice.text)"
        self._document.js_on_event("document_ready", CustomJS(args=args, code=code))
        self._figures = Curves()
        self._controls = controls.MapControls(self._source, self._change)
        self._chosen = CellControls(self._source, self._base, self._known, self._edit, self._activate, self._remove)
        self._hint = Div(text=controls.EMPTY, sizing_mode="stretch_width")
        plots = (self._figures.spin, self._figures.energy)
        curves = Column(self._hint, *plots, sizing_mode="stretch_width", name="curves")
        path = Column(self._figures.path, self._figures.player, sizing_mode="stretch_width", name="path")
        self._shown_with = {"spin": plots[:1], "energy": plots[1:], "contact_x": path.children}
        self._saving = Saving(
            self._source, self._netcdf, self._yaml if self._setup else None, self._map,
            [self._figures.spin, self._figures.energy, self._figures.path],
        )  # fmt: skip
        # The address travels with a root: what a callback of the document alone refers to is not kept up to date.
        self._saving.root.tags = [self._address]
        for root in (self._controls.root, self._notice, self._map, self._legend, self._cell, curves, path,
                     self._chosen.root, self._saving.root):  # fmt: skip
            self._document.add_root(root)
        page.dress(self._document, self._source, live=True)

    # ---- the map

    def _change(self, state: State) -> None:
        """Show another map."""
        if state != self.state:
            self.state = state
            self._faults = []
            self._draw_map()
            self._draw_cells()

    def _draw_map(self) -> None:
        state = self.state
        beside = tuple(n for n in _BESIDE if n in self._source.variables)
        part = self._source.slice(state.show, state.x, state.y, state.at, beside)
        columns = {state.show: part.values, **{name: part.dataset[name].values for name in beside}}
        lines = critical_lines(self._source, part, state.at)
        if self._shown is None or self._shown.axes != (state.x, state.y):
            self._shown = figure.Map(self._source, part.x, part.y, self._probe, self._request)
            self._map.children = [self._shown.figure]
            controls.on(self._shown.cursor, "data", lambda _: self._point())
        self._part = part
        self._legend.text = page.legend(part, self._shown.show(part, columns, lines), lines)
        self._controls.show(state)

    def _index(self, i: int, j: int) -> dict[str, int] | None:
        """The index of a cell of the map on every axis; None for a place without a cell."""
        if not (0 <= i < len(self._part.x.values) and 0 <= j < len(self._part.y.values)):
            return None
        index = {**self.state.at, self.state.x: i}
        return {**index, self.state.y: j} if self.state.y else index

    def _place(self, source: ColumnDataSource) -> dict[str, int] | None:
        """The cell that the browser wrote into `source`, which may be anything."""
        data = [source.data.get(key) for key in ("i", "j")]
        if not all(isinstance(d, list | np.ndarray) and len(d) and isinstance(d[0], int | np.integer) for d in data):
            return None
        return self._index(int(data[0][0]), int(data[1][0]))

    def _point(self) -> None:
        """Tell about the cell under the pointer, or else about the chosen one."""
        index = self._place(self._probe)
        if index is None and self._shown:
            index = self._place(self._shown.cursor)
        if index is None:
            self._cell.text = controls.HINT if self._setup else controls.still(self._source)
            return
        here = {labels.symbol(d): f"{self._source.axes[d].values[index[d]]:.6g}" for d in self._source.dims}
        self._cell.text = controls.table(here, self._source.describe(index))

    # ---- the cells whose trajectories are drawn

    def _requested(self) -> None:
        """A click, or Enter: run the cell."""
        index = self._place(self._request)
        if index is None or not self._setup:
            return
        cell = {**self._setup.base, **self._source.parameters_at(tuple(self._setup.base), index)}
        self._add(cell, beside=bool(self._request.data["add"][0]) or self._chosen.keeps)

    def _add(self, cell: Cell, *, beside: bool) -> None:
        if cell in self._drawn.cells:
            self._activate(self._drawn.cells.index(cell))
            return
        self._faults = []
        self._drawn.add(cell, beside=beside)
        self._draw_cells()

    def _edit(self, name: str, value: float) -> None:
        """Run the active cell with another value of a parameter."""
        if not self._drawn.cells or not self._setup:
            return
        if fault := states.wrong_value(self._known[name], value):
            self._faults = [fault]
            self._draw_progress()
            return
        self._faults = []
        self._drawn.change({**self._drawn.cells[self._drawn.active], name: value})
        self._draw_cells()

    def _activate(self, k: int) -> None:
        self._drawn.active = k
        self._draw_cells()

    def _remove(self, k: int) -> None:
        self._drawn.remove(k)
        self._draw_cells()

    def _tell(self, key: int, news: News) -> None:
        """Called on the thread of the trajectories."""
        self._document.add_next_tick_callback(partial(self._hear, key, news))

    def _hear(self, key: int, news: News) -> None:
        if self._drawn.hear(key, news):
            self._faults = [news.fault] if news.fault else self._faults
            if news.curve:
                self._draw_curves()
            self._draw_progress()

    def _draw_cells(self) -> None:
        """The list of cells, their pins on the map, the curves and the address."""
        cells, source = self._drawn.cells, self._source
        self.state = replace(self.state, cells=tuple(cells))
        self._chosen.show(cells, self._names(), self._drawn.active)
        x, y = self.state.x, self.state.y
        on_map = [(k, cell) for k, cell in enumerate(cells) if x in cell and (not y or y in cell)]
        here = {d: source.axes[d].values[i] for d, i in self.state.at.items() if d not in (x, y)}
        assert self._shown
        self._shown.pins.data = {
            "x": [source.axes[x].place(cell[x]) for _, cell in on_map],
            "y": [source.axes[y].place(cell[y]) if y else 0.0 for _, cell in on_map],
            "colour": [CURVES[k] for k, _ in on_map],
            "number": [str(k + 1) for k, _ in on_map],
            "alpha": [1.0 if all(cell.get(d, v) == v for d, v in here.items()) else 0.45 for _, cell in on_map],
        }
        self._draw_curves()
        self._draw_progress()
        self._point()
        self._address.data = {"query": [self._query()]}

    def _draw_curves(self) -> None:
        names = [
            f"{k + 1}: {name}" + (f", {labels.reversals(len(curve.reversals))}" if curve else "")
            for k, (name, curve) in enumerate(zip(self._names(), self._drawn.curves, strict=True))
        ]
        self._hint.visible = not any(self._drawn.curves)
        drawn = [curve.dataset for curve in self._drawn.curves if curve]
        for series, parts in self._shown_with.items():
            for part in parts:
                part.visible = any(series in one for one in drawn)
        self._figures.show(self._drawn.curves, names, self._drawn.active)
        self._chosen.tell(self._drawn.curves)

    def _names(self) -> list[str]:
        """What tells the cells apart."""
        cells, base = self._drawn.cells, self._base
        varied = [n for n in base if n not in self._source.dims and any(cell[n] != base[n] for cell in cells)]
        varied = [*(n for n in self._source.dims if n in base), *varied]
        return [", ".join(labels.value(n, cell[n]) for n in varied) or "the cell" for cell in cells]

    def _draw_progress(self) -> None:
        names = self._names()
        told = [f'<div class="fault">{escaped(fault)}</div>' for fault in self._faults]
        lines = [
            controls.progress(f"{names[k]}: {news.note or f'{news.share:.0%}'}", news.share)
            for k, news in self._drawn.running()
        ]
        self._notice.text = "".join([*told, *lines])

    # ---- files

    def _query(self) -> str:
        return states.write(self.state, self._source, self._base)

    def _netcdf(self) -> bytes:
        return export.netcdf(self._source, self._query(), self.state, [curve for curve in self._drawn.curves if curve])

    def _yaml(self) -> bytes:
        assert self._setup
        return export.yaml(self._source, self._setup, self.state, f"{self._saving.stem}.yaml").encode()


def make(source: Source, setup: Setup | None, runner: Runner) -> Callable[[Document], None]:
    """What fills the document of each visitor."""
    if setup:
        runner.warm_up(setup)

    def fill(document: Document) -> None:
        request: Any = document.session_context.request if document.session_context else None
        given = request.arguments if request else {}
        query = {key: [v.decode(errors="replace") for v in values] for key, values in given.items()}
        View(document, source, setup, runner, {k: v for k, v in query.items() if not k.startswith("bokeh-")})

    return fill
