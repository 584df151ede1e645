"""Rolling without slip: the limit of infinite friction.  Without couples energy is conserved.

The unknowns (u1, u2, ω1, ω2, ω3) are those of `slip` without the slip velocity: the contact point is at rest,
v_g = v_0 = x_p × ω, and the contact force, per unit mass F = v_g' + ω × v_g + g u, is whatever keeps it at rest.  With
s = v_0 - x_p' and a couple τ0 + R τ1, eliminating this force gives

    J_P ω' = x_p × (g u + ω × s) + τ0 + R τ1 - ω × J ω,   J_P = J + |x_p|² - x_p x_pᵀ,
    R = F · u = g + u · (ω × s) + q · ω',   q = u × x_p.
"""

from __future__ import annotations

from sweep.jit import inline
from sweep.models import attitude
from sweep.models.general import ripple, starts
from sweep.models.general.bounds import couples_decay
from sweep.models.general.common import Variant, of_any_body, offers
from sweep.models.general.couples import damping_of, friction_of
from sweep.models.general.rigid_body import about_contact, contact_on, energy_on, gyroscopic
from sweep.models.model import Array, Model, Ripple
from sweep.models.vectors import Vector

STATES = ("u1", "u2", "omega1", "omega2", "omega3")


def equations(variant: Variant):
    """(states, constants) -> (derivatives, (n, power of couples, R, Painlevé denominator)), of a scene."""
    contact = contact_on(variant.surface)
    friction, damping = friction_of(variant.couples), damping_of(variant.couples)

    def rhs(y, p):
        u1, u2, w1, w2, w3 = y
        w = Vector(w1, w2, w3)
        u, _, x_p, du, dx = contact(u1, u2, w, p)
        c = w.cross(x_p.cross(w) - dx)  # ω × s
        torque, power = damping(w, p)
        C, determinant = about_contact(x_p, 1.0, p)
        a = C.of((x_p.cross(u.times(p.g) + c) + torque + gyroscopic(w, p)).times(1.0 / determinant))
        q = u.cross(x_p)
        # ω' = a - R b
        _, d, turning = friction(0.0, w, u, p)
        b = C.of(d.times(1.0 / determinant))
        denominator = 1.0 + q.dot(b)
        R = (p.g + u.dot(c) + q.dot(a)) / denominator
        return (du.x, du.y, *(a - b.times(R))), (u.dot(w), power + R * turning, R, denominator)

    return rhs


def rolling(variant: Variant, parameters: tuple[str, ...]) -> Model:
    """The model of a scene without slip; `parameters` are those of the body and the start."""
    surface, states = variant.surface, (*STATES, *variant.states)
    record, contact, slipping_energy = variant.record(), contact_on(surface), energy_on(surface)
    rippling = ripple.of_velocities(surface, skew=variant.skew)
    rhs = variant.inline(record, equations(variant), y=len(states))

    def point(y, p):
        return contact(y[0], y[1], Vector(*y[2:5]), p)[2]

    def energy(y, p):
        return slipping_energy((*y[:5], 0.0, 0.0), p)

    def observe(y: Array, p) -> dict[str, Array]:
        x_p, (_, (_, _, R, _)) = contact_point(y, p), rhs(y, p)
        return {"contact_x": x_p.x, "contact_y": x_p.y, "normal_force": R}

    @inline
    def ripple_value(y, p, k):
        u1, u2, w1, w2, w3 = y[:5]
        return of_slipping((u1, u2, w1, w2, w3, 0.0, 0.0), p, k)

    of_slipping, contact_point = rippling.value, variant.inline(record, point, y=len(states))
    return Model(
        **of_any_body(variant, states),
        summary="rolling without slip, the limit of infinite friction",
        parameters=(*parameters, *(each for couple in variant.couples for each in couple.parameters)),
        offers=offers(variant),
        constants=record,
        start=lambda columns: variant.start(starts.rolling(columns, surface)),
        fastest_decay=lambda columns: couples_decay(variant, columns),
        rhs=rhs,
        energy=variant.inline(record, energy, y=len(states)),
        # Nothing damps an error: with 0.07 the energy drifts by a share of 2e-7 in t = 1000, with this by 6e-10.
        radians_a_step=0.022,
        ripple=Ripple(rippling.names, rippling.of, ripple_value),
        observe=observe,
        path=variant.inline(record, attitude.of_rolling(contact), y=len(states), along=None, across=None),
    )


MODEL = rolling(Variant(None), ("a", "b", "c", "delta", "n0", "x0", "y0"))
