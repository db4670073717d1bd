"""How far actuated creases fold: by dihedral, by fold angle, or by a fraction of fully folded.

The fold angle is that of the FOLD format: 0 where the panels are flat, positive for a valley,
negative for a mountain, 180 or -180 degrees where it is closed. It is the dihedral of the flat
panels less the dihedral: 180 degrees less it, but for thick panels (`Pattern.flat_dihedrals`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.values import doubt_degrees, number, number_or_list, one_or_each, parsed, show

SIGNS: Mapping[str, float] = {"V": 1.0, "M": -1.0}
"""Sign of the fold angle of each assignment."""
ROUNDING = 1e-9  # degrees
Angles = float | tuple[float, ...]
PerCrease = float | Sequence[float]


def check_angles(name: str, value: Any) -> Angles:
    """Return a dihedral (degrees) for all creases, or a tuple of one for each."""
    return _within(name, value, 0.0, 360.0, " (flat: 180)")


def check_fold_angles(name: str, value: Any) -> Angles:
    """Return a fold angle (degrees) for all creases, or a tuple of one for each."""
    return _within(name, value, -180.0, 180.0, " (flat: 0; valleys above, mountains below)")


def check_fraction(name: str, value: Any) -> float:
    """Return a fraction between 0 and 1 from a number, or from a text as "80%"."""
    given = value
    if isinstance(value, str):
        try:
            given = parsed(value.strip().removesuffix("%")) / 100.0
        except ValueError:
            given = None
        if given is None or not value.strip().endswith("%"):
            raise InputError(
                f' = {show(value)}: must be as in "80%", or a number from 0 to 1', name
            )
    return number(name, given, least=0.0, most=1.0)


def _within(name: str, value: Any, low: float, high: float, hint: str) -> Angles:
    checked = number_or_list(name, value, "crease")
    listed = isinstance(checked, tuple)
    for i, angle in enumerate(checked if listed else (checked,)):
        if not low <= angle <= high:
            place = f"{name}[{i}]" if listed else name
            raise InputError(
                f" = {angle:g}: must lie between {low:g} and {high:g} degrees{hint}", place
            )
    doubt_degrees(name, checked)
    return checked


def dihedrals(
    angle: Angles | None,
    fold_angle: Angles | None,
    fraction: float | None,
    assigned: bool,
    letters: NDArray[np.str_],
    flat: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Dihedrals (degrees) of creases (nc,); one of the first three is given.

    letters, flat : their assignments, and their dihedrals (degrees) where the panels are flat.
    assigned : whether the creases were chosen by their assignment, so that one fold angle for all
        of them is a size, and each folds the way it is assigned.
    """
    if angle is not None:
        return one_or_each("angle", angle, len(letters), "creases")
    if fraction is not None:
        return flat - 180.0 * fraction * _signs("fraction", letters)
    folded = one_or_each("fold_angle", fold_angle, len(letters), "creases")
    if not assigned or isinstance(fold_angle, tuple):
        return flat - folded
    if folded[0] < 0.0:
        raise InputError(
            f" = {folded[0]:g}: is a size for creases chosen by assignment, each of which folds "
            "its own way; give at least 0",
            "fold_angle",
        )
    return flat - folded * _signs("fold_angle", letters)


def within_reach(angles: NDArray[np.float64], creases: NDArray[np.int64]) -> NDArray[np.float64]:
    """Dihedrals (degrees) from 0 to 360, rounding apart, as thick panels may leave them."""
    beyond = creases[(angles < -ROUNDING) | (angles > 360.0 + ROUNDING)]
    if beyond.size:
        raise InputError(
            f": crease {beyond[0]} cannot fold that far: its thick panels are hinged on the other "
            "side; fold it less, or give its hinge another offset",
        )
    return np.clip(angles, 0.0, 360.0)


def _signs(name: str, letters: NDArray[np.str_]) -> NDArray[np.float64]:
    """Sign of the fold angle of each crease, which must be a mountain or a valley."""
    unknown = [letter for letter in letters.tolist() if letter not in SIGNS]
    if unknown:
        what = {"F": "flat", "U": "unassigned"}[unknown[0]]
        raise InputError(
            f": a crease is {what}, so that it has no way to fold; give mountains and valleys, or "
            "an angle for each crease",
            name,
        )
    return np.array([SIGNS[letter] for letter in letters.tolist()])
