"""Axes, directions and pairs of nodes, as supports and loads name them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.values import choice, indices, show, single, vector

AXES = "xyz"
DIRECTIONS = ("x", "y", "z", "-x", "-y", "-z")


def check_axis(name: str, axis: Any) -> str:
    """Return the name of one axis."""
    if not isinstance(axis, str) or axis not in tuple(AXES):
        raise InputError(f' = {show(axis)}: must be one of "x", "y" and "z"', name)
    return axis


def check_axes(name: str, axes: Any) -> str:
    """Return the letters of some axes, each once."""
    if not isinstance(axes, str) or not axes or set(axes) - set(AXES):
        raise InputError(f' = {show(axes)}: must be letters of "xyz", as in "xz"', name)
    if len(set(axes)) < len(axes):
        raise InputError(f" = {show(axes)}: an axis is listed twice", name)
    return axes


def check_direction(name: str, direction: Any) -> str | tuple[float, ...]:
    """Return a direction as it was given: a vector that is not zero, or a name such as "-z"."""
    if isinstance(direction, str):
        return choice(name, direction, DIRECTIONS)
    return vector(name, direction, nonzero=True)


Axis = Annotated[str, Check(check_axis, words=AXES)]
Axes = Annotated[str, Check(check_axes)]
Direction = Annotated[str | Sequence[float], Check(check_direction)]


def unit_vector(direction: Any) -> NDArray[np.float64]:
    """Unit vector (3,) of a checked direction."""
    if isinstance(direction, str):
        axis, sign = signed("direction", direction)
        return sign * np.eye(3)[axis]
    return np.array(direction) / np.linalg.norm(direction)


def signed(name: str, direction: Any) -> tuple[int, float]:
    """Return the number of the axis and the sign of a direction: "-z" is (2, -1)."""
    direction = choice(name, direction, DIRECTIONS)
    return AXES.index(direction[-1]), -1.0 if direction.startswith("-") else 1.0


def check_pairs(name: str, value: Any) -> tuple[tuple[int, int], ...]:
    """Return pairs of different nodes, from one pair or several."""
    value = single(value)
    listed = value if isinstance(value, list | tuple | np.ndarray) else ()
    several = len(listed) > 0 and all(isinstance(one, list | tuple | np.ndarray) for one in listed)
    pairs = []
    for k, pair in enumerate(listed if several else [value]):
        place = f"{name}[{k}]" if several else name
        numbers = () if isinstance(pair, str) else indices(place, pair, "node", "as in [0, 5]")
        if len(numbers) != 2 or min(numbers) < 0:
            raise InputError(
                f" = {show(pair)}: must be two nodes, as in [0, 5], or pairs of them", place
            )
        pairs.append((numbers[0], numbers[1]))
    return tuple(pairs)


Pairs = Annotated[Sequence[int] | Sequence[Sequence[int]], Check(check_pairs)]
