"""JSON Schema (draft 7) of types and their limits, with descriptions from docstrings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from foldyn.values import MOST, length, vector

Schema = dict[str, Any]
BOUNDS = {
    "above": "exclusiveMinimum", "least": "minimum", "below": "exclusiveMaximum", "most": "maximum",
}  # fmt: skip
TYPES = {bool: "boolean", int: "integer", float: "number", str: "string", Path: "string"}
TRIPLE = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
_SECTION = re.compile(r"^(?:Parameters|Attributes)\n-+\n(.*?)(?=^[^\n]+\n---|\Z)", re.M | re.S)
_ITEM = re.compile(r"^(\w[\w, ]*)(?: : .*)?\n((?: +.*\n?|\n)+)", re.M)


def of_checked(hint: Any, check: Callable[..., Any], limits: Mapping[str, Any]) -> Schema:
    """Schema of the values of a type that a check with limits accepts."""
    if check is vector and str not in get_args(hint):
        return TRIPLE
    given = {key: one.default for key, one in inspect.signature(check).parameters.items()}
    own = {"above": 0.0} if check is length else given
    return of_type(hint, {**own, **limits})


def of_type(hint: Any, limits: Mapping[str, Any]) -> Schema:
    """Schema of a type with bounds for its numbers and known words for its texts."""
    origin, parts = get_origin(hint), [one for one in get_args(hint) if one is not NoneType]
    if origin is Annotated:
        return of_type(parts[0], limits)
    if origin in (Union, UnionType):
        return any_of(of_type(one, limits) for one in parts)
    if origin in (list, tuple, Sequence):
        return {"type": "array", "items": of_type(parts[0], limits)}
    if origin in (dict, Mapping):
        return {"type": "object", "additionalProperties": of_type(parts[1], limits)}
    schema: Schema = {"type": TYPES[hint]} if hint in TYPES else {}
    if hint in (int, float):
        bounds = {word: limits.get(key) for key, word in BOUNDS.items()}
        schema |= {word: one for word, one in bounds.items() if one is not None and abs(one) < MOST}
    if hint is str and "known" in limits:
        schema["enum"] = [*limits["known"]]
    return schema


def item_of(hint: Any) -> Any:
    """Type of the items of a sequence, or of a sequence in a union."""
    if get_origin(hint) in (list, tuple, Sequence):
        return get_args(hint)[0]
    return next(filter(None, map(item_of, get_args(hint))), None)


def any_of(schemas: Any) -> Schema:
    """Schema that accepts whatever one of several schemas accepts."""
    found: list[Schema] = []
    for one in schemas:
        found += [one] if one not in found else []
    if {} in found:
        return {}
    return found[0] if len(found) == 1 else {"anyOf": found}


def described(schema: Schema, text: str | None) -> Schema:
    """The schema with a description, if there is one."""
    return {**schema, "description": text} if text else schema


def closed(
    properties: Mapping[str, Schema], required: Sequence[str], thing: Any, word: str = ""
) -> Schema:
    """Schema of a table without further keys, with the description of `thing`.

    word : value of the key `kind` of the table, if it has this key.
    """
    kind = {"kind": {"enum": [word]}} if word else {}
    own, must = {**kind, **properties}, [*kind, *required]
    schema = {"type": "object", "properties": own, "required": must, "additionalProperties": False}
    return described(schema, summary(thing))


def of_call(function: Callable[..., Any], word: str, more: Mapping[str, Schema]) -> Schema:
    """Schema of a table whose keys are its kind, the arguments of a function, and further keys."""
    hints, texts = get_type_hints(function), explained(function)
    parameters = inspect.signature(function).parameters
    own = {key: described(of_type(hints[key], {}), texts.get(key)) for key in parameters}
    required = [key for key, one in parameters.items() if one.default is one.empty]
    return closed({**own, **more}, required, function, word)


def explained(*things: Any) -> dict[str, str]:
    """Descriptions of arguments from docstrings of functions and classes; the first one counts."""
    found: dict[str, str] = {}
    for thing in things:
        for part in _SECTION.findall(inspect.cleandoc(thing.__doc__ or "")):
            for names, text in _ITEM.findall(part):
                for name in names.split(", "):
                    found.setdefault(name, " ".join(text.split()))
    return found


def summary(thing: Any) -> str:
    """First sentence of a docstring."""
    return " ".join(inspect.cleandoc(thing.__doc__ or "").partition("\n\n")[0].split())
