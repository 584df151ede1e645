"""What the visitor handles: which map is shown, which cells are drawn, what is saved."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from bokeh.models import (
    Button,
    Checkbox,
    Column,
    ColumnDataSource,
    CustomJS,
    Div,
    RadioButtonGroup,
    Row,
    Select,
    Slider,
    Spinner,
)  # fmt: skip

from sweep.explore.cells import Curve
from sweep.explore.colours import CURVES
from sweep.explore.slices import Axis, Source
from sweep.explore.state import MAX_CELLS, Cell, State
from sweep.parameters import PARAMETERS
from sweep.plots import labels

_SOFT = '<p style="color:#5b6875">{}</p>'

HINT = _SOFT.format(
    "Point at a cell to read it. <b>Click</b> it to run its trajectory, with <b>Shift</b> to add it to those drawn. "
    "With the keyboard: arrows choose a cell, Enter runs it."
)
EMPTY = _SOFT.format("The trajectories of the cells that you click are drawn and played here.")

_BUTTONS = 6
"""Values of an axis that have a button each; more share a slider."""

_COUNTS = {"reversals": "simulated", "reversals_predicted": "predicted", "difference": "difference"}

_BARE = ":host { margin: 0 } .bk-input-group label { font-size: 12px; color: #5b6875 }"


def still(source: Source) -> str:
    """The hint for a file from which no trajectory is run."""
    why = "This file tells no configuration to run trajectories from."
    if place := source.dataset.attrs.get("model_place"):
        why = f"Its model is code of a user, {escaped(str(place))}, which the explorer does not run."
    return _SOFT.format(f"Point at a cell to read it. {why}")


def escaped(text: str) -> str:
    return html.escape(text)


def on(model: Any, name: str, call: Callable[[Any], None]) -> None:
    """Call `call` with each new value of a property."""

    def changed(attr: str, old: Any, new: Any) -> None:  # noqa: ARG001  Bokeh looks at the names
        call(new)

    model.on_change(name, changed)


def table(here: Mapping[str, str], told: Mapping[str, str]) -> str:
    """A cell's place and all its values as HTML."""
    head = ", ".join(f"{escaped(name)} = {escaped(value)}" for name, value in here.items())
    rows = "".join(
        f'<tr><td style="color:#5b6875;padding:2px 12px 2px 0;vertical-align:top">{escaped(name)}</td>'
        f'<td style="font-weight:600;text-align:right;vertical-align:top;white-space:nowrap">{escaped(value)}</td></tr>'
        for name, value in told.items()
        if name != "note"
    )
    note = f'<p style="margin:6px 0;color:#8a4b00">{escaped(told["note"])}</p>' if "note" in told else ""
    return (
        f'<div style="font-size:16px;font-weight:650;margin-bottom:4px">{head}</div>{note}'
        f'<table style="border-collapse:collapse;font-size:12.5px;width:100%">{rows}</table>'
    )


def progress(text: str, share: float) -> str:
    """A line with a bar."""
    bar = f'<div style="width:{100 * share:.0f}%;height:4px;background:#56b4e9;border-radius:2px"></div>'
    return f'<div>{escaped(text)}<div style="background:#fff4;border-radius:2px">{bar}</div></div>'


class MapControls:
    """Which variable is shown, over which axes, and where on the others."""

    def __init__(self, source: Source, change: Callable[[State], None]) -> None:
        self._source, self._change = source, change
        self._state: State | None = None
        self._counts = [n for n in _COUNTS if n in source.variables]
        others = [(n, source.words(n)) for n in source.variables if n not in self._counts]
        names = [_COUNTS[n] for n in self._counts]
        self._count = RadioButtonGroup(labels=names, active=None, name="count", stylesheets=[_BARE],
                                       visible=bool(names))  # fmt: skip
        placeholder = [("", "another variable …")] if names else []
        self._other = Select(options=[*placeholder, *others], value="", width=250, name="show", stylesheets=[_BARE])
        options = [(d, source.words(d)) for d in source.dims]
        self._x = Select(title="horizontal axis", options=options, width=150, name="x", stylesheets=[_BARE])
        self._y = Select(
            title="vertical axis", options=options, width=150, name="y", visible=len(options) > 1, stylesheets=[_BARE]
        )
        self._rest = {name: _axis_control(axis) for name, axis in source.axes.items()}
        on(self._count, "active", self._counted)
        on(self._other, "value", lambda name: self._set(show=name))
        for control in (self._x, self._y):
            on(control, "value", lambda _: self._set(axes=(self._x.value, self._y.value)))
        for name, control in self._rest.items():
            event = "active" if isinstance(control, RadioButtonGroup) else "value_throttled"
            on(control, event, partial(self._moved, name))
        groups = [
            _titled("variable", Row(self._count, self._other, styles={"gap": "6px", "flex-wrap": "wrap"})),
            self._x, self._y,
            *(_titled(source.words(d), c) if isinstance(c, RadioButtonGroup) else c for d, c in self._rest.items()),
        ]  # fmt: skip
        self._groups = dict(zip(self._rest, groups[3:], strict=True))
        self.root = Row(children=groups, name="controls", sizing_mode="stretch_width",
                            styles={"gap": "10px 18px", "flex-wrap": "wrap", "align-items": "flex-end"})  # fmt: skip

    def show(self, state: State) -> None:
        """Let the controls say what is shown."""
        self._state = None
        self._count.active = self._counts.index(state.show) if state.show in self._counts else None
        self._other.value = "" if state.show in self._counts else state.show
        self._x.value, self._y.value = state.x, state.y
        along = set(map(str, self._source.field(state.show).dims)) | set(self._source.dims)
        for name, control in self._rest.items():
            self._groups[name].visible = name in along - {state.x, state.y}
            if isinstance(control, RadioButtonGroup):
                control.active = state.at[name]
            else:
                control.value = state.at[name]
        self._state = state

    def _counted(self, k: int | None) -> None:
        if k is not None and 0 <= k < len(self._counts):
            self._set(show=self._counts[k])

    def _moved(self, name: str, index: Any) -> None:
        self._set(at={name: index})

    def _set(
        self, show: str = "", axes: tuple[str, str] | None = None, at: Mapping[str, int] | None = None
    ) -> None:  # fmt: skip
        state = self._state
        if state is None:
            return
        if show in self._source.variables:
            state = replace(state, show=show)
        if axes and set(axes) <= {*self._source.dims, ""}:
            state = state.with_axes(*axes)
        for name, index in (at or {}).items():
            if isinstance(index, int | float) and 0 <= index < len(self._source.axes[name].values):
                state = replace(state, at={**state.at, name: int(index)})
        self._change(state)


def _titled(title: str, control: Any) -> Column:
    return Column(Div(text=escaped(title), styles={"font-size": "12px", "color": "#5b6875"}, margin=0), control)


def _axis_control(axis: Axis) -> RadioButtonGroup | Slider:
    values = [f"{v:.6g}" for v in axis.values]
    if len(values) <= _BUTTONS:
        return RadioButtonGroup(labels=values, active=0, name=f"at {axis.name}", stylesheets=[_BARE])
    symbol = labels.symbol(axis.name)
    slider = Slider(start=0, end=len(values) - 1, step=1, value=0, width=190, show_value=False, name=f"at {axis.name}",
                    title=f"{symbol} = {values[0]}", stylesheets=[_BARE])  # fmt: skip
    code = "cb_obj.title = `${symbol} = ${values[cb_obj.value]}`"
    slider.js_on_change("value", CustomJS(args={"values": values, "symbol": symbol}, code=code))
    return slider


class CellControls:
    """The list of the cells that are drawn, and the parameters of the active one."""

    def __init__(
        self, source: Source, base: Cell, edit: Callable[[str, float], None], activate: Callable[[int], None],
        remove: Callable[[int], None],
    ) -> None:  # fmt: skip
        self._edit = edit
        self._quiet = False
        self._keep = Checkbox(label="keep the curves when another cell is clicked", active=False, name="keep")
        self._rows = [self._row(k, activate, remove) for k in range(MAX_CELLS)]
        self._title = Div(text="", margin=(8, 0, 0, 0))
        self._end = Div(text="", margin=(0, 0, 4, 0), sizing_mode="stretch_width", name="ends")
        self._inputs = {name: self._input(name, source.axes.get(name)) for name in self._order(source, base)}
        wrap = {"gap": "4px 10px", "flex-wrap": "wrap", "align-items": "flex-end"}
        dragged = [Row(*pair, sizing_mode="stretch_width", styles=wrap) for pair in self._inputs.values() if pair[1:]]
        typed = [pair[0] for pair in self._inputs.values() if not pair[1:]]
        grid = Column(*dragged, Row(*typed, sizing_mode="stretch_width", styles=wrap), sizing_mode="stretch_width")
        self._editor = Column(self._title, grid, sizing_mode="stretch_width", visible=False, name="parameters")
        self.root = Column(self._keep, *(row for row, _ in self._rows), self._end, self._editor, name="chosen",
                           sizing_mode="stretch_width", visible=bool(base))  # fmt: skip

    @staticmethod
    def _order(source: Source, base: Cell) -> list[str]:
        """The parameters, those of the axes first."""
        return [*(n for n in source.dims if n in base), *(n for n in base if n not in source.dims)]

    @property
    def keeps(self) -> bool:
        """Whether a click adds a cell rather than replacing those drawn."""
        return bool(self._keep.active)

    def show(self, cells: Sequence[Cell], names: Sequence[str], active: int) -> None:
        for k, (row, button) in enumerate(self._rows):
            row.visible = k < len(cells)
            if row.visible:
                button.label = f"{k + 1}  {names[k]}"
                button.button_type = "primary" if k == active else "default"
        self._editor.visible = bool(cells)
        if cells:
            self._title.text = f"<b>Parameters of {active + 1}</b>"
            self._quiet = True
            for name, controls in self._inputs.items():
                for control in controls:
                    control.value = float(f"{cells[active][name]:.6g}")
            self._quiet = False

    def tell(self, curves: Sequence[Curve | None]) -> None:
        """How long the trajectories took, and how they ended."""
        told = []
        for k, curve in enumerate(curves):
            if curve:
                status = labels.flag_words(curve.dataset, "status")[int(curve.dataset["status"])]
                end = f"{status} at t = {float(curve.dataset['t_stop']):.6g}"
                told.append(f"{k + 1}: {escaped(end)}, run in {curve.seconds:.2g} s")
        self._end.text = "<br>".join(told)

    def _row(self, k: int, activate: Callable[[int], None], remove: Callable[[int], None]) -> tuple[Row, Button]:
        border = f".bk-btn {{ border-left: 8px solid {CURVES[k]} !important; text-align: left }}"
        button = Button(label="", sizing_mode="stretch_width", stylesheets=[border], name=f"cell {k + 1}")
        button.on_click(lambda: activate(k))
        away = Button(label="×", width=36, name=f"remove {k + 1}")
        away.on_click(lambda: remove(k))
        return Row(button, away, visible=False, sizing_mode="stretch_width"), button

    def _input(self, name: str, axis: Axis | None) -> list[Any]:
        """A field for the number, and on an axis of the dataset a slider as well."""
        parameter = PARAMETERS[name]
        allowed = {"title": labels.symbol(name), "stylesheets": [_BARE], "name": f"parameter {name}"}
        field = Spinner(value=0, width=88, step=_step(axis), mode="float", **allowed)
        on(field, "value", partial(self._edited, name))
        if axis is None or len(axis.values) < 2:
            return [field]
        span = axis.values[-1] - axis.values[0]
        ends = axis.values[[0, -1]] + np.array([-0.1, 0.1]) * span
        low, high = (v if parameter.allows(v) else end for v, end in zip(ends, axis.values[[0, -1]], strict=True))
        slider = Slider(start=float(low), end=float(high), step=float(span / 1000), value=float(low), title=None,
                        show_value=False, sizing_mode="stretch_width", min_width=100, name=f"drag {name}",
                        stylesheets=[_BARE])  # fmt: skip
        on(slider, "value", partial(self._edited, name))
        return [field, slider]

    def _edited(self, name: str, value: Any) -> None:
        if not self._quiet and isinstance(value, int | float) and np.isfinite(value):
            self._edit(name, float(f"{value:.10g}"))


def _step(axis: Axis | None) -> float:
    """A step of a field: a round number, about a hundredth of the axis."""
    if axis is None or len(axis.values) < 2:
        return 0.01
    return float(10 ** np.floor(np.log10((axis.values[-1] - axis.values[0]) / 50)))


class Saving:
    """Buttons that save what is seen: the map in the column `plots`, and the other figures."""

    def __init__(
        self, source: Source, netcdf: Callable[[], bytes], yaml: Callable[[], bytes] | None, plots: Column,
        figures: Sequence[Any],
    ) -> None:  # fmt: skip
        # What a name may be in a configuration, whatever the title of the dataset is.
        words = re.sub(r"[^A-Za-z0-9_-]", "", str(source.dataset.attrs.get("title", "")).split(":")[0])
        self.stem = f"{words or 'sweep'}_explored"
        self._file = ColumnDataSource({"bytes": [], "name": [], "type": []}, name="file")
        code = "if (cb_obj.data.name.length) sweep.save(cb_obj.data.bytes[0], cb_obj.data.name[0], cb_obj.data.type[0])"
        self._file.js_on_change("data", CustomJS(code=code))
        png = Button(label="PNG", name="png", width=64)
        args = {"plots": plots, "figures": list(figures), "name": f"{self.stem}.png"}
        png.js_on_click(CustomJS(args=args, code="sweep.picture([...plots.children, ...figures], name)"))
        link = Button(label="Copy link", name="link", width=92)
        link.js_on_click(CustomJS(args={"button": link}, code="sweep.copy(button)"))
        buttons = [link, png, self._button("netCDF", f"{self.stem}.nc", "application/x-netcdf", netcdf)]
        if yaml:
            buttons.append(self._button("YAML", f"{self.stem}.yaml", "application/yaml", yaml))
        link.tags = [self._file]
        self.root = Row(*buttons, name="save")

    def _button(self, label: str, name: str, mime: str, content: Callable[[], bytes]) -> Button:
        button = Button(label=label, name=label, width=76)

        def send() -> None:
            bytes_ = np.frombuffer(content(), "uint8")
            self._file.data = {"bytes": [bytes_], "name": [name], "type": [mime]}
            self._file.data = {"bytes": [], "name": [], "type": []}

        button.on_click(send)
        return button
