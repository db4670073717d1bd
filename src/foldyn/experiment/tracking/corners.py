"""Corner detection to subpixel accuracy: Harris's measure, then intersection of straight edges.

Corners of folded paper are where creases and boundaries cross. Each of these edges is located by
gray-value profiles across it, some pixels away from the corner, and the lines through the located
edges are intersected. The usual refinement by gradients alone (Foerstner and Guelch,
Intercommission Conference on Fast Processing of Photogrammetric Data, 1987; OpenCV's cornerSubPix)
shifts corners of acute panels inward by up to a pixel, because a blurred tip ends before the true
tip. The shift grows as the panel's angle gets smaller, so a change of shape would appear as a
motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check, Checked, brief
from foldyn.errors import InputError
from foldyn.experiment.camera import opencv
from foldyn.jit.compiled import strict
from foldyn.values import number, whole

Positive = Annotated[float, Check(number, above=0.0)]

_CANDIDATES = 5  # candidates of Harris's measure per requested corner
_DIRECTIONS = 120  # samples on a circle around a point, to look for edges
_APART = 4  # smallest number of directions between two edges of a corner (12 degrees)
_EDGES = 6  # largest number of edges of a corner
_FAINTEST = 4.0  # smallest contrast (gray values) between the sides of an edge
_RELATIVE = 0.12  # smallest contrast, relative to the corner's strongest edge
_PROFILES = 12  # smallest number of profiles across an edge
_STEP = 0.5  # pixels between samples across an edge
_ROUNDS = 3
_NARROWEST = 1.6  # smallest room on each side of an edge, in pixels
_STRAIGHT = 0.35  # pixels, rms: largest deviation of an edge from a line
_FLATTEST = 0.02  # smallest ratio of eigenvalues; lower ratios mean nearly parallel edges


@dataclass(frozen=True)
class CornerSettings(Checked):
    """Settings for finding and refining corners.

    Attributes
    ----------
    spacing : float or None
        Smallest distance between two corners (pixels); None means 1.5 times `reach`.
    quality : float
        Harris's measure of the weakest corner, relative to that of the strongest corner.
    most : int
        Largest number of corners; the strongest are kept.
    reach : float or None
        Length of the edges from which a corner is refined (pixels): about a quarter of the distance
        between corners. None means 0.012 of the picture's diagonal, from 7 to 24 pixels.
    """

    spacing: Positive | None = None
    quality: Positive = 0.005
    most: Annotated[int, Check(whole, least=1)] = 400
    reach: Positive | None = None

    def reach_in(self, shape: tuple[int, ...]) -> float:
        """Length of the edges in a picture of this shape (pixels)."""
        return self.reach or float(np.clip(0.012 * np.hypot(shape[0], shape[1]), 7.0, 24.0))


def find_corners(
    image: NDArray[np.uint8], settings: CornerSettings | None = None, *, place: str = "the picture"
) -> NDArray[np.float64]:
    """Find the corners of a picture.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width)
    settings : CornerSettings
    place : str
        Name of the picture in messages.

    Returns
    -------
    ndarray, shape (p, 2)
        Pixels (u, v), the strongest corner first. Corners where edges meet are refined; others
        (ends of stains, texture) are left out.

    Raises
    ------
    InputError
        The picture has no corners.

    Notes
    -----
    Harris and Stephens, A combined corner and edge detector, Alvey Vision Conference, 1988.
    """
    cv2 = opencv()
    settings = settings or CornerSettings()
    reach = settings.reach_in(image.shape)
    spacing = settings.spacing or 1.5 * reach
    smooth = cv2.GaussianBlur(image, (0, 0), max(0.8, 0.06 * reach))
    candidates = cv2.goodFeaturesToTrack(
        smooth, _CANDIDATES * settings.most, settings.quality, 0.2 * reach,
        blockSize=int(np.clip(round(0.3 * reach), 3, 9)) | 1, useHarrisDetector=True, k=0.05,
    )  # fmt: skip
    if candidates is None or not len(candidates):
        raise InputError(f"{place}: no corners found; take a sharp, well lit one, or another --roi")
    junctions = refine(image, candidates.reshape(-1, 2), reach=reach, moved=0.6 * reach)
    # a point with more edges is more likely a corner of the pattern than the end of a stain
    order = np.lexsort([junctions.error, -np.minimum(junctions.edges, 4)])
    order = order[np.isfinite(junctions.position[order, 0])]
    points = junctions.position[order]
    points = points[_first_of_each(points, spacing)][: settings.most]
    if not len(points):
        raise InputError(
            f"{place}: {len(candidates)} corners, but straight edges meet at none of them; take a "
            "sharp, well lit one, or another --roi"
        )
    return points


def _first_of_each(points: NDArray[np.float64], apart: float) -> NDArray[np.bool_]:
    """Points that have no earlier point within a distance."""
    kept = np.zeros(len(points), dtype=bool)
    for k, point in enumerate(points):
        kept[k] = not (np.hypot(*(points[kept] - point).T) < apart).any()
    return kept


@brief
@dataclass(frozen=True)
class Junctions:
    """Refined corners.

    Attributes
    ----------
    position : ndarray, shape (p, 2)
        Pixels (u, v); NaN where no two edges meet.
    error : ndarray, shape (p,)
        Standard error of the position (pixels), from how straight the edges are and how well
        they meet.
    edges : ndarray of int, shape (p,)
        Number of edges that met.
    """

    position: NDArray[np.float64]
    error: NDArray[np.float64]
    edges: NDArray[np.int64]


def refine(image: NDArray[np.uint8], points: ArrayLike, *, reach: float, moved: float) -> Junctions:
    """Find the corner next to each point.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width)
    points : array_like, shape (p, 2)
        Pixels (u, v), within about a quarter of `reach` of their corners; NaN stays NaN.
    reach : float
        Length of edges used for the refinement (pixels): no other corner may lie closer.
    moved : float
        Largest accepted distance of a corner from its point (pixels).

    Returns
    -------
    Junctions
    """
    start = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
    found = np.full((len(start), 4), np.nan)
    _refine_all(np.ascontiguousarray(image), start, float(reach), float(moved), found)
    edges = np.where(np.isfinite(found[:, 3]), found[:, 3], 0.0).astype(np.int64)
    return Junctions(found[:, :2].copy(), found[:, 2].copy(), edges)


@strict
def _refine_all(image: Any, start: Any, reach: float, moved: float, found: Any) -> None:
    inner = max(2.5, 0.28 * reach)
    for p in range(len(start)):
        u, v = start[p]
        if not _inside(image, u, v, reach):
            continue
        error, count = np.nan, 0
        for turn in range(_ROUNDS):
            width = max(2.0, (0.32 if turn == 0 else 0.2) * reach)
            du, dv, error, count = _meet(image, u, v, inner, reach, width)
            u, v = u + du, v + dv
            strayed = np.hypot(u - start[p, 0], v - start[p, 1]) > moved
            if count < 2 or strayed or not _inside(image, u, v, reach):
                count = 0
                break
        if count >= 2:
            found[p, 0], found[p, 1], found[p, 2], found[p, 3] = u, v, error, count


@strict
def _inside(image: Any, u: float, v: float, margin: float) -> bool:
    height, width = image.shape
    inside = margin <= u <= width - 1 - margin and margin <= v <= height - 1 - margin
    return inside  # a comparison with NaN is False


@strict
def _gray(image: Any, u: float, v: float) -> float:
    """Gray value interpolated between four pixels; extended beyond the border."""
    height, width = image.shape
    u, v = min(max(u, 0.0), width - 1.001), min(max(v, 0.0), height - 1.001)
    i, j = int(u), int(v)
    fu, fv = u - i, v - j
    top = image[j, i] * (1.0 - fu) + image[j, i + 1] * fu
    bottom = image[j + 1, i] * (1.0 - fu) + image[j + 1, i + 1] * fu
    return top * (1.0 - fv) + bottom * fv


@strict
def _directions(image: Any, u: float, v: float, inner: float, reach: float, found: Any) -> int:
    """Find directions of the edges around a point (rad) and their signs; return the count."""
    n = _DIRECTIONS
    count = max(6, int(0.6 * (reach - inner)))
    around = np.zeros(n)
    for k in range(n):
        c, s = np.cos(2.0 * np.pi * k / n), np.sin(2.0 * np.pi * k / n)
        for m in range(count):  # grain and noise average out along an edge
            r = inner + (reach - inner) * m / (count - 1)
            around[k] += _gray(image, u + r * c, v + r * s) / count
    change = np.empty(n)
    for k in range(n):
        change[k] = around[(k + 2) % n] - around[(k - 2) % n]
    size = np.abs(change)
    least = max(_FAINTEST, _RELATIVE * size.max())
    edges = 0
    while edges < len(found):
        k = int(np.argmax(size))
        if size[k] <= least:
            break
        found[edges, 0], found[edges, 1] = 2.0 * np.pi * k / n, np.sign(change[k])
        edges += 1
        for m in range(-_APART + 1, _APART):
            size[(k + m) % n] = 0.0
        # further decrease belongs to the same edge
        for side in (-1, 1):
            m = side * _APART
            while abs(m) < n // 2 and 0.0 < size[(k + m) % n] < abs(change[(k + m - side) % n]):
                size[(k + m) % n] = 0.0
                m += side
    return edges


@strict
def _meet(
    image: Any, u: float, v: float, inner: float, reach: float, width: float
) -> tuple[float, float, float, int]:
    """Shift to the intersection of edges around a point, standard error, and number of edges."""
    found = np.empty((_EDGES, 2))
    edges = _directions(image, u, v, inner, reach, found)
    lines = np.zeros((_EDGES, 4))  # normal, offset, standard error of the offset
    count = 0
    for e in range(edges):
        room = 1.0
        for f in range(edges):
            if f != e:
                apart = abs((found[e, 0] - found[f, 0] + np.pi) % (2.0 * np.pi) - np.pi)
                room = min(room, 0.5 * apart)
        c, s = np.cos(found[e, 0]), np.sin(found[e, 0])
        offset, slope, error = _line(image, u, v, c, s, found[e, 1], room, inner, reach, width)
        if np.isfinite(error):
            length = np.hypot(1.0, slope)
            lines[count, 0], lines[count, 1] = (-s - slope * c) / length, (c - slope * s) / length
            lines[count, 2], lines[count, 3] = offset / length, error
            count += 1
    return _intersection(lines[:count])


@strict
def _intersection(lines: Any) -> tuple[float, float, float, int]:
    """Point nearest to the lines; a line that misses the others is dropped."""
    weight = 1.0 / np.maximum(lines[:, 3], 0.02) ** 2
    x, y, error, count = np.nan, np.nan, np.nan, 0
    for attempt in range(len(lines)):
        a = np.sum(weight * lines[:, 0] ** 2)
        b = np.sum(weight * lines[:, 0] * lines[:, 1])
        d = np.sum(weight * lines[:, 1] ** 2)
        half, turn = 0.5 * (a + d), np.hypot(0.5 * (a - d), b)
        count = int(np.sum(weight > 0.0))
        # two lines always meet, so they prove nothing if other lines missed
        if count < (2 if attempt == 0 else 3) or not half - turn > _FLATTEST * (half + turn):
            return np.nan, np.nan, np.nan, 0
        p = np.sum(weight * lines[:, 0] * lines[:, 2])
        q = np.sum(weight * lines[:, 1] * lines[:, 2])
        det = a * d - b * b
        x, y = (d * p - b * q) / det, (a * q - b * p) / det
        left = lines[:, 0] * x + lines[:, 1] * y - lines[:, 2]
        misfit = np.sum(weight * left**2) / max(count - 2, 1)
        error = np.sqrt(max(misfit, 1.0) * (1.0 / (half - turn) + 1.0 / (half + turn)))
        worst = int(np.argmax(np.sqrt(weight) * np.abs(left)))
        if count < 3 or np.abs(left[worst]) < max(4.0 * max(lines[worst, 3], 0.02), 0.15):
            break
        weight[worst] = 0.0
    return x, y, error, count


@strict
def _line(
    image: Any,
    u: float,
    v: float,
    c: float,
    s: float,
    sign: float,
    room: float,
    inner: float,
    reach: float,
    width: float,
) -> tuple[float, float, float]:
    """Offset (at the point) and slope of the line through an edge, and error of the offset.

    Offset and slope are relative to the ray (c, s) along which the edge was sought; NaN if no line
    is found.
    """
    step = min(1.0, (reach - inner) / _PROFILES)
    most = int((reach - inner) / step) + 1
    radius, place, used = np.empty(most), np.empty(most), 0
    for m in range(most):
        r = inner + m * step
        # near another edge a profile crosses both edges: use it only up to half way between them
        side = min(width, room * r)
        if side < _NARROWEST:
            continue
        at = _edge_place(image, u + r * c, v + r * s, -s, c, sign, side)
        if np.isfinite(at):
            radius[used], place[used] = r, at
            used += 1
    if used < 5:
        return np.nan, np.nan, np.nan
    r, y = radius[:used], place[:used]
    weight = np.ones(used)
    offset, slope, error, rms = np.nan, np.nan, np.nan, np.nan
    for _ in range(3):
        total = weight.sum()
        mr, my = np.sum(weight * r) / total, np.sum(weight * y) / total
        spread = np.sum(weight * (r - mr) ** 2)
        if total < 5.0 or spread <= 0.0:
            return np.nan, np.nan, np.nan
        slope = np.sum(weight * (r - mr) * (y - my)) / spread
        offset = my - slope * mr
        left = y - offset - slope * r
        rms = np.sqrt(np.sum(weight * left**2) / (total - 2.0))
        error = max(rms, 0.03) * np.sqrt(1.0 / total + mr**2 / spread)
        weight = np.where(np.abs(left) > max(2.0 * rms, 0.1), 0.0, 1.0)
    if not rms < _STRAIGHT or abs(slope) > 0.5:
        return np.nan, np.nan, np.nan
    return offset, slope, error


@strict
def _edge_place(
    image: Any, u: float, v: float, nu: float, nv: float, sign: float, side: float
) -> float:
    """Position of an edge along the normal (nu, nv), within `side` pixels; NaN if none is found."""
    n = int(side / _STEP)
    rise = np.zeros(2 * n + 1)
    before = _gray(image, u - (n + 1) * _STEP * nu, v - (n + 1) * _STEP * nv)
    here = _gray(image, u - n * _STEP * nu, v - n * _STEP * nv)
    for k in range(-n, n + 1):
        t = (k + 1) * _STEP
        after = _gray(image, u + t * nu, v + t * nv)
        rise[k + n] = max(sign * (after - before), 0.0)
        before, here = here, after
    if 0.5 * rise.sum() < _FAINTEST:
        return np.nan
    # first in the whole profile, then around the found edge, so that the window is symmetric
    middle, reach = 0.0, 1e9
    for _ in range(3):
        top, total = 0.0, 0.0
        for k in range(-n, n + 1):
            t = k * _STEP
            if abs(t - middle) <= reach:
                top += t * rise[k + n] ** 2
                total += rise[k + n] ** 2
        if total <= 0.0:
            return np.nan
        middle, reach = top / total, 0.7 * side
    return middle
