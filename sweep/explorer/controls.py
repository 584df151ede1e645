"""The widgets by which the visitor chooses a map."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from bokeh.models import Button, CustomJSTickFormatter, Div, Row, Select, Slider, TextInput

from sweep.explorer.slices import Source
from sweep.explorer.state import LIMITS, Cell, Choice, State, choices, limit, wrong_value
from sweep.parameters import Parameter

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
                        styles={"gap": "10px 18px", "flex-wrap": "wrap", "align-items": "flex-end"})  # fmt: skip

    def show(self, state: State) -> None:
        """Set the widgets to what is shown."""
        along = self._source.dims_of(state.show) | set(self._source.dims)
        for name, choice in self._choices.items():
            k = choice.of(state)
            self._widgets[name].value = k if choice.axis else choice.options[k]
            self._widgets[name].visible = not choice.axis or name in along - {state.x, state.y}
        for name, field in self._limits.items():
            field.value = f"{state.limits[name]:.6g}" if name in state.limits else ""

    def _widget(self, choice: Choice) -> Slider | Select:
        """A slider over the indices of an axis, which shows the value there, or else a list."""
        common: dict[str, Any] = {"title": choice.title, "name": choice.name, "stylesheets": [BARE]}
        if choice.axis:
            value = CustomJSTickFormatter(args={"words": list(choice.words)}, code="return words[tick]")
            slider = Slider(start=0, end=len(choice.words) - 1, step=1, value=0, width=190, format=value, **common)
            on(slider, "value_throttled", partial(self._pick, choice))
            return slider
        named = list(zip(choice.options, choice.words, strict=True))
        choose = Select(options=named, width=250 if choice.name == "show" else 150, **common)
        on(choose, "value", lambda option: self._pick(choice, choice.find(option)))
        return choose

    def _pick(self, choice: Choice, k: Any) -> None:
        """Take an option that the browser sent, which may be anything."""
        if isinstance(k, int | float) and 0 <= k < len(choice.options):
            self._change(lambda state: choice.put(state, int(k)))

    def _limit(self, name: str, words: str) -> TextInput:
        """Make the field of an end of the colour scale; without a number, the values set that end."""
        field = TextInput(title=words, placeholder="auto", width=80, name=name,
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
        words = Div(text="Counts of another body:", styles={"font-size": "12px", "color": "#5b6875"}, width=150)
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
