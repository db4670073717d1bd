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
from foldyn.mechanics.block_matrix import assembled, blocks_of_ends, pairs_of_ends
from foldyn.mechanics.body import Body, Numbering, no_fold_hinges
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
        return self.elements._replace(dofs=placed(self.elements.dofs, by))


def placed(dofs: NDArray, by: Numbering) -> NDArray:
    """Dofs of elements as they stand in memory while a motion is computed."""
    nodal = 3 * len(by.order)
    return np.where(dofs < nodal, by.dofs(np.minimum(dofs, nodal - 1)), dofs)


def dampers(case: Case) -> Dampers:
    """Dampers of a case.

    Raises
    ------
    InputError
        The structure does not say which hinges are those of a damped crease.
    """
    body, nodes = case.elastic_body, case.structure.nodes
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
        blocks = blocks_of_ends(ends, np.tile(block, (len(ends), 1, 1)))
        constant = constant + assembled(pairs_of_ends(ends), blocks, body.size)
    ends = np.concatenate(pairs)
    return Dampers(sparse.csr_array(constant), _elements(case, body, nodes, ends, strength))


def _elements(
    case: Case, body: Body, nodes: NDArray, pairs: NDArray, strength: list[NDArray]
) -> Viscous:
    """Axial dashpots between pairs (p, 2) of nodes, damped creases, and what strains a sheet."""
    damping = case.crease_damping
    hinges = body.fold_hinges() if damping.any() else no_fold_hinges()
    unknown = np.setdiff1d(np.flatnonzero(damping), hinges.fold)
    if unknown.size:
        raise InputError(f"damping: this structure cannot damp crease {unknown[0]}: leave it out")
    damped = damping[hinges.fold] > 0.0
    axial, along = np.concatenate(strength), nodes[pairs[:, 1]] - nodes[pairs[:, 0]]
    rows, corners, hidden = hinges.nodes[damped], hinges.corners[damped], hinges.hidden[damped]
    turning = (damping[hinges.fold] * hinges.length)[damped]
    if beta := case.strain_damping:
        strains = body.strains()
        assert strains is not None  # or the case would have refused it
        stiff = strains.hinge_stiffness > 0.0
        pairs, along = (
            np.concatenate([pairs, strains.bars]),
            np.concatenate([along, strains.vector]),
        )
        axial = np.concatenate([axial, beta * strains.bar_stiffness])
        rows = np.concatenate([rows, strains.hinges[stiff]])
        corners = np.concatenate([corners, strains.corners[stiff]])
        hidden = np.concatenate([hidden, np.full((int(stiff.sum()), 2), -1)])
        turning = np.concatenate([turning, beta * strains.hinge_stiffness[stiff]])
    return viscous(pairs, along, axial, rows, corners, hidden, hinges.per_hidden, turning)
