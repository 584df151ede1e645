"""Moving pictures of trajectories: bodies that turn on a table, their contact points' paths, and their spins."""

from __future__ import annotations

import re
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.colors import LightSource, to_rgb
from matplotlib.figure import Figure

from sweep.grid import Array
from sweep.models.general.surfaces import ELLIPSOID, SURFACES, offset
from sweep.plots import labels, trajectories
from sweep.plots.formats import suffix
from sweep.results.netcdf import open_dataset
from sweep.results.writing import replacing

MOST = 6
"""Bodies side by side."""

SECONDS = 10.0
"""The time that a clip takes unless its speed is given."""

FRAMES_A_SECOND = 20

_BEYOND = 1.3
"""The end of a clip, in times of the last of the bodies' first reversals."""

_BUTTONS = {
    "minus": "−", "fast-backward": "⏮", "step-backward": "⏪", "play fa-flip-horizontal": "◀", "pause": "⏸",
    "play": "▶", "step-forward": "⏩", "fast-forward": "⏭", "plus": "+",
}  # fmt: skip
"""What a page shows in place of the icons that matplotlib's would load from the network."""

FORMATS = ("gif", "mp4", "html")


def animate(
    dataset: xr.Dataset | str | Path, output: str | Path | None = None, *,
    begin: float = 0.0, end: float | None = None, speed: float | None = None,
) -> FuncAnimation:  # fmt: skip
    """Show how the bodies of trajectories turn, side by side and in one clock.

    Parameters
    ----------
    dataset : what `sweep.trajectory` gives, or the path of its file
    output : file to write; its suffix names the format: gif, mp4 (which needs ffmpeg) or html (a page without network)
    begin, end : the stretch of time shown; by default until a third beyond the last of the bodies' first reversals
    speed : time shown in a second of the clip; by default such that the clip takes ten

    Returns
    -------
    The animation, which a notebook shows by its `to_jshtml()`.

    Raises
    ------
    ValueError
        if the bodies have no attitude or are too many, the stretch is empty, or there is no such format.
    StoreError
        if the file is not a dataset, or `output` cannot be written.
    """
    path = None if output is None else Path(output)
    if path is not None:
        check(path)
    found = dataset if isinstance(dataset, xr.Dataset) else open_dataset(Path(dataset))
    if "heading" not in found:
        raise ValueError("its bodies have no attitude; animate trajectories of the models slip or noslip")
    if found.sizes["trajectory"] > MOST:
        raise ValueError(
            f"{found.sizes['trajectory']} bodies are too many to stand side by side; choose at most {MOST}"
        )
    last = float(found["time"][-1])
    end = min(_until(found) if end is None else end, last)
    if not begin < end:
        raise ValueError(f"nothing lies between the times {begin:g} and {end:g}; the trajectories end at {last:g}")
    count = int(np.ceil(FRAMES_A_SECOND * ((end - begin) / speed if speed else SECONDS))) + 1
    scene = _Scene(found, np.linspace(begin, end, count))
    animation = FuncAnimation(scene.figure, scene.show, frames=count, interval=1000 / FRAMES_A_SECOND, repeat=True)
    if path is not None:
        _save(animation, path)
    return animation


def check(path: Path) -> None:
    """Raise a `ValueError` if no animation can be written to a file of this name."""
    if suffix(path) not in FORMATS:
        raise ValueError(f"output: {path}: unknown format; write a gif, mp4 or html")
    if suffix(path) == "mp4" and not FFMpegWriter.isAvailable():
        raise ValueError(f"output: {path}: needs ffmpeg, which is not installed; install it, or write a gif or html")


def _until(dataset: xr.Dataset) -> float:
    """When a clip ends by default."""
    times = [trajectories.reversal_times(dataset.isel(trajectory=i)) for i in range(dataset.sizes["trajectory"])]
    return _BEYOND * max((each[0] for each in times if len(each)), default=trajectories.lively_until(dataset))


class _Scene:
    """The figure, and the state of each body at each frame."""

    def __init__(self, dataset: xr.Dataset, times: Array) -> None:
        self.times, self.figure = times, Figure((max(3.2 * dataset.sizes["trajectory"], 6.4), 4.8), dpi=80)
        bodies = dataset.sizes["trajectory"]
        self.figure.suptitle(labels.constants(trajectories.constants_apart(dataset)), fontsize=8)
        self.spins = self.figure.add_axes((0.1, 0.12, 0.85, 0.26))
        self.spins.set(xlim=(times[0], times[-1]), xlabel=labels.label(dataset, "time"), ylabel="spin n")
        self.spins.axhline(0, color="black", linewidth=0.5)
        self.bodies = []
        for i in range(bodies):
            one = dataset.isel(trajectory=i)
            place = (i / bodies, 0.42, 1 / bodies, 0.55)
            axes: Any = self.figure.add_axes(place, projection="3d", computed_zorder=False)
            axes.set_title(trajectories.label(dataset, i), fontsize=9, color=f"C{i}", y=0.82)
            (curve,) = self.spins.plot([], [], color=f"C{i}", linewidth=1)
            self.bodies.append(_Body(one, times, axes, curve, f"C{i}"))
        spins = np.concatenate([body.spin for body in self.bodies])
        margin = 0.08 * max(np.ptp(spins), 1e-12)
        self.spins.set_ylim(min(spins.min(), 0) - margin, max(spins.max(), 0) + margin)

    def show(self, frame: int) -> list[Any]:
        """Draw all bodies at a frame."""
        for body in self.bodies:
            body.show(frame, self.times)
        return []


class _Body:
    """One body on its table, and its curve of n(t)."""

    def __init__(self, one: xr.Dataset, times: Array, axes: Any, curve: Any, colour: str) -> None:
        self.axes, self.curve = axes, curve
        self.surface: Any = None
        columns = {name: np.atleast_1d(one[name].values) for name in ("a", "b", "c", "offset") if name in one}
        surface = SURFACES[one.attrs.get("surface", ELLIPSOID.name)]
        constants = SimpleNamespace(**{k: v[0] for k, v in zip(surface.constants, surface.of(columns), strict=True)})
        self.points = _points(surface is ELLIPSOID, columns)
        series = ("heading", "roll_angle", "pitch_angle", "table_x", "table_y", "spin")
        known = np.isfinite(one["heading"].values)
        at = [np.interp(times, one["time"].values[known], one[name].values[known]) for name in series]
        self.spin, self.path = at[5], np.array(at[3:5])
        delta = float(one["delta"]) if "delta" in one else 0.0
        self.turns = [_rotation(*angles) @ _about_z(-delta) for angles in zip(*at[:3], strict=True)]
        self.contacts = [np.array(surface.contact(*turn[2, :2], 0.0, 0.0, 0.0, constants)[1]) for turn in self.turns]
        size = np.abs(self.points).max()
        middle, half = (self.path.max(1) + self.path.min(1)) / 2, 0.72 * size + np.ptp(self.path, axis=1).max() / 2
        axes.set(xlim=middle[0] + [-half, half], ylim=middle[1] + [-half, half], zlim=(0, half))
        axes.set_box_aspect((2, 2, 1), zoom=1.3)
        axes.set_proj_type("persp", focal_length=0.7)
        axes.view_init(elev=32, azim=-60)
        axes.set_axis_off()
        ticks = np.linspace(-half, half, 9)
        for tick in ticks:  # the table
            lines: Any = {"color": "0.85", "linewidth": 0.6, "zorder": 0}
            axes.plot(middle[0] + ticks[[0, -1]], middle[1] + [tick, tick], 0, **lines)
            axes.plot(middle[0] + [tick, tick], middle[1] + ticks[[0, -1]], 0, **lines)
        # Seen through the body, which covers most of it.
        (self.trace,) = axes.plot([], [], [], color="black", linewidth=1, zorder=3)
        (self.dot,) = axes.plot([], [], [], "o", color="black", markersize=3, zorder=3)
        halves = np.where(self.points[0, :-1, :-1] + self.points[0, 1:, 1:] > 0, 0.8, 0.3)[..., None]
        self.colours = 1 - (1 - np.array(to_rgb(colour))) * halves

    def show(self, frame: int, times: Array) -> None:
        turn, place = self.turns[frame], [*self.path[:, frame], 0.0]
        at = np.einsum("ij,jkl->ikl", turn, self.points - self.contacts[frame][:, None, None])
        at += np.array(place)[:, None, None]
        if self.surface is not None:
            self.surface.remove()
        self.surface = self.axes.plot_surface(
            *at,
            facecolors=self.colours,
            rstride=1,
            cstride=1,
            linewidth=0,
            antialiased=False,
            zorder=2,
            lightsource=LightSource(azdeg=225, altdeg=60),
        )
        self.trace.set_data_3d(*self.path[:, : frame + 1], np.zeros(frame + 1))
        self.dot.set_data_3d(*([each] for each in place))
        self.curve.set_data(times[: frame + 1], self.spin[: frame + 1])


def _points(ellipsoid: bool, columns: dict[str, Array]) -> Array:
    """Points of a body's surface in its own axes, from the centre of mass, shape (3, heights, azimuths).

    An ellipsoid is whole if its centre of mass is at its centre; other bodies are flat on top.
    """
    a, b, c = (float(columns[name][0]) for name in ("a", "b", "c"))
    below, lid = float(offset(columns)[0]), np.linspace(1, 0, 4)[1:]
    bowl = np.sin(np.linspace(0, np.pi / (2 if below else 1), 12))
    depth = np.cos(np.linspace(0, np.pi / (2 if below else 1), 12))
    if not ellipsoid:
        a, b, below = c / np.sqrt(a), c / np.sqrt(b), below or 1e-300
        bowl = np.linspace(0, 1, 12)
        depth = 1 - bowl**2
    if below:
        bowl, depth = np.append(bowl, lid), np.append(depth, 0 * lid)
    azimuth = np.linspace(2 * np.pi, 0, 33)  # so that the sides that are lit are those outside
    x, y = a * np.outer(bowl, np.cos(azimuth)), b * np.outer(bowl, np.sin(azimuth))
    return np.stack([x, y, np.broadcast_to(c * depth[:, None] - below, x.shape)])


def _rotation(heading: float, roll: float, pitch: float) -> Array:
    """The matrix that takes vectors from the body to the table."""
    (cos, sin), (cos2, sin2) = ((np.cos(angle), np.sin(angle)) for angle in (roll, pitch))
    about_x = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    about_y = np.array([[cos2, 0, sin2], [0, 1, 0], [-sin2, 0, cos2]])
    return np.asarray(np.diag([1, -1, -1]) @ _about_z(-heading) @ about_x @ about_y)


def _about_z(angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


def _save(animation: FuncAnimation, path: Path) -> None:
    """Write an animation in the format that the suffix names."""
    with replacing(path) as temporary:
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
