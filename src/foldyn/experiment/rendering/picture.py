"""One picture of a moving structure: rays spread over each pixel and over the exposure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.experiment.camera import Camera
from foldyn.experiment.opencv import opencv
from foldyn.experiment.rendering.paper import Look, Paper, grain_tile, shading

_MARGIN = 6  # pixels around the structure that are drawn anew in each picture


@dataclass(frozen=True)
class Sensor:
    """What the lens and the sensor add.

    Attributes
    ----------
    exposure : float
        Time (s) during which a frame gathers light; 0 gives no blur of motion.
    softness : float
        Standard deviation of the lens's own blur (pixels).
    read_noise : float
        Standard deviation of the noise in the dark, in gray values of 0 to 255.
    shot_noise : float
        That of the noise at full brightness; it grows with the root of the brightness.
    samples : int
        Rays in each pixel, each at its own place and time.
    """

    exposure: float = 0.0
    softness: float = 0.6
    read_noise: float = 0.0
    shot_noise: float = 0.0
    samples: int = 16

    def __post_init__(self) -> None:
        for name in ("exposure", "softness", "read_noise", "shot_noise"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"{name}: {value!r}; give 0 or a positive number")
        if self.samples < 4:
            raise InputError(f"samples: {self.samples}; give at least 4 rays for each pixel")

    @cached_property
    def places(self) -> NDArray[np.float64]:
        """Places in the pixel, from -1/2 to 1/2, shape (samples, 2)."""
        k = np.arange(self.samples)
        return np.stack([(k + 0.5) / self.samples, _halton(k, 2)], axis=1) - 0.5

    @cached_property
    def moments(self) -> NDArray[np.float64]:
        """Times of the rays, from -1/2 to 1/2 of the exposure, shape (samples,)."""
        rank = np.argsort(np.argsort(_halton(np.arange(self.samples), 3)))
        return (rank + 0.5) / self.samples - 0.5


def _halton(k: NDArray[np.int64], base: int) -> NDArray[np.float64]:
    """Van der Corput's sequence: the digits of k behind the point, centered on average."""
    value, scale, rest = np.zeros(len(k)), 1.0, k.copy()
    while rest.any():
        scale /= base
        value += scale * (rest % base)
        rest //= base
    return value + 0.5 - value.mean()


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
        """Paper and grain by the seed, the same for the same one."""
        rng = np.random.default_rng([seed, 0])
        paper = Paper.of(structure, rng)
        return cls(camera, look, sensor, paper, grain_tile(look, rng))

    @cached_property
    def empty(self) -> NDArray[np.float32]:
        """Light that the background sends, from 0 to 1."""
        return np.float32(self.look.background) * self._falloff

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
            Of the noise.

        Returns
        -------
        picture : ndarray of uint8, shape (height, width)
        seen : ndarray of bool, shape (n,)
            Nodes that no panel hides, in the middle of the exposure.
        """
        cv2 = opencv()
        positions = np.broadcast_to(positions, (self.sensor.samples, *positions.shape[-2:]))
        box, size = self._box(positions)
        part, seen = self._rays(positions, box, size)
        whole = self.empty.copy()
        here = np.s_[box[1] : box[1] + size[1], box[0] : box[0] + size[0]]
        whole[here] = part
        if self.sensor.softness > 0.0:
            whole = cv2.GaussianBlur(whole, (0, 0), self.sensor.softness)
        whole *= np.float32(255.0)
        if self.sensor.read_noise or self.sensor.shot_noise:
            spread = self.sensor.read_noise**2 + self.sensor.shot_noise**2 / 255.0 * whole
            whole += np.sqrt(spread) * rng.standard_normal(whole.shape, dtype=np.float32)
        return np.clip(np.rint(whole), 0, 255).astype(np.uint8), seen

    def _rays(
        self, positions: NDArray[np.float64], box: NDArray[np.int64], size: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Mean of the rays in the part of the image that the structure may cover."""
        from foldyn.experiment.rendering.raster import draw

        camera, look, paper = self.camera, self.look, self.paper
        shape = (int(size[1]), int(size[0]))
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
        return total / np.float32(len(positions)) * self._falloff[here], seen

    def _box(self, positions: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """First pixel and size of the part of the image around the structure."""
        pixels = self.camera.project(positions).reshape(-1, 2)
        low = np.clip(np.floor(pixels.min(axis=0)) - _MARGIN, 0, np.array(self.camera.size) - 1)
        high = np.clip(np.ceil(pixels.max(axis=0)) + _MARGIN, low, np.array(self.camera.size) - 1)
        return low.astype(np.int64), (high - low + 1).astype(np.int64)


def _unhidden(
    pixels: NDArray[np.float64], near: NDArray[np.float64], depth: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """Nodes in the image that are not behind a panel by more than a hundredth of the distance."""
    height, width = depth.shape
    at = np.rint(pixels).astype(np.int64)
    inside = ((at >= 1) & (at < [width - 1, height - 1])).all(axis=1)
    seen = np.zeros(len(at), dtype=bool)
    for node in np.flatnonzero(inside):
        u, v = at[node]
        around = depth[v - 1 : v + 2, u - 1 : u + 2]
        # of the nine pixels around it some show what is next to the node, not before it
        seen[node] = around.min() <= near[node] * 1.01
    return seen
