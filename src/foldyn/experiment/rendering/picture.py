"""Picture of a moving structure: paper, light, and rays spread over each pixel and the exposure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from foldyn.arguments import Check, Checked
from foldyn.experiment.camera import Camera, opencv
from foldyn.patterns.pattern import Pattern
from foldyn.structures.discretized import Discretized
from foldyn.values import number, whole

Share = Annotated[float, Check(number, least=0.0, most=1.0)]
NotNegative = Annotated[float, Check(number, least=0.0)]

_TILE = 512  # side of the grain tile in texels, repeated over the paper
_MARGIN = 6  # pixels around the structure that are redrawn in each picture


@dataclass(frozen=True)
class Look(Checked):
    """Appearance of specimen, light and background; reflectances from 0 to 1.

    Attributes
    ----------
    paper, ink, background : float
        Reflectance of the paper, of the markers and of the background.
    marker : float
        Radius (m) of the markers: around each vertex every other panel is inked, so that lines
        cross at the vertex. 0 means no markers.
    grain : float
        Standard deviation of the paper's reflectance, relative to the mean reflectance.
    grain_size : float
        Spacing of the grain's texels (m).
    light : tuple of float
        Direction towards the lamp in the camera's axes (right, down, forward).
    ambient : float
        Part of the light that comes from all directions.
    vignette : float
        Part of the brightness that is missing in the corners of the image.
    """

    paper: Share = 0.85
    ink: Share = 0.3
    background: Share = 0.03
    marker: NotNegative = 5e-3
    grain: NotNegative = 0.02
    grain_size: Annotated[float, Check(number, above=0.0, unit="m")] = 1.5e-4
    light: tuple[float, float, float] = (-0.45, -0.65, -0.6)
    ambient: Share = 0.45
    vignette: Share = 0.1


@dataclass(frozen=True, eq=False)
class Paper:
    """Triangles of a structure with what is printed on them.

    Attributes
    ----------
    triangles : ndarray, shape (m, 3)
    flat : ndarray, shape (m, 3, 2)
        Corners of each triangle in the plane of its panel (m); panels do not overlap.
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
    def of(cls, structure: Discretized, rng: np.random.Generator) -> Paper:
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
        return cls(triangles, flat, triangles < len(pattern.vertices), two_colors(pattern)[panels])


def two_colors(pattern: Pattern) -> NDArray[np.bool_]:
    """Color of each panel; neighbors differ wherever the pattern allows."""
    pairs, count = np.reshape(pattern.crease_faces, (-1, 2)), len(pattern.faces)
    beside = sparse.csr_array((np.ones(len(pairs)), pairs.T), (count, count))
    part = csgraph.connected_components(beside, directed=False)[1]
    starts = np.unique(part, return_index=True)[1]
    steps = csgraph.dijkstra(beside, directed=False, indices=starts, unweighted=True, min_only=True)
    return steps % 2 == 1


def grain_tile(look: Look, rng: np.random.Generator) -> NDArray[np.float32]:
    """Reflectance of the paper on a square of texels that tiles seamlessly."""
    frequency = np.hypot(np.fft.fftfreq(_TILE)[:, np.newaxis], np.fft.rfftfreq(_TILE))
    frequency[0, 0] = np.inf
    # fibers of all lengths, more long ones than short ones, as in real paper
    noise = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((_TILE, _TILE))) / frequency**0.7)
    tile = look.paper * (1.0 + look.grain * noise / noise.std())
    return np.clip(tile, 0.0, 1.0).astype(np.float32)


def shading(
    points: NDArray[np.float64],
    triangles: NDArray[np.int64],
    light: NDArray[np.float64],
    ambient: float,
) -> NDArray[np.float64]:
    """Light on each triangle, on either face: ambient, plus light by the angle to the lamp."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    cosine = np.abs(normal @ light) / np.where(length > 0.0, length, 1.0)
    return ambient + (1.0 - ambient) * cosine


@dataclass(frozen=True)
class Sensor(Checked):
    """Effects of lens and sensor.

    Attributes
    ----------
    exposure : float
        Time (s) during which a frame gathers light; 0 gives no blur of motion.
    softness : float
        Standard deviation of the blur of the lens (pixels).
    read_noise : float
        Standard deviation of the noise in the dark, in gray values of 0 to 255.
    shot_noise : float
        Standard deviation of the noise at full brightness; it grows with the square root of
        brightness.
    samples : int
        Number of rays per pixel, each with its own place and time.
    """

    exposure: NotNegative = 0.0
    softness: NotNegative = 0.6
    read_noise: NotNegative = 0.0
    shot_noise: NotNegative = 0.0
    samples: Annotated[int, Check(whole, least=4, what="rays in each pixel")] = 16

    @cached_property
    def places(self) -> NDArray[np.float64]:
        """Places in the pixel, from -1/2 to 1/2, shape (samples, 2)."""
        even = (np.arange(self.samples) + 0.5) / self.samples
        return np.stack([even, _halton(self.samples)[:, 0]], axis=1) - 0.5

    @cached_property
    def moments(self) -> NDArray[np.float64]:
        """Times of the rays, from -1/2 to 1/2 of the exposure, shape (samples,)."""
        return (np.argsort(np.argsort(_halton(self.samples)[:, 1])) + 0.5) / self.samples - 0.5


def _halton(count: int) -> NDArray[np.float64]:
    """Halton's sequence (count, 2), about 1/2."""
    from scipy.stats import qmc  # loads slowly

    value = qmc.Halton(2, scramble=False).random(count)
    return value + 0.5 - value.mean(axis=0)


@dataclass(frozen=True, eq=False)
class Studio:
    """Camera, light and paper, ready to take pictures."""

    camera: Camera
    look: Look
    sensor: Sensor
    paper: Paper
    grain: NDArray[np.float32]

    @classmethod
    def of(cls, structure, camera: Camera, look: Look, sensor: Sensor, seed: int) -> Studio:
        """Draw paper and grain at random; equal seeds give equal paper."""
        rng = np.random.default_rng([seed, 0])
        return cls(camera, look, sensor, Paper.of(structure, rng), grain_tile(look, rng))

    @cached_property
    def _falloff(self) -> NDArray[np.float32]:
        width, height = self.camera.size
        u, v = (np.arange(n, dtype=np.float32) - 0.5 * (n - 1) for n in (width, height))
        r2 = (u**2 + v[:, np.newaxis] ** 2) / (0.25 * (width**2 + height**2))
        return (1.0 - self.look.vignette * r2).astype(np.float32)

    def take(
        self, positions: NDArray[np.float64], rng: np.random.Generator
    ) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        """Picture of a structure at the times of the rays.

        Parameters
        ----------
        positions : ndarray, shape (samples, n, 3) or (n, 3)
            Positions of the nodes (m), one set for each ray or the same for all.
        rng : Generator
            Random generator of the noise.

        Returns
        -------
        picture : ndarray of uint8, shape (height, width)
        seen : ndarray of bool, shape (n,)
            Nodes that no panel hides in the middle of the exposure.
        """
        cv2 = opencv()
        positions = np.broadcast_to(positions, (self.sensor.samples, *positions.shape[-2:]))
        image = np.float32(self.look.background) * self._falloff
        seen = self._expose(image, positions)
        if self.sensor.softness > 0.0:
            image = cv2.GaussianBlur(image, (0, 0), self.sensor.softness)
        image *= np.float32(255.0)
        if self.sensor.read_noise or self.sensor.shot_noise:
            spread = self.sensor.read_noise**2 + self.sensor.shot_noise**2 / 255.0 * image
            image += np.sqrt(spread) * rng.standard_normal(image.shape, dtype=np.float32)
        return np.clip(np.rint(image), 0, 255).astype(np.uint8), seen

    def _expose(
        self, image: NDArray[np.float32], positions: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Accumulate the mean of all rays around the structure; return the visible nodes."""
        from foldyn.experiment.rendering.raster import draw

        camera, look, paper = self.camera, self.look, self.paper
        box, shape = self._box(positions)
        here = np.s_[box[1] : box[1] + shape[0], box[0] : box[0] + shape[1]]
        total = np.zeros(shape, np.float32)
        depth, bright = np.empty(shape, np.float32), np.empty(shape, np.float32)
        lamp = np.asarray(look.light) / np.linalg.norm(look.light) @ camera.rotation
        lens = np.concatenate([[camera.focal], camera.center, camera.inverse])
        ink = np.array([look.marker, look.ink, 1.0 / look.grain_size])
        middle = int(np.argmin(np.abs(self.sensor.moments)))
        seen = np.zeros(positions.shape[1], dtype=bool)
        background = np.full(shape, look.background, np.float32)
        for k, (points, place) in enumerate(zip(positions, self.sensor.places, strict=True)):
            near, pixels = 1.0 / camera.depth(points), camera.project(points)
            depth.fill(0.0)
            np.copyto(bright, background)
            draw(
                camera.straight(points), near, pixels, paper.triangles, paper.flat,
                paper.marked, paper.dark, shading(points, paper.triangles, lamp, look.ambient),
                self.grain, ink, lens, place, box, depth, bright,
            )  # fmt: skip
            total += bright
            if k == middle:
                seen = _unhidden(pixels - box, near, depth)
        image[here] = total / np.float32(len(positions)) * self._falloff[here]
        return seen

    def _box(self, positions: NDArray[np.float64]) -> tuple[NDArray[np.int64], tuple[int, int]]:
        """First pixel (u, v) and shape of the part of the image around the structure."""
        pixels = self.camera.project(positions).reshape(-1, 2)
        low = np.clip(np.floor(pixels.min(axis=0)) - _MARGIN, 0, np.array(self.camera.size) - 1)
        high = np.clip(np.ceil(pixels.max(axis=0)) + _MARGIN, low, np.array(self.camera.size) - 1)
        width, height = (high - low + 1).astype(int).tolist()
        return low.astype(np.int64), (height, width)


def _unhidden(
    pixels: NDArray[np.float64], near: NDArray[np.float64], depth: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """Nodes in the image that no panel hides by more than a hundredth of the distance."""
    height, width = depth.shape
    at = np.rint(pixels).astype(np.int64)
    seen = np.zeros(len(at), dtype=bool)
    for node in np.flatnonzero(((at >= 1) & (at < [width - 1, height - 1])).all(axis=1)):
        u, v = at[node]
        around = depth[v - 1 : v + 2, u - 1 : u + 2]
        # some of the nine pixels around a node show one of its own panels, not one in front
        seen[node] = around.min() <= near[node] * 1.01
    return seen
