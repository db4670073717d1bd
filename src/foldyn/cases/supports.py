"""Supports: nodes held, moved, tied together or held by springs, a base that moves; all kinds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from foldyn.cases.dashpots import Dashpot
from foldyn.cases.decode import Part, given_keys
from foldyn.cases.directions import check_axes, check_axis, check_direction
from foldyn.cases.history import History, as_history
from foldyn.cases.selection import check_nodes
from foldyn.cases.springs import Spring
from foldyn.errors import InputError
from foldyn.values import brief, flag, indices, number, number_or_list, show


@brief
@dataclass(frozen=True)
class Fix(Part):
    """Nodes held along some axes, or along one direction.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression over the pattern's vertices ("xmin", "zmax and y>0").
    axes : str
        The axes held: letters of "xyz"; all three unless a direction is given.
    direction : sequence of float, shape (3,), or str, optional
        Instead of axes: the displacement along this vector of any length, or along "x" to "-z", is
        held; across it the nodes slide, as on rollers on a plane with this normal.
    along : bool
        Whether the edges between these nodes are held too, along their whole length. Bars and
        hinges whose edges may bow need those edges among the `straight` ones of `discretize`.
    """

    nodes: int | str | Sequence[int]
    axes: str | None = None
    direction: Sequence[float] | str | None = None
    along: bool = False

    keys = {"nodes": "nodes", "axes": "axes", "direction": "direction", "along": "along"}

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        object.__setattr__(self, "along", flag("along", self.along))
        if self.direction is None:
            axes = "xyz" if self.axes is None else self.axes
            object.__setattr__(self, "axes", check_axes("axes", axes))
            return
        if self.axes is not None:
            raise InputError(
                f" = {show(self.direction)}: holds one direction, axes hold others; give one of "
                "the two, and a support for each",
                "direction",
            )
        object.__setattr__(self, "direction", check_direction("direction", self.direction))


@brief
@dataclass(frozen=True)
class Impose(Part):
    """Nodes moved along one axis or direction as prescribed, whatever force that takes.

    The displacement from the rest position is the value times the factor of the history. Along a
    direction it is the component that is prescribed; across it the nodes are free.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression over the pattern's vertices ("xmin", "zmax and y>0").
    axis : {"x", "y", "z"}, optional
        The axis; give one `Impose` for each.
    value : float or sequence of float
        Displacement (m) at factor 1 of all these nodes, or of each of them in the order of
        `nodes`, which then are numbers.
    history : History or callable, optional
        Factor of time; constant by default.
    direction : sequence of float, shape (3,), or str, optional
        Instead of the axis: a vector of any length, or "x" to "-z".
    along : bool
        Whether the edges between these nodes are moved too, each as the line between its ends; see
        `Fix`.
    """

    nodes: int | str | Sequence[int]
    axis: str | None = None
    value: float | Sequence[float] | None = None
    history: History | Callable[[Any], Any] | None = None
    direction: Sequence[float] | str | None = None
    along: bool = False

    keys = {
        "nodes": "nodes", "axis": "axis", "direction": "direction", "displacement": "value",
        "along": "along",
    }  # fmt: skip
    missing = {
        "displacement": "give it (m), or write axes instead of axis to hold nodes",
    }

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        object.__setattr__(self, "along", flag("along", self.along))
        if (self.axis is None) == (self.direction is None):
            raise InputError(
                ': give the axis of the displacement, as in axis = "x", or its direction, as in '
                "direction = (1, 0, 1), and only one of the two",
                "axis",
            )
        if self.axis is not None:
            object.__setattr__(self, "axis", check_axis("axis", self.axis))
        else:
            object.__setattr__(self, "direction", check_direction("direction", self.direction))
        object.__setattr__(self, "value", check_per_node("value", self.value, self.nodes))
        object.__setattr__(self, "history", as_history(self.history))


@brief
@dataclass(frozen=True)
class BaseMotion(Part):
    """The base moves along one axis: all that `Fix` holds along it moves together.

    Each of these nodes moves by the value times the factor of the history from where it stands at
    the start of the motion. Several base motions along an axis add up; nodes of an `Impose` follow
    their own displacement.

    Parameters
    ----------
    axis : {"x", "y", "z"}
        The axis; give one `BaseMotion` for each.
    history : History or callable, optional
        Factor of time; constant by default.
    value : float
        Displacement (m) at factor 1.
    """

    axis: str
    history: History | Callable[[Any], Any] | None = None
    value: float = 1.0

    keys = {"base": "axis", "displacement": "value"}
    missing = {"history": "give the motion of the base over time"}

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "axis", check_axis("axis", self.axis))
        object.__setattr__(self, "history", as_history(self.history))
        object.__setattr__(self, "value", number("value", self.value))


@brief
@dataclass(frozen=True)
class Link(Part):
    """Nodes tied together, exactly: by equal displacements, or to three others.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression over the pattern's vertices.
    axes : str, optional
        All these nodes, at least two, have the same displacement along these axes ("xyz" unless
        `to` is given). They do not follow each other's rotation about them.
    to : sequence of int, shape (3,), optional
        Instead of axes: the nodes ride on these three as points of one plate. They lie in the plane
        of the three, u = w1 u1 + w2 u2 + w3 u3 with w what weights their places at rest, which is
        exact for any motion of a plate that stays flat.
    """

    nodes: int | str | Sequence[int]
    axes: str | None = None
    to: Sequence[int] | None = None

    keys = {"nodes": "nodes", "link": "axes", "to": "to"}

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        if self.to is None:
            axes = "xyz" if self.axes is None else self.axes
            object.__setattr__(self, "axes", check_axes("axes", axes))
            if isinstance(self.nodes, tuple) and len(self.nodes) < 2:
                raise InputError(
                    f" = {show(self.nodes)}: a link ties at least two nodes; give them all, or the "
                    "three nodes on which one rides, as in to = (0, 1, 2)",
                    "nodes",
                )
            return
        if self.axes is not None:
            raise InputError(
                f" = {show(self.to)}: nodes that ride on others do so along all axes; leave out "
                "the axes, or to",
                "to",
            )
        corners = indices("to", self.to, "node", "the three that carry")
        if len(corners) != 3:
            raise InputError(f" = {show(self.to)}: must be three nodes", "to")
        object.__setattr__(self, "to", corners)


Support = Fix | Impose | BaseMotion | Spring | Dashpot | Link
SUPPORTS: tuple[type[Support], ...] = (Fix, Impose, BaseMotion, Spring, Dashpot, Link)


def support_from(table: Any, folder: Path | None = None) -> Support:
    """Support from its table in a case file; see `Part.of`."""
    given = given_keys(table, SUPPORTS)
    if not given:
        raise InputError(
            ": give nodes and axes or direction (held), nodes, axis and displacement (moved), base "
            "and history (a base that moves), nodes and link or to (tied together), or nodes or "
            "between with stiffness (springs) or dashpot (damped)"
        )
    for kind in SUPPORTS:
        if not kind.own or kind.own not in given:
            continue
        strange = [key for key in table if key in given and key not in kind.keys]
        if strange:
            raise InputError(
                f": {kind.apart}; leave out {' and '.join(strange)}, or write [[supports]] for "
                "each",
                f".{kind.own}",
            )
        return kind.of(table, folder)
    if left := [key for key in table if key in ("between", "rest_length")]:
        raise InputError(
            f": {left[0]} is for springs and dashpots: give stiffness (N/m) or dashpot (N s/m)"
        )
    if "base" in given:
        strange = [key for key in ("nodes", "axes", "axis") if key in given]
        check_axis(".base", table["base"])
        if strange:
            raise InputError(
                f": moves all nodes that other [[supports]] hold along {table['base']}; leave out "
                f"{strange[0]}, and give nodes their own [[supports]]",
                ".base",
            )
        return BaseMotion.of(table, folder)
    if given & {"link", "to"}:
        own = "link" if "link" in given else "to"
        strange = [key for key in ("axes", "axis", "direction", "displacement", "history")]
        strange = [key for key in strange if key in given]
        if strange:
            raise InputError(
                f": ties nodes together; leave out {strange[0]}, and write [[supports]] for what "
                "holds or moves them",
                f".{own}",
            )
        return Link.of(table, folder)
    moved = [key for key in ("displacement", "history", "axis") if key in given]
    if moved and "axes" in given and "nodes" in given:
        raise InputError(
            f": holds nodes at rest, but {moved[0]} moves them; give either axes alone, or axis, "
            'as in axis = "x", with displacement',
            ".axes",
        )
    if moved and not given & {"axis", "direction"}:
        raise InputError(': missing; give the axis of the displacement, as in axis = "x"', ".axis")
    return (Impose if moved else Fix).of(table, folder)


def check_per_node(name: str, value: Any, nodes: Any) -> float | tuple[float, ...]:
    """Return one finite number for all the checked `nodes`, or a tuple of one for each."""
    checked = number_or_list(name, value, "node")
    if not isinstance(checked, tuple):
        return checked
    if isinstance(nodes, str):
        raise InputError(
            f" = {show(value)}: one displacement per node needs node numbers, but nodes is the "
            f'selection "{nodes}"; give one number, or the nodes by number',
            name,
        )
    if len(checked) != len(nodes):
        raise InputError(
            f" = {show(value)}: {len(checked)} values for {len(nodes)} nodes; give one, or one for "
            "each",
            name,
        )
    return checked
