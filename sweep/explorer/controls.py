"""The widgets by which the visitor chooses a map, another body, and the cells whose trajectories are drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import numpy as np
from bokeh.models import Button, Column, CustomJSTickFormatter, Div, Row, Select, Slider, TextInput

from sweep.explorer.runner import Curve
from sweep.explorer.slices import Source
from sweep.explorer.state import LIMITS, MAX_CELLS, Cell, Choice, State, choices, limit, number, wrong_value
from sweep.explorer.style import CURVES
from sweep.parameters import Parameter
from sweep.plots import labels

WIDGETS = ":host { color: #1b2733; color-scheme: light; filter: var(--widgets) }"
"""Style of the outermost widgets, which a dark page inverts."""

BARE = ":host { margin: 0 } .bk-input-group label { font-size: 12px; color: #5b6875 }"


def on(model: Any, name: str, call: Callable[[Any], None]) -> None:
    """Call `call` with each new value of a property."""
    model.on_change(name, lambda attr, old, new: call(new))  # noqa: ARG005  Bokeh looks at the names


class MapControls:
    """Widgets to choose the variable, the axes of the map, and the values of other axes."""

    def __init__(self, source: Source, change: Callable[[Callable[[State], State]], None]) -> None:
        """`change` is called with a function that makes the visitor's choice in a state."""
        self._source, self._change = source, change
        # An axis of one value leaves no choice, and a slider of Bokeh cannot end where it starts.
        self._choices = {name: one for name, one in choices(source).items() if not one.axis or len(one.options) > 1}
        self._widgets = {name: self._widget(choice) for name, choice in self._choices.items()}
        self._limits = {name: self._limit(name, words) for name, words in LIMITS.items()}
        self.root = Row(children=[*self._widgets.values(), *self._limits.values()], name="controls",
                        stylesheets=[WIDGETS], sizing_mode="stretch_width",
                        styles={"gap": "10px 12px", "flex-wrap": "wrap", "align-items": "flex-end"})  # fmt: skip

    def show(self, state: State) -> None:
        """Set the widgets to what is shown."""
        along = self._source.dims_of(state.show) | set(self._source.dims)
        for name, choice in self._choices.items():
            k = choice.of(state)
            self._widgets[name].value = k if choice.axis else choice.options[k]
            if choice.axis:  # otherwise a slider that is moved back to its first value would change nothing here
                self._widgets[name].set_from_json("value_throttled", k)
            self._widgets[name].visible = not choice.axis or name in along - {state.x, state.y}
        for name, field in self._limits.items():
            field.value = f"{state.limits[name]:.6g}" if name in state.limits else ""

    def _widget(self, choice: Choice) -> Slider | Select:
        """A slider over the indices of an axis, which shows the value there, or else a list."""
        common: dict[str, Any] = {"title": choice.title, "name": choice.name, "stylesheets": [BARE]}
        if choice.axis:
            value = CustomJSTickFormatter(args={"words": list(choice.words)}, code="return words[tick]")
            # Tooltips would read the words as HTML.
            slider = Slider(
                start=0, end=len(choice.words) - 1, step=1, value=0, width=150, format=value, tooltips=False, **common
            )
            on(slider, "value_throttled", partial(self._pick, choice))
            return slider
        named = list(zip(choice.options, choice.words, strict=True))
        choose = Select(options=named, width=220 if choice.name == "show" else 140, **common)
        on(choose, "value", lambda option: self._pick(choice, choice.find(option)))
        return choose

    def _pick(self, choice: Choice, k: Any) -> None:
        """Take an option that the browser sent, which may be anything."""
        if isinstance(k, int | float) and 0 <= k < len(choice.options):
            self._change(lambda state: choice.put(state, int(k)))

    def _limit(self, name: str, words: str) -> TextInput:
        """Make the field of an end of the colour scale; without a number, the values set that end."""
        field = TextInput(title=words, placeholder="auto", width=72, name=name,
                          stylesheets=[BARE])  # fmt: skip

        def put(state: State, at: float) -> State:
            limits = {**state.limits, name: at}
            return replace(state, limits={end: at for end, at in limits.items() if math.isfinite(at)})

        on(field, "value", lambda text: self._change(partial(put, at=limit(text))))
        return field


class BodyControls:
    """Sliders for parameters that are constant in the dataset, from a quarter of their values to four times."""

    _SPAN = 4.0

    def __init__(
        self, source: Source, values: Cell, known: Mapping[str, Parameter],
        change: Callable[[Callable[[State], State]], None],
    ) -> None:  # fmt: skip
        self._values, self._known, self._change, self._quiet = values, known, change, False
        self._sliders = {name: self._slider(source, name, value) for name, value in values.items()}
        self._back = Button(label="Back to the dataset", name="back", width=150, visible=False)
        self._back.on_click(lambda: change(lambda state: replace(state, changed={})))
        heading = {"font-size": "12px", "color": "#5b6875", "flex": "1 0 100%"}
        words = Div(text="Counts of another body:", styles=heading)
        self.root = Row(words, *self._sliders.values(), self._back, name="other", visible=bool(values),
                        stylesheets=[WIDGETS], sizing_mode="stretch_width",
                        styles={"gap": "6px 18px", "flex-wrap": "wrap", "align-items": "flex-end"})  # fmt: skip

    def show(self, state: State) -> None:
        """Set the sliders to the values whose counts are shown."""
        self._quiet = True
        for name, slider in self._sliders.items():
            wanted = state.changed.get(name, self._values[name])
            if wanted != self._at(name, slider.value):  # rounding would move the slider under the hand
                ratio = wanted / self._values[name]
                slider.value = math.log(ratio, self._SPAN) if ratio > 0 else 0.0
        self._back.visible = bool(state.changed)
        self._quiet = False

    def _slider(self, source: Source, name: str, value: float) -> Slider:
        code = "return sweep.number(Number((value * span ** tick).toPrecision(3)))"
        words = CustomJSTickFormatter(args={"value": value, "span": self._SPAN}, code=code)
        slider = Slider(start=-1, end=1, step=0.01, value=0, width=150, title=source.symbol(name), format=words,
                        name=f"body {name}", stylesheets=[BARE])  # fmt: skip
        on(slider, "value", partial(self._moved, name))
        return slider

    def _at(self, name: str, place: float) -> float:
        """The value at a place of a slider, to three digits; the dataset's is at zero."""
        value = self._values[name] * self._SPAN ** min(max(place, -1.0), 1.0)
        return float(f"{value:.3g}") if place else self._values[name]

    def _moved(self, name: str, place: float) -> None:
        value = self._at(name, place)
        if self._quiet or wrong_value(self._known[name], value):
            return

        def put(state: State) -> State:
            changed = {**state.changed, name: value}
            return replace(state, changed={key: at for key, at in changed.items() if at != self._values.get(key)})

        self._change(put)


class CellControls:
    """The list of the cells that are drawn, and the parameters of the active one."""

    def __init__(
        self, source: Source, base: Cell, known: Mapping[str, Parameter], edit: Callable[[str, float], None],
        activate: Callable[[int], None], remove: Callable[[int], None],
    ) -> None:  # fmt: skip
        self._edit = edit
        self._quiet = False
        self._rows = [self._row(k, activate, remove) for k in range(MAX_CELLS)]
        self._end = Div(text="", disable_math=True, margin=(0, 0, 4, 0), sizing_mode="stretch_width", name="ends")
        ordered = [*(n for n in source.dims if n in base), *(n for n in base if n not in source.dims)]
        self._inputs = {name: _Input(source, known[name], partial(self._edited, name)) for name in ordered}
        wrap = {"gap": "4px 10px", "flex-wrap": "wrap", "align-items": "flex-end"}
        inputs = self._inputs.values()
        dragged = [Row(one.field, one.slider, sizing_mode="stretch_width", styles=wrap) for one in inputs if one.slider]
        typed = [one.field for one in inputs if not one.slider]
        self._editor = Column(*dragged, Row(*typed, sizing_mode="stretch_width", styles=wrap),
                              sizing_mode="stretch_width", visible=False, name="parameters")  # fmt: skip
        self.root = Column(*(row for row, _ in self._rows), self._end, self._editor, name="chosen",
                           stylesheets=[WIDGETS], sizing_mode="stretch_width", visible=bool(base))  # fmt: skip

    def show(self, cells: Sequence[Cell], names: Sequence[str], active: int) -> None:
        for k, (row, button) in enumerate(self._rows):
            row.visible = k < len(cells)
            if row.visible:
                button.label = f"{k + 1}  {names[k]}"
                button.button_type = "primary" if k == active else "default"
        self._editor.visible = bool(cells)
        if cells:
            self._quiet = True
            for name, controls in self._inputs.items():
                controls.put(cells[active][name])
            self._quiet = False

    def show_ends(self, curves: Sequence[Curve | None]) -> None:
        """Show how each trajectory ended, and how long its run took."""
        lines = []
        for k, curve in enumerate(curves):
            if curve and curve.whole:
                status = labels.flag_words(curve.dataset, "status")[int(curve.dataset["status"])]
                unit = labels.si_unit(curve.dataset, "t_stop")
                end = f"{status}, followed to t = {labels.number(float(curve.dataset['t_stop']))}{unit}"
                lines.append(f"{k + 1}: {escape(end)}, run in {curve.seconds:.2g} s")
        self._end.text = "<br>".join(lines)

    def _row(self, k: int, activate: Callable[[int], None], remove: Callable[[int], None]) -> tuple[Row, Button]:
        border = f".bk-btn {{ border-left: 8px solid {CURVES[k]} !important; text-align: left }}"
        border += ".bk-btn-primary { background-color: #0b62b8 !important }"
        button = Button(label="", sizing_mode="stretch_width", stylesheets=[border], name=f"cell {k + 1}")
        button.on_click(lambda: activate(k))
        away = Button(label="×", width=36, name=f"remove {k + 1}")
        away.on_click(lambda: remove(k))
        return Row(button, away, visible=False, sizing_mode="stretch_width"), button

    def _edited(self, name: str, value: float) -> None:
        if not self._quiet:
            self._edit(name, float(f"{value:.10g}"))


class _Input:
    """A field for a number, with a slider for an axis of the dataset, logarithmic if the axis is."""

    def __init__(self, source: Source, parameter: Parameter, edited: Callable[[float], None]) -> None:
        name = parameter.name
        axis = self._axis = source.axes.get(name)
        self.field = TextInput(
            value="", width=96, title=source.symbol(name), stylesheets=[BARE], name=f"parameter {name}"
        )
        on(self.field, "value", lambda text: edited(number(text)))
        self.slider: Slider | None = None
        if axis is None or len(axis.values) < 2:
            return
        first, last = map(float, axis.straight(axis.values[[0, -1]]))
        self.slider = Slider(start=first, end=last, step=(last - first) / 1000, value=first, title=None,
                             show_value=False, sizing_mode="stretch_width", min_width=100, name=f"drag {name}",
                             stylesheets=[BARE])  # fmt: skip
        on(self.slider, "value", lambda place: edited(float(axis.bent(np.array(place)))))

    def put(self, value: float) -> None:
        """Show a value."""
        self.field.value = f"{value:.6g}"
        if self.slider and self._axis:
            with np.errstate(divide="ignore", invalid="ignore"):  # a value that a logarithmic axis cannot have
                place = float(self._axis.straight(np.array(value)))
            self.slider.value = place if np.isfinite(place) else self.slider.start
