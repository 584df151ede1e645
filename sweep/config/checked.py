"""A checked configuration: everything below trusts it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.compat import StringIO

from sweep.config.document import Document
from sweep.config.faults import Fault, Path
from sweep.config.schema import LATEST, T_END, Integrator
from sweep.config.values import Values
from sweep.kernels.kernel import STRETCH
from sweep.models import TIERS
from sweep.models.general import laws
from sweep.models.general.selection import PAPER, PAPER_LAW, SI, is_papers, variant
from sweep.models.general.surfaces import ELLIPSOID, PARABOLOID
from sweep.models.general.variants import BASES
from sweep.models.model import Model, Tier
from sweep.models.origin import Origin
from sweep.models.user import loading
from sweep.parameters import ON_PARABOLOID, Parameter, sections
from sweep.variables import in_si

# Maps are drawn with μ down, b across and one panel per n0.  Other axes follow in the order of the configuration.
FIRST_AXES = ("mu", "b", "n0")


def tier_of(model: str, law: str, units: str, names: Collection[str], surface: str = ELLIPSOID.name) -> Tier:
    """The model of a configuration that names these parameters."""
    if model not in BASES or is_papers(law, units, names, surface):
        return TIERS[model]
    return variant(model, law, units, names, surface)


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
    verify: float = 0.0
    refine: int = 0
    cases: dict[str, tuple[float, ...]] | None = None
    """Columns of the table of cases, if there is one."""
    cases_file: str | None = None
    units: str = PAPER
    law: str = PAPER_LAW
    """Name of the law of friction, as in `sweep.models.general.laws.LAWS`."""
    surface: str = ELLIPSOID.name
    """Name of the surface, as in `sweep.models.general.surfaces.SURFACES`."""
    origin: Origin | None = None
    """Where the model comes from, if a user brings it."""
    source: Document | None = field(default=None, init=False, compare=False, repr=False)
    """What it was made from, so that single values can be replaced; a copy with other values has none."""

    def fault(self, path: Path, message: str) -> Fault:
        """A fault at `path`, with the place where the user can correct it if that is known."""
        return (self.source or Document("")).fault(path, message)

    @property
    def axes(self) -> dict[str, tuple[float, ...]]:
        return {name: v.numbers for name, v in self.parameters.items() if v.is_axis}

    @property
    def tier(self) -> Tier:
        """The model that runs it: that of its name, or a variant for what the paper's model does not know."""
        names = (*self.parameters, *(self.cases or ()))
        if self.origin:
            return loading.find(self.origin, self.units, names, self.surface)
        return tier_of(self.model, self.law, self.units, names, self.surface)

    @property
    def simulated(self) -> bool:
        """Whether the model is simulated rather than a formula."""
        return isinstance(self.tier, Model)

    @property
    def own_law(self) -> laws.Law | None:
        """The law of friction that a user brings for a rattleback."""
        return loading.law(self.origin) if self.origin else None

    @property
    def of_rattlebacks(self) -> bool:
        """Whether its bodies are ellipsoids on a plane; a user's model may be of anything else."""
        return not self.origin or self.own_law is not None

    @property
    def table(self) -> Mapping[str, Parameter]:
        """The parameters that it may name."""
        return loading.table(self.origin)

    @property
    def equations(self) -> Model:
        """The model of a configuration that is simulated."""
        assert isinstance(self.tier, Model)
        return self.tier

    def with_time(self) -> Config:
        """The same with a `t_end` in seconds for bodies in SI, which have given none."""
        columns = {name: value.numbers for name, value in self.parameters.items()} | (self.cases or {})
        longest = min(T_END * math.sqrt(max(columns["c"]) / min(columns["gravity"])), LATEST)
        # In whole stretches, so that steps do not depend on it (`sweep.kernels.kernel.STRETCH`).
        t_end = STRETCH * math.ceil(longest / STRETCH)
        return replace(self, integrator=self.integrator.model_copy(update={"t_end": t_end}))

    def described(self, name: str) -> dict[str, str]:
        """The CF attributes of a physical parameter."""
        parameter = self.table[name]
        if name in (self.own_law or laws.LAWS[self.law]).pure:
            return {"long_name": "coefficient of friction", "units": "1"}
        units, long_name = parameter.units, parameter.long_name
        if self.surface == PARABOLOID.name:
            long_name = ON_PARABOLOID.get(name, long_name)
        if self.units == SI:
            units, long_name = in_si(units, long_name)
        return {"long_name": long_name, "units": units}

    def document(self) -> dict[str, Any]:
        """The whole configuration, defaults included, as plain data."""
        table = self.table
        written = [table[name].section for name in self.axes if name not in FIRST_AXES]
        # In the order of the axes, so that they keep it when the document is read again.
        found: dict[str, dict[str, Any]] = {section: {} for section in (*written, *sections(table)) if section}
        top: dict[str, Any] = {"model_sha256": self.origin.digest} if self.origin else {}
        if self.units != PAPER and self.of_rattlebacks:
            top["units"] = self.units
        if self.law != PAPER_LAW and not self.origin:
            law, _, regularisation = self.law.partition("-")
            found["friction"] |= {"law": law} | ({"regularisation": regularisation} if regularisation else {})
        if self.surface != ELLIPSOID.name:
            found["body"] |= {"surface": self.surface}
        for name, value in self.parameters.items():
            found.get(table[name].section, top)[name] = value.spec
        return {
            "name": self.name,
            "model": self.model,
            **top,
            **({"cases": self.cases_file} if self.cases_file else {}),
            **{section: values for section, values in found.items() if values},
            "integrator": self.integrator.model_dump(),
            "measure": [_written(spec) for spec in self.measure],
            "verify": self.verify,
            "refine": self.refine,
            "max_failed_fraction": self.max_failed_fraction,
        }

    def to_yaml(self) -> str:
        return self._yaml

    @cached_property
    def _yaml(self) -> str:
        stream = StringIO()
        yaml = YAML(typ="safe", pure=True)
        yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
        yaml.dump(self.document(), stream)
        return stream.getvalue()

    def fingerprint(self) -> str:
        """Hash of everything that determines the numbers: not the name, nor how many failures are accepted."""
        decisive = self.document()
        # What the file of a model says, which its SHA-256 tells, not where it lies.
        for key in ("name", "max_failed_fraction", "cases", *(["model"] if self.origin else [])):
            decisive.pop(key, None)
        text = json.dumps([decisive, list(self.axes), self.cases], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def _written(spec: str) -> str | dict[str, int]:
    """The spec of a measurement in the form in which a configuration gives it."""
    name, _, setting = spec.partition("=")
    return {name: int(setting)} if setting else name
