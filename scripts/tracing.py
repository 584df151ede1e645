"""The package's right-hand sides for the numbers of other tools."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

from sweep.models import ellipsoid
from sweep.models.ladder import friction
from sweep.models.model import Model


def traced_rhs(model: Model, sqrt: Callable[[Any], Any]) -> Callable[..., Any]:
    """The right-hand side of `model`, with `sqrt` in the place of numpy's; its constants are a tuple in their order."""
    numbers = SimpleNamespace(sqrt=sqrt)
    contact = FunctionType(ellipsoid.contact.__code__, {"np": numbers})
    rhs = FunctionType(model.rhs.__code__, {"np": numbers, "contact": contact, "friction": friction})
    return lambda y, p: rhs(y, model.constants(*p))
