"""Animation of a motion, as a GIF or an MP4."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import scene, style
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, add_undeformed, edge_keys
from foldyn.plots.writers import WRITERS, find_ffmpeg

if TYPE_CHECKING:
    import xarray as xr

    from foldyn.cases import Case
    from foldyn.structures import Structure

_DPI = {".gif": 100, ".mp4": 200}
_FASTEST = {".gif": 50, ".mp4": 60}  # viewers slow down GIFs of shorter frames
_TRAVELS = 0.25  # path of the center of mass, in sizes of the sheet, that is worth a line
_PATH: dict[str, Any] = {"color": style.GREEN, "linewidth": 1.0, "linestyle": (0, (4, 2))}


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
    """Write a GIF or an MP4 of the moving sheet, the sheet at rest behind it in gray.

    The frame stands still and holds the whole motion, at equal scale along all axes; where a free
    body travels, a line shows the path of its center of mass. Every picture tells the simulated
    time and how much slower or faster than in reality it passes.

    Parameters
    ----------
    case_or_structure : Case or Structure
        What moves.
    trajectory : xarray.Dataset
        Its motion: ``displacement`` (time, node, axis) in m over ``time`` (s).
    path : path-like
        File to write, ending in .gif or .mp4. An MP4 needs ffmpeg: on the PATH, or through the
        package imageio-ffmpeg.
    frames : int
        Number of pictures, evenly spread over the trajectory's time (linear in between its
        samples).
    fps : int
        Pictures per second, 1 to 50 in a GIF and 1 to 60 in an MP4.
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
        a path that is no GIF or MP4 in an existing directory, or an MP4 without ffmpeg.
    ComputationError
        ffmpeg could not write the file.
    """
    path = Path(path)
    kind = _checked_kind(path, frames, fps)
    sheet = Sheet3D.of(case_or_structure)
    times, displacement = frame_displacements(sheet, trajectory, frames)
    moving = sheet.nodes + scale * displacement

    sight = View(*view)
    extent = np.vstack([sheet.nodes, moving.reshape(-1, 3)])
    # Where all creases are actuated, their glow would tell nothing and hide the panels.
    glow = len(sheet.actuated) < len(sheet.pattern.creases)
    keys = edge_keys(sheet, actuated=glow)
    traveled = _center_path(sheet, moving)
    if traveled is not None:
        keys.append(Line2D([], [], **_PATH, marker="o", markersize=4.0, label="center of mass"))
    figure, axes = scene.view_figure(
        extent, sight, title or " ", legend_rows=-(-len(keys) // 3), width=6.0
    )
    add_undeformed(axes, sheet)
    drawn = DrawnSheet(axes, sheet, moving[0], sight, actuated=glow)
    dots = [] if traveled is None else [(_draw_path(axes, traveled), traveled)]
    style.legend_below(figure, keys)
    clock = figure.text(
        0.02,
        1.0 - (0.34 if title else 0.12) / figure.get_figheight(),
        "",
        fontsize=style.LABEL,
        color=style.BLACK,
        va="top",
    )
    style.finish(figure)
    writer = WRITERS[kind](fps=fps)
    between = float(times[1] - times[0])
    # As many digits as tell two frames apart: equal pictures would be stored as one.
    digits = max(0, int(np.ceil(-np.log10(between))))
    note = pace(writer.rate * between)
    note += f", displacement times {scale:g}" if scale != 1.0 else ""
    with writer.saving(figure, str(path), dpi=_DPI[kind]):
        for index, (time, points) in enumerate(zip(times, moving, strict=True)):
            drawn.move(points)
            for dot, way in dots:
                dot.set_data_3d(*way[index, :, None])
            clock.set_text(f"t = {time:.{digits}f} s, {note}")
            writer.grab_frame()
    return path


def _checked_kind(path: Path, frames: int, fps: int) -> str:
    """Return the end of the file's name, when all that an animation needs is there."""
    kind = path.suffix.lower()
    if kind not in WRITERS:
        raise InputError(f"path: {path.name!r}; an animation is written as {' or '.join(WRITERS)}")
    if not path.parent.is_dir():
        raise InputError(f"path: there is no directory {path.parent}; make it first")
    if not 1 <= fps <= _FASTEST[kind]:
        raise InputError(f"fps: {fps!r}; give 1 to {_FASTEST[kind]} pictures per second")
    if frames < 2:
        raise InputError(f"frames: {frames!r}; an animation has at least two pictures")
    if kind == ".mp4":
        find_ffmpeg()
    return kind


def pace(seconds: float) -> str:
    """Say how fast an animation plays that shows so many seconds of the motion in a second."""
    times = float(f"{max(seconds, 1.0 / seconds):.2g}")
    if times == 1.0:
        return "shown at real speed"
    return f"shown {times:g} times {'faster' if seconds > 1.0 else 'slower'}"


def _center_path(sheet: Sheet3D, moving: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the positions (frames, 3) of a free body's center of mass, None where it stays."""
    if sheet.case is None or np.asarray(sheet.case.fixed).any():
        return None
    mass = np.asarray(sheet.structure.mass.sum(axis=0)).ravel()
    path = np.einsum("n,fnk->fk", mass / mass.sum(), moving)
    return path if np.linalg.norm(np.ptp(path, axis=0)) > _TRAVELS * sheet.size else None


def _draw_path(axes: Axes3D, path: NDArray[np.float64]) -> Any:
    """Draw the path of the center of mass, and return the dot that moves on it."""
    axes.plot(*path.T, **_PATH, zorder=0.7)
    (dot,) = axes.plot(*path[:1].T, "o", color=style.GREEN, markersize=4.0, zorder=9.0)
    return dot


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
