"""Computes a configuration from the measured dimensions of a rattleback."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sweep.config import meshes
from sweep.config.values import instead
from sweep.faults import either, fault_of, printable, refusal
from sweep.models.general import solids
from sweep.parameters import PARAMETERS, Parameter
from sweep.units import SI, WRITTEN, Unit, named, quantity, unit_in

_MILLIMETRE = 1e-3
_LEAST = 1.0
"""Longest size in millimetres below which a shape must be in some other unit."""
_MASS = ("mass", "density")
_AXES = [[size, *filter(None, [solids.RADII.get(axis)]), axis] for axis, size in solids.SIZES.items()]
"""For each semi-axis, the names of the measurements that determine it."""

_SOLID = """\
# A homogeneous solid {solid}, by `python -m sweep body` from
#   {said}.
# With semi-axes A, B, C of the solid, inertia about the centre of the ellipsoid is m diag(B² + C², A² + C², A² + B²)/5,
# and the centre of mass lies {below} (E. W. Weisstein, mathworld.wolfram.com, "Ellipsoid" and "Hemisphere").
# The axes of inertia are then turned by the angle; without an angle both senses of spin behave alike.
"""
_SHAPE = """\
# A homogeneous solid of the shape {file}, in millimetres ({sizes}) and z up, by `python -m sweep body` from
#   {said}.
# Its inertia is integrated over its triangles by trimesh.  The ellipsoid of a, b and c is fitted to the lowest tenth
# of its height, within {misfit:.2g} m.
"""
_BODY = """\
# The errors behind ± are to first order, for independent measurements; brackets hold mean and error of a normal
# distribution.
units: {units}
body:
{entries}
# These are guesses: of dry friction on wood, of a drag that stops the spin within a minute, and of a start in the sense
# that turns back.  `run` shows what they lead to, and `fit` finds them from a film.
friction: {{law: coulomb, mu: 0.3, speed: 5.0e-3, sigma: {sigma:.2g}}}
start: {{n0: {n0:g}, x0: {x0:.2g}, y0: {y0:.2g}}}
"""

_SPIN, _LASTS = 5.0, 20.0
"""The start spin, and the time in seconds in which drag alone reduces it by two thirds."""


@dataclass(frozen=True)
class Measured:
    """A number in SI units with its error, and the option that gave it."""

    value: float
    error: float
    said: str


Given = Mapping[str, Measured]
"""Measured values, by the parameter names of `sweep.models.general.solids.body`."""


def measured(name: str, text: str, parameter: Parameter) -> Measured:
    """Read a number with a unit and optionally an error, such as "12.0+-0.1 cm".

    Parameters
    ----------
    name : of the measurement; error messages name its option
    parameter : defines unit and bounds

    Raises
    ------
    InputError
        if `text` is not of this form.
    """
    option, unit = _option(name), parameter.units
    assert isinstance(unit, Unit)
    if not (found := quantity(text, unit)):
        message = refusal(text, f"a number with its unit ({either(WRITTEN[unit])})")
        raise fault_of(message + ("" if unit_in(text) else instead(text, parameter)), file=option)
    value, error = found
    if not (parameter.allows(value) and 0 <= error < float("inf")):
        raise fault_of(refusal(text, f"{parameter.allowed}, in {unit.si}, with an error >= 0"), file=option)
    return Measured(value, error, f"{option} {text.strip()}")


def of_solid(given: Given, *, whole: bool) -> str:
    """Return the text of a configuration in SI units for the body made by `sweep.models.general.solids.body`.

    Raises
    ------
    InputError
        if something is missing or given twice, or if the body does not stand.
    """
    _check_names(given, [_MASS, *_AXES])
    head = _SOLID.format(
        solid="ellipsoid" if whole else "half-ellipsoid, flat on top",
        below="there" if whole else "3C/8 below that",
        said=_said(given),
    )
    return head + _body(lambda numbers: solids.body({"angle": 0.0, **numbers}, whole=whole), given)


def of_shape(given: Given, file: Path) -> str:
    """Return the text of a configuration in SI units for the shape in an STL file, in millimetres.

    Raises
    ------
    OSError
        if the file cannot be read.
    InputError
        if more is given than a mass or a density, the shape is not closed or does not stand, or trimesh is missing.
    """
    _check_names(given, [_MASS])
    for name in [each for each in given if each not in _MASS]:
        raise fault_of("cannot be combined with --stl; leave out one of the two", file=_option(name))
    try:
        corners = meshes.triangles(file.read_bytes())
        sizes = " x ".join(f"{size:.4g}" for size in np.ptp(corners, axis=(0, 1)))
        if np.ptp(corners, axis=(0, 1)).max() < _LEAST:
            raise ValueError(f"read in millimetres, the shape is {sizes}; scale it, by 1000 if it is in metres")
        solid = meshes.mesh(corners * _MILLIMETRE)
    except ValueError as error:
        raise fault_of(str(error), file=f"--stl {file}") from None
    head = _SHAPE.format(file=printable(file.name), sizes=sizes, said=_said(given), misfit=solid.misfit)
    return head + _body(lambda numbers: meshes.body(solid, numbers), given)


def _body(formula: Callable[[solids.Numbers], solids.Numbers], given: Given) -> str:
    """Return the lines of a configuration for the body that `formula` computes from the measurements."""
    values, errors = ({name: getattr(each, part) for name, each in given.items()} for part in ("value", "error"))
    found, spread = formula(values), solids.propagated(formula, values, errors)
    units = {name: named(PARAMETERS[name].units, SI) for name in found}
    # The angle, which is hard to measure, causes the uncertainty.
    unsure = "Ixy" if errors.get("angle") else ""
    entries = (_entry(name, value, spread[name], units[name], name == unsure) for name, value in found.items())
    start = {"n0": -_SPIN if found.get("Ixy", 0) > 0 else _SPIN, "x0": found["a"] / 50, "y0": found["b"] / 50}
    return _BODY.format(units=SI, entries="\n".join(entries), sigma=found["Izz"] / _LASTS, **start)


def _entry(name: str, value: float, error: float, unit: str, unsure: bool) -> str:
    """Return a line of the body: a distribution if it is `unsure`, otherwise a number.

    The errors of all parameters but one are correlated, and stay comments.
    """
    if unsure:
        return f"  {name}: {{normal: [{value + 0.0:.6g}, {error:.2g}]}}  # {unit}"
    return f"  {name}: {value + 0.0:.6g}  #{f' ± {error:.2g}' if error else ''} {unit}"


def _said(given: Given) -> str:
    return ", ".join(each.said for each in given.values())


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _check_names(given: Given, needed: Sequence[Sequence[str]]) -> None:
    """Refuse missing measurements, and two that determine the same parameter."""
    for names in needed:
        if not given.keys() & {*names}:
            raise fault_of(f"a measurement is missing; add {either(map(_option, names))}", file="body")
    for twice in (_MASS, *solids.RADII.items()):
        if {*twice} <= given.keys():
            one, other = map(_option, twice)
            raise fault_of(f"cannot be combined with {other}; leave out one of the two", file=one)
