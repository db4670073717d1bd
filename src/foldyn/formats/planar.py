"""Planar graph of drawn lines: ends joined, lines split where they meet, one line per place.

Lines are split as a snapping noder does: at every vertex that lies within the tolerance of a line,
and at crossings, which become vertices; repeated until nothing is left to split (J. Hobby,
Practical segment intersection with finite precision output, Comput. Geom. 13, 1999).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely import STRtree

from foldyn.errors import InputError
from foldyn.formats.lines import MOST_LINES, MOST_PAIRS, Lines, single, too_many, without_points

FINEST, COARSEST = 1e-6, 5e-4
"""Tolerance within which two points are merged, relative to the drawing's size (its diagonal)."""
_SHARE = 0.1  # tolerance relative to the 5th percentile of line lengths
_ROUNDS = 12
_SOME = 500


def tolerance_of(lines: Lines) -> float:
    """Distance within which points of a drawing are merged.

    A tenth of the 5th percentile of line lengths, within 1e-6 to 5e-4 of the size.
    """
    size, lengths = lines.size, lines.lengths
    lengths = lengths[lengths > FINEST * size]
    short = float(np.percentile(lengths, 5)) if len(lengths) else 0.0
    return float(np.clip(_SHARE * short, FINEST * size, COARSEST * size))


def merged(points: NDArray, tolerance: float, kept: int = 0) -> NDArray[np.int64]:
    """For each point, the point it is merged into: the first one within the tolerance.

    Remaining points are farther apart than the tolerance; the first `kept` always remain.
    """
    cells = np.round(points / (0.5 * tolerance))
    _, first, cell = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    into = first[cell.ravel()]
    into[:kept] = np.arange(kept)
    rest = np.flatnonzero(into == np.arange(len(points)))
    pairs = rest[cKDTree(points[rest]).query_pairs(tolerance, output_type="ndarray")]
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))] if len(pairs) else pairs
    for low, high in pairs.tolist():  # low < high, sorted by low: earlier points are settled
        if into[low] == low and into[high] == high and high >= kept:
            into[high] = low
    return into[into]


def joined(lines: Lines, tolerance: float) -> Lines:
    """Join line ends that are within the tolerance."""
    return renumbered(lines, merged(lines.points, tolerance))


def renumbered(lines: Lines, into: NDArray) -> Lines:
    """Lines with renumbered ends, and only the points that they use."""
    used, ends = np.unique(into[lines.ends], return_inverse=True)
    return replace(lines, points=lines.points[used], ends=ends.reshape(lines.ends.shape))


def on_lines(lines: Lines, tolerance: float) -> Lines:
    """Move line ends onto lines that they nearly reach; those lines stay straight.

    Ends within rounding of the line, and ends near several lines, do not move.
    """
    hits = points_on(lines, 0.5 * tolerance)
    point, first, count = np.unique(hits[:, 1], return_index=True, return_counts=True)
    point, line = point[count == 1], hits[first[count == 1], 0]
    start = lines.points[lines.ends[line, 0]]
    along = lines.points[lines.ends[line, 1]] - start
    to = lines.points[point] - start
    share = np.einsum("ij,ij->i", to, along) / np.einsum("ij,ij->i", along, along)
    foot = start + share[:, None] * along
    moved = np.linalg.norm(foot - lines.points[point], axis=1) > 1e-3 * FINEST * lines.size
    points = lines.points.copy()
    points[point[moved]] = foot[moved]
    return replace(lines, points=points)


def split(lines: Lines, tolerance: float) -> Lines:
    """Split lines so that they meet only at their ends.

    Parameters
    ----------
    lines : Lines
        With joined ends, none of zero length.
    tolerance : float
        Distance within which a point lies on a line.

    Raises
    ------
    InputError
        Too many lines are near each other or cross, or lines tangle within the tolerance.
    """
    lines, _ = single(lines)
    # If points are at least a tolerance apart, no triangle has two corners on opposite sides.
    near_by = 0.5 * tolerance
    for _ in range(_ROUNDS):
        if len(lines.ends) > MOST_LINES:
            raise too_many(f"{len(lines.ends)} lines")
        lines, hits = _with_crossings(lines, near_by, tolerance)
        near = np.concatenate((hits, points_on(lines, near_by)))
        if not len(near):
            return lines
        lines, _ = single(without_points(_pieces(lines, near)))
    raise InputError(
        f": some lines tangle within {tolerance:.3g} of each other; simplify the drawing", "lines"
    )


def check_crowding(lines: Lines) -> None:
    """Refuse a drawing if too many lines are close together, judged from a sample.

    Raises
    ------
    InputError
        There are so many lines that `split` would take long before it refuses them.
    """
    geometries = segments(lines)
    some = geometries[:: -(-len(geometries) // _SOME)]
    pairs = len(STRtree(geometries).query(some)[0]) * len(geometries) / len(some)
    if pairs > 4 * MOST_PAIRS:
        raise too_many("the lines near each other")


def segments(lines: Lines) -> NDArray:
    """Geometries of the lines (m,)."""
    return np.asarray(shapely.linestrings(lines.points[lines.ends]))


def _with_crossings(lines: Lines, near_by: float, tolerance: float) -> tuple[Lines, NDArray]:
    """Add a point to both lines at each crossing; also return lines and points (k, 2)."""
    points, ends = lines.points, lines.ends
    geometries = segments(lines)
    one, other = STRtree(geometries).query(geometries, predicate="intersects")
    if len(one) > 2 * MOST_PAIRS:
        raise too_many("the lines near each other")
    pairs, places = _crossings(points, ends, np.column_stack((one, other))[one < other], near_by)
    if not len(pairs):
        return lines, np.empty((0, 2), dtype=np.int64)
    if len(pairs) > MOST_LINES:
        raise too_many(f"{len(pairs)} crossings")
    every = np.concatenate((points, places))
    number = merged(every, tolerance, kept=len(points))[len(points) :]
    hits = np.column_stack((pairs.T.ravel(), np.tile(number, 2)))
    return replace(lines, points=every), hits[(ends[hits[:, 0]] != hits[:, 1:]).all(axis=1)]


def _crossings(
    points: NDArray, ends: NDArray, pairs: NDArray, tolerance: float
) -> tuple[NDArray, NDArray]:
    """Pairs (k, 2) of lines that cross away from their ends, and the crossings (k, 2)."""
    pairs = pairs[(ends[pairs[:, 0]][:, :, None] != ends[pairs[:, 1]][:, None, :]).all(axis=(1, 2))]
    p, q = points[ends[pairs[:, 0], 0]], points[ends[pairs[:, 1], 0]]
    r, s = points[ends[pairs[:, 0], 1]] - p, points[ends[pairs[:, 1], 1]] - q
    turn = _cross(r, s)
    apart = q - p
    length_r, length_s = np.linalg.norm(r, axis=1), np.linalg.norm(s, axis=1)
    # Signed distances of each line's ends from the other line: opposite signs, and beyond the
    # tolerance.
    over_s = -_cross(apart, s) / length_s, (_cross(r, s) - _cross(apart, s)) / length_s
    over_r = _cross(r, apart) / length_r, (_cross(r, apart) + _cross(r, s)) / length_r
    cross = np.ones(len(pairs), dtype=bool)
    for one, other in (over_s, over_r):
        cross &= (one * other < 0) & (np.abs(one) > tolerance) & (np.abs(other) > tolerance)
    t = _cross(apart[cross], s[cross]) / turn[cross]
    return pairs[cross], p[cross] + t[:, None] * r[cross]


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def points_on(lines: Lines, tolerance: float) -> NDArray:
    """Rows (line, point), (k, 2), of the points that lie on a line without being its ends."""
    used = np.unique(lines.ends)
    number, line = STRtree(segments(lines)).query(
        shapely.points(lines.points[used]), predicate="dwithin", distance=tolerance
    )
    hits = np.column_stack((line, used[number]))
    return hits[(lines.ends[line] != hits[:, 1:]).all(axis=1)]


def _pieces(lines: Lines, hits: NDArray) -> Lines:
    """Pieces of lines split at points, from rows (line, point)."""
    every = np.arange(len(lines.ends))
    line = np.concatenate((every, every, hits[:, 0]))
    point = np.concatenate((lines.ends[:, 0], lines.ends[:, 1], hits[:, 1]))
    start = lines.points[lines.ends[line, 0]]
    along = lines.points[lines.ends[line, 1]] - start
    order = np.lexsort((np.einsum("ij,ij->i", lines.points[point] - start, along), line))
    line, point = line[order], point[order]
    same = line[1:] == line[:-1]
    row = line[:-1][same]
    return replace(lines.taken(row), ends=np.column_stack((point[:-1][same], point[1:][same])))


GAP = 5e-3
"""Largest distance by which an open end may miss its target, relative to the drawing's size."""


def without_gaps(lines: Lines, tolerance: float) -> tuple[Lines, int, float]:
    """Extend open ends to the next point or line, if near.

    A line that sticks out and is shorter than two gaps is left as drawn: it went too far, not too
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
    more = replace(lines, points=points)
    more = joined(single(without_points(renumbered(more, into)))[0], tolerance)
    return split(without_points(more), tolerance), int(np.count_nonzero(moved)), float(moved.max())


def _reached(points: NDArray, root: int, end: int, target: NDArray, gap: float) -> NDArray:
    """Where an extended line meets another; the nearest point if the intersection is far away."""
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
