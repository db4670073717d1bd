"""Supports: nodes held at rest or moved as prescribed, a base that moves; the registry of all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from foldyn.cases.dashpots import AXES, DIRECTIONS, Dashpot
from foldyn.cases.decode import Part, given_keys
from foldyn.cases.history import History, as_history
from foldyn.cases.selection import check_nodes
from foldyn.errors import InputError
from foldyn.values import brief, choice, number, number_or_list, show


@brief
@dataclass(frozen=True)
class Fix(Part):
    """Nodes held along some axes.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression over the pattern's vertices ("xmin", "zmax and y>0").
    axes : str
        The axes held: letters of "xyz".
    """

    nodes: int | str | Sequence[int]
    axes: str = "xyz"

    keys = {"nodes": "nodes", "axes": "axes"}

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        axes = self.axes
        if not isinstance(axes, str) or not axes or set(axes) - set(AXES):
            raise InputError(f' = {show(axes)}: must be letters of "xyz", as in "xz"', "axes")
        if len(set(axes)) < len(axes):
            raise InputError(f" = {show(axes)}: an axis is listed twice", "axes")


@brief
@dataclass(frozen=True)
class Impose(Part):
    """Nodes moved along one axis as prescribed, whatever force that takes.

    The displacement from the rest position is the value times the factor of the history.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression over the pattern's vertices ("xmin", "zmax and y>0").
    axis : {"x", "y", "z"}
        The axis; give one `Impose` for each.
    value : float or sequence of float
        Displacement (m) at factor 1 of all these nodes, or of each of them in the order of
        `nodes`, which then are numbers.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    nodes: int | str | Sequence[int]
    axis: str
    value: float | Sequence[float]
    history: History | Callable[[Any], Any] | None = None

    keys = {"nodes": "nodes", "axis": "axis", "displacement": "value"}
    missing = {
        "axis": 'give the axis of the displacement, as in axis = "x"',
        "displacement": "give it (m), or write axes instead of axis to hold nodes",
    }

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        object.__setattr__(self, "axis", check_axis("axis", self.axis))
        object.__setattr__(self, "value", check_per_node("value", self.value, self.nodes))
        object.__setattr__(self, "history", as_history(self.history))


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


Support = Fix | Impose | BaseMotion | Dashpot
SUPPORTS: tuple[type[Support], ...] = (Fix, Impose, BaseMotion, Dashpot)


def support_from(table: Any, folder: Path | None = None) -> Support:
    """Support from its table in a case file; see `Part.of`."""
    given = given_keys(table, SUPPORTS)
    if not given:
        raise InputError(
            ": give nodes and axes (held), nodes, axis and displacement (moved), base and "
            "history (a base that moves), or nodes and dashpot (damped)"
        )
    if "dashpot" in given:
        strange = [key for key in table if key not in Dashpot.keys]
        if strange:
            raise InputError(
                f": damps the motion of nodes; leave out {strange[0]}, and write [[supports]] for "
                "each support",
                ".dashpot",
            )
        return Dashpot.of(table, folder)
    if given & {"between", "direction"}:
        raise InputError(": missing; between and direction are those of a dashpot", ".dashpot")
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
    moved = [key for key in ("displacement", "history", "axis") if key in given]
    if moved and "axes" in given and "nodes" in given:
        raise InputError(
            f": holds nodes at rest, but {moved[0]} moves them; give either axes alone, or axis, "
            'as in axis = "x", with displacement',
            ".axes",
        )
    return (Impose if moved else Fix).of(table, folder)


def check_axis(name: str, axis: Any) -> str:
    """Return the name of one axis."""
    if not isinstance(axis, str) or axis not in tuple(AXES):
        raise InputError(f' = {show(axis)}: must be one of "x", "y" and "z"', name)
    return axis


def signed(name: str, direction: Any) -> tuple[int, float]:
    """Return the number of the axis and the sign of a direction: "-z" is (2, -1)."""
    direction = choice(name, direction, DIRECTIONS)
    return AXES.index(direction[-1]), -1.0 if direction.startswith("-") else 1.0


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
