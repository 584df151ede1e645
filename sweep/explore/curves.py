"""Trajectories as Bokeh figures: spin and energies over time, the path of the contact point, and their player."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from bokeh.core.properties import value
from bokeh.models import (
    Column,
    ColumnDataSource,
    CustomJS,
    Label,
    Legend,
    LegendItem,
    Row,
    Select,
    Slider,
    Span,
    Toggle,
)  # fmt: skip
from bokeh.plotting import figure

from sweep.explore.cells import Curve
from sweep.explore.colours import CURVES
from sweep.explore.slices import critical_symbol
from sweep.explore.state import MAX_CELLS
from sweep.grid import Array
from sweep.plots import labels

_POINTS = 6000
"""Points drawn of a curve at most: the lowest and the highest sample of each stretch."""

_CRITICAL = ("n_c1_plus", "n_c1_minus", "n_c2_plus", "n_c2_minus")

_EMPTY: dict[str, list[float]] = {"x": [], "y": []}


class Curves:
    """The figures of the trajectories, with a place for each of `MAX_CELLS` curves."""

    def __init__(self) -> None:
        self.spin = _figure(260, "spin")
        self.energy = _figure(190, "energies")
        self.path = _figure(320, "contact path")
        self.path.match_aspect = True
        self.energy.x_range = self.spin.x_range
        self._slots = [_Slot(self, colour) for colour in CURVES[:MAX_CELLS]]
        self._critical = [self._critical_line(name) for name in _CRITICAL]
        _legend(self.energy, [("energy above rest", "solid"), ("work against friction", "dashed")])
        self.player = self._player()

    def show(self, curves: Sequence[Curve | None], names: Sequence[str], active: int) -> None:
        """Draw the curves, one a place, with what the legend says of them; the critical spins are those of `active`."""
        for slot, curve, name in zip(self._slots, curves, names, strict=False):
            slot.show(curve, name)
        for slot in self._slots[len(curves) :]:
            slot.show(None, "")
        present = [curve for curve in curves if curve]
        if present:
            self._label(present[0].dataset)
        self._slider.end = max([float(np.nanmax(curve.dataset["time"])) for curve in present], default=1.0)
        self._slider.step = self._slider.end / 2000
        chosen = curves[active] if active < len(curves) else None
        for (line, label), name in zip(self._critical, _CRITICAL, strict=True):
            spin = float(chosen.dataset[name]) if chosen and name in chosen.dataset else np.nan
            line.visible = label.visible = bool(np.isfinite(spin))
            if line.visible:
                line.location = label.y = spin
                label.x = self._slider.end * (0.93 if "c1" in name else 1.0)  # they often lie close together

    def _label(self, one: xr.Dataset) -> None:
        """Label the axes, in the units of a trajectory."""
        lowest, highest = (self.energy, self.spin) if "energy" in one else (self.spin, self.energy)
        lowest.xaxis[0].axis_label, highest.xaxis[0].axis_label = labels.label(one, "time"), None
        self.spin.yaxis[0].axis_label = labels.label(one, "spin")
        for axis, name, words in (
            (self.energy.yaxis, "energy", "energy"),
            (self.path.xaxis, "contact_x", "contact point x"),
            (self.path.yaxis, "contact_y", "contact point y"),
        ):
            if name in one:
                unit = labels.unit(one, name)
                axis[0].axis_label = f"{words} ({unit})" if unit else words

    def _critical_line(self, name: str) -> tuple[Span, Label]:
        dash = "dotted" if "c1" in name else "dashed"
        line = Span(
            dimension="width", line_color="#6b7580", line_dash=dash, line_width=1, visible=False, level="underlay"
        )
        label = Label(x=0, y=0, text=critical_symbol(name), text_font_size="11px", text_align="right", visible=False,
                      text_color="#4d5864")  # fmt: skip
        self.spin.add_layout(line)
        self.spin.add_layout(label)
        return line, label

    def _player(self) -> Column:
        """Buttons that play the trajectories; everything happens in the browser."""
        line = Span(location=0, dimension="height", line_color="#1b2733", line_width=1, syncable=False)
        other = Span(location=0, dimension="height", line_color="#1b2733", line_width=1, syncable=False)
        self.spin.add_layout(line)
        self.energy.add_layout(other)
        line.js_link("location", other, "location")
        button = Toggle(label="▶ Play", width=84, syncable=False, name="play")
        self._slider = Slider(start=0, end=1, step=0.001, value=0, title=None, show_value=False, syncable=False,
                              sizing_mode="stretch_width", min_width=80, name="time")  # fmt: skip
        speed = Select(title="lasts", value="20", width=76, options=[("10", "10 s"), ("20", "20 s"), ("60", "1 min"),
                       ("600", "10 min")], syncable=False)  # fmt: skip
        window = Select(title="trail", value="60", width=96, syncable=False,
                        options=[("8", "t = 8"), ("60", "t = 60"), ("400", "t = 400")])  # fmt: skip
        clock = Label(x=6, y=6, x_units="screen", y_units="screen", text="", text_font_size="12px", syncable=False)
        self.path.add_layout(clock)
        models = {
            "curves": [slot.samples for slot in self._slots], "trails": [slot.trail for slot in self._slots],
            "points": [slot.point for slot in self._slots], "line": line, "window": window, "clock": clock,
            "slider": self._slider, "speed": speed, "button": button,
        }  # fmt: skip
        moment = CustomJS(args={"models": models}, code="sweep.moment(models, models.slider.value)")
        for model, change in ((self._slider, "value"), (self._slider, "end"), (window, "value")):
            model.js_on_change(change, moment)
        for slot in self._slots:
            slot.samples.js_on_change("data", moment)
        code = "cb_obj.label = cb_obj.active ? '⏸ Pause' : '▶ Play'; sweep.play(models, cb_obj.active)"
        button.js_on_change("active", CustomJS(args={"models": models}, code=code))
        row = Row(button, speed, window, styles={"align-items": "end", "gap": "4px"})
        return Column(self._slider, row, sizing_mode="stretch_width", name="player")


class _Slot:
    """The place of one curve in all figures."""

    def __init__(self, curves: Curves, colour: str) -> None:
        self.spin, self.reversals, self.energy, self.lost, self.ghost = (ColumnDataSource(_EMPTY) for _ in range(5))
        self.samples = ColumnDataSource({"time": [], "x": [], "y": []})
        self.trail = ColumnDataSource(_EMPTY, syncable=False)
        self.point = ColumnDataSource({**_EMPTY, "alpha": []}, syncable=False)
        line = curves.spin.line("x", "y", source=self.spin, color=colour, width=1.2)
        dots = curves.spin.scatter("x", "y", source=self.reversals, color=colour, size=8, line_color="white")
        self.item = LegendItem(label="", renderers=[line, dots], visible=False)
        curves.spin.legend[0].items.append(self.item)
        curves.energy.line("x", "y", source=self.energy, color=colour, width=1.2)
        curves.energy.line("x", "y", source=self.lost, color=colour, width=1.2, dash="dashed")
        curves.path.line("x", "y", source=self.ghost, color=colour, width=0.5, alpha=0.25)
        curves.path.line("x", "y", source=self.trail, color=colour, width=1.6)
        curves.path.scatter("x", "y", source=self.point, color=colour, size=9, line_color="white", alpha="alpha")

    def show(self, curve: Curve | None, name: str) -> None:
        self.item.update(label=value(name), visible=curve is not None)
        if curve is None:
            for source in (self.spin, self.reversals, self.energy, self.lost, self.ghost):
                source.data = dict(_EMPTY)
            self.samples.data = {"time": [], "x": [], "y": []}
            return
        one = curve.dataset
        good = np.isfinite(one["time"].values)
        time = one["time"].values[good]
        self.spin.data = _thinned(time, one["spin"].values[good])
        self.reversals.data = {"x": curve.reversals, "y": np.zeros(len(curve.reversals))}
        self.energy.data = _series(one, "energy", time, good)
        self.lost.data = _series(one, "dissipated", time, good)
        if "contact_x" in one:
            x, y = (one[f"contact_{c}"].values[good].astype("float32") for c in "xy")
            self.ghost.data = {"x": x[:: -(-len(x) // _POINTS)], "y": y[:: -(-len(x) // _POINTS)]}
            self.samples.data = {"time": time.astype("float32"), "x": x, "y": y}


def _series(one: xr.Dataset, name: str, time: Array, good: Array) -> dict[str, Any]:
    return _thinned(time, one[name].values[good]) if name in one else dict(_EMPTY)


def _thinned(x: Array, y: Array) -> dict[str, Any]:
    """The curve with at most `_POINTS` points; of each stretch its lowest and highest, so that no peak is lost."""
    if len(x) <= _POINTS:
        return {"x": x.astype("float32"), "y": y.astype("float32")}
    stretch = -(-2 * len(x) // _POINTS)
    whole = len(x) // stretch * stretch
    table = y[:whole].reshape(-1, stretch)
    first = np.arange(0, whole, stretch)
    at = np.unique([0, *(first + table.argmin(axis=1)), *(first + table.argmax(axis=1)), len(x) - 1])
    return {"x": x[at].astype("float32"), "y": y[at].astype("float32")}


def _figure(height: int, name: str) -> Any:
    plot = figure(
        height=height, min_width=220, sizing_mode="stretch_width", tools="pan,box_zoom,wheel_zoom,reset,save",
        active_drag="box_zoom", toolbar_location="right", name=name,
    )  # fmt: skip
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    plot.outline_line_color = None
    plot.grid.grid_line_color = "#e8ebee"
    for axis in plot.axis:
        axis.update(axis_label_text_font_style="normal", axis_label_text_font_size="12px", axis_line_color="#8a949e",
                    major_tick_line_color="#8a949e", minor_tick_line_color=None)  # fmt: skip
    if name == "spin":
        plot.add_layout(Legend(items=[], location="top_right", padding=4, spacing=0, label_text_font_size="11px",
                               background_fill_alpha=0.8, border_line_color=None, name="curve legend"))  # fmt: skip
    return plot


def _legend(plot: Any, entries: Sequence[tuple[str, str]]) -> None:
    """A legend of line styles."""
    items = [
        LegendItem(label=words, renderers=[plot.line([np.nan], [np.nan], color="#4d5864", line_dash=dash)])
        for words, dash in entries
    ]
    plot.add_layout(Legend(items=items, location="right", padding=4, spacing=0, label_text_font_size="11px",
                           background_fill_alpha=0.8, border_line_color=None))  # fmt: skip
