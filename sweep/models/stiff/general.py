"""The equations of `general` with slip, in variables in which only the slip is stiff: `stiff.slip` for any body.

With M = J ω - x_p × v_g and gravity g,

    u' = u × ω,   M' = s × v_g - ω × M - g u × x_p + τ0,   s = v_0 - x_p',   v_g = v_p + v_0,

where ω = J_P⁻¹ (M + x_p × v_p), J_P = J + |x_p|² - x_p x_pᵀ.  The slip obeys

    v_p' = R G - rest,   G = T (u - k v_p),   T = 1 - [x_p] J⁻¹ [x_p],   R = num / den,   den = u · G.

A couple in proportion to the normal force would make M' stiff too: there is no stiff form then.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from sweep.jit import inline
from sweep.models.general import rigid_body
from sweep.models.general.bounds import couples_decay, strongest_grip
from sweep.models.general.couples import damping_of
from sweep.models.general.laws import LAWS
from sweep.models.general.rigid_body import about_centre, about_contact, gyroscopic
from sweep.models.general.surfaces import Surface
from sweep.models.ladder import slip
from sweep.models.model import Array, Columns, Model, named
from sweep.models.stiff.form import StiffForm, in_momentum, newton_step, slopes
from sweep.models.stiff.slip import PAPER_FORM, power
from sweep.models.theory.ripple import ripple as rippling
from sweep.models.theory.rocking import Rocking

ROCKING = ("B11", "B12", "B21", "B22", "C12", "C21")
"""The elements of a `Rocking` in the axes of the surface that do not vanish."""


def form_of(model: Model) -> StiffForm | None:
    """The stiff form of the paper's slip model or of a variant with slip; None for all others, and for a user's.

    The law has to be viscous.  A step that may be long compared with the decay of the slip is of use only where the
    slip remains at the value that follows from the slow motion.  With the other laws slip sets in and ends within times
    that dopri5's steps are short enough for.
    """
    if model.origin:
        return None
    if model.name == slip.MODEL.name:
        return PAPER_FORM
    of = model.variant
    if of is None or of.law != LAWS["viscous"] or any(couple.needs_normal_force for couple in of.couples):
        return None
    return _form_of(model)


@cache
def _form_of(full: Model) -> StiffForm:
    couples, surface = full.variant.couples, full.variant.surface
    contact, damping = surface.contact, damping_of(couples)
    fields = (*full.constants._fields, *ROCKING)

    class Constants(named(*fields)):  # type: ignore[misc]
        """The constants of the full model, and `ROCKING`."""

        @classmethod
        def of(cls, columns: Columns) -> Constants:
            rocking = rigid_body.rocking(columns, surface)
            return cls(*full.constants.of(columns), *(getattr(rocking, name) for name in ROCKING))

    @inline
    def momentum(y, p):
        u1, u2, w1, w2, w3, v1, v2 = y
        (_, inv_u3), (x, y_, z), _, _ = contact(u1, u2, 0.0, 0.0, 0.0, p)
        v3 = -(v1 * u1 + v2 * u2) * inv_u3
        g1, g2, g3 = v1 + y_ * w3 - z * w2, v2 + z * w1 - x * w3, v3 + x * w2 - y_ * w1
        L1, L2, L3 = rigid_body.momentum(w1, w2, w3, p)
        return u1, u2, L1 - (y_ * g3 - z * g2), L2 - (z * g1 - x * g3), L3 - (x * g2 - y_ * g1), v1, v2

    @inline
    def slow(u1, u2, M1, M2, M3, v1, v2, p):
        # What is computed twice the compiler computes once.
        (u3, inv_u3), (x, y, z), _, _ = contact(u1, u2, 0.0, 0.0, 0.0, p)
        t1, t2 = u1 * inv_u3, u2 * inv_u3
        v3 = -(v1 * t1 + v2 * t2)
        K1, K2, K3 = M1 + (y * v3 - z * v2), M2 + (z * v1 - x * v3), M3 + (x * v2 - y * v1)
        w1, w2, w3 = about_contact(K1, K2, K3, x, y, z, p)
        _, _, du, dx = contact(u1, u2, w1, w2, w3, p)
        (c1, c2, c3), _ = damping(w1, w2, w3, p)
        (du1, du2, dM1, dM2, dM3), geometry = slopes(
            (u1, u2, u3), (M1, M2, M3), (v1, v2, v3), (t1, t2), (x, y, z), (w1, w2, w3), du, dx, p.g
        )
        return (du1, du2, dM1 + c1, dM2 + c2, dM3 + c3), geometry

    @inline
    def newton(u1, u2, v1, v2, geometry, p, gamma, b1, b2):
        w1, w2, w3 = geometry.w1, geometry.w2, geometry.w3
        (m1, m2, m3), ((c1, c2, c3), _) = gyroscopic(w1, w2, w3, p), damping(w1, w2, w3, p)
        alpha = about_centre(m1 + c1, m2 + c2, m3 + c3, p)
        T = _compliance(geometry.x, geometry.y, geometry.z, p)
        return newton_step(u1, u2, v1, v2, geometry, alpha, T, p.mu, p.g, gamma, b1, b2)

    @inline
    def with_couples(R, v1, v2, geometry, p):
        _, lost = damping(geometry.w1, geometry.w2, geometry.w3, p)
        return power(R, v1, v2, geometry, p) + lost

    ripple = replace(full.ripple, value=_ripple)
    return StiffForm(
        full=full,
        model=in_momentum(full, Constants, momentum, slow, ripple),
        momentum=momentum,
        slow=slow,
        newton=newton,
        power=with_couples,
        rocking=_rocking,
        time_unit=lambda columns: 1 / rigid_body.spin_unit(columns),
        slip_decay=lambda columns: full.fastest_decay(columns) + 2.2 * rigid_body.spin_unit(columns),
        rise=lambda columns: _rise(columns, surface),
        damping=lambda columns: couples_decay(couples, columns, surface),
    )


@inline
def _compliance(x, y, z, p):
    """T11, T12, T13, T22, T23, T33 of T = 1 - [x_p] J⁻¹ [x_p]: how a force accelerates the contact point."""
    i11, i22, i33, i12, i13, i23 = p.inv_J11, p.inv_J22, p.inv_J33, p.inv_J12, p.inv_J13, p.inv_J23
    # N = J⁻¹ [x_p], with [x_p] = ((0, -z, y), (z, 0, -x), (-y, x, 0))
    N12, N13 = i13 * x - i11 * z, i11 * y - i12 * x
    N21, N22, N23 = i22 * z - i23 * y, i23 * x - i12 * z, i12 * y - i22 * x
    N31, N32, N33 = i23 * z - i33 * y, i33 * x - i13 * z, i13 * y - i23 * x
    T11, T12, T13 = 1.0 + z * N21 - y * N31, z * N22 - y * N32, z * N23 - y * N33
    T22, T23 = 1.0 + x * N32 - z * N12, x * N33 - z * N13
    T33 = 1.0 + y * N13 - x * N23
    return T11, T12, T13, T22, T23, T33


@inline
def _rocking(p):
    return Rocking(p.B11, p.B12, p.B21, p.B22, 0.0, p.C12, p.C21, 0.0)


@inline
def _ripple(y, p, k):
    """As `sweep.models.general.ripple.slipping`, with ω1 and ω2 from M to first order in the rattle."""
    u1, u2, M1, M2, M3, v1, v2 = y
    w3 = M3 / p.J33
    m1, m2 = M1 - k[7] * v2 - k[8] * w3 * u1 - k[10] * M3, M2 + k[7] * v1 - k[9] * w3 * u2 - k[11] * M3
    w1, w2 = -(p.B21 * m1 + p.B22 * m2), p.B11 * m1 + p.B12 * m2
    return rippling(u1, u2, M1, M2, k) + k[10] * w1 + k[11] * w2


def _rise(columns: Columns, surface: Surface) -> Array:
    h2 = rigid_body.height(columns) ** 2
    i11, i22, _, i12, _, _ = rigid_body.inverse(rigid_body.inertia(columns))
    largest = 0.5 * (i11 + i22) + np.sqrt(0.25 * (i11 - i22) ** 2 + i12**2)
    return np.asarray(strongest_grip(columns, surface) / (rigid_body.gravity(columns) * (1 + h2 * largest)) - 1)
