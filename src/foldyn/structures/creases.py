"""Stiffness and rest angles of creases: calibrated, or given for all, each, or by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import crease_values
from foldyn.structures import calibration
from foldyn.structures.mesh import hinge_angles, lengths
from foldyn.structures.sheet import Sheet
from foldyn.values import doubt_degrees, number, numbers, show, single

PerCrease = float | Sequence[float] | Mapping[str, float] | None


def per_crease(name: str, value: Any) -> Any:
    """Return values for creases as a number, a tuple, or a new dict by word; None unchanged.

    Their number and words are checked later, with the pattern.
    """
    if isinstance(value, Mapping):
        if not value:
            raise InputError(": give a value by assignment or family, as { valley = 0.1 }", name)
        strange = [word for word in value if not isinstance(word, str)]
        if strange:
            raise InputError(f": {show(strange[0])} is no assignment or family of creases", name)
        return {word: number(f"{name}.{word}", value[word]) for word in value}
    value = single(value)
    if isinstance(value, list | tuple | np.ndarray):
        return tuple(numbers(name, value).tolist())
    return None if value is None else number(name, value)


def fold_stiffness(given: PerCrease, pattern: Pattern, sheet: Sheet) -> NDArray:
    """Stiffness of whole creases (nf,), N m/rad, calibrated or from the `given` one per length."""
    length = lengths(pattern.vertices, pattern.creases)
    if given is None:
        return calibration.fold_stiffness(length, pattern, sheet)
    per_length, chosen = _values("crease_stiffness", given, pattern)
    if (per_length[chosen] < 0.0).any():
        raise InputError("crease_stiffness: must not be negative")
    if chosen.all():
        return per_length * length
    return np.where(chosen, per_length * length, calibration.fold_stiffness(length, pattern, sheet))


def fold_rest(
    given: PerCrease,
    folds: NDArray,
    x: NDArray,
    pattern: Pattern,
    crease: NDArray | None = None,
) -> NDArray:
    """Rest dihedrals (rad) of hinge rows, none of them closed.

    crease : crease of each row; the creases in order by default.
    """
    crease = np.arange(len(folds)) if crease is None else crease
    degrees, chosen = _values("crease_rest", given, pattern)
    closed = degrees[chosen & ((degrees <= 0.0) | (degrees >= 360.0))]
    if closed.size:
        raise InputError(
            f"crease_rest = {closed[0]:g}: must lie between 0 and 360 degrees (flat: 180)"
        )
    doubt_degrees("crease_rest", degrees[chosen])
    rest, given_there = np.radians(degrees)[crease], chosen[crease]
    if given_there.all():
        return rest
    drawn = hinge_angles(x, folds)
    shut = (drawn < 1e-9) | (drawn > 2.0 * np.pi - 1e-9) | np.isnan(drawn)
    shut |= np.abs(drawn - pattern.dihedrals[crease]) > np.pi  # closed according to its assignment
    wrong = np.flatnonzero(shut & ~given_there)
    if len(wrong):
        number = crease[wrong[0]]
        low, high = pattern.creases[number]
        raise InputError(
            f"crease {number} (vertices {low}, {high}) is folded flat upon itself: open "
            "the pattern, or give crease_rest and start from an opened one"
        )
    return np.where(given_there, rest, drawn)


def _values(field: str, given: PerCrease, pattern: Pattern) -> tuple[NDArray, NDArray]:
    """Value of each crease (nf,), and a mask of the creases with a given value (nf,)."""
    count = len(pattern.creases)
    if given is None:
        return np.zeros(count), np.zeros(count, bool)
    if not isinstance(given, Mapping):
        array = numbers(field, given)
        if array.ndim > 1 or (array.ndim == 1 and len(array) != count):
            raise InputError(
                f"{field}: {array.size} values for {count} creases: give one, or one for each"
            )
        return np.broadcast_to(array, (count,)).copy(), np.ones(count, bool)
    return crease_values(field, given, pattern)
