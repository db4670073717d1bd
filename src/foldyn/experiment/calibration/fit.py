"""`fit`: least squares over parameters of a case; every evaluation of the model is kept."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from foldyn.errors import ComputationError, InputError, quietly, warn
from foldyn.experiment.calibration.fit_problem import Finer, Problem, problem
from foldyn.experiment.calibration.fitted import Descent, Fit, Uncertainty, score
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.parameters import Parameter
from foldyn.sweeps.evaluations import Evaluation, Evaluations
from foldyn.sweeps.pool import Pool, pool_of
from foldyn.values import number, whole

PREDICTED = "predicted"  # name under which an evaluation stores its predictions
SLOPES = "slopes"  # name of the derivatives of predictions with respect to parameters


class Point(NamedTuple):
    """A point to evaluate.

    Attributes
    ----------
    values : tuple of float
        Values of the parameters.
    runs : tuple of int, optional
        Runs to compute, without derivatives; by default all runs, with derivatives.
    second : bool
        Whether derivatives have second-order accuracy, which intervals need.
    """

    values: tuple[float, ...]
    runs: tuple[int, ...] | None = None
    second: bool = False


def evaluate(problem: Problem, point: Point) -> Evaluation:
    """Predictions at a point, with derivatives if requested."""
    began, values = time.perf_counter(), np.array(point.values)
    try:
        if point.runs is None:
            found = problem.differentiate(values, point.second)
            parts = dict(zip((PREDICTED, SLOPES), found, strict=True))
        else:
            parts = {PREDICTED: problem.predict(values, point.runs)}
        found, why = {name: np.concatenate(part) for name, part in parts.items()}, ""
    except (InputError, ComputationError) as error:
        found, why = {}, str(error)
    return Evaluation(found, why, seconds=time.perf_counter() - began)


# Change of a parameter, in its scale, for a difference quotient: well above the solvers' noise.
STEP = 1e-3
ENOUGH = 1e-5  # a search ends at this relative change of the parameters
LEVEL = 1e-8  # a search ends at this relative decrease of the cost
TRIED = 60  # largest number of steps of a search
# Reasons for the end of a search, by the status of `least_squares`.
WHY = {
    0: f"given up after {TRIED} steps",
    1: "the cost has no slope left",
    2: "the cost falls no more",
    3: "the parameters move no more",
    4: "neither cost nor parameters move any more",
}

MOST_PROCESSES = 1024  # largest number of processes; a larger one must be a typing error

COUNTED = ("computed", "found")  # attributes of a `Course` that count evaluations
# all predictions in one array, or the reason why there are none
Outcome = NDArray[np.float64] | str


@dataclass(frozen=True)
class Course:
    """Progress of a fit.

    Attributes
    ----------
    computed, found : int
        Number of evaluations of the model that were computed, and that were found stored.
    cost : float
        Smallest cost so far.
    """

    computed: int
    found: int
    cost: float


def fit(
    case: str | os.PathLike[str],
    data: Sequence[Measurement],
    *,
    parameters: Sequence[Parameter],
    ties: Mapping[str, str] | None = None,
    searches: int = 1,
    seed: int = 0,
    processes: int = 1,
    confidence: float = 0.95,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[Course], None] | None = None,
) -> Fit:
    """Fit parameters of a case to measurements by least squares.

    Every numeric key of the case file can be a parameter; the file is reread for each new value.
    Searches use the trust-region method of `scipy.optimize.least_squares` with bounds, in scaled
    parameters. Derivatives of paths, modes, frequency responses and implicit motions are computed
    along with the result, without rerunning the model; explicit motions use difference quotients of
    whole motions.

    Parameters
    ----------
    case : path
        A case file of kind "statics", "dynamics", "modes" or "frf".
    data : sequence of Measurement
        `ForceDisplacement`, `Shapes`, `Measured`, `TimeHistory`, `Spectrum`, `NaturalFrequencies`,
        `DampingRatios`, `ModeShapes`, `FrequencyResponse`.
    parameters : sequence of Parameter
    ties : mapping of str to str, optional
        Keys that depend on parameters, such as
        ``{"model.fold_law.theta2": "360 - model.fold_law.theta1"}``.
    searches : int
        Number of searches: the first begins from the given values, the others from random values
        within the bounds.
    seed : int
        Random seed of the guesses.
    processes : int
        Number of evaluations that run in parallel.
    confidence : float
        Confidence level of the intervals, by Student's t; 0.95 by default.
    folder : path, optional
        Keeps every evaluation, so that an interrupted fit resumes.
    progress : callable, optional
        Called with a `Course` after every evaluation.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        An argument or a file cannot be used; the message says what and why.
    ComputationError
        No search converged.

    Warns
    -----
    FoldynWarning
        The time step of a motion, or the mesh of a shell, shifts a parameter by more than its
        standard error; a measured mode matches no single mode of the model; the search was given
        up.

    Notes
    -----
    A motion is computed with fixed steps, because adaptive steps would make the misfit jump: with
    `analysis.dt`, or if that is missing and the method is implicit, with the interval of the
    output. At the end the motion is recomputed with half the step, and intervals are widened by the
    change.
    """
    confidence = number("confidence", confidence, above=0.0, below=1.0)
    whole("processes", processes, least=1, most=MOST_PROCESSES)
    made = problem(case, data, parameters, {} if ties is None else ties)
    points = made.space.guesses(searches, seed)
    began = time.perf_counter()
    with pool_of(partial(evaluate, made), processes) as pool:
        search = _Search(made, pool, folder, progress)
        if processes > 1 and searches > 1:
            descents = _at_a_time(min(searches, processes), pool, search, points)
        else:
            descents = [search.descend(point) for point in points]
        lowest = min(descents, key=lambda one: one.cost)
        if not math.isfinite(lowest.cost):
            raise ComputationError(f"no search converged: {lowest.message}")
        values = np.array(lowest.values)
        known = search.uncertainty(values, confidence)
        (best,) = search.at([values])
        ends = np.cumsum([len(one) for one in made.observed()])
        predicted = np.split(np.asarray(best), ends[:-1])
        shifts = search.shifts(values, known)
        again = tuple(search.quotients(values))
    if not lowest.converged:
        _warn(
            f"the search was {lowest.message}: these values do not minimize the misfit, and their "
            "intervals mean nothing yet; begin from these values, or nearer to the truth"
        )
    _warn_of_pairing(made, values)
    return Fit(
        known.estimates(made.space.keys, values, shifts), known.correlation, known.singular_values,
        known.directions, confidence, known.freedom, known.misfit,
        tuple(map(score, made.measurements, predicted)), tuple(descents), made, tuple(predicted),
        search.count, time.perf_counter() - began, again,
    )  # fmt: skip


def _at_a_time(
    count: int, pool: Pool, search: _Search, points: NDArray[np.float64]
) -> list[Descent]:
    """Search from several guesses in threads, which end if the calling thread is interrupted."""
    with ThreadPoolExecutor(count) as threads:
        try:
            return list(threads.map(search.descend, points))
        except BaseException:
            pool.stop()  # evaluations that threads wait for fail
            threads.shutdown(cancel_futures=True)
            raise


class _Search:
    """A search for the smallest misfit, in scaled parameters."""

    def __init__(
        self, made: Problem, pool: Pool, folder: str | os.PathLike[str] | None,
        progress: Callable[[Course], None] | None,
    ) -> None:  # fmt: skip
        self.made, self.progress, self.cost = made, progress, math.inf
        self.folder, self.all = folder, []
        self.evaluations = self._evaluations(made, pool)
        space = made.space
        self.scale = space.column("scale")
        self.lower, self.upper = space.column("lower"), space.column("upper")
        observed = made.observed()
        weights = [(not one.held_out) / one.errors() for one in made.measurements]
        self.weight = np.concatenate(weights)
        self.absorbed = sum(one.absorbed for one in made.measurements if not one.held_out)
        self.chosen = self.weight > 0.0
        self.observed = np.concatenate(observed)
        runs = {i: k for k, run in enumerate(made.runs) for i in run.members}
        self.run = np.repeat([runs[i] for i in range(len(observed))], [len(o) for o in observed])

    def _evaluations(self, made: Problem, pool: Pool) -> Evaluations[Point]:
        digest = made.digest()
        new = Evaluations[Point](pool, lambda point: [digest, *point], self.folder, self._tell)
        self.all.append(new)
        return new

    @property
    def count(self) -> int:
        """Number of evaluations."""
        return sum(one.computed + one.found for one in self.all)

    def _tell(self, *_: object) -> None:
        if self.progress is not None:
            computed, found = (sum(getattr(one, name) for one in self.all) for name in COUNTED)
            self.progress(Course(computed, found, self.cost))

    def at(self, points: Sequence[NDArray], runs: tuple[int, ...] | None = None) -> list[Outcome]:
        """Predictions at several points, in parallel if there are several processes."""
        found = self.evaluations.at([Point(tuple(map(float, point)), runs) for point in points])
        return [one.failure or one.values[PREDICTED] for one in found]

    def descend(self, guess: NDArray[np.float64]) -> Descent:
        """Search from a guess."""
        begin = tuple(guess.tolist())
        (first,) = self.at([guess])
        try:
            if isinstance(first, str):
                raise ComputationError(first)
            end = least_squares(
                lambda z: self._residual([z * self.scale])[0],
                guess / self.scale,
                lambda z: self._jacobian(z * self.scale, both_sides=False),
                bounds=(self.lower / self.scale, self.upper / self.scale),
                xtol=ENOUGH, ftol=LEVEL, gtol=1e-12, max_nfev=TRIED,
            )  # fmt: skip
        except ComputationError as error:
            return Descent(begin, begin, math.inf, 1, str(error), False)
        values = tuple((end.x * self.scale).tolist())
        why = WHY[end.status]
        return Descent(begin, values, float(end.cost), int(end.nfev), why, end.status > 0)

    def uncertainty(self, values: NDArray[np.float64], confidence: float) -> Uncertainty:
        """Uncertainty of the parameters at the end of a search."""
        jacobian = self._jacobian(values, both_sides=True)
        near = STEP * self.scale
        at_bound = (values - self.lower < near) | (self.upper - values < near)
        (residual,) = self._residual([values])
        return Uncertainty.of(jacobian, residual, self.scale, at_bound, confidence, self.absorbed)

    def shifts(self, values: NDArray[np.float64], known: Uncertainty) -> list[NDArray[np.float64]]:
        """Shifts of the estimates in the limit of small time steps and elements.

        The misfit at the optimum is recomputed with half the time step, and with half the element
        size. From each change, `influence` gives the shift of the optimum, and Richardson's
        extrapolation the limit. Doubts about the extrapolation are added as shifts to both sides.
        """
        found = []
        coarse = np.asarray(self.at([values])[0])
        for finer in self.made.finer(values):
            fine = self._outcome(finer.problem, values)
            if isinstance(fine, str):
                _warn(
                    f"at the values found, the model fails with a finer {finer.what} "
                    f"({fine}): the intervals do not include the error of the {finer.what}"
                )
                found.append(np.full(len(values), np.nan))
                continue
            change = ((fine - coarse) * self.weight)[self.chosen]
            shift = known.influence @ change / (1.0 - 0.5**finer.order)
            large = np.abs(shift) > known.standard_error
            doubt = np.zeros(len(large))
            if large.any():
                doubt = self._doubt(finer, values, shift, known)
            doubt[~(doubt > known.standard_error)] = 0.0
            for k in np.flatnonzero(large):
                _warn(
                    f"{self.made.space.keys[k]}: the {finer.what} is too coarse: it shifts the "
                    f"value by about {-shift[k]:.2g}, more than the standard error "
                    f"({known.standard_error[k]:.2g}). {_width(finer, doubt[k])}; for a better "
                    f"value set {finer.remedy}"
                )
            found += [shift, doubt, -doubt]
        return found

    def _doubt(
        self, finer: Finer, values: NDArray[np.float64], shift: NDArray[np.float64],
        known: Uncertainty,
    ) -> NDArray[np.float64]:  # fmt: skip
        """Distance between the estimates of a much finer model and the extrapolated estimates.

        At the shifted values, the finer model must fit, apart from its own remaining discretization
        error.
        """
        there = np.clip(values + shift, self.lower, self.upper)
        predicted = self._outcome(finer.proof, there)
        if isinstance(predicted, str):  # the model fails at the shifted values
            return np.abs(shift)
        left = known.influence @ ((predicted - self.observed) * self.weight)[self.chosen]
        expected = values + shift * (1.0 - float(finer.times) ** -finer.order) - there
        return np.abs(left - expected)

    def _outcome(self, made: Problem, values: NDArray[np.float64]) -> Outcome:
        """Predictions of another model."""
        with pool_of(partial(evaluate, made), 1) as pool:
            every = tuple(range(len(made.runs)))
            (found,) = self._evaluations(made, pool).at([Point(tuple(values.tolist()), every)])
        return found.failure or found.values[PREDICTED]

    def _residual(
        self, points: list[NDArray[np.float64]], runs: tuple[int, ...] | None = None
    ) -> list[NDArray[np.float64]]:
        """Weighted residuals; infinite if the model fails, so that a search steps back."""
        residuals = []
        for predicted in self.at(points, runs):
            if isinstance(predicted, str):
                residuals.append(np.full(int(self.chosen.sum()), np.inf))
                continue
            residual = ((predicted - self.observed) * self.weight)[self.chosen]
            self.cost = min(self.cost, 0.5 * float(residual @ residual))
            residuals.append(residual)
        return residuals

    def _jacobian(self, values: NDArray[np.float64], both_sides: bool) -> NDArray[np.float64]:
        """Derivatives of the residuals with respect to scaled parameters."""
        of = self.run[self.chosen]
        slopes, runs = self._slopes(values, False)
        if both_sides and not np.isin(of, runs).all():
            slopes, runs = self._slopes(values, True)
        jacobian = slopes[self.chosen] * self.scale * self.weight[self.chosen, None]
        if runs:
            again = np.isin(of, runs)
            jacobian[again] = self._quotients(values, runs, again, both_sides)
        return jacobian

    def _slopes(
        self, values: NDArray[np.float64], second: bool
    ) -> tuple[NDArray[np.float64], tuple[int, ...]]:
        """Derivatives of all predictions, and the runs without derivatives."""
        (found,) = self.evaluations.at([Point(tuple(map(float, values)), None, second)])
        slopes = found.values[SLOPES]
        lost = self.chosen & np.isnan(slopes).any(axis=1)
        return slopes, tuple(np.unique(self.run[lost]).tolist())

    def quotients(self, values: NDArray[np.float64]) -> list[str]:
        """Names of fitted measurements whose derivatives are difference quotients of whole runs."""
        runs, every = self._slopes(values, False)[1], self.made.measurements
        members = {i for k in runs for i in self.made.runs[k].members}
        return [every[i].name for i in sorted(members) if not every[i].held_out]

    def _quotients(
        self, values: NDArray[np.float64], runs: tuple[int, ...], rows: NDArray, both_sides: bool
    ) -> NDArray[np.float64]:
        """Rows of the Jacobian as difference quotients of whole runs, with points within bounds."""
        parts = self.made.space.differences(values, both_sides, STEP)
        points = [part.point for part in parts if part.point[part.place] != values[part.place]]
        residuals = self._residual(points, runs)
        at = {tuple(point): one[rows] for point, one in zip(points, residuals, strict=True)}
        at[tuple(values)] = self._residual([values])[0][rows]
        columns = np.zeros((int(rows.sum()), len(values)))
        with np.errstate(invalid="ignore"):  # inf - inf where the model fails
            for part in parts:
                weight = part.weight * self.scale[part.place]
                columns[:, part.place] += weight * at[tuple(part.point)]
        if not np.isfinite(columns).all():
            failed = np.array(next(one for one in at if not np.isfinite(at[one]).all()))
            place = int(np.argmax(failed != values))
            (why,), key = self.at([failed], runs), self.made.space.keys[place]
            raise ComputationError(f"{key}: the model fails near {values[place]:.6g}: {why}")
        return columns


def _width(finer: Finer, doubt: float) -> str:
    """Describe how far the interval of a coarse model can be trusted."""
    if not doubt:
        proven = finer.proof is not finer.problem
        where = "" if proven else f", if its error has order {finer.order}"
        return f"The interval is wide enough for both{where}"
    return (
        f"A finer {finer.what} disagrees with that by {doubt:.2g}: the interval is wider by "
        "as much on both sides, and may still miss the truth"
    )


def _warn_of_pairing(made: Problem, values: NDArray[np.float64]) -> None:
    """Warn if the pairing of modes has become ambiguous during the fit."""
    try:
        with quietly():
            made.examine(values)
    except InputError as error:
        _warn(f"at the values found: {error}")


def _warn(text: str) -> None:
    warn(text, "calibration.md#method")
