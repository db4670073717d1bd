"""Pictures of a pattern that folds: states side by side, and an animation."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import scene
from foldyn.plots.readings import chosen
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, between, edge_keys, rest_keys, side_by_side
from foldyn.plots.writers import checked_file, filmed
from foldyn.statics.folding import Folding
from foldyn.structures.mesh import n4b5
from foldyn.values import show

_WIDTH = 6.0  # inches


def draw_folding(
    folding: Folding,
    states: int | Sequence[int] = 3,
    *,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw states of a folding side by side, with the first state behind in gray.

    Parameters
    ----------
    folding : Folding
        From `foldyn.fold`.
    states : int or sequence of int
        Number of states, evenly spread over the steps from the first to the last; or the numbers of
        the states, where negative numbers count from the end.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        No such state.
    """
    positions = _checked(folding).path["position"].values
    last = len(positions) - 1

    def evenly(count: int) -> list[int]:
        places = np.linspace(0 if count > 1 else last, last, count)
        return np.unique(places.round().astype(int)).tolist()

    shown = chosen("states", states, len(positions), evenly)
    sheet = _sheet(folding, positions[0])
    captions = [_caption(folding, number) for number in shown]
    notes = rest_keys(state="first state")
    return side_by_side(sheet, positions[shown], captions, View(*view), notes, title)[0]


def animate_folding(
    folding: Folding,
    path: str | PathLike[str],
    *,
    frames: int = 60,
    fps: int = 20,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Path:
    """Write a GIF or an MP4 of a pattern that folds.

    Parameters
    ----------
    folding : Folding
        From `foldyn.fold`.
    path : path-like
        File to write, ending in .gif or .mp4. An MP4 needs ffmpeg: on the PATH, or through the
        package imageio-ffmpeg.
    frames : int
        Number of pictures, evenly spread over the steps and interpolated linearly between them.
    fps : int
        Pictures per second, 1 to 50 in a GIF and 1 to 60 in an MP4.
    view, title
        As in `draw_folding`.

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        There are fewer than two frames, the rate is out of range, the path is no GIF or MP4 in an
        existing directory, or an MP4 is requested without ffmpeg.
    ComputationError
        ffmpeg could not write the file.
    """
    path = checked_file(path, frames, fps)
    positions = _checked(folding).path["position"].values
    sheet, sight = _sheet(folding, positions[0]), View(*view)
    keys = edge_keys(sheet)
    every, rows = positions.reshape(-1, 3), -(-len(keys) // 3)
    figure, axes = scene.view_figure(every, sight, title, rows, _WIDTH)
    drawn = DrawnSheet(axes, sheet, positions[0], sight)
    scene.style.finish(figure, keys)
    with filmed(figure, path, fps) as writer:
        for place in np.linspace(0.0, len(positions) - 1.0, frames):
            drawn.move(between(positions, place))
            writer.grab_frame()
    return path


def _checked(folding: Folding) -> Folding:
    if not isinstance(folding, Folding):
        raise InputError(f" = {show(folding)}: give what fd.fold returns", "folding")
    return folding


def _sheet(folding: Folding, nodes: NDArray) -> Sheet3D:
    """The pattern at the node positions of the first state."""
    pattern = folding.pattern
    return Sheet3D(pattern, None, None, nodes, n4b5(pattern).triangles)


def _caption(folding: Folding, number: int) -> str:
    """Text below a state: how far its creases are folded."""
    turned = np.abs(np.degrees(folding.path["fold_angle"].values[number]))
    letters = np.array(folding.pattern.assignments)
    folded = turned[(letters == "M") | (letters == "V")]
    if not folded.size:
        folded = turned
    if folded.max() < 0.05:
        return "flat"
    least, most = f"{folded.min():.0f}", f"{folded.max():.0f}"
    return f"{most} degrees" if least == most else f"{least} to {most} degrees"
