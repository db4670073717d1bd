"""Base of all loads: frozen data classes that define the effects of a load at factor 1."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.decode import Part
from foldyn.errors import InputError, warn
from foldyn.mechanics.following import Following
from foldyn.structures.discretized import Discretized, Distributed
from foldyn.structures.swelling import Swelling


class Load(Part):
    """A load: a frozen data class that defines its effects at factor 1 of its history.

    A new kind is a subclass listed in `LOADS`. `place` is the load's place for messages.

    Attributes
    ----------
    apart : str
        For messages: why this load cannot share a table with another load.
    arrows : bool
        Whether pictures show the forces as arrows at the nodes.
    moves : bool
        Whether the history describes a motion, so that the velocity matters.
    """

    apart: ClassVar[str]
    arrows: ClassVar[bool] = False
    moves: ClassVar[bool] = False
    history: Any

    def forces(self, structure: Discretized, place: str) -> NDArray[np.float64] | None:
        """Forces (n, 3), N, on all nodes; None if the load is not a force."""
        return None

    def loaded(self, structure: Discretized, place: str) -> NDArray[np.int64]:
        """Nodes on which the load acts; empty if it acts on all nodes or on creases."""
        return np.zeros(0, np.int64)

    def rest_changes(
        self, structure: Discretized, place: str
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]] | None:
        """Actuated creases, and the changes (rad) of their rest angles; None if there are none."""
        return None

    def turns(self, structure: Discretized, place: str) -> NDArray[np.float64] | None:
        """Changes, rad, of `SheetTerm.rest_angles`, from the first on; None if there are none.

        Changes from `rest_changes` are not included.
        """
        return None

    def following(self, structure: Discretized, place: str) -> Following | None:
        """Displacement-dependent forces at factor 1; None if there are none."""
        return None

    def distributed(self, structure: Discretized, place: str) -> Distributed | None:
        """The load on panels, edges and creases at rest, for linear models; None if on nodes."""
        return None

    def swelling(self, structure: Discretized, place: str) -> Swelling | None:
        """Free stretching and curling of panels at factor 1; None if there is none."""
        return None

    def check(self, structure: Discretized, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a load that does not suit the structure or its held dofs (n, 3)."""


def check_held(
    what: str, nodes: NDArray[np.int64], acts: NDArray[np.int64], fixed: NDArray[np.bool_],
    place: str, told: bool = True,
) -> None:  # fmt: skip
    """Refuse a load that acts only on held axes.

    Parameters
    ----------
    what : str
        The load's name in messages, such as "the force [0, 0, 1]".
    nodes, acts : ndarray of int
        Nodes and axes on which the load acts.
    fixed : ndarray of bool, shape (n, 3)
    place : str
    told : bool
        Whether to warn if the load acts on held axes in part.
    """
    held = fixed[np.ix_(nodes, acts)]
    if not held.any():
        return
    listed = ", ".join(
        f"{node} ({''.join('xyz'[a] for a in acts[row])})"
        for node, row in zip(nodes, held, strict=True)
        if row.any()
    )
    listed = listed if len(listed) < 80 else listed[:76] + " ..."
    if held.all():
        raise InputError(
            f": {what} acts only where supports hold its nodes: {listed}; load other nodes or "
            "axes, or free these",
            place,
        )
    if told:
        warn(
            f"{place}: {what} acts in part where supports hold its nodes: {listed}; that part "
            "only adds to the reactions",
            "loads.md#loads",
        )
