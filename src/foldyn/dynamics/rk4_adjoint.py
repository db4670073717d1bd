"""The discrete adjoint of RK4: exact gradients of what `dynamics.rk4` computes.

A step takes the state y = (u, v) to y + dt/6 (k1 + 2 k2 + 2 k3 + k4), k_s = f(y_s) the rates at its
stages y_s. Backward, with the derivatives l of a number by the state at its end, a stage gets

    l_s = w_s l + c_s m_(s+1),    m_s = (df/dy at y_s)' l_s,

w = dt (1/6, 1/3, 1/3, 1/6), c = dt (1/2, 1/2, 1) the shares of its rate in the next stage, and the
state at the start has l + the sum of all m_s. A parameter gets the sum of (df/dp)' l_s. Of forces
that needs their pullback alone (`mechanics.pullback`), with the weights M^-1 times the part of l_s
that belongs to the acceleration.

Steps are taken again, some at a time, from states that are kept: of a segment of the motion the
states at every stage (Griewank and Walther, Evaluating Derivatives, 2008, chapter 12).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.adjoint import Adjoint
from foldyn.dynamics.equation import EquationOfMotion, acceleration
from foldyn.dynamics.motion_state import StepPlan
from foldyn.dynamics.system import carried
from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.context import Context, run_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.pullback import pulled_back

if TYPE_CHECKING:
    import xarray

ROOM = 1e6, 4e6  # bytes of the states at the stages of a segment, and of the states that are kept


@inner_scalar
def _into(source, out):
    one, other = flat(source), flat(out)
    for i in range(one.size):
        other[i] = one[i]


@kernel
def retrace(equation, u, v, plan, first, count, stages):
    """Take `count` steps of RK4 from number `first` on; u and v change in place.

    stages : (count, 4, 3, n, 3) or (0, ...), displacement, velocity and acceleration at each
        stage. The arithmetic is that of `rk4.advance`, to the bit.
    """
    stage = equation.stage
    at_u, at_v, a = stage[0], stage[1], stage[2]
    un, vn, ut, vt, fa = flat(u), flat(v), flat(at_u), flat(at_v), flat(a)
    du, dv, dt = np.empty_like(un), np.empty_like(vn), plan.dt
    for k in range(count):
        now = plan.start + (first + k) * dt
        _into(u, at_u)
        _into(v, at_v)
        for s in range(4):
            acceleration(equation, at_u, at_v, now + 0.5 * ((s + 1) // 2) * dt, a)
            if stages.shape[0] > 0:
                _into(at_u, stages[k, s, 0])
                _into(at_v, stages[k, s, 1])
                _into(a, stages[k, s, 2])
            ahead = 0.5 * dt if s < 2 else dt
            if s == 0:
                for i in range(un.size):
                    du[i], dv[i] = vt[i], fa[i]
                    ut[i], vt[i] = un[i] + ahead * vt[i], vn[i] + ahead * fa[i]
            elif s < 3:
                for i in range(un.size):
                    du[i] += 2.0 * vt[i]
                    dv[i] += 2.0 * fa[i]
                    ut[i], vt[i] = un[i] + ahead * vt[i], vn[i] + ahead * fa[i]
            else:
                for i in range(un.size):
                    un[i] += dt / 6.0 * (du[i] + vt[i])
                    vn[i] += dt / 6.0 * (dv[i] + fa[i])


@kernel
def pull_steps(balance, pulls, plan, first, stages, by_u, by_v, memory, mass, moved, out):
    """Take the steps of `stages` backward; by_u and by_v (n, 3) change in place.

    memory : (9, n, 3). mass : `Inertia`. moved : `System.moved`.
    """
    dt, loads, alpha = plan.dt, balance.loads, balance.alpha
    lumped, count = balance.solve == 0, by_u.size
    y, product, rate = memory[0], memory[1], memory[2]
    yn, pn, rn, both = flat(y), flat(product), flat(rate), flat(memory[8])
    ka, mu, mv = flat(memory[3]), flat(memory[4]), flat(memory[5])
    su, sv, lu, lv = flat(memory[6]), flat(memory[7]), flat(by_u), flat(by_v)
    force, inverse = flat(balance.force), flat(balance.inverse)
    for i in range(count):
        both[i] = 0.0
    for k in range(stages.shape[0] - 1, -1, -1):
        for i in range(count):
            mu[i], mv[i], su[i], sv[i] = 0.0, 0.0, 0.0, 0.0
        for s in range(3, -1, -1):
            t = plan.start + (first + k) * dt + 0.5 * ((s + 1) // 2) * dt
            own = dt / 3.0 if 0 < s < 3 else dt / 6.0
            ahead = 0.0 if s == 3 else (dt if s == 2 else 0.5 * dt)
            q, w = stages[k, s, 0], stages[k, s, 1]
            speed, rise = flat(w), flat(stages[k, s, 2])
            if balance.histories != 0:
                run_at(balance.histories, (balance.setting, t))
            if balance.carry != 0:
                run_at(balance.carry, (balance.setting, q, w))
            u = balance.displacement if balance.carry != 0 else q
            v = balance.velocity if balance.carry != 0 else w
            if lumped:
                for i in range(count):
                    ka[i] = own * lv[i] + ahead * mv[i]
                    yn[i] = inverse[i] * ka[i]
                    both[i] -= yn[i] * (rise[i] + alpha * speed[i])
                    pn[i], rn[i] = 0.0, 0.0
            else:
                for i in range(count):
                    ka[i] = own * lv[i] + ahead * mv[i]
                    force[i], pn[i], rn[i] = ka[i], 0.0, 0.0
                run_at(balance.solve, (balance.setting, y))
                for i in range(mass.indptr.size - 1):
                    for e in range(mass.indptr[i], mass.indptr[i + 1]):
                        j = mass.indices[e]
                        for c in range(3):
                            by = rise[3 * j + c] + alpha * speed[3 * j + c]
                            out.mass[e] -= y[i, c] * by
            pulled_back(pulls, u, v, t, y, product, rate)
            for e in range(loads.dof.size):
                out.loads[e] += yn[loads.dof[e]] * balance.factor[loads.row[e], 0]
            for e in range(moved.dof.size):
                dof, row = moved.dof[e], moved.row[e]
                out.moved[e] -= pn[dof] * balance.factor[row, 0] + rn[dof] * balance.factor[row, 1]
            drag = 0.0
            for i in range(count):
                drag += ka[i] * speed[i]
                kv = own * lu[i] + ahead * mu[i]
                mu[i], mv[i] = -pn[i], kv - alpha * ka[i] - rn[i]
                su[i] += mu[i]
                sv[i] += mv[i]
            out.alpha[0] -= drag
        for i in range(count):
            lu[i] += su[i]
            lv[i] += sv[i]
    if lumped:
        for i in range(mass.indptr.size - 1):
            for e in range(mass.indptr[i], mass.indptr[i + 1]):
                if mass.indices[e] == i:
                    out.mass[e] += both[3 * i] + both[3 * i + 1] + both[3 * i + 2]


class RK4Adjoint(Adjoint):
    """Backward through a motion by RK4; see `Adjoint`.

    Parameters
    ----------
    motion : Motion
        Ready to be computed, by `dynamics.driver.prepare`.
    samples : xarray.Dataset
        Its result: where steps are taken again from.
    """

    def __init__(self, motion: Any, samples: xarray.Dataset) -> None:
        super().__init__(motion)
        packed, system = self._packed, self._system
        self._steps, self._inertia = Context(self._plan), Context(packed.mass)
        self._moved, self._out = Context(system.moved), Context(self._by)
        self._work = packed.body.workspaces(1)[0]
        self._equation = EquationOfMotion(packed, self._work, self._scratch, motion.course, None)
        self._times = samples["time"].values
        self._states = tuple(
            samples[name].transpose("time", "node", "axis").values
            for name in ("displacement", "velocity")
        )
        shape = (4, 3, system.rows, 3)
        self._memory, self._none = np.zeros((9, *shape[2:])), np.empty((0, *shape))
        self._stages = np.empty((steps_at_once(system.rows), *shape))

    def backward(self, first: int, last: int, by_u: NDArray, by_v: NDArray) -> None:
        """See `Adjoint`; a sample is at the first."""
        self._backward(first, last, *self._state(first // self._plan.every), by_u, by_v)

    def _state(self, k: int) -> tuple[NDArray, NDArray]:
        """State (n, 3) at a sample without what supports move: as steps have it."""
        self._evaluate(self._times[k])
        moved, factor = self._system.moved, self._scratch.factor
        u, v = (self._packed.numbering.inward(each[k]) for each in self._states)
        still = np.zeros_like(u)
        return u - carried(moved, factor[:, 0], still), v - carried(moved, factor[:, 1], still)

    def _backward(
        self, first: int, last: int, u: NDArray, v: NDArray, by_u: NDArray, by_v: NDArray
    ) -> None:
        """The same from the state (n, 3) at the first."""
        count, most = last - first, len(self._stages)
        if count <= most:
            stages = self._stages[:count]
            retrace(self._equation.still, u.copy(), v.copy(), self._steps, first, count, stages)
            pull_steps(
                self._equation.balance, self._pullback.terms, self._steps, first, stages, by_u,
                by_v, self._memory, self._inertia, self._moved, self._out,
            )  # fmt: skip
            return
        # states are kept as far apart as there is room for them: most often once through is enough
        apart = max(most, -(-count // max(2, int(ROOM[1] / (2 * 8 * u.size)))))
        kept, q, w = [], u.copy(), v.copy()
        for at in range(first, last, apart):
            kept.append((at, q.copy(), w.copy()))
            if at + apart < last:
                retrace(self._equation.still, q, w, self._steps, at, apart, self._none)
        for at, q, w in reversed(kept):
            self._backward(at, min(at + apart, last), q, w, by_u, by_v)


def steps_at_once(rows: int) -> int:
    """Steps whose stages are kept, of a motion with so many rows of three dofs."""
    return max(1, int(ROOM[0] / (4 * 3 * rows * 3 * 8)))


def segment(plan: StepPlan, rows: int) -> int:
    """Steps between samples from which a motion goes back: those that are asked for, or fewer.

    So many that all can be kept at once, if there is room for so many samples.
    """
    most = max(steps_at_once(rows), int(plan.steps * 2 * 3 * 8 * rows / ROOM[1]))
    parts = next(
        k for k in range(1, plan.every + 1) if plan.every % k == 0 <= most - plan.every // k
    )
    shorter = plan.every // parts
    return shorter if 4 * shorter > min(most, plan.every) else plan.every
