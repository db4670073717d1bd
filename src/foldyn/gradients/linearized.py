"""Derivatives of products z' K x and z' M x with the matrices of small motions.

K is the derivative of the forces. So the derivative of z' K x is the pullback of the forces with
weights z, differentiated along x. This is done by differences with turns so small that the error is
1e-12. If hinges are near a kink of their law, such as superlinear hinges near rest, the steps for
hinges are a hundredth of the distance to the kink. Bars and panels keep the larger steps, because
shorter ones would show their round-off.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.condensation.term import SuperelementsTerm, add_mass_products
from foldyn.dynamics.modal_damping import soft_at_rest
from foldyn.gradients.parameters import nothing
from foldyn.gradients.path import Balance, seen_through
from foldyn.linear.linearized import Linearized
from foldyn.materials import HingeLaw
from foldyn.materials.series import in_series
from foldyn.mechanics import angles
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.pullback import Pullback, refuse_lacking
from foldyn.mechanics.sheet_term import NO_DOF, FoldHinges, SheetTerm
from foldyn.mechanics.term import nodal

TURN = 1e-3  # rad: largest turn in a difference along a motion
SMALL = 1e-6  # size of the motion used to measure turns, relative to the longest bar
# largest step, relative to the way to a kink; superlinear hinges closer than this (rad) are soft
NEAR, NEAREST = 1e-2, 4e-7


class Products:
    """Derivatives of products of free-dof motions with the matrices of a case.

    Parameters
    ----------
    linear : Linearized
    equilibrium : bool
        Whether the state is an equilibrium under the loads, which moves with the design. Otherwise
        only massless dofs move with the design, as they are in balance for given nodes.
    displacement : (n, 3), optional
        State of the tangent K, m; by default the state of `linear`.
    """

    def __init__(
        self, linear: Linearized, equilibrium: bool, displacement: NDArray | None = None
    ) -> None:
        self._linear, self._case = linear, linear.case
        body, self._factor = linear.case.body, float(equilibrium)
        self.q = body.dofs(linear.displacement if displacement is None else displacement)
        moving = None if equilibrium else body.hidden
        self._balance = Balance(linear.case, self.q, moving)
        # the stiffness of a linear model does not depend on the state
        self._moves = not linear.case.structure.linear and (equilibrium or len(body.hidden) > 0)
        at_rest = soft_at_rest(linear.case, body, self.q)[0]
        self._sheet = body.sheet.weakened(at_rest) if at_rest.any() else body.sheet
        self._soft = at_rest.any() and self._sheet.folds.stiffness != body.sheet.folds.stiffness
        self._balanced = Pullback(body)  # with the small slopes of soft hinges
        self._pullback = Pullback(body.on(self._sheet)) if at_rest.any() else self._balanced
        self._mass = sparse.csr_array(linear.case.mass)
        self._mass.sort_indices()
        self._rows = np.repeat(np.arange(self._mass.shape[0]), np.diff(self._mass.indptr))

    def nothing(self) -> dict[str, NDArray]:
        """Gradient of zeros with respect to the numbers of the case."""
        return nothing(self._case, self._pullback)

    def add_stiffness(
        self, z: NDArray, x: NDArray, by: float, total: dict[str, NDArray]
    ) -> NDArray:  # fmt: skip
        """Add the gradient of `by` z' K x, z and x (nf,); returns its derivatives (m,) to dofs."""
        weight, motion = (self._linear.whole(each[:, None])[:, 0] for each in (z, x))
        state = np.zeros(len(self.q))
        if by == 0.0 or not motion.any():
            return state
        if self._case.structure.linear:
            return self._difference(self._pullback, weight, motion, 1.0, by, total)
        small = SMALL * self._sheet.longest() / np.abs(motion).max()
        turn = self._case.body.turn(self.q, self.q + small * motion)
        step = TURN * small / max(turn, SMALL)  # nothing turns in translations
        near = NEAR * _way_to_kinks(self._sheet, self.q, small * motion) * small
        parts = [(self._pullback, step, by)]
        if near < step:
            parts += [(self._hinges, step, -by), (self._hinges, near, by)]
        for pullback, length, factor in parts:
            state += self._difference(pullback, weight, motion, length, factor, total)
        return state

    def _difference(
        self, pullback: Pullback, weight: NDArray, motion: NDArray, step: float, by: float,
        total: dict[str, NDArray],
    ) -> NDArray:  # fmt: skip
        """Add fourth-order differences of a pullback along a motion; returns the part for q."""
        state = np.zeros(len(self.q))
        for place, share in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
            factor = by * share / (12.0 * step)
            pullback.clear()
            state += factor * pullback.at(self.q + place * step * motion, weight)
            if np.any(self._soft):
                pullback.gradient["0.hinge_stiffness"][self._soft] = 0.0
            for name, out in pullback.gradient.items():
                total[name] += factor * out
        return state

    @cached_property
    def _hinges(self) -> Pullback:
        """Pullback of the hinge forces of the sheet alone."""
        alone = self._sheet.hinges_alone()
        assert alone is not None
        return Pullback(Assembly(alone))

    def add_mass(self, z: NDArray, x: NDArray, by: float, total: dict[str, NDArray]) -> None:
        """Add the gradient of `by` z' M x, with z and x on free dofs (nf,) or all nodes (n, 3)."""
        sheet, size = self._case.body.sheet, len(self.q)
        if isinstance(sheet, SuperelementsTerm):
            one, other = (
                np.append(each, np.zeros(size - each.size)) if each.ndim > 1
                else self._linear.whole(each[:, None])[:, 0]
                for each in (z, x)
            )  # fmt: skip
            add_mass_products(sheet.parts, one, other, by, total["0.mass"])
            size = self._case.structure.nodes.size
            one, other = one[:size].reshape(-1, 3), other[:size].reshape(-1, 3)
            row, column = self._case.carried.tocoo().coords
            total["carried"] += by * (one[row] * other[column]).sum(axis=1)
            return
        one, other = (
            each if each.ndim > 1 else self._linear.expanded(each[:, None]).reshape(-1, 3)
            for each in (z, x)
        )
        product = np.einsum("ea,ea->e", one[self._rows], other[self._mass.indices])
        total["mass"] += by * product

    def add_state(self, state: NDArray, total: dict[str, NDArray]) -> None:
        """Add the effect of the state moving with the design.

        state : derivatives (m,) of the quantity with respect to the state.
        """
        if self._moves:
            adjoint = self._balance.under(state)
            seen_through(self._case, self.q, state, adjoint, self._balanced, total, self._factor)


def refuse(linear: Linearized, what: str) -> None:
    """Refuse linearizations without derivatives, with a remedy."""
    case = linear.case
    lacks = {
        "contact": case.contact is not None,
        "air": case.air is not None,
        "creases that yield, creep or relax": linear.branches is not None,
        "slopes of finite amplitude (secant)": linear.secant is not None,
        "folds that are actuated about an equilibrium (Actuate, Temperature)": (
            bool(case.rest_terms) and bool(linear.displacement.any())
        ),
        "loads that depend on the displacement (Pressure, CreaseMoment)": bool(
            case.following_terms and not case.structure.linear
        ),
    }
    refuse_lacking(what, lacks)


def _way_to_kinks(sheet: SheetTerm, q: NDArray, motion: NDArray) -> float:
    """Least factor on a small motion (m,) at which a hinge reaches a kink or pole of its law."""
    way = np.inf
    for hinges, law in zip((sheet.fold_hinges(), sheet.bend_hinges()), sheet.laws, strict=False):
        if not len(hinges.row):
            continue
        parameters = sheet.folds.parameters[hinges.row]
        here, there = (_creased(sheet, hinges, law, at) for at in (q, q + motion))
        reach = np.maximum(law.reach(here, hinges.rest, parameters), NEAREST)
        with np.errstate(divide="ignore"):
            way = min(way, float((reach / np.abs(there - here)).min()))
    return way


def _creased(sheet: SheetTerm, hinges: FoldHinges, law: HingeLaw, q: NDArray) -> NDArray:
    """Angles (k,), rad, that enter the laws of hinges."""
    points = (hinges.corners + nodal(q)[hinges.nodes]).reshape(-1, 3)
    turned = angles(points, np.arange(len(points), dtype=np.uint32).reshape(-1, 4))
    there = np.where(hinges.hidden == NO_DOF, 0, hinges.hidden)
    turned -= (q[there] * hinges.hidden_turn).sum(axis=1)
    share, offset = (each[hinges.row] for each in sheet.series())
    turned += offset[:, 0]
    if (share < 1.0).any():  # see `materials.series`
        turned -= (1.0 - share) * in_series(law, turned, hinges.rest, share)[1]
    return turned
