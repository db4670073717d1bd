"""Films of modes: one period that repeats without a seam, as a GIF or an MP4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np
import xarray as xr

from foldyn.cases import Case
from foldyn.plots.animation import DPI, checked_kind
from foldyn.plots.modes import ShownModes
from foldyn.plots.scene import View
from foldyn.plots.side_by_side import side_by_side
from foldyn.plots.writers import WRITERS, filmed
from foldyn.structures import Structure

_WIDTH, _COLUMNS = 6.0, 2  # inches; narrow, as films cannot be scrolled on a phone


def animate_modes(
    case_or_structure: Case | Structure,
    modes: xr.Dataset,
    path: str | PathLike[str],
    which: Sequence[int] | None = None,
    amplitude: float | None = None,
    names: Mapping[int, str] | xr.Dataset | None = None,
    frames: int = 40,
    fps: int = 20,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Path:
    """Write a GIF or an MP4 of modes that swing, one or several side by side.

    One period that repeats without a seam; all modes swing at the same pace, whatever their
    frequencies, which stand below them.

    Parameters
    ----------
    case_or_structure : Case or Structure
        What vibrates.
    modes : xarray.Dataset
        Modes of `foldyn.modes`.
    path : path-like
        File to write, ending in .gif or .mp4. An MP4 needs ffmpeg: on the PATH, or through the
        package imageio-ffmpeg.
    which, amplitude, names, view, title
        As in `draw_modes`.
    frames : int
        Number of pictures in a period.
    fps : int
        Pictures per second, 1 to 50 in a GIF and 1 to 60 in an MP4.

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        Modes of another structure, no such mode, fewer than two frames, a rate out of range, a
        path that is no GIF or MP4 in an existing directory, or an MP4 without ffmpeg.
    ComputationError
        ffmpeg could not write the file.
    """
    path = Path(path)
    kind = checked_kind(path, frames, fps)
    shown = ShownModes.of(case_or_structure, modes, which, amplitude, names)
    rest, swings = shown.sheet.nodes, shown.swings
    extent = np.concatenate([rest + swings, rest - swings]).reshape(-1, 3)
    film = side_by_side(
        shown.sheet, rest + swings, shown.captions, View(*view), shown.notes, title, extent,
        width=_WIDTH, most_columns=_COLUMNS,
    )  # fmt: skip
    writer = WRITERS[kind](fps=fps)
    with filmed(writer, film.figure, path, DPI[kind]):
        for phase in 2.0 * np.pi * np.arange(frames) / frames:
            for drawn, swing in zip(film.sheets, swings, strict=True):
                drawn.move(rest + np.cos(phase) * swing)
            writer.grab_frame()
    return path
