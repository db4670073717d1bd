"""Checks of the arguments of generators."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from foldyn.errors import InputError
from foldyn.ram_limit import check_memory
from foldyn.values import length, number, show, whole

# Bytes per vertex while a pattern is generated: 1800 measured with 10,000 and 40,000 vertices.
PER_VERTEX = 2200.0
ROUND = 360.0 * (1.0 + 1e-12)  # degrees


def angle_between(name: str, value: Any, low: float, high: float, remedy: str = "") -> float:
    """Return an angle (degrees) strictly between `low` and `high`; messages end with `remedy`."""
    angle = number(name, value, unit="degrees")
    if not low < angle < high:
        raise InputError(f" = {value}: must be between {low:g} and {high:g} degrees{remedy}.", name)
    return angle


def fold_dihedral(
    value: Any,
    *,
    flat_allowed: bool = True,
    least: float = 0.0,
    otherwise: str = "at both of which the sheet closes to a line",
) -> float:
    """Return the smaller angle of a fold (degrees), between 0 and 180; 180 only if allowed.

    least : angle (degrees) at which the pattern is already closed.
    otherwise : what happens at the limits if flat is not allowed.
    """
    if flat_allowed and isinstance(value, Real) and value == 180:
        return 180.0
    remedy = ", or 180 (flat)" if flat_allowed else f" ({otherwise})"
    remedy += "; it is the smaller angle of the fold, for valleys and mountains alike"
    return angle_between("dihedral", value, least, 180.0, remedy)


def acute(name: str, value: Any) -> float:
    """Return an acute angle (degrees) of a panel, in radians."""
    remedy = "; it is the acute corner of the panel, so give 180 minus an obtuse one"
    return math.radians(angle_between(name, value, 0.0, 90.0, remedy))


def check_size(fields: str, vertices: int) -> None:
    """Refuse a pattern too large for the memory, before it is generated.

    fields : names and values of the arguments that make it large.
    """
    size = f"a pattern of {vertices:.3g} vertices"
    check_memory(fields, size, PER_VERTEX * vertices, "take fewer")


def cell_counts(cells: Any, per_cell: int) -> tuple[int, int]:
    """Return the numbers of cells along x and y of a sheet, given the vertices per cell."""
    nx, ny = two_counts("cells", cells, "integers, for x and y")
    check_size(f"cells = {show([nx, ny])}", per_cell * nx * ny)
    return nx, ny


def two_counts(name: str, given: Any, what: str) -> tuple[int, int]:
    """Return two whole numbers of at least 1; `what` says in a message what to give two of."""
    try:
        if isinstance(given, (str, bytes)):
            raise TypeError
        first, second = given
    except (TypeError, ValueError):
        raise InputError(f" = {show(given)}: give two {what}", name) from None
    return whole(f"{name}[0]", first, least=1), whole(f"{name}[1]", second, least=1)


def sizes(a: Any, b: Any) -> tuple[float, float]:
    """Return two lengths (m)."""
    return length("a", a), length("b", b)


def check_turn(name: str, count: int, turn: float, what: str) -> None:
    """Refuse a sheet that rolls up by more than a full turn.

    turn : degrees by which each of `count` rows, or of the parts named by `what`, turns relative to
    the last.
    """
    if abs(turn) * count > ROUND:
        most = math.floor(ROUND / abs(turn))
        raise InputError(
            f" = {count}: each of the {count} {what} is turned by {abs(turn):.4g} degrees from the "
            f"last, so that the sheet rolls up by more than a full turn and passes through itself; "
            f"take at most {most} {what}, or another dihedral",
            name,
        )
