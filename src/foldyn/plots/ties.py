"""Marks of ties between displacements: supports along directions, and links."""

from __future__ import annotations

import numpy as np

from foldyn.cases import Case, Fix, Impose, Link, resolve_nodes
from foldyn.cases.directions import unit_vector
from foldyn.plots import marks, style
from foldyn.plots.marks import Mark
from foldyn.plots.scene import Points, View


def direction_triangles(case: Case, kind: type, points: Points, size: float, sight: View) -> Points:
    """Triangles (k, 3, 3) at nodes that `Fix` or `Impose`, the kind, holds along directions."""
    middle, found = points.mean(axis=0), []
    for support in case.supports:
        if not isinstance(support, Fix | Impose) or type(support) is not kind:
            continue
        if support.direction is None:
            continue
        nodes, unit = resolve_nodes(case.structure, support.nodes), unit_vector(support.direction)
        for node, value in zip(nodes, _values(support, len(nodes)), strict=True):
            # it pushes a moving node; else it stands below the sheet, or outside
            outward = unit[2] if abs(unit[2]) > 1e-9 else unit @ (middle - points[node])
            along = unit * (np.sign(value) or np.sign(outward) or 1.0)
            found.append(marks.billboard(points[node], along, size, 0.38 * size, sight))
    return np.array(found).reshape(-1, 3, 3)


def _values(support: Fix | Impose, count: int) -> Points:
    return np.broadcast_to(getattr(support, "value", 0.0), (count,))


def links(case: Case, points: Points) -> list[Mark]:
    """Lines from the first of some linked nodes to the others, or from riders to carriers."""
    segments, tied = [], []
    for support in case.supports:
        if isinstance(support, Link):
            nodes = resolve_nodes(case.structure, support.nodes).tolist()
            first, others = ([nodes[0]], nodes[1:]) if support.to is None else (support.to, nodes)
            segments += [[points[a], points[b]] for a in first for b in others]
            tied += [points[node] for node in nodes]
    if not tied:
        return []
    look = {"marker": "o", "markersize": 5.0, "markerfacecolor": "none"}
    key = style.key("link (nodes tied together)", color=style.LINK, linestyle="dotted", **look)
    lines, dots = np.array(segments), np.array(tied)
    return [
        Mark(style.LINK, [key], [lines], dots=dots, zorder=6.5, width=1.4, dashes="dotted",
             look=look)
    ]  # fmt: skip
