"""Animation of a motion as a GIF."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.animation import PillowWriter
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import scene, style
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, add_undeformed, edge_keys

if TYPE_CHECKING:
    import xarray as xr

    from foldyn.cases import Case
    from foldyn.structures import Structure

_DPI = 100
_FASTEST = 50  # viewers slow down GIFs of shorter frames


def animate(
    case_or_structure: Case | Structure,
    trajectory: xr.Dataset,
    path: str | PathLike[str],
    frames: int = 120,
    fps: int = 25,
    scale: float = 1.0,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Path:
    """Write a GIF of the moving sheet, the sheet at rest behind it in gray.

    Parameters
    ----------
    case_or_structure : Case or Structure
        What moves.
    trajectory : xarray.Dataset
        Its motion: ``displacement`` (time, node, axis) in m over ``time`` (s).
    path : path-like
        File to write, ending in .gif.
    frames : int
        Number of pictures, evenly spread over the trajectory's time (linear in between its
        samples).
    fps : int
        Pictures per second, 1 to 50.
    scale : float
        Factor on the displacement.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of every picture.

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        A trajectory of another structure or with NaN, fewer than two frames, a rate out of range,
        or a path that is no GIF in an existing directory.
    """
    path = Path(path)
    if path.suffix.lower() != ".gif":
        raise InputError(f"path: {path.name!r}; an animation is written as .gif")
    if not path.parent.is_dir():
        raise InputError(f"path: there is no directory {path.parent}; make it first")
    if not 1 <= fps <= _FASTEST:
        raise InputError(f"fps: {fps!r}; give 1 to {_FASTEST} pictures per second")
    if frames < 2:
        raise InputError(f"frames: {frames!r}; an animation has at least two pictures")
    sheet = Sheet3D.of(case_or_structure)
    times, displacement = frame_displacements(sheet, trajectory, frames)
    moving = sheet.nodes + scale * displacement

    sight = View(*view)
    extent = np.vstack([sheet.nodes, moving.reshape(-1, 3)])
    keys = edge_keys(sheet)
    note = f", displacement times {scale:g}" if scale != 1.0 else ""
    figure, axes = scene.view_figure(
        extent, sight, title or " ", legend_rows=-(-len(keys) // 3), width=6.0
    )
    add_undeformed(axes, sheet)
    drawn = DrawnSheet(axes, sheet, moving[0], sight)
    style.legend_below(figure, keys)
    # As many digits as tell two frames apart: equal pictures would be stored as one.
    digits = max(0, int(np.ceil(-np.log10(times[1] - times[0]))))
    clock = axes.text2D(
        0.02,
        1.0 - 0.12 / figure.get_figheight(),
        "",
        transform=figure.transFigure,
        fontsize=style.LABEL,
        va="top",
    )
    style.finish(figure)
    writer = PillowWriter(fps=fps)
    with writer.saving(figure, str(path), dpi=_DPI):
        for time, points in zip(times, moving, strict=True):
            drawn.move(points)
            clock.set_text(f"t = {time:.{digits}f} s{note}")
            writer.grab_frame()
    return path


def frame_displacements(
    sheet: Sheet3D, trajectory: xr.Dataset, frames: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return evenly spaced times and the displacements (frames, n, 3) at them."""
    motion = trajectory["displacement"].transpose("time", "node", "axis").values
    stored = np.asarray(trajectory["time"].values, dtype=np.float64)
    if motion.shape[1:] != sheet.nodes.shape:
        raise InputError(
            f"trajectory: it has {motion.shape[1]} nodes, the structure {len(sheet.nodes)}; give "
            "the case that was simulated"
        )
    if len(stored) < 2:
        raise InputError("trajectory: a single sample does not move; store more of them")
    if not np.isfinite(motion).all():
        raise InputError("trajectory: its displacement contains NaN or infinity; cut it before")
    times = np.linspace(stored[0], stored[-1], frames)
    after = np.clip(np.searchsorted(stored, times), 1, len(stored) - 1)
    part = (times - stored[after - 1]) / (stored[after] - stored[after - 1])
    part = part[:, None, None]
    return times, (1.0 - part) * motion[after - 1] + part * motion[after]
