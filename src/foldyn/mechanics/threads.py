"""Threads that run one compiled function together, each on its share of a model.

All threads run the same function and wait for each other before they use others' results. So a
whole time loop runs on several threads that are started only once, and it is compiled only once: a
single thread waits for nobody. Numba's `prange` would compile it a second time, and its pools of
threads do not survive a fork (GNU OpenMP) or two callers at once (workqueue).
"""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import config
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar, scalar
from foldyn.jit.intrinsics import call0, fetch_add, look
from foldyn.mechanics.model import BarsHinges
from foldyn.mechanics.strips import shares

HINGES_EACH = 4000  # hinges per thread: half as many pay off only on an idle machine
MOST = 8  # largest number of threads; more have not been measured
SPINS = 100  # checks for other members before the processor is yielded
ARRIVED, ROUND, BROKEN = 0, 8, 16  # positions in `Team.state`, each on its own cache line


class Team(NamedTuple):
    """A member of a team of threads."""

    size: int
    number: int  # index of this member, 0..size - 1
    state: NDArray  # (24,) int64, of the whole team
    note: NDArray  # (size, 8), a cache line of notes from each member to the others
    pause: int  # see `_pause`


class ThreadPart(NamedTuple):
    """The part of a body (`mechanics.assembly`) that one thread has."""

    team: Team
    own: NDArray  # (2,) first and last + 1 of its rows
    angle: NDArray  # (nh,) dihedrals of all hinges at the last force evaluation, rad
    fold_angle: NDArray  # (k,) dihedrals of the actuated hinges, rad
    scratch: Any  # scratch of the sheet's kernels
    kept: tuple[Any, ...] = ()  # memory of the other terms


def team(size: int) -> list[Team]:
    """Members of a team of `size` threads."""
    state, note = np.zeros(24, np.int64), np.zeros((size, 8))
    return [Team(size, number, state, note, _pause()) for number in range(size)]


@cache
def _pause() -> int:
    """Address of the system function that yields the processor."""
    if os.name == "nt":
        function = ctypes.windll.kernel32.SwitchToThread  # type: ignore[attr-defined]
    else:
        function = ctypes.CDLL(None).sched_yield
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def threads_for(model: BarsHinges) -> int:
    """Number of threads that run a motion of the model fastest: one below 8000 hinges.

    Never more than NUMBA_NUM_THREADS (by default the processors that this process may use) or
    OMP_NUM_THREADS, or than the reach of the model's elements permits.
    """
    allowed = [MOST, int(config.NUMBA_NUM_THREADS)]  # type: ignore[attr-defined]
    text = os.environ.get("OMP_NUM_THREADS", "")
    if text.isdigit():
        allowed.append(int(text))
    return len(shares(model, min(*allowed, len(model.hinges) // HINGES_EACH))) - 1


def run_together(function: Any, members: Sequence[Team], arguments: Sequence[tuple]) -> list:
    """Run a compiled function on each member of a team with its own arguments; return the results.

    The function must be compiled with `shared`: threads that hold Python's lock would wait for each
    other forever. The caller's thread is the first member. An exception on one thread ends the
    waiting of all and is raised; the team is then spent.
    """
    results: list[Any] = [None] * len(members)
    failures: list[BaseException] = []

    def run(number: int) -> None:
        try:
            results[number] = function(*arguments[number])
        except BaseException as failure:
            failures.append(failure)
            members[number].state[BROKEN] = 1

    others = [threading.Thread(target=run, args=(number,)) for number in range(1, len(members))]
    started: list[threading.Thread] = []
    try:
        for thread in others:
            thread.start()
            started.append(thread)
        run(0)
    except BaseException:  # a thread that cannot start must end the waiting of others
        members[0].state[BROKEN] = 1
        raise
    finally:
        for thread in started:
            thread.join()
    if failures:
        raise failures[0]
    return results


@inner
def _wait(team):
    """Count this round's arrivals; the last one starts the next round."""
    now = look(team.state, ROUND)
    if fetch_add(team.state, ARRIVED, 1) == team.size - 1:
        fetch_add(team.state, ARRIVED, -team.size)
        fetch_add(team.state, ROUND, 1)
        return
    spins = 0
    while look(team.state, ROUND) == now and look(team.state, BROKEN) == 0:
        spins += 1
        if spins > SPINS:
            call0(team.pause)


@inner_scalar
def wait(team):
    """Wait until all members have arrived; then everything they wrote before is visible."""
    if team.size > 1:
        _wait(team)


@inner_scalar
def total(team, k):
    """Sum of note k over all members, in the same order on each, after a `wait`."""
    out = 0.0
    for member in range(team.size):
        out += team.note[member, k]
    return out


@inner_scalar
def largest(team, k):
    """Largest note k of all members, after a `wait`."""
    out = team.note[0, k]
    for member in range(1, team.size):
        out = max(out, team.note[member, k])
    return out


@scalar
def part(team, count):
    """First and last + 1 of this member's share of `count` items."""
    return count * team.number // team.size, count * (team.number + 1) // team.size
