"""Any body and any law of friction: the equations of `slip` and `noslip` for a `sweep.models.general.rigid_body`.

A model made here is a *variant* of `slip` or `noslip`, specialised for a law of friction and for couples, whose
names make up its own: `slip+coulomb-tanh+sigma`, `noslip+solid+rolling`, and for a surface that is no ellipsoid
`slip+viscous+paraboloid`.  What a variant does not name leaves no instruction in its kernel.  The states are those of
`slip` and `noslip`, in the axes of the surface; the equations are those of `general_slip` and `general_noslip`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from sweep.models.general.couples import COUPLES, Couple
from sweep.models.general.laws import LAWS, Law
from sweep.models.general.noslip import rolling
from sweep.models.general.slip import slipping
from sweep.models.general.surfaces import ELLIPSOID, SURFACES, Surface
from sweep.models.model import Model
from sweep.models.origin import Origin
from sweep.parameters import Parameter

BASES = ("slip", "noslip")

SOLID = "solid"
"""Stands in place of the law in the names of variants without slip."""


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
        return slipping(name, own or LAWS[law], couples, surface, parameters)
    if (base, law) == ("noslip", SOLID):
        return rolling(name, couples, surface, parameters)
    raise KeyError(name)


def parts(name: str) -> tuple[str, str, list[Couple], Surface]:
    """Read the name of a variant, or of another model: base, law, couples and surface."""
    base, _, rest = name.partition("+")
    law, *more = rest.split("+")
    surface = SURFACES[more.pop()] if more and more[-1] in SURFACES else ELLIPSOID
    return base, law, [COUPLES[couple] for couple in more], surface


def name_of(base: str, law: str, couples: Sequence[str], surface: str = ELLIPSOID.name) -> str:
    """The name of a variant; of a model without slip whatever the law is."""
    shape = [surface] if surface != ELLIPSOID.name else []
    return "+".join([base, law if base == "slip" else SOLID, *couples, *shape])
