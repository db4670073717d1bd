"""Synthetic data of the paper's specimen, whose raw data are not public.

The photographed and filmed sheet differs from the fitted model: it is softer, its mass is
distributed differently, and its creases relax, so that it drifts back after the release.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn import experiment
from foldyn.analyses import read_case
from foldyn.analyses.reading import read_document
from foldyn.studies import find_case
from foldyn.studies.herkal import calibration

SOFTER = {"sheet.youngs_modulus": 0.97 * 1.219e9}  # Pa: 3 % softer than the model
RATIO, TIME = 0.05, 0.5  # relaxing branch of the creases: relative stiffness, relaxation time (s)
RELAXING: Mapping[str, Any] = {
    "model.fold_law": {
        "kind": "prony",
        "ratios": [RATIO],
        "times": [TIME],
        "law": read_document(find_case("herkal/specimen-release"))["model"]["fold_law"],
    }
}
# changes to the model, which has circumcenter masses and elastic creases
OTHERWISE: Mapping[str, Any] = {**SOFTER, **RELAXING, "model.mass": "consistent"}
SUPPORT = "glued"
TRACKED = "film.mkv"


@dataclass(frozen=True)
class Shot:
    """Settings of the camera.

    Attributes
    ----------
    size : tuple of int
        Width and height (pixels); by default as in the paper.
    metres_per_pixel : float
        Scale in the plane through the front of the specimen.
    distance : float
        Distance of the camera from that plane (m).
    rate : float
        Frames per second.
    held, free : float
        Time filmed before and after the release (s).
    seed : int
    """

    size: tuple[int, int] = (2268, 4032)
    metres_per_pixel: float = 8e-5
    distance: float = 0.5
    rate: float = 240.0
    held: float = 0.05
    free: float = 0.8
    seed: int = 7

    def camera(self, rest: NDArray[np.float64]) -> experiment.Camera:
        """Camera in front of the specimen's middle, slightly rotated, with lens distortion."""
        middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0))
        middle[2] = rest[:, 2].max()
        return experiment.Camera.looking_at(
            middle, self.distance, metres_per_pixel=self.metres_per_pixel, size=self.size,
            k1=0.02, k2=-0.01, turned=(-1.5, 2.0, -0.8),
        )  # fmt: skip

    def sensor(self, exposure: float) -> experiment.Sensor:
        """Noisy sensor with an exposure time (s)."""
        return experiment.Sensor(exposure=exposure, read_noise=1.5, shot_noise=3.0, samples=10)


PAPERS, COARSE = Shot(), Shot(size=(1010, 1070), metres_per_pixel=1.2e-4, free=0.6)
EXPOSURE = 1 / 2000  # s, exposure of a frame


def photograph(folder: Path, shot: Shot) -> list[Path]:
    """Photographs of the softer sheet, without load and under the three weights.

    Returns
    -------
    list of Path
        The files load0.png to load3.png, in a folder that must exist.
    """
    path = calibration.pressed([0.0, *calibration.weighed(SOFTER)], SOFTER)
    photos, _ = experiment.photos_of(
        path, range(4), camera=shot.camera(path["rest_position"].values),
        sensor=shot.sensor(0.0), seed=shot.seed,
    )  # fmt: skip
    files = [folder / f"load{k}.png" for k in range(len(photos))]
    cv2 = experiment.opencv()
    for file, photo in zip(files, photos, strict=True):
        cv2.imwrite(str(file), photo)
    return files


def film(
    folder: Path, shot: Shot, changes: Mapping[str, Any] = OTHERWISE
) -> experiment.SyntheticFilm:
    """Film a sheet that is held and released; write its case file to the folder.

    changes : values of keys in which the filmed sheet differs from the model.
    """
    moved = released(folder, shot, changes)
    return experiment.film_of(
        moved, shot.camera(moved["rest_position"].values), rate=shot.rate,
        sensor=shot.sensor(EXPOSURE), seed=shot.seed,
    )  # fmt: skip


def released(folder: Path, shot: Shot, changes: Mapping[str, Any] = OTHERWISE) -> xarray.Dataset:
    """The true motion; the release is at `shot.held`."""
    case = calibration.released_case(folder, changes, support=SUPPORT, duration=shot.free)
    return held(read_case(case).run(), shot.held)


def held(motion: xarray.Dataset, duration: float) -> xarray.Dataset:
    """Motion preceded by some time (s) in which the sheet is held."""
    u, time = motion["displacement"].values, motion["time"].values
    step = time[1] - time[0]
    moved = np.concatenate([np.repeat(u[:1], round(duration / step), axis=0), u])
    times = np.arange(len(moved)) * step
    kept = motion.drop_dims("time").assign_coords(time=("time", times, motion["time"].attrs))
    return kept.assign(displacement=(("time", "node", "axis"), moved, motion["displacement"].attrs))
