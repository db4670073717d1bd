"""Histories, laws and other parts of a case from tables of case files and stored cases.

Messages begin with the key in the table, ".duration = -1: must be ..."; the caller puts the place
of the table, "loads[0].history", in front.
"""

from __future__ import annotations

import inspect
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar

from foldyn.arguments import Check, Checked, Placed, Read, arguments
from foldyn.cases.histories import HISTORIES, Table
from foldyn.cases.history import History, as_history
from foldyn.errors import Faults, InputError, within
from foldyn.json_schema import Schema, any_of, of_call
from foldyn.mechanics.term import Term
from foldyn.structures.discretized import Discretized
from foldyn.tables import check_keys, check_table, needs, read, schema_of
from foldyn.values import choice, plain, show

signature = cache(inspect.signature)


def history_from(table: Any, folder: Path | None = None) -> History:
    """History from its table, such as ``{kind = "pulse", duration = 1.0}``.

    Parameters
    ----------
    table : mapping
    folder : Path, optional
        Folder of relative paths to CSV files; without it no file is read.
    """
    kind, arguments = _kind_of(table, HISTORIES)
    if kind == Table.kind and folder is not None and not arguments.keys() & {"times", "values"}:
        return _table_from_file(arguments, folder)
    return call_from(HISTORIES[kind], arguments)


def law_from(spec: Any, laws: Mapping[str, type]) -> Any:
    """Law from its name, or from its table such as ``{kind = "enhanced", theta1 = 75}``.

    A name is returned unchanged. A law inside another law, such as ``law = {kind = "enhanced"}``,
    is made in the same way.
    """
    if isinstance(spec, str):
        return choice("", spec, laws)
    kind, arguments = _kind_of(spec, laws)
    if isinstance(arguments.get("law"), Mapping):
        with within(".law"):
            arguments = {**arguments, "law": law_from(arguments["law"], laws)}
    return call_from(laws[kind], arguments, ("name",))


def laws_from(spec: Any, laws: Mapping[str, type]) -> Any:
    """One law as in `law_from`, a list of laws, or laws by name, as ``{valley = "linear"}``."""
    if isinstance(spec, list):
        return [_within(f"[{k}]", own, laws) for k, own in enumerate(spec)]
    named = isinstance(spec, Mapping) and "kind" not in spec
    if named and all(isinstance(own, str | Mapping) for own in spec.values()):
        return {word: _within(f".{word}", own, laws) for word, own in spec.items()}
    return law_from(spec, laws)


def _within(place: str, spec: Any, laws: Mapping[str, type]) -> Any:
    with within(place):
        return law_from(spec, laws)


def call_from(
    function: Callable[..., Any], arguments: Mapping[str, Any], skip: Iterable[str] = ()
) -> Any:
    """Call a function or class, which checks its arguments, with the entries of a table.

    Parameters
    ----------
    function : callable
    arguments : mapping
        Keyword arguments by name.
    skip : iterable of str
        Parameters that a table may not set.
    """
    known = {n: p for n, p in signature(function).parameters.items() if n not in skip}
    check_keys(arguments, known)
    faults = Faults()
    for name, parameter in known.items():
        if parameter.default is parameter.empty and name not in arguments:
            faults.add(InputError(f": missing; known keys: {', '.join(known)}", f".{name}"))
    faults.raise_all()
    left = dict(arguments)
    while True:
        try:
            made = function(**left)
            break
        except InputError as error:
            inside = error.field.rpartition(": ")[2]  # without the name of the function
            key = re.split(r"\W", inside)[0]
            if key in left:
                faults.add(InputError(error.reason, f".{inside}"))
            elif not faults.found:
                reason = f"{inside}{error.reason}".removeprefix(": ")
                faults.add(InputError(f": {reason}"))
            if key not in left or known[key].default is inspect.Parameter.empty:
                break
            del left[key]  # look for further faults
    faults.raise_all()
    return made


def _kind_of(table: Any, kinds: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    listed = ", ".join(kinds)
    if not isinstance(table, Mapping):
        raise InputError(f' = {show(table)}: must be a table {{ kind = "..." }}, kind: {listed}')
    if "kind" not in table:
        raise InputError(f".kind: missing; choose one of {listed}")
    kind = choice(".kind", table["kind"], kinds)
    return kind, {name: value for name, value in table.items() if name != "kind"}


def _table_from_file(arguments: Mapping[str, Any], folder: Path) -> Table:
    check_keys(arguments, ["file", "time", "value", "unit", "smooth", "times", "values"])
    if "file" not in arguments:
        raise InputError(": give times and values, or file (CSV)")
    file = arguments["file"]
    if not isinstance(file, str) or not file:
        raise InputError(f".file = {show(file)}: must be the path of a CSV file")
    columns = {name: value for name, value in arguments.items() if name != "file"}
    with within(f".file = {show(file)}: "):
        return Table.from_csv(folder / file, **columns)


class KindOf(Placed):
    """A table whose `kind` is the name of one of several data classes, or just that name."""

    def __init__(
        self, read: Callable[..., Any], kinds: Mapping[str, Any], named: bool,
        several: bool = False, **limits: Any,
    ) -> None:  # fmt: skip
        super().__init__(read, **limits)
        self.kinds, self.named, self.several = kinds, named, several

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """See `Check`."""
        tables = [
            schema_of(kind, definitions, ("name",), word) for word, kind in self.kinds.items()
        ]
        if Table in self.kinds.values():
            tables.append(of_call(Table.from_csv, Table.kind, {}))
        one = any_of([*([{"enum": [*self.kinds]}] if self.named else []), *tables])
        lists = {"type": "array", "items": one}, {"type": "object", "additionalProperties": one}
        return any_of([one, *lists]) if self.several else one


Factor = Annotated[
    History | Callable[[Any], Any] | None,
    Check(lambda _, history: as_history(history)),
    Read(KindOf(history_from, HISTORIES, named=False)),
]


class Part(Checked):
    """A load, a support, a point mass or a kind of damping: a frozen data class.

    The keys of its table in a case file are its arguments; see `foldyn.arguments`.

    Attributes
    ----------
    apart : str
        Message if a table has keys of this kind and of another kind.
    """

    apart: ClassVar[str] = ""

    @classmethod
    def term(cls, parts: Sequence[tuple[str, Any]], structure: Discretized) -> Term | None:
        """Energy term of all parts of this kind, each given with its place; None without a term."""
        return None

    @classmethod
    def family(cls) -> type[Part]:
        """Kind whose parts, of all subclasses, make one term together."""
        return cls

    @classmethod
    def by_key(cls) -> dict[str, str]:
        """Names of the arguments by the keys of the table."""
        return {argument.key: name for name, argument in arguments(cls).items()}

    def table(self) -> dict[str, Any]:
        """The part's table of plain values, without histories and arguments that are None."""
        given = {key: getattr(self, name) for key, name in self.by_key().items()}
        some = {key: value for key, value in given.items() if not key.endswith("history")}
        return {
            key: value.table() if isinstance(value, Part) else plain(value)
            for key, value in some.items()
            if value is not None
        }


class PartOf(Check):
    """A table of one of several kinds of parts; its keys determine the kind.

    Candidates are the kinds that alone have one of the keys in the table; without such a key, all
    kinds. The first candidate that has all keys in the table is chosen; if there is none, the last
    candidate.

    Parameters
    ----------
    kinds : sequence of type
    section : str
        Name of the list in a case file that holds the tables.
    asked : str
        Remedy in the message if the table has no keys.
    **refused
        Forbidden keys, each with a reason.
    """

    def __init__(
        self, kinds: Sequence[type[Part]], section: str, asked: str = "", **refused: str
    ) -> None:
        super().__init__(self._read)
        self.kinds, self.section, self.asked, self.refused = kinds, section, asked, refused
        self.unless: frozenset[str] = frozenset()

    def without(self, *unless: str, **refused: str) -> PartOf:
        """Copy that forbids some keys, each with the reason, unless a table has certain others."""
        other = PartOf(self.kinds, self.section, self.asked, **refused)
        other.unless = frozenset(unless)
        return other

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """See `Check`."""
        return any_of(schema_of(kind, definitions, self.refused) for kind in self.kinds)

    def _read(self, name: str, value: Any, folder: Path | None = None) -> Any:
        for key, why in self.refused.items():
            if isinstance(value, Mapping) and key in value and not (self.unless & value.keys()):
                raise InputError(f" = {show(value[key])}: {why}", f"{name}.{key}")
        return self._made(name, value, folder)

    def _made(self, name: str, value: Any, folder: Path | None) -> Any:
        return read(self._kind(name, value), name, value, folder)

    def _kind(self, name: str, value: Any) -> type[Part]:
        table = check_table(name, value)
        keys = {kind: kind.by_key() for kind in self.kinds}
        counts = Counter(key for known in keys.values() for key in known)
        check_keys(table, sorted(counts, key="history".__eq__), name)
        given = [key for key in table if key != "history"]
        if not given:
            asked = self.asked or ", or ".join(" and ".join(needs(kind)) for kind in self.kinds)
            raise InputError(f": give {asked}", name)
        own = [key for key in given if counts[key] == 1] or given
        fit = [kind for kind in self.kinds if keys[kind].keys() & own]
        kind = next((kind for kind in fit if keys[kind].keys() >= table.keys()), fit[-1])
        others = [key for key in table if key not in keys[kind]]
        if others:
            first = next(key for key in own if key in keys[kind])
            each = f", or write [[{self.section}]] for each" if self.section else ""
            raise InputError(
                f": {kind.apart}; leave out {' and '.join(others)}{each}", f"{name}.{first}"
            )
        return kind
