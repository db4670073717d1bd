"""A state: displacement and velocity of every node."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.values import brief, choice, numbers


@brief
@dataclass(frozen=True, eq=False)
class Continuation:
    """What an implicit method needs beside a state to go on as if it had not been stopped.

    Parameters
    ----------
    method : str
        The method.
    values : ndarray, shape (k,)
        Its own numbers; those of the displacement come first.
    """

    method: str
    values: NDArray


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
    memory : array_like of shape (b, 2), or "fresh", optional
        State of the branches of laws with memory, as results have it (`memory`). "fresh": every
        hinge has just come from its rest angle. By default those of the law `prony` have had the
        time to relax there, all others are fresh.
    continuation : Continuation, optional
        With which a motion goes on exactly from the end of another one; `initial_state` takes it
        from the result. It serves the same method where the state and the forces are those of the
        end; otherwise the motion starts as without it.
    """

    displacement: ArrayLike | None = None
    velocity: ArrayLike | None = None
    memory: ArrayLike | str | None = None
    continuation: Continuation | None = None

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
        if isinstance(self.memory, str):
            choice("memory", self.memory, ("fresh",))
        elif self.memory is not None:
            object.__setattr__(self, "memory", numbers("memory", self.memory))
        if not isinstance(self.continuation, Continuation | None):
            raise InputError(
                f"continuation: got {type(self.continuation).__name__}; it comes from "
                "fd.initial_state(result)"
            )
        if len(shapes) == 2:
            raise InputError("displacement and velocity: must have the same shape")
