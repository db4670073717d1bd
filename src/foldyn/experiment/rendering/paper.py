"""The paper of a structure as a camera sees it: grain, ink around the corners, light."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError

_TILE = 512  # texels of the grain, repeated over the paper


@dataclass(frozen=True)
class Look:
    """What the specimen, the light and the background look like; reflectances from 0 to 1.

    Attributes
    ----------
    paper, ink, background : float
        Reflectance of the paper, of the markers and of what lies behind.
    marker : float
        Radius (m) of the markers: around each vertex every other panel is inked, so that the
        vertex is where lines cross. 0 leaves the paper as it is.
    grain : float
        Standard deviation of the paper's reflectance, relative to it.
    grain_size : float
        Distance of the texels of the grain (m).
    light : tuple of float
        Direction towards the lamp in the camera's axes (right, down, forward).
    ambient : float
        Part of the light that comes from everywhere.
    vignette : float
        Part of the brightness that is missing in the corners of the image.
    """

    paper: float = 0.85
    ink: float = 0.3
    background: float = 0.03
    marker: float = 5e-3
    grain: float = 0.02
    grain_size: float = 1.5e-4
    light: tuple[float, float, float] = (-0.45, -0.65, -0.6)
    ambient: float = 0.45
    vignette: float = 0.1

    def __post_init__(self) -> None:
        for name in ("paper", "ink", "background", "ambient", "vignette"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise InputError(f"{name}: {getattr(self, name)!r}; give a number from 0 to 1")
        for name in ("marker", "grain"):
            if not getattr(self, name) >= 0.0:
                raise InputError(f"{name}: {getattr(self, name)!r} is negative; give 0 for none")
        if not self.grain_size > 0.0:
            raise InputError(f"grain_size: {self.grain_size!r}; give a positive number of m")


@dataclass(frozen=True, eq=False)
class Paper:
    """Triangles of a structure with what is printed on them.

    Attributes
    ----------
    triangles : ndarray, shape (m, 3)
    flat : ndarray, shape (m, 3, 2)
        Corners of each triangle in the plane of its panel (m), panels apart from each other.
    marked : ndarray of bool, shape (m, 3)
        Corners that are vertices of the pattern.
    dark : ndarray of bool, shape (m,)
        Triangles of the panels that are inked around their vertices.
    """

    triangles: NDArray[np.int64]
    flat: NDArray[np.float64]
    marked: NDArray[np.bool_]
    dark: NDArray[np.bool_]

    @classmethod
    def of(cls, structure: Any, rng: np.random.Generator) -> Paper:
        """Paper of a `Structure`; the grain of each panel starts at a random place."""
        triangles = np.asarray(structure.triangles, dtype=np.int64)
        panels = np.asarray(structure.triangle_panel, dtype=np.int64)
        nodes, pattern = np.asarray(structure.nodes), structure.pattern
        flat = np.empty((*triangles.shape, 2))
        for panel in range(len(pattern.faces)):
            own = panels == panel
            points = nodes[triangles[own]]
            middle = points.mean(axis=(0, 1))
            axes = np.linalg.svd((points - middle).reshape(-1, 3), full_matrices=False)[2]
            flat[own] = (points - middle) @ axes[:2].T + rng.uniform(0.0, 1.0, 2)
        marked = triangles < len(pattern.vertices)
        return cls(triangles, flat, marked, two_colors(pattern)[panels])


def two_colors(pattern: Any) -> NDArray[np.bool_]:
    """Color of each panel, so that neighbors differ wherever the pattern allows it."""
    neighbors: list[list[int]] = [[] for _ in pattern.faces]
    for a, b in np.asarray(pattern.crease_faces).tolist():
        neighbors[a].append(b)
        neighbors[b].append(a)
    color = np.full(len(neighbors), -1)
    for start in range(len(neighbors)):
        if color[start] >= 0:
            continue
        color[start], queue = 0, deque([start])
        while queue:
            panel = queue.popleft()
            for other in neighbors[panel]:
                if color[other] < 0:
                    color[other] = 1 - color[panel]
                    queue.append(other)
    return color == 1


def grain_tile(look: Look, rng: np.random.Generator) -> NDArray[np.float32]:
    """Reflectance of the paper on a square of texels that can be repeated."""
    frequency = np.hypot(np.fft.fftfreq(_TILE)[:, np.newaxis], np.fft.rfftfreq(_TILE))
    frequency[0, 0] = np.inf
    # fibers of all lengths: more of the long ones, as in real paper
    noise = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((_TILE, _TILE))) / frequency**0.7)
    tile = look.paper * (1.0 + look.grain * noise / noise.std())
    return np.clip(tile, 0.0, 1.0).astype(np.float32)


def shading(
    points: NDArray[np.float64],
    triangles: NDArray[np.int64],
    light: NDArray[np.float64],
    ambient: float,
) -> NDArray[np.float64]:
    """Light on each triangle: from everywhere, and by the angle to the lamp, on both faces."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    cosine = np.abs(normal @ light) / np.where(length > 0.0, length, 1.0)
    return ambient + (1.0 - ambient) * cosine
