"""A case's sheet with given factors of its loads: all dofs, free strains and distributed loads."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.case_assembly import SomeLoads
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import following_force, joined
from foldyn.structures.discretized import Distributed


class LoadedSheet:
    """The sheet of a case in states that are known on its nodes.

    Dofs without mass are in balance, with the loads; so are the dofs of superelements between
    vertices. Factors (k,) are those of the loads of the case, in their order.
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        each = [(i, SomeLoads(case, [i])) for i in range(len(case.loads))]
        self._following = joined((part, i) for i, own in each for part, _ in own.following_terms)
        self._turns = [(i, change) for i, own in each for change, _ in own.rest_terms]
        self._swellings = [(i, swelling) for i, own in each for swelling, _ in own.swellings]

    @cached_property
    def _distributed(self) -> list[tuple[int, Distributed]]:
        loads = enumerate(self.case.loads)
        found = [(i, own.distributed(self.case.structure, f"loads[{i}]")) for i, own in loads]
        return [(i, own) for i, own in found if own is not None]

    def body(self, factors: NDArray) -> Assembly:
        """The sheet with its folds actuated."""
        body = self.case.elastic_body
        if not self._turns:
            return body
        turned = sum(factors[i] * change for i, change in self._turns)
        return body.folded(body.sheet.rest_angles + turned)

    def dofs(self, displacement: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """All dofs (m,) at displacements (n, 3), m."""
        body = self.body(factors)
        extended = np.concatenate([displacement.ravel(), np.zeros(len(body.hidden))])
        push = following_force(self._following, extended, np.ascontiguousarray(factors[:, None]))
        return body.dofs(displacement, push)

    def free(self, factors: NDArray) -> tuple[NDArray, NDArray] | None:
        """Strains and angles at which panels have no stress, as `Swelling.free`; None if cold."""
        parts = [[factors[i] * each for each in own.free] for i, own in self._swellings]
        if not parts:
            return None
        strain, angle = (np.sum(each, axis=0) for each in zip(*parts, strict=True))
        return strain, angle

    def distributed(self, factors: NDArray) -> Distributed:
        """Loads on panels and creases, and the swelling of panels."""
        total = {}
        for name in ("panels", "creases", "strain", "curvature"):
            parts = [(i, getattr(own, name)) for i, own in self._distributed]
            there = [factors[i] * own for i, own in parts if own is not None]
            total[name] = np.sum(there, axis=0) if there else None
        return Distributed(**total)
