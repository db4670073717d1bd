"""Photographs behind a sheet, and the camera that took them."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError

_TYPES = {b"\xff\xd8\xff": "jpeg", b"\x89PNG": "png"}


@dataclass(frozen=True, eq=False)
class Backdrop:
    """Photographs of a specimen, and the projection matrix of the camera that took them.

    Parameters
    ----------
    pictures : mapping of float to bytes
        The files (JPEG or PNG) by the moment they were taken: time (s) in a motion, position along
        a path. The page shows the latest photograph up to the moment it displays.
    size : tuple of int
        Width and height of the photographs (pixels).
    matrix : ndarray, shape (3, 4)
        Maps a point (x, y, z, 1), m, to (u w, v w, w). The point appears at the pixel (u, v),
        counted from the center of the upper left pixel; w is its distance along the camera axis in
        any unit. See `projection`.

    Raises
    ------
    InputError
        There are no pictures, or a picture or the matrix has the wrong type or shape.
    """

    pictures: Mapping[float, bytes]
    size: tuple[int, int]
    matrix: NDArray

    def __post_init__(self) -> None:
        if not self.pictures:
            raise InputError("pictures: none; give at least one photograph with its moment")
        for moment, content in self.pictures.items():
            _kind(content, f"pictures[{moment:g}]")
        if np.shape(self.matrix) != (3, 4) or not np.isfinite(self.matrix).all():
            raise InputError(
                f"matrix: of shape {np.shape(self.matrix)}; give 3 x 4 finite numbers, as "
                "`projection` makes them"
            )

    def about(self) -> dict[str, Any]:
        """Data for the page."""
        shown = sorted(self.pictures.items())
        return {
            "size": list(self.size),
            "matrix": np.asarray(self.matrix, float).tolist(),
            "pictures": [[float(moment), _uri(content)] for moment, content in shown],
        }


def projection(points: NDArray, pixels: NDArray) -> NDArray:
    """Camera matrix (3, 4) from points (k, 3), m, seen at pixels (k, 2), k >= 6.

    Least-squares solution of the direct linear transformation (Hartley and Zisserman, Multiple View
    Geometry, 2004, section 7.1), with both sets centered and scaled.

    Raises
    ------
    InputError
        There are fewer points, or they are coplanar and do not determine the camera.
    """
    points, pixels = np.asarray(points, float), np.asarray(pixels, float)
    if len(points) < 6 or points.shape[1:] != (3,) or pixels.shape != (len(points), 2):
        raise InputError(
            f"points, pixels: of shapes {points.shape} and {pixels.shape}; give six or more points "
            "with x, y, z and as many pixels"
        )
    outer, inner = _normed(points), _normed(pixels)
    x = np.column_stack([points, np.ones(len(points))]) @ outer.T
    u = np.column_stack([pixels, np.ones(len(points))]) @ inner.T
    none = np.zeros_like(x)
    rows = np.vstack([np.hstack([x, none, -u[:, :1] * x]), np.hstack([none, x, -u[:, 1:2] * x])])
    sizes, found = np.linalg.svd(rows)[1:]
    if sizes[-2] < 1e-8 * sizes[0]:
        raise InputError("points: they lie in a plane, or on lines; take some at other depths")
    matrix = np.linalg.solve(inner, found[-1].reshape(3, 4) @ outer)
    ahead = matrix[2] @ [*points.mean(axis=0), 1.0]
    return matrix / ahead


def _normed(values: NDArray) -> NDArray:
    """Matrix that moves homogeneous points to zero mean and scales their spread to 1."""
    count = values.shape[1]
    out = np.eye(count + 1)
    out[:count, :count] /= float(values.std()) or 1.0
    out[:count, count] = -out[0, 0] * values.mean(axis=0)
    return out


def _kind(content: bytes, place: str) -> str:
    for start, kind in _TYPES.items():
        if content.startswith(start):
            return kind
    raise InputError(f"{place}: neither JPEG nor PNG; give the bytes of such a file")


def _uri(content: bytes) -> str:
    return f"data:image/{_kind(content, '')};base64,{base64.b64encode(content).decode()}"
