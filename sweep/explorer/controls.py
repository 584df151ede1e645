"""The widgets by which the visitor chooses a map."""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from functools import partial
from typing import Any

from bokeh.models import Column, CustomJS, Div, RadioButtonGroup, Row, Select, Slider, TextInput

from sweep.explorer.slices import Source
from sweep.explorer.state import LIMITS, Choice, State, choices, number
from sweep.plots import labels

WIDGETS = ":host { color: #1b2733; color-scheme: light; filter: var(--widgets) }"
"""Of the outermost widgets, which a dark page inverts."""

BARE = ":host { margin: 0 } .bk-input-group label { font-size: 12px; color: #5b6875 }"


def on(model: Any, name: str, call: Callable[[Any], None]) -> None:
    """Call `call` with each new value of a property."""
    model.on_change(name, lambda attr, old, new: call(new))  # noqa: ARG005  Bokeh looks at the names


class MapControls:
    """The widgets of all choices: which variable is shown, over which axes, and where on the others."""

    def __init__(self, source: Source, change: Callable[[Callable[[State], State]], None]) -> None:
        """`change` is told how the visitor changes the state."""
        self._source, self._change = source, change
        self._choices = choices(source)
        self._widgets = {name: _Widgets(choice, partial(self._pick, choice)) for name, choice in self._choices.items()}
        self._limits = {name: self._limit(name, words) for name, words in LIMITS.items()}
        self.root = Row(children=[*(w.root for w in self._widgets.values()), *self._limits.values()], name="controls",
                        stylesheets=[WIDGETS], sizing_mode="stretch_width",
                        styles={"gap": "10px 18px", "flex-wrap": "wrap", "align-items": "flex-end"})  # fmt: skip

    def show(self, state: State) -> None:
        """Let the widgets say what is shown."""
        along = self._source.dims_of(state.show) | set(self._source.dims)
        for name, widgets in self._widgets.items():
            widgets.show(self._choices[name].of(state))
            widgets.root.visible = name not in self._source.axes or name in along - {state.x, state.y}
        for name, field in self._limits.items():
            limit = getattr(state, name)
            field.value = "" if limit is None else f"{limit:.6g}"

    def _pick(self, choice: Choice, k: Any) -> None:
        """Take an option that the browser sent, which may be anything."""
        if isinstance(k, int | float) and 0 <= k < len(choice.options):
            self._change(lambda state: choice.put(state, int(k)))

    def _limit(self, name: str, words: str) -> TextInput:
        """The field of an end of the colour scale; what is no number leaves it to the values."""
        field = TextInput(title=words, placeholder="least" if name == "low" else "most", width=80, name=name,
                          stylesheets=[BARE])  # fmt: skip

        def put(text: str) -> None:
            limit = number(text)
            self._change(lambda state: state.limited(name, limit if math.isfinite(limit) else None))

        on(field, "value", put)
        return field


class _Widgets:
    """Buttons, a list or a slider, or buttons and a list, for the options of a choice."""

    def __init__(self, choice: Choice, pick: Callable[[Any], None]) -> None:
        self._choice, n = choice, choice.buttons
        name, title = choice.name, "" if n else choice.title
        self._buttons = RadioButtonGroup(labels=list(choice.words[:n]), visible=n > 0, name=f"buttons {name}",
                                         stylesheets=[BARE])  # fmt: skip
        on(self._buttons, "active", pick)
        self._more: Slider | Select | None = None
        if n < len(choice.options) and choice.axis:
            self._more = _slider(choice)
            on(self._more, "value_throttled", pick)
        elif n < len(choice.options):
            hint = [("", f"another {choice.title} …")] if n else []
            named = [*hint, *zip(choice.options[n:], choice.words[n:], strict=True)]
            self._more = Select(title=title, options=named, value="", width=250 if n else 150, name=name,
                                stylesheets=[BARE])  # fmt: skip
            on(self._more, "value", lambda option: pick(choice.find(option)))
        row = Row(self._buttons, *([self._more] if self._more else []), styles={"gap": "6px", "flex-wrap": "wrap"})
        heading = Div(text=html.escape(choice.title), styles={"font-size": "12px", "color": "#5b6875"}, margin=0)
        self.root = Column(heading, row) if n else row

    def show(self, k: int) -> None:
        """Let the widgets say that option `k` is chosen."""
        self._buttons.active = k if k < self._choice.buttons else None
        if isinstance(self._more, Slider):
            self._more.update(value=k, title=f"{labels.symbol(self._choice.name)} = {self._choice.words[k]}")
        elif self._more:
            self._more.value = self._choice.options[k] if k >= self._choice.buttons else ""


def _slider(choice: Choice) -> Slider:
    """A slider over the indices of an axis, which says the value while it is dragged."""
    slider = Slider(start=0, end=len(choice.words) - 1, step=1, value=0, width=190, show_value=False, name=choice.name,
                    stylesheets=[BARE])  # fmt: skip
    args = {"values": list(choice.words), "symbol": labels.symbol(choice.name)}
    code = "cb_obj.title = `${symbol} = ${values[cb_obj.value]}`"
    slider.js_on_change("value", CustomJS(args=args, code=code))
    return slider
