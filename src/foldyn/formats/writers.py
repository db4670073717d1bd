"""Helpers shared by writers: letters of all edges, and flatness of a pattern."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, warn
from foldyn.patterns import Pattern
from foldyn.patterns.geometry import seams
from foldyn.patterns.topology import Edge, edge_lookup

PLANE = 1e-9  # relative to the pattern's size: smaller heights count as zero


def flat_points(pattern: Pattern, kind: str) -> NDArray[np.float64]:
    """Coordinates (n, 2), m, of a flat pattern.

    Raises
    ------
    InputError
        The pattern is folded or does not lie in a plane z = constant, so that a drawing (`kind`)
        would not show its true shape.
    """
    folded = np.abs(pattern.dihedrals - np.pi) > 1e-6
    if np.ptp(pattern.vertices[:, 2]) > PLANE * pattern.size or folded.any():
        raise InputError(
            f": {kind} files hold flat patterns, and this one is "
            + (f"folded at {int(folded.sum())} creases" if folded.any() else "not level")
            + "; write the flat pattern, or the folded one as .fold, .obj or .stl",
            "pattern",
        )
    return pattern.vertices[:, :2]


def letters(pattern: Pattern) -> list[tuple[Edge, str, float]]:
    """Each edge with its letter ("B" on the boundary, "C" on a cut) and the angle it folds to.

    Welds are "F", like facets in all formats, and junctions "U".

    The angle (rad) is NaN if not given, and on the boundary.
    """
    pairs = seams(pattern.vertices, pattern.faces, pattern.face_normals, pattern.boundary)
    angles = pattern.fold_angles.tolist()
    told = dict.fromkeys(edge_lookup(pattern.edges), ("B", np.nan))
    told |= {edge: ("C", np.nan) for pair in pairs for edge in pair}
    rows = edge_lookup(pattern.creases).items()
    told |= {edge: (pattern.assignments[k], angles[k]) for edge, k in rows}
    told |= dict.fromkeys(edge_lookup(pattern.junctions), ("U", np.nan))
    told |= dict.fromkeys(edge_lookup(pattern.welds), ("F", np.nan))
    return [(edge, letter, angle) for edge, (letter, angle) in told.items()]


def warn_of_angles(pattern: Pattern, kind: str) -> None:
    """Warn that a file cannot hold fold angles."""
    if not np.isnan(pattern.fold_angles).all():
        warn(
            f"pattern: {kind} files have no place for fold angles, which are left out; write .fold "
            "to keep them",
            "pattern-files.md#pattern-files",
        )


def warn_of_boards(pattern: Pattern) -> None:
    """Warn that a file cannot hold panel thickness; called by `write_pattern`."""
    if pattern.boards is not None:
        warn(
            "pattern: the file has no place for the thickness of its panels and holds the planes "
            "through their hinge lines; write the thin pattern, and thicken what is read",
            "sheets.md#thick-panels",
        )
