"""From the parameters of a design to the numbers of its case, differentiated.

Nothing is solved to build a case, so that central differences of its numbers are cheap; they are of
the fourth order, with steps of a thousandth, and right to about 1e-11.

An array of n parameters costs as much as one number where each number of the case depends on one
entry, as stiffnesses do on those of their creases. All entries are changed at once, once in equal
parts and once in parts that tell them apart; how the numbers then change says what belongs to
which. A third change, at random, checks it. Where it fails, as for thicknesses of panels that share
an edge, entries are changed one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import FoldynError, InputError, within
from foldyn.gradients.numbers import Gradient
from foldyn.mechanics.pullback import Arrays
from foldyn.values import show

STEP = 1e-3  # of the size of a parameter
MATCHES = 1e-6  # relative: how well the entries are told apart, and the check holds
SILENT = 1e-11, 1e-12  # of a number, and of the largest of its array: rounding of a change
Values = Mapping[str, Any]
Build = Callable[..., Any]


class Slope(NamedTuple):
    """How the numbers of a case change with the entries of a parameter, each with its own.

    by : of each array how each number changes.
    entry : of each array to which entry that belongs, -1 for none.
    """

    by: Mapping[str, NDArray]
    entry: Mapping[str, NDArray]
    count: int

    def pulled(self, gradient: Gradient) -> NDArray:
        """Derivatives (count,) of a number with this gradient."""
        out = np.zeros(self.count)
        for name, by in self.by.items():
            if name in gradient:
                here = self.entry[name] >= 0
                product = (np.asarray(gradient[name]) * by)[here]
                out += np.bincount(self.entry[name][here], product, self.count)
        return out


class Parameters:
    """Parameters of a design where its gradient is sought.

    Parameters
    ----------
    build : callable
        Case from values of the parameters.
    values : mapping
        Numbers, or arrays of one dimension.
    steps : mapping
        Of parameters that are 0 and the like: their size, of which the step is a thousandth.
    """

    def __init__(self, build: Build, values: Values, steps: Values) -> None:
        self.build, self.values, self.steps = build, checked(values), steps
        for name in steps:
            if name not in self.values:
                raise InputError(f".{name}: there is no such parameter", "sizes")

    def case(self, changes: Values | None = None) -> Any:
        """The case, with some values changed."""
        given = {**self.values, **(changes or {})}
        try:
            return self.build(**{k: v if v.ndim else float(v) for k, v in given.items()})
        except TypeError as error:
            raise InputError(f": build cannot take these parameters ({error})", "build") from error

    def size(self, name: str) -> NDArray:
        """What a parameter is measured by, of its shape."""
        value = self.values[name]
        if name in self.steps:
            return np.broadcast_to(np.asarray(self.steps[name], float), value.shape)
        own = np.abs(value)
        common = own.max(initial=0.0)
        if not common:
            raise InputError(
                f" = 0: how far it may be changed for a difference is not known; give its size, as "
                f'sizes={{"{name}": 1.0}}',
                name,
            )
        return np.where(own > 1e-3 * common, own, common)

    def moved(self, name: str, direction: NDArray, by: float) -> Any:
        """The case with a parameter moved by so much of a direction."""
        try:
            return self.case({name: self.values[name] + by * direction})
        except FoldynError as error:
            raise InputError(
                f": cannot be changed by {by:.1g} of its size, which differences need: {error}; "
                "move it away from its bound, or give a smaller size",
                name,
            ) from error

    def slopes(self, numbers_of: Callable[[Any], Arrays], names: Any = None) -> dict[str, Slope]:
        """How the numbers of the case change with each of the parameters."""
        here = numbers_of(self.case())
        return {name: self._slope(name, numbers_of, here) for name in (names or self.values)}

    def _slope(self, name: str, numbers_of: Callable[[Any], Arrays], here: Arrays) -> Slope:
        value, size = self.values[name], self.size(name)

        def change(direction: NDArray) -> dict[str, NDArray]:
            def at(by: float) -> Mapping[str, NDArray]:
                found = numbers_of(self.moved(name, direction, by))
                check_layout(name, here, found)
                return found.numbers

            near, far = (at(STEP), at(-STEP)), (at(2 * STEP), at(-2 * STEP))
            return {
                key: (8.0 * (near[0][key] - near[1][key]) - (far[0][key] - far[1][key]))
                / (12.0 * STEP)
                for key in here.numbers
            }

        by = change(size)
        if value.ndim == 0:
            entry = {key: np.zeros(each.shape, np.int64) for key, each in by.items()}
            return Slope({key: each / size for key, each in by.items()}, entry, 1)
        count = value.size
        marked = change(size * (1.0 + np.arange(count) / count))
        chance = np.random.default_rng(0).uniform(0.5, 1.5, count)
        tried = change(size * chance)
        entry = {}
        for key, each in by.items():
            number = np.abs(here.numbers[key])
            moves = np.abs(each) > SILENT[0] * number + SILENT[1] * number.max(initial=0.0)
            part = np.divide(marked[key], each, out=np.zeros_like(each), where=moves) - 1.0
            number = np.where(moves, np.rint(part * count), -1).astype(np.int64)
            apart = np.abs(part * count - number)[moves].max(initial=0.0)
            inside = (number < count).all() and (number[moves] >= 0).all()
            expected = np.where(moves, each * chance[np.clip(number, 0, count - 1)], 0.0)
            scale = np.abs(tried[key]).max(initial=0.0)
            wrong = np.abs(tried[key] - expected).max(initial=0.0) > MATCHES * scale
            if apart > 0.1 or not inside or wrong:
                return self._one_by_one(name, change, size)
            entry[key] = number
        own = {
            key: np.divide(each, size[entry[key]], out=np.zeros_like(each), where=entry[key] >= 0)
            for key, each in by.items()
        }
        return Slope(own, entry, count)

    def _one_by_one(
        self, name: str, change: Callable[[NDArray], dict[str, NDArray]], size: NDArray
    ) -> Any:
        columns = []
        for k in range(len(size)):
            alone = np.zeros_like(size)
            alone[k] = size[k]
            columns.append({key: each / size[k] for key, each in change(alone).items()})
        return Columns(columns)


class Columns(NamedTuple):
    """The same where numbers depend on several entries: of each entry how all numbers change."""

    by: list[dict[str, NDArray]]

    def pulled(self, gradient: Gradient) -> NDArray:
        """See `Slope`."""
        return np.array(
            [
                sum(
                    float((gradient[key] * each).sum())
                    for key, each in by.items()
                    if key in gradient
                )
                for by in self.by
            ]
        )


def checked(values: Values) -> dict[str, NDArray]:
    """Values of parameters as arrays."""
    if not isinstance(values, Mapping) or not values:
        raise InputError(f" = {show(values)}: give a mapping of names to values", "parameters")
    found = {}
    for name, value in values.items():
        with within("parameters"):
            try:
                array = np.array(value, dtype=float)
            except (TypeError, ValueError):
                raise InputError(f" = {show(value)}: give a number or an array", name) from None
            if array.ndim > 1 or not array.size or not np.isfinite(array).all():
                raise InputError(
                    f" = {show(value)}: give a finite number, or an array of one dimension", name
                )
        found[name] = array
    return found


def check_layout(name: str, one: Arrays, other: Arrays) -> None:
    """Refuse a parameter that changes more than numbers."""
    for key, array in one.layout.items():
        if key not in other.layout or not np.array_equal(array, other.layout[key]):
            raise InputError(
                f": changes what is connected, held or switched on ({key}), not only numbers; "
                "results have no derivative by it: keep it fixed, or vary it by fd.sweep",
                name,
            )
    for key, array in one.numbers.items():
        if key not in other.numbers or array.shape != other.numbers[key].shape:
            raise InputError(
                f": changes how many numbers the case has ({key}); results have no derivative by "
                "it: keep it fixed, or vary it by fd.sweep",
                name,
            )


def entries(values: Mapping[str, NDArray]) -> Iterator[tuple[str, int]]:
    """All entries of parameters, by name and number."""
    for name, value in values.items():
        yield from ((name, k) for k in range(value.size))
