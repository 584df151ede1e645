"""The characteristic polynomial of a small rattle of any rigid body about steady upright spin, in closed form.

To first order in the rattle, with E = [[0, 1], [-1, 0]], Λ = λ + n E, the horizontal components u of the normal, and
w = (ω2, -ω1), u' = u × ω becomes w = Λ u.  With the stiffness K (second derivatives of the height of the centre of mass
G at rest), the height h of G, and J = diag(J22, J11), the equations of motion (`sweep.models.ladder.slip`) become

    (Λ J - n J33 E) w = -g K u - h κ v,   Λ v_g = -κ v,   v_g = v - (h Λ - n E (K + h)) u,

where v is the slip, and κ = g k for the resistance k of friction.  So

    (Λ + κ) v = Λ X u,   X = h λ - n E K,   B u = -h κ v,   B = (Λ J - n J33 E) Λ + g K,

and with det(Λ + κ) = m the rates λ are the roots of

    m det B + κ² h² det Λ det X + κ h tr(adj(B) (λ + κ - n E) Λ X).

With B = S + ε E, S symmetric, this becomes what is written below.  J13 and J23 have to vanish, or there is no upright
spin that is steady.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sweep.models.general.laws import Law
from sweep.models.general.surfaces import Surface


def characteristic_of(surface: Surface, law: Law) -> Callable[[Any, Any, Any], Any]:
    """(λ, n, constants) -> the characteristic polynomial, times J11 J22, of a body that no couple resists."""

    def characteristic(rate, n, p):
        k11, k12, k22, h = surface.stiffness(p)
        kappa, square, turn = p.g * law.resistance(0.0, p), rate * rate, n * n
        y = square + turn
        S11 = p.J22 * square + (p.J33 - p.J11) * turn + p.g * k11
        S22 = p.J11 * square + (p.J33 - p.J22) * turn + p.g * k22
        S12, eps = p.g * k12, (p.J11 + p.J22 - p.J33) * n * rate
        m, slips = y + 2.0 * kappa * rate + kappa * kappa, y + kappa * rate
        by_spin = eps * n * (k11 + k22) + k12 * (p.J11 - p.J22) * n * y
        return (
            m * (S11 * S22 + eps * eps - S12 * S12)
            + (kappa * h) ** 2 * y * (h * h * square + (k11 * k22 - k12 * k12) * turn)
            + kappa * h * (slips * (h * rate * (S11 + S22) - by_spin) + 2.0 * kappa * h * rate * eps * n)
            + kappa * kappa * h * turn * (k11 * S22 + k22 * S11 - 2.0 * k12 * S12)
        )

    return characteristic
