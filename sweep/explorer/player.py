"""Play a trajectory: its body turns on the table in perspective, above the path of its contact point."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from bokeh import models
from bokeh.plotting import figure
from matplotlib.colors import LightSource
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import proj3d

from sweep.explorer.controls import WIDGETS
from sweep.explorer.runner import Curve
from sweep.explorer.style import GRID, SOFT
from sweep.plots import body, labels

_MOMENTS = 20_000
"""Largest number of samples sent to the browser."""


class Player:
    """The body of one trajectory, and the controls that play it; everything happens in the browser."""

    def __init__(self, over_time: list[Any]) -> None:
        """Add a line that marks the time to the figures `over_time`."""
        self.figure = plot = figure(
            height=260, min_width=220, sizing_mode="stretch_width", tools="", toolbar_location=None, name="body",
            match_aspect=True, outline_line_color=None,
        )  # fmt: skip
        plot.axis.visible = plot.grid.visible = False
        self._table = models.ColumnDataSource({"xs": [[0.0]], "ys": [[0.0]]})  # else Bokeh warns of axes without range
        self._motion, self._shape = models.ColumnDataSource(), models.ColumnDataSource()
        faces = models.ColumnDataSource({"xs": [], "ys": [], "colour": []}, syncable=False, name="faces")
        trace = models.ColumnDataSource({"x": [], "y": []}, syncable=False)
        table = plot.multi_line("xs", "ys", source=self._table, color=GRID)
        plot.patches("xs", "ys", source=faces, color="colour", line_width=0.5)
        for colour, width in (("white", 3.0), ("black", 1.2)):  # seen through the body, which covers most of it
            plot.line("x", "y", source=trace, color=colour, line_width=width)
        for span in (plot.x_range, plot.y_range):
            span.update(renderers=[table], range_padding=0.05)
        clock = models.Label(x=6, y=6, x_units="screen", y_units="screen", text_font_size="12px", syncable=False)
        plot.add_layout(clock)
        line = models.Span(location=0, dimension="height", line_color=SOFT, line_width=1, syncable=False)
        for other in over_time:
            other.add_layout(line)
        parts = {"motion": self._motion, "shape": self._shape, "faces": faces, "trace": trace, "line": line,
                 "clock": clock}  # fmt: skip
        self.root = models.Column(plot, self._controls(parts), sizing_mode="stretch_width", name="played")

    def _controls(self, parts: dict[str, Any]) -> models.Column:
        button = models.Toggle(label="▶ Play", width=84, syncable=False, name="play")
        self._slider = models.Slider(start=0, end=1, value=0, title=None, show_value=False, syncable=False,
                                     sizing_mode="stretch_width", min_width=80, name="time")  # fmt: skip
        speed = models.Select(title="lasts", value="60", width=76, syncable=False, options=[
            ("10", "10 s"), ("20", "20 s"), ("60", "1 min"), ("600", "10 min")])  # fmt: skip
        trail = models.Select(title="trail", value="0.02", width=96, syncable=False, options=[
            ("0.002", "0.2 %"), ("0.02", "2 %"), ("0.2", "20 %"), ("1", "all")])  # fmt: skip
        parts |= {"slider": self._slider, "speed": speed, "button": button, "trail": trail}
        moment = models.CustomJS(args={"models": parts}, code="sweep.moment(models)")
        self._button = button
        self.begin = models.CustomJS(args={"models": parts}, code="sweep.moment(models); sweep.begin(models)")
        """Draws the body at the time of the slider, and plays it if it is to be played at once."""
        for model, change in (
            (self._slider, "value"), (self._slider, "end"), (trail, "value"), (self._motion, "data"),
        ):  # fmt: skip
            model.js_on_change(change, moment)
        code = "cb_obj.label = cb_obj.active ? '❚❚ Pause' : '▶ Play'; sweep.play(models, cb_obj.active)"
        button.js_on_change("active", models.CustomJS(args={"models": parts}, code=code))
        row = models.Row(button, speed, trail, styles={"align-items": "end", "gap": "4px"})
        return models.Column(self._slider, row, sizing_mode="stretch_width", name="player", stylesheets=[WIDGETS])

    def play_at_once(self, wanted: bool) -> None:
        """Say whether the page begins to play when it is opened."""
        self._button.tags = [wanted]

    def show(self, curve: Curve | None, colour: str, end: float) -> None:
        """Show the body of a curve, if its attitude and shape are known; the slider goes to the time `end`."""
        self._slider.update(end=end, step=end / 2000)
        self.root.visible = curve is not None and body.drawable(curve.dataset)
        if not curve or not self.root.visible:
            self._motion.data = {"time": [], "turn": [], "contact": [], "path": []}
            return
        one = curve.dataset
        self._slider.tags = [labels.unit(one, "time")]
        times = one["time"].values[:: -(-one.sizes["time"] // _MOMENTS)]
        moving = body.moving(one, times)
        moving.look(_camera(), moving.reach)
        matrix = _camera().get_proj()
        seen = [proj3d.proj_transform(*line, matrix) for line in moving.table(moving.reach)]
        self._table.data = {"xs": [x for x, *_ in seen], "ys": [y for _, y, _ in seen]}
        self._shape.data = {
            "points": [moving.points], "tones": [moving.colours(colour)], "matrix": [matrix],
            "sun": [LightSource(**body.SUN).direction],
        }  # fmt: skip
        columns = {"time": times, "turn": moving.turns, "contact": moving.contacts, "path": moving.path.T}
        self._motion.data = {name: np.ascontiguousarray(column, "float32") for name, column in columns.items()}


@cache
def _camera() -> Any:
    """Return axes with the perspective of `sweep animate`; making them takes 30 ms."""
    return Figure().add_axes((0, 0, 1, 1), projection="3d")
