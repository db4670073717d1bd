"""The largest Lyapunov exponent of a simulated motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.dynamics import initial_state
from foldyn.periodic.equation import Equation
from foldyn.periodic.sections import strobe_of
from foldyn.results.periodic_dataset import exponent_dataset
from foldyn.values import whole

if TYPE_CHECKING:
    import xarray

AT_ONCE = 32  # periods that are simulated in one go
BATCHES = 8  # of periods, from whose means the uncertainty is taken


def lyapunov_exponent(
    case: Case, periods: int = 500, skip: int = 100, *, initial: State | None = None, seed: int = 0
) -> xarray.Dataset:
    """Mean rate at which motions near a simulated one leave it: above 0 it is chaotic.

    A deviation follows the equation linearized about the motion, integrated along with it and
    brought back to size 1 after each period (Benettin, Galgani, Giorgilli and Strelcyn, Meccanica
    15, 1980).

    Parameters
    ----------
    case : Case
        As for `periodic_motion`.
    periods : int
        Of the drive, over which the mean is taken,
    skip : int
        after as many that pass.
    initial : State, optional
        Start of the motion; rest by default.
    seed : int
        Of the first deviation, which is random.

    Returns
    -------
    xarray.Dataset
        `exponent` (1/s); `uncertainty`, the standard error of the mean of eight parts of the
        motion; `growth` (period), the logarithm of the growth in each period.

    Raises
    ------
    InputError
        As of `periodic_motion`.
    """
    periods, skip = whole("periods", periods, least=BATCHES), whole("skip", skip, least=0)
    equation = Equation(case, "lyapunov_exponent", drifts=True)
    strobe = strobe_of(case, "lyapunov_exponent")
    deviations = _Deviations(equation, strobe.per_period, strobe.dt)
    rng = np.random.default_rng(whole("seed", seed, least=0))
    deviation, state = rng.normal(size=2 * equation.size), initial
    growth = np.empty(0)
    while len(growth) < skip + periods:
        count = min(AT_ONCE, skip + periods - len(growth))
        run = strobe.run(count, 1, state)
        state, motion = initial_state(run), run["displacement"].values
        for k in range(0, count * strobe.per_period, strobe.per_period):
            deviation = deviations.after(motion[k : k + strobe.per_period + 1], deviation)
            size = deviations.size(deviation)
            deviation, growth = deviation / size, np.append(growth, np.log(size))
    growth = growth[skip:]
    rates = growth / strobe.period
    means = [part.mean() for part in np.array_split(rates, BATCHES)]
    facts = {"skip": skip, "periods": periods, "frequency": 1.0 / strobe.period, "dt": strobe.dt}
    uncertainty = float(np.std(means, ddof=1) / np.sqrt(BATCHES))
    return exponent_dataset(case, float(rates.mean()), uncertainty, growth, facts)


class _Deviations:
    """Small deviations (x, v) from a motion, by the classical Runge-Kutta method."""

    def __init__(self, equation: Equation, steps: int, dt: float) -> None:
        self.equation, self.dt, self.count = equation, dt, equation.size
        self._at = equation.at(2.0 * np.pi * np.arange(steps + 1) / steps)
        inverse = np.linalg.inv(equation.mass)
        self._inverse, self._damping = inverse, inverse @ equation.damping
        self._time = steps * dt / (2.0 * np.pi)

    def size(self, y: NDArray) -> float:
        """Norm of a deviation, velocities times the period over 2 pi."""
        return float(
            np.hypot(np.linalg.norm(y[: self.count]), self._time * np.linalg.norm(y[self.count :]))
        )

    def after(self, displacement: NDArray, y: NDArray) -> NDArray:
        """Deviation after a period along displacements (steps + 1, n, 3) of all nodes."""
        k, h = self.count, 2.0 * self.dt
        stiffness = self._inverse @ self._at.tangents(
            self.equation.unknowns(displacement, self._at)
        )

        def rate(at: NDArray, y: NDArray) -> NDArray:
            return np.concatenate([y[k:], -at @ y[:k] - self._damping @ y[k:]])

        for first, middle, last in zip(
            stiffness[:-2:2], stiffness[1:-1:2], stiffness[2::2], strict=True
        ):
            one = rate(first, y)
            two = rate(middle, y + 0.5 * h * one)
            three = rate(middle, y + 0.5 * h * two)
            four = rate(last, y + h * three)
            y = y + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        return y
