"""Checks of the arguments that the generators share."""

from __future__ import annotations

import math
import operator
from numbers import Real
from typing import Any

import numpy as np

from foldyn.errors import InputError


def number(
    where: str, name: str, value: Any, low: float, high: float, unit: str, remedy: str = ""
) -> float:
    """Return `value` as a float strictly between `low` and `high`.

    Parameters
    ----------
    where, name : str
        The generator and its argument, for the message.
    value : object
        What was given.
    low, high : float
        Exclusive limits.
    unit : str
        Unit of the argument, for the message.
    remedy : str
        More to say, appended to the message.

    Raises
    ------
    InputError
        Not a finite real number, or outside the limits.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real):
        raise InputError(f"{where}: {name} = {value!r}: must be a number ({unit}).")
    result = float(value)
    if not math.isfinite(result) or not low < result < high:
        limits = f"above {low:g}" if math.isinf(high) else f"between {low:g} and {high:g}"
        raise InputError(f"{where}: {name} = {value}: must be {limits} {unit}{remedy}.")
    return result


def length(where: str, name: str, value: Any) -> float:
    """Return a positive length (m)."""
    return number(where, name, value, 0.0, math.inf, "meters")


def count(where: str, name: str, value: Any, least: int) -> int:
    """Return an integer of at least `least`."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        result = operator.index(value)
    except TypeError:
        raise InputError(f"{where}: {name} = {value!r}: must be an integer.") from None
    if result < least:
        raise InputError(f"{where}: {name} = {value}: must be at least {least}.")
    return result


def cell_counts(where: str, value: Any) -> tuple[int, int]:
    """Return the numbers of unit cells along x and y."""
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        along_x, along_y = value
    except (TypeError, ValueError):
        raise InputError(
            f"{where}: cells = {value!r}: must be two integers, the unit cells along x and y."
        ) from None
    return count(where, "cells[0]", along_x, 1), count(where, "cells[1]", along_y, 1)


def fold_dihedral(where: str, value: Any, *, flat_allowed: bool) -> float:
    """Return the smaller angle of a fold (degrees), between 0 and 180, 180 only if allowed."""
    if flat_allowed and isinstance(value, Real) and float(value) == 180.0:
        return 180.0
    remedy = (
        ", or 180 (flat)" if flat_allowed else " (at both of which the sheet closes to a line)"
    ) + "; it is the smaller angle of the fold, for valleys and mountains alike"
    return number(where, "dihedral", value, 0.0, 180.0, "degrees", remedy)


def panel_angle(where: str, value: Any) -> float:
    """Return the acute corner angle of a panel (degrees)."""
    remedy = "; it is the acute corner of the panel, so give 180 minus an obtuse one"
    return number(where, "panel_angle", value, 0.0, 90.0, "degrees", remedy)


def grid_faces(rows: int, columns: int) -> list[tuple[int, int, int, int]]:
    """Quads of a grid whose vertex (i, j) is number i (columns + 1) + j.

    Parameters
    ----------
    rows, columns : int
        Numbers of panels along i (x) and j (y).

    Returns
    -------
    list of tuple of int
        Counter-clockwise seen from +z, running along i first.
    """
    step = columns + 1
    return [
        (i * step + j, (i + 1) * step + j, (i + 1) * step + j + 1, i * step + j + 1)
        for j in range(columns)
        for i in range(rows)
    ]
