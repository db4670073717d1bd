"""Forces that are given as a total or per length, and shared by nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Factor
from foldyn.cases.history import STEADY
from foldyn.cases.load import Load, check_held
from foldyn.cases.regions import (
    Edges,
    Panels,
    area_at_nodes,
    length_at_nodes,
    resolve_edges,
    resolve_panels,
    tributary_area,
)
from foldyn.cases.selection import Nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.values import show, vector


class Spread(Load):
    """A force on nodes of which each gets a part by its share of a length or an area."""

    arrows = True

    def measure(self, structure: Any, place: str) -> NDArray[np.float64]:
        """Length (m) or area (m2) that belongs to each node (n,)."""
        raise NotImplementedError

    def total_of(self, measure: float) -> NDArray[np.float64]:
        """Force (3,), N, on a length or an area."""
        raise NotImplementedError

    def loaded(self, structure: Any, place: str) -> NDArray[np.int64]:
        """See `Load`; vertices of the pattern where it acts on others too."""
        nodes = np.flatnonzero(self.measure(structure, place))
        pattern = structure.pattern
        return nodes if pattern is None else nodes[nodes < len(pattern.vertices)]

    def forces(self, structure: Any, place: str) -> NDArray[np.float64]:
        """See `Load`."""
        measure = self.measure(structure, place)
        whole = float(measure.sum())
        return (measure / whole)[:, None] * self.total_of(whole)


@dataclass(frozen=True)
class TotalForce(Spread):
    """A total force, shared by nodes, edges or panels, times a history.

    Parameters
    ----------
    total : sequence of float, shape (3,)
        Sum of the forces (N).
    nodes : int, sequence of int, or str, optional
        Vertices by number, or an expression ("xmin"). Each gets its part by the area of the sheet
        that belongs to it: a panel gives each of its corners an equal part.
    edges : sequence of (vertex, vertex), or str, optional
        Edges of the pattern; an expression means those of which it selects both ends. Each gets
        its part by its length, evenly along it: half of a piece of an edge for either end.
    panels : int, sequence of int, or "all", optional
        Panels by number. Each gets its part by its area at rest, evenly over it: a third of each
        of the triangles into which it is cut for each corner.
    history : History or callable, optional
        Factor of time; constant by default.

    Raises
    ------
    InputError
        Not exactly one of nodes, edges and panels is given.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.TotalForce((0, 0, -2.0), edges="xmax")
    TotalForce(total=(0.0, 0.0, -2.0), edges='xmax', history=Constant())
    """

    total: Annotated[Sequence[float], Check(vector, unit="N")]
    nodes: Nodes | None = None
    edges: Edges | None = None
    panels: Panels | None = None
    history: Factor = STEADY

    apart = "a total force is a load of its own"

    def agree(self) -> None:
        """Ask for one place where it acts."""
        given = self.given("nodes", "edges", "panels")
        if len(given) != 1:
            what = "is given" if not given else f"are given, {' and '.join(given)}"
            raise InputError(
                f": give one of nodes, edges and panels; {len(given) or 'none'} {what}", "total"
            )

    def measure(self, structure: Any, place: str) -> NDArray[np.float64]:
        """See `Spread`."""
        if self.edges is not None:
            along = resolve_edges(structure, self.edges, f"{place}.edges")
            return length_at_nodes(structure, along)
        if self.panels is not None:
            triangles = resolve_panels(structure, self.panels, f"{place}.panels")
            return area_at_nodes(structure, triangles)
        nodes = resolve_nodes(structure, self.nodes, f"{place}.nodes")  # type: ignore[arg-type]
        area, out = tributary_area(structure), np.zeros(len(structure.nodes))
        without = nodes[area[nodes] == 0.0]
        if without.size:
            raise InputError(
                f" = {show(self.nodes)}: no part of the sheet belongs to node {without[0]}; give "
                "vertices of panels, or edges or panels in place of nodes",
                f"{place}.nodes",
            )
        out[nodes] = area[nodes]
        return out

    def total_of(self, measure: float) -> NDArray[np.float64]:
        """See `Spread`."""
        return np.array(self.total)

    def check(self, structure: Any, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a force that acts on held axes only; warn of one on nodes that does in part."""
        nodes = np.flatnonzero(self.measure(structure, place))
        what, acts = f"the force {show(self.total)}", np.flatnonzero(self.total)
        check_held(what, nodes, acts, fixed, place, told=self.nodes is not None)


@dataclass(frozen=True)
class LineLoad(Spread):
    """A force per length along edges, times a history.

    Parameters
    ----------
    edges : sequence of (vertex, vertex), or str
        Edges of the pattern; an expression ("xmin") means those of which it selects both ends.
    force_per_length : sequence of float, shape (3,)
        Force (N/m) per length at rest: half of that of each piece of an edge for either end.
    history : History or callable, optional
        Factor of time; constant by default.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.LineLoad([[0, 1]], (0, 0, -5.0))
    LineLoad(edges=((0, 1),), force_per_length=(0.0, 0.0, -5.0), history=Constant())
    """

    edges: Edges
    force_per_length: Annotated[Sequence[float], Check(vector, unit="N/m"), Key("per_length")]
    history: Factor = STEADY

    apart = "acts along edges"

    def measure(self, structure: Any, place: str) -> NDArray[np.float64]:
        """See `Spread`."""
        return length_at_nodes(structure, resolve_edges(structure, self.edges, f"{place}.edges"))

    def total_of(self, measure: float) -> NDArray[np.float64]:
        """See `Spread`."""
        return measure * np.array(self.force_per_length)

    def check(self, structure: Any, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a load that acts on held axes only."""
        nodes = np.flatnonzero(self.measure(structure, place))
        what = f"the force per length {show(self.force_per_length)}"
        check_held(what, nodes, np.flatnonzero(self.force_per_length), fixed, place, told=False)
