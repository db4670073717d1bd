"""Where a path ends: the argument `until` of `trace`, also in case files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.cases.decode import Part, PartOf
from foldyn.cases.directions import AXES, Axis
from foldyn.cases.selection import resolve_nodes
from foldyn.errors import InputError
from foldyn.structures.discretized import Discretized
from foldyn.values import number, whole


@dataclass(frozen=True)
class Reached(Part):
    """Whether a node has reached a displacement along an axis.

    Parameters
    ----------
    node : int
        Number of the node.
    axis : {"x", "y", "z"}
        Axis along which it moves.
    displacement : float
        Displacement (m) from the rest position, not zero; reached once the node is at least as far
        from zero, on the same side.
    """

    node: Annotated[int, Check(whole)]
    axis: Axis
    displacement: Annotated[float, Check(number, unit="m")]

    def agree(self) -> None:
        """Refuse a displacement of zero, where the path begins."""
        if self.displacement == 0.0:
            raise InputError(" = 0: the path begins there; say where it ends", "displacement")

    def __call__(self, displacement: NDArray, load_factor: float) -> bool:
        """Whether it is reached for displacements (n, 3), m."""
        moved = displacement[self.node, AXES.index(self.axis)]
        return bool(moved / self.displacement >= 1.0)


UNTIL = PartOf((Reached,), "analysis.until", "node, axis and displacement")
"""End condition of a path, in a case file and as an argument."""


def until_of(given: Any, structure: Discretized) -> Callable[[NDArray, float], bool] | None:
    """End condition of a path: a function as given, a table as `Reached`."""
    if given is None:
        return None
    if callable(given) and not isinstance(given, Reached):
        return given  # type: ignore[return-value]
    end = given if isinstance(given, Reached) else UNTIL("until", given)
    resolve_nodes(structure, (end.node,), "until.node")
    return end
