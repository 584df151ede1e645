"""Defines the schema of a configuration. Input is checked and normalised here, and trusted from then on."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, create_model, model_validator
from pydantic.fields import FieldInfo

from sweep.config.document import is_number
from sweep.config.messages import Allowed, wrong
from sweep.config.values import MAX_AXIS, Strict, Whole, check_number, in_si, parse_values, whole
from sweep.faults import either, refusal
from sweep.kernels.measures import MEASURES
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import AUTO, METHODS
from sweep.models import TIERS
from sweep.models.general.laws import LAWS
from sweep.models.general.solids import SOLIDS, Shape
from sweep.models.general.surfaces import ELLIPSOID, SURFACES
from sweep.models.origin import Origin
from sweep.models.user import loading
from sweep.models.variants import PAPER_LAW
from sweep.parameters import PARAMETERS, Parameter, sections
from sweep.units import LENGTH, MASS, PAPER_UNITS, SI, TIME


def _measures(raw: Any) -> Any:
    """Return the specs of the measurements: "reversal_times=12" for `{reversal_times: 12}`."""
    if not isinstance(raw, list):
        return raw
    specs = [_measure(item, i) for i, item in enumerate(raw)]
    if len({spec.partition("=")[0] for spec in specs}) < len(specs):
        raise wrong("duplicate measurement; name each once")
    return specs


def _measure(raw: Any, i: int) -> str:
    name, setting = next(iter(raw.items())) if isinstance(raw, dict) and len(raw) == 1 else (raw, None)
    if not isinstance(name, str) or name not in MEASURES:
        raise wrong(refusal(name, either(MEASURES), MEASURES), i)
    kind = MEASURES[name]
    if not isinstance(raw, dict):
        return kind().spec
    if kind.bounds is None:
        raise wrong(f"{name} has no settings; write only the name", i)
    low, high = kind.bounds
    setting = whole(setting)
    if type(setting) is not int or not low <= setting <= high:
        raise wrong(refusal(setting, f"a whole number from {low} to {high}"), i, name)
    return kind(setting).spec  # type: ignore[call-arg]


def _each_once(raw: Any) -> Any:
    for i, name in enumerate(raw if isinstance(raw, list) else []):
        if name in raw[:i]:
            raise wrong(f"{name} appears twice; name each once", i)
    return raw


SAMPLES = 1024
"""Default of `samples`."""

FOREVER = 1e7
"""Value of `t_end: settled`, in the unit of time: longer than any rattleback spins. A trajectory that has not settled
by then has the status `time_limit`."""

T_END = 30_000.0
"""Default of `t_end`, or of `stop_early` where `t_end` is `LATER`, in sqrt(c/g); in SI converted with the body's c."""

LATER = 1e6
"""Default of `t_end` where further reversals can be predicted and `stop_early` is a time."""

_SETTLED = "settled"

EARLIEST, LATEST = 1e-6, 1e12
"""Smallest and largest `t_end`, in sqrt(c/g)."""

MAX_CELLS_IN_MEMORY = 2**24
"""Most cells of a sampled run, which holds all its arrays in memory."""


def _in_si(raw: Any) -> Any:
    """Return a time such as "2 min" in s."""
    return in_si(TIME, raw)[0]


class Integrator(Strict):
    method: Literal[(*METHODS, AUTO)] = Field(  # type: ignore[valid-type]
        default=AUTO, description="integration method; `auto` chooses the faster one for each cell"
    )
    """`auto` takes, for each cell, the method that reaches `t_end` within `tolerance` in the least time. It is the
    default unless `step` is a number or the model supports only one method."""
    step: Annotated[
        Annotated[float, Field(gt=0)] | Literal["auto"], BeforeValidator(_in_si), Allowed("auto or a finite number > 0")
    ] = Field(default="auto", description="fixed step in sqrt(c/g) or, with `units: SI`, in s; or `auto`")
    tolerance: Annotated[
        Annotated[float, Field(ge=1e-14, lt=1)] | Literal["auto"], Allowed("auto or a finite number >= 1e-14 and < 1")
    ] = Field(
        default="auto",
        description="permitted error in spin at t = 400, in sqrt(g/c), which sets automatic steps; or `auto`: as small "
        f"as each count needs to be certain, or {TOLERANCE:g} if other things than counts, margins, energy errors and "
        "resting spins are measured, or if no trajectory may settle",
    )
    estimate_errors: bool = Field(
        default=True,
        description="whether each cell is run a second time, with longer steps, to estimate its error; cells above "
        "`tolerance` are then repeated with shorter steps, unless `step` is a number",
    )
    t_end: Annotated[
        float,
        BeforeValidator(lambda raw: FOREVER if raw == _SETTLED else _in_si(raw)),
        Allowed(f"{_SETTLED} or a number >= {EARLIEST:g} and <= {LATEST:g}"),
    ] = Field(
        default=T_END, ge=EARLIEST, le=LATEST,
        description="time at which every trajectory ends, in sqrt(c/g) or, with `units: SI`, in s; or `settled`: no "
        f"limit but {FOREVER:g}. The default is in the table below",
    )  # fmt: skip
    stop_early: Annotated[
        bool | Annotated[float, Field(gt=0)], BeforeValidator(_in_si), Allowed("true, false or a finite number > 0")
    ] = Field(
        default=True,
        description="whether a trajectory ends before `t_end` once its count is final; or a time at which the others "
        "end too, unless their end can be predicted: see the table below",
    )

    @model_validator(mode="before")
    @classmethod
    def _ends(cls, raw: Any) -> Any:
        if isinstance(raw, dict) and raw.get("t_end") == _SETTLED and raw.get("stop_early") is False:
            raise wrong(f"{_SETTLED} needs stop_early, which is false; give a time", "t_end")
        return raw

    @property
    def settles(self) -> bool:
        """Whether a trajectory ends once spin and count can no longer change."""
        return self.stop_early is not False

    @property
    def tolerance_number(self) -> float:
        """The tolerance; where it is `auto`, the one of whatever is not a count."""
        return TOLERANCE if isinstance(self.tolerance, str) else self.tolerance

    @property
    def first_leg(self) -> float | None:
        """The time after which only those trajectories go on whose end can be predicted; None for all."""
        return None if isinstance(self.stop_early, bool) else self.stop_early

    @property
    def in_one_leg(self) -> Integrator:
        """Return the same settings for dense trajectories and searches, which end after the first leg."""
        t_end = min(self.t_end, self.first_leg or self.t_end)
        return self.model_copy(update={"t_end": t_end, "stop_early": self.settles})


def _physical(section: str, table: Mapping[str, Parameter]) -> dict[str, Any]:
    """Return the fields of the physical parameters in a section, made from a table of parameters."""
    return {
        p.name: (
            Annotated[Any, BeforeValidator(lambda raw, p=p: parse_values(p, raw)), Field(description=p.long_name)],
            None,
        )
        for p in table.values()
        if p.section == section
    }


_SOLID = f"{either(SOLIDS)}, or the numbers that `sweep body --stl` prints"


def _solid(raw: Any) -> Any:
    """Return a solid whose sizes are parameters, by its name or by the numbers of a `Shape`."""
    if isinstance(raw, dict) and [*raw] == [*Shape.names]:
        parameters = (PARAMETERS.get(name.replace("J", "I"), PARAMETERS["mass"]) for name in raw)
        if all(is_number(each) and p.allows(each) for each, p in zip(raw.values(), parameters, strict=True)):
            return Shape(tuple(map(float, raw.values())))
    if raw not in [*SOLIDS]:
        raise wrong(refusal(raw, _SOLID, SOLIDS))
    return SOLIDS[raw]


_WEIGHT = "a mass and a place such as {mass: 5 g, at: [4 cm, 1 cm, 0.5 cm]}"


def _weights(raw: Any) -> Any:
    """Return mass and place of each weight, in SI."""
    if not isinstance(raw, list):
        raise wrong(refusal(raw, f"a list of weights, each {_WEIGHT}"))
    return tuple(_weight(each, i) for i, each in enumerate(raw))


def _weight(raw: Any, i: int) -> tuple[float, ...]:
    if not isinstance(raw, dict) or raw.keys() != {"mass", "at"}:
        raise wrong(refusal(raw, _WEIGHT), i)
    if not isinstance(raw["at"], list) or len(raw["at"]) != 3:
        raise wrong(refusal(raw["at"], "three lengths, along a, along b and down"), i, "at")
    (mass, _), (at, _) = in_si(MASS, raw["mass"]), in_si(LENGTH, raw["at"])
    check_number(mass, PARAMETERS["mass"], i, "mass")
    for j, each in enumerate(at):
        check_number(each, PARAMETERS["offset"], i, "at", j)
    return tuple(map(float, (mass, *at)))


class Friction(Strict):
    law: Literal[tuple(LAWS)] = Field(default=PAPER_LAW, description="law of slip friction")  # type: ignore[valid-type]


class Body(Strict):
    surface: Literal[tuple(SURFACES)] = Field(  # type: ignore[valid-type]
        default=ELLIPSOID.name, description="surface of the body, which defines the meaning of `a`, `b` and `c`"
    )
    solid: Annotated[Any, BeforeValidator(_solid), Allowed(_SOLID)] = Field(
        default=None, description="homogeneous solid whose sizes determine surface and inertia of the body"
    )
    weights: Annotated[Any, BeforeValidator(_weights), Allowed("a list of weights")] = Field(
        default=(),
        description="weights on the body, each with its mass and its place along `a`, along `b` and down, from the "
        "centre of the ellipsoid",
    )


_WORDS: dict[str, type[Strict]] = {"body": Body, "friction": Friction}
"""The keys of sections besides physical parameters."""


class _Top(Strict):
    name: Annotated[
        str, Allowed("up to 100 letters, digits, '.', '_' or '-', not '.', '_' or '-' first, in quotes if a number")
    ] = Field(
        default="", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$",
        description="name of the run and its files; by default the name of the configuration file",
    )  # fmt: skip
    model: Annotated[
        Literal[tuple(TIERS)],  # type: ignore[valid-type]
        Allowed(f"{', '.join(TIERS)} or a Python file such as my_model.py"),
    ] = Field(default="slip", description="model to integrate; the code of a file is run")
    units: Literal[PAPER_UNITS, SI] = Field(  # type: ignore[valid-type]
        default=PAPER_UNITS, description="lengths in c, times in sqrt(c/g) and mass 1, or SI"
    )
    cases: Annotated[str | None, Allowed("a CSV file, or lists of numbers by parameter")] = Field(
        default=None,
        description="table with a column for each parameter and a row for each trajectory, instead of axes: the name "
        "of a CSV file, or lists of numbers",
    )  # fmt: skip
    integrator: Integrator = Integrator()
    measure: Annotated[list[str] | None, BeforeValidator(_measures), Allowed(f"a list of {', '.join(MEASURES)}")] = (
        Field(default=None, description="what to compute; by default the usual measurements that the model supports")
    )
    picture: Annotated[
        list[str] | None, BeforeValidator(_each_once), Allowed("a list of variables, such as [reversals, spin_mean]")
    ] = Field(default=None, description="variables that `run` draws; by default the first ones in `measure`")
    samples: Annotated[Whole | None, Allowed(f"a whole number >= 1 and <= {MAX_AXIS}")] = Field(
        default=None, ge=1, le=MAX_AXIS,
        description=f"number of samples to draw from the distributions; by default {SAMPLES} if there are any",
    )  # fmt: skip
    seed: Whole = Field(default=0, ge=0, lt=2**32, description="seed of the samples, which makes them reproducible")
    max_failed_fraction: float = Field(
        default=0.01, ge=0, le=1, description="fraction of failed cells above which the command exits with code 3"
    )


@cache
def schema_of(origin: Origin | None) -> Any:
    """Return the schema of configurations of a user's model, or, without one, of the models of this package."""
    table = loading.table(origin)
    words = _WORDS if not origin else {"body": Body} if loading.law(origin) else {}
    found: dict[str, Any] = {}
    for name in sections(table):
        made: Any = create_model(name.capitalize(), __base__=words.get(name, Strict), **_physical(name, table))
        found[name] = made, Field(default_factory=made)
    if origin:
        found["model"] = str, ...
    return create_model("Configuration", __base__=_Top, **_physical("", table), **found)


SETTINGS: dict[str, FieldInfo] = {name: field for name, field in _Top.model_fields.items() if name != "integrator"}
for _name, _words in _WORDS.items():
    SETTINGS |= {f"{_name}.{name}": field for name, field in _words.model_fields.items()}
SETTINGS |= {f"integrator.{name}": field for name, field in Integrator.model_fields.items()}
"""All values of a configuration except the physical parameters, by path, each with its `description`."""

PATHS: dict[str, str] = {p.path: p.meaning for p in PARAMETERS.values()}
PATHS |= {path: str(field.description) for path, field in SETTINGS.items()}
"""The path of every value of a configuration, with its meaning."""
