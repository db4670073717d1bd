"""Films and photographs from files, picture by picture: never more than one in memory."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.experiment.opencv import opencv

PHOTOS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")
"""Endings of photographs; all other files are films."""

Box = tuple[int, int, int, int]
"""Column and row of the first pixel, width and height."""


@dataclass(frozen=True)
class Film:
    """A film in a file.

    Attributes
    ----------
    path : Path
    size : tuple of int
        Width and height (pixels).
    rate : float
        Frames per second, as the file says or as given.
    box : tuple of int
        Region of interest: column and row of its first pixel, width and height.
    timed : bool
        Times come from the file; else from the rate alone.
    told : int
        Frames that the file says it has, often the rate times the duration: an estimate. 0 where it
        does not say.
    """

    path: Path
    size: tuple[int, int]
    rate: float
    box: Box
    timed: bool = True
    told: int = 0

    def frames(self) -> Iterator[tuple[float, NDArray[np.uint8]]]:
        """Give the time (s) and the gray region of interest of each frame."""
        cv2 = opencv()
        film = cv2.VideoCapture(str(self.path))
        try:
            for number in range(2**62):
                read, picture = film.read()
                if not read:
                    return
                told = film.get(cv2.CAP_PROP_POS_MSEC) * 1e-3
                yield self._time(number, told), _gray(cv2, picture, self.box)
        finally:
            film.release()

    def picture(self, number: int) -> NDArray[np.uint8]:
        """Frame of a number, gray and whole."""
        cv2 = opencv()
        film = cv2.VideoCapture(str(self.path))
        try:
            film.set(cv2.CAP_PROP_POS_FRAMES, number)
            read, picture = film.read()
        finally:
            film.release()
        if read:
            return _gray(cv2, picture, (0, 0, *self.size))
        raise InputError(f"{self.path}: frame {number} cannot be read")

    def _time(self, number: int, told: float) -> float:
        """Time by count, unless the file's is off by more than its rounding to milliseconds."""
        counted = number / self.rate
        if not self.timed or not np.isfinite(told) or (number > 0 and told <= 0.0):
            return counted
        return counted if abs(told - counted) < max(1.5e-3, 0.5 / self.rate) else told


def open_film(
    path: str | os.PathLike[str], roi: Box | None = None, rate: float | None = None
) -> Film:
    """Open a film, and read its first frame to be sure that it can be.

    Parameters
    ----------
    path : path
    roi : tuple of int, optional
        Region of interest: column, row, width, height (pixels); None takes all.
    rate : float, optional
        Frames per second at which it was taken, where the file says another: films in slow motion
        often say 30.

    Raises
    ------
    InputError
        There is no such file, its codec is unknown, or the region lies outside.
    """
    cv2 = opencv()
    path = Path(path)
    if not os.path.isfile(path):
        raise InputError(f"{path}: there is no such file")
    film = cv2.VideoCapture(str(path))
    try:
        opened = film.isOpened()
        read, picture = film.read() if opened else (False, None)
        told = film.get(cv2.CAP_PROP_FPS) if opened else 0.0
        count = film.get(cv2.CAP_PROP_FRAME_COUNT) if opened else 0.0
    finally:
        film.release()
    if not read or picture is None:
        raise InputError(
            f"{path}: no frame can be read: it is not a film, or its codec is unknown here; "
            "convert it (ffmpeg -i IN -c:v ffv1 OUT.mkv)"
        )
    if rate is not None and not (np.isfinite(rate) and rate > 0.0):
        raise InputError(f"--rate {rate!r}: give a positive number of frames per second")
    if rate is None and not (np.isfinite(told) and 0.1 < told < 1e6):
        raise InputError(f"{path}: does not say its frames per second; give them: --rate")
    height, width = picture.shape[:2]
    box = checked_box(roi, width, height)
    frames = round(count) if np.isfinite(count) and count > 0.0 else 0
    return Film(path, (width, height), float(rate or told), box, rate is None, frames)


def read_photo(path: str | os.PathLike[str], roi: Box | None = None) -> NDArray[np.uint8]:
    """Read the gray region of interest of a photograph.

    Raises
    ------
    InputError
        There is no such file, it is no picture, or the region lies outside.
    """
    cv2 = opencv()
    path = Path(path)
    if not os.path.isfile(path):
        raise InputError(f"{path}: there is no such file")
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise InputError(f"{path}: is not a picture that can be read; save it as PNG or JPEG")
    return _gray(cv2, picture, checked_box(roi, picture.shape[1], picture.shape[0]))


def checked_box(roi: Box | None, width: int, height: int) -> Box:
    """Return a region of interest that lies in the image; all of it for None."""
    if roi is None:
        return 0, 0, width, height
    x, y, w, h = (int(value) for value in roi)
    if min(x, y) < 0 or min(w, h) < 32 or x + w > width or y + h > height:
        raise InputError(
            f"--roi {x},{y},{w},{h}: must lie in the image of {width} x {height} pixels and be at "
            "least 32 pixels wide and high (X,Y,W,H)"
        )
    return x, y, w, h


def _gray(cv2: Any, picture: NDArray, box: Box) -> NDArray[np.uint8]:
    x, y, w, h = box
    part = picture[y : y + h, x : x + w]
    if part.ndim == 3:
        part = cv2.cvtColor(part, cv2.COLOR_BGR2GRAY)
    return np.ascontiguousarray(part)
