"""Tables of files, read according to data classes; see `foldyn.arguments`.

All errors of a file are reported together, each with its location: the location of the table, a dot
and the key; "" for the whole file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass
from functools import cache, partial
from typing import Any, ClassVar, TypeVar, dataclass_transform

from foldyn.arguments import NOTHING, Check, Checked, arguments
from foldyn.errors import Faults, InputError
from foldyn.json_schema import Schema, closed, described, explained, item_of
from foldyn.values import SHOWN, nearest, show, suggest

C = TypeVar("C", bound=Checked)
MOST_TOLD = 12
"""Largest number of mistakes of a file that are reported one by one."""


class UnknownKeyError(InputError):
    """A key that its table does not define."""


def read(
    kind: type[C], name: str, table: Any, folder: Any = None, find: Any = None,
    others: Mapping[str, type[Checked]] = NOTHING,
) -> C:  # fmt: skip
    """Create an object of a data class from its table in a file.

    Parameters
    ----------
    kind : type
    name : str
        Location of the table.
    table : mapping
    folder, find, others
        Data for checks that request them; see `foldyn.arguments.CONTEXT`.
    """
    check_table(name, table)
    own = {argument.key: field for field, argument in arguments(kind).items()}
    faults, found = Faults(), {}
    needed, unknown = needs(kind), [key for key in table if key not in own]
    for key in unknown:
        reason = kind.gone.get(key) or _of_others(key, others) or unknown_key(key, own)
        faults.add(UnknownKeyError(f": {reason}", f"{name}.{key[:SHOWN]}"))
    context = {"folder": folder, "find": find, "beside": found}
    meant = {nearest(key, own) for key in unknown}  # these keys need not be reported as missing
    for field, argument in arguments(kind).items():
        key, place = argument.key, f"{name}.{argument.key}"
        if key in table:
            inner = _within_others(key, others) if table_under(key, kind) else NOTHING
            try:
                found[field] = argument.read(place, table[key], {**context, "others": inner})
            except InputError as error:
                faults.add(error)
        elif key not in needed:
            found[field] = argument.default
        elif key not in meant:
            faults.add(InputError(f": missing; {needed[key]}", place))
    faults.raise_all()
    made = object.__new__(kind)
    made._set(**found)
    if isinstance(made, Section):
        made._set(stated=frozenset(own[key] for key in table))
    with _placed(name, kind):
        made.agree()
    return made


def _of_others(key: str, others: Mapping[str, type[Checked]]) -> str:
    """Hint for a key that belongs to tables of other kinds."""
    owners = [show(kind) for kind, other in others.items() if key in keys(other)]
    if not owners:
        return ""
    *first, last = owners
    listed = f"{', '.join(first)} or {last}" if first else last
    return f"only for analysis.kind = {listed}; leave it out"


def _within_others(key: str, others: Mapping[str, type[Checked]]) -> dict[str, type[Checked]]:
    """Tables under a key, in files of other kinds."""
    return {kind: one for kind, other in others.items() if (one := table_under(key, other))}


@contextmanager
def _placed(name: str, kind: type[Checked]) -> Iterator[None]:
    """Add the location in a file to errors about incompatible arguments."""
    try:
        yield
    except InputError as error:
        key = arguments(kind)[error.key].key if error.key in arguments(kind) else error.key
        inside = f".{key}{error.field[len(error.key) :]}" if error.field else ""
        raise InputError(error.reason, f"{name}{inside}", error.file, error.others) from None


@cache
def needs(kind: type[Checked]) -> Mapping[str, str]:
    """Keys that the table of a data class must have, each with the remedy if it is missing."""
    return {
        one.key: f"give it ({one.unit})" if one.unit else "give its value"
        for one in arguments(kind).values()
        if one.default is MISSING
    } | dict(kind.missing)


def keys(kind: type[Checked]) -> list[str]:
    """Keys of the table of a data class."""
    return [argument.key for argument in arguments(kind).values()]


@cache
def table_under(key: str, kind: type[Checked]) -> type[Checked] | None:
    """Data class of the table under a key of another table; None for other values."""
    for argument in arguments(kind).values():
        for check in argument.checks if argument.key == key else ():
            inner = check.item if isinstance(check, ListOf) else check
            if isinstance(inner, TableOf):
                return inner.kind
    return None


def check_table(name: str, value: Any) -> Mapping[str, Any]:
    """Return `value` when it is a table."""
    if isinstance(value, Mapping):
        return value
    written = f", written [{name[1:]}]" if name.startswith(".") and "[" not in name else ""
    raise InputError(f" = {show(value)}: must be a table{written}", name)


def check_keys(table: Mapping[str, Any], known: Iterable[str], name: str = "") -> None:
    """Refuse unknown keys, with suggestions and the known keys."""
    known, faults = list(known), Faults()
    for key in table:
        if key not in known:
            faults.add(InputError(f": {unknown_key(key, known)}", f"{name}.{key}"))
    faults.raise_all()


def unknown_key(key: str, known: Iterable[str]) -> str:
    """Message for an unknown key."""
    known = list(known)
    return f"unknown key; {suggest(key, known)}known keys: {', '.join(known) or 'none'}"


class TableOf(Check):
    """A table that is read as a data class."""

    def __init__(self, kind: type[Checked]) -> None:
        super().__init__(partial(read, kind))
        self.kind = kind

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """JSON Schema of the data class's table; see `Check`."""
        return schema_of(self.kind, definitions)


class ListOf(Check):
    """A list.

    Parameters
    ----------
    item : Check
        Check that each item of the list must pass.
    what : str
        Text for messages, such as "a list of numbers, as in [0, 1]"; not used for lists of tables.
    least, most : int
        Bounds of the number of items.
    """

    def __init__(self, item: Check, what: str = "", least: int = 0, most: float = math.inf) -> None:
        super().__init__(item)
        self.item, self.what, self.least, self.most = item, what, least, most

    def __call__(self, name: str, value: Any, context: Mapping[str, Any] = NOTHING) -> Any:
        """Check a list and each of its items; see `Check`."""
        fits = isinstance(value, list) and self.least <= len(value) <= self.most
        if not fits and (self.what or not isinstance(value, list)):
            what = self.what or f"a list of tables, written [[{name[1:]}]]"
            raise InputError(f" = {show(value)}: must be {what}", name)
        if not fits:
            raise InputError(f" = {show(value)}: must have at least one entry", name)
        faults, found = Faults(), []
        for i, item in enumerate(value):
            with faults.collected():
                found.append(self.item(f"{name}[{i}]", item, context))
        faults.raise_all()
        return found

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """JSON Schema of a list; see `Check`."""
        items = self.item.schema(item_of(hint), definitions)
        most = {"maxItems": self.most} if math.isfinite(self.most) else {}
        return {"type": "array", "items": items, "minItems": self.least, **most}


def schema_of(
    kind: type[Checked], definitions: dict[str, Schema], without: Iterable[str] = (), word: str = ""
) -> Schema:
    """JSON Schema of the table of a data class, added to the definitions.

    without : excluded keys.
    word : value of the key `kind` of the table, if it has this key.
    """
    name = "-".join((kind.__name__, *without))
    if name not in definitions:
        texts = explained(*kind.mro(), *kind.like)
        own = {field: one for field, one in arguments(kind).items() if one.key not in without}
        properties = {
            one.key: described(one.schema(definitions), texts.get(field))
            for field, one in own.items()
        }
        required = [key for key in needs(kind) if key in properties]
        either = {"anyOf": [{"required": [*keys]} for keys in kind.either]} if kind.either else {}
        definitions[name] = {**closed(properties, required, kind, word), **either}
    return {"$ref": f"#/definitions/{name}"}


@dataclass_transform(frozen_default=True, kw_only_default=True)
class Section(Checked):
    """A table that occurs in files only: a frozen data class whose arguments are its keys.

    Attributes
    ----------
    stated : frozenset of str
        Arguments that the file gives.
    """

    stated: ClassVar[frozenset[str]] = frozenset()

    def __init_subclass__(cls, **options: Any) -> None:
        """Make the data class and its reader."""
        super().__init_subclass__(**options)
        dataclass(frozen=True, kw_only=True)(cls)
        cls.in_files = TableOf(cls)

    def __post_init__(self) -> None:
        """Skip checks: defaults need none, and tables are checked as they are read."""

    def values(self) -> dict[str, Any]:
        """Arguments of the table by name."""
        return {name: getattr(self, name) for name in arguments(type(self))}


def told(error: InputError, file: object) -> InputError:
    """Error of a file, with unknown keys first, because other errors may follow from them."""
    found = sorted((error, *error.others), key=lambda one: not isinstance(one, UnknownKeyError))
    shown = [InputError(one.reason, one.field.removeprefix(".")) for one in found[:MOST_TOLD]]
    if len(found) > MOST_TOLD:
        shown.append(InputError(f"{len(found) - MOST_TOLD} more"))
    return InputError(shown[0].reason, shown[0].field, file, shown[1:])
