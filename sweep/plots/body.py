"""Describe a body that moves on its table: its surface, its attitude and place, and the view of both.

Animations by matplotlib and the explorer's player share this description.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import to_rgb
from scipy.spatial.transform import Rotation

from sweep.grid import Array
from sweep.models.general.rigid_body import contact_on
from sweep.models.general.surfaces import ELLIPSOID, SURFACES, offset
from sweep.models.vectors import Vector
from sweep.results import kind

SUN = {"azdeg": 225, "altdeg": 60}
"""Direction of the light, in degrees."""

_LINES = 9
"""Lines on the table in each direction."""


@dataclass(frozen=True)
class Moving:
    """The attitudes and places of a body at given times, and the points of its surface."""

    points: Array
    """In the body's own axes, from the centre of mass, shape (3, heights, azimuths)."""
    turns: Array
    """The matrices that take vectors from the body to the table, shape (times, 3, 3)."""
    contacts: Array
    """The contact point in the body's own axes, shape (times, 3)."""
    path: Array
    """The contact point on the table, shape (2, times)."""

    @property
    def reach(self) -> float:
        """Half the side of the smallest table with room for the body on its path."""
        return float(0.72 * np.abs(self.points).max() + np.ptp(self.path, axis=1).max() / 2)

    @property
    def _middle(self) -> Array:
        return np.asarray((self.path.max(1) + self.path.min(1)) / 2)

    def table(self, half: float) -> list[Array]:
        """The ends of the lines on a table of side 2 `half` around the path, each of shape (3, 2)."""
        ticks = np.linspace(-half, half, _LINES)
        lines = [np.array([ticks[[0, -1]], [tick, tick]]) for tick in ticks]
        middle = self._middle[:, None]
        return [np.append(each + middle, [[0, 0]], axis=0) for line in lines for each in (line, line[::-1])]

    def look(self, axes: Any, half: float) -> None:
        """Let three-dimensional axes of matplotlib show that whole table, in perspective."""
        middle = self._middle
        axes.set(xlim=middle[0] + [-half, half], ylim=middle[1] + [-half, half], zlim=(0, half))
        axes.set_box_aspect((2, 2, 1), zoom=1.3)
        axes.set_proj_type("persp", focal_length=0.7)
        axes.view_init(elev=32, azim=-60)
        axes.set_axis_off()

    def colours(self, colour: str) -> Array:
        """Colour the faces between the points, one half lighter; shape (heights - 1, azimuths - 1, 3)."""
        halves = np.where(self.points[0, :-1, :-1] + self.points[0, 1:, 1:] > 0, 0.8, 0.3)[..., None]
        return np.asarray(1 - (1 - np.array(to_rgb(colour))) * halves)


def drawable(dataset: xr.Dataset) -> bool:
    """Return whether trajectories have an attitude and a known shape; user-defined models may lack both."""
    return "heading" in dataset and ("body" in dataset.attrs or all(name in dataset for name in ("a", "b", "c")))


def moving(one: xr.Dataset, times: Array) -> Moving:
    """Return the body of a trajectory at the given times."""
    columns = kind.body(one)
    surface = SURFACES[one.attrs.get("surface", ELLIPSOID.name)]
    constants = SimpleNamespace(
        **{k: v[0] for k, v in zip(surface.constants, surface.of(columns, np.zeros(1)), strict=True)}
    )
    heading, roll, pitch, *path = at(one, times, "heading", "roll_angle", "pitch_angle", "table_x", "table_y")
    delta = columns.get("delta", np.zeros(1))
    turns = rotation(heading, roll, pitch) @ Rotation.from_euler("z", -delta[0]).as_matrix()
    contacts = np.array(contact_on(surface)(turns[:, 2, 0], turns[:, 2, 1], Vector(0.0, 0.0, 0.0), constants)[2]).T
    return Moving(_points(surface is ELLIPSOID, columns), turns, contacts, np.array(path))


def at(one: xr.Dataset, times: Array, *names: str) -> list[Array]:
    """Return series of a trajectory at the given times; after its end they keep their last values."""
    known = np.isfinite(one["heading"].values)
    return [np.interp(times, one["time"].values[known], one[name].values[known]) for name in names]


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
    azimuth = np.linspace(2 * np.pi, 0, 33)  # so that the outer sides are lit
    x, y = a * np.outer(bowl, np.cos(azimuth)), b * np.outer(bowl, np.sin(azimuth))
    return np.stack([x, y, np.broadcast_to(c * depth[:, None] - below, x.shape)])


def rotation(heading: Any, roll: Any, pitch: Any) -> Array:
    """The matrices that take vectors from the body to the table, shape (…, 3, 3)."""
    turns = Rotation.from_euler("ZXY", np.stack([-heading, roll, pitch], axis=-1))
    return np.asarray(np.diag([1, -1, -1]) @ turns.as_matrix())
