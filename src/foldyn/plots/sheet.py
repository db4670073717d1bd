"""Drawn sheets, alone or side by side: panels, and edges that are hidden behind panels.

Drawn sheets can move without being drawn anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from foldyn.plots import scene, style
from foldyn.plots.scene import Indices, Points, Sheet3D, View

SAMPLES = 24  # pieces per edge: the ends of hidden parts are found to about 1/24 of the edge
_CHUNK = 10_000  # points tested at once


def hidden_points(
    points: Points, vertices: Points, triangles: Indices, view: View, size: float
) -> NDArray[np.bool_]:
    """Mark the points (p, 3) that lie behind a triangle in the view.

    A point closer to a triangle than a thousandth of `size` (m) is not behind it, because edges lie
    in their own panels.
    """
    seen = vertices @ view.basis.T
    a, b, c = (seen[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    drawn = np.abs(area) > 1e-9 * size**2  # a triangle seen edge-on hides nothing
    a, u, v, area = a[drawn], u[drawn], v[drawn], area[drawn]
    eyes = points @ view.basis.T
    hidden = np.zeros(len(points), dtype=bool)
    for point, triangle in _near_pairs(eyes[:, :2], (a + np.stack([0 * u, u, v]))[..., :2]):
        d = eyes[point] - a[triangle]
        e, g = u[triangle], v[triangle]
        s = (d[:, 0] * g[:, 1] - d[:, 1] * g[:, 0]) / area[triangle]
        t = (e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]) / area[triangle]
        inside = (s > 1e-9) & (t > 1e-9) & (s + t < 1.0 - 1e-9)
        before = s * e[:, 2] + t * g[:, 2] - d[:, 2] > 1e-3 * size
        hidden[point[inside & before]] = True
    return hidden


def _near_pairs(points: Points, corners: Points) -> Iterator[tuple[Indices, Indices]]:
    """Yield all pairs of points (p, 2) and triangles (3, t, 2) that may overlap, in batches."""
    tree = shapely.STRtree(shapely.box(*corners.min(axis=0).T, *corners.max(axis=0).T))
    for start in range(0, len(points), _CHUNK):
        point, triangle = tree.query(shapely.points(points[start : start + _CHUNK]))
        yield start + point, triangle


def split_edges(
    edges: Indices, vertices: Points, triangles: Indices, view: View, size: float
) -> tuple[Points, Points]:
    """Split edges (k, p), polylines through nodes, into visible and hidden parts.

    Returns
    -------
    visible, hidden : ndarray, shape (m, q, 3)
        Polylines; neighboring pieces of an edge with equal visibility are joined. All parts have as
        many points as the longest; shorter parts repeat their last point.
    """
    if len(edges) == 0:
        return np.zeros((0, 2, 3)), np.zeros((0, 2, 3))
    lines = vertices[edges]
    each = max(2, SAMPLES // (edges.shape[1] - 1))  # samples between nodes
    middle = (np.arange(each) + 0.5)[:, None] / each
    points = lines[:, :-1, None] * (1.0 - middle) + lines[:, 1:, None] * middle
    behind = hidden_points(points.reshape(-1, 3), vertices, triangles, view, size)
    parts: tuple[list, list] = ([], [])
    for line, row in zip(lines, behind.reshape(len(edges), -1), strict=True):
        cuts = [0, *(np.flatnonzero(row[1:] != row[:-1]) + 1).tolist(), len(row)]
        for low, high in pairwise(cuts):
            inner = line[low // each + 1 : -(-high // each)]
            ends = [between(line, cut / each) for cut in (low, high)]
            parts[int(row[low])].append(np.array([ends[0], *inner, ends[1]]))
    return _together(parts[0]), _together(parts[1])


def between(states: Points, place: float) -> Points:
    """Point or state at a number from 0 to p - 1, linear between the p given ones (p, ...)."""
    k = min(int(place), len(states) - 2)
    return states[k] + (states[k + 1] - states[k]) * (place - k)


def _together(parts: list[Points]) -> Points:
    """Stack lines with different numbers of points in one array."""
    longest = max((len(part) for part in parts), default=2)
    same = [np.concatenate([part, part[-1:].repeat(longest - len(part), 0)]) for part in parts]
    return np.array(same).reshape(-1, longest, 3)


_HIDDEN = 0.3  # opacity of edges behind a panel
_MARGIN = 0.15  # inches
_CAPTION, _LINE = 0.42, 0.16  # inches; height of a caption, and of each further line
_TALLEST = 3.2  # inches


def add_undeformed(axes: Axes3D, sheet: Sheet3D) -> None:
    """Draw the sheet at rest in gray."""
    colors = scene.shades(sheet.nodes, sheet.triangles, "#D0D0D0")
    scene.add_panels(axes, sheet.nodes[sheet.triangles], colors, alpha=0.25, zorder=0.5)
    scene.add_segments(axes, sheet.nodes[sheet.edges], style.LIGHT, 0.9, zorder=0.6)


def rest_keys(scale: float = 1.0, state: str = "undeformed") -> list[Line2D]:
    """Legend entries of the sheet at rest, and of the displacement factor if it is not 1."""
    keys = [style.key(state, color=style.LIGHT, linewidth=1.2)]
    if scale != 1.0:
        keys.append(style.key(f"displacement times {scale:g}", linestyle="none"))
    return keys


def panel_keys(sheet: Sheet3D) -> list[Patch]:
    """Legend entries of panels that differ from the sheet."""
    return [
        Patch(facecolor=scene.PAPERS[k % len(scene.PAPERS)], label=_differs(part.own))
        for k, part in enumerate(sheet.parts)
    ]


def _differs(own: Mapping[str, Any]) -> str:
    words = {
        "youngs_modulus": ("E", "Pa"), "poissons_ratio": ("ν", ""), "thickness": ("t", "m"),
        "density": ("ρ", "kg/m³"), "strength": ("strength", "Pa"), "shear_modulus": ("G", "Pa"),
    }  # fmt: skip
    told = [
        f"{words[name][0]} = {', '.join(f'{one:.4g}' for one in np.atleast_1d(value))} "
        f"{words[name][1]}".rstrip()
        for name, value in own.items()
        if name in words
    ]
    return "panels with " + ", ".join(told or ["a direction of their own"])


class EdgeKind(NamedTuple):
    """Edges of one kind: the nodes along them (k, p), look and name."""

    name: str
    edges: Indices
    color: str
    width: float
    dashes: Any


def edge_kinds(sheet: Sheet3D, elements: bool, actuated: bool = True) -> list[EdgeKind]:
    """Kinds of edges of a sheet, in drawing order: the last kind is on top.

    With `elements` they include inner bars or the sides of a shell's triangles; with `actuated`,
    highlights of actuated creases.
    """
    kinds = []
    if actuated and len(sheet.actuated):
        kinds.append(EdgeKind("actuated crease", sheet.actuated, style.ACTUATED, 6.0, "solid"))
    if elements and len(sheet.inner_bars):
        bars = sheet.structure is not None and sheet.structure.bar_law is not None
        name, width = ("bar inside a panel", 0.7) if bars else ("side of a triangle", 0.35)
        kinds.append(EdgeKind(name, sheet.inner_bars, style.GRAY, width, "solid"))
    kinds.append(EdgeKind("boundary", sheet.boundary, style.BLACK, 1.1, "solid"))
    for kind, edges in sheet.creases().items():
        name = f"{style.CREASE_NAMES[kind]} crease"
        kinds.append(EdgeKind(name, edges, style.CREASES[kind], 1.7, style.CREASE_DASHES[kind]))
    return kinds


def edge_keys(sheet: Sheet3D, elements: bool = False, actuated: bool = True) -> list[Line2D]:
    """Legend entries of a sheet's edges."""
    return [
        style.key(kind.name, color=kind.color, linewidth=kind.width, linestyle=kind.dashes)
        for kind in edge_kinds(sheet, elements, actuated)
    ]


class DrawnSheet:
    """Panels, creases and boundary of a sheet in one position.

    Panels are painted from the farthest to the nearest, judged by their centers. This fails if
    large panels lie close to each other, as in a nearly closed sheet. So panels are cut into
    pieces, and pieces whose centers are hidden are painted before all others.

    Parameters
    ----------
    axes : Axes3D
    sheet : Sheet3D
    points : ndarray, shape (n, 3)
        Positions of the nodes (m).
    view : View
    elements : bool
        Draw the bars inside the panels too, or the sides of a shell's triangles.
    actuated : bool
        Highlight actuated creases.
    """

    def __init__(
        self,
        axes: Axes3D,
        sheet: Sheet3D,
        points: Points,
        view: View,
        elements: bool = False,
        actuated: bool = True,
    ) -> None:
        self._sheet, self._view = sheet, view
        hidden, visible = self._pieces(points)
        self._behind = scene.add_panels(axes, *hidden, zorder=0.9)
        self._panels = scene.add_panels(axes, *visible)
        self._lines: list[tuple[Any, Any, Indices]] = []
        for kind in edge_kinds(sheet, elements, actuated):
            visible, hidden = self._split(kind.edges, points)
            look = kind.color, 0.7 * kind.width, kind.dashes
            behind = scene.add_segments(axes, hidden, *look, zorder=1.5, alpha=_HIDDEN)
            front = scene.add_segments(axes, visible, kind.color, kind.width, kind.dashes)
            front.set_label(kind.name)
            self._lines.append((front, behind, kind.edges))

    def move(self, points: Points) -> None:
        """Move the nodes to other positions (n, 3)."""
        for panels, (corners, colors) in zip(
            (self._behind, self._panels), self._pieces(points), strict=True
        ):
            panels.set_verts(corners)
            panels.set_facecolor(colors)
        for front, behind, edges in self._lines:
            visible, hidden = self._split(edges, points)
            front.set_segments(visible)
            behind.set_segments(hidden)

    def _pieces(self, points: Points) -> list[tuple[NDArray, NDArray]]:
        """Corners and colors of the hidden pieces of panels, and of all other pieces."""
        triangles = self._sheet.triangles
        corners = scene.pieces(points, triangles)
        colors = scene.piece_colors(points, triangles, self._sheet.paper)
        middles = corners.mean(axis=1)
        hidden = hidden_points(middles, points, triangles, self._view, self._sheet.size)
        return [(corners[chosen], colors[chosen]) for chosen in (hidden, ~hidden)]

    def _split(self, edges: Indices, points: Points) -> tuple[Points, Points]:
        return split_edges(edges, points, self._sheet.triangles, self._view, self._sheet.size)


def side_by_side(
    sheet: Sheet3D,
    shapes: Points,
    captions: Sequence[str],
    view: View,
    notes: Sequence[Line2D] = (),
    title: str = "",
    extent: Points | None = None,
    width: float = 9.0,
    most_columns: int = 3,
) -> tuple[Figure, list[DrawnSheet]]:
    """Draw a sheet in several positions, with the sheet at its own `nodes` behind in gray.

    Parameters
    ----------
    sheet : Sheet3D
        The sheet; its `nodes` are the positions drawn in gray.
    shapes : ndarray, shape (k, n, 3)
        Node positions of each drawn shape (m).
    captions : sequence of str
        Text below each shape; every caption gets as many lines as the longest.
    view : View
    notes : sequence of Line2D
        Legend entries that come before the entries of the edges.
    title : str
        Title of the figure.
    extent : ndarray, shape (p, 3), optional
        Points (m) for which every view has room, in addition to the gray nodes; by default all
        shapes.
    width : float
        Width of the figure (inches).
    most_columns : int
        Largest number of shapes in a row.

    Returns
    -------
    figure : Figure
        One orthographic view for each sheet, in the order of the shapes.
    sheets : list of DrawnSheet
        The drawn sheets, which can be moved within `extent`.
    """
    count = len(shapes)
    room = np.vstack([sheet.nodes, shapes.reshape(-1, 3) if extent is None else extent])
    seen = scene.Seen.of(room, view)
    keys = [*notes, *edge_keys(sheet, actuated=sheet.highlights)]

    columns = min(count, most_columns)
    columns = -(-count // -(-count // columns))  # fill the rows as evenly as possible
    rows = -(-count // columns)
    cell = width / columns
    flat = view.flat(room)
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    inches = min((cell - 2 * _MARGIN) / size[0], _TALLEST / size[1])  # inches per meter
    aside = inches * (view.flat(seen.middle) - low - 0.5 * size)  # from the box to its content
    below = _CAPTION + _LINE * max(caption.count("\n") for caption in captions)
    top = 0.42 if title else 0.1
    entries = style.columns_that_fit(keys, width, 4)
    bottom = 0.12 + 0.19 * -(-len(keys) // entries)
    step = size[1] * inches + below
    figure = style.new_figure(width, top + rows * step + bottom, title, constrained=False)
    height = figure.get_figheight()
    sheets = []
    for place, (caption, shape) in enumerate(zip(captions, shapes, strict=True)):
        row, column = divmod(place, columns)
        here = min(columns, count - row * columns)  # the last row is centered
        middle = width / 2 + (column - 0.5 * (here - 1)) * cell
        floor = height - top - (row + 1) * step + below
        center = middle + aside[0], floor + 0.5 * size[1] * inches + aside[1]
        axes = scene.add_view(figure, seen, center, inches)
        axes.set_axis_off()
        add_undeformed(axes, sheet)
        sheets.append(DrawnSheet(axes, sheet, shape, view, actuated=sheet.highlights))
        spot = middle / width, (floor - 0.08) / height
        figure.text(*spot, caption, ha="center", va="top", **style.TEXT)
    return style.finish(figure, keys, entries), sheets
