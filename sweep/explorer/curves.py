"""Bokeh figures of trajectories: spin and energies over time, and an animated body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from bokeh import models
from bokeh.core.properties import value
from bokeh.plotting import figure

from sweep.explorer.player import Player
from sweep.explorer.runner import Curve
from sweep.explorer.state import MAX_CELLS
from sweep.explorer.style import CURVES, SOFT, style
from sweep.grid import Array
from sweep.plots import labels, theory

_STRETCHES = 3000
"""Number of stretches of a long curve; only the lowest and the highest sample of each are drawn."""

_OVER_TIME = ("spin", "energy", "dissipated")

_SPIN, _ENTRY = 240, 20
"""Heights in pixels: of the spin's figure without its legend, and of one entry of the legend."""


_ABOVE: dict[str, Any] = {"location": "left", "padding": 0, "margin": 2}
"""The place of a legend above its figure, where it covers no curve."""


class Curves:
    """The figures of the trajectories, with `MAX_CELLS` curves each."""

    def __init__(self, hint: str) -> None:
        """`hint` is the HTML that is shown without curves."""
        self._hint = models.Div(text=hint, sizing_mode="stretch_width")
        self.root = models.Column(self._hint, sizing_mode="stretch_width", name="curves")
        """The hint, or the figures once they have curves: Bokeh warns of a figure without data."""
        self.spin, self.energy = _figure(_SPIN + _ENTRY, "spin"), _figure(190 + _ENTRY, "energies")
        self.energy.x_range = self.spin.x_range
        self._slots = [_Slot(self, colour) for colour in CURVES[:MAX_CELLS]]
        items = [slot.item for slot in self._slots]
        self.spin.add_layout(models.Legend(items=items, name="curve legend", **_ABOVE), "above")
        self.spin.y_range.renderers = [item.renderers[0] for item in items]  # critical spins may be far away
        dashes = [
            (words, [self.energy.line([np.nan], [np.nan], color=SOFT, line_dash=dash)])
            for words, dash in (("energy above rest", "solid"), ("work against friction", "dashed"))
        ]
        self.energy.add_layout(models.Legend(items=dashes, orientation="horizontal", spacing=16, **_ABOVE), "above")
        self._critical = models.ColumnDataSource({"spin": [], "time": [], "dash": [], "symbol": [], "side": []})
        self.spin.hspan("spin", source=self._critical, line_color=SOFT, line_dash="dash", level="underlay")
        self.spin.text("time", "spin", "symbol", source=self._critical, text_font_size="11px", text_align="right",
                       text_baseline="side", text_color="#4a5560", background_fill_color="white",
                       background_fill_alpha=0.8, level="annotation", name="symbols")  # fmt: skip
        self._played: tuple[Curve | None, float] | None = None
        self.player = Player([self.spin, self.energy])

    def show(self, curves: Sequence[Curve | None], names: Sequence[str], active: int) -> None:
        """Draw the curves with their names in the legend, and the critical spins of the curve `active`."""
        for k, slot in enumerate(self._slots):
            slot.show(curves[k] if k < len(curves) else None, names[k] if k < len(curves) else "")
        present = [curve.dataset for curve in curves if curve]
        self.spin.height = _SPIN + _ENTRY * max(1, len(present))
        if present:
            self._label(present[0])
        parts = {"spin": self.spin, "energy": self.energy}
        figures = [part for series, part in parts.items() if any(series in one for one in present)]
        self.root.children = [*figures] or [self._hint]
        end = max([float(one["time"].max()) for one in present], default=1.0)
        chosen = curves[active] if active < len(curves) else None
        if (chosen, end) != self._played:
            self._played = chosen, end
            self.player.show(chosen, CURVES[active], end)
            spins = theory.levels(chosen.dataset) if chosen else []
            self._critical.data = {
                "spin": [at for _, _, at, _ in spins],
                # Side by side, because they often lie close.
                "time": [end * {"n_c1⁺": 0.87, "n_c1⁻": 0.74}.get(sign, 1.0) for _, sign, *_ in spins],
                "dash": [theory.OVER_TIME[name] for name, *_ in spins],
                "symbol": [sign for _, sign, *_ in spins],
                "side": ["bottom" if at > 0 else "top" for _, _, at, _ in spins],  # away from the dots on the zero line
            }

    def _label(self, one: xr.Dataset) -> None:
        """Label the axes, in the units of a trajectory."""
        lowest, highest = (self.energy, self.spin) if "energy" in one else (self.spin, self.energy)
        lowest.xaxis.axis_label, highest.xaxis.axis_label = labels.label(one, "time"), None
        for axis, name, words in (
            (self.spin.yaxis, "spin", ""), (self.energy.yaxis, "energy", "energy per mass"),
        ):  # fmt: skip
            if name in one:
                axis.axis_label = labels.with_unit(words or labels.words(one, name), labels.unit(one, name))


class _Slot:
    """The place of one curve in all figures."""

    def __init__(self, curves: Curves, colour: str) -> None:
        self.series, self.reversals = models.ColumnDataSource(), models.ColumnDataSource()
        self.item = models.LegendItem()
        self._curve: Curve | None = None
        self._put(None)
        self.show(None, "")
        line = curves.spin.line("time", "spin", source=self.series, color=colour, width=1.2)
        dots = curves.spin.scatter("x", "y", source=self.reversals, color=colour, size=8, line_color="white")
        self.item.renderers = [line, dots]
        curves.energy.line("time", "energy", source=self.series, color=colour, width=1.2)
        curves.energy.line("time", "dissipated", source=self.series, color=colour, width=1.2, dash="dashed")

    def show(self, curve: Curve | None, name: str) -> None:
        """Draw a curve, or nothing."""
        if curve is not self._curve:
            self._curve = curve
            self._put(curve)
        self.item.update(label=value(name), visible=curve is not None)

    def _put(self, curve: Curve | None) -> None:
        """Send a curve to the browser; a series that it lacks is NaN."""
        one, reversals = (
            (curve.dataset, curve.reversals) if curve else (xr.Dataset({"time": ("time", [])}), np.zeros(0))
        )
        columns = {
            name: (one[name].values if name in one else np.full(one.sizes["time"], np.nan)).astype("float32")
            for name in ("time", *_OVER_TIME)
        }
        at = _drawn_samples([columns[name] for name in _OVER_TIME])
        self.series.data = {name: column[at] for name, column in columns.items()}
        self.reversals.data = {"x": reversals, "y": np.zeros(len(reversals))}


def _drawn_samples(series: Sequence[Array]) -> Array:
    """Return the samples to draw: the lowest and highest of each stretch of each series, so that no peak is lost."""
    count = len(series[0])
    stretch = -(-count // _STRETCHES)
    if stretch < 3:
        return np.arange(count)
    first = np.arange(0, count // stretch * stretch, stretch)
    tables = [one[: first[-1] + stretch].reshape(-1, stretch) for one in series]
    picked = [first + pick(table, axis=1) for table in tables for pick in (np.argmin, np.argmax)]
    return np.unique([0, *np.concatenate(picked), count - 1])


def _figure(height: int, name: str) -> Any:
    plot = figure(
        height=height, min_width=220, sizing_mode="stretch_width", tools="pan,box_zoom,wheel_zoom,reset,save",
        active_drag="box_zoom", toolbar_location="right", name=name, outline_line_color=None,
    )  # fmt: skip
    plot.toolbar.autohide = True
    style(plot)
    return plot
