"""List the measurements; each has its own file."""

from __future__ import annotations

from collections.abc import Iterable

from sweep.kernels.measures.decay import Decay
from sweep.kernels.measures.energy import EnergyError
from sweep.kernels.measures.estimate import Estimate
from sweep.kernels.measures.margin import Margin
from sweep.kernels.measures.measurement import Kind, Measurement
from sweep.kernels.measures.noise import RoundOff
from sweep.kernels.measures.resting_spin import RestingSpin
from sweep.kernels.measures.reversal_times import ReversalTimes
from sweep.kernels.measures.reversals import Reversals
from sweep.models.model import Model, Tier

_KINDS: tuple[type[Kind], ...] = (
    Reversals, EnergyError, Margin, RestingSpin, ReversalTimes, Estimate,
)  # fmt: skip

MEASURES: dict[str, type[Kind]] = {kind.name: kind for kind in _KINDS}
"""The measurements that a configuration can ask for."""

OF_COUNTS: tuple[type[Measurement], ...] = (RoundOff, Decay)
"""The measurements without which a count and its error cannot be judged."""


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
    simulated = isinstance(tier, Model)
    return tuple(
        name for name, kind in MEASURES.items() if kind.asks in tier.offers and (simulated or kind is Reversals)
    )


def default(tier: Tier) -> tuple[str, ...]:
    """Specs of the measurements made on a model by default."""
    return tuple(MEASURES[name]().spec for name in possible(tier) if MEASURES[name].by_default)
