"""Any body that rolls on the plane without slip.

The notation is that of `sweep.models.general.slip`.  With v_p = 0, v_g = v_0, and the contact force is
g u + v_g' + ω × v_g, whatever it has to be.  Its torque gives

    (J + |x_p|² - x_p x_pᵀ) ω' = x_p × (g u + ω × (v_0 - x_p')) + τ0 + R τ1 - ω × J ω,
    R = g + u · (ω × (v_0 - x_p')) + q · ω'.
"""

from __future__ import annotations

from functools import partial

from sweep.jit import inline
from sweep.models import attitude
from sweep.models.general import rigid_body, starts
from sweep.models.general import ripple as ripples
from sweep.models.general.bounds import couples_decay
from sweep.models.general.common import Variant, of_any_body, offers, record
from sweep.models.general.couples import damping_of, friction_of
from sweep.models.general.rigid_body import about_contact, gyroscopic
from sweep.models.ladder import noslip
from sweep.models.model import REVERSAL_TIME, Model, Ripple


def rolling(variant: Variant, parameters: tuple[str, ...]) -> Model:
    """A variant of `noslip`; `parameters` are those of the body and the start."""
    couples, surface = variant.couples, variant.surface
    contact, slipping_energy = surface.contact, rigid_body.energy_on(surface)
    friction, damping = friction_of(couples), damping_of(couples)
    # A product with 0.0 would remain: the compiler has to allow for infinity.
    drags = any(couple.needs_normal_force for couple in couples)

    @inline
    def rhs(y, p):
        u1, u2, w1, w2, w3 = y
        (u3, _), (x, y_, z), (du1, du2, _), (dx, dy, dz) = contact(u1, u2, w1, w2, w3, p)
        # s = v_0 - x_p', and h = g u + ω × s
        s1, s2, s3 = y_ * w3 - z * w2 - dx, z * w1 - x * w3 - dy, x * w2 - y_ * w1 - dz
        c1, c2, c3 = w2 * s3 - w3 * s2, w3 * s1 - w1 * s3, w1 * s2 - w2 * s1
        h1, h2, h3 = p.g * u1 + c1, p.g * u2 + c2, p.g * u3 + c3
        (m1, m2, m3), ((t1, t2, t3), power) = gyroscopic(w1, w2, w3, p), damping(w1, w2, w3, p)
        m1, m2, m3 = m1 + y_ * h3 - z * h2, m2 + z * h1 - x * h3, m3 + x * h2 - y_ * h1
        a1, a2, a3 = about_contact(m1 + t1, m2 + t2, m3 + t3, x, y_, z, p)
        q1, q2, q3 = u2 * z - u3 * y_, u3 * x - u1 * z, u1 * y_ - u2 * x
        R = p.g + (u1 * c1 + u2 * c2 + u3 * c3) + (q1 * a1 + q2 * a2 + q3 * a3)
        denominator = 1.0
        if drags:
            # ω' = a - R b
            _, (d1, d2, d3), turning = friction(0.0, w1, w2, w3, u1, u2, u3, p)
            b1, b2, b3 = about_contact(d1, d2, d3, x, y_, z, p)
            denominator = 1.0 + (q1 * b1 + q2 * b2 + q3 * b3)
            R = R / denominator
            a1, a2, a3 = a1 - R * b1, a2 - R * b2, a3 - R * b3
            power = power + R * turning
        spin = u1 * w1 + u2 * w2 + u3 * w3
        return (du1, du2, a1, a2, a3), (spin, power, R, denominator)

    @inline
    def energy(y, p):
        u1, u2, w1, w2, w3 = y
        return slipping_energy((u1, u2, w1, w2, w3, 0.0, 0.0), p)

    return of_any_body(
        noslip.MODEL, variant,
        parameters=(*parameters, *(each for couple in couples for each in couple.parameters)),
        offers=offers(couples, dissipates=bool(couples)) | {REVERSAL_TIME},
        constants=record(surface, couples),
        start=lambda columns: starts.rolling(columns, surface),
        fastest_decay=lambda columns: couples_decay(couples, columns, surface),
        rhs=rhs,
        energy=energy,
        ripple=Ripple(ripples.NAMES, lambda columns: ripples.form(columns, surface), ripples.rolling),
        observe=partial(noslip.seen, contact, rhs),
        path=attitude.of_rolling(contact),
    )  # fmt: skip
