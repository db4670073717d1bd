"""Track corners from frame to frame by pyramidal Lucas-Kanade flow and junctions of edges.

The flow, checked forward and backward, predicts a corner's position to a few pixels; the junction
of edges in the frame itself locates the corner exactly. So errors do not accumulate over a film,
and panels may rotate and change brightness. `by_neighbors` predicts lost points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Checked, Unit, brief
from foldyn.experiment.camera import opencv
from foldyn.experiment.tracking.corners import Positive, refine
from foldyn.values import whole

Array = NDArray[np.float64]


def distances(points: Array) -> Array:
    """Distances between all points (n, 2), infinite from each to itself, shape (n, n)."""
    apart = np.hypot(*(points[:, np.newaxis] - points).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    return apart


def nearest(points: Array, index: int, others: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Nearest points to a given one, at most `count`."""
    return others[np.argsort(np.hypot(*(points[others] - points[index]).T))[:count]]


def by_neighbors(
    reference: Array,
    place: Array,
    asked: Iterable[int],
    count: int,
    firmness: float,
    robust: bool = False,
) -> tuple[Array, Array]:
    """Predict points from the affine motion of their neighbors since a reference picture.

    Parameters
    ----------
    reference : ndarray, shape (n, n, 2)
        For each point, the positions of all points in its reference picture (pixels); NaN if
        unknown.
    place : ndarray, shape (n, 2)
        Current positions, NaN if unknown.
    asked : iterable of int
        Points to predict.
    count : int
        Number of neighbors used.
    firmness : float
        Regularization of the motion's gradient towards zero, because neighbors in a row do not
        determine the gradient.
    robust : bool
        Whether to start from the median, so that one wrong neighbor does not spoil the fit.

    Returns
    -------
    expected : ndarray, shape (n, 2)
        Predicted positions; NaN for points not in `asked`, and if fewer than four neighbors are
        known.
    distance : ndarray, shape (n,)
        Median distance of the neighbors in the reference picture.
    """
    expected, distance = np.full(place.shape, np.nan), np.full(len(place), np.nan)
    known = np.flatnonzero(np.isfinite(place[:, 0]))
    for p in asked:
        then = reference[p]
        others = known[(known != p) & np.isfinite(then[known, 0])]
        if len(others) < 4:
            continue
        some = nearest(then, p, others, count)
        offset = np.column_stack([np.ones(len(some)), then[some] - then[p]])
        motion = place[some] - then[some]
        middle = np.median(motion, axis=0) if robust else np.zeros(2)
        normal = offset.T @ offset
        normal[1:, 1:] += firmness * np.trace(normal[1:, 1:]) * np.eye(2)
        expected[p] = then[p] + middle + np.linalg.solve(normal, offset.T @ (motion - middle))[0]
        distance[p] = np.median(np.hypot(*(then[some] - then[p]).T))
    return expected, distance


LOST, FOUND_AGAIN, TRACKED = 0, 1, 2

_MARGIN = 220  # margin (pixels) of the part of the picture around all points
_NEIGHBORS, _FIRMNESS = 8, 0.05  # number of neighbors and firmness in `by_neighbors`
_STRAY = 0.4  # largest distance from a guide's prediction, relative to the reach
_SURE = 0.3  # a guide is trusted if neighbors deviate less from its prediction, relative to reach
_CLEAR = 0.55  # corners of few edges are found again up to this share of the allowed error
_MOST_MISSES = 3  # after this many frames, only a guide finds a lost corner of two edges again

# Maps the positions of points (p, 2), NaN if lost, to their predicted positions.
#
# A prediction is NaN if unknown, infinite if the point is hidden.
Guide = Callable[[Array], Array]


@dataclass(frozen=True)
class FollowSettings(Checked):
    """Settings for tracking corners.

    Attributes
    ----------
    window : int
        Side of the compared window (pixels).
    levels : int
        Levels of the pyramid; each doubles the largest detectable motion.
    back : float
        Largest forward-backward error of the flow (pixels).
    error : float
        Largest standard error of a junction (pixels).
    stray : float
        Largest deviation of a point from the motion of its neighbors, relative to the distance to
        the neighbors.
    """

    window: Annotated[int, Check(whole, least=5, what="pixels")] = 31
    levels: Annotated[int, Check(whole, least=0)] = 4
    back: Positive = 2.0
    error: Positive = 0.35
    stray: Positive = 0.3


@brief
@dataclass(frozen=True)
class Step:
    """Corners in one frame.

    Attributes
    ----------
    time : float
        Time of the frame (s).
    position : ndarray, shape (p, 2)
        Pixels of the region of interest; NaN where a corner is lost or not measured.
    error : ndarray, shape (p,)
        Standard error (pixels).
    status : ndarray of int8, shape (p,)
        0 lost, 1 found again, 2 tracked from the previous frame.
    repeated : bool
        The frame repeats the previous one, so nothing is measured in it.
    """

    time: Annotated[float, Unit("s")]
    position: Array
    error: Array
    status: NDArray[np.int8]
    repeated: bool


def follow(
    frames: Iterable[tuple[float, NDArray[np.uint8]]],
    points: Array,
    *,
    reach: float,
    settings: FollowSettings | None = None,
    unseen: NDArray[np.bool_] | None = None,
    guide: Guide | None = None,
) -> Iterator[Step]:
    """Track corners through the frames of a film.

    Parameters
    ----------
    frames : iterable of (float, ndarray of uint8)
        Times (s) and gray pictures, beginning with the frame in which the points were found.
    points : ndarray, shape (p, 2)
        Corners in the first frame (pixels).
    reach : float
        Length of the edges that make a corner (pixels).
    settings : FollowSettings
    unseen : ndarray of bool, shape (p,), optional
        Points not yet visible; they are searched for like lost points.
    guide : callable, optional
        Predicts points from the positions of all points; None uses the motion of neighbors.

    Yields
    ------
    Step
        One for each frame.

    Notes
    -----
    Bouguet, Pyramidal implementation of the Lucas Kanade feature tracker, Intel, 2001; Kalal,
    Mikolajczyk and Matas, Forward-backward error, ICPR 2010.
    """
    settings = settings or FollowSettings()
    last: NDArray[np.uint8] | None = None
    count = len(points)
    state = _State.begun(points, np.zeros(count, bool))
    for time, frame in frames:
        if last is not None and _repeats(frame, last):
            unknown = np.full((count, 2), np.nan)
            yield Step(time, unknown, unknown[:, 0], np.zeros(count, np.int8), True)
            continue
        if last is None:
            first = refine(frame, points, reach=reach, moved=0.5 * reach)
            kept = np.isfinite(first.position[:, 0])
            kept &= True if unseen is None else ~unseen
            state = _State.begun(np.where(kept[:, np.newaxis], first.position, points), kept)
            error = np.where(kept, first.error, np.nan)
            status = (TRACKED * kept).astype(np.int8)
        else:
            state, error, status = _advance(last, frame, state, reach, settings, guide)
        # a junction not seen in this frame is not measured
        yield Step(time, _only(state.misses == 0, state.here), error, status, False)
        last = frame


@dataclass(frozen=True)
class _State:
    """Current and predicted positions of the corners.

    Attributes
    ----------
    here : ndarray, shape (p, 2)
        Last known position; for a lost corner the position predicted by its neighbors.
    step : ndarray, shape (p, 2)
        Motion since the previous frame.
    misses : ndarray of int, shape (p,)
        Frames since the corner was last measured.
    anchor : ndarray, shape (p, p, 2)
        For each corner, the positions of all corners when it was last seen; NaN where unknown. The
        motion of neighbors is measured from these positions, so that errors do not accumulate while
        a corner is lost.
    """

    here: Array
    step: Array
    misses: NDArray[np.int64]
    anchor: Array

    @classmethod
    def begun(cls, here: Array, kept: NDArray[np.bool_]) -> _State:
        count = len(here)
        anchor = np.repeat(_only(kept, here)[np.newaxis], count, axis=0)
        anchor[np.arange(count), np.arange(count)] = here
        return cls(here, np.zeros((count, 2)), np.where(kept, 0, _MOST_MISSES + 1), anchor)

    def moved(self, here: Array, kept: NDArray[np.bool_]) -> _State:
        step = np.where(kept[:, np.newaxis], here - self.here, self.step)
        anchor = self.anchor.copy()
        anchor[kept] = _only(kept, here)
        return _State(here, step, np.where(kept, 0, self.misses + 1), anchor)


def _advance(
    last: NDArray[np.uint8],
    frame: NDArray[np.uint8],
    state: _State,
    reach: float,
    settings: FollowSettings,
    guide: Guide | None,
) -> tuple[_State, Array, NDArray[np.int8]]:
    led = state.misses == 0
    flown, there = _flow(last, frame, state.here, state.here + state.step, led, reach, settings)
    # corners at a junction near the flow's prediction
    junction = refine(frame, _only(there, flown), reach=reach, moved=0.5 * reach)
    good = there & np.isfinite(junction.position[:, 0]) & (junction.error < settings.error)
    place = np.where(good[:, np.newaxis], junction.position, flown)
    expected, distance = _by_neighbors(state, place, good)
    near = np.hypot(*(place - expected).T) < np.maximum(settings.stray * distance, 3.0)
    good &= near | ~np.isfinite(expected[:, 0])
    if guide is not None:
        stray, usual = _strays(place, guide(_only(good, place)))
        good &= ~(stray > _STRAY * reach + 4.0 * usual)
    good &= ~_crowded(place, good, junction.error, 0.4 * reach)

    # other corners: at their prediction, if edges meet at that point
    expected, _ = _by_neighbors(state, place, good)
    barred = np.zeros(len(place), bool)
    if guide is not None:
        guided = guide(_only(good, place))
        _, usual = _strays(_only(good, place), guided)
        # where the guide fails, neighbors do no better
        barred = ~(np.isfinite(guided[:, 0]) & (usual < _SURE * reach))
        expected = np.where(barred[:, np.newaxis], expected, guided)
    guess = np.where(np.isfinite(expected), expected, state.here)
    again = refine(frame, _only(~(good | barred), guess), reach=reach, moved=0.35 * reach)
    # with few edges, the end of a stain on an edge may be mistaken for the corner
    allowed = settings.error * np.where(again.edges >= 4, 1.0, _CLEAR)
    found = ~good & np.isfinite(again.position[:, 0]) & (again.error < allowed)
    if guide is None:  # a corner that was lost for some frames must be identified with certainty
        found &= (again.edges >= 3) | (state.misses < _MOST_MISSES)
    place = np.where(good[:, np.newaxis], place, guess)
    place = np.where(found[:, np.newaxis], again.position, place)
    found &= ~_taken(place, good, found, 0.6 * reach)
    place = np.where((good | found)[:, np.newaxis], place, guess)
    error = np.select([good, found], [junction.error, again.error], np.nan)
    status = np.select([good, found], [TRACKED, FOUND_AGAIN], LOST).astype(np.int8)
    return state.moved(place, good | found), error, status


def _flow(last, frame, start, guess, led, reach, settings: FollowSettings):
    """Positions predicted by the flow, and whether the backward flow returns to the start."""
    cv2 = opencv()
    flown, there = guess.copy(), np.zeros(len(start), bool)
    some = np.flatnonzero(led & _within(start, frame.shape, 2.0))
    if not len(some):
        return flown, there
    both = np.concatenate([start[some], guess[some]])
    low = np.maximum(np.floor(both.min(axis=0)) - _MARGIN, 0).astype(int)
    high = np.minimum(np.ceil(both.max(axis=0)) + _MARGIN, frame.shape[::-1]).astype(int)
    here = np.s_[low[1] : high[1], low[0] : high[0]]
    before, after = np.ascontiguousarray(last[here]), np.ascontiguousarray(frame[here])
    options = {
        "winSize": (settings.window, settings.window),
        "maxLevel": settings.levels,
        "criteria": (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.01),
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
    }
    old = (start[some] - low).astype(np.float32)[:, np.newaxis]
    new = (guess[some] - low).astype(np.float32)[:, np.newaxis]
    new, found, _ = cv2.calcOpticalFlowPyrLK(before, after, old, new.copy(), **options)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, new, old.copy(), **options)
    missed = np.hypot(*(back - old).reshape(-1, 2).T)
    flown[some] = new.reshape(-1, 2) + low
    there[some] = (found.ravel() > 0) & (returned.ravel() > 0) & (missed < settings.back)
    return flown, there & _within(flown, frame.shape, reach)


def _within(points, shape, margin):
    height, width = shape
    return ((points >= margin) & (points <= np.array([width, height]) - 1.0 - margin)).all(axis=1)


def _by_neighbors(state: _State, place: Array, good: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Positions predicted by neighbors' motion since corners were seen; neighbors' distance."""
    asked = range(len(place)) if good.sum() > 4 else ()
    return by_neighbors(state.anchor, _only(good, place), asked, _NEIGHBORS, _FIRMNESS)


def _strays(place: Array, guided: Array) -> tuple[Array, Array]:
    """Distance of points from a guide's prediction, and the distance of their neighbors from it."""
    stray = np.hypot(*(place - guided).T)
    known = np.flatnonzero(np.isfinite(stray))
    usual = np.full(len(place), np.inf)
    for p in np.flatnonzero(np.isfinite(guided[:, 0])).tolist():
        others = known[known != p]
        if len(others):
            usual[p] = np.median(stray[nearest(guided, p, others, _NEIGHBORS)])
    return stray, usual


def _crowded(place: Array, good: NDArray, error: Array, apart: float) -> NDArray[np.bool_]:
    """Points that coincide with another point, except for the best measured of such points."""
    out, known = np.zeros(len(place), bool), np.flatnonzero(good)
    better = error[known] <= error[known][:, np.newaxis]
    out[known] = ((distances(place[known]) < apart) & better).any(axis=1)
    return out


def _taken(place: Array, good: NDArray, found: NDArray, apart: float) -> NDArray[np.bool_]:
    """Points that were found again at the position of another corner."""
    out, held = np.zeros(len(place), bool), np.flatnonzero(good | found)
    out[held] = (distances(place[held]) < apart).any(axis=1)
    return out & found


def _only(these: NDArray[np.bool_], places: Array) -> Array:
    """Positions of some points, and NaN for all others."""
    return np.where(these[:, np.newaxis], places, np.nan)


def _repeats(frame: NDArray[np.uint8], last: NDArray[np.uint8]) -> bool:
    """Whether a frame is the same picture as the last one."""
    some = np.s_[::16, ::16]  # mostly enough to see that they differ
    return bool((frame[some] == last[some]).all() and (frame == last).all())
