"""Foldyn's own force and RK4 loop behind the interface of the twins."""

from __future__ import annotations

import inspect
import time

import numpy as np
from numpy.typing import NDArray
from problem import Problem

from foldyn import mechanics
from foldyn.dynamics import rk4
from foldyn.dynamics.system import pack, scratch


class FoldynEngine:
    """The compiled loop that `simulate` runs, called directly so that nothing is recorded."""

    name = "Foldyn"

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.model, self.system, self.mass = pack(problem.case)
        self.work = mechanics.workspace(self.model)
        self.memory = scratch(len(problem.rest))
        self._back = np.argsort(problem.order)

    def force(self, u: NDArray) -> NDArray:
        """Internal force (n, 3) at displacement u (n, 3), both in the twins' order."""
        out = np.empty_like(u)
        displacement = np.ascontiguousarray(u[self._back])
        mechanics.internal_force(self.model, displacement, out, self.work)
        return out[self.problem.order]

    def run(self, steps: int) -> tuple[float, NDArray]:
        """Seconds for `steps` RK4 steps from the start, and the displacement then.

        The loop evaluates the force once more at its end; that part is taken off.
        """
        u = np.ascontiguousarray(self.problem.start[self._back])
        n, histories = len(u), len(self.problem.case.load_terms)
        angle = mechanics.angles(self.model.rest + u, self.model.hinges)
        arguments = {
            "model": self.model,
            "system": self.system,
            "mass": self.mass,
            "u": u,
            "v": np.zeros((n, 3)),
            "carry": np.zeros((n, 3)),
            "tally": np.zeros(8),
            "dt": self.problem.dt,
            "first": 1,
            "last": 1 + steps,
            "every": 1 << 60,
            "factors": np.ones((steps + 1, len(rk4.STAGES), histories)),
            "angle": angle,
            "displacement": np.empty((0, n, 3)),
            "velocity": np.empty((0, n, 3)),
            "reaction": np.empty((0, len(self.system.supported))),
            "energy": np.empty((0, 6)),
            "work": self.work,
            "s": self.memory,
        }
        # by name: the order of the arguments is internal to Foldyn
        wanted = inspect.signature(rk4.advance.py_func).parameters
        values = [arguments[name] for name in wanted]
        began = time.perf_counter()
        code, *_ = rk4.advance(*values)
        seconds = time.perf_counter() - began
        if code:
            raise RuntimeError(f"Foldyn's loop stopped with code {code}")
        return seconds * 4 * steps / (4 * steps + 1), u[self.problem.order]
