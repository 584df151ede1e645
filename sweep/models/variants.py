"""Choose the variant of `slip` or `noslip` for a body and a law of friction.

A *variant* is specialised for one law, and for the couples, extras (`sweep.models.general.common.EXTRAS`) and surface
that its name lists: `slip+coulomb+sigma`, `noslip+solid+rolling`, `slip+viscous+offset+gravity`.  Whatever it does
not name adds no instruction to its kernel.  The variant of the paper's body is `slip` itself.

The `Physics` of a configuration chooses the variant that runs it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from sweep.faults import either
from sweep.models.general import rigid_body, starts
from sweep.models.general.common import EXTRAS, SOLID, Variant
from sweep.models.general.couples import COUPLES
from sweep.models.general.laws import LAWS, Law
from sweep.models.general.solids import NOTHING, SOLIDS, Assembly
from sweep.models.general.surfaces import ELLIPSOID, SURFACES, Surface
from sweep.models.ladder.noslip import rolling
from sweep.models.ladder.slip import slipping
from sweep.models.model import Model
from sweep.models.origin import Origin
from sweep.parameters import OF_SOLIDS, PAPER_PARAMETERS, PARAMETERS, SI_ALONE, Parameter
from sweep.units import PAPER_UNITS, SI

BASES = ("slip", "noslip")

PAPER_LAW = "viscous"

INERTIA = (*rigid_body.MOMENTS, *rigid_body.PRODUCTS)


@dataclass(frozen=True)
class SlipWith:
    """The variants of `slip` with a user's law of friction, as `with_law` makes them."""

    law: Law
    own_parameters: tuple[Parameter, ...]
    """The law's parameters that are not in `sweep.parameters`, or have another meaning there."""
    origin: Origin | None = None


def with_law(law: Law, *parameters: Parameter) -> SlipWith:
    """Make the MODEL of a file that defines a law of friction for any body.

    Parameters
    ----------
    law : its resistance takes the constants that `law.parameters` names
    parameters : records of its parameters that are not in `sweep.parameters`, all in the section "friction"
    """
    return SlipWith(law, parameters)


@cache
def make(variant: Variant, parameters: tuple[str, ...] = ()) -> Model:
    """The model of a variant.

    Its `parameters` are those of the body and the start on which it should depend; they make no difference to its
    kernel.
    """
    return slipping(variant, parameters) if variant.law else rolling(variant, parameters)


def variant(name: str, own: Law | None = None) -> Model:
    """The model of a name, such as `slip+coulomb+sigma`; `own` is a user's law that the name refers to.

    Raises
    ------
    KeyError
        if a part of the name is unknown.
    """
    base, _, rest = name.partition("+")
    law, *more = rest.split("+")
    if base not in BASES or (base == "noslip") != (law == SOLID):
        raise KeyError(name)
    surface = SURFACES[more.pop()] if more and more[-1] in SURFACES else ELLIPSOID
    couples = tuple(COUPLES[each] for each in more if each not in EXTRAS)
    extras = frozenset(more) & EXTRAS.keys()
    return make(Variant(None if law == SOLID else own or LAWS[law], couples, surface, frozenset(extras)))


@dataclass(frozen=True)
class Physics:
    """The physics that a configuration describes, apart from its numbers: bodies, friction and starts."""

    units: str
    """`PAPER_UNITS` or `SI`."""
    law: Law
    """The law of slip friction: one of `LAWS`, or a user's."""
    surface: Surface
    names: frozenset[str]
    """The parameters that the configuration names."""
    assembly: Assembly = NOTHING

    @property
    def beyond(self) -> list[str]:
        """List the parts that the paper's models do not cover."""
        found = sorted(self.names - PAPER_PARAMETERS.keys())
        found += [f"law: {self.law.name}"] if self.law.name != PAPER_LAW else []
        found += [f"units: {self.units}"] if self.units != PAPER_UNITS else []
        return found + ([f"surface: {self.surface.name}"] if self.surface != ELLIPSOID else [])

    @property
    def required(self) -> frozenset[Parameter]:
        """The parameters that have to be given, because their defaults apply to other bodies."""
        names = PAPER_PARAMETERS if self.units == SI else self.surface.required
        return frozenset(PARAMETERS[name] for name in names)

    def variant(self, base: str) -> Model:
        """The variant of `slip` or `noslip` for it, with the parameters that follow from the named ones."""
        homogeneous = self.surface.homogeneous and not (self.names & {*INERTIA} or self.assembly.weights)
        moments = ("delta",) if homogeneous else INERTIA
        system = SI_ALONE if self.units == SI else ()
        by_angles = (*starts.ANGLES, *(starts.SLIP if base == "slip" else ()))
        start = by_angles if self.names & {*starts.ANGLES, *starts.SLIP} else starts.POINT
        couples = tuple(couple for couple in COUPLES.values() if self.names & {*couple.parameters})
        solid, body = self.assembly.solid, ("a", "b", "c", "offset", *moments, *system)
        if solid:
            body = (*solid.parameters(self.names), "gravity")
        named = {*self.names, *system, *self.assembly.named}
        extras = {n: each for n, each in EXTRAS.items() if named & {*each.parameters} and each.on(self.surface)}
        more = (name for each in extras.values() for name in each.parameters if not solid and name not in body)
        parameters = (*body, *start, *more)
        return make(Variant(self.law if base == "slip" else None, couples, self.surface, frozenset(extras)), parameters)

    def misfits(self) -> dict[str, str]:
        """List the named parameters that are incompatible with the rest, and what to do about each."""
        inertia, angles = self.names & {*INERTIA}, self.names & {*starts.ANGLES, *starts.SLIP}
        found: dict[str, str] = {}
        if inertia:
            found["delta"] = f"cannot be combined with {_some(inertia)}; leave out either"
        elif not self.surface.homogeneous:
            found["delta"] = f"has no meaning with surface: {self.surface.name}; give the elements of inertia instead"
        if solid := self.assembly.solid:
            sizes = solid.parameters(frozenset(PARAMETERS))
            words = f"does not belong to this solid; leave it out (it takes {', '.join(sizes)})"
            others = (p.name for p in PARAMETERS.values() if p.section == "body" and p.name not in sizes)
            found |= dict.fromkeys(others, words)
            both = (pair for pair in solid.excluding if self.names.issuperset(pair))
            found |= {one: f"cannot be combined with {other}; leave out one of the two" for one, other in both}
        else:
            found |= dict.fromkeys(OF_SOLIDS, f"is the size of a solid; add solid: {either(SOLIDS)}")
        if angles:
            ways = f"either {', '.join(starts.POINT)} or angles, omega1 … omega3 and slip"
            found |= dict.fromkeys(starts.POINT, f"cannot be combined with {_some(angles)}; give {ways}")
        if self.units == PAPER_UNITS:
            found |= dict.fromkeys(SI_ALONE, "is 1 in the paper's units; leave it out, or set units: SI")
        known = {*self.law.parameters, "mu"}  # one file with mu serves every law
        takes = ", ".join((*self.law.parameters, *(name for couple in COUPLES.values() for name in couple.parameters)))
        # In the order of the laws: the order of a set would change from process to process.
        for name in dict.fromkeys(name for law in LAWS.values() for name in law.parameters):
            if name not in known:
                found[name] = f"does not belong to the law {self.law.name}; leave it out (friction takes {takes})"
        return {name: words for name, words in found.items() if name in self.names}


def _some(names: frozenset[str]) -> str:
    return ", ".join(sorted(names))
