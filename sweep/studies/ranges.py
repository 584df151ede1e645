"""Finds the search ranges of free parameters with a single value, from the film, the body and the law.

Places in a range are uniform in asinh(value / bend), which is linear for a large bend and logarithmic for a small one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, log, sqrt

import numpy as np
from scipy import stats
from scipy.special import ndtr

from sweep.config import Config
from sweep.config.distributions import Distribution
from sweep.config.film import Film
from sweep.grid import Array
from sweep.models.general.laws import LAWS, Law
from sweep.parameters import Parameter
from sweep.units import SI


@dataclass(frozen=True)
class Range:
    """The range in which a parameter is sought."""

    low: float
    high: float
    bend: float
    least: float = -inf
    """Bounds of widening."""
    most: float = inf
    given: bool = False
    """Whether the user gave the ends, which are then not widened."""
    prior: tuple[float, float] | None = None
    """Mean and standard deviation, if the parameter was measured."""

    @classmethod
    def even(cls, one: float, other: float, least: float = -inf, most: float = inf) -> Range:
        """Return a range between two numbers that is linear, or logarithmic if it does not reach zero."""
        (low, high), (near, far) = sorted((one, other)), sorted((abs(one), abs(other)))
        return cls(low, high, near / _MUCH if low * high > 0 else far * _MUCH, least, most)

    def values(self, places: Array) -> Array:
        low, high = np.arcsinh(np.array([self.low, self.high]) / self.bend)
        return np.asarray(self.bend * np.sinh(low + (high - low) * places))

    def place(self, value: float) -> float:
        low, high, at = np.arcsinh(np.array([self.low, self.high, value]) / self.bend)
        return float(np.clip((at - low) / (high - low), 0, 1))

    def widened(self, *, up: bool) -> Range:
        """Return the range with one end moved outwards by a factor of four or half its length, unless it is fixed."""
        low, high = np.arcsinh(np.array([self.low, self.high]) / self.bend)
        end = self.bend * np.sinh((high if up else low) + (1 if up else -1) * min((high - low) / 2, log(4)))
        if self.given or self.prior:
            return self
        if self.low == -self.high:
            return replace(self, low=max(-abs(end), self.least), high=min(abs(end), self.most))
        return replace(self, high=min(end, self.most)) if up else replace(self, low=max(end, self.least))

    def ends(self, place: float, near: float = 0.0) -> int:
        """Return -1 or 1 if a place is at the lower or upper end of the search, else 0; a bound at zero is not an
        end."""
        if place <= near and (self.low or self.least):
            return -1
        return int(place >= 1 - near)


_MUCH = 1e9

_ROWS = 1500
"""Minimum number of rows of a film whose last third gives the drag."""

# Typical action of a hand: how far it moves the contact point, as a share of a and b, or tilts the body.
_FARTHEST, _TILTED = 0.2, 0.15

_STARTS = {"x0": "a", "y0": "b", "pitch": "", "roll": ""}
_ON_BODY = 0.65
"""Share of both semi-axes within which a start point is sought, so that the corners lie on the body."""

# Share of the range of a parameter that may vanish or have either sign within which places are linear.
_FROM_ZERO, _EITHER_SIGN = 1 / 300, 1 / 100


def of_film(film: Film) -> dict[str, Range]:
    """Return the ranges of the film's own free parameters, by name."""
    bias = float(np.abs(film.value).max()) / 10
    delay = {"film_delay": Range.even(0.0, float(film.time[-1]) / 10, least=0.0)}
    # A film does not show where a heading is counted from, so a heading has no bias.
    return delay | ({} if film.what == "heading" else {"film_bias": Range.even(-bias, bias)})


def of_parameter(config: Config, film: Film, name: str) -> Range:
    """Return the range of a parameter of `config`; raise an `InputError` if nothing defines it."""
    values, parameter = config.parameters[name], config.table[name]
    least, most = max(parameter.above, parameter.at_least), parameter.below
    if values.is_axis and len(values.numbers) > 1:
        return replace(Range.even(min(values.numbers), max(values.numbers)), given=True)
    value = values.numbers[0]
    if not config.of_rattlebacks:
        return _around(config, parameter, value, least, most)
    if name in ("n0", "omega3"):
        return _spins(film, 1 if name == "n0" else -1)
    if name in _STARTS:
        return _starts(config, name, value)
    if name == "sigma":
        return Range(0.0, high := _drag(config, film), high * _FROM_ZERO, least=0.0)
    if usual := wide(config, config.own_law or LAWS[config.law]).get(name):
        low, high = min(usual[0], value / 5 or inf), max(usual[1], value * 5)
        # Not widened to where the law is stiffer: a body hardly slips there, and takes ten times as many steps.
        return Range.even(low, high, low) if "speed" in name else Range.even(low, high, least, high)
    return _around(config, parameter, value, least, most)


def measured(parameter: Parameter, known: Distribution) -> Range:
    """Return the range of a measured parameter, and its normal prior."""
    low, below, centre, above, high = known.at(ndtr(np.array([-4.0, -1.0, 0.0, 1.0, 4.0]))).tolist()
    ends = max(low, parameter.above, parameter.at_least), min(high, parameter.below)
    return Range(*ends, _MUCH * max(map(abs, ends)), prior=(centre, (above - below) / 2))


def _around(config: Config, parameter: Parameter, value: float, least: float, most: float) -> Range:
    """Return the range from 1/5 to 5 times a positive value; up to twice one that may be negative, of either sign."""
    if value == 0:
        message = "give the ends of its range as two values, such as [-1, 1]: it is free, and zero sets no scale"
        raise config.error(parameter.place, message)
    if least >= 0:
        return Range.even(value / 5, min(value * 5, most), least=least, most=most)
    return Range.even(-2 * value, 2 * value, least, most)


def _spins(film: Film, sign: int) -> Range:
    """Return the range of the start spin: the film's first twelfth, widened by as much as the spin varies there."""
    first = slice(0, max(8, len(film.time) // 12))
    time, value = film.time[first], film.value[first]
    if film.what == "heading":
        slope, _, low, high = stats.theilslopes(value, time)
        centre, half = slope, max(high - low, 0.3 * abs(slope))
    else:
        centre, half = np.median(value[:5]), max(np.ptp(np.percentile(value, [5, 95])), 0.3 * abs(np.median(value[:5])))
    half = half or 1.0
    return Range.even(sign * (centre - half), sign * (centre + half), -1e3, 1e3)


def _drag(config: Config, film: Film) -> float:
    """Return the largest drag compatible with the film's end: five times the loss there, if all of it were drag."""
    # Use no more rows than that, since slopes are those of all pairs.
    last = slice(len(film.time) * 2 // 3, None, max(1, len(film.time) // _ROWS))
    spin = np.gradient(film.value, film.time) if film.what == "heading" else film.value
    size = np.abs(spin[last])
    rate = max(-stats.theilslopes(size, film.time[last])[0], 0.0) / max(np.median(size), 1e-12)
    columns = _body(config)
    inertia = columns.get("Izz", columns.get("mass", 1.0) * (columns["a"] ** 2 + columns["b"] ** 2) / 5)
    return float(inertia * min(max(5 * rate, 2 / film.time[-1]), 20 / film.time[-1]))


def _body(config: Config) -> dict[str, float]:
    """Return the parameters of the model where each of the configuration's has its smallest value."""
    least = {name: np.array([min(values.numbers)]) for name, values in config.parameters.items()}
    return {name: float(values[0]) for name, values in config.assembly.body(least).items()}


def _starts(config: Config, name: str, value: float) -> Range:
    """Return the range of the start point or tilt, of either sign, nearly logarithmic."""
    size = _STARTS[name]
    length = _body(config)[size] if size else 1.0
    most = _ON_BODY * length if size and config.surface == "ellipsoid" else inf
    far = min(max(_FARTHEST * length if size else _TILTED, 2 * abs(value)), most)
    return Range(-far, far, far * _EITHER_SIGN, least=-most, most=most)


def mirrored(config: Config, free: Mapping[str, Range]) -> list[str]:
    """Return the names of the start point or tilt, where reversing both signs gives the same motion, half a turn later.

    Half a turn maps a body onto itself unless it has an `Ixz` or `Iyz`, and changes nothing if the plane is isotropic.
    """
    if not config.equations.assumes.isotropic:
        return []
    pairs = (pair for pair in (["x0", "y0"], ["pitch", "roll"]) if {*pair} <= free.keys())
    names = next((pair for pair in pairs if all(free[name].low == -free[name].high for name in pair)), [])
    others = ("Ixz", "Iyz", "omega1", "omega2", "slip1", "slip2")
    odd = any(name in free or config.parameters[name].numbers != (0.0,) for name in others if name in config.parameters)
    return [] if odd else names


def wide(config: Config, law: Law) -> Mapping[str, tuple[float, float]]:
    """Return the ranges of the parameters of a law of friction, whatever the configuration says of them."""
    body = _body(config)
    length = body["c"] if config.units == SI else 1.0
    velocity = sqrt(length * body["gravity"]) if config.units == SI else 1.0
    return {
        "mu": (0.02, 1.0) if "mu" in law.pure else (1 / velocity, 300 / velocity),
        "mu_static": (0.02, 1.0),
        "speed": (3e-3 * velocity, 0.3 * velocity),
        "speed_stick": (1e-3 * velocity, 0.1 * velocity),
        "radius_contact": (1e-3 * length, 0.3 * length),
    }
