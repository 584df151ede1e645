"""List the measurements; each has its own file in this folder, which is found there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib import import_module
from pkgutil import iter_modules

from sweep.kernels.measures.decay import Decay
from sweep.kernels.measures.measurement import Kind, Measurement
from sweep.kernels.measures.noise import RoundOff
from sweep.kernels.measures.reversals import Reversals
from sweep.models.model import Model, Tier

OF_COUNTS: tuple[type[Measurement], ...] = (RoundOff, Decay)
"""The measurements without which a count and its error cannot be judged."""


def _found() -> Iterator[type[Kind]]:
    """Yield the measurements in the files of this folder."""
    for file in iter_modules(__path__, f"{__name__}."):
        for each in vars(import_module(file.name)).values():
            if isinstance(each, type) and issubclass(each, Kind) and "name" in vars(each):
                yield each


MEASURES: dict[str, type[Kind]] = {
    kind.name: kind
    for kind in sorted(_found(), key=lambda kind: (kind is not Reversals, kind.needs, kind.name))
    if kind not in OF_COUNTS
}
"""The measurements that a configuration can ask for: the count, then each after those on which it builds."""


def chosen(specs: Iterable[str]) -> tuple[Kind, ...]:
    """The measurements for specs such as "reversals" or "reversal_times=12", in the order of `MEASURES`."""
    settings = {name: value for name, _, value in (spec.partition("=") for spec in specs)}
    found = {name: kind for name, kind in MEASURES.items() if name in settings}
    return tuple(
        kind(int(settings[name])) if settings[name] else kind()  # type: ignore[call-arg]
        for name, kind in found.items()
    )


def complete(measurements: tuple[Kind, ...], tier: Tier) -> tuple[Kind, ...]:
    """Add to `measurements` those that belong to every count of a model with two rocking modes."""
    counted = Reversals.name in {each.name for each in measurements}
    return (*measurements, *(kind() for kind in OF_COUNTS if counted and kind.asks in tier.offers))


def possible(tier: Tier) -> tuple[str, ...]:
    """Names of the measurements that a model supports: one without a kernel has counts alone."""
    offered = [name for name, kind in MEASURES.items() if kind.asks in tier.offers]
    if not isinstance(tier, Model):
        return tuple(name for name in offered if name == Reversals.name)
    return tuple(name for name in offered if {*MEASURES[name].reads} <= {*tier.states})


def default(tier: Tier) -> tuple[str, ...]:
    """Specs of the measurements made on a model by default."""
    return tuple(MEASURES[name]().spec for name in possible(tier) if MEASURES[name].by_default)
