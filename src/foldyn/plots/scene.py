"""A three-dimensional view of a sheet: axes, panels and creases, in orthographic projection."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.palette import PAPER
from foldyn.patterns.picture import directions
from foldyn.patterns.topology import Lines
from foldyn.plots import style
from foldyn.results import case_of
from foldyn.values import show

Points = NDArray[np.float64]  # points or vectors, shape (..., 3), or (..., 2) as seen on the screen
Indices = NDArray[np.int64]  # node numbers, a row for each edge or triangle
# Colors of panels that differ from the sheet, in turn.
PAPERS = ("#CFB387", "#B9CBB0", "#C9B4C6", "#A9BFCC")
WIDTH = 7.0  # width of a figure, in inches
# Margins around the visible box, and the largest height of the box, in inches.
_LEFT, _RIGHT, _TICKS, _TALLEST = 0.8, 0.8, 0.5, 5.0
_LABEL_PADS = 6.0, 6.0, 4.0  # points; with more, the label of z would leave the margin
_CLOSE = 0.4  # inches between two ticks with overlapping numbers
_MOST_PIECES, _MOST_DIVISIONS = 2000, 12  # pieces of all panels in a picture; pieces along an edge
_LIGHT = np.array([0.35, -0.5, 0.8]) / np.linalg.norm([0.35, -0.5, 0.8])


@dataclass(frozen=True)
class Sheet3D:
    """The drawable geometry of a case, a structure or a pattern.

    Attributes
    ----------
    pattern : Pattern
    structure : Structure or None
    case : Case or None
    nodes : ndarray, shape (n, 3)
        Positions at rest (m); the pattern's vertices come first.
    triangles : ndarray, shape (nt, 3)
        Triangles that fill the panels.
    """

    pattern: Any
    structure: Any
    case: Any
    nodes: Points
    triangles: Indices

    @classmethod
    def of(cls, thing: Any) -> Sheet3D:
        """Take a case, a structure or a pattern apart, or a result with its case."""
        if isinstance(thing, xr.Dataset):
            thing = case_of(thing)
        case = thing if hasattr(thing, "structure") else None
        structure = thing if case is None else case.structure
        if hasattr(structure, "pattern"):
            pattern, nodes, triangles = structure.pattern, structure.nodes, structure.triangles
        elif not isinstance(thing, Pattern):
            raise InputError(
                f" = {show(thing)}: give a case, a structure, a pattern or a result with its case",
                "case_or_structure",
            )
        else:
            pattern, structure, nodes = structure, None, structure.vertices
            triangles = [(face[0], *side) for face in pattern.faces for side in pairwise(face[1:])]
        nodes = np.asarray(nodes, dtype=np.float64)
        return cls(pattern, structure, case, nodes, np.asarray(triangles, dtype=np.int64))

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box (m)."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    @cached_property
    def edges(self) -> Indices:
        """Nodes along each edge of the pattern except welds, creases first, shape (ne, p).

        p is 2, or for a shell the number of nodes along an edge, because edges of a shell bend.
        """
        creases = self._creases[self.lines.first]
        count = len(creases) + len(self.pattern.boundary)
        if hasattr(self.structure, "edge_nodes"):
            return np.asarray(self.structure.edge_nodes, dtype=np.int64)[:count]
        both = [np.reshape(pairs, (-1, 2)) for pairs in (creases, self.pattern.boundary)]
        return np.concatenate(both).astype(np.int64)

    @cached_property
    def boundary(self) -> Indices:
        """Edges that belong to a single panel, shape (nb, p)."""
        return self.edges[len(self.lines.first) :]

    @cached_property
    def pieces(self) -> Indices:
        """Neighboring nodes along all edges of the pattern, shape (ne (p - 1), 2)."""
        return np.stack([self.edges[:, :-1], self.edges[:, 1:]], axis=2).reshape(-1, 2)

    @cached_property
    def inner_bars(self) -> Indices:
        """Bars, or sides of a shell's triangles, that lie on no edge of the pattern, (k, 2)."""
        if self.structure is None:
            return np.zeros((0, 2), dtype=np.int64)
        edges = {tuple(edge) for edge in np.sort(self.pieces, axis=1).tolist()}
        bars = np.sort(np.asarray(self.structure.bars, dtype=np.int64), axis=1).tolist()
        inner = [bar for bar in bars if tuple(bar) not in edges]
        return np.array(inner, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def actuated(self) -> Indices:
        """Actuated creases, shape (k, p)."""
        if self.case is None:
            return np.zeros((0, 2), dtype=np.int64)
        return self.edges[np.unique(self.lines.number[self.case.actuated_creases])]

    @property
    def highlights(self) -> bool:
        """Whether to highlight actuated creases; not if all are: marks would only hide panels."""
        return len(self.actuated) < len(self.pattern.creases)

    @property
    def parts(self) -> tuple[Any, ...]:
        """Kinds of panels that differ from the sheet."""
        return getattr(getattr(self.structure, "sheet", None), "panels", ())

    @cached_property
    def paper(self) -> NDArray[np.float64]:
        """Color of each triangle (nt, 3); panels that differ from the sheet have their own."""
        color = np.tile(to_rgb(PAPER), (len(self.triangles), 1))
        for number, part in enumerate(self.parts):
            own = np.isin(self.structure.triangle_panel, part.panels)
            color[own] = to_rgb(PAPERS[number % len(PAPERS)])
        return color

    def check_nodes(self, result: str, moved: Points, done: str = "computed") -> None:
        """Refuse displacements (..., n, 3) whose number of nodes differs from the structure's."""
        if moved.shape[-2:] != self.nodes.shape:
            raise InputError(
                f"{result} {moved.shape[-2]} nodes, the structure {len(self.nodes)}; give the case "
                f"that was {done}"
            )

    def creases(self) -> dict[str, Indices]:
        """Creases (k, p), grouped by their assignment; junctions have none."""
        creases, lines = self.edges[: len(self.lines.first)], self.lines
        kinds = lines.letters(self.pattern.assignments)
        return {kind: creases[kinds == kind] for kind in style.CREASES if (kinds == kind).any()}

    @cached_property
    def lines(self) -> Lines:
        """The lines on which creases lie."""
        return Lines.of(self._creases)

    @property
    def _creases(self) -> Indices:
        return np.asarray(self.pattern.creases, dtype=np.int64).reshape(-1, 2)


@dataclass(frozen=True)
class View:
    """Direction of view: elevation above the xy plane and azimuth around z, in degrees."""

    elevation: float = 28.0
    azimuth: float = -60.0

    @cached_property
    def basis(self) -> Points:
        """Unit vectors to the right, up and towards the viewer, shape (3, 3)."""
        return directions(self.elevation, self.azimuth)

    def flat(self, points: Points) -> Points:
        """Project points to the screen, shape (..., 2)."""
        return points @ self.basis[:2].T

    def across(self, line: Points) -> Points:
        """Unit vectors in the screen perpendicular to lines (..., 3); any for ones seen end-on."""
        across = np.cross(self.basis[2], line)
        length = np.linalg.norm(across, axis=-1, keepdims=True)
        seen = length > 1e-6 * np.linalg.norm(line, axis=-1, keepdims=True)
        return np.where(seen, across / np.where(seen, length, 1.0), self.basis[0])


class Seen(NamedTuple):
    """Bounding box of everything in a view, and the size of the box on the screen."""

    view: View
    middle: Points
    box: Points
    corners: Points
    size: Points

    @classmethod
    def of(cls, points: Points, view: View) -> Seen:
        """Bounding box of points (p, 3)."""
        low, high = points.min(axis=0), points.max(axis=0)
        # A flat sheet still gets a box with some height, or its ticks would overlap.
        box = np.maximum(high - low, 0.15 * (high - low).max()) * 1.04
        middle = 0.5 * (low + high)
        corners = middle + 0.5 * box * np.array(list(product((-1, 1), repeat=3)))
        return cls(view, middle, box, corners, np.ptp(view.flat(corners), axis=0))


def view_figure(
    points: Points, view: View, title: str = "", legend_rows: int = 0, width: float = WIDTH
) -> tuple[Figure, Axes3D]:
    """Return a figure with orthographic axes at equal scale that hold all the points (p, 3).

    Three-dimensional axes are square and mostly empty around a flat sheet, so the figure is cropped
    to the projected box: its height follows from the points, at most 5 inches plus the margins.
    """
    seen = Seen.of(points, view)
    scale = min((width - _LEFT - _RIGHT) / seen.size[0], _TALLEST / seen.size[1])
    top = 0.42 if title else 0.12
    bottom = _TICKS + (0.1 + 0.19 * legend_rows if legend_rows else 0.0)
    height = top + seen.size[1] * scale + bottom

    figure = style.new_figure(width, height, title, constrained=False)
    center = _LEFT + 0.5 * (width - _LEFT - _RIGHT), bottom + 0.5 * seen.size[1] * scale
    axes = add_view(figure, seen, center, scale)
    _frame(axes, seen.middle, seen.box, scale * view.basis)
    return figure, axes


def add_view(figure: Figure, seen: Seen, center: tuple[float, float], scale: float) -> Axes3D:
    """Add axes for a view to a figure: the center in inches, the scale in inches per m."""
    width, height = figure.get_size_inches()
    side = 1.1 * seen.size.max() * scale  # side of the square axes, which clip their content
    left, bottom = center[0] - 0.5 * side, center[1] - 0.5 * side
    place = left / width, bottom / height, side / width, side / height
    axes = Axes3D(figure, place, proj_type="ortho", computed_zorder=False)
    figure.add_axes(axes)
    axes.view_init(elev=seen.view.elevation, azim=seen.view.azimuth)
    low, high = seen.middle - 0.5 * seen.box, seen.middle + 0.5 * seen.box
    for axis, name in enumerate("xyz"):
        getattr(axes, f"set_{name}lim")(low[axis], high[axis], view_margin=0)
    # copies, because matplotlib scales its arguments
    axes.set_box_aspect(seen.box.copy(), zoom=1.0)
    flat = np.array(proj_transform(*seen.corners.T, axes.get_proj())[:2])
    zoom = seen.size[0] * scale / (side * np.ptp(flat[0]) / _span(axes))
    axes.set_box_aspect(seen.box.copy(), zoom=zoom)
    axes.patch.set_visible(False)
    return axes


def _span(axes: Axes3D) -> float:
    """Width of the axes in units of the projection."""
    pixels = axes.get_window_extent().width
    return pixels / (axes.transData.transform((1.0, 0.0)) - axes.transData.transform((0.0, 0.0)))[0]


def _frame(axes: Axes3D, middle: Points, box: Points, basis: Points) -> None:
    """Set ticks, grid, panes and labels; `basis` is the basis of the view, in inches per meter."""
    ticks = _ticks(middle, box, basis)
    for axis, places in zip((axes.xaxis, axes.yaxis, axes.zaxis), ticks, strict=True):
        axis.set_major_locator(FixedLocator(places.tolist()))
        axis.set_pane_color((0.975, 0.975, 0.975, 1.0))
        axis.line.set_color(style.LIGHT)
        # Matplotlib has no public setting for this color; if the private one disappears, the grid
        # is only darker.
        getattr(axis, "_axinfo", {}).get("grid", {}).update(color="#E2E2E2", linewidth=0.5)
    axes.tick_params(labelsize=style.NOTE, color=style.LIGHT, labelcolor=style.BLACK, pad=0)
    for name, pad in zip("xyz", _LABEL_PADS, strict=True):
        getattr(axes, f"set_{name}label")(f"{name} (m)", **style.TEXT, labelpad=pad)


def _ticks(middle: Points, box: Points, basis: Points) -> list[NDArray]:
    """Return the ticks of each axis; x and y drop overlapping ticks where their axes meet."""
    ticks = []
    for center, length in zip(middle, box, strict=True):
        wanted = MaxNLocator(max(2, round(5 * length / box.max())), steps=[1, 2, 2.5, 5, 10])
        places = np.array(wanted.tick_values(center - 0.5 * length, center + 0.5 * length))
        ticks.append(places[np.abs(places - center) <= 0.5 * length * (1.0 + 1e-9)])
    # The axes meet in the corner nearest the viewer.
    corner = middle + 0.5 * box * np.where(basis[2] > 0.0, 1.0, -1.0)
    nearest = [int(np.abs(ticks[k] - corner[k]).argmin()) for k in (0, 1)]
    one, other = (ticks[k][nearest[k]] - corner[k] for k in (0, 1))
    apart = one * basis[:2, 0] - other * basis[:2, 1]
    fuller = int(len(ticks[1]) > len(ticks[0]))
    if np.linalg.norm(apart) < _CLOSE and len(ticks[fuller]) > 1:
        ticks[fuller] = np.delete(ticks[fuller], nearest[fuller])
    return ticks


def shades(
    vertices: Points, triangles: Indices, color: str | NDArray[np.float64] = PAPER
) -> NDArray[np.float64]:
    """Color of each triangle, darker if the triangle faces away from the light, shape (nt, 3).

    color : one color for all triangles, or one for each (nt, 3).
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    normals /= np.where(length > 0.0, length, 1.0)[:, None]
    # Both faces of paper reflect, so the sign of the normal does not matter.
    bright = 0.62 + 0.38 * np.abs(normals @ _LIGHT)
    paper = np.array(to_rgb(color)) if isinstance(color, str) else color
    return np.clip(bright[:, None] * paper, 0.0, 1.0)


def pieces(vertices: Points, triangles: Indices) -> Points:
    """Cut each triangle into the same number of smaller triangles (np, 3, 3)."""
    count = _divisions(len(triangles))
    corners = []
    for i in range(count):
        for j in range(count - i):
            corners.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < count - 1:
                corners.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    place = np.array(corners) / count  # (pieces of a triangle, 3, 2)
    weights = np.concatenate([1.0 - place.sum(axis=2, keepdims=True), place], axis=2)
    return np.einsum("pcw,twd->tpcd", weights, vertices[triangles]).reshape(-1, 3, 3)


def piece_colors(
    vertices: Points, triangles: Indices, color: str | NDArray[np.float64] = PAPER
) -> NDArray[np.float64]:
    """Return the `shades` of the `pieces` of all triangles, shape (np, 3)."""
    return np.repeat(shades(vertices, triangles, color), _divisions(len(triangles)) ** 2, axis=0)


def _divisions(count: int) -> int:
    """Number of pieces along a triangle's edge."""
    return int(np.clip(np.sqrt(_MOST_PIECES / max(count, 1)), 1, _MOST_DIVISIONS))


def add_panels(
    axes: Axes3D,
    corners: Points,
    colors: NDArray[np.float64],
    alpha: float = 1.0,
    zorder: float = 1.0,
) -> Poly3DCollection:
    """Fill triangles with corners (k, 3, 3), each in its own color (k, 3).

    An `alpha` below 1 mixes the color with white. Panels are neither translucent nor antialiased,
    because neighboring triangles may overlap or separate by a pixel, which would leave visible
    seams inside every panel.
    """
    plain = {"edgecolors": "none", "linewidths": 0.0, "antialiaseds": False, "zsort": "average"}
    colors = 1.0 - alpha * (1.0 - colors)
    panels = Poly3DCollection(corners, facecolors=colors, zorder=zorder, **plain)
    axes.add_collection3d(panels, autolim=False)
    return panels


def add_segments(
    axes: Axes3D,
    segments: Points,
    color: Any,
    width: float,
    linestyle: Any = "solid",
    zorder: float = 2.0,
    alpha: float = 1.0,
) -> Line3DCollection:
    """Draw polylines (k, p, 3)."""
    look = {"colors": color, "linewidths": width, "linestyles": [linestyle], "capstyle": "butt"}
    lines = Line3DCollection(segments, zorder=zorder, alpha=alpha, **look)
    axes.add_collection3d(lines, autolim=False)
    return lines
