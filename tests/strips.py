"""Strips of boards side by side, flat or folded like an accordion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import foldyn as fd


def strip(
    boards: int, width: float = 1.0, length: float = 0.6, fold_angle: float = 0.0,
    letters: Sequence[str] = "VM",
) -> fd.Pattern:  # fmt: skip
    """Boards along x, hinged along y; numbers run along x, then at y = length.

    fold_angle : by which each crease is folded (degrees), the way its letter says.
    """
    n = boards + 1
    named = [letters[k % len(letters)] for k in range(boards - 1)]
    turns = [{"V": 1.0, "M": -1.0}[letter] * np.radians(fold_angle) for letter in named]
    way = np.concatenate([[0.0], np.cumsum(turns)])
    step = width * np.stack([np.cos(way), np.zeros(boards), np.sin(way)], axis=1)
    low = np.vstack([np.zeros(3), np.cumsum(step, axis=0)])
    faces = [(k, k + 1, n + k + 1, n + k) for k in range(boards)]
    marks = {(k + 1, n + k + 1): letter for k, letter in enumerate(named)}
    return fd.Pattern(np.vstack([low, low + np.array([0.0, length, 0.0])]), faces, marks, "strip")


def section(pattern: fd.Pattern, panel: int, moved: np.ndarray | None = None) -> np.ndarray:
    """Section (4, 2) of a board of a strip in the plane y = 0, as its panel has moved."""
    boards = pattern.boards
    face = list(pattern.faces[panel][:2])
    middle = boards.of(panel)[:2][:, [0, 2]]
    normal = boards.normals[panel][[0, 2]] * 0.5 * boards.thickness[panel]
    corners = np.vstack([middle - normal, (middle + normal)[::-1]])
    if moved is None:
        return corners
    one, two = pattern.vertices[face][:, [0, 2]], moved[face][:, [0, 2]]
    (a, b), (c, d) = one[1] - one[0], two[1] - two[0]
    turn = np.array([[a * c + b * d, b * c - a * d], [a * d - b * c, a * c + b * d]])
    return two[0] + (corners - one[0]) @ (turn / (a * a + b * b)).T


def overlap(one: np.ndarray, two: np.ndarray) -> float:
    """How deep two convex sections reach into each other, the least along edges' normals."""
    deepest = np.inf
    for corners in (one, two):
        for edge in np.roll(corners, -1, axis=0) - corners:
            across = np.array([-edge[1], edge[0]]) / np.linalg.norm(edge)
            p, q = one @ across, two @ across
            deepest = min(deepest, min(p.max() - q.min(), q.max() - p.min()))
    return float(deepest)
