"""Foldyn's own force and RK4 loop behind the interface of the twins."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from problem import Problem

from foldyn.dynamics.initial import begin
from foldyn.dynamics.methods import ExplicitEngine
from foldyn.dynamics.motion_state import StepPlan, samples
from foldyn.dynamics.runge_kutta import RK4, advance
from foldyn.dynamics.system import pack
from foldyn.mechanics import force_scratch, internal_force


class FoldynEngine:
    """The compiled loop that `simulate` runs, called directly so that nothing is recorded."""

    def __init__(self, problem: Problem, threads: int = 1) -> None:
        self.name = "Foldyn" if threads == 1 else f"Foldyn, {threads} threads"
        self.problem = problem
        self.packed = pack(problem.case, problem.dt)
        self._threads = threads
        self._back = np.argsort(problem.order)

    def force(self, u: NDArray) -> NDArray:
        """Internal force (n, 3) at displacement u (n, 3), both in the twins' order."""
        out, by = np.empty_like(u), self.packed.numbering
        model = self.packed.model
        internal_force(model, by.inward(u[self._back]), out, force_scratch(model))
        return by.outward(out)[self.problem.order]

    def run(self, steps: int) -> tuple[float, NDArray]:
        """Seconds for `steps` RK4 steps from the start, and the displacement then.

        The loop evaluates the force once more at its end; that part is taken off.
        """
        case, packed, dt = self.problem.case, self.packed, self.problem.dt
        plan = StepPlan(0.0, steps * dt, dt, steps, 1 << 60, 0.0, 0.0, 0.0, np.zeros(0))
        start = self.problem.start[self._back]
        state = begin(case, start, np.zeros_like(start), None, None, plan, packed)
        state.tally.samples = 1  # so that no step is due for a sample
        out = samples(0, len(start), len(packed.system.supported), 6)
        further = (RK4.coefficients,)
        engine = ExplicitEngine(advance, packed, state, plan, self._threads, further=further)
        began = time.perf_counter()
        code, _ = engine.advance(out, steps)
        seconds = time.perf_counter() - began
        if code:
            raise RuntimeError(f"Foldyn's loop stopped with code {code}")
        u = packed.numbering.outward(state.u)
        return seconds * 4 * steps / (4 * steps + 1), u[self.problem.order]
