"""Prediction of points in a picture from the motion of their nearest neighbors."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

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
        For each point the positions of all in its reference picture (pixels), NaN if unknown.
    place : ndarray, shape (n, 2)
        Current positions, NaN if unknown.
    asked : iterable of int
        Points to predict.
    count : int
        Number of neighbors used.
    firmness : float
        Regularization of the gradient towards zero: a row of neighbors does not determine it.
    robust : bool
        Start from the median, so that one wrong neighbor does not spoil the fit.

    Returns
    -------
    expected : ndarray, shape (n, 2)
        NaN for points not requested, and where fewer than four neighbors are known.
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
