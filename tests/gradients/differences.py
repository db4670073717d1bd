"""Gradients against differences of what they are gradients of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.checks import observed_order
from foldyn.gradients import sensitivity
from foldyn.gradients.run_sensitivity import KINDS
from foldyn.sweeps.measure import asked
from foldyn.sweeps.measures import MEASURES

STEP = 6e-4  # of a parameter
LENGTHS = (2e-2, 2e-3, 2e-4, 2e-5)  # of a Taylor test, over three decades

Build = Callable[..., Any]


class Design:
    """Numbers of an analysis of a case that is built from parameters."""

    step = STEP

    def __init__(
        self, build: Build, values: Mapping[str, Any], measures: list[str], analysis: dict[str, Any]
    ) -> None:
        self.build, self.measures, self.analysis = build, measures, analysis
        self.values = {name: np.asarray(value, float) for name, value in values.items()}

    def numbers(self, change: Mapping[str, Any]) -> NDArray:
        """Numbers (measure,) where parameters are changed by so much."""
        values = {name: value + change.get(name, 0.0) for name, value in self.values.items()}
        case = self.build(**{k: v if v.ndim else float(v) for k, v in values.items()})
        given = {name: value for name, value in self.analysis.items() if name != "kind"}
        result = KINDS[self.analysis["kind"]](case, given).result
        return np.array([float(asked(m, MEASURES).of(result, case, {})) for m in self.measures])

    def gradient(self) -> dict[str, NDArray]:
        """Derivatives (measure,) or (measure, entry) by each parameter."""
        found = sensitivity(self.build, self.values, measures=self.measures, analysis=self.analysis)
        return {name: found[f"gradient_{name}"].values for name in self.values}

    def along(self, direction: Mapping[str, Any]) -> NDArray:
        """Rates (measure,) in a direction, from the gradient."""
        return _along(self.gradient(), direction)

    def difference(self, direction: Mapping[str, Any]) -> NDArray:
        """The same from central differences of the fourth order."""

        def at(by: float) -> NDArray:
            return self.numbers({name: by * rate for name, rate in direction.items()})

        h = self.step
        near, far = at(h) - at(-h), at(2.0 * h) - at(-2.0 * h)
        return (8.0 * near - far) / (12.0 * h)

    def directions(self) -> list[dict[str, Any]]:
        """One along each parameter, and one at random of entries of arrays."""
        chance = np.random.default_rng(len(self.values))
        return [
            {name: value * (chance.uniform(0.2, 1.8, value.shape) if value.ndim else 1.0)}
            for name, value in self.values.items()
        ]

    def errors(self) -> dict[str, float]:
        """Largest relative error of the gradient along each parameter."""
        gradient = self.gradient()
        found = {}
        for direction in self.directions():
            expected, (name,) = self.difference(direction), direction
            assert expected.all(), f"{name} changes nothing"
            error = _along(gradient, direction) / expected - 1.0
            found[name] = float(np.abs(error).max())
        return found

    def order(self, seed: int, lengths: tuple[float, ...] = LENGTHS) -> NDArray:
        """Order (measure,) with which the remainder of Taylor's formula falls, at random."""
        chance = np.random.default_rng(seed)
        self.values = {
            name: value * chance.uniform(0.9, 1.1, value.shape)
            for name, value in self.values.items()
        }
        direction = {
            name: value * chance.uniform(-1.0, 1.0, value.shape)
            for name, value in self.values.items()
        }
        here, rate = self.numbers({}), self.along(direction)
        left = [
            self.numbers({name: h * one for name, one in direction.items()}) - here - h * rate
            for h in lengths
        ]
        return np.array([observed_order(lengths, each) for each in np.array(left).T])


def _along(gradient: Mapping[str, NDArray], direction: Mapping[str, Any]) -> NDArray:
    rates = [
        gradient[name] @ np.atleast_1d(rate) if gradient[name].ndim > 1 else gradient[name] * rate
        for name, rate in direction.items()
    ]
    return np.sum(rates, axis=0)
