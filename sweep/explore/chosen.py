"""Lets the visitor choose the cells whose trajectories are drawn, and their parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from html import escape
from typing import Any

import numpy as np
from bokeh.models import Button, Checkbox, Column, Div, Row, Slider, Spinner

from sweep.axis import Axis
from sweep.explore.colours import CURVES
from sweep.explore.controls import BARE, on
from sweep.explore.runner import Curve
from sweep.explore.slices import Source
from sweep.explore.state import MAX_CELLS, Cell
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
        self._keep = Checkbox(label="keep the curves when another cell is clicked", active=False, name="keep")
        self._rows = [self._row(k, activate, remove) for k in range(MAX_CELLS)]
        self._title = Div(text="", margin=(8, 0, 0, 0))
        self._end = Div(text="", margin=(0, 0, 4, 0), sizing_mode="stretch_width", name="ends")
        self._inputs = {name: self._input(known[name], source.axes.get(name)) for name in self._order(source, base)}
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
        """True if a click adds a cell rather than replacing those drawn."""
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
                end = f"{status}, followed to t = {float(curve.dataset['t_stop']):.6g}"
                told.append(f"{k + 1}: {escape(end)}, run in {curve.seconds:.2g} s")
        self._end.text = "<br>".join(told)

    def _row(self, k: int, activate: Callable[[int], None], remove: Callable[[int], None]) -> tuple[Row, Button]:
        border = f".bk-btn {{ border-left: 8px solid {CURVES[k]} !important; text-align: left }}"
        button = Button(label="", sizing_mode="stretch_width", stylesheets=[border], name=f"cell {k + 1}")
        button.on_click(lambda: activate(k))
        away = Button(label="×", width=36, name=f"remove {k + 1}")
        away.on_click(lambda: remove(k))
        return Row(button, away, visible=False, sizing_mode="stretch_width"), button

    def _input(self, parameter: Parameter, axis: Axis | None) -> list[Any]:
        """A field for the number, and on an axis of the dataset a slider as well."""
        name = parameter.name
        allowed = {"title": labels.symbol(name), "stylesheets": [BARE], "name": f"parameter {name}"}
        field = Spinner(value=0, width=88, step=_step(axis), mode="float", **allowed)
        on(field, "value", partial(self._edited, name))
        if axis is None or len(axis.values) < 2:
            return [field]
        span = axis.values[-1] - axis.values[0]
        ends = axis.values[[0, -1]] + np.array([-0.1, 0.1]) * span
        low, high = (v if parameter.allows(v) else end for v, end in zip(ends, axis.values[[0, -1]], strict=True))
        slider = Slider(start=float(low), end=float(high), step=float(span / 1000), value=float(low), title=None,
                        show_value=False, sizing_mode="stretch_width", min_width=100, name=f"drag {name}",
                        stylesheets=[BARE])  # fmt: skip
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
