"""Panels that pass through each other, as opposed to panels that touch.

Two triangles in different planes cross if each has corners on both sides of the other's plane, and
the line segments that the planes cut from them overlap. Triangles that share a corner or side, that
have a corner or side on the other triangle, or that are stacked only touch: this is not crossing.
But panels may cross along sides of their triangles, where each triangle only touches (for example
two flaps of equal size that fold over a panel and meet in their middles). So the test is whether
panels lie on both sides of each other, over all their overlapping triangles.

Two triangles with one common corner can cross along a line from it, and are compared like other
triangles. Two triangles with a common side cannot cross, unless the angle between them passes 0 or
2 pi, which is checked with the angles. Triangles of one panel are compared only if they share no
corner.

Bounding boxes of the triangles are sorted into a regular grid with cells of average box size, and
boxes that share a cell are compared: time and memory grow linearly with the number of boxes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, kernel

TOUCHING = 1e-9  # relative to a triangle's size: a corner this close to a plane lies in it
LEVEL = 1e-3  # rad: triangles whose planes differ by less are stacked
OVERLAP = 1e-5  # relative to the smaller triangle's size: smaller overlaps only touch
ABOVE, BELOW = 1, 2  # sides of a plane that contain parts of a triangle
BOTH = 3
FEWEST, SPREAD = 64, 2  # minimum number of cells, plus this many cells per triangle
LARGEST = 0.0625  # least cell size, relative to the largest box
ROOM = 64  # initial room for pairs
MOST_SHOWN = 8  # largest number of pairs of panels that a text names


class Boxes(NamedTuple):
    """Bounds and planes of m triangles."""

    low: NDArray  # (m, 3)
    high: NDArray
    normal: NDArray  # (m, 3) unit vectors, or zero for triangles without area
    size: NDArray  # (m,) longest side of each box


class Grid(NamedTuple):
    """A regular grid of cells: cell c holds the boxes members[start[c]:start[c + 1]]."""

    start: NDArray
    members: NDArray
    cell: float  # size
    origin: NDArray  # (3,)
    shape: NDArray  # (3,) cells along each axis


def crossing_panels(points: NDArray, triangles: NDArray, panels: NDArray) -> NDArray[np.int64]:
    """Pairs of panels (k, 2), the lower first, that cross; equal if a panel crosses itself.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Coordinates (m), all finite.
    triangles : ndarray of int, shape (m, 3)
        Triangles into which panels are cut.
    panels : ndarray of int, shape (m,)
        The panel of each triangle.
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
    """Pairs of panels (k, 2) in words, such as "0 and 2, 5 itself and 3 more pairs"."""
    named = [f"{a} and {b}" if a != b else f"{a} itself" for a, b in panels[:MOST_SHOWN].tolist()]
    more = len(panels) - len(named)
    return ", ".join(named) + (f" and {more} more pair{'s' if more > 1 else ''}" if more else "")


@kernel
def _overlapping(x, triangles, panels, boxes, grid, found):
    """Panels of overlapping triangles, and on which sides of the other each triangle lies.

    Writes rows (lower panel, higher panel, sides of the first, of the second) to `found` as far as
    there is room; returns their number.
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
                if apart or at != here:  # two boxes may meet in several cells
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
                # within a panel, the parts that triangles belong to are unknown
                if of_one == 0 or (alike and (of_one != BOTH or of_other != BOTH)):
                    continue
                if count < found.shape[0]:
                    found[count, 0], found[count, 1] = panels[one], panels[other]
                    found[count, 2], found[count, 3] = of_one, of_other
                count += 1
    return count


@inner
def _sides(x, triangles, normal, size, one, other):
    """Sides of each other on which two overlapping triangles lie; (0, 0) if they do not overlap."""
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
    """Sides of the other's plane on which a triangle lies, and its intersection with the plane.

    The intersection is the segment of both planes' common line from `first` to `last` along (lx,
    ly, lz), measured from a corner of triangle `origin`. The sides are 0 if the triangle does not
    reach the plane.
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
    """Bounding boxes of triangles (m, 3, 3)."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return Boxes(low, high, normal / np.where(length > 0.0, length, 1.0), (high - low).max(axis=1))


def _grid(boxes: Boxes) -> Grid:
    """Sort boxes into cells."""
    low, high, size = boxes.low, boxes.high, boxes.size
    origin, most = low.min(axis=0), FEWEST + SPREAD * len(size)
    span, cell = high.max(axis=0) - origin, max(size.mean(), LARGEST * size.max(), 1e-300)
    while np.prod(span / cell + 1.0) > most:
        cell *= 1.25
    shape = (span / cell).astype(np.int64) + 1
    lower = np.minimum(((low - origin) / cell).astype(np.int64), shape - 1)
    upper = np.minimum(((high - origin) / cell).astype(np.int64), shape - 1)
    many = upper - lower + 1
    each = many.prod(axis=1)
    # cells of each box in turn, with the last axis fastest
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
