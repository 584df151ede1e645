"""Patterns over the cells that are no plain results: tiles of pixels, which the browser lays over the map."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable

import numpy as np
from PIL import Image

from sweep.grid import Array
from sweep.plots import marks

_WHITE, _BLACK, _DARK, _LIGHT = 0xC8FFFFFF, 0x90000000, 0xFF474340, 0xFFA8A39E  # ABGR; 0 is transparent

_EXAMPLE = "#21918c"
"""A colour of a map under a pattern that lets it be seen."""


def _tile(side: int, colour: Callable[[Array, Array], Array]) -> Array:
    """The colours of a tile by x and y; its first row is the lowest, as in the browser."""
    y, x = np.indices((side, side))
    return np.ascontiguousarray(np.broadcast_to(colour(x, y), (side, side)).astype("uint32"))


def _lines(across: Array) -> Array:
    """White lines, with black beside them, where a distance from the lines is 0 and 1."""
    return np.select([across == 0, across == 1], [_WHITE, _BLACK], 0)


TILES = {
    "not_run": _tile(1, lambda x, _: 0 * x + _LIGHT),
    "failed": _tile(10, lambda x, y: np.where(((x + y) % 10 == 0) | (x == y), _LIGHT, _DARK)),
    "impossible": _tile(6, lambda _, y: np.where(y == 0, _DARK, _LIGHT)),
    "no_value": _tile(1, lambda x, _: 0 * x + _LIGHT),
    "time_limit": _tile(10, lambda x, y: _lines((x + y) % 10)),
    "inferred": _tile(6, lambda x, y: np.where(x < 2, _lines(y), 0)),
    "noise_limited": _tile(8, lambda _, y: _lines(y)),
}
assert [*TILES, "uncertain"] == list(marks.WORDS)  # which has a dot


def swatch(kind: str) -> str:
    """The CSS of a kind in a legend."""
    if kind == "uncertain":
        return "background:#fff;border:1px solid #000;border-radius:50%;height:5px;margin:0 9px;width:5px"
    tile = Image.fromarray(TILES[kind][::-1].view("uint8").reshape(*TILES[kind].shape, 4), "RGBA")
    file = io.BytesIO()
    tile.save(file, "PNG")
    picture = f"url(data:image/png;base64,{base64.b64encode(file.getvalue()).decode()})"
    return f"height:14px;border:1px solid #8a949e;border-radius:2px;background:{picture} {_EXAMPLE}"
