"""Any body and any law of friction: the equations of `slip` and `noslip` for a `sweep.models.solid`.

A model of this file is a *variant* of `slip` or `noslip`, specialised for a law of friction and for couples, whose
names make up its own: `slip+coulomb-tanh+sigma`, `noslip+solid+rolling`, and for a surface that is no ellipsoid
`slip+viscous+paraboloid`.  What a variant does not name leaves no instruction in its kernel.  The states are those of
`slip` and `noslip`, in the axes of the surface.  All forces are per unit mass: R is the acceleration N/m by the normal
force.

With slip.  Gravity, the contact force R (u + f) with f = -k v_p, and the couple τ0 + R τ1 give

    v_g' + ω × v_g = R (u + f) - g u,   v_g = v_p + v_0,   v_0 = x_p × ω,
    J ω' = x_p × R (u + f) + τ0 + R τ1 - ω × J ω.

So ω' = α + R β with α = J⁻¹ (τ0 - ω × J ω) and β = J⁻¹ (x_p × (u + f) + τ1), and

    v_p' = R (u + f) - g u - x_p × ω' - ω × (v_p + v_0 - x_p').

The contact point stays in the plane, v_p · u = 0.  With u' = u × ω the derivative of that is v_p' · u =
-u · (ω × v_p), which cancels the same term on the right.  With q = u × x_p,

    R = (g + (v_0 - x_p') · u' + q · α) / (1 - q · β).

Without slip.  v_g = v_0, and the contact force is g u + v_g' + ω × v_g whatever it has to be.  Its torque gives

    (J + |x_p|² - x_p x_pᵀ) ω' = x_p × (g u + ω × (v_0 - x_p')) + τ0 + R τ1 - ω × J ω,
    R = g + u · (ω × (v_0 - x_p')) + q · ω'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models import bodies, noslip, slip, solid, starts, steady
from sweep.models.bounds import couples_decay, faint_energy, hardest_turn, still_energy, strongest_grip
from sweep.models.couples import COUPLES, Couple, nothing
from sweep.models.laws import LAWS, Law
from sweep.models.model import COUNT, ENERGY, LINEAR, REVERSAL_TIME, SPIN, Array, Columns, Model, Ripple, named
from sweep.models.origin import Origin
from sweep.models.resisting import drag_of, isotropic_drag, resistance_of, resistances
from sweep.models.solid import gyroscopic
from sweep.models.surfaces import ELLIPSOID, SURFACES, Surface
from sweep.parameters import Parameter

BASES = ("slip", "noslip")

SOLID = "solid"
"""Stands in place of the law in the names of variants without slip."""

_STILL = "still"
"""The constant `Model.still` of variants with a couple that stops the body."""


@dataclass(frozen=True)
class SlipWith:
    """The variants of `slip` with a law of friction that a user brings: what `with_law` makes."""

    law: Law
    own_parameters: tuple[Parameter, ...]
    """Those of the law's parameters that are not in `sweep.parameters`, or mean something else there."""
    origin: Origin | None = None


def with_law(law: Law, *parameters: Parameter) -> SlipWith:
    """The MODEL of a file that brings a law of friction for any body.

    Parameters
    ----------
    law : its resistance takes the constants that `law.parameters` names
    parameters : records of those that are not in `sweep.parameters`, all of the section "friction"
    """
    return SlipWith(law, parameters)


@cache
def variant(name: str, parameters: tuple[str, ...] = (), own: Law | None = None) -> Model:
    """The model of a name, such as `slip+coulomb-tanh+sigma`.

    Parameters
    ----------
    parameters : those of the body and the start that it is asked to depend on; they make no difference to its kernel
    own : the law that the name tells, if it is not one of `LAWS`

    Raises
    ------
    KeyError
        if a part of the name is unknown.
    """
    base, law, couples, surface = parts(name)
    if base == "slip":
        return _slipping(name, own or LAWS[law], couples, surface, parameters)
    if (base, law) == ("noslip", SOLID):
        return _rolling(name, couples, surface, parameters)
    raise KeyError(name)


def parts(name: str) -> tuple[str, str, list[Couple], Surface]:
    """What the name of a variant, or of another model, says: base, law, couples and surface."""
    base, _, rest = name.partition("+")
    law, *more = rest.split("+")
    surface = SURFACES[more.pop()] if more and more[-1] in SURFACES else ELLIPSOID
    return base, law, [COUPLES[couple] for couple in more], surface


def name_of(base: str, law: str, couples: Sequence[str], surface: str = ELLIPSOID.name) -> str:
    """The name of a variant; of a model without slip whatever the law is."""
    shape = [surface] if surface != ELLIPSOID.name else []
    return "+".join([base, law if base == "slip" else SOLID, *couples, *shape])


def _record(surface: Surface, constants: Sequence[str], more: Any) -> type[Any]:
    """The constants of a variant: shape, inertia, its inverse, and `more`, a function of the columns."""
    shape = solid.shape_names(surface)
    inverse = tuple(name.replace("J", "inv_J") for name in solid.INERTIA)

    class Constants(named(*shape, *solid.INERTIA, *inverse, *constants)):  # type: ignore[misc]
        @classmethod
        def of(cls, columns: Columns) -> Constants:
            J = solid.inertia(columns)
            return cls(*solid.shape(columns, surface), *J, *solid.inverse(J), *more(columns))

    return Constants


def _couple_constants(couples: Sequence[Couple], law: Law | None = None) -> tuple[tuple[str, ...], Any]:
    names = tuple(name for couple in couples for name in couple.constants)
    stopping = [couple.stops_below for couple in couples if couple.stops_below]
    stopping = [law.stops_below] if law and law.stops_below else stopping

    def values(columns: Columns) -> tuple[Array, ...]:
        still = (still_energy(stops_below(columns), columns) for stops_below in stopping)
        return (*(value for couple in couples for value in couple.of(columns)), *still)

    return (*names, *(_STILL for _ in stopping)), values


def _slipping(name: str, law: Law, couples: Sequence[Couple], surface: Surface, parameters: tuple[str, ...]) -> Model:
    contact, general_energy = surface.contact, solid.energy_on(surface)
    resistance, (plain, loaded), drag = resistance_of(law), resistances(couples), drag_of(couples, law)
    # A product with 0.0 would remain: the compiler has to allow for infinity.  A branch on these does not.
    damps, drags = plain is not nothing, loaded is not nothing or drag is not isotropic_drag
    names, values = _couple_constants(couples, law)

    @inline
    def rhs(y: Any, p: Any) -> Any:
        u1, u2, w1, w2, w3, v1, v2 = y
        (u3, inv_u3), (x, y_, z), (du1, du2, du3), (dx, dy, dz) = contact(u1, u2, w1, w2, w3, p)

        v3 = -(v1 * u1 + v2 * u2) * inv_u3
        slip_square = v1 * v1 + v2 * v2 + v3 * v3
        k = resistance(slip_square, w1, w2, w3, u1, u2, u3, p)
        # f = u - k v, the contact force per unit of R
        f1, f2, f3 = u1 - k * v1, u2 - k * v2, u3 - k * v3
        # s = v_0 - x_p'
        s1, s2, s3 = y_ * w3 - z * w2 - dx, z * w1 - x * w3 - dy, x * w2 - y_ * w1 - dz
        q1, q2, q3 = u2 * z - u3 * y_, u3 * x - u1 * z, u1 * y_ - u2 * x
        turn_square = w1 * w1 + w2 * w2 + w3 * w3
        k0, k1 = plain(turn_square, p), loaded(turn_square, p)
        k1, d1, d2, d3 = drag(k1, w1, w2, w3, u1, u2, u3, slip_square, p)
        m1, m2, m3 = gyroscopic(w1, w2, w3, p)
        if damps:
            m1, m2, m3 = m1 - k0 * w1, m2 - k0 * w2, m3 - k0 * w3
        al1 = p.inv_J11 * m1 + p.inv_J12 * m2 + p.inv_J13 * m3
        al2 = p.inv_J12 * m1 + p.inv_J22 * m2 + p.inv_J23 * m3
        al3 = p.inv_J13 * m1 + p.inv_J23 * m2 + p.inv_J33 * m3
        t1, t2, t3 = y_ * f3 - z * f2, z * f1 - x * f3, x * f2 - y_ * f1
        if drags:
            t1, t2, t3 = t1 - k1 * d1, t2 - k1 * d2, t3 - k1 * d3
        be1 = p.inv_J11 * t1 + p.inv_J12 * t2 + p.inv_J13 * t3
        be2 = p.inv_J12 * t1 + p.inv_J22 * t2 + p.inv_J23 * t3
        be3 = p.inv_J13 * t1 + p.inv_J23 * t2 + p.inv_J33 * t3

        denominator = 1.0 - (q1 * be1 + q2 * be2 + q3 * be3)
        R = (p.g + (s1 * du1 + s2 * du2 + s3 * du3) + (q1 * al1 + q2 * al2 + q3 * al3)) / denominator

        dw1, dw2, dw3 = al1 + R * be1, al2 + R * be2, al3 + R * be3
        s1, s2, s3 = s1 + v1, s2 + v2, s3 + v3
        dv1 = R * f1 - p.g * u1 - (y_ * dw3 - z * dw2) - (w2 * s3 - w3 * s2)
        dv2 = R * f2 - p.g * u2 - (z * dw1 - x * dw3) - (w3 * s1 - w1 * s3)

        spin = u1 * w1 + u2 * w2 + u3 * w3
        per_load = k * slip_square
        if drags:
            per_load = per_load + k1 * (d1 * w1 + d2 * w2 + d3 * w3)
        power = R * per_load
        if damps:
            power = power + k0 * turn_square
        return (du1, du2, dw1, dw2, dw3, dv1, dv2), (spin, power, R, denominator)

    @inline
    def energy(y: Any, p: Any) -> Any:
        u1, u2, w1, w2, w3, v1, v2 = y
        return general_energy(u1, u2, w1, w2, w3, v1, v2, p)

    def observe(y: Array, p: Any) -> dict[str, Array]:
        return {**_seen(contact, rhs, y, p), "slip_1": y[5], "slip_2": y[6]}

    def fastest_decay(columns: Columns) -> Array:
        grip = strongest_grip(columns, surface)
        decay = law.strongest(columns) * grip + couples_decay(couples, columns, surface)
        if law.strongest_couple:
            decay = decay + law.strongest_couple(columns) * hardest_turn(columns, surface)
        return np.asarray(decay)

    def more(columns: Columns) -> tuple[Array, ...]:
        faint = () if law.linear_to is None else (faint_energy(law.linear_to(columns), columns, surface),)
        return (*(columns[each] for each in law.parameters), *values(columns), *faint)

    fields = (*law.parameters, *names, *(() if law.linear_to is None else ("faint",)))
    return Model(
        name=name,
        summary=f"{slip.MODEL.summary}, for any body",
        states=slip.MODEL.states,
        spin_state=slip.MODEL.spin_state,
        parameters=(*parameters, *law.parameters, *(each for couple in couples for each in couple.parameters)),
        offers=_offers(couples, dissipates=law.coupled is None) | ({REVERSAL_TIME} if law.name == "viscous" else set()),
        constants=_record(surface, fields, more),
        start=lambda columns: starts.slipping(columns, surface),
        slower_period=lambda columns: solid.slower_period(columns, surface),
        fastest_decay=fastest_decay,
        upright=slip.MODEL.upright,
        rhs=rhs,
        energy=energy,
        ripple=Ripple(steady.NAMES, lambda columns: steady.form(columns, surface), steady.slipping),
        tilt=slip.MODEL.tilt,
        observe=observe,
        spin_unit=solid.spin_unit,
        impossible=lambda columns: bodies.impossible(columns, surface),
        faint="" if law.linear_to is None else "faint",
        still=_STILL if _STILL in names else "",
        extremes=(lambda columns: (columns,)) if law.linear_to is None else _with_and_without(law),
    )


def _rolling(name: str, couples: Sequence[Couple], surface: Surface, parameters: tuple[str, ...]) -> Model:
    contact, general_energy = surface.contact, solid.energy_on(surface)
    (plain, loaded), drag = resistances(couples), drag_of(couples)
    damps, drags = plain is not nothing, loaded is not nothing or drag is not isotropic_drag
    names, values = _couple_constants(couples)

    @inline
    def rhs(y: Any, p: Any) -> Any:
        u1, u2, w1, w2, w3 = y
        (u3, _), (x, y_, z), (du1, du2, _), (dx, dy, dz) = contact(u1, u2, w1, w2, w3, p)
        # s = v_0 - x_p', and h = g u + ω × s
        s1, s2, s3 = y_ * w3 - z * w2 - dx, z * w1 - x * w3 - dy, x * w2 - y_ * w1 - dz
        c1, c2, c3 = w2 * s3 - w3 * s2, w3 * s1 - w1 * s3, w1 * s2 - w2 * s1
        h1, h2, h3 = p.g * u1 + c1, p.g * u2 + c2, p.g * u3 + c3
        turn_square = w1 * w1 + w2 * w2 + w3 * w3
        k0, k1 = plain(turn_square, p), loaded(turn_square, p)
        k1, d1, d2, d3 = drag(k1, w1, w2, w3, u1, u2, u3, 0.0, p)
        m1, m2, m3 = gyroscopic(w1, w2, w3, p)
        t1, t2, t3 = m1 + y_ * h3 - z * h2, m2 + z * h1 - x * h3, m3 + x * h2 - y_ * h1
        if damps:
            t1, t2, t3 = t1 - k0 * w1, t2 - k0 * w2, t3 - k0 * w3

        # P = J + |x_p|² - x_p x_pᵀ, and the adjugate C of it
        P11, P22, P33 = p.J11 + y_ * y_ + z * z, p.J22 + z * z + x * x, p.J33 + x * x + y_ * y_
        P12, P13, P23 = p.J12 - x * y_, p.J13 - x * z, p.J23 - y_ * z
        C11, C22, C33 = P22 * P33 - P23 * P23, P11 * P33 - P13 * P13, P11 * P22 - P12 * P12
        C12, C13, C23 = P13 * P23 - P12 * P33, P12 * P23 - P13 * P22, P12 * P13 - P11 * P23
        inv = 1.0 / (P11 * C11 + P12 * C12 + P13 * C13)
        a1 = inv * (C11 * t1 + C12 * t2 + C13 * t3)
        a2 = inv * (C12 * t1 + C22 * t2 + C23 * t3)
        a3 = inv * (C13 * t1 + C23 * t2 + C33 * t3)
        q1, q2, q3 = u2 * z - u3 * y_, u3 * x - u1 * z, u1 * y_ - u2 * x
        R = p.g + (u1 * c1 + u2 * c2 + u3 * c3) + (q1 * a1 + q2 * a2 + q3 * a3)
        spin = u1 * w1 + u2 * w2 + u3 * w3
        denominator, power = 1.0, 0.0
        if drags:
            # ω' = a - R k1 b
            b1 = inv * (C11 * d1 + C12 * d2 + C13 * d3)
            b2 = inv * (C12 * d1 + C22 * d2 + C23 * d3)
            b3 = inv * (C13 * d1 + C23 * d2 + C33 * d3)
            denominator = 1.0 + k1 * (q1 * b1 + q2 * b2 + q3 * b3)
            R = R / denominator
            load = R * k1
            a1, a2, a3 = a1 - load * b1, a2 - load * b2, a3 - load * b3
            power = load * (d1 * w1 + d2 * w2 + d3 * w3)
        if damps:
            power = power + k0 * turn_square
        return (du1, du2, a1, a2, a3), (spin, power, R, denominator)

    @inline
    def energy(y: Any, p: Any) -> Any:
        u1, u2, w1, w2, w3 = y
        return general_energy(u1, u2, w1, w2, w3, 0.0, 0.0, p)

    return Model(
        name=name,
        summary=f"{noslip.MODEL.summary}, for any body",
        states=noslip.MODEL.states,
        spin_state=noslip.MODEL.spin_state,
        parameters=(*parameters, *(each for couple in couples for each in couple.parameters)),
        offers=_offers(couples, dissipates=bool(couples)) | {REVERSAL_TIME},
        constants=_record(surface, names, values),
        start=lambda columns: starts.rolling(columns, surface),
        slower_period=lambda columns: solid.slower_period(columns, surface),
        fastest_decay=lambda columns: couples_decay(couples, columns, surface),
        upright=noslip.MODEL.upright,
        rhs=rhs,
        energy=energy,
        tilt=noslip.MODEL.tilt,
        radians_a_step=noslip.MODEL.radians_a_step,
        ripple=Ripple(steady.NAMES, lambda columns: steady.form(columns, surface), steady.rolling),
        still=_STILL if _STILL in names else "",
        observe=lambda y, p: _seen(contact, rhs, y, p),
        spin_unit=solid.spin_unit,
        impossible=lambda columns: bodies.impossible(columns, surface),
    )


def _offers(couples: Sequence[Couple], *, dissipates: bool) -> frozenset[str]:
    """A couple that is not linear has no Jacobian that is quadratic in the spin, which the linear theory needs."""
    theory = {LINEAR} if dissipates and all(couple.linear for couple in couples) else set()
    return frozenset({COUNT, SPIN, ENERGY} | theory)


def _seen(contact: Any, rhs: Any, y: Array, p: Any) -> dict[str, Array]:
    """The contact point and the normal force."""
    _, point, _, _ = contact(*y[:5], p)
    _, (_, _, R, _) = rhs(y, p)
    return {"contact_x": point[0], "contact_y": point[1], "normal_force": R}


def _with_and_without(law: Law) -> Any:
    """As a law that saturates leaves the body free when it slips fast, motions without friction matter as well."""

    def extremes(columns: Columns) -> tuple[Columns, ...]:
        free = {name: 0 * columns[name] for name in law.parameters if name.startswith("mu")}
        return columns, {**columns, **free}

    return extremes
