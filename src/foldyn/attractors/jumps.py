"""Jumps of an amplitude: changes too large for the small change of the drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.results import Quantity
from foldyn.results.quantities import variable

LARGE = 0.2  # least change, relative to the larger amplitude, that counts as a jump


class Jump(NamedTuple):
    """A jump of an amplitude.

    Attributes
    ----------
    sweep : str
        "up" or "down".
    place : float
        Last frequency (Hz), or level, before the jump.
    after : float
        First frequency, or level, after the jump.
    amplitudes : tuple of float
        Amplitudes before and after the jump.
    """

    sweep: str
    place: float
    after: float
    amplitudes: tuple[float, float]


def is_jump(before: ArrayLike, after: ArrayLike) -> NDArray[np.bool_]:
    """Whether the change from one amplitude to another is large."""
    return np.abs(np.subtract(after, before)) > LARGE * np.maximum(before, after)


def jumps_between(
    sweep: str, place: NDArray[np.float64], amplitude: NDArray[np.float64], width: float
) -> list[Jump]:
    """Jumps of amplitudes (k,) at successive frequencies or levels (k,).

    A jump is a large change of the amplitude within a width, given relative to the place. Among
    changes less than two widths apart only the largest counts: after a jump the amplitude swings
    until the transient has decayed.
    """
    last = len(place) - 1
    ends = np.arange(last) + 1
    for k in range(last):  # the farthest place within the width, or the next one
        while ends[k] < last and abs(place[ends[k] + 1] - place[k]) <= width * place[k]:
            ends[k] += 1
    change = np.abs(amplitude[ends] - amplitude[:-1])
    large = np.flatnonzero(is_jump(amplitude[:-1], amplitude[ends]))
    apart = np.abs(np.diff(place[large])) > 2.0 * width * place[large[:-1]]
    found = []
    for group in np.split(large, np.flatnonzero(apart) + 1):
        if group.size:
            k = group[np.argmax(change[group])]
            sizes = float(amplitude[k]), float(amplitude[ends[k]])
            found.append(Jump(sweep, float(place[k]), float(place[ends[k]]), sizes))
    return found


def jump_variables(
    jumps: Sequence[Jump], along: Quantity, measure: Quantity
) -> Mapping[str, tuple[Any, ...]]:
    """Variables that hold the jumps in a dataset, along the dimension jump.

    along : the swept parameter.
    """
    sweeps = np.array([jump.sweep for jump in jumps], "<U4")
    places = np.reshape([(jump.place, jump.after) for jump in jumps], (-1, 2))
    sizes = np.reshape([jump.amplitudes for jump in jumps], (-1, 2))
    sides, units = ("jump", "side"), measure.units
    return {
        "jump_sweep": variable(("jump",), sweeps, "", "sweep in which the jump is"),
        "jump_between": variable(sides, places, along.units, f"{along.text} on both sides"),
        "jump_amplitude": variable(sides, sizes, units, "amplitude before and after the jump"),
    }
