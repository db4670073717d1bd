"""Quantities sampled along a motion: the user's own, and contact forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.motion_state import Samples
from foldyn.errors import FoldynError, InputError
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.results import Quantity
from foldyn.results.dataset import TAKEN
from foldyn.results.quantities import CONTACT, TENSION
from foldyn.values import show

CONTACT_FORCE, PLANE_FORCE = CONTACT


class SamplingError(FoldynError):
    """A function returned a value that cannot be stored, at a sample after the first."""


class Sampler:
    """Values of quantities along a motion.

    Parameters
    ----------
    case : Case
    given : mapping of str to callable or Quantity
        See the argument `sample` of `simulate`.
    u, v : ndarray, shape (n, 3)
        Initial state, at which each function is tested.
    start : float
        Initial time, s.

    Raises
    ------
    InputError
        A name that results already use, or a function that fails or does not return a finite number
        or array with the dimensions that it declares.
    """

    def __init__(self, case: Case, given: Any, u: NDArray, v: NDArray, start: float) -> None:
        structure, given, own = case.structure, check_given(given), forces_inside(case)
        taken = {*TAKEN, *case.energy_groups, *own}
        sizes = {"node": len(structure.nodes), "axis": 3, "support": len(case.reaction_dofs)}
        self._quantities: dict[str, tuple[Quantity, tuple[int, ...]]] = {}  # with their shapes
        for name, what in {**given, **own}.items():
            free = isinstance(name, str) and name.isidentifier() and name not in taken
            if name in given and not free:
                raise InputError(f": {name!r} is not free; choose another name", "sample")
            quantity = what if isinstance(what, Quantity) else Quantity(function=what)
            try:
                shape = _value(quantity, u, v, start).shape
            except SamplingError as error:
                raise InputError(f": {error}", f"sample.{name}") from error.__cause__
            dims = quantity.dims or tuple(f"{name}_{k}" for k in range(len(shape)))
            known = tuple(sizes.setdefault(*pair) for pair in zip(dims, shape, strict=False))
            if len(dims) != len(shape) or known != shape:
                raise InputError(
                    f": returned an array of shape {shape}, which does not fit its dimensions "
                    f"({', '.join(dims)})",
                    f"sample.{name}",
                )
            self._quantities[name] = quantity._replace(dims=dims), shape
        self.clear()

    def clear(self) -> None:
        """Drop all values."""
        self.drop(0)

    def drop(self, count: int) -> None:
        """Drop the values of the first `count` samples and continue with the next sample."""
        self._values: dict[str, list[NDArray]] = {name: [] for name in self._quantities}
        self._first = self._taken = count

    @property
    def rows(self) -> dict[str, tuple[int, ...]]:
        """Shape of each quantity at a sample."""
        return {name: shape for name, (_, shape) in self._quantities.items()}

    @property
    def known(self) -> dict[str, Quantity]:
        """The quantities, with their dimensions."""
        return {name: quantity for name, (quantity, _) in self._quantities.items()}

    def take(self, samples: Samples, count: int) -> None:
        """Evaluate the quantities at new samples up to `count`; raises SamplingError."""
        for k in range(self._taken, count):
            i = k - samples.first
            state = samples.displacement[i], samples.velocity[i], float(samples.time[i])
            for name, (quantity, shape) in self._quantities.items():
                try:
                    value = _value(quantity, *state)
                    if value.shape != shape:
                        raise SamplingError(f"returned an array of shape {value.shape}")
                except SamplingError as error:
                    place = f"sample.{name}, at t = {state[2]:.6g} s"
                    raise SamplingError(f"{place}: {error}") from error.__cause__
                self._values[name].append(value)
            self._taken = k + 1

    def columns(self, count: int) -> dict[str, NDArray]:
        """Values at those samples up to `count` that were not dropped; nan where missing."""
        columns, count = {}, count - self._first
        for name, (_, shape) in self._quantities.items():
            column, values = np.full((count, *shape), np.nan), self._values[name][:count]
            column[: len(values)] = np.reshape(values, (-1, *shape))
            columns[name] = column
        return columns


def check_given(sample: Any) -> Mapping[str, Any]:
    """The argument `sample` of `simulate`, with the types checked; empty for None."""
    if not isinstance(sample, Mapping | None):
        raise InputError(f" = {show(sample)}: give functions by name, as {{'tip': f}}", "sample")
    return sample or {}


def _value(quantity: Quantity, u: NDArray, v: NDArray, time: float) -> NDArray:
    """Value at a state; the function gets copies, so that it cannot change the state."""
    if not callable(quantity.function):
        raise SamplingError("has no function: give one of (displacement, velocity, time)")
    try:
        given = quantity.function(u.copy(), v.copy(), time)
    except Exception as error:
        raise SamplingError(f"the function raised {type(error).__name__}: {error}") from error
    try:
        value = np.array(given, float)
    except (TypeError, ValueError):
        raise SamplingError(f"returned {show(given)}; give a number or an array") from None
    if not np.isfinite(value).all():
        raise SamplingError(f"returned {show(given)}; give finite numbers")
    return value


def forces_inside(case: Case) -> dict[str, Quantity]:
    """Quantities that are sampled with bars, cables and contact; empty without these."""
    lines = case.lines

    def pulls(u: NDArray, v: NDArray, time: float) -> NDArray:
        assert lines is not None
        return lines.at(lambda history: float(history(time))).pulls(u)

    def term_at(time: float) -> ContactTerm:
        moved = case.planes_moved(float(history(time)) for _, history in case.obstacle_terms)
        return case.contact_term.displaced(moved)

    own = {} if lines is None else {"tension": TENSION._replace(function=pulls)}
    functions: dict[str, Any] = {}
    if case.contact is not None:
        functions[CONTACT_FORCE] = lambda u, v, time: term_at(time).touch(u)
        if case.contact.planes:
            functions[PLANE_FORCE] = lambda u, v, time: term_at(time).plane_forces(u)
    return own | {name: CONTACT[name]._replace(function=f) for name, f in functions.items()}
