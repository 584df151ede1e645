"""Animate trajectories: bodies on a table, the paths of their contact points, and their spins."""

from __future__ import annotations

import re
from math import inf, isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeGuard

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.colors import LightSource
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweep.config import Config
from sweep.config.document import is_number, plain_data
from sweep.faults import fault_of, local_path, refusal
from sweep.grid import Array
from sweep.plots import body, labels, trajectories
from sweep.plots.figure import constants_in_lines, drawing, zero_line
from sweep.plots.formats import suffix
from sweep.results.dataset import TRAJECTORIES, along_one
from sweep.results.writing import replacing

MOST = 6
"""Largest number of bodies shown side by side."""

SECONDS = 10.0
"""Duration of a clip whose speed is not given."""

FRAMES_A_SECOND = 20

_LONGEST, _LONGEST_IN_MEMORY = 3600.0, 60.0
"""Largest duration of a clip in seconds, and of a gif or html, which stays in memory until it is written: a megabyte a
frame."""

_BEYOND = 2.0
"""End of a clip, relative to the latest first reversal of its bodies, which is thus in the middle."""

_BUTTONS = {
    "minus": "−", "fast-backward": "⏮", "step-backward": "⏪", "play fa-flip-horizontal": "◀", "pause": "⏸",
    "play": "▶", "step-forward": "⏩", "fast-forward": "⏭", "plus": "+",
}  # fmt: skip
"""Replacements for the icons that a page of matplotlib would load from the network."""

_SURFACE = {"rstride": 1, "cstride": 1, "linewidth": 0, "antialiased": False, "zorder": 2, "clip_on": False}
"""Options of `plot_surface`: draw each face, without lines between them."""

FORMATS = ("gif", "mp4", "html")


def animate(
    shown: xr.Dataset, output: str | Path | None = None, *,
    begin: float = 0.0, end: float | None = None, speed: float | None = None,
) -> FuncAnimation:  # fmt: skip
    """Show how the bodies of trajectories turn; arguments, result and errors as of `sweep.animate`.

    Parameters
    ----------
    output, begin, end, speed : as `check` allows them
    """
    path = None if output is None else Path(output)
    if not body.drawable(shown):
        raise fault_of("has no attitude, or no a, b and c; animate trajectories of slip or noslip", "source")
    shown = along_one(shown)
    if not shown.sizes[TRAJECTORIES] or not shown.sizes["time"]:
        raise fault_of("has an axis without values; select at least one", "source")
    if (bodies := shown.sizes[TRAJECTORIES]) > MOST:
        raise fault_of(f"{bodies} bodies are too many for one clip; choose at most {MOST}", "source")
    first, last = map(float, shown["time"][[0, -1]])
    begin = max(begin, first)
    end = min(_until(shown) if end is None else end, last)
    if not begin < end:
        words = f"nothing lies between the times {begin:g} and {end:g}; the trajectories end at {last:g}"
        raise fault_of(words, "begin")
    seconds = SECONDS if speed is None else (end - begin) / speed
    in_memory = path is not None and suffix(path) != "mp4"
    longest = _LONGEST_IN_MEMORY if in_memory else _LONGEST
    if seconds > longest:
        words = f"the clip would last {seconds:.3g} s, and may last {longest:.0f} s"
        more = ", or write an mp4" if in_memory else ""
        raise fault_of(f"{words}; give a speed of {(end - begin) / longest:.3g} or more{more}", "speed")
    count = int(np.ceil(FRAMES_A_SECOND * seconds)) + 1
    scene = _Scene(labels.escaped(shown), np.linspace(begin, end, count))
    animation = FuncAnimation(scene.figure, scene.show, frames=count, interval=1000 / FRAMES_A_SECOND, repeat=True)
    if path is not None:
        _save(animation, path)
    return animation


def is_dataset(source: object) -> TypeGuard[xr.Dataset | str | Path]:
    """Return whether `source` is a dataset or the path of one, and not a configuration."""
    return isinstance(source, xr.Dataset) or (isinstance(source, str | Path) and suffix(Path(source)) == "nc")


def require_attitude(config: Config) -> None:
    """Raise an `InputError` if the bodies of a simulated model have no attitude that could be shown."""
    if config.simulated and not config.equations.path:
        raise config.error(("model",), f"the bodies of {config.model} have no attitude; animate slip or noslip")


def check(output: str | Path | None, begin: float, end: float | None, speed: float | None) -> None:
    """Raise an `InputError` if there is no such interval or speed, or no animation in a file of this name."""
    if not (is_number(plain_data(begin)) and isfinite(begin)):
        raise fault_of(refusal(begin, "a finite number"), "begin")
    if end is not None and not (is_number(plain_data(end)) and begin < end < inf):
        raise fault_of(refusal(end, f"a finite number above begin, {begin:g}"), "end")
    if speed is not None and not (is_number(plain_data(speed)) and 0 < speed < inf):
        raise fault_of(refusal(speed, "a finite number > 0"), "speed")
    if output is None:
        return
    path = local_path(output)
    if suffix(path) not in FORMATS:
        raise fault_of(f"{path}: unknown format; write a gif, mp4 or html", "output")
    if suffix(path) == "mp4" and not FFMpegWriter.isAvailable():
        raise fault_of(f"{path}: needs ffmpeg, which is not installed; install it, or write a gif or html", "output")


def _until(dataset: xr.Dataset) -> float:
    """Return the time at which a clip ends by default."""
    times = list(map(trajectories.reversal_times, trajectories.each(dataset)))
    return _BEYOND * max((each[0] for each in times if len(each)), default=trajectories.lively_until(dataset))


class _Scene:
    """The figure, and the state of each body at each frame."""

    def __init__(self, dataset: xr.Dataset, times: Array) -> None:
        bodies = dataset.sizes[TRAJECTORIES]
        self.figure = Figure((max(3.2 * bodies, 6.4), 4.8), dpi=80)
        constants = labels.constants(trajectories.constants_apart(dataset))
        self.figure.suptitle(constants_in_lines(constants, self.figure.get_figwidth()), y=0.99, fontsize=8)
        over_time = self.figure.add_axes((0.1, 0.12, 0.85, 0.26))
        across, up = (labels.label(dataset, name) for name in ("time", "spin"))
        over_time.set(xlim=(times[0], times[-1]), xlabel=across, ylabel=up)
        zero_line(over_time)
        ones = trajectories.each(dataset)
        moving = [body.moving(one, times) for one in ones]
        half = max(each.reach for each in moving)  # one scale for all
        self.bodies = []
        for i, (one, each) in enumerate(zip(ones, moving, strict=True)):
            place = (i / bodies, 0.42, 1 / bodies, 0.55)
            axes: Any = self.figure.add_axes(place, projection="3d", computed_zorder=False)
            axes.set_title("", fontsize=9, color=f"C{i}", y=0.8)
            each.look(axes, half)
            for line in each.table(half):
                axes.plot(*line, color="0.85", linewidth=0.6, zorder=0)
            (curve,) = over_time.plot([], [], color=f"C{i}", linewidth=1)
            self.bodies.append(_Body(one, trajectories.name(dataset, i), each, times, axes, curve))
        spins = np.append(np.concatenate([each.spin for each in self.bodies]), 0.0)
        margin = 0.08 * max(np.ptp(spins), 1e-12)
        over_time.set_ylim(spins.min() - margin, spins.max() + margin)

    def show(self, frame: int) -> list[Any]:
        """Draw all bodies at a frame."""
        for each in self.bodies:
            each.show(frame)
        return []


class _Body:
    """One body on its table, and its curve of n(t)."""

    def __init__(self, one: xr.Dataset, name: str, moving: body.Moving, times: Array, axes: Any, curve: Line2D) -> None:
        self._name, self._reversals = name, trajectories.reversal_times(one)
        self._counts = "reversals" in one and TRAJECTORIES not in one.coords  # a film has a name
        self.axes, self.curve, self.times, self.moving = axes, curve, times, moving
        (self.spin,) = body.at(one, times, "spin")
        # Seen through the body, which covers most of it.
        (self.trace,) = axes.plot([], [], [], color="black", linewidth=1, zorder=3)
        (self.dot,) = axes.plot([], [], [], "o", color="black", markersize=3, zorder=3)
        self.look = {"facecolors": self.moving.colours(str(curve.get_color())), "lightsource": LightSource(**body.SUN)}

    def show(self, frame: int) -> None:
        """Draw the body at a frame, in place of the previous one."""
        moving, place = self.moving, np.append(self.moving.path[:, frame], 0.0)
        at = np.einsum("ij,jkl->ikl", moving.turns[frame], moving.points - moving.contacts[frame][:, None, None])
        for surface in list(self.axes.collections):
            surface.remove()
        self.axes.plot_surface(*at + place[:, None, None], **_SURFACE, **self.look)
        count = labels.reversals(int((self._reversals <= self.times[frame]).sum()))
        self.axes.title.set_text(f"{self._name}: {count}" if self._counts else self._name)
        self.trace.set_data_3d(*moving.path[:, : frame + 1], np.zeros(frame + 1))
        self.dot.set_data_3d(*([each] for each in place))
        self.curve.set_data(self.times[: frame + 1], self.spin[: frame + 1])


def _save(animation: FuncAnimation, path: Path) -> None:
    """Write an animation in the format that the suffix names."""
    with replacing(path) as temporary, drawing():
        if suffix(path) == "html":
            with mpl.rc_context({"animation.embed_limit": 1000}):
                page = animation.to_jshtml()
            page = re.sub(r"<link[^>]*font-awesome[^>]*>", '<meta charset="utf-8">', page)
            page = re.sub(r'<i class="fa fa-([a-z -]+)"></i>', lambda found: _BUTTONS[found[1]], page)
            temporary.write_text(page, encoding="utf-8")
            return
        writer = PillowWriter if suffix(path) == "gif" else FFMpegWriter
        with TemporaryDirectory() as folder:  # the writers take the format from the suffix
            clip = Path(folder) / f"clip.{suffix(path)}"
            animation.save(clip, writer=writer(fps=FRAMES_A_SECOND))
            temporary.write_bytes(clip.read_bytes())
