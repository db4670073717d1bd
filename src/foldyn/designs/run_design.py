"""`design`: optimize parameters under bounds and constraints, in Python or from a case file."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

import foldyn
from foldyn.analyses import CaseFile
from foldyn.analyses.keys import files_moved, replaced, value_at
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.designs.evaluator import Evaluate, Measured, Point, Source, measured
from foldyn.designs.methods import METHODS, Settings, searched
from foldyn.designs.problem import Problem, Space, problem_of, space_of
from foldyn.designs.result import Design, End, history_of
from foldyn.designs.search import Ended, Row, Search
from foldyn.errors import ComputationError, InputError, warn
from foldyn.sweeps.evaluations import Evaluation, Evaluations
from foldyn.sweeps.pool import Here
from foldyn.values import MOST, choice, whole
from foldyn.writing import write_text

FLAT = 1e-12
"""If the objective changes by less than this fraction between the bounds, it counts as constant."""
MOST_DRAWN = 20
"""Most designs that are drawn to find a guess that can be computed."""


@dataclass(frozen=True)
class Course:
    """Progress of a search.

    Attributes
    ----------
    done, found : int
        Number of evaluations, and how many of them were found in the folder.
    search : int
        Number of the search.
    objective, violation : float
        Values of the best design so far; nan if there is none yet.
    """

    done: int
    found: int
    search: int
    objective: float
    violation: float


@dataclass(frozen=True, eq=False)
class Plan:
    """A checked design search.

    Attributes
    ----------
    problem : Problem
    space : Space
    first : ndarray
        Entries of the first guess.
    evaluator : Measured
    method : str
    settings : Settings
    searches : int
    """

    problem: Problem
    space: Space
    first: NDArray
    evaluator: Measured
    method: str
    settings: Settings
    searches: int


def design(
    build: Source,
    bounds: Mapping[str, Any],
    *,
    minimize: str | None = None,
    maximize: str | None = None,
    subject_to: str | Sequence[str] = (),
    analysis: Mapping[str, Any] | None = None,
    guess: Mapping[str, Any] | None = None,
    method: str = "slsqp",
    searches: int = 1,
    seed: int = 0,
    tolerance: float = 1e-6,
    slack: float = 1e-4,
    max_evaluations: int = 1000,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[Course], None] | None = None,
) -> Design:
    """Find parameters that make an expression of measures as small or large as possible.

    Parameters
    ----------
    build : callable or path
        ``build(**parameters)`` returns the case; or a case file, with parameters named by keys of
        the file, such as "pattern.panel_angle".
    bounds : mapping
        Parameters by name, each with a lower and an upper bound. For an array, a bound is a list
        with a number for each entry, or one number for all entries if `guess` gives the array.
    minimize, maximize : str
        Exactly one of the two: an expression of measures as in a sweep, such as
        "-frequency[2] / frequency[1]", with ``+ - * / **``, parentheses, min, max, abs, sqrt, log
        and exp.
    subject_to : sequence of str
        Constraints: expressions with "==", "<=" or ">=", such as "mass <= 0.1".
    analysis : mapping
        Analysis of a built case: its kind, "modes", "dynamics", "statics" or "frf", and arguments
        of `modes`, `simulate`, `trace` or `frf`. A case file contains its own analysis.
    guess : mapping, optional
        Values to begin from, by default the middle between the bounds.
    method : {"slsqp", "trust-constr", "mma", "cma"}
        The first three use exact derivatives, see `sensitivity`; "mma" needs NLopt. "cma" (CMA-ES)
        needs no derivatives, but some hundred times as many evaluations.
    searches : int
        Number of searches. The first starts from `guess`, the others from random designs within the
        bounds.
    seed : int
        Random seed of the other guesses and of CMA-ES.
    tolerance : float
        A search ends when the objective changes by less than this, relative to its size at the
        first design.
    slack : float
        A constraint holds if its violation is below this, relative to the constraint's size: the
        side that is a number, or else the larger side at the first design.
    max_evaluations : int
        Most evaluations of each search.
    folder : path, optional
        Folder that keeps every evaluation, so that an interrupted search can resume.
    progress : callable, optional
        Called with a `Course` after every evaluation.

    Returns
    -------
    Design
        The best of all evaluated feasible designs, with the history of all searches:
        ``best["parameters"]``, ``best["history"]``.

    Raises
    ------
    InputError
        An argument cannot be used, or the first design gives no case or lacks a measure.
    ComputationError
        No guess can be computed.

    Warns
    -----
    FoldynWarning
        No design is feasible: the design with the least violation is returned.

    Notes
    -----
    A design that cannot be computed does not end a search: the method takes a shorter step, and the
    history says why. CMA-ES enforces constraints, and MMA equalities, by an augmented Lagrangian.
    """
    plan = plan_of(
        build, bounds, minimize, maximize, subject_to, analysis, guess, method, searches, seed,
        tolerance, slack, max_evaluations,
    )  # fmt: skip
    return designed(plan, folder, progress)


def plan_of(
    build: Source, bounds: Any, minimize: Any, maximize: Any, subject_to: Any, analysis: Any,
    guess: Any, method: str, searches: int, seed: int, tolerance: float, slack: float,
    max_evaluations: int,
) -> Plan:  # fmt: skip
    """Check the arguments of `design`; raises `InputError`."""
    problem = problem_of(minimize, maximize, subject_to)
    space, first = space_of(bounds, guess)
    METHODS[choice("method", method, METHODS)].check()
    settings = Settings(tolerance, slack, max_evaluations, seed)
    whole("searches", searches, least=1, most=MOST)
    evaluator = measured(build, analysis, problem.places, space, METHODS[method].gradient)
    return Plan(problem, space, first, evaluator, method, settings, searches)


def designed(
    plan: Plan,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[Course], None] | None = None,
) -> Design:
    """Run a plan; arguments as in `design`."""
    began = time.perf_counter()
    gradient = METHODS[plan.method].gradient
    evaluate = Evaluate(plan.evaluator, plan.space, gradient)
    with Here[Point, Evaluation](evaluate) as pool:
        evaluations = Evaluations[Point](pool, evaluate.stamp, folder)
        search = Search(
            plan.problem, plan.space, evaluations, gradient, plan.settings.slack,
            plan.settings.max_evaluations, lambda: _tell(search, progress),
        )  # fmt: skip
        ends = []
        for k in range(plan.searches):
            search.begin(k)
            x = _first(plan, search, k)
            message, converged = searched(plan.method, search, x, plan.settings)
            ends.append(_end(k, search, message, converged))
            if k == 0 and search.rows[0].failure and search.sizes is None:
                plan.evaluator(plan.space.values(search.rows[0].point), gradient)  # raises
    if search.best is None:
        raise ComputationError(f"no guess can be computed: {search.rows[0].failure}")
    return _found(plan, search, search.best, ends, time.perf_counter() - began)


def _first(plan: Plan, search: Search, number: int) -> NDArray:
    """First design of a search: the given guess, or one drawn until it can be computed."""
    if number == 0:
        return plan.space.x(plan.first)
    drawn = np.random.default_rng([plan.settings.seed, number])
    for _ in range(MOST_DRAWN - 1):
        x = drawn.random(len(plan.first))
        with suppress(Ended):
            search.at(x)
            return x
    return drawn.random(len(plan.first))


def _tell(search: Search, progress: Callable[[Course], None] | None) -> None:
    if progress is None:
        return
    best, found = search.best, search.evaluations.found
    objective, violation = (np.nan, np.nan) if best is None else (best.objective, best.violation)
    progress(Course(len(search.rows), found, search.number, objective, violation))


def _end(number: int, search: Search, message: str, converged: bool) -> End:
    own = [row for row in search.rows if row.search == number]
    sound = [row for row in own if not row.failure]
    if not sound:
        return End(number, np.nan, np.nan, False, len(own), message, False)
    best = min(sound, key=search.key)
    if best is sound[0]:
        why = "no design that was tried is better"
        if _insensitive(search, best):
            why, converged = f"where no parameter changes {search.problem.objective.text}", False
        message = f"{message}; the design stays at its guess, {why}"
    return End(number, best.objective, best.violation, best.feasible, len(own), message, converged)


def _insensitive(search: Search, row: Row) -> bool:
    """Whether all derivatives of the objective are 0, so that no method has a direction."""
    if row.slopes is None or search.sizes is None:
        return False
    change = np.abs(row.slopes[0] * (search.space.upper - search.space.lower)).max()
    return bool(change <= FLAT * search.sizes[0])


def _found(
    plan: Plan, search: Search, best: Row, ends: Sequence[End], seconds: float
) -> Design:  # fmt: skip
    """Result of a search, with a warning if no design is feasible."""
    problem, space = plan.problem, plan.space
    violations = {}
    slacks = (plan.settings.slack * np.asarray(search.sizes)[1:]).tolist()
    for one, difference, slack in zip(problem.constraints, best.numbers[1:], slacks, strict=True):
        amount = one.violation(float(difference))
        violations[one.text] = amount if amount > slack else 0.0
    if not best.feasible:
        violated = [f"{text} by {amount:.3g}" for text, amount in violations.items() if amount]
        warn(
            f"none of {len(search.rows)} designs is feasible; the nearest one violates "
            f"{', '.join(violated)}. Widen the bounds, relax constraints, or take more searches",
            "design-optimization.md#what-comes-back",
        )
    elif _insensitive(search, best) and not ends[best.search].converged:
        warn(
            f"no parameter changes {problem.objective.text} at the best design: it need not be an "
            "optimum; give another guess, or take another objective",
            "design-optimization.md#what-comes-back",
        )
    gradient = {} if best.slopes is None else space.values(best.slopes[0])
    facts = {
        "objective": problem.objective.text, "sense": "min" if problem.sign > 0.0 else "max",
        "method": plan.method, "searches": plan.searches, "seed": plan.settings.seed,
        "tolerance": plan.settings.tolerance, "slack": plan.settings.slack,
        "feasible": int(best.feasible), "seconds": seconds,
    }  # fmt: skip
    return Design(
        space.values(best.point), best.objective, best.feasible, violations, best.values,
        gradient, tuple(ends), history_of(search.rows, best, space, problem, facts),
        len(search.rows), seconds,
    )  # fmt: skip


def planned(path: Path, changes: Mapping[str, Any]) -> tuple[CaseFile, Plan]:
    """Read a case file and the search that its [design] table specifies.

    changes : values that override keys of the table.

    Raises
    ------
    InputError
        The table is missing, or something in it cannot be used.
    """
    document = read_document(path)
    case_file = case_of_document(path, document)
    if case_file.design is None:
        raise InputError(
            ': missing; say what may change and what is wanted, as in [design] minimize = "mass", '
            'subject_to = ["frequency[1] >= 12"], [design.bounds] "sheet.thickness" = [1e-4, 1e-3]',
            "design",
            path,
        )
    asked = case_file.design.values() | dict(changes)
    asked["guess"] = _guesses(document, asked["bounds"]) | (asked["guess"] or {})
    try:
        return case_file, plan_of(path, analysis=None, **asked)
    except InputError as error:
        if error.file is not None:  # an error in the case of the first design
            raise
        raise error.within("design.", path) from None


def _guesses(document: Mapping[str, Any], bounds: Mapping[str, Any]) -> dict[str, Any]:
    """Values from the file, if they are within their bounds."""
    found = {}
    for key, pair in bounds.items():
        value = value_at(document, key)
        try:
            lower, upper = (np.asarray(end, float) for end in pair)
            inside = np.all((lower <= np.asarray(value, float)) & (np.asarray(value) <= upper))
        except (TypeError, ValueError):  # plan_of reports the error
            continue
        if inside and value is not None:
            found[key] = value
    return found


def write_case(case_file: CaseFile, parameters: Mapping[str, Any], path: Path) -> None:
    """Write a case file with the values found; paths in it become relative to the new location."""
    plain = {key: np.asarray(value).tolist() for key, value in parameters.items()}
    document = replaced(read_document(case_file.path), plain)
    way = os.path.relpath(case_file.path.parent.resolve(), path.parent.resolve())
    text = f"# Designed by Foldyn {foldyn.__version__} from {case_file.path.name}.\n"
    write_text(text + tomli_w.dumps(files_moved(document, way)), path)
