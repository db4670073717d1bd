"""Discrete adjoint of explicit Runge-Kutta methods: exact gradients of the computed motion.

A step takes the state y = (u, v) to y + dt sum of w_s k_s, where k_s = f(y_s) are the slopes at the
stages y_s = y + dt sum of c_sr k_r. In the backward pass, with the derivatives l of a scalar with
respect to the end state, a stage gets

    l_s = dt (w_s l + sum of c_rs m_r),    m_s = (df/dy at y_s)' l_s,

and the derivatives with respect to the start state are l + the sum of all m_s. A parameter gets the
sum of (df/dp)' l_s. Forces only need a pullback (`mechanics.pullback`), whose weights are M^-1
times the acceleration part of l_s.

Steps are recomputed in segments from stored states, and the states at every stage of a segment are
stored (Griewank and Walther, Evaluating Derivatives, 2008, chapter 12).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.adjoint import Adjoint
from foldyn.dynamics.equation import EquationOfMotion, acceleration
from foldyn.dynamics.implicit.scheme import copy
from foldyn.dynamics.runge_kutta import next_stage
from foldyn.dynamics.system import carried
from foldyn.jit.compiled import kernel
from foldyn.jit.context import Context, run_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.pullback import pulled_back

if TYPE_CHECKING:
    import xarray

ROOM = 1e6, 4e6  # memory for stage states of a segment and for stored states, bytes


@kernel
def retrace(handle, u, v, plan, method, first, count, stages):
    """Recompute `count` steps from number `first` on; u and v change in place.

    method : a `Coefficients`.
    stages : (count, s, 3, n, 3) for displacement, velocity and acceleration at each stage, or
    (0, ...). Reproduces `runge_kutta.advance` bit for bit.
    """
    stage = handle.stage
    at_u, at_v, a = stage[0], stage[1], stage[2]
    un, vn, ut, vt, fa = flat(u), flat(v), flat(at_u), flat(at_v), flat(a)
    du, dv, dt, last = np.zeros_like(un), np.zeros_like(vn), plan.dt, method.weight.size - 1
    others = np.zeros(((last + 1) * method.mixed, 2, un.size))
    for k in range(count):
        now = plan.start + (first + k) * dt
        copy(u, at_u)
        copy(v, at_v)
        for s in range(last + 1):
            acceleration(handle, at_u, at_v, now + method.time[s] * dt, a)
            if stages.shape[0] > 0:
                copy(at_u, stages[k, s, 0])
                copy(at_v, stages[k, s, 1])
                copy(a, stages[k, s, 2])
            if s < last:
                next_stage(method, s, dt, un, vn, ut, vt, fa, du, dv, others)
        share, weight = dt / method.whole, method.weight[last]
        for i in range(un.size):
            un[i] += share * (du[i] + weight * vt[i])
            vn[i] += share * (dv[i] + weight * fa[i])
            du[i], dv[i] = 0.0, 0.0


@kernel
def pull_steps(
    case, pulls, plan, method, first, stages, by_u, by_v, memory, by_slope, mass, moved, out
):
    """Process the steps of `stages` backward; by_u and by_v (n, 3) change in place.

    memory : (7, n, 3). by_slope : (s, 2, n, 3), zeros, for the sums of m_r. mass : `Inertia`.
    moved : `System.moved`.
    """
    dt, loads, alpha, scratch = plan.dt, case.system.loads, case.drag, case.s
    lumped, count = case.solve == 0, by_u.size
    y, product, rate = memory[0], memory[1], memory[2]
    yn, pn, rn, both = flat(y), flat(product), flat(rate), flat(memory[6])
    ka, su, sv = flat(memory[3]), flat(memory[4]), flat(memory[5])
    lu, lv = flat(by_u), flat(by_v)
    force, inverse = flat(scratch.force), flat(case.mass.inverse)
    for i in range(count):
        both[i] = 0.0
    for k in range(stages.shape[0] - 1, -1, -1):
        for i in range(count):
            su[i], sv[i] = 0.0, 0.0
        for s in range(method.weight.size - 1, -1, -1):
            t = plan.start + (first + k) * dt + method.time[s] * dt
            own = method.weight[s] * dt / method.whole
            mu, mv = flat(by_slope[s, 0]), flat(by_slope[s, 1])
            q, w = stages[k, s, 0], stages[k, s, 1]
            speed, rise = flat(w), flat(stages[k, s, 2])
            if case.histories != 0:
                run_at(case.histories, (case, t))
            if case.carry != 0:
                run_at(case.carry, (case, q, w))
            u = scratch.displacement if case.carry != 0 else q
            v = scratch.velocity if case.carry != 0 else w
            if lumped:
                for i in range(count):
                    ka[i] = own * lv[i] + mv[i]
                    yn[i] = inverse[i] * ka[i]
                    both[i] -= yn[i] * (rise[i] + alpha * speed[i])
                    pn[i], rn[i] = 0.0, 0.0
            else:
                for i in range(count):
                    ka[i] = own * lv[i] + mv[i]
                    force[i], pn[i], rn[i] = ka[i], 0.0, 0.0
                run_at(case.solve, (case, y))
                for i in range(mass.indptr.size - 1):
                    for e in range(mass.indptr[i], mass.indptr[i + 1]):
                        j = mass.indices[e]
                        for c in range(3):
                            by = rise[3 * j + c] + alpha * speed[3 * j + c]
                            out.mass[e] -= y[i, c] * by
                for i in range(count - mass.hidden.size, count):
                    both[i] -= yn[i] * (rise[i] + alpha * speed[i])
            pulled_back(pulls, u, v, t, y, product, rate)
            for e in range(loads.dof.size):
                out.loads[e] += yn[loads.dof[e]] * scratch.factor[loads.row[e], 0]
            for e in range(moved.dof.size):
                dof, row = moved.dof[e], moved.row[e]
                out.moved[e] -= pn[dof] * scratch.factor[row, 0] + rn[dof] * scratch.factor[row, 1]
            drag = 0.0
            for i in range(count):
                drag += ka[i] * speed[i]
                rn[i] = own * lu[i] + mu[i] - alpha * ka[i] - rn[i]
                su[i] -= pn[i]
                sv[i] += rn[i]
                mu[i], mv[i] = 0.0, 0.0
            for before in range(s):
                ahead = method.ahead[s, before] * dt
                if ahead != 0.0:
                    mu, mv = flat(by_slope[before, 0]), flat(by_slope[before, 1])
                    for i in range(count):
                        mu[i] -= ahead * pn[i]
                        mv[i] += ahead * rn[i]
            out.alpha[0] -= drag
        for i in range(count):
            lu[i] += su[i]
            lv[i] += sv[i]
    if lumped:
        for i in range(mass.indptr.size - 1):
            for e in range(mass.indptr[i], mass.indptr[i + 1]):
                if mass.indices[e] == i:
                    out.mass[e] += both[3 * i] + both[3 * i + 1] + both[3 * i + 2]
    for i in range(mass.hidden.size):
        flat(out.hidden)[i] += both[count - mass.hidden.size + i]


class RungeKuttaAdjoint(Adjoint):
    """Backward pass through a motion by an explicit Runge-Kutta method; see `Adjoint`.

    Parameters
    ----------
    motion : Motion
        As `dynamics.driver.prepare` returns it.
    samples : xarray.Dataset
        Result of the motion, with the states from which steps are recomputed.
    """

    def __init__(self, motion: Any, samples: xarray.Dataset) -> None:
        super().__init__(motion)
        packed, system = self._packed, self._system
        self._steps, self._inertia = Context(self._plan), Context(packed.mass)
        self._moved, self._out = Context(system.moved), Context(self._by)
        part = packed.body.thread_parts(1)[0]
        self._equation = EquationOfMotion(packed, part, self._scratch, motion.state, None)
        self._times = samples["time"].values
        self._states = tuple(
            samples[name].transpose("time", "node", "axis").values
            for name in ("displacement", "velocity")
        )
        self._method = motion.method.tableau.coefficients
        count = len(self._method.weight)
        shape = (count, 3, system.rows, 3)
        self._memory, self._none = np.zeros((7, *shape[2:])), np.empty((0, *shape))
        self._by_slope = np.zeros((count, 2, *shape[2:]))
        self._stages = np.empty((steps_at_once(count, system.rows), *shape))
        self._begun: list[tuple[NDArray, NDArray]] = []
        if len(packed.body.hidden):  # samples lack the hidden dofs
            begun, every = motion.beginning, self._plan.every
            for k in range(len(self._times)):
                self._begun.append((begun.u.copy(), begun.v.copy()))
                self._retrace(begun.u, begun.v, k * every, every, self._none)

    def backward(self, first: int, last: int, by_u: NDArray, by_v: NDArray) -> None:
        """Step backward from step `last` to step `first`, which has a sample; see `Adjoint`."""
        self._backward(first, last, *self._state(first // self._plan.every), by_u, by_v)

    def _state(self, k: int) -> tuple[NDArray, NDArray]:
        """State (n, 3) at sample k without support motion, as steps use it."""
        if self._begun:
            u, v = self._begun[k]
            return u.copy(), v.copy()
        self._evaluate(self._times[k])
        moved, factor = self._system.moved, self._scratch.factor
        u, v = (self._packed.numbering.inward(each[k]) for each in self._states)
        still = np.zeros_like(u)
        return u - carried(moved, factor[:, 0], still), v - carried(moved, factor[:, 1], still)

    def _backward(
        self, first: int, last: int, u: NDArray, v: NDArray, by_u: NDArray, by_v: NDArray
    ) -> None:
        """Step backward from step `last` to step `first`, whose state is u and v (n, 3)."""
        count, most = last - first, len(self._stages)
        if count <= most:
            stages = self._stages[:count]
            self._retrace(u.copy(), v.copy(), first, count, stages)
            pull_steps(
                self._equation.case, self._pullback.terms, self._steps, self._method, first,
                stages, by_u, by_v, self._memory, self._by_slope, self._inertia, self._moved,
                self._out,
            )  # fmt: skip
            return
        # states are stored as far apart as memory requires: usually one pass is enough
        apart = max(most, -(-count // max(2, int(ROOM[1] / (2 * 8 * u.size)))))
        kept, q, w = [], u.copy(), v.copy()
        for at in range(first, last, apart):
            kept.append((at, q.copy(), w.copy()))
            if at + apart < last:
                self._retrace(q, w, at, apart, self._none)
        for at, q, w in reversed(kept):
            self._backward(at, min(at + apart, last), q, w, by_u, by_v)

    def _retrace(self, u: NDArray, v: NDArray, first: int, count: int, stages: NDArray) -> None:
        """Recompute steps; see `retrace`."""
        retrace(self._equation.handle, u, v, self._steps, self._method, first, count, stages)


def steps_at_once(stages: int, rows: int) -> int:
    """Number of steps whose stages fit in memory, for `rows` rows of three dofs."""
    return max(1, int(ROOM[0] / (stages * 3 * rows * 3 * 8)))


def segment(motion: Any) -> int:
    """Number of steps between stored samples for the backward pass: as asked for, or fewer.

    It is small enough for memory to hold all stages between two samples, as long as that many
    samples also fit.
    """
    every, rows = motion.plan.every, motion.packed.system.rows
    at_once = steps_at_once(len(motion.method.tableau.weights), rows)
    most = max(at_once, int(motion.plan.steps * 2 * 3 * 8 * rows / ROOM[1]))
    parts = next(k for k in range(1, every + 1) if every % k == 0 <= most - every // k)
    shorter = every // parts
    return shorter if 4 * shorter > min(most, every) else every
