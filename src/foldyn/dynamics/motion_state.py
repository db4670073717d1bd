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
    FULL = 3  # no room for another sample
    STUCK = 4  # the error requires a step below the resolution of time
    NOT_CONVERGED = 5  # an implicit step could not be solved, however small


SHORTEST = 1e-6  # part of a fixed step: shorter contact steps are not taken
WORK, DISSIPATED, AIR, WRONG, HINGE, OUTCOME = range(6)  # columns of a member's notes to its team


class StepPlan(NamedTuple):
    """Steps and samples. A fixed step n is at start + n dt; variable steps use `end`."""

    start: float  # s
    end: float  # s
    dt: float  # the step, or the largest one, s
    steps: int  # of a fixed step; else 0
    every: int  # steps between samples; 0: samples are `interval` apart
    interval: float  # s
    tolerance: float  # relative error per step; 0 with a fixed step
    floor: float  # least displacement that errors are relative to, m
    stops: NDArray  # times (s) in order at which variable steps end: knots of the histories


# counters of a motion: steps done, samples written, steps rejected, force evaluations
COUNTED = ("steps", "samples", "refused", "evaluations")
# What is measured: work of the loads, energy dissipated and lost to the air (J), their powers at
# the last step (W); the time reached, and of steps that vary the next one wanted, the last,
# shortest and longest (s); the last one's error over the tolerance; the largest displacement (m),
# velocity (m/s) and kinetic energy (J) so far
MEASURED = (
    "work", "dissipated", "air", "power_in", "power_out", "power_air", "time", "wanted", "last",
    "shortest", "longest", "error", "farthest", "fastest", "kinetic",
)  # fmt: skip
TALLY = np.dtype(
    (np.record, [(n, np.int64) for n in COUNTED] + [(n, np.float64) for n in MEASURED])
)


class MotionState(NamedTuple):
    """State of a motion between two stretches of steps, updated in place."""

    u: NDArray  # (n, 3) displacement without support motion, m
    v: NDArray  # (n, 3) velocity likewise, m/s
    carry: NDArray  # (n, 3) acceleration, for methods that store it
    tally: np.record  # `TALLY`
    angle: NDArray  # (nh,) dihedrals at the last checked step, rad


class Samples(NamedTuple):
    """Room for k samples from number `first` on; s supported dofs."""

    time: NDArray  # (k,) s
    displacement: NDArray  # (k, n, 3)
    velocity: NDArray  # (k, n, 3)
    reaction: NDArray  # (k, s)
    energy: NDArray  # (k, columns) as `audit.audited` names them
    memory: NDArray  # (k, b, 2) states of the b branches of laws with memory
    first: int  # number of earlier samples, stored elsewhere

    @property
    def end(self) -> int:
        """Number of the first sample that no longer fits."""
        return self.first + len(self.time)

    def doubled(self) -> Samples:
        """These samples, with twice the room."""
        arrays = (np.concatenate([array, np.empty_like(array)]) for array in self[:-1])
        return Samples._make((*arrays, self.first))

    def until(self, number: int) -> Samples:
        """The samples before this number."""
        arrays = (array[: number - self.first] for array in self[:-1])
        return Samples._make((*arrays, self.first))


def samples(count: int, nodes: int, supported: int, energies: int, branches: int = 0) -> Samples:
    """Room for `count` samples."""
    return Samples(
        np.empty(count),
        np.empty((count, nodes, 3)),
        np.empty((count, nodes, 3)),
        np.empty((count, supported)),
        np.empty((count, energies)),
        np.empty((count, branches, VARIABLES)),
        0,
    )


@inner_scalar
def passed_through(now, before, first, last):
    """Index of a hinge from first to last - 1 whose dihedral jumped by more than pi, or -1.

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
    """Length (s), at most `longest`, of the equal parts of the interval `left`."""
    if longest >= left:
        return left
    return left / math.ceil(min(left / max(longest, SHORTEST * left), 1.0 / SHORTEST))


@inner_scalar
def post_totals(team, work_in, work_out, work_air, wrong):
    """Note for the team the work, the energies lost (J), and the count of non-finite values."""
    note = team.note[team.number]
    note[WORK], note[DISSIPATED], note[AIR], note[WRONG] = work_in, work_out, work_air, wrong
