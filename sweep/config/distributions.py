"""Defines the distributions of uncertain parameters, and draws samples from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, isfinite, log
from typing import Any, Literal

import numpy as np

from sweep.config.document import is_number
from sweep.config.messages import wrong
from sweep.faults import refusal
from sweep.grid import Array


def _normal(chance: Array, mean: float, deviation: float) -> Array:
    from scipy.special import ndtri  # imported here, since few configurations need it

    return np.asarray(mean + deviation * ndtri(chance))


def _lognormal(chance: Array, median: float, deviation: float) -> Array:
    return np.exp(_normal(chance, log(median), deviation))


def _uniform(chance: Array, low: float, high: float) -> Array:
    return low + (high - low) * chance


@dataclass(frozen=True)
class Family:
    """A family of distributions with two parameters."""

    quantile: Callable[[Array, float, float], Array]
    """The quantile function: the value for a probability between 0 and 1 (exclusive) and the two parameters."""
    words: tuple[str, str]
    """Names of the two parameters."""
    above: tuple[float, float | Literal["first"]]
    """Exclusive lower bound of each of the two parameters; that of the second may be the first parameter."""


FAMILIES = {
    "normal": Family(_normal, ("mean", "standard deviation"), (-inf, 0.0)),
    "lognormal": Family(_lognormal, ("median", "standard deviation of the logarithm"), (0.0, 0.0)),
    "uniform": Family(_uniform, ("lowest value", "highest value"), (-inf, "first")),
}
"""The distributions that a configuration may give to a parameter, as in `{normal: [-6.3, 0.3]}`."""


@dataclass(frozen=True)
class Distribution:
    """The distribution of a parameter."""

    family: str
    first: float
    second: float

    @classmethod
    def parse(cls, raw: Mapping[str, Any]) -> Distribution:
        """Return the distribution given in a configuration; `wrong` makes the error."""
        if len(raw) > 1:
            raise wrong(f"a distribution together with other keys; keep one of {', '.join(raw)}")
        ((name, numbers),) = raw.items()
        family = FAMILIES[name]
        if not isinstance(numbers, list) or len(numbers) != 2:
            raise wrong(refusal(numbers, "[{}, {}]".format(*family.words)), name)
        for i, (number, word, above) in enumerate(zip(numbers, family.words, family.above, strict=True)):
            least = numbers[0] if above == "first" else above
            if not (is_number(number) and isfinite(number) and number > least):
                bound = "" if least == -inf else f" > {least:g}"
                raise wrong(refusal(number, f"the {word}, a finite number{bound}"), name, i)
        return cls(name, *map(float, numbers))

    @property
    def spec(self) -> dict[str, list[float]]:
        """Return the distribution as it is written in a configuration."""
        return {self.family: [self.first, self.second]}

    @property
    def words(self) -> str:
        """Describe the distribution, such as "normal, mean 0.05, standard deviation 0.002"."""
        first, second = FAMILIES[self.family].words
        return f"{self.family}, {first} {self.first:g}, {second} {self.second:g}"

    def at(self, chance: Array) -> Array:
        """Return the quantiles for probabilities between 0 and 1 (exclusive), in an array of the same shape."""
        return FAMILIES[self.family].quantile(chance, self.first, self.second)

    @property
    def median(self) -> float:
        return float(self.at(np.array(0.5)))


def drawn(known: Mapping[str, Distribution], chance: Array) -> dict[str, tuple[float, ...]]:
    """Return samples of all parameters, each from its own distribution, at probabilities of shape (number, parameters).

    They are independent if the columns of `chance` are.
    """
    return {name: tuple(each.at(chance[:, i]).tolist()) for i, (name, each) in enumerate(known.items())}


def chances(parameters: int, number: int, seed: int) -> Array:
    """Return scrambled Sobol points, more even than random points, of shape (number, parameters).

    No point lies on a face of the cube. With the same seed, a longer sequence begins with the shorter one (Owen 1998,
    doi 10.1006/jcom.1998.0487).
    """
    from scipy.stats import qmc  # importing takes half a second

    points = qmc.Sobol(parameters, rng=seed, bits=_BITS).random_base2((number - 1).bit_length())[:number]
    return np.asarray(points + 2.0 ** -(_BITS + 1))  # the middle of each cell, which is never 0


_BITS = 52
"""Number of binary digits of a Sobol point."""
