"""Which model runs a configuration: the paper's, or a variant for what the configuration names beyond it."""

from __future__ import annotations

from collections.abc import Collection

from sweep.models.general import rigid_body, starts, variants
from sweep.models.general.couples import COUPLES
from sweep.models.general.laws import LAWS, Law
from sweep.models.general.surfaces import ELLIPSOID, SURFACES
from sweep.models.model import Model

PAPER, SI = "paper", "SI"
"""Systems of units: lengths in c, times in sqrt(c/g) and a mass of one, or SI."""

PAPER_LAW = "viscous"

PAPER_PARAMETERS = frozenset({"a", "b", "c", "delta", "mu", *starts.POINT})
"""Parameters of the paper's models."""

INERTIA = (*rigid_body.MOMENTS, *rigid_body.PRODUCTS)


def is_papers(law: str, units: str, names: Collection[str], surface: str = ELLIPSOID.name) -> bool:
    """Whether the paper's models know all of a scene: law of friction, units, the parameters `names`, and surface."""
    return law == PAPER_LAW and units == PAPER and set(names) <= PAPER_PARAMETERS and surface == ELLIPSOID.name


def variant(
    base: str,
    law: str,
    units: str,
    names: Collection[str],
    surface: str = ELLIPSOID.name,
    own: Law | None = None,
) -> Model:
    """The variant of `slip` or `noslip` for a scene; its parameters are those that follow from `names`.

    `own` is the law of the name `law`, if it is not one of `LAWS`.
    """
    homogeneous = SURFACES[surface].homogeneous and not set(INERTIA) & set(names)
    moments = ("delta",) if homogeneous else INERTIA
    system = ("mass", "gravity") if units == SI else ()
    by_angles = (*starts.ANGLES, *(starts.SLIP if base == "slip" else ()))
    start = by_angles if {*starts.ANGLES, *starts.SLIP} & set(names) else starts.POINT
    couples = [name for name, couple in COUPLES.items() if set(couple.parameters) & set(names)]
    parameters = ("a", "b", "c", "offset", *moments, *system, *start)
    return variants.variant(variants.name_of(base, law, couples, surface), parameters, own)


def strangers(
    law: str, units: str, names: Collection[str], surface: str = ELLIPSOID.name, own: Law | None = None
) -> dict[str, str]:
    """The parameters that do not belong to a scene, with the reason; `own` as of `variant`."""
    theirs = (own or LAWS[law]).parameters
    names = set(names)
    found: dict[str, str] = {}
    inertia, angles, point = names & set(INERTIA), names & {*starts.ANGLES, *starts.SLIP}, names & set(starts.POINT)
    if inertia:
        found |= {"delta": f"beside {_some(inertia)}; allowed: delta or the elements of inertia"}
    elif not SURFACES[surface].homogeneous:
        found |= {"delta": f"with surface: {surface}; allowed: the elements of inertia"}
    if angles:
        words = f"beside {_some(angles)}; allowed: {', '.join(starts.POINT)}, or angles, omega1 … omega3 and slip"
        found |= dict.fromkeys(starts.POINT, words)
    if units == PAPER:
        found |= dict.fromkeys(("mass", "gravity"), "with units: paper, in which it is 1; allowed: with units: SI")
    for other in LAWS.values():
        foreign = set(other.parameters) - set(theirs) - {"mu"}
        words = ", ".join((*theirs, *(name for couple in COUPLES.values() for name in couple.parameters)))
        found |= dict.fromkeys(foreign, f"not of the law {law}; allowed: {words}")
    return {name: words for name, words in found.items() if name in names and (name not in point or angles)}


def _some(names: Collection[str]) -> str:
    return ", ".join(sorted(names))
