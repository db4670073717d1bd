"""The choice between explicit and implicit integration, with its reason in words.

Both costs are estimated, as the steps that a method needs times what one of them takes. An explicit
method takes steps of half its critical step, whatever moves. An implicit one takes steps that
resolve the motion with the tolerance asked for (see `timescale`) and end at its samples.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.critical_step import critical_step
from foldyn.dynamics.inertia import is_lumped
from foldyn.dynamics.methods import METHODS
from foldyn.dynamics.timescale import frequency, vibrating_share
from foldyn.dynamics.timing import DEFAULT_FRACTION

AUTO = "auto"
LONG = 30.0  # periods from which a motion that nothing damps calls for a method that conserves
CONTENT = 2.0  # times the steps of the vibration itself: faster ones ride on it
FEWEST = 50.0  # steps of an implicit run


class Choice(NamedTuple):
    """A method and why it was chosen."""

    method: str
    reason: str


def choose(
    case: Case, u: NDArray, v: NDArray, start: float, duration: float, dt: float | None,
    every: int | float, tolerance: float | None, default: float,
) -> Choice:  # fmt: skip
    """Choose the method that should be quicker for a motion from u and v (n, 3) at `start`.

    dt, every and tolerance are those of `simulate`, default what implicit methods take without.
    """
    conserved = case.damping.alpha == case.damping.beta == 0.0 and _steady(case)
    implicit = "energy_momentum" if conserved else "generalized_alpha"
    if massless := case.structure.massless:
        return Choice("generalized_alpha", f"implicit: {massless} have no mass")
    if (case.structure.mass.diagonal() <= 0.0)[~case.fixed.all(axis=1)].any():
        return Choice(implicit, "implicit: nodes without mass have no acceleration")
    omega = frequency(case, u, v, duration)
    lasting = conserved and duration * omega > 2.0 * math.pi * LONG
    explicit = "central_difference" if lasting else "rk4"
    if tolerance is not None:
        explicit = "dormand_prince"
    critical = critical_step(case, explicit, u)
    if dt is not None and tolerance is None:
        fits = dt <= critical
        word, name = ("within", explicit) if fits else ("above", implicit)
        kind = "explicit" if fits else "implicit"
        return Choice(name, f"{kind}: dt is {word} the critical step of {critical:.2g} s")
    many = duration / (DEFAULT_FRACTION * critical)
    share = vibrating_share(case, u, v, start, duration, omega)
    few = CONTENT * duration * omega * (share / (12.0 * (tolerance or default))) ** (1.0 / 3.0)
    few = max(few, FEWEST, duration / every if isinstance(every, float) else 0.0)
    costs = (
        many * _explicit_cost(case, METHODS[explicit].evaluations),
        few * _implicit_cost(case, conserved),
    )
    estimate = (
        f"about {_round(many)} explicit steps (critical step {critical:.2g} s) take "
        f"{_seconds(costs[0])}, {_round(few)} implicit ones {_seconds(costs[1])}, by estimate"
    )
    if costs[0] <= costs[1]:
        return Choice(explicit, f"explicit: {estimate}")
    return Choice(implicit, f"implicit: {estimate}")


def _steady(case: Case) -> bool:
    """Whether nothing that acts varies in time."""
    terms = (*case.load_terms, *case.imposed_terms, *case.base_terms, *case.actuation_terms)
    return all(history.kind == "constant" for _, history in terms)


def _explicit_cost(case: Case, evaluations: int) -> float:
    """Seconds of a step, as measured from 39 to 22,000 dofs."""
    substitution = 1.0 if is_lumped(case.structure.mass) else 2.0
    return evaluations * (5e-7 + 2.5e-8 * substitution * case.structure.nodes.size)


def _implicit_cost(case: Case, conserved: bool) -> float:
    """Seconds of a step with its residuals, tangents and factorizations, as measured likewise.

    The conserving method's forces and unsymmetric matrices cost more.
    """
    dofs = case.structure.nodes.size
    factorization = 6e-5 * (dofs / 333.0) ** 1.85
    return (2.5 if conserved else 1.0) * (1e-4 + 1.2e-6 * dofs + 1.5 * factorization)


def _round(count: float) -> str:
    return f"{float(f'{count:.2g}'):,.0f}"


def _seconds(cost: float) -> str:
    return f"{float(f'{cost:.2g}'):,g} s"
