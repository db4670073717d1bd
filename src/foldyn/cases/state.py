"""A state: displacement and velocity of every node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check, Checked, brief
from foldyn.errors import InputError
from foldyn.values import choice, numbers


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
class Origin:
    """Where the motion began that goes on from a state.

    Parameters
    ----------
    displacement : ndarray, shape (n, 3)
        There, m: that about which damping has its `state = "initial"`.
    time : float, optional
        When (s), for the rest angles there; without it those of the constant loads alone.
    flow : ndarray, shape (n, 3), optional
        Displacement (m) at which the flow of added mass was found last; where it goes on unless
        known.
    looked : int
        Steps since it was looked at whether that flow still holds.
    """

    displacement: NDArray
    time: float | None = None
    flow: NDArray | None = None
    looked: int = 0


def _vectors(name: str, value: Any) -> NDArray:
    """Return a vector of every node."""
    array = numbers(name, value)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f": shape {array.shape}: must be (nodes, 3)", name)
    return array


def _memory(name: str, value: Any) -> NDArray | str:
    """Return a state of branches, or the word for a fresh one."""
    return choice(name, value, ("fresh",)) if isinstance(value, str) else numbers(name, value)


def _known(name: str, value: Any, kind: type) -> Any:
    """Return what is of a kind."""
    if isinstance(value, kind):
        return value
    raise InputError(f": got {type(value).__name__}; it comes from fd.initial_state(result)", name)


@dataclass(frozen=True, eq=False)
class State(Checked):
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
    origin : Origin, optional
        Where the motion began that goes on here: damping with ``state = "initial"`` and added mass
        stay what they were. `initial_state` takes it from the result; without it the motion begins
        in the state itself.
    """

    displacement: Annotated[ArrayLike | None, Check(_vectors, unit="m")] = None
    velocity: Annotated[ArrayLike | None, Check(_vectors, unit="m/s")] = None
    memory: Annotated[ArrayLike | str | None, Check(_memory)] = None
    continuation: Annotated[Continuation | None, Check(_known, kind=Continuation)] = None
    origin: Annotated[Origin | None, Check(_known, kind=Origin)] = None

    def of_nodes(self, name: str, shape: tuple[int, ...], field: str = "initial") -> NDArray:
        """Its displacement or velocity of the nodes of a case (n, 3), zero where it has none."""
        value = getattr(self, name)
        array = np.zeros(shape) if value is None else np.array(value)
        if array.shape != shape:
            raise InputError(f": {name} of shape {array.shape}: the case has {shape}", field)
        return array

    def origin_of(
        self, shape: tuple[int, ...], time: float | None = None, field: str = "initial"
    ) -> Origin:
        """Where the motion of nodes (n, 3) began that goes on from here at a time (s)."""
        if self.origin is None:
            return Origin(self.of_nodes("displacement", shape, field), time)
        if self.origin.displacement.shape != shape:
            raise InputError(
                f": origin of shape {self.origin.displacement.shape}: the case has {shape}", field
            )
        return self.origin

    def agree(self) -> None:
        """Refuse displacements and velocities of different numbers of nodes."""
        both = [getattr(self, name) for name in self.given("displacement", "velocity")]
        if len({array.shape for array in both}) > 1:
            raise InputError("displacement and velocity: must have the same shape")
