"""Numbers that define a case for the solvers, and how they depend on the parameters of a design.

Gradients of results are taken with respect to these numbers (`mechanics.pullback`).

Derivatives of the numbers with respect to parameters are central differences of fourth order, with
steps of a thousandth, accurate to about 1e-11. They are cheap, because no equations are solved to
build a case.

If each number of the case depends on only one entry of an array parameter (a hinge's stiffness
depends on the stiffness of one crease), all entries are changed at once. To find which entry a
number depends on, groups of entries are changed in turn. Each entry belongs to a different set of
groups, and all sets have the same size. A number that depends on one entry changes with exactly the
groups of this entry. A number that depends on several entries (thicknesses of panels that share an
edge) changes with more groups; then entries are changed one by one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import combinations, islice
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.dynamics.system import PackedCase
from foldyn.errors import FoldynError, InputError, warn, within
from foldyn.mechanics.pullback import Arrays, Pullback, arrays_of_body
from foldyn.values import numbers, show

STEP = 1e-3  # step of a difference, relative to the size of the parameter
# steps tried in turn for measures, such as energies near a kink of a law
SHORTER = STEP, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8
SMOOTH = 1e-5  # a step is short enough if the third-order part is below this fraction of a change
LEAST = 1e-6  # changes below this fraction of a value are lost in round-off
GOLDEN = 0.6180339887498949  # multiples of this number modulo 1 are all distinct
# round-off of a change, relative to the number itself, and to the largest number of its array
SILENT = 1e-11, 1e-12
DIFFERENTIATED = "load.", "imposed.", "mass", "carried", "alpha", "beta"
"""Numbers of a case beside those of its body by which results have derivatives."""
KINK = (
    "{}: the numbers of the case ({}) have a kink here: their slopes jump, such as where another "
    "diagonal of a panel becomes the shorter one, or a corner passes 120 degrees. The gradient is "
    "the mean of both sides; move the design a little"
)
Values = Mapping[str, Any]
Build = Callable[..., Any]
Gradient = Mapping[str, NDArray]
"""Derivatives of a quantity with respect to arrays of numbers, by the name of the array."""


def numbers_of(case: Case) -> Arrays:
    """Numbers that define a case: its body's terms, mass, loads, supports and damping."""
    arrays = arrays_of_body(case.body)
    numbers, layout = dict(arrays.numbers), dict(arrays.layout)
    for kind in ("load", "imposed", "rest"):
        for k, (vector, _) in enumerate(getattr(case, f"{kind}_terms")):
            numbers[f"{kind}.{k}"] = np.asarray(vector, float)
    layout["held"] = case.fixed
    if case.constraints:  # no solver differentiates ties; included to notice if they change
        basis = case.constraints.basis
        numbers["constraints"] = basis @ np.random.default_rng(0).uniform(1.0, 2.0, basis.shape[1])
    numbers["alpha"], numbers["beta"] = np.array([[case.rayleigh.alpha], [case.rayleigh.beta]])
    if case.structure.linear:
        carried = case.carried
        numbers["carried"] = carried.data
        layout |= {"carried.columns": carried.indices, "carried.rows": carried.indptr}
    with suppress(InputError):  # statics needs no mass
        mass = sparse.csr_array(case.mass)
        mass.sort_indices()
        numbers["mass"] = mass.data
        layout |= {"mass.columns": mass.indices, "mass.rows": mass.indptr}
    return Arrays(numbers, layout)


def check_known(seeds: Mapping[str, Any], known: Sequence[str], what: str) -> None:
    """Refuse derivatives with respect to variables through which no gradient is computed."""
    if unknown := [name for name in seeds if name not in known]:
        raise InputError(
            f"there are no derivatives through {', '.join(unknown)} of {what}; variables that "
            f"have them are {', '.join(known)}"
        )


class Differentiated:
    """A result of a case, with gradients of functions of the result.

    Attributes
    ----------
    result : xarray.Dataset
        The dataset that the function of the analysis returns.
    """

    result: xarray.Dataset

    def numbers(self, case: Case) -> Arrays:
        """Numbers of a case with respect to which gradients are taken."""
        return numbers_of(case)

    def backward(self, seeds: Mapping[str, Any]) -> Gradient:
        """Gradient of a function of the result with respect to the numbers of the case.

        seeds : derivatives of the function with respect to variables of the result.
        """
        raise InputError(
            "has no derivatives by variables of this result; give measures by their names"
        )

    def beside(self, case: Case) -> xarray.Dataset:
        """Result of a slightly different case, to be differenced."""
        raise InputError(
            "has derivatives of paths only; vary the parameters by fd.sweep, or take a path with "
            "the load in question"
        )


def numbers_of_motion(packed: PackedCase, start: tuple[NDArray, NDArray]) -> Arrays:
    """Numbers that define a case as packed for motions, and the initial state."""
    arrays, system, mass = arrays_of_body(packed.body), packed.system, packed.mass
    numbers = {
        **arrays.numbers,
        "loads": system.loads.value,
        "moved": system.moved.value,
        "mass": mass.data,
        "hidden": mass.hidden,
        "alpha": np.array([system.alpha]),
        "start.displacement": start[0],
        "start.velocity": start[1],
    }
    ties = system.ties
    if len(ties.slave):  # no solver differentiates ties
        numbers["constraints"] = ties.masters.value
    waves = system.waves._asdict()
    waves = {f"histories.{key}": np.asarray(waves[key]) for key in waves if key != "address"}
    layout = {
        **arrays.layout,
        **waves,
        "loads.dofs": system.loads.dof,
        "loads.histories": system.loads.row,
        "moved.dofs": system.moved.dof,
        "mass.columns": mass.indices,
        "mass.rows": mass.indptr,
        "order": system.order,
        "constraints.slaves": ties.slave,
        "constraints.masters": ties.masters.dof,
    }
    return Arrays(numbers, layout)


def nothing(case: Case, pullback: Pullback) -> dict[str, NDArray]:
    """Gradient of zeros with respect to a case's numbers; `pullback` is the body's."""
    others = numbers_of(case).numbers.items()
    known = {name: array for name, array in others if name.startswith(DIFFERENTIATED)}
    return {name: np.zeros_like(array) for name, array in {**pullback.gradient, **known}.items()}


class Slope(NamedTuple):
    """Derivatives of a case's numbers with respect to a parameter.

    by : for each array of numbers, their derivatives (numbers, count) with respect to all entries.
    """

    by: Mapping[str, sparse.csr_array]
    count: int

    def pulled(self, gradient: Gradient) -> NDArray:
        """Derivatives (count,) with respect to the parameter, from the gradient by numbers."""
        out = np.zeros(self.count)
        for name, by in self.by.items():
            if by.nnz:
                out += by.T @ np.ravel(_known(gradient, name))
        return out


class Parameters:
    """Parameters of a design at the point where its gradient is taken.

    Parameters
    ----------
    build : callable
        Returns a case from values of the parameters.
    values : mapping
        Numbers, or arrays of one dimension.
    steps : mapping
        Sizes of parameters, needed for parameters that are 0; steps are a thousandth of the size.
    """

    def __init__(self, build: Build, values: Values, steps: Values) -> None:
        self.build, self.values, self.steps = build, checked(values), steps
        for name, size in steps.items():
            if name not in self.values:
                raise InputError(f".{name}: there is no such parameter", "sizes")
            least = LEAST * np.abs(self.values[name])
            if not (np.less_equal(least, size) & np.greater(size, 0.0)).all():
                needed = f", and at least {least.max():.3g}" if least.any() else ""
                raise InputError(
                    f".{name} = {show(size)}: give a size above 0{needed}: differences take a "
                    "thousandth of it, and rounding would hide how the case changes",
                    "sizes",
                )

    def case(self, changes: Values | None = None) -> Any:
        """The case, with some values changed."""
        given = {**self.values, **(changes or {})}
        try:
            return self.build(**{k: v if v.ndim else float(v) for k, v in given.items()})
        except TypeError as error:
            raise InputError(f": build cannot take these parameters ({error})", "build") from error

    def size(self, name: str) -> NDArray:
        """Size of a parameter's entries, in the parameter's shape."""
        value = self.values[name]
        if name in self.steps:
            return np.broadcast_to(np.asarray(self.steps[name], float), value.shape)
        own = np.abs(value)
        common = own.max(initial=0.0)
        if not common:
            raise InputError(
                f" = 0: says nothing of how large a change for differences should be; give a "
                f'size, such as sizes={{"{name}": 1.0}}',
                name,
            )
        return np.where(own > LEAST * common, own, common)

    def moved(self, name: str, direction: NDArray, by: float) -> Any:
        """The case with a parameter moved by a multiple of a direction."""
        try:
            return self.case({name: self.values[name] + by * direction})
        except FoldynError as error:
            raise InputError(
                f": cannot be changed by {by:.1g} of its size, which differences need: {error}; "
                "move it away from its bound, or give a smaller size",
                name,
            ) from error

    def slopes(
        self, numbers_of: Callable[[Any], Arrays], steps: Sequence[float] = (STEP,)
    ) -> dict[str, Slope]:
        """Derivatives of the numbers of the case with respect to each parameter.

        steps : steps of differences, tried in turn until the numbers are smooth within a step.
        """
        here = numbers_of(self.case())
        return {name: self._slope(name, numbers_of, here, steps) for name in self.values}

    def _slope(
        self, name: str, numbers_of: Callable[[Any], Arrays], here: Arrays, steps: Sequence[float]
    ) -> Slope:
        """Derivatives of the numbers of a case with respect to one parameter."""
        value, size = self.values[name], self.size(name)

        def at(direction: NDArray, by: float) -> Mapping[str, NDArray]:
            found = numbers_of(self.moved(name, direction, by))
            check_layout(name, here, found)
            return found.numbers

        def change(direction: NDArray) -> dict[str, NDArray]:
            for step in steps:
                near = at(direction, step), at(direction, -step)
                far = at(direction, 2.0 * step), at(direction, -2.0 * step)
                if all(_smooth(*(one[key] for one in (*near, *far))) for key in here.numbers):
                    break
            found = {}
            for key, each in here.numbers.items():
                ahead, behind, far_ahead, far_behind = (one[key] - each for one in (*near, *far))
                if _kinked(each, ahead, behind, far_ahead, far_behind):
                    warn(KINK.format(name, key), "gradients.md#where-there-is-no-gradient")
                rise = 8.0 * (ahead - behind) - (far_ahead - far_behind)
                found[key] = _seen(rise / (12.0 * step), each)
            return found

        entry = {key: np.zeros(np.shape(each), np.int64) for key, each in here.numbers.items()}
        if value.size > 1 and (entry := self._told_apart(at, size, here.numbers)) is None:
            return self._one_by_one(change, size)
        by, own = {}, np.ravel(size)
        for key, each in change(size).items():
            row = np.flatnonzero((each != 0.0) & (entry[key] >= 0))
            place = np.ravel(entry[key])[row]
            slopes = np.ravel(each)[row] / own[place]
            by[key] = sparse.csr_array((slopes, (row, place)), (each.size, value.size))
        return Slope(by, value.size)

    def _told_apart(
        self, at: Callable[[NDArray, float], Mapping[str, NDArray]], size: NDArray,
        here: Mapping[str, NDArray],
    ) -> dict[str, NDArray] | None:  # fmt: skip
        """Entry on which each number depends, -1 for none; None if a number depends on several."""
        count = len(size)
        groups = next(m for m in range(2, 64) if math.comb(m, m // 2) >= count)
        sets = list(islice(combinations(range(groups), groups // 2), count))
        sought = np.array([0, *(sum(1 << group for group in own) for own in sets)])
        order = np.argsort(sought)
        irregular = size * (0.5 + np.arange(1, count + 1) * GOLDEN % 1.0)  # changes never cancel
        found = {key: np.zeros(np.shape(each), np.int64) for key, each in here.items()}
        for group in range(groups):
            moved = at(irregular * [group in own for own in sets], STEP)
            for key, each in moved.items():
                changed = _seen((each - here[key]) / STEP, here[key]) != 0.0
                found[key] += changed.astype(np.int64) << group
        entry = {}
        for key, each in found.items():
            place = order[np.minimum(np.searchsorted(sought, each, sorter=order), count)]
            if (sought[place] != each).any():
                return None
            entry[key] = place - 1
        return entry

    def _one_by_one(self, change: Callable[[NDArray], dict[str, NDArray]], size: NDArray) -> Slope:
        """Derivatives of the numbers with respect to each entry, changed one at a time."""
        columns = [change(alone) for alone in np.diag(size)]
        by = {
            key: sparse.csr_array(np.stack([np.ravel(one[key]) for one in columns], 1) / size)
            for key in columns[0]
        }
        return Slope(by, len(size))


def _smooth(ahead: NDArray, behind: NDArray, far_ahead: NDArray, far_behind: NDArray) -> bool:
    """Whether changes of numbers in two steps are nearly twice the changes in one step."""
    one, two = ahead - behind, far_ahead - far_behind
    return bool((np.abs(two - 2.0 * one) <= SMOOTH * np.abs(one).max(initial=0.0)).all())


def _kinked(
    here: NDArray, ahead: NDArray, behind: NDArray, far_ahead: NDArray, far_behind: NDArray
) -> bool:
    """Whether slopes jump; then the even part of a change is linear in the step, not quadratic.

    Rounding, of numbers that are 0 by symmetry, does not grow with the step. The arguments after
    `here` are changes of the numbers, one and two steps ahead and behind.
    """
    bent, far = np.abs(ahead + behind), np.abs(far_ahead + far_behind)
    rise = np.abs(ahead - behind).max(initial=0.0)
    least = max(1e-3 * rise, 1e-8 * np.abs(here).max(initial=0.0))
    return bool(((bent > least) & (far > 1.5 * bent) & (far < 3.0 * bent)).any())


def _seen(rate: NDArray, here: NDArray) -> NDArray:
    """Derivative of numbers, set to 0 where it is round-off."""
    size = np.abs(here)
    rounding = SILENT[0] * size + SILENT[1] * size.max(initial=0.0)
    return np.where(np.abs(rate) > rounding, rate, 0.0)


def _known(gradient: Gradient, name: str) -> NDArray:
    """Gradient with respect to the named array of numbers; refuses an unknown name."""
    if name not in gradient:
        raise InputError(
            f"the design changes numbers of the case ({name}) that have no derivatives; "
            "keep them fixed, or vary the parameters by fd.sweep"
        )
    return gradient[name]


def checked(values: Values, argument: str = "parameters") -> dict[str, NDArray]:
    """Check values of parameters, and return them as arrays."""
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
    """Refuse a parameter that changes more of a case than its numbers."""
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
