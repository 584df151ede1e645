"""The slip model in variables in which only the slip is stiff, for viscous friction.

The angular momentum about the contact point, M = J ω - x_p × v_g, takes the place of ω.  Neither friction nor the
normal force appears in

    u' = u × ω,   M' = s × v_g - ω × M - g u × x_p + τ0,   s = v_0 - x_p',   v_g = v_p + v_0,

because forces at the contact point have no torque about it.  Here ω = J_P⁻¹ (M + x_p × v_p) with
J_P = J + |x_p|² - x_p x_pᵀ.  Friction appears only in the equation for the slip,

    v_p' = R G - rest,   G = T (u - k v_p),   T = 1 - [x_p] J⁻¹ [x_p],   R = num / den,   den = u · G,

where [x_p] is the matrix of the cross product.  This is a 2 × 2 system, which an implicit formula solves by one
Newton step.  The motion is the same as in `slip`.

With x_p = -a/ρ the matrix ρ² J_P needs no quotient, so that a single division yields 1/ρ, 1/u3 and J_P⁻¹.

A couple proportional to the normal force would make M' stiff too: there is then no stiff form.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sweep.models.general import rigid_body, ripple
from sweep.models.general.bounds import couples_decay, grip_at_rest
from sweep.models.general.common import VISCOUS, Variant
from sweep.models.general.couples import damping_of
from sweep.models.general.rigid_body import about_centre, about_contact, gyroscopic
from sweep.models.ladder.slip import slipping
from sweep.models.model import Array, Columns, Model
from sweep.models.stiff.form import Geometry, StiffForm, in_momentum
from sweep.models.vectors import Symmetric, Vector


def has_form(model: Model) -> bool:
    """Return whether a model has a stiff form: slip models do, users' models do not.

    The law has to be viscous.  A step that may be long compared with the decay of the slip is of use only where the
    slip remains at its quasi-steady value.  With the other laws slip begins and ends within times that dopri5 resolves
    anyway.  The plane has to be isotropic and the scene conservative: these equations hold for
    gravity along the normal and for no other force.
    """
    of = model.variant
    if model.origin or of is None or of.law != VISCOUS or not (of.assumes.isotropic and of.assumes.conservative):
        return False
    return not any(couple.needs_normal_force for couple in of.couples)


def form_of(model: Model) -> StiffForm:
    """Make the stiff form of a model for which there is one."""
    return _form_of(model.variant)


@cache
def _form_of(scene: Variant) -> StiffForm:
    full = slipping(scene, ())
    record, surface, couples = full.constants, scene.surface, scene.couples
    contact, damping = rigid_body.contact_on(surface), damping_of(couples)

    def momentum(y, p):
        u1, u2, w1, w2, w3, v1, v2 = y
        w = Vector(w1, w2, w3)
        _, inv_u3, x_p, _, _ = contact(u1, u2, w, p)
        v_g = Vector(v1, v2, -(v1 * u1 + v2 * u2) * inv_u3) + x_p.cross(w)
        return u1, u2, *(rigid_body.momentum(w, p) - x_p.cross(v_g)), v1, v2

    def nonstiff(u1, u2, M1, M2, M3, v1, v2, p):
        c3 = 1.0 - (u1 * u1 + u2 * u2)
        u, M = Vector(u1, u2, -np.sqrt(c3)), Vector(M1, M2, M3)
        a, rho, square = surface.point(u, c3, p)
        C, det = about_contact(a, square, p)
        product = rho * u.z
        shared = 1.0 / (product * det)
        of_det = shared * det
        inv_rho, inv_u3 = of_det * u.z, of_det * rho
        x_p, t1, t2 = (-a).times(inv_rho), u1 * inv_u3, u2 * inv_u3
        v = Vector(v1, v2, -(v1 * t1 + v2 * t2))
        w = C.of(M + x_p.cross(v)).times(square * (shared * product))
        du, v_0 = u.cross(w), x_p.cross(w)
        s, q = v_0 - surface.velocity(du, x_p, inv_rho, (t1, t2), inv_u3, p), u.cross(x_p)
        dM = s.cross(v_0 + v) - w.cross(M) - q.times(p.g) + damping(w, p)[0]
        return (du.x, du.y, *dM), Geometry._make((u.z, *x_p, t1, t2, v.z, *w, *du, *s, *q))

    def newton(u1, u2, v1, v2, geometry, gamma, b1, b2, p):
        """The Jacobian is that of R G, with dR/dv included.

        The gyroscopic terms of v_p' are left out of it, because they are not stiff.  Everything is multiplied by den²,
        so that R itself is never computed.
        """
        u3, x, y, z, t1, t2, v3, w1, w2, w3, *rest = geometry
        u, x_p, v, w = Vector(u1, u2, u3), Vector(x, y, z), Vector(v1, v2, v3), Vector(w1, w2, w3)
        du, s, q = (Vector(*rest[i : i + 3]) for i in (0, 3, 6))
        alpha = about_centre(gyroscopic(w, p) + damping(w, p)[0], p)
        T = _compliance(x_p, p)
        G = T.of(u - v.times(p.mu))
        den, num = u.dot(G), p.g + s.dot(du) + q.dot(alpha)
        left = u.times(p.g) + x_p.cross(alpha) + w.cross(s + v)

        # With v3 = -(t1 v1 + t2 v2): dG/dv_j = -k S_j and d den/dv_j = -k u · S_j.
        S1, S2 = T.of(Vector(1.0, 0.0, -t1)), T.of(Vector(0.0, 1.0, -t2))
        gn = gamma * num
        e1, e2, k, square = u.dot(S1), u.dot(S2), gn * p.mu, den * den
        m11, m12 = square + k * (den * S1.x - G.x * e1), k * (den * S2.x - G.x * e2)
        m21, m22 = k * (den * S1.y - G.y * e1), square + k * (den * S2.y - G.y * e2)
        r1 = den * (den * ((b1 - v1) - gamma * left.x) + gn * G.x)
        r2 = den * (den * ((b2 - v2) - gamma * left.y) + gn * G.y)
        d = 1.0 / (m11 * m22 - m12 * m21)
        return v1 + d * (m22 * r1 - m12 * r2), v2 + d * (m11 * r2 - m21 * r1), num, den

    def power(R, v1, v2, geometry, p):
        v = Vector(v1, v2, -(v1 * geometry.t1 + v2 * geometry.t2))
        return p.mu * R * v.dot(v) + damping(Vector(geometry.w1, geometry.w2, geometry.w3), p)[1]

    def rest_decay(columns: Columns) -> Array:
        return np.asarray(columns["mu"] * grip_at_rest(columns))

    def unit(p):
        return np.sqrt(p.g / surface.stiffness(p)[3])

    number = dict.fromkeys
    momentum = scene.inline(record, momentum, y=7)
    nonstiff = scene.inline(record, nonstiff, **number(("u1", "u2", "M1", "M2", "M3", "v1", "v2")))
    return StiffForm(
        full=full,
        model=in_momentum(full, momentum, nonstiff, ripple.of_momenta(surface, skew=scene.skew)),
        momentum=momentum,
        nonstiff=nonstiff,
        newton=scene.inline(
            record, newton, **number(("u1", "u2", "v1", "v2")), geometry=Geometry, **number(("gamma", "b1", "b2"))
        ),
        power=scene.inline(record, power, **number(("R", "v1", "v2")), geometry=Geometry),
        rocking=scene.inline(record, rigid_body.rocking_on(surface)),
        unit=scene.inline(record, unit),
        slip_decay=lambda columns: 2.2 * (rest_decay(columns) + rigid_body.spin_unit(columns)),
        rest_decay=rest_decay,
        damping=lambda columns: couples_decay(scene, columns),
    )


def _compliance(x_p: Vector, p) -> Symmetric:
    """T = 1 - [x_p] J⁻¹ [x_p]: how a force accelerates the contact point."""
    J = rigid_body.inverse_of(p)
    # The rows of [x_p] are e × x_p, for the axes e.
    X, Y, Z = (e.cross(x_p) for e in _AXES)
    of_x, of_y, of_z = J.of(X), J.of(Y), J.of(Z)
    return Symmetric(1.0 + X.dot(of_x), 1.0 + Y.dot(of_y), 1.0 + Z.dot(of_z), X.dot(of_y), X.dot(of_z), Y.dot(of_z))


_AXES = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)
