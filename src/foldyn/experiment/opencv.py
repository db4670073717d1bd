"""OpenCV, an optional part: looked for when it is used."""

from __future__ import annotations

from typing import Any

from foldyn.errors import InputError


def opencv() -> Any:
    """Return the module `cv2`.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        import cv2  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError(
            "camera tracking needs OpenCV, which is not installed: "
            "pip install opencv-python-headless (or foldyn[experiment])"
        ) from None
    return cv2
