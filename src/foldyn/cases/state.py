"""A state: displacement and velocity of every node, and data for continuing a motion."""

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
    """Data, in addition to a state, with which a method continues without a break.

    Parameters
    ----------
    method : str
        Name of the method.
    values : ndarray, shape (k,)
        Values that the method keeps, beginning with the displacement.
    """

    method: str
    values: NDArray


@brief
@dataclass(frozen=True, eq=False)
class Origin:
    """Start of the motion that a state continues.

    Parameters
    ----------
    displacement : ndarray, shape (n, 3)
        Displacement (m) at the start, the reference of damping with `state = "initial"`.
    time : float, optional
        Time (s) of the start, which determines the rest angles; without it, rest angles are those
        under constant loads only.
    flow : ndarray, shape (n, 3), optional
        Displacement (m) at which the flow of added mass was last computed; by default, the
        displacement of the state.
    looked : int
        Number of steps since that flow was last checked.
    """

    displacement: NDArray
    time: float | None = None
    flow: NDArray | None = None
    looked: int = 0


def _vectors(name: str, value: Any) -> NDArray:
    """Return an array of one vector per node."""
    array = numbers(name, value)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f": shape {array.shape}: must be (nodes, 3)", name)
    return array


def _memory(name: str, value: Any) -> NDArray | str:
    """Return the state of branches, or the word "fresh"."""
    return choice(name, value, ("fresh",)) if isinstance(value, str) else numbers(name, value)


def _known(name: str, value: Any, kind: type) -> Any:
    """Return `value` if it is of the given kind."""
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
        State of the branches of laws with memory, from the variable `memory` of a result. "fresh":
        every hinge has just left its rest angle. By default branches of the law `prony` have
        relaxed, and all others are fresh.
    continuation : Continuation, optional
        Data to continue exactly from the end of another motion; `initial_state` takes them from the
        result. They are used only by the same method, and only if state and forces match that end.
    origin : Origin, optional
        Start of the motion that continues here, so that damping with ``state = "initial"`` and
        added mass stay the same. `initial_state` takes it from the result; without it the motion
        begins in this state.
    """

    displacement: Annotated[ArrayLike | None, Check(_vectors, unit="m")] = None
    velocity: Annotated[ArrayLike | None, Check(_vectors, unit="m/s")] = None
    memory: Annotated[ArrayLike | str | None, Check(_memory)] = None
    continuation: Annotated[Continuation | None, Check(_known, kind=Continuation)] = None
    origin: Annotated[Origin | None, Check(_known, kind=Origin)] = None

    def of_nodes(self, name: str, shape: tuple[int, ...], field: str = "initial") -> NDArray:
        """Displacement or velocity of the nodes (n, 3) of a case; zero if not given."""
        value = getattr(self, name)
        array = np.zeros(shape) if value is None else np.array(value)
        if array.shape != shape:
            raise InputError(f": {name} of shape {array.shape}: the case has {shape}", field)
        return array

    def origin_of(
        self, shape: tuple[int, ...], time: float | None = None, field: str = "initial"
    ) -> Origin:
        """Start of the motion that this state continues, for nodes (n, 3) at a time (s)."""
        if self.origin is None:
            return Origin(self.of_nodes("displacement", shape, field), time)
        if self.origin.displacement.shape != shape:
            raise InputError(
                f": origin of shape {self.origin.displacement.shape}: the case has {shape}", field
            )
        return self.origin

    def agree(self) -> None:
        """Refuse displacements and velocities for different numbers of nodes."""
        both = [getattr(self, name) for name in self.given("displacement", "velocity")]
        if len({array.shape for array in both}) > 1:
            raise InputError("displacement and velocity: must have the same shape")
