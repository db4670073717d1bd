"""Corners from frame to frame: pyramidal Lucas-Kanade, there and back, then the junction.

The flow tells where a corner has gone, to a few pixels; where it is, the junction of edges in the
frame itself tells. So errors do not add up over a film, and panels may turn and change their
brightness.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.experiment.opencv import opencv
from foldyn.experiment.tracking.junctions import refine

LOST, FOUND_AGAIN, TRACKED = 0, 1, 2

_MARGIN = 220  # pixels around all points that are searched
_NEIGHBORS = 8  # whose motion tells where a point should be
_STRAY = 0.4  # of the reach, by which a point may miss the place that a guide tells
_SURE = 0.3  # the same of its neighbors, for a guide to be believed about a lost point
_CLEAR = 0.55  # of the error that is allowed, for a corner of few edges to be found again
_MOST_MISSES = 3  # frames after which a corner of two edges is not found again without a guide


Guide = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""From the places of points (p, 2), NaN where lost, to where each of them should be.

NaN where that is not known, infinite where the point cannot be seen.
"""


@dataclass(frozen=True)
class FollowSettings:
    """How corners are followed.

    Attributes
    ----------
    window : int
        Side of the square that is compared (pixels).
    levels : int
        Of the pyramid: each doubles the motion that is found.
    back : float
        Largest distance (pixels) by which a point may miss itself there and back.
    error : float
        Largest standard error of a junction (pixels).
    stray : float
        Largest distance from where its neighbors' motion puts a point, relative to the distance of
        the neighbors.
    """

    window: int = 31
    levels: int = 4
    back: float = 2.0
    error: float = 0.35
    stray: float = 0.3

    def __post_init__(self) -> None:
        if self.window < 5 or self.levels < 0:
            raise InputError(f"window, levels: {self.window}, {self.levels}; give 5 and 0 or more")
        for name in ("back", "error", "stray"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"{name}: {getattr(self, name)!r}; give a positive number")


@dataclass(frozen=True)
class Step:
    """Corners in one frame.

    Attributes
    ----------
    time : float
        Of the frame (s).
    position : ndarray, shape (p, 2)
        Pixels of the region of interest; NaN where a corner is lost or not measured.
    error : ndarray, shape (p,)
        Standard error (pixels).
    status : ndarray of int8, shape (p,)
        0 lost, 1 found again, 2 tracked from the frame before.
    repeated : bool
        The frame repeats the one before it: nothing is measured in it.
    """

    time: float
    position: NDArray[np.float64]
    error: NDArray[np.float64]
    status: NDArray[np.int8]
    repeated: bool


def follow(
    frames: Iterable[tuple[float, NDArray[np.uint8]]],
    points: NDArray[np.float64],
    reach: float,
    settings: FollowSettings | None = None,
    unseen: NDArray[np.bool_] | None = None,
    guide: Guide | None = None,
) -> Iterator[Step]:
    """Follow corners through the frames of a film.

    Parameters
    ----------
    frames : iterable of (float, ndarray of uint8)
        Times (s) and gray pictures; the first is the one in which the points were found.
    points : ndarray, shape (p, 2)
        Corners in the first frame (pixels).
    reach : float
        Length of the edges that make a corner (pixels).
    settings : FollowSettings
    unseen : ndarray of bool, shape (p,), optional
        Points that are not there yet: they are looked for as lost ones are.
    guide : callable, optional
        Where points should be by the others; None: where their neighbors moved them.

    Yields
    ------
    Step
        One for each frame.

    Notes
    -----
    Bouguet, Pyramidal implementation of the Lucas Kanade feature tracker, Intel, 2001; Kalal,
    Mikolajczyk and Matas, Forward-backward error, ICPR 2010.
    """
    how = settings or FollowSettings()
    last: NDArray[np.uint8] | None = None
    state = _State.begun(points, np.zeros(len(points), bool))
    for time, frame in frames:
        count = len(points)
        if last is None:
            first = refine(frame, points, reach, 0.5 * reach)
            kept = np.isfinite(first.position[:, 0])
            kept &= True if unseen is None else ~unseen
            state = _State.begun(np.where(kept[:, np.newaxis], first.position, points), kept)
            error = np.where(kept, first.error, np.nan)
            yield Step(time, state.shown(), error, (2 * kept).astype(np.int8), False)
        elif _repeats(frame, last):
            unknown = np.full(count, np.nan)
            yield Step(time, np.full((count, 2), np.nan), unknown, np.zeros(count, np.int8), True)
            continue
        else:
            state, error, status = _advance(last, frame, state, reach, how, guide)
            yield Step(time, state.shown(), error, status, False)
        last = frame


@dataclass(frozen=True)
class _State:
    """Where the corners are, and where they may be.

    Attributes
    ----------
    here : ndarray, shape (p, 2)
        Last known place, or the place that neighbors tell for a lost corner.
    step : ndarray, shape (p, 2)
        Motion since the frame before.
    misses : ndarray of int, shape (p,)
        Frames since the corner was last measured.
    anchor : ndarray, shape (p, p, 2)
        For each corner the places of all when it was last seen, NaN where these were not: from
        there its neighbors' motion is counted, so that errors do not add up while it is lost.
    """

    here: NDArray[np.float64]
    step: NDArray[np.float64]
    misses: NDArray[np.int64]
    anchor: NDArray[np.float64]

    @classmethod
    def begun(cls, here: NDArray[np.float64], kept: NDArray[np.bool_]) -> _State:
        count = len(here)
        misses = np.where(kept, 0, _MOST_MISSES + 1)
        anchor = np.repeat(np.where(kept[:, np.newaxis], here, np.nan)[np.newaxis], count, axis=0)
        anchor[np.arange(count), np.arange(count)] = here
        return cls(here, np.zeros((count, 2)), misses, anchor)

    def moved(self, here: NDArray[np.float64], kept: NDArray[np.bool_]) -> _State:
        misses = np.where(kept, 0, self.misses + 1)
        step = np.where(kept[:, np.newaxis], here - self.here, self.step)
        anchor = self.anchor.copy()
        anchor[kept] = np.where(kept[:, np.newaxis], here, np.nan)
        return _State(here, step, misses, anchor)

    def shown(self) -> NDArray[np.float64]:
        """Measured places: NaN where the junction was not seen in this very frame."""
        return np.where((self.misses == 0)[:, np.newaxis], self.here, np.nan)


def _advance(
    last: NDArray[np.uint8],
    frame: NDArray[np.uint8],
    state: _State,
    reach: float,
    how: FollowSettings,
    guide: Guide | None,
) -> tuple[_State, NDArray[np.float64], NDArray[np.int8]]:
    led = state.misses == 0
    flown, there = _flow(last, frame, state.here, state.here + state.step, led, reach, how)
    # a junction near the place to which the flow leads
    moved = np.where(there[:, np.newaxis], flown, np.nan)
    junction = refine(frame, moved, reach, 0.5 * reach)
    good = there & np.isfinite(junction.position[:, 0]) & (junction.error < how.error)
    place = np.where(good[:, np.newaxis], junction.position, flown)
    expected, distance = _by_neighbors(state, place, good)
    near = np.hypot(*(place - expected).T) < np.maximum(how.stray * distance, 3.0)
    good &= near | ~np.isfinite(expected[:, 0])
    if guide is not None:
        told = guide(np.where(good[:, np.newaxis], place, np.nan))
        stray, usual = _strays(place, told)
        good &= ~(stray > _STRAY * reach + 4.0 * usual)
    good &= ~_crowded(place, good, junction.error, 0.4 * reach)
    error, status = junction.error.copy(), np.where(good, TRACKED, LOST).astype(np.int8)

    # the others: where they should be by these, if a junction is there
    expected, _ = _by_neighbors(state, place, good)
    told, barred = np.full(place.shape, np.nan), np.zeros(len(place), bool)
    if guide is not None:
        told = guide(np.where(good[:, np.newaxis], place, np.nan))
        _, usual = _strays(np.where(good[:, np.newaxis], place, np.nan), told)
        # where the guide itself has lost its way, neighbors do no better
        barred = ~(np.isfinite(told[:, 0]) & (usual < _SURE * reach))
        expected = np.where(barred[:, np.newaxis], expected, told)
    guess = np.where(np.isfinite(expected), expected, state.here)
    again = refine(
        frame, np.where((good | barred)[:, np.newaxis], np.nan, guess), reach, 0.35 * reach
    )
    # where fewer edges meet, the end of a stain on an edge may be taken for the corner
    allowed = how.error * np.where(again.edges >= 4, 1.0, _CLEAR)
    found = ~good & np.isfinite(again.position[:, 0]) & (again.error < allowed)
    if guide is None:  # after some frames no doubt may be left about which corner it is
        found &= (again.edges >= 3) | (state.misses < _MOST_MISSES)
    merged = np.where(found[:, np.newaxis], again.position, place)
    found &= ~_taken(merged, good, found, 0.6 * reach)
    status[found], error[found] = FOUND_AGAIN, again.error[found]
    kept = good | found
    error[~kept] = np.nan
    place = np.where(
        found[:, np.newaxis], again.position, np.where(good[:, np.newaxis], place, guess)
    )
    return state.moved(place, kept), error, status


def _flow(last, frame, start, guess, led, reach, how):
    """Where the flow leads points, and which of them come back to where they were."""
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
    size = (how.window, how.window)
    options = {
        "winSize": size,
        "maxLevel": how.levels,
        "criteria": (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.01),
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
    }
    old = (start[some] - low).astype(np.float32)[:, np.newaxis]
    new = (guess[some] - low).astype(np.float32)[:, np.newaxis]
    new, found, _ = cv2.calcOpticalFlowPyrLK(before, after, old, new.copy(), **options)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, new, old.copy(), **options)
    missed = np.hypot(*(back - old).reshape(-1, 2).T)
    flown[some] = new.reshape(-1, 2) + low
    there[some] = (found.ravel() > 0) & (returned.ravel() > 0) & (missed < how.back)
    return flown, there & _within(flown, frame.shape, reach)


def _within(points, shape, margin):
    height, width = shape
    inside = (points >= margin) & (points <= np.array([width, height]) - 1.0 - margin)
    return inside.all(axis=1)


def _by_neighbors(state: _State, place, good):
    """Places by the affine motion of the nearest good neighbors, and how far these are.

    NaN where fewer than four neighbors are good.
    """
    count = len(place)
    expected, distance = np.full((count, 2), np.nan), np.full(count, np.nan)
    known = np.flatnonzero(good)
    if len(known) < 5:
        return expected, distance
    for p in range(count):
        then = state.anchor[p]
        others = known[(known != p) & np.isfinite(then[known, 0])]
        if len(others) < 4:
            continue
        apart = np.hypot(*(then[others] - then[p]).T)
        nearest = np.argsort(apart)[:_NEIGHBORS]
        some = others[nearest]
        offset = np.column_stack([np.ones(len(some)), then[some] - then[p]])
        motion = place[some] - then[some]
        # the mean rules, the gradient is held small: a row of neighbors leaves it open
        normal = offset.T @ offset
        normal[1:, 1:] += 0.05 * np.trace(normal[1:, 1:]) * np.eye(2)
        gradient = np.linalg.solve(normal, offset.T @ motion)
        expected[p] = then[p] + gradient[0]
        distance[p] = np.median(apart[nearest])
    return expected, distance


def _strays(place, told):
    """Distance of points from where a guide puts them, and that of their nearest neighbors."""
    stray = np.hypot(*(place - told).T)
    known = np.flatnonzero(np.isfinite(stray))
    usual = np.full(len(place), np.inf)
    for p in np.flatnonzero(np.isfinite(told[:, 0])):
        others = known[known != p]
        if len(others):
            apart = np.hypot(*(told[others] - told[p]).T)
            usual[p] = np.median(stray[others[np.argsort(apart)[:_NEIGHBORS]]])
    return stray, usual


def _crowded(place, good, error, apart):
    """Points that have come to the place of another one: all but the best measured of them."""
    out = np.zeros(len(place), bool)
    known = np.flatnonzero(good)
    for k, p in enumerate(known):
        close = np.hypot(*(place[known] - place[p]).T) < apart
        close[k] = False
        out[p] = (error[known[close]] <= error[p]).any() if close.any() else False
    return out


def _taken(place, good, found, apart):
    """Points found again where another corner is already."""
    out = np.zeros(len(place), bool)
    held = np.flatnonzero(good | found)
    for p in np.flatnonzero(found):
        others = held[held != p]
        out[p] = bool((np.hypot(*(place[others] - place[p]).T) < apart).any())
    return out


def _repeats(frame: NDArray[np.uint8], last: NDArray[np.uint8]) -> bool:
    """Tell whether a frame is the same picture as the last one."""
    if (frame[::16, ::16] != last[::16, ::16]).any():
        return False
    return bool((frame == last).all())
