"""Edges that give way near their ends as terms of a model; see `mechanics.edge_gives`."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.edge_gives import EdgeGives, balanced_kernels, gives_kernels
from foldyn.mechanics.edge_gives_pullback import balanced_pulled, gives_pulled
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of
from foldyn.mechanics.term import CompiledTerm, Term, Unstrained, Way, nodal


class EdgeGivesTerm(Term):
    """Gives as hidden dofs; their energy counts as energy of the sheet's bars.

    Parameters
    ----------
    gives : EdgeGives
    rows : int
        Of the arrays that hold the dofs.
    first : int
        Dof of the first give.
    """

    owns_hidden: ClassVar[bool] = True

    def __init__(self, gives: EdgeGives, rows: int, first: int) -> None:
        self.gives, self.rows, self.first = gives, rows, first

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        return gives_kernels(self.gives, self.rows, self.first)

    def arrays(self) -> Arrays:
        """Arrays that its forces depend on; see `Term`."""
        return arrays_of(self.gives, "strain", "along")

    def pulled(self) -> Pulled:
        """Pullback of its forces; see `Term`."""
        return gives_pulled(self.gives, self.rows, self.first)

    @cached_property
    def _dofs(self) -> NDArray:
        """Dofs (p, 3c + k) of each panel: of its nodes, then its gives."""
        nodal = 3 * self.gives.nodes[:, :, None] + np.arange(3)
        return np.concatenate(
            [nodal.reshape(len(nodal), -1), self.first + self.gives.number], axis=1
        )

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of its tangent entries; see `Term`."""
        dofs, count = self._dofs, self._dofs.shape[1]
        return np.repeat(dofs, count, axis=1).ravel(), np.tile(dofs, (1, count)).ravel()

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Tangent entries (k,), N/m; see `Term`."""
        return panel_tangents(self.gives, nodal(q), nodal(q), self._gives(q)).ravel()

    def mean_entries(self, q0: NDArray, q1: NDArray, way: Way, floor: float) -> NDArray:
        """See `Term`."""
        mean = 0.5 * (self._gives(q0) + self._gives(q1))
        return 0.5 * panel_tangents(self.gives, nodal(q0), nodal(q1), mean).ravel()

    def _gives(self, q: NDArray) -> NDArray:
        return np.ravel(q)[self.first : self.first + self.gives.count]

    def unstrained(self, q: NDArray) -> Unstrained:
        """The model without strain at q; see `Term`."""
        size = (q.size, q.size)
        loose = panel_tangents(self.gives, nodal(q), nodal(q), np.zeros(self.gives.count))
        tangent = sparse.csr_array(sparse.coo_array((loose.ravel(), self.places), size))
        own = sparse.coo_array(self.gives.matrix)
        places = tuple(place + self.first for place in own.coords)
        alone = sparse.csr_array(sparse.coo_array((own.data, places), size))
        return Unstrained(tangent, alone, lambda motion: 0.0)

    def placed(self, order: NDArray, before: Any) -> EdgeGivesTerm:
        """The term with nodes in memory order; see `Term`."""
        gives = self.gives._replace(nodes=ranks(order)[self.gives.nodes])
        return type(self)(gives, self.rows, self.first)


class BalancedGivesTerm(EdgeGivesTerm):
    """Gives in balance at every displacement, for methods that need mass."""

    owns_hidden: ClassVar[bool] = False

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        return balanced_kernels(self.gives, self.rows)

    def pulled(self) -> Pulled:
        """Pullback of its forces; see `Term`."""
        return balanced_pulled(self.gives, self.rows)

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns of all dofs, which are all coupled; see `Term`."""
        size = 3 * self.rows
        return np.repeat(np.arange(size), size), np.tile(np.arange(size), size)

    def _gives(self, q: NDArray) -> NDArray:
        return self.gives.balanced(self.gives.strains(nodal(q)))

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Tangent entries (k,), N/m; see `Term`."""
        return self._condensed(q, self._gives(q)).ravel()

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Tangent, without the places, which would need more room than the matrix; see `Term`."""
        return sparse.csr_array(self._condensed(q, self._gives(q)))

    def mean_entries(self, q0: NDArray, q1: NDArray, way: Way, floor: float) -> NDArray:
        """See `Term`."""
        return Term.mean_entries(self, q0, q1, way, floor)

    def _condensed(self, q: NDArray, g: NDArray) -> NDArray:
        """Tangent of the displacements with gives g in balance."""
        full = EdgeGivesTerm(self.gives, self.rows, self.first)
        u, size = nodal(q), 3 * self.rows
        entries = (panel_tangents(self.gives, u, u, g).ravel(), full.places)
        whole = sparse.csc_array(
            sparse.coo_array(entries, shape=(self.first + self.gives.count,) * 2)
        )
        across, own = (part.toarray() for part in (whole[self.first :, :size], self.gives.matrix))
        return whole[:size, :size].toarray() - across.T @ np.linalg.solve(own, across)

    def unstrained(self, q: NDArray) -> Unstrained:
        """The model without strain at q; see `Term`."""
        loose = self._condensed(q, np.zeros(self.gives.count))
        return Unstrained(
            sparse.csr_array(loose), sparse.csr_array(loose.shape), lambda motion: 0.0
        )


def panel_tangents(gives: EdgeGives, u0: NDArray, u1: NDArray, g: NDArray) -> NDArray:
    """Tangents (p, 3c + k, 3c + k), N/m, of all panels at u0 = u1 and gives g (g,).

    From u0 to another u1, with g the mean gives, it is twice the derivative of the mean forces by
    u1 and the end gives.
    """
    (panels, corners), (bars, given) = gives.nodes.shape, gives.across.shape[1:]
    end = 3 * corners
    out = np.zeros((panels, end + given, end + given))
    way = np.zeros((panels, bars, corners))  # -1 and 1 at the ends of the bars
    at = np.arange(panels)[:, None], np.arange(bars)
    np.add.at(way, (*at, gives.ends[:, :, 0]), -1.0)
    np.add.at(way, (*at, gives.ends[:, :, 1]), 1.0)
    turn = gives.per_length2[:, :, None] * way
    last, first = gives.vectors(u1), gives.vectors(u0)
    middle = np.einsum("pbc,pbx->pbcx", turn, 0.5 * (first + last)).reshape(panels, bars, end)
    later = np.einsum("pbc,pbx->pbcx", turn, last).reshape(panels, bars, end)
    out[:, :end, end:] = np.einsum("pbd,pbk->pdk", middle, gives.across)
    out[:, end:, :end] = np.einsum("pbd,pbk->pkd", later, gives.across)
    out[:, end:, end:] = gives.stiffness
    pull = np.einsum("pbk,pk->pb", gives.across, g[gives.number])
    stressed = np.einsum("pb,pbc,pbd->pcd", pull, turn, way)
    blocks = out[:, :end, :end].reshape(panels, corners, 3, corners, 3)
    for axis in range(3):
        blocks[:, :, axis, :, axis] += stressed
    out[:, :end, :end] = blocks.reshape(panels, end, end)
    return out
