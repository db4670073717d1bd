"""Optional data of a pattern's creases: letters, target fold angles, families, periods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.topology import edge_rows, vertex_pair
from foldyn.values import listed, show, single, suggest

# Words that select creases in every pattern, and the letters that each word selects.
ASSIGNED: Mapping[str, str] = {
    "all": "MVU", "mountain": "M", "valley": "V", "flat": "F", "unassigned": "U",
}  # fmt: skip


class Named(NamedTuple):
    """Letters and families of creases, so that words can select creases."""

    assignments: Sequence[str]
    families: Mapping[str, NDArray[np.int64]]


def letters_by_pair(given: Any, named: Mapping[str, Any], creases: NDArray[np.int64]) -> Any:
    """Letters by vertex pairs; letters of families go to their creases, and pairs override them."""
    words = [key for key in given if isinstance(key, str)] if isinstance(given, Mapping) else []
    if not words:
        return given
    own = {key: letter for key, letter in given.items() if not isinstance(key, str)}
    alone = {vertex_pair("assignments", key) for key in own}
    letters: dict[Any, Any] = {}
    for word in words:
        if word not in named:
            known = f"has {', '.join(map(show, named))}" if named else "has none"
            raise InputError(
                f": is no family; {suggest(word, named)}this pattern {known}; give a family, or "
                "pairs of vertices, as (0, 1)",
                f"assignments.{word}",
            )
        for pair in map(tuple, creases[named[word]].tolist()):
            if letters.setdefault(pair, given[word]) != given[word]:
                raise InputError(
                    f" = {show(given[word])}: crease {pair} has a letter by another family already",
                    f"assignments.{word}",
                )
    return {pair: letter for pair, letter in letters.items() if pair not in alone} | own


def fold_angles(given: Any, creases: NDArray[np.int64], named: Named) -> NDArray[np.float64]:
    """Angles (nc,), rad, valleys positive, NaN if not given; `given` as in `Pattern`."""
    angles = np.full(len(creases), np.nan)
    if given is None:
        return angles
    if isinstance(given, Mapping):
        row = edge_rows(creases)
        for word in (key for key in given if isinstance(key, str)):
            rows = folded_rows(f"fold_angles.{word}", word, named)
            angles[rows] = _own_way(word, _angle(given[word]), np.array(named.assignments)[rows])
        for key, angle in given.items():
            if isinstance(key, str):
                continue  # pairs come last, since they override words
            pair = vertex_pair("fold_angles", key)
            if pair not in row:
                raise InputError(f": {pair} is not a crease; name its two vertices", "fold_angles")
            angles[row[pair]] = _angle(angle)
        return angles
    what = "angles (rad), one for each crease, or a mapping from vertex pairs, or None"
    entries = listed("fold_angles", given, what)
    if len(entries) != len(creases):
        raise InputError(
            f" has {len(entries)} angles for {len(creases)} creases: give one for each, NaN for "
            "none, or a mapping from vertex pairs",
            "fold_angles",
        )
    angles[:] = [_angle(angle) for angle in entries]
    return angles


def _own_way(word: str, size: float, letters: NDArray[np.str_]) -> NDArray[np.float64]:
    """Angles (rad) of selected creases: a size, with the sign given by each crease's letter."""
    signs = np.select([letters == "V", letters == "M"], [1.0, -1.0], 0.0)
    if size < 0.0 or (size > 0.0 and not signs.all()):
        why = "is a size, as each crease folds its own way; give at least 0"
        if size > 0.0:
            why = "some of them are neither mountain nor valley; give angles by vertex pairs"
        raise InputError(f" = {size:g}: {why}", f"fold_angles.{word}")
    return signs * size


def _angle(value: Any) -> float:
    value = single(value)
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


def families(
    given: Any, creases: NDArray[np.int64], field: str = "families", what: str = "a crease"
) -> Mapping[str, NDArray[np.int64]]:
    """Row numbers of the creases (or other edges) in each family; `given` as in `Pattern`."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise InputError(f" = {given!r}: give a mapping from names to creases", field)
    row, rows = edge_rows(creases), {}
    for name, members in given.items():
        if not isinstance(name, str) or not name or name in ASSIGNED:
            raise InputError(
                f": {name!r} is no name for a family: give text other than {', '.join(ASSIGNED)}",
                field,
            )
        place = f"{field}[{name!r}]"
        members = listed(place, members, "pairs of vertices, as [(0, 1)]")
        pairs = [vertex_pair(place, member) for member in members]
        strange = [pair for pair in pairs if pair not in row]
        if strange:
            raise InputError(f": {strange[0]} is not {what}; name the two vertices of each", place)
        own = sorted(chain.from_iterable(row[pair] for pair in {*pairs}))
        rows[name] = np.array(own, dtype=np.int64)
        rows[name].setflags(write=False)
    return rows


def crease_rows(field: str, word: str, pattern: Any, is_key: bool = False) -> NDArray[np.int64]:
    """Row numbers of the creases that a word selects: an assignment, "all", or a family.

    Parameters
    ----------
    field : str
        Name of the argument, for messages.
    word : str
    pattern : Pattern
    is_key : bool
        Whether the word is the last part of the field's name, rather than the value of the field.

    Returns
    -------
    ndarray of int, shape (k,)
        Row numbers in increasing order, k >= 1.

    Raises
    ------
    InputError
        The pattern has no family with this name, or no crease with this assignment.
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


def folded_rows(field: str, word: str, pattern: Any) -> NDArray[np.int64]:
    """Like `crease_rows` for a key; "all" skips unassigned creases if there are assigned ones."""
    rows = crease_rows(field, word, pattern, is_key=True)
    known = rows[[pattern.assignments[k] in "MV" for k in rows.tolist()]]
    return known if word == "all" and len(known) else rows


def crease_values(
    field: str, given: Mapping[str, float], pattern: Any
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Value of each crease (nc,), from values by word, and whether the crease has a value (nc,).

    Raises
    ------
    InputError
        A word selects no crease, or two words select the same crease.
    """
    count = len(pattern.creases)
    values, chosen = np.zeros(count), np.zeros(count, bool)
    for word, value in given.items():
        rows = crease_rows(f"{field}.{word}", word, pattern, is_key=True)
        twice = rows[chosen[rows]]
        if twice.size:
            raise InputError(
                f": crease {twice[0]} has a value by another name already; give each crease one",
                f"{field}.{word}",
            )
        values[rows], chosen[rows] = value, True
    return values, chosen


def periods(given: Any, count: int) -> tuple[NDArray[np.int64], ...]:
    """Pairs (m, 2) of vertices and their images under each period; `given` as in `Pattern`.

    count : number of vertices.
    """
    found = []
    what = "pairs of a vertex and its image, as [(0, 6), (1, 7)]"
    for k, pairs in enumerate(listed("periods", given, "pairs of vertices for each motion")):
        rows = listed(f"periods[{k}]", pairs, what)
        try:
            array = np.array(rows)
        except ValueError:
            array = np.zeros(0)
        good = array.ndim == 2 and array.shape[1:] == (2,) and array.dtype.kind in "iu"
        if not good or not len(array):
            raise InputError(f" = {show(pairs)}: give {what}", f"periods[{k}]")
        beyond = array[(array < 0) | (array >= count)]
        if beyond.size:
            raise InputError(f": there is no vertex {beyond[0]} of {count}", f"periods[{k}]")
        array = array.astype(np.int64)
        array.setflags(write=False)
        found.append(array)
    return tuple(found)
