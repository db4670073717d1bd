"""Small gaps between lines: open ends are extended to the point or line that they miss."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely import STRtree

from foldyn.formats.lines import Lines, single, without_points
from foldyn.formats.planar import joined, renumbered, segments, split

GAP = 5e-3
"""Largest distance by which an open end may miss its target, relative to the drawing's size."""


def closed(lines: Lines, tolerance: float) -> tuple[Lines, int, float]:
    """Extend open ends to the next point or line, if near.

    A line shorter than two gaps that sticks out is left as drawn: it overshot rather than fell
    short.

    Parameters
    ----------
    lines : Lines
        Lines that meet only at their ends.
    tolerance : float
        As in `split`.

    Returns
    -------
    lines : Lines
        Split again.
    count : int
        Number of moved ends.
    farthest : float
        Largest distance of a move.
    """
    gap = GAP * lines.size
    degree = np.bincount(lines.ends.ravel(), minlength=len(lines.points))
    rows, sides = np.nonzero((degree[lines.ends] == 1) & (lines.lengths > 2 * gap)[:, None])
    if not len(rows):
        return lines, 0, 0.0
    points, into = lines.points.copy(), np.arange(len(lines.points))
    open_ends, roots = lines.ends[rows, sides], lines.ends[rows, 1 - sides]
    used = np.unique(lines.ends)
    near = cKDTree(lines.points[used]).query(lines.points[open_ends], k=min(3, len(used)),
                                             distance_upper_bound=gap)  # fmt: skip
    tree, geometries = STRtree(segments(lines)), np.asarray(shapely.points(lines.points[open_ends]))
    for k, (end, root) in enumerate(zip(open_ends.tolist(), roots.tolist(), strict=True)):
        if into[end] != end:
            continue
        targets = [
            int(used[number])
            for number, distance in zip(near[1][k], near[0][k], strict=True)
            if np.isfinite(distance) and used[number] not in (end, root)
        ]
        if targets:
            into[end] = into[targets[0]]
            continue
        beside = tree.query(geometries[k], predicate="dwithin", distance=gap)
        beside = beside[(lines.ends[beside] != end).all(axis=1)]
        if len(beside):
            lengths = shapely.distance(segments(lines.taken(beside)), geometries[k])
            target = lines.ends[beside[lengths.argmin()]]
            points[end] = _reached(lines.points, root, end, target, gap)
    moved = np.linalg.norm(points[into] - lines.points, axis=1)
    if not moved.any():
        return lines, 0, 0.0
    more = Lines(points, lines.ends, lines.letters, lines.angles, lines.source)
    more = joined(single(without_points(renumbered(more, into)))[0], tolerance)
    return split(without_points(more), tolerance), int(np.count_nonzero(moved)), float(moved.max())


def _reached(points: NDArray, root: int, end: int, target: NDArray, gap: float) -> NDArray:
    """Where an extended line meets another; the nearest point if that is far away."""
    a, b = points[target]
    along, onward = b - a, points[end] - points[root]
    turn = onward[0] * along[1] - onward[1] * along[0]
    if abs(turn) > 0.1 * np.linalg.norm(onward) * np.linalg.norm(along):
        apart = a - points[root]
        t = (apart[0] * along[1] - apart[1] * along[0]) / turn
        reached = points[root] + t * onward
        if np.linalg.norm(reached - points[end]) < 3 * gap:
            return reached
    return a + along * np.clip((points[end] - a) @ along / (along @ along), 0, 1)
