"""The registry of pictures: every `Picture` in the tuple `PICTURES` of a module of this package.

It loads no plotting library, because configurations name pictures.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from sweep.plots.pictures.record import Picture

PICTURES: dict[str, Picture] = {
    picture.name: picture
    for module in iter_modules(__path__, f"{__name__}.")
    for picture in getattr(import_module(module.name), "PICTURES", ())
}


def of(name: str) -> Picture:
    """Return the record of a picture, or the usual one of a variable."""
    return PICTURES.get(name) or Picture(name)
