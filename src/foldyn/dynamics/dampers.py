"""Dashpots and damped creases of a case: a constant matrix, and elements that follow the motion.

Dashpots with a direction of their own, and those that act in any direction from the ground, have a
constant matrix. Dashpots along the line between their nodes and creases are `mechanics.viscous`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.mechanics.attached import GROUND
from foldyn.mechanics.body import Body, Numbering
from foldyn.mechanics.viscous import Viscous, viscous, viscous_matrix


class Dampers(NamedTuple):
    """What a case has of them, on its m dofs in their own order."""

    constant: sparse.csr_array  # (m, m) N s/m
    elements: Viscous

    def matrix(self, q: NDArray) -> sparse.csr_array:
        """Matrix (m, m), N s/m, at the dofs q (m,)."""
        size = self.constant.shape[0]
        if not len(self.elements.coefficient):
            return self.constant
        return sparse.csr_array(self.constant + viscous_matrix(self.elements, q, size))

    def placed(self, by: Numbering) -> Viscous:
        """Elements as they stand in memory while a motion is computed."""
        elements, nodal = self.elements, 3 * len(by.order)
        dofs = np.where(elements.dofs < nodal, by.dofs(np.minimum(elements.dofs, nodal - 1)), 0)
        dofs = np.where(elements.dofs < nodal, dofs, elements.dofs)
        return elements._replace(dofs=dofs)


def dampers(case: Case) -> Dampers:
    """Dampers of a case.

    Raises
    ------
    InputError
        The structure does not say which hinges are those of a damped crease.
    """
    body, nodes = case.body, case.structure.nodes
    pairs, strength = [np.zeros((0, 2), np.int64)], [np.zeros(0)]
    constant = sparse.csr_array((body.size, body.size))
    for place, dashpot in case.dashpots:
        ends = dashpot.ends(case.structure, place)
        if dashpot.coefficient == 0.0:
            continue
        along = dashpot.directions
        if along is None:
            pairs.append(ends)
            strength.append(np.full(len(ends), dashpot.coefficient))
            continue
        block = dashpot.coefficient * (along.T @ along)
        constant = constant + _fixed(ends, block, body.size)
    ends = np.concatenate(pairs)
    return Dampers(sparse.csr_array(constant), _elements(case, body, nodes, ends, strength))


def _elements(
    case: Case, body: Body, nodes: NDArray, pairs: NDArray, strength: list[NDArray]
) -> Viscous:
    """Axial dashpots between pairs (p, 2) of nodes, and the hinges of damped creases."""
    hinges, damping = body.fold_hinges(), case.crease_damping
    unknown = np.setdiff1d(np.flatnonzero(damping), hinges.fold)
    if unknown.size:
        raise InputError(f"damping: this structure cannot damp crease {unknown[0]}: leave it out")
    damped = damping[hinges.fold] > 0.0
    corners = hinges.corners[damped]
    length = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    return viscous(
        pairs, nodes[pairs[:, 1]] - nodes[pairs[:, 0]], np.concatenate(strength),
        hinges.nodes[damped], corners, hinges.hidden[damped], hinges.per_hidden,
        damping[hinges.fold[damped]] * length,
    )  # fmt: skip


def _fixed(ends: NDArray, block: NDArray, size: int) -> sparse.csr_array:
    """Matrix of dashpots between ends (k, 2), of a block (3, 3) each."""
    ends = ends[:, ends[0] != GROUND]
    sign = np.array([1.0]) if ends.shape[1] == 1 else np.array([1.0, -1.0])
    within = np.einsum("i,j,pq->ipjq", sign, sign, block).reshape(3 * len(sign), -1)
    dofs = (3 * ends[:, :, None] + np.arange(3)).reshape(len(ends), -1)
    row = np.repeat(dofs, dofs.shape[1], axis=1)
    column = np.tile(dofs, (1, dofs.shape[1]))
    values = np.tile(within.ravel(), len(ends))
    return sparse.csr_array((values, (row.ravel(), column.ravel())), (size, size))
