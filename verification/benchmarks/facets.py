"""Sheets of welded panels: prisms of facets, also curved ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern


def facets(x: NDArray, length: float, pieces: int, axis: int = 1) -> Pattern:
    """A prism of quadrilaterals: a polyline x (k, 3), moved along an axis in several pieces."""
    k, way = len(x), length / pieces * np.eye(3)[axis]
    points = np.concatenate([x + j * way for j in range(pieces + 1)])
    first = [j * k + i for j in range(pieces) for i in range(k - 1)]
    return Pattern(points, [(i, i + 1, k + i + 1, k + i) for i in first])


def welded(pattern: Pattern) -> Pattern:
    """The pattern with all of its edges welded."""
    return Pattern(pattern.vertices, pattern.faces, welds=pattern.creases.tolist())


def cylinder(radius: float, half_angle: float, length: float, around: int, pieces: int) -> Pattern:
    """A cylindrical panel, curved in x and z, of welded facets; z is 0 at its top."""
    turn = np.linspace(-half_angle, half_angle, around + 1)
    arc = radius * np.stack([np.sin(turn), 0.0 * turn, np.cos(turn) - 1.0], axis=1)
    return welded(facets(arc, length, pieces))
