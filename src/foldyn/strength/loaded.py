"""A case's sheet with given factors of its loads: all dofs, free strains and distributed loads.

Moments of creases are what a crease itself transmits, without the turns of the panels beside it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.case_assembly import SomeLoads
from foldyn.condensation import Superelements
from foldyn.materials.series import in_series
from foldyn.mechanics import angles
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import following_force, joined
from foldyn.mechanics.sheet_term import NO_DOF
from foldyn.structures.discretized import Discretized, Distributed
from foldyn.structures.mesh import lengths


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


def crease_moments(structure: Discretized, body: Assembly, q: NDArray) -> NDArray[np.float64]:
    """Moments (nf,) of the creases per length, N, positive if the crease is too far open.

    The mean along each crease. Moments of laws with memory are those of their elastic part.

    q : (m,) dofs of `body`, whose folds may be actuated.
    """
    law, length = structure.fold_law.elastic, crease_lengths(structure)
    sheet, hinges = body.sheet, body.sheet.fold_hinges()
    if isinstance(structure, Superelements):
        assert sheet.crease_turns is not None
        rest, change = structure.fold_rest, hinges.rest - structure.fold_rest
        at_rest = in_series(law, structure.pattern.dihedrals, rest, 1.0)[1]
        turned = -(sheet.crease_turns.mean @ q) - change
        return (structure.fold_stiffness * at_rest + structure.slope * turned) / length
    x = structure.nodes + q[: structure.nodes.size].reshape(-1, 3)
    corners = np.arange(hinges.corners.size // 3).reshape(-1, 4)
    alone = angles(hinges.corners.reshape(-1, 3), corners)
    theta = np.where(hinges.alone, alone, angles(x, hinges.nodes))
    hidden = np.where(hinges.hidden == NO_DOF, 0, hinges.hidden)
    theta = theta - (hinges.hidden_turn * q[hidden]).sum(axis=1)
    if sheet.offsets:
        theta = theta + sheet.rest_angles[-sheet.offsets :][hinges.fold]
    share = structure.hinge_kinds[0].share[hinges.fold]
    law = law.at(hinges.fold)
    moment = hinges.stiffness * in_series(law, theta, hinges.rest, share)[1]
    return np.bincount(hinges.fold, moment, len(length)) / length


def crease_lengths(structure: Discretized) -> NDArray[np.float64]:
    """Lengths (nf,) of the creases, m."""
    return lengths(structure.pattern.vertices, structure.pattern.creases)
