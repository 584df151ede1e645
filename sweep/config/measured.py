"""From what a ruler and a balance say of a rattleback to its configuration."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import pint

from sweep.config.faults import either, fault_of, refusal
from sweep.models.general import solids
from sweep.parameters import PARAMETERS, SI, Parameter
from sweep.variables import in_si

_NUMBER = r"[-+]?(?:\.\d+|\d+(?:\.\d*)?)(?:[eE][-+]?\d+)?"
_QUANTITY = re.compile(rf"(?P<value>{_NUMBER}) *(?:(?:±|\+/?-) *(?P<error>{_NUMBER}))? *(?P<unit>°|[^\W\d_]+)")
_EXAMPLES = {"m": "12.0+-0.1cm", "kg": "30.0+-0.1g", "radian": "2.0+-0.5deg"}
_UNITS: pint.UnitRegistry[float] = pint.UnitRegistry()

_NEEDED = [["mass"], *([size, *filter(None, [solids.RADII.get(axis)]), axis] for axis, size in solids.SIZES.items())]
"""What has to be known: for each, the names of the measurements that tell it."""

_WRITTEN = """\
# A homogeneous solid {solid}, by `python -m sweep body` from
#   {said}.
# The solid has the semi-axes A, B, C: its inertia about the ellipsoid's centre is m diag(B² + C², A² + C², A² + B²)/5,
# and its centre of mass lies {below} (E. W. Weisstein, mathworld.wolfram.com, "Ellipsoid" and "Hemisphere").
# The axes of inertia are then turned by the angle; without one, nothing tells one sense of spin from the other.
# Behind ± are errors, to first order, if those of the measurements are independent.
units: {units}
body:
{entries}
# Change these to yours: they are guesses of dry friction on wood, and of a spin either way.
friction: {{law: coulomb, mu: 0.3, regularisation: sqrt, speed: 5.0e-3}}
start: {{n0: [-5, 5], x0: {x0:.2g}, y0: {y0:.2g}}}
"""


@dataclass(frozen=True)
class Measured:
    """A number in SI units with its error, and the option that gave it."""

    value: float
    error: float
    said: str


def measured(option: str, text: str, parameter: Parameter) -> Measured:
    """Read a number with its unit and perhaps its error, such as "12.0+-0.1 cm".

    Parameters
    ----------
    option : named in faults
    parameter : whose unit and bounds it has

    Raises
    ------
    ConfigError
        if `text` is something else.
    """
    unit, found = _unit(parameter), _QUANTITY.fullmatch(text.strip())
    try:
        factor = float(_UNITS.Quantity(1.0, found["unit"]).to(unit).magnitude) if found else 0.0
    except (pint.PintError, AttributeError):
        factor = 0.0
    if not found or not factor:
        raise fault_of(refusal(text, f"a number with its unit, such as {_EXAMPLES[unit]}"), file=option)
    value, error = (float(found[name] or 0) * factor for name in ("value", "error"))
    if not (parameter.allows(value) and 0 <= error < float("inf")):
        raise fault_of(refusal(text, f"{parameter.allowed}, in {unit}, with an error >= 0"), file=option)
    return Measured(value, error, f"{option} {text.strip()}")


def configuration(given: Mapping[str, Measured], *, whole: bool) -> str:
    """Return the text of a configuration, in SI units, of the body that `sweep.models.general.solids.body` makes.

    Raises
    ------
    ConfigError
        if something is missing or given twice, or if the body does not stand.
    """
    _check_names(given)
    values = {"angle": 0.0} | {name: each.value for name, each in given.items()}
    errors = {name: each.error for name, each in given.items() if each.error}
    found = solids.body(values, whole=whole)
    spread = solids.propagated(lambda numbers: solids.body(numbers, whole=whole), values, errors)
    _check_stands(found)
    entries = (
        f"  {name}: {value + 0.0:.6g}  #{f' ± {spread[name]:.2g}' if spread[name] else ''} {_unit(PARAMETERS[name])}"
        for name, value in found.items()
    )
    return _WRITTEN.format(
        solid="ellipsoid" if whole else "half-ellipsoid, flat on top",
        below="there" if whole else "3C/8 below that",
        said=", ".join(each.said for each in given.values()),
        units=SI, entries="\n".join(entries), x0=found["a"] / 50, y0=found["b"] / 50,
    )  # fmt: skip


def _unit(parameter: Parameter) -> str:
    return in_si(parameter.units, parameter.long_name)[0]


def _options(names: list[str]) -> list[str]:
    return [f"--{name.replace('_', '-')}" for name in names]


def _check_names(given: Mapping[str, Measured]) -> None:
    """Refuse what is missing, and a semi-axis beside the radius that tells it as well."""
    for names in _NEEDED:
        if not given.keys() & {*names}:
            raise fault_of(f"not all is known; give {either(_options(names))} as well", file="body")
    for twice in solids.RADII.items():
        if {*twice} <= given.keys():
            axis, radius = _options([*twice])
            raise fault_of(f"cannot be combined with {radius}; leave out one of the two", file=axis)


def _check_stands(body: Mapping[str, float]) -> None:
    """Refuse a body whose centre of mass is above a centre of curvature."""
    height = body["c"] - body["offset"]
    for axis, radius in solids.RADII.items():
        if (found := body[axis] ** 2 / body["c"]) <= height:
            (option,) = _options([radius])
            raise fault_of(
                f"the body falls over, since this is {found:.3g} m and the centre of mass is {height:.3g} m high; "
                f"give a measured radius, or check {either(_options([*solids.SIZES.values()]))}",
                file=option,
            )
