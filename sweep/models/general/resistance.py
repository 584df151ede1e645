"""Puts together what resists the motion of a general body: its law of friction and its couples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sweep.jit import inline
from sweep.models.general.couples import Couple, no_resistance
from sweep.models.general.laws import Law


def resistances(couples: Sequence[Couple]) -> tuple[Any, Any]:
    """The resistance by itself and the one per unit of the normal force."""
    found: list[Any] = [no_resistance, no_resistance]
    for couple in couples:
        if not couple.about_normal:
            found[couple.needs_normal_force] = couple.resistance
    return found[0], found[1]


def resistance_of(law: Law) -> Any:
    """Inline, (v², ω, u, constants) -> the law's resistance k."""
    alone, coupled = law.resistance, law.coupled
    if coupled is None:

        @inline
        def isotropic(
            square: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, p: Any  # noqa: ARG001
        ) -> Any:  # fmt: skip
            return alone(square, p)

        return isotropic

    @inline
    def resistance(square: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, p: Any) -> Any:
        n = u1 * w1 + u2 * w2 + u3 * w3
        k, _ = coupled(square, n * n, p)
        return k

    return resistance


def drag_of(couples: Sequence[Couple], law: Law | None = None) -> Any:
    """Inline, (k, ω, u, v², constants) -> (k', d): the couple per unit of the normal force is -k' d.

    It is -k ω, and where `couples` have one about the normal, or the law, also that one.
    """
    about_normal = [couple.resistance for couple in couples if couple.about_normal]
    coupled = law.coupled if law else None
    if not about_normal and coupled is None:
        return isotropic_drag
    spinning = about_normal[0] if about_normal else no_resistance
    of_slip = coupled or _no_couple

    @inline
    def drag(k: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, square: Any, p: Any) -> Any:
        n = u1 * w1 + u2 * w2 + u3 * w3
        _, of_law = of_slip(square, n * n, p)
        m = (spinning(n * n, p) + of_law) * n
        return 1.0, k * w1 + m * u1, k * w2 + m * u2, k * w3 + m * u3

    return drag


@inline
def _no_couple(square: Any, spin_square: Any, p: Any) -> Any:  # noqa: ARG001
    return 0.0, 0.0


@inline
def isotropic_drag(
    k: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, square: Any, p: Any  # noqa: ARG001
) -> Any:  # fmt: skip
    return k, w1, w2, w3
