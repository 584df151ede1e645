"""Choose the model that runs a configuration: the paper's, or a variant for what is named beyond it."""

from __future__ import annotations

from dataclasses import dataclass

from sweep.models.general import rigid_body, starts, variants
from sweep.models.general.couples import COUPLES
from sweep.models.general.laws import LAWS, Law
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import Model
from sweep.parameters import PAPER_PARAMETERS, PAPER_UNITS, PARAMETERS, SI, Parameter

PAPER_LAW = "viscous"

INERTIA = (*rigid_body.MOMENTS, *rigid_body.PRODUCTS)


@dataclass(frozen=True)
class Physics:
    """The physics that a configuration describes, beside its numbers: of bodies, friction and starts."""

    units: str
    """`PAPER_UNITS` or `SI`."""
    law: Law
    """The law of slip friction: one of `LAWS`, or a user's."""
    surface: Surface
    names: frozenset[str]
    """The parameters that the configuration names."""

    @property
    def beyond(self) -> list[str]:
        """List what the paper's models do not know of it."""
        found = sorted(self.names - PAPER_PARAMETERS.keys())
        found += [f"law: {self.law.name}"] if self.law.name != PAPER_LAW else []
        found += [f"units: {self.units}"] if self.units != PAPER_UNITS else []
        return found + ([f"surface: {self.surface.name}"] if self.surface != ELLIPSOID else [])

    @property
    def required(self) -> frozenset[Parameter]:
        """The parameters that have to be given, because their defaults are of other bodies."""
        names = PAPER_PARAMETERS if self.units == SI else self.surface.required
        return frozenset(PARAMETERS[name] for name in names)

    def variant(self, base: str) -> Model:
        """The variant of `slip` or `noslip` for it, whose parameters are those that follow from what is named."""
        homogeneous = self.surface.homogeneous and not self.names & {*INERTIA}
        moments = ("delta",) if homogeneous else INERTIA
        system = ("mass", "gravity") if self.units == SI else ()
        by_angles = (*starts.ANGLES, *(starts.SLIP if base == "slip" else ()))
        start = by_angles if self.names & {*starts.ANGLES, *starts.SLIP} else starts.POINT
        couples = [name for name, couple in COUPLES.items() if self.names & {*couple.parameters}]
        parameters = ("a", "b", "c", "offset", *moments, *system, *start)
        name = variants.name_of(base, self.law.name, couples, self.surface.name)
        return variants.variant(name, parameters, None if self.law.name in LAWS else self.law)

    def misfits(self) -> dict[str, str]:
        """List the named parameters that do not go with the rest, and what to do about each."""
        inertia, angles = self.names & {*INERTIA}, self.names & {*starts.ANGLES, *starts.SLIP}
        found: dict[str, str] = {}
        if inertia:
            found["delta"] = f"cannot be combined with {_some(inertia)}; leave out either"
        elif not self.surface.homogeneous:
            found["delta"] = f"means nothing with surface: {self.surface.name}; give the elements of inertia instead"
        if angles:
            ways = f"either {', '.join(starts.POINT)} or angles, omega1 … omega3 and slip"
            found |= dict.fromkeys(starts.POINT, f"cannot be combined with {_some(angles)}; give {ways}")
        if self.units == PAPER_UNITS:
            found |= dict.fromkeys(("mass", "gravity"), "is 1 in the paper's units; leave it out, or set units: SI")
        known = {*self.law.parameters, "mu"}  # one file with mu serves every law
        takes = ", ".join((*self.law.parameters, *(name for couple in COUPLES.values() for name in couple.parameters)))
        # In the order of the laws: that of a set would change from process to process.
        for name in dict.fromkeys(name for law in LAWS.values() for name in law.parameters):
            if name not in known:
                found[name] = f"does not belong to the law {self.law.name}; leave it out (friction takes {takes})"
        return {name: words for name, words in found.items() if name in self.names}


def _some(names: frozenset[str]) -> str:
    return ", ".join(sorted(names))
