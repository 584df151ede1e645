"""Reads the value of a physical parameter: a number, an axis given as a list or a range, or a distribution."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import PydanticCustomError

from sweep.config.distributions import FAMILIES, Distribution
from sweep.config.document import is_number, number, plain_data
from sweep.config.messages import explain, wrong
from sweep.faults import either, fault_of, refusal, suggestion
from sweep.parameters import Parameter
from sweep.units import ANGLE, NUMERAL, WRITTEN, Unit, quantity, unit_in, unit_of

_MORE = ", a list of numbers, {start, stop, num, spacing: linear|log}, or {normal: [mean, standard deviation]}"

MAX_AXIS = 1_000_000
"""Most values of one axis and most rows of a table of cases, which are held in memory as Python numbers."""


class Strict(BaseModel):
    """A section of the schema; values are not converted, and unknown keys are refused."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


def whole(raw: Any) -> Any:
    """Return a float such as 1e3 as the integer 1000."""
    return int(raw) if isinstance(raw, float) and raw.is_integer() else raw


Whole = Annotated[int, BeforeValidator(whole)]
"""A whole number, in whatever notation."""


class Range(Strict):
    """A range of `num` numbers from `start` to `stop`."""

    start: float
    stop: float
    num: Whole = Field(ge=1, le=MAX_AXIS)
    spacing: Literal["linear", "log"] = "linear"

    def values(self) -> list[float]:
        if self.spacing == "linear":
            return _divided(self.start, self.stop, self.num)
        if not (min(self.start, self.stop) > 0 or max(self.start, self.stop) < 0):
            raise wrong("a log range needs start and stop of the same sign, and neither zero", "spacing")
        logs = _divided(math.log10(abs(self.start)), math.log10(abs(self.stop)), self.num)
        inside = [math.copysign(10.0**log, self.start) for log in logs[1:-1]]
        return [self.start, *inside, self.stop][: self.num]


def _divided(start: float, stop: float, num: int) -> list[float]:
    """Return equally spaced numbers, each rounded once, so that a finer division contains a coarser one."""
    if num == 1:
        return [start]
    (p, q), (r, s) = start.as_integer_ratio(), stop.as_integer_ratio()
    whole, from_start, each = q * s * (num - 1), p * s * (num - 1), r * q - p * s
    return [(from_start + i * each) / whole for i in range(num)]


@dataclass(frozen=True)
class Values:
    """A parameter's checked value: one number, an axis of distinct numbers, or a distribution."""

    numbers: tuple[float, ...]
    """The number or numbers; of a distribution, the median."""
    is_axis: bool
    spec: float | list[float] | dict[str, Any]
    """The value as written in the configuration."""
    distribution: Distribution | None = None
    unit: str = field(default="", compare=False)
    """The unit in the configuration, except for angles; "" if it has none."""

    @classmethod
    def one(cls, number: float) -> Values:
        """Return the value, which must be a single number."""
        return cls((number,), False, number)


def parse_values(parameter: Parameter, raw: Any) -> Values:
    """Return the value of a parameter given in a configuration; `wrong` makes the error."""
    raw, written = in_si(parameter.units, raw)
    return replace(_parse(parameter, raw), unit=written)


def _parse(parameter: Parameter, raw: Any) -> Values:
    if isinstance(raw, dict):
        return _parse_distribution(parameter, raw) if raw.keys() & FAMILIES.keys() else _parse_range(parameter, raw)
    if not isinstance(raw, list):
        check_number(raw, parameter)
        return Values.one(float(raw))
    if not raw:
        raise wrong("axis is empty; give at least one value")
    for i, item in enumerate(raw):
        check_number(item, parameter, i)
    return _axis([float(item) for item in raw])


def values_of(parameter: Parameter, raw: Any, unitless: Callable[[str, str], str], argument: str) -> Values:
    """Return the number or the axis that an argument gives to a parameter; an `InputError` names both.

    `unitless`, such as `Config.unitless`, says why the parameter cannot have a unit.
    """
    try:
        values = parse_values(parameter, plain_data(raw))
    except PydanticCustomError as error:
        context = error.context or {}
        raise fault_of(context["reason"], argument, parameter.name, *context["at"]) from None
    reason = unitless(parameter.name, values.unit) if values.unit else ""
    if values.distribution:
        reason = "cannot be a distribution; give a number, a list of numbers or a range"
    if reason:
        raise fault_of(reason, argument, parameter.name)
    return values


def in_si(units: Unit | str, raw: Any) -> tuple[Any, str]:
    """Convert texts with units, such as "0.5 deg", to numbers in SI, also in a list, a range or a distribution.

    Numbers in the paper's unit, as its datasets have them, are not converted.

    Returns
    -------
    The converted value, and the unit as the user wrote it, except for angles; "" if there is none, or if a user's model
    gives `units` as text, which are the same in all systems.
    """
    unit, own = unit_of(units), units if isinstance(units, str) else units.paper
    seen: list[str] = []

    def convert(part: Any, key: str = "") -> Any:
        if isinstance(part, list):  # the second parameter of a lognormal distribution is dimensionless
            return [item if key == "lognormal" and i else convert(item) for i, item in enumerate(part)]
        if isinstance(part, dict):
            return {key: convert(item, key) for key, item in part.items()}
        found = quantity(part, unit, own) if isinstance(part, str) else None
        if not found or found[1]:  # only distributions have errors
            return part
        if unit != ANGLE and units is unit:
            seen.append(unit_in(part))
        return found[0]

    return convert(raw), "".join(seen[:1])


def _parse_range(parameter: Parameter, raw: dict[str, Any]) -> Values:
    for key in (each for each in raw if each not in Range.model_fields):
        hint = suggestion(key, [*Range.model_fields, *FAMILIES])
        words = f"give {', '.join(Range.model_fields)} of a range, or a distribution: {either(FAMILIES)}"
        raise wrong(f"unknown key{hint}; {words}", key)
    try:
        span = Range.model_validate(raw)
    except ValidationError as error:
        path, (message, _) = next(iter(explain(error.errors(), Range).items()))
        raise wrong(message, *path) from None
    for value in (numbers := span.values()):
        if not parameter.allows(value):
            raise wrong(f"reaches {value:g}, but must be {parameter.allowed}")
    return _axis(numbers, span.model_dump())


def _parse_distribution(parameter: Parameter, raw: dict[str, Any]) -> Values:
    known = Distribution.parse(raw)
    if not parameter.allows(known.median):
        raise wrong(f"its median is {known.median:g}, but must be {parameter.allowed}")
    return Values((known.median,), False, known.spec, known)


def _axis(numbers: list[float], spec: Any = None) -> Values:
    if len(set(numbers)) < len(numbers):
        raise wrong("equal values on one axis; keep each once")
    return Values(tuple(numbers), True, spec or numbers)


def check_number(raw: Any, parameter: Parameter, *at: int | str) -> None:
    """Refuse a value that is not a number which the parameter allows; it stands at the path `at` inside its own."""
    if not is_number(raw) or not parameter.allows(raw):
        hint = instead(raw, parameter)
        more = "" if is_number(raw) or at or hint else _MORE
        raise wrong(refusal(raw, parameter.allowed + more) + hint, *at)


_PART = rf"{NUMERAL}[^-.:,…–—]*?"
_SPAN = re.compile(rf" *({_PART}) *(?:\.\.\.?|…|:|–|—|to|-) *({_PART})(?: *(?::|\.\.) *([0-9]+))? *")
_COMMA = re.compile(r" *([-+−]?[0-9]*),([0-9]+)(.*)")


def instead(raw: Any, parameter: Parameter) -> str:
    """Return a hint to add when a text is nearly a number, a range or a quantity; "" if it is not."""
    if not isinstance(raw, str):
        return ""
    if (unit := unit_of(parameter.units)) and quantity(raw, unit):
        return "; write an error as {normal: [value, error]}"
    if span := _SPAN.fullmatch(raw):
        start, stop, num = span[1], span[2], span[3] or "41"
        needed = "" if span[3] else ", with the number of values"
        return f"; a range is written {{start: {start}, stop: {stop}, num: {num}}}{needed}"
    if comma := _COMMA.fullmatch(raw):
        whole, part, rest = comma.groups()
        other = f"{whole}{part}{rest}" if len(part) == 3 else f"[{whole or 0}, {part}{rest}]"
        return f"; write {whole or 0}.{part}{rest} or {other}"
    if number(raw.strip()) is not None:
        return "; leave out the quotes"
    known = WRITTEN.get(unit) if unit and unit_in(raw) else None
    return f"; its unit must be {either(known)}" if known else ""
