"""Condensed panels by shape: congruent panels of one sheet are condensed once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.condensation.panel import CondensedPanel, condense, extrapolated
from foldyn.patterns import Pattern
from foldyn.structures.graded import Grading, smooth_vertices
from foldyn.structures.sheet import Sheet

ROOM = 256  # condensed panels kept in memory, each about 3 MB
ALIKE = 8  # decimals of coordinates, relative to the size of the pattern, for congruent panels


class Meshes(NamedTuple):
    """Meshes on which panels are condensed, coarse to fine.

    With several meshes the condensed panels are extrapolated from the two finest, and compared with
    the panels extrapolated from the first and the one before the finest.
    """

    graded: tuple[Grading, ...]
    divisions: tuple[int, ...]


class Group(NamedTuple):
    """Congruent panels, p of them, with k corners each.

    The first corner of each panel is the one from which the shape is described.
    """

    panel: CondensedPanel
    compared: CondensedPanel  # the same from coarser meshes
    faces: NDArray  # (p, k) vertices
    frames: NDArray  # (p, 3, 3) axes of the panels' frames, in rows
    number: NDArray  # (p,) indices in the pattern


@dataclass(frozen=True)
class _Shape:
    """A shape of panels, the same for coordinates that differ in the last digits."""

    places: tuple[tuple[float, ...], ...]  # rounded
    size: float
    smooth: tuple[int, ...]  # corners where the sheet is smooth
    corners: NDArray = field(compare=False)  # (k, 3), m


@lru_cache(maxsize=ROOM)
def _condensed(
    shape: _Shape, sheet: Sheet, meshes: Meshes
) -> tuple[CondensedPanel, CondensedPanel]:
    """A panel, and the same from coarser meshes."""
    *others, finest = meshes.graded
    corners, smooth = shape.corners, shape.smooth
    fine = condense(corners, smooth, sheet, finest)
    if not others:
        return fine, fine
    coarse, middle = (condense(corners, smooth, sheet, graded, fine) for graded in others)
    first, second, third = meshes.divisions
    return extrapolated(middle, fine, third / second), extrapolated(coarse, middle, second / first)


def groups(pattern: Pattern, sheets: Sequence[Sheet], meshes: Meshes) -> list[Group]:
    """The condensed panels of a pattern, grouped by congruence; `sheets` of all panels."""
    out = []
    for (shape, sheet), members in _congruent(pattern, sheets).items():
        numbers, faces, frames = zip(*members, strict=True)
        unit = replace(sheet, youngs_modulus=1.0, density=1.0)  # others differ by factors
        own, compared = (_of(panel, sheet) for panel in _condensed(shape, unit, meshes))
        out.append(Group(own, compared, np.array(faces), np.array(frames), np.array(numbers)))
    return out


def _of(unit: CondensedPanel, sheet: Sheet) -> CondensedPanel:
    """A panel of a sheet, from one whose modulus and density are 1."""
    by = {
        **dict.fromkeys(("stiffness", "thermal", "held_energy"), sheet.youngs_modulus),
        **dict.fromkeys(("mass", "products"), sheet.density),
    }
    return replace(unit, **{name: factor * getattr(unit, name) for name, factor in by.items()})


def different(pattern: Pattern, sheet: Sheet) -> int:
    """How many panels have to be condensed."""
    kinds, kind = sheet.kinds(len(pattern.faces))
    return len(_congruent(pattern, [kinds[k] for k in kind]))


def _congruent(
    pattern: Pattern, sheets: Sequence[Sheet]
) -> dict[tuple[_Shape, Sheet], list[tuple[int, NDArray, NDArray]]]:
    """Numbers, vertices and frames (3, 3) of the panels of each shape and sheet."""
    found: dict[tuple[_Shape, Sheet], list[tuple[int, NDArray, NDArray]]] = {}
    smooth = smooth_vertices(pattern)
    for number, (face, sheet) in enumerate(zip(pattern.faces, sheets, strict=True)):
        own = list(face)
        shape, turned, frame = _described(pattern.vertices[own], pattern.size, smooth[own])
        found.setdefault((shape, sheet), []).append((number, np.roll(face, -turned), frame))
    return found


def _described(x: NDArray, size: float, smooth: NDArray) -> tuple[_Shape, int, NDArray]:
    """Shape in the frame of one corner, the first of all in sorted order.

    Also returns the number of corners before that corner, and the frame (3, 3).
    """
    described = []
    for turned in range(len(x)):
        corners = np.roll(x, -turned, axis=0)
        away = corners - corners[0]
        first = away[1] / np.linalg.norm(away[1])
        area = np.cross(away, np.roll(away, -1, axis=0)).sum(axis=0)
        normal = area - (area @ first) * first
        normal = normal / np.linalg.norm(normal)
        frame = np.stack([first, np.cross(normal, first), normal])
        own = away @ frame.T
        there = tuple(np.flatnonzero(np.roll(smooth, -turned)).tolist())
        places = np.round(own / size, ALIKE) + 0.0  # no negative zeros
        described.append(
            (_Shape(tuple(map(tuple, places.tolist())), size, there, own), turned, frame)
        )
    return min(described, key=lambda one: (one[0].places, one[0].smooth))
