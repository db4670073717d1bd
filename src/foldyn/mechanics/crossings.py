"""Panels that pass through each other, told from panels that touch.

Two triangles that are not in one plane cross where each has corners on both sides of the other's
plane, and the pieces of line that the planes cut from them overlap. Touching is no crossing: a
corner, or a side, that they share or that lies on the other, or layers upon each other. But panels
may cross along sides of their triangles, each of which touches only (two flaps of one size that
fold over a panel meet in their middles): so it is panels that must be on both sides of each other,
counted over their triangles that overlap somewhere.

Two triangles with one common corner can cross along a line from there, and are compared as others
are. Two with a common side cannot, but for an angle between them that passes 0 or 2 pi, which is
looked for where angles are. Triangles of one panel are compared only where they have no corner in
common.

Boxes about the triangles are put into a regular grid, whose cells are as large as boxes are on
average, and those that share a cell are compared: time and memory grow with their number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, kernel

TOUCHING = 1e-9  # of a triangle's size: a corner so near a plane lies in it
LEVEL = 1e-3  # rad between planes: triangles lie upon each other
OVERLAP = 1e-5  # of the smaller triangle's size: pieces that only touch have less in common
ABOVE, BELOW = 1, 2  # where parts of a triangle are
BOTH = 3
FEWEST, SPREAD = 64, 2  # the grid has at most this many cells, and this many per triangle more
LARGEST = 0.0625  # of the largest box: the least size of a cell
ROOM = 64  # pairs at first
MOST_SHOWN = 8  # pairs of panels that a text names


class Boxes(NamedTuple):
    """Bounds and planes of m triangles."""

    low: NDArray  # (m, 3)
    high: NDArray
    normal: NDArray  # (m, 3) of one, or zero where a triangle has no area
    size: NDArray  # (m,) longest side of each box


class Grid(NamedTuple):
    """A regular grid of cells: cell c holds the boxes members[start[c]:start[c + 1]]."""

    start: NDArray
    members: NDArray
    cell: float  # size
    origin: NDArray  # (3,)
    shape: NDArray  # (3,) cells along each axis


def crossing_panels(points: NDArray, triangles: NDArray, panels: NDArray) -> NDArray[np.int64]:
    """Pairs of panels (k, 2), the lower first, that cross each other, or themselves.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Coordinates (m), all finite.
    triangles : ndarray of int, shape (m, 3)
        Triangles into which panels are cut.
    panels : ndarray of int, shape (m,)
        The panel of each.
    """
    x = np.array(points, np.float64, order="C")
    rows, owners = np.array(triangles, np.int64), np.array(panels, np.int64)
    found, count = np.empty((ROOM, 4), np.int64), 0
    if len(rows):
        boxes = _boxes(x[rows])
        grid = _grid(boxes)
        while (count := _overlapping(x, rows, owners, boxes, grid, found)) > len(found):
            found = np.empty((count, 4), np.int64)
    if not count:
        return np.zeros((0, 2), np.int64)
    pairs, which = np.unique(found[:count, :2], axis=0, return_inverse=True)
    sides = np.zeros((len(pairs), 2), np.int64)
    np.bitwise_or.at(sides, which.ravel(), found[:count, 2:])
    return pairs[(sides == BOTH).all(axis=1)]


def pairs_text(panels: NDArray) -> str:
    """Pairs of panels (k, 2) in words: "0 and 2, 5 itself and 3 more pairs"."""
    named = [f"{a} and {b}" if a != b else f"{a} itself" for a, b in panels[:MOST_SHOWN].tolist()]
    more = len(panels) - len(named)
    return ", ".join(named) + (f" and {more} more pair{'s' if more > 1 else ''}" if more else "")


@kernel
def _overlapping(x, triangles, panels, boxes, grid, found):
    """Panels of triangles that overlap, and the sides of the other on which each is.

    Rows (lower panel, higher panel, sides of the one, of the other) go into `found` as far as there
    is room; returns their number.
    """
    low, high, normal, size = boxes.low, boxes.high, boxes.normal, boxes.size
    start, members, shape = grid.start, grid.members, grid.shape
    count = 0
    for here in range(start.size - 1):
        for first in range(start[here], start[here + 1]):
            i = members[first]
            for second in range(first + 1, start[here + 1]):
                j = members[second]
                apart = False
                at = 0
                for axis in range(3):
                    lower = max(low[i, axis], low[j, axis])
                    apart |= lower > min(high[i, axis], high[j, axis])
                    place = min(int((lower - grid.origin[axis]) / grid.cell), shape[axis] - 1)
                    at = at * shape[axis] + place
                if apart or at != here:  # two may meet in several cells
                    continue
                shared = 0
                for a in range(3):
                    for b in range(3):
                        shared += triangles[i, a] == triangles[j, b]
                one, other = (i, j) if panels[i] <= panels[j] else (j, i)
                alike = panels[i] == panels[j]
                if shared > 1 or (shared == 1 and alike):
                    continue
                of_one, of_other = _sides(x, triangles, normal, size, one, other)
                # within a panel nobody knows which triangle belongs to which part of it
                if of_one == 0 or (alike and (of_one != BOTH or of_other != BOTH)):
                    continue
                if count < found.shape[0]:
                    found[count, 0], found[count, 1] = panels[one], panels[other]
                    found[count, 2], found[count, 3] = of_one, of_other
                count += 1
    return count


@inner
def _sides(x, triangles, normal, size, one, other):
    """On which sides of each other two triangles are that overlap; (0, 0) where they do not."""
    least = TOUCHING * max(size[one], size[other])
    lx = normal[one, 1] * normal[other, 2] - normal[one, 2] * normal[other, 1]
    ly = normal[one, 2] * normal[other, 0] - normal[one, 0] * normal[other, 2]
    lz = normal[one, 0] * normal[other, 1] - normal[one, 1] * normal[other, 0]
    if lx * lx + ly * ly + lz * lz < LEVEL * LEVEL:
        return 0, 0
    of_one, first, last = _cut(x, triangles, normal, one, other, one, least, lx, ly, lz)
    if of_one == 0:
        return 0, 0
    of_other, begin, end = _cut(x, triangles, normal, other, one, one, least, lx, ly, lz)
    common = min(last, end) - max(first, begin)
    length = np.sqrt(lx * lx + ly * ly + lz * lz)
    if of_other == 0 or not common > OVERLAP * min(size[one], size[other]) * length:
        return 0, 0
    return of_one, of_other


@inner
def _cut(x, triangles, normal, one, other, origin, least, lx, ly, lz):
    """Sides of the other's plane on which a triangle is, and what the plane cuts from it.

    That is the piece of the line of both planes from `first` to `last` along (lx, ly, lz), counted
    from a corner of the triangle `origin`. The sides are 0 where it does not reach the plane.
    """
    base, zero = triangles[other, 0], triangles[origin, 0]
    nx, ny, nz = normal[other, 0], normal[other, 1], normal[other, 2]
    sides, first, last = 0, np.inf, -np.inf
    before, place = 0.0, 0.0
    for k in range(4):
        a = triangles[one, k % 3]
        height = (x[a, 0] - x[base, 0]) * nx + (x[a, 1] - x[base, 1]) * ny
        height += (x[a, 2] - x[base, 2]) * nz
        along = (x[a, 0] - x[zero, 0]) * lx + (x[a, 1] - x[zero, 1]) * ly
        along += (x[a, 2] - x[zero, 2]) * lz
        if height > least:
            sides |= ABOVE
        elif height < -least:
            sides |= BELOW
        else:
            first, last = min(first, along), max(last, along)
        if k > 0 and min(height, before) < -least and max(height, before) > least:
            at = place + before / (before - height) * (along - place)
            first, last = min(first, at), max(last, at)
        before, place = height, along
    return (sides if first <= last else 0), first, last


def _boxes(corners: NDArray) -> Boxes:
    """Boxes of triangles with these corners (m, 3, 3)."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return Boxes(low, high, normal / np.where(length > 0.0, length, 1.0), (high - low).max(axis=1))


def _grid(boxes: Boxes) -> Grid:
    """Put boxes into cells."""
    low, high, size = boxes.low, boxes.high, boxes.size
    origin, most = low.min(axis=0), FEWEST + SPREAD * len(size)
    span, cell = high.max(axis=0) - origin, max(size.mean(), LARGEST * size.max(), 1e-300)
    while np.prod(span / cell + 1.0) > most:
        cell *= 1.25
    shape = (span / cell).astype(np.int64) + 1
    lower, upper = (
        np.minimum(((x - origin) / cell).astype(np.int64), shape - 1) for x in (low, high)
    )
    many = upper - lower + 1
    each = many.prod(axis=1)
    # the cells of each box one after the other, counted along the last axis first
    which = np.repeat(np.arange(len(each)), each)
    place = np.arange(len(which)) - np.repeat(np.cumsum(each) - each, each)
    here, step = np.zeros_like(place), 1
    for axis in (2, 1, 0):
        place, along = np.divmod(place, many[which, axis])
        here += step * (lower[which, axis] + along)
        step *= int(shape[axis])
    start = np.zeros(step + 1, np.int64)
    np.cumsum(np.bincount(here, minlength=step), out=start[1:])
    return Grid(start, which[np.argsort(here, kind="stable")], float(cell), origin, shape)
