"""States of results as patterns: frames of a FOLD file, or series of OBJ or STL files."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from foldyn.errors import InputError
from foldyn.formats import FORMATS, write_pattern
from foldyn.results import frames_of, state_of

SUFFIXES = tuple(end for end, each in FORMATS.items() if each.write is not None)


def write(
    result: xr.Dataset,
    path: Path,
    case: None,
    *,
    frame: int | None = None,
    every: int | None = None,
    frames: int | None = None,
    scale: float = 1.0,
) -> list[Path]:
    """Write all states as frames if the format has frames; otherwise the last state, or a series.

    Parameters
    ----------
    result : xarray.Dataset
        A motion, an equilibrium path or modes.
    path : Path
        The suffix selects the pattern format. Files of a series are run_0000.obj, run_0001.obj, ...
    case : None
        Not needed.
    frame : int, optional
        Number of the one sample to write.
    every, frames : int, optional
        Take every n-th sample and the last one, or this many samples, evenly spread.
    scale : float
        Factor on all displacements.
    """
    several = every is not None or frames is not None
    if frame is not None and several:
        raise InputError(": one sample or several: leave out every and frames", "frame")
    holds_frames = FORMATS[path.suffix.lower()].frames
    if frame is not None or not (several or holds_frames):
        write_pattern(state_of(result, frame, scale=scale), path)
        return [path]
    pattern, states = frames_of(result, every, frames=frames, scale=scale)
    if holds_frames:
        write_pattern(pattern, path, frames=states)
        return [path]
    files = [_numbered(path, k) for k in range(len(states))]
    left = _numbered(path, len(states))
    if left.exists():
        raise InputError(f"{left}: belongs to a longer series; remove that first")
    for file, state in zip(files, states, strict=True):
        write_pattern(pattern.changed(vertices=state.vertices, name=state.title, boards=None), file)
    return files


def _numbered(path: Path, number: int) -> Path:
    """Name of a file of a series."""
    return path.with_name(f"{path.stem}_{number:04d}{path.suffix}")
