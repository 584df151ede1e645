"""What is said of a value that the schema refuses: in our words, made from the schema itself.

Of pydantic's errors only the type and the place are used, never the text.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from sweep.config.faults import Path, quote, suggestion

Error = Any
"""An entry of `ValidationError.errors()`."""

_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_KINDS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a word"}


@dataclass(frozen=True)
class Allowed:
    """What a field allows, in words; in the `Annotated` type of a field whose type and bounds do not say it."""

    words: str


def wrong(reason: str, *at: str | int) -> PydanticCustomError:
    """A fault in the value that is being checked; `at` is the path inside that value."""
    return PydanticCustomError("value", "{reason}", {"reason": reason, "at": at})


def describe(errors: Iterable[Error], schema: type[BaseModel]) -> Iterator[tuple[Path, str, bool]]:
    """Of each error in a document of `schema`: its path, its message, and whether the key itself is at fault."""
    for error in errors:
        path, model, field = _find(error["loc"], schema)
        if error["type"] == "extra_forbidden":
            yield path, f"unknown key{_other_key(path, model, schema)}; allowed: {', '.join(model.model_fields)}", True
        elif error["type"] == "value":
            yield (*path, *error["ctx"]["at"]), error["ctx"]["reason"], False
        elif error["type"] == "missing":
            yield path, f"missing; allowed: {allowed(field)}", False
        else:
            yield path, refusal(error["input"], allowed(field), choices(field.annotation if field else None)), False


def refusal(given: object, words: str, names: Sequence[str] = ()) -> str:
    """That `given` is not what is allowed, with the one of `names` that may be meant."""
    return f"{quote(given)}{suggestion(given, names)}; allowed: {words}"


def allowed(field: FieldInfo | None) -> str:
    """What a field of the schema allows, in words."""
    if field is None:
        return "a mapping of keys to values"
    if words := [mark.words for mark in field.metadata if isinstance(mark, Allowed)]:
        return words[0]
    kind = _kind(field.annotation)
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return f"a section with {', '.join(kind.model_fields)}"
    if names := choices(kind):
        return ", ".join(names)
    bounds = [
        f"{sign} {getattr(mark, name):.15g}"
        for name, sign in _SIGNS.items()
        for mark in field.metadata
        if hasattr(mark, name)
    ]
    return _KINDS[kind] + (f" {' and '.join(bounds)}" if bounds else "")


def choices(annotation: Any) -> tuple[str, ...]:
    """The words among which a field lets choose; none if it takes other values."""
    kind = _kind(annotation)
    return get_args(kind) if get_origin(kind) is Literal else ()


def _kind(annotation: Any) -> Any:
    """The type of a value that is not None."""
    parts = [part for part in get_args(annotation) if part is not NoneType]
    return parts[0] if get_origin(annotation) in (Union, UnionType) and len(parts) == 1 else annotation


def _find(place: Path, schema: type[BaseModel]) -> tuple[Path, type[BaseModel], FieldInfo | None]:
    """The key that pydantic's `place` leads to, the section that has it, and its field if there is such a key.

    Places also name the members of unions, which are no keys.
    """
    model, field = schema, None
    for depth, key in enumerate(place, start=1):
        field = model.model_fields.get(str(key))
        kind = _kind(field.annotation) if field else None
        if not (isinstance(kind, type) and issubclass(kind, BaseModel)) or depth == len(place):
            return place[:depth], model, field
        model = kind
    return (), model, field


def _other_key(path: Path, model: type[BaseModel], schema: type[BaseModel]) -> str:
    """The key that may be meant by an unknown one: of the same section, or the path of one in another."""
    key = path[-1]
    elsewhere = {
        name: f"{section}.{name}"
        for section, field in schema.model_fields.items()
        if isinstance(kind := _kind(field.annotation), type) and issubclass(kind, BaseModel)
        for name in kind.model_fields
    }
    if key in elsewhere:
        return suggestion(elsewhere[str(key)], [elsewhere[str(key)]])
    return suggestion(key, model.model_fields) or suggestion(key, elsewhere, elsewhere)
