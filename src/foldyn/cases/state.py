"""A state: displacement and velocity of every node."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from foldyn.errors import InputError
from foldyn.values import brief, numbers


@brief
@dataclass(frozen=True, eq=False)
class State:
    """Displacement and velocity of every node, for example to start a motion from.

    Parameters
    ----------
    displacement : array_like, shape (n, 3), optional
        Displacement (m) of every node from its rest position; zero by default.
    velocity : array_like, shape (n, 3), optional
        Velocity (m/s) of every node; zero by default.
    """

    displacement: ArrayLike | None = None
    velocity: ArrayLike | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        shapes = set()
        for name in ("displacement", "velocity"):
            value = getattr(self, name)
            if value is None:
                continue
            array = numbers(name, value)
            if array.ndim != 2 or array.shape[1] != 3:
                raise InputError(f"{name}: shape {array.shape}: must be (nodes, 3)")
            shapes.add(array.shape)
            object.__setattr__(self, name, array)
        if len(shapes) == 2:
            raise InputError("displacement and velocity: must have the same shape")
