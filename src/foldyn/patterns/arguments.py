"""Checks of the arguments that the generators share."""

from __future__ import annotations

from numbers import Real
from typing import Any

from foldyn import values
from foldyn.errors import InputError
from foldyn.memory import check_memory
from foldyn.values import show

PER_VERTEX = 2200.0
"""Bytes a vertex of a pattern as it is made: 1800 measured with 10,000 and 40,000 vertices."""


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
    result = values.number(f"{where}: {name}", value, unit=unit)
    if not low < result < high:
        raise InputError(
            f"{where}: {name} = {value}: must be between {low:g} and {high:g} {unit}{remedy}."
        )
    return result


def length(where: str, name: str, value: Any) -> float:
    """Return a positive length (m)."""
    return values.length(f"{where}: {name}", value)


def count(where: str, name: str, value: Any, least: int) -> int:
    """Return an integer of at least `least`."""
    return values.whole(f"{where}: {name}", value, least=least)


def check_size(where: str, fields: str, vertices: int) -> None:
    """Refuse a pattern that memory cannot hold, before it is made.

    fields : names and values of the arguments that make it large.
    """
    check_memory(
        f"{where}: {fields}", f"a pattern of {vertices:.3g} vertices", PER_VERTEX * vertices,
        "take fewer",
    )  # fmt: skip


def cell_counts(where: str, value: Any) -> tuple[int, int]:
    """Return the numbers of unit cells along x and y."""
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        along_x, along_y = value
    except (TypeError, ValueError):
        raise InputError(
            f"{where}: cells = {show(value)}: must be two integers, the unit cells along x and y."
        ) from None
    nx, ny = count(where, "cells[0]", along_x, 1), count(where, "cells[1]", along_y, 1)
    check_size(where, f"cells = {show([nx, ny])}", (2 * nx + 1) * (2 * ny + 1))
    return nx, ny


def fold_dihedral(where: str, value: Any, *, flat_allowed: bool) -> float:
    """Return the smaller angle of a fold (degrees), between 0 and 180, 180 only if allowed."""
    if flat_allowed and isinstance(value, Real) and value == 180:
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
