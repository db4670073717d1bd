"""What supports do to a case: dofs that are held, moved, tied together or sprung."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.constraints import Constraints
from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.straight import Straight, supported_points
from foldyn.cases.supports import BaseMotion, Fix, Impose, Link
from foldyn.cases.terms import Summands, Terms, summed
from foldyn.cases.ties import equations_of, values_of
from foldyn.errors import InputError
from foldyn.mechanics.term import Term
from foldyn.structures.discretized import read_only


class Supported:
    """Supports of a case, which has `structure` and `supports`; see `Case`."""

    structure: Any
    supports: Sequence[Any]

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each node is held along each axis, by Fix or Impose, shape (n, 3)."""
        return read_only(self._straight.held())

    @cached_property
    def imposed(self) -> NDArray[np.bool_]:
        """Whether an Impose moves each node along each axis, shape (n, 3)."""
        return read_only(self._straight.moved(self._stated))

    @cached_property
    def _straight(self) -> Straight:
        return Straight(self.structure, self._stated | self._held)

    @cached_property
    def _stated(self) -> NDArray[np.bool_]:
        """Whether an Impose names each node along each axis, shape (n, 3)."""
        mask = np.zeros((len(self.structure.nodes), 3), dtype=bool)
        for place, support in self._supports(Impose):
            if support.axis is None:
                continue
            nodes, _ = supported_points(self.structure, support, place)
            axis = AXES.index(support.axis)
            for taken, both in ((self._held, "held and imposed"), (mask, "imposed twice")):
                twice = nodes[taken[nodes, axis]]
                if twice.size:
                    raise InputError(
                        f"{place}: node {twice[0]} is {both} along {support.axis}, a "
                        "contradictory support; leave out one of the two"
                    )
            mask[nodes, axis] = True
        return mask

    @cached_property
    def _held(self) -> NDArray[np.bool_]:
        """Whether a Fix holds each node along each axis, shape (n, 3)."""
        mask = np.zeros((len(self.structure.nodes), 3), dtype=bool)
        for place, support in self._supports(Fix):
            nodes, _ = supported_points(self.structure, support, place)
            for axis in support.axes or "":
                mask[nodes, AXES.index(axis)] = True
        return mask

    @cached_property
    def constraints(self) -> Constraints:
        """What ties displacements together: directions that are held, links, rigid panels."""
        equations = equations_of(self.structure, self._supports(Fix, Impose, Link))
        return Constraints(equations, self.fixed.ravel())

    @property
    def free_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are free, increasing; all others depend on them."""
        return self.constraints.free

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Whether supports keep each node where it stands along each axis, shape (n, 3)."""
        held = self.fixed & ~self.imposed
        for vector, _ in self.base_terms:
            held &= vector == 0.0
        return read_only(held)

    @property
    def imposed_slaves(self) -> NDArray[np.int64]:
        """Numbers of the dofs that `Impose` along a direction moves with others of their nodes."""
        return self.constraints.slaves_of([place for place, _ in self._supports(Impose)])

    @property
    def reaction_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis on which supports exert forces, increasing."""
        return self.constraints.supported

    @cached_property
    def supported_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are held, increasing."""
        return np.flatnonzero(self.fixed.ravel()).astype(np.int64)

    @cached_property
    def imposed_terms(self) -> Terms:
        """Displacements (m) of imposed dofs at factor 1, shape (n, 3), each with its history."""
        return summed(self._imposed())

    def _imposed(self) -> Summands:
        for place, support in self._supports(Impose):
            nodes, value = supported_points(self.structure, support, place)
            vector, along = np.zeros((len(self.structure.nodes), 3)), {place: value}
            if support.axis is not None:
                vector[nodes, AXES.index(support.axis)] = value
                along = {}
            yield self._tied(self._straight.carried(vector), place, along), support.history

    @cached_property
    def prescribed_terms(self) -> Terms:
        """What each `Impose` says, alone, along its axis or direction: (n, 3), m, with history."""
        return summed(self._prescribed()) if self.constraints else self.imposed_terms

    def _prescribed(self) -> Summands:
        for place, support in self._supports(Impose):
            vector = np.zeros((len(self.structure.nodes), 3))
            nodes, value = supported_points(self.structure, support, place)
            vector[nodes] = np.multiply.outer(value, unit_vector(support.direction or support.axis))
            yield vector, support.history

    def _tied(self, shape: NDArray, place: str, values: Mapping[str, Any]) -> NDArray:
        """Displacements (n, 3), m, when supports move as in a shape and by values along theirs."""
        ties = self.constraints
        return ties.moved(shape, values_of(ties.owners, values), place) if ties else shape

    @cached_property
    def base_terms(self) -> Terms:
        """Displacements (m) of the base at factor 1, shape (n, 3), each with its history."""
        return summed(self._moved_by_the_base())

    def _moved_by_the_base(self) -> Summands:
        base = self.fixed & ~self.imposed
        for place, support in self._supports(BaseMotion):
            axis = AXES.index(support.axis)
            along = {
                where: support.value * unit_vector(other.direction)[axis]
                for where, other in self._supports(Fix)
                if other.direction is not None
            }
            if not base[:, axis].any() and not any(along.values()):
                raise InputError(
                    f"{place}: the base moves along {support.axis}, but no support holds a "
                    f'node along {support.axis}; add one with axes = "{support.axis}", or leave '
                    "out the base motion"
                )
            vector = np.zeros(base.shape)
            vector[base[:, axis], axis] = support.value
            yield self._tied(self._straight.carried(vector), place, along), support.history

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """What its supports add to the energy, by their kinds."""
        kinds = dict.fromkeys(type(support) for support in self.supports)
        terms = (kind.term(list(self._supports(kind)), self.structure) for kind in kinds)
        return tuple(term for term in terms if term is not None)

    def _supports(self, *kinds: type) -> Iterator[tuple[str, Any]]:
        """Supports of some kinds, with their places for messages."""
        places = ((f"supports[{i}]", support) for i, support in enumerate(self.supports))
        return ((place, support) for place, support in places if isinstance(support, kinds))
