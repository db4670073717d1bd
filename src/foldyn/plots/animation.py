"""Animations of motions, paths and modes, as a GIF or an MP4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots import scene, style
from foldyn.plots.modes import shown_modes
from foldyn.plots.readings import case_from_result, check_path, displacements, stretches, way
from foldyn.plots.scene import Points, Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, add_undeformed, between, edge_keys, side_by_side
from foldyn.plots.writers import checked_file, filmed
from foldyn.structures import Structure

_TRAVELS = 0.25  # shorter paths of the center of mass, relative to the sheet's size, get no line
_WIDTH, _COLUMNS = 6.0, 2  # inches; narrow, as films cannot scroll on a phone
_PATH: dict[str, Any] = {"color": style.GREEN, "linewidth": 1.0, "linestyle": (0, (4, 2))}


@case_from_result
def animate(
    case_or_structure: Case | Structure,
    result: xr.Dataset,
    *,
    path: str | PathLike[str],
    frames: int = 120,
    fps: int = 25,
    scale: float = 1.0,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Path:
    """Write a GIF or an MP4 of the moving sheet, with the sheet at rest behind it in gray.

    The frame stands still and has room for the whole motion, at equal scale along all axes; if a
    free body travels, a line shows the path of its center of mass. Pictures of a motion show the
    simulated time and how much slower or faster than reality it runs; pictures of an equilibrium
    path show the load factor and whether the state is unstable.

    Parameters
    ----------
    case_or_structure : Case or Structure
        The structure that moves; by default from the result: ``animate(result, "motion.gif")``.
    result : xarray.Dataset
        A motion, with ``displacement`` (time, node, axis) in m and ``time`` (s), or an equilibrium
        path, with ``displacement`` (step, node, axis) and ``load_factor``.
    path : path-like
        File to write, ending in .gif or .mp4. An MP4 needs ffmpeg: on the PATH, or through the
        package imageio-ffmpeg.
    frames : int
        Number of pictures, evenly spread over the time of a motion or the distance that the nodes
        travel along a path (linear between samples).
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
        The result belongs to another structure or contains NaN, there are fewer than two frames,
        the rate is out of range, the path is no GIF or MP4 in an existing directory, or an MP4 is
        requested without ffmpeg.
    ComputationError
        ffmpeg could not write the file.
    """
    path = checked_file(path, frames, fps)
    sheet = Sheet3D.of(case_or_structure)
    places, displacement = frame_displacements(sheet, result, frames)
    moving = sheet.nodes + scale * displacement

    sight = View(*view)
    extent = np.vstack([sheet.nodes, moving.reshape(-1, 3)])
    keys = edge_keys(sheet, actuated=sheet.highlights)
    traveled = _center_path(sheet, moving)
    if traveled is not None:
        keys.append(style.key("center of mass", **_PATH, marker="o", markersize=4.0))
    figure, axes = scene.view_figure(extent, sight, title or " ", -(-len(keys) // 3), _WIDTH)
    add_undeformed(axes, sheet)
    drawn = DrawnSheet(axes, sheet, moving[0], sight, actuated=sheet.highlights)
    dots = [] if traveled is None else [(_draw_path(axes, traveled), traveled)]
    top = 1.0 - (0.34 if title else 0.12) / figure.get_figheight()
    clock = figure.text(0.02, top, "", va="top", **style.TEXT)
    style.finish(figure, keys)
    note = f", displacement times {scale:g}" if scale != 1.0 else ""
    with filmed(figure, path, fps) as writer:
        moving_in_time = "time" in result.sizes
        moments = _times(places, writer.rate) if moving_in_time else _factors(places, result)
        for index, (moment, points) in enumerate(zip(moments, moving, strict=True)):
            drawn.move(points)
            for dot, course in dots:
                dot.set_data_3d(*course[index, :, None])
            clock.set_text(moment + note)
            writer.grab_frame()
    return path


def _times(times: NDArray[np.float64], rate: float) -> list[str]:
    """Texts for pictures of a motion: the time, and the speed of playback."""
    digits, shown = _digits(times), pace(rate * float(times[1] - times[0]))
    return [f"t = {time:.{digits}f} s, {shown}" for time in times]


def _factors(places: NDArray[np.float64], path: xr.Dataset) -> list[str]:
    """Texts for pictures of a path: the load factor, and whether it is unstable."""
    length = way(path)
    factors = np.interp(places, length, path["load_factor"].values)
    unstable = [(length[a], length[b]) for a, b, stable in stretches(path) if not stable]
    digits = _digits(factors)
    return [
        f"load factor {factor:.{digits}f}"
        + (", unstable" if any(a < place < b for a, b in unstable) else "")
        for factor, place in zip(factors, places, strict=True)
    ]


def _digits(values: NDArray[np.float64]) -> int:
    """Number of digits that makes texts differ, because equal pictures would be stored as one."""
    step = float(np.ptp(values)) / (len(values) - 1)
    return max(0, int(np.ceil(-np.log10(step)))) if step > 0.0 else 3


def pace(seconds: float) -> str:
    """Describe the speed of an animation that shows this many seconds of motion per second."""
    times = float(f"{max(seconds, 1.0 / seconds):.2g}")
    if times == 1.0:
        return "shown at real speed"
    return f"shown {times:g} times {'faster' if seconds > 1.0 else 'slower'}"


def _center_path(sheet: Sheet3D, moving: Points) -> Points | None:
    """Positions (frames, 3) of a free body's center of mass; None if it stays."""
    if sheet.case is None or np.asarray(sheet.case.fixed).any():
        return None
    mass = sheet.case.nodal_mass
    path = np.einsum("n,fnk->fk", mass / mass.sum(), moving)
    return path if np.linalg.norm(np.ptp(path, axis=0)) > _TRAVELS * sheet.size else None


def _draw_path(axes: Axes3D, path: Points) -> Any:
    """Draw the path of the center of mass; return the dot that moves on it."""
    axes.plot(*path.T, **_PATH, zorder=0.7)
    (dot,) = axes.plot(*path[:1].T, "o", color=style.GREEN, markersize=4.0, zorder=9.0)
    return dot


def frame_displacements(
    sheet: Sheet3D, result: xr.Dataset, frames: int
) -> tuple[NDArray[np.float64], Points]:
    """Evenly spaced times, or distances along a path, and displacements (frames, n, 3).

    The distance along a path is `plots.readings.way`: shapes change evenly from picture to picture,
    whatever the step lengths.
    """
    if "step" in result.sizes:
        check_path(result, "result")
    elif "time" not in result.sizes:
        raise InputError("result: has neither times nor steps; give a motion or a path")
    dimension = "time" if "time" in result.sizes else "step"
    motion = displacements(result, dimension)
    sheet.check_nodes("result: it has", motion)
    if len(motion) < 2:
        raise InputError("result: a single sample has no motion; store more of them")
    if not np.isfinite(motion).all():
        raise InputError("result: its displacement contains NaN or infinity; cut that off")
    stored = result["time"].values.astype(np.float64) if dimension == "time" else way(result)
    places = np.linspace(stored[0], stored[-1], frames)
    numbers = np.interp(places, stored, np.arange(len(stored)))
    return places, np.array([between(motion, number) for number in numbers])


@case_from_result
def animate_modes(
    case_or_structure: Case | Structure,
    modes: xr.Dataset,
    *,
    path: str | PathLike[str],
    which: Sequence[int] | None = None,
    amplitude: float | None = None,
    names: Mapping[int, str] | xr.Dataset | None = None,
    frames: int = 40,
    fps: int = 20,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Path:
    """Write a GIF or an MP4 of oscillating modes, one or several side by side.

    The animation shows one period, which repeats seamlessly. All modes swing at the same pace;
    their frequencies are written below them.

    Parameters
    ----------
    case_or_structure : Case or Structure
        The structure that vibrates; by default from the modes: ``animate_modes(modes, "x.gif")``.
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
        The modes belong to another structure or lack a requested mode, there are fewer than two
        frames, the rate is out of range, the path is no GIF or MP4 in an existing directory, or an
        MP4 is requested without ffmpeg.
    ComputationError
        ffmpeg could not write the file.
    """
    path = checked_file(path, frames, fps)
    sheet, swings, captions, notes = shown_modes(case_or_structure, modes, which, amplitude, names)
    rest = sheet.nodes
    extent = np.concatenate([rest + swings, rest - swings]).reshape(-1, 3)
    figure, sheets = side_by_side(
        sheet, rest + swings, captions, View(*view), notes, title, extent,
        width=_WIDTH, most_columns=_COLUMNS,
    )  # fmt: skip
    with filmed(figure, path, fps) as writer:
        for phase in 2.0 * np.pi * np.arange(frames) / frames:
            for drawn, swing in zip(sheets, swings, strict=True):
                drawn.move(rest + np.cos(phase) * swing)
            writer.grab_frame()
    return path
