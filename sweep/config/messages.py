"""Explains why the schema refuses a value, in words derived from the schema itself.

Only the type and location of pydantic's errors are used, never their text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from sweep.faults import Path, either, refusal, suggestion

_SIDEWAYS = re.compile(r"(?:offset|com|cm|cent(?:re|er)(?:_of_(?:mass|gravity))?)_?[xy12]|[xy]_?(?:offset|com|cm|s|g)")
_OFF_AXIS = (
    ": the centre of mass lies on the axis through the surface's centre and lowest point, offset below that centre; "
    "no model has it off this axis"
)

_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_KINDS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a word"}


class Allowed(str):
    """A description of permitted values, in the `Annotated` type of a field whose type and bounds do not say it."""

    __slots__ = ()


def wrong(reason: str, *at: str | int) -> PydanticCustomError:
    """An error in the value being checked; `at` is the path inside that value."""
    return PydanticCustomError("value", "{reason}", {"reason": reason, "at": at})


def explain(errors: Iterable[Any], schema: type[BaseModel]) -> dict[Path, tuple[str, bool]]:
    """Map the path of each of pydantic's errors to a message, and to whether the key itself is wrong."""
    found, sections = {}, _sections(schema)
    for error in errors:
        place, kind = error["loc"], error["type"]
        section = sections.get(place[0], schema) if len(place) > 1 else schema
        path = place[:1] if section is schema else place[:2]  # what follows names members of unions
        if not path:
            found[path] = "a key that is not text; correct its spelling", False
        elif kind == "extra_forbidden":
            key = str(path[-1])
            more = _OFF_AXIS if _SIDEWAYS.fullmatch(key) else _other_key(key, section, sections)
            found[path] = f"unknown key{more}; the keys here are {', '.join(section.model_fields)}", True
        elif kind == "value":
            found[*path, *error["ctx"]["at"]] = error["ctx"]["reason"], False
        elif kind == "missing":
            found[path] = f"missing; give {allowed(section.model_fields[path[-1]])}", False
        else:
            field = section.model_fields[path[-1]]
            found[path] = refusal(error["input"], allowed(field), _choices(field)), False
    return found


def allowed(field: FieldInfo) -> str:
    """Describe the values that a field of the schema permits."""
    if words := [mark for mark in field.metadata if isinstance(mark, Allowed)]:
        return words[0]
    kind = next(kind for kind in (*get_args(field.annotation), field.annotation) if kind is not NoneType)
    if names := _choices(field):
        return either(names)
    if issubclass(kind, BaseModel):
        return f"a section with {', '.join(kind.model_fields)}"
    marks = [(sign, getattr(mark, name, None)) for name, sign in _SIGNS.items() for mark in field.metadata]
    bounds = " and ".join(f"{sign} {bound:.15g}" for sign, bound in marks if bound is not None)
    return f"{_KINDS[kind]} {bounds}".rstrip()


def _choices(field: FieldInfo) -> list[str]:
    """Return the words that a field permits."""
    kinds = (field.annotation, *get_args(field.annotation))
    return [word for kind in kinds if get_origin(kind) is Literal for word in get_args(kind)]


def _sections(schema: type[BaseModel]) -> dict[str, type[BaseModel]]:
    kinds = {name: field.annotation for name, field in schema.model_fields.items()}
    return {name: kind for name, kind in kinds.items() if isinstance(kind, type) and issubclass(kind, BaseModel)}


def _other_key(key: str, section: type[BaseModel], sections: dict[str, type[BaseModel]]) -> str:
    """Return the key that was probably meant: one of the same section, or the path of one in another section."""
    elsewhere = {inner: f"{name}.{inner}" for name, kind in sections.items() for inner in kind.model_fields}
    if key in elsewhere:
        return suggestion(key, [key], elsewhere)
    return suggestion(key, section.model_fields) or suggestion(key, elsewhere, elsewhere)
