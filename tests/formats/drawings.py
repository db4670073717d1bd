"""Drawings to build patterns of."""

from __future__ import annotations

import numpy as np

from foldyn.formats.drawing import Drawing

SQUARE = [((0, 0), (1, 0)), ((1, 0), (1, 1)), ((1, 1), (0, 1)), ((0, 1), (0, 0))]


def drawn(*lines, angles=None, **keys) -> Drawing:
    """Drawing of lines (letter, start, end), each with ends of its own."""
    return Drawing(
        np.array([end for _, *ends in lines for end in ends], dtype=float),
        np.arange(2 * len(lines)).reshape(-1, 2),
        tuple(letter for letter, *_ in lines),
        np.full(len(lines), np.nan) if angles is None else np.array(angles, dtype=float),
        **{"meters": 1.0, **keys},
    )


def square(*lines, angles=(), **keys) -> Drawing:
    """Drawing of the outline of the unit square and further lines."""
    given = [*[np.nan] * 4, *angles] if len(angles) else None
    return drawn(*(("B", *ends) for ends in SQUARE), *lines, angles=given, **keys)


def listed(vertices, faces, edges=(), letters="", angles=None, **keys) -> Drawing:
    """Drawing with faces."""
    return Drawing(
        np.array(vertices, dtype=float),
        np.array(edges, dtype=np.int64).reshape(-1, 2),
        tuple(letters),
        np.full(len(edges), np.nan) if angles is None else np.array(angles, dtype=float),
        tuple(map(tuple, faces)),
        **{"meters": 1.0, **keys},
    )
