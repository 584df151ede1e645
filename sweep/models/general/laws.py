"""Laws of slip friction for general bodies, besides the paper's.

All laws are isotropic.  The friction force on the body is F = -N k(v²) v, with the slip velocity v of the contact point
and the normal force N; a law is its resistance k.  It is a smooth function of v², also at v = 0, and is written without
branches, so that it can be vectorised and differentiated by complex steps.  To the linear theory every law is viscous,
with the coefficient k(0).  One law depends on the spin too, and resists it (`Law.coupled`).

To add a law, write its resistance and enter a `Law` in `LAWS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.jit import inline, nothing
from sweep.models.model import Array, Columns
from sweep.models.symbols import Symbol, call


@dataclass(frozen=True)
class Law:
    """A law of friction."""

    name: str
    """The `law` of a configuration, used in names of models too."""
    parameters: tuple[str, ...]
    """Names of its physical parameters, which are its constants too."""
    resistance: Callable[..., Any]
    """Inline, (v², constants) -> k, the friction force per unit of normal force and of slip velocity."""
    strongest: Callable[[Columns], Array]
    """(columns) -> bound on the derivative of k v with respect to v, shape (cells,).  It bounds k too."""
    coupled: Callable[..., Any] | None = None
    """Inline, (v², n², constants) -> (k, m), for a law that depends on the spin n too, with the couple -m n u per unit
    of normal force; `resistance` is its k without spin then."""
    strongest_couple: Callable[[Columns], Array] | None = None
    """(columns) -> bound on the derivative of m n with respect to n, shape (cells,)."""
    linear_to: Callable[[Columns], Array] | None = None
    """(columns) -> slip velocity up to which k is constant to a few per cent, shape (cells,); None if k is constant."""
    pure: frozenset[str] = frozenset()
    """Parameters that are pure numbers here although `sweep.parameters` gives them a unit."""

    def both(self, square, spin_square, p):
        """k and m of `coupled`; m is 0 for a law that does not depend on the spin.

        A user's law is called as a whole: its lines are those of its file.
        """
        own = LAWS.get(self.name) is not self and isinstance(square, Symbol)
        if self.coupled:
            if own:
                return call(self.coupled, "law", 2, square, spin_square)
            return self.coupled(square, spin_square, p)
        return call(self.resistance, "law", 0, square) if own else self.resistance(square, p), 0.0


_TINY = 1e-20
"""Added to the square of a relative velocity, so that its root can be divided by; far below what a double resolves."""


@inline
def _viscous(square, p):
    return p.mu


@inline
def _coulomb(square, p):
    """Of the size μ, within `speed` of zero slip proportional to it."""
    return p.mu / np.sqrt(square + p.speed * p.speed)


@inline
def _stribeck(square, p):
    """From the static to the kinetic coefficient by the quintic 10 t³ - 15 t⁴ + 6 t⁵ of t = v / speed."""
    t = np.minimum(np.sqrt(square) / p.speed, 1.0)
    fallen = t * t * t * (10.0 - t * (15.0 - 6.0 * t))
    coefficient = p.mu_static - (p.mu_static - p.mu) * fallen
    return coefficient / np.sqrt(square + p.speed_stick * p.speed_stick) + p.mu_viscous


_C = 3 * np.pi / 8
"""The force of `contensou` for small d, divided by d."""


@inline
def over_circle(slip, turn):
    """Force and couple of dry friction over a circle under the pressure of Hertz, as shares of μ N and of μ N ε.

    Where the circle, of radius ε, slips by v and turns by ε n at its rim, each of its points slips by itself.  The
    force is the gradient of Φ(d), the mean distance of its points, weighted with their pressure, from the one at rest,
    at d = v/(ε n); the couple is Φ - d Φ'.  As ∇²|x| = 1/|x|, ∇²Φ is the potential of the pressure, which inside the
    circle is 3π/8 (2 - d²).  So, with C = 3π/8,

        d <= 1:  force C (d - d³/4),  couple C/16 (8 - 8 d² + 3 d⁴);
        d >= 1:  force 1 - 1/(10 d²) - …,  couple 1/(5 d) + ….

    Polynomials in x = 1/d², of exact value and slope at both ends, stand for the two series, with errors of 1.2e-4.
    Either t = min(d, 1) or x = min(1/d², 1) is always 1; what is computed from it is then zero or constant.

    Returns
    -------
    force; couple divided by `turn`
    """
    near = np.minimum(slip, turn)
    t, e = near / turn, near / slip
    square, x = t * t, e * e
    left = 1.0 - x
    force = 1.0 - 0.75 * _C + x * (0.875 * _C - 1.0 - left * (0.01184809 + 0.02038007 * x))
    couple = 0.2 - 0.1875 * _C + x * (0.15625 * _C - 0.2 + left * (0.00719663 + 0.01579856 * x))
    return (
        _C * t * (1.0 - 0.25 * square) + left * force,
        0.0625 * _C * (1.0 - square) * (5.0 - 3.0 * square) / turn + t / slip * (0.1875 * _C + left * couple),
    )


@inline
def _contensou(square, spin_square, p):
    """Dry friction over a circle of radius ε, with sqrt(v² + s²) in place of v."""
    slip, turn = np.sqrt(square + p.speed * p.speed), p.radius_contact * np.sqrt(spin_square + _TINY)
    force, couple = over_circle(slip, turn)
    return p.mu * force / slip, p.mu * p.radius_contact * p.radius_contact * couple


_LINEAR = 0.1
"""Share of its own speed up to which a law counts as linear: it is off by 0.01 there."""


LAWS: dict[str, Law] = {
    law.name: law
    for law in (
        Law("viscous", ("mu",), _viscous, lambda columns: columns["mu"]),
        Law("none", (), nothing, lambda columns: np.zeros_like(columns["a"])),
        Law(
            "coulomb", ("mu", "speed"), _coulomb, lambda columns: columns["mu"] / columns["speed"],
            linear_to=lambda columns: np.asarray(_LINEAR * columns["speed"]), pure=frozenset({"mu"}),
        ),
        Law(
            "stribeck", ("mu", "mu_static", "speed", "speed_stick", "mu_viscous"), _stribeck,
            lambda columns: columns["mu_static"] / columns["speed_stick"] + columns["mu_viscous"],
            linear_to=lambda columns: np.asarray(_LINEAR * np.minimum(columns["speed"], columns["speed_stick"])),
            pure=frozenset({"mu"}),
        ),
        Law(
            "contensou", ("mu", "radius_contact", "speed"), _coulomb, lambda columns: columns["mu"] / columns["speed"],
            coupled=_contensou,
            # The couple falls with d most steeply where d² = 0.8.
            strongest_couple=lambda columns: 0.338 * columns["mu"] * columns["radius_contact"] ** 2 / columns["speed"],
            pure=frozenset({"mu"}),
        ),
    )
}  # fmt: skip
