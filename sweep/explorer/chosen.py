"""Widgets for the cells whose trajectories are drawn, and for their parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from html import escape

import numpy as np
from bokeh.models import Button, Column, Div, Row, Slider, TextInput

from sweep.explorer.controls import BARE, WIDGETS, on
from sweep.explorer.runner import Curve
from sweep.explorer.slices import Source
from sweep.explorer.state import MAX_CELLS, Cell, number
from sweep.explorer.style import CURVES
from sweep.parameters import Parameter
from sweep.plots import labels


class CellControls:
    """The list of the cells that are drawn, and the parameters of the active one."""

    def __init__(
        self, source: Source, base: Cell, known: Mapping[str, Parameter], edit: Callable[[str, float], None],
        activate: Callable[[int], None], remove: Callable[[int], None],
    ) -> None:  # fmt: skip
        self._edit = edit
        self._quiet = False
        self._rows = [self._row(k, activate, remove) for k in range(MAX_CELLS)]
        self._end = Div(text="", margin=(0, 0, 4, 0), sizing_mode="stretch_width", name="ends")
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
