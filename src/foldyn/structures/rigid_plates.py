"""Points of a rigid plate, and the panels of a structure that are rigid plates.

A point in the plane of three other points is a weighted sum of these, with weights that add up to
one. In any motion of a plate that stays flat, the same weights apply, for arbitrary rotations: u =
w1 u1 + w2 u2 + w3 u3. A panel whose nodes all follow three of its corners in this way stays plane;
its bars or its membrane may still deform in the plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.values import indices, show

OFF_PLANE = 1e-9  # largest distance from the plane of three corners, relative to their size
ON_LINE = 1e-9  # sine of the angle below which points count as collinear


class Plate(NamedTuple):
    """A rigid panel: k nodes that follow three of its corners."""

    riders: NDArray  # (k,) nodes that follow the corners
    corners: NDArray  # (3,)
    weights: NDArray  # (k, 3)


def on_plate(points: NDArray, corners: NDArray) -> tuple[NDArray, NDArray]:
    """Weights (k, 3) of points (k, 3) in the plane of three corners (3, 3).

    Also returns the distance (k,) of each point from that plane, relative to the size of the
    corners' triangle; nan if the corners are collinear.
    """
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    size = float(max(np.linalg.norm(a), np.linalg.norm(b)))
    normal = np.cross(a, b)
    area = float(np.linalg.norm(normal))
    if not area > ON_LINE * size * size:
        return np.full((len(points), 3), np.nan), np.full(len(points), np.nan)
    normal = normal / area
    arm = points - corners[0]
    second = np.cross(arm, b) @ normal / area
    third = np.cross(a, arm) @ normal / area
    return np.stack([1.0 - second - third, second, third], axis=1), np.abs(arm @ normal) / size


def checked_panels(rigid: Any, count: int, field: str = "rigid") -> str | tuple[int, ...] | None:
    """Rigid panels among `count` panels: "all", their indices, or None for none."""
    if rigid is None or (isinstance(rigid, str) and rigid == "all"):
        return rigid
    if isinstance(rigid, str):
        raise InputError(f' = {show(rigid)}: must be "all", or panel numbers, as in [0, 1]', field)
    if isinstance(rigid, list | tuple) and not rigid:
        return None
    chosen = indices(field, rigid, "panel", 'or "all"')
    for panel in chosen:
        if not 0 <= panel < count:
            raise InputError(
                f" = {show(rigid)}: panel {panel} is out of range; the pattern has panels 0 to "
                f"{count - 1}",
                field,
            )
    return chosen


def rigid_panels(rigid: str | Sequence[int] | None, count: int) -> Sequence[int]:
    """Indices of the rigid panels among `count`; `rigid` as `checked_panels` returns it."""
    return range(count) if isinstance(rigid, str) else rigid or ()


def check_welds(rigid: str | Sequence[int] | None, pattern: Pattern) -> None:
    """Refuse rigid panels at a weld, across which a sheet bends."""
    chosen = rigid_panels(rigid, len(pattern.faces))
    for edge, panels in zip(pattern.welds.tolist(), pattern.weld_faces.tolist(), strict=True):
        for panel in panels:
            if panel in chosen:
                raise InputError(
                    f": panel {panel} is welded to another at ({edge[0]}, {edge[1]}), where the "
                    "sheet bends; leave it out, or make the weld a crease",
                    "rigid",
                )


def rigid_plates(
    rigid: str | Sequence[int] | None, faces: Sequence[Sequence[int]], nodes: NDArray,
    triangles: NDArray, panel: NDArray,
) -> tuple[Plate, ...]:  # fmt: skip
    """Plates of the rigid panels; panels with only three nodes need none.

    Parameters
    ----------
    rigid : "all", sequence of int or None
    faces : sequence of sequence of int
        Corners of the panels.
    nodes : ndarray, shape (n, 3)
    triangles, panel : ndarray, shape (nt, 3), (nt,)
        Triangles of the mesh, and the panel of each.

    Raises
    ------
    InputError
        A panel is not flat.
    """
    plates = []
    for number in rigid_panels(rigid, len(faces)):
        corners = _widest(nodes, faces[number])
        riders = np.setdiff1d(triangles[panel == number], corners)
        weights, off = on_plate(nodes[riders], nodes[corners])
        if riders.size and not off.max() <= OFF_PLANE:
            raise InputError(
                f": panel {number} is not flat: node {riders[int(off.argmax())]} lies "
                f"{off.max():.2g} of its size off the plane of nodes {corners.tolist()}, so that "
                "it cannot be rigid; flatten it, cut it into triangles, or leave it out",
                "rigid",
            )
        if riders.size:
            plates.append(Plate(riders, corners, weights))
    return tuple(plates)


def _widest(nodes: NDArray, face: Sequence[int]) -> NDArray[np.int64]:
    """The three corners of a panel that span the largest triangle; the first of equal ones."""

    def area(three: tuple[int, ...]) -> float:
        a, b, c = nodes[list(three)]
        return float(np.linalg.norm(np.cross(b - a, c - a)))

    largest = max(area(three) for three in combinations(face, 3))
    first = next(three for three in combinations(face, 3) if area(three) > (1.0 - 1e-9) * largest)
    return np.array(first, np.int64)
