"""Supports: held, moved and tied nodes, a moving base, and the registry of all kinds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, get_args

import numpy as np

from foldyn.arguments import Check, Flag, Key
from foldyn.cases.connectors import Dashpot
from foldyn.cases.decode import Factor, Part, PartOf
from foldyn.cases.directions import AXES, Axes, Axis, Direction
from foldyn.cases.history import STEADY
from foldyn.cases.latches import Latch
from foldyn.cases.reached import Until
from foldyn.cases.selection import Nodes
from foldyn.cases.springs import Bar, Cable, Spring
from foldyn.cases.stops import Stop
from foldyn.errors import InputError
from foldyn.values import indices, number, number_or_list, one_or_each, show


@dataclass(frozen=True)
class Fix(Part):
    """Nodes held along axes or along one direction.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression that selects vertices ("xmin", "zmax and y>0").
    axes : str
        Held axes, letters from "xyz"; all three unless a direction is given.
    direction : sequence of float, shape (3,), or str, optional
        Instead of axes: a vector of any length, or "x" to "-z", along which nodes are held.
        Perpendicular to it they slide, like rollers on a plane with this normal.
    along : bool
        Whether to hold also the edges between these nodes, along their whole length. If edges of
        bars and hinges may bow, the held edges must be among the edges `straight` of `discretize`.
    until : float or mapping, optional
        When the nodes are let go: a time (s) of motions, above 0, counted as by histories; or what
        is reached then in a motion or a path: {"node": 6, "axis": "z", "displacement": -0.03} (m
        from rest), {"crease": 3, "angle": 170} (degrees) or {"line": 0, "tension": 40} (N, as
        in `tension` of results). Other analyses take the nodes as held.
    """

    nodes: Nodes
    axes: Axes | None = None
    direction: Direction | None = None
    along: Flag = False
    until: Until = None

    apart = 'holds nodes at rest, and axis = "x", say, moves them'

    def agree(self) -> None:
        """Hold all axes by default; refuse axes together with a direction."""
        if self.direction is None:
            self._set(axes=self.axes or AXES)
        elif self.axes is not None:
            raise InputError(
                f" = {show(self.direction)}: holds one direction, axes hold others; give one of "
                "the two, and a support for each",
                "direction",
            )


@dataclass(frozen=True)
class Impose(Part):
    """Nodes with a prescribed displacement along one axis or direction.

    The displacement from the rest position is the value times the factor of the history. With a
    direction, only the component along it is prescribed; perpendicular to it the nodes are free.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression that selects vertices ("xmin", "zmax and y>0").
    axis : {"x", "y", "z"}, optional
        The axis; give one `Impose` for each.
    value : float or sequence of float
        Displacement (m) at factor 1: one for all nodes, or one for each in the order of `nodes`.
        These must be numbers in the second case.
    history : History or callable, optional
        Factor of time; constant by default.
    direction : sequence of float, shape (3,), or str, optional
        Instead of the axis: a vector of any length, or "x" to "-z".
    along : bool
        Whether to move also the edges between these nodes, each like the straight line between its
        ends; see `Fix`.
    until : float or mapping, optional
        When the nodes are released; see `Fix`.
    """

    nodes: Nodes
    axis: Axis | None = None
    value: Annotated[
        float | Sequence[float] | None,
        Check(number_or_list, what="node", unit="m"),
        Key("displacement"),
    ] = None
    history: Factor = STEADY
    direction: Direction | None = None
    along: Flag = False
    until: Until = None

    missing = {"displacement": "give it (m), or write axes instead of axis to hold nodes"}
    apart = "moves nodes"

    def agree(self) -> None:
        """Require an axis or a direction, and a value for each node."""
        if (self.axis is None) == (self.direction is None):
            raise InputError(
                ': give the axis of the displacement, as in axis = "x", or its direction, as in '
                "direction = (1, 0, 1), and only one of the two",
                "axis",
            )
        if self.value is None:
            raise InputError(": missing; give the displacement (m) at factor 1", "value")
        if isinstance(self.value, tuple) and isinstance(self.nodes, str):
            raise InputError(
                f" = {show(self.value)}: one displacement per node needs node numbers, but nodes "
                f'is the selection "{self.nodes}"; give one number, or the nodes by number',
                "value",
            )
        one_or_each("value", self.value, np.size(self.nodes), "nodes")


@dataclass(frozen=True)
class BaseMotion(Part):
    """Motion of the base along one axis: it moves all nodes that `Fix` holds along this axis.

    The displacement since the start of the motion is the value times the factor of the history.
    Several base motions along an axis add up; nodes of an `Impose` keep their own displacement.

    Parameters
    ----------
    axis : {"x", "y", "z"}
        The axis; give one `BaseMotion` for each.
    history : History or callable, optional
        Factor of time; constant by default.
    value : float
        Displacement (m) at factor 1.
    """

    axis: Annotated[Axis, Key("base")]
    history: Factor = STEADY
    value: Annotated[float, Check(number, unit="m"), Key("displacement")] = 1.0

    missing = {"history": "give the motion of the base over time"}
    apart = "moves all nodes that supports hold along its axis"


def _corners(name: str, value: Any) -> tuple[int, ...]:
    corners = indices(name, value, "node", "the three that carry")
    if len(corners) != 3:
        raise InputError(f" = {show(value)}: must be three nodes", name)
    return corners


@dataclass(frozen=True)
class Link(Part):
    """Nodes tied exactly: together by equal displacements, or to three other nodes.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression that selects vertices.
    axes : str, optional
        All these nodes, at least two, have equal displacements along these axes ("xyz" unless `to`
        is given). Rotations are not tied.
    to : sequence of int, shape (3,), optional
        Instead of axes: three nodes that span a plate. `nodes` must lie in its plane and move as
        points of it: u = w1 u1 + w2 u2 + w3 u3, with the weights that hold for positions at rest.
        This is exact for any motion of a plate that stays flat.
    until : float or mapping, optional
        When the nodes are released; see `Fix`.
    """

    nodes: Nodes
    axes: Annotated[Axes | None, Key("link")] = None
    to: Annotated[Sequence[int] | None, Check(_corners)] = None
    until: Until = None

    apart = "ties nodes together"

    def agree(self) -> None:
        """Tie along all axes by default; refuse axes together with `to`."""
        if self.to is None:
            self._set(axes=self.axes or AXES)
            if isinstance(self.nodes, tuple) and len(self.nodes) < 2:
                raise InputError(
                    f" = {show(self.nodes)}: a link ties at least two nodes; give them all, or the "
                    "three nodes on which one rides, as in to = (0, 1, 2)",
                    "nodes",
                )
        elif self.axes is not None:
            raise InputError(
                f" = {show(self.to)}: nodes that ride on others do so along all axes; leave out "
                "the axes, or to",
                "to",
            )


Support = Fix | Impose | BaseMotion | Spring | Bar | Cable | Stop | Latch | Dashpot | Link
SUPPORTS: tuple[type[Support], ...] = get_args(Support)


SUPPORT = PartOf(
    SUPPORTS,
    "supports",
    "nodes and axes or direction (held), nodes, axis and displacement (moved), base and history (a "
    "base that moves), nodes and link or to (tied together), or nodes or between with stiffness "
    "(springs) or dashpot (damped), stop and stop_stiffness (creases that push back), latch "
    "and latch_stiffness (creases that snap in), bar and bar_stiffness (struts), or cable and "
    "cable_stiffness",
)
"""A support in a case file."""
