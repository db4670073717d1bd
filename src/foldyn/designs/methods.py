"""Optimization methods for designs; all entries of a design are scaled to the range 0 to 1."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import BFGS, Bounds, NonlinearConstraint, minimize

from foldyn.arguments import Check, Checked
from foldyn.designs.search import BAD, Ended, Search, Trial
from foldyn.errors import optional
from foldyn.values import number, whole

SPREAD = 0.25
"""Standard deviation of the first generation of CMA-ES, in scaled entries."""


@dataclass(frozen=True)
class Settings(Checked):
    """Settings that all methods share.

    Parameters
    ----------
    tolerance : float
        Relative change of the objective at which a search ends.
    slack : float
        Relative violation of a constraint up to which it counts as satisfied.
    max_evaluations : int
        Most evaluations of a search.
    seed : int
        Random seed of stochastic methods.
    """

    tolerance: Annotated[float, Check(number, above=0.0, below=1.0)]
    slack: Annotated[float, Check(number, above=0.0, below=1.0)]
    max_evaluations: Annotated[int, Check(whole, least=1)]
    seed: Annotated[int, Check(whole, least=0, most=2**31)]


@dataclass(frozen=True)
class Method:
    """An optimization method.

    Attributes
    ----------
    run : callable
        Searches from a guess; returns why the search ended, and whether at an optimum.
    gradient : bool
        Whether the method needs derivatives.
    doc : str
    needs : str
        Module that must be installed.
    """

    run: Callable[[Search, NDArray, Settings], tuple[str, bool]]
    gradient: bool
    doc: str
    needs: str = ""

    def check(self) -> None:
        """Refuse a method whose module is not installed."""
        if self.needs:
            optional(self.needs, f"this method needs {self.needs}", "foldyn[design]")


def _slsqp(search: Search, x: NDArray, settings: Settings) -> tuple[str, bool]:
    equal = search.problem.equal
    kinds = ("eq", equal, 1.0), ("ineq", ~equal, -1.0)
    constraints = [
        {
            "type": kind,
            "fun": lambda x, own=own, sign=sign: sign * search.at(x).excess[own],
            "jac": lambda x, own=own, sign=sign: sign * search.at(x).slopes[own],
        }
        for kind, own, sign in kinds
        if own.any()
    ]
    found = minimize(
        lambda x: search.at(x).objective, x, jac=lambda x: search.at(x).slope, method="SLSQP",
        bounds=[(0.0, 1.0)] * len(x), constraints=constraints, callback=search.step,
        options={"ftol": settings.tolerance, "maxiter": settings.max_evaluations},
    )  # fmt: skip
    return str(found.message), bool(found.success)


def _trust_constr(search: Search, x: NDArray, settings: Settings) -> tuple[str, bool]:
    constraints = []
    if search.problem.constraints:
        least = np.where(search.problem.equal, 0.0, -np.inf)
        constraints.append(
            NonlinearConstraint(
                lambda x: search.at(x).excess, least, 0.0, jac=lambda x: search.at(x).slopes,
                hess=BFGS(),
            )
        )  # fmt: skip
    with warnings.catch_warnings():  # slopes of a failed design are those of the last good design
        warnings.filterwarnings("ignore", "delta_grad == 0.0", UserWarning)
        found = minimize(
            lambda x: search.at(x).objective, np.clip(x, 1e-3, 1.0 - 1e-3),
            jac=lambda x: search.at(x).slope, method="trust-constr", hess=BFGS(),
            bounds=Bounds(0.0, 1.0, keep_feasible=True), constraints=constraints,  # type: ignore
            callback=search.step,
            options={
                "gtol": settings.tolerance, "xtol": settings.tolerance,
                "barrier_tol": settings.tolerance, "maxiter": settings.max_evaluations,
            },
        )  # fmt: skip
    return str(found.message), found.status in (1, 2)


def _mma(search: Search, x: NDArray, settings: Settings) -> tuple[str, bool]:
    """Run NLopt's method of moving asymptotes; an augmented Lagrangian handles equalities."""
    nlopt = optional("nlopt", "MMA needs nlopt", "foldyn[design]")
    last: list[Trial] = []

    def objective(x: NDArray, slope: NDArray) -> float:
        found = search.at(x)
        if not last or found is not last[0]:
            search.step()
        last[:] = [found]
        slope[:] = found.slope[: slope.size]  # empty if only the value is wanted
        return found.objective

    def excess(k: int) -> Callable[[NDArray, NDArray], float]:
        def one(x: NDArray, slope: NDArray) -> float:
            found = search.at(x)
            slope[:] = found.slopes[k][: slope.size]
            return float(found.excess[k])

        return one

    def solver(algorithm: int) -> Any:
        made = nlopt.opt(algorithm, len(x))
        made.set_lower_bounds(0.0)
        made.set_upper_bounds(1.0)
        made.set_ftol_rel(settings.tolerance)
        made.set_xtol_rel(settings.tolerance)
        return made

    whole = solver(nlopt.LD_MMA)
    if search.problem.equal.any():
        inner, whole = whole, solver(nlopt.AUGLAG_EQ)
        inner.set_ftol_rel(1e2 * settings.tolerance)
        whole.set_local_optimizer(inner)
    whole.set_min_objective(objective)
    for k, equal in enumerate(search.problem.equal):
        add = whole.add_equality_constraint if equal else whole.add_inequality_constraint
        add(excess(k), 0.5 * settings.slack)
    try:
        whole.optimize(x)
    except nlopt.RoundoffLimited:
        return "progress is limited by rounding", True
    reasons = {
        nlopt.FTOL_REACHED: "the objective no longer changes",
        nlopt.XTOL_REACHED: "the design no longer changes",
    }
    reason = whole.last_optimize_result()
    return reasons.get(reason, f"NLopt's result {reason}"), reason in reasons


def _cma(search: Search, x: NDArray, settings: Settings) -> tuple[str, bool]:
    """Run CMA-ES, with constraints in an augmented Lagrangian (Atamna et al. 2017)."""
    cma = optional("cma", "CMA-ES needs cma", "foldyn[design]")
    handler = optional("cma.constraints_handler", "CMA-ES needs cma", "foldyn[design]")
    drawn = np.random.RandomState(settings.seed + search.number)
    options: dict[str, Any] = {
        "bounds": [0.0, 1.0], "randn": drawn.randn, "seed": np.nan, "verbose": -9,
        "verb_log": 0, "tolfun": settings.tolerance, "tolx": 1e-2 * settings.tolerance,
    }  # fmt: skip
    n = len(x)
    first = x if n > 1 else np.append(x, 0.5)  # cma does not support a single variable
    strategy = cma.CMAEvolutionStrategy(first, SPREAD, options)
    count = len(search.problem.constraints)
    lagrangian = handler.AugmentedLagrangian(len(first), search.problem.equal)
    lagrangian.logging = 0
    while not strategy.stop():
        designs = strategy.ask()
        found = [search.at(one[:n]) for one in designs]
        if count:
            mean = search.at(np.clip(strategy.mean[:n], 0.0, 1.0))
            sound = [one for one in found if one.objective < BAD] or [mean]
            excess = [one.excess for one in sound]
            lagrangian.set_coefficients([one.objective for one in sound], excess)
            lagrangian.update(mean.objective, mean.excess)
        penalties = [sum(lagrangian(one.excess)) if count else 0.0 for one in found]
        told = [one.objective + more for one, more in zip(found, penalties, strict=True)]
        strategy.tell(designs, told)
        search.step()
    why = ", ".join(strategy.stop())
    return why, bool({"tolfun", "tolx", "tolfunhist", "tolflatfitness"} & {*strategy.stop()})


METHODS: Mapping[str, Method] = {
    "slsqp": Method(_slsqp, True, "sequential quadratic programming (SciPy)"),
    "trust-constr": Method(_trust_constr, True, "interior point in a trust region (SciPy)"),
    "mma": Method(_mma, True, "method of moving asymptotes (NLopt)", "nlopt"),
    "cma": Method(_cma, False, "CMA-ES, without derivatives", "cma"),
}
"""Methods by name."""


def searched(method: str, search: Search, x: NDArray, settings: Settings) -> tuple[str, bool]:
    """Search from a guess; return why the search ended, and whether at an optimum."""
    try:
        search.at(x)
        return METHODS[method].run(search, x, settings)
    except Ended as end:
        return str(end), False
