"""Picture of thick panels as boards with their thickness."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.patterns import Boards, Pattern
from foldyn.plots.scene import Points, Sheet3D, View
from foldyn.plots.sheet import rest_keys, side_by_side
from foldyn.structures import Structure


def draw_boards(
    case_or_structure: Case | Structure | Pattern | xr.Dataset,
    displacement: ArrayLike | None = None,
    *,
    captions: Sequence[str] = (),
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw thick panels as boards, with their hinge lines.

    Boards move as rigid bodies that fit the corners of their panels in the least-squares sense.

    Parameters
    ----------
    case_or_structure : Case, Structure or Pattern, or a result with its case
        An object whose pattern was made by `thicken`.
    displacement : array_like, shape (n, 3) or (k, n, 3), optional
        Node displacements (m) of one state, or of several side by side; at rest by default.
    captions : sequence of str, optional
        Text below each state.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        A view of each state, with the boards at rest behind it in gray.

    Raises
    ------
    InputError
        The panels are not thick, or the displacement has another shape or is not finite.
    """
    sheet = Sheet3D.of(case_or_structure)
    pattern = sheet.pattern
    if pattern is None or pattern.boards is None:
        raise InputError("case_or_structure: its panels are not thick; see foldyn.thicken")
    still = np.zeros(sheet.nodes.shape)
    given = still if displacement is None else np.array(displacement, dtype=np.float64)
    moved: Points = given[None] if given.ndim == 2 else given
    if moved.ndim != 3 or moved.shape[1:] != still.shape or not np.isfinite(moved).all():
        raise InputError(
            f"displacement: shape {given.shape}; give {still.shape} for one state, with the "
            "number of states in front for several, all finite"
        )
    texts = [*captions, *[""] * (len(moved) - len(captions))]
    solid = _solid(pattern)
    vertices = sheet.nodes[: len(pattern.vertices)]
    shapes = [_placed(solid, pattern, vertices + u[: len(vertices)]) for u in moved]
    notes = [] if displacement is None else rest_keys()
    return side_by_side(solid, np.array(shapes), texts, View(*view), notes, title)[0]


def _solid(pattern: Pattern) -> Sheet3D:
    """Points of the boards at rest: the pattern's vertices (for hinge lines), then all corners."""
    boards = cast(Boards, pattern.boards)
    nodes, triangles, edges = [pattern.vertices], [], []
    first = len(pattern.vertices)
    for panel, face in enumerate(pattern.faces):
        half = 0.5 * boards.thickness[panel] * boards.normals[panel]
        size = len(face)
        nodes += [boards.of(panel) - half, boards.of(panel) + half]
        back, front = np.arange(size) + first, np.arange(size) + first + size
        for ring in (back, front):
            triangles += [(ring[0], a, b) for a, b in pairwise(ring[1:])]
            edges += list(zip(ring, np.roll(ring, -1), strict=True))
        for a, b, c, d in zip(back, np.roll(back, -1), np.roll(front, -1), front, strict=True):
            triangles += [(a, b, c), (a, c, d)]
        edges += list(zip(back, front, strict=True))
        first += 2 * size
    own = {"creases": pattern.creases, "assignments": pattern.assignments}
    drawn = SimpleNamespace(boundary=np.array(edges), **own)
    return Sheet3D(drawn, None, None, np.concatenate(nodes), np.array(triangles))


def _placed(solid: Sheet3D, pattern: Pattern, moved: Points) -> Points:
    """Positions of the boards' points after the vertices have moved to (nv, 3)."""
    out = solid.nodes.copy()
    out[: len(moved)] = moved
    first = len(moved)
    for face in pattern.faces:
        rest, now = pattern.vertices[list(face)], moved[list(face)]
        turn, _ = Rotation.align_vectors(now - now.mean(axis=0), rest - rest.mean(axis=0))
        board = slice(first, first + 2 * len(face))
        out[board] = now.mean(axis=0) + turn.apply(out[board] - rest.mean(axis=0))
        first = board.stop
    return out
