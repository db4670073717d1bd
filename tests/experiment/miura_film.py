"""A small Miura sheet whose folds move rigidly: its motion is known in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import foldyn as fd

cv2 = pytest.importorskip("cv2")

RATE, FREQUENCY, DECAY = 240.0, 12.0, 4.0  # frames/s, Hz, 1/s
REST, AMPLITUDE = 75.0, 12.0  # dihedral at rest and the swing, degrees
DISTANCE, SCALE = 0.4, 1.6e-4  # m, m per pixel
SIZE = (580, 620)
CELLS = (2, 2)
FRONT = [i * 5 + j for i in range(5) for j in (1, 3)]
"""Nodes of the ridges, in the plane next to the camera."""


def folded(dihedral: float) -> Any:
    pattern = fd.patterns.miura(cells=CELLS, a=0.025, b=0.025, panel_angle=60, dihedral=dihedral)
    return fd.discretize(pattern, fd.Sheet(1.2e9, 0.2, 2.4e-4, 667.0), preset="plate")


def dihedral_at(time: np.ndarray) -> np.ndarray:
    """A free vibration of one degree of freedom."""
    return REST - AMPLITUDE * np.exp(-DECAY * time) * np.cos(2 * np.pi * FREQUENCY * time)


def moving_states(dihedrals: Any) -> np.ndarray:
    """Nodes (k, n, 3) with the middle of the bottom row held."""
    states = np.array([folded(d).nodes for d in np.atleast_1d(dihedrals)])
    return states - states[:, 22:23]


@dataclass(frozen=True)
class Scene:
    """A film in a file, and what is true of it."""

    path: Path
    film: Any
    truth: Any
    model: Any


def camera(rest: Any = None, **options: Any) -> Any:
    """A camera in front of the middle of nodes, those of the sheet at rest."""
    from foldyn.experiment import Camera

    rest = moving_states(REST)[0] if rest is None else rest
    middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0))
    middle[2] = rest[:, 2].max()
    return Camera.looking_at(
        middle,
        DISTANCE,
        metres_per_pixel=SCALE,
        size=SIZE,
        turned=(1.5, -1.0, 0.8),
        **({"k1": 0.02} | options),
    )


def make_film(count: int, seed: int = 0, dropped: tuple = (), **sensor: Any) -> Any:
    from scipy.interpolate import CubicSpline

    from foldyn.experiment import Look, Sensor, SyntheticFilm
    from foldyn.experiment.rendering.picture import Studio

    grid = np.linspace(REST - 1.2 * AMPLITUDE, REST + 1.2 * AMPLITUDE, 25)
    spline = CubicSpline(grid, moving_states(grid))
    studio = Studio.of(folded(REST), camera(), Look(), Sensor(**({"samples": 8} | sensor)), seed)
    time = np.arange(count) / RATE
    return SyntheticFilm(studio, time, lambda t: spline(dihedral_at(t)), RATE, dropped, seed)


def model() -> Any:
    from dataclasses import replace

    from foldyn.experiment import TrackedModel

    at_rest = TrackedModel.of(folded(REST))
    states = moving_states(np.linspace(REST - 15.0, REST + 15.0, 13))
    return replace(at_rest, rest=moving_states(REST)[0], states=states)


def errors(tracks: Any, truth: Any) -> np.ndarray:
    """Distance (frame, node) in pixels from the truth, NaN where not tracked."""
    true = truth["position_px"].values
    out = np.full((len(true), 25), np.nan)
    for point, node in enumerate(tracks["node_of_point"].values):
        if node >= 0:
            out[:, node] = np.hypot(*(tracks["position_px"].values[:, point] - true[:, node]).T)
    return out
