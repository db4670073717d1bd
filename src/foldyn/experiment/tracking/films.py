"""Films and photographs from files, one picture in memory at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.experiment.camera import opencv
from foldyn.input_files import check_file
from foldyn.values import number

# Suffixes of photographs; all other files are films.
PHOTOS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")

Box = tuple[int, int, int, int]  # column and row of the first pixel, width and height


@dataclass(frozen=True)
class Film:
    """A film in a file.

    Attributes
    ----------
    path : Path
    size : tuple of int
        Width and height (pixels).
    rate : float
        Frames per second, from the file or as given.
    box : tuple of int
        Region of interest: column and row of its first pixel, width and height.
    timed : bool
        Whether times are read from the file; otherwise they follow from the rate.
    declared : int
        Number of frames that the file declares; often only an estimate, the rate times the
        duration. 0 if unknown.
    """

    path: Path
    size: tuple[int, int]
    rate: float
    box: Box
    timed: bool = True
    declared: int = 0

    def frames(self) -> Iterator[tuple[float, NDArray[np.uint8]]]:
        """Yield the time (s) and the gray region of interest of each frame."""
        with _capture(self.path) as film:
            for index in count():
                read, picture = film.read()
                if not read:
                    return
                stamp = film.get(opencv().CAP_PROP_POS_MSEC) * 1e-3
                yield self._time(index, stamp), _gray(picture, self.box)

    def picture(self, index: int) -> NDArray[np.uint8]:
        """One frame by its index, gray and whole."""
        with _capture(self.path) as film:
            film.set(opencv().CAP_PROP_POS_FRAMES, index)
            read, picture = film.read()
        if read:
            return _gray(picture, (0, 0, *self.size))
        raise InputError(f"{self.path}: frame {index} cannot be read")

    def _time(self, index: int, stamp: float) -> float:
        """Time by the frame count, unless the file's time differs by more than rounding to ms."""
        counted = index / self.rate
        if not self.timed or not np.isfinite(stamp) or (index > 0 and stamp <= 0.0):
            return counted
        return counted if abs(stamp - counted) < max(1.5e-3, 0.5 / self.rate) else stamp


@contextmanager
def _capture(path: Path) -> Iterator[Any]:
    """OpenCV's reader of a film, closed at the end of the block."""
    film = opencv().VideoCapture(str(path))
    try:
        yield film
    finally:
        film.release()


def open_film(
    path: str | os.PathLike[str], roi: Box | None = None, *, rate: float | None = None
) -> Film:
    """Open a film, and read its first frame as a check.

    Parameters
    ----------
    path : path
    roi : tuple of int, optional
        Region of interest: column, row, width, height (pixels); None means the whole picture.
    rate : float, optional
        True frames per second, if the file states another rate: slow-motion films often state 30.

    Raises
    ------
    InputError
        There is no such file, its codec is unknown, or the region lies outside.
    """
    cv2 = opencv()
    path = check_file(path, "a film")
    with _capture(path) as film:
        read, picture = film.read()  # `read` is False if the film cannot be opened
        own_rate, frames = film.get(cv2.CAP_PROP_FPS), film.get(cv2.CAP_PROP_FRAME_COUNT)
    if not read or picture is None:
        raise InputError(
            f"{path}: no frame can be read: it is not a film, or its codec is unknown here; "
            "convert it (ffmpeg -i IN -c:v ffv1 OUT.mkv)"
        )
    if rate is not None:
        rate = number("--rate", rate, above=0.0, unit="frames per second")
    elif not (np.isfinite(own_rate) and 0.1 < own_rate < 1e6):
        raise InputError(f"{path}: does not say its frames per second; give them: --rate")
    height, width = picture.shape[:2]
    box = checked_box(roi, width, height)
    declared = round(frames) if np.isfinite(frames) and frames > 0.0 else 0
    return Film(path, (width, height), float(rate or own_rate), box, rate is None, declared)


def read_photo(path: str | os.PathLike[str], roi: Box | None = None) -> NDArray[np.uint8]:
    """Read the gray region of interest of a photograph.

    Raises
    ------
    InputError
        There is no such file, it is not a picture, or the region lies outside.
    """
    cv2 = opencv()
    path = check_file(path, "a photograph")
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise InputError(f"{path}: is not a picture that can be read; save it as PNG or JPEG")
    return _gray(picture, checked_box(roi, picture.shape[1], picture.shape[0]))


def checked_box(roi: Box | None, width: int, height: int) -> Box:
    """Return a region of interest within the image; the whole image for None."""
    if roi is None:
        return 0, 0, width, height
    x, y, w, h = (int(value) for value in roi)
    if min(x, y) < 0 or min(w, h) < 32 or x + w > width or y + h > height:
        raise InputError(
            f"--roi {x},{y},{w},{h}: must lie in the image of {width} x {height} pixels and be at "
            "least 32 pixels wide and high (X,Y,W,H)"
        )
    return x, y, w, h


def _gray(picture: NDArray, box: Box) -> NDArray[np.uint8]:
    x, y, w, h = box
    part = picture[y : y + h, x : x + w]
    if part.ndim == 3:
        part = opencv().cvtColor(part, opencv().COLOR_BGR2GRAY)
    return np.ascontiguousarray(part)
