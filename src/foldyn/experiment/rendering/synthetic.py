"""Synthetic films and photographs of simulated motions, together with the true motion."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from foldyn.arguments import Unit, brief
from foldyn.errors import ComputationError, InputError
from foldyn.experiment.camera import Camera, opencv
from foldyn.experiment.rendering.picture import Look, Sensor, Studio
from foldyn.results import case_of
from foldyn.values import number
from foldyn.writing import target_of

# Codec by the file's suffix: FFV1 is lossless, mp4v is lossy.
CODECS = {".mkv": "FFV1", ".avi": "FFV1", ".mp4": "mp4v"}


@brief
@dataclass(frozen=True, eq=False)
class SyntheticFilm:
    """A film whose pictures are rendered on demand.

    Attributes
    ----------
    studio : Studio
    time : ndarray, shape (nt,)
        Middle of the exposure of each frame (s); 0 for the first frame.
    motion : callable
        Positions of all nodes (m), shape (k, n, 3), at k times (s).
    rate : float
        Frames per second.
    dropped : tuple of int
        Numbers of frames in which the camera repeats the previous frame.
    seed : int
        Random seed of paper and noise; equal seeds give equal films.
    """

    studio: Studio
    time: Annotated[NDArray[np.float64], Unit("s")]
    motion: Any
    rate: float
    dropped: tuple[int, ...] = ()
    seed: int = 0
    _seen: dict[int, NDArray[np.bool_]] = field(default_factory=dict, repr=False)

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """The pictures one by one, shape (height, width)."""
        last = None
        for k in range(len(self.time)):
            if last is None or k not in self.dropped:
                last = self.frame(k)
            yield last

    def frame(self, k: int) -> NDArray[np.uint8]:
        """Picture number k, ignoring drops."""
        sensor = self.studio.sensor
        times = self.time[k] + sensor.exposure * sensor.moments
        positions = self.motion(times if sensor.exposure else self.time[[k]])
        noise = np.random.default_rng([self.seed, 1, k])
        picture, self._seen[k] = self.studio.take(positions, noise)
        return picture

    def truth(self) -> xr.Dataset:
        """True motion at the times of the frames.

        Returns
        -------
        xarray.Dataset
            `position` (time, node, axis) in m, `position_px` (time, node, uv), for rendered frames
            `seen` (node; False if a panel hides it or it is outside the image), and `dropped`
            (time).
        """
        positions = self.motion(self.time)
        count = positions.shape[1]
        seen = np.zeros((len(self.time), count), dtype=bool)
        for k, one in self._seen.items():
            seen[k] = one
        data = {
            "position": (("time", "node", "axis"), positions, {"units": "m"}),
            "position_px": (("time", "node", "uv"), self.studio.camera.project(positions)),
            "seen": (("time", "node"), seen),
            "dropped": (("time",), np.isin(np.arange(len(self.time)), self.dropped)),
        }
        names = {"node": np.arange(count), "axis": ["x", "y", "z"], "uv": ["u", "v"]}
        return xr.Dataset(data, {"time": ("time", self.time, {"units": "s"}), **names})


def film_of(
    motion: xr.Dataset,
    camera: Camera,
    *,
    rate: float = 240.0,
    duration: float | None = None,
    start: float = 0.0,
    look: Look | None = None,
    sensor: Sensor | None = None,
    dropped: Sequence[int] = (),
    seed: int = 0,
) -> SyntheticFilm:
    """Film of a simulated motion.

    Parameters
    ----------
    motion : xarray.Dataset
        Result of `simulate`, stored finely enough to be interpolated between its samples.
    camera : Camera
    rate : float
        Frames per second.
    duration, start : float
        Part of the motion (s) that is filmed; by default from `start` to the end of the motion. The
        film's time is 0 at `start`.
    look, sensor : Look, Sensor
        Appearance of the specimen, and effects of lens and sensor.
    dropped : sequence of int
        Numbers of frames that repeat the previous frame.
    seed : int

    Returns
    -------
    SyntheticFilm

    Raises
    ------
    InputError
        `motion` is no motion, the time span lies outside it, or nodes are behind the camera.
    """
    structure = case_of(motion).structure
    if "time" not in motion.dims or motion.sizes["time"] < 4:
        raise InputError("motion: not a trajectory of at least four samples; use fd.simulate")
    number("rate", rate, above=0.0, unit="frames per second")
    time = motion["time"].values
    most = time[-1] - start
    length = most if duration is None else duration
    if start < time[0] or not 0.0 < length <= most * (1.0 + 1e-9):
        raise InputError(
            f"start, duration: {start:g} and {length:g} s, but the motion has {time[0]:g} to "
            f"{time[-1]:g} s"
        )
    spline = CubicSpline(time, motion["rest_position"].values + motion["displacement"].values)

    def positions(times: NDArray[np.float64]) -> NDArray[np.float64]:
        return spline(np.clip(start + times, time[0], time[-1]))

    count = int(np.floor(length * rate * (1.0 + 1e-12))) + 1
    studio = Studio.of(structure, camera, look or Look(), sensor or Sensor(), seed)
    return SyntheticFilm(studio, np.arange(count) / rate, positions, rate, tuple(dropped), seed)


def photos_of(
    path: xr.Dataset,
    steps: Sequence[int],
    *,
    camera: Camera,
    look: Look | None = None,
    sensor: Sensor | None = None,
    seed: int = 0,
) -> tuple[list[NDArray[np.uint8]], xr.Dataset]:
    """Photographs of equilibria, each with its own noise, and the truth, laid out as for films.

    Parameters
    ----------
    path : xarray.Dataset
        Result of `trace`.
    steps : sequence of int
        Numbers of the states of the path.
    camera, look, sensor, seed
        As in `film_of`; nothing moves during the exposure.

    Returns
    -------
    photos : list of ndarray of uint8, shape (height, width)
    truth : xarray.Dataset
        `position`, `position_px` and `seen` along the dimension `photo`.
    """
    states = path["rest_position"].values + path["displacement"].values[list(steps)]
    sensor = replace(sensor or Sensor(), exposure=0.0)
    studio = Studio.of(case_of(path).structure, camera, look or Look(), sensor, seed)

    def positions(times: NDArray[np.float64]) -> NDArray[np.float64]:
        return states[np.rint(times).astype(int)]

    numbers = np.arange(len(states), dtype=np.float64)
    still = SyntheticFilm(studio, numbers, positions, 1.0, seed=seed)
    return list(still.frames()), still.truth().rename(time="photo").drop_vars("dropped")


def write_film(film: SyntheticFilm, path: str | os.PathLike[str]) -> None:
    """Write a film to a file: lossless as .mkv or .avi, lossy as .mp4.

    Raises
    ------
    InputError
        The path has another suffix, or the file cannot be written.
    ComputationError
        OpenCV's build lacks the codec.
    """
    cv2 = opencv()
    path = target_of(path)
    if path.suffix not in CODECS:
        raise InputError(f"{path}: films are written to {', '.join(CODECS)}")
    codec = cv2.VideoWriter_fourcc(*CODECS[path.suffix])
    writer = cv2.VideoWriter(str(path), codec, film.rate, film.studio.camera.size, isColor=False)
    if not writer.isOpened():
        raise ComputationError(
            f"{path}: OpenCV cannot write {CODECS[path.suffix]} here; try another ending of "
            f"{', '.join(CODECS)}"
        )
    try:
        for picture in film.frames():
            writer.write(picture)
    finally:
        writer.release()
