"""Any body that slips on the plane, with any law of friction.

All forces are per unit mass: R is the acceleration N/m by the normal force.  Gravity, the contact force R (u + f) with
f = -k v_p, and the couple τ0 + R τ1 give

    v_g' + ω × v_g = R (u + f) - g u,   v_g = v_p + v_0,   v_0 = x_p × ω,
    J ω' = x_p × R (u + f) + τ0 + R τ1 - ω × J ω.

So ω' = α + R β with α = J⁻¹ (τ0 - ω × J ω) and β = J⁻¹ (x_p × (u + f) + τ1), and

    v_p' = R (u + f) - g u - x_p × ω' - ω × (v_p + v_0 - x_p').

The contact point stays in the plane, v_p · u = 0.  With u' = u × ω the derivative of that is v_p' · u =
-u · (ω × v_p), which cancels the same term on the right.  With q = u × x_p,

    R = (g + (v_0 - x_p') · u' + q · α) / (1 - q · β).
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline
from sweep.models import attitude
from sweep.models.general import rigid_body, starts
from sweep.models.general import ripple as ripples
from sweep.models.general.bounds import couples_decay, faint_energy, hardest_turn, strongest_grip
from sweep.models.general.common import Variant, of_any_body, offers, record
from sweep.models.general.couples import damping_of, friction_of
from sweep.models.general.laws import Law
from sweep.models.general.rigid_body import about_centre, gyroscopic
from sweep.models.ladder import noslip, slip
from sweep.models.model import REVERSAL_TIME, Array, Columns, Model, Ripple


def slipping(variant: Variant, parameters: tuple[str, ...]) -> Model:
    """A variant of `slip`; `parameters` are those of the body and the start."""
    law, couples, surface = variant.law, variant.couples, variant.surface
    assert law
    contact, friction, damping = surface.contact, friction_of(couples, law), damping_of(couples)

    @inline
    def rhs(y, p):
        u1, u2, w1, w2, w3, v1, v2 = y
        (u3, inv_u3), (x, y_, z), du, dx = contact(u1, u2, w1, w2, w3, p)
        v3 = -(v1 * u1 + v2 * u2) * inv_u3
        square = v1 * v1 + v2 * v2 + v3 * v3
        k, (d1, d2, d3), turning = friction(square, w1, w2, w3, u1, u2, u3, p)
        # u + f, the contact force per unit of R
        g1, g2, g3 = u1 - k * v1, u2 - k * v2, u3 - k * v3
        (m1, m2, m3), ((c1, c2, c3), lost) = gyroscopic(w1, w2, w3, p), damping(w1, w2, w3, p)
        alpha = about_centre(m1 + c1, m2 + c2, m3 + c3, p)
        beta = about_centre(y_ * g3 - z * g2 - d1, z * g1 - x * g3 - d2, x * g2 - y_ * g1 - d3, p)
        slopes, spin, R, denominator = slip.motion(y, u3, v3, (x, y_, z), du, dx, (g1, g2), alpha, beta, p.g)
        return slopes, (spin, R * (k * square + turning) + lost, R, denominator)

    def observe(y, p):
        return {**noslip.seen(contact, rhs, y, p), "slip_1": y[5], "slip_2": y[6]}

    def fastest_decay(columns: Columns) -> Array:
        grip = strongest_grip(columns, surface)
        decay = law.strongest(columns) * grip + couples_decay(couples, columns, surface)
        if law.strongest_couple:
            decay = decay + law.strongest_couple(columns) * hardest_turn(columns, surface)
        return np.asarray(decay)

    def more(columns: Columns) -> tuple[Array, ...]:
        faint = () if law.linear_to is None else (faint_energy(law.linear_to(columns), columns, surface),)
        return (*(columns[each] for each in law.parameters), *faint)

    fields = (*law.parameters, *(() if law.linear_to is None else ("faint",)))
    return of_any_body(
        slip.MODEL, variant,
        parameters=(*parameters, *law.parameters, *(each for couple in couples for each in couple.parameters)),
        offers=offers(couples, dissipates=law.coupled is None) | ({REVERSAL_TIME} if law.name == "viscous" else set()),
        constants=record(surface, couples, fields, more),
        start=lambda columns: starts.slipping(columns, surface),
        fastest_decay=fastest_decay,
        rhs=rhs,
        energy=rigid_body.energy_on(surface),
        ripple=Ripple(ripples.NAMES, lambda columns: ripples.form(columns, surface), ripples.slipping),
        observe=observe,
        path=attitude.of_slipping(contact),
        faint="" if law.linear_to is None else "faint",
        extremes=(lambda columns: (columns,)) if law.linear_to is None else _with_and_without(law),
    )  # fmt: skip


def _with_and_without(law: Law):
    """As a law that saturates leaves the body free when it slips fast, motions without friction matter as well."""

    def extremes(columns: Columns) -> tuple[Columns, ...]:
        free = {name: 0 * columns[name] for name in law.parameters if name.startswith("mu")}
        return columns, {**columns, **free}

    return extremes
