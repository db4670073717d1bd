"""The chain rule from measures to parameters, by way of the result and the numbers of the case."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import InputError, within
from foldyn.gradients.expressions import Expression
from foldyn.gradients.measures import Derivative, Seeds
from foldyn.gradients.parameters import SHORTER, STEP, Differentiated, Parameters
from foldyn.mechanics.pullback import Arrays
from foldyn.sweeps.measure import Asked

SAME, ROUNDING = 1e-6, 1e-9  # derivatives may differ by these shares of them, and of the value


class Wanted(NamedTuple):
    """A quantity to differentiate: an expression of measures, and each measure's derivative."""

    text: str
    expression: Expression
    measures: dict[str, tuple[Asked, Derivative]]


def _add(seeds: dict[Any, Any], variable: Any, seed: Any, share: float) -> None:
    """Add a share of the derivatives with respect to one variable of a result to `seeds`."""
    if isinstance(seed, Mapping):  # nested: see `path.PathGradient`
        own = seeds.setdefault(variable, {})
        for key, each in seed.items():
            _add(own, key, each, share)
    else:
        seeds[variable] = seeds.get(variable, 0.0) + share * np.asarray(seed)


class _Changes(NamedTuple):
    """Derivatives of a quantity.

    They are taken with respect to variables of the result (`seeds`), parameters (`explicit`) and
    numbers of the case (`numbers`).
    """

    seeds: Seeds
    explicit: dict[str, NDArray]
    numbers: dict[str, NDArray]

    def add(self, other: _Changes, share: float) -> None:
        """Add a share of the derivatives of another quantity."""
        for own, more in zip(self, other, strict=True):
            for key, each in more.items():
                _add(own, key, each, share)


class Chain(NamedTuple):
    """Everything needed for values and gradients of measures."""

    found: Differentiated
    case: Case
    design: Parameters
    slopes: dict[str, Any]
    cut: bool  # whether cut lengths of bars are among the parameters
    shared: dict[Any, Any]  # intermediate results shared by measures
    beside: Mapping[str, list[dict[str, NDArray]]]  # derivatives of measures that are differenced

    def of(self, one: Wanted) -> tuple[float, dict[str, NDArray]]:
        """Value of a quantity, and derivatives with respect to all entries of each parameter."""
        values = {
            name: measure.number(self.found.result, self.case, self.shared)
            for name, (measure, _) in one.measures.items()
        }
        value, parts = one.expression.value_and_slopes(values)
        total = _Changes({}, {}, {})
        for name, (measure, derivative) in one.measures.items():
            with within(f"{measure.text}: "):
                if parts[name]:  # a zero factor needs no derivative
                    total.add(self._of_measure(measure, derivative, values[name]), parts[name])
        with within(f"{one.text}: "):
            return value, self._by_parameters(total)

    def _of_measure(self, measure: Asked, derivative: Derivative, value: float) -> _Changes:
        """Derivatives of a measure; for an extreme, they must agree at all places that reach it."""
        if derivative.cut and self.cut:
            raise InputError(
                "has no derivative by bar_length, the lengths to which bars are cut; leave it out "
                "of the parameters, or take another measure, such as displacement"
            )
        if derivative.beside:
            first, *others = self.beside[measure.text]
            for other in others:
                self._check_same(first, other, len(others) + 1, value)
            return _Changes({}, first, {})
        places: list[dict[str, Any]] = [{}]
        if derivative.places:
            found = derivative.places(self._subject(measure), self.case, **measure.arguments)
            places = [{"at": place} for place in found]
        one = self._at(measure, derivative, places[:1], np.ones(1))
        if len(places) > 1:
            shares = np.random.default_rng(0).dirichlet(np.ones(len(places) - 1))
            other = self._at(measure, derivative, places[1:], shares)
            left, right = (self._by_parameters(each) for each in (one, other))
            self._check_same(left, right, len(places), value)
        return one

    def _check_same(
        self, one: Mapping[str, NDArray], other: Mapping[str, NDArray], count: int, value: float
    ) -> None:
        """Refuse an extreme whose derivatives differ between places that reach it."""
        left, right = (
            np.concatenate([by * self.design.size(name).ravel() for name, by in each.items()])
            for each in (one, other)
        )
        size = max(np.abs(left).max(), np.abs(right).max())
        if np.abs(left - right).max() > SAME * size + ROUNDING * abs(value):
            raise InputError(
                f"is reached at {count} places at once, which separate as the design changes: it "
                "has no derivative; take a measure of one place, or mean_square"
            )

    def _subject(self, measure: Asked) -> Any:
        """The result, or the intermediate result of a measure."""
        return self.shared.get(measure.measure.through, self.found.result)

    def _at(
        self, measure: Asked, derivative: Derivative, places: Sequence[dict[str, Any]],
        shares: NDArray,
    ) -> _Changes:  # fmt: skip
        """Weighted sum of the derivatives of a measure at some places."""
        total, frozen = _Changes({}, {}, {}), []
        for place, share in zip(places, shares.tolist(), strict=True):
            given = {**place, **measure.arguments}
            seeds, numbers = derivative.seeds(self.found.result, self.case, **given), {}
            if derivative.numbers:
                numbers = derivative.numbers(self._subject(measure), self.case, **given)
            total.add(_Changes(seeds, {}, dict(numbers)), share)
            if derivative.frozen:
                own = derivative.frozen(self._subject(measure), self.case, **given)
                frozen.append((share, own))
        if frozen:

            def value(case: Case) -> dict[str, float]:
                return {"": sum(share * own(case) for share, own in frozen)}

            total.explicit.update(differenced(self.design, value, SHORTER)[""])
        return total

    def _by_parameters(self, changes: _Changes) -> dict[str, NDArray]:
        """Derivatives with respect to all entries of each parameter."""
        seeds = changes.seeds
        gradient = dict(self.found.backward(seeds)) if seeds else self._nothing
        for key, by in changes.numbers.items():
            _add(gradient, key, by, 1.0)
        more, slopes = changes.explicit, self.slopes.items()
        return {name: slope.pulled(gradient) + more.get(name, 0.0) for name, slope in slopes}

    @property
    def _nothing(self) -> dict[str, NDArray]:
        """Gradient of zeros with respect to the numbers of the case."""
        numbers = self.found.numbers(self.case).numbers
        return {name: np.zeros_like(array) for name, array in numbers.items()}


def differenced(
    design: Parameters, values: Callable[[Case], Mapping[str, float]], steps: Sequence[float]
) -> dict[str, dict[str, NDArray]]:
    """Derivatives of some functions of the case with respect to all entries of each parameter."""

    def numbers(case: Case) -> Arrays:
        return Arrays({text: np.array([value]) for text, value in values(case).items()}, {})

    slopes = design.slopes(numbers, steps)
    return {
        text: {name: slope.by[text].toarray()[0] for name, slope in slopes.items()}
        for text in next(iter(slopes.values())).by
    }


def beside(
    found: Differentiated, case: Case, design: Parameters, wanted: Sequence[Wanted],
    shared: dict[Any, Any],
) -> dict[str, list[dict[str, NDArray]]]:  # fmt: skip
    """Derivatives of the measures that are differenced, at each place that reaches them.

    All are found from the same results beside. `shared`: see `Chain`.
    """
    numbers: dict[str, list[Callable[[Any], float]]] = {}
    through: dict[str, Any] = {}
    for one in wanted:
        for measure, derivative in one.measures.values():
            if derivative.beside:
                measure.number(found.result, case, shared)
                text, through[measure.text] = measure.text, measure.measure.through
                subject = shared.get(through[text], found.result)
                with within(f"{text}: "):
                    numbers[text] = derivative.beside(subject, case, **measure.arguments)

    def values(other: Case) -> dict[str, float]:
        with within(f"{', '.join(numbers)}: "):
            near = found.beside(other)
        subjects = {each: each(near, other) if each else near for each in {*through.values()}}
        return {
            f"{text}{k}": number(subjects[through[text]])
            for text, own in numbers.items()
            for k, number in enumerate(own)
        }

    if not numbers:
        return {}
    rates = differenced(design, values, [STEP])
    return {text: [rates[f"{text}{k}"] for k in range(len(own))] for text, own in numbers.items()}
