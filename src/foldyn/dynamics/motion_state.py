"""State, step plan and samples of a motion: the arguments of integrators."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar
from foldyn.materials.inelastic_law import VARIABLES


class Outcome(IntEnum):
    """How a stretch of compiled steps ended."""

    DONE = 0
    NOT_FINITE = 1
    PENETRATION = 2
    FULL = 3  # there is no room for another sample
    STUCK = 4  # the error requires a step below the resolution of time
    NOT_CONVERGED = 5  # an implicit step could not be solved, however short


SHORTEST = 1e-6  # contact may not shorten steps below this part of a fixed step
WORK, DISSIPATED, AIR, WRONG, HINGE, OUTCOME = range(6)  # columns of a member's notes for its team


class StepPlan(NamedTuple):
    """Steps and samples. Fixed step n ends at start + n dt; variable steps go on until `end`."""

    start: float  # s
    end: float  # s
    dt: float  # fixed step, or the largest variable step, s
    steps: int  # number of fixed steps; 0 if steps vary
    every: int  # steps between samples; if 0, samples are `interval` apart
    interval: float  # s
    tolerance: float  # relative error per step; 0 with a fixed step
    floor: float  # least displacement that errors are relative to, m
    stops: NDArray  # sorted times (s) at which variable steps end: knots of the histories


# counters of a motion: steps done, samples written, steps rejected, force evaluations
COUNTED = ("steps", "samples", "refused", "evaluations")
# Measured values: work of the loads, energy dissipated and lost to the air (J), and the powers of
# these at the last step (W). The time reached; for variable steps, the next step wanted and the
# last, shortest and longest step (s), and the error of the last step divided by the tolerance. The
# largest displacement (m), velocity (m/s) and kinetic energy (J) so far
MEASURED = (
    "work", "dissipated", "air", "power_in", "power_out", "power_air", "time", "wanted", "last",
    "shortest", "longest", "error", "farthest", "fastest", "kinetic",
)  # fmt: skip
TALLY = np.dtype(
    (np.record, [(n, np.int64) for n in COUNTED] + [(n, np.float64) for n in MEASURED])
)


class MotionState(NamedTuple):
    """State of a motion between two stretches of steps, which update it in place."""

    u: NDArray  # (n, 3) displacement without support motion, m
    v: NDArray  # (n, 3) velocity without support motion, m/s
    carry: NDArray  # (n, 3) acceleration, for methods that store it
    tally: np.record  # record of type `TALLY`
    angle: NDArray  # (nh,) dihedrals at the last checked step, rad


class Samples(NamedTuple):
    """Room for k samples, the first of which is number `first`; s supported dofs."""

    time: NDArray  # (k,) s
    displacement: NDArray  # (k, n, 3)
    velocity: NDArray  # (k, n, 3)
    reaction: NDArray  # (k, s)
    energy: NDArray  # (k, columns) energies as `audit.audited` names them, J
    memory: NDArray  # (k, b, 2) states of the b branches of laws with memory
    first: int  # number of earlier samples, stored elsewhere

    @property
    def end(self) -> int:
        """Number of the first sample beyond the room."""
        return self.first + len(self.time)

    def doubled(self) -> Samples:
        """These samples, with twice the room."""
        arrays = (np.concatenate([array, np.empty_like(array)]) for array in self[:-1])
        return Samples._make((*arrays, self.first))

    def until(self, number: int) -> Samples:
        """The samples with lower numbers than this."""
        arrays = (array[: number - self.first] for array in self[:-1])
        return Samples._make((*arrays, self.first))


def samples(count: int, nodes: int, supported: int, energies: int, branches: int = 0) -> Samples:
    """Room for `count` samples."""
    sizes = (), (nodes, 3), (nodes, 3), (supported,), (energies,), (branches, VARIABLES)
    return Samples._make((*(np.empty((count, *size)) for size in sizes), 0))


@inner_scalar
def passed_through(now, before, first, last):
    """Index of a hinge from first to last - 1 whose dihedral has jumped by more than pi, or -1.

    Overwrites the dihedrals `before` (nh,) with `now`.
    """
    jumps = 0
    for e in range(first, last):
        jumps += abs(now[e] - before[e]) > np.pi
    if jumps > 0:
        for e in range(first, last):
            if abs(now[e] - before[e]) > np.pi:
                return e
    for e in range(first, last):
        before[e] = now[e]
    return -1


@inner_scalar
def split_step(longest, left):
    """Length (s), at most `longest`, of the equal parts that divide the interval `left`."""
    if longest >= left:
        return left
    return left / math.ceil(min(left / max(longest, SHORTEST * left), 1.0 / SHORTEST))


@inner_scalar
def post_totals(team, work_in, work_out, work_air, wrong):
    """Note for the team the work, the energies lost (J), and the number of non-finite values."""
    note = team.note[team.number]
    note[WORK], note[DISSIPATED], note[AIR], note[WRONG] = work_in, work_out, work_air, wrong
