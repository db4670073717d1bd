"""Base of discrete adjoints: gradients with respect to loads, support motion, mass and alpha."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.cases.releases import refuse_releases
from foldyn.cases.waveforms import evaluate
from foldyn.dynamics.inertia import substitute
from foldyn.dynamics.system import carried, scratch
from foldyn.mechanics.pullback import Pullback, arrays_of_body, pull_all, refuse_lacking

APART = 1e-5  # distance of a difference along the velocity, relative to the longest bar


class ByMotion(NamedTuple):
    """Gradients with respect to loads, support motion, mass, inertia of hidden dofs, and alpha."""

    loads: NDArray  # (l,) with respect to `System.loads`
    moved: NDArray  # (s,) with respect to `System.moved`
    mass: NDArray  # (entries,) with respect to the entries of the nodal mass matrix
    hidden: NDArray  # (rows - n, 3) with respect to `Inertia.hidden`
    alpha: NDArray  # (1,)


class Adjoint(ABC):
    """Backward pass through a motion, from derivatives of a scalar with respect to the samples.

    Parameters
    ----------
    motion : Motion
        As `dynamics.driver.prepare` returns it.
    """

    def __init__(self, motion: Any) -> None:
        packed = motion.packed
        self._packed, self._system, self._mass = packed, packed.system, packed.mass
        self._plan, self._pullback = motion.plan, Pullback(packed.body)
        self._imposed = packed.numbering.inward(motion.case.imposed)
        self._scratch = scratch(packed.system)
        self._motion = motion
        sizes = len(self._system.loads.dof), len(self._system.moved.dof), len(self._mass.data)
        self._by = ByMotion(*map(np.zeros, (*sizes, self._mass.hidden.shape, 1)))
        self._rows = np.repeat(np.arange(len(self._mass.indptr) - 1), np.diff(self._mass.indptr))
        self._weight, self._product, self._rate = np.zeros((3, packed.system.rows, 3))

    def add_supports(self, t: float, by_u: NDArray, by_v: NDArray) -> None:
        """Add derivatives with respect to support motion, given those for a sample at t (s)."""
        self._evaluate(t)
        moved, factor = self._system.moved, self._scratch.factor
        rate = factor[moved.row]
        self._by.moved[:] += by_u.ravel()[moved.dof] * rate[:, 0]
        self._by.moved[:] += by_v.ravel()[moved.dof] * rate[:, 1]

    @abstractmethod
    def backward(self, first: int, last: int, by_u: NDArray, by_v: NDArray) -> None:
        """Step backward from step number `last` to step number `first`.

        by_u, by_v : derivatives (n, 3) of the scalar with respect to the state at step `last`;
        overwritten with the derivatives with respect to the state at step `first`.
        """

    def gradient(self, by_u: NDArray, by_v: NDArray) -> dict[str, NDArray]:
        """Complete the gradient, from the derivatives with respect to the initial state.

        Keys: the arrays of the terms (`pullback.arrays_of_body`), the fields of `ByMotion`, and
        "start.displacement" and "start.velocity".
        """
        if len(self._packed.body.hidden) and not self._motion.continued:
            self._begin_hidden(by_u, by_v)
        self._evaluate(self._plan.start)
        moved, outward = self._system.moved, self._packed.numbering.outward
        # a base moves from its initial displacement
        free = ~self._imposed.ravel()[moved.dof]
        factor = self._scratch.factor[moved.row, 0]
        self._by.moved[:] -= free * by_u.ravel()[moved.dof] * factor
        # internal forces enter the acceleration with a minus sign
        terms = {name: -out for name, out in self._pullback.gradient.items()}
        start = {"start.displacement": outward(by_u), "start.velocity": outward(by_v)}
        return terms | self._by._asdict() | start

    def _begin_hidden(self, by_u: NDArray, by_v: NDArray) -> None:
        """Propagate derivatives by hidden dofs at the start, which are in balance there.

        If they have an inertia, their velocities follow those of nodes, and these change with the
        state as the stiffness does along the velocity.
        """
        begun, body, t = self._motion.beginning, self._packed.body, self._plan.start
        hidden, (u, v) = body.hidden, self._whole(t, begun.u, begun.v)
        tangent = sparse.csr_array(body.tangent(u.ravel()[: body.size]))
        solve = splu(sparse.csc_array(tangent[hidden][:, hidden])).solve
        weight, still = np.zeros_like(u), np.zeros_like(u)
        if len(self._mass.hidden) and v.any():
            weight.ravel()[hidden] = solve(by_v.ravel()[hidden])
            by_v.ravel()[: body.size] -= tangent @ weight.ravel()[: body.size]
            apart = APART * self._packed.body.sheet.longest() / np.abs(v).max()
            for sign in (1.0, -1.0):
                self._forget()
                self._pull(u + sign * apart * v, still, sign * weight / (2.0 * apart))
                self._add_supports()
                by_u -= self._product
        weight[:] = 0.0
        weight.ravel()[hidden] = solve(by_u.ravel()[hidden])
        self._forget()
        self._pull(u, still, weight)
        self._add_supports()
        by_u -= self._product

    # ------------------------------------------------------------------ for steps in Python
    def _whole(self, t: float, q: NDArray, w: NDArray) -> tuple[NDArray, NDArray]:
        """Displacement and velocity (n, 3) at time t (s), support motion included."""
        self._evaluate(t)
        moved, factor = self._system.moved, self._scratch.factor
        return carried(moved, factor[:, 0], q), carried(moved, factor[:, 1], w)

    def _forget(self) -> None:
        self._weight, self._product, self._rate = np.zeros((3, *self._product.shape))

    def _pull(self, u: NDArray, v: NDArray, weight: NDArray) -> None:
        """Add the derivatives of weight . b, as last evaluated, to the sums begun by `_forget`."""
        self._weight += weight
        time = float(self._scratch.time[0])
        pull_all(self._pullback.terms, u, v, time, weight, self._product, self._rate)

    def _add_supports(self) -> None:
        """Add derivatives with respect to loads and supports for all pulls since `_forget`."""
        loads, moved, factor = self._system.loads, self._system.moved, self._scratch.factor
        self._by.loads[:] += self._weight.ravel()[loads.dof] * factor[loads.row, 0]
        self._by.moved[:] -= self._product.ravel()[moved.dof] * factor[moved.row, 0]
        self._by.moved[:] -= self._rate.ravel()[moved.dof] * factor[moved.row, 1]

    def _add_mass(self, push: NDArray, a: NDArray, w: NDArray) -> None:
        """Add the derivatives of -push . M (a + alpha w) with respect to the mass and alpha."""
        mass, alpha = self._mass, self._system.alpha
        pushed, first = push[self._rows], len(w) - len(mass.hidden)
        self._by.hidden[:] -= (push * (a + alpha * w))[first:]
        own = (mass.hidden * push[first:] * w[first:]).sum()
        self._by.mass[:] -= np.einsum("ea,ea->e", pushed, (a + alpha * w)[mass.indices])
        own += mass.data @ np.einsum("ea,ea->e", pushed, w[mass.indices])
        self._by.alpha[0] -= own

    def _push(self, by_a: NDArray) -> NDArray:
        """Return M^-1 by_a (n, 3): minus the derivatives with respect to b, as a = -M^-1 b."""
        if self._mass.lumped:
            return self._mass.inverse * by_a
        out = np.zeros_like(by_a)
        substitute(self._mass, by_a, out, self._scratch.line)
        return out

    def _through(
        self, t: float, q: NDArray, w: NDArray, a: NDArray, weight: NDArray, by_a: NDArray,
        by_u: NDArray, by_v: NDArray,
    ) -> None:  # fmt: skip
        """Propagate derivatives for a = -M^-1 b - alpha w to all arguments of a.

        weight : of b, with which it acts on later states, too.
        """
        self._forget()
        self._pull(*self._whole(t, q, w), weight)
        self._add_supports()
        self._add_mass(self._push(by_a), a, w)
        by_u -= self._product
        by_v -= self._rate + self._system.alpha * by_a

    def _evaluate(self, t: float) -> None:
        if self._system.varies:
            evaluate(self._system.waves, t, True, self._scratch.factor)
        self._scratch.time[0] = t


def refuse(motion: Any) -> None:
    """Refuse motions without an adjoint, with a remedy."""
    refuse_releases(motion.case, "a motion with gradients")
    packed, system = motion.packed, motion.packed.system
    arrays_of_body(packed.body)  # refuses terms without gradients
    lacks = {
        "contact, which switches on and off": system.touches,
        "air": motion.case.air is not None,
        "rest angles that turn in time (Actuate, Temperature)": system.turns,
        "loads that depend on the displacement (Pressure, CreaseMoment)": system.follows,
        "supports that move at the start, and a mass matrix that is not diagonal": (
            not packed.mass.lumped and bool(motion.start[1][motion.case.fixed].any())
        ),
    }
    refuse_lacking("motions", lacks)
