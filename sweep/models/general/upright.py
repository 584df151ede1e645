"""The characteristic polynomial of a small rattle of any rigid body about steady upright spin, in closed form.

To first order in the rattle, with E = [[0, 1], [-1, 0]], Λ = λ + n E, the horizontal components u of the normal, and
w = (ω2, -ω1), u' = u × ω becomes w = Λ u.  With the stiffness K (second derivatives of the height of the centre of mass
G at rest), the height h of G, and J = diag(J22, J11), the equations of motion (`sweep.models.ladder.slip`) become

    (Λ J - n J33 E) w = -g K u - h κ v,   Λ v_g = -κ v,   v_g = v - (h Λ - n E (K + h)) u,

where v is the slip, and κ = g k for the resistance k of friction.  So

    (Λ + κ) v = Λ X u,   X = h λ - n E K,   B u = -h κ v,   B = (Λ J - n J33 E) Λ + g K,

and with det(Λ + κ) = m the rates λ are the roots of

    m det B + κ² h² det Λ det X + κ h tr(adj(B) (λ + κ - n E) Λ X).

With B = S + ε E and S symmetric, all of these are polynomials in λ, whose coefficients are written below.  J13 and J23
have to vanish, or there is no upright spin that is steady.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sweep.models.general.laws import Law
from sweep.models.general.surfaces import Surface


def characteristic_of(surface: Surface, law: Law) -> Callable[[Any, Any], tuple[Any, ...]]:
    """(n, constants) -> the coefficients of the characteristic polynomial, times J11 J22, lowest power of λ first.

    It is that of a body that no couple resists.
    """

    def characteristic(n, p):
        k11, k12, k22, h = surface.stiffness(p)
        kappa, turn = p.g * law.resistance(0.0, p), n * n
        S11, S22, S12 = (p.J33 - p.J11) * turn + p.g * k11, (p.J33 - p.J22) * turn + p.g * k22, p.g * k12  # at λ = 0
        eps, det_K, coupling = (p.J11 + p.J22 - p.J33) * turn, k11 * k22 - k12 * k12, k12 * (p.J11 - p.J22) * n
        # The coefficients of m, det B, and h λ tr S less the effect of the spin, by powers of λ.
        m0, m1 = turn + kappa * kappa, 2.0 * kappa
        B0, B4 = S11 * S22 - S12 * S12, p.J11 * p.J22
        B2 = p.J22 * S22 + p.J11 * S11 + (p.J11 + p.J22 - p.J33) * eps
        f0, f1, f2 = -coupling * turn, h * (S11 + S22) - eps * (k11 + k22), -coupling
        f3, slip, hk = h * (p.J11 + p.J22), kappa * turn, h * kappa
        return (
            m0 * B0 + hk * (turn * f0 + slip * (h * det_K * turn + k11 * S22 + k22 * S11 - 2.0 * k12 * S12)),
            m1 * B0 + hk * (kappa * f0 + turn * f1),
            B0 + m0 * B2 + hk * (f0 + kappa * f1 + turn * f2 + 2.0 * hk * eps)
            + hk * slip * (h * h * h + h * det_K + k11 * p.J11 + k22 * p.J22),
            m1 * B2 + hk * (f1 + kappa * f2 + turn * f3),
            B2 + m0 * B4 + hk * (f2 + kappa * f3 + hk * h * h),
            m1 * B4 + hk * f3,
            B4,
        )  # fmt: skip

    return characteristic
