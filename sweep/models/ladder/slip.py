"""The full model: a body that slips on the plane with friction (Takano 2011, Ldot … visf).

The paper's body is a homogeneous ellipsoid with viscous friction.  Any other rigid body, law of friction and couple
obeys the same equations (`sweep.models.general`), and whatever a scene lacks adds no instruction to its kernel.

The unknowns (u1, u2, ω1, ω2, ω3, v1, v2) are components of the upward normal u, the angular velocity ω and the slip
velocity v_p of the contact point, along axes fixed in the body (`sweep.models.general.rigid_body`).  All of them except
ω3 vanish in upright spin, so a rattle keeps its relative precision however small it is.  Forces and inertia are per
unit mass: R is the acceleration N/m by the normal force.  Gravity g, the contact force R (u + f) with f = -k v_p, and a
couple τ0 + R τ1, if there is one, give

    u' = u × ω                                                                       (omega)
    J ω' = x_p × R (u + f) + τ0 + R τ1 - ω × J ω                                     (Ldot, visf)
    v_g' + ω × v_g = R (u + f) - g u,   v_g = v_p + v_0,   v_0 = x_p × ω             (vgdot, vgvp)

For viscous friction k = μ.  So ω' = α + R β with α = J⁻¹ (τ0 - ω × J ω) and β = J⁻¹ (x_p × (u + f) + τ1), and

    v_p' = R (u + f) - g u - x_p × ω' - ω × (v_p + v_0 - x_p').

The contact point stays in the plane, v_p · u = 0.  With u' = u × ω the derivative of that is v_p' · u =
-u · (ω × v_p), which cancels the same term on the right.  With q = u × x_p, so that (x_p × α) · u = q · α,

    R = (g + (v_0 - x_p') · u' + q · α) / (1 - q · β)                                (R)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sweep.models import attitude
from sweep.models.general import ripple, starts
from sweep.models.general.bounds import couples_decay, faint_energy, hardest_turn, strongest_grip
from sweep.models.general.common import VISCOUS, Variant, of_any_body, offers
from sweep.models.general.couples import damping_of, friction_of
from sweep.models.general.laws import Law
from sweep.models.general.rigid_body import about_centre, contact_on, energy_on, gyroscopic
from sweep.models.general.upright import characteristic_of
from sweep.models.model import Array, Columns, Model, Offer
from sweep.models.symbols import Constants
from sweep.models.vectors import Vector

STATES = ("u1", "u2", "omega1", "omega2", "omega3", "v1", "v2")


def equations(variant: Variant):
    """(states, constants) -> (derivatives, (n, power of friction and couples, R, Painlevé denominator)), of a scene."""
    contact = contact_on(variant.surface)
    friction, damping = friction_of(variant.couples, variant.law), damping_of(variant.couples)

    def rhs(y, p):
        u1, u2, w1, w2, w3, v1, v2 = y
        w = Vector(w1, w2, w3)
        u, inv_u3, x_p, du, dx = contact(u1, u2, w, p)
        v = Vector(v1, v2, -(v1 * u1 + v2 * u2) * inv_u3)
        square = v.dot(v)
        k, d, turning = friction(square, w, u, p)
        force = u - v.times(k)  # u + f
        torque, lost = damping(w, p)
        alpha = about_centre(gyroscopic(w, p) + torque, p)
        beta = about_centre(x_p.cross(force) - d, p)
        s, q = x_p.cross(w) - dx, u.cross(x_p)  # s = v_0 - x_p'
        denominator = 1.0 - q.dot(beta)
        R = (p.g + s.dot(du) + q.dot(alpha)) / denominator
        dw = alpha + beta.times(R)
        dv = force.times(R) - u.times(p.g) - x_p.cross(dw) - w.cross(s + v)
        return (du.x, du.y, *dw, dv.x, dv.y), (u.dot(w), R * (k * square + turning) + lost, R, denominator)

    return rhs


def slipping(variant: Variant, parameters: tuple[str, ...]) -> Model:
    """The model of a scene with slip; `parameters` are those of the body and the start."""
    law, couples, surface = variant.law, variant.couples, variant.surface
    assert law

    def more(columns: Columns) -> tuple[Array, ...]:
        faint = () if law.linear_to is None else (faint_energy(law.linear_to(columns), columns, surface),)
        return (*(columns[each] for each in law.parameters), *faint)

    def fastest_decay(columns: Columns) -> Array:
        """Bound on the rate at which friction stops the slip, over the whole trajectory, shape (cells,)."""
        decay = law.strongest(columns) * strongest_grip(variant, columns) + couples_decay(variant, columns)
        if law.strongest_couple:
            decay = decay + law.strongest_couple(columns) * hardest_turn(variant, columns)
        return np.asarray(decay)

    states, holds = (*STATES, *variant.states), variant.assumes
    record = variant.record((*law.parameters, *(() if law.linear_to is None else ("faint",))), more)
    contact = contact_on(surface)
    rhs = variant.inline(record, equations(variant), y=len(states))
    path = variant.inline(record, attitude.of_slipping(contact), y=len(states), along=None, across=None)

    def moving_point(y, p):
        return contact(y[0], y[1], Vector(*y[2:5]), p)[2::2]

    seen = variant.inline(record, moving_point, y=len(states))
    polynomial, scene = characteristic_of(surface, law), Constants(record._fields, variant.known)

    def characteristic(spin, p):
        return polynomial(spin, scene.of(p))

    def observe(y: Array, p) -> dict[str, Array]:
        """Contact point, slip v_p, v̇_p, v̇_0 and normal force.

        v̇_p is the derivative in the body axes; v̇_0 is the derivative in space, (d/dt) v_0 in the paper.
        """
        (slopes, (_, _, R, _)), (x_p, dx_p) = rhs(y, p), seen(y, p)
        w = Vector(*y[2:5])
        dv0 = dx_p.cross(w) + x_p.cross(Vector(*slopes[2:5])) + w.cross(x_p.cross(w))
        return {
            "contact_x": x_p.x,
            "contact_y": x_p.y,
            "slip_1": y[5],
            "slip_2": y[6],
            "slip_rate_1": slopes[5],
            "slip_rate_2": slopes[6],
            "v0_rate_1": dv0.x,
            "v0_rate_2": dv0.y,
            "normal_force": R,
        }

    offered, linear = offers(variant), law.linear_to is None
    plain = not (couples or variant.skew or variant.states)
    steady = holds.isotropic and holds.conservative and holds.steady_upright
    ending = law == VISCOUS and steady and all(each.linear and not each.needs_normal_force for each in couples)
    return Model(
        **of_any_body(variant, states),
        summary="full equations with slip friction (Takano 2011, Ldot … visf)",
        parameters=(*parameters, *law.parameters, *(each for couple in couples for each in couple.parameters)),
        offers=offered
        | ({Offer.ENDING} if ending else set())
        # A couple damps the spin of a body that does not rattle; skips do not allow for that.
        | ({Offer.MODES} if ending and not couples else set()),
        constants=record,
        start=lambda columns: variant.start(starts.slipping(columns, surface)),
        fastest_decay=fastest_decay,
        rhs=rhs,
        characteristic=characteristic if plain and Offer.LINEAR in offered else None,
        energy=variant.inline(record, energy_on(surface), y=len(states)),
        ripple=ripple.of_velocities(surface, skew=variant.skew),
        observe=observe,
        path=path,
        faint="" if linear else "faint",
        extremes=(lambda columns: (columns,)) if linear else _with_and_without(law),
    )


def _with_and_without(law: Law):
    """A law that saturates leaves the body free when it slips fast, so motions without friction matter as well."""

    def extremes(columns: Columns) -> tuple[Columns, ...]:
        free = {name: 0 * columns[name] for name in law.parameters if name.startswith("mu")}
        return columns, {**columns, **free}

    return extremes


_PAPER = slipping(Variant(VISCOUS), ())

MODEL = replace(
    _PAPER,
    parameters=("a", "b", "c", "delta", "mu", "n0", "x0", "y0"),
    offers=_PAPER.offers | {Offer.FORMULAS},
)
