"""Key paths of a case file: "sheet.thickness", "model.fold_law.theta1", "loads[0].force[2]"."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from typing import Any

from foldyn.errors import InputError
from foldyn.values import show

LONGEST = 200
"""Characters of a path: no case file has one as deep."""
_KEY = re.compile(r"[A-Za-z_]\w*(\[\d+\])*(\.[A-Za-z_]\w*(\[\d+\])*)*\Z")


def parts(key: Any) -> tuple[str | int, ...]:
    """Keys and indices of a path: "loads[0].force" becomes ("loads", 0, "force").

    Raises
    ------
    InputError
        The text is no path.
    """
    if not isinstance(key, str) or len(key) > LONGEST or not _KEY.match(key):
        raise InputError(
            f"{show(key)}: is no key of a case file; write the section and the key, as in "
            '"sheet.thickness" or "loads[0].force[2]"'
        )
    return tuple(int(p) if p.isdigit() else p for p in re.findall(r"\w+", key))


def value_at(document: Mapping[str, Any], key: str) -> Any:
    """What a case file says at a path; None where it says nothing."""
    here: Any = document
    for part in parts(key):
        if isinstance(part, int):
            here = here[part] if isinstance(here, list) and part < len(here) else None
        else:
            here = here.get(part) if isinstance(here, Mapping) else None
    return here


def number_keys(document: Mapping[str, Any]) -> list[str]:
    """Paths of all numbers that a case file names, but for those in lists."""
    found: list[str] = []
    for key, value in document.items():
        if isinstance(value, Mapping):
            found += [f"{key}.{inner}" for inner in number_keys(value)]
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found.append(key)
    return found


def replaced(document: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Copy of a case file with the values of some paths replaced or added.

    Tables that are missing are made, and a law given by its name becomes a table of that kind;
    whether a case file may have such a key is for its reader to say.

    Raises
    ------
    InputError
        A path leads through something that is no table or list, or beyond the end of a list.
    """
    result = copy.deepcopy(dict(document))
    for key, value in changes.items():
        *way, last = parts(key)
        here: Any = result
        for place, part in enumerate(way):
            here = _step(here, part, key)[part]
            following = parts(key)[place + 1]
            if isinstance(here, str) and isinstance(following, str):
                here = _as_table(result, way[: place + 1], here)
        _step(here, last, key)[last] = value
    return result


def _step(here: Any, part: str | int, key: str) -> Any:
    """The table or list that holds the next part of a path."""
    if isinstance(part, int):
        if not isinstance(here, list):
            raise InputError(f"{key}: [{part}] needs a list, but there is {show(here)}")
        if part >= len(here):
            raise InputError(f"{key}: there are only {len(here)} entries, [0] to [{len(here) - 1}]")
        return here
    if not isinstance(here, dict):
        raise InputError(f"{key}: .{part} needs a table, but there is {show(here)}")
    here.setdefault(part, {})
    return here


def _as_table(document: dict[str, Any], way: list[str | int], kind: str) -> dict[str, Any]:
    """Put ``{ kind = "enhanced" }`` in the place of "enhanced"."""
    holder: Any = document
    for part in way[:-1]:
        holder = holder[part]
    holder[way[-1]] = {"kind": kind}
    return holder[way[-1]]
