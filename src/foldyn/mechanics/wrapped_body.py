"""A body with further terms of energy on the displacements of another one's nodes."""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.materials import HingeLaw
from foldyn.mechanics.body import Body, FoldHinges, SoftHinges, Strains
from foldyn.mechanics.term import Folds


class WrappedBody(Body):
    """A body around another one, whose answers it passes on; see `mechanics.body.Body`.

    Parameters
    ----------
    inner : Body
    """

    def __init__(self, inner: Body) -> None:
        self.inner = inner
        self.size, self.rows, self.hidden = inner.size, inner.rows, inner.hidden
        self.offsets = inner.offsets

    def around(self, inner: Body) -> Self:
        """The same around another body with the same nodes."""
        raise NotImplementedError

    def nodal(self, q: NDArray) -> NDArray:
        """Displacements (n, 3) of the nodes."""
        nodes = self.size - len(self.hidden)
        return np.ascontiguousarray(q, float).reshape(-1)[:nodes].reshape(-1, 3)

    def added(self, force: NDArray) -> NDArray:
        """A vector (m,) of forces on nodes (n, 3)."""
        return np.concatenate([force.ravel(), np.zeros(len(self.hidden))])

    def dofs(self, displacement: NDArray, push: NDArray | None = None) -> NDArray:
        """See `Body`."""
        return self.inner.dofs(displacement, push)

    def angles(self, q: NDArray) -> NDArray:
        """See `Body`."""
        return self.inner.angles(q)

    def turn(self, q: NDArray, other: NDArray) -> float:
        """See `Body`."""
        return self.inner.turn(q, other)

    def scale(self) -> NDArray:
        """See `Body`."""
        return self.inner.scale()

    def longest(self) -> float:
        """See `Body`."""
        return self.inner.longest()

    def holds(self, q: NDArray) -> sparse.csr_array:
        """See `Body`."""
        return self.inner.holds(q)

    def turning_moments(self) -> float:
        """See `Body`."""
        return self.inner.turning_moments()

    def soft_hinges(self, q: NDArray) -> SoftHinges:
        """See `Body`."""
        return self.inner.soft_hinges(q)

    def soft_tangent(self, q: NDArray, slope: NDArray) -> sparse.csr_array:
        """See `Body`."""
        return self.inner.soft_tangent(q, slope)

    @property
    def rest_angles(self) -> NDArray:
        """See `Body`."""
        return self.inner.rest_angles

    def rest_law(self, number: int) -> HingeLaw:
        """See `Body`."""
        return self.inner.rest_law(number)

    def fold_hinges(self) -> FoldHinges:
        """See `Body`."""
        return self.inner.fold_hinges()

    def bend_hinges(self) -> FoldHinges:
        """See `Body`."""
        return self.inner.bend_hinges()

    def strains(self) -> Strains | None:
        """See `Body`."""
        return self.inner.strains()

    def folded(self, rest: NDArray) -> Self:
        """See `Body`."""
        return self.around(self.inner.folded(rest))

    def actuated(self, numbers: NDArray) -> tuple[Self, NDArray, NDArray]:
        """See `Body`."""
        inner, rows, place = self.inner.actuated(numbers)
        return self.around(inner), rows, place

    @property
    def hinges(self) -> NDArray:
        """See `Body`."""
        return self.inner.hinges

    @property
    def folds(self) -> Folds:
        """See `Body`."""
        return self.inner.folds

    def series(self) -> tuple[NDArray, NDArray]:
        """See `Body`."""
        return self.inner.series()

    def turned(self) -> tuple[NDArray, NDArray]:
        """See `Body`."""
        return self.inner.turned()
