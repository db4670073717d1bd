"""Parts of a case, loads and supports: what each is in a case file, and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.decode import check_keys, history_from
from foldyn.errors import InputError, within
from foldyn.values import plain, show


class Part:
    """A load or a support.

    Attributes
    ----------
    keys : mapping of str to str
        Keys of its table in a case file, and the arguments that they are.
    missing : mapping of str to str
        What messages say of keys that must not be left out; "history" may be among them.
    """

    keys: ClassVar[Mapping[str, str]]
    missing: ClassVar[Mapping[str, str]]

    @classmethod
    def of(cls, table: Mapping[str, Any], folder: Path | None = None) -> Self:
        """Make it of its table; the fields of errors are inside the table.

        Parameters
        ----------
        table : mapping
        folder : Path, optional
            Where relative paths of CSV files start; without it no file is read.
        """
        for key, remedy in cls.missing.items():
            if key not in table:
                raise InputError(f": missing; {remedy}", f".{key}")
        given = {argument: table[key] for key, argument in cls.keys.items() if key in table}
        if "history" in table:
            with within(".history"):
                given["history"] = history_from(table["history"], folder)
        try:
            return cls(**given)
        except InputError as error:
            inside = error.field[len(error.key) :]
            key = next((key for key, name in cls.keys.items() if name == error.key), error.key)
            raise InputError(error.reason, f".{key}{inside}" if key else inside) from None

    def table(self) -> dict[str, Any]:
        """Its table, of plain values, but for the history."""
        return {key: plain(getattr(self, argument)) for key, argument in self.keys.items()}


class Load(Part):
    """A load: what it does at factor 1 of its history, a frozen dataclass.

    A new kind is a subclass that is listed in `loads.LOADS`; `place`, its place among the loads, is
    for messages.

    Attributes
    ----------
    apart : str
        In messages: why it cannot share a table with another load.
    arrows : bool
        Whether pictures show its forces as arrows at the nodes.
    moves : bool
        Whether its history is that of a motion, whose velocity counts.
    """

    apart: ClassVar[str]
    arrows: ClassVar[bool] = False
    moves: ClassVar[bool] = False
    history: Any

    def forces(self, structure: Any, place: str) -> NDArray[np.float64] | None:
        """Forces (n, 3), N, on all nodes; None where it is none."""
        return None

    def loaded(self, structure: Any, place: str) -> NDArray[np.int64]:
        """Nodes on which it acts, of a load that acts on some."""
        return np.zeros(0, np.int64)

    def rest_changes(
        self, structure: Any, place: str
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]] | None:
        """Creases that it actuates, and the change (rad) of their rest angles; None for none."""
        return None

    def check(self, structure: Any, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse what the structure or its held dofs (n, 3) do not allow."""


def given_keys(table: Any, kinds: Iterable[type[Part]]) -> set[str]:
    """Keys of a table that may be one of some kinds of parts."""
    if not isinstance(table, Mapping):
        raise InputError(f" = {show(table)}: must be a table")
    check_keys(table, dict.fromkeys([*(key for kind in kinds for key in kind.keys), "history"]))
    return set(table)
