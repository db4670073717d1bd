"""Sheets of quadrilaterals in rows and columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge


def indices(columns: int, rows: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers i along x and j along y of the vertices, shape (columns + 1, rows + 1)."""
    i, j = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1), indexing="ij")
    return i, j


def lines(columns: int, rows: int) -> tuple[list[Edge], list[Edge]]:
    """Creases along x, those from (i, j) to (i + 1, j), and along y, from (i, j) to (i, j + 1)."""
    step = rows + 1
    along_x = [(i * step + j, (i + 1) * step + j) for j in range(1, rows) for i in range(columns)]
    along_y = [(i * step + j, i * step + j + 1) for i in range(1, columns) for j in range(rows)]
    return along_x, along_y


def opposite(columns: int, rows: int) -> tuple[list[Edge], list[Edge]]:
    """Vertices at the lower end of each row, and of each column, paired with the opposite ends."""
    step = rows + 1
    along_x = [(j, columns * step + j) for j in range(step)]
    along_y = [(i * step, i * step + rows) for i in range(columns + 1)]
    return along_x, along_y


def sheet(
    name: str,
    places: Sequence[ArrayLike],
    families: tuple[str, str],
    assignments: Mapping[Edge, str] | Sequence[str] | None = None,
    periods: Sequence[Sequence[Edge]] = (),
) -> Pattern:
    """Sheet of quadrilaterals, front to +z, panels along x first.

    Parameters
    ----------
    name : str
    places : three arrays, each broadcast to shape (columns + 1, rows + 1)
        Coordinates of vertex (i, j), which is number i (rows + 1) + j.
    families : tuple of two str
        Names of the creases along x and along y.
    assignments : mapping or sequence of str, optional
    periods : sequence of sequences of vertex pairs
        Both as in `Pattern`.

    Returns
    -------
    Pattern
    """
    vertices = np.stack(np.broadcast_arrays(*places), axis=-1).astype(np.float64)
    columns, rows = vertices.shape[0] - 1, vertices.shape[1] - 1
    step = rows + 1
    faces = [
        (m * step + n, (m + 1) * step + n, (m + 1) * step + n + 1, m * step + n + 1)
        for n in range(rows)
        for m in range(columns)
    ]
    both = zip(families, lines(columns, rows), strict=True)
    groups = {family: pairs for family, pairs in both if pairs}
    along_x = [(m * step + n, (m + 1) * step + n) for m in range(columns) for n in (0, rows)]
    along_y = [(m * step + n, m * step + n + 1) for m in (0, columns) for n in range(rows)]
    return Pattern(
        vertices.reshape(-1, 3), faces, assignments, name, families=groups, periods=periods,
        rim_families=dict(zip(families, (along_x, along_y), strict=True)),
    )  # fmt: skip
