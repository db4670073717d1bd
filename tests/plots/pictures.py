"""What the tests of figures read off them: pixels, legends, the frames of a GIF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image


def pixels(figure: Figure) -> NDArray:
    """Colors (h, w, 3) of a figure as it is drawn."""
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3]


def frames(path: Path) -> list[NDArray]:
    """Colors (h, w, 3) of the pictures of a GIF."""
    with Image.open(path) as gif:
        found = []
        for k in range(gif.n_frames):
            gif.seek(k)
            found.append(np.asarray(gif.convert("RGB"), dtype=int))
    return found


def assert_white_rim(picture: Figure | NDArray) -> None:
    """Nothing of a figure, or of its pixels, is cut off."""
    seen = pixels(picture) if isinstance(picture, Figure) else picture
    for strip in (seen[:2], seen[-2:], seen[:, :2], seen[:, -2:]):
        assert (strip == 255).all()


def shafts(figure: Figure) -> list[NDArray]:
    """Segments (k, 2, 3) of the arrows, one array for each color."""
    lines = [c for c in figure.axes[0].collections if hasattr(c, "_segments3d")]
    return [np.array(c._segments3d) for c in lines if c.get_zorder() == 7.0]


def keys(figure: Figure) -> list[str]:
    """Texts of the legends."""
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]
