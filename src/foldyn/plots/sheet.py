"""The drawn sheet: panels and edges that can be moved without drawing them anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from foldyn.plots import scene, style
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.visibility import hidden_points, split_edges

_HIDDEN = 0.3  # opacity of what lies behind a panel


def add_undeformed(axes: Axes3D, sheet: Sheet3D) -> None:
    """Draw the sheet at rest in gray."""
    colors = scene.shades(sheet.nodes, sheet.triangles, "#D0D0D0")
    scene.add_panels(axes, sheet.nodes[sheet.triangles], colors, alpha=0.25, zorder=0.5)
    scene.add_segments(axes, sheet.nodes[sheet.edges], style.LIGHT, 0.9, zorder=0.6)


def rest_keys(scale: float = 1.0, state: str = "undeformed") -> list[Line2D]:
    """Legend entries of the sheet at rest, and of the factor on displacements if it is not 1."""
    keys = [style.key(state, color=style.LIGHT, linewidth=1.2)]
    if scale != 1.0:
        keys.append(style.key(f"displacement times {scale:g}", linestyle="none"))
    return keys


@dataclass(frozen=True)
class EdgeKind:
    """Edges that look alike: the nodes along them (k, p), look and name."""

    name: str
    edges: NDArray[np.int64]
    color: str
    width: float
    dashes: Any


def edge_kinds(sheet: Sheet3D, elements: bool, actuated: bool = True) -> list[EdgeKind]:
    """Return the kinds of edges that a sheet has, from the lowest to the topmost.

    Its inner bars, or the sides of a shell's triangles, are among them where `elements`, the glow
    of actuated creases where `actuated`.
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
    """Return legend entries of a sheet's edges."""
    return [
        style.key(kind.name, color=kind.color, linewidth=kind.width, linestyle=kind.dashes)
        for kind in edge_kinds(sheet, elements, actuated)
    ]


class DrawnSheet:
    """Panels, creases and boundary of a sheet in one position.

    Panels are painted from the farthest to the nearest by their middles, which goes wrong where
    large ones lie close to each other, as in a sheet that is almost closed. So they are cut into
    pieces, and those whose middle is hidden are painted before all others.

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
        points: NDArray[np.float64],
        view: View,
        elements: bool = False,
        actuated: bool = True,
    ) -> None:
        self._sheet, self._view = sheet, view
        hidden, visible = self._pieces(points)
        self._behind = scene.add_panels(axes, *hidden, zorder=0.9)
        self._panels = scene.add_panels(axes, *visible)
        self._lines: list[tuple[Any, Any, NDArray[np.int64]]] = []
        for kind in edge_kinds(sheet, elements, actuated):
            visible, hidden = self._split(kind.edges, points)
            look = kind.color, 0.7 * kind.width, kind.dashes
            behind = scene.add_segments(axes, hidden, *look, zorder=1.5, alpha=_HIDDEN)
            front = scene.add_segments(axes, visible, kind.color, kind.width, kind.dashes)
            front.set_label(kind.name)
            self._lines.append((front, behind, kind.edges))

    def move(self, points: NDArray[np.float64]) -> None:
        """Put the nodes in other positions (n, 3)."""
        for panels, (corners, colors) in zip(
            (self._behind, self._panels), self._pieces(points), strict=True
        ):
            panels.set_verts(corners)
            panels.set_facecolor(colors)
        for front, behind, edges in self._lines:
            visible, hidden = self._split(edges, points)
            front.set_segments(visible)
            behind.set_segments(hidden)

    def _pieces(self, points: NDArray[np.float64]) -> list[tuple[NDArray, NDArray]]:
        """Return corners and colors of the hidden pieces of panels, and of the others."""
        triangles = self._sheet.triangles
        corners = scene.pieces(points, triangles)
        colors = scene.piece_colors(points, triangles)
        hidden = hidden_points(
            corners.mean(axis=1), points, triangles, self._view, self._sheet.size
        )
        return [(corners[chosen], colors[chosen]) for chosen in (hidden, ~hidden)]

    def _split(
        self, edges: NDArray[np.int64], points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return split_edges(edges, points, self._sheet.triangles, self._view, self._sheet.size)
