"""Messages for a case file that does not fit its schema."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from foldyn.cases.decode import unknown_key
from foldyn.errors import ALSO
from foldyn.values import SHOWN, nearest, show

MOST_LINES = 12
"""Errors listed one by one."""
_TEXTS = {
    "missing": "missing; give its value",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text",
    "bool_type": "must be true or false",
    "finite_number": "must be a finite number",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "too_short": "must have at least one entry",
}


def describe(
    error: ValidationError, schema: type[BaseModel], kinds: Mapping[str, type[BaseModel]]
) -> str:
    """Text for all that a validation found: one line, and one more for each further error.

    `kinds` are the schemas of all kinds of analysis: a key of another kind is reported as such.
    """
    items = error.errors(include_url=False, include_context=True)
    unknown = [item for item in items if item["type"] == "extra_forbidden"]
    # a misspelled key is also missing under its right name: say it once, and first
    meant = {(*item["loc"][:-1], _meant(item["loc"], schema)) for item in unknown[:MOST_LINES]}
    rest = [
        item
        for item in items
        if item["type"] != "extra_forbidden"
        and not (item["type"] == "missing" and item["loc"] in meant)
    ]
    listed = [*unknown, *rest][:MOST_LINES]
    lines = [line for item in listed for line in _lines(item, schema, kinds)]
    if len(unknown) + len(rest) > MOST_LINES:
        lines.append(f"{len(unknown) + len(rest) - MOST_LINES} more")
    return ALSO.join(dict.fromkeys(lines))


def dotted(location: Sequence[str | int]) -> str:
    """Path of a key: ("loads", 0, "nodes") becomes "loads[0].nodes"."""
    text = ""
    for part in location:
        word = f"[{part}]" if isinstance(part, int) else part[:SHOWN]
        text += f".{word}" if text and isinstance(part, str) else word
    return text


def _lines(
    item: Mapping[str, Any], schema: type[BaseModel], kinds: Mapping[str, type[BaseModel]]
) -> list[str]:
    if item["type"] != "value_error":
        return [_line(item, schema, kinds)]
    error = item["ctx"]["error"]  # an InputError of ours: its text continues the path
    place = dotted(item["loc"])
    return [f"{place}{one.field}{one.reason}" for one in (error, *error.others)]


def _line(
    item: Mapping[str, Any], schema: type[BaseModel], kinds: Mapping[str, type[BaseModel]]
) -> str:
    location, kind, value = item["loc"], item["type"], item["input"]
    place, context = dotted(location), item.get("ctx", {})
    if kind == "extra_forbidden":
        at, key = location[:-1], str(location[-1])
        owners = [name for name, other in kinds.items() if key in _keys(other, at)]
        if owners:
            *others, last = (show(owner) for owner in owners)
            kinds_of_it = f"{', '.join(others)} or {last}" if others else last
            return f"{place}: only for analysis.kind = {kinds_of_it}; leave it out"
        return f"{place}: {unknown_key(key, _keys(schema, at))}"
    if kind == "missing":
        return f"{place}: {_TEXTS[kind]}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        text = f"must be a table, written [{place}]" if "[" not in place else "must be a table"
    elif kind == "list_type":
        is_table = bool(get_args(schema.model_fields[location[0]].annotation))
        text = f"must be a list of tables, written [[{place}]]" if is_table else "must be a list"
    else:
        text = _TEXTS[kind].format(**context) if kind in _TEXTS else item["msg"]
    return f"{place} = {show(value)}: {text}"


def _meant(location: Sequence[str | int], schema: type[BaseModel]) -> str | None:
    return nearest(str(location[-1]), _keys(schema, location[:-1]))


def _keys(schema: Any, location: Sequence[str | int]) -> list[str]:
    """Keys of the section at a location; none where a schema has no such section."""
    for part in location:
        if isinstance(part, int):
            continue
        if part not in schema.model_fields:
            return []
        annotation: Any = schema.model_fields[part].annotation
        schema = next(iter(get_args(annotation)), annotation)
    return list(getattr(schema, "model_fields", ()))
