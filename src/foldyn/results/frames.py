"""States of a result as frames of a pattern file, or as a pattern of its own."""

from __future__ import annotations

from typing import NamedTuple

import xarray as xr

from foldyn.errors import InputError
from foldyn.formats.frames import Frame
from foldyn.patterns import Pattern
from foldyn.results.contents import check_result, check_variable, pattern_of
from foldyn.values import whole

ALONG = {
    "trajectory": ("time", "time", "t = {:.6g} s"),
    "path": ("step", "load_factor", "load factor {:.6g}"),
}
"""Kinds of results that have states: their dimension, its coordinate, and titles."""


class States(NamedTuple):
    """A pattern at rest and its states in a result."""

    pattern: Pattern
    frames: list[Frame]


def frames_of(result: xr.Dataset, every: int = 1) -> States:
    """States of a motion or a path, for `write_pattern`.

    Parameters
    ----------
    result : xarray.Dataset
        A motion or an equilibrium path.
    every : int
        Take every such sample; the last one is always taken.

    Returns
    -------
    States
        The `pattern` at rest, and its `frames`: coordinates (m) of its vertices in each state,
        titled by the time or the load factor.

    Raises
    ------
    InputError
        Not such a result, or one without its pattern.

    Examples
    --------
    >>> pattern, frames = frames_of(trajectory, every=10)  # doctest: +SKIP
    >>> fd.write_pattern("run.fold", pattern, frames)  # doctest: +SKIP
    """
    every = whole("every", every, least=1)
    check_result(result, "result: ")
    kind = result.attrs["foldyn_result"]
    if kind not in ALONG:
        raise InputError(
            f": is of kind {kind!r}, which has no states in turn; give a motion or a path", "result"
        )
    pattern = pattern_of(result)
    dimension, name, title = ALONG[kind]
    moved = check_variable(result, "displacement", (dimension, "node", "axis")).values
    moved = moved[:, : len(pattern.vertices)]
    last = len(moved) - 1
    rows = sorted({*range(0, last + 1, every), last} if last >= 0 else set())
    values = check_variable(result, name, (dimension,)).values
    return States(
        pattern, [Frame(title.format(values[k]), pattern.vertices + moved[k]) for k in rows]
    )


def state_of(result: xr.Dataset, frame: int | None = None) -> Pattern:
    """Pattern in one state of a motion or a path.

    Parameters
    ----------
    result : xarray.Dataset
        A motion or an equilibrium path.
    frame : int, optional
        Number of the sample, from 0; by default the last one.

    Returns
    -------
    Pattern
        With the letters and families of the pattern at rest.

    Raises
    ------
    InputError
        Not such a result, or no such sample.
    """
    pattern, frames = frames_of(result)
    if frame is None:
        frame = len(frames) - 1
    if isinstance(frame, bool) or not isinstance(frame, int) or not 0 <= frame < len(frames):
        raise InputError(
            f" = {frame!r}: the result has the samples 0 to {len(frames) - 1}; give one of these",
            "frame",
        )
    name = f"{pattern.name}, {frames[frame].title}" if pattern.name else frames[frame].title
    return pattern.changed(vertices=frames[frame].vertices, name=name, boards=None)
