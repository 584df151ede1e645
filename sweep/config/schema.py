"""The schema of a configuration.  Input is checked and normalised here, and trusted from then on."""

from __future__ import annotations

import hashlib
import json
import math
import re
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError
from ruamel.yaml import YAML
from ruamel.yaml.compat import StringIO

from sweep.config.document import Document, number
from sweep.config.faults import ConfigError, Fault, Path, quote, suggestion
from sweep.config.messages import Allowed, describe, refusal, wrong
from sweep.config.plain import plain
from sweep.kernels.kernel import STRETCH
from sweep.kernels.measures import MEASURES
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import AUTO, METHODS
from sweep.models import TIERS, laws, outside
from sweep.models.general import BASES
from sweep.models.model import Model, Tier
from sweep.models.origin import Origin
from sweep.models.scene import PAPER, PAPERS_LAW, SI, is_papers, variant
from sweep.models.surfaces import ELLIPSOID, PARABOLOID, SURFACES
from sweep.parameters import ON_PARABOLOID, PARAMETERS, Parameter, sections
from sweep.variables import in_si

# Maps are drawn with μ down, b across and one panel per n0.  Other axes follow in the order of the configuration.
FIRST_AXES = ("mu", "b", "n0")

MAX_CELLS = 1_000_000_000
MAX_REFINED_CELLS = 2**24
"""Most cells of a refined run, which holds all its arrays in memory."""
MAX_AXIS = 1_000_000
"""Most values of one axis and most rows of a table of cases: they are held in memory as Python numbers."""
MAX_STEPS = 1e15


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


def _whole(raw: Any) -> Any:
    """1e3 as 1000."""
    return int(raw) if isinstance(raw, float) and raw.is_integer() else raw


Whole = Annotated[int, BeforeValidator(_whole)]
"""A whole number, however it is written."""


class Range(_Strict):
    start: float
    stop: float
    num: Whole = Field(ge=1, le=MAX_AXIS)
    spacing: Literal["linear", "log"] = "linear"

    def values(self) -> list[float]:
        if self.spacing == "linear":
            return _divided(self.start, self.stop, self.num)
        if np.sign(self.start) * np.sign(self.stop) <= 0:
            raise wrong("a log range needs start and stop of one sign, both not zero", "spacing")
        logs = _divided(math.log10(abs(self.start)), math.log10(abs(self.stop)), self.num)
        inside = [math.copysign(10.0**log, self.start) for log in logs[1:-1]]
        return [self.start, *inside, self.stop][: self.num]


def _divided(start: float, stop: float, num: int) -> list[float]:
    """Equally spaced numbers, each rounded once, so that a finer division has all numbers of a coarser one."""
    if num == 1:
        return [start]
    (p, q), (r, s) = start.as_integer_ratio(), stop.as_integer_ratio()
    whole, from_start, each = q * s * (num - 1), p * s * (num - 1), r * q - p * s
    return [(from_start + i * each) / whole for i in range(num)]


@dataclass(frozen=True)
class Values:
    """A parameter's checked value: one number, or an axis of distinct numbers."""

    numbers: tuple[float, ...]
    is_axis: bool
    spec: float | list[float] | dict[str, Any]
    """The value as it stands in the configuration."""


_DEGREES = re.compile(r"\s*(\S+)\s+deg\s*")


def _in_radians(raw: Any) -> Any:
    """`raw` with "0.5 deg" as a number of radians, also in a list or a range."""
    if isinstance(raw, list):
        return [_in_radians(item) for item in raw]
    if isinstance(raw, dict):
        return {key: _in_radians(item) for key, item in raw.items()}
    spelled = _DEGREES.fullmatch(raw) if isinstance(raw, str) else None
    degrees = number(spelled[1]) if spelled else None
    return raw if degrees is None else math.radians(degrees)


def _parse_values(parameter: Parameter, raw: Any) -> Values:
    if parameter.units == "radian":
        raw = _in_radians(raw)
    spec: Any = raw
    if isinstance(raw, dict):
        try:
            span = Range.model_validate(raw)
        except ValidationError as error:
            # An unknown key first: it tells why another is missing.
            path, message, _ = max(describe(error.errors(), Range), key=lambda found: found[2])
            raise wrong(message, *path) from None
        numbers, spec = span.values(), span.model_dump()
    elif isinstance(raw, list):
        if not raw:
            raise wrong("an empty axis; allowed: one number or more")
        for i, item in enumerate(raw):
            _check_number(item, parameter, i)
        numbers = spec = [float(item) for item in raw]
    else:
        _check_number(raw, parameter)
        return Values((float(raw),), False, float(raw))
    for value in numbers:
        if not parameter.allows(value):
            raise wrong(f"{value:g} is out of bounds; allowed: {parameter.allowed}")
    if len(set(numbers)) < len(numbers):
        raise wrong("an axis with equal values; allowed: distinct numbers")
    return Values(tuple(numbers), True, spec)


def numbers_of(parameter: Parameter, raw: Any) -> tuple[float, ...]:
    """The numbers that `raw`, a number or an axis, gives to a parameter; a `ConfigError` names the parameter."""
    try:
        return _parse_values(parameter, plain(raw)).numbers
    except PydanticCustomError as error:
        context = error.context or {}
        raise ConfigError([Fault("", None, None, (parameter.name, *context["at"]), context["reason"])]) from None


def _check_number(raw: Any, parameter: Parameter, *at: int) -> None:
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise wrong(
            f"{quote(raw)} is not a number; allowed: {parameter.allowed}"
            + ("" if at else ", a list of such, or {start, stop, num, spacing: linear|log}"),
            *at,
        )
    if not (abs(raw) <= sys.float_info.max and parameter.allows(raw)):
        raise wrong(f"{quote(raw)} is out of bounds; allowed: {parameter.allowed}", *at)


_STEP = Allowed("auto, or a finite number > 0 in sqrt(c/g)")
_MEASURE = Allowed(f"a list of {', '.join(MEASURES)}")


def _step(raw: Any) -> Any:
    if raw == "auto" or (isinstance(raw, int | float) and not isinstance(raw, bool) and 0 < raw <= sys.float_info.max):
        return raw
    raise wrong(refusal(raw, _STEP.words, ["auto"]))


def _measures(raw: Any) -> Any:
    """Specs of the measurements: "reversals" for `reversals`, "reversal_times=12" for `{reversal_times: 12}`."""
    if raw is None:
        return raw
    if not isinstance(raw, list):
        raise wrong(refusal(raw, _MEASURE.words))
    specs = [_measure(item, i) for i, item in enumerate(raw)]
    if len({spec.partition("=")[0] for spec in specs}) < len(specs):
        raise wrong("a name twice; allowed: each once")
    return specs


def _measure(raw: Any, i: int) -> str:
    name, setting = next(iter(raw.items())) if isinstance(raw, dict) and len(raw) == 1 else (raw, None)
    if not isinstance(name, str) or name not in MEASURES:
        meant = suggestion(name, MEASURES)
        raise wrong(f"{quote(raw)} is not a measurement{meant}; allowed: {', '.join(MEASURES)}", i)
    kind = MEASURES[name]
    if not isinstance(raw, dict):
        return kind().spec
    if kind.bounds is None:
        raise wrong(f"{name} has no setting; allowed: {name}", i)
    low, high = kind.bounds
    setting = _whole(setting)
    if isinstance(setting, bool) or not isinstance(setting, int) or not low <= setting <= high:
        raise wrong(f"{quote(setting)}; allowed: a whole number from {low} to {high}", i, name)
    return kind(setting).spec  # type: ignore[call-arg]


VERIFIED = 0.002
"""Share of the cells that are run again unasked, in runs of so many cells that it amounts to one."""

FOREVER = 1e7
"""What `t_end: .inf` stands for, in sqrt(c/g): longer than any rattleback spins.  A trajectory that has not settled by
then has the status `time_limit` all the same."""

T_END = 30_000.0
"""Default of `t_end`, in sqrt(c/g); what that is in seconds says `Config.with_time`."""

LATEST = 1e12
"""Largest `t_end`, in sqrt(c/g)."""


class Integrator(_Strict):
    method: Literal[(*METHODS, AUTO)] = Field(  # type: ignore[valid-type]
        default=AUTO, description="integration method; `auto` chooses the faster one for each cell"
    )
    """`auto` takes, for each cell, the method that reaches `t_end` within `tolerance` in the least time.  With a number
    for `step`, and for a model that only one method can integrate, that is the default."""
    step: Annotated[float | Literal["auto"], BeforeValidator(_step), _STEP] = Field(
        default="auto", description="fixed step in sqrt(c/g), or `auto`"
    )
    tolerance: float = Field(
        default=TOLERANCE, ge=1e-14, lt=1,
        description="error in spin at t = 400, in sqrt(g/c), that an automatic step is chosen to keep",
    )  # fmt: skip
    t_end: Annotated[
        float,
        BeforeValidator(lambda raw: FOREVER if isinstance(raw, float) and raw == math.inf else raw),
        Allowed(f"a number > 0 and <= {LATEST:g}, or .inf"),
    ] = Field(
        default=T_END, gt=0, le=LATEST,
        description=f"time at which a trajectory ends that has not settled, in sqrt(c/g); `.inf` means {FOREVER:g}; "
        f"with `units: SI` in s, by default {T_END:g} sqrt(c/g) of the largest c and the least gravity, rounded up to "
        "hundreds",
    )  # fmt: skip
    stop_when_settled: bool = Field(
        default=True, description="whether a trajectory ends when neither spin nor count can change any more"
    )


def _physical(section: str, table: Mapping[str, Parameter]) -> dict[str, Any]:
    """The fields of the physical parameters in a section, made from a table of parameters."""
    return {
        p.name: (
            Annotated[Any, BeforeValidator(lambda raw, p=p: _parse_values(p, raw)), Field(description=p.long_name)],
            None,
        )
        for p in table.values()
        if p.section == section
    }


class _Words(_Strict):
    """What a section has beside physical parameters: of most, nothing."""


class Law(_Words):
    law: Literal["viscous", "coulomb", "stribeck", "contensou", "none"] = Field(
        default="viscous", description="law of slip friction"
    )
    regularisation: Literal["sqrt", "tanh", "cubic"] = Field(
        default="sqrt", description="how Coulomb friction passes through zero slip, within `speed`"
    )

    @property
    def name(self) -> str:
        """As in `sweep.models.laws.LAWS`."""
        return f"{self.law}-{self.regularisation}" if self.law == "coulomb" else self.law


class Shape(_Words):
    surface: Literal[tuple(SURFACES)] = Field(  # type: ignore[valid-type]
        default=ELLIPSOID.name, description="surface of the body, which says what `a`, `b` and `c` mean"
    )


_WORDS: dict[str, type[_Words]] = {"body": Shape, "friction": Law}


class _Top(_Strict):
    name: Annotated[str, Allowed("up to 100 of A-Z, a-z, 0-9, '.', '_', '-', the first a letter or digit")] = Field(
        default="", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$",
        description="name of the run and of its files; by default that of the configuration file",
    )  # fmt: skip
    model: Annotated[
        Literal[tuple(TIERS)],  # type: ignore[valid-type]
        Allowed(f"{', '.join(TIERS)}, a Python file such as my_model.py, or an entry point of a package"),
    ] = Field(default="slip", description="which model to integrate; the code of a file or a package is run")
    model_sha256: Annotated[str | None, Allowed("64 hexadecimal digits")] = Field(
        default=None, pattern="^[0-9a-f]{64}$",
        description="SHA-256 that the file or the package of `model` has to have; a dataset tells its own",
    )  # fmt: skip
    units: Literal[PAPER, SI] = Field(  # type: ignore[valid-type]
        default=PAPER, description="lengths in c, times in sqrt(c/g) and mass 1, or SI"
    )
    cases: Annotated[str | None, Allowed("the name of a CSV file")] = Field(
        default=None,
        description="CSV table with a column for each parameter and a row for each trajectory, instead of axes",
    )
    integrator: Integrator = Integrator()
    measure: Annotated[list[str] | None, BeforeValidator(_measures), _MEASURE] = Field(
        default=None, description="what to compute; by default the measurements marked so that the model supports"
    )
    verify: float | None = Field(
        default=None, ge=0, le=1,
        description=f"share of the cells, drawn at random, to run again with the plain method at half its step; by "
        f"default {VERIFIED:g} with `method: auto` where that is a cell or more and nothing is inferred, else 0",
    )  # fmt: skip
    refine: Whole = Field(
        default=0, ge=0, le=MAX_REFINED_CELLS.bit_length() - 1,
        description="the largest blocks of cells whose inside is inferred from their sides have 2^refine cells a side; "
        "0 simulates every cell",
    )  # fmt: skip
    max_failed_fraction: float = Field(
        default=0.01, ge=0, le=1, description="share of failed cells beyond which the command exits with 3"
    )


def _section(name: str, table: Mapping[str, Parameter], words: type[_Words]) -> tuple[Any, Any]:
    made: Any = create_model(name.capitalize(), __base__=words, **_physical(name, table))
    return made, Field(default_factory=made)


@cache
def schema_of(origin: Origin | None) -> Any:
    """The schema of the configurations of a user's model, or, without one, of the models of this package."""
    table = outside.table(origin)
    words = _WORDS if not origin else {"body": Shape} if outside.law(origin) else {}
    found: dict[str, Any] = {name: _section(name, table, words.get(name, _Words)) for name in sections(table)}
    if origin:
        found["model"] = str, ...
    return create_model("Configuration", __base__=_Top, **_physical("", table), **found)


Schema: Any = schema_of(None)

SETTINGS: dict[str, FieldInfo] = {name: field for name, field in _Top.model_fields.items() if name != "integrator"}
for _name, _words in _WORDS.items():
    SETTINGS |= {f"{_name}.{name}": field for name, field in _words.model_fields.items()}
SETTINGS |= {f"integrator.{name}": field for name, field in Integrator.model_fields.items()}
"""All values of a configuration but the physical parameters, by path; the `description` of each says what it means."""

PATHS: dict[str, str] = {p.path: p.long_name for p in PARAMETERS.values()}
PATHS |= {path: str(field.description) for path, field in SETTINGS.items()}
"""The path of every value of a configuration, and what it means."""


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
    law: str = PAPERS_LAW
    """Name of the law of friction, as in `sweep.models.laws.LAWS`."""
    surface: str = ELLIPSOID.name
    """Name of the surface, as in `sweep.models.surfaces.SURFACES`."""
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
            return outside.find(self.origin, self.units, names, self.surface)
        return tier_of(self.model, self.law, self.units, names, self.surface)

    @property
    def simulated(self) -> bool:
        """Whether the model is simulated rather than a formula."""
        return isinstance(self.tier, Model)

    @property
    def own_law(self) -> laws.Law | None:
        """The law of friction that a user brings for a rattleback."""
        return outside.law(self.origin) if self.origin else None

    @property
    def of_rattlebacks(self) -> bool:
        """Whether its bodies are ellipsoids on a plane; a user's model may be of anything else."""
        return not self.origin or self.own_law is not None

    @property
    def table(self) -> Mapping[str, Parameter]:
        """The parameters that it may name."""
        return outside.table(self.origin)

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
        if self.law != PAPERS_LAW and not self.origin:
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
