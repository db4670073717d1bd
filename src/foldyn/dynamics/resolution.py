"""Whether steps see what loads do: pulses that fall between their ends would be lost silently.

Methods that choose their steps end them at the knots of the histories and look between. With a
fixed step it is told beforehand how far what the method sees of a history lies from the history.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, History
from foldyn.cases.waveforms import CALLED
from foldyn.dynamics.course import StepPlan
from foldyn.errors import FoldynWarning, InputError

NOTICED = 0.01  # part of a load that is not seen, above which the user is told
MOST_STEPS = 20_000  # that are looked at; of longer motions, the steps about knots and some others
MOST_CALLS = 500  # the same for functions of the user's, which are slow
MOST_PLACES = 100
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)


def histories(case: Case) -> Iterator[tuple[str, History]]:
    """Histories of a case that vary, each with what it drives."""
    driven = {
        "a load": case.load_terms,
        "an imposed displacement": case.imposed_terms,
        "a base motion": case.base_terms,
        "an actuation": case.actuation_terms,
    }
    for what, terms in driven.items():
        yield from ((what, history) for _, history in terms if history.kind != "constant")


def knots(case: Case) -> NDArray[np.float64]:
    """Times (s) at which loads, supports or rest angles jump or turn a corner."""
    return np.unique([time for _, history in histories(case) for time in history.knots() or ()])


def jumps(case: Case) -> tuple[float, ...]:
    """Times (s) at which loads jump, or may: those that the user names of a function."""
    found: set[float] = set()
    for _, history in case.load_terms:
        called = history.code == CALLED
        found.update((history.knots() or ()) if called else history.jumps())
    return tuple(sorted(found))


def warn_of_functions(case: Case, stacklevel: int) -> None:
    """Warn of functions of time in which steps that grow can only look here and there."""
    for what, history in histories(case):
        if history.knots() is None:
            warnings.warn(
                f"the history of {what} is a function, and nobody knows when it jumps or turns: "
                "each step looks at it at eight points, and a pulse that is shorter than their "
                "distance may be missed; say when: fd.Function(f, at=[0.2, 0.25]), at=[] if it is "
                "smooth",
                FoldynWarning,
                stacklevel=stacklevel,
            )
            return


def warn_of_coarse_steps(
    case: Case, plan: StepPlan, looks: tuple[float, ...], memory: int, jumps: bool, stacklevel: int
) -> None:
    """Warn where steps of dt do not see a history as it is.

    Parameters
    ----------
    looks : tuple of float
        Where in a step a method looks at the loads, from 0 to 1.
    memory : int
        Steps over which a part that is not seen is compared with what is there: about a vibration.
    jumps : bool
        Whether steps are divided where loads jump.
    """
    for what, history in histories(case):
        share = overlooked(history, plan, looks, memory, jumps)
        if share > NOTICED:
            warnings.warn(
                f"steps of {plan.dt:.3g} s do not resolve the history {history.kind} of {what}: "
                f"what they see of it is off by {share:.0%}; take a smaller dt, or a method that "
                'chooses its steps: "dormand_prince", or an implicit one without dt',
                FoldynWarning,
                stacklevel=stacklevel,
            )


def overlooked(
    history: History, plan: StepPlan, looks: tuple[float, ...], memory: int, jumps: bool
) -> float:
    """Part of a history that fixed steps do not see; see `warn_of_coarse_steps`.

    The largest integral over `memory` steps of the distance between the history and the
    polynomial through the points where it is looked at, over the largest one of the history.
    """
    unseen, whole = 0.0, 0.0
    try:
        for first, last in _stretches(history, plan, memory):
            ends = plan.start + plan.dt * np.arange(first, last + 1)
            if jumps:
                ends = np.union1d(ends, [t for t in history.jumps() if ends[0] < t < ends[-1]])
            gap, size = _integrals(history, ends, looks, jumps)
            unseen = max(unseen, _largest_sum(gap, memory))
            whole = max(whole, _largest_sum(size, memory))
    except InputError:  # a function that fails: the motion will stop there, and say why
        return 0.0
    return unseen / whole if whole > 0.0 else 0.0


def _stretches(history: History, plan: StepPlan, memory: int) -> list[tuple[int, int]]:
    """Stretches of steps (first, last) that are looked at: all, or those where most may happen."""
    turns = history.knots()
    most = MOST_CALLS if turns is None else MOST_STEPS
    if plan.steps <= most:
        return [(0, plan.steps)]
    length = min(2 * memory, most)
    places = np.linspace(0, plan.steps, max(2, most // length))
    if turns:
        at = (np.array(turns) - plan.start) / plan.dt
        at = at[(at > -1.0) & (at < plan.steps + 1.0)]
        places = np.append(places, at[:: max(1, len(at) // MOST_PLACES)])
    firsts = np.clip(places - 0.5 * length, 0, plan.steps - length).astype(np.int64)
    return [(int(first), int(first) + length) for first in np.unique(firsts)]


def _integrals(
    history: History, ends: NDArray, looks: tuple[float, ...], jumps: bool
) -> tuple[NDArray, NDArray]:
    """Integrals over each step between `ends` of what is not seen of a history, and of its size."""
    turns = np.array([t for t in history.knots() or () if ends[0] < t < ends[-1]])
    pieces = np.union1d(ends, turns)
    length = 0.5 * np.diff(pieces)
    times = pieces[:-1, None] + length[:, None] * (1.0 + POINTS)
    step = np.searchsorted(ends, times[:, 0], side="right") - 1
    h = np.diff(ends)
    looked = ends[:-1, None] + h[:, None] * np.array(looks)
    if jumps:  # the end of a step is before a jump there
        looked[:, -1] = np.nextafter(ends[1:], -np.inf)
    values, seen = history(times), history(looked)
    place = (times - ends[step, None]) / h[step, None]
    line = np.zeros_like(values)
    for k, at in enumerate(looks):  # Lagrange's polynomials
        others = [x for x in looks if x != at]
        basis = np.prod([(place - x) / (at - x) for x in others], axis=0)
        line += seen[step, k, None] * basis
    return tuple(
        np.bincount(step, (np.abs(each) @ WEIGHTS) * length, len(h))
        for each in (values - line, values)
    )  # type: ignore[return-value]


def _largest_sum(values: NDArray, count: int) -> float:
    """Largest sum of `count` values in a row."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    count = min(count, len(values))
    return float((sums[count:] - sums[:-count]).max())
