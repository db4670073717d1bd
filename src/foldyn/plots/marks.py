"""Marks on a sheet: supports, load arrows, and numbers that keep clear of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from foldyn.plots import scene
from foldyn.plots.scene import Points, View

CROWD = 20  # arrows at nodes other than vertices are thinned if there are more than this
MANY = 100  # arrows are thinned more strongly if there are more than this in all
_DIRECTIONS = np.radians(np.arange(90.0, 450.0, 30.0))


class Mark(NamedTuple):
    """A mark of something that acts on a sheet or is attached to it.

    Attributes
    ----------
    color : str
    keys : list
        Legend entries of the mark.
    lines : sequence of ndarray, each of shape (k, p, 3)
        Polylines through p points each.
    triangles : ndarray, shape (m, 3, 3)
    dots : ndarray, shape (d, 3)
    zorder : float
    width : float
        Width of lines, points.
    dashes : str
    look : mapping
        Marker and size of dots.
    """

    color: str
    keys: Sequence[Any]
    lines: Sequence[Points] = ()
    triangles: Points = np.zeros((0, 3, 3))
    dots: Points = np.zeros((0, 3))
    zorder: float = 7.0
    width: float = 1.8
    dashes: str = "solid"
    look: Mapping[str, Any] = {}

    @property
    def points(self) -> Points:
        """All points (k, 3) that must fit in the picture."""
        parts = [*self.lines, self.triangles, self.dots]
        return np.concatenate([part.reshape(-1, 3) for part in parts])

    def draw(self, axes: Axes3D) -> None:
        """Draw the mark."""
        for lines in self.lines:
            scene.add_segments(axes, lines, self.color, self.width, self.dashes, self.zorder)
        if len(self.triangles):
            look = {"facecolors": self.color, "edgecolors": "white", "linewidths": 0.4}
            filled = Poly3DCollection(self.triangles, zorder=self.zorder + 0.5, **look)
            axes.add_collection3d(filled, autolim=False)
        if len(self.dots):
            look = {"linestyle": "none", "color": self.color, "zorder": self.zorder, **self.look}
            axes.plot(*self.dots.T, **look)


def billboard(tip: Points, along: Points, length: float, half: float, view: View) -> Points:
    """Return triangles (..., 3, 3) that point along unit vectors (..., 3) and face the viewer."""
    across, base = view.across(along), tip - length * along
    return np.stack([tip, base + half * across, base - half * across], axis=-2)


def support_triangles(
    points: Points, fixed: NDArray[np.bool_], size: float, view: View, moves: Points
) -> tuple[Points, list[tuple[int, str]]]:
    """Return a triangle for each held direction, with its tip at the node, and each node's axes.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Node positions (m).
    fixed : ndarray of bool, shape (n, 3)
    size : float
        Length of a triangle (m).
    view : View
    moves : ndarray, shape (n, 3)
        Displacements (m) imposed by supports: triangles of such supports push the nodes.

    Returns
    -------
    triangles : ndarray, shape (count, 3, 3)
    axes : list of (node, axes)
        For example ``(4, "xz")``.
    """
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    nodes, axes = np.nonzero(fixed)
    # The triangle stands outside the sheet; for middle nodes, below or in front of it.
    beyond = (points[fixed] > middle[axes] + 0.05 * size) & (axes != 2)
    way = np.where(moves[fixed], np.sign(moves[fixed]), np.where(beyond, -1.0, 1.0))
    along = way[:, None] * np.eye(3)[axes]
    held = {int(node): "".join("xyz"[k] for k in axes[nodes == node]) for node in nodes}
    return billboard(points[nodes], along, size, 0.38 * size, view), list(held.items())


def load_arrows(
    points: Points, vectors: Points, longest: float, length: float, view: View
) -> tuple[Points, Points]:
    """Return shafts and heads of arrows that start at the loaded nodes.

    Parameters
    ----------
    points, vectors : ndarray, shape (n, 3)
        Node positions (m) and forces (N).
    longest : float
        The force (N) whose arrow has the full length; smaller forces have shorter arrows, down to a
        third of it.
    length : float
        Full length (m).
    view : View

    Returns
    -------
    shafts : ndarray, shape (count, 2, 3)
    heads : ndarray, shape (count, 3, 3)
    """
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    loaded = size[:, 0] > 0.0
    start, size = points[loaded], size[loaded]
    along = vectors[loaded] / size
    tip = start + length * np.maximum(size / longest, 1.0 / 3.0) * along
    heads = billboard(tip, along, 0.3 * length, 0.11 * length, view)
    return np.stack([start, heads[:, 1:].mean(axis=1)], axis=1), heads


def thinned(points: Points, vectors: Points, length: float, always: int | None) -> Points:
    """Set vectors (n, 3) to zero at points (n, 3) too close for arrows of a given length.

    The first `always` points keep their vectors. All points keep them if few others have a vector,
    or if `always` is None.
    """
    where = np.flatnonzero(vectors.any(axis=1))
    if always is None or np.count_nonzero(where >= always) <= CROWD:
        return vectors
    apart = length * (0.3 if len(where) <= MANY else 0.7)
    kept: list[int] = []
    for node in where.tolist():
        gaps = np.linalg.norm(points[kept] - points[node], axis=1)
        if node < always or gaps.min(initial=np.inf) > apart:
            kept.append(node)
    out = np.zeros_like(vectors)
    out[kept] = vectors[kept]
    return out


def arc_arrows(arcs: Points, size: float, view: View) -> tuple[Points, Points]:
    """Return pieces (k, 2, 3) and heads (m, 3, 3) of arrows along arcs (m, p, 3)."""
    along = arcs[:, -1] - arcs[:, -2]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    heads = billboard(arcs[:, -1] + 0.5 * size * along, along, size, 0.4 * size, view)
    return np.stack([arcs[:, :-1], arcs[:, 1:]], axis=2).reshape(-1, 2, 3), heads


class Labels:
    """Places short texts next to points, each in the direction with most room.

    Parameters
    ----------
    axes : Axes3D
    view : View
    distance : float
        Distance from the point to the middle of its text (m).
    obstacles : ndarray, shape (p, 3)
        Points to avoid: samples of lines and marks.
    """

    def __init__(self, axes: Axes3D, view: View, distance: float, obstacles: Points) -> None:
        self._axes, self._view, self._distance = axes, view, distance
        self._taken = view.flat(obstacles.reshape(-1, 3))

    def add(self, point: Points, text: str, color: str, size: float) -> None:
        """Write a text next to a point (3,)."""
        anchor = self._view.flat(point)
        # A wide text needs more room to the left and right than above and below.
        stretch = np.array([1.0 + 0.3 * max(len(text) - 1, 0), 1.0])
        ring = np.stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)], axis=1) * stretch
        spots = anchor + self._distance * ring
        near = np.abs(self._taken - anchor).max(axis=1) < 6.0 * self._distance
        gaps = np.full(len(spots), np.inf)
        if near.any():
            between = (spots[:, None] - self._taken[near][None]) / stretch
            gaps = np.linalg.norm(between, axis=2).min(axis=1)
        # Nearly equal gaps count as equal, so that similar nodes get their texts on the same side.
        best = int(np.argmax(np.round(gaps / self._distance, 1)))
        shift = spots[best] - anchor
        place = point + shift[0] * self._view.basis[0] + shift[1] * self._view.basis[1]
        look = {"fontsize": size, "color": color, "ha": "center", "va": "center", "zorder": 20}
        halo = [withStroke(linewidth=2.0, foreground="white")]
        self._axes.text(*place, text, path_effects=halo, gid=f"label {text}", **look)
        around = np.array([[0.0, 0.0], [0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]])
        covered = spots[best] + 0.9 * self._distance * around * stretch
        self._taken = np.vstack([self._taken, covered])


def along_lines(segments: Points, samples: int = 9) -> Points:
    """Return points along segments (k, 2, 3), shape (k * samples, 3)."""
    t = np.linspace(0.0, 1.0, samples)[None, :, None]
    return (segments[:, None, 0] * (1.0 - t) + segments[:, None, 1] * t).reshape(-1, 3)


def outline(triangles: Points) -> Points:
    """Return points along the outlines of triangles (k, 3, 3)."""
    sides = [0, 1], [1, 2], [2, 0]
    return np.concatenate([along_lines(triangles[:, side], 4) for side in sides])
