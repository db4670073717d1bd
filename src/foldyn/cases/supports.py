"""Supports: nodes held at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from foldyn.cases.selection import check_nodes
from foldyn.cases.values import show
from foldyn.errors import InputError


@dataclass(frozen=True)
class Fix:
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

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        axes = self.axes
        if not isinstance(axes, str) or not axes or set(axes) - set("xyz"):
            raise InputError(f'axes = {show(axes)}: must be letters of "xyz", as in "xz"')
        if len(set(axes)) < len(axes):
            raise InputError(f"axes = {show(axes)}: an axis is listed twice")
