"""The page of one visitor: the map and its controls, the chosen cells and their trajectories."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any
from urllib.parse import parse_qs

from bokeh.document import Document
from bokeh.models import Button, Column, ColumnDataSource, CustomJS, Div, Row

from sweep.explorer import bodies, controls, figure, page
from sweep.explorer import state as states
from sweep.explorer.curves import Curves
from sweep.explorer.guard import KEY
from sweep.explorer.page import PARTS
from sweep.explorer.runner import Curve, Drawn, Job, Runner
from sweep.explorer.setup import Setup, why_still
from sweep.explorer.slices import Source
from sweep.explorer.state import Cell, State
from sweep.explorer.style import CURVES, DARK
from sweep.plots import labels

_NOTICE = {"background": "#1b2733", "border-radius": "8px", "color": "white", "padding": "6px 16px"}


class View:
    """Everything on one page.  Each change goes through `_change`, which draws what differs and writes the address."""

    _shown: figure.MapFigure
    _curves: Sequence[Curve | None] = ()
    """The curves on the page."""
    _first: dict[str, int] | None = None
    """The cell whose values are shown until the pointer is on another one."""
    _other: bodies.Body | None = None
    """The job that counts the reversals of another body, if the page shows one."""
    _counts: bodies.Counts | None = None
    """The counts that the map shows; None if it shows the dataset."""

    def __init__(
        self, document: Document, source: Source, setup: Setup | None, runner: Runner | None,
        query: Mapping[str, Sequence[str]],
    ) -> None:  # fmt: skip
        self._document, self._source, self._setup = document, source, setup
        self._base: Cell = setup.base if setup else {}
        self._known = setup.config.table if setup else {}
        self.state, self._faults = states.read(query, source, self._base, self._known)
        self._constants = bodies.can_change(setup, source)
        if self.state.changed and not self._constants:
            self._faults.append("with: counts of other bodies cannot be estimated here")
            self.state = replace(self.state, changed={})
        self._build()
        self._runner = runner
        at_first_sight = not query and setup is not None and runner is not None
        if at_first_sight:
            self._first = states.telling(source, self.state)
            self.state = replace(self.state, cells=(self._cell_at(self._first),))
        self._figures.player.play_at_once(at_first_sight)
        self._drawn = Drawn(self.state.cells, runner, self._report)
        self._count_others()
        self._draw_map()
        self._draw_cells()
        page.dress(document, source, self._query())
        document.on_session_destroyed(lambda _: self._leave())

    # ---- parts of the page

    def _build(self) -> None:
        # The server writes the address of the page to the first; the browser writes that to go back to to the second.
        self._address, self._wanted = ColumnDataSource({"query": []}), ColumnDataSource({"query": []}, name="wanted")
        self._address.js_on_change("data", CustomJS(code="sweep.address(cb_obj.data.query[0])"))
        controls.on(self._wanted, "data", lambda data: self._visit(str(data["query"][0])))
        self._map = Column(sizing_mode="stretch_width", name="map")
        # Bokeh would read mathematics, with links and HTML, in texts of a dataset or of an address.
        plain: dict[str, Any] = {"disable_math": True, "sizing_mode": "stretch_width"}
        self._legend, self._cell = Div(name="legend", **plain), Div(name="cell", **plain)
        self._notice = Div(name="notice", styles=_NOTICE, margin=0, **plain)
        self._figures = Curves(str(PARTS.empty()))
        self._controls = controls.MapControls(self._source, self._change)
        self._body = controls.BodyControls(self._source, self._constants, self._known, self._change)
        edits = self._edit, self._activate, self._remove
        self._chosen = controls.CellControls(self._source, self._base, self._known, *edits)
        self._document.js_on_event("document_ready", self._figures.player.begin)
        self._document.js_on_event(
            "document_ready", CustomJS(args={"wanted": self._wanted}, code="sweep.ready(wanted)")
        )
        self._document.config.notify_connection_status = False  # the page says it in words of its own
        for event, lost in (("connection_lost", "true"), ("client_reconnected", "false")):
            self._document.js_on_event(event, CustomJS(code=f"sweep.ended({lost})"))
        for root in (self._controls.root, self._notice, self._map, self._legend, self._body.root, self._cell,
                     self._figures.root, self._figures.player.root, self._chosen.root, self._link()):  # fmt: skip
            self._document.add_root(root)

    # ---- the map

    def _change(self, change: Callable[[State], State]) -> None:
        """Show another map."""
        if (state := change(self.state)) != self.state:
            self.state = state
            self._faults = []
            stays = self._count_others() and self._shown.axes == (state.x, state.y)
            if not stays:
                self._draw_map()
            self._draw_cells()

    def _visit(self, address: str) -> None:
        """Show what an address names, when the visitor goes back to it."""
        query = parse_qs(address.removeprefix("?"), keep_blank_values=True)
        state, faults = states.read(query, self._source, self._base, self._known)
        self._drawn.show(state.cells)
        self._change(lambda _: state)
        self._faults = faults
        self._draw_cells()

    def _count_others(self) -> bool:
        """Count for the body of the state if it is another one; return whether counts are about to come."""
        old, state = self._other, self.state
        if old and old.counts_for(state):
            return False
        self._leave_other()
        if state.changed and self._runner and {state.x, state.y} - {""} <= self._base.keys():
            last = old.curve if old and self._shown.axes == (state.x, state.y) else None
            self._other = bodies.Body(state.changed, self._report, curve=last, source=self._source, state=state)
            self._runner.submit(self._other)
        return self._other is not None

    def _leave_other(self) -> None:
        if self._other:
            self._other.dropped, self._other = True, None

    def _draw_map(self) -> None:
        if not self._map.children or self._shown.axes != (self.state.x, self.state.y):
            self._shown = figure.MapFigure(self._source, self.state.x, self.state.y, self._first)
            self._map.children = [self._shown.figure, self._shown.cuts]
            controls.on(self._shown.probe, "data", lambda _: self._point())
            controls.on(self._shown.request, "data", lambda _: self._requested())
        self._counts = counts = self._other.curve if self._other else None
        self._legend.text = page.legend(*self._shown.show(self.state, counts.dataset if counts else None))
        self._controls.show(self.state)
        self._body.show(self.state)

    def _place(self, source: ColumnDataSource) -> dict[str, int] | None:
        """The index on every axis of the cell that the browser wrote into `source`; None if it wrote no cell."""
        i, j = (int(source.data[key][0]) for key in ("i", "j"))
        across, up = self._shown.placed
        if not (0 <= i < len(across.values) and 0 <= j < len(up.values)):
            return None
        index = {**self.state.at, self.state.x: i}
        return {**index, self.state.y: j} if self.state.y else index

    def _point(self) -> None:
        """Show the values of the cell under the pointer, or else of the chosen one."""
        index = self._place(self._shown.probe) or self._first
        if index is None:
            self._cell.text = str(PARTS.hint("" if self._setup else why_still(self._source)))
            return
        dataset, axes = self._source.dataset, self._source.axes
        here = [labels.measured(dataset, d, axes[d].values[index[d]]) for d in self._source.dims]
        if self._counts:
            here.append(bodies.changes(self._source, self.state.changed))
            self._cell.text = str(PARTS.cell(", ".join(here), "", self._counts.values_at(index), {}))
            return
        values = self._source.values_at(index)
        self._cell.text = str(PARTS.cell(", ".join(here), values.pop("note", ""), values, self._source.meanings))

    # ---- the cells whose trajectories are drawn

    def _requested(self) -> None:
        """Run the cell that was clicked, or chosen with Enter."""
        index = self._place(self._shown.request)
        if index is None or not self._setup:
            return
        cell = self._cell_at(index)
        if cell in self._drawn.cells:
            self._activate(self._drawn.cells.index(cell))
            return
        self._faults = []
        self._drawn.add(cell, keep=bool(self._shown.request.data["add"][0]))
        self._draw_cells()

    def _cell_at(self, index: Mapping[str, int]) -> Cell:
        """Return the parameters of a cell, of the body that is shown."""
        return {**self._base, **self._source.parameters_at(tuple(self._base), index), **self.state.changed}

    def _edit(self, name: str, value: float) -> None:
        """Run the active cell with another value of a parameter."""
        if not self._drawn.cells:
            return
        fault = states.wrong_value(self._known[name], value)
        self._faults = [fault] if fault else []
        if not fault:
            self._drawn.change({**self._drawn.cells[self._drawn.active], name: value})
        self._draw_cells()

    def _activate(self, k: int) -> None:
        self._drawn.active = k
        self._draw_cells()

    def _remove(self, k: int) -> None:
        self._drawn.remove(k)
        self._draw_cells()

    def _report(self, job: Job) -> None:
        """Pass a change of a run on to the page; called on the thread of the trajectories."""
        try:
            self._document.add_next_tick_callback(partial(self._update, job))
        except AttributeError:  # Bokeh dismantles the document of a closed page before it reports the closing
            job.dropped = True

    def _update(self, job: Job) -> None:
        if not job.dropped:
            self._faults = [job.fault] if job.fault else self._faults
            if job is self._other and job.curve is not self._counts:
                self._draw_map()
            if self._drawn.curves != self._curves:
                self._draw_curves()
            self._draw_progress()

    def _draw_cells(self) -> None:
        """Draw the list of cells, their pins on the map and the curves, and write the address."""
        cells, source = self._drawn.cells, self._source
        self.state = replace(self.state, cells=tuple(cells))
        self._chosen.show(cells, self._names(), self._drawn.active)
        x, y = self.state.x, self.state.y
        on_map = [(k, cell) for k, cell in enumerate(cells) if x in cell and (not y or y in cell)]
        here = {d: source.axes[d].values[i] for d, i in self.state.at.items() if d not in (x, y)}
        self._shown.pins.data = {
            "x": [source.axes[x].place(cell[x]) for _, cell in on_map],
            "y": [source.axes[y].place(cell[y]) if y else 0.0 for _, cell in on_map],
            "colour": [CURVES[k] for k, _ in on_map],
            "number": [str(k + 1) for k, _ in on_map],
            "ink": ["white" if CURVES[k] in DARK else "black" for k, _ in on_map],
            "alpha": [1.0 if all(cell.get(d, v) == v for d, v in here.items()) else 0.45 for _, cell in on_map],
        }
        self._draw_curves()
        self._draw_progress()
        self._point()
        self._address.data = {"query": [self._query()]}

    def _draw_curves(self) -> None:
        curves = self._drawn.curves
        if not any(curves) and any(self._drawn.running()):
            return  # the last curves stay until the first new one is there, because making the figures anew takes 0.3 s
        self._curves = curves
        named = enumerate(zip(self._names(), curves, strict=True), 1)
        names = [f"{k}: {name}{_counted(curve)}" for k, (name, curve) in named]
        self._figures.show(curves, names, self._drawn.active)
        self._chosen.show_ends(curves)

    def _names(self) -> list[str]:
        """Name each cell by what distinguishes it from the others."""
        cells, base = self._drawn.cells, self._base
        varied = [n for n in base if n not in self._source.dims and any(cell[n] != base[n] for cell in cells)]
        varied = [*(n for n in self._source.dims if n in base), *varied]
        return [", ".join(labels.value(n, cell[n]) for n in varied) or "the cell" for cell in cells]

    def _draw_progress(self) -> None:
        names = self._names()
        jobs = [(names[k], job) for k, job in self._drawn.running()]
        jobs += [("counts of another body", self._other)] if self._other and not self._other.over else []
        running = [(f"working on {name}: {job.delay or f'{job.share:.0%}'}", job.share) for name, job in jobs]
        self._notice.text = str(PARTS.notice(self._faults, running))
        self._notice.visible = bool(self._faults or running)

    def _leave(self) -> None:
        self._leave_other()
        self._drawn.leave()

    def _query(self) -> str:
        return states.write(self.state, self._source, self._base)

    def _link(self) -> Row:
        """Make the button that copies the address."""
        link = Button(label="Copy link", name="link", width=92)
        link.js_on_click(CustomJS(args={"button": link}, code="sweep.copy(button)"))
        # The address is attached to a root, because models that only a callback of the document refers to are not
        # updated.
        return Row(link, name="share", tags=[self._address, self._wanted], stylesheets=[controls.WIDGETS])


def _counted(curve: Curve | None) -> str:
    return f", {labels.reversals(len(curve.reversals))}{'' if curve.whole else ' …'}" if curve else ""


def _end(job: Job) -> None:
    """Drop a job once it has the beginning of its curve."""
    job.dropped = job.curve is not None


def make(source: Source, setup: Setup | None) -> Callable[[Document], None]:
    """A function that fills the document of each visitor."""
    runner = Runner(setup) if setup else None
    if setup and runner:
        # Compiles the simulation, or loads it from the cache, before the first click needs it.
        runner.submit(Job(setup.base, _end))

    def fill(document: Document) -> None:
        context: Any = document.session_context
        given = context.request.arguments.items()
        own = {key: values for key, values in given if not key.startswith("bokeh-") and key != KEY}
        query = {key: [value.decode(errors="replace") for value in values] for key, values in own.items()}
        View(document, source, setup, runner, query)

    return fill
