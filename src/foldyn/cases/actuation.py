"""Actuation: creases whose rest angle changes, and how creases are chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.function import as_history
from foldyn.cases.histories import History
from foldyn.cases.part import Load
from foldyn.errors import InputError
from foldyn.values import indices, number_or_list, show, suggest

SELECTIONS: Mapping[str, str] = {"all": "MVU", "mountain": "M", "valley": "V"}
"""Words for creases, and the assignments that each means."""


@dataclass(frozen=True)
class Actuate(Load):
    """Creases that fold or unfold by themselves.

    The rest dihedral of each crease moves from its rest value (`Structure.fold_rest`) to `angle`
    in proportion to the factor of the history.

    Parameters
    ----------
    creases : int, sequence of int, or {"all", "mountain", "valley"}
        Numbers in the order of `pattern.creases`, or all creases with an assignment: "mountain",
        "valley", or "all", which are all but the flat ones.
    angle : float or sequence of float
        Rest dihedral (degrees, 0 to 360, flat 180) at factor 1, of all these creases or of each.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    creases: int | str | Sequence[int]
    angle: float | Sequence[float]
    history: History | Callable[[Any], Any] | None = None

    keys = {"creases": "creases", "angle": "angle"}
    missing = dict.fromkeys(keys, "give its value")
    apart = "creases and angle are a load of their own"
    moves = True

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "creases", check_creases("creases", self.creases))
        object.__setattr__(self, "angle", check_angles("angle", self.angle))
        object.__setattr__(self, "history", as_history(self.history))

    def rest_changes(
        self, structure: Any, place: str
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """See `Load`; refuses angles that the fold law cannot be free of stress at."""
        creases = resolve_creases(structure, self.creases, f"{place}.creases")
        angles = np.array(self.angle)
        if angles.ndim and len(angles) != len(creases):
            raise InputError(
                f" = {show(self.angle)}: {len(angles)} angles for {len(creases)} creases; give "
                "one, or one for each",
                f"{place}.angle",
            )
        closed = angles[(angles == 0.0) | (angles == 360.0)]
        if closed.size and not structure.fold_law.closed_at_rest:
            raise InputError(
                f"{place}.angle = {closed[0]:g}: this fold law, free of stress at rest, has an "
                "infinite moment there; give an angle between 0 and 360 degrees (flat: 180), or "
                "another fold_law"
            )
        return creases, np.radians(angles) - structure.fold_rest[creases]


def check_creases(name: str, creases: Any) -> str | tuple[int, ...]:
    """Return a choice of creases, checked but for its range: a word or a tuple of numbers."""
    if isinstance(creases, str):
        if creases not in SELECTIONS:
            words = ", ".join(f'"{word}"' for word in SELECTIONS)
            raise InputError(
                f" = {show(creases)}: {suggest(creases, SELECTIONS)}give crease numbers, as in "
                f"[0, 1], or one of {words}",
                name,
            )
        return creases
    return indices(name, creases, "crease", "or one of " + ", ".join(map(show, SELECTIONS)))


def check_angles(name: str, angle: Any) -> float | tuple[float, ...]:
    """Return a dihedral (degrees) for all creases, or a tuple of one for each."""
    checked = number_or_list(name, angle, "crease")
    listed = isinstance(checked, tuple)
    for i, value in enumerate(checked if listed else (checked,)):
        if not 0.0 <= value <= 360.0:
            place = f"{name}[{i}]" if listed else name
            raise InputError(f" = {value:g}: must lie between 0 and 360 degrees (flat: 180)", place)
    return checked


def resolve_creases(structure: Any, creases: Any, name: str = "creases") -> NDArray[np.int64]:
    """Numbers of creases of a structure from numbers or a word.

    Parameters
    ----------
    structure : Structure
        Its folds bound the numbers; its pattern's assignments serve words.
    creases : str or tuple of int
        As `check_creases` returns them; numbers are kept in the order given.
    name : str
        Name of the field for messages.

    Raises
    ------
    InputError
        The structure has no folds, a number is out of range, or no crease has the assignment.
    """
    count = len(structure.folds)
    if count == 0:
        raise InputError(
            f"{name} = {show(creases)}: this structure has no folds to actuate; give a pattern "
            "with creases"
        )
    if isinstance(creases, str):
        return _assigned(structure.pattern, creases, name)
    chosen = np.array(creases, dtype=np.int64)
    bad = chosen[(chosen < 0) | (chosen >= count)]
    if bad.size:
        raise InputError(
            f"{name} = {show(creases)}: crease {bad[0]} is out of range; this structure has "
            f"creases 0 to {count - 1}"
        )
    return chosen


def _assigned(pattern: Any, word: str, name: str) -> NDArray[np.int64]:
    if pattern is None:
        raise InputError(
            f'{name} = "{word}": this structure has no pattern with assignments; give crease '
            "numbers"
        )
    chosen = np.flatnonzero([letter in SELECTIONS[word] for letter in pattern.assignments])
    if not chosen.size:
        wanted = "that is not flat" if word == "all" else f"assigned {word}"
        raise InputError(
            f'{name} = "{word}": this pattern has no crease {wanted}; give crease numbers, or '
            "assignments to the pattern"
        )
    return chosen
