"""The design space: parameters within their bounds, scaled to 0 to 1."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, within
from foldyn.values import numbers, show

Values = Mapping[str, float | NDArray]
"""Values of parameters by name."""


@dataclass(frozen=True, eq=False)
class Space:
    """Parameters within their bounds.

    Attributes
    ----------
    shapes : dict of str to tuple
        () for a number, (count,) for an array.
    lower, upper : ndarray, shape (n,)
        Bounds of all entries, one parameter after the other.
    """

    shapes: dict[str, tuple[int, ...]]
    lower: NDArray
    upper: NDArray

    def point(self, x: NDArray) -> tuple[float, ...]:
        """Entries of a design from scaled values (0 to 1)."""
        inside = np.clip(x, 0.0, 1.0)
        return tuple((self.lower * (1.0 - inside) + self.upper * inside).tolist())

    def x(self, point: NDArray) -> NDArray:
        """Scaled values (0 to 1) of the entries of a design."""
        return (np.asarray(point) - self.lower) / (self.upper - self.lower)

    def parts(self, entries: NDArray) -> dict[str, NDArray]:
        """Split entries along the last axis by parameter."""
        counts = [int(np.prod(shape)) for shape in self.shapes.values()]
        split = np.split(np.asarray(entries), np.cumsum(counts)[:-1], axis=-1)
        return dict(zip(self.shapes, split, strict=True))

    def values(self, point: tuple[float, ...]) -> dict[str, float | NDArray]:
        """Values of the parameters of a design."""
        return {
            name: part if self.shapes[name] else float(part[0])
            for name, part in self.parts(np.array(point)).items()
        }

    @property
    def entries(self) -> list[str]:
        """Names of all entries: "panel_angle", "stiffness[3]"."""
        return [
            f"{name}[{k}]" if shape else name
            for name, shape in self.shapes.items()
            for k in range(int(np.prod(shape)))
        ]


def space_of(bounds: Any, guess: Any) -> tuple[Space, NDArray]:
    """Design space and the entries of the first design, by default in the middle.

    Raises
    ------
    InputError
        Bounds are missing, or inconsistent with each other or the guess.
    """
    if not isinstance(bounds, Mapping) or not bounds:
        raise InputError(
            f' = {show(bounds)}: give each parameter its bounds, as {{"panel_angle": (45, 80)}}',
            "bounds",
        )
    if guess is not None and not isinstance(guess, Mapping):
        raise InputError(f" = {show(guess)}: give a mapping of names to values", "guess")
    for name in guess or {}:
        if name not in bounds:
            raise InputError(f": {name} has no bounds; give it some in bounds", "guess")
    shapes, columns = {}, []
    for name, pair in bounds.items():
        if not isinstance(name, str):
            raise InputError(f": {show(name)} must be the name of a parameter", "bounds")
        shape, ends = _ends(name, pair, None if guess is None else guess.get(name))
        shapes[name] = shape
        columns.append(ends)
    lower, upper, first = np.concatenate(columns, axis=1)
    return Space(shapes, lower, upper), first


def _ends(name: str, pair: Any, guess: Any) -> tuple[tuple[int, ...], NDArray]:
    """Shape of a parameter, and its lower bound, upper bound and guess (3, count)."""
    place = f"bounds.{name}"
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        raise InputError(f" = {show(pair)}: must be a lower and an upper bound", place)
    lower, upper = (numbers(f"{place}[{k}]", end) for k, end in enumerate(pair))
    first = None if guess is None else numbers(f"guess.{name}", guess)
    given = [one for one in (lower, upper, first) if one is not None]
    if any(one.ndim > 1 or not one.size for one in given):
        raise InputError(": must be numbers, or lists of one for each entry", place)
    try:
        shape = np.broadcast_shapes(*(one.shape for one in given))
    except ValueError:
        lengths = ", ".join(str(one.size) for one in given if one.ndim)
        raise InputError(
            f": lists of different lengths ({lengths}), guess among them", place
        ) from None
    lower, upper = (np.broadcast_to(end, shape).ravel() for end in (lower, upper))
    bad = np.flatnonzero(~(lower < upper))
    with within(place):
        if bad.size:
            at = f"[{bad[0]}]" if shape else ""
            raise InputError(
                f": from {lower[bad[0]]:g} to {upper[bad[0]]:g}: the lower bound must be below the "
                "upper one; leave out parameters that are fixed",
                at,
            )
    begin = 0.5 * (lower + upper) if first is None else np.broadcast_to(first, shape).ravel()
    outside = np.flatnonzero((begin < lower) | (begin > upper))
    if outside.size:
        k = outside[0]
        raise InputError(
            f" = {begin[k]:g}: must be within its bounds, {lower[k]:g} to {upper[k]:g}",
            f"guess.{name}{f'[{k}]' if shape else ''}",
        )
    return shape, np.stack([lower, upper, begin])
