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
from foldyn.mechanics.assembly import Assembly, Numbering
from foldyn.mechanics.block_matrix import assembled, blocks_of_ends, pairs_of_ends
from foldyn.mechanics.membranes import Membranes
from foldyn.mechanics.sheet_term import NO_DOF, no_fold_hinges
from foldyn.mechanics.viscous import Viscous, viscous, viscous_matrix
from foldyn.mechanics.viscous_panels import viscous_panels


class Dampers(NamedTuple):
    """What a case has of them, on its m dofs in their own order."""

    constant: sparse.csr_array  # (m, m) N s/m
    elements: Viscous

    def matrix(self, q: NDArray) -> sparse.csr_array:
        """Matrix (m, m), N s/m, at the dofs q (m,)."""
        size = self.constant.shape[0]
        if not self.elements.present:
            return self.constant
        return sparse.csr_array(self.constant + viscous_matrix(self.elements, q, size))

    def placed(self, by: Numbering) -> Viscous:
        """Elements as they stand in memory while a motion is computed."""
        panels = self.elements.panels
        return self.elements._replace(
            dofs=placed(self.elements.dofs, by),
            panels=panels._replace(nodes=by.rank[panels.nodes].astype(np.int64)),
        )


def placed(dofs: NDArray, by: Numbering) -> NDArray:
    """Dofs of elements as they stand in memory while a motion is computed."""
    nodal = 3 * len(by.order)
    return np.where(dofs < nodal, by.dofs(np.minimum(dofs, nodal - 1)), dofs)


def dampers(case: Case, quasi_static: bool = False) -> Dampers:
    """Dampers of a case.

    Those of creases between panels that give way are left out: the hinge remembers what they do
    (`Case.remembering`). In slow motions it has the damping of its crease times the square of the
    crease's share in its turn; `quasi_static` counts them so.

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
    elements = _elements(case, body, nodes, ends, strength, quasi_static)
    return Dampers(sparse.csr_array(constant), elements)


def _elements(
    case: Case, body: Assembly, nodes: NDArray, pairs: NDArray, strength: list[NDArray],
    quasi_static: bool,
) -> Viscous:  # fmt: skip
    """Axial dashpots between pairs (p, 2) of nodes, damped creases, and what strains a sheet."""
    damping = case.crease_damping
    hinges = body.sheet.fold_hinges() if damping.any() else no_fold_hinges()
    unknown = np.setdiff1d(np.flatnonzero(damping), hinges.fold)
    if unknown.size:
        raise InputError(f"damping: this structure cannot damp crease {unknown[0]}: leave it out")
    coefficient = damping[hinges.fold] * hinges.length
    share = 1.0 - hinges.softness * hinges.stiffness
    coefficient = coefficient * np.where(hinges.remembers, share**2 * quasi_static, 1.0)
    damped = coefficient > 0.0
    axial, along = np.concatenate(strength), nodes[pairs[:, 1]] - nodes[pairs[:, 0]]
    rows, corners, hidden = hinges.nodes[damped], hinges.corners[damped], hinges.hidden[damped]
    hidden_turn, turning = hinges.hidden_turn[damped], coefficient[damped]
    membranes: tuple[Membranes, ...] = ()
    if beta := case.strain_damping:
        strains = body.strains()
        assert strains is not None  # or the case would have refused it
        stiff = strains.hinge_stiffness > 0.0
        none = np.full((int(stiff.sum()), 2), NO_DOF)
        alone = strains.bar_stiffness > 0.0
        pairs = np.concatenate([pairs, strains.bars[alone]])
        along = np.concatenate([along, strains.vector[alone]])
        axial = np.concatenate([axial, beta * strains.bar_stiffness[alone]])
        rows = np.concatenate([rows, strains.hinges[stiff]])
        corners = np.concatenate([corners, strains.corners[stiff]])
        hidden = np.concatenate([hidden, none])
        hidden_turn = np.concatenate([hidden_turn, np.zeros(none.shape)])
        turning = np.concatenate([turning, beta * strains.hinge_stiffness[stiff]])
        membranes = strains.membranes
    return viscous(
        pairs, along, axial, rows, corners, hidden, hidden_turn, turning,
        viscous_panels(membranes, beta),
    )  # fmt: skip
