"""Products z' K x and z' M x with the matrices of small motions, differentiated.

Of K, the derivative of forces, what is needed is the pullback of the forces with the weights z,
differentiated along x: by differences over turns so small that their error is 1e-12.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.gradients.equilibrium import Balance
from foldyn.gradients.numbers import nothing
from foldyn.linear.linearized import Linearized
from foldyn.materials import Superlinear
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.pullback import Pullback, refuse_lacking
from foldyn.structures.bars_hinges import BarsHingesTerm

TURN = 1e-3  # rad: of the largest turn in a difference along a motion
SMALL = 1e-6  # of the longest bar: a motion by which turns are measured
AT_REST = 1e-9  # rad: superlinear hinges that stand nearer to their rest angle have no slope


class Products:
    """Products of motions of the free dofs with the matrices of a case, differentiated.

    Parameters
    ----------
    linear : Linearized
    displacement : (n, 3), optional
        Where K is the tangent, m; by default in the state of `linear`.
    """

    def __init__(self, linear: Linearized, displacement: NDArray | None = None) -> None:
        self._linear, self._case = linear, linear.case
        body = linear.case.body
        self.q = body.dofs(linear.displacement if displacement is None else displacement)
        self._balance = Balance(linear.case, self.q)
        self._soft = _soft(body.sheet, self.q)
        self._pullback = Pullback(_without(body, self._soft))
        self._mass = sparse.csr_array(linear.case.mass)
        self._mass.sort_indices()
        self._rows = np.repeat(np.arange(self._mass.shape[0]), np.diff(self._mass.indptr))

    def nothing(self) -> dict[str, NDArray]:
        """Gradient of nothing."""
        return nothing(self._case, self._pullback)

    def add_stiffness(
        self, z: NDArray, x: NDArray, by: float, total: dict[str, NDArray]
    ) -> NDArray:  # fmt: skip
        """Add the gradient of by z' K x, for z and x (nf,); returns that by the dofs (m,)."""
        weight, motion = (self._linear.whole(each[:, None])[:, 0] for each in (z, x))
        state = np.zeros(len(self.q))
        if by == 0.0 or not motion.any():
            return state
        body = self._case.body
        scale = SMALL * body.sheet.longest() / np.abs(motion).max()
        step = TURN * scale / body.turn(self.q, self.q + scale * motion)
        for place, share in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
            factor = by * share / (12.0 * step)
            self._pullback.clear()
            state += factor * self._pullback.at(self.q + place * step * motion, weight)
            if self._soft.any():
                self._pullback.gradient["0.hinge_stiffness"][self._soft] = 0.0
            for name, out in self._pullback.gradient.items():
                total[name] += factor * out
        return state

    def add_mass(self, z: NDArray, x: NDArray, by: float, total: dict[str, NDArray]) -> None:
        """Add the gradient of by z' M x, for z (nf,) and x (nf,) or of all nodes (n, 3)."""
        one, other = (
            each if each.ndim > 1 else self._linear.expanded(each[:, None]).reshape(-1, 3)
            for each in (z, x)
        )
        product = np.einsum("ea,ea->e", one[self._rows], other[self._mass.indices])
        total["mass"] += by * product

    def add_equilibrium(self, state: NDArray, total: dict[str, NDArray]) -> None:
        """Add what a gradient (m,) by the state has if that is an equilibrium under the loads."""
        self._balance.add_seen(state, self._pullback, total)


def refuse(linear: Linearized, what: str) -> None:
    """Refuse linearizations that have no derivatives yet, with a remedy."""
    case = linear.case
    lacks = {
        "contact": case.contact is not None,
        "air": case.air is not None,
        "creases that yield, creep or relax": linear.branches is not None,
        "internal amplitudes (internal)": linear.internal > 0,
        "slopes of finite amplitude (secant)": linear.secant is not None,
        "folds that are actuated about an equilibrium (Actuate, Temperature)": (
            bool(case.rest_terms) and bool(linear.displacement.any())
        ),
        "loads that depend on the displacement (Pressure, CreaseMoment)": bool(
            case.following_terms
        ),
    }
    refuse_lacking(what, lacks)


def _soft(sheet: Any, q: NDArray) -> NDArray:
    """Mask (nh,) of superlinear hinges at their rest angle, which have no slope in modes."""
    if not isinstance(sheet, BarsHingesTerm):
        return np.zeros(0, bool)
    model = sheet.model
    code = np.repeat(model.hinge_runs[:, 2], model.hinge_runs[:, 1] - model.hinge_runs[:, 0])
    return (code == Superlinear.code) & (np.abs(sheet.angles(q) - model.hinge_rest) < AT_REST)


def _without(body: Assembly, soft: NDArray) -> Assembly:
    """The body without the stiffness of these hinges."""
    sheet: Any = body.sheet
    return body.on(sheet.weakened(soft)) if soft.any() else body
