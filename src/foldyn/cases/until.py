"""Where a path of a case file ends before its last load factor or step."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import NDArray

from foldyn.cases.supports import AXES


@dataclass(frozen=True)
class Reached:
    """Whether a node has reached a displacement, as a function for `until` of `trace`.

    Attributes
    ----------
    node : int
    axis : {"x", "y", "z"}
    displacement : float
        Displacement (m) from the rest position, not zero; reached where the node's own is as far
        from zero on the same side.
    """

    node: int
    axis: str
    displacement: float

    def __call__(self, displacement: NDArray, load_factor: float) -> bool:
        """Whether it is so for displacements (n, 3), m."""
        moved = displacement[self.node, AXES.index(self.axis)]
        return bool(moved / self.displacement >= 1.0)
