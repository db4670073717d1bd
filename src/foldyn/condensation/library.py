"""Condensed panels by shape: congruent panels of one sheet are condensed once.

Stiffness and mass are proportional to Young's modulus and to the density, so panels are condensed,
and kept in memory and on disk, for a sheet with a modulus and a density of 1.

On disk they are in the folder of the compiled kernels. The name of a file is a digest of all that
its content depends on: the exact corners, material, thickness and meshes, the sources of this
computation, the versions of what it calls, and the processor. Files that are damaged or hold
something else count as missing, and a folder that cannot be written is left alone. The files used
longest ago go first.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import llvmlite.binding
import numpy as np
import scipy
from numpy.typing import NDArray

from foldyn.condensation.panel import CondensedPanel, beside, condense, extrapolated
from foldyn.condensation.shapes import HIGHEST, Level
from foldyn.jit.kernel_cache import folder_for
from foldyn.jit.sources import digest
from foldyn.patterns import Pattern
from foldyn.structures import Ply, Sheet
from foldyn.structures.graded import Grading, smooth_vertices
from foldyn.structures.material_axes import material_axes
from foldyn.threads import one_thread
from foldyn.writing import remove_leftovers, whole

ROOM = 256  # condensed panels kept in memory, each about 3 MB
ALIKE = 8  # decimals of coordinates, relative to the size of the pattern, for congruent panels
MOST = 500_000_000  # bytes of all files; each has about 5 MB
HERE = Path(__file__).resolve()


class Group(NamedTuple):
    """Congruent panels, p of them, with k corners each.

    The first corner of each panel is the one from which the shape is described.
    """

    panel: CondensedPanel
    faces: NDArray  # (p, k) vertices
    frames: NDArray  # (p, 3, 3) axes of the panels' frames, in rows
    number: NDArray  # (p,) indices in the pattern

    def swollen(self, strain: NDArray, curvature: NDArray) -> NDArray[np.float64]:
        """Free strains xx, yy and twice xy in the panels' frames, and curvatures 1/m, (p, 4)."""
        own = np.einsum("pai,pij,pbj->abp", self.frames, strain[self.number], self.frames)
        return np.stack([own[0, 0], own[1, 1], 2.0 * own[0, 1], curvature[self.number]], axis=1)


@dataclass(frozen=True)
class _Shape:
    """A shape of panels, the same for coordinates that differ in the last digits."""

    places: tuple[tuple[float, ...], ...]  # rounded
    size: float
    smooth: tuple[int, ...]  # corners where the sheet is smooth
    turned: float  # angle of direction 1 from the first axis, rad, rounded
    corners: NDArray = field(compare=False)  # (k, 3), m
    fibers: float = field(compare=False)  # the angle, not rounded


@lru_cache(maxsize=ROOM)
def _condensed(shape: _Shape, sheet: Sheet, meshes: Meshes) -> CondensedPanel:
    """A panel of a sheet of unit modulus and density."""
    return kept(shape.corners, shape.smooth, sheet, shape.fibers, meshes)


def _unit(sheet: Sheet) -> Sheet:
    """The sheet with a modulus and a density of 1, without what does not matter here."""
    if sheet.plies:
        return Sheet(plies=[_ply(own, sheet.modulus) for own in sheet.plies], direction=0.0)
    first, second = sheet.moduli
    if sheet.shear_modulus is None:
        return Sheet(1.0, sheet.poissons_ratio, sheet.thickness, 1.0)
    return Sheet(
        (1.0, second / first), sheet.poissons_ratio, sheet.thickness, 1.0,
        shear_modulus=sheet.shear_modulus / first, direction=0.0,
    )  # fmt: skip


def _ply(ply: Ply, modulus: float) -> Ply:
    """A ply of a sheet that has a modulus and a density of 1."""
    own, shear = (np.array(ply.youngs_modulus) / modulus).tolist(), ply.shear_modulus
    return Ply(
        ply.thickness, own, ply.poissons_ratio, shear and shear / modulus, ply.angle, density=1.0
    )


class Meshes(NamedTuple):
    """Meshes on which panels are condensed, coarse to fine.

    With several meshes the condensed panels are extrapolated from the two finest, and compared with
    the panels extrapolated from the first and the one before the finest.
    """

    graded: tuple[Grading, ...]
    divisions: tuple[int, ...]
    level: Level = HIGHEST  # shapes onto which panels are condensed


def kept(
    corners: NDArray, smooth: Sequence[int], sheet: Sheet, fibers: float, meshes: Meshes
) -> CondensedPanel:
    """A panel as `condensed` makes it, from disk if it is there."""
    material = sheet.stretching.tolist(), sheet.bending.tolist(), sheet.thickness, sheet.density
    given = (corners.tolist(), smooth, material, fibers, meshes)
    folder = folder_for(HERE.parent)
    if folder is None:
        return condensed(corners, smooth, sheet, fibers, meshes)
    tools = (scipy.__version__, llvmlite.binding.get_host_cpu_name())
    key = repr((digest(HERE, condensed.__name__), tools, given))
    path = folder / f"panel-{hashlib.sha256(key.encode()).hexdigest()[:32]}.npz"
    found = _read(path, key)
    if found is None:
        found = condensed(corners, smooth, sheet, fibers, meshes)
        with suppress(OSError):
            _write(path, key, found)
    return found


def condensed(
    corners: NDArray, smooth: Sequence[int], sheet: Sheet, fibers: float, meshes: Meshes
) -> CondensedPanel:
    """A panel of a sheet; `fibers` is the angle (rad) of an orthotropic one, see `condense`."""
    *others, finest = meshes.graded
    with one_thread():  # bits that do not depend on the number of threads
        fine, modes = condense(corners, smooth, sheet, fibers, finest, meshes.level)
        if not others:
            return fine
        coarse, middle = (
            condense(corners, smooth, sheet, fibers, own, meshes.level, modes)[0] for own in others
        )
        first, second, third = meshes.divisions
        coarser = extrapolated(coarse, middle, second / first)
        return beside(extrapolated(middle, fine, third / second), coarser)


def _read(path: Path, key: str) -> CondensedPanel | None:
    """The panel of a file; None if it is missing or damaged, or holds another."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            found = dict(stored)
        if found.pop("key").item() != key:
            return None
        panel = CondensedPanel(**found)
    except Exception:  # readers raise any kind of exception on damaged files
        return None
    with suppress(OSError):
        path.touch()  # used now
    return panel


def _write(path: Path, key: str, panel: CondensedPanel) -> None:
    """Store a panel; then the files used longest ago go until the others fit."""
    with whole(path) as part:
        np.savez(part, key=np.array(key), **vars(panel))
    remove_leftovers(path.parent)
    files = [(own.stat(), own) for own in path.parent.glob("panel-*.npz")]
    room = MOST
    for status, own in sorted(files, key=lambda one: one[0].st_mtime, reverse=True):
        room -= status.st_size
        if room < 0:
            own.unlink()


def groups(
    pattern: Pattern, sheets: Sequence[Sheet], fibers: NDArray | None, meshes: Meshes
) -> list[Group]:
    """The condensed panels of a pattern, grouped by congruence.

    sheets, fibers : of all panels; see `structures.material_axes`.
    """
    out = []
    for (shape, sheet), members in _congruent(pattern, sheets, fibers).items():
        numbers, faces, frames = zip(*members, strict=True)
        own = _condensed(shape, _unit(sheet), meshes).of(sheet)
        out.append(Group(own, np.array(faces), np.array(frames), np.array(numbers)))
    return out


def different(pattern: Pattern, sheet: Sheet) -> int:
    """How many panels have to be condensed."""
    kinds, kind = sheet.kinds(len(pattern.faces))
    return len(_congruent(pattern, [kinds[k] for k in kind], material_axes(pattern, sheet)))


def _congruent(
    pattern: Pattern, sheets: Sequence[Sheet], fibers: NDArray | None
) -> dict[tuple[_Shape, Sheet], list[tuple[int, NDArray, NDArray]]]:
    """Numbers, vertices and frames (3, 3) of the panels of each shape and sheet."""
    found: dict[tuple[_Shape, Sheet], list[tuple[int, NDArray, NDArray]]] = {}
    smooth = smooth_vertices(pattern)
    for number, (face, sheet) in enumerate(zip(pattern.faces, sheets, strict=True)):
        own, along = list(face), None if fibers is None or not sheet.orthotropic else fibers[number]
        shape, turned, frame = _described(pattern.vertices[own], pattern.size, smooth[own], along)
        found.setdefault((shape, sheet), []).append((number, np.roll(face, -turned), frame))
    return found


def _described(
    x: NDArray, size: float, smooth: NDArray, along: NDArray | None
) -> tuple[_Shape, int, NDArray]:
    """Shape in the frame of one corner, the first of all in sorted order.

    Also returns the number of corners before that corner, and the frame (3, 3).

    along : direction 1 (3,) of an orthotropic sheet.
    """
    order = (np.arange(len(x))[:, None] + np.arange(len(x))) % len(x)
    away = x[order] - x[:, None]
    first = away[:, 1] / np.linalg.norm(away[:, 1], axis=1)[:, None]
    area = np.cross(away, np.roll(away, -1, axis=1)).sum(axis=1)
    normal = area - (area * first).sum(axis=1)[:, None] * first
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    frames = np.stack([first, np.cross(normal, first), normal], axis=1)
    corners = away @ frames.swapaxes(1, 2)
    places = np.round(corners / size, ALIKE) + 0.0  # no negative zeros
    flat = np.zeros((len(x), 2)) if along is None else frames[:, :2] @ along
    angles = np.arctan2(flat[:, 1], flat[:, 0]) % np.pi
    rounded = np.where(angles > np.pi - 10.0**-ALIKE, 0.0, np.round(angles, ALIKE))
    described = []
    for turned, own in enumerate(places.tolist()):
        there = tuple(np.flatnonzero(smooth[order[turned]]).tolist())
        described.append((tuple(map(tuple, own)), there, rounded[turned], turned))
    least, there, angle, turned = min(described)
    shape = _Shape(least, size, there, angle, corners[turned], float(angles[turned]))
    return shape, turned, frames[turned]
