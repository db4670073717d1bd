"""Condensed panels on disk, in the folder of the compiled kernels: each is condensed once.

The name of a file is a digest of all that its content depends on: the exact corners, material,
thickness and meshes, the sources of this computation, the versions of what it calls, and the
processor. Files that are damaged or hold something else count as missing, and a folder that cannot
be written is left alone. The files used longest ago go first.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
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
from foldyn.structures.graded import Grading
from foldyn.structures.sheet import Sheet
from foldyn.threads import one_thread
from foldyn.writing import remove_leftovers, whole

MOST = 500_000_000  # bytes of all files; each has about 5 MB
HERE = Path(__file__).resolve()


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
