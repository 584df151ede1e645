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

from sweep.explore.colours import CURVES
from sweep.explore.runner import Curve
from sweep.explore.slices import critical_symbol
from sweep.explore.state import MAX_CELLS
from sweep.grid import Array
from sweep.plots import labels

_STRETCHES = 3000
"""Of a longer curve the lowest and the highest sample of each of so many stretches are drawn, of each series."""

_OVER_TIME = ("spin", "energy", "dissipated")
_PATH = ("contact_x", "contact_y")

_CRITICAL = {"n_c1_plus": "dotted", "n_c1_minus": "dotted", "n_c2_plus": "dashed", "n_c2_minus": "dashed"}

_LEGEND: dict[str, Any] = {
    "padding": 4, "spacing": 0, "label_text_font_size": "11px", "background_fill_alpha": 0.8,
    "border_line_color": None,
}  # fmt: skip


class Curves:
    """The figures of the trajectories, with a place for each of `MAX_CELLS` curves."""

    def __init__(self) -> None:
        self.spin = _figure(260, "spin")
        self.energy = _figure(190, "energies")
        self.path = _figure(320, "contact path")
        self.path.match_aspect = True
        self.energy.x_range = self.spin.x_range
        legend = Legend(location="top_right", name="curve legend", **_LEGEND)
        self.spin.add_layout(legend)
        self._slots = [_Slot(self, colour) for colour in CURVES[:MAX_CELLS]]
        legend.items = [slot.item for slot in self._slots]
        self._critical = {name: self._critical_line(name, dash) for name, dash in _CRITICAL.items()}
        styles = [("energy above rest", "solid"), ("work against friction", "dashed")]
        items = [
            LegendItem(label=words, renderers=[self.energy.line([np.nan], [np.nan], color="#4d5864", line_dash=dash)])
            for words, dash in styles
        ]
        self.energy.add_layout(Legend(items=items, location="right", **_LEGEND))
        self.player = self._player()

    def show(self, curves: Sequence[Curve | None], names: Sequence[str], active: int) -> None:
        """Draw the curves, one a place, with what the legend says of them; the critical spins are those of `active`."""
        for k, slot in enumerate(self._slots):
            slot.show(curves[k] if k < len(curves) else None, names[k] if k < len(curves) else "")
        present = [curve.dataset for curve in curves if curve]
        if present:
            self._label(present[0])
        self._slider.end = max([float(np.nanmax(one["time"])) for one in present], default=1.0)
        self._slider.step = self._slider.end / 2000
        chosen = curves[active] if active < len(curves) else None
        for name, (line, label) in self._critical.items():
            spin = float(chosen.dataset[name]) if chosen and name in chosen.dataset else np.nan
            line.visible = label.visible = bool(np.isfinite(spin))
            if line.visible:
                line.location = label.y = spin
                label.x = self._slider.end * (0.93 if "c1" in name else 1.0)  # they often lie close together

    def _label(self, one: xr.Dataset) -> None:
        """Label the axes, in the units of a trajectory."""
        lowest, highest = (self.energy, self.spin) if "energy" in one else (self.spin, self.energy)
        lowest.xaxis[0].axis_label, highest.xaxis[0].axis_label = labels.label(one, "time"), None
        self._unit.text = labels.unit(one, "time")
        for axis, name in (
            (self.spin.yaxis, "spin"), (self.energy.yaxis, "energy"),
            (self.path.xaxis, "contact_x"), (self.path.yaxis, "contact_y"),
        ):  # fmt: skip
            if name in one:
                words = labels.label(one, name).replace("energy above rest", "energy").replace(" along", "")
                axis[0].axis_label = words

    def _critical_line(self, name: str, dash: str) -> tuple[Span, Label]:
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
        self.spin.add_layout(line)
        self.energy.add_layout(line)
        clock = Label(x=6, y=6, x_units="screen", y_units="screen", text="", text_font_size="12px", syncable=False)
        self.path.add_layout(clock)
        self._unit = Label(x=0, y=0, text="", visible=False)
        button = Toggle(label="▶ Play", width=84, syncable=False, name="play")
        self._slider = Slider(start=0, end=1, step=0.001, value=0, title=None, show_value=False, syncable=False,
                              sizing_mode="stretch_width", min_width=80, name="time")  # fmt: skip
        speed = Select(title="lasts", value="20", width=76, options=[("10", "10 s"), ("20", "20 s"), ("60", "1 min"),
                       ("600", "10 min")], syncable=False)  # fmt: skip
        trail = Select(title="trail", value="0.02", width=96, options=[("0.002", "0.2 %"), ("0.02", "2 %"),
                       ("0.2", "20 %"), ("1", "all")], syncable=False)  # fmt: skip
        models = {
            "curves": [slot.samples for slot in self._slots], "trails": [slot.trail for slot in self._slots],
            "points": [slot.point for slot in self._slots], "line": line, "trail": trail, "clock": clock,
            "unit": self._unit, "slider": self._slider, "speed": speed, "button": button,
        }  # fmt: skip
        moment = CustomJS(args={"models": models}, code="sweep.moment(models)")
        changes: list[tuple[Any, str]] = [(self._slider, "value"), (self._slider, "end"), (trail, "value")]
        for model, change in [*changes, *((slot.samples, "data") for slot in self._slots)]:
            model.js_on_change(change, moment)
        code = "cb_obj.label = cb_obj.active ? '⏸ Pause' : '▶ Play'; sweep.play(models, cb_obj.active)"
        button.js_on_change("active", CustomJS(args={"models": models}, code=code))
        row = Row(button, speed, trail, styles={"align-items": "end", "gap": "4px"})
        return Column(self._slider, row, sizing_mode="stretch_width", name="player")


class _Slot:
    """The place of one curve in all figures."""

    def __init__(self, curves: Curves, colour: str) -> None:
        self.series = ColumnDataSource({name: [] for name in ("time", *_OVER_TIME, *_PATH)})
        self.reversals = ColumnDataSource({"x": [], "y": []})
        self.samples = ColumnDataSource({name: [] for name in ("time", *_PATH)})
        self.trail = ColumnDataSource({"x": [], "y": []}, syncable=False)
        self.point = ColumnDataSource({"x": [], "y": [], "alpha": []}, syncable=False)
        line = curves.spin.line("time", "spin", source=self.series, color=colour, width=1.2)
        dots = curves.spin.scatter("x", "y", source=self.reversals, color=colour, size=8, line_color="white")
        self.item = LegendItem(label="", renderers=[line, dots], visible=False)
        curves.energy.line("time", "energy", source=self.series, color=colour, width=1.2)
        curves.energy.line("time", "dissipated", source=self.series, color=colour, width=1.2, dash="dashed")
        curves.path.line(*_PATH, source=self.series, color=colour, width=0.5, alpha=0.25)
        curves.path.line("x", "y", source=self.trail, color=colour, width=1.6)
        curves.path.scatter("x", "y", source=self.point, color=colour, size=9, line_color="white", alpha="alpha")

    def show(self, curve: Curve | None, name: str) -> None:
        self.item.update(label=value(name), visible=curve is not None)
        columns, reversals = {name: np.zeros(0, "float32") for name in ("time", *_OVER_TIME, *_PATH)}, np.zeros(0)
        if curve:
            good, reversals = np.isfinite(curve.dataset["time"].values), curve.reversals
            for name in columns:
                known = curve.dataset[name].values if name in curve.dataset else np.full(len(good), np.nan)
                columns[name] = known[good].astype("float32")
        at = _told([columns[name] for name in _OVER_TIME])
        self.series.data = {name: column[at] for name, column in columns.items()}
        self.reversals.data = {"x": reversals, "y": np.zeros(len(reversals))}
        self.samples.data = {name: columns[name] for name in ("time", *_PATH)}


def _told(series: Sequence[Array]) -> Array:
    """The samples to draw: of each stretch the lowest and the highest of each series, so that no peak is lost."""
    count = len(series[0])
    stretch = -(-count // _STRETCHES)
    if stretch < 3:
        return np.arange(count)
    whole = count // stretch * stretch
    first = np.arange(0, whole, stretch)
    tables = [one[:whole].reshape(-1, stretch) for one in series]
    picked = [first + pick(table, axis=1) for table in tables for pick in (np.argmin, np.argmax)]
    return np.unique([0, *np.concatenate(picked), count - 1])


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
    return plot
