"""Writes the configuration of a rattleback from the measured sizes of a solid."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sweep.config import meshes
from sweep.config.values import instead
from sweep.faults import either, fault_of, printable, refusal
from sweep.parameters import PARAMETERS
from sweep.units import SI, WRITTEN, Unit, parts, quantity, unit_in

_MILLIMETRE = 1e-3
_LEAST = 1.0
"""Longest size in millimetres below which a shape must be in some other unit."""

_SHAPE = """\
# The solid is {file}, in millimetres ({sizes}) and z up. J is its inertia per mass, integrated over its triangles by
# trimesh. The ellipsoid of a, b and c is fitted to the lowest tenth of its height, within {misfit:.2g} m.
"""
_BODY = """\
# Brackets hold mean and error of a normal distribution; an error that was not given is half the last digit.
units: {units}
body:
{entries}
"""
_GUESSES = """\
# These are guesses: of dry friction on wood, of a drag that stops the spin within a minute, and of a start in the sense
# that turns back.  `run` shows what they lead to, and `fit` finds them from a film.
friction: {{law: coulomb, mu: 0.3, speed: 5.0e-3, sigma: {sigma:.2g}}}
start: {{n0: {n0:g}, x0: {x0:.2g}, y0: {y0:.2g}}}
"""

_SPIN, _LASTS = 5.0, 20.0
"""The start spin, and the time in seconds in which drag alone reduces it by two thirds."""


def entry(name: str, text: str) -> str:
    """Return the value of a parameter in a configuration for a text with a unit, such as "12.0+-0.1 cm".

    It is a normal distribution, unless the text gives an error of zero.

    Raises
    ------
    InputError
        if `text` is not of this form; it names the parameter's option.
    """
    option, parameter = f"--{name.replace('_', '-')}", PARAMETERS[name]
    unit = parameter.units
    assert isinstance(unit, Unit)
    if not (found := quantity(text, unit)):
        message = refusal(text, f"a number with its unit ({either(WRITTEN[unit])})")
        raise fault_of(message + ("" if unit_in(text) else instead(text, parameter)), file=option)
    if not (parameter.allows(found[0]) and 0 <= found[1] < float("inf")):
        raise fault_of(refusal(text, f"{parameter.allowed}, in {unit.si}, with an error >= 0"), file=option)
    value, error, written = parts(text)
    error = error or str(Decimal(5).scaleb(int(Decimal(value).as_tuple().exponent) - 1))
    return f"{{normal: [{value} {written}, {error} {written}]}}" if float(error) else f"{value} {written}"


def of_solid(solid: str, texts: Mapping[str, str]) -> str:
    """Return the lines of a configuration in SI on a solid with the sizes in `texts`, by parameter.

    `solid` is what follows the colon of that key.

    Raises
    ------
    InputError
        if a text is not a number with a unit.
    """
    entries = {"solid": solid, **{name: f" {entry(name, text)}" for name, text in texts.items()}}
    return _BODY.format(units=SI, entries="\n".join(f"  {name}:{each}" for name, each in entries.items()))


def of_shape(file: Path, texts: Mapping[str, str]) -> str:
    """Return the lines of a configuration in SI on the shape in an STL file, in millimetres.

    Raises
    ------
    OSError
        if the file cannot be read.
    InputError
        if the shape is not closed or does not stand, or trimesh is missing.
    """
    try:
        corners = meshes.triangles(file.read_bytes())
        sizes = " x ".join(f"{size:.4g}" for size in np.ptp(corners, axis=(0, 1)))
        if np.ptp(corners, axis=(0, 1)).max() < _LEAST:
            raise ValueError(f"read in millimetres, the shape is {sizes}; scale it, by 1000 if it is in metres")
        shape, misfit = meshes.shape(corners * _MILLIMETRE)
    except ValueError as error:
        raise fault_of(str(error), file=f"--stl {file}") from None
    head = _SHAPE.format(file=printable(file.name), sizes=sizes, misfit=misfit)
    return head + of_solid("".join(f"\n    {name}: {value:.6g}" for name, value in shape.spec.items()), texts)


def guesses(body: Mapping[str, NDArray[np.float64]]) -> str:
    """Return the lines on friction and start for a body with these parameters of the models, each of shape (1,)."""
    a, b, inertia = (float(body[name][0]) for name in ("a", "b", "Izz"))
    spin = -_SPIN if body["Ixy"][0] > 0 else _SPIN
    return _GUESSES.format(sigma=inertia / _LASTS, n0=spin, x0=a / 50, y0=b / 50)
