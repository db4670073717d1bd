"""Order in which the force kernel passes over a sheet: strip after strip of nodes.

With nodes numbered along the sheet (`model.renumber`), the node numbers of an element are close to
the lowest of them. A kernel that takes the elements in the order of their lowest nodes then needs
the nodal values of a narrow window only. They are copied to ring buffers that stay in the cache:
node i has the row i & mask. Once all elements with lowest nodes up to i are done, the force on node
i is finished and leaves its buffer.

For several threads, the sheet is cut crosswise. An element belongs to the thread that owns its
lowest node. The last strip of a thread reaches into the nodes of the next thread: all threads do
these edge strips first, leave the sums in the force array, wait for each other and go on with their
other strips, which touch only their own nodes; then the sums of the edge strips are added. So the
order of summation does not depend on the threads' speed.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.model import GROUP, BarsHinges

WINDOW = 16384  # nodes in the buffers, unless elements reach farther


class Strips(NamedTuple):
    """Work of one thread: s strips, in order. Ranges are first and last + 1."""

    own: NDArray  # (2,) nodes whose force the thread finishes
    lowest: NDArray  # (s, 2) lowest nodes of the strip's elements
    fresh: NDArray  # (s, 2) nodes that the strip is the first to touch
    finished: NDArray  # (s, 2) nodes whose sums leave the buffer after the strip
    adds: NDArray  # (s,) 1 if the finished sums are added to the sums of an edge strip
    edge: int  # number of strips before the threads wait for each other: 0 or 1
    rows: int  # number of rows of the buffers
    mask: int


def reach(model: BarsHinges) -> int:
    """Largest difference between the node numbers of an element."""
    spans = [
        (np.maximum.reduce(columns) - np.minimum.reduce(columns)).max(initial=0)
        for columns in (model.bars.T, model.hinges.T)
    ]
    return int(max(spans))


def shares(model: BarsHinges, threads: int) -> NDArray:
    """First nodes (threads + 1,) of shares of equal work, and the number of nodes.

    There are fewer shares than requested if elements reach too far.
    """
    n = len(model.rest)
    if threads <= 1:
        return np.array([0, n])
    width = _rounded(reach(model))
    work = np.full(n, 2)  # a bar counts 1, a hinge 2, and the vector operations of a node 2
    for nodes, cost in ((model.bars, 1), (model.hinges, 2)):
        work += cost * np.bincount(np.minimum.reduce(nodes.T), minlength=n)
    done = np.cumsum(work)
    for count in range(threads, 1, -1):
        inner = np.searchsorted(done, done[-1] * np.arange(1, count) / count)
        cuts = np.concatenate([[0], inner // GROUP * GROUP, [n]])
        if np.diff(cuts).min() > 2 * width:
            return cuts
    return np.array([0, n])


def strips(model: BarsHinges, threads: int = 1, window: int = WINDOW) -> list[Strips]:
    """Strips of each thread; fewer threads than requested if elements reach too far."""
    n = len(model.rest)
    whole = threads == 1 and n <= window  # a single strip
    width = 0 if whole else _rounded(reach(model))
    window = max(window, 2 * _power(width))
    step, rows = (window - width, window) if n > window else (max(n, 1), n)
    return [
        _of_thread(int(a), int(b), n, width, step)._replace(rows=rows, mask=_power(rows) - 1)
        for a, b in pairwise(shares(model, threads))
    ]


def _of_thread(a: int, b: int, n: int, width: int, step: int) -> Strips:
    """Strips of the thread that owns nodes a to b of n."""
    left, right = a + width if a > 0 else a, b - width if b < n else b  # edge strips reach beyond
    strips = [((right, b), (right, b + width), (right, b + width), 0)] if b < n else []
    top = a
    for low, high in pairwise(sorted({a, *range(left, right, step), right, b})):
        lowest = (low, high) if low < right else (b, b)
        fresh = top, max(top, min(high + width, b))
        strips.append((lowest, fresh, (low, high), int(not left <= low < right)))
        top = fresh[1]
    columns = (np.array(column, np.int64) for column in zip(*strips, strict=True))
    return Strips(np.array([a, b]), *columns, edge=int(b < n), rows=0, mask=0)


def _power(count: int) -> int:
    """Smallest power of two that is at least `count`."""
    return 1 << max(count - 1, 0).bit_length()


def _rounded(count: int) -> int:
    """Smallest multiple of GROUP that is at least `count`."""
    return -(-count // GROUP) * GROUP
