"""Arguments of data classes: declared with their types, checked where an object is made, shown.

Tables of files are read by the same declarations (`foldyn.tables`).

What an argument must be stands among the annotations of its type, its unit too, and the key that it
has in a case file where that is another than its name:

    stiffness: Annotated[float, Check(number, above=0.0, unit="N/m")]
    vector: Annotated[Sequence[float], Check(vector, unit="N"), Key("force")]
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import cache
from html import escape
from types import MappingProxyType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    NamedTuple,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from foldyn.errors import within
from foldyn.json_schema import Schema, of_checked, of_type
from foldyn.values import flag, plain

T = TypeVar("T")
SOME = 6
"""Items of a list, and of an array, that a repr shows."""
NOTHING: Mapping[str, Any] = MappingProxyType({})
CONTEXT = frozenset({"folder", "find", "beside", "others"})
"""What checks of a file may ask for: where its paths start, how else a name in it is found, what
its table says up to there, and the table at the same place of files of other kinds, by kind."""


class Unit:
    """Unit of an argument, for tables."""

    def __init__(self, unit: str) -> None:
        self.unit = unit


class Check(Unit):
    """What an argument must be, and its unit.

    Parameters
    ----------
    check : callable
        ``check(name, value, **limits)`` gives the value as it is kept, or raises `InputError`.
    unit : str
        For tables, and for messages of checks that take it.
    words : iterable of str, optional
        Texts that the check accepts, where `limits` do not say so.
    given : type, optional
        Type of what it accepts, where it keeps another.
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
        """JSON Schema of what it accepts of a type; tables of data classes become definitions."""
        words = {"known": [*self.words]} if self.words else {}
        return of_checked(self.given or hint, self.check, {**self.limits, **words})


class Placed(Check):
    """A check whose function takes the value alone: what it says continues the name."""

    def __call__(self, name: str, value: Any, context: Mapping[str, Any] = NOTHING) -> Any:
        """See `Check`."""
        with within(name):
            return self.check(value, **self._options(context))


Flag = Annotated[bool, Check(flag)]


class Read:
    """How an argument is read from a file, where its value there is another."""

    def __init__(self, check: Check) -> None:
        self.check = check


class Key(str):
    """Name of an argument in a case file."""


class Argument(NamedTuple):
    """What a data class says of an argument."""

    checks: tuple[Check, ...]
    unit: str
    key: str
    default: Any
    hint: Any = Any
    reader: Check | None = None

    def read(self, name: str, value: Any, context: Mapping[str, Any]) -> Any:
        """The value from what a file says."""
        if self.reader is not None:
            value = self.reader(name, value, context)
        return self.checked(name, value, context)

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """JSON Schema of what a file may say."""
        check = self.reader or (self.checks[-1] if self.checks else None)
        schema = check.schema(self.hint, definitions) if check else of_type(self.hint, NOTHING)
        plainly = isinstance(self.default, bool | int | float | str) and "$ref" not in schema
        return {**schema, "default": self.default} if plainly else schema

    def checked(self, name: str, value: Any, context: Mapping[str, Any] = NOTHING) -> Any:
        """The value as it is kept; None is left alone where it is the default."""
        if value is None and self.default is None:
            return None
        for check in self.checks:
            value = check(name, value, context)
        return value


@cache
def arguments(kind: type) -> Mapping[str, Argument]:
    """Arguments of a data class by name, in its order."""
    hints, found = get_type_hints(kind, include_extras=True), {}
    for item in fields(kind):
        notes = list(_notes(hints[item.name]))
        checks = tuple(note for note in notes if isinstance(note, Check))
        key = next((note for note in notes if isinstance(note, Key)), item.name)
        unit = next((note.unit for note in notes if isinstance(note, Unit) and note.unit), "")
        reader = next((note.check for note in notes if isinstance(note, Read)), None)
        found[item.name] = Argument(checks, unit, str(key), item.default, hints[item.name], reader)
    return found


def _notes(hint: Any) -> Iterator[Any]:
    """What stands beside a type, or beside one of a union."""
    if hasattr(hint, "__metadata__"):
        yield from hint.__metadata__
        hint = hint.__origin__
    if isinstance(own := getattr(hint, "in_files", None), Check):
        yield own
    if get_origin(hint) in (Union, UnionType):
        for part in get_args(hint):
            yield from _notes(part)


class Checked:
    """Base of frozen data classes whose arguments are checked as they are declared.

    An argument that is None by default may be None. They are shown as `brief` does.

    Attributes
    ----------
    place : str
        What stands before the arguments in messages: "settings: ".
    missing : mapping of str to str
        Remedies in messages where a file lacks a key that it must have.
    in_files : Check or None
        What reads an argument of this type, where the type alone says so.
    like : sequence
        Functions and classes whose docstrings say what its arguments are.
    """

    place: ClassVar[str] = ""
    missing: ClassVar[Mapping[str, str]] = NOTHING
    in_files: ClassVar[Check | None] = None
    like: ClassVar[Sequence[Any]] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        """Give a subclass its repr before `dataclass` would give it a long one."""
        super().__init_subclass__(**options)
        brief(cls)

    def __post_init__(self) -> None:
        """Check the arguments, one by one and then with each other."""
        with within(self.place):
            for name, argument in arguments(type(self)).items():
                self._set(**{name: argument.checked(name, getattr(self, name))})
            self.agree()

    def agree(self) -> None:
        """Refuse arguments that do not go together; what one says of another is set here."""

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def given(self, *names: str) -> list[str]:
        """Those of some arguments that are not None."""
        return [name for name in names if getattr(self, name) is not None]


def brief(cls: type[T]) -> type[T]:
    """Give a data class a repr of one short line, and a table for notebooks unless it has another.

    Arrays are shown by their shape, lists by their ends; arguments that are None unless given are
    left out.
    """

    def shown(self: Any) -> str:
        given = (f"{name}={_brief(value)}" for name, value in _shown(self))
        return f"{type(self).__name__}({', '.join(given)})"

    cls.__repr__ = shown  # type: ignore[method-assign]
    if not hasattr(cls, "_repr_html_"):
        cls._repr_html_ = _table  # type: ignore[attr-defined]
    return cls


def _shown(self: Any) -> Iterator[tuple[str, Any]]:
    """Fields of a data class that its repr shows."""
    for item in fields(self):
        value = getattr(self, item.name)
        if item.repr and not (item.default is None and value is None):
            yield item.name, value


def _table(self: Any) -> str:
    """A data class as a table in HTML, with units."""
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
