"""What the visitor handles to choose a map, and texts for the page."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from bokeh.models import Column, CustomJS, Div, RadioButtonGroup, Row, Select, Slider

from sweep.explore.setup import why_still
from sweep.explore.slices import Axis, Source
from sweep.explore.state import State
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

BARE = ":host { margin: 0 } .bk-input-group label { font-size: 12px; color: #5b6875 }"


def still(source: Source) -> str:
    """The hint for a file from which no trajectory is run."""
    return _SOFT.format(f"Point at a cell to read it. {escaped(why_still(source))}")


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
        self._count = RadioButtonGroup(labels=names, active=None, name="count", stylesheets=[BARE],
                                       visible=bool(names))  # fmt: skip
        placeholder = [("", "another variable …")] if names else []
        self._other = Select(options=[*placeholder, *others], value="", width=250, name="show", stylesheets=[BARE])
        options = [(d, source.words(d)) for d in source.dims]
        self._x = Select(title="horizontal axis", options=options, width=150, name="x", stylesheets=[BARE])
        self._y = Select(
            title="vertical axis", options=options, width=150, name="y", visible=len(options) > 1, stylesheets=[BARE]
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
        along = self._source.dims_of(state.show) | set(self._source.dims)
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
        return RadioButtonGroup(labels=values, active=0, name=f"at {axis.name}", stylesheets=[BARE])
    symbol = labels.symbol(axis.name)
    slider = Slider(start=0, end=len(values) - 1, step=1, value=0, width=190, show_value=False, name=f"at {axis.name}",
                    title=f"{symbol} = {values[0]}", stylesheets=[BARE])  # fmt: skip
    code = "cb_obj.title = `${symbol} = ${values[cb_obj.value]}`"
    slider.js_on_change("value", CustomJS(args={"values": values, "symbol": symbol}, code=code))
    return slider
