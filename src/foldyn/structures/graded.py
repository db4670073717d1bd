"""Meshes of panels whose triangles get smaller toward the vertices, down to a radius.

A panel is cut into one piece per corner, by lines from the midpoint of each edge to the mean of the
corners. A piece is a fan about its corner: rays to the cuts, and arcs about the corner at distances

    r (s / r)^(k / m),    k = 0 ... m,

with r the radius, s the length of the ray and m the same for all edges of a pattern. So the size of
triangles is proportional to their distance from the vertex, down to the first arc. Triangles within
the first arc form the corner, which is rigid in its plane (`shells.shell`) unless the sheet is
smooth there (`smooth_vertices`).

In-plane forces concentrate at vertices, and each octave of distance from a vertex stores about
equal energy: without a radius, or without grading, frequencies fall with every refinement.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Lines

PER_LOG = 3.0  # divisions/3 arcs per factor e of distance make triangles about as wide as long
ROOM = 2.0  # least length of a ray, divided by the radius
ON = 1e-3  # rad: a crease that turns less at a vertex goes straight on


class Grading(NamedTuple):
    """Subdivision of panels about their corners."""

    radius: float  # m
    arcs: int  # m + 1
    rays: int  # pieces of a cut; an arc about a corner has twice as many

    @property
    def edge_pieces(self) -> int:
        """Pieces of every edge."""
        return 2 * self.arcs

    def nodes(self, pattern: Pattern) -> int:
        """Approximate number of nodes of a mesh."""
        return 2 * self.rays * self.arcs * sum(map(len, pattern.faces))

    def distances(self, reach: NDArray | float) -> NDArray[np.float64]:
        """Distances (arcs, ...) of the arcs from a corner, relative to the length of each ray."""
        return np.geomspace(self.radius / np.asarray(reach), 1.0, self.arcs)

    def places(self, length: float) -> NDArray[np.float64]:
        """Positions in (0, 1) of the points between the ends of an edge."""
        half = 0.5 * self.distances(0.5 * length)
        return np.concatenate([half, 1.0 - half[-2::-1]])

    def points(self, corners: NDArray) -> NDArray[np.float64]:
        """Points (..., arcs, 2 rays + 1, dimensions) of pieces, which are bilinear patches.

        corners : (..., 4, dimensions) the panel's corner, the middle of the edge that leaves it,
            the mean of the panel's corners, and the middle of the edge that ends in it.
        """
        corner, one, center, other = np.moveaxis(corners, -2, 0)[..., None, None, :]
        reach = self.reach(corners)
        if reach.min() < ROOM * self.radius:
            raise InputError(
                f" = {self.radius:g}: a corner of a panel is only {reach.min():.3g} m from the "
                "lines that join the panel's center to the midpoints of its edges; take at most "
                f"half of that, {reach.min() / ROOM:.3g}",
                "vertex_radius",
            )
        share = np.moveaxis(self.distances(reach), 0, -2)
        x, y = ((share * end)[..., None] for end in self.ends)
        twist = center - one - other + corner
        return corner + x * (one - corner) + y * (other - corner) + x * y * twist

    def reach(self, corners: NDArray) -> NDArray[np.float64]:
        """Lengths (..., 2 rays + 1) of the rays of pieces."""
        along = np.stack([corners[..., k, :] - corners[..., 0, :] for k in (1, 3)], axis=-2)
        return np.linalg.norm(np.stack(self.ends, axis=1) @ along, axis=-1)

    @property
    def steps(self) -> NDArray[np.float64]:
        """Positions in (0, 1) of the points inside a cut, counted from the edge's midpoint."""
        return np.arange(1, self.rays) / self.rays

    @property
    def ends(self) -> tuple[NDArray, NDArray]:
        """Ends (2 rays + 1,) of a patch's rays: coordinates along the two edges at the corner."""
        rising, full = np.append(0.0, self.steps), np.ones(self.rays + 1)
        return np.append(full, rising[::-1]), np.append(rising, full)


def grading(pattern: Pattern, divisions: int, radius: float) -> Grading:
    """Grading whose triangles, away from vertices, are about as large as in an even mesh.

    Raises
    ------
    InputError
        The divisions are not a multiple of 4, as equal growth of rays and arcs requires; or an edge
        is shorter than four radii.
    """
    if divisions % 4:
        raise InputError(
            f" = {divisions}: with a vertex_radius it is a multiple of 4; take "
            f"{4 * math.ceil(divisions / 4)}",
            "divisions",
        )
    ends = pattern.vertices[pattern.lines]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    if length.min() < 2.0 * ROOM * radius:
        raise InputError(
            f" = {radius:g}: an edge of the pattern is {length.min():.3g} m long; take at most a "
            f"quarter of that, {0.5 * length.min() / ROOM:.3g}",
            "vertex_radius",
        )
    return graded(length, divisions // 4, radius)


def smooth_vertices(pattern: Pattern) -> NDArray[np.bool_]:
    """Mask (n,) of vertices of welds where no crease ends or turns: no forces concentrate there."""
    number, total = np.zeros(len(pattern.vertices), int), np.zeros_like(pattern.vertices)
    creases = pattern.creases[Lines.of(pattern.creases).first]
    ends = pattern.vertices[creases]
    along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None]
    for k, sign in enumerate((1.0, -1.0)):
        np.add.at(number, creases[:, k], 1)
        np.add.at(total, creases[:, k], sign * along)
    on = (number == 2) & (np.linalg.norm(total, axis=1) < ON)
    return np.isin(np.arange(len(number)), pattern.welds) & ((number == 0) | on)


def graded(length: NDArray, rays: int, radius: float) -> Grading:
    """Grading for edges of the given lengths, m, with `rays` in half a corner."""
    arcs = 1 + rays * math.ceil(4.0 / PER_LOG * math.log(0.5 * length.max() / radius))
    return Grading(radius, arcs, rays)
