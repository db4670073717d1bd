"""What a pattern may say of its creases beside their letters: angles to fold to, families."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.topology import edge_lookup, vertex_pair
from foldyn.values import show, suggest

ASSIGNED: Mapping[str, str] = {
    "all": "MVU", "mountain": "M", "valley": "V", "flat": "F", "unassigned": "U",
}  # fmt: skip
"""Words that stand for creases of every pattern, and the letters that each means."""


def fold_angles(given: Any, creases: NDArray[np.int64]) -> NDArray[np.float64]:
    """Angles (nc,), rad, valleys positive, NaN where none is given; `given` as `Pattern` takes."""
    angles = np.full(len(creases), np.nan)
    if given is None:
        return angles
    if isinstance(given, Mapping):
        row = edge_lookup(creases)
        for key, angle in given.items():
            pair = vertex_pair("fold_angles", key)
            if pair not in row:
                raise InputError(f": {pair} is not a crease; name its two vertices", "fold_angles")
            angles[row[pair]] = _angle(angle)
        return angles
    try:
        entries = list(given)
    except TypeError:
        raise InputError(
            f" = {given!r}: give an angle (rad) for each crease, a mapping from vertex pairs, or "
            "None",
            "fold_angles",
        ) from None
    if len(entries) != len(creases):
        raise InputError(
            f" has {len(entries)} angles for {len(creases)} creases: give one for each, NaN for "
            "none, or a mapping from vertex pairs",
            "fold_angles",
        )
    angles[:] = [_angle(angle) for angle in entries]
    return angles


def _angle(value: Any) -> float:
    if value is None:
        return np.nan
    good = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if not good or np.isinf(value) or abs(value) > np.pi * (1.0 + 1e-12):
        raise InputError(
            f": {value!r}: give angles from -pi (a closed mountain) to pi (a closed valley), in "
            "radians",
            "fold_angles",
        )
    return float(value)


def families(given: Any, creases: NDArray[np.int64]) -> Mapping[str, NDArray[np.int64]]:
    """Rows of the creases of each family; `given` as `Pattern` takes it."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise InputError(f" = {given!r}: give a mapping from names to creases", "families")
    row, rows = edge_lookup(creases), {}
    for name, members in given.items():
        if not isinstance(name, str) or not name or name in ASSIGNED:
            raise InputError(
                f": {name!r} is no name for a family: give text other than {', '.join(ASSIGNED)}",
                "families",
            )
        pairs = [vertex_pair(f"families[{name!r}]", member) for member in members]
        strange = [pair for pair in pairs if pair not in row]
        if strange:
            raise InputError(
                f": {strange[0]} is not a crease; name the two vertices of each",
                f"families[{name!r}]",
            )
        rows[name] = np.array(sorted({row[pair] for pair in pairs}), dtype=np.int64)
        rows[name].setflags(write=False)
    return rows


def crease_rows(field: str, word: str, pattern: Any, is_key: bool = False) -> NDArray[np.int64]:
    """Rows of the creases that a word stands for: an assignment, "all", or a family.

    Parameters
    ----------
    field : str
        Name of the argument, for messages.
    word : str
    pattern : Pattern
    is_key : bool
        Whether the word is the last part of the field, and not its value.

    Returns
    -------
    ndarray of int, shape (k,)
        Increasing, k >= 1.

    Raises
    ------
    InputError
        The pattern has no family of that name, or no crease of that assignment.
    """
    said = ": " if is_key else f" = {show(word)}: "
    if word in pattern.families:
        rows = pattern.families[word]
        what = f"in its family {show(word)}"
    elif word in ASSIGNED:
        letters = ASSIGNED[word]
        rows = np.flatnonzero([letter in letters for letter in pattern.assignments])
        what = "that is not flat" if word == "all" else f"assigned {word}"
    else:
        known = [*ASSIGNED, *pattern.families]
        raise InputError(
            f"{said}{suggest(word, known)}this pattern knows "
            f"{', '.join(map(show, known))}; give one of these, or crease numbers, as in [0, 1]",
            field,
        )
    if not rows.size:
        raise InputError(
            f"{said}this pattern has no crease {what}; give crease numbers, or "
            "assignments to the pattern",
            field,
        )
    return rows


def crease_values(
    field: str, given: Mapping[str, float], pattern: Any
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Value of each crease (nc,) from values by word, and whether it has one (nc,).

    Raises
    ------
    InputError
        A word stands for no crease, or two of them for the same.
    """
    count = len(pattern.creases)
    values, chosen = np.zeros(count), np.zeros(count, bool)
    for word, value in given.items():
        rows = crease_rows(f"{field}.{word}", word, pattern, is_key=True)
        twice = rows[chosen[rows]]
        if twice.size:
            raise InputError(
                f" = {value:g}: crease {twice[0]} has a value by another name already; give each "
                "crease one",
                f"{field}.{word}",
            )
        values[rows], chosen[rows] = value, True
    return values, chosen
