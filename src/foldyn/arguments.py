"""Arguments of data classes: declared with their types, checked at creation, and displayed.

The same declarations read tables of files (`foldyn.tables`).

Annotations of the type of an argument declare its check, its unit, and its key in case files if the
key differs from the name:

    stiffness: Annotated[float, Check(number, above=0.0, unit="N/m")]
    vector: Annotated[Sequence[float], Check(vector, unit="N"), Key("force")]
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import cache
from html import escape
from types import MappingProxyType, UnionType
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar

import numpy as np

from foldyn.errors import within
from foldyn.json_schema import Schema, of_checked, of_type
from foldyn.values import flag, plain

T = TypeVar("T")
SOME = 6
"""Number of items of a list, and of an array, that a repr shows."""
NOTHING: Mapping[str, Any] = MappingProxyType({})
CONTEXT = frozenset({"folder", "find", "beside", "others"})
"""Names of data that checks of a file may request: the folder in which its paths start, a function
that finds names, the table as read so far, and tables at the same place in files of other kinds."""


class Unit:
    """Unit of an argument, for tables."""

    def __init__(self, unit: str) -> None:
        self.unit = unit


class Check(Unit):
    """Check of an argument, and its unit.

    Parameters
    ----------
    check : callable
        ``check(name, value, **limits)`` returns the value to store, or raises `InputError`.
    unit : str
        Unit, for tables and for messages of checks that take a unit.
    words : iterable of str, optional
        Texts that the check accepts, unless `limits` contain them.
    given : type, optional
        Type that the check accepts, if it stores another type.
    """

    def __init__(
        self, check: Callable[..., Any], *, unit: str = "", words: Iterable[str] = (),
        given: Any = None, **limits: Any,
    ) -> None:  # fmt: skip
        super().__init__(unit)
        self.check, self.limits, self.words, self.given = check, limits, words, given
        parameters = inspect.signature(check).parameters
        if unit and "unit" in parameters:
            self.limits["unit"] = unit
        self.asks = CONTEXT.intersection(parameters)

    def __call__(self, name: str, value: Any, context: Mapping[str, Any] = NOTHING) -> Any:
        """The value as it is kept."""
        return self.check(name, value, **(self._options(context) if self.asks else self.limits))

    def _options(self, context: Mapping[str, Any]) -> dict[str, Any]:
        asked = {word: context[word] for word in self.asks if word in context}
        return {**self.limits, **asked}

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """JSON Schema of accepted values of a type; tables of data classes become definitions."""
        words = {"known": [*self.words]} if self.words else {}
        return of_checked(self.given or hint, self.check, {**self.limits, **words})


class Placed(Check):
    """A check whose function takes only the value; the argument's name precedes its messages."""

    def __call__(self, name: str, value: Any, context: Mapping[str, Any] = NOTHING) -> Any:
        """The value as stored; see `Check`."""
        with within(name):
            return self.check(value, **self._options(context))


Flag = Annotated[bool, Check(flag)]


class Read:
    """How an argument is read from a file, if its value has another form in files."""

    def __init__(self, check: Check) -> None:
        self.check = check


class Key(str):
    """Name of an argument in a case file."""


class Argument(NamedTuple):
    """Declaration of an argument in a data class."""

    checks: tuple[Check, ...]
    unit: str
    key: str
    default: Any
    hint: Any = Any
    reader: Check | None = None

    def read(self, name: str, value: Any, context: Mapping[str, Any]) -> Any:
        """Value of the argument, converted from its form in a file."""
        if self.reader is not None:
            value = self.reader(name, value, context)
        return self.checked(name, value, context)

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """JSON Schema of the values that a file may contain."""
        check = self.reader or (self.checks[-1] if self.checks else None)
        schema = check.schema(self.hint, definitions) if check else of_type(self.hint, NOTHING)
        plainly = isinstance(self.default, bool | int | float | str) and "$ref" not in schema
        return {**schema, "default": self.default} if plainly else schema

    def checked(self, name: str, value: Any, context: Mapping[str, Any] = NOTHING) -> Any:
        """Check a value and return it as stored; None is accepted if it is the default."""
        if value is None and self.default is None:
            return None
        for check in self.checks:
            value = check(name, value, context)
        return value


@cache
def arguments(kind: type) -> Mapping[str, Argument]:
    """Arguments of a data class by name, in the order of its fields."""
    hints, found = typing.get_type_hints(kind, include_extras=True), {}
    for item in fields(kind):
        notes = list(_notes(hints[item.name]))
        checks = tuple(note for note in notes if isinstance(note, Check))
        key = next((note for note in notes if isinstance(note, Key)), item.name)
        unit = next((note.unit for note in notes if isinstance(note, Unit) and note.unit), "")
        reader = next((note.check for note in notes if isinstance(note, Read)), None)
        found[item.name] = Argument(checks, unit, str(key), item.default, hints[item.name], reader)
    return found


def _notes(hint: Any) -> Iterator[Any]:
    """Annotations of a type, or of a member of a union."""
    if hasattr(hint, "__metadata__"):
        yield from hint.__metadata__
        hint = hint.__origin__
    if isinstance(own := getattr(hint, "in_files", None), Check):
        yield own
    if typing.get_origin(hint) in (typing.Union, UnionType):
        for part in typing.get_args(hint):
            yield from _notes(part)


class Checked:
    """Base of frozen data classes that check their arguments as declared.

    An argument whose default is None may be None. `brief` defines how objects are displayed.

    Attributes
    ----------
    place : str
        Prefix of arguments in messages, such as "settings: ".
    missing : mapping of str to str
        Remedy for each required key, for messages about files that lack it.
    either : sequence of sequence of str
        Sets of keys of which files give at least one.
    gone : mapping of str to str
        What takes the place of each key that files may no longer have.
    in_files : Check or None
        Reader for arguments of this type, if no annotation names one.
    like : sequence
        Functions and classes whose docstrings describe the arguments.
    """

    place: ClassVar[str] = ""
    missing: ClassVar[Mapping[str, str]] = NOTHING
    either: ClassVar[Sequence[Sequence[str]]] = ()
    gone: ClassVar[Mapping[str, str]] = NOTHING
    in_files: ClassVar[Check | None] = None
    like: ClassVar[Sequence[Any]] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        """Give a subclass a short repr before `dataclass` adds its long one."""
        super().__init_subclass__(**options)
        brief(cls)

    def __post_init__(self) -> None:
        """Check each argument, then all of them together."""
        with within(self.place):
            for name, argument in arguments(type(self)).items():
                self._set(**{name: argument.checked(name, getattr(self, name))})
            self.agree()

    def agree(self) -> None:
        """Refuse incompatible arguments; may set an argument that follows from another."""

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def given(self, *names: str) -> list[str]:
        """Those of the given names whose arguments are not None."""
        return [name for name in names if getattr(self, name) is not None]


def brief(cls: type[T]) -> type[T]:
    """Give a data class a repr of one short line, and a table for notebooks unless it has one.

    Arrays are shown by their shape, lists by their first and last items; optional arguments that
    were not given are left out.
    """

    def shown(self: Any) -> str:
        given = (f"{name}={_brief(value)}" for name, value in _shown(self))
        return f"{type(self).__name__}({', '.join(given)})"

    cls.__repr__ = shown  # type: ignore[method-assign]
    if not hasattr(cls, "_repr_html_"):
        cls._repr_html_ = _table  # type: ignore[attr-defined]
    return cls


def _shown(self: Any) -> Iterator[tuple[str, Any]]:
    """Fields of a data class to show in its repr."""
    for item in fields(self):
        value = getattr(self, item.name)
        if item.repr and not (item.default is None and value is None):
            yield item.name, value


def _table(self: Any) -> str:
    """HTML table of a data class, with units."""
    left = 'style="text-align: left"'
    rows = ""
    for name, value in _shown(self):
        unit = "" if isinstance(value, str) else arguments(type(self))[name].unit
        rows += (
            f'<tr><th scope="row" {left}>{escape(name.replace("_", " "))}</th>'
            f"<td {left}>{escape(f'{_brief(value)} {unit}'.rstrip())}</td></tr>"
        )
    return f"<table><caption><code>{type(self).__name__}</code></caption>{rows}</table>"


def _brief(value: Any) -> str:
    if type(value).__name__ == "Dataset":
        return f"<Dataset {dict(value.sizes)}>"
    if isinstance(value, np.ndarray) and value.size > SOME:
        return f"<{value.dtype.name} {value.shape}>"
    if type(value) is dict:
        return "{" + ", ".join(f"{key}: {_brief(item)}" for key, item in value.items()) + "}"
    if type(value) in (list, tuple):
        items = [_brief(item) for item in value[:SOME]]
        more = [f"... {len(value)} in all"] if len(value) > SOME else []
        inside = ", ".join([*items, *more])
        if isinstance(value, list):
            return f"[{inside}]"
        return f"({inside},)" if len(value) == 1 else f"({inside})"
    return " ".join(repr(plain(value)).split())
