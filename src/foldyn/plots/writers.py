"""Files of an animation: GIF through Pillow, MP4 through ffmpeg."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from os import PathLike
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.figure import Figure
from PIL import Image

from foldyn.errors import ComputationError, InputError
from foldyn.plots import ANIMATIONS
from foldyn.values import number
from foldyn.values import whole as whole_number
from foldyn.writing import whole

DPI = {".gif": 100, ".mp4": 200}  # dots per inch of an animation by the file's suffix
_FASTEST = {".gif": 50, ".mp4": 60}  # viewers slow down GIFs with shorter frames
_COLORS = 128  # colors for all pictures of a GIF: 256 for each would take three times the space
_SAMPLES = 8  # number of pictures from which these colors are taken


class GifWriter(PillowWriter):
    """A GIF that loops forever; all pictures share one small palette.

    Attributes
    ----------
    rate : float
        Pictures per second: a GIF counts in hundredths of a second.
    """

    def __init__(self, fps: int) -> None:
        super().__init__(fps=fps)
        self.rate = 100 / round(100 / fps)
        self._pictures: list[Image.Image] = []

    def grab_frame(self, **savefig_kwargs: Any) -> None:
        """Take a picture of the figure."""
        buffer = BytesIO()
        self.fig.savefig(buffer, **savefig_kwargs, format="rgba", dpi=self.dpi)
        picture = Image.frombuffer("RGBA", self.frame_size, buffer.getvalue(), "raw", "RGBA", 0, 1)
        self._pictures.append(picture.convert("RGB"))

    def finish(self) -> None:
        """Write the file."""
        if not self._pictures:
            return
        palette = _common_palette(self._pictures)
        # Dithered paper would flicker and compress badly.
        look: dict[str, Any] = {"palette": palette, "dither": Image.Dither.NONE}
        first, *others = (picture.quantize(**look) for picture in self._pictures)
        duration = round(1000 / self.rate)
        first.save(self.outfile, save_all=True, append_images=others, duration=duration, loop=0)


def _common_palette(pictures: list[Image.Image]) -> Image.Image:
    """Colors that best suit a sample of the pictures, including the first and the last."""
    count = min(len(pictures), _SAMPLES)
    width, height = pictures[0].size
    strip = Image.new("RGB", (width, height * count))
    for row, k in enumerate(np.linspace(0, len(pictures) - 1, count).round().astype(int)):
        strip.paste(pictures[k], (0, row * height))
    chosen = strip.quantize(_COLORS)
    palette = np.array(chosen.getpalette()).reshape(-1, 3)
    palette[palette.min(axis=1) > 249] = 255  # make white exactly white
    chosen.putpalette(palette.ravel().tolist())
    return chosen


class Mp4Writer(FFMpegWriter):
    """An MP4 in H.264 that browsers and presentations play.

    Attributes
    ----------
    rate : float
        Pictures per second.
    """

    def __init__(self, fps: int) -> None:
        # Everything is set explicitly, so that the caller's matplotlib settings do not matter. The
        # index comes first in the file, so that it plays before it is fully loaded.
        quality = ["-crf", "20", "-movflags", "+faststart"]
        super().__init__(fps=fps, codec="h264", bitrate=-1, extra_args=quality)
        self.rate = float(fps)

    @classmethod
    def bin_path(cls) -> str:
        """Return the path of ffmpeg."""
        return find_ffmpeg()


# Writers of an animation by the file's suffix.
WRITERS = dict(zip((f".{kind}" for kind in ANIMATIONS), (GifWriter, Mp4Writer), strict=True))


def checked_file(path: str | PathLike[str], frames: int, fps: int) -> Path:
    """Check that an animation can be written, and return its file."""
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in WRITERS:
        raise InputError(f"path: {path.name!r}; an animation is written as {' or '.join(WRITERS)}")
    if not path.parent.is_dir():
        raise InputError(f"path: there is no directory {path.parent}; make it first")
    number("fps", fps, least=1, most=_FASTEST[kind], unit="pictures per second")
    whole_number("frames", frames, least=2, what="pictures")
    if kind == ".mp4":
        find_ffmpeg()
    return path


@contextmanager
def filmed(figure: Figure, path: Path, fps: int) -> Iterator[GifWriter | Mp4Writer]:
    """Write a file of the pictures grabbed in the block; the file appears once it is complete.

    Raises
    ------
    ComputationError
        ffmpeg could not write the file.
    """
    kind = path.suffix.lower()
    writer = WRITERS[kind](fps=fps)
    try:
        with whole(path) as part, writer.saving(figure, str(part), DPI[kind]):
            yield writer
    except CalledProcessError as error:
        lines = (error.stderr or "").strip().splitlines()
        raise ComputationError(
            f"{path}: ffmpeg could not write it ({lines[-1] if lines else error}); "
            "write a GIF, or install an ffmpeg with H.264: pip install imageio-ffmpeg"
        ) from None


def find_ffmpeg() -> str:
    """Path of ffmpeg, on the PATH or else in the package imageio-ffmpeg.

    Raises
    ------
    InputError
        ffmpeg is found in neither place.
    """
    program = shutil.which("ffmpeg")
    if program is not None:
        return program
    try:
        from imageio_ffmpeg import get_ffmpeg_exe  # pyright: ignore[reportMissingImports]

        return get_ffmpeg_exe()
    # imageio-ffmpeg is missing, or has no program for this machine
    except (ImportError, RuntimeError):
        raise InputError(
            "MP4 needs ffmpeg, which is not on the PATH: install it, or the package that brings "
            "it (pip install imageio-ffmpeg), or write a GIF"
        ) from None
