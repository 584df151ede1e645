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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models import bodies, noslip, slip, solid, starts, steady
from sweep.models.couples import COUPLES, Couple, nothing
from sweep.models.laws import LAWS, Law
from sweep.models.model import COUNT, ENERGY, LINEAR, REVERSAL_TIME, SPIN, Array, Columns, Model, Ripple, named
from sweep.models.origin import Origin
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
        still = (_still(stops_below(columns), columns) for stops_below in stopping)
        return (*(value for couple in couples for value in couple.of(columns)), *still)

    return (*names, *(_STILL for _ in stopping)), values


def _still(speed: Array, columns: Columns) -> Array:
    """Energy that allows no angular velocity above `speed`, per unit mass, shape (cells,)."""
    return np.asarray(0.5 * np.linalg.eigvalsh(solid.matrix(solid.inertia(columns)))[:, 0] * speed**2)


def resistances(couples: Sequence[Couple]) -> tuple[Any, Any]:
    """The resistance by itself and the one per unit of the normal force."""
    found: list[Any] = [nothing, nothing]
    for couple in couples:
        if not couple.about_normal:
            found[couple.needs_normal_force] = couple.resistance
    return found[0], found[1]


def _resistance(law: Law) -> Any:
    """Inline, (v², ω, u, constants) -> the law's resistance k."""
    alone, coupled = law.resistance, law.coupled
    if coupled is None:

        @inline
        def isotropic(
            square: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, p: Any  # noqa: ARG001
        ) -> Any:  # fmt: skip
            return alone(square, p)

        return isotropic

    @inline
    def resistance(square: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, p: Any) -> Any:
        n = u1 * w1 + u2 * w2 + u3 * w3
        k, _ = coupled(square, n * n, p)
        return k

    return resistance


def _drag(couples: Sequence[Couple], law: Law | None = None) -> Any:
    """Inline, (k, ω, u, v², constants) -> (k', d): the couple per unit of the normal force is -k' d.

    It is -k ω, and where `couples` have one about the normal, or the law, also that one.
    """
    about_normal = [couple.resistance for couple in couples if couple.about_normal]
    coupled = law.coupled if law else None
    if not about_normal and coupled is None:
        return _isotropic
    spinning = about_normal[0] if about_normal else nothing
    of_slip = coupled or _no_couple

    @inline
    def drag(k: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, square: Any, p: Any) -> Any:
        n = u1 * w1 + u2 * w2 + u3 * w3
        _, of_law = of_slip(square, n * n, p)
        m = (spinning(n * n, p) + of_law) * n
        return 1.0, k * w1 + m * u1, k * w2 + m * u2, k * w3 + m * u3

    return drag


@inline
def _no_couple(square: Any, spin_square: Any, p: Any) -> Any:  # noqa: ARG001
    return 0.0, 0.0


@inline
def _isotropic(
    k: Any, w1: Any, w2: Any, w3: Any, u1: Any, u2: Any, u3: Any, square: Any, p: Any  # noqa: ARG001
) -> Any:  # fmt: skip
    return k, w1, w2, w3


def _slipping(name: str, law: Law, couples: Sequence[Couple], surface: Surface, parameters: tuple[str, ...]) -> Model:
    contact, general_energy = surface.contact, solid.energy_on(surface)
    resistance, (plain, loaded), drag = _resistance(law), resistances(couples), _drag(couples, law)
    # A product with 0.0 would remain: the compiler has to allow for infinity.  A branch on these does not.
    damps, drags = plain is not nothing, loaded is not nothing or drag is not _isotropic
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
            decay = decay + law.strongest_couple(columns) * _hardest_turn(columns, surface)
        return np.asarray(decay)

    def more(columns: Columns) -> tuple[Array, ...]:
        faint = () if law.linear_to is None else (_faint(law.linear_to(columns), columns, surface),)
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
    (plain, loaded), drag = resistances(couples), _drag(couples)
    damps, drags = plain is not nothing, loaded is not nothing or drag is not _isotropic
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


def _faint(speed: Array, columns: Columns, surface: Surface) -> Array:
    """Energy of a rattle whose slip velocity is below `speed`, per unit mass, shape (cells,).

    With ω = n u + o the slip v_p = v_g - x_p × o - n x_p × u is at most sqrt(2 E G) + |n| ρ.  G is the largest
    eigenvalue of 1 - [x_p] J⁻¹ [x_p], and ρ <= s sqrt(2 E / (g k)) the distance of the contact point from the
    vertical through G, with the larger radius of curvature s and the stiffness k.  Spins up to sqrt(g/c) are allowed
    for.
    """
    c, g = columns["c"], solid.gravity(columns)
    inverse = np.linalg.eigvalsh(solid.matrix(solid.inverse(solid.inertia(columns))))[:, -1]
    grip, arm = 1 + solid.height(columns) ** 2 * inverse, np.maximum(*surface.radii(columns))
    stiffness = np.minimum(*solid.stiffness(columns, surface))
    per_root = np.sqrt(2 * grip) + np.sqrt(g / c) * arm * np.sqrt(2 / (g * stiffness))
    return np.asarray((speed / per_root) ** 2)


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


def couples_decay(couples: Sequence[Couple], columns: Columns, surface: Surface) -> Array:
    """Bound on the rate at which couples damp the angular velocity, shape (cells,)."""
    rate, about_normal = np.zeros_like(columns["a"]), np.zeros_like(columns["a"])
    for couple in couples:
        strength = couple.strongest(columns)
        if couple.about_normal:
            about_normal = about_normal + strength * _hardest_turn(columns, surface)
        else:
            rate = rate + (strength * _hardest_press(columns, surface) if couple.needs_normal_force else strength)
    return np.asarray(rate / np.linalg.eigvalsh(solid.matrix(solid.inertia(columns)))[:, 0] + about_normal)


def _energy_start(columns: Columns, surface: Surface) -> Array:
    """Energy above rest at the start, per unit mass, shape (cells,)."""
    J = solid.inertia(columns)
    y = starts.slipping(columns, surface) if "slip1" in columns else (*starts.rolling(columns, surface), 0.0, 0.0)
    names, values = (*solid.shape_names(surface), *solid.INERTIA), (*solid.shape(columns, surface), *J)
    spin, rattle, inertia = solid.energy_on(surface)(*y, SimpleNamespace(**dict(zip(names, values, strict=True))))
    return np.asarray(rattle + 0.5 * inertia * spin**2)


_AZIMUTHS, _SHARES = 12, 9


def _attitudes(columns: Columns, surface: Surface) -> Iterator[tuple[Array, Array]]:
    """Attitudes that a body may reach: normals u, shape (cells, 3), with bounds on the normal force R, shape (cells,).

    A body tilts at most until the height of G takes up the whole energy at the start, E0.  If it tilts towards the
    azimuth ψ at the rate φ', then R - g <= r'' φ'², where r is the height of G at the tilt φ, and

        φ'² <= 2 (E0 - g (r - r0)) / (J_t + r'²),

    where J_t is the least moment of inertia about the axis of tilting, with free spin.
    """
    shape, g, J = surface.of(columns), solid.gravity(columns), solid.matrix(solid.inertia(columns))
    E0, r0 = _energy_start(columns, surface), solid.height(columns)
    for psi in np.linspace(0, np.pi, _AZIMUTHS, endpoint=False):
        cos, sin = np.cos(psi), np.sin(psi)
        height = partial(surface.height, shape, cos, sin)

        # The largest tilt that the energy allows, by bisection; heights grow with the tilt, at least at first.
        low, high = np.zeros_like(E0), np.full_like(E0, 1.5)
        for _ in range(40):
            middle = (low + high) / 2
            within = g * (height(middle) - r0) < E0
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        axis = np.array([-sin, cos, 0.0])
        for share in np.linspace(0, 1, _SHARES):
            phi, d = high * share, 1e-4
            r, ahead, behind = height(phi), height(phi + d), height(phi - d)
            slope, bend = (ahead - behind) / (2 * d), (ahead - 2 * r + behind) / d**2
            u = np.stack([cos * np.sin(phi), sin * np.sin(phi), -np.cos(phi)], axis=-1)
            tt, tu, uu = (np.einsum("...i,...ij,...j->...", p, J, q) for p, q in ((axis, axis), (axis, u), (u, u)))
            square = 2 * np.maximum(E0 - g * (r - r0), 0) / (tt - tu**2 / uu + slope**2)
            yield u, g + np.maximum(bend, 0) * square


def _hardest_press(columns: Columns, surface: Surface) -> Array:
    """Bound on the normal force over the trajectory, per unit mass, shape (cells,)."""
    return np.asarray(np.max([R for _, R in _attitudes(columns, surface)], axis=0))


def _hardest_turn(columns: Columns, surface: Surface) -> Array:
    """Bound on R uᵀ J⁻¹ u over the trajectory, shape (cells,): the decay of the spin per unit of its resistance."""
    inverse = solid.matrix(solid.inverse(solid.inertia(columns)))
    return np.asarray(
        np.max([R * np.einsum("...i,...ij,...j->...", u, inverse, u) for u, R in _attitudes(columns, surface)], axis=0)
    )


def strongest_grip(columns: Columns, surface: Surface = ELLIPSOID) -> Array:
    """Bound on the decay rate of the slip per unit of friction's resistance, shape (cells,).

    Friction on a slip v changes it by -R k (1 - [x_p] J⁻¹ [x_p]) v, where [x] is the matrix of x ×.
    """
    shape = SimpleNamespace(**dict(zip(surface.constants, surface.of(columns), strict=True)))
    inverse = solid.matrix(solid.inverse(solid.inertia(columns)))
    worst = np.zeros_like(columns["a"])
    for u, R in _attitudes(columns, surface):
        _, *point = surface.elevation(*u.T, shape)
        x_p = np.stack(point, axis=-1)
        X = np.cross(np.eye(3), x_p[:, None, :])
        G = X @ inverse @ np.swapaxes(X, 1, 2)
        # One eigenvalue is zero, along x_p; the larger of the others follows from the traces of G and G².
        trace, squares = np.trace(G, axis1=1, axis2=2), (G * G).sum(axis=(1, 2))
        largest = 0.5 * (trace + np.sqrt(np.maximum(2 * squares - trace**2, 0)))
        worst = np.maximum(worst, R * (1 + largest))
    return worst
