"""Corners in a picture: Harris's measure, then the junction of edges next to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.experiment.opencv import opencv
from foldyn.experiment.tracking.junctions import refine

_CANDIDATES = 5  # of Harris's measure for each corner that is asked for


@dataclass(frozen=True)
class CornerSettings:
    """How corners are found and refined.

    Attributes
    ----------
    spacing : float or None
        Least distance of two corners (pixels); None: 1.5 `reach`.
    quality : float
        Harris's measure of the weakest corner, relative to the strongest one.
    most : int
        Most corners, the strongest first.
    reach : float or None
        Length of the edges from which a corner is refined (pixels): about a quarter of the distance
        between corners. None: 0.012 of the picture's diagonal, from 7 to 24 pixels.
    """

    spacing: float | None = None
    quality: float = 0.005
    most: int = 400
    reach: float | None = None

    def __post_init__(self) -> None:
        for name in ("spacing", "quality", "most", "reach"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"{name}: {value!r}; give a positive number")

    def reach_in(self, shape: tuple[int, ...]) -> float:
        """Length of the edges in a picture of this shape."""
        return self.reach or float(np.clip(0.012 * np.hypot(shape[0], shape[1]), 7.0, 24.0))

    def spacing_in(self, shape: tuple[int, ...]) -> float:
        """Least distance of two corners in a picture of this shape."""
        return self.spacing or 1.5 * self.reach_in(shape)


def find_corners(
    image: NDArray[np.uint8], settings: CornerSettings | None = None, place: str = "the picture"
) -> NDArray[np.float64]:
    """Find the corners of a picture.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width)
    settings : CornerSettings
    place : str
        What the picture is called in messages.

    Returns
    -------
    ndarray, shape (p, 2)
        Pixels (u, v), the strongest corner first; those at which edges meet are refined, others
        (ends of stains, texture) are left out.

    Raises
    ------
    InputError
        There are none.

    Notes
    -----
    Harris and Stephens, A combined corner and edge detector, Alvey Vision Conference, 1988.
    """
    cv2 = opencv()
    how = settings or CornerSettings()
    spacing, reach = how.spacing_in(image.shape), how.reach_in(image.shape)
    block = int(np.clip(round(0.3 * reach), 3, 9)) | 1
    smooth = cv2.GaussianBlur(image, (0, 0), max(0.8, 0.06 * reach))
    found = cv2.goodFeaturesToTrack(
        smooth, _CANDIDATES * how.most, how.quality, 0.2 * reach,
        blockSize=block, useHarrisDetector=True, k=0.05,
    )  # fmt: skip
    if found is None or not len(found):
        raise InputError(
            f"{place}: no corners are found in it; take a sharp, well lit one, or another --roi"
        )
    junctions = refine(image, found.reshape(-1, 2), reach, 0.6 * reach)
    # where more edges meet it is more likely a corner of the pattern than the end of a stain
    order = np.lexsort([junctions.error, -np.minimum(junctions.edges, 4)])
    order = order[np.isfinite(junctions.position[order, 0])]
    points = junctions.position[order]
    points = points[_first_of_each(points, spacing)][: how.most]
    if not len(points):
        raise InputError(
            f"{place}: {len(found)} corners, but straight edges meet at none of them; take a "
            "sharp, well lit one, or another --roi"
        )
    return points


def _first_of_each(points: NDArray[np.float64], apart: float) -> NDArray[np.bool_]:
    """Points with no earlier one within a distance."""
    kept = np.zeros(len(points), dtype=bool)
    for k, point in enumerate(points):
        distance = np.hypot(*(points[kept] - point).T)
        kept[k] = not (distance < apart).any()
    return kept
