"""Public checkers of gradients, tangents and orders of convergence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError


def observed_order(steps: ArrayLike, errors: ArrayLike) -> float:
    """Order p of errors ~ step^p: slope of the least-squares line in logarithms.

    Parameters
    ----------
    steps, errors : array_like, shape (n,)
        Step sizes (or mesh sizes), and the error with each of them; signs are ignored.

    Examples
    --------
    >>> round(observed_order([0.1, 0.05, 0.025], [1e-4, 6.25e-6, 3.9e-7]), 2)
    4.0
    """
    h, e = np.asarray(steps, float), np.abs(np.asarray(errors, float))
    if h.shape != e.shape or h.ndim != 1 or len(h) < 2:
        raise InputError("observed_order: give as many errors as steps, at least two")
    if (e <= 0.0).any() or (h <= 0.0).any():
        raise InputError("observed_order: steps and errors must not be zero")
    return float(np.polyfit(np.log(h), np.log(e), 1)[0])


def gradient_error(
    energy: Callable[[NDArray], float],
    force: Callable[[NDArray], NDArray],
    *,
    at: ArrayLike,
    seed: int = 0,
    size: float | None = None,
) -> float:
    """Relative difference between a force and central differences of its energy.

    Both are compared along random directions; differences are extrapolated from two steps (error of
    order h^4).

    Parameters
    ----------
    energy, force : callable
        Functions of an array; the force has the shape of the array.
    at : array_like
        Array of any shape at which they are compared.
    seed : int
        Seed of the random directions.
    size : float, optional
        Scale of the array; steps are a thousandth of it. By default its largest entry, or 1e-3 if
        all are zero.
    """
    point = np.asarray(at, float)
    found, exact = [], []
    rng = np.random.default_rng(seed)
    h = 1e-3 * (size or _size(point))
    for _ in range(4):
        d = rng.standard_normal(point.shape)
        found.append(_slope(energy, point, d, h))
        exact.append(float((np.asarray(force(point)) * d).sum()))
    return float(np.linalg.norm(np.subtract(found, exact)) / np.linalg.norm(exact))


def tangent_error(
    force: Callable[[NDArray], NDArray],
    tangent: Callable[[NDArray], object],
    *,
    at: ArrayLike,
    seed: int = 0,
    size: float | None = None,
) -> float:
    """Relative difference between a tangent and central differences of its force.

    The tangent is a matrix that acts on the flattened array. Both are compared along a random
    direction; differences are extrapolated as in `gradient_error`.
    """
    point = np.asarray(at, float)
    d = np.random.default_rng(seed).standard_normal(point.shape)
    found = _slope(force, point, d, 1e-3 * (size or _size(point)))
    exact = (tangent(point) @ d.ravel()).reshape(point.shape)  # type: ignore[operator]
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


def _size(point: NDArray) -> float:
    return float(np.abs(point).max()) or 1e-3


def _slope(function: Callable[[NDArray], Any], point: NDArray, d: NDArray, h: float) -> Any:
    """Slope of a function along a direction: central differences, extrapolated from two steps."""

    def central(h: float) -> Any:
        return (np.asarray(function(point + h * d)) - function(point - h * d)) / (2.0 * h)

    return (4.0 * central(0.5 * h) - central(h)) / 3.0
