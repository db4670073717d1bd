"""Target fold angles, from the arguments of `fold`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.loads import check_fold_angles, check_fraction
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import folded_rows, vertex_pair
from foldyn.patterns.topology import edge_lookup
from foldyn.statics.folding.energy import SIGNS
from foldyn.values import show

_NAMES = {"M": "mountain", "V": "valley"}


def full_angles(pattern: Pattern) -> NDArray[np.float64]:
    """Fold angles (nc,), rad, of the pattern when fully folded.

    `Pattern.fold_angles` where given, else 180 degrees for mountains and valleys; nan for flat and
    unassigned creases.
    """
    signs = np.array([SIGNS[letter] for letter in pattern.assignments])
    closed = np.where(signs == 0.0, np.nan, math.pi * signs)
    return np.where(np.isnan(pattern.fold_angles), closed, pattern.fold_angles)


def fold_targets(pattern: Pattern, angles: Any, fraction: Any) -> NDArray[np.float64]:
    """Target fold angles (nc,), rad, nan if a crease is free; arguments as in `fold`.

    Raises
    ------
    InputError
        Both or neither are given; a crease does not exist; an angle contradicts its assignment.
    """
    if angles is not None and fraction is not None:
        raise InputError(": give either angles or fraction", "fraction")
    if angles is None and fraction is None:
        if np.isnan(pattern.fold_angles).all():
            raise InputError(
                ': missing; give it, as in 0.8 or "80%", or angles: this pattern has no fold '
                "angles of its own",
                "fraction",
            )
        fraction = 1.0
    if fraction is not None:
        part = check_fraction("fraction", fraction)
        targets = full_angles(pattern)
        if np.isnan(targets).all():
            raise InputError(
                ": this pattern has neither mountains and valleys nor fold angles; give angles by "
                "vertex pairs, or assignments to the pattern",
                "fraction",
            )
        targets = part * targets
    else:
        targets = _given(pattern, angles)
    _check_ways(pattern, targets)
    return targets


def _given(pattern: Pattern, angles: Any) -> NDArray[np.float64]:
    """Targets (nc,), rad, from angles in degrees."""
    count = len(pattern.creases)
    if isinstance(angles, Pattern):
        if not np.array_equal(angles.creases, pattern.creases):
            raise InputError(
                f": has other creases ({angles!r}) than the pattern to fold ({pattern!r}); give a "
                "state of the same pattern",
                "angles",
            )
        return angles.flat_dihedrals - angles.dihedrals
    if isinstance(angles, Mapping):
        if not angles:
            raise InputError(": is empty; name creases and their angles", "angles")
        targets, row = np.full(count, np.nan), edge_lookup(pattern.creases)
        words = [key for key in angles if isinstance(key, str)]
        for word in words:  # pairs come after words, and refine them
            rows = folded_rows(f"angles.{word}", word, pattern)
            targets[rows] = _sized(pattern, rows, angles[word], f"angles.{word}")
        for key in (key for key in angles if not isinstance(key, str)):
            pair = vertex_pair("angles", key)
            if pair not in row:
                raise InputError(f": {pair} is not a crease; name its two vertices", "angles")
            targets[row[pair]] = math.radians(_angle(f"angles[{pair}]", angles[key]))
        return targets
    if np.ndim(angles) == 0:
        targets, rows = np.full(count, np.nan), folded_rows("angles", "all", pattern)
        targets[rows] = _sized(pattern, rows, angles, "angles")
        return targets
    checked = check_fold_angles("angles", [0.0 if a is None else a for a in angles])
    if np.size(checked) != count:
        raise InputError(
            f" has {np.size(checked)} angles for {count} creases: give one for each (None where a "
            "crease is free), one for all, or a mapping",
            "angles",
        )
    return np.where(np.array([a is None for a in angles], bool), np.nan, np.radians(checked))


def _angle(field: str, value: Any) -> float:
    checked = check_fold_angles(field, value)
    if isinstance(checked, tuple):
        raise InputError(f" = {show(value)}: give one number (degrees)", field)
    return checked


def _sized(pattern: Pattern, rows: NDArray, value: Any, field: str) -> NDArray[np.float64]:
    """Targets (rad) of creases, each folding as assigned, from a size (degrees)."""
    size = _angle(field, value)
    if size < 0.0:
        raise InputError(
            f" = {size:g}: must be at least 0 for creases chosen by a word, since the assignment "
            "decides the direction in which each folds",
            field,
        )
    signs = np.array([SIGNS[pattern.assignments[k]] for k in rows.tolist()])
    if size > 0.0 and (signs == 0.0).any():
        a, b = pattern.creases[rows[signs == 0.0][0]]
        raise InputError(
            f": crease ({a}, {b}) is neither mountain nor valley, so it is unknown in which "
            "direction it folds; give its angle by its vertices",
            field,
        )
    return math.radians(size) * signs


def _check_ways(pattern: Pattern, targets: NDArray) -> None:
    """Refuse angles that contradict the assignments."""
    signs = np.array([SIGNS[letter] for letter in pattern.assignments])
    wrong = np.flatnonzero(np.nan_to_num(targets) * signs < 0.0)
    if wrong.size:
        k = int(wrong[0])
        a, b = pattern.creases[k]
        side = "at most 0" if signs[k] < 0.0 else "at least 0"
        raise InputError(
            f": crease ({a}, {b}) is a {_NAMES[pattern.assignments[k]]}, and "
            f"{math.degrees(targets[k]):g} degrees folds it the other way; give {side}, or another "
            "assignment to the pattern",
            "angles",
        )
