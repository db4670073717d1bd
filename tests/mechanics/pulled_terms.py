"""Terms on their own: their forces, their pullbacks, and the same with other arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.constant_damping import DampingMatrix, DampingRows
from foldyn.mechanics.pullback import Pullbacks, pull_all
from foldyn.mechanics.sheet_term import SheetTerm
from foldyn.mechanics.term import FORCES, Term, Terms, evaluate
from foldyn.mechanics.threads import ThreadPart, team

MODELS = {
    "MembranesTerm": "membranes",
    "BarsPlatesTerm": "model",
    "ShellTerm": "model",
    "SpringsTerm": "springs",
    "ClampsTerm": "model",
    "ViscousTerm": "elements",
    "ViscousPanelsTerm": "panels",
}
"""The attribute with the arrays of each term."""


class Lone(NamedTuple):
    """A term of a body, without the others."""

    term: Any
    size: int
    rows: int

    @property
    def model(self) -> Any:
        return getattr(self.term, MODELS[type(self.term).__name__])

    def changed(self, name: str, array: NDArray) -> Lone:
        """The same with another array."""
        if isinstance(self.term, DampingRows):
            return self._replace(term=DampingRows(array))
        if isinstance(self.term, DampingMatrix):
            matrix = self.term.matrix.copy()
            matrix.data = array
            return self._replace(term=DampingMatrix(matrix))
        model = _replaced(self.model, name.split("."), array)
        if isinstance(self.term, SheetTerm):
            return self._replace(term=self.term._with(**model._asdict()))
        others = (getattr(self.term, name) for name in ("rows", "first") if name in vars(self.term))
        return self._replace(term=type(self.term)(model, *others))

    def force(self, q: NDArray, v: NDArray) -> NDArray:
        """Its forces (m,) at q and v (m,)."""
        u, speed, force = (np.zeros((self.rows, 3)) for _ in range(3))
        u.ravel()[: self.size], speed.ravel()[: self.size] = q, v
        held = self.term.compiled(*self._memory(), 0)
        kernel = np.zeros((1, 9), np.int64)
        kernel[0, FORCES] = held.kernels[FORCES].at(held.context)
        context = np.array([held.context.address])
        evaluate(Terms(context, kernel, np.zeros(3)), u, speed, force, np.zeros(0))
        return force.ravel()[: self.size]

    def _memory(self) -> tuple[Any, Any]:
        if isinstance(self.term, SheetTerm):
            own = self.term.scratches(1)[0]
            return ThreadPart(own.team, own.own, own.angle, own.fold_angle, own), own
        angle = np.zeros(len(self.term.hinges))
        part = ThreadPart(team(1)[0], np.array([0, self.rows]), angle, angle, None)
        return part, self.term.memories([part])[0]

    def pulled(
        self, q: NDArray, v: NDArray, w: NDArray
    ) -> tuple[NDArray, NDArray, dict[str, NDArray]]:
        """Derivatives of w . F by q, by v, and by the arrays."""
        own = self.term.pulled()
        kernel, context = own.kernel.at(own.context), own.context.address
        u, speed, weight, product, rate = np.zeros((5, self.rows, 3))
        for rows, values in ((u, q), (speed, v), (weight, w)):
            rows.ravel()[: self.size] = values
        terms = Pullbacks(np.array([context]), np.array([kernel]))
        pull_all(terms, u, speed, 0.0, weight, product, rate)
        by_q, by_v = product.ravel()[: self.size], rate.ravel()[: self.size]
        return by_q, by_v, dict(own.gradient)


def lone(body: Assembly, kind: type[Term], rank: int = 0) -> Lone:
    """A term of a kind of a body."""
    found = [term for term in body.terms if type(term) is kind]
    return Lone(found[rank], body.size, body.rows)


def _replaced(model: Any, path: list[str], array: NDArray) -> Any:
    """A named tuple with another array at a path."""
    name, *rest = path
    return model._replace(**{name: _replaced(getattr(model, name), rest, array) if rest else array})
