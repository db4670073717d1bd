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

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import FoldynError, InputError, within
from foldyn.gradients.numbers import Gradient
from foldyn.mechanics.pullback import Arrays
from foldyn.values import numbers, show

STEP = 1e-3  # of the size of a parameter
MATCHES = 1e-4  # relative: how well the entries are told apart, and the check holds
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
            here = self.entry[name] >= 0
            if here.any():
                product = (_known(gradient, name) * by)[here]
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

    def _slope(self, name: str, numbers_of: Callable[[Any], Arrays], here: Arrays) -> Any:
        value, size = self.values[name], self.size(name)

        def at(direction: NDArray, by: float) -> Mapping[str, NDArray]:
            found = numbers_of(self.moved(name, direction, by))
            check_layout(name, here, found)
            return found.numbers

        def roughly(direction: NDArray) -> dict[str, NDArray]:
            ahead, behind = at(direction, STEP), at(direction, -STEP)
            return {
                key: _seen((ahead[key] - behind[key]) / (2.0 * STEP), here.numbers[key])
                for key in here.numbers
            }

        def change(direction: NDArray) -> dict[str, NDArray]:
            near = at(direction, STEP), at(direction, -STEP)
            far = at(direction, 2.0 * STEP), at(direction, -2.0 * STEP)
            return {
                key: _difference(*(each[key] for each in (*near, *far, here.numbers)))
                for key in here.numbers
            }

        by = change(size)
        if value.ndim == 0:
            entry = {key: np.where(each != 0.0, 0, -1) for key, each in by.items()}
            return Slope({key: each / size for key, each in by.items()}, entry, 1)
        for changed in (roughly, change):  # the first is cheaper, and most often enough
            marks = 1.0 + np.arange(value.size) / value.size
            chance = np.random.default_rng(0).uniform(0.5, 1.5, value.size)
            entry = _told_apart(by, changed(size * marks), changed(size * chance), chance)
            if entry is not None:
                own = {key: _over(each, size, entry[key]) for key, each in by.items()}
                return Slope(own, entry, value.size)
        return self._one_by_one(change, size)

    def _one_by_one(
        self, change: Callable[[NDArray], dict[str, NDArray]], size: NDArray
    ) -> Columns:
        columns = []
        for k in range(len(size)):
            alone = np.zeros_like(size)
            alone[k] = size[k]
            columns.append({key: each / size[k] for key, each in change(alone).items()})
        return Columns(columns)


def _told_apart(
    by: Mapping[str, NDArray], marked: Mapping[str, NDArray], tried: Mapping[str, NDArray],
    chance: NDArray,
) -> dict[str, NDArray] | None:  # fmt: skip
    """Entry to which each number belongs; None where one belongs to several.

    by, marked, tried : rates of the numbers where all entries change alike, by marks that tell them
        apart, and by chance.
    """
    count, entry = len(chance), {}
    for key, each in by.items():
        moves = each != 0.0
        part = np.divide(marked[key], each, out=np.ones_like(each), where=moves) - 1.0
        number = np.where(moves, np.rint(part * count), -1).astype(np.int64)
        apart = np.abs(part * count - number)[moves].max(initial=0.0)
        inside = (number < count).all() and (number[moves] >= 0).all()
        expected = np.where(moves, each * chance[np.clip(number, 0, count - 1)], 0.0)
        scale = np.abs(tried[key]).max(initial=0.0)
        if (
            apart > 0.1
            or not inside
            or np.abs(tried[key] - expected).max(initial=0.0) > (MATCHES * scale)
        ):
            return None
        entry[key] = number
    return entry


def _over(rate: NDArray, size: NDArray, entry: NDArray) -> NDArray:
    """Rates over the sizes of their entries; 0 of those that have none."""
    return np.divide(rate, size[entry], out=np.zeros_like(rate), where=entry >= 0)


def _difference(
    ahead: NDArray, behind: NDArray, far_ahead: NDArray, far_behind: NDArray, here: NDArray
) -> NDArray:
    """Rate of numbers from those a step and two steps ahead and behind."""
    return _seen((8.0 * (ahead - behind) - (far_ahead - far_behind)) / (12.0 * STEP), here)


def _seen(rate: NDArray, here: NDArray) -> NDArray:
    """Rate of numbers, 0 where it is but their rounding."""
    size = np.abs(here)
    rounding = SILENT[0] * size + SILENT[1] * size.max(initial=0.0)
    return np.where(np.abs(rate) > rounding, rate, 0.0)


class Columns(NamedTuple):
    """The same where numbers depend on several entries: of each entry how all numbers change."""

    by: list[dict[str, NDArray]]

    def pulled(self, gradient: Gradient) -> NDArray:
        """See `Slope`."""
        return np.array(
            [
                sum(
                    float((_known(gradient, k) * each).sum())
                    for k, each in by.items()
                    if each.any()
                )
                for by in self.by
            ]
        )


def _known(gradient: Gradient, name: str) -> NDArray:
    """Derivative by the numbers of a name."""
    if name not in gradient:
        raise InputError(
            f"the design changes numbers of the case ({name}) by which there are no derivatives; "
            "keep them fixed, or vary the parameters by fd.sweep"
        )
    return gradient[name]


def checked(values: Values, argument: str = "parameters") -> dict[str, NDArray]:
    """Values of parameters as arrays."""
    if not isinstance(values, Mapping) or not values:
        raise InputError(f" = {show(values)}: give a mapping of names to values", argument)
    found = {}
    for name, value in values.items():
        with within(f"{argument}."):
            array = np.array(numbers(name, value))
            if array.ndim > 1 or not array.size:
                raise InputError(
                    f" = {show(value)}: give a number, or an array of one dimension", name
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
