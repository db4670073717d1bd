"""Shapes in a result: frames of a pattern file, a pattern, or the positions of all nodes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.frames import Frame
from foldyn.results.contents import check_result, check_variable, pattern_of
from foldyn.values import number, whole

ALONG = {
    "trajectory": ("time", "time", "displacement", "t = {:.6g} s"),
    "path": ("step", "load_factor", "displacement", "load factor {:.6g}"),
    "modes": ("mode", "frequency", "shape", "{:.6g} Hz"),
    "folding": ("step", "share", "displacement", "{:.4g} of the way"),
}
"""Kinds of results with shapes: dimension, coordinate, displacement variable and titles of each."""
SWING = 0.12
"""Largest displacement of a displayed mode, relative to the size of the pattern."""

LARGEST = 1e6
"""Largest factor on displacements; larger ones would exceed single precision."""


class Shapes(NamedTuple):
    """Shapes of all nodes of a result, in the order of the samples.

    Attributes
    ----------
    samples : ndarray, shape (k,)
        Numbers of the samples in the result, from 0.
    values : ndarray, shape (k,)
        Times (s), load factors, or frequencies (Hz).
    titles : list of str
        Titles, such as "t = 0.1 s", "load factor 1" or "mode 2: 1.05 Hz".
    nodes : ndarray, shape (n, 3)
        Positions (m) to which displacements are relative: at rest or, for modes, in the state about
        which the nodes oscillate.
    displacement : ndarray, shape (k, n, 3)
        Displacements (m) times the requested factor. The largest of a mode is `SWING` times the
        pattern's size and that factor.
    """

    samples: NDArray[np.int64]
    values: NDArray[np.float64]
    titles: list[str]
    nodes: NDArray[np.float64]
    displacement: NDArray[np.float64]


def shapes_of(
    result: xr.Dataset, every: int | None = None, *, frames: int | None = None, scale: float = 1.0
) -> Shapes:
    """Shapes of all nodes in a motion, path, modes or folding.

    Parameters
    ----------
    result : xarray.Dataset
        A motion, an equilibrium path, modes, or `Folding.path`.
    every : int, optional
        Take every n-th sample, and always the last one.
    frames : int, optional
        Take this many samples, evenly spread, including the first and the last.
    scale : float
        Factor of all displacements.

    Returns
    -------
    Shapes
        Shapes of all samples, or of fewer if requested.

    Raises
    ------
    InputError
        Another kind of result, displacements that are not finite, or an impossible number of
        samples.
    """
    check_result(result, "result: ")
    return _shapes(result, chosen_samples(result.sizes[_along(result)[0]], every, frames), scale)


def _along(result: xr.Dataset) -> tuple[str, str, str, str]:
    kind = result.attrs["foldyn_result"]
    if kind not in ALONG:
        raise InputError(
            f": is of kind {kind!r}, which has no series of shapes; give a motion, a path or modes",
            "result",
        )
    return ALONG[kind]


def chosen_samples(count: int, every: int | None, frames: int | None) -> NDArray[np.int64]:
    """Numbers of the samples to take from `count` samples."""
    if count == 0:
        raise InputError(": has no samples; compute it again", "result")
    if every is not None and frames is not None:
        raise InputError(": give either every or frames, not both", "frames")
    if frames is not None:
        wanted = min(whole("frames", frames, least=2), count)
        return np.unique(np.rint(np.linspace(0.0, count - 1.0, wanted)).astype(np.int64))
    step = 1 if every is None else whole("every", every, least=1)
    return np.unique([*range(0, count, step), count - 1])


def _shapes(result: xr.Dataset, samples: NDArray[np.int64], scale: float) -> Shapes:
    """Shapes at given samples; mode shapes are scaled to `SWING` times the pattern's size."""
    dimension, name, moving, title = _along(result)
    factor = number("scale", scale, largest=LARGEST)
    moved = check_variable(result, moving, (dimension, "node", "axis")).values[samples]
    values = check_variable(result, name, (dimension,)).values[samples]
    nodes = check_variable(result, "rest_position", ("node", "axis")).values
    lost = np.flatnonzero(~np.isfinite(moved).all(axis=(1, 2)))
    if len(lost):
        raise InputError(
            f": sample {samples[lost[0]]} is not finite: the computation failed there; cut the "
            f"result before it, as result.isel({dimension}=slice({samples[lost[0]]}))",
            "result",
        )
    titles = [title.format(value) for value in values]
    if dimension == "mode":
        nodes = nodes + check_variable(result, "displacement", ("node", "axis")).values
        largest = np.linalg.norm(moved, axis=2).max(axis=1)
        factor = (factor * SWING * pattern_of(result).size / largest)[:, None, None]
        titles = [
            f"mode {k}: {text if np.isfinite(value) else 'unstable'}"
            for k, text, value in zip(result["mode"].values[samples], titles, values, strict=True)
        ]
    return Shapes(samples, values, titles, nodes, factor * moved)


class States(NamedTuple):
    """A pattern at rest and its states in a result."""

    pattern: Pattern
    frames: list[Frame]


def frames_of(
    result: xr.Dataset, every: int | None = None, *, frames: int | None = None, scale: float = 1.0
) -> States:
    """States of a motion, a path, modes or a folding, for `write_pattern`.

    Parameters
    ----------
    result, every, frames, scale
        See `shapes_of`.

    Returns
    -------
    States
        The `pattern` at rest, and `frames`: coordinates (m) of the vertices in each state, with the
        time, the load factor, the mode or the share of the folding motion as the title.

    Raises
    ------
    InputError
        A result without shapes or without a pattern.

    Examples
    --------
    >>> pattern, frames = frames_of(trajectory, every=10)  # doctest: +SKIP
    >>> fd.write_pattern(pattern, "run.fold", frames=frames)  # doctest: +SKIP
    """
    return _states(result, shapes_of(result, every, frames=frames, scale=scale))


def _states(result: xr.Dataset, shapes: Shapes) -> States:
    pattern = pattern_of(result)
    vertices = (shapes.nodes + shapes.displacement)[:, : len(pattern.vertices)]
    return States(pattern, list(map(Frame, shapes.titles, vertices)))


def state_of(result: xr.Dataset, frame: int | None = None, *, scale: float = 1.0) -> Pattern:
    """Pattern in one state of a motion, a path, modes or a folding.

    Parameters
    ----------
    result : xarray.Dataset
        A motion, an equilibrium path, modes, or `Folding.path`.
    frame : int, optional
        Number of the sample, from 0; by default the last one.
    scale : float
        Factor of all displacements.

    Returns
    -------
    Pattern
        Pattern with the letters and families of the pattern at rest.

    Raises
    ------
    InputError
        A result without shapes, or a sample that it lacks.
    """
    check_result(result, "result: ")
    count = result.sizes[_along(result)[0]]
    if frame is None:
        frame = count - 1
    if isinstance(frame, bool) or not isinstance(frame, int) or not 0 <= frame < count:
        raise InputError(
            f" = {frame!r}: the result has the samples 0 to {count - 1}; give one of these", "frame"
        )
    pattern, (state,) = _states(result, _shapes(result, np.array([frame]), scale))
    name = f"{pattern.name}, {state.title}" if pattern.name else state.title
    return pattern.changed(vertices=state.vertices, name=name, boards=None)
