"""Defines a checked configuration, which all later code trusts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from html import escape
from typing import Any

import numpy as np

from sweep.config.distributions import Distribution
from sweep.config.document import Document, dump
from sweep.config.schema import Integrator
from sweep.config.values import Values
from sweep.faults import InputError, Path
from sweep.grid import CASE, SAMPLE, Grid
from sweep.kernels import measures
from sweep.kernels.measures.margin import Margin
from sweep.kernels.method import COARSEST
from sweep.kernels.methods import AUTO
from sweep.models import TIERS
from sweep.models.general import laws
from sweep.models.general.common import EXTRAS
from sweep.models.general.solids import NOTHING, Assembly
from sweep.models.general.surfaces import ELLIPSOID, SURFACES
from sweep.models.model import Model, Offer, Tier
from sweep.models.origin import Origin
from sweep.models.user import loading
from sweep.models.variants import BASES, PAPER_LAW, Physics
from sweep.parameters import PARAMETERS, Parameter, sections
from sweep.units import NUMBER, PAPER_UNITS, SI, TIME, named
from sweep.variables import attributes

# Maps are drawn with μ down, b across and one panel per n0. Other axes follow in the order of the configuration.
FIRST_AXES = ("mu", "b", "n0")


def model_of(name: str, origin: Origin | None, physics: Physics) -> Tier:
    """Return the model of this name: built in, a variant with further physics, or user-defined."""
    if origin:
        return loading.find(origin, physics)
    return physics.variant(name) if physics.beyond and name in BASES else TIERS[name]


def present(parameters: Mapping[str, Values]) -> list[str]:
    """Name the parameters, without those by which the body has nothing that it would not have without them."""
    return [name for name, value in parameters.items() if name not in _ABSENT or value.spec != 0.0]


_ABSENT = {name for each in EXTRAS.values() for name in each.parameters if PARAMETERS[name].default == 0}
"""Parameters whose value 0 is as if they were left out."""


@dataclass(frozen=True)
class Config:
    """A checked configuration."""

    name: str
    model: str
    parameters: dict[str, Values]
    """The parameters of the model, in the order of the axes."""
    integrator: Integrator
    measure: tuple[str, ...]
    """Specs of measurements, as `sweep.kernels.measures.chosen` takes them."""
    max_failed_fraction: float
    picture: tuple[str, ...] = ()
    """Variables to draw, as `sweep.plots.quantities.field` takes them; empty for the first measured variables."""
    repeats: bool = True
    """Whether cells whose error exceeds the tolerance are run again with shorter steps."""
    cases: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Columns of the table of cases or of the samples, if there is one."""
    cases_file: str | None = None
    """The file of that table; "" if the configuration itself gives the columns, None without a table."""
    samples: int | None = None
    """Number of samples drawn from the distributions, if there are any."""
    seed: int = 0
    units: str = PAPER_UNITS
    law: str = PAPER_LAW
    """Name of the law of friction, as in `sweep.models.general.laws.LAWS`."""
    surface: str = ELLIPSOID.name
    """Name of the surface, as in `sweep.models.general.surfaces.SURFACES`."""
    assembly: Assembly = NOTHING
    """What the body is made of."""
    origin: Origin | None = None
    """Origin of the model, if it is user-defined."""
    source: Document | None = field(default=None, init=False, compare=False, repr=False)
    """The document it was made from, so that single values can be replaced; None in a copy with other values."""

    def __repr__(self) -> str:
        return f"<Config {self.name}>\n{self.label()}"

    def _repr_html_(self) -> str:
        """Return the table that a notebook shows: parameters, values, meanings and units."""
        rows = []
        for name, value in self.parameters.items():
            ends = " … ".join(f"{v:g}" for v in (value.numbers[0], value.numbers[-1])[: 1 + value.is_axis])
            words = [ends, f"{len(value.numbers)} values" if value.is_axis else "", self.described(name)["long_name"],
                     self.described(name).get("units", "")]  # fmt: skip
            rows.append(f"<tr><th>{escape(name)}{''.join(f'<td>{escape(word)}' for word in words)}")
        return f"<table><caption>{escape(self.name)}: {escape(self.model)}</caption>{''.join(rows)}</table>"

    def error(self, at: Path | str, message: str) -> InputError:
        """Return the error for a fault at the key `at`, or at a parameter, with its place in the file if known."""
        path = self.table[at].place if isinstance(at, str) else at
        return InputError([(self.source or Document("")).fault(path, message, at_key=True)])

    @property
    def row(self) -> str:
        """The meaning of a row of `cases`."""
        return SAMPLE if self.samples else CASE

    @property
    def distributions(self) -> dict[str, Distribution]:
        """The distributions of the uncertain parameters."""
        return {name: value.distribution for name, value in self.parameters.items() if value.distribution}

    @property
    def at_medians(self) -> Config:
        """Return a copy with the median in place of each distribution."""
        if not self.samples:
            return self
        medians = {name: Values.one(known.median) for name, known in self.distributions.items()}
        return replace(self, parameters=self.parameters | medians, cases={}, samples=None)

    @property
    def axes(self) -> dict[str, tuple[float, ...]]:
        return {name: v.numbers for name, v in self.parameters.items() if v.is_axis}

    @property
    def grid(self) -> Grid:
        """The grid of all cells."""
        single = {name: v.numbers[0] for name, v in self.parameters.items() if not v.is_axis and name not in self.cases}
        axes, table = ({name: np.array(v) for name, v in each.items()} for each in (self.axes, self.cases))
        return Grid(axes, single, table, self.row, self.assembly.body)

    @property
    def tier(self) -> Tier:
        """The model that is run."""
        names = frozenset((*present(self.parameters), *self.cases))
        law = self.own_law or laws.LAWS[self.law]
        physics = Physics(self.units, law, SURFACES[self.surface], names, self.assembly)
        return model_of(self.model, self.origin, physics)

    @property
    def simulated(self) -> bool:
        """Return whether the model is simulated; formulas and the slow equations are evaluated."""
        return isinstance(self.tier, Model)

    @property
    def by_count(self) -> bool:
        """Whether each cell is integrated only as exactly as its count needs (`tolerance: auto`)."""
        how, kinds = self.integrator, measures.chosen(self.measure)
        margins = any(kind.name == Margin.name for kind in kinds) and not any(kind.exact for kind in kinds)
        repeats = self.repeats and how.estimate_errors and how.step == AUTO
        ends = how.settles and Offer.LINEAR in self.tier.offers
        return margins and ends and repeats and how.tolerance == AUTO

    @property
    def tolerance(self) -> float:
        """The tolerance with which cells begin, and with which they end unless a count needs a finer one."""
        return COARSEST if self.by_count else self.integrator.tolerance_number

    @property
    def own_law(self) -> laws.Law | None:
        """The user-defined law of friction of a rattleback, if there is one."""
        return loading.law(self.origin) if self.origin else None

    @property
    def of_rattlebacks(self) -> bool:
        """True if the bodies roll on a plane; a user-defined model may describe anything."""
        return not self.origin or self.own_law is not None

    @property
    def table(self) -> Mapping[str, Parameter]:
        """The parameters that the configuration may name."""
        return loading.table(self.origin)

    @property
    def equations(self) -> Model:
        """Return the model of a configuration that is simulated."""
        assert isinstance(self.tier, Model)
        return self.tier

    def described(self, name: str) -> dict[str, str]:
        """The CF attributes of a physical parameter, and its distribution if it has one."""
        parameter = self.table[name]
        known = {"distribution": found.words} if (found := self.distributions.get(name)) else {}
        if name in (self.own_law or laws.LAWS[self.law]).pure:
            parameter = replace(parameter, units=NUMBER, description="Coefficient of friction.")
        parameter = replace(parameter, **SURFACES[self.surface].meanings.get(name, {}))
        return {**attributes(parameter, self.units), **known}

    def unitless(self, name: str, written: str) -> str:
        """Say why a parameter, or a time of the integrator, cannot have the unit `written`; return "" if it can."""
        own = self.described(name).get("units", "") if name in self.table else named(TIME, self.units)
        if not own:
            return f"is a pure number here; leave out {written}"
        if self.units == SI:
            units = self.table[name].units if name in self.table else TIME
            return f"is in {own} here, not in {written}" if written == named(units, PAPER_UNITS) else ""
        return "" if written == own else f"is in {own} here; give the number without {written}, or set units: SI"

    def document(self) -> dict[str, Any]:
        """Return the whole configuration, including defaults, as plain data."""
        table = self.table
        # Keep the order of axes and samples, so that reading the document again gives the same.
        varying = [name for name, value in self.parameters.items() if value.is_axis or value.distribution]
        kept = [name for name in varying if name not in FIRST_AXES or name in self.distributions]
        written = [table[name].place[0] for name in kept]
        found: dict[str, Any] = {key: {} for key in (*written, *sections(table))}
        top = {"units": self.units} if self.units != PAPER_UNITS and self.of_rattlebacks else {}
        if self.law != PAPER_LAW and not self.origin:
            found["friction"] |= {"law": self.law}
        if self.surface != ELLIPSOID.name:
            found["body"] |= {"surface": self.surface}
        if spec := self.assembly.spec:
            found["body"] |= spec
        for name, value in self.parameters.items():
            if section := table[name].section:
                found[section][name] = value.spec
            else:
                found[name] = value.spec
        columns = {} if self.samples else {name: list(column) for name, column in self.cases.items()}
        return {
            "name": self.name,
            "model": self.model,
            **top,
            **({"cases": self.cases_file or columns} if columns else {}),
            **({"samples": self.samples, "seed": self.seed} if self.samples else {}),
            **{key: values for key, values in found.items() if values != {}},
            "integrator": self.integrator.model_dump(),
            "measure": [{name: int(n)} if n else name for name, _, n in (m.partition("=") for m in self.measure)],
            **({"picture": list(self.picture)} if self.picture else {}),
            "max_failed_fraction": self.max_failed_fraction,
        }

    def label(self) -> str:
        """Return the configuration as YAML, without the columns of a table of cases that it gives itself.

        A dataset has them as coordinates, and a long table would take half a minute to write and to read as YAML.
        """
        found = self.document()
        if isinstance(found.get("cases"), dict):
            found["cases"] = "coordinates of the dimension case"
        return dump(found)

    def fingerprint(self) -> str:
        """Return a hash of everything that determines the numbers, unlike the name or the pictures."""
        decisive = self.document()
        # The content of a model file counts, and not its location.
        for key in ("name", "max_failed_fraction", "picture", "cases", *(["model"] if self.origin else [])):
            decisive.pop(key, None)
        digest = [self.origin.digest] if self.origin else []
        text = json.dumps([decisive, list(self.axes), self.cases or None, *digest], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]
