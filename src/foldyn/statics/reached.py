"""Where a path ends: what `until` of `trace` and of case files says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from foldyn.cases.decode import check_keys
from foldyn.cases.directions import AXES, check_axis
from foldyn.cases.selection import resolve_nodes
from foldyn.errors import InputError, within
from foldyn.values import number, show, whole

KEYS = ("node", "axis", "displacement")


@dataclass(frozen=True)
class Reached:
    """Whether a node has moved so far along an axis.

    Parameters
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

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "node", whole("node", self.node))
        check_axis("axis", self.axis)
        object.__setattr__(self, "displacement", number("displacement", self.displacement))
        if self.displacement == 0.0:
            raise InputError(" = 0: the path begins there; say where it ends", "displacement")

    def __call__(self, displacement: NDArray, load_factor: float) -> bool:
        """Whether it is so for displacements (n, 3), m."""
        moved = displacement[self.node, AXES.index(self.axis)]
        return bool(moved / self.displacement >= 1.0)

    @classmethod
    def of(cls, table: Any) -> Reached:
        """Make it from its table, as a case file has it."""
        if not isinstance(table, Mapping):
            raise InputError(f" = {show(table)}: must be a table of {', '.join(KEYS)}")
        check_keys(table, KEYS)
        missing = [key for key in KEYS if key not in table]
        if missing:
            raise InputError(f": missing; give {', '.join(KEYS)}", f".{missing[0]}")
        with within("."):
            return cls(**table)


def until_of(given: Any, structure: Any) -> Callable[[NDArray, float], bool] | None:
    """What ends a path of a structure: a function as it is, a table as `Reached`."""
    if given is None:
        return None
    if callable(given) and not isinstance(given, Reached):
        return given  # type: ignore[return-value]
    with within("until"):
        end = given if isinstance(given, Reached) else Reached.of(given)
    resolve_nodes(structure, (end.node,), "until.node")
    return end
